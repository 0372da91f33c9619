//! The checker of growth: a discrete plant leaves for ever, whatever words drive it.
//!
//! It shares no code with the proof but intervals and the scene's reader. Plant, converters and controller are run once
//! more, in numbers without any rounding, in coordinates of their own. With the denominator `z^n + a_1 z^(n-1) + ..`,
//! `w(k) = u(k) - a_1 w(k-1) - .. - a_n w(k-n)` and `y(k) = b_0 w(k) + .. + b_n w(k-n)`. For a root `λ` of the
//! denominator, the sum `s(k) = l_1 w(k-1) + .. + l_n w(k-n)` with `l_1 = 1` and `l_(j+1) = λ l_j + a_j` moves by
//! `s(k+1) = λ s(k) + u(k)`. So once `|s| (|λ| - 1)` exceeds any input, `s` grows for ever.

mod dyadic;

use std::cmp::Ordering;

use hpu_cosim::scene::TransferScene;
use hpu_plant::transfer::Form;

use crate::Error;
use crate::interval::{Complex, Interval};
use dyadic::Dyadic;

/// The most samples that are run, and the most digits of a number.
const MOST_SAMPLES: u64 = 100_000;
const MOST_DIGITS: usize = 100_000;
/// Steps in which roots are sought.
const STEPS: usize = 500;

/// Checks that a scene's plant leaves for ever from the sample at a clock edge on, and grows by a factor by itself.
///
/// # Errors
///
/// Returns what of that does not hold, or why it is not checked.
pub fn grows(scene: &TransferScene, from_edge: u64, growth: f64) -> Result<(), Error> {
    let Form::Ratio { numerator, denominator } = &scene.form else {
        return Err("its plant has no numerator and denominator".into());
    };
    let order = denominator.len() - 1;
    let known = scene.discrete && denominator[0] == 1.0 && scene.initial.iter().all(|state| *state == 0.0);
    if !known || order == 0 || numerator.len() > order + 1 {
        return Err("its plant is continuous, or begins elsewhere than at 0".into());
    }
    let sample = from_edge.checked_sub(1).filter(|edges| edges.is_multiple_of(scene.adc.period));
    let sample = sample.map(|edges| edges / scene.adc.period).filter(|sample| *sample < MOST_SAMPLES);
    let past = run(scene, numerator, denominator, sample.ok_or("no sample that is run is at that edge")?)?;
    let input = |word: i64| {
        let input = Interval::exact(word as f64).times(Interval::exact(scene.dac.lsb()));
        input.plus(Interval::exact(scene.disturbance)).size()
    };
    let most = scene.dac.ends().map(input).into_iter().fold(0.0, f64::max);
    let is_told = |root: &[f64; 2]| {
        let Some(root) = enclosed(denominator, *root) else { return false };
        let (mut row, mut sum) = (Complex { re: Interval::exact(1.0), im: Interval::ZERO }, Complex::ZERO);
        for (past, coefficient) in past.iter().zip(&denominator[1..]) {
            sum = sum.plus(row.scaled(past.interval()));
            row = row.times(root).plus(real(*coefficient));
        }
        let more = Interval::exact(least(root)).minus(Interval::exact(1.0));
        let is_beyond = Interval::exact(least(sum)).times(more).lo > most;
        // The claim is as exact as both bounds of the root.
        more.lo > 0.0 && is_beyond && growth * (1.0 - 1e-12) <= least(root)
    };
    if roots(denominator).iter().any(is_told) { Ok(()) } else { Err("its plant may be held, or grows less".into()) }
}

fn real(value: f64) -> Complex {
    Complex { re: Interval::exact(value), im: Interval::ZERO }
}

/// Returns a bound below the size of a complex number.
fn least(of: Complex) -> f64 {
    let part = |part: Interval| if part.lo <= 0.0 && part.hi >= 0.0 { 0.0 } else { part.lo.abs().min(part.hi.abs()) };
    let [re, im] = [of.re, of.im].map(part);
    let square = (re * re).next_down().max(0.0) + (im * im).next_down().max(0.0);
    square.next_down().max(0.0).sqrt().next_down().max(0.0)
}

