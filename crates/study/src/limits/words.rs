//! The set of stiffnesses at which a scene in fixed-point words settles, as `looks` found it.

use hpu_page::summary::telling_by_decay;
use serde::Serialize;

/// A stiffness that was run.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Seen {
    /// The stiffness word.
    pub word: i128,
    /// The stiffness that the word makes, in SI units.
    pub stiffness: f64,
    /// Number of phases, over all worlds, at which it settled.
    pub settled: u32,
    /// Number of phases at which the run was too short to tell.
    pub not_told: u32,
    /// The longest duration of a run that would tell at such a phase; `None` if none is known.
    #[serde(rename = "telling_duration_s")]
    pub telling_s: Option<f64>,
}

impl Seen {
    /// Returns a stiffness of which no phase was run yet.
    pub(super) fn new(word: i128, stiffness: f64) -> Self {
        Self { word, stiffness, settled: 0, not_told: 0, telling_s: None }
    }

    /// Whether it was seen to fail at some of `phases` phases.
    fn failed(&self, phases: u32) -> bool {
        self.settled + self.not_told < phases
    }
}

hpu_signal::named! {
    /// The behaviour that neighbouring stiffnesses share.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Group {
        /// The stiffnesses settle at every phase.
        All = "all",
        /// The stiffnesses settle at some phases.
        Some = "some",
        /// The stiffnesses settle at no phase.
        None = "none",
        /// At some phases the runs are too short to tell, and no phase settles beside one that fails.
        NotTold = "not_told",
    }
}

/// The behaviour of a scene in fixed-point words, over stiffnesses and phases of its contact.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct WordsSet {
    /// Unit of the stiffnesses.
    pub unit: &'static str,
    /// Stiffness of one word, in SI units.
    #[serde(rename = "word")]
    pub step: f64,
    /// Number of words in the range.
    pub words: i128,
    /// Number of phases at each stiffness, over all worlds.
    #[serde(skip)]
    pub phases: u32,
    /// Number of worlds that each stiffness was run in; 1 if only the scene's own.
    pub worlds: u32,
    /// Number of worlds that were left out because their hand is not at the wall in the judged window.
    #[serde(rename = "worlds_without_contact")]
    pub untouched: u32,
    /// The stiffnesses that were run, the softest first.
    pub seen: Vec<Seen>,
    /// Greatest distance, in words, between two neighbours that differ; 1 if every word between such neighbours was
    /// run.
    #[serde(rename = "words_between_neighbours_that_differ")]
    pub finest: i128,
    /// Number of runs that exceeded the limit of events ([`MOST_EVENTS`](super::MOST_EVENTS)); they count as not
    /// settled.
    #[serde(rename = "runs_cut_short")]
    pub cut_short: u32,
    /// Number of runs that settled although a product without its upper bits wrapped on the way: their hand may have
    /// come to rest beyond the wall.
    #[serde(rename = "runs_settled_but_wrapped")]
    pub wrapped: u32,
    /// Number of runs whose position counter wrapped under the device, settled or not: their loop read another place.
    #[serde(rename = "runs_with_wrapped_position")]
    pub unheld: u32,
    /// Number of runs whose device was inside a wall that gave no torque; they count as not settled.
    #[serde(rename = "runs_without_wall_torque")]
    pub without_torque: u32,
}

impl WordsSet {
    /// Returns the set in another unit of stiffness, of which one is `one` of the present ones.
    #[must_use]
    pub(super) fn in_units(mut self, one: f64, unit: &'static str) -> Self {
        (self.unit, self.step) = (unit, self.step / one);
        self.seen.iter_mut().for_each(|seen| seen.stiffness /= one);
        self
    }

    /// Returns the runs of neighbouring stiffnesses with the same behaviour, the softest first: group, first and last
    /// member.
    pub fn groups(&self) -> Vec<(Group, Seen, Seen)> {
        let mut groups: Vec<(Group, Seen, Seen)> = Vec::new();
        for seen in &self.seen {
            let group = Group::of(seen, self.phases);
            match groups.last_mut() {
                Some((last, _, to)) if *last == group => *to = *seen,
                _ => groups.push((group, *seen, *seen)),
            }
        }
        groups
    }

    /// Returns the softest stiffness that failed at some phase and is stiffer than the softest one that settles at
    /// every phase.
    pub fn lowest_failed(&self) -> Option<Seen> {
        let settles = |seen: &&Seen| seen.settled == self.phases;
        self.seen.iter().skip_while(|seen| !settles(seen)).find(|seen| seen.failed(self.phases)).copied()
    }

    /// Returns the stiffest stiffness that settled at some phase.
    pub fn highest_settled(&self) -> Option<Seen> {
        self.seen.iter().rfind(|seen| seen.settled > 0).copied()
    }

    /// Returns the stiffest stiffness up to which all settle: all stiffnesses that were run, from the softest that
    /// settles at every phase up to this one, settle at every phase.
    pub fn all_up_to(&self) -> Option<Seen> {
        let settles = |seen: &&Seen| seen.settled == self.phases;
        self.seen.iter().skip_while(|seen| !settles(seen)).take_while(settles).last().copied()
    }

