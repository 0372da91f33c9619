//! A scene made ready and run: wirings, engine, controllers.

pub(crate) mod axis_simulation;
pub(crate) mod closed;
pub(crate) mod controller;
pub(crate) mod direct;
pub(crate) mod engine;
pub(crate) mod law_loop;
pub(crate) mod log_beside;
pub(crate) mod look;
pub(crate) mod simulation;
pub(crate) mod simulation_error;
pub(crate) mod untyped;
