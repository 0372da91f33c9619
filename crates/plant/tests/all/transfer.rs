//! Plants as transfer functions: known answers, forms that agree, converters at their ties, refusals.

use hpu_plant::transfer::{Form, MOST_STATES, Transfer, TransferMotion};

const EDGE_S: f64 = 1e-6;

fn ratio(numerator: &[f64], denominator: &[f64]) -> Form {
    Form::Ratio { numerator: numerator.into(), denominator: denominator.into() }
}

fn is_near(left: f64, right: f64, within: f64) -> bool {
    (left - right).abs() <= within * right.abs().max(1e-300)
}

/// Returns the output after a step of height 1, this number of edges later.
fn stepped(form: &Form, edges: u64) -> f64 {
    let plant = Transfer::continuous(form, EDGE_S, edges).expect("a plant");
    let mut motion = TransferMotion::new(&plant, &[]);
    motion.drive(1, 1.0, 0.0);
    motion.at(edges)[0]
}

#[test]
fn twelve_equal_lags_answer_a_step_as_their_closed_form() {
    // 1/(s + 1)^12: 1 - e^-t times the first 12 terms of e^t.
    let form = Form::Roots { zeros: vec![], poles: vec![[-1.0, 0.0]; 12], gain: 1.0 };
    for edges in [1_000_000, 7_123_457, 40_000_000] {
        let t = edges as f64 * EDGE_S;
        // The remainder of the series, which loses no digits.
        let mut term = (1..=12).fold((-t).exp(), |term, k| term * t / f64::from(k));
        let mut rest = 0.0;
        for k in 13..400 {
            rest += term;
            term *= t / f64::from(k);
        }
        assert!(is_near(stepped(&form, edges), rest, 1e-13), "{t}: {} is not {rest}", stepped(&form, edges));
    }
}

#[test]
fn far_apart_poles_answer_a_step_as_partial_fractions() {
    // Product of p/(s + p) for p = 1, 1e2, 1e4: as coefficients, as roots, as a chain of matrices.
    let poles = [1.0, 1e2, 1e4];
    let answer = |t: f64| {
        let part = |p: f64| {
            let others = poles.iter().filter(|&&q| q != p).map(|q| q / (q - p)).product::<f64>();
            -others * (-p * t).exp()
        };
        1.0 + poles.iter().map(|&p| part(p)).sum::<f64>()
    };
    let forms = [
        ratio(&[1e6], &[1.0, 10_101.0, 1_010_100.0, 1e6]),
        Form::Roots { zeros: vec![], poles: poles.map(|p| [-p, 0.0]).into(), gain: 1e6 },
        Form::Matrices {
            a: vec![vec![-1.0, 0.0, 0.0], vec![1e2, -1e2, 0.0], vec![0.0, 1e4, -1e4]],
            b: vec![1.0, 0.0, 0.0],
            c: vec![0.0, 0.0, 1.0],
            d: 0.0,
        },
    ];
    for form in forms {
        for edges in [50, 12_345, 500_000] {
            let t = edges as f64 * EDGE_S;
            // The terms of the fractions are of size 1, and so are their roundings.
            assert!((stepped(&form, edges) - answer(t)).abs() < 1e-15, "{form:?} at {t}");
        }
    }
}

#[test]
fn a_pair_of_poles_rings_and_a_zero_reaches_the_output_at_once() {
    // (s^2 + 4) / (s^2 + 2 s + 5): the step starts at 1, is 0.8 + e^-t (0.2 cos 2t - 0.9 sin 2t).
    let form = Form::Roots { zeros: vec![[0.0, 2.0]], poles: vec![[-1.0, 2.0]], gain: 1.0 };
    let plant = Transfer::continuous(&form, EDGE_S, 1 << 22).expect("a plant");
    assert!(plant.is_immediate());
    assert_eq!(stepped(&form, 0), 1.0);
    for edges in [1, 123_456, 3_000_000] {
        let t = edges as f64 * EDGE_S;
        let answer = 0.8 + (-t).exp() * (0.2 * (2.0 * t).cos() - 0.9 * (2.0 * t).sin());
        assert!(is_near(stepped(&form, edges), answer, 1e-14), "{t}");
    }
}

