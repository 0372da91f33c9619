//! Means and extremes between the rows of a trace, against the same run with a row at every clock edge.
//!
//! The trapezoid over edges `h` apart errs from the mean of an output by at most `h² M / 12`, `M` being the greatest
//! second derivative; a stationary point lies at most `h² M / 8` beyond the samples beside it. Where a mode ends within
//! an edge, the slope jumps by at most twice its greatest size `S`. This adds `h² S / 4` to the error of the trapezoid,
//! and `h S` to that of an extreme. `M` and `S` follow from the equations of motion and from the greatest states.

use hpu_cosim::scene::{Device, Experiment, Hand, Scene, shipped};
use hpu_cosim::{AXIS_ROW, Control, Driver, Simulation, Summary, Wired, WiredSimulation};
use hpu_signal::{Cycle, Observe};

/// Columns of an axis's row.
const CURRENT: usize = 0;
const SPEED: usize = 1;
const TORQUE: usize = 3;
const HAND: usize = 14;

/// All rows of a run, with means and extremes if asked for.
#[derive(Default)]
struct Table {
    measures: bool,
    /// Columns that are not read.
    unread: std::ops::Range<usize>,
    edges: Vec<u64>,
    rows: Vec<Vec<f64>>,
}

impl Observe for Table {
    fn measures(&self) -> bool {
        self.measures
    }
    fn reads(&self, columns: std::ops::Range<usize>) -> bool {
        columns.start < self.unread.start || columns.end > self.unread.end
    }
    fn follows(&self, _: std::ops::Range<usize>) -> bool {
        false
    }
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.edges.push(cycle.0);
        self.rows.push(values.to_vec());
    }
}

