//! The kinematics of the spherical device against closed forms in floating point: the tip to which the joints lead.

use std::f64::consts::PI;

use hpu_datapath::gimbal::gimbal_inverse::Joints;
use hpu_datapath::gimbal::{CrankTable, GimbalConfig, GimbalInverse, crank_table, gimbal_inverse};
use hpu_datapath::{Block, variants};
use hpu_signal::Format;

/// Lengths in least significant bits: those of the words, not those of the paper.
struct Device {
    crank: f64,
    rod: f64,
    offset: f64,
    half_turn: f64,
}

impl Device {
    fn of(config: &GimbalConfig) -> Self {
        let GimbalConfig { crank, rod, offset, angle_width, .. } = *config;
        let half_turn = f64::from(1 << (angle_width - 1));
        Self { crank: crank.into(), rod: rod.into(), offset: offset.into(), half_turn }
    }

    fn radius(&self, psi: f64) -> f64 {
        let across = self.crank * psi.sin();
        self.offset + self.crank * psi.cos() + (self.rod * self.rod - across * across).sqrt()
    }

    fn tip(&self, joints: &Joints<i64>) -> [f64; 3] {
        let [pitch, roll, crank] =
            [joints.pitch, joints.roll, joints.crank].map(|angle| PI * angle as f64 / self.half_turn);
        let radius = self.radius(crank);
        [-radius * pitch.cos() * roll.sin(), radius * pitch.cos() * roll.cos(), radius * pitch.sin()]
    }
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Pseudo-random numbers from 0 to 1 (Vigna's splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Returns the word of a position of this pitch, roll and radius, the radius in least significant bits.
fn target(pitch: f64, roll: f64, radius: f64) -> [i64; 3] {
    [-radius * pitch.cos() * roll.sin(), radius * pitch.cos() * roll.cos(), radius * pitch.sin()]
        .map(|along| along.round() as i64)
}

/// Returns whether a word position is within the reach by its exact angles and radius.
fn is_within(config: &GimbalConfig, position: [i64; 3]) -> bool {
    let [x, y, z] = position.map(|word| word as f64);
    let limit = PI * f64::from(config.limit) / f64::from(1 << (config.angle_width - 1));
    let (least, most) = config.reach();
    let radius = (x * x + y * y + z * z).sqrt();
    let (pitch, roll) = (z.atan2(x.hypot(y)), (-x).atan2(y));
    pitch.abs() <= limit && roll.abs() <= limit && radius >= f64::from(least) && radius <= f64::from(most)
}

/// Returns the postures of the corners, dead centres and axes, then random ones.
fn postures(config: &GimbalConfig, count: usize) -> impl Iterator<Item = [f64; 3]> + use<> {
    let limit = PI * f64::from(config.limit) / f64::from(1 << (config.angle_width - 1));
    let (least, most) = config.reach();
    let (least, most) = (f64::from(least), f64::from(most));
    let angles = [-limit, -limit / 2.0, 0.0, limit / 3.0, limit];
    let radii = [least, least + 1.0, least + 2.0, (least + most) / 2.0, most - 2.0, most - 1.0, most];
    let mut corners = Vec::new();
    for pitch in angles {
        for roll in angles {
            corners.extend(radii.map(|radius| [pitch, roll, radius]));
        }
    }
    let mut random = Random(7);
    let others = (0..count).map(move |index| {
        // Every fourth radius is close to a dead centre.
        let share = random.next();
        let share = match index % 8 {
            0 => share.powi(6),
            4 => 1.0 - share.powi(6),
            _ => share,
        };
        let [pitch, roll] = [random.next(), random.next()].map(|share| limit * (2.0 * share - 1.0));
        [pitch, roll, least + share * (most - least)]
    });
    corners.into_iter().chain(others)
}

/// Returns the worst distance of the tip in the reach, in metres, and how many targets were in the reach.
fn worst(block: &GimbalInverse, config: &GimbalConfig, count: usize) -> (f64, usize) {
    let (device, bound) = (Device::of(config), block.bound());
    let (mut worst, mut inside): (f64, usize) = (0.0, 0);
    for [pitch, roll, radius] in postures(config, count) {
        let position = target(pitch, roll, radius);
        if is_within(config, position) {
            let joints = block.joints(position);
            let error = apart(device.tip(&joints), position.map(|word| word as f64)) * config.length.lsb();
            assert!(error <= bound, "{position:?} {joints:?}: {error:.3e} m, bound {bound:.3e} m");
            (worst, inside) = (worst.max(error), inside + 1);
        }
    }
    (worst, inside)
}

#[test]
fn the_tip_is_within_10_um_of_every_target_in_the_reach() {
    let (config, block) = (GimbalConfig::default(), GimbalInverse::default());
    let (found, inside) = worst(&block, &config, 400_000);
    println!("default: {found:.3e} m of {:.3e} m, {inside} targets", block.bound());
    assert!(inside > 390_000, "{inside}");
    assert!(block.bound() <= 10e-6, "{:.3e}", block.bound());
    assert!(found > block.bound() / 5.0, "{found:.3e} of {:.3e}", block.bound());
}

#[test]
fn narrow_words_keep_to_their_own_bound() {
    let narrow = GimbalConfig {
        length: Format::new(true, -3, 16).unwrap(),
        crank: 819,
        rod: 3801,
        angle_width: 14,
        limit: 2503,
        guard: 3,
        rotations: 14,
        ..GimbalConfig::default()
    };
    let shifted = GimbalConfig { offset: 400, rotations: 17, ..narrow };
    for config in [narrow, shifted] {
        let block = GimbalInverse::new(config).unwrap();
        let (found, inside) = worst(&block, &config, 100_000);
        println!("{config:?}: {found:.3e} m of {:.3e} m, {inside} targets", block.bound());
        assert!(inside > 90_000 && found > block.bound() / 6.0);
    }
}

#[test]
fn the_words_of_the_paper_s_lengths_lead_to_its_radius_within_one_bit() {
    let config = GimbalConfig::default();
    let words = Device::of(&config);
    let paper = Device { crank: 12.5e-3, rod: 58e-3, offset: 0.0, half_turn: words.half_turn };
    for step in 0..=1000 {
        let psi = PI * f64::from(step) / 1000.0;
        let apart = (words.radius(psi) * config.length.lsb() - paper.radius(psi)).abs();
        assert!(apart <= config.length.lsb(), "{psi}: {apart:.3e}");
    }
    assert!((f64::from(config.limit) / words.half_turn * 180.0 - 55.0).abs() <= 180.0 / words.half_turn);
}

#[test]
fn joints_of_known_postures_have_their_words() {
    let block = GimbalInverse::default();
    let (config, half) = (GimbalConfig::default(), 1i64 << 19);
    let (least, most) = (i64::from(config.reach().0), i64::from(config.reach().1));
    // Straight up, at both dead centres.
    let top = block.joints([0, most, 0]);
    assert_eq!((top.pitch.abs() <= 1, top.roll.abs() <= 1, top.radius), (true, true, most));
    assert!(top.crank <= 2 && top.out_of_reach == 0, "{top:?}");
    let bottom = block.joints([0, least, 0]);
    assert_eq!((bottom.radius, bottom.out_of_reach), (least, 0));
    assert!(bottom.crank >= half - 3, "{bottom:?}");
    // Domain knowledge: the crank at a right angle reaches sqrt(l2^2 - l1^2).
    let right = (f64::from(config.rod).powi(2) - f64::from(config.crank).powi(2)).sqrt();
    let joints = block.joints([0, right.round() as i64, 0]);
    assert!((joints.crank - half / 2).abs() <= 8, "{joints:?}");
}

#[test]
fn a_target_beyond_the_reach_is_flagged_and_each_joint_is_at_its_nearest_limit() {
    let block = GimbalInverse::default();
    let (config, limit) = (GimbalConfig::default(), i64::from(GimbalConfig::default().limit));
    let (least, most) = (i64::from(config.reach().0), i64::from(config.reach().1));
    let mut random = Random(3);
    let mut seen = [0; 4];
    for _ in 0..200_000 {
        let position = std::array::from_fn(|_| ((2.0 * random.next() - 1.0) * 500_000.0).round() as i64);
        let [x, y, z] = position.map(|word| word as f64);
        let joints = block.joints(position);
        let exact = [z.atan2(x.hypot(y)), (-x).atan2(y)].map(|angle| angle / PI * f64::from(1 << 19));
        let radius = (x * x + y * y + z * z).sqrt();
        let mut is_out = radius < least as f64 - 3.0 || radius > most as f64 + 3.0;
        for (joint, exact) in [joints.pitch, joints.roll].into_iter().zip(exact) {
            assert!(joint.abs() <= limit);
            // Vectors this long have angles within 40 words; the wrap at half a turn is far beyond the limit.
            if x.hypot(y) > 20_000.0 && exact.abs() < 510_000.0 {
                let wanted = exact.clamp(-limit as f64, limit as f64);
                assert!((joint as f64 - wanted).abs() <= 40.0, "{position:?} {joints:?} {wanted}");
            }
            is_out |= exact.abs() > limit as f64 + 40.0 && x.hypot(y) > 20_000.0;
        }
        assert!(joints.radius >= least && joints.radius <= most);
        if is_out {
            assert_eq!(joints.out_of_reach, 1, "{position:?} {joints:?}");
        }
        seen[usize::from(is_out) * 2 + joints.out_of_reach as usize] += 1;
    }
    assert!(seen[0] > 50 && seen[3] > 100_000, "{seen:?}");
    let origin = block.joints([0, 0, 0]);
    assert_eq!((origin.pitch, origin.roll, origin.radius, origin.out_of_reach), (0, 0, least, 1));
}

#[test]
fn the_joints_are_shown_after_the_latency_and_a_start_gives_up_the_last() {
    let mut block = GimbalInverse::default();
    let idle = gimbal_inverse::In { start: 0, x: 1, y: 2, z: 3 };
    let (x, y, z) = (-100_000, 200_000, 80_000);
    let start = gimbal_inverse::In { start: 1, x, y, z };
    assert_eq!(block.latency(), 93);
    for given_up in [1, 40, 93] {
        Block::reset(&mut block);
        block.tick(gimbal_inverse::In { start: 1, x: 7, y: 9, z: -5 });
        for _ in 1..given_up {
            let out = block.tick(idle);
            assert_eq!((out.busy, out.ready, out.radius), (1, 0, 0));
        }
        block.tick(start);
        for _ in 1..block.latency() {
            let out = block.tick(idle);
            assert_eq!((out.busy, out.ready, out.radius), (1, 0, 0));
        }
        let gimbal_inverse::Out { pitch, roll, crank, radius, out_of_reach, busy, ready } = block.tick(idle);
        assert_eq!((busy, ready), (0, 1));
        assert_eq!(Joints { pitch, roll, crank, radius, out_of_reach }, block.joints([x, y, z]));
        assert_eq!(block.tick(idle).ready, 0);
    }
}

#[test]
fn the_equations_compute_the_joints_of_random_postures() {
    for (label, block) in variants().into_iter().filter(|(_, block)| block.name() == "gimbal_inverse") {
        let mut block = block;
        let mut step = block.equations().expect("equations").in_words();
        let registers = block.equations().expect("equations").registers;
        let mut held: Vec<_> = registers.iter().map(|register| register.reset.unwrap_or(0)).collect();
        block.reset();
        let mut random = Random(11);
        let most = block.inputs()[1].format.max() as f64;
        for edge in 0..20_000 {
            let position = [0; 3].map(|_| ((2.0 * random.next() - 1.0) * 0.6 * most) as i64);
            let words = [&[i64::from(edge % 100 == 0)][..], &position].concat();
            held = step(&held, &words).0;
            assert_eq!(step(&held, &words).1, block.tick(&words), "{label}: edge {edge}");
        }
    }
}

#[test]
fn the_crank_table_is_the_closed_form_to_the_nearest_word() {
    for config in [
        GimbalConfig::default(),
        GimbalConfig { offset: 1000, count: [1, 614], ..GimbalConfig::default() },
        GimbalConfig { count: [7, 2200], ..GimbalConfig::default() },
    ] {
        let mut block = CrankTable::new(config).unwrap();
        let device = Device::of(&config);
        let last = i64::from(config.count[1] / config.count[0]);
        for count in -1024..1024 {
            let psi = PI * count.clamp(0, last) as f64 * f64::from(config.count[0]) / f64::from(config.count[1]);
            let crank_table::Out { radius, slope } = block.tick(crank_table::In { count });
            assert!((radius as f64 - device.radius(psi)).abs() <= 0.5 + 1e-6, "{count}");
            // A central difference of the closed form. Its own error is `step^2 / 6` times the third derivative, at
            // most a few crank lengths (5e-4 words), and the rounding of 300 000 words in `f64` over the step.
            let step = 1e-4;
            let derivative = (device.radius(psi + step) - device.radius(psi - step)) / (2.0 * step);
            assert!((slope as f64 - derivative).abs() <= 0.5 + 1e-3, "{count}: {slope} {derivative}");
            assert!(slope <= 0);
        }
    }
    // The known answer of the device: the steepest slope is 12.7875665 mm a radian, the travel 25 mm.
    let mut block = CrankTable::default();
    let words: Vec<_> = (0..=614).map(|count| block.tick(crank_table::In { count })).collect();
    let lsb = GimbalConfig::default().length.lsb();
    let steepest = words.iter().map(|out| -out.slope).max().unwrap() as f64 * lsb;
    assert!((steepest - 12.7875665e-3).abs() <= 0.5e-6, "{steepest}");
    let travel = (words[0].radius - words[614].radius) as f64 * lsb;
    assert!((travel - 25e-3).abs() <= 1e-6, "{travel}");
}

#[test]
fn devices_that_do_not_exist_are_refused() {
    let device = GimbalConfig::default();
    let refused = [
        (GimbalConfig { rod: device.crank, ..device }, "ROD_LENGTH"),
        (GimbalConfig { crank: 0, ..device }, "CRANK_LENGTH"),
        (GimbalConfig { offset: 300_000, ..device }, "OFFSET + ROD_LENGTH + CRANK_LENGTH"),
        (GimbalConfig { length: Format::new(true, -3, 31).unwrap(), ..device }, "LENGTH_WIDTH"),
    ];
    for (config, why) in refused {
        let [inverse, table] =
            [GimbalInverse::new(config).unwrap_err().to_string(), CrankTable::new(config).unwrap_err().to_string()];
        assert!(inverse.contains(why) && table.contains(why), "{inverse}; {table}");
    }
    let error = GimbalInverse::new(GimbalConfig { limit: 1 << 19, ..device }).unwrap_err().to_string();
    assert_eq!(error, "gimbal_inverse: LIMIT is 524288; accepted: 1 to 524287");
    let error = CrankTable::new(GimbalConfig { count_width: 9, ..device }).unwrap_err().to_string();
    assert_eq!(error, "crank_table: COUNT_DEN / COUNT_NUM is 614; accepted: 1 to 255");
}
