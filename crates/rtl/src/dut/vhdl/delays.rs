//! The delays of VHDL, `after 5 us`, which synthesis leaves out without a word.

use hpu_cosim::scene::Dut;

use super::text::{Token, joined, plain, tokens};
use crate::dut::text::delay::{Delay, time_s};

/// Returns the delays of a design in VHDL, in the order of its files.
pub(in crate::dut) fn delays(dut: &Dut) -> Vec<Delay> {
    let texts: Vec<_> = dut.files.iter().map(|(_, content)| plain(content)).collect();
    let sources: Vec<_> = texts.iter().map(|text| (text.as_str(), tokens(text))).collect();
    let mut all = Vec::new();
    for ((name, _), (text, tokens)) in dut.files.iter().zip(&sources) {
        for (at, _) in tokens.iter().enumerate().filter(|(_, token)| token.is("after")) {
            let (first, expression) = (&tokens[at], expression(&tokens[at + 1..]));
            let length_s = match expression {
                [name] if name.is_word() => constant_s(&sources, name.text),
                _ => time_s(&joined(text, expression)),
            };
            // Without a delay it is a delta cycle, as after synthesis.
            if length_s == Some(0.0) {
                continue;
            }
            let line = 1 + text[..first.at].matches('\n').count();
            let text = joined(text, expression);
            all.push(Delay { place: format!("{name}:{line}"), text: format!("after {text}"), length_s });
        }
    }
    all
}

/// Returns the tokens up to the end of an expression.
fn expression<'a, 't>(tokens: &'a [Token<'t>]) -> &'a [Token<'t>] {
    let mut depth = 0;
    let is_end = |token: &Token| {
        depth += i32::from(token.text == "(") - i32::from(token.text == ")");
        depth < 0 || depth == 0 && [",", ";"].contains(&token.text)
    };
    &tokens[..tokens.iter().position(is_end).unwrap_or(tokens.len())]
}

/// Returns the seconds of a constant or generic, `NAME : time := 5 ns`: the longest where several have the name. `None`
/// unless all of them are written in numbers.
fn constant_s(sources: &[(&str, Vec<Token>)], name: &str) -> Option<f64> {
    let mut longest = None;
    for (text, tokens) in sources {
        for five in tokens.windows(5) {
            let [constant, colon, kind, becomes, first] = five else { continue };
            let is_time = kind.is("time") || kind.is("delay_length");
            if constant.is(name) && colon.text == ":" && is_time && becomes.text == ":=" {
                let from = tokens.iter().position(|token| token == first)?;
                let length_s = time_s(&joined(text, expression(&tokens[from..])))?;
                longest = Some(length_s.max(longest.unwrap_or(0.0)));
            }
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use hpu_signal::Clock;

    use super::*;

    #[test]
    fn delays_are_found_at_their_lines_with_their_lengths() {
        let text = "-- after 1 ns\n\
                    entity t is generic (TCQ : time := 1 ns; D : delay_length := 2 us); port (x : in bit);\n\
                    a <= b after TCQ, c AFTER 5 us;\nd <= transport e after\n  D;\nf <= g after P / 2;\n\
                    h <= i after 0 ns;";
        let dut = Dut { files: vec![("rtl/t.vhd".to_string(), Arc::from(text.as_bytes()))], ..Dut::pins() };
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
    }
}
