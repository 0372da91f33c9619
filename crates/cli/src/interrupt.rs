//! Ctrl-C (SIGINT) and SIGTERM: a run stops at its next event and tells what was done; anything else ends at once.
//! Tools that run are ended, and nothing temporary stays.

use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;
use hpu_rtl::{stop_tools, temporary};
use signal_hook::consts::signal::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::exit::{Exit, Failure};

static CONTROL: Control = Control::new();
/// Whether somebody looks at `CONTROL.stop`.
static HEEDED: AtomicBool = AtomicBool::new(false);
/// The first signal.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// How long who heeds a signal may take to end.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Begins to listen. The first signal asks who heeds it to stop, and soon; the second, or the first when nobody does,
/// ends the program.
pub fn listen() -> Result<(), Failure> {
    let listening = Signals::new([SIGINT, SIGTERM]).and_then(|mut signals| {
        thread::Builder::new().name("signals".to_string()).spawn(move || {
            for signal in signals.forever() {
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
            }
        })
    });
    listening.map(drop).map_err(|error| Failure::usage(format!("cannot listen for signals: {error}")))
}

/// Ends the program, with what it has written.
pub fn end() -> ! {
    stop_tools();
    temporary::remove_temporaries();
    std::process::exit(code().into());
}

/// The exit code of what was interrupted: 130 by SIGINT, 143 by SIGTERM.
pub fn code() -> u8 {
    if SIGNAL.load(Ordering::Relaxed) == SIGTERM { Exit::Terminated as u8 } else { Exit::Interrupted as u8 }
}

/// The control of a run, for those who heed it from here on.
pub fn heed() -> &'static Control {
    HEEDED.store(true, Ordering::Relaxed);
    &CONTROL
}

/// Whether a signal asked to stop.
pub fn pressed() -> bool {
    CONTROL.stop.load(Ordering::Relaxed)
}
