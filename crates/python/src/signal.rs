//! Signals: the ports of blocks and plants, and the nets of loops.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::ArgumentError;

/// A signal: name, word format, unit, meaning.
#[pyclass(module = "hpu", frozen)]
pub struct Signal(hpu_signal::Signal);

#[pymethods]
impl Signal {
    /// The name.
    #[getter]
    fn name(&self) -> &'static str {
        self.0.name
    }

    /// The word format, (sign bits, integer bits, fraction bits).
    #[getter]
    fn format(&self) -> (i32, i32, i32) {
        let format = self.0.format;
        (i32::from(format.is_signed()), format.int(), format.frac())
    }

    /// The least word.
    #[getter]
    fn min(&self) -> i128 {
        self.0.format.min()
    }

    /// The greatest word.
    #[getter]
    fn max(&self) -> i128 {
        self.0.format.max()
    }

    /// The unit of the value, which is the word times 2 to the minus fraction bits.
    #[getter]
    fn unit(&self) -> &'static str {
        self.0.unit
    }

    /// The meaning.
    #[getter]
    fn doc(&self) -> &'static str {
        self.0.doc
    }

    fn __repr__(&self) -> String {
        format!("<hpu.Signal {} {} in {}: {}>", self.0.name, self.0.format, self.0.unit, self.0.doc)
    }
}

/// Returns signals as a tuple.
pub fn tuple<'py>(py: Python<'py>, signals: &[hpu_signal::Signal]) -> PyResult<Bound<'py, PyTuple>> {
    let signals = signals.iter().map(|signal| Py::new(py, Signal(signal.clone())));
    PyTuple::new(py, signals.collect::<PyResult<Vec<_>>>()?)
}

/// Returns words by the names of their signals.
pub fn named<'py>(py: Python<'py>, signals: &[hpu_signal::Signal], words: &[i64]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    signals.iter().zip(words).try_for_each(|(signal, word)| dict.set_item(signal.name, word))?;
    Ok(dict)
}

/// Returns the index of the signal of this name.
pub fn index(signals: &[hpu_signal::Signal], what: &str, name: &str) -> PyResult<usize> {
    let found = signals.iter().position(|signal| signal.name == name);
    found.ok_or_else(|| {
        let names: Vec<_> = signals.iter().map(|signal| signal.name).collect();
        ArgumentError::new_err(format!("no {what} {name}; accepted: {}", names.join(", ")))
    })
}

/// Returns a word, which must be a whole number.
pub fn word(what: &str, name: &str, value: &Bound<PyAny>) -> PyResult<i64> {
    let whole = value.call_method0("__index__").and_then(|whole| whole.extract());
    whole.map_err(|_| {
        let got = value.get_type();
        ArgumentError::new_err(format!("{what} {name} is {value} ({got}); accepted: a whole number of 64 bits"))
    })
}
