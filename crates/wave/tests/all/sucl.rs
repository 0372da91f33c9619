//! The command file for Surfer: its items are those of GTKWave's save file, and each command acts on the item that was
//! added last.

use hpu_datapath::{HybridLoop, LoopConfig};
use hpu_signal::{Clock, Cycle, Real};
use hpu_wave::{Layout, gtkw, sucl};

const REALS: [Real; 2] = [Real { name: "angle_rad", doc: "angle" }, Real { name: "current_a", doc: "current" }];

#[test]
fn surfer_shows_what_gtkwave_shows_and_formats_the_item_added_last() {
    let wiring = HybridLoop::new(LoopConfig::default()).expect("valid");
    let layout = Layout::new(&wiring, &REALS).with_clock();
    let clock = Clock::new(50_000_000).expect("valid");
    let named = [(Cycle(7), "first contact".to_string())];
    let commands = sucl(&layout, "run.fst", clock, &named);
    let save = gtkw(&layout, "run.fst", clock, Cycle(0)..Cycle(100), None, &named);

    let traces = save.lines().filter(|line| !line.starts_with(['[', '@', '-', '*']));
    let traces: Vec<_> = traces.map(|line| line.rsplit_once("} ").map_or(line, |(_, name)| name)).collect();
    let traces: Vec<_> = traces.iter().map(|name| name.split('[').next().expect("a name")).collect();
    let added: Vec<_> = commands.lines().filter_map(|line| line.strip_prefix("variable_add ")).collect();
    assert_eq!(added, traces);

    let (mut items, mut focus, mut formats) = (0, None, Vec::new());
    let mut last = "";
    for line in commands.lines() {
        let (command, value) = line.split_once(' ').unwrap_or((line, ""));
        match command {
            "variable_add" | "divider_add" => {
                assert!(!value.contains(' '), "{line}");
                (items, focus, last) = (items + 1, None, value);
            }
            "item_focus" => {
                // The letters a to p are the hexadecimal digits of a place.
                let digits = value.bytes().map(|letter| u32::from(letter - b'a'));
                focus = Some(digits.fold(0, |place, digit| 16 * place + digit));
            }
            "item_set_format" | "item_set_analog" => {
                assert_eq!(focus, Some(items - 1), "{line}");
                formats.push((last, value));
            }
            "#" | "item_unfocus" | "zoom_fit" => {}
            // 140 ns in units of 10 ns.
            "marker_set" => assert_eq!(value, "first_contact 14"),
            _ => panic!("{line}"),
        }
    }
    assert!(items > 30, "{items}: letters of two digits");
    for expected in [
        ("hybrid_loop.position", "Signed"),
        ("hybrid_loop.penetration", "Unsigned"),
        ("hybrid_loop.command", "step"),
        ("plant.angle_rad", "interpolated"),
    ] {
        assert!(formats.contains(&expected), "{expected:?} of {formats:?}");
    }
    assert!(!formats.iter().any(|(name, _)| *name == "hybrid_loop.a_high"));
    assert!(commands.ends_with("marker_set first_contact 14\n"));
}
