//! The controllers of the gimbal against models in plain integers, written from the headers of their VHDL.

use hpu_datapath::Block;
use hpu_datapath::gimbal::{
    ControlSwitch, ImpedanceConfig, ImpedanceControl, ServoConfig, ServoControl, SwitchConfig, control_switch,
    impedance_control, servo_control,
};
use hpu_signal::Format;

/// Pseudo-random numbers (Vigna's splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns any word of a format, or one near an end or near 0.
    fn word(&mut self, format: Format) -> i64 {
        let near = i128::from(self.next() % 9) - 4;
        match self.next() % 6 {
            0 => format.wrap(format.min() + near),
            1 => format.wrap(format.max() + near),
            2 => format.wrap(near),
            _ => format.from_bits(self.next()),
        }
    }
}

/// Returns `value / 2^bits` to the nearest, ties up.
fn nearest(value: i128, bits: u32) -> i128 {
    let whole = 2i128.pow(bits);
    (2 * value + whole).div_euclid(2 * whole)
}

/// Returns the word of that many bits, with a sign, that is nearest to a value.
fn saturated(value: i128, width: u32) -> i64 {
    let end = 2i128.pow(width - 1);
    value.clamp(-end, end - 1) as i64
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).expect("a constant")
}

/// The equations of `servo_control`.
struct Servo {
    config: ServoConfig,
    /// The errors of all samples since the reset.
    errors: Vec<i128>,
    drive: i64,
}

impl Servo {
    fn tick(&mut self, input: servo_control::In<i64>) -> i64 {
        if input.sample == 0 {
            return self.drive;
        }
        let ServoConfig { angle_width, step, step_frac, proportional, derivative, drive_width, .. } = self.config;
        let error = i128::from(input.desired) - nearest(i128::from(input.count) * i128::from(step), step_frac);
        self.errors.push(error);
        let before = (self.errors.len() - 1).saturating_sub(self.config.window as usize);
        let change = error - self.errors[before];
        // Over the common denominator of both gains.
        let (p, d) = (proportional.frac() as u32, derivative.frac() as u32);
        let sum = i128::from(input.proportional) * error * 2i128.pow(d)
            + i128::from(input.derivative) * change * 2i128.pow(p);
        self.drive = saturated(nearest(sum, p + d + angle_width - 1), drive_width);
        self.drive
    }
}

const NARROW_SERVO: [u32; 6] = [6, 4, 37, 3, 5, 1];

fn narrow_servo() -> ServoConfig {
    let [angle_width, count_width, step, step_frac, drive_width, window] = NARROW_SERVO;
    let (proportional, derivative) = (format(false, 3, 1), format(false, 2, 2));
    ServoConfig { angle_width, count_width, step, step_frac, proportional, derivative, drive_width, window }
}

/// Samples each of the inputs after a reset and compares the drives with those of the model.
fn samples_as_its_model(config: ServoConfig, inputs: &[servo_control::In<i64>]) {
    let mut servo = ServoControl::new(config).expect("a configuration");
    let mut model = Servo { config, errors: Vec::new(), drive: 0 };
    for input in inputs {
        assert_eq!(servo.tick(*input).drive, model.tick(*input), "{config:?}: {input:?} of {inputs:?}");
    }
}

#[test]
fn every_first_and_second_sample_of_a_narrow_servo_is_its_equation() {
    let config = narrow_servo();
    let sampled = |desired, count, proportional, derivative| servo_control::In {
        desired,
        count,
        proportional,
        derivative,
        sample: 1,
    };
    let mut servo = ServoControl::new(config).expect("a configuration");
    let mut pairs = 0;
    for [p, d] in (0..16).flat_map(|p| (0..16).map(move |d| [p, d])) {
        for desired in -32..32 {
            for count in -8..8 {
                // The state before is any error that the desired angles and a far count make.
                let first = sampled((desired * 5 + 3 * p) % 32, if d % 2 == 0 { 7 } else { -8 }, p, d);
                let second = sampled(desired, count, p, d);
                let mut model = Servo { config, errors: Vec::new(), drive: 0 };
                servo.reset();
                assert_eq!(servo.tick(first).drive, model.tick(first), "{first:?}");
                assert_eq!(servo.tick(second).drive, model.tick(second), "{first:?} {second:?}");
                pairs += 1;
            }
        }
    }
    assert_eq!(pairs, 16 * 16 * 64 * 16);
}

