//! A loop behind field-oriented control.

use hpu_chart::{self as chart, Picture};
use hpu_cosim::scene::{Setup, Units};
use hpu_cosim::{FocSimulation, Simulation, Summary, Trace, number};
use hpu_page::Page;
use hpu_signal::{Notation, Signal};
use serde_json::{Value, json};

use crate::parameters;
use crate::run::axis::motion;
use crate::run::device::{Shown, named, of_words};
use crate::run::dut::starts;
use crate::run::simulate::Ran;
use crate::units::si;

impl Shown for FocSimulation<'_> {
    fn lines(&self, page: &mut Page, ran: &Ran) {
        let scene = self.scene();
        if ran.summary.verdict.is_some() {
            page.line("motion", motion("", (scene.units(), 1.0), Shown::wall(self).map(|wall| wall.0), &ran.trace));
        }
        let missed = self.words().stiffness_miss.as_ref();
        of_words(
            page,
            words(self, ran.notation),
            missed.map(|miss| parameters::missed(miss, scene.stiffness_format())),
        );
        starts(page, &scene.pmsm.sensors, &ran.summary.starts);
    }

    fn realised(&self) -> Value {
        let (scene, words) = (self.scene(), self.words());
        let frequency_hz = scene.clock.frequency_hz() as f64;
        json!({
            "count_rad": words.count_rad,
            "current_unit_a": words.unit[0],
            "torque_quantum_nm": words.unit[1],
            "stiffness_nm_per_rad": scene.wall.is_some().then_some(words.realised[0]),
            "stiffness_missed": words.stiffness_miss.as_ref().map(parameters::missed_object),
            "damping_nm_s_per_rad": scene.wall.is_some().then_some(words.realised[1]),
            "sample_rate_hz": frequency_hz / words.period as f64,
            "pwm_rate_hz": 0.5 * frequency_hz / f64::from(words.config.foc.steps),
        })
    }

    fn nets(&self) -> Vec<Signal> {
        named(Simulation::nets(self), &chart::FOC_NETS)
    }

    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
        chart::foc_pictures(self, trace, summary, command)
    }

    fn told_in(&self) -> Option<(Units, f64)> {
        Some((self.scene().units(), 1.0))
    }

    fn wall(&self) -> Option<(f64, f64)> {
        self.scene().wall.as_ref().map(|wall| (wall.position_rad, wall.stiffness_nm_per_rad))
    }
}

fn words(simulation: &FocSimulation, notation: Notation) -> Vec<String> {
    let (scene, words) = (simulation.scene(), simulation.words());
    let (method, foc) = (&scene.method, &words.config.foc);
    let mut lines = Vec::new();
    if let Some(wall) = &scene.wall {
        let gain = |name: &str, format: hpu_signal::Format, word, realised, asked, unit| {
            let (realised, asked) = (si(realised, unit), si(asked, unit));
            format!("{name} {} of {} is {realised}, asked {asked}", format.value(word), notation.of(format))
        };
        let [stiffness, damping] = words.gains;
        let (k, b) = (wall.stiffness_nm_per_rad, wall.damping_nm_s_per_rad);
        lines.push(gain("stiffness", method.stiffness_format, stiffness, words.realised[0], k, "N.m/rad"));
        lines.push(gain("damping", method.damping_format, damping, words.realised[1], b, "N.m.s/rad"));
        let surface = scene.wall_count() as f64 * words.count_rad;
        lines.push(format!("wall at {}, asked {}", si(surface, "rad"), si(wall.position_rad, "rad")));
    }
    let frequency_hz = scene.clock.frequency_hz() as f64;
    let [proportional, integral] = words.current_gains.map(|word| number(word as f64 * foc.gain.lsb()));
    lines.extend([
        format!(
            "a count is {}, a unit of current {} is {}",
            si(words.count_rad, "rad"),
            si(words.unit[0], "A"),
            si(words.unit[1], "N.m")
        ),
        format!("currents' gains {proportional} and {integral} of {}", notation.of(foc.gain)),
        format!("period {} clocks is {}", words.period, si(frequency_hz / words.period as f64, "Hz")),
        format!(
            "modulator 2 x {} clocks is {}, dead time {}, currents {} clocks after the valley",
            foc.steps,
            si(0.5 * frequency_hz / f64::from(foc.steps), "Hz"),
            si(f64::from(foc.dead_time) / frequency_hz, "s"),
            foc.sample_delay
        ),
    ]);
    lines
}
