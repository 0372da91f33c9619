//! The work of a sweep, by the verb that its points belong to.

use hpu_papers::phantom::{LADDER, TABLE_2};

use crate::answers::read_words;
use crate::map::{Args as MapArgs, Cells};
use crate::reproduce::drop::{Name, Trials};
use crate::shell::Failure;
use crate::study::Lines;
use crate::widths::Args as WidthsArgs;
use crate::work::{Find, Work};

/// The sections of a study whose points a sweep can split.
pub(crate) const SECTIONS: [&str; 4] = ["map", "widths", TABLE_2, LADDER];

/// The lines of a study, as another section of it.
pub const LINES: &str = "lines";

/// Returns everything that a sweep can split.
pub(crate) fn splittable() -> String {
    format!("{} or {LINES}", SECTIONS.join(", "))
}

/// Returns the work of a section or, of `study`, of the lines, whose words are name and text. `find` returns a scene by
/// its name.
pub fn work(verb: &str, words: &[String], find: Find) -> Result<Box<dyn Work>, Failure> {
    Ok(match (verb, words) {
        ("map", _) => Box::new(Cells::new(read_words::<MapArgs>("map", words)?, find)?),
        ("widths", _) => Box::new(read_words::<WidthsArgs>("widths", words)?.waves(find)?),
        (TABLE_2, _) => Box::new(Trials::new(Name::Table2, words, &find)?),
        (LADDER, _) => Box::new(Trials::new(Name::Ladder, words, &find)?),
        ("study", [name, text]) => Box::new(Lines::new(name, text, find)?),
        _ => return Err(Failure::usage(format!("a sweep cannot split `{verb}`, but {}", splittable()))),
    })
}
