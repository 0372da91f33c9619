//! Linear loops of networks: a knob on a cable, against the stable stiffnesses of its monodromy matrix.

use hpu_cosim::scene::Scene;
use hpu_prove::criteria::{Criterion, Silent, all, named};
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

/// Lines of a drive by a PI loop.
const PI: &str = r#"device.drive.kind = "pi"
device.drive.resistance = "1.1 Ohm"
device.drive.inductance = "0.2 mH"
device.drive.supply = "48 V"
"#;

/// A PI drive, a cord between rotor and handle, and a hand with a mass: ten states, by the same monodromy in 40 digits.
#[test]
fn ten_states_are_as_stiff_as_their_monodromy_says() {
    let text = KNOB
        .replace("device.drive.kind = \"current\"\n", PI)
        .replace("joints.cable.to = \"handle\"", "joints.cable.to = \"cord\"");
    let more = "device.bodies.cord = { mass = \"5 g\" }\ndevice.bodies.handle = { mass = \"30 g\" }\n\
        device.joints.link = { from = \"cord\", to = \"handle\", ratio = 1, stiffness = \"200 kN/m\", \
        damping = \"2 N.s/m\" }\n";
    let hand = "hand.stiffness = \"900 N/m\"\nhand.damping = \"20 N.s/m\"\nhand.mass = \"554 g\"\n\
        hand.own_stiffness = \"135 N/m\"\nhand.own_damping = \"6.45 N.s/m\"\n";
    let cable = "device.joints.cable.stiffness = \"20 kN/m\"\ndevice.joints.cable.damping = \"1 N.s/m\"\n";
    for (late, known, driven) in [(0, 90.0960876796089, None), (1, 65.9106071321872, Some(65.8962296494393))] {
        let text = format!("{text}{hand}{cable}host.late = {late}\n{more}");
        let scene = Scene::parse("knob", &text, &[], &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{error}"));
        let (middle, half) = ideal(&scene);
        assert!((middle - known).abs() <= 1e-9 * known && half <= 1e-9 * known, "{late}: {middle} {half:e}");
        let Some(known) = driven else { continue };
        let set = DrivenSet::new(&scene, [0.05, 9.0]).unwrap_or_else(|why| panic!("{}", why.why));
        let (middle, half) = end(set.set);
        assert!((middle - known).abs() <= 1e-9 * known && half <= 1e-9 * known, "{late}: {middle} {half:e}");
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

/// A rigid knob on an ideal drive, seen from its handle, and a mass of the same inertia, friction and grip under an
/// ideal force: every criterion has the same limit, and says so with the same assumptions.
#[test]
fn criteria_of_a_rigid_network_are_those_of_a_mass() {
    // 50 g·cm² at 6 mm/rad are 5e-6 / 36e-6 kg; 2 mN·m are 1/3 N, and 0.1 mN·m·s/rad are 25/9 N·s/m at the handle.
    let common = "run = { duration = \"1 s\" }\nclock = { frequency = \"16384 kHz\" }\nmethod.kind = \"conventional\"\n\
                  method.sample_rate = \"4 kHz\"\nmethod.position_bits = 16\nmethod.stiffness_format = \"(0,10,12)\"\n\
                  method.damping_format = \"(0,12,4)\"\nwall = { position = \"6 mm\", stiffness = \"30 kN/m\" }\n";
    let count_m = 6e-3 * 2.0 * std::f64::consts::PI / 8000.0;
    let hand = |kind: &str| format!("hand.kind = \"{kind}\"\n");
    let (grip, push) = (
        hand("spring_damper") + "hand.stiffness = \"900 N/m\"\nhand.damping = \"20 N.s/m\"\n",
        hand("constant_torque") + "hand.torque = \"2 N\"\n",
    );
    for (hand, text, own) in
        [("held", &grip, "hand.path = [[\"0 s\", 0], [\"200 ms\", \"12 mm\"]]\n"), ("pressed", &push, "")]
    {
        let knob = format!(
            "about = \"A knob.\"\n{common}{text}{own}hand.on = \"handle\"\n\
            encoder = {{ on = \"rotor\", lines = 2000 }}\n\
             [device]\nkind = \"network\"\nunits_at = \"handle\"\n\
             bodies.rotor = {{ inertia = \"50 g.cm2\", coulomb_friction = \"2 mN.m\", \
             viscous_friction = \"0.1 mN.m.s/rad\" }}\n\
             bodies.handle = {{ mass = \"30 g\" }}\n\
             joints.cable = {{ from = \"rotor\", to = \"handle\", ratio = 10, radius = \"60 mm\" }}\n\
             drive = {{ kind = \"current\", on = \"rotor\", torque_constant = \"23 mN.m/A\", \
             dac = {{ full_scale = \"10 A\" }} }}\n\
             [model]\ndrive = \"ideal\"\n"
        );
        let mass = format!(
            "about = \"A mass.\"\n{common}{text}{own}encoder.resolution = {count_m:e}\n\
             amplifier.full_scale = {:e}\n[device]\nkind = \"mass\"\nmass = {:e}\ndamping = {:e}\ncoulomb = {:e}\n",
            10.0 * 23e-3 / 6e-3,
            0.03 + 5.0 / 36.0,
            25.0 / 9.0,
            1.0 / 3.0,
        );
        let [knob, mass] = [knob, mass].map(|text| {
            Scene::parse("scene", &text, &[], &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{hand}: {error}"))
        });
        let network = knob.network.as_deref().expect("a network");
        let units = network.wall_units;
        let (mut alike, mut silent) = (0, 0);
        // A mass has no winding, and is not asked for the criterion of one.
        let is_wound = |it: &Result<Criterion, Silent>| it.as_ref().is_err_and(|it| it.name == "low_frequency");
        let ours: Vec<_> = all(&knob).into_iter().filter(|it| !is_wound(it)).collect();
        assert_eq!(ours.len() + 1, all(&knob).len());
        for (ours, known) in ours.into_iter().zip(all(&mass)) {
            match (ours, known) {
                (Ok(ours), Ok(known)) => {
                    let ours = ours.in_units(network.wall_ratio, &units);
                    assert_eq!((ours.name, ours.unit, ours.region), (known.name, known.unit, known.region));
                    assert!(
                        (ours.limit / known.limit - 1.0).abs() < 1e-8 || ours.limit == known.limit,
                        "{hand}: {ours:?} {known:?}"
                    );
                    let met = |it: &Criterion| it.assumptions.iter().map(|it| it.met).collect::<Vec<_>>();
                    assert_eq!(met(&ours), met(&known), "{hand}: {ours:?} {known:?}");
                    for (a, b) in ours.figures.iter().zip(&known.figures) {
                        assert!(a.unit == b.unit && (a.value / b.value - 1.0).abs() < 1e-8, "{hand}: {a:?} {b:?}");
                    }
                    alike += 1;
                }
                (Err(ours), Err(known)) if ours.name == "routh" => {
                    assert!(ours.why.contains("a current drives it"), "{ours:?}");
                    assert_eq!(known.name, "routh");
                    silent += 1;
                }
                (Err(ours), Err(known)) => {
                    assert_eq!(ours, known);
                    silent += 1;
                }
                (ours, known) => panic!("{hand}: {ours:?} {known:?}"),
            }
        }
        assert!(alike >= 5 && silent >= 1, "{hand}: {alike} {silent}");
    }
}

/// A criterion names each part that makes a network another device than its rigid body.
#[test]
fn criteria_name_what_a_network_has_beyond_a_rigid_body() {
    let here = |set: &[(&str, &str)]| {
        let set: Vec<_> =
            [("hand.stiffness", "900 N/m"), ("hand.damping", "20 N.s/m"), ("device.bodies.handle.mass", "30 g")]
                .iter()
                .chain(set)
                .copied()
                .collect();
        let known = named("colgate_schenkel", &knob(&set)).expect("one").expect("a limit");
        let missed = known.assumptions.iter().filter(|it| !it.met).map(|it| it.here.clone());
        (known.limit, missed.collect::<Vec<_>>().join("; "))
    };
    let (rigid, said) = here(&[]);
    assert!(said.contains("a current that follows at 2000 Hz") && !said.contains("compliant"), "{said}");
    let (bending, said) = here(&CABLE);
    assert!(said.contains("compliant from rotor to handle") && rigid == bending, "{said}");
    let (_, said) = here(&[("hand.mass", "554 g")]);
    assert!(said.contains("the hand has a mass of its own"), "{said}");
    let (_, said) = here(&[("device.bodies.handle.return_spring", "3 N/m")]);
    assert!(said.contains("a spring or weight at handle"), "{said}");
}

/// Without a word on the host, the set of a spring that every clock follows would be that of a host on time.
#[test]
fn a_live_spring_behind_a_host_has_no_set_on_time() {
    let hand = [("hand.stiffness", "900 N/m"), ("hand.damping", "20 N.s/m"), ("device.bodies.handle.mass", "30 g")];
    let set = |late| [&hand[..], &[("method.kind", "hybrid"), ("host.late", late)]].concat();
    let of = |late| StableSet::new(&knob(&set(late)), Damping::Fixed(0.0), [0.05, 9.0]);
    assert!(of("0").is_ok());
    let why = of("1").expect_err("it is late").to_string();
    assert!(why.contains("a host hands it on late"), "{why}");
    let silent = named("spectral_radius", &knob(&set("1"))).expect("one").expect_err("no limit");
    assert_eq!(silent.why, why);
}

/// A voice coil that a bridge drives waits for the modulator, as a motor does: no set without it is told.
#[test]
fn a_bridge_before_a_slider_is_a_modulator() {
    let text = "about = \"A voice coil.\"\nclock.frequency = \"16384 kHz\"\nrun.duration = \"500 ms\"\n\
        device.kind = \"network\"\ndevice.bodies.slider = { mass = \"50 g\", viscous_friction = \"2 N.s/m\" }\n\
        device.drive = { kind = \"bridge\", on = \"slider\", torque_constant = \"5 N/A\", resistance = \"3 Ohm\", \
        inductance = \"1 mH\" }\n\
        encoder = { on = \"slider\", resolution = \"1 um\" }\nmethod.kind = \"conventional\"\n\
        method.sample_rate = \"4 kHz\"\n\
        method.position_bits = 16\nmethod.stiffness_format = \"(0,10,8)\"\nmethod.damping_format = \"(0,12,4)\"\n\
        wall = { position = \"6 mm\", stiffness = \"1 kN/m\" }\nhand.kind = \"none\"\n";
    let scene = Scene::parse("slider", text, &[], &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{error}"));
    let ideal = StableSet::new(&scene, Damping::Fixed(0.0), [50.0, 5e4]).expect("a linear loop");
    let driven = DrivenSet::new(&scene, [50.0, 5e4]).unwrap_or_else(|why| panic!("{}", why.why));
    assert_eq!((driven.duty, driven.looked), (Some([0.0; 2]), Some(200)));
    let [ideal, found] = [ideal, driven.set].map(|set| set.stable[0].to.middle());
    // Samples and modulator have the same rate, and a sample's command misses the period that begins with it.
    assert!(found < 0.85 * ideal && found > 0.7 * ideal, "{found} {ideal}");
    // 2^12 clocks of a full command.
    let wait = driven.waits.iter().find(|wait| wait.what.contains("modulator")).expect("it waits");
    assert!((wait.seconds - 4096.0 / 16384e3).abs() < 1e-12, "{wait:?}");
    let friction = named("colgate_schenkel", &scene).expect("one").expect("a limit");
    // b + K²/R over T/2 and all waits.
    let lag_s = 0.5 / 4e3 + driven.waits.iter().map(|wait| wait.seconds).sum::<f64>();
    let ohm = 3.0 + 2.0 * scene.bridge.on_resistance_ohm;
    assert!((friction.limit / ((2.0 + 25.0 / ohm) / lag_s) - 1.0).abs() < 1e-12, "{friction:?}");
}

/// A law that reads an absolute sensor: its linear loop is that of an encoder with as many counts, the times of its
/// words are among those that this leaves out, and no set is told as driven.
#[test]
fn words_of_a_sensor_have_times_that_the_linear_loop_leaves_out() {
    let word = "{ kind = \"absolute\", on = \"rotor\", bits = 13, rate = \"2 kHz\", latency = \"100 us\", \
                corner = \"500 Hz\" }";
    let hand =
        [("hand.stiffness", "1388.9 N/m"), ("hand.damping", "27.8 N.s/m"), ("device.bodies.handle.mass", "10 g")];
    let base = [&hand[..], &CABLE, &[("encoder.lines", "2048")]].concat();
    let by_word = [("device.sensors.word", word), ("method.position", "word")];
    let [lines, words] = [knob(&base), knob(&[&base[..], &by_word].concat())];
    let sets = [&lines, &words].map(ideal);
    assert_eq!(sets[0], sets[1]);
    let told = DrivenSet::new(&words, [0.05, 9.0]).expect_err("not told");
    assert!(told.why.contains("the words of word"), "{}", told.why);
    let wait = |what: &str| told.left_out.iter().find(|wait| wait.what == what).expect("it waits").seconds;
    let period_s = 1.0 / words.clock.frequency_hz() as f64;
    let average_s = 100e-6 + 0.5 * (0.5e-3 - period_s);
    assert!((wait("the sensor's words, on average") - average_s).abs() < period_s, "{told:?}");
    assert!((wait("the sensor's lag") - 1.0 / (std::f64::consts::TAU * 500.0)).abs() < 1e-12, "{told:?}");
}
