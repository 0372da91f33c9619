//! `hpu keys`: every key of a scene, its unit, default, range and meaning.

mod schema;

use std::collections::HashSet;

use hpu_cosim::did_you_mean;
use hpu_cosim::scene::keys::{KeyRow, Otherwise, Takes, grouped, markdown, rows};
use hpu_cosim::scene::{NamedPart, parts};
use hpu_page::{Cell, Column, Field, Page, Table, as_json};
use schema::schema;
use serde_json::Value;

use crate::page::show;
use crate::shell::{Exit, Failure, print_file, print_json};

/// List the keys of a scene: unit, default, accepted values and meaning
///
/// For an editor that checks scenes while they are written: `hpu keys --schema > scene.schema.json`, and
/// `#:schema scene.schema.json` as the first line of a scene.
#[derive(clap::Args)]
pub struct Args {
    /// Section, as in `device` or `method.pwm`, or a word of keys and their meanings, as in `friction` [default: all]
    word: Option<String>,
    /// Print the keys as one JSON object
    #[arg(long)]
    json: bool,
    /// Print a JSON Schema of scenes (draft 2020-12)
    #[arg(long, conflicts_with_all = ["json", "word"])]
    schema: bool,
    /// Print the tables of the documentation, in Markdown
    #[arg(long, conflicts_with_all = ["json", "word", "schema"])]
    markdown: bool,
}

/// `hpu keys`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    if args.markdown {
        print_file(&markdown())?;
        return Ok(Exit::Fine);
    }
    if args.schema {
        print_json(&schema())?;
        return Ok(Exit::Fine);
    }
    let meant = |part: &&NamedPart| args.word.as_deref().is_some_and(|word| is_meant(part, word));
    let parts: Vec<&NamedPart> = parts().filter(meant).collect();
    let found = match matching(args.word.as_deref()) {
        Err(_) if !parts.is_empty() => Vec::new(),
        found => found?,
    };
    let mut page = Page::default();
    page.data("keys", as_data(&found));
    for (index, group) in grouped(found.into_iter()).into_iter().enumerate() {
        let heading = group.first().map_or(String::new(), |row| row.heading().replace('`', ""));
        page.note(if index > 0 { format!("\n{heading}") } else { heading });
        page.table(Table::of("", &group, fields()));
    }
    if !parts.is_empty() {
        page.note("\nParts, by their names");
        page.table(Table::of("parts", &parts, of_part()));
    }
    show(&page, args.json)?;
    Ok(Exit::Fine)
}

/// Returns whether a word means a part: all of them, those of its kind, or its name or maker.
fn is_meant(part: &NamedPart, word: &str) -> bool {
    ["part", "parts", part.kind].contains(&word) || has_word(part.name, word) || has_word(part.about(), word)
}

/// Returns the columns of parts. In text, figures and source stand below each name.
fn of_part() -> [Field<'static, &'static NamedPart>; 8] {
    let missing = |part: &&NamedPart| {
        let all = part.not_given().join(", ");
        if all.is_empty() { all } else { format!("; not given: {all}") }
    };
    [
        Column::text("kind", "")
            .least(12)
            .of(|part: &&'static NamedPart| Cell::new(part.kind).shown(format!("  {}", part.kind))),
        Column::text("name", "").least(24).of(|part: &&'static NamedPart| part.name),
        Column::text("about", "").of(|part: &&'static NamedPart| part.about()),
        Column::text("figures", "").data().of(|part: &&'static NamedPart| part.figures()),
        Column::text("not_given", "").data().of(|part: &&'static NamedPart| part.not_given()),
        Column::text("source", "").data().of(|part: &&'static NamedPart| part.source()),
        Column::text("date", "").data().of(|part: &&'static NamedPart| part.date()),
        Column::text("", "").said().of(move |part: &&'static NamedPart| {
            let figures = part.figures().join(", ");
            format!("\n      {figures}{}\n      {}; {}", missing(part), part.source(), part.date())
        }),
    ]
}

/// Returns keys as JSON.
pub(crate) fn as_data(found: &[KeyRow]) -> Value {
    Table::of("", found, fields()).json()
}

/// Returns all keys, those of the section of this name, or else those with this word in their name or meaning.
///
/// # Errors
///
/// The sections that there are, and the nearest name, when the word finds no key.
pub fn matching(word: Option<&str>) -> Result<Vec<KeyRow>, Failure> {
    let Some(word) = word else { return Ok(rows().collect()) };
    let mut sections: Vec<_> = rows().map(|row| row.section).filter(|name| !name.is_empty()).collect();
    let mut seen = HashSet::new();
    sections.retain(|name| seen.insert(*name));
    if sections.contains(&word) {
        return Ok(rows().filter(|row| row.section == word).collect());
    }
    let has = |row: &KeyRow| has_word(&format!("{}.{} {}", row.section, row.key, row.meaning), word);
    let found: Vec<_> = rows().filter(has).collect();
    if found.is_empty() {
        let names: Vec<_> = sections.iter().copied().chain(rows().map(|row| row.key)).collect();
        let (near, all) = (did_you_mean(word, &names), sections.join(", "));
        return Err(Failure::usage(format!("no key has `{word}` in its name or meaning; sections are {all}{near}")));
    }
    Ok(found)
}

/// Returns whether a text has a word, or a part of one, in large or small letters.
pub fn has_word(text: &str, word: &str) -> bool {
    text.to_lowercase().contains(&word.to_lowercase())
}

/// Returns the columns of keys. In text, the meaning stands below each key.
fn fields() -> [Field<'static, KeyRow>; 11] {
    let default = |row: &KeyRow| match &row.otherwise {
        Otherwise::Is(value) => as_json(value),
        Otherwise::Required | Otherwise::Said(_) => Value::Null,
    };
    let options = |row: &KeyRow| match &row.takes {
        Takes::Choice(names) | Takes::Names(names) => Some(names.clone()),
        _ => None,
    };
    [
        Column::text("section", "").data().of(|row: &KeyRow| row.section),
        Column::text("key", "").least(22).of(|row: &KeyRow| Cell::new(row.key).shown(format!("  {}", row.key))),
        Column::text("kinds", "").data().of(|row: &KeyRow| row.kinds),
        Column::text("unit", "").least(12).of(|row: &KeyRow| row.unit()),
        Column::flag("required", "").data().of(|row: &KeyRow| row.otherwise == Otherwise::Required),
        Column::text("default", "").data().of(default),
        Column::text("default_text", "").least(10).of(|row: &KeyRow| row.default()),
        Column::text("accepted", "").of(|row: &KeyRow| row.accepted()),
        Column::text("options", "").data().of(options),
        Column::text("meaning", "").data().of(|row: &KeyRow| row.meaning),
        Column::text("", "").said().of(|row: &KeyRow| format!("\n      {}", row.meaning)),
    ]
}
