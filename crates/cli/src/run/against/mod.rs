//! A run beside the log of a real device, or of another simulator.

use std::path::Path;

use hpu_chart::{self as chart, Picture};
use hpu_cosim::replay::{Taken, Unit};
use hpu_cosim::scene::Log;
use hpu_cosim::{AnySimulation, LogBeside, LogHeld, Summary, figure, read_plain};
use hpu_page::Page;
use hpu_signal::Cycle;

use crate::scene::Loaded;
use crate::shell::{Failure, verdict};
use crate::units::si;

/// A log that a run is to be held beside.
pub(in crate::run) struct Against {
    /// The observer.
    pub log: LogBeside,
    /// The greatest difference that is accepted, if one is given.
    pub rms: Option<f64>,
    file: String,
    taken: Taken,
    unit: &'static str,
    count: f64,
}

/// A run beside a log.
pub struct Held {
    held: LogHeld,
    /// The greatest root mean square, if it is judged.
    most: Option<f64>,
    file: String,
    taken: Taken,
    unit: &'static str,
    count: f64,
}

impl Against {
    /// Reads the log that the command (`named`) or the scene names; `None` if neither names one. A scene's own log is
    /// of its whole duration: it is not read for a run that `is_short`.
    pub fn open(
        named: Option<&Path>,
        is_short: bool,
        loaded: &Loaded,
        simulation: &AnySimulation,
    ) -> Result<Option<Self>, Failure> {
        let scene = &loaded.scene;
        let log = match (&scene.expect.recording, named) {
            (None, None) => return Ok(None),
            (Some(_), None) if is_short => return Ok(None),
            (Some(log), _) => log.clone(),
            (None, Some(_)) => Log::default(),
        };
        let file = named.map_or(log.file.clone(), |file| file.display().to_string());
        let failed = |reason: String| match named {
            Some(_) => Failure::file(reason),
            None => Failure::file(scene.error("expect.recording", reason)),
        };
        let bytes = named.map_or_else(|| loaded.data(&file), read_plain);
        let bytes = bytes.map_err(|error| failed(format!("cannot read `{file}`: {error}")))?;
        let count = LogBeside::count(scene).map_err(|error| failed(error.to_string()))?;
        let unit = scene.setup().units().position;
        let kind = if unit == "m" { Unit::Length } else { Unit::Angle };
        let (motion, taken) = log.read(&bytes, kind).map_err(|error| failed(format!("{file}:{error}")))?;
        let rms = log.rms;
        let log = LogBeside::new(simulation, count, &log, &motion);
        let log = log.map_err(|error| failed(error.to_string()))?;
        Ok(Some(Self { log, rms, file, taken, unit, count }))
    }

    /// Finds the shift at which a run that is over and the log differ least.
    pub fn finish(self, summary: &Summary, is_judged: bool) -> Result<Held, Failure> {
        let Self { log, rms, file, taken, unit, count } = self;
        let held =
            log.finish(Cycle(summary.edges), None).map_err(|reason| Failure::file(format!("{file}: {reason}")))?;
        Ok(Held { held, most: rms.filter(|_| is_judged), file, taken, unit, count })
    }
}

impl Held {
    /// Whether the run is near enough to the log, or need not be.
    pub fn ok(&self) -> bool {
        self.most.is_none_or(|most| self.held.rms <= most)
    }

    /// Whether the scene says how near the run must be.
    pub fn is_judged(&self) -> bool {
        self.most.is_some()
    }

    /// Returns what is told of it.
    pub fn page(&self) -> Page {
        let Self { held, most, file, taken, unit, count } = self;
        let mut page = Page::default();
        page.data("file", file).data("columns", &taken.columns).data("notes", &taken.notes);
        page.data("column", held.column).data("rows", held.rows.len()).data("left_out", held.left_out);
        page.data("shift", held.shift).data("step_s", held.step_s).data("shift_of_halves", held.halves);
        page.data("rms", held.rms).data("mean", held.mean).data("greatest", held.greatest);
        page.data("rms_counts", held.rms / count);
        page.data("unit", *unit).data("most", *most).data("met", most.map(|_| self.ok()));
        let left_out = match held.left_out {
            0 => String::new(),
            some => format!(", {some} outside the run left out"),
        };
        let columns = taken.columns.join(", ");
        page.line("log", format!("{file}: {columns}; {} rows beside {}{left_out}", held.rows.len(), held.column));
        for note in &taken.notes {
            page.line("", note);
        }
        let [rms, mean, greatest] = [held.rms, held.mean, held.greatest].map(|size| si(size, unit));
        let counts = figure((100.0 * held.rms / count).round() / 100.0);
        page.line("", format!("the run less the log: rms {rms} ({counts} counts), mean {mean}, at most {greatest}"));
        let step = si(held.step_s, "s");
        let [first, second] = held.halves;
        page.line("", format!("shift of {} steps of {step}", held.shift));
        if first != second {
            let halves = format!("{first} for its first half alone, {second} for its second");
            page.line("", format!("{halves}: a clock drifts, or the motions differ"));
        }
        if let Some(most) = most {
            let met = verdict(if self.ok() { "met" } else { "NOT MET" }, self.ok());
            page.line("expected", format!("rms at most {}: {rms}, {met}", si(*most, unit)));
        }
        page
    }

    /// Draws it.
    pub fn picture(&self, command: &str) -> Picture {
        let rms = si(self.held.rms, self.unit);
        let title = format!("{}: the run and the log, {rms} rms apart", self.name());
        chart::log_beside(&title, &self.held, self.unit, command)
    }

    /// Returns its rows as a table.
    pub fn csv(&self) -> String {
        let unit = self.unit;
        let mut text = format!("# {}\ntime_s,log_{unit},run_{unit},run_less_log_{unit}\n", self.name());
        for [time_s, log, run] in &self.held.rows {
            let cells = [*time_s, *log, *run, run - log].map(figure);
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        text
    }

    /// Returns the name of the file, without its folders.
    fn name(&self) -> &str {
        self.file.rsplit(['/', '\\']).next().unwrap_or(&self.file)
    }
}
