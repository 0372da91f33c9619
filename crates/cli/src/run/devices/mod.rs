//! Pages of the runs of devices whose loop is their own: one file a loop.

mod foc;
mod paddle;
mod transfer;
