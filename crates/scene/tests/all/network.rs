//! Networks: what their bodies and joints come to, and what is refused at its line.

use hpu_scene::{Device, Encoder, Scene, SensorKind, Setup};

const KNOB: &str = r#"about = "A network."
clock = { frequency = "16384 kHz" }
run = { duration = "1 s" }
device.kind = "network"
device.units_at = "handle"
device.bodies.rotor = { inertia = "50 g.cm2", coulomb_friction = "3 mN.m" }
device.bodies.handle = { mass = "30 g" }
device.joints.cable.from = "rotor"
device.joints.cable.to = "handle"
device.joints.cable.ratio = 10
device.joints.cable.radius = "60 mm"
device.joints.cable.stiffness = "20 kN/m"
device.joints.cable.damping_ratio = 0.02
device.drive.kind = "current"
device.drive.on = "rotor"
device.drive.torque_constant = "23 mN.m/A"
device.drive.bandwidth = "2 kHz"
device.drive.dac = { bits = 12, full_scale = "10 A" }
encoder = { on = "rotor", lines = 2000 }
method.kind = "conventional"
method.sample_rate = "4 kHz"
method.position_bits = 16
method.stiffness_format = "(0,10,8)"
method.damping_format = "(0,12,4)"
wall = { position = "6 mm", stiffness = "30 kN/m", damping = "13.9 N.s/m" }
hand.kind = "spring_damper"
hand.on = "handle"
hand.stiffness = "1388.9 N/m"
hand.damping = "27.78 N.s/m"
hand.path = [["0 s", 0], ["200 ms", "12 mm"]]
"#;

fn parse(text: &str) -> Result<Scene, String> {
    let none = &mut |_: &str| Err(std::io::Error::other("no file"));
    Scene::parse("scene.toml", text, &[], none).map_err(|error| error.to_string())
}

#[track_caller]
fn close(got: f64, expected: f64) {
    assert!((got - expected).abs() <= 1e-12 * expected.abs(), "{got:?}, expected {expected:?}");
}

/// The encoder's body has rho = 6 mm/rad: K rho^2, and 30 g as 30 g rho^2.
#[test]
fn a_wall_at_the_handle_is_one_at_the_encoder() {
    let scene = parse(KNOB).unwrap();
    close(scene.wall.position_rad, 1.0);
    close(scene.wall.stiffness_nm_per_rad, 30e3 * 36e-6);
    close(scene.wall.damping_nm_s_per_rad, 13.9 * 36e-6);
    let Device::Motor(motor) = scene.device else { panic!("a shaft") };
    close(motor.inertia_kg_m2(), 5e-6 + 0.03 * 36e-6);
    close(scene.hand.grip().0, 1388.9 * 36e-6);
    close(scene.hand.path()[1].1, 2.0);
    let compound = scene.network.as_ref().unwrap();
    close(compound.path[1].angle_rad, 0.012);
    close(compound.network.joints[0].compliance.unwrap().0, 20e3);
    // Two sqrt(k m) times the ratio, m being that of both on the cable alone.
    let together = 1.0 / (36e-6 / 5e-6 + 1.0 / 0.03);
    close(compound.network.joints[0].compliance.unwrap().1, 0.04 * (20e3f64 * together).sqrt());
    // A full command is 10 A, so a count of 12 bits is 10 A / 4096 of 23 mN.m/A.
    let words = scene.words().unwrap();
    close(words.realised.torque_quantum_nm, 0.23 * 0.5f64.powi(scene.method.pwm.bits as i32));
}

#[test]
fn a_converter_keeps_the_upper_bits() {
    let dac = parse(KNOB).unwrap().network.unwrap().dac.unwrap();
    // 12 bits with the sign, of commands up to 2^13: steps of 4 counts, to the nearest.
    for (command, steps) in [(0, 0), (1, 0), (2, 1), (5, 1), (6, 2), (-1, 0), (-3, -1), (8191, 2047), (-8192, -2048)] {
        close(dac.current_a(command, 13) + 1.0, f64::from(steps) * 10.0 / 2048.0 + 1.0);
    }
    let floors = hpu_scene::Dac { floors: true, ..dac };
    close(floors.current_a(-1, 13), -10.0 / 2048.0);
    close(hpu_scene::Dac { bits: None, ..dac }.current_a(3, 13), 30.0 / 8192.0);
}

