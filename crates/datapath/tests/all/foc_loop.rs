//! The loop of field-oriented control: it is its parts, and it holds a current in a motor.

use std::f64::consts::TAU;

use hpu_datapath::foc::{FocConfig, FocIn, FocKnobLoop, FocLoop, FocOut, KnobConfig};
use hpu_datapath::{AnyBlock, Block, Wiring};
use hpu_signal::Format;

use crate::foc::draw;
use crate::parts::Netlist;

/// Returns small words, with which every period is short.
fn small(peak: bool) -> FocConfig {
    FocConfig {
        position_width: 7,
        pole_pairs: 3,
        counts: 64,
        phase_width: 31,
        iterations: 9,
        guard: 2,
        trig_frac: 8,
        code_width: 6,
        frac: 1,
        filter_frac: 2,
        gain: Format::new(false, 2, 4).unwrap(),
        voltage_width: 8,
        limit: 73,
        duty_width: 5,
        steps: 17,
        dead_time: 2,
        min_pulse: 2,
        sample_delay: 4,
        peak,
        sinusoidal: false,
    }
}

#[test]
fn the_loops_are_their_parts_and_leap_as_they_tick() {
    for peak in [false, true] {
        leaps(&FocLoop::new(small(peak)).unwrap(), 8);
        let torques = [0, 13, 31, 13, 0, -13, -31, -13].map(|torque| 2 * torque);
        let mut config = KnobConfig {
            foc: small(peak),
            period_width: 5,
            table_bits: 3,
            shift: 1,
            torques: [0; 32],
            ..Default::default()
        };
        config.stiffness = Format::new(false, 3, 2).unwrap();
        config.damping = Format::new(false, 3, 1).unwrap();
        config.torques[..8].copy_from_slice(&torques);
        leaps(&FocKnobLoop::new(config).unwrap(), 13);
    }
}

/// Drives a loop at random: the ports after the pins change now and then, that of `enable` more seldom.
fn leaps<W>(wiring: &W, enable: usize)
where
    W: Wiring<Out<i64> = FocOut<i64>> + Clone,
    W::In<i64>: Copy,
{
    let mut wiring = wiring.clone();
    let (mut netlist, mut leaper, mut engine) = (Netlist::new(&wiring), wiring.clone(), wiring.clone());
    let formats: Vec<_> = AnyBlock::inputs(&wiring).iter().map(|port| port.format).collect();
    let (mut words, mut state, mut place, mut gates) = (vec![0; formats.len()], 5u64, 0usize, 0u64);
    words[enable] = 1;
    let (mut edges, mut quiet, mut stretches) = (0, 0, 0);
    while edges < 60_000 {
        let random = draw(&mut state, Format::unsigned(16));
        if random % 3 == 0 {
            place = place.wrapping_add([1, 1, 3][random as usize % 7 % 3]);
            words[..2].copy_from_slice(&[[0, 0], [0, 1], [1, 1], [1, 0]][place % 4]);
        }
        if random % 5 == 0 {
            let port = 2 + random as usize / 5 % (enable - 2);
            words[port] = draw(&mut state, formats[port]);
        }
        words[enable] = i64::from(random % 50 != 7);
        let input: W::In<i64> = hpu_datapath::bundle(&words);
        let stay = 1 + random % 13;
        for _ in 0..stay {
            // The leaper ticks only where it cannot promise.
            if Block::quiet(&leaper, &input) > 0 {
                Block::skip(&mut leaper, 1, &input);
                quiet += 1;
            } else {
                Block::tick(&mut leaper, input);
            }
            Block::tick(&mut wiring, input);
            let expected = netlist.tick(&words);
            assert_eq!(wiring.words(), expected, "edge {edges}");
            assert_eq!(leaper.words(), expected, "edge {edges}");
            gates |= (enable + 1..enable + 8).filter(|net| expected[*net] == 1).fold(0, |set, net| set | 1 << net);
            edges += 1;
        }
        // As the engine goes on, in stretches of ticks.
        engine.take(&input);
        engine.tick_again(&input);
        let mut left = stay as u64 - 1;
        while left > 0 {
            let quiet = engine.quiet_again(&input).min(left);
            Block::skip(&mut engine, quiet, &input);
            left -= quiet;
            if left > 0 {
                let (done, _) = engine.tick_on(left, 0, &input);
                stretches += u32::from(done > 2);
                left -= done;
            }
        }
        assert_eq!(engine.words(), wiring.words(), "edge {edges}");
    }
    assert!(stretches > 100, "{stretches}");
    assert_eq!(gates, 0x7f << (enable + 1), "every gate was on");
    assert!(quiet > 8_000, "{quiet}");
}

