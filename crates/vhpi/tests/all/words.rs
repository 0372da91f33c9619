//! Words between the simulator and its parent.

use std::io::ErrorKind;

use hpu_vhpi::{put, take};

#[test]
fn words_come_out_as_they_went_in_the_lowest_byte_first() {
    let words = [0, 1, 0x0123_4567_89ab_cdef, u64::MAX];
    let mut bytes = Vec::new();
    put(&mut bytes, &words).expect("a vector takes all bytes");
    assert_eq!(bytes[16..24], [0xef, 0xcd, 0xab, 0x89, 0x67, 0x45, 0x23, 0x01]);
    let mut left = &bytes[..];
    assert_eq!(words.map(|_| take(&mut left).expect("a word")), words);
    assert!(left.is_empty());
}

#[test]
fn a_word_that_is_cut_is_an_error() {
    assert_eq!(take(&mut &[1, 2, 3][..]).expect_err("three bytes are no word").kind(), ErrorKind::UnexpectedEof);
}
