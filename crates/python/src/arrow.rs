//! The Arrow C data and stream interfaces of a table of doubles, without a copy of its values.
//!
//! The structs are those of the [specification](https://arrow.apache.org/docs/format/CDataInterface.html). Each owns
//! what it points to by `private_data`, and frees it when a consumer calls `release`. A capsule that no consumer has
//! taken releases its struct itself.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::{null, null_mut};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyCapsule;

/// A table: names, and columns of equal length.
pub type Columns = Arc<Vec<(CString, Arc<Vec<f64>>)>>;

#[repr(C)]
struct Schema {
    format: *const c_char,
    name: *const c_char,
    metadata: *const c_char,
    flags: i64,
    n_children: i64,
    children: *mut *mut Schema,
    dictionary: *mut Schema,
    release: Option<unsafe extern "C" fn(*mut Schema)>,
    private_data: *mut c_void,
}

#[repr(C)]
struct Array {
    length: i64,
    null_count: i64,
    offset: i64,
    n_buffers: i64,
    n_children: i64,
    buffers: *mut *const c_void,
    children: *mut *mut Array,
    dictionary: *mut Array,
    release: Option<unsafe extern "C" fn(*mut Array)>,
    private_data: *mut c_void,
}

#[repr(C)]
struct Stream {
    get_schema: unsafe extern "C" fn(*mut Stream, *mut Schema) -> c_int,
    get_next: unsafe extern "C" fn(*mut Stream, *mut Array) -> c_int,
    get_last_error: unsafe extern "C" fn(*mut Stream) -> *const c_char,
    release: Option<unsafe extern "C" fn(*mut Stream)>,
    private_data: *mut c_void,
}

/// Owned by a schema or an array: the table, its children and its pointers to buffers.
struct PrivateData<T> {
    _columns: Columns,
    children: Vec<*mut T>,
    buffers: Vec<*const c_void>,
}

impl<T> PrivateData<T> {
    /// Returns the address of what is held, of the pointers to its children, and of those to its buffers.
    fn leak(
        columns: &Columns,
        children: Vec<T>,
        buffers: Vec<*const c_void>,
    ) -> (*mut c_void, *mut *mut T, *mut *const c_void) {
        let children = children.into_iter().map(|child| Box::into_raw(Box::new(child))).collect();
        let held = Box::leak(Box::new(Self { _columns: columns.clone(), children, buffers }));
        let (children, buffers) = (held.children.as_mut_ptr(), held.buffers.as_mut_ptr());
        ((&raw mut *held).cast(), children, buffers)
    }

    /// Frees what is held; each child is dropped, which releases it unless a consumer has moved it out.
    ///
    /// # Safety
    ///
    /// `private_data` must come from [`leak`](Self::leak), and must not be used again.
    unsafe fn free(private_data: *mut c_void) {
        // SAFETY: both come from boxes, which are freed once.
        unsafe {
            let held = Box::from_raw(private_data.cast::<Self>());
            held.children.iter().for_each(|child| drop(Box::from_raw(*child)));
        }
    }
}

macro_rules! released {
    ($name:ident) => {
        impl Drop for $name {
            fn drop(&mut self) {
                if let Some(release) = self.release {
                    // SAFETY: it is not released yet.
                    unsafe { release(self) };
                }
            }
        }

        // SAFETY: what it points to is owned by it alone, or shared and never changed.
        unsafe impl Send for $name {}
    };
}

released!(Schema);
released!(Array);
released!(Stream);

impl Schema {
    /// Returns the schema of a struct of doubles.
    fn of(columns: &Columns) -> Self {
        let doubles = columns.iter().map(|(name, _)| Self::new(c"g", name, columns, Vec::new()));
        Self::new(c"+s", c"", columns, doubles.collect())
    }

    /// `format` and `name` must live as long as `columns`.
    fn new(format: &'static CStr, name: &CStr, columns: &Columns, children: Vec<Self>) -> Self {
        let n_children = children.len() as i64;
        let (private_data, children, _) = PrivateData::leak(columns, children, Vec::new());
        Self {
            format: format.as_ptr(),
            name: name.as_ptr(),
            metadata: null(),
            flags: 0,
            n_children,
            children,
            dictionary: null_mut(),
            release: Some(Self::release),
            private_data,
        }
    }

