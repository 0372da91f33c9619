//! The delays of VHDL, `after 5 us`, which synthesis leaves out without a word.

use hpu_cosim::scene::Dut;

use super::delay::{Delay, time_s};
use super::{bare, words};

/// Returns the delays of a design in VHDL, in the order of its files.
pub(in crate::dut) fn delays(dut: &Dut) -> Vec<Delay> {
    let texts: Vec<_> = dut.files.iter().map(|(_, content)| bare(&String::from_utf8_lossy(content), "--")).collect();
    let overridden = |name: &str| dut.generics.iter().find(|(generic, _)| generic.eq_ignore_ascii_case(name));
    let mut all = Vec::new();
    for ((name, _), text) in dut.files.iter().zip(&texts) {
        for (at, expression) in waveforms(text) {
            let length_s = time_s(expression).or_else(|| match overridden(expression) {
                Some((_, value)) => time_s(&value.to_string()),
                None => constant_s(&texts, expression),
            });
            // Without a delay it is a delta cycle, as after synthesis.
            if length_s == Some(0.0) {
                continue;
            }
            let line = 1 + text[..at].matches('\n').count();
            let text = expression.split_whitespace().collect::<Vec<_>>().join(" ");
            all.push(Delay { place: format!("{name}:{line}"), text: format!("after {text}"), length_s });
        }
    }
    all
}

/// Returns the expression behind each word `after` of a text, with the word's position.
fn waveforms(text: &str) -> impl Iterator<Item = (usize, &str)> {
    words(text).filter(|(_, word)| word.eq_ignore_ascii_case("after")).map(|(at, word)| {
        let rest = &text[at + word.len()..];
        let mut depth = 0;
        let end = rest.find(|c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth < 0 || depth == 0 && ",;".contains(c)
        });
        (at, rest[..end.unwrap_or(rest.len())].trim())
    })
}

/// Returns the seconds of a constant or generic, `NAME : time := 5 ns`: the longest where several have the name. `None`
/// unless all of them are written in numbers.
fn constant_s(texts: &[String], name: &str) -> Option<f64> {
    let mut longest = None;
    for text in texts {
        for (at, word) in words(text).filter(|(_, word)| word.eq_ignore_ascii_case(name)) {
            let Some(rest) = text[at + word.len()..].trim_start().strip_prefix(':') else { continue };
            let end = rest.find([';', ')']).unwrap_or(rest.len());
            let Some((kind, value)) = rest[..end].split_once(":=") else { continue };
            if ["time", "delay_length"].iter().any(|time| kind.trim().eq_ignore_ascii_case(time)) {
                longest = Some(time_s(value)?.max(longest.unwrap_or(0.0)));
            }
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use hpu_cosim::scene::{Generic, Identifier};
    use hpu_signal::Clock;

    use super::*;

    #[test]
    fn delays_are_found_at_their_lines_with_their_lengths() {
        let text = "-- after 1 ns\nentity t is generic (TCQ : time := 1 ns; D : delay_length := 2 us); port (x : in bit);\n\
                    a <= b after TCQ, c AFTER 5 us;\nd <= transport e after\n  D;\nf <= g after P / 2;\nh <= i after 0 ns;";
        let mut dut = Dut { files: vec![("rtl/t.vhd".to_string(), Arc::from(text.as_bytes()))], ..Dut::pins() };
        let shown =
            |dut: &Dut| delays(dut).iter().map(|delay| format!("{delay} {:?}", delay.length_s)).collect::<Vec<_>>();
        let all = [
            "rtl/t.vhd:3: `after TCQ` Some(1e-9)",
            "rtl/t.vhd:3: `after 5 us` Some(4.9999999999999996e-6)",
            "rtl/t.vhd:4: `after D` Some(2e-6)",
            "rtl/t.vhd:6: `after P / 2` None",
        ];
        assert_eq!(shown(&dut)[0], all[0]);
        assert_eq!(shown(&dut)[2..], all[2..]);
        let clock = Clock::new(1_000_000).expect("a clock");
        let short: Vec<_> = delays(&dut).iter().map(|delay| delay.is_short(clock)).collect();
        assert_eq!(short, [true, false, false, false]);
        dut.generics = vec![(Identifier::fixed("tcq"), Generic::Text("600 ns".to_string()))];
        assert!(!delays(&dut)[0].is_short(clock));
    }
}
