//! Tests the proofs of blocks, for all inputs and states: of the VHDL as it is, and of VHDL with errors.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use hpu_datapath::{AnyBlock, Generic, block_names, configured, proved_variants_of};
use hpu_rtl::Setup;
use hpu_rtl::formal::{NOT_STRAIGHT, Proofs, Prover, Verdict, prove};

const HDL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../hdl");

/// The time that a solver has for a question.
const LIMIT: Duration = Duration::from_secs(60);
/// The same in `testbench/long.sh`: the longest takes 90 s beside other work.
const LONG_LIMIT: Duration = Duration::from_secs(600);

/// Returns whether the proof of a configuration takes too long for the test command: most of them 5 to 30 s. For
/// tables, GHDL tries all counts; for the others, a solver or Yosys takes so long.
fn is_long(name: &str, label: &str) -> bool {
    match name {
        "biquad" => ["high_pass", "extreme"].contains(&label),
        "cube_room" => ["default", "plain_q22"].contains(&label),
        "energy_bounding" => ["default", "least_conservative"].contains(&label),
        "foaw" => ["default", "loose", "eleven"].contains(&label),
        "input_shaper" => label == "shaping",
        "sequential_divider" | "window_difference" => label == "wide",
        "square_root" => label == "62_bit",
        // Of these, every input of a turn is tried.
        "trig_table" | "trig_cordic" | "trig_quarter" | "trig_interpolated" => label != "narrow",
        // 1 to 8 s each, and many: those of 8 bits stand for them. The tests of the command prove `passive_spring` in
        // the widths of a scene.
        "passive_spring" => ["default", "fine", "no_revival", "one_and_a_half"].contains(&label),
        "passivity_controller" => ["default", "exact", "exact_credit", "wide_energy", "wide_torque"].contains(&label),
        "sampled_wall" => label == "foaw",
        // 6 s of a core for 8 bits. The test command holds each configuration on 45000 vectors or more.
        "gimbal_inverse" => true,
        "fractional_difference" => label == "default",
        // Wirings with long tables: the small ones stand for them.
        "phantom_loop" | "phantom_shared_loop" => !["small", "all_distinct"].contains(&label),
        // Wirings with windows of 64 words: the short and the distinct words stand for them.
        "gimbal_loop" | "gimbal_shear_loop" => ["default", "plain", "all_distinct"].contains(&label),
        // The loops around laws are generated: one stands for all.
        "braking_pulse_loop"
        | "torque_table_loop"
        | "energy_bounding_loop"
        | "passive_spring_loop"
        | "passivity_controller_loop"
        | "position_pid_loop"
        | "virtual_coupling_loop" => label == "all_distinct",
        "servo_control" => label == "window_64",
        _ => false,
    }
}

fn find(name: &str, label: &str) -> Box<dyn AnyBlock> {
    let found = proved_variants_of(|block| block == name).into_iter().find(|(found, _)| found == label);
    found.map(|(_, block)| block).unwrap_or_else(|| panic!("no {name} {label}"))
}

/// Returns the proofs that earlier runs have made, as `hpu check --formal` remembers them: by the VHDL, the equations,
/// the tools and the sources of the proof.
fn proofs() -> Proofs {
    Proofs::open(Path::new(env!("CARGO_TARGET_TMPDIR")).join("proofs"), None).expect("the tools of a proof")
}

/// The number of configurations of a block that the test command proves.
const FEW: usize = 1;

