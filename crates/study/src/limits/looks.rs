//! The stiffnesses at which a scene settles as written: in fixed-point words, with its quantisation, friction, hand and
//! contact.
//!
//! Settling has no single threshold: a scene may settle, oscillate and settle again from one stiffness word to the
//! next, and settle at one phase of its contact and not at another. So the scene is run at a grid of words, each at
//! several phases. Wherever two neighbours of the grid differ, words between them are run too, down to single words.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Duration;

use hpu_cosim::scene::{
    Compound, Datapath, Device, DutScene, Experiment, Hand, OutcomeKind, Realised, Scene, moves_until_s,
};
use hpu_cosim::{Control, figure, judged_window_s};
use hpu_farm::Failed;
use hpu_farm::units::{self, run_some};

use super::words::{Group, Seen, WordsSet};
use crate::map::{Cell, CellLimits};
use crate::{Error, Kind};
use hpu_prove::linear::unit;

/// How finely the stiffnesses of a scene in fixed-point words are examined.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Looks {
    /// Number of phases of the contact at each stiffness.
    pub phases: u32,
    /// Number of words in the first grid, spread evenly over the logarithm of the range.
    pub coarse: usize,
    /// Greatest number of words that are run; a range that has no more words than this is run in full.
    pub most: usize,
    /// Whether the grid is climbed from its softest word, and left at the first word that settles at no phase above a
    /// word that settles at every phase. Stiffer walls take the most time to run, and are skipped then.
    pub climbs: bool,
    /// Two neighbours that differ have a word between them run unless they are nearer than this, relative to the
    /// stiffer one; 0 goes down to single words.
    pub nearest: f64,
}

impl Looks {
    /// Coarse settings, for many scenes in turn.
    pub const BRIEF: Self = Self { phases: 8, coarse: 12, most: 64, climbs: true, nearest: 5e-3 };

    /// Returns the settings for at most `most` words at this many phases: a grid of a quarter of the words, and the
    /// others where neighbours differ.
    pub const fn words(most: usize, phases: u32) -> Self {
        Self { phases, coarse: if most < 8 { 2 } else { most / 4 }, most, climbs: false, nearest: 0.0 }
    }
}

impl Default for Looks {
    fn default() -> Self {
        Self::words(256, 8)
    }
}

/// Number of events ([`Summary::events`](hpu_cosim::Summary::events)) after which a run counts as not settled: a wall
/// that is far too stiff chatters through millions of counts. Of the runs that `hpu limits` makes of the shipped
/// scenes, none that settles has more than 143 165.
pub const MOST_EVENTS: u64 = 1_500_000;

impl WordsSet {
    /// Runs a scene's stiffnesses over a range in SI units, in each of some worlds with the same words. The first world
    /// names the stiffnesses.
    ///
    /// # Errors
    ///
    /// Returns the reason why there is no set: no words, no free motion, no contact in a judged window, a run that
    /// cannot be made, or that `control` stopped it.
    pub fn new(
        worlds: &[Scene],
        range: [f64; 2],
        looks: Looks,
        jobs: NonZeroUsize,
        control: &Control,
    ) -> Result<Self, Error> {
        let scene = worlds.first().ok_or("no world")?;
        match scene.model.datapath {
            Datapath::Words => {}
            Datapath::Linear => return Err("the scene's law is linear: it has no words".into()),
            Datapath::Law => return Err("the scene's law is computed in floats: it has no words".into()),
        }
        match scene.hand {
            Hand::Prescribed { .. } => return Err("the hand imposes the motion".into()),
            Hand::Capture { .. } => return Err("a recording stands in the place of the device".into()),
            _ => {}
        }
        let realised = scene.words()?.realised;
        let format = scene.method.stiffness_format;
        let step = word_step(scene, &realised);
        // The range is rounded to the nearest words.
        let word = |stiffness: f64| ((stiffness / step).round() as i128).clamp(1, format.max());
        let (least, most) = (word(range[0]), word(range[1]));
        let touched = touched(worlds, least, jobs, control)?;
        let untouched = (worlds.len() - touched.len()) as u32;
        let phased = |world: &'_ &Scene| {
            (0..looks.phases).map(|phase| phased(world, realised.count_rad, phase, looks.phases)).collect::<Vec<_>>()
        };
        let phases: Vec<Scene> = touched.iter().flat_map(phased).collect();
        let at = |phase: usize, word: i128| Ok(Experiment::Axis(at_word(&phases[phase], word)));
        let drops = !scene.method.saturate;
        let grid = Grid { at: &at, phases: phases.len() as u32, step, unit: unit(scene), drops };
        let found = grid.look([least, most], looks, jobs, control)?;
        Ok(Self { worlds: touched.len() as u32, untouched, ..found })
    }

    /// Runs the values of a generic or constant of a design of the user's own, from the least to the greatest. `at`
    /// makes the scene for a value. A phase is a share of a millisecond, because the sample times of such a design are
    /// not known.
    ///
    /// # Errors
    ///
    /// Returns the reason why there is no set: no free motion, no contact in a judged window, a design that cannot be
    /// built or run, or that `control` stopped it.
    pub fn of_design(
        at: &(dyn Fn(i128) -> Result<DutScene, Error> + Sync),
        range: [i128; 2],
        looks: Looks,
        jobs: NonZeroUsize,
        control: &Control,
    ) -> Result<Self, Error> {
        const SPAN_S: f64 = 1e-3;
        if let Hand::Prescribed { .. } = at(range[0])?.hand {
            return Err("the hand imposes the motion".into());
        }
        let at = |phase: usize, word: i128| {
            let mut scene = at(word)?;
            let count_rad = scene.encoder.count_rad();
            let moved = (&mut scene.hand, &mut scene.device, &mut scene.network);
            shift(moved, (count_rad, SPAN_S), phase as u32, looks.phases);
            Ok(Experiment::Dut(scene))
        };
        Grid { at: &at, phases: looks.phases, step: 1.0, unit: "", drops: false }.look(range, looks, jobs, control)
    }
}

