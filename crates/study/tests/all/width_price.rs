//! Compares tables of sines with Yosys's results, and a delayed loop with the theory of a late spring.

use hpu_cosim::Control;
use hpu_cosim::scene::{OutcomeKind, Scene, shipped};
use hpu_datapath::phantom::{Config, Turn};
use hpu_signal::Format;
use hpu_study::tables::{table_rams, tables};
use hpu_study::widths::settling::settling;

/// Returns the number of HX8K block RAMs that Yosys counted for a block and variant.
fn recorded(block: &str, variant: &str) -> u64 {
    let record = include_str!("../../../../testbench/record/phantom-cost.csv");
    let begin = format!("{block},{variant},");
    let row = record.lines().find(|line| line.starts_with(&begin)).unwrap_or_else(|| panic!("no {begin}"));
    row.split(',').nth(9).expect("the column hx8k_bram").parse().expect("a count")
}

#[test]
fn block_rams_are_those_that_yosys_counted() {
    let joint = Turn { num: 1, den: 28_000 };
    let format = |int, frac| Format::new(true, int, frac).unwrap();
    assert_eq!(table_rams(16, 13, joint, format(9, 22)), Ok(recorded("trig_table", "default")));
    let turns = Config::default().turns;
    let loops = |depth, format| turns.map(|turn| table_rams(16, depth, turn, format).unwrap()).iter().sum::<u64>();
    assert_eq!(loops(13, format(9, 22)), recorded("phantom_loop", "default"));
    for frac in [14, 18, 22] {
        assert_eq!(loops(9, format(1, frac)), recorded("phantom_shared_loop", &format!("fraction_{frac}")), "{frac}");
    }
}

#[test]
fn a_deeper_table_holds_more_and_takes_more() {
    let all = tables(&Config::default()).unwrap();
    for pair in all.depths.windows(2) {
        assert_eq!(pair[1].width, pair[0].width + 1);
        assert!(pair[1].rams > pair[0].rams && pair[1].held_percent[0] >= pair[0].held_percent[0]);
        // Twice the counts reach twice the angle.
        for (wide, narrow) in pair[1].reach_deg.iter().zip(pair[0].reach_deg) {
            assert!((wide / narrow - 2.0).abs() < 1e-12);
        }
    }
    // 4096 counts of 1/28000 turn.
    let published = all.depths.iter().find(|depth| depth.width == 13).unwrap();
    assert!((published.reach_deg[1] - 4096.0 / 28_000.0 * 360.0).abs() < 1e-9);
    assert!((85.0..95.0).contains(&published.held_percent[0]), "the paper tells of about 90 %");
}

#[test]
fn a_full_table_is_off_by_at_most_half_of_its_last_place_in_every_design() {
    for config in [Config::default(), Config::premium_1_5()] {
        let all = tables(&config).unwrap();
        for (sine, rams) in all.sources.iter().filter(|(sine, _)| sine.source.name() == "trig_table") {
            // The true sine is an f64, off by its own rounding.
            assert!(sine.worst_lsb() <= 0.5 + 1e-6 && *rams > 0, "{}: {}", sine.size, sine.worst_lsb());
        }
    }
}

#[test]
fn a_page_of_tables_is_at_most_120_columns_wide_and_says_how_it_knows() {
    let text = tables(&Config::default()).unwrap().text();
    for line in text.lines() {
        assert!(line.chars().count() <= 120, "{} columns: {line}", line.chars().count());
    }
    assert!(text.contains("exhausted") && text.contains("computed") && text.contains("(counted)"));
}

/// A mass pressed against a spring: `m x'' + (b - k t) x' + k x = F`, where `t` is the delay of the spring. Four clock
/// cycles of `t` are the encoder's way through the FPGA. A swing of 100 counts decays with the time constant `2 m / (b
/// - k t)`, a third of a second at the least damping here; five of these pass before a verdict looks.
fn pressed(damping_n_s_per_m: f64) -> Scene {
    let text = format!(
        r#"
about = "A mass pressed against a wall, 2 mm deep at rest."
[device]
kind = "mass"
mass = 0.05
damping = {damping_n_s_per_m}
initial_position = 0.0019
[encoder]
resolution = "1 um"
[amplifier]
full_scale = "100 N"
[clock]
frequency = "1 MHz"
[method]
kind = "hybrid"
sample_rate = "1 kHz"
position_bits = 16
stiffness_format = "(0,8,0)"
[method.pwm]
bits = 20
[wall]
position = 0
stiffness = "10 kN/m"
[hand]
kind = "constant_torque"
torque = 20
[run]
duration = "2.5 s"
"#
    );
    Scene::parse("pressed", &text, &[], &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_spring_held_back_longer_than_its_damping_over_its_stiffness_is_noticed() {
    // A delay of 64 more clock cycles is 64 us. It takes 0.64 N.s/m of damping from 10 kN/m; the FPGA's own latency
    // takes 0.05.
    for (damping, noticed) in [(0.35, true), (1.4, false)] {
        let found = settling(&pressed(damping), 64, &Control::default()).unwrap().unwrap();
        assert_eq!(found.clocks, [0, 64]);
        assert!((found.lost_damping - 0.64).abs() < 1e-12);
        assert_eq!(found.outcomes[0], OutcomeKind::Settled, "{damping}");
        assert_eq!(found.outcomes[1] != OutcomeKind::Settled, noticed, "{damping}: {found:?}");
    }
}

#[test]
fn a_loop_that_cannot_be_held_back_says_so() {
    let scene = shipped().iter().find(|scene| scene.name == "coupled-wall").unwrap();
    let scene = scene.parse(&[]).unwrap().axis().unwrap();
    let error = settling(&scene, 2, &Control::default()).unwrap_err();
    assert!(error.contains("only the hybrid and the conventional loop"), "{error}");
}
