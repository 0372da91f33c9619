//! A PHANToM: its scene made ready, its worlds, the host of its operating-system platforms, and its law without a
//! clock.

mod arm_loop;
mod direct;
mod host;
mod sides;
#[cfg(test)]
mod tests;

use arm_loop::ArmLoop;
use direct::ArmDirect;
use host::{COUNTING, Host};
use sides::{FpgaSide, HostSide};

use hpu_datapath::phantom::{PhantomIn, PhantomIo, PhantomIoIn, PhantomLoop, PhantomSharedLoop};
use hpu_plant::arm::{Arm, ArmModel, Transmission, kinematics};
use hpu_signal::{Format, Ports};

use crate::result::columns::{ARM_REALS, ARM_ROW};
use crate::result::outline::{Outline, Rule};
use crate::run::simulation::{Direct, LoopVisitor, Simulation, TheLoop, Wired};
use crate::run::simulation_error::SimulationError;
use crate::world::arm::{ArmPlant, Stops};
use crate::world::arm_world::ArmWorld;
use hpu_scene::SplitMix64;
use hpu_scene::{PhantomLaw, PhantomScene, PhantomWords, Platform, Premium};

/// Apparent mass of the Premium 1.0 at its tip (the maker's figure is "below 75 g").
const APPARENT_KG: f64 = 0.075;
/// Torque at a motor's shaft for full scale of its DAC: 8.5 N at a tip 0.14 m away through a ratio of 7. Assumed.
const MOTOR_FULL_SCALE_NM: f64 = 0.17;
/// Greatest force that the device renders (the maker's figure).
const FORCE_LIMIT_N: f64 = 8.5;

/// The immutable laws of a PHANToM's world.
struct PhantomPlant {
    arm: ArmPlant,
    /// The axis of a drop test.
    axis: usize,
    /// The host, if one computes the force.
    host: Option<Host>,
}

/// A scene of a PHANToM made ready: its words, its wiring, its plant.
pub struct PhantomSimulation<'s> {
    scene: &'s PhantomScene,
    plant: PhantomPlant,
    words: PhantomWords,
    wiring: ArmLoop,
    outline: Outline,
}

impl<'s> PhantomSimulation<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible.
    pub fn new(scene: &'s PhantomScene) -> Result<Self, SimulationError> {
        let words = scene.words().map_err(SimulationError::Scene)?;
        let config = scene.method.config;
        let wiring = if by_host(scene) {
            PhantomIo::new(config.position_width, config.command_width).map(ArmLoop::PhantomIo)
        } else if scene.method.shared {
            PhantomSharedLoop::new(config).map(ArmLoop::PhantomShared)
        } else {
            PhantomLoop::new(config).map(ArmLoop::Phantom)
        };
        let wiring = wiring.map_err(SimulationError::Config)?;
        let plant = plant(scene)?;
        let [first, second, third] = plant.arm.command_nm;
        let commands = vec![
            ("command1", "wall_torque1_nm", first),
            ("command2", "wall_torque2_nm", second),
            ("command3", "wall_torque3_nm", third),
        ];
        let logged = 3 + plant.axis;
        let closed_by = (wiring.wiring().name(), wiring.wiring().nets());
        let outline = Outline::new(scene, (&ARM_ROW, ARM_REALS.len()), closed_by, Rule::Drop(logged));
        // A host's wiring has no net of its own for contact: the command of the joint under test takes its place.
        let contact = outline.net("contact").or_else(|| Some(outline.net("command1")? + plant.axis));
        let outline = Outline { commands, judged: vec![plant.axis, logged], contact, ..outline };
        Ok(Self { scene, plant, words, wiring, outline })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s PhantomScene {
        self.scene
    }

    /// Returns the scene's words.
    pub fn words(&self) -> &PhantomWords {
        &self.words
    }

    /// Returns the angle of one count of each joint.
    pub fn count_rad(&self) -> [f64; 3] {
        self.plant.arm.count_rad
    }

    /// Returns the apparent mass at the tip, if the model has one in place of its links' inertias.
    pub fn apparent_kg(&self) -> Option<f64> {
        (self.scene.drop.premium == Premium::OneZero).then_some(APPARENT_KG)
    }

    /// Returns the constant inputs of the datapath, pins at 0.
    pub fn input(&self) -> PhantomIn<i64> {
        let PhantomWords { low, high, room, stiffness, period, .. } = self.words;
        PhantomIn {
            x_low: low,
            x_high: high,
            y_low: low,
            y_high: high,
            z_low: low,
            z_high: high,
            room,
            stiffness,
            period,
            ..PhantomIn::build(|| 0)
        }
    }
}

