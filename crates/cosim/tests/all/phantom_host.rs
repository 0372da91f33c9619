//! The host of the operating-system platforms: its law, its sample times, and the arrival of its commands.

use crate::common::{Dense, by_host, law, phantom, run};
use hpu_cosim::scene::PhantomScene;
use hpu_cosim::{Control, PhantomSimulation, Simulation, Wired};

/// Nets of `phantom_io`.
const HOST: usize = 6;
const POSITIONS: usize = 9;

/// A clock of 1 MHz, so that a sample period of 20 kHz is 50 edges, and an encoder edge comes every few dozen edges.
const SLOW: &[(&str, &str)] = &[
    ("clock.frequency", "1 MHz"),
    ("run.duration", "20 ms"),
    ("drop.speed", "1 m/s"),
    ("room.distance", "1 mm"),
    ("room.stiffness", "2 kN/m"),
    ("room.walls", "xyz"),
    ("method.depth_bits", "15"),
    ("record.plant_rate", "1 MHz"),
    ("model.transmission_stiffness", "0"),
];

fn scene(more: &[(&str, &str)]) -> PhantomScene {
    phantom("phantom-thrown-rtos", &[SLOW, more].concat())
}

/// Returns the three words from net `first` on, after each edge.
fn words(dense: &Dense, first: usize) -> Vec<[i64; 3]> {
    dense.every_edge().map(|words| [words[first], words[first + 1], words[first + 2]]).collect()
}

/// Returns the host's words after every edge, and the law's words for the counters' values before each edge.
fn commands_and_laws(scene: &PhantomScene) -> (Vec<[i64; 3]>, Vec<[i64; 3]>) {
    let (_, dense) = run(scene);
    let counts = words(&dense, POSITIONS).into_iter().map(|counts| {
        // 16 bits, as a two's complement number.
        counts.map(|count| if count >= 1 << 15 { count - (1 << 16) } else { count } as f64)
    });
    let laws = counts.map(|counts| {
        let count_rad = [3.0 / 92_000.0, 1.0 / 28_000.0, 1.0 / 28_000.0].map(|turn| turn * std::f64::consts::TAU);
        law(scene, [0, 1, 2].map(|joint| counts[joint] * count_rad[joint]))
    });
    // The counters' values after an edge are the values that the next edge reads.
    let laws = std::iter::once([0; 3]).chain(laws).collect();
    (words(&dense, HOST), laws)
}

/// Returns the phases, in edges, at which samples of this delay explain all of the host's words.
fn phases(scene: &PhantomScene, period: usize, delay: usize) -> Vec<usize> {
    let (commands, laws) = commands_and_laws(scene);
    let explains = |phase: usize| {
        (0..commands.len()).all(|edge| {
            let expected = match (edge + period).checked_sub(delay + phase + period) {
                // The latest sample whose command has arrived.
                Some(since) => laws[phase + since / period * period],
                None => [0; 3],
            };
            commands[edge] == expected
        })
    };
    // The first sample is within the first period.
    (1..=period).filter(|&phase| explains(phase)).collect()
}

#[test]
fn a_command_arrives_exactly_delay_and_latency_after_its_sample() {
    for (platform, period, delay, latency, edges) in [
        ("RTOS-20", 50, "1", "0 s", 50),
        ("RTOS-20", 50, "0", "0 s", 0),
        ("RTOS-20", 50, "0.5", "7 us", 32),
        ("RTOS-20", 50, "2.5", "0 s", 125),
        ("RTOS-10", 100, "1", "1.1 ms", 1200),
        ("RTOS-5", 200, "1", "0 s", 200),
    ] {
        let scene = scene(&[("platform.kind", platform), ("model.delay", delay), ("model.latency", latency)]);
        let found = phases(&scene, period, edges);
        assert_eq!(found.len(), 1, "{platform} {delay} {latency}: {found:?}");
        // One edge more or less explains nothing, so the exact edge is determined.
        let near = [edges.wrapping_sub(1), edges + 1];
        for wrong in near.into_iter().filter(|wrong| *wrong < 10_000) {
            assert!(!phases(&scene, period, wrong).contains(&found[0]), "{platform} {delay} {latency}");
        }
    }
}

