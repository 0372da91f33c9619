//! A map as rows of JSON, CSV and Parquet.

use std::io::{self, Write};
use std::num::NonZeroU32;

#[cfg(not(target_family = "wasm"))]
use parquet::errors::ParquetError;

use super::{Cell, Displayed, Found, Map, Switching, is_late, outcome, outcome_name, told_for_ever};
#[cfg(not(target_family = "wasm"))]
use hpu_farm::Schema;
use hpu_page::{Column, Field, Place, Value, write_csv};

/// Returns units and meanings as keys and values, for the heads of the files.
pub fn units_of(map: &Map) -> Vec<(String, String)> {
    let middle = map.point(map.layer() / 2);
    let (position, stiffness) = match map.experiment(middle) {
        Ok(experiment) => (experiment.setup().units().position, experiment.setup().units().stiffness),
        Err(_) => ("as the device's positions", "as the device's stiffnesses"),
    };
    let axis = |axis: &super::Axis| {
        let unit = map.unit(axis);
        if unit.is_empty() { axis.key().to_string() } else { format!("{} in {unit}", axis.key()) }
    };
    let pairs = [
        ("x", axis(&map.x)),
        ("y", axis(&map.y)),
        ("run", "1 for a cell that was run, 0 for one whose outcome is inferred from the cells around it".into()),
        ("rms", format!("{position}, about the mean of the judged window")),
        ("amplitude", format!("{position}, half of the range")),
        ("frequency_hz", "Hz".into()),
        ("hand_j", "J that the hand gave".into()),
        ("source_j", "J that the supply gave".into()),
        ("dissipated_j", "J that became heat".into()),
        (
            "displayed_stiffness",
            format!("{stiffness}, mean of what pushes back over mean penetration in a settled contact"),
        ),
        ("displayed_ratio", "displayed_stiffness over the stiffness asked for".into()),
        ("contact_share", "of the judged window, in which the wall sees penetration; 0: not reached".into()),
        ("device_contact_share", "of the same window, in which the device itself is beyond the wall".into()),
        (
            "product_wraps",
            "how often the spring's product has wrapped at rest in the wall: the hand is through it".into(),
        ),
        (
            "contact_unseen",
            "1 where the device was past its wall while the datapath saw no contact: its position counter wrapped"
                .into(),
        ),
        (
            "position_lost_share",
            "of the edges, at which the position counter had wrapped under the device: the loop read another place"
                .into(),
        ),
        ("stiffness_error", "stiffness that the words realise over what is asked for, less 1".into()),
        ("overflow_share", "of the edges, at which the net that overflowed most had overflowed".into()),
        ("switches", "how often the control of a crank switched".into()),
        ("bump_n", "N, the greatest leap of the crank's drive at a switch, at the tip of a segment that rests".into()),
        ("switch_j", "J that the crank's drive gave per switch in the judged window".into()),
        ("edges", "clock edges".into()),
        ("telling_duration_s", "s, the run.duration that would tell, where this one does not and one is known".into()),
        ("replay", "the command that runs the cell again".into()),
    ];
    pairs.map(|(key, value)| (key.to_string(), value)).into()
}

fn switching(cell: &Cell) -> Option<&Switching> {
    cell.switching.as_deref()
}

/// Returns the columns, with the function that takes a cell's value out of the cell of an index. Figures are missing
/// where they have no meaning, and in cells that were not run. `replay` returns the command of a cell.
pub fn fields<'a>(map: &'a Map, found: &'a [Found], replay: impl Fn(usize) -> String + 'a) -> Vec<Field<'a, usize>> {
    let of = |column: Column, value: fn(&Cell) -> Value| {
        column.of(move |index: &usize| match &found[*index] {
            Found::Run(Ok(cell)) => value(cell),
            _ => Value::Absent,
        })
    };
    let figure = |key: &str, value| of(Column::number(key, ""), value);
    let (in_file, in_json) = ([Place::File], [Place::Json]);
    let was_run = move |index: &usize| matches!(found[*index], Found::Run(_));
    let for_ever = told_for_ever(found).then(|| {
        of(Column::text("for_ever", ""), |cell| cell.for_ever.map_or(Value::Absent, |of| Value::from(of.name())))
    });
    let mut fields = vec![
        Column::text("method", "").of(move |index| &map.methods[map.point(*index).method].label),
        Column::integer("ix", "").of(move |index| map.point(*index).ix),
        Column::integer("iy", "").of(move |index| map.point(*index).iy),
        Column::number("x", "").only(&in_file).of(move |index| map.x.values()[map.point(*index).ix]),
        Column::number("y", "").only(&in_file).of(move |index| map.y.values()[map.point(*index).iy]),
        Column::text("outcome", "")
            .of(move |index| if is_late(found, *index) { "not_run" } else { outcome_name(outcome(found, *index)) }),
        Column::flag("run", "").only(&in_json).of(was_run),
        Column::integer("run", "").only(&in_file).of(move |index| i32::from(was_run(index))),
        figure("rms", |cell| cell.rms.into()),
        figure("amplitude", |cell| cell.amplitude.into()),
        figure("frequency_hz", |cell| cell.frequency_hz.into()),
        figure("hand_j", |cell| cell.hand_j.into()),
        figure("source_j", |cell| cell.source_j.into()),
        figure("dissipated_j", |cell| cell.dissipated_j.into()),
        figure("displayed_stiffness", |cell| cell.displayed.map(|displayed| displayed.stiffness).into()),
        figure("displayed_ratio", |cell| cell.displayed.and_then(Displayed::ratio).into()),
        figure("contact_share", |cell| cell.contact_share.into()),
        figure("device_contact_share", |cell| cell.device_contact_share.into()),
        of(Column::integer("product_wraps", ""), |cell| cell.product_wraps.map(NonZeroU32::get).into()),
        of(Column::flag("contact_unseen", "").only(&in_json), |cell| cell.contact_unseen.into()),
        of(Column::number("contact_unseen", "").only(&in_file), |cell| f64::from(u8::from(cell.contact_unseen)).into()),
        figure("position_lost_share", |cell| cell.position_lost_share.into()),
        figure("stiffness_error", |cell| cell.stiffness_error.into()),
        figure("overflow_share", |cell| cell.overflow_share.into()),
        of(Column::integer("switches", ""), |cell| switching(cell).map(|of| of.count).into()),
        figure("bump_n", |cell| switching(cell).map(|of| of.bump_n).into()),
        figure("switch_j", |cell| switching(cell).and_then(|of| of.switch_j).into()),
        of(Column::integer("edges", ""), |cell| cell.edges.into()),
        figure("telling_duration_s", |cell| cell.telling_s.into()),
        Column::text("reason", "").of(move |index| match &found[*index] {
            Found::Run(Err(reason)) => Value::from(reason.to_string()),
            _ => Value::Absent,
        }),
        Column::text("replay", "").only(&in_file).of(move |index| replay(*index)),
    ];
    fields.extend(for_ever);
    fields
}

