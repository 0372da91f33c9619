//! The library of parts: motors, encoders, amplifiers and bridges whose data are public.

use std::sync::OnceLock;

use toml_edit::{DocumentMut, Item, TableLike};

use crate::schema::parameter::Origin;

/// A part of the library. Its file is `testbench/parts/KINDs/NAME.toml`: what it is, the source of its figures and
/// their date, what the source does not give, and under `[data]` the figures, by the keys that they stand for.
pub struct NamedPart {
    /// `motor`, `encoder`, `amplifier` or `bridge`.
    pub kind: &'static str,
    /// Its name in scenes.
    pub name: &'static str,
    text: &'static str,
    read: OnceLock<DocumentMut>,
}

impl PartialEq for NamedPart {
    fn eq(&self, other: &Self) -> bool {
        (self.kind, self.name) == (other.kind, other.name)
    }
}

macro_rules! parts {
    ($kind:literal: $($name:literal),* $(,)?) => {
        [$(NamedPart {
            kind: $kind,
            name: $name,
            text: const { hpu_assets::text(concat!("testbench/parts/", $kind, "s/", $name, ".toml")) },
            read: OnceLock::new(),
        }),*]
    };
}

pub(crate) static MOTORS: [NamedPart; 13] = parts!["motor":
    "vasudevan_2007",
    "faulhaber-2342-024cr",
    "faulhaber-2342-036cr",
    "faulhaber-2342-048cr",
    "faulhaber-2642-048cr",
    "maxon-amax19-249996",
    "maxon-amax26-110953",
    "maxon-re25-118743",
    "maxon-re25-118752",
    "maxon-re35-30v",
    "maxon-re40-24v",
    "maxon-re40-48v",
    "quanser-qube-servo-2",
];
pub(crate) static ENCODERS: [NamedPart; 2] = parts!["encoder": "avago-hedm-5500-1024", "faulhaber-hedl-5540"];
pub(crate) static AMPLIFIERS: [NamedPart; 1] = parts!["amplifier": "maxon-escon-module-50-5"];
pub(crate) static BRIDGES: [NamedPart; 2] = parts!["bridge": "ti-drv8871", "ti-drv8874"];

/// Returns every part, those of a kind together.
pub fn parts() -> impl Iterator<Item = &'static NamedPart> {
    MOTORS.iter().chain(&ENCODERS).chain(&AMPLIFIERS).chain(&BRIDGES)
}

/// Returns parts with their names, as a choice of a key takes them.
pub(crate) fn by_name(parts: &'static [NamedPart]) -> Vec<(&'static str, &'static NamedPart)> {
    parts.iter().map(|part| (part.name, part)).collect()
}

impl NamedPart {
    fn document(&self) -> &DocumentMut {
        self.read.get_or_init(|| {
            let mut document: DocumentMut = self.text.parse().unwrap_or_default();
            // A rotor is a body of a network too.
            if let Some(inertia) = document.get("data").and_then(|data| data.get("rotor_inertia")).cloned() {
                document["data"]["inertia"] = inertia;
            }
            document
        })
    }

    fn data(&self) -> &dyn TableLike {
        let data = self.document().get("data").and_then(Item::as_table_like);
        data.unwrap_or(self.document().as_table())
    }

    /// Returns the origin of the values that it gives, and the values by their keys.
    pub(crate) fn gives(&'static self) -> (Origin, &'static dyn TableLike) {
        (Origin::Part { kind: self.kind, name: self.name }, self.data())
    }

    /// Returns what it is.
    pub fn about(&self) -> &str {
        self.said("about")
    }

    /// Returns the source of its figures.
    pub fn source(&self) -> &str {
        self.said("source")
    }

    /// Returns when the source was published or read.
    pub fn date(&self) -> &str {
        self.said("date")
    }

    fn said(&self, key: &str) -> &str {
        self.document().get(key).and_then(Item::as_str).unwrap_or_default()
    }

    /// Returns its figures, each as a scene would write it.
    pub fn figures(&self) -> Vec<String> {
        let all = self.data().iter().filter(|(key, _)| *key != "inertia");
        all.map(|(key, value)| format!("{key} = {}", value.to_string().trim())).collect()
    }

    /// Returns the keys that its source does not give.
    pub fn not_given(&self) -> Vec<&str> {
        let keys = self.document().get("not_given").and_then(Item::as_array).into_iter().flatten();
        keys.filter_map(|key| key.as_str()).collect()
    }
}
