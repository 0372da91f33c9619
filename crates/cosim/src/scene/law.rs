//! The laws that a scene can choose by `method.kind`, and their keys.

use hpu_datapath::Estimator;
use hpu_signal::Format;

use super::keys;
use super::parameter::Origin;
use super::section::Section;
use super::source::SceneError;
use crate::law::{BoundingForm, Observer};

/// A law, with its parameters beyond the wall's, in SI units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LawMethod {
    /// Spring, and damping by an estimator at its own rate.
    SampledWall(SampledWallMethod),
    /// A massless tool between device and wall; the wall's stiffness is the environment's.
    VirtualCoupling {
        /// `K_c`.
        coupling_nm_per_rad: f64,
        /// `B_c`.
        coupling_nm_s_per_rad: f64,
        /// Whether the wall is rigid, whatever its stiffness.
        rigid: bool,
    },
    /// Passivity observer and controller.
    PassivityController {
        /// The force that the observer multiplies a motion by.
        observer: Observer,
        /// The most energy that may be stored.
        credit_j: Option<f64>,
        /// Width of the observed energy.
        energy_bits: u32,
    },
    /// Energy bounding.
    EnergyBounding {
        /// The published form, its constants in N·m/rad.
        form: BoundingForm,
        /// Format of the constants, in PWM counts per count.
        bound_format: Format,
        /// Width of the energy.
        energy_bits: u32,
    },
    /// The energy-level spring behind a passive sample-and-hold.
    PassiveSpring {
        /// Motion of the virtual spring per motion of the device.
        alpha: f64,
        /// Force shown per force of the virtual spring.
        beta: f64,
        /// Whether the spring engages again inside the wall after its extension has become 0.
        revive: bool,
        /// Fraction bits of the extension.
        extension_frac: u32,
    },
}

/// See [`LawMethod::SampledWall`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SampledWallMethod {
    /// Whether the spring reads the position at once, as in the hybrid loop.
    pub live: bool,
    /// The estimator of the velocity.
    pub estimator: Estimator,
    /// Periods of the spring per period of the velocity.
    pub ratio: u32,
    /// `log2` of the filter's weight.
    pub shift: u32,
    /// Samples of the window.
    pub window: u32,
    /// Noise bound of the adaptive window, in counts.
    pub noise: u32,
    /// Fraction bits of the velocity.
    pub velocity_frac: u32,
    /// Negative damping, inside the wall and outside.
    pub relief_nm_s_per_rad: f64,
}

impl LawMethod {
    /// Returns its name in `method.kind`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::SampledWall(_) => "sampled_wall",
            Self::VirtualCoupling { .. } => "virtual_coupling",
            Self::PassivityController { .. } => "passivity_controller",
            Self::EnergyBounding { .. } => "energy_bounding",
            Self::PassiveSpring { .. } => "passive_spring",
        }
    }
}

/// Reads the keys of a law; returns `None` if `kind` is not a law.
pub(super) fn law(s: &Section, kind: &str) -> Result<Option<LawMethod>, SceneError> {
    Ok(Some(match kind {
        "sampled_wall" => LawMethod::SampledWall(sampled_wall(s)?),
        "virtual_coupling" => {
            use keys::virtual_coupling as key;
            LawMethod::VirtualCoupling {
                coupling_nm_per_rad: s.read(&key::coupling_stiffness)?,
                coupling_nm_s_per_rad: s.read(&key::coupling_damping)?,
                rigid: s.read(&key::rigid)?,
            }
        }
        "passivity_controller" => {
            use keys::passivity_controller as key;
            LawMethod::PassivityController {
                observer: s.read(&key::observer)?,
                credit_j: s.given(&key::credit)?,
                energy_bits: s.read(&key::energy_bits)?,
            }
        }
        "energy_bounding" => energy_bounding(s)?,
        "passive_spring" => {
            use keys::passive_spring as key;
            LawMethod::PassiveSpring {
                alpha: s.read(&key::alpha)?,
                beta: s.read(&key::beta)?,
                revive: s.read(&key::revive)?,
                extension_frac: s.read(&key::extension_frac)?,
            }
        }
        _ => return Ok(None),
    }))
}

fn energy_bounding(s: &Section) -> Result<LawMethod, SceneError> {
    use keys::energy_bounding as key;
    let c1 = s.read(&key::c1)?;
    let by_force = s.read(&key::form)?;
    let form = if by_force {
        if s.has(key::c2.name) {
            return Err(s.error("c2", "the force bound has one constant, c1 = b/T; leave this out"));
        }
        BoundingForm::ForceBound(c1)
    } else {
        let c2 = s.read_or(&key::c2, c1, Origin::Default)?;
        if c2 > c1 {
            return Err(s.error("c2", "above c1, where no force is feasible for some motions; write 0 < c2 <= c1"));
        }
        BoundingForm::C1C2(c1, c2)
    };
    Ok(LawMethod::EnergyBounding {
        form,
        bound_format: s.read(&key::bound_format)?,
        energy_bits: s.read(&key::energy_bits)?,
    })
}

/// Returns the keys of estimators that this one does not take.
pub(super) fn foreign(estimator: Estimator) -> impl Iterator<Item = &'static str> {
    let owners = [
        ("method.filter_shift", &[Estimator::Filtered][..]),
        ("method.window", &[Estimator::Window, Estimator::Foaw]),
        ("method.noise", &[Estimator::Foaw]),
    ];
    owners.into_iter().filter(move |(_, owners)| !owners.contains(&estimator)).map(|(key, _)| key)
}

fn sampled_wall(s: &Section) -> Result<SampledWallMethod, SceneError> {
    use keys::sampled_wall as key;
    let estimator = s.read(&key::estimator)?;
    let mut foreign = foreign(estimator).filter_map(|path| path.strip_prefix("method."));
    if let Some(key) = foreign.find(|key| s.has(key)) {
        return Err(s.error(key, "not a number of this estimator; leave it out"));
    }
    Ok(SampledWallMethod {
        live: s.read(&key::spring)?,
        estimator,
        ratio: s.read(&key::velocity_every)?,
        shift: s.read(&key::filter_shift)?,
        window: s.read(&key::window)?,
        noise: s.read(&key::noise)?,
        velocity_frac: s.read(&key::velocity_frac)?,
        relief_nm_s_per_rad: s.read(&key::negative_damping)?,
    })
}
