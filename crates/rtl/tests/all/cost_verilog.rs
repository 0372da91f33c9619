//! The Verilog whose cost is counted has the same outputs as the emulator: Icarus Verilog simulates it on golden
//! vectors.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use hpu_datapath::{AnyBlock, registry, variants};
use hpu_rtl::{Column, Header, Vectors, stimuli, verilog};

/// Number of rows of directed stimuli, and as many random ones.
const ROWS: usize = 60;

/// The number of rows for a law, which takes up to 34 rows from a sample to its torque.
const LAW_ROWS: usize = 400;

/// Returns a module that feeds the rows of `rows.hex` to the block, one a clock, and prints the number of rows and how
/// many of them differ.
fn bench(header: &Header, rows: usize) -> String {
    let width = |columns: &[Column]| -> u32 { columns.iter().map(|column| column.format.width()).sum() };
    let (ins, outs) = (width(&header.inputs), width(&header.outputs));
    let mut connections = if header.clocked { ".clk(clk)".to_string() } else { String::new() };
    for (wire, columns, mut top) in [("stimulus", &header.inputs, ins), ("answer", &header.outputs, outs)] {
        for Column { name, format, .. } in columns {
            let gap = if connections.is_empty() { "" } else { ", " };
            let low = top - format.width();
            write!(connections, "{gap}.{name}({wire}[{}:{low}])", top - 1).expect("a string grows");
            top = low;
        }
    }
    format!(
        "module bench;
           reg [{all}:0] rows [0:{last}];
           reg clk = 0;
           integer row, different = 0;
           wire [{all}:0] now = rows[row];
           wire [{ins}-1:0] stimulus = now[{all}:{outs}];
           wire [{outs}-1:0] answer;
           {name} dut({connections});
           initial begin
             $readmemh(\"rows.hex\", rows);
             for (row = 0; row < {rows}; row = row + 1) begin
               #1 clk = 1;
               // An output may follow an input at once: the row stands until half a clock after its edge.
               #1 if (answer !== now[{outs}-1:0]) different = different + 1;
               clk = 0;
             end
             $display(\"%0d %0d\", row, different);
             $finish;
           end
         endmodule\n",
        all = ins + outs - 1,
        last = rows - 1,
        name = header.block,
    )
}

fn differing_rows(block: &mut dyn AnyBlock, most: usize, dir: &Path) -> u64 {
    let hdl = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hdl");
    let text = verilog(block, &hdl).unwrap_or_else(|error| panic!("{}: {error}", block.name()));
    let mut rows = stimuli::directed(block);
    rows.truncate(most);
    rows.extend(stimuli::random(block, 1, most));
    // Words before the first reset are unknown.
    rows[0].rst = block.clocked();
    let vectors = Vectors::record(block, rows);
    let count = vectors.rows.len();
    std::fs::write(dir.join("block.v"), text).expect("written");
    std::fs::write(dir.join("bench.v"), bench(&vectors.header, count)).expect("written");
    std::fs::write(dir.join("rows.hex"), vectors.memory().to_readmemh()).expect("written");
    let said = |tool: &str, arguments: &[&str]| {
        let output = Command::new(tool).args(arguments).current_dir(dir).output();
        let output = output.unwrap_or_else(|error| panic!("{tool}: {error}; install the Debian package iverilog"));
        assert!(output.status.success(), "{}: {}", block.name(), String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    said("iverilog", &["-g2005", "-o", "bench.vvp", "-s", "bench", "bench.v", "block.v"]);
    let told = said("vvp", &["-n", "bench.vvp"]);
    let (rows, different) = told.trim().split_once(' ').unwrap_or_else(|| panic!("{}: {told}", block.name()));
    assert_eq!(rows, count.to_string(), "{}: all rows ran", block.name());
    different.parse().expect("a number")
}

/// Returns whether GHDL takes seconds for a loop, because its tables are long.
fn has_long_tables(name: &str, label: &str) -> bool {
    ["phantom_loop", "phantom_shared_loop"].contains(&name) && label != "small"
}

/// Simulates the first `most` variants of each block; `long` includes loops with long tables. Returns the names of the
/// blocks, and the number of laws among the variants.
fn simulate(name: &str, most: usize, long: bool) -> (BTreeSet<&'static str>, usize) {
    let dir = std::env::temp_dir().join(format!("hpu-cost-verilog-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    let (mut wrong, mut held, mut laws) = (Vec::new(), BTreeMap::<_, usize>::new(), 0);
    for (label, mut block) in variants() {
        let before = held.entry(block.name()).or_default();
        if *before == most || !long && has_long_tables(block.name(), &label) {
            continue;
        }
        *before += 1;
        let is_law = block.clocked() && block.inputs().iter().any(|input| input.name == "penetration");
        let different = differing_rows(&mut *block, if is_law { LAW_ROWS } else { ROWS }, &dir);
        if different > 0 {
            wrong.push(format!("{} {label}: {different} rows", block.name()));
        }
        laws += usize::from(is_law);
    }
    std::fs::remove_dir_all(dir).expect("the folder goes");
    assert!(wrong.is_empty(), "{wrong:#?}");
    (held.into_iter().filter(|(_, count)| *count > 0).map(|(name, _)| name).collect(), laws)
}

/// Asserts that each block has a variant among these.
fn assert_each(held: &BTreeSet<&str>) {
    let missing: Vec<_> = registry().iter().map(|block| block.name()).filter(|name| !held.contains(name)).collect();
    assert!(missing.is_empty(), "no variant: {missing:?}");
}

/// One variant of each block shows that the way through Verilog works. The next test takes all of them.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_variant_of_each_block_is_synthesised_to_verilog_that_answers_as_the_emulator_does() {
    let (held, laws) = simulate("short", 1, false);
    assert!(laws >= 6, "{laws} variants of laws");
    assert_each(&held);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_variant_of_every_block_is_synthesised_to_verilog_that_answers_as_the_emulator_does() {
    let (held, laws) = simulate("long", usize::MAX, true);
    assert!(laws > 20, "{laws} variants of laws");
    assert_each(&held);
}
