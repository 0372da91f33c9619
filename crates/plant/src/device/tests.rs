//! How far ahead a device knows its mode.

use super::{Device, HEARD, Pulses};
use crate::{Axis, Bridge, Gates, Hand, Motor};

fn motor(coulomb_nm: f64) -> Motor {
    Motor {
        resistance_ohm: 1.0,
        inductance_h: 1e-3,
        torque_constant_nm_per_a: 0.02,
        inertia_kg_m2: 1e-6,
        viscous_nm_s_per_rad: 0.0,
        coulomb_nm,
    }
}

/// The length for which a mode is known to last is never longer than that for which the errors of its functions are
/// bounded.
#[test]
fn a_mode_is_known_to_last_only_as_far_as_errors_are_bounded() {
    let axis = Axis::amplified(motor(1e-3), Hand::Torque(0.0), 2e-8, 1 << 24).expect("a motor");
    let mut far = 0;
    for speed_rad_per_s in [5.0, 20.0, 50.0] {
        // A count every few hundred edges, while friction brakes the shaft.
        let (count_rad, mut at, mut count) = (speed_rad_per_s * 1e-5, 0, 0);
        let mut device = Device::new(&axis, 0.0, speed_rad_per_s, 0.0);
        while at < 20_000 {
            let band = [count, count + 1].map(|count| f64::from(count) * count_rad);
            // Edges come through a datapath one by one.
            let event = device.next_event(at, at + 4, (band[0], band[1]));
            at = event.map_or(at + 4, |event| event.0);
            if let Some(event) = event {
                device.arrive(event);
                count += 1;
            }
            assert!(device.kept == 0 || device.kept < device.heard, "{} of {}", device.kept, device.heard);
            far += u32::from(device.kept > HEARD);
        }
        assert!(count > 10 && device.mode_changes() == 0, "{count} counts");
        // Of a motion that is new, no direction is known.
        assert!(device.steady.until > 0);
        device.drive_current(at, 0.01);
        assert_eq!(device.steady.until, 0);
    }
    assert!(far > 100, "{far} looks farther than errors are bounded without being asked");
}

/// A cruise is tried on the smooth motion of the pulses. The direction of that motion says nothing of the switched one.
#[test]
fn a_cruise_leaves_no_direction_behind() {
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7 };
    let axis = Axis::new(motor(0.0), bridge, Hand::Torque(0.0), 2e-8, 1 << 24).expect("a motor");
    let pulse = Gates { a_high: true, a_low: false, b_high: false, b_low: true };
    let pause = Gates { a_high: false, a_low: true, b_high: false, b_low: true };
    let speed_rad_per_s = 20.0;
    for counts_in in [40.0, 50.0, 55.0, 1000.0] {
        let mut device = Device::new(&axis, 0.0, speed_rad_per_s, 0.0);
        device.drive(1, pulse);
        // Fewer edges than a short search has, so that the direction is looked for.
        let high_rad = speed_rad_per_s * 2e-8 * (1.0 + counts_in);
        let end = device.cruise(1, 61, (-1e-3, high_rad), &Pulses { period: 16, duty: 8, pause });
        assert!(end.is_some(), "{counts_in}");
        assert_eq!(device.steady.until, 0, "{counts_in}");
    }
}
