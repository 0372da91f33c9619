//! Sensors of a network whose logic is a design: words against integers of closed forms, and of mpmath.

use hpu_cosim::dut::{Wires, plant};
use hpu_cosim::scene::{DutScene, Experiment};
use hpu_cosim::{AxisWorld, DrivenWorld, Logic, Schedule};

/// A wheel of 1 kg·m² under 8 N·m from rest: at clock n of 2^20 Hz it is at n^2 / 2^38 rad. Its drive is weak.
const WHEEL: &str = r#"about = "A wheel."
clock = { frequency = "1048576 Hz" }
run = { duration = "500 ms", seed = 5 }
device.kind = "network"
device.bodies.wheel = { inertia = "1 kg.m2" }
device.drive.kind = "current"
device.drive.on = "wheel"
device.drive.torque_constant = "1 mN.m/A"
device.drive.bandwidth = "100 Hz"
device.drive.dac = { full_scale = "10 A" }
device.sensors.angle.kind = "absolute"
device.sensors.angle.on = "wheel"
device.sensors.angle.bits = 12
device.sensors.angle.span = "0.25 rad"
device.sensors.angle.rate = "10 kHz"
device.sensors.angle.phase = "100 us"
device.sensors.angle.latency = "50 us"
device.sensors.angle.bus = "1 MHz"
device.sensors.angle.noise = 0.7
device.sensors.angle.inl = [0, 1.5, -2, 0.25]
device.sensors.amps.kind = "current"
device.sensors.amps.bits = 12
device.sensors.amps.gain = "0.2 V/A"
device.sensors.amps.range = "3.3 V"
device.sensors.amps.rate = "10 kHz"
device.sensors.amps.offset = "30 mA"
device.sensors.amps.noise = 0.4
device.sensors.amps.calibrated_zero = 64
device.sensors.fine = { kind = "encoder", on = "wheel", lines = 4000 }
encoder = { on = "wheel", lines = 500 }
hand = { kind = "constant_torque", torque = "8 N.m" }
dut.files = ["d.vhd"]
dut.top = "d"
dut.clock = "clk"
dut.ports.command = { is = "drive.current", format = "(1,0,11)" }
dut.ports.angle = "sensor.angle.word"
dut.ports.angle_new = "sensor.angle.valid"
dut.ports.amps = "sensor.amps.word"
dut.ports.amps_old = "not sensor.amps.valid"
dut.ports.a = "sensor.fine.a"
dut.ports.b = "sensor.fine.b"
"#;

/// A modulator of the current, with a bit every four clocks.
const STREAM: &str = r#"dut.ports.stream = "sensor.stream.bit"
device.sensors.stream = { kind = "sigma_delta", gain = "0.2 V/A", range = "3.3 V", rate = "262144 Hz" }
"#;

