//! The widths of a scene one by one; integer bits and fraction bits are separate.

use hpu_cosim::scene::{Experiment, Loop, PhantomLaw};
use hpu_signal::{Format, Rounding};

/// A width of a scene's datapath.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Field {
    /// `method.position_bits`.
    Position,
    /// Integer bits of `method.stiffness_format`, or of a PHANToM's.
    StiffnessInt,
    /// Fraction bits of the same format.
    StiffnessFrac,
    /// Integer bits of `method.damping_format`.
    DampingInt,
    /// Fraction bits of `method.damping_format`.
    DampingFrac,
    /// `method.velocity_bits`.
    Velocity,
    /// `method.period_bits`, or a PHANToM's.
    Period,
    /// Integer bits of `method.scale_format`.
    ScaleInt,
    /// Fraction bits of `method.scale_format`.
    ScaleFrac,
    /// `method.pwm.bits`.
    Pwm,
    /// `method.depth_bits` of a PHANToM's tables.
    Depth,
    /// Integer bits of a PHANToM's sines.
    TrigInt,
    /// Fraction bits of a PHANToM's sines.
    TrigFrac,
    /// Fraction bits of a PHANToM's lengths.
    Length,
    /// Fraction bits of the position of a PHANToM's tip.
    Tip,
    /// Fraction bits of a PHANToM's forces.
    Force,
    /// Integer bits of a PHANToM's torques.
    TorqueInt,
    /// Fraction bits of a PHANToM's torques.
    TorqueFrac,
}

impl Field {
    const OF_AN_AXIS: [Self; 10] = [
        Self::Position,
        Self::StiffnessInt,
        Self::StiffnessFrac,
        Self::DampingInt,
        Self::DampingFrac,
        Self::Velocity,
        Self::Period,
        Self::ScaleInt,
        Self::ScaleFrac,
        Self::Pwm,
    ];
    const OF_A_PHANTOM: [Self; 11] = [
        Self::Depth,
        Self::TrigInt,
        Self::TrigFrac,
        Self::Length,
        Self::Tip,
        Self::StiffnessInt,
        Self::StiffnessFrac,
        Self::Force,
        Self::TorqueInt,
        Self::TorqueFrac,
        Self::Period,
    ];

    /// Returns the widths that a scene has.
    #[must_use]
    pub fn all(experiment: &Experiment) -> Vec<Self> {
        match experiment {
            Experiment::Axis(scene) => {
                let law = matches!(scene.method.kind, Loop::Law(_));
                let scaled = scene.method.kind.scale().is_some() || scene.method.reference_rate_hz.is_some();
                let has = |field: &Self| match field {
                    // A law's velocity is as wide as its position.
                    Self::Velocity => !law,
                    Self::ScaleInt | Self::ScaleFrac => scaled,
                    _ => true,
                };
                Self::OF_AN_AXIS.into_iter().filter(has).collect()
            }
            Experiment::Phantom(scene) if scene.platform.is_host() || scene.model.law != PhantomLaw::Words => {
                Vec::new()
            }
            Experiment::Phantom(_) => Self::OF_A_PHANTOM.to_vec(),
            Experiment::Dut(_) => Vec::new(),
        }
    }

