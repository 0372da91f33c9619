//! The pictures of devices whose run has one or two.

#[cfg(not(target_family = "wasm"))]
pub(crate) mod foc;
#[cfg(not(target_family = "wasm"))]
pub(crate) mod paddle;
pub(crate) mod transfer;
