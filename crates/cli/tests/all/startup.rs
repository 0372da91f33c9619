//! The start of designs: the reset that rises, the clocks in it, and what nothing sets. `testbench/startup.py` has the
//! words by Icarus Verilog and GHDL from benches that know nothing of hpu.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::{ROOT, code, run, scratch, stderr, text};
use crate::dut::words;

const CLOCKS: usize = 20;

/// Runs the designs of `testbench/dut/startup` in an engine. Returns the words of each output before the first clock
/// edge and after each one, in hexadecimal; `xx` is a word with an unknown bit.
fn started(dir: &Path, file: &str, engine: &str) -> BTreeMap<String, Vec<String>> {
    let (scene, out) = (dir.join(format!("{engine}-{file}.toml")), dir.join(format!("{engine}-{file}")));
    let source = fs::canonicalize(Path::new(ROOT).join("testbench/dut/startup").join(file)).expect("the design");
    let toml = format!(
        "about = \"start\"\ndevice = {{ kind = \"motor\", motor = \"vasudevan_2007\" }}\nclock = {{ frequency = \"1 \
         MHz\" }}\nhand = {{ kind = \"prescribed\", path = [[0, 0], [1, 0]] }}\nrun = {{ duration = \"{CLOCKS} us\" \
         }}\n[dut]\nfiles = [\"{}\"]\ntop = \"startup\"\nengine = \"{engine}\"\nclock = \"clk\"\nreset = {{ port = \
         \"rst\" }}\n[dut.ports]\na = 0\n",
        source.display()
    );
    fs::write(&scene, toml).expect("a scene");
    let output = run(&["run", text(&scene), "--vcd", "--no-plot", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let all = words(&out.join("wave.vcd")).into_iter();
    let outputs = all.filter_map(|(name, words)| Some((name.strip_prefix("startup.")?.to_string(), words)));
    // A cycle is ten steps of the waveform.
    let at = |words: &[(u64, String)], edge: usize| {
        let (_, word) = words.iter().rfind(|(time, _)| *time <= 10 * edge as u64).expect("a word");
        let number = u64::from_str_radix(&format!("0{word}"), 2);
        number.map_or("xx".to_string(), |number| format!("{number:02x}"))
    };
    outputs.map(|(name, words)| (name, (0..=CLOCKS).map(|edge| at(&words, edge)).collect())).collect()
}

#[test]
fn designs_start_as_in_icarus_and_ghdl() {
    let dir = scratch("startup");
    let record = fs::read_to_string(Path::new(ROOT).join("testbench/record/startup.txt")).expect("the record");
    let runs =
        [("icarus", "startup.v", "verilator"), ("ghdl", "startup.vhd", "verilator"), ("ghdl", "startup.vhd", "ghdl")];
    let mut designs = 0;
    for (tool, file, engine) in runs {
        let found = started(&dir, file, engine);
        for line in record.lines().filter_map(|line| line.strip_prefix(tool)) {
            let told: Vec<_> = line.split_whitespace().collect();
            let (name, mut words) = (told[0], told[1..].to_vec());
            if name == "divided_by_its_reset" {
                // A register that goes from X to 0 has a falling edge in Verilog. Verilator has no X, so hpu says that
                // the words are unknown until the next edge.
                words[..2].fill("xx");
            }
            assert_eq!(found[name], words, "{name} in {engine}, against {tool}");
            designs += usize::from((tool == "icarus") == (engine == "verilator") || engine == "ghdl");
        }
    }
    assert_eq!(designs, 42);
}
