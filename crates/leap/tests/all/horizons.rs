//! Horizons that are known from hand or brute force.

use hpu_leap::{FOREVER, Line, Operation, Widths};

fn line(word: u64, slope: i64) -> Line {
    Line { word, slope, horizon: FOREVER }
}

/// Returns the horizon of an operation without a result of several bits, or of a slice.
fn horizon(operation: Operation, (result, width): (u8, u8), a: Line, b: Line) -> u64 {
    let widths = Widths { result, a: width, b: width };
    let word = operation.word(widths, [a.word, b.word, 0]);
    operation.line(widths, word, [a, b, b]).horizon
}

#[test]
fn horizons_of_long_words_are_those_by_hand() {
    let below = |width, a, b, signed| horizon(Operation::Less { signed }, (1, width), a, b);
    let equal = |width, a, b| horizon(Operation::Equal, (1, width), a, line(b, 0));
    // 1000 + t: bits 9 to 4 change at 1008.
    assert_eq!(horizon(Operation::Slice { low: 4 }, (6, 10), line(1000, 1), line(0, 0)), 8);
    assert_eq!(equal(10, line(1000, 1), 1022), 22);
    // 5 + 3 t reaches 100 or more at 101.
    assert_eq!(below(8, line(5, 3), line(100, 0), false), 32);
    // -100 - t < 0 up to the wrap from -128 to 127.
    assert_eq!(below(8, line(156, -1), line(0, 0), true), 29);
    // 123456789 + 7 t > 9876543210.
    assert_eq!(below(34, line(9_876_543_210, 0), line(123_456_789, 7), false), 1_393_298_061);
    // 2^33 - 1 - 5 t < 77.
    assert_eq!(below(34, line((1 << 33) - 1, -5), line(77, 0), false), 1_717_986_903);
    assert_eq!(equal(32, line(987_654_321, -12), 21), 82_304_525);
    assert_eq!(equal(32, line(1_000_000_007, -3), 5), 333_333_334);
    // 17 + 9 t >= 4000000000 + 2 t, both 5142857138.
    let at_most = Operation::AtMost { signed: false };
    assert_eq!(horizon(at_most, (1, 34), line(4_000_000_000, 2), line(17, 9)), 571_428_569);
}

/// Words of 64 bits, where sums and differences of slopes leave 64 bits.
#[test]
fn horizons_at_the_ends_of_64_bits_are_those_by_hand() {
    let less = |a, b, signed| horizon(Operation::Less { signed }, (1, 64), a, b);
    let (most, least) = (i64::MAX, i64::MIN);
    assert_eq!(less(line(u64::MAX, -1), line(0, 0), false), FOREVER, "2^64 edges are more than the longest horizon");
    assert_eq!(less(line(0, most), line(u64::MAX, least), false), 1);
    assert_eq!(less(line(0, 1), line(u64::MAX, -1), false), FOREVER);
    assert_eq!(less(line(0, 1 << 62), line(u64::MAX, -(1 << 62)), false), 2);
    assert_eq!(less(line(1 << 63, most), line(0, 0), true), 2, "-2^63 + 2 (2^63 - 1) is positive");
    assert_eq!(horizon(Operation::Equal, (1, 64), line(1, 2), line(0, 0)), FOREVER, "odd for ever");
    assert_eq!(horizon(Operation::Equal, (1, 64), line(2, least), line(2, 0)), 1);
    assert_eq!(horizon(Operation::Slice { low: 63 }, (1, 64), line(0, 1 << 62), line(0, 0)), 2);
}