    /// Returns the stiffnesses at which some run was too short to tell, and that may lie between those that settle and
    /// those that fail: from the softest that settles at every phase, or from the softest of all if none does, up to
    /// the softest beyond it that fails.
    pub fn open(&self) -> Vec<Seen> {
        let settles = |seen: &Seen| seen.settled == self.phases;
        let from = self.seen.iter().position(settles).unwrap_or(0);
        let to = self.lowest_failed().map_or(i128::MAX, |failed| failed.word);
        self.seen[from..].iter().filter(|seen| seen.word <= to && seen.not_told > 0).copied().collect()
    }

    /// Returns the duration of a run that would tell at every stiffness at which some run was too short; `None` if all
    /// tell, or if no such duration is known.
    pub fn telling_s(&self) -> Option<f64> {
        longest_s(&self.seen)
    }

    /// Returns the number of runs that were too short to tell.
    pub fn not_told(&self) -> u32 {
        self.seen.iter().map(|seen| seen.not_told).sum()
    }

    /// Whether some run from a stiffness to another was too short to tell.
    pub fn not_told_from(&self, from: &Seen, to: &Seen) -> bool {
        self.among(from, to).iter().any(|seen| seen.not_told > 0)
    }

    fn among(&self, from: &Seen, to: &Seen) -> &[Seen] {
        let at = |word| self.seen.partition_point(|seen| seen.word < word);
        &self.seen[at(from.word)..=at(to.word)]
    }

    /// Returns as text at how many phases the runs from a stiffness to another, of the same group, do not tell, and
    /// what would tell.
    pub fn said_not_told(&self, from: &Seen, to: &Seen) -> String {
        let among = self.among(from, to);
        let [least, most] =
            [among.iter().map(|seen| seen.not_told).min(), among.iter().map(|seen| seen.not_told).max()]
                .map(Option::unwrap_or_default);
        let times = if least == most { most.to_string() } else { format!("{least} to {most}") };
        let telling = telling_by_decay(longest_s(among));
        format!("at {times} of {} phases; {telling}", self.phases)
    }

    /// Whether a stretch of more than a word settles at every phase in the other set and at no phase in this one.
    pub(crate) fn is_apart_from(&self, other: &Self) -> bool {
        match (self.highest_settled(), other.lowest_failed()) {
            (Some(settled), Some(failed)) => settled.word + 1 < failed.word,
            (None, _) => other.all_up_to().is_some(),
            (Some(settled), None) => other.seen.last().is_some_and(|last| settled.word + 1 < last.word),
        }
    }

    /// Returns the number of runs that the set took.
    pub fn runs(&self) -> usize {
        self.seen.len() * self.phases as usize
    }

    /// Returns a text that tells the lowest stiffness seen to fail and the highest seen to settle.
    pub fn turn(&self) -> String {
        let unit = self.unit;
        let told = |seen: Option<Seen>| seen.map_or("none".into(), |seen| self.digits(seen.stiffness));
        match self.lowest_failed() {
            None if self.all_up_to().is_none() => "no stiffness settles at every phase".into(),
            None if !self.open().is_empty() => {
                let (settled, runs) = (told(self.highest_settled()), self.runs());
                format!("none seen to fail, highest seen to settle {settled} {unit}; {runs} runs")
            }
            None => format!("all settle, up to {} {unit}", told(self.all_up_to())),
            failed => {
                let (failed, settled) = (told(failed), told(self.highest_settled()));
                format!("lowest seen to fail {failed}, highest seen to settle {settled} {unit}; {} runs", self.runs())
            }
        }
    }

    /// Returns on which side of the set a criterion's limit lies; among both, with the share of phases that settle
    /// there.
    pub fn against(&self, limit: f64) -> String {
        let nearest = self.seen.iter().min_by(|a, b| {
            let away = |seen: &Seen| (seen.stiffness - limit).abs();
            away(a).total_cmp(&away(b))
        });
        let share = nearest.map_or(0.0, |seen| f64::from(seen.settled) / f64::from(self.phases));
        let beyond = |seen: Option<Seen>| seen.is_some_and(|seen| limit > seen.stiffness);
        let side = match (self.lowest_failed(), beyond(self.highest_settled())) {
            (None, _) if self.all_up_to().is_none() => "none settle at every phase",
            (None, _) => "all settle",
            (Some(failed), _) if limit < failed.stiffness => "below all that fail",
            (_, true) => "above all that settle",
            _ => return format!("among both: {:.0} % of the phases settle there", 100.0 * share),
        };
        side.to_string()
    }

    /// Returns a stiffness with as many decimals as the finest part of the grid has.
    pub fn digits(&self, stiffness: f64) -> String {
        let decimals = (-libm::log10(self.step * self.finest as f64).floor()).max(0.0) as usize;
        format!("{stiffness:.decimals$}")
    }
}

impl Group {
    pub(super) fn of(seen: &Seen, phases: u32) -> Self {
        match (seen.settled, seen.failed(phases)) {
            (all, _) if all == phases => Self::All,
            (1.., true) => Self::Some,
            _ if seen.not_told > 0 => Self::NotTold,
            _ => Self::None,
        }
    }
}

/// Returns the longest duration of a run that would tell, of those stiffnesses at which some run was too short.
fn longest_s(seen: &[Seen]) -> Option<f64> {
    let durations = seen.iter().filter(|seen| seen.not_told > 0).map(|seen| seen.telling_s);
    durations.reduce(|one, other| Some(one?.max(other?))).flatten()
}
