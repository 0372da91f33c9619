//! JUnit XML, as continuous-integration servers read it.

use std::fmt::Write as _;

use crate::report::CheckReport;

/// The report as one test suite, a test case each configuration and each closed loop.
#[must_use]
pub fn junit(report: &CheckReport) -> String {
    let failures = report.all().filter(|row| !row.ok()).count();
    let seconds: f64 = report.all().map(|row| row.seconds).sum();
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n\
         <testsuite name=\"hpu check\" tests=\"{}\" failures=\"{failures}\" errors=\"0\" time=\"{seconds:.3}\">\n",
        report.all().count()
    );
    for row in report.all() {
        let (block, variant) = (escape(&row.block), escape(&row.variant));
        write!(xml, "<testcase classname=\"{block}\" name=\"{variant}\" time=\"{:.3}\"", row.seconds)
            .expect("a string grows");
        if row.ok() {
            xml += "/>\n";
            continue;
        }
        let detail = match (&row.failure, &row.first) {
            (Some(failure), _) => failure.clone(),
            (None, Some(first)) => first.to_string(),
            (None, None) => "nothing was compared".to_string(),
        };
        let brief = escape(detail.trim().lines().next().unwrap_or(""));
        writeln!(xml, "><failure message=\"{brief}\">{}</failure></testcase>", escape(&detail))
            .expect("a string grows");
    }
    xml + "</testsuite>\n</testsuites>\n"
}

/// Text for XML 1.0: its five special characters as entities; control characters, which it cannot say, as `?`.
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
            control if control < ' ' || matches!(control, '\u{fffe}' | '\u{ffff}') => escaped.push('?'),
            plain => escaped.push(plain),
        }
    }
    escaped
}
