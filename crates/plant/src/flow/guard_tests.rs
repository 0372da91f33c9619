//! The searches of a guard against every edge, and its bounds in exact integers.

use super::{Band, Forecast, Guard, Limits, MotionPoint, STEADY, Side, Steady, Watch, dyadic};
use crate::flow::double::{Double, Doubles, Native};
use crate::flow::linear::{Linear, Trajectory};
use crate::flow::matrix::Matrix;

/// A motor held by a hand, whose current decays in 0.1 ms; and one that swings within 63 us.
const SYSTEMS: [Matrix; 2] = [
    [[-1e4, -60.0, 0.0, 0.0], [2e3, -5.0, -3e5, 3e5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]],
    [[-1e4, -60.0, 0.0, 0.0], [2e3, -5.0, -1e10, 1e10], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]],
];

/// Motions of all kinds in bands of all widths: a confirmed forecast is the first edge at which the value, looked
/// at edge by edge, lies outside. Half of the forecasts are made at random, since a proof must not depend on them.
#[test]
fn a_confirmed_forecast_is_the_first_exit_edge_by_edge() {
    let systems = SYSTEMS.map(|a| Linear::new(a, 2e-8, 1 << 16));
    let mut state = 1u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    // Confirmed while moving toward the limit, after a turn, and forecasts that were not confirmed.
    let (mut straight, mut turned, mut refused, mut nearer) = (0, 0, 0, 0);
    for case in 0..60_000 {
        let system = &systems[usize::from(case % 10 != 0)];
        let x = [2.0 * next(), 0.4 * next(), 0.5, 0.5 + 0.01 * next()];
        let f = [2e4 * next(), 600.0 * next(), 0.0, 0.0];
        let motion = Trajectory::new(system, x, f);
        let row = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]][case % 3];
        let guard = Guard::new(row, system);
        let start = guard.value(&x);
        let width = [1.0, 20.0, 1e-4][case % 3] * 10f64.powf(-3.0 * (next() + 0.5));
        let share = next() + 0.5;
        let band = Band { low: start - share * width, high: start + (1.0 - share) * width, open: true };
        let limits = Limits::from(&band);
        let from = MotionPoint::of(&motion, 0);
        let forecast = if case % 2 == 0 {
            guard.forecast(&motion, &limits, &from)
        } else {
            Forecast { edges: 6000.0 * (next() + 0.5), rising: next().signum() }
        };
        if !(0.0..=6000.0).contains(&forecast.edges) {
            continue;
        }
        let noise = guard.noise(&motion, dyadic(forecast.late()), &limits);
        let mut watch = Watch { motion: &motion, limits, noise, again: &mut 0 };
        let mut is_outside = |edge| guard.side(&mut watch, edge, guard.value(&motion.at(edge))) != Side::Inside;
        let first = (1..=forecast.late()).find(|&edge| is_outside(edge));
        let exit = guard.confirm(&mut watch, &from, forecast, forecast.late());
        // Looked for up to the exit itself, or a little less far or farther.
        for most in first.map_or(0..0, |first| first - 1..(first + 3).min(forecast.late())) {
            let found = guard.confirm(&mut watch, &from, forecast, most);
            nearer += usize::from(found.is_some());
            assert!(found.is_none_or(|point| Some(point.edge) == first && point.edge <= most), "case {case}, {most}");
        }
        match exit {
            None => refused += 1,
            Some(point) => {
                assert_eq!(Some(point.edge), first, "case {case}");
                assert_eq!(point.x, motion.at(point.edge));
                let moves_away = forecast.rising * guard.value(&from.w) < 0.0;
                *(if moves_away { &mut turned } else { &mut straight }) += 1;
            }
        }
    }
    assert!(straight > 20_000 && turned > 5000 && refused > 10_000, "{straight} {turned} {refused}");
    assert!(nearer > 1000, "{nearer}");
}

