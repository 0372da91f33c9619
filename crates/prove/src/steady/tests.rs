//! Bounds of random loops and of staircases, against exact pulses and brute force.

use hpu_cosim::scene::{Device, Hand, Scene, shipped};
use hpu_cosim::{Rest, Standing};

use super::levels::Matrix;
use super::search::{Family, Sampled, from_deviation, unit_of};
use super::*;
use crate::certify::{Checked, Window, certify, check, stale_gain, start, until_read, window};
use crate::interval::Interval;
use crate::sampled::{exponential, scaled};

fn known(name: &str, set: &[(&str, &str)]) -> Scene {
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("it is shipped");
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
    Scene::parse(name, shipped.text, &set, &mut |_| unreachable!()).expect("a scene")
}

fn undamped(set: &[(&str, &str)]) -> Scene {
    known("hybrid-wall", &[&[("wall.damping", "0")], set].concat())
}

/// Returns a loop of a real stiffness with the pulse's end at a whole clock.
fn at(stiffness: f64, act: f64) -> Sampled {
    let scene = undamped(&[]);
    let words = scene.words().expect("words");
    let step = words.realised.torque_quantum_nm / words.realised.count_rad;
    Sampled::of(&scene, &words, unit_of(&scene), stiffness / step, Some(act)).unwrap_or_else(|why| panic!("{why}"))
}

#[test]
fn levels_and_sums_are_those_of_other_numerics() {
    // lambda(1.5, h 120), lambda(1.0, h 64), half of the sums at 1.5, 1.0 and 0.5; the pulse ends at 1024 of 4096.
    for (stiffness, climb, level) in [(1.5, 120.0, 2.359_305_674_998_9), (1.0, 64.0, 0.591_718_395_414_17)] {
        let spectrum = at(stiffness, 1024.0).dissipation([0.0; 3], [0.0, 0.0]).responses();
        let weights = [climb, 1e-14, 1e-14, 1e-14, 1e-14];
        let found = spectrum.iter().fold(0.0, |most: f64, at| most.max(at.level(weights)));
        // The grid misses the maximum by no more than its steps allow.
        assert!(found <= level * (1.0 + 1e-9) && found > level * (1.0 - 2e-3), "{stiffness}: {found}");
    }
    for (stiffness, sum) in [(1.5, 3.924_120_675_601_8), (1.0, 2.414_751_600_245_6), (0.5, 1.268_763_989_633_7)] {
        let found = 0.5 * at(stiffness, 1024.0).sums[0][2];
        assert!((found / sum - 1.0).abs() < 1e-9, "{stiffness}: {found}");
    }
}

#[test]
fn hybrid_wall_as_shipped_is_proved_beyond_a_stiffness() {
    let set = SteadySet::new(&known("hybrid-wall", &[]), [0.04, 4.0]).expect("a loop of that kind");
    let last = set.proved.last().expect("some");
    assert!(last.stiffness >= 1.0 && set.proved.len() == 24, "{last:?}");
    // Beyond, a half-range is proved. Words follow one another, and each bound holds of a run.
    let [first, last] = [set.bounded.first(), set.bounded.last()].map(|word| word.expect("some"));
    assert_eq!(Some(first.stiffness), set.beyond.as_ref().map(|(stiffness, _)| *stiffness));
    assert!(set.bounded.iter().all(|word| word.bound.rms_counts >= SETTLED_COUNTS), "{first:?}");
    assert_eq!(set.bounded.len(), 6, "{last:?}");
    let scene = known("hybrid-wall", &[]);
    for word in [first, last] {
        let witness = &word.parts[0].witness;
        assert_eq!(check(&scene, &[], witness).expect("it holds"), word.bound);
        for phase in [0, 17_000, 41_000] {
            let rms = simulated(&scene, witness.word, 3.0, phase, [3000, 6000]);
            assert!(rms <= word.bound.half_range_counts, "{phase}: {rms}, {:?}", word.bound);
        }
    }
}

#[test]
fn hybrid_wall_without_damping_is_proved_beyond_a_stiffness() {
    let set = SteadySet::new(&undamped(&[]), [0.04, 4.0]).expect("a loop of that kind");
    let last = set.proved.last().expect("some");
    assert!(last.stiffness >= 1.4 && set.proved.len() == 37, "{last:?}");
    assert!(set.proved.iter().all(|word| word.bound.rms_counts < SETTLED_COUNTS));
    assert!(set.beyond.is_some() && !set.ended);
}

#[test]
fn a_witness_of_another_scene_word_or_pulse_is_rejected() {
    let scene = undamped(&[]);
    let (witness, bound) = steady(&scene, &[], 36, None).map_err(|_| ()).expect("a witness");
    assert_eq!(check(&scene, &[], &witness).expect("it holds"), bound);
    let others: [&[(&str, &str)]; 8] = [
        &[("device.inductance", "0.25 mH")],
        &[("device.rotor_inertia", "1.3e-6 kg.m^2")],
        &[("device.resistance", "2.5 Ohm")],
        &[("hand.stiffness", "0.4 N.m/rad")],
        &[("hand.damping", "0.01 mN.m.s/rad")],
        &[("clock.frequency", "45 MHz")],
        &[("method.pwm.bits", "11")],
        &[("wall.position", "1.45 rad")],
    ];
    for set in others {
        let other = check(&undamped(set), &[], &witness).map(|bound| bound.rms_counts);
        assert!(other.is_err(), "{set:?}: {other:?}");
    }
    for word in [30, 34, 38, 42, 72] {
        assert!(check(&scene, &[], &Witness { word, ..witness.clone() }).is_err(), "{word}");
    }
    for by in [-60.0, 60.0] {
        assert!(check(&scene, &[], &Witness { act: witness.act + by, ..witness.clone() }).is_err(), "{by}");
    }
}

#[test]
fn a_witness_that_claims_more_is_rejected() {
    let scene = undamped(&[]);
    let (good, _) = steady(&scene, &[], 36, None).map_err(|_| ()).expect("a witness");
    let bad = |change: &dyn Fn(&mut Witness)| {
        let mut witness = good.clone();
        change(&mut witness);
        check(&scene, &[], &witness)
    };
    let changes: [&dyn Fn(&mut Witness); 16] = [
        &|witness| witness.level *= 0.99,
        &|witness| witness.sizes[0] *= 0.999,
        &|witness| witness.sizes[0] = 1e6,
        &|witness| witness.decay = 0.99,
        &|witness| witness.decay = 1.0,
        &|witness| witness.shape = witness.shape.map(|cell| 1e-3 * cell),
        &|witness| witness.storage = witness.storage.map(|cell| -cell),
        &|witness| witness.storage[0] *= 1.05,
        &|witness| witness.weights[0] = 0.0,
        &|witness| witness.weights[1] = -1e-6,
        &|witness| witness.weights[2] = 0.0,
        &|witness| witness.storage[4] = f64::NAN,
        // All of the inequality but the angle itself by a half.
        &|witness| {
            witness.level *= 0.5;
            witness.weights = witness.weights.map(|weight| 0.5 * weight);
            witness.storage = witness.storage.map(|cell| 0.5 * cell);
        },
        // Sizes that contact does not end, and such from which the motion grows.
        &|witness| witness.far = witness.sizes.map(|size| 1.01 * size),
        &|witness| witness.far[1] = 0.5 * (witness.sizes[1] + witness.far[1]) * 1e-3,
        &|witness| witness.far[0] *= 0.99,
    ];
    for (index, change) in changes.into_iter().enumerate() {
        assert!(bad(change).is_err(), "change {index}: {:?}", bad(change));
    }
}

