//! The messages of Verilog, and its ends of the run, while it is simulated.

/// System functions that only compute, and tasks that only give memories their first words.
const SILENT: [&str; 12] = [
    "$signed",
    "$unsigned",
    "$clog2",
    "$bits",
    "$size",
    "$high",
    "$low",
    "$left",
    "$right",
    "$readmemh",
    "$readmemb",
    "$countones",
];
/// Keywords of assertions.
const CLAIMS: [&str; 6] = ["assert", "assume", "cover", "property", "sequence", "final"];

/// Returns the first system task or assertion in the code of a file that another simulator would hear.
pub(super) fn first(verilog: &str) -> Option<String> {
    let code = without_comments(verilog);
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '$';
    let mut words = code.split(|c: char| !is_word(c)).filter(|word| !word.is_empty());
    let is_heard = |word: &&str| {
        let is_task = word.starts_with('$') && word.len() > 1;
        is_task && !SILENT.contains(word) || CLAIMS.contains(word)
    };
    words.find(is_heard).map(str::to_string)
}

/// Returns Verilog without comments and texts.
fn without_comments(verilog: &str) -> String {
    let (mut code, mut rest) = (String::with_capacity(verilog.len()), verilog);
    while let Some(at) = rest.find(['/', '"']) {
        code += &rest[..at];
        rest = &rest[at..];
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.find("*/").map_or(rest.len(), |end| end + 4)
        } else if let Some(text) = rest.strip_prefix('"') {
            let mut is_escaped = false;
            let end = text.find(|c| {
                let ends = c == '"' && !is_escaped;
                is_escaped = c == '\\' && !is_escaped;
                ends
            });
            end.map_or(rest.len(), |end| end + 2)
        } else {
            code.push('/');
            1
        };
        code.push(' ');
        rest = &rest[length..];
    }
    code + rest
}

#[cfg(test)]
mod tests {
    use super::first;

    #[test]
    fn messages_and_assertions_are_found_in_code_alone() {
        for (verilog, found) in [
            ("assign y = $signed(a) / b; // $display\n", None),
            ("/* assert */ initial $readmemh(\"a // $finish.hex\", m);", None),
            ("wire [$clog2(N)-1:0] asserted = a / 2;", None),
            ("initial s = \"\\\" $stop\"; always @(posedge clk) $display(\"%d\", a);", Some("$display")),
            ("// a\nassert property (a);", Some("assert")),
            ("if (a / b) $finish;", Some("$finish")),
        ] {
            assert_eq!(first(verilog).as_deref(), found, "{verilog}");
        }
    }
}
