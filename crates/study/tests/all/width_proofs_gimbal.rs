//! Compares the proof of a gimbal's words with runs of all shipped scenes, random targets and closed forms.

use std::f64::consts::PI;

use crate::gimbal::scene;
use crate::proofs_common::{contains, of};
use hpu_cosim::scene::shipped;
use hpu_cosim::{Control, Driver, GimbalSimulation, Simulation, SplitMix64, Wired};
use hpu_datapath::Block;
use hpu_datapath::gimbal::{CrankTable, GimbalConfig, GimbalInverse, crank_table};
use hpu_prove::ranges::{How, Proof};
use hpu_study::Device;

fn proof(name: &str, set: &[(&str, &str)]) -> Proof {
    scene(name, set).bounds().unwrap()
}

#[test]
fn every_shipped_run_stays_inside_its_bounds() {
    let all: Vec<_> = shipped().iter().filter(|scene| scene.name.starts_with("gimbal")).collect();
    assert!(all.len() >= 7);
    for shipped in all {
        let scene = scene(shipped.name, &[]);
        let proof = scene.bounds().unwrap();
        let simulation = GimbalSimulation::new(&scene).unwrap();
        let mut trace = simulation.trace(&[]);
        let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        assert_eq!(summary.nets.len(), proof.bounds.len());
        for (net, bound) in summary.nets.iter().zip(&proof.bounds) {
            assert_eq!(net.signal.name, bound.name);
            contains(bound, &net.signal, &net.usage);
        }
        // No net is left to its format alone.
        assert!(proof.bounds.iter().all(|bound| !bound.assumptions.iter().any(|said| said.contains("no proof"))));
    }
}

/// A crank of 12.5 mm on a rod of 58 mm reaches 45.5 mm to 70.5 mm, and its last count is 614 of 3072/5 half turns.
#[test]
fn ranges_are_those_of_the_closed_forms() {
    for name in ["gimbal-spring", "gimbal-switch-held", "gimbal-shape", "gimbal-shear"] {
        let proof = proof(name, &[]);
        let (radius, slope) = (of(&proof, "radius"), of(&proof, "slope"));
        let length_m = radius.format.lsb();
        let crank = PI * 614.0 * 5.0 / 3072.0;
        let least_m = 0.0125 * crank.cos() + (0.058f64.powi(2) - (0.0125 * crank.sin()).powi(2)).sqrt();
        assert!((radius.min - least_m).abs() <= length_m, "{radius:?} {least_m}");
        assert!((radius.max - 0.0705).abs() <= length_m, "{radius:?}");
        // The steepest slope is 12.78757 mm/rad, at 78.3425 degrees.
        assert!((slope.min + 0.012_787_57).abs() <= length_m && slope.max == 0.0, "{slope:?}");
        assert_eq!([radius.how, slope.how], [How::Exhausted; 2]);
        for net in ["rest", "equilibrium"] {
            let bound = of(&proof, net);
            assert!(bound.min == 0.0 && (bound.max - 0.0705).abs() <= length_m, "{bound:?}");
        }
        let angle = 2f64.powi(-19);
        for net in ["pitch", "roll"] {
            let bound = of(&proof, net);
            assert_eq!(bound.min, -bound.max);
            assert!((bound.max - 55.0 / 180.0).abs() <= angle, "{bound:?}");
        }
        let crank = of(&proof, "crank");
        assert_eq!((crank.min, crank.max), (0.0, 1.0 - angle));
        for net in ["drive1", "drive2", "drive3", "position_drive", "impedance_drive"] {
            let drive = of(&proof, net);
            assert_eq!((drive.min, drive.max), (-1024.0, 1023.0));
        }
        assert_eq!((of(&proof, "mode").min, of(&proof, "mode").max), (0.0, 1.0));
        let limits: Vec<_> = proof.limits.iter().map(|limit| (limit.name, limit.min, limit.max)).collect();
        let tilt = 55f64.to_radians();
        assert_eq!(limits[..3], [("pitch", -tilt, tilt), ("roll", -tilt, tilt), ("crank", 0.0, PI)]);
        assert!((limits[3].1 - 0.0455).abs() < 1e-12 && (limits[3].2 - 0.0705).abs() < 1e-12);
    }
}

