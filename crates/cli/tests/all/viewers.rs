//! The files for viewers beside a run's waveforms: markers are at the edges that the waveform itself tells, the hand is
//! among the signals, and Surfer's commands name variables of the waveform.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;

use vcd::{Command, IdCode, Parser, ScopeItem, Value};

use crate::common::{code, run, scratch, stderr, text};

#[test]
fn markers_are_where_the_waveform_touches_overflows_and_is_judged() {
    let out = scratch("viewers").join("out");
    let output =
        run(&["run", "wrap-product", "--set", "record.overflows=true", "--vcd", "--no-plot", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let mut parser = Parser::new(BufReader::new(File::open(out.join("wave.vcd")).expect("a waveform")));
    let header = parser.parse_header().expect("a header");
    let mut known = BTreeMap::new();
    for item in &header.items {
        let ScopeItem::Scope(scope) = item else { continue };
        let vars = scope.items.iter().filter_map(|item| if let ScopeItem::Var(var) = item { Some(var) } else { None });
        // Of a word, the name has the range of its bits behind it.
        let name = |var: &vcd::Var| var.reference.split('[').next().expect("a name").to_string();
        known.extend(vars.map(|var| (format!("{}.{}", scope.identifier, name(var)), var.code)));
    }
    let [penetration, stiffness, lost] =
        ["hybrid_loop.penetration", "hybrid_loop.stiffness", "overflows.spring_overflow"].map(|name| known[name]);
    let mut words: BTreeMap<IdCode, i64> = BTreeMap::new();
    let (mut time, mut touched, mut overflowed, mut last) = (0, None, None, 0);
    let mut look = |time: u64, words: &BTreeMap<IdCode, i64>| {
        let [depth, gain, lost] = [penetration, stiffness, lost].map(|id| words.get(&id).copied().unwrap_or(0));
        touched = touched.or((depth != 0).then_some(time));
        // The spring's word has 12 bits.
        let is_lost = depth * gain > 4095;
        assert_eq!(lost == 1, is_lost, "{depth} times {gain} at {time}");
        overflowed = overflowed.or(is_lost.then_some(time));
    };
    for command in parser {
        match command.expect("a change") {
            Command::Timestamp(next) => {
                look(time, &words);
                (time, last) = (next, next);
            }
            Command::ChangeVector(id, bits) => {
                let word = bits.iter().fold(0, |word, bit| word << 1 | i64::from(bit == Value::V1));
                words.insert(id, word);
            }
            Command::ChangeScalar(id, bit) => {
                words.insert(id, i64::from(bit == Value::V1));
            }
            _ => {}
        }
    }
    look(time, &words);
    let read = |name: &str| fs::read_to_string(out.join(name)).expect("a text");
    let commands = read("wave.vcd.sucl");
    let (touched, overflowed) = (touched.expect("contact"), overflowed.expect("an overflow"));
    // 2 s in units of 10 ns; the last 30 % of the rows of 100 us are judged.
    assert_eq!(last, 200_000_000);
    let judged = 200_000_000 * 7 / 10 + 10_000;
    let expected = format!(
        "zoom_fit\nmarker_set first_contact {touched}\nmarker_set first_overflow_of_spring {overflowed}\n\
         marker_set judged_from_here {judged}\n"
    );
    assert!(commands.ends_with(&expected), "{expected}{commands}");
    // GTKWave counts in ns.
    let save = read("wave.vcd.gtkw");
    let markers = format!(" -1 {} {} {}\n", 10 * touched, 10 * overflowed, 10 * judged);
    assert!(save.contains(&markers), "{markers}{save}");
    for name in ["[*] marker A: first contact\n", "[*] marker B: first overflow of spring\n", "[*] marker C: judged"] {
        assert!(save.contains(name), "{save}");
    }
    assert_eq!(commands, read("wave.fst.sucl").replace("wave.fst", "wave.vcd"));

    let added: Vec<&str> = commands.lines().filter_map(|line| line.strip_prefix("variable_add ")).collect();
    for name in &added {
        assert!(known.contains_key(*name), "{name} of {known:?}");
    }
    assert!(added.contains(&"plant.hand_angle_rad") && added.contains(&"plant.hand_torque_nm"), "{added:?}");
    assert!(save.contains("\nplant.hand_torque_nm\n"), "{save}");
    // The hand's torque in the waveform is that of the table, row by row.
    let table = read("trace.csv");
    let rows = |wanted: &str| -> Vec<f64> {
        let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let column = lines.next().expect("a head").iter().position(|name| *name == wanted).expect("a column");
        lines.map(|row| row[column].parse().expect("a number")).collect()
    };
    let torques = rows("hand_torque_nm");
    let [hand, depth] = ["plant.hand_torque_nm", "plant.wall_depth_rad"].map(|name| known[name]);
    let summary: serde_json::Value = serde_json::from_str(&read("summary.json")).expect("JSON");
    let realised = &summary["realised"];
    let wall = realised["wall_position_rad"].as_f64().unwrap_or_else(|| panic!("a wall in {realised}"));
    let angle = rows("angle_rad");
    let mut parser = Parser::new(BufReader::new(File::open(out.join("wave.vcd")).expect("a waveform")));
    parser.parse_header().expect("a header");
    let (mut time, mut seen, mut deepest) = (0, 0, 0.0f64);
    for command in parser {
        match command.expect("a change") {
            Command::Timestamp(next) => time = next,
            Command::ChangeReal(id, value) if id == hand => {
                // A row every 100 us.
                assert_eq!((time % 10_000, value), (0, torques[time as usize / 10_000]));
                seen += 1;
            }
            Command::ChangeReal(id, value) if id == depth => {
                assert_eq!(value, (angle[time as usize / 10_000] - wall).max(0.0), "at {time}");
                deepest = value.max(deepest);
            }
            _ => {}
        }
    }
    assert!(seen > 10_000 && deepest > 0.0, "{seen} {deepest}");
}
