//! The readings of sensors on a segment.

use super::PmsmDevice;
use crate::flow::double::Double;
use crate::flow::polynomial::{ORDER, Polynomial};

impl PmsmDevice<'_> {
    /// Makes [`next_event`](Self::next_event) tell too where the reading of a sensor leaves `[low, high)`, in the place
    /// of the band that it had.
    pub fn watch(&mut self, sensor: usize, band: (f64, f64)) {
        match self.watched.iter_mut().find(|(watched, _)| *watched == sensor) {
            Some((_, known)) => *known = band,
            None => self.watched.push((sensor, band)),
        }
    }

    /// Returns the reading of a sensor at an edge, in units of its body.
    pub fn reading_of(&self, sensor: usize, edge: u64) -> f64 {
        self.on(edge, |then, t| then.read(sensor, t).hi)
    }

    /// Returns the reading of a sensor a time after the anchor.
    pub(super) fn read(&self, sensor: usize, t: f64) -> Double {
        let (body, units, _) = self.laws.net.sensed[sensor];
        let (high, low) = match body {
            0 => self.angle(t),
            _ => {
                let (x, low) = self.series.around.bodies[body - 1].at(t, self.series.powers);
                (x[1], low[1])
            }
        };
        Double::product(units, high) + (units * low).into()
    }

    /// Returns where the reading of a sensor lies with respect to the band from `low`, inclusive, to `high` at an edge:
    /// -1 below, 0 inside, 1 above.
    pub fn side_of_reading(&self, sensor: usize, edge: u64, band: (f64, f64)) -> i8 {
        self.on(edge, |then, t| side(then.read(sensor, t), band))
    }

    /// Returns the greatest integer up to `scale` times the reading of a sensor at an edge.
    pub fn floor_of_reading(&self, sensor: usize, edge: u64, scale: f64) -> i64 {
        let Double { hi, lo } = self.on(edge, |then, t| then.read(sensor, t)) * scale.into();
        let whole = hi.floor();
        whole as i64 - i64::from(whole == hi && lo < 0.0)
    }

    /// Returns the first edge in (`from`, `last`] at which the reading of a sensor is outside a band.
    #[inline(never)]
    pub(super) fn reads_beyond(&self, sensor: usize, from: u64, last: u64, (low, high): (f64, f64)) -> Option<u64> {
        let (body, units, _) = self.laws.net.sensed[sensor];
        let powers = self.series.powers;
        let t = self.time_s(last);
        // What speed and acceleration can move at most, with more than its rounding.
        let [speed, position] = self.series.around.terms(&self.series.x, body, 0).map(|of| units * of);
        let most = (speed.abs() + 0.5 * (units * self.room.accelerations[body]).abs() * t) * t;
        let most = most + 8.0 * f64::EPSILON * (position.abs() + most);
        if position - most > low && position + most < high {
            return None;
        }
        let mut terms = [0.0; ORDER + 1];
        (0..=powers).for_each(|k| terms[k] = units * self.series.around.terms(&self.series.x, body, k)[1]);
        let size = (0..=powers).rev().fold(0.0, |sum, k| sum * t + (2 * k + 6) as f64 * terms[k].abs());
        let noise = f64::EPSILON * size;
        let polynomial = Polynomial::of(terms, powers + 1, t);
        let now = polynomial.at(self.time_s(from));
        let is_out = |edge| side(self.read(sensor, self.time_s(edge)), (low, high)) != 0;
        polynomial.leaves(now, (low, high, noise), (from, last), self.laws.edge_s, |edge| self.time_s(edge), is_out)
    }
}

/// Returns on which side of a band from `low`, inclusive, to `high` a value lies.
fn side(Double { hi, lo }: Double, (low, high): (f64, f64)) -> i8 {
    if hi < low || hi == low && lo < 0.0 {
        return -1;
    }
    i8::from(hi > high || hi == high && lo >= 0.0)
}
