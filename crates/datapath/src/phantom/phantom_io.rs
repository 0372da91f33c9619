//! The part of the FPGA that remains when a host computes the forces: it counts, and drives the motors.
//!
//! - **Equation**: `position_i` counts the quadrature steps of `a_pin_i`, `b_pin_i`; `command_i` is `host_i` an edge
//!   later.
//! - **Ports**: `a_pin1` `b_pin1` `a_pin2` `b_pin2` `a_pin3` `b_pin3`, `host1` `host2` `host3` (1,COMMAND_WIDTH-1,0) in
//!   DAC counts, in; `position1` `position2` `position3` (0,POSITION_WIDTH,0), `command1` `command2` `command3`
//!   (1,COMMAND_WIDTH-1,0) out.
//! - **Latency**: 4 edges from a pin to its position, 1 from the host to a command.
//! - **Reset**: all registers 0. **Overflow**: positions wrap.
//! - **VHDL twin**: `hdl/phantom_io.vhd`; the instances and nets have the names of [`Wiring`]'s. The `period` of `hold`
//!   is tied to 1 there and connected to no net here.
//! - **Source**: the host platforms that Sevcik et al. 2009 compare with.
//! - **Differs from the hardware**: the bus between host and FPGA is not in it; the time it takes is a part of the
//!   host's delay.

use hpu_signal::{Meter, Ports, Signal, SignalUse};

use super::encoders::{Encoders, Pins};
use super::words::natural;
use super::{CommandRegister, command_register};
use crate::circuit::instance;
use crate::listed::{Given, Listed};
use crate::{Block, ConfigError, Generic, Instance, Parts, Wiring, flatten, synchronizer};

hpu_signal::ports! {
    /// Inputs of the wiring: the encoders' pins and the host's commands.
    pub struct PhantomIoIn { a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3, host1, host2, host3 }
}

hpu_signal::ports! {
    /// Outputs of the wiring: positions for the host, commands for the motors.
    pub struct PhantomIoOut { position1, position2, position3, command1, command2, command3 }
}

const HOST: usize = 6;
const POSITIONS: usize = 9;
const COMMANDS: usize = POSITIONS + 3;
const LINES: usize = COMMANDS + 3;
const NETS: usize = LINES + Encoders::LINES;

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PhantomIo {
    position_width: u32,
    command_width: u32,
    encoders: Encoders,
    hold: CommandRegister,
    /// The inputs that the nets show; `None` since reset.
    settled: Option<PhantomIoIn<i64>>,
    words: [i64; NETS],
    meter: Meter<NETS>,
}

impl PhantomIo {
    /// Returns a wiring with counters of `position_width` and commands of `command_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless both are 2 to 62.
    pub fn new(position_width: u32, command_width: u32) -> Result<Self, ConfigError> {
        Ok(Self {
            position_width,
            command_width,
            encoders: Encoders::new(position_width)?,
            hold: CommandRegister::new(command_width, 2, 0)?,
            settled: None,
            words: [0; NETS],
            meter: Meter::default(),
        })
    }

    /// Puts the inputs on their nets.
    #[inline]
    fn show(&mut self, input: &PhantomIoIn<i64>) {
        let mut port = self.words.iter_mut();
        input.each(|&word| *port.next().expect("inputs come first") = word);
    }
}

/// Returns the inputs of the clocked blocks at the next edge.
#[inline]
fn seen(input: &PhantomIoIn<i64>) -> (Pins, command_register::In<i64>) {
    let PhantomIoIn { a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3, host1, host2, host3 } = *input;
    let pins = |a_pin, b_pin| synchronizer::In { a_pin, b_pin };
    let hold = command_register::In { d1: host1, d2: host2, d3: host3, period: 1 };
    ([pins(a_pin1, b_pin1), pins(a_pin2, b_pin2), pins(a_pin3, b_pin3)], hold)
}

impl Default for PhantomIo {
    fn default() -> Self {
        Self::new(16, 16).expect("the data sheet's default")
    }
}

impl Block for PhantomIo {
    const NAME: &'static str = "phantom_io";
    const CLOCKED: bool = true;
    type In<T> = PhantomIoIn<T>;
    type Out<T> = PhantomIoOut<T>;

