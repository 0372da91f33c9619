//! The switch between position and impedance control of the crank, with hysteresis and without a leap of the drive.
//!
//! - **Equation**: at a sample, in position control, `mode' = 1` if `finger_force > threshold_on`; in impedance control
//!   `mode' = 0` if `finger_force < threshold_off`; else the mode stays. `equilibrium' = rest`, or with `TAKE_RADIUS`
//!   `radius` where `mode` or `mode'` is 0. At the edge after the sample, with `law` the drive of the mode: `offset' =
//!   drive - law` if the law is another than at the last time, else `offset - offset / 2^DECAY` rounded towards zero,
//!   and `drive' = saturate(law + offset')`. Without `BUMPLESS` the offset is always 0.
//! - **Ports**: `position_drive`, `impedance_drive` (1,DRIVE_WIDTH-1,0), `finger_force`, `threshold_on`,
//!   `threshold_off` (0,FORCE_WIDTH,0), `radius`, `rest` (1,LENGTH_WIDTH-LENGTH_FRAC-1,LENGTH_FRAC), `sample` in;
//!   `drive` (1,DRIVE_WIDTH-1,0), `mode` (0,1,0), 1 = impedance, `equilibrium` as `radius` out. `radius` is ignored
//!   unless `TAKE_RADIUS`, else `rest` is.
//! - **Latency**: 1 edge from a sample to mode and equilibrium, 2 to the drive. The equilibrium is an input of the
//!   impedance's law, whose drive is therefore read one edge later: it belongs to the equilibrium of the same sample.
//! - **Reset**: position control; drive, offset and equilibrium 0. The first sample is no switch unless its force is
//!   above `threshold_on`.
//! - **Overflow**: the drive saturates. At a switch it stays as it was, and the offset holds any difference.
//! - **VHDL twin**: `hdl/control_switch.vhd`.
//! - **Source**: Pediredla et al.: position control while the finger moves along the surface, impedance control when it
//!   probes radially. The paper gives no threshold; here the force tells that the finger probes. Equal thresholds are a
//!   switch without hysteresis.
//! - **Differs from the hardware**: hysteresis, offset and latched radius are additions to the paper's design. The
//!   sum takes one edge, so no limit on the clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::within;
use crate::base::law::ZERO;
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the switch.
    pub struct In of |block: &ControlSwitch| {
        position_drive: Format::signed(block.config.drive_width), "count", "Drive of the position control";
        impedance_drive: Format::signed(block.config.drive_width), "count", "Drive of the impedance control";
        finger_force: Format::unsigned(block.config.force_width), "LSB", "Force of the finger, inwards";
        threshold_on: Format::unsigned(block.config.force_width), "LSB", "Force above which the finger probes";
        threshold_off: Format::unsigned(block.config.force_width), "LSB", "Force below which it probes no longer";
        radius: block.config.length, "m", "Radius of the segment";
        rest: block.config.length, "m", "Desired radius";
        sample, "The edge samples";
    }
    /// Outputs of the switch.
    pub struct Out of |block: &ControlSwitch| {
        drive: block.narrowing.to, "count", "Command of the crank's servo";
        mode, "Impedance control";
        equilibrium: block.config.length, "m", "Radius at which the spring pushes with nothing";
    }
}

crate::base::listed::configuration! {
    /// The formats and options of a switch.
    pub struct SwitchConfig {
        /// Width of the drives, in bits.
        drive_width: u32 = 11, ["DRIVE_WIDTH"];
        /// Width of the force and of the thresholds, in bits.
        force_width: u32 = 12, ["FORCE_WIDTH"];
        /// Format of the radii.
        length: Format = Format::new(true, -3, 22).expect("20 bits"), ["LENGTH_WIDTH", "LENGTH_FRAC"];
        /// Whether the equilibrium is the radius at the switch to impedance control, and not the desired radius.
        take_radius: bool = true, ["TAKE_RADIUS"];
        /// Whether an offset keeps the drive at a switch.
        bumpless: bool = true, ["BUMPLESS"];
        /// The offset loses a share of `2^-decay` at every sample.
        decay: u32 = 4, ["DECAY"];
    }
}

hpu_signal::ports! {
    /// The registers of the switch: its outputs; whether the edge loads the drive; the mode whose law made the drive;
    /// and the offset, in this order.
    pub struct State { drive, mode, equilibrium, loads, driven, offset }
}

/// A switch of control; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ControlSwitch {
    config: SwitchConfig,
    offset: Format,
    narrowing: Narrowing,
    fits_64: bool,
    state: State<Narrowed>,
}

const RESET: State<Narrowed> =
    State { drive: ZERO, mode: ZERO, equilibrium: ZERO, loads: ZERO, driven: ZERO, offset: ZERO };

impl ControlSwitch {
    /// Returns a switch with these formats and options.
    ///
    /// # Errors
    ///
    /// Returns an error unless the drive has 2 to 31 bits, the force 2 to 30, lengths are signed with 2 to 62 bits
    /// and 0 or more fraction bits, and the decay is 0 to 15.
    pub fn new(config: SwitchConfig) -> Result<Self, ConfigError> {
        let SwitchConfig { drive_width, force_width, length, decay, .. } = config;
        within(Self::NAME, "DRIVE_WIDTH", drive_width, 2..=31)?;
        within(Self::NAME, "FORCE_WIDTH", force_width, 2..=30)?;
        within(Self::NAME, "DECAY", decay, 0..=15)?;
        if !(length.is_signed() && (2..=62).contains(&length.width()) && length.frac() >= 0) {
            let accepted = "signed, 2 to 62 bits, 0 or more of them fraction bits";
            return Err(ConfigError::new(Self::NAME, format!("LENGTH is {length}"), accepted));
        }
        let narrowing = Narrowing {
            from_frac: 0,
            to: Format::signed(drive_width),
            rounding: Rounding::Truncate,
            overflow: Overflow::Saturate,
        };
        let offset = Format::signed(drive_width + 1);
        let mut block = Self { config, offset, narrowing, fits_64: false, state: RESET };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the drive, and whether it is saturated.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.state.drive
    }

