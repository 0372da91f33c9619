//! The stable set of the linear loop that runs: with the clocks of encoder, registers and `method.settling`, and with
//! the modulator's period.
//!
//! Through an amplifier, or an averaged bridge that takes every duty at once, the sampled loop is that of the ideal
//! drive with a delay of whole clocks, and its set is proved in the same way. Through a modulator the loop has the duty
//! at which the hand comes to rest. Its growth is computed at a grid of stiffnesses; each stretch between a stiffness
//! at which it grows and one at which it decays is narrowed, and what decays is proved stretch by stretch.

use hpu_cosim::figure;
use hpu_cosim::scene::{BridgeModel, Device, Scene, Winding};
use serde::Serialize;

use super::controller::Damping;
use super::open_loop::OpenLoop;
use super::pulses::{MOST_PLANT, Pulses};
use super::stable::{End, StableSet, Stretch};
use crate::Error;
use crate::waits::{Drive, Rest, Wait, has_lines, waits};

/// Number of stiffnesses at which the growth is computed before any is narrowed.
const LOOKS: usize = 200;
/// Greatest number of steps, from one command to the next, that proofs may take: a bound of their time.
const MOST_STEPS: u64 = 20_000_000;
/// Relative distance from a pole's crossing at which proofs are tried first.
const NEAREST: f64 = 3e-10;
/// The first stretch that a proof tries, as a change of the logarithm of the distance from the crossings, and the
/// shortest.
const FIRST: f64 = 2.0;
const LEAST: f64 = 1e-3;

/// The stiffnesses at which the linear loop settles as it is driven, with the duty at rest.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct DrivenSet {
    /// The stretches that are proved to settle; `open` are those that were computed to settle and are not proved.
    #[serde(flatten)]
    pub set: StableSet,
    /// Number of stiffnesses at which the growth was computed: between two of them a stretch may be missed. `None` if
    /// no crossing of a pole is missed.
    #[serde(rename = "looked_at")]
    pub looked: Option<usize>,
    /// The stiffness from which on the command at rest is a full one, if it is in the range: there the loop is open.
    #[serde(rename = "full_command_from")]
    pub full_from: Option<f64>,
    /// Duties at rest at the softest and at the stiffest wall of the range, as shares of a full command; `None` if the
    /// drive does not depend on them.
    #[serde(rename = "duty_at_rest")]
    pub duty: Option<[f64; 2]>,
    /// Whether the pulses are those in whose place the scene has their mean, in area and first moment.
    #[serde(rename = "of_averaged_pulses")]
    pub is_averaged: bool,
    /// The set with one clock more, in which a modulator takes a command, if the scene's averaged bridge leaves this
    /// clock out.
    #[serde(rename = "with_modulator_clock")]
    pub with_modulator: Option<StableSet>,
    /// The times that the loop waits, on the scene's own wall.
    pub waits: Vec<Wait>,
}

/// Why a scene has no set as it is driven, and what the ideal drive leaves out.
#[derive(Clone, PartialEq, Debug)]
pub struct NotDriven {
    /// The reason.
    pub why: String,
    /// The times that the ideal drive leaves out, on the scene's own wall.
    pub left_out: Vec<Wait>,
}

impl DrivenSet {
    /// Computes the set of a scene with its own damping.
    ///
    /// # Errors
    ///
    /// Returns why it is not worked out.
    pub fn new(scene: &Scene, range: [f64; 2]) -> Result<Self, NotDriven> {
        Self::of(scene, range).map_err(|why| NotDriven { why: why.to_string(), left_out: waits(scene) })
    }

