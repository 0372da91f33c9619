//! What the rows of a trace say about the loop's words.

use hpu_signal::{Format, Narrowing, Overflow, Rounding};

use super::Run;

/// Indices into [`super::NETS`].
pub(super) const PENETRATION: usize = 1;
pub(super) const SPRING: usize = 2;
pub(super) const VELOCITY: usize = 3;
pub(super) const DRAG: usize = 4;
pub(super) const COMMAND: usize = 5;

impl<'a> Run<'a> {
    /// Times and words of one of the nets.
    pub(super) fn words_of(&self, net: usize) -> impl Iterator<Item = (f64, i64)> + Clone + 'a {
        self.trace.times_s().iter().copied().zip(self.trace.words(net).iter().copied())
    }

    /// Times and values of one of the plant's outputs, by `scale`.
    pub(super) fn reals_of(&self, real: usize, scale: f64) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
        self.trace.times_s().iter().copied().zip(self.trace.real(real).iter().map(move |value| value * scale))
    }

    /// When the wall is touched, as the datapath sees it.
    pub(super) fn contact(&self) -> impl Iterator<Item = (f64, bool)> + Clone + 'a {
        self.words_of(PENETRATION).map(|(t, word)| (t, word != 0))
    }

    /// The spring's word at a penetration.
    pub(super) fn spring_at(&self, penetration: i64) -> i64 {
        let overflow = if self.words.config.saturate { Overflow::Saturate } else { Overflow::Wrap };
        let narrowing = Narrowing {
            from_frac: self.scene.method.stiffness_format.frac(),
            to: Format::unsigned(self.words.config.pwm.width),
            rounding: Rounding::Truncate,
            overflow,
        };
        narrowing.apply(i128::from(penetration) * i128::from(self.words.stiffness)).word
    }

    /// When a net had overflowed: the exact product or sum behind it, narrowed again.
    pub(super) fn overflowed(&self, net: usize) -> Vec<bool> {
        let config = &self.words.config;
        let fits = |from_frac: i32, to: Format, value: i128| {
            let narrowing = Narrowing { from_frac, to, rounding: Rounding::Truncate, overflow: Overflow::Wrap };
            narrowing.apply(value).overflowed
        };
        let method = &self.scene.method;
        let words = |net: usize| self.trace.words(net).iter().map(|&word| i128::from(word));
        let product = |factor: usize, gain: i64, frac: i32, to: Format| {
            words(factor).map(|word| fits(frac, to, word * i128::from(gain))).collect()
        };
        let unsigned = Format::unsigned(config.pwm.width);
        let signed = Format::signed(config.pwm.width + 1);
        match net {
            SPRING => product(PENETRATION, self.words.stiffness, method.stiffness_format.frac(), unsigned),
            DRAG => product(VELOCITY, self.words.damping, method.damping_format.frac(), signed),
            COMMAND => words(PENETRATION)
                .zip(words(SPRING).zip(words(DRAG)))
                .map(|(depth, (spring, drag))| depth != 0 && (spring + drag).abs() > unsigned.max())
                .collect(),
            _ => vec![false; self.trace.times_s().len()],
        }
    }
}
