//! Moves a device over the steps of a run without a clock.

use hpu_plant::{Axis, Device, Drive, Energy, Excitation, HeldDevice, Method, Powers, State, Stepper};

/// The device with its integrator: fixed steps of a method, or exact flows.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub(crate) enum Integrator<'p> {
    Fixed {
        full: Stepper,
        /// The stepper for steps that are cut short.
        part: Stepper,
        energy: Energy,
        excitation: Excitation,
        /// The excitation's powers in the present state, as long as they stand (drive and state unchanged since the
        /// last step).
        powers: Option<Powers>,
    },
    Exact(HeldDevice<'p>),
}

impl<'p> Integrator<'p> {
    /// Creates an integrator with steps of `step` clock edges, by a method or, without one, by exact flows. It starts
    /// in the device's state at edge 0.
    pub(crate) fn new(axis: &Axis, device: Device<'p>, method: Option<Method>, step: u64, edge_s: f64) -> Self {
        let Some(method) = method else { return Self::Exact(HeldDevice::new(device, step)) };
        Self::Fixed {
            full: Stepper::new(axis, method, step as f64 * edge_s),
            part: Stepper::new(axis, method, edge_s),
            energy: Energy::default(),
            excitation: axis.excitation(device.drive_now(), &device.state(0), 0.0),
            powers: None,
        }
    }

    /// Returns the energy exchanged until `edge`, the number of changes of mode, and the number of decisions made
    /// again.
    pub(crate) fn audit(&self, edge: u64) -> (Energy, u64, u64) {
        match self {
            Self::Fixed { energy, .. } => (*energy, 0, 0),
            Self::Exact(held) => (held.energy(edge), held.mode_changes(), held.redecided()),
        }
    }

    /// Sets the drive from `edge` on; returns the state there. The audit needs no surge: a scene's current jumps only
    /// under an amplifier or in a winding without inductance, and neither stores energy.
    #[inline(always)]
    pub(crate) fn driven(&mut self, axis: &Axis, edge: u64, drive: Drive, x: &State, intent_rad_per_s: f64) -> State {
        match self {
            Self::Exact(held) => held.driven(edge, drive),
            Self::Fixed { excitation, powers, .. } => {
                let x = axis.taken(drive, x);
                *powers = None;
                *excitation = axis.excitation(drive, &x, intent_rad_per_s);
                x
            }
        }
    }

    /// Sets the hand's intended angle and speed from `edge` on; returns the state there.
    pub(crate) fn intend(
        &mut self,
        axis: &Axis,
        edge: u64,
        (angle_rad, speed_rad_per_s): (f64, f64),
        x: &State,
    ) -> State {
        match self {
            Self::Exact(held) => held.intend(edge, angle_rad, speed_rad_per_s),
            Self::Fixed { energy, powers, .. } => {
                *powers = None;
                let mut to = *x;
                to[3] = angle_rad;
                if axis.is_prescribed() {
                    (to[1], to[2]) = (speed_rad_per_s, angle_rad);
                }
                axis.jumped(energy, x, &to);
                to
            }
        }
    }

    /// Moves the device from one edge to another; returns the state there.
    #[inline(always)]
    pub(crate) fn flow(&mut self, (from, to): (u64, u64), edge_s: f64, x: &State) -> State {
        match self {
            Self::Exact(held) => held.flow(from, to),
            Self::Fixed { full, part, energy, excitation, powers } => {
                let step_s = (to - from) as f64 * edge_s;
                if full.step_s() != step_s && part.step_s() != step_s {
                    *part = part.with_step(step_s);
                }
                let stepper = if full.step_s() == step_s { full } else { part };
                let to = stepper.step(x, excitation);
                let before = powers.unwrap_or_else(|| stepper.powers(x, excitation));
                let after = stepper.powers(&to, excitation);
                stepper.account(energy, step_s, &before, &after);
                *powers = Some(after);
                to
            }
        }
    }
}
