//! Tables of sines: their depth, their width, and ways to fill the gaps between their entries.
//!
//! Worst errors are *exhausted*: every count of both kinds of joint, sine and cosine. The workspace is counted cell by
//! cell. Block RAM is computed from the words. A register reads a full table, so the table fits into block RAM; its
//! words share blocks of 4096 bits, without the bits that are equal in all words, which Yosys leaves out. The other
//! sources have logic between their ROM and the register. No block RAM can hold such a ROM: it becomes lookup tables.

use std::fmt::Write;

use hpu_datapath::ConfigError;
use hpu_signal::Format;
use serde_json::{Value as Json, json};

use super::Config;
use super::datapath::{TrigOut, TrigTable, Turn};
use super::sines::{Sine, Source, sines_of};
use super::workspace::{CELLS, NOMINAL_MM, Workspace};
use crate::device::ToldTables;
use hpu_page::Page;

/// Bits of a block RAM of the iCE40.
const RAM_BITS: u64 = 4096;
/// Block RAMs of an HX8K.
const HX8K_RAMS: u64 = 32;

/// The tables of a design in other depths and widths, and the sources of sines that could replace them.
#[derive(Clone, PartialEq, Debug)]
pub struct Tables {
    /// Width of the counts that the design's own tables hold.
    pub depth_width: u32,
    /// Format of the design's own sines.
    pub format: Format,
    /// Every depth, with the design's words.
    pub depths: Vec<Depth>,
    /// Every source in every size, over the design's counts, and the block RAM of one joint.
    pub sources: Vec<(Sine, u64)>,
    /// The part of the workspace that the tables hold.
    pub workspace: Workspace,
}

/// Figures of the tables at one depth.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Depth {
    /// Width of the counts.
    pub width: u32,
    /// Greatest angle of joint 1 and of joint 2 in the tables, in degrees.
    pub reach_deg: [f64; 2],
    /// Block RAMs of three joints.
    pub rams: u64,
    /// Shares in percent that the tables hold: of the nominal workspace, and of the part of it that the links reach.
    pub held_percent: [f64; 2],
}

/// Returns the block RAMs of the iCE40 for a full table with two ports, sine and cosine.
///
/// # Errors
///
/// When the size is not allowed for a table.
pub fn table_rams(count_width: u32, depth_width: u32, turn: Turn, trig: Format) -> Result<u64, ConfigError> {
    let table = TrigTable::new(count_width, depth_width, turn, trig)?;
    let reach = 1i64 << (depth_width - 1);
    // Bits that are 0 in some word, and bits that are 1 in some word.
    let (mut zeros, mut ones) = ([0i64; 2], [0i64; 2]);
    for count in -reach..reach {
        let TrigOut { sine, cosine, .. } = table.at(count);
        for (port, word) in [sine, cosine].into_iter().enumerate() {
            zeros[port] |= !word;
            ones[port] |= word;
        }
    }
    let mask = (1i64 << trig.width()) - 1;
    let rams = |port: usize| {
        let bits = u64::from((zeros[port] & ones[port] & mask).count_ones());
        (bits << depth_width).div_ceil(RAM_BITS)
    };
    Ok(rams(0) + rams(1))
}

/// Computes the tables of a design.
///
/// # Errors
///
/// When a size is not allowed for a source.
pub fn tables(config: &Config) -> Result<Tables, ConfigError> {
    let Config { position_width, depth_width, turns, formats, .. } = *config;
    let workspace = Workspace::new(config, NOMINAL_MM, CELLS);
    let depths = workspace.held.iter().map(|&(width, held)| {
        let reach = f64::from(1u32 << (width - 1));
        let reach_deg = [turns[0], turns[1]].map(|turn| 360.0 * reach * f64::from(turn.num) / f64::from(turn.den));
        let rams = turns.map(|turn| table_rams(position_width, width, turn, formats.trig));
        let [first, second, third] = rams;
        let percent = |of: u64| 100.0 * held as f64 / of.max(1) as f64;
        let held_percent = [percent(workspace.cells), percent(workspace.cells - workspace.unreachable)];
        Ok(Depth { width, reach_deg, rams: first? + second? + third?, held_percent })
    });
    let depths = depths.collect::<Result<_, _>>()?;
    let sources = sines_of(config)?.into_iter().map(|sine| {
        let rams = match sine.source {
            Source::Table => table_rams(position_width, depth_width, turns[1], sine.format)?,
            Source::Quarter | Source::Interpolated | Source::Cordic => 0,
        };
        Ok((sine, rams))
    });
    let sources = sources.collect::<Result<_, _>>()?;
    Ok(Tables { depth_width, format: formats.trig, depths, sources, workspace })
}