    /// Returns its name: the scene's key where there is one.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position_bits",
            Self::StiffnessInt => "stiffness, integer",
            Self::StiffnessFrac => "stiffness, fraction",
            Self::DampingInt => "damping, integer",
            Self::DampingFrac => "damping, fraction",
            Self::Velocity => "velocity_bits",
            Self::Period => "period_bits",
            Self::ScaleInt => "scale, integer",
            Self::ScaleFrac => "scale, fraction",
            Self::Pwm => "pwm.bits",
            Self::Depth => "depth_bits",
            Self::TrigInt => "sines, integer",
            Self::TrigFrac => "sines, fraction",
            Self::Length => "lengths, fraction",
            Self::Tip => "tip, fraction",
            Self::Force => "forces, fraction",
            Self::TorqueInt => "torques, integer",
            Self::TorqueFrac => "torques, fraction",
        }
    }

    /// Returns the nets whose range tells how many bits of the width are idle: without these bits no word changes.
    #[must_use]
    pub const fn nets(self) -> &'static [&'static str] {
        match self {
            Self::Position => &["position", "delta", "penetration"],
            Self::StiffnessInt => &["stiffness"],
            Self::DampingInt => &["damping"],
            Self::Velocity => &["velocity"],
            Self::Period => &["period"],
            Self::ScaleInt => &["scale"],
            Self::TrigInt => &["sine1", "cosine1", "sine2", "cosine2", "sine3", "cosine3"],
            Self::TorqueInt => &["torque1", "torque2", "torque3"],
            _ => &[],
        }
    }

    /// Returns the nets at which a review shows the field; one of them stands for it on a page.
    #[must_use]
    pub const fn shown_at(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::StiffnessInt | Self::StiffnessFrac => "stiffness",
            Self::DampingInt | Self::DampingFrac => "damping",
            Self::Velocity => "velocity",
            Self::Period => "period",
            Self::ScaleInt | Self::ScaleFrac => "scale",
            Self::Pwm => "command",
            Self::Depth => "count1",
            Self::TrigInt | Self::TrigFrac => "sine1",
            Self::Length => "radius",
            Self::Tip => "x",
            Self::Force => "force_x",
            Self::TorqueInt | Self::TorqueFrac => "torque1",
        }
    }

    /// Returns the bits of this width in a scene.
    #[must_use]
    pub fn bits(self, experiment: &Experiment) -> i32 {
        let width = |bits: u32| bits.cast_signed();
        match experiment {
            Experiment::Axis(scene) => {
                let method = &scene.method;
                match self {
                    Self::Position => width(method.position_bits),
                    Self::StiffnessInt => method.stiffness_format.int(),
                    Self::StiffnessFrac => method.stiffness_format.frac(),
                    Self::DampingInt => method.damping_format.int(),
                    Self::DampingFrac => method.damping_format.frac(),
                    Self::Velocity => width(method.velocity_bits),
                    Self::Period => width(method.period_bits),
                    Self::ScaleInt => method.scale_format.int(),
                    Self::ScaleFrac => method.scale_format.frac(),
                    _ => width(method.pwm.bits),
                }
            }
            Experiment::Phantom(scene) => {
                let (config, formats) = (&scene.method.config, &scene.method.config.formats);
                match self {
                    Self::Depth => width(config.depth_width),
                    Self::TrigInt => formats.trig.int(),
                    Self::TrigFrac => formats.trig.frac(),
                    Self::Length => width(formats.length_frac),
                    Self::Tip => formats.position.frac(),
                    Self::StiffnessInt => formats.stiffness.int(),
                    Self::StiffnessFrac => formats.stiffness.frac(),
                    Self::Force => formats.force.frac(),
                    Self::TorqueInt => formats.torque.int(),
                    Self::TorqueFrac => formats.torque.frac(),
                    _ => width(config.period_width),
                }
            }
            Experiment::Dut(_) => 0,
        }
    }

    /// Returns the scene with another number of bits.
    ///
    /// # Errors
    ///
    /// When no word has that many.
    pub fn with(self, experiment: &Experiment, bits: i32) -> Result<Experiment, String> {
        let mut other = experiment.clone();
        let width = || u32::try_from(bits).ok().filter(|bits| *bits >= 2).ok_or(format!("{bits} bits are no word"));
        let int =
            |format: Format| Format::new(format.is_signed(), bits, format.frac()).map_err(|error| error.to_string());
        let frac =
            |format: Format| Format::new(format.is_signed(), format.int(), bits).map_err(|error| error.to_string());
        match &mut other {
            Experiment::Dut(_) => return Err("the words of a design of yours are its own".into()),
            Experiment::Axis(scene) => {
                let method = &mut scene.method;
                match self {
                    Self::Position => {
                        method.position_bits = width()?;
                        if matches!(method.kind, Loop::Law(_)) {
                            method.velocity_bits = width()?;
                        }
                    }
                    Self::StiffnessInt => method.stiffness_format = int(method.stiffness_format)?,
                    Self::StiffnessFrac => method.stiffness_format = frac(method.stiffness_format)?,
                    Self::DampingInt => method.damping_format = int(method.damping_format)?,
                    Self::DampingFrac => method.damping_format = frac(method.damping_format)?,
                    Self::Velocity => method.velocity_bits = width()?,
                    Self::Period => method.period_bits = width()?,
                    Self::ScaleInt => method.scale_format = int(method.scale_format)?,
                    Self::ScaleFrac => method.scale_format = frac(method.scale_format)?,
                    _ => method.pwm.bits = width()?,
                }
            }
            Experiment::Phantom(scene) => {
                let config = &mut scene.method.config;
                let formats = &mut config.formats;
                match self {
                    Self::Depth => config.depth_width = width()?,
                    Self::TrigInt => formats.trig = int(formats.trig)?,
                    Self::TrigFrac => formats.trig = frac(formats.trig)?,
                    Self::Length => {
                        config.lengths =
                            config.lengths.map(|word| rescaled(word, formats.length_frac.cast_signed() - bits));
                        formats.length_frac = u32::try_from(bits).map_err(|_| format!("{bits} bits are none"))?;
                    }
                    Self::Tip => formats.position = frac(formats.position)?,
                    Self::StiffnessInt => formats.stiffness = int(formats.stiffness)?,
                    Self::StiffnessFrac => formats.stiffness = frac(formats.stiffness)?,
                    Self::Force => {
                        config.force_limit = rescaled(config.force_limit, formats.force.frac() - bits);
                        formats.force = frac(formats.force)?;
                    }
                    Self::TorqueInt => formats.torque = int(formats.torque)?,
                    Self::TorqueFrac => formats.torque = frac(formats.torque)?,
                    _ => {
                        let (bits, period) = (width()?, scene.period_clocks());
                        if period >> bits.min(63) > 0 {
                            return Err(format!("a period of {period} clocks does not fit {bits} bits"));
                        }
                        scene.method.config.period_width = bits;
                    }
                }
            }
        }
        Ok(other)
    }
}

/// Returns a constant with `less` fewer fraction bits, rounded to the nearest.
fn rescaled(word: u32, less: i32) -> u32 {
    let drop = u32::try_from(less).unwrap_or(0);
    let more = u32::try_from(-less).unwrap_or(0);
    u32::try_from(Rounding::NearestUp.shift(i128::from(word) << more, drop)).unwrap_or(u32::MAX)
}