    fn of(scene: &Scene, range: [f64; 2]) -> Result<Self, Error> {
        if let Some(name) = scene.network.as_ref().and_then(|network| network.position()) {
            return Err(Error::new(format_args!("its logic reads the words of {name}, which have times of their own")));
        }
        let drive = Drive::of(scene);
        let full_from = match drive {
            Drive::Linear => None,
            Drive::Held | Drive::Pulses { .. } => Rest::of(scene).and_then(Rest::full_from),
        };
        let full_from = full_from.filter(|stiffness| *stiffness <= range[1]);
        let within = [range[0], full_from.unwrap_or(range[1])];
        if within[0] >= within[1] {
            return Err("the command at rest is a full one at every stiffness".into());
        }
        let waits = waits(scene);
        let (is_averaged, with_modulator) = (scene.model.bridge == BridgeModel::Averaged, None);
        if let Drive::Pulses { .. } = drive {
            let (set, looked, duty) = match scene.network.as_deref() {
                None => pulsed(&Pulses::new(scene)?, scene, within),
                Some(network) if network.bends().is_none() && !network.hand_has_mass => {
                    pulsed(&Pulses::<3>::of_network(scene, network)?, scene, within)
                }
                Some(_) if cfg!(target_family = "wasm") => Err("a page works out one body on a bridge".into()),
                Some(network) => pulsed(&Pulses::<MOST_PLANT>::of_network(scene, network)?, scene, within),
            }?;
            let (looked, duty) = (Some(looked), Some(duty));
            return Ok(Self { set, looked, full_from, duty, is_averaged, with_modulator, waits });
        }
        let set = held(scene, drive, within, 0)?;
        let is_bridge = drive == Drive::Held && matches!(scene.device, Device::Motor(_)) && scene.network.is_none();
        let with_modulator = is_bridge.then(|| held(scene, drive, within, 1)).transpose()?;
        Ok(Self { set, looked: None, full_from, duty: None, is_averaged: false, with_modulator, waits })
    }

    /// Returns the set as text.
    pub fn said(&self) -> String {
        let StableSet { range: [low, high], unit, stable, open, .. } = &self.set;
        if let (Some(looked), true) = (self.looked, stable.is_empty() && open.is_empty()) {
            let [low, high] = [low, high].map(|end| figure(*end));
            return format!("none of {looked} stiffnesses from {low} to {high} {unit} settles");
        }
        self.set.said_with("computed to settle, not proved")
    }
}

/// Returns the set of a loop whose commands act from their own clock on, or `later` clocks after it.
pub(super) fn held(scene: &Scene, drive: Drive, range: [f64; 2], later: u64) -> Result<StableSet, Error> {
    let damping = Damping::Fixed(scene.wall.damping_nm_s_per_rad);
    if drive == Drive::Linear {
        return StableSet::new(scene, damping, range);
    }
    let refused = [
        (!has_lines(scene), "its law reads no encoder's lines clock by clock"),
        (scene.faults.is_some(), "its faults change the loop"),
        (scene.model.winding == Winding::Resistive, "its winding has no inductance"),
        (scene.amplifier.is_some_and(|amplifier| amplifier.shaper.is_some()), "its shaper is nonlinear"),
        (scene.method.kind.is_live(), "its spring follows every clock"),
    ];
    if let Some((_, why)) = refused.iter().find(|(is, _)| *is) {
        return Err(Error::new(why));
    }
    super::pulses::plain_damping(scene)?;
    // The register that samples is the one behind the counter.
    let clocks = drive.lines(scene) + 1 + u64::from(scene.method.settling) + scene.host_clocks + later;
    Ok(StableSet::of(&OpenLoop::late(scene, damping, clocks)?, scene, range))
}

/// Returns the set of a loop through a modulator, the number of stiffnesses at which its growth was computed first, and
/// the duties at rest at the ends of the range.
fn pulsed<const P: usize>(
    pulses: &Pulses<P>,
    scene: &Scene,
    range: [f64; 2],
) -> Result<(StableSet, usize, [f64; 2]), Error> {
    if !pulses.waits_short() {
        return Err("its modulator's period is much shorter than the clocks before it".into());
    }
    let (set, looked) = searched(pulses, scene, range, LOOKS);
    Ok((set, looked, range.map(|stiffness| pulses.rest.duty(stiffness))))
}

/// A loop whose growth can be computed at a stiffness, and proved.
struct Search<'a, const P: usize> {
    pulses: &'a Pulses<P>,
    /// Steps that proofs may still take.
    left: u64,
    stable: Vec<Stretch>,
    open: Vec<[f64; 2]>,
}

