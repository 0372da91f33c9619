//! `hpu report`: the file is well-formed and asks no network; each fact is that of `--json`; the run in it is the run;
//! two scenes, folders, parts from a folder; refusals leave nothing behind.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::time::Instant;

use flate2::read::GzDecoder;
use serde_json::{Value, json};

use crate::common::{assert_refused, code, json as as_json, names, run, scratch, stderr, text};

/// An element of a page: its name, its attributes, and the text directly in it.
#[derive(Debug)]
pub struct Element {
    pub name: String,
    attributes: Vec<(String, String)>,
    pub text: String,
    /// The `id` of the section around it.
    section: String,
}

impl Element {
    pub fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }
}

/// Elements that have no end.
const VOID: [&str; 4] = ["meta", "link", "br", "img"];
/// Elements whose content is no HTML.
const RAW: [&str; 2] = ["script", "style"];

fn plain(text: &str) -> String {
    let known = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")];
    let unknown = text.split('&').skip(1).find(|rest| !known.iter().any(|(name, _)| rest.starts_with(&name[1..])));
    assert_eq!(unknown, None, "an ampersand that begins no entity");
    known.iter().fold(text.to_string(), |text, (name, letter)| text.replace(name, letter))
}

/// Reads HTML; each element must end where it must.
pub fn elements(html: &str) -> Vec<Element> {
    let mut all: Vec<Element> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    let mut section = String::new();
    let mut rest = html.strip_prefix("<!doctype html>").expect("a document");
    while let Some(at) = rest.find('<') {
        if let Some(inner) = open.last() {
            all[*inner].text += &plain(&rest[..at]);
        }
        let end = at + rest[at..].find('>').expect("a tag ends");
        let tag = &rest[at + 1..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            let inner = open.pop().expect("an element that is open");
            assert_eq!(all[inner].name, name, "{:?}", all[inner]);
            continue;
        }
        let (body, is_empty) = tag.strip_suffix('/').map_or((tag, false), |body| (body, true));
        let (name, mut left) = body.split_once(char::is_whitespace).unwrap_or((body, ""));
        let mut attributes = Vec::new();
        while let Some((key, more)) = left.split_once("=\"") {
            let (value, more) = more.split_once('"').expect("a quote that ends");
            assert!(key.trim().chars().all(|c| c.is_ascii_alphanumeric() || "-:".contains(c)), "{key} in {tag}");
            attributes.push((key.trim().to_string(), plain(value)));
            left = more;
        }
        assert_eq!(left.trim(), "", "{tag}");
        let mut element = Element { name: name.into(), attributes, text: String::new(), section: section.clone() };
        if name == "section" {
            section = element.get("id").expect("a section has a name").to_string();
        }
        if RAW.contains(&name) {
            let (content, after) = rest.split_once(&format!("</{name}>")).expect("it ends");
            element.text = content.to_string();
            rest = after;
        } else if !is_empty && !VOID.contains(&name) {
            open.push(all.len());
        }
        all.push(element);
    }
    assert_eq!(open.len(), 0, "all elements end");
    all
}

fn report(arguments: &[&str], file: &Path) -> String {
    let output = run(&[&["report"], arguments, &["-o", text(file)]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    fs::read_to_string(file).expect("a report")
}

/// Checks that no byte comes from elsewhere: names of XML are the only addresses.
fn assert_alone(html: &str, all: &[Element]) {
    for (at, _) in html.match_indices("://") {
        assert!(html[..at + 30].ends_with("http://www.w3.org/2000/svg") || html[at..].starts_with("://www.w3.org/"));
    }
    for element in all {
        for name in ["src", "href", "data", "action"] {
            if let Some(place) = element.get(name) {
                assert!(place.starts_with('#') || place.starts_with("data:"), "{place}");
            }
        }
    }
    for word in ["@import", "fetch(", "XMLHttpRequest", "import(", "sendBeacon"] {
        assert!(!html.contains(word), "{word}");
    }
}

/// Returns the value at a key with dots.
fn at<'v>(value: &'v Value, key: &str) -> &'v Value {
    key.split('.').fold(value, |value, key| &value[key])
}