#[test]
fn every_history_of_a_servo_is_its_equation() {
    let wide = ServoConfig {
        angle_width: 32,
        count_width: 16,
        step: 1_999_999_999,
        step_frac: 18,
        proportional: format(false, 10, 30),
        derivative: format(false, 30, 10),
        drive_width: 31,
        window: 1,
    };
    let windowed = [4, 7, 64].map(|window| ServoConfig { window, ..narrow_servo() });
    let configs = [ServoConfig::default(), narrow_servo(), wide, ServoConfig { window: 3, ..wide }];
    for (seed, config) in configs.into_iter().chain(windowed).enumerate() {
        let random = &mut Random(seed as u64);
        let block = ServoControl::new(config).expect("a configuration");
        let formats = block.inputs().map(|signal| signal.format);
        for _ in 0..2000 {
            let inputs: Vec<_> =
                (0..20 + 5 * config.window).map(|_| formats.map(|format| random.word(format))).collect();
            samples_as_its_model(config, &inputs);
        }
    }
}

#[test]
fn a_servo_makes_no_kick_at_the_first_sample_and_one_count_is_five_parts_of_3072() {
    let mut servo = ServoControl::default();
    let far = servo_control::In { desired: 0, count: 614, proportional: 0, derivative: (1 << 24) - 1, sample: 1 };
    assert_eq!([servo.tick(far).drive, servo.tick(far).drive], [0, 0], "a derivative without a motion");
    assert_eq!(servo.tick(servo_control::In { count: 613, ..far }).drive, 1023, "a derivative of one count");
    // With 2048 drive counts a half turn, a drive is 2^-8 of the error, rounded.
    let unit = ServoConfig { drive_width: 31, ..ServoConfig::default() };
    for count in -1024..1024 {
        let mut servo = ServoControl::new(unit).expect("a configuration");
        let input = servo_control::In { desired: 0, count, proportional: 2048 << 4, derivative: 0, sample: 1 };
        let drive = servo.tick(input).drive as f64;
        // Half an LSB each of the conversion and of the drive, and a third of 2^-10 LSB a count of the constant.
        let allowed = 0.5 + (0.5 + count.abs() as f64 / 3072.0) / 256.0;
        let exact = -(count as f64) * 5.0 / 3072.0 * 2048.0;
        assert!((drive - exact).abs() <= allowed, "{count}: {drive} for {exact}");
    }
}

#[test]
fn a_window_makes_the_drive_of_one_count_that_much_smaller_and_full_for_as_many_samples() {
    let samples = |window: u32, gain: i64| -> Vec<i64> {
        let mut servo = ServoControl::new(ServoConfig { window, ..ServoConfig::default() }).expect("a configuration");
        let input = servo_control::In { desired: 0, count: 0, proportional: 0, derivative: gain, sample: 1 };
        let counts = [0, 0, 0].into_iter().chain([-1; 80]);
        counts.map(|count| servo.tick(servo_control::In { count, ..input }).drive).collect()
    };
    // A motion of one count is 853 LSBs of an angle. The gain of 64 samples is that of one sample, divided by 64.
    let gain = 640_000;
    let leap = 853 * gain / (1 << 19);
    assert_eq!(samples(1, gain)[..5], [0, 0, 0, 1023.min(leap), 0]);
    let share = (853 * (gain / 64) + (1 << 18)) >> 19;
    let expected: Vec<_> = [0; 3].into_iter().chain([share; 64]).chain([0; 16]).collect();
    assert_eq!(samples(64, gain / 64), expected);
}

/// The equation of `impedance_control`.
fn impedance(config: &ImpedanceConfig, input: impedance_control::In<i64>) -> i64 {
    let impedance_control::In { rest, radius, slope, finger_force, stiffness, feedback } = input.map(i128::from);
    let (stiff, back) = (config.stiffness.frac() as u32, config.feedback.frac() as u32);
    let desired = nearest(stiffness * (rest - radius), stiff).clamp(0, config.force_limit.into());
    let push = desired * 2i128.pow(back) + feedback * (desired - finger_force);
    saturated(nearest(slope * push * i128::from(config.gain), back + config.gain_frac), config.drive_width)
}

