//! Pictures are complete and deterministic, and they show what the run did.

use hpu_chart::{Picture, Run, nets, run_pictures, side_by_side};
use hpu_cosim::scene::{Scene, shipped};
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Wired};

use crate::looks::{assert_readable, attribute, elements, number, points, rgb, texts};

const COMMAND: &str = "hpu run wall --set 'wall.stiffness=\"2 N.m/rad\"' -o <here> & there";

fn parsed(name: &str) -> Scene {
    shipped().iter().find(|scene| scene.name == name).unwrap().parse(&[]).unwrap().axis().unwrap()
}

/// Runs scenes and passes the finished runs on.
fn with_runs<T>(names: &[&str], then: impl FnOnce(&[Run]) -> T) -> T {
    let scenes: Vec<Scene> = names.iter().map(|name| parsed(name)).collect();
    let simulations: Vec<AxisSimulation> = scenes.iter().map(|scene| AxisSimulation::new(scene).unwrap()).collect();
    let finished: Vec<_> = simulations
        .iter()
        .map(|simulation| {
            let mut trace = simulation.drawn_trace(nets(simulation.scene()));
            let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
            (simulation, trace, summary)
        })
        .collect();
    let runs: Vec<Run> = finished
        .iter()
        .map(|(simulation, trace, summary)| Run {
            scene: simulation.scene(),
            words: simulation.words(),
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

/// Asserts that the pictures of every `nth` scene are readable.
fn are_readable(nth: usize) {
    // Devices that are no axis have pictures, and tests of them, of their own.
    for scene in shipped().iter().filter(|scene| scene.parse(&[]).unwrap().axis().is_some()).step_by(nth) {
        for picture in pictures(scene.name) {
            assert_readable(&picture, scene.name);
        }
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_picture_of_every_scene_is_readable_by_all() {
    are_readable(1);
}

#[test]
fn pictures_of_scenes_are_readable_by_all() {
    are_readable(3);
    with_runs(&["wrap-product", "wrap-saturated"], |runs| {
        assert_readable(&side_by_side("Wrap or saturate", runs, COMMAND), "two");
    });
}

#[test]
fn the_name_of_the_end_is_not_crossed_by_a_curve() {
    for names in [["wrap-product", "wrap-saturated"], ["thrown-hybrid", "thrown-conventional"]] {
        let picture = with_runs(&names, |runs| side_by_side("Two", runs, COMMAND));
        let push = picture.keys.iter().find(|key| key.name == "spring").expect("a key").color;
        let lines = elements(&picture.svg)
            .filter(|(mark, of)| *mark == "polyline" && attribute(of, "stroke").map(rgb) == Some(push));
        let lines: Vec<Vec<(f64, f64)>> = lines.map(|(_, of)| points(of)).collect();
        let ends: Vec<_> = texts(&picture.svg).into_iter().filter(|text| text.text == "ends here").collect();
        assert_eq!(ends.len(), 2, "{names:?}");
        for end in ends {
            let [left, top, right, bottom] = end.area;
            let holds = |x: f64, y: f64| (left..right).contains(&x) && (top..bottom).contains(&y);
            let crosses = |pair: &[(f64, f64)]| {
                let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
                let steps = (x2 - x1).abs().max((y2 - y1).abs()).max(1.0) as u32;
                (0..=steps)
                    .map(|step| f64::from(step) / f64::from(steps))
                    .any(|share| holds(x1 + share * (x2 - x1), y1 + share * (y2 - y1)))
            };
            assert!(!lines.iter().any(|line| line.windows(2).any(crosses)), "{names:?}: {end:?}");
        }
    }
}

#[test]
fn the_foot_has_no_folder_of_an_absolute_path() {
    let command =
        "hpu run /home/me/walls/soft.toml --set 'hand.file=/srv/a b/hand.csv' --set a=1/2 -o '/tmp/my dir/out'";
    let said = "$ hpu run soft.toml --set 'hand.file=hand.csv' --set a=1/2 -o 'out'";
    let scene = parsed("free-motion");
    let simulation = AxisSimulation::new(&scene).unwrap();
    let mut trace = simulation.drawn_trace(nets(simulation.scene()));
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    for picture in
        run_pictures(&Run { scene: &scene, words: simulation.words(), trace: &trace, summary: &summary, command })
    {
        assert!(
            texts(&picture.svg).iter().any(|text| text.text.replace("&apos;", "'") == said),
            "{:?}",
            texts(&picture.svg).last()
        );
    }
}

#[test]
fn two_panels_of_a_short_run_do_not_show_the_same() {
    let scene = shipped().iter().find(|scene| scene.name == "hybrid-wall").unwrap();
    let scene = scene.parse(&[("run.duration".into(), "40 ms".into())]).unwrap().axis().unwrap();
    let simulation = AxisSimulation::new(&scene).unwrap();
    let mut trace = simulation.drawn_trace(nets(simulation.scene()));
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    let run = Run { scene: &scene, words: simulation.words(), trace: &trace, summary: &summary, command: COMMAND };
    for picture in run_pictures(&run).iter().filter(|picture| picture.name != "bits") {
        // The last time of the close-up, in ms, is a quarter of the whole run.
        let times: Vec<f64> = texts(&picture.svg).iter().filter_map(|text| text.text.parse().ok()).collect();
        assert!(times.contains(&0.04) && !times.contains(&20.0), "{}: {times:?}", picture.name);
    }
}

#[test]
fn the_command_is_drawn_upon_the_motors_torque_and_is_narrower() {
    let pictures = pictures("hybrid-wall");
    let picture = named(&pictures, "torque");
    let color = |name: &str| {
        let key = picture.keys.iter().find(|key| key.name.starts_with(name)).unwrap_or_else(|| panic!("{name}"));
        key.color
    };
    let (asked, came) = (color("commanded"), color("the motor's"));
    // The lines of the panels, not those of the keys, which have few points.
    let lines = |of| {
        let all = elements(&picture.svg).filter(|(name, _)| *name == "polyline").enumerate();
        let own = all.filter(move |(_, (_, mark))| attribute(mark, "stroke").map(rgb) == Some(of));
        own.filter(|(_, (_, mark))| attribute(mark, "points").unwrap().split(' ').count() > 20)
            .map(|(place, (_, mark))| (place, number(mark, "stroke-width")))
            .collect::<Vec<_>>()
    };
    let (asked, came) = (lines(asked), lines(came));
    assert_eq!((asked.len(), came.len()), (2, 2), "one in each panel");
    for (asked, came) in asked.iter().zip(&came) {
        assert!(asked.0 > came.0, "the command is painted after the torque");
        assert!(2.0 * asked.1 <= came.1, "and leaves its borders to be seen");
    }
}

/// Returns the lines of a colour that have many points, in order of painting.
fn curves(picture: &Picture, name: &str) -> Vec<Vec<(f64, f64)>> {
    let key = picture.keys.iter().find(|key| key.name.starts_with(name)).unwrap_or_else(|| panic!("{name}"));
    let own = elements(&picture.svg)
        .filter(|(mark, of)| *mark == "polyline" && attribute(of, "stroke").map(rgb) == Some(key.color));
    own.map(|(_, of)| points(of)).filter(|points| points.len() > 20).collect()
}

#[test]
fn a_word_that_changed_between_two_rows_is_drawn_as_changing_between_them() {
    // Rows are 0.1 ms apart, which is 8 pixels of a close-up of 25 ms: no column of pixels has two rows.
    with_runs(&["leak-bounce"], |runs| {
        let pictures = run_pictures(&runs[0]);
        for (picture, name) in [("torque", "commanded"), ("position", "as counted")] {
            let curves = curves(named(&pictures, picture), name);
            let close_up = curves.last().expect("a curve");
            assert!(close_up.windows(2).all(|pair| pair[0].0 < pair[1].0), "{picture}: {close_up:?}");
        }
    });
}

#[test]
fn contact_is_shaded_from_the_row_before_the_first_that_sees_it() {
    with_runs(&["leak-bounce"], |runs| {
        let run = &runs[0];
        let depth = nets(run.scene).iter().position(|net| *net == "penetration").expect("a net");
        let touch = run.trace.words(depth).iter().position(|word| *word != 0).expect("a contact");
        let times: Vec<f64> = run.trace.times_s().collect();
        for picture in run_pictures(run).iter().filter(|picture| ["position", "torque"].contains(&picture.name)) {
            // The close-up is the first quarter of the run, 2030 pixels wide.
            let pixel = |time_s: f64| 170.0 + 2030.0 * time_s / (0.25 * run.summary.motion_s);
            let shades = elements(&picture.svg).filter(|(mark, of)| {
                *mark == "rect" && attribute(of, "fill") == Some("#E9E4DC") && number(of, "height") > 200.0
            });
            let lefts: Vec<f64> = shades.map(|(_, of)| number(of, "x")).collect();
            let wanted = pixel(times[touch - 1]).round();
            assert!(lefts.contains(&wanted) && !lefts.contains(&pixel(times[touch]).round()), "{wanted}: {lefts:?}");
        }
    });
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
            assert!(texts(svg)[0].text.starts_with(title), "{:?}", texts(svg)[0]);
            // In SVG, characters that are special to the shell are escaped as XML requires.
            assert!(svg.contains("-o &lt;here&gt; &amp; there"), "{scene} {name}");
        }
    }
}

#[test]
fn a_loss_of_bits_is_shaded_where_it_was_and_nowhere_else() {
    let is_shaded = |scene: &str| {
        let pictures = pictures(scene);
        named(&pictures, "bits").keys.iter().any(|key| key.name == "overflowed")
    };
    assert!(is_shaded("wrap-product") && is_shaded("wrap-saturated"));
    assert!(!is_shaded("hybrid-wall") && !is_shaded("free-motion"));
}

#[test]
fn a_recording_has_no_motion_to_show_but_its_bits() {
    let pictures = pictures("replay-capture");
    assert_eq!(pictures.iter().map(|picture| picture.name).collect::<Vec<_>>(), ["bits"]);
}

#[test]
fn an_interrupted_run_is_drawn_as_far_as_it_went() {
    let scene = parsed("hybrid-wall");
    let simulation = AxisSimulation::new(&scene).unwrap();
    let mut trace = simulation.drawn_trace(nets(simulation.scene()));
    let control = Control::default();
    control.stop.store(true, std::sync::atomic::Ordering::Relaxed);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &control);
    assert!(!summary.complete);
    let run = Run { scene: &scene, words: simulation.words(), trace: &trace, summary: &summary, command: COMMAND };
    let pictures = run_pictures(&run);
    assert_eq!(pictures.iter().map(|picture| picture.name).collect::<Vec<_>>(), ["bits"]);
    assert!(texts(&pictures[0].svg)[0].text.starts_with("hybrid-wall: no word overflows"));
}

#[test]
fn the_same_runs_make_the_same_pictures() {
    assert_eq!(pictures("free-motion"), pictures("free-motion"));
    let beside =
        || with_runs(&["wrap-product", "wrap-saturated"], |runs| side_by_side("Wrap or saturate", runs, COMMAND));
    let picture = beside();
    assert_eq!(picture, beside());
    for said in ["product drops its upper bits", "product saturates", "wrap-product and wrap-saturated"] {
        assert!(texts(&picture.svg).iter().any(|text| text.text.contains(said)), "{said}");
    }
}

#[test]
fn titles_say_where_a_verdict_says_nothing_of_the_wall() {
    for (scene, wanted) in [
        ("thrown-hybrid", Some("; wall not reached")),
        ("free-motion", Some("; wall not reached")),
        // The summary of this scene counts two wraps.
        ("wrap-product", Some("; through the wall, product wrapped 2 times")),
        ("wrap-saturated", None),
        ("hybrid-wall", None),
    ] {
        for picture in pictures(scene).iter().filter(|picture| ["position", "torque"].contains(&picture.name)) {
            let title = &texts(&picture.svg)[0];
            match wanted {
                Some(wanted) => assert!(title.text.ends_with(wanted), "{scene}: {}", title.text),
                None => assert!(!title.text.contains("wall not") && !title.text.contains("wrapped"), "{}", title.text),
            }
        }
    }
}

#[test]
fn the_range_of_a_counter_says_that_it_is_of_the_unsigned_word() {
    let pictures = pictures("hybrid-wall");
    let texts = texts(&named(&pictures, "bits").svg);
    assert_eq!(texts.iter().filter(|text| text.text == "position (0,12,0), unsigned").count(), 1);
}

#[test]
fn a_full_scale_that_no_run_comes_near_is_not_drawn() {
    // The springs of the first two scenes reach some 700 of 4095 PWM counts; those of the other two are cut off at full
    // scale.
    for (names, drawn) in [(["thrown-hybrid", "thrown-conventional"], 0), (["wrap-product", "wrap-saturated"], 2)] {
        let svg = with_runs(&names, |runs| side_by_side("Two", runs, COMMAND).svg);
        let said = texts(&svg).iter().filter(|text| text.text == "black line: full scale").count();
        assert_eq!(said, drawn, "{names:?}");
    }
}
