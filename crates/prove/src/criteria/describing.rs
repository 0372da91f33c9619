//! The describing function of a quantised position: from which stiffness on rounding alone sustains a limit cycle.
//!
//! A mid-tread quantiser passes a sine of amplitude `A` as if multiplied by
//! `N(A) = (4Δ/πA) Σ sqrt(1 - ((2k - 1) Δ/2A)²)`, summed over the thresholds `(2k - 1) Δ/2` below `A`. `N` is at most
//! 4/π, at `A = Δ/√2`. A limit cycle lasts where the loop with `N(A)` times its gains is at the border of stability,
//! hence from `K = π/4 K_crit` on.
//!
//! The encoder's counter is a floor function: a mid-tread quantiser with a bias of half a count. The bias shifts the
//! middle of the limit cycle into the middle of a count and changes nothing else, unless a steady effort moves it
//! further. A steady effort that balances at the edge of a count turns the quantiser into a relay. Its gain has no
//! bound for small amplitudes, so the loop then oscillates at any stiffness.

use std::f64::consts::{FRAC_PI_4, PI};

use hpu_cosim::figure;
use hpu_cosim::scene::{Hand, Scene};

use super::{Assumption, Criterion, Figure, Silent, critical, frictionless, law, prompt};
use crate::linear::{Damping, Stretch};

/// Returns `N(A)` of a mid-tread quantiser, with `A` in quantiser steps.
pub fn describing_function(amplitude_counts: f64) -> f64 {
    let thresholds = (1..).map(|k| f64::from(k) - 0.5).take_while(|threshold| *threshold < amplitude_counts);
    let sum: f64 = thresholds.map(|threshold| (1.0 - (threshold / amplitude_counts).powi(2)).sqrt()).sum();
    4.0 / (PI * amplitude_counts) * sum
}

/// Returns the amplitude, in quantiser steps, of the stable limit cycle where `N(A) = gain`: the larger root below 3/2.
///
/// There `N` falls, so a larger oscillation shrinks and a smaller one grows. Returns `None` if `N` does not reach this
/// gain.
pub fn stable_amplitude(gain: f64) -> Option<f64> {
    // With one threshold below A, N = (8/π) sqrt(u (1 - u)) and u = 1/(2A)²; the larger A has the smaller u.
    let product = (PI * gain / 8.0).powi(2);
    let rest = 1.0 - 4.0 * product;
    // 2 product / (1 + root) is the smaller root without cancellation.
    let amplitude = (rest >= 0.0).then(|| 0.5 / (2.0 * product / (1.0 + rest.sqrt())).sqrt());
    amplitude.filter(|amplitude| *amplitude <= 1.5)
}

/// Returns the softest wall on which the quantiser sustains a limit cycle.
///
/// The wall's damping acts on the quantised position too, so it is multiplied by the same gain.
pub(super) fn criterion(scene: &Scene) -> Result<Criterion, Silent> {
    let name = "describing_function";
    let damping = scene.wall.damping_nm_s_per_rad;
    let most = 1.0 / FRAC_PI_4;
    let limit = FRAC_PI_4 * critical(scene, most * damping).map_err(|why| Silent { name, why: why.to_string() })?;
    let mut figures = vec![];
    let stiffness = scene.wall.stiffness_nm_per_rad;
    if stiffness >= limit {
        // The quantiser's gain is at most `most`; the loop settles with every gain below the softest crossing.
        let range = [1e-3 * stiffness, most * stiffness];
        let settling = Stretch::softest(scene, Damping::PerStiffness(damping / stiffness), range);
        let gain = settling.ok().flatten().map(|stretch| stretch.to.middle() / stiffness);
        let amplitude = gain.and_then(stable_amplitude);
        figures.extend(amplitude.map(|counts| Figure { name: "amplitude", value: counts, unit: "count" }));
    }
    Ok(Criterion {
        name,
        limit,
        unit: crate::linear::unit(scene),
        speaks: true,
        assumptions: vec![
            Assumption::new(
                "a wall that pulls as well as pushes, on a position in whole counts (words only push, \
                 the linear law has no counts)",
                false,
                || law(scene).to_string(),
            ),
            prompt(scene),
            frictionless(scene),
            Assumption::new(
                "no steady effort, so that the swing is about the middle of a count: \
                 about an edge it begins at any stiffness",
                matches!(scene.hand, Hand::None),
                || "a hand".to_string(),
            ),
            Assumption::new(
                "a body that filters all but the first harmonic: at least ten samples a swing",
                scene.method.kind.is_live() || samples_a_swing(scene, limit) > 10.0,
                || figure(samples_a_swing(scene, limit)),
            ),
        ],
        figures,
        region: None,
    })
}

/// Returns the number of samples in a period of the oscillation at this stiffness.
fn samples_a_swing(scene: &Scene, stiffness: f64) -> f64 {
    let body = super::Rigid::new(scene);
    2.0 * PI / ((stiffness / body.inertia_kg_m2).sqrt() * body.period_s)
}
