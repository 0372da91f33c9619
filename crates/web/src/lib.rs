//! The explorer's engine: scenes, runs, closer looks, cells of stability maps and waveforms, for a page in a browser.
//!
//! [`answer`] takes a request as JSON and returns an [`Answer`]: a result as JSON, with columns of numbers or a file
//! beside it, or a [`Refusal`] with the messages of the command. `abi` is the interface of the WebAssembly module
//! around it. The page is in `crates/web/page`.
//!
//! | `do` | beside `scene` and `set` | result |
//! |---|---|---|
//! | `scenes` | nothing, without a scene | names and titles of the shipped scenes |
//! | `keys` | | every key of the scene: value, source, unit, accepted values, meaning |
//! | `run` | `nets`, `ripple` | verdict, contact, energies, use of each net; columns of the trace |
//! | `look` | `from_s`, `to_s`, `rows`, `nets` | columns of a part of the run, as fine as single clock cycles |
//! | `map` | `x`, `y` | the axes of a stability map |
//! | `cell` | `x`, `y`, `cell` | the outcome of a cell of that map |
//! | `plan` | `columns`, `rows`, `classes`, without a scene | the cells to run next; inferred cells |
//! | `wave` | `format` | the bytes of a waveform of the run, `fst` or `vcd` |
//! | `hash` | | SHA-256 of verdict, encoder edges, energies and net statistics of the run |
//!
//! `scene` is the name of a shipped scene, or an object with `name`, `text` and `files`, the texts of its data files.
//! `set` is a list of texts `KEY=VALUE`, as `hpu run --set` takes them.
//!
//! The page asks a worker for a run at each change, and draws outcome and motion; beside it another worker runs the
//! scene with the ripple of its torque, in as many rows as a picture has room for. A worker is ended where a run is
//! cancelled. WebAssembly has neither a clock nor threads: the stopwatch of runs then reads 0, and no cell of a map is
//! guarded by wall time.

mod abi;
mod columns;
mod hash;
mod keys;
mod map;
mod request;
mod run;
mod scenes;
mod wave;

use serde_json::Value;

pub use columns::Column;
pub use request::Refusal;

use request::Request;

/// A result: JSON, columns of numbers that the JSON describes in the same order, and the bytes of a file.
#[derive(Debug, Default)]
pub struct Answer {
    /// The result.
    pub json: Value,
    /// The columns of a trace.
    pub columns: Vec<Column>,
    /// A waveform.
    pub file: Vec<u8>,
}

impl From<Value> for Answer {
    fn from(json: Value) -> Self {
        Self { json, ..Self::default() }
    }
}

/// Answers a request.
///
/// # Errors
///
/// A [`Refusal`] when the request is not understood, the scene or an override is refused, or the run cannot be made.
pub fn answer(request: &str) -> Result<Answer, Refusal> {
    let request = Request::read(request)?;
    match request.verb() {
        "scenes" => scenes::list().map(Answer::from),
        "keys" => keys::keys(&request).map(Answer::from),
        "run" => run::run(&request),
        "look" => run::look(&request),
        "map" => map::map(&request).map(Answer::from),
        "cell" => map::cell(&request).map(Answer::from),
        "plan" => map::plan(&request).map(Answer::from),
        "wave" => wave::wave(&request),
        "hash" => hash::hash(&request).map(Answer::from),
        other => Err(Refusal::from(format!("no request `{other}`"))),
    }
}
