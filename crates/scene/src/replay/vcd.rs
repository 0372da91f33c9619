//! VCD as simulators and loggers write it: IEEE 1364's, GHDL's with the nine values of std_logic, extended VCD.

use super::ReplayError;
use super::channel::{Capture, Channel, Lines, Variable, bit_of, find_both, level, range};
use crate::text::message::excerpt;

/// The tokens of a text and their lines.
struct Tokens<'a> {
    rest: &'a [u8],
    line: u64,
}

impl<'a> Tokens<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let from = self.rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        self.line += self.rest[..from].iter().filter(|byte| **byte == b'\n').count() as u64;
        let token = &self.rest[from..];
        let end = token.iter().position(u8::is_ascii_whitespace).unwrap_or(token.len());
        self.rest = &token[end..];
        Some(&token[..end])
    }

    fn wrong(&self, reason: impl AsRef<str>) -> ReplayError {
        ReplayError::new(self.line, format!("not VCD: {}", reason.as_ref()))
    }

    /// Returns the tokens of a section up to its `$end`.
    fn section(&mut self, name: &str) -> Result<Vec<&'a [u8]>, ReplayError> {
        let mut all = Vec::new();
        loop {
            match self.next() {
                Some(b"$end") => return Ok(all),
                Some(token) => all.push(token),
                None => return Err(self.wrong(format!("{name} has no $end"))),
            }
        }
    }

    /// Returns the token that belongs to the one before, as an identifier to its value.
    fn and(&mut self) -> Result<&'a [u8], ReplayError> {
        self.next().ok_or_else(|| self.wrong("the file ends within a change of a value"))
    }
}

fn text(token: &[u8]) -> String {
    String::from_utf8_lossy(token).into_owned()
}

/// Returns the variable of the tokens of a `$var`: its type, size, code, name and indices.
fn variable<'a>(scopes: &[String], tokens: &[&'a [u8]]) -> Option<Variable<&'a [u8]>> {
    let [_, size, code, name @ ..] = tokens else { return None };
    let (size, name) = (text(size), name.iter().map(|token| text(token)).collect::<Vec<_>>().join(" "));
    let at = name.find('[').filter(|at| *at > 0 && range(&name[*at..]).is_some());
    let (mut name, of_name) = match at {
        Some(at) => (name[..at].trim_end().to_string(), range(&name[at..])),
        None => (name, None),
    };
    let of_size = range(&size);
    let width = match of_size {
        Some((left, right)) => left.abs_diff(right) as usize + 1,
        None => size.parse().ok()?,
    };
    // A bit that the file has as a variable of its own is named with its index.
    if let (1, Some((index, last))) = (width, of_name)
        && index == last
    {
        name = format!("{name}[{index}]");
    }
    let path = scopes.iter().map(|scope| format!("{scope}.")).collect::<String>() + &name;
    // Writers of strings give them no size; they are no channel.
    (!name.is_empty()).then_some(Variable { path, name, range: of_name.or(of_size), width, code })
}

/// The header: the unit of its times, and its variables.
struct Header<'a> {
    femtoseconds: i128,
    variables: Vec<Variable<&'a [u8]>>,
}

fn header<'a>(tokens: &mut Tokens<'a>) -> Result<Header<'a>, ReplayError> {
    let (mut scopes, mut variables, mut femtoseconds) = (Vec::new(), Vec::new(), None);
    loop {
        let token = tokens.next().ok_or_else(|| tokens.wrong("no $enddefinitions"))?;
        let name = text(token);
        if token.first() != Some(&b'$') {
            return Err(tokens.wrong(format!("`{}` stands where a section, as `$var`, is expected", excerpt(&name))));
        }
        let parts = tokens.section(&name)?;
        match token {
            b"$enddefinitions" => break,
            b"$timescale" => femtoseconds = Some(timescale(tokens, &parts.concat())?),
            b"$scope" => scopes.push(parts.get(1).map_or(String::new(), |name| text(name))),
            b"$upscope" => drop(scopes.pop()),
            b"$var" => {
                let read = variable(&scopes, &parts);
                variables.push(read.ok_or_else(|| tokens.wrong("a $var has a type, a size, a code and a name"))?);
            }
            // Date, version, comments, and what programs add of their own.
            _ => {}
        }
    }
    let femtoseconds = femtoseconds.ok_or_else(|| {
        ReplayError::new(
            tokens.line,
            "no $timescale, so times have no unit; add a line as `$timescale 1 ns $end` in front of the file",
        )
    })?;
    Ok(Header { femtoseconds, variables })
}

