//! The points that no other point beats in both speed and error.

/// Returns the indices of the points of speed and error that no other point beats, the slowest first.
///
/// A point is beaten by a point that is at least as fast, at most as wrong, and better in one of the two; two equal
/// points both stay. Points whose speed or error is not finite are ignored.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let sound = |index: &usize| points[*index].0.is_finite() && points[*index].1.is_finite();
    let mut order: Vec<usize> = (0..points.len()).filter(sound).collect();
    // The fastest first, and among equally fast ones the least wrong: a point stays if it is less wrong than all before
    // it.
    order.sort_by(|&a, &b| points[b].0.total_cmp(&points[a].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut kept: Vec<usize> = Vec::new();
    for index in order {
        let beaten =
            kept.last().is_some_and(|&last| points[last].1 <= points[index].1 && points[last] != points[index]);
        if !beaten {
            kept.push(index);
        }
    }
    kept.reverse();
    kept
}
