//! Seeds of the drop test: which cells are run at all of them, from made-up outcomes with known boundaries; how limits,
//! claims and tables report cells whose seeds differ; and the PHANToM's own seeds.

use hpu_chart as chart;
use hpu_cosim::Control;
use hpu_cosim::scene::{Direction, Platform};
use hpu_papers::Error;
use hpu_papers::phantom::{
    Agreement, Class, FIRST_SEED, Outcomes, Rung, Share, Study, Tables, Trial, TrialSetup, Verdict, csv, ladder,
    run_trial, scene, table_text,
};
use hpu_papers::studies::summing::Finding;

use crate::looks::assert_readable;

/// Returns a study of one column with so many rows, of 1 N/m, 2 N/m and so on, with one trial for each cell.
fn column(rows: usize) -> Study {
    Study {
        axes: vec![Direction::Y],
        platforms: vec![Platform::Fpga(400)],
        stiffnesses_n_per_m: (1..=rows).map(|row| row as f64).collect(),
        trials: 1,
        ..Study::whole(&[Rung::SHIPPED])
    }
}

fn of(class: Class) -> Result<Trial, Error> {
    let verdict = match class {
        Class::Passive => Verdict::Passive { rms_m: 1e-6 },
        Class::NonPassive => Verdict::NonPassive { rms_m: 1e-4 },
        Class::HighlyUnstable => Verdict::HighlyUnstable { at_s: 0.5 },
        Class::Failed => return Err("no such trial".into()),
    };
    Ok(Trial { verdict, edges: 1, why: String::new() })
}

/// Returns trials that are passive up to a limit that depends on the seed, non-passive up to 8 N/m, and aborted beyond.
fn up_to(limit: impl Fn(u64) -> f64) -> impl Fn(&TrialSetup) -> Result<Trial, Error> {
    move |point| {
        of(match point.stiffness_n_per_m {
            row if row <= limit(point.seed) => Class::Passive,
            row if row <= 8.0 => Class::NonPassive,
            _ => Class::HighlyUnstable,
        })
    }
}

/// Runs the wanted trials, so many at a time, until none is wanted.
fn run(study: &Study, at_a_time: usize, made: impl Fn(&TrialSetup) -> Result<Trial, Error>) -> Outcomes {
    let points = study.points();
    let mut outcomes = Outcomes::new();
    loop {
        let wanted = study.wanted(&outcomes);
        if wanted.is_empty() {
            return outcomes;
        }
        // They are run backwards, because no order is promised.
        outcomes.extend(wanted.iter().rev().take(at_a_time).map(|place| (*place, made(&points[*place]))));
    }
}

/// Returns the rows of a column that were run at every seed; all other rows were run at the first seed only.
fn repeated(study: &Study, outcomes: &Outcomes) -> Vec<u64> {
    let points = study.points();
    let rows = study.stiffnesses_n_per_m.iter().filter(|row| {
        let own = outcomes.keys().map(|place| points[*place]).filter(|point| point.stiffness_n_per_m == **row);
        let seeds: Vec<u64> = own.map(|point| point.seed).collect();
        assert!(seeds == [study.first_seed] || seeds == study.all_seeds().collect::<Vec<_>>(), "{row}: {seeds:?}");
        seeds.len() > 1
    });
    rows.map(|row| *row as u64).collect()
}

#[test]
fn the_first_seed_is_that_of_the_shipped_scene() {
    let scene = scene().parse(&[]).expect("sound").phantom().expect("a PHANToM");
    assert_eq!(scene.run.seed, FIRST_SEED);
}

#[test]
fn where_seeds_agree_one_row_on_either_side_of_a_boundary_is_run_at_all() {
    let study = column(12);
    let outcomes = run(&study, usize::MAX, up_to(|_| 4.0));
    // Passive up to 4, non-passive up to 8, aborted up to 12.
    assert_eq!(repeated(&study, &outcomes), [4, 5, 8, 9]);
    assert_eq!(outcomes.len(), 8 + 4 * 12);
}

#[test]
fn rows_that_seeds_disagree_on_are_followed_to_where_they_agree() {
    let study = column(8);
    // Passive up to 6 at the first seed, to 2 at the ninth, to 7 at the twelfth; to 5, 4 or 3 at the others.
    let limit = |seed: u64| [6.0, 5.0, 5.0, 5.0, 4.0, 4.0, 4.0, 3.0, 2.0, 3.0, 5.0, 7.0][seed as usize - 1];
    let outcomes = run(&study, usize::MAX, up_to(limit));
    // From the least limit to the row after the greatest. Row 8 is the last row, and it is not aborted.
    assert_eq!(repeated(&study, &outcomes), [2, 3, 4, 5, 6, 7, 8]);
    let tables = Tables::new(&study, 0, &outcomes);
    let shares: Vec<usize> = (1..=8)
        .map(|row| {
            let tally = tables.cell(Direction::Y, Platform::Fpga(400), f64::from(row)).expect("a cell");
            tally.share(Class::Passive).so
        })
        .collect();
    // Row 1 is known at the first seed only. The other rows count the seeds whose limit is not below them.
    assert_eq!(shares, [1, 12, 11, 9, 6, 2, 1, 0]);
}

