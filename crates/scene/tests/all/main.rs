//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod counts;
mod errors;
mod foc;
mod keys;
mod lab_files;
mod laws;
mod library;
mod line_ends;
mod methods;
mod network;
mod phantom_refusals;
mod pmsm;
mod recordings;
mod replay;
mod transfer;
mod words;
