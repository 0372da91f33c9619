//! A spring in discrete time that keeps the energy it was given, behind a passive sample-and-hold.
//!
//! The sample-and-hold matches energies exactly. The force `F(k)` is held while the device moves from `x(k)` to
//! `x(k+1)`, and the spring gets the motion `x(k+1) - x(k)`, so that both sides count `Σ F(k) (x(k+1) - x(k))`,
//! whatever happens in between.
//!
//! - [`PassiveSpring`], energy level by energy level, causal: `F = β k s`, `s' = √(s² + 2 α s (x(k+1) - x(k)))`, so
//!   that `k s²/2` takes exactly `k s α Δx`. It engages at the surface with `s = x`.
//! - [`MidpointSpring`]: `F = k (s + s')/2`, lossless; it needs the position that the force itself leads to, and so the
//!   mass: for simulation only.
//!
//! With `β = α = 1` the spring is passive by itself; otherwise power is scaled by `β/α`, and `β k s²/(2α)` is the
//! storage.
//!
//! **Sources**: the seed on power scaling (its `e_c = e_d/β` is here a `β` below 1); Stramigioli et al. 2005 for the
//! sample-and-hold; the energy level after the energy-leap idea of Stramigioli and Secchi (general knowledge).
//! **Known failures**: against `s + Δx` it loses `k Δx²/2` a sample, so its rest position drifts; at `s = 0` it gives
//! no force until it engages anew; a retreat by more than `s/2` within one sample takes out more than is stored
//! (`overdrawn_j`); a `β` that changes while the spring rings scales power by another factor on the way in than on the
//! way out.

use hpu_datapath::SpringConfig;
use hpu_signal::Format;

use crate::method::published::{Features, Layer, Published};
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::schema::Otherwise::Is;
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::Within;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Flag, Group, Key, Quantity, Whole, keys};

keys! { passive_spring: "method" of ["passive_spring"];
    /// Motion of the virtual spring for one of the device.
    alpha: Quantity = Quantity::new(&q::RATIO, Within(1e-9, 1e9), Is(1.0));
    /// Force shown for one of the virtual spring, in `scale_format`.
    beta: Quantity = Quantity::new(&q::RATIO, Within(1e-9, 1e9), Is(1.0));
    /// Engages the spring again inside the wall after it has died.
    revive: Flag = Flag(true);
    /// Fraction bits of the extension.
    extension_frac: Whole<u32> = Whole::new(8, 16, Is(8));
}

/// The energy-level spring behind a passive sample-and-hold in a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SpringMethod {
    /// Motion of the virtual spring per motion of the device.
    pub alpha: f64,
    /// Force shown per force of the virtual spring.
    pub beta: f64,
    /// Whether the spring engages again inside the wall after its extension has become 0.
    pub revive: bool,
    /// Fraction bits of the extension.
    pub extension_frac: u32,
}

impl Published for SpringMethod {
    type Block = hpu_datapath::PassiveSpring;
    type Float = PassiveSpring;

    const KEYS: &'static Group = &passive_spring::GROUP;
    const SCALE_KEY: Option<&'static str> = Some("method.beta");
    const LAYERS: &'static [Layer] = &[Layer { label: "passive spring", set: &[] }];

    fn read(s: &Section) -> Result<Self, SceneError> {
        use passive_spring as key;
        Ok(Self {
            alpha: s.read(&key::alpha)?,
            beta: s.read(&key::beta)?,
            revive: s.read(&key::revive)?,
            extension_frac: s.read(&key::extension_frac)?,
        })
    }

    fn block(&self, setting: &Setting) -> Result<Self::Block, Unmade> {
        let format = Format::new(false, 8, 8).expect("16 bits");
        let alpha = setting.word("method.alpha", self.alpha, 1.0, "", format)?;
        let Self { extension_frac, revive, .. } = *self;
        Ok(Self::Block::new(SpringConfig { widths: setting.widths, extension_frac, alpha, revive })?)
    }

