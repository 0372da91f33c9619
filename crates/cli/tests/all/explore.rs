//! `hpu explore`: the page begins with a scene and overrides; a missing page has a remedy. The page itself is tested in
//! a browser (`testbench/browser`).

use std::fs;

use serde_json::{Value, json};

use crate::common::{assert_refused, code, run, scratch, stderr, text};

const PAGE: &str = "<p>page</p><script type=\"application/json\" id=\"start\">{}</script><p>end</p>";

/// Writes the page of a scene, and returns what it begins with.
fn written(name: &str, args: &[&str]) -> Value {
    let dir = scratch(name);
    let (page, out) = (dir.join("page.html"), dir.join("out.html"));
    fs::write(&page, PAGE).expect("a page");
    let made = run(&[&["explore", "--page", text(&page), "-o", text(&out)], args].concat());
    assert_eq!((code(&made), stderr(&made)), (0, String::new()));
    let out = fs::read_to_string(out).expect("a page");
    let start = out.strip_prefix("<p>page</p><script type=\"application/json\" id=\"start\">").expect("the page");
    let start = start.strip_suffix("</script><p>end</p>").expect("the page");
    assert!(!start.contains('<'), "{start}");
    serde_json::from_str(start).expect("JSON")
}

#[test]
fn a_shipped_scene_goes_by_its_name() {
    let start = written("explore-shipped", &["friction-wall", "--set", "wall.damping=0"]);
    assert_eq!(start, json!({ "scene": "friction-wall", "set": { "wall.damping": "0" } }));
    assert_eq!(written("explore-none", &[]), json!({ "set": {} }));
}

#[test]
fn a_scene_of_ones_own_goes_with_its_text_and_its_data() {
    let dir = scratch("explore-own");
    let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testbench/scenes");
    let scene = fs::read_to_string(format!("{scenes}/replay-motion.toml")).expect("a scene");
    let data = fs::read_to_string(format!("{scenes}/replay-motion.csv")).expect("data");
    let scene = format!("# </script>\n{scene}");
    fs::write(dir.join("own.toml"), &scene).expect("a scene");
    fs::write(dir.join("replay-motion.csv"), &data).expect("data");
    let own = dir.join("own.toml");
    let start = written("explore-own-page", &[text(&own)]);
    let files = json!({ "replay-motion.csv": data });
    assert_eq!(start, json!({ "scene": { "name": text(&own), "text": scene, "files": files }, "set": {} }));
}

#[test]
fn bad_input_is_refused_with_a_remedy() {
    let dir = scratch("explore-refused");
    let (page, out) = (dir.join("page.html"), dir.join("out.html"));
    fs::write(&page, "<p>another page</p>").expect("a page");
    let refused = run(&["explore", "--page", text(&page), "-o", text(&out)]);
    assert_refused(&refused, 4, &["page.html", "no page of testbench/explorer.sh"]);
    let refused = run(&["explore", "--page", text(&dir.join("none.html")), "-o", text(&out)]);
    assert_refused(&refused, 4, &["none.html"]);
    let refused = run(&["explore", "hybrid-wall", "--set", "wall.stiffness=-1", "-o", text(&out)]);
    assert_refused(&refused, 4, &["--set wall.stiffness", "must not be negative"]);
    let refused = run(&["explore", "no-such-scene", "-o", text(&out)]);
    assert_refused(&refused, 4, &["no scene `no-such-scene`"]);
    assert!(!out.exists());
}
