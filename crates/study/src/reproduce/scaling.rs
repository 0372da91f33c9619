//! A power-scaled spring: its two published figures by both readings of the law, compared with closed forms.

use std::f64::consts::PI;

use hpu_cosim::Control;

use super::beside::{Claim, Comparison, Found, Line, Measure, measure};
use super::made::{self, Made, Set, key, length, with};
use super::summing::Statement;

const SCENE: &str = "power-scaling";

/// How the spring's force is computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Spring {
    /// The energy-level spring in fixed-point words.
    Words,
    /// The energy-level spring in floats.
    Law,
    /// A plain spring, sampled and held, in fixed-point words.
    Plain,
}

impl Spring {
    fn name(self) -> &'static str {
        match self {
            Self::Words => "energy-level spring",
            Self::Law => "the same in floats",
            Self::Plain => "plain spring, held",
        }
    }

    fn set(self) -> Set {
        match self {
            Self::Words => Vec::new(),
            Self::Law => key("model.datapath", "law"),
            Self::Plain => plain("1 kHz"),
        }
    }
}

fn plain(rate: &str) -> Set {
    let words = r#"position_bits = 22, velocity_bits = 22, stiffness_format = "(0,9,14)", pwm = { bits = 20 }"#;
    key("method", format!(r#"{{ kind = "conventional", sample_rate = "{rate}", {words} }}"#))
}

/// Returns a ramp that begins at 10 s.
fn ramp(what: &str, seconds: f64) -> Set {
    key("wall.ramp", format!("{{ {what}, from = 10, to = {} }}", 10.0 + seconds))
}

/// Returns the length, in s, of a straight ramp of the scale that has the same impulse as the scale `1/beta` while
/// `beta` goes straight from 1 to `to` in `seconds`: `2 ln(to) / (to - 1)` times `seconds`.
#[must_use]
pub fn equal_impulse_s(to: f64, seconds: f64) -> f64 {
    2.0 * libm::log(to) / (to - 1.0) * seconds
}

/// A scale by the factor of Fig. 3.
const FORTY: &str = "scale = 40";

/// Returns the paper's statements beside the emulator's results.
#[must_use]
pub fn comparison() -> Comparison {
    let mut lines = Vec::new();
    let mut line = |claims, group, what: String, published, measure: Measure| {
        lines.push(Line { group, what, published, claims, measure });
    };
    let swing = |set: Set| measure(move |control| Some(run(&set, control)?.map(|made| motion(&made))));
    for seconds in [1.0, 5.0] {
        for spring in [Spring::Words, Spring::Law, Spring::Plain] {
            let set = with(&ramp(r#"stiffness = "400 N/m""#, seconds), &spring.set());
            line("a", "Fig. 3: k from 10 to 400 N/m", within(spring, seconds), "unstable", swing(set));
        }
    }
    for seconds in [1.0, 5.0] {
        for spring in [Spring::Words, Spring::Law] {
            let ramp_s = equal_impulse_s(1e3, seconds);
            let set = with(&thousandth(ramp_s), &spring.set());
            line(
                "bc",
                "Fig. 4 as printed, e_c = e_d/beta, beta from 1 to 1000",
                format!(
                    "{}, run as a straight ramp of {:.1} ms of equal impulse",
                    within(spring, seconds),
                    1e3 * ramp_s
                ),
                "stable, back at x = 0",
                swing(set),
            );
        }
    }
    for seconds in [1.0, 5.0] {
        for spring in [Spring::Words, Spring::Law] {
            let set = with(&thousandth(seconds), &spring.set());
            line("", "The scale itself straight from 1 to 1/1000", within(spring, seconds), "", swing(set));
        }
    }
    for seconds in [1.0, 5.0] {
        for spring in [Spring::Words, Spring::Law] {
            let fine = key("method.scale_format", "(0,10,10)");
            let set = [ramp("scale = 1000", seconds), fine, spring.set()].concat();
            line(
                "bc",
                "Fig. 4 the other way, e_c = beta e_d, beta from 1 to 1000",
                within(spring, seconds),
                "stable, back at x = 0",
                swing(set),
            );
        }
    }
    for seconds in [1.0, 5.0] {
        for spring in [Spring::Words, Spring::Law] {
            let set = with(&ramp(FORTY, seconds), &spring.set());
            line(
                "d",
                "The factor of Fig. 3 as a scale: beta from 1 to 1/40",
                within(spring, seconds),
                "stable",
                swing(set),
            );
        }
    }
    const SAME: &str = "k times 40 against scale times 40: greatest distance";
    for seconds in [1.0, 5.0] {
        for spring in [Spring::Words, Spring::Law] {
            line(
                "e",
                SAME,
                within(spring, seconds),
                "0 but for rounding (derived)",
                measure(move |control| same(spring, seconds, control)),
            );
        }
    }
    const SMALL: &str =
        "A swing of 2 cm about rest that stays in the fixture: k from 100 to 400 N/m in 20 s, gain in energy";
    for (name, set, hold_s) in [("plain, 10 kHz", plain("10 kHz"), 1e-4), ("energy-level, 1 kHz", Vec::new(), 1e-3)] {
        let derived = "2 = sqrt(4) (derived), without friction and hold (for 40: 6.32)";
        line("", SMALL, name.into(), derived, measure(move |control| adiabatic(&set, hold_s, control)));
    }
    const RATES: &str = "A swing of 5 mm about rest at k = 400 N/m: growth of its amplitude, a second";
    for (name, set, growth) in [
        ("plain, T = 1 ms", plain("1 kHz"), "+0.05: kT/4m - b/2m (derived)"),
        ("plain, T = 0.25 ms", plain("4 kHz"), "-0.025 (derived)"),
        ("energy-level, T = 1 ms", Vec::new(), ""),
    ] {
        line(
            "",
            RATES,
            name.into(),
            growth,
            measure(move |control| Some(growth_of(&set, control)?.map(|g| format!("{g:+.4}")))),
        );
    }
    line(
        "",
        RATES,
        "plain: where it is 0".into(),
        "T = 2b/k = 0.5 ms (derived)",
        measure(|control| {
            let slow = growth_of(&plain("1 kHz"), control)?;
            let fast = growth_of(&plain("4 kHz"), control)?;
            Some(slow.and_then(|slow| {
                let fast = fast?;
                Ok(format!("T = {:.3} ms, on the line through the two above", 0.25 + 0.75 * fast / (fast - slow)))
            }))
        }),
    );
    const ARM: &str = "What if: an arm of 100 N/m and 10 N.s/m, led to 1.1 m, pulls the 10 N";
    let arm = r#"{ kind = "spring_damper", stiffness = "100 N/m", damping = "10 N.s/m", path = [[0, 1.1]] }"#;
    for (name, what) in [("k from 10 to 400 N/m, 1 s", r#"stiffness = "400 N/m""#), ("scale from 1 to 40, 1 s", FORTY)]
    {
        line("", ARM, name.into(), "", swing(with(&ramp(what, 1.0), &key("hand", arm))));
    }
    let title = "Power scaling of a port-Hamiltonian interconnection";
    Comparison { name: "power-scaling", title, lines, claims: claims(), notes: NOTES }
}

/// Returns the paper's claims.
fn claims() -> Vec<Claim> {
    let claim =
        |letter, paper, place, means, judge| Claim { statement: Statement { letter, paper, place, means }, judge };
    vec![
        claim(
            "a",
            "In Fig. 3 the stiffness is changed linearly from 10 N/m to 400 N/m [...]; the overall behavior is \
             unstable",
            "Sec. V",
            "the mass does not settle, for ramps of 1 s and 5 s, by three springs",
            |found| each_of(found, |figures| figures[0] == 0.0),
        ),
        claim(
            "b",
            "even if the force scaling factor is much bigger than that implemented with the stiffness variation, the \
             behavior of the overall system is stable",
            "Sec. V, Fig. 4",
            "the mass settles, by both readings of the scaling, for ramps of 1 s and 5 s",
            |found| each_of(found, |figures| figures[0] == 1.0),
        ),
        claim(
            "c",
            "In order to take back the user to the fixture position, it is necessary to scale the force \
             transmitted to the user",
            "Sec. V, Fig. 4",
            "the mass ends within 0.1 m of x = 0, from 1 m, by both readings",
            |found| each_of(found, |figures| figures[1].abs() < 0.1),
        ),
        claim(
            "d",
            "embed both velocity and force scaling while preserving the passivity, and therefore a stable behavior, of the \
             overall system",
            "Sec. VI",
            "the mass settles when the force is scaled by the factor of Fig. 3",
            |found| each_of(found, |figures| figures[0] == 1.0),
        ),
        claim(
            "e",
            "The instability is related to the variation of the stiffness",
            "Sec. V",
            "scaling the force by 40 moves the mass otherwise than 40 times the stiffness, by over 1 mm before it leaves \
             the fixture",
            |found| each_of(found, |figures| figures[0] > 1e-3),
        ),
    ]
}

fn each_of(found: &[&Found], so: impl Fn(&[f64]) -> bool) -> Vec<bool> {
    found.iter().map(|found| so(&found.figures)).collect()
}

const NOTES: &[&str] = &[
    "Not given, and assumed: T = 1 ms; ramps of 1 s and 5 s from 10 s on; the user goes on with the same 10 N; counts of 0.2 mm; 20 s. m = 1 kg, \
     b = 0.1 N.s/m, 10 N and 1 m are the paper's.",
    "beta goes straight from 1 to 1000; the force goes by 1/beta, a hyperbola, which has lost half of it after a thousandth of the ramp. The wall's \
     ramp is straight in the scale: it is run here in the time that gives the mass the same impulse, 13.8 ms for a ramp of 1 s.",
    "As printed, beta above 1 weakens the spring: the user is not taken back to x = 0 but runs away (bilateral spring, in closed \
     form: 341 m at 20 s for 1 s, 335 m for 5 s). To pull harder, beta must fall, or e_c = beta e_d.",
    "A linear spring of k scaled by c is a spring of ck: Fig. 3 and Fig. 4 cannot differ for the same ramp. What energy a ramp adds, it adds \
     by either: Proposition 2 asks for finitely many critical points of the spring's energy, and a swing has no end of them.",
    "The energy-level spring is passive, sample by sample, yet a swing about rest grows with it as with a plain one: what it loses against a \
     spring that follows, k dx^2/2 a sample, moves its rest towards the user, whose constant 10 N pays for the swing.",
    "Where a plain spring ceases to grow is T = 2(b/k - t): some 4 clocks of 1 us pass from the encoder's edge to the force, 8 us off 0.5 ms.",
    "A slow ramp is slow but for its beginning: rest moves at once, and adds 1.5 mm to the swing of 2 cm, or takes them off (15 % of energy).",
    "The fixture here pushes to one side only, as a datapath's wall does: the swing that the ramp feeds leaves it at x = 0 and comes back by the \
     user's pull. The energy-level spring is dead at x = 0 (its energy is gone, and with it its sign): it engages again at the surface, by \
     what it finds there. Trajectories agree to rounding until it is first left; after that a count at the surface decides anew.",
];

fn within(spring: Spring, seconds: f64) -> String {
    format!("{}, {seconds} s", spring.name())
}

/// Returns a ramp of the scale from 1 to a thousandth.
fn thousandth(seconds: f64) -> Set {
    with(&ramp("scale = 0.001", seconds), &key("method.scale_format", "(0,2,18)"))
}

fn run(set: &Set, control: &Control) -> Option<Result<Made, String>> {
    made::run(SCENE, &with(&key("record.plant_rate", "1 kHz"), set), control)
}

/// Returns the index of the first row beyond the wall's other side, or of the last row if there is none.
fn leaves(made: &Made) -> usize {
    let after = made.row(10.0);
    let rows = made.trace.angles_rad().len();
    made.beyond_m().skip(after).position(|x| x < 0.0).map_or(rows - 1, |row| after + row)
}

/// Describes a motion. The figures are whether it settles, and where it ends, in m.
fn motion(made: &Made) -> Found {
    let angles = made.trace.angles_rad();
    let tail = &angles[angles.len() - angles.len() * 3 / 10..];
    let low = tail.iter().copied().fold(f64::INFINITY, f64::min);
    let high = tail.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let left = leaves(made);
    let left = match left + 1 == angles.len() {
        true => "never leaves it".into(),
        false => format!("first leaves it at {:.2} s", made.trace.time_s(left)),
    };
    let most_n = made.pushes_n().fold(0.0, f64::max);
    let end_m = angles[angles.len() - 1];
    let [last, low, high] = [end_m, low, high].map(length);
    let text =
        format!("{}; {low} to {high} in the last 6 s, ends at {last}; {left}; up to {most_n:.0} N", made.outcome());
    Found::new(text, [f64::from(u8::from(made.settled())), end_m])
}

/// Returns the greatest distance between the mass under the ramp of stiffness and under the ramp of scale, until the
/// mass first leaves the wall (the figure, in m) and to the end.
fn same(spring: Spring, seconds: f64, control: &Control) -> Option<Result<Found, String>> {
    let stiffness = run(&with(&ramp(r#"stiffness = "400 N/m""#, seconds), &spring.set()), control)?;
    let scale = run(&with(&ramp(FORTY, seconds), &spring.set()), control)?;
    Some(stiffness.and_then(|stiffness| {
        let scale = scale?;
        let apart = |rows: usize| {
            let pairs = stiffness.trace.angles_rad().iter().zip(scale.trace.angles_rad()).take(rows);
            pairs.fold(0.0, |most: f64, (one, other)| most.max((one - other).abs()))
        };
        let left = leaves(&stiffness).min(leaves(&scale));
        let time_s = stiffness.trace.time_s(left);
        let (until_m, to_the_end) = (apart(left), length(apart(usize::MAX)));
        let text = format!("{} until it leaves the fixture at {time_s:.2} s, {to_the_end} to the end", length(until_m));
        Ok(Found::new(text, [until_m]))
    }))
}

/// Returns half of the range of positions from one time to another, in m.
fn amplitude_m(made: &Made, from_s: f64, to_s: f64) -> f64 {
    let window = &made.trace.angles_rad()[made.row(from_s)..made.row(to_s)];
    let ends = window.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |ends, &x| (ends.0.min(x), ends.1.max(x)));
    0.5 * (ends.1 - ends.0)
}

/// Returns by what factor a slow ramp changes the energy of a small swing, as measured, and without the effect of
/// friction (`e^(-bt/m)`) and of the hold (`e^(∫kT/2m)`).
fn adiabatic(set: &Set, hold_s: f64, control: &Control) -> Option<Result<String, String>> {
    let start = [
        ("device.initial_position", "0.12 m"),
        ("encoder.resolution", "20 um"),
        ("wall.stiffness", "100 N/m"),
        ("wall.ramp", r#"{ stiffness = "400 N/m", from = 1, to = 21 }"#),
        ("run.duration", "22 s"),
    ];
    let start = start.map(|(key, value)| (key, value.to_string())).to_vec();
    Some(run(&with(&start, set), control)?.map(|made| {
        // The amplitudes are those of a whole period before the ramp and a whole period after it; their middles count.
        let (slow_s, fast_s) = (2.0 * PI / 10.0, 2.0 * PI / 20.0);
        let before = amplitude_m(&made, 1.0 - slow_s, 1.0);
        let after = amplitude_m(&made, 21.0, 21.0 + fast_s);
        let gain = 4.0 * (after / before).powi(2);
        let friction = libm::exp(-0.1 * (20.0 + 0.5 * (slow_s + fast_s)));
        let hold = libm::exp(0.5 * hold_s * (250.0 * 20.0 + 50.0 * slow_s + 200.0 * fast_s));
        format!("{gain:.3}; {:.2} without friction and hold", gain / friction / hold)
    }))
}

/// Returns the growth of a swing's amplitude at 400 N/m, in 1/s, from the ranges of whole periods 8 s apart.
fn growth_of(set: &Set, control: &Control) -> Option<Result<f64, String>> {
    let start = [
        ("device.initial_position", "30 mm"),
        ("encoder.resolution", "2 um"),
        ("wall.stiffness", "400 N/m"),
        ("wall.ramp", r#"{ stiffness = "400 N/m", from = 1, to = 2 }"#),
        ("run.duration", "10 s"),
    ];
    let start = start.map(|(key, value)| (key, value.to_string())).to_vec();
    Some(run(&with(&start, set), control)?.map(|made| {
        let period_s = 2.0 * PI / 20.0;
        let (early, late) = (amplitude_m(&made, 1.0, 1.0 + period_s), amplitude_m(&made, 9.0, 9.0 + period_s));
        libm::log(late / early) / 8.0
    }))
}
