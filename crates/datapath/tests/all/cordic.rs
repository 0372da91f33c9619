//! The CORDIC against arc tangent and square root in floating point, whose errors are far below a least significant
//! bit. No rotation is made here.

use std::f64::consts::PI;

use hpu_datapath::{Block, Cordic, CordicBound, CordicConfig, cordic};

fn cordic(width: u32, angle_width: u32, guard: u32, rotations: u32) -> Cordic {
    Cordic::new(CordicConfig { width, angle_width, guard, rotations }).expect("a configuration")
}

/// Starts the block with a vector and returns its results, after checks of its sequence.
fn measure(block: &mut Cordic, x: i64, y: i64) -> (i64, i64) {
    let before = block.tick(cordic::In { start: 1, x, y });
    assert_eq!((before.busy, before.ready), (1, 0));
    let idle = cordic::In { start: 0, x: 1, y: -1 };
    for _ in 1..block.config().steps() {
        assert_eq!(block.tick(idle), before);
    }
    let out = block.tick(idle);
    assert_eq!((out.busy, out.ready), (0, 1));
    assert_eq!(block.tick(idle), cordic::Out { ready: 0, ..out });
    (out.radius, out.angle)
}

/// Returns the errors of both results: of the angle in half turns, of the radius in least significant bits.
fn errors(config: CordicConfig, (x, y): (i64, i64), (radius, angle): (i64, i64)) -> CordicBound {
    let (x, y) = (x as f64, y as f64);
    let apart = angle as f64 / f64::from(1 << (config.angle_width - 1)) - y.atan2(x) / PI;
    CordicBound { angle: (apart - 2.0 * (apart / 2.0).round()).abs(), radius: (radius as f64 - x.hypot(y)).abs() }
}

/// The worst errors seen, and the worst shares of their bounds.
#[derive(Debug, Default)]
struct Worst {
    angle: f64,
    radius: f64,
    of_angle: f64,
    of_radius: f64,
}

impl Worst {
    fn see(&mut self, config: CordicConfig, vector: (i64, i64), results: (i64, i64)) {
        let found = errors(config, vector, results);
        let bound = config.bound((vector.0 as f64).hypot(vector.1 as f64));
        assert!(found.angle <= bound.angle, "{config:?} {vector:?} {results:?}: {found:?} {bound:?}");
        assert!(found.radius <= bound.radius, "{config:?} {vector:?} {results:?}: {found:?} {bound:?}");
        *self = Self {
            angle: self.angle.max(found.angle),
            radius: self.radius.max(found.radius),
            of_angle: self.of_angle.max(found.angle / bound.angle),
            of_radius: self.of_radius.max(found.radius / bound.radius),
        };
    }

    fn tell(&self, name: &str, config: CordicConfig) {
        let lsb = f64::from(1 << (config.angle_width - 1));
        let Self { angle, radius, of_angle, of_radius } = self;
        let angle = angle * lsb;
        println!("{name}: angle {angle:.3} LSB, {of_angle:.3} of its bound; radius {radius:.3}, {of_radius:.3}");
    }
}

#[test]
fn every_vector_of_up_to_10_bits_is_measured_within_the_bound() {
    for (width, angle_width, guard, rotations) in
        [(3, 3, 1, 4), (6, 8, 0, 6), (8, 9, 3, 9), (8, 12, 4, 12), (10, 8, 0, 10), (10, 16, 7, 17)]
    {
        let mut block = cordic(width, angle_width, guard, rotations);
        let (config, half) = (block.config(), 1i64 << (width - 1));
        let mut worst = Worst::default();
        for x in -half..half {
            for y in -half..half {
                let results = block.measure(x, y);
                if (x + y) % 61 == 0 {
                    assert_eq!(measure(&mut block, x, y), results);
                }
                if (x, y) == (0, 0) {
                    assert_eq!(results, (0, 0));
                } else {
                    worst.see(config, (x, y), results);
                }
            }
        }
        worst.tell(&format!("{config:?}"), config);
        assert!(worst.of_angle > 0.3 && worst.of_radius > 0.3, "{config:?}: {worst:?}");
    }
}

