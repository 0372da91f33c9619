//! Makes a command from a case: a verb, a scene with sensible values, and a small budget.

use std::fs;
use std::path::Path;

use hpu_cosim::scene::{Experiment, Shipped};
use hpu_datapath::variants;

use super::Case;
use super::keys::{Key, Set, Takes, parsed};

/// The verbs that are run.
pub const VERBS: [&str; 12] = [
    "run",
    "run -o",
    "run --compare",
    "block",
    "vectors",
    "vectors --verify",
    "limits",
    "map",
    "chart",
    "fit",
    "widths",
    "rest",
];

/// The scene of a case, and the changes to it that the scene accepts.
pub struct Changed<'s> {
    pub scene: &'s Shipped,
    pub set: Set,
    pub experiment: Experiment,
}

/// Applies a case's changes to its scene. Most changes that the scene refuses are left out, and the run is made short.
pub fn changed<'s>(case: &Case, scene: &'s Shipped, keys: &[Key], edges: u64) -> Changed<'s> {
    let mut set = Set::new();
    let mut experiment = parsed(scene, &set).expect("a shipped scene");
    for &(key, how, at) in &case.changes {
        let Key { path, takes } = &keys[usize::from(key) % keys.len()];
        if ["run.duration", "record.plant_rate", "wall.ramp.from", "wall.ramp.to"].contains(&path.as_str()) {
            continue;
        }
        let value = takes.value(how, at);
        // The linear law has no datapath to run.
        if value == "linear" && VERBS[case.verb] != "limits" {
            continue;
        }
        let mut with = set.clone();
        with.push((path.clone(), value));
        if let Ok(accepted) = parsed(scene, &with) {
            (set, experiment) = (with, accepted);
        }
    }
    let clock_hz = experiment.clock.frequency_hz() as f64;
    let short = [
        ("run.duration", format!("{:e}", edges as f64 / clock_hz)),
        ("record.plant_rate", format!("{:e}", clock_hz * 300.0 / edges as f64)),
    ];
    for (key, value) in short {
        let mut with = set.clone();
        with.push((key.to_string(), value));
        if let Ok(accepted) = parsed(scene, &with) {
            (set, experiment) = (with, accepted);
        }
    }
    Changed { scene, set, experiment }
}

fn words(text: &str) -> Vec<String> {
    text.split(' ').map(str::to_string).collect()
}

