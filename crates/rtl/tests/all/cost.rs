//! Costs of designs that are small enough to count by hand.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use hpu_datapath::{AnyBlock, variants_of};
use hpu_rtl::{Cost, Counts, Fault, HX8K_BRAM, HX8K_CELLS, cost, counts};

fn hdl() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hdl")
}

fn block(name: &str, label: &str) -> Box<dyn AnyBlock> {
    let found = variants_of(|block| block == name).into_iter().find(|(of, _)| of == label);
    found.unwrap_or_else(|| panic!("no {name} {label}")).1
}

fn cost_of(name: &str, label: &str) -> Cost {
    cost(&*block(name, label), hdl()).unwrap_or_else(|error| panic!("{name} {label}: {error}"))
}

#[test]
fn a_synchronizer_is_two_flip_flops_a_line_and_no_logic() {
    let cost = cost_of("synchronizer", "default");
    assert_eq!(cost.ice40, Counts { lut4: 0, ff: 4, carry: 0, bram: 0, dsp: 0 });
    assert!(cost.fits());
}

#[test]
fn a_counter_is_one_cell_a_bit_and_no_cell_of_the_bench() {
    let cost = cost_of("position_counter", "8_bit");
    // Each bit has a flip-flop and an adder; the carry out of the topmost bit is not used. The reset is an input of the
    // flip-flop.
    assert_eq!(cost.ice40, Counts { lut4: 8, ff: 8, carry: 7, bram: 0, dsp: 0 });
    // The bench has 3 bits in and 8 out, each with two flip-flops. None of these is counted, only nextpnr's two
    // constants.
    assert!((8..=10).contains(&cost.cells), "{} cells", cost.cells);
}

#[test]
fn a_longer_carry_chain_is_slower() {
    let [short, long] = ["8_bit", "32_bit"].map(|label| cost_of("position_counter", label).fmax_mhz().expect("a path"));
    assert!(long < short, "{long} MHz of 32 bits, {short} MHz of 8");
}

#[test]
fn a_combinational_block_has_a_path_and_no_flip_flop() {
    let cost = cost_of("torque_sum", "8_bit");
    assert_eq!(cost.ice40.ff, 0);
    assert!(cost.ice40.lut4 >= 10, "a bit of the sum depends on more than one of the inputs");
    // The path is longer than clock to output and setup of two adjacent registers, and shorter than the slowest adder
    // of an HX8K.
    let path_ns = cost.path_ns().expect("a path");
    assert!((1.0..20.0).contains(&path_ns), "{path_ns} ns");
}

#[test]
fn a_command_is_held_back_by_a_flip_flop_a_bit_and_clock() {
    let held_back = |label| counts(&*block("command_limiter", label), hdl()).expect("counts").ff;
    assert_eq!(["default", "settling_1", "settling_5"].map(held_back), [0, 9, 45]);
}

#[test]
fn a_block_that_answers_a_constant_has_neither_cells_nor_a_path() {
    let cost = cost_of("saturator", "limit_0");
    assert_eq!(cost.ice40, Counts { lut4: 0, ff: 0, carry: 0, bram: 0, dsp: 0 });
    assert_eq!((cost.fmax_mhz(), cost.path_ns()), (None, None));
}

#[test]
fn a_case_keeps_its_others_on_the_way_through_verilog() {
    // The registers are previous, settling, step and error. Only `when others` sets the error, so it would be lost
    // without it.
    let cost = cost_of("quadrature_decoder", "default");
    assert_eq!(cost.ice40.ff, 2 + 2 + 2 + 1);
    assert!(cost.fmax_mhz().is_some());
}

/// A table of 256 words behind the ports of the synchronizer. A counter addresses it, and a register follows it.
const TABLE: &str = "
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity synchronizer is
  port (
    clk, rst, a_pin, b_pin : in  std_logic;
    a, b                   : out std_logic
  );
end entity;

