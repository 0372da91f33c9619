//! The device of a run on its page: its motion, and its words or the ports of a design.

use hpu_cosim::dut::{DutSession, Wire};
use hpu_cosim::scene::Device;
use hpu_cosim::{AnyRig, Ready, Rig, Session, Trace};
use hpu_signal::Notation;
use hpu_study::page::Page;
use serde_json::{Value, json};

use crate::parameters;
use crate::run::contact::ANGLE;
use crate::run::{Ran, phantom};
use crate::units::{error_percent, si};

/// The index of the torque or force of its actuator.
const TORQUE: usize = 3;

/// Adds the lines of the device: its motion, and its words or the ports of a design.
pub fn of_device(page: &mut Page, ran: &Ran) {
    let (words, missed) = match ran.session {
        AnyRig::Ours(Ready::Axis(session)) => {
            if ran.summary.verdict.is_some() {
                let scene = session.scene();
                page.line("motion", motion(&scene.device, scene.wall.position_rad, &ran.trace));
            }
            let missed = session.words().realised.stiffness_miss.as_ref();
            let key = Some("method.stiffness_format");
            (words(session, ran.notation).to_vec(), missed.map(|miss| parameters::missed(miss, key)))
        }
        AnyRig::Ours(Ready::Phantom(session)) => {
            page.line("platform", phantom::platform(session.scene()));
            page.line("motion", phantom::motion(session.scene(), &ran.trace));
            let missed = session.words().stiffness_miss.as_ref().map(|miss| parameters::missed(miss, None));
            (phantom::words(session, ran.notation).to_vec(), missed)
        }
        AnyRig::Dut(session) => {
            let scene = session.scene();
            page.line("motion", motion(&scene.device, scene.wall_rad, &ran.trace));
            page.line("dut", format!("{} by {}", scene.dut.top, session.engine()));
            for said in wires(session) {
                page.line("port", said);
            }
            return;
        }
    };
    for said in words {
        page.line("words", said);
    }
    if let Some(said) = missed {
        page.line("warning", said);
    }
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

/// Describes a design of the user's own: its simulator, and the connections of its ports.
pub fn dut(session: &AnyRig) -> Option<Value> {
    let AnyRig::Dut(session) = session else { return None };
    let wire = |Wire { port, connection }: &Wire| {
        json!({
            "port": port.name,
            "direction": if port.is_input { "in" } else { "out" },
            "bits": port.format.width(),
            "connection": connection.name(),
        })
    };
    Some(json!({
        "top": session.scene().dut.top,
        "engine": session.engine(),
        "ports": session.wires().iter().map(wire).collect::<Vec<_>>(),
    }))
}

/// Returns the parameters as the scene's words realise them.
pub fn realised(session: &AnyRig) -> Value {
    match session {
        AnyRig::Ours(Ready::Axis(session)) => {
            let realised = session.words().realised;
            json!({
                "torque_quantum_nm": realised.torque_quantum_nm,
                "count_rad": realised.count_rad,
                "wall_position_rad": realised.wall_position_rad,
                "stiffness_nm_per_rad": realised.stiffness_nm_per_rad,
                "stiffness_error": realised.stiffness_error,
                "stiffness_missed": realised.stiffness_miss.as_ref().map(parameters::missed_object),
                "damping_nm_s_per_rad": realised.damping_nm_s_per_rad,
                "sample_rate_hz": realised.sample_rate_hz,
            })
        }
        AnyRig::Ours(Ready::Phantom(session)) => {
            let (scene, words) = (session.scene(), session.words());
            let formats = &scene.method.config.formats;
            json!({
                "wall_position_m": formats.position.to_f64(words.high),
                "stiffness_n_per_m": formats.stiffness.to_f64(words.stiffness),
                "stiffness_missed": words.stiffness_miss.as_ref().map(parameters::missed_object),
                "sample_rate_hz": scene.clock.frequency_hz() as f64 / words.period as f64,
                "count_rad": session.count_rad(),
                "torque_quantum_nm": session.commands().iter().map(|command| command.2).collect::<Vec<_>>(),
                "apparent_mass_kg": session.apparent_kg(),
            })
        }
        AnyRig::Dut(session) => json!({ "count_rad": session.scene().encoder.count_rad() }),
    }
}
