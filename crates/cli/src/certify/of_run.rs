//! Certificates of runs, checked: the scene is run again.

use std::path::PathBuf;
use std::time::Duration;

use hpu_cosim::SceneFile;
use hpu_page::Page;
use serde_json::Value;
use toml_edit::{DocumentMut, Item};

use crate::certificate::agree;
use crate::run::{finished, unseen};
use crate::shell::{Failure, interrupt};

/// Runs the scene of a certificate again, and says on a page whether it goes on as claimed; `None` when interrupted.
///
/// # Errors
///
/// Returns a failure of a bad file if the text is no such certificate, and that of the run if it fails.
pub fn check(file: &str, text: &str, page: &mut Page) -> Result<Option<bool>, Failure> {
    let bad = |why: String| Failure::file(format!("{file}: {why}"));
    let document: DocumentMut = text.parse().map_err(|error| bad(format!("no TOML: {error}")))?;
    let missing = |key: &str| bad(format!("`{key}` is missing, or of another kind"));
    let said = |key: &str| document.get(key).and_then(Item::as_str).ok_or_else(|| missing(key));
    let set = hpu_prove::certify::set(&document).ok_or_else(|| missing("set"))?;
    let looked_on = document.get("looked_on_s").and_then(Item::as_float).ok_or_else(|| missing("looked_on_s"))?;
    let longest = Duration::try_from_secs_f64(looked_on).map_err(|error| bad(format!("`looked_on_s`: {error}")))?;
    let claimed: Value = serde_json::from_str(said("found")?).map_err(|error| bad(format!("`found`: {error}")))?;
    let (name, text) = (said("name")?.to_string(), said("scene")?.to_string());
    let source = SceneFile { name, text, data: PathBuf::new(), is_shipped: false };
    agree(&source, &set).map_err(|error| bad(error.to_string()))?;
    let Some((ran, _)) = finished(&source, &set, Some(longest), interrupt::watch(), unseen)? else { return Ok(None) };
    let found = ran.page.json()["for_ever"].clone();
    let is_so = found == claimed && claimed["kind"] != "not_told";
    page.data("claimed", claimed.clone()).data("found", found.clone());
    if is_so {
        let kind = claimed["kind"].as_str().unwrap_or_default().to_string();
        page.line("accepted", format!("{kind}, for ever: the run was run again and says the same"));
    } else {
        page.line("rejected", format!("{claimed} is claimed; run again, it is {found}"));
    }
    Ok(Some(is_so))
}
