#![doc = include_str!("../README.md")]

mod bits;
mod devices;
mod diagram;
mod drawing;
mod drop;
mod error_by_width;
mod fit;
mod gimbal;
mod limits;
mod log_beside;
mod map;
mod motion;
mod papers;
mod ranges;
mod side_by_side;
mod speed;
mod stiffness_by_cost;
pub mod web;

use hpu_cosim::dut::DutSimulation;
use hpu_cosim::scene::{Datapath, Loop, LoopWords, Scene, Setup, Units};
use hpu_cosim::{Simulation, Summary, Trace, Verdict};
use hpu_signal::Signal;

use hpu_cosim::{Unseen, product_wraps, unseen_contact};

use motion::Motion;

use drawing::canvas::{Anchor, Canvas, HEIGHT, INK, QUIET, WIDTH, text_width};

#[cfg(not(target_family = "wasm"))]
pub use devices::foc::{FOC_NETS, foc_pictures};
#[cfg(not(target_family = "wasm"))]
pub use devices::paddle::{PADDLE_NETS, paddle_pictures};
pub use devices::transfer::{TRANSFER_NETS, transfer_pictures};
pub use diagram::Diagram;
pub use drop::drop_pictures;
pub use error_by_width::error_by_width;
pub use fit::fit;
pub use gimbal::{GIMBAL_NETS, gimbal_pictures};
pub use limits::limits;
pub use log_beside::log_beside;
pub use map::map_pictures;
pub use papers::formats::formats;
pub use papers::ladder::ladder;
pub use papers::sines::sines;
pub use papers::table_2::{rms, table_2};
pub use papers::velocities::{Estimate, velocities};
pub use ranges::ranges;
pub use side_by_side::side_by_side;
pub use speed::{shares, speed};
pub use stiffness_by_cost::stiffness_by_cost;

/// Returns the nets that a run's trace must hold for its pictures, in this order.
pub fn nets(scene: &Scene) -> &'static [&'static str] {
    match (scene.model.datapath, scene.method.kind) {
        (Datapath::Law, _) => &["position", "penetration", "command"],
        (_, Loop::Hybrid | Loop::Conventional) => &["position", "penetration", "spring", "velocity", "drag", "command"],
        (_, Loop::Law(_)) => &["position", "penetration", "torque", "memory", "shaped", "command"],
    }
}

/// The nets that the pictures of a drop test use; an FPGA beside a host has only the commands.
pub const DROP_NETS: [&str; 9] = ["command1", "command2", "command3", "x", "y", "z", "force_x", "force_y", "force_z"];

/// A finished run, with everything that its pictures need.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// The scene that was run.
    pub scene: &'a Scene,
    /// The words of the loop.
    pub words: &'a LoopWords,
    /// The trace of the run, with the nets of [`nets`].
    pub trace: &'a Trace,
    /// The summary of the run.
    pub summary: &'a Summary,
    /// The command that makes the picture.
    pub command: &'a str,
}

/// The shape of a series' marker.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Marker {
    /// A filled circle.
    Disc,
    /// A square.
    Square,
    /// A triangle that points up.
    Triangle,
    /// A square on its corner.
    Diamond,
    /// A triangle that points down.
    Down,
    /// A circle that is white inside.
    Ring,
    /// A diagonal cross.
    Cross,
    /// An upright cross.
    Plus,
    /// Two triangles, tip to tip.
    Hourglass,
}

impl Marker {
    /// Number of markers.
    const COUNT: i32 = Self::Hourglass as i32 + 1;
}

/// The meaning of a colour and a marker in a picture.
#[derive(Clone, PartialEq, Debug)]
pub struct Key {
    /// Name of the series.
    pub name: String,
    /// Red, green and blue.
    pub color: [u8; 3],
    /// The marker of a line; an area has none.
    pub marker: Option<Marker>,
    /// Index of the panel that the series is in, counted over the picture.
    pub panel: usize,
}

/// A picture in both forms.
#[derive(Clone, PartialEq, Debug)]
pub struct Picture {
    /// File name, without extension.
    pub name: &'static str,
    /// The picture as SVG.
    pub svg: String,
    /// The picture as PNG.
    pub png: Vec<u8>,
    /// The meaning of its colours and markers.
    pub keys: Vec<Key>,
}

/// Returns the pictures of one run. A recording has no device, so only its bits are shown. A law without a wiring has
/// no bits.
pub fn run_pictures(run: &Run) -> Vec<Picture> {
    let mut pictures = Vec::new();
    if run.summary.verdict.is_some() {
        pictures.extend(motion_pictures(&Motion::of(run)));
    }
    if !run.summary.nets.is_empty() {
        pictures.push(bits::bits(run));
    }
    pictures
}

