//! Names of files, folders, units, ports and generics, and values of generics, with every character that a tool or a
//! script may read as more than itself: they work, or are refused at their line. Nothing of them is executed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::{assert_refused, code, hpu, json, names, scratch, stderr, stdout, tools};

/// Parts of names. Where one of them is read as code, it makes the file `PWNED`.
const AWKWARD: [&str; 16] = [
    "a b",
    "it's",
    "say \"x\" y",
    "$(touch PWNED)",
    "`touch PWNED`",
    "-x",
    "+x",
    "#x",
    "a;touch PWNED;b",
    "x\"; exec -- touch PWNED; #",
    "50%A%j",
    "{} {.} {= touch(PWNED) =}",
    "a\\b",
    "é",
    "*?[x]~",
    "a\nb",
];

/// Asserts that nothing was executed: no folder below this one has the file that the names would make.
fn assert_not_executed(dir: &Path) {
    for entry in fs::read_dir(dir).expect("a folder").flatten() {
        assert_ne!(entry.file_name(), "PWNED", "{} was executed", dir.display());
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            assert_not_executed(&entry.path());
        }
    }
}

/// A module or an entity for each awkward name, so that the top level needs all of their files.
const PARTS: usize = AWKWARD.len();

/// Returns the text of a scene of a design in these files, with more lines of its `[dut]`.
fn scene(files: &[String], more: &str) -> String {
    let files: Vec<_> = files.iter().map(|file| serde_json::to_string(file).expect("a text")).collect();
    format!(
        "about = \"awkward names\"\n\
         device = {{ kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }}\n\
         clock = {{ frequency = \"10 MHz\" }}\nwall = {{ position = \"1.5 rad\" }}\nrun = {{ duration = \"10 us\" }}\n\
         hand = {{ kind = \"spring_damper\", stiffness = \"0.3 N.m/rad\", damping = \"0.1 mN.m.s/rad\", \
         path = [[\"0 s\", 0], [\"150 ms\", 1.4]] }}\n\
         [dut]\nfiles = [{}]\ntop = \"top\"\nclock = \"clk\"\nreset = {{ port = \"rst\" }}\n\
         ports = {{ a = \"encoder.a\", b = \"encoder.b\", pwm = \"bridge.pwm\", dir = \"bridge.direction\" }}\n\
         {more}\n",
        files.join(", ")
    )
}

/// Returns a top level in Verilog with these lines inside.
fn verilog(inside: &str) -> String {
    format!(
        "module top #(parameter LABEL = \"x\", parameter N = 1) \
         (input clk, input rst, input a, input b, output reg pwm, output reg dir);\n\
         {inside}\nalways @(posedge clk) if (rst) {{pwm, dir}} <= 0; else {{pwm, dir}} <= {{a, b}};\nendmodule\n"
    )
}

/// Returns a top level in VHDL with these statements inside.
fn vhdl(statements: &str) -> String {
    format!(
        "library ieee; use ieee.std_logic_1164.all;\nentity top is\n  \
         generic (TXT : string := \"x\"; N : integer := 1);\n\
         \x20 port (clk, rst, a, b : in std_logic; pwm, dir : out std_logic);\nend;\n\
         architecture x of top is begin\n{statements}\n  process (clk) begin\n    if rising_edge(clk) then\n      \
         pwm <= a and not rst; dir <= b and not rst;\n    end if;\n  end process;\nend;\n"
    )
}

/// Runs a command in a folder. The designs that it builds are kept there.
fn in_folder(dir: &Path, arguments: &[&str]) -> Output {
    hpu().args(arguments).current_dir(dir).env("XDG_CACHE_HOME", dir.join("cache")).output().expect("starts")
}