/// A voice coil on a slider: its constant is a force for one ampere, and on a bridge it pushes as its winding lets it.
#[test]
fn a_drive_that_pushes_has_a_force_constant() {
    let slider = KNOB
        .replace("device.bodies.rotor = { inertia = \"50 g.cm2\", coulomb_friction = \"3 mN.m\" }\n", "")
        .replace("joints.cable", "drive")
        .lines()
        .filter(|line| !["device.drive", "device.joints", "encoder"].iter().any(|it| line.starts_with(it)))
        .collect::<Vec<_>>()
        .join("\n");
    let drive = |constant: &str| {
        format!(
            "{slider}\nencoder = {{ on = \"handle\", resolution = \"1 um\" }}\ndevice.drive = {{ kind = \"bridge\", \
             on = \"handle\", torque_constant = \"{constant}\", resistance = \"3 Ohm\", inductance = \"1 mH\" }}\n"
        )
    };
    let scene = parse(&drive("5 N/A")).unwrap();
    let full = scene.words().unwrap().realised.torque_quantum_nm * 2f64.powi(scene.method.pwm.bits as i32);
    close(full, 5.0 * scene.bridge.supply_v / (3.0 + 2.0 * scene.bridge.on_resistance_ohm));
    let said = parse(&drive("5 N.m/A")).unwrap_err();
    assert!(said.contains("device.drive.torque_constant"), "{said}");
    assert_eq!(parse(&(drive("5 N/A") + "host.latency = '1 ms'\n")).unwrap().host_clocks, 16384);
}

#[test]
fn a_host_is_late_by_samples_and_by_a_time() {
    let scene = parse(&format!("{KNOB}host = {{ late = 2, latency = \"1 ms\" }}\n")).unwrap();
    assert_eq!(scene.host_clocks, 2 * 4096 + 16384);
    let said = parse(&format!("{KNOB}host.late = 65\n")).unwrap_err();
    assert!(said.contains("host.late") && said.contains("64"), "{said}");
}

#[test]
fn networks_are_refused_at_their_line() {
    let refused = |from: &str, to: &str, says: &str| {
        assert!(KNOB.contains(from), "{from}");
        let said = parse(&KNOB.replacen(from, to, 1)).expect_err(to);
        assert!(said.contains(says), "{said}\nexpected {says}");
    };
    refused(
        "to = \"handle\"",
        "to = \"handel\"",
        "9:26: device.joints.cable.to: no body \"handel\"; there are rotor, handle; did you mean handle?",
    );
    refused(
        "device.joints.cable",
        "device.bodies.lever = { mass = \"1 g\" }\ndevice.joints.cable",
        "device.bodies.lever: nothing joins it",
    );
    refused(
        "\"20 kN/m\"",
        "\"20 N.m/rad\"",
        "device.joints.cable.stiffness: N/m, because handle has a mass; got N.m/rad",
    );
    refused("device.joints.cable.radius = \"60 mm\"\n", "", "device.joints.cable.radius: missing; write a length");
    refused(
        "coulomb_friction = \"3 mN.m\"",
        "coulomb_friction = \"3 mN.m\", stiction = \"1 mN.m\"",
        "6:87: \
        device.bodies.rotor.stiction: stiction 0.001 N.m is less than coulomb_friction, 0.003 N.m",
    );
    refused("\"20 kN/m\"", "\"900 GN/m\"", "device.joints.cable.stiffness");
    refused(
        "mass = \"30 g\"",
        "mass = \"30 g\", stops = { low = \"1 mm\", high = \"2 mm\", stiffness = \"1 kN/m\" }",
        "device.bodies.handle.stops.low: the device starts at 0 m, inside this stop",
    );
    refused("kind = \"current\"", "kind = \"bridge\"", "only of a drive of kind \"current\" or \"pi\"");
    refused("device.drive.dac = { bits = 12, full_scale = \"10 A\" }\n", "", "device.drive.dac: missing");
    refused("lines = 2000", "resolution = \"1 um\"", "encoder.resolution: rotor turns: write lines");
    refused("run =", "model = { datapath = \"law\" }\nrun =", "model.datapath: not of a network; write \"words\"");
    refused("run =", "model = { solver = \"sample\" }\nrun =", "model.solver: a network is flowed exactly");
    let fast = KNOB.replace("50 g.cm2", "1e-5 g.cm2").replace("20 kN/m", "1 GN/m");
    let said = parse(&fast).unwrap_err();
    assert!(said.contains("device.joints.cable.stiffness: its mode is at 30."), "{said}");
    assert!(said.contains("MHz, beyond the clock: make it rigid"), "{said}");
    let cycle = "device.joints.a = { from = \"rotor\", to = \"handle\", radius = \"6 mm\" }\n\
                 device.joints.b = { from = \"rotor\", to = \"handle\", radius = \"6 mm\" }\nencoder =";
    let said = parse(&KNOB.replacen("encoder =", cycle, 1)).unwrap_err();
    assert!(said.contains("device.joints.b: closes a cycle of rigid joints"), "{said}");
    let many: String = (0..5)
        .map(|k| {
            format!(
                "device.bodies.b{k} = {{ inertia = 1e-5 }}\n\
                 device.joints.j{k} = {{ from = \"rotor\", to = \"b{k}\", stiffness = 1 }}\n"
            )
        })
        .collect();
    let said = parse(&KNOB.replacen("encoder =", &format!("{many}encoder ="), 1)).unwrap_err();
    assert!(said.contains("16 states (2 of drive and hand, 7 bodies 14); accepted: 12. Make a joint rigid"), "{said}");
}

