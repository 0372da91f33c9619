//! The 42 loops of DSVerifier's closed-loop set, as words run them: 14 controllers and plants, each in three formats.
//!
//! The numbers are those of ssvlab/dsverifier, benchmarks/jss2018/CBMC/LIMIT_CYCLE_CLOSED_LOOP at 1daca470, DFI without
//! uncertainty. DSVerifier looks at ten samples of the loop with rounded coefficients, in real numbers, and finds no
//! limit cycle in any. Here all signals are words: errors and outputs of the format's bits, which saturate.

use hpu_cosim::scene::{Experiment, TransferScene};
use hpu_cosim::{Control, Driver, Simulation, TransferSimulation, Verdict, Wired};
use hpu_plant::transfer::Form;
use hpu_prove::SampledLoop;
use hpu_prove::certify::growth::grows;
use hpu_prove::confined::stays_within;
use hpu_prove::escaping::leaves;
use hpu_prove::recurring::words_recur;

/// A loop: coefficients of controller and plant, numerator and denominator, in descending powers.
struct Loop {
    sample_s: f64,
    controller: (&'static [f64], &'static [f64]),
    plant: (&'static [f64], &'static [f64]),
}

const LOOPS: [Loop; 14] = [
    Loop {
        sample_s: 0.2,
        controller: (&[0.0039062, 0.00097656], &[0.31348, -0.00097656]),
        plant: (&[0.0, 0.00097541], &[1.0, -0.9512]),
    },
    Loop {
        sample_s: 2.0,
        controller: (&[0.0, -0.34668, 0.015625], &[0.5, 0.19922, 0.0]),
        plant: (&[0.0, 0.1898, 0.00018027], &[1.0, -0.9012, -1.0006e-16]),
    },
    Loop {
        sample_s: 0.01,
        controller: (
            &[0.0, 0.0, 0.0, 0.0, 0.0, 0.5, -0.96875, -0.875, -0.5],
            &[0.0011902, 0.00085449, 0.00015259, 0.00033569, 0.0, 0.0, 0.0, 0.0, 0.0],
        ),
        plant: (
            &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0001929, 6.814e-09],
            &[1.0, -0.6921, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ),
    },
    Loop {
        sample_s: 0.01,
        controller: (&[-0.58054, 0.91977, 0.11871, -0.95193], &[0.71887, -0.38751, -0.41592, 0.43729]),
        plant: (&[0.0, -0.01285, 0.02582, -0.01293], &[1.0, -2.99, 2.983, -0.9929]),
    },
    Loop {
        sample_s: 2.0,
        controller: (&[0.0, -0.00097656, 0.0, 0.0], &[0.76172, 0.0, 0.0, 0.0]),
        plant: (&[0.0, 15.1315, 17.86, 17.4549], &[1.0, -2.6207, 2.3586, -0.657]),
    },
    Loop {
        sample_s: 2.0,
        controller: (&[0.0, -0.96484, 0.9834], &[0.88965, -0.875, 0.0]),
        plant: (&[0.0, 0.2039, 0.2039], &[1.0, 1.2, 1.0]),
    },
    Loop {
        sample_s: 0.001,
        controller: (&[0.0, 0.83594, 0.26562, -0.96875], &[0.94531, 0.90625, -0.15625, -0.12305]),
        plant: (&[0.0, 0.125, 0.125], &[1.0, -2.0, 1.0]),
    },
    Loop {
        sample_s: 0.001,
        controller: (&[-4.6566e-10, 1.0, -1.0], &[1.0, -4.6566e-10, 4.6566e-10]),
        plant: (&[0.0, 5e-05, 5e-05], &[1.0, -2.0, 1.0]),
    },
    Loop {
        sample_s: 2.0,
        controller: (&[0.0, -0.022461, 0.0, 0.0, 0.0], &[0.13867, 0.0, 0.0, 0.0, 0.0]),
        plant: (&[0.0, 0.25, 0.5, 0.25, -4.3341e-07], &[1.0, 5.915e-06, 1.048e-11, -4.9349e-63, 7.0168e-225]),
    },
    Loop {
        sample_s: 2.0,
        controller: (&[0.0, 0.0625], &[0.51758, -0.49902]),
        plant: (&[0.02, -3.8303e-176], &[1.0, -4.6764e-166]),
    },
    Loop {
        sample_s: 0.01,
        controller: (&[11.9255, -11.8089], &[1.0, -1.0729]),
        plant: (&[0.0, 0.01, -0.010101], &[1.0, -2.0103, 1.0101]),
    },
    Loop {
        sample_s: 0.5,
        controller: (&[-2.7056, 4.9189, -2.9898, 0.60746], &[1.0, -0.24695, -0.80001, 0.35681]),
        plant: (&[0.0, 0.33528, -0.55879], &[1.0, -1.8906, 0.7788]),
    },
    Loop {
        sample_s: 0.5,
        controller: (
            &[-4.4366, 9.177, -3.6362, -5.1444, 5.9167, -2.2791, 0.31329],
            &[1.0, -0.23339, -1.5195, 0.73999, 0.51029, -0.41403, 0.073294],
        ),
        plant: (&[0.0, 0.54869, -0.88674], &[1.0, -3.3248, 1.6487]),
    },
    Loop {
        sample_s: 0.03,
        controller: (
            &[-45456.4327, 37928.1361, 25543.7663, -38701.0881, 16110.0087, -2847.8579, 182.2326, 0.38487],
            &[1.0, 0.47737, -1.4922, -0.6236, 0.64615, 0.10413, -0.12437, 0.018243],
        ),
        plant: (&[0.0, -0.0001492, -0.00051649, -7.2373e-05], &[1.0, -7.8381, 2.9258, -0.25393]),
    },
];

