//! The segment on a gimbal.

use hpu_chart::{self as chart, Picture};
use hpu_cosim::scene::{GimbalScene, Shear};
use hpu_cosim::{ERROR, EnergyAudit, FORCE, GimbalSimulation, RADIUS, Simulation, Summary, Trace, stress_error_pa};
use hpu_datapath::fractional_difference::memory_bound;
use hpu_page::Page;
use hpu_signal::{Notation, Signal};
use serde_json::{Value, json};

use super::device::{Shown, named, of_words};
use super::simulate::Ran;
use crate::parameters;
use crate::units::si;

impl Shown for GimbalSimulation<'_> {
    fn lines(&self, page: &mut Page, ran: &Ran) {
        page.line("device", device(self.scene()));
        page.line("motion", motion(&ran.trace));
        if let Some(shear) = &self.scene().shear {
            page.line("shear", sheared(self, shear, &ran.trace));
        }
        let missed = self.words().stiffness_miss.as_ref().map(|miss| parameters::missed(miss, None));
        of_words(page, words(self, ran.notation), missed);
    }

    fn realised(&self) -> Value {
        let (scene, words) = (self.scene(), self.words());
        let mut realised = json!({
            "stiffness_n_per_m": stiffness_n_per_m(self),
            "stiffness_missed": words.stiffness_miss.as_ref().map(parameters::missed_object),
            "sample_rate_hz": scene.clock.frequency_hz() as f64 / words.period as f64,
            "count_rad": scene.count_rad(),
            "force_lsb_n": scene.force_lsb_n(),
            "length_lsb_m": scene.method.config.gimbal.length.lsb(),
            "torque_quantum_nm": self.commands().iter().map(|command| command.2).collect::<Vec<_>>(),
            "assumed": assumed(scene),
        });
        if let Some(shear) = &scene.shear {
            realised["shear"] = json!({
                "order_num": shear.order[0],
                "order_den": shear.order[1],
                "viscosity_pa_s": scene.realised_viscosity(words),
                "gain": words.shear_gain,
                "memory": shear.memory,
                "left_out_pa": left_out_pa(self, shear),
            });
        }
        realised
    }

    fn nets(&self) -> Vec<Signal> {
        named(Simulation::nets(self), &chart::GIMBAL_NETS)
    }

    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
        chart::gimbal_pictures(self, trace, summary, command)
    }

    fn dissipated(&self, energy: &EnergyAudit) -> String {
        let [viscous, coulomb] = [energy.viscous_j, energy.coulomb_j].map(|joules| si(joules, "J"));
        format!("the servos' back EMF and friction {viscous}, Coulomb friction {coulomb}")
    }
}

/// The parameters that the paper leaves out.
const ASSUMED: [&str; 11] = [
    "device.mass",
    "device.offset",
    "device.length",
    "tilt_servo.inertia",
    "crank_servo.inertia",
    "tilt_servo.coulomb",
    "crank_servo.coulomb",
    "force_sensor.noise",
    "switch.on",
    "finger.stiffness",
    "finger.damping",
];

/// The parameters of shear that the paper leaves out.
const ASSUMED_OF_SHEAR: [&str; 4] = ["shear.order", "shear.viscosity", "shear.layer", "shear.skin"];

/// Returns the assumed parameters of a scene.
fn assumed(scene: &GimbalScene) -> Vec<&'static str> {
    let of_shear = scene.shear.iter().flat_map(|_| ASSUMED_OF_SHEAR);
    ASSUMED.into_iter().chain(of_shear).collect()
}

fn device(scene: &GimbalScene) -> String {
    let [least_m, most_m] = scene.gimbal.radii_m();
    format!(
        "a segment of {} on a gimbal, radius {} to {}; the paper leaves out {}: assumed",
        si(1e3 * scene.gimbal.mass_kg, "g"),
        si(least_m, "m"),
        si(most_m, "m"),
        assumed(scene).join(", ")
    )
}

/// Returns the motion: how far from the target the tip was, and the greatest force.
fn motion(trace: &Trace) -> String {
    format!(
        "radius ends at {}, at most {} from the target; the finger pushes with at most {}",
        si(trace.last(RADIUS).unwrap_or(0.0), "m"),
        si(trace.greatest(ERROR), "m"),
        si(trace.greatest(FORCE), "N")
    )
}

/// Returns a bound of the stress, in Pa, that the samples before the memory would add.
fn left_out_pa(simulation: &GimbalSimulation, shear: &Shear) -> f64 {
    let scene = simulation.scene();
    let [height, _, roll] = scene.target.bounds();
    let most_m = (scene.gimbal.radii_m()[0] + height[1])
        * roll.map(|roll_rad| libm::sin(roll_rad).abs()).into_iter().fold(0.0, f64::max);
    let gain = simulation.words().shear_gain as f64 * scene.method.config.shear.gain.lsb();
    shear.stress_pa(memory_bound(shear.order(), shear.memory) * gain * most_m)
}

/// Returns the stress: its error over the whole run, its order, gain and memory.
fn sheared(simulation: &GimbalSimulation, shear: &Shear, trace: &Trace) -> String {
    let [mean_pa, deviation_pa] = stress_error_pa(trace);
    let (scene, words) = (simulation.scene(), simulation.words());
    format!(
        "stress misses by {} in the mean, standard deviation {}; order {}/{}, viscosity {} (gain {} of {}), asked {}; \
         {} samples count, and those before would add at most {}",
        si(mean_pa, "Pa"),
        si(deviation_pa, "Pa"),
        shear.order[0],
        shear.order[1],
        si(scene.realised_viscosity(words).unwrap_or(0.0), "Pa.s^order"),
        words.shear_gain,
        scene.method.config.shear.gain,
        si(shear.viscosity, "Pa.s^order"),
        shear.memory,
        si(left_out_pa(simulation, shear), "Pa")
    )
}

fn stiffness_n_per_m(simulation: &GimbalSimulation) -> f64 {
    let (scene, config) = (simulation.scene(), &simulation.scene().method.config);
    let lsb = config.impedance.stiffness.lsb() * scene.force_lsb_n() / config.gimbal.length.lsb();
    simulation.words().stiffness as f64 * lsb
}

/// Returns the gains that the words realise.
fn words(simulation: &GimbalSimulation, notation: Notation) -> [String; 2] {
    let (scene, words) = (simulation.scene(), simulation.words());
    let config = &scene.method.config;
    [
        format!(
            "stiffness {} of {} is {}, asked {}",
            words.stiffness,
            notation.of(config.impedance.stiffness),
            si(stiffness_n_per_m(simulation), "N/m"),
            si(scene.stiffness_n_per_m, "N/m")
        ),
        format!(
            "a position of a servo is {}; a force LSB {}, a length LSB {}",
            si(scene.count_rad(), "rad"),
            si(scene.force_lsb_n(), "N"),
            si(config.gimbal.length.lsb(), "m")
        ),
    ]
}