/// Angles that move one way, because the speed keeps its sign at all edges but perhaps the last: one that is said to
/// stay inside does so at every edge, whether its state there is given or not.
#[test]
fn an_angle_that_moves_one_way_is_inside_where_its_ends_are() {
    let systems = SYSTEMS.map(|a| Linear::new(a, 2e-8, 1 << 16));
    let mut state = 3u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    // Said to stay, said nothing though it stays, left, and left behind itself.
    let (mut sure, mut unsure, mut left, mut behind) = (0, 0, 0, 0);
    for case in 0..25_000 {
        let system = &systems[usize::from(case % 10 != 0)];
        // One in four is so slow that it may turn within its first edge.
        let fast = if case % 4 == 0 { 1e-5 } else { 0.4 };
        let motion = Trajectory::new(
            system,
            [2.0 * next(), fast * next(), 0.5, 0.5 + 0.01 * next()],
            [2e4 * next(), 600.0 * next(), 0.0, 0.0],
        );
        let direction = motion.anchor()[1].signum();
        let keeps = |edge: u64| direction * motion.at(edge)[1] >= 0.0;
        let most = 1 + (3000.0 * (next() + 0.5)) as u64;
        let last = (1..=most).find(|&edge| !keeps(edge)).unwrap_or(most);
        let guard = Guard::new([0.0, 0.0, 1.0, 0.0], system);
        // Limits around the way, some of them within a millionth of it.
        let way = motion.at(last)[2] - 0.5;
        let size = way.abs().max(1e-12);
        let [before, after] = [0; 2].map(|_| size * 10f64.powf(-6.0 * (next() + 0.5)) * next().signum());
        let (mut low, mut high) = (0.5 + way.min(0.0) - before.abs(), 0.5 + way.max(0.0) + after);
        if direction * way < 0.0 {
            // It comes to lie behind its start.
            *(if way < 0.0 { &mut low } else { &mut high }) = 0.5 + way * 1.5 * (next() + 0.5);
            behind += 1;
        }
        if low >= 0.5 || high <= 0.5 {
            continue;
        }
        let limits = Limits::from(&Band { low, high, open: true });
        let noise = guard.noise(&motion, dyadic(last), &limits);
        let mut watch = Watch { motion: &motion, limits, noise, again: &mut 0 };
        let stays = (1..=last).all(|edge| guard.side(&mut watch, edge, motion.at(edge)[2]) == Side::Inside);
        let from = MotionPoint::of(&motion, 0);
        for given in [None, Some(motion.at(last))] {
            let said =
                guard.moves_inside::<Native>(&motion, &limits, noise, (&from, direction), (last, given.as_ref()));
            assert!(stays || !said, "case {case}: it leaves within {last} edges");
            sure += u32::from(said);
            unsure += u32::from(stays && !said);
            left += u32::from(!stays);
        }
    }
    assert!(sure > 4000 && unsure > 20 && left > 2000, "{sure} sure, {unsure} unsure, {left} left");
    assert!(behind > 100, "{behind} behind");
}

/// A speed that is 0 at the first two edges and below 0 between them: an angle that starts at its limit has passed it
/// by a twelfth at the first edge, and is far inside later. All numbers are small fractions.
#[test]
fn an_angle_that_starts_at_its_limit_may_pass_it_between_two_edges() {
    let system = Linear::new([[0.0; 4], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4]], 1.0, 1 << 8);
    let motion = Trajectory::new(&system, [-0.5, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]);
    assert!((0..=20).all(|edge| motion.at(edge)[1] >= 0.0));
    assert!((motion.at(1)[2] + 1.0 / 12.0).abs() < 1e-12 && motion.at(20)[2] > 1000.0);
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    let from = MotionPoint::of(&motion, 0);
    for (low, inside) in [(0.0, false), (-100.0, true)] {
        let limits = Limits::from(&Band { low, high: 1e9, open: true });
        let noise = guard.noise(&motion, dyadic(20), &limits);
        for state in [None, Some(motion.at(20))] {
            let said = guard.moves_inside::<Native>(&motion, &limits, noise, (&from, 1.0), (20, state.as_ref()));
            assert_eq!(said, inside, "from {low}");
        }
    }
}