    /// Returns the registers after an edge.
    #[inline]
    fn moved<W: Word>(&self, state: &State<W>, input: &In<W>) -> State<W> {
        let SwitchConfig { take_radius, .. } = self.config;
        let decided = || {
            let enters = || [W::of_bit(input.finger_force.above(input.threshold_on))];
            let stays = || [W::of_bit(input.finger_force.at_least(input.threshold_off))];
            let [mode] = W::branch(state.mode.is_set(), stays, enters);
            let probes = state.mode.is_set() & mode.is_set();
            let kept = || [state.equilibrium];
            let [equilibrium] = if take_radius { W::branch(probes, kept, || [input.radius]) } else { [input.rest] };
            [mode, equilibrium]
        };
        let [mode, equilibrium] = W::branch(input.sample.is_set(), decided, || [state.mode, state.equilibrium]);
        let loaded = || self.loaded(state, input);
        let [drive, driven, offset] =
            W::branch(state.loads.is_set(), loaded, || [state.drive, state.driven, state.offset]);
        State { drive, mode, equilibrium, loads: input.sample, driven, offset }
    }

    /// Returns drive, the mode that made it, and the offset, after the edge that loads the drive.
    #[inline]
    fn loaded<W: Word>(&self, state: &State<W>, input: &In<W>) -> [W; 3] {
        let law = W::select(state.mode.is_set(), input.impedance_drive, input.position_drive);
        if !self.config.bumpless {
            return [law, state.driven, state.offset];
        }
        let (drive, offset) = (state.drive.shed(), state.offset);
        let decayed = || [(offset.shl(self.config.decay) - offset).round(Rounding::TowardZero, self.decay()).shed()];
        let [offset] = W::branch(state.mode.equals(state.driven), decayed, || [drive - law]);
        [(law + offset).narrow(&self.narrowing), state.mode, offset]
    }

    fn decay(&self) -> i32 {
        self.config.decay.cast_signed()
    }

    /// Returns the registers after an edge, as words of the machine.
    #[inline]
    fn next(&self, input: &In<i64>) -> State<Narrowed> {
        if self.fits_64 {
            let state = self.state.map(Machine::<i64>::of_narrowed);
            self.moved(&state, &input.map(Machine::of)).map(Machine::narrowed)
        } else {
            let state = self.state.map(Machine::<i128>::of_narrowed);
            self.moved(&state, &input.map(Machine::of)).map(Machine::narrowed)
        }
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let State { drive, mode, equilibrium, .. } = self.state;
        Out { drive: drive.word, mode: mode.word, equilibrium: equilibrium.word }
    }
}

/// The law that made the drive and the offset are registers only of a switch that keeps the drive.
impl Step for ControlSwitch {
    fn registers(&self) -> Vec<Register> {
        let mut all = vec![
            Register::new("drive", self.narrowing.to),
            Register::new("mode", Format::BIT),
            Register::new("equilibrium", self.config.length),
            Register::new("loads", Format::BIT),
        ];
        if self.config.bumpless {
            all.extend([Register::new("driven", Format::BIT), Register::new("offset", self.offset)]);
        }
        all
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [drive, mode, equilibrium, loads, ref others @ ..] = *registers else { unreachable!("registers") };
        let [driven, offset] = *others else {
            let zero = W::int(0);
            let next = self.moved(&State { drive, mode, equilibrium, loads, driven: zero, offset: zero }, &input);
            return (vec![next.drive, next.mode, next.equilibrium, next.loads], Out { drive, mode, equilibrium });
        };
        let next = self.moved(&State { drive, mode, equilibrium, loads, driven, offset }, &input);
        let next = vec![next.drive, next.mode, next.equilibrium, next.loads, next.driven, next.offset];
        (next, Out { drive, mode, equilibrium })
    }
}

crate::base::listed::configured!(ControlSwitch: SwitchConfig);

impl Block for ControlSwitch {
    const NAME: &'static str = "control_switch";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.state = RESET;
        self.shown()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.state = self.next(&input);
        self.shown()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let next = self.next(input);
        let stays = if input.sample == 0 {
            // Only a drive is still to come. An edge at which it loses other bits is not skipped, because a loop counts
            // them.
            next.drive == self.state.drive
        } else {
            next == self.state
        };
        if stays { u64::MAX } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if edges > 0 {
            self.state = self.next(input);
        }
    }
}

impl Listed for ControlSwitch {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let normal = SwitchConfig::default();
        let length = Format::new(true, 0, 3).expect("4 bits");
        let narrow = SwitchConfig { drive_width: 4, force_width: 3, length, decay: 1, ..normal };
        Ok(vec![
            ("plain", Self::new(SwitchConfig { take_radius: false, bumpless: false, ..normal })?),
            ("narrow", Self::new(narrow)?),
            // The offset is gone at the sample after the switch.
            ("at_once", Self::new(SwitchConfig { take_radius: false, decay: 0, ..narrow })?),
            ("slow", Self::new(SwitchConfig { drive_width: 24, decay: 15, ..normal })?),
        ])
    }
}

crate::circuit::part::registers!(ControlSwitch, self => {
    let State { drive, mode, equilibrium, .. } = self.state;
    Out { drive, mode, equilibrium }
});
