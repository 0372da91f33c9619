//! What GHDL calls through VHPIDIRECT; see `testbench/vhdl/loop_bridge.vhd`.
//!
//! The scene comes in by the environment, see [`closed_loop`](crate::closed_loop). A panic in here ends the process
//! with its message: Rust never unwinds through an `extern "C"` function.

use std::cell::RefCell;

use hpu_cosim::{Ready, Rig};

use crate::closed_loop::Asked;
use crate::lockstep::Lockstep;

thread_local! {
    /// The one loop of this process, which GHDL runs in one thread.
    static LOOP: RefCell<Lockstep<'static>> = RefCell::new(open());
}

/// The scene lives as long as the process.
fn open() -> Lockstep<'static> {
    let Asked { scene, edges, late, record } = Asked::from_environment().unwrap_or_else(|error| panic!("{error}"));
    let session = Ready::new(Box::leak(Box::new(scene))).unwrap_or_else(|error| panic!("{error}"));
    let session: &Ready = Box::leak(Box::new(session));
    let mut lockstep = Lockstep::new(session, edges, late);
    if let Some(path) = record {
        let opened = lockstep.record(&path, session.stride());
        opened.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    lockstep
}

/// A count that VHDL handed over, which is a `natural`.
fn natural(value: i32) -> usize {
    usize::try_from(value).expect("a natural number")
}

/// Part of the word of an input.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_loop_input(net: i32, part: i32) -> i32 {
    LOOP.with_borrow(|side| side.input(natural(net), natural(part)))
}

/// Flows the plant by one clock: the one-bit inputs for the edge to come, and whether others have changed; after the
/// last one prints the result and says -1.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_loop_pins() -> i32 {
    LOOP.with_borrow_mut(|side| {
        side.pins().unwrap_or_else(|| {
            print!("{}", side.result());
            -1
        })
    })
}

/// Part of a net's word, -1 when it has an unknown bit.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_loop_net(net: i32, part: i32, word: i32) {
    LOOP.with_borrow_mut(|side| side.tell(natural(net), natural(part), word));
}

/// After an edge: compares, and drives the plant.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_loop_edge() {
    LOOP.with_borrow_mut(Lockstep::compare);
}
