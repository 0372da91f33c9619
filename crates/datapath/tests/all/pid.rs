//! The PID controller compared with its equations in plain integers over all samples, and its two ways against windup
//! with closed forms.

use hpu_datapath::{Block, LawIn, LawWidths, Pid, PidConfig, PositionPid, PositionPidConfig, pid};
use hpu_signal::Format;

/// Returns a number of at most so many bits, with its sign.
fn draw(state: &mut u64, format: Format) -> i64 {
    *state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
    format.from_bits((*state ^ (*state >> 29)) >> (*state >> 58 & 31))
}

/// Returns the command after these samples by the equations, all values times `2^GAIN_FRAC`.
fn expected(config: &PidConfig, samples: &[pid::In<i64>]) -> i64 {
    let (turn, one) = (1i128 << config.width, 1i128 << config.gain.frac());
    let near = |value: i64| (i128::from(value) + turn / 2).rem_euclid(turn) - turn / 2;
    let limit = i128::from(config.limit);
    let (mut sum, mut previous, mut command) = (0i128, 0, 0);
    for sample in samples {
        let [p, i, d] = [sample.proportional, sample.integral, sample.derivative].map(i128::from);
        let error = near(sample.target - sample.measured);
        let rate = near(sample.measured - previous);
        previous = sample.measured;
        let ahead = if config.forwarded { i128::from(sample.feed_forward) } else { 0 };
        let asked = (p * error + sum + i * error - d * rate).div_euclid(one) + ahead;
        command = asked.clamp(-limit, limit);
        let held = asked > limit && error > 0 || asked < -limit && error < 0;
        let given_back = (asked - command) * one / 2i128.pow(config.back);
        let grown = sum + i * error;
        sum = match config.back_calculation {
            true => grown - given_back,
            false if held => sum,
            false => grown,
        };
        sum = sum.clamp(-limit * one, limit * one);
    }
    command as i64
}

fn configs() -> Vec<PidConfig> {
    let gain = |int, frac| Format::new(false, int, frac).unwrap();
    let narrow = PidConfig { width: 6, gain: gain(3, 2), command_width: 7, limit: 40, back: 1, ..PidConfig::default() };
    let wide = PidConfig { width: 32, gain: gain(4, 20), command_width: 31, limit: 1 << 29, ..narrow };
    let ways = |config| [(false, false), (true, false), (false, true), (true, true)].map(|way| (config, way));
    let all = [narrow, wide, PidConfig::default()].into_iter().flat_map(ways);
    all.map(|(config, (back_calculation, forwarded))| PidConfig { back_calculation, forwarded, ..config }).collect()
}

#[test]
fn every_sample_is_that_of_the_equations() {
    for (seed, config) in configs().into_iter().enumerate() {
        let (mut state, mut limited, mut free) = (seed as u64, 0, 0);
        for _ in 0..40 {
            let mut block = Pid::new(config).unwrap();
            let formats = block.inputs().map(|port| port.format);
            let mut samples: Vec<pid::In<i64>> = Vec::new();
            for _ in 0..40 {
                let period = 1 + (state >> 40) as i64 % 3;
                let input = pid::In { period, ..formats.map(|format| draw(&mut state, format)) };
                samples.push(input);
                let command = expected(&config, &samples);
                if command.unsigned_abs() == u64::from(config.limit) {
                    limited += 1
                } else {
                    free += 1
                }
                for edge in 0..period {
                    // Between samples other inputs are not seen.
                    let input = if edge == 0 { input } else { pid::In { target: !input.target, ..input } };
                    assert_eq!(block.tick(input).command, command, "{config:?} after {samples:?}");
                }
            }
        }
        assert!(limited > 10 && free > 10, "{config:?}: {limited} {free}");
    }
}

/// Returns torque and memory of a controller of a position after these samples, by [`expected`]: a target that is the
/// position less the displacement, gains brought to one fraction, and the feed-forward of the target's motion.
fn expected_torque(config: &PositionPidConfig, samples: &[LawIn<i64>]) -> (i64, i64) {
    let LawWidths { width, stiffness, damping, torque_width, .. } = config.widths;
    let fracs = [stiffness, damping, config.integral_format].map(Format::frac);
    let frac = *fracs.iter().max().unwrap();
    let int = [stiffness, damping, config.integral_format].map(Format::int).into_iter().max().unwrap();
    let [kp, kd, ki] = fracs.map(|own| 1i64 << (frac - own));
    let (turn, limit) = (1i64 << width, i64::from(config.limit));
    let mut before = 0;
    let mut given = Vec::new();
    for sample in samples {
        let target = (sample.position - sample.delta).rem_euclid(turn);
        let motion = (target - before + turn / 2).rem_euclid(turn) - turn / 2;
        before = target;
        let ahead = (i64::from(config.feed_forward) * motion).div_euclid(1 << damping.frac()).clamp(-limit, limit);
        given.push(pid::In {
            target,
            measured: sample.position,
            feed_forward: ahead,
            proportional: sample.stiffness * kp,
            integral: i64::from(config.integral) * ki,
            derivative: sample.damping * kd,
            period: sample.period,
        });
    }
    let controller = PidConfig {
        width,
        gain: Format::new(false, int, frac).unwrap(),
        command_width: torque_width + 1,
        limit: config.limit,
        back_calculation: config.back_calculation,
        back: config.back,
        forwarded: true,
        period_width: config.widths.period_width,
    };
    (-expected(&controller, &given), before)
}

