//! What one bit more of each width would cost, by Yosys alone.

use std::path::Path;

use hpu_cosim::scene::Experiment;
use hpu_cosim::{Ready, Rig};
use hpu_rtl::{Cache, Counts};
use hpu_study::widths::Field;

use crate::cost::refused;
use crate::exit::Failure;
use crate::interrupt;
use crate::terminal::with_progress;
use crate::widths_price::on_all_cores;

/// LUT4 and flip-flops that one bit more of a width costs in the whole loop, or why there is no such loop.
pub type OneMore = Result<[i64; 2], String>;

/// One bit more of every width of an axis's scene; `None` when interrupted.
pub fn one_more(experiment: &Experiment, hdl: &Path, cache: &Cache) -> Result<Option<Vec<(Field, OneMore)>>, Failure> {
    let ready = Ready::new(experiment).map_err(Failure::file)?;
    let now = cache.counts(ready.wiring().block(), hdl).map_err(refused)?;
    let fields = Field::all(experiment);
    let one = |field: Field| {
        let more = field.with(experiment, field.bits(experiment) + 1).and_then(|more| {
            let ready = Ready::new(&more).map_err(|error| error.to_string())?;
            cache.counts(ready.wiring().block(), hdl).map_err(|error| error.to_string())
        });
        (field, more.map(|more| difference(&more, &now)))
    };
    let control = interrupt::heed();
    let found = with_progress(fields.len() as u64, "syntheses", control, || {
        on_all_cores(fields.len(), control, |index| one(fields[index]))
    });
    // What was killed half-way has no price, but for no reason of its own.
    Ok(if interrupt::pressed() { None } else { found.into_iter().collect() })
}

fn difference(more: &Counts, now: &Counts) -> [i64; 2] {
    let less = |a: u64, b: u64| a.cast_signed() - b.cast_signed();
    [less(more.lut4, now.lut4), less(more.ff, now.ff)]
}
