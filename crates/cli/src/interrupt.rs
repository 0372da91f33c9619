//! Ctrl-C: a run stops at its next event and tells what was done; anything else ends at once. No half-written file stays.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use hpu_cosim::Control;

use crate::exit::{Exit, Failure};
use crate::files;

static CONTROL: Control = Control { stop: AtomicBool::new(false), progress: AtomicU64::new(0) };
/// Whether somebody looks at `CONTROL.stop`.
static HEEDED: AtomicBool = AtomicBool::new(false);

/// Begins to listen. The first Ctrl-C asks who heeds it to stop; the second, or the first when nobody does, ends the
/// program.
pub fn listen() -> Result<(), Failure> {
    ctrlc::set_handler(|| {
        if HEEDED.load(Ordering::Relaxed) && !CONTROL.stop.swap(true, Ordering::Relaxed) {
            return;
        }
        files::remove_temporaries();
        std::process::exit(Exit::Interrupted as i32);
    })
    .map_err(|error| Failure::usage(format!("cannot listen for Ctrl-C: {error}")))
}

/// The control of a run, for those who heed it from here on.
pub fn heed() -> &'static Control {
    HEEDED.store(true, Ordering::Relaxed);
    &CONTROL
}

/// Whether Ctrl-C was pressed.
pub fn pressed() -> bool {
    CONTROL.stop.load(Ordering::Relaxed)
}