    fn float(&self, setting: &Setting) -> Result<PassiveSpring, SceneError> {
        let Self { alpha, beta, revive, .. } = *self;
        let spring = PassiveSpring::new(setting.stiffness_n_per_m, revive, setting.start_m);
        Ok(PassiveSpring { alpha, beta, ..spring })
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        Vec::new()
    }

    fn features(&self) -> Features {
        Features { scale: self.beta, ..Features::default() }
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct PassiveSpring {
    /// `k`.
    pub stiffness_n_per_m: f64,
    /// `α`.
    pub alpha: f64,
    /// `β`.
    pub beta: f64,
    /// Whether the spring engages again inside the wall after its extension has become 0.
    pub revive: bool,
    extension_m: f64,
    touching: bool,
    previous_m: f64,
    /// Energy given by engaging.
    engaged_j: f64,
    /// Energy taken out beyond what was stored.
    overdrawn_j: f64,
}

impl PassiveSpring {
    /// Creates a spring at rest, the device at `start_m` beyond the surface.
    pub fn new(stiffness_n_per_m: f64, revive: bool, start_m: f64) -> Self {
        Self {
            stiffness_n_per_m,
            alpha: 1.0,
            beta: 1.0,
            revive,
            extension_m: 0.0,
            touching: false,
            previous_m: start_m,
            engaged_j: 0.0,
            overdrawn_j: 0.0,
        }
    }

    /// Returns `s`.
    pub fn extension_m(&self) -> f64 {
        self.extension_m
    }

    /// Returns `k s²/2`.
    pub fn stored_j(&self) -> f64 {
        0.5 * self.stiffness_n_per_m * self.extension_m * self.extension_m
    }

    /// Returns the energy that engaging has added so far, without work of the device.
    pub fn engaged_j(&self) -> f64 {
        self.engaged_j
    }

    /// Returns the energy that the device has taken out so far beyond the stored energy.
    pub fn overdrawn_j(&self) -> f64 {
        self.overdrawn_j
    }
}

impl SampledLaw for PassiveSpring {
    fn sample(&mut self, x_m: f64) -> f64 {
        let motion_m = self.alpha * (x_m - self.previous_m);
        self.previous_m = x_m;
        let touches = x_m >= 0.0;
        let engages = self.extension_m == 0.0 && touches && (!self.touching || self.revive);
        self.touching = touches;
        if engages {
            self.extension_m = x_m;
            self.engaged_j += self.stored_j();
        } else {
            let square = self.extension_m * (self.extension_m + 2.0 * motion_m);
            self.overdrawn_j += 0.5 * self.stiffness_n_per_m * (-square).max(0.0);
            self.extension_m = square.max(0.0).sqrt();
        }
        self.beta * self.stiffness_n_per_m * self.extension_m
    }

    fn vary(&mut self, stiffness_n_per_m: f64, scale: f64) {
        (self.stiffness_n_per_m, self.beta) = (stiffness_n_per_m, scale);
    }
}

/// A lossless spring between the origin and a mass without damping, from sample to sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MidpointSpring {
    /// `k`.
    pub stiffness_n_per_m: f64,
    /// `m`.
    pub mass_kg: f64,
    /// `T`.
    pub period_s: f64,
}

impl MidpointSpring {
    /// Returns position and speed a period later, with `F = -k (q + v T/2) / (1 + k T²/(4 m))` held.
    pub fn step(&self, (q_m, v_m_per_s): (f64, f64)) -> (f64, f64) {
        let (k, m, t) = (self.stiffness_n_per_m, self.mass_kg, self.period_s);
        let force_n = -k * (q_m + 0.5 * v_m_per_s * t) / (1.0 + k * t * t / (4.0 * m));
        let a = force_n / m;
        (q_m + t * (v_m_per_s + 0.5 * a * t), v_m_per_s + a * t)
    }

    /// Returns `m v²/2 + k q²/2`.
    pub fn energy_j(&self, (q_m, v_m_per_s): (f64, f64)) -> f64 {
        0.5 * (self.mass_kg * v_m_per_s * v_m_per_s + self.stiffness_n_per_m * q_m * q_m)
    }
}