fn narrow_impedance() -> ImpedanceConfig {
    ImpedanceConfig {
        length: format(true, 0, 4),
        force_width: 4,
        force_limit: 11,
        stiffness: format(false, 1, 2),
        feedback: format(false, 2, 1),
        gain: 5,
        gain_frac: 6,
        drive_width: 5,
    }
}

#[test]
fn every_word_of_a_narrow_impedance_is_its_equation() {
    let config = narrow_impedance();
    let mut control = ImpedanceControl::new(config).expect("a configuration");
    for bits in 0..1i64 << 25 {
        let low = |place: u32, width: u32| (bits >> place) & ((1 << width) - 1);
        let signed = |place: u32| low(place, 5) - 16;
        let input = impedance_control::In {
            rest: signed(0),
            radius: signed(5),
            slope: signed(10),
            finger_force: low(15, 4),
            stiffness: low(19, 3),
            feedback: low(22, 3),
        };
        assert_eq!(control.tick(input).drive, impedance(&config, input), "{input:?}");
    }
}

#[test]
fn random_words_of_an_impedance_are_its_equation() {
    let wide = ImpedanceConfig {
        length: format(true, -1, 30),
        force_width: 20,
        force_limit: 1_000_000,
        stiffness: format(false, 4, 20),
        feedback: format(false, 6, 10),
        gain: 1_999_999_999,
        gain_frac: 40,
        drive_width: 24,
    };
    for (seed, config) in [ImpedanceConfig::default(), wide].into_iter().enumerate() {
        let random = &mut Random(seed as u64);
        let mut control = ImpedanceControl::new(config).expect("a configuration");
        let formats = control.inputs().map(|signal| signal.format);
        for _ in 0..200_000 {
            let input = formats.map(|format| random.word(format));
            assert_eq!(control.tick(input).drive, impedance(&config, input), "{config:?}: {input:?}");
        }
    }
}

#[test]
fn a_pressed_segment_is_pushed_outwards_and_never_pulled_back() {
    let mut control = ImpedanceControl::default();
    let metres = |length: f64| (length * f64::from(1 << 22)).round() as i64;
    // The crank at 60 degrees: 12.0127039 mm per radian, inwards. Pressed by 3 mm, 2 N/mm push with 6 N.
    let input = impedance_control::In {
        rest: metres(0.06323),
        radius: metres(0.06023),
        slope: metres(-0.012_012_703_9),
        finger_force: (6.0_f64 * 409.6).round() as i64,
        stiffness: (2000.0 / f64::from(1 << 22) * 409.6 * 65_536.0).round() as i64,
        feedback: 0,
    };
    let exact = -0.012_012_703_9 * 6.0 / 0.118 * 1024.0;
    let drive = control.tick(input).drive;
    // The relative errors: of the force half an LSB of 2458 by rounding, one LSB of 12583 by the lengths, and half an
    // LSB of 12800 by the stiffness; of the slope half an LSB of 50385; of the gain half an LSB of 21695.
    let relative = 0.5 / 2457.0 + 1.0 / 12_582.0 + 0.5 / 12_799.0 + 0.5 / 50_384.0 + 0.5 / 21_694.0;
    assert!((drive as f64 - exact).abs() <= 0.5 + exact.abs() * relative, "{drive} for {exact}");
    // The finger lacks 2 N: a feedback of 4 adds 8 N.
    let lacks = impedance_control::In { finger_force: (4.0_f64 * 409.6).round() as i64, feedback: 4 << 4, ..input };
    assert_eq!(control.tick(lacks).drive, -1024, "14 N are more than the servo has");
    let pulled = impedance_control::In { radius: metres(0.0650), finger_force: 0, ..lacks };
    assert_eq!(control.tick(pulled).drive, 0, "a spring that would pull");
    let pressed = impedance_control::In { radius: metres(0.0500), feedback: 0, ..input };
    let most = impedance(&ImpedanceConfig::default(), pressed);
    let further = impedance_control::In { radius: metres(0.0480), ..pressed };
    assert_eq!([control.tick(pressed).drive, control.tick(further).drive], [most, most], "8 N at most");
}

/// The registers of `control_switch` and its equations.
#[derive(Clone, Copy, Default, PartialEq, Debug)]
struct Switch {
    drive: i64,
    impedance: bool,
    equilibrium: i64,
    loads: bool,
    driven: bool,
    offset: i64,
}

