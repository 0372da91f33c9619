//! The mean of a modulator's pulses, computed from all duties and outputs since the start.

use crate::fixed::Fixed;

/// The duties and outputs of the mean of a modulator's pulses, from the start on.
#[derive(Clone, Default)]
pub struct Mean<const N: usize> {
    /// The duties that the modulator took or will take, with the edges that begin their periods.
    taken: Vec<(u64, f64)>,
    /// The outputs, with the edges from which they are given.
    pub given: Vec<(u64, Fixed<N>)>,
}

/// The way in which a mean changes to another duty.
pub enum Change<const N: usize> {
    /// At a future edge.
    At(u64),
    /// At once to this output, and to the duty at a future edge.
    Now(Fixed<N>, u64),
}

impl<const N: usize> Mean<N> {
    /// Returns the area that was owed up to an edge, in edges of full duty. A pulse of duty `d` in a period of `P`
    /// edges has its middle `(1 - |d|) P / 2` before the middle of the period. So a change from `a` to `b` at a
    /// period's beginning gives `(b (1 - |b|) - a (1 - |a|)) P / 2` more than a mean that changes at that edge.
    fn wanted(&self, edge: u64, period: u64) -> Fixed<N> {
        let (mut area, mut before) = (Fixed::ZERO, 0.0f64);
        let early = |duty: f64| Fixed::of(duty) * (Fixed::whole(1) - Fixed::of(duty).abs());
        for &(begin, duty) in &self.taken {
            let edges = if edge < begin { -Fixed::whole(begin - edge) } else { Fixed::whole(edge - begin) };
            let half = Fixed::of(0.5) * Fixed::whole(period);
            area = area + (Fixed::of(duty) - Fixed::of(before)) * edges + (early(duty) - early(before)) * half;
            before = duty;
        }
        area
    }

    /// Returns the area that was given up to an edge.
    fn given(&self, edge: u64) -> Fixed<N> {
        let ends = self.given.iter().skip(1).map(|&(from, _)| from).chain([edge]);
        let areas = self.given.iter().zip(ends).map(|(&(from, duty), to)| duty * Fixed::whole(to - from));
        areas.fold(Fixed::ZERO, |sum, area| sum + area)
    }

    /// Takes another duty for the modulator. Returns the change of the mean.
    pub fn change(&mut self, edge: u64, period: u64, duty: f64) -> Change<N> {
        let begin = (edge..).find(|edge| edge % period == 0).expect("periods go on") + 1;
        self.taken.retain(|taken| taken.0 < begin);
        let held = self.taken.last().map_or(0.0, |taken| taken.1);
        self.taken.push((begin, duty));
        let end = begin + period / 2;
        let now = self.given.last().map_or(Fixed::ZERO, |given| given.1);
        let missing = self.wanted(end, period) - self.given(edge);
        if now == Fixed::of(held) && duty != held {
            // Held for x edges, then the duty: held x + duty (end - edge - x) = missing.
            let rest = Fixed::of(duty) * Fixed::whole(end - edge) - missing;
            let x = (rest * (Fixed::of(duty) - Fixed::of(held)).reciprocal() + Fixed::of(0.25)).float().floor();
            if x >= 1.0 && x <= (end - edge) as f64 {
                return Change::At(edge + x as u64);
            }
        }
        Change::Now(missing * Fixed::whole(end - edge).reciprocal(), end)
    }
}
