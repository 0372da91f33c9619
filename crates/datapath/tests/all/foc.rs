//! The blocks of field-oriented control compared with their equations in exact integers.

use std::cmp::Ordering;

use hpu_datapath::Block;
use hpu_datapath::foc::{
    Clarke, ClarkeConfig, InversePark, Park, RotationConfig, SpaceVector, SpaceVectorConfig, ThreePhasePwm,
    ThreePhasePwmConfig, clarke, inverse_park, park, space_vector, three_phase_pwm,
};
use hpu_datapath::phantom::{Phase, TrigCordic, Turn};
use hpu_signal::Format;

/// Returns a number of at most so many bits, with its sign.
pub fn draw(state: &mut u64, format: Format) -> i64 {
    *state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
    format.from_bits((*state ^ (*state >> 29)) >> (*state >> 58 & 31))
}

/// Compares `x` with `y / sqrt(3)` in exact integers.
fn against_root(x: i128, y: i128) -> Ordering {
    (3 * x * x.abs()).cmp(&(y * y.abs()))
}

/// Returns `value / 2^drop` to the nearest, ties up.
fn nearest(value: i128, drop: u32) -> i128 {
    (2 * value + (1 << drop)).div_euclid(2 << drop)
}

/// Returns the nearest whole number to `2^frac / sqrt(3)`, by halving.
fn inverse_root(frac: u32) -> i128 {
    let (mut low, mut high) = (0i128, 1i128 << frac);
    while high - low > 1 {
        let middle = i128::midpoint(low, high);
        if against_root(middle, 1 << frac) == Ordering::Greater { high = middle } else { low = middle }
    }
    if against_root(2 * low + 1, 2 << frac) == Ordering::Less { low + 1 } else { low }
}

/// Compares a transformation with its equations and with the error that it states.
fn transforms(config: ClarkeConfig, currents: impl Iterator<Item = [i64; 3]>) {
    let block = Clarke::new(config).unwrap();
    let f = config.width + config.frac + 2;
    let [root, third] = [inverse_root(f), nearest((1 << f) * 2, 1) / 3 + i128::from((1i128 << f) % 3 == 2)];
    let one = 1i128 << config.frac;
    let mut worst = 0.0_f64;
    for [a, b, c] in currents {
        let out = block.eval(clarke::In { a, b, c });
        let [a, b, c] = [a, b, c].map(i128::from);
        let (along, across) = if config.three { (2 * a - b - c, b - c) } else { (3 * a, a + 2 * b) };
        let alpha = if config.three { nearest(along * third, f - config.frac) } else { a * one };
        assert_eq!(i128::from(out.alpha.word), alpha, "{config:?} {a} {b} {c}");
        let beta = i128::from(out.beta.word);
        assert_eq!(beta, nearest(across * root, f - config.frac), "{config:?} {a} {b} {c}");
        assert!(!out.alpha.overflowed && !out.beta.overflowed);
        // 16 times the words are within 11 of 16 times the exact values.
        assert!((48 * alpha - 16 * one * along).abs() <= 33, "{config:?} {a} {b} {c}");
        let exact = 16 * one * across;
        assert_ne!(against_root(16 * beta - 11, exact), Ordering::Greater, "{config:?} {a} {b} {c}");
        assert_ne!(against_root(16 * beta + 11, exact), Ordering::Less, "{config:?} {a} {b} {c}");
        worst = worst.max((beta as f64 - (one * across) as f64 / 3f64.sqrt()).abs());
    }
    assert!(worst > 0.4, "{worst}: words were rounded");
}

#[test]
fn every_narrow_triple_of_currents_is_transformed_within_its_error() {
    let all = |width: u32| {
        let most = 1i64 << (width - 1);
        (-most..most).flat_map(move |a| (-most..most).flat_map(move |b| (-most..most).map(move |c| [a, b, c])))
    };
    for (width, frac) in [(2, 0), (3, 2), (5, 0), (5, 3)] {
        for three in [false, true] {
            transforms(ClarkeConfig { width, frac, three }, all(width));
        }
    }
}

#[test]
fn random_currents_are_transformed_within_the_error() {
    for (width, frac) in [(12, 3), (18, 10), (16, 0)] {
        for three in [false, true] {
            let (mut state, format) = (u64::from(width), Format::signed(width));
            let ends = [format.min(), format.max()].map(|word| word as i64);
            let corners = ends.into_iter().flat_map(move |a| ends.map(|b| [a, b, a]));
            let words = (0..50_000).map(|_| [(); 3].map(|()| draw(&mut state, format)));
            transforms(ClarkeConfig { width, frac, three }, corners.chain(words));
        }
    }
}

