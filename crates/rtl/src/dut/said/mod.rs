//! What a design says while it is simulated, read line by line from the output of its simulator.
//!
//! GHDL writes the time of each message into it: `t.vhd:5:46:@201us:(assertion error): n is large`. A model of
//! Verilator's writes lines of its own around the design's text (`main.cpp`): the edge, a character, the text. The
//! character is `=` for text, `?` for text of only one of two models, `F` for the place of `$fatal` and `E` for
//! `$finish` and `$stop` with their place. VHDL that Verilator simulates gets its assertions back from its own source
//! ([`vhdl`]): GHDL's synthesis keeps where they stand and what they check, not what they say.

mod concurrent;
mod verilog;
mod vhdl;

pub(super) use concurrent::{errors, without};
pub(super) use verilog::fatal;
pub(super) use vhdl::{told, with_reports_asserted};

use hpu_cosim::dut::{End, Heard, Said, Severity};
use hpu_cosim::printable;
use hpu_cosim::scene::Dut;

use super::files::plain_names;

/// The most bytes of a line that are read; the rest is left out.
pub(super) const LONGEST: usize = 4096;
/// The message about an assertion that only one of two models has failed.
const UNSET: &str = "depends on a value that nothing has set";

/// The form of a simulator's messages.
#[derive(Clone, Copy)]
pub(super) enum Form {
    /// That of GHDL, whose time counts from the start of a reset of so many clock cycles.
    Ghdl {
        /// Half of a clock cycle, in femtoseconds.
        half_fs: u64,
        /// The clock cycles of the reset.
        settle: u64,
    },
    /// That of `main.cpp`.
    Verilator,
}

/// Reads the messages of a design.
pub(crate) struct Ears {
    form: Form,
    /// The files' names in the tools' folder, and their own.
    names: Vec<(String, String)>,
    pub(super) heard: Heard,
}

impl Ears {
    /// Hears a design in a simulator, which does not check the assertions that are `unchecked`.
    pub(super) fn new(form: Form, dut: &Dut, unchecked: Vec<String>) -> Self {
        let names = plain_names(dut).into_iter().filter(|(plain, own)| **plain != **own);
        let names = names.map(|(plain, own)| (plain.to_string(), own.to_string())).collect();
        Self { form, names, heard: Heard::unchecking(unchecked) }
    }

    /// Hears a line. Of what comes after the design has ended the run, only that of the same edge is heard.
    pub(super) fn line(&mut self, line: &str) {
        let line = &*printable(line);
        match self.form {
            Form::Ghdl { half_fs, settle } => self.of_ghdl(line, |fs| edge(fs, half_fs, settle)),
            Form::Verilator => self.of_model(line),
        }
    }

    fn of_ghdl(&mut self, line: &str, edge: impl Fn(u128) -> u64) {
        if self.heard.end.is_some() {
            return;
        }
        if let Some((place, fs, severity, text)) = ghdl(line) {
            let said = Said { edge: edge(fs), severity, place: self.own(place), text: text.to_string() };
            if severity == Severity::Failure {
                self.end(said.edge, "severity failure", said.place.clone());
            }
            return self.heard.take(said);
        }
        let ends = [("simulation finished @", "std.env.finish"), ("simulation stopped @", "std.env.stop")];
        for (start, by) in ends {
            let time = line.strip_prefix(start).and_then(|rest| femtoseconds(rest.split(' ').next()?));
            if let Some(fs) = time {
                return self.end(edge(fs), by, None);
            }
        }
        // What GHDL says of the library through which it talks to hpu.
        if !["loading VPI module './libhpu_vhpi.so'", "VPI module loaded!"].contains(&line) {
            self.heard.keep(None, line.to_string());
        }
    }