/// Bits of a format, and the fraction bits of each loop in it.
const FORMATS: [(u32, [u32; 14]); 3] = [
    (8, [2, 7, 4, 5, 4, 6, 1, 6, 6, 6, 4, 1, 4, 4]),
    (16, [8, 8, 3, 8, 7, 8, 8, 8, 8, 8, 8, 8, 8, 8]),
    (32, [16, 16, 16, 16, 16, 16, 16, 16, 16, 16, 7, 16, 3, 10]),
];

/// The input of the plant beside the controller's: the greatest that DSVerifier allows.
const INPUT: f64 = 1.0;

fn scene(of: &Loop, bits: u32, fraction: u32) -> Result<TransferScene, String> {
    let (sample_s, full) = (of.sample_s, 2f64.powi((bits - 1 - fraction).cast_signed()));
    // A plant that follows its input at once takes a controller whose first coefficient is 0, without it, late.
    let late = usize::from(of.plant.0[0] != 0.0);
    assert!(late == 0 || of.controller.0[0] == 0.0);
    let text = format!(
        "about = 'A loop.'\nclock.frequency = '1 MHz'\nrun.duration = {}\nrecord.plant_rate = {}\n\
         [device]\nkind = 'transfer'\nnumerator = {:?}\ndenominator = {:?}\nsample_time = {sample_s}\n\
         disturbance = {INPUT}\n[adc]\nbits = {bits}\nrange = {full}\nrate = {}\n[dac]\nbits = {bits}\n\
         full_scale = {full}\nlate = {late}\n[method]\nnumerator = {:?}\ndenominator = {:?}\n\
         coefficient_bits = {bits}\ncoefficient_fraction = {fraction}\n",
        4000.0 * sample_s,
        1.0 / sample_s,
        of.plant.0,
        of.plant.1,
        1.0 / sample_s,
        &of.controller.0[late..],
        of.controller.1,
    );
    match Experiment::parse("loop.toml", &text, &[], &mut |_| unreachable!("no file")) {
        Ok(Experiment::Transfer(scene)) => Ok(scene),
        Ok(_) => panic!("another device"),
        Err(error) => Err(error.to_string()),
    }
}

/// Calls a function with each loop: its bits, its number, its fraction bits, itself.
fn each(mut visit: impl FnMut(u32, usize, u32, &Loop)) {
    for (bits, fractions) in &FORMATS {
        for (index, (of, fraction)) in LOOPS.iter().zip(fractions).enumerate() {
            visit(*bits, index + 1, *fraction, of);
        }
    }
}

fn rounded(values: &[f64], fraction: u32) -> Vec<i128> {
    values.iter().map(|value| (value * 2f64.powi(fraction.cast_signed())).round() as i128).collect()
}

