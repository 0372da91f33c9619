//! The analog input shaper, and energy bounding with it: the stiffness that settles, and the stiffness that is felt.

use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use hpu_cosim::Control;

use super::beside::{Comparison, Found, Line, Measure, measure, shipped_scene};
use super::made::{self, Made, Set, key, length, with};
use super::shaper_claims::{TOLD, claims};
use super::shaper_gain as gain;
use crate::limits::{Looks, Seen, WordsSet, usual_range};

/// The walls that are tried, in kN/m: 10 to 100 in steps of 5.
pub const LADDER_KN_PER_M: [u32; 19] = [10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85, 90, 95, 100];

/// The constants of energy bounding that are tried, in N·s/m.
pub(super) const C1_N_S_PER_M: [u32; 5] = [10, 20, 30, 40, 50];

/// The input shaper of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shaper {
    /// No shaper.
    None,
    /// The analog circuit before the amplifier.
    Analog,
    /// Its digital counterpart in the datapath.
    Digital,
}

impl Shaper {
    /// All shapers.
    pub const ALL: [Self; 3] = [Self::None, Self::Analog, Self::Digital];

    fn name(self) -> &'static str {
        match self {
            Self::None => "no shaper",
            Self::Analog => "analog shaper",
            Self::Digital => "digital shaper",
        }
    }

    /// Returns the overrides that put the shaper behind a law.
    fn set(self) -> Set {
        match self {
            Self::None => Vec::new(),
            Self::Analog => key("amplifier.shaper.cutoff", "2.5 Hz"),
            Self::Digital => key("method.shaper.cutoff", "2.5 Hz"),
        }
    }

    /// Returns the overrides that put the shaper behind a plain wall; a digital shaper needs another kind of method.
    fn wall(self) -> Set {
        let kind = if self == Self::Digital { key("method.kind", "sampled_wall") } else { Vec::new() };
        with(&kind, &self.set())
    }
}

/// Returns the paper's statements beside the emulator's results.
#[must_use]
pub fn comparison() -> Comparison {
    let mut lines = Vec::new();
    let mut line = |claims, group, what: String, published, measure: Measure| {
        lines.push(Line { group, what, published, claims, measure });
    };
    for (frequency_hz, left) in [
        (1.0, "1.1344829 (derived)"),
        (2.5, "1.2247449 (derived)"),
        (10.0, "0.35833597 (derived)"),
        (100.0, "0.035360856 (derived)"),
        (130.0, "0.027198927 (derived)"),
    ] {
        let gains = measure(move |_| Some(Ok(gains(frequency_hz))));
        line("", "|1 - H| of the filter", format!("{frequency_hz} Hz"), left, gains);
    }
    line(
        "",
        "|1 - H| of the filter",
        "greatest of a step's answer".into(),
        "1.2078796 (derived)",
        measure(|_| {
            let [exact, analog, digital] = gain::overshoots();
            Some(Ok(format!("closed form {exact:.7}, analog {analog:.7}, words {digital:.5}")))
        }),
    );

    const STABLE: &str = "Stable stiffness, walls of 10 to 100 kN/m in steps of 5";
    let published = [
        ("ab", "20 to 30 kN/m, then about 100 Hz"),
        ("cd", "60 to 70 kN/m, then about 130 Hz"),
        ("", ""), // The paper shows it only behind energy bounding.
    ];
    for (shaper, (claims, published)) in Shaper::ALL.into_iter().zip(published) {
        let ladder = measure(move |control| ladder(&shaper.wall(), control));
        line(claims, STABLE, shaper.name().into(), published, ladder);
    }
    for shaper in Shaper::ALL {
        let turn = measure(move |control| turn(&shaper.wall(), control));
        line("", "The same, over words and eight phases of the contact", shaper.name().into(), "", turn);
    }
    for (what_if, set) in WHAT_IFS {
        for shaper in Shaper::ALL {
            let set: Set = set.iter().map(|(key, value)| (*key, (*value).to_string())).collect();
            let ladder = measure(move |control| ladder(&with(&set, &shaper.wall()), control));
            line("", what_if, shaper.name().into(), "", ladder);
        }
    }
    for (group, form, friction, published) in BOUNDED {
        for shaper in Shaper::ALL {
            for c1 in C1_N_S_PER_M {
                let set = with(&bounded(form, c1, friction), &shaper.set());
                let published = published[shaper as usize];
                let claims = if published.is_empty() { "" } else { TOLD };
                let press = move |control: &Control| {
                    Some(made::run("bounded-impulse-engine", &set, control)?.map(|made| felt(&made)))
                };
                line(claims, group, format!("{}, c1 = {c1} N.s/m", shaper.name()), published, measure(press));
            }
        }
    }
    Comparison {
        name: "input-shaper",
        title: "The analog input shaper and energy bounding",
        lines,
        claims: claims(),
        notes: NOTES,
    }
}