#[test]
fn a_current_common_to_three_phases_drops_out() {
    let block = Clarke::new(ClarkeConfig { width: 14, frac: 2, three: true }).unwrap();
    let mut state = 3;
    for _ in 0..2000 {
        let [a, b, c, common] = [(); 4].map(|()| draw(&mut state, Format::signed(12)));
        let of = |more: i64| block.eval(clarke::In { a: a + more, b: b + more, c: c + more });
        assert_eq!(of(common), of(0));
    }
}

/// Returns both sums of products, narrowed as the data sheets say.
fn rotated([x, y]: [i64; 2], [sine, cosine]: [i64; 2], config: RotationConfig) -> [i64; 2] {
    let [x, y, sine, cosine] = [x, y, sine, cosine].map(i128::from);
    let most = (1i128 << (config.width - 1)) - 1;
    let frac = config.trig.frac().unsigned_abs();
    [x * cosine + y * sine, y * cosine - x * sine].map(|sum| nearest(sum, frac).clamp(-most - 1, most) as i64)
}

/// Compares both rotations with exact integers.
fn rotates(blocks: (&Park, &InversePark), config: RotationConfig, [x, y, sine, cosine]: [i64; 4]) {
    let park::Out { d, q } = blocks.0.eval(park::In { alpha: x, beta: y, sine, cosine }).map(|word| word.word);
    assert_eq!([d, q], rotated([x, y], [sine, cosine], config), "{config:?} {x} {y} {sine} {cosine}");
    let out = blocks.1.eval(inverse_park::In { d: x, q: y, sine, cosine }).map(|word| word.word);
    assert_eq!([out.alpha, out.beta], rotated([x, y], [-sine, cosine], config), "{config:?} {x} {y} {sine} {cosine}");
}

#[test]
fn every_narrow_rotation_is_rounded_once_and_saturates() {
    let config = RotationConfig { width: 4, trig: Format::new(true, 1, 4).unwrap() };
    let blocks = (&Park::new(config).unwrap(), &InversePark::new(config).unwrap());
    for bits in 0..1i64 << 20 {
        let word = |low: u32, width: u32| Format::signed(width).from_bits((bits >> low).cast_unsigned());
        rotates(blocks, config, [word(0, 4), word(4, 4), word(8, 6), word(14, 6)]);
    }
}

#[test]
fn random_rotations_are_rounded_once_and_saturate() {
    let of = |width, int, frac| RotationConfig { width, trig: Format::new(true, int, frac).unwrap() };
    for config in [RotationConfig::default(), of(16, 9, 22), of(32, 1, 30), of(32, 9, 30)] {
        let blocks = (&Park::new(config).unwrap(), &InversePark::new(config).unwrap());
        let mut state = 1;
        for _ in 0..200_000 {
            let vector = [(); 2].map(|()| draw(&mut state, Format::signed(config.width)));
            let angle = [(); 2].map(|()| draw(&mut state, config.trig));
            rotates(blocks, config, [vector[0], vector[1], angle[0], angle[1]]);
        }
    }
}

#[test]
fn a_vector_at_an_angle_lies_along_the_rotor_and_comes_back() {
    let config = RotationConfig::default();
    let turn = Turn { num: 7, den: 4096 };
    let trig = TrigCordic::new(Phase { width: 36, trig: config.trig, ..Phase::default() }.of(turn), 17, 4).unwrap();
    let (forward, back) = (Park::new(config).unwrap(), InversePark::new(config).unwrap());
    for count in -2048..2048 {
        let angle = std::f64::consts::TAU * (f64::from(count) * 7.0 / 4096.0);
        let words = trig.at(count.into());
        let (sine, cosine) = (words.sine, words.cosine);
        // The words of the sines are off by this much.
        let off = |word: i64, exact: f64| (word as f64 / 16_384.0 - exact).abs();
        let e = off(sine, angle.sin()).max(off(cosine, angle.cos()));
        // 17 rotations of 4 guard bits drop less than 1.6 of their least significant bits, and turn to within 0.3.
        assert!(16_384.0 * e < 2.4, "{e}");
        for length in [100.0, 30_000.0] {
            let [alpha, beta] = [angle.cos(), angle.sin()].map(|share| (length * share).round() as i64);
            let park::Out { d, q } = forward.eval(park::In { alpha, beta, sine, cosine }).map(|word| word.word);
            // Both words of the vector are off by at most half a unit, which turns with it.
            let bound = 0.5 + e * (alpha.abs() + beta.abs()) as f64 + 0.5f64.sqrt();
            assert!((d as f64 - length).abs() <= bound && (q as f64).abs() <= bound, "{count} {length}: {d} {q}");
            let again = back.eval(inverse_park::In { d, q, sine, cosine }).map(|word| word.word);
            let bound = 0.5 + 0.5f64.sqrt() + 3.0 * e * length;
            let miss = [again.alpha - alpha, again.beta - beta].map(|miss| miss.abs() as f64);
            assert!(miss[0] <= bound && miss[1] <= bound, "{count} {length}: {miss:?}");
        }
    }
}

