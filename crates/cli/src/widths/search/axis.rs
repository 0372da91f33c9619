//! The page of a search over the widths of an axis.

use std::collections::BTreeMap;

use hpu_chart::{Picture, error_by_width, stiffness_by_cost};
use hpu_cosim::figure;
use hpu_cosim::scene::{Experiment, Loop};
use hpu_datapath::{AnyBlock, haptic_wiring};
use hpu_page::{Cell, Column, Table};
use hpu_rtl::Counts;
use hpu_study::fit::percent;
use hpu_study::map::outcome_name;
use hpu_study::widths::Field;
use hpu_study::widths::search::{Design, Line, RatedDesign};
use serde_json::{Value, json};

use super::Searched;
use super::device::Device;
use super::shown::{Shown, cut, in_text};
use crate::shell::Failure;

pub struct Axis;

impl Device for Axis {
    fn shown<'s>(&self, searched: &'s Searched) -> Shown<'s> {
        shown(searched)
    }

    fn files(&self, searched: &Searched) -> Option<(String, [Picture; 2])> {
        let Searched { found, command, scene, lose, .. } = searched;
        let pictures = [error_by_width(scene, found, command), stiffness_by_cost(scene, found, *lose, command)];
        Some((errors(searched), pictures))
    }

    fn block(&self, scene: Experiment) -> Result<Box<dyn AnyBlock>, Failure> {
        let scene = scene.axis().ok_or_else(|| Failure::file("only an axis has a loop of these widths"))?;
        let config = scene.words().map_err(Failure::file)?.config;
        Ok(haptic_wiring(config, scene.method.kind == Loop::Conventional).map_err(Failure::file)?)
    }
}

fn shown(searched: &Searched) -> Shown<'_> {
    let found = &searched.found;
    let text = |head, least, shown: fn(&Design) -> String| {
        in_text(head, least).of(move |point: &RatedDesign| shown(&point.design))
    };
    let counted = |counts: Counts| json!({ "lut4": counts.lut4, "ff": counts.ff, "carry": counts.carry });
    let mut fields = vec![
        text("position", 8, |design| design.get(Field::POSITION).to_string()),
        text("stiffness", 10, stiffness),
        text("damping", 10, damping),
        text("velocity", 8, |design| design.get(Field::VELOCITY).to_string()),
        text("pwm", 4, |design| design.get(Field::PWM).to_string()),
        Column::text("set", "")
            .in_json()
            .of(|point: &RatedDesign| hpu_page::Value::of(point.design.set().into_iter().collect::<BTreeMap<_, _>>())),
    ];
    fields.extend(found.reference.design.widths().map(|(key, _)| {
        Column::text(&key.name.replace('.', "_"), "")
            .in_files()
            .of(move |point: &RatedDesign| point.design.get(key.field))
    }));
    fields.extend([
        Column::integer("lut4_estimated", "LUT4").least(6).of(|point: &RatedDesign| point.merit.cost.lut4()),
        Column::text("counted", "").in_json().of(move |point| searched.price_of(point).map(counted)),
        in_text("counted", 8).of(|point| searched.price_of(point).map(|counts| counts.lut4)),
        Column::number("error", "error")
            .least(12)
            .of(|point: &RatedDesign| Cell::new(point.merit.error).shown(percent(point.merit.error))),
        Column::number("stable_stiffness", "stiffness").least(12).of(
            |RatedDesign { merit, capped, .. }: &RatedDesign| {
                Cell::new(merit.stiffness).shown(format!("{:.6}{}", merit.stiffness, if *capped { "+" } else { " " }))
            },
        ),
        Column::text("unit", "").in_files().of(|_| found.unit),
        Column::flag("capped", "").data().of(|point: &RatedDesign| point.capped),
        Column::text("command", "").in_json().of(|point| searched.replay(point)),
        Column::text("front", "")
            .in_files()
            .of(|point: &RatedDesign| found.front.iter().any(|&index| found.points[index] == *point)),
        Column::text("replay", "").in_files().of(|point| searched.replay(point)),
    ]);
    Shown {
        fields,
        designs: found.points.iter().collect(),
        reference: widths(&found.reference.design),
        lines: lines(searched),
        smallest: searched.smallest().map(|point| smallest(searched, point)),
        data: data(searched),
    }
}

fn stiffness(design: &Design) -> String {
    format!("(0,{},{})", design.get(Field::STIFFNESS_INT), design.get(Field::STIFFNESS_FRAC))
}

fn damping(design: &Design) -> String {
    format!("(0,{},{})", design.get(Field::DAMPING_INT), design.get(Field::DAMPING_FRAC))
}

fn widths(design: &Design) -> String {
    format!(
        "position {}, stiffness {}, damping {}, velocity {}, pwm {}",
        design.get(Field::POSITION),
        stiffness(design),
        damping(design),
        design.get(Field::VELOCITY),
        design.get(Field::PWM)
    )
}

