//! Runs solvers of SMT-LIB in a race.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use super::query::Query;
use crate::engines::error::Error;
use crate::engines::temporary::Temporary;
use crate::engines::tool::{Fault, Said, Tool, ToolError, run_unless};

/// The solvers in the race, and the delay after which each begins. Yices starts fastest and answers most questions
/// before the second one begins; each of the others decides some that Yices does not.
const SOLVERS: [(Tool, Duration); 3] = [
    (Tool::Yices, Duration::ZERO),
    (Tool::Z3, Duration::from_millis(50)),
    (Tool::Bitwuzla, Duration::from_millis(500)),
];
/// The interval at which a solver that begins later checks for an answer by another one.
const TICK: Duration = Duration::from_millis(5);

/// The answer of a solver.
pub(super) enum Answer {
    Unsatisfiable,
    /// The words of a counterexample, by name.
    Satisfiable(HashMap<String, u128>),
    Unknown(String),
}

/// Checks that all solvers are there. Solvers that were there once are not asked again by this process.
pub(super) fn known(limit: Option<Duration>) -> Result<(), ToolError> {
    static FOUND: AtomicBool = AtomicBool::new(false);
    if !FOUND.load(Ordering::Relaxed) {
        SOLVERS.iter().try_for_each(|(solver, _)| solver.version(limit).map(drop))?;
        FOUND.store(true, Ordering::Relaxed);
    }
    Ok(())
}

/// Returns whether the premises of a question can hold: whether there is a state with such inputs.
pub(super) fn is_possible(query: &Query, limit: Duration) -> Result<bool, Error> {
    let (answer, _) = raced(&format!("{}(check-sat)\n", query.given), limit)?;
    Ok(matches!(answer, Answer::Satisfiable(_)))
}

/// Returns the first answer to a question, and the solver that gave it.
pub(super) fn race(query: &Query, limit: Duration) -> Result<(Answer, &'static str), Error> {
    let Query { given, differs, .. } = query;
    let names: Vec<_> = query.names().collect();
    let shown = if names.is_empty() { String::new() } else { format!("(get-value ({}))\n", names.join(" ")) };
    raced(&format!("{given}(assert (or false{differs}))\n(check-sat)\n{shown}"), limit)
}

/// Returns the first answer to a text; the other solvers are stopped.
fn raced(text: &str, limit: Duration) -> Result<(Answer, &'static str), Error> {
    let io = |error| ToolError::new(Tool::Z3, "be asked", Fault::NotStarted(error), "");
    let folder = Temporary::folder().map_err(io)?;
    let path = folder.path().join("query.smt2");
    std::fs::write(&path, text).map_err(io)?;
    let is_answered = AtomicBool::new(false);
    let (send, answers) = mpsc::channel();
    thread::scope(|scope| {
        for (solver, later) in SOLVERS {
            let (send, path, is_answered) = (send.clone(), &path, &is_answered);
            scope.spawn(move || {
                let begin = Instant::now();
                while begin.elapsed() < later && !is_answered.load(Ordering::Relaxed) {
                    thread::sleep(TICK);
                }
                if is_answered.load(Ordering::Relaxed) {
                    return;
                }
                let mut command = solver.command();
                command.arg(path).current_dir(path.parent().unwrap_or(path));
                let said = run_unless(is_answered, solver, "decide a query", command, limit);
                // The receiver is gone only after the first answer, which suffices.
                let _ = send.send((solver, answer(solver, said)));
            });
        }
        drop(send);
        let mut unknown = Vec::new();
        let mut first = None;
        for (solver, answer) in answers {
            match answer {
                Ok(Answer::Unknown(why)) => unknown.push(format!("{}: {why}", solver.name())),
                answer => {
                    is_answered.store(true, Ordering::Relaxed);
                    first = Some((answer?, solver.name()));
                    break;
                }
            }
        }
        unknown.sort();
        Ok(first.unwrap_or_else(|| (Answer::Unknown(unknown.join("; ")), "")))
    })
}

fn answer(solver: Tool, said: Result<Said, ToolError>) -> Result<Answer, ToolError> {
    let said = match said {
        Ok(said) => said,
        // `get-value` after `unsat` is an error, which the exit code reports.
        Err(ToolError { fault: Fault::Failed(_), said, .. }) if said.lines().any(|line| line.trim() == "unsat") => {
            return Ok(Answer::Unsatisfiable);
        }
        Err(ToolError { fault: Fault::Failed(_), said, .. }) => return Ok(Answer::Unknown(said.trim().to_string())),
        Err(ToolError { fault: Fault::TooLong(limit), .. }) => {
            return Ok(Answer::Unknown(format!("no answer within {} s", limit.as_secs_f64())));
        }
        Err(error) => return Err(error),
    };
    let (head, model) = said.out.split_once('\n').unwrap_or((&said.out, ""));
    match head.trim() {
        "unsat" => Ok(Answer::Unsatisfiable),
        "sat" => Ok(Answer::Satisfiable(words(model))),
        "unknown" => Ok(Answer::Unknown("unknown".to_string())),
        _ => Err(ToolError::new(solver, "decide a query", Fault::Silent("verdict"), &said.all())),
    }
}

/// Reads the words of a model, `((|input a| #b0101) (|input b| #xff))`.
fn words(model: &str) -> HashMap<String, u128> {
    let mut words = HashMap::new();
    let mut rest = model;
    while let Some((_, after)) = rest.split_once('|') {
        let Some((name, after)) = after.split_once('|') else { break };
        rest = after;
        let value = after.trim_start();
        let digits = |radix: u32| {
            let end = value[2..].find(|c: char| !c.is_digit(radix)).map_or(value.len(), |end| end + 2);
            u128::from_str_radix(&value[2..end], radix).ok()
        };
        let word = match value.get(..2) {
            Some("#b") => digits(2),
            Some("#x") => digits(16),
            _ => None,
        };
        if let Some(word) = word {
            words.insert(format!("|{name}|"), word);
        }
    }
    words
}
