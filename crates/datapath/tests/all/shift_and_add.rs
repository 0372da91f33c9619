//! The multiplier compared with a shift-and-add reference that works bit by bit, as gates would.

use bitvec::prelude::*;
use hpu_datapath::TruncatingMultiplier;
use hpu_datapath::truncating_multiplier::In;
use hpu_signal::{Format, Overflow};

const WIDTH: u32 = 6;

type Bits = BitVec<u64, Lsb0>;

/// Returns the bits of a word, extended to `width` bits by its sign or by zeros.
fn extended(bits: &BitSlice<u64, Lsb0>, signed: bool, width: usize) -> Bits {
    let fill = signed && bits[bits.len() - 1];
    let mut all = bits.to_bitvec();
    all.resize(width, fill);
    all
}

/// Computes `sum += term << shift` with a ripple carry that drops out at the top.
fn add(sum: &mut Bits, term: &Bits, shift: usize) {
    let mut carry = false;
    for place in shift..sum.len() {
        let (x, y) = (sum[place], term[place - shift]);
        sum.set(place, x ^ y ^ carry);
        carry = if carry { x || y } else { x && y };
    }
}

/// Returns all bits of the product: the sum of one row for each bit of `b`, modulo the product's width.
fn multiply(a: &Bits, b: &Bits) -> Bits {
    let mut sum = bitvec![u64, Lsb0; 0; a.len()];
    for (shift, bit) in b.iter().enumerate() {
        if *bit {
            add(&mut sum, a, shift);
        }
    }
    sum
}

/// Returns `out` bits of the product, from bit `drop` up.
fn narrow(product: &Bits, signed: bool, drop: usize, out: usize, saturate: bool) -> Bits {
    let kept = extended(&product[drop..], signed, 64);
    let sign = signed && kept[63];
    let free = if signed { out - 1 } else { out };
    let fits = kept[free..].iter().all(|bit| *bit == sign);
    let mut word = kept[..out].to_bitvec();
    if saturate && !fits {
        word.fill(!sign);
        if signed {
            word.set(out - 1, sign);
        }
    }
    word
}

fn as_word(bits: &Bits, signed: bool) -> i64 {
    extended(bits, signed, 64).load_le::<u64>().cast_signed()
}

#[test]
fn every_6_bit_product_in_every_mode_is_what_shift_and_add_gives() {
    let format = |signed| {
        if signed { Format::signed(WIDTH) } else { Format::unsigned(WIDTH) }
    };
    for (a_signed, b_signed) in [(false, false), (true, false), (false, true), (true, true)] {
        let (a_format, b_format) = (format(a_signed), format(b_signed));
        let signed = a_signed || b_signed;
        for (drop, out) in [0, 3, 6, 11].into_iter().flat_map(|drop| [2, 5, 6, 12, 15].map(|out| (drop, out))) {
            // A word of `out` bits whose least significant bit is worth 2^drop.
            let integer = out - i32::from(signed) + drop;
            let to = Format::new(signed, integer, -drop).unwrap();
            for overflow in Overflow::ALL {
                let block = TruncatingMultiplier::new(a_format, b_format, to, overflow).unwrap();
                for pattern in 0..1u64 << (2 * WIDTH) {
                    let factors = pattern.view_bits::<Lsb0>();
                    let (a, b) = factors[..2 * WIDTH as usize].split_at(WIDTH as usize);
                    let product = multiply(&extended(a, a_signed, 12), &extended(b, b_signed, 12));
                    let saturate = overflow == Overflow::Saturate;
                    let expected = narrow(&product, signed, drop as usize, out as usize, saturate);
                    let a = as_word(&a.to_bitvec(), a_signed);
                    let b = as_word(&b.to_bitvec(), b_signed);
                    assert_eq!(
                        block.eval(In { a, b }).word,
                        as_word(&expected, signed),
                        "{a_format} {a} * {b_format} {b} into {to}, {overflow:?}"
                    );
                }
            }
        }
    }
}
