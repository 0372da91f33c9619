//! An axis whose loop is closed by a design of the user's own.

use hpu_chart::{self as chart, Picture};
use hpu_cosim::dut::{DutSimulation, Wire};
use hpu_cosim::scene::{Driving, Sensor, Units};
use hpu_cosim::{Frames, Starts, Summary, Trace};
use hpu_page::Page;
use hpu_signal::Signal;
use serde_json::{Value, json};

use super::axis::motion;
use super::device::Shown;
use super::simulate::Ran;

/// Tells how often the logic has started samples of these sensors.
pub(super) fn starts(page: &mut Page, sensors: &[Sensor], starts: &[(usize, Starts)]) {
    let name = |index: usize| sensors[index].name.as_str();
    for &(index, Starts { taken, missed }) in starts {
        let never = if taken == 0 { "; the design never started one" } else { "" };
        let said = format!("{}: {taken} samples, {missed} starts while it was converting{never}", name(index));
        page.line("sensor", said);
    }
    if !starts.is_empty() {
        let one = |&(index, Starts { taken, missed }): &(usize, Starts)| {
            let sensor = name(index);
            json!({ "sensor": sensor, "samples": taken, "missed": missed })
        };
        page.data("started", Value::Array(starts.iter().map(one).collect()));
    }
}

impl Shown for DutSimulation<'_> {
    fn lines(&self, page: &mut Page, ran: &Ran) {
        let scene = self.scene();
        page.line("motion", motion("", (scene.device.units(), 1.0), scene.wall_rad, &ran.trace));
        let open = if scene.driving() == Ok(Driving::Nothing) { "; no output drives the device" } else { "" };
        page.line("dut", format!("{} by {}{open}", scene.dut.top, self.engine()));
        for wire in self.wires() {
            let port = &wire.port;
            let width = port.format.width();
            let bits = if width == 1 { String::new() } else { format!("[{}:0]", width - 1) };
            let arrow = if port.is_input { "<-" } else { "->" };
            page.line("port", format!("{:<24} {arrow} {}", format!("{}{bits}", port.name), wire.connection()));
        }
        let name = |index: usize| scene.sensors()[index].name.as_str();
        starts(page, scene.sensors(), &ran.summary.starts);
        for &(index, Frames { all, wrong, fast }) in &ran.summary.frames {
            let said = format!("{all} frames, {wrong} wrong, {fast} with a clock beyond the chip's data sheet");
            page.line("sensor", format!("{}: {said}", name(index)));
        }
        if !ran.summary.frames.is_empty() {
            let one = |&(index, Frames { all, wrong, fast }): &(usize, Frames)| {
                let sensor = name(index);
                json!({ "sensor": sensor, "frames": all, "wrong": wrong, "fast": fast })
            };
            page.data("frames", Value::Array(ran.summary.frames.iter().map(one).collect()));
        }
    }

    fn realised(&self) -> Value {
        json!({ "count_rad": self.scene().encoder.count_rad() })
    }

    fn design(&self) -> Option<Value> {
        let wire = |wire: &Wire| {
            let port = &wire.port;
            json!({
                "port": port.name,
                "direction": if port.is_input { "in" } else { "out" },
                "bits": port.format.width(),
                "connection": wire.connection(),
            })
        };
        Some(json!({
            "top": *self.scene().dut.top,
            "engine": self.engine(),
            "ports": self.wires().iter().map(wire).collect::<Vec<_>>(),
        }))
    }

    /// The inner signals of a design are only in the waveform.
    fn nets(&self) -> Vec<Signal> {
        chart::dut_nets(self)
    }

    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
        chart::dut_pictures(self, trace, summary, command)
    }

    fn told_in(&self) -> Option<(Units, f64)> {
        Some((self.scene().device.units(), 1.0))
    }

    /// The stiffness that a design asks for is known only to the design.
    fn wall(&self) -> Option<(f64, f64)> {
        Some((self.scene().wall_rad?, 0.0))
    }
}
