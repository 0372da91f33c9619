//! `hpu reproduce`, two of its studies: the words of the arm's datapath.

use std::path::PathBuf;

use hpu_chart as chart;
use hpu_papers::phantom::formats::{self, Formats, POSTURES, formats_csv, formats_text, full_scales_nm};
use hpu_papers::phantom::{DEVICE, FORMATS, SINES};
use hpu_study::phantom::sines::{self, Sine, sines_csv, sines_text};
use hpu_study::phantom::workspace::Workspace;
use serde_json::{Value, json};

use crate::beside::claim;
use crate::notation::{Written, triple};
use crate::page::give;
use crate::shell::{Exit, Failure, Folder};

/// Where to.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Write text, CSV and picture into this folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    notation: Written,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the study [`FORMATS`].
pub fn formats(args: &Args) -> Result<Exit, Failure> {
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let command = &format!("hpu reproduce {FORMATS}");
    let all = formats::words().into_iter().map(|words| Formats::new(words, POSTURES));
    let all = all.collect::<Result<Vec<_>, _>>().map_err(Failure::file)?;
    let workspace = Workspace::nominal();
    let text = format!(
        "{DEVICE}: words, ranges and errors\n$ {command}\n\n{}",
        formats_text(&all, &workspace, args.notation.get())
    );
    let files = || {
        let tables = [("formats.csv".into(), formats_csv(&all)), ("workspace.csv".into(), workspace.csv())];
        let files = [("formats.txt".into(), text.clone())].into_iter().chain(tables).collect();
        (files, vec![chart::formats(&all, command)])
    };
    let held = |(bits, held): &(u32, u64)| json!({ "depth_bits": bits, "cells": held });
    let object = json!({
        "study": FORMATS,
        "complete": true,
        "command": command,
        "postures": POSTURES,
        "configurations": all.iter().map(configuration).collect::<Vec<_>>(),
        "workspace": {
            "cells": workspace.cells,
            "unreachable": workspace.unreachable,
            "held": workspace.held.iter().map(held).collect::<Vec<_>>(),
        },
        "plain": formats::plain(&all),
        "claims": formats::sums(&all, &workspace).iter().map(claim).collect::<Vec<_>>(),
    });
    give((&text, object), folder, args.json, || Ok(files()))?;
    Ok(Exit::Fine)
}

fn configuration(formats: &Formats) -> Value {
    let signal = |row: &formats::SignalRange| {
        let proved = row.proved;
        json!({
            "name": proved.name,
            "unit": proved.unit,
            "format": triple(proved.format),
            "proved": [proved.min, proved.max],
            // Without a bound there is no number.
            "proved_error": proved.error.is_finite().then_some(proved.error),
            "measured": row.measured.map(|measured| [measured.min, measured.max]),
            "measured_error": row.measured.map(|measured| measured.error),
            "headroom_bits": row.headroom_bits(),
            "overflow": row.fate().name(),
        })
    };
    json!({
        "name": formats.words.name,
        "about": formats.words.about,
        "stiffness_max_n_per_m": formats.words.stiffness_max_n_per_m,
        "full_scale_nm": full_scales_nm(&formats.words.config),
        "signals": formats.rows.iter().map(signal).collect::<Vec<_>>(),
    })
}

/// Runs the study [`SINES`].
pub fn sines(args: &Args) -> Result<Exit, Failure> {
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let command = &format!("hpu reproduce {SINES}");
    let all = sines::sines().map_err(Failure::file)?;
    let text = format!("{DEVICE}: four sources of sine\n$ {command}\n\n{}", sines_text(&all, args.notation.get()));
    let files = || {
        let files = vec![("sines.txt".into(), text.clone()), ("sines.csv".into(), sines_csv(&all))];
        (files, vec![chart::sines(&all, command)])
    };
    let sources = all.iter().map(source).collect::<Vec<_>>();
    let object = json!({ "study": SINES, "complete": true, "command": command, "sources": sources });
    give((&text, object), folder, args.json, || Ok(files()))?;
    Ok(Exit::Fine)
}

fn source(sine: &Sine) -> Value {
    json!({
        "name": sine.source.name(),
        "size": sine.size,
        "default": sine.default,
        "format": triple(sine.format),
        "rom": { "words": sine.rom.words, "width": sine.rom.width, "bits": sine.rom.bits() },
        "worst": sine.worst,
        "rms": sine.rms,
        "worst_lsb": sine.worst_lsb(),
        "worst_rad": sine.worst_rad,
        "angles": sine.angles,
        "latency_edges": 1,
        "arithmetic": sine.source.arithmetic(),
    })
}
