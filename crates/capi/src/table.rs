//! Handles: a number that names an open plant or block, and that is refused once it is closed.
//!
//! A handle is a place in a table and the generation of that place. Each call takes the place for itself by one
//! compare-and-swap, which finds closed handles and calls from two threads at once.

use std::any::Any;
use std::cell::UnsafeCell;
use std::mem;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::block::Block;
use crate::error::{Error, Status};
use crate::plant::Plant;

/// Handles that can be open at once.
const MOST: usize = 4096;
/// Bits of a handle that hold the place.
const PLACE_BITS: u32 = MOST.trailing_zeros();

/// The object that a handle names: a plant or a block.
pub(crate) enum Object {
    /// Nothing: the place is free.
    None,
    /// A plant.
    Plant(Box<Plant>),
    /// A block.
    Block(Box<Block>),
    /// An object that a fault of the library has left in an unknown state.
    Broken,
}

/// The states of a place, beside its generation.
const FREE: u64 = 0;
const OPEN: u64 = 1;
const BUSY: u64 = 2;

struct Place {
    /// The generation times 4, and the state.
    state: AtomicU64,
    object: UnsafeCell<Object>,
}

// SAFETY: only the thread that has set the state to `BUSY` reaches the object.
unsafe impl Sync for Place {}

static PLACES: [Place; MOST] =
    [const { Place { state: AtomicU64::new(0), object: UnsafeCell::new(Object::None) } }; MOST];

/// Opens a handle.
pub(crate) fn open(object: Object) -> Result<u64, Error> {
    for (index, place) in PLACES.iter().enumerate() {
        let state = place.state.load(Ordering::Relaxed);
        let (generation, busy) = (state / 4 + 1, (state / 4 + 1) * 4 + BUSY);
        let is_free = state % 4 == FREE;
        if is_free && place.state.compare_exchange(state, busy, Ordering::Acquire, Ordering::Relaxed).is_ok() {
            // SAFETY: the place is this thread's.
            unsafe { *place.object.get() = object };
            place.state.store(generation * 4 + OPEN, Ordering::Release);
            return Ok(generation << PLACE_BITS | index as u64);
        }
    }
    Err(Error::new(Status::Full, format!("{MOST} handles are open; close one first")))
}

/// Takes the place of a handle.
#[inline]
fn take(handle: u64) -> Result<(&'static Place, u64), Error> {
    let place = &PLACES[handle as usize % MOST];
    let generation = handle >> PLACE_BITS << 2;
    match place.state.compare_exchange(generation + OPEN, generation + BUSY, Ordering::Acquire, Ordering::Relaxed) {
        Ok(_) => Ok((place, generation)),
        Err(found) => Err(refused(handle, found == generation + BUSY)),
    }
}

#[cold]
fn refused(handle: u64, is_busy: bool) -> Error {
    if is_busy {
        let text = "another thread is inside a call with this handle; accepted: one thread at a time";
        return Error::new(Status::Busy, text);
    }
    let text = format!("handle {handle} is not open: it was closed, or nothing has opened it");
    Error::new(Status::Closed, text)
}

/// Calls `act` with what the handle names. A panic becomes an error, and leaves a handle that can only be closed.
#[inline]
pub(crate) fn with<R>(handle: u64, act: impl FnOnce(&mut Object) -> Result<R, Error>) -> Result<R, Error> {
    let (place, generation) = take(handle)?;
    // SAFETY: the place is this thread's until its state is stored.
    let object = unsafe { &mut *place.object.get() };
    let done = catch_unwind(AssertUnwindSafe(|| act(object)));
    let done = done.unwrap_or_else(|panic| {
        // Its fields may not fit each other any more, so they are not dropped.
        mem::forget(mem::replace(object, Object::Broken));
        Err(fault(&*panic))
    });
    place.state.store(generation + OPEN, Ordering::Release);
    done
}

/// Closes a handle.
pub(crate) fn close(handle: u64) -> Result<(), Error> {
    let (place, generation) = take(handle)?;
    // SAFETY: as in `with`.
    let object = mem::replace(unsafe { &mut *place.object.get() }, Object::None);
    place.state.store(generation + FREE, Ordering::Release);
    guarded(|| {
        drop(object);
        Ok(())
    })
}

/// Calls `act`, and makes an error of a panic.
pub(crate) fn guarded<R>(act: impl FnOnce() -> Result<R, Error>) -> Result<R, Error> {
    catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|panic| Err(fault(&*panic)))
}

#[cold]
fn fault(panic: &(dyn Any + Send)) -> Error {
    let said = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    Error::new(Status::Broken, format!("a fault of libhpu itself: {}", said.unwrap_or("a panic")))
}

#[cfg(test)]
mod tests {
    use super::{Object, close, guarded, open, with};
    use crate::block::Block;
    use crate::error::Status;

    #[test]
    fn a_panic_is_an_error_and_leaves_a_handle_that_can_only_be_closed() {
        let handle = open(Object::Block(Box::new(Block::new("pwm", &[]).expect("a block")))).expect("a free place");
        let panicked = with::<()>(handle, |_| panic!("torn")).expect_err("a panic");
        assert_eq!((panicked.status, panicked.text.as_str()), (Status::Broken, "a fault of libhpu itself: torn"));
        with(handle, |object| {
            assert!(matches!(object, Object::Broken));
            Ok(())
        })
        .expect("the handle is still open");
        assert_eq!(close(handle), Ok(()));
        assert_eq!(close(handle).expect_err("closed").status, Status::Closed);
        assert_eq!(guarded::<()>(|| panic!("{}", 7)).expect_err("a panic").text, "a fault of libhpu itself: 7");
    }
}
