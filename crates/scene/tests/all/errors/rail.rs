//! Masses on a rail: encoder, amplifier and shaper; and walls that change.

use super::{GOOD, parse, refused, says};

/// Returns the good scene with a mass in words.
fn on_rail() -> String {
    let mass = "kind = \"mass\"\nmass = \"75 g\"\ndamping = 0.005\n[encoder]\nresolution = \"29.1 um\"\n[amplifier]\n\
                full_scale = \"10 N\"";
    GOOD.replace("kind = \"motor\"", mass).replace("1.5 rad", "2 cm").replace("1.5 N.m/rad", "1 N/mm")
}

#[test]
fn a_mass_in_words_says_its_resolution_and_its_force() {
    let rail = on_rail();
    let scene = parse(&rail, &[]).unwrap();
    assert_eq!(scene.encoder.count_rad(), 29.1e-6);
    assert_eq!(scene.amplifier.unwrap().full_scale_n, 10.0);
    let spoiled = |from: &str, to: &str| {
        assert_eq!(rail.matches(from).count(), 1, "{from}");
        parse(&rail.replace(from, to), &[]).expect_err(to)
    };
    says(
        spoiled("resolution = \"29.1 um\"", ""),
        "6:1: encoder.resolution: missing; write a length as m, mm, cm or a number in m",
    );
    says(
        spoiled("resolution = \"29.1 um\"", "lines = 1024"),
        "7:1: encoder.lines: unknown key; accepted here: resolution",
    );
    says(spoiled("29.1 um", "0 m"), "7:14: encoder.resolution: `0 m` must be above zero");
    says(
        spoiled("full_scale = \"10 N\"", ""),
        "8:1: amplifier.full_scale: missing; write a force as N, mN or a number in N",
    );
    says(
        spoiled("10 N", "10 N.m"),
        "9:14: amplifier.full_scale: `10 N.m` is not a force: write N, mN or a number in N",
    );
    says(
        spoiled("[clock]", "[bridge]\nsupply = 12\n[clock]"),
        "10:1: bridge: a mass has a force amplifier and no bridge; write [amplifier]",
    );
    says(
        spoiled("[clock]", "[model]\nbridge = \"averaged\"\n[clock]"),
        "11:10: model.bridge: a mass has a force amplifier and no bridge; leave this out",
    );
    says(
        refused("[clock]", "[amplifier]\nfull_scale = 1\n[clock]"),
        "4:1: amplifier: a motor hangs on a bridge; write [bridge], or device.kind = \"mass\"",
    );
    says(
        refused("[clock]", "[encoder]\nresolution = 1e-5\n[clock]"),
        "5:1: encoder.resolution: unknown key; accepted here: part, lines",
    );
    // Its words are refused with its own units: 4095 counts per count are 4095 / 4096 of 10 N / 29.1 um.
    let said = parse(&rail, &[("wall.stiffness", "1000 N/mm")]).unwrap_err();
    assert!(said.contains("1000000 N/m does not fit (0,12,0); write at most 343558.7"), "{said}");
}

#[test]
fn a_shaper_has_a_cutoff_and_holds_for_a_clock_at_least() {
    let with = |keys: &str| parse(&on_rail(), &[("amplifier.shaper", keys)]);
    let shaper = with("{ cutoff = \"2.5 Hz\" }").unwrap().amplifier.unwrap().shaper.unwrap();
    assert_eq!((shaper.cutoff_hz, shaper.hold_s), (2.5, 1e-6));
    let refused = |keys: &str, expected: &str| {
        assert_eq!(with(keys).unwrap_err(), format!("--set amplifier.shaper={keys}: amplifier.shaper{expected}"));
    };
    refused("{}", ".cutoff: missing; write a frequency as Hz, MHz or a number in Hz");
    refused("{ cutoff = 0 }", ".cutoff: `0` must be above zero");
    refused("{ cutoff = 2.5, hold = \"5 ns\" }", ".hold: less than half a clock; write at least 2e-8 s");
    refused("{ cutoff = 2.5, order = 2 }", ".order: unknown key; accepted here: cutoff, hold");
    refused("3", ": a section is expected; write [amplifier.shaper]");
}

#[test]
fn a_ramp_of_the_wall_has_an_end_that_fits_and_takes_time() {
    let with = |keys: &str| parse(GOOD, &[("wall.ramp", keys)]);
    let ramp = with("{ stiffness = 2, from = \"200 ms\", to = 0.5 }").unwrap().wall.ramp.unwrap();
    assert_eq!((ramp.stiffness_nm_per_rad, ramp.scale, ramp.from_s, ramp.to_s), (Some(2.0), None, 0.2, 0.5));
    let refused = |keys: &str, expected: &str| {
        assert_eq!(with(keys).unwrap_err(), format!("--set wall.ramp={keys}: wall.ramp{expected}"));
    };
    refused("{ stiffness = 2, to = 1 }", ".from: missing; write a time as s, ms, min or a number in s");
    refused(
        "{ from = 0, to = 1 }",
        ".stiffness: missing; write a torsional stiffness as N.m/rad, mN.m/rad, N.m/deg or a number in N.m/rad",
    );
    refused("{ stiffness = 2, from = 1, to = 1 }", ".to: 1 s is no clock after from, 1 s");
    refused("{ stiffness = 2, from = 1, to = \"1000.000001 ms\" }", ".to: 1.000000001 s is no clock after from, 1 s");
    refused(
        "{ scale = 40, from = 0, to = 1 }",
        ".scale: \"hybrid\" does not scale its force, \"passive_spring\" does; write stiffness instead",
    );
    refused("{ damping = 1 }", ".damping: unknown key; accepted here: stiffness, scale, from, to");
    let said = with("{ stiffness = 200, from = 0, to = 1 }").unwrap_err();
    assert!(said.contains("wall.ramp.stiffness: 200 N.m/rad does not fit (0,12,0); write at most 172.7"), "{said}");
    let said = parse(GOOD, &[("wall.ramp", "{ stiffness = 2, from = 0, to = 1 }"), ("model.datapath", "linear")]);
    assert!(said.unwrap_err().contains("wall.ramp: the linear law has one wall; write model.datapath = \"words\""));
}
