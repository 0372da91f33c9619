//! The flags of lost bits in cases worked out by hand, and the configurations that the laws refuse.

use crate::laws_common::{Wall, sampled};
use hpu_datapath::{
    BoundingConfig, CouplingConfig, EnergyBounding, Law, LawWidths, PassiveSpring, PassivityConfig,
    PassivityController, SpringConfig, VirtualCoupling,
};
use hpu_signal::Format;

const KEPT: (bool, bool) = (false, false);
const ROUNDED: (bool, bool) = (true, false);
const OVERFLOWED: (bool, bool) = (false, true);

/// Returns torque and memory after a sample at that depth, and the flags of their lost bits.
fn at<L: Law>(law: &mut L, depth: i64, stiffness: i64) -> ([i64; 2], [(bool, bool); 2]) {
    let mut wall = Wall { position: depth, stiffness, scale: 256, ..Wall::new(12, 1) };
    let shown = sampled(law, &mut wall);
    (shown, law.lost())
}

#[test]
fn the_coupling_tells_floors_and_clamps() {
    let mut rigid = VirtualCoupling::default();
    assert_eq!(at(&mut rigid, 5, 3), ([15, 5 * 256], [KEPT, KEPT]));
    assert_eq!(at(&mut rigid, 2, 4095), ([4095, 2 * 256], [OVERFLOWED, KEPT]));
    // The tool is free, and the coupling lets go at once. A torque of 0 instead of a pull is the law and counts as no
    // clamp.
    assert_eq!(at(&mut rigid, -4, 4095), ([0, 0], [KEPT, KEPT]));
    // The torque loses half a PWM count: 1/2 of 3 counts is 1.5, times 1 is 1.5.
    let half = CouplingConfig { share: 1 << 15, ..CouplingConfig::default() };
    assert_eq!(at(&mut VirtualCoupling::new(half).unwrap(), 3, 1), ([1, 384], [ROUNDED, KEPT]));
    // Without fraction bits, the extension is floored to 1 and the torque is exact.
    let coarse = CouplingConfig { extension_frac: 0, ..half };
    assert_eq!(at(&mut VirtualCoupling::new(coarse).unwrap(), 3, 1), ([1, 1], [KEPT, ROUNDED]));
}

#[test]
fn the_passivity_controller_tells_floors_and_clamps() {
    let config = PassivityConfig { exact: true, energy_width: 14, ..PassivityConfig::default() };
    let mut law = PassivityController::new(config).unwrap();
    // The wall wants 3000, 3000 and 0. The work is 0, then 3000 * 1, then 3000 * -2, so 3000 are missing over 2 counts.
    assert_eq!(at(&mut law, 1, 3000), ([3000, 0], [KEPT, KEPT]));
    assert_eq!(at(&mut law, 2, 1500), ([3000, 3000], [KEPT, KEPT]));
    assert_eq!(at(&mut law, 0, 0), ([-1500, -3000], [KEPT, KEPT]));
    // -1500 * 7 more would make -13500, but the word ends at -8192; over 7 counts that is 1170 and 2/7.
    assert_eq!(at(&mut law, 7, 0), ([1170, -8192], [ROUNDED, OVERFLOWED]));
}

#[test]
fn energy_bounding_tells_floors_and_clamps() {
    let mut law = EnergyBounding::default();
    // With c1 = 20, 10 counts allow a torque of 200.
    assert_eq!(at(&mut law, 10, 80), ([200, 2000], [KEPT, KEPT]));
    assert_eq!(at(&mut law, 10, 80), ([200, 2000], [KEPT, KEPT]));
    // Back by 3 counts, the energy allows sqrt((20 * 3)^2 + 2 * 20 * 2000) - 20 * 3 = 289.14 - 60.
    assert_eq!(at(&mut law, 7, 80), ([229, 2000 - 3 * 229], [ROUNDED, KEPT]));
    // The energy has only 14 bits.
    let narrow = BoundingConfig { c1: 4000, c2: 4000, energy_width: 14, ..BoundingConfig::default() };
    assert_eq!(at(&mut EnergyBounding::new(narrow).unwrap(), 10, 200), ([2000, (1 << 14) - 1], [KEPT, OVERFLOWED]));
}

