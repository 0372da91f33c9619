//! Certificates of runs, checked: the scene is run again.

use std::path::PathBuf;
use std::time::Duration;

use hpu_cosim::SceneFile;
use hpu_cosim::scene::Experiment;
use hpu_page::Page;
use hpu_prove::certify::growth::grows;
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
    let apart = if is_so { apart(&source, &set, &claimed) } else { None };
    page.data("claimed", claimed.clone()).data("found", found.clone());
    if is_so {
        let kind = claimed["kind"].as_str().unwrap_or_default().to_string();
        page.line("accepted", format!("{kind}, for ever: the run was run again and says the same"));
        if let Some(apart) = &apart {
            page.data("apart", apart.as_ref().err().map_or("accepted", |_| "not checked"));
            page.line(
                "",
                match apart {
                    Ok(()) => "a checker of its own, in numbers without rounding, says so too".to_string(),
                    Err(why) => format!("the checker of its own does not tell: {why}"),
                },
            );
        }
    } else {
        page.line("rejected", format!("{claimed} is claimed; run again, it is {found}"));
    }
    Ok(Some(is_so))
}

/// Checks growth apart, by code that the proof does not share; `None` of what has no such checker.
fn apart(source: &SceneFile, set: &[(String, String)], claimed: &Value) -> Option<Result<(), String>> {
    let (from_s, growth) = (claimed["from_s"].as_f64()?, claimed["growth"].as_f64()?);
    let none = &mut |_: &str| Err(std::io::Error::other("a certificate carries no file"));
    let Ok(Experiment::Transfer(scene)) = Experiment::parse(&source.name, &source.text, set, none) else { return None };
    let edge = (from_s * scene.clock.frequency_hz() as f64).round() as u64;
    Some(grows(&scene, edge, growth).map_err(|why| why.to_string()))
}