/// Returns the middle words between neighbours that differ.
fn between(seen: &BTreeMap<i128, Seen>, phases: u32, looks: Looks) -> Vec<i128> {
    let neighbours: Vec<(i128, Group)> = seen.values().map(|seen| (seen.word, Group::of(seen, phases))).collect();
    let apart = neighbours.windows(2).filter(|pair| {
        let far = 1.max((looks.nearest * pair[1].0 as f64) as i128);
        pair[0].1 != pair[1].1 && pair[1].0 - pair[0].0 > far
    });
    apart.map(|pair| pair[0].0 + (pair[1].0 - pair[0].0) / 2).collect()
}

/// How a run ended.
#[derive(Clone, Copy)]
enum End {
    Settled,
    /// It settled although its product wrapped.
    Wrapped,
    WithoutTorque,
    CutShort,
    /// It was too short to tell; with the duration that would tell, if it is known.
    NotTold(Option<f64>),
    /// It moves without end.
    Moves,
}

/// The end of a run, and whether its position counter wrapped.
struct Run {
    end: End,
    is_unheld: bool,
}

/// Returns `count` words from the least to the greatest, evenly over their logarithm; all words if there are no more.
fn spread(least: i128, most: i128, count: usize) -> Vec<i128> {
    if most - least < count as i128 {
        return (least..=most).collect();
    }
    let (low, high) = (libm::log(least as f64), libm::log(most as f64));
    let at = |k: usize| libm::exp(low + (high - low) * k as f64 / (count - 1) as f64).round() as i128;
    let mut words: Vec<i128> = (0..count).map(|k| at(k).clamp(least, most)).collect();
    words.dedup();
    words
}

/// Returns a scene with the stiffness of a word.
fn at_word(scene: &Scene, word: i128) -> Scene {
    let mut scene = scene.clone();
    let step = scene.words().map_or(0.0, |words| word_step(&scene, &words.realised));
    scene.wall.stiffness_nm_per_rad = word as f64 * step;
    scene
}

/// Returns the stiffness of a scene's lowest word.
fn word_step(scene: &Scene, realised: &Realised) -> f64 {
    realised.torque_quantum_nm / realised.count_rad * scene.method.stiffness_format.lsb()
}

/// Returns the worlds whose hand is at the wall in the judged window at the softest stiffness; a single world is
/// returned unchecked.
fn touched<'s>(
    worlds: &'s [Scene],
    softest: i128,
    jobs: NonZeroUsize,
    control: &Control,
) -> Result<Vec<&'s Scene>, Error> {
    if worlds.len() == 1 {
        return Ok(vec![&worlds[0]]);
    }
    let limits = CellLimits { events: MOST_EVENTS, guard: Duration::MAX, for_ever: None };
    let unit = |unit: usize, control: &Control| {
        let cell = Cell::run(&Experiment::Axis(at_word(&worlds[unit], softest)), limits, control).transpose()?;
        Some(cell.map(|cell| cell.contact_share != Some(0.0)).map_err(Failed::new))
    };
    let rows = units::run(worlds.len(), jobs, BTreeMap::new(), control, unit, |_, _| Ok::<_, ()>(()));
    let rows = rows.unwrap_or_default().ok_or("stopped")?;
    let touched = worlds.iter().zip(rows).filter(|(_, row)| row == &Ok(true));
    let touched: Vec<&Scene> = touched.map(|(world, _)| world).collect();
    if touched.is_empty() { Err("not judged: the wall is reached in no world of the box".into()) } else { Ok(touched) }
}

