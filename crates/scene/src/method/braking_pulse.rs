//! A wall that takes the momentum out at its entry by one pulse of braking, then a spring and a damper.
//!
//! At the first sample inside the wall the force is `K x + B v + m v / T`: held over the sample, the last term takes
//! out the momentum `m v` that the device enters with. Where the actuator cannot show it, the pulse goes on at the next
//! sample with the speed that is left. `v = (x(k) - x(k-1)) / T`, and only a device that moves into the wall is braked.
//!
//! **Source**: Salcudean and Vlaar 1997, whose pulse has one sample and is cut off at the actuator's greatest force.
//! **Known failures**: the speed is the mean of the last sample; a count that toggles at the surface makes a pulse each
//! time.

use hpu_datapath::PulseConfig;
use hpu_signal::Format;

use crate::method::published::{Features, Layer, Published};
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::schema::Otherwise::Is;
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::UpTo;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Group, Key, Quantity, keys};

keys! { braking_pulse: "method" of ["braking_pulse"];
    /// Share of the device's momentum that the pulse takes out.
    momentum: Quantity = Quantity::new(&q::RATIO, UpTo(10.0), Is(1.0));
}

/// A wall with a braking pulse in a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PulseMethod {
    /// Share of the device's momentum that the pulse takes out.
    pub momentum: f64,
}

impl Published for PulseMethod {
    type Block = hpu_datapath::BrakingPulse;
    type Float = BrakingPulse;

    const KEYS: &'static Group = &braking_pulse::GROUP;
    const LAYERS: &'static [Layer] = &[Layer { label: "braking pulse", set: &[] }];

    fn read(s: &Section) -> Result<Self, SceneError> {
        Ok(Self { momentum: s.read(&braking_pulse::momentum)? })
    }

    fn block(&self, setting: &Setting) -> Result<Self::Block, Unmade> {
        let frac = setting.widths.damping.frac();
        let format = Format::new(false, 31 - frac, frac).expect("31 bits");
        let asked = self.momentum * setting.mass_kg / setting.period_s;
        let unit = setting.stiffness_unit() * setting.period_s;
        let pulse = setting.word("method.momentum", asked, unit, "", format)?;
        Ok(Self::Block::new(PulseConfig { widths: setting.widths, pulse })?)
    }

    fn float(&self, setting: &Setting) -> Result<BrakingPulse, SceneError> {
        let Setting { stiffness_n_per_m, damping_n_s_per_m, period_s, limit_n, start_m, .. } = *setting;
        let mass_kg = self.momentum * setting.mass_kg;
        Ok(BrakingPulse::new([stiffness_n_per_m, damping_n_s_per_m, mass_kg], period_s, limit_n, start_m))
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        Vec::new()
    }

    fn features(&self) -> Features {
        Features::default()
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct BrakingPulse {
    /// `K`.
    pub stiffness_n_per_m: f64,
    /// `B`.
    pub damping_n_s_per_m: f64,
    /// `m`.
    pub mass_kg: f64,
    /// `T`.
    pub period_s: f64,
    /// The actuator's greatest force.
    pub limit_n: f64,
    previous_m: f64,
    touching: bool,
    braking: bool,
    pulse_n: f64,
}

impl BrakingPulse {
    /// Creates a wall of `K`, `B` and `m`, the device at `start_m` beyond its surface.
    pub fn new(
        [stiffness_n_per_m, damping_n_s_per_m, mass_kg]: [f64; 3],
        period_s: f64,
        limit_n: f64,
        start_m: f64,
    ) -> Self {
        Self {
            stiffness_n_per_m,
            damping_n_s_per_m,
            mass_kg,
            period_s,
            limit_n,
            previous_m: start_m,
            touching: false,
            braking: false,
            pulse_n: 0.0,
        }
    }

    /// Returns the pulse of the latest sample.
    pub fn pulse_n(&self) -> f64 {
        self.pulse_n
    }
}

impl SampledLaw for BrakingPulse {
    fn sample(&mut self, x_m: f64) -> f64 {
        let speed = (x_m - self.previous_m) / self.period_s;
        self.previous_m = x_m;
        let inside = x_m >= 0.0;
        let wall_n = self.stiffness_n_per_m * x_m + self.damping_n_s_per_m * speed;
        let wanted_n = if inside { wall_n.clamp(-self.limit_n, self.limit_n) } else { 0.0 };
        let brakes = inside && speed > 0.0 && (!self.touching || self.braking);
        self.pulse_n = if brakes { self.mass_kg * speed / self.period_s } else { 0.0 };
        self.touching = inside;
        self.braking = brakes && wanted_n + self.pulse_n > self.limit_n;
        (wanted_n + self.pulse_n).clamp(-self.limit_n, self.limit_n)
    }

    fn vary(&mut self, stiffness_n_per_m: f64, _: f64) {
        self.stiffness_n_per_m = stiffness_n_per_m;
    }
}
