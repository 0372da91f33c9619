//! Files of somebody else: scenes with a `[dut]`, studies and manifests whose names and texts would leave their folder,
//! be read as code, or steer a terminal.

use std::fs;
use std::path::Path;
use std::process::Command;

use sha2::{Digest, Sha256};

use super::Case;
use crate::common::quoted;

/// The verbs that are given such files.
pub const VERBS: [&str; 4] = ["foreign design", "foreign scene", "foreign study", "foreign sweep"];

/// The file that a text makes if it is read as code.
const CANARY: &str = "canary";

/// Texts in the place of names, values and paths.
const TEXTS: [&str; 30] = [
    "plain",
    "two words",
    "../outside",
    "/proc/self/cwd/outside",
    "",
    ".",
    "..",
    ".hidden",
    "-rf",
    "--help",
    "$(touch canary)",
    "`touch canary`",
    "; touch canary;",
    "'; touch canary; '",
    "\"; touch canary; \"",
    "x; exec -- touch canary",
    "|touch canary",
    "[exec touch canary]",
    "a\nb",
    "a\n#SBATCH --wrap='touch canary'",
    "a\tb",
    "a\\b",
    "%n%s%j",
    "{} {.} {#}",
    "a\u{1b}]0;owned\u{7}",
    "\u{9b}2J\u{8}\u{7f}",
    "\u{202e}gnp.\u{2066}x",
    "é膝\u{0301}",
    "=cmd|'/c calc'!A0",
    "1e308",
];

const DESIGN: &str = "library ieee; use ieee.std_logic_1164.all;\n\
    entity top is generic (WIDTH : integer := 4; NAME : string := \"x\");\n\
    port (clk, rst, a, b : in std_logic; pwm, dir : out std_logic); end;\n\
    architecture x of top is begin pwm <= '0' when rst = '1' else a; dir <= b; end;\n";
const VERILOG: &str = "module top #(parameter WIDTH = 4, parameter NAME = \"x\") (input clk, rst, a, b, \
    output pwm, dir); assign pwm = rst ? 1'b0 : a; assign dir = b; endmodule\n";

/// Random choices from the numbers of a case.
struct Choices(u64);

impl Choices {
    fn next(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % count
    }

    /// Returns a text of [`TEXTS`] in one of so many cases, else `otherwise`.
    fn text(&mut self, one_of: usize, otherwise: &str) -> String {
        if self.next(one_of) > 0 {
            return otherwise.to_string();
        }
        match self.next(40) {
            0 => "x".repeat(300),
            at => TEXTS[at % TEXTS.len()].to_string(),
        }
    }
}

/// Makes a file below a folder, whatever its name; a name that no file can have becomes another one.
fn put(folder: &Path, name: &str, content: &str) -> String {
    let name = name.replace(['/', '\0'], "_");
    let is_one = !["", ".", ".."].contains(&name.as_str()) && name.len() < 200;
    let name = if is_one { name } else { "file".to_string() };
    fs::write(folder.join(&name), content).expect("a file of somebody else");
    name
}

