//! The linear loop as driven: against known answers, and against a loop whose registers are stepped clock by clock.

use hpu_cosim::SplitMix64;
use hpu_cosim::scene::{BridgeModel, Device, Scene, shipped};

use super::controller::Damping;
use super::driven::{DrivenSet, held, searched};
use super::pulses::{MOST_PLANT, Pulses};
use super::stable::StableSet;
use crate::SampledLoop;
use crate::sampled::{Matrix, exponential, scaled};
use crate::waits::{Drive, Rest, waits};

fn known(name: &str, set: &[(&str, String)]) -> Scene {
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("it is shipped");
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
    Scene::parse(name, shipped.text, &set, &mut |_| unreachable!("no file is named"))
        .unwrap_or_else(|e| panic!("{e:#}"))
}

fn pulses(name: &str) -> Pulses<3> {
    Pulses::new(&known(name, &[])).expect("a modulator")
}

/// Critical stiffnesses at a fixed duty, as brackets with the stable stiffness first: computed in ball arithmetic of
/// 384 to 8000 bits, with the criterion of Schur and Cohn at both ends.
const CRITICAL: [(&str, f64, [f64; 2]); 7] = [
    ("hybrid-wall", 0.25, [3.175_272_609_926_76, 3.175_272_609_934_21]),
    ("hybrid-wall", 0.0, [3.774_097_814_038_39, 3.774_097_814_045_85]),
    ("conventional-wall-10khz", 0.25, [2.919_862_165_274_098, 2.919_862_165_274_68]),
    ("conventional-wall-10khz", 0.0, [3.328_763_973_351_306, 3.328_763_973_352_033]),
    ("conventional-wall-1khz", 0.25, [0.771_218_862_898_647, 0.771_218_862_906_098]),
    ("conventional-wall-1khz", 0.0, [0.797_963_376_469_910, 0.797_963_376_477_360]),
    ("slow-pwm", 0.25, [1.086_055_526_763_107, 1.086_055_526_768_928]),
];

#[test]
fn known_critical_stiffnesses_are_proved_on_both_sides_within_a_billionth() {
    for (name, duty, [stable, unstable]) in CRITICAL {
        let mut pulses = pulses(name);
        pulses.rest = Rest::Duty(duty);
        let [below, above] = [stable * (1.0 - 4.5e-10), unstable * (1.0 + 4.5e-10)];
        assert!(pulses.settles([below; 2]), "{name} at {duty}: {below} is not proved to settle");
        assert!(pulses.persists(above), "{name} at {duty}: {above} is not proved to persist");
        // Neither proof holds on the other side.
        assert!(!pulses.settles([above; 2]) && !pulses.persists(below), "{name} at {duty}");
        let growths = [stable, unstable].map(|stiffness| pulses.growth_per_s(stiffness));
        assert!(growths.iter().all(|growth| growth.abs() < 1e-8), "{name} at {duty}: {growths:?}");
    }
}

/// The duty at rest of those answers: the hand's spring ends 1.8 - 1.5002 rad behind the wall.
const REST: Rest = Rest::Spring { stiffness: 0.3, duty: 0.3 * (1.8 - 1.5002) / 0.265 };

#[test]
fn the_loop_at_rest_has_the_known_limits_and_growth() {
    for (name, limit) in [
        ("hybrid-wall", 3.061_756_49),
        ("conventional-wall-10khz", 2.840_438_39),
        ("conventional-wall-1khz", 0.771_796_81),
        ("slow-pwm", 1.041_459_16),
    ] {
        let mut pulses = pulses(name);
        pulses.rest = REST;
        assert!(pulses.settles([limit * (1.0 - 5e-9); 2]), "{name}");
        assert!(pulses.persists(limit * (1.0 + 5e-9)), "{name}");
    }
    let mut pulses = pulses("hybrid-wall");
    pulses.rest = REST;
    for (stiffness, growth) in [(1.5, -86.564_989), (2.5, -29.184_091), (3.0, -3.122_485), (3.2, 6.919_801)] {
        let found = pulses.growth_per_s(stiffness);
        assert!((found - growth).abs() < 1e-6, "{stiffness}: {found}, not {growth}");
    }
}

