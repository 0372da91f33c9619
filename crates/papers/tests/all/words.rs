//! The word formats of the PHANToM's datapath: measured ranges lie within the proved ranges, and both are reported.

use hpu_datapath::phantom::{Config, TrigCordic, TrigInterpolated, TrigQuarter, TrigTable, loop_variants};
use hpu_datapath::{Block, Generic};
use hpu_papers::phantom::formats::{
    FORMATS_CSV_HEADER, Fate, Formats, POSTURES, formats_csv, formats_text, full_scales_nm, plain, words,
};
use hpu_prove::arms::bounds;
use hpu_signal::Notation;
use hpu_study::phantom::sines::{SINES_CSV_HEADER, Sine, Source, sines, sines_csv, sines_text};
use hpu_study::phantom::workspace::{CELLS, NOMINAL_MM, Workspace};

fn all(postures: usize) -> Vec<Formats> {
    words().into_iter().map(|words| Formats::new(words, postures).unwrap()).collect()
}

fn named<'a>(all: &'a [Formats], name: &str) -> &'a Formats {
    all.iter().find(|formats| formats.words.name == name).unwrap()
}

/// Returns the number of fields of a CSV's line, respecting quotes.
fn fields(line: &str) -> usize {
    let mut quoted = false;
    1 + line
        .chars()
        .filter(|letter| {
            quoted ^= *letter == '"';
            *letter == ',' && !quoted
        })
        .count()
}

#[test]
fn whatever_is_measured_lies_within_what_is_proved() {
    for formats in all(100_000) {
        for row in &formats.rows {
            let (proved, Some(measured)) = (row.proved, row.measured) else { continue };
            if row.fate() == Fate::Wraps {
                continue;
            }
            let context = format!("{} {}: {measured:?} in {proved:?}", formats.words.name, proved.name);
            assert!(proved.min <= measured.min && measured.max <= proved.max, "{context}");
            assert!(measured.error <= proved.error, "{context}");
        }
    }
    const { assert!(POSTURES >= 1_000_000) };
}

#[test]
fn sines_are_exhausted_so_that_their_measured_range_is_the_proved_one() {
    let formats = Formats::new(words()[0], 0).unwrap();
    for row in &formats.rows[..6] {
        let measured = row.measured.unwrap();
        assert_eq!((measured.min, measured.max), (row.proved.min, row.proved.max), "{}", row.proved.name);
        // Half an LSB, and nearly all of it is reached among 8192 counts.
        let half = row.proved.format.lsb() / 2.0;
        assert!(measured.error <= half * (1.0 + 1e-6) && measured.error > 0.99 * half, "{measured:?}");
    }
}

#[test]
fn only_the_stiffness_of_plain_q22_wraps_and_only_beyond_what_it_holds() {
    let all = all(0);
    for formats in &all {
        let wrapping: Vec<_> =
            formats.rows.iter().filter(|row| row.fate() == Fate::Wraps).map(|row| row.proved.name).collect();
        let expected: &[&str] = if formats.words.name == "plain_q22" { &["stiffness"] } else { &[] };
        assert_eq!(wrapping, expected, "{}", formats.words.name);
        assert_eq!(formats.rows.len(), 23);
    }
    // 40 000 is 2^15.288: below the 2^16 of (0,16,2), beyond the 2^9 of (0,9,22).
    let headroom = |name| named(&all, name).row("stiffness").unwrap().headroom_bits();
    assert!((headroom("fitted") - (16.0 - 40_000f64.log2())).abs() < 1e-12);
    assert!((headroom("plain_q22") - (9.0 - 40_000f64.log2())).abs() < 1e-12);
    let soft = named(&all, "plain_q22_soft").words.stiffness_max_n_per_m;
    assert_eq!(soft, 512.0 - 1.0 / f64::from(1 << 22));
}

#[test]
fn forces_of_a_stiffness_that_has_wrapped_are_measured_as_far_off_as_they_can_be() {
    let all = all(20_000);
    let force = named(&all, "plain_q22").row("force_y").unwrap();
    // A multiple of 512 N/m wraps to nearly nothing, where the wall should push with all of 8.5 N.
    assert!(force.proved.error.is_infinite() && force.measured.unwrap().error > 7.0);
}