/// Runs the loop up to a sample, and returns `w` of the samples before it, the newest first.
fn run(scene: &TransferScene, numerator: &[f64], denominator: &[f64], last: u64) -> Result<Vec<Dyadic>, Error> {
    let words = scene.words()?;
    let (adc, [least, most]) = (&scene.adc, scene.adc.range.ends());
    let dyadic = |all: &[f64]| all.iter().map(|value| Dyadic::of(*value)).collect::<Vec<_>>();
    let mut tops = vec![Dyadic::zero(); denominator.len() - numerator.len()];
    tops.extend(dyadic(numerator));
    let bottoms = dyadic(&denominator[1..]);
    let dot = |row: &[Dyadic], x: &[Dyadic]| {
        row.iter().zip(x).fold(Dyadic::zero(), |sum, (cell, x)| sum.plus(&cell.times(x)))
    };
    let (step, half) = (Dyadic::of(adc.range.lsb()), Dyadic::of(if adc.floors { 0.0 } else { -0.5 }));
    let input =
        |word: i64| Dyadic::whole(word).times(&Dyadic::of(scene.dac.lsb())).plus(&Dyadic::of(scene.disturbance));
    let mut past = vec![Dyadic::zero(); bottoms.len()];
    let (mut errors, mut outputs) = (vec![0i128; words.numerator.len()], vec![0i128; words.denominator.len() - 1]);
    let (mut command, mut driving) = (0i64, 0i64);
    let bits = scene.dac.bits + u32::from(!scene.dac.signed) + scene.method.fraction - 1;
    let rounded = |sum: i128, by: i128| {
        if scene.method.floors { sum.div_euclid(by) } else { (2 * sum + by).div_euclid(2 * by) }
    };
    for sample in 0..last {
        if scene.late > 0 {
            driving = command;
        }
        // Of a plant that follows its input at once, the word is late.
        let now = |driving: i64, past: &[Dyadic]| input(driving).plus(&dot(&bottoms, past).negative());
        let read = dot(&tops[1..], &past).plus(&tops[0].times(&now(driving, &past)));
        let off = read.plus(&Dyadic::of(adc.offset).negative());
        let is_reached = |word: i64| {
            let end = Dyadic::whole(word).plus(&half).times(&step);
            off.plus(&end.negative()).sign() != Ordering::Less
        };
        // The greatest word that is reached, by halving.
        let (mut low, mut high) = (least, most + 1);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if is_reached(middle) { low = middle } else { high = middle }
        }
        let edge = 1 + sample * adc.period;
        let wanted = if edge >= scene.clock.edges(scene.reference[1]) { words.reference } else { 0 };
        errors.rotate_right(1);
        errors[0] = i128::from(wanted - low);
        let products = |row: &[i64], x: &[i128]| row.iter().zip(x).map(|(a, x)| i128::from(*a) * x).sum::<i128>();
        let sum = products(&words.numerator, &errors) - products(&words.denominator[1..], &outputs);
        let first = i128::from(words.denominator[0]);
        let output = rounded(sum * first.signum(), first.abs()).clamp(-(1 << bits), (1 << bits) - 1);
        outputs.insert(0, output);
        outputs.pop();
        let [least, most] = scene.dac.ends();
        command = rounded(output, 1 << scene.method.fraction).clamp(least.into(), most.into()) as i64;
        if scene.late == 0 {
            driving = command;
        }
        let newest = now(driving, &past);
        if newest.length() > MOST_DIGITS {
            return Err("its numbers become too long".into());
        }
        past.insert(0, newest);
        past.pop();
    }
    Ok(past)
}

/// Returns about the roots of a polynomial whose first coefficient is 1.
fn roots(polynomial: &[f64]) -> Vec<[f64; 2]> {
    let times = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a * c - b * d, a * d + b * c];
    let over = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
        let square = c * c + d * d;
        [(a * c + b * d) / square, (b * c - a * d) / square]
    };
    let order = polynomial.len() - 1;
    let mut all: Vec<[f64; 2]> = (0..order)
        .scan([1.0, 0.0], |at, _| {
            *at = times(*at, [0.4, 0.9]);
            Some(*at)
        })
        .collect();
    for _ in 0..STEPS {
        for at in 0..order {
            let value = polynomial.iter().fold([0.0, 0.0], |sum, cell| {
                let [re, im] = times(sum, all[at]);
                [re + cell, im]
            });
            let others = (0..order).filter(|other| *other != at).fold([1.0, 0.0], |product, other| {
                times(product, [all[at][0] - all[other][0], all[at][1] - all[other][1]])
            });
            let [re, im] = over(value, others);
            // Two that meet stay where they are.
            if re.is_finite() && im.is_finite() {
                all[at] = [all[at][0] - re, all[at][1] - im];
            }
        }
    }
    all
}

