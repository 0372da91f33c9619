//! Tests of the straight line within a step, and of the order in which drive and step take effect.

use super::*;
use hpu_plant::{Hand, Motor};

#[test]
fn the_line_leaves_a_band_at_the_edge_that_single_steps_find() {
    let axis = Axis::amplified(Motor::on_rail(0.05, 0.1, 0.0), Hand::Torque(0.0), 1e-6, 1 << 20).unwrap();
    let stepping = Stepping { method: Some(Method::Euler), first: 37, edges: 37 };
    let mut leaping = Stepped::new(&axis, stepping, 1e-6, [0.0, 0.4, 0.0]);
    leaping.driven(0, Drive::Current(-60.0));
    let mut stepping = leaping.clone();
    let band = |angle: f64| ((angle / 1e-6).floor() * 1e-6, ((angle / 1e-6).floor() + 1.0) * 1e-6);
    let (mut edge, mut exits) = (0, 0);
    let mut inside = band(0.0);
    while edge < 5_000 {
        let (next, x) = leaping.next_event(edge, 5_000, inside).unwrap_or_else(|| (5_000, leaping.state(5_000)));
        for single in edge + 1..=next {
            let angle = stepping.step(single)[2];
            let left = !(inside.0..inside.1).contains(&angle);
            assert!(!left || single == next, "edge {single}, not {next}");
        }
        leaping.arrive((next, x));
        assert_eq!(leaping.state(next), stepping.state(next));
        if !(inside.0..inside.1).contains(&x[2]) {
            exits += 1;
            inside = band(x[2]);
        }
        edge = next;
    }
    assert!(exits > 100, "{exits}");
    assert_eq!(leaping.steps(), 5_000 / 37);
}

#[test]
fn a_drive_inside_a_step_waits_for_the_next() {
    let axis = Axis::amplified(Motor::on_rail(0.05, 0.0, 0.0), Hand::Torque(0.0), 1e-6, 1 << 20).unwrap();
    for method in [None, Some(Method::Rk4)] {
        let mut body = Stepped::new(&axis, Stepping { method, first: 100, edges: 100 }, 1e-6, [0.0; 3]);
        let walk = |body: &mut Stepped, edges: std::ops::RangeInclusive<u64>| {
            for edge in edges {
                body.step(edge);
            }
        };
        walk(&mut body, 1..=50);
        body.driven(50, Drive::Current(1.0));
        walk(&mut body, 51..=100);
        assert_eq!(body.state(100)[..3], [1.0, 0.0, 0.0]);
        walk(&mut body, 101..=200);
        assert!((body.state(200)[1] - 1.0 / 0.05 * 100e-6).abs() < 1e-15);
    }
}
