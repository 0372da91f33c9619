//! Linear loops of networks: a knob on a cable, against the stable stiffnesses of its monodromy matrix.

use hpu_cosim::scene::Scene;
use hpu_prove::linear::{Damping, DrivenSet, End, StableSet};

/// A knob: a rotor of 50 g·cm² drives a handle at 6 mm/rad.
const KNOB: &str = r#"about = "A network."
clock = { frequency = "16384 kHz" }
run = { duration = "1 s" }
device.kind = "network"
device.units_at = "handle"
device.bodies.rotor = { inertia = "50 g.cm2" }
device.joints.cable.from = "rotor"
device.joints.cable.to = "handle"
device.joints.cable.ratio = 10
device.joints.cable.radius = "60 mm"
device.drive.kind = "current"
device.drive.on = "rotor"
device.drive.torque_constant = "23 mN.m/A"
device.drive.bandwidth = "2 kHz"
device.drive.dac = { full_scale = "10 A" }
encoder = { on = "rotor", lines = 2000 }
method.kind = "conventional"
method.sample_rate = "4 kHz"
method.position_bits = 16
method.stiffness_format = "(0,10,8)"
method.damping_format = "(0,12,4)"
wall = { position = "6 mm", stiffness = "30 kN/m", damping = "0 N.s/m" }
hand.kind = "spring_damper"
hand.on = "handle"
hand.path = [["0 s", 0], ["200 ms", "12 mm"]]
"#;

/// The cable, if it is not rigid.
const CABLE: [(&str, &str); 2] =
    [("device.joints.cable.stiffness", "20 kN/m"), ("device.joints.cable.damping_ratio", "0.02")];

fn knob(set: &[(&str, &str)]) -> Scene {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    Scene::parse("knob", KNOB, &set, &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the end of the one stable stretch, in kN/m at the handle, and half of its uncertainty.
fn end(set: StableSet) -> (f64, f64) {
    let set = set.in_units(36e-6, "N/m");
    assert!(set.stable.len() == 1 && set.open.is_empty(), "{}", set.said());
    let to: End = set.stable[0].to;
    (to.middle() / 1e3, to.uncertainty() / 1e3)
}

fn ideal(scene: &Scene) -> (f64, f64) {
    let damping = Damping::Fixed(scene.wall.damping_nm_s_per_rad);
    end(StableSet::new(scene, damping, [0.05, 9.0]).unwrap_or_else(|error| panic!("{error}")))
}

/// Largest stable stiffness in kN/m for a host that is 0, 1 or 2 samples late, with the joint rigid, then with the
/// cable: by bisection on the monodromy matrix in 40 digits.
const KNOWN: [([&str; 4], [f64; 3], [f64; 3]); 6] = [
    (
        ["10 g", "1388.8888888888889 N/m", "27.77777777777778 N.s/m", "0 N.s/m"],
        [137.43459054, 62.126850985, 40.357105261],
        [76.870646500, 41.945120953, 29.360964125],
    ),
    (
        ["10 g", "1388.8888888888889 N/m", "27.77777777777778 N.s/m", "13.88888888888889 N.s/m"],
        [201.62889248, 90.661378185, 58.490624404],
        [125.49070730, 65.191786079, 44.682768618],
    ),
    (
        ["10 g", "500 N/m", "5 N.s/m", "13.88888888888889 N.s/m"],
        [90.462540608, 40.508317389, 25.968688185],
        [123.35874185, 43.519654945, 26.949279100],
    ),
    (
        ["30 g", "1388.8888888888889 N/m", "27.77777777777778 N.s/m", "0 N.s/m"],
        [137.23986347, 62.007897132, 40.249366232],
        [91.435574630, 58.249259223, 41.366798596],
    ),
    (
        ["30 g", "1388.8888888888889 N/m", "27.77777777777778 N.s/m", "13.88888888888889 N.s/m"],
        [201.86181072, 90.774526309, 58.562493959],
        [126.36034792, 76.153287966, 55.870418657],
    ),
    (
        ["30 g", "500 N/m", "5 N.s/m", "13.88888888888889 N.s/m"],
        [90.681842949, 40.631726114, 26.068362905],
        [121.76002198, 85.769065807, 31.545693696],
    ),
];

#[test]
fn a_knob_is_as_stiff_as_its_monodromy_says() {
    for ([mass, stiffness, damping, wall], rigid, compliant) in KNOWN {
        let hand = [("hand.stiffness", stiffness), ("hand.damping", damping), ("wall.damping", wall)];
        for (cable, known) in [(&[][..], rigid), (&CABLE[..], compliant)] {
            for (late, known) in ["0", "1", "2"].into_iter().zip(known) {
                let own = [("device.bodies.handle.mass", mass), ("host.late", late)];
                let scene = knob(&[&own[..], &hand, cable].concat());
                let (middle, half) = ideal(&scene);
                let case = format!("{mass} {stiffness} {wall} {late} {}", cable.len());
                assert!((middle - known).abs() <= 1e-9 * known && half <= 1e-9 * known, "{case}: {middle} {half:e}");
            }
        }
    }
}

/// The knob as it runs: an encoder's edge acts 4 clocks later, by the same monodromy with that delay.
#[test]
fn a_driven_knob_waits_for_its_clocks_too() {
    let hand = [("hand.stiffness", "1388.8888888888889 N/m"), ("hand.damping", "27.77777777777778 N.s/m")];
    for (mass, wall, late, cable, known) in [
        ("10 g", "0 N.s/m", "1", &CABLE[..], 41.92719178138886),
        ("30 g", "13.88888888888889 N.s/m", "1", &CABLE[..], 76.1262734905215),
        ("10 g", "0 N.s/m", "0", &[][..], 137.2706769112002),
    ] {
        let own = [("device.bodies.handle.mass", mass), ("wall.damping", wall), ("host.late", late)];
        let scene = knob(&[&own[..], &hand, cable].concat());
        let driven = DrivenSet::new(&scene, [0.05, 9.0]).unwrap_or_else(|why| panic!("{}", why.why));
        let (middle, half) = end(driven.set);
        assert!((middle - known).abs() <= 1e-9 * known && half <= 1e-9 * known, "{mass} {late}: {middle} {half:e}");
        let host = driven.waits.iter().find(|wait| wait.what == "the host").map_or(0.0, |wait| wait.seconds);
        assert!((host - 250e-6 * late.parse::<f64>().expect("a number")).abs() < 1e-12);
    }
}
