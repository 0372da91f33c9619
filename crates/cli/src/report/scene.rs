//! The parts of a report that a scene's run makes.

use std::time::Duration;

use hpu_chart::Diagram;
use hpu_cosim::dut::Inside;
use hpu_cosim::scene::{Experiment, Resolved, ValueSource, resolved};
use hpu_cosim::{AnySimulation, SceneFile, Simulation, Wired, judged_window_s};
use hpu_page::{Cell, Column, Page, Table, as_json, escaped};
use hpu_signal::Notation;
use serde_json::Value;

use super::Part;
use super::pieces::Pieces;
use crate::diff;
use crate::document::{Content, Document, Section, data};
use crate::run::{Finished, finished, unseen};
use crate::scene::{Named, quoted, set_options};
use crate::shell::hdl::Vhdl;
use crate::shell::{Failure, Watch, sha256};

/// A scene that was run, with all that the report tells of it.
pub(crate) struct SceneReport {
    /// The scene, as the command names it.
    pub scene: String,
    /// Its text.
    pub source: SceneFile,
    /// The keys that are changed.
    pub set: Vec<(String, String)>,
    /// Its run, whose page is without the two tables.
    pub run: Finished,
    json: Value,
    signals: Option<Table>,
    keys: Vec<Resolved>,
    drawing: String,
    course: (Value, String),
}

impl SceneReport {
    /// Runs a scene, and looks on after its end for as long as `for_ever`, if that is given; `None` when stopped.
    pub fn new(
        (scene, source): &Named,
        set: &[(String, String)],
        for_ever: Option<Duration>,
        watch: Watch,
    ) -> Result<Option<Self>, Failure> {
        let Some((mut run, recorded)) = finished(source, set, for_ever, watch, unseen)? else { return Ok(None) };
        let json = run.page.json();
        let signals = run.page.take_table("signals");
        // The keys tell more than the parameters.
        run.page.take_table("parameters");
        let keys = resolved(run.scene(), &source.name, &source.text, set).map_err(Failure::file)?;
        let simulators = Vhdl::default().simulators();
        let simulation = AnySimulation::new(run.scene(), &simulators, Inside::Nothing)?;
        let overflows = recorded.summary.nets.iter().any(|net| net.usage.overflowed > 0);
        let by_rows =
            |pieces: Pieces| Ok::<_, Failure>(run.again(watch, |_| Ok(pieces))?.map(|recorded| recorded.observer));
        let Some(pieces) = Pieces::of(&simulation, overflows, watch, by_rows)? else { return Ok(None) };
        let judged = simulation.has_device().then(|| judged_window_s(run.scene()));
        let course = pieces.told(&simulation, judged);
        let drawing = drawing(run.scene(), &simulation, &keys);
        let (scene, source, set) = (scene.clone(), source.clone(), set.to_vec());
        Ok(Some(Self { scene, source, set, run, json, signals, keys, drawing, course }))
    }

    /// Returns the scene's own name.
    pub fn name(&self) -> &str {
        &self.run.scene().name
    }

    /// Returns a command on this scene.
    pub fn command(&self, verb: &str) -> String {
        format!("hpu {verb} {}{}", quoted(&self.scene), set_options(&self.set))
    }

    /// Returns the keys: those that the scene gives, then all others.
    fn keys(&self) -> [Table; 2] {
        [true, false].map(|given| {
            let of_kind = |key: &&Resolved| matches!(key.source, ValueSource::Given(_)) == given;
            let rows = self.keys.iter().filter(of_kind).filter(|key| !(key.section.is_empty() && key.key == "about"));
            let path = |key: &Resolved| {
                if key.section.is_empty() { key.key.clone() } else { format!("{}.{}", key.section, key.key) }
            };
            let fields = [
                Column::text("section", "").data().of(|key: &Resolved| key.section.clone()),
                Column::text("key", "key").of(move |key: &Resolved| Cell::new(&key.key).shown(path(key))),
                Column::text("value", "value").of(|key: &Resolved| {
                    let value = key.toml.as_ref().map(|_| as_json(&key.value));
                    Cell::new(value).shown(format!("{} {}", key.value, key.unit).trim_end())
                }),
                Column::text("source", "source").of(|key: &Resolved| {
                    let source = key.source.to_string();
                    let file = match &key.source {
                        ValueSource::Given(place) => place.rsplit('/').next().unwrap_or(place).to_string(),
                        _ => source.clone(),
                    };
                    Cell::new(source).shown(file)
                }),
                Column::text("meaning", "meaning").of(|key: &Resolved| key.meaning),
            ];
            Table::of("keys", rows, fields)
        })
    }

    fn sha256(&self) -> String {
        sha256::of(&self.source.text)
    }
}

/// Draws the loop of a scene, and below it a device of bodies and joints.
fn drawing(experiment: &Experiment, simulation: &AnySimulation, keys: &[Resolved]) -> String {
    let device = keys.iter().find(|key| (key.section.as_str(), key.key.as_str()) == ("device", "kind"));
    let device = device.map_or("a recording".to_string(), |key| key.value.to_string());
    let nets = simulation.nets();
    let (inputs, outputs, instances, nets) = match simulation {
        AnySimulation::Ours(ours) => {
            let block = ours.wiring().block();
            (block.inputs().len(), block.outputs().len(), ours.wiring().instances(), nets)
        }
        AnySimulation::Dut(dut) => {
            // Ports stand in the order of the design: inputs go first.
            let ports = || dut.wires().iter().zip(&nets).filter(|(wire, _)| !wire.port.is_inside);
            let of = |is_input: bool| ports().filter(move |(wire, _)| wire.port.is_input == is_input);
            let sorted: Vec<_> = of(true).chain(of(false)).map(|(_, net)| net.clone()).collect();
            (of(true).count(), of(false).count(), Vec::new(), sorted)
        }
    };
    let name = simulation.closed_by();
    let notation = Notation::Triple;
    let the_loop =
        Diagram { nets: &nets, inputs, outputs, instances: &instances, name, device: &device, notation }.svg();
    the_loop + &hpu_page::device::drawing(experiment).unwrap_or_default()
}

