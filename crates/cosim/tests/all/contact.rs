//! The share of the judged window in which the wall is touched, on motions whose contact can be computed by hand.

use std::f64::consts::TAU;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Summary, Wired, WiredSimulation};
use hpu_signal::{Cycle, Observe};

fn scene(name: &str, overrides: &[(&str, &str)]) -> Experiment {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn run(scene: &Experiment, driver: Driver) -> Summary {
    let simulation = WiredSimulation::new(scene).unwrap();
    simulation.run(driver, &mut simulation.brief_trace(), &mut (), &Control::default())
}

fn share(name: &str, overrides: &[(&str, &str)]) -> f64 {
    run(&scene(name, overrides), Driver::Events).contact_share.expect("a complete run of a device")
}

/// An encoder of 1024 lines, decoded x4.
const COUNT_RAD: f64 = TAU / 4096.0;
/// `prescribed-sweep`: 55e6 clock edges, with a row every 5000. Of 11001 rows the last 3300 are judged, from row 7701
/// on.
const WINDOW: (f64, f64) = (38_505_000.0, 55_000_000.0);

/// Returns the share of the window up to a time of the sweep, and the share of one clock edge.
fn until(time_s: f64) -> (f64, f64) {
    let length = WINDOW.1 - WINDOW.0;
    ((time_s * 50e6 - WINDOW.0) / length, 1.0 / length)
}

#[test]
fn a_prescribed_sweep_is_in_contact_until_its_count_leaves_the_wall() {
    // The wall at 1.5 rad is count 978. The sweep comes back at 1 rad/s, from 1.9 rad after 0.5 s. It leaves count 979,
    // the first with penetration, when its angle falls below 979 counts. The counter and the wall follow within 4
    // edges.
    let leaves_s = 0.5 + 1.9 - 979.0 * COUNT_RAD;
    let (expected, edge) = until(leaves_s);
    let found = share("prescribed-sweep", &[]);
    assert!((0.0..=5.0 * edge).contains(&(found - expected)), "{found}, expected {expected}");
}

#[test]
fn a_held_position_is_in_contact_until_the_next_sample() {
    // Sampled at 1 kHz from the first edge on: the sample at 0.899 s is the first after the crossing at 0.89823 s.
    let (expected, edge) = until(0.899);
    let found = share("prescribed-sweep", &[("method.kind", "conventional")]);
    assert!((found - expected).abs() <= 2.0 * edge, "{found}, expected {expected}");
}

#[test]
fn the_device_itself_is_in_contact_until_its_count_leaves_the_wall_whatever_the_logic_holds() {
    // The wall's surface is where count 978 begins.
    let (expected, edge) = until(0.5 + 1.9 - 978.0 * COUNT_RAD);
    for method in ["hybrid", "conventional"] {
        let summary = run(&scene("prescribed-sweep", &[("method.kind", method)]), Driver::Events);
        let found = summary.device_contact_share.expect("an axis");
        assert!((found - expected).abs() <= edge, "{method}: {found}, expected {expected}");
    }
    // At 1 kHz the logic misses a fifth of the contact of a wall that buzzes.
    let buzzing = run(&scene("conventional-wall-1khz", &[]), Driver::Events);
    let percent = |share: Option<f64>| share.map(|share| (1000.0 * share).round() / 10.0);
    assert_eq!((percent(buzzing.contact_share), percent(buzzing.device_contact_share)), (Some(37.5), Some(46.9)));
}

#[test]
fn without_a_clock_contact_is_time_beyond_the_wall() {
    // With the true angle as the law's input, the wall is left at 1.5 rad, after 0.9 s.
    let steps =
        [("model.datapath", "law"), ("model.bridge", "averaged"), ("model.solver", "rk4"), ("model.step", "130 us")];
    let ideal = [&steps[..], &[("model.encoder", "ideal")]].concat();
    assert!((share("prescribed-sweep", &ideal) - until(0.9).0).abs() < 1e-9);
    // With counts, the wall is left at the first count inside it.
    let leaves_s = 0.5 + 1.9 - 979.0 * COUNT_RAD;
    assert!((share("prescribed-sweep", &steps) - until(leaves_s).0).abs() < 1e-9);
}

/// Edges of the window in which the net stands above 0, counted edge by edge.
struct EveryEdge {
    net: usize,
    from: u64,
    last: (u64, bool),
    edges: u64,
}

impl Observe for EveryEdge {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        let (from, inside) = self.last;
        self.edges += (from..cycle.0).filter(|edge| inside && *edge >= self.from).count() as u64;
        self.last = (cycle.0, words[self.net] > 0);
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

#[test]
fn both_drivers_count_the_same_edges_as_a_look_at_every_edge() {
    // A motion that bounces in and out of the wall.
    let set = [("run.duration", "60 ms"), ("hand.path", "[[0, 1.5], [\"30 ms\", 1.6], [\"58 ms\", 1.44]]")];
    let set = [&set[..], &[("device.initial_angle", "1.5")]].concat();
    let Experiment::Axis(scene) = scene("hybrid-wall", &set) else { unreachable!() };
    let simulation = AxisSimulation::new(&scene).unwrap();
    let net = simulation.nets().iter().position(|net| net.name == "penetration").unwrap();
    for driver in [Driver::Events, Driver::Clock] {
        // The last 180 of 601 rows are judged.
        let mut every = EveryEdge { net, from: 421 * 5000, last: (0, false), edges: 0 };
        let summary = simulation.run(driver, &mut simulation.brief_trace(), &mut every, &Control::default());
        every.nets(Cycle(summary.edges), &[0; 64]);
        assert!(every.edges > 0 && every.edges < 179 * 5000, "in and out: {}", every.edges);
        let expected = every.edges as f64 / (3_000_000 - 421 * 5000) as f64;
        assert_eq!(summary.contact_share, Some(expected), "{driver:?}");
    }
}

#[test]
fn a_hand_in_free_air_has_no_contact_and_a_leaning_one_has_nothing_else() {
    let air = ("hand.path", "[[\"0 s\", 0], [\"150 ms\", 1.4]]");
    assert_eq!(share("hybrid-wall", &[air]), 0.0);
    assert_eq!(share("hybrid-wall", &[]), 1.0);
    assert_eq!(share("conventional-wall-10khz", &[air]), 0.0);
    let law = [("model.datapath", "law"), ("model.bridge", "averaged")];
    let rk4 = [("model.solver", "rk4"), ("model.step", "100 us")];
    for set in [&law[..], &[&law[..], &rk4].concat(), &[&law[1..], &rk4].concat()] {
        assert_eq!(share("hybrid-wall", &[set, &[air]].concat()), 0.0, "{set:?}");
        assert_eq!(share("hybrid-wall", set), 1.0, "{set:?}");
    }
}

#[test]
fn a_drop_test_reaches_its_wall_by_its_weight_alone() {
    let short = ("run.duration", "1 s");
    for platform in ["FPGA-20", "RTOS-1"] {
        let kind = ("platform.kind", platform);
        let found = share("phantom-drop", &[kind, short, ("drop.weight", "0 N")]);
        assert_eq!(found, 0.0, "{platform}");
        // The weight falls 2 cm in half a second, then bounces or lies on the wall.
        let found = share("phantom-drop", &[kind, ("run.duration", "2 s")]);
        assert!(found > 0.0, "{platform}: {found}");
    }
}
