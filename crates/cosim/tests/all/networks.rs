//! Networks in a loop: the drivers agree, the energies add up, and a compliant knob is what it is said to be.

use hpu_cosim::scene::{Experiment, Metric, OutcomeKind, Scene};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};

/// A knob on a cable, driven by a current; its wall is that of the handle.
const KNOB: &str = r#"about = "A network."
clock = { frequency = "1024 kHz" }
run = { duration = "100 ms" }
device.kind = "network"
device.units_at = "handle"
device.bodies.rotor = { inertia = "50 g.cm2", coulomb_friction = "3 mN.m" }
device.bodies.handle = { mass = "30 g" }
device.joints.cable.from = "rotor"
device.joints.cable.to = "handle"
device.joints.cable.ratio = 10
device.joints.cable.radius = "60 mm"
device.joints.cable.stiffness = "20 kN/m"
device.joints.cable.damping_ratio = 0.02
device.drive.kind = "current"
device.drive.on = "rotor"
device.drive.torque_constant = "23 mN.m/A"
device.drive.bandwidth = "2 kHz"
device.drive.resistance = "1.1 Ohm"
device.drive.inductance = "0.2 mH"
device.drive.supply = "48 V"
device.drive.dac = { bits = 12, full_scale = "10 A" }
encoder = { on = "rotor", lines = 2000 }
method.kind = "conventional"
method.sample_rate = "4 kHz"
method.position_bits = 16
method.stiffness_format = "(0,10,8)"
method.damping_format = "(0,12,4)"
wall = { position = "6 mm", stiffness = "20 kN/m", damping = "13.9 N.s/m" }
hand.kind = "spring_damper"
hand.on = "handle"
hand.stiffness = "1388.9 N/m"
hand.damping = "27.78 N.s/m"
hand.path = [["0 s", 0], ["25 ms", "12 mm"]]
"#;

/// A wheel between end stops on a bridge, pressed into a wall.
const WHEEL: &str = r#"about = "A network."
clock = { frequency = "1 MHz" }
run = { duration = "100 ms" }
device.kind = "network"
device.bodies.wheel.inertia = "700 g.cm2"
device.bodies.wheel.viscous_friction = "10 uN.m.s/rad"
device.bodies.wheel.return_spring = "20 mN.m/rad"
device.bodies.wheel.stops = { low = "-30 deg", high = "30 deg", stiffness = "40 N.m/rad", damping = "20 mN.m.s/rad" }
device.bodies.wheel.initial_speed = "30 rad/s"
device.drive.kind = "bridge"
device.drive.on = "wheel"
device.drive.torque_constant = "25.9 mN.m/A"
device.drive.resistance = "2.35 Ohm"
device.drive.inductance = "0.226 mH"
encoder = { on = "wheel", lines = 1024 }
method = { kind = "hybrid", sample_rate = "1 kHz", damping_format = "(0,8,4)" }
wall = { position = "20 deg", stiffness = "50 mN.m/rad" }
hand = { kind = "constant_torque", on = "wheel", torque = "30 mN.m" }
"#;

fn scene(text: &str) -> Scene {
    let none = &mut |_: &str| Err(std::io::Error::other("no file"));
    Scene::parse("scene.toml", text, &[], none).unwrap_or_else(|error| panic!("{error}"))
}

fn simulation(experiment: &Experiment) -> WiredSimulation<'_> {
    WiredSimulation::new(experiment).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn leaping_and_stepping_agree_at_every_edge_of_networks() {
    let mass = "hand.mass = \"554 g\"\nhand.own_stiffness = \"135 N/m\"\nhand.own_damping = \"6.45 N.s/m\"\n";
    let hand = format!("{KNOB}{mass}");
    let pi = KNOB.replace("device.drive.kind = \"current\"", "device.drive.kind = \"pi\"");
    let cable = "device.joints.cable.stiffness = \"20 kN/m\"\ndevice.joints.cable.damping_ratio = 0.02\n";
    assert!(KNOB.contains(cable));
    let rigid = KNOB.replace(cable, "");
    let late = format!("{KNOB}host = {{ late = 2, latency = \"3 us\" }}\n");
    let two = format!("{KNOB}{HANDLE}method.position = \"far\"\n");
    let all = [("knob", KNOB), ("wheel", WHEEL), ("hand", &hand), ("pi", &pi), ("rigid", &rigid), ("late", &late)];
    for (name, text) in all.into_iter().chain([("two", &*two), ("banded", &banded())]) {
        let experiment = Experiment::Axis(scene(text));
        let simulation = simulation(&experiment);
        let comparison = simulation.compare(20_000);
        assert_eq!(comparison.mismatches, 0, "{name}: {:?}", comparison.first);
    }
}

