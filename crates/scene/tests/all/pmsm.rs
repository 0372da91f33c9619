//! Scenes of a motor with three phases: what they come to in SI units, and what is refused at which key.

use hpu_signal::Format;

use hpu_scene::{Bus, Connection, Driving, DutScene, Experiment, Hand, Phase, Reading, SensorKind, SensorPin};

const WHEEL: &str = r#"about = "A wheel behind field-oriented control."
clock.frequency = "50 MHz"
run.duration = "100 ms"
wall.position = "0.3 rad"
[device]
kind = "pmsm"
pole_pairs = 7
resistance = "0.5 Ohm"
inductance = "0.3 mH"
torque_constant = "52.5 mN.m/A"
rotor_inertia = "300 g.cm2"
coulomb_friction = "2 mN.m"
cogging = [[42, "1 mN.m", "90 deg"], [84, "0.2 mN.m", 0]]
supply_resistance = "10 mOhm"
[device.sensors]
ia = { kind = "current", winding = "a", trigger = true, latency = "1 us", bits = 12, gain = "100 mV/A", range = 3.3 }
ic = { kind = "current", winding = "c", shunt = "low_side", rate = "20 kHz", bits = 12, gain = 1, range = "3.3 V" }
bit = { kind = "sigma_delta", winding = "b", rate = "20 MHz", gain = 1, range = "0.64 V" }
angle = { kind = "absolute", rate = "100 kHz", bits = 14 }
[bridge]
supply = "12 V"
[encoder]
lines = 4096
[dut]
files = ["foc.v"]
top = "foc"
clock = "clk"
[dut.ports]
start = "sensor.start"
done = "sensor.ia.valid"
ia = "sensor.ia.word"
ah = "bridge.a_high"
al = "bridge.a_low"
bh = "bridge.b_high"
bl = "bridge.b_low"
ch = "bridge.c_high"
cl = "bridge.c_low"
[hand]
kind = "constant_torque"
torque = "20 mN.m"
"#;

fn parse(text: &str) -> Result<DutScene, String> {
    let mut load = |_: &str| Ok(b"module foc;".to_vec());
    let read = Experiment::parse("w.toml", text, &[], &mut load).map_err(|error| error.to_string())?;
    let Experiment::Dut(scene) = read else { panic!("a scene with a design") };
    Ok(scene)
}

/// The wheel with one text changed to another.
fn changed(from: &str, to: &str) -> Result<DutScene, String> {
    assert!(WHEEL.contains(from), "{from}");
    parse(&WHEEL.replacen(from, to, 1))
}

fn refused(from: &str, to: &str, said: &str) {
    let error = changed(from, to).unwrap_err();
    assert!(error.contains(said), "{to}: {error}");
}

#[test]
fn a_motor_of_three_phases_is_read_in_si_units() {
    let scene = parse(WHEEL).unwrap();
    let motor = scene.pmsm.as_deref().unwrap();
    assert_eq!((motor.pole_pairs, motor.resistance_ohm, motor.inductance_h), (7, 0.5, [0.3e-3; 2]));
    // A torque constant is 3/2 of pole pairs times flux: 52.5e-3 / 10.5 is 5 mWb.
    assert!((motor.flux_wb - 5e-3).abs() < 1e-18, "{}", motor.flux_wb);
    assert!((motor.inertia_kg_m2 - 3e-5).abs() < 1e-19);
    assert_eq!((motor.coulomb_nm, motor.stiction_nm, motor.supply_ohm), (2e-3, 2e-3, 10e-3));
    assert_eq!(motor.cogging[0], [42.0, 1e-3, std::f64::consts::FRAC_PI_2]);
    assert_eq!(motor.cogging[1], [84.0, 0.2e-3, 0.0]);
    assert_eq!(scene.driving(), Ok(Driving::SixGates));
    let apart = WHEEL.replace("inductance = \"0.3 mH\"", "inductance_d = \"0.2 mH\"\ninductance_q = \"0.4 mH\"");
    assert_eq!(parse(&apart).unwrap().pmsm.unwrap().inductance_h, [0.2e-3, 0.4e-3]);
    let flux = WHEEL.replace("torque_constant = \"52.5 mN.m/A\"", "flux_linkage = \"5 mWb\"");
    assert_eq!(parse(&flux).unwrap().pmsm.unwrap().flux_wb, 5e-3);
}