#[test]
fn the_motors_take_the_hosts_word_on_the_edge_that_finds_it() {
    let (_, dense) = run(&scene(&[]));
    assert!(words(&dense, HOST).iter().any(|host| host[0] != 0));
    // Commands are the last of the ports: inputs, positions, commands.
    assert_eq!(words(&dense, POSITIONS + 3), words(&dense, HOST));
}

#[test]
fn at_the_origin_a_joints_torque_is_force_times_lever_and_moves_its_own_axis_alone() {
    // The Jacobian at the origin is diag(l1, l1, l2). A tip within 1 mm of the origin has turned by at most 1 mm / 0.14
    // m. All entries are within that share of their value at the origin, and the other two joints have at most that
    // share of the torque, plus half a DAC count.
    for (axis, ratio) in [("x", 115.0 / 15.0), ("y", 7.0), ("z", 7.0)] {
        let scene = scene(&[
            ("drop.axis", axis),
            ("room.walls", axis),
            ("room.distance", "0.2 mm"),
            ("drop.speed", "0.1 m/s"),
            ("model.delay", "0"),
        ]);
        let index = scene.drop.axis.index();
        let (_, dense) = run(&scene);
        let count_nm = 0.17 * ratio / 32_768.0;
        let mut seen = 0;
        for (host, reals) in words(&dense, HOST).into_iter().zip(&dense.rows) {
            // The sample is at most a period of 50 us old, and the tip moves at 0.1 m/s at most: 5 um. A count is 32
            // um.
            let depth_m = -0.2e-3 - reals[index];
            if depth_m > 100e-6 && depth_m < 800e-6 {
                let exact_nm = 0.14 * 2000.0 * depth_m;
                let bound_nm = 0.14 * 2000.0 * (5e-6 + 32e-6) + 0.01 * exact_nm + count_nm;
                assert!((host[index] as f64 * count_nm - exact_nm).abs() < bound_nm, "{axis}: {host:?} at {depth_m} m");
                for other in (0..3).filter(|other| *other != index) {
                    assert!(
                        (host[other] as f64 * count_nm).abs() < 0.01 * exact_nm + 2.0 * count_nm,
                        "{axis}: {host:?}"
                    );
                }
                seen += 1;
            }
        }
        assert!(seen > 1000, "{axis}: {seen}");
    }
}

#[test]
fn a_force_beyond_the_devices_is_limited() {
    let scene = scene(&[("room.stiffness", "40 kN/m"), ("room.walls", "x")]);
    let (_, dense) = run(&scene);
    // 8.5 N on a lever of 0.14 m, in counts of 0.17 * 115 / 15 / 2^15 N.m; the posture is 10 mm or less away from the
    // origin.
    let most = 8.5 * 0.14 / (0.17 * 115.0 / 15.0 / 32_768.0);
    let greatest = words(&dense, HOST).iter().map(|host| host[0].abs()).max().expect("edges") as f64;
    assert!((0.99 * most..=1.01 * most).contains(&greatest), "{greatest} of {most}");
}

#[test]
fn the_ideal_law_reads_the_true_angles() {
    for platform in ["RTOS-20", "FPGA-20"] {
        let scene = scene(&[("platform.kind", platform), ("model.law", "ideal"), ("model.delay", "0")]);
        let (_, dense) = run(&scene);
        let commands = words(&dense, HOST);
        let laws: Vec<_> = dense.rows.iter().map(|reals| law(&scene, crate::common::angles_rad(0.14, reals))).collect();
        // The host's word after an edge is the law of the tip at the edge at which it sampled, and holds until it
        // samples again.
        let explains =
            |phase: usize| (phase..commands.len()).all(|edge| commands[edge] == laws[phase + (edge - phase) / 50 * 50]);
        let found: Vec<_> = (1..=50).filter(|&phase| explains(phase)).collect();
        assert_eq!(found.len(), 1, "{platform}: {found:?}");
    }
}

