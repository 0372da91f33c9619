//! Vectors and tables in the formats of other tools, read back according to the manuals of these tools.

use std::f64::consts::{FRAC_PI_2, TAU};

use hpu_datapath::{AnyBlock, block_by_name, variants};
use hpu_rtl::{Header, Origin, Source, Stimulus, Vectors, stimuli};

/// Returns the vectors of a counter that steps down over the wrap and up again: reset, -1, +1.
fn counter() -> Vectors {
    let mut block = block_by_name("position_counter").expect("a block");
    let steps = [(true, 0), (false, -1), (false, 1)];
    Vectors::record(&mut *block, steps.map(|(rst, step)| Stimulus { rst, words: vec![step] }))
}

fn directed() -> Origin {
    Origin { variant: Some("default".to_string()), source: Source::Directed }
}

/// Returns a few rows of every configuration.
fn sets() -> Vec<(String, Vectors)> {
    let record = |(label, mut block): (String, Box<dyn AnyBlock>)| {
        let mut rows = stimuli::directed(&*block);
        rows.truncate(40);
        rows.extend(stimuli::random(&*block, 3, 40));
        block.reset();
        (format!("{} {label}", block.name()), Vectors::record(&mut *block, rows))
    };
    variants().into_iter().map(record).collect()
}

const ABOUT: &str = "position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12";

#[test]
fn a_memory_of_a_counter_is_as_by_hand_in_every_dialect() {
    // A row has 15 bits: rst, step with two, position with twelve.
    let memory = counter().memory();
    let slices = "rst[14:14] step[13:12] position[11:0]";
    assert_eq!((memory.width(), memory.is_empty()), (15, false));
    assert_eq!(
        memory.to_coe(),
        format!(
            "; {ABOUT}\n; {slices}\nmemory_initialization_radix=16;\nmemory_initialization_vector=\n\
             4000,\n3fff,\n1000;\n"
        )
    );
    let intel = "DEPTH = 3;\nWIDTH = 15;\nADDRESS_RADIX = HEX;\nDATA_RADIX = HEX;\nCONTENT\nBEGIN\n\
                 0 : 4000;\n1 : 3fff;\n2 : 1000;\nEND;\n";
    assert_eq!(memory.to_mif_intel(), format!("-- {ABOUT}\n-- {slices}\n{intel}"));
    assert_eq!(memory.to_mif_xilinx(), "100000000000000\n011111111111111\n001000000000000\n");
    let outputs = counter().outputs_memory();
    assert_eq!(outputs.to_mif_xilinx(), "000000000000\n111111111111\n000000000000\n");
}

/// Returns hex digits as bits, without the padding above the width.
fn bits(digits: &str, width: usize) -> String {
    let all: String = digits.chars().map(|digit| format!("{:04b}", digit.to_digit(16).expect("a hex digit"))).collect();
    let (padding, word) = all.split_at(all.len() - width);
    assert!(padding.len() < 4 && !padding.contains('1'), "{digits} in {width} bits");
    word.to_string()
}

/// Reads the words of a COE file: the text between the `=` of the vector and the semicolon, divided by commas. A
/// comment begins with a semicolon.
fn coe(text: &str, width: usize) -> Vec<String> {
    let plain: String = text.lines().filter(|line| !line.starts_with(';')).collect();
    let (head, vector) = plain.split_once("memory_initialization_vector=").expect("the vector");
    assert_eq!(head, "memory_initialization_radix=16;");
    vector.strip_suffix(';').expect("its end").split(',').map(|word| bits(word, width)).collect()
}

/// Reads the words of an Intel MIF. Each must be at the next address, and there must be as many as the depth says.
fn mif_intel(text: &str, width: usize) -> Vec<String> {
    let plain: String = text.lines().filter(|line| !line.starts_with("--")).collect();
    let (head, content) = plain.split_once("CONTENTBEGIN").expect("a head and a content");
    let value = |key: &str| head.split(';').find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
    assert_eq!((value("ADDRESS_RADIX"), value("DATA_RADIX")), (Some("HEX"), Some("HEX")));
    assert_eq!(value("WIDTH"), Some(width.to_string().as_str()));
    let entries: Vec<_> = content.strip_suffix("END;").expect("an end").split_terminator(';').collect();
    assert_eq!(value("DEPTH"), Some(entries.len().to_string().as_str()));
    let word = |(place, entry): (usize, &&str)| {
        let (address, word) = entry.split_once(" : ").expect("address and word");
        assert_eq!(usize::from_str_radix(address, 16), Ok(place));
        bits(word, width)
    };
    entries.iter().enumerate().map(word).collect()
}