#[test]
fn files_of_any_name_are_compiled_synthesised_and_simulated() {
    let dir = scratch("names-files");
    let parts = |extension: &str| (0..PARTS).map(|part| format!("{}.{extension}", AWKWARD[part])).collect::<Vec<_>>();
    let (in_verilog, in_vhdl) = (parts("v"), parts("vhd"));
    for (part, (one, other)) in in_verilog.iter().zip(&in_vhdl).enumerate() {
        fs::write(dir.join(one), format!("module part{part} (input i); endmodule\n")).expect("a file");
        let entity = format!("entity part{part} is end;\narchitecture x of part{part} is begin end;\n");
        fs::write(dir.join(other), entity).expect("a file");
    }
    // A file is included by its own name, and a plain name that an awkward one would be given is another file.
    fs::write(dir.join("a b.vh"), "wire included = 1;\n").expect("a file");
    fs::write(dir.join("a_b.v"), "module other (input i); endmodule\n").expect("a file");
    let each = |instance: &dyn Fn(usize) -> String| (0..PARTS).map(instance).collect::<String>();
    let modules = each(&|part| format!("part{part} u{part} (a);\n"));
    let top = verilog(&format!("`include \"a b.vh\"\nother other_u (included);\n{modules}"));
    fs::write(dir.join("top.v"), top).expect("a file");
    fs::write(dir.join("top.vhd"), vhdl(&each(&|part| format!("  u{part} : entity work.part{part};\n"))))
        .expect("a file");
    let files =
        |own: &[String], more: &[&str]| [own, &more.iter().map(|&name| name.into()).collect::<Vec<_>>()].concat();
    fs::write(dir.join("v.toml"), scene(&files(&in_verilog, &["a_b.v", "a b.vh", "top.v"]), "")).expect("a scene");
    for engine in ["ghdl", "verilator"] {
        let own = scene(&files(&in_vhdl, &["top.vhd"]), &format!("engine = \"{engine}\""));
        fs::write(dir.join(format!("{engine}.toml")), own).expect("a scene");
    }
    for of in ["v", "ghdl", "verilator"] {
        let scene = format!("{of}.toml");
        for verb in [&["run", &scene][..], &["cost", "--scene", &scene]] {
            let output = in_folder(&dir, verb);
            assert_eq!(code(&output), 0, "{verb:?}: {}{}", stdout(&output), stderr(&output));
        }
    }
    // A message has a file's own name.
    fs::write(dir.join("a b.v"), "module part0 (input i); wrong\nendmodule\n").expect("a file");
    for verb in [&["run", "v.toml"][..], &["cost", "--scene", "v.toml"]] {
        let output = in_folder(&dir, verb);
        assert!(code(&output) != 0 && stderr(&output).contains("a b.v:"), "{verb:?}: {}", stderr(&output));
    }
    assert_not_executed(&dir);
}

#[test]
fn files_of_any_name_are_compared_with_a_block() {
    let dir = scratch("names-entity");
    let saturator = "module sat #(parameter IN_WIDTH = 8, parameter OUT_WIDTH = 4) \
        (input signed [IN_WIDTH-1:0] a, output signed [OUT_WIDTH-1:0] y);\n\
        helper0 h ();\nlocalparam signed [IN_WIDTH-1:0] TOP = (1 << (OUT_WIDTH - 1)) - 1;\n\
        assign y = a > TOP ? TOP[OUT_WIDTH-1:0] : a < ~TOP ? ~TOP[OUT_WIDTH-1:0] : a[OUT_WIDTH-1:0];\nendmodule\n";
    fs::write(dir.join("sat.v"), saturator).expect("a file");
    let listed = stdout(&in_folder(&dir, &["block", "saturator"]));
    let files = AWKWARD.iter().enumerate().map(|(part, name)| {
        fs::write(dir.join(format!("{name}.v")), format!("module helper{part}; endmodule\n")).expect("a file");
        format!("./{name}.v")
    });
    let files: Vec<String> = files.collect();
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let asked = ["check", "--entity", "sat", "--as", "saturator", "--rows", "5", "sat.v"];
    let output = in_folder(&dir, &[&asked, &files[..]].concat());
    // Its ports are not those of the block, which is told once the design is compiled.
    let said = stderr(&output);
    assert!(code(&output) == 2 && said.contains("of `sat`"), "{said}{listed}");
    for (option, name) in [
        ("--entity", "sat; exec -- touch PWNED"),
        ("--library", "a b"),
        ("--clock", "-x"),
        ("--reset", "r\"st=low"),
        ("--port", "$(touch PWNED)=a"),
        ("--generic", "N\nM=3"),
    ] {
        let own = [("--entity", "sat"), (option, name)];
        let own = own.iter().skip(usize::from(option == "--entity"));
        let own: Vec<String> = own.map(|(option, value)| format!("{option}={value}")).collect();
        let own: Vec<&str> = own.iter().map(String::as_str).collect();
        let output = in_folder(&dir, &[&["check", "--as", "saturator", "sat.v"], &own[..]].concat());
        assert_refused(&output, 2, &[option, "is no identifier", "an identifier of Verilog is"]);
    }
    assert_not_executed(&dir);
}

