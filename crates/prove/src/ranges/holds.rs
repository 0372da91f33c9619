//! Checks that the words of a haptic loop hold every value that the device can cause.

use hpu_cosim::AxisLoop;
use hpu_cosim::scene::{Loop, Scene};
use hpu_datapath::{ConventionalLoop, HybridLoop};

use super::device::Shaft;
use super::haptic::NetRanges;
use super::narrowed;
use super::travel::Settings;
use crate::Error;
use hpu_signal::Span;

/// The proved ranges of a loop's words. They hold for every motion within the device's limits, and for every stiffness
/// from the scene's own up to the stiffest that its format holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ProvedRanges {
    /// Least and greatest displacement, in counts.
    pub delta: (i64, i64),
    /// Least and greatest velocity, in its unit.
    pub velocity: (i64, i64),
}

/// A scene's device and hand, for proofs of loops that differ only in widths.
pub struct Limits<'s> {
    shaft: Shaft<'s>,
}

impl<'s> Limits<'s> {
    /// Finds the limits of a scene's device.
    ///
    /// # Errors
    ///
    /// Why none are proved, as for the limits of a shaft.
    pub fn new(scene: &'s Scene) -> Result<Self, Error> {
        Shaft::new(scene).map(|shaft| Self { shaft })
    }

    /// Returns the proved ranges of a scene that differs only in widths from the scene of [`new`](Self::new).
    ///
    /// Position and velocity hold every value that belongs in them: the displacement is never read with the other sign,
    /// and the velocity never saturates. Products that saturate are limited to the modulator's full command, whatever
    /// the widths of their factors. Products that drop their upper bits never lose any.
    ///
    /// # Errors
    ///
    /// The width that is too narrow, or why the scene has no words.
    pub fn held(&self, scene: &Scene) -> Result<ProvedRanges, Error> {
        let words = scene.words()?;
        let mut settings = Settings::new(&words, scene.device.units().position);
        settings.stiffness = settings.stiffness.hull(Span::exact(scene.method.stiffness_format.max()));
        let wiring = match scene.method.kind {
            Loop::Conventional => ConventionalLoop::new(words.config).map(AxisLoop::Conventional),
            _ => HybridLoop::new(words.config).map(AxisLoop::Hybrid),
        };
        let wiring = wiring?;
        let found = narrowed(&self.shaft, &words, scene, &settings, |travel| NetRanges::of(&settings, travel, &wiring));
        if found.travel.counts.is_none() {
            return Err("no limit of the travel is proved".into());
        }
        let word = |net: &str| found.rows.get(net);
        for (net, key) in [("delta", "position_bits"), ("velocity", "velocity_bits")] {
            if !word(net).fits {
                return Err(format!("method.{key}: too few bits for the range proved").into());
            }
        }
        if !words.config.saturate && !["spring", "drag"].into_iter().all(|net| word(net).fits) {
            return Err("method.product: \"drop_upper\" drops bits within the range proved; write \"saturate\"".into());
        }
        let ends = |net: &str| (word(net).span.min as i64, word(net).span.max as i64);
        Ok(ProvedRanges { delta: ends("delta"), velocity: ends("velocity") })
    }
}
