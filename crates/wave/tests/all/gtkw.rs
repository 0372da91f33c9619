//! The GTKWave save file names every variable of the waveform once, in groups that are closed again.

use hpu_cosim::WiredSimulation;
use hpu_cosim::scene::shipped;
use hpu_datapath::{ConventionalLoop, HybridLoop, LoopConfig};
use hpu_signal::{Clock, Cycle, Format, Real};
use hpu_wave::{Layout, gtkw};

const REALS: [Real; 2] = [Real { name: "angle_rad", doc: "angle" }, Real { name: "current_a", doc: "current" }];

fn save(layout: &Layout) -> String {
    gtkw(layout, "run.fst", Clock::new(50_000_000).expect("valid"), Cycle(1_000)..Cycle(51_000), None, &[])
}

fn config() -> LoopConfig {
    LoopConfig { stiffness: Format::new(false, 8, 4).expect("12 bits"), ..LoopConfig::default() }
}

/// Returns the layout of a shipped scene.
fn of_scene(name: &str) -> Layout {
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let scene = shipped.parse(&[]).expect("a scene");
    Layout::of(&WiredSimulation::new(&scene).expect("it is made ready"))
}

/// Returns the names of the traces, without the aliases under which they are shown.
fn traces(save: &str) -> Vec<&str> {
    let lines = save.lines().filter(|line| !line.starts_with(['[', '@', '-', '*']));
    lines.map(|line| line.rsplit_once("} ").map_or(line, |(_, name)| name)).collect()
}

/// Returns the two lines before the line that ends with `trace`.
fn before<'a>(save: &'a str, trace: &str) -> [&'a str; 2] {
    let lines: Vec<&str> = save.lines().collect();
    let at = lines.iter().position(|line| line.ends_with(trace)).expect("the trace");
    [lines[at - 2], lines[at - 1]]
}

#[test]
fn each_net_and_each_output_of_the_plant_has_one_trace() {
    let hybrid = Layout::new(&HybridLoop::new(config()).expect("valid"), &REALS);
    let conventional = Layout::new(&ConventionalLoop::new(config()).expect("valid"), &REALS);
    let gimbal = of_scene("gimbal-spring");
    let sheared = of_scene("gimbal-shear");
    for layout in [hybrid, conventional, gimbal, sheared] {
        let save = save(&layout);
        let mut found = traces(&save);
        found.sort_unstable();
        let top = |scope: &str| scope.ends_with("_loop") || scope == "plant";
        let names = layout.names();
        let is_net = |name: &&str| name.split_once('.').is_some_and(|(scope, net)| top(scope) && !net.contains('.'));
        let mut nets: Vec<&str> = names.iter().map(String::as_str).filter(is_net).collect();
        nets.retain(|name| !name.ends_with(".rst"));
        nets.sort_unstable();
        assert_eq!(found, nets);
    }
}

#[test]
fn the_clock_comes_first_when_it_is_recorded() {
    let layout = Layout::new(&HybridLoop::new(config()).expect("valid"), &REALS);
    assert_eq!(traces(&save(&layout))[0], "hybrid_loop.a_pin");
    assert_eq!(traces(&save(&layout.with_clock()))[0], "hybrid_loop.clk");
}

const PLANT: &str = "-Plant: torques and forces positive along the positive position";

/// Returns the groups as they are opened, and as they are closed.
fn grouped(save: &str) -> [Vec<&str>; 2] {
    let lines: Vec<&str> = save.lines().collect();
    let with = |flags| lines.windows(2).filter(|pair| pair[0] == flags).map(|pair| pair[1]).collect();
    ["@800200", "@1000200"].map(with)
}

#[test]
fn groups_open_and_close_in_the_order_of_the_signal_flow() {
    let save = save(&Layout::new(&HybridLoop::new(config()).expect("valid"), &REALS));
    let groups = ["-Encoder", "-Position", "-Torque path", "-PWM & bridge", PLANT];
    assert_eq!(grouped(&save), [groups; 2]);
}

#[test]
fn a_gimbals_groups_are_target_servos_and_switch() {
    let save = save(&of_scene("gimbal-spring"));
    assert_eq!(grouped(&save), [["-Target", "-Servos", "-Switch", "-Other", PLANT]; 2]);
    let place = |trace: &str| save.find(trace).unwrap_or_else(|| panic!("{trace}"));
    assert!(place("-Target") < place("gimbal_loop.x[") && place("gimbal_loop.rest[") < place("-Servos"));
    assert!(place("gimbal_loop.drive3[") < place("-Switch"));
    assert!(place("-Switch") < place("gimbal_loop.mode") && place("gimbal_loop.equilibrium[") < place("-Other"));
}

#[test]
fn words_are_drawn_by_their_formats() {
    let save = save(&Layout::new(&HybridLoop::new(config()).expect("valid"), &REALS));
    // GTKWave's flags: 8 binary, 4 decimal, 400 signed, 8000 steps, 10000 lines, 80000 scaled to the whole run,
    // 40000000 fixed point, 20 right-justified.
    assert_eq!(before(&save, "hybrid_loop.a_pin")[1], "@28");
    assert_eq!(before(&save, "hybrid_loop.step[1:0]")[1], "@420");
    assert_eq!(before(&save, "hybrid_loop.reference[11:0]")[1], "@24");
    assert_eq!(before(&save, "hybrid_loop.spring[11:0]")[1], "@88024");
    assert_eq!(before(&save, "hybrid_loop.position[11:0]")[1], "@88420");
    assert_eq!(before(&save, "hybrid_loop.torque[13:0]")[1], "@88420");
    assert_eq!(before(&save, "hybrid_loop.stiffness[11:0]"), ["@40000024", "[fpshift_count] 4"]);
    assert_eq!(before(&save, "plant.angle_rad")[1], "@90420");
}

#[test]
fn the_window_opens_on_the_span() {
    let save = save(&Layout::new(&HybridLoop::new(config()).expect("valid"), &REALS));
    assert!(save.contains("\n[timestart] 20000\n"), "1000 edges of 20 ns, in ns");
    let zoom: f64 =
        save.lines().find_map(|line| line.strip_prefix('*')?.split(' ').next()?.parse().ok()).expect("a zoom");
    let pixels = 50_000.0 * 20.0 / (-zoom).exp2() * 200.0;
    // 1500 pixels less a tree of 280 and names of 340 leave 880 for the waves and their frame.
    assert!((800.0..880.0).contains(&pixels), "{pixels} pixels");
}

#[test]
fn a_comparison_with_vhdl_comes_first_and_its_first_difference_is_marked() {
    let layout = Layout::new(&HybridLoop::new(config()).expect("valid"), &REALS).with_comparison();
    let clock = Clock::new(50_000_000).expect("valid");
    let save = gtkw(&layout, "run.fst", clock, Cycle(0)..Cycle(100), Some(Cycle(7)), &[]);
    // Edge 7 at 50 MHz is at 140 ns, and GTKWave counts nanoseconds.
    assert!(save.lines().any(|line| line.starts_with('*') && line.ends_with(" 140")), "{save}");
    assert_eq!(traces(&save)[0], "comparison.differs");
}
