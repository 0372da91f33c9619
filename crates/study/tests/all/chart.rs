//! Pictures: whole, deterministic, and telling what the run did.

use hpu_cosim::scene::{Scene, shipped};
use hpu_cosim::{Control, Driver, Rig, Session};
use hpu_study::chart::{Picture, Run, nets, run_pictures, side_by_side};

const COMMAND: &str = "hpu run wall --set 'wall.stiffness=\"2 N.m/rad\"' -o <here> & there";

fn parsed(name: &str) -> Scene {
    shipped().iter().find(|scene| scene.name == name).unwrap().parse(&[]).unwrap().axis().unwrap()
}

/// Runs scenes and hands the finished runs over.
fn with_runs<T>(names: &[&str], then: impl FnOnce(&[Run]) -> T) -> T {
    let scenes: Vec<Scene> = names.iter().map(|name| parsed(name)).collect();
    let sessions: Vec<Session> = scenes.iter().map(|scene| Session::new(scene).unwrap()).collect();
    let finished: Vec<_> = sessions
        .iter()
        .map(|session| {
            let mut trace = session.drawn_trace(nets(session.scene()));
            let summary = session.run(Driver::Events, &mut trace, &mut (), &Control::default());
            (session, trace, summary)
        })
        .collect();
    let runs: Vec<Run> = finished
        .iter()
        .map(|(session, trace, summary)| Run {
            scene: session.scene(),
            words: session.words(),
            trace,
            summary,
            command: COMMAND,
        })
        .collect();
    then(&runs)
}

fn pictures(name: &str) -> Vec<Picture> {
    with_runs(&[name], |runs| run_pictures(&runs[0]))
}

fn named<'a>(pictures: &'a [Picture], name: &str) -> &'a Picture {
    pictures.iter().find(|picture| picture.name == name).unwrap()
}

/// The texts of an SVG: what is written, its font size, its anchor, and the point it hangs on.
fn texts(svg: &str) -> Vec<(String, f64, String, f64, f64)> {
    svg.split("<text ")
        .skip(1)
        .map(|rest| {
            let attribute = |name: &str| rest.split_once(&format!("{name}=\"")).unwrap().1.split_once('"').unwrap().0;
            let number = |name: &str| attribute(name).parse::<f64>().unwrap();
            let text = rest.split_once('>').unwrap().1.split_once("</text>").unwrap().0.trim();
            (text.to_string(), number("font-size"), attribute("text-anchor").to_string(), number("x"), number(" y"))
        })
        .collect()
}

/// The smallest box that surely holds a text: its letters are at least a third of its size wide on average.
fn box_of(text: &(String, f64, String, f64, f64)) -> [f64; 4] {
    let (words, size, anchor, x, y) = text;
    let width = words.chars().count() as f64 * size / 3.0;
    let left = match anchor.as_str() {
        "start" => *x,
        "middle" => x - width / 2.0,
        _ => x - width,
    };
    [left, y - 0.35 * size, left + width, y + 0.35 * size]
}

#[test]
fn every_picture_of_every_scene_keeps_its_texts_on_the_page_and_apart() {
    for scene in shipped().iter().filter(|scene| !scene.name.starts_with("phantom")) {
        for picture in pictures(scene.name) {
            let texts = texts(&picture.svg);
            assert!(texts.len() > 20, "{} {}", scene.name, picture.name);
            for (index, text) in texts.iter().enumerate() {
                let [left, top, right, bottom] = box_of(text);
                assert!(left >= 0.0 && top >= 0.0 && right <= 2400.0 && bottom <= 1440.0, "{text:?}");
                for other in &texts[..index] {
                    let [l, t, r, b] = box_of(other);
                    assert!(
                        right < l || r < left || bottom < t || b < top,
                        "{} {}: {text:?} over {other:?}",
                        scene.name,
                        picture.name
                    );
                }
            }
        }
    }
}

#[test]
fn a_png_decodes_to_the_page_with_ink_on_it() {
    for picture in pictures("hybrid-wall") {
        let mut reader = png::Decoder::new(std::io::Cursor::new(&picture.png)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut rgb).unwrap();
        assert_eq!((frame.width, frame.height), (2400, 1440));
        let inked = rgb.chunks(3).filter(|pixel| *pixel != [255; 3]).count();
        assert!((10_000..2_000_000).contains(&inked), "{}: {inked}", picture.name);
    }
}

#[test]
fn a_picture_says_scene_verdict_and_the_command_that_made_it() {
    for (scene, position, bits) in [
        ("hybrid-wall", "hybrid-wall: settled", "hybrid-wall: no word overflows"),
        ("conventional-wall-1khz", "conventional-wall-1khz: limit cycle", "conventional-wall-1khz: overflow of spring"),
        ("wrap-product", "wrap-product: settled", "wrap-product: overflow of spring"),
    ] {
        let pictures = pictures(scene);
        assert_eq!(pictures.iter().map(|p| p.name).collect::<Vec<_>>(), ["position", "torque", "bits"]);
        for (name, title) in [("position", position), ("torque", position), ("bits", bits)] {
            let svg = &named(&pictures, name).svg;
            assert!(texts(svg)[0].0.starts_with(title), "{:?}", texts(svg)[0]);
            // In SVG, what the shell takes for itself is written as XML wants it.
            assert!(svg.contains("-o &lt;here&gt; &amp; there"), "{scene} {name}");
        }
    }
}

#[test]
fn red_is_where_bits_were_lost_and_nowhere_else() {
    let red = |scene: &str| named(&pictures(scene), "bits").svg.contains("#D62828");
    assert!(red("wrap-product") && red("wrap-saturated"));
    assert!(!red("hybrid-wall") && !red("free-motion"));
}

#[test]
fn a_recording_has_no_motion_to_show_but_its_bits() {
    let pictures = pictures("replay-capture");
    assert_eq!(pictures.iter().map(|picture| picture.name).collect::<Vec<_>>(), ["bits"]);
}

#[test]
fn an_interrupted_run_is_drawn_as_far_as_it_went() {
    let scene = parsed("hybrid-wall");
    let session = Session::new(&scene).unwrap();
    let mut trace = session.drawn_trace(nets(session.scene()));
    let control = Control::default();
    control.stop.store(true, std::sync::atomic::Ordering::Relaxed);
    let summary = session.run(Driver::Events, &mut trace, &mut (), &control);
    assert!(!summary.complete);
    let run = Run { scene: &scene, words: session.words(), trace: &trace, summary: &summary, command: COMMAND };
    let pictures = run_pictures(&run);
    assert_eq!(pictures.iter().map(|picture| picture.name).collect::<Vec<_>>(), ["bits"]);
    assert!(texts(&pictures[0].svg)[0].0.starts_with("hybrid-wall: no word overflows"));
}

#[test]
fn the_same_runs_make_the_same_pictures() {
    assert_eq!(pictures("free-motion"), pictures("free-motion"));
    let beside =
        || with_runs(&["wrap-product", "wrap-saturated"], |runs| side_by_side("Wrap or saturate", runs, COMMAND));
    let picture = beside();
    assert_eq!(picture, beside());
    for said in ["product drops its upper bits", "product saturates", "wrap-product and wrap-saturated"] {
        assert!(texts(&picture.svg).iter().any(|text| text.0.contains(said)), "{said}");
    }
}