#[test]
fn sensors_read_phases_and_designs_start_them() {
    let scene = parse(WHEEL).unwrap();
    let kinds: Vec<_> = scene.sensors().iter().map(|sensor| &sensor.kind).collect();
    let [SensorKind::Sampled(ia), SensorKind::Sampled(ic), SensorKind::Modulator(bit), SensorKind::Sampled(angle)] =
        kinds[..]
    else {
        panic!("{kinds:?}")
    };
    assert_eq!(ia.reading, Reading::Phase(Phase { leg: 0, is_low_side: false }));
    // A microsecond of 20 ns; a word of 12 bits for 33 A, in 2^-16 counts.
    assert_eq!((ia.triggered, ia.latency), (true, 50));
    assert!((ia.scale - 4096.0 * 65536.0 / 33.0).abs() < 1e-6);
    assert_eq!(ic.reading, Reading::Phase(Phase { leg: 2, is_low_side: true }));
    assert_eq!((ic.triggered, ic.period), (false, 2500));
    // Bits alone of ones stand for 0.32 A: in 50 ns 16 nA.s.
    assert_eq!((bit.winding, bit.period), (Some(1), 3));
    assert!((bit.charge_as - 0.32 * 60e-9).abs() < 1e-20, "{}", bit.charge_as);
    assert_eq!(angle.reading, Reading::Position(0));
    let start = scene.dut.ports.iter().find(|port| port.port == "start").unwrap();
    let Connection::Sensor(pin) = start.connection else { panic!("{start:?}") };
    assert_eq!((pin.sensor, pin.pin), (SensorPin::ALL, SensorPin::START));
    assert!(start.connection.drives());
    // In offset binary no current is the middle of 12 bits; half of 3.3 V is the end of either side.
    let aside = changed("shunt = \"low_side\", rate", "shunt = \"low_side\", offset_binary = true, rate").unwrap();
    let SensorKind::Sampled(ic) = &aside.sensors()[1].kind else { panic!("a word") };
    let word = |volts: f64| ic.word((volts * ic.scale).floor() as i64, 0, |_| 0);
    assert_eq!([-2.0, -1.65, 0.0, 0.825, 2.0].map(word), [0, 0, 2048, 3072, 4095]);
    assert_eq!(aside.sensors()[1].pins()[0].1, Format::unsigned(12));
    let inverted = changed("bits = 12, gain = 1,", "bits = 12, gain = -1,").unwrap();
    let SensorKind::Sampled(ic) = &inverted.sensors()[1].kind else { panic!("a word") };
    assert_eq!(ic.word((1.0 * ic.scale).floor() as i64, 0, |_| 0), -1242, "1 V is 1241.2 words");
    let own = changed("start = \"sensor.start\"", "start = \"sensor.ia.start\"").unwrap();
    let start = own.dut.ports.iter().find(|port| port.port == "start").unwrap();
    assert!(matches!(start.connection, Connection::Sensor(pin) if pin.sensor == 0 && pin.pin == SensorPin::START));
}

#[test]
fn what_is_no_motor_of_three_phases_is_refused_at_its_key() {
    refused("pole_pairs = 7", "pole_pairs = 0", "device.pole_pairs: `0` is not a whole number from 1 to 1000");
    refused("\"0.3 mH\"", "0", "device.inductance: `0` must be above zero");
    let minus = "inductance_d = -1e-3\ninductance_q = 1e-3";
    refused("inductance = \"0.3 mH\"", minus, "device.inductance_d: `-1e-3` must be above zero");
    refused("inductance = \"0.3 mH\"\n", "", "device.inductance: missing; write inductance for both axes");
    let both = "inductance = 1e-3\ninductance_d = 1e-3\ninductance_q = 1e-3";
    refused("inductance = \"0.3 mH\"", both, "device.inductance_d: inductance is given for both axes");
    let both = "torque_constant = 0.05\nflux_linkage = 0.005";
    refused("torque_constant = \"52.5 mN.m/A\"", both, "device.torque_constant: flux_linkage is given too");
    refused("torque_constant = \"52.5 mN.m/A\"\n", "", "device.flux_linkage: missing");
    let less = "coulomb_friction = 2e-3\nstiction = 1e-3";
    refused("coulomb_friction = \"2 mN.m\"", less, "device.stiction: less than coulomb_friction, 0.002 N.m");
    refused("[[42, \"1 mN.m\", \"90 deg\"]", "[[0, 1e-3, 0]", "device.cogging[0]: the order is a whole number");
    refused(
        "[[42, \"1 mN.m\", \"90 deg\"]",
        "[[42, 1e-3]",
        "device.cogging[0]: write a list of [order, amplitude, phase]",
    );
    refused("[[42, \"1 mN.m\"", "[[42, \"1 V\"", "device.cogging[0][1]");
    let many = vec!["[6, 1e-3, 0]"; 17].join(", ");
    let list = "[[42, \"1 mN.m\", \"90 deg\"], [84, \"0.2 mN.m\", 0]]";
    refused(list, &format!("[{many}]"), "device.cogging: write a list of [order, amplitude, phase]");
    refused("[bridge]", "[amplifier]\nfull_scale = 1\n[bridge]", "amplifier: a pmsm hangs on a bridge with three legs");
    refused(
        "run.duration",
        "model = { friction = \"smoothed\", friction_speed = 1 }\nrun.duration",
        "model.friction: not of a pmsm",
    );
    let lines = WHEEL.find("[dut]").unwrap();
    let alone = format!("{}{}", &WHEEL[..lines], &WHEEL[WHEEL.find("[hand]").unwrap()..]);
    assert!(parse(&alone).unwrap_err().contains("method: missing; write a [method] of kind \"foc\", or a [dut]"));
}