fn end(set: &StableSet) -> f64 {
    let first = set.stable.first().unwrap_or_else(|| panic!("none settles: {set:?}"));
    assert!(first.from.beyond.is_none() && first.to.uncertainty() <= 5e-10 * first.to.at, "{set:?}");
    first.to.middle()
}

#[test]
fn each_drive_of_the_shipped_walls_has_the_limit_at_which_their_motion_leaps() {
    let text = |key: &'static str, value: &str| (key, value.to_string());
    let (immediate, antiphase) = (text("method.pwm.duty", "immediate"), text("method.pwm.mode", "locked_antiphase"));
    let averaged = text("model.bridge", "averaged");
    // Limits computed at the wall 1.5002 rad; the scenes' own walls lie a thirtieth of a milliradian farther.
    for (name, set, limit) in [
        ("hybrid-wall", vec![], 3.061_756_5),
        ("hybrid-wall", vec![averaged], 3.061_756_5),
        ("hybrid-wall", vec![immediate], 3.774_287_8),
        ("hybrid-wall", vec![antiphase], 2.541_075_2),
        ("conventional-wall-10khz", vec![], 2.840_438_4),
        ("conventional-wall-1khz", vec![], 0.771_796_8),
    ] {
        let scene = known(name, &set);
        let found = DrivenSet::new(&scene, [0.05, 20.0]).expect("a modulator");
        let limit_found = end(&found.set);
        assert!((limit_found / limit - 1.0).abs() < 1e-4, "{name} {set:?}: {limit_found}, not {limit}");
        assert_eq!((found.set.stable.len(), found.set.open.len()), (1, 0), "{name} {set:?}: {found:?}");
    }
}

/// The loop with all of its registers, clock by clock.
struct Clocked {
    /// Current, speed, angle, other states of the plant and effort over a clock.
    flow: Matrix,
    /// The current's change by a unit of command.
    kick: f64,
    sample: u64,
    drive: Drive,
    /// Clocks from the start of a modulator's period to the pulse's end.
    pulse: u64,
    /// Clocks for which a command settles, and those that the host hands it on later.
    settling: usize,
    is_live: bool,
    spring: f64,
    damper: f64,
}

/// The encoder's lines in synchronizer, decoder and counter.
const LINES: usize = 4;

impl Clocked {
    fn new(scene: &Scene, stiffness: f64, pulse: u64) -> Self {
        let Device::Motor(motor) = &scene.device else { panic!("a motor") };
        let (grip, grip_damping) = scene.hand.grip();
        let (r, l) = (motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm, motor.inductance_h);
        let (k, j) = (motor.torque_constant_nm_per_a, motor.inertia_kg_m2());
        let drag = motor.viscous_friction_nm_s_per_rad + grip_damping;
        let plant = vec![
            vec![-r / l, -k / l, 0.0, r / (k * l)],
            vec![k / j, -drag / j, -grip / j, 0.0],
            vec![0.0, 1.0, 0.0, 0.0],
            vec![0.0; 4],
        ];
        Self::around(plant, r / (k * l), scene, stiffness, pulse)
    }

    /// The loop of a plant whose current rises by `push` a second under a unit of effort.
    fn around(plant: Matrix, push: f64, scene: &Scene, stiffness: f64, pulse: u64) -> Self {
        let (drive, clock_s) = (Drive::of(scene), scene.clock.period_s());
        let period = if let Drive::Pulses { period, .. } = drive { period } else { 1 };
        Self {
            flow: exponential(&scaled(&plant, clock_s)),
            kick: push * period as f64 * clock_s,
            sample: scene.period_clocks(),
            drive,
            pulse,
            settling: (u64::from(scene.method.settling) + scene.host_clocks) as usize,
            is_live: scene.method.kind.is_live(),
            spring: stiffness,
            damper: scene.wall.damping_nm_s_per_rad / scene.sample_period_s(),
        }
    }

