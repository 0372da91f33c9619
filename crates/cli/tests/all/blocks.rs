//! `hpu block`, `hpu vectors`, `hpu check`.

use std::fs;
use std::io::Write;
use std::process::{Output, Stdio};

use crate::common::{ROOT, assert_refused, code, hpu, json, names, run, scratch, stderr, stdout, text};

/// Ticks a block with a table from stdin.
fn tick(arguments: &[&str], table: &str) -> Output {
    let mut child = hpu()
        .args(["block", "--inputs", "-"])
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    child.stdin.take().expect("a pipe").write_all(table.as_bytes()).expect("it reads");
    child.wait_with_output().expect("ends")
}

#[test]
fn a_counter_counts_as_by_hand() {
    let output = tick(&["position_counter"], "step\n0\n1\n1\n-1\n-1\n-1\n0\n");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(stdout(&output), "step,position\n0,0\n1,1\n1,2\n-1,1\n-1,0\n-1,4095\n0,4095\n");
    let output = tick(&["position_counter", "--variant", "8_bit"], "step\n-1\n");
    assert_eq!(stdout(&output), "step,position\n-1,255\n");
}

#[test]
fn inputs_come_in_any_order_and_go_out_in_port_order() {
    // The shortest way round the counter's 4096 steps, computed by hand.
    let table = "# a comment\nreference, position\n4090,10\n10,4090\n\n0,2047\n0,2048\n";
    let expected = "position,reference,delta\n10,4090,16\n4090,10,-16\n2047,0,2047\n2048,0,-2048\n";
    assert_eq!(stdout(&tick(&["displacement"], table)), expected);
}

#[test]
fn a_multiplier_saturates_and_wraps_as_by_hand() {
    let table = "a,b\n36,113\n36,114\n4095,4095\n";
    let saturated = "a,b,product\n36,113,4068\n36,114,4095\n4095,4095,4095\n";
    assert_eq!(stdout(&tick(&["truncating_multiplier"], table)), saturated);
    // 4104 - 4096 = 8; 4095^2 = 1 modulo 4096.
    let wrapped = "a,b,product\n36,113,4068\n36,114,8\n4095,4095,1\n";
    assert_eq!(stdout(&tick(&["truncating_multiplier", "--variant", "drop_upper"], table)), wrapped);
}

#[test]
fn a_block_is_shown_and_ticked_in_any_configuration() {
    let wide = ["--generic", "WIDTH=33"];
    let said = stdout(&run(&["block", "position_counter", wide[0], wide[1]]));
    assert!(said.contains("(0,33,0)") && said.contains("WIDTH") && said.contains("33"), "{said}");
    let output = tick(&[&["position_counter"][..], &wide].concat(), "step\n-1\n");
    assert_eq!(stdout(&output), "step,position\n-1,8589934591\n");
    // 5/2 and 7/2 are ties: to the even neighbours 2 and 4. Names of generics have any case, names of modes stand for
    // their numbers.
    let halves = ["--generic", "drop_lower=1", "--generic", "ROUNDING=nearest_even", "--generic=a_width=4"];
    let output = tick(&[&["truncating_multiplier"][..], &halves].concat(), "a,b\n5,1\n7,1\n");
    assert_eq!(stdout(&output), "a,b,product\n5,1,2\n7,1,4\n", "{}", stderr(&output));
}