/// Writes the files of a case into `dir`, and returns the arguments of its command. Results go to `out` alone.
pub fn arguments(verb: &str, case: &Case, dir: &Path) -> Vec<String> {
    let [a, b, c, d] = case.numbers.map(u64::from);
    let mut choices = Choices(a ^ (b << 16) ^ (c << 32) ^ (d << 48) | 1);
    let given = dir.join("given");
    fs::create_dir_all(&given).expect("a folder");
    fs::write(dir.join("outside.csv"), "mine\n").expect("a file");
    fs::write(given.join("outside.csv"), "mine\n").expect("a file");
    let words = |all: &[&str]| all.iter().map(|word| (*word).to_string()).collect::<Vec<_>>();
    match verb {
        "foreign design" => design(&mut choices, &given),
        "foreign scene" => {
            let text = "about = \"somebody's\"\ndevice = { kind = \"motor\", motor = \"vasudevan_2007\", \
                        wheel_ratio = 7 }\nclock = { frequency = \"10 MHz\" }\nrun = { duration = \"1 ms\" }\n\
                        wall = { position = \"1.5 rad\", stiffness = \"1 N.m/rad\", damping = \"0\" }\n\
                        hand = { kind = \"none\" }\n\
                        method = { kind = \"hybrid\", position_bits = 12, sample_rate = \"1 kHz\" }\n";
            let keys = ["about", "hand.file", "hand.kind", "method.kind", "wall.stiffness", "device.motor", "zzz"];
            let key = keys[choices.next(keys.len())];
            let text = text.to_string() + &format!("# {}\n", choices.text(2, "").replace('\n', " "));
            let value = choices.text(2, "1");
            let file = format!("given/{}", put(&given, &(choices.text(1, "x") + ".toml"), &text));
            let set = format!("{key}={value}");
            let all: [&[&str]; 6] = [
                &["run", &file, "-o", "out", "--no-plot"],
                &["run", &file, "--json", "--set", &set],
                &["scenes", "show", &file, "--set", &set],
                &["report", &file, "-o", "out/report.html"],
                &["widths", &file, "--gappa", "-o", "out"],
                &["vectors", "--set-kind", "scene", "--count", "20", "--scene", &file, "-o", "out"],
            ];
            words(all[choices.next(all.len())])
        }
        "foreign study" => {
            let text = format!(
                "name = {}\ntitle = {}\nnotes = [{}]\n[[group]]\nname = {}\n[[group.line]]\nwhat = {}\n\
                 text = \"{{w.torque_quantum}}\"\nmeasure.w = {{ measure = \"scene\", scene = {} }}\n{}",
                quoted(&choices.text(2, "own")),
                quoted(&choices.text(3, "title")),
                quoted(&choices.text(3, "note")),
                quoted(&choices.text(3, "group")),
                quoted(&choices.text(3, "line")),
                quoted(&choices.text(5, "hybrid-wall")),
                section(&mut choices)
            );
            let file = format!("given/{}", put(&given, &(choices.text(2, "study") + ".toml"), &text));
            match choices.next(4) {
                0 => words(&["study", &file, "--json"]),
                1 => words(&["sweep", "plan", &file, "--section", "lines", "--shard-points", "1", "-o", "out"]),
                _ => words(&["study", &file, "-o", "out"]),
            }
        }
        _ => sweep(&mut choices, &given),
    }
}

/// Returns a section of a study with an option that may name a place.
fn section(choices: &mut Choices) -> String {
    let keys = ["junit", "cache", "out", "hdl", "from", "json", "dut", "beside", "set", "zzz"];
    if choices.next(2) == 0 {
        return String::new();
    }
    let (key, value) = (keys[choices.next(keys.len())], choices.text(1, "x"));
    format!("[run]\nscene = \"hybrid-wall\"\nedges = 100\nno_plot = true\n{key} = {}\n", quoted(&value))
}

/// Makes a design of somebody else with its scene.
fn design(choices: &mut Choices, given: &Path) -> Vec<String> {
    let (text, ending) = [(DESIGN, "vhd"), (VERILOG, "v")][choices.next(2)];
    let own = ["design", "hpu_dut_bench", "hpu_dut_bridge", "main", "synthesised", "Vdut"][choices.next(6)];
    let file = put(given, &format!("{}.{ending}", choices.text(2, own)), text);
    let scene = format!(
        "about = \"somebody's\"\ndevice = {{ kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }}\n\
         clock = {{ frequency = \"10 MHz\" }}\nwall = {{ position = \"1.5 rad\" }}\nrun = {{ duration = \"1 ms\" }}\n\
         [dut]\nengine = \"{}\"\nfiles = [{}]\ntop = {}\nlibrary = {}\nclock = {}\nreset = {{ port = {} }}\n\
         [dut.generics]\n{} = {}\n[dut.ports]\na = \"encoder.a\"\nb = \"encoder.b\"\n{} = \"bridge.pwm\"\n\
         dir = \"bridge.direction\"\n[hand]\nkind = \"constant_torque\"\ntorque = \"1 mN.m\"\n",
        ["ghdl", "auto"][choices.next(2)],
        quoted(&file),
        quoted(&choices.text(15, "top")),
        quoted(&choices.text(15, "work")),
        quoted(&choices.text(15, "clk")),
        quoted(&choices.text(15, "rst")),
        quoted(&choices.text(8, "NAME")),
        quoted(&choices.text(2, "text")),
        quoted(&choices.text(15, "pwm")),
    );
    let scene = format!("given/{}", put(given, &(choices.text(3, "scene") + ".toml"), &scene));
    let all: [&[&str]; 6] = [
        &["run", &scene, "-o", "out", "--no-plot"],
        &["run", &scene, "--json", "--edges", "100"],
        &["cost", "--scene", &scene, "-o", "out"],
        &["scenes", "show", &scene],
        &["check", &scene, "--entity", "top", "--as", "saturator"],
        &["report", &scene, "-o", "out/report.html"],
    ];
    all[choices.next(all.len())].iter().map(|word| (*word).to_string()).collect()
}