    /// Steps a state through a number of clocks: plant, lines, sampled position, velocity, commands that settle, and
    /// the command that the modulator holds.
    fn run(&self, state: &mut [f64], clocks: u64) {
        let plant = self.flow.len() - 1;
        let (lines, sampled, velocity) = (plant, plant + LINES, plant + 1 + LINES);
        let (first, held) = (plant + 2 + LINES, plant + 2 + LINES + self.settling);
        let torque = |state: &[f64]| {
            let position = if self.is_live { state[lines + LINES - 1] } else { state[sampled] };
            -(self.spring * position + self.damper * state[velocity])
        };
        let command = |state: &[f64]| if self.settling == 0 { torque(state) } else { state[held - 1] };
        for clock in 1..=clocks {
            let effort = if self.drive == Drive::Held { command(state) } else { 0.0 };
            let all: Vec<f64> = state[..plant].iter().copied().chain([effort]).collect();
            for (x, row) in state.iter_mut().zip(&self.flow).take(plant) {
                *x = row.iter().zip(&all).map(|(of, x)| of * x).sum();
            }
            let (wanted, shown, counted) = (torque(state), command(state), state[lines + LINES - 1]);
            state.copy_within(lines..lines + LINES - 1, lines + 1);
            state[lines] = state[2];
            if (clock - 1).is_multiple_of(self.sample) {
                state[velocity] = counted - state[sampled];
                state[sampled] = counted;
            }
            if self.settling > 0 {
                state.copy_within(first..held - 1, first + 1);
                state[first] = wanted;
            }
            let Drive::Pulses { period, latched, .. } = self.drive else {
                state[held] = 0.0;
                continue;
            };
            let phase = (clock - 1) % period;
            if !latched {
                state[held] = 0.0;
                if phase == self.pulse % period {
                    state[0] += self.kick * shown;
                }
                continue;
            }
            if phase == 0 && self.pulse == period {
                state[0] += self.kick * state[held];
            }
            if phase == 0 {
                state[held] = shown;
            }
            if phase == self.pulse {
                state[0] += self.kick * state[held];
            }
        }
    }

    /// Returns the logarithm of the growth over this number of clocks.
    fn log_growth(&self, clocks: u64) -> f64 {
        let size = self.flow.len() + 2 + LINES + self.settling;
        let columns: Vec<Vec<f64>> = (0..size)
            .map(|of| {
                let mut state = vec![0.0; size];
                state[of] = 1.0;
                self.run(&mut state, clocks);
                state
            })
            .collect();
        let rows = (0..size).map(|row| columns.iter().map(|column| column[row]).collect()).collect();
        libm::log(SampledLoop::of(rows).spectral_radius())
    }
}

#[test]
fn no_proved_stretch_of_random_loops_has_a_loop_that_grows_clock_by_clock() {
    random_loops(160, false);
}