/// Returns the next of a sequence of pseudo-random numbers (Vigna's splitmix64).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

#[test]
fn random_vectors_are_measured_within_the_bound() {
    for (config, count) in [
        (CordicConfig::default(), 1_500_000),
        (CordicConfig { width: 25, angle_width: 24, guard: 7, rotations: 27 }, 300_000),
    ] {
        let block = Cordic::new(config).expect("a configuration");
        let (mut state, mut long, mut all) = (1, Worst::default(), Worst::default());
        for _ in 0..count {
            // Vectors of all lengths.
            let bits = random(&mut state) % u64::from(config.width) + 1;
            let mut word = || {
                let low = random(&mut state) >> (64 - bits);
                low as i64 - (1 << (bits - 1))
            };
            let (x, y) = (word(), word());
            if (x, y) != (0, 0) {
                let results = block.measure(x, y);
                all.see(config, (x, y), results);
                if (x as f64).hypot(y as f64) >= f64::from(1 << (config.width - 4)) {
                    long.see(config, (x, y), results);
                }
            }
        }
        all.tell("all lengths", config);
        long.tell("an eighth of full scale and longer", config);
        assert!(all.of_angle > 0.3 && all.of_radius > 0.3, "{config:?}: {all:?}");
        assert!(long.of_angle > 0.3 && long.of_radius > 0.3, "{config:?}: {long:?}");
    }
}

#[test]
fn the_axes_and_the_diagonals_have_their_words() {
    let block = Cordic::default();
    let (one, most) = (1 << 19, (1 << 20) - 1);
    let cases = [
        ((one, 0), (one, 0)),
        ((0, one), (one, one / 2)),
        ((0, -one), (one, -one / 2)),
        ((-one, 0), (one, -one)),
        ((one, one), (741_455, one / 4)),
        ((-one, -one), (741_455, -3 * one / 4)),
        ((-one, one), (741_455, 3 * one / 4)),
        ((-2 * one, 0), (2 * one, -one)),
        ((-2 * one, -2 * one), (1_482_910, -3 * one / 4)),
        ((most, 0), (most, 0)),
    ];
    for ((x, y), (radius, angle)) in cases {
        let (found_radius, found_angle) = block.measure(x, y);
        let turned = (found_angle - angle + one).rem_euclid(2 * one) - one;
        assert!((found_radius - radius).abs() <= 1 && turned.abs() <= 1, "{x} {y}: {found_radius} {found_angle}");
    }
}

#[test]
fn a_start_gives_up_the_rotations_under_way_even_on_their_last_edge() {
    let mut block = cordic(8, 9, 3, 9);
    let held = measure(&mut block, 30, 40);
    assert_eq!(held.0, 50);
    for passed in 1..=block.config().steps() {
        block.tick(cordic::In { start: 1, x: -7, y: 5 });
        for _ in 1..passed {
            let out = block.tick(cordic::In { start: 0, x: 0, y: 0 });
            assert_eq!(((out.radius, out.angle), out.busy, out.ready), (held, 1, 0));
        }
        assert_eq!(measure(&mut block, 30, 40), held, "given up on edge {passed}");
    }
}

#[test]
fn widths_beyond_the_data_sheet_are_refused() {
    for (width, angle_width, guard, rotations) in
        [(2, 9, 0, 4), (26, 9, 0, 9), (8, 2, 0, 4), (8, 25, 0, 8), (8, 9, 8, 8), (8, 9, 0, 3), (8, 9, 1, 10)]
    {
        let config = CordicConfig { width, angle_width, guard, rotations };
        assert!(Cordic::new(config).is_err(), "{config:?}");
    }
}
