//! What GHDL calls through VHPIDIRECT; see `testbench/vhdl/hpu_dut_bridge.vhd`.
//!
//! A panic in here ends the process with its message: Rust never unwinds through an `extern "C"` function.

use std::cell::RefCell;

use crate::dut::{ASK, Inside, Served};

/// A count that VHDL handed over, which is a `natural`.
fn natural(value: i32) -> usize {
    usize::try_from(value).expect("a natural number")
}

thread_local! {
    /// The design of this process, which GHDL runs in one thread.
    static DUT: RefCell<Option<Served>> = const { RefCell::new(None) };
}

fn with_dut<R>(act: impl FnOnce(&mut Served) -> R) -> R {
    DUT.with_borrow_mut(|dut| act(dut.as_mut().expect("the bench has met hpu")))
}

/// Whether the bench is to tell what its ports are, and end.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_asks() -> i32 {
    if std::env::var_os(ASK).is_none() {
        return 0;
    }
    for signal in Inside::all().map(|inside| inside.signals).unwrap_or_default() {
        println!("INSIDE {} {} {}", signal.name, signal.width, if signal.is_number { "number" } else { "unsigned" });
    }
    1
}

/// Names the functions that GHDL calls at its start, which it looks for where it is asked for signals: none.
#[allow(non_upper_case_globals, reason = "the name is the standard's")]
#[unsafe(no_mangle)]
pub static vlog_startup_routines: [Option<extern "C" fn()>; 1] = [None];

/// A port: its bits, and whether they are an unsigned word, a signed one, or a number.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_port(width: i32, kind: i32) {
    let kind = match kind {
        0 => "unsigned",
        1 => "signed",
        _ => "number",
    };
    println!("PORT {width} {kind}");
}

/// Meets the parent.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_open() -> i32 {
    DUT.set(Some(Served::open().unwrap_or_else(|error| panic!("hpu does not answer: {error}"))));
    1
}

/// Part of the bits at an input.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_input(port: i32, part: i32) -> i32 {
    with_dut(|dut| dut.input(natural(port), natural(part)))
}

/// Part of the bits at an output that has so many, -1 when one of them is unknown. Nobody listens before the bench has
/// met its parent: outputs are told again when they change, and at the reset.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_word(port: i32, part: i32, word: i32, width: i32) {
    EARLY.with_borrow_mut(|early| {
        if DUT.with_borrow(Option::is_some) {
            for (port, part, word, width) in early.drain(..) {
                with_dut(|dut| dut.tell(port, part, word, width));
            }
            with_dut(|dut| dut.tell(natural(port), natural(part), word, width.cast_unsigned()));
        } else {
            early.push((natural(port), natural(part), word, width.cast_unsigned()));
        }
    });
}

thread_local! {
    /// What outputs were at the start of the simulation.
    static EARLY: RefCell<Vec<(usize, usize, i32, u32)>> = const { RefCell::new(Vec::new()) };
}

/// After the reset.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_reset() {
    EARLY.with_borrow_mut(|early| {
        for (port, part, word, width) in early.drain(..) {
            with_dut(|dut| dut.tell(port, part, word, width));
        }
    });
    with_dut(|dut| dut.edge(true));
}

/// Answers, and takes the next request.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_next() -> i32 {
    with_dut(Served::next).unwrap_or(-1)
}

/// After an edge: whether an output that drives the device has changed.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_edge() -> i32 {
    i32::from(with_dut(|dut| dut.edge(false)))
}
