//! The shipped scenes.

use hpu_cosim::scene::shipped;
use serde_json::{Value, json};

use crate::request::Refusal;

/// Returns names and titles of the shipped scenes.
pub(crate) fn list() -> Result<Value, Refusal> {
    let mut all = Vec::new();
    for scene in shipped() {
        let parsed = scene.parse(&[])?;
        all.push(json!({ "name": scene.name, "about": parsed.about.trim() }));
    }
    Ok(json!({ "scenes": all }))
}