/// A drive that cannot reach its limit is bounded by its gains: at `K1` full drives per radian and a travel from end to
/// end of `2 * 55` degrees, the drive is `1024 K1 2 * 55 pi / 180`, within the rounding of count, gain and drive.
#[test]
fn a_soft_servo_is_bounded_by_its_travel() {
    let soft = proof("gimbal-spring", &[("method.proportional", "0.25")]);
    let most = 1024.0 * 0.25 * 110f64.to_radians();
    for net in ["drive1", "drive2"] {
        let drive = of(&soft, net);
        assert!(drive.never_overflows, "{drive:?}");
        assert!((drive.max - most).abs() < 3.0 && (drive.min + most).abs() < 3.0, "{drive:?} {most}");
    }
}

#[test]
fn joints_and_table_are_within_their_errors() {
    let proof = proof("gimbal-shape", &[]);
    let config = GimbalConfig::default();
    let inverse = GimbalInverse::new(config).unwrap();
    let error = |net: &str| of(&proof, net).error.unwrap_or_else(|| panic!("{net} has no error"));
    let (length_m, half_turn) = (config.length.lsb(), 2f64.powi(-19));
    let mut draw = SplitMix64::new(3);
    let mut between = |least: f64, most: f64| least + (most - least) * draw.below(1 << 40) as f64 / 2f64.powi(40);
    for _ in 0..20_000 {
        let (radius, pitch, roll) = (between(0.0456, 0.0704), between(-0.95, 0.95), between(-0.95, 0.95));
        let target_m = [-radius * pitch.cos() * roll.sin(), radius * pitch.cos() * roll.cos(), radius * pitch.sin()];
        let words = target_m.map(|m| (m / length_m).round() as i64);
        let joints = inverse.joints(words);
        let [x, y, z] = words.map(|word| word as f64 * length_m);
        let across = x.hypot(y);
        for (net, word, lsb, truth) in [
            ("pitch", joints.pitch, half_turn, z.atan2(across) / PI),
            ("roll", joints.roll, half_turn, (-x).atan2(y) / PI),
            ("rest", joints.radius, length_m, across.hypot(z)),
        ] {
            let off = (word as f64 * lsb - truth).abs();
            assert!(off <= error(net), "{net}: {off} beyond {}", error(net));
        }
    }
    let mut table = CrankTable::new(config).unwrap();
    for count in 0..=614 {
        let words = table.tick(crank_table::In { count });
        let crank = PI * count as f64 * 5.0 / 3072.0;
        // The rod's end: across from the crank's pin, and along to the slider.
        let along = (0.058f64.powi(2) - (0.0125 * crank.sin()).powi(2)).sqrt();
        // Lengths are rounded to words before the table is made.
        let rounded = 2.0 * length_m;
        let off = (words.radius as f64 * length_m - 0.0125 * crank.cos() - along).abs();
        assert!(off <= error("radius") + rounded, "{count}: {off}");
    }
    assert!(error("radius") >= 0.5 * length_m && error("radius") < 0.51 * length_m);
}

/// The crank's angle is ill-conditioned at the dead centres, and a sheared target may lie beyond the reach.
#[test]
fn only_what_the_crank_and_shear_leave_open_has_no_error() {
    let open = |name: &str| -> Vec<_> {
        let proof = proof(name, &[]);
        proof.bounds.iter().filter(|bound| bound.error.is_none()).map(|bound| bound.name).collect()
    };
    assert_eq!(open("gimbal-spring"), ["drive3", "crank", "position_drive"]);
    let sheared = ["drive1", "drive2", "drive3", "shear_x", "pitch", "roll", "crank", "rest", "position_drive"];
    assert_eq!(open("gimbal-shear")[..9], sheared);
}
