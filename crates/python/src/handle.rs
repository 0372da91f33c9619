//! The content of a handle that can be closed, and that one thread at a time may use.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, TryLockError};

use pyo3::PyResult;

use crate::errors::{HandleError, of_panic};

/// A handle: open, closed, or broken by a fault of the library.
pub struct Handle<T> {
    what: &'static str,
    inside: Mutex<Option<T>>,
}

impl<T> Handle<T> {
    /// Returns an open handle. `what` names it in messages.
    pub fn new(what: &'static str, inside: T) -> Self {
        Self { what, inside: Mutex::new(Some(inside)) }
    }

    /// Calls `work` with what is inside. A panic closes the handle.
    ///
    /// # Errors
    ///
    /// `hpu.HandleError` when the handle is closed, or when another thread is inside a call.
    pub fn with<R>(&self, work: impl FnOnce(&mut T) -> PyResult<R>) -> PyResult<R> {
        let mut inside = match self.inside.try_lock() {
            Ok(inside) => inside,
            Err(TryLockError::Poisoned(inside)) => inside.into_inner(),
            Err(TryLockError::WouldBlock) => {
                let what = self.what;
                let said = format!("another thread is inside a call with this {what}; accepted: one at a time");
                return Err(HandleError::new_err(said));
            }
        };
        let Some(open) = inside.as_mut() else {
            let what = self.what;
            return Err(HandleError::new_err(format!("this {what} was closed; open another")));
        };
        catch_unwind(AssertUnwindSafe(|| work(open))).unwrap_or_else(|panic| {
            *inside = None;
            Err(of_panic(&*panic))
        })
    }

    /// Closes the handle. A closed one stays closed.
    ///
    /// # Errors
    ///
    /// `hpu.HandleError` when another thread is inside a call.
    pub fn close(&self) -> PyResult<()> {
        match self.inside.try_lock() {
            Ok(mut inside) => *inside = None,
            Err(TryLockError::Poisoned(inside)) => *inside.into_inner() = None,
            Err(TryLockError::WouldBlock) => return self.with(|_| Ok(())),
        }
        Ok(())
    }
}
