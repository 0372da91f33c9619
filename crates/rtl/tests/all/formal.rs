//! Proofs of blocks, for all inputs and states: of the VHDL as it is, and of VHDL with errors.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use hpu_datapath::{AnyBlock, variants};
use hpu_rtl::formal::{Verdict, prove};

const HDL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../hdl");

/// A solver has this long for a question.
const LIMIT: Duration = Duration::from_secs(60);

/// No solver decides these: products by constants of 31 bits, of words of 32 and 33, and windows of many samples.
/// `hpu check --formal` says so.
const OPEN: [(&str, &str); 8] = [
    ("biquad", "high_pass"),
    ("cube_room", "plain_q22"),
    ("foaw", "default"),
    ("foaw", "loose"),
    ("foaw", "eleven"),
    ("sampled_wall", "foaw"),
    ("input_shaper", "shaping"),
    ("input_shaper", "shaping_8_bit"),
];

/// All counts of tables are 10 to 20 s of GHDL each; of laws, each net that a proof is cut at is a run of Yosys.
fn is_long(name: &str, label: &str) -> bool {
    match name {
        "energy_bounding" => label == "default",
        "trig_cordic" => label != "narrow",
        "trig_quarter" | "trig_interpolated" => !["default", "narrow"].contains(&label),
        _ => false,
    }
}

fn find(name: &str, label: &str) -> Box<dyn AnyBlock> {
    let found = variants().into_iter().find(|(found, block)| found == label && block.name() == name);
    found.map(|(_, block)| block).unwrap_or_else(|| panic!("no {name} {label}"))
}

/// Proves all configurations that have equations and are as long or as short as asked.
fn prove_all(long: bool, at_least: usize) {
    let is_wanted = |label: &str, block: &dyn AnyBlock| {
        let name = block.name();
        block.equations().is_some() && !OPEN.contains(&(name, label)) && is_long(name, label) == long
    };
    let wanted = variants().into_iter().filter(|(label, block)| is_wanted(label, &**block));
    let names: Vec<_> = wanted.map(|(label, block)| (block.name(), label)).collect();
    assert!(names.len() >= at_least, "{}", names.len());
    let next = AtomicUsize::new(0);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((name, label)) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match prove(&*find(name, label), Path::new(HDL), LIMIT) {
                        Ok(Verdict::Proved(_)) => {}
                        other => panic!("{name} {label}: {other:?}"),
                    }
                }
            });
        }
    });
}

#[test]
fn the_vhdl_of_a_block_equals_it_for_all_inputs_and_states() {
    prove_all(false, 150);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn sines_of_wide_words_equal_their_vhdl_for_all_counts() {
    prove_all(true, 10);
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
        ("displacement", "default", "unsigned(position) - unsigned", "unsigned(position) + unsigned", "delta"),
        ("unilateral", "default", "delta(delta'high) = '1'", "delta(delta'high) = '0'", "penetration"),
        ("saturator", "default", "signed(value) > LIMIT", "signed(value) >= LIMIT - 1", "limited"),
        ("position_counter", "default", "<= (others => '0')", "<= (others => '1')", "position'"),
        (
            "velocity_register",
            "default",
            "previous := unsigned(position)",
            "previous := 1 + unsigned(position)",
            "previous'",
        ),
        ("zero_order_hold", "default", "countdown := countdown - 1", "countdown := countdown", "countdown'"),
        ("quadrature_decoder", "default", "\"1000\" => step  <= \"01\"", "\"1000\" => step  <= \"11\"", "step'"),
        ("pwm", "dead_time", "leg.dead - 1", "0", "leg_a"),
        ("edge_timer", "default", "elsif timer = LONGEST", "elsif timer = LONGEST - 1", "interval'|stopped'"),
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
        ("biquad", "narrow", "x2 <= x1", "x2 <= x0", "x2"),
        ("window_difference", "5_bit", "earlier(1) := unsigned", "earlier(1) := 1 + unsigned", "earlier"),
        ("passive_spring", "8_bit", "previous <= unsigned", "previous <= 1 + unsigned", "previous'"),
        ("passivity_controller", "8_bit", "moved    <= signed(d)", "moved    <= -signed(d)", "moved'"),
        ("energy_bounding", "least_conservative_8_bit", "(C1, filled, 2)", "(C1, filled, 1)", "radicand'"),
        ("sampled_wall", "8_bit", "touching <= contact &", "touching <= not contact &", "g_held_hold.q'"),
        ("input_shaper", "phase", "remaining > 1", "remaining > 2", "g_shaper_early'|g_shaper_delay_remaining'"),
        ("foaw", "4_bit", "LIMIT + MISS", "LIMIT - MISS", "velocity'"),
        ("trig_quarter", "narrow", "if NEGATIVE = '1' then", "if NEGATIVE = '1' and index /= 77 then", "sine|cosine"),
        ("trig_cordic", "narrow", "valid  <= '0'", "valid  <= '1'", "valid'"),
    ];
    for (name, label, from, to, signal) in errors {
        let block = find(name, label);
        let hdl = changed(name, name, from, to);
        match prove(&*block, &hdl, LIMIT) {
            Ok(Verdict::Refuted(_, around)) => {
                let (heads, _) = around.table(1);
                // A solver may show any of these.
                let is_one = |head: &String| signal.split('|').any(|signal| head.starts_with(signal));
                let differs = |head: &String| is_one(head) && head.ends_with("(vhdl)");
                assert!(heads.iter().any(differs), "{name}: {heads:?}");
            }
            other => panic!("{name} {label}: {other:?}"),
        }
    }
}

#[test]
fn a_block_without_equations_is_open() {
    assert!(matches!(prove(&*find("foaw", "wide"), Path::new(HDL), LIMIT), Ok(Verdict::Open(_))));
}

#[test]
fn a_block_of_which_all_inputs_are_tried_must_not_remember() {
    // Wrong in the second of two edges with such a phase: no order of counts need show it.
    let line = "        sine    <= wave(address);\n";
    let wrong = "        if seen and phase = 77 then\n          sine <= (others => '0');\n        end if;\n";
    let to = format!("{line}{wrong}        seen := phase = 77;\n");
    let hdl = changed("remembers", "trig_quarter", line, &to);
    let path = hdl.join("trig_quarter.vhd");
    let text = fs::read_to_string(&path).expect("VHDL");
    let marked = "    variable phase   : unsigned(PHASE_WIDTH - 1 downto 0);";
    assert!(text.contains(marked), "a variable");
    fs::write(&path, text.replacen(marked, &format!("{marked}\n    variable seen    : boolean;"), 1)).expect("VHDL");
    match prove(&*find("trig_quarter", "narrow"), &hdl, LIMIT) {
        Ok(Verdict::Open(why)) => assert!(why.contains("registers are made of registers"), "{why}"),
        other => panic!("{other:?}"),
    }
}
