//! `hpu.Loop`: the loop of a scene with its own blocks, moved on step by step.

use hpu::Emulated;
use hpu_cosim::Control;
use hpu_signal::{Real, Signal};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::of_plant;
use crate::handle::Handle;
use crate::json::object;
use crate::scene::{overrides, scene};
use crate::signal::{index, named, tuple};
use crate::work::work;

/// Clock edges above which a step listens for signals.
const LONG: u64 = 1 << 20;

/// The loop of a scene, its blocks and its plant, at a clock edge. The motion is that of `hpu.run`, to the bit.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, when it has no clock, or when a design of your own
/// closes its loop; each method raises `hpu.HandleError` after `close()`, or while another thread is inside a call.
#[pyclass(module = "hpu", frozen)]
pub struct Loop {
    name: String,
    nets: Vec<Signal>,
    states: Vec<Real>,
    emulated: Handle<Emulated>,
}

#[pymethods]
impl Loop {
    #[new]
    #[pyo3(signature = (scene, overrides = None, **keys))]
    fn new(scene: &Bound<PyAny>, overrides: Option<&Bound<PyDict>>, keys: Option<&Bound<PyDict>>) -> PyResult<Self> {
        let ((name, file), set) = (self::scene(scene)?, self::overrides(overrides, keys)?);
        let emulated =
            Emulated::open(&file, &set).map_err(|error| of_plant(&error, Some((&file, file.parse(&set).err()))))?;
        let (nets, states) = (emulated.nets().to_vec(), emulated.states());
        Ok(Self { name, nets, states, emulated: Handle::new("loop", emulated) })
    }

    /// The nets, a tuple of Signal.
    #[getter]
    fn nets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        tuple(py, &self.nets)
    }

    /// The frequency of the clock in hertz.
    #[getter]
    fn clock_hz(&self) -> PyResult<u64> {
        self.emulated.with(|emulated| Ok(emulated.clock().frequency_hz()))
    }

    /// The clock edges of the scene.
    #[getter]
    fn edges(&self) -> PyResult<u64> {
        self.emulated.with(|emulated| Ok(emulated.edges()))
    }

    /// The present clock edge, counted from 0 at the start.
    #[getter]
    fn edge(&self) -> PyResult<u64> {
        self.emulated.with(|emulated| Ok(emulated.edge()))
    }

    /// Moves on by this number of clock edges [1], and returns the words of the nets after them, by name.
    ///
    /// Raises `hpu.EndError` when the scene ends before, or when the device cannot go on.
    #[pyo3(signature = (edges = 1))]
    fn step<'py>(&self, py: Python<'py>, edges: u64) -> PyResult<Bound<'py, PyDict>> {
        self.emulated.with(|emulated| {
            let stepped = if edges > LONG {
                work(py, None, |watch| emulated.step(edges, watch.control()))?
            } else {
                emulated.step(edges, &Control::new())
            };
            stepped.map_err(|error| of_plant(&error, None))?;
            named(py, &self.nets, emulated.words())
        })
    }

    /// The words of the nets at the present edge, by name.
    #[getter]
    fn words<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.emulated.with(|emulated| named(py, &self.nets, emulated.words()))
    }

    fn __getitem__(&self, name: &str) -> PyResult<i64> {
        let index = index(&self.nets, "net", name)?;
        self.emulated.with(|emulated| Ok(emulated.words()[index]))
    }

    /// The continuous states at the present edge in SI units, by name.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.emulated.with(|emulated| {
            let dict = PyDict::new(py);
            for (index, state) in self.states.iter().enumerate() {
                dict.set_item(state.name, emulated.state(index).map_err(|error| of_plant(&error, None))?)?;
            }
            Ok(dict)
        })
    }

    /// The energies from the start to the present edge in joules, by the names of a summary.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let energy = self.emulated.with(|emulated| Ok(emulated.summary().energy))?;
        object(py, &serde_json::json!(energy))
    }

    /// Closes the loop.
    fn close(&self) -> PyResult<()> {
        self.emulated.close()
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
            Ok(edge) => format!("<hpu.Loop of {} at clock edge {edge}>", self.name),
            Err(_) => format!("<hpu.Loop of {}, closed or in use>", self.name),
        }
    }
}
