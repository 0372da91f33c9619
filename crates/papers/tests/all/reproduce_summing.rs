//! The summing-up of reproductions: every claim with a finding, computed from the results of its lines.

use hpu_cosim::Control;
use hpu_cosim::scene::Platform;
use hpu_farm::Row;
use hpu_papers::phantom::{RUNGS, Rung, Study, Tables, Trial, TrialSetup, Verdict, ladder, table_text};
use hpu_papers::studies::comparison::{Comparison, Found, Line, beside_text, sums};
use hpu_papers::studies::summing::{Finding, Sum, summing_up};
use hpu_papers::studies::{read, shipped};
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::studies::load;

fn comparisons() -> [Comparison; 5] {
    ["hybrid-loop", "input-shaper", "power-scaling", "three-dof", "phantom-lag"].map(shipped)
}

/// Returns the findings if the lines have these figures.
fn findings(comparison: &Comparison, figures: impl Fn(&Line) -> Vec<f64>) -> Vec<(&'static str, Finding)> {
    let results: Vec<_> = comparison.lines.iter().map(|line| Ok(Found::new("so much".into(), figures(line)))).collect();
    sums(comparison, &results).iter().map(|sum| (sum.statement.letter, sum.finding)).collect()
}

fn of(findings: &[(&str, Finding)], letter: &str) -> Finding {
    findings.iter().find(|(other, _)| *other == letter).expect(letter).1
}

#[test]
fn cases_that_differ_in_what_a_paper_leaves_open_have_to_agree() {
    assert_eq!(Finding::of_cases(&[true, true]), Finding::Confirmed);
    assert_eq!(Finding::of_cases(&[false]), Finding::NotConfirmed);
    assert_eq!(Finding::of_cases(&[true, false]), Finding::CannotBeTold);
    assert_eq!(Finding::of_cases(&[]), Finding::CannotBeTold);
    assert_eq!(
        [Some(true), Some(false), None].map(|met| Finding::of(met).name()),
        ["confirmed", "not confirmed", "cannot be told"]
    );
}

