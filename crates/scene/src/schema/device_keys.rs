//! The keys of a device beside an axis.

use crate::schema::Group;

/// The groups of a device's keys, by their places in the documentation.
pub(crate) struct DeviceKeys {
    /// Sections of the scene that stand before the clock.
    pub first: &'static [&'static Group],
    /// The other sections of the scene.
    pub top: &'static [&'static Group],
    /// The device and its parts.
    pub device: &'static [&'static Group],
    /// The parts that stand after those of an axis.
    pub parts: &'static [&'static Group],
    /// The design of the datapath.
    pub method: &'static [&'static Group],
    /// The keys of its motion or its touch.
    pub motion: &'static [&'static Group],
    /// The walls around the device.
    pub walls: &'static [&'static Group],
    /// The model.
    pub model: &'static [&'static Group],
    /// The recording.
    pub record: &'static [&'static Group],
    /// The expected results.
    pub expect: &'static [&'static Group],
    /// The outputs by which models are compared.
    pub accuracy: &'static [&'static Group],
    /// The sections whose `kind` decides which keys they take.
    pub own_kinds: &'static [&'static str],
}
