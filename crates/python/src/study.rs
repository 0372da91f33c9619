//! Studies of many runs: maps, limits, widths, the least model.

use std::path::PathBuf;

use hpu_chart::Picture;
use hpu_cli::answers::{self, Answer, Failure, Named, Watch};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};

use crate::errors::ArgumentError;
use crate::json::object;
use crate::scene::{Overrides, overrides, scene, set_words, words};
use crate::work::{ended, work};

/// The result of a study. `str(study)` is the page that the command prints; a notebook shows it with the first picture.
#[pyclass(module = "hpu", frozen)]
pub struct Study {
    text: String,
    pictures: Vec<Picture>,
    /// The result, a dict with the keys of the command's `--json`; numbers are in SI units.
    #[pyo3(get)]
    summary: Py<PyAny>,
}

/// Returns pictures as PNG, by their names; a name that comes again has a number.
pub fn drawn<'py>(py: Python<'py>, pictures: &[Picture]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (picture, number) in pictures.iter().zip(1..) {
        let name =
            if dict.contains(picture.name)? { format!("{}-{number}", picture.name) } else { picture.name.into() };
        dict.set_item(name, PyBytes::new(py, &picture.png))?;
    }
    Ok(dict)
}

/// Returns a page's text, and the first picture above it, as HTML. Notebooks show HTML and then no picture beside it.
pub fn html(py: Python, text: &str, pictures: &[Picture]) -> PyResult<String> {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let Some(picture) = pictures.first() else { return Ok(format!("<pre>{text}</pre>")) };
    let encoded = py.import("base64")?.call_method1("b64encode", (PyBytes::new(py, &picture.png),))?;
    let encoded: String = encoded.call_method1("decode", ("ascii",))?.extract()?;
    let name = picture.name;
    Ok(format!("<img alt=\"{name}\" src=\"data:image/png;base64,{encoded}\"><pre>{text}</pre>"))
}

#[pymethods]
impl Study {
    /// Returns the pictures as PNG, by their names.
    fn pictures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        drawn(py, &self.pictures)
    }

    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        format!("<hpu.Study: {}>", self.text.lines().next().unwrap_or_default())
    }

    fn _repr_html_(&self, py: Python) -> PyResult<String> {
        html(py, &self.text, &self.pictures)
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        self.pictures.first().map(|picture| PyBytes::new(py, &picture.png))
    }
}

/// The answer of a verb; `None` when stopped.
type Answered = Result<Option<Answer>, Failure>;

/// Runs a study of these scenes.
fn study(
    py: Python,
    scenes: &[Named],
    set: &Overrides,
    options: &[(&str, Option<Bound<PyAny>>)],
    progress: Option<&Bound<PyAny>>,
    verb: impl FnOnce(&[String], Watch) -> Answered + Send,
) -> PyResult<Study> {
    let words: Vec<String> = words(options)?.into_iter().chain(set_words(set)).collect();
    let answered = work(py, progress, |watch| verb(&words, watch))?;
    let Answer { page, pictures } = ended(answered, &scenes[0].1, set)?;
    Ok(Study { text: page.text(), pictures, summary: object(py, &page.json())?.unbind() })
}

