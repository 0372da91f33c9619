//! A price as text and as JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use hpu_rtl::{Counts, HX8K_BRAM, HX8K_CELLS, SEEDS};
use hpu_study::limits::settling::Settling;
use hpu_study::map::outcome_name;
use serde_json::{Value, json};

use super::{Knob, Price, placed};

impl Price {
    /// Returns the price as text of at most 120 columns.
    pub fn text(&self) -> String {
        self.head_text() + &self.parts_text() + &self.knobs_text()
    }

    /// Returns the lines about the loop as a whole.
    pub(crate) fn head_text(&self) -> String {
        let Counts { lut4, ff, carry, bram, dsp } = self.cost.ecp5.unwrap_or(self.cost.ice40);
        let target = if self.cost.fits() { "iCE40 HX8K" } else { "ECP5; an HX8K is too small" };
        let text = format!(
            "price      {} of {}, {target}\n           measured by {}; VHDL {}\n           {lut4} LUT4, {ff} \
             flip-flops, {carry} carries, {bram} block RAMs, {dsp} multipliers\n           of an HX8K {} of \
             {HX8K_CELLS} cells, {} of {HX8K_BRAM} block RAMs\n",
            self.block,
            self.scene,
            self.tools.join(", "),
            self.hdl,
            self.cost.cells,
            self.cost.ice40.bram
        );
        text + &self.time_text()
    }

    fn parts_text(&self) -> String {
        let mut text = String::new();
        if !self.parts.is_empty() {
            let _ =
                writeln!(text, "{:<14} {:<24} {:>6} {:>6} {:>6}  by Yosys alone", "part", "", "lut4", "ff", "carry");
        }
        for (label, entity, Counts { lut4, ff, carry, .. }) in &self.parts {
            let _ = writeln!(text, "{label:<14} {entity:<24} {lut4:>6} {ff:>6} {carry:>6}");
        }
        text
    }

    /// Returns the lines about a bit less and a bit more of each width.
    pub(crate) fn knobs_text(&self) -> String {
        let mut text = String::new();
        if !self.knobs.is_empty() {
            let _ = writeln!(text, "{:<24} {:>9}  {:<34} one more", "a bit of", "now", "one less");
        }
        for Knob { key, now, other } in &self.knobs {
            let [less, more] = other.each_ref().map(|(name, found)| self.difference(name, found));
            let _ = writeln!(text, "{key:<24} {now:>9}  {less:<34} {more}");
        }
        text
    }

    fn difference(&self, name: &str, found: &Result<Counts, String>) -> String {
        let difference = |to: u64, from: u64| to.cast_signed() - from.cast_signed();
        match found {
            Ok(Counts { lut4, ff, .. }) => format!(
                "{name}: {:+} LUT4, {:+} ff",
                difference(*lut4, self.cost.ice40.lut4),
                difference(*ff, self.cost.ice40.ff)
            ),
            Err(_) => format!("{name}: not with this scene's words"),
        }
    }

    fn time_text(&self) -> String {
        let all: Vec<_> =
            placed(&self.cost).iter().map(|mhz| mhz.map_or("-".into(), |mhz| format!("{mhz:.2}"))).collect();
        let (Some(mhz), Some(path_ns), Some(clocks)) = (self.cost.fmax_mhz(), self.cost.path_ns(), self.clocks())
        else {
            let why = if self.cost.fits() { "nextpnr found no place for it" } else { "it does not fit" };
            return format!("clock      not timed: {why}\n");
        };
        let seeds = SEEDS.map(|seed| seed.to_string()).join(", ");
        let asked_mhz = self.clock_hz as f64 * 1e-6;
        let mut text = format!(
            "clock      {mhz:.2} MHz, the median of {} (seeds {seeds}); the scene runs at {asked_mhz} MHz\npath       \
             {path_ns:.1} ns from register to register: {clocks} clock{}",
            all.join(", "),
            if clocks == 1 { "" } else { "s" }
        );
        text += &match self.given {
            None => "\n".to_string(),
            Some(given) if given >= clocks => format!(", and the loop gives it {given}\n"),
            Some(given) => format!(", and the loop gives it {given}; write method.settling = {}\n", clocks - 1),
        };
        text + &self.notices.as_ref().map_or(String::new(), noticed)
    }

