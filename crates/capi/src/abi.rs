//! The C interface; `include/hpu.h` documents it.
//!
//! Every function checks its pointers for null, and lets no panic out. A pointer that is not null must be valid for its
//! length, as anywhere in C.

use std::ffi::{CStr, c_char};
use std::path::PathBuf;
use std::slice;

use hpu_cosim::SceneFile;
use hpu_signal::Signal;

use crate::block::Block;
use crate::error::{Error, Status};
use crate::plant::{Plant, no_index};
use crate::table::{self, Object};

/// `HPU_OK`.
const OK: i32 = 0;
/// The kinds of signals.
const INPUT: i32 = 0;
const OUTPUT: i32 = 1;
const STATE: i32 = 2;

/// `hpu_error`.
#[repr(C)]
pub struct CError {
    status: i32,
    text: [c_char; 4092],
}

/// `hpu_signal`.
#[repr(C)]
pub struct CSignal {
    name: [c_char; 64],
    unit: [c_char; 32],
    doc: [c_char; 256],
    is_signed: i32,
    width: i32,
    fraction: i32,
}

/// `hpu_energy`.
#[repr(C)]
pub struct CEnergy {
    source_j: f64,
    hand_j: f64,
    supplied_j: f64,
    stored_j: f64,
    copper_j: f64,
    diodes_j: f64,
    viscous_j: f64,
    coulomb_j: f64,
    transmission_j: f64,
    dissipated_j: f64,
    exchanged_j: f64,
    residual_j: f64,
}

/// Writes a text with a zero at its end, cut at a whole character if it is too long.
fn write(text: &str, to: &mut [c_char]) {
    let length = text.floor_char_boundary(to.len() - 1);
    for (place, byte) in to.iter_mut().zip(&text.as_bytes()[..length]) {
        *place = byte.cast_signed() as c_char;
    }
    to[length] = 0;
}

/// Ends a call: writes an error, if there is one and a place for it.
#[inline]
fn end(done: Result<(), Error>, error: *mut CError) -> i32 {
    match done {
        Ok(()) => OK,
        Err(why) => tell(&why, error),
    }
}

#[cold]
fn tell(why: &Error, error: *mut CError) -> i32 {
    // SAFETY: a pointer that is not null is valid.
    if let Some(error) = unsafe { error.as_mut() } {
        error.status = why.status as i32;
        write(&why.text, &mut error.text);
    }
    why.status as i32
}

#[cold]
fn argument(text: impl std::fmt::Display) -> Error {
    Error::new(Status::Argument, text)
}

/// Returns the place that a result is written to.
#[inline]
fn place<'a, T>(pointer: *mut T, name: &str) -> Result<&'a mut T, Error> {
    // SAFETY: a pointer that is not null is valid.
    unsafe { pointer.as_mut() }.ok_or_else(|| argument(format!("{name} is null")))
}

/// Returns an array; a null one must have no elements.
#[inline]
fn array<'a, T>(pointer: *const T, count: usize, name: &str) -> Result<&'a [T], Error> {
    match (pointer.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(argument(format!("{name} is null, with {count} elements"))),
        // SAFETY: a pointer that is not null is valid for its length.
        (false, _) => Ok(unsafe { slice::from_raw_parts(pointer, count) }),
    }
}

#[inline]
fn array_mut<'a, T>(pointer: *mut T, count: usize, name: &str) -> Result<&'a mut [T], Error> {
    array(pointer, count, name)?;
    if count == 0 {
        return Ok(&mut []);
    }
    // SAFETY: it is not null, and valid for its length.
    Ok(unsafe { slice::from_raw_parts_mut(pointer, count) })
}

fn text<'a>(pointer: *const c_char, name: &str) -> Result<&'a str, Error> {
    if pointer.is_null() {
        return Err(argument(format!("{name} is null")));
    }
    // SAFETY: a pointer that is not null is valid up to the zero at its end.
    unsafe { CStr::from_ptr(pointer) }.to_str().map_err(|error| argument(format!("{name} is no UTF-8: {error}")))
}

