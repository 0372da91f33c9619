//! The failure gallery: for every method a shipped scene in which it fails, with the mechanism's number held against
//! its closed form, and a rival that holds.

mod axis;
mod credit;
mod limits;
mod methods;
mod phantom;
mod sampling;
mod varying;
