//! Groups designs that are alike in every run.

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

/// The values that determine all runs of a design.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Alike {
    pwm: u32,
    /// The damping on each scene.
    damping: Vec<Gain>,
    /// Integer and fraction bits of the stiffness, which give its range and resolution.
    stiffness: (i32, i32),
    depth: Depth,
}

/// The knowledge about a kind on one scene.
struct On {
    /// The scene's own stiffness.
    own: Gain,
    /// Stiffness of the last bit, in SI units.
    lsb: f64,
    /// The error, once known.
    error: Option<f64>,
    /// The climb to the stable stiffness; only one of the scenes that differ in nothing else has one.
    climb: Option<Climb>,
}

impl On {
    /// Returns bounds of the stable stiffness; infinite where another scene's climb decides it.
    fn between(&self) -> [f64; 2] {
        let between = self.climb.as_ref().map(|climb| [climb.least(), climb.most()].map(|word| word as f64 * self.lsb));
        between.unwrap_or([f64::INFINITY; 2])
    }
}

/// Designs that are alike in every run, with their known figures.
pub(super) struct Kind {
    alike: Alike,
    /// How many designs are alike.
    pub count: usize,
    /// The cheapest designs, and their cost.
    pub designs: Vec<Design>,
    lut4: u32,
    /// The knowledge on each scene.
    on: Vec<On>,
    /// The worst error of all scenes, once known; infinite as soon as one is above the limit.
    pub error: Option<f64>,
    /// The number of tries of the climbs and of errors looked up.
    pub asked: usize,
    /// Whether one of its runs failed.
    pub failed: bool,
}

impl Kind {
    /// Makes the kind of a design.
    ///
    /// # Errors
    ///
    /// Why no scene can have the design, or which scene cannot.
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
                    // Some widths are refused by the blocks.
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

    /// Returns the scene whose climb decides next. The stable stiffness is the least of all scenes, so a climb that is
    /// known to end no lower than another is not continued.
    fn climbing(&self) -> Option<usize> {
        let lowest = self.on.iter().map(|on| on.between()[1]).fold(f64::INFINITY, f64::min);
        let open = |on: &On| on.climb.as_ref().is_some_and(|climb| climb.next().is_some()) && on.between()[0] < lowest;
        let open = (0..self.on.len()).filter(|&case| open(&self.on[case]));
        open.min_by(|&a, &b| self.on[a].between()[1].total_cmp(&self.on[b].between()[1]))
    }

    /// Continues the climbs as far as runs are known. Returns the run that they need next, if any.
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

    /// Looks up the errors among known runs. Returns the run that is missing, if any. An error above `within` counts as
    /// infinite, and no further scene is asked.
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

    /// Returns the best figures that the design can still have.
    pub fn at_best(&self) -> Merit {
        let error = if self.failed { f64::INFINITY } else { self.error.unwrap_or(0.0) };
        let stiffness = self.on.iter().map(|on| on.between()[1]).fold(f64::INFINITY, f64::min);
        Merit { lut4: self.lut4, error, stiffness }
    }

    /// Returns whether its stable stiffness is known.
    pub fn is_climbed(&self) -> bool {
        self.climbing().is_none()
    }

    /// Returns whether its stiffness format holds no stiffer wall than the stable one.
    pub fn is_capped(&self) -> bool {
        let stable = self.at_best().stiffness;
        self.on.iter().any(|on| on.between()[0] == stable && on.climb.as_ref().is_some_and(Climb::is_capped))
    }

    /// Returns the stiffness at which one count gives a full command, `2^pwm` PWM counts, in each scene's unit.
    pub fn full_scales(&self) -> Vec<f64> {
        let full = f64::from(self.alike.stiffness.1) + f64::from(self.alike.pwm);
        self.on.iter().map(|on| on.lsb * libm::exp2(full)).collect()
    }

    /// Returns the proved ranges of its words on each scene.
    ///
    /// # Errors
    ///
    /// The scene whose proved range the words do not hold, and why.
    pub fn held(&self, cases: &[Case], limits: &[Limits]) -> Result<Vec<Held>, String> {
        let design = self.designs[0];
        let held = cases.iter().zip(limits).map(|(case, limits)| {
            let held = design.scene(&case.scene).and_then(|scene| limits.held(&scene));
            held.map_err(|why| format!("{}: {why}", case.name))
        });
        held.collect()
    }
}

/// Returns the designs of a grid by kind, and the reasons why no scene can have some designs, with their numbers. With
/// `limits`, designs whose words do not hold the proved ranges are refused too.
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
