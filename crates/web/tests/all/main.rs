//! All tests of the crate in one binary, which is linked once and runs its tests on all cores.

mod maps;
mod module;
mod refusals;
mod runs;

use hpu_web::{Answer, Refusal, answer};
use serde_json::Value;

/// Asks for something that is there.
fn ask(request: &Value) -> Answer {
    answer(&request.to_string()).unwrap_or_else(|refusal| panic!("{request}: {}", refusal.json()))
}

/// Asks for something that is refused.
fn refused(request: &Value) -> Refusal {
    answer(&request.to_string()).map(|answer| answer.json).expect_err("a refusal")
}
