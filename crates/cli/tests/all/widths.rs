//! `hpu widths`: the page, its JSON, its files, and refused arguments.

use crate::common::{assert_refused, code, json, names, run, scratch, stderr, stdout, text};
use serde_json::Value;

fn widths(args: &[&str]) -> Value {
    let output = run(&[&["widths"], args, &["--json"]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    json(&output)
}

fn signal<'a>(page: &'a Value, name: &str) -> &'a Value {
    let all = page["signals"].as_array().expect("signals");
    all.iter().find(|signal| signal["name"] == name).unwrap_or_else(|| panic!("no {name}"))
}

#[test]
fn ranges_and_lost_bits_are_those_of_the_run() {
    for scene in ["hybrid-wall", "wrap-saturated", "conventional-wall-1khz", "observed-wall", "phantom-thrown-shared"] {
        let page = widths(&[scene, "--no-trials"]);
        let output = run(&["run", scene, "--json"]);
        let run = json(&output);
        let nets = run["signals"].as_array().expect("signals");
        assert_eq!(page["signals"].as_array().map(Vec::len), Some(nets.len()));
        for net in nets {
            let found = signal(&page, net["name"].as_str().expect("a name"));
            assert_eq!(found["format"], net["format"], "{scene}: {net}");
            assert_eq!(found["measured"], serde_json::json!([net["min"], net["max"]]), "{scene}: {net}");
            assert_eq!((&found["rounded"], &found["overflowed"]), (&net["rounded"], &net["overflowed"]), "{scene}");
            for loss in ["rounded", "overflowed"] {
                let is_lost = net[loss].as_u64() > Some(0);
                assert_eq!(found[format!("{loss}_first_s")].is_number(), is_lost, "{scene}: {net}: {loss}");
            }
        }
    }
}

#[test]
fn a_gain_needs_the_bits_of_its_word_and_the_period_those_of_its_clocks() {
    let page = widths(&["hybrid-wall"]);
    let each = page["widths"]["each"].as_array().expect("widths");
    let needs = |name: &str| &each.iter().find(|width| width["name"] == name).expect("a width")["needs"];
    // The words are 36 PWM counts a count and 50000 clocks a sample: 2^5 < 36 < 2^6, 2^15 < 50000 < 2^16.
    assert_eq!(needs("stiffness, integer"), 6);
    assert_eq!(needs("stiffness, fraction"), 0);
    assert_eq!(needs("period_bits"), 16);
    assert_eq!(signal(&page, "stiffness")["recommended"], serde_json::json!([0, 6, 0]));
    assert_eq!(signal(&page, "period")["recommended"], serde_json::json!([0, 16, 0]));
    for width in each {
        let (bits, needs, together) = (&width["bits"], &width["needs"], &width["together"]);
        assert!(needs.as_i64() <= together.as_i64() && together.as_i64() <= bits.as_i64(), "{width}");
        assert!(width["one_bit_less"].as_str().is_some_and(|said| !said.is_empty()), "{width}");
    }
    assert!(page["widths"]["error_together"].as_f64() <= page["widths"]["within"].as_f64());
}

#[test]
fn what_is_measured_lies_within_what_is_proved() {
    for scene in ["hybrid-wall", "wrap-product", "stiff-hybrid", "conventional-wall-1khz"] {
        let page = widths(&[scene, "--no-trials"]);
        for signal in page["signals"].as_array().expect("signals") {
            let ends =
                |key: &str| signal[key].as_array().map(|ends| [0, 1].map(|end| ends[end].as_f64().expect("a number")));
            if let (Some([least, most]), Some([low, high])) = (ends("measured"), ends("proved")) {
                assert!(low <= least && most <= high, "{scene}: {signal}");
            }
        }
    }
}

