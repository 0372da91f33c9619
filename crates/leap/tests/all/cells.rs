//! The word and the line of each operation, held against the Verilog standard edge by edge.

use hpu_leap::{FOREVER, Line, Operation, Widths};

use crate::random::Random;
use crate::verilog;

/// Every operation, with its variants.
const ALL: [Operation; 28] = [
    Operation::Extend { signed: false },
    Operation::Extend { signed: true },
    Operation::Slice { low: 0 },
    Operation::Slice { low: 1 },
    Operation::Slice { low: 2 },
    Operation::Slice { low: 3 },
    Operation::Concat,
    Operation::Not,
    Operation::And,
    Operation::Or,
    Operation::Xor,
    Operation::Add,
    Operation::Sub,
    Operation::Mul,
    Operation::Div { signed: false },
    Operation::Div { signed: true },
    Operation::Rem { signed: false },
    Operation::Rem { signed: true },
    Operation::Less { signed: false },
    Operation::Less { signed: true },
    Operation::AtMost { signed: false },
    Operation::AtMost { signed: true },
    Operation::Equal,
    Operation::Differ,
    Operation::Parity,
    Operation::Mux,
    Operation::ShiftLeft,
    Operation::ShiftRight { signed: false },
];
const LAST: Operation = Operation::ShiftRight { signed: true };

/// A rule for lines: that of the library, or a wrong one.
type Rule<'r> = &'r dyn Fn(Operation, Widths, u64, [Line; 3]) -> Line;

/// A cell, and what is wrong with its line at an edge.
type Wrong = (Operation, Widths, [Line; 3], u64);

fn right(operation: Operation, widths: Widths, word: u64, operands: [Line; 3]) -> Line {
    operation.line(widths, word, operands)
}

/// Returns the width of each operand.
fn of_operands(operation: Operation, widths: Widths) -> [u8; 3] {
    [widths.a, widths.b, if operation == Operation::Mux { widths.result } else { widths.a }]
}

/// Returns the first edge, below `most`, at which the line that a rule gives a cell is not the cell's word. Operands
/// have any words from their horizons on.
fn wrong(
    rule: Rule,
    (operation, widths): (Operation, Widths),
    operands: [Line; 3],
    most: u64,
    random: &mut Random,
) -> Option<Wrong> {
    let of = of_operands(operation, widths);
    let now = verilog::word(operation, widths.result, of, operands.map(|line| line.word));
    if operation.word(widths, operands.map(|line| line.word)) != now {
        return Some((operation, widths, operands, 0));
    }
    let line = rule(operation, widths, now, operands);
    if line.word != now || line.horizon == 0 {
        return Some((operation, widths, operands, 0));
    }
    for edge in 1..most.min(line.horizon) {
        let mut words = [0; 3];
        for (at, operand) in operands.iter().enumerate() {
            let modulus = 1i128 << of[at];
            words[at] = if edge < operand.horizon {
                let word = i128::from(operand.word) + i128::from(operand.slope) * i128::from(edge);
                word.rem_euclid(modulus) as u64
            } else {
                random.below(1 << of[at])
            };
        }
        let described = i128::from(line.word) + i128::from(line.slope) * i128::from(edge);
        let described = described.rem_euclid(1i128 << widths.result) as u64;
        if verilog::word(operation, widths.result, of, words) != described {
            return Some((operation, widths, operands, edge));
        }
    }
    None
}

/// Returns a line of this width: at rest in every third case, near an end of its range in others; with a horizon that
/// is near in half of the cases.
fn line(width: u8, random: &mut Random) -> Line {
    let all = 1u64 << width;
    let word = match random.below(4) {
        0 => 0,
        1 => all - 1,
        _ => random.below(all),
    };
    let slope = match random.below(3) {
        0 => 0,
        _ => random.below(all).cast_signed() - (all / 2).cast_signed(),
    };
    let horizon = if random.below(2) == 0 { FOREVER } else { 1 + random.below(12) };
    Line { word, slope, horizon }
}

/// Returns an operation with widths of at most 7 bits that fit it.
fn cell(random: &mut Random) -> (Operation, Widths) {
    loop {
        let operation = ALL.get(random.below(ALL.len() as u64 + 1) as usize).copied().unwrap_or(LAST);
        let mut width = || 1 + random.below(7) as u8;
        let (result, a, b) = (width(), width(), width());
        let widths = match operation {
            Operation::Concat => Widths { result: a + b, a, b },
            Operation::Extend { .. } | Operation::Slice { .. } => Widths { result, a, b: a },
            Operation::Not => Widths { result, a: result, b: result },
            Operation::Parity => Widths { result: 1, a, b: a },
            Operation::Less { .. } | Operation::AtMost { .. } | Operation::Equal | Operation::Differ => {
                Widths { result: 1, a, b: a }
            }
            Operation::Mux => Widths { result, a: 1, b: result },
            Operation::ShiftLeft | Operation::ShiftRight { .. } => Widths { result, a: result, b },
            _ => Widths { result, a: result, b: result },
        };
        if operation.fits(widths) {
            return (operation, widths);
        }
    }
}

