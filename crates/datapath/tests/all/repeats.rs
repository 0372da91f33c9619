//! The law of `repeats` and `skip_repeats`: a wiring's outputs repeat as it announced, and passing over them equals
//! ticking.

use hpu_datapath::{
    Block, BoundingConfig, ConventionalLoop, CouplingConfig, EnergyBounding, HybridLoop, Law, LawWidths, LoopConfig,
    LoopIn, LoopOut, MethodLoop, MethodLoopConfig, PwmConfig, VirtualCoupling, Wiring,
};
use proptest::prelude::*;

use crate::cases::cases;

/// Returns motions of the encoder: each entry goes forward, back or nowhere and stays for a while.
fn motion() -> impl Strategy<Value = Vec<(i64, u64)>> {
    let step = prop::sample::select(vec![1i64, 1, 1, 0, -1]);
    let stay = prop_oneof![1u64..9, 1u64..100, 200u64..600];
    prop::collection::vec((step, stay), 1..20)
}

fn at(place: i64, period: i64) -> LoopIn<i64> {
    let (a_pin, b_pin) = [(0, 0), (0, 1), (1, 1), (1, 0)][place.rem_euclid(4) as usize];
    LoopIn { a_pin, b_pin, reference: 3, stiffness: 5, damping: 2, period, scale: 256 }
}

/// Runs a motion and asserts the law wherever the wiring announces a repetition. Returns how often edges were passed
/// over.
fn obeys<W>(mut wiring: W, period: i64, motion: &[(i64, u64)]) -> u64
where
    W: Wiring<In<i64> = LoopIn<i64>, Out<i64> = LoopOut<i64>> + Clone,
{
    let (mut place, mut said) = (0, 0);
    for (step, stay) in motion {
        place += step;
        let input = at(place, period);
        for edge in 0..*stay {
            let first = wiring.tick(input);
            let Some(repeat) = wiring.repeats(&input) else { continue };
            assert!((1..repeat.period).contains(&repeat.first));
            assert_ne!(first, repeat.others);
            let (nets, outputs) = (wiring.words().to_vec(), 7..11);
            let mut ticking = wiring.clone();
            for ahead in 1..=repeat.edges.min(150) + 1 {
                let gates = ticking.tick(input);
                let begins = ahead % repeat.period < repeat.first;
                assert_eq!(gates, if begins { first } else { repeat.others }, "{ahead} edges after {edge}");
                let others = ticking.words().iter().zip(&nets).enumerate().filter(|(net, _)| !outputs.contains(net));
                if ahead <= repeat.edges {
                    assert!(others.into_iter().all(|(_, (now, then))| now == then), "{ahead} edges after {edge}");
                }
                if (repeat.first..=repeat.edges).contains(&ahead) {
                    said += 1;
                    let mut passing = wiring.clone();
                    passing.skip_repeats(ahead, &input);
                    assert_eq!(passing.words(), ticking.words());
                    assert_eq!(passing.uses(), ticking.uses());
                    let mut on = ticking.clone();
                    let next = at(place + 1, period);
                    for _ in 0..20 {
                        assert_eq!(passing.quiet(&next), on.quiet(&next));
                        assert_eq!(passing.tick(next), on.tick(next));
                        assert_eq!(passing.words(), on.words());
                    }
                    assert_eq!(passing.uses(), on.uses());
                }
            }
        }
    }
    said
}

/// Returns a law in its loop, with a modulator of so few bits that periods are short.
fn around<L: Law>(law: L, antiphase: bool) -> MethodLoop<L> {
    let pwm = PwmConfig { width: law.widths().torque_width, antiphase, ..PwmConfig::default() };
    MethodLoop::new(law, MethodLoopConfig { pwm, ..MethodLoopConfig::default() }).unwrap()
}

fn narrow() -> LawWidths {
    LawWidths { torque_width: 5, ..LawWidths::default() }
}

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn what_repeats_comes_true_and_may_be_passed_over(motion in motion(), period in 1i64..700) {
        for antiphase in [false, true] {
            let pwm = PwmConfig { width: 5, antiphase, ..PwmConfig::default() };
            let config = LoopConfig { pwm, ..LoopConfig::default() };
            obeys(HybridLoop::new(config).unwrap(), period, &motion);
            obeys(ConventionalLoop::new(config).unwrap(), period, &motion);
            let bounding = BoundingConfig { widths: narrow(), ..Default::default() };
            obeys(around(EnergyBounding::new(bounding).unwrap(), antiphase), period, &motion);
            let coupling = CouplingConfig { widths: narrow(), ..Default::default() };
            obeys(around(VirtualCoupling::new(coupling).unwrap(), antiphase), period, &motion);
        }
    }
}

#[test]
fn a_wall_that_is_leant_on_repeats_its_pulse_for_good() {
    let pwm = PwmConfig { width: 5, ..PwmConfig::default() };
    let mut wiring = HybridLoop::new(LoopConfig { pwm, ..LoopConfig::default() }).unwrap();
    // The wall starts at the first count, and four counts more make a depth of one: a pulse of five of 32 edges.
    let push: Vec<_> = (0..5).map(|_| (1, 20)).chain([(0, 2000)]).collect();
    assert!(obeys(wiring.clone(), 50, &push) > 100);
    for (place, _) in push.iter().scan(0, |place, (step, stay)| {
        *place += step;
        Some((*place, stay))
    }) {
        for _ in 0..200 {
            wiring.tick(at(place, 50));
        }
    }
    let input = at(5, 50);
    let repeat = (0..32).find_map(|_| {
        wiring.tick(input);
        wiring.repeats(&input)
    });
    let repeat = repeat.expect("a period begins within 32 edges");
    assert_eq!((repeat.period, repeat.first, repeat.edges), (32, 5, u64::MAX));
}

#[test]
fn dead_time_and_commands_at_once_promise_nothing() {
    for pwm in [
        PwmConfig { width: 5, dead_time: 1, ..PwmConfig::default() },
        PwmConfig { width: 5, latched: false, ..PwmConfig::default() },
    ] {
        let wiring = HybridLoop::new(LoopConfig { pwm, ..LoopConfig::default() }).unwrap();
        assert_eq!(obeys(wiring, 50, &[(1, 20), (1, 20), (1, 20), (1, 20), (1, 20), (0, 500)]), 0);
    }
}
