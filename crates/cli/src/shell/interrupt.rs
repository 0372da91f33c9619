//! Handles Ctrl-C (SIGINT), SIGTERM, SIGHUP of a terminal that closes, and SIGQUIT. A run stops at its next event and
//! reports what was done; any other command ends at once. Running tools are ended, and temporary files are removed.

use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;
use hpu_rtl::{stop_tools, system, temporary};

use crate::shell::exit::{Exit, Failure};
use crate::shell::progress::Watch;

static CONTROL: Control = Control::new();
/// Whether a command checks `CONTROL.stop`.
static HEEDED: AtomicBool = AtomicBool::new(false);
/// The first signal that was received.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// The time in which a command that checks `CONTROL.stop` must end after a signal.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Starts to listen for signals. The first signal asks the command to stop within [`PATIENCE`], if the command checks
/// `CONTROL.stop`. The second signal ends the program, and so does the first if the command does not check.
pub fn listen() -> Result<(), Failure> {
    let listening = system::listen(|signal| {
        let is_first = SIGNAL.compare_exchange(0, signal, Ordering::Relaxed, Ordering::Relaxed).is_ok();
        CONTROL.stop.store(true, Ordering::Relaxed);
        if !is_first || !HEEDED.load(Ordering::Relaxed) {
            end();
        }
        stop_tools();
        thread::spawn(|| {
            thread::sleep(PATIENCE);
            end();
        });
    });
    listening.map_err(|error| Failure::usage(format!("cannot listen for signals: {error}")))
}

/// Ends the program. What was printed or committed until then remains.
pub fn end() -> ! {
    stop_tools();
    temporary::remove_temporaries();
    std::process::exit(code().into());
}

/// Returns the exit code of an interrupted program, as a shell has it of one that a signal ended: 130 after SIGINT, 143
/// after SIGTERM.
pub fn code() -> u8 {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => Exit::Interrupted as u8,
        signal => 128 + u8::try_from(signal).unwrap_or_default(),
    }
}

/// Returns the control of a run. From here on the caller must check `CONTROL.stop`.
pub(crate) fn heed() -> &'static Control {
    HEEDED.store(true, Ordering::Relaxed);
    &CONTROL
}

/// Returns the control of a run as [`heed`] does, with its progress on stderr.
pub fn watch() -> Watch<'static> {
    Watch::Shown(heed())
}

/// Returns a failure where a signal has asked the command to stop.
pub fn check() -> Result<(), Failure> {
    if pressed() { Err(Failure::interrupted()) } else { Ok(()) }
}

/// Returns whether a signal has asked the command to stop.
pub fn pressed() -> bool {
    CONTROL.stop.load(Ordering::Relaxed)
}
