//! A run, and a closer look at a part of it.

use hpu_cosim::scene::Experiment;
use hpu_cosim::{Control, Simulation, Summary, Trace, Verdict, Wired, WiredSimulation, judged_window_s};
use hpu_page::quantities::{percent, si};
use hpu_page::summary::{Touch, outcome};
use hpu_signal::Cycle;
use hpu_study::command::{quoted, set_options};
use hpu_study::widths::idle_bits;
use serde_json::{Value, json};

use crate::Answer;
use crate::columns::Picked;
use crate::request::{Refusal, Request, Source};

/// The most rows of a closer look.
const MOST_ROWS: f64 = 20_000.0;

/// Runs the scene.
pub(crate) fn run(request: &Request) -> Result<Answer, Refusal> {
    let source = request.source()?;
    let experiment = source.runnable()?;
    let simulation = WiredSimulation::new(&experiment)?;
    let picked = Picked::of(&simulation, &request.texts("nets"), request.flag("ripple"));
    let mut trace = picked.trace(&simulation);
    let summary = simulation.run(simulation.driver(), &mut trace, &mut (), &Control::new());
    let mut json = told(&source, &experiment, &simulation, &summary, &trace);
    json["rows"] = json!({ "first_s": 0.0, "interval_s": trace.interval_s(), "count": trace.rows() });
    json["columns"] = picked.told(&simulation);
    Ok(Answer { json, columns: picked.columns(&trace), file: Vec::new() })
}

/// Runs the scene up to the end of a window, and returns the rows inside it.
pub(crate) fn look(request: &Request) -> Result<Answer, Refusal> {
    let experiment = request.source()?.runnable()?;
    let simulation = WiredSimulation::new(&experiment)?;
    if simulation.direct().is_some() {
        return Err("the scene runs in steps, without a clock: its rows are all there is to see".to_string().into());
    }
    let picked = Picked::of(&simulation, &request.texts("nets"), true);
    let frequency_hz = simulation.clock().frequency_hz() as f64;
    // Casts saturate: a time before the start is edge 0.
    let edge = |key: &str| Ok::<_, Refusal>(((request.number(key)? * frequency_hz) as u64).min(simulation.edges()));
    let window = edge("from_s")?..edge("to_s")?;
    let rows = request.number("rows")?.clamp(1.0, MOST_ROWS) as u64;
    let stride = (window.end.saturating_sub(window.start) / rows).max(1);
    let mut kept = picked.kept();
    hpu_cosim::look(&simulation, window, stride, &mut kept, &Control::new());
    let first_s = simulation.clock().seconds(Cycle(kept.first.unwrap_or(0)));
    let interval_s = simulation.clock().seconds(Cycle(stride));
    let count = kept.columns.first().map_or(0, Vec::len);
    let json = json!({
        "rows": { "first_s": first_s, "interval_s": interval_s, "count": count },
        "columns": picked.told(&simulation),
    });
    Ok(Answer { json, columns: kept.columns, file: Vec::new() })
}

/// Returns what the run's summary tells.
fn told(
    source: &Source,
    experiment: &Experiment,
    simulation: &WiredSimulation,
    summary: &Summary,
    trace: &Trace,
) -> Value {
    let (axis, wall) = match (simulation, experiment) {
        (WiredSimulation::Axis(simulation), Experiment::Axis(scene)) => {
            let wall = (scene.wall.position_rad, scene.wall.stiffness_nm_per_rad);
            let wall = scene.target.is_none().then_some((wall, scene.device.units()));
            (Some(simulation), wall)
        }
        _ => (None, None),
    };
    let window_s = judged_window_s(experiment);
    let (units, scale) = (experiment.setup().units(), experiment.setup().scale());
    let touch =
        Touch { summary, trace, window_s, wall: wall.map(|(wall, _)| wall), told_in: Some((units, scale)), axis };
    let (said, kind) = match summary.verdict {
        Some(verdict) => outcome(verdict.in_units(scale), units.position, window_s),
        None => ("a recording: no device, no motion to judge".to_string(), Value::Null),
    };
    let energy = &summary.energy;
    let j = |value| si(value, "J");
    json!({
        "name": experiment.name,
        "about": experiment.about.trim(),
        "device": hpu_page::device::drawing(experiment),
        "command": command(source, experiment),
        "closed_by": simulation.closed_by(),
        "clock_hz": simulation.clock().frequency_hz(),
        "outcome": said + &summary.verdict.map_or(String::new(), |_: Verdict| touch.beside()),
        "verdict": kind,
        "contact": touch.line(),
        "contact_share": summary.contact_share,
        "device_contact_share": summary.device_contact_share,
        "aborted": summary.aborted.map(|abort| format!("at {}: {}", si(abort.at_s, "s"), abort.why)),
        "window_s": window_s,
        "wall": wall.map(|((position, _), units)| json!({ "position": position, "unit": units.position })),
        "energy": energy,
        "energy_text": format!(
            "supplied {} (source {}, hand {}) = stored {} + dissipated {}; residual {}",
            j(energy.supplied_j),
            j(energy.source_j),
            j(energy.hand_j),
            j(energy.stored_j),
            j(energy.dissipated_j),
            j(energy.residual_j)
        ),
        "missed": experiment.setup().stiffness_miss().map(|miss| miss.error),
        "edges": summary.edges,
        "motion_s": summary.motion_s,
        "encoder_edges": summary.encoder_edges,
        "faults": summary.faults.iter().map(|mark| {
            json!({ "kind": mark.what, "at_s": simulation.clock().seconds(Cycle(mark.edge)) })
        }).collect::<Vec<_>>(),
        "nets": nets(summary),
    })
}

/// Returns the use of each net.
fn nets(summary: &Summary) -> Vec<Value> {
    let all = summary.nets.iter().map(|net| {
        let (format, usage) = (net.signal.format, net.usage);
        let seen = (usage.min <= usage.max).then(|| [usage.min, usage.max].map(|word| format.to_f64(word)));
        let range = [format.min(), format.max()].map(|end| end as f64 * format.lsb());
        let share = |lost: u64| if lost == 0 { String::new() } else { percent(lost, summary.edges) };
        json!({
            "name": net.signal.name,
            "doc": net.signal.doc,
            "unit": net.signal.unit,
            "format": format.to_string(),
            "width": format.width(),
            "range": range,
            "seen": seen,
            "idle_bits": idle_bits(net),
            "rounded": share(usage.rounded),
            "overflowed": share(usage.overflowed),
        })
    });
    all.collect()
}

/// Returns the command that makes the same run.
fn command(source: &Source, experiment: &Experiment) -> String {
    let place = if source.is_shipped() { experiment.name.clone() } else { quoted(source.named().0) };
    format!("hpu run {place}{}", set_options(&source.set))
}
