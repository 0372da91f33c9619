//! A run that goes on after its end, until it is known how it goes on for ever.

use hpu_datapath::{Wiring, bundle, flatten};
use hpu_signal::Observe;

use super::rows::Rows;
use super::{ClosedLoop, Control, Driver};
use crate::result::forever::{Beyond, Forever, NotTold, Period, Recurrence, Rest};
use crate::result::trace::ANGLE;
use crate::world::World;

/// The edges of a rest's lead that are looked at: the registers and the modulator's phases.
const MOST_PHASES: usize = 16;
/// Parts of the time looked at, of which the first is one; each part that follows is twice as long.
const PARTS: u64 = 1 << 10;
/// Periods of a modulator at rest that are compared. The steps of a shaft that friction stops twice a period shrink by
/// a fifth or more from period to period: after 330 of them 32 digits stay.
pub(super) const MOST_BEATS: u64 = 512;
/// Rows of a period, at least.
const LEAST_ROWS: u64 = 256;

/// Outputs, each with the edges for which they last.
type Phases<O> = Vec<(O, u64)>;
/// Those of a lead, and those that repeat after it.
type Repeating<O> = (Phases<O>, Phases<O>);

impl<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone> ClosedLoop<W, E> {
    /// Looks on after the end of a run. The observer is shown no rows.
    pub(crate) fn last<O: Observe>(
        &mut self,
        beyond: &Beyond,
        observer: &mut O,
        control: &Control,
    ) -> Result<Forever, NotTold> {
        if let Some(why) = self.world.over() {
            return Err(why.into());
        }
        let count_rad = self.world.left_alone()?;
        self.meet();
        let live = self.live(beyond);
        self.look_far(live);
        self.rows = Rows::never();
        let last = self.edge.saturating_add(beyond.edges);
        let (mut part, mut why) = ((beyond.edges / PARTS).max(1), String::new());
        loop {
            if let Some(recurrence) = self.recurrence() {
                let told = self.period(beyond, recurrence, count_rad, observer, control);
                return told.ok_or_else(|| self.why_no_further(self.edge + recurrence.period).into());
            }
            why.clear();
            if let Some(rest) = self.rest() {
                match (beyond.prove)(&rest) {
                    Ok(quiet) => return Ok(Forever::Quiet(quiet)),
                    Err(said) => why = format!(", and of the rest at the end: {said}"),
                }
                if let [(_, on), (_, off)] = rest.cycle[..] {
                    // The outputs repeat from the end of the lead on, and not before.
                    let lead = rest.lead.iter().fold(0, |sum, (_, edges)| sum + edges);
                    self.beat(lead, on + off, observer, control);
                    if self.recurrence().is_some() {
                        continue;
                    }
                }
            }
            if self.edge >= last {
                let window = self.window(beyond, observer, control);
                return window.map_err(|said| format!("no state came back to the last bit{why}, and {said}"));
            }
            let next = last.min(self.edge + part).min(self.world.reach());
            part *= 2;
            if next <= self.edge || !self.go_far(next, observer, control) || self.world.over().is_some() {
                return Err(format!("{}{why}", self.why_no_further(next.max(self.edge + 1))));
            }
        }
    }

    /// Runs on to where the modulator reads the encoder, and asks for a bound from the state there on.
    fn window<O: Observe>(&mut self, beyond: &Beyond, observer: &mut O, control: &Control) -> Result<Forever, String> {
        let none = || "no pulse begins by itself".to_string();
        let left = (beyond.until_read)(&self.until_pulse().ok_or_else(none)?)?;
        let read = self.edge + left;
        if !self.go_far(read, observer, control) {
            return Err(self.why_no_further(read).into());
        }
        (beyond.window)(&self.until_pulse().ok_or_else(none)?).map(Forever::InContact)
    }

    /// Returns the device under the outputs from the present edge on, up to where a pulse begins, if the inputs stay.
    fn until_pulse(&self) -> Option<Rest> {
        let (mut wiring, mut out, mut lead) = (self.wiring.clone(), self.out, Vec::new());
        while lead.len() < MOST_PHASES {
            let quiet = wiring.quiet(&self.input);
            if quiet == u64::MAX {
                return None;
            }
            wiring.skip(quiet, &self.input);
            lead.push((out, quiet + 1));
            out = wiring.tick(self.input);
            let rest = self.world.rest(&lead, &[(out, u64::MAX)])?;
            let is_off = rest.lead.last().is_some_and(|(share, _)| *share == 0.0);
            if is_off && rest.cycle.iter().all(|(share, _)| *share != 0.0) {
                return Some(rest);
            }
        }
        None
    }

