//! An axis whose words are hpu's own.

use hpu_chart::{self as chart, Picture, run_pictures};
use hpu_cosim::AxisLoop;
use hpu_cosim::scene::{LawMethod, Loop, SampledWallMethod, Scene, Setup, Units};
use hpu_cosim::{ANGLE, AxisSimulation, Simulation, Summary, Trace};
use hpu_page::Page;
use hpu_signal::{Notation, Signal};
use serde_json::{Value, json};

use super::device::{Shown, named, of_words};
use super::simulate::Ran;
use crate::parameters;
use crate::run::pictures::chart_run;
use crate::units::{error_percent, si};

/// The index of the torque or force of its actuator.
const TORQUE: usize = 3;

impl Shown for AxisSimulation<'_> {
    fn lines(&self, page: &mut Page, ran: &Ran) {
        if ran.summary.verdict.is_some() {
            let scene = self.scene();
            let who = scene.network.as_deref().map_or(String::new(), |network| format!("{} ", network.wall_name()));
            let told_in = (scene.units(), scene.scale());
            page.line("motion", motion(&who, told_in, Shown::wall(self).map(|wall| wall.0), &ran.trace));
        }
        let missed = self.words().realised.stiffness_miss.as_ref();
        let missed = missed.map(|miss| parameters::missed(miss, Some("method.stiffness_format")));
        of_words(page, words(self, ran.notation), missed);
    }

    fn realised(&self) -> Value {
        let realised = self.words().realised.in_units(self.scene().scale());
        json!({
            "torque_quantum_nm": realised.torque_quantum_nm,
            "count_rad": realised.count_rad,
            "wall_position_rad": realised.wall_position_rad,
            "stiffness_nm_per_rad": realised.stiffness_nm_per_rad,
            "stiffness_error": realised.stiffness_error,
            "stiffness_missed": realised.stiffness_miss.as_ref().map(parameters::missed_object),
            "damping_nm_s_per_rad": realised.damping_nm_s_per_rad,
            "sample_rate_hz": realised.sample_rate_hz,
            "filter_corner_hz": filter(self.scene()).map(|(_, corner_hz)| corner_hz),
        })
    }

    fn nets(&self) -> Vec<Signal> {
        named(Simulation::nets(self), chart::nets(self.scene()))
    }

    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
        run_pictures(&chart_run(self, trace, summary, command))
    }

    fn told_in(&self) -> Option<(Units, f64)> {
        Some((self.scene().units(), self.scene().scale()))
    }

    fn wall(&self) -> Option<(f64, f64)> {
        let Scene { wall, target, .. } = self.scene();
        target.is_none().then_some((wall.position_rad, wall.stiffness_nm_per_rad))
    }

    fn axis(&self) -> Option<&AxisSimulation<'_>> {
        Some(self)
    }
}

/// Tells where an axis ends, and how far and hard it went, in units of which one of the trace is so many.
pub(super) fn motion(who: &str, (units, scale): (Units, f64), wall_rad: Option<f64>, trace: &Trace) -> String {
    let peak = trace.greatest(ANGLE);
    let depth = wall_rad.map_or(String::new(), |wall_rad| {
        format!(", {} into the wall", si(scale * (peak - wall_rad).max(0.0), units.position))
    });
    format!(
        "{who}ends at {}, peak {}{depth}, {} up to {}, seen every {}",
        si(scale * trace.last(ANGLE).unwrap_or(0.0), units.position),
        si(scale * peak, units.position),
        if units.effort == "N" { "force" } else { "torque" },
        si(trace.greatest_size(TORQUE) / scale.abs(), units.effort),
        si(trace.interval_s() / trace.every() as f64, "s")
    )
}