    fn inputs(&self) -> PhantomIoIn<Signal> {
        let [a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3] = self.encoders.pins();
        let command_register::In { d1, d2, d3, .. } = self.hold.inputs();
        let host = |name, doc, d| Signal { name, doc, ..d };
        PhantomIoIn {
            a_pin1,
            b_pin1,
            a_pin2,
            b_pin2,
            a_pin3,
            b_pin3,
            host1: host("host1", "The host's command of motor 1", d1),
            host2: host("host2", "The host's command of motor 2", d2),
            host3: host("host3", "The host's command of motor 3", d3),
        }
    }

    fn outputs(&self) -> PhantomIoOut<Signal> {
        let [position1, position2, position3] = self.encoders.outputs();
        let command_register::Out { q1, q2, q3 } = self.hold.outputs();
        let command = |name, doc, q| Signal { name, doc, ..q };
        PhantomIoOut {
            position1,
            position2,
            position3,
            command1: command("command1", "Command of motor 1", q1),
            command2: command("command2", "Command of motor 2", q2),
            command3: command("command3", "Command of motor 3", q3),
        }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        vec![natural("POSITION_WIDTH", self.position_width), natural("COMMAND_WIDTH", self.command_width)]
    }

    fn parts(&self) -> Option<Parts> {
        Some(Parts::of(self))
    }

    fn reset(&mut self) -> PhantomIoOut<i64> {
        self.encoders.reset();
        self.hold.reset();
        self.settled = None;
        self.words = [0; NETS];
        self.meter = Meter::default();
        PhantomIoOut::build(|| 0)
    }

    #[inline]
    fn tick(&mut self, input: PhantomIoIn<i64>) -> PhantomIoOut<i64> {
        let before = self.words;
        let fresh = self.settled != Some(input);
        self.show(&input);
        self.settled = Some(input);
        let (pins, host) = seen(&input);
        self.encoders.tick(&pins);
        let command_register::Out { q1, q2, q3 } = self.hold.tick(host);
        let [position1, position2, position3] = self.encoders.positions();
        self.words[POSITIONS..COMMANDS].copy_from_slice(&[position1, position2, position3]);
        self.words[COMMANDS..LINES].copy_from_slice(&[q1, q2, q3]);
        self.words[LINES..].copy_from_slice(&self.encoders.lines());
        if fresh || self.words != before {
            self.meter.range(&self.words);
        }
        PhantomIoOut { position1, position2, position3, command1: q1, command2: q2, command3: q3 }
    }

    #[inline]
    fn quiet(&self, input: &PhantomIoIn<i64>) -> u64 {
        if self.settled != Some(*input) {
            return 0;
        }
        let (pins, host) = seen(input);
        self.encoders.quiet(&pins).min(self.hold.quiet(&host))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &PhantomIoIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        let (pins, host) = seen(input);
        self.encoders.skip(edges, &pins);
        self.hold.skip(edges, &host);
    }
}

impl Wiring for PhantomIo {
    fn nets(&self) -> Vec<Signal> {
        let mut all = flatten(&self.inputs());
        all.extend(flatten(&self.outputs()));
        all.extend(self.encoders.nets());
        all
    }

    fn instances(&self) -> Vec<Instance> {
        let mut all = self.encoders.instances(LINES, POSITIONS);
        // The ports in order: d1 d2 d3, period, which is tied, and q1 q2 q3.
        let ports = [HOST, HOST + 1, HOST + 2, 0, COMMANDS, COMMANDS + 1, COMMANDS + 2];
        let mut hold = instance("hold", &self.hold, &ports);
        hold.connections.retain(|connection| connection.port.name != "period");
        hold.tied.push(("period", 1));
        all.push(hold);
        all
    }

    fn settle(&mut self, input: &PhantomIoIn<i64>) {
        self.show(input);
        // The first edge treats its inputs as new ones.
        self.settled = None;
    }

    fn words(&self) -> &[i64] {
        &self.words
    }

    fn uses(&self) -> Vec<SignalUse> {
        self.meter.uses().to_vec()
    }
}

impl Listed for PhantomIo {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(given.natural("POSITION_WIDTH")?, given.natural("COMMAND_WIDTH")?)
    }

    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8, 8)?)])
    }
}