#[test]
fn a_witness_of_a_damped_wall_that_claims_more_is_rejected() {
    let scene = known("hybrid-wall", &[]);
    let (good, _) = steady(&scene, &[], 20, None).map_err(|_| ()).expect("a witness");
    let changes: [&dyn Fn(&mut Witness); 5] = [
        &|witness| witness.sizes[0] *= 0.99,
        &|witness| witness.sizes[1] *= 0.99,
        &|witness| witness.weights[3] *= 0.7,
        &|witness| witness.weights[4] *= 0.95,
        &|witness| witness.weights[4] = 0.0,
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let mut witness = good.clone();
        change(&mut witness);
        let checked = check(&scene, &[], &witness);
        assert!(checked.is_err(), "change {index}: {checked:?}");
    }
    // The difference of a sample no longer fits the velocity.
    let narrow = known("hybrid-wall", &[("method.velocity_bits", "3")]);
    let checked = check(&narrow, &[], &good);
    assert!(checked.is_err(), "{checked:?}");
    // A pulse that ends elsewhere, where the inequality has much to spare.
    let sampled = Family::new(&scene, &[], 20, 0.0).expect("a loop of that kind");
    let found = sampled.found(None).expect("a level");
    let spare = sampled.witness(20, &found, 0.15).expect("a storage");
    assert!(check(&scene, &[], &spare).is_ok());
    for by in [-15.0, 15.0] {
        let checked = check(&scene, &[], &Witness { act: spare.act + by, ..spare.clone() });
        assert!(checked.is_err(), "{by}: {checked:?}");
    }
}

#[test]
fn a_certificate_of_another_scene_stiffness_or_duty_is_rejected() {
    let overrides = [("wall.damping".to_string(), "0".to_string())];
    let shipped = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("it is shipped");
    let set = SteadySet::new(&undamped(&[]), [1.4, 1.6]).expect("a loop of that kind");
    let text = certificate(&set, "hybrid-wall", shipped.text, &overrides);
    let Ok(Checked::Accepted { words: proved, .. }) = certify(&text) else { panic!("it holds") };
    assert_eq!(proved, set.proved.iter().map(|word| (word.stiffness, word.bound)).collect::<Vec<_>>());
    let first = &set.proved[0];
    let told = |key: &str, value: f64, other: f64| (format!("{key} = {value:e}"), format!("{key} = {other:e}"));
    for (old, new) in [
        ("stiffness = \"0.3 N.m/rad\"".to_string(), "stiffness = \"0.31 N.m/rad\"".to_string()),
        ("position = \"1.5 rad\"".into(), "position = \"1.49 rad\"".into()),
        ("\"0\"]".into(), "\"0.1 mN.m.s/rad\"]".into()),
        told("stiffness", first.stiffness, first.stiffness * 1.01),
        told("duty", first.bound.duty, first.bound.duty + 1e-3),
        told("rms_counts", first.bound.rms_counts, first.bound.rms_counts * 0.999),
        (format!("word = {}\n", first.parts[0].witness.word), format!("word = {}\n", first.parts[0].witness.word + 1)),
        ("storage".into(), "store".into()),
        ("for ever".into(), "for an hour".into()),
    ] {
        let changed = text.replace(&old, &new);
        assert!(changed != text, "{old} is not in it");
        let found = certify(&changed);
        // A key that is missing, and another claim, make another file of it.
        let is_other = old == "storage" || old == "for ever";
        assert!(matches!(found, Ok(Checked::Rejected(_))) != is_other, "{old} became {new}: {found:?}");
        assert_eq!(found.is_err(), is_other, "{old} became {new}");
    }
    assert!(certify("").is_err() && certify("claim = 3").is_err() && certify("[").is_err());
}

#[test]
fn no_multiplier_is_below_zero() {
    // Under a hand that damps, a soft word needs none of the staircase's multiplier.
    let scene = undamped(&[("hand.damping", "1 mN.m.s/rad")]);
    let sampled = Family::new(&scene, &[], 5, 0.0).expect("a loop of that kind");
    let mut found = sampled.found(None).expect("a level");
    for climb in [0.01, -0.01] {
        found.weights = [climb, 0.1, 0.1, 0.1, 0.1];
        let responses = found.dissipations[0].responses();
        found.level = responses.iter().fold(0.0, |most: f64, at| most.max(at.level(found.weights)));
        let witness = sampled.witness(5, &found, 0.02).expect("a storage");
        let checked = check(&scene, &[], &witness);
        assert_eq!(checked.is_ok(), climb > 0.0, "{climb}: {checked:?}");
    }
}

#[test]
fn a_bound_has_each_of_its_parts() {
    for scene in [undamped(&[]), known("hybrid-wall", &[])] {
        let (witness, bound) = steady(&scene, &[], 20, None).map_err(|_| ()).expect("a witness");
        let [_, _, _, _, noise] = witness.weights;
        let read = (0.25 * witness.level + noise).sqrt();
        assert!(bound.rms_counts > read + 0.999 * witness.sizes[2] && witness.sizes[2] > 1e-3, "{bound:?}");
        assert!(bound.rms_counts < 1.001 * (read + witness.sizes[2]), "{bound:?}");
    }
}

#[test]
fn a_pulse_that_ends_after_the_next_reading_is_refused() {
    // 4 clocks before the period's end the modulator reads the next command. The stall torque is 265 mN.m.
    let mut scene = undamped(&[]);
    let (witness, _) = steady(&scene, &[], 36, None).map_err(|_| ()).expect("a witness");
    for (act, is_outside) in [(4090.0, false), (4093.5, true)] {
        scene.hand = Hand::ConstantTorque { torque_nm: 0.265 * act / 4096.0 };
        let error = check(&scene, &[], &Witness { act, ..witness.clone() }).expect_err("too long a pulse").to_string();
        assert_eq!(error.contains("ends outside of its period"), is_outside, "{act}: {error}");
    }
}

#[test]
fn the_checker_is_short_and_shares_no_code_but_intervals() {
    let source = include_str!("../certify/mod.rs");
    let is_code = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with("//");
    assert!(source.lines().filter(is_code).count() <= 300);
    let own = source.lines().filter(|line| line.contains("crate::"));
    let arithmetic = ["form", "interval", "responses", "square"].map(|name| format!("use crate::{name}::"));
    let known = [vec!["use crate::Error;".to_string()], arithmetic.to_vec()].concat();
    own.for_each(|line| assert!(known.iter().any(|known| line.starts_with(known)), "{line}"));
}