/// Returns the first wrong case of a rule among `cases` random ones.
fn search(rule: Rule, cases: u64, seed: u64) -> Option<Wrong> {
    let mut random = Random(seed);
    (0..cases).find_map(|_| {
        let (operation, widths) = cell(&mut random);
        let of = of_operands(operation, widths);
        let mut operands = of.map(|width| line(width, &mut random));
        if random.below(4) == 0 && operation.operands() > 1 {
            // Equal operands, which random ones seldom are.
            operands[1] = if operation == Operation::Mux { operands[2] } else { operands[0] };
            operands[1].word &= (1 << of[1]) - 1;
            operands[1].slope = 0.max(-(1 << (of[1] - 1))).max(operands[1].slope.min((1 << (of[1] - 1)) - 1));
            operands[1].horizon = 1 + random.below(20);
        }
        wrong(rule, (operation, widths), operands, 300, &mut random)
    })
}

#[test]
fn two_million_random_lines_are_the_words_of_their_cells() {
    assert_eq!(search(&right, 2_000_000, 1), None);
}

/// All lines that never end, of all words of at most 3 bits: no sampling.
#[test]
fn every_line_of_narrow_words_is_the_word_of_its_cell() {
    let mut random = Random(7);
    let lines = |width: u8| {
        let all = 1i64 << width;
        let words = (0..all).flat_map(move |word| (-all / 2..(all + 1) / 2).map(move |slope| (word, slope)));
        words.map(|(word, slope)| Line { word: word.cast_unsigned(), slope, horizon: FOREVER })
    };
    let mut cases = 0;
    for operation in ALL.into_iter().chain([LAST]) {
        for (result, a, b) in (1..=4).flat_map(|r| (1..=3).flat_map(move |a| (1..=3).map(move |b| (r, a, b)))) {
            let widths = Widths { result, a, b };
            if !operation.fits(widths) || operation.operands() == 3 && result > 2 {
                continue;
            }
            let of = of_operands(operation, widths);
            for one in lines(a) {
                for two in lines(b).take(if operation.operands() > 1 { usize::MAX } else { 1 }) {
                    for three in lines(of[2]).take(if operation.operands() > 2 { usize::MAX } else { 1 }) {
                        let operands = [one, two, three];
                        assert_eq!(wrong(&right, (operation, widths), operands, 40, &mut random), None);
                        cases += 1;
                    }
                }
            }
        }
    }
    assert!(cases > 50_000, "{cases} cases");
}

/// Words of the greatest width, where masks and shifts by the width are at their ends.
#[test]
fn words_of_64_bits_are_those_of_the_standard() {
    let (mut random, mut operations) = (Random(3), 0);
    for operation in ALL.into_iter().chain([LAST]) {
        let widths = match operation {
            Operation::Extend { .. } | Operation::Concat => Widths { result: 64, a: 40, b: 24 },
            Operation::Mux => Widths { result: 64, a: 1, b: 64 },
            Operation::ShiftLeft | Operation::ShiftRight { .. } => Widths { result: 64, a: 64, b: 7 },
            _ if operation.fits(Widths { result: 64, a: 64, b: 64 }) => Widths { result: 64, a: 64, b: 64 },
            Operation::Slice { .. } => Widths { result: 61, a: 64, b: 64 },
            _ => Widths { result: 1, a: 64, b: 64 },
        };
        assert!(operation.fits(widths), "{operation:?}");
        let of = of_operands(operation, widths);
        for _ in 0..2000 {
            let words = of.map(|width| {
                let ends = [0, u64::MAX, 1 << 63, 64][random.below(4) as usize];
                (if random.below(2) == 0 { ends } else { random.bits() }) & u64::MAX >> (64 - width)
            });
            let said = operation.word(widths, words);
            assert_eq!(said, verilog::word(operation, widths.result, of, words), "{operation:?} {words:?}");
        }
        operations += 1;
    }
    assert_eq!(operations, 29);
}

