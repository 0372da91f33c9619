//! Messages of Verilog, as Verilator prints them.

use std::fmt::Write as _;

use hpu_cosim::dut::Severity;
use hpu_cosim::scene::Dut;

use crate::dut::files::plain_names;

/// A message with its severity: its place, and its text.
pub(super) type Tagged<'t> = (Severity, (&'t str, u32), &'t str);

/// Reads a message with a severity, such as `[0] %Error: t.sv:4: Assertion failed in top.t: n is too large`; `None` for
/// other text.
pub(super) fn tagged(text: &str) -> Option<Tagged<'_>> {
    let untimed = text.strip_prefix('[').and_then(|rest| rest.split_once("] "));
    let text = untimed.map_or(text, |(_, rest)| rest);
    let tags = [
        ("%Error: ", Severity::Error),
        ("%Fatal: ", Severity::Failure),
        ("%Warning: ", Severity::Warning),
        ("-Info: ", Severity::Note),
    ];
    let (severity, rest) = tags.into_iter().find_map(|(tag, severity)| Some((severity, text.strip_prefix(tag)?)))?;
    let (at, rest) = rest.split_once(": ")?;
    let said = rest.strip_prefix("Assertion failed in ").and_then(|rest| rest.split_once(": "));
    let said = said.map_or(rest, |(_, said)| said);
    // A choice that the design has promised to be complete or unique: other simulators warn of it, too.
    let is_promise =
        ["unique", "priority", "synthesis"].iter().any(|word| said.trim_start_matches('\'').starts_with(word));
    let severity = if is_promise { severity.min(Severity::Warning) } else { severity };
    Some((severity, place(at)?, said))
}

/// Reads a place, `file:line`.
pub(super) fn place(at: &str) -> Option<(&str, u32)> {
    let (file, line) = at.rsplit_once(':')?;
    Some((file, line.parse().ok()?))
}

/// Returns the places of `$fatal` in the files of a design, as rows of an array in C++. Verilator itself does not tell
/// `$fatal` from `$error`.
pub(in crate::dut) fn fatal(dut: &Dut) -> String {
    let mut rows = String::new();
    let files = plain_names(dut).into_iter().zip(&dut.files);
    let files = files.map(|((plain, _), (_, content))| (plain.to_string(), &content[..]));
    let base = |place: &str| place.rsplit('/').next().unwrap_or_default().to_string();
    for (plain, content) in files.chain(dut.beside.iter().map(|file| (base(&file.place), &file.content[..]))) {
        // A name that is none in C++ is that of a file without code.
        if plain.contains(['"', '\\']) {
            continue;
        }
        let text = String::from_utf8_lossy(content);
        for (index, _) in text.lines().enumerate().filter(|(_, line)| line.contains("$fatal")) {
            let _ = write!(rows, "{{\"{plain}\", {}}}, ", index + 1);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_with_a_severity_are_told_from_other_text() {
        let of = |text: &'static str| tagged(text).map(|(severity, (file, line), said)| (severity, file, line, said));
        let info = "[120] -Info: a.svh:8: Assertion failed in top.t: info: 3";
        assert_eq!(of(info), Some((Severity::Note, "a.svh", 8, "info: 3")));
        assert_eq!(of("%Error: t.vhd:8: n is large"), Some((Severity::Error, "t.vhd", 8, "n is large")));
        let unique = "[0] %Error: t.sv:8: Assertion failed in top.t: unique case, but none matched for '2'h3'";
        assert_eq!(of(unique).map(|told| told.0), Some(Severity::Warning));
        for other in ["n is 5", "[0] n is 5", "%Error: of mine", "Error: t.sv:8: mine"] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
