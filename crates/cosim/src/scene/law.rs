//! The laws that a scene can choose by `method.kind`, and their keys.

use hpu_datapath::Estimator;
use hpu_signal::Format;

use super::quantity as q;
use super::read_device::Axis;
use super::section::Section;
use super::section::Sense::{NotNegative, Positive, Within};
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

/// Returns the keys of a law, in addition to those of every method; `None` if there is no such law.
pub(super) fn keys(kind: &str) -> Option<&'static [&'static str]> {
    match kind {
        "sampled_wall" => Some(&[
            "spring",
            "estimator",
            "velocity_every",
            "filter_shift",
            "window",
            "noise",
            "velocity_frac",
            "negative_damping",
        ]),
        "virtual_coupling" => Some(&["coupling_stiffness", "coupling_damping", "rigid"]),
        "passivity_controller" => Some(&["observer", "credit", "energy_bits"]),
        "energy_bounding" => Some(&["form", "c1", "c2", "bound_format", "energy_bits"]),
        "passive_spring" => Some(&["alpha", "beta", "revive", "extension_frac", "scale_format"]),
        _ => None,
    }
}

/// Reads the keys of a law; returns `None` if `kind` is not a law.
pub(super) fn law(s: &Section, kind: &str, axis: &Axis) -> Result<Option<LawMethod>, SceneError> {
    let small = |key: &str, least: u64, most: u64, default: u64| -> Result<u32, SceneError> {
        Ok(s.integer(key, least, most, Some(default))? as u32)
    };
    Ok(Some(match kind {
        "sampled_wall" => LawMethod::SampledWall(sampled_wall(s, axis, &small)?),
        "virtual_coupling" => LawMethod::VirtualCoupling {
            coupling_nm_per_rad: s.quantity("coupling_stiffness", axis.stiffness, Positive, None)?,
            coupling_nm_s_per_rad: s.quantity("coupling_damping", axis.damping, NotNegative, Some(0.0))?,
            rigid: s.flag("rigid", false)?,
        },
        "passivity_controller" => LawMethod::PassivityController {
            observer: s.choice(
                "observer",
                &[("velocity", Observer::Velocity), ("held_force", Observer::HeldForce)],
                Some(Observer::Velocity),
            )?,
            credit_j: if s.has("credit") { Some(s.quantity("credit", &q::ENERGY, Positive, None)?) } else { None },
            energy_bits: s.bits_within("energy_bits", 8..=48, 32)?,
        },
        "energy_bounding" => {
            let c1 = s.quantity("c1", axis.stiffness, Positive, None)?;
            let by_force = s.choice("form", &[("c1_c2", false), ("force_bound", true)], Some(false))?;
            let form = if by_force {
                if s.has("c2") {
                    return Err(s.error("c2", "the force bound has one constant, c1 = b/T; leave this out"));
                }
                BoundingForm::ForceBound(c1)
            } else {
                let c2 = s.quantity("c2", axis.stiffness, Positive, Some(c1))?;
                if c2 > c1 {
                    return Err(
                        s.error("c2", "above c1, where no force is feasible for some motions; write 0 < c2 <= c1")
                    );
                }
                BoundingForm::C1C2(c1, c2)
            };
            LawMethod::EnergyBounding {
                form,
                bound_format: s.gain_format("bound_format", (10, 4))?,
                energy_bits: s.bits_within("energy_bits", 8..=48, 32)?,
            }
        }
        "passive_spring" => LawMethod::PassiveSpring {
            alpha: s.quantity("alpha", &q::RATIO, Within(1e-9, 1e9), Some(1.0))?,
            beta: s.quantity("beta", &q::RATIO, Within(1e-9, 1e9), Some(1.0))?,
            revive: s.flag("revive", true)?,
            extension_frac: small("extension_frac", 8, 16, 8)?,
        },
        _ => return Ok(None),
    }))
}

/// Reads a small number, given its key, least value, greatest value and default.
type Small<'a> = dyn Fn(&str, u64, u64, u64) -> Result<u32, SceneError> + 'a;

fn sampled_wall(s: &Section, axis: &Axis, small: &Small) -> Result<SampledWallMethod, SceneError> {
    let estimators = [
        ("difference", Estimator::Difference),
        ("filtered", Estimator::Filtered),
        ("window", Estimator::Window),
        ("foaw", Estimator::Foaw),
        ("edge_timer", Estimator::EdgeTimer),
    ];
    let estimator = s.choice("estimator", &estimators, Some(Estimator::Difference))?;
    for (key, owners) in [
        ("filter_shift", &[Estimator::Filtered][..]),
        ("window", &[Estimator::Window, Estimator::Foaw]),
        ("noise", &[Estimator::Foaw]),
    ] {
        if s.has(key) && !owners.contains(&estimator) {
            return Err(s.error(key, "not a number of this estimator; leave it out"));
        }
    }
    Ok(SampledWallMethod {
        live: s.choice("spring", &[("held", false), ("live", true)], Some(false))?,
        estimator,
        ratio: small("velocity_every", 1, 1 << 20, 1)?,
        shift: small("filter_shift", 0, 16, 3)?,
        window: small("window", 1, 64, 8)?,
        noise: small("noise", 0, 15, 1)?,
        velocity_frac: small("velocity_frac", 0, 16, 8)?,
        relief_nm_s_per_rad: s.quantity("negative_damping", axis.damping, NotNegative, Some(0.0))?,
    })
}
