//! Stops on a segment: where a body touches one otherwise.

use super::{End, PmsmDevice};
use crate::flow::polynomial::{Lanes, ORDER, keeps};
use crate::network::Touch;
use crate::pmsm::around::Tie;
use crate::pmsm::series::ANGLE;

impl PmsmDevice<'_> {
    /// Changes how a pair of stops is touched, where the segment ends.
    #[inline(never)]
    pub(super) fn touch(&mut self, stop: usize, touch: Touch, (x, low): (&mut Lanes, &mut Lanes)) {
        let (laws, before) = (self.laws, self.series.around.touches[stop]);
        let body = laws.net.stops[stop].body;
        // The body is where the stop is, without what rounding adds.
        if let (Touch::Out, Touch::Pressed(side)) | (Touch::Pressed(side) | Touch::Lifted(side), Touch::Out) =
            (before, touch)
        {
            let end = if side < 0 { laws.net.stops[stop].low } else { laws.net.stops[stop].high };
            match body {
                0 => (x[ANGLE], low[ANGLE]) = (end, 0.0),
                _ => {
                    let body = &mut self.series.around.bodies[body - 1];
                    (body.x[1], body.low[1]) = (end, 0.0);
                }
            }
        }
        // The damper takes what the spring still holds where the body leaves it, and gives it back where the body is
        // pressed again.
        let position = match body {
            0 => [x[ANGLE], low[ANGLE]],
            _ => [self.series.around.bodies[body - 1].x[1], self.series.around.bodies[body - 1].low[1]],
        };
        let held_j = |touch: Touch| match touch {
            Touch::Pressed(side) => {
                let tie = &laws.stops[stop][usize::from(side > 0)];
                let stretch = tie.stretch(|_| position);
                0.5 * tie.stiffness * stretch * stretch
            }
            _ => 0.0,
        };
        let mut flows = [0.0; 6];
        flows[4] = held_j(before) - held_j(touch);
        self.energy.take(flows);
        self.freed = (before != Touch::Out && touch != Touch::Out).then_some(stop);
        self.series.around.touch(laws, stop, touch);
        self.mode_changes += 1;
    }

    /// Ends the segment where friction of a body beside the rotor changes, or a stop is touched otherwise.
    #[inline(never)]
    pub(super) fn watch_around(&mut self, from: f64) {
        for body in 1..self.laws.net.bodies.len() {
            self.watch_friction(body, from);
        }
        for (index, pair) in self.laws.stops.iter().enumerate() {
            let touch = self.series.around.touches[index];
            let sides = match touch {
                Touch::Out => &pair[..],
                Touch::Pressed(side) | Touch::Lifted(side) => &pair[usize::from(side > 0)..][..1],
            };
            for tie in sides {
                let side = tie.ends[0].1 as i8;
                let gone = if tie.damping == 0.0 { Touch::Out } else { Touch::Lifted(side) };
                match touch {
                    Touch::Out => {
                        self.watch_stop(tie, ([0.0, -1.0], false), from, End::Touch(index, Touch::Pressed(side)))
                    }
                    Touch::Pressed(_) => {
                        let force = [tie.damping, tie.stiffness];
                        self.watch_stop(tie, (force, self.freed == Some(index)), from, End::Touch(index, gone));
                    }
                    Touch::Lifted(_) => {
                        let force = [-tie.damping, -tie.stiffness];
                        let pressed = End::Touch(index, Touch::Pressed(side));
                        self.watch_stop(tie, (force, self.freed == Some(index)), from, pressed);
                        self.watch_stop(tie, ([0.0, 1.0], false), from, End::Touch(index, Touch::Out));
                    }
                }
            }
        }
    }

    /// Ends the segment where a sum of a stop's rate and stretch, with these factors, falls below 0. It `is_freed` if
    /// it is 0 at the anchor and begins to grow there.
    pub(super) fn watch_stop(&mut self, tie: &Tie, ([rate, stretch], is_freed): ([f64; 2], bool), from: f64, end: End) {
        let around = &self.series.around;
        let first = tie.stretch(|body| around.position(&self.start, body));
        let (mut terms, mut count) = ([0.0; ORDER + 1], self.series.powers + 1);
        for (k, term) in terms[..count].iter_mut().enumerate() {
            let of = around.tie(&self.series.x, tie, first, k);
            *term = rate * of[0] + stretch * of[1];
        }
        if is_freed || terms[0] == 0.0 {
            // From 0, the first term only gives the direction of the start; rounding must not turn it.
            count -= 1;
            terms.copy_within(1..=count, 0);
            terms[0] = if is_freed { terms[0].max(0.0) } else { terms[0] };
        }
        self.shorten(keeps(|k| terms[k], count, self.end_s, from), end);
    }
}