#[test]
fn an_end_of_the_rows_is_near_a_boundary_unless_its_class_is_the_one_beyond() {
    let near = |class| repeated(&column(5), &run(&column(5), usize::MAX, |_| of(class)));
    assert_eq!(near(Class::Passive), [5], "how much stiffer than the last row is open");
    assert_eq!(near(Class::HighlyUnstable), [1]);
    assert_eq!(near(Class::NonPassive), [1, 5]);
    assert_eq!(near(Class::Failed), [0; 0], "what cannot be run is run no more often");
}

#[test]
fn outcomes_do_not_depend_on_order_or_interruptions() {
    let study = Study { trials: 3, ..column(12) };
    // Rows and seeds with outcomes in no order at all.
    let made = |point: &TrialSetup| {
        let mixed = (point.stiffness_n_per_m as u64 * 7 + point.seed * 5 + point.trial * 3) % 11;
        of(if mixed < 9 { Class::Passive } else { Class::NonPassive })
    };
    let whole = run(&study, usize::MAX, made);
    for at_a_time in [1, 2, 7, 50] {
        assert_eq!(run(&study, at_a_time, made), whole, "{at_a_time}");
    }
}

#[test]
fn a_limit_is_an_interval_from_every_seed_to_some_seed() {
    let study = column(8);
    let span = |limit: &dyn Fn(u64) -> f64| {
        let outcomes = run(&study, usize::MAX, up_to(limit));
        let tables = Tables::new(&study, 0, &outcomes);
        tables.limit(Direction::Y, Platform::Fpga(400)).expect("a limit")
    };
    let seventh = |other: f64| move |seed: u64| if seed == 7 { other } else { 4.0 };
    let of = |limit: &dyn Fn(u64) -> f64| {
        let span = span(limit);
        (span.every_n_per_m, span.beyond_n_per_m, span.some_n_per_m, span.to_string())
    };
    assert_eq!(of(&|_| 4.0), (Some(4.0), Some(5.0), Some(4.0), "4".into()));
    assert_eq!(of(&seventh(6.0)), (Some(4.0), Some(5.0), Some(6.0), "4..6".into()));
    assert_eq!(of(&seventh(2.0)), (Some(2.0), Some(3.0), Some(4.0), "2..4".into()));
    assert_eq!(of(&seventh(0.0)), (None, Some(1.0), Some(4.0), "none..4".into()));
    assert_eq!(of(&seventh(8.0)), (Some(4.0), Some(5.0), Some(8.0), "4..>=8".into()));
    assert_eq!(of(&|_| 8.0), (Some(8.0), None, Some(8.0), ">=8".into()));
    assert_eq!(of(&|_| 0.0), (None, Some(1.0), None, "none".into()));
}

#[test]
fn a_finding_over_seeds_is_so_at_all_at_none_or_in_so_many() {
    let [yes, no, open] = [Some(true), Some(false), None];
    assert_eq!(Finding::of_seeds(&[yes, yes]), Finding::Confirmed);
    assert_eq!(Finding::of_seeds(&[no, no]), Finding::NotConfirmed);
    assert_eq!(Finding::of_seeds(&[no, yes, no]), Finding::MetInSome { met: 1, seeds: 3 });
    assert_eq!(Finding::of_seeds(&[yes, open]), Finding::MetInSome { met: 1, seeds: 2 });
    assert_eq!([&[no, open][..], &[open], &[]].map(Finding::of_seeds), [Finding::CannotBeTold; 3]);
    assert_eq!(Finding::MetInSome { met: 3, seeds: 12 }.name(), "met in 3 of 12");
}

/// Returns a study of PMOS-1 and RTOS-1 along y: passive up to 750 N/m, except RTOS-1 at seeds 3 and 5: up to 250 N/m.
fn some() -> (Study, Outcomes) {
    let study = Study {
        axes: vec![Direction::Y],
        platforms: vec![Platform::Pmos1, Platform::Rtos(1)],
        stiffnesses_n_per_m: vec![50.0, 100.0, 250.0, 500.0, 750.0, 1000.0, 1250.0, 30e3, 40e3],
        ..Study::whole(&[Rung::SHIPPED])
    };
    let outcomes = run(&study, usize::MAX, |point| {
        let limit = if point.platform == Platform::Rtos(1) && [3, 5].contains(&point.seed) { 250.0 } else { 750.0 };
        of(match point.stiffness_n_per_m {
            row if row <= limit => Class::Passive,
            row if row <= 1e3 => Class::NonPassive,
            _ => Class::HighlyUnstable,
        })
    });
    (study, outcomes)
}

