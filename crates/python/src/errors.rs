//! The exceptions of the package, which are classes in Python, made from the errors of the libraries.

use std::any::Any;

use hpu::Status;
use hpu_cosim::SceneFile;
use pyo3::PyErr;
use pyo3::import_exception;

import_exception!(hpu._errors, Error);
import_exception!(hpu._errors, SceneError);
import_exception!(hpu._errors, ArgumentError);
import_exception!(hpu._errors, HandleError);
import_exception!(hpu._errors, EndError);

/// Returns the exception of an error of libhpu. `scene` is the file of the scene that it speaks of, and the reason why
/// the scene itself is refused, if it is.
pub fn of_plant(error: &hpu::Error, scene: Option<(&SceneFile, Option<hpu_cosim::scene::SceneError>)>) -> PyErr {
    let text = error.text.clone();
    match (error.status, scene) {
        (Status::Refused, Some((file, refused))) => of_scene(file, refused, text),
        (Status::Refused | Status::Argument, _) => ArgumentError::new_err(text),
        (Status::End | Status::Over, _) => EndError::new_err(text),
        (Status::Closed | Status::Busy | Status::Full | Status::Broken, _) => HandleError::new_err(text),
    }
}

/// Returns the exception of a message about a scene. If the scene itself is refused, the exception has its file and
/// line.
pub fn of_scene(file: &SceneFile, refused: Option<hpu_cosim::scene::SceneError>, text: String) -> PyErr {
    match refused {
        Some(refused) => {
            let (line, column) = refused.place().unzip();
            SceneError::new_err((format!("{refused:#}"), file.name.clone(), line, column))
        }
        None => Error::new_err(text),
    }
}

/// Returns the exception of a panic, which is a fault of the library.
pub fn of_panic(panic: &(dyn Any + Send)) -> PyErr {
    let said = panic.downcast_ref::<String>().map(String::as_str);
    let said = said.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message");
    Error::new_err(format!("a fault of the library: {said}"))
}
