//! Paths: times in s and positions, straight between their points, at rest before the first and after the last; and
//! targets, which follow one.

/// A straight piece of a path, or its rest before the first point or after the last.
struct Piece {
    from_s: f64,
    until_s: f64,
    position: f64,
    speed: f64,
}

impl Piece {
    /// Returns the piece of a path at a time.
    fn at(path: &[(f64, f64)], time_s: f64) -> Self {
        let next = path.partition_point(|point| point.0 <= time_s);
        let rest = |from_s, until_s, position| Self { from_s, until_s, position, speed: 0.0 };
        match (next.checked_sub(1).map(|index| path[index]), path.get(next)) {
            (Some((from_s, from)), Some(&(until_s, to))) => {
                Self { speed: (to - from) / (until_s - from_s), ..rest(from_s, until_s, from) }
            }
            (Some((from_s, at)), None) => rest(from_s, f64::INFINITY, at),
            (None, Some(&(until_s, at))) => rest(time_s, until_s, at),
            (None, None) => rest(time_s, f64::INFINITY, 0.0),
        }
    }

    #[inline]
    fn position(&self, time_s: f64) -> f64 {
        self.position + self.speed * (time_s - self.from_s)
    }
}

/// Returns position and speed at a time on a path.
pub fn along(path: &[(f64, f64)], time_s: f64) -> [f64; 2] {
    let piece = Piece::at(path, time_s);
    [piece.position(time_s), piece.speed]
}

/// Returns the positions on a path at times, of which none is before the first.
pub fn positions_along(path: &[(f64, f64)], times_s: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    let mut piece = Piece { from_s: 0.0, until_s: f64::NEG_INFINITY, position: 0.0, speed: 0.0 };
    times_s.map(move |time_s| {
        if time_s >= piece.until_s {
            piece = Piece::at(path, time_s);
        }
        piece.position(time_s)
    })
}

/// Returns the time from which on a path stands still; 0 for a path that never moves.
pub fn moves_until_s(path: &[(f64, f64)]) -> f64 {
    path.windows(2).rfind(|pair| pair[0].1 != pair[1].1).map_or(0.0, |pair| pair[1].0)
}

/// A sine that begins at a time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sine {
    /// Its amplitude, which is not 0.
    pub amplitude: f64,
    /// Its frequency.
    pub frequency_hz: f64,
    /// The time at which it begins.
    pub from_s: f64,
}

/// The motion of the target of an axis: a path, to which a sine may be added.
#[derive(Clone, PartialEq, Debug)]
pub struct AxisTarget {
    /// The path: at least one point.
    pub path: Vec<(f64, f64)>,
    /// The sine.
    pub sine: Option<Sine>,
}

impl AxisTarget {
    /// Returns the position at a time.
    pub fn at(&self, time_s: f64) -> f64 {
        let swing = self.sine.map_or(0.0, |sine| {
            // A whole number of periods has no part in the phase.
            let turns = (sine.frequency_hz * (time_s - sine.from_s).max(0.0)).fract();
            sine.amplitude * libm::sin(std::f64::consts::TAU * turns)
        });
        Piece::at(&self.path, time_s).position(time_s) + swing
    }

    /// Returns the target in other units, each of which is so many of its own.
    #[must_use]
    pub(crate) fn in_units_of(mut self, unit: f64) -> Self {
        self.path.iter_mut().for_each(|point| point.1 /= unit);
        if let Some(sine) = &mut self.sine {
            sine.amplitude /= unit;
        }
        self
    }

    /// Returns the time from which on it stands still; infinity for a sine.
    pub fn moves_until_s(&self) -> f64 {
        if self.sine.is_some() { f64::INFINITY } else { moves_until_s(&self.path) }
    }

    /// Returns the first time, from this one on, at which it moves; `None` if it stands still from there on.
    pub(crate) fn moves_from_s(&self, time_s: f64) -> Option<f64> {
        let next = self.path.partition_point(|point| point.0 <= time_s);
        let ahead = &self.path[next.saturating_sub(1)..];
        let straight = ahead.windows(2).find(|pair| pair[0].1 != pair[1].1).map(|pair| pair[0].0);
        let all = straight.into_iter().chain(self.sine.map(|sine| sine.from_s));
        all.reduce(f64::min).map(|from_s| from_s.max(time_s))
    }

    /// Returns the longest way that a straight piece of the path goes in a time, with the point that ends the piece,
    /// and the longest way that the sine goes.
    pub(crate) fn fastest(&self, span_s: f64) -> ((f64, usize), f64) {
        let swing = |sine: Sine| sine.amplitude.abs() * (std::f64::consts::TAU * sine.frequency_hz * span_s).min(2.0);
        let pieces = self.path.windows(2).zip(1..).map(|(pair, index)| {
            let [(from_s, from), (to_s, to)] = [pair[0], pair[1]];
            ((to - from).abs() * (span_s / (to_s - from_s)).min(1.0), index)
        });
        let longest = pieces.reduce(|most, piece| if piece.0 > most.0 { piece } else { most });
        (longest.unwrap_or((0.0, 0)), self.sine.map_or(0.0, swing))
    }
}
