//! Recordings are read in the form that other programs write, and refused with the line.

use hpu_scene::replay::{Motion, PinEdge, read_capture, read_motion_csv};
use proptest::prelude::*;

/// The latest accepted time and the greatest accepted angle.
const MOST: (f64, f64) = (1e9, 1e6);

fn edge(picoseconds: u64, a: u8, b: u8) -> PinEdge {
    PinEdge { picoseconds, a: a == 1, b: b == 1 }
}

/// Returns two lines in the form of sigrok's VCD output: one line per time, with all changes of that time.
fn capture(timescale: &str, changes: &str) -> String {
    format!(
        "$date Tue Nov 21 10:00:00 2017 $end\n$version by hand $end\n\
         $comment\n  Acquisition with 2/8 channels at 1 MHz\n$end\n\
         $timescale {timescale} $end\n$scope module libsigrok $end\n$var wire 1 ! A $end\n$var wire 1 \" B $end\n\
         $upscope $end\n$enddefinitions $end\n{changes}"
    )
}

fn read(text: &str) -> Result<Vec<PinEdge>, String> {
    read_capture(text.as_bytes(), "A", "B").map_err(|error| error.to_string())
}

#[test]
fn a_capture_is_read_in_picoseconds_whatever_its_timescale() {
    for (timescale, picoseconds) in
        [("1 s", 1_000_000_000_000), ("10 ms", 10_000_000_000), ("1us", 1_000_000), ("100 ns", 100_000), ("1 ps", 1)]
    {
        let edges = read(&capture(timescale, "#0 1! 0\"\n#3 1\"\n#7 0! 0\"\n#9\n")).unwrap();
        assert_eq!(edges, [edge(0, 1, 0), edge(3 * picoseconds, 1, 1), edge(7 * picoseconds, 0, 0)], "{timescale}");
    }
    let femtoseconds = read(&capture("100 fs", "#0 0! 0\"\n#19 1!\n#20 1\"\n")).unwrap();
    assert_eq!(femtoseconds, [edge(0, 0, 0), edge(1, 1, 0), edge(2, 1, 1)]);
}

#[test]
fn initial_levels_are_those_dumped_or_zero() {
    let dumped = "$dumpvars\n1!\n1\"\n$end\n#5\n0!\n";
    assert_eq!(read(&capture("1 ps", dumped)).unwrap(), [edge(0, 1, 1), edge(5, 0, 1)]);
    assert_eq!(read(&capture("1 ps", "#5 1!\n")).unwrap(), [edge(0, 0, 0), edge(5, 1, 0)]);
    assert_eq!(read(&capture("1 ps", "")).unwrap(), [edge(0, 0, 0)]);
}

#[test]
fn changes_at_one_time_are_one_and_no_change_is_none() {
    let text = capture("1 ps", "#0 0! 0\"\n#4 1!\n#4 1\"\n#6 1!\n#8 0!\n");
    assert_eq!(read(&text).unwrap(), [edge(0, 0, 0), edge(4, 1, 1), edge(8, 0, 1)]);
}

#[test]
fn a_channel_is_found_by_its_scopes_too_and_among_wider_ones() {
    let text = "$timescale 1 ps $end\n$scope module one $end\n$var wire 1 a A $end\n$var wire 8 v BUS $end\n\
                $upscope $end\n\
                $scope module two $end\n$var wire 1 b A $end\n$upscope $end\n$enddefinitions $end\n#2 1b\nb101 v\n";
    let edges = read_capture(text.as_bytes(), "one.A", "two.A").unwrap();
    assert_eq!(edges, [edge(0, 0, 0), edge(2, 0, 1)]);
    let refused = |a, b| read_capture(text.as_bytes(), a, b).unwrap_err().to_string();
    assert_eq!(refused("A", "two.A"), "9: several channels are named `A`; write the scopes too: one.A, two.A");
    assert_eq!(refused("one.A", "C"), "9: no channel `C`; one-bit channels of this file: one.A, two.A");
    assert_eq!(refused("BUS", "two.A"), "9: channel `one.BUS` has 8 bits; an encoder line has one");
    assert_eq!(refused("one.A", "one.A"), "9: `one.A` and `one.A` are one channel; name two");
}

#[test]
fn a_capture_without_channels_is_refused() {
    let text = "$timescale 1 ps $end\n$enddefinitions $end\n";
    assert_eq!(read(text).unwrap_err(), "2: no channel `A`; one-bit channels of this file: none");
}

