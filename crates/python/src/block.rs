//! `hpu.Block`: a block as a golden model.

use hpu_datapath::block_names;
use hpu_signal::Signal;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice, PyString, PyTuple};

use crate::errors::{ArgumentError, of_plant};
use crate::handle::Handle;
use crate::scene::overrides;
use crate::signal::{index, named, tuple, word};
use crate::trace::{Column, Values};
use crate::work::Signals;

/// Clock edges above which a call lets other threads of Python run.
pub const LONG: u64 = 4096;

/// A block of the datapath as a golden model, bit by bit as its VHDL, in its state after a reset or a clock edge.
///
/// `Block("pwm", WIDTH=12)`: generics not given have their defaults. `hpu.blocks()` lists the names.
///
/// Raises `hpu.ArgumentError` when there is no such block or generic, or no configuration with these values.
#[pyclass(module = "hpu", frozen)]
pub struct Block {
    name: String,
    inputs: Vec<Signal>,
    outputs: Vec<Signal>,
    block: Handle<hpu::Block>,
}

/// Clock edges whose words are read at once from the arrays of a call. Arrays are never copied as a whole: that would
/// take long, and Ctrl-C would not end it.
const PART: usize = 1 << 14;

/// The words of an input: one for all edges, or one for each, in an array of numpy.
enum Given<'py> {
    One(i64),
    Each(Bound<'py, PyAny>, usize),
}

#[pymethods]
impl Block {
    #[new]
    #[pyo3(signature = (name, /, **generics))]
    fn new(name: String, generics: Option<&Bound<PyDict>>) -> PyResult<Self> {
        let set = overrides(generics, None)?;
        let block = hpu::Block::new(&name, &set).map_err(|error| of_plant(&error, None))?;
        let (inputs, outputs) = (block.inputs().to_vec(), block.outputs().to_vec());
        Ok(Self { name, inputs, outputs, block: Handle::new("block", block) })
    }

    /// The inputs, a tuple of Signal.
    #[getter]
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        tuple(py, &self.inputs)
    }

    /// The outputs, a tuple of Signal.
    #[getter]
    fn outputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        tuple(py, &self.outputs)
    }

    /// Computes one clock edge with the reset active, and returns the words of the outputs after it, by name.
    fn reset<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let words = self.block.with(|block| Ok(block.reset()))?;
        named(py, &self.outputs, &words)
    }

    /// Computes clock edges, and returns the words of the outputs after them, by name.
    ///
    /// Each input is given in the order of `inputs` or by name: a whole number, or an array of whole numbers of shape
    /// (edges,). With numbers alone it computes one edge and returns numbers. With an array it computes an edge for
    /// each word and returns arrays of int64 and of shape (edges,), read-only; a number stands for all edges.
    ///
    /// Raises `hpu.ArgumentError` for an input that is missing or unknown, for another type or shape, for arrays of
    /// different length, and for a word that does not fit its input; edges before that row have then been computed.
    /// Ctrl-C ends the call between two edges.
    #[pyo3(signature = (*words, **names))]
    fn tick<'py>(
        &self,
        py: Python<'py>,
        words: &Bound<'py, PyTuple>,
        names: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let given = self.given(py, words, names)?;
        let lengths = given.iter().zip(&self.inputs).filter_map(|(given, input)| match given {
            Given::Each(_, length) => Some((input.name, *length)),
            Given::One(_) => None,
        });
        let lengths: Vec<_> = lengths.collect();
        let Some(&(first, edges)) = lengths.first() else {
            let number = |given: &Given| match given {
                Given::One(word) => Some(*word),
                Given::Each(..) => None,
            };
            let row: Vec<i64> = given.iter().filter_map(number).collect();
            let words = self.block.with(|block| block.tick(&row).map_err(|error| of_plant(&error, None)))?;
            return named(py, &self.outputs, &words);
        };
        if let Some((other, length)) = lengths.iter().find(|(_, length)| *length != edges) {
            let said =
                format!("{first} has {edges} words and {other} {length}; accepted: arrays of one length, or numbers");
            return Err(ArgumentError::new_err(said));
        }
        let columns = self.block.with(|block| {
            let mut columns: Vec<Vec<i64>> = vec![Vec::new(); self.outputs.len()];
            let no_memory = |_| PyMemoryError::new_err(format!("no memory for the outputs of {edges} edges"));
            columns.iter_mut().try_for_each(|column| column.try_reserve_exact(edges)).map_err(no_memory)?;
            let mut signals = Signals::new();
            let mut row = vec![0; given.len()];
            for from in (0..edges).step_by(PART) {
                let to = edges.min(from + PART);
                let words = given.iter().map(|given| given.part(py, from, to)).collect::<PyResult<Vec<_>>>()?;
                let mut ticked = || -> PyResult<()> {
                    for edge in from..to {
                        signals.turn()?;
                        row.iter_mut().zip(&words).for_each(|(word, words)| *word = words[edge - from]);
                        let words = block.tick(&row).map_err(|mut error| {
                            error.text = format!("row {edge}: {}", error.text);
                            of_plant(&error, None)
                        })?;
                        columns.iter_mut().zip(words).for_each(|(column, word)| column.push(word));
                    }
                    Ok(())
                };
                if edges as u64 > LONG { py.detach(ticked) } else { ticked() }?;
            }
            Ok(columns)
        })?;
        let dict = PyDict::new(py);
        for (output, column) in self.outputs.iter().zip(columns) {
            dict.set_item(output.name, Column::array(py, Values::Word(column))?)?;
        }
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let names = |signals: &[Signal]| signals.iter().map(|signal| signal.name).collect::<Vec<_>>().join(", ");
        format!("<hpu.Block {}: {} -> {}>", self.name, names(&self.inputs), names(&self.outputs))
    }
}