/// Reads texts of the form `KEY=VALUE`.
fn pairs(pointer: *const *const c_char, count: usize, name: &str) -> Result<Vec<(String, String)>, Error> {
    let pair = |(index, &pointer): (usize, &*const c_char)| {
        let name = format!("{name}[{index}]");
        let text = text(pointer, &name)?;
        let (key, value) = text
            .split_once('=')
            .ok_or_else(|| argument(format!("{name} is `{text}`; accepted: KEY=VALUE, as in wall.stiffness=2")))?;
        Ok((key.to_string(), value.to_string()))
    };
    array(pointer, count, name)?.iter().enumerate().map(pair).collect()
}

fn opened(handle: *mut u64, make: impl FnOnce() -> Result<Object, Error>) -> Result<(), Error> {
    table::guarded(|| {
        let handle = place(handle, "handle")?;
        *handle = 0;
        *handle = table::open(make()?)?;
        Ok(())
    })
}

/// Calls `act` with the plant that a handle names.
#[inline]
fn plant<R>(handle: u64, act: impl FnOnce(&mut Plant) -> Result<R, Error>) -> Result<R, Error> {
    table::with(handle, |object| match object {
        Object::Plant(plant) => act(plant),
        other => Err(other_than(other, "a plant")),
    })
}

fn block<R>(handle: u64, act: impl FnOnce(&mut Block) -> Result<R, Error>) -> Result<R, Error> {
    table::with(handle, |object| match object {
        Object::Block(block) => act(block),
        other => Err(other_than(other, "a block")),
    })
}

#[cold]
fn other_than(found: &Object, wanted: &str) -> Error {
    let found = match found {
        Object::Plant(_) => "a plant",
        Object::Block(_) => "a block",
        Object::None | Object::Broken => {
            return Error::new(Status::Broken, "a fault of libhpu has broken this handle; it can only be closed");
        }
    };
    argument(format!("the handle is {found}; accepted: {wanted}"))
}

/// Calls `act` with the signals of a kind; states are told as signals without a word.
fn signals<R>(handle: u64, kind: i32, act: impl FnOnce(&[Signal]) -> Result<R, Error>) -> Result<R, Error> {
    let no_kind = || argument(format!("kind is {kind}; accepted: HPU_INPUT, HPU_OUTPUT, and HPU_STATE of a plant"));
    table::with(handle, |object| match (object, kind) {
        (Object::Plant(plant), INPUT) => act(plant.inputs()),
        (Object::Plant(plant), OUTPUT) => act(plant.outputs()),
        (Object::Plant(plant), STATE) => {
            let states: Vec<_> =
                plant.states().map(|real| Signal::new(real.name, hpu_signal::Format::BIT, "", real.doc)).collect();
            act(&states)
        }
        (Object::Block(block), INPUT) => act(block.inputs()),
        (Object::Block(block), OUTPUT) => act(block.outputs()),
        (Object::Plant(_) | Object::Block(_), _) => Err(no_kind()),
        (other, _) => Err(other_than(other, "a plant or a block")),
    })
}

/// Returns the version: 1000000 times the major number, 1000 times the minor one, the patch.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_version() -> u32 {
    let number = |text: &str| text.parse::<u32>().unwrap_or(0);
    number(env!("CARGO_PKG_VERSION_MAJOR")) * 1_000_000
        + number(env!("CARGO_PKG_VERSION_MINOR")) * 1_000
        + number(env!("CARGO_PKG_VERSION_PATCH"))
}

/// Opens the plant of a scene by the path of its file or by its shipped name.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_open(
    scene: *const c_char,
    overrides: *const *const c_char,
    count: usize,
    handle: *mut u64,
    error: *mut CError,
) -> i32 {
    let made = || {
        let file = SceneFile::find(text(scene, "scene")?).map_err(|error| Error::new(Status::Refused, error))?;
        Plant::open(&file, &pairs(overrides, count, "overrides")?).map(|plant| Object::Plant(Box::new(plant)))
    };
    end(opened(handle, made), error)
}