#[test]
fn no_proved_stretch_of_random_loops_behind_a_host_has_a_loop_that_grows_clock_by_clock() {
    random_loops(16, true);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn no_proved_stretch_of_a_thousand_random_loops_has_a_loop_that_grows_clock_by_clock() {
    random_loops(1000, false);
    random_loops(1000, true);
}

fn random_loops(count: usize, hosted: bool) {
    let mut random = SplitMix64::new(58);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (mut some, mut proved, mut ended, mut compared, mut inside, mut drives) = (0, 0, 0, 0, [0; 2], [0; 4]);
    for index in 0..count {
        let among = |share: f64, from: u64, to: u64| from + (share * (to - from + 1) as f64) as u64;
        let (bits, sample, settling) = (among(share(), 3, 5), among(share(), 16, 100), among(share(), 0, 9));
        let (live, antiphase) = (share() < 0.5, share() < 0.5);
        let kind = index % 4;
        drives[kind] += 1;
        let host = if hosted { among(share(), 1, 4 << bits) } else { 0 };
        let set = [
            ("clock.frequency", "1 MHz".to_string()),
            ("method.kind", if live { "hybrid" } else { "conventional" }.into()),
            ("method.sample_rate", format!("{:e}", 1e6 / sample as f64)),
            ("method.settling", settling.to_string()),
            ("host.latency", format!("{host} us")),
            ("method.pwm.bits", bits.to_string()),
            ("method.pwm.duty", if kind % 2 == 0 { "latched" } else { "immediate" }.into()),
            ("method.pwm.mode", if antiphase { "locked_antiphase" } else { "sign_magnitude" }.into()),
            ("model.bridge", if kind < 2 { "switching" } else { "averaged" }.into()),
            ("method.stiffness_format", "(0,8,24)".into()),
            ("method.damping_format", "(0,8,24)".into()),
            ("device.inductance", format!("{:e}", 1e-4 * (1.0 + 9.0 * share()))),
            ("device.rotor_inertia", format!("{:e}", 1e-6 * (1.0 + 9.0 * share()))),
            ("hand.stiffness", format!("{:e}", 0.01 + share())),
            ("wall.damping", format!("{:e}", 3e-4 * share())),
        ];
        let live = live && kind != 3;
        let set = set
            .map(|(key, value)| (key, if key == "method.kind" && !live { "conventional".to_string() } else { value }));
        let scene = known("hybrid-wall", &set);
        assert_eq!(scene.period_clocks(), sample);
        let drive = Drive::of(&scene);
        let range: [f64; 2] = [0.05, 200.0];
        let (period, words) = (1u64 << bits, among(share(), 0, 1 << (bits - 1)));
        let duty = |words: u64| 2.0 * words as f64 / period as f64;
        let pulse = |words: u64| match (drive, antiphase) {
            (Drive::Held, _) => 0,
            (_, true) => period / 2 + words,
            (_, false) => 2 * words,
        };
        // Every second loop has a hand whose duty depends on the stiffness. Its pulses end at a whole clock at some
        // stiffnesses only.
        let (hand, leans) = (scene.hand.grip().0, 0.2 + 2.0 * share());
        let is_spring = index / 4 % 2 == 1 && drive != Drive::Held;
        let rest = if is_spring { Rest::Spring { stiffness: hand, duty: leans } } else { Rest::Duty(duty(words)) };
        let range = [range[0], rest.full_from().filter(|_| is_spring).map_or(range[1], |full| full.min(range[1]))];
        let clocked = |[low, high]: [f64; 2], shares: [f64; 3]| -> Vec<(f64, u64)> {
            if !is_spring {
                return shares.map(|share| (low * (high / low).powf(share), pulse(words))).to_vec();
            }
            let at = |words: u64| (hand * duty(words) / (leans - duty(words)), pulse(words));
            let all = (1..period / 2).filter(|words| duty(*words) < leans).map(at);
            all.filter(|(stiffness, _)| (low..=high).contains(stiffness)).collect()
        };
        let grid = (1..=period).rev().find(|k| period % k == 0 && sample.is_multiple_of(*k)).expect("one");
        let clocks = if drive == Drive::Held { sample } else { sample * period / grid };
        let grows = |(stiffness, pulse): (f64, u64)| Clocked::new(&scene, stiffness, pulse).log_growth(clocks);
        let anywhere = |share: f64| range[0] * (range[1] / range[0]).powf(share);
        let pulses = (drive != Drive::Held).then(|| {
            let mut pulses = Pulses::new(&scene).expect("a modulator");
            pulses.rest = rest;
            pulses
        });
        if let Some(pulses) = &pulses {
            let (stiffness, pulse) = clocked(range, [share(); 3]).first().copied().unwrap_or((range[0], 0));
            let (own, other) = (pulses.growth_per_s(stiffness) * pulses.common_s(), grows((stiffness, pulse)));
            // Where a pulse that is read at its end ends with a clock, rounding of the duty decides which one reads it.
            let is_near = is_spring && kind == 1;
            if other > -12.0 && stiffness > range[0] && !is_near {
                compared += 1;
                assert!((own - other).abs() < 1e-6 * (1.0 + other.abs()), "{index} at {stiffness}: {own}, {other}");
            }
            for _ in 0..6 {
                let low = anywhere(share());
                let high = (low * (1.0 + 3.0 * share() * share())).min(range[1]);
                if pulses.settles([low, high]) {
                    some += 1;
                    for at in clocked([low, high], [0.0, share(), 1.0]) {
                        inside[usize::from(is_spring)] += 1;
                        let growth = grows(at);
                        assert!(growth < 1e-8, "{index}: grows by e^{growth} at {at:?}, within {low} to {high}");
                    }
                }
            }
        }
        // The whole set takes a hundred such proofs.
        let set = match &pulses {
            None => held(&scene, drive, range, 0).expect("a sampled loop"),
            Some(pulses) if index < count / 10 => searched(pulses, &scene, range, 30).0,
            Some(_) => continue,
        };
        for stretch in &set.stable {
            proved += 1;
            let [from, to] = [stretch.from.at, stretch.to.at];
            for at in clocked([from, to], [0.0, share(), 1.0]) {
                inside[usize::from(is_spring)] += 1;
                let growth = grows(at);
                assert!(growth < 1e-8, "{index}: grows by e^{growth} at {at:?}, within {from} to {to}");
            }
            for (end, outwards) in [(stretch.from, -1.0), (stretch.to, 1.0)] {
                let Some(beyond) = end.beyond.filter(|_| !is_spring) else { continue };
                ended += 1;
                assert!((end.at / beyond - 1.0).abs() < 2e-6, "{index}: {end:?}");
                let growth = grows((beyond * (1.0 + 1e-7 * outwards), pulse(words)));
                assert!(growth > -1e-8, "{index}: decays by e^{growth} beyond {beyond}");
            }
        }
    }
    let counts = (some, proved, ended, compared, inside);
    // The later a command, the fewer walls are stable. Of fewer loops the share is less certain.
    let (most, springs) = match (hosted, count) {
        (true, _) => (count / 2, 0),
        (_, ..1000) => (count * 9 / 10, count / 5 + 1),
        _ => (count, count / 5 + 1),
    };
    assert!(inside[1] >= springs, "{counts:?}");
    let enough = some > most && proved > count * 3 / 10 && ended > count / 4 && compared > count / 2;
    assert!(enough && drives == [count / 4; 4], "{counts:?}");
}

#[test]
fn a_search_that_would_take_minutes_ends_and_says_what_it_leaves_unknown() {
    let scene = known("ringing-wall", &[("method.pwm.bits", "4".into())]);
    let range = crate::linear::usual_range(&scene);
    let damping = Damping::Fixed(scene.wall.damping_nm_s_per_rad);
    let set = StableSet::new(&scene, damping, range).expect("a linear loop");
    assert!(set.ended && set.said().contains("unknown, the search was ended"), "{set:?}");
    // What is told is right: the loop decays at the end of the first stretch.
    let stretch = set.stable.first().expect("a stretch");
    let radius = SampledLoop::new(&scene, stretch.to.at, scene.wall.damping_nm_s_per_rad).spectral_radius();
    assert!(stretch.from.at == range[0] && radius < 1.0, "{stretch:?}: {radius}");
    let all = set.open.last().expect("a stretch that is open");
    assert!(all[0] <= 1.001 * stretch.to.at && all[1] == range[1], "{set:?}");
}

#[test]
fn a_wall_that_a_ramp_changes_has_no_linear_loop() {
    let ramp = [("wall.ramp.stiffness", "1"), ("wall.ramp.from", "100 ms"), ("wall.ramp.to", "300 ms")];
    let scene = known("hybrid-wall", &ramp.map(|(key, value)| (key, value.to_string())));
    let reason = DrivenSet::new(&scene, [0.05, 20.0]).expect_err("no loop of one wall");
    assert_eq!(reason.why, "wall.ramp changes its wall during the run");
    let damping = Damping::Fixed(scene.wall.damping_nm_s_per_rad);
    let ideal = StableSet::new(&scene, damping, [0.05, 20.0]).expect_err("no loop of one wall");
    assert!(ideal.to_string().contains("wall.ramp"), "{ideal}");
}

#[test]
fn a_modulator_s_wait_is_a_whole_period_where_no_hand_brings_the_device_to_rest() {
    // 2^12 clocks of 20 ns.
    let period_s = 81.92e-6;
    for (name, hand) in [("floating-motor", "none"), ("prescribed-sweep", "prescribed")] {
        let found = waits(&known(name, &[]));
        let wait = found.iter().find(|wait| wait.what.starts_with("the modulator")).expect("it waits");
        assert!(wait.what.ends_with("at most") && (wait.seconds / period_s - 1.0).abs() < 1e-12, "{hand}: {wait:?}");
    }
    assert!(waits(&known("hybrid-wall", &[])).iter().any(|wait| wait.what == "the modulator, at rest"));
}

#[test]
fn a_loop_that_is_not_worked_out_says_why_and_what_the_ideal_drive_leaves_out() {
    for (set, why, wait) in [
        (("method.pwm.dead_time", "2 us"), "dead time", ("the bridge's dead time", 2e-6)),
        (("method.pwm.off", "float"), "leaves the winding open", ("synchronizer, decoder and counter", 8e-8)),
    ] {
        let scene = known("hybrid-wall", &[(set.0, set.1.to_string())]);
        let reason = DrivenSet::new(&scene, [0.05, 20.0]).expect_err(why);
        assert!(reason.why.contains(why), "{reason:?}");
        let told = reason.left_out.iter().find(|left| left.what == wait.0).unwrap_or_else(|| panic!("{reason:?}"));
        assert!((told.seconds / wait.1 - 1.0).abs() < 1e-12, "{reason:?}");
        assert!(reason.left_out.iter().any(|left| left.what == "the modulator, at rest"), "{reason:?}");
    }
    let scene = known("hybrid-wall", &[("model.bridge", "averaged".into())]);
    assert_eq!(scene.model.bridge, BridgeModel::Averaged);
    assert!(DrivenSet::new(&scene, [0.05, 20.0]).expect("pulses in its place").is_averaged);
}

/// A wheel on a bridge, as a network and as a motor: the same duty at rest, growth and proofs.
#[test]
fn a_wheel_as_a_network_has_the_set_of_its_motor() {
    let motor = known("hybrid-wall", &[]);
    let Device::Motor(wheel) = motor.device else { panic!("a motor") };
    let text = format!(
        "about = 'A wheel.'\nclock.frequency = {:e}\nrun.duration = '1 s'\ndevice.kind = 'network'\n\
         device.bodies.wheel = {{ inertia = {:e}, viscous_friction = {:e} }}\n\
         device.drive = {{ kind = 'bridge', on = 'wheel', torque_constant = {:e}, resistance = {:e}, \
         inductance = {:e} }}\n\
         encoder = {{ on = 'wheel', lines = 1024 }}\nmethod.kind = 'hybrid'\nmethod.damping_format = '(0,8,4)'\n\
         method.sample_rate = '1 kHz'\nwall = {{ position = 1.5, stiffness = 1.5, damping = '0.1 mN.m.s/rad' }}\n\
         hand = {{ kind = 'spring_damper', on = 'wheel', stiffness = {:e}, damping = {:e}, \
         path = [['0 s', 0], ['1 s', 1.8]] }}\n",
        motor.clock.frequency_hz() as f64,
        wheel.inertia_kg_m2(),
        wheel.viscous_friction_nm_s_per_rad,
        wheel.torque_constant_nm_per_a,
        wheel.resistance_ohm,
        wheel.inductance_h,
        motor.hand.grip().0,
        motor.hand.grip().1,
    );
    let scene = Scene::parse("wheel", &text, &[], &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.encoder, scene.bridge, scene.wall), (motor.encoder, motor.bridge, motor.wall));
    let [own, known] = [&scene, &motor].map(|scene| DrivenSet::new(scene, [0.05, 20.0]).expect("a modulator"));
    assert!((end(&own.set) / end(&known.set) - 1.0).abs() < 1e-9, "{:?} {:?}", own.set, known.set);
    for (own, known) in own.duty.expect("a duty").into_iter().zip(known.duty.expect("a duty")) {
        assert!((own / known - 1.0).abs() < 1e-12, "{own} {known}");
    }
    let network = scene.network.as_deref().expect("a network");
    let (own, motor) = (Pulses::<3>::of_network(&scene, network).expect("pulses"), pulses("hybrid-wall"));
    for stiffness in [0.1, 1.0, 3.0, 3.2, 8.0] {
        let [own, known] = [own.growth_per_s(stiffness), motor.growth_per_s(stiffness)];
        assert!((own - known).abs() < 1e-7 * (1.0 + known.abs()), "{stiffness}: {own} {known}");
    }
}