#[test]
fn every_dialect_of_memory_holds_the_bits_of_every_row_of_every_configuration() {
    for (name, vectors) in sets() {
        let word = |row: &Vec<i64>| -> String {
            let columns = vectors.header.columns().zip(row);
            columns
                .map(|(c, &word)| format!("{:0width$b}", c.format.bits(word), width = c.format.width() as usize))
                .collect()
        };
        let expected: Vec<_> = vectors.rows.iter().map(word).collect();
        let memory = vectors.memory();
        let width = memory.width();
        assert_eq!(memory.to_mif_xilinx().lines().collect::<Vec<_>>(), expected, "{name}");
        assert_eq!(coe(&memory.to_coe(), width), expected, "{name}");
        assert_eq!(mif_intel(&memory.to_mif_intel(), width), expected, "{name}");
        let hex = memory.to_readmemh();
        let words: Vec<_> = hex.lines().filter(|line| !line.starts_with("//")).map(|word| bits(word, width)).collect();
        assert_eq!(words, expected, "{name}");
    }
}

#[test]
fn vunit_gets_integers_alone_and_none_that_vhdl_does_not_have() {
    assert_eq!(counter().to_vunit().as_deref(), Ok("1,0,0\n0,-1,4095\n0,1,0\n"));
    let (mut integers, mut refused) = (0, 0);
    for (name, vectors) in sets() {
        match vectors.to_vunit() {
            Ok(text) => {
                let all = text.split([',', '\n']).filter(|cell| !cell.is_empty());
                integers += all.map(|cell| cell.parse().expect("a VHDL integer")).collect::<Vec<i32>>().len();
                assert_eq!(text.lines().count(), vectors.rows.len(), "{name}");
            }
            Err(error) => {
                let said = error.to_string();
                let most = if error.format.is_signed() { 32 } else { 31 };
                assert!(
                    error.format.width() > most && said.contains("signed words of up to 32 bits"),
                    "{name}: {said}"
                );
                refused += 1;
            }
        }
    }
    assert!(integers > 10_000 && refused > 0, "{integers} {refused}");
}

#[test]
fn json_is_read_back_as_it_was_written_for_every_configuration() {
    let headers: Vec<_> = variants().iter().map(|(_, block)| Header::of(&**block)).collect();
    let all = |_: &str, _: &[_]| Ok(headers.clone());
    for (name, vectors) in sets() {
        let origin = Origin { variant: None, source: Source::Random { seed: 3 } };
        let again = Vectors::from_json(&vectors.to_json(&origin), all);
        assert!(again.as_ref() == Ok(&vectors), "{name}: {:?}", again.err());
    }
}

#[test]
fn json_of_a_counter_is_as_by_hand_but_for_its_digest() {
    let json = counter().to_json(&directed());
    let (said, digest) = json.split_once("\"sha256\": ").expect("a digest");
    let expected = "{\n\"block\": \"position_counter\",\n\"clocked\": true,\n\
                    \"generics\": {\"WIDTH\":12},\n\"columns\": [\n\
        {\"direction\":\"in\",\"format\":[0,1,0],\"name\":\"rst\",\"unit\":\"1\"},\n\
        {\"direction\":\"in\",\"format\":[1,1,0],\"name\":\"step\",\"unit\":\"count\"},\n\
        {\"direction\":\"out\",\"format\":[0,12,0],\"name\":\"position\",\"unit\":\"count\"}\n],\n\
        \"variant\": \"default\",\n\"set\": \"directed\",\n\"rows\": [\n[1,0,0],\n[0,-1,4095],\n[0,1,0]\n],\n";
    assert_eq!(said, expected);
    assert_eq!(digest.len(), "\"\"\n}\n".len() + 64);
}

#[test]
fn json_with_any_character_changed_removed_or_doubled_is_refused() {
    let own = |_: &str, _: &[_]| Ok([counter().header]);
    let json = counter().to_json(&directed());
    for at in 0..json.len() {
        let (before, rest) = json.split_at(at);
        let (one, after) = rest.split_at(1);
        let other = if one == "0" { "1" } else { "0" };
        for changed in
            [format!("{before}{other}{after}"), format!("{before}{after}"), format!("{before}{one}{one}{after}")]
        {
            let read = Vectors::from_json(&changed, own);
            assert!(read.as_ref().is_err_and(|error| error.why().contains("sha256")), "{changed}: {read:?}");
        }
    }
}