/// A motor at a constant speed, in volts, amperes and electrical radians: both currents of the stator.
struct Motor {
    currents: [f64; 2],
    angle: f64,
}

const RESISTANCE: f64 = 0.5;
const INDUCTANCE: f64 = 5e-4;
const FLUX: f64 = 5e-3;
const SUPPLY: f64 = 24.0;
const CLOCK_S: f64 = 20e-9;
/// Amperes of a code.
const CODE_A: f64 = 0.01;

impl Motor {
    /// Goes on for a clock at these levels of the legs.
    fn step(&mut self, levels: [f64; 3], speed: f64) {
        let mean = levels.iter().sum::<f64>() / 3.0;
        let [a, b, c] = levels.map(|level| SUPPLY * (level - mean));
        let voltage = [a, (b - c) / 3f64.sqrt()];
        let back = [-self.angle.sin(), self.angle.cos()].map(|share| speed * FLUX * share);
        for axis in 0..2 {
            let drop = RESISTANCE * self.currents[axis] + back[axis];
            self.currents[axis] += CLOCK_S / INDUCTANCE * (voltage[axis] - drop);
        }
        self.angle += speed * CLOCK_S;
    }

    /// Returns the currents of phases a and b.
    fn phases(&self) -> [f64; 2] {
        let [alpha, beta] = self.currents;
        [alpha, (3f64.sqrt() * beta - alpha) / 2.0]
    }

    /// Returns the currents along and across the flux, in codes.
    fn rotor(&self) -> [f64; 2] {
        let ([alpha, beta], (sine, cosine)) = (self.currents, self.angle.sin_cos());
        [alpha * cosine + beta * sine, beta * cosine - alpha * sine].map(|current| current / CODE_A)
    }
}

/// Runs the loop on a motor for so many periods. Returns the currents in the rotor at the end of each, in codes.
fn run(config: FocConfig, target: i64, speed: f64, periods: usize) -> Vec<[f64; 2]> {
    let mut wiring = FocLoop::new(config).unwrap();
    Block::reset(&mut wiring);
    let mut motor = Motor { currents: [0.0; 2], angle: 0.0 };
    // A current loop of 1 kHz: the words of the gains by what a code and a voltage's word are.
    let (band, period_s) = (TAU * 1000.0, 2.0 * f64::from(config.steps) * CLOCK_S);
    let word = |gain: f64| {
        let volts = SUPPLY / f64::from(1 << (config.voltage_width - 1));
        let amperes = CODE_A / f64::from(1 << config.frac);
        (gain * amperes / volts * f64::from(1 << config.gain.frac())).round() as i64
    };
    let mut input = FocIn {
        a_pin: 0,
        b_pin: 0,
        offset: 0,
        i_a: 0,
        i_b: 0,
        target: target << config.frac,
        proportional: word(band * INDUCTANCE),
        integral: word(band * RESISTANCE * period_s),
        enable: 1,
    };
    let (mut seen, mut high) = (Vec::new(), [0.5; 3]);
    for clock in 0..2 * config.steps as usize * periods {
        let count = (motor.angle / TAU * f64::from(config.counts) / f64::from(config.pole_pairs)).floor() as i64;
        [input.a_pin, input.b_pin] = [[0, 0], [0, 1], [1, 1], [1, 0]][count.rem_euclid(4) as usize];
        let out = Block::tick(&mut wiring, input);
        if out.trigger == 1 {
            [input.i_a, input.i_b] = motor.phases().map(|current| (current / CODE_A).round() as i64);
        }
        // In the dead time a leg stays as it was: the currents' signs are left to the plant.
        for (level, gates) in
            high.iter_mut().zip([[out.a_high, out.a_low], [out.b_high, out.b_low], [out.c_high, out.c_low]])
        {
            *level = match gates {
                [1, 0] => 1.0,
                [0, 1] => 0.0,
                _ => *level,
            };
        }
        motor.step(high, speed);
        if (clock + 1) % (2 * config.steps as usize) == 0 {
            seen.push(motor.rotor());
        }
    }
    seen
}