#[test]
fn an_absolute_angle_errs_by_its_two_harmonics() {
    let errs = "kind = \"absolute\", harmonics = [[1.5, 0.4], [0.7, \"90 deg\"]], power_up = \"3 ms\", rate";
    let scene = changed("kind = \"absolute\", rate", errs).unwrap();
    let SensorKind::Sampled(angle) = &scene.sensors()[3].kind else { panic!("it samples") };
    assert_eq!(angle.ready, 150_000);
    let mut compared = 0;
    for word in 0..1 << 14 {
        let turn = (word as f64 + 0.5) / f64::from(1 << 14) * std::f64::consts::TAU;
        let exact = word as f64 + 0.5 + 1.5 * (turn + 0.4).sin() + 0.7 * (2.0 * turn).cos();
        // Straight lines between 256 places are within 1.5 (2 pi / 256)^2 / 8 + 0.7 (4 pi / 256)^2 / 8 of the sines.
        if (exact - exact.round()).abs() > 5e-4 {
            let is = angle.word((word << 16) + (1 << 15), 0, |_| 0);
            assert_eq!(is, (exact.floor() as i64).rem_euclid(1 << 14), "{word}");
            compared += 1;
        }
    }
    assert!(compared > 16_000, "{compared}");
    let refused = |errs: &str, said: &str| {
        let text = format!("kind = \"absolute\", {errs}, rate");
        let error = changed("kind = \"absolute\", rate", &text).unwrap_err();
        assert!(error.contains(said), "{errs}: {error}");
    };
    refused("harmonics = [[1, 0], [1, 0], [1, 0]]", "angle.harmonics: write a list of one or two");
    refused("harmonics = [[1]]", "angle.harmonics[0]: write a list of one or two");
    refused("harmonics = [[-1, 0]]", "angle.harmonics[0][0]: `-1` must not be negative");
    refused("harmonics = [[1, 0]], inl = [0]", "angle.inl: the errors are given as harmonics too");
    refused("power_up = -1", "angle.power_up: `-1` must not be negative");
}

#[test]
fn legs_and_sensors_that_cannot_be_are_refused_at_their_port() {
    refused("ah = \"bridge.a_high\"\n", "", "dut.ports: nothing is connected to bridge.a_high");
    refused("ah = \"bridge.a_high\"", "ah = \"bridge.leg_a\"", "driven in more than one way");
    refused("cl = \"bridge.c_low\"", "cl = \"bridge.a_low\"", "two drivers: `al` and `cl`");
    let ports = &WHEEL[WHEEL.find("ah =").unwrap()..WHEEL.find("[hand]").unwrap()];
    refused(ports, "p = \"bridge.pwm\"\nd = \"bridge.direction\"\n", "a pmsm has a bridge with three legs");
    let motor = "kind = \"motor\"\nmotor = \"vasudevan_2007\"\n";
    let device = &WHEEL[WHEEL.find("kind = \"pmsm\"").unwrap()..WHEEL.find("[bridge]").unwrap()];
    let read = &WHEEL[WHEEL.find("start =").unwrap()..WHEEL.find("ah =").unwrap()];
    let text = WHEEL.replacen(device, motor, 1).replacen(read, "", 1);
    assert!(parse(&text).unwrap_err().contains("the bridge has two legs, plus and minus; only that of a pmsm"));
    refused("winding = \"a\", trigger", "trigger", "device.sensors.ia.winding: missing");
    refused(
        "trigger = true, latency",
        "trigger = true, rate = 1e4, latency",
        "device.sensors.ia.rate: the design starts",
    );
    refused("start = \"sensor.start\"", "start = \"sensor.ic.start\"", "no pin \"ic.start\" of a sensor");
    refused("start = \"sensor.start\"", "start = \"sensor.start\"\nmore = \"sensor.ia.start\"", "two drivers");
    refused(
        "kind = \"absolute\", rate",
        "kind = \"absolute\", corner = 1e3, rate",
        "corner: an analog angle is one of a network",
    );
    refused(
        "kind = \"absolute\", rate",
        "kind = \"absolute\", chip = \"as5047p\", span = 1, rate",
        "chip: its word is a turn in 14 bits",
    );
    refused("gain = \"100 mV/A\"", "gain = 0", "gain: 0, so that no word shows a current");
    refused(
        "device.sensors",
        "device.sensors.h]\nkind = \"hall\"\nlines = 3\n[device.sensors",
        "h.lines: not of a sensor of kind",
    );
    let network = WHEEL.replacen("kind = \"pmsm\"", "kind = \"network\"", 1);
    assert!(parse(&network).is_err());
}