/// The wheel on an averaged bridge with a dead band, far larger than that of a good one.
fn banded() -> String {
    format!("{WHEEL}model.bridge = \"averaged\"\nbridge = {{ supply = \"12 V\", dead_band = \"2 V\" }}\n")
}

/// An encoder on the handle of the knob, an absolute one with a lag on its rotor, and the drive's current.
const HANDLE: &str = r#"device.sensors.far = { kind = "encoder", on = "handle", resolution = "2 um" }
device.sensors.near = { kind = "absolute", on = "rotor", bits = 9, rate = "20 kHz", latency = "7 us", corner = "1 kHz" }
device.sensors.amps = { kind = "current", bits = 12, gain = "0.1 V/A", range = "3 V", rate = "100 kHz", noise = 1 }
"#;

/// Lines and words of sensors that no method counts change at the same edges, whether the world leaps or steps.
#[test]
fn the_pins_of_further_sensors_do_not_depend_on_the_driver() {
    for text in [format!("{KNOB}{HANDLE}"), format!("{KNOB}{HANDLE}method.position = \"far\"\n")] {
        let experiment = Experiment::Axis(scene(&text));
        let simulation = simulation(&experiment);
        let (mut stepped, mut changes) = (simulation.closed_loop(), Vec::new());
        let mut before = stepped.world().sensors().to_vec();
        while stepped.edge() < 10_000 {
            stepped.step();
            let now = stepped.world().sensors();
            if now != before {
                changes.push((stepped.edge(), before, now.to_vec()));
                before = now.to_vec();
            }
        }
        assert!(changes.len() > 50, "{}", changes.len());
        let mut leaping = simulation.closed_loop();
        for (edge, before, after) in changes {
            for (to, pins) in [(edge - 1, before), (edge, after)] {
                while leaping.edge() < to {
                    leaping.leap(to, &mut ());
                }
                assert_eq!(leaping.world().sensors(), pins, "at {to}");
            }
        }
    }
}

/// Energy is lost by rounding alone, although the mode changes often.
#[test]
fn the_energies_of_networks_add_up() {
    for (name, text, changes) in [("knob", KNOB, 4), ("wheel", WHEEL, 3), ("banded", &banded(), 3)] {
        let experiment = Experiment::Axis(scene(text));
        let simulation = simulation(&experiment);
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
        let energy = &summary.energy;
        assert!(summary.mode_changes >= changes, "{name}: {}", summary.mode_changes);
        assert!(summary.encoder_edges > 100, "{name}: {}", summary.encoder_edges);
        let residual = energy.residual_j.abs() / energy.exchanged_j;
        assert!(residual <= 1e-12, "{name}: {residual:e}: {energy:?}");
    }
}

/// Numbers from a seed, by SplitMix64.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn of(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    /// Returns a number between two positive ones, evenly over its logarithm.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.next() as f64 / u64::MAX as f64)
    }
}