/// Networks of two bodies on a bridge, against all of their registers clock by clock.
#[test]
fn no_proved_stretch_of_random_networks_grows_clock_by_clock() {
    let mut random = SplitMix64::new(62);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (mut proved, mut compared) = (0, 0);
    for index in 0..24 {
        let among = |share: f64, from: u64, to: u64| from + (share * (to - from + 1) as f64) as u64;
        let (bits, sample) = (among(share(), 3, 5), among(share(), 16, 60));
        let [l, j1, j2] = [1e-4 * (1.0 + 4.0 * share()), 1e-6 * (1.0 + 9.0 * share()), 1e-5 * (1.0 + 9.0 * share())];
        let [r, k, ratio] = [1.0 + share(), 0.02 * (1.0 + share()), 1.0 + 5.0 * share()];
        let [d1, d2] = [1e-6 * share(), 1e-5 * share()];
        let [stiff, damp] = [20.0 * (1.0 + 4.0 * share()), 2e-3 * (1.0 + share())];
        let [hand, drag] = [0.1 + share(), 2e-3 * (1.0 + share())];
        let (live, host) = (index % 2 == 0, if index % 3 == 0 { among(share(), 1, 2 << bits) } else { 0 });
        let damping = 1e-4 * share();
        let text = format!(
            "about = 'Two bodies.'\nclock.frequency = '1 MHz'\nrun.duration = '1 s'\ndevice.kind = 'network'\n\
             device.bodies.rotor = {{ inertia = {j1:e}, viscous_friction = {d1:e} }}\n\
             device.bodies.knob = {{ inertia = {j2:e}, viscous_friction = {d2:e} }}\n\
             device.joints.belt = {{ from = 'rotor', to = 'knob', ratio = {ratio:e}, stiffness = {stiff:e}, \
             damping = {damp:e} }}\n\
             device.drive = {{ kind = 'bridge', on = 'rotor', torque_constant = {k:e}, resistance = {r:e}, \
             inductance = {l:e} }}\n\
             encoder = {{ on = 'rotor', lines = 1024 }}\nmethod.kind = '{}'\nmethod.sample_rate = {:e}\n\
             method.pwm.bits = {bits}\nmethod.pwm.duty = '{}'\nmethod.stiffness_format = '(0,8,24)'\n\
             method.damping_format = '(0,8,24)'\nmethod.period_bits = 24\nhost.latency = '{host} us'\n\
             wall = {{ position = 1, stiffness = 1, damping = {damping:e} }}\n\
             hand = {{ kind = 'spring_damper', on = 'knob', stiffness = {hand:e}, damping = {drag:e}, \
             path = [['0 s', 0]] }}\n",
            if live { "hybrid" } else { "conventional" },
            1e6 / sample as f64,
            if index % 4 < 2 { "latched" } else { "immediate" },
        );
        let scene = Scene::parse("two", &text, &[], &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{error}"));
        let network = scene.network.as_deref().expect("a network");
        let mut own = Pulses::<MOST_PLANT>::of_network(&scene, network).unwrap_or_else(|error| panic!("{error}"));
        // A pulse that ends with a clock.
        let period = 1u64 << bits;
        let pulse = among(share(), 0, period / 2);
        own.rest = Rest::Duty(pulse as f64 / period as f64);
        let (way, ohm) = (1.0 / ratio, r + 2.0 * scene.bridge.on_resistance_ohm);
        // Current, speed and angle of the rotor, speed and angle of the knob, and the effort.
        let plant = vec![
            vec![-ohm / l, -k / l, 0.0, 0.0, 0.0, 0.0],
            vec![
                k / j1,
                -(d1 + way * way * damp) / j1,
                -way * way * stiff / j1,
                way * damp / j1,
                way * stiff / j1,
                0.0,
            ],
            vec![0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            vec![0.0, way * damp / j2, way * stiff / j2, -(damp + d2 + drag) / j2, -(stiff + hand) / j2, 0.0],
            vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            vec![0.0; 6],
        ];
        let clocks = (own.common_s() * 1e6).round() as u64;
        let grows =
            |stiffness: f64| Clocked::around(plant.clone(), ohm / (k * l), &scene, stiffness, pulse).log_growth(clocks);
        for _ in 0..4 {
            let low = 0.01 * libm::pow(1e3, share());
            let (growth, known) = (own.growth_per_s(low) * own.common_s(), grows(low));
            if known > -12.0 {
                compared += 1;
                assert!((growth - known).abs() < 1e-6 * (1.0 + known.abs()), "{index} at {low}: {growth}, {known}");
            }
            let high = low * (1.0 + 0.5 * share());
            if own.settles([low, high]) {
                proved += 1;
                for at in [low, 0.5 * (low + high), high] {
                    let growth = grows(at);
                    assert!(growth < 1e-8, "{index}: grows by e^{growth} at {at}, within {low} to {high}");
                }
            }
            let (persists, growth) = (own.persists(low), grows(low));
            assert!(!persists || growth > -1e-8, "{index} at {low}: {growth}");
        }
    }
    assert!(proved > 20 && compared > 60, "{proved} {compared}");
}
