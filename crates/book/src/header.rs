//! The header of a block's VHDL, which is its data sheet, and its text as Markdown.

/// A header in its parts.
pub struct Header {
    /// The purpose, in a few words.
    pub purpose: String,
    /// The equations, with the prose and the drawing between them, line by line as written.
    pub equations: String,
    /// The lines about the generics as written; empty if there are none.
    pub generics: String,
    /// The latency.
    pub latency: String,
    /// The state after a reset.
    pub reset: String,
    /// The treatment of results that do not fit.
    pub overflow: String,
    /// The source of the equations.
    pub source: String,
    /// The differences from the hardware.
    pub differs: String,
}

/// The labels of a header in their order. Each begins in the first column of a line and goes on in lines that are
/// indented.
const LABELS: [&str; 8] = ["generics", "in", "out", "latency", "reset", "overflow", "source", "differs"];

/// Returns the label with which a line begins.
fn label(line: &str) -> Option<&'static str> {
    LABELS.into_iter().find(|label| line.strip_prefix(label).is_some_and(|rest| rest.starts_with(' ')))
}

impl Header {
    /// Reads the header of VHDL; `None` when a part is missing.
    pub fn read(vhdl: &str) -> Option<Self> {
        let lines = vhdl.lines().map_while(|line| line.strip_prefix("--"));
        let mut lines = lines.map(|line| line.strip_prefix(' ').unwrap_or(line)).peekable();
        let (_, purpose) = lines.next()?.split_once(" : ")?;
        let mut purpose = purpose.to_string();
        while let Some(more) = lines.next_if(|line| !line.is_empty()) {
            purpose += &format!(" {}", more.trim());
        }
        let equations: Vec<&str> = std::iter::from_fn(|| lines.next_if(|line| label(line).is_none())).collect();
        let mut parts: [Vec<&str>; LABELS.len()] = Default::default();
        let mut at = None;
        for line in lines {
            at = label(line).and_then(|found| LABELS.iter().position(|known| *known == found)).or(at);
            parts[at?].push(line);
        }
        let flowing = |name: &str| {
            let words = parts[LABELS.iter().position(|known| *known == name)?].iter().flat_map(|line| line.split(' '));
            let text = words.filter(|word| !word.is_empty()).skip(1).collect::<Vec<_>>().join(" ");
            (!text.is_empty()).then_some(text)
        };
        let equations = equations.join("\n");
        Some(Self {
            purpose,
            equations: equations.trim_matches('\n').to_string(),
            generics: parts[0].join("\n").replacen("generics", "        ", 1).trim_end().to_string(),
            latency: flowing("latency")?,
            reset: flowing("reset")?,
            overflow: flowing("overflow")?,
            source: flowing("source")?,
            differs: flowing("differs")?.strip_prefix("from the hardware: ")?.to_string(),
        })
    }
}

/// Returns text for a paragraph or a cell of a table.
pub fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('*', "\\*").replace('_', "\\_").replace('[', "\\[").replace('<', "&lt;")
}

/// Returns lines without the spaces that all of them begin with.
pub fn unindented(text: &str) -> String {
    let full = || text.lines().filter(|line| !line.trim().is_empty());
    let spaces = full().map(|line| line.len() - line.trim_start().len()).min().unwrap_or(0);
    text.lines().map(|line| line.get(spaces..).unwrap_or("")).collect::<Vec<_>>().join("\n")
}