/// Proves configurations that have equations: the first short one of each block, or all others.
fn prove_all(others: bool, at_least: usize) {
    let mut short = BTreeMap::<_, usize>::new();
    let mut is_wanted = |label: &str, block: &dyn AnyBlock| {
        let name = block.name();
        if block.equations().is_none() {
            return false;
        }
        if is_long(name, label) {
            return others;
        }
        let before = short.entry(name).or_default();
        *before += 1;
        (*before > FEW) == others
    };
    let wanted = proved_variants_of(|_| true).into_iter().filter(|(label, block)| is_wanted(label, &**block));
    let names: Vec<_> = wanted.map(|(label, block)| (block.name(), label)).collect();
    assert!(names.len() >= at_least, "{}", names.len());
    let (proofs, setup, next) = (proofs(), Setup::from(Path::new(HDL)), AtomicUsize::new(0));
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((name, label)) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
                    // Its products of 20 bits are beyond every solver; its vectors stand.
                    let is_beyond = (*name, label.as_str()) == ("gimbal_inverse", "default");
                    let limit = if others && !is_beyond { LONG_LIMIT } else { LIMIT };
                    match proofs.prove(&*find(name, label), &setup, limit) {
                        Ok(Verdict::Proved(_)) => {}
                        Ok(Verdict::Open(_)) if is_beyond => {}
                        other => panic!("{name} {label}: {other:?}"),
                    }
                }
            });
        }
    });
}