/// Makes the folder of a sweep whose manifest has another value in a place, with the right checksum or without it.
fn sweep(choices: &mut Choices, given: &Path) -> Vec<String> {
    let text = "name = \"s\"\ntitle = \"s\"\n[map]\nscene = \"free-motion\"\n\
                x = \"device.initial_speed=100..300 rad/s:3\"\ny = \"device.coulomb_friction=1..2 mN.m:2\"\n\
                set = \"run.duration=1 ms\"\nfull = true\n";
    let study = put(given, "study.toml", text);
    let planned = Command::new(env!("CARGO_BIN_EXE_hpu"))
        .args(["-q", "sweep", "plan", &study, "-o", "../out", "--shard-points", "2"])
        .current_dir(given)
        .output()
        .expect("the command starts");
    assert!(planned.status.success(), "{}", String::from_utf8_lossy(&planned.stderr));
    let place = given.join("../out/manifest-1.json");
    let mut manifest: serde_json::Value = serde_json::from_slice(&fs::read(&place).expect("a manifest")).expect("JSON");
    let object = manifest.as_object_mut().expect("an object");
    object.remove("manifest_sha256");
    let sizes = [0, 1, 2, 6, 7, 1 << 20, 1 << 40, u64::MAX / 2, u64::MAX - 1, u64::MAX];
    let keys: Vec<String> = object.keys().cloned().collect();
    for _ in 0..choices.next(4) {
        let mut size = || sizes[choices.next(sizes.len())];
        let (first, count, other) = (size(), size(), size());
        let key = &keys[choices.next(keys.len())];
        object[key] = match (key.as_str(), choices.next(3)) {
            ("runs", _) => serde_json::json!([[first, count]]),
            ("points" | "shards" | "shard_points" | "wave" | "sweep", _) => other.into(),
            (_, 0) => choices.text(1, "x").into(),
            (_, 1) => serde_json::json!([choices.text(1, "x")]),
            _ => serde_json::Value::Null,
        };
    }
    if choices.next(4) > 0 {
        let sum: String = Sha256::digest(manifest.to_string()).iter().map(|byte| format!("{byte:02x}")).collect();
        manifest["manifest_sha256"] = sum.into();
    }
    fs::write(&place, format!("{manifest:#}\n")).expect("a manifest");
    let all: [&[&str]; 7] = [
        &["sweep", "status", "out"],
        &["sweep", "run", "out", "--jobs", "1"],
        &["sweep", "gather", "out"],
        &["sweep", "shard", "out", "--index", "0"],
        &["sweep", "shard", "out", "--index", "0", "--any-version", "--point", "7"],
        &["sweep", "submit", "out", "--engine", "slurm", "--dry-run"],
        &["map", "--from", "out"],
    ];
    all[choices.next(all.len())].iter().map(|word| (*word).to_string()).collect()
}

/// Returns whether a text was read as code: its canary is there.
pub fn is_code(dirs: [&Path; 2]) -> bool {
    dirs.iter().any(|dir| {
        let mut left = vec![dir.to_path_buf()];
        while let Some(folder) = left.pop() {
            for path in fs::read_dir(&folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
                if path.file_name().is_some_and(|name| name == CANARY) {
                    return true;
                }
                if path.is_dir() && !path.is_symlink() {
                    left.push(path);
                }
            }
        }
        false
    })
}