#[test]
fn the_spring_tells_floors_and_clamps() {
    let mut law = PassiveSpring::default();
    assert_eq!(at(&mut law, 2, 3), ([6, 512], [KEPT, KEPT]));
    // The root is sqrt(4 + 2 * 2 * 3) = 4 counts.
    assert_eq!(at(&mut law, 5, 2000), ([4095, 1024], [OVERFLOWED, KEPT]));
    // The root is sqrt(16 + 2 * 4) = 4.898979 counts, which is 1254.1 / 256.
    assert_eq!(at(&mut law, 6, 256), ([1254, 1254], [KEPT, ROUNDED]));
    // A motion back by more than half of the extension takes energy that the spring does not have.
    assert_eq!(at(&mut law, 1, 1), ([0, 0], [KEPT, OVERFLOWED]));
}

#[test]
fn a_latency_is_that_of_the_part_and_an_edge_to_either_side() {
    assert_eq!(VirtualCoupling::default().latency(), 1);
    assert_eq!(PassivityController::default().latency(), 32 + 2);
    assert_eq!(EnergyBounding::default().latency(), 54 / 2 + 2);
    assert_eq!(PassiveSpring::default().latency(), 42 / 2 + 2);
}

#[test]
fn configurations_beyond_the_data_sheets_are_refused() {
    let (coupling, control) = (CouplingConfig::default(), PassivityConfig::default());
    let (bounding, spring) = (BoundingConfig::default(), SpringConfig::default());
    let signed = LawWidths { stiffness: Format::signed(12), ..LawWidths::default() };
    assert!(VirtualCoupling::new(CouplingConfig { widths: signed, ..coupling }).is_err());
    for gain in [
        CouplingConfig { share: 65537, ..coupling },
        CouplingConfig { free: 65537, ..coupling },
        CouplingConfig { held: 65537, ..coupling },
        CouplingConfig { gain_frac: 31, ..coupling },
        CouplingConfig { extension_frac: 31, ..coupling },
    ] {
        assert!(VirtualCoupling::new(gain).is_err(), "{gain:?}");
    }
    for energy_width in [11, 49] {
        assert!(PassivityController::new(PassivityConfig { energy_width, ..control }).is_err());
    }
    for bound in [
        BoundingConfig { c1: 1 << 14, ..bounding },
        BoundingConfig { c2: 1 << 14, ..bounding },
        BoundingConfig { root_width: 50, ..bounding },
        BoundingConfig { root_width: 53, ..bounding },
        BoundingConfig { root_width: 64, ..bounding },
        BoundingConfig { energy_width: 35, ..bounding },
    ] {
        assert!(EnergyBounding::new(bound).is_err(), "{bound:?}");
    }
    for extension_frac in [7, 19] {
        assert!(PassiveSpring::new(SpringConfig { extension_frac, ..spring }).is_err());
    }
}

#[test]
fn a_law_at_rest_leaps_over_any_number_of_captures_and_keeps_its_phase() {
    fn keeps<L: Law>(law: &L) {
        for period in (1..90).step_by(4) {
            let mut law = law.clone();
            let mut wall = Wall { position: 9, stiffness: 4, scale: 16, ..Wall::new(12, period) };
            for _ in 0..400 {
                law.tick(wall.words());
            }
            assert_eq!(law.quiet(&wall.words()), u64::MAX);
            wall.position = 12;
            let moved = wall.words();
            wall.position = 9;
            let mut ticker = law.clone();
            for edges in 0..200 {
                let (mut leaper, mut follower) = (law.clone(), ticker.clone());
                leaper.skip(edges, &wall.words());
                for _ in 0..80 {
                    assert_eq!(leaper.tick(moved), follower.tick(moved), "{} after {edges} of {period}", L::NAME);
                }
                ticker.tick(wall.words());
            }
        }
    }
    keeps(&VirtualCoupling::default());
    keeps(&PassivityController::default());
    keeps(&EnergyBounding::default());
    keeps(&PassiveSpring::default());
}
