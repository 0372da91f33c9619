//! Files of laboratories: what could be read wrong without a word is told or refused, and what programs write by their
//! defaults is read.

use hpu_scene::replay::{Columns, Motion, Taken, Unit, read_capture, read_motion};

const MOST: (f64, f64) = (1e9, 1e6);

/// Reads a table of angles whose columns a scene may name.
fn named(bytes: &[u8], time: &str, angle: &str) -> Result<(Motion, Taken), String> {
    let named = |name: &str| (!name.is_empty()).then(|| name.to_string());
    let columns = Columns { time: named(time), position: named(angle), separator: None };
    read_motion(bytes, &columns, Unit::Angle, MOST).map_err(|error| error.to_string())
}

fn refused(text: &str, time: &str, angle: &str) -> String {
    named(text.as_bytes(), time, angle).map(|read| format!("{read:?}")).expect_err(text)
}

/// Returns the points of a table of positions.
fn points(bytes: &[u8], time: &str, angle: &str) -> Vec<(f64, f64)> {
    match named(bytes, time, angle) {
        Ok((Motion::Positions(points), _)) => points,
        other => panic!("{}: {other:?}", String::from_utf8_lossy(bytes)),
    }
}

/// Returns times in us and levels of a capture's changes.
fn lines(text: &str, a: &str, b: &str, time: Option<&str>) -> Result<Vec<(f64, u8, u8)>, String> {
    let columns = Columns { time: time.map(str::to_string), ..Columns::default() };
    let capture = read_capture(text.as_bytes(), a, b, &columns).map_err(|error| error.to_string())?;
    let level = |pins: &hpu_scene::replay::PinEdge| (pins.picoseconds as f64 / 1e6, pins.a.into(), pins.b.into());
    Ok(capture.edges.iter().map(level).collect())
}

#[test]
fn a_speed_is_no_time_and_no_position() {
    // The column named time has no unit; that of the speed must not take its place.
    let text = "time,angle_rad,velocity_rad_s\n0,0,0\n0.5,1,0.1\n";
    let message = refused(text, "", "");
    assert!(message.starts_with("1: no column of times with a unit"), "{message}");
    assert!(message.contains("time = \"time [ms]\""), "{message}");
    assert_eq!(points(text.as_bytes(), "time [s]", ""), [(0.0, 0.0), (0.5, 1.0)]);
    for rate in ["velocity_rad_s", "v_m_s", "omega_deg_s", "speed_counts_per_s", "speed rad/s", "speed [rad/s]"] {
        let text = format!("sample_ms,theta_rad,{rate}\n0,0,0\n10,1,2\n");
        assert_eq!(points(text.as_bytes(), "", ""), [(0.0, 0.0), (0.01, 1.0)], "{rate}");
        assert!(refused(&text.replace("sample_ms", "sample"), "", "").contains("no column of times"), "{rate}");
    }
    let speed = "time_s,velocity_counts\n0,50\n1,51\n";
    assert!(refused(speed, "", "").contains("`velocity_counts` is something else by its name"));
    assert!(named(speed.as_bytes(), "", "velocity_counts").is_ok());
    // A column with the name of a position, but without its unit, beside another one's unit.
    let message = refused("time_s,motor_deg,theta\n0,50,0\n1,51,1\n", "", "");
    assert!(message.contains("`theta` has no unit, and `motor_deg` no name of positions"), "{message}");
    assert!(message.contains("angle = \"theta [rad]\"") && message.contains("angle = \"motor_deg\""), "{message}");
}

#[test]
fn a_name_is_that_of_a_column_and_not_the_beginning_of_one() {
    let text = "pos_a,pos_b,time_ms\n0,0,0\n57,1,100\n";
    for asked in ["pos_rad", "pos [rad]", "pos"] {
        assert!(refused(text, "", asked).contains("no column `pos"), "{asked}");
    }
    let message = refused(text, "", "pos_b");
    assert!(message.contains("write angle = \"pos_b [unit]\", a unit of rad, mrad"), "{message}");
    assert_eq!(points(text.as_bytes(), "", "pos_b [rad]"), [(0.0, 0.0), (0.1, 1.0)]);
    // Of two columns with a name, that with the unit.
    let two = "time_s,pos_deg,pos_rad\n0,0,0\n1,57,1\n";
    assert_eq!(points(two.as_bytes(), "", "pos [rad]")[1], (1.0, 1.0));
    assert!(refused(two, "", "pos [mrad]").contains("several columns are named `pos`: `pos_deg`, `pos_rad`"));
}

