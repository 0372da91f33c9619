//! The shipped scenes.

use hpu_cosim::scene::keys::FOLLOWS;
use hpu_cosim::scene::{Experiment, Shipped, shipped};
use serde_json::{Value, json};

use crate::request::Refusal;

/// Returns names and titles of the shipped scenes. A page, which has to be loaded, leaves out the loop that follows a
/// target, and so the scenes that have one.
pub(crate) fn list() -> Result<Value, Refusal> {
    let mut all = Vec::new();
    let follows = |scene: &&Shipped| FOLLOWS.iter().any(|kind| scene.text.contains(&format!("kind = \"{kind}\"")));
    for scene in shipped().iter().filter(|scene| !follows(scene)) {
        let parsed = scene.parse(&[])?;
        // A page has not the loop of the paddle.
        if let Experiment::Paddle(_) = parsed {
            continue;
        }
        all.push(json!({ "name": scene.name, "about": parsed.about.trim() }));
    }
    Ok(json!({ "scenes": all }))
}