/// A knob on a compliant joint, a wheel on a rigid one, stops of both, the hand on the knob, the wall in its units.
const AROUND: &str = "units_at = 'knob'
[device.bodies]
rotor = { stops = { low = '-2 rad', high = '2 rad', stiffness = '5 N.m/rad', damping = '1 mN.m.s/rad' } }
knob = { inertia = '40 g.cm2', viscous_friction = '10 uN.m.s/rad', return_spring = '10 mN.m/rad' }
wheel = { inertia = '5 g.cm2', coulomb_friction = '1 mN.m' }
[device.joints]
shaft = { from = 'rotor', to = 'knob', ratio = 2, stiffness = '3 N.m/rad', damping = '0.2 mN.m.s/rad' }
belt = { from = 'rotor', to = 'wheel', ratio = 0.5 }
[device.sensors]
top = { kind = 'encoder', on = 'knob', lines = 500 }
";

fn knob(from: &str, to: &str) -> Result<DutScene, String> {
    assert!(AROUND.contains(from), "{from}");
    let around = AROUND.replacen(from, to, 1);
    let text = WHEEL.replacen("[device.sensors]\n", &around, 1).replacen("[hand]\n", "[hand]\non = \"knob\"\n", 1);
    parse(&text)
}

#[test]
fn bodies_joints_and_stops_stand_around_a_rotor_as_in_a_network() {
    let scene = knob("units_at", "units_at").unwrap();
    let motor = scene.pmsm.as_deref().unwrap();
    let network = &motor.around.network;
    assert_eq!(motor.around.names, ["rotor", "knob", "wheel"]);
    let close = |got: f64, expected: f64| assert!((got / expected - 1.0).abs() < 1e-12, "{got} {expected}");
    // The wheel turns twice as fast as the rotor: its inertia counts four times.
    let reduced = network.reduced().unwrap();
    assert_eq!(reduced.size(), 6);
    close(network.seen_rigidly()[0], 300e-7 + 0.25 * 40e-7 + 4.0 * 5e-7);
    close(motor.inertia_kg_m2, 300e-7);
    assert_eq!((network.driven, network.seen, network.grip), (0, 0, 1));
    assert_eq!((motor.around.grip_ratio, motor.around.wall_ratio), (0.5, 0.5));
    // The wall stands at 0.3 rad of the knob.
    close(scene.wall_rad.unwrap(), 0.6);
    let body: Vec<usize> = network.sensed.iter().map(|sensed| sensed.body).collect();
    // The sensors of the wheel stand on the rotor, which needs no name.
    assert_eq!((body, network.stops[0].body), (vec![1, 0], 0));
    assert_eq!(network.joints[0].compliance, Some((3.0, 0.2e-3)));
    let held = knob("units_at", "units_at").unwrap().hand;
    assert_eq!(held, Hand::ConstantTorque { torque_nm: 0.5 * 20e-3 });
}