/// Returns the arguments of a case's command. Writes its files into `dir`.
pub fn arguments(case: &Case, scenes: &[Shipped], keys: &[Vec<Key>], dir: &Path) -> Vec<String> {
    let [a, b, c, d] = case.numbers.map(|number| number as usize);
    let verb = VERBS[case.verb];
    let pick = |verb: &str| {
        let fits = |scene: &Shipped| match verb {
            "limits" | "widths" => !scene.name.starts_with("phantom"),
            // A recording has no device.
            "chart" | "fit" => scene.name != "replay-capture",
            _ => true,
        };
        (0..scenes.len())
            .map(|step| (case.scene + step) % scenes.len())
            .find(|&index| fits(&scenes[index]))
            .unwrap_or(0)
    };
    let index = pick(verb);
    let edges = match verb {
        "run" | "run -o" | "run --compare" => [1, 40, 1000, 20_000, 100_000][a % 5],
        "vectors" => 2000,
        "limits" => 10_000,
        _ => 3000,
    };
    let changed = changed(case, &scenes[index], &keys[index], edges);
    let named = |set: &Set| {
        let scene = match &case.spoilt {
            // The scene's own file with a part replaced.
            Some(spoilt) => {
                fs::write(dir.join("spoilt.toml"), spoilt.text(changed.scene.text)).expect("a scene");
                "spoilt.toml".to_string()
            }
            None if a % 3 == 0 => {
                fs::write(dir.join("scene.toml"), changed.scene.text).expect("a scene");
                "./scene.toml".to_string()
            }
            None => changed.scene.name.to_string(),
        };
        let mut arguments = vec![scene];
        arguments.extend(set.iter().flat_map(|(key, value)| ["--set".to_string(), format!("{key}={value}")]));
        arguments
    };
    let with_scene = |start: &str, end: &str| {
        let mut arguments = words(start);
        arguments.extend(named(&changed.set));
        arguments.extend(end.split(' ').filter(|word| !word.is_empty()).map(str::to_string));
        arguments
    };
    // Data files are copied to where shipped scenes look for them.
    for file in ["replay-motion.csv", "replay-capture.vcd"] {
        fs::copy(Path::new(crate::common::ROOT).join("testbench/scenes").join(file), dir.join(file)).expect("data");
    }
    let fixed = matches!(&changed.experiment, Experiment::Axis(scene) if !scene.model.solver.is_exact());
    match verb {
        "run" => {
            let driver = ["", "--driver events", "--driver clock"][if fixed { 0 } else { b % 3 }];
            let edges = if c % 2 == 0 { format!("--edges {}", 1 + c % edges as usize) } else { String::new() };
            with_scene("run", &format!("{driver} {edges} {}", ["", "--json"][d % 2]))
        }
        "run -o" => with_scene("run", ["-o out --no-plot", "-o out", "-o out --vcd --no-plot", "-o out --json"][b % 4]),
        "run --compare" => with_scene("run", if fixed { "" } else { "--compare" }),
        "block" => block(case, dir),
        "vectors" => {
            let form = ["txt", "csv", "json", "readmemh", "coe", "mif-intel", "mif-xilinx"][b % 7];
            let blocks = variants();
            let (label, block) = &blocks[c % blocks.len()];
            let set = ["directed", "random"][d % 2];
            match a % 3 {
                0 => {
                    let mut arguments = words("vectors --set-kind scene --count 200 --scene");
                    arguments.extend(named(&changed.set));
                    arguments.extend(words(&format!("--format {form}")));
                    arguments
                }
                1 => words(&format!(
                    "vectors {} --variant {label} --set-kind {set} --count {} --seed {a} --format {form}",
                    block.name(),
                    1 + d % 300
                )),
                _ => words(&format!("vectors {} --set-kind {set} --count 20 --format {form} -o out", block.name())),
            }
        }
        "vectors --verify" => verify(case, dir),
        "limits" => with_scene("limits", ["", "--json"][b % 2]),
        "map" | "chart" => {
            let axes = axes(case, &changed, &keys[index]);
            let jobs = "--jobs 1".to_string();
            let out = ["", "-o out", "--json", ""][b % 4];
            match (verb, axes) {
                ("chart", axes) if c % 3 != 0 || axes.is_none() => {
                    with_scene("chart", &format!("--contestants events,clock {jobs} {out}"))
                }
                (_, Some([x, y])) => {
                    let full = if verb == "map" { ["", "--full"][d % 2] } else { "--contestants events,clock" };
                    let mut arguments = with_scene(verb, &format!("{jobs} {full} {out}"));
                    arguments.extend(["--x".to_string(), x, "--y".to_string(), y]);
                    arguments
                }
                // A scene in which nothing varies.
                _ => with_scene("run", ""),
            }
        }
        "fit" => with_scene("fit", ["", "--json", "--within 5%"][b % 3]),
        "widths" => {
            let search = "--search --no-trials --jobs 1 --vary position_bits=10..11 --vary velocity_bits=10..11";
            with_scene("widths", ["", "--json", "--json", "-o out", "--notation q", search][b % 6])
        }
        _ => rest(case),
    }
}

/// Returns ranges of two keys around the values that the scene accepts.
fn axes(case: &Case, changed: &Changed, keys: &[Key]) -> Option<[String; 2]> {
    let sizes: Vec<&Key> = keys.iter().filter(|key| matches!(key.takes, Takes::Size { .. })).collect();
    let mut axes = Vec::new();
    for step in 0..40 {
        let key = sizes[(case.numbers[3] as usize + step * 7) % sizes.len()];
        if key.path.starts_with("run.")
            || key.path.starts_with("record.")
            || axes.iter().any(|axis: &String| axis.starts_with(&key.path))
        {
            continue;
        }
        let Takes::Size { least, most, .. } = key.takes else { continue };
        let least = if least > 0.0 { least } else { most * 1e-9 };
        let at = |share: f64| format!("{:.3e}", (least.ln() + share * (most.ln() - least.ln())).exp());
        let low = f64::from(case.numbers[2] % 97) / 97.0;
        let ends = [at(0.9 * low + 0.05), at(0.9 * low + 0.09)];
        let fits = |value: &String| {
            let mut set = changed.set.clone();
            set.push((key.path.clone(), value.clone()));
            parsed(changed.scene, &set).is_ok()
        };
        if ends.iter().all(fits) {
            axes.push(format!("{}={}..{}:{}", key.path, ends[0], ends[1], 2 + case.numbers[1] % 3));
        }
        if axes.len() == 2 {
            return axes.try_into().ok();
        }
    }
    None
}