#[test]
fn a_journal_keeps_text_and_figures_to_the_last_bit() {
    let found = Found::new("a; b".into(), [0.1 + 0.2, f64::INFINITY, -0.0]);
    assert_eq!(Row::of(&found).read(), Ok(found));
    assert_eq!(Row::of(&Found::from("settles".to_string())).to_string(), r#"{"found":";settles"}"#);
    for bad in ["settles", "x;settles"] {
        assert!(Row::of(&BTreeMap::from([("found", bad)])).read::<Found>().is_err(), "{bad}");
    }
}

#[test]
fn every_claim_has_lines_and_words_and_every_line_that_judges_a_claim_has_one() {
    for comparison in comparisons() {
        let letters: Vec<_> = comparison.claims.iter().map(|claim| claim.statement.letter).collect();
        assert!(!letters.is_empty() && letters.is_sorted_by(|one, next| one < next), "{letters:?}");
        for claim in &comparison.claims {
            let statement = claim.statement;
            assert!(comparison.lines.iter().any(|line| line.claims.contains(statement.letter)), "{statement:?}");
            assert!(statement.paper.len() > 20 && !statement.place.is_empty() && !statement.means.is_empty());
        }
        for letter in comparison.lines.iter().flat_map(|line| line.claims.chars()) {
            assert!(letters.contains(&letter.to_string().as_str()), "{}: {letter}", comparison.name);
        }
        // Every published figure is judged, except the paper's own words and figures that were derived from it.
        let published = |line: &&Line| !line.published.is_empty() && !line.published.contains("derived");
        for line in comparison.lines.iter().filter(published) {
            let number =
                ["265 mN.m in 2^12 counts", "0.9687 \"N s/m\"", "36.36e-3 \"N s/m\""].contains(&line.published);
            assert!(number != (!line.claims.is_empty() || line.published == "less at higher rates"), "{}", line.what);
        }
    }
    assert!(shipped("criteria").claims.is_empty(), "no paper's");
}

#[test]
fn findings_follow_the_figures() {
    use Finding::{CannotBeTold, Confirmed, NotConfirmed};
    let hybrid = shipped("hybrid-loop");
    let times = |times: f64| findings(&hybrid, |line| if line.claims == "ab" { vec![times] } else { vec![0.0; 4] });
    let told = [4.5, 5.5, 1.5].map(|ratio| ["a", "b"].map(|letter| of(&times(ratio), letter)));
    assert_eq!(told, [[Confirmed; 2], [Confirmed, NotConfirmed], [NotConfirmed; 2]]);
    let least = |at_10_khz: f64| {
        let of_rate = |line: &Line| match line.what.rsplit(", ").next().expect("a rate") {
            "100 Hz" => f64::INFINITY,
            "10 kHz" => at_10_khz,
            _ => 2.0,
        };
        findings(&hybrid, |line| vec![of_rate(line); 4])
    };
    assert_eq!([1.0, 3.0].map(|last| of(&least(last), "c")), [Confirmed, NotConfirmed]);

    let shaper = shipped("input-shaper");
    let ladder = |line: &Line| if line.claims == "cd" { vec![60.0, 65.0, 130.0] } else { vec![25.0, 30.0, 92.0] };
    let press = |line: &Line| {
        let c1: f64 = line.what.split("c1 = ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse().unwrap();
        let settles = c1 < if line.what.starts_with("no shaper") { 15.0 } else { 25.0 };
        vec![f64::from(u8::from(settles)), c1]
    };
    let as_told = findings(&shaper, |line| if line.claims.len() > 2 { press(line) } else { ladder(line) });
    // Mass and damping of the device are inferred from the first two claims, so these claims confirm nothing.
    let expected = [[CannotBeTold; 2].as_slice(), &[Confirmed; 7]].concat();
    assert_eq!(as_told.iter().map(|(_, finding)| *finding).collect::<Vec<_>>(), expected);
    let greatest = |line: &Line| line.group.contains("greatest");
    let by_form = findings(&shaper, |line| match line.claims.len() {
        5 if greatest(line) => vec![0.0, 20.0],
        5 => press(line),
        _ => vec![30.0, 35.0, 81.0],
    });
    let expected = ["c", "d", "g"].map(|letter| of(&by_form, letter));
    assert_eq!(expected, [NotConfirmed, NotConfirmed, CannotBeTold]);

    let scaling = shipped("power-scaling");
    let settles = findings(&scaling, |line| vec![f64::from(u8::from(line.claims != "a")), 0.01]);
    assert!(settles.iter().all(|(_, finding)| *finding == Confirmed), "{settles:?}");
    let runs_away = findings(&scaling, |line| vec![if line.claims == "e" { 8e-6 } else { 0.0 }, 341.0]);
    let expected = ["a", "b", "c", "d", "e"].map(|letter| of(&runs_away, letter));
    assert_eq!(expected, [Confirmed, NotConfirmed, NotConfirmed, NotConfirmed, NotConfirmed]);

    // The lag is fitted to this claim.
    let fitted = findings(&shipped("phantom-lag"), |_| Vec::new());
    assert_eq!(of(&fitted, "a"), CannotBeTold);
}

#[test]
fn a_text_ends_with_the_summing_up_and_what_was_not_measured_is_not_told() {
    let scaling = shipped("power-scaling");
    let mut results: Vec<_> = scaling.lines.iter().map(|_| Ok(Found::new("settles".into(), [1.0, 0.01]))).collect();
    results[0] = Err("out of memory".into());
    let text = beside_text(&scaling, &results);
    let (_, summed) = text.split_once("Summing up: ").expect("a summing-up");
    assert_eq!(summed.matches("confirmed").count(), scaling.claims.len() - 1, "{summed}");
    assert!(summed.contains("(a)   cannot be told") && summed.contains("not measured: out of memory"), "{summed}");
    assert!(summed.contains("(b)   confirmed       \"even if the force scaling factor"), "{summed}");
    assert!(!beside_text(&shipped("criteria"), &[]).contains("Summing up"));
    assert_eq!(summing_up(&[]), "");
}

#[test]
fn the_rows_of_figure_4_say_that_they_are_ramps_of_equal_impulse() {
    let scaling = shipped("power-scaling");
    let printed: Vec<_> = scaling.lines.iter().filter(|line| line.group.starts_with("Fig. 4 as printed")).collect();
    assert_eq!(printed.len(), 4);
    for line in printed {
        // 2 ln(1000) / 999 of 1 s, and of 5 s.
        let ramp = if line.what.contains("5 s") { "69.1 ms" } else { "13.8 ms" };
        assert!(line.what.contains(&format!("run as a straight ramp of {ramp} of equal impulse")), "{}", line.what);
    }
}

/// Returns a table of one seed in which PMOS-1 and RTOS-1 hold 750 N/m, and the other platforms the limit of `others`.
fn tables(others: impl Fn(Platform) -> f64) -> Tables {
    let study = Study { seeds: 1, ..Study::whole(&[Rung::SHIPPED]) };
    let trial = |point: &TrialSetup| {
        let limit = match point.platform {
            Platform::Pmos1 | Platform::Rtos(1) => 750.0,
            platform => others(platform),
        };
        let rms_m = 29e-6 * point.stiffness_n_per_m / limit;
        let passive = point.stiffness_n_per_m <= limit;
        let verdict = if passive { Verdict::Passive { rms_m } } else { Verdict::NonPassive { rms_m } };
        Ok(Trial { verdict, edges: 1, why: String::new() })
    };
    Tables::new(&study, 0, &study.points().iter().map(trial).enumerate().collect())
}

fn told(platform: Platform) -> f64 {
    if matches!(platform, Platform::Fpga(100 | 400)) { 5000.0 } else { 1500.0 }
}

#[test]
fn the_drop_test_sums_up_each_claim_in_the_paper_s_words() {
    let text = table_text(&tables(told));
    let (_, summed) = text.split_once("Summing up: ").expect("a summing-up");
    for claim in tables(told).claims() {
        let Sum { statement, finding, .. } = claim.sum();
        let head = format!(
            "{:<6}{:<16}\"{}\" ({})",
            format!("({})", statement.letter),
            finding.name(),
            statement.paper,
            statement.place
        );
        assert!(summed.contains(&head), "{head}\n{summed}");
    }
    let finding = |tables: &Tables, letter: &str| {
        tables.claims().iter().find(|claim| claim.first().name == letter).expect(letter).finding()
    };
    for letter in ["a", "b", "c1", "c2", "d1", "d2", "e", "f", "f2", "h"] {
        assert_eq!(finding(&tables(told), letter), Finding::Confirmed, "{letter}");
    }
    let slow = tables(|platform| if matches!(platform, Platform::Rtos(_)) { 3000.0 } else { 1500.0 });
    for letter in ["c2", "d1", "d2", "h"] {
        assert_eq!(finding(&slow, letter), Finding::NotConfirmed, "{letter}");
    }
    let open = tables(|_| 40e3);
    assert_eq!(finding(&open, "h"), Finding::CannotBeTold, "all rows are passive");
}

#[test]
fn the_ladder_sums_up_by_model() {
    let models: [fn(Platform) -> f64; 2] = [told, |_| 750.0];
    let rungs = models.into_iter().zip(RUNGS).map(|(others, rung)| ladder::Summary::new(rung, tables(others)));
    let text = ladder::ladder_text(&rungs.collect::<Vec<_>>());
    let (_, summed) = text.split_once("Summing up: ").expect("a summing-up");
    let (_, doubled) = summed.split_once("(c1)").expect("the claim");
    let mut lines = doubled.lines().skip(1);
    assert_eq!(lines.next(), Some("      confirmed       ideal"));
    assert_eq!(lines.next(), Some("      not confirmed   + quantisation"));
}

#[test]
fn one_lag_and_another_transmission_fit_pmos_1_and_a_longer_lag_does_not() {
    // Along y, with the joint under test alone. A transmission adds a lag of its own.
    let narrow = |stiffness: &str, lags: &str| {
        let text = format!(
            r#"
            name = "own"
            title = "Own"
            [[group]]
            name = "g"
            [[group.line]]
            what = "w"
            text = "{{lags.narrow}}"
            [group.line.measure.lags]
            measure = "fitting"
            scene = "phantom-drop"
            set = ['platform.kind=PMOS-1', 'model.joints=tested', 'model.transmission_stiffness={stiffness}']
            key = "model.amplifier_lag"
            values = {lags}
            unit = "ms"
            axes = "y"
            walls = [750, 1000, 1250]
            trials = 3
            "#
        );
        let study = read("own.toml", text.as_bytes(), &[], Arc::new(load)).unwrap_or_else(|errors| panic!("{errors}"));
        (study.comparison.lines[0].measure)(&Control::default()).expect("not stopped").expect("measured").text
    };
    assert_eq!(narrow("3.5 kN/m", "[0.35, 0.6]"), "0.35");
    assert_eq!(narrow("0", "[0.2, 0.4]"), "0.20", "with a rigid transmission it is a shorter lag that fits");
    assert_eq!(narrow("0", "[0.4]"), "none");
}
