//! Golden vectors are written, read back, refused when wrong, and up to date where committed.

use std::path::Path;

use hpu_datapath::{AnyBlock, block_by_name, variants};
use hpu_rtl::{Header, Stimulus, VectorError, Vectors, stale, stimuli, stimuli_from_csv};
use hpu_signal::Format;

/// Returns the vectors of a counter that steps down over the wrap and up again: reset, -1, +1.
fn counter() -> Vectors {
    let mut block = block_by_name("position_counter").expect("a block");
    let steps = [(true, 0), (false, -1), (false, 1)];
    Vectors::record(&mut *block, steps.map(|(rst, step)| Stimulus { rst, words: vec![step] }))
}

const COUNTER: &str = "\
# position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12
1 0 000
0 3 fff
0 1 000
# end 3 rows
";

#[test]
fn a_vector_file_is_hex_words_under_a_format_line() {
    assert_eq!(counter().to_text(), COUNTER);
}

#[test]
fn csv_is_decimal_under_names() {
    assert_eq!(counter().to_csv(), "rst,step,position\n1,0,0\n0,-1,4095\n0,1,0\n");
}

#[test]
fn readmemh_packs_a_row_into_one_number_first_column_on_top() {
    // A row has 15 bits: rst, step with two, position with twelve.
    let expected = "\
// position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12
// rst[14:14] step[13:12] position[11:0]
4000
3fff
1000
";
    assert_eq!(counter().memory().to_readmemh(), expected);
}

#[test]
fn every_set_of_every_configuration_is_read_back_as_it_was_written() {
    for (label, mut block) in variants() {
        let mut rows = stimuli::directed(&*block);
        rows.extend(stimuli::random(&*block, 7, 300));
        block.reset();
        let vectors = Vectors::record(&mut *block, rows);
        let again = Vectors::parse(&vectors.to_text(), Header::of(&*block));
        assert!(again.as_ref() == Ok(&vectors), "{} {label}", block.name());
    }
}

#[test]
fn the_stimuli_of_every_configuration_move_every_output_bit_that_can_move() {
    let mut idle = Vec::new();
    for (label, mut block) in variants() {
        let mut rows = stimuli::directed(&*block);
        rows.extend(stimuli::random(&*block, 1, 20_000));
        block.reset();
        let Vectors { header, rows } = Vectors::record(&mut *block, rows);
        for (index, column) in header.outputs.iter().enumerate() {
            let words = rows.iter().map(|row| row[header.inputs.len() + index]);
            let bits = words.map(|word| column.format.bits(word));
            let (always, ever) = bits.fold((u64::MAX, 0), |(always, ever), word| (always & word, ever | word));
            let still = column.format.bits(-1) & !(ever & !always);
            // The depth of an n-bit displacement has n-1 bits.
            let top = 1 << (column.format.width() - 1);
            if still != 0 && (column.name, still) != ("penetration", top) {
                idle.push(format!("{} {label} {} {still:x}", header.block, column.name));
            }
        }
    }
    // These words have more fraction bits than their values need.
    let widened = |entry: &str| {
        let known = ["biquad default y f", "clarke default alpha 7", "clarke wide alpha 3ff"];
        entry.contains(" widening ") || known.contains(&entry)
    };
    // The cosines of angles below a right angle are positive, and at most 1.
    let positive = |entry: &str| entry.starts_with("trig_table ") && entry.ends_with(" cosine ff800000");
    // These are memories of velocities and couplings in whole counts, and of a coupling that is never pulled.
    let memory = |entry: &str| {
        let known = [
            "sampled_wall default memory ff",
            "sampled_wall 8_bit memory f",
            "sampled_wall live memory f",
            "sampled_wall window memory f",
            "virtual_coupling default memory 800ff",
            "virtual_coupling soft memory 80000",
            "virtual_coupling 8_bit memory 400",
        ];
        known.contains(&entry)
    };
    // These laws and shapers never pull. So the two upper bits of a torque, the sign of a shaped torque, and the gates
    // that only a negative command opens never change.
    let pushing = |entry: &str| match entry.split(' ').collect::<Vec<_>>()[..] {
        ["virtual_coupling" | "passive_spring", _, "torque", bits] => bits == "3000" || bits == "c0",
        ["virtual_coupling_loop" | "passive_spring_loop", "default" | "distinct", "b_high", _] => true,
        // A pulse is never negative.
        ["braking_pulse", _, "memory", bits] => bits == "100000" || bits == "4000",
        // Nor is one of the eight torques of this table.
        ["torque_table", "steps", "memory", "40"] => true,
        ["input_shaper", _, "shaped", bits] => bits == "2000" || bits == "80",
        // These loops have a shaper.
        [name, label, "b_high", _] if label.ends_with("8_bit") => name.ends_with("_loop"),
        ["sampled_wall_loop", "distinct", "b_high", _] => true,
        ["sampled_wall_loop", "immediate", "a_low" | "b_high", _] => true,
        _ => false,
    };
    // A radius is a positive length below half of its range in the narrow words, and a crank's angle is below half a
    // turn. Without guard bits an angle is a sum of the same constants with either sign, so its parity stays.
    let of_the_gimbal = |entry: &str| match entry.split(' ').collect::<Vec<_>>()[..] {
        ["gimbal_inverse" | "crank_table", _, "radius", bits] => ["80000", "2000", "300"].contains(&bits),
        ["gimbal_inverse", _, "crank", bits] => ["80000", "2000", "100"].contains(&bits),
        ["gimbal_inverse", "short", "pitch" | "roll", "1"] => true,
        _ => false,
    };
    // A word of bits is a sum of as many ones with either sign as a power of two tells.
    let even = |entry: &str| entry.starts_with("sinc3 ") && entry.ends_with(" value 1");
    idle.retain(|entry| !of_the_gimbal(entry) && !even(entry));
    idle.retain(|entry| !widened(entry) && !positive(entry) && !memory(entry) && !pushing(entry));
    let by_design = [
        "saturator limit_0 limited 1ff",
        // Even the greatest command is off once a period, and then again in dead time until the period ends.
        "pwm dead_time_longer_than_period a_high 1",
    ];
    assert_eq!(idle, by_design);
}