#[test]
fn words_are_those_of_plain_arithmetic() {
    let mut compared = 0;
    each(|bits, number, fraction, of| {
        let Ok(scene) = scene(of, bits, fraction) else { return };
        let simulation = TransferSimulation::new(&scene).expect("a simulation");
        let mut samples = simulation.samples();
        let [b, a] = [of.controller.0, of.controller.1].map(|values| rounded(values, fraction));
        let (lsb, half) = (2f64.powi(-fraction.cast_signed()), 1i128 << (bits - 1));
        // The newest first. `u` is the plant's input, `e` the error in words, `v` the controller's output.
        let order = b.len().max(of.plant.0.len());
        let (mut u, mut y, mut e, mut v) = (vec![0.0; order], vec![0.0; order], vec![0i128; order], vec![0i128; order]);
        for sample in 0..60 {
            // The plant's output of this sample: its input may reach it at once.
            let late = of.plant.0[0] != 0.0;
            let past = |all: &[f64], of: &[f64]| of[1..].iter().zip(all).map(|(c, x)| c * x).sum::<f64>();
            let mut output = past(&u, of.plant.0) - past(&y, of.plant.1);
            let products = |all: &[i128], of: &[i128]| of.iter().zip(all).map(|(c, x)| c * x).sum::<i128>();
            let control = |e: &[i128], v: &[i128]| {
                let (mut sum, mut by) = (products(e, &b) - products(v, &a[1..]), a[0]);
                if by < 0 {
                    (sum, by) = (-sum, -by);
                }
                (2 * sum + by).div_euclid(2 * by).clamp(-half, half - 1)
            };
            if late {
                // The first coefficient is 0, so the controller does not read this sample.
                let mut now = e.clone();
                now.rotate_right(1);
                let word = control(&now, &v);
                u.rotate_right(1);
                u[0] = word as f64 * lsb + INPUT;
                output += of.plant.0[0] * u[0];
                v.rotate_right(1);
                v[0] = word;
            }
            y.rotate_right(1);
            y[0] = output;
            if !samples.go_on() || output.abs() > 1e6 {
                break;
            }
            let reading = ((output / lsb + 0.5).floor().clamp(-1e30, 1e30) as i128).clamp(-half, half - 1);
            assert_eq!(i128::from(samples.words()[0]), reading, "{bits} bits, loop {number}, sample {sample}");
            e.rotate_right(1);
            e[0] = -reading;
            if !late {
                let word = control(&e, &v);
                u.rotate_right(1);
                u[0] = word as f64 * lsb + INPUT;
                v.rotate_right(1);
                v[0] = word;
                assert_eq!(i128::from(samples.words()[1]), word, "{bits} bits, loop {number}, sample {sample}");
            }
            compared += 1;
        }
    });
    assert!(compared > 1500, "{compared}");
}

/// Returns the growth from one sample to the next of a loop with rounded coefficients, in real numbers.
fn growth(of: &Loop, fraction: u32) -> f64 {
    let real = |values: &[f64]| rounded(values, fraction).iter().map(|&word| word as f64).collect::<Vec<_>>();
    let product = |x: &[f64], y: &[f64]| {
        let mut all = vec![0.0; x.len() + y.len() - 1];
        for (i, x) in x.iter().enumerate() {
            y.iter().enumerate().for_each(|(j, y)| all[i + j] += x * y);
        }
        all
    };
    let (b, a) = (real(of.controller.0), real(of.controller.1));
    let sum = product(&a, of.plant.1).iter().zip(product(&b, of.plant.0)).map(|(x, y)| x + y).collect::<Vec<_>>();
    let order = sum.len() - 1;
    let row = |row: usize| (0..order).map(|at| if at + 1 == row { 1.0 } else { 0.0 }).collect::<Vec<_>>();
    let first = sum[1..].iter().map(|x| -x / sum[0]).collect();
    SampledLoop::of([first].into_iter().chain((1..order).map(row)).collect()).spectral_radius()
}

