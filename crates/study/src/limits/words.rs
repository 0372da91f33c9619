//! The set of stiffnesses at which a scene in fixed-point words settles, as `looks` found it.

/// A stiffness that was run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Seen {
    /// The stiffness word.
    pub word: i128,
    /// The stiffness that the word makes, in SI units.
    pub stiffness: f64,
    /// Number of phases, over all worlds, at which it settled.
    pub settled: u32,
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
    }
}

/// The behaviour of a scene in fixed-point words, over stiffnesses and phases of its contact.
#[derive(Clone, PartialEq, Debug)]
pub struct WordsSet {
    /// Unit of the stiffnesses.
    pub unit: &'static str,
    /// Stiffness of one word, in SI units.
    pub step: f64,
    /// Number of words in the range.
    pub words: i128,
    /// Number of phases at each stiffness, over all worlds.
    pub phases: u32,
    /// Number of worlds that each stiffness was run in; 1 if only the scene's own.
    pub worlds: u32,
    /// Number of worlds that were left out because their hand is not at the wall in the judged window.
    pub untouched: u32,
    /// The stiffnesses that were run, the softest first.
    pub seen: Vec<Seen>,
    /// Greatest distance, in words, between two neighbours that differ; 1 if every word between such neighbours was
    /// run.
    pub finest: i128,
    /// Number of runs that exceeded the limit of events ([`MOST_EVENTS`](super::MOST_EVENTS)); they count as not
    /// settled.
    pub cut_short: u32,
    /// Number of runs that settled although a product without its upper bits wrapped on the way: their hand may have
    /// come to rest beyond the wall.
    pub wrapped: u32,
    /// Number of runs whose position counter wrapped under the device, settled or not: their loop read another place.
    pub unheld: u32,
    /// Number of runs whose device was inside a wall that gave no torque; they count as not settled.
    pub without_torque: u32,
}

impl WordsSet {
    /// Returns the runs of neighbouring stiffnesses with the same behaviour, the softest first: group, first and last
    /// member.
    pub fn groups(&self) -> Vec<(Group, Seen, Seen)> {
        let mut groups: Vec<(Group, Seen, Seen)> = Vec::new();
        for seen in &self.seen {
            let group = Group::of(seen.settled, self.phases);
            match groups.last_mut() {
                Some((last, _, to)) if *last == group => *to = *seen,
                _ => groups.push((group, *seen, *seen)),
            }
        }
        groups
    }

    /// Returns the softest stiffness that failed at some phase and is stiffer than the softest one that settles at
    /// every phase. Below the latter a wall may be too soft to come to rest in time.
    pub fn lowest_failed(&self) -> Option<Seen> {
        let settles = |seen: &&Seen| seen.settled == self.phases;
        self.seen.iter().skip_while(|seen| !settles(seen)).find(|seen| !settles(seen)).copied()
    }

    /// Returns the stiffest stiffness that settled at some phase.
    pub fn highest_settled(&self) -> Option<Seen> {
        self.seen.iter().rfind(|seen| seen.settled > 0).copied()
    }

    /// Returns the stiffest stiffness below [`lowest_failed`](Self::lowest_failed): all stiffnesses that were run, from
    /// the softest that settles at every phase up to this one, settle at every phase.
    pub fn all_up_to(&self) -> Option<Seen> {
        let settles = |seen: &&Seen| seen.settled == self.phases;
        self.seen.iter().skip_while(|seen| !settles(seen)).take_while(settles).last().copied()
    }

    /// Whether a stretch of more than a word settles at every phase in the other set and at no phase in this one.
    pub fn is_apart_from(&self, other: &Self) -> bool {
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
        let decimals = (-(self.step * self.finest as f64).log10().floor()).max(0.0) as usize;
        format!("{stiffness:.decimals$}")
    }
}

impl Group {
    pub(super) fn of(settled: u32, phases: u32) -> Self {
        match settled {
            0 => Self::None,
            all if all == phases => Self::All,
            _ => Self::Some,
        }
    }
}
