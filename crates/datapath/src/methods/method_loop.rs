//! The method loops: a law between encoder and bridge.
//!
//! - **Equation**: `command = clamp(shaped torque)`; the torque is the law's.
//! - **Ports**: those of `hybrid_loop`.
//! - **Nets**: inputs, outputs, then `position`, `error`, `delta`, `contact`, `penetration`, `torque`, `memory`,
//!   `shaped`, `command`.
//! - **Latency**: pin to wall 4 edges; then the law's, the shaper's and the modulator's.
//! - **Reset**: every register as its block says. **Overflow**: the command is limited to full scale.
//! - **VHDL twin**: `hdl/generated/<law>_loop.vhd`, made of this wiring and the law's VHDL; instances `front`, `law`,
//!   `shaper`, `limiter`, `modulator`.
//! - **Source**: that of the law.
//! - **Differs from the hardware**: as in the law and the blocks around it; combinational paths settle within the clock
//!   they change in, whatever their length.

use hpu_signal::Signal;

use crate::base::block::renamed;
use crate::circuit::circuit_loop::{AxisCircuit, CircuitLoop, LoopCircuit};
use crate::circuit::{Set, circuit};
use crate::{
    AxisFront, Block, ConfigError, Generic, InputShaper, InputShaperConfig, Law, LawIn, LoopIn, LoopOut, Pwm,
    PwmConfig, Saturator, Shaping, arithmetic::input_shaper, arithmetic::saturator, loops::axis_front, pins::pwm,
};

/// The parts of a method loop beside its law.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MethodLoopConfig {
    /// The modulator.
    pub pwm: PwmConfig,
    /// The input shaper's phase and filter; `None` passes the torque on.
    pub shaping: Option<Shaping>,
}

/// The law's generics that have another name in the loop.
pub(crate) const LAW: [(&str, &str); 2] = [("WIDTH", "POSITION_WIDTH"), TORQUE_WIDTH];
/// Those of the shaper.
pub(crate) const SHAPER: [(&str, &str); 8] = [
    ("PHASE", "SHAPER_PHASE"),
    ("B0", "SHAPER_B0"),
    ("B1", "SHAPER_B1"),
    ("B2", "SHAPER_B2"),
    ("A1", "SHAPER_A1"),
    ("A2", "SHAPER_A2"),
    ("ENABLED", "SHAPER_ENABLED"),
    TORQUE_WIDTH,
];
const TORQUE_WIDTH: (&str, &str) = ("TORQUE_WIDTH", "PWM_WIDTH");

/// A haptic loop, position counter to H-bridge, around any law. See the [module](self).
pub type MethodLoop<L> = CircuitLoop<MethodCircuit<L>, 20>;

/// The ports of every law.
mod law {
    pub(crate) use crate::{LawIn as In, LawOut as Out};
}

circuit! {
    /// The blocks of a method loop up to the command.
    pub struct MethodCircuit[L: Law][L][20] { config: MethodLoopConfig, modulator: Pwm }
    nets {
        a_pin, b_pin, reference, stiffness, damping, period, scale, a_high, a_low, b_high, b_low,
        position, error, delta, contact, penetration, torque, memory, shaped, command,
    }
    front: AxisFront = axis_front { a_pin, b_pin, reference } -> { position, error, delta, contact, penetration }
        generics { &[] };
    law: L = law { position, delta, contact, penetration, stiffness, damping, period, scale } -> { torque, memory }
        generics { &LAW };
    shaper: InputShaper = input_shaper { torque, period } -> { shaped } generics { &SHAPER };
    limiter: Saturator = saturator { value: shaped } -> { limited: command }
        generics { &[("IN_WIDTH", "PWM_WIDTH + 2"), ("OUT_WIDTH", "PWM_WIDTH + 1"), ("LIMIT", "2**PWM_WIDTH - 1")] };
}

impl<L: Law> MethodLoop<L> {
    /// Returns a loop around that law, in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its words, and unless the modulator is as wide as the law's torque.
    pub fn new(law: L, config: MethodLoopConfig) -> Result<Self, ConfigError> {
        let widths = law.widths();
        let MethodLoopConfig { pwm, shaping } = config;
        let torque_width = widths.torque_width;
        if pwm.width != torque_width {
            let accepted = format!("the {torque_width} bits of the law's torque");
            return Err(ConfigError::new(L::LOOP, format!("PWM_WIDTH is {}", pwm.width), accepted));
        }
        let shaper = InputShaperConfig {
            torque_width,
            period_width: widths.period_width,
            shaping,
            ..InputShaperConfig::default()
        };
        let circuit = MethodCircuit {
            paces: Paces::default(),
            config,
            front: AxisFront::new(widths.width)?,
            shaper: InputShaper::new(shaper)?,
            limiter: Saturator::new(torque_width + 2, torque_width + 1, (1 << torque_width) - 1)?,
            law,
            modulator: Pwm::new(pwm)?,
        };
        Ok(Self::of(circuit))
    }

    /// Returns the law in the middle.
    pub fn law(&self) -> &L {
        &self.circuit.law
    }

    /// Returns whether an input shaper changes the law's torque.
    pub fn is_shaped(&self) -> bool {
        self.circuit.config.shaping.is_some()
    }
}

impl<L: Law + Default> Default for MethodLoop<L> {
    fn default() -> Self {
        Self::new(L::default(), MethodLoopConfig::default()).expect("the data sheet's default")
    }
}

impl<L: Law> LoopCircuit<20> for MethodCircuit<L> {
    const NAME: &'static str = L::LOOP;

    const INPUTS: usize = 7;
    type In<T> = LoopIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> LoopIn<Signal> {
        let axis_front::In { a_pin, b_pin, reference } = self.front.inputs();
        let LawIn { stiffness, damping, period, scale, .. } = self.law.inputs();
        LoopIn { a_pin, b_pin, reference, stiffness, damping, period, scale }
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let pwm::Out { a_high, a_low, b_high, b_low } = self.modulator.outputs();
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let in_loop = |generics: Vec<(_, _)>, names: &'static [(&str, &str)]| {
            generics.into_iter().map(|(name, value)| (renamed(name, names), value)).collect::<Vec<_>>()
        };
        let mut all = in_loop(self.law.generics(), &LAW);
        let own = all.split_off(self.law.widths().generics().len());
        all.extend(self.config.pwm.generics().split_off(1));
        let shaper = in_loop(self.shaper.generics(), &SHAPER).into_iter();
        all.extend(shaper.filter(|(name, _)| name.starts_with("SHAPER_")));
        all.extend(own);
        all
    }

    #[inline]
    fn modulator(&self) -> Option<&Pwm> {
        Some(&self.modulator)
    }

    #[inline]
    fn modulator_mut(&mut self) -> Option<&mut Pwm> {
        Some(&mut self.modulator)
    }
}

impl<L: Law> AxisCircuit<20> for MethodCircuit<L> {
    #[inline]
    fn load(&mut self, edge: u64, position: i64, _: &mut [i64; 20]) -> Set {
        self.paces.front.catch_up(&mut self.front, edge);
        self.front.load(position);
        1 << Self::NET.position
    }
}
