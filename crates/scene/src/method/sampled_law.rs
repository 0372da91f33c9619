//! The interface of the reference laws in floats.

/// A `SampledLaw` is a law that is sampled and held. The reference laws implement it, all but
/// [`MidpointSpring`](super::passive_spring::MidpointSpring), so that one loop runs them all.
///
/// ```
/// use hpu_scene::method::SampledLaw;
///
/// /// A spring without damping.
/// struct Spring(f64);
///
/// impl SampledLaw for Spring {
///     fn sample(&mut self, x_m: f64) -> f64 {
///         self.0 * x_m.max(0.0)
///     }
///     fn vary(&mut self, stiffness_n_per_m: f64, _: f64) {
///         self.0 = stiffness_n_per_m;
///     }
/// }
///
/// let mut spring = Spring(1000.0);
/// assert_eq!(spring.sample(0.002), 2.0);
/// assert_eq!(spring.sample(-0.002), 0.0);
/// ```
pub trait SampledLaw {
    /// Returns the force from this sample to the next, for the position `x_m` beyond the surface at this sample.
    fn sample(&mut self, x_m: f64) -> f64;

    /// Sets the stiffness, and the scale of a force that has one, from now on, as a ramp changes them.
    fn vary(&mut self, stiffness_n_per_m: f64, scale: f64);

    /// Sets the position that the law leads to, as far beyond the surface, from now on. Only laws that follow a target
    /// have one.
    fn aim(&mut self, target_m: f64) {
        let _ = target_m;
    }

    /// Returns the force at a position between two samples, if the law has a spring that can read it at once.
    #[inline]
    fn live_n(&self, x_m: f64) -> Option<f64> {
        let _ = x_m;
        None
    }
}