/// Writes the map as CSV. Lines that begin with `#` hold the command that made it, and the units. `replay` returns the
/// command of each cell.
///
/// # Errors
///
/// Returns the writer's error.
pub fn csv(
    out: impl Write,
    map: &Map,
    found: &[Found],
    command: &str,
    replay: impl Fn(usize) -> String,
) -> io::Result<()> {
    let units = units_of(map).into_iter().map(|(key, value)| format!("{key}: {value}"));
    let mut fields = fields(map, found, replay);
    // The places of a map are written as the command line has them, without a power of ten.
    fields[3] = Column::text("x", "").of(|index: &usize| map.x.values()[map.point(*index).ix].to_string());
    fields[4] = Column::text("y", "").of(|index: &usize| map.y.values()[map.point(*index).iy].to_string());
    write_csv(out, [command.to_string()].into_iter().chain(units), &fields, 0..found.len())
}

/// Writes the map as Parquet, with the same columns; units and command are in the file's metadata.
///
/// # Errors
///
/// Returns the writer's error.
#[cfg(not(target_family = "wasm"))]
pub fn parquet(
    out: impl Write + Send,
    map: &Map,
    found: &[Found],
    command: &str,
    replay: impl Fn(usize) -> String,
) -> Result<(), ParquetError> {
    let metadata = [("command".to_string(), command.to_string())].into_iter().chain(units_of(map));
    hpu_page::write_parquet(out, "map", metadata, &fields(map, found, replay), 0..found.len())
}

/// Returns the columns of a sweep over the map: method and values of the axes, then the fields of a cell's line.
#[cfg(not(target_family = "wasm"))]
pub fn schema(map: &Map) -> Schema {
    let place = vec![Column::text("method", ""), Column::number(map.x.key(), ""), Column::number(map.y.key(), "")];
    let fields = vec![
        Column::text("outcome", ""),
        Column::number("rms", ""),
        Column::number("amplitude", ""),
        Column::number("frequency_hz", ""),
        Column::number("hand_j", ""),
        Column::number("source_j", ""),
        Column::number("dissipated_j", ""),
        Column::number("displayed_stiffness", ""),
        Column::number("asked_stiffness", ""),
        Column::number("contact_share", ""),
        Column::number("device_contact_share", ""),
        Column::integer("product_wraps", ""),
        Column::integer("contact_unseen", ""),
        Column::number("position_lost_share", ""),
        Column::number("stiffness_error", ""),
        Column::number("overflow_share", ""),
        Column::integer("switches", ""),
        Column::number("bump_n", ""),
        Column::number("switch_j", ""),
        Column::integer("edges", ""),
        Column::number("telling_duration_s", ""),
    ];
    Schema::new(place, fields)
}

/// Returns units and meanings of a sweep's columns, as keys and values.
#[cfg(not(target_family = "wasm"))]
pub fn meanings(map: &Map) -> Vec<(String, String)> {
    let axis = |axis: &super::Axis| (axis.key().to_string(), map.unit(axis).to_string());
    let stiffness = match map.experiment(map.point(map.layer() / 2)) {
        Ok(experiment) => experiment.setup().units().stiffness,
        Err(_) => "as the device's stiffnesses",
    };
    let asked = ("asked_stiffness".to_string(), format!("{stiffness}, the stiffness asked for"));
    let apart = ["x", "y", "run", "displayed_ratio", "replay"];
    let own = units_of(map).into_iter().filter(|(key, _)| !apart.contains(&key.as_str()));
    [axis(&map.x), axis(&map.y)].into_iter().chain(own).chain([asked]).collect()
}

/// Returns the place of a cell as values for the columns of a sweep.
#[cfg(not(target_family = "wasm"))]
pub fn place(map: &Map, index: usize) -> Vec<Value> {
    let point = map.point(index);
    let value = |axis: &super::Axis, at: usize| Value::Number(axis.values()[at]);
    vec![Value::from(&map.methods[point.method].label), value(&map.x, point.ix), value(&map.y, point.iy)]
}