/// Returns each reset with the rows up to the next reset: the number of edges that the reset takes, and the rows.
fn between_resets(rows: &[Stimulus]) -> Vec<(usize, &[Stimulus])> {
    let mut all = Vec::new();
    let mut left = rows;
    while !left.is_empty() {
        let edges = left.iter().take_while(|row| row.rst).count();
        let rest = left[edges..].iter().take_while(|row| !row.rst).count();
        all.push((edges, &left[..edges + rest]));
        left = &left[edges + rest..];
    }
    all
}

/// Returns the numbers of edges of the resets after the first whose effect is visible: without the reset, the same
/// inputs would have given other outputs before the next reset.
fn seen_resets(block: &mut dyn AnyBlock, rows: &[Stimulus]) -> Vec<usize> {
    let stretches = between_resets(rows);
    let mut seen = Vec::new();
    for pair in stretches.windows(2) {
        let [(_, before), (edges, after)] = pair else { unreachable!("two") };
        block.reset();
        before.iter().filter(|row| !row.rst).for_each(|row| drop(block.tick(&row.words)));
        let without: Vec<_> = after.iter().map(|row| block.tick(&row.words)).collect();
        let with = after.iter().map(|row| if row.rst { block.reset() } else { block.tick(&row.words) });
        if with.zip(without).any(|(with, without)| with != without) {
            seen.push(*edges);
        }
    }
    seen
}

#[test]
fn every_clocked_block_is_reset_in_the_midst_of_activity_for_one_edge_and_for_several() {
    let mut unseen = Vec::new();
    for (label, mut block) in variants().into_iter().filter(|(_, block)| block.clocked()) {
        let name = format!("{} {label}", block.name());
        let directed = stimuli::directed(&*block);
        for rows in [&directed, &stimuli::random(&*block, 1, 96)] {
            assert!(rows[0].rst, "{name}");
            let edges: Vec<_> = between_resets(rows)[1..].iter().map(|(edges, _)| *edges).collect();
            assert!(edges.contains(&1) && edges.iter().any(|edges| *edges >= 3), "{name}: resets of {edges:?} edges");
        }
        let seen = seen_resets(&mut *block, &directed);
        if !seen.contains(&1) || seen.iter().all(|edges| *edges < 3) {
            unseen.push(name);
        }
    }
    // These blocks have no register.
    assert_eq!(unseen, ["command_limiter default", "input_shaper default", "input_shaper 8_bit"]);
}

