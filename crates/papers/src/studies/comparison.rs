//! A paper's statements beside the emulator's results: one line for each statement, each measured by runs of its own.

use std::collections::BTreeMap;

use hpu_cosim::{Control, PlainName};
use serde::{Deserialize, Serialize};

use super::summing::{Finding, Statement, Sum, summing_up};
use super::vary::{Variables, written};
use crate::Error;
use crate::formula::Formula;
use crate::measure::Velocities;

/// The statements of a paper, in the paper's order.
pub struct Comparison {
    /// Name of the comparison on the command line, and of its files.
    pub name: PlainName,
    /// Heading.
    pub title: &'static str,
    /// The lines, one for each statement.
    pub lines: Vec<Line>,
    /// The paper's claims, and how each is judged.
    pub claims: Vec<Claim>,
    /// Notes that a reader needs for the whole comparison: assumed parameters, readings of the paper, causes of
    /// differences.
    pub notes: Vec<&'static str>,
}

/// A published claim, and how the figures of its lines decide it.
pub struct Claim {
    /// The claim.
    pub statement: Statement,
    /// The conditions on the figures of the claim's lines. Each number that a condition gives is a case of what the
    /// paper leaves open. There is none if the scene's own parameters were inferred from the claim.
    pub holds: Vec<Formula>,
    /// A variable of the lines: neighbouring lines with the same value of it are judged together, apart from the
    /// others.
    pub by: Option<String>,
}

/// A statement, and how it is measured.
pub struct Line {
    /// Heading under which the lines of one group stand together.
    pub group: &'static str,
    /// The quantity that is measured.
    pub what: String,
    /// The paper's figure as printed; empty if the paper prints none.
    pub published: &'static str,
    /// Letters of the claims that this line decides, alone or with others.
    pub claims: &'static str,
    /// Names of the figures that the measurement gives, in their order.
    pub figures: Vec<String>,
    /// The variables of the line.
    pub vars: Variables,
    /// The measurement: returns a number or a verdict, or `None` when stopped.
    pub measure: Measure,
    /// The velocities that a picture of the line shows, if it measures one.
    pub shown: Option<Shown>,
}

/// A run that gives the velocities; `None` when `control` stopped it.
pub type Running = Box<dyn Fn(&Control) -> Result<Option<Velocities>, Error> + Sync>;

/// The velocities of a line, for a picture.
pub struct Shown {
    /// The time that the picture shows, from and to, in s; the whole run if there is none.
    pub window_s: Option<[f64; 2]>,
    /// Runs the scene of the line.
    pub run: Running,
}

/// A measurement: returns its result or the reason why there is none; `None` when `control` stopped it.
pub type Measure = Box<dyn Fn(&Control) -> Option<Result<Found, Error>> + Sync>;

/// The result of a line.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(into = "Written", try_from = "Written")]
pub struct Found {
    /// The result as text with units.
    pub text: String,
    /// The numbers that decide the claims, in the order that the line's claims expect; infinite where there is none.
    pub figures: Vec<f64>,
}

impl From<String> for Found {
    fn from(text: String) -> Self {
        Self { text, figures: Vec::new() }
    }
}

impl Found {
    /// Returns a result from its text and from the numbers that decide the claims.
    pub fn new(text: String, figures: impl IntoIterator<Item = f64>) -> Self {
        Self { text, figures: figures.into_iter().collect() }
    }
}

/// A result as a row: a text, the figures before a semicolon, for the one column of a sweep.
#[derive(Serialize, Deserialize)]
struct Written {
    found: String,
}

impl From<Found> for Written {
    fn from(Found { text, figures }: Found) -> Self {
        let figures: Vec<_> = figures.iter().map(|figure| format!("{figure:?}")).collect();
        Self { found: format!("{};{text}", figures.join(" ")) }
    }
}

impl TryFrom<Written> for Found {
    type Error = &'static str;

    fn try_from(Written { found }: Written) -> Result<Self, Self::Error> {
        let (figures, text) = found.split_once(';').ok_or("no figures before a semicolon")?;
        let figures = figures.split_whitespace().map(str::parse).collect::<Result<_, _>>();
        Ok(Self { text: text.to_string(), figures: figures.map_err(|_| "a figure is no number")? })
    }
}

/// Returns a measurement whose result converts into [`Found`].
pub fn measure<F: Into<Found>>(measure: impl Fn(&Control) -> Option<Result<F, Error>> + Sync + 'static) -> Measure {
    Box::new(move |control| measure(control).map(|found| found.map(Into::into)))
}

