//! `hpu vectors --verify`: compares vector files with the emulator.

use std::fmt;
use std::path::{Path, PathBuf};

use hpu_cosim::{PlainName, excerpt, named_block};
use hpu_datapath::{AnyBlock, block_names};
use hpu_rtl::{Around, Header, Stimulus, Vectors, around_in_file, row_line};
use hpu_signal::Format;

use crate::shell::{Exit, Failure, Folder, print, read_text, verdict};
use crate::waves::waveform;

/// The model that answers the rows of a file.
enum Model {
    /// A block, row by row.
    Block(Box<dyn AnyBlock>),
    /// A lookup table.
    Table(Vectors),
}

/// Reads each file, and runs it on the block that it names. With a folder, writes a waveform of each first difference
/// there.
pub fn verify(files: &[PathBuf], out: Option<&Path>) -> Result<Exit, Failure> {
    let mut folder = out.map(Folder::open).transpose()?;
    let mut all_equal = true;
    for file in files {
        let text = read_text(file)?;
        let (vectors, model) = read(file, &text)?;
        let said = match difference(&vectors, model) {
            None => format!(": {} rows agree\n", vectors.rows.len()),
            Some(Difference { row, said, around }) => {
                all_equal = false;
                let line = if text.starts_with('{') { row_line(&text, row) } else { row + 1 };
                let mut told = format!(":{line}: {}\n", verdict(&said, false));
                if let Some(around) = around {
                    around.lines(row as u64).iter().for_each(|line| told += &format!("    {line}\n"));
                    let name = free_name(file, vectors.header.block, folder.as_ref());
                    told += &waveform(&around, row as u64, &name, folder.as_mut())?;
                }
                told
            }
        };
        print(&format!("{}{said}", file.display()))?;
    }
    folder.map(Folder::commit).transpose()?;
    Ok(Exit::when(all_equal))
}

/// Returns a free name for a file's waveform. The second of two files with the same name gets a number.
fn free_name(file: &Path, block: &str, folder: Option<&Folder>) -> String {
    let stem = format!("{block}-{}", file.file_stem().unwrap_or_default().to_string_lossy());
    let stem = PlainName::near(&stem).to_string();
    let is_taken = |name: &String| {
        folder.is_some_and(|folder| folder.places().any(|place| place == folder.place(&format!("{name}.vcd"))))
    };
    let mut names = std::iter::once(stem.clone()).chain((2..).map(|number| format!("{stem}-{number}")));
    names.find(|name| !is_taken(name)).expect("there are names without end")
}

/// Returns the block of this name with these generics, and every table in it. The formats are those that are told.
fn models(name: &str, generics: &[(String, String)], formats: &[(&str, Format)]) -> Result<Models, String> {
    let block = named_block(name, generics).map_err(|error| error.to_string())?;
    let tables: Vec<_> = block.roms().iter().map(|rom| Vectors::of_rom(&*block, rom)).collect();
    let tables = tables.into_iter().map(|table| (table.header.clone(), Model::Table(table)));
    Ok([(Header::of(&*block).with_formats(formats), Model::Block(block))].into_iter().chain(tables).collect())
}

type Models = Vec<(Header, Model)>;

/// Generics, each a name and a value, and columns with their formats.
type Told<'t> = (Vec<(String, String)>, Vec<(&'t str, Format)>);

/// Returns the generics, and the formats of the columns, that line 1 of a text tells.
fn told(line: &str) -> Told<'_> {
    let (columns, generics) = line.split_once(" generics ").unwrap_or((line, ""));
    let pairs = generics.split(' ').filter_map(|pair| pair.split_once('='));
    let formats = columns.split(' ').filter_map(|word| {
        let (name, format) = word.split_at(word.find('(')?);
        Some((name, format.parse().ok()?))
    });
    (pairs.map(|(name, value)| (name.to_string(), value.to_string())).collect(), formats.collect())
}

/// Returns the vectors of a file, and the model that they are compared with.
fn read(file: &Path, text: &str) -> Result<(Vectors, Model), Failure> {
    let at = |line: usize, error: &dyn fmt::Display| Failure::file(format!("{}:{line}: {error}", file.display()));
    if text.starts_with('{') {
        let mut found = Vec::new();
        let headers = |name: &str, generics: &[(String, String)]| {
            found = models(name, generics, &[])?;
            Ok(found.iter().map(|(header, _)| header.clone()).collect::<Vec<_>>())
        };
        let vectors = Vectors::from_json(text, headers).map_err(|error| at(error.line(), &error.why()))?;
        // With the formats of the file, only names tell a table from the block.
        let names = |header: &Header| header.columns().map(|column| column.name).collect::<Vec<_>>();
        let is_its = |header: &Header| names(header) == names(&vectors.header);
        let model = found.into_iter().find(|(header, _)| is_its(header));
        return Ok((vectors, model.expect("it was found by its header").1));
    }
    let line = text.lines().next().unwrap_or("");
    let name = line.split(' ').nth(1).unwrap_or("");
    if !block_names().contains(&name) {
        let (name, line) = (excerpt(name), excerpt(line));
        return Err(at(1, &format!("no block `{name}`; expected `# BLOCK in ... out ...`, found `{line}`")));
    }
    let (generics, formats) = told(line);
    let mut found = models(name, &generics, &formats).map_err(|why| at(1, &why))?;
    // If no line 1 of this configuration is the file's, that of the block is taken, so that the reader can report what
    // line 1 should be.
    let exact = found.iter().position(|(header, _)| header.to_string() == line).unwrap_or(0);
    let (header, model) = found.swap_remove(exact);
    Ok((Vectors::parse(text, header).map_err(|error| Failure::file(format!("{}:{error}", file.display())))?, model))
}

/// The first word that differs.
struct Difference {
    /// Its row, counted from 1.
    row: usize,
    /// The message about it.
    said: String,
    /// The rows around it, if both the file and the emulator have them.
    around: Option<Around>,
}

/// Returns the first word in which the emulator differs from the file.
fn difference(vectors: &Vectors, model: Model) -> Option<Difference> {
    let Header { clocked, inputs, .. } = &vectors.header;
    let stimulus = |row: &Vec<i64>| Stimulus {
        rst: *clocked && row[0] == 1,
        words: row[usize::from(*clocked)..inputs.len()].to_vec(),
    };
    let again = match model {
        Model::Table(table) => table,
        Model::Block(mut block) => {
            block.reset();
            Vectors::record(&mut *block, vectors.rows.iter().map(stimulus))
        }
    };
    if vectors.rows.len() != again.rows.len() {
        let rows = vectors.rows.len();
        let said = format!("{rows} rows in the file, {} in the table", again.rows.len());
        return Some(Difference { row: rows, said, around: None });
    }
    let rows = vectors.rows.iter().zip(&again.rows).zip(1..);
    let mut words = rows.flat_map(|((told, answered), row)| {
        let pairs = told.iter().zip(answered).zip(vectors.header.columns());
        pairs.map(move |((&told, &answered), column)| (row, column, told, answered))
    });
    let (row, column, told, answered) = words.find(|(_, _, told, answered)| told != answered)?;
    let (told, answered) = (column.format.value(told), column.format.value(answered));
    let said = format!("{} is {told} in the file, {answered} in the emulator", column.name);
    Some(Difference { row, said, around: Some(around_in_file(vectors, &again, row)) })
}
