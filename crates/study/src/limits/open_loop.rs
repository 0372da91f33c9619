//! Linear loops of scenes whose stiffness is left open.

use hpu_cosim::scene::{Device, Scene};
use hpu_numbers::{Interval, OpenLoop, Plants};

use super::controller::{Damping, controller};
use crate::widths::System;

/// Greatest delay, in whole samples, for which limits are worked out.
const MOST_WAITING: u64 = 64;

/// Returns the linear loop of a scene with this damping.
///
/// # Errors
///
/// Returns the reason why the scene has no linear loop.
pub(super) fn open_loop(scene: &Scene, damping: Damping) -> Result<OpenLoop, String> {
    let (num, den) = controller(scene, damping)?;
    let period = scene.period_clocks();
    let delay = scene.clock.edges(scene.model.delay_s);
    let (whole, late) = (delay / period, delay % period);
    if whole > MOST_WAITING {
        return Err(format!("a delay of {whole} samples, of {MOST_WAITING} at most for which this is worked out"));
    }
    let hertz = scene.clock.frequency_hz() as f64;
    let times_s = [late, period - late].map(|clocks| Interval::exact(clocks as f64).over(hertz));
    let live = scene.method.kind.is_live();
    Ok(OpenLoop::new(Plants::one(plant(scene, scene)), live, times_s, whole as u32, [num, den]))
}

/// Returns `A` with the effort's column, using the words of `nominal`, and a row of zeros for the effort. The position
/// is the last state.
pub(super) fn plant(scene: &Scene, nominal: &Scene) -> Vec<Vec<Interval>> {
    let system = System::new(scene, scene.hand.grip(), true);
    // An effort is a torque at stall: u R / K in volts. In another world of the box the same word makes more or less of
    // it.
    let (up, down) = match &scene.device {
        Device::Motor(motor) => {
            let ohm = Interval::exact(motor.resistance_ohm).plus(Interval::exact(2.0 * scene.bridge.on_resistance_ohm));
            (ohm, motor.torque_constant_nm_per_a)
        }
        Device::Mass(_) => (Interval::exact(1.0), 1.0),
    };
    let by = scene.full_command_over(nominal);
    let spare = if by == 1.0 { 0.0 } else { 1e-15 * by };
    let by = Interval { lo: by - spare, hi: by + spare };
    let mut plant = system.a;
    for (row, drive) in plant.iter_mut().zip(&system.drive) {
        let effort = drive.times(up).over(down);
        row.push(if spare == 0.0 { effort } else { effort.times(by) });
    }
    plant.push(vec![Interval::ZERO; plant.len() + 1]);
    plant
}
