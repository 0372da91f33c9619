//! The blocks of the paddle's loop compared with their equations in plain integers over all samples.

use hpu_datapath::paddle::{
    AngleSelect, FilteredPid, FilteredPidConfig, TimerPwm, TimerPwmConfig, WindowSum, angle_select, filtered_pid,
    timer_pwm, window_sum,
};
use hpu_datapath::{Block, Step};
use hpu_signal::Format;

/// Returns a number of at most so many bits, with its sign.
fn draw(state: &mut u64, format: Format) -> i64 {
    *state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
    format.from_bits((*state ^ (*state >> 29)) >> (*state >> 58 & 31))
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).unwrap()
}

/// Returns filter and command after these samples by the equations, the sum times `2^(FRAC + GAIN_FRAC)`.
fn expected(config: &FilteredPidConfig, samples: &[filtered_pid::In<i64>]) -> (i64, i64) {
    let (frac, all) = (1i128 << config.frac, 1i128 << (config.frac as i32 + config.gain.frac()));
    let limit = i128::from(config.sum_limit) * (all >> config.sum_frac);
    let (mut y, mut sum, mut command) = (0i128, 0, 0);
    for sample in samples {
        let [measured, target, share] = [sample.measured, sample.target, sample.share].map(i128::from);
        let [p, i, d, f] = [sample.proportional, sample.integral, sample.derivative, sample.forward].map(i128::from);
        let next = y + (share * (measured * frac - y)).div_euclid(65_536);
        let aim = target * (frac >> config.target.frac());
        sum = (sum + i * (aim - next)).clamp(-limit, limit);
        let total = p * (aim - next) + sum - d * (next - y) + f * aim;
        command = total.div_euclid(all).clamp(config.least.into(), config.most.into());
        y = next;
    }
    (y as i64, command as i64)
}

#[test]
fn every_sample_of_filter_and_controller_is_that_of_the_equations() {
    let narrow = FilteredPidConfig {
        width: 6,
        frac: 4,
        target: format(true, 6, 1),
        gain: format(false, 3, 3),
        command_width: 9,
        least: -201,
        most: 173,
        sum_limit: 99,
        sum_frac: 1,
    };
    for (seed, config) in [narrow, FilteredPidConfig::default(), FilteredPidConfig::current()].into_iter().enumerate() {
        let (mut state, mut limited, mut free) = (seed as u64, 0, 0);
        for _ in 0..40 {
            let mut block = FilteredPid::new(config).unwrap();
            let formats = block.inputs().map(|port| port.format);
            let mut samples: Vec<filtered_pid::In<i64>> = Vec::new();
            let mut shown = Block::reset(&mut block);
            for _ in 0..60 {
                let mut input = formats.map(|format| draw(&mut state, format));
                // Small gains, so that some commands are within their limits.
                let small = [&mut input.proportional, &mut input.integral, &mut input.derivative, &mut input.forward];
                for (gain, lost) in small.into_iter().zip([8, 14, 9, 13]) {
                    *gain >>= (u64::from(config.gain.width()) * lost / 16).saturating_sub(state >> 61);
                }
                let before = shown;
                shown = block.tick(input);
                if input.sample == 0 {
                    assert_eq!(shown, before, "without a sample nothing changes");
                    continue;
                }
                samples.push(input);
                let (y, command) = expected(&config, &samples);
                assert_eq!((shown.filtered, shown.command), (y, command), "{config:?} {samples:?}");
                let is_limit = [i64::from(config.least), i64::from(config.most)].contains(&command);
                *if is_limit { &mut limited } else { &mut free } += 1;
            }
        }
        assert!(limited > 50 && free > 50, "{limited} {free}");
    }
}

#[test]
fn the_limit_of_the_command_leaves_the_sum_alone() {
    // An error of 1 whose command is beyond the limit: the sum grows to its own limit, and comes back from there.
    let config = FilteredPidConfig {
        frac: 0,
        target: format(true, 13, 0),
        gain: format(false, 16, 0),
        least: -10,
        most: 10,
        sum_limit: 300,
        ..FilteredPidConfig::default()
    };
    let mut block = FilteredPid::new(config).unwrap();
    let input = |target| filtered_pid::In {
        target,
        measured: 0,
        share: 65_535,
        proportional: 0,
        integral: 7,
        derivative: 0,
        forward: 0,
        sample: 1,
    };
    let mut commands = |target, samples| (0..samples).map(|_| block.tick(input(target)).command).collect::<Vec<_>>();
    assert_eq!(commands(1, 3), [7, 10, 10]);
    commands(1, 100);
    // From 300, by 7 a sample: 41 samples to 13, then 6, -1.
    let back = commands(-1, 43);
    assert_eq!(back[40..], [10, 6, -1]);
}