#[test]
fn json_of_another_configuration_or_with_impossible_words_is_refused_though_its_digest_is_right() {
    let json = counter().to_json(&directed());
    let own = |_: &str, _: &[_]| Ok([counter().header]);
    let refused = |from: &str, to: &str| {
        let changed = json.replace(from, to);
        assert_ne!(changed, json);
        // A user who writes such a file learns its digest from the refusal.
        let edited = Vectors::from_json(&changed, own).expect_err(from);
        let digests = edited.why().split_once("told as ").and_then(|(_, digests)| digests.split_once(", and is "));
        let (told, found) = digests.expect(from);
        Vectors::from_json(&changed.replace(told, found), own).expect_err(from).why().to_string()
    };
    let unknown = "no configuration of a block \"position_counter\" has these columns and generics; see hpu block NAME";
    assert_eq!(refused("\"WIDTH\":12", "\"WIDTH\":13"), unknown);
    assert_eq!(refused("[1,1,0]", "[1,2,0]"), unknown);
    assert_eq!(
        refused("[0,-1,4095]", "[0,-1,4096]"),
        "row 2: position: `4096` is no integer from 0 to 4095, which (0,12,0) holds"
    );
    assert_eq!(
        refused("[0,-1,4095]", "[0,-1.5,4095]"),
        "row 2: step: `-1.5` is no integer from -2 to 1, which (1,1,0) holds"
    );
    assert_eq!(refused("[0,-1,4095]", "[0,-1]"), "row 2: 3 words expected");
    assert!(refused("[0,-1,4095]", "[0,-1,4095").starts_with("no JSON: "));
}

/// Returns the words of a table.
fn words(block: &dyn AnyBlock, name: &str) -> Vec<i64> {
    block.roms().into_iter().find(|rom| rom.name == name).expect("a table").words
}

#[test]
fn a_full_table_is_addressed_by_the_bits_of_the_count() {
    let mut block = block_by_name("trig_table").expect("a block");
    let (sines, cosines) = (words(&*block, "sines"), words(&*block, "cosines"));
    assert_eq!((sines.len(), cosines.len()), (8192, 8192));
    block.reset();
    for count in -4096..4096i64 {
        let address = (count & 8191) as usize;
        assert_eq!(block.tick(&[count]), [sines[address], cosines[address], 1]);
        let scaled = |value: f64| (value * f64::from(1 << 22)).round() as i64;
        let angle = TAU * count as f64 / 28_000.0;
        assert_eq!((sines[address], cosines[address]), (scaled(angle.sin()), scaled(angle.cos())));
    }
}

#[test]
fn quarter_tables_hold_a_quarter_of_a_sine_without_its_end() {
    let point = |step: i64, width: u32| {
        let angle = FRAC_PI_2 * step as f64 / f64::from(1 << width);
        (angle.sin() * f64::from(1 << 22)).round() as i64
    };
    let nearest = block_by_name("trig_quarter").expect("a block");
    assert_eq!(words(&*nearest, "sines"), (0..1 << 11).map(|step| point(step, 11)).collect::<Vec<_>>());
    let chords = block_by_name("trig_interpolated").expect("a block");
    assert_eq!(words(&*chords, "points"), (0..1 << 9).map(|step| point(step, 9)).collect::<Vec<_>>());
    let rises: Vec<_> = (0..1 << 9).map(|step| point(step + 1, 9) - point(step, 9)).collect();
    assert_eq!(words(&*chords, "rises"), rises);
}

#[test]
fn a_table_is_a_set_of_a_row_an_address_and_every_word_fits() {
    for (label, block) in variants() {
        for rom in block.roms() {
            assert!(rom.words.iter().all(|&word| rom.format.holds(rom.format.value(word))), "{label} {}", rom.name);
            let set = Vectors::of_rom(&*block, &rom);
            let (address, word) = (set.header.inputs[0].format, set.header.outputs[0].format);
            // The address is the narrowest that reaches every row.
            assert_eq!((1 << address.width(), word), (rom.words.len().next_power_of_two(), rom.format));
            assert_eq!(set.outputs_memory().to_mif_xilinx().lines().count(), rom.words.len());
        }
    }
}
