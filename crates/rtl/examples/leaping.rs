//! The leaping engine alone, over netlists of designs in this repository.
//!
//! Without an argument it lists its runs, for `testbench/instructions.sh`, which counts their instructions under
//! callgrind; with the name of one it does that. Only what happens within `counted` counts, not the netlist's making.
//!
//! With `--loops`, the VHDL of each loop of this project is a design by others: it tells how many steps the
//! hand-written `quiet` and `skip` of the emulator take for a million clock edges, and how many jumps and edges the
//! leaping engine. The outputs of both are compared at every thousandth edge.
//!
//! Exit codes: 0 done, 1 outputs differ, 2 there is no such run.

use std::io::{self, Write as _};
use std::process::ExitCode;

use hpu_cosim::dut::Fault;
use hpu_cosim::scene::{DutScene, Experiment, SceneFile};
use hpu_datapath::{AnyBlock, Generic, block_by_name, registry};
use hpu_leap::{Leap, Netlist};
use hpu_rtl::dut::Simulators;
use hpu_rtl::{CacheFolder, Hdl, Setup, temporary};

/// Clock edges of a loop, those between two changes of the encoder's lines, and those of the reset.
const EDGES: u64 = 1_000_000;
const REST: u64 = 1000;
const RESET: u64 = 8;

/// A word that an input is given, by the input's name.
type Given<'g> = &'g dyn Fn(&str, u8) -> u64;

/// Callgrind counts while a run is in here.
#[inline(never)]
fn counted(work: &mut dyn FnMut()) {
    work();
}

/// Returns the netlist of a scene's design. The file is read, and its constants for ports do not count.
fn netlist(scene: &SceneFile) -> Result<Netlist, Fault> {
    let cache = CacheFolder::new(Some(std::env::temp_dir().join("hpu-leaps")), "built models").with_programs();
    let set = [("dut.engine".to_string(), "leap".to_string())];
    let scene: DutScene = match scene.parse(&set)? {
        Experiment::Dut(scene) => scene,
        _ => return Err("the scene has no [dut]".into()),
    };
    let made = Simulators { cache, setup: Setup::new(Hdl::Carried) }.netlist_of(&scene)?;
    Ok(Netlist::clone(&made))
}

/// Returns the names and the texts of a block's VHDL file and of those that it uses.
fn files(name: &str) -> io::Result<Vec<(String, String)>> {
    let (mut next, mut found) = (vec![name.to_string()], Vec::<(String, String)>::new());
    while let Some(name) = next.pop() {
        if found.iter().any(|(own, _)| *own == name) {
            continue;
        }
        let in_folder = |folder: &str| std::fs::read_to_string(format!("{folder}/{name}.vhd"));
        let text = in_folder("hdl").or_else(|_| in_folder("hdl/generated"))?;
        let used = text
            .split("work.")
            .skip(1)
            .filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next());
        next.extend(used.map(str::to_string));
        found.push((name, text));
    }
    Ok(found)
}

/// Returns the netlist of a block of this project, with the generics that it has.
fn own(block: &dyn AnyBlock) -> Result<Netlist, Fault> {
    let folder = temporary::Temporary::folder()?;
    let mut names = Vec::new();
    for (name, text) in files(block.name())? {
        std::fs::write(folder.path().join(format!("{name}.vhd")), text)?;
        names.push(format!("\"{name}.vhd\""));
    }
    let value = |(name, value): (&str, Generic)| match value {
        Generic::Integer(value) => format!("{name} = {value}\n"),
        Generic::Boolean(value) => format!("{name} = {value}\n"),
    };
    let generics: String = block.generics().into_iter().map(value).collect();
    let text = format!(
        "about = \"a loop\"\ndevice = {{ kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }}\nclock = {{ \
         frequency = \"50 MHz\" }}\nrun = {{ duration = \"1 ms\" }}\nhand = {{ kind = \"spring_damper\", stiffness = \
         \"0.3 N.m/rad\", damping = 0, path = [[0, 0], [1, 1]] }}\n[dut]\nfiles = [{}]\ntop = \"{}\"\nclock = \
         \"clk\"\nreset = {{ port = \"rst\" }}\n[dut.generics]\n{generics}",
        names.join(", "),
        block.name()
    );
    let data = folder.path().to_path_buf();
    netlist(&SceneFile { name: "own.toml".to_string(), text, data, is_shipped: false })
}