#[test]
fn scenes_without_such_a_proof_are_refused_with_the_reason() {
    for (name, set, why) in [
        ("hybrid-wall", &[("method.rescaled", "true"), ("method.reference_rate", "1 kHz")][..], "scaled"),
        ("hybrid-wall", &[("method.product", "drop_upper")], "wraps"),
        ("conventional-wall-10khz", &[("wall.damping", "0")], "sampled"),
        ("hybrid-wall", &[("wall.damping", "0"), ("method.pwm.duty", "immediate")], "at once"),
        ("hybrid-wall", &[("wall.damping", "0"), ("model.bridge", "averaged")], "averaged"),
        ("hybrid-wall", &[("wall.damping", "0"), ("device.coulomb_friction", "1 mN.m")], "friction"),
        ("count-cycle", &[], "motor"),
    ] {
        let error = SteadySet::new(&known(name, set), [0.1, 1.0]).expect_err(why).to_string();
        assert!(error.contains(why), "{name}: {error}");
    }
}

/// Simulates the exact pulses of a word in SI units, clock by clock of their ends, and returns the rms of the angle
/// at the readings about its mean, in counts. The first sample of the velocity is read at `phase`, in clocks.
fn simulated(scene: &Scene, word: i64, start_counts: f64, phase: u64, periods: [usize; 2]) -> f64 {
    let (grip, _) = scene.hand.grip();
    let Hand::SpringDamper { path, .. } = &scene.hand else { unreachable!() };
    let (count, wall) = (scene.encoder.count_rad(), scene.wall_count() as f64);
    let step = scene.words().expect("words").realised.torque_quantum_nm / count;
    let slope = word as f64 * scene.method.stiffness_format.lsb();
    let depth = (path.last().expect("a path").angle_rad / count - wall) * grip / (grip + slope * step);
    let state = [0.0, 0.0, (wall + depth + start_counts) * count];
    let angles = moved(scene, word, state, phase, periods[1], &mut |_, inside| inside.floor());
    let seen: Vec<f64> = angles[periods[0] * ROWS..].iter().step_by(ROWS).copied().collect();
    let mean = seen.iter().sum::<f64>() / seen.len() as f64;
    (seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / seen.len() as f64).sqrt()
}

/// Angles in a period of the modulator that [`moved`] returns, at equal distances from the reading on.
const ROWS: usize = 4;

/// Simulates the exact pulses of a word from current, speed and angle at a reading on, and returns angles in counts.
/// `counted` is told the period and the angle behind the wall, and returns the count that is read.
fn moved(
    scene: &Scene,
    word: i64,
    start: [f64; 3],
    phase: u64,
    periods: usize,
    counted: &mut dyn FnMut(usize, f64) -> f64,
) -> Vec<f64> {
    let Device::Motor(motor) = &scene.device else { unreachable!() };
    let (grip, grip_damping) = scene.hand.grip();
    let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
    let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
    let drag = motor.viscous_friction_nm_s_per_rad + grip_damping;
    let Hand::SpringDamper { path, .. } = &scene.hand else { unreachable!() };
    let intent = path.last().expect("a path").angle_rad;
    let clock_s = scene.clock.period_s();
    // The state's last part is the supply; a positive command pushes back.
    let rates = |supply: f64| {
        let push = -supply * scene.bridge.supply_v / l;
        vec![
            vec![-ohm / l, -k / l, 0.0, push],
            vec![k / j, -drag / j, -grip / j, grip * intent / j],
            vec![0.0, 1.0, 0.0, 0.0],
            vec![0.0; 4],
        ]
    };
    let powers = |supply: f64| -> Vec<Matrix> {
        (0..13).map(|bit| exponential(&scaled(&rates(supply), clock_s * f64::from(1 << bit)))).collect()
    };
    let (on, off) = (powers(1.0), powers(0.0));
    let flow = |state: &mut [f64; 4], powers: &[Matrix], clocks: u64| {
        for (bit, power) in powers.iter().enumerate() {
            if clocks >> bit & 1 == 1 {
                *state = std::array::from_fn(|row| (0..4).map(|of| power[row][of] * state[of]).sum());
            }
        }
    };
    let (count, wall) = (scene.encoder.count_rad(), scene.wall_count());
    let (period, latency) = (1u64 << scene.method.pwm.bits, 4 + u64::from(scene.method.settling));
    let slope = word as f64 * scene.method.stiffness_format.lsb();
    let words = scene.words().expect("words");
    let mut state = [start[0], start[1], start[2], 1.0];
    let mut seen = Vec::new();
    // The clock and the count of the latest sample, and the difference that it left.
    let (mut sample, mut latest, mut turned) = (phase, (state[2] / count).floor() as i64, 0);
    let mut clock = 0;
    for index in 0..periods {
        let inside = counted(index, state[2] / count - wall as f64);
        let drag = (words.damping * turned) >> scene.method.damping_format.frac();
        let spring = (slope * inside.max(0.0)).floor() as i64;
        let command = (spring + drag).clamp(0, (period - latency) as i64) as u64;
        // The supply is on for a part of the period; samples are read between its clocks.
        let ends = [(latency, &off), (latency + command, &on), (period, &off)];
        let mut within = 0;
        for (end, powers) in ends {
            while within < end {
                let stride = period / ROWS as u64;
                if clock + within == seen.len() as u64 * stride {
                    seen.push(state[2] / count);
                }
                let end = end.min((within / stride + 1) * stride);
                let next = if sample >= clock + within { end.min(sample - clock) } else { end };
                flow(&mut state, powers, next - within);
                within = next;
                if clock + within == sample && within < period {
                    let counted = (state[2] / count).floor() as i64;
                    (turned, latest, sample) = (counted - latest, counted, sample + words.period as u64);
                }
            }
        }
        clock += period;
    }
    seen
}

fn random_loops(count: usize) {
    let mut random = hpu_cosim::SplitMix64::new(64);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (mut bounded, mut damped, mut most) = (0, 0, 0.0f64);
    for index in 0..count {
        let mut factor = |by: f64| libm::exp(by * (2.0 * share() - 1.0));
        let mut set = vec![
            ("device.inductance", format!("{:e}", 2.26e-4 * factor(0.7))),
            ("device.rotor_inertia", format!("{:e}", 1.37e-6 * factor(0.7))),
            ("hand.stiffness", format!("{:e}", 0.3 * factor(0.7))),
            ("hand.damping", format!("{:e}", 1e-4 * factor(1.5))),
            ("wall.position", format!("{:e}", 1.5 + 0.05 * libm::log(factor(1.0)))),
            ("method.settling", format!("{}", (20.0 * factor(1.1)) as u32)),
        ];
        if index % 2 == 0 {
            set.push(("wall.damping", format!("{:e}", 5e-5 * factor(1.0))));
            set.push(("method.sample_rate", format!("{:e}", 2e3 * factor(1.5))));
        }
        let set: Vec<(&str, &str)> = set.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let scene = undamped(&set);
        let word = 1 + (50.0 * share() * share()) as i64;
        let Ok((_, bound)) = steady(&scene, &[], word, None) else { continue };
        bounded += 1;
        damped += usize::from(scene.words().expect("words").damping > 0);
        for _ in 0..3 {
            let start = 4.0 * (2.0 * share() - 1.0);
            let phase = (share() * scene.words().expect("words").period as f64) as u64;
            let rms = simulated(&scene, word, start, phase, [3000, 6000]);
            most = most.max(rms / bound.rms_counts);
            assert!(rms <= bound.rms_counts, "{set:?}, word {word}: {rms}, bound {bound:?}");
        }
    }
    println!("{bounded} loops, {damped} of them with damping, at most {most} of a bound");
    assert!(bounded > count / 3 && damped > count / 8 && most > 0.1, "{bounded}, {damped} loops, {most} of a bound");
}

