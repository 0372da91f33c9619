//! How the wall time of a run is spread over its motion.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use hpu_cosim::Control;

/// Time between two looks at a run.
const LOOK: Duration = Duration::from_millis(5);

/// How far a run had come at some times of it. A run that costs twice as much in contact as in free motion shows it
/// here.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Profile {
    /// Pairs of wall time, in s, and clock edges done; both only grow.
    looks: Vec<(f64, u64)>,
}

impl Profile {
    /// Does some work, and records meanwhile how far its control says that it is.
    pub(super) fn of<T>(control: &Control, work: impl FnOnce() -> T) -> (T, Self) {
        let begin = Instant::now();
        let look = || (begin.elapsed().as_secs_f64(), control.progress.load(Ordering::Relaxed));
        let (alive, ended) = mpsc::channel::<()>();
        let (made, mut looks) = thread::scope(|scope| {
            let watch = scope.spawn(move || {
                let mut looks = vec![(0.0, 0)];
                while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                    looks.push(look());
                }
                looks
            });
            // Dropped when the work ends, even by a panic.
            let alive = alive;
            let made = work();
            drop(alive);
            (made, watch.join().unwrap_or_default())
        });
        looks.push(look());
        (made, Self { looks })
    }

    #[cfg(test)]
    pub(super) fn from_looks(looks: &[(f64, u64)]) -> Self {
        Self { looks: looks.to_vec() }
    }

    /// Returns the wall time of the whole run, in s.
    pub(super) fn wall_s(&self) -> f64 {
        self.looks.last().map_or(0.0, |(wall_s, _)| *wall_s)
    }

    /// Returns the share of the wall time that the first `edges` took, interpolated linearly between the looks.
    pub(super) fn share(&self, edges: u64) -> f64 {
        let after = self.looks.iter().position(|look| look.1 >= edges);
        let (Some(after), wall_s) = (after, self.wall_s()) else { return 1.0 };
        let (to_s, to) = self.looks[after];
        let (from_s, from) = self.looks[after.saturating_sub(1)];
        let part = if to > from { (edges - from) as f64 / (to - from) as f64 } else { 1.0 };
        (from_s + part * (to_s - from_s)) / wall_s
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;
    use std::thread::sleep;
    use std::time::{Duration, Instant};

    use hpu_cosim::Control;

    use super::Profile;

    #[test]
    fn the_share_of_a_part_follows_what_the_edges_cost_there() {
        // 100 edges in the first second, 300 in the next three, none while the last second goes by.
        let profile = Profile::from_looks(&[(0.0, 0), (1.0, 100), (4.0, 400), (5.0, 400)]);
        for (edges, share) in [(0, 0.0), (50, 0.1), (100, 0.2), (200, 0.4), (400, 0.8), (401, 1.0)] {
            assert!((profile.share(edges) - share).abs() < 1e-12, "{edges}: {}", profile.share(edges));
        }
    }

    #[test]
    fn a_run_is_looked_at_while_it_lasts() {
        let control = Control::default();
        let before = Instant::now();
        let (half_s, profile) = Profile::of(&control, || {
            let begin = Instant::now();
            // Half of the edges take four times as long as the others.
            sleep(Duration::from_millis(80));
            let least_s = begin.elapsed().as_secs_f64();
            control.progress.store(1000, Ordering::Relaxed);
            let most_s = before.elapsed().as_secs_f64();
            sleep(Duration::from_millis(20));
            control.progress.store(2000, Ordering::Relaxed);
            least_s..=most_s
        });
        assert!(profile.wall_s() >= 0.1 && profile.looks.len() > 2, "{profile:?}");
        // On a busy machine pauses are longer, and looks come late: the time of the half is known within the longest
        // time between two looks.
        let apart_s = profile.looks.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max);
        let found_s = profile.share(1000) * profile.wall_s();
        let bounds = half_s.start() - apart_s..=half_s.end() + apart_s;
        assert!(bounds.contains(&found_s), "{found_s} s of {half_s:?}: {profile:?}");
    }
}