fn words(simulation: &AxisSimulation, notation: Notation) -> Vec<String> {
    let (scene, words) = (simulation.scene(), simulation.words());
    let (units, scale) = (scene.units(), scene.scale());
    let (realised, asked) = (words.realised.in_units(scale), scene.written_wall());
    let (a, at) = match scene.network.as_deref() {
        Some(network) => ("one", format!(" at the {}", network.wall_name())),
        None => ("a", String::new()),
    };
    let method = &scene.method;
    let [spring, damper, surface] = match scene.target {
        Some(_) => ["kp", "kd", "target begins"],
        None => ["stiffness", "damping", "wall"],
    };
    let mut lines = vec![
        format!(
            "{spring} {} of {} is {}, asked {}: {}",
            method.stiffness_format.value(words.stiffness),
            notation.of(method.stiffness_format),
            si(realised.stiffness_nm_per_rad, units.stiffness),
            si(asked.stiffness_nm_per_rad, units.stiffness),
            error_percent(realised.stiffness_error)
        ),
        format!(
            "{damper} {} of {} is {}, asked {}: {}",
            method.damping_format.value(words.damping),
            notation.of(method.damping_format),
            si(realised.damping_nm_s_per_rad, units.damping),
            si(asked.damping_nm_s_per_rad, units.damping),
            error_percent(realised.damping_error)
        ),
        format!(
            "{surface} at {}, asked {}; {a} count is {}{at}, a PWM count {}",
            si(realised.wall_position_rad, units.position),
            si(asked.position_rad, units.position),
            si(realised.count_rad, units.position),
            si(realised.torque_quantum_nm, units.effort)
        ),
        format!("period {} clocks is {}", words.period, si(realised.sample_rate_hz, "Hz")),
    ];
    lines.extend(controller(simulation, notation));
    lines.extend(filter(scene).map(|(wall, corner_hz)| {
        let of = match (wall.section(scene.sample_period_s()), wall.weight(scene.sample_period_s())) {
            (Some(([b0, a1, a2], _)), _) => format!("B0 {b0}, A1 {a1}, A2 {a2} / 2^30"),
            (None, (word, frac)) => format!("weight {word} / 2^{frac}"),
        };
        let asked = wall.corner_hz.map(|hz| format!(", asked {}", si(hz, "Hz"))).unwrap_or_default();
        format!("velocity filter of {of} is a corner of {}{asked}", si(corner_hz, "Hz"))
    }));
    lines
}

/// Returns the lines on the words of a controller beside its proportional and its derivative gain.
fn controller(simulation: &AxisSimulation, notation: Notation) -> Vec<String> {
    let (Some(AxisLoop::PositionPid(wiring)), Loop::Law(LawMethod::PositionPid(asked))) =
        (simulation.axis_loop(), &simulation.scene().method.kind)
    else {
        return Vec::new();
    };
    let (scene, config) = (simulation.scene(), wiring.law().config());
    let (units, scale, realised) = (scene.units(), scene.scale(), &simulation.words().realised);
    let (quantum, square) = (realised.torque_quantum_nm / scale.abs(), scale * scale);
    let unit = realised.torque_quantum_nm / realised.count_rad / square;
    let (format, period_s) = (config.integral_format, scene.sample_period_s());
    let ki = format.to_f64(config.integral.into()) * unit / period_s;
    let of = asked.integral_nm_per_rad_s / square;
    let error = if of == 0.0 { 0.0 } else { ki / of - 1.0 };
    let si_unit = format!("{}/s", units.stiffness);
    let mut lines = vec![
        format!(
            "ki {} of {} is {}, asked {}: {}",
            format.value(config.integral.into()),
            notation.of(format),
            si(ki, &si_unit),
            si(of, &si_unit),
            error_percent(error)
        ),
        format!(
            "clamp {} PWM counts is {}; beyond it the sum {}",
            config.limit,
            si(f64::from(config.limit) * quantum, units.effort),
            match config.back_calculation {
                true => format!("gives back 2^-{} of what is cut off in a sample", config.back),
                false => "stands still".into(),
            }
        ),
    ];
    if config.feed_forward > 0 {
        let frac = scene.method.damping_format.frac();
        let ahead = f64::from(config.feed_forward) * 0.5f64.powi(frac) * unit * period_s;
        let of = asked.feed_forward_nm_s_per_rad / square;
        let [ahead, of, error] = [si(ahead, units.damping), si(of, units.damping), error_percent(ahead / of - 1.0)];
        lines.push(format!("feed_forward {} / 2^{frac} is {ahead}, asked {of}: {error}", config.feed_forward));
    }
    lines
}

/// Returns the wall whose velocity goes through a low pass that has a corner, and the corner that its words have.
fn filter(scene: &Scene) -> Option<(&SampledWallMethod, f64)> {
    let Loop::Law(LawMethod::SampledWall(wall)) = &scene.method.kind else { return None };
    Some((wall, wall.realised_corner_hz(scene.sample_period_s())?))
}
