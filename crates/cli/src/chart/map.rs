//! `hpu chart` over a map: the share of cells in which each contestant's verdict is wrong.

use std::path::PathBuf;

use hpu_chart as chart;
use hpu_study::accuracy::{Plan, Race, Share, Tour, front_of_shares};
use hpu_study::map::{Axis, MapError};
use serde_json::{Value, json};

use crate::chart::Args;
use crate::chart::text::rate;
use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::journal;
use crate::scene::Source;
use crate::terminal::{print, print_json, with_progress};
use crate::{interrupt, pictures};

/// Runs `hpu chart --x --y`.
pub fn run(args: &Args, source: &Source, race: Race, axes: (Axis, Axis)) -> Result<Exit, Failure> {
    let mut load = |file: &str| source.load(file);
    let tour = Tour::new(race, axes, !args.contestants.is_empty(), &mut load).map_err(|error| match error {
        MapError::Method(..) => Failure::file(error),
        _ => Failure::usage(error),
    })?;
    let command = args.command();
    let files = tour.map.scene.files.iter().flat_map(|(name, bytes)| [name.as_bytes(), bytes]);
    let parts = [tour.map.scene.text.as_bytes()].into_iter().chain(files);
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let (mut journal, done) =
        journal::resume(args.out.as_deref(), tour.units(), || journal::header("chart", parts, &command))?;

    let control = interrupt::heed();
    let mut kept = done.len();
    let shares = with_progress((tour.units() - done.len()) as u64, "cells", control, || {
        tour.run(Plan::usual(args.jobs.get()), done, control, |index, row| {
            kept += 1;
            journal.as_mut().map_or(Ok(()), |journal| journal.add(index, row))
        })
    })?;
    let Some(shares) = shares else {
        if args.json {
            let (scene, units) = (&tour.race.written.name, tour.units());
            print_json(&json!({ "scene": scene, "complete": false, "done": kept, "cells": units }))?;
        } else {
            print(&format!("interrupted after {kept} of {} cells\n", tour.units()))?;
        }
        return Ok(Exit::Interrupted);
    };
    let toured = Toured { tour, shares, command: command + &args.out_option(), files: Vec::new() };
    toured.tell(folder, args.json)
}

/// A complete tour.
struct Toured {
    tour: Tour,
    shares: Vec<Share>,
    command: String,
    files: Vec<PathBuf>,
}

impl Toured {
    fn tell(mut self, folder: Option<Folder>, as_json: bool) -> Result<Exit, Failure> {
        if let Some(mut folder) = folder {
            folder.write("chart.csv", self.csv())?;
            let name = &self.tour.race.written.name;
            pictures::put(&chart::shares(name, &self.tour.map, &self.shares, &self.command), &mut folder)?;
            self.files = folder.places().map(PathBuf::from).collect();
            folder.commit()?;
        }
        if as_json {
            print_json(&self.object())?
        } else {
            print(&self.text())?
        }
        Ok(Exit::Fine)
    }

    fn csv(&self) -> String {
        let front = front_of_shares(&self.shares);
        let mut text = format!(
            "# {}\ncontestant,family,step_s,cells,wrong,share,motion_per_wall,edges_per_s,front\n",
            self.command
        );
        let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
        for (index, share) in self.shares.iter().enumerate() {
            let Share { contestant, cells, wrong, speed } = share;
            text += &format!(
                "{},{},{},{cells},{wrong},{},{},{},{}\n",
                contestant.name,
                contestant.family,
                number(contestant.step_s),
                number(share.share()),
                number(speed.map(|speed| speed.motion_per_wall())),
                number(speed.map(|speed| speed.edges_per_s())),
                front.contains(&index),
            );
        }
        text
    }

    fn text(&self) -> String {
        let Self { tour, shares, command, files } = self;
        let mut text =
            format!("$ {command}\n\n{} cells, the verdict of each against the scene as written\n\n", tour.map.layer());
        text += &format!(
            "  {:<30} {:>11} {:>10}  {:>8} {:>8}\n",
            "contestant", "motion/wall", "edges/s", "wrong", "of cells"
        );
        let front = front_of_shares(shares);
        for (index, Share { contestant, cells, wrong, speed }) in shares.iter().enumerate() {
            let mark = if front.contains(&index) { '*' } else { ' ' };
            let told =
                |of: fn(hpu_study::accuracy::Speed) -> f64| speed.map_or("-".to_string(), |speed| rate(of(speed)));
            text += &format!(
                "{mark} {:<30} {:>11} {:>10}  {wrong:>8} {cells:>8}\n",
                contestant.name,
                told(|speed| speed.motion_per_wall()),
                told(|speed| speed.edges_per_s()),
            );
        }
        text += "\n* beaten by none in both speed, at the middle cell, and share of wrong verdicts\n";
        for (contestant, why) in &tour.refused {
            text += &format!("not of this scene: {why}\n")
                .replace(&format!("method {}", contestant.name), &contestant.name);
        }
        text + &files.iter().map(|file| format!("file       {}\n", file.display())).collect::<String>()
    }

    fn object(&self) -> Value {
        let Self { tour, shares, command, files } = self;
        let front = front_of_shares(shares);
        let rows: Vec<Value> = shares
            .iter()
            .enumerate()
            .map(|(index, share)| {
                json!({
                    "name": share.contestant.name,
                    "family": share.contestant.family,
                    "step_s": share.contestant.step_s,
                    "cells": share.cells,
                    "wrong": share.wrong,
                    "share": share.share(),
                    "motion_per_wall": share.speed.map(|speed| speed.motion_per_wall()),
                    "edges_per_s": share.speed.map(|speed| speed.edges_per_s()),
                    "front": front.contains(&index),
                })
            })
            .collect();
        let refused: Vec<Value> =
            tour.refused.iter().map(|(who, why)| json!({ "name": who.name, "reason": why })).collect();
        json!({
            "scene": tour.race.written.name,
            "command": command,
            "complete": true,
            "cells": tour.map.layer(),
            "contestants": rows,
            "refused": refused,
            "files": files,
        })
    }
}