impl Switch {
    fn ticked(self, config: &SwitchConfig, input: control_switch::In<i64>) -> Self {
        let mut next = Self { loads: input.sample != 0, ..self };
        if self.loads {
            let law = if self.impedance { input.impedance_drive } else { input.position_drive };
            if config.bumpless {
                next.offset = if self.impedance == self.driven {
                    let whole = 1 << config.decay;
                    self.offset.signum() * (self.offset.abs() * (whole - 1) / whole)
                } else {
                    self.drive - law
                };
            }
            next.driven = self.impedance;
            next.drive = saturated((law + next.offset).into(), config.drive_width);
        }
        if input.sample != 0 {
            next.impedance = match self.impedance {
                false => input.finger_force > input.threshold_on,
                true => input.finger_force >= input.threshold_off,
            };
            if !config.take_radius {
                next.equilibrium = input.rest;
            } else if !(self.impedance && next.impedance) {
                next.equilibrium = input.radius;
            }
        }
        next
    }
}

/// Returns the default, all four combinations of options in narrow words, and a slow decay.
fn switches() -> Vec<SwitchConfig> {
    let normal = SwitchConfig::default();
    let narrow = SwitchConfig { drive_width: 4, force_width: 3, length: format(true, 0, 3), ..normal };
    let with = |take_radius, bumpless, decay| SwitchConfig { take_radius, bumpless, decay, ..narrow };
    let slow = SwitchConfig { decay: 15, ..normal };
    vec![normal, with(true, true, 1), with(false, true, 0), with(true, false, 3), with(false, false, 2), slow]
}

#[test]
fn every_history_of_a_switch_is_its_equation() {
    for (seed, config) in switches().into_iter().enumerate() {
        let random = &mut Random(seed as u64);
        let mut switch = ControlSwitch::new(config).expect("a configuration");
        let formats = switch.inputs().map(|signal| signal.format);
        let mut model = Switch::default();
        let mut input = formats.map(|format| random.word(format));
        for edge in 0..300_000 {
            if random.next().is_multiple_of(200) {
                switch.reset();
                model = Switch::default();
            }
            let fresh = formats.map(|format| random.word(format));
            input = if random.next().is_multiple_of(4) { fresh } else { input };
            input.sample = i64::from(random.next().is_multiple_of(2));
            model = model.ticked(&config, input);
            let shown = switch.tick(input);
            let expected = [model.drive, i64::from(model.impedance), model.equilibrium];
            assert_eq!([shown.drive, shown.mode, shown.equilibrium], expected, "{config:?}: edge {edge} {input:?}");
        }
    }
}

/// A switch that samples now and shows its drive two edges later.
struct Sampled(ControlSwitch);

impl Sampled {
    fn sample(&mut self, input: control_switch::In<i64>) -> control_switch::Out<i64> {
        self.0.tick(control_switch::In { sample: 1, ..input });
        self.0.tick(control_switch::In { sample: 0, ..input })
    }
}

fn probing(position_drive: i64, impedance_drive: i64, finger_force: i64) -> control_switch::In<i64> {
    control_switch::In {
        position_drive,
        impedance_drive,
        finger_force,
        threshold_on: 400,
        threshold_off: 200,
        radius: finger_force,
        rest: -1,
        sample: 0,
    }
}

#[test]
fn every_offset_decays_to_zero_and_never_passes_it() {
    for decay in 0..=15 {
        let config = SwitchConfig { decay, ..SwitchConfig::default() };
        let mut switch = Sampled(ControlSwitch::new(config).expect("a configuration"));
        for held in [-1024, -1, 0, 1, 1023] {
            for law in [-1024, -700, -1, 0, 1, 1023] {
                switch.0.reset();
                switch.sample(probing(held, law, 0));
                let mut drive = switch.sample(probing(held, law, 401)).drive;
                assert_eq!(drive, held, "the drive stays at the switch");
                let mut samples = 0;
                while drive != law {
                    let next = switch.sample(probing(held, law, 401)).drive;
                    let share = (drive - law).abs() >> decay;
                    let step = (drive - next) * (drive - law).signum();
                    assert!((share..=share + 1).contains(&step) && step > 0, "{decay}: {drive} to {next} at {law}");
                    (drive, samples) = (next, samples + 1);
                }
                assert!(samples <= (held - law).abs(), "{samples} samples");
            }
        }
    }
}

