//! All tests of the crate in one binary: linked once, and spread over the cores together.

#[path = "../../../chart/tests/all/colours.rs"]
mod colours;
#[expect(dead_code, reason = "other tests of pictures use the rest")]
#[path = "../../../chart/tests/all/looks.rs"]
mod looks;
mod reproduce;
mod reproduce_errs;
mod reproduce_hybrid;
mod reproduce_paddle;
mod reproduce_scaling;
mod reproduce_seeds;
mod reproduce_shaper;
mod reproduce_summing;
mod reproduce_three_dof;
mod studies;
mod words;
