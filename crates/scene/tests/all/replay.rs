//! Recordings are read in the form that other programs write, and refused with the line.

use hpu_scene::replay::{Columns, Motion, PinEdge, ReplayError, Unit, read_capture, read_motion};
use proptest::prelude::*;

/// The latest accepted time and the greatest accepted angle.
const MOST: (f64, f64) = (1e9, 1e6);

const NO_TIMESCALE: &str =
    "1: no $timescale, so times have no unit; add a line as `$timescale 1 ns $end` in front of the file";

fn edge(picoseconds: i64, a: u8, b: u8) -> PinEdge {
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
    channels(text, "A", "B")
}

fn channels(text: &str, a: &str, b: &str) -> Result<Vec<PinEdge>, String> {
    let read = read_capture(text.as_bytes(), a, b, &Columns::default());
    read.map(|capture| capture.edges).map_err(|error| error.to_string())
}

/// Reads a table of angles, columns found by their units.
fn motion(text: &str) -> Result<Motion, ReplayError> {
    read_motion(text.as_bytes(), &Columns::default(), Unit::Angle, MOST).map(|(motion, _)| motion)
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
fn initial_levels_are_the_first_ones() {
    let dumped = "$dumpvars\n1!\n1\"\n$end\n#5\n0!\n";
    assert_eq!(read(&capture("1 ps", dumped)).unwrap(), [edge(0, 1, 1), edge(5, 0, 1)]);
    // A first level is no edge.
    assert_eq!(read(&capture("1 ps", "#0 0\"\n#5 1!\n#7 1\"\n")).unwrap(), [edge(0, 1, 0), edge(7, 1, 1)]);
    let none = "12: the channel `B` has no level 0 or 1 in the whole recording";
    assert_eq!(read(&capture("1 ps", "#5 1! x\"\n")), Err(none.into()));
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
    assert_eq!(channels(&format!("{text}0a\n"), "one.A", "two.A").unwrap(), [edge(2, 0, 1)]);
    // The value 101 is one of eight bits: 0 0 0 0 0 1 0 1.
    assert_eq!(channels(text, "BUS[2]", "one.BUS[1]").unwrap(), [edge(2, 1, 0)]);
    assert_eq!(channels(text, "BUS(0)", "BUS(7)").unwrap(), [edge(2, 1, 0)]);
    let refused = |a, b| channels(text, a, b).unwrap_err();
    assert_eq!(refused("A", "two.A"), "9: several channels are named `A`; write the scopes too: one.A, two.A");
    assert_eq!(
        refused("one.A", "C"),
        "9: no channel `C`; one-bit channels of this file: one.A, two.A; with bits, as in `ab[0]`: one.BUS"
    );
    assert_eq!(refused("BUS", "two.A"), "9: channel `one.BUS` has 8 bits; an encoder line has one, as in `one.BUS[0]`");
    assert!(refused("BUS[8]", "two.A").starts_with("9: no channel `BUS[8]`; "));
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
    assert_eq!(
        read(&capture("1 ps", "#9 1!\n#10 x!\n")).unwrap_err(),
        "13: the level `x` is neither 0 nor 1, after a level that is known"
    );
    assert_eq!(read(&capture("100 s", "#9 1!\n#18446744073\n")).unwrap_err(), "13: #18446744073 is beyond 2^63 ps");
    for (text, line) in
        [("", 1), ("$nonsense\n", 1), ("$timescale 1 parsec $end\n", 1), (&capture("1 ps", "#0 1!\n?\n"), 13)]
    {
        let message = read(text).unwrap_err();
        assert!(message.starts_with(&format!("{line}: not VCD: ")), "{message}");
    }
    assert_eq!(read(&capture("3 us", "")).unwrap_err(), "6: a timescale of 3; VCD knows 1, 10 and 100");
    assert_eq!(read("$enddefinitions $end\n").unwrap_err(), NO_TIMESCALE);
}

#[test]
fn a_motion_is_read_in_radians() {
    let degrees = motion("\u{feff}# by hand\r\ntime_s, angle_deg\r\n0, 0\r\n\r\n0.5,-180\r\n").unwrap();
    assert_eq!(degrees, Motion::Positions(vec![(0.0, 0.0), (0.5, -std::f64::consts::PI)]));
    let radians = motion("time_s,angle_rad\n1e-3,2.5\n").unwrap();
    assert_eq!(radians, Motion::Positions(vec![(1e-3, 2.5)]));
    let counts = motion("time_s,count\n0,-3\n0.002,1e9\n").unwrap();
    assert_eq!(counts, Motion::Counts(vec![(0.0, -3), (0.002, 1_000_000_000)]));
}

#[test]
fn a_bad_motion_is_refused_by_line() {
    let none = |what: &str, header: &str, key: &str| {
        format!(
            "1: no column of {what} with a unit: the header has {header}; write the unit behind a name, as in \
             `time_s,angle_rad`, or in the scene: file = {{ path = \"...\", {key} }}"
        )
    };
    for (text, message) in [
        ("", "1: no header; write the names of the columns with their units, as in `time_s,angle_rad`".to_string()),
        ("t,x\n0,0\n", none("times", "`t`, `x`", "time = \"t [ms]\"")),
        ("t_s,x\n0,0\n", none("positions", "`t_s`, `x`", "angle = \"x [deg]\"")),
        (
            "t_s,u_rad,v_deg\n",
            "1: several columns of positions: `u_rad`, `v_deg`; name one in the scene: \
             file = { path = \"...\", angle = \"...\" }"
                .to_string(),
        ),
        ("time_s,angle_rad\n", "1: no point follows the header".to_string()),
        ("time_s,angle_rad\n0,0\n1\n", "3: 1 columns; the header has 2".to_string()),
        ("time_s,angle_rad\n0,0,0\n", "2: 3 columns; the header has 2".to_string()),
        ("time_s,angle_rad\n0,nan\n", "2: `nan` is not a finite number".to_string()),
        ("time_s,angle_rad\n0,0\n1,1e7\n", "3: 1e7; accepted: -1000000 to 1000000".to_string()),
        ("time_s,count\n0,0\n1,2e9\n", "3: 2e9; accepted: -1000000000 to 1000000000".to_string()),
        ("time_s,count\n0,0\n1,1.5\n", "3: `1.5` is not a count; write a whole number".to_string()),
        ("time_s,angle_rad\n0,0\n2e9,0\n", "3: 2e9; accepted: -1000000000 to 1000000000".to_string()),
        ("time_s,angle_rad\n0,0\n-1,0\n", "3: time must increase from line to line: -1 s follows 0 s".to_string()),
        ("time_s,angle_rad\n0,0\n1,one\n", "3: `one` is not a finite number".to_string()),
        ("time_s,angle_rad\n0,0\n#\n0,1\n", "4: time must increase from line to line: 0 s follows 0 s".to_string()),
    ] {
        assert_eq!(motion(text).unwrap_err().to_string(), message, "{text}");
    }
}

/// Angles of 0, 90 and -45 degrees at 0, 0.5 and 1 s, as laboratories write them.
#[test]
fn a_table_is_read_as_laboratories_write_it() {
    let expected = [(0.0, 0.0), (0.5, 90f64), (1.0, -45.0)];
    for text in [
        "time_s,angle_deg\n0,0\n0.5,90\n1,-45\n",
        "timestep [us],encoder_paddle_pos [deg]\n0,0.0\n500000,90\n1000000,-45\n",
        "\u{feff}timestep [ms];encoder_paddle_pos [deg];torque [Nm]\r\n0;0,0;1\r\n500;90,0;2,5\r\n1000;-45,0;3\r\n",
        "Time (s)\tKnob (deg)\tI (A)\n0\t0\t1\n0.5\t90\t1\n1\t-45\t1\n",
        "time_s angle_deg\n0 0\n0.5 90\n1 -45\n",
        "\"t / ms\",\"theta / deg\"\n\"0\",\"0\"\n\"500,0\",\"90,0\"\n\"1000,0\",\"-45,0\"\n",
        "# a log\n% of a program\n\nvoltage,t_ms,knob_deg,\n1,0,0,\n1,500,90,\n1,1000,-45,\n",
        "time_s,angle_deg,angle_set_deg\n0,0,1\n0.5,90,1\n1,-45,1\n",
        "t [ns],u [V],x [rev]\n0,1,0\n500000000,1,0.25\n1000000000,1,-0.125\n",
    ] {
        let columns = Columns { separator: text.starts_with("time_s angle").then_some(' '), ..Columns::default() };
        let read = read_motion(text.as_bytes(), &columns, Unit::Angle, MOST);
        let (read, _) = read.unwrap_or_else(|error| panic!("{text}: {error}"));
        let Motion::Positions(points) = read else { panic!("{text}: counts") };
        assert_eq!(points.len(), 3, "{text}");
        for (point, (time_s, deg)) in points.iter().zip(expected) {
            let near = (point.0 - time_s).abs() < 1e-15 && (point.1 - deg.to_radians()).abs() < 1e-15;
            assert!(near, "{text}: {point:?}");
        }
    }
}

#[test]
fn a_column_is_named_where_units_do_not_tell_it() {
    let text = "t,target,theta,alpha\n0,0,1,2\n500,0,3,4\n";
    let named = |time: &str, position: &str| {
        let columns = Columns { time: Some(time.into()), position: Some(position.into()), separator: None };
        let read = read_motion(text.as_bytes(), &columns, Unit::Angle, MOST);
        read.map(|(motion, _)| motion).map_err(|error| error.to_string())
    };
    let degree = std::f64::consts::PI / 180.0;
    assert_eq!(named("t [ms]", "alpha [mrad]"), Ok(Motion::Positions(vec![(0.0, 0.002), (0.5, 0.004)])));
    assert_eq!(named("t [ms]", "theta [deg]"), Ok(Motion::Positions(vec![(0.0, degree), (0.5, 3.0 * degree)])));
    assert_eq!(named("t [s]", "target [counts]"), Ok(Motion::Counts(vec![(0.0, 0), (500.0, 0)])));
    let unit = "1: no unit of the column `t`; write time = \"t [unit]\", a unit of s, ms, us, ns, ps, min";
    assert_eq!(named("t", "alpha [rad]"), Err(unit.into()));
    let none = "1: no column `beta [deg]`; the columns are `t`, `target`, `theta`, `alpha`";
    assert_eq!(named("t [s]", "beta [deg]"), Err(none.into()));
    let rail = |text: &str| read_motion(text.as_bytes(), &Columns::default(), Unit::Length, MOST);
    let millimetres = rail("t_s,x_mm,force_nm\n0,5,1\n").map(|(motion, _)| motion);
    assert_eq!(millimetres, Ok(Motion::Positions(vec![(0.0, 0.005)])));
    let degrees = rail("t_s,x_deg\n0,5\n").unwrap_err();
    assert!(degrees.reason.starts_with("no column of positions"), "{degrees}");
}

/// Both lines of 81 counts, 100 us apart, in the form of a simulator; the levels are unknown before 1 us.
fn recorded(
    header: &str,
    mut at: impl FnMut(u64) -> String,
    mut levels: impl FnMut(Option<(u8, u8)>) -> String,
) -> String {
    let mut text = header.to_string() + &at(0) + &levels(None);
    for count in 0..81 {
        let pins = [(0, 0), (0, 1), (1, 1), (1, 0)][count as usize % 4];
        text += &at(1000 + 100_000 * count);
        text += &levels(Some(pins));
    }
    text
}

/// Asserts that a recording has the first levels at 1 us and 80 edges, each 100 us after the other.
fn assert_81_counts(name: &str, bytes: &[u8], a: &str, b: &str) {
    let capture = read_capture(bytes, a, b, &Columns::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
    let expected: Vec<_> = (0..81)
        .map(|count| {
            let (a, b) = [(0, 0), (0, 1), (1, 1), (1, 0)][count as usize % 4];
            edge(1_000_000 + 100_000_000 * count, a, b)
        })
        .collect();
    assert_eq!(capture.edges, expected, "{name}");
    assert_eq!(capture.end_picoseconds, expected[80].picoseconds, "{name}");
}

#[test]
fn a_capture_is_read_as_simulators_and_loggers_write_it() {
    let of = |a: &'static str, b: &'static str, unknown: &'static str| {
        move |levels: Option<(u8, u8)>| match levels {
            None => format!("{unknown}{a}\n{unknown}{b}\n"),
            Some((one, two)) => format!("{one}{a}\n{two}{b}\n"),
        }
    };
    let modelsim = "$date\n\tSat\n$end\n$version\n\tModelSim Version 2020.1\n$end\n$timescale\n\t1ns\n$end\n\n\
                    $scope module tb $end\n$var parameter 32 $ N $end\n$var wire 1 ! enc_a  $end\n\
                    $var wire 1 \" enc_b  $end\n$scope begin blk $end\n$upscope $end\n$scope task t1 $end\n\
                    $upscope $end\n$upscope $end\n$enddefinitions $end\n$dumpvars\n$end\n";
    let text = recorded(modelsim, |ns| format!("#{ns}\n"), of("!", "\"", "x"));
    assert_81_counts("ModelSim", text.as_bytes(), "enc_a", "tb.enc_b");
    let ghdl = "$date\n  Sat Nov 28 12:08:33 2026\n$end\n$version\n  GHDL v0\n$end\n$timescale\n  1 fs\n$end\n\
                $scope module standard $end\n$upscope $end\n$scope module q $end\n$var reg 1 ! a $end\n\
                $var reg 1 \" b $end\n$var reg 2 # ab[1:0] $end\n$var real 64 $ r $end\n\
                $comment c is not handled $end\n$upscope $end\n$enddefinitions $end\n";
    let levels = |levels: Option<(u8, u8)>| match levels {
        None => "U!\nU\"\nbUU #\nr0.0 $\n".to_string(),
        Some((a, b)) => format!("{a}!\n{b}\"\nb{a}{b} #\nr-1.5 $\n"),
    };
    let text = recorded(ghdl, |ns| format!("#{}\n", ns * 1_000_000), levels);
    assert_81_counts("GHDL", text.as_bytes(), "a", "b");
    assert_81_counts("GHDL's vector", text.as_bytes(), "ab(1)", "q.ab[0]");
    let vivado = "$timescale 1ps $end\n$scope module tb $end\n$var logic 1 ! a $end\n$var integer 32 & n $end\n\
                  $var event 1 % e $end\n$var wire 1 \" ab [0] $end\n$var wire 1 ' ab [1] $end\n\
                  $attrbegin misc 02 x 1 $end\n$upscope $end\n$enddefinitions $end\n";
    let text = recorded(vivado, |ns| format!("#{}\n1%\n", ns * 1000), of("'", "\"", "z"));
    assert_81_counts("bits as variables", text.as_bytes(), "ab[1]", "ab[0]");
    let extended = "$date today $end\n$version ports $end\n$timescale 1 ns $end\n$scope module tb.dut $end\n\
                    $var port 1 <0 a $end\n$var port [1:0] <1 ab $end\n$upscope $end\n$enddefinitions $end\n";
    let levels = |levels: Option<(u8, u8)>| match levels {
        None => "$dumpports\npN 6 6 <0\npNN 66 66 <1\n$end\n".to_string(),
        Some((a, b)) => {
            let (input, output) = (["D", "U"], ["L", "H"]);
            format!("p{} 6 0 <0\np{}{} 66 00 <1\n", input[a as usize], output[0], output[b as usize])
        }
    };
    let text = recorded(extended, |ns| format!("#{ns}\n"), levels) + "$vcdclose #9 $end\n";
    let closed = text.replace("$vcdclose #9 $end\n", "$vcdclose #8001000 $end\n");
    assert_81_counts("EVCD", closed.as_bytes(), "a", "ab[0]");
    // Saleae Logic 2 writes a row at every change; times may begin before a trigger.
    let rows = recorded("Time [s],Channel 0,Channel 1\n", |_| String::new(), |_| String::new());
    let saleae = (0..81).fold(rows, |text, count: u64| {
        let (a, b) = [(0, 0), (0, 1), (1, 1), (1, 0)][count as usize % 4];
        let ns = 1000 + 100_000 * count;
        text + &format!("{}.{:09},{a},{b}\n", ns / 1_000_000_000, ns % 1_000_000_000)
    });
    assert_81_counts("Saleae", saleae.as_bytes(), "Channel 0", "Channel 1");
}

#[test]
fn a_table_of_samples_is_read_as_sigrok_writes_it() {
    let above = "; CSV generated by libsigrok 0.5.2\n; from demo on Sat Nov 28\n; Channels (2/8): D0, D1\n\
                 ; Samplerate: 500 kHz\n";
    let samples = "0,0\n0,0\n1,0\n1,0\n1,1\n";
    let expected = [edge(0, 0, 0), edge(4_000_000, 1, 0), edge(8_000_000, 1, 1)];
    for labels in ["logic,logic\n", "D0,D1\n", ""] {
        let read = channels(&format!("{above}{labels}{samples}"), "D0", "D1");
        assert_eq!(read, Ok(expected.to_vec()), "{labels}");
    }
    let timed = "; Channels (2/2): D0, D1\n; Samplerate: 500 kHz\nmicroseconds,logic,logic\n0,0,0\n4,1,0\n8,1,1\n";
    assert_eq!(channels(timed, "D0", "D1"), Ok(expected.to_vec()));
    let trigger = "Time [s],A,B\n-0.000004,0,0\n0.000000,1,0\n0.000004,1,1\n";
    let before = [edge(-4_000_000, 0, 0), edge(0, 1, 0), edge(4_000_000, 1, 1)];
    assert_eq!(channels(trigger, "A", "B"), Ok(before.to_vec()));
    let no_rate = channels("D0,D1\n0,0\n", "D0", "D1").unwrap_err();
    assert!(no_rate.contains("no column of times"), "{no_rate}");
    let missing = channels("Time [s],D0,D1\n0,0,0\n", "D0", "D2").unwrap_err();
    assert!(missing.contains("no channel `D2`; one-bit channels of this file: D0, D1"), "{missing}");
}

#[test]
fn lines_keep_their_levels_while_a_recording_is_off() {
    let off =
        "#0\n$dumpvars\n0!\n0\"\n$end\n#5\n1!\n#7\n$dumpoff\nx!\nx\"\n$end\n#9\n$dumpon\n1!\n1\"\n$end\n#11\n0!\n";
    let expected = [edge(0, 0, 0), edge(5, 1, 0), edge(9, 1, 1), edge(11, 0, 1)];
    assert_eq!(read(&capture("1 ps", off)).unwrap(), expected);
}

#[test]
fn a_recording_that_ends_within_a_row_or_a_change_is_refused() {
    let (table, capture) = ("time_s,angle_rad\n0,0\n0.25,12.5\n", capture("1 ps", "#0 0! 0\"\n#1250 1!\n"));
    assert!(motion(table).is_ok() && read(&capture).is_ok());
    // A whole last line may lack its line feed: many programs leave it out.
    assert_eq!(motion(&table[..table.len() - 1]), motion(table));
    assert_eq!(read(&capture[..capture.len() - 1]), read(&capture));
    let open = &capture.as_bytes()[..capture.len() - 1];
    let notes = read_capture(open, "A", "B", &Columns::default()).map(|capture| capture.notes);
    assert_eq!(notes, Ok(vec!["the last line has no line feed, so the file may be cut short".to_string()]));
    for cut in 5..10 {
        let message = motion(&table[..table.len() - cut]).unwrap_err().to_string();
        assert!(message.starts_with("3: the last line has no line feed"), "{cut}: {message}");
    }
    for cut in [2, 8] {
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
        let _ = motion(&spoiled);
        let _ = motion(&format!("time_s,angle_rad\n{with}\n"));
    }
}
