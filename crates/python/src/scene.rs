//! Scenes as arguments, and their overrides.

use hpu_cli::answers;
use hpu_cosim::SceneFile;
use hpu_cosim::scene::shipped;
use pyo3::exceptions::PyTypeError;
use pyo3::ffi::PyObject;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};

use crate::errors::{ArgumentError, SceneError};
use crate::json::object;

/// Keys of a scene and their values, as those of `--set`.
pub type Overrides = Vec<(String, String)>;

/// A scene by its text, in TOML. `name` stands in messages; data files that the scene names lie in `folder`.
#[pyclass(module = "hpu", frozen)]
pub struct Scene {
    file: SceneFile,
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (text, *, name = "scene.toml", folder = "."))]
    fn new(text: String, name: &str, folder: &str) -> Self {
        let file = SceneFile { name: name.into(), text, data: folder.into(), is_shipped: false };
        Self { file }
    }

    /// The text, in TOML.
    #[getter]
    fn text(&self) -> &str {
        &self.file.text
    }

    /// The name in messages.
    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    fn __repr__(&self) -> String {
        format!("<hpu.Scene {}>", self.file.name)
    }
}

/// Returns the name of a scene, as the command has it, and the scene.
pub fn scene(given: &Bound<PyAny>) -> PyResult<answers::Named> {
    if let Ok(scene) = given.cast::<Scene>() {
        let file = &scene.get().file;
        return Ok((file.name.clone(), file.clone()));
    }
    let place: String = match given.cast::<PyString>() {
        Ok(text) => text.to_string(),
        Err(_) => {
            let path = given.call_method0("__fspath__").and_then(|path| path.extract::<String>());
            let path = path.map_err(|_| {
                let got = given.get_type();
                ArgumentError::new_err(format!("a scene is no {got}; accepted: a name, a path, or hpu.Scene(text)"))
            })?;
            // A path is no name of a shipped scene.
            if path.contains('/') { path } else { format!("./{path}") }
        }
    };
    let file = SceneFile::find(&place).map_err(|why| SceneError::new_err((why.to_string(), place.clone())))?;
    Ok((place, file))
}

/// Returns overrides: those of a dict whose keys have dots, then keywords, in which two underscores stand for a dot.
pub fn overrides(dict: Option<&Bound<PyDict>>, keywords: Option<&Bound<PyDict>>) -> PyResult<Overrides> {
    let mut all = Vec::new();
    for (key, value) in dict.into_iter().flatten() {
        let key: String = key.extract().map_err(|_| ArgumentError::new_err("a key of overrides is a str"))?;
        all.push((key.clone(), text(&key, &value)?));
    }
    for (key, value) in keywords.into_iter().flatten() {
        let key = key.extract::<String>()?.replace("__", ".");
        all.push((key.clone(), text(&key, &value)?));
    }
    Ok(all)
}

/// The deepest list of lists that is read; that of a scene is a list of points.
const MOST_DEEP: usize = 8;

/// Returns a value as `--set` has it.
fn text(key: &str, value: &Bound<PyAny>) -> PyResult<String> {
    within(key, value, &mut Vec::new())
}

/// Returns a value within these lists. One that contains itself, or that is too deep, is a `TypeError`.
fn within(key: &str, value: &Bound<PyAny>, lists: &mut Vec<*mut PyObject>) -> PyResult<String> {
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(flag.is_true().to_string());
    }
    if value.is_instance_of::<PyString>() {
        return value.extract();
    }
    if value.is_instance_of::<PyInt>() || value.is_instance_of::<PyFloat>() {
        // A subclass may show itself otherwise.
        return match value.extract::<i64>() {
            Ok(number) => Ok(number.to_string()),
            Err(_) => Ok(format!("{:?}", value.extract::<f64>()?)),
        };
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let refused = |said: &str| Err(PyTypeError::new_err(format!("{key} is a list {said}")));
        if lists.contains(&value.as_ptr()) {
            return refused("that contains itself");
        }
        if lists.len() == MOST_DEEP {
            return refused(&format!("of lists that is more than {MOST_DEEP} deep"));
        }
        lists.push(value.as_ptr());
        let values = value.try_iter()?.map(|value| {
            let value = value?;
            let said = within(key, &value, lists)?;
            Ok(if value.is_instance_of::<PyString>() { format!("{said:?}") } else { said })
        });
        let values = values.collect::<PyResult<Vec<_>>>()?;
        lists.pop();
        return Ok(format!("[{}]", values.join(", ")));
    }
    // A scalar of NumPy.
    if let Ok(value) = value.call_method0("item")
        && (value.is_instance_of::<PyBool>() || value.is_instance_of::<PyInt>() || value.is_instance_of::<PyFloat>())
    {
        return text(key, &value);
    }
    let got = value.get_type();
    Err(ArgumentError::new_err(format!("{key} is a {got}; accepted: bool, int, float, str, or a list of these")))
}

/// Returns the words of options: each name with its value, for a list once a value; a flag alone.
pub fn words(options: &[(&str, Option<Bound<PyAny>>)]) -> PyResult<Vec<String>> {
    let mut words = Vec::new();
    for (name, value) in options {
        let Some(value) = value else { continue };
        let option = format!("--{name}");
        if let Ok(flag) = value.cast::<PyBool>() {
            words.extend(flag.is_true().then_some(option));
        } else if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
            for value in value.try_iter()? {
                words.push(format!("{option}={}", text(name, &value?)?));
            }
        } else {
            words.push(format!("{option}={}", text(name, value)?));
        }
    }
    Ok(words)
}

/// Returns overrides as options.
pub fn set_words(overrides: &Overrides) -> impl Iterator<Item = String> {
    overrides.iter().map(|(key, value)| format!("--set={key}={value}"))
}

/// Returns the name of every shipped scene, with a text about it.
#[pyfunction]
pub fn scenes(py: Python) -> PyResult<Bound<PyDict>> {
    let dict = PyDict::new(py);
    for shipped in shipped() {
        let scene = shipped.parse(&[]).map_err(|error| PyTypeError::new_err(error.to_string()))?;
        dict.set_item(shipped.name, scene.about.split_whitespace().collect::<Vec<_>>().join(" "))?;
    }
    Ok(dict)
}

/// Returns the keys of a scene, as `hpu keys --json`: a dict for each, with section, key, unit, default, accepted
/// values and meaning. `section` is one such as `"method.pwm"`, or a word of names and meanings, as `"friction"`.
///
/// Raises `hpu.ArgumentError` when no key has it.
#[pyfunction]
#[pyo3(signature = (section = None))]
pub fn keys<'py>(py: Python<'py>, section: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
    let found = answers::keys(section).map_err(|refusal| ArgumentError::new_err(refusal.to_string()))?;
    object(py, &found)
}