/// Maps a scene over two of its keys, as `hpu map`, and returns a Study.
///
/// `x` and `y` are axes such as `"wall.stiffness=0.1..3 N.m/rad:41:log"`: key, first and last value, cells [41], log or
/// lin [lin]. `method` is a layer such as `"1khz:method.kind=conventional,method.sample_rate=1 kHz"`, or a list of
/// layers. `full=True` runs every cell. `cell_events` limits the events of a cell, `cell_timeout` its time, such as
/// `"5min"`. With `for_ever="10s"` each cell that is run looks on after its end. `jobs` is the number of threads [one a
/// core]. `summary["cells"]` has a dict for each cell, x first.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// `progress(done, total)` is called every 50 ms, with a total of 0 while it is unknown; an exception of it, or Ctrl-C,
/// stops the work. Other threads of Python run meanwhile.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, and `hpu.Error` when the study is.
#[pyfunction]
#[pyo3(signature = (
    scene, overrides = None, *, x, y, method = None, all_methods = None, full = None, cell_events = None,
    cell_timeout = None, for_ever = None, jobs = None, progress = None, **keys
))]
#[allow(clippy::too_many_arguments, reason = "they are keywords of Python")]
pub fn map<'py>(
    py: Python<'py>,
    scene: &Bound<PyAny>,
    overrides: Option<&Bound<PyDict>>,
    x: Bound<'py, PyAny>,
    y: Bound<'py, PyAny>,
    method: Option<Bound<'py, PyAny>>,
    all_methods: Option<Bound<'py, PyAny>>,
    full: Option<Bound<'py, PyAny>>,
    cell_events: Option<Bound<'py, PyAny>>,
    cell_timeout: Option<Bound<'py, PyAny>>,
    for_ever: Option<Bound<'py, PyAny>>,
    jobs: Option<Bound<'py, PyAny>>,
    progress: Option<&Bound<PyAny>>,
    keys: Option<&Bound<PyDict>>,
) -> PyResult<Study> {
    let (scene, set) = (self::scene(scene)?, self::overrides(overrides, keys)?);
    let options = [
        ("x", Some(x)),
        ("y", Some(y)),
        ("method", method),
        ("all-methods", all_methods),
        ("full", full),
        ("cell-events", cell_events),
        ("cell-timeout", cell_timeout),
        ("for-ever", for_ever),
        ("jobs", jobs),
    ];
    let verb = |words: &[String], watch: Watch| answers::map(&scene, words, watch);
    study(py, std::slice::from_ref(&scene), &set, &options, progress, verb)
}

/// Finds the stiffnesses at which a scene's wall settles, as `hpu limits`, and returns a Study.
///
/// `range` is a str such as `"0.1..3 N.m/rad"`. `over` is a parameter that is not known, such as
/// `"device.inductance=0.5..0.7 mH"`, or a list of them. `hands` is True, or the radius of a motor's wheel, such as
/// `"50mm"`. `phases` [8] of the contact are run at each of at most `words` stiffness words.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// `progress(done, total)` is called every 50 ms, with a total of 0 while it is unknown; an exception of it, or Ctrl-C,
/// stops the work. Other threads of Python run meanwhile.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, and `hpu.Error` when the study is.
#[pyfunction]
#[pyo3(signature = (
    scene, overrides = None, *, range = None, over = None, hands = None, phases = None, words = None, jobs = None,
    progress = None, **keys
))]
#[allow(clippy::too_many_arguments, reason = "they are keywords of Python")]
pub fn limits<'py>(
    py: Python<'py>,
    scene: &Bound<PyAny>,
    overrides: Option<&Bound<PyDict>>,
    range: Option<Bound<'py, PyAny>>,
    over: Option<Bound<'py, PyAny>>,
    hands: Option<Bound<'py, PyAny>>,
    phases: Option<Bound<'py, PyAny>>,
    words: Option<Bound<'py, PyAny>>,
    jobs: Option<Bound<'py, PyAny>>,
    progress: Option<&Bound<PyAny>>,
    keys: Option<&Bound<PyDict>>,
) -> PyResult<Study> {
    let (scene, set) = (self::scene(scene)?, self::overrides(overrides, keys)?);
    let options =
        [("range", range), ("over", over), ("hands", hands), ("phases", phases), ("words", words), ("jobs", jobs)];
    let verb = |words: &[String], watch: Watch| answers::limits(&scene, words, watch);
    study(py, std::slice::from_ref(&scene), &set, &options, progress, verb)
}

/// Finds the bits that the signals of a scene need, or of a list of scenes, as `hpu widths`, and returns a Study.
///
/// `random` turns the encoders at random for so many seconds, with this `seed`, instead of running the scene. `within`
/// is the error that fewer bits may make, such as 0.01 or `"1%"`. `no_trials=True` tries no fewer bits.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// `progress(done, total)` is called every 50 ms, with a total of 0 while it is unknown; an exception of it, or Ctrl-C,
/// stops the work. Other threads of Python run meanwhile.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, and `hpu.Error` when the study is.
#[pyfunction]
#[pyo3(signature = (
    scene, overrides = None, *, random = None, seed = None, within = None, no_trials = None, jobs = None,
    progress = None, **keys
))]
#[allow(clippy::too_many_arguments, reason = "they are keywords of Python")]
pub fn widths<'py>(
    py: Python<'py>,
    scene: &Bound<PyAny>,
    overrides: Option<&Bound<PyDict>>,
    random: Option<Bound<'py, PyAny>>,
    seed: Option<Bound<'py, PyAny>>,
    within: Option<Bound<'py, PyAny>>,
    no_trials: Option<Bound<'py, PyAny>>,
    jobs: Option<Bound<'py, PyAny>>,
    progress: Option<&Bound<PyAny>>,
    keys: Option<&Bound<PyDict>>,
) -> PyResult<Study> {
    let is_list = scene.is_instance_of::<PyList>() || scene.is_instance_of::<PyTuple>();
    let scenes = if is_list {
        scene.try_iter()?.map(|one| self::scene(&one?)).collect::<PyResult<Vec<_>>>()?
    } else {
        vec![self::scene(scene)?]
    };
    if scenes.is_empty() {
        return Err(ArgumentError::new_err("no scene; accepted: one scene, or a list of at least one"));
    }
    let set = self::overrides(overrides, keys)?;
    let options = [("random", random), ("seed", seed), ("within", within), ("no-trials", no_trials), ("jobs", jobs)];
    study(py, &scenes, &set, &options, progress, |words, watch| answers::widths(&scenes, words, watch))
}

