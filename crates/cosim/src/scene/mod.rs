//! Scenes: one TOML file is one experiment, on an axis (the table below) or on a PHANToM ([`phantom`]).
//!
//! A scene says first, in prose, what to look for (`about`), then names the device, the transducers, the clock, the
//! method, the wall, the hand, the physics that is modelled, the duration, the recording and the expected results.
//! Everything is validated before anything runs. Quantities are numbers in SI units or strings with a unit (`"25.175
//! MHz"`). Angles are those of the motor's shaft, positive into the wall; the wheel turns by the shaft's angle over
//! `wheel_ratio`.
//!
//! The dots of a unit may be left out (`"1.2 mNm"`). A word format is `"(S,I,F)"`, or a notation of other tools:
//! `"UQ4.8"`, `"ufix12_En8"` and all others that [`Format`](hpu_signal::Format) reads. `"Q4.8"` is TI's notation: its 4
//! integer bits do not include the sign bit.
//!
//! | Section | Keys, `[default]` |
//! |---|---|
//! | (top) | `about` |
//! | `[device]` `kind = "motor"` | `motor`, the name of one whose data are known (`vasudevan_2007`); without it, or beside it for another value, `resistance`, `inductance`, `torque_constant`, `rotor_inertia`, `viscous_friction` \[0, or the motor's\]; `coulomb_friction` \[0\], `wheel_ratio` \[1\], `wheel_inertia` \[0\], `initial_angle` \[0\], `initial_speed` \[0\], `initial_current` \[0\] |
//! | `[device]` `kind = "mass"` | `mass`, `damping`, `coulomb` \[0\], `initial_position` \[0\], `initial_speed` \[0\] |
//! | `[encoder]` | of a motor `lines` \[1024\], decoded x4; of a mass `resolution`, the length of a count |
//! | `[amplifier]` of a mass | `full_scale`, the force of `2^bits` PWM counts |
//! | `[amplifier.shaper]` if there is one | `cutoff` of the analog input shaper, `hold` \[1 us\] of its output |
//! | `[bridge]` of a motor | `supply` \[24 V\], `on_resistance` \[0\] of a switch, `diode_drop` \[0.7 V\] |
//! | `[clock]` | `frequency`, a whole number of hertz |
//! | `[method]` | `kind`, `sample_rate`, `position_bits` \[12\], `stiffness_format` \["(0,12,0)"\], `damping_format` \["(0,12,0)"\], `period_bits` \[24\], and what the kind needs |
//! | … `hybrid`, `conventional` | `velocity_bits` \[12\], `product` \[`saturate`\] (`drop_upper`), `settling` \[0\] clocks by which the command is held back, `rescaled` \[false\] with `reference_rate` and `scale_format` \["(0,8,8)"\] |
//! | … `sampled_wall` | `spring` \[`held`\] (`live`), `estimator` \[`difference`\] (`filtered`, `window`, `foaw`, `edge_timer`), `velocity_every` \[1\] samples, `filter_shift` \[3\], `window` \[8\], `noise` \[1\] count, `velocity_frac` \[8\], `negative_damping` \[0\] everywhere |
//! | … `virtual_coupling` | `coupling_stiffness`, `coupling_damping` \[0\], `rigid` \[false\]: the wall, whatever its stiffness |
//! | … `passivity_controller` | `observer` \[`velocity`\] (`held_force`), `credit` \[unbounded\], `energy_bits` \[32\] |
//! | … `energy_bounding` | `form` \[`c1_c2`\] (`force_bound`), `c1`, `c2` \[`c1`\], `bound_format` \["(0,10,4)"\], `energy_bits` \[32\] |
//! | … `passive_spring` | `alpha` \[1\], `beta` \[1\] in `scale_format` \["(0,8,8)"\], `revive` \[true\], `extension_frac` \[8\] |
//! | `[method.shaper]` behind a law, if there is one | `cutoff` of the digital input shaper |
//! | `[method.pwm]` | `bits` \[12\], `mode` \[`sign_magnitude`\] (`locked_antiphase`), `duty` \[`latched`\] (`immediate`), `off` \[`brake`\] (`float`), `dead_time` \[0\]; its frequency is `clock.frequency / 2^bits` |
//! | `[wall]` | `position`, `stiffness`, `damping` \[0\] |
//! | `[wall.ramp]` if it changes | `stiffness` at the end, or `scale` of a `passive_spring` (its `beta`), `from`, `to`: the word goes there in a straight line |
//! | `[hand]` `kind = "none"` | |
//! | `[hand]` `kind = "constant_torque"` | `torque` |
//! | `[hand]` `kind = "spring_damper"` | `stiffness`, `damping`, `path = [[time, angle], ...]` or `file` (CSV) |
//! | `[hand]` `kind = "prescribed"` | `path` or `file` (CSV) |
//! | `[hand]` `kind = "capture"` | `file` (VCD), `channel_a`, `channel_b` |
//! | `[faults]` of lines and switches | a number of times at random (by `run.seed`) or a list of times each: `missed_edge`, `doubled_edge` with `doubled_clocks` \[4\], `bounce` with `bounces` \[3\] and `bounce_clocks` \[50\], `glitch` with `glitch_line` \[`encoder.a`\] and `glitch_clocks` \[1\]; `swapped` lines \[false\] with `swapped_from` \[0\]; `inverted`, a line, with `inverted_from` \[0\]; `lost_index` \[false\] of a `[dut]`; `stuck_switch`, as `bridge.plus_high`, with `stuck` \[`open`\] (`closed`), `stuck_from` \[0\], `stuck_to` \[the end\]; `clock_jitter` \[0\], up to a period |
//! | `[model]` | `datapath` \[`words`\] (`law`: in floats on counts, with the gains that the words realise, for masses and averaged bridges; `linear`), `bridge` \[`switching`\] (`averaged`: its mean voltage, with the pulses' area and first moment), `delay` \[0\] of the linear law |
//! | … what moves the device | `solver` \[`events`\] (`clock`; `sample`: exact, once a sample period; `euler`, `semi_implicit`, `midpoint`, `rk4`: in fixed steps), `step` of a fixed-step solver, rounded to whole clock edges |
//! | … what is left out | `winding` \[`inductive`\] (`resistive`, of averaged bridges), `friction` \[`stick_slip`\] (`smoothed` below `friction_speed`, `none`), `encoder` \[`quantised`\] (`loaded`, of words in steps: counts go into the counter at samples, and at every step where a spring is live, without lines and without the clock between; `ideal`, of the law in steps) |
//! | `[run]` | `duration`, `seed` \[0\] |
//! | `[record]` | `plant_rate` \[10 kHz\], `clock` \[false\] |
//! | `[expect]` | `outcome` (`settled`, `limit_cycle`, `diverged`), and any [`Metric`] as `{ value, tolerance }` |
//! | `[accuracy]` by which models are compared | `outputs` \[by the verdict\]: a list of [`Output`]s; `within` \[1 %\] |
//!
//! A scene of an axis may have a design of the user's own, a [`Dut`], in the place of `[method]`. Its `[wall]` then has
//! `position` and `varies`, the key of the generic or constant that makes the wall stiffer; its `[model]` has only the
//! keys of friction; its `[hand]` is no recording.
//!
//! | Section | Keys, `[default]` |
//! |---|---|
//! | `[dut]` | `files` in the order of compilation, VHDL or Verilog; `top`; `library` \[`work`\]; `standard` \[`2008`\] (`93`); `engine` \[`auto`\] (`ghdl`, `verilator`); `clock`, the port; `off` \[`brake`\] (`float`) of a bridge whose `bridge.pwm` is 0 |
//! | `[dut.clocks]` instead of `clock` | a port each: how many cycles of `clock.frequency` one of its own has; one of them 1 |
//! | `[dut.reset]` if it has one | `port`, `active` \[`high`\] (`low`), `clocks` \[4\] cycles of all clocks, while the world waits |
//! | `[dut.generics]`, `[dut.parameters]` | names and values: whole numbers, `true`, `false`, texts |
//! | `[dut.ports]` | a port each, and what it is connected to: a [`Line`], also after `not `; `encoder.count`, `wall.count`, a whole number, `open`; `{ is = "bridge.duty", format = "(1,0,11)", offset_binary = false }`, and so `amplifier.force` and, without `offset_binary`, `encoder.angle` |
//!
//! A scene whose device is a mass is the textbooks' translational one: its positions are in metres and its efforts in
//! newtons, in the same fields (`rad` then reads `m`, `nm` reads `n`). An ideal amplifier follows its command at once.
//! With an amplifier or an averaged bridge no modulator runs: its gates would drive nothing, and stay 0. The linear law
//! needs neither encoder nor amplifier.
//!
//! # Sizes
//!
//! A quantity that is finite but absurd is refused, with the accepted range in the message. Between the bounds
//! everything that a run computes stays finite and resolved: `f64` tells the counts of the finest encoder apart at the
//! farthest place, double-double follows the fastest mode through the longest run, and a word fits in 64 bits.
//! Published devices are orders of magnitude away from either end. A quantity of either sign is accepted down to 0. A
//! quantity without a sign is accepted from its least size on, or also at 0 where that has a meaning. Some keys have
//! narrower bounds of their own; the messages state them.
//!
//! | Quantity | least | greatest | unit |
//! |---|---|---|---|
//! | a time | 1e-12 | 1e9 | s |
//! | a frequency | 1e-6 | 1e10 | Hz |
//! | an angle | 1e-12 | 1e6 | rad |
//! | an angular speed | 1e-9 | 1e5 | rad/s |
//! | a torque | 1e-12 | 1e4 | N.m |
//! | a torsional stiffness | 1e-12 | 1e6 | N.m/rad |
//! | a torsional damping | 1e-15 | 1e3 | N.m.s/rad |
//! | a moment of inertia | 1e-12 | 1e3 | kg.m2 |
//! | a voltage | 1e-6 | 1e5 | V |
//! | a current | 1e-9 | 1e5 | A |
//! | a resistance | 1e-6 | 1e6 | Ohm |
//! | an inductance | 1e-9 | 1e3 | H |
//! | a torque constant | 1e-6 | 1e3 | N.m/A |
//! | a length | 1e-12 | 1e4 | m |
//! | a speed | 1e-9 | 1e4 | m/s |
//! | a force | 1e-9 | 1e6 | N |
//! | a stiffness | 1e-6 | 1e9 | N/m |
//! | a damping | 1e-9 | 1e6 | N.s/m |
//! | a mass | 1e-6 | 1e6 | kg |
//! | an energy | 1e-15 | 1e9 | J |
//! | a plain number | 1e-9 | 1e12 | 1 |
//!
//! No speed may pass more than 1000 encoder counts in one clock edge: neither the speed at the start nor one that a
//! hand imposes. A run ends when a motion has left the 2^52 counts to either side that an encoder can tell apart.

