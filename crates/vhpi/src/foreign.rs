//! The functions that GHDL calls through VHPIDIRECT; see `testbench/vhdl/hpu_dut_bridge.vhd`.
//!
//! A panic here ends the process with its message: Rust never unwinds through an `extern "C"` function.

use std::cell::RefCell;

use crate::ASK;
use crate::served::Served;
use crate::vpi::Inside;

/// Converts a count that VHDL passed, which is a `natural`.
fn natural(value: i32) -> usize {
    usize::try_from(value).expect("a natural number")
}

thread_local! {
    /// The design of this process. GHDL runs it in one thread.
    static DUT: RefCell<Option<Served>> = const { RefCell::new(None) };
}

fn with_dut<R>(act: impl FnOnce(&mut Served) -> R) -> R {
    DUT.with_borrow_mut(|dut| act(dut.as_mut().expect("the bench has met hpu")))
}

/// Returns 1 when the bench has to report its ports and end, else 0.
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

/// Names the functions that GHDL calls at its start: none. GHDL looks for this list when a VPI library is loaded.
#[allow(non_upper_case_globals, reason = "the name is the standard's")]
#[unsafe(no_mangle)]
pub static vlog_startup_routines: [Option<extern "C" fn()>; 1] = [None];

/// Reports a port: its number of bits, and whether it is an unsigned word, a signed word, or a number.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_port(width: i32, kind: i32) {
    let kind = match kind {
        0 => "unsigned",
        1 => "signed",
        _ => "number",
    };
    println!("PORT {width} {kind}");
}

/// Connects to the parent.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_open() -> i32 {
    DUT.set(Some(Served::open().unwrap_or_else(|error| panic!("hpu does not answer: {error}"))));
    1
}

/// Returns part of the bits at an input.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_input(port: i32, part: i32) -> i32 {
    with_dut(|dut| dut.input(natural(port), natural(part)))
}

/// Reports part of the bits of an output with `width` bits; -1 when one of them is unknown. Reports from before the
/// bench has connected to its parent are kept, and passed on with the next report or at the reset.
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
    /// The outputs that were reported at the start of the simulation, before the bench had connected.
    static EARLY: RefCell<Vec<(usize, usize, i32, u32)>> = const { RefCell::new(Vec::new()) };
}

/// Reports that the reset is over.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_reset() {
    EARLY.with_borrow_mut(|early| {
        for (port, part, word, width) in early.drain(..) {
            with_dut(|dut| dut.tell(port, part, word, width));
        }
    });
    with_dut(|dut| dut.edge(true));
}

/// Sends the answer and receives the next request. Returns the number of edges to clock, -1 when the parent is gone.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_next() -> i32 {
    with_dut(Served::next).unwrap_or(-1)
}

/// Reports that an edge is over. Returns 1 when an output that drives the device has changed, else 0.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_dut_edge() -> i32 {
    i32::from(with_dut(|dut| dut.edge(false)))
}
