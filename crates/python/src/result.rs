//! `hpu.run`: a run and its result.
//!
//! `hpu.run` records no trace, because means and extremes of each row cost many times the run. `Result.trace` runs the
//! scene again, to the same bits.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use hpu_chart::Picture;
use hpu_cli::answers::{self, Failure, Finished, Recorded};
use hpu_cosim::{AnySimulation, SceneFile, Simulation};
use hpu_signal::{Cycle, Observe};
use hpu_wave::{WaveFile, fst_aside, vcd_aside};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::{ArgumentError, Error};
use crate::json::object;
use crate::scene::{Overrides, overrides, scene};
use crate::study::{drawn, html};
use crate::trace::{Kept, Trace};
use crate::work::{ended, work};

/// The result of a run. `str(result)` is the page that the command prints; a notebook shows it with a picture.
#[pyclass(module = "hpu", frozen)]
pub struct Result {
    source: SceneFile,
    set: Overrides,
    finished: Finished,
    recorded: OnceLock<(Recorded<()>, Py<Trace>)>,
    /// The summary, a dict with the keys of `hpu run --json`; numbers are in SI units.
    #[pyo3(get)]
    summary: Py<PyAny>,
}

/// Runs a scene, as `hpu run`, and returns its Result.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// The trace is recorded by a second run when it is first asked for; with `trace=True` by this run, which then takes
/// longer.
///
/// With `for_ever=10` it looks on after the end, for so many seconds of motion, as `hpu run --for-ever`:
/// `summary["for_ever"]` says how the run goes on for ever.
///
/// `progress(done, total)` is called every 50 ms, with a total of 0 while it is unknown; an exception of it, or Ctrl-C,
/// stops the work. Other threads of Python run meanwhile.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, and `hpu.Error` when the study is.
#[pyfunction]
#[pyo3(signature = (scene, overrides = None, *, trace = false, for_ever = None, progress = None, **keys))]
pub fn run(
    py: Python,
    scene: &Bound<PyAny>,
    overrides: Option<&Bound<PyDict>>,
    trace: bool,
    for_ever: Option<f64>,
    progress: Option<&Bound<PyAny>>,
    keys: Option<&Bound<PyDict>>,
) -> PyResult<Result> {
    let (_, source) = self::scene(scene)?;
    let set = self::overrides(overrides, keys)?;
    let longest = for_ever.map(Duration::try_from_secs_f64).transpose();
    let longest = longest.map_err(|_| ArgumentError::new_err("for_ever: write seconds of motion, as in 10"))?;
    let recorded = OnceLock::new();
    let finished = if trace {
        let run = work(py, progress, |watch| answers::run(&source, &set, longest, watch, Kept::new))?;
        let (finished, recording) = ended(run, &source, &set)?;
        let _ = recorded.set(traced(py, recording)?);
        finished
    } else {
        let run = work(py, progress, |watch| answers::run(&source, &set, longest, watch, answers::unseen))?;
        ended(run, &source, &set)?.0
    };
    let summary = object(py, &finished.page.json())?.unbind();
    Ok(Result { summary, source, set, finished, recorded })
}

/// Returns a recording and its trace.
fn traced(py: Python, recording: Recorded<Kept>) -> PyResult<(Recorded<()>, Py<Trace>)> {
    let (recording, kept) = recording.split();
    Ok((recording, Py::new(py, kept.trace())?))
}

impl Result {
    /// Returns the recording of the run and its trace. The first call runs the scene again.
    fn recorded(&self, py: Python) -> PyResult<&(Recorded<()>, Py<Trace>)> {
        if self.recorded.get().is_none() {
            let run = work(py, None, |watch| self.finished.again(watch, Kept::new))?;
            // Another thread may have been first, with the same bits.
            let _ = self.recorded.set(traced(py, ended(run, &self.source, &self.set)?)?);
        }
        Ok(self.recorded.get().expect("it was set"))
    }

    fn drawings(&self, py: Python) -> PyResult<Vec<Picture>> {
        let (recorded, _) = self.recorded(py)?;
        let pictures = work(py, None, |_| self.finished.pictures(recorded))?;
        pictures.map_err(|failure| Error::new_err(failure.to_string()))
    }
}