mod accuracy;
mod dut;
mod expect;
mod faults;
mod law;
mod model;
mod parameter;
mod parts;
pub mod phantom;
mod quantity;
mod read;
mod read_device;
mod read_dut;
mod read_faults;
mod read_hand;
mod read_method;
mod read_model;
mod read_phantom;
mod section;
mod shipped;
mod source;
mod words;

pub use accuracy::{Accuracy, Output};
pub use dut::{Connection, Driving, Dut, DutClock, DutReset, DutScene, Engine, Generic, Line, SourceFile, Standard};
pub use expect::{Expect, Expectation, Metric, OutcomeKind};
pub use faults::{EncoderLine, Faults, Stuck, Switch, Times};
pub use law::{LawMethod, SampledWallMethod};
pub use model::{BridgeModel, Datapath, EncoderModel, Friction, Model, Solver, Winding};
pub use parameter::{Origin, Parameter, ParameterValue};
pub use parts::{
    Amplifier, AnalogShaper, Bridge, Device, Encoder, Hand, Loop, Mass, Method, Motor, PathPoint, Pwm, Ramp, Record,
    Run, Units, Wall,
};
pub use phantom::{
    Direction, Drop, Irregularity, PhantomLaw, PhantomMethod, PhantomModel, PhantomScene, PhantomWords, Platform,
    Premium, Room,
};
pub use shipped::{Shipped, shipped, shipped_file};
pub use source::SceneError;
pub use words::{LoopWords, Miss, Realised};

