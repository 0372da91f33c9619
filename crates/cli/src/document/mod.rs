//! The HTML file around the parts of a report.

use std::fmt::Write as _;

use hpu_chart::web::{PLOT_CSS, PLOT_JS, ROWS_JS};
use hpu_cosim::printable_json;
use hpu_page::{Page, escaped};

/// A part of a report.
pub struct Section {
    /// The name of its place in the file.
    pub id: String,
    /// Its heading.
    pub title: String,
    /// Its contents: one, or two beside each other.
    pub beside: Vec<Content>,
}

/// The content of a part for one scene.
#[derive(Default)]
pub struct Content {
    /// The scene's name where two stand beside each other.
    pub of: String,
    /// The command that makes the part, or the place that it was taken from.
    pub by: String,
    /// The content as HTML.
    pub html: String,
}

impl Content {
    /// Returns the content that a command has made: its page, then its pictures as SVG.
    pub fn new(by: &str, page: &Page, pictures: &[String]) -> Self {
        let mut html: String = pictures.iter().map(|svg| picture(svg)).collect();
        html += &page.html();
        Self { of: String::new(), by: by.to_string(), html }
    }
}

/// Returns a picture in SVG as an image that the file contains.
pub fn picture(svg: &str) -> String {
    let name = svg.split_once("<title>").and_then(|(_, rest)| rest.split_once("</title>")).map_or("", |(name, _)| name);
    // The picture may be somebody else's; as an image its scripts do not run, and its title stays within the quotes.
    let name = name.replace('"', "&quot;");
    format!("<img class=\"picture\" alt=\"{name}\" src=\"data:image/svg+xml;base64,{}\">\n", base64(svg.as_bytes()))
}

/// Returns data for a script of the page.
pub fn data(id: &str, value: &serde_json::Value) -> String {
    let json = printable_json(&value.to_string()).replace('<', "\\u003c");
    format!("<script type=\"application/json\" id=\"{id}\">{json}</script>\n")
}

/// A report.
pub struct Document {
    /// Its title.
    pub title: String,
    /// The words below the title.
    pub about: String,
    /// Its parts.
    pub sections: Vec<Section>,
}

impl Document {
    /// Returns the file.
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n\
             <style>\n{PLOT_CSS}{}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n",
            include_str!("report.css")
        );
        for paragraph in self.about.split("\n\n").filter(|text| !text.trim().is_empty()) {
            let _ = writeln!(html, "<p>{}</p>", escaped(paragraph.trim()));
        }
        html += "</header>\n<nav aria-label=\"Parts\">\n<ul>\n";
        for Section { id, title, .. } in &self.sections {
            let _ = writeln!(html, "<li><a href=\"#{id}\">{}</a></li>", escaped(title));
        }
        html += "</ul>\n</nav>\n<main>\n";
        for Section { id, title, beside } in &self.sections {
            let _ = writeln!(html, "<section id=\"{id}\">\n<h2>{}</h2>", escaped(title));
            let class = if beside.len() > 1 { "beside" } else { "alone" };
            let _ = writeln!(html, "<div class=\"{class}\">");
            for Content { of, by, html: content } in beside {
                html += "<div>\n";
                if beside.len() > 1 && !of.is_empty() {
                    let _ = writeln!(html, "<h3>{}</h3>", escaped(of));
                }
                html += content;
                if !by.is_empty() {
                    let _ = writeln!(html, "<p class=\"by\">{}</p>", escaped(by));
                }
                html += "</div>\n";
            }
            html += "</div>\n</section>\n";
        }
        let _ = writeln!(html, "</main>\n<script>\n{PLOT_JS}\n{ROWS_JS}\n{}</script>", include_str!("report.js"));
        html + "</body>\n</html>\n"
    }
}

/// Returns bytes in the letters of base64.
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word = three.iter().fold(0u32, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - three.len()));
        for letter in 0..4 {
            let at = (word >> (18 - 6 * letter)) as usize & 63;
            text.push(if letter <= three.len() { char::from(LETTERS[at]) } else { '=' });
        }
    }
    text
}
