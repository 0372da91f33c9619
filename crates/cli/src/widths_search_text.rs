//! The result of a search over widths, as text and as JSON.

use hpu_cosim::figure;
use std::path::PathBuf;

use hpu_rtl::Counts;
use hpu_study::fit::percent;
use hpu_study::map::outcome_name;
use hpu_study::widths::search::{Design, ESTIMATE_ERROR, Found, Point, Width};
use serde_json::{Map, Value, json};

use crate::widths_search::Searched;

/// Rows of the front in the text.
const ROWS: usize = 40;

/// Returns the result as text of 120 columns.
pub fn text(searched: &Searched) -> String {
    let found = &searched.found;
    let Found { reference, unit, .. } = found;
    let mut text = format!("{}: which widths buy what\n", searched.scene);
    let mut line = |name: &str, said: String| text += &format!("{name:<11}{said}\n");
    let knobs: Vec<String> = searched.knobs.iter().map(ToString::to_string).collect();
    let mut rows = knobs.chunks(3).map(|knobs| knobs.join("  "));
    line("varied", rows.next().unwrap_or_default());
    rows.for_each(|row| line("", row));
    let refused: usize = found.refused.iter().map(|(_, count)| count).sum();
    line(
        "designs",
        format!("{}, of which {refused} are refused; {} kinds differ in a run", found.designs, found.kinds),
    );
    for (why, count) in found.refused.iter().take(2) {
        line("", format!("{count}: {}", cut(why, 98)));
    }
    let saved = 1.0 - found.runs as f64 / found.grid_runs.max(1) as f64;
    let said = match found.runs < found.grid_runs {
        true => format!("{} of at least {} of the grid: {} saved", found.runs, found.grid_runs, percent(saved)),
        false => format!(
            "{}; the grid has at least {}, beside the reference's and those around it",
            found.runs, found.grid_runs
        ),
    };
    line("runs", said);
    for why in found.failed.iter().take(2) {
        line("failed", cut(why, 98));
    }
    line("reference", widths(&reference.design));
    for (index, on) in found.on.iter().enumerate() {
        let verdict = outcome_name(Some(on.outcome)).replace('_', " ");
        let warning = if on.touches { "" } else { "; wall not reached: the stable stiffness says nothing of it" };
        line(if index == 0 { "run on" } else { "" }, format!("{}: {verdict}{warning}", cut(&on.scene, 96)));
    }
    for (index, said) in holds_for(searched).into_iter().enumerate() {
        line(if index == 0 { "holds for" } else { "" }, said);
    }
    let outputs: Vec<_> = found.outputs().iter().map(|output| output.name()).collect();
    let (off, of) = (percent(searched.within), if found.on.len() > 1 { " on any of these" } else { "" });
    line("error", format!("worst of {}{of} against the reference's, measured; at most {off}", outputs.join(", ")));
    line(
        "stiffness",
        format!("the stiffest wall that settles, in {unit}, measured; `+`: the format holds no stiffer one"),
    );
    line(
        "LUT4",
        format!(
            "estimated, within {}{}",
            percent(ESTIMATE_ERROR),
            searched.prices.as_ref().map_or("", |_| "; counted: by Yosys for the iCE40")
        ),
    );
    text += &format!(
        "\n{:<11}{:>8} {:>10} {:>10} {:>8} {:>4} {:>6} {:>8} {:>12} {:>12}\n",
        "", "position", "stiffness", "damping", "velocity", "pwm", "LUT4", "counted", "error", "stiffness"
    );
    let prices = searched.prices.as_ref();
    text += &row("reference", reference, prices.map(|(reference, _)| *reference));
    for (index, point) in found.best().enumerate().take(ROWS) {
        text += &row(if index == 0 { "front" } else { "" }, point, prices.map(|(_, front)| front[index]));
    }
    let rows = found.best().count();
    if rows > ROWS {
        text += &format!("{:<11}and {} more: -o DIR writes all\n", "", rows - ROWS);
    }
    text += "\n";
    match found.smallest(searched.lose) {
        None => text += &format!("no design keeps the reference's stiffness within {}\n", percent(searched.lose)),
        Some(point) => text += &smallest(searched, point),
    }
    text
}

fn row(name: &str, Point { design, merit, capped }: &Point, counted: Option<Counts>) -> String {
    let format = |int, frac| format!("(0,{},{})", design.get(int), design.get(frac));
    let counted = counted.map_or("-".into(), |counts| counts.lut4.to_string());
    format!(
        "{name:<11}{:>8} {:>10} {:>10} {:>8} {:>4} {:>6} {counted:>8} {:>12} {:>11.6}{}\n",
        design.get(Width::Position),
        format(Width::StiffnessInt, Width::StiffnessFrac),
        format(Width::DampingInt, Width::DampingFrac),
        design.get(Width::Velocity),
        design.get(Width::Pwm),
        merit.lut4,
        percent(merit.error),
        merit.stiffness,
        if *capped { "+" } else { "" }
    )
}

