//! Proofs of blocks, for all inputs and states: of the VHDL as it is, and of VHDL with errors.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use hpu_datapath::{AnyBlock, variants};
use hpu_rtl::formal::{Verdict, prove};

const HDL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../hdl");

/// What takes a solver longer is left to `testbench/long.sh`.
const LIMIT: Duration = Duration::from_secs(60);

/// Configurations that no solver decides in this time: sums of constants' products, and tables.
const LONG: [(&str, &str); 6] = [
    ("biquad", "high_pass"),
    ("biquad", "extreme"),
    ("virtual_coupling", "soft"),
    ("virtual_coupling", "8_bit"),
    ("cube_room", "plain_q22"),
    ("phantom_torque", "plain_q22"),
];

fn blocks() -> impl Iterator<Item = (String, Box<dyn AnyBlock>)> {
    let is_short = |label: &str, block: &dyn AnyBlock| {
        !LONG.contains(&(block.name(), label)) && !block.name().starts_with("trig_")
    };
    variants().into_iter().filter(move |(label, block)| block.equations().is_some() && is_short(label, &**block))
}

#[test]
fn the_vhdl_of_a_block_equals_it_for_all_inputs_and_states() {
    let mut proved = 0;
    for (label, block) in blocks() {
        let name = block.name();
        match prove(&*block, Path::new(HDL), LIMIT) {
            Ok(Verdict::Proved(_)) => proved += 1,
            other => panic!("{name} {label}: {other:?}"),
        }
    }
    assert!(proved >= 90, "{proved}");
}

/// A folder with the VHDL, one file changed.
fn changed(dir: &str, file: &str, from: &str, to: &str) -> PathBuf {
    let place = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("formal").join(dir);
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(&place).expect("a folder");
    for entry in fs::read_dir(HDL).expect("the VHDL") {
        let entry = entry.expect("an entry");
        if entry.path().is_file() {
            fs::copy(entry.path(), place.join(entry.file_name())).expect("a copy");
        }
    }
    let path = place.join(format!("{file}.vhd"));
    let text = fs::read_to_string(&path).expect("VHDL");
    assert!(text.contains(from), "{file}: {from}");
    fs::write(&path, text.replacen(from, to, 1)).expect("VHDL");
    place
}

#[test]
fn an_error_in_the_vhdl_is_refuted_with_the_words_of_which_it_is_one() {
    let errors = [
        ("displacement", "default", "-", "+", "delta"),
        ("unilateral", "default", "'0'", "'1'", "penetration"),
        ("saturator", "default", "> LIMIT", ">= LIMIT - 1", "limited"),
        ("position_counter", "default", "others => '0'", "others => '1'", "position'"),
        (
            "velocity_register",
            "default",
            "previous := unsigned(position);",
            "previous := unsigned(position) + 1;",
            "previous'",
        ),
        ("zero_order_hold", "default", "countdown - 1", "countdown", "countdown'"),
        ("quadrature_decoder", "default", "\"0001\"", "\"0010\"", "step'"),
        ("pwm", "dead_time_3", "leg.dead - 1", "0", "leg_a"),
        ("edge_timer", "default", "timer = LONGEST", "timer = LONGEST - 1", "interval'"),
        ("sequential_divider", "default", "rest      := (others => '0');", "", "rest'"),
        ("square_root", "default", "partial & \"01\"", "partial & \"11\"", "partial'"),
        ("phantom_forward", "default", "- L2 * signed(cosine3)", "+ L2 * signed(cosine3)", "y"),
        ("cube_room", "narrow", "resize(-LIMIT", "resize(LIMIT", "force_x"),
        (
            "virtual_coupling",
            "default",
            "EXTENSION_WIDTH + 1) - extension",
            "EXTENSION_WIDTH + 1) + extension",
            "torque'",
        ),
        ("biquad", "narrow", "x2   := x1", "x2   := x0", "x2'"),
        (
            "window_difference",
            "5_bit",
            "earlier(1) := unsigned(position)",
            "earlier(1) := unsigned(position) + 1",
            "earlier",
        ),
    ];
    for (name, label, from, to, signal) in errors {
        let block = variants().into_iter().find(|(found, block)| found == label && block.name() == name);
        let (_, block) = block.unwrap_or_else(|| panic!("no {name} {label}"));
        let hdl = changed(name, name, from, to);
        match prove(&*block, &hdl, LIMIT) {
            Ok(Verdict::Refuted(_, around)) => {
                let (heads, _) = around.table(1);
                let differs = |head: &String| head.starts_with(signal) && head.ends_with("(vhdl)");
                assert!(heads.iter().any(differs), "{name}: {heads:?}");
            }
            other => panic!("{name} {label}: {other:?}"),
        }
    }
}

#[test]
fn a_block_without_equations_is_open() {
    let (_, block) = variants().into_iter().find(|(_, block)| block.name() == "foaw").expect("a block");
    assert!(matches!(prove(&*block, Path::new(HDL), LIMIT), Ok(Verdict::Open(_))));
}
