//! All tests of the crate in one binary, which is linked once and runs its tests on all cores.

mod colours;
mod diagram;
mod drop;
mod gimbal;
mod looks;
mod map_looks;
mod run_pictures;