/// The difference of a sample of a motion in straight lines, without `T` times the latest step, has at most `γ²`
/// times the squares of what its steps change.
#[test]
fn a_stale_difference_is_bounded_at_every_phase() {
    let mut random = hpu_cosim::SplitMix64::new(65);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut most = 0.0f64;
    for index in 0..3000 {
        let sample = [0.3, 1.0, 2.0, 3.7, 12.207, 40.0][index % 6];
        let gain = stale_gain(Interval::exact(sample)).hi;
        // One change, changes of one sign, and at random; at rest before.
        let changes: Vec<f64> = (0..60)
            .map(|at| match index / 6 % 3 {
                0 => f64::from(u8::from(at == 0)),
                1 => libm::sin(0.2 * share() + f64::from(at) * 2.0 / sample.max(1.0)),
                _ => 2.0 * share() - 1.0,
            })
            .collect();
        let mut steps = vec![0.0];
        changes.iter().for_each(|change| steps.push(steps.last().unwrap() + change));
        steps.extend([*steps.last().unwrap(); 200]);
        // The angle at reading n, and at any time by straight lines.
        let mut angles = vec![0.0];
        steps.iter().for_each(|step| angles.push(angles.last().unwrap() + step));
        let angle = |time: f64| {
            let at = time.max(0.0).floor() as usize;
            angles[at] + (time.max(0.0) - at as f64) * (angles[at + 1] - angles[at])
        };
        let phase = sample * share();
        let stale: f64 = (1..angles.len() - 1)
            .map(|n| {
                let read = n as f64 - (n as f64 - phase).rem_euclid(sample);
                (angle(read) - angle(read - sample) - sample * (angles[n] - angles[n - 1])).powi(2)
            })
            .sum();
        let all: f64 = changes.iter().map(|change| change * change).sum();
        most = most.max(stale / (gain * all));
        assert!(stale <= gain * all, "{sample}, {phase}: {stale}, {gain} {all}");
    }
    assert!(most > 0.6, "{most}");
}