/// Counts of an encoder, one after the other: each exit that is pursued is the first edge at which the value, looked at
/// edge by edge, lies outside of its count, whether the direction is known from the count before or found anew. The
/// motions turn, so that a direction must end in time. Half of the forecasts are made at random, as above.
#[test]
fn pursued_exits_are_those_edge_by_edge_count_after_count() {
    let systems = SYSTEMS.map(|a| Linear::new(a, 2e-8, 1 << 16));
    let mut state = 7u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    // Exits with a direction known from before, with one just found, after a turn, and forecasts that were refused.
    let (mut known, mut new, mut turned, mut refused) = (0, 0, 0, 0);
    for case in 0..20_000 {
        let system = &systems[usize::from(case % 10 != 0)];
        let x = [2.0 * next(), 0.4 * next(), 0.5, 0.5 + 0.01 * next()];
        let f = [2e4 * next(), 600.0 * next(), 0.0, 0.0];
        let motion = Trajectory::new(system, x, f);
        let row = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]][case % 3];
        let guard = Guard::new(row, system);
        let width = [0.1, 2.0, 1e-5][case % 3] * 10f64.powf(-3.0 * (next() + 0.5));
        let mut low = guard.value(&x) - (next() + 0.5) * width;
        let (mut from, mut steady, mut before) = (MotionPoint::of(&motion, 0), Steady::UNKNOWN, 0.0);
        for _ in 0..8 {
            let limits = Limits::from(&Band { low, high: low + width, open: true });
            let forecast = if case % 2 == 0 {
                guard.forecast(&motion, &limits, &from)
            } else {
                Forecast { edges: 2000.0 * (next() + 0.5), rising: next().signum() }
            };
            if !(0.0..=2000.0).contains(&forecast.edges) {
                break;
            }
            let far = from.edge + forecast.late();
            let noise = guard.noise(&motion, dyadic(far), &limits);
            let mut watch = Watch { motion: &motion, limits, noise, again: &mut 0 };
            let mut side = |edge| guard.side(&mut watch, edge, guard.value(&motion.at(edge)));
            if side(from.edge) != Side::Inside {
                break;
            }
            let first = (from.edge + 1..=far).find(|&edge| side(edge) != Side::Inside);
            let is_known = far <= steady.until && forecast.rising == before;
            let Some(point) = guard.pursue::<Native>(&mut watch, &from, forecast, &mut steady) else {
                refused += 1;
                continue;
            };
            assert_eq!(Some(point.edge), first, "case {case}");
            assert_eq!((point.x, point.w), motion.at_with_slope(point.edge));
            *(if is_known { &mut known } else { &mut new }) += 1;
            let rising = if guard.value(&point.x) < low { -1.0 } else { 1.0 };
            turned += u32::from(rising == -before);
            before = rising;
            low += before * width;
            from = point;
        }
    }
    assert!(known > 10_000 && new > 10_000 && turned > 100 && refused > 10_000, "{known} {new} {turned} {refused}");
}

/// A free body under a constant force turns when its speed is used up: its direction is known up to that edge, and no
/// further, or as far as is asked.
#[test]
fn a_direction_is_known_until_a_constant_force_turns_the_body() {
    let edge_s = 2e-8;
    let system = Linear::new([[0.0; 4], [0.0; 4], [0.0, 1.0, 0.0, 0.0], [0.0; 4]], edge_s, 1 << 16);
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    let limits = Limits::from(&Band { low: -1.0, high: 2.0, open: true });
    for rising in [1.0, -1.0] {
        for turn in [1.5, 2.5, 100.5, 1000.5, 30_000.5] {
            let speed = 0.25;
            let x = [0.0, rising * speed, 0.5, 0.5];
            let motion = Trajectory::new(&system, x, [0.0, -rising * speed / (turn * edge_s), 0.0, 0.0]);
            let from = MotionPoint::of(&motion, 0);
            for edges in [1.0, 10.0, 4000.0] {
                let forecast = Forecast { edges, rising };
                let noise = guard.noise(&motion, 16, &limits);
                let watch = Watch { motion: &motion, limits, noise, again: &mut 0 };
                let asked = Forecast { edges: STEADY as f64 * edges, rising }.late();
                let steady = guard.steady(&watch, &from, forecast);
                assert_eq!(steady.until, asked.min(turn as u64), "{rising} {turn} {edges}");
                // Against the motion nothing is known.
                let against = Forecast { edges, rising: -rising };
                assert_eq!(guard.steady(&watch, &from, against).until, 0, "{rising} {turn} {edges}");
            }
        }
    }
}

