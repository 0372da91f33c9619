//! Blocks built from their generics equal the blocks that were built directly.

use hpu_datapath::{Generic, configured, registry, variants};

/// A stream of words from a seed.
struct Words(u64);

impl Words {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 ^ self.0 >> 29
    }
}

#[test]
fn every_variant_is_made_again_of_its_generics_and_answers_alike() {
    for (label, mut block) in variants() {
        let name = block.name();
        let mut made = configured(name, &block.generics()).expect("a block").expect("its own generics");
        assert_eq!(made.generics(), block.generics(), "{name} {label}");
        assert_eq!(made.reset(), block.reset(), "{name} {label}");
        let formats: Vec<_> = block.inputs().iter().map(|port| port.format).collect();
        let widths = |ports: Vec<hpu_signal::Signal>| ports.iter().map(|port| port.format.width()).collect::<Vec<_>>();
        assert_eq!(widths(made.inputs()), widths(block.inputs()), "{name} {label}");
        assert_eq!(widths(made.outputs()), widths(block.outputs()), "{name} {label}");
        let mut words = Words(7);
        for edge in 0..200 {
            let input: Vec<_> =
                formats.iter().map(|format| format.from_bits(words.next() >> (words.next() % 64))).collect();
            assert_eq!(made.tick(&input), block.tick(&input), "{name} {label} at edge {edge} of {input:?}");
        }
    }
}

#[test]
fn what_no_block_can_have_is_refused_and_never_panics() {
    let corners =
        [0, 1, 2, 3, 17, 31, 32, 62, 63, 64, 65, 127, 4096, 65_537, i64::from(i32::MAX), i64::MAX, -1, i64::MIN];
    let (mut made, mut refused) = (0, 0);
    for block in registry() {
        for (generic, value) in block.generics() {
            let others: Vec<_> = match value {
                Generic::Integer(_) => corners.map(Generic::Integer).to_vec(),
                Generic::Boolean(flag) => vec![Generic::Boolean(!flag)],
            };
            for other in others {
                match configured(block.name(), &[(generic, other)]).expect("a block") {
                    Ok(block) => {
                        made += 1;
                        // A shaper that is not enabled has no coefficients.
                        let is_idle = block
                            .generics()
                            .iter()
                            .any(|&(name, value)| name.ends_with("ENABLED") && value == Generic::Boolean(false));
                        assert!(is_idle || block.generics().contains(&(generic, other)), "{generic} {other:?}");
                    }
                    Err(_) => refused += 1,
                }
            }
        }
    }
    assert!(made > 500 && refused > 3000, "{made} made, {refused} refused");
}

#[test]
fn a_mistake_says_what_there_is() {
    let refusal = |name, set: &[(&str, Generic)]| match configured(name, set).expect("a block") {
        Ok(_) => panic!("{name} takes {set:?}"),
        Err(error) => error.to_string(),
    };
    assert_eq!(
        refusal("pwm", &[("DEPTH", Generic::Integer(3))]),
        "pwm: generic DEPTH; accepted: WIDTH, ANTIPHASE, LATCHED, FLOATING, DEAD_TIME"
    );
    assert_eq!(refusal("pwm", &[("LATCHED", Generic::Integer(1))]), "pwm: LATCHED is 1; accepted: true or false");
    assert_eq!(refusal("unilateral", &[("WIDTH", Generic::Integer(99))]), "unilateral: WIDTH is 99; accepted: 2 to 62");
    assert!(configured("no_such_block", &[]).is_none());
}
