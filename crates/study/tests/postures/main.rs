//! The proofs of a PHANToM's words against millions of postures. A binary of its own: the blocks are compiled into the
//! tests, and `testbench/rustc.sh` optimises them here.

mod errors;
#[expect(dead_code, reason = "the tests of other proofs use the rest")]
#[path = "../../../prove/tests/all/proofs_common/mod.rs"]
mod proofs_common;
mod words;