/// Cases of energy bounding: heading, form, friction, and the paper's statement for each shaper.
const BOUNDED: [(&str, &str, &str, [&str; 3]); 4] = [
    ("Energy bounding by c1 and c2 = c1, a slow press to 6 N on 100 kN/m", "c1_c2", "0 N", SAID),
    ("Energy bounding by the greatest passive force, the same press", "force_bound", "0 N", SAID),
    ("What if: c1 and c2 with 0.14 N of friction", "c1_c2", "0.14 N", [""; 3]),
    ("What if: the greatest passive force with 0.14 N of friction", "force_bound", "0.14 N", [""; 3]),
];

const SAID: [&str; 3] =
    ["larger c1: stiffer, less stable", "stable for larger c1 than without", "enhances stability too"];

/// Physics that the shipped scene does not have, each by itself.
const WHAT_IFS: [(&str, &[(&str, &str)]); 5] = [
    ("What if: 0.05 N of Coulomb friction", &[("device.coulomb", "0.05 N")]),
    ("What if: 0.14 N of Coulomb friction (the device's bound, by general knowledge)", &[("device.coulomb", "0.14 N")]),
    (
        "What if: 0.14 N of Coulomb friction on 37.5 g, which 25 kN/m swings at 130 Hz",
        &[("device.coulomb", "0.14 N"), ("device.mass", "37.5 g")],
    ),
    (
        "What if: counts ten times finer",
        &[("encoder.resolution", "2.2 um"), ("method.position_bits", "14"), ("method.stiffness_format", "(0,13,8)")],
    ),
    (
        "What if: a hand of 1 kN/m and 5 N.s/m besides, led to 2 mm inside",
        &[(
            "hand",
            r#"{ kind = "spring_damper", stiffness = "1 kN/m", damping = "5 N.s/m", path = [[0, 0], ["0.5 s", "7 mm"]] }"#,
        )],
    ),
];

const NOTES: &[&str] = &[
    "The device's parameters are inferred, not published: 63.3 g (from 100 Hz), 12.5 N.s/m (from K = 2b/T), counts of 22 um; the paper \
     gives 8.9 N and 1 kHz. c1 in N.s/m over T = 1 ms is c1 in kN/m. A push of 2 N from 5 mm before the wall; settled is less than a \
     count rms.",
    "Why not threefold: of ripples faster than the filter about a mean push m, H passes all but m, so that y = u - max(0, u - m) = min(u, m): \
     the ripple above the mean is cut off, whatever the stiffness. Were it still a sine, its fundamental would be halved and the \
     stiffness that holds at most doubled (25 to 50 kN/m), at the same frequency. It is not: on the cut side nothing but the friction stops \
     the mass, which swings far there and falls back onto the uncut wall, slower than the plain loop swings; finer counts do not help. \
     Coulomb friction, which the shipped scene leaves out, ends those swings: with the 0.14 N that the device is said to stay below, \
     the ladder gives 35 kN/m without a shaper and 60 with one. A hand does likewise. Named what-ifs, not fits.",
    "130 Hz: with friction 63.3 g chatters near 100 Hz beyond the shaper's limit, as without a shaper; 37.5 g, which 25 kN/m swings at 130 Hz, \
     at 141 Hz without one, at 117 and 97 Hz with: a lighter mass alone does not turn 100 Hz into 130. The paper, too, reads it as less inertia or more stiffness; its block diagram has neither.",
    "Displayed stiffness is what is felt: the slope of force over penetration while pressing (means of 50 ms, 0.5 to 2 s), and the mean \
     force over the mean penetration while held. Of a chattering wall both are means of the chatter.",
    "c1 beyond b/T = 12.5 kN/m promises more damping than the device has: 20 to 50 cannot all have been bounded by this device's own \
     damping, a hand's must have helped.",
];

fn gains(frequency_hz: f64) -> String {
    let (exact, analog) = (gain::exact(frequency_hz), gain::analog(frequency_hz));
    let (digital, words) = (gain::bilinear(frequency_hz), gain::digital(frequency_hz));
    format!("closed form {exact:.8}, analog {analog:.6}; bilinear {digital:.6}, words {words:.6}")
}

