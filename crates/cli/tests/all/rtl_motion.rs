//! `hpu run --driver rtl -o` writes, draws and judges the motion of the world that the VHDL drives.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::common::{ROOT, code, names, run, scratch, stderr, stdout, text};

/// 2 ms of a motor that is thrown at a wall, which it reaches after 0.4 ms.
const THROWN: [&str; 4] = ["run", "thrown-hybrid", "--set", "run.duration=2 ms"];

/// Copies the project's VHDL, and replaces phrases in one file.
fn patched(dir: &Path, file: &str, phrases: &[(&str, &str)]) -> PathBuf {
    let copy = dir.join("hdl");
    fs::create_dir_all(&copy).expect("a folder");
    for name in names(Path::new(&format!("{ROOT}/hdl"))).iter().filter(|name| name.ends_with(".vhd")) {
        fs::copy(format!("{ROOT}/hdl/{name}"), copy.join(name)).expect("a copy");
    }
    let mut block = fs::read_to_string(copy.join(file)).expect("the block");
    for (phrase, by) in phrases {
        assert!(block.contains(phrase), "{file} no longer says `{phrase}`");
        block = block.replace(phrase, by);
    }
    fs::write(copy.join(file), block).expect("a patched block");
    copy
}

#[test]
fn a_scene_that_begins_in_contact_has_the_first_row_of_its_vhdl() {
    let dir = scratch("rtl-in-contact");
    // The scene begins 0.7 mm inside the wall, with a micrometre a count. The FPGA sees that between reset and the
    // first edge.
    let rows = |name: &str, driver: &[&str]| {
        let out = dir.join(name);
        let arguments = ["run", "scaled-wall", "--edges", "5000", "--no-plot", "-o", text(&out)];
        assert_eq!(code(&run(&[&arguments[..], driver].concat())), 0);
        let trace = fs::read_to_string(out.join("trace.csv")).expect("a trace");
        let cells = |line: &str| line.split(',').map(str::to_string).collect::<Vec<_>>();
        trace.lines().map(cells).collect::<Vec<_>>()
    };
    let (emulated, vhdl) = (rows("emulated", &[]), rows("vhdl", &["--driver", "rtl"]));
    let depth = emulated[0].iter().position(|head| head.starts_with("penetration")).expect("a depth");
    assert_eq!(emulated[1][depth], "700");
    assert_eq!(emulated, vhdl.iter().map(|row| row[..row.len() - 1].to_vec()).collect::<Vec<_>>());
}

