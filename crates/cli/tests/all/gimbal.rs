//! `hpu` with scenes of a segment on a gimbal.

use std::collections::BTreeSet;
use std::fs;

use crate::common::{code, names, run, scratch, stderr, stdout, text};

#[test]
fn a_folder_gets_pictures_and_waves_whose_save_file_names_signals_of_the_waves() {
    let out = scratch("gimbal-files").join("out");
    let output = run(&["run", "gimbal-switch", "--edges", "1000000", "--vcd", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let pictures = ["device.png", "device.svg", "finger.png", "finger.svg", "motion.png", "motion.svg"];
    let others = ["summary.json", "trace.csv"];
    let waves = ["wave.fst", "wave.fst.gtkw", "wave.fst.sucl", "wave.vcd", "wave.vcd.gtkw", "wave.vcd.sucl"];
    assert_eq!(names(&out), [&pictures[..], &others, &waves].concat());
    for name in pictures {
        assert!(stdout(&output).contains(text(&out.join(name))), "{name} is listed");
    }
    let read = |name: &str| fs::read_to_string(out.join(name)).expect("a text");
    // Of a word, a dump has the range of its bits behind the name.
    let mut scopes: Vec<String> = Vec::new();
    let mut variables = BTreeSet::new();
    for line in read("wave.vcd").lines().take_while(|line| !line.starts_with("$enddefinitions")) {
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            ["$scope", _, name, "$end"] => scopes.push(name.to_string()),
            ["$upscope", "$end"] => _ = scopes.pop(),
            ["$var", _, _, _, ref name @ .., "$end"] => {
                _ = variables.insert(format!("{}.{}", scopes.join("."), name.concat()))
            }
            _ => {}
        }
    }
    let save = read("wave.vcd.gtkw");
    let traces = save.lines().filter(|line| !line.starts_with(['[', '@', '-', '*']));
    let traces: Vec<_> = traces.map(|line| line.rsplit_once("} ").map_or(line, |(_, name)| name)).collect();
    assert!(traces.len() > 40, "{traces:?}");
    for trace in traces {
        assert!(variables.contains(trace), "{trace} of {variables:?}");
    }
    let groups: Vec<_> = ["-Target\n", "-Servos\n", "-Switch\n"].into_iter().map(|group| save.find(group)).collect();
    assert!(groups[0].is_some() && groups.is_sorted(), "{groups:?}");
}

#[test]
fn a_run_without_a_finger_draws_no_force() {
    let out = scratch("gimbal-no-finger").join("out");
    let output = run(&["run", "gimbal-shape", "--edges", "1000000", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let found = names(&out);
    assert_eq!(&found[..4], ["device.png", "device.svg", "motion.png", "motion.svg"]);
    assert!(!found.iter().any(|name| name.starts_with("finger")), "{found:?}");
}
