//! What a paper printed beside what comes out here: one line a statement, each measured by runs of its own.

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, shipped};

/// A paper's statements, in its order.
pub struct Comparison {
    /// Name on the command line.
    pub name: &'static str,
    /// Heading.
    pub title: &'static str,
    /// The lines.
    pub lines: Vec<Line>,
    /// What a reader must know of the whole: assumed parameters, readings, causes of gaps.
    pub notes: &'static [&'static str],
}

/// A statement, and how it is measured.
pub struct Line {
    /// Lines of one group stand together under this heading.
    pub group: &'static str,
    /// What is measured.
    pub what: String,
    /// What the paper prints; empty where it prints nothing.
    pub published: &'static str,
    /// Measures: the number or verdict as text; `None` when stopped.
    pub measure: Measure,
}

/// A measurement: its result in words with units, or the reason why there is none; `None` when `control` stopped it.
pub type Measure = Box<dyn Fn(&Control) -> Option<Result<String, String>> + Sync>;

/// A shipped scene under overrides.
///
/// # Errors
///
/// What the scene refuses.
pub fn shipped_scene(name: &str, set: &[(&str, &str)]) -> Result<Experiment, String> {
    let scene = shipped().iter().find(|scene| scene.name == name).ok_or_else(|| format!("no scene {name}"))?;
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    scene.parse(&set).map_err(|error| error.to_string())
}

/// The lines as a table of text, each with its result, in the order of the lines.
#[must_use]
pub fn beside_text(comparison: &Comparison, results: &[Result<String, String>]) -> String {
    let width = |texts: &mut dyn Iterator<Item = usize>| texts.max().unwrap_or(0);
    let what = width(&mut comparison.lines.iter().map(|line| line.what.chars().count()));
    let published = width(&mut comparison.lines.iter().map(|line| line.published.chars().count())).max(9);
    let is_paper = comparison.lines.iter().any(|line| !line.published.is_empty());
    let column = |text: &str| if is_paper { format!("{text:published$}  ") } else { String::new() };
    let mut text = format!("{:what$}  {}emulated\n", "", column("published"));
    let mut group = "";
    for (line, result) in comparison.lines.iter().zip(results) {
        if line.group != group {
            group = line.group;
            text += &format!("\n{group}\n");
        }
        let found = match result {
            Ok(found) => found.clone(),
            Err(reason) => format!("not measured: {reason}"),
        };
        text += &format!("{:what$}  {}{found}\n", line.what, column(line.published));
    }
    for note in comparison.notes {
        text += &format!("\n{note}\n");
    }
    text
}

/// The lines as CSV, under the command that made them.
#[must_use]
pub fn beside_csv(comparison: &Comparison, results: &[Result<String, String>], command: &str) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut csv = format!("# {command}\ngroup,what,published,emulated,reason\n");
    for (line, result) in comparison.lines.iter().zip(results) {
        let (found, reason) = match result {
            Ok(found) => (found.as_str(), ""),
            Err(reason) => ("", reason.as_str()),
        };
        let fields = [line.group, &line.what, line.published, found, reason].map(quoted);
        csv += &format!("{}\n", fields.join(","));
    }
    csv
}