#[pymethods]
impl Result {
    /// The kind of the outcome: settled, limit_cycle, diverged; not_told if the run is too short, hand_moves if the
    /// hand moves nearly to its end; of an arm passive, non_passive, highly_unstable; of a moving target tracking. None
    /// for a recording, which has no device. `summary["outcome"]` has its figures.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let outcome = self.summary.bind(py).get_item("outcome")?;
        if outcome.is_none() { Ok(outcome) } else { outcome.get_item("kind") }
    }

    /// The share, 0 to 1, of the judged window in which the wall saw penetration; None where it is unknown.
    #[getter]
    fn contact<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.summary.bind(py).get_item("contact_share")
    }

    /// The trace, a Trace; the first time the scene is run again for it, unless it was asked for at once.
    #[getter]
    fn trace(&self, py: Python) -> PyResult<Py<Trace>> {
        Ok(self.recorded(py)?.1.clone_ref(py))
    }

    /// Returns the pictures of the run as PNG, by their names.
    fn pictures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        drawn(py, &self.drawings(py)?)
    }

    /// Runs the scene again and writes its waveforms, as FST or VCD by the ending of the path.
    ///
    /// Raises `hpu.ArgumentError` for another ending, and `hpu.Error` when the file cannot be written.
    #[pyo3(signature = (path, *, progress = None))]
    fn save_wave(&self, py: Python, path: PathBuf, progress: Option<&Bound<PyAny>>) -> PyResult<()> {
        let begin: Begin = match path.extension().and_then(|ending| ending.to_str()) {
            Some("fst") => |file, simulation| {
                fst_aside(file, &answers::layout(simulation, false, &answers::Chosen::default()), simulation.clock())
            },
            Some("vcd") => |file, simulation| {
                vcd_aside(file, &answers::layout(simulation, false, &answers::Chosen::default()), simulation.clock())
            },
            _ => {
                let said = format!("{}: the ending tells the format; accepted: .fst, .vcd", path.display());
                return Err(ArgumentError::new_err(said));
            }
        };
        let written = work(py, progress, |watch| {
            // A file appears whole: it is written beside its place and renamed.
            let mut name = path.file_name().unwrap_or_default().to_os_string();
            name.push(".part");
            let part = path.with_file_name(name);
            let observed = |simulation: &AnySimulation| {
                let file = File::create(&part).map_err(|error| at(&path, error))?;
                begin(file, simulation).map(Waves).map_err(|error| at(&path, error))
            };
            let written = self.finished.again(watch, observed).and_then(|ran| {
                let Some(ran) = ran else { return Ok(None) };
                let (ran, waves) = ran.split();
                waves.0.complete(Cycle(ran.summary.edges)).map_err(|error| at(&path, error))?;
                fs::rename(&part, &path).map_err(|error| at(&path, error)).map(Some)
            });
            if !matches!(written, Ok(Some(()))) {
                // It may not have been created.
                let _ = fs::remove_file(&part);
            }
            written
        })?;
        ended(written, &self.source, &self.set)
    }

    fn __str__(&self) -> String {
        self.finished.page.text()
    }

    fn __repr__(&self, py: Python) -> PyResult<String> {
        let summary = self.summary.bind(py);
        Ok(format!("<hpu.Result {}: {}>", summary.get_item("scene")?, self.verdict(py)?))
    }

    fn _repr_html_(&self, py: Python) -> PyResult<String> {
        html(py, &self.finished.page.text(), &self.drawings(py)?)
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyBytes>>> {
        Ok(self.drawings(py)?.first().map(|picture| PyBytes::new(py, &picture.png)))
    }
}

/// Begins a file of waveforms.
type Begin = fn(File, &AnySimulation) -> std::io::Result<Box<dyn WaveFile>>;

fn at(path: &Path, error: std::io::Error) -> Failure {
    Failure::file(format!("{}: {error}", path.display()))
}

/// Observes a run and writes its waveforms.
struct Waves(Box<dyn WaveFile>);

impl Observe for Waves {
    fn measures(&self) -> bool {
        true
    }

    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.0.nets(cycle, words);
    }

    fn watches_overflows(&self) -> bool {
        self.0.watches_overflows()
    }

    fn overflows(&mut self, cycle: Cycle, nets: u64) {
        self.0.overflows(cycle, nets);
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.0.reals(cycle, values);
    }
}
