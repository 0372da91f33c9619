//! The proved properties of the scenes of a page: the ranges of all scenes together, the limits and the first overflow
//! of each scene by itself.

use std::fmt::Write as _;

use hpu_cosim::scene::Experiment;
use hpu_prove::ranges::{Bound, How, Limit, WrapsAt};
use hpu_study::Error;
use hpu_study::device;
use hpu_study::widths::Measured;
use serde_json::{Value, json};

use crate::widths::digits::digits;

/// The most scenes whose limits fit on a page.
const MOST_SCENES: usize = 2;

/// The proved properties of all scenes.
pub struct Proved {
    /// The widest range of every net.
    pub bounds: Vec<Bound>,
    /// The limits and the first overflow of each scene.
    pub scenes: Vec<OfScene>,
}

/// The proved properties of one scene.
pub(crate) struct OfScene {
    name: String,
    limits: Vec<Limit>,
    overflow: Option<Overflow>,
}

/// Where the spring's product first overflows its word, compared with the run.
struct Overflow {
    at: WrapsAt,
    /// The unit of a stiffness.
    unit: &'static str,
    /// The stiffness as a word, and the deepest penetration of the run in counts.
    run: Option<[i64; 2]>,
}

/// Returns the proved properties of all scenes. `runs` are the runs of these scenes.
///
/// # Errors
///
/// The reason why nothing is proved.
pub fn proved(experiments: &[Experiment], runs: &[Measured]) -> Result<Proved, Error> {
    let mut all = Proved { bounds: Vec::new(), scenes: Vec::new() };
    for (experiment, run) in experiments.iter().zip(runs) {
        let proof = device(experiment).bounds()?;
        for bound in proof.bounds {
            match all.bounds.iter_mut().find(|other| other.name == bound.name) {
                None => all.bounds.push(bound),
                Some(other) => widen(other, &bound, &experiment.name),
            }
        }
        let overflow = proof.wraps_at.map(|at| Overflow { at, unit: unit(experiment), run: depth(run) });
        all.scenes.push(OfScene { name: experiment.name.clone(), limits: proof.limits, overflow });
    }
    if all.bounds.is_empty() { Err("nothing is proved of this wiring".into()) } else { Ok(all) }
}

/// Widens a bound to include the bound of another scene.
fn widen(all: &mut Bound, bound: &Bound, scene: &str) {
    all.min = all.min.min(bound.min);
    all.max = all.max.max(bound.max);
    all.error = all.error.zip(bound.error).map(|(one, two)| one.max(two));
    all.never_overflows &= bound.never_overflows;
    if bound.how != How::Exhausted {
        all.how = bound.how;
    }
    for said in &bound.assumptions {
        if !all.assumptions.contains(said) {
            all.assumptions.push(format!("{scene}: {said}"));
        }
    }
}

fn unit(experiment: &Experiment) -> &'static str {
    match experiment {
        Experiment::Axis(scene) if scene.device.units().position == "m" => "N/m",
        _ => "N.m/rad",
    }
}

/// Returns the stiffness as a word, and the deepest penetration of a run.
fn depth(run: &Measured) -> Option<[i64; 2]> {
    let most = |name: &str| Some(run.row(name)?.measured?.1);
    Some([most("stiffness")?, most("penetration")?])
}

impl Overflow {
    /// Returns whether the run went deep enough for the overflow.
    fn was_reached(&self) -> Option<bool> {
        let [_, deepest] = self.run?;
        Some(self.at.at_scene.is_some_and(|at| deepest >= at))
    }

    fn of_word(&self, word: i64) -> String {
        format!("{word} ({} {})", digits(word as f64 * self.at.of_a_word), self.unit)
    }

    /// Returns a line with the proved overflow, and one for the scene's own stiffness.
    fn lines(&self) -> Vec<String> {
        let WrapsAt { penetration, word, at_scene, at_rest, reached, .. } = self.at;
        let mut lines = vec![match word {
            None => format!("fits for every stiffness, as {penetration} counts are the deepest; proved"),
            Some(word) => {
                let first = if reached { "first overflows at" } else { "may overflow from" };
                let rest = at_rest.map(|word| format!("; this push overflows at rest from {} on", self.of_word(word)));
                let rest = rest.unwrap_or_default();
                format!("{first} stiffness word {}, {penetration} counts deep{rest}; proved", self.of_word(word))
            }
        }];
        if let Some([word, deepest]) = self.run {
            let word = self.of_word(word);
            lines.push(match at_scene {
                None => format!("at the scene's word {word} no depth overflows (proved)"),
                Some(at) => {
                    let did = if deepest >= at { "and overflowed" } else { "and did not overflow" };
                    format!(
                        "at the scene's word {word} it overflows from {at} counts on (proved); the run went {deepest} \
                         deep {did} (measured)"
                    )
                }
            });
        }
        lines
    }

