//! `hpu vectors --verify`: vector files held against the emulator.

use std::fs;
use std::path::Path;

use hpu_datapath::{AnyBlock, block_by_name, variants};
use hpu_rtl::{Header, Stimulus, Vectors};

use crate::exit::{Exit, Failure};
use crate::terminal::{print, verdict};

/// Reads each file and plays it to the block that its first line names.
pub fn verify(files: &[std::path::PathBuf]) -> Result<Exit, Failure> {
    let mut all_equal = true;
    for file in files {
        let text = fs::read_to_string(file).map_err(|error| Failure::at(file, error))?;
        let mut block = block_of(file, &text)?;
        let vectors = Vectors::parse(&text, Header::of(&*block)).map_err(|error| Failure::at(file, error))?;
        let said = match difference(&vectors, &mut *block) {
            None => format!("{} rows agree", vectors.rows.len()),
            Some(difference) => {
                all_equal = false;
                verdict(&difference, false)
            }
        };
        print(&format!("{}: {said}\n", file.display()))?;
    }
    Ok(Exit::when(all_equal))
}

/// The block in the configuration that line 1 tells; in its default one when there is no such configuration, for the
/// reader to say what the line should be.
fn block_of(file: &Path, text: &str) -> Result<Box<dyn AnyBlock>, Failure> {
    let line = text.lines().next().unwrap_or("");
    let name = line.split(' ').nth(1).unwrap_or("");
    let exact = variants().into_iter().find(|(_, block)| Header::of(&**block).to_string() == line);
    exact.map(|(_, block)| block).or_else(|| block_by_name(name)).ok_or_else(|| {
        Failure::at(file, format!("line 1: no block `{name}`; expected `# BLOCK in ... out ...`, found `{line}`"))
    })
}

/// The first word that the block answers otherwise.
fn difference(vectors: &Vectors, block: &mut dyn AnyBlock) -> Option<String> {
    let Header { clocked, inputs, outputs, .. } = &vectors.header;
    let stimulus = |row: &Vec<i64>| Stimulus {
        rst: *clocked && row[0] == 1,
        words: row[usize::from(*clocked)..inputs.len()].to_vec(),
    };
    block.reset();
    let again = Vectors::record(block, vectors.rows.iter().map(stimulus));
    let rows = vectors.rows.iter().zip(&again.rows).zip(1..);
    let mut words = rows.flat_map(|((told, answered), row)| {
        let pairs = told[inputs.len()..].iter().zip(&answered[inputs.len()..]);
        pairs.zip(outputs).map(move |((&told, &answered), output)| (row, output, told, answered))
    });
    let (row, output, told, answered) = words.find(|(_, _, told, answered)| told != answered)?;
    let (told, answered) = (output.format.value(told), output.format.value(answered));
    Some(format!("row {row}: {} is {told} in the file, {answered} in the emulator", output.name))
}
