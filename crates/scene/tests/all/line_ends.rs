//! Line ends of Windows: a scene and its data files read the same, and errors stand at the same places.

use std::io;

use hpu_scene::{Experiment, shipped, shipped_file};

/// Returns a text with the line ends of Windows.
fn returned(text: &str) -> String {
    text.replace('\n', "\r\n")
}

/// Reads a scene's shipped data file; if it is text, with the line ends of Windows.
fn load(file: &str) -> io::Result<Vec<u8>> {
    shipped_file(file)
        .map(|bytes| String::from_utf8(bytes).map_or_else(|error| error.into_bytes(), |text| returned(&text).into()))
}

#[test]
fn every_shipped_scene_reads_the_same_with_the_line_ends_of_windows() {
    let mut scenes = 0;
    for scene in shipped() {
        let read = Experiment::parse(scene.name, &returned(scene.text), &[], &mut load).expect("a shipped scene");
        let plain = Experiment::parse(scene.name, scene.text, &[], &mut shipped_file).expect("a shipped scene");
        assert_eq!(format!("{read:?}"), format!("{plain:?}"), "{}", scene.name);
        scenes += 1;
    }
    assert!(scenes > 75, "{scenes}");
}

#[test]
fn an_error_stands_at_the_same_line_and_column_with_the_line_ends_of_windows() {
    let scene = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("a shipped scene");
    // A value that is no quantity, a key that is not there, and text that is no TOML.
    for (from, to) in
        [("kind = \"motor\"", "kind = \"moto\""), ("stiffness = ", "stifness = "), ("[device]", "[device")]
    {
        let text = scene.text.replace(from, to);
        assert_ne!(text, scene.text);
        let said =
            |text: &str| Experiment::parse("s.toml", text, &[], &mut shipped_file).expect_err("refused").to_string();
        let (plain, read) = (said(&text), said(&returned(&text)));
        assert!(plain.starts_with("s.toml:"), "{plain}");
        assert_eq!(read.replace('\r', ""), plain);
    }
}
