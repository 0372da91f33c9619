//! The keys as the tables of the documentation.

/// The tables of all sections, in Markdown.
pub fn markdown() -> String {
    String::new()
}