#[test]
fn what_cannot_stand_around_a_rotor_is_refused_at_its_key() {
    let refused = |from: &str, to: &str, said: &str| {
        let error = knob(from, to).unwrap_err();
        assert!(error.contains(said), "{to}: {error}");
    };
    refused("rotor = { stops", "rotor = { inertia = 1e-6, stops", "device.bodies.rotor.inertia: not of the rotor");
    refused("low = '-2 rad'", "low = '1 rad'", "low: the device starts at 0 rad, inside this stop");
    refused("low = '-2 rad'", "low = '3 rad'", "high: not above low, 3");
    refused("from = 'rotor', to = 'knob'", "from = 'rotor', to = 'kmob'", "no body \"kmob\"; there are rotor, knob");
    refused("wheel = { inertia", "wheel = { part = 'vasudevan_2007', inertia", "wheel.part: the rotor is that of");
    refused("belt = { from = 'rotor', to = 'wheel'", "belt = { from = 'knob', to = 'rotor'", "nothing joins it");
    refused("units_at = 'knob'", "units_at = 'nob'", "device.units_at: no body \"nob\"");
    refused("stiffness = '3 N.m/rad'", "stiffness = '3 N/m'", "shaft.stiffness");
    let top = "top = { kind = 'encoder', on = 'knob', lines = 500 }";
    refused(top, "top = { kind = 'hall', on = 'knob' }", "top.on: Hall switches are of the rotor");
}

#[test]
fn a_hand_may_impose_the_motion_of_a_rotor_or_of_a_body_around_it() {
    let prescribed = |text: &str| text.replacen("kind = \"constant_torque\"\ntorque = \"20 mN.m\"", PATH, 1);
    const PATH: &str = "kind = \"prescribed\"\npath = [[0, 0.1], [0.05, 0.2]]";
    let scene = parse(&prescribed(WHEEL)).unwrap();
    assert_eq!(scene.pmsm.unwrap().start, [0.1, 0.0]);
    let started = WHEEL.replacen("rotor_inertia", "initial_angle = 0.2\nrotor_inertia", 1);
    assert!(parse(&prescribed(&started)).unwrap_err().contains("device.initial_angle: a prescribed hand imposes"));
    let around = WHEEL.replacen("[device.sensors]\n", AROUND, 1).replacen("[hand]\n", "[hand]\non = \"knob\"\n", 1);
    let scene = parse(&prescribed(&around)).unwrap();
    let network = &scene.pmsm.unwrap().around.network;
    assert_eq!((network.bodies[0].position, network.bodies[1].position), (0.0, 0.1));
}

#[test]
fn the_shunt_of_a_phase_may_have_a_lag() {
    let scene = changed("gain = \"100 mV/A\"", "corner = \"50 kHz\", gain = \"100 mV/A\"").unwrap();
    let SensorKind::Sampled(ia) = &scene.sensors()[0].kind else { panic!("it samples") };
    assert_eq!(ia.lag_rad_per_s, Some(std::f64::consts::TAU * 50e3));
    let SensorKind::Sampled(ic) = &scene.sensors()[1].kind else { panic!("it samples") };
    assert_eq!(ic.lag_rad_per_s, None);
    refused("gain = \"100 mV/A\"", "corner = \"51 MHz\", gain = 1", "ia.corner: beyond the clock");
    refused("gain = \"100 mV/A\"", "corner = 0, gain = 1", "ia.corner: `0` must be above zero");
}

#[test]
fn a_chip_on_i2c_has_two_lines_of_the_design_and_the_level_of_one() {
    let angle = "angle = { kind = \"absolute\", rate = \"100 kHz\", bits = 14 }";
    let chip = "angle = { kind = \"absolute\", chip = \"as5600\", rate = \"6667 Hz\", bits = 12 }";
    let ports = "ports]\nscl = \"sensor.angle.scl\"\nout = \"not sensor.angle.sda_out\"\nsda = \"sensor.angle.sda\"";
    let text = WHEEL.replacen(angle, chip, 1).replacen("ports]", ports, 1);
    let scene = parse(&text).unwrap();
    assert_eq!(scene.sensors()[3].lines(), ["scl", "sda_out"]);
    let SensorKind::Sampled(sampled) = &scene.sensors()[3].kind else { panic!("it samples") };
    // A period of the bus has 1 us at the least.
    assert_eq!((sampled.chip, sampled.bits), (Some((Bus::I2c, 50)), 12));
    let error = parse(&text.replacen("angle.sda_out", "angle.mosi", 1)).unwrap_err();
    assert!(error.contains("there are") && error.contains("sensor.angle.sda_out"), "{error}");
    let error = parse(&text.replacen("6667 Hz\", bits = 12", "6667 Hz\", bits = 14", 1)).unwrap_err();
    assert!(error.contains("angle.chip: its word is a turn in 12 bits"), "{error}");
}