/// Returns a network of up to four bodies that turn, in a chain, with friction, stops, a drive and a hand.
fn random_network(dice: &mut Dice) -> String {
    let bodies = 1 + dice.of(3);
    let mut text = String::from(
        "about = \"A network.\"\nclock = { frequency = \"1 MHz\" }\nrun = { duration = \"100 ms\" }\n\
         device.kind = \"network\"\n",
    );
    for body in 0..bodies {
        let inertia = dice.between(1e-6, 1e-4);
        let [viscous, coulomb] = [dice.between(1e-7, 1e-4), dice.between(1e-4, 5e-3)];
        text += &format!("device.bodies.b{body} = {{ inertia = {inertia:e}, viscous_friction = {viscous:e}");
        if dice.of(2) == 0 {
            let stiction = coulomb * dice.between(1.0, 1.5);
            text += &format!(", coulomb_friction = {coulomb:e}, stiction = {stiction:e}");
        }
        if dice.of(3) == 0 {
            text += &format!(", return_spring = {:e}", dice.between(1e-3, 1.0));
        }
        if body < 2 && dice.of(2) == 0 {
            let [stiffness, damping] = [dice.between(1.0, 100.0), dice.between(1e-4, 1e-2)];
            text += &format!(
                ", stops = {{ low = -0.3, high = {:e}, stiffness = {stiffness:e}, damping = {damping:e} }}",
                dice.between(0.05, 0.5)
            );
        }
        if body == 0 {
            text += &format!(", initial_speed = {:e}", dice.between(1.0, 50.0));
        }
        text += " }\n";
    }
    for joint in 1..bodies {
        let ratio = dice.between(0.2, 5.0);
        text += &format!("device.joints.j{joint} = {{ from = \"b{}\", to = \"b{joint}\", ratio = {ratio:e}", joint - 1);
        if dice.of(4) != 0 {
            let [stiffness, damping] = [dice.between(0.1, 100.0), dice.between(0.01, 0.2)];
            text += &format!(", stiffness = {stiffness:e}, damping_ratio = {damping:e}");
        }
        text += " }\n";
    }
    let on = dice.of(bodies);
    let kind = ["bridge", "current", "pi"][dice.of(3) as usize];
    text += &format!("device.drive.kind = \"{kind}\"\ndevice.drive.on = \"b{on}\"\n");
    text += "device.drive.torque_constant = \"25 mN.m/A\"\ndevice.drive.resistance = \"2 Ohm\"\n\
             device.drive.inductance = \"0.3 mH\"\n";
    if kind != "bridge" {
        let supply = dice.between(5.0, 50.0);
        text += &format!("device.drive.bandwidth = \"2 kHz\"\ndevice.drive.supply = {supply:e}\n");
        text += "device.drive.dac = { bits = 12, full_scale = \"4 A\" }\n";
        text += &format!("host.late = {}\n", dice.of(3));
    }
    let [seen, grip] = [dice.of(bodies), dice.of(bodies)];
    text += &format!("encoder = {{ on = \"b{seen}\", lines = 2048 }}\nhand.on = \"b{grip}\"\n");
    let hand = dice.of(3);
    if hand == 0 {
        text += "hand.kind = \"constant_torque\"\nhand.torque = \"10 mN.m\"\n";
    } else {
        text += "hand.kind = \"spring_damper\"\nhand.stiffness = 0.3\nhand.damping = 1e-3\n\
                 hand.path = [[\"0 s\", 0], [\"10 ms\", 0.1], [\"40 ms\", 0.3]]\n";
    }
    if hand == 1 {
        text += "hand.inertia = \"1e-4 kg.m2\"\nhand.own_stiffness = 0.2\nhand.own_damping = 1e-3\n";
    }
    let method = ["conventional", "hybrid"][dice.of(2) as usize];
    let stiffness = dice.between(0.05, 2.0);
    text += &format!("method = {{ kind = \"{method}\", sample_rate = \"2 kHz\", position_bits = 16, ");
    text += "stiffness_format = \"(0,14,8)\", damping_format = \"(0,14,8)\" }\n";
    text + &format!("wall = {{ position = 0.05, stiffness = {stiffness:e}, damping = 1e-4 }}\n")
}

/// Holds networks of these seeds to the clock and to their energies.
fn hold_random(seeds: std::ops::Range<u64>) {
    let mut changes = 0;
    for seed in seeds {
        let text = random_network(&mut Dice(seed));
        let experiment = Experiment::Axis(scene(&text));
        let simulation = simulation(&experiment);
        let comparison = simulation.compare(20_000);
        assert_eq!(comparison.mismatches, 0, "seed {seed}: {:?}\n{text}", comparison.first);
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
        let (residual_j, all_j) = (summary.energy.residual_j.abs(), summary.energy.exchanged_j);
        assert!(residual_j <= 1e-12 * all_j, "seed {seed}: {residual_j:e} J of {all_j:e} J\n{text}");
        changes += summary.mode_changes;
    }
    assert!(changes > 100, "{changes} changes of modes");
}

