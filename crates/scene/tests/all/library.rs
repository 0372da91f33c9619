//! The library of parts: every file is a part, and motors are what their sheets say.

use hpu_scene::{Device, Scene, parts};

fn with_motor(name: &str) -> Result<Scene, String> {
    let text = format!(
        "about = 'A motor.'\ndevice = {{ kind = 'motor', motor = '{name}' }}\nclock = {{ frequency = '50 MHz' }}\n\
         run = {{ duration = '1 s' }}\nmethod = {{ kind = 'hybrid', sample_rate = '1 kHz', \
         stiffness_format = '(0,8,16)' }}\nwall = {{ position = '1 rad', stiffness = '0.1 N.m/rad' }}\n\
         hand = {{ kind = 'none' }}\n"
    );
    let none = &mut |_: &str| Err(std::io::Error::other("no file"));
    Scene::parse("scene.toml", &text, &[], none).map_err(|error| error.to_string())
}

#[test]
fn every_file_is_a_part_with_a_source() {
    let mut files: Vec<&str> = hpu_assets::FILES.iter().map(|(path, _)| *path).collect();
    files.retain(|path| path.starts_with("testbench/parts/"));
    let mut listed: Vec<String> =
        parts().map(|part| format!("testbench/parts/{}s/{}.toml", part.kind, part.name)).collect();
    listed.sort();
    files.sort_unstable();
    assert_eq!(listed, files);
    assert!(parts().filter(|part| part.kind == "motor").count() >= 10);
    for part in parts() {
        let all = [part.about(), part.source(), part.date()];
        assert!(all.iter().all(|text| !text.is_empty()) && !part.figures().is_empty(), "{}", part.name);
    }
}

/// Mechanical time constants in ms, which the sheets give beside what a motor's part has: `J R / K²`.
const SHEETS: [(&str, f64); 7] = [
    ("maxon-re25-118743", 4.25),
    ("maxon-re40-48v", 4.28),
    ("maxon-amax19-249996", 24.2),
    ("faulhaber-2342-024cr", 6.0),
    ("faulhaber-2342-036cr", 6.0),
    ("faulhaber-2342-048cr", 6.0),
    ("faulhaber-2642-048cr", 5.4),
];

#[test]
fn motors_are_as_fast_as_their_sheets_say() {
    for part in parts().filter(|part| part.kind == "motor") {
        let Device::Motor(motor) = with_motor(part.name).unwrap().device else { panic!("a motor") };
        let constant = motor.torque_constant_nm_per_a;
        let ms = 1e3 * motor.rotor_inertia_kg_m2 * motor.resistance_ohm / (constant * constant);
        if let Some((name, said)) = SHEETS.iter().find(|(name, _)| *name == part.name) {
            assert!((ms / said - 1.0).abs() < 0.05, "{name}: {ms} ms");
        }
        assert!((1.0..30.0).contains(&ms), "{}: {ms} ms", part.name);
    }
    let said = with_motor("maxn-re25-118743").unwrap_err();
    assert!(said.starts_with("scene.toml:2:36: device.motor: `maxn-re25-118743` is none of"), "{said}");
    assert!(said.contains("did you mean maxon-re25-118743?"), "{said}");
}