#[test]
fn generics_are_checked_with_what_is_accepted() {
    let refused = |generics: &[&str], says: &[&str]| {
        let generics: Vec<_> = generics.iter().flat_map(|one| ["--generic", one]).collect();
        for verb in ["block", "vectors", "check"] {
            assert_refused(&run(&[&[verb, "pwm"][..], &generics].concat()), 2, says);
        }
    };
    refused(&["WITDH=4"], &["pwm: generic WITDH", "accepted: WIDTH, ANTIPHASE", "did you mean WIDTH?"]);
    refused(&["WIDTH=31"], &["WIDTH is 31", "accepted: 1 to 30"]);
    refused(&["WIDTH=wide"], &["WIDTH is wide", "a whole number"]);
    refused(&["LATCHED=1"], &["LATCHED is 1", "true or false"]);
    refused(&["WIDTH=4", "width=5"], &["WIDTH is given twice"]);
    let multiplier = |value: &str| run(&["block", "truncating_multiplier", "--generic", value]);
    for value in ["ROUNDING=8", "ROUNDING=half", "ROUNDING=-1"] {
        assert_refused(
            &multiplier(value),
            2,
            &[&value.replace('=', " is "), "0 truncate, 1 toward_zero, 2 nearest_up"],
        );
    }
    assert_refused(&run(&["block", "pwm", "--generic", "WIDTH"]), 2, &["NAME=VALUE, as in WIDTH=14"]);
    assert_refused(&run(&["vectors", "--generic", "WIDTH=4"]), 2, &["of one block; name it"]);
    assert_refused(&run(&["vectors", "pwm", "saturator", "--generic", "WIDTH=4"]), 2, &["of one block; name it"]);
    assert_refused(&run(&["check", "pwm", "--variant", "8_bit", "--generic", "WIDTH=4"]), 2, &["beside no --variant"]);
}

