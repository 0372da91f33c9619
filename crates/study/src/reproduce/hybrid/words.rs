//! The numbers in the paper's text.

use hpu_cosim::scene::{Experiment, Scene};
use hpu_cosim::{Control, Driver, Ready, Rig, Wired};

use super::super::beside::{Found, Line};
use super::{axis, line};

const GROUP: &str = "The text's numbers";

pub(super) fn lines() -> Vec<Line> {
    let mut lines = vec![
        line(GROUP, "torque of one PWM count", "265 mN.m in 2^12 counts", |_| {
            Ok(format!("{:.6} uN.m", words(&[])?.torque_quantum_nm * 1e6))
        }),
        line(GROUP, "stiffness of a gain of one", "", |_| {
            let words = words(&[])?;
            let quantum = words.torque_quantum_nm / words.count_rad;
            Ok(format!("{quantum:.10} N.m/rad at the shaft, {:.4} at the wheel", quantum * 49.0))
        }),
        line(GROUP, "B_c at 1 kHz, read as a gain of 31/32", "0.9687 \"N s/m\"", |_| gain(31.0 / 32.0)),
        line(GROUP, "B at 1 kHz, read as a gain of 2/55", "36.36e-3 \"N s/m\"", |_| gain(2.0 / 55.0)),
        line(GROUP, "torque 0.5 rad deep in 1.5 N.m/rad", "265 mN.m", |control| torque("saturate", control)),
        line(GROUP, "the same, the product's upper 12 bits dropped", "", |control| torque("drop_upper", control)),
    ];
    for (line, claims) in lines[4..].iter_mut().zip(["ij", "j"]) {
        line.claims = claims;
    }
    lines
}

fn words(set: &[(&str, &str)]) -> Result<hpu_cosim::scene::Realised, String> {
    axis("hybrid-wall", set)?.words().map(|words| words.realised).map_err(|error| error.to_string())
}

/// Returns a gain on the difference of two positions at 1 kHz, in SI units and relative to the motor's own damping.
fn gain(gain: f64) -> Result<String, String> {
    let scene: Scene = axis("hybrid-wall", &[])?;
    let words = scene.words().map_err(|error| error.to_string())?.realised;
    let damping = gain * words.torque_quantum_nm / words.count_rad / words.sample_rate_hz;
    let hpu_cosim::scene::Device::Motor(motor) = scene.device else { return Err("no motor".into()) };
    let own = motor.viscous_friction_nm_s_per_rad + motor.torque_constant_nm_per_a.powi(2) / motor.resistance_ohm;
    Ok(format!("{:.3} uN.m.s/rad, {:.4} of the motor's own", damping * 1e6, damping / own))
}

/// Returns the mean of the motor's torque in the last three tenths of a run that holds the shaft in the wall.
fn torque(product: &str, control: &Control) -> Result<Found, String> {
    let scene = axis(
        "hybrid-wall",
        &[
            ("method.product", product),
            ("hand", "{ kind = \"prescribed\", path = [[0, 2.0]] }"),
            ("run.duration", "50 ms"),
        ],
    )?;
    let experiment = Experiment::Axis(scene);
    let ready = Ready::new(&experiment).map_err(|error| error.to_string())?;
    let mut trace = ready.brief_trace();
    let summary = ready.run(Driver::Events, &mut trace, &mut (), control);
    let [torque_nm, _] = summary.averages.ok_or("stopped before its end")?;
    let mean = -torque_nm;
    Ok(Found::new(format!("{:.3} mN.m", mean * 1e3), [mean]))
}