fn parsed(name: &str, overrides: &[(&str, &str)]) -> Experiment {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn table(scene: &Experiment, driver: Driver, measures: bool) -> (Table, Summary) {
    let simulation = WiredSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut table = Table { measures, ..Table::default() };
    let summary = simulation.run(driver, &mut simulation.brief_trace(), &mut table, &Control::default());
    (table, summary)
}

/// The same run with rows at a rate, and with a row at every edge.
struct Both {
    rows: Table,
    dense: Table,
    summary: Summary,
    edge_s: f64,
    period: Option<u64>,
}

impl Both {
    fn of(name: &str, rate: &str, changes: &[(&str, &str)]) -> (Experiment, Self) {
        let at = |rate| parsed(name, &[changes, &[("record.plant_rate", rate)]].concat());
        let scene = at(rate);
        let clock = WiredSimulation::new(&scene).unwrap().clock();
        let (rows, summary) = table(&scene, Driver::Events, true);
        let (dense, _) = table(&at(&format!("{} Hz", clock.frequency_hz())), Driver::Events, false);
        assert!(dense.edges.iter().zip(0..).all(|(edge, index)| *edge == index), "a row at every edge");
        assert!(rows.rows.len() > 4, "{} rows", rows.rows.len());
        let period = scene.clone().axis().and_then(|scene| {
            let switches = WiredSimulation::new(&Experiment::Axis(scene.clone())).unwrap().gates_drive();
            switches.then(|| 1 << scene.method.pwm.bits)
        });
        (scene, Self { rows, dense, summary, edge_s: clock.period_s(), period })
    }

    /// Returns the edges between which a mean is taken: periods of the modulator begin at the edges after its
    /// multiples.
    fn window(&self, row: usize) -> (u64, u64) {
        let (before, now) = (self.rows.edges[row - 1], self.rows.edges[row]);
        let Some(period) = self.period else { return (before, now) };
        let begun = |edge: u64| (0..=edge).rev().find(|edge| edge % period == 1).unwrap_or(0);
        let (first, last) = (begun(before), begun(now));
        if first < last { (first, last) } else { (before, now) }
    }

    /// Compares mean, least and greatest value, three columns from `at` on, of output `of` with the samples. If `held`
    /// is set, the output moves in steps, from edge to edge.
    #[track_caller]
    fn hold(&self, of: usize, at: usize, [bend, slope]: [f64; 2], held: bool) {
        let h = self.edge_s;
        let x = |edge: u64| self.dense.rows[edge as usize][of];
        let kinks = self.summary.mode_changes as f64;
        let kink = if kinks > 0.0 { h * slope } else { 0.0 };
        for row in 1..self.rows.rows.len() {
            let &[mean, least, greatest] = &self.rows.rows[row][at..at + 3] else { unreachable!() };
            let (from, to) = self.window(row);
            let sum: f64 = (from..to).map(|edge| if held { x(edge) } else { 0.5 * (x(edge) + x(edge + 1)) }).sum();
            let span = (self.rows.edges[row - 1]..=self.rows.edges[row]).map(x);
            let (low, high) = span.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
            let size = 1e-11 * low.abs().max(high.abs());
            let sampled = sum / (to - from) as f64;
            let allowed = h * h * (bend / 12.0 + 0.25 * slope * kinks / ((to - from) as f64 * h)) + size;
            assert!(
                (mean - sampled).abs() <= allowed,
                "row {row}: mean {mean:e}, sampled {sampled:e}, allowed {allowed:e}"
            );
            let beyond = 0.125 * h * h * bend + kink + size;
            assert!(least <= low + size && least >= low - beyond, "row {row}: least {least:e}, sampled {low:e}");
            assert!(greatest >= high - size && greatest <= high + beyond, "row {row}: greatest {greatest:e}, {high:e}");
        }
    }

    fn greatest(&self, table: &Table, of: usize) -> f64 {
        table.rows.iter().map(|row| row[of].abs()).fold(0.0, f64::max)
    }

    /// Checks all columns of the rows of an axis.
    #[track_caller]
    fn hold_axis(&self, scene: &Scene, held: bool) {
        let [current, speed] = self.bounds(scene);
        self.hold(CURRENT, 4, current, held);
        self.hold(SPEED, 7, speed, false);
        for row in &self.rows.rows {
            for (torque, current) in [TORQUE, 10, 11, 12].into_iter().zip([CURRENT, 4, 5, 6]) {
                let Device::Motor(motor) = scene.device else { continue };
                assert!((row[torque] - motor.torque_constant_nm_per_a * row[current]).abs() <= 1e-15);
            }
        }
    }

    /// Returns the greatest second derivative and slope of current and speed, from `L i' = V - R i - K ω` and `J ω' = K
    /// i - B ω - τ_c ± τ_h`.
    fn bounds(&self, scene: &Scene) -> [[f64; 2]; 2] {
        let [i, w] = [CURRENT, SPEED].map(|of| self.greatest(&self.dense, of));
        let (hand_nm, hand) = (2.0 * self.greatest(&self.rows, HAND), scene.hand.clone());
        let (k_h, b_h, path) = match hand {
            Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, path } => {
                let rate = |pair: &[_]| -> f64 { speed_of(pair) };
                let fastest = path.windows(2).map(rate).fold(0.0, f64::max);
                (stiffness_nm_per_rad, damping_nm_s_per_rad, fastest)
            }
            _ => (0.0, 0.0, 0.0),
        };
        let (r, l, k, j, b, c) = match &scene.device {
            Device::Motor(m) => {
                let r = m.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
                let (b, c) = (m.viscous_friction_nm_s_per_rad, m.coulomb_friction_nm);
                (r, m.inductance_h, m.torque_constant_nm_per_a, m.inertia_kg_m2(), b, c)
            }
            Device::Mass(m) => (0.0, f64::INFINITY, 1.0, m.mass_kg, m.damping_n_s_per_m, m.coulomb_n),
        };
        let volts = scene.bridge.supply_v + 2.0 * scene.bridge.diode_drop_v;
        let i_slope = (volts + r * i + k * w) / l;
        let w_slope = (k * i + b * w + c + hand_nm) / j;
        let i_bend = (r * i_slope + k * w_slope) / l;
        let w_bend = (k * i_slope + (b + b_h) * w_slope + k_h * (w + path)) / j;
        [[i_bend, i_slope], [w_bend, w_slope]]
    }
}

fn speed_of(pair: &[hpu_cosim::scene::PathPoint]) -> f64 {
    ((pair[1].angle_rad - pair[0].angle_rad) / (pair[1].time_s - pair[0].time_s)).abs()
}

/// Leaning on the wall from the start, so that the modulator works.
const LEANING: [(&str, &str); 3] =
    [("device.initial_angle", "1.55 rad"), ("hand.path", "[[\"0 s\", 1.8]]"), ("run.duration", "4 ms")];

#[track_caller]
fn axis(name: &str, rate: &str, changes: &[(&str, &str)], held: bool) -> Both {
    let (scene, both) = Both::of(name, rate, changes);
    both.hold_axis(&scene.axis().unwrap(), held);
    both
}