/// A body on a spring begins in the middle of its swing, where nothing bends its motion, and turns after a quarter of
/// the swing: its direction is known for some time, but not beyond the turn.
#[test]
fn a_direction_in_the_middle_of_a_swing_ends_before_the_turn() {
    let edge_s = 2e-8;
    // As many edges as the bounds of derivatives are made for.
    let edges = 1638.0;
    let most = Forecast { edges: STEADY as f64 * edges, rising: 1.0 }.late();
    assert_eq!((most, dyadic(most)), (16_382, 14));
    for quarters in [0.2, 0.5, 0.9, 1.1, 1.15, 1.2, 2.0, 7.0] {
        let turn = most as f64 / quarters;
        let radian_per_s = std::f64::consts::FRAC_PI_2 / (turn * edge_s);
        let stiffness = radian_per_s * radian_per_s;
        let spring = [0.0, 0.0, -stiffness, stiffness];
        let system = Linear::new([[0.0; 4], spring, [0.0, 1.0, 0.0, 0.0], [0.0; 4]], edge_s, 1 << 16);
        let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
        let limits = Limits::from(&Band { low: -1.0, high: 2.0, open: true });
        for rising in [1.0, -1.0] {
            let motion = Trajectory::new(&system, [0.0, 0.25 * rising, 0.5, 0.5], [0.0; 4]);
            let noise = guard.noise(&motion, 16, &limits);
            let watch = Watch { motion: &motion, limits, noise, again: &mut 0 };
            let steady = guard.steady(&watch, &MotionPoint::of(&motion, 0), Forecast { edges, rising });
            assert!((1..=turn as u64).contains(&steady.until), "{quarters}: {} of {turn}", steady.until);
        }
    }
}

/// Sums of four products that cancel, in exact integers: a state that rounding has moved across its limit, or whose
/// value errs across it, is not called surely inside.
#[test]
fn a_state_that_is_surely_inside_lies_inside_in_exact_integers() {
    let system = Linear::new([[0.0; 4]; 4], 2e-8, 1);
    let mut state = 1u64;
    let mut next = |bits: u32| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        i128::from(state as i64 >> (64 - bits))
    };
    let (mut sure, mut close) = (0, 0);
    for case in 0..20_000 {
        // Coefficients are `f64`; the states have three bits more than one.
        let row: [i128; 4] = std::array::from_fn(|_| next(53) | 1);
        let mut x: [i128; 4] = std::array::from_fn(|_| next(56));
        let others: i128 = (0..3).map(|k| row[k] * x[k]).sum();
        // The value lies within the last coefficient's size of zero, and farther away in every other case.
        x[3] = -others / row[3] + if case % 2 == 0 { 0 } else { next(16) };
        let value = others + row[3] * x[3];
        let guard = Guard::new(row.map(|r| r as f64), &system);
        let rounded = x.map(|x| x as f64);
        for (limits, is_inside) in [(Limits::POSITIVE, value >= 0), (Limits::NEGATIVE, value <= 0)] {
            let is_sure = guard.is_surely_inside(&rounded, &limits);
            assert!(is_inside || !is_sure, "case {case}: {value}");
            sure += u32::from(is_sure);
            close += u32::from(is_inside && !is_sure);
        }
    }
    assert!(sure > 5000 && close > 5000, "{sure} {close}");
}

