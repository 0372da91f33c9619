//! Paths: times in s and positions, straight between their points, at rest before the first and after the last.

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