fn refused(text: &str) -> VectorError {
    let block = block_by_name("position_counter").expect("a block");
    Vectors::parse(text, Header::of(&*block)).expect_err("a bad file")
}

#[test]
fn a_file_of_another_configuration_is_refused_with_both_format_lines() {
    let error = refused(&COUNTER.replace("WIDTH=12", "WIDTH=13"));
    let message = error.to_string();
    assert_eq!(error.line(), 1);
    assert!(
        message.contains("expected `# position_counter in rst(0,1,0)") && message.contains("WIDTH=13`"),
        "{message}"
    );
    assert_eq!(refused("").line(), 1);
}

#[test]
fn a_cut_file_is_refused_wherever_it_is_cut() {
    for cut in 0..COUNTER.len() - 1 {
        let text = &COUNTER[..cut];
        let error = refused(text);
        assert!(error.line() <= text.lines().count() + 1, "{text:?}: {error}");
    }
    let error = refused(&COUNTER[..COUNTER.find("# end").expect("a last line")]);
    assert_eq!(error.to_string(), "5: the file is cut: its last line should be `# end N rows`");
}

#[test]
fn a_lost_row_is_noticed_by_the_count() {
    let error = refused(&COUNTER.replace("0 3 fff\n", ""));
    assert_eq!(error.to_string(), "4: the file has 2 rows, but ends with `# end 3 rows`");
}

#[test]
fn bad_hex_too_many_bits_and_missing_words_are_refused_with_their_line() {
    for (good, bad, message) in [
        ("fff", "ffg", "3: `ffg` is not a word of position(0,12,0)"),
        ("fff", "+ff", "3: `+ff` is not a word of position(0,12,0)"),
        ("fff", "0fff", "3: `0fff` is not a word of position(0,12,0)"),
        ("0 3 fff", "0 4 fff", "3: `4` is not a word of step(1,1,0)"),
        ("0 3 fff", "0 fff", "3: 3 words expected, 2 found"),
        ("3 rows\n", "3 rows\n0\n", "6: text after the last line `# end N rows`"),
    ] {
        assert_eq!(refused(&COUNTER.replace(good, bad)).to_string(), message);
    }
}

#[test]
fn stimuli_are_read_from_csv_with_or_without_reset() {
    let header = counter().header;
    let edge = |rst, step| Stimulus { rst, words: vec![step] };
    assert_eq!(stimuli_from_csv("rst,step\n1,0\n0,-1\n", &header), Ok(vec![edge(true, 0), edge(false, -1)]));
    assert_eq!(stimuli_from_csv("step\n1\n-2\n", &header), Ok(vec![edge(false, 1), edge(false, -2)]));
    for (text, message) in [
        ("steps\n1\n", "1: made for another configuration; expected `rst,step`, found `steps`"),
        ("step\n1\n2\n", "3: `2` is not a word of step(1,1,0)"),
        ("step\n1,1\n", "2: 1 words expected, 2 found"),
    ] {
        assert_eq!(stimuli_from_csv(text, &header).expect_err("a bad file").to_string(), message);
    }
}

#[test]
fn the_strata_touch_every_cell_of_the_plane_of_factors() {
    let rows = stimuli::stratified(Format::unsigned(12), Format::unsigned(12), 1);
    let mut cells: Vec<_> = rows.iter().map(|row| (row.words[0] / 16, row.words[1] / 16)).collect();
    cells.sort_unstable();
    cells.dedup();
    assert_eq!((rows.len(), cells.len()), (1 << 16, 1 << 16));
}

#[test]
fn the_committed_packages_testbenches_and_vectors_are_what_the_blocks_say() {
    let stale = stale(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."));
    assert!(stale.is_empty(), "stale: {stale:?}\nrefresh with `hpu vectors --update`");
}
