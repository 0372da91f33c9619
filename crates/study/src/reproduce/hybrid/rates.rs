//! Position at 20 kHz with velocity at 2 kHz, compared with both at 20 kHz.

use hpu_cosim::Control;
use hpu_cosim::scene::Scene;

use super::super::beside::{Found, Line};
use super::{Stiffest, axis, line};
use crate::SampledLoop;

const MOTOR: &str = "The stiffest wall at 20 kHz, velocity at 20 and at 2 kHz: this motor, 100 MHz, pushed by 20 mN.m";
const INERTIA: &str = "The stiffest wall at 20 kHz, velocity at 20 and at 2 kHz: an assumed inertia of 2e-3 kg.m2";
const HAND: &str = "{ kind = \"constant_torque\", torque = \"20 mN.m\" }";

pub(super) fn lines() -> Vec<Line> {
    let mut lines: Vec<Line> = ["0", "0.1e-3", "0.3e-3", "1e-3", "2e-3", "3e-3", "5e-3"]
        .map(|damping| {
            line(MOTOR, format!("{} mN.m.s/rad", milli(damping)), "", move |control| both(motor, damping, control))
        })
        .into();
    lines.push(line(MOTOR, "a count a sample asks for all torque from", "", |_| saturating(motor)));
    for (damping, published) in [
        ("0", "two rates 150 to 360 N.m/rad"),
        ("0.01", "two rates 150 to 360 N.m/rad"),
        ("0.03", "two rates 150 to 360 N.m/rad"),
        ("0.1", "uniform falls to 0 above this"),
        ("0.3", "uniform 0, two rates 150 to 360"),
        ("1", "uniform 0, two rates 150 to 360"),
    ] {
        let what = format!("{damping} N.m.s/rad");
        lines.push(line(INERTIA, what, published, move |control| both(inertia, damping, control)));
        // The paper says that the uniform rate's range ends above 0.1 N·m·s/rad.
        lines.last_mut().expect("just added").claims = if ["0.3", "1"].contains(&damping) { "gh" } else { "g" };
    }
    lines.push(line(INERTIA, "a count a sample asks for all torque from", "", |_| saturating(inertia)));
    lines
}

fn milli(damping: &str) -> f64 {
    damping.parse::<f64>().map_or(f64::NAN, |damping| damping * 1e3)
}

/// Returns a motor's scene with this damping, whose velocity is renewed every `every` samples.
fn motor(damping: &str, every: &str) -> Result<Scene, String> {
    axis(
        "hybrid-wall",
        &[
            ("clock.frequency", "100 MHz"),
            ("method.kind", "sampled_wall"),
            ("method.sample_rate", "20 kHz"),
            ("method.velocity_every", every),
            ("method.stiffness_format", "(0,12,4)"),
            ("method.damping_format", "(0,16,4)"),
            ("wall.position", "0.05 rad"),
            ("wall.damping", damping),
            ("hand", HAND),
        ],
    )
}

/// Returns the same scene for an inertia: a mass whose kg, m and N stand for kg·m², rad and N·m.
fn inertia(damping: &str, every: &str) -> Result<Scene, String> {
    axis(
        "impulse-engine",
        &[
            ("device.mass", "2e-3"),
            ("device.damping", "5e-3"),
            ("device.coulomb", "5e-3"),
            ("encoder.resolution", "3.1415927e-4"),
            ("amplifier.full_scale", "20"),
            ("method.kind", "sampled_wall"),
            ("method.sample_rate", "20 kHz"),
            ("method.velocity_every", every),
            ("method.stiffness_format", "(0,24,0)"),
            ("method.damping_format", "(0,24,0)"),
            ("wall.position", "10e-3"),
            ("wall.stiffness", "200"),
            ("wall.damping", damping),
            ("hand.torque", "0.5"),
            ("run.duration", "4 s"),
        ],
    )
}

fn both(device: fn(&str, &str) -> Result<Scene, String>, damping: &str, control: &Control) -> Result<Found, String> {
    let (one, ten) = (device(damping, "1")?, device(damping, "10")?);
    let linear = [(&one, 1), (&ten, 10)].map(|(scene, every)| linear(scene, every));
    let words = [&one, &ten].map(|scene| Stiffest::of(scene, control).map(|found| found.some));
    let share = |of: &[Result<f64, String>; 2]| match of {
        [Ok(one), Ok(ten)] => format!(" ({:.2} of it)", ten / one),
        _ => String::new(),
    };
    let text = |limit: &Result<f64, String>| match limit {
        Ok(limit) => format!("{limit:.4}"),
        Err(reason) => reason.clone(),
    };
    let told = |of: [Result<f64, String>; 2]| format!("{}, two rates {}{}", text(&of[0]), text(&of[1]), share(&of));
    let figures = [&words, &linear].map(|of| of.each_ref().map(|limit| limit.as_ref().map_or(0.0, |limit| *limit)));
    Ok(Found::new(format!("in words {}; linear {}", told(words), told(linear)), figures.as_flattened().to_vec()))
}

/// Returns a stiffness at which the linear loop of two rates ceases to settle, by bisection from 1.
fn linear(scene: &Scene, every: u32) -> Result<f64, String> {
    let damping = scene.wall.damping_nm_s_per_rad;
    let stable = |stiffness: f64| SampledLoop::dual_rate(scene, stiffness, damping, every).spectral_radius() < 1.0;
    let (mut low, mut high) = (1.0, 1.0);
    for (end, wanted, factor) in [(&mut low, true, 0.5), (&mut high, false, 2.0)] {
        let mut sought = std::iter::successors(Some(1.0), |at| Some(at * factor)).take(40);
        *end = sought.find(|at| stable(*at) == wanted).ok_or("none")?;
    }
    while high - low > 1e-6 * (high + low) {
        let middle = 0.5 * (low + high);
        *(if stable(middle) { &mut low } else { &mut high }) = middle;
    }
    Ok(0.5 * (low + high))
}

/// Returns as text the damping at which one count in a sample asks for the full torque, at either rate of the velocity.
fn saturating(device: fn(&str, &str) -> Result<Scene, String>) -> Result<String, String> {
    let from = |every: &str, samples: f64| {
        let scene = device("0", every)?;
        let realised = scene.words().map_err(|error| error.to_string())?.realised;
        let full = realised.torque_quantum_nm * f64::from(1u32 << scene.method.pwm.bits);
        Ok::<_, String>(full * scene.sample_period_s() * samples / realised.count_rad)
    };
    Ok(format!("{:.4} N.m.s/rad, two rates {:.4}", from("1", 1.0)?, from("10", 10.0)?))
}