/// The files that a run left in its folder.
struct Left {
    out: PathBuf,
    code: i32,
    said: String,
    summary: Value,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Left {
    fn of(dir: &Path, name: &str, arguments: &[&str]) -> Self {
        let out = dir.join(name);
        let output = run(&[&THROWN[..], arguments, &["-o", text(&out)]].concat());
        let read = |file: &str| {
            fs::read_to_string(out.join(file)).unwrap_or_else(|error| panic!("{file}: {error}: {}", stderr(&output)))
        };
        let trace = read("trace.csv");
        let mut lines = trace.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
        let header = lines.next().expect("a header");
        let summary = serde_json::from_str(&read("summary.json")).expect("JSON");
        let (code, said) = (code(&output), stdout(&output));
        Self { code, said, summary, header, rows: lines.collect(), out }
    }

    /// Returns the cells of a column.
    fn column(&self, name: &str) -> Vec<&str> {
        let index =
            self.header.iter().position(|head| head == name).unwrap_or_else(|| panic!("no {name}: {:?}", self.header));
        self.rows.iter().map(|row| row[index].as_str()).collect()
    }

    fn numbers(&self, name: &str) -> Vec<f64> {
        self.column(name).iter().map(|cell| cell.parse().expect("a number")).collect()
    }

    /// Returns all columns except the column that only a run of VHDL has.
    fn without_marker(&self) -> Vec<Vec<String>> {
        let last = self.header.len() - 1;
        assert_eq!(self.header[last].split(' ').next(), Some("differs"), "{:?}", self.header);
        [&self.header].into_iter().chain(&self.rows).map(|row| row[..last].to_vec()).collect()
    }
}

/// Returns the clock edge of a row of the trace, at 50 MHz.
fn edge(time_s: &str) -> u64 {
    (time_s.parse::<f64>().expect("a time") * 50e6).round() as u64
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn vhdl_that_never_drives_its_gates_leaves_a_motion_without_current() {
    let dir = scratch("rtl-no-gates");
    let phrases = [
        ("a_high <= gate(leg_a, high);", "a_high <= '0';"),
        ("a_low  <= gate(leg_a, low);", "a_low  <= '0';"),
        ("b_high <= gate(leg_b, high);", "b_high <= '0';"),
        ("b_low  <= gate(leg_b, low);", "b_low  <= '0';"),
    ];
    let hdl = patched(&dir, "pwm.vhd", &phrases);
    // With an open bridge the shaft coasts: J w' = -b w. By that time, the emulator's wall has thrown the shaft back.
    let (inertia, viscous, speed): (f64, f64, f64) = (1.37e-6, 1.3e-6, 40.0);
    let coasted = |time_s: f64| 1.485 + speed * inertia / viscous * -(-viscous / inertia * time_s).exp_m1();
    let expect = format!("expect={{ final_angle = {{ value = {:?}, tolerance = \"1 urad\" }} }}", coasted(2e-3));
    let motor = ["--set", "device.rotor_inertia=13.7 g.cm2", "--set", "device.viscous_friction=1.3e-6"];
    let motor = [&motor[..], &["--set", "device.coulomb_friction=0", "--set", &expect]].concat();

    let broken = ["--driver", "rtl", "--hdl", text(&hdl), "--vcd", "--parquet"];
    let left = Left::of(&dir, "out", &[&motor[..], &broken].concat());
    assert_eq!(left.numbers("current_a").iter().filter(|current_a| **current_a != 0.0).count(), 0, "current flows");
    for (time_s, angle_rad) in left.numbers("time_s").into_iter().zip(left.numbers("angle_rad")) {
        assert!((angle_rad - coasted(time_s)).abs() < 1e-12, "{angle_rad} at {time_s} s");
    }
    // This motion is also the one that is judged. The VHDL differs all the same.
    assert_eq!(left.summary["expected"][0]["met"], true, "{}", left.summary["expected"]);
    assert_eq!(left.code, 1, "{}", left.said);
    let emulated = Left::of(&dir, "emulated", &[&motor[..], &["--no-plot"]].concat());
    assert_eq!(emulated.summary["expected"][0]["met"], false, "the wall is reached");

    // The emulator's bridge brakes from the second edge on, because after reset the latched duty is 0.
    let first = &left.summary["rtl"]["first_difference"];
    let at = first["edge"].as_u64().expect("an edge");
    assert_eq!((first["signal"].as_str(), at), (Some("a_low"), 1), "{first}");
    assert_eq!((first["expected"].as_str(), first["got"].as_str()), (Some("1 (1)"), Some("0 (0)")));
    assert_eq!(first["time_s"].as_f64(), Some(at as f64 / 50e6));
    for (time_s, differs) in left.column("time_s").iter().zip(left.column("differs")) {
        assert_eq!(differs == "1", edge(time_s) >= at, "at {time_s}");
    }
    let vcd = fs::read_to_string(left.out.join("wave.vcd")).expect("a waveform");
    let code = vcd.lines().find_map(|line| line.strip_suffix(" differs $end")?.split(' ').nth(3)).expect("a variable");
    let changes = changes(&vcd, code);
    // The times are in units of 10 ns, and an edge is two units.
    assert_eq!(changes, [(0, "0"), (2 * at, "1")]);
    let saved = fs::read_to_string(left.out.join("wave.fst.gtkw")).expect("a save file");
    // The primary marker stands behind the zoom, before the named ones.
    let markers = saved.lines().find(|line| line.starts_with('*')).expect("the markers");
    assert_eq!(markers.split(' ').nth(1), Some(&*(20 * at).to_string()), "{saved}");
    // The bits that its words lost are unknown.
    assert!(left.summary["signals"].as_array().expect("signals").iter().all(|net| net["overflowed"].is_null()));
    assert!(left.said.contains("first difference") && left.out.join("position.svg").exists());
    assert!(!left.out.join("bits.svg").exists(), "a picture of losses that nobody saw");
}

/// Returns the times and values of a variable of one bit.
fn changes<'v>(vcd: &'v str, code: &str) -> Vec<(u64, &'v str)> {
    let mut now = 0;
    let mut all = Vec::new();
    for line in vcd.lines().skip_while(|line| !line.starts_with("$enddefinitions")) {
        if let Some(time) = line.strip_prefix('#') {
            now = time.parse().expect("a time");
        } else if let Some(value) = line.strip_suffix(code)
            && value.len() == 1
        {
            all.push((now, value));
        }
    }
    all
}

#[test]
fn the_motion_of_vhdl_is_the_emulators_to_the_byte_up_to_their_first_difference() {
    let dir = scratch("rtl-half-torque");
    let emulated = Left::of(&dir, "emulated", &["--no-plot"]);
    let equal = Left::of(&dir, "equal", &["--driver", "rtl", "--no-plot"]);
    assert_eq!(equal.code, 0, "{}", equal.said);
    assert!(equal.summary["rtl"]["first_difference"].is_null());
    assert_eq!(equal.without_marker(), [std::slice::from_ref(&emulated.header), &emulated.rows].concat());
    assert!(equal.column("differs").iter().all(|differs| *differs == "0"));

    // With half of the commanded torque the wheel comes further before it is thrown back.
    let phrase = "held := to_integer(signed(command));";
    let hdl = patched(&dir, "pwm.vhd", &[(phrase, "held := to_integer(signed(command)) / 2;")]);
    let half = Left::of(&dir, "half", &["--driver", "rtl", "--hdl", text(&hdl), "--no-plot"]);
    assert_eq!(half.code, 1, "{}", half.said);
    let at = half.summary["rtl"]["first_difference"]["edge"].as_u64().expect("an edge");
    let before = |row: &&Vec<String>| edge(&row[0]) < at;
    let (rows, marked) = (half.without_marker(), half.column("differs"));
    let same = rows[1..].iter().zip(&emulated.rows).take_while(|(row, _)| before(row)).count();
    assert!(same > 20, "the wall is reached after 0.4 ms: {same} rows");
    assert_eq!(rows[1..=same], emulated.rows[..same]);
    assert_eq!(marked.iter().position(|differs| *differs == "1"), Some(same));
    let peak = |left: &Left, name: &str| left.numbers(name).into_iter().fold(f64::NEG_INFINITY, f64::max);
    assert!(peak(&half, "angle_rad") > peak(&emulated, "angle_rad") + 1e-3);
    let signals = half.summary["signals"].as_array().expect("signals");
    let depth = signals.iter().find(|net| net["name"] == "penetration").expect("a depth");
    assert!(depth["max"].as_f64() >= Some(peak(&half, "penetration_count")), "{depth}");
}

#[test]
fn bits_that_the_vhdl_never_sets_are_unknown_in_every_file() {
    let dir = scratch("rtl-unknown");
    let hdl = patched(&dir, "unilateral.vhd", &[("contact     <= not delta(delta'high);", "")]);
    let left = Left::of(&dir, "out", &["--driver", "rtl", "--hdl", text(&hdl), "--vcd", "--no-plot"]);
    assert_eq!(left.code, 1, "{}", left.said);
    assert_eq!(left.summary["rtl"]["first_difference"]["got"], "unknown");
    let vcd = fs::read_to_string(left.out.join("wave.vcd")).expect("a waveform");
    let code = vcd.lines().find_map(|line| line.strip_suffix(" contact $end")?.split(' ').nth(3)).expect("a variable");
    assert_eq!(changes(&vcd, code), [(0, "x")]);
    let signals = left.summary["signals"].as_array().expect("signals");
    let contact = signals.iter().find(|net| net["name"] == "contact").expect("a contact");
    assert!(contact["min"].is_null() && contact["max"].is_null(), "{contact}");
}