/// Returns the lines on the conditions of the search.
fn lines(searched: &Searched) -> Vec<(&'static str, String)> {
    let found = &searched.found;
    let mut lines = Vec::new();
    for (index, on) in found.on.iter().enumerate() {
        let verdict = outcome_name(Some(on.outcome)).replace('_', " ");
        let warning = if on.touches { "" } else { "; wall not reached: the stable stiffness says nothing of it" };
        lines.push((if index == 0 { "run on" } else { "" }, format!("{}: {verdict}{warning}", cut(&on.scene, 96))));
    }
    for (index, said) in holds_for(searched).into_iter().enumerate() {
        lines.push((if index == 0 { "holds for" } else { "" }, said));
    }
    let outputs: Vec<_> = found.outputs().iter().map(|output| output.name()).collect();
    let (off, of) = (percent(searched.within), if found.on.len() > 1 { " on any of these" } else { "" });
    let counted = if searched.prices.is_some() { "; counted: by Yosys for the iCE40" } else { "" };
    let stiffest = "the stiffest wall that settles";
    lines.extend([
        ("error", format!("worst of {}{of} against the reference's, measured; at most {off}", outputs.join(", "))),
        ("stiffness", format!("{stiffest}, in {}, measured; `+`: the format holds no stiffer one", found.unit)),
        ("LUT4", format!("estimated, within {}{counted}", percent(found.estimate_error))),
    ]);
    lines
}

/// Returns the lines on the motions for which the designs are valid.
fn holds_for(searched: &Searched) -> Vec<String> {
    let found = &searched.found;
    let motions = match found.on.len() {
        1 => "error and stiffness: this motion of this scene alone (--also KEY=VALUE, and more SCENEs, add others)"
            .into(),
        scenes => format!("error and stiffness: the motions of these {scenes} scenes"),
    };
    if !searched.proved {
        let words =
            "words: what these motions put into them; another may saturate or wrap them (--proved excludes that)";
        return vec![motions, words.into()];
    }
    let words =
        "position and velocity: every motion within the device's limits, whose hands keep to their paths' ranges";
    let range = |(least, most): (i64, i64)| format!("{least}..{most}");
    let ranges = found.proved.iter().flatten().zip(&found.on).map(|(held, on)| {
        let (delta, velocity) = (range(held.delta), range(held.velocity));
        cut(&format!("  delta {delta}, velocity {velocity}, proved: {}", on.scene), 106)
    });
    [motions, words.into()].into_iter().chain(ranges).collect()
}

fn smallest(searched: &Searched, point: &RatedDesign) -> String {
    let Searched { found, lose, .. } = searched;
    let saved = |ours: u64, theirs: u64| {
        let saved = 1.0 - ours as f64 / theirs as f64;
        format!("{ours} LUT4 instead of {theirs}: {} saved ({})", theirs.saturating_sub(ours), percent(saved))
    };
    let reference = &found.reference.merit;
    let mut text = format!("smallest widths that keep the reference's stable stiffness within {}\n", percent(*lose));
    text += &format!("  {}\n", widths(&point.design));
    text += &format!(
        "  {}{} {} instead of {}: {:+.2} %, measured\n",
        figure(point.merit.stiffness),
        if point.capped { "+" } else { "" },
        found.unit,
        figure(reference.stiffness),
        100.0 * (point.merit.stiffness / reference.stiffness - 1.0)
    );
    text += &format!("  {}, estimated\n", saved(point.merit.cost.lut4().into(), reference.cost.lut4().into()));
    if let (Some((theirs, _)), Some(ours)) = (&searched.prices, searched.price_of(point)) {
        text +=
            &format!("  {}, counted; {} flip-flops instead of {}\n", saved(ours.lut4, theirs.lut4), ours.ff, theirs.ff);
    }
    text + &format!("  {}", searched.replay(point))
}

fn data(searched: &Searched) -> Vec<(&'static str, Value)> {
    let found = &searched.found;
    let scenes = found.on.iter().enumerate().map(|(index, on)| {
        let held = found.proved.as_ref().map(|proved| proved[index]);
        json!({
            "scene": on.scene,
            "outcome": outcome_name(Some(on.outcome)),
            "wall_reached": on.touches,
            "proved": held.map(|held| json!({ "delta": held.delta, "velocity": held.velocity })),
        })
    });
    let lines = found.lines.iter().map(|line| {
        let errors = line.errors.iter().map(|(bits, error)| {
            let other = error.is_some_and(f64::is_infinite);
            json!({ "bits": bits, "error": error.filter(|error| error.is_finite()), "other_verdict": other })
        });
        json!({ "width": line.key.name, "errors": errors.collect::<Vec<_>>() })
    });
    vec![
        ("scenes", scenes.collect()),
        ("proved", searched.proved.into()),
        ("kinds", Value::from(found.kinds)),
        ("errors_by_width", lines.collect()),
    ]
}

/// Returns the errors around the reference as CSV: empty where no scene can have the design, `inf` where the verdict
/// differs.
fn errors(searched: &Searched) -> String {
    type Row = (&'static str, i32, Option<f64>);
    let found = &searched.found;
    let of = |line: &Line| line.errors.iter().map(|(bits, error)| (line.key.name, *bits, *error)).collect::<Vec<_>>();
    let errors: Vec<Row> = found.lines.iter().flat_map(of).collect();
    let fields = [
        Column::text("width", "").of(|(width, ..): &Row| *width),
        Column::integer("bits", "").of(|(_, bits, _): &Row| *bits),
        Column::number("error", "").of(|(.., error): &Row| *error),
    ];
    Table::of("", &errors, fields).csv(&[&searched.command, &format!("reference: {}", found.reference.design)])
}