#[test]
fn a_bad_capture_is_refused_by_line() {
    assert_eq!(read(&capture("1 ps", "#9 1!\n#4 0!\n")).unwrap_err(), "13: time runs backwards, from #9 to #4");
    assert_eq!(read(&capture("1 ps", "#9 1!\n#10 x!\n")).unwrap_err(), "13: the level `x` is neither 0 nor 1");
    assert_eq!(read(&capture("100 s", "#9 1!\n#18446744073\n")).unwrap_err(), "13: #18446744073 is beyond 2^64 ps");
    for (text, line) in
        [("", 1), ("nonsense\n", 1), ("$timescale 1 parsec $end\n", 1), (&capture("1 ps", "#0 1!\n?\n"), 13)]
    {
        let message = read(text).unwrap_err();
        assert!(message.starts_with(&format!("{line}: not VCD: ")), "{message}");
    }
    assert_eq!(read(&capture("3 us", "")).unwrap_err(), "11: a timescale of 3; VCD knows 1, 10 and 100");
    assert_eq!(read("$enddefinitions $end\n").unwrap_err(), "1: no $timescale, as in `1 us`");
}

#[test]
fn a_motion_is_read_in_radians() {
    let degrees = read_motion_csv("\u{feff}# by hand\r\ntime_s, angle_deg\r\n0, 0\r\n\r\n0.5,-180\r\n", MOST).unwrap();
    assert_eq!(degrees, Motion::Angles(vec![(0.0, 0.0), (0.5, -std::f64::consts::PI)]));
    let radians = read_motion_csv("time_s,angle_rad\n1e-3,2.5\n", MOST).unwrap();
    assert_eq!(radians, Motion::Angles(vec![(1e-3, 2.5)]));
    let counts = read_motion_csv("time_s,count\n0,-3\n0.002,1e9\n", MOST).unwrap();
    assert_eq!(counts, Motion::Counts(vec![(0.0, -3), (0.002, 1_000_000_000)]));
}

#[test]
fn a_bad_motion_is_refused_by_line() {
    let accepted = "write `time_s,angle_rad`, `time_s,angle_deg` or `time_s,count`";
    for (text, message) in [
        ("", format!("1: no header; {accepted}")),
        ("t,x\n0,0\n", format!("1: the header `t,x` is not known; {accepted}")),
        ("0,0\n1,1\n", format!("1: the header `0,0` is not known; {accepted}")),
        ("time_s,angle_rad\n", "1: no point follows the header".to_string()),
        ("time_s,angle_rad\n0,0\n1\n", "3: 1 columns; the header has 2".to_string()),
        ("time_s,angle_rad\n0,0,0\n", "2: 3 columns; the header has 2".to_string()),
        ("time_s,angle_rad\n0,nan\n", "2: `nan` is not a finite number".to_string()),
        ("time_s,angle_rad\n0,0\n1,1e7\n", "3: 1e7; accepted: -1000000 to 1000000".to_string()),
        ("time_s,count\n0,0\n1,2e9\n", "3: 2e9; accepted: -1000000000 to 1000000000".to_string()),
        ("time_s,count\n0,0\n1,1.5\n", "3: `1.5` is not a count; write a whole number".to_string()),
        ("time_s,angle_rad\n0,0\n-1,0\n", "3: -1; accepted: 0 to 1000000000".to_string()),
        ("time_s,angle_rad\n0,0\n1,one\n", "3: `one` is not a finite number".to_string()),
        ("time_s,angle_rad\n0,0\n#\n0,1\n", "4: time must increase from line to line: 0 s follows 0 s".to_string()),
    ] {
        assert_eq!(read_motion_csv(text, MOST).unwrap_err().to_string(), message, "{text}");
    }
}

#[test]
fn a_recording_that_is_cut_in_its_last_line_is_refused_wherever() {
    let (table, capture) = ("time_s,angle_rad\n0,0\n0.25,12.5\n", capture("1 ps", "#0 0! 0\"\n#1250 1!\n"));
    assert!(read_motion_csv(table, MOST).is_ok() && read(&capture).is_ok());
    for cut in 1..10 {
        let message = read_motion_csv(&table[..table.len() - cut], MOST).unwrap_err().to_string();
        assert!(message.starts_with("3: the last line has no line feed"), "{cut}: {message}");
    }
    for cut in 1..9 {
        let message = read(&capture[..capture.len() - cut]).unwrap_err();
        assert!(message.starts_with("13: the last line has no line feed"), "{cut}: {message}");
    }
}

proptest! {
    #[test]
    fn no_capture_and_no_motion_panics(at in 0usize..400, cut in 0usize..40, with in "[ -~\n]{0,24}") {
        let good = capture("1 us", "#0 0! 0\"\n#18446744073709551615 1!\n#9 b101 !\n");
        let (from, to) = (at.min(good.len()), (at + cut).min(good.len()));
        let spoiled = format!("{}{with}{}", &good[..from], &good[to..]);
        let _ = read(&spoiled);
        let _ = read_motion_csv(&spoiled, MOST);
        let _ = read_motion_csv(&format!("time_s,angle_rad\n{with}\n"), MOST);
    }
}