#[test]
fn a_unit_that_contradicts_the_header_is_refused() {
    let text = "time_s,angle_rad\n0,0\n1,0.5\n";
    let message = refused(text, "", "angle [deg]");
    assert!(message.contains("the header says `angle_rad`, and the scene `angle [deg]`"), "{message}");
    assert!(refused(text, "time [ms]", "").contains("the header says `time_s`"));
    assert!(refused("time_s,angle_mm\n0,0\n", "", "angle [deg]").contains("the header says `angle_mm`"));
    assert_eq!(points(text.as_bytes(), "time [s]", "angle [rad]")[1], (1.0, 0.5));
    assert_eq!(points(b"time_s,pot [a.u.]\n0,0\n1,0.5\n", "", "pot [rad]")[1], (1.0, 0.5));
}

#[test]
fn a_counter_goes_on_at_its_end() {
    let counts = |bits: u32, offset: i64, signed: bool| {
        let range = 1i64 << bits;
        let word = |at: i64| match (offset + 3 * at).rem_euclid(range) {
            word if signed && word >= range / 2 => word - range,
            word => word,
        };
        let rows = (0..50).map(|at| format!("{at},{}\n", word(at)));
        let text = format!("time_s,count\n{}", rows.collect::<String>());
        match named(text.as_bytes(), "", "") {
            Ok((Motion::Counts(counts), taken)) => (counts.iter().map(|count| count.1).collect(), taken.notes),
            other => panic!("{bits}: {other:?}"),
        }
    };
    for bits in [8, 12, 16, 24, 32] {
        let note = format!("counts of {bits} bits go on where they pass the end of their range");
        // From 100 below the end on, which is 0; with a sign, from the greatest number to the least.
        let passes = [(-100, false), ((1 << (bits - 1)) - 100, true)];
        for (begin, signed) in passes.into_iter().filter(|(begin, _)| *begin < 1_000_000_000) {
            let expected = (0..50).map(|at| begin + 3 * at).collect::<Vec<_>>();
            assert_eq!(counts(bits, begin, signed), (expected, vec![note.clone()]), "{bits} bits");
        }
    }
    // Down from 0.
    let Ok((Motion::Counts(down), _)) = named(b"t_s,count\n0,0\n1,65531\n2,65526\n", "", "") else { panic!("counts") };
    assert_eq!(down, [(0.0, 0), (1.0, -5), (2.0, -10)]);
    // A step that is none at a counter's end.
    let Ok((Motion::Counts(step), taken)) = named(b"t_s,count\n0,0\n1,200\n2,203\n", "", "") else { panic!("counts") };
    assert_eq!((step[1].1, taken.notes.len()), (200, 0));
}

#[test]
fn a_thousands_separator_is_no_decimal_comma() {
    let message = refused("time_ms,angle_deg\n0,0\n50,\"1,080\"\n", "", "");
    assert!(message.starts_with("3: `1,080` may be 1.080 or 1080; "), "{message}");
    let near = |text: &str| (points(text.as_bytes(), "", "")[1].1.to_degrees() - 1.08).abs() < 1e-9;
    assert!(near("time_ms;angle_deg\n0;0\n50;1,080\n"));
    assert!(near("time_ms,angle_deg\n0,\"0,5\"\n50,\"1,080\"\n"));
}

#[test]
fn levels_are_read_as_programs_write_them_and_refused_otherwise() {
    let expected = vec![(0.0, 0, 0), (100.0, 1, 0), (200.0, 1, 1)];
    for (low, high) in [("0.0", "1.0"), ("False", "True"), ("LOW", "HIGH"), ("0", "1"), ("Off", "On"), ("0,0", "1,0")] {
        let text = format!("time_us;A;B\n0;{low};{low}\n100;{high};{low}\n200;{high};{high}\n");
        assert_eq!(lines(&text, "A", "B", None), Ok(expected.clone()), "{low}");
    }
    let analog = lines("Time [s],A,B\n0,0.0,0.0\n0.1,3.3,0.0\n", "A", "B", None).unwrap_err();
    assert!(analog.starts_with("3: the level `3.3` is none; accepted: 0, 1, low, high"), "{analog}");
    let late = lines("Time [s],A,B\n999999999999999999.999999999999999999,0,0\n", "A", "B", None).unwrap_err();
    assert!(late.ends_with("is not a time"), "{late}");
    let never = lines("Time [s],A,B\n0,0,x\n0.1,1,x\n", "A", "B", None).unwrap_err();
    assert_eq!(never, "1: the channel `B` has no level 0 or 1 in the whole recording");
}

