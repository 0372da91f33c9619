//! Which part of a recording counts, and where it stands in the run.

use hpu_scene::replay::PinEdge;
use hpu_scene::{Hand, Scene};

const SCENE: &str = "about = 'A.'\nencoder = { lines = 64 }\nclock = { frequency = '50 MHz' }\n\
                     device = { kind = 'motor', motor = 'vasudevan_2007', wheel_ratio = 7 }\n\
                     method = { kind = 'conventional', sample_rate = '1 kHz' }\n\
                     wall = { position = '0.1 rad', stiffness = '1 N.m/rad' }\n";

/// Four counts, 1 ms apart; the first level is at 5 s.
const CAPTURE: &str = "$timescale 1 us $end\n$var wire 1 ! a $end\n$var wire 1 \" b $end\n$enddefinitions $end\n\
                       #5000000 0! 0\"\n#5001000 1\"\n#5002000 1!\n#5003000 0\"\n#5010000\n";

/// A motion of 1 rad/s from 2 s on, for 4 s.
const MOTION: &str = "time_s,angle_rad\n2,0\n3,1\n4,2\n6,4\n";

fn read(hand: &str, duration: &str, text: &str) -> Result<Hand, String> {
    let scene = format!("{SCENE}hand = {hand}\nrun = {{ duration = {duration} }}\n");
    let mut load = |_: &str| Ok(text.as_bytes().to_vec());
    Scene::parse("x.toml", &scene, &[], &mut load).map(|scene| scene.hand).map_err(|error| error.to_string())
}

fn capture(file: &str, duration: &str) -> Result<Vec<(i64, u8, u8)>, String> {
    let hand = format!("{{ kind = 'capture', channel_a = 'a', channel_b = 'b', file = {file} }}");
    let Hand::Capture { edges } = read(&hand, duration, CAPTURE)? else { panic!("a capture") };
    let levels = |edge: PinEdge| (edge.picoseconds, u8::from(edge.a), u8::from(edge.b));
    Ok(edges.into_iter().map(levels).collect())
}

fn motion(file: &str, duration: &str) -> Result<Vec<(f64, f64)>, String> {
    let hand = format!("{{ kind = 'prescribed', file = {file} }}");
    let Hand::Prescribed { path } = read(&hand, duration, MOTION)? else { panic!("a motion") };
    Ok(path.into_iter().map(|point| (point.time_s, point.angle_rad)).collect())
}

const MS: i64 = 1_000_000_000;

#[test]
fn a_recording_outside_of_the_run_or_of_its_judged_window_is_refused() {
    let late = capture("'x.vcd'", "'9 ms'").unwrap_err();
    let said = "x.toml:7:69: hand.file: the recording begins at 5 s, and the run ends at 0.009 s; write file = \
                { path = \"...\", offset = \"-5 s\" }";
    assert_eq!(late, said);
    let short = capture("{ path = 'x.vcd', offset = '-5 s' }", "1").unwrap_err();
    let said = "hand.file: the recording ends at 0.01 s, before the judged window, which begins at 0.7001 s; write a \
                shorter run.duration, or file = { path = \"...\", to = \"1 s\" } to keep what it ends with";
    assert!(short.ends_with(said), "{short}");
    assert!(motion("'x.csv'", "2").unwrap_err().contains("the recording begins at 2 s, and the run ends at 2 s"));
    assert!(motion("'x.csv'", "9").unwrap_err().contains("ends at 6 s, before the judged window"));
    let nothing = motion("{ path = 'x.csv', from = 7 }", "1").unwrap_err();
    assert!(nothing.contains("the recording lasts from 2 s to 6 s; write from and to within it"), "{nothing}");
    let order = motion("{ path = 'x.csv', from = 4, to = 3 }", "1").unwrap_err();
    assert!(order.ends_with("hand.file.to: 3 s; write a time after from, 4 s"), "{order}");
}

