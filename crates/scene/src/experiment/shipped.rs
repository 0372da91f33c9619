//! The data files of the scenes that come with the program.

use std::io;

macro_rules! text {
    ($file:expr) => {
        include_str!(concat!("../../../../testbench/scenes/", $file))
    };
}

static FILES: &[(&str, &str)] = &[
    ("replay-capture.vcd", text!("replay-capture.vcd")),
    ("replay-motion.csv", text!("replay-motion.csv")),
    ("../recordings/qube/arm-start.csv", text!("../recordings/qube/arm-start.csv")),
    ("../recordings/qube/arm-stop.csv", text!("../recordings/qube/arm-stop.csv")),
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