/// Returns the exact duties of a voltage by the table of sectors, as parts of `STEPS`, and their denominator.
/// `root` is the word for the root of 3, over `2^f`.
fn by_sector([alpha, beta]: [i128; 2], root: i128, f: u32, width: u32) -> ([i128; 3], i128) {
    // The times of the active vectors, of which a period has `one`.
    let one = 1 << (f + width);
    let along = (3 * alpha) << f;
    let [x, y, z] = [2 * root * beta, root * beta + along, root * beta - along];
    let [a, ab, b, bc, c, ca] = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]];
    let sector = match (x >= 0, y >= 0, z >= 0) {
        (true, _, false) => [(a, -z), (ab, x)],
        (true, true, true) => [(ab, y), (b, z)],
        (true, false, true) => [(b, x), (bc, -y)],
        (false, _, true) => [(bc, z), (c, -x)],
        (false, false, false) => [(c, -y), (ca, -z)],
        (false, true, false) => [(ca, -x), (a, y)],
    };
    assert!(sector.iter().all(|(_, time)| *time >= 0), "{sector:?}");
    let rest = one - sector[0].1 - sector[1].1;
    // Half of the rest with all legs high, half with all low.
    let duty = |leg: usize| rest + sector.iter().map(|(high, time)| 2 * high[leg] * time).sum::<i128>();
    ([duty(0), duty(1), duty(2)], 2 * one)
}

/// Compares a modulation with the table of sectors, or with sines, and with the error that it states.
fn modulates(config: SpaceVectorConfig, voltages: impl Iterator<Item = [i64; 2]>) {
    let (block, f) = (SpaceVector::new(config).unwrap(), config.duty_width + 2);
    let root = nearest(3 * inverse_root(f + 20), 20);
    let (steps, mut free) = (i128::from(config.steps), 0);
    for [alpha, beta] in voltages {
        let out = block.eval(space_vector::In { alpha, beta });
        let shown = [out.duty_a, out.duty_b, out.duty_c];
        let voltage = [alpha, beta].map(i128::from);
        let (exact, whole) = if config.sinusoidal {
            let [along, across] = [voltage[0] << f, root * voltage[1]];
            let half = 1 << (f + config.width);
            ([half + 4 * along, half + 2 * (across - along), half - 2 * (across + along)], 2 * half)
        } else {
            by_sector(voltage, root, f, config.width)
        };
        let full = (1i64 << (config.width - 1)) as f64;
        let [x, y] = [alpha as f64 / full, beta as f64 / full * 3f64.sqrt()];
        let phases = [x, (y - x) / 2.0, (-x - y) / 2.0];
        let middle = |pick: fn(f64, f64) -> f64| phases.into_iter().reduce(pick).unwrap() / 2.0;
        let common = if config.sinusoidal { 0.0 } else { middle(f64::max) + middle(f64::min) };
        for leg in 0..3 {
            let duty = (2 * steps * exact[leg] + whole).div_euclid(2 * whole);
            assert_eq!(i128::from(shown[leg].word), duty.clamp(0, steps), "{config:?} {alpha} {beta} {leg}");
            assert_eq!(shown[leg].overflowed, duty != duty.clamp(0, steps));
            let real = (0.5 + phases[leg] - common) * steps as f64;
            if !shown[leg].overflowed {
                free += 1;
                assert!((shown[leg].word as f64 - real).abs() < 0.625, "{config:?} {alpha} {beta} {leg}");
            }
        }
    }
    assert!(free > 100, "{free}");
}

