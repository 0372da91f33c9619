//! A controller in words: a difference equation in direct form I, between an ADC and a DAC.
//!
//! - **Equation**: `error = reference - reading`, exact; `output(k) = (sum(B[j] error(k-j)) - sum(A[j] output(k-j),
//!   j > 0)) / A[0]`, the sum exact, the quotient rounded once and saturated to the DAC's range; `command` is `output`
//!   without its `FRACTION` lowest bits, rounded in the same way, saturated to the DAC's words.
//! - **Latency**: none: `command` is loaded at the sample's edge.
//! - **Edge**: the first edge after reset samples, then every `period`-th.
//! - **Reset**: all 0.
//! - **VHDL twin**: none. With up to two delays and a power of two as `A[0]` its output has the words of the block
//!   `biquad`, which has one.

use hpu_datapath::{Block, Generic, Instance, Wiring};
use hpu_scene::{TransferScene, TransferWords};
use hpu_signal::{Format, Meter, Ports, Signal, SignalUse};

hpu_signal::ports! {
    /// Inputs: the word of the ADC, and the wanted one.
    pub struct TransferIn { reading, reference }
}

hpu_signal::ports! {
    /// The word of the DAC.
    pub struct TransferOut { command }
}

/// Nets by their places.
const COMMAND: usize = 2;
const OUTPUT: usize = 4;
const NETS: usize = 5;

/// The controller in a loop.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct DirectForm {
    words: TransferWords,
    period: u64,
    fraction: u32,
    floors: bool,
    signals: [Signal; NETS],
    /// The least and the greatest word of the DAC.
    ends: [i64; 2],
    /// Edges before the next sample.
    left: u64,
    errors: Vec<i64>,
    outputs: Vec<i64>,
    nets: [i64; NETS],
    /// Whether the latest output and command were rounded, and whether they saturated.
    lost: [[bool; 2]; 2],
    meter: Meter<NETS>,
}

/// Returns the quotient by a positive number, rounded down or to the nearest with ties up, and whether it was rounded.
fn rounded(sum: i128, by: i128, floors: bool) -> (i128, bool) {
    let quotient = if floors { sum.div_euclid(by) } else { (2 * sum + by).div_euclid(2 * by) };
    (quotient, sum.rem_euclid(by) != 0)
}

impl DirectForm {
    /// Returns the controller of a scene in its state after reset.
    pub(crate) fn new(scene: &TransferScene, words: &TransferWords) -> Self {
        let (adc, dac, method) = (&scene.adc.range, &scene.dac, &scene.method);
        let word = |bits: u32, signed: bool| if signed { Format::signed(bits) } else { Format::unsigned(bits) };
        let signals = [
            Signal::new("reading", word(adc.bits, adc.signed), "1", "Word of the ADC"),
            Signal::new("reference", word(adc.bits, adc.signed), "1", "Wanted word"),
            Signal::new("command", word(dac.bits, dac.signed), "1", "Word of the DAC"),
            Signal::new("error", Format::signed(adc.bits + 2), "1", "Reference less reading"),
            Signal::new(
                "output",
                Format::signed(dac.bits + u32::from(!dac.signed) + method.fraction),
                "1",
                "The controller's own output",
            ),
        ];
        // The sign of the first coefficient moves into all of them.
        let sign = words.denominator[0].signum();
        let turned = |all: &[i64]| all.iter().map(|word| sign * word).collect::<Vec<_>>();
        let words = TransferWords {
            numerator: turned(&words.numerator),
            denominator: turned(&words.denominator),
            reference: words.reference,
        };
        Self {
            errors: vec![0; words.numerator.len()],
            outputs: vec![0; words.denominator.len()],
            words,
            period: scene.adc.period,
            fraction: method.fraction,
            floors: method.floors,
            signals,
            ends: dac.ends(),
            left: 0,
            nets: [0; NETS],
            lost: [[false; 2]; 2],
            meter: Meter::default(),
        }
    }

    /// Returns the words that the controller remembers: errors, then outputs, the newest first.
    pub(crate) fn memory(&self) -> (&[i64], &[i64]) {
        (&self.errors, &self.outputs)
    }

    fn sample(&mut self, input: TransferIn<i64>) {
        let error = input.reference - input.reading;
        self.errors.rotate_right(1);
        self.errors[0] = error;
        let products = |words: &[i64], values: &[i64]| -> i128 {
            words.iter().zip(values).map(|(&word, &value)| i128::from(word) * i128::from(value)).sum()
        };
        // Output `k-1` stands first until the new one is there.
        let back = products(&self.words.denominator[1..], &self.outputs);
        let sum = products(&self.words.numerator, &self.errors) - back;
        let format = self.signals[OUTPUT].format;
        let (quotient, is_rounded) = rounded(sum, self.words.denominator[0].into(), self.floors);
        let output = quotient.clamp(format.min(), format.max());
        let (top, is_cut) = rounded(output, 1 << self.fraction, self.floors);
        let [least, most] = self.ends;
        let command = top.clamp(least.into(), most.into());
        self.lost = [[is_cut, command != top], [is_rounded, output != quotient]];
        self.outputs.rotate_right(1);
        self.outputs[0] = output as i64;
        self.nets[COMMAND..].copy_from_slice(&[command as i64, error, output as i64]);
    }

