//! Cells by the rules of the Verilog standard (IEEE 1364, clause 5), bit by bit or in wide integers.
//!
//! It shares nothing with the library but the names of the operations, so that it can judge them.

use hpu_leap::Operation;

fn unsigned(word: u64) -> i128 {
    i128::from(word)
}

fn signed(word: u64, width: u8) -> i128 {
    let modulus = 1i128 << width;
    let word = i128::from(word);
    if 2 * word >= modulus { word - modulus } else { word }
}

/// Returns the word of a cell with a result of `width` bits, whose operands have `widths` bits.
pub fn word(operation: Operation, width: u8, widths: [u8; 3], [a, b, c]: [u64; 3]) -> u64 {
    let bit = |word: u64, at: u64| at < 64 && word >> at & 1 == 1;
    let of_bits = |value: &dyn Fn(u64) -> bool| (0..width.into()).map(|at| u64::from(value(at)) << at).sum::<u64>();
    let wrapped = |value: i128| value.rem_euclid(1i128 << width) as u64;
    let number = |word: u64, at: usize, is: bool| if is { signed(word, widths[at]) } else { unsigned(word) };
    let sign = bit(a, u64::from(widths[0]) - 1);
    match operation {
        Operation::Extend { signed } => of_bits(&|at| if at < widths[0].into() { bit(a, at) } else { signed && sign }),
        Operation::Slice { low } => of_bits(&|at| bit(a, at + u64::from(low))),
        Operation::Concat => of_bits(&|at| {
            let below = u64::from(widths[1]);
            if at < below { bit(b, at) } else { bit(a, at - below) }
        }),
        Operation::Not => of_bits(&|at| !bit(a, at)),
        Operation::And => of_bits(&|at| bit(a, at) && bit(b, at)),
        Operation::Or => of_bits(&|at| bit(a, at) || bit(b, at)),
        Operation::Xor => of_bits(&|at| bit(a, at) != bit(b, at)),
        Operation::Add => wrapped(unsigned(a) + unsigned(b)),
        Operation::Sub => wrapped(unsigned(a) - unsigned(b)),
        Operation::Mul => (u128::from(a) * u128::from(b) % (1u128 << width)) as u64,
        Operation::Div { .. } | Operation::Rem { .. } if b == 0 => 0,
        Operation::Div { signed } => wrapped(number(a, 0, signed) / number(b, 1, signed)),
        Operation::Rem { signed } => wrapped(number(a, 0, signed) % number(b, 1, signed)),
        Operation::Less { signed } => u64::from(number(a, 0, signed) < number(b, 1, signed)),
        Operation::AtMost { signed } => u64::from(number(a, 0, signed) <= number(b, 1, signed)),
        Operation::Equal => u64::from(a == b),
        Operation::Differ => u64::from(a != b),
        Operation::Parity => (0..widths[0].into()).filter(|at| bit(a, *at)).count() as u64 % 2,
        Operation::Mux => of_bits(&|at| if bit(a, 0) { bit(c, at) } else { bit(b, at) }),
        Operation::ShiftLeft => of_bits(&|at| at.checked_sub(b).is_some_and(|from| bit(a, from))),
        Operation::ShiftRight { signed } => of_bits(&|at| {
            let from = at.saturating_add(b);
            if from < u64::from(width) { bit(a, from) } else { signed && sign }
        }),
    }
}