fn smallest(searched: &Searched, point: &Point) -> String {
    let Searched { found, lose, .. } = searched;
    let saved = |ours: u64, theirs: u64| {
        let saved = 1.0 - ours as f64 / theirs as f64;
        format!("{ours} LUT4 instead of {theirs}: {} saved ({})", theirs.saturating_sub(ours), percent(saved))
    };
    let reference = &found.reference.merit;
    let mut text = format!("smallest widths that keep the reference's stable stiffness within {}\n", percent(*lose));
    text += &format!("  {}\n", widths(&point.design));
    let ratio = point.merit.stiffness / reference.stiffness - 1.0;
    text += &format!(
        "  {}{} {} instead of {}: {:+.2} %, measured\n",
        figure(point.merit.stiffness),
        if point.capped { "+" } else { "" },
        found.unit,
        figure(reference.stiffness),
        100.0 * ratio
    );
    text += &format!("  {}, estimated\n", saved(point.merit.lut4.into(), reference.lut4.into()));
    if let (Some((theirs, _)), Some(ours)) = (&searched.prices, searched.price_of(point)) {
        text +=
            &format!("  {}, counted; {} flip-flops instead of {}\n", saved(ours.lut4, theirs.lut4), ours.ff, theirs.ff);
    }
    text + &format!("  {}\n", searched.replay(point))
}

fn widths(design: &Design) -> String {
    let format = |int, frac| format!("(0,{},{})", design.get(int), design.get(frac));
    format!(
        "position {}, stiffness {}, damping {}, velocity {}, pwm {}",
        design.get(Width::Position),
        format(Width::StiffnessInt, Width::StiffnessFrac),
        format(Width::DampingInt, Width::DampingFrac),
        design.get(Width::Velocity),
        design.get(Width::Pwm)
    )
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

fn cut(text: &str, most: usize) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.chars().count() <= most { line } else { line.chars().take(most - 1).chain(['\u{2026}']).collect() }
}

/// Returns the result as JSON.
pub fn object(searched: &Searched, files: &[PathBuf]) -> Value {
    let found = &searched.found;
    let prices = searched.prices.as_ref();
    let counted = |counts: Option<Counts>| {
        counts.map(|counts| json!({ "lut4": counts.lut4, "ff": counts.ff, "carry": counts.carry }))
    };
    let point = |point: &Point, price: Option<Counts>| {
        let set: Map<_, _> = point.design.set().into_iter().map(|(key, value)| (key, json!(value))).collect();
        json!({
            "set": set,
            "lut4_estimated": point.merit.lut4,
            "counted": counted(price),
            "error": point.merit.error.is_finite().then_some(point.merit.error),
            "stable_stiffness": point.merit.stiffness,
            "capped": point.capped,
            "command": searched.replay(point),
        })
    };
    let lines = found.lines.iter().map(|line| {
        let errors = line.errors.iter().map(|(bits, error)| {
            let other = error.is_some_and(f64::is_infinite);
            json!({ "bits": bits, "error": error.filter(|error| error.is_finite()), "other_verdict": other })
        });
        json!({ "width": line.width.key(), "errors": errors.collect::<Vec<_>>() })
    });
    json!({
        "scene": searched.scene,
        "command": searched.command,
        "unit": found.unit,
        "scenes": found.on.iter().enumerate().map(|(index, on)| {
            let held = found.proved.as_ref().map(|proved| proved[index]);
            let ends = |(least, most): (i64, i64)| json!([least, most]);
            json!({
                "scene": on.scene,
                "outcome": outcome_name(Some(on.outcome)),
                "wall_reached": on.touches,
                "proved": held.map(|held| json!({ "delta": ends(held.delta), "velocity": ends(held.velocity) })),
            })
        }).collect::<Vec<_>>(),
        "proved": searched.proved,
        "outputs": found.outputs().iter().map(|output| output.name()).collect::<Vec<_>>(),
        "varied": searched.knobs.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "designs": found.designs,
        "refused": found.refused.iter().map(|(why, count)| json!({ "reason": why, "designs": count })).collect::<Vec<_>>(),
        "kinds": found.kinds,
        "runs": found.runs,
        "grid_runs_at_least": found.grid_runs,
        "failed": found.failed,
        "within": searched.within,
        "estimate_error": ESTIMATE_ERROR,
        "reference": point(&found.reference, prices.map(|(reference, _)| *reference)),
        "front": found.best().enumerate().map(|(i, best)| point(best, prices.map(|(_, front)| front[i]))).collect::<Vec<_>>(),
        "smallest": found.smallest(searched.lose).map(|best| point(best, searched.price_of(best))),
        "errors_by_width": lines.collect::<Vec<_>>(),
        "files": files,
    })
}