#[test]
fn a_line_below_the_tables_says_what_plain_q22_cannot_hold() {
    let all = all(0);
    let line = plain(&all).unwrap();
    // 40 000 = 78 * 512 + 64. The gain is 2^15 counts for 0.17 N.m * 7, in eighths.
    for words in
        ["cannot hold the stiffness", "511.9999998 N/m", "wraps to 64 N/m", "27536.1 counts", "15 integer bits"]
    {
        assert!(line.contains(words), "`{words}` is not in: {line}");
    }
    assert!((32_768f64 / (0.17 * 7.0) - 27_536.1).abs() < 0.1);
    let workspace = Workspace::new(&Config::default(), [10.0; 3], [1; 3]);
    assert!(formats_text(&all, &workspace, Notation::Triple).contains(&format!("\n\n{line}\n")));
    let fitting: Vec<_> = all.into_iter().filter(|formats| formats.words.name == "fitted").collect();
    assert_eq!(plain(&fitting), None);
}

#[test]
fn full_scales_are_those_of_the_motors_behind_their_ratios() {
    let near = |config: &Config, ratios: [f64; 3]| {
        for (scale_nm, ratio) in full_scales_nm(config).into_iter().zip(ratios) {
            // The gain's word is the nearest one.
            assert!((scale_nm / (0.17 * ratio) - 1.0).abs() < 1e-5, "{scale_nm} {ratio}");
        }
    };
    near(&Config::default(), [115.0 / 15.0, 7.0, 7.0]);
    near(&Config::premium_1_5(), [13.3, 11.2, 11.2]);
}

#[test]
fn every_row_of_a_csv_has_the_fields_of_its_header() {
    let all = all(0);
    for (csv, header, rows) in [
        (formats_csv(&all), FORMATS_CSV_HEADER, 5 * 23),
        (sines_csv(&sines().unwrap()), SINES_CSV_HEADER, 6 + 7 + 9 + 7),
    ] {
        assert!(csv.starts_with(header));
        assert_eq!(csv.lines().count(), 1 + rows);
        for line in csv.lines() {
            assert_eq!(fields(line), fields(header.trim_end()), "{line}");
        }
        assert!(!csv.contains("inf") && !csv.contains("NaN"));
    }
}

#[test]
fn a_box_about_the_neutral_tip_is_held_when_it_is_small_and_out_of_reach_when_it_is_large() {
    let config = Config::default();
    // 5 mm to the side are at most 5/140 rad in any joint, up to second order: 160 of the 1024 counts of 11 bits.
    let small = Workspace::new(&config, [10.0; 3], [5; 3]);
    assert_eq!((small.cells, small.unreachable), (125, 0));
    assert!(small.held.iter().all(|(_, held)| *held == 125) && small.missed_by == [0; 3]);
    // The middles are 3.3 m apart; the links are 0.28 m long.
    let large = Workspace::new(&config, [1e4; 3], [3; 3]);
    assert_eq!((large.cells, large.unreachable), (27, 26));
    assert!(large.held.iter().all(|(_, held)| *held == 1));
}

#[test]
fn cells_beyond_the_links_are_those_farther_from_the_shoulder_than_both() {
    let found = Workspace::new(&Config::default(), NOMINAL_MM, CELLS);
    let middle = |axis: usize, cell: u32| NOMINAL_MM[axis] * ((f64::from(cell) + 0.5) / f64::from(CELLS[axis]) - 0.5);
    let mut beyond = 0;
    for x in 0..CELLS[0] {
        for y in 0..CELLS[1] {
            for z in 0..CELLS[2] {
                // The shoulder is 140 mm above and 140 mm behind the neutral tip.
                let squares = middle(0, x).powi(2) + (middle(1, y) - 140.0).powi(2) + (middle(2, z) + 140.0).powi(2);
                beyond += u64::from(squares > 280f64.powi(2));
            }
        }
    }
    assert_eq!(found.unreachable, beyond);
    assert!(found.held.is_sorted_by_key(|(_, held)| *held));
    let (width, most) = *found.held.last().unwrap();
    // +-2^14 counts of 1/28000 turns are more than half a turn either way: no reachable cell is missed.
    assert_eq!((width, most), (15, found.cells - found.unreachable));
}

fn of(all: &[Sine], source: Source) -> Vec<&Sine> {
    all.iter().filter(|sine| sine.source == source).collect()
}

#[test]
fn the_full_table_is_off_by_half_an_lsb_at_any_size_and_no_other_is_better() {
    let all = sines().unwrap();
    for sine in &all {
        assert_eq!(sine.angles, 2 * 8192);
        assert!(sine.rms <= sine.worst && sine.worst_rad <= 1.5 * sine.worst, "{sine:?}");
        if sine.source == Source::Table {
            // 1e-6 is far above a float's own error of 2^-53, relative to the smallest LSB.
            assert!((0.49..0.5 + 1e-6).contains(&sine.worst_lsb()), "{sine:?}");
            // The errors of so many angles are spread evenly: 1/sqrt(12). Wide words have no smaller rms.
            assert!((sine.rms_lsb() - 12f64.sqrt().recip()).abs() < 0.01, "{sine:?}");
        } else {
            assert!(sine.worst_lsb() > 0.5, "{sine:?}");
        }
    }
}

