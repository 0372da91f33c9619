//! The loops of the segment on a gimbal, compared with their own instances and with their blocks called by hand.

use hpu_datapath::gimbal::{
    ControlSwitch, CrankTable, GimbalIn, GimbalInverse, GimbalLoop, GimbalLoopConfig, GimbalShearLoop,
    ImpedanceControl, ServoControl, control_switch, crank_table, impedance_control, servo_control,
};
use hpu_datapath::{Block, FractionalConfig, FractionalDifference, Wiring, bundle, flatten, fractional_difference};
use hpu_signal::Signal;
use proptest::prelude::*;

use crate::cases::cases;
use crate::parts::Netlist;

/// Words of the inputs, and the number of edges for which they stay.
type Motion = Vec<(Vec<u64>, u64)>;

/// Returns words that change now and then. Most stay for longer than the short loop's sample period.
fn motion() -> impl Strategy<Value = Motion> {
    prop::collection::vec((prop::collection::vec(any::<u64>(), 17), prop_oneof![1u64..9, 1u64..300]), 1..30)
}

/// Calls `visit` with the inputs of each move, and with the number of edges for which they stay. Seven periods in eight
/// let the kinematics end.
fn follow<W: Wiring>(wiring: &W, motion: &Motion, mut visit: impl FnMut(Vec<i64>, u64)) {
    let signals = flatten(&wiring.inputs());
    for (bits, stay) in motion {
        let word = |(signal, bits): (&Signal, &u64)| match signal.name {
            "period" if bits % 8 != 0 => 50 + (bits % 5) as i64,
            _ => signal.format.from_bits(*bits),
        };
        visit(signals.iter().zip(bits).map(word).collect(), *stay);
    }
}

fn equals_its_netlist<W: Wiring>(mut wiring: W, motion: &Motion) {
    let mut netlist = Netlist::new(&wiring);
    let mut inputs = Vec::new();
    follow(&wiring, motion, |words, stay| inputs.extend((0..stay).map(|_| words.clone())));
    for (edge, words) in inputs.iter().enumerate() {
        let outputs = flatten(&wiring.tick(bundle(words)));
        assert_eq!(wiring.words(), netlist.tick(words), "edge {edge}");
        assert_eq!(outputs, wiring.words()[words.len()..wiring.ports()]);
    }
}

/// Runs the same motion leaping and ticking. Asserts that nets, uses and state agree.
fn leaping_equals_ticking<W: Wiring + Clone + PartialEq>(wiring: &W, motion: &Motion) {
    let (mut leaping, mut ticking) = (wiring.clone(), wiring.clone());
    follow(wiring, motion, |words, stay| {
        let input = || bundle::<W::In<i64>>(&words);
        let mut left = stay;
        while left > 0 {
            let quiet = leaping.quiet(&input()).min(left);
            leaping.skip(quiet, &input());
            for _ in 0..quiet {
                ticking.tick(input());
                assert_eq!(ticking.words(), leaping.words());
            }
            left -= quiet;
            if left > 0 {
                leaping.tick(input());
                ticking.tick(input());
                left -= 1;
            }
            assert_eq!(ticking.words(), leaping.words());
        }
    });
    assert_eq!(leaping.uses(), ticking.uses());
    assert!(leaping == ticking, "states differ");
}