/// Checks the facts of a section against the JSON of its verb. Returns their number.
fn assert_facts(all: &[Element], section: &str, found: &Value) -> usize {
    let facts = all.iter().filter(|element| element.section == section && element.name == "dd");
    let mut count = 0;
    for fact in facts {
        let Some(key) = fact.get("data-key") else { continue };
        let value: Value = serde_json::from_str(fact.get("data-value").expect("a value")).expect("JSON");
        assert_eq!(&value, at(found, key), "{key}");
        count += 1;
    }
    count
}

/// Checks the cells of a section's tables against rows of the JSON, in their order. Returns the number of rows.
fn assert_rows(all: &[Element], section: &str, rows: &[&Value]) -> usize {
    let (mut row, mut count) = (usize::MAX, 0);
    for element in all.iter().filter(|element| element.section == section) {
        if element.name == "tr" {
            row = count;
        }
        let Some(key) = element.get("data-key").filter(|_| element.name == "td") else { continue };
        if row == count {
            count += 1;
        }
        let value: Value = serde_json::from_str(element.get("data-value").expect("a value")).expect("JSON");
        assert_eq!(&value, at(rows[row], key), "{key} of {}", rows[row]);
    }
    count
}

#[test]
fn a_report_is_one_file_that_asks_no_network_and_says_what_the_json_says() {
    let dir = scratch("report-facts");
    let begin = Instant::now();
    let html = report(&["hybrid-wall"], &dir.join("report.html"));
    assert!(begin.elapsed().as_secs_f64() <= 3.0, "{:?}", begin.elapsed());
    assert!(html.len() <= 2_000_000, "{} bytes", html.len());
    assert_eq!(names(&dir), ["report.html"]);
    let all = elements(&html);
    assert_alone(&html, &all);
    let ids: Vec<&str> = all.iter().filter_map(|element| element.get("id")).collect();
    assert!(ids.iter().all(|id| ids.iter().filter(|other| *other == id).count() == 1), "{ids:?}");
    for link in all.iter().filter(|element| element.name == "a") {
        assert!(ids.contains(&&link.get("href").expect("a place")[1..]), "{link:?}");
    }

    let found = as_json(&run(&["run", "hybrid-wall", "--json"]));
    assert!(assert_facts(&all, "verdict", &found) >= 3);
    let is_wide = |net: &&Value| net["format"] != json!([0, 1, 0]);
    let signals: Vec<&Value> = found["signals"].as_array().expect("a list").iter().filter(is_wide).collect();
    assert_eq!(assert_rows(&all, "signals", &signals), signals.len());

    let shown = as_json(&run(&["scenes", "show", "hybrid-wall", "--json"]));
    let keys = shown["keys"].as_array().expect("a list");
    let is_given = |key: &&Value| key["source"].as_str().is_some_and(|source| source.contains(".toml:"));
    let given = keys.iter().filter(is_given).filter(|key| key["key"] != "about");
    let keys: Vec<&Value> = given.chain(keys.iter().filter(|key| !is_given(key))).collect();
    assert_eq!(assert_rows(&all, "scene", &keys), keys.len());
    let bad: Vec<_> = all.iter().filter(|element| element.get("class") == Some("number bad")).collect();
    assert_eq!(bad.len(), 0, "nothing overflows in this scene");
}