#[test]
fn quarters_and_chords_keep_the_bounds_of_their_data_sheets() {
    let all = sines().unwrap();
    let lsb = 2f64.powi(-22);
    // The step is off by at most half of 2^-40 turns, times the farthest count.
    let step = std::f64::consts::TAU * 4096.0 * 2f64.powi(-41);
    for (width, sine) in (7..).zip(of(&all, Source::Quarter)) {
        let half_step = std::f64::consts::FRAC_PI_4 * 2f64.powi(-width);
        assert!(sine.worst <= 0.5 * lsb + half_step + step, "{sine:?}");
        assert!(sine.worst > 0.9 * half_step, "{sine:?}");
        assert_eq!(sine.rom.bits(), 22 << width);
    }
    for (width, sine) in (4..).zip(of(&all, Source::Interpolated)) {
        let chord = (std::f64::consts::FRAC_PI_2 * 2f64.powi(-width)).powi(2) / 8.0;
        let dropped = std::f64::consts::FRAC_PI_2 * 2f64.powi(-width - 14);
        assert!(sine.worst <= lsb + chord + dropped + step, "{sine:?}");
        assert!(sine.worst > 0.9 * chord, "{sine:?}");
        assert_eq!(sine.rom.words, 1 << width);
    }
}

#[test]
fn more_rotations_are_never_worse_and_need_no_rom() {
    let all = sines().unwrap();
    let rotations = of(&all, Source::Cordic);
    assert!(rotations.windows(2).all(|pair| pair[1].worst <= pair[0].worst));
    assert!(rotations.iter().all(|sine| sine.rom.bits() == 0));
    // Each rotation halves the remaining angle, down to the last place of the words.
    assert!(rotations[0].worst <= 2f64.powi(-11) + 2f64.powi(-22), "{:?}", rotations[0]);
}

#[test]
fn the_default_of_each_source_is_marked_and_is_that_of_its_block() {
    let all = sines().unwrap();
    let value = |generics: &[(&str, Generic)], name: &str| {
        let found = generics.iter().find(|(of, _)| *of == name).map(|(_, value)| *value);
        let Some(Generic::Integer(value)) = found else { panic!("{name}") };
        value
    };
    let size = |source| {
        let marked: Vec<_> = of(&all, source).into_iter().filter(|sine| sine.default).collect();
        assert_eq!(marked.len(), 1);
        marked[0].size.clone()
    };
    let table = TrigTable::default().generics();
    assert_eq!(size(Source::Table), format!("TRIG (1,{},{})", value(&table, "TRIG_INT"), value(&table, "TRIG_FRAC")));
    let quarter = TrigQuarter::default().generics();
    assert_eq!(size(Source::Quarter), format!("QUARTER_WIDTH {}", value(&quarter, "QUARTER_WIDTH")));
    let chords = TrigInterpolated::default().generics();
    let (width, rest) = (value(&chords, "QUARTER_WIDTH"), value(&chords, "REST_WIDTH"));
    assert_eq!(size(Source::Interpolated), format!("QUARTER_WIDTH {width}, REST_WIDTH {rest}"));
    let rotations = TrigCordic::default().generics();
    let (iterations, guard) = (value(&rotations, "ITERATIONS"), value(&rotations, "GUARD"));
    assert_eq!(size(Source::Cordic), format!("ITERATIONS {iterations}, GUARD {guard}"));
    for source in Source::ALL {
        assert!(sines_text(&all, Notation::Triple).contains(source.arithmetic()), "{}", source.name());
    }
}

#[test]
fn four_bits_of_fraction_are_worth_a_factor_of_sixteen() {
    let error = |label: &str| {
        let (_, config) = loop_variants().into_iter().find(|(of, _)| *of == label).unwrap();
        bounds(&config, 40_000.0).unwrap().iter().find(|row| row.name == "x").unwrap().error
    };
    let [coarse, middle, fine] = ["fraction_14", "fraction_18", "fraction_22"].map(error);
    // All terms are halves of an LSB times lengths; the lengths as words differ by some parts in 2^14.
    assert!((coarse / middle / 16.0 - 1.0).abs() < 1e-3 && (middle / fine / 16.0 - 1.0).abs() < 1e-3);
    let lengths = |label: &str| loop_variants().into_iter().find(|(of, _)| *of == label).unwrap().1.lengths;
    // 0.14 * 2^14 = 2293.76, 0.14 * 2^18 = 36700.16, 0.14 * 2^22 = 587202.56.
    assert_eq!(["fraction_14", "fraction_18", "fraction_22"].map(lengths), [[2294; 2], [36_700; 2], [587_203; 2]]);
}