architecture rtl of synchronizer is
  subtype word is std_logic_vector(WIDTH - 1 downto 0);
  type table is array (0 to 255) of word;

  -- Bits without a pattern: a shift register with feedback (x^31 + x^28 + 1). Every 16 columns have the same words, so
  -- that Yosys translates the contents of one block RAM only; it shares none of them.
  function fill return table is
    variable bits  : std_logic_vector(30 downto 0) := (others => '1');
    variable words : table;
  begin
    for i in table'range loop
      for j in 0 to 15 loop
        bits := bits(29 downto 0) & (bits(30) xor bits(27));
        for k in 0 to WIDTH / 16 - 1 loop
          words(i)(16 * k + j) := bits(0);
        end loop;
      end loop;
    end loop;
    return words;
  end function;

  constant WORDS   : table := fill;
  signal   address : unsigned(7 downto 0);
  signal   data    : word;
begin
  process (clk)
  begin
    if rising_edge(clk) then
      address <= address + 1;
      data    <= WORDS(to_integer(address));
    end if;
  end process;
  a <= xor data;
  b <= '0';
end architecture;
";

fn cost_of_table(width: u64) -> Cost {
    let dir = std::env::temp_dir().join(format!("hpu-cost-table-{width}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    std::fs::write(dir.join("synchronizer.vhd"), TABLE.replace("WIDTH", &width.to_string())).expect("a file");
    let cost = cost(&*block("synchronizer", "default"), &dir);
    std::fs::remove_dir_all(dir).expect("the folder goes");
    cost.expect("a cost")
}

#[test]
fn a_table_is_in_block_rams_of_256_words_of_16_bits() {
    let cost = cost_of_table(16);
    // The counter's bits are flip-flops; the register behind the table is part of the block RAM.
    assert_eq!((cost.ice40.bram, cost.ice40.ff), (1, 8));
    assert!(cost.fits() && cost.fmax_mhz().is_some());
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn tables_that_need_more_block_rams_than_there_are_do_not_fit() {
    let cost = cost_of_table(16 * (HX8K_BRAM + 1));
    assert_eq!(cost.ice40.bram, HX8K_BRAM + 1);
    assert!(cost.cells < HX8K_CELLS && !cost.fits());
    assert_eq!(cost.fmax_mhz(), None);
    let ecp5 = cost.ecp5.expect("counted for a larger FPGA");
    // 256 words leave most of a block RAM's 18432 bits empty, because its widest word has 36 bits.
    assert_eq!(ecp5.bram, (16 * (HX8K_BRAM + 1)).div_ceil(36));
}

#[test]
fn the_same_block_costs_the_same_again() {
    assert_eq!(cost_of("displacement", "default"), cost_of("displacement", "default"));
}

#[test]
fn without_the_tools_the_packages_to_install_are_named() {
    const CHILD: &str = "HPU_TEST_WITHOUT_TOOLS";
    if let Ok(which) = std::env::var(CHILD) {
        let error = cost(&*block("synchronizer", "default"), hdl()).expect_err("a tool is missing");
        let named = error.to_string().contains(&format!("`{which}` is not installed"));
        assert!(matches!(error.fault(), Some(Fault::Missing)) && named, "{error}");
        assert!(error.to_string().contains("yosys nextpnr-ice40 fpga-icestorm"), "{error}");
        return;
    }
    // Runs this test in a process that finds no program at all, then in one that finds only GHDL.
    let name = "without_the_tools_the_packages_to_install_are_named";
    let run = |path: &Path, which: &str| {
        let mut child = Command::new(std::env::current_exe().expect("this test"));
        let child = child.args(["--exact", name]).env("PATH", path).env(CHILD, which).output().expect("a child");
        assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
    };
    run(Path::new(""), "ghdl");
    let place = std::env::temp_dir().join(format!("hpu-cost-ghdl-{}", std::process::id()));
    std::fs::create_dir_all(&place).expect("a folder for the test");
    let path = std::env::var("PATH").expect("a PATH");
    let ghdl = place.join("ghdl");
    std::fs::write(&ghdl, format!("#!/bin/sh\nPATH='{path}' exec ghdl \"$@\"\n")).expect("a script");
    std::fs::set_permissions(&ghdl, std::fs::Permissions::from_mode(0o755)).expect("it may run");
    run(&place, "yosys");
    std::fs::remove_dir_all(place).expect("the folder goes");
}