/// A course of a run, read back: the values of each series at its edges.
fn course(all: &[Element], id: &str) -> Vec<(Value, Vec<u64>, Vec<f64>)> {
    let script = |id: &str| &all.iter().find(|element| element.get("id") == Some(id)).expect("its script").text;
    let told: Value = serde_json::from_str(script(id)).expect("JSON");
    let letter = |c: u8| -> u32 {
        let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        letters.iter().position(|known| *known == c).expect("a letter of base64") as u32
    };
    let mut packed = Vec::new();
    for four in script(&format!("{id}-bytes")).as_bytes().chunks(4) {
        let word = four.iter().fold(0, |word, c| word << 6 | if *c == b'=' { 0 } else { letter(*c) });
        let padding = four.iter().filter(|c| **c == b'=').count();
        packed.extend(&word.to_be_bytes()[1..4 - padding]);
    }
    let mut bytes = Vec::new();
    GzDecoder::new(&packed[..]).read_to_end(&mut bytes).expect("gzip");
    let mut bytes = bytes.into_iter();
    let mut next = || {
        let (mut number, mut shift) = (0u64, 0);
        loop {
            let byte = bytes.next().expect("a byte");
            number |= u64::from(byte & 127) << shift;
            shift += 7;
            if byte < 128 {
                return number;
            }
        }
    };
    let mut axes: Vec<Option<Vec<u64>>> = told["axes"].as_array().expect("a list").iter().map(|_| None).collect();
    let mut series = Vec::new();
    for one in told["series"].as_array().expect("a list") {
        let axis = one["axis"].as_u64().expect("an index") as usize;
        let count = told["axes"][axis].as_u64().expect("a count");
        if axes[axis].is_none() {
            let mut edge = 0;
            let mut later = || {
                edge += next();
                edge
            };
            axes[axis] = Some((0..count).map(|_| later()).collect());
        }
        let edges = axes[axis].clone().expect("it is there");
        let scale = one["scale"].as_f64().expect("a number");
        let mut word = 0i64;
        let mut value = || {
            let number = next();
            word += (number >> 1) as i64 ^ -((number & 1) as i64);
            word as f64 * scale
        };
        let values = edges.iter().map(|_| value()).collect();
        series.push((one.clone(), edges, values));
    }
    assert_eq!(bytes.next(), None, "no byte is left");
    series
}

