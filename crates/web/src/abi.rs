//! The interface of the WebAssembly module.
//!
//! The page writes a request into memory of [`hpu_take`] and calls [`hpu_answer`]. The module keeps the answer until
//! the next request: [`hpu_json`], [`hpu_column`] and [`hpu_file`] return where its parts lie. All parts live in the
//! module's one linear memory; the page copies them before the next call, because the memory may move then.
//!
//! A panic ends the module. Its message is left where [`hpu_json`] points.

use std::cell::RefCell;
use std::panic::{self, PanicHookInfo};

use serde_json::json;

use crate::{Answer, answer};

/// The request, and the answer in the form in which the page reads it.
#[derive(Default)]
struct Kept {
    request: Vec<u8>,
    json: Vec<u8>,
    answer: Answer,
}

thread_local! {
    static KEPT: RefCell<Kept> = RefCell::default();
}

/// Leaves the message of a panic in the place of the JSON.
fn tell(info: &PanicHookInfo) {
    let json = json!({ "errors": [{ "key": "", "message": format!("the engine stopped: {info}") }] }).to_string();
    KEPT.with(|kept| kept.try_borrow_mut().map(|mut kept| kept.json = json.into_bytes()).ok());
}

/// Makes room for a request of so many bytes, and returns where to write it.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_take(length: usize) -> *mut u8 {
    KEPT.with_borrow_mut(|kept| {
        kept.request = vec![0; length];
        kept.request.as_mut_ptr()
    })
}

/// Answers the request that was written. Returns 0 for a result and 1 for a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_answer() -> u32 {
    // Elsewhere a panic is told by the program that links the library.
    if cfg!(target_family = "wasm") {
        panic::set_hook(Box::new(tell));
    }
    let request = KEPT.with_borrow_mut(|kept| {
        // The answer before makes room for this one.
        kept.answer = Answer::default();
        std::mem::take(&mut kept.request)
    });
    let answered = answer(&String::from_utf8_lossy(&request));
    KEPT.with_borrow_mut(|kept| {
        let refused = u32::from(answered.is_err());
        kept.answer = answered.unwrap_or_else(|refusal| refusal.json().into());
        kept.json = kept.answer.json.to_string().into_bytes();
        refused
    })
}

/// Returns where the JSON of the answer lies.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_json() -> *const u8 {
    KEPT.with_borrow(|kept| kept.json.as_ptr())
}

/// Returns the bytes of the JSON.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_json_length() -> usize {
    KEPT.with_borrow(|kept| kept.json.len())
}

/// Returns where a column of doubles lies; null if the answer has no such column.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_column(index: usize) -> *const f64 {
    KEPT.with_borrow(|kept| kept.answer.columns.get(index).map_or(std::ptr::null(), Vec::as_ptr))
}

/// Returns the number of values of a column; 0 if the answer has no such column.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_column_length(index: usize) -> usize {
    KEPT.with_borrow(|kept| kept.answer.columns.get(index).map_or(0, Vec::len))
}

/// Returns where the bytes of the file lie.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_file() -> *const u8 {
    KEPT.with_borrow(|kept| kept.answer.file.as_ptr())
}

/// Returns the number of bytes of the file.
#[unsafe(no_mangle)]
pub extern "C" fn hpu_file_length() -> usize {
    KEPT.with_borrow(|kept| kept.answer.file.len())
}