#[test]
fn a_current_rises_as_the_controller_and_the_winding_say() {
    let (target, period_s) = (200.0, 2500.0 * CLOCK_S);
    // At standstill: the controller's sum, and the winding's exact response to the voltage of the sample before.
    let (band, decay) = (TAU * 1000.0, (-RESISTANCE / INDUCTANCE * period_s).exp());
    let (mut sum, mut volts, mut current) = (0.0, 0.0, 0.0);
    for (period, [d, q]) in run(FocConfig::default(), 200, 0.0, 60).into_iter().enumerate() {
        let error = target - current;
        sum += band * RESISTANCE * period_s * error;
        let next = band * INDUCTANCE * error + sum;
        current = decay * current + (1.0 - decay) / RESISTANCE * volts;
        volts = next;
        // A code's half of the converter, times at most sqrt(3) in `clarke`, and half a step of each duty, which is
        // 0.2 codes in a period.
        assert!((q - current).abs() < 2.0 && d.abs() < 2.0, "period {period}: {q}, not {current}");
    }
}

#[test]
fn a_wanted_current_flows_across_the_flux_of_a_turning_motor() {
    for (target, turns) in [(200, 0.0), (-200, 0.0), (150, 60.0), (-300, 40.0), (100, -50.0)] {
        let seen = run(FocConfig::default(), target, TAU * turns, 100);
        // 5 ms are thirty time constants of the loop. The converter rounds, as above; the encoder tells the angle to a
        // count, which turns the current by that much.
        let bound = 2.0 + target.abs() as f64 * TAU * 7.0 / 4096.0;
        for [d, q] in &seen[80..] {
            assert!((q - target as f64).abs() < 2.0 && d.abs() < bound, "{target} {turns}: {d} {q}");
        }
    }
}

#[test]
fn disabled_gates_stay_off_while_converters_go_on() {
    let mut wiring = FocLoop::default();
    Block::reset(&mut wiring);
    let input = FocIn { enable: 0, target: 800, ..hpu_signal::Ports::build(|| 99) };
    let mut triggers = 0;
    for _ in 0..25_000 {
        let out = Block::tick(&mut wiring, input);
        assert_eq!([out.a_high, out.a_low, out.b_high, out.b_low, out.c_high, out.c_low], [0; 6]);
        triggers += out.trigger;
    }
    assert_eq!(triggers, 10);
    let net = wiring.nets().iter().position(|net| net.name == "v_q").unwrap();
    assert_eq!(wiring.words()[net], 0, "no sample is taken");
}

#[test]
fn impossible_words_are_refused_with_what_is_accepted() {
    let refused = |config| FocLoop::new(config).err().map(|error| error.to_string()).unwrap_or_default();
    let normal = FocConfig::default();
    for (config, accepted) in [
        (FocConfig { pole_pairs: 0, ..normal }, "foc_loop: POLE_PAIRS is 0; accepted: 1 to 127"),
        (FocConfig { pole_pairs: 128, ..normal }, "POLE_PAIRS is 128; accepted: 1 to 127"),
        (FocConfig { counts: 5, ..normal }, "COUNTS is 5; accepted: 33 to 1048576"),
        (FocConfig { dead_time: 1250, ..normal }, "DEAD_TIME is 1250; accepted: 0 to 1249"),
        (FocConfig { min_pulse: 626, ..normal }, "MIN_PULSE is 626; accepted: 0 to 625"),
        (FocConfig { steps: 2048, ..normal }, "STEPS is 2048; accepted: 1 to 2047"),
        (FocConfig { sample_delay: 0, ..normal }, "SAMPLE_DELAY is 0; accepted: 1 to 1249"),
        (FocConfig { limit: 16_384, ..normal }, "both -16384 to 16383"),
        (FocConfig { code_width: 19, ..normal }, "clarke: WIDTH is 19; accepted: 2 to 18"),
        (FocConfig { position_width: 25, ..normal }, "COUNT_WIDTH is 25; accepted: 4 to 24"),
    ] {
        assert!(refused(config).contains(accepted), "{}", refused(config));
    }
}
