//! The summary of a run as text.

mod contact;
mod phantom;

use std::fmt::Write as _;

use hpu_cosim::dut::{DutSession, Wire};
use hpu_cosim::scene::{Device, Metric, OutcomeKind, Units};
use hpu_cosim::{AnyRig, Mark, NetUse, Ready, Rig, Session, Trace, Verdict, unseen_growth_per_s};
use hpu_signal::{Cycle, Notation};
use hpu_study::widths::idle_bits;

use crate::columns::Column::{Left, Right};
use crate::columns::aligned;
use crate::fit;
use crate::parameters;
use crate::run::Ran;
use crate::terminal;
use crate::units::{error_percent, percent, rounded_up, si};

pub use contact::{displayed, unseen, wraps};

/// The index of an axis's angle among its outputs.
const ANGLE: usize = 2;
/// The index of the torque or force of its actuator.
const TORQUE: usize = 3;

/// Returns the summary.
pub fn summary(ran: &Ran) -> String {
    let mut text = String::new();
    let mut row = |name: &str, said: String| {
        writeln!(text, "{name:<10} {said}").expect("a string grows");
    };
    let clock = si(ran.session.clock().frequency_hz() as f64, "Hz");
    row("scene", format!("{}, {} at {clock}", ran.session.name(), ran.session.closed_by()));
    if let Some(found) = &ran.fitted {
        fit::lines(found).into_iter().for_each(|(name, said)| row(name, said));
    }
    let outcome = match ran.summary.verdict {
        Some(verdict) => outcome(verdict, position(ran), ran.window_s) + &contact::beside(ran),
        None if ran.summary.complete => "a recording: no device, no motion to judge".to_string(),
        None => "stopped before its end".to_string(),
    };
    row("outcome", outcome);
    if let Some(said) = contact::line(ran) {
        row("contact", said);
    }
    if let Some(abort) = ran.summary.aborted {
        row("aborted", format!("at {}: {}", si(abort.at_s, "s"), abort.why));
    }
    match ran.session {
        AnyRig::Ours(Ready::Axis(session)) => {
            if ran.summary.verdict.is_some() {
                let scene = session.scene();
                row("motion", motion(&scene.device, scene.wall.position_rad, &ran.trace));
            }
            words(session, ran.notation).into_iter().for_each(|said| row("words", said));
            if let Some(miss) = &session.words().realised.stiffness_miss {
                row("warning", parameters::missed(miss, Some("method.stiffness_format")));
            }
        }
        AnyRig::Ours(Ready::Phantom(session)) => {
            row("platform", phantom::platform(session.scene()));
            row("motion", phantom::motion(session.scene(), &ran.trace));
            phantom::words(session, ran.notation).into_iter().for_each(|said| row("words", said));
            if let Some(miss) = &session.words().stiffness_miss {
                row("warning", parameters::missed(miss, None));
            }
        }
        AnyRig::Dut(session) => {
            let scene = session.scene();
            row("motion", motion(&scene.device, scene.wall_rad, &ran.trace));
            row("dut", format!("{} by {}", scene.dut.top, session.engine()));
            wires(session).into_iter().for_each(|said| row("port", said));
        }
    }
    if ran.summary.energy.exchanged_j > 0.0 {
        energy(ran).into_iter().for_each(|said| row("energy", said));
    }
    faults(ran).into_iter().for_each(|said| row("fault", said));
    row("edges", edges(ran));
    if ran.summary.steps > 0 {
        let rate = ran.summary.steps as f64 / ran.summary.wall_s;
        row("steps", format!("{} of {}: {rate:.2e} steps/s", ran.summary.steps, ran.solver));
    }
    if !ran.summary.nets.is_empty() {
        row("activity", activity(ran));
    }
    if ran.summary.edges > 0 && !ran.summary.nets.is_empty() {
        text += &nets(ran);
    }
    text += &parameters::text(&ran.parameters);
    for line in expectations(ran) {
        writeln!(text, "{:<10} {line}", "expected").expect("a string grows");
    }
    if let Some((rtl, hdl)) = &ran.rtl {
        let said = terminal::verdict(&format!("{} mismatches", rtl.mismatches), rtl.ok());
        writeln!(text, "{:<10} {} edges in GHDL, {said}; VHDL {hdl}", "rtl", rtl.edges).expect("a string grows");
        if let Some(first) = &rtl.first {
            let at = si(ran.session.clock().seconds(Cycle(first.row)), "s");
            writeln!(text, "{:<10} first difference at {at}; from there on `differs` is 1 in trace and waveform", "")
                .expect("a string grows");
            text += &first.to_string();
        }
    }
    if let Some(held) = &ran.held {
        text += &held.text(ran.session.clock().period_s());
    }
    for file in &ran.files {
        writeln!(text, "{:<10} {}", "file", file.display()).expect("a string grows");
    }
    text
}

