//! Time-domain passivity: an observer that sums the energy which the wall takes in, and a controller that adds a damper
//! for one sample whenever that sum is negative.
//!
//! - [`Observer::Velocity`], as published: `W(n) = W(n-1) + F₂(n) d(n) + c(n-1) d(n-1)`, `F₂` being the force that the
//!   wall asks for now.
//! - [`Observer::HeldForce`]: `W(n) = W(n-1) + F(n-1) d(n)`, with the force that really was held while the device moved
//!   by `d(n)`: the exact energy between the samples.
//!
//! `c(n) = -W(n)/d(n)` if `W(n) < 0` and `d(n) ≠ 0`, else 0; `F = F₂ + c`, each within what the actuator can give.
//! Energy that this limit leaves undissipated stays in `W`, and later samples dissipate it.
//!
//! **Source**: Hannaford and Ryu 2002.
//! **Known failures**: at standstill (`d = 0`) no energy can be dissipated; credit stored earlier delays the action
//! (`credit_j` bounds it); the published observer does not see the energy that the hold adds between samples.

use hpu_datapath::PassivityConfig;
use hpu_signal::Format;

use crate::method::published::{ENERGY, Features, Layer, Published};
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::method::wall::Wall;
use crate::schema::Otherwise::{Is, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::Positive;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Choice, Group, Key, Quantity, Whole, keys, named};

keys! { passivity_controller: "method" of ["passivity_controller"];
    /// Force that the passivity observer multiplies a motion by: the velocity's, or the force that was held.
    observer: Choice<Observer> = Choice::new(|| named(&Observer::ALL, Observer::name), Is(Observer::Velocity));
    /// Greatest energy that the observer may store.
    credit: Quantity = Quantity::new(&q::ENERGY, Positive, Said("unbounded"));
    /// Width of the observed energy.
    energy_bits: Whole<u32> = ENERGY;
}

/// Passivity observer and controller in a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PassivityMethod {
    /// The force that the observer multiplies a motion by.
    pub observer: Observer,
    /// The most energy that may be stored.
    pub credit_j: Option<f64>,
    /// Width of the observed energy.
    pub energy_bits: u32,
}

impl Published for PassivityMethod {
    type Block = hpu_datapath::PassivityController;
    type Float = PassivityController;

    const KEYS: &'static Group = &passivity_controller::GROUP;
    const LAYERS: &'static [Layer] = &[
        Layer { label: "PO/PC", set: &[] },
        Layer { label: "PO/PC, held force", set: &[("method.observer", "held_force")] },
    ];

    fn read(s: &Section) -> Result<Self, SceneError> {
        use passivity_controller as key;
        Ok(Self {
            observer: s.read(&key::observer)?,
            credit_j: s.given(&key::credit)?,
            energy_bits: s.read(&key::energy_bits)?,
        })
    }

    fn block(&self, setting: &Setting) -> Result<Self::Block, Unmade> {
        let word = |j| setting.word("method.credit", j, setting.energy_unit_j(), "J", Format::unsigned(31));
        let credit = self.credit_j.map(word).transpose()?.unwrap_or(0);
        let exact = self.observer == Observer::HeldForce;
        let config = PassivityConfig { widths: setting.widths, exact, energy_width: self.energy_bits, credit };
        Ok(Self::Block::new(config)?)
    }

    fn float(&self, setting: &Setting) -> Result<PassivityController, SceneError> {
        let credit_j = self.credit_j.unwrap_or(f64::INFINITY);
        let Setting { limit_n, start_m, .. } = *setting;
        Ok(PassivityController::new(setting.wall(1), self.observer, credit_j, limit_n, start_m))
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        self.credit_j.iter_mut().collect()
    }

    fn features(&self) -> Features {
        Features::default()
    }
}

hpu_signal::named! {
    /// The force that the passivity observer multiplies a motion by.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Observer {
        /// The force wanted at the motion's end, as published.
        Velocity = "velocity",
        /// The force held during the motion.
        HeldForce = "held_force",
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct PassivityController {
    /// The wall whose energy is watched.
    pub wall: Wall,
    /// The observer's force.
    pub observer: Observer,
    /// The most energy that may be stored; infinite in the published method.
    pub credit_j: f64,
    /// The actuator's greatest force.
    pub limit_n: f64,
    energy_j: f64,
    previous_m: f64,
    motion_m: f64,
    correction_n: f64,
    force_n: f64,
}

impl PassivityController {
    /// Creates a controller of a wall, the device at `start_m` beyond the surface.
    pub fn new(wall: Wall, observer: Observer, credit_j: f64, limit_n: f64, start_m: f64) -> Self {
        Self {
            wall,
            observer,
            credit_j,
            limit_n,
            energy_j: 0.0,
            previous_m: start_m,
            motion_m: 0.0,
            correction_n: 0.0,
            force_n: 0.0,
        }
    }

    /// Returns `W`.
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }
}

impl SampledLaw for PassivityController {
    fn sample(&mut self, x_m: f64) -> f64 {
        let wanted_n = self.wall.sample(x_m).clamp(-self.limit_n, self.limit_n);
        let motion_m = x_m - self.previous_m;
        let taken_j = match self.observer {
            Observer::Velocity => wanted_n * motion_m + self.correction_n * self.motion_m,
            Observer::HeldForce => self.force_n * motion_m,
        };
        self.energy_j = (self.energy_j + taken_j).min(self.credit_j);
        let needed_n = if self.energy_j < 0.0 && motion_m != 0.0 { -self.energy_j / motion_m } else { 0.0 };
        self.force_n = (wanted_n + needed_n.clamp(-self.limit_n, self.limit_n)).clamp(-self.limit_n, self.limit_n);
        self.correction_n = self.force_n - wanted_n;
        (self.previous_m, self.motion_m) = (x_m, motion_m);
        self.force_n
    }

    fn vary(&mut self, stiffness_n_per_m: f64, _: f64) {
        self.wall.stiffness_n_per_m = stiffness_n_per_m;
    }
}