impl Tables {
    /// Returns everything as text of at most 120 columns.
    pub fn text(&self) -> String {
        let mut text = format!(
            "tables     of sines, {} bits of count by {} here (*); worst errors exhausted over the counts of \
             joints 1 and 2\n\
             {:>10} {:>9} {:>9} {:>10} {:>12} {:>16}\n",
            self.depth_width,
            self.format,
            "depth bits",
            "joint 1",
            "joint 2",
            "block RAM",
            "% of the box",
            "% of the reached"
        );
        for Depth { width, reach_deg: [first, second], rams, held_percent: [all, reached] } in &self.depths {
            let mark = if *width == self.depth_width { '*' } else { ' ' };
            let fits = if *rams > HX8K_RAMS { "  more than an HX8K has" } else { "" };
            let _ = writeln!(
                text,
                "{mark}{width:>9} {first:>7.1} ° {second:>7.1} ° {rams:>10} {all:>12.1} {reached:>16.1}{fits}"
            );
        }
        text + &self.explained() + &self.sources_text()
    }

    /// Explains the origin of the published share of the workspace.
    fn explained(&self) -> String {
        let Workspace { cells, unreachable, missed_by, .. } = &self.workspace;
        let percent = |part: &u64| 100.0 * *part as f64 / *cells as f64;
        let [first, second, third] = missed_by.each_ref().map(percent);
        let [wide, high, deep] = NOMINAL_MM;
        let (bits, beyond) = (self.depth_width, percent(unreachable));
        let published = self.depths.iter().find(|depth| depth.width == 13);
        let published = published.map_or(String::new(), |Depth { held_percent: [all, reached], .. }| {
            format!(
                "           The paper tells of about 90 % at 13 bits: {all:.1} % of the box, {reached:.1} % of what \
                 the links reach of it. In the\n           rest a joint turns beyond the angles above.\n"
            )
        });
        format!(
            "           of a box of {deep} x {high} x {wide} mm, in {cells} cells (counted): {beyond:.1} % are beyond \
             the links; at {bits} bits the tables\n           of joint 1 miss {first:.1} %, of joint 2 {second:.1} %, \
             of joint 3 {third:.1} %.\n{published}"
        )
    }

    fn sources_text(&self) -> String {
        let mut text = format!(
            "{:<18} {:<30} {:<9} {:>16} {:>10} {:>11} {:>11}\n",
            "source", "size", "format", "ROM words x bits", "block RAM", "worst LSB", "worst urad"
        );
        for (sine, rams) in &self.sources {
            let rom =
                if sine.rom.words == 0 { "none".into() } else { format!("{} x {}", sine.rom.words, sine.rom.width) };
            let _ = writeln!(
                text,
                "{:<18}{}{:<30} {:<9} {rom:>16} {rams:>10} {:>11.3} {:>11.4}",
                sine.source.name(),
                if sine.default { '*' } else { ' ' },
                sine.size,
                sine.format.to_string(),
                sine.worst_lsb(),
                1e6 * sine.worst_rad
            );
        }
        text + "           block RAM: of one joint, computed from the words; 0 where logic follows the ROM, \
                which then is logic too\n"
    }

    /// Returns everything for `hpu widths`.
    pub fn told(&self) -> ToldTables {
        let mut page = Page::default();
        page.note(self.text()).data("depth_bits", self.depth_width);
        let depths = self.depths.iter().map(|depth| {
            json!({
                "bits": depth.width,
                "reach_deg": depth.reach_deg,
                "block_rams": depth.rams,
                "held_percent": depth.held_percent[0],
                "held_of_reached_percent": depth.held_percent[1],
            })
        });
        let sources = self.sources.iter().map(|(sine, rams)| {
            json!({
                "source": sine.source.name(),
                "size": sine.size,
                "format": [i32::from(sine.format.is_signed()), sine.format.int(), sine.format.frac()],
                "rom_words": sine.rom.words,
                "rom_width_bits": sine.rom.width,
                "block_rams": rams,
                "worst": sine.worst,
                "worst_rad": sine.worst_rad,
                "how": "exhausted",
            })
        });
        page.data("depths", depths.collect::<Json>()).data("sources", sources.collect::<Json>());
        ToldTables { page, csv: self.csv() }
    }

    /// Returns everything as CSV, the depths first, then the sources.
    pub fn csv(&self) -> String {
        let mut text =
            "depth_bits,joint_1_deg,joint_2_deg,block_rams,held_percent,held_of_reached_percent\n".to_string();
        for Depth { width, reach_deg: [first, second], rams, held_percent: [all, reached] } in &self.depths {
            let _ = writeln!(text, "{width},{first:.3},{second:.3},{rams},{all:.3},{reached:.3}");
        }
        text += "\nsource,size,format,rom_words,rom_width_bits,block_rams,worst,worst_lsb,worst_rad\n";
        for (sine, rams) in &self.sources {
            let Sine { source, size, format, rom, worst, worst_rad, .. } = sine;
            let _ = writeln!(
                text,
                "{},\"{size}\",\"{format}\",{},{},{rams},{worst:e},{:.4},{worst_rad:e}",
                source.name(),
                rom.words,
                rom.width,
                sine.worst_lsb()
            );
        }
        text
    }
}