/// Returns the name of an outcome, as scenes and JSON write it.
pub fn outcome_name(kind: OutcomeKind) -> &'static str {
    match kind {
        OutcomeKind::Settled => "settled",
        OutcomeKind::LimitCycle => "limit_cycle",
        OutcomeKind::Diverged => "diverged",
        OutcomeKind::Passive => "passive",
        OutcomeKind::NonPassive => "non_passive",
        OutcomeKind::HighlyUnstable => "highly_unstable",
    }
}

fn outcome(verdict: Verdict, unit: &str, [from_s, to_s]: [f64; 2]) -> String {
    match verdict {
        Verdict::Settled { rms_rad } => format!(
            "settled: rms {} about the mean, {} to {}; growth below {}/s would not be seen",
            si(rms_rad, unit),
            si(from_s, "s"),
            si(to_s, "s"),
            rounded_up(unseen_growth_per_s(to_s - from_s))
        ),
        Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz: 0.0 } => format!(
            "moving to the end, over {} without a period (a limit cycle by the rule), rms {}",
            si(2.0 * amplitude_rad, unit),
            si(rms_rad, unit)
        ),
        Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz } => format!(
            "limit cycle: amplitude {}, {}, rms {}",
            si(amplitude_rad, unit),
            si(frequency_hz, "Hz"),
            si(rms_rad, unit)
        ),
        Verdict::Diverged { at_s, amplitude_rad } => {
            format!("diverged: amplitude {}, growing since {}", si(amplitude_rad, unit), si(at_s, "s"))
        }
        Verdict::Passive { rms_m } => format!("passive: rms {} about the steady value at the end", si(rms_m, "m")),
        Verdict::NonPassive { rms_m } => {
            format!("non-passive: rms {} about the steady value at the end", si(rms_m, "m"))
        }
        Verdict::HighlyUnstable { at_s } => format!("highly unstable: aborted at {}", si(at_s, "s")),
    }
}

/// Describes the ports of a design and their connections.
fn wires(session: &DutSession) -> Vec<String> {
    let wire = |Wire { port, connection }: &Wire| {
        let width = port.format.width();
        let bits = if width == 1 { String::new() } else { format!("[{}:0]", width - 1) };
        let arrow = if port.is_input { "<-" } else { "->" };
        format!("{:<24} {arrow} {}", format!("{}{bits}", port.name), connection.name())
    };
    session.wires().iter().map(wire).collect()
}

fn motion(device: &Device, wall_rad: f64, trace: &Trace) -> String {
    let units = device.units();
    let peak = trace.greatest(ANGLE);
    format!(
        "ends at {}, peak {}, {} into the wall, {} up to {}, seen every {}",
        si(trace.last(ANGLE).unwrap_or(0.0), units.position),
        si(peak, units.position),
        si((peak - wall_rad).max(0.0), units.position),
        if matches!(device, Device::Mass(_)) { "force" } else { "torque" },
        si(trace.greatest_size(TORQUE), units.effort),
        si(trace.interval_s() / trace.every() as f64, "s")
    )
}