#[test]
fn random_networks_leap_as_they_step() {
    hold_random(0..20);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_thousand_random_networks_leap_as_they_step() {
    hold_random(20..1020);
}

#[test]
fn what_a_scene_expects_is_in_the_units_of_its_wall() {
    let experiment = Experiment::Axis(scene(KNOB));
    let simulation = simulation(&experiment);
    let mut trace = simulation.brief_trace();
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::new());
    let at = |metric| hpu_cosim::metric(metric, &experiment, &summary, &trace).unwrap();
    // At rest the wall of 20 kN/m at 6 mm holds the rotor against the hand's spring and the cable in series, but for
    // the Coulomb friction: 0.5 N at the handle.
    let pull = 1.0 / (1.0 / 1388.9 + 1.0 / 20e3);
    let rest = (pull * 12e-3 + 20e3 * 6e-3) / (pull + 20e3);
    let doubt = 0.5 / (pull + 20e3) + 4.8e-6;
    assert!((at(Metric::FinalAngle) - rest).abs() < doubt, "{} of {rest}", at(Metric::FinalAngle));
    // More than it gives at rest, and no more than 10 A by 23 mN.m/A at 6 mm.
    let push = at(Metric::PeakTorque);
    assert!((20e3 * (rest - 6e-3)..=38.4).contains(&push), "{push} N");
}

/// The knob as a mass that an ideal force drives: stable up to 224 kN/m on time, and up to 75 kN/m a sample late.
const MASS: &str = r#"about = "A knob by its rotor and handle alone."
clock.frequency = "5 MHz"
run.duration = "600 ms"
encoder.resolution = "4.712 um"
amplifier.full_scale = "153 N"
device = { kind = "mass", mass = "0.14889 kg", damping = 0 }
method.kind = "conventional"
method.sample_rate = "4 kHz"
method.position_bits = 16
method.stiffness_format = "(0,16,4)"
method.pwm.bits = 16
wall.position = "6 mm"
hand.kind = "spring_damper"
hand.stiffness = "1388.889 N/m"
hand.damping = "27.7778 N.s/m"
hand.path = [["0 s", 0], ["50 ms", "12 mm"]]
"#;

#[test]
fn a_host_that_is_a_sample_late_makes_a_wall_swing() {
    let outcome = |stiffness: &str, late: u32, driver| {
        let text = format!("{MASS}wall.stiffness = \"{stiffness}\"\nhost.late = {late}\n");
        let experiment = Experiment::Axis(scene(&text));
        let simulation = simulation(&experiment);
        let mut trace = simulation.brief_trace();
        let summary = simulation.run(driver, &mut trace, &mut (), &Control::new());
        (summary.outcome().unwrap(), trace.last(hpu_cosim::ANGLE).map(f64::to_bits))
    };
    assert_eq!(outcome("60 kN/m", 1, Driver::Events).0, OutcomeKind::Settled);
    assert_eq!(outcome("120 kN/m", 0, Driver::Events).0, OutcomeKind::Settled);
    let swings = outcome("120 kN/m", 1, Driver::Events);
    assert_eq!(swings.0, OutcomeKind::LimitCycle);
    assert_eq!(swings, outcome("120 kN/m", 1, Driver::Clock));
}

/// A motor that starts in its wall, behind a host and a modulator.
const HOSTED: &str = r#"
about = "A host before a modulator."
clock.frequency = "10 MHz"
run.duration = "60 ms"
device = { kind = "motor", motor = "vasudevan_2007", initial_angle = 0.02 }
method.kind = "conventional"
method.sample_rate = "2 kHz"
method.pwm.bits = 9
wall = { position = "0.01 rad", stiffness = "0.5 N.m/rad", damping = "0.2 mN.m.s/rad" }
hand.kind = "spring_damper"
hand.stiffness = "0.3 N.m/rad"
hand.damping = "1 mN.m.s/rad"
hand.path = [["0 s", 0.02], ["1 ms", 0.03]]
host = { late = 1, latency = "13.3 us" }
"#;

