//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod confined;
mod criteria;
mod dsverifier;
mod lasting;
mod networks;
mod proofs_common;
mod ranges;
mod ranges_device;
mod ranges_wraps;
mod recurring;
