//! `hpu.Plant`: the plant of a scene in the loop of the caller's logic.

use hpu_signal::{Real, Signal};
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyDict, PyTuple};

use crate::block::LONG;
use crate::errors::{ArgumentError, of_plant};
use crate::handle::Handle;
use crate::json::object;
use crate::scene::{overrides, scene};
use crate::signal::{index, named, tuple, word};
use crate::work::Signals;

/// The plant of a scene, everything outside the FPGA, at a clock edge.
///
/// Your logic reads `pins` as they are at the present edge, drives outputs that hold from this edge on, and advances.
/// The motion is that of a design in a `[dut]` with the same outputs, to the bit. Use it in one thread at a time;
/// `with` closes it. The scene of a motor needs neither `[method]` nor `[dut]`: its pins are then `a_pin` and `b_pin`,
/// its outputs the gates `a_high`, `a_low`, `b_high` and `b_low`.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, or when the scene has no clock; each method raises
/// `hpu.HandleError` after `close()`, or while another thread is inside a call.
#[pyclass(module = "hpu", frozen)]
pub struct Plant {
    name: String,
    inputs: Vec<Signal>,
    outputs: Vec<Signal>,
    states: Vec<Real>,
    plant: Handle<Driven>,
}

/// A plant, and the words that drive it.
struct Driven {
    plant: hpu::Plant,
    words: Vec<i64>,
}

#[pymethods]
impl Plant {
    #[new]
    #[pyo3(signature = (scene, overrides = None, **keys))]
    fn new(scene: &Bound<PyAny>, overrides: Option<&Bound<PyDict>>, keys: Option<&Bound<PyDict>>) -> PyResult<Self> {
        let ((name, file), set) = (self::scene(scene)?, self::overrides(overrides, keys)?);
        let plant =
            hpu::Plant::open(&file, &set).map_err(|error| of_plant(&error, Some((&file, file.plant(&set).err()))))?;
        Ok(Self {
            name,
            inputs: plant.inputs().to_vec(),
            outputs: plant.outputs().to_vec(),
            states: plant.states().collect(),
            plant: Handle::new("plant", Driven { words: vec![0; plant.outputs().len()], plant }),
        })
    }

