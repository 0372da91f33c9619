//! Further sensors of a network against closed forms in integers, and mpmath at 60 digits.

use hpu_plant::Hand;
use hpu_plant::network::{Body, Feed, FeedKind, Joint, Network, NetworkDevice, NetworkLaws, Sensed};

/// An edge of 2^-20 s, so that every figure below is a whole number of some power of two.
const EDGE_S: f64 = 1.0 / 1_048_576.0;

/// A body of 1 kg·m² under 1/8 N·m from rest, which turns a second one by half as far; a sensor on the second, and one
/// with a lag of 64 rad/s on the first.
fn pushed() -> Network {
    let kind = FeedKind::Current { bandwidth_rad_per_s: f64::INFINITY, supply_v: f64::INFINITY };
    let body = |inertia| Body { inertia, ..Body::default() };
    Network {
        bodies: vec![body(0.75), body(1.0)],
        joints: vec![Joint { from: 0, to: 1, ratio: 0.5, compliance: None }],
        stops: Vec::new(),
        feed: Feed { torque_constant: 1.0, resistance_ohm: 0.0, inductance_h: 0.0, kind },
        driven: 0,
        seen: 0,
        grip: 0,
        hand: Hand::Torque(0.125),
        sensed: vec![Sensed { body: 1, lag_rad_per_s: None }, Sensed { body: 0, lag_rad_per_s: Some(64.0) }],
    }
}

/// The first body is at n^2 / 2^44 rad after n edges, the second at n^2 / 2^45.
#[test]
fn readings_are_floored_exactly() {
    let laws = NetworkLaws::<8>::new(pushed().reduced().unwrap(), EDGE_S, 1 << 21);
    let device = NetworkDevice::new(&laws, 0.0);
    for edge in [0, 1, 3, 1000, 12_345, 999_999, 1 << 20] {
        for shift in [16, 30, 40] {
            let whole = (i128::from(edge) * i128::from(edge)) >> (45 - shift);
            assert_eq!(i128::from(device.floor(Some(0), edge, 2f64.powi(shift))), whole, "{edge}");
        }
    }
    // mpmath: a/2 (t^2 - 2 t/w + 2/w^2) - a/w^2 exp(-w t) with a = 1/8 and w = 64, times 2^62.
    for (edge, floor) in
        [(1 << 12, 344_696_638_967), (123_457, 3_075_676_864_600_100), (300_001, 21_156_865_805_911_743)]
    {
        assert_eq!(device.floor(Some(1), edge, 2f64.powi(62)), floor);
    }
    assert_eq!(device.floor(None, 1, 1.0), 0);
}

/// The second body passes the angles k 2^-16 at n^2 = k 2^29: at the first edge from there on.
#[test]
fn the_edges_of_a_further_encoder_are_where_the_motion_says() {
    let laws = NetworkLaws::<8>::new(pushed().reduced().unwrap(), EDGE_S, 1 << 21);
    let mut device = NetworkDevice::new(&laws, 0.0);
    let (step, mut edge) = (2f64.powi(-16), 0);
    for count in 0..200u64 {
        let band = (count as f64 * step, (count + 1) as f64 * step);
        device.watch(0, band);
        let anywhere = (f64::NEG_INFINITY, f64::INFINITY);
        let event = device.next_event(edge, 1 << 20, anywhere).unwrap();
        edge = event.0;
        let whole = u128::from(count + 1) << 29;
        let root = whole.isqrt();
        assert_eq!(u128::from(edge), root + u128::from(root * root < whole), "{count}");
        device.arrive(event);
        assert_eq!(device.side_of_reading(0, edge, device.reading(0, edge), band), 1);
    }
}