#[test]
fn a_modulator_behind_a_host_switches_at_the_same_edges_whoever_drives() {
    let stuck =
        "faults = { stuck_switch = 'bridge.plus_high', stuck = 'open', stuck_from = '2 ms', stuck_to = '3 ms' }\n";
    let modes = [
        "",
        "method.pwm.duty = 'immediate'\n",
        "method.pwm.mode = 'locked_antiphase'\n",
        "method.pwm.dead_time = '0.5 us'\n",
        "method.pwm.off = 'float'\n",
        stuck,
    ];
    for mode in modes {
        let experiment = Experiment::Axis(scene(&format!("{HOSTED}{mode}")));
        let simulation = simulation(&experiment);
        let comparison = simulation.compare(100_000);
        assert_eq!(comparison.mismatches, 0, "{mode}: {:?}", comparison.first);
        let all = [Driver::Events, Driver::Clock].map(|driver| {
            let mut trace = simulation.brief_trace();
            let summary = simulation.run(driver, &mut trace, &mut (), &Control::new());
            let energy = summary.energy;
            assert!(energy.residual_j.abs() <= 1e-12 * energy.exchanged_j, "{mode}: {energy:?}");
            (trace.last(hpu_cosim::ANGLE).map(f64::to_bits), summary.mode_changes, summary.encoder_edges)
        });
        assert!(all[0] == all[1] && all[0].2 > 4, "{mode}: {all:?}");
    }
}

/// The hand imposes a constant speed, so the host changes nothing but when the pulses come: after two whole periods of
/// the modulator the current is what it was two periods before without a host.
#[test]
fn pulses_behind_a_host_are_those_without_one_later() {
    let swept = |more: &str| {
        let text = HOSTED.replace("host = { late = 1, latency = \"13.3 us\" }", more);
        let (head, _) = text.split_once("hand.kind = ").unwrap();
        let hand = "hand = { kind = \"prescribed\", path = [[\"0 s\", 0], [\"60 ms\", 0.3]] }\n";
        let head = head.replace(", initial_angle = 0.02", "");
        let experiment = Experiment::Axis(scene(&format!("{head}{hand}{more}\n")));
        let simulation = simulation(&experiment);
        let mut closed = simulation.closed_loop();
        let (mut edge, mut currents) = (0, Vec::new());
        while edge < 400_000 {
            edge += 512;
            while closed.edge() < edge + 77 {
                closed.leap(edge + 77, &mut ());
            }
            let mut row = Vec::new();
            closed.world().reals(edge + 77, &mut row);
            currents.push(row[0]);
        }
        currents
    };
    let (plain, late) = (swept(""), swept("host.latency = \"102.4 us\""));
    let mut compared = 0;
    // After 20 ms nothing is left of how the current began.
    for (before, after) in plain.iter().zip(&late[2..]).skip(400) {
        assert!((before - after).abs() < 1e-12, "{before} A and {after} A");
        compared += u32::from(before.abs() > 0.01);
    }
    assert!(compared > 200, "{compared}");
}

/// Returns a scene whose method reads the words of an absolute sensor, which is where the encoder is.
fn reading_words(text: &str, sensor: &str) -> String {
    let inline = text.replace("method = { kind", "method = { position = \"word\", kind");
    let by_key = if inline == text { "method.position = \"word\"\n" } else { "" };
    format!("{inline}device.sensors.word = {{ kind = \"absolute\", {sensor} }}\n{by_key}")
}

