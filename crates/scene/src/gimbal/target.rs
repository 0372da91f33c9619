//! The motion that a host asks of the segment: height, pitch and roll over time.

use crate::random::SplitMix64;

hpu_signal::named! {
    /// The kind of a target's motion.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum TargetKind {
        /// Straight from point to point.
        Path = "path",
        /// A sum of sines.
        Sines = "sines",
        /// Smooth from random point to random point.
        Random = "random",
    }
}

/// A height in m above the least radius, a pitch and a roll in rad.
pub type Posture = [f64; 3];

/// The motion of a target: its points, and sines added to it.
#[derive(Clone, PartialEq, Debug)]
pub struct Target {
    /// Times in s and postures, in the order of time; at least one. The posture is constant before and after.
    pub points: Vec<(f64, Posture)>,
    /// Whether the motion from point to point is smooth (the path of least jerk), not straight.
    pub is_smooth: bool,
    /// Amplitude and frequency in Hz of the sines of height, pitch and roll.
    pub waves: [Vec<[f64; 2]>; 3],
    /// Rate in Hz at which the host writes the target's words.
    pub rate_hz: f64,
}

impl Target {
    /// Returns random points around a middle, one an interval, from the first on to `end_s`. The first is the middle.
    pub(crate) fn random(
        random: &mut SplitMix64,
        middle_m: f64,
        ranges: Posture,
        interval_s: f64,
        end_s: f64,
    ) -> Vec<(f64, Posture)> {
        let mut unit = || random.below(1 << 53) as f64 / (1u64 << 52) as f64 - 1.0;
        let count = (end_s / interval_s).ceil().min(1e6) as u32;
        let drawn = (1..=count).map(|index| {
            let posture = [middle_m + ranges[0] * unit(), ranges[1] * unit(), ranges[2] * unit()];
            (f64::from(index) * interval_s, posture)
        });
        [(0.0, [middle_m, 0.0, 0.0])].into_iter().chain(drawn).collect()
    }

    /// Returns the posture at a time.
    pub fn at(&self, time_s: f64) -> Posture {
        let next = self.points.partition_point(|point| point.0 <= time_s);
        let mut posture = match (next.checked_sub(1).map(|index| self.points[index]), self.points.get(next)) {
            (None, Some(point)) => point.1,
            (Some(point), None) => point.1,
            (Some((from_s, from)), Some((to_s, to))) => {
                let share = (time_s - from_s) / (to_s - from_s);
                // The quintic from rest to rest of least mean square jerk.
                let smooth = share * share * share * (10.0 + share * (-15.0 + 6.0 * share));
                let share = if self.is_smooth { smooth } else { share };
                [0, 1, 2].map(|i| from[i] + (to[i] - from[i]) * share)
            }
            (None, None) => [0.0; 3],
        };
        for (value, waves) in posture.iter_mut().zip(&self.waves) {
            for [amplitude, frequency_hz] in waves {
                // A whole number of periods has no part in the phase.
                *value += amplitude * libm::sin(std::f64::consts::TAU * (frequency_hz * time_s).fract());
            }
        }
        posture
    }

    /// Returns whether the target moves after this time.
    pub fn moves_after(&self, time_s: f64) -> bool {
        let waves = self.waves.iter().flatten().any(|[amplitude, frequency_hz]| amplitude * frequency_hz != 0.0);
        waves || self.points.windows(2).any(|pair| pair[1].0 > time_s && pair[0].1 != pair[1].1)
    }

    /// Returns bounds of height, pitch and roll: the least and the greatest.
    pub fn bounds(&self) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|i| {
            let swing: f64 = self.waves[i].iter().map(|wave| wave[0].abs()).sum();
            let values = self.points.iter().map(|point| point.1[i]);
            let [low, high] =
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
            [low - swing, high + swing]
        })
    }
}