    fn json(&self) -> Value {
        let word = |word: Option<i64>| {
            word.map(|word| json!({ "word": word, "stiffness": word as f64 * self.at.of_a_word, "unit": self.unit }))
        };
        json!({
            "how": how(How::Proved),
            "penetration": self.at.penetration,
            "penetration_is_reached": self.at.reached,
            "from": word(self.at.word),
            "at_rest_from": word(self.at.at_rest),
            "at_scene": word(self.run.map(|run| run[0])),
            "at_scene_from_penetration": self.at.at_scene,
            "measured_penetration": self.run.map(|run| run[1]),
            "measured_overflow": self.was_reached(),
        })
    }
}

impl Proved {
    /// Returns the bound of a net, if there is one.
    pub fn of(&self, net: &str) -> Option<&Bound> {
        self.bounds.iter().find(|bound| bound.name == net)
    }

    /// Returns limits and first overflows, one a line.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for scene in self.scenes.iter().take(MOST_SCENES) {
            let of = if self.scenes.len() > 1 { format!("{}: ", scene.name) } else { String::new() };
            let limits = scene.limits.iter();
            let limits: Vec<_> = limits
                .map(|Limit { name, unit, min, max, .. }| format!("{name} {}..{} {unit}", digits(*min), digits(*max)))
                .collect();
            if !limits.is_empty() {
                lines.push(format!("device's limits: {of}{}; proved", limits.join(", ")));
            }
            let overflow = scene.overflow.iter().flat_map(Overflow::lines);
            lines.extend(overflow.map(|said| format!("spring's product: {of}{said}")));
        }
        if let Some(more @ 1..) = self.scenes.len().checked_sub(MOST_SCENES) {
            lines.push(format!("of {more} scenes more in the JSON"));
        }
        lines
    }

    /// Returns the limits and first overflow of every scene as JSON.
    pub fn json(&self) -> Value {
        let limit = |limit: &Limit| {
            let (Limit { name, unit, min, max, why }, how) = (limit, how(How::Proved));
            json!({ "name": name, "unit": unit, "min": min, "max": max, "how": how, "why": why })
        };
        let scene = |scene: &OfScene| {
            json!({
                "scene": scene.name,
                "limits": scene.limits.iter().map(limit).collect::<Vec<_>>(),
                "spring_overflows": scene.overflow.as_ref().map(Overflow::json),
            })
        };
        self.scenes.iter().map(scene).collect()
    }

    /// Returns limits and first overflows as a table. Unknown values are empty.
    pub fn csv(&self) -> String {
        let mut text = String::from("scene,limit,unit,min,max,how,why\n");
        let mut row = |scene: &str, cells: [&str; 6]| {
            let _ = writeln!(text, "{scene},{}", cells.join(","));
        };
        for OfScene { name, limits, overflow } in &self.scenes {
            for Limit { name: of, unit, min, max, why } in limits {
                row(name, [of, unit, &min.to_string(), &max.to_string(), "proved", &format!("\"{why}\"")]);
            }
            let Some(overflow) = overflow else { continue };
            let at = &overflow.at;
            let number = |value: Option<i64>| value.map_or_else(String::new, |value| value.to_string());
            let stiffness =
                |word: Option<i64>| word.map_or_else(String::new, |word| (word as f64 * at.of_a_word).to_string());
            let measured = number(overflow.run.map(|run| run[1]));
            row(name, ["penetration", "counts", "0", &at.penetration.to_string(), "proved", ""]);
            row(name, ["penetration", "counts", "", &measured, "measured", ""]);
            let mut from = |of, unit, least: String, why| row(name, [of, unit, &least, "", "proved", why]);
            from("overflow from word", "", number(at.word), "\"at the deepest penetration\"");
            from("overflow from stiffness", overflow.unit, stiffness(at.word), "\"at the deepest penetration\"");
            from("overflow at rest from word", "", number(at.at_rest), "\"the hand pushes on\"");
            from("overflow at rest from stiffness", overflow.unit, stiffness(at.at_rest), "\"the hand pushes on\"");
            from("overflow from penetration", "counts", number(at.at_scene), "\"at the scene's stiffness\"");
        }
        text
    }
}

/// Returns the word for the way in which a figure was found.
pub fn how(how: How) -> &'static str {
    match how {
        How::Measured => "measured",
        How::Exhausted => "exhausted",
        How::Proved => "proved",
    }
}