/// Opens the plant of a scene by its text.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_open_text(
    scene: *const c_char,
    name: *const c_char,
    folder: *const c_char,
    overrides: *const *const c_char,
    count: usize,
    handle: *mut u64,
    error: *mut CError,
) -> i32 {
    let made = || {
        let data = PathBuf::from(text(folder, "folder")?);
        let (name, text) = (text(name, "name")?.to_string(), text(scene, "scene")?.to_string());
        let file = SceneFile { name, text, data, is_shipped: false };
        Plant::open(&file, &pairs(overrides, count, "overrides")?).map(|plant| Object::Plant(Box::new(plant)))
    };
    end(opened(handle, made), error)
}

/// Opens a block in its state after reset.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_open_block(
    name: *const c_char,
    generics: *const *const c_char,
    count: usize,
    handle: *mut u64,
    error: *mut CError,
) -> i32 {
    let made = || {
        Block::new(text(name, "name")?, &pairs(generics, count, "generics")?)
            .map(|block| Object::Block(Box::new(block)))
    };
    end(opened(handle, made), error)
}

/// Closes a plant or a block.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_close(handle: u64, error: *mut CError) -> i32 {
    end(table::close(handle), error)
}

/// Returns the number of signals of a kind.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_count(handle: u64, kind: i32, count: *mut usize, error: *mut CError) -> i32 {
    let done = signals(handle, kind, |signals| {
        *place(count, "count")? = signals.len();
        Ok(())
    });
    end(done, error)
}

/// Describes a signal.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_describe(handle: u64, kind: i32, index: usize, signal: *mut CSignal, error: *mut CError) -> i32 {
    let done = signals(handle, kind, |signals| {
        let to = place(signal, "signal")?;
        let from = signals.get(index).ok_or_else(|| argument(no_index(index, "signal", signals.len())))?;
        write(from.name, &mut to.name);
        write(from.unit, &mut to.unit);
        write(from.doc, &mut to.doc);
        let format = from.format;
        (to.is_signed, to.width, to.fraction) = if kind == STATE {
            (1, 0, 0)
        } else {
            (i32::from(format.is_signed()), format.width().cast_signed(), format.frac())
        };
        Ok(())
    });
    end(done, error)
}

/// Finds a signal by its name.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_find(handle: u64, kind: i32, name: *const c_char, index: *mut usize, error: *mut CError) -> i32 {
    let done = signals(handle, kind, |signals| {
        let (name, index) = (text(name, "name")?, place(index, "index")?);
        *index = signals.iter().position(|signal| signal.name == name).ok_or_else(|| {
            let all: Vec<_> = signals.iter().map(|signal| signal.name).collect();
            argument(format!("no signal `{name}`; accepted: {}", all.join(", ")))
        })?;
        Ok(())
    });
    end(done, error)
}

/// Reads the first inputs.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_read(handle: u64, words: *mut i64, count: usize, error: *mut CError) -> i32 {
    end(plant(handle, |plant| read(plant, array_mut(words, count, "words")?)), error)
}

#[inline]
fn read(plant: &Plant, to: &mut [i64]) -> Result<(), Error> {
    let (from, count) = (plant.words(), to.len());
    let from = from.get(..count).ok_or_else(|| argument(format!("count is {count}; accepted: 0 to {}", from.len())))?;
    to.copy_from_slice(from);
    Ok(())
}

/// Sets all outputs, moves on by a clock edge, and reads the first inputs there.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_step(
    handle: u64,
    outputs: *const i64,
    count: usize,
    inputs: *mut i64,
    first: usize,
    error: *mut CError,
) -> i32 {
    let done = plant(handle, |plant| {
        let (outputs, inputs) = (array(outputs, count, "outputs")?, array_mut(inputs, first, "inputs")?);
        plant.drive(outputs)?;
        plant.advance(1)?;
        read(plant, inputs)
    });
    end(done, error)
}

