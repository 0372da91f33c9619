//! The keys of a scene, from which the page makes its controls.

use hpu_cosim::scene::keys::{Sizes, Takes};
use hpu_cosim::scene::{Experiment, Loop, Resolved, ValueSource, resolved};
use hpu_page::as_json;
use hpu_study::map::Method;
use serde_json::{Value, json};

use crate::request::{Refusal, Request};

/// Returns the name of the scene, its prose, every key with its value, and the methods that its device can run.
pub(crate) fn keys(request: &Request) -> Result<Value, Refusal> {
    let source = request.source()?;
    let experiment = source.parse()?;
    let (name, text) = source.named();
    let all = resolved(&experiment, name, text, &source.set)?;
    let keys: Vec<_> = all.iter().map(told).collect();
    let methods = methods(&experiment);
    Ok(json!({ "name": experiment.name, "about": experiment.about.trim(), "keys": keys, "methods": methods }))
}

/// Returns the methods, each with the overrides that turn the scene into one of the method; none for a scene that has
/// keys which other methods refuse.
fn methods(experiment: &Experiment) -> Vec<Value> {
    let Experiment::Axis(scene) = experiment else { return Vec::new() };
    if matches!(scene.method.kind, Loop::Law(_)) {
        return Vec::new();
    }
    let told = |Method { label, set }: Method| {
        let set: Vec<_> = set.iter().map(|(key, value)| format!("{key}={value}")).collect();
        json!({ "label": label, "set": set })
    };
    Method::all(scene).into_iter().map(told).collect()
}

fn told(key: &Resolved) -> Value {
    let path = if key.section.is_empty() { key.key.clone() } else { format!("{}.{}", key.section, key.key) };
    json!({
        "key": path,
        "section": key.section,
        "toml": key.toml,
        "value": as_json(&key.value),
        "unit": key.unit,
        "source": key.source.to_string(),
        "given": matches!(key.source, ValueSource::Given(_)),
        "meaning": key.meaning,
        "takes": takes(key),
    })
}

/// Returns the form of the values that a key accepts, with their range. A quantity whose dimension depends on the
/// device has the sizes of the key's own unit.
fn takes(key: &Resolved) -> Value {
    let words = |kind: &str| json!({ "kind": kind });
    match &key.takes {
        Takes::Quantity(sizes) => {
            let own = sizes.iter().find(|size| size.unit == key.unit).or(sizes.first());
            own.map_or(words("text"), |Sizes { unit, zero, least, most, .. }| {
                json!({ "kind": "quantity", "unit": unit, "zero": zero, "least": least, "most": most })
            })
        }
        Takes::Whole { least, most, unit } => json!({ "kind": "whole", "least": least, "most": most, "unit": unit }),
        Takes::Format => words("format"),
        Takes::Choice(names) => json!({ "kind": "choice", "options": names }),
        Takes::Flag => words("flag"),
        Takes::Text(_) | Takes::Names(_) | Takes::Section | Takes::Expected(_) | Takes::Own(..) => words("text"),
    }
}