#[test]
fn the_verdict_of_every_loop() {
    let (mut stable, mut table) = (0, Vec::new());
    each(|bits, number, fraction, of| {
        let scene = match scene(of, bits, fraction) {
            Ok(scene) => scene,
            Err(why) => {
                let kind = if why.contains("rounds to 0") { "no controller" } else { "does not fit" };
                return table.push(format!("{bits:2} {number:2} {kind}"));
            }
        };
        let growth = growth(of, fraction);
        stable += u32::from(growth < 1.0 - 1e-9);
        let simulation = TransferSimulation::new(&scene).expect("a simulation");
        let mut trace = simulation.trace(&[]);
        let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        let lsb = scene.adc.range.lsb();
        let said = match summary.verdict.expect("a verdict") {
            Verdict::Settled { .. } => "settled".to_string(),
            Verdict::LimitCycle { amplitude_rad, frequency_hz, .. } => {
                let samples = 1.0 / frequency_hz / of.sample_s;
                format!("limit cycle {:.4e} in {samples:.1}", amplitude_rad / lsb)
            }
            Verdict::Diverged { .. } => "grows".to_string(),
            Verdict::NotTold { amplitude_rad, .. } => format!("not told {:.4e}", amplitude_rad / lsb),
            other => panic!("{other:?}"),
        };
        let last = (120_000.0 * of.sample_s * 1e6) as u64;
        let proof = match words_recur(&scene, last) {
            Ok(cycle) => {
                assert!(cycle.margin > 0.0);
                let half = 0.5 * (cycle.outputs[1] - cycle.outputs[0]);
                format!("for ever {} samples {half:.4}", cycle.samples)
            }
            Err(_) => match (leaves(&scene, last).expect("a plant"), stays_within(&scene, last)) {
                (Some((_, by)), _) => format!("grows for ever by {by:.4}"),
                (None, Ok(found)) => format!("within {:.1} for ever", found.off_counts),
                (None, Err(_)) => "not proved".to_string(),
            },
        };
        table.push(format!("{bits:2} {number:2} {growth:.4} {said}; {proof}"));
    });
    // Known from computations apart.
    assert_eq!(stable, 23, "{table:#?}");
    let table = table.join("\n") + "\n";
    print!("{table}");
    assert_eq!(table, include_str!("dsverifier.txt"));
}

/// The plants that leave are told by a checker of its own, which runs the loop in exact numbers: at that sample and at
/// later ones, and not with more growth, a sample before, or of plants that their words can hold.
#[test]
fn a_checker_apart_tells_the_plants_that_leave() {
    let (mut told, mut left) = (0, 0);
    each(|bits, number, fraction, of| {
        let Ok(scene) = scene(of, bits, fraction) else { return };
        let period = scene.adc.period;
        let known = leaves(&scene, 200 * period).expect("a plant");
        let why = |edge: u64, growth: f64| grows(&scene, edge, growth).err().map(|error| error.to_string());
        let Some((edge, growth)) = known else {
            left += 1;
            return assert!(why(1 + 150 * period, 1.0).is_some(), "{bits} bits, loop {number}");
        };
        told += 1;
        println!("{bits} bits, loop {number}: {} samples, {growth}", edge / period);
        assert_eq!(why(edge, growth), None, "{bits} bits, loop {number}");
        assert_eq!(why(edge + 3 * period, growth), None, "{bits} bits, loop {number}");
        for (edge, growth) in [(edge - period, growth), (edge, growth * (1.0 + 1e-9)), (edge + 1, growth), (0, growth)]
        {
            assert!(why(edge, growth).is_some(), "{bits} bits, loop {number}: {edge}, {growth}");
        }
        // Of another scene: the words reach farther, the plant decays, or it begins elsewhere.
        let mut other = scene.clone();
        other.dac.full *= 1000.0;
        assert!(grows(&other, edge, growth).is_err(), "{bits} bits, loop {number}");
        let mut other = scene.clone();
        let Form::Ratio { denominator, .. } = &mut other.form else { panic!("a ratio") };
        denominator[1..].iter_mut().for_each(|cell| *cell *= 0.1);
        assert!(grows(&other, edge, growth).is_err(), "{bits} bits, loop {number}");
        let mut other = scene.clone();
        other.initial = vec![1.0];
        assert!(grows(&other, edge, growth).is_err(), "{bits} bits, loop {number}");
    });
    assert!(told == 6 && left > 20, "{told} leave, {left} do not");
}