#[test]
fn the_drive_stays_at_a_switch_in_both_directions_and_moves_by_law_and_decay_in_between() {
    let mut switch = Sampled(ControlSwitch::default());
    let mut random = Random(3);
    let mut last = (switch.sample(probing(0, 0, 0)), [0i64; 2]);
    let mut offset = 0i64;
    let mut switches = 0;
    for _ in 0..100_000 {
        let laws = [0, 1].map(|_| (random.next() % 1024) as i64 - 512);
        let shown = switch.sample(probing(laws[0], laws[1], (random.next() % 600) as i64));
        let law = laws[shown.mode as usize];
        if shown.mode == last.0.mode {
            let kept = offset - offset.signum() * (offset.abs() + 15).div_euclid(16);
            // Exact where nothing saturates: the step is that of the law and of the offset.
            if shown.drive.abs() < 1023 {
                assert_eq!(shown.drive, law + kept);
            }
            offset = kept;
        } else {
            assert_eq!(shown.drive, last.0.drive, "a leap at a switch");
            offset = shown.drive - law;
            switches += 1;
        }
        last = (shown, laws);
    }
    assert!(switches > 10_000, "{switches}");
}

#[test]
fn a_switch_comes_only_where_the_force_has_passed_the_other_threshold() {
    let mut switch = Sampled(ControlSwitch::default());
    let mut random = Random(4);
    let (mut force, mut mode, mut switches) = (0i64, 0, 0);
    for _ in 0..100_000 {
        force = (force + (random.next() % 101) as i64 - 50).clamp(0, 600);
        let shown = switch.sample(probing(0, 0, force));
        let expected = if force > 400 {
            1
        } else if force < 200 {
            0
        } else {
            mode
        };
        assert_eq!(shown.mode, expected, "a force of {force} in mode {mode}");
        switches += i64::from(shown.mode != mode);
        mode = shown.mode;
    }
    assert!(switches > 100, "{switches}");
    // Equal thresholds: a force that alternates around them switches at every sample.
    for turn in 0..10 {
        let input = control_switch::In { threshold_off: 400, ..probing(0, 0, 399 + 2 * (turn % 2)) };
        assert_eq!(switch.sample(input).mode, turn % 2);
    }
}

#[test]
fn the_equilibrium_is_the_radius_at_the_switch_until_the_probing_ends() {
    let mut switch = Sampled(ControlSwitch::default());
    let shown = [100, 300, 401, 500, 250, 200, 199, 150].map(|force| switch.sample(probing(0, 0, force)).equilibrium);
    assert_eq!(shown, [100, 300, 401, 401, 401, 401, 199, 150]);
    let desired = SwitchConfig { take_radius: false, ..SwitchConfig::default() };
    let mut switch = Sampled(ControlSwitch::new(desired).expect("a configuration"));
    assert_eq!([100, 401, 500].map(|force| switch.sample(probing(0, 0, force)).equilibrium), [-1; 3]);
}

#[test]
fn impossible_controllers_are_refused() {
    let servo = ServoConfig::default();
    for config in [
        // A count of -1024 is two half turns.
        ServoConfig { step: 1 << 20, ..servo },
        ServoConfig { step: 0, ..servo },
        ServoConfig { proportional: format(true, 12, 4), ..servo },
        ServoConfig { drive_width: 32, ..servo },
    ] {
        assert!(ServoControl::new(config).is_err(), "{config:?}");
    }
    assert!(ServoControl::new(ServoConfig { step: (1 << 20) - 1, ..servo }).is_ok());
    let impedance = ImpedanceConfig::default();
    for config in [
        ImpedanceConfig { force_limit: 4096, ..impedance },
        ImpedanceConfig { length: format(false, 0, 20), ..impedance },
        ImpedanceConfig { feedback: format(true, 4, 4), ..impedance },
        ImpedanceConfig { gain: 0, ..impedance },
    ] {
        assert!(ImpedanceControl::new(config).is_err(), "{config:?}");
    }
    let switch = SwitchConfig::default();
    for config in [
        SwitchConfig { decay: 16, ..switch },
        SwitchConfig { length: format(false, 0, 20), ..switch },
        SwitchConfig { force_width: 1, ..switch },
    ] {
        assert!(ControlSwitch::new(config).is_err(), "{config:?}");
    }
}