impl Given<'_> {
    /// Returns the words of the edges `from..to`.
    fn part(&self, py: Python, from: usize, to: usize) -> PyResult<Vec<i64>> {
        match self {
            Self::One(word) => Ok(vec![*word; to - from]),
            Self::Each(array, _) => {
                let part = array.get_item(PySlice::new(py, from as isize, to as isize, 1))?;
                let whole = py.import("numpy")?.call_method1("ascontiguousarray", (part, "int64"))?;
                PyBuffer::<i64>::get(&whole)?.to_vec(py)
            }
        }
    }
}

impl Block {
    /// Reads the words of each input, given in the order of the inputs or by name.
    fn given<'py>(
        &self,
        py: Python<'py>,
        words: &Bound<'py, PyTuple>,
        names: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Vec<Given<'py>>> {
        let accepted = || {
            let names: Vec<_> = self.inputs.iter().map(|input| input.name).collect();
            format!("accepted: {}, in this order or by name", names.join(", "))
        };
        if words.len() > self.inputs.len() {
            let said = format!("{} inputs given; {}", words.len(), accepted());
            return Err(ArgumentError::new_err(said));
        }
        let mut given: Vec<Option<Bound<PyAny>>> = words.iter().map(Some).collect();
        given.resize(self.inputs.len(), None);
        for (name, value) in names.into_iter().flatten() {
            let index = index(&self.inputs, "input", &name.extract::<String>()?)?;
            if given[index].replace(value).is_some() {
                return Err(ArgumentError::new_err(format!("{name} is given twice; {}", accepted())));
            }
        }
        let read = |(value, input): (Option<Bound<'py, PyAny>>, &Signal)| {
            let missing = || ArgumentError::new_err(format!("input {} is missing; {}", input.name, accepted()));
            words_of(py, input.name, &value.ok_or_else(missing)?)
        };
        given.into_iter().zip(&self.inputs).map(read).collect()
    }
}

/// Reads a number, or a one-dimensional array of whole numbers.
fn words_of<'py>(py: Python<'py>, name: &str, value: &Bound<'py, PyAny>) -> PyResult<Given<'py>> {
    if value.call_method0("__len__").is_err() || value.is_instance_of::<PyString>() {
        return word("input", name, value).map(Given::One);
    }
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (value,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let (dimensions, count): (usize, usize) = (array.getattr("ndim")?.extract()?, array.getattr("size")?.extract()?);
    // An empty list has no type of its own.
    let is_whole = ["b", "i", "u"].contains(&&*kind) || count == 0;
    if dimensions != 1 || !is_whole {
        let got = array.getattr("dtype")?;
        let said = format!("input {name} is an array of {got} in {dimensions} dimensions");
        return Err(ArgumentError::new_err(format!("{said}; accepted: whole numbers in 1 dimension")));
    }
    if kind == "u" && count > 0 && array.call_method0("max")?.extract::<i64>().is_err() {
        return Err(ArgumentError::new_err(format!("input {name} has a word beyond 64 bits with sign")));
    }
    Ok(Given::Each(array, count))
}

/// Returns the names of all blocks.
#[pyfunction]
pub fn blocks(py: Python) -> PyResult<Bound<PyTuple>> {
    PyTuple::new(py, block_names())
}