/// The stiffnesses that were run, and counts of runs that are reported separately.
#[derive(Default)]
struct Runs {
    seen: BTreeMap<i128, Seen>,
    cut_short: u32,
    wrapped: u32,
    unheld: u32,
    without_torque: u32,
}

impl Runs {
    /// Adds the end of a run at a word; `step` is the stiffness of one word.
    fn add(&mut self, word: i128, step: f64, run: &Run) {
        let seen = self.seen.entry(word).or_insert_with(|| Seen::new(word, word as f64 * step));
        self.unheld += u32::from(run.is_unheld);
        match run.end {
            End::Settled => seen.settled += 1,
            End::Wrapped => {
                seen.settled += 1;
                self.wrapped += 1;
            }
            End::WithoutTorque => self.without_torque += 1,
            End::CutShort => self.cut_short += 1,
            End::NotTold(telling_s) => {
                let before = if seen.not_told == 0 { telling_s } else { seen.telling_s };
                seen.telling_s = before.zip(telling_s).map(|(one, other)| one.max(other));
                seen.not_told += 1;
            }
            End::Moves => {}
        }
    }
}

/// The scenes to run, by phase and word.
struct Grid<'a> {
    at: &'a (dyn Fn(usize, i128) -> Result<Experiment, Error> + Sync),
    phases: u32,
    /// Stiffness of one word, in `unit`.
    step: f64,
    unit: &'static str,
    /// Whether the scene's product drops its upper bits.
    drops: bool,
}

impl Grid<'_> {
    /// Runs the words of a range.
    fn look(
        &self,
        [least, mut most]: [i128; 2],
        looks: Looks,
        jobs: NonZeroUsize,
        control: &Control,
    ) -> Result<WordsSet, Error> {
        let all = self.phases;
        let mut runs = Runs::default();
        let is_small = !looks.climbs && most - least < looks.most as i128;
        let mut wanted = spread(least, most, if is_small { looks.most } else { looks.coarse });
        if looks.climbs {
            for step_up in std::mem::take(&mut wanted) {
                self.add(&[step_up], jobs, control, &mut runs)?;
                let is = |seen: &Seen, group| Group::of(seen, all) == group;
                if is(&runs.seen[&step_up], Group::None) && runs.seen.values().any(|seen| is(seen, Group::All)) {
                    most = step_up;
                    break;
                }
            }
            wanted = between(&runs.seen, all, looks);
        }
        while !wanted.is_empty() {
            self.add(&wanted, jobs, control, &mut runs)?;
            wanted = between(&runs.seen, all, looks);
            if runs.seen.len() + wanted.len() > looks.most {
                break;
            }
        }
        let Runs { seen, cut_short, wrapped, unheld, without_torque } = runs;
        let seen: Vec<Seen> = seen.into_values().collect();
        let between = |pair: &[Seen]| {
            let differ = Group::of(&pair[0], all) != Group::of(&pair[1], all);
            if differ { pair[1].word - pair[0].word } else { 1 }
        };
        let finest = seen.windows(2).map(between).max().unwrap_or(1);
        Ok(WordsSet {
            unit: self.unit,
            step: self.step,
            words: most - least + 1,
            phases: all,
            worlds: 1,
            untouched: 0,
            seen,
            finest,
            cut_short,
            wrapped,
            unheld,
            without_torque,
        })
    }

    /// Runs a word at a phase; `None` when stopped.
    fn run(&self, phase: usize, word: i128, control: &Control) -> Option<Result<Run, Error>> {
        let limits = CellLimits { events: MOST_EVENTS, guard: Duration::MAX, for_ever: None };
        let experiment = match (self.at)(phase, word) {
            Ok(experiment) => experiment,
            Err(why) => return Some(Err(why)),
        };
        let cell = match Cell::run(&experiment, limits, control).transpose()? {
            Ok(cell) => cell,
            Err(error) if error.kind() == Kind::Events => {
                return Some(Ok(Run { end: End::CutShort, is_unheld: false }));
            }
            Err(error) => return Some(Err(error)),
        };
        if cell.outcome == OutcomeKind::HandMoves {
            return Some(Err(Error::of(Kind::Unjudged, moving(&experiment, &cell))));
        }
        if cell.contact_share == Some(0.0) {
            return Some(Err(Error::of(Kind::Unjudged, untouched(&experiment))));
        }
        let end = match cell.outcome {
            OutcomeKind::NotTold => End::NotTold(cell.telling_s),
            OutcomeKind::NoWallTorque => End::WithoutTorque,
            OutcomeKind::Settled if self.drops && cell.overflow_share > cell.position_lost_share => End::Wrapped,
            OutcomeKind::Settled => End::Settled,
            _ => End::Moves,
        };
        Some(Ok(Run { end, is_unheld: cell.position_lost_share > 0.0 }))
    }

    /// Runs these words at every phase, and adds the ends of the runs to `seen`.
    fn add(&self, words: &[i128], jobs: NonZeroUsize, control: &Control, seen: &mut Runs) -> Result<(), Error> {
        let phases = self.phases as usize;
        let units: Vec<usize> = (0..words.len() * phases).collect();
        let run = |unit: usize, control: &Control| self.run(unit % phases, words[unit / phases], control).map(Ok);
        let mut done = 0;
        run_some(&units, jobs, control, run, |unit, run| {
            let run = run.unwrap_or_else(|panicked| Err(panicked.into()))?;
            seen.add(words[unit / phases], self.step, &run);
            done += 1;
            Ok::<(), Error>(())
        })?;
        if done < units.len() { Err("stopped".into()) } else { Ok(()) }
    }
}