fn words(session: &Session, notation: Notation) -> [String; 4] {
    let (scene, words) = (session.scene(), session.words());
    let units = scene.device.units();
    let (realised, method) = (&words.realised, &scene.method);
    [
        format!(
            "stiffness {} of {} is {}, asked {}: {}",
            method.stiffness_format.value(words.stiffness),
            notation.of(method.stiffness_format),
            si(realised.stiffness_nm_per_rad, units.stiffness),
            si(scene.wall.stiffness_nm_per_rad, units.stiffness),
            error_percent(realised.stiffness_error)
        ),
        format!(
            "damping {} of {} is {}, asked {}: {}",
            method.damping_format.value(words.damping),
            notation.of(method.damping_format),
            si(realised.damping_nm_s_per_rad, units.damping),
            si(scene.wall.damping_nm_s_per_rad, units.damping),
            error_percent(realised.damping_error)
        ),
        format!(
            "wall at {}, asked {}; a count is {}, a PWM count {}",
            si(realised.wall_position_rad, units.position),
            si(scene.wall.position_rad, units.position),
            si(realised.count_rad, units.position),
            si(realised.torque_quantum_nm, units.effort)
        ),
        format!("period {} clocks is {}", words.period, si(realised.sample_rate_hz, "Hz")),
    ]
}

fn energy(ran: &Ran) -> [String; 3] {
    let energy = &ran.summary.energy;
    let j = |value| si(value, "J");
    [
        format!(
            "supplied {} (source {}, hand {}) = stored {} + dissipated {}",
            j(energy.supplied_j),
            j(energy.source_j),
            j(energy.hand_j),
            j(energy.stored_j),
            j(energy.dissipated_j)
        ),
        match ran.session {
            AnyRig::Ours(Ready::Axis(_)) | AnyRig::Dut(_) => format!(
                "dissipated in copper {}, diodes {}, viscous friction {}, Coulomb friction {}",
                j(energy.copper_j),
                j(energy.diodes_j),
                j(energy.viscous_j),
                j(energy.coulomb_j)
            ),
            AnyRig::Ours(Ready::Phantom(_)) => format!(
                "dissipated in viscous friction {}, Coulomb friction {}, the transmission {}",
                j(energy.viscous_j),
                j(energy.coulomb_j),
                j(energy.transmission_j)
            ),
        },
        format!(
            "residual {:.1e} of the {} exchanged",
            energy.residual_j.abs() / energy.exchanged_j,
            j(energy.exchanged_j)
        ),
    ]
}

fn edges(ran: &Ran) -> String {
    let (edges, wall_s) = (ran.summary.edges, ran.summary.wall_s);
    let motion = si(ran.summary.motion_s, "s");
    let rate = edges as f64 / wall_s;
    format!("{edges} ({motion}) in {} by {}: {rate:.2e} edges/s", si(wall_s, "s"), ran.driver)
}

fn activity(ran: &Ran) -> String {
    let summary = &ran.summary;
    format!(
        "{} of the edges: {} ticks, {} encoder edges, {} output changes, {} mode changes; {} decided again",
        percent(summary.ticks, summary.edges),
        summary.ticks,
        summary.encoder_edges,
        summary.output_changes,
        summary.mode_changes,
        summary.redecided
    )
}

/// Returns the number of times that each fault has happened, and when it happened first.
fn faults(ran: &Ran) -> Vec<String> {
    let line = |kind: &&'static str| {
        let mut of_kind = ran.summary.faults.iter().filter(|mark| mark.what == *kind);
        let first = of_kind.next()?;
        let at = si(ran.session.clock().seconds(Cycle(first.edge)), "s");
        Some(match of_kind.count() {
            0 => format!("{kind} at {at}"),
            more => format!("{kind} {} times, first at {at}", more + 1),
        })
    };
    let waiting = match ran.summary.faults_waiting {
        0 => None,
        waiting => Some(format!("{waiting} more waited for an edge of the encoder that did not come")),
    };
    Mark::KINDS.iter().filter_map(line).chain(waiting).collect()
}

