//! The trace of a run: columns that NumPy and Arrow read where they are.

use std::ffi::{CString, c_int};
use std::ops::Range;
use std::ptr::null_mut;
use std::sync::Arc;

use hpu_cli::answers::{Failure, table};
use hpu_cosim::{AnySimulation, Simulation};
use hpu_page::trace_table::TraceColumns;
use hpu_signal::{Cycle, Observe};
use pyo3::exceptions::{PyBufferError, PyKeyError};
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyTuple};

use crate::arrow::{self, Columns};

/// The values of a column.
pub enum Values {
    /// Doubles.
    Real(Arc<Vec<f64>>),
    /// Words.
    Word(Vec<i64>),
}

/// Values in a row, of 64 bits each, read-only by the buffer protocol: `numpy.asarray(column)` copies none.
#[pyclass(module = "hpu", frozen)]
pub struct Column {
    values: Values,
    /// The number of values, and the bytes from one to the next, as the buffer protocol has them.
    shape: [isize; 1],
    strides: [isize; 1],
}

impl Column {
    /// Returns a column.
    pub fn new(values: Values) -> Self {
        let count = match &values {
            Values::Real(values) => values.len(),
            Values::Word(values) => values.len(),
        };
        Self { values, shape: [count as isize], strides: [8] }
    }

    /// Returns values as an array of NumPy, without a copy.
    pub fn array(py: Python, values: Values) -> PyResult<Bound<PyAny>> {
        py.import("numpy")?.call_method1("asarray", (Self::new(values),))
    }
}

#[pymethods]
impl Column {
    fn __len__(&self) -> usize {
        self.shape[0] as usize
    }

    unsafe fn __getbuffer__(slf: Bound<Self>, view: *mut ffi::Py_buffer, flags: c_int) -> PyResult<()> {
        if view.is_null() || flags & ffi::PyBUF_WRITABLE != 0 {
            return Err(PyBufferError::new_err("a column is read-only; accepted: a copy of it"));
        }
        let column = slf.get();
        let (address, format) = match &column.values {
            Values::Real(values) => (values.as_ptr().cast_mut().cast(), c"d"),
            Values::Word(values) => (values.as_ptr().cast_mut().cast(), c"q"),
        };
        // SAFETY: the view keeps the column alive, and a column never changes or moves.
        unsafe {
            *view = ffi::Py_buffer {
                buf: address,
                len: 8 * column.shape[0],
                itemsize: 8,
                readonly: 1,
                ndim: 1,
                format: if flags & ffi::PyBUF_FORMAT != 0 { format.as_ptr().cast_mut() } else { null_mut() },
                shape: if flags & ffi::PyBUF_ND != 0 { column.shape.as_ptr().cast_mut() } else { null_mut() },
                strides: if flags & ffi::PyBUF_STRIDES == ffi::PyBUF_STRIDES {
                    column.strides.as_ptr().cast_mut()
                } else {
                    null_mut()
                },
                suboffsets: null_mut(),
                internal: null_mut(),
                obj: slf.clone().into_any().into_ptr(),
            };
        }
        Ok(())
    }
}

/// Observes a run and keeps its rows.
pub struct Kept {
    shown: TraceColumns,
    columns: Vec<Vec<f64>>,
}

impl Kept {
    /// Makes room for the rows of a run.
    ///
    /// # Errors
    ///
    /// When there is no memory for them.
    pub fn new(simulation: &AnySimulation) -> Result<Self, Failure> {
        let shown = TraceColumns::new(simulation, &table(simulation, false), &[]);
        let rows = simulation.edges() / simulation.stride() + 1;
        let mut columns = Vec::new();
        for _ in shown.told() {
            let mut column = Vec::new();
            let room = usize::try_from(rows).map(|rows| column.try_reserve_exact(rows));
            if !matches!(room, Ok(Ok(()))) {
                let bytes = 8.0 * rows as f64 * shown.told().len() as f64;
                return Err(Failure::file(format!(
                    "no memory for the trace of {rows} rows, which takes {bytes:.1e} B; lower record.plant_rate or \
                     run.duration"
                )));
            }
            columns.push(column);
        }
        Ok(Self { shown, columns })
    }

    /// Returns the trace.
    pub fn trace(self) -> Trace {
        let text = |text: &str| CString::new(text).expect("names and meanings have no NUL");
        let names = self.shown.told().iter().map(|(name, _)| text(name));
        let columns = names.zip(self.columns.into_iter().map(Arc::new)).collect();
        Trace { about: self.shown.told().to_vec(), columns: Arc::new(columns) }
    }
}

impl Observe for Kept {
    fn follows(&self, nets: Range<usize>) -> bool {
        self.shown.follows(nets)
    }

    fn measures(&self) -> bool {
        true
    }

    #[inline]
    fn nets(&mut self, _: Cycle, words: &[i64]) {
        self.shown.nets(words);
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        for (column, value) in self.columns.iter_mut().zip(self.shown.row(cycle, values)) {
            column.push(value);
        }
    }
}

/// The trace of a run: columns of doubles, a row at each tick of the scene's record.plant_rate from 0 s on.
///
/// `trace["angle_rad"]` is a NumPy array of shape (rows,) and of float64, read-only, without a copy. A column's name
/// ends in its unit; `about` has its meaning. `polars.DataFrame(trace)` and `pyarrow.table(trace)` read the same memory
/// by Arrow's PyCapsule interface, and so does `pandas.DataFrame(dict(trace), copy=False)`.
#[pyclass(module = "hpu", frozen)]
pub struct Trace {
    about: Vec<(String, String)>,
    columns: Columns,
}

#[pymethods]
impl Trace {
    /// The number of rows.
    #[getter]
    fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| values.len())
    }

    /// The meaning of each column, by its name.
    #[getter]
    fn about<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.about.iter().try_for_each(|(name, about)| dict.set_item(name, about))?;
        Ok(dict)
    }

    /// Returns the names of the columns.
    fn keys<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.about.iter().map(|(name, _)| name).collect::<Vec<_>>())
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.about.iter().position(|(other, _)| other == name);
        let index = found.ok_or_else(|| {
            let names: Vec<_> = self.about.iter().map(|(name, _)| &**name).collect();
            PyKeyError::new_err(format!("no column {name}; accepted: {}", names.join(", ")))
        })?;
        Column::array(py, Values::Real(self.columns[index].1.clone()))
    }

    fn __contains__(&self, name: &str) -> bool {
        self.about.iter().any(|(other, _)| other == name)
    }

    fn __len__(&self) -> usize {
        self.rows()
    }

    fn __repr__(&self) -> String {
        let names: Vec<_> = self.about.iter().map(|(name, _)| &**name).collect();
        format!("<hpu.Trace of {} rows: {}>", self.rows(), names.join(", "))
    }

    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        arrow::schema(py, &self.columns)
    }

    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_array__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<PyAny>>,
    ) -> PyResult<(Bound<'py, PyCapsule>, Bound<'py, PyCapsule>)> {
        // A producer may give its own schema whatever is requested.
        let _ = requested_schema;
        Ok((arrow::schema(py, &self.columns)?, arrow::array(py, &self.columns)?))
    }

    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        arrow::stream(py, &self.columns)
    }
}
