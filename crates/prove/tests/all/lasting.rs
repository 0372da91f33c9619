//! What a run is proved to do for ever after its end.

use std::sync::Mutex;

use hpu_cosim::scene::{Experiment, OutcomeKind, Scene, shipped};
use hpu_cosim::{
    Beyond, Control, Driver, Forever, Period, Quiet, Recurrence, Rest, Simulation, Standing, Summary, Wired,
    WiredSimulation,
};
use hpu_prove::lasting::{beyond, follows, stays};
use hpu_signal::{Cycle, Observe};

fn experiment(name: &str, set: &[(&str, String)]) -> Experiment {
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let set: Vec<(String, String)> = set.iter().map(|(key, value)| ((*key).to_string(), value.clone())).collect();
    scene.parse(&set).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn axis(name: &str, set: &[(&str, String)]) -> Scene {
    experiment(name, set).axis().expect("an axis")
}

/// Runs a scene by a driver, and looks on for so many seconds.
fn looked_on(experiment: &Experiment, driver: Driver, seconds: f64) -> Summary {
    let simulation = WiredSimulation::new(experiment).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.verdict_trace();
    let look = |asked: &Beyond| simulation.run_beyond(driver, &mut trace, &mut (), &Control::default(), Some(asked));
    let summary = beyond(experiment, seconds, look);
    assert!(summary.complete, "{}", experiment.name);
    summary
}

/// A rest in the middle of a count, without voltage, where the hand wants to be.
fn still(scene: &Scene) -> Rest {
    let (count, middle) = (scene.encoder.count_rad(), 1000.5 * scene.encoder.count_rad());
    let standing =
        Standing { current_a: 0.0, speed_rad_per_s: 0.0, angle_rad: middle, intent_rad: middle, is_stuck: false };
    let cycle = vec![(0.0, u64::MAX)];
    Rest { edge: 0, band_rad: [1000.0 * count, 1001.0 * count], standing, lead: Vec::new(), cycle }
}

fn near(found: f64, expected: f64, off: f64) {
    assert!((found - expected).abs() <= off, "{found:e}, not {expected:e}");
}

#[test]
fn a_deviation_reaches_as_far_as_its_energy() {
    let scene = axis("hybrid-wall", &[]);
    let hpu_cosim::scene::Device::Motor(motor) = &scene.device else { panic!("a motor") };
    let (grip, _) = scene.hand.grip();
    let count = scene.encoder.count_rad();
    // Half of the inertia's or of the winding's energy twice over the stiffness: the angle that the spring could take.
    let by_speed = (motor.inertia_kg_m2() / grip).sqrt();
    let by_current = (motor.inductance_h / grip).sqrt();
    for share in [0.0, 0.2, 0.9, 0.999, 1.001, 3.0] {
        let reach = share * 0.5 * count;
        for (speed, current) in [(reach / by_speed, 0.0), (-reach / by_speed, 0.0), (0.0, reach / by_current)] {
            let mut rest = still(&scene);
            (rest.standing.speed_rad_per_s, rest.standing.current_a) = (speed, current);
            match stays(&scene, &rest) {
                Ok(Quiet { margin, is_stuck: false, ripple_counts, .. }) => {
                    assert!(share < 1.0, "{share} of the way is proved to stay");
                    near(margin, 0.5 * (1.0 - share), 1e-9);
                    near(ripple_counts, 0.0, 1e-9);
                }
                other => assert!(share > 1.0 && other.is_err(), "{share}: {other:?}"),
            }
        }
        // Beside its place of rest the spring holds all of it, on either side.
        for side in [reach, -reach] {
            let mut rest = still(&scene);
            rest.standing.intent_rad += side;
            assert_eq!(stays(&scene, &rest).is_ok(), share < 0.5, "{share}");
        }
    }
}

#[test]
fn the_ripple_bounds_the_rms_that_is_known_in_closed_form() {
    // The rms is that of arithmetic of 50 digits (crates/prove/src/linear/ripple.rs): half of the range of an angle is
    // at least its rms, and of a motion so near to a sine at most twice.
    for (name, of, period, rms) in [
        ("hybrid-wall", 1024, 4096, 9.190_119_348_572_9e-4),
        ("slow-pwm", 8192, 65536, 0.896_463_626_650_99),
        ("slow-pwm", 16384, 65536, 1.642_595_679_634_3),
    ] {
        let scene = axis(name, &[]);
        let mut rest = still(&scene);
        rest.cycle = vec![(1.0, of), (0.0, period - of)];
        // Where the mean voltage holds the hand's spring; the period begins at rest, far from its own state there.
        let hpu_cosim::scene::Device::Motor(motor) = &scene.device else { panic!("a motor") };
        let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
        let mean_a = of as f64 / period as f64 * scene.bridge.supply_v / ohm;
        rest.standing.current_a = mean_a;
        rest.standing.intent_rad -= motor.torque_constant_nm_per_a * mean_a / scene.hand.grip().0;
        let wide = [-5000.0, 5001.0].map(|counts| rest.band_rad[0] + counts * scene.encoder.count_rad());
        let widened = Rest { band_rad: wide, ..rest.clone() };
        let found = stays(&scene, &widened).unwrap_or_else(|why| panic!("{name}: {why}"));
        // Counts are those of the band that is given.
        let ripple = found.ripple_counts * 10_001.0;
        assert!((rms..2.0 * rms).contains(&ripple), "{name} at {of}: {ripple}, rms {rms}");
        // A band that the ripple alone leaves.
        let narrow =
            [-0.9, 0.9].map(|side| 1000.5 * scene.encoder.count_rad() + side * rms * scene.encoder.count_rad());
        assert!(stays(&scene, &Rest { band_rad: narrow, ..rest.clone() }).is_err(), "{name} at {of}");
        for band_rad in [[narrow[0], wide[1]], [wide[0], narrow[1]]] {
            assert!(stays(&scene, &Rest { band_rad, ..rest.clone() }).is_err(), "{name} at {of}, one side");
        }
    }
}

/// The periodic motion once more, by the classical method of Runge and Kutta over so many periods that it has come to
/// it: with a hand that damps strongly.
#[test]
fn the_ripple_is_that_of_small_steps() {
    let scene = axis("slow-pwm", &[("hand.damping", "0.03".into())]);
    let hpu_cosim::scene::Device::Motor(motor) = &scene.device else { panic!("a motor") };
    let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
    let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
    let (grip, damping) = scene.hand.grip();
    let drag = motor.viscous_friction_nm_s_per_rad + damping;
    let (period, of, steps) = (65536u64, 16384u64, 4000);
    let step_s = period as f64 / scene.clock.frequency_hz() as f64 / f64::from(steps);
    let slope =
        |[i, w, angle]: [f64; 3], volt: f64| [(volt - ohm * i - k * w) / l, (k * i - drag * w - grip * angle) / j, w];
    let plus = |x: [f64; 3], w: [f64; 3], by: f64| [0, 1, 2].map(|n| x[n] + by * w[n]);
    let mut x = [0.25 * scene.bridge.supply_v / ohm, 0.0, 0.25 * scene.bridge.supply_v / ohm * k / grip];
    let (mut ends, mut phases) = ([0.0; 2], Vec::new());
    for _ in 0..600 {
        phases.clear();
        ends = [f64::INFINITY, f64::NEG_INFINITY];
        for step in 0..steps {
            if step % 500 == 0 {
                phases.push(x);
            }
            let volt = if step < steps / 4 { scene.bridge.supply_v } else { 0.0 };
            let a = slope(x, volt);
            let b = slope(plus(x, a, 0.5 * step_s), volt);
            let c = slope(plus(x, b, 0.5 * step_s), volt);
            let d = slope(plus(x, c, step_s), volt);
            x = [0, 1, 2].map(|n| x[n] + step_s / 6.0 * (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]));
            ends = [ends[0].min(x[2]), ends[1].max(x[2])];
        }
    }
    let half = 0.5 * (ends[1] - ends[0]);
    // From each eighth of the period on.
    for (at, phase) in (0..8).zip(phases) {
        let cycle = match at * period / 8 {
            0 => vec![(1.0, of), (0.0, period - of)],
            gone if gone < of => vec![(1.0, of - gone), (0.0, period - of), (1.0, gone)],
            gone => vec![(0.0, period - gone), (1.0, of), (0.0, gone - of)],
        };
        let mut rest = Rest { cycle, ..still(&scene) };
        (rest.standing.current_a, rest.standing.speed_rad_per_s) = (phase[0], phase[1]);
        rest.standing.intent_rad -= phase[2];
        let within = |rest: &Rest, low: f64, high: f64| {
            let band_rad = [ends[0] - low * half, ends[1] + high * half].map(|angle| rest.standing.intent_rad + angle);
            stays(&scene, &Rest { band_rad, ..rest.clone() })
        };
        let found = within(&rest, 0.1, 0.1).unwrap_or_else(|why| panic!("phase {at}: {why}"));
        near(found.ripple_counts * 2.2, 1.0, 1e-2);
        for [low, high] in [[-0.05, 5.0], [5.0, -0.05]] {
            assert!(within(&rest, low, high).is_err(), "phase {at}, {low}, {high}");
        }
    }
}