#[test]
fn no_random_loop_swings_beyond_its_bound() {
    random_loops(40);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn none_of_a_thousand_random_loops_swings_beyond_its_bound() {
    random_loops(1000);
}

/// Returns ranges of numbers of a scene's world around its own, by shares of them.
fn around(scene: &Scene, shares: &[(usize, f64)]) -> Vec<Range> {
    let mut own = scene.clone();
    let all = numbers(&mut own);
    let range = |&(number, share): &(usize, f64)| Range {
        number,
        ends: [*all[number] * (1.0 - share), *all[number] * (1.0 + share)],
    };
    shares.iter().map(range).collect()
}

/// Returns a scene with numbers within ranges, each at its share of the range; the words stay those of the scene.
fn within(scene: &Scene, word: i64, ranges: &[Range], shares: &[f64]) -> Scene {
    let mut nominal = scene.clone();
    let step = scene.words().expect("words").realised;
    nominal.wall.stiffness_nm_per_rad =
        word as f64 * step.torque_quantum_nm / step.count_rad * scene.method.stiffness_format.lsb();
    let mut world = nominal.clone();
    let mut all = numbers(&mut world);
    for (Range { number, ends: [low, high] }, share) in ranges.iter().zip(shares) {
        *all[*number] = low + share * (high - low);
    }
    world.with_words_of(&nominal).expect("the same words")
}

#[test]
fn ranges_of_each_number_are_proved_and_no_member_swings_beyond() {
    let mut random = hpu_cosim::SplitMix64::new(66);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (scene, word) = (known("hybrid-wall", &[]), 15);
    let (_, point) = steady(&scene, &[], word, None).expect("a witness");
    let mut most = 0.0f64;
    // Resistance, inductance, torque constant, inertia, viscous friction, supply, the hand's stiffness and damping.
    for (number, width) in [(0, 0.01), (1, 0.01), (2, 0.01), (3, 0.03), (5, 0.05), (6, 0.01), (8, 0.03), (9, 0.05)] {
        let ranges = around(&scene, &[(number, width)]);
        let (witness, bound) = steady(&scene, &ranges, word, None).unwrap_or_else(|why| panic!("{number}: {why}"));
        assert_eq!(check(&scene, &ranges, &witness).expect("it holds"), bound);
        // A range holds no less than a member of it, and this one little more.
        assert!(bound.rms_counts > 0.99 * point.rms_counts && bound.rms_counts < 0.95, "{number}: {bound:?}");
        for end in [0.0, 1.0, share()] {
            let member = within(&scene, word, &ranges, &[end]);
            let (_, own) = steady(&member, &[], word, None).expect("a witness");
            assert!(own.rms_counts < 1.01 * bound.rms_counts, "{number}, {end}: {own:?}, {bound:?}");
            let phase = (share() * scene.words().expect("words").period as f64) as u64;
            let rms = simulated(&member, word, 4.0 * (2.0 * share() - 1.0), phase, [3000, 6000]);
            most = most.max(rms / bound.rms_counts);
            assert!(rms <= bound.rms_counts, "{number}, {end}: {rms}, {bound:?}");
        }
    }
    assert!(most > 0.1, "{most}");
}

#[test]
fn a_witness_of_a_range_that_is_stretched_or_of_another_number_is_rejected() {
    let (scene, word) = (known("hybrid-wall", &[]), 15);
    let good = around(&scene, &[(3, 0.02)]);
    let (witness, _) = steady(&scene, &good, word, None).expect("a witness");
    assert!(check(&scene, &good, &witness).is_ok());
    let [low, high] = good[0].ends;
    // A smaller range at the same place has other straight lines, and the range reversed or halved is another.
    let others = [
        vec![Range { number: 3, ends: [low, 1.05 * high] }],
        vec![Range { number: 3, ends: [0.95 * low, high] }],
        vec![Range { number: 3, ends: [1.04 * low, 1.04 * high] }],
        vec![Range { number: 3, ends: [high, low] }],
        vec![Range { number: 3, ends: [0.0, high] }],
        vec![Range { number: 10, ends: [low, high] }],
        around(&scene, &[(0, 0.02)]),
        around(&scene, &[(8, 0.02)]),
        around(&scene, &[(3, 0.02), (8, 0.001)]),
        vec![],
    ];
    for ranges in others {
        let checked = check(&scene, &ranges, &witness);
        assert!(checked.is_err(), "{ranges:?}: {checked:?}");
    }
    let changes: [&dyn Fn(&mut Witness); 7] = [
        &|witness| witness.turns[0].storage = witness.turns[0].storage.map(|cell| -cell),
        &|witness| witness.turns[0].storage = [0.0; 10],
        &|witness| witness.turns[0].shape = witness.turns[0].shape.map(|cell| 1e3 * cell),
        &|witness| witness.turns[0].storage[0] = f64::NAN,
        &|witness| witness.turns.clear(),
        &|witness| witness.turns.push(witness.turns[0].clone()),
        &|witness| witness.level *= 0.7,
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let mut witness = witness.clone();
        change(&mut witness);
        let checked = check(&scene, &good, &witness);
        assert!(checked.is_err(), "change {index}: {checked:?}");
    }
}

#[test]
fn a_box_of_two_numbers_is_halved_and_its_certificate_is_accepted_as_it_is() {
    let shipped = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("it is shipped");
    let scene = known("hybrid-wall", &[]);
    let over = [
        ("hand.stiffness", ["0.285 N.m/rad", "0.315 N.m/rad"]),
        ("device.rotor_inertia", ["1.369e-6 kg.m^2", "1.371e-6 kg.m^2"]),
    ];
    let over: Vec<(Over, Range)> = over
        .map(|(key, ends)| {
            let over = Over { key: key.into(), ends: ends.map(str::to_string) };
            let range = over.range(&scene, |key, value| Ok(known("hybrid-wall", &[(key, value)]))).expect("a range");
            (over, range)
        })
        .into();
    let step = scene.words().expect("words").realised;
    let stiffness = step.torque_quantum_nm / step.count_rad * scene.method.stiffness_format.lsb() * 15.0;
    let set = SteadySet::over(&scene, &over, [stiffness; 2], &|_| None).expect("a loop of that kind");
    assert!(set.proved.len() == 1 && set.proved[0].parts.len() > 1 && set.beyond.is_none(), "{set:?}");
    let text = certificate(&set, "hybrid-wall", shipped.text, &[]);
    let Ok(Checked::Accepted { words, over: told }) = certify(&text) else { panic!("{:?}", certify(&text)) };
    assert_eq!(words, [(set.proved[0].stiffness, set.proved[0].bound)]);
    assert_eq!(told, set.over);
    let name = &set.proved[0].parts[0].name;
    let first = text.find("\n[[word]]").expect("a word");
    let second = first + 1 + text[first + 1..].find("\n[[word]]").expect("a second part");
    let changes = [
        text.replace("0.315 N.m/rad", "0.33 N.m/rad"),
        text.replace("0.285 N.m/rad", "0.27 N.m/rad"),
        text.replace("1.371e-6", "1.5e-6"),
        text.replace("1.369e-6", "1.2e-6"),
        // A part that is missing, twice there, or another one.
        [&text[..first], &text[second..]].concat(),
        [&text[..second], &text[first..]].concat(),
        text.replace(&format!("part = \"{name}\""), &format!("part = \"{name}a\"")),
        text.replace(&format!("part = \"{name}\""), "part = \"\""),
        text.replace(&format!("part = \"{name}\""), "part = \"c\""),
    ];
    for (index, changed) in changes.into_iter().enumerate() {
        assert!(changed != text, "{index}");
        let found = certify(&changed);
        assert!(matches!(found, Ok(Checked::Rejected(_))), "{index}: {found:?}");
    }
    let others = [
        text.replace("\"hand.stiffness\"", "\"hand.damping\""),
        text.replace("\"device.rotor_inertia\"", "\"wall.position\""),
        text.replace("\"hand.stiffness\"", "\"method.settling\""),
    ];
    for (index, changed) in others.into_iter().enumerate() {
        let found = certify(&changed);
        assert!(!matches!(found, Ok(Checked::Accepted { .. })), "{index}: {found:?}");
    }
    let twice = text.replace(
        "[\"device.rotor_inertia\", \"1.369e-6 kg.m^2\", \"1.371e-6 kg.m^2\"]",
        "[\"hand.stiffness\", \"0.3 N.m/rad\", \"0.31 N.m/rad\"]",
    );
    assert!(certify(&twice).expect_err("one number twice").to_string().contains("of one number"));
}

#[test]
fn what_moves_no_number_of_the_world_or_the_clock_too_is_no_range() {
    let scene = known("hybrid-wall", &[]);
    for (key, ends) in [
        ("hand.stiffness", ["0.3 N.m/rad", "300 mN.m/rad"]),
        ("clock.frequency", ["50 MHz", "51 MHz"]),
        ("wall.stiffness", ["0.5", "0.6"]),
    ] {
        let over = Over { key: key.into(), ends: ends.map(str::to_string) };
        let found = over.range(&scene, |key, value| Ok(known("hybrid-wall", &[(key, value)])));
        assert!(found.expect_err(key).to_string().contains("is no range of one number"), "{key}");
    }
}

#[test]
fn a_word_that_is_not_proved_everywhere_is_told_by_parts_and_refuted_by_runs() {
    let scene = known("hybrid-wall", &[]);
    let over = Over { key: "hand.damping".into(), ends: ["0.05 mN.m.s/rad".into(), "0.3 mN.m.s/rad".into()] };
    let range = over.range(&scene, |key, value| Ok(known("hybrid-wall", &[(key, value)]))).expect("a range");
    let step = scene.words().expect("words").realised;
    let stiffness = step.torque_quantum_nm / step.count_rad * scene.method.stiffness_format.lsb() * 26.0;
    // A run refutes the lower half of the range.
    let refute = |scene: &Scene| (scene.hand.grip().1 < 1.75e-4).then_some(1.5);
    let set = SteadySet::over(&scene, &[(over, range)], [stiffness; 2], &refute).expect("a loop of that kind");
    let count = |is: fn(&Outcome) -> bool| set.parts.iter().filter(|part| is(&part.is)).count();
    assert!(set.proved.is_empty() && set.beyond.is_some(), "{set:?}");
    assert!(count(|is| *is == Outcome::Proved) > 0 && count(|is| *is == Outcome::Refuted(1.5)) > 0, "{set:?}");
    // The parts are all of the range, one after the other.
    assert_eq!((set.parts[0].ends[0][0], set.parts.last().expect("some").ends[0][1]), (range.ends[0], range.ends[1]));
    assert!(set.parts.windows(2).all(|pair| pair[0].ends[0][1] == pair[1].ends[0][0]), "{set:?}");
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn no_member_of_a_hundred_random_boxes_swings_beyond_its_bound() {
    let mut random = hpu_cosim::SplitMix64::new(67);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let scene = known("hybrid-wall", &[]);
    let (mut proved, mut most) = (0, 0.0f64);
    for index in 0..100 {
        let numbers = [0, 1, 2, 3, 5, 6, 8, 9];
        let mut pick = || (numbers[(share() * 8.0) as usize], 0.002 + 0.03 * share() * share());
        let [one, other] = [pick(), pick()];
        let widths = if index % 2 == 0 || one.0 == other.0 { vec![one] } else { vec![one, other] };
        let (ranges, word) = (around(&scene, &widths), 1 + (24.0 * share()) as i64);
        let Ok((_, bound)) = steady(&scene, &ranges, word, None) else { continue };
        proved += 1;
        for _ in 0..4 {
            let shares: Vec<f64> = ranges.iter().map(|_| share()).collect();
            let member = within(&scene, word, &ranges, &shares);
            let phase = (share() * scene.words().expect("words").period as f64) as u64;
            let rms = simulated(&member, word, 4.0 * (2.0 * share() - 1.0), phase, [3000, 9000]);
            most = most.max(rms / bound.rms_counts);
            assert!(rms <= bound.rms_counts, "{ranges:?}, {shares:?}, word {word}: {rms}, {bound:?}");
        }
    }
    println!("{proved} of 100 boxes, at most {most} of a bound");
    assert!(proved > 50 && most > 0.1, "{proved} boxes, {most} of a bound");
}

/// The reference's figures of the window of 0.6 s from a state of 0.3 counts, for pulses that end at a fixed clock.
#[test]
fn windows_from_a_state_are_those_of_other_numerics() {
    let scene = undamped(&[]);
    let words = scene.words().expect("words");
    let step = words.realised.torque_quantum_nm / words.realised.count_rad;
    let ask = [0.0, 0.0, 0.3].map(Interval::exact);
    for (stiffness, other) in [(0.5, 0.329), (1.0, 0.396), (1.25, 0.535), (1.5, 0.816)] {
        let mut linear = Sampled::of(&scene, &words, unit_of(&scene), stiffness / step, None).expect("a loop");
        (linear.half, linear.away) = (0.5, 0.0);
        let dissipation = linear.dissipation([0.0; 3], [0.0, 0.0]);
        let spectrum = dissipation.responses();
        let level = |log: f64| -> f64 {
            let weights = [libm::exp(log), 1e-14, 1e-14, 1e-14, 1e-14];
            spectrum.iter().fold(0.0, |most: f64, at| most.max(at.level(weights)))
        };
        let (log, least) = (0..120)
            .map(|part| 0.05 * f64::from(part))
            .map(|log| (log, level(log)))
            .fold((0.0, f64::INFINITY), |best, found| if found.1 < best.1 { found } else { best });
        let weights = [libm::exp(log), 1e-14, 1e-14, 1e-14, 1e-14];
        let storage = linear.storage(&dissipation, 1.03 * least, weights, 0.0).expect("a storage");
        // The state, with the angle before as the fourth: here the same.
        let (x, potential) = ([0.0, 0.0, 0.3, 0.3], weights[0] * 0.8 * 0.8 / 2.0);
        let stored: f64 = (0..4)
            .flat_map(|row| (row..4).map(move |of| (row, of)))
            .zip(storage)
            .fold(0.0, |sum, ((row, of), cell)| sum + x[row] * x[of] * if row == of { cell } else { 2.0 * cell });
        let rms = (1.03 * least / 4.0 + (potential + stored) / 7324.0).sqrt();
        // The reference does not say its `h`, nor which state of 0.3 counts it takes.
        assert!(rms <= other + 5e-4 && rms > 0.98 * other, "{stiffness}: {rms}, not {other}");
        // What is proved has the pulses' ends and the command's rounding, and the nearest word.
        let word = (stiffness / step / scene.method.stiffness_format.lsb()).round() as i64;
        let proved = from_deviation(&scene, word, ask, 7324.0).expect("a window").rms_counts;
        assert!(proved > other && proved < 1.1 * other, "{stiffness}: {proved}, not {other}");
    }
}

/// Returns a device where the modulator reads, with current, speed and angle.
fn at_reading(scene: &Scene, [current_a, speed_rad_per_s, angle_rad]: [f64; 3]) -> Rest {
    let intent_rad = scene.hand.path().last().expect("a path").1;
    Rest {
        edge: 0,
        band_rad: [0.0; 2],
        standing: Standing { current_a, speed_rad_per_s, angle_rad, intent_rad, is_stuck: false },
        lead: vec![(0.0, 4 + u64::from(scene.method.settling))],
        cycle: vec![(-1.0, u64::MAX)],
    }
}

/// The periodic motion of the command at rest once more, in floats: a real number of clocks that its own motion asks
/// for, by the whole flow and halving.
#[test]
fn a_state_on_the_periodic_motion_deviates_from_nothing() {
    for (set, word) in [(&[][..], 12), (&[], 36), (&[("method.pwm.bits", "13"), ("hand.damping", "0.001")], 8)] {
        let scene = undamped(set);
        let Device::Motor(motor) = &scene.device else { unreachable!() };
        let (grip, grip_damping) = scene.hand.grip();
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let drag = motor.viscous_friction_nm_s_per_rad + grip_damping;
        let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
        let intent = scene.hand.path().last().expect("a path").1;
        let rates = |supply: f64| {
            let push = -supply * scene.bridge.supply_v / l;
            vec![
                vec![-ohm / l, -k / l, 0.0, push],
                vec![k / j, -drag / j, -grip / j, grip * intent / j],
                vec![0.0, 1.0, 0.0, 0.0],
                vec![0.0; 4],
            ]
        };
        let (count, wall) = (scene.encoder.count_rad(), scene.wall_count() as f64);
        let (period, latency) =
            (2f64.powi(scene.method.pwm.bits.cast_signed()), 4.0 + f64::from(scene.method.settling));
        let orbit = |clocks: f64| -> [f64; 3] {
            let after =
                |supply: f64, clocks: f64| exponential(&scaled(&rates(supply), clocks * scene.clock.period_s()));
            let pulse = crate::sampled::product(&after(1.0, clocks), &after(0.0, latency));
            let mut whole = crate::sampled::product(&after(0.0, period - latency - clocks), &pulse);
            // Squares of the map come to the periodic motion from anywhere.
            (0..30).for_each(|_| whole = crate::sampled::product(&whole, &whole));
            [0, 1, 2].map(|row| whole[row][3])
        };
        let lsb = scene.method.stiffness_format.lsb();
        let slope = word as f64 * lsb;
        let half = 0.5 + 0.5 * (1.0 - lsb) / slope;
        let misses = |clocks: f64| clocks - slope * (orbit(clocks)[2] / count - wall - half);
        let (mut low, mut high) = (1.0, period - latency - 1.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if misses(middle) > 0.0 { high = middle } else { low = middle }
        }
        let at = orbit(low);
        let unit = unit_of(&scene);
        let found = start(&scene, word, unit, &at_reading(&scene, at)).expect("a deviation");
        assert!(found.iter().all(|part| part.size() < 1e-6), "{set:?}: {found:?}");
        // Each number moves its own part, in the checker's units.
        let period_s = period * scene.clock.period_s();
        for (state, by, counts) in [(0, 1e-3, 1e-3 / unit), (1, 0.1, 0.1 * period_s / count), (2, count, 1.0)] {
            let mut other = at;
            other[state] += by;
            let moved = start(&scene, word, unit, &at_reading(&scene, other)).expect("a deviation");
            for (part, (moved, found)) in moved.iter().zip(&found).enumerate() {
                let off = if part == state { counts } else { 0.0 };
                assert!((moved.middle() - found.middle() - off).abs() < 1e-6 * (1.0 + off), "{state}, {part}");
            }
        }
    }
}

/// The result of [`in_window`]: the greatest share of a bound of the rms, and of one of the angle.
type Shares = [f64; 2];

/// Holds a motion against what is proved from its state on: all angles of some of its windows.
fn in_window(scene: &Scene, word: i64, state: [f64; 3], found: &Window, angles: &[f64]) -> Shares {
    let rest = scene.wall_count() as f64 + found.long_run.depth_counts;
    let off: Vec<f64> = angles.iter().map(|angle| angle - rest).collect();
    let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
    let far = off.iter().fold(0.0, |most: f64, off| most.max(off.abs()));
    let said = format!("word {word} from {state:?}: {rms} counts rms, at most {far}, {found:?}");
    assert!(rms <= found.rms_counts && far <= found.half_range_counts, "{said}");
    [rms / found.rms_counts, far / found.half_range_counts]
}

/// Holds random undamped loops from random states on against their windows.
fn random_windows(count: usize) {
    let mut random = hpu_cosim::SplitMix64::new(64);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (mut bounded, mut most) = (0, [0.0f64; 2]);
    for _ in 0..count {
        let mut factor = |by: f64| libm::exp(by * (2.0 * share() - 1.0));
        let set = [
            ("device.inductance", format!("{:e}", 2.26e-4 * factor(0.7))),
            ("device.rotor_inertia", format!("{:e}", 1.37e-6 * factor(0.7))),
            ("hand.stiffness", format!("{:e}", 0.3 * factor(0.7))),
            ("hand.damping", format!("{:e}", 1e-4 * factor(1.5))),
            ("wall.position", format!("{:e}", 1.5 + 0.05 * libm::log(factor(1.0)))),
            ("method.settling", format!("{}", (20.0 * factor(1.1)) as u32)),
        ];
        let set: Vec<(&str, &str)> = set.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let scene = undamped(&set);
        let word = 1 + (50.0 * share() * share()) as i64;
        let Ok((_, Bound { depth_counts, .. })) = steady(&scene, &[], word, None) else { continue };
        let count_rad = scene.encoder.count_rad();
        let far = 4.0 * share() * share();
        let mut side = || 2.0 * share() - 1.0;
        let rest = scene.wall_count() as f64 + depth_counts;
        let state = [0.02 * far * side(), 0.5 * far * side(), (rest + far * side()) * count_rad];
        let begun = start(&scene, word, unit_of(&scene), &at_reading(&scene, state)).expect("a deviation");
        for periods in [1, 7, 60, 1500] {
            let Ok(found) = from_deviation(&scene, word, begun, periods as f64) else { continue };
            bounded += 1;
            // The lines of the encoder lie anywhere: a whole staircase that is shifted has counts as near.
            let mut shift = 0.0;
            for _ in 0..3 {
                let mut counted = |_: usize, inside: f64| (inside + shift).floor() - shift;
                let angles = moved(&scene, word, state, u64::MAX, periods, &mut counted);
                let shares = in_window(&scene, word, state, &found, &angles);
                most = std::array::from_fn(|of| most[of].max(shares[of]));
                shift = share();
            }
        }
    }
    println!("{bounded} windows, at most {most:?} of their bounds");
    assert!(bounded > count && most[0] > 0.5 && most[1] > 0.2, "{bounded} windows, {most:?} of a bound");
}

#[test]
fn no_motion_from_a_state_exceeds_its_window() {
    random_windows(12);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn none_of_five_hundred_random_loops_exceeds_its_windows() {
    random_windows(500);
}

/// With no multiplier of the staircase, a window holds for roundings of up to half a count at random, and for those
/// that feed the motion, which no staircase has.
#[test]
fn no_rounding_exceeds_a_window_without_the_staircases_multiplier() {
    let scene = undamped(&[]);
    let mut random = hpu_cosim::SplitMix64::new(68);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut most = [0.0f64; 2];
    for word in [5, 12, 18] {
        let family = Family::new(&scene, &[], word, 0.0).expect("a loop of that kind");
        let (_, bound) = steady(&scene, &[], word, None).expect("a witness");
        for periods in [1, 5, 40, 800] {
            let far = 4.0 * share();
            let count_rad = scene.encoder.count_rad();
            let rest = scene.wall_count() as f64 + bound.depth_counts;
            let state = [0.0, 0.2 * far, (rest + far * (2.0 * share() - 1.0)) * count_rad];
            let begun = start(&scene, word, unit_of(&scene), &at_reading(&scene, state)).expect("a deviation");
            let more = family.middle.greatest(begun.map(Interval::middle));
            let mut found = family.found_from(more, None).expect("a level");
            found.weights[0] = 1e-9;
            let responses = found.dissipations[0].responses();
            found.level = responses.iter().fold(0.0, |most: f64, at| most.max(at.level(found.weights)));
            let witness = family.witness(word, &found, 0.03).expect("a storage");
            let found = window(&scene, &witness, begun, periods as f64).expect("a window");
            for attack in 0..4 {
                let mut before = 0.0;
                let mut counted = |period: usize, inside: f64| {
                    let moves = inside - before;
                    before = inside;
                    let off = match attack {
                        0 => share() - 0.5,
                        1 => -0.5f64.copysign(moves),
                        2 => 0.5f64.copysign(moves),
                        // Near the resonance.
                        _ => 0.5f64.copysign(libm::sin(0.1 * period as f64)),
                    };
                    inside - 0.5 + off
                };
                let angles = moved(&scene, word, state, u64::MAX, periods, &mut counted);
                let shares = in_window(&scene, word, state, &found, &angles);
                most = std::array::from_fn(|of| most[of].max(shares[of]));
            }
        }
    }
    println!("at most {most:?} of their bounds");
    assert!(most[0] > 0.8 && most[1] > 0.3, "{most:?} of a bound");
}

#[test]
fn a_state_that_is_too_far_or_another_scene_has_no_window() {
    let scene = undamped(&[]);
    let from = |angle: f64| from_deviation(&scene, 24, [0.0, 0.0, angle].map(Interval::exact), 7324.0);
    let near = from(1.0).expect("a window");
    assert!(near.rms_counts > from(0.0).expect("a window").rms_counts, "{near:?}");
    // At rest the wall holds 45 counts.
    for angle in [f64::NAN, f64::INFINITY] {
        assert!(from(angle).is_err(), "{angle}: {:?}", from(angle));
    }
    assert!(from(-50.0).is_err() && from(50.0).is_err());
    // A hand that leans on the wall by a count or two, and one that all but takes its full command.
    for (position, duty, is_told) in [
        ("1.79 rad", 0.0..0.01, false),
        ("1.7 rad", 0.05..0.1, true),
        ("0.75 rad", 0.88..0.93, true),
        ("0.68 rad", 0.96..0.98, false),
    ] {
        let scene = undamped(&[("wall.position", position)]);
        let (_, bound) = steady(&scene, &[], 24, None).expect("a witness");
        assert!(duty.contains(&bound.duty), "{position}: {bound:?}");
        let found = from_deviation(&scene, 24, [Interval::ZERO; 3], 100.0);
        assert_eq!(found.is_ok(), is_told, "{position}: {found:?}");
        assert!(found.err().is_none_or(|why| why.contains("may lose contact")), "{position}");
    }
    let damped = known("hybrid-wall", &[]);
    let error = from_deviation(&damped, 20, [Interval::ZERO; 3], 100.0).expect_err("damped");
    assert!(error.contains("drag"), "{error}");
    // The sizes of another state, and a window of no length.
    let family = Family::new(&scene, &[], 24, 0.0).expect("a loop of that kind");
    let of = |angle: f64| {
        let found = family.found_from(family.middle.greatest([0.0, 0.0, angle]), None).expect("a level");
        family.witness(24, &found, 0.01).expect("a storage")
    };
    let begun = |angle: f64| [0.0, 0.0, angle].map(Interval::exact);
    let why = |witness: &Witness, angle: f64, periods: f64| {
        window(&scene, witness, begun(angle), periods).map_or_else(|error| error.to_string(), |_| String::new())
    };
    let witness = of(2.0);
    assert_eq!(why(&witness, 2.0, 100.0), "");
    assert!(why(&witness, 2.1, 100.0).contains("from the state on"), "{}", why(&witness, 2.1, 100.0));
    for periods in [0.0, 0.5, f64::NAN, f64::INFINITY] {
        assert!(why(&witness, 2.0, periods).contains("no sense"), "{periods}");
    }
    // What is claimed beside the storage: the squares grow by what enters at each reading, and there is one more of
    // these than periods.
    let sum = |periods: f64| -> f64 {
        let found = window(&scene, &witness, begun(2.0), periods).expect("a window");
        periods * (found.rms_counts - witness.sizes[2]).powi(2)
    };
    let half = 0.5 + 0.5 * (1.0 - scene.method.stiffness_format.lsb()) / (24.0 * scene.method.stiffness_format.lsb());
    let entering = half * half * witness.level;
    let stored = sum(1.0) - 2.0 * entering;
    assert!(stored > 0.0, "{stored}");
    for periods in [2.0f64, 2.5, 100.0] {
        let other = (periods.ceil() + 1.0) * entering + stored;
        assert!((sum(periods) / other - 1.0).abs() < 1e-9, "{periods}: {}, not {other}", sum(periods));
    }
    assert!(stored > 0.0, "{stored}");
}

/// At rest, the potential alone is stored: that of the rounding at the start, and a share of it at the end, as far as
/// the storage is no sum of squares. Greater weights of the staircase need greater shares.
#[test]
fn a_window_from_rest_stores_the_potential_alone() {
    // With bits behind the point of the stiffness, the command's rounding is more than half a count.
    let mut shares = stored_from_rest(&undamped(&[]), 24);
    shares.extend(stored_from_rest(&undamped(&[("method.stiffness_format", "(0,8,4)")]), 384));
    assert!(shares.iter().any(|share| *share > 0.0), "{shares:?}");
}

/// Checks what is stored from rest on with some weights of the staircase, and returns the shares that they need.
fn stored_from_rest(scene: &Scene, word: i64) -> Vec<f64> {
    let family = Family::new(scene, &[], word, 0.0).expect("a loop of that kind");
    let rest = [Interval::ZERO; 3];
    let lsb = scene.method.stiffness_format.lsb();
    let half = 0.5 + 0.5 * (1.0 - lsb) / (word as f64 * lsb);
    let mut shares = Vec::new();
    for factor in [0.1, 1.0, 3.0, 10.0, 100.0] {
        let mut found = family.found_from([0.0; 4], None).expect("a level");
        found.weights[0] *= factor;
        let responses = found.dissipations[0].responses();
        found.level = responses.iter().fold(0.0, |most: f64, at| most.max(at.level(found.weights)));
        let Some(witness) = family.witness(word, &found, 0.03) else { continue };
        let Ok(bound) = window(scene, &witness, rest, 1.0) else { continue };
        let stored = (bound.rms_counts - witness.sizes[2]).powi(2) - 2.0 * half * half * witness.level;
        let potential = witness.weights[0] * half * half / 2.0;
        let is_positive = |share: f64| {
            let mut storage: crate::square::Square<4, 0> =
                crate::square::symmetric(&witness.storage.map(crate::form::Form::exact));
            let more = crate::form::Form::exact(0.5 * share * witness.weights[0]);
            storage[3][3] = storage[3][3].plus(more);
            crate::square::is_positive(&storage)
        };
        let share = [0.0, 0.25, 0.5, 0.75, 0.9, 0.99].into_iter().find(|share| is_positive(*share)).expect("a share");
        let expected = potential / (1.0 - share);
        println!("{factor}: half {half}, share {share}, {stored} stored, {expected}");
        assert!((stored / expected - 1.0).abs() < 1e-6, "{factor}: share {share}, {stored} stored, not {expected}");
        shares.push(share);
    }
    shares
}

#[test]
fn a_window_begins_where_the_modulator_reads() {
    let scene = undamped(&[]);
    let good = at_reading(&scene, [0.0, 0.0, 1.55]);
    let begins =
        |rest: &Rest| start(&scene, 24, unit_of(&scene), rest).map_or_else(|why| why.to_string(), |_| String::new());
    assert_eq!((begins(&good).as_str(), until_read(&scene, &good).expect("a reading")), ("", 0));
    let latency = good.lead[0].1;
    for (lead, left) in [
        (vec![(0.0, latency + 7)], 7),
        (vec![(-1.0, 100), (0.0, 30), (0.0, latency)], 130),
        // The reading has passed: the next one is a period later.
        (vec![(0.0, latency - 1)], 4095),
        (vec![(-1.0, latency)], 0),
    ] {
        let rest = Rest { lead, ..good.clone() };
        assert_eq!(until_read(&scene, &rest).expect("a reading"), left, "{rest:?}");
        assert!(begins(&rest).contains("does not read"), "{rest:?}");
    }
    let pulls = Rest { cycle: vec![(1.0, u64::MAX)], ..good.clone() };
    assert!(begins(&pulls).contains("does not read"), "{}", begins(&pulls));
    let mut moves = good.clone();
    moves.standing.intent_rad += 1e-3;
    assert!(begins(&moves).contains("hand"), "{}", begins(&moves));
    let mut pushed = scene.clone();
    pushed.hand = Hand::ConstantTorque { torque_nm: 0.05 };
    assert!(start(&pushed, 24, unit_of(&scene), &good).is_err());
}
