//! A run as JUnit tests.

use hpu_cosim::{AnySimulation, Simulation};
use hpu_rtl::{Case, junit_suite};
use hpu_study::map::outcome_name;

use crate::run::simulate::Ran;

/// Returns the scene's expectations and comparisons as tests. The first test is that the run came to its end.
pub fn report(ran: &Ran) -> String {
    junit_suite("hpu run", &cases(ran))
}

fn cases(ran: &Ran) -> Vec<Case> {
    let case = |name: &str, seconds: f64, failure: Option<String>| Case {
        class: ran.simulation.name().to_string(),
        name: name.to_string(),
        seconds,
        failure,
    };
    let ended = ran.summary.aborted.map(|abort| format!("at {:e} s: {}", abort.at_s, abort.why));
    let mut cases = vec![case("run", ran.summary.wall_s, ended)];
    if let AnySimulation::Dut(_) = ran.simulation {
        let heard = &ran.summary.heard;
        let said = || hpu_page::heard::heard(heard, ran.simulation.clock()).text();
        cases.push(case("assertions", 0.0, (heard.failed() > 0).then(said)));
    }
    cases.extend(ran.outcome_met.map(|(kind, met)| {
        let found = ran.summary.outcome().map_or("none", |found| outcome_name(Some(found)));
        let why = format!("expected {}, found {found}", outcome_name(Some(kind)));
        case("outcome", 0.0, (!met).then_some(why))
    }));
    cases.extend(ran.numbers.iter().map(|(expected, got, met)| {
        let (value, tolerance) = (expected.value, expected.tolerance);
        let found = got.map_or("nothing".to_string(), |got| got.to_string());
        let why = format!("expected {value} within {tolerance}, found {found}");
        case(expected.metric.name(), 0.0, (!met).then_some(why))
    }));
    cases.extend(
        ran.log
            .as_ref()
            .filter(|held| held.is_judged())
            .map(|held| case("recording", 0.0, (!held.ok()).then(|| held.page().text()))),
    );
    cases.extend(ran.held.as_ref().map(|held| {
        let said = held.page(ran.simulation.clock().period_s()).text();
        case("compare", 0.0, (!held.ok()).then_some(said))
    }));
    cases.extend(ran.rtl.as_ref().map(|(row, _)| {
        let why = row.failure.clone().or(row.first.as_ref().map(ToString::to_string));
        case("rtl", row.seconds, (!row.ok()).then(|| why.unwrap_or_default()))
    }));
    cases
}
