//! The drawing of a device names what its scene has, and where.

use hpu_cosim::scene::shipped;

/// Returns the texts of a scene's drawing in their order, body by body: its lines, what is above it, what is below it.
fn texts(name: &str) -> Option<Vec<String>> {
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    let svg = hpu_page::device::drawing(&scene.parse(&[]).unwrap())?;
    let (_, body) = svg.split_once("</title>").unwrap();
    let texts = body.split("<text ").skip(1);
    Some(texts.map(|text| text.split(['>', '<']).nth(1).unwrap().to_string()).collect())
}

#[test]
fn a_drawing_names_bodies_joints_drive_sensors_hand_and_wall() {
    let joint = texts("two-encoder-joint").unwrap();
    let wanted = ["60 N.m/rad", "20 : 1", "motor", "drive: current, 30 mN.m/A", "encoder", "load", "hand"];
    let places =
        wanted.map(|text| joint.iter().position(|line| line == text).unwrap_or_else(|| panic!("{text}: {joint:?}")));
    assert!(places.is_sorted(), "{joint:?}");
    assert_eq!(joint[joint.len() - 3..], ["hand", "load: lines", "wall"]);
    // No wall, and the current is the drive's.
    let paddle = texts("epfl-paddle-step").unwrap();
    assert!(paddle.contains(&"current: current, 13 bits".into()) && paddle.contains(&"encoder".into()), "{paddle:?}");
    assert!(!paddle.contains(&"wall".into()), "{paddle:?}");
    // Three phases have the rotor's encoder and an angle beside it.
    let wheel = texts("foc-wall").unwrap();
    assert!(wheel.contains(&"drive: three phases, 7 pole pairs".into()) && wheel.contains(&"wall".into()), "{wheel:?}");
    assert!(wheel.contains(&"angle: 14 bits".into()), "{wheel:?}");
    assert_eq!(texts("hybrid-wall"), None);
}