proptest! {
    #![proptest_config(cases(100))]

    #[test]
    fn gimbal_loops_are_their_instances(motion in motion()) {
        equals_its_netlist(GimbalLoop::new(GimbalLoopConfig::short()).unwrap(), &motion);
        equals_its_netlist(GimbalShearLoop::new(GimbalLoopConfig::short()).unwrap(), &motion);
    }

    #[test]
    fn a_leaping_gimbal_loop_equals_a_ticking_one(motion in motion()) {
        leaping_equals_ticking(&GimbalLoop::new(GimbalLoopConfig::short()).unwrap(), &motion);
        leaping_equals_ticking(&GimbalShearLoop::new(GimbalLoopConfig::short()).unwrap(), &motion);
    }

    /// Each sample is a call of each block, in the order of the data sheet, without clocks.
    #[test]
    fn each_sample_is_its_blocks_one_after_another(
        samples in prop::collection::vec(prop::collection::vec(any::<u64>(), 17), 1..40),
        sheared in any::<bool>(),
    ) {
        let config = GimbalLoopConfig::short();
        let period = i64::from(config.least_period(true)) + 3;
        let (mut plain, mut shear) = (GimbalLoop::new(config).unwrap(), GimbalShearLoop::new(config).unwrap());
        let formats = flatten(&plain.inputs()).into_iter().map(|signal| signal.format).collect::<Vec<_>>();
        let mut derivative = FractionalDifference::new(config.shear()).unwrap();
        let inverse = GimbalInverse::new(config.gimbal).unwrap();
        let mut servos = [config.servo(), config.servo(), config.crank()].map(|part| ServoControl::new(part).unwrap());
        let mut table = CrankTable::new(config.gimbal).unwrap();
        let mut impedance = ImpedanceControl::new(config.impedance()).unwrap();
        let mut switch = ControlSwitch::new(config.switch()).unwrap();
        let mut before = 0;
        // The first edge after the reset only raises the strobe.
        let nothing = GimbalIn { period, ..bundle(&[0; 17]) };
        plain.tick(nothing);
        shear.tick(nothing);
        for bits in samples {
            let words: Vec<_> = formats.iter().zip(bits).map(|(format, bits)| format.from_bits(bits)).collect();
            let input = GimbalIn { period, ..bundle(&words) };
            let mut out = [0; 4];
            for _ in 0..period {
                let all = if sheared { shear.tick(input) } else { plain.tick(input) };
                out = [all.drive1, all.drive2, all.drive3, all.mode];
            }

            let x = if sheared { before } else { input.x };
            let at = fractional_difference::In { u: input.x, gain: input.shear_gain, sample: 1 };
            derivative.tick(at);
            for _ in 0..=config.shear.memory {
                before = derivative.tick(fractional_difference::In { sample: 0, ..at }).y;
            }
            let joints = inverse.joints([x, input.y, input.z]);
            let gains = [input.proportional, input.derivative];
            let crank_gains = [input.crank_proportional, input.crank_derivative];
            let mut drives = [0; 3];
            let asked = [joints.pitch, joints.roll, joints.crank].into_iter().zip([
                (input.count1, gains),
                (input.count2, gains),
                (input.count3, crank_gains),
            ]);
            for ((servo, drive), (desired, (count, [proportional, derivative]))) in
                servos.iter_mut().zip(&mut drives).zip(asked)
            {
                *drive = servo.tick(servo_control::In { desired, count, proportional, derivative, sample: 1 }).drive;
            }
            let crank_table::Out { radius, slope } = table.tick(crank_table::In { count: input.count3 });
            let mut asks = control_switch::In {
                position_drive: drives[2],
                impedance_drive: 0,
                finger_force: input.finger_force,
                threshold_on: input.threshold_on,
                threshold_off: input.threshold_off,
                radius,
                rest: joints.radius,
                sample: 1,
            };
            let equilibrium = switch.tick(asks).equilibrium;
            let spring = impedance_control::In {
                rest: equilibrium,
                radius,
                slope,
                finger_force: input.finger_force,
                stiffness: input.stiffness,
                feedback: input.feedback,
            };
            (asks.impedance_drive, asks.sample) = (impedance.tick(spring).drive, 0);
            let control_switch::Out { drive, mode, .. } = switch.tick(asks);
            prop_assert_eq!(out, [drives[0], drives[1], drive, mode]);
        }
    }
}

#[test]
fn the_least_period_is_the_first_in_which_every_drive_is_shown() {
    let config = GimbalLoopConfig::default();
    // 3 times 20 rotations, 20 bits of a length, and 16 edges.
    assert_eq!(config.least_period(false), 96);
    let long = GimbalLoopConfig { shear: FractionalConfig { memory: 254, ..config.shear }, ..config };
    assert_eq!([long.least_period(false), long.least_period(true)], [96, 256]);
    let mut wiring = GimbalLoop::default();
    // Pressed by a finger: the first sample switches.
    let words = GimbalIn { y: 260_000, finger_force: 100, threshold_on: 50, period: 96, ..bundle(&[0; 17]) };
    let modes: Vec<_> = (0..100).map(|_| wiring.tick(words).mode).collect();
    // An edge raises the strobe, the next one samples, 93 later the joints are ready, and the next edge decides.
    assert_eq!(modes.iter().position(|mode| *mode == 1), Some(95));
}

#[test]
fn a_default_loop_rests_for_most_of_a_period_and_passes_few_edges_one_by_one() {
    let mut wiring = GimbalLoop::default();
    let input = GimbalIn { y: 260_000, period: 50_000, ..bundle(&[0; 17]) };
    let (mut edges, mut ticks) = (0u64, 0);
    while edges < 50_000 * 100 {
        let quiet = wiring.quiet(&input).min(50_000 * 100 - edges);
        wiring.skip(quiet, &input);
        edges += quiet;
        if edges < 50_000 * 100 {
            wiring.tick(input);
            (edges, ticks) = (edges + 1, ticks + 1);
        }
    }
    assert!(ticks <= 12 * 100, "{ticks}");
}