#[test]
fn a_capture_is_shifted_and_cut() {
    let whole = [(0, 0, 0), (MS, 0, 1), (2 * MS, 1, 1), (3 * MS, 1, 0)];
    assert_eq!(capture("{ path = 'x.vcd', offset = '-5 s' }", "'9 ms'"), Ok(whole.to_vec()));
    assert_eq!(capture("{ path = 'x.vcd', from = 5 }", "'9 ms'"), Ok(whole.to_vec()));
    // The level at the beginning of a part is the last one before it.
    let part = [(0, 0, 1), (MS / 2, 1, 1), (3 * MS / 2, 1, 0)];
    assert_eq!(capture("{ path = 'x.vcd', from = '5.0015 s' }", "'5 ms'"), Ok(part.to_vec()));
    assert_eq!(capture("{ path = 'x.vcd', offset = '-5.0015 s' }", "'5 ms'"), Ok(part.to_vec()));
    let until = [(0, 0, 0), (MS, 0, 1)];
    assert_eq!(capture("{ path = 'x.vcd', from = 5, to = '5.0015 s' }", "'1.6 ms'"), Ok(until.to_vec()));
    assert_eq!(capture("{ path = 'x.vcd', from = 5, to = 6 }", "1"), Ok(whole.to_vec()));
}

#[test]
fn a_motion_is_shifted_and_cut_between_its_points() {
    assert_eq!(motion("'x.csv'", "5"), Ok(vec![(2.0, 0.0), (3.0, 1.0), (4.0, 2.0), (6.0, 4.0)]));
    assert_eq!(
        motion("{ path = 'x.csv', offset = -2 }", "4"),
        Ok(vec![(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (4.0, 4.0)])
    );
    let part = vec![(0.0, 0.5), (0.5, 1.0), (1.5, 2.0), (2.5, 3.0)];
    assert_eq!(motion("{ path = 'x.csv', from = 2.5, to = 5 }", "2.5"), Ok(part.clone()));
    let shifted = motion("{ path = 'x.csv', offset = -2.5, to = 5 }", "2.5");
    assert_eq!(shifted, Ok(part));
    assert_eq!(motion("{ path = 'x.csv', from = 2, to = 9 }", "9").map(|path| path.len()), Ok(4));
}

/// A run names what it was given: a column that was taken by mistake shows there.
#[test]
fn a_scene_tells_what_it_read_of_its_recording() {
    let told = |hand: &str, duration: &str, text: &str| {
        let scene = format!("{SCENE}hand = {hand}\nrun = {{ duration = {duration} }}\n");
        let scene = Scene::parse("x.toml", &scene, &[], &mut |_: &str| Ok(text.as_bytes().to_vec())).unwrap();
        let recording = scene.recording.clone().expect("a recording");
        (recording.file, recording.taken.columns.join(", "), recording.taken.span_s, recording.taken.rows)
    };
    let motion = told("{ kind = 'prescribed', file = 'x.csv' }", "5", MOTION);
    assert_eq!(motion, ("x.csv".into(), "time_s, angle_rad".into(), [2.0, 6.0], 4));
    let named = "{ kind = 'prescribed', file = { path = 'x.csv', time = 't [s]', angle = 'knob [deg]' } }";
    let motion = told(named, "1", "t,knob\n0,0\n1,90\n");
    assert_eq!(motion, ("x.csv".into(), "t [s], knob [deg]".into(), [0.0, 1.0], 2));
    let capture = "{ kind = 'capture', channel_a = 'a', channel_b = 'b', file = { path = 'x.csv', from = 5 } }";
    assert_eq!(told(capture, "'9 ms'", CAPTURE), ("x.csv".into(), "a, b".into(), [5.0, 5.01], 4));
    let table = "{ kind = 'capture', channel_a = 'a', channel_b = 'b', file = 'x.csv' }";
    let table = told(table, "'1 ms'", "Time [ms],a,b\n0,0,0\n1,1,0\n2,1,1\n");
    assert_eq!(table, ("x.csv".into(), "Time [ms], a, b".into(), [0.0, 0.002], 3));
}