use std::sync::Arc;

use hpu_datapath::Estimator;
use hpu_signal::Clock;

use source::{Places, Source};

/// The most clock edges that a run may last; a [`hpu_signal::Cycle`] holds them with room to spare.
pub const MOST_EDGES: u64 = 1 << 62;

/// Any experiment.
#[derive(Clone, PartialEq, Debug)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum Experiment {
    /// One axis: a motor with a wheel, and a wall.
    Axis(Scene),
    /// The three axes of a PHANToM.
    Phantom(PhantomScene),
    /// One axis whose loop is closed by a design of the user's own.
    Dut(DutScene),
}

impl Experiment {
    /// Parses and validates a scene of any kind, as [`Scene::parse`] does.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(
        name: &str,
        text: &str,
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides)?;
        let kinds = [("motor", false), ("mass", false), ("phantom", true)];
        if source.root().section("device")?.choice("kind", &kinds, None)? {
            return read_phantom::phantom_scene(name, source).map(Self::Phantom);
        }
        if source.root().has("dut") {
            return read_dut::dut_scene(name, source, load).map(Self::Dut);
        }
        read::scene(name, source, load).map(Self::Axis)
    }

    /// Returns the scene if it is one of an axis.
    #[must_use]
    pub fn axis(self) -> Option<Scene> {
        match self {
            Self::Axis(scene) => Some(scene),
            Self::Phantom(_) | Self::Dut(_) => None,
        }
    }

    /// Returns the scene if it is one of a PHANToM.
    #[must_use]
    pub fn phantom(self) -> Option<PhantomScene> {
        match self {
            Self::Phantom(scene) => Some(scene),
            Self::Axis(_) | Self::Dut(_) => None,
        }
    }

    /// Returns its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Axis(scene) => &scene.name,
            Self::Phantom(scene) => &scene.name,
            Self::Dut(scene) => &scene.name,
        }
    }

    /// Returns the text about what the scene shows and what to look for.
    #[must_use]
    pub fn about(&self) -> &str {
        match self {
            Self::Axis(scene) => &scene.about,
            Self::Phantom(scene) => &scene.about,
            Self::Dut(scene) => &scene.about,
        }
    }

    /// Returns the FPGA's clock.
    #[must_use]
    pub fn clock(&self) -> Clock {
        match self {
            Self::Axis(scene) => scene.clock,
            Self::Phantom(scene) => scene.clock,
            Self::Dut(scene) => scene.clock,
        }
    }

    /// Returns the duration in clock edges.
    #[must_use]
    pub fn edges(&self) -> u64 {
        match self {
            Self::Axis(scene) => scene.edges(),
            Self::Phantom(scene) => scene.edges(),
            Self::Dut(scene) => scene.edges(),
        }
    }

    /// Returns whether the model is left to `hpu fit`: `model = "auto"`.
    #[must_use]
    pub fn auto(&self) -> bool {
        match self {
            Self::Axis(scene) => scene.auto,
            Self::Phantom(scene) => scene.auto,
            Self::Dut(_) => false,
        }
    }

    /// Returns the expected results of the run.
    #[must_use]
    pub fn expect(&self) -> &Expect {
        match self {
            Self::Axis(scene) => &scene.expect,
            Self::Phantom(scene) => &scene.expect,
            Self::Dut(scene) => &scene.expect,
        }
    }

    /// Returns every parameter of the run, as the scene was read, with its origin.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        match self {
            Self::Axis(scene) => &scene.parameters,
            Self::Phantom(scene) => &scene.parameters,
            Self::Dut(scene) => &scene.parameters,
        }
    }

    /// Returns the outputs by which models of the scene are compared.
    #[must_use]
    pub fn accuracy(&self) -> &Accuracy {
        match self {
            Self::Axis(scene) => &scene.accuracy,
            Self::Phantom(scene) => &scene.accuracy,
            Self::Dut(scene) => &scene.accuracy,
        }
    }
}

