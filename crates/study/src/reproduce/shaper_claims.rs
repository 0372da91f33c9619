//! The claims of the paper on the analog input shaper.

use super::beside::{Claim, Found};
use super::shaper::C1_N_S_PER_M;
use super::summing::Statement;

/// Letters of the claims on energy bounding; all of its presses together decide each claim.
pub(super) const TOLD: &str = "efghi";

/// Returns the paper's claims.
pub(super) fn claims() -> Vec<Claim> {
    let claim =
        |letter, paper, place, means, judge| Claim { statement: Statement { letter, paper, place, means }, judge };
    vec![
        claim(
            "a",
            "the wall stiffness which can be stably displayed by the haptic device is between 20 kN/m and 30 kN/m when \
             AIS is not applied",
            "Sec. 4.1",
            "the device's damping is inferred here from this very claim, by K = 2b/T",
            |_| Vec::new(),
        ),
        claim(
            "b",
            "When the interaction is unstable, the frequency of oscillation is around 100 Hz",
            "Sec. 4.1",
            "the device's mass is inferred here from this very claim",
            |_| Vec::new(),
        ),
        claim(
            "c",
            "stability is maintained until the stiffness is between 60 kN/m and 70 kN/m",
            "Sec. 4.2, with the shaper",
            "the ladder of walls turns between 60 and 70 kN/m",
            |found| vec![turns_within(found[0], 60.0, 70.0)],
        ),
        claim(
            "d",
            "The frequency of oscillation is around 130 Hz",
            "Sec. 4.2, with the shaper",
            "117 to 143 Hz at the first wall that chatters",
            |found| vec![(117.0..=143.0).contains(&found[0].figures[2])],
        ),
        claim(
            "e",
            "Larger c_1 can make EBA display larger stiffness",
            "Sec. 4.3",
            "no larger c1 holds the mass less stiffly than a smaller one, by two forms of energy bounding",
            |found| each_form(found, |[none, ..]| none.windows(2).all(|pair| pair[1].1 >= pair[0].1)),
        ),
        claim(
            "f",
            "but it aggravates stability",
            "Sec. 4.3, of a larger c_1",
            "the smallest c1 settles, the largest does not, and none settles above one that does not, by two forms",
            |found| {
                each_form(found, |[none, ..]| {
                    none[0].0 && !none[none.len() - 1].0 && none.windows(2).all(|pair| pair[0].0 || !pair[1].0)
                })
            },
        ),
        claim(
            "g",
            "AIS can maintain stability for larger c_1 than when only EBA is used",
            "Sec. 4.3",
            "the shaper settles at a c1 at which nothing settles without it, by two forms",
            |found| each_form(found, |[none, analog, _]| settles_to(analog) > settles_to(none)),
        ),
        claim(
            "h",
            "when with AIS, the haptic device can display larger impedance since AIS can enhance stability",
            "Sec. 4.3",
            "of the walls that settle, the stiffest with the shaper is stiffer than without, by two forms",
            |found| each_form(found, |[none, analog, _]| stiffest(analog) > stiffest(none)),
        ),
        claim(
            "i",
            "digital filtering can also enhance the stability",
            "Sec. 4.3",
            "the digital shaper settles at a c1 at which nothing settles without it, by two forms",
            |found| each_form(found, |[none, _, digital]| settles_to(digital) > settles_to(none)),
        ),
    ]
}

/// Whether a ladder settles up to a wall of at least `low` and fails at a wall of at most `high`, both in kN/m.
fn turns_within(found: &Found, low: f64, high: f64) -> bool {
    found.figures[0] >= low && found.figures[1] <= high
}

/// For each c1 in ascending order, whether the press settles, and the stiffness held, in kN/m.
type Presses = Vec<(bool, f64)>;

/// Returns whether the claim holds for each form, from its presses without a shaper, with the analog and with the
/// digital one.
fn each_form(found: &[&Found], so: impl Fn([&Presses; 3]) -> bool) -> Vec<bool> {
    let presses = found
        .chunks(C1_N_S_PER_M.len())
        .map(|presses| presses.iter().map(|found| (found.figures[0] == 1.0, found.figures[1])).collect::<Presses>());
    let presses: Vec<_> = presses.collect();
    presses.chunks_exact(3).map(|form| so([&form[0], &form[1], &form[2]])).collect()
}

/// Returns the number of c1, in ascending order, up to which all settle.
fn settles_to(presses: &Presses) -> usize {
    presses.iter().take_while(|(settles, _)| *settles).count()
}

/// Returns the stiffest of the walls that settle, in kN/m.
fn stiffest(presses: &Presses) -> f64 {
    presses.iter().filter(|(settles, _)| *settles).map(|(_, held)| *held).fold(0.0, f64::max)
}