#[test]
fn the_vhdl_of_a_block_equals_it_for_all_inputs_and_states() {
    prove_all(false, 45);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn blocks_in_all_other_configurations_equal_their_vhdl_for_all_inputs_and_states() {
    prove_all(true, 145);
}

/// Makes a folder with the VHDL in which one file is changed.
fn changed(dir: &str, file: &str, from: &str, to: &str) -> PathBuf {
    let place = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("formal").join(dir);
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(&place).expect("a folder");
    for folder in [HDL.to_string(), format!("{HDL}/generated")] {
        for entry in fs::read_dir(folder).expect("the VHDL") {
            let entry = entry.expect("an entry");
            if entry.path().is_file() {
                fs::copy(entry.path(), place.join(entry.file_name())).expect("a copy");
            }
        }
    }
    let path = place.join(format!("{file}.vhd"));
    let text = fs::read_to_string(&path).expect("VHDL");
    assert!(text.contains(from), "{file}: {from}");
    fs::write(&path, text.replacen(from, to, 1)).expect("VHDL");
    place
}

#[test]
fn a_row_of_two_words_of_which_one_is_no_register_is_proved() {
    // Between the limited value and the output is one register, in a variable of three words.
    let block = configured("command_limiter", &[("SETTLING", Generic::Integer(2))]).expect("it is known");
    let found = prove(&*block.expect("a configuration"), Path::new(HDL), LIMIT);
    assert!(matches!(found, Ok(Verdict::Proved(_))), "{found:?}");
}

/// An error in a block's VHDL: the block, its configuration, the text that is replaced, its replacement, and the
/// signals that it spoils.
type Sown = (&'static str, &'static str, &'static str, &'static str, &'static str);

const ERRORS: &[Sown] = &[
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
    ("square_root", "default", "partial & \"01\"", "partial & \"11\"", "partial'"),
    ("phantom_forward", "default", "- L2 * signed(cosine3)", "+ L2 * signed(cosine3)", "y"),
    ("window_difference", "5_bit", "earlier(1) := unsigned", "earlier(1) := 1 + unsigned", "earlier"),
    ("servo_control", "narrow", "primed <= '1'", "primed <= '0'", "primed'"),
    ("servo_control", "window_4", "before(j - 1)", "before(1)", "before"),
    ("sample_timer", "6_bit", "countdown - 1", "countdown - 2", "countdown'"),
    ("control_switch", "narrow", "to_signed(2**DECAY - 1,", "to_signed(2**DECAY,", "offset'"),
    ("clarke", "narrow_three", "extended(a), 1) - extended(b)", "extended(a), 1) + extended(b)", "alpha"),
    ("park", "narrow", "- alpha_sine", "+ alpha_sine", "q"),
    ("inverse_park", "narrow", "+ q_cosine", "- q_cosine", "beta"),
    ("space_vector", "narrow", "WHOLE > MOST", "WHOLE >= MOST - 1", "duty_"),
    ("three_phase_pwm", "short", "leg.dead - 1", "0", "leg_"),
    ("sinc3", "4_bits", "last2  := first;", "last2  := second;", "last2'"),
    ("spi_master", "mode_1", "incoming(WIDTH - 2 downto 0) & miso", "incoming(WIDTH - 2 downto 0) & '0'", "incoming'"),
    ("ssi_master", "short", "timer := PAUSE - 1", "timer := PAUSE", "timer'"),
];

/// The same in larger blocks.
const LONG_ERRORS: &[Sown] = &[
    ("sequential_divider", "default", "rest      := (others => '0');", "", "rest'"),
    ("cube_room", "narrow", "resize(-LIMIT", "resize(LIMIT", "force_x"),
    ("virtual_coupling", "default", "EXTENSION_WIDTH + 1) - extension", "EXTENSION_WIDTH + 1) + extension", "torque'"),
    ("biquad", "narrow", "x2 <= x1", "x2 <= x0", "x2"),
    ("passive_spring", "8_bit", "previous <= unsigned", "previous <= 1 + unsigned", "previous'"),
    ("passivity_controller", "8_bit", "moved    <= signed(d)", "moved    <= -signed(d)", "moved'"),
    ("energy_bounding", "least_conservative_8_bit", "(C1, filled, 2)", "(C1, filled, 1)", "radicand'"),
    ("sampled_wall", "8_bit", "touching <= contact &", "touching <= not contact &", "g_held_hold.q'"),
    ("input_shaper", "phase", "remaining > 1", "remaining > 2", "g_shaper_early'|g_shaper_delay_remaining'"),
    ("foaw", "4_bit", "LIMIT + MISS", "LIMIT - MISS", "velocity'"),
    ("impedance_control", "narrow", "to_signed(FORCE_LIMIT,", "to_signed(FORCE_LIMIT + 1,", "drive"),
    ("fractional_difference", "narrow", "sum + term", "sum - term", "sum'"),
    ("trig_quarter", "narrow", "if NEGATIVE = '1' then", "if NEGATIVE = '1' and index /= 77 then", "sine|cosine"),
    ("trig_cordic", "narrow", "valid  <= '0'", "valid  <= '1'", "valid'"),
];

fn refuted(errors: &[Sown]) {
    for &(name, label, from, to, signal) in errors {
        let block = find(name, label);
        let hdl = changed(name, name, from, to);
        match prove(&*block, &hdl, LIMIT) {
            Ok(Verdict::Refuted(_, around)) => {
                let (heads, _) = around.table(1);
                // A solver may show any of these signals.
                let is_one = |head: &String| signal.split('|').any(|signal| head.starts_with(signal));
                let differs = |head: &String| is_one(head) && head.ends_with("(vhdl)");
                assert!(heads.iter().any(differs), "{name}: {heads:?}");
            }
            other => panic!("{name} {label}: {other:?}"),
        }
    }
}

#[test]
fn an_error_in_the_vhdl_is_refuted_with_the_words_of_which_it_is_one() {
    refuted(ERRORS);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn an_error_in_a_larger_block_is_refuted_too() {
    refuted(LONG_ERRORS);
}

#[test]
fn a_block_without_equations_is_open() {
    assert!(matches!(prove(&*find("foaw", "wide"), Path::new(HDL), LIMIT), Ok(Verdict::Open(_))));
}

#[test]
fn a_block_of_which_all_inputs_are_tried_must_not_remember() {
    // The sine is wrong in the second of two edges with such a phase; no sequence of counts need show it.
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

/// Compares the wirings of all configurations that are as long or as short as asked; `expected` are the blocks.
fn compare_all<const N: usize>(long: bool, expected: [&'static str; N]) {
    let is_wanted = |label: &str, block: &dyn AnyBlock| block.parts().is_some() && is_long(block.name(), label) == long;
    let composed = proved_variants_of(|_| true).into_iter().filter(|(label, block)| is_wanted(label, &**block));
    let names: Vec<_> = composed.map(|(label, block)| (block.name(), label)).collect();
    let of: BTreeSet<_> = names.iter().map(|(name, _)| *name).collect();
    assert_eq!(of, BTreeSet::from(expected));
    let (prover, next) = (Prover::new(Path::new(HDL), LIMIT), AtomicUsize::new(0));
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((name, label)) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let found = prover.wiring(&*find(name, label));
                    assert!(matches!(found, Ok(None)), "{name} {label}: {found:?}");
                }
            });
        }
    });
}