    fn count_lost(&mut self, edges: u64) {
        for (net, [is_rounded, overflowed]) in [COMMAND, OUTPUT].into_iter().zip(self.lost) {
            self.meter.lost(net, is_rounded, overflowed, edges);
        }
    }
}

impl Block for DirectForm {
    const NAME: &'static str = "direct_form_loop";
    const CLOCKED: bool = true;
    type In<T> = TransferIn<T>;
    type Out<T> = TransferOut<T>;

    fn inputs(&self) -> TransferIn<Signal> {
        let mut signals = self.signals.iter().cloned();
        TransferIn::build(|| signals.next().expect("five"))
    }

    fn outputs(&self) -> TransferOut<Signal> {
        TransferOut { command: self.signals[COMMAND].clone() }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        Vec::new()
    }

    fn reset(&mut self) -> TransferOut<i64> {
        (self.left, self.nets, self.lost) = (0, [0; NETS], [[false; 2]; 2]);
        self.errors.fill(0);
        self.outputs.fill(0);
        self.meter = Meter::default();
        TransferOut { command: 0 }
    }

    fn tick(&mut self, input: TransferIn<i64>) -> TransferOut<i64> {
        [self.nets[0], self.nets[1]] = [input.reading, input.reference];
        if self.left == 0 {
            self.sample(input);
            self.left = self.period;
        }
        self.left -= 1;
        self.count_lost(1);
        self.meter.range(&self.nets);
        TransferOut { command: self.nets[COMMAND] }
    }

    fn quiet(&self, _: &TransferIn<i64>) -> u64 {
        self.left
    }

    fn skip(&mut self, edges: u64, _: &TransferIn<i64>) {
        self.left -= edges;
        self.count_lost(edges);
    }
}

impl Wiring for DirectForm {
    fn nets(&self) -> Vec<Signal> {
        self.signals.to_vec()
    }

    fn instances(&self) -> Vec<Instance> {
        Vec::new()
    }

    fn settle(&mut self, input: &TransferIn<i64>) {
        [self.nets[0], self.nets[1]] = [input.reading, input.reference];
    }

    fn words(&self) -> &[i64] {
        &self.nets
    }

    fn uses(&self) -> Vec<SignalUse> {
        self.meter.uses().to_vec()
    }

    fn recurs(&self, earlier: &Self) -> bool {
        let state = |it: &Self| (it.left, it.nets, it.lost);
        state(self) == state(earlier) && self.memory() == earlier.memory()
    }

    fn repeat(&mut self, [then, now]: [&Self; 2], times: u64) {
        self.meter.repeat([&then.meter, &now.meter], times);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hpu_datapath::{Biquad, BiquadConfig, biquad};
    use hpu_scene::{Experiment, SplitMix64};
    use hpu_signal::Rounding;

    #[test]
    fn two_delays_have_the_words_of_the_biquad() {
        let mut random = SplitMix64::new(1);
        for case in 0..200 {
            let mut word = |half: u64| random.below(2 * half) as i32 - half as i32;
            let (b, a) = ([word(1000), word(1000), word(1000)], [word(256), word(120)]);
            let (floors, fraction) = (case % 2 == 1, 8);
            let list = |all: &[i32]| all.iter().map(|word| format!("{word}")).collect::<Vec<_>>().join(", ");
            let text = format!(
                "about = 'A test.'\nclock.frequency = 1e6\nrun.duration = 1\n\
                 device = {{ kind = 'transfer', numerator = [1], denominator = [1, 1] }}\n\
                 adc = {{ bits = 12, range = 2048, rate = 1e5 }}\ndac = {{ bits = 22, full_scale = 2097152 }}\n\
                 [method]\nnumerator = [{}]\ndenominator = [128, {}]\ncoefficient_fraction = 0\nrounding = '{}'\n",
                list(&b),
                list(&a),
                if floors { "floor" } else { "nearest" }
            );
            let scene = match Experiment::parse("t.toml", &text, &[], &mut |_| unreachable!("no file")) {
                Ok(Experiment::Transfer(scene)) => scene,
                other => panic!("{other:?}"),
            };
            let mut ours = DirectForm::new(&scene, &scene.words().expect("words"));
            let [input, output] = [14, 22].map(Format::signed);
            // 128 is the one of coefficients with 7 fraction bits.
            let mut biquad = Biquad::new(BiquadConfig {
                input,
                output,
                coefficient: Format::new(true, 24, 7).expect("32 bits"),
                b,
                a,
                period_width: fraction,
                rounding: if floors { Rounding::Truncate } else { Rounding::NearestUp },
            })
            .expect("a biquad");
            for _ in 0..500 {
                let (reading, reference) = (i64::from(word(2048)), i64::from(word(2048)));
                let period = 10;
                let x = reference - reading;
                ours.tick(TransferIn { reading, reference });
                let y = biquad.tick(biquad::In { x, period }).y;
                assert_eq!(ours.nets[OUTPUT], y, "{b:?} {a:?}");
                assert_eq!(ours.memory().1[0], y);
            }
        }
    }
}