/// Returns the lowest wall that was seen to fail and the highest that was seen to settle; `None` when stopped.
fn turn(set: &Set, control: &Control) -> Option<Result<String, String>> {
    let set: Vec<(&str, &str)> = set.iter().map(|(key, value)| (*key, value.as_str())).collect();
    let found = shipped_scene("impulse-engine", &set).and_then(|experiment| {
        let scene = experiment.axis().ok_or("no axis")?;
        WordsSet::new(std::slice::from_ref(&scene), usual_range(&scene), Looks::BRIEF, NonZeroUsize::MIN, control)
    });
    if control.stop.load(Ordering::Relaxed) {
        return None;
    }
    Some(found.map(|found| {
        let told = |seen: Option<Seen>| seen.map_or("none".into(), |seen| format!("{:.3} kN/m", seen.stiffness * 1e-3));
        let (failed, settled) = (told(found.lowest_failed()), told(found.highest_settled()));
        format!("lowest seen to fail {failed}, highest seen to settle {settled} ({} runs)", found.runs())
    }))
}

/// Runs the walls of the ladder. The figures are the last wall that settles below the first that does not, in kN/m, the
/// first wall that does not settle, in kN/m, and the frequency of its chatter, in Hz.
fn ladder(set: &Set, control: &Control) -> Option<Result<Found, String>> {
    let (mut rungs, mut turn) = (Vec::new(), None);
    for k in LADDER_KN_PER_M {
        match made::run("impulse-engine", &with(set, &key("wall.stiffness", format!("{k} kN/m"))), control)? {
            Ok(made) => {
                if !made.settled() && turn.is_none() {
                    let below = rungs.last().map_or(0.0, |(k, ..): &(u32, bool, String)| f64::from(*k));
                    turn = Some([below, f64::from(k), made.frequency_hz().unwrap_or(f64::INFINITY)]);
                }
                rungs.push((k, made.settled(), made.outcome()));
            }
            Err(reason) => return Some(Err(reason)),
        }
    }
    Some(Ok(Found::new(told(&rungs), turn.unwrap_or([f64::INFINITY; 3]))))
}

/// Returns as text up to where the walls settle, what the next one does, and whether any settles beyond.
#[must_use]
pub fn told(rungs: &[(u32, bool, String)]) -> String {
    let Some(first) = rungs.iter().position(|(_, settled, _)| !settled) else {
        return "settles throughout".into();
    };
    let (at, _, outcome) = &rungs[first];
    let below = first.checked_sub(1).map_or("nowhere".into(), |last| format!("up to {} kN/m", rungs[last].0));
    let again: Vec<_> = rungs[first..].iter().filter(|rung| rung.1).map(|rung| rung.0.to_string()).collect();
    let again = if again.is_empty() { String::new() } else { format!("; settles again at {}", again.join(", ")) };
    format!("settles {below}; at {at} {outcome}{again}")
}

fn bounded(form: &str, c1: u32, friction: &str) -> Set {
    vec![
        ("method.form", form.to_string()),
        ("method.c1", format!("{c1} kN/m")),
        ("device.coulomb", friction.to_string()),
        ("record.plant_rate", "1 kHz".into()),
    ]
}

/// Returns the verdict of a press, and the stiffness that was felt. The figures are whether it settles, and the
/// stiffness held, in kN/m.
fn felt(made: &Made) -> Found {
    let pairs: Vec<(f64, f64)> = made.beyond_m().zip(made.pushes_n()).collect();
    let mean = |pairs: &[(f64, f64)]| {
        let sum = pairs.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
        (sum.0 / pairs.len() as f64, sum.1 / pairs.len() as f64)
    };
    let pressing: Vec<_> = pairs[made.row(0.5)..made.row(2.0)].chunks(50).map(mean).collect();
    let (x_m, push_n) = mean(&pairs[pairs.len() - pairs.len() * 3 / 10..]);
    let held_kn_per_m = push_n / x_m * 1e-3;
    let text = format!(
        "{}; displays {:.1} kN/m pressing, {held_kn_per_m:.1} held ({} at {push_n:.2} N)",
        made.outcome(),
        slope(&pressing) * 1e-3,
        length(x_m)
    );
    Found::new(text, [f64::from(u8::from(made.settled())), held_kn_per_m])
}

/// Returns the slope of the straight line through pairs, by least squares.
#[must_use]
pub fn slope(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let (x, y) = pairs.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0 / count, sum.1 + pair.1 / count));
    let [across, square] = pairs.iter().fold([0.0; 2], |[across, square], pair| {
        [across + (pair.0 - x) * (pair.1 - y), square + (pair.0 - x) * (pair.0 - x)]
    });
    across / square
}
