//! The Verilog whose cost is counted does what the emulator does: Yosys simulates it on golden vectors.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use hpu_datapath::{AnyBlock, Generic, registry, variants};
use hpu_rtl::{Column, Header, Vectors, stimuli, verilog};

/// Rows of directed stimuli, and as many random ones.
const ROWS: usize = 60;

/// The same for a law, which takes up to 34 rows from a sample to its torque.
const LAW_ROWS: usize = 400;

/// A module that feeds the rows of `rows.hex` to the block, one a clock, and counts the rows that differ.
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
        "module bench(input clk, output reg [15:0] row, output reg [15:0] different);
           reg [{all}:0] rows [0:{last}];
           reg clocked;
           initial begin $readmemh(\"rows.hex\", rows); row = 0; different = 0; clocked = 0; end
           wire [{all}:0] now = rows[row];
           wire [{ins}-1:0] stimulus = now[{all}:{outs}];
           wire [{outs}-1:0] answer;
           {name} dut({connections});
           always @(posedge clk) clocked <= 1;
           // An output may follow an input at once: the row stands until half a clock after its edge.
           always @(negedge clk) if (clocked) begin
             row <= row + 1;
             if (row < {rows} && answer !== now[{outs}-1:0]) different <= different + 1;
           end
         endmodule\n",
        all = ins + outs - 1,
        last = rows - 1,
        name = header.block,
    )
}

/// The last value of a variable in a VCD of Yosys.
fn last_value(vcd: &str, name: &str) -> u64 {
    let declared = vcd.lines().find(|line| line.starts_with("$var") && line.contains(&format!(" {name} ")));
    let id = declared.and_then(|line| line.split_whitespace().nth(3)).unwrap_or_else(|| panic!("no {name}"));
    let value = vcd.lines().rev().find_map(|line| line.strip_prefix('b')?.strip_suffix(&format!(" {id}")));
    u64::from_str_radix(value.expect("a value"), 2).expect("a known value")
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
    let script = format!(
        "read_verilog block.v; read_verilog bench.v; hierarchy -check -top bench; proc; flatten; opt; \
         sim -q -clock clk -n {} -vcd out.vcd bench",
        count + 2
    );
    let output = Command::new("yosys").args(["-q", "-p", &script]).current_dir(dir).output().expect("install yosys");
    assert!(output.status.success(), "{}: {}", block.name(), String::from_utf8_lossy(&output.stderr));
    let vcd = std::fs::read_to_string(dir.join("out.vcd")).expect("a VCD");
    assert!(last_value(&vcd, "row") >= count as u64, "{}: all rows ran", block.name());
    last_value(&vcd, "different")
}

/// Whether Yosys simulates the block within seconds: tables of thousands of words, and windows of thousands of bits, take it
/// minutes. Such blocks are held in their variants of shorter ones.
fn has_short_tables(block: &dyn AnyBlock) -> bool {
    let long = |(name, value): (&str, Generic)| match (name, value) {
        ("DEPTH_WIDTH" | "QUARTER_WIDTH", Generic::Integer(bits)) => bits > 9,
        ("WINDOW", Generic::Integer(samples)) => samples > 32,
        _ => false,
    };
    !block.generics().into_iter().any(long)
}

#[test]
fn the_verilog_of_every_variant_answers_as_the_emulator_does() {
    let dir = std::env::temp_dir().join(format!("hpu-cost-verilog-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    let mut wrong = Vec::new();
    let mut held = BTreeSet::new();
    for (label, mut block) in variants() {
        if has_short_tables(&*block) {
            let different = differing_rows(&mut *block, ROWS, &dir);
            if different > 0 {
                wrong.push(format!("{} {label}: {different} rows", block.name()));
            }
            held.insert(block.name());
        }
    }
    std::fs::remove_dir_all(dir).expect("the folder goes");
    assert!(wrong.is_empty(), "{wrong:#?}");
    let missing: Vec<_> = registry().iter().map(|block| block.name()).filter(|name| !held.contains(name)).collect();
    assert!(missing.is_empty(), "no variant of short tables: {missing:?}");
}

#[test]
fn the_verilog_of_every_law_answers_over_many_samples() {
    let dir = std::env::temp_dir().join(format!("hpu-cost-laws-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    let mut held = 0;
    for (label, mut block) in variants() {
        if block.clocked() && block.inputs().iter().any(|input| input.name == "penetration") {
            assert_eq!(differing_rows(&mut *block, LAW_ROWS, &dir), 0, "{} {label}", block.name());
            held += 1;
        }
    }
    std::fs::remove_dir_all(dir).expect("the folder goes");
    assert!(held > 20, "{held} variants");
}
