//! A block of the datapath as a golden model.

use hpu_cosim::named_block;
use hpu_datapath::AnyBlock;
use hpu_signal::Signal;

use crate::error::{Error, Status};

/// A block in its state after a reset or an edge, bit by bit as its VHDL.
pub struct Block {
    block: Box<dyn AnyBlock>,
    inputs: Vec<Signal>,
    outputs: Vec<Signal>,
}

// SAFETY: a block is words and formats; none has state that threads share: no Rc, no cell, no thread-local.
unsafe impl Send for Block {}

impl Block {
    /// Makes the block of this name, with these generics and the defaults of all others, and resets it.
    ///
    /// # Errors
    ///
    /// [`Status::Refused`] when there is no such block or generic, or no configuration with these values.
    pub fn new(name: &str, generics: &[(String, String)]) -> Result<Self, Error> {
        let mut block = named_block(name, generics).map_err(|error| Error::new(Status::Refused, error.to_string()))?;
        block.reset();
        Ok(Self { inputs: block.inputs(), outputs: block.outputs(), block })
    }

    /// Returns the inputs.
    pub fn inputs(&self) -> &[Signal] {
        &self.inputs
    }

    /// Returns the outputs.
    pub fn outputs(&self) -> &[Signal] {
        &self.outputs
    }

    /// Computes one clock edge with the reset active. Returns the outputs after it.
    pub fn reset(&mut self) -> Vec<i64> {
        self.block.reset()
    }

    /// Computes one clock edge with these words at the inputs. Returns the outputs after it.
    ///
    /// # Errors
    ///
    /// [`Status::Argument`] when there are more or fewer words than inputs, or a word does not fit its input.
    pub fn tick(&mut self, words: &[i64]) -> Result<Vec<i64>, Error> {
        fit(&self.inputs, words, "input")?;
        Ok(self.block.tick(words))
    }
}

/// Checks that there is one word for each signal, and that each fits.
pub(crate) fn fit(signals: &[Signal], words: &[i64], what: &str) -> Result<(), Error> {
    if signals.len() != words.len() {
        let names: Vec<_> = signals.iter().map(|signal| signal.name).collect();
        let text = format!("{} words; accepted: {}, one an {what}: {}", words.len(), names.len(), names.join(", "));
        return Err(Error::new(Status::Argument, text));
    }
    match signals.iter().zip(words).find(|(signal, word)| !signal.format.holds(i128::from(**word))) {
        None => Ok(()),
        Some((Signal { name, format, .. }, word)) => {
            let text = format!("{what} {name} is {word}; accepted: {} to {}", format.min(), format.max());
            Err(Error::new(Status::Argument, text))
        }
    }
}
