//! Signals inside a design that GHDL simulates, read through the Verilog procedural interface (IEEE 1364-2005, clause
//! 27), which GHDL offers to the libraries that it loads.
//!
//! GHDL shows signals that are bits, vectors of bits or numbers. It shows neither variables of processes, nor
//! enumerations, nor arrays of words.

use std::collections::HashMap;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::fs;
use std::mem;
use std::ptr;

use super::{INSIDE, LIST};

/// The widest signal that is reported, in bits.
const MOST_BITS: u32 = u64::BITS;

/// The standard's numbers for kinds, properties and formats.
const MODULE: c_int = 32;
const NET: c_int = 36;
const PORT: c_int = 44;
const INTERNAL_SCOPE: c_int = 92;
const NAME: c_int = 2;
const SIZE: c_int = 4;
const VECTOR: c_int = 18;
const BINARY: c_int = 1;

/// An object of the simulation.
type Handle = *mut c_void;

unsafe extern "C" {
    /// Finds a symbol by its name (POSIX); in the whole program under the handle [`WHOLE_PROGRAM`].
    fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// `RTLD_DEFAULT` of `dlfcn.h`.
const WHOLE_PROGRAM: *mut c_void =
    ptr::without_provenance_mut(if cfg!(target_os = "macos") { usize::MAX - 1 } else { 0 });

/// A value as text: the requested format, and the answer.
#[repr(C)]
struct Value {
    format: c_int,
    text: *const c_char,
}

/// The functions of GHDL that are called here.
#[derive(Clone, Copy)]
struct Functions {
    iterate: unsafe extern "C" fn(c_int, Handle) -> Handle,
    scan: unsafe extern "C" fn(Handle) -> Handle,
    get: unsafe extern "C" fn(c_int, Handle) -> c_int,
    get_str: unsafe extern "C" fn(c_int, Handle) -> *const c_char,
    get_value: unsafe extern "C" fn(Handle, *mut Value),
}

impl Functions {
    /// Finds the functions in the program that has loaded this library. Returns `None` if it does not have them.
    fn new() -> Option<Self> {
        let find = |name: &CStr| {
            // SAFETY: a look-up by a text that ends with 0.
            let found = unsafe { dlsym(WHOLE_PROGRAM, name.as_ptr()) };
            (!found.is_null()).then_some(found)
        };
        // SAFETY: the standard says what the functions of these names take and return.
        unsafe {
            Some(Self {
                iterate: mem::transmute::<*mut c_void, unsafe extern "C" fn(c_int, Handle) -> Handle>(find(
                    c"vpi_iterate",
                )?),
                scan: mem::transmute::<*mut c_void, unsafe extern "C" fn(Handle) -> Handle>(find(c"vpi_scan")?),
                get: mem::transmute::<*mut c_void, unsafe extern "C" fn(c_int, Handle) -> c_int>(find(c"vpi_get")?),
                get_str: mem::transmute::<*mut c_void, unsafe extern "C" fn(c_int, Handle) -> *const c_char>(find(
                    c"vpi_get_str",
                )?),
                get_value: mem::transmute::<*mut c_void, unsafe extern "C" fn(Handle, *mut Value)>(find(
                    c"vpi_get_value",
                )?),
            })
        }
    }

    /// Returns all objects of a kind in a scope.
    fn all(self, kind: c_int, scope: Handle) -> Vec<Handle> {
        // SAFETY: the scope is null, which means the whole design, or an object of GHDL's; `scan` ends with null.
        unsafe {
            let each = (self.iterate)(kind, scope);
            if each.is_null() {
                return Vec::new();
            }
            std::iter::from_fn(|| Some((self.scan)(each)).filter(|found| !found.is_null())).collect()
        }
    }

    fn name(self, object: Handle) -> String {
        // SAFETY: the object is GHDL's. GHDL keeps its name until the next name is asked for.
        let name = unsafe { (self.get_str)(NAME, object) };
        if name.is_null() {
            return String::new();
        }
        // SAFETY: a text that ends with 0.
        unsafe { CStr::from_ptr(name) }.to_string_lossy().into_owned()
    }

    /// Returns a signal's bits as characters, the highest first; `None` for an enumeration.
    fn bits(self, signal: Handle) -> Option<&'static CStr> {
        let mut value = Value { format: BINARY, text: ptr::null() };
        // SAFETY: the signal is GHDL's. The text stays until the next value is asked for, and is read before that.
        unsafe {
            (self.get_value)(signal, &raw mut value);
            (!value.text.is_null()).then(|| CStr::from_ptr(value.text))
        }
    }
}

/// A signal inside the design.
pub(crate) struct Signal {
    /// Its path below the top of the design.
    pub(crate) name: String,
    pub(crate) width: u32,
    pub(crate) is_number: bool,
    handle: Handle,
}

/// The signals inside the design.
pub(crate) struct Inside {
    functions: Functions,
    pub(crate) signals: Vec<Signal>,
}

impl Inside {
    /// Returns all signals that GHDL shows of the design in this process, with the design's ports. Returns `None`
    /// unless they are asked for.
    pub(crate) fn all() -> Option<Self> {
        std::env::var_os(INSIDE)?;
        let functions = Functions::new()?;
        let mut inside = Self { functions, signals: Vec::new() };
        for bench in functions.all(MODULE, ptr::null_mut()) {
            for design in functions.all(INTERNAL_SCOPE, bench) {
                inside.add(design, "");
            }
        }
        Some(inside)
    }

    /// Returns the signals that the parent has listed, in its order; `None` without a list.
    pub(crate) fn listed() -> Option<Self> {
        let list = fs::read_to_string(LIST).ok()?;
        let Self { functions, signals } = Self::all()?;
        let mut by_name: HashMap<_, _> = signals.into_iter().map(|signal| (signal.name.clone(), signal)).collect();
        Some(Self { functions, signals: list.lines().filter_map(|name| by_name.remove(name)).collect() })
    }

    /// Adds the signals of a scope.
    fn add(&mut self, scope: Handle, path: &str) {
        let functions = self.functions;
        for kind in [PORT, NET] {
            for handle in functions.all(kind, scope) {
                // SAFETY: an object of GHDL's.
                let (size, vector) = unsafe { ((functions.get)(SIZE, handle), (functions.get)(VECTOR, handle)) };
                let (width, name) = (size.cast_unsigned(), path.to_string() + &functions.name(handle));
                // GHDL 2.0 counts ports among the nets; later versions do not.
                let is_known = self.signals.iter().any(|signal| signal.name == name);
                if (1..=MOST_BITS).contains(&width) && !is_known && functions.bits(handle).is_some() {
                    let is_number = vector == 0 && width == i32::BITS;
                    self.signals.push(Signal { name, width, is_number, handle });
                }
            }
        }
        for within in functions.all(INTERNAL_SCOPE, scope) {
            self.add(within, &format!("{path}{}.", functions.name(within)));
        }
    }

    /// Returns the bits of a signal; `None` when one of them is unknown.
    pub(crate) fn word(&self, signal: usize) -> Option<u64> {
        let bits = self.functions.bits(self.signals[signal].handle)?;
        bits.to_bytes().iter().try_fold(0, |word, bit| match bit {
            b'0' | b'L' => Some(word << 1),
            b'1' | b'H' => Some(word << 1 | 1),
            _ => None,
        })
    }
}