/// Sets all outputs.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_drive(handle: u64, words: *const i64, count: usize, error: *mut CError) -> i32 {
    end(plant(handle, |plant| plant.drive(array(words, count, "words")?)), error)
}

/// Sets one output.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_set(handle: u64, output: usize, word: i64, error: *mut CError) -> i32 {
    end(plant(handle, |plant| plant.set(output, word)), error)
}

/// Moves on by clock edges.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_advance(handle: u64, edges: u64, error: *mut CError) -> i32 {
    end(plant(handle, |plant| plant.advance(edges)), error)
}

/// Tells for how many edges the inputs keep their words.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_quiet(handle: u64, edges: *mut u64, error: *mut CError) -> i32 {
    end(plant(handle, |plant| place(edges, "edges").map(|edges| *edges = plant.quiet())), error)
}

/// Moves on by nanoseconds.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_advance_ns(handle: u64, nanoseconds: u64, error: *mut CError) -> i32 {
    end(plant(handle, |plant| plant.advance_ns(nanoseconds)), error)
}

/// Tells the present clock edge, and its time in seconds.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_now(handle: u64, edge: *mut u64, seconds: *mut f64, error: *mut CError) -> i32 {
    let done = plant(handle, |plant| {
        let (edge, seconds) = (place(edge, "edge")?, place(seconds, "seconds")?);
        (*edge, *seconds) = (plant.edge(), plant.seconds());
        Ok(())
    });
    end(done, error)
}

/// Tells the clock's frequency in Hz, and the edge at which the scene ends.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_clock(handle: u64, frequency_hz: *mut u64, edges: *mut u64, error: *mut CError) -> i32 {
    let done = plant(handle, |plant| {
        let (frequency_hz, edges) = (place(frequency_hz, "frequency_hz")?, place(edges, "edges")?);
        (*frequency_hz, *edges) = (plant.clock().frequency_hz(), plant.edges());
        Ok(())
    });
    end(done, error)
}

/// Reads a state.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_state(handle: u64, index: usize, value: *mut f64, error: *mut CError) -> i32 {
    let done = plant(handle, |plant| {
        *place(value, "value")? = plant.state(index)?;
        Ok(())
    });
    end(done, error)
}

/// Reads the energies.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_energies(handle: u64, energy: *mut CEnergy, error: *mut CError) -> i32 {
    let done = plant(handle, |plant| {
        let to = place(energy, "energy")?;
        let of = plant.energy();
        *to = CEnergy {
            source_j: of.source_j,
            hand_j: of.hand_j,
            supplied_j: of.supplied_j,
            stored_j: of.stored_j,
            copper_j: of.copper_j,
            diodes_j: of.diodes_j,
            viscous_j: of.viscous_j,
            coulomb_j: of.coulomb_j,
            transmission_j: of.transmission_j,
            dissipated_j: of.dissipated_j,
            exchanged_j: of.exchanged_j,
            residual_j: of.residual_j,
        };
        Ok(())
    });
    end(done, error)
}

/// Computes one clock edge of a block.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_tick(
    handle: u64,
    inputs: *const i64,
    input_count: usize,
    outputs: *mut i64,
    output_count: usize,
    error: *mut CError,
) -> i32 {
    let done = block(handle, |block| {
        let (from, to) = (array(inputs, input_count, "inputs")?, outputs_of(block, outputs, output_count)?);
        to.copy_from_slice(&block.tick(from)?);
        Ok(())
    });
    end(done, error)
}

/// Computes one clock edge of a block with its reset active.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_reset(handle: u64, outputs: *mut i64, output_count: usize, error: *mut CError) -> i32 {
    let done = block(handle, |block| {
        outputs_of(block, outputs, output_count)?.copy_from_slice(&block.reset());
        Ok(())
    });
    end(done, error)
}

fn outputs_of<'a>(block: &Block, outputs: *mut i64, count: usize) -> Result<&'a mut [i64], Error> {
    let wanted = block.outputs().len();
    if count != wanted {
        return Err(argument(format!("output_count is {count}; accepted: {wanted}")));
    }
    array_mut(outputs, count, "outputs")
}