#[test]
fn names_that_are_no_identifiers_are_refused_at_their_line() {
    let dir = scratch("names-identifiers");
    for (file, content) in [("top.v", verilog("")), ("top.vhd", vhdl(""))] {
        fs::write(dir.join(file), content).expect("a file");
    }
    // The number of a line, and what stands there in the place of the awkward name.
    let wrong = |name: &str| serde_json::to_string(name).expect("a text");
    type Written<'a> = &'a dyn Fn(&str) -> String;
    let cases: [(&str, Written); 6] = [
        ("top = \"top\"", &|name| format!("top = {}", wrong(name))),
        ("clock = \"clk\"", &|name| format!("clock = {}", wrong(name))),
        ("clock = \"clk\"", &|name| format!("clocks = {{ {} = 1 }}", wrong(name))),
        ("port = \"rst\"", &|name| format!("port = {}", wrong(name))),
        ("{ a = ", &|name| format!("{{ {} = ", wrong(name))),
        ("GENERIC", &|name| format!("generics = {{ {} = 1 }}", wrong(name))),
    ];
    for (file, language) in [("top.v", "Verilog"), ("top.vhd", "VHDL")] {
        let plain = scene(&[file.to_string()], "GENERIC");
        for (key, with) in &cases {
            let line = plain.lines().position(|line| line.contains(key)).expect("a line") + 1;
            for name in AWKWARD {
                let text = plain.replacen(key, &with(name), 1).replace("\nGENERIC", "");
                fs::write(dir.join("scene.toml"), text).expect("a scene");
                for verb in [&["cost", "--scene", "scene.toml"][..], &["scenes", "show", "scene.toml"]] {
                    let output = in_folder(&dir, verb);
                    let words = [&format!("scene.toml:{line}:"), "an identifier of ", language];
                    assert_refused(&output, 4, &words);
                }
            }
        }
    }
    assert_not_executed(&dir);
}