#[test]
fn every_sample_of_a_position_is_that_of_the_equations() {
    let format = |int, frac| Format::new(false, int, frac).unwrap();
    let widths = LawWidths {
        width: 8,
        stiffness: format(4, 2),
        damping: format(3, 4),
        torque_width: 9,
        period_width: 6,
        ..LawWidths::default()
    };
    let narrow = PositionPidConfig {
        widths,
        integral: 11,
        integral_format: format(1, 5),
        limit: 300,
        back: 2,
        ..PositionPidConfig::default()
    };
    let ways = [(false, 0), (true, 0), (false, 7), (true, 200)];
    let ways =
        ways.map(|(back_calculation, feed_forward)| PositionPidConfig { back_calculation, feed_forward, ..narrow });
    for (seed, config) in ways.into_iter().enumerate() {
        let (mut state, mut limited, mut free) = (seed as u64, 0, 0);
        for _ in 0..40 {
            let mut block = PositionPid::new(config).unwrap();
            let formats = block.inputs().map(|port| port.format);
            let mut samples: Vec<LawIn<i64>> = Vec::new();
            for _ in 0..30 {
                let period = 1 + (state >> 40) as i64 % 3;
                let input = LawIn { period, ..formats.map(|format| draw(&mut state, format)) };
                samples.push(input);
                let (torque, memory) = expected_torque(&config, &samples);
                if torque.unsigned_abs() == u64::from(config.limit) {
                    limited += 1
                } else {
                    free += 1
                }
                for edge in 0..period {
                    // Between samples other inputs are not seen.
                    let input = if edge == 0 { input } else { LawIn { delta: !input.delta, ..input } };
                    let out = block.tick(input);
                    assert_eq!((out.torque, out.memory), (torque, memory), "{config:?} after {samples:?}");
                }
            }
        }
        assert!(limited > 10 && free > 10, "{config:?}: {limited} {free}");
    }
}

/// Returns the samples after the turn of the target until the command leaves the limit, `held` samples after it was
/// met.
fn wound_up(back_calculation: bool, held: u32) -> u32 {
    let gain = Format::new(false, 4, 4).unwrap();
    let limit = 1000;
    let config = PidConfig { gain, limit, back_calculation, back: 1, ..PidConfig::default() };
    let mut block = Pid::new(config).unwrap();
    // An error of 100 counts by 16 / 16 each sample: the limit is met after 10 samples, and 6 counts later left.
    let input = |target| pid::In {
        target,
        measured: 0,
        feed_forward: 0,
        proportional: 0,
        integral: 16,
        derivative: 0,
        period: 1,
    };
    for sample in 1..=10 {
        assert_eq!(block.tick(input(100)).command, 100 * sample);
    }
    for _ in 0..held {
        assert_eq!(block.tick(input(100)).command, 1000);
    }
    (1..).find(|_| block.tick(input(-1)).command < 1000).unwrap()
}

#[test]
fn no_way_winds_up_however_long_the_limit_lasts() {
    for held in [0, 1, 10, 10_000] {
        assert_eq!([wound_up(false, held), wound_up(true, held)], [1, 1], "{held}");
    }
}

#[test]
fn a_step_of_the_target_makes_no_kick_of_the_derivative_and_a_counter_may_wrap() {
    let mut block = Pid::new(PidConfig::default()).unwrap();
    let input = |target, measured| pid::In {
        target,
        measured,
        feed_forward: 0,
        proportional: 256,
        integral: 0,
        derivative: 512,
        period: 1,
    };
    assert_eq!(block.tick(input(0, 0)).command, 0);
    assert_eq!(block.tick(input(1000, 0)).command, 1000);
    // The motion of 5 counts takes off 10.
    assert_eq!(block.tick(input(1000, 5)).command, 985);
    // From 2047 to -2048 is one count.
    assert_eq!(block.tick(input(-2048, 2047)).command, 1 - 2 * 2042);
    assert_eq!(block.tick(input(-2048, 2047)).command, 1);
}

#[test]
fn constants_of_a_position_beyond_the_data_sheet_are_refused() {
    let with = |change: &dyn Fn(&mut PositionPidConfig)| {
        let mut config = PositionPidConfig::default();
        change(&mut config);
        PositionPid::new(config).err().map(|error| error.to_string())
    };
    assert_eq!(with(&|_| ()), None);
    let told = with(&|config| config.widths.damping = Format::new(false, 2, 13).unwrap()).unwrap();
    let accepted = "24 bits for all three gains together";
    assert_eq!(told, format!("position_pid: the gains need 12 integer and 13 fraction bits; accepted: {accepted}"));
    for change in [
        &(|config: &mut PositionPidConfig| config.integral = 4096) as &dyn Fn(&mut PositionPidConfig),
        &|config| config.feed_forward = 1 << 24,
        &|config| config.limit = 4096,
        &|config| config.limit = 0,
        &|config| config.back = 9,
    ] {
        assert!(with(change).is_some());
    }
}

#[test]
fn widths_beyond_the_data_sheet_are_refused() {
    let with = |change: &dyn Fn(&mut PidConfig)| {
        let mut config = PidConfig::default();
        change(&mut config);
        Pid::new(config).err().map(|error| error.to_string())
    };
    assert_eq!(with(&|_| ()), None);
    let told = with(&|config| config.limit = 4096).unwrap();
    assert_eq!(told, "pid: LIMIT is 4096; accepted: 1 to 4095");
    for change in [
        &(|config: &mut PidConfig| config.width = 33) as &dyn Fn(&mut PidConfig),
        &|config| config.back = 9,
        &|config| config.command_width = 32,
        &|config| config.period_width = 31,
        &|config| config.gain = Format::new(true, 7, 8).unwrap(),
        &|config| config.gain = Format::new(false, 25, 0).unwrap(),
    ] {
        assert!(with(change).is_some());
    }
}
