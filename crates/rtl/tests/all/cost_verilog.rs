//! The Verilog whose cost is counted has the same outputs as the emulator: Icarus Verilog simulates it on golden
//! vectors.

use std::collections::BTreeSet;
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

/// Returns whether the variants of a block take most of the total time: those of whole loops, whose blocks have
/// variants of their own. The test command simulates one variant of each, and `testbench/long.sh` simulates all of
/// them.
fn is_long(name: &str) -> bool {
    name.ends_with("_loop")
}

/// Simulates the variants that are `wanted`. Returns the names of their blocks, and the number of laws among them.
fn simulate(name: &str, wanted: impl Fn(&dyn AnyBlock, &BTreeSet<&str>) -> bool) -> (BTreeSet<&'static str>, usize) {
    let dir = std::env::temp_dir().join(format!("hpu-cost-verilog-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    let (mut wrong, mut held, mut laws) = (Vec::new(), BTreeSet::new(), 0);
    for (label, mut block) in variants() {
        if !wanted(&*block, &held) {
            continue;
        }
        let is_law = block.clocked() && block.inputs().iter().any(|input| input.name == "penetration");
        let different = differing_rows(&mut *block, if is_law { LAW_ROWS } else { ROWS }, &dir);
        if different > 0 {
            wrong.push(format!("{} {label}: {different} rows", block.name()));
        }
        laws += usize::from(is_law);
        held.insert(block.name());
    }
    std::fs::remove_dir_all(dir).expect("the folder goes");
    assert!(wrong.is_empty(), "{wrong:#?}");
    (held, laws)
}

#[test]
fn every_variant_of_a_block_and_one_of_each_loop_is_synthesised_to_verilog_that_answers_as_the_emulator_does() {
    let (held, laws) = simulate("short", |block, held| !(is_long(block.name()) && held.contains(block.name())));
    assert!(laws > 20, "{laws} variants of laws");
    let missing: Vec<_> = registry().iter().map(|block| block.name()).filter(|name| !held.contains(name)).collect();
    assert!(missing.is_empty(), "no variant: {missing:?}");
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_variant_of_every_loop_is_synthesised_to_verilog_that_answers_as_the_emulator_does() {
    let (held, _) = simulate("long", |block, _| is_long(block.name()));
    let loops: BTreeSet<_> = registry().iter().map(|block| block.name()).filter(|name| is_long(name)).collect();
    assert_eq!(held, loops);
}
