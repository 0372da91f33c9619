//! The limits of a touch on a segment on a gimbal: the criteria that tell whether the finger can rest.

use hpu_cosim::figure;

use hpu_prove::criteria::touch::{NAMES, Rest};

use super::TouchLimits;
use hpu_page::{Cell, Column, Page, Table};

/// The width of the labels.
const LABEL: usize = 21;

/// The texts of the criteria, in the order of their names.
const SAID: [&str; 3] = [
    "the asked spring is softer than position control",
    "neither control keeps the crank at its rest",
    "the loop of every control that rests grows from pulse to pulse",
];

/// Returns the page of a scene's limits. `scene` is the scene as the command line has it, `name` its name.
pub(super) fn page(scene: &str, name: &str, found: &TouchLimits) -> Page {
    let TouchLimits { criteria, range_n_per_m: [least, most], rests_n_per_m } = found;
    let mut page = Page::labelled(LABEL);
    page.note(format!("{}: whether a finger can rest on the segment", name)).note("");
    page.data("scene", name);
    let stiffness = |value: f64| format!("{} N/m", figure(value));
    let (position, asked) = (criteria.position_n_per_m, criteria.asked_n_per_m);
    let of_position = format!("{}, where the target ends", stiffness(position));
    page.fact("position_stiffness_n_per_m", "position control", position, of_position);
    page.fact("stiffness_n_per_m", "asked spring", asked, stiffness(asked));
    let looks = TouchLimits::looks();
    page.data("range_n_per_m", [least, most]).data("looks", looks);
    page.line("looked at", format!("{looks} stiffnesses from {} to {}", figure(*least), stiffness(*most)));
    page.note("").table(rests(&criteria.rests, criteria.holds)).note("");
    page.table(verdicts(criteria.fails(), rests_n_per_m)).note("");
    page.note("criteria in floats, without words and friction; a map holds them against runs:");
    let map = format!("hpu map {scene} --x 'surface.stiffness=0.2..3 N/mm' --y method.force_gain=0..15");
    page.data("map", &map).note(map);
    page
}

/// Returns the rests under both controls.
fn rests(rests: &[Rest; 2], holds: [bool; 2]) -> Table {
    let rows: Vec<_> = ["position", "impedance"].into_iter().zip(*rests).zip(holds).collect();
    type Row = ((&'static str, Rest), bool);
    let number = |value: f64| Cell::new(value).shown(figure(value));
    let fields = [
        Column::text("control", "control at rest").least(LABEL).of(|((name, _), _): &Row| *name),
        Column::number("force_n", "force N").of(move |((_, rest), _): &Row| number(rest.force_n)),
        Column::number("radius_m", "radius m").of(move |((_, rest), _): &Row| number(rest.radius_m)),
        Column::number("growth", "growth a pulse").of(move |((_, rest), _): &Row| number(rest.growth)),
        Column::flag("holds", "stays")
            .of(|(_, holds): &Row| Cell::new(*holds).shown(if *holds { "stays" } else { "switches away" })),
    ];
    Table::of("rests", &rows, fields)
}

/// Returns the verdict of each criterion, and the stiffnesses at which it predicts a rest.
fn verdicts(fails: [bool; 3], rests_n_per_m: &[Vec<[f64; 2]>; 3]) -> Table {
    let rows: Vec<_> = NAMES.into_iter().zip(SAID).zip(fails).zip(rests_n_per_m).collect();
    type Row<'r> = (((&'static str, &'static str), bool), &'r Vec<[f64; 2]>);
    let stretches = |stretches: &[[f64; 2]]| {
        let text = stretches.iter().map(|[from, to]| format!("{} to {}", figure(*from), figure(*to)));
        let text = text.collect::<Vec<_>>().join(", ");
        Cell::new(stretches).shown(if text.is_empty() { "nowhere".into() } else { text })
    };
    let fields = [
        Column::text("name", "criterion").least(LABEL).of(|(((name, _), _), _): &Row| *name),
        Column::flag("fails", "predicts")
            .of(|((_, fails), _): &Row| Cell::new(*fails).shown(if *fails { "a failure" } else { "a rest" })),
        Column::text("rests_n_per_m", "a rest at N/m").of(move |(_, rests): &Row| stretches(rests)),
        Column::text("fails_if", "a failure if").of(|(((_, said), _), _): &Row| *said),
    ];
    Table::of("criteria", &rows, fields)
}
