//! Compares tables of sines with Yosys's results, and a delayed loop with the theory of a late spring.

use hpu_cosim::Control;
use hpu_cosim::scene::{OutcomeKind, Scene, shipped};
use hpu_datapath::phantom::{Config, Turn};
use hpu_signal::Format;
use hpu_study::gimbal::crank_sizes;
use hpu_study::limits::settling::settling;
use hpu_study::tables::{table_rams, tables};

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
/// - k t)`, a twelfth of a second at the least damping here; five of these pass before a verdict looks.
fn pressed(damping_n_s_per_m: f64) -> Scene {
    let text = format!(
        r#"
about = "A mass pressed against a wall, 2 mm deep at rest."
[device]
kind = "mass"
mass = 0.0125
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
duration = "0.625 s"
"#
    );
    Scene::parse("pressed", &text, &[], &mut |_| unreachable!()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
#[ignore = "testbench/long.sh runs it"]
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
    assert!(error.to_string().contains("only the hybrid and the conventional loop"), "{error}");
}

/// The crank's angle at a radius, by the cosine rule of the triangle of crank, rod and radius.
fn crank_rad(crank: f64, rod: f64, radius: f64) -> f64 {
    ((radius * radius + crank * crank - rod * rod) / (2.0 * crank * radius)).clamp(-1.0, 1.0).acos()
}

/// The paper's crank in metres, and the half turns of a servo that counts 1024 positions in 300 degrees.
const CRANK_M: f64 = 12.5e-3;
const ROD_M: f64 = 58e-3;
const POSITION: f64 = 5.0 / 3072.0;

/// Each row's words are computed anew from the closed form, and the positions that read a row are those of its own.
#[test]
fn errors_of_the_cranks_table_are_those_of_the_closed_form() {
    let scene = crate::gimbal::scene("gimbal-spring", &[]);
    let sizes = crank_sizes(&scene.gimbal, &scene.method.config.gimbal).unwrap();
    let steps: Vec<_> = sizes.iter().map(|size| (size.step, size.format.frac(), size.rows)).collect();
    let expected = [(1, 22, 615), (2, 22, 308), (4, 22, 154), (8, 22, 77), (16, 22, 39), (32, 22, 20)];
    assert_eq!(steps[..6], expected);
    assert_eq!(steps[6..], [14, 16, 18, 20, 24, 26].map(|frac| (1, frac, 615)));
    for size in &sizes {
        let lsb_m = f64::from(-size.format.frac()).exp2();
        let [crank, rod] = [CRANK_M, ROD_M].map(|length_m| (length_m / lsb_m).round());
        let (mut worst, mut slope, mut angles) = (0f64, 0f64, [0f64; 2]);
        for position in 0..615 {
            let psi = |position: u32| std::f64::consts::PI * f64::from(position) * POSITION;
            let at = |crank: f64, rod: f64, psi: f64| {
                let root = (rod * rod - (crank * psi.sin()).powi(2)).sqrt();
                (crank * psi.cos() + root, -crank * psi.sin() * (1.0 + crank * psi.cos() / root))
            };
            let (radius, lever) = at(crank, rod, psi(position / size.step * size.step));
            let (read_m, read_slope) = (radius.round() * lsb_m, lever.round() * lsb_m);
            let (true_m, true_slope) = at(CRANK_M, ROD_M, psi(position));
            worst = worst.max((read_m - true_m).abs());
            slope = slope.max((read_slope - true_slope).abs());
            // Within 0.25 mm of 45.5 and of 70.5 mm.
            let is_near = !(0.04575..=0.07025).contains(&true_m);
            let error = (crank_rad(CRANK_M, ROD_M, read_m) - psi(position)).abs();
            angles[usize::from(is_near)] = angles[usize::from(is_near)].max(error);
        }
        let near = |one: f64, other: f64, within: f64| (one - other).abs() <= within;
        assert!(near(size.radius_m, worst, 1e-15) && near(size.slope_m_per_rad, slope, 1e-15), "{size:?}");
        // An arc cosine near 1 turns rounding errors of 1e-16 into angles of 1e-8.
        assert!(near(size.crank_rad[0], angles[0], 1e-12) && near(size.crank_rad[1], angles[1], 1e-7), "{size:?}");
        // Rounding of the table's own word, and of crank and rod; the lengths' errors are at most added.
        assert!(size.step > 1 || size.radius_lsb() <= 1.5 + 1e-6, "{size:?}");
    }
    // At a dead centre the radius is that of the centre, less half of the curvature times the square of the angle. An
    // error e of the radius is then at most an angle of the root of 2 e / curvature, which is least at the far centre.
    let curvature_m = CRANK_M * (1.0 - CRANK_M / ROD_M);
    for size in sizes.iter().filter(|size| size.step == 1) {
        assert!(size.crank_rad[1] < 1.05 * (2.0 * size.radius_m / curvature_m).sqrt(), "{size:?}");
    }
    assert_eq!(sizes.iter().filter(|size| size.is_chosen).count(), 1);
}

/// Half the rows are off by one position's travel where the crank is steepest: 12.7876 mm a radian (sheet, item 21).
#[test]
fn half_the_rows_of_the_cranks_table_miss_the_travel_of_a_position() {
    let scene = crate::gimbal::scene("gimbal-spring", &[]);
    let sizes = crank_sizes(&scene.gimbal, &scene.method.config.gimbal).unwrap();
    for size in &sizes[1..6] {
        let travel_m = 12.787_566_5e-3 * std::f64::consts::PI * POSITION * f64::from(size.step - 1);
        assert!(size.radius_m < travel_m + 1e-6 && size.radius_m > 0.9 * travel_m, "{size:?}");
    }
}

/// Yosys stores the words of the block's default in 8 block RAMs, and those of its narrow words in 6.
#[test]
fn the_cranks_bits_need_no_more_block_rams_than_yosys_takes() {
    let scene = crate::gimbal::scene("gimbal-spring", &[]);
    let sizes = crank_sizes(&scene.gimbal, &scene.method.config.gimbal).unwrap();
    for (frac, bits, counted) in [(22, 19 + 17, 8), (16, 13 + 11, 6)] {
        let size = sizes.iter().find(|size| size.step == 1 && size.format.frac() == frac).unwrap();
        assert_eq!(size.row_bits, bits);
        assert!(size.least_rams() <= counted && size.least_rams() == (615 * u64::from(bits)).div_ceil(4096));
    }
}