/// Returns a line of an encoder after this many forward steps, or the word of its counter, which begins near a wall;
/// `None` for other inputs.
fn line(name: &str, step: u64) -> Option<u64> {
    if name == "pos" {
        return Some(970 + step);
    }
    let of = |part: &str| name == part || name.starts_with(&format!("{part}_"));
    let (a, b) = (matches!(step % 4, 1 | 2), step % 4 > 1);
    if of("a_pin") || of("enc_a") {
        return Some(b.into());
    }
    (of("b_pin") || of("enc_b")).then_some(a.into())
}

/// A netlist that is clocked from the end of its reset on.
struct Clocked {
    leap: Leap,
    inputs: Vec<(String, u8)>,
}

impl Clocked {
    fn new(netlist: &Netlist, given: Given) -> Self {
        let inputs = netlist.inputs().iter().map(|(name, net)| (name.clone(), netlist.width(*net)));
        let initial: Vec<_> = netlist.registers().iter().map(|register| register.initial).collect();
        let ranks: Vec<_> = netlist.outputs().iter().map(|output| u8::from(netlist.width(output.net) > 1)).collect();
        let mut clocked =
            Self { leap: Leap::new(netlist, (&initial, &vec![0; inputs.len()]), &ranks), inputs: inputs.collect() };
        clocked.leap.input(&clocked.words(true, 0, given));
        clocked.clock(RESET);
        let words = clocked.words(false, 0, given);
        clocked.leap.input(&words);
        // As in a run, the reset stays passive.
        if let Some(at) = clocked.inputs.iter().position(|(name, _)| name.starts_with("rst")) {
            let registers: Vec<_> = clocked.leap.registers().collect();
            clocked.leap = Leap::new(&netlist.with_input(at, words[at]), (&registers, &words), &ranks);
        }
        clocked
    }

    /// Returns the words of all inputs after so many steps of the encoder.
    fn words(&self, resets: bool, step: u64, given: Given) -> Vec<u64> {
        let word = |(name, width): &(String, u8)| match &**name {
            "rst" => resets.into(),
            "rst_n" => (!resets).into(),
            name => line(name, step).unwrap_or_else(|| given(name, *width)),
        };
        self.inputs.iter().map(word).collect()
    }

    fn clock(&mut self, edges: u64) {
        let mut done = 0;
        while done < edges {
            done += self.leap.clock(edges - done, 0, |_, _, _| {});
        }
    }
}

/// Counts a run of a netlist for some 2 000 000 edges, with an encoder that steps every `rest` edges. The words of the
/// inputs are made before.
fn run(netlist: &Netlist, given: Given, rest: u64) {
    let source = Clocked::new(netlist, given);
    let words: Vec<_> = (0..2 * EDGES / rest).map(|step| source.words(false, step, given)).collect();
    counted(&mut || {
        let mut clocked = Clocked::new(netlist, given);
        for words in &words {
            clocked.leap.input(words);
            clocked.clock(rest);
        }
        assert!(clocked.leap.share().leapt > EDGES, "it leaps");
    });
}

/// Returns the word of a loop's parameter: a long sample, else a word of half as many bits.
fn parameter(name: &str, width: u8) -> u64 {
    match name {
        "period" => 50_000,
        _ if width == 1 => 0,
        _ => 1 << (width / 2 - 1),
    }
}

