//! The page of a search over the widths of a PHANToM.

use std::collections::BTreeMap;

use hpu_cosim::scene::Experiment;
use hpu_page::{Cell, Column, Value};
use hpu_study::fit::percent;
use hpu_study::phantom::proved;
use hpu_study::widths::search::RatedDesign;

use super::device::Device;
use super::shown::{Shown, in_text};
use super::{Asked, Search, Searched};
use crate::shell::Failure;

/// Heads and least widths of the words in the text.
const HEADS: [(&str, usize); 7] =
    [("depth", 5), ("trig", 4), ("length", 6), ("position", 8), ("stiffness", 9), ("force", 5), ("torque", 6)];

pub struct Phantom;

impl Device for Phantom {
    fn accepts(&self, args: &Search, asked: &Asked) -> Result<(), Failure> {
        if asked.scenes.len() > 1 || !args.also.is_empty() || args.proved {
            let why = "a search over a PHANToM's widths takes one scene, as it is; its page tells what is proved";
            return Err(Failure::usage(format!("{why}: leave out the other scenes, --also and --proved")));
        }
        if args.against.is_some() {
            return Err(Failure::usage("--against: the reference of a PHANToM is the widest design; widen a range"));
        }
        Ok(())
    }

    fn shown<'s>(&self, searched: &'s Searched) -> Shown<'s> {
        shown(searched)
    }
}

fn shown(searched: &Searched) -> Shown<'_> {
    let (found, base) = (&searched.found, &searched.experiment);
    let proofs: BTreeMap<_, _> = found
        .best()
        .chain([&found.reference])
        .filter_map(|point| Some((point.design, proved(base, &point.design).ok()?)))
        .collect();
    let tip = proofs.clone();
    let tip_m = move |point: &RatedDesign| tip.get(&point.design).map(|(tip_m, _)| *tip_m);
    let share = move |point: &RatedDesign| proofs.get(&point.design).map(|(_, share)| *share);
    let shown_as = |text: Option<String>| text.unwrap_or_else(|| "-".into());

    let keys: Vec<_> = found.reference.design.widths().map(|(key, _)| key).collect();
    let mut fields: Vec<_> = HEADS
        .iter()
        .zip(keys.clone())
        .map(|((head, least), key)| in_text(head, *least).of(move |point: &RatedDesign| point.design.get(key.field)))
        .collect();
    fields.extend(keys.iter().copied().map(|key| {
        Column::text(&key.name.replace('.', "_"), "")
            .in_files()
            .of(move |point: &RatedDesign| point.design.get(key.field))
    }));
    fields.extend([
        Column::text("widths", "").in_json().of(|point: &RatedDesign| {
            let widths = point.design.widths().map(|(key, bits)| (key.name, bits));
            Value::of(widths.collect::<BTreeMap<_, _>>())
        }),
        Column::integer("block_rams", "RAM").least(5).of(|point: &RatedDesign| point.merit.cost.rams),
        Column::integer("cells_estimated", "cells").least(6).of(|point: &RatedDesign| point.merit.cost.logic),
        Column::number("error", "error")
            .least(9)
            .of(|point: &RatedDesign| Cell::new(point.merit.error).shown(percent(point.merit.error))),
        Column::text("stable_stiffness", "").in_json().of(|point: &RatedDesign| point.merit.stiffness),
        Column::text("stable_stiffness_n_per_m", "")
            .in_files()
            .of(|point: &RatedDesign| format!("{:.3}", point.merit.stiffness)),
        in_text("N/m", 10).of(|RatedDesign { merit, capped, .. }: &RatedDesign| {
            format!("{:.1}{}", merit.stiffness, if *capped { "+" } else { "" })
        }),
        Column::flag("capped", "").data().of(|point: &RatedDesign| point.capped),
    ]);
    let (of_tip, of_torque) = (tip_m.clone(), share.clone());
    fields.extend([
        Column::text("tip_error_m_proved", "").in_json().of(of_tip.clone()),
        Column::text("torque_error_proved", "").in_json().of(of_torque.clone()),
        Column::text("tip_error_m", "").in_files().of(of_tip),
        Column::text("torque_error", "").in_files().of(of_torque),
        in_text("tip um", 9).of(move |point| shown_as(tip_m(point).map(|tip_m| format!("{:.3}", 1e6 * tip_m)))),
        in_text("torque %", 8).of(move |point| shown_as(share(point).map(|share| format!("{:.5}", 100.0 * share)))),
    ]);
    Shown {
        fields,
        designs: found.best().collect(),
        reference: found.reference.design.to_string(),
        lines: lines(searched),
        smallest: searched.smallest().map(|point| smallest(searched, point)),
        data: vec![("off", found.off.into())],
    }
}

/// Returns the lines on the conditions of the search.
fn lines(searched: &Searched) -> Vec<(&'static str, String)> {
    let found = &searched.found;
    let outputs: Vec<_> = found.outputs().iter().map(|output| output.name()).collect();
    let own = match &searched.experiment {
        Experiment::Phantom(scene) => scene.room.stiffness_n_per_m,
        _ => f64::NAN,
    };
    let (within, estimate_error) = (percent(searched.within), percent(found.estimate_error));
    vec![
        (
            "error",
            format!(
                "worst of {} against the reference's, measured; {} designs are off by more than {within}",
                outputs.join(", "),
                found.off
            ),
        ),
        (
            "stiffness",
            format!(
                "the stiffest wall up to which all are passive, in steps of 2^(1/16) from {own} N/m; measured; `+`: \
                 none is stiffer"
            ),
        ),
        ("block RAM", "of the tables of three joints, on the iCE40; computed from the words".into()),
        (
            "cells",
            format!(
                "of an iCE40 HX8K, estimated from the words: within {estimate_error} on the blocks and loops \
                 that were counted"
            ),
        ),
        (
            "tip",
            "and torque: proved, for every posture in the tables; torque of its joint's full scale, forces as words"
                .into(),
        ),
    ]
}

fn smallest(searched: &Searched, point: &RatedDesign) -> String {
    let (ours, theirs) = (point.merit.cost, searched.found.reference.merit.cost);
    let mut text = format!(
        "the least block RAM that keeps the reference's stable stiffness within {}\n  {}\n  {} block RAMs \
         instead of {}",
        percent(searched.lose),
        point.design,
        ours.rams,
        theirs.rams
    );
    if let (Some(ours), Some(theirs)) = (ours.logic, theirs.logic) {
        text += &format!(", {ours} cells instead of {theirs}, estimated");
    }
    text
}