fn parse(text: &str) -> Result<DutScene, String> {
    let load = &mut |_: &str| Ok(Vec::new());
    match Experiment::parse("scene.toml", text, &[], load) {
        Ok(Experiment::Dut(scene)) => Ok(scene),
        Ok(_) => Err("not a design".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// Runs the plant under a constant command, and returns the words of its inputs at every clock.
fn run(scene: &DutScene, command: i64, edges: u64, leaps: bool) -> Vec<[i64; 7]> {
    let (plant, wires) = (plant(scene).unwrap(), Wires::of_scene(scene).unwrap());
    let world = AxisWorld::new(&plant, 0, Schedule::default());
    let mut world = DrivenWorld::new(Box::new(world), Logic::Design(&wires), edges);
    world.begin(&[command]).unwrap();
    let mut all = Vec::new();
    loop {
        let steps = if leaps { world.quiet() + 1 } else { 1 };
        let words: [i64; 7] = world.inputs()[..7].try_into().unwrap();
        all.extend((0..steps).map(|_| words));
        if world.advance(steps).is_err() {
            return all;
        }
    }
}

/// SplitMix64, as published, and the sum of four of its numbers about 0, each one of `count`.
struct Noise(u64);

impl Noise {
    fn four(&mut self, count: u64) -> i64 {
        let mut term = || {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((u128::from(z ^ z >> 31) * u128::from(count)) >> 64) as i64
        };
        (0..4).map(|_| term()).sum::<i64>() - 2 * (count as i64 - 1)
    }
}

#[test]
fn words_of_an_absolute_encoder_are_those_of_the_motion() {
    let scene = parse(WHEEL).unwrap();
    let stepped = run(&scene, 0, 60_000, false);
    assert!(stepped == run(&scene, 0, 60_000, true), "leaping and stepping differ");
    // 0.7 counts of deviation are four numbers of 0.7 sqrt(3) 2^16.
    let (mut noise, mut at, mut shown) = (Noise(5 * 64 + 32), 0, 0);
    let inl = [0, 98_304, -131_072, 16_384];
    for k in 0..560u64 {
        // 100 us are 105 clocks, 50 us and twelve bits at 1 MHz are 65.
        let sample = 105 * (k + 1);
        let comes = sample + 65;
        for word in &stepped[at as usize..comes as usize] {
            assert_eq!((word[0], word[1]), (shown, i64::from(k > 0 && at == comes - 105)), "{at}");
            at += 1;
        }
        // 2^12 counts on 2^-2 rad, each of 2^16: n^2 2^-38 is n^2 2^-8, modulo 2^28.
        let place = ((sample * sample) >> 8) as i64 % (1 << 28);
        let (piece, within) = ((place >> 26) as usize, place % (1 << 26));
        let error = inl[piece] + ((i128::from(inl[(piece + 1) % 4] - inl[piece]) * i128::from(within)) >> 26) as i64;
        shown = (place + error + noise.four(79_458)).div_euclid(65_536).rem_euclid(4096);
    }
}

/// `i = 5 A (1 - exp(-2 pi 100 t))` by mpmath, times 2^16 counts, at every fourth sample.
#[test]
fn words_of_a_current_are_those_of_its_exponential() {
    let scene = parse(WHEEL).unwrap();
    let stepped = run(&scene, 1024, 6000, false);
    assert!(stepped == run(&scene, 1024, 6000, true), "leaping and stepping differ");
    let known = [
        0, 18_098_873, 32_170_787, 43_111_733, 51_618_343, 58_232_252, 63_374_580, 67_372_753, 70_481_341, 72_898_275,
        74_777_447, 76_238_507, 77_374_485, 78_257_710, 78_944_420,
    ];
    let mut noise = Noise(5 * 64 + 33);
    let mut word = |current: i64| (current + noise.four(45_405) + 488_064).div_euclid(65_536);
    let sum: i64 = (0..64).map(|_| word(0)).sum();
    let zero = (2 * sum + 64).div_euclid(128);
    assert!((6..=9).contains(&zero), "30 mA are 7.4 counts, {zero}");
    for k in 0..57 {
        let noisy = word(if k % 4 == 0 { known[k / 4] } else { 0 });
        let at = 105 * k;
        if k % 4 == 0 {
            assert_eq!(stepped[at][2], (noisy - zero).clamp(-2048, 2047), "sample {k}");
        }
        assert_eq!([stepped[at][3], stepped[at + 1][3]], [0, 1], "sample {k}");
    }
}

/// The charge until t is `5 A (t - (1 - exp(-w t)) / w)`, and a bit stands for 8.25 A over four clocks.
#[test]
fn bits_of_a_modulator_are_those_of_the_charge() {
    let scene = parse(&format!("{WHEEL}{STREAM}")).unwrap();
    let words = run(&scene, 1024, 24_000, true);
    let (corner, period_s) = (2.0 * std::f64::consts::PI * 100.0, 4.0 / 1_048_576.0);
    let (mut left, mut ones) = (0.0, 0);
    for (k, of) in words.chunks_exact(4).enumerate() {
        let time_s = k as f64 * period_s;
        let charge = 5.0 * (time_s + (-corner * time_s).exp_m1() / corner) / (8.25 * period_s);
        let bit = charge >= left;
        left += if bit { 1.0 } else { -1.0 };
        assert!(of.iter().all(|word| word[6] == i64::from(bit)), "bit {k}: {} left of {charge}", left);
        ones += usize::from(bit && k >= 4000);
    }
    // At the end 5 A flow: 5 / 8.25 are (2 x - 1) of the bits that are 1.
    let share = ones as f64 / 2000.0;
    assert!((2.0 * share - 1.0 - 5.0 / 8.25).abs() < 0.01, "{share}");
}

/// The wheel is at n^2 2^-38 rad, and a count is 2 pi / 16000.
#[test]
fn the_lines_of_a_further_encoder_reach_a_design() {
    let scene = parse(WHEEL).unwrap();
    let words = run(&scene, 0, 60_000, true);
    for (n, word) in words.iter().enumerate() {
        let count = (n as f64 * n as f64 * 0.5f64.powi(38) * 16_000.0 / (2.0 * std::f64::consts::PI)).floor() as i64;
        let lines = [[0, 0], [0, 1], [1, 1], [1, 0]][(count % 4) as usize];
        assert_eq!([word[4], word[5]], lines, "{n}");
    }
}

#[test]
fn wrong_sensors_are_refused_at_their_line() {
    let refused = |from: &str, to: &str, says: &str| {
        assert!(WHEEL.contains(from), "{from}");
        let said = parse(&WHEEL.replacen(from, to, 1)).expect_err(to);
        assert!(said.contains(says), "{said}\nexpected {says}");
    };
    let angle = |key: &str| format!("device.sensors.angle.{key}");
    refused(
        "angle.rate = \"10 kHz\"",
        "angle.rate = \"2 MHz\"",
        "faster than the clock; write its frequency, 1048576 Hz",
    );
    refused(
        "angle.bus = \"1 MHz\"",
        "angle.bus = \"100 kHz\"",
        "rate: faster than its bus, which brings a word of 12 bits",
    );
    refused(
        "angle.bits = 12",
        "angle.bits = 25",
        &format!("{}: `25` is not a whole number from 2 to 24", angle("bits")),
    );
    refused("[0, 1.5, -2, 0.25]", "[0, 1.5, -2]", "3 errors; accepted: 2^n of them, n from 0 to 12");
    refused("amps.noise = 0.4", "amps.inl = [0, 1, 2, 3]", "4 errors; accepted: 2^n + 1 of them, n from 0 to 12");
    refused("[0, 1.5, -2, 0.25]", "[0, \"x\"]", "inl[1]: write a number, in counts of the word");
    refused("angle.on = \"wheel\"", "angle.on = \"whell\"", "no body \"whell\"; there are wheel; did you mean wheel?");
    refused("angle.latency = \"50 us\"", "angle.latency = \"1 s\"", "accepted: 1000 periods of `rate` at most");
    refused("angle.noise = 0.7", "angle.noise = 5000", "5000 counts of the word, which has 4096");
    refused(
        "amps.gain",
        "amps.on = \"wheel\"\ndevice.sensors.amps.gain",
        "not of a sensor of kind \"current\", which takes",
    );
    refused("\"sensor.angle.word\"", "\"sensor.angel.word\"", "no pin \"angel.word\" of a sensor; there are sensor.");
    refused("\"sensor.angle.word\"", "\"not sensor.angle.word\"", "is a word, which \"not\" does not invert");
    refused("\"drive.current\"", "\"bridge.duty\"", "follows a current and has no bridge; connect drive.current");
    let with = |more: &str, says: &str| {
        let said = parse(&format!("{WHEEL}{more}")).expect_err(more);
        assert!(said.contains(says), "{said}\nexpected {says}");
    };
    with("host.late = 1\n", "host.late: samples are those of a [method]");
    with(&STREAM.replace("262144 Hz", "2 MHz"), "device.sensors.stream.rate: faster than the clock");
    with(&STREAM.replace("gain", "bits = 3, gain"), "bits: not of a sensor of kind \"sigma_delta\", which takes rate,");
}