#[test]
fn a_scene_is_read_and_told_in_the_units_of_one_body() {
    let scene =
        parse(&format!("{KNOB}expect.peak_penetration = {{ value = '0.2 mm', tolerance = '10 um' }}\n")).unwrap();
    assert_eq!((scene.units().position, scene.units().stiffness), ("m", "N/m"));
    // 6 mm a radian, 8000 counts a revolution.
    let told = scene.words().unwrap().realised.in_units(scene.scale());
    assert!((told.count_rad - 6e-3 * std::f64::consts::TAU / 8000.0).abs() < 1e-18, "{}", told.count_rad);
    assert!((told.stiffness_nm_per_rad / 30e3 - 1.0).abs() < 1e-3, "{}", told.stiffness_nm_per_rad);
    let written = scene.written_wall();
    assert!((written.position_rad - 6e-3).abs() < 1e-17 && (written.damping_nm_s_per_rad - 13.9).abs() < 1e-12);
    assert_eq!(scene.expect.numbers[0].value, 2e-4);
    let said = parse(&format!("{KNOB}expect.peak_penetration = {{ value = '3 deg', tolerance = '1 deg' }}\n"));
    assert!(said.unwrap_err().contains("`3 deg` is not a length"), "an angle of a body that slides");
}

#[test]
fn a_body_may_be_the_rotor_of_a_part() {
    let drive = "device.drive.torque_constant = \"23 mN.m/A\"\n";
    let text = KNOB.replace("rotor = { inertia = \"50 g.cm2\",", "rotor = { part = \"maxon-re25-118743\",");
    let text = text.replace(drive, "").replace("lines = 2000", "part = \"faulhaber-hedl-5540\"");
    let scene = parse(&text).unwrap();
    let network = &scene.network.as_ref().unwrap().network;
    let feed = network.feed;
    assert_eq!((network.bodies[0].inertia, network.bodies[0].coulomb), (10.3e-7, 3e-3));
    assert_eq!((feed.torque_constant, feed.resistance_ohm, feed.inductance_h), (23.4e-3, 2.18, 0.238e-3));
    assert!((scene.encoder.count_rad() - std::f64::consts::TAU / 2000.0).abs() < 1e-15);
    // A key beside the part replaces one of its data.
    let own = parse(&format!("{text}{}", drive)).unwrap();
    assert_eq!(own.network.as_ref().unwrap().network.feed.torque_constant, 23e-3);
    for (from, to, said) in [
        ("maxon-re25-118743", "ti-drv8874", "device.bodies.rotor.part: `ti-drv8874` is none of"),
        (
            "handle = { mass",
            "handle = { part = \"maxon-re25-118743\", mass",
            "device.bodies.handle.part: a motor's rotor",
        ),
        (
            "drive.kind = \"current\"",
            "drive.part = \"ti-drv8874\"\ndevice.drive.kind = \"current\"",
            "device.drive.part: `ti",
        ),
    ] {
        let error = parse(&text.replace(from, to)).unwrap_err();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn a_model_leaves_out_what_a_scene_without_it_has_not() {
    let cable = "device.joints.cable.stiffness = \"20 kN/m\"\ndevice.joints.cable.damping_ratio = 0.02\n";
    let pairs = [
        ("model.joints = 'rigid'", KNOB.replace(cable, "")),
        ("model.drive = 'ideal'", KNOB.replace("device.drive.bandwidth = \"2 kHz\"\n", "")),
        ("model.converter = 'exact'", KNOB.replace("bits = 12, ", "")),
    ];
    for (key, without) in pairs {
        let (model, plain) = (parse(&format!("{KNOB}{key}\n")).unwrap(), parse(&without).unwrap());
        assert_eq!(model.network.as_ref().unwrap(), plain.network.as_ref().unwrap(), "{key}");
        assert_ne!(model.network, parse(KNOB).unwrap().network, "{key}");
    }
    let late = format!("{KNOB}host.late = 2\n");
    assert_eq!(parse(&late).unwrap().host_clocks, 2 * 4096);
    assert_eq!(parse(&format!("{late}model.host = 'on_time'\n")).unwrap().host_clocks, 0);
}

#[test]
fn a_start_inside_a_stop_is_refused_where_a_rigid_joint_makes_it() {
    let rigid = KNOB.replace("device.joints.cable.stiffness = \"20 kN/m\"\n", "");
    let rigid = rigid.replace("device.joints.cable.damping_ratio = 0.02\n", "");
    let stops = "mass = \"30 g\", stops = { low = \"-5 mm\", high = \"8 mm\", stiffness = \"1 kN/m\" }";
    let start = |angle: &str| format!("coulomb_friction = \"3 mN.m\", initial_position = \"{angle}\"");
    let with = |angle| rigid.replace("mass = \"30 g\"", stops).replace("coulomb_friction = \"3 mN.m\"", &start(angle));
    // 6 mm a radian.
    assert!(parse(&with("1.3 rad")).is_ok());
    let said = parse(&with("1.4 rad")).unwrap_err();
    assert!(
        said.starts_with("scene.toml:7:") && said.contains("device.bodies.handle: starts inside its stop"),
        "{said}"
    );
}

#[test]
fn a_wall_that_no_counter_holds_is_told_in_its_own_units() {
    let said = parse(&KNOB.replace("\"6 mm\"", "\"3 m\"")).unwrap_err();
    assert!(said.contains("wall.position: 3 m does not fit 16 bits"), "{said}");
}

#[test]
fn a_mass_and_a_motor_may_have_a_late_host() {
    let scene = |device: &str, more: &str| {
        let text = format!(
            "about = 'A wall.'\nclock.frequency = '1 MHz'\nrun.duration = '1 s'\n{device}\nmethod.kind = 'hybrid'\n\
             method.sample_rate = '1 kHz'\nwall.stiffness = 0\nhand.kind = 'none'\n{more}\n"
        );
        parse(&text)
    };
    let mass = "device = { kind = 'mass', mass = '1 kg', damping = 0 }\nencoder.resolution = '1 um'\n\
                amplifier.full_scale = '10 N'\nwall.position = '1 mm'";
    let motor = "device = { kind = 'motor', motor = 'vasudevan_2007' }\nwall.position = '1 rad'";
    assert_eq!(scene(mass, "host = { late = 2, latency = '5 us' }").unwrap().host_clocks, 2005);
    assert_eq!(scene(motor, "host.late = 1\nmodel.bridge = 'averaged'").unwrap().host_clocks, 1000);
    assert_eq!(scene(motor, "host.late = 3").unwrap().host_clocks, 3000);
    assert_eq!(scene(mass, "host.late = 1\nmodel.solver = 'sample'").unwrap().host_clocks, 1000);
    for (device, more, said) in [
        (mass, "host.late = 1\nmodel.datapath = 'linear'", "host: the linear law has model.delay"),
        (mass, "host.lat = 1", "host.lat: unknown key"),
    ] {
        let error = scene(device, more).unwrap_err();
        assert!(error.contains(said), "{error}");
    }
}

/// The encoder on the handle as a sensor that the method counts, and as the scene's own encoder: the same loop.
#[test]
fn a_method_counts_another_encoder() {
    let far = "device.sensors.far = { kind = \"encoder\", on = \"handle\", resolution = \"10 um\" }\n";
    let chosen = parse(&format!("{KNOB}{far}method.position = \"far\"\n")).unwrap();
    let own = KNOB.replace("{ on = \"rotor\", lines = 2000 }", "{ on = \"handle\", resolution = \"10 um\" }");
    let own = parse(&own).unwrap();
    assert_eq!((chosen.encoder, &chosen.device, chosen.wall), (own.encoder, &own.device, own.wall));
    assert_eq!((&chosen.hand, chosen.words().unwrap()), (&own.hand, own.words().unwrap()));
    // What was the encoder is a sensor on the rotor.
    let network = chosen.network.unwrap();
    assert_eq!((network.sensors[0].name.as_str(), network.network.sensed[0].body), ("encoder", 0));
    assert_eq!(network.sensors[0].kind, SensorKind::Encoder(0, Encoder::Rotary { lines: 2000 }));
    let refused = |text: &str, says: &str| {
        let said = parse(&format!("{KNOB}{text}")).expect_err(text);
        assert!(said.contains(says), "{said}\nexpected {says}");
    };
    refused("method.position = \"fat\"\n", "method.position: no sensor \"fat\"; there are encoder");
    refused(&format!("{far}method.position = \"fat\"\n"), "there are far, encoder; did you mean far?");
    refused(
        &far.replace("\"handle\"", "\"handel\""),
        "device.sensors.far.on: no body \"handel\"; there are rotor, handle",
    );
    refused(&far.replace("resolution = \"10 um\"", "lines = 100"), "device.sensors.far.lines: handle slides");
    let amps = "device.sensors.a = { kind = \"current\", bits = 8, gain = 1, range = 1, rate = 1000 }\n";
    refused(&format!("{amps}method.position = \"a\"\n"), "method.position: a reads no position; write an encoder");
    refused(&far.replace("far", "encoder"), "device.sensors.encoder: the name of the scene's own encoder");
}

/// An absolute sensor as the position: its counts are those of an encoder with as many, and the encoder is a sensor.
#[test]
fn a_method_reads_the_words_of_an_absolute_sensor() {
    let read = |sensor: &str| {
        let sensor = format!("device.sensors.word = {{ kind = \"absolute\", rate = \"20 kHz\", {sensor} }}\n");
        parse(&format!("{KNOB}{sensor}method.position = \"word\"\n"))
    };
    let turning = read("on = \"rotor\", bits = 13").unwrap();
    let own = parse(&KNOB.replace("lines = 2000", "lines = 2048")).unwrap();
    assert_eq!((turning.encoder, &turning.device, turning.wall), (own.encoder, &own.device, own.wall));
    assert_eq!(turning.words().unwrap(), own.words().unwrap());
    let network = turning.network.unwrap();
    assert_eq!((network.followed, network.position(), network.network.seen), (Some(0), Some("word"), 0));
    assert_eq!(network.sensors[1].kind, SensorKind::Encoder(1, Encoder::Rotary { lines: 2000 }));
    assert!(network.left_out().contains(&"rate, latency, lag and errors of the sensor word".to_string()));
    let sliding = read("on = \"handle\", bits = 12, span = \"40.96 mm\"").unwrap();
    let Encoder::Linear { resolution_m } = sliding.encoder else { panic!("the handle slides") };
    assert!((resolution_m / 10e-6 - 1.0).abs() < 1e-15, "{resolution_m:e}");
    for (sensor, more, said) in [
        ("on = \"rotor\", bits = 2", "", "method.position: word has no words of 3 to 26 bits of a turn"),
        ("on = \"rotor\", bits = 13, span = \"1 rad\"", "", "leave its span out"),
        ("on = \"rotor\", bits = 13", "faults = { swapped = true }\n", "faults:"),
    ] {
        let sensor = format!("device.sensors.word = {{ kind = \"absolute\", rate = \"20 kHz\", {sensor} }}\n");
        let error = parse(&format!("{KNOB}{sensor}method.position = \"word\"\n{more}")).unwrap_err();
        assert!(error.contains(said), "{error}");
    }
}