/// Returns the scene with its contact at one of `phases` phases: later within the sample period, and displaced within a
/// count.
///
/// A hand that follows a path starts later by a share of the sample period. A device that moves by itself begins
/// farther back by the distance that it covers in that time at its initial speed. Both also begin and end at another
/// place within an encoder count. The shares of the count come in another order than those of the period, so that no
/// two phases have the same share of both.
fn phased(scene: &Scene, count_rad: f64, phase: u32, phases: u32) -> Scene {
    let mut scene = scene.clone();
    let span_s = scene.sample_period_s();
    shift((&mut scene.hand, &mut scene.device, &mut scene.network), (count_rad, span_s), phase, phases);
    scene
}

/// Moves the contact to a phase: by a share of a span of time and by a share of a count.
fn shift(
    (hand, device, network): (&mut Hand, &mut Device, &mut Option<Arc<Compound>>),
    (count_rad, span_s): (f64, f64),
    phase: u32,
    phases: u32,
) {
    let late_s = f64::from(phase) / f64::from(phases) * span_s;
    // Three has no common divisor with the usual eight.
    let aside = f64::from(3 * phase % phases) / f64::from(phases) * count_rad;
    if let Some(network) = network {
        Arc::make_mut(network).shift(aside, late_s);
    }
    let back = match hand {
        Hand::SpringDamper { path, .. } => {
            for knot in path.iter_mut() {
                knot.time_s += if knot.time_s > 0.0 { late_s } else { 0.0 };
                knot.angle_rad += aside;
            }
            0.0
        }
        _ => late_s,
    };
    match device {
        Device::Motor(motor) => motor.initial_angle_rad += aside - back * motor.initial_speed_rad_per_s,
        Device::Mass(mass) => mass.initial_position_m += aside - back * mass.initial_speed_m_per_s,
    }
}

/// Returns why a scene whose hand moves in the judged window gives no verdict on the wall, and what to change.
fn moving(experiment: &Experiment, cell: &Cell) -> String {
    let until = figure(moves_until_s(&experiment.setup().hand_path()));
    let telling = cell
        .telling_s
        .map_or(String::new(), |telling_s| format!(", or write run.duration = \"{} s\"", figure(telling_s)));
    let duration = figure(experiment.run.duration_s);
    format!("not judged: the hand moves until {until} s of {duration} s; let hand.path end earlier{telling}")
}

/// Returns why a scene whose hand is not at the wall gives no verdict on the wall, and what to change.
fn untouched(experiment: &Experiment) -> String {
    let (hand, wall_rad, stiffness) = match experiment {
        Experiment::Axis(scene) => {
            let wall = scene.written_wall();
            (&scene.hand, wall.position_rad, Some(wall.stiffness_nm_per_rad))
        }
        Experiment::Dut(scene) => (&scene.hand, scene.wall_or_far_rad(), None),
        _ => return "limits are those of an axis".into(),
    };
    let unit = experiment.setup().units();
    let [from, to] = judged_window_s(experiment).map(figure);
    let at = stiffness.map_or(String::new(), |stiffness| format!("at {} {} ", figure(stiffness), unit.stiffness));
    let hand = match hand {
        Hand::SpringDamper { .. } => "let hand.path end beyond the wall",
        Hand::ConstantTorque { .. } => "let hand.torque press into the wall",
        _ => "give it a hand that presses into the wall",
    };
    format!(
        "not judged: wall not reached {at}in the judged window, {from} s to {to} s; {hand}, \
         move wall.position ({} {}), or change run.duration",
        figure(wall_rad),
        unit.position
    )
}