/// Returns the findings on all claims, each from the results of its lines.
pub fn sums(comparison: &Comparison, results: &[Result<Found, Error>]) -> Vec<Sum> {
    let sum = |claim: &Claim| {
        let own = comparison.lines.iter().zip(results).filter(|(line, _)| line.claims.contains(claim.statement.letter));
        let (lines, results): (Vec<_>, Vec<_>) = own.unzip();
        let found = results.into_iter().map(Result::as_ref).collect::<Result<Vec<_>, _>>();
        let cases = found.map_err(Error::clone).and_then(|found| claimed(claim, &lines, &found));
        let (finding, found) = match cases {
            Ok(cases) => {
                let so = cases.iter().filter(|so| **so).count();
                let found = match cases.len() {
                    0 => String::new(),
                    1 => format!("so in {so} of 1 case"),
                    count => format!("so in {so} of {count} cases"),
                };
                (Finding::of_cases(&cases), found)
            }
            Err(reason) => (Finding::CannotBeTold, format!("not measured: {reason}")),
        };
        Sum { statement: claim.statement, finding, found }
    };
    comparison.claims.iter().map(sum).collect()
}

/// Returns, for each case of what the paper leaves open, whether a claim holds by the results of its lines.
///
/// # Errors
///
/// Returns which figure of a condition no line has.
pub fn claimed(claim: &Claim, lines: &[&Line], found: &[&Found]) -> Result<Vec<bool>, Error> {
    let group = |line: &Line| claim.by.as_ref().map(|by| line.vars.get(by).map(written)).transpose();
    let groups = lines.iter().map(|line| group(line)).collect::<Result<Vec<_>, _>>()?;
    let mut cases = Vec::new();
    let mut rest = 0;
    while rest < lines.len() {
        let end = groups[rest..].iter().position(|group| *group != groups[rest]).map_or(lines.len(), |at| rest + at);
        let mut figures: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for (line, found) in lines[rest..end].iter().zip(&found[rest..end]) {
            for (name, figure) in line.figures.iter().zip(&found.figures) {
                figures.entry(name).or_default().push(*figure);
            }
        }
        for formula in &claim.holds {
            let named = |name: &str| {
                figures.get(name).cloned().ok_or_else(|| Error::new(format_args!("no line has the figure {name}")))
            };
            cases.extend(formula.value(&named)?.into_iter().map(|case| case != 0.0 && !case.is_nan()));
        }
        rest = end;
    }
    Ok(cases)
}

/// The name of a group, and its lines with their results.
type Grouped<'a> = (&'static str, Vec<(&'a Line, &'a Result<Found, Error>)>);

/// Returns the lines with their results, by their groups.
fn groups<'a>(comparison: &'a Comparison, results: &'a [Result<Found, Error>]) -> Vec<Grouped<'a>> {
    let mut groups: Vec<(&str, Vec<_>)> = Vec::new();
    for (line, result) in comparison.lines.iter().zip(results) {
        match groups.last_mut() {
            Some((group, lines)) if *group == line.group => lines.push((line, result)),
            _ => groups.push((line.group, vec![(line, result)])),
        }
    }
    groups
}

/// Returns the lines and their results as a table of text, in the order of the lines. Tabs divide a result into
/// columns, which are aligned within a group.
pub fn beside_text(comparison: &Comparison, results: &[Result<Found, Error>]) -> String {
    let width = |texts: &mut dyn Iterator<Item = usize>| texts.max().unwrap_or(0);
    let what = width(&mut comparison.lines.iter().map(|line| line.what.chars().count()));
    let published = width(&mut comparison.lines.iter().map(|line| line.published.chars().count())).max(9);
    let is_paper = comparison.lines.iter().any(|line| !line.published.is_empty());
    let column = |text: &str| if is_paper { format!("{text:published$}  ") } else { String::new() };
    let mut text = format!("{:what$}  {}emulated\n", "", column("published"));
    for (group, lines) in groups(comparison, results) {
        text += &format!("\n{group}\n");
        let cells = |result: &Result<Found, Error>| match result {
            Ok(found) => found.text.split('\t').map(String::from).collect(),
            Err(reason) => vec![format!("not measured: {reason}")],
        };
        let rows: Vec<(&Line, Vec<String>)> = lines.iter().map(|(line, result)| (*line, cells(result))).collect();
        for (line, cells) in &rows {
            let size = |at: usize| {
                width(&mut rows.iter().filter(|row| row.1.len() > at + 1).map(|row| row.1[at].chars().count()))
            };
            let last = cells.len() - 1;
            let found = cells.iter().enumerate().map(|(at, cell)| match at == last {
                true => cell.clone(),
                false => format!("{cell:0$}  ", size(at)),
            });
            text += &format!("{:what$}  {}{}\n", line.what, column(line.published), found.collect::<String>());
        }
    }
    for note in &comparison.notes {
        text += &format!("\n{note}\n");
    }
    text + &summing_up(&sums(comparison, results))
}

/// Returns the lines and their results as CSV, headed by the command that made them.
pub fn beside_csv(comparison: &Comparison, results: &[Result<Found, Error>], command: &str) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut csv = format!("# {command}\ngroup,what,published,emulated,reason\n");
    for (line, result) in comparison.lines.iter().zip(results) {
        let (found, reason) = match result {
            Ok(found) => (found.text.as_str(), String::new()),
            Err(reason) => ("", reason.to_string()),
        };
        let fields = [line.group, &line.what, line.published, found, &reason].map(quoted);
        csv += &format!("{}\n", fields.join(","));
    }
    csv
}