/// Steps a loop by its own `quiet` and `skip` and as a netlist. Returns what there is to tell, and whether outputs
/// differ.
fn compared(block: &mut dyn AnyBlock) -> Result<(String, bool), Fault> {
    let netlist = own(block)?;
    let mut clocked = Clocked::new(&netlist, &parameter);
    let outputs = block.outputs();
    let places: Vec<_> =
        outputs.iter().map(|signal| netlist.outputs().iter().position(|output| output.name == signal.name)).collect();
    let names: Vec<_> =
        block.inputs().iter().map(|signal| (signal.name.to_string(), signal.format.width() as u8)).collect();
    if names.iter().any(|(name, _)| !clocked.inputs.iter().any(|(own, _)| own == name)) || places.contains(&None) {
        return Err("its ports have other names in the netlist".into());
    }
    let (mut words, before) = (block.reset(), clocked.leap.share());
    let (mut steps, mut differ) = (0u64, 0);
    for step in 0..EDGES / REST {
        clocked.leap.input(&clocked.words(false, step, &parameter));
        clocked.clock(REST);
        let word =
            |(name, width): &(String, u8)| line(name, step).unwrap_or_else(|| parameter(name, *width)).cast_signed();
        let input: Vec<_> = names.iter().map(word).collect();
        let mut left = REST;
        while left > 0 {
            let quiet = block.quiet(&input).min(left);
            match quiet {
                0 => words = block.tick(&input),
                _ => block.skip(quiet, &input),
            }
            (steps, left) = (steps + 1, left - quiet.max(1));
        }
        let same = |((signal, place), word): ((&hpu_signal::Signal, &Option<usize>), &i64)| {
            let shown = clocked.leap.output(place.expect("an output"));
            shown == word.cast_unsigned() & u64::MAX >> (64 - signal.format.width())
        };
        differ += u64::from(!outputs.iter().zip(&places).zip(&words).all(same));
    }
    let share = clocked.leap.share();
    let (jumped, leapt) = (share.steps - before.steps, share.leapt - before.leapt);
    let percent = 100.0 * leapt as f64 / EDGES as f64;
    let text = format!("{steps:>8} {jumped:>8} {percent:>6.1} %  {:>6.2}", jumped as f64 / steps as f64);
    Ok((if differ > 0 { format!("{text}  {differ} DIFFER") } else { text }, differ > 0))
}

/// Returns whether a block is a loop. Those of arms are left out: their engines are too large for a netlist of words.
fn is_axis(name: &str) -> bool {
    name.ends_with("_loop") && !name.starts_with("phantom") && !name.starts_with("gimbal")
}

fn loops() -> io::Result<bool> {
    let mut out = io::stdout();
    writeln!(
        out,
        "# steps of `quiet` and `skip`, of the leaping engine, its share of edges leapt over, its steps over theirs"
    )?;
    let mut is_wrong = false;
    for mut block in registry().into_iter().filter(|block| is_axis(block.name())) {
        let line = match compared(&mut *block) {
            Ok((line, differs)) => {
                is_wrong |= differs;
                line
            }
            Err(fault) => format!("no leaps: {}", fault.to_string().lines().take(2).collect::<Vec<_>>().join(" ")),
        };
        writeln!(out, "{:<26} {line}", block.name())?;
    }
    Ok(is_wrong)
}

fn main() -> ExitCode {
    let scene = |name: &str| SceneFile::find(&format!("testbench/dut/{name}.toml")).map_err(Fault::from);
    // The wall is near, so that the modulator works.
    let knee = |name: &str, _| match name {
        "gain" => 95,
        "wall" => 20,
        "pos_valid" => 1,
        _ => 0,
    };
    let name = std::env::args().nth(1);
    // In runs of these scenes the encoder has about as many edges a second.
    let (rest, made) = match name.as_deref() {
        None => {
            let mut all = ["knee", "rim", "hybrid", "prescaled", "paddle"].into_iter();
            let lists = |case| writeln!(io::stdout(), "leap-{case} the netlist for 2 * 10^6 edges").is_ok();
            return ExitCode::from(u8::from(!all.all(lists)));
        }
        Some("--loops") => return ExitCode::from(u8::from(loops().unwrap_or(true))),
        Some("leap-knee") => (6500, scene("knee").and_then(|scene| netlist(&scene))),
        Some("leap-rim") => (6500, scene("rim").and_then(|scene| netlist(&scene))),
        Some("leap-prescaled") => (32_000, scene("prescaled").and_then(|scene| netlist(&scene))),
        Some("leap-paddle") => (13_000, scene("paddle").and_then(|scene| netlist(&scene))),
        Some("leap-hybrid") => (32_000, own(&*block_by_name("hybrid_loop").expect("a block"))),
        Some(_) => return ExitCode::from(2),
    };
    let netlist = made.unwrap_or_else(|fault| panic!("{fault}"));
    let given: Given = if name.as_deref() == Some("leap-hybrid") { &parameter } else { &knee };
    run(&netlist, given, rest);
    ExitCode::SUCCESS
}
