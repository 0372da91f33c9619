//! JUnit XML is well formed, whatever text comes from a testbench or GHDL.

use hpu_rtl::{Around, CheckReport, CheckRow, Column, ComparedRow, Coverage, Mismatch, junit};
use hpu_signal::{Clock, Format};

fn row(variant: &str, first: Option<Mismatch>, failure: Option<&str>) -> CheckRow {
    CheckRow {
        block: "pwm".to_string(),
        variant: variant.to_string(),
        vectors: 100,
        edges: 100,
        mismatches: u64::from(first.is_some()),
        first,
        contact: None,
        coverage: Coverage::default(),
        failure: failure.map(str::to_string),
        seconds: 0.25,
    }
}

#[test]
fn a_report_is_a_suite_with_a_case_a_configuration_and_special_characters_as_entities() {
    let first = Mismatch {
        row: 7,
        signal: "a_high".to_string(),
        expected: "1 (1)".to_string(),
        got: "U".to_string(),
        around: Around {
            name: "pwm",
            beside: "<vhdl>",
            counted: "row",
            columns: vec![Column { name: "a_high", format: Format::BIT, unit: "1" }],
            inputs: 0,
            clock: Clock::new(1_000_000).expect("a clock"),
            rows: vec![ComparedRow { number: 7, expected: vec!["1".to_string()], got: vec!["\"<&>'".to_string()] }],
        },
    };
    let report = CheckReport {
        rows: vec![row("default", None, None), row("8_bit", Some(first), None)],
        loops: vec![row("hybrid-wall", None, Some("ghdl: <bound check> & \u{7}"))],
    };
    assert!(!report.ok());
    let expected = "\
<?xml version=\"1.0\" encoding=\"UTF-8\"?>
<testsuites>
<testsuite name=\"hpu check\" tests=\"3\" failures=\"2\" errors=\"0\" time=\"0.750\">
<testcase classname=\"pwm\" name=\"default\" time=\"0.250\"/>
<testcase classname=\"pwm\" name=\"8_bit\" time=\"0.250\">\
<failure message=\"first at 7: a_high expected 1 (1), got U\">  \
first at 7: a_high expected 1 (1), got U
    row  a_high  a_high(&lt;vhdl&gt;)
    7    1       &quot;&lt;&amp;&gt;&apos;
</failure></testcase>
<testcase classname=\"pwm\" name=\"hybrid-wall\" time=\"0.250\"><failure message=\"ghdl: &lt;bound check&gt; &amp; ?\">\
ghdl: &lt;bound check&gt; &amp; ?</failure></testcase>
</testsuite>
</testsuites>
";
    assert_eq!(junit(&report), expected);
}

#[test]
fn a_report_of_nothing_is_not_fine() {
    assert!(!CheckReport::default().ok());
    let nothing = CheckRow { vectors: 0, ..row("default", None, None) };
    assert!(!CheckReport { rows: vec![nothing], loops: vec![] }.ok());
}