/// The text of libsigrok's `csv` output: a sample's time is a whole number of the longest unit that is not longer than
/// it, and the first sample stands at one.
#[test]
fn times_of_sigrok_are_those_of_its_rate() {
    let text = |rate: &str, label: &str, period: u64| {
        let rows = [(1, "0,0"), (13, "1,0"), (25, "1,1")].map(|(at, levels)| format!("{},{levels}\n", at * period));
        format!("; Channels (2/8): D0, D1\n; Samplerate: {rate}\n{label}\n{}", rows.concat())
    };
    let at = |sample: f64, rate_mhz: f64| (sample / rate_mhz * 1e6).floor() / 1e6;
    let of = |rate_mhz: f64| vec![(at(1.0, rate_mhz), 0, 0), (at(13.0, rate_mhz), 1, 0), (at(25.0, rate_mhz), 1, 1)];
    for (rate, unit, period, rate_mhz) in [
        ("1 MHz", "microseconds", 1, 1.0),
        ("500 kHz", "microseconds", 2, 0.5),
        ("24 MHz", "nanoseconds", 41, 24.0),
        ("12 MHz", "nanoseconds", 83, 12.0),
        ("1 kHz", "milliseconds", 1, 1e-3),
    ] {
        for label in [format!("{unit},logic,logic"), "Time,D0,D1".to_string()] {
            assert_eq!(lines(&text(rate, &label, period), "D0", "D1", None), Ok(of(rate_mhz)), "{rate} {label}");
        }
    }
    let mixed = text("1 MHz", "microseconds,logic,logic,V", 1).replace("D1\n", "D1, A0\n");
    let mixed = mixed.replace("0,0\n", "0,0,1.5\n").replace("1,0\n", "1,0,1.5\n").replace("1,1\n", "1,1,1.5\n");
    assert_eq!(lines(&mixed, "D0", "D1", None), Ok(of(1.0)));
    let unitless = "time,A,B\n0,0,0\n10,1,0\n";
    let message = lines(unitless, "A", "B", None).unwrap_err();
    assert!(message.contains("file = { path = \"...\", time = \"time [us]\" }"), "{message}");
    assert_eq!(lines(unitless, "A", "B", Some("time [us]")), Ok(vec![(0.0, 0, 0), (10.0, 1, 0)]));
    let vcd = "$timescale 1 us $end\n$var wire 1 ! A $end\n$enddefinitions $end\n";
    assert!(lines(vcd, "A", "B", Some("time [us]")).unwrap_err().contains("this file is VCD"));
}

#[test]
fn headers_are_found_where_programs_write_them() {
    let rows = "0,0\n0.5,1\n1,2\n";
    let expected = [(0.0, 0.0), (0.5, 1.0), (1.0, 2.0)];
    for text in [
        format!("time,angle\ns,rad\n{rows}"),
        format!("time,angle\n[s],[rad]\n{rows}"),
        format!("time,angle,u\n(s),(rad),(V)\n\n{}", rows.replace('\n', ",1\n")),
        format!("# time_s,angle_rad\n{rows}"),
        format!("% made by a script, today\n% time_s,angle_rad\n{rows}"),
        format!("# time_s angle_rad\n{}", rows.replace(',', " ")),
        format!("sep=;\ntime_s;angle_rad\n{}", rows.replace(',', ";")),
        format!("Measurement 12 of paddle, left\n\ntime_s,angle_rad\n{rows}"),
        format!("time_s,angle_rad\n{rows}% the end\n"),
        format!("time_s angle_rad\n{}", rows.replace(',', " ")),
        format!("  Time [s]    Angle [rad]\n  {}", rows.replace(',', "   ").replace('\n', "\n   ")),
        format!("time_s,angle_rad\n{rows}").replace('\n', "\r"),
        format!("time_s,angle_rad\n{}", rows.trim_end()),
        "time/min,angle/mrad\n0,0\n0.008333333333333333,1000\n0.016666666666666666,2000\n".to_string(),
        format!("time_s,angle_rad\n{}", rows.replace("0.5", "5.0D-01")),
        format!("time_s,u_V,angle_rad\n{}", rows.replace(',', ",\u{2212}1,")),
    ] {
        assert_eq!(points(text.as_bytes(), "", ""), expected, "{text}");
    }
    let labview = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\n***End_of_Header***\t\n\t\nChannels\t1\t\n\
                   ***End_of_Header***\t\nX_Value\tUntitled\tComment\n0.0\t0.0\n0.5\t1.0\n1.0\t2.0\n";
    assert_eq!(points(labview.as_bytes(), "X_Value [s]", "Untitled [rad]"), expected);
    assert_eq!(points(rows.as_bytes(), "1 [s]", "2 [rad]"), expected);
    assert!(refused(rows, "", "").contains("time = \"1 [s]\", angle = \"2 [rad]\""));
    // A row that is no number is an error, wherever, and never taken as a header.
    assert!(refused("0,0\nbad,1\n1,2\n", "1 [s]", "2 [rad]").starts_with("2: `bad` is not a finite number"));
    assert!(
        refused("time_s,angle_rad\n0,0\n0,01,0,05\n0,02,0,1\n0,03,0,2\n", "", "")
            .starts_with("3: 4 columns; the header")
    );
    assert!(refused("time_s,angle_rad\n12:00:00,1\n", "", "").ends_with("write times as numbers, as in seconds"));
    assert!(refused("time_s,angle_rad\nbad,1\n1,2\n", "", "").starts_with("2: `bad` is not a finite number"));
}

