//! The shipped scenes.

use hpu_cosim::scene::keys::{FOC, FOLLOWS, PADDLE};
use hpu_cosim::scene::{Shipped, shipped};
use serde_json::{Value, json};

use crate::request::Refusal;

/// Returns names and titles of the shipped scenes. A page, which has to be loaded, leaves out the loops that follow a
/// target and plants as transfer functions, and so the scenes that have one.
pub(crate) fn list() -> Result<Value, Refusal> {
    let mut all = Vec::new();
    let kinds = || FOLLOWS.into_iter().chain([PADDLE, FOC, "transfer"]);
    let follows = |scene: &&Shipped| kinds().any(|kind| scene.text.contains(&format!("kind = \"{kind}\"")));
    for scene in shipped().iter().filter(|scene| !follows(scene)) {
        let parsed = scene.parse(&[])?;
        all.push(json!({ "name": scene.name, "about": parsed.about.trim() }));
    }
    Ok(json!({ "scenes": all }))
}