#[test]
fn means_and_extremes_are_those_of_a_row_at_every_edge() {
    let leaning = |more: &[(&'static str, &'static str)]| [&LEANING[..], more].concat();
    // Rows that beat with the modulator, rows of several periods (on a cruise too), and rows shorter than a period.
    for rate in ["10 kHz", "1 kHz", "80 kHz"] {
        let both = axis("hybrid-wall", rate, &LEANING, false);
        let least = both.rows.rows.iter().map(|row| row[11]).fold(0.0, f64::min);
        assert!(least < -0.02, "{rate}: it pushes back, {least}");
    }
    axis("hybrid-wall", "10 kHz", &leaning(&[("method.pwm.mode", "locked_antiphase")]), false);
    axis("thrown-conventional", "10 kHz", &[("run.duration", "4 ms")], false);
    axis("hybrid-wall", "10 kHz", &leaning(&[("model.bridge", "averaged")]), false);
    let rubbing = axis("friction-wall", "10 kHz", &leaning(&[("run.duration", "8 ms")]), false);
    assert!(rubbing.summary.mode_changes > 4, "it sticks and slips: {}", rubbing.summary.mode_changes);
    let stuck = axis("friction-wall", "10 kHz", &leaning(&[("device.coulomb_friction", "0.2 N.m")]), false);
    assert!(stuck.rows.rows.iter().skip(1).all(|row| row[8] == 0.0 && row[9] == 0.0), "it stands still");
    axis("rail-drop", "10 kHz", &[("device.initial_position", "2.01 cm"), ("run.duration", "8 ms")], true);
}

#[test]
fn means_and_extremes_of_steps_are_those_of_their_straight_lines() {
    let stepped = [("model.solver", "rk4"), ("model.step", "1 us")];
    axis("hybrid-wall", "10 kHz", &[&LEANING[..], &stepped].concat(), false);
    let law =
        [("model.solver", "rk4"), ("model.step", "7 us"), ("model.bridge", "averaged"), ("model.datapath", "law")];
    axis("hybrid-wall", "10 kHz", &[&LEANING[..], &law].concat(), false);
}

#[test]
fn a_phantoms_rows_tell_means_and_extremes_of_its_motors() {
    // The motor follows its command through a first-order lag `T`: τ'' = (u - τ) / T² at most, and u is at most full
    // scale.
    let lag_s = 0.4e-3;
    let full_nm = [115.0 / 15.0, 7.0, 7.0].map(|ratio| 0.17 * ratio);
    let short = ("run.duration", "6 ms");
    for (changes, lagging) in [(&[short][..], true), (&[short, ("model.amplifier_lag", "0 s")], false)] {
        let (_, mut both) = Both::of("phantom-thrown", "10 kHz", changes);
        // The end of a mode does not bend a torque.
        both.summary.mode_changes = 0;
        for (joint, full_nm) in full_nm.iter().enumerate() {
            let most = 2.0 * full_nm / lag_s;
            let bounds = if lagging { [most / lag_s, most] } else { [0.0; 2] };
            both.hold(6 + joint, 9 + 3 * joint, bounds, !lagging);
        }
        assert!(both.greatest(&both.rows, 7) > 1e-3, "the wall pushes back");
    }
}

#[test]
fn both_drivers_tell_the_same_to_the_bit() {
    let cases: [(&str, &[(&str, &str)]); 6] = [
        ("hybrid-wall", &LEANING),
        ("friction-wall", &LEANING),
        ("thrown-conventional", &[("run.duration", "4 ms")]),
        ("rail-drop", &[("device.initial_position", "2.01 cm"), ("run.duration", "8 ms")]),
        ("phantom-thrown", &[("run.duration", "4 ms")]),
        ("two-encoder-joint", &[("run.duration", "4 ms")]),
    ];
    for (name, changes) in cases {
        for rate in ["10 kHz", "1 kHz", "2 MHz"] {
            let scene = parsed(name, &[changes, &[("record.plant_rate", rate)]].concat());
            let [events, clock] = [Driver::Events, Driver::Clock].map(|driver| table(&scene, driver, true).0);
            assert_eq!(events.edges, clock.edges, "{name}");
            for (row, (one, other)) in events.rows.iter().zip(&clock.rows).enumerate() {
                let bits = |row: &Vec<f64>| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(one), bits(other), "{name} at {rate}, row {row}: {one:?} {other:?}");
            }
        }
    }
}

#[test]
fn columns_that_are_read_have_the_same_bits_whatever_others_are() {
    let first = AXIS_ROW.iter().position(|real| real.name == "speed_mean_rad_per_s").unwrap();
    let unread = first..first + 3;
    for (name, changes) in [
        ("hybrid-wall", &[][..]),
        ("hybrid-wall", &[("model.bridge", "averaged")]),
        ("friction-wall", &[]),
        ("rail-drop", &[]),
    ] {
        let scene = parsed(name, &[changes, &[("run.duration", "300 ms"), ("record.plant_rate", "1 kHz")]].concat());
        let simulation = WiredSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let told = |unread| {
            let mut table = Table { measures: true, unread, ..Table::default() };
            simulation.run(Driver::Events, &mut simulation.brief_trace(), &mut table, &Control::default());
            table.rows
        };
        let (all, some) = (told(0..0), told(unread.clone()));
        assert_eq!(all.len(), 301, "{name}");
        for (row, (all, some)) in all.iter().zip(&some).enumerate() {
            for (column, (x, y)) in all.iter().zip(some).enumerate() {
                let is_same = x.to_bits() == y.to_bits();
                assert!(is_same || unread.contains(&column), "{name}, row {row}, column {column}: {x} is not {y}");
            }
        }
    }
}