#[test]
fn a_window_of_codes_is_their_sum_less_the_zero() {
    let (mut block, window) = (WindowSum::new(12, 33, 18, 24).unwrap(), 33);
    let (mut state, mut codes): (u64, Vec<i64>) = (5, Vec::new());
    Block::reset(&mut block);
    for edge in 0..3000 {
        let code = draw(&mut state, Format::signed(12));
        let zero = draw(&mut state, Format::signed(18));
        let shown = block.tick(window_sum::In { code, zero, period: 3 }).sum;
        if edge % 3 == 0 {
            codes.push(code);
            let newest = (0..window).map(|ago| codes[codes.len().saturating_sub(1 + ago)]).sum::<i64>();
            let filled = codes[0] * (window as i64 - codes.len() as i64).max(0);
            let own = codes.iter().rev().take(window).sum::<i64>();
            assert_eq!(shown, own + filled - zero, "sample {}", codes.len());
            assert_eq!(newest, own + filled, "the first code fills the window");
        }
    }
    assert!(Step::registers(&block).len() > 33);
}

#[test]
fn a_code_of_the_analog_sensor_is_read_with_its_sign() {
    let block = AngleSelect::new(14, 12).unwrap();
    let read = |delta, code, analog| block.eval(angle_select::In { delta, code, analog }).angle;
    assert_eq!(
        [read(-8192, 5, 0), read(-8192, 2047, 1), read(77, 2048, 1), read(77, 4095, 1)],
        [-8192, 2047, -2048, -1]
    );
}

#[test]
fn a_timer_gives_each_command_its_clocks_and_waits_for_the_period() {
    let mut block = TimerPwm::new(TimerPwmConfig::default()).unwrap();
    Block::reset(&mut block);
    let (mut state, mut held) = (3, 0);
    for _ in 0..40 {
        // A command in the midst of a period waits for the next one.
        let (taken, other) = (draw(&mut state, Format::signed(10)), draw(&mut state, Format::signed(10)));
        let mut high = 0;
        for clock in 0..5120 {
            let out = block.tick(timer_pwm::In { command: if clock == 0 { taken } else { other } });
            assert_eq!([out.a_low, out.b_low], [out.b_high, 1 - out.b_high]);
            assert_eq!(out.a_high, out.b_low);
            assert_eq!(out.b_high == 1, clock < 5 * (taken + 511), "command {taken}, clock {clock}");
            high += out.b_high;
        }
        assert_eq!(high, (5 * (taken + 511)).clamp(0, 5120));
        held += taken;
    }
    assert_ne!(held, 0);
}

#[test]
fn impossible_formats_are_refused_with_what_is_accepted() {
    let refused = |config| FilteredPid::new(config).err().map(|error| error.to_string()).unwrap_or_default();
    let normal = FilteredPidConfig::default();
    for (config, accepted) in [
        (FilteredPidConfig { width: 25, ..normal }, "WIDTH is 25; accepted: 2 to 24"),
        (FilteredPidConfig { target: format(true, 13, 13), ..normal }, "0 to 12 of them fraction bits"),
        (FilteredPidConfig { gain: format(true, 13, 2), ..normal }, "unsigned, 2 to 32 bits"),
        (FilteredPidConfig { least: 9, most: 9, ..normal }, "LEAST < MOST"),
        (FilteredPidConfig { sum_frac: 27, ..normal }, "SUM_FRAC is 27; accepted: 0 to 26"),
    ] {
        assert!(refused(config).contains(accepted), "{}", refused(config));
    }
    let sum = WindowSum::new(12, 33, 17, 24).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(sum.contains("SUM_WIDTH is 17; accepted: 18 to 30"), "{sum}");
}
