//! The committed files that are made from the blocks: packages, testbenches, small golden sets.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::{fs, io};

use hpu_datapath::{registry, variants};

use crate::engines::temporary::{self, Temporary, sweep_files};
use crate::vectors::around_law::around_a_law;
use crate::vectors::package::package;
use crate::vectors::stimuli;
use crate::vectors::testbench::{committed_vectors, testbench};
use crate::vectors::vector::Vectors;

/// Rows of a committed set: as many as a person can read.
const COMMITTED_ROWS: usize = 96;

/// Returns the path (relative to the project) and the text of every generated file.
pub fn generated() -> Vec<(PathBuf, String)> {
    let mut files = Vec::new();
    for block in registry() {
        let name = block.name();
        files.push((format!("hdl/generated/{name}_pkg.vhd"), package(&*block)));
        files
            .push((format!("testbench/vhdl/generated/tb_{name}.vhd"), testbench(&*block, &committed_vectors(&*block))));
        if let Some(vhdl) = around_a_law(&*block) {
            files.push((format!("hdl/generated/{name}.vhd"), vhdl));
        }
    }
    for (label, mut block) in variants() {
        let directed: Vec<_> = stimuli::directed(&*block).into_iter().take(COMMITTED_ROWS).collect();
        let random = stimuli::random(&*block, 1, COMMITTED_ROWS);
        for (set, stimuli) in [("directed", directed), ("random", random)] {
            block.reset();
            let text = Vectors::record(&mut *block, stimuli).to_text();
            files.push((format!("vectors/{}/{label}-{set}.txt", block.name()), text));
        }
    }
    files.into_iter().map(|(path, text)| (path.into(), text)).collect()
}

/// Returns the generated files that are absent below `root`, or that differ from what the blocks generate now.
pub fn stale(root: &Path) -> Vec<PathBuf> {
    let differs = |(path, text): &(PathBuf, String)| fs::read_to_string(root.join(path)).ok().as_ref() != Some(text);
    generated().into_iter().filter(differs).map(|(path, _)| path).collect()
}

/// Writes the stale generated files below `root` (`hpu vectors --update`), and returns their paths. Each file is first
/// written beside its place, then all are renamed, so that no file is ever half written.
///
/// # Errors
///
/// The first I/O error.
pub fn write_committed(root: &Path) -> io::Result<Vec<PathBuf>> {
    let stale = stale(root);
    let mut written = Vec::new();
    for (path, text) in generated().into_iter().filter(|(path, _)| stale.contains(path)) {
        let place = root.join(path);
        let (folder, name) = place.parent().zip(place.file_name()).expect("a generated file is in a folder");
        fs::create_dir_all(folder)?;
        sweep_files(folder);
        let file = Temporary::file(folder, &name.to_string_lossy())?;
        file.open()?.write_all(text.as_bytes())?;
        written.push((file, place));
    }
    temporary::place(written).map_err(|(_, error)| error)?;
    Ok(stale)
}