/// Returns a tip that swings between soft walls for 5 s, sampled at 1 kHz by a host with these deadlines.
fn swinging(jitter: &str, missed: &str, more: &[(&str, &str)]) -> PhantomScene {
    let swings = [
        ("platform", format!("{{ kind = \"PMOS-1\", jitter = \"{jitter}\", missed = \"{missed}\" }}")),
        ("run.duration", "5 s".to_string()),
        ("drop.speed", "0.5 m/s".to_string()),
        ("drop.weight", "0.15 N".to_string()),
        ("device.viscous_damping", "0.2 N.s/m".to_string()),
        ("device.coulomb_force", "0".to_string()),
        ("room.distance", "0.1 mm".to_string()),
        ("room.stiffness", "100".to_string()),
        ("room.walls", "x".to_string()),
        ("model.joints", "tested".to_string()),
        ("record.plant_rate", "1 kHz".to_string()),
    ];
    let swings: Vec<_> = swings.iter().map(|(key, value)| (*key, value.as_str())).collect();
    scene(&[&swings, more].concat())
}

/// Returns the edges at which the host's first word changes.
fn changes(dense: &Dense) -> Vec<i64> {
    let pairs = dense.changes.windows(2).filter(|pair| pair[0].1[HOST] != pair[1].1[HOST]);
    pairs.map(|pair| pair[1].0 as i64).collect()
}

#[test]
fn samples_are_late_by_up_to_the_jitter_and_anything_up_to_it() {
    // With four values, the chance that one never occurs is 4 * 0.75^n, so both ends of "3 us" are seen.
    for (jitter, most) in [("100 us", 100), ("400 us", 400), ("3 us", 3), ("0", 0)] {
        let (_, dense) = run(&swinging(jitter, "0", &[]));
        let changes = changes(&dense);
        assert!(changes.len() > 3000, "{}", changes.len());
        // Lateness relative to the first change, as a phase of the period of 1000 edges.
        let late = changes.iter().map(|edge| (edge - changes[0] + 500).rem_euclid(1000) - 500);
        let (least, greatest) = (late.clone().min().expect("some"), late.clone().max().expect("some"));
        // Uniform in 0..=most: of n samples, the chance that none is in the outer fiftieth is 0.98^n < 1e-26.
        assert!(greatest - least <= most && greatest - least >= most - most / 25, "{jitter}: {least} to {greatest}");
        // The mean is in the middle, within 5 standard deviations of most / sqrt(12 n).
        let mean = late.map(|late| (late - least) as f64).sum::<f64>() / changes.len() as f64;
        let most = most as f64;
        let bound = 5.0 * (most + 1.0) / (12.0 * changes.len() as f64).sqrt() + most / 50.0;
        assert!((mean - 0.5 * most).abs() <= bound, "{jitter}: mean {mean}");
    }
}

#[test]
fn the_share_of_missed_samples_is_the_one_asked_for() {
    for (missed, share) in [("0", 0.0), ("5 %", 0.05), ("30 %", 0.3)] {
        let scene = swinging("0", missed, &[]);
        let (_, dense) = run(&scene);
        let (commands, laws) = commands_and_laws(&scene);
        let delay = 1000;
        let phase = (changes(&dense)[0] - delay).rem_euclid(1000) as usize;
        // If the law's output differs from the present command, a sample either shows or was missed.
        let (mut told, mut lost) = (0, 0);
        for sample in (phase..commands.len() - 1000).step_by(1000).filter(|sample| *sample > 1000) {
            let arrives = sample + delay as usize;
            let (before, after) = (commands[arrives - 1][0], commands[arrives][0]);
            if laws[sample][0] == before {
                continue;
            }
            told += 1;
            if after == before {
                lost += 1;
            } else {
                assert_eq!(after, laws[sample][0]);
            }
        }
        assert!(told > 3000, "{told}");
        // Five standard deviations of a binomial share.
        let (n, found) = (f64::from(told), f64::from(lost) / f64::from(told));
        let bound = 5.0 * (share * (1.0 - share) / n).sqrt();
        assert!((found - share).abs() <= bound, "{missed}: {found} of {told}");
    }
}