/// Returns a square around a number in which a root of a polynomial certainly lies, by Krawczyk's method.
fn enclosed(polynomial: &[f64], [re, im]: [f64; 2]) -> Option<Complex> {
    let value = |at: Complex| polynomial.iter().fold(Complex::ZERO, |sum, cell| sum.times(at).plus(real(*cell)));
    let order = polynomial.len() - 1;
    let slope = |at: Complex| {
        let cells = polynomial[..order].iter().enumerate();
        cells.fold(Complex::ZERO, |sum, (place, cell)| {
            let power = Interval::exact((order - place) as f64).times(Interval::exact(*cell));
            sum.times(at).plus(Complex { re: power, im: Interval::ZERO })
        })
    };
    let middle = Complex { re: Interval::exact(re), im: Interval::exact(im) };
    let [a, b] = [slope(middle).re.middle(), slope(middle).im.middle()];
    let by = |part: f64| Interval::exact(part / (a * a + b * b));
    let inverse = Complex { re: by(a), im: by(-b) };
    let negative = |of: Complex| of.scaled(Interval::exact(-1.0));
    let step = inverse.times(value(middle));
    let width = 8.0 * step.re.size().max(step.im.size()) + 1e-15 * (re.abs() + im.abs());
    let around = Interval { lo: -width, hi: width };
    let wide = middle.plus(Complex { re: around, im: around });
    let left = real(1.0).plus(negative(inverse.times(slope(wide))));
    let after = negative(step).plus(left.times(Complex { re: around, im: around }));
    (after.re.is_inside(around) && after.im.is_inside(around)).then_some(wide)
}

#[cfg(test)]
mod tests {
    use hpu_cosim::scene::Experiment;

    use super::*;

    const PERIOD: u64 = 2_000_000;

    fn scene(change: &[(&str, &str)]) -> TransferScene {
        let text = "about = 'A plant that leaves.'\nclock.frequency = '1 MHz'\nrun.duration = 100\n[device]\n\
                    kind = 'transfer'\nnumerator = [0, 15.1315, 17.86, 17.4549]\n\
                    denominator = [1, -2.6207, 2.3586, -0.657]\nsample_time = 2\ndisturbance = 1\n[adc]\nbits = 8\n\
                    range = 8\nrate = 0.5\n[dac]\nbits = 8\nfull_scale = 8\n[method]\n\
                    numerator = [0, -0.25, 0, 0]\ndenominator = [0.75, 0.5, 0, 0]\ncoefficient_bits = 8\n\
                    coefficient_fraction = 4\n";
        let text = change.iter().fold(text.to_string(), |text, (old, new)| {
            assert!(text.contains(old), "{old}");
            text.replace(old, new)
        });
        match Experiment::parse("t.toml", &text, &[], &mut |_| unreachable!("no file")) {
            Ok(Experiment::Transfer(scene)) => scene,
            other => panic!("{other:?}"),
        }
    }

    /// Returns the first sample from which on growth is told.
    fn first(scene: &TransferScene) -> Option<u64> {
        (0..60).find(|sample| grows(scene, 1 + sample * PERIOD, 1.1).is_ok())
    }

