//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod accuracy;
#[path = "../../../chart/tests/all/colours.rs"]
mod colours;
mod fit;
mod gimbal;
mod identify;
mod limits;
mod limits_box;
#[expect(dead_code, reason = "other tests of pictures use the rest")]
#[path = "../../../chart/tests/all/looks.rs"]
mod looks;
mod map;
mod map_edges;
mod map_refine;
#[expect(dead_code, reason = "the tests of an axis use the rest")]
#[path = "../../../prove/tests/all/proofs_common/mod.rs"]
mod proofs_common;
mod width_price;
mod width_proofs_gappa;
mod width_proofs_gimbal;
mod width_search;
mod width_search_phantom;
mod width_search_scenes;
mod widths;
