//! How far ahead a device knows its mode.

use super::{Device, HEARD};
use crate::{Axis, Hand, Motor};

/// The length for which a mode is known to last is never longer than that for which the errors of its functions are
/// bounded.
#[test]
fn a_mode_is_known_to_last_only_as_far_as_errors_are_bounded() {
    let motor = Motor {
        resistance_ohm: 1.0,
        inductance_h: 1e-3,
        torque_constant_nm_per_a: 0.02,
        inertia_kg_m2: 1e-6,
        viscous_nm_s_per_rad: 0.0,
        coulomb_nm: 1e-3,
    };
    let axis = Axis::amplified(motor, Hand::Torque(0.0), 2e-8, 1 << 24).expect("a motor");
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