/// One experiment on an axis, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct Scene {
    /// Name: that of the file, without folder and extension.
    pub name: String,
    /// The text about what the scene shows and what to look for.
    pub about: String,
    /// The device that the hand holds.
    pub device: Device,
    /// The encoder on the shaft, or along the rail.
    pub encoder: Encoder,
    /// The H-bridge of a motor.
    pub bridge: Bridge,
    /// The force amplifier of a mass; the linear law needs none.
    pub amplifier: Option<Amplifier>,
    /// The FPGA clock.
    pub clock: Clock,
    /// The method that closes the loop.
    pub method: Method,
    /// The virtual wall.
    pub wall: Wall,
    /// The hand, which moves the device.
    pub hand: Hand,
    /// The faults between device and logic.
    pub faults: Option<Faults>,
    /// The parts of the physics that are modelled.
    pub model: Model,
    /// Duration and seed of the run.
    pub run: Run,
    /// Settings of the recording.
    pub record: Record,
    /// The expected results of the run.
    pub expect: Expect,
    /// The outputs by which models of the scene are compared.
    pub accuracy: Accuracy,
    /// Whether the model is left to `hpu fit` (`model = "auto"`); the fields of `model` then hold the defaults.
    pub auto: bool,
    /// Every parameter of the run, as the scene was read, with its origin.
    pub parameters: Arc<[Parameter]>,
    places: Places,
}