/// Ticks a block with words of its inputs.
fn block(case: &Case, dir: &Path) -> Vec<String> {
    let blocks = variants();
    let (label, block) = &blocks[case.numbers[0] as usize % blocks.len()];
    let mut state = u64::from(case.numbers[1]) | 1;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state ^ state >> 29
    };
    let inputs = block.inputs();
    let mut text = inputs.iter().map(|input| input.name).collect::<Vec<_>>().join(",") + "\n";
    for _ in 0..case.numbers[2] % 40 {
        let word = |input: &hpu_signal::Signal, random: u64| {
            let (least, most) = (input.format.min(), input.format.max());
            match random % 4 {
                0 => least,
                1 => most,
                _ => least + i128::from(random >> 2) % (most - least + 1),
            }
        };
        let row: Vec<_> = inputs.iter().map(|input| word(input, next()).to_string()).collect();
        text += &(row.join(",") + "\n");
    }
    if let Some(spoilt) = &case.spoilt {
        text = spoilt.text(&text);
    }
    fs::write(dir.join("inputs.csv"), text).expect("inputs");
    let mut arguments = words(&format!("block {} --variant {label} --inputs inputs.csv", block.name()));
    match case.numbers[3] % 4 {
        0 => arguments.push("--json".into()),
        1 => arguments = words(&format!("block {} --variant {label} --notation vhdl", block.name())),
        _ => {}
    }
    arguments
}

/// Verifies a vector file of the project, whole or with a part replaced.
fn verify(case: &Case, dir: &Path) -> Vec<String> {
    let folder = Path::new(crate::common::ROOT).join("vectors");
    let list = |dir: &Path| {
        let mut all: Vec<_> =
            fs::read_dir(dir).expect("vectors").map(|entry| entry.expect("an entry").path()).collect();
        all.sort();
        all
    };
    let blocks: Vec<_> = list(&folder).into_iter().filter(|path| path.is_dir()).collect();
    let files: Vec<_> = list(&blocks[case.numbers[0] as usize % blocks.len()])
        .into_iter()
        .filter(|path| path.extension().is_some_and(|end| end == "txt"))
        .collect();
    let Some(file) = files.get(case.numbers[1] as usize % files.len().max(1)) else { return words("scenes") };
    let mut text = fs::read_to_string(file).expect("vectors");
    if let Some(spoilt) = &case.spoilt {
        text = spoilt.text(&text);
    }
    fs::write(dir.join("vectors.txt"), text).expect("vectors");
    words("vectors --verify vectors.txt")
}

/// Runs all other verbs, and arguments that are refused.
fn rest(case: &Case) -> Vec<String> {
    let all = [
        "scenes",
        "scenes --json",
        "block",
        "block --json",
        "run",
        "run --json",
        "--help",
        "--version",
        "run --help",
        "map --help",
        "reproduce phantom-sines",
        "vectors position_counter --format vunit",
        "vectors trig_table --set-kind table",
        "scenes --json",
        "block pwm",
        "block torque_sum --json",
        "limits hybrid-wall --json",
        "limits rail-drop",
        "block pwm --notation q",
        // These are refused, or lack the tool.
        "check no_such_block",
        "cost no_such_block",
        "check displacement --rows 5",
        "map hybrid-wall --x wall.stiffness=1..1 --y wall.position=1..2",
        "block pwm --inputs /dev/zero",
        "run /dev/zero",
        "run replay-motion --set hand.file=/dev/zero",
        "vectors --verify /dev/zero",
    ];
    // Refused arguments are rare.
    let at = case.numbers[0] as usize;
    words(if at.is_multiple_of(10) { all[19 + at / 10 % 8] } else { all[at / 10 % 19] })
}
