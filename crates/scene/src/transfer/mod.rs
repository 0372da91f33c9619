//! A scene of a plant as a transfer function: a linear plant as data, between two converters, and a controller that is
//! a difference equation in words.

mod read;
pub(crate) mod rows;
pub(crate) mod shipped;

pub(crate) use read::scene;

use hpu_plant::transfer::Form;

use crate::head::accuracy::Output;
use crate::head::model::Solver;
use crate::head::setup::Setup;
use crate::head::{Head, Units, has_head};
use crate::schema::source::SceneError;
use crate::text::message::number;

/// The outputs by which models of a plant are compared.
pub(crate) const OUTPUTS: [Output; 4] = [Output::Trace, Output::Amplitude, Output::Frequency, Output::Verdict];

/// The most coefficients of a polynomial.
pub(crate) const MOST_COEFFICIENTS: usize = hpu_plant::transfer::MOST_STATES + 1;

/// A converter: its words, and the value of one step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct WordRange {
    /// Bits of a word.
    pub bits: u32,
    /// Whether words have a sign.
    pub signed: bool,
    /// Value of a full word.
    pub full: f64,
}

impl WordRange {
    /// Returns the value of one step.
    pub fn lsb(&self) -> f64 {
        libm::scalbn(self.full, -(self.bits - u32::from(self.signed)).cast_signed())
    }

    /// Returns the least and the greatest word.
    pub fn ends(&self) -> [i64; 2] {
        if self.signed {
            let half = 1i64 << (self.bits - 1);
            [-half, half - 1]
        } else {
            [0, (1i64 << self.bits) - 1]
        }
    }

    /// Returns the nearest word that the converter has.
    pub fn clamped(&self, word: i64) -> i64 {
        let [least, most] = self.ends();
        word.clamp(least, most)
    }
}

/// The converter from the plant's output to words.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Adc {
    /// Its words.
    pub range: WordRange,
    /// Output that gives the word 0.
    pub offset: f64,
    /// Whether it rounds down, not to the nearest.
    pub floors: bool,
    /// Clock edges from one sample to the next; the first comes at edge 1.
    pub period: u64,
}

/// The controller as a scene has it: `sum(denominator[j] y(k-j)) = sum(numerator[j] e(k-j))`, in the units of the
/// plant's input and output.
#[derive(Clone, PartialEq, Debug)]
pub struct DirectForm {
    /// Coefficients of the errors, the newest first.
    pub numerator: Vec<f64>,
    /// Coefficients of the outputs, the newest first.
    pub denominator: Vec<f64>,
    /// Bits of a coefficient's word, and its fraction bits.
    pub coefficient: [u32; 2],
    /// Bits of the output below those of the DAC.
    pub fraction: u32,
    /// Whether the output is rounded down, not to the nearest.
    pub floors: bool,
}

/// The words of a scene's controller.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TransferWords {
    /// Coefficients of the errors in words of the ADC.
    pub numerator: Vec<i64>,
    /// Coefficients of the outputs.
    pub denominator: Vec<i64>,
    /// The reference.
    pub reference: i64,
}

/// A scene of a plant as a transfer function, validated.
#[derive(Clone, PartialEq, Debug)]
pub struct TransferScene {
    /// The part that every scene has.
    pub head: Head,
    /// The plant.
    pub form: Form,
    /// Whether it changes at its samples alone.
    pub discrete: bool,
    /// Its states at the start; those that are missing are 0.
    pub initial: Vec<f64>,
    /// The constant that is added to its input.
    pub disturbance: f64,
    /// The converter from its output to words.
    pub adc: Adc,
    /// The converter from words to its input.
    pub dac: WordRange,
    /// Samples by which a word reaches the plant late: 0 or 1.
    pub late: u32,
    /// The controller.
    pub method: DirectForm,
    /// The wanted output, and the time from which on it is wanted.
    pub reference: [f64; 2],
    /// The part of the physics that can be chosen.
    pub model: TransferModel,
}

/// The physics of a plant, of which only the solver can be chosen.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TransferModel {
    /// The solver.
    pub solver: Solver,
}

has_head!(TransferScene);

impl TransferScene {
    /// Returns the value of one step of the controller's own output.
    pub fn output_lsb(&self) -> f64 {
        libm::scalbn(self.dac.lsb(), -self.method.fraction.cast_signed())
    }

    /// Returns the words of the controller, each rounded to the nearest.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when a coefficient or the reference does not fit its word, or the first coefficient of the
    /// denominator rounds to 0.
    pub fn words(&self) -> Result<TransferWords, SceneError> {
        let [bits, fraction] = self.method.coefficient;
        let most = libm::scalbn(1.0, (bits - 1).cast_signed());
        let lsb = libm::scalbn(1.0, -fraction.cast_signed());
        let words = |key: &str, all: &[f64], unit: f64| -> Result<Vec<i64>, SceneError> {
            let word = |(index, asked): (usize, &f64)| {
                let word = (asked * unit / lsb).round();
                if -most <= word && word < most {
                    return Ok(word as i64);
                }
                let reason = format!(
                    "{} is {} steps of output a step of input, which do not fit {bits} bits with {fraction} fraction \
                     bits; write less than {} in size, or other coefficient_bits and coefficient_fraction",
                    number(*asked),
                    number(asked * unit),
                    number((most - 1.0) * lsb / unit)
                );
                Err(self.error(&format!("method.{key}[{index}]"), reason))
            };
            all.iter().enumerate().map(word).collect()
        };
        let numerator = words("numerator", &self.method.numerator, self.adc.range.lsb() / self.output_lsb())?;
        let denominator = words("denominator", &self.method.denominator, 1.0)?;
        if denominator[0] == 0 {
            let reason = format!(
                "{} rounds to 0 in {fraction} fraction bits, and the controller divides by it; write at least {}",
                number(self.method.denominator[0]),
                number(0.5 * lsb)
            );
            return Err(self.error("method.denominator[0]", reason));
        }
        let reference = (self.reference[0] / self.adc.range.lsb()).round();
        let [least, most] = self.adc.range.ends();
        if !(least as f64 <= reference && reference <= most as f64) {
            let [least, most] = [least, most].map(|word| number(word as f64 * self.adc.range.lsb()));
            let reason =
                format!("{} lies beyond the words of the ADC; write {least} to {most}", number(self.reference[0]));
            return Err(self.error("reference.value", reason));
        }
        Ok(TransferWords { numerator, denominator, reference: reference as i64 })
    }
}

impl Setup for TransferScene {
    fn solver(&self) -> Solver {
        self.model.solver
    }

    /// A plant as data has no units.
    fn units(&self) -> Units {
        Units { position: "", effort: "", stiffness: "", damping: "" }
    }

    fn outputs(&self) -> &'static [Output] {
        &OUTPUTS
    }

    /// The wanted output, in the place of a hand: the motion is judged after its step.
    fn hand_path(&self) -> Vec<(f64, f64)> {
        let [value, from_s] = self.reference;
        if from_s > 0.0 { vec![(0.0, 0.0), (from_s, value)] } else { Vec::new() }
    }
}
