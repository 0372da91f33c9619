//! The keys of a design of the user's own.

pub(crate) use crate::axis::rows::*;

use crate::dut::{Engine, Registers, Standard};
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::{Choice, Flag, Group, Key, Own, Shape, Takes, Text, Whole, keys, named};

/// The form of `dut.files`.
pub(crate) const FILES: &str =
    "the design's files, as in [\"a.vhd\", \"b.vhd\"], or { file = \"p.vhd\", library = \"mylib\" } for one of them";

/// The forms of a format.
pub(crate) const FORMAT: &str = "a format, as in \"(1,7,8)\", \"Q7.8\" or \"sfixed(7 downto -8)\"";

/// The forms of a port or a part of one.
pub(crate) const PIN: &str = "a port or a part of one, as in \"ui_in[0]\", \"ab(7 downto 4)\" or \"enc.a\"";

/// The forms of a constant.
const CONSTANT: &str = "a number, true, false or a text";

keys! { dut: "dut" of [];
    /// Files of the design, VHDL or Verilog, in any order. VHDL in a library of its own is
    /// `{ file = "p.vhd", library = "mylib" }`.
    files: Own = Own::new(|| Takes::Own(Shape::List, FILES), Required);
    /// VHDL library that the files are compiled into.
    library: Text = Text("the name of a VHDL library", Is("work"));
    /// Topmost entity or module.
    top: Text = Text("the name of the topmost entity or module", Required);
    /// VHDL standard of the files.
    standard: Choice<Standard> =
        Choice::new(|| named(&Standard::ALL, Standard::name), Is(Standard::Vhdl2008));
    /// Simulator of the design; auto takes leap where it can and that pays, else Verilator, else GHDL. leap is hpu's
    /// own: it jumps over the clock edges at which only counters move.
    engine: Choice<Engine> = Choice::new(|| named(&Engine::ALL, Engine::name), Is(Engine::Auto));
    /// Value with which registers begin that neither an initial value nor the reset sets: unknown ends a run where one
    /// of them drives the device, zero is an FPGA that clears them, random goes by `run.seed`. In GHDL they are
    /// U, so zero and random need Verilator.
    registers: Choice<Registers> =
        Choice::new(|| named(&Registers::ALL, Registers::name), Is(Registers::Unknown));
    /// Port of the clock; required without `[dut.clocks]`.
    clock: Text = Text(
        "the port of the clock, as in clock = \"clk\", or [dut.clocks] with a line a port, as in clk = 1",
        Said("none"));
    /// Ports of several clocks, in the place of `clock`.
    clocks: Own = Own::section(Said("none"));
    /// Reset of the design.
    reset: Own = Own::section(Said("none"));
    /// Generics of a VHDL entity.
    generics: Own = Own::section(Said("the design's"));
    /// Parameters of a Verilog module.
    parameters: Own = Own::section(Said("the design's"));
    /// Names of ports' parts, by which they are connected.
    pins: Own = Own::section(Said("none"));
    /// Ports, and what each is connected to.
    ports: Own = Own::section(Said("the pins'"));
    /// Formats of words that the design's types do not say, of ports and of signals inside.
    formats: Own = Own::section(Said("the types'"));
    /// State of the bridge while `bridge.pwm` is 0: it shorts the motor, or opens all switches.
    off: Choice<bool> = Choice::new(|| vec![("brake", false), ("float", true)], Is(false));
}

keys! { dut_clocks: "dut.clocks" of [];
    /// Cycles of `clock.frequency` in one cycle of this port's clock; one of the clocks has 1.
    PORT: Whole<u32> = Whole::new(1, 1 << 16, Required);
}

keys! { dut_reset: "dut.reset" of [];
    /// Port of the reset.
    port: Text = Text("the port of the reset", Required);
    /// Level at which the port resets.
    active: Choice<bool> = Choice::new(|| vec![("high", false), ("low", true)], Is(false));
    /// Cycles of the slowest clock for which the reset is active before the run.
    clocks: Whole<u32> = Whole::new(1, 1 << 16, Is(4));
}

keys! { dut_generics: "dut.generics" of [];
    /// Value of the generic of this name: a number, true or false, a text. The text of a generic that is no string is
    /// its value as VHDL writes it: bits `"0101"`, a time `"5 us"`, a name of an enumeration, an expression.
    NAME: Own = Own::new(|| Takes::Own(Shape::Scalar, CONSTANT), Said("the design's"));
}

keys! { dut_parameters: "dut.parameters" of [];
    /// Value of the parameter of this name: a number, true or false, a text; `"8'h1F"` is a number with its width.
    NAME: Own = Own::new(|| Takes::Own(Shape::Scalar, CONSTANT), Said("the design's"));
}

keys! { dut_formats: "dut.formats" of [];
    /// Format of the port of this name, or of the signal inside at this path, as in `"u_vel.vel_r" = "Q7.8"`.
    NAME: Own = Own::new(|| Takes::Own(Shape::Scalar, FORMAT), Said("the type's"));
}

keys! { dut_pins: "dut.pins" of [];
    /// Port, or part of one, that this name stands for, as in `a = "ui_in[0]"`. Its connection is the one in
    /// `[dut.ports]`; without one there, the line of this name: `a`, `b` and `index` of the encoder, `pwm`,
    /// `direction`, `plus_high` and so on of the bridge.
    NAME: Own = Own::new(|| Takes::Own(Shape::Scalar, PIN), Said("none"));
}

keys! { dut_ports: "dut.ports" of [];
    /// Connection of the port of this name: a line, also after "not "; a pin of a network's sensor, as in
    /// `sensor.load.a`; a count; a constant; open; a word with a format; or a list of lines, constants and `open` for
    /// its bits, from the left. A key with an index or a range, as in `"ab(1)"`, `"ab[7:4]"` or `"ab(7 downto 4)"`,
    /// connects these bits alone.
    PORT: Own = Own::new(
        || Takes::Own(
            Shape::Connection,
            "a line, encoder.count, wall.count, open, a constant, a list of bits or { is, format }",
        ),
        Said("an output is open"));
}

keys! { dut_port: "dut.ports.PORT" of [];
    /// Quantity that the word stands for.
    is: Text = Text("\"encoder.angle\", \"bridge.duty\", \"amplifier.force\" or \"drive.current\"", Required);
    /// Format of the word, 2 to 32 bits.
    format: Text = Text("the word's format, as in \"(1,0,11)\"", Required);
    /// Inverts the highest bit of a signed word, as offset binary does; not of `encoder.angle`.
    offset_binary: Flag = Flag(false);
}
