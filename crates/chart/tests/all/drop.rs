//! Pictures of drop tests are complete and deterministic, and they show what the trial did.

use std::sync::atomic::Ordering;

use hpu_chart::{DROP_NETS, Picture, drop_pictures};
use hpu_cosim::scene::{PhantomScene, shipped};
use hpu_cosim::{Control, Driver, PhantomSimulation, Simulation, Summary, Trace, Verdict, Wired};

use crate::looks::{assert_readable, attribute, elements, number, points, rgb, texts};

const COMMAND: &str = "hpu run drop --set 'room.stiffness=\"2 kN/m\"' -o <here> & there";

fn parsed(name: &str, overrides: &[(&str, &str)]) -> PhantomScene {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}")).phantom().unwrap()
}

fn ran(scene: &PhantomScene, control: &Control) -> (Trace, Summary) {
    let simulation = PhantomSimulation::new(scene).unwrap();
    let mut trace = simulation.trace(&DROP_NETS);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), control);
    (trace, summary)
}

fn pictures(scene: &PhantomScene) -> (Vec<Picture>, Summary) {
    let (trace, summary) = ran(scene, &Control::default());
    (drop_pictures(&PhantomSimulation::new(scene).unwrap(), &trace, &summary, COMMAND), summary)
}

/// Trials of each outcome, at a slow clock.
fn passive() -> PhantomScene {
    parsed("phantom-drop", &[("run.duration", "2 s")])
}

fn non_passive() -> PhantomScene {
    parsed("phantom-drop-rtos", &[("run.duration", "2 s"), ("drop.axis", "x")])
}

fn highly_unstable() -> PhantomScene {
    parsed(
        "phantom-drop-rtos",
        &[
            ("platform.kind", "RTOS-1"),
            ("model.delay", "4"),
            ("room.distance", "2 mm"),
            ("drop.axis", "z"),
            ("device.coulomb_force", "0"),
            ("room.stiffness", "40 kN/m"),
        ],
    )
}

#[test]
fn every_outcome_is_titled_and_its_texts_stand_apart() {
    for (scene, title) in [
        (passive(), "phantom-drop: passive, "),
        (non_passive(), "phantom-drop-rtos: non-passive, "),
        (highly_unstable(), "phantom-drop-rtos: highly unstable, aborted at "),
    ] {
        let (pictures, summary) = pictures(&scene);
        assert_eq!(pictures.iter().map(|picture| picture.name).collect::<Vec<_>>(), ["drop", "force"]);
        for picture in &pictures {
            let texts = texts(&picture.svg);
            assert!(texts[0].text.starts_with(title), "{} {:?}", texts[0].text, summary.verdict);
            // In SVG, characters that are special to the shell are escaped as XML requires.
            assert!(picture.svg.contains("-o &lt;here&gt; &amp; there"), "{title}");
            assert_readable(picture, title);
        }
    }
}

#[test]
fn a_title_tells_the_rms_or_the_time_of_the_verdict() {
    let said = |scene: &PhantomScene| {
        let (pictures, summary) = pictures(scene);
        (texts(&pictures[0].svg)[0].text.clone(), summary.verdict.unwrap())
    };
    let (title, Verdict::NonPassive { rms_m }) = said(&non_passive()) else { panic!("non-passive") };
    assert_eq!(title, format!("phantom-drop-rtos: non-passive, {:.1} \u{b5}m rms", rms_m * 1e6));
    let (title, Verdict::HighlyUnstable { at_s }) = said(&highly_unstable()) else { panic!("highly unstable") };
    assert_eq!(title, format!("phantom-drop-rtos: highly unstable, aborted at {at_s:.2} s"));
}

#[test]
fn conditions_name_platform_rate_axis_wall_and_trial() {
    for (scene, conditions) in [
        (passive(), "FPGA-400, sampled at 400 kHz; y axis, wall of 1000 N/m, trial 1"),
        (non_passive(), "RTOS-20, sampled at 20 kHz; x axis, wall of 10000 N/m, trial 1"),
        (highly_unstable(), "RTOS-1, sampled at 1 kHz; z axis, wall of 40000 N/m, trial 1"),
    ] {
        assert_eq!(texts(&pictures(&scene).0[0].svg)[1].text, conditions);
    }
}