    /// The inputs of the logic, which the plant gives, a tuple of Signal; the encoders' lines come first.
    #[getter]
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        tuple(py, &self.inputs)
    }

    /// The outputs of the logic, which drive the plant, a tuple of Signal.
    #[getter]
    fn outputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        tuple(py, &self.outputs)
    }

    /// The frequency of the clock in hertz.
    #[getter]
    fn clock_hz(&self) -> PyResult<u64> {
        self.plant.with(|driven| Ok(driven.plant.clock().frequency_hz()))
    }

    /// The clock edges of the scene.
    #[getter]
    fn edges(&self) -> PyResult<u64> {
        self.plant.with(|driven| Ok(driven.plant.edges()))
    }

    /// The present clock edge, counted from 0 at the start.
    #[getter]
    fn edge(&self) -> PyResult<u64> {
        self.plant.with(|driven| Ok(driven.plant.edge()))
    }

    /// The time of the present edge in seconds.
    #[getter]
    fn seconds(&self) -> PyResult<f64> {
        self.plant.with(|driven| Ok(driven.plant.seconds()))
    }

    /// The words of the inputs at the present edge, by name.
    #[getter]
    fn pins<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.plant.with(|driven| named(py, &self.inputs, driven.plant.words()))
    }

    /// Returns the words of the inputs at the present edge, in the order of the inputs.
    fn read<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        self.plant.with(|driven| PyTuple::new(py, driven.plant.words()))
    }

    fn __getitem__(&self, name: &str) -> PyResult<i64> {
        let index = index(&self.inputs, "pin", name)?;
        self.plant.with(|driven| Ok(driven.plant.words()[index]))
    }

    /// Sets words of the outputs from the present edge on: all in the order of `outputs`, or some by name. They are 0
    /// at the start.
    ///
    /// Raises `hpu.ArgumentError` for an unknown output, for a word that does not fit, and when both switches of a leg
    /// would be closed; the plant is then driven as before.
    #[pyo3(signature = (*words, **names))]
    fn drive(&self, words: &Bound<PyTuple>, names: Option<&Bound<PyDict>>) -> PyResult<()> {
        self.plant.with(|driven| {
            let mut wanted = driven.words.clone();
            if !words.is_empty() {
                if words.len() != wanted.len() {
                    let names: Vec<_> = self.outputs.iter().map(|output| output.name).collect();
                    let (given, count) = (words.len(), names.len());
                    let said = format!("{given} words; accepted: {count}, one an output: {}", names.join(", "));
                    return Err(ArgumentError::new_err(said));
                }
                for ((wanted, given), output) in wanted.iter_mut().zip(words).zip(&self.outputs) {
                    *wanted = word("output", output.name, &given)?;
                }
            }
            for (name, given) in names.into_iter().flatten() {
                let name: String = name.extract()?;
                wanted[index(&self.outputs, "output", &name)?] = word("output", &name, &given)?;
            }
            driven.plant.drive(&wanted).map_err(|error| of_plant(&error, None))?;
            driven.words = wanted;
            Ok(())
        })
    }

    /// Moves on by this number of clock edges [1], or by `ns` nanoseconds; no time is lost between calls.
    ///
    /// Raises `hpu.EndError` when the scene ends before, or when the device cannot go on. After Ctrl-C the plant stands
    /// at the edge to which it has come.
    #[pyo3(signature = (edges = None, *, ns = None))]
    fn advance(&self, py: Python, edges: Option<u64>, ns: Option<u64>) -> PyResult<()> {
        self.plant.with(|driven| {
            let plant = &mut driven.plant;
            let edges = match (edges, ns) {
                (Some(edges), None) => edges,
                (None, None) => 1,
                (None, Some(ns)) => plant.edges_of(ns),
                (Some(_), Some(_)) => return Err(ArgumentError::new_err("edges and ns; accepted: one of both")),
            };
            if edges <= LONG {
                return plant.advance(edges).map_err(|error| of_plant(&error, None));
            }
            py.detach(|| -> PyResult<()> {
                let (mut left, mut signals) = (edges, Signals::new());
                while left > 0 {
                    signals.turn()?;
                    // To the next edge at which the plant is asked: the same steps as in one call.
                    let part = left.min(plant.quiet().saturating_add(1));
                    plant.advance(part).map_err(|error| of_plant(&error, None))?;
                    left -= part;
                }
                Ok(())
            })
        })
    }

    /// The continuous states at the present edge in SI units, by name.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.plant.with(|driven| {
            let dict = PyDict::new(py);
            for (index, state) in self.states.iter().enumerate() {
                dict.set_item(state.name, driven.plant.state(index).map_err(|error| of_plant(&error, None))?)?;
            }
            Ok(dict)
        })
    }

    /// Returns the state of this name at the present edge in SI units.
    fn state(&self, name: &str) -> PyResult<f64> {
        let index = self.states.iter().position(|state| state.name == name);
        let index = index.ok_or_else(|| {
            let names: Vec<_> = self.states.iter().map(|state| state.name).collect();
            ArgumentError::new_err(format!("no state {name}; accepted: {}", names.join(", ")))
        })?;
        self.plant.with(|driven| driven.plant.state(index).map_err(|error| of_plant(&error, None)))
    }

    /// The energies from the start to the present edge in joules, by the names of a summary.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let energy = self.plant.with(|driven| Ok(driven.plant.energy()))?;
        object(py, &serde_json::json!(energy))
    }

    /// Whether the wall is touched; None where no pin tells.
    #[getter]
    fn contact(&self) -> PyResult<Option<bool>> {
        let index = self.inputs.iter().position(|input| input.name == "contact");
        self.plant.with(|driven| Ok(index.map(|index| driven.plant.words()[index] != 0)))
    }

    /// Closes the plant.
    fn close(&self) -> PyResult<()> {
        self.plant.close()
    }

    fn __enter__(slf: Bound<Self>) -> Bound<Self> {
        slf
    }

    #[pyo3(signature = (*_raised))]
    fn __exit__(&self, _raised: &Bound<PyTuple>) -> PyResult<()> {
        self.close()
    }

    fn __repr__(&self) -> String {
        match self.edge() {
            Ok(edge) => format!("<hpu.Plant of {} at clock edge {edge}>", self.name),
            Err(_) => format!("<hpu.Plant of {}, closed or in use>", self.name),
        }
    }
}