#[test]
fn the_same_trial_is_the_same_run_and_another_trial_or_seed_is_another() {
    let told = |more: &[(&str, &str)]| {
        let short = [("run.duration", "200 ms")];
        let scene = swinging("100 us", "1 %", &[&short, more].concat());
        run(&scene).1.changes
    };
    let first = told(&[]);
    assert!(first.len() > 1000);
    assert_eq!(first, told(&[]));
    for other in [("drop.trial", "2"), ("run.seed", "2")] {
        assert_ne!(first, told(&[other]), "{other:?}");
    }
}

#[test]
fn a_trial_begins_within_a_count_of_the_origin_and_a_millimetre_a_second_of_its_speed() {
    let mut starts = Vec::new();
    for trial in 0..40u32 {
        let trial = trial.to_string();
        let scene = phantom(
            "phantom-drop",
            &[("drop.trial", &trial), ("run.duration", "10 us"), ("record.plant_rate", "50 MHz"), ("drop.speed", "0")],
        );
        let (_, dense) = run(&scene);
        let height = |row: usize| dense.rows[row][1];
        let (start_m, speed) = (height(0), (height(500) - height(0)) / 10e-6);
        // Joints 2 and 3 start within a count, 0.14 m * 2 pi / 28000 = 31.4 um; in 10 us, 1.7 m/s^2 change the speed by
        // 17 um/s.
        assert!((0.0..31.5e-6).contains(&start_m), "{start_m}");
        assert!(speed.abs() < 1.02e-3, "{speed}");
        starts.push((start_m, speed));
    }
    // The starts differ, and cover most of their range.
    let range = |values: Vec<f64>| {
        values.iter().copied().fold(f64::MIN, f64::max) - values.iter().copied().fold(f64::MAX, f64::min)
    };
    assert!(range(starts.iter().map(|start| start.0).collect()) > 0.7 * 31.4e-6);
    assert!(range(starts.iter().map(|start| start.1).collect()) > 0.7 * 2e-3);
}

#[test]
fn what_computes_the_force_has_its_wiring() {
    for (platform, law, host) in [
        ("FPGA-400", "words", false),
        ("FPGA-400", "ideal", true),
        ("RTOS-1", "words", true),
        ("PMOS-1", "ideal", true),
    ] {
        let scene = phantom("phantom-thrown", &[("platform.kind", platform), ("model.law", law)]);
        let simulation = PhantomSimulation::new(&scene).expect("valid");
        assert_eq!(simulation.wiring().name(), if host { "phantom_io" } else { "phantom_loop" });
        assert_eq!(by_host(&scene), host);
    }
}

/// Returns a scene with the law in floats without a clock, in steps of the classic Runge-Kutta method.
fn in_steps(name: &str, step: &str, more: &[(&str, &str)]) -> PhantomScene {
    let steps = [("model.law", "floats"), ("model.solver", "rk4"), ("model.step", step)];
    phantom(name, &[&steps[..], more].concat())
}

/// Returns, for every row of the trace, the tip's position by the counts and the true one.
fn rows(scene: &PhantomScene) -> Vec<[f64; 6]> {
    let simulation = PhantomSimulation::new(scene).expect("valid");
    let mut trace = simulation.trace(&[]);
    let summary = simulation.run(simulation.driver(), &mut trace, &mut (), &Control::default());
    assert!(summary.complete && summary.aborted.is_none());
    (0..trace.rows()).map(|row| std::array::from_fn(|real| trace.real(real)[row])).collect()
}

