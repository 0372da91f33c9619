//! `hpu reproduce` for a paper's statements, line by line.

use std::path::PathBuf;

use hpu_chart::{Estimate, Picture, velocities};
use hpu_cosim::Control;
use hpu_farm::{Failed, typed, units};
use hpu_papers::Error;
use hpu_papers::studies::comparison::{Comparison, Found, beside_csv, beside_text, sums};
use hpu_papers::studies::summing::Sum;
use serde_json::{Value, json};

use crate::journal;
use crate::page::give;
use crate::shell::{Exit, Failure, Folder, Jobs, interrupt, tell, with_progress};
use crate::work::Rows;

/// Where to.
#[derive(clap::Args)]
#[group(skip)]
pub(crate) struct Args {
    /// Write text and CSV into this folder, and go on there after an interruption
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub jobs: Jobs,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
}

/// Runs a study that comes with the program.
pub fn reproduce(comparison: &Comparison, args: &Args) -> Result<Exit, Failure> {
    run(comparison, &format!("hpu reproduce {}", comparison.name), &[], args, None)
}

/// Measures every line, and prints the results beside the published ones. `files` are those that the lines depend on,
/// `gathered` the rows that a sweep has gathered.
pub fn run(
    comparison: &Comparison,
    command: &str,
    files: &[Vec<u8>],
    args: &Args,
    gathered: Option<Rows>,
) -> Result<Exit, Failure> {
    let lines = comparison.lines.len();
    let parts: Vec<String> = comparison.lines.iter().map(|line| format!("{}/{}", line.group, line.what)).collect();
    let parts = parts.iter().map(String::as_bytes).chain(files.iter().map(Vec::as_slice));
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    // The rows of a sweep are kept in its own folder.
    let kept = args.out.as_deref().filter(|_| gathered.is_none());
    let (mut journal, done) = journal::resume(kept, lines, ("study", command), parts)?;
    let done = gathered.map_or(done, typed);
    let control = interrupt::heed();
    let left = (lines - done.len()) as u64;
    let rows = with_progress(left, "lines", control, || {
        let unit = |index: usize, control: &_| {
            (comparison.lines[index].measure)(control).map(|found| found.map_err(Failed::new))
        };
        units::run(lines, args.jobs.get(), done, control, unit, |index, row| journal.add(index, row))
    })?;
    let Some(rows) = rows else {
        let rest = match &args.out {
            Some(dir) => format!("; the same command goes on in {}", dir.display()),
            None => String::new(),
        };
        tell(&format!("interrupted{rest}"));
        return Ok(Exit::Interrupted);
    };
    let rows: Vec<_> = rows.into_iter().map(|row| row.map_err(Error::from)).collect();
    let text = format!("{}\n$ {command}\n\n{}", comparison.title, beside_text(comparison, &rows));
    give((&text, object(comparison, command, &rows)), folder, args.json, || {
        let files = [("txt", text.clone()), ("csv", beside_csv(comparison, &rows, command))];
        let files = files.map(|(ending, content)| (format!("{}.{ending}", comparison.name), content));
        Ok((files.into(), picture(comparison, command, control)?.into_iter().collect()))
    })?;
    Ok(Exit::when(rows.iter().all(Result::is_ok)))
}

/// Returns the results of a comparison as JSON.
pub fn object(comparison: &Comparison, command: &str, rows: &[Result<Found, Error>]) -> Value {
    let lines = comparison.lines.iter().zip(rows).map(|(line, row)| {
        json!({
            "group": line.group,
            "what": line.what,
            "published": line.published,
            "emulated": row.as_ref().ok().map(|found| &found.text),
            "reason": row.as_ref().err().map(Error::to_string),
        })
    });
    json!({
        "study": comparison.name.as_str(),
        "complete": true,
        "command": command,
        "lines": lines.collect::<Vec<_>>(),
        "claims": sums(comparison, rows).iter().map(claim).collect::<Vec<_>>(),
        "notes": comparison.notes,
        "files": [],
    })
}

/// Returns the picture of the velocities that the first group with some measures; `None` if no line measures any, or
/// when stopped.
fn picture(comparison: &Comparison, command: &str, control: &Control) -> Result<Option<Picture>, Failure> {
    let mut lines = comparison.lines.iter().filter_map(|line| Some((line, line.shown.as_ref()?))).peekable();
    let Some(group) = lines.peek().map(|(line, _)| line.group) else { return Ok(None) };
    let mut estimates = Vec::new();
    for (line, shown) in lines.take_while(|(line, _)| line.group == group) {
        let Some(velocities) = (shown.run)(control).map_err(Failure::file)? else { return Ok(None) };
        estimates.push(Estimate { name: line.what.clone(), window_s: shown.window_s, velocities });
    }
    Ok(Some(velocities(group, &estimates, command)))
}

/// Returns a claim as JSON.
pub fn claim(Sum { statement, finding, found }: &Sum) -> Value {
    json!({
        "letter": statement.letter,
        "paper": statement.paper,
        "place": statement.place,
        "counts_as_that": statement.means,
        "finding": finding.name(),
        "found": found,
    })
}
