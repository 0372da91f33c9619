//! `hpu keys`: every key of a scene, its unit, default, range and meaning.

mod schema;

use std::fmt::Write as _;

use hpu_cosim::did_you_mean;
use hpu_cosim::scene::keys::{Otherwise, Row, Takes, grouped, markdown, rows};
use serde_json::{Value, json};

use crate::columns::{Column, aligned};
use crate::exit::{Exit, Failure};
use crate::parameters::as_json;
use crate::terminal::{print, print_json};

use schema::schema;

/// List the keys of a scene: unit, default, accepted values and meaning
///
/// For an editor that checks scenes while they are written: `hpu keys --schema > scene.schema.json`, and
/// `#:schema scene.schema.json` as the first line of a scene.
#[derive(clap::Args)]
pub struct Args {
    /// Section, as in `device`, `method` or `method.pwm` [default: all]
    section: Option<String>,
    /// Print the keys as one JSON object
    #[arg(long)]
    json: bool,
    /// Print a JSON Schema of scenes (draft 2020-12)
    #[arg(long, conflicts_with_all = ["json", "section"])]
    schema: bool,
    /// Print the tables of the documentation, in Markdown
    #[arg(long, conflicts_with_all = ["json", "section", "schema"])]
    markdown: bool,
}

/// `hpu keys`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    if args.markdown {
        print(&markdown())?;
        return Ok(Exit::Fine);
    }
    if args.schema {
        print_json(&schema())?;
        return Ok(Exit::Fine);
    }
    let mut found: Vec<Row> = rows().collect();
    if let Some(section) = &args.section {
        let mut names: Vec<_> = found.iter().map(|row| row.section).filter(|name| !name.is_empty()).collect();
        names.dedup();
        if !names.contains(&section.as_str()) {
            let near = did_you_mean(section, &names);
            return Err(Failure::usage(format!("no section `{section}`; there are {}{near}", names.join(", "))));
        }
        found.retain(|row| row.section == section);
    }
    if args.json {
        print_json(&json!({ "keys": found.iter().map(object).collect::<Vec<_>>() }))?;
    } else {
        let groups = grouped(found.into_iter());
        print(&groups.iter().map(|group| text(group)).collect::<Vec<_>>().join("\n"))?;
    }
    Ok(Exit::Fine)
}

/// Returns the keys of a section that the same kinds take: a line for each key, with its meaning below.
fn text(group: &[Row]) -> String {
    let mut text = group.first().map_or(String::new(), |row| format!("{}\n", row.heading().replace('`', "")));
    let cells = group.iter().map(|row| [row.key.to_string(), row.unit(), row.default()]).collect();
    for (row, cells) in group.iter().zip(aligned([Column::Left(20), Column::Left(12), Column::Left(10)], cells)) {
        let line = format!("  {}  {}", cells.join("  "), row.accepted());
        let _ = writeln!(text, "{}\n      {}", line.trim_end(), row.meaning);
    }
    text
}

fn object(row: &Row) -> Value {
    let default = match &row.otherwise {
        Otherwise::Is(value) => as_json(value),
        Otherwise::Required | Otherwise::Said(_) => Value::Null,
    };
    let options = match &row.takes {
        Takes::Choice(names) | Takes::Names(names) => json!(names),
        _ => Value::Null,
    };
    json!({
        "section": row.section,
        "key": row.key,
        "kinds": row.kinds,
        "unit": row.unit(),
        "required": row.otherwise == Otherwise::Required,
        "default": default,
        "default_text": row.default(),
        "accepted": row.accepted(),
        "options": options,
        "meaning": row.meaning,
    })
}
