//! JUnit XML for continuous-integration servers.

use std::fmt::Write as _;

use crate::vectors::report::{CheckReport, CheckRow};

/// A test case.
#[derive(Clone, PartialEq, Debug)]
pub struct Case {
    /// The subject of the test, as the class name of the test case.
    pub class: String,
    /// The name of the test case.
    pub name: String,
    /// Seconds taken.
    pub seconds: f64,
    /// Why it failed, if it did.
    pub failure: Option<String>,
}

/// Returns the report as one test suite. Each configuration and each closed loop is a test case.
pub fn junit(report: &CheckReport) -> String {
    let case = |row: &CheckRow| {
        let failure = match (&row.failure, &row.first) {
            _ if row.ok() => None,
            (Some(failure), _) => Some(failure.clone()),
            (None, Some(first)) => Some(first.to_string()),
            (None, None) => Some("nothing was compared".to_string()),
        };
        Case { class: row.block.clone(), name: row.variant.clone(), seconds: row.seconds, failure }
    };
    junit_suite("hpu check", &report.all().map(case).collect::<Vec<_>>())
}

/// Returns test cases as one suite.
pub fn junit_suite(name: &str, cases: &[Case]) -> String {
    let failures = cases.iter().filter(|case| case.failure.is_some()).count();
    let seconds: f64 = cases.iter().map(|case| case.seconds).sum();
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n\
         <testsuite name=\"{}\" tests=\"{}\" failures=\"{failures}\" errors=\"0\" time=\"{seconds:.3}\">\n",
        escape(name),
        cases.len()
    );
    for Case { class, name, seconds, failure } in cases {
        let (class, name) = (escape(class), escape(name));
        write!(xml, "<testcase classname=\"{class}\" name=\"{name}\" time=\"{seconds:.3}\"").expect("a string grows");
        let Some(detail) = failure else {
            xml += "/>\n";
            continue;
        };
        let brief = escape(detail.trim().lines().next().unwrap_or(""));
        writeln!(xml, "><failure message=\"{brief}\">{}</failure></testcase>", escape(detail)).expect("a string grows");
    }
    xml + "</testsuite>\n</testsuites>\n"
}

/// Escapes text for XML 1.0: the five special characters become entities; control characters, most of which XML cannot
/// hold, become `?`.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&apos;",
            '\n' | '\t' => escaped.push(character),
            control if control.is_control() || matches!(control, '\u{fffe}' | '\u{ffff}') => escaped.push('?'),
            plain => escaped.push(plain),
        }
    }
    escaped
}