fn motion_pictures(motion: &Motion) -> [Picture; 2] {
    [motion::position(motion), motion::torque(motion)]
}

/// Returns the nets that a trace must hold for [`dut_pictures`], in this order: the ports, and whether the wall is
/// touched.
pub fn dut_nets(simulation: &DutSimulation) -> Vec<Signal> {
    let inside = simulation.wires().iter().map(|wire| wire.port.is_inside).chain([false]);
    simulation.nets().into_iter().zip(inside).filter(|(_, inside)| !inside).map(|(net, _)| net).collect()
}

/// Returns the pictures of a run whose loop was closed by a design of the user's own. Its trace holds its [`dut_nets`].
///
/// # Panics
///
/// If the trace does not hold these nets.
pub fn dut_pictures(simulation: &DutSimulation, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
    motion_pictures(&dut_motion(simulation, trace, summary, command)).into()
}

/// Returns one picture of a design of the user's own beside a loop of ours.
///
/// # Panics
///
/// If the traces do not hold what their pictures need.
pub fn dut_beside(simulation: &DutSimulation, trace: &Trace, summary: &Summary, ours: &Run, command: &str) -> Picture {
    motion::beside(&[dut_motion(simulation, trace, summary, command), Motion::of(ours)], command)
}

fn dut_motion<'a>(
    simulation: &'a DutSimulation,
    trace: &'a Trace,
    summary: &'a Summary,
    command: &'a str,
) -> Motion<'a> {
    let scene = simulation.scene();
    let clock = rate(scene.clock.frequency_hz() as f64);
    let warning = if summary.contact_share == Some(0.0) { "; wall not reached" } else { "" };
    let outcome = verdict(summary, (scene.device.units(), 1.0)) + warning;
    Motion {
        title: format!("{}: {outcome}", scene.name),
        conditions: format!("{} at {clock}, by {}{}", scene.dut.top, simulation.engine(), thinned(trace)),
        command,
        told_in: (scene.device.units(), 1.0),
        body: None,
        wheel_ratio: motion::wheel_ratio(&scene.device).filter(|_| scene.pmsm.is_none()),
        hand: &scene.hand,
        duration_s: scene.run.duration_s,
        motion_s: summary.motion_s,
        clock: scene.clock,
        modulator: None,
        wall_rad: scene.wall_rad,
        target: None,
        trace,
        faults: &summary.faults,
        contact: trace.words(dut_nets(simulation).len() - 1),
        counted: None,
        asked: None,
    }
}

/// Returns the outcome of the motion in a few words, with a warning if it is no verdict on the wall.
fn outcome(run: &Run) -> String {
    let wraps = product_wraps(run.scene, &run.words.realised, run.trace, run.summary);
    let unseen = unseen_contact(run.scene, &run.words.realised, run.trace, run.summary);
    let warning = match (run.summary.contact_share, wraps) {
        (Some(0.0), _) => unseen.map_or("; wall not reached".into(), |unseen| past_the_wall(run, unseen)),
        (_, Some(1)) => "; through the wall, product wrapped once".into(),
        (_, Some(wraps)) => format!("; through the wall, product wrapped {wraps} times"),
        _ if run.summary.unheld.is_some() => "; counter wrapped".into(),
        _ => String::new(),
    };
    verdict(run.summary, (run.scene.units(), run.scene.scale())) + &warning
}

/// Returns as text how far the device was past the wall without the datapath seeing it.
fn past_the_wall(run: &Run, Unseen { depth, wrapped }: Unseen) -> String {
    let depth = run.scene.scale() * depth;
    let (unit, digits) = (run.scene.units().position, if depth < 0.1 { 4 } else { 2 });
    format!("; {depth:.digits$} {unit} past the wall, {}", if wrapped { "counter wrapped" } else { "unseen" })
}

/// Returns the verdict in a few words, in units of which one of the motion's is so many.
fn verdict(summary: &Summary, (units, scale): (Units, f64)) -> String {
    let unit = units.position;
    match summary.verdict.map(|verdict| verdict.in_units(scale)) {
        Some(Verdict::Settled { rms_rad }) if rms_rad < 1e-5 => format!("settled, below 0.01 m{unit} rms"),
        Some(Verdict::Settled { rms_rad }) => format!("settled, {:.2} m{unit} rms", 1e3 * rms_rad),
        Some(Verdict::NotTold { amplitude_rad, .. }) => format!("not told, over {:.2} m{unit}", 2e3 * amplitude_rad),
        Some(Verdict::HandMoves { until_s, .. }) => format!("the hand moves until {until_s:.2} s"),
        Some(Verdict::LimitCycle { amplitude_rad, frequency_hz, .. }) => {
            format!("limit cycle of {:.1} m{unit} at {frequency_hz:.0} Hz", 1e3 * amplitude_rad)
        }
        Some(Verdict::Diverged { amplitude_rad, .. }) => format!("diverged, to {amplitude_rad:.2} {unit}"),
        Some(Verdict::NoWallTorque { depth, .. }) => format!("{depth:.2} {unit} in the wall without its torque"),
        Some(Verdict::PositionLost { rms_rad, .. }) => format!("position lost, {:.2} m{unit} rms", 1e3 * rms_rad),
        Some(Verdict::Tracking { rms_m, .. }) => format!("tracking, {:.2} m{unit} rms", 1e3 * rms_m),
        Some(Verdict::Passive { .. } | Verdict::NonPassive { .. } | Verdict::HighlyUnstable { .. }) => {
            unreachable!("the verdicts of a drop test")
        }
        None if summary.complete => "recorded encoder lines".into(),
        None => "interrupted".into(),
    }
}