/// Quartics, whose derivatives reach their bounds, toward a limit that they pass up to four times: only the first
/// passage is confirmed, wherever the forecast lies.
#[test]
fn of_several_passages_of_a_quartic_only_the_first_is_confirmed() {
    const CHAIN: Matrix = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]];
    let system = Linear::new(CHAIN, 1.0 / 128.0, 1 << 12);
    let guard = Guard::new([1.0, 0.0, 0.0, 0.0], &system);
    let mut state = 1u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let (mut confirmed, mut several) = (0, 0);
    for case in 0..40_000 {
        // The slope's roots, in seconds; the search is over 128 edges, one second.
        let [a, b, c] = std::array::from_fn(|_| 1.6 * next() + 0.5);
        let f = if case % 2 == 0 {
            [-a * b * c, a * b + b * c + c * a, -2.0 * (a + b + c), 6.0]
        } else {
            [a * b, -a - b, 2.0, 0.0]
        };
        let motion = Trajectory::new(&system, [0.0; 4], f);
        let values: Vec<f64> = (0..=128).map(|edge| guard.value(&motion.at(edge))).collect();
        // The limit lies just below an extreme, or anywhere.
        let extreme = (1..128).find(|&k| values[k] > values[k - 1].max(0.0) && values[k] >= values[k + 1]);
        let high = extreme.map_or(0.1 * (next() + 0.5), |k| values[k] * (1.0 - 0.5 * (next() + 0.5).powi(3)));
        let limits = Limits::from(&Band { low: f64::NEG_INFINITY, high, open: true });
        let passages: Vec<usize> = (1..=128).filter(|&k| values[k - 1] < high && values[k] >= high).collect();
        let (Some(&first), Some(&last)) = (passages.first(), passages.last()) else { continue };
        several += usize::from(first != last);
        let noise = guard.noise(&motion, dyadic(1 << 8), &limits);
        let mut watch = Watch { motion: &motion, limits, noise, again: &mut 0 };
        let forecast = Forecast { edges: last as f64 - 0.5, rising: 1.0 };
        if let Some(point) = guard.confirm(&mut watch, &MotionPoint::of(&motion, 0), forecast, forecast.late()) {
            assert_eq!(point.edge, first as u64, "case {case}");
            confirmed += 1;
        }
    }
    assert!(confirmed > 1000 && several > 1000, "{confirmed} {several}");
}

/// Sums of four states that cancel, each rounded to `f64` by up to a half of its last place: the side on which a value
/// lies is that of exact integers, though rounding has moved the value across its limit.
#[test]
fn a_value_lies_on_the_side_of_its_limit_that_exact_integers_say() {
    /// States are integers of 2^-40.
    const PLACES: u32 = 40;
    const ROW: [i128; 4] = [1, 1, -1, -1];
    let system = Linear::new([[0.0; 4]; 4], 2e-8, 1);
    let guard = Guard::new(ROW.map(|r| r as f64), &system);
    let mut state = 1u64;
    let mut below = |count: i128| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        i128::from(state >> 1) % count
    };
    let unit = 0.5f64.powi(PLACES as i32);
    let (mut moved, mut equal) = (0, 0);
    for case in 0..40_000 {
        // An `f64` just above 2^52 holds integers; two of their sums are rounded to even ones.
        let high: [i128; 4] = std::array::from_fn(|_| (1 << 52) + below(16));
        let rest: [i128; 4] = std::array::from_fn(|_| below(1 << PLACES) - (1 << (PLACES - 1)));
        let value: i128 = (0..4).map(|k| ROW[k] * ((high[k] << PLACES) + rest[k])).sum();
        let mut x = Doubles::ZERO;
        for k in 0..4 {
            x.set(k, Double { hi: high[k] as f64, lo: rest[k] as f64 * unit });
        }
        let motion = Trajectory::exact(&system, x, Doubles::ZERO);
        let rounded = guard.value(&motion.x.hi);
        let limit = if case % 2 == 0 { value + below(3) - 1 } else { value + below(8 << PLACES) - (4 << PLACES) };
        let at = Double::from(limit as f64 * unit);
        moved += u32::from((rounded < at.hi) != (value < limit));
        equal += u32::from(value == limit);
        for open in [false, true] {
            let low = (Limits { low: at, open, ..Limits::ANY }, value < limit, Side::Below);
            let high = (Limits { high: at, open, ..Limits::ANY }, value > limit || open && value == limit, Side::Above);
            for (limits, is_outside, outside) in [low, high] {
                let noise = guard.noise(&motion, 0, &limits);
                let mut watch = Watch { motion: &motion, limits, noise, again: &mut 0 };
                let expected = if is_outside { outside } else { Side::Inside };
                assert_eq!(guard.side(&mut watch, 0, rounded), expected, "case {case}: {value} at {limit}");
            }
        }
    }
    assert!(moved > 10_000 && equal > 5000, "{moved} {equal}");
}
