//! All tests of the crate in one binary, which is linked once and runs its tests on all cores.

mod files;
mod gtkw;
mod phantom_waves;
mod read_back;
mod readback;
mod run;
mod sucl;