fn rate(hz: f64) -> String {
    match hz {
        hz if hz >= 1e6 => format!("{} MHz", hz / 1e6),
        hz if hz >= 1e3 => format!("{} kHz", hz / 1e3),
        hz => format!("{hz} Hz"),
    }
}

/// Returns the loop and its wall in one line of text.
fn conditions(run: &Run) -> String {
    let realised = &run.words.realised;
    let clock = rate(run.scene.clock.frequency_hz() as f64);
    // The rate as asked for: the rate that the clock allows differs only in digits that do not matter here.
    let sampled = rate(run.scene.method.sample_rate_hz);
    let kind = match run.scene.method.kind {
        Loop::Hybrid => format!("hybrid loop at {clock}, damping sampled at {sampled}"),
        Loop::Conventional => format!("conventional loop at {clock}, sampled at {sampled}"),
        Loop::Law(law) => format!("{} at {clock}, sampled at {sampled}", law.name().replace('_', " ")),
    };
    let product = if run.scene.method.saturate { "saturate" } else { "drop their upper bits" };
    let unit = dotted(run.scene.units().stiffness);
    let stiffness = realised.in_units(run.scene.scale()).stiffness_nm_per_rad;
    let drawn = thinned(run.trace);
    match run.scene.target {
        Some(_) => format!("{kind}; a gain of {stiffness:.3} {unit}{drawn}"),
        None => format!("{kind}; wall of {stiffness:.3} {unit}; products {product}{drawn}"),
    }
}

/// Returns a note for a trace that does not hold all rows of its run; empty for any other trace.
fn thinned(trace: &Trace) -> String {
    if trace.every() == 1 { String::new() } else { format!("; one row of {} is drawn", trace.every()) }
}

/// Returns a unit as it is printed.
fn dotted(unit: &str) -> String {
    unit.replace('.', "\u{b7}")
}

/// Returns a page with title, conditions, and the command that made it.
fn page(title: &str, conditions: &str, command: &str) -> Canvas {
    let mut canvas = Canvas::default();
    canvas.title((60, 54), title, 46);
    canvas.text((60, 112), conditions, 30, QUIET, Anchor::Left);
    canvas.text((60, HEIGHT - 34), format!("$ {}", foot(command)), 24, QUIET, Anchor::Left);
    canvas.text((WIDTH - 60, HEIGHT - 34), "hpu", 24, INK, Anchor::Right);
    canvas
}

/// Returns a command for the foot of a page: without the folders of absolute paths, and cut to the room that there is.
fn foot(command: &str) -> String {
    const ROOM: i32 = WIDTH - 260;
    let command = without_folders(command);
    if text_width(&command, 24) <= ROOM {
        return command;
    }
    let mut ends = command.char_indices().map(|(end, _)| end).rev();
    let end = ends.find(|end| text_width(&command[..*end], 24) <= ROOM - 30).unwrap_or(0);
    format!("{} \u{2026}", &command[..end])
}

/// Returns a command whose absolute paths are cut to their last names. A path ends at its closing quote, or at a space.
fn without_folders(command: &str) -> String {
    let mut text = String::new();
    let mut quote = None;
    let mut rest = command;
    while let Some(c) = rest.chars().next() {
        let begins = text.chars().next_back().is_none_or(|before| [' ', '\'', '"', '=', ':'].contains(&before));
        if c == '/' && begins {
            let (path, after) = rest.split_at(rest.find(quote.unwrap_or(' ')).unwrap_or(rest.len()));
            text += path.trim_end_matches('/').rsplit('/').next().unwrap_or_default();
            rest = after;
            continue;
        }
        quote = match quote {
            None if c == '\'' || c == '"' => Some(c),
            Some(open) if open == c => None,
            other => other,
        };
        text.push(c);
        rest = &rest[c.len_utf8()..];
    }
    text
}