/// Returns the report of these scenes, with the parts that were asked for.
pub fn document(all: &[SceneReport], parts: Vec<Vec<(Part, Content)>>) -> Document {
    let names: Vec<&str> = all.iter().map(|report| report.name()).collect();
    let about = |report: &SceneReport| report.run.scene().about.trim().to_string();
    let abouts: Vec<String> = match all {
        [report] => vec![about(report)],
        all => all.iter().map(|report| format!("{}: {}", report.name(), about(report))).collect(),
    };
    let section = |id: &str, title: &str, of: &dyn Fn(&SceneReport) -> Content| Section {
        id: id.into(),
        title: title.into(),
        beside: all.iter().map(|report| Content { of: report.name().to_string(), ..of(report) }).collect(),
    };
    let mut sections = vec![
        section("verdict", "Verdict", &|report| Content::new(&report.run.command(), &report.run.page, &[])),
        course(all),
        section("loop", "Loop", &|report| Content {
            html: format!("<div class=\"scroll\">{}</div>\n", report.drawing),
            ..Content::default()
        }),
        section("signals", "Signals", &|report| Content {
            html: report.signals.as_ref().map_or(String::new(), Table::html),
            by: report.run.command(),
            ..Content::default()
        }),
    ];
    let mut found: Vec<(Part, Vec<Content>)> = Vec::new();
    for (report, of_scene) in all.iter().zip(parts) {
        for (part, content) in of_scene {
            let content = Content { of: report.name().to_string(), ..content };
            match found.iter_mut().find(|(known, _)| *known == part) {
                None => found.push((part, vec![content])),
                Some((_, beside)) => beside.push(content),
            }
        }
    }
    let parts = found.into_iter().map(|(part, beside)| Section { id: part.name(), title: part.title().into(), beside });
    sections.extend(parts);
    if let [one, other] = all {
        let names = [one, other].map(|report| report.scene.as_str());
        let page = diff::page(names, 0.0, [&one.json, &other.json]);
        // The command compares scenes as they are written.
        let by = if one.set.is_empty() {
            format!("hpu diff {} {}", quoted(names[0]), quoted(names[1]))
        } else {
            String::new()
        };
        let beside = vec![Content::new(&by, &page, &[])];
        sections.push(Section { id: "differences".into(), title: "Differences".into(), beside });
    }
    sections.push(section("scene", "Scene", &|report| {
        let [given, others] = report.keys().map(|table| table.html());
        let html = format!("{given}<h3>Defaults, and data of what the scene names</h3>\n{others}");
        Content { html, by: report.command("scenes show"), ..Content::default() }
    }));
    sections.push(section("made", "Made by", &|report| {
        let mut page = Page::default();
        let name = report.source.name.as_str();
        page.line("hpu", env!("HPU_VERSION")).line("scene", name).line("SHA-256", report.sha256());
        for (key, value) in &report.set {
            page.line("changed", format!("{key} = {value}"));
        }
        if matches!(report.run.scene(), Experiment::Dut(_)) {
            page.note(
                "A scene with a [dut] is code: the verbs of hpu that simulate it run its design on your machine.",
            );
        }
        Content::new(&report.command("report"), &page, &[])
    }));
    Document { title: names.join(" beside "), about: abouts.join("\n\n"), sections }
}

/// Returns the part with the course of the runs, as pictures that can be zoomed.
fn course(all: &[SceneReport]) -> Section {
    let mut html = String::new();
    let ids: Vec<String> = (1..=all.len()).map(|number| format!("run-{number}")).collect();
    html += &format!("<div data-runs=\"{}\"></div>\n", ids.join(" "));
    let mut left_out = Vec::new();
    for (report, id) in all.iter().zip(&ids) {
        let (mut course, bytes) = report.course.clone();
        if all.len() > 1 {
            prefix(&mut course, report.name());
        }
        html += &data(id, &course);
        html += &format!("<script type=\"text/plain\" id=\"{id}-bytes\">{bytes}</script>\n");
        let names = course["left_out"].as_array().into_iter().flatten().filter_map(Value::as_str);
        left_out.extend(names.map(|name| format!("{name} of {}", report.name())));
    }
    html += "<p class=\"hint\">Wheel, drag, pinch, + and - zoom; arrows move; Home shows the whole run. Signals are \
             shown word by word at every clock cycle, the device at every change of its drive.</p>\n";
    if !left_out.is_empty() {
        let said = format!("Left out, because they change too often: {}.", left_out.join(", "));
        html += &format!("<p>{}</p>\n", escaped(&said));
    }
    let content = Content { html, ..Content::default() };
    Section { id: "run".into(), title: "Run".into(), beside: vec![content] }
}

/// Puts the scene's name before the names of its signals and marks, and shows bits on request.
fn prefix(course: &mut Value, scene: &str) {
    for (list, key) in [("series", "name"), ("markers", "label"), ("spans", "label")] {
        for one in course[list].as_array_mut().into_iter().flatten() {
            one[key] = format!("{scene}: {}", one[key].as_str().unwrap_or_default()).into();
            if one["unit"] == "bit" {
                one["hidden"] = true.into();
            }
        }
    }
}
