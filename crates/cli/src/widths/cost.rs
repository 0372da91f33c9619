//! The cost of one more bit of each width, by Yosys alone.

use std::num::NonZeroUsize;

use hpu_cosim::scene::Experiment;
use hpu_cosim::{Wired, WiredSimulation};
use hpu_rtl::{Cache, Counts, Setup};
use hpu_study::device;
use hpu_study::widths::Field;

use crate::price::syntheses;
use crate::shell::{Failure, interrupt, or_reason};

/// LUT4 and flip-flops that one more bit of a width costs in the whole loop, or the reason why there is no such loop.
pub(crate) type OneMore = Result<[i64; 2], String>;

/// Returns the cost of one more bit for every width of an axis's scene; `None` when interrupted.
pub(crate) fn one_more(
    experiment: &Experiment,
    setup: &Setup,
    cache: &Cache,
    jobs: NonZeroUsize,
) -> Result<Option<Vec<(Field, OneMore)>>, Failure> {
    let simulation = WiredSimulation::new(experiment).map_err(Failure::file)?;
    let now = cache.counts(simulation.wiring().block(), setup)?;
    let fields = device(experiment).fields();
    let counts = |field: Field| -> Result<Result<Counts, String>, Failure> {
        let more = match field.with(experiment, field.bits(experiment) + 1) {
            Ok(more) => more,
            Err(why) => return Ok(Err(why.to_string())),
        };
        match WiredSimulation::new(&more) {
            Ok(simulation) => or_reason(cache.counts(simulation.wiring().block(), setup)),
            Err(error) => Ok(Err(error.to_string())),
        }
    };
    let one = |field: Field| Ok((field, counts(field)?.map(|more| difference(&more, &now))));
    let control = interrupt::heed();
    let found = syntheses(fields.len(), jobs, control, |index| one(fields[index]));
    // A tool that was killed by the interruption has no result, so its missing price is no reason to show.
    if interrupt::pressed() { Ok(None) } else { found.into_iter().flatten().collect::<Result<_, _>>().map(Some) }
}

fn difference(more: &Counts, now: &Counts) -> [i64; 2] {
    let less = |a: u64, b: u64| a.cast_signed() - b.cast_signed();
    [less(more.lut4, now.lut4), less(more.ff, now.ff)]
}