#[test]
fn text_is_read_in_the_codes_of_other_systems() {
    let text = "t [ms],angle [°]\n0,0\n500,180\n";
    let expected = [(0.0, 0.0), (0.5, std::f64::consts::PI)];
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let wide = |mark: [u8; 2], bytes: fn(u16) -> [u8; 2]| {
        [mark.to_vec(), text.encode_utf16().flat_map(bytes).collect()].concat()
    };
    for bytes in [latin, wide([0xff, 0xfe], u16::to_le_bytes), wide([0xfe, 0xff], u16::to_be_bytes)] {
        assert_eq!(points(&bytes, "", ""), expected);
    }
    assert_eq!(points(b"t [\xb5s],angle [deg]\n0,0\n500000,180\n", "", ""), expected);
}

#[test]
fn times_since_1970_count_from_the_first() {
    for text in [
        "timestamp_ms,angle_rad\n1714564800000,0\n1714564800010,1\n",
        "timestamp_s,angle_rad\n1714564800.25,0\n1714564800.26,1\n",
    ] {
        let (motion, taken) = named(text.as_bytes(), "", "").unwrap();
        let Motion::Positions(points) = motion else { panic!("positions") };
        // Doubles near 1.7e9 are 2.4e-7 apart.
        assert!(points[0].0 == 0.0 && (points[1].0 - 0.01).abs() < 3e-7, "{points:?}");
        assert!(taken.notes[0].starts_with("times from 1714564800"), "{taken:?}");
    }
}

#[test]
fn a_binary_file_is_told_by_what_it_is() {
    for (begin, what) in [
        (&b"\x1f\x8b\x08\0"[..], "gzip"),
        (b"\x28\xb5\x2f\xfd\0", "zstd"),
        (b"GHDLwave\n\0", "--vcd=FILE or --fst=FILE"),
        (b"PK\x03\x04", "sigrok's .sr"),
        (b"\x01\0\x02\0", "a binary file"),
    ] {
        let capture = read_capture(begin, "A", "B", &Columns::default()).unwrap_err().to_string();
        let motion = named(begin, "", "").unwrap_err();
        assert!(capture.contains(what) && motion.contains(what), "{capture}, {motion}");
    }
}

#[test]
fn channels_have_the_names_of_any_program() {
    let text = "$timescale 1 us $end\n$scope module m $end\n$var wire 1 ! A [0:0] $end\n$var wire 2 # ab [1:0] $end\n\
                $var wire 1 \\ \\enc[0] $end\n$var string 0 # text $end\n$upscope $end\n$enddefinitions $end\n\
                #0 0! b00 # 0\\\n#3 1!\n#5 b10 # 1\\\n";
    let expected = vec![(0.0, 0, 0), (3.0, 1, 0), (5.0, 1, 1)];
    for (a, b) in [("A", "ab(1)"), ("/m/A", "/m/ab[1]"), ("m.A[0]", "m/ab(1)"), ("A(0)", "enc[0]"), ("A", "m.enc[0]")] {
        assert_eq!(lines(text, a, b, None), Ok(expected.clone()), "{a} {b}");
    }
    assert!(lines(text, "ab", "A", None).unwrap_err().contains("has 2 bits"));
}