    unsafe extern "C" fn release(schema: *mut Self) {
        // SAFETY: a consumer calls it once, with a schema made here.
        unsafe {
            PrivateData::<Self>::free((*schema).private_data);
            (*schema).release = None;
        }
    }
}

impl Array {
    /// Returns the table as one array of structs.
    fn of(columns: &Columns) -> Self {
        let length = columns.first().map_or(0, |(_, values)| values.len());
        let doubles = columns.iter().map(|(_, values)| {
            // No bitmap: there are no nulls.
            Self::new(values.len(), columns, Vec::new(), vec![null(), values.as_ptr().cast()])
        });
        Self::new(length, columns, doubles.collect(), vec![null()])
    }

    /// The buffers must live as long as `columns`.
    fn new(length: usize, columns: &Columns, children: Vec<Self>, buffers: Vec<*const c_void>) -> Self {
        let (n_children, n_buffers) = (children.len() as i64, buffers.len() as i64);
        let (private_data, children, buffers) = PrivateData::leak(columns, children, buffers);
        Self {
            length: length as i64,
            null_count: 0,
            offset: 0,
            n_buffers,
            n_children,
            buffers,
            children,
            dictionary: null_mut(),
            release: Some(Self::release),
            private_data,
        }
    }

    unsafe extern "C" fn release(array: *mut Self) {
        // SAFETY: a consumer calls it once, with an array made here.
        unsafe {
            PrivateData::<Self>::free((*array).private_data);
            (*array).release = None;
        }
    }
}

/// Owned by a stream: the table, and whether its one array was taken.
struct Streamed {
    columns: Columns,
    taken: bool,
}

impl Stream {
    fn of(columns: &Columns) -> Self {
        let streamed = Box::new(Streamed { columns: columns.clone(), taken: false });
        Self {
            get_schema: Self::schema,
            get_next: Self::next,
            get_last_error: Self::last_error,
            release: Some(Self::release),
            private_data: Box::into_raw(streamed).cast(),
        }
    }

    unsafe extern "C" fn schema(stream: *mut Self, out: *mut Schema) -> c_int {
        // SAFETY: a consumer gives a stream made here, and room for a schema.
        unsafe { out.write(Schema::of(&(*(*stream).private_data.cast::<Streamed>()).columns)) };
        0
    }

    unsafe extern "C" fn next(stream: *mut Self, out: *mut Array) -> c_int {
        // SAFETY: a consumer gives a stream made here, and room for an array. An array without `release` is the end.
        unsafe {
            let streamed = &mut *(*stream).private_data.cast::<Streamed>();
            if streamed.taken {
                (&raw mut (*out).release).write(None);
            } else {
                out.write(Array::of(&streamed.columns));
            }
            streamed.taken = true;
        }
        0
    }

    unsafe extern "C" fn last_error(_: *mut Self) -> *const c_char {
        // No call fails.
        null()
    }

    unsafe extern "C" fn release(stream: *mut Self) {
        // SAFETY: a consumer calls it once, with a stream made here.
        unsafe {
            drop(Box::from_raw((*stream).private_data.cast::<Streamed>()));
            (*stream).release = None;
        }
    }
}

/// Returns the schema of a table in a capsule.
pub fn schema<'py>(py: Python<'py>, columns: &Columns) -> PyResult<Bound<'py, PyCapsule>> {
    PyCapsule::new_with_value(py, Schema::of(columns), c"arrow_schema")
}

/// Returns a table as an array of structs in a capsule.
pub fn array<'py>(py: Python<'py>, columns: &Columns) -> PyResult<Bound<'py, PyCapsule>> {
    PyCapsule::new_with_value(py, Array::of(columns), c"arrow_array")
}

/// Returns a table as a stream of one array of structs in a capsule.
pub fn stream<'py>(py: Python<'py>, columns: &Columns) -> PyResult<Bound<'py, PyCapsule>> {
    PyCapsule::new_with_value(py, Stream::of(columns), c"arrow_array_stream")
}
