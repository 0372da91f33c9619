//! The arm of a PHANToM.

use hpu_chart::{self as chart, Picture};
use hpu_cosim::scene::{PhantomLaw, PhantomScene};
use hpu_cosim::{EnergyAudit, PhantomSimulation, Simulation, Summary, Trace};
use hpu_page::Page;
use hpu_signal::{Notation, Signal};
use serde_json::{Value, json};

use super::device::{Shown, named, of_words};
use super::simulate::Ran;
use crate::parameters;
use crate::units::si;

impl Shown for PhantomSimulation<'_> {
    fn lines(&self, page: &mut Page, ran: &Ran) {
        page.line("platform", platform(self.scene()));
        page.line("motion", motion(self.scene(), &ran.trace));
        let missed = self.words().stiffness_miss.as_ref().map(|miss| parameters::missed(miss, None));
        of_words(page, words(self, ran.notation), missed);
    }

    fn realised(&self) -> Value {
        let (scene, words) = (self.scene(), self.words());
        let formats = &scene.method.config.formats;
        json!({
            "wall_position_m": formats.position.to_f64(words.high),
            "stiffness_n_per_m": formats.stiffness.to_f64(words.stiffness),
            "stiffness_missed": words.stiffness_miss.as_ref().map(parameters::missed_object),
            "sample_rate_hz": scene.clock.frequency_hz() as f64 / words.period as f64,
            "count_rad": self.count_rad(),
            "torque_quantum_nm": self.commands().iter().map(|command| command.2).collect::<Vec<_>>(),
            "apparent_mass_kg": self.apparent_kg(),
        })
    }

    fn nets(&self) -> Vec<Signal> {
        named(Simulation::nets(self), &chart::DROP_NETS)
    }

    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
        chart::drop_pictures(self, trace, summary, command)
    }

    fn dissipated(&self, energy: &EnergyAudit) -> String {
        let [viscous, coulomb, transmission] =
            [energy.viscous_j, energy.coulomb_j, energy.transmission_j].map(|joules| si(joules, "J"));
        format!("viscous friction {viscous}, Coulomb friction {coulomb}, the transmission {transmission}")
    }
}

/// Returns the platform that computes the force, with its rate.
fn platform(scene: &PhantomScene) -> String {
    let (name, period) = (scene.platform.name(), scene.period_clocks());
    let rate = si(scene.clock.frequency_hz() as f64 / period as f64, "Hz");
    let how = if scene.model.law == PhantomLaw::Ideal {
        "the law in floats on the true position".to_string()
    } else if scene.model.law == PhantomLaw::Floats && !scene.platform.is_host() {
        "the law in floats on the counts".to_string()
    } else if scene.platform.is_host() {
        let (samples, latency_s) = (scene.model.delay_samples, scene.model.latency_s);
        let late = if latency_s > 0.0 { format!(" and {}", si(latency_s, "s")) } else { String::new() };
        let unit = if samples == 1.0 { "sample" } else { "samples" };
        format!("floating point, commands late by {samples} {unit}{late}")
    } else {
        let kind = if scene.method.shared { "one multiplier" } else { "all in parallel" };
        format!("the datapath, {kind}")
    };
    format!("{name}: every {period} clocks ({rate}), {how}")
}

/// Returns the final and the deepest position of the tip.
fn motion(scene: &PhantomScene, trace: &Trace) -> String {
    let axis = scene.drop.axis;
    format!(
        "tip ends at {} = {}, deepest {} beyond the wall",
        axis.name(),
        si(trace.last(axis.index()).unwrap_or(0.0), "m"),
        si((-scene.room.distance_m - trace.least(axis.index())).max(0.0), "m")
    )
}

/// Returns the stiffness and the walls that the words realise.
fn words(simulation: &PhantomSimulation, notation: Notation) -> [String; 3] {
    let (scene, words) = (simulation.scene(), simulation.words());
    let formats = &scene.method.config.formats;
    [
        format!(
            "stiffness {} of {} is {}, asked {}",
            words.stiffness,
            notation.of(formats.stiffness),
            si(formats.stiffness.to_f64(words.stiffness), "N/m"),
            si(scene.room.stiffness_n_per_m, "N/m")
        ),
        format!(
            "walls at {} of {}: {}, asked {}",
            words.high,
            notation.of(formats.position),
            si(formats.position.to_f64(words.high), "m"),
            si(scene.room.distance_m, "m")
        ),
        realised(simulation),
    ]
}

/// Returns the size of a count of each encoder and of each DAC, and the apparent mass.
fn realised(simulation: &PhantomSimulation) -> String {
    let counts = simulation.count_rad().map(|count_rad| si(count_rad, "rad")).join(", ");
    let torques: Vec<String> = simulation.commands().iter().map(|command| si(command.2, "N.m")).collect();
    let mass = simulation
        .apparent_kg()
        .map_or(String::new(), |mass_kg| format!("; apparent mass {} at the tip", si(1e3 * mass_kg, "g")));
    format!("joints 1, 2, 3: a count is {counts}; a DAC count is {}{mass}", torques.join(", "))
}