    fn of_model(&mut self, line: &str) {
        let mut parts = line.splitn(3, ' ');
        let (edge, kind, text) = (parts.next().and_then(|edge| edge.parse().ok()), parts.next(), parts.next());
        let (Some(edge), Some(kind), Some(text)) = (edge, kind, text) else {
            return self.heard.keep(None, line.to_string());
        };
        if self.heard.end.as_ref().is_some_and(|end| end.edge < edge) {
            return;
        }
        match (kind, verilog::tagged(text)) {
            ("E", _) => {
                let (what, at) = text.split_once(' ').unwrap_or((text, ""));
                let by = if what == "$stop" { "$stop" } else { "$finish" };
                self.end(edge, by, verilog::place(at).and_then(|place| self.own(place)));
            }
            ("F", _) => {
                let place = verilog::place(text).and_then(|place| self.own(place));
                self.heard.worsen(edge, place.as_ref());
                self.end(edge, "$fatal", place);
            }
            (_, Some((severity, place, text))) => {
                // A value that nothing has set is as good as any while the reset lasts.
                let (is_unset, is_early) = (kind == "?", edge == 0);
                let severity = if is_unset && is_early { severity.min(Severity::Warning) } else { severity };
                let text = if is_unset { format!("{text} ({UNSET})") } else { text.to_string() };
                let said = Said { edge, severity, place: self.own(place), text };
                if severity == Severity::Failure {
                    self.end(edge, "severity failure", said.place.clone());
                }
                self.heard.take(said);
            }
            (_, None) => self.heard.keep(Some(edge), text.to_string()),
        }
    }

    fn end(&mut self, edge: u64, by: &'static str, place: Option<(String, u32)>) {
        self.heard.end.get_or_insert(End { edge, by, place });
    }

    /// Returns a place with the file's own name.
    fn own(&self, (file, line): (&str, u32)) -> Option<(String, u32)> {
        let file = file.strip_prefix("./").unwrap_or(file);
        let own = self.names.iter().find(|(plain, _)| plain == file).map_or(file, |(_, own)| own);
        Some((own.to_string(), line))
    }
}

/// Returns the clock edge of a time: 0 before the first one after the reset. The clock of the bench rises at whole
/// cycles: `settle` times while the reset is active, and after the cycle in which it ends for the first edge.
fn edge(fs: u128, half_fs: u64, settle: u64) -> u64 {
    let rises = fs / (2 * u128::from(half_fs.max(1)));
    u64::try_from(rises.saturating_sub(u128::from(settle) + 1)).unwrap_or(u64::MAX)
}

/// Reads a message of GHDL's: its place, its time in femtoseconds, its severity and its text.
fn ghdl(line: &str) -> Option<((&str, u32), u128, Severity, &str)> {
    let (place, rest) = line.split_once(":@")?;
    let (time, rest) = rest.split_once(":(")?;
    let (kind, text) = rest.split_once("): ")?;
    let (place, _column) = place.rsplit_once(':')?;
    let (file, row) = place.rsplit_once(':')?;
    Some(((file, row.parse().ok()?), femtoseconds(time)?, severity(kind.rsplit(' ').next()?)?, text))
}

/// Reads what GHDL says of an assertion that fails whatever the inputs are: `t.vhd:18:2:(assertion note): wide`.
fn always(line: &str) -> Option<(Severity, (&str, u32), &str)> {
    let (place, rest) = line.split_once(":(assertion ")?;
    let (kind, text) = rest.split_once("): ")?;
    let (place, _column) = place.rsplit_once(':')?;
    Some((severity(kind)?, verilog::place(place)?, text))
}

/// Returns the severity of this name in VHDL.
fn severity(name: &str) -> Option<Severity> {
    let all = [Severity::Note, Severity::Warning, Severity::Error, Severity::Failure];
    all.into_iter().find(|severity| name.eq_ignore_ascii_case(severity.name()))
}