#[test]
fn duties_are_those_of_the_table_of_sectors() {
    let all = |width: u32| {
        let most = 1i64 << (width - 1);
        (-most..most).flat_map(move |alpha| (-most..most).map(move |beta| [alpha, beta]))
    };
    for sinusoidal in [false, true] {
        for (width, duty_width, steps) in [(4, 3, 6), (5, 4, 13), (7, 2, 3), (8, 9, 400)] {
            modulates(SpaceVectorConfig { width, duty_width, steps, sinusoidal }, all(width));
        }
        for config in [
            SpaceVectorConfig { sinusoidal, ..SpaceVectorConfig::default() },
            SpaceVectorConfig { width: 22, duty_width: 16, steps: 65_535, sinusoidal },
        ] {
            let mut state = 1;
            let voltages = (0..100_000).map(|_| [(); 2].map(|()| draw(&mut state, Format::signed(config.width))));
            modulates(config, voltages);
        }
    }
}

/// Returns the configurations of a modulator in which everything is tried.
fn short_modulators() -> Vec<ThreePhasePwmConfig> {
    let mut all = Vec::new();
    for (steps, dead_time, min_pulse, sample_delay) in
        [(5, 0, 0, 1), (5, 4, 2, 4), (6, 1, 1, 3), (7, 2, 3, 2), (8, 3, 4, 7), (7, 6, 0, 5)]
    {
        for peak in [false, true] {
            all.push(ThreePhasePwmConfig { duty_width: 4, steps, dead_time, min_pulse, sample_delay, peak });
        }
    }
    all
}

/// A modulator by its data sheet: the states that each leg was asked for, from the first clock on.
struct Asked {
    config: ThreePhasePwmConfig,
    held: [i64; 3],
    states: [Vec<Option<bool>>; 3],
}

impl Asked {
    fn new(config: ThreePhasePwmConfig) -> Self {
        Self { config, held: [0; 3], states: [const { Vec::new() }; 3] }
    }

    /// Returns the outputs after an edge.
    fn tick(&mut self, input: three_phase_pwm::In<i64>) -> three_phase_pwm::Out<i64> {
        let ThreePhasePwmConfig { steps, dead_time, min_pulse, sample_delay, peak, .. } = self.config;
        let (steps, least) = (i64::from(steps), i64::from(min_pulse));
        let phase = self.states[0].len() as i64 % (2 * steps);
        let since = if peak { phase % steps } else { phase };
        if since == 0 {
            self.held = [input.duty_a, input.duty_b, input.duty_c].map(|duty| match duty {
                _ if duty < least => 0,
                _ if duty > steps - least => steps,
                _ => duty,
            });
        }
        // The carrier: 0, 1 .. STEPS-1, STEPS-1 .. 1, 0.
        let carrier = if phase < steps { phase } else { 2 * steps - 1 - phase };
        let mut gates = Vec::new();
        for (held, states) in self.held.iter().zip(&mut self.states) {
            states.push((input.enable != 0).then_some(carrier >= steps - held));
            // A gate is on when its switch was asked for in this clock and in all of the dead time before it.
            let mut recent = states.iter().rev().copied().chain(std::iter::repeat(None)).take(dead_time as usize + 1);
            let first = recent.next().expect("this clock");
            let shown = if recent.all(|state| state == first) { first } else { None };
            gates.extend([shown == Some(true), shown == Some(false)].map(i64::from));
        }
        let sample = i64::from(since == i64::from(sample_delay) && input.enable != 0);
        three_phase_pwm::Out {
            a_high: gates[0],
            a_low: gates[1],
            b_high: gates[2],
            b_low: gates[3],
            c_high: gates[4],
            c_low: gates[5],
            trigger: i64::from(since == 0),
            sample,
        }
    }
}

/// Holds two gates of a leg apart: the clocks since either was on.
struct Apart([u64; 2]);

impl Apart {
    fn see(&mut self, gates: [i64; 2], dead_time: u64) {
        assert_ne!(gates, [1, 1], "both switches of a leg");
        for (gate, other) in gates.into_iter().zip([self.0[1], self.0[0]]) {
            assert!(gate == 0 || other >= dead_time, "{other} clocks between the switches of a leg");
        }
        self.0 = [0, 1].map(|side| if gates[side] == 1 { 0 } else { self.0[side].saturating_add(1) });
    }
}