#[test]
fn the_run_in_a_report_is_the_run() {
    let dir = scratch("report-course");
    let all = elements(&report(&["thrown-hybrid"], &dir.join("report.html")));
    let out = dir.join("out");
    let output =
        run(&["run", "thrown-hybrid", "--driver", "clock", "--edges", "2000000", "--no-plot", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let table = fs::read_to_string(out.join("trace.csv")).expect("a trace");
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().expect("a head");
    let rows: Vec<Vec<f64>> =
        lines.map(|row| row.iter().map(|cell| cell.parse().expect("a number")).collect()).collect();
    let series = course(&all, "run-1");
    let names = [("angle", "angle_rad"), ("speed", "speed_rad_per_s"), ("current", "current_a")];
    let words =
        [("position", "position_count"), ("penetration", "penetration_count"), ("command", "command_pwm_count")];
    for (name, column) in names.into_iter().chain(words) {
        let (told, edges, values) = series.iter().find(|(told, ..)| told["name"] == name).expect("a series");
        let column = head.iter().position(|known| *known == column).expect("a column");
        // A column of the device is kept to half a step of 2^-26 of its greatest value.
        let within = if told["step"] == json!(true) { 0.0 } else { told["scale"].as_f64().expect("a number") };
        let mut seen = 0;
        for row in &rows {
            let edge = (row[0] * 50e6).round() as u64;
            let index = edges.partition_point(|known| *known <= edge) - 1;
            if told["step"] == json!(false) && edges[index] != edge {
                continue;
            }
            seen += 1;
            let off = (values[index] - row[column]).abs();
            assert!(off <= within, "{name} at edge {edge}: {} and {}", values[index], row[column]);
        }
        assert!(seen > 300, "{seen} rows of {name}");
    }
}

#[test]
fn a_report_tells_how_its_run_goes_on_for_ever() {
    let dir = scratch("report-for-ever");
    let html = report(&["bounded-wall", "--for-ever=2s"], &dir.join("report.html"));
    let all = elements(&html);
    let found = as_json(&run(&["run", "bounded-wall", "--for-ever=2s", "--json"]));
    assert_eq!(found["for_ever"]["kind"], "quiet");
    assert!(assert_facts(&all, "verdict", &found) >= 3);
    let said = |all: &[Element], words: &str| all.iter().any(|element| element.text.contains(words));
    assert!(said(&all, "settled for ever: no count arrives after"));
    assert!(said(&all, "hpu run bounded-wall --for-ever=2s"));
    let without = elements(&report(&["bounded-wall"], &dir.join("without.html")));
    assert!(said(&without, "hpu run bounded-wall") && !said(&without, "for ever"));
}

#[test]
fn two_scenes_stand_beside_each_other() {
    let dir = scratch("report-two");
    let all = elements(&report(&["free-motion", "capped-coupling"], &dir.join("two.html")));
    let heads: Vec<&str> = all.iter().filter(|element| element.name == "h3").map(|element| &*element.text).collect();
    assert_eq!(heads.iter().filter(|head| **head == "free-motion").count(), 5, "{heads:?}");
    assert_eq!(heads.iter().filter(|head| **head == "capped-coupling").count(), 5, "{heads:?}");
    for (id, scene) in [("run-1", "free-motion"), ("run-2", "capped-coupling")] {
        assert!(course(&all, id).iter().all(|(told, ..)| told["name"].as_str().expect("a name").starts_with(scene)));
    }
    let found = as_json(&run(&["diff", "free-motion", "capped-coupling", "--json"]));
    assert_eq!(assert_facts(&all, "differences", &found), 2);
    let rows: Vec<&Value> = found["differences"].as_array().expect("a list").iter().collect();
    assert_eq!(assert_rows(&all, "differences", &rows), rows.len());
}

#[test]
fn parts_are_made_or_taken_from_a_folder_of_the_same_scene() {
    let dir = scratch("report-parts");
    let all = elements(&report(&["free-motion", "--with", "widths"], &dir.join("made.html")));
    let found = as_json(&run(&["widths", "free-motion", "--json"]));
    let signals: Vec<&Value> = found["signals"].as_array().expect("a list").iter().collect();
    let cells = all.iter().filter(|element| element.section == "widths" && element.name == "td");
    let named = cells.filter(|cell| cell.get("data-key") == Some("name")).map(|cell| cell.text.clone());
    let known: Vec<_> = signals.iter().map(|net| net["name"].as_str().expect("a name")).collect();
    assert!(named.filter(|name| known.contains(&name.as_str())).count() > 8);

    let kept = dir.join("kept");
    let output = run(&["widths", "free-motion", "--no-trials", "-o", text(&kept.join("widths"))]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let html = report(&["free-motion", "--from", text(&kept)], &dir.join("taken.html"));
    let taken = elements(&html);
    assert_alone(&html, &taken);
    assert!(taken.iter().any(|element| element.section == "widths" && element.name == "img"));
    let other = run(&["report", "capped-coupling", "--from", text(&kept), "-o", text(&dir.join("other.html"))]);
    assert_refused(&other, 4, &["widths.json", "it is of free-motion, not of capped-coupling"]);
    assert_eq!(names(&dir), ["kept", "made.html", "taken.html"]);
}

#[test]
fn a_folder_of_results_has_its_tables_row_by_row() {
    let dir = scratch("report-folder");
    let results = dir.join("results");
    fs::create_dir(&results).expect("a folder");
    let csv = [
        "# hpu map wall --x 'wall.stiffness=1..2:2'",
        "# x: wall.stiffness in N.m/rad",
        "x,y,outcome,replay",
        "1,0.5,settled,hpu run wall",
        "2,0.5,\"limit, </script>\",\"hpu run \"\"wall\"\"\"",
    ];
    let csv = csv.map(|line| format!("{line}\n")).concat();
    fs::write(results.join("map.csv"), csv).expect("a file");
    fs::write(results.join("map.svg"), "<svg><title>A map</title></svg>").expect("a file");
    fs::write(results.join("notes.txt"), "a < b & c").expect("a file");
    fs::write(results.join("journal.txt"), "of the command").expect("a file");
    let html = report(&[text(&results)], &dir.join("report.html"));
    let all = elements(&html);
    assert_alone(&html, &all);
    let rows = all.iter().find(|element| element.get("id") == Some("rows-map")).expect("the table");
    let rows: Value = serde_json::from_str(&rows.text).expect("JSON");
    assert_eq!(rows["columns"], json!(["x", "y", "outcome", "replay"]));
    let expected = json!([[1.0, 0.5, "settled", "hpu run wall"], [2.0, 0.5, "limit, </script>", "hpu run \"wall\""],]);
    assert_eq!(rows["rows"], expected);
    assert_eq!(rows["about"], json!({ "x": "wall.stiffness in N.m/rad" }));
    assert_eq!((&rows["x"], &rows["y"], &rows["color"]), (&json!("x"), &json!("y"), &json!("outcome")));
    let by: Vec<&str> = all.iter().filter(|e| e.get("class") == Some("by")).map(|e| &*e.text).collect();
    assert_eq!(by, ["hpu map wall --x 'wall.stiffness=1..2:2'"]);
    assert!(all.iter().any(|element| element.name == "img" && element.get("alt") == Some("A map")));
    let texts: Vec<&str> = all.iter().filter(|element| element.name == "pre").map(|element| &*element.text).collect();
    assert_eq!(texts, ["a < b & c"]);
}

#[test]
fn every_kind_of_scene_has_a_report_with_the_facts_of_its_run() {
    let dir = scratch("report-kinds");
    let law = ["conventional-wall-1khz", "--set", "model.datapath=law", "--set", "model.bridge=averaged"];
    // In the first, modes of the motor end between clock cycles at which the datapath has anything to do.
    let kinds: [&[&str]; 6] = [
        &["stiff-hybrid"],
        &["replay-capture"],
        &["phantom-thrown"],
        &["gimbal-switch", "--set", "run.duration=0.5 s"],
        &law,
        &["testbench/dut/knee.toml"],
    ];
    for (index, scene) in kinds.into_iter().enumerate() {
        let all = elements(&report(scene, &dir.join(format!("{index}.html"))));
        let found = as_json(&run(&[&["run", "--json"], scene].concat()));
        assert!(assert_facts(&all, "verdict", &found) >= 3, "{scene:?}");
        let series = course(&all, "run-1");
        assert!(series.iter().all(|(_, edges, _)| edges.is_sorted()), "{scene:?}");
        assert!(series.len() >= 2, "{scene:?}");
        assert!(all.iter().any(|element| element.section == "loop" && element.name == "svg"), "{scene:?}");
    }
}

#[test]
fn refusals_leave_nothing_behind() {
    let dir = scratch("report-refused");
    let out = dir.join("report.html");
    let file = text(&out);
    fs::create_dir(dir.join("empty")).expect("a folder");
    let empty = text(&dir.join("empty")).to_string();
    let none = text(&dir.join("none")).to_string();
    let refused = |arguments: &[&str], exit: i32, words: &[&str]| {
        assert_refused(&run(&[&["report"], arguments, &["-o", file]].concat()), exit, words);
    };
    refused(&["no-such-scene"], 4, &["no scene `no-such-scene`"]);
    refused(&["hybrid-wall", "--with", "colours"], 2, &["invalid value 'colours'", "widths, limits, map"]);
    refused(&["hybrid-wall", "--from", &none], 2, &["is no folder"]);
    refused(&[&empty], 2, &["holds no results"]);
    refused(&[&empty, "--with", "widths"], 2, &["is a folder"]);
    refused(&[&empty, "--for-ever"], 2, &["is a folder"]);
    refused(&["hybrid-wall", "--set", "wall.stiffness=-1"], 4, &["wall.stiffness"]);
    refused(&["phantom-drop", "--with", "map"], 2, &["a map around the wall is of an axis"]);
    assert_eq!(names(&dir), ["empty"]);
    // A folder stands in the file's place.
    assert_refused(&run(&["report", "free-motion", "-o", &empty]), 4, &["empty"]);
    assert_eq!(names(&dir), ["empty"]);
}
