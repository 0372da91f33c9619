//! Paths: times in s and positions, straight between their points, at rest before the first and after the last.

/// Returns position and speed at a time on a path.
pub fn along(path: &[(f64, f64)], time_s: f64) -> [f64; 2] {
    let next = path.partition_point(|point| point.0 <= time_s);
    match (next.checked_sub(1).map(|index| path[index]), path.get(next)) {
        (Some((from_s, from)), Some((to_s, to))) => {
            let slope = (to - from) / (to_s - from_s);
            [from + slope * (time_s - from_s), slope]
        }
        (Some((_, at)), None) | (None, Some(&(_, at))) => [at, 0.0],
        (None, None) => [0.0; 2],
    }
}

/// Returns the time from which on a path stands still; 0 for a path that never moves.
pub fn moves_until_s(path: &[(f64, f64)]) -> f64 {
    path.windows(2).rfind(|pair| pair[0].1 != pair[1].1).map_or(0.0, |pair| pair[1].0)
}