/// Returns whether the force is computed outside the FPGA: by a host, or in floats where the scene leaves the words
/// out.
fn by_host(scene: &PhantomScene) -> bool {
    scene.platform.is_host() || scene.model.law != PhantomLaw::Words
}

/// Returns the edges that the FPGA's law takes from a sample to the command: to its capture, and through the one
/// multiplier.
fn latency(scene: &PhantomScene) -> u64 {
    u64::from(scene.method.config.delay) + if scene.method.shared { 32 } else { 0 }
}

/// Returns the arm of a scene. Friction and transmission as felt at the tip become torques and stiffnesses about the
/// joints, by the levers that the joints have at the origin.
fn model(scene: &PhantomScene) -> ArmModel {
    let (drop, rungs) = (&scene.drop, &scene.model);
    let flexible = rungs.transmission_n_per_m > 0.0;
    // The part of the apparent mass that a flexible transmission leaves on the motors' side is taken off the tip.
    let behind_kg = if flexible && drop.premium == Premium::OneZero { APPARENT_KG * rungs.motor_share } else { 0.0 };
    let arm = match drop.premium {
        Premium::OneZero => {
            let massless = ArmModel::premium_1_0().with_tip_mass(-APPARENT_KG);
            ArmModel { lengths_m: drop.lengths_m, ..massless }.with_tip_mass(APPARENT_KG - behind_kg)
        }
        Premium::OneFive => ArmModel::premium_1_5(),
    };
    // The arm is balanced: only the weight pulls.
    let mut model = arm.balanced().with_tip_mass(drop.weight_n / drop.gravity_m_per_s2);
    let levers_m = [model.lengths_m[0], model.lengths_m[0], model.lengths_m[1]];
    let square = |at_tip: f64| levers_m.map(|lever_m| at_tip * lever_m * lever_m);
    model.viscous_nm_s_per_rad = square(drop.damping_n_s_per_m);
    model.coulomb_nm = levers_m.map(|lever_m| if rungs.friction { drop.coulomb_n * lever_m } else { 0.0 });
    model.gravity_m_per_s2 = [0.0; 3];
    model.gravity_m_per_s2[drop.axis.index()] = -drop.gravity_m_per_s2;
    model.amplifier_s = rungs.amplifier_lag_s;
    if rungs.tested_joint_only {
        model.free = [0, 1, 2].map(|joint| joint == drop.axis.index());
    }
    if flexible {
        if drop.premium == Premium::OneZero {
            model.rotor_kg_m2 = square(behind_kg);
        }
        let (stiffness, damping) = (square(rungs.transmission_n_per_m), square(rungs.transmission_n_s_per_m));
        model.transmission = [0, 1, 2].map(|joint| {
            Some(Transmission { stiffness_nm_per_rad: stiffness[joint], damping_nm_s_per_rad: damping[joint] })
        });
    }
    model
}

fn plant(scene: &PhantomScene) -> Result<PhantomPlant, SimulationError> {
    let model = model(scene);
    let config = &scene.method.config;
    let count_rad = config.turns.map(|turn| 2.0 * std::f64::consts::PI * f64::from(turn.num) / f64::from(turn.den));
    let full = (1i64 << (config.command_width - 1)) as f64;
    let ratios: [f64; 3] = match scene.drop.premium {
        Premium::OneZero => [115.0 / 15.0, 7.0, 7.0],
        Premium::OneFive => [13.3, 11.2, 11.2],
    };
    let command_nm = ratios.map(|ratio| MOTOR_FULL_SCALE_NM * ratio / full);

    // No two releases are the same: the place within a count, the speed, and the host's sample instants differ.
    let mut random = SplitMix64::new(scene.run.seed.wrapping_mul(1_000_003).wrapping_add(scene.drop.trial));
    let mut unit = || random.below(1 << 53) as f64 / (1u64 << 53) as f64;
    let start_rad = count_rad.map(|count_rad| count_rad * (0.05 + 0.9 * unit()));
    let mut start_rad_per_s = [0.0; 3];
    let axis = scene.drop.axis.index();
    let lever_m = [model.lengths_m[0], model.lengths_m[0], model.lengths_m[1]][axis];
    start_rad_per_s[axis] = (RELEASE_M_PER_S * (2.0 * unit() - 1.0) - scene.drop.speed_m_per_s) / lever_m;
    let period = scene.period_clocks();
    // The FPGA's own samples begin with its reset.
    let by_itself = !scene.platform.is_host() && scene.model.law == PhantomLaw::Floats;
    let first = if by_itself { 1 } else { 1 + (unit() * period as f64) as u64 };

    let edges = |seconds: f64| scene.clock.edges(seconds);
    let ideal = scene.model.law == PhantomLaw::Ideal;
    let irregular = scene.platform == Platform::Pmos1 && !ideal;
    let host = by_host(scene).then(|| Host {
        lengths_m: model.lengths_m,
        count_rad,
        command_nm,
        commands: [-full, full - 1.0],
        position: Format::unsigned(config.position_width),
        distance_m: scene.room.distance_m,
        walls: scene.room.walls,
        stiffness_n_per_m: scene.room.stiffness_n_per_m,
        force_limit_n: FORCE_LIMIT_N,
        ideal,
        period,
        first,
        delay: if scene.platform.is_host() {
            (scene.model.delay_samples * period as f64).round() as u64 + edges(scene.model.latency_s)
        } else if ideal {
            0
        } else {
            latency(scene)
        },
        jitter: if irregular { edges(scene.irregularity.jitter_s) } else { 0 },
        missed: if irregular { (scene.irregularity.missed * (1u64 << 32) as f64) as u64 } else { 0 },
        seed: random.next_u64(),
    });
    let arm = Arm::new(model, scene.clock.period_s()).map_err(|error| SimulationError::Arm(error.to_string()))?;
    let stops = stops(scene, model.lengths_m, count_rad);
    let stepping = scene.model.solver.method().map(|method| (method, scene.step_clocks()));
    let arm = ArmPlant { arm, stepping, count_rad, command_nm, start_rad, start_rad_per_s, stops };
    Ok(PhantomPlant { arm, axis, host })
}

