//! Makes a JSON Schema of scenes from the rows of their keys. Editors show the meanings, and refuse the values that a
//! scene would refuse.
//!
//! The schema checks a quantity if it is a number. A text with a unit is checked by hpu.

use hpu_cosim::scene::KINDS;
use hpu_cosim::scene::keys::{
    FOC, FOLLOWS, KeyRow, Otherwise, PADDLE, Shape, Sizes, Takes, has_own_kind, is_any_name, kinds_of, rows,
};
use hpu_page::as_json;
use serde_json::{Map, Value, json};

/// The kind of a scene and the kind of its device, as rows call them.
#[derive(Clone, Copy)]
struct Of {
    scene: &'static str,
    device: &'static str,
}

/// Returns the schema.
pub fn schema() -> Value {
    let of_kind = |(scene, device, follows): (&'static str, &'static str, bool)| {
        let of = Of { scene, device };
        let device = json!({ "properties": { "kind": { "const": of.device } }, "required": ["kind"] });
        let mut case = json!({ "properties": { "device": device }, "required": ["device"] });
        match of.scene {
            "axis" => {
                let method = json!({ "properties": { "kind": { "enum": FOLLOWS } }, "required": ["kind"] });
                let target = json!({ "properties": { "method": method }, "required": ["method"] });
                let own = if follows { target } else { json!({ "not": target }) };
                case["allOf"] = json!([{ "not": { "required": ["dut"] } }, { "not": of_paddle() }, own]);
            }
            PADDLE => case["allOf"] = json!([of_paddle()]),
            FOC => case["allOf"] = json!([{ "not": { "required": ["dut"] } }]),
            "dut" => case["required"] = json!(["device", "dut"]),
            _ => {}
        }
        let method = follows.then_some(FOLLOWS[0]);
        json!({ "if": case, "then": object(of, "", &kinds_of("", of.scene, of.device, method)) })
    };
    let both = |&(scene, device): &(&'static str, &'static str)| {
        let follows = if scene == "axis" { &[false, true][..] } else { &[false] };
        follows.iter().map(move |follows| (scene, device, *follows))
    };
    let cases = KINDS.iter().flat_map(both).map(of_kind).collect::<Vec<_>>();
    let kinds =
        options(&rows().find(|row| (row.section, row.key) == ("device", "kind")).expect("every device has a kind"));
    let device = json!({ "type": "object", "properties": { "kind": kinds }, "required": ["kind"] });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A scene of hpu",
        "type": "object",
        "properties": { "device": device },
        "required": ["device"],
        "allOf": cases,
    })
}

/// Returns the schema of a scene that a paddle's firmware controls, whatever else it has.
fn of_paddle() -> Value {
    let method = json!({ "properties": { "kind": { "const": PADDLE } }, "required": ["kind"] });
    json!({ "properties": { "method": method }, "required": ["method"] })
}

/// Returns the rows of a section that these kinds take.
fn taken<'a>(section: &'a str, kinds: &'a [&'a str]) -> impl Iterator<Item = KeyRow> + 'a {
    let takes = |row: &KeyRow| row.kinds.is_empty() || row.kinds.iter().any(|kind| kinds.contains(kind));
    rows().filter(move |row| row.section == section && takes(row))
}

/// Returns the schema of a section. If its own `kind` decides which keys it takes, there is a case for each kind.
fn section(of: Of, name: &str) -> Value {
    let kinds = &kinds_of(name, of.scene, of.device, None);
    let is_of = |row: &KeyRow| {
        name != "method" || [PADDLE, FOC].iter().all(|own| row.kinds.contains(own) == (of.scene == *own))
    };
    let kind = rows().find(|row| (row.section, row.key) == (name, "kind") && is_of(row));
    let Some(kind) = kind.filter(|_| has_own_kind(name, of.scene)) else { return object(of, name, kinds) };
    let Takes::Choice(names) = &kind.takes else { return object(of, name, kinds) };
    let cases: Vec<_> = names
        .iter()
        .map(|option| {
            let is = json!({ "properties": { "kind": { "const": option } }, "required": ["kind"] });
            json!({ "if": is, "then": object(of, name, &kinds_of(name, of.scene, of.device, Some(option))) })
        })
        .collect();
    json!({ "type": "object", "properties": { "kind": options(&kind) }, "required": ["kind"], "allOf": cases })
}