#[test]
fn the_mean_torque_does_not_beat_with_the_modulator() {
    // 50 MHz / 4096 = 12 207 Hz, sampled at 10 kHz, beats at 2207 Hz.
    let beat_hz = 50e6 / 4096.0 - 10e3;
    let scene = parsed(
        "hybrid-wall",
        &[("device.initial_angle", "1.55 rad"), ("hand.path", "[[\"0 s\", 1.8]]"), ("run.duration", "0.3 s")],
    );
    let (table, _) = table(&scene, Driver::Events, true);
    let mean = AXIS_ROW.iter().position(|column| column.name == "torque_mean_nm").unwrap();
    // The last 0.1 s, through a window that falls to 0 at both ends.
    let amplitude = |of: usize| {
        let rows = &table.rows[table.rows.len() - 1000..];
        let all = rows.iter().map(|row| row[of]).sum::<f64>() / 1000.0;
        let (mut re, mut im) = (0.0, 0.0);
        for (k, row) in rows.iter().enumerate() {
            let hann = 1.0 - (std::f64::consts::TAU * k as f64 / 1000.0).cos();
            let phase = std::f64::consts::TAU * beat_hz * k as f64 * 1e-4;
            re += hann * (row[of] - all) * phase.cos();
            im += hann * (row[of] - all) * phase.sin();
        }
        2.0 * re.hypot(im) / 1000.0
    };
    let (sampled, averaged) = (amplitude(TORQUE), amplitude(mean));
    assert!(sampled > 5e-3, "the samples beat: {sampled}");
    // At most a hundredth of the beat: the rest is the motion of the wheel between two counts.
    assert!(averaged < 1e-2 * sampled, "{averaged} of {sampled}");
}

#[test]
fn a_run_knows_the_exact_means_of_its_end() {
    // The means over the whole window, in rows of 0.1 ms, from the rows' columns; both windows end with the run and
    // begin at a row.
    let still = [("model.bridge", "averaged"), ("run.duration", "40 ms")];
    let direct = [("model.solver", "rk4"), ("model.step", "7 us"), ("model.datapath", "law")];
    for more in [&[][..], &direct] {
        let scene = parsed("hybrid-wall", &[&LEANING[..2], &still, more].concat());
        let (table, summary) = table(&scene, Driver::Events, true);
        // The last three tenths of 401 rows are 120, and 119 times between them.
        let rows = &table.rows[table.rows.len() - 119..];
        let mean = |of: usize| rows.iter().map(|row| row[of]).sum::<f64>() / rows.len() as f64;
        let [torque_nm, angle_rad] = summary.averages.expect("an axis");
        assert!((torque_nm - mean(10)).abs() < 1e-9 * torque_nm.abs(), "{torque_nm}, rows {}", mean(10));
        // For the angle the rows have samples: their trapezoid errs by h^2 / 12 of the greatest acceleration.
        let ends = 0.5 * (table.rows[table.rows.len() - 120][2] - rows[118][2]) / 119.0;
        assert!((angle_rad - mean(2) - ends).abs() < 1e-8 * 1e4 / 12.0, "{angle_rad}, rows {}", mean(2) + ends);
    }
}

#[test]
fn the_hands_torque_does_the_hands_work() {
    // By the trapezoid over every edge: within a millionth of the energy exchanged.
    let leaning = |more: &[(&'static str, &'static str)]| [&LEANING[..], more].concat();
    let cases = [
        ("hybrid-wall", leaning(&[])),
        ("hybrid-wall", leaning(&[("model.solver", "rk4"), ("model.step", "1 us")])),
        ("rail-drop", vec![("device.initial_position", "2.01 cm"), ("run.duration", "4 ms")]),
        ("prescribed-sweep", vec![("run.duration", "4 ms")]),
    ];
    for (name, changes) in cases {
        let clock = WiredSimulation::new(&parsed(name, &[])).unwrap().clock();
        let scene =
            parsed(name, &[&changes[..], &[("record.plant_rate", &format!("{} Hz", clock.frequency_hz()))]].concat());
        let (table, summary) = table(&scene, Driver::Events, true);
        let power = |row: &Vec<f64>| row[HAND] * row[SPEED];
        let pairs = table.rows.windows(2);
        let work_j: f64 = pairs.map(|pair| 0.5 * clock.period_s() * (power(&pair[0]) + power(&pair[1]))).sum();
        let energy = summary.energy;
        let most = 1e-6 * energy.exchanged_j;
        assert!((work_j - energy.hand_j).abs() <= most, "{name}: {work_j} J, {} J, allowed {most}", energy.hand_j);
        assert!(work_j != 0.0, "{name}");
    }
}
