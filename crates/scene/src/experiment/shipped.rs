//! The data files of the scenes that come with the program.

use std::io;

static FILES: &[(&str, &str)] = &[
    ("replay-capture.vcd", hpu_assets::text("testbench/scenes/replay-capture.vcd")),
    ("replay-motion.csv", hpu_assets::text("testbench/scenes/replay-motion.csv")),
    ("../recordings/qube/arm-start.csv", hpu_assets::text("testbench/recordings/qube/arm-start.csv")),
    ("../recordings/qube/arm-stop.csv", hpu_assets::text("testbench/recordings/qube/arm-stop.csv")),
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
