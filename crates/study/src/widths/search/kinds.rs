//! Designs that are alike in every run.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use hpu_cosim::scene::{Loop, Scene};
use hpu_datapath::{ConventionalLoop, HybridLoop};
use hpu_signal::Format;

use super::climb::Climb;
use super::estimate::estimate;
use super::front::Merit;
use super::knob::{Design, Knob};
use super::memory::{Depth, Gain, Gains, Memory};

/// All that a design's runs are functions of.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Alike {
    pwm: u32,
    damping: Gain,
    /// Integer and fraction bits of the stiffness, which say how stiff and how fine it can be.
    stiffness: (i32, i32),
    depth: Depth,
}

/// Designs that are alike in every run, and what is known of them.
pub(super) struct Kind {
    alike: Alike,
    /// The scene's own stiffness.
    own: Gain,
    /// How many designs are alike.
    pub count: usize,
    /// The cheapest of them, and what they cost.
    pub designs: Vec<Design>,
    lut4: u32,
    /// SI stiffness of the last bit.
    lsb: f64,
    /// The error, once known.
    pub error: Option<f64>,
    /// The stable stiffness, as far as it is known.
    pub climb: Climb,
    /// Tries of the climb.
    pub tries: usize,
    /// Whether one of its runs failed.
    pub failed: bool,
}

impl Kind {
    /// The kind of a design.
    ///
    /// # Errors
    ///
    /// Why no scene has it.
    pub fn new(base: &Scene, design: Design) -> Result<Self, String> {
        let scene = design.scene(base)?;
        let words = scene.words().map_err(|error| error.to_string())?;
        // Widths that the blocks refuse.
        HybridLoop::new(words.config).map_err(|error| error.to_string())?;
        ConventionalLoop::new(words.config).map_err(|error| error.to_string())?;
        let method = &scene.method;
        let (stiffness, damping) = (method.stiffness_format, method.damping_format);
        let gain = |word: i64, format: Format| Gain::new(word.into(), format.frac().unsigned_abs());
        Ok(Self {
            alike: Alike {
                pwm: method.pwm.bits,
                damping: gain(words.damping, damping),
                stiffness: (stiffness.int(), stiffness.frac()),
                depth: (method.position_bits, method.velocity_bits),
            },
            own: gain(words.stiffness, stiffness),
            count: 1,
            designs: vec![design],
            lut4: estimate(&words.config, method.kind == Loop::Conventional),
            lsb: words.realised.torque_quantum_nm / words.realised.count_rad * stiffness.lsb(),
            error: None,
            climb: Climb::new(words.stiffness.into(), stiffness.max()),
            tries: 0,
            failed: false,
        })
    }

    fn gains(&self, stiffness: Gain) -> Gains {
        Gains { pwm: self.alike.pwm, damping: self.alike.damping, stiffness }
    }

    /// Follows the climb as far as runs are known; what it wants to know next, if anything.
    pub fn follow(&mut self, memory: &Memory) -> Option<(Gains, Depth)> {
        while let Some(word) = self.climb.next() {
            let gains = self.gains(Gain::new(word, self.alike.stiffness.1.unsigned_abs()));
            let Some(ran) = memory.recall(&gains, self.alike.depth) else { return Some((gains, self.alike.depth)) };
            self.climb.told(ran.settled);
            self.tries += 1;
        }
        None
    }

    /// Looks for the error among known runs; which is wanted, if it is not there.
    pub fn look(&mut self, memory: &Memory) -> Option<(Gains, Depth)> {
        let gains = self.gains(self.own);
        self.error = memory.recall(&gains, self.alike.depth).map(|ran| ran.error);
        if self.error.is_none() { Some((gains, self.alike.depth)) } else { None }
    }

    /// What it may be at best.
    pub fn at_best(&self) -> Merit {
        let error = if self.failed { f64::INFINITY } else { self.error.unwrap_or(0.0) };
        Merit { lut4: self.lut4, error, stiffness: self.climb.most() as f64 * self.lsb }
    }

    /// Stiffness of a full command a count, `2^pwm` PWM counts, in the scene's unit.
    pub fn full_scale(&self) -> f64 {
        self.lsb * libm::exp2(f64::from(self.alike.stiffness.1) + f64::from(self.alike.pwm))
    }
}

/// Every design of a grid, by its kind; and the reasons why no scene has some, with their numbers.
pub(super) fn kinds(base: &Scene, own: Design, knobs: &[Knob], designs: usize) -> (Vec<Kind>, Vec<(String, usize)>) {
    let mut all: BTreeMap<Alike, Kind> = BTreeMap::new();
    let mut refused: BTreeMap<String, usize> = BTreeMap::new();
    for mut index in 0..designs {
        let mut design = own;
        for knob in knobs {
            design = design.with(knob.width, knob.from + (index % knob.values()) as i32);
            index /= knob.values();
        }
        match Kind::new(base, design) {
            Err(why) => *refused.entry(why).or_default() += 1,
            Ok(kind) => match all.get_mut(&kind.alike) {
                None => drop(all.insert(kind.alike, kind)),
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
    let mut refused: Vec<_> = refused.into_iter().collect();
    refused.sort_by_key(|(_, count)| Reverse(*count));
    (all.into_values().collect(), refused)
}
