//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod accuracy;
mod chart;
mod criteria;
mod drop_chart;
mod fit;
mod limits;
mod map;
mod map_edges;
mod map_refine;
mod proofs_common;
mod reproduce;
mod reproduce_errs;
mod reproduce_hybrid;
mod reproduce_scaling;
mod reproduce_shaper;
mod units;
mod width_price;
mod width_proofs;
mod width_proofs_device;
mod width_proofs_gappa;
mod width_proofs_phantom;
mod width_proofs_wraps;
mod width_search;
mod width_search_phantom;
mod widths;
mod words;