/// Returns the set of a loop through a modulator, and the number of stiffnesses at which its growth was computed first.
pub(super) fn searched<const P: usize>(
    pulses: &Pulses<P>,
    scene: &Scene,
    range: [f64; 2],
    looks: usize,
) -> (StableSet, usize) {
    let [low, high] = range;
    let at = |index: usize| match index {
        0 => low,
        index if index == looks - 1 => high,
        index => low * libm::pow(high / low, index as f64 / (looks - 1) as f64),
    };
    let decays = |stiffness: f64| pulses.growth_per_s(stiffness) < 0.0;
    let looks: Vec<(f64, bool)> = (0..looks).map(at).map(|stiffness| (stiffness, decays(stiffness))).collect();
    // Two neighbours between which a pole crosses: the one at which the loop decays, and the other one.
    let narrowed = |mut inside: f64, mut outside: f64| {
        while (outside - inside).abs() > 1e-14 * outside {
            let middle = 0.5 * (inside + outside);
            *(if decays(middle) { &mut inside } else { &mut outside }) = middle;
        }
        [inside, outside]
    };
    let mut search = Search { pulses, left: MOST_STEPS, stable: Vec::new(), open: Vec::new() };
    let mut from = 0;
    while from < looks.len() {
        let to = (from..looks.len()).find(|index| !looks[*index].1).unwrap_or(looks.len());
        if to > from {
            let before = from.checked_sub(1).map(|index| narrowed(looks[from].0, looks[index].0));
            let after = looks.get(to).map(|look| narrowed(looks[to - 1].0, look.0));
            search.prove([looks[from].0, looks[to - 1].0], before, after);
        }
        from = to + 1;
    }
    let Search { stable, open, .. } = search;
    (StableSet { range, unit: super::unit(scene), stable, open, ended: false }, looks.len())
}

impl<const P: usize> Search<'_, P> {
    fn settles(&mut self, stretch: [f64; 2]) -> bool {
        self.left = self.left.saturating_sub(2 * self.pulses.periods());
        self.left > 0 && self.pulses.settles(stretch)
    }

    /// Proves the stiffnesses that decay between two crossings, or up to ends of the range.
    fn prove(&mut self, [first, last]: [f64; 2], before: Option<[f64; 2]>, after: Option<[f64; 2]>) {
        let from = before.map_or(first, |[inside, _]| inside);
        let to = after.map_or(last, |[inside, _]| inside);
        // The place of a stiffness between the crossings: the logarithm of its distances. The proof holds over a part
        // of the way to a crossing, and over all of the rest where that is short.
        let floor = before.map_or(0.0, |[inside, _]| inside);
        let place = |at: f64| libm::log(at - floor) - after.map_or(0.0, |[inside, _]| libm::log(inside - at));
        let stiffness = |place: f64| {
            let ratio = libm::exp(place);
            after.map_or(floor + ratio, |[inside, _]| inside - (inside - floor) / (1.0 + ratio))
        };
        let nearest = NEAREST * to;
        let start = if before.is_some() { from + nearest } else { from };
        let end = if after.is_some() { to - nearest } else { to };
        let beyond = |at: f64, step: f64| stiffness(place(at) + step).clamp(at.next_up(), end);
        let (mut at, mut step, mut again) = (start, FIRST, false);
        let mut proved: Option<[f64; 2]> = None;
        while at < end {
            let next = beyond(at, step);
            if self.settles([at, next]) {
                proved = Some([proved.map_or(at, |[low, _]| low), next]);
                (at, step, again) = (next, if again { step } else { 2.0 * step }, false);
                continue;
            }
            (step, again) = (0.5 * step, true);
            if step > LEAST && self.left > 0 {
                continue;
            }
            // What cannot be proved is left open, and the proof goes on behind it.
            self.keep(proved.take(), before, after);
            let next = if self.left > 0 { beyond(at, 0.05) } else { end };
            self.open.push([at, next]);
            (at, step) = (next, FIRST);
        }
        self.keep(proved, before, after);
        self.open = super::crossings::joined(std::mem::take(&mut self.open));
    }

    /// Keeps a proved stretch. An end beside a crossing gets a stiffness beyond it at which a motion is proved not to
    /// die out; an end that has none is open.
    fn keep(&mut self, proved: Option<[f64; 2]>, before: Option<[f64; 2]>, after: Option<[f64; 2]>) {
        let Some([low, high]) = proved else { return };
        let beyond = |crossing: Option<[f64; 2]>, at: f64, sign: f64| {
            let [inside, outside] = crossing?;
            if (inside - at).abs() > 1e-6 * at {
                return None;
            }
            let mut far = (0..12).map(|turn| outside + sign * NEAREST * outside * 2f64.powi(turn));
            far.find(|stiffness| self.pulses.persists(*stiffness))
        };
        let (from, to) = (beyond(before, low, -1.0), beyond(after, high, 1.0));
        self.stable.push(Stretch { from: End { at: low, beyond: from }, to: End { at: high, beyond: to } });
    }
}