/// Returns the reasons for aborting a drop test, as a function of the counts.
fn stops(scene: &PhantomScene, lengths_m: [f64; 2], count_rad: [f64; 3]) -> Stops {
    let half = 1i64 << (scene.method.config.depth_width - 1);
    let limited = scene.drop.premium == Premium::OneFive;
    let axis = scene.drop.axis.index();
    // A thrown tip may reach the opposite wall; a released tip may not.
    let opposite_m = if scene.drop.speed_m_per_s == 0.0 { scene.room.distance_m } else { f64::INFINITY };
    Box::new(move |counts| {
        let angles_rad: [f64; 3] = [0, 1, 2].map(|joint| counts[joint] as f64 * count_rad[joint]);
        if counts.iter().any(|count| !(-half..half).contains(count)) {
            Some("a joint left the tables of sines: the datapath says invalid, torques are zero")
        } else if limited && !kinematics::within_limits_1_5(angles_rad) {
            Some("a joint left its limits")
        } else if kinematics::is_singular(lengths_m, angles_rad) {
            Some("the arm is nearly singular")
        } else if kinematics::tip_m(lengths_m, angles_rad)[axis] > opposite_m {
            Some("the tip reached the opposite wall")
        } else {
            None
        }
    })
}

/// The greatest speed at which the solenoid releases the tip.
const RELEASE_M_PER_S: f64 = 1e-3;

impl Simulation for PhantomSimulation<'_> {
    fn outline(&self) -> &Outline {
        &self.outline
    }
}

impl Wired for PhantomSimulation<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        TheLoop::Device(self.wiring.wiring())
    }

    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visitor: V) -> V::Out {
        let arm = &self.plant.arm;
        match &self.wiring {
            ArmLoop::Phantom(wiring) => visitor.visit(wiring, ArmWorld::new(arm, FpgaSide), self.input()),
            ArmLoop::PhantomShared(wiring) => visitor.visit(wiring, ArmWorld::new(arm, FpgaSide), self.input()),
            ArmLoop::PhantomIo(wiring) => {
                let host = self.plant.host.as_ref().expect("a wiring around a host");
                visitor.visit(wiring, ArmWorld::new(arm, HostSide::new(host)), PhantomIoIn::build(|| 0))
            }
        }
    }

    crate::run::simulation::wired_alike!();

    fn direct(&self) -> Option<Box<dyn Direct + '_>> {
        if self.scene.model.law == PhantomLaw::Words {
            return None;
        }
        let (_, step) = self.plant.arm.stepping?;
        let (period, edge_s) = (self.scene.period_clocks(), self.scene.clock.period_s());
        // A command is held for a period once it is there. In the ideal law it is there at once.
        let late = if self.scene.model.law == PhantomLaw::Ideal { 0 } else { COUNTING + latency(self.scene) };
        let age_s = (late as f64 + 0.5 * period as f64) * edge_s;
        let follows = (!self.scene.platform.is_host() && step > period).then_some(age_s);
        Some(Box::new(ArmDirect { plant: &self.plant, step, edge_s, follows }))
    }
}