#[test]
fn brake_passes_its_bound_after_the_window_of_its_competition() {
    // ARCH-COMP's Brake (JuliaReach/ARCH2024_AFF_RE), with a controller in real numbers. Answers to 40 digits were
    // computed apart.
    let (l, kp, ki, r, k, drot, i) = (1e-3, 1e4, 1e3, 0.5, 0.02, 0.1, 113.1167);
    let form = Form::Matrices {
        a: vec![vec![-(r + k * k / drot) / l, 0.0], vec![k / i / drot, 0.0]],
        b: vec![1.0 / l, 0.0],
        c: vec![0.0, 1.0],
        d: 0.0,
    };
    let (sample, edge_s) = (1000u64, 1e-7);
    let plant = Transfer::continuous(&form, edge_s, sample).expect("a plant");
    let mut motion = TransferMotion::new(&plant, &[]);
    let (mut sum, mut greatest, mut above) = (0.0, [0.0f64; 2], None);
    for count in 1..=5000u64 {
        let before = motion;
        motion.leap(sample);
        let x = motion.at(0)[0];
        if x >= 0.05 && above.is_none() {
            above = Some(count);
            // The instant, between two edges, by the secant.
            let edge = (0..sample).find(|&edge| before.at(edge + 1)[0] >= 0.05).expect("within this sample");
            let [low, high] = [edge, edge + 1].map(|edge| before.at(edge)[0]);
            let at = ((count - 1) * sample + edge) as f64 + (0.05 - low) / (high - low);
            assert!(is_near(at * edge_s, 0.157_212_612_491_51, 1e-12), "{at}");
        }
        for edge in (0..sample).filter(|_| (3141..=3143).contains(&count)) {
            let x = before.at(edge)[0];
            if x > greatest[1] {
                greatest = [((count - 1) * sample + edge) as f64 * edge_s, x];
            }
        }
        match count {
            1000 => assert!(is_near(x, 0.048_904_787_821_8, 1e-12), "{x}"),
            1001 => assert!(is_near(x, 0.048_909_468_403_997, 1e-13), "{x}"),
            5000 => assert!(is_near(x, 0.050_136_697_647_767, 1e-13), "{x}"),
            _ => {}
        }
        sum += 1e-4 * (0.05 - x);
        motion.drive(0, 1.0, kp * (0.05 - x) + ki * sum);
    }
    assert_eq!(above, Some(1573));
    assert!(is_near(greatest[1], 0.050_138_900_574_27, 1e-13) && (greatest[0] - 0.314_195_407).abs() < 2e-7);
}

#[test]
fn a_discrete_plant_steps_exactly() {
    // x(k+1) = 2 x(k) - x(k-1) + u in whole numbers, and its output y = x1 + 3 x2.
    let plant = Transfer::discrete(&ratio(&[3.0, 1.0], &[1.0, -2.0, 1.0])).expect("a plant");
    let mut motion = TransferMotion::new(&plant, &[5.0, -7.0]);
    let (mut x, mut word) = ([5i128, -7], 1i64);
    for _ in 0..1000 {
        motion.drive(word, 1.0, 0.0);
        motion.step();
        x = [x[1], -x[0] + 2 * x[1] + i128::from(word)];
        assert_eq!(motion.at(0)[0] as i128, x[0] + 3 * x[1]);
        word = (word * 7 + 3) % 1000;
    }
}

#[test]
fn a_converter_decides_at_its_ties() {
    let plant = Transfer::discrete(&ratio(&[1.0], &[1.0, 0.0])).expect("a plant");
    for lsb in [1.0, 3.0, 0.1, 1.0 / 7.0] {
        for word in -50..=50i64 {
            let steps = [(-0.5, 0, -1), (0.0, 0, 0), (0.5, 1, 0)];
            for (halves, nearest, floor) in steps {
                // A half step is exact as twice the word and one in halves of a step.
                let mut motion = TransferMotion::new(&plant, &[]);
                motion.drive(2 * word + (2.0 * halves) as i64, 0.5 * lsb, 0.0);
                motion.step();
                assert_eq!(motion.converted(lsb, 0.0, false), word + nearest, "{word} {halves} of {lsb}");
                assert_eq!(motion.converted(lsb, 0.0, true), word + floor, "{word} {halves} of {lsb}");
                // A little less falls below the tie.
                motion.drive(2 * word + (2.0 * halves) as i64, 0.5 * lsb, -1e-20 * lsb);
                motion.step();
                let below = if halves == 0.5 { word } else { word + nearest - i64::from(halves == -0.5) };
                assert_eq!(motion.converted(lsb, 0.0, false), below, "below {word} {halves} of {lsb}");
            }
        }
    }
}

#[test]
fn what_is_no_plant_is_refused_with_what_is_accepted() {
    let pole = |count: usize| Form::Roots { zeros: vec![], poles: vec![[-1.0, 0.0]; count], gain: 1.0 };
    let matrices = |a: Vec<Vec<f64>>, b: Vec<f64>| Form::Matrices { a, c: b.clone(), b, d: 0.0 };
    let refusals = [
        (ratio(&[1.0, 0.0, 0.0], &[1.0, 1.0]), "improper"),
        (ratio(&[0.0, 0.0], &[1.0, 1.0]), "all 0"),
        (ratio(&[1.0], &[0.0, 1.0]), "leave zeros in front out"),
        (ratio(&[1.0], &[2.0]), "no states"),
        (pole(MOST_STATES + 1), "at most 12"),
        (Form::Roots { zeros: vec![[0.0, 1.0]], poles: vec![[-1.0, 0.0]], gain: 1.0 }, "improper"),
        (Form::Roots { zeros: vec![], poles: vec![[-1.0, -1.0]], gain: 1.0 }, "above 0"),
        (matrices(vec![vec![1.0, 2.0]], vec![1.0]), "write 1"),
        (matrices(vec![vec![1.0]], vec![1.0, 2.0]), "beside 1 states"),
        (matrices(vec![vec![1.0]], vec![0.0]), "does not reach"),
        (ratio(&[1.0], &[1.0, 1e12]), "sample faster"),
    ];
    for (form, said) in refusals {
        let refused = Transfer::continuous(&form, EDGE_S, 1_000_000).err().expect("no plant").to_string();
        assert!(refused.contains(said), "{refused}");
    }
    assert!(Transfer::continuous(&pole(MOST_STATES), EDGE_S, 1000).is_ok());
}