impl Scene {
    /// Parses and validates a scene.
    ///
    /// `name` is the file's name in error messages. `overrides` are keys and values that replace the file's, in order,
    /// as in `("wall.stiffness", "2 N.m/rad")`. A value that is not TOML is a string; missing sections are created; an
    /// inline table replaces a whole section (`("hand", "{ kind = \"none\" }")`). `load` reads a file that the scene
    /// names.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(
        name: &str,
        text: &str,
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        read::scene(name, Source::parse(name, text, overrides)?, load)
    }

    /// Returns the duration in clock edges.
    #[must_use]
    pub fn edges(&self) -> u64 {
        self.clock.edges(self.run.duration_s)
    }

    /// Returns the shaft angle at the start: the device's, or the first angle of a hand that imposes the angle.
    #[must_use]
    pub fn initial_angle_rad(&self) -> f64 {
        match (&self.hand, &self.device) {
            (Hand::Prescribed { path }, _) => path.first().map_or(0.0, |point| point.angle_rad),
            (_, Device::Motor(motor)) => motor.initial_angle_rad,
            (_, Device::Mass(mass)) => mass.initial_position_m,
        }
    }

    /// Returns the sample period in whole clocks.
    #[must_use]
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / self.method.sample_rate_hz)
    }

    /// Returns the clocks of a period of the modulator, if its gates drive the device. Periods begin at the edges after
    /// multiples of that number.
    #[must_use]
    pub fn modulator_clocks(&self) -> Option<u64> {
        let switches = matches!(self.device, Device::Motor(_)) && self.model.bridge == BridgeModel::Switching;
        switches.then(|| 1 << self.method.pwm.bits)
    }

    /// Returns the solver's step in whole clocks, at least one: a sample period if the scene sets no step.
    #[must_use]
    pub fn step_clocks(&self) -> u64 {
        self.model.step_s.map_or(self.period_clocks(), |step_s| self.clock.edges(step_s).max(1))
    }

    /// Returns the time span over which a sampled velocity counts, in s.
    pub(crate) fn velocity_span_s(&self) -> f64 {
        let samples = match self.method.kind {
            Loop::Law(LawMethod::SampledWall(wall)) => {
                let window = if wall.estimator == Estimator::Window { wall.window } else { 1 };
                f64::from(wall.ratio) * f64::from(window)
            }
            _ => 1.0,
        };
        samples * self.sample_period_s()
    }

    /// Returns an error at one of the scene's keys.
    #[must_use]
    pub fn error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.places.error(key, reason)
    }

    /// Returns the sample period in seconds, as the clock realises it.
    #[must_use]
    pub fn sample_period_s(&self) -> f64 {
        self.period_clocks() as f64 / self.clock.frequency_hz() as f64
    }
}
