//! The parameters of a run, each with the source of its value.

use hpu_cosim::scene::{Experiment, Miss, Origin, Parameter};
use hpu_page::{Cell, Column, Table, as_json};
use hpu_study::fit::Fit;
use serde_json::{Value, json};

use crate::units::error_percent;

/// A parameter and the source of its value.
pub struct Said {
    parameter: Parameter,
    by: String,
}

/// Returns every parameter of a run. The source of its value is the scene, the model that was chosen for the scene, or
/// `--edges` for a duration that it gave.
pub fn of(scene: &Experiment, fitted: Option<&Fit>, by_edges: bool) -> Vec<Said> {
    let chosen = |key: &str| fitted.is_some_and(|found| found.set.iter().any(|(set, _)| set == key));
    let said = scene.parameters.iter().map(|parameter| Said {
        by: match parameter.origin {
            Origin::Set if by_edges && parameter.key == "run.duration" => "--edges".to_string(),
            Origin::Set if chosen(&parameter.key) => "fit".to_string(),
            Origin::Set => "--set".to_string(),
            Origin::Scene => "scene".to_string(),
            Origin::Default => "default".to_string(),
            Origin::Part { kind, name } => format!("{kind} {name}"),
            Origin::Arm(name) => format!("model {name}"),
        },
        parameter: parameter.clone(),
    });
    said.collect()
}

/// Returns the parameters as a table, one a line.
pub fn table(all: &[Said]) -> Table {
    let fields = [
        Column::text("", "").least(10).said().of(|_: &Said| "parameter"),
        Column::text("key", "").least(28).of(|said: &Said| said.parameter.key.clone()),
        Column::text("value", "").least(34).of(|Said { parameter: Parameter { value, unit, .. }, .. }: &Said| {
            Cell::new(as_json(value)).shown(format!("{value} {unit}").trim_end())
        }),
        Column::text("unit", "").data().of(|said: &Said| said.parameter.unit),
        Column::text("source", "").of(|said: &Said| said.by.clone()),
    ];
    Table::of("parameters", all, fields).gap(1)
}

/// Returns the message that a stiffness word misses the stiffness, with the format that would hold it.
pub fn missed(Miss { error, format }: &Miss, key: Option<&str>) -> String {
    let remedy = match (format, key) {
        (Some(format), Some(key)) => format!("{key} = \"{format}\" holds it"),
        (Some(format), None) => format!("{format} would hold it"),
        (None, _) => "no format of 32 bits holds it".to_string(),
    };
    format!("stiffness misses what is asked for by {}; {remedy}", error_percent(*error))
}

/// Returns the message that a scene's stiffness word misses the stiffness, with the format that would hold it.
pub fn stiffness_missed(experiment: &Experiment) -> Option<String> {
    let setup = experiment.setup();
    setup.stiffness_miss().map(|miss| missed(&miss, setup.stiffness_format()))
}

/// Returns a miss as JSON.
pub(crate) fn missed_object(miss: &Miss) -> Value {
    json!({ "error": miss.error, "format": miss.format.map(|format| format.to_string()) })
}