/// An equality has the longest horizon there is: the first edge at which brute force finds another word.
#[test]
fn an_equality_lasts_exactly_as_long_as_it_holds() {
    for width in 1..=4u8 {
        let all = 1i64 << width;
        let widths = Widths { result: 1, a: width, b: width };
        for (a, of_a) in (0..all).flat_map(|word| (-all / 2..all / 2).map(move |slope| (word, slope))) {
            for (b, of_b) in (0..all).flat_map(|word| (-all / 2..all / 2).map(move |slope| (word, slope))) {
                let at = |edge: i64| (a + of_a * edge - b - of_b * edge).rem_euclid(all) == 0;
                let last = (1..=2 * all).find(|edge| at(*edge) != at(0)).map_or(FOREVER, i64::cast_unsigned);
                let line = |word: i64, slope| Line { word: word.cast_unsigned(), slope, horizon: FOREVER };
                let said = Operation::Equal.line(widths, at(0).into(), [line(a, of_a), line(b, of_b), line(0, 0)]);
                assert_eq!(said.horizon, last, "{a} {of_a} {b} {of_b} of {width} bits");
            }
        }
    }
}

/// Rules with one error each, of the kinds that are easily made.
#[test]
fn an_error_in_a_rule_is_found() {
    type Changed = fn(Operation, Widths, [Line; 3], Line) -> Line;
    let errors: [(&str, Changed); 14] = [
        ("a word leaves its range an edge later", |operation, _, _, line| match operation {
            Operation::Extend { .. } if line.horizon > 1 => Line { horizon: line.horizon + 1, ..line },
            _ => line,
        }),
        ("an extended word never wraps", |operation, _, [a, ..], line| match operation {
            Operation::Extend { .. } => Line { horizon: a.horizon, ..line },
            _ => line,
        }),
        ("the lower part of a concatenation never wraps", |operation, _, [a, b, _], line| match operation {
            Operation::Concat => Line { horizon: a.horizon.min(b.horizon), ..line },
            _ => line,
        }),
        ("the bits below a slice never carry", |operation, _, [a, ..], line| match operation {
            Operation::Slice { .. } => Line { horizon: a.horizon, ..line },
            _ => line,
        }),
        ("a choice between equal words forgets their slopes", |operation, _, [_, b, c], line| match operation {
            Operation::Mux if b.word == c.word => Line { horizon: b.horizon.min(c.horizon).max(line.horizon), ..line },
            _ => line,
        }),
        ("a moving selector chooses on", |operation, _, [a, b, c], line| match operation {
            Operation::Mux => Line { horizon: if a.word == 0 { b.horizon } else { c.horizon }, ..line },
            _ => line,
        }),
        ("a 0 of a conjunction decides for ever", |operation, _, [a, ..], line| match operation {
            Operation::And if a.word == 0 && a.slope == 0 => Line { horizon: FOREVER, ..line },
            _ => line,
        }),
        ("a word that is not 0 decides a conjunction", |operation, _, [a, b, _], line| match operation {
            Operation::And if a.slope == 0 => Line { horizon: a.horizon, slope: 0, ..line },
            Operation::And if b.slope == 0 => Line { horizon: b.horizon, slope: 0, ..line },
            _ => line,
        }),
        ("signed words are compared without sign", |operation, widths, operands, line| match operation {
            Operation::Less { signed: true } => {
                Line { horizon: Operation::Less { signed: false }.line(widths, line.word, operands).horizon, ..line }
            }
            _ => line,
        }),
        ("at most is taken for less", |operation, widths, operands, line| match operation {
            Operation::AtMost { signed } => {
                Line { horizon: Operation::Less { signed }.line(widths, line.word, operands).horizon, ..line }
            }
            _ => line,
        }),
        ("equal words stay equal", |operation, _, [a, b, _], line| match operation {
            Operation::Equal | Operation::Differ if a.word == b.word => {
                Line { horizon: a.horizon.min(b.horizon), ..line }
            }
            _ => line,
        }),
        ("the product of two lines is a line", |operation, _, [a, b, _], line| match operation {
            Operation::Mul => Line { horizon: a.horizon.min(b.horizon), ..line },
            _ => line,
        }),
        (
            "any mask of an exclusive disjunction passes the other word",
            |operation, _, [a, b, _], line| match operation {
                Operation::Xor if a.slope == 0 => Line { slope: b.slope, horizon: a.horizon.min(b.horizon), ..line },
                _ => line,
            },
        ),
        ("a shift does not wrap", |operation, _, [a, b, _], line| match operation {
            Operation::ShiftRight { .. } if b.slope == 0 => Line { horizon: a.horizon.min(b.horizon), ..line },
            _ => line,
        }),
    ];
    for (what, changed) in errors {
        let rule = |operation: Operation, widths: Widths, word: u64, operands: [Line; 3]| {
            changed(operation, widths, operands, operation.line(widths, word, operands))
        };
        assert!(search(&rule, 200_000, 1).is_some(), "{what}: not found");
    }
}
