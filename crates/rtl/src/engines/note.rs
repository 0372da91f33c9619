//! Notes for the user: of what went otherwise than usual and leaves the result as it is.

use std::collections::BTreeSet;
use std::sync::{Mutex, OnceLock, PoisonError};

static TELL: OnceLock<fn(&str)> = OnceLock::new();

/// Tells each note by this function from now on. A program that calls this never hears of none.
pub fn tell_notes(tell: fn(&str)) {
    // The first one stays.
    let _ = TELL.set(tell);
}

/// Tells a note, once a process.
pub(crate) fn note(said: String) {
    static TOLD: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if let Some(tell) = TELL.get()
        && TOLD.lock().unwrap_or_else(PoisonError::into_inner).insert(said.clone())
    {
        tell(&format!("note: {said}"));
    }
}