/// Prices a design in VHDL whose register of `pwm` is there for these texts alone.
fn texts_of_generics_arrive_in_synthesis(dir: &Path) {
    let own = [AWKWARD[2], AWKWARD[9], AWKWARD[12], "\"", "é\"&b"];
    let is_text = |(at, value): (usize, &str)| {
        let is_byte = |(byte, code): (usize, u8)| format!(" and character'pos(TXT{at}({})) = {code}", byte + 1);
        format!(" and TXT{at}'length = {}{}", value.len(), value.bytes().enumerate().map(is_byte).collect::<String>())
    };
    let all: String = own.iter().copied().enumerate().map(is_text).collect();
    let generics: String = (0..own.len()).map(|at| format!("TXT{at} : string := \"x\"; ")).collect();
    let is_one = format!("if N = 1{all} then pwm <= a and not rst; end if;");
    let entity = vhdl("").replace("pwm <= a and not rst;", &is_one).replace("TXT : string := \"x\"; ", &generics);
    fs::write(dir.join("synth.vhd"), entity).expect("a file");
    // Another text than the design is for, in the place of each in turn, costs the register.
    for (other, registers) in [(None, 2), (Some(0), 1), (Some(4), 1)] {
        let text = |(at, value): (usize, &&str)| {
            let given = if other == Some(at) { "say \"x\" z" } else { *value };
            format!("TXT{at} = {}, ", serde_json::json!(given))
        };
        let texts: String = own.iter().enumerate().map(text).collect();
        let more = format!("engine = \"ghdl\"\ngenerics = {{ {texts}N = 1 }}");
        fs::write(dir.join("synth.toml"), scene(&["synth.vhd".to_string()], &more)).expect("a scene");
        let output = in_folder(dir, &["cost", "--scene", "synth.toml", "--json"]);
        assert_eq!(code(&output), 0, "{other:?}: {}", stderr(&output));
        assert_eq!(json(&output)["ff"], registers, "{other:?}");
    }
    // An empty text too.
    let is_empty = "if TXT'length = 0 then pwm <= a and not rst; end if;";
    let entity = vhdl("  assert TXT'length = 0 severity failure;").replace("pwm <= a and not rst;", is_empty);
    fs::write(dir.join("synth.vhd"), entity).expect("a file");
    for engine in ["ghdl", "verilator"] {
        let more = format!("engine = \"{engine}\"\ngenerics = {{ TXT = \"\" }}");
        fs::write(dir.join("empty.toml"), scene(&["synth.vhd".to_string()], &more)).expect("a scene");
        let output = in_folder(dir, &["run", "empty.toml"]);
        assert_eq!(code(&output), 0, "{engine}: {}{}", stdout(&output), stderr(&output));
    }
    let output = in_folder(dir, &["cost", "--scene", "empty.toml", "--json"]);
    assert_eq!((code(&output), &json(&output)["ff"]), (0, &2.into()), "{}", stderr(&output));
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn texts_of_parameters_arrive_as_they_are_in_every_tool() {
    let dir = scratch("names-values");
    // One design takes all texts, each by a name of its own.
    let named = |stem: &str| (0..PARTS).map(|part| format!("{stem}{part}")).collect::<Vec<_>>();
    let given = |key: &str, names: &[String], left_out: Option<&str>| {
        let texts = names.iter().zip(AWKWARD).filter(|(_, value)| Some(*value) != left_out);
        let texts = texts.map(|(name, value)| format!("{name} = {}, ", serde_json::to_string(value).expect("a text")));
        format!("{key} = {{ {}N = 7 }}", texts.collect::<String>())
    };
    let labels = named("LABEL");
    let checks = labels.iter().zip(AWKWARD).enumerate().map(|(part, (label, value))| {
        // The bits of the text, by hand. A design without this text has an instance of nothing.
        let bits: String = value.bytes().map(|byte| format!("{byte:02x}")).collect();
        let expected = format!("{}'h{bits}", 8 * value.len());
        format!("generate if ({label} != {expected} || N != 7) nothing_of_this_name u{part} (); endgenerate\n")
    });
    let parameters: String = labels.iter().map(|label| format!("parameter {label} = \"x\", ")).collect();
    let module = verilog(&checks.collect::<String>()).replace("parameter LABEL = \"x\", ", &parameters);
    fs::write(dir.join("v.v"), module).expect("a file");
    let more = given("parameters", &labels, None);
    fs::write(dir.join("v.toml"), scene(&["v.v".to_string()], &more)).expect("a scene");
    for verb in [&["run", "v.toml"][..], &["cost", "--scene", "v.toml"]] {
        let output = in_folder(&dir, verb);
        assert_eq!(code(&output), 0, "{verb:?}: {}{}", stdout(&output), stderr(&output));
    }
    // VHDL has no text over lines.
    let lines = AWKWARD.iter().find(|value| value.contains('\n')).copied();
    let texts = named("TXT");
    let checks = texts.iter().zip(AWKWARD).filter(|(_, value)| Some(*value) != lines).map(|(text, value)| {
        let is_byte = |(at, byte): (usize, u8)| format!(" and character'pos({text}({})) = {byte}", at + 1);
        let each: String = value.bytes().enumerate().map(is_byte).collect();
        format!("  assert {text}'length = {} and N = 7{each} severity failure;\n", value.len())
    });
    let generics: String = texts.iter().map(|text| format!("{text} : string := \"x\"; ")).collect();
    let entity = vhdl(&checks.collect::<String>()).replace("TXT : string := \"x\"; ", &generics);
    fs::write(dir.join("h.vhd"), entity).expect("a file");
    let vhdl_with = |left_out: Option<&str>| {
        let more = format!("engine = \"ghdl\"\n{}", given("generics", &texts, left_out));
        fs::write(dir.join("h.toml"), scene(&["h.vhd".to_string()], &more)).expect("a scene");
        in_folder(&dir, &["run", "h.toml"])
    };
    assert_refused(&vhdl_with(None), 4, &["h.toml:14:", "control character"]);
    let output = vhdl_with(lines);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    texts_of_generics_arrive_in_synthesis(&dir);
    // Verilator and GHDL take a negative number. Yosys would lose its sign.
    let check = "generate if (N != -3 || !(N < 0)) nothing_of_this_name u (); endgenerate";
    fs::write(dir.join("n.v"), verilog(check)).expect("a file");
    fs::write(dir.join("n.toml"), scene(&["n.v".to_string()], "parameters = { N = -3 }")).expect("a scene");
    let output = in_folder(&dir, &["run", "n.toml"]);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    let words = ["n.toml:13:", "dut.parameters.N", "-3", "Yosys"];
    assert_refused(&in_folder(&dir, &["cost", "--scene", "n.toml"]), 4, &words);
    fs::write(dir.join("n.vhd"), vhdl("  assert N = -3 severity failure;")).expect("a file");
    for engine in ["ghdl", "verilator"] {
        let more = format!("engine = \"{engine}\"\ngenerics = {{ N = -3 }}");
        fs::write(dir.join("n.toml"), scene(&["n.vhd".to_string()], &more)).expect("a scene");
        let output = in_folder(&dir, &["run", "n.toml"]);
        assert_eq!(code(&output), 0, "{engine}: {}{}", stdout(&output), stderr(&output));
    }
    // A value of another type is an expression of VHDL, and no more than one.
    let bad = scene(&["h.vhd".to_string()], "engine = \"ghdl\"\ngenerics = { N = \"1; end; architecture\" }");
    fs::write(dir.join("bad.toml"), bad).expect("a scene");
    assert_refused(
        &in_folder(&dir, &["run", "bad.toml"]),
        4,
        &["bad.toml:14:", "dut.generics.N", "no expression of VHDL"],
    );
    assert_not_executed(&dir);
}

/// A study of four points, which take a moment.
const STUDY: &str = "name = \"four\"\ntitle = \"Four points\"\n[map]\nscene = \"hybrid-wall\"\n\
                     x = \"wall.stiffness=0.5..1 N.m/rad:2\"\ny = \"wall.damping=0..0.1 mN.m.s/rad:2\"\n\
                     set = [\"run.duration=1 ms\"]\nfull = true\n";

/// Puts schedulers into a folder: `sbatch` runs the tasks of an array at once, `parallel` its template for each line.
/// GNU parallel replaces other words in braces too; here they are executed.
fn schedulers(dir: &Path) -> PathBuf {
    let sbatch = "cat >\"$0.job\"\ncp \"$0.job\" \"$0.last\"\n\
                  grep -q '^#SBATCH --array=' \"$0.job\" || { echo 2; exit; }\n\
                  for task in 0 1 2 3; do SLURM_ARRAY_TASK_ID=$task sh \"$0.job\" >&2 || exit 1; done\necho 1";
    let parallel = "case $1 in *'{.}'* | *'{#}'* | *'{%}'* | *'{='*) touch PWNED;; esac\n\
                    while read -r line; do sh -c \"$(printf '%s' \"$1\" | sed \"s/{}/$line/g\")\" || exit 1; done";
    tools(dir, &[("sbatch", sbatch), ("squeue", "exit 0"), ("scontrol", "exit 1"), ("parallel", parallel)])
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn sweeps_in_folders_of_any_name_are_submitted() {
    let dir = scratch("names-sweep");
    fs::write(dir.join("study.toml"), STUDY).expect("a study");
    let path = format!("{}:{}", schedulers(&dir).display(), std::env::var("PATH").expect("a PATH"));
    let submit = |out: &str, more: &[&str]| {
        let mut command = hpu();
        command.args(["sweep", "submit"]).args(more).arg("--").arg(out).current_dir(&dir).env("PATH", &path);
        command.output().expect("starts")
    };
    for (index, name) in AWKWARD.iter().enumerate() {
        for engine in ["slurm", "parallel"] {
            let out = format!("{name} of {engine}");
            let plan = ["sweep", "plan", "study.toml", &format!("-o={out}"), "--shard-points", "2"];
            let output = in_folder(&dir, &plan);
            assert_eq!(code(&output), 0, "{out:?}: {}", stderr(&output));
            // A script of GNU parallel is always that of one wave.
            let shown = ["--dry-run", "--one-wave"].map(String::from);
            let shown = if engine == "slurm" { &shown[..] } else { &shown[..1] };
            let shown: Vec<_> = ["--engine", engine].into_iter().chain(shown.iter().map(String::as_str)).collect();
            for dry in [&shown[..], &["--engine", engine, "--one-wave"]] {
                let output = submit(&out, dry);
                // Slurm has no way to write a backslash in a path. A line's end stays out of every script.
                if name.contains('\n') || name.contains('\\') && engine == "slurm" {
                    assert_refused(&output, 2, &["rename the folder"]);
                    continue;
                }
                assert_eq!(code(&output), 0, "{out:?}: {}", stderr(&output));
                if !dry.contains(&"--dry-run") {
                    let done = names(&dir.join(&out).join("shards-1"));
                    assert_eq!(done, ["000000.parquet", "000001.parquet"], "{out:?}: {}", stdout(&output));
                }
            }
        }
        // On this machine a sweep has run in any folder before.
        if index < 8 || name.contains('\n') {
            let output = in_folder(&dir, &["sweep", "run", "study.toml", &format!("-o={name} here"), "--quiet"]);
            assert_eq!(code(&output), 0, "{name:?}: {}", stderr(&output));
        }
    }
    // The log's folder has no pattern of Slurm's, and an option no line of its own.
    let script = fs::read_to_string(dir.join("tools/sbatch.last")).expect("a script");
    assert!(script.contains("/slurm-%A.log\n"), "{script}");
    let output = submit("50%A%j of slurm", &["--engine", "slurm", "--dry-run"]);
    assert!(stdout(&output).contains("/50%%A%%j of slurm'/slurm-%A.log\n"), "{}", stdout(&output));
    let output = submit("a b of slurm", &["--engine=slurm", "--dry-run", "--option=--x\ntouch PWNED"]);
    assert_refused(&output, 2, &["--option", "control character"]);
    assert_not_executed(&dir);
}

#[test]
fn results_come_into_folders_of_any_name() {
    let dir = scratch("names-out");
    for name in AWKWARD {
        let output = in_folder(&dir, &["run", "free-motion", "--edges", "1000", &format!("-o={name}"), "--vcd"]);
        assert_eq!(code(&output), 0, "{name:?}: {}", stderr(&output));
        assert!(dir.join(name).join("wave.vcd").is_file(), "{name:?}");
    }
    assert_not_executed(&dir);
    // The command that a page shows is one that a shell reads as it was given.
    fs::copy(Path::new(crate::common::ROOT).join("testbench/scenes/free-motion.toml"), dir.join("it's a b.toml"))
        .expect("a scene");
    let output = in_folder(&dir, &["fit", "it's a b.toml", "--set", "run.duration=1 ms", "--json"]);
    let shown = stdout(&output);
    assert!(shown.contains(r"hpu run 'it'\\''s a b.toml'"), "{shown}{}", stderr(&output));
    let said = Command::new("sh").args(["-c", r"printf %s 'it'\''s a b.toml'"]).output().expect("a shell");
    assert_eq!(said.stdout, b"it's a b.toml");
}
