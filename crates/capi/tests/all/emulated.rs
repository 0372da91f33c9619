//! A scene's own loop, from change to change.

use hpu::Emulated;
use hpu_cosim::Control;

use crate::common::shipped;

fn open(scene: &str, set: &[(&str, &str)]) -> Emulated {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    Emulated::open(&shipped(scene), &set).unwrap_or_else(|error| panic!("{error}"))
}

/// A step to a change ends at the first edge with other words, as steps of one edge show; in free motion and in
/// contact, by events and by the clock.
#[test]
fn a_step_to_a_change_misses_none() {
    let control = Control::new();
    for (scene, from) in [("hybrid-wall", 10_000_000), ("hybrid-wall", 40_000_000), ("cable-knob", 2_000_000)] {
        for solver in ["events", "clock"] {
            if solver == "clock" && from > 20_000_000 {
                continue;
            }
            let [mut single, mut leaping] = [(); 2].map(|()| open(scene, &[("model.solver", solver)]));
            for emulated in [&mut single, &mut leaping] {
                emulated.step(from, &control).expect("within the scene");
            }
            let (end, mut changes) = (from + 200_000, 0);
            while single.edge() < end {
                let before = single.words().to_vec();
                while single.edge() < end && single.words() == before {
                    single.step(1, &control).expect("within the scene");
                }
                let changed = single.words() != before;
                let left = end - leaping.edge();
                assert_eq!(leaping.step_to_change(left, &control).expect("within the scene"), changed);
                assert_eq!(leaping.edge(), single.edge(), "{scene} {solver}");
                assert_eq!(leaping.words(), single.words(), "{scene} {solver} at {}", single.edge());
                changes += u32::from(changed);
            }
            assert!(changes > 3, "{scene} {solver}: {changes}");
        }
    }
}