    /// The loop in floats, whose denominator has one real root and a pair: the mode is that of the pair.
    #[test]
    fn growth_is_told_from_the_sample_at_which_no_input_holds_it() {
        for change in [
            &[][..],
            &[("bits = 8\nfull", "bits = 6\nfull")],
            &[("range = 8", "range = 2"), ("[0, -0.25, 0, 0]", "[0.5, 1.25, -1, 0.5]")],
            // Readings of few words, and outputs that come to their greatest word.
            &[("bits = 8\nrange = 8", "bits = 4\nrange = 8"), ("[0, -0.25, 0, 0]", "[0.4, -0.4, 0.3, 0]")],
            &[("[0, -0.25, 0, 0]", "[7, -7, 6, 0]")],
            &[
                ("disturbance = 1", "disturbance = -0.3"),
                ("coefficient_fraction", "rounding = 'floor'\ncoefficient_fraction"),
            ],
        ] {
            let scene = scene(change);
            let words = scene.words().expect("words");
            let (step, dac) = (scene.adc.range.lsb(), scene.dac.lsb());
            let (mut w, mut e, mut v, mut u) = ([0.0; 3], [0i64; 4], [0i64; 3], 0.0);
            let [a, b, c] = [-2.6207, 2.3586, -0.657];
            // The real root by Newton's method, and the pair that is left.
            let one = (0..50).fold(0.5, |z: f64, _| z - (((z + a) * z + b) * z + c) / ((3.0 * z + 2.0 * a) * z + b));
            let square = b + one * (a + one);
            let (re, root) = (-0.5 * (a + one), square.sqrt());
            let im = (square - re * re).sqrt();
            let most = scene.dac.full.abs() + scene.disturbance.abs();
            let mut told = None;
            for sample in 0..60u64 {
                if sample > 0 {
                    w = [u - a * w[0] - b * w[1] - c * w[2], w[0], w[1]];
                }
                let third = [(re + a) * re - im * im + b, (re + a) * im + im * re];
                let mode = [w[0] + (re + a) * w[1] + third[0] * w[2], im * w[1] + third[1] * w[2]];
                if libm::hypot(mode[0], mode[1]) * (root - 1.0) > most && told.is_none() {
                    told = Some(sample);
                }
                let y = 15.1315 * w[0] + 17.86 * w[1] + 17.4549 * w[2];
                let [least, greatest] = scene.adc.range.ends();
                let reading = ((y / step + 0.5).floor().clamp(-1e9, 1e9) as i64).clamp(least, greatest);
                e = [-reading, e[0], e[1], e[2]];
                let dot = |row: &[i64], x: &[i64]| row.iter().zip(x).map(|(a, x)| a * x).sum::<i64>();
                let (sum, by) = (dot(&words.numerator, &e) - dot(&words.denominator[1..], &v), words.denominator[0]);
                let word = if scene.method.floors { sum.div_euclid(by) } else { (2 * sum + by).div_euclid(2 * by) };
                let [least, greatest] = scene.dac.ends();
                v = [word.clamp(least, greatest), v[0], v[1]];
                u = v[0] as f64 * dac + scene.disturbance;
            }
            assert!(told.is_some(), "{change:?}");
            assert_eq!(first(&scene), told, "{change:?}");
            let edge = 1 + told.expect("a sample") * PERIOD;
            assert!(
                grows(&scene, edge, root * (1.0 - 1e-11)).is_ok() && grows(&scene, edge, root * (1.0 + 1e-11)).is_err()
            );
        }
    }

    #[test]
    fn roots_are_enclosed_or_nothing_is_told() {
        // (z - 2)(z² + 1)(z - 0.5): each of the four.
        let polynomial = [1.0, -2.5, 2.0, -2.5, 1.0];
        let found: Vec<Complex> = roots(&polynomial).iter().filter_map(|root| enclosed(&polynomial, *root)).collect();
        for [re, im] in [[2.0, 0.0], [0.5, 0.0], [0.0, 1.0], [0.0, -1.0]] {
            let holds = |of: &&Complex| of.re.lo <= re && re <= of.re.hi && of.im.lo <= im && im <= of.im.hi;
            assert_eq!(found.iter().filter(holds).count(), 1, "{re} {im}: {found:?}");
        }
        assert!(found.iter().all(|of| of.re.width() < 1e-12 && of.im.width() < 1e-12), "{found:?}");
        // Far from any root, and at a double one.
        assert!(enclosed(&polynomial, [3.0, 0.1]).is_none() && enclosed(&[1.0, -4.0, 4.0], [2.0, 0.0]).is_none());
    }

    #[test]
    fn plants_that_are_not_run_are_refused() {
        let leaves = scene(&[]);
        let edge = 1 + first(&leaves).expect("it leaves") * PERIOD;
        let why = |scene: &TransferScene, edge: u64| grows(scene, edge, 1.1).expect_err("refused").to_string();
        for edge in [0, edge + 1, 1 + MOST_SAMPLES * PERIOD] {
            assert!(why(&leaves, edge).contains("no sample"), "{edge}");
        }
        let mut begins = leaves.clone();
        begins.initial = vec![0.0, 1.0];
        assert!(why(&begins, edge).contains("elsewhere"));
        let mut scaled = leaves.clone();
        scaled.form = Form::Ratio { numerator: vec![1.0], denominator: vec![2.0, -4.0] };
        assert!(why(&scaled, edge).contains("elsewhere"));
        // An integrator is not told to grow, nor what its words can hold.
        let mut stays = leaves.clone();
        stays.form = Form::Ratio { numerator: vec![1.0], denominator: vec![1.0, -1.0] };
        assert!((0..60).all(|sample| grows(&stays, 1 + sample * PERIOD, 0.5).is_err()));
        let mut held = leaves;
        held.dac.full = 1e9;
        assert!(grows(&held, edge, 1.1).is_err());
    }
}
