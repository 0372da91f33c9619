//! Quantities that are finite but absurd are refused, with the accepted range; shipped scenes are far from its ends.

use std::collections::BTreeMap;

use hpu_scene::shipped;
use toml_edit::{Document, Item, TableLike};

use super::{parse, refused, refused_hand, says};

/// Returns the message for a shipped scene with one key changed.
fn shipped_with(name: &str, key: &str, value: &str) -> String {
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&[(key.into(), value.into())]).expect_err(value).to_string()
}

#[test]
fn a_quantity_beyond_its_bounds_is_refused_with_them() {
    says(
        refused("[clock]", "initial_speed = \"1e20 rad/s\"\n[clock]"),
        "4:17: device.initial_speed: 1e20 rad/s; accepted: -1e5 to 1e5 rad/s".replace("1e5", "100000").as_str(),
    );
    says(
        refused("[clock]", "coulomb_friction = \"1 fN.m\"\n[clock]").replace("`1 fN.m` is not a torque: ", ""),
        "4:20: device.coulomb_friction: write N.m, mN.m or a number in N.m",
    );
    says(
        refused("[clock]", "coulomb_friction = 1e-15\n[clock]"),
        "4:20: device.coulomb_friction: 1e-15 N.m; accepted: 0, or 1e-12 to 10000 N.m",
    );
    says(
        refused("[clock]", "wheel_ratio = 1e9\n[clock]"),
        "4:15: device.wheel_ratio: 1000000000; accepted: 0.001 to 10000",
    );
    for (scene, key, value, told) in [
        (
            "phantom-flexible",
            "model.transmission_stiffness",
            "1e14 N/m",
            "1e14 N/m; accepted: 0, or 1e-6 to 10000000 N/m",
        ),
        ("rail-drop", "hand.torque", "1e31", "1e31 N; accepted: -1000000 to 1000000 N"),
        ("rail-drop", "device.damping", "1.5e200", "1.5e200 N.s/m; accepted: 0, or 1e-9 to 1000000 N.s/m"),
        ("rail-drop", "device.mass", "2.2e-308 g", "2.2e-311 kg; accepted: 1e-6 to 1000000 kg"),
    ] {
        let key_given = format!("--set {key}={value}: {key}: {told}");
        assert_eq!(shipped_with(scene, key, value), key_given);
    }
}

#[test]
fn a_path_beyond_its_bounds_is_refused_in_a_scene_and_in_a_file() {
    says(
        refused_hand("kind = \"prescribed\"\npath = [[0, 0], [1, 1e30]]"),
        "14:21: hand.path[1][1]: 1e30 rad; accepted: -1000000 to 1000000 rad",
    );
    says(
        refused_hand("kind = \"prescribed\"\npath = [[0, 0], [1e30, 1]]"),
        "14:18: hand.path[1][0]: 1e30 s; accepted: 0, or 1e-12 to 1000000000 s",
    );
    says(
        refused_hand("kind = \"prescribed\"\nfile = \"far.csv\""),
        "14:8: hand.file: far.csv:3: 1e30; accepted: -1000000 to 1000000",
    );
    says(
        refused_hand("kind = \"prescribed\"\nfile = \"late.csv\""),
        "14:8: hand.file: the recording begins at -1 s, before the run; write \
         file = { path = \"...\", from = \"-1 s\" }, or another beginning",
    );
}

#[test]
fn a_speed_that_no_decoder_follows_by_far_is_refused() {
    let fine = "kind = \"prescribed\"\npath = [[0, 0], [\"1 us\", 1]]";
    parse(&super::GOOD.replace("kind = \"none\"", fine), &[]).expect("13 counts an edge");
    says(
        refused_hand("kind = \"prescribed\"\npath = [[0, 0], [\"1 us\", 0], [\"1.001 us\", 10]]"),
        "14:30: hand.path[2]: between 1e-6 s and 1.001e-6 s 500000000 rad/s passes 6518.986 encoder counts in one \
         clock edge; accepted: 1000 counts, which is 76699030 rad/s",
    );
    let fast = [("device.initial_speed", "1e5"), ("clock.frequency", "50 kHz"), ("encoder.lines", "1000000")];
    says(
        parse(super::GOOD, &fast).unwrap_err().replace("--set device.initial_speed=1e5", "testbench/scenes/x.toml:0"),
        "0: device.initial_speed: 99999.9 rad/s passes 1273239 encoder counts in one clock edge; accepted: 1000 \
         counts, which is 78.53981 rad/s",
    );
}

/// Appends every value of a table, with its key.
fn values(table: &dyn TableLike, path: &str, found: &mut Vec<(String, Item)>) {
    for (key, item) in table.iter() {
        let path = if path.is_empty() { key.to_string() } else { format!("{path}.{key}") };
        match item.as_table_like() {
            Some(below) => values(below, &path, found),
            None => found.push((path, item.clone())),
        }
    }
}

#[test]
fn what_is_shipped_is_orders_of_magnitude_from_every_bound() {
    // The scenes with the least and with the greatest value of each key.
    let mut ends: BTreeMap<String, [(f64, String, &str); 2]> = BTreeMap::new();
    for scene in shipped() {
        let document = Document::parse(scene.text).unwrap();
        let kind = document.get("device").unwrap().get("kind").unwrap().as_str().unwrap();
        let mut found = Vec::new();
        values(document.as_table(), "", &mut found);
        // The order of a derivative ends at 2 by its definition, not by sense; a clock of 168 MHz is 60 times slower
        // than the fastest.
        let is_apart = |key: &str| ["shear.order", "clock.frequency"].contains(&key);
        for (key, item) in found.into_iter().filter(|(key, _)| !is_apart(key)) {
            let text = item.as_str().map_or(item.to_string(), str::to_string);
            let (number, unit) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
            let unit = unit.split('#').next().unwrap().trim();
            let Some(number) = number.parse::<f64>().ok().filter(|number| *number != 0.0) else { continue };
            // Values of one key may have units with different prefixes. The message for 1e99 times the value shows the
            // size in SI units.
            let message =
                scene.parse(&[(key.clone(), format!("{number:?}e99 {unit}"))]).err().map(|error| error.to_string());
            let Some(size) = message.as_deref().and_then(told) else { continue };
            let here = (size, format!("{number:?} {unit}"), scene.name);
            let end = ends.entry(format!("{kind} {key}")).or_insert([here.clone(), here.clone()]);
            if size < end[0].0 {
                end[0] = here.clone();
            }
            if size > end[1].0 {
                end[1] = here;
            }
        }
    }
    assert!(ends.len() > 40, "{}", ends.len());
    for (key, ends) in &ends {
        for ((_, value, name), factor) in ends.iter().zip([0.01, 100.0]) {
            let (number, unit) = value.split_once(' ').unwrap();
            let value = format!("{:?} {unit}", number.parse::<f64>().unwrap() * factor);
            let scene = shipped().iter().find(|scene| scene.name == *name).unwrap();
            let refused = scene.parse(&[(key.split_once(' ').unwrap().1.into(), value)]);
            let refused = refused.err().map_or(String::new(), |error| error.to_string());
            // Words have ranges of their own.
            assert!(!refused.contains("; accepted: "), "{name}: {refused}");
        }
    }
}

/// Returns the number that a message states before the accepted range.
fn told(message: &str) -> Option<f64> {
    let (before, _) = message.split_once("; accepted: ")?;
    before.rsplit(": ").next()?.split(' ').next()?.parse::<f64>().ok().map(f64::abs)
}