#[test]
fn an_interrupted_trial_is_drawn_as_far_as_it_went() {
    for edges in ["4 ms", "100 ns"] {
        let scene = parsed("phantom-drop", &[("run.duration", edges)]);
        let (trace, mut summary) = ran(&scene, &Control::default());
        // The same as a run that was stopped there.
        (summary.complete, summary.verdict) = (false, None);
        let pictures = drop_pictures(&PhantomSimulation::new(&scene).unwrap(), &trace, &summary, COMMAND);
        assert_eq!(pictures.len(), 2);
        for picture in &pictures {
            assert_eq!(texts(&picture.svg)[0].text, "phantom-drop: interrupted");
            assert_readable(picture, edges);
        }
    }
}

#[test]
fn a_trial_stopped_before_its_first_row_has_nothing_to_show() {
    let scene = passive();
    let simulation = PhantomSimulation::new(&scene).unwrap();
    let control = Control::default();
    control.stop.store(true, Ordering::Relaxed);
    let mut trace = simulation.trace(&DROP_NETS);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &control);
    assert!(!summary.complete);
    let empty = simulation.trace(&DROP_NETS);
    assert!(drop_pictures(&simulation, &empty, &summary, COMMAND).is_empty());
}

#[test]
fn pictures_of_the_shipped_thrown_scenes_are_readable_and_show_nothing_twice() {
    for name in ["phantom-thrown", "phantom-thrown-shared", "phantom-thrown-rtos"] {
        for picture in pictures(&parsed(name, &[])).0 {
            assert_readable(&picture, name);
            // The run lasts 40 ms; the close-up does not begin where the whole run does.
            let starts = texts(&picture.svg).into_iter().filter(|text| text.text == "0.000");
            assert_eq!(starts.count(), 1, "{name} {}", picture.name);
        }
    }
}

#[test]
fn the_same_trial_makes_the_same_pictures_and_another_another() {
    let first = pictures(&passive()).0;
    assert!(first == pictures(&passive()).0);
    assert!(first != pictures(&parsed("phantom-drop", &[("run.duration", "2 s"), ("drop.trial", "2")])).0);
    for picture in first {
        let mut reader = png::Decoder::new(std::io::Cursor::new(&picture.png)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut rgb).unwrap();
        assert_eq!((frame.width, frame.height), (2400, 1440));
        let inked = rgb.chunks(3).filter(|pixel| *pixel != [255; 3]).count();
        assert!((10_000..2_500_000).contains(&inked), "{}: {inked}", picture.name);
    }
}

#[test]
fn the_commanded_torque_stands_beside_the_motors_and_agrees_with_it_at_rest() {
    // On a host the trace has only the commands.
    for scene in [passive(), non_passive()] {
        let pictures = pictures(&scene).0;
        let lines = |name: &str| {
            let key =
                pictures[1].keys.iter().find(|key| key.name.starts_with(name)).unwrap_or_else(|| panic!("{name}"));
            let own = elements(&pictures[1].svg)
                .filter(|(mark, of)| *mark == "polyline" && attribute(of, "stroke").map(rgb) == Some(key.color));
            // The lines of the keys are 5 wide.
            let curves = own.filter(|(_, of)| number(of, "stroke-width") != 5.0);
            curves.map(|(_, of)| points(of)).collect::<Vec<_>>()
        };
        let (asked, came) = (lines("commanded"), lines("of the motor"));
        assert_eq!((asked.len(), came.len()), (2, 2), "one in each panel");
        // Without a lag of the amplifier, the motor at rest gives the torque that its DAC asks for.
        let at_rest = asked.iter().zip(&came).filter(|_| scene.name == "phantom-drop");
        for (asked, came) in at_rest {
            assert!((asked[asked.len() - 1].1 - came[came.len() - 1].1).abs() <= 2.0, "{}", scene.name);
            let highest = |line: &[(f64, f64)]| line.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
            assert!((highest(asked) - highest(came)).abs() <= 2.0, "{}", scene.name);
        }
    }
}