#[test]
fn a_host_without_a_clock_reads_the_counts_and_commands_when_one_with_a_clock_does() {
    // Two computations of the same run: series from event to event around the clocked wiring, and steps from sample to
    // sample. A sample that read another count would show as a DAC count: 5e-6 N.m on 5e-4 kg.m2, which move the tip by
    // 1e-6 m after 20 ms, and further later.
    let short = [("run.duration", "300 ms")];
    let bounce = [("run.duration", "300 ms"), ("drop.speed", "0.2 m/s")];
    for (name, step, more) in [
        ("phantom-thrown-rtos", "10 us", &[][..]),
        // At this clock the four edges by which a counter is late are 4 us.
        ("phantom-thrown-rtos", "10 us", &[("clock.frequency", "1 MHz")]),
        ("phantom-late", "20 us", &[("clock.frequency", "1 MHz"), bounce[0], bounce[1]]),
        ("phantom-late", "20 us", &bounce),
        ("phantom-drop-rtos", "5 us", &short),
        ("phantom-late", "20 us", &[("platform.kind", "PMOS-1"), bounce[0], bounce[1]]),
        ("phantom-late", "20 us", &[("platform.kind", "RTOS-5"), ("model.delay", "0.5"), bounce[0], bounce[1]]),
        ("phantom-late", "20 us", &[("model.law", "ideal"), bounce[0], bounce[1]]),
    ] {
        let clocked = phantom(name, more);
        let stepped = in_steps(name, step, more);
        let (clocked, stepped) = (rows(&clocked), rows(&stepped));
        assert_eq!(clocked.len(), stepped.len());
        for (row, (clocked, stepped)) in clocked.iter().zip(&stepped).enumerate() {
            for axis in 0..3 {
                let apart = (clocked[axis] - stepped[axis]).abs();
                assert!(apart < 2e-8, "{name} {more:?}: axis {axis}, row {row}, {apart} m apart");
            }
        }
    }
}

#[test]
fn an_fpgas_law_that_follows_the_arm_stands_for_its_samples() {
    // Compared with the words. The remaining difference is the rounding of counts (31 um) and of words. With an age of
    // zero the tip would be 2.9 um off in the first scene, and 29 um in the second, which samples every 10 us and is 38
    // clocks late.
    for (name, within_m) in [("phantom-thrown", 2.4e-6), ("phantom-thrown-shared", 4e-6)] {
        let (words, stepped) = (rows(&phantom(name, &[])), rows(&in_steps(name, "50 us", &[])));
        let axis = if name == "phantom-thrown" { 1 } else { 2 };
        let apart = words.iter().zip(&stepped).map(|(a, b)| (a[axis] - b[axis]).abs()).fold(0.0, f64::max);
        assert!(apart < within_m, "{name}: {apart} m");
    }
}

#[test]
fn an_ideal_law_that_follows_the_arm_stands_for_its_samples() {
    // Both laws read the true angles. The remaining differences are the rounding of commands, and the replacement of a
    // held command's age by its mean. There are two samples per step. With the words' latency the tip would be 2.4 um
    // off, without any age 15 um.
    let ideal = [("model.law", "ideal"), ("run.duration", "20 ms")];
    let clocked = rows(&phantom("phantom-thrown-shared", &ideal));
    let stepped = rows(&in_steps("phantom-thrown-shared", "20 us", &ideal));
    let apart = clocked.iter().zip(&stepped).map(|(a, b)| (a[2] - b[2]).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-7, "{apart} m");
}

#[test]
fn a_law_without_a_clock_shows_its_words_with_the_rows() {
    let scene = in_steps("phantom-thrown-rtos", "50 us", &[]);
    let simulation = PhantomSimulation::new(&scene).expect("valid");
    let mut trace = simulation.trace(&["position1", "command1", "host1"]);
    simulation.run(simulation.driver(), &mut trace, &mut (), &Control::default());
    let count_rad = 3.0 / 92_000.0 * std::f64::consts::TAU;
    let mut moved = 0;
    let mut pushed = 0;
    for row in 0..trace.rows() {
        // The angle of joint 1, from the tip's position by the counts.
        let angle_rad = trace.real(3)[row].atan2(0.14 + trace.real(5)[row]);
        let count = trace.words(0)[row];
        let signed = if count >= 1 << 15 { count - (1 << 16) } else { count } as f64;
        assert!((signed * count_rad - angle_rad).abs() < 1e-12, "row {row}: {signed} {angle_rad}");
        moved += u32::from(count != 0);
        assert_eq!(trace.words(1)[row], trace.words(2)[row]);
        pushed += u32::from(trace.words(1)[row] != 0);
    }
    assert!(pushed > 50 && moved > 50);
}
