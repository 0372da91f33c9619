//! Names that stay.

use std::collections::BTreeSet;
use std::sync::Mutex;

/// Returns a name with static lifetime: signals and pins are named for the length of the program, and a design has a
/// handful of them.
pub fn kept(name: &str) -> &'static str {
    static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut names = NAMES.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let name: &'static str = name.to_string().leak();
    names.insert(name);
    name
}