    /// Runs on by events; returns `false` if that was stopped, or cannot be done. A loop of its own, so that there is
    /// no call in that of a run to its end.
    #[inline(never)]
    pub(super) fn go_far<O: Observe>(&mut self, end: u64, observer: &mut O, control: &Control) -> bool {
        end <= self.world.reach() && self.go(Driver::Events, end, observer, control)
    }

    fn why_no_further(&self, end: u64) -> &'static str {
        let far = "no count or pulse comes for longer than the motion is tabulated, and it is not proved to rest";
        self.world.over().unwrap_or(if end > self.world.reach() { far } else { "it was stopped" })
    }

    /// Runs one period, and gathers its position and what happens.
    fn period<O: Observe>(
        &mut self,
        beyond: &Beyond,
        recurrence: Recurrence,
        count_rad: f64,
        observer: &mut O,
        control: &Control,
    ) -> Option<Forever> {
        let angle = |world: &E, at| world.reals(at).as_ref()[ANGLE];
        let (mut sum, mut squares, mut rows) = (0.0, 0.0, 0.0);
        // Odd, so that rows are at all phases of a modulator.
        let (end, stride) = (self.edge + recurrence.period, (recurrence.period / LEAST_ROWS) | 1);
        let (start, before, ticks) = (angle(&self.world, self.edge), self.world.summary(), self.ticks);
        while self.edge < end {
            if !self.go_far(end.min(self.edge + stride), observer, control) {
                return None;
            }
            let off = (angle(&self.world, self.edge) - start) / count_rad;
            (sum, squares, rows) = (sum + off, squares + off * off, rows + 1.0);
        }
        let (mean, after): (f64, _) = (sum / rows, self.world.summary());
        let period = Period {
            edges: recurrence.period,
            events: self.ticks - ticks + after.encoder_edges - before.encoder_edges,
            mode_changes: after.mode_changes - before.mode_changes,
            redecided: after.redecided - before.redecided,
            angle_rad: angle(&self.world, self.edge),
        };
        Some(Forever::Recurs {
            recurrence,
            rms_counts: (squares / rows - mean * mean).max(0.0).sqrt(),
            model_counts: (beyond.follow)(&period),
        })
    }

    /// Returns the nets that gates and device depend on, with the inputs that the world does not move at their words.
    fn live(&self, beyond: &Beyond) -> u64 {
        let count = self.wiring.words().len();
        let driving = self.world.driven_by();
        if driving == u64::MAX || count > 64 {
            return u64::MAX;
        }
        // What the world writes is no longer what was there.
        let given = flatten(&self.input);
        let mut marked: E::In = bundle(&vec![i64::MIN; given.len()]);
        self.world.place(&mut marked);
        let fixed = flatten(&marked).into_iter().zip(&given).map(|(mark, word)| (mark == i64::MIN).then_some(*word));
        let fixed: Vec<Option<i64>> = fixed.collect();
        let outputs = super::outputs(&self.input, &self.out);
        let wanted = outputs.fold(driving, |set, net| set | 1 << net);
        (0..given.len()).fold((beyond.live)(&self.wiring.instances(), &fixed, wanted), |set, net| set | 1 << net)
    }

    /// Returns how the loop goes on if no count arrives: `None` if its outputs do not repeat then.
    fn rest(&self) -> Option<Rest> {
        let (lead, cycle) = self.phases()?;
        self.world.rest(&lead, &cycle)
    }

    /// Returns the outputs from the present edge on under inputs that stay: those of a lead, and those that repeat.
    fn phases(&self) -> Option<Repeating<E::Out>> {
        let (mut wiring, mut out, mut lead) = (self.wiring.clone(), self.out, Vec::new());
        while lead.len() < MOST_PHASES {
            let quiet = wiring.quiet(&self.input);
            if quiet == u64::MAX {
                return Some((lead, vec![(out, u64::MAX)]));
            }
            wiring.skip(quiet, &self.input);
            lead.push((out, quiet + 1));
            out = wiring.tick(self.input);
            if let Some(repeat) = wiring.repeats(&self.input).filter(|repeat| repeat.edges == u64::MAX) {
                return Some((lead, vec![(out, repeat.first), (repeat.others, repeat.period - repeat.first)]));
            }
        }
        None
    }
}
