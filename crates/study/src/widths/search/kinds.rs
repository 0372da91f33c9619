//! Designs that are alike in every run.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use hpu_cosim::scene::{Loop, Scene};
use hpu_datapath::{ConventionalLoop, HybridLoop};
use hpu_signal::Format;

use super::case::Case;
use super::climb::Climb;
use super::estimate::estimate;
use super::front::Merit;
use super::knob::{Design, Knob};
use super::memory::{Depth, Gain, Gains, Memory};
use crate::widths::proof::{Held, Limits};

/// All that a design's runs are functions of.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Alike {
    pwm: u32,
    /// The damping of each scene.
    damping: Vec<Gain>,
    /// Integer and fraction bits of the stiffness, which say how stiff and how fine it can be.
    stiffness: (i32, i32),
    depth: Depth,
}

/// Knowledge about equivalent designs on one scene.
struct On {
    /// The scene's own stiffness.
    own: Gain,
    /// SI stiffness of the last bit.
    lsb: f64,
    /// The error, once known.
    error: Option<f64>,
    /// The stable stiffness, as far as it is known; of scenes that differ in nothing else only once.
    climb: Option<Climb>,
}

impl On {
    /// Bounds of the stable stiffness; infinite where another scene's climb decides it.
    fn between(&self) -> [f64; 2] {
        let between = self.climb.as_ref().map(|climb| [climb.least(), climb.most()].map(|word| word as f64 * self.lsb));
        between.unwrap_or([f64::INFINITY; 2])
    }
}

/// Designs that are alike in every run, and what is known of them.
pub(super) struct Kind {
    alike: Alike,
    /// How many designs are alike.
    pub count: usize,
    /// The cheapest of them, and what they cost.
    pub designs: Vec<Design>,
    lut4: u32,
    /// Knowledge on each scene.
    on: Vec<On>,
    /// The worst error of all scenes, once known; infinite as soon as one is above what was asked for.
    pub error: Option<f64>,
    /// Tries of the climbs, and errors that were looked up.
    pub asked: usize,
    /// Whether one of its runs failed.
    pub failed: bool,
}

impl Kind {
    /// The kind of a design.
    ///
    /// # Errors
    ///
    /// Why no scene has it, or which scene does not.
    pub fn new(cases: &[Case], design: Design) -> Result<Self, String> {
        let mut found: Option<Self> = None;
        for case in cases {
            let of = |why: String| if cases.len() > 1 { format!("{}: {why}", case.name) } else { why };
            let scene = design.scene(&case.scene).map_err(of)?;
            let words = scene.words().map_err(|error| of(error.to_string()))?;
            let method = &scene.method;
            let gain = |word: i64, format: Format| Gain::new(word.into(), format.frac().unsigned_abs());
            let kind = match &mut found {
                Some(kind) => kind,
                None => {
                    // Widths that the blocks refuse.
                    HybridLoop::new(words.config).map_err(|error| error.to_string())?;
                    ConventionalLoop::new(words.config).map_err(|error| error.to_string())?;
                    let lut4 = estimate(&words.config, method.kind == Loop::Conventional);
                    found.insert(Self::unknown(&scene, design, lut4))
                }
            };
            let stiffness = method.stiffness_format;
            kind.alike.damping.push(gain(words.damping, method.damping_format));
            kind.on.push(On {
                own: gain(words.stiffness, stiffness),
                lsb: words.realised.torque_quantum_nm / words.realised.count_rad * stiffness.lsb(),
                error: None,
                climb: case.climbs.then(|| Climb::new(words.stiffness.into(), stiffness.max())),
            });
        }
        found.ok_or_else(|| "no scene to run it on".into())
    }

    fn unknown(scene: &Scene, design: Design, lut4: u32) -> Self {
        let method = &scene.method;
        let alike = Alike {
            pwm: method.pwm.bits,
            damping: Vec::new(),
            stiffness: (method.stiffness_format.int(), method.stiffness_format.frac()),
            depth: (method.position_bits, method.velocity_bits),
        };
        Self { alike, count: 1, designs: vec![design], lut4, on: Vec::new(), error: None, asked: 0, failed: false }
    }

    fn gains(&self, case: usize, stiffness: Gain) -> Gains {
        Gains { case, pwm: self.alike.pwm, damping: self.alike.damping[case], stiffness }
    }

    /// The scene whose climb decides next. The stable stiffness is the least of all scenes', so that a climb which is
    /// known to end no lower than another is followed no further.
    fn climbing(&self) -> Option<usize> {
        let lowest = self.on.iter().map(|on| on.between()[1]).fold(f64::INFINITY, f64::min);
        let open = |on: &On| on.climb.as_ref().is_some_and(|climb| climb.next().is_some()) && on.between()[0] < lowest;
        let open = (0..self.on.len()).filter(|&case| open(&self.on[case]));
        open.min_by(|&a, &b| self.on[a].between()[1].total_cmp(&self.on[b].between()[1]))
    }

