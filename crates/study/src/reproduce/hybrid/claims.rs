//! The claims of the paper and of the pages that cite it.

use super::super::beside::{Claim, Found};
use super::super::summing::Statement;
use super::damping::RATES;

const CITING: &str = "abstract of the 2008 chapter on damping by the motor, on the paper's page";
const DUAL: &str = "abstract of the dual-rate paper, on the paper's page";

pub(super) fn claims() -> Vec<Claim> {
    let claim =
        |letter, paper, place, means, judge| Claim { statement: Statement { letter, paper, place, means }, judge };
    vec![
        claim(
            "a",
            "virtual walls that are much stiffer than those achieved by conventional techniques",
            "abstract",
            "at least twice as stiff, for each hand and clock",
            |found| figures(found, |times| times >= 2.0),
        ),
        claim(
            "b",
            "virtual wall stiffnesses four to five times greater than a conventional haptic controller",
            "Sevcik et al. 2009, Sec. 1, of this paper",
            "4 to 5 times as stiff, for each hand and clock",
            |found| figures(found, |times| (4.0..=5.0).contains(&times)),
        ),
        claim(
            "c",
            "at higher sampling frequencies a lower value of the computer damping Bc is sufficient to \
             stabilize the system",
            "Results",
            "no rate asks for more damping than the next lower one, and the highest for less than the lowest; for \
             three walls, linear and in words",
            less_at_higher_rates,
        ),
        claim(
            "d",
            "an increase in passive wall stiffness of about 33.3% at a sampling rate of 100Hz",
            CITING,
            "25 to 42 %, for each hand, asked for and felt",
            |found| figures(found, |more| (25.0..=42.0).contains(&more)),
        ),
        claim(
            "e",
            "and 16.6% at 1kHz over the performance of an undamped DC motor",
            CITING,
            "12 to 21 %, for each hand, asked for and felt",
            |found| figures(found, |more| (12.0..=21.0).contains(&more)),
        ),
        claim(
            "f",
            "a perceivable change in the performance of this system [the hybrid] was not observed by the use \
             of DC motor damping",
            CITING,
            "less than 10 % stiffer or softer, for each hand, asked for and felt",
            |found| figures(found, |more| more.abs() < 10.0),
        ),
        claim(
            "g",
            "Virtual wall stiffness ranging from 150 - 360 Nm/rad was stably implemented over a range of 0 - 1 Nms/rad \
             of virtual wall damping using the proposed scheme",
            DUAL,
            "two rates hold 360 N.m/rad at each damping, in words and linear; the inertia is assumed",
            |found| found.iter().flat_map(|found| [found.figures[1], found.figures[3]]).map(|k| k >= 360.0).collect(),
        ),
        claim(
            "h",
            "the stable range of virtual stiffness dropped considerably (~0 Nm/rad) for the virtual wall damping above \
             0.1 Nms/rad when the uniform rate sampling of 20kHz was used",
            DUAL,
            "one rate holds less than 15 N.m/rad, in words and linear; the inertia is assumed",
            |found| found.iter().flat_map(|found| [found.figures[0], found.figures[2]]).map(|k| k < 15.0).collect(),
        ),
        claim(
            "i",
            "265mNm corresponds to the maximum stall torque of the motor which is achieved at 100% duty cycle. This \
             occurs when the calculated value of tau_n >= 2^12",
            "Eq. (8)",
            "265 mN.m to 0.1 % where the product is beyond 12 bits",
            |found| figures(&found[..1], |torque_nm| (torque_nm - 0.265).abs() < 0.265e-3),
        ),
        claim(
            "j",
            "we truncate the result by eliminating the higher 12 bits. This does not affect the \
             performance of the device",
            "Sec. 4.1",
            "the same torque to 0.1 % without the upper 12 bits, 0.5 rad deep in 1.5 N.m/rad",
            |found| vec![(found[1].figures[0] / found[0].figures[0] - 1.0).abs() < 1e-3],
        ),
    ]
}

/// Returns whether the claim holds for each figure.
fn figures(found: &[&Found], so: impl Fn(f64) -> bool) -> Vec<bool> {
    found.iter().flat_map(|found| &found.figures).map(|figure| so(*figure)).collect()
}

/// Returns whether the least damping falls at ever higher rates, for each wall: first linear, then in fixed-point
/// words.
fn less_at_higher_rates(found: &[&Found]) -> Vec<bool> {
    let falls = |wall: &[&Found], of: usize| {
        let least: Vec<f64> = wall.iter().map(|found| found.figures[of]).collect();
        least.windows(2).all(|pair| pair[1] <= pair[0]) && least.last() < least.first()
    };
    found.chunks(RATES).flat_map(|wall| [falls(wall, 0), falls(wall, 1)]).collect()
}