#[test]
fn the_page_can_be_printed() {
    for args in [&["hybrid-wall"][..], &["phantom-thrown"], &["observed-wall", "--no-trials", "--notation", "q"]] {
        let output = run(&[&["widths"], args].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let page = stdout(&output);
        assert!(page.lines().count() <= 60, "{} lines", page.lines().count());
        for line in page.lines() {
            assert!(line.chars().count() <= 120, "{line}");
        }
        assert!(page.contains("one bit more") || page.contains("no fewer bits were tried"), "{page}");
    }
    let notations = run(&["widths", "hybrid-wall", "--no-trials", "--notation", "sfixed"]);
    assert!(stdout(&notations).contains("delta sfixed(11 downto 0)"), "{}", stdout(&notations));
}

#[test]
fn scenes_of_one_wiring_are_taken_together() {
    let both = widths(&["hybrid-wall", "wrap-product", "--no-trials"]);
    let [one, two] = ["hybrid-wall", "wrap-product"].map(|scene| widths(&[scene, "--no-trials"]));
    let ends = |page: &Value| {
        let ends = signal(page, "penetration")["words"].clone();
        [0, 1].map(|end| ends[end].as_i64().expect("a word"))
    };
    let ([a, b], [c, d]) = (ends(&one), ends(&two));
    assert_eq!(ends(&both), [a.min(c), b.max(d)]);
    let lost = |page: &Value| signal(page, "spring")["overflowed"].as_u64().expect("a count");
    assert_eq!(lost(&both), lost(&one) + lost(&two));
    assert!(lost(&both) > 0);
}

#[test]
fn random_motion_is_the_same_for_the_same_seed() {
    let walk = |seed| {
        let page = widths(&["hybrid-wall", "--random", "0.3", "--seed", seed]);
        signal(&page, "delta")["measured"].clone()
    };
    assert_eq!(walk("1"), walk("1"));
    assert_ne!(walk("1"), walk("2"));
}

#[test]
fn files_appear_together() {
    let dir = scratch("widths_files");
    let output = run(&["widths", "wrap-product", "--no-trials", "-o", text(&dir)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(names(&dir), ["proved.csv", "ranges.png", "ranges.svg", "widths.csv", "widths.json", "widths.txt"]);
    let csv = std::fs::read_to_string(dir.join("widths.csv")).expect("text");
    let page: Value = serde_json::from_slice(&std::fs::read(dir.join("widths.json")).expect("bytes")).expect("JSON");
    assert_eq!(csv.lines().count(), 1 + page["signals"].as_array().expect("signals").len());
    let proved = std::fs::read_to_string(dir.join("proved.csv")).expect("text");
    let limits = page["proved"][0]["limits"].as_array().expect("limits");
    for (row, limit) in proved.lines().skip(1).zip(limits) {
        let ends = ["min", "max"].map(|end| limit[end].as_f64().expect("a number"));
        let (name, unit) = (limit["name"].as_str().expect("a name"), limit["unit"].as_str().expect("a unit"));
        let expected = format!("wrap-product,{name},{unit},{},{},proved,", ends[0], ends[1]);
        assert!(row.starts_with(&expected), "{row}");
    }
    assert!(proved.lines().any(|row| row.starts_with("wrap-product,overflow from penetration,counts,114,,proved,")));
    let page = std::fs::read_to_string(dir.join("widths.txt")).expect("text");
    assert_eq!(page, stdout(&output));
}

#[test]
fn bad_questions_are_refused() {
    let refused = |args: &[&str], code, words: &str| {
        assert_refused(&run(&[&["widths"], args].concat()), code, &[words]);
    };
    refused(&["nowhere"], 4, "no scene `nowhere`");
    refused(&["hybrid-wall", "--set", "model.datapath=linear"], 4, "\"linear\" has no words; write \"words\"");
    let law = ["hybrid-wall", "--set", "model.datapath=law", "--set", "model.bridge=averaged"];
    refused(&law, 4, "\"law\" has no words; write \"words\"");
    refused(&["replay-capture", "--random", "1"], 4, "a recording has no device that could move at random");
    refused(&["hybrid-wall", "--random", "soon"], 2, "write seconds above 0");
    refused(&["hybrid-wall", "--seed", "3"], 2, "--random");
    refused(&["hybrid-wall", "--within", "2"], 2, "write a share between 0 and 1, as in 1% or 0.01");
    refused(&["hybrid-wall", "--within", "some"], 2, "write a share between 0 and 1");
    refused(&["hybrid-wall", "--set", "method.position_bits=0"], 4, "`0` is not a whole number from 2 to 32");
    let wirings = ["hybrid-wall", "conventional-wall-1khz", "--no-trials"];
    refused(&wirings, 2, "hybrid-wall is a hybrid_loop, conventional-wall-1khz a conventional_loop");
    let narrow = ["hybrid-wall", "--set", "method.stiffness_format=(0,3,0)"];
    refused(&narrow, 4, "does not fit (0,3,0)");
    refused(&["hybrid-wall", "wrap-product", "--price"], 2, "--price takes one scene");
    refused(&["hybrid-wall", "--tables"], 2, "an axis has no tables; write the scene");
    refused(&["hybrid-wall", "--notation", "floats"], 2, "possible values: triple, vhdl, cpp, q");
}

#[test]
fn limits_and_the_first_overflow_say_what_is_proved_and_what_was_measured() {
    let page = widths(&["hybrid-wall", "wrap-product", "--no-trials"]);
    let scenes = page["proved"].as_array().expect("scenes");
    for (scene, deepest) in scenes.iter().zip([819, 666]) {
        let limits = scene["limits"].as_array().expect("limits");
        let names: Vec<_> = limits.iter().map(|limit| limit["name"].as_str().expect("a name")).collect();
        assert_eq!(names, ["speed", "angle", "current"]);
        for limit in limits {
            assert!(
                limit["how"] == "proved" && limit["why"].as_str().is_some_and(|why| why.contains("24 V")),
                "{limit}"
            );
        }
        // A product needs 13 bits from 4096 on. The deepest penetration reaches it at the word `first`, and the scene's
        // 36 PWM counts a count reach it at a penetration of 114 counts.
        let (first, overflow) = ((4096 + deepest - 1) / deepest, &scene["spring_overflows"]);
        assert_eq!(overflow["penetration"], deepest);
        assert_eq!(overflow["from"]["word"], first);
        assert_eq!((&overflow["at_scene"]["word"], &overflow["at_scene_from_penetration"]), (&36.into(), &114.into()));
        let alone = widths(&[scene["scene"].as_str().expect("a name"), "--no-trials"]);
        assert_eq!(&alone["proved"][0], scene);
        assert_eq!(overflow["measured_penetration"], signal(&alone, "penetration")["words"][1]);
        let overflowed = signal(&alone, "spring")["overflowed"].as_u64() > Some(0);
        assert_eq!(overflow["measured_overflow"], overflowed);
        // The command has inputs of 13 + 13 bits, of which few are within the proved ranges. A velocity has memory.
        for (name, how) in [("spring", "exhausted"), ("command", "exhausted"), ("velocity", "proved")] {
            assert_eq!(signal(&alone, name)["how"], how, "{name}");
        }
    }
    assert_eq!(scenes[0]["spring_overflows"]["at_rest_from"], Value::Null, "the push is too weak for any word");
    let page = stdout(&run(&["widths", "wrap-product", "--no-trials"]));
    for words in ["device's limits: speed ", "it overflows from 114 counts on (proved)", "and overflowed (measured)"] {
        assert!(page.contains(words), "{words} is not in: {page}");
    }
}

#[test]
fn a_proof_goes_out_for_gappa() {
    let dir = scratch("widths_gappa");
    let printed = stdout(&run(&["widths", "wrap-product", "--gappa"]));
    // At most 666 counts times 36: more than a word of 12 bits holds, and never above that.
    assert!(printed.contains("penetration in [0, 666]"), "{printed}");
    assert!(printed.contains("product_spring in [0, 23976]"), "{printed}");
    let written = run(&["widths", "wrap-product", "--gappa", "-o", text(&dir)]);
    assert_eq!(code(&written), 0, "{}", stderr(&written));
    assert_eq!(std::fs::read_to_string(dir.join("wrap-product.g")).expect("text"), printed);
    assert_refused(&run(&["widths", "wrap-product", "hybrid-wall", "--gappa"]), 2, &["--gappa takes one scene"]);
}

#[test]
fn each_page_says_for_what_it_holds() {
    let page = stdout(&run(&["widths", "hybrid-wall"]));
    assert!(page.contains("needs, together: hold for this motion of this scene alone"), "{page}");
    let page = stdout(&run(&["widths", "hybrid-wall", "stiff-hybrid"]));
    assert!(page.contains("needs, together: hold for the motions of these scenes alone"), "{page}");
    let vary = ["--vary", "velocity_bits=9..11", "--vary", "position_bits=11..12"];
    let search = |more: &[&str]| {
        let output = run(&[&["widths", "hybrid-wall"][..], more, &["--search"], &vary].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        stdout(&output)
    };
    let alone = search(&[]);
    assert!(alone.contains("holds for  error and stiffness: this motion of this scene alone"), "{alone}");
    assert!(alone.contains("words: what these motions put into them"), "{alone}");
    let more = search(&["stiff-hybrid", "--also", "wall.stiffness=2.5; hand.stiffness=0.6", "--proved"]);
    for words in [
        "run on     hybrid-wall: settled\n           stiff-hybrid: settled\n",
        "           hybrid-wall with wall.stiffness=2.5; hand.stiffness=0.6: settled\n",
        "holds for  error and stiffness: the motions of these 4 scenes\n",
        "           position and velocity: every motion within the device's limits",
    ] {
        assert!(more.contains(words), "{words}: {more}");
    }
    for line in more.lines().filter(|line| !line.contains("hpu run")) {
        assert!(line.chars().count() <= 120, "{line}");
    }
}

#[test]
fn a_search_for_the_proved_range_takes_the_words_that_hold_it() {
    let vary = ["--vary", "velocity_bits=9..11", "--vary", "position_bits=11..12"];
    let value = widths(&[&["hybrid-wall", "--search", "--also", "wall.stiffness=2.5", "--proved"][..], &vary].concat());
    let scenes = value["scenes"].as_array().expect("scenes");
    assert_eq!(scenes.len(), 2);
    let page = widths(&["hybrid-wall", "--no-trials"]);
    for (scene, net) in scenes.iter().flat_map(|scene| ["delta", "velocity"].map(|net| (scene, net))) {
        let ends = |value: &Value| [0, 1].map(|end| value[end].as_f64().expect("a number"));
        let ([low, high], [least, most]) = (ends(&scene["proved"][net]), ends(&signal(&page, net)["measured"]));
        assert!(low <= least && most <= high, "{net}: {scene}");
    }
    // The search has 11 and 12 bits of position, and 9 to 11 of velocity. -1992 needs 12 bits, and 367 needs 10.
    assert_eq!(value["designs"], 6);
    let refused = value["refused"].as_array().expect("reasons");
    let counts: Vec<_> = refused.iter().map(|row| (row["reason"].as_str(), row["designs"].as_u64())).collect();
    let because = |key: &str| format!("hybrid-wall: method.{key}: too few bits for the range proved");
    let [position, velocity] = ["position_bits", "velocity_bits"].map(because);
    assert_eq!(counts, [(Some(&*position), Some(3)), (Some(&*velocity), Some(1))]);
}

#[test]
fn searches_of_several_scenes_are_refused_with_what_to_write() {
    let refused = |args: &[&str], code, words: &str| {
        assert_refused(&run(&[&["widths"], args].concat()), code, &[words]);
    };
    refused(&["hybrid-wall", "--also", "wall.stiffness=2"], 2, "--search");
    refused(&["hybrid-wall", "--search", "--also", "wall.stiffness"], 2, "write KEY=VALUE");
    refused(&["hybrid-wall", "--search", "--also", "wall.stifness=2"], 4, "--also 'wall.stifness=2': ");
    refused(&["hybrid-wall", "conventional-wall-1khz", "--search"], 4, "\"hybrid\" and \"conventional\"");
    refused(&["thrown-hybrid", "--search", "--proved"], 4, "no limit of the travel is proved");
    refused(&["phantom-thrown", "--search", "--proved"], 2, "leave out the other scenes, --also and --proved");
}

/// A page, a file and the JSON tell the same of the crank's table. Its 615 rows are the positions of half a turn.
#[test]
fn the_cranks_table_of_a_gimbal_is_compared_with_other_sizes() {
    let dir = scratch("widths-crank");
    let args = ["gimbal-spring", "--no-trials", "--tables", "--set", "run.duration=20 ms", "-o", text(&dir)];
    let output = run(&[&["widths"], &args[..]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let page = stdout(&output);
    let said = page.split_once("tables     of the crank").expect("the tables").1;
    assert!(said.lines().all(|line| line.chars().count() <= 120), "{page}");
    assert_eq!(said.lines().filter(|line| line.starts_with("*  615")).count(), 1);
    let file = std::fs::read_to_string(dir.join("widths.json")).expect("a file");
    let tables = &serde_json::from_str::<Value>(&file).expect("JSON")["tables"];
    let sizes = tables["sizes"].as_array().expect("sizes");
    assert_eq!((&tables["positions"], sizes.len()), (&615.into(), 12));
    let chosen: Vec<_> = sizes.iter().filter(|size| size["chosen"] == true).collect();
    assert!(chosen.len() == 1 && chosen[0]["radius_lsb"].as_f64() < Some(1.5), "{chosen:?}");
    let csv = std::fs::read_to_string(dir.join("tables.csv")).expect("a file");
    let column = csv.lines().next().expect("a head").split(',').position(|name| name == "rows").expect("rows");
    let rows: Vec<u64> =
        csv.lines().skip(1).map(|line| line.split(',').nth(column).unwrap().parse().unwrap()).collect();
    assert_eq!(rows[..6], [615, 308, 154, 77, 39, 20]);
}