/// The gates' nets, where they change.
struct Bridge {
    nets: [usize; 4],
    changes: Vec<(u64, [i64; 4])>,
}

impl Observe for Bridge {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        let gates = self.nets.map(|net| words[net]);
        if self.changes.last().is_none_or(|(_, latest)| *latest != gates) {
            self.changes.push((cycle.0, gates));
        }
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

#[test]
fn the_pulses_of_a_rest_are_those_that_follow_at_every_edge() {
    let cell = experiment("hybrid-wall", &[("wall.stiffness", "0.4".into()), ("run.duration", "0.6".into())]);
    let longer = experiment("hybrid-wall", &[("wall.stiffness", "0.4".into()), ("run.duration", "2".into())]);
    let [simulation, further] = [&cell, &longer].map(|cell| WiredSimulation::new(cell).expect("a cell"));
    let names: Vec<_> = simulation.nets().iter().map(|net| net.name).collect();
    let net = |name: &str| names.iter().position(|at| *at == name).unwrap_or_else(|| panic!("{name} in {names:?}"));
    let mut bridge = Bridge { nets: ["a_high", "a_low", "b_high", "b_low"].map(net), changes: Vec::new() };
    let (mut trace, rests) = (simulation.verdict_trace(), Mutex::new(Vec::new()));
    beyond(&cell, 1.0, |asked| {
        let prove = |rest: &Rest| {
            rests.lock().expect("one thread").push(rest.clone());
            Err("asked again later".to_string())
        };
        let asked = Beyond { prove: &prove, ..*asked };
        simulation.run_beyond(Driver::Events, &mut trace, &mut (), &Control::default(), Some(&asked))
    });
    let rests = rests.into_inner().expect("one thread");
    further.run(Driver::Events, &mut further.verdict_trace(), &mut bridge, &Control::default());
    let (mut looked, mut led) = (0, 0);
    for rest in &rests {
        let cycles = [&rest.cycle[..], &rest.cycle].concat();
        let length: u64 = rest.lead.iter().chain(&cycles).map(|(_, edges)| edges).sum();
        if bridge.changes.last().is_none_or(|(edge, _)| *edge < rest.edge + length) {
            continue;
        }
        let mut edge = rest.edge;
        for &(share, edges) in rest.lead.iter().chain(&cycles) {
            for at in edge..edge + edges {
                let place = bridge.changes.partition_point(|(changed, _)| *changed <= at);
                let [a_high, a_low, b_high, b_low] = bridge.changes[place - 1].1;
                let whole = f64::from(u8::from(a_high + b_low == 2 || a_low + b_high == 2));
                assert_eq!(share.abs(), whole, "edge {at}, {} after the rest", at - rest.edge);
            }
            edge += edges;
        }
        (looked, led) = (looked + 1, led + rest.lead.len());
    }
    assert!(looked > 3 && led > 0, "{looked} of {} rests, {led} phases before", rests.len());
}

/// The gates where they change, and the counts that the encoder's lines tell where they change.
struct Lines {
    bridge: Bridge,
    nets: [usize; 2],
    counts: Vec<(u64, i64)>,
    place: i64,
}

impl Observe for Lines {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.bridge.nets(cycle, words);
        let [a, b] = self.nets.map(|net| words[net]);
        let place = 2 * a + (a ^ b);
        let turned = (place - self.place + 5).rem_euclid(4) - 1;
        assert!(turned < 2, "two lines at once");
        self.place = place;
        let count = self.counts.last().map_or(0, |(_, count)| count + turned);
        if turned != 0 || self.counts.is_empty() {
            self.counts.push((cycle.0, count));
        }
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// The command of each pulse is that of the count at its reading: at the clock at which a window begins, and at no
/// clock beside it. Counts are dense and periods are short, so that some counts arrive exactly there.
#[test]
fn a_window_begins_at_the_edge_that_the_modulator_reads() {
    let path: Vec<String> =
        (0..32).map(|at| format!("[\"{} ms\", {}]", 3 * at, 0.06 + 0.05 * f64::from(at % 2))).collect();
    let set = [
        ("wall.damping", "0".into()),
        ("wall.stiffness", "3".into()),
        ("wall.position", "0.05 rad".into()),
        ("encoder.lines", "4096".into()),
        ("method.pwm.bits", "8".into()),
        ("run.duration", "100 ms".into()),
        ("hand.stiffness", "5".into()),
        ("hand.path", format!("[{}]", path.join(", "))),
    ];
    let (cell, scene) = (experiment("hybrid-wall", &set), axis("hybrid-wall", &set));
    let simulation = WiredSimulation::new(&cell).expect("a cell");
    let names: Vec<_> = simulation.nets().iter().map(|net| net.name).collect();
    let net = |name: &str| names.iter().position(|at| *at == name).unwrap_or_else(|| panic!("{name} in {names:?}"));
    let bridge = Bridge { nets: ["a_high", "a_low", "b_high", "b_low"].map(net), changes: Vec::new() };
    let mut seen = Lines { bridge, nets: ["a_pin", "b_pin"].map(net), counts: Vec::new(), place: 0 };
    simulation.run(Driver::Events, &mut simulation.verdict_trace(), &mut seen, &Control::default());
    let rest = Mutex::new(None);
    beyond(&cell, 0.001, |asked| {
        let window = |at: &Rest| {
            *rest.lock().expect("one thread") = Some(at.clone());
            Err("only looked at".to_string())
        };
        let asked = Beyond { window: &window, ..*asked };
        let mut trace = simulation.verdict_trace();
        simulation.run_beyond(Driver::Events, &mut trace, &mut (), &Control::default(), Some(&asked))
    });
    let rest = rest.into_inner().expect("one thread").expect("a state");
    let words = scene.words().expect("words");
    let changes = &seen.bridge.changes;
    let count_at = |edge: u64| seen.counts[seen.counts.partition_point(|(at, _)| *at <= edge) - 1].1;
    let gates_at = |edge: u64| changes[changes.partition_point(|(at, _)| *at <= edge) - 1].1;
    let is_on = |edge: u64| {
        let [a_high, a_low, b_high, b_low] = gates_at(edge);
        a_high + b_low == 2 || a_low + b_high == 2
    };
    let lead: u64 = rest.lead.iter().map(|(_, edges)| edges).sum();
    assert_eq!(lead, 4, "two registers that synchronise, the decoder and the counter");
    let wrong = [-1i64, 0, 1].map(|shift| {
        let reads = (1..19_000).map(|period| rest.edge % 256 + 256 * period);
        let commands = reads.map(|read| {
            let inside = count_at(read.saturating_add_signed(shift)) - scene.wall_count();
            let command = (inside.max(0) * words.stiffness) >> scene.method.stiffness_format.frac();
            (command, (0..256).filter(|edge| is_on(read + lead + edge)).count() as i64)
        });
        // A pulse that fills its period would hide the next one.
        let told = commands.filter(|(command, _)| (1..240).contains(command));
        let (all, wrong) =
            told.fold((0, 0), |(all, wrong), (command, pulse)| (all + 1, wrong + i32::from(command != pulse)));
        assert!(all > 10_000, "{all} pulses");
        wrong
    });
    assert!(wrong[1] == 0 && wrong[0] > 5 && wrong[2] > 5, "{wrong:?} commands are not those of the counts read");
}

/// Angles of all rows, with their edges.
struct Angles(Vec<(u64, f64)>);

impl Observe for Angles {
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, cycle: Cycle, reals: &[f64]) {
        self.0.push((cycle.0, reals[hpu_cosim::ANGLE]));
    }
}

/// Undamped walls that neither rest nor repeat: the emulator runs on through the window that is told, and further.
#[test]
fn runs_stay_within_the_window_that_is_told() {
    for (stiffness, damping) in [("0.5", "0"), ("1", "0"), ("1.5", "0"), ("1.8", "0"), ("1.5", "0.1 mN.m.s/rad")] {
        let (told, stiffness) = (damping == "0", stiffness.to_string());
        let set = |duration: &str| {
            [("wall.damping", damping.into()), ("wall.stiffness", stiffness.clone()), ("run.duration", duration.into())]
        };
        let cell = experiment("hybrid-wall", &set("1 s"));
        let summary = looked_on(&cell, Driver::Events, 0.1);
        let found = match summary.forever.as_ref().expect("it was asked") {
            Ok(Forever::InContact(found)) => *found,
            other => {
                let why = other.as_ref().expect_err("neither rest nor repetition");
                assert!(
                    !told && why.contains("no state came back") && why.contains("no window is bounded: the drag"),
                    "{why}"
                );
                continue;
            }
        };
        assert!(told && !summary.is_settled_for_ever(), "{stiffness}: {found:?}");
        assert_eq!(found.edges, 15_000_000);
        assert!((55_000_000..56_000_000).contains(&found.from_edge), "{found:?}");
        let longer = experiment("hybrid-wall", &set("3 s"));
        let further = WiredSimulation::new(&longer).expect("a cell");
        let mut seen = Angles(Vec::new());
        further.run(Driver::Events, &mut further.verdict_trace(), &mut seen, &Control::default());
        let count = axis("hybrid-wall", &set("1 s")).encoder.count_rad();
        let rows = |edges: u64| -> Vec<f64> {
            let window = found.from_edge..found.from_edge + edges;
            seen.0.iter().filter(|(edge, _)| window.contains(edge)).map(|(_, angle)| angle / count).collect()
        };
        let rows_of = [rows(found.edges), rows(u64::MAX / 2)];
        let rms = |rows: &[f64]| {
            let mean = rows.iter().sum::<f64>() / rows.len() as f64;
            (rows.iter().map(|at| (at - mean).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
        };
        let [within, long] = [&rows_of[0], &rows_of[1]].map(|rows| rms(rows));
        assert!(rows_of[0].len() > 100 && within <= found.rms_counts && within > 0.05 * found.rms_counts, "{within}");
        assert!(long <= found.long_run_counts, "{stiffness}: {long}, {found:?}");
        let ends =
            rows_of[1].iter().fold([f64::INFINITY, f64::NEG_INFINITY], |ends, at| [ends[0].min(*at), ends[1].max(*at)]);
        assert!(ends[1] - ends[0] <= 2.0 * found.half_range_counts, "{stiffness}: {ends:?}, {found:?}");
    }
}

#[test]
fn friction_holds_a_shaft_as_long_as_the_current_and_the_hand_are_too_weak() {
    let scene = axis("friction-wall", &[]);
    let hpu_cosim::scene::Device::Motor(motor) = &scene.device else { panic!("a motor") };
    let ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
    let stall_nm = motor.torque_constant_nm_per_a * scene.bridge.supply_v / ohm;
    let friction = motor.coulomb_friction_nm;
    let held = |current_a: f64, bent_nm: f64, cycle: Vec<(f64, u64)>| {
        let mut rest = Rest { cycle, ..still(&scene) };
        rest.standing.is_stuck = true;
        rest.standing.current_a = current_a;
        rest.standing.intent_rad += bent_nm / scene.hand.grip().0;
        stays(&scene, &rest).map(|quiet| quiet.margin)
    };
    let steady = |share: f64| vec![(share, u64::MAX)];
    for part in [0.0, 0.5, 0.99, 1.01, -0.99, -1.01] {
        let torque = part * friction;
        for found in [
            held(torque / motor.torque_constant_nm_per_a, 0.0, steady(0.0)),
            held(0.0, torque, steady(0.0)),
            held(0.0, 0.0, steady(torque / stall_nm)),
            held(0.0, -0.5 * torque, steady(1.5 * torque / stall_nm)),
        ] {
            match found {
                Ok(margin) => {
                    assert!(part.abs() < 1.0, "{part} of friction is proved to hold");
                    near(margin, 1.0 - part.abs(), 0.5 * part.abs() + 1e-9);
                }
                Err(why) => assert!(part.abs() > 1.0, "{part}: {why}"),
            }
        }
    }
    // The greatest current of a periodic voltage: V/R (1 - e^(-D T R/L)) / (1 - e^(-T R/L)).
    let hertz = scene.clock.frequency_hz() as f64;
    let (period, of) = (4096u64, 10u64);
    let fall = |clocks: u64| -(-(clocks as f64) / hertz * ohm / motor.inductance_h).exp_m1();
    let greatest = stall_nm * fall(of) / fall(period);
    let bent = 0.9 * friction - greatest;
    // It begins without current, below the least of the period: on the other side than the limit.
    let found = held(0.0, bent, vec![(1.0, of), (0.0, period - of)]).expect("nine tenths of friction");
    near(found, 0.1, 1e-9);
    assert!(held(0.0, 1.01 * friction - greatest, vec![(1.0, of), (0.0, period - of)]).is_err());
    // From the greatest current on, a pulse takes it higher, before it dies out.
    let on = fall(of);
    let higher = stall_nm * on + greatest * (1.0 - on);
    let began = |torque: f64| {
        held(greatest / motor.torque_constant_nm_per_a, friction - torque, vec![(1.0, of), (0.0, period - of)])
    };
    assert!(began(higher - 0.01 * (higher - greatest)).is_err());
    // What is proved is the periodic current and all of the distance from it.
    let least = greatest * (1.0 - fall(period - of));
    assert!(began(1.01 * (greatest + greatest - least)).is_ok());
}

#[test]
fn runs_that_are_known_to_repeat_are_found_beyond_their_end() {
    // From, and period: found once by a run of 30 s that compared all registers (the figures are those of its author).
    for (name, from_s, period_s) in [
        ("hybrid-wall", 1.4989, 0.768),
        ("conventional-wall-10khz", 2.8068 - 1.2288, 1.2288),
        ("friction-wall", 3.985 - 0.768, 0.768),
    ] {
        let asked = experiment(name, &[]);
        let summary = looked_on(&asked, Driver::Events, 10.0);
        let Some(Ok(Forever::Recurs { recurrence, rms_counts, model_counts })) = summary.forever else {
            panic!("{name}: {:?}", summary.forever)
        };
        let Recurrence { from, period } = recurrence;
        let [from, period] = [from, period].map(|edges| edges as f64 * asked.clock.period_s());
        near(period, period_s, 1e-9);
        near(from, from_s, 1e-4);
        assert!((0.01..0.3).contains(&rms_counts) && summary.is_settled_for_ever(), "{name}: {rms_counts}");
        match model_counts {
            Ok(within) => assert!(name != "friction-wall" && (1e-24..1e-16).contains(&within), "{name}: {within:e}"),
            Err(why) => assert_eq!([name, why], ["friction-wall", "friction has not caught the shaft"]),
        }
        // The same run to its end, and by clock.
        let simulation = WiredSimulation::new(&asked).expect("it is shipped");
        let mut trace = simulation.verdict_trace();
        let plain = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        assert_eq!(Summary { forever: None, wall_s: 0.0, ..summary }, Summary { wall_s: 0.0, ..plain }, "{name}");
    }
}

#[test]
fn a_period_in_which_rounding_may_decide_tells_nothing_of_real_numbers() {
    let scene = axis("hybrid-wall", &[]);
    let period = Period { edges: 4096, events: 4, mode_changes: 0, redecided: 0, angle_rad: 1.5 };
    let within = follows(&scene, &period).expect("a short period");
    // At least the rounding of one flow of the angle, and for no more flows less.
    assert!(within > 2f64.powi(-95) * 1.5 / scene.encoder.count_rad(), "{within:e}");
    // The slowest deviation decays with 141 1/s , so 60 periods halve it.
    let flows = 2.0 * 4.0 + 4.0;
    assert!(within > 2.0 * 60.0 * flows * 2f64.powi(-95) * 2.0 * 1.5 / scene.encoder.count_rad(), "{within:e}");
    let busy = follows(&scene, &Period { events: 4000, ..period }).expect("a thousand times as many");
    assert!(busy > 100.0 * within, "{busy:e} of {within:e}");
    for (changed, why) in [
        (Period { redecided: 1, ..period }, "a count arrives so near"),
        (Period { mode_changes: 1, ..period }, "a mode ends"),
        (Period { events: 1 << 50, ..period }, "rounding in a period"),
        (Period { angle_rad: f64::NAN, ..period }, "rounding in a period"),
    ] {
        let said = follows(&scene, &changed).expect_err(why);
        assert!(said.contains(why), "{said}");
    }
    for (key, value, why) in [
        ("method.pwm.dead_time", "\"200 ns\"", "the winding is open"),
        ("method.pwm.off", "\"float\"", "the winding is open"),
        ("device.coulomb_friction", "\"1 mN.m\"", "friction"),
        ("hand.stiffness", "0", "no hand's spring"),
    ] {
        let said = follows(&axis("hybrid-wall", &[(key, value.into())]), &period).expect_err(why);
        assert!(said.contains(why), "{key}: {said}");
    }
}

/// Runs `hybrid-wall` and `friction-wall` at stiffnesses and dampings; where no count is to arrive any more, compares
/// with runs ten times as long. Returns how many of the settled cells are told, and all settled.
fn told(name: &str, stiffnesses: u32, dampings: u32) -> [u32; 3] {
    let (mut quiet, mut repeats, mut settled) = (0, 0, 0);
    for row in 0..stiffnesses {
        let stiffness = 0.1 * 60f64.powf(f64::from(row) / f64::from(stiffnesses - 1));
        for column in 0..dampings {
            let damping = 0.4e-3 * f64::from(column) / f64::from((dampings - 1).max(1));
            let set = [("wall.stiffness", format!("{stiffness:?}")), ("wall.damping", format!("{damping:?}"))];
            let cell = experiment(name, &set);
            let summary = looked_on(&cell, Driver::Events, 8.0);
            settled += u32::from(summary.outcome() == Some(OutcomeKind::Settled));
            match summary.forever.as_ref().expect("it was asked") {
                Ok(Forever::Quiet(found)) => {
                    quiet += 1;
                    assert!(summary.is_settled_for_ever(), "{stiffness} {damping}: a wall at rest has settled");
                    assert!(!comes_after(name, &set, found.from_edge), "{stiffness} {damping}: a count arrived");
                }
                Ok(Forever::Recurs { .. }) => repeats += u32::from(summary.is_settled_for_ever()),
                _ => {}
            }
        }
    }
    [quiet, repeats, settled]
}

#[test]
fn where_no_count_is_to_come_none_comes_in_a_run_ten_times_as_long() {
    let [quiet, repeats, settled] = told("hybrid-wall", 4, 3);
    assert!(quiet >= 3 && quiet + repeats + 2 >= settled && settled >= 8, "{quiet} {repeats} of {settled}");
    // The ripple breaks the shaft loose twice a period, and each period is the one before to the last bit.
    let [quiet, repeats, settled] = told("friction-wall", 2, 2);
    assert_eq!([quiet, repeats], [0, settled]);
}

/// The grids of 80 cells.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn of_three_grids_of_eighty_cells_all_but_five_that_settle_do_so_for_ever() {
    let [quiet, repeats, settled] = told("hybrid-wall", 16, 5);
    println!("hybrid-wall: {quiet} quiet, {repeats} repeat, {settled} settled");
    assert!(quiet == 29 && quiet + repeats >= 59 && settled == 64, "{quiet} {repeats} of {settled}");
    let [quiet, repeats, settled] = told("conventional-wall-10khz", 16, 5);
    println!("conventional-wall-10khz: {quiet} quiet, {repeats} repeat, {settled} settled");
    assert!(quiet + repeats == settled && settled == 66, "{quiet} {repeats} of {settled}");
    let [quiet, repeats, settled] = told("friction-wall", 16, 5);
    println!("friction-wall: {quiet} quiet, {repeats} repeat, {settled} settled");
    assert!(quiet + repeats == settled && settled == 77, "{quiet} {repeats} of {settled}");
}

/// Returns whether a count arrives after the edge from which on none is to come, in a run ten times as long.
fn comes_after(name: &str, set: &[(&str, String)], from_edge: u64) -> bool {
    let at_s = experiment(name, set).clock.seconds(Cycle(from_edge));
    let [short, long] = [at_s, 10.0 * at_s].map(|duration| {
        let longer = [set, &[("run.duration", format!("{duration:?}"))]].concat();
        let longer = experiment(name, &longer);
        let simulation = WiredSimulation::new(&longer).expect("a cell");
        let mut trace = simulation.verdict_trace();
        simulation.run(Driver::Events, &mut trace, &mut (), &Control::default()).encoder_edges
    });
    short != long
}

/// Scenes at random: their walls, hands, wheels, friction, supplies, encoders and modulators.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn of_ten_thousand_scenes_at_random_no_count_comes_where_none_is_to_come() {
    const SCENES: u64 = 16_000;
    let names = ["hybrid-wall", "conventional-wall-10khz", "friction-wall", "coupled-wall", "bounded-wall", "slow-pwm"];
    // Runs, and of them those that cannot be read, at rest, held by friction, that repeat, and of these also without
    // rounding.
    let tally = Mutex::new([0u32; 5]);
    std::thread::scope(|scope| {
        for half in 0..2 {
            let tally = &tally;
            scope.spawn(move || {
                for number in (half..SCENES).step_by(2) {
                    let mut mixed = number;
                    // Splitmix64 (Steele, Lea, Flood 2014).
                    let mut share = || {
                        mixed = mixed.wrapping_add(0x9e37_79b9_7f4a_7c15);
                        let mut z = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
                        ((z ^ (z >> 31)) >> 11) as f64 / 2f64.powi(53)
                    };
                    let name = names[(share() * names.len() as f64) as usize];
                    let mut between = |low: f64, high: f64| format!("{:?}", low * (high / low).powf(share()));
                    let mut set = vec![
                        ("wall.stiffness", between(0.1, 6.0)),
                        ("hand.stiffness", between(0.05, 2.0)),
                        ("hand.damping", between(1e-6, 1e-3)),
                        ("device.wheel_ratio", between(3.0, 20.0)),
                        ("bridge.supply", between(5.0, 50.0)),
                        ("run.duration", between(0.6, 1.5)),
                        ("encoder.lines", format!("{:.0}", between(200.0, 20000.0).parse::<f64>().expect("a number"))),
                    ];
                    if share() < 0.5 {
                        set.push(("wall.damping", "0".into()));
                    }
                    if share() < 0.3 {
                        set.push(("device.coulomb_friction", format!("{:?}", 1e-5 * 300f64.powf(share()))));
                    }
                    if share() < 0.3 {
                        set.push(("method.pwm.mode", "\"locked_antiphase\"".into()));
                    }
                    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
                    let owned: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), value.clone())).collect();
                    let Ok(cell) = scene.parse(&owned) else {
                        tally.lock().expect("no thread fails")[0] += 1;
                        continue;
                    };
                    let kind = match looked_on(&cell, Driver::Events, 1.0).forever {
                        Some(Ok(Forever::Quiet(found))) => {
                            assert!(!comes_after(name, &set, found.from_edge), "{name} {set:?}: a count arrived");
                            1 + usize::from(found.is_stuck)
                        }
                        Some(Ok(Forever::Recurs { model_counts, .. })) => 3 + usize::from(model_counts.is_ok()),
                        _ => continue,
                    };
                    tally.lock().expect("no thread fails")[kind] += 1;
                }
            });
        }
    });
    let [refused, quiet, stuck, repeats, without] = *tally.lock().expect("no thread fails");
    let run = SCENES as u32 - refused;
    println!("{run} scenes: {quiet} quiet, {stuck} held, {repeats} and {without} repeat; {refused} refused");
    assert!(run > 10_000 && quiet > 500 && stuck > 100, "{run} run, {quiet} quiet, {stuck} held");
}

#[test]
fn what_is_planned_or_not_compared_is_told_and_nothing_else() {
    let late = [("hand.path", r#"[["0 s", 0], ["150 ms", 1.4], ["3 s", 1.9]]"#.to_string())];
    let jitter = [("faults.clock_jitter", "\"1 ns\"".to_string())];
    for (name, set, why) in [
        ("hybrid-wall", &late[..], "the hand moves on"),
        ("hybrid-wall", &jitter[..], "a fault"),
        ("hybrid-wall", &[("hand.stiffness", "0".to_string())][..], "no count or pulse comes"),
        ("phantom-thrown", &[][..], "only an axis"),
        ("replay-capture", &[][..], "a recording"),
    ] {
        let summary = looked_on(&experiment(name, set), Driver::Events, 10.0);
        let Some(Err(said)) = &summary.forever else { panic!("{name}: {:?}", summary.forever) };
        assert!(said.contains(why) && !summary.is_settled_for_ever(), "{name}: {said}");
    }
}