#[test]
fn a_claim_is_met_in_as_many_seeds_as_tables_meet_it() {
    let (study, outcomes) = some();
    let tables = Tables::new(&study, 0, &outcomes);
    let claims = tables.claims();
    let claim = |name: &str| claims.iter().find(|claim| claim.first().name == name).expect(name);
    assert_eq!(claim("a").finding(), Finding::Confirmed);
    assert_eq!(claim("b").finding(), Finding::MetInSome { met: 10, seeds: 12 });
    assert_eq!(
        claim("b").found(),
        "y 750 and 750, at seed 1; met at seeds 1, 2, 4, 6, 7, 8, 9, 10, 11, 12: one draw cannot tell"
    );
    // PMOS-1 was run at every seed at 750, 1000 and 1250 N/m; at other stiffnesses its first seed counts.
    assert_eq!(claim("a").found(), "y 750");
    // 250, 500 and 750 N/m and the two stiffest rows are legible for both platforms.
    let printed = |row| Agreement::at(&tables, Direction::Y, Platform::Rtos(1), row);
    assert_eq!(Agreement::of(&tables), Agreement { legible: 10, same: 8, mixed: 2 });
    assert_eq!([250.0, 500.0, 750.0].map(|row| printed(row).expect("legible").so), [12, 10, 10]);
    assert_eq!(printed(40e3), Some(Share { so: 1, of: 1 }));
    let text = table_text(&tables);
    for said in [
        "      500  |   x=  10~",
        "y RTOS-1      750 N/m  passive in 10 of 12 seeds, non-passive in 2",
        "8 of 10 legible cells are as printed, 2 at some seeds, 0 are not",
        "PMOS-1      y            750 (1.0)\nRTOS-1      y       250..750 (0.3..1.0)",
        "(b)   met in 10 of 12 \"when comparing",
        // Rows 750 to 1250 of PMOS-1, and 250 to 1250 of RTOS-1.
        "Seeds: 8 of 18 cells are near a boundary and run at 12 seeds, from 1; the others at seed 1 alone",
    ] {
        assert!(text.contains(said), "{said}\n{text}");
    }
    assert!(csv(&study, &outcomes).contains("\nshipped,y,RTOS-1,500,3,1,non_passive,1e-4,,1,\n"));
}

#[test]
fn ladder_and_pictures_tell_in_how_many_seeds() {
    let (study, outcomes) = some();
    let tables = Tables::new(&study, 0, &outcomes);
    let summary = ladder::Summary::new(Rung::SHIPPED, tables.clone());
    let [all, in_some, told] = summary.met();
    assert_eq!((all, in_some, told), (1, 1, 2), "(a), (b)");
    let rungs = [summary];
    let text = ladder::ladder_text(&rungs);
    let line = text.lines().nth(1).expect("a rung");
    assert!(line.contains("8+2 of 10") && line.contains("1+1/2") && line.contains(" 10/12 "), "{line}");
    assert!(text.contains("      met in 10 of 12 shipped\n"), "{text}");
    assert!(ladder::ladder_csv(&rungs).contains("shipped,10,8,2,b,12,10,2,"));
    for (picture, said) in [
        (chart::table_2(&tables, "hpu"), ["10/12", "12 seeds near boundaries, one elsewhere;"]),
        (chart::ladder(&rungs, "hpu"), ["10/12", "12 seeds near boundaries, one elsewhere;"]),
        (chart::rms(&tables, "hpu"), ["one draw, seed 1:", "rms in cm"]),
    ] {
        assert_readable(&picture, "seeds");
        for said in said {
            assert!(picture.svg.contains(said), "{}: {said}", picture.name);
        }
    }
}

#[test]
fn a_study_of_one_seed_says_that_it_is_one_draw() {
    let (study, _) = some();
    let study = Study { seeds: 1, first_seed: 5, ..study };
    let outcomes = run(&study, usize::MAX, |_| of(Class::Failed));
    let tables = Tables::new(&study, 0, &outcomes);
    let text = table_text(&tables);
    assert!(text.contains("Every cell is one draw, of seed 5") && text.contains("could not be run: no such trial"));
    assert_eq!(tables.failures(), ["no such trial"], "each reason once");
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn at_the_boundary_of_the_drop_test_seeds_differ() {
    let study = Study::whole(&[Rung::SHIPPED]);
    let fails = |axis, platform, stiffness_n_per_m| {
        let passive = |seed| {
            (1..=study.trials).all(|trial| {
                let point = TrialSetup { rung: 0, axis, platform, stiffness_n_per_m, seed, trial };
                let made = run_trial(&study.overrides(&point), &Control::default()).expect("it can be run");
                matches!(made.expect("nobody stops it").verdict, Verdict::Passive { .. })
            })
        };
        study.all_seeds().filter(|seed| !passive(*seed)).count()
    };
    // Counted by an independent simulation of the whole arm.
    assert_eq!(fails(Direction::Y, Platform::Rtos(20), 7.5e3), 6);
    assert_eq!(fails(Direction::Y, Platform::Fpga(100), 10e3), 4);
    assert_eq!(fails(Direction::Y, Platform::Fpga(400), 10e3), 5);
    assert_eq!(fails(Direction::Z, Platform::Fpga(20), 10e3), 11);
}