/// Returns the unit of times, in femtoseconds.
fn timescale(tokens: &Tokens, token: &[u8]) -> Result<i128, ReplayError> {
    let text = text(token);
    let digits = text.chars().take_while(char::is_ascii_digit).count();
    let (count, unit) = text.split_at(digits);
    if count.parse::<u32>().is_ok_and(|count| ![1, 10, 100].contains(&count)) {
        return Err(ReplayError::new(tokens.line, format!("a timescale of {count}; VCD knows 1, 10 and 100")));
    }
    let femtoseconds: i128 = match unit.to_lowercase().as_str() {
        "s" => 1_000_000_000_000_000,
        "ms" => 1_000_000_000_000,
        "us" => 1_000_000_000,
        "ns" => 1_000_000,
        "ps" => 1000,
        "fs" => 1,
        _ => return Err(tokens.wrong(format!("the timescale `{}` is none, as in `1 us`", excerpt(&text)))),
    };
    let count: i128 = count.parse().map_err(|_| tokens.wrong("the timescale has no number, as in `1 us`"))?;
    Ok(count * femtoseconds)
}

/// Reads two channels.
pub(super) fn read(bytes: &[u8], names: [&str; 2]) -> Result<Capture, ReplayError> {
    let mut tokens = Tokens { rest: bytes, line: 1 };
    let Header { femtoseconds, variables } = header(&mut tokens)?;
    let channels = find_both(&variables, names).map_err(|reason| ReplayError::new(tokens.line, reason))?;
    let (mut lines, mut time, mut is_off) = (Lines::default(), 0_u64, false);
    while let Some(token) = tokens.next() {
        match token {
            b"$dumpoff" | b"$dumpportsoff" => is_off = true,
            b"$dumpon" | b"$dumpportson" | b"$dumpall" | b"$dumpportsall" => is_off = false,
            b"$comment" => drop(tokens.section("$comment")?),
            [b'$', ..] => {}
            [b'#', number @ ..] => {
                let later: u64 = std::str::from_utf8(number)
                    .ok()
                    .and_then(|number| number.parse().ok())
                    .ok_or_else(|| tokens.wrong(format!("`{}` is no time", excerpt(&text(token)))))?;
                if later < time {
                    let reason = format!("time runs backwards, from #{time} to #{later}");
                    return Err(ReplayError::new(tokens.line, reason));
                }
                time = later;
                let picoseconds = i64::try_from(i128::from(later) * femtoseconds / 1000)
                    .map_err(|_| ReplayError::new(tokens.line, format!("#{later} is beyond 2^63 ps")))?;
                lines.to(picoseconds);
            }
            [b'b' | b'B', value @ ..] => change(&mut lines, &channels, tokens.and()?, value, is_off, tokens.line)?,
            [b'r' | b'R' | b's' | b'S', ..] => drop(tokens.and()?),
            [b'p', states @ ..] => {
                let [_, _, code] = [tokens.and()?, tokens.and()?, tokens.and()?];
                let states: Vec<u8> = states.iter().map(|state| of_port(*state)).collect();
                change(&mut lines, &channels, code, &states, is_off, tokens.line)?;
            }
            [value, code @ ..] if !code.is_empty() && b"01xXzZuUwWlLhH-".contains(value) => {
                change(&mut lines, &channels, code, &[*value], is_off, tokens.line)?;
            }
            _ => {
                let reason = format!("`{}` is no change of a value", excerpt(&text(token)));
                return Err(tokens.wrong(reason));
            }
        }
    }
    lines.ended(names).map_err(|reason| ReplayError::new(tokens.line, reason))
}

/// Takes a change of a variable's value.
fn change(
    lines: &mut Lines,
    channels: &[Channel<&[u8]>; 2],
    code: &[u8],
    value: &[u8],
    is_off: bool,
    line: u64,
) -> Result<(), ReplayError> {
    for (index, channel) in channels.iter().enumerate().filter(|(_, channel)| channel.code == code) {
        let value = bit_of(value, channel.bit, channel.width);
        // A recording that is switched off says x of every line.
        if is_off && level(value).is_none() {
            continue;
        }
        let refused = |reason| ReplayError::new(line, format!("the level `{}` is {reason}", char::from(value)));
        lines.set(index, level(value)).map_err(refused)?;
    }
    Ok(())
}

/// Returns the value of a state of extended VCD, whoever drives the port.
fn of_port(state: u8) -> u8 {
    match state {
        b'D' | b'd' | b'L' | b'l' | b'0' => b'0',
        b'U' | b'u' | b'H' | b'h' | b'1' => b'1',
        _ => b'x',
    }
}