/// Returns the schema of a section with these keys and no others.
fn object(of: Of, name: &str, kinds: &[&str]) -> Value {
    let (mut properties, mut others, mut required) = (Map::new(), json!(false), Vec::new());
    for row in taken(name, kinds) {
        let value = described(of, &row);
        if is_any_name(row.key) {
            others = value;
            continue;
        }
        if row.otherwise == Otherwise::Required {
            required.push(row.key);
        }
        properties.insert(row.key.to_string(), value);
    }
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": others })
}

/// Returns the schema of a key's values, with the texts that an editor shows.
fn described(of: Of, row: &KeyRow) -> Value {
    let mut value = accepted(of, row);
    value["description"] =
        json!(format!("{} Default: {}.", row.meaning, row.default()).replace("Default: required", "Required"));
    if let Otherwise::Is(is) = &row.otherwise {
        value["default"] = as_json(is);
    }
    value
}

fn accepted(of: Of, row: &KeyRow) -> Value {
    // Each body of a network turns or slides.
    let sizes = |all: &[Sizes]| match of.device {
        "network" if all.len() > 1 => json!({ "anyOf": all.iter().map(|one| quantity(Some(one))).collect::<Vec<_>>() }),
        "mass" => quantity(all.last()),
        _ => quantity(all.first()),
    };
    match &row.takes {
        Takes::Quantity(all) => sizes(all),
        Takes::Expected(all) => {
            let number = sizes(all);
            json!({
                "type": "object",
                "properties": { "value": number, "tolerance": number },
                "required": ["value", "tolerance"],
                "additionalProperties": false,
            })
        }
        Takes::Whole { least, most, .. } => json!({ "type": "integer", "minimum": least, "maximum": most }),
        Takes::Format | Takes::Text(_) => json!({ "type": "string" }),
        Takes::Choice(_) => options(row),
        Takes::Flag => json!({ "type": "boolean" }),
        Takes::Names(names) => json!({ "type": "array", "items": { "enum": names } }),
        Takes::Section => {
            let below =
                if row.section.is_empty() { row.key.to_string() } else { format!("{}.{}", row.section, row.key) };
            match below.as_str() {
                "model" => {
                    json!({ "if": { "type": "object" }, "then": section(of, &below), "else": { "enum": ["auto"] } })
                }
                _ => section(of, &below),
            }
        }
        Takes::Own(Shape::List, _) => json!({ "type": "array" }),
        Takes::Own(Shape::NumberOrList, _) => json!({ "type": ["integer", "array"] }),
        Takes::Own(Shape::Scalar, _) => json!({ "type": ["number", "boolean", "string"] }),
        Takes::Own(Shape::File, _) => {
            json!({ "anyOf": [{ "type": "string" }, object(of, "hand.file", row.kinds)] })
        }
        Takes::Own(Shape::Connection, _) => {
            let plain = json!({ "type": ["integer", "boolean", "string", "array"] });
            json!({ "anyOf": [plain, object(of, "dut.ports.PORT", &[])] })
        }
    }
}

/// Returns the names of a choice; a name of digits may be written without quotes.
fn options(row: &KeyRow) -> Value {
    let Takes::Choice(names) = &row.takes else { return json!(true) };
    let numbers = names.iter().filter_map(|name| name.parse::<u64>().ok()).map(Value::from);
    json!({ "enum": names.iter().map(|name| json!(name)).chain(numbers).collect::<Vec<_>>() })
}

/// Returns the schema of a number within the sizes, or a text with a unit.
fn quantity(sizes: Option<&Sizes>) -> Value {
    let Some(sizes) = sizes else { return json!({ "type": ["number", "string"] }) };
    // The bounds apply to numbers only; a text with a unit passes them.
    let number = json!({ "type": ["number", "string"], "minimum": sizes.least, "maximum": sizes.most });
    if sizes.zero && sizes.least > 0.0 { json!({ "anyOf": [{ "enum": [0] }, number] }) } else { number }
}