#[test]
fn every_pair_of_duties_keeps_the_dead_time_and_the_least_pulse() {
    for config in short_modulators() {
        let (dead_time, period) = (config.dead_time.into(), 2 * config.steps as usize);
        let takes = if config.peak { config.steps as usize } else { period };
        for pair in 0..256 {
            let (mut block, mut asked) = (ThreePhasePwm::new(config).unwrap(), Asked::new(config));
            Block::reset(&mut block);
            let mut apart = [const { Apart([u64::MAX; 2]) }; 3];
            for clock in 0..4 * period {
                // Leg A has one duty after the other, B the other way round, C a third.
                let [one, other] = if clock / takes % 2 == 0 { [pair % 16, pair / 16] } else { [pair / 16, pair % 16] };
                let at_take = clock % takes == 0;
                let mut input = three_phase_pwm::In { duty_a: one, duty_b: other, duty_c: one ^ other, enable: 1 };
                if !at_take {
                    // Words between the takes do not matter.
                    input = three_phase_pwm::In { duty_a: 15 - one, duty_b: clock as i64 % 16, duty_c: 7, enable: 1 };
                }
                let out = block.tick(input);
                assert_eq!(out, asked.tick(input), "{config:?} {pair} {clock}");
                apart[0].see([out.a_high, out.a_low], dead_time);
                apart[1].see([out.b_high, out.b_low], dead_time);
                apart[2].see([out.c_high, out.c_low], dead_time);
            }
            for states in &asked.states {
                let runs: Vec<_> = states.chunk_by(|one, other| one == other).map(<[_]>::len).collect();
                let inner = &runs[1..runs.len().max(2) - 1];
                assert!(inner.iter().all(|run| *run >= config.min_pulse as usize), "{config:?} {runs:?}");
                if pair % 16 == pair / 16 {
                    assert!(inner.iter().all(|run| *run >= 2 * config.min_pulse as usize), "{config:?} {runs:?}");
                }
            }
        }
    }
}

#[test]
fn gates_stay_apart_whenever_they_are_enabled() {
    for config in short_modulators() {
        let (mut block, mut asked, mut state) = (ThreePhasePwm::new(config).unwrap(), Asked::new(config), 7u64);
        Block::reset(&mut block);
        let mut apart = [const { Apart([u64::MAX; 2]) }; 3];
        let mut enable = 1;
        for _ in 0..20_000 {
            let [duty_a, duty_b, duty_c] = [(); 3].map(|()| draw(&mut state, Format::unsigned(4)));
            enable ^= i64::from(state >> 40 & 7 == 0);
            let input = three_phase_pwm::In { duty_a, duty_b, duty_c, enable };
            let out = block.tick(input);
            assert_eq!(out, asked.tick(input), "{config:?}");
            assert!(enable == 1 || [out.a_high, out.a_low, out.b_high, out.b_low, out.c_high, out.c_low] == [0; 6]);
            apart[0].see([out.a_high, out.a_low], config.dead_time.into());
            apart[1].see([out.b_high, out.b_low], config.dead_time.into());
            apart[2].see([out.c_high, out.c_low], config.dead_time.into());
        }
    }
}

#[test]
fn a_carrier_leaps_from_switching_to_switching() {
    let mut block = ThreePhasePwm::default();
    Block::reset(&mut block);
    let input = three_phase_pwm::In { duty_a: 300, duty_b: 0, duty_c: 1250, enable: 1 };
    let (mut edges, mut ticks) = (0, 0);
    while edges < 20 * 2500 {
        let quiet = block.quiet(&input);
        block.skip(quiet, &input);
        block.tick(input);
        edges += quiet + 1;
        ticks += 1;
    }
    // Of a period: trigger and sample, up and down; leg A off and on at either end of its pulse. At first, legs turn
    // on once.
    assert!(ticks <= 20 * 8 + 2, "{ticks} ticks");
    // At rest, trigger and sample alone.
    block.rest();
    let mut changes = 0;
    let mut shown = block.tick(input);
    for _ in 0..20 * 2500 {
        let out = block.tick(input);
        changes += u32::from(out != shown);
        assert_eq!([out.a_high, out.a_low, out.b_high, out.b_low, out.c_high, out.c_low], [0; 6]);
        shown = out;
    }
    assert_eq!(changes, 20 * 4);
}
