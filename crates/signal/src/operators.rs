//! Macros that implement the operators of a reading of words, each operator from one expression.

/// Implements sum, difference, product and negation: `operators!(Name, |a, b| [sum, difference, product], opposite)`,
/// where `opposite` is the negation of `a`.
#[macro_export]
macro_rules! operators {
    (@binary $word:ty, $operator:ident, $name:ident, $a:ident, $b:ident, $made:expr) => {
        impl ::std::ops::$operator for $word {
            type Output = Self;
            #[inline]
            fn $name(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $made
            }
        }
    };
    (@unary $word:ty, $operator:ident, $name:ident, $a:ident, $made:expr) => {
        impl ::std::ops::$operator for $word {
            type Output = Self;
            #[inline]
            fn $name(self) -> Self {
                let $a = self;
                $made
            }
        }
    };
    ($word:ty, |$a:ident, $b:ident| [$sum:expr, $difference:expr, $product:expr $(,)?], $opposite:expr $(,)?) => {
        $crate::operators!(@binary $word, Add, add, $a, $b, $sum);
        $crate::operators!(@binary $word, Sub, sub, $a, $b, $difference);
        $crate::operators!(@binary $word, Mul, mul, $a, $b, $product);
        $crate::operators!(@unary $word, Neg, neg, $a, $opposite);
    };
}

/// Implements the operators of a reading's bits: `truths!(Name, |a, b| [and, or], not)`, where `not` is the negation of
/// `a`.
#[macro_export]
macro_rules! truths {
    ($bit:ty, |$a:ident, $b:ident| [$and:expr, $or:expr], $not:expr $(,)?) => {
        $crate::operators!(@binary $bit, BitAnd, bitand, $a, $b, $and);
        $crate::operators!(@binary $bit, BitOr, bitor, $a, $b, $or);
        $crate::operators!(@unary $bit, Not, not, $a, $not);
    };
}
