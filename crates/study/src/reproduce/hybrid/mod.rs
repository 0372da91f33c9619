//! Vasudevan et al. 2007: the hybrid loop compared with the conventional one, and the statements about a braking bridge
//! and two sampling rates on the pages that cite the paper.

mod bridge;
mod claims;
mod damping;
mod rates;
mod stiffness;
mod words;

use std::fmt;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use hpu_cosim::Control;
use hpu_cosim::scene::Scene;

use super::beside::{Comparison, Found, Line, shipped_scene};
use crate::limits::{Looks, WordsSet, usual_range};

/// Returns the published statements beside the emulator's results.
#[must_use]
pub fn comparison() -> Comparison {
    let groups = [stiffness::lines(), damping::lines(), bridge::lines(), rates::lines(), words::lines()];
    Comparison {
        name: "hybrid-loop",
        title: "Vasudevan et al. 2007: the hybrid loop against the conventional one",
        lines: groups.into_iter().flatten().collect(),
        claims: claims::claims(),
        notes: &[
            "Assumed: R 2.346 Ohm, L 0.226 mH, K 25.9 mN.m/A, J 1.37e-6 kg.m2, b 1.3e-6 N.m.s/rad, no Coulomb friction: the \
             motor's sheet was not at hand, the paper fixes K U/R = 265 mN.m alone. The hybrid limit goes with 1/L.",
            "Hands: the paper names none. \"Pushed\" is a constant torque into the wall; \"leaning\" the shipped scenes' spring \
             and damper (0.3 N.m/rad, 0.1 mN.m.s/rad), which strikes twice and leans. In words a wall holds when the run's last \
             0.6 s of 2 s have an rms below one count; stiffnesses are words of (0,8,4). A search finds one stiffness at which \
             that verdict turns; it need not be the only one.",
            "Linear limits are of a bilateral contact without counts or saturation. The spring in words of a loop that is \
             \"continuous\" waits for the PWM's period, 4096 clocks: what the clock makes of the hybrid loop.",
            "A floating bridge opens all four switches in the PWM's off phase: the current returns through the diodes against the \
             supply, then ceases, and nothing brakes. The same duty then makes less torque, so a word is a softer and a bent \
             spring; \"felt\" is torque over depth at rest in the stiffest wall that holds. The citing page does not say how its \
             undamped motor was driven, nor what else damped it.",
            "Two rates: the published device is not known. The motor's PWM has a period of 41 us at 100 MHz. The inertia is a mass \
             whose kg, m and N are kg.m2, rad and N.m: 2e-3 kg.m2, 5e-3 N.m.s/rad, 5 mN.m of Coulomb friction, 20000 counts a \
             turn and 20 N.m, all assumed, pushed by 0.5 N.m. The published benefit does not come out: linear, the slow \
             rate's lag only costs; in words, a count's kick is damping times count at either rate as long as the torque \
             holds it. The published 0.1 and 1 N.m.s/rad are as far apart as the rates, and so are the dampings from which one \
             count a sample asks for all torque: which hints at a word or an amplifier that overflowed. What else that device \
             had, a lagging amplifier, a flexible drive, another verdict, is not modelled.",
        ],
    }
}

/// Returns a line whose measurement is discarded if it was stopped meanwhile.
fn line<F: Into<Found>>(
    group: &'static str,
    what: impl Into<String>,
    published: &'static str,
    measure: impl Fn(&Control) -> Result<F, String> + Sync + 'static,
) -> Line {
    let measure = move |control: &Control| {
        let found = measure(control).map(Into::into);
        (!control.stop.load(Ordering::Relaxed)).then_some(found)
    };
    Line { group, what: what.into(), published, claims: "", measure: Box::new(measure) }
}

/// Returns a shipped scene of an axis under overrides.
fn axis(name: &str, set: &[(&str, &str)]) -> Result<Scene, String> {
    shipped_scene(name, set)?.axis().ok_or_else(|| format!("{name} is no axis"))
}

/// The force that leans on the wall.
#[derive(Clone, Copy)]
enum Leaning {
    /// A constant torque, in mN·m.
    Push(u32),
    /// The hand of the shipped scene.
    Shipped,
}

impl Leaning {
    fn text(self) -> String {
        match self {
            Self::Push(torque_mnm) => format!("pushed by {torque_mnm} mN.m"),
            Self::Shipped => "leaning".into(),
        }
    }

    /// Returns a shipped wall without damping, with its stiffness in fine words and with this hand, under further
    /// overrides.
    fn scene(self, name: &str, set: &[(&str, &str)]) -> Result<Scene, String> {
        let mut all = vec![("wall.damping", "0"), ("method.stiffness_format", "(0,8,4)")];
        let hand;
        if let Self::Push(torque_mnm) = self {
            hand = format!("{{ kind = \"constant_torque\", torque = \"{torque_mnm} mN.m\" }}");
            all.extend([("hand", hand.as_str()), ("wall.position", "0.05 rad")]);
        }
        all.extend(set);
        axis(name, &all)
    }
}

/// The stiffest walls in fixed-point words, in N·m/rad.
#[derive(Clone, Copy)]
struct Stiffest {
    /// All stiffnesses that were run up to this one settle at every phase of the contact.
    all: f64,
    /// No stiffer wall was seen to settle.
    some: f64,
}

impl Stiffest {
    fn of(scene: &Scene, control: &Control) -> Result<Self, String> {
        let found =
            WordsSet::new(std::slice::from_ref(scene), usual_range(scene), Looks::BRIEF, NonZeroUsize::MIN, control)?;
        match (found.all_up_to(), found.highest_settled()) {
            (Some(all), Some(some)) => Ok(Self { all: all.stiffness, some: some.stiffness }),
            _ => Err("none settles at every phase".into()),
        }
    }

    /// Returns how many times as stiff the wall is as another: the least and the greatest ratio that both ranges allow.
    fn over(self, other: Self) -> [f64; 2] {
        [self.all / other.some, self.some / other.all]
    }
}

impl fmt::Display for Stiffest {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:.3} to {:.3}", self.all, self.some)
    }
}
