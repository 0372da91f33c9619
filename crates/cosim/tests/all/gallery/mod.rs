//! The failure gallery: for every method a shipped scene in which it fails. The number that measures the mechanism is
//! compared with its closed form, and a rival method holds.

mod axis;
mod credit;
mod limits;
mod methods;
mod phantom;
mod sampling;
mod varying;