#[test]
fn every_wiring_equals_its_vhdl_in_every_listed_configuration() {
    compare_all(
        false,
        [
            "axis_front",
            "braking_pulse_loop",
            "conventional_loop",
            "energy_bounding_loop",
            "epfl_paddle_loop",
            "foc_knob_loop",
            "foc_loop",
            "gimbal_loop",
            "gimbal_shear_loop",
            "hybrid_loop",
            "passive_spring_loop",
            "passivity_controller_loop",
            "phantom_io",
            "phantom_loop",
            "phantom_shared_loop",
            "position_pid_loop",
            "sampled_wall_loop",
            "torque_table_loop",
            "virtual_coupling_loop",
        ],
    );
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn wirings_that_take_longer_equal_their_vhdl() {
    compare_all(
        true,
        [
            "braking_pulse_loop",
            "energy_bounding_loop",
            "gimbal_loop",
            "gimbal_shear_loop",
            "passive_spring_loop",
            "passivity_controller_loop",
            "phantom_loop",
            "phantom_shared_loop",
            "position_pid_loop",
            "torque_table_loop",
            "virtual_coupling_loop",
        ],
    );
}

#[test]
fn a_wiring_of_proved_blocks_is_proved_and_names_those_that_are_not() {
    let prover = Prover::new(Path::new(HDL), LIMIT).remembering(proofs());
    let parts = |name, label| match prover.prove(&*find(name, label)) {
        Ok(Verdict::Wired(parts)) => parts,
        other => panic!("{name}: {other:?}"),
    };
    let places = |proved: bool, name| -> Vec<String> {
        let is_wanted = |verdict: &Verdict| matches!(verdict, Verdict::Proved(_)) == proved;
        parts(name, "default").into_iter().filter(|part| is_wanted(&part.verdict)).map(|part| part.place).collect()
    };
    let front = ["sync", "decoder", "counter", "offset", "wall"];
    assert_eq!(places(true, "axis_front"), front);
    assert!(places(false, "axis_front").is_empty());
    let own = ["spring_mult", "velocity_reg", "damping_mult", "sum", "limiter", "modulator"];
    assert_eq!(places(true, "hybrid_loop"), [&front[..], &own].concat());
    assert_eq!(
        places(true, "sampled_wall_loop"),
        [
            &front.map(|place| format!("front.{place}"))[..],
            &["law", "shaper", "limiter", "modulator"].map(String::from)
        ]
        .concat()
    );
    // The engine's process has no equations.
    let engine =
        parts("phantom_shared_loop", "small").into_iter().find(|part| part.place == "engine").expect("an engine");
    assert_eq!((engine.block, &engine.verdict), ("phantom_engine", &Verdict::Open(NOT_STRAIGHT.to_string())));
    assert!(engine.generics.contains(&("COMMAND_WIDTH", Generic::Integer(16))), "{:?}", engine.generics);
}

#[test]
fn an_error_in_a_wiring_is_refuted_at_its_place() {
    let errors = [
        // Two ports are swapped.
        (
            "hybrid_loop",
            "8_bit",
            "position  => position,\n      reference => reference,",
            "position  => reference,\n      reference => position,",
            "instance offset, port position: at position, driven by counter.position here, at reference in the VHDL",
        ),
        // A port is at another net of the same width.
        (
            "phantom_loop",
            "small",
            "valid1  => valid1",
            "valid1  => valid2",
            "instance scale1, port valid1: at valid1, driven by trig1.valid here, at trig2.valid in the VHDL",
        ),
        // One generic stands in another's place.
        (
            "virtual_coupling_loop",
            "distinct",
            "STIFFNESS_FRAC  => STIFFNESS_FRAC,",
            "STIFFNESS_FRAC  => DAMPING_FRAC,",
            "instance law: STIFFNESS_FRAC 3 here, 5 in the VHDL",
        ),
        // In every configuration with vectors, two joints are alike.
        (
            "phantom_loop",
            "all_distinct",
            "GAIN          => GAIN_3",
            "GAIN          => GAIN_2",
            "instance scale3: GAIN 220289 here, 220291 in the VHDL",
        ),
        (
            "hybrid_loop",
            "antiphase",
            "ANTIPHASE => ANTIPHASE",
            "ANTIPHASE => not ANTIPHASE",
            "instance modulator: not pwm",
        ),
        // A constant is changed: a generic's, and a tied port's.
        (
            "hybrid_loop",
            "8_bit",
            "LIMIT     => 2**PWM_WIDTH - 1",
            "LIMIT     => 2**PWM_WIDTH - 2",
            "instance limiter: LIMIT 63 here, 62 in the VHDL",
        ),
        (
            "phantom_io",
            "default",
            "period => \"01\"",
            "period => \"10\"",
            "instance hold, port period: at '01' here, at '10' in the VHDL",
        ),
        // A controller is given the other's current; a time stands in another's place.
        (
            "foc_loop",
            "short",
            "measured     => d,",
            "measured     => q,",
            "instance control_d, port measured: at d, driven by rotor.d here, at rotor.q in the VHDL",
        ),
        (
            "foc_loop",
            "all_distinct",
            "DEAD_TIME    => DEAD_TIME,",
            "DEAD_TIME    => MIN_PULSE,",
            "instance modulator: DEAD_TIME 11 here, 14 in the VHDL",
        ),
        // An output is left open.
        (
            "hybrid_loop",
            "8_bit",
            "contact     => contact,",
            "contact     => open,",
            "instance sum, port contact: at contact, driven by wall.contact here, at 'x' in the VHDL",
        ),
        // An inverter is added.
        (
            "hybrid_loop",
            "8_bit",
            "contact => contact,",
            "contact => not contact,",
            "instance sum, port contact: at contact, driven by wall.contact here, at $not in the VHDL",
        ),
        (
            "passive_spring_loop",
            "distinct",
            "rst     => rst,\n      command => command,",
            "rst     => not rst,\n      command => command,",
            "instance modulator, port rst: at rst here, at $not in the VHDL",
        ),
        // Only a slice of a width is connected.
        (
            "hybrid_loop",
            "8_bit",
            "reference => reference,",
            "reference => \"00\" & reference(POSITION_WIDTH - 1 downto 2),",
            "instance offset, port reference: at reference here, at '00' & reference[7:2] in the VHDL",
        ),
        // There is another block with the same ports, one more block, and one less.
        (
            "energy_bounding_loop",
            "distinct",
            "begin\n",
            "begin\n\n  more : entity work.unilateral generic map (WIDTH => POSITION_WIDTH)\n    \
             port map (delta => delta, contact => open, penetration => open);\n",
            "instance more: the VHDL has it",
        ),
        (
            "axis_front",
            "8_bit",
            "wall : entity work.unilateral",
            "other : entity work.unilateral",
            "instance wall: the VHDL has none",
        ),
        // The error is in a block inside, or at an output of the whole.
        (
            "sampled_wall_loop/axis_front",
            "distinct",
            "a     => a,\n      b     => b,\n      step",
            "a     => b,\n      b     => a,\n      step",
            "instance front.decoder, port a: at a, driven by sync.a here, at sync.b in the VHDL",
        ),
        (
            "conventional_loop",
            "8_bit",
            "a_high  => a_high,\n      a_low   => a_low,",
            "a_high  => a_low,\n      a_low   => a_high,",
            "output a_high: at a_high, driven by modulator.a_high here, at modulator.a_low in the VHDL",
        ),
    ];
    for (index, (name, label, from, to, place)) in errors.into_iter().enumerate() {
        let (name, file) = name.split_once('/').unwrap_or((name, name));
        let hdl = changed(&format!("wiring-{index}"), file, from, to);
        match Prover::new(&hdl, LIMIT).prove(&*find(name, label)) {
            Ok(Verdict::Miswired(why)) => assert!(why.starts_with(place), "{name}: `{why}`, not `{place}`"),
            other => panic!("{name} {label}, {to}: {other:?}"),
        }
    }
}

#[test]
fn every_block_and_loop_has_a_configuration_that_tells_all_its_generics_apart() {
    let mut told_apart = 0;
    for name in block_names() {
        let all: Vec<_> =
            proved_variants_of(|block| block == *name).iter().map(|(_, block)| block.generics()).collect();
        let whole = |of: &[(&'static str, Generic)]| -> Vec<i64> {
            of.iter()
                .filter_map(|(_, value)| if let Generic::Integer(value) = value { Some(*value) } else { None })
                .collect()
        };
        let differ = |of: &Vec<(&'static str, Generic)>| {
            let whole = whole(of);
            whole.iter().collect::<BTreeSet<_>>().len() == whole.len()
        };
        assert!(all.iter().any(differ), "{name}: give it a configuration in hpu_datapath's distinct.rs");
        // Of truth values only two can differ at a time.
        for (one, (generic, value)) in all[0].iter().enumerate() {
            for (other, (beside, _)) in all[0]
                .iter()
                .enumerate()
                .skip(one + 1)
                .filter(|(_, (_, beside))| matches!((value, beside), (Generic::Boolean(_), Generic::Boolean(_))))
            {
                let differs = all.iter().any(|generics| generics[one].1 != generics[other].1);
                assert!(differs, "{name}: {generic} and {beside} are equal in every configuration");
            }
        }
        told_apart += usize::from(whole(&all[0]).len() > 1);
    }
    assert!(told_apart > 40, "{told_apart}");
}

#[test]
fn a_generic_in_another_s_place_is_no_difference_where_the_hardware_is_the_same() {
    // Both have no fraction bits in this configuration, and the law does not read the scale.
    for (from, to) in [
        ("STIFFNESS_FRAC  => STIFFNESS_FRAC,", "STIFFNESS_FRAC  => DAMPING_FRAC,"),
        ("SCALE_FRAC      => SCALE_FRAC,", "SCALE_FRAC      => PWM_WIDTH,"),
    ] {
        let hdl = changed("wiring-same", "sampled_wall_loop", from, to);
        let found = Prover::new(&hdl, LIMIT).wiring(&*find("sampled_wall_loop", "default"));
        assert!(matches!(found, Ok(None)), "{to}: {found:?}");
    }
}

#[test]
fn an_error_inside_a_block_is_no_error_of_the_wiring() {
    let hdl = changed("wiring-leaf", "unilateral", "delta(delta'high) = '1'", "delta(delta'high) = '0'");
    match Prover::new(&hdl, LIMIT).prove(&*find("hybrid_loop", "8_bit")) {
        Ok(Verdict::Wired(parts)) => {
            let refuted = |verdict: &Verdict| matches!(verdict, Verdict::Refuted(..));
            let places: Vec<_> = parts.iter().filter(|part| refuted(&part.verdict)).map(|part| &*part.place).collect();
            assert_eq!(places, ["wall"]);
        }
        other => panic!("{other:?}"),
    }
}

/// Texts of a block's VHDL, and what replaces them.
type Changes<'a> = &'a [(&'a str, &'a str)];

/// Returns the verdict on a configuration of a block whose VHDL has these texts replaced.
fn verdict_on(dir: &str, name: &str, label: &str, changes: &[(&str, &str)]) -> Verdict {
    let hdl = changed(dir, name, changes[0].0, changes[0].1);
    let path = hdl.join(format!("{name}.vhd"));
    let mut text = fs::read_to_string(&path).expect("VHDL");
    for (from, to) in &changes[1..] {
        assert!(text.contains(from), "{name}: {from}");
        text = text.replacen(from, to, 1);
    }
    fs::write(&path, text).expect("VHDL");
    Prover::new(&*hdl, LIMIT).prove(&*find(name, label)).unwrap_or_else(|error| panic!("{name} {label}: {error}"))
}

#[test]
fn a_register_that_the_clock_s_rising_edge_alone_does_not_clock_is_refused() {
    let falling = ("rising_edge(clk)", "falling_edge(clk)");
    let signal = |value: &'static str| ("begin\n\n  process (clk)", value);
    let refused: [(&str, &str, Changes, &str); 8] = [
        ("position_counter", "8_bit", &[falling], "register position is clocked by the falling edge of clk"),
        (
            "position_counter",
            "8_bit",
            &[("rising_edge(clk)", "rising_edge(step(0))")],
            "register position is clocked by step[0], not by clk itself",
        ),
        (
            "synchronizer",
            "default",
            &[
                signal("  signal gated : std_logic;\nbegin\n  gated <= clk and not a_pin;\n  process (gated)"),
                ("rising_edge(clk)", "rising_edge(gated)"),
            ],
            "is clocked by logic ($and), not by clk itself",
        ),
        (
            "position_counter",
            "8_bit",
            &[
                signal(
                    "  signal once, again : std_logic;\nbegin\n  once <= not clk;\n  again <= not once;\n  \
                     process (again)",
                ),
                ("rising_edge(clk)", "rising_edge(again)"),
            ],
            "register position is clocked by logic ($not), not by clk itself",
        ),
        // A register that clocks another one.
        (
            "synchronizer",
            "default",
            &[
                (
                    "begin\n\n  process (clk)",
                    "  signal ripple : std_logic;\nbegin\n  process (a)\n  begin\n    if rising_edge(a) then\n      \
                     ripple <= b_pin;\n    end if;\n  end process;\n\n  process (clk)",
                ),
                ("b       <= stage_b;", "b       <= ripple;"),
            ],
            "register ripple is clocked by register a, not by clk itself",
        ),
        // A memory, and an output of a table that is tried whole.
        ("window_difference", "5_bit", &[falling], "is clocked by the falling edge of clk"),
        ("trig_table", "narrow", &[falling], "is clocked by the falling edge of clk"),
        (
            "position_counter",
            "8_bit",
            &[
                ("process (clk)", "process (clk, rst)"),
                (
                    "    if rising_edge(clk) then\n",
                    "    if rst = '1' then\n      position <= (others => '0');\n    elsif rising_edge(clk) then\n",
                ),
                ("\n      if rst = '1' then\n        position <= (others => '0');\n      end if;\n", ""),
            ],
            "register position is set or reset at once by rst, not at clock edges",
        ),
    ];
    for (index, (name, label, changes, says)) in refused.into_iter().enumerate() {
        match verdict_on(&format!("clock-{index}"), name, label, changes) {
            Verdict::Refused(why) => assert!(why.contains(says), "{name}: `{why}`, not `{says}`"),
            other => panic!("{name} {label}, {says}: {other:?}"),
        }
    }
    // A block whose clock edge is not told as equations is not proved, but its clock is read.
    let engine = verdict_on("clock-engine", "phantom_engine", "narrow", &[falling]);
    assert!(matches!(&engine, Verdict::Refused(why) if why.contains("the falling edge of clk")), "{engine:?}");
}

#[test]
fn an_output_that_follows_the_reset_between_clock_edges_is_refused() {
    let changes = [
        (
            "architecture rtl of position_counter is\nbegin\n",
            "architecture rtl of position_counter is\n  signal count : std_logic_vector(WIDTH - 1 downto 0);\nbegin\n  \
             position <= (others => '0') when rst = '1' else count;\n",
        ),
        ("signed('0' & position)", "signed('0' & count)"),
        ("position <= std_logic_vector", "count <= std_logic_vector"),
        ("        position <= (others => '0');", "        count <= (others => '0');"),
    ];
    match verdict_on("reset-at-once", "position_counter", "8_bit", &changes) {
        Verdict::Refused(why) => assert_eq!(why, "output position follows the reset at once, not at clock edges"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_wrong_clock_in_a_leaf_refuses_the_wirings_around_it() {
    let hdl = changed("clock-leaf", "velocity_register", "rising_edge(clk)", "rising_edge(position(0))");
    match Prover::new(&*hdl, LIMIT).prove(&*find("hybrid_loop", "8_bit")) {
        Ok(Verdict::Wired(parts)) => {
            let refused = parts.iter().filter(|part| !matches!(part.verdict, Verdict::Proved(_)));
            let places: Vec<_> = refused.map(|part| (&*part.place, &part.verdict)).collect();
            let why = "clocked by position[0], not by clk itself";
            assert!(
                matches!(&places[..], [("velocity_reg", Verdict::Refused(said))] if said.ends_with(why)),
                "{places:?}"
            );
        }
        other => panic!("{other:?}"),
    }
    let hdl = changed(
        "clock-instance",
        "hybrid_loop",
        "begin\n",
        "  signal inverted : std_logic;\nbegin\n  inverted <= not clk;\n",
    );
    let path = hdl.join("hybrid_loop.vhd");
    let text = fs::read_to_string(&path).expect("VHDL");
    let at = text.find("velocity_reg : entity").expect("an instance");
    let (head, rest) = text.split_at(at);
    let clock = rest.find("=> clk").map(|clock| &rest[..clock]).expect("a clock");
    fs::write(&path, format!("{head}{clock}=> inverted{}", &rest[clock.len() + "=> clk".len()..])).expect("VHDL");
    match Prover::new(&*hdl, LIMIT).prove(&*find("hybrid_loop", "8_bit")) {
        Ok(Verdict::Miswired(why)) => {
            assert_eq!(why, "instance velocity_reg, port clk: at clk here, at $not in the VHDL");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn errors_of_the_reset_and_of_enables_are_refuted() {
    let refuted: [(&str, &str, Changes); 4] = [
        ("position_counter", "8_bit", &[("if rst = '1'", "if rst = '0'")]),
        ("synchronizer", "default", &[("        stage_b := '0';\n", "")]),
        // Power-up instead of the reset.
        (
            "synchronizer",
            "default",
            &[
                ("        stage_b := '0';\n", ""),
                ("variable stage_b : std_logic;", "variable stage_b : std_logic := '0';"),
            ],
        ),
        ("zero_order_hold", "8_bit", &[("if countdown = 0 then", "if countdown /= 0 then")]),
    ];
    for (index, (name, label, changes)) in refuted.into_iter().enumerate() {
        let found = verdict_on(&format!("reset-{index}"), name, label, changes);
        assert!(matches!(found, Verdict::Refuted(..)), "{name} {label}: {found:?}");
    }
}

#[test]
fn an_output_that_may_be_z_or_x_is_refuted_at_an_input_for_which_it_is() {
    let line = "    penetration <= delta;\n";
    for state in ['Z', 'X'] {
        let to = format!("{line}    if delta = x\"05\" then penetration <= (others => '{state}'); end if;\n");
        match verdict_on(&format!("state-{state}"), "unilateral", "8_bit", &[(line, &to)]) {
            Verdict::Refuted(about, around) => {
                let says = "its inputs, where output penetration is unknown (X, Z or driven by nothing)";
                assert_eq!(about, says);
                let delta = around.columns.iter().position(|column| column.name == "delta").expect("a column");
                assert_eq!(around.rows[0].expected[delta], "05");
            }
            other => panic!("{state}: {other:?}"),
        }
    }
}
