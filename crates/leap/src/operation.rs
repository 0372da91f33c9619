//! The operations of cells, and their words.

/// The widest word, in bits.
pub const MOST_BITS: u8 = 64;

/// The operation of a cell. Unless it is said otherwise, the operands have the width of the result, and the result is
/// taken modulo `2^width`. Operands are called `a`, `b` and `c`, in this order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Operation {
    /// `a`, which is narrower, with zeros or with copies of its sign on top.
    Extend {
        /// Whether the sign is copied.
        signed: bool,
    },
    /// The bits of `a` from bit `low` on.
    Slice {
        /// The index of the lowest bit.
        low: u8,
    },
    /// `b` with `a` on top; the widths of both sum to that of the result.
    Concat,
    /// Each bit of `a` inverted.
    Not,
    /// The bitwise conjunction.
    And,
    /// The bitwise disjunction.
    Or,
    /// The bitwise exclusive disjunction.
    Xor,
    /// `a + b`.
    Add,
    /// `a - b`.
    Sub,
    /// `a b`.
    Mul,
    /// The quotient, rounded towards zero; 0 where `b` is 0.
    Div {
        /// Whether the operands are signed.
        signed: bool,
    },
    /// The remainder, with the sign of `a`; 0 where `b` is 0.
    Rem {
        /// Whether the operands are signed.
        signed: bool,
    },
    /// 1 where `a < b`, in one bit; the operands have equal widths.
    Less {
        /// Whether the operands are signed.
        signed: bool,
    },
    /// 1 where `a <= b`, in one bit; the operands have equal widths.
    AtMost {
        /// Whether the operands are signed.
        signed: bool,
    },
    /// 1 where `a = b`, in one bit; the operands have equal widths.
    Equal,
    /// 1 where `a` and `b` differ, in one bit; the operands have equal widths.
    Differ,
    /// The exclusive disjunction of all bits of `a`, in one bit.
    Parity,
    /// `b` where `a`, which has one bit, is 0; else `c`.
    Mux,
    /// `a` shifted to the left by `b`, which may have any width, with zeros from the right.
    ShiftLeft,
    /// `a` shifted to the right by `b`, which may have any width, with zeros or copies of its sign from the left.
    ShiftRight {
        /// Whether the sign is copied.
        signed: bool,
    },
}

/// The widths of a cell in bits, each in 1..=[`MOST_BITS`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Widths {
    /// Of the result.
    pub result: u8,
    /// Of the first operand.
    pub a: u8,
    /// Of the second operand; that of the first where there is none.
    pub b: u8,
}

/// Returns the greatest word of this width.
#[inline]
pub(crate) fn mask(width: u8) -> u64 {
    u64::MAX >> (MOST_BITS - width)
}

/// Returns a word of this width as a signed number.
#[inline]
pub(crate) fn signed(word: u64, width: u8) -> i64 {
    let above = MOST_BITS - width;
    (word << above).cast_signed() >> above
}

impl Operation {
    /// Returns the number of operands.
    pub fn operands(self) -> usize {
        match self {
            Self::Extend { .. } | Self::Slice { .. } | Self::Not | Self::Parity => 1,
            Self::Mux => 3,
            _ => 2,
        }
    }

    /// Returns whether the operation is defined for these widths.
    pub fn fits(self, widths: Widths) -> bool {
        let Widths { result, a, b } = widths;
        let is_width = |width: u8| (1..=MOST_BITS).contains(&width);
        [result, a, b].into_iter().all(is_width)
            && match self {
                Self::Extend { .. } => a < result,
                Self::Slice { low } => u32::from(low) + u32::from(result) <= u32::from(a),
                Self::Concat => u32::from(a) + u32::from(b) == u32::from(result),
                Self::Not => a == result,
                Self::And | Self::Or | Self::Xor | Self::Add | Self::Sub | Self::Mul => a == result && b == result,
                Self::Div { .. } | Self::Rem { .. } => a == result && b == result,
                Self::Less { .. } | Self::AtMost { .. } | Self::Equal | Self::Differ => result == 1 && a == b,
                Self::Parity => result == 1,
                Self::Mux => a == 1 && b == result,
                Self::ShiftLeft | Self::ShiftRight { .. } => a == result,
            }
    }

    /// Returns the word of a cell. The words of operands have no bits above their widths, and nor has the result.
    pub fn word(self, widths: Widths, operands: [u64; 3]) -> u64 {
        self.word_of(widths, |at| operands[at])
    }

    /// As [`word`](Self::word), with operands that are read where an operation needs them.
    #[inline(always)]
    pub(crate) fn word_of(self, widths: Widths, operand: impl Fn(usize) -> u64) -> u64 {
        let Widths { result: width, a: of_a, b: of_b } = widths;
        let a = operand(0);
        let b = || operand(1);
        let both = |is_signed: bool| if is_signed { (offset(a, of_a), offset(b(), of_a)) } else { (a, b()) };
        let numbers = || (signed(a, width), signed(b(), width));
        match self {
            Self::Extend { signed: false } => a,
            Self::Extend { signed: true } => signed(a, of_a).cast_unsigned() & mask(width),
            Self::Slice { low } => (a >> low) & mask(width),
            Self::Concat => (a << of_b) | b(),
            Self::Not => !a & mask(width),
            Self::And => a & b(),
            Self::Or => a | b(),
            Self::Xor => a ^ b(),
            Self::Add => a.wrapping_add(b()) & mask(width),
            Self::Sub => a.wrapping_sub(b()) & mask(width),
            Self::Mul => a.wrapping_mul(b()) & mask(width),
            Self::Div { .. } | Self::Rem { .. } if b() == 0 => 0,
            Self::Div { signed: false } => a / b(),
            Self::Rem { signed: false } => a % b(),
            Self::Div { signed: true } => {
                let (a, b) = numbers();
                a.wrapping_div(b).cast_unsigned() & mask(width)
            }
            Self::Rem { signed: true } => {
                let (a, b) = numbers();
                a.wrapping_rem(b).cast_unsigned() & mask(width)
            }
            Self::Less { signed } => {
                let (a, b) = both(signed);
                u64::from(a < b)
            }
            Self::AtMost { signed } => {
                let (a, b) = both(signed);
                u64::from(a <= b)
            }
            Self::Equal => u64::from(a == b()),
            Self::Differ => u64::from(a != b()),
            Self::Parity => u64::from(a.count_ones() & 1),
            Self::Mux => operand(if a == 0 { 1 } else { 2 }),
            Self::ShiftLeft | Self::ShiftRight { signed: false } if b() >= u64::from(width) => 0,
            Self::ShiftLeft => (a << b()) & mask(width),
            Self::ShiftRight { signed: false } => a >> b(),
            Self::ShiftRight { signed: true } => {
                (signed(a, width) >> b().min(u64::from(MOST_BITS - 1))).cast_unsigned() & mask(width)
            }
        }
    }
}

/// Returns a signed word with its sign inverted: the order of such words without a sign is that of the signed numbers.
#[inline]
pub(crate) fn offset(word: u64, width: u8) -> u64 {
    word ^ (1 << (width - 1))
}
