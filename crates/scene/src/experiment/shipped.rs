//! The data files of the scenes that come with the program.

use std::io;

/// A log of EPFL's haptic paddle. A page, which has not its loop, has not the log.
macro_rules! paddle {
    ($file:literal) => {
        (
            concat!("../recordings/epfl-paddle/", $file),
            if cfg!(target_family = "wasm") {
                ""
            } else {
                hpu_assets::text(concat!("testbench/recordings/epfl-paddle/", $file))
            },
        )
    };
}

static FILES: &[(&str, &str)] = &[
    ("replay-capture.vcd", hpu_assets::text("testbench/scenes/replay-capture.vcd")),
    ("replay-motion.csv", hpu_assets::text("testbench/scenes/replay-motion.csv")),
    ("../recordings/qube/arm-start.csv", hpu_assets::text("testbench/recordings/qube/arm-start.csv")),
    ("../recordings/qube/arm-stop.csv", hpu_assets::text("testbench/recordings/qube/arm-stop.csv")),
    paddle!("step-p05-d0003.csv"),
    paddle!("step-p05-d0008.csv"),
    paddle!("step-p01-d0003.csv"),
    paddle!("step-p05-i0001-d0008.csv"),
];

/// Returns a data file that a shipped scene names.
///
/// # Errors
///
/// [`io::ErrorKind::NotFound`] for any other name.
pub fn shipped_file(name: &str) -> io::Result<Vec<u8>> {
    let file = FILES.iter().find(|(file, _)| *file == name);
    file.map(|(_, text)| text.as_bytes().to_vec()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
}
