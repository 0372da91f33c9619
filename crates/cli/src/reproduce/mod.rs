//! `hpu reproduce`: runs a published study again.

mod cost;
pub mod drop;
mod words;

use std::path::Path;

use clap::Subcommand;
use hpu_papers::phantom::{COST, FORMATS, LADDER, SINES, TABLE_2};
use hpu_papers::studies::shipped;

use crate::shell::{Exit, Failure};
use drop::Name;

/// Run a published study again and hold it against what was printed
///
/// `phantom-table-2` is the drop test of Sevcik et al. (2009), its Table 2; `phantom-ladder` is the same from ever more
/// of the physics; the others look at the words, the sines and the cost of its datapath. With a folder, each trial is
/// kept as it is done, and each synthesis is remembered as those of `hpu cost`: the same command goes on after an
/// interruption. A study of a paper ends with a summing-up: each claim in the paper's words, and whether it is
/// confirmed, not confirmed, or cannot be told. A claim that is not confirmed is a result and no failure; a trial that
/// cannot be run is one.
///
/// In phantom-table-2 and phantom-ladder a cell near a boundary of stability is run at several seeds (--seeds), where
/// one draw does not decide it: a claim may then be met in k of n seeds. All other cells are run at one.
///
/// phantom-table-2 takes about three minutes on two cores, and so does phantom-ladder with `--axes y --trials 1`;
/// with all axes and trials it takes many times that, and `hpu sweep` runs the trials of both in shards. phantom-lag
/// takes one or two, phantom-cost many: each synthesis takes up to a few, a core and up to a gigabyte.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    study: Study,
}

#[derive(Subcommand)]
enum Study {
    /// Table 2 of Sevcik et al. (2009)
    #[command(name = TABLE_2)]
    Table2(drop::Args),
    /// The same by models of ever more physics
    #[command(name = LADDER)]
    Ladder(drop::Args),
    /// Which lags of the amplifier put PMOS-1 where it was seen, by the transmission that is assumed
    #[command(name = "phantom-lag")]
    Lag(crate::beside::Args),
    /// What is proved and measured of the words, and what (1,9,22) everywhere cannot hold
    #[command(name = FORMATS)]
    Formats(words::Args),
    /// Four sources of sine: errors and bits of ROM
    #[command(name = SINES)]
    Sines(words::Args),
    /// What blocks and loops cost in an FPGA, and what a bit costs
    #[command(name = COST)]
    Cost(cost::Args),
    /// The hybrid loop against the conventional one (Vasudevan et al. 2007)
    #[command(name = "hybrid-loop")]
    Hybrid(crate::beside::Args),
    /// Stable stiffness with the analog input shaper and with energy bounding
    #[command(name = "input-shaper")]
    Shaper(crate::beside::Args),
    /// On which side each criterion of stability errs, for five devices
    #[command(name = "criteria")]
    Criteria(crate::beside::Args),
    /// Two figures of a power-scaled spring, by both readings of its law
    #[command(name = "power-scaling")]
    Scaling(crate::beside::Args),
    /// Shape, stiffness, shear and texture of a 3-DOF device, and where the switch of its control fails
    #[command(name = "three-dof")]
    ThreeDof(crate::beside::Args),
    /// A published device with its firmware: logs beside runs, and what a model must not leave out
    #[command(name = "epfl-paddle")]
    Paddle(crate::beside::Args),
}

impl Args {
    /// Returns the drop test to show, with its options and the folder of its sweep, if nothing is to be run.
    pub fn from(&self) -> Option<(Name, &drop::Args, &Path)> {
        let (name, args) = match &self.study {
            Study::Table2(args) => (Name::Table2, args),
            Study::Ladder(args) => (Name::Ladder, args),
            _ => return None,
        };
        Some((name, args, args.from()?))
    }
}

/// Runs `hpu reproduce`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    match &args.study {
        Study::Table2(args) => drop::run(Name::Table2, args),
        Study::Ladder(args) => drop::run(Name::Ladder, args),
        Study::Lag(args) => crate::beside::reproduce(&shipped("phantom-lag"), args),
        Study::Formats(args) => words::formats(args),
        Study::Sines(args) => words::sines(args),
        Study::Cost(args) => cost::run(args),
        Study::Hybrid(args) => crate::beside::reproduce(&shipped("hybrid-loop"), args),
        Study::Shaper(args) => crate::beside::reproduce(&shipped("input-shaper"), args),
        Study::Criteria(args) => crate::beside::reproduce(&shipped("criteria"), args),
        Study::Scaling(args) => crate::beside::reproduce(&shipped("power-scaling"), args),
        Study::Paddle(args) => crate::beside::reproduce(&shipped("epfl-paddle"), args),
        Study::ThreeDof(args) => crate::beside::reproduce(&shipped("three-dof"), args),
    }
}