/// Finds the least model of a scene whose outputs stay within a tolerance, as `hpu fit`, and returns a Study.
///
/// `within` is the tolerance, such as 0.01 or `"1%"` [the scene's accuracy.within]. It takes about a hundred runs.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// `progress(done, total)` is called every 50 ms, with a total of 0 while it is unknown; an exception of it, or Ctrl-C,
/// stops the work. Other threads of Python run meanwhile.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, and `hpu.Error` when the study is.
#[pyfunction]
#[pyo3(signature = (scene, overrides = None, *, within = None, progress = None, **keys))]
pub fn fit<'py>(
    py: Python<'py>,
    scene: &Bound<PyAny>,
    overrides: Option<&Bound<PyDict>>,
    within: Option<Bound<'py, PyAny>>,
    progress: Option<&Bound<PyAny>>,
    keys: Option<&Bound<PyDict>>,
) -> PyResult<Study> {
    let (scene, set) = (self::scene(scene)?, self::overrides(overrides, keys)?);
    let verb = |words: &[String], watch: Watch| answers::fit(&scene, words, watch);
    study(py, std::slice::from_ref(&scene), &set, &[("within", within)], progress, verb)
}

/// Finds the values of a scene's keys that logs of its device tell, as `hpu identify`, and returns a Study.
///
/// `logs` is a list of tables, each read as the scene's `[expect.recording]` says, or of scenes with their own logs
/// [the log that the scene names]. `free` is a list of keys. Logs in `held` are only predicted. `summary["keys"]` has a
/// dict for each key, with `value`, `low` and `high`; `summary["explained"]` is False if a log is rejected.
///
/// `scene` is a shipped name (`hpu.scenes()`), a path, or `hpu.Scene(text)`. `overrides` is a dict such as
/// `{"wall.stiffness": 2}`; in further keywords two underscores stand for a dot: `wall__stiffness=2`. `hpu.keys()`
/// lists the keys. A str may have a unit.
///
/// `progress(done, total)` is called every 50 ms, with a total of 0 while it is unknown; an exception of it, or Ctrl-C,
/// stops the work. Other threads of Python run meanwhile.
///
/// Raises `hpu.SceneError` when the scene or an override is refused, and `hpu.Error` when a log or a key is.
#[pyfunction]
#[pyo3(signature = (scene, logs = Vec::new(), overrides = None, *, free, held = None, progress = None, **keys))]
#[allow(clippy::too_many_arguments, reason = "they are keywords of Python")]
pub fn identify<'py>(
    py: Python<'py>,
    scene: &Bound<PyAny>,
    logs: Vec<PathBuf>,
    overrides: Option<&Bound<PyDict>>,
    free: Bound<'py, PyAny>,
    held: Option<Vec<PathBuf>>,
    progress: Option<&Bound<PyAny>>,
    keys: Option<&Bound<PyDict>>,
) -> PyResult<Study> {
    let (scene, set) = (self::scene(scene)?, self::overrides(overrides, keys)?);
    let [logs, held] = [logs, held.unwrap_or_default()]
        .map(|paths| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>());
    let options = [("free", Some(free)), ("held", Some(PyList::new(py, held)?.into_any()))];
    let verb = |words: &[String], watch: Watch| answers::identify(&scene, &logs, words, watch);
    study(py, std::slice::from_ref(&scene), &set, &options, progress, verb)
}
