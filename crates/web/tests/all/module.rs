//! The interface of the module, called as the page calls it.

use std::slice;

use serde_json::{Value, json};

unsafe extern "C" {
    safe fn hpu_take(length: usize) -> *mut u8;
    safe fn hpu_answer() -> u32;
    safe fn hpu_json() -> *const u8;
    safe fn hpu_json_length() -> usize;
    safe fn hpu_column(index: usize) -> *const f64;
    safe fn hpu_column_length(index: usize) -> usize;
    safe fn hpu_file() -> *const u8;
    safe fn hpu_file_length() -> usize;
}

/// Asks as the page does; returns whether the request was refused, and the JSON.
fn call(request: &[u8]) -> (bool, Value) {
    let place = hpu_take(request.len());
    // SAFETY: the module has made room for the request, and keeps its answer until the next one.
    let json = unsafe {
        slice::from_raw_parts_mut(place, request.len()).copy_from_slice(request);
        let refused = hpu_answer() != 0;
        (refused, slice::from_raw_parts(hpu_json(), hpu_json_length()))
    };
    (json.0, serde_json::from_slice(json.1).expect("JSON"))
}

#[test]
fn an_answer_lies_in_memory_until_the_next_request() {
    let request = json!({ "do": "run", "scene": "one-tick" }).to_string();
    let (refused, json) = call(request.as_bytes());
    assert!(!refused, "{json}");
    let columns = json["columns"].as_array().expect("columns").len();
    let rows = json["rows"]["count"].as_u64().expect("a count") as usize;
    for index in 0..columns {
        assert_eq!(hpu_column_length(index), rows);
        // SAFETY: the module keeps the columns until the next request.
        let column = unsafe { slice::from_raw_parts(hpu_column(index), rows) };
        assert!(column.iter().all(|value| value.is_finite()));
    }
    assert!(hpu_column(columns).is_null() && hpu_column_length(columns) == 0);
    let wave = json!({ "do": "wave", "scene": "one-tick", "format": "vcd" }).to_string();
    assert!(!call(wave.as_bytes()).0);
    // SAFETY: the module keeps the file until the next request.
    let file = unsafe { slice::from_raw_parts(hpu_file(), hpu_file_length()) };
    assert!(file.starts_with(b"$version\n    hpu "), "{}", String::from_utf8_lossy(&file[..60]));
    assert_eq!(hpu_column_length(0), 0);
}

#[test]
fn bytes_that_are_no_request_are_refused() {
    for bytes in [&b""[..], b"{", b"\xff\xfe", b"null"] {
        let (refused, json) = call(bytes);
        assert!(refused && json["errors"][0]["message"].is_string(), "{json}");
    }
}