#[test]
fn vectors_of_any_configuration_are_written_and_verify() {
    let dir = scratch("vectors-generic");
    let wide = ["pwm", "--generic", "WIDTH=14", "--count", "300"];
    for form in [&["--format", "txt"][..], &["--format", "json"], &["--set-kind", "random"]] {
        let output = run(&[&["vectors"][..], &wide, form, &["-o", text(&dir)]].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    }
    assert_eq!(names(&dir.join("pwm")), ["WIDTH_14-directed.json", "WIDTH_14-directed.txt", "WIDTH_14-random.txt"]);
    for name in names(&dir.join("pwm")) {
        let file = dir.join("pwm").join(name);
        let output = run(&["vectors", "--verify", text(&file)]);
        assert!(stdout(&output).contains(": 300 rows agree"), "{}{}", stdout(&output), stderr(&output));
    }
    // Line 1 of another configuration than the rows', and of one that no block has.
    let good = fs::read_to_string(dir.join("pwm/WIDTH_14-directed.txt")).expect("vectors");
    for (wrong, says) in
        [("WIDTH=13", "expected `# pwm in"), ("WIDTH=99", "WIDTH is 99"), ("WIDHT=14", "did you mean WIDTH?")]
    {
        fs::write(dir.join("wrong.txt"), good.replace("WIDTH=14", wrong)).expect("vectors");
        assert_refused(&run(&["vectors", "--verify", text(&dir.join("wrong.txt"))]), 4, &["wrong.txt:1:", says]);
    }
    // A multiplier's fraction bits are in its formats alone, so a file may place them where it likes.
    let product = stdout(&run(&["vectors", "truncating_multiplier", "--generic", "DROP_LOWER=4", "--count", "9"]));
    assert!(product.contains("a(0,8,4) b(0,12,0) out product(0,12,0)"), "{product}");
    let moved = product.replace("a(0,8,4) b(0,12,0)", "a(0,12,0) b(0,10,2)").replace("(0,12,0) gen", "(0,14,-2) gen");
    fs::write(dir.join("moved.txt"), moved).expect("vectors");
    let output = run(&["vectors", "--verify", text(&dir.join("moved.txt"))]);
    assert!(stdout(&output).contains("9 rows agree"), "{}{}", stdout(&output), stderr(&output));
}

#[test]
fn a_bench_of_any_configuration_runs_by_itself_and_sees_another_edge() {
    let dir = scratch("bench-generic");
    let saturator = ["saturator", "--generic", "IN_WIDTH=9", "--generic", "OUT_WIDTH=7", "--generic", "LIMIT=37"];
    let output = run(&[&["vectors"][..], &saturator, &["--bench", "-o", text(&dir)]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let folder = dir.join("saturator");
    let files =
        ["IN_WIDTH_9-OUT_WIDTH_7-LIMIT_37-directed.txt", "saturator.vhd", "saturator_pkg.vhd", "tb_saturator.vhd"];
    assert_eq!(names(&folder), [&files[..], &["vector_reader.vhd"]].concat());
    let ghdl = |arguments: &[&str]| {
        let output = std::process::Command::new("ghdl").args(arguments).current_dir(&folder).output().expect("starts");
        assert!(output.status.success(), "{}{}", stdout(&output), stderr(&output));
        stdout(&output)
    };
    let benched = || {
        ghdl(&["-a", "--std=08", "saturator_pkg.vhd", "vector_reader.vhd", "saturator.vhd", "tb_saturator.vhd"]);
        ghdl(&["--elab-run", "--std=08", "tb_saturator"])
    };
    let said = benched();
    assert!(said.contains("RESULT") && said.contains("mismatches=0"), "{said}");
    let vhdl = fs::read_to_string(folder.join("saturator.vhd")).expect("VHDL");
    let other = vhdl.replace("if signed(value) > LIMIT then", "if signed(value) > LIMIT + 1 then");
    assert_ne!(vhdl, other);
    fs::write(folder.join("saturator.vhd"), other).expect("VHDL");
    let said = benched();
    assert!(said.contains("signal=limited") && !said.contains("mismatches=0"), "{said}");
    let several = ["vectors", "saturator", "--bench", "-o", text(&dir)];
    assert_refused(&run(&several), 2, &["--bench", "several of saturator", "--generic NAME=VALUE"]);
    assert_refused(&run(&["vectors", "saturator", "--bench"]), 2, &["--bench", "-o DIR"]);
}

#[test]
fn vhdl_of_any_configuration_is_checked_and_so_is_a_block_of_fixed_widths() {
    let configured = ["IN_WIDTH=9", "OUT_WIDTH=7", "LIMIT=37"];
    let given = |option: &'static str| configured.iter().flat_map(move |one| [option, one]).collect::<Vec<_>>();
    let output = run(&[&["check", "saturator", "--rows", "20", "--json"][..], &given("--generic")].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let report = json(&output);
    assert_eq!(report["blocks"][0]["variants"][0]["name"], configured.join(","), "{report}");
    let dir = scratch("fixed-widths");
    let file = dir.join("clip.vhd");
    let clip = |edge: &str| {
        format!(
            "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;\n\
             entity clip is port (x : in std_logic_vector(8 downto 0); y : out std_logic_vector(6 downto 0)); end;\n\
             architecture a of clip is begin\n\
             y <= std_logic_vector(to_signed(37, 7)) when signed(x) > {edge} else\n\
             std_logic_vector(to_signed(-37, 7)) when signed(x) < -37 else std_logic_vector(resize(signed(x), 7));\n\
             end;\n"
        )
    };
    let theirs = ["check", "--entity=clip", "--as=saturator", "--port=x=value", "--port=y=limited", "--rows=0"];
    let checked = |more: &[&str]| run(&[&theirs[..], more, &[text(&file)]].concat());
    fs::write(&file, clip("37")).expect("VHDL");
    let output = checked(&given("--set"));
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    assert_refused(&checked(&[]), 2, &["has 9 bits, value of saturator has", "--set NAME=VALUE"]);
    // The directed rows alone see one unit more.
    fs::write(&file, clip("38")).expect("VHDL");
    assert_eq!(code(&checked(&given("--set"))), 1);
}

#[test]
fn a_ticked_table_comes_as_json_too() {
    let value = json(&tick(&["position_counter", "--json"], "step\n1\n"));
    assert_eq!(value["columns"], serde_json::json!(["step", "position"]));
    assert_eq!(value["rows"], serde_json::json!([[1, 1]]));
}

#[test]
fn a_bad_table_is_refused_with_its_line_and_what_is_accepted() {
    let names = "position,reference";
    assert_refused(&tick(&["displacement"], ""), 4, &["-:1:", names]);
    assert_refused(&tick(&["displacement"], "position\n1\n"), 4, &["-:1:", "`reference` is missing", names]);
    assert_refused(&tick(&["displacement"], "position,reference,x\n1,2,3\n"), 4, &["-:1:", "`x`", names]);
    assert_refused(&tick(&["displacement"], "position,position\n1,2\n"), 4, &["-:1:", "named twice", names]);
    let table = "position,reference\n1,2\n1\n";
    assert_refused(&tick(&["displacement"], table), 4, &["-:3:", "1 columns", "2"]);
    for cell in ["4096", "-1", "1.5", "x", "", "99999999999999999999999999999999999999999"] {
        let table = format!("position,reference\n1,2\n{cell},2\n");
        assert_refused(&tick(&["displacement"], &table), 4, &["-:3:", "position", "from 0 to 4095", "(0,12,0)"]);
    }
    assert_refused(&run(&["block", "pwm", "--inputs", "no/such.csv"]), 4, &["no/such.csv"]);
    // A file that is cut to `40` would not show that the number was 4096.
    assert_refused(&tick(&["displacement"], "position,reference\n1,2\n1,40"), 4, &["-:3:", "no line feed"]);
}

#[test]
fn the_ports_of_a_block_are_listed_with_format_unit_and_meaning() {
    let said = stdout(&run(&["block", "velocity_register"]));
    for word in ["in", "out", "period", "(0,24,0)", "(1,11,0)", "count/sample", "RESCALED", "rescaled_8_bit"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let value = json(&run(&["block", "velocity_register", "--json"]));
    assert_eq!((&value["name"], &value["clocked"]), (&"velocity_register".into(), &true.into()));
    let ports: Vec<_> = value["ports"].as_array().expect("ports").iter().map(|port| port["name"].clone()).collect();
    assert_eq!(ports, ["position", "period", "scale", "velocity"]);
    assert_eq!(value["ports"][3]["direction"], "out");
    assert_eq!(value["ports"][3]["format"], serde_json::json!([1, 11, 0]));
    assert_eq!(value["generics"]["WIDTH"], 12);
    let text = "RESCALED is an addition to the paper's design; its product takes one edge, so no limit on the clock.";
    assert!(said.contains(&format!("differs from the hardware: {text}\n")), "{said}");
    assert_eq!(value["differs_from_the_hardware"], text);
}

#[test]
fn every_entity_of_the_vhdl_is_a_block_of_the_list() {
    let blocks = json(&run(&["block", "--json"]))["blocks"].as_array().expect("blocks").clone();
    let mut listed: Vec<_> =
        blocks.iter().map(|block| format!("{}.vhd", block["name"].as_str().expect("a name"))).collect();
    listed.sort();
    let mut files = names(format!("{ROOT}/hdl").as_ref());
    files.extend(names(format!("{ROOT}/hdl/generated").as_ref()));
    files.retain(|name| name.ends_with(".vhd") && !name.ends_with("_pkg.vhd"));
    files.sort();
    assert_eq!(listed, files);
}

#[test]
fn committed_vectors_are_those_that_are_generated_and_verify() {
    let dir = scratch("vectors");
    let out = dir.join("out");
    let output = run(&["vectors", "position_counter", "--count", "96", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let sets = names(&out.join("position_counter"));
    assert_eq!(sets, ["32_bit-directed.txt", "8_bit-directed.txt", "default-directed.txt"]);
    for set in sets {
        let (new, committed) =
            (out.join("position_counter").join(&set), format!("{ROOT}/vectors/position_counter/{set}"));
        assert_eq!(fs::read_to_string(&new).expect("new"), fs::read_to_string(&committed).expect("committed"), "{set}");
        assert_eq!(code(&run(&["vectors", "--verify", text(&new)])), 0);
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn an_update_refreshes_what_is_stale_and_nothing_twice() {
    let dir = scratch("update");
    let update = || hpu().args(["vectors", "--update"]).current_dir(&dir).output().expect("starts");
    assert_refused(&update(), 2, &["no hpu project"]);
    fs::create_dir(dir.join("hdl")).expect("a folder");
    fs::write(dir.join("hdl/synchronizer.vhd"), "").expect("a mark of the project");
    let first = stdout(&update());
    assert!(
        first.contains("hdl/generated/pwm_pkg.vhd\n") && first.contains("vectors/pwm/8_bit-random.txt\n"),
        "{first}"
    );
    assert_eq!(stdout(&update()), "0 files refreshed\n");
    fs::write(dir.join("hdl/generated/pwm_pkg.vhd"), "stale").expect("a stale file");
    assert_eq!(stdout(&update()), "hdl/generated/pwm_pkg.vhd\n1 files refreshed\n");
}

#[test]
fn a_word_that_the_emulator_answers_otherwise_is_shown() {
    let dir = scratch("verify");
    let file = dir.join("wrong.txt");
    let wrong = "# position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12\n\
                 1 0 000\n0 3 fff\n0 1 001\n# end 3 rows\n";
    fs::write(&file, wrong).expect("vectors");
    let output = run(&["vectors", "--verify", text(&file)]);
    assert_eq!(code(&output), 1);
    let said = |last: &str| {
        let table = "    row  rst  step  position  position(file)\n    1    1    0     000       000\n    \
                     2    0    3     fff       fff\n    3    0    1     000       001\n";
        format!("{}:4: position is 1 in the file, 0 in the emulator\n{table}    {last}\n", file.display())
    };
    assert_eq!(stdout(&output), said("-o DIR writes a waveform of rows 1 to 3"));
    let out = dir.join("out");
    let save = out.join("position_counter-wrong.vcd.gtkw");
    let output = run(&["vectors", "--verify", text(&file), "-o", text(&out)]);
    let waveform = format!("waveform of rows 1 to 3: gtkwave {}", save.display());
    assert_eq!((code(&output), stdout(&output)), (1, said(&waveform)));
    assert_eq!(names(&out), ["position_counter-wrong.vcd", "position_counter-wrong.vcd.gtkw"]);
}

#[test]
fn vectors_come_in_three_forms_with_the_same_words() {
    let form = |form: &str| stdout(&run(&["vectors", "displacement", "--count", "1", "--format", form]));
    // The first row is all zeros.
    assert!(form("txt").ends_with("\n000 000 000\n# end 1 rows\n"), "{}", form("txt"));
    assert_eq!(form("csv"), "position,reference,delta\n0,0,0\n");
    assert!(form("readmemh").ends_with("\n000000000\n"), "{}", form("readmemh"));
    let random =
        |seed: &str| stdout(&run(&["vectors", "pwm", "--set-kind", "random", "--count", "50", "--seed", seed]));
    assert_eq!(random("7"), random("7"));
    assert_ne!(random("7"), random("8"));
}

#[test]
fn a_scene_gives_vectors_of_its_loop_and_of_each_block_in_it() {
    let dir = scratch("scene-vectors");
    let out = dir.join("out");
    let arguments = ["vectors", "--set-kind", "scene", "--scene", "wrap-product", "--count", "500", "-o", text(&out)];
    assert_eq!(code(&run(&arguments)), 0);
    let blocks = names(&out);
    assert!(blocks.contains(&"hybrid_loop".to_string()) && blocks.contains(&"pwm".to_string()), "{blocks:?}");
    let rows = fs::read_to_string(out.join("hybrid_loop/wrap-product-hybrid_loop.txt")).expect("vectors");
    assert!(rows.ends_with("# end 501 rows\n"), "one of reset, 500 edges");
    let arguments = ["vectors", "zero_order_hold", "--set-kind", "scene", "--scene", "wrap-product"];
    assert_refused(&run(&arguments), 2, &["hybrid_loop", "zero_order_hold"]);
}

#[test]
fn a_check_tells_how_many_edges_of_each_scene_were_in_contact() {
    let arguments = ["check", "--scene", "thrown-hybrid", "--scene", "free-motion", "--edges", "3000"];
    let output = run(&arguments);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stdout(&output);
    let line = |scene: &str| said.lines().find(|line| line.contains(scene)).expect("a line").to_string();
    assert!(said.lines().next().expect("a header").contains(" in contact "), "{said}");
    assert!(line("free-motion").ends_with("wall not reached"), "{said}");
    let loops = json(&run(&[&arguments[..], &["--json"]].concat()))["loops"].clone();
    let (thrown, free) = (&loops[0], &loops[1]);
    // A third of the edges comes before the wall.
    let (from, reached) = (thrown["from_edge"].as_u64(), thrown["wall_reached_at_edge"].as_u64());
    assert_eq!(from.map(|edge| edge + 1000), reached, "{thrown}");
    let touched = thrown["contact_edges"].as_u64().expect("edges");
    assert!((1900..=2100).contains(&touched) && line("thrown-hybrid").contains(&format!(" {touched} ")), "{said}");
    assert_eq!((&free["contact_edges"], &free["from_edge"]), (&0.into(), &0.into()));
    assert!(free["wall_reached_at_edge"].is_null());
}

#[test]
fn a_check_of_one_block_prints_its_table_and_json() {
    let output = run(&["check", "displacement", "--rows", "50"]);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    assert!(stdout(&output).contains("all agree"), "{}", stdout(&output));
    let value =
        json(&run(&["check", "displacement", "--rows", "50", "--scene", "wrap-product", "--edges", "2000", "--json"]));
    assert_eq!(value["ok"], true);
    let block = &value["blocks"][0];
    assert_eq!((&block["name"], &block["mismatches"], &block["edges"]), (&"displacement".into(), &0.into(), &0.into()));
    assert!(block["vectors"].as_u64().is_some_and(|rows| rows > 3 * 50), "three variants: {block}");
    let closed = &value["loops"][0];
    assert_eq!((&closed["scene"], &closed["edges"]), (&"wrap-product".into(), &2000.into()));
    assert_eq!(closed["mismatches"], 0);
}

#[test]
fn a_broken_line_of_vhdl_is_told_with_row_signal_expected_and_got() {
    let dir = scratch("broken");
    let hdl = dir.join("hdl");
    fs::create_dir(&hdl).expect("a folder");
    for name in names(format!("{ROOT}/hdl").as_ref()).iter().filter(|name| name.ends_with(".vhd")) {
        let text = fs::read_to_string(format!("{ROOT}/hdl/{name}")).expect("VHDL");
        let text = if name == "displacement.vhd" { text.replace(" - unsigned(", " + unsigned(") } else { text };
        fs::write(hdl.join(name), text).expect("a copy");
    }
    let original = fs::read_to_string(format!("{ROOT}/hdl/displacement.vhd")).expect("VHDL");
    assert!(original.contains(" - unsigned("), "the line to break is there: {original}");
    let junit = dir.join("report.xml");
    let output = run(&["check", "displacement", "unilateral", "--hdl", text(&hdl), "-x", text(&junit)]);
    assert_eq!(code(&output), 1);
    let said = stdout(&output);
    assert!(said.contains("first at ") && said.contains("delta expected ") && said.contains(", got "), "{said}");
    // The rows have column heads. With a folder, a waveform of the rows around the mismatch is written, and its save
    // file opens it.
    assert!(said.contains("    row  reference  delta  delta(vhdl)\n"), "{said}");
    assert!(said.contains("    -o DIR writes a waveform of rows 1 to 66\n"), "{said}");
    let out = dir.join("out");
    let args = ["check", "displacement", "--variant", "default", "--hdl", text(&hdl), "-o", text(&out)];
    let told = stdout(&run(&args));
    let save = out.join("displacement-default.vcd.gtkw");
    assert!(told.contains(&format!("    waveform of rows 1 to 66: gtkwave {}\n", save.display())), "{told}");
    let written = [
        "check.json",
        "check.txt",
        "coverage.csv",
        "coverage.html",
        "displacement-default.vcd",
        "displacement-default.vcd.gtkw",
    ];
    assert_eq!(names(&out), written);
    assert!(said.contains("3 of 5 differ") || said.contains("3 of 4 differ"), "only its variants: {said}");
    assert!(fs::read_to_string(&junit).expect("a report").contains("<failure "));
}