/// Words of the encoder's counts, taken at every clock and without latency, are the encoder's lines: every net of the
/// loop and every bit of the motion is the same.
#[test]
fn words_of_the_encoders_counts_at_every_clock_are_the_encoder() {
    let knob = KNOB.replace("lines = 2000", "lines = 2048");
    let mut all = vec![
        (reading_words(&knob, "on = \"rotor\", bits = 13, rate = \"1024 kHz\""), knob.clone()),
        (reading_words(WHEEL, "on = \"wheel\", bits = 12, rate = \"1 MHz\""), WHEEL.to_string()),
    ];
    for (kind, more) in [
        ("sampled_wall", ""),
        ("virtual_coupling", "method.coupling_stiffness = \"1 N.m/rad\"\n"),
        ("passivity_controller", ""),
        ("passive_spring", ""),
        ("energy_bounding", "method.c1 = \"1 N.m/rad\"\nmethod.c2 = \"1 N.m/rad\"\n"),
        ("braking_pulse", ""),
        ("table", "method.torques = [0, \"5 mN.m\", 0, \"-5 mN.m\"]\nmethod.spacing = 64\n"),
    ] {
        let text = knob.replace("kind = \"conventional\"", &format!("kind = \"{kind}\"")) + more;
        let text = text.replace("method.stiffness_format = \"(0,10,8)\"\nmethod.damping_format = \"(0,12,4)\"\n", "");
        let text = text.replace("20 kN/m\", damping = \"13.9 N.s/m\"", "2 kN/m\"");
        all.push((reading_words(&text, "on = \"rotor\", bits = 13, rate = \"1024 kHz\""), text));
    }
    for seed in 0..12 {
        let text = random_network(&mut Dice(seed));
        let on = text.split("encoder = { on = ").nth(1).and_then(|rest| rest.split(',').next()).unwrap();
        all.push((reading_words(&text, &format!("on = {on}, bits = 13, rate = \"1 MHz\"")), text));
    }
    for (words, text) in &all {
        let experiments = [words, text].map(|text| Experiment::Axis(scene(text)));
        let simulations = experiments.each_ref().map(simulation);
        let mut closed = simulations.each_ref().map(|simulation| simulation.closed_loop());
        let mut moved = 0;
        for edge in 1..=60_000 {
            closed.iter_mut().for_each(|closed| closed.step());
            let [words, lines] = closed.each_ref();
            assert_eq!(words.wiring().words(), lines.wiring().words(), "edge {edge}\n{text}");
            if edge % 1000 == 0 {
                let [words, lines] = [words, lines].map(|it| (0..4).map(|k| it.world().real(edge, k).to_bits()));
                assert!(words.eq(lines), "edge {edge}");
                moved += u64::from(closed[0].world().real(edge, 2) != 0.0);
            }
        }
        assert!(moved > 10, "{moved}\n{text}");
    }
}

/// Lines that follow a slow and late sensor, computed from the counts alone: a count each clock towards that of the
/// latest word.
#[test]
fn lines_follow_the_words_of_a_late_sensor() {
    let slow = "on = \"rotor\", bits = 13, rate = \"20 kHz\", phase = \"3 us\", latency = \"7 us\"";
    let text = reading_words(&KNOB.replace("lines = 2000", "lines = 2048"), slow);
    let experiment = Experiment::Axis(scene(&text));
    let simulation = simulation(&experiment);
    let mut closed = simulation.closed_loop();
    let position = closed.wiring().nets().iter().position(|net| net.name == "position").unwrap();
    let count = |angle: f64| (angle * 8192.0 / std::f64::consts::TAU).floor() as i64;
    // Periods, phase and latency in clocks of 1024 kHz.
    let (period, phase, late) = (51, 3, 7);
    let (mut counts, mut shown, mut positions) = (vec![0], vec![0i64], vec![0]);
    for edge in 1..60_000usize {
        closed.step();
        counts.push(count(closed.world().real(edge as u64, 2)));
        positions.push(closed.wiring().words()[position]);
        let sampled = (edge >= phase + late).then(|| edge - late - (edge - late - phase) % period);
        let wanted = sampled.map_or(0, |sampled| counts[sampled]);
        shown.push(shown[edge - 1] + (wanted - shown[edge - 1]).signum());
    }
    // Synchronisers, decoder and counter take some clocks, the same always.
    let delays: Vec<_> = (0..8)
        .filter(|delay| (8..60_000).all(|edge| positions[edge] == shown[edge - delay].rem_euclid(1 << 16)))
        .collect();
    assert_eq!(delays.len(), 1, "{delays:?}");
    let changes = shown.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let apart = counts.iter().zip(&shown).filter(|(count, shown)| count != shown).count();
    assert!(changes > 500 && apart > 10_000, "{changes} changes, {apart} apart");
    // Noise, errors and a lag change words, not the agreement of the drivers.
    for more in ["noise = 2", "harmonics = [[3, 0]]", "corner = \"300 Hz\""] {
        let experiment = Experiment::Axis(scene(&reading_words(KNOB, &format!("{slow}, {more}"))));
        let comparison = WiredSimulation::new(&experiment).unwrap().compare(60_000);
        assert_eq!((comparison.edges, comparison.mismatches), (60_000, 0), "{more}: {:?}", comparison.first);
    }
}
