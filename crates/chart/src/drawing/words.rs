//! Reads the loop's words from the rows of a trace.

use hpu_signal::{Format, Narrowing, Overflow, Rounding};

use crate::{Run, nets};

const POSITION: &str = "position";
pub(crate) const PENETRATION: &str = "penetration";
pub(crate) const SPRING: &str = "spring";
pub(crate) const COMMAND: &str = "command";

impl<'a> Run<'a> {
    /// Returns the words of one of the nets.
    pub(crate) fn words_in(&self, net: &str) -> &'a [i64] {
        let index = nets(self.scene).iter().position(|name| *name == net);
        self.trace.words(index.expect("the trace holds the nets of its pictures"))
    }

    /// Returns the times of the rows, and the words of one of the nets at them. Between two rows the net changes at an
    /// unknown time, so draw it as points joined by lines, not as steps.
    pub(crate) fn words_of(&self, net: &str) -> impl Iterator<Item = (f64, i64)> + Clone + 'a {
        self.trace.times_s().zip(self.words_in(net).iter().copied())
    }

    /// Returns the net that tells how hard the wall pushes: the spring, if it has a net of its own.
    pub(crate) fn push(&self) -> &'static str {
        if nets(self.scene).contains(&SPRING) { SPRING } else { COMMAND }
    }

    /// Returns the PWM counts of the least bit of a command, or of the net of [`push`](Self::push).
    pub(crate) fn quantum(&self) -> f64 {
        self.words.command_quantum_nm(self.scene) / self.words.realised.torque_quantum_nm
    }

    /// Returns the times and values of one of the plant's outputs, multiplied by `scale`.
    pub(crate) fn reals_of(&self, real: usize, scale: f64) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
        self.trace.times_s().zip(self.trace.real(real).iter().map(move |value| value * scale))
    }

    /// Returns the spring's word at a penetration.
    pub(crate) fn spring_at(&self, penetration: i64) -> i64 {
        let overflow = if self.words.config.saturate { Overflow::Saturate } else { Overflow::Wrap };
        let narrowing = Narrowing {
            from_frac: self.scene.method.stiffness_format.frac(),
            to: Format::unsigned(self.words.config.pwm.width),
            rounding: Rounding::Truncate,
            overflow,
        };
        narrowing.apply(i128::from(penetration) * i128::from(self.words.stiffness)).word
    }

    /// Returns for each row whether a net had overflowed, by narrowing the exact product or sum behind it once more;
    /// for the position, whether the device was out of its counter's reach.
    pub(crate) fn overflowed(&self, net: &str) -> Vec<bool> {
        let config = &self.words.config;
        let fits = |from_frac: i32, to: Format, value: i128| {
            let narrowing = Narrowing { from_frac, to, rounding: Rounding::Truncate, overflow: Overflow::Wrap };
            narrowing.apply(value).overflowed
        };
        let method = &self.scene.method;
        let words = |net: &str| self.words_in(net).iter().map(|&word| i128::from(word));
        let product = |factor: &str, gain: i64, frac: i32, to: Format| {
            words(factor).map(|word| fits(frac, to, word * i128::from(gain))).collect()
        };
        let unsigned = Format::unsigned(config.pwm.width);
        let signed = Format::signed(config.pwm.width + 1);
        if let (POSITION, Some([least, most])) = (net, self.scene.held_rad()) {
            return self.trace.angles_rad().iter().map(|angle_rad| !(least..most).contains(angle_rad)).collect();
        }
        let is_plain = nets(self.scene).contains(&SPRING);
        match net {
            COMMAND if nets(self.scene).contains(&"shaped") => {
                words("shaped").map(|torque| torque.abs() > unsigned.max()).collect()
            }
            _ if !is_plain => vec![false; self.trace.rows()],
            SPRING => product(PENETRATION, self.words.stiffness, method.stiffness_format.frac(), unsigned),
            "drag" => product("velocity", self.words.damping, method.damping_format.frac(), signed),
            COMMAND => words(PENETRATION)
                .zip(words(SPRING).zip(words("drag")))
                .map(|(depth, (spring, drag))| depth != 0 && (spring + drag).abs() > unsigned.max())
                .collect(),
            _ => vec![false; self.trace.rows()],
        }
    }
}
