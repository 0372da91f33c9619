//! The switches of the crank's control in a run: their number, the leaps of the drive, and the energy that they cost.

use hpu_cosim::scene::GimbalScene;
use hpu_cosim::{RADIUS, Simulation};
use hpu_plant::arm::Gimbal;
use hpu_signal::{Cycle, Observe};

use crate::map::{SwitchWatch, Switching};

/// Watches the switches of a run; see [`Observe`].
#[derive(Clone, PartialEq, Debug)]
pub struct Switches {
    gimbal: Gimbal,
    command_nm: f64,
    count_rad: f64,
    /// Indices of the nets `mode`, `drive3` and `count3`.
    nets: [usize; 3],
    /// The edge from which on the run is judged.
    judged_from: u64,
    /// The words of mode and drive, and the edge of the last change of the mode.
    before: Option<[i64; 2]>,
    changed: u64,
    /// The crank's angle and torque in the row before.
    row: Option<[f64; 2]>,
    /// The number of switches, in the whole run.
    pub count: u64,
    /// Their number in the last three tenths.
    pub judged: u64,
    /// The greatest leap of the crank's drive at a switch, as a force in N at the tip of a segment that rests.
    pub bump_n: f64,
    /// Work of the crank's drive on the crank in the last three tenths, in J, to the row.
    pub work_j: f64,
}

/// Index of the torque of the crank's servo in a row of a gimbal.
const TORQUE: usize = 8;

impl Switches {
    /// Returns the watch of a simulation's run.
    pub fn of(scene: &GimbalScene, simulation: &(impl Simulation + ?Sized)) -> Self {
        let nets = simulation.nets();
        let index = |name| nets.iter().position(|net| net.name == name).expect("a net of the gimbal's loops");
        let full = f64::from(1u32 << (scene.method.config.impedance.drive_width - 1));
        Self {
            gimbal: scene.gimbal,
            command_nm: scene.crank_servo.stall_nm / full,
            count_rad: scene.count_rad(),
            nets: ["mode", "drive3", "count3"].map(index),
            judged_from: simulation.edges() - simulation.edges() * 3 / 10,
            before: None,
            changed: u64::MAX - 1,
            row: None,
            count: 0,
            judged: 0,
            bump_n: 0.0,
            work_j: 0.0,
        }
    }

    /// Returns the energy that the drive gives the crank per switch, in J, in the last three tenths; `None` without a
    /// switch there. At rest a drive gives none, so it is what the switching costs.
    pub fn energy_j(&self) -> Option<f64> {
        (self.judged > 0).then(|| self.work_j / self.judged as f64)
    }
}

impl SwitchWatch for Switches {
    fn switching(&self) -> Switching {
        Switching { count: self.count, bump_n: self.bump_n, switch_j: self.energy_j() }
    }
}

impl Observe for Switches {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        let [mode, drive, count] = self.nets.map(|net| words[net]);
        if let Some([mode_before, drive_before]) = self.before {
            // The drive of the other control is there one edge after the mode.
            if cycle.0 == self.changed + 1 {
                let lever_m = self.gimbal.lever_m(&(count as f64 * self.count_rad)).abs();
                let leap_nm = (drive - drive_before).abs() as f64 * self.command_nm;
                if leap_nm > 0.0 {
                    self.bump_n = self.bump_n.max(leap_nm / lever_m);
                }
            }
            if mode != mode_before {
                self.changed = cycle.0;
                self.count += 1;
                self.judged += u64::from(cycle.0 >= self.judged_from);
            }
        }
        self.before = Some([mode, drive]);
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        let Some(crank_rad) = self.gimbal.crank_rad(values[RADIUS]) else { return };
        if let Some([angle_rad, torque_nm]) = self.row.filter(|_| cycle.0 > self.judged_from) {
            self.work_j += torque_nm * (crank_rad - angle_rad);
        }
        self.row = Some([crank_rad, values[TORQUE]]);
    }
}