/// Returns the table of the datapath's words: their ranges, and the share of the edges at which they had lost bits.
fn nets(ran: &Ran) -> String {
    let edges = ran.summary.edges;
    let nets: Vec<_> = ran.summary.nets.iter().filter(|net| net.signal.format.width() > 1).collect();
    // The losses inside a design of the user's own are unknown. The idle bits of its ports are known.
    let is_own = matches!(ran.session, AnyRig::Dut(_));
    let last = if is_own { ["idle bits", ""] } else { ["rounded", "overflowed"] };
    let heads = ["", "net", "format", "min", "max", last[0], last[1], "unit"].map(String::from);
    let cells = |net: &&NetUse| {
        let (format, usage) = (net.signal.format, net.usage);
        let seen = |word| match usage.min <= usage.max {
            true => format.to_f64(word).to_string(),
            false => "unknown".to_string(),
        };
        // The range is that of the unsigned word, which wraps where the device passes its starting position.
        let modulo =
            if net.signal.is_counter() { format!(", modulo 2^{}, as unsigned", format.width()) } else { String::new() };
        let idle = |net: &NetUse| idle_bits(net).map_or("unknown".to_string(), |bits| bits.to_string());
        let share = |lost| if net.losses_seen { percent(lost, edges) } else { "unknown".to_string() };
        [
            "net".to_string(),
            net.signal.name.to_string(),
            ran.notation.of(format),
            seen(usage.min),
            seen(usage.max),
            if is_own { idle(net) } else { share(usage.rounded) },
            if is_own { String::new() } else { share(usage.overflowed) },
            format!("{}{modulo}", net.signal.unit),
        ]
    };
    let lost = if is_own { 0 } else { 11 };
    let columns = [Left(10), Left(12), Left(10), Right(12), Right(12), Right(11), Right(lost), Left(0)];
    let rows = aligned(columns, std::iter::once(heads).chain(nets.iter().map(cells)).collect());
    let overflowed = std::iter::once(false).chain(nets.iter().map(|net| net.usage.overflowed > 0));
    let lines = rows.into_iter().zip(overflowed).map(|(mut cells, overflowed)| {
        if overflowed {
            cells[6] = terminal::verdict(&cells[6], false);
        }
        let [name, net, format, min, max, rounded, lost, unit] = cells;
        format!("{name} {net} {format} {min} {max} {rounded} {lost}  {}\n", unit.trim_end())
    });
    lines.collect()
}

fn expectations(ran: &Ran) -> Vec<String> {
    let said = |met| terminal::verdict(if met { "met" } else { "NOT MET" }, met);
    let outcome = ran
        .outcome_met
        .map(|(kind, met)| format!("outcome {}: {}{}", outcome_name(kind), said(met), contact::beside(ran)));
    let numbers = ran.numbers.iter().map(|(expected, got, met)| {
        let unit = unit(ran, expected.metric);
        format!(
            "{} {} within {}: {}, {}",
            expected.metric.name(),
            si(expected.value, unit),
            si(expected.tolerance, unit),
            got.map_or("nothing".to_string(), |got| si(got, unit)),
            said(*met)
        )
    });
    let unjudged = ran.unjudged.map(|why| format!("not judged: {why}"));
    outcome.into_iter().chain(numbers).chain(unjudged).collect()
}

/// Returns the unit of the device's positions.
fn position(ran: &Ran) -> &'static str {
    axis_units(ran).map_or("m", |units| units.position)
}

fn axis_units(ran: &Ran) -> Option<Units> {
    match ran.session {
        AnyRig::Ours(Ready::Axis(session)) => Some(session.scene().device.units()),
        AnyRig::Ours(Ready::Phantom(_)) => None,
        AnyRig::Dut(session) => Some(session.scene().device.units()),
    }
}

fn unit(ran: &Ran, metric: Metric) -> &'static str {
    match metric {
        Metric::FinalAngle | Metric::PeakAngle | Metric::PeakPenetration | Metric::Amplitude => position(ran),
        Metric::Frequency => "Hz",
        Metric::PeakTorque => axis_units(ran).map_or("N.m", |units| units.effort),
        Metric::SpringOverflowShare | Metric::EncoderEdges | Metric::ContactShare => "",
        Metric::Rms => "m",
    }
}
