//! The blocks inside a block: its instances, and the nets that connect them.

use hpu_signal::Signal;

use super::{AnyBlock, ROUNDING};

/// One port of an instance, and the net of the wiring that it is connected to.
pub struct Connection {
    /// Port of the instance.
    pub port: Signal,
    /// Index of the net in [`Wiring::nets`](crate::Wiring::nets).
    pub net: usize,
}

/// An instance inside a wiring, as in VHDL: `label : entity work.block`.
pub struct Instance {
    /// Instance label; the scope's name in a waveform.
    pub label: &'static str,
    /// The block with this instance's configuration, in its state after reset. Its name is that of the entity.
    pub model: Box<dyn AnyBlock>,
    /// The ports of the instance that nets are connected to, in order.
    pub connections: Vec<Connection>,
    /// The inputs of the instance that are tied to a constant instead.
    pub tied: Vec<(&'static str, i64)>,
    /// Its generics in VHDL, as expressions of the wiring's generics. They are stated where the wiring's VHDL is
    /// generated; where that is written by hand, the list is empty.
    pub generics: Vec<(&'static str, &'static str)>,
}

impl Instance {
    /// States the generics. Each is the wiring's generic of the same name, except for those given here; `ROUNDING` is
    /// left at the block's default.
    #[must_use]
    pub(crate) fn mapped(mut self, others: &[(&'static str, &'static str)]) -> Self {
        let stated = self.model.generics().into_iter().filter(|(name, _)| *name != ROUNDING);
        self.generics = stated.map(|(name, _)| (name, renamed(name, others))).collect();
        self
    }
}

/// Returns what the list has for a name, or the name itself.
pub(crate) fn renamed<'a>(name: &'a str, others: &[(&'static str, &'static str)]) -> &'a str {
    others.iter().find(|(known, _)| *known == name).map_or(name, |(_, other)| *other)
}

/// The inside of a block that is made of other blocks and nothing else.
pub struct Parts {
    /// Its inputs, its outputs, then the nets inside.
    pub nets: Vec<Signal>,
    /// Its instances, connected to these nets, in the order of the VHDL.
    pub instances: Vec<Instance>,
}