/// Reads a time as GHDL writes it, such as `201us`.
fn femtoseconds(time: &str) -> Option<u128> {
    let (number, unit) = time.split_at(time.find(|c: char| !c.is_ascii_digit())?);
    let powers = [("fs", 0), ("ps", 3), ("ns", 6), ("us", 9), ("ms", 12), ("sec", 15), ("min", 15), ("hr", 15)];
    let (name, power) = powers.into_iter().find(|(name, _)| *name == unit)?;
    let seconds = match name {
        "min" => 60,
        "hr" => 3600,
        _ => 1,
    };
    number.parse::<u128>().ok()?.checked_mul(10u128.pow(power) * seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ears(form: Form) -> Ears {
        Ears { form, names: vec![("_a_b.vhd".into(), "a b.vhd".into())], heard: Heard::default() }
    }

    #[test]
    fn messages_of_ghdl_have_the_edge_after_which_they_are_said() {
        // 1 MHz, a reset of two cycles: edges of the reset rise at 0.5 us and 1.5 us, the first one after it at 2.5 us.
        let mut ears = ears(Form::Ghdl { half_fs: 500_000_000, settle: 2 });
        for line in [
            "t.vhd:18:2:@0ms:(assertion error): too narrow",
            "t.vhd:5:46:@2us:(assertion error): in the reset",
            "t.vhd:5:46:@4us:(assertion error): first",
            "_a_b.vhd:9:1:@4999999ps:(report warning): not yet: the second",
            "t.vhd:5:46:@5us:(assertion error): second",
            "some text",
            "t.vhd:6:1:@1sec:(assertion failure): over",
            "ghdl:error: assertion failed",
        ] {
            ears.line(line);
        }
        let heard = &ears.heard;
        let failures: Vec<_> = heard.failures.iter().map(|f| (f.first.edge, &*f.first.text, f.times)).collect();
        assert_eq!(failures, [(0, "too narrow", 1), (0, "in the reset", 3), (999_997, "over", 1)]);
        assert!(heard.messages.contains(&(Some(1), "warning: a b.vhd:9: not yet: the second".into())));
        assert!(heard.messages.contains(&(None, "some text".into())));
        let end = heard.end.as_ref().expect("an end");
        assert_eq!((end.edge, end.by, end.place.clone()), (999_997, "severity failure", Some(("t.vhd".into(), 6))));
    }

    #[test]
    fn finish_of_vhdl_ends_the_run_and_is_no_failure() {
        let mut ears = ears(Form::Ghdl { half_fs: 500_000_000, settle: 0 });
        ears.line("simulation finished @11us with status 3");
        assert_eq!(ears.heard.end, Some(End { edge: 10, by: "std.env.finish", place: None }));
        assert_eq!(ears.heard.failed(), 0);
    }

    #[test]
    fn messages_of_a_model_have_severity_place_and_text() {
        let mut ears = ears(Form::Verilator);
        for line in [
            "0 ? [0] %Error: t.sv:4: Assertion failed in top.t: n too large",
            "3 = [0] %Error: t.sv:4: Assertion failed in top.t: n too large 5",
            "3 = [0] %Error: t.sv:4: Assertion failed in top.t: n too large 5",
            "4 = [0] %Warning: t.sv:5: Assertion failed in top.t: warn",
            "5 = n is 5: fine",
            "6 ? %Error: t.vhd:4: made up",
            "7 = [0] %Error: t.sv:9: Assertion failed in top.t: fatal",
            "7 F t.sv:9",
            "8 = more",
        ] {
            ears.line(line);
        }
        let failures: Vec<_> = ears.heard.failures.iter().map(|f| (f.first.edge, &*f.first.text, f.times)).collect();
        let unset = "made up (depends on a value that nothing has set)";
        assert_eq!(failures, [(3, "n too large 5", 1), (6, unset, 1), (7, "fatal", 1)]);
        assert_eq!(ears.heard.failures[2].first.severity, Severity::Failure);
        assert_eq!(ears.heard.end, Some(End { edge: 7, by: "$fatal", place: Some(("t.sv".into(), 9)) }));
        let kept: Vec<_> = ears.heard.messages.iter().map(|(edge, _)| *edge).collect();
        assert_eq!(kept, [0, 3, 4, 5, 6, 7].map(Some));
    }
}