    /// Returns the price as JSON.
    pub fn json(&self) -> Value {
        let part =
            |(label, block, counts): &(&str, &str, Counts)| json!({ "label": label, "block": block, "counts": counts });
        let other = |(name, found): &(String, Result<Counts, String>)| match found {
            Ok(found) => json!({ "value": name, "counts": found, "failure": null }),
            Err(why) => json!({ "value": name, "counts": null, "failure": why }),
        };
        let knob = |knob: &Knob| {
            let [less, more] = knob.other.each_ref().map(other);
            json!({ "key": knob.key, "value": knob.now, "less": less, "more": more })
        };
        json!({
            "scene": self.scene,
            "block": self.block,
            "how": "measured",
            "tools": self.tools,
            "hdl": self.hdl.to_string(),
            "ice40": self.cost.ice40,
            "ecp5": self.cost.ecp5,
            "cells": self.cost.cells,
            "fits": self.cost.fits(),
            "fmax_mhz": self.cost.fmax_mhz(),
            "placed_mhz": placed(&self.cost),
            "path_ns": self.cost.path_ns(),
            "clock_hz": self.clock_hz,
            "clocks": { "needed": self.clocks(), "given": self.given },
            "settling": self.notices.as_ref().and_then(|found| found.as_ref().ok()).map(settling_json),
            "parts": self.parts.iter().map(part).collect::<Vec<_>>(),
            "knobs": self.knobs.iter().map(knob).collect::<Vec<_>>(),
        })
    }
}

/// Returns two lines on whether the loop notices the delay of its torque.
fn noticed(found: &Result<Settling, String>) -> String {
    let found = match found {
        Ok(found) => found,
        Err(why) => return format!("stability  not looked at: {why}\n"),
    };
    let Settling { clocks: [from, to], outcomes, errors, limits, lost_damping } = found;
    let off = |error: f64| if error == 0.0 { "unchanged".to_string() } else { format!("off by {error:.1e}") };
    let errors: Vec<_> = errors.iter().map(|(output, error)| format!("{} {}", output.name(), off(*error))).collect();
    let plural = if *to == 1 { "" } else { "s" };
    let limits = limits.each_ref().map(|limit| match limit {
        Ok(set) => set.turn(),
        Err(why) => why.to_string(),
    });
    format!(
        "stability  {} held back by {to} clock{plural} instead of {from}: {} instead of {}\n           {}\n           \
         {}\n           instead of {}\n           to first order the spring loses {lost_damping:.1e} of damping (SI)\n",
        if found.noticed() { "notices:" } else { "does not notice:" },
        outcome_name(Some(outcomes[1])),
        outcome_name(Some(outcomes[0])),
        errors.join(", "),
        limits[1],
        limits[0],
    )
}

fn settling_json(found: &Settling) -> Value {
    let limit = |set: &Result<hpu_study::limits::WordsSet, hpu_study::Error>| {
        set.as_ref().ok().map(|set| {
            let [failed, settled] =
                [set.lowest_failed(), set.highest_settled()].map(|seen| seen.map(|seen| seen.stiffness));
            json!({ "lowest_failed": failed, "highest_settled": settled, "unit": set.unit })
        })
    };
    let run = |index: usize| {
        json!({
            "settling": found.clocks[index],
            "outcome": outcome_name(Some(found.outcomes[index])),
            "in_words": limit(&found.limits[index]),
        })
    };
    let errors: BTreeMap<_, _> = found.errors.iter().map(|(output, error)| (output.name(), error)).collect();
    json!({
        "noticed": found.noticed(), "from": run(0), "to": run(1), "errors": errors, "lost_damping": found.lost_damping,
    })
}
