//! Answers for other tools how operations on words are narrowed: `testbench/oracle/narrowing.py` holds APyTypes against
//! it.
//!
//! Standard input is a list of groups: a line `OPERATION A B TO ROUNDING OVERFLOW`, as in
//! `multiply (1,3,4) (0,8,0) (1,6,2) NearestEven Saturate`, then a line `a b` an operation, as integers in units of the
//! formats' least significant bits, then an empty line. Each operation is answered by the narrowed value in such units
//! and by 1 or 0 for whether bits were lost below and above: `-17 1 0`.

use std::fmt::Debug;
use std::io;
use std::process::ExitCode;

use hpu_signal::{Format, Narrowing, Overflow, Rounding};

/// An operation's exact value and its fraction bits, from the operands and theirs.
type Exact = fn((i128, i32), (i128, i32)) -> (i128, i32);

fn exact(operation: &str) -> Option<Exact> {
    match operation {
        "cast" => Some(|a, _| a),
        "multiply" => Some(|(a, a_frac), (b, b_frac)| (a * b, a_frac + b_frac)),
        "add" => Some(|(a, a_frac), (b, b_frac)| {
            let frac = a_frac.max(b_frac);
            ((a << (frac - a_frac)) + (b << (frac - b_frac)), frac)
        }),
        _ => None,
    }
}

/// Which of all is written like this.
fn named<T: Copy + Debug>(all: &[T], name: &str) -> Option<T> {
    all.iter().copied().find(|one| format!("{one:?}") == name)
}

/// A group's operation, formats and rule.
type Group = (Exact, [Format; 2], Narrowing);

fn group(line: &str) -> Option<Group> {
    let [operation, a, b, to, rounding, overflow] = line.split(' ').collect::<Vec<_>>()[..] else {
        return None;
    };
    let (operation, a, b): (_, Format, Format) = (exact(operation)?, a.parse().ok()?, b.parse().ok()?);
    let (_, from_frac) = operation((0, a.frac()), (0, b.frac()));
    let (rounding, overflow) = (named(&Rounding::ALL, rounding)?, named(&Overflow::ALL, overflow)?);
    Some((operation, [a, b], Narrowing { from_frac, to: to.parse().ok()?, rounding, overflow }))
}

/// An operand that its format holds.
fn operand(text: &str, format: Format) -> Option<(i128, i32)> {
    let value = text.parse().ok().filter(|&value| format.holds(value))?;
    Some((value, format.frac()))
}

fn answer(line: &str, (operation, [a, b], rule): &Group) -> Option<String> {
    let (first, second) = line.split_once(' ')?;
    let (value, _) = operation(operand(first, *a)?, operand(second, *b)?);
    let narrowed = rule.apply(value);
    let (rounded, overflowed) = (u8::from(narrowed.rounded), u8::from(narrowed.overflowed));
    Some(format!("{} {rounded} {overflowed}\n", rule.to.value(narrowed.word)))
}

fn answers(text: &str) -> Result<String, String> {
    let (mut out, mut current) = (String::new(), None);
    for (number, line) in (1..).zip(text.lines()) {
        let refused = || format!("line {number}: `{line}` is no operation");
        match &current {
            _ if line.is_empty() => current = None,
            None => current = Some(group(line).ok_or_else(refused)?),
            Some(group) => out += &answer(line, group).ok_or_else(refused)?,
        }
    }
    Ok(out)
}

fn main() -> ExitCode {
    let said = io::read_to_string(io::stdin()).map_err(|error| error.to_string()).and_then(|text| answers(&text));
    match said {
        Ok(said) => {
            print!("{said}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