    /// Follows the climbs as far as runs are known; what they want to know next, if anything.
    pub fn follow(&mut self, memory: &Memory) -> Option<(Gains, Depth)> {
        while let Some(case) = self.climbing() {
            let word = self.on[case].climb.as_ref().and_then(Climb::next)?;
            let gains = self.gains(case, Gain::new(word, self.alike.stiffness.1.unsigned_abs()));
            let Some(ran) = memory.recall(&gains, self.alike.depth) else { return Some((gains, self.alike.depth)) };
            if let Some(climb) = &mut self.on[case].climb {
                climb.told(ran.settled);
            }
            self.asked += 1;
        }
        None
    }

    /// Looks for the errors among known runs; which is wanted, if it is not there. Above `within` it is as good as
    /// infinite, and no other scene is asked.
    pub fn look(&mut self, memory: &Memory, within: f64) -> Option<(Gains, Depth)> {
        let mut worst = 0.0f64;
        for case in 0..self.on.len() {
            let gains = self.gains(case, self.on[case].own);
            let error = match self.on[case].error {
                Some(error) => error,
                None => {
                    let Some(ran) = memory.recall(&gains, self.alike.depth) else {
                        return Some((gains, self.alike.depth));
                    };
                    self.asked += 1;
                    *self.on[case].error.insert(ran.error)
                }
            };
            worst = worst.max(error);
            if worst > within {
                worst = f64::INFINITY;
                break;
            }
        }
        self.error = Some(worst);
        None
    }

    /// The best that the design may still turn out to be.
    pub fn at_best(&self) -> Merit {
        let error = if self.failed { f64::INFINITY } else { self.error.unwrap_or(0.0) };
        let stiffness = self.on.iter().map(|on| on.between()[1]).fold(f64::INFINITY, f64::min);
        Merit { lut4: self.lut4, error, stiffness }
    }

    /// Whether its stable stiffness is known.
    pub fn is_climbed(&self) -> bool {
        self.climbing().is_none()
    }

    /// Whether its stiffness format holds no stiffer wall than the stable one.
    pub fn is_capped(&self) -> bool {
        let stable = self.at_best().stiffness;
        self.on.iter().any(|on| on.between()[0] == stable && on.climb.as_ref().is_some_and(Climb::is_capped))
    }

    /// Stiffness of a full command a count, `2^pwm` PWM counts, in each scene's unit.
    pub fn full_scales(&self) -> Vec<f64> {
        let full = f64::from(self.alike.stiffness.1) + f64::from(self.alike.pwm);
        self.on.iter().map(|on| on.lsb * libm::exp2(full)).collect()
    }

    /// Proved ranges of its words on each scene.
    ///
    /// # Errors
    ///
    /// Which scene's proved range they do not hold, and why.
    pub fn held(&self, cases: &[Case], limits: &[Limits]) -> Result<Vec<Held>, String> {
        let design = self.designs[0];
        let held = cases.iter().zip(limits).map(|(case, limits)| {
            let held = design.scene(&case.scene).and_then(|scene| limits.held(&scene));
            held.map_err(|why| format!("{}: {why}", case.name))
        });
        held.collect()
    }
}

/// Every design of a grid, by its kind; and the reasons why no scene has some, with their numbers.
/// With `limits`, those whose words do not hold the proved ranges are among the latter.
pub(super) fn kinds(
    cases: &[Case],
    knobs: &[Knob],
    designs: usize,
    limits: Option<&[Limits]>,
) -> (Vec<Kind>, Vec<(String, usize)>) {
    let own = Design::of(&cases[0].scene);
    let mut all: BTreeMap<Alike, Kind> = BTreeMap::new();
    let mut refused: BTreeMap<String, usize> = BTreeMap::new();
    for mut index in 0..designs {
        let mut design = own;
        for knob in knobs {
            design = design.with(knob.width, knob.from + (index % knob.values()) as i32);
            index /= knob.values();
        }
        match Kind::new(cases, design) {
            Err(why) => *refused.entry(why).or_default() += 1,
            Ok(kind) => match all.get_mut(&kind.alike) {
                None => drop(all.insert(kind.alike.clone(), kind)),
                Some(known) => {
                    known.count += 1;
                    match kind.lut4.cmp(&known.lut4) {
                        std::cmp::Ordering::Less => (known.lut4, known.designs) = (kind.lut4, kind.designs),
                        std::cmp::Ordering::Equal => known.designs.extend(kind.designs),
                        std::cmp::Ordering::Greater => {}
                    }
                }
            },
        }
    }
    if let Some(limits) = limits {
        all.retain(|_, kind| match kind.held(cases, limits) {
            Ok(_) => true,
            Err(why) => {
                *refused.entry(why).or_default() += kind.count;
                false
            }
        });
    }
    let mut refused: Vec<_> = refused.into_iter().collect();
    refused.sort_by_key(|(_, count)| Reverse(*count));
    (all.into_values().collect(), refused)
}
