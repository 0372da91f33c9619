//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod device;
mod html;
mod trace_table;
