//! The modes of verbs: which options a mode does not read. Such an option is refused, never ignored.
//!
//! Other arguments decide the mode: a positional argument that is missing, a flag, the value of an option.
//! Where the scene decides, the verb itself refuses the option once it has read the scene.

use clap::parser::ValueSource;
use clap::{ArgMatches, Error, error::ErrorKind};

use crate::shell::Failure;

/// A mode of a verb.
struct Mode {
    /// The verb, with its study or its own verb, as in `sweep submit`.
    verb: &'static str,
    /// Whether the arguments ask for this mode.
    is_asked: fn(&Given) -> bool,
    /// The mode, as a refusal calls it.
    name: &'static str,
    /// Options that it does not read, each group with the place where they act.
    unread: &'static [(&'static [&'static str], &'static str)],
}

/// The arguments of a verb.
struct Given<'m>(&'m ArgMatches);

impl Given<'_> {
    /// Returns whether the command line has an argument.
    fn has(&self, id: &str) -> bool {
        let known = self.0.try_contains_id(id).is_ok();
        known && self.0.value_source(id) == Some(ValueSource::CommandLine)
    }

    /// Returns whether the value of an option is this one, given or by default.
    fn is(&self, id: &str, value: &str) -> bool {
        self.0.get_raw(id).into_iter().flatten().any(|given| given == value)
    }

    /// Returns whether an option was given with a value; not where it was given alone.
    fn has_value(&self, id: &str) -> bool {
        self.has(id) && self.0.get_raw(id).into_iter().flatten().next().is_some()
    }
}

/// Writes the modes. Each has its verb, whether the arguments ask for it, its name in a refusal, and groups of options
/// that it does not read, each with the place where they act.
macro_rules! modes {
    ($($verb:literal: |$given:ident| $is_asked:expr, $name:literal, { $($($id:ident)+: $place:literal);+ })*) => {
        &[$(Mode {
            verb: $verb,
            is_asked: |$given| $is_asked,
            name: $name,
            unread: &[$((&[$(stringify!($id)),+], $place)),+],
        }),*]
    };
}

/// All modes that do not read every option of their verb.
const MODES: &[Mode] = modes! {
    "run": |given| !given.is("driver", "rtl"), "a run without the VHDL of blocks", { hdl: "--driver rtl reads it" }
    "run": |given| given.has("compare") && !given.has_value("compare"), "the comparison of both drivers", {
        beside: "--compare PORT=NET and -o DIR read it";
        latency: "--compare PORT=NET reads it";
        notation tool_timeout: "a run without --compare reads it" }
    "run": |given| given.has("json"), "JSON", { notation: "text shows word formats" }
    "block": |given| given.has("inputs"), "rows of words", { notation: "formats are shown without --inputs" }
    "block": |given| given.has("json"), "JSON, which has every notation", { notation: "text shows word formats" }
    "vectors": |given| given.has("update"), "--update", {
        set_kind variant generic bench seed count scene set table format:
            "the committed vectors have settings of their own" }
    "vectors": |given| given.has("verify"), "--verify", {
        set_kind variant generic bench seed count scene set table format: "each file says what it holds" }
    "vectors": |given| !given.is("set_kind", "scene"), "vectors of blocks alone", {
        scene: "--set-kind scene reads it";
        set: "--set-kind scene reads it; --variant LABEL or --generic NAME=VALUE chooses a configuration" }
    "vectors": |given| !given.is("set_kind", "random"), "vectors that are not random", {
        seed: "--set-kind random reads it; a scene has run.seed" }
    "vectors": |given| given.is("set_kind", "scene"), "vectors of a scene", {
        variant generic: "the scene configures its blocks, and --set changes the scene" }
    "vectors": |given| given.is("set_kind", "table"), "lookup tables", { bench: "a bench reads vectors of a block" }
    "vectors": |given| !given.has("out"), "vectors on stdout", { bench: "a folder (-o DIR) takes its files" }
    "check": |given| given.has("blocks") && !given.has("scenes") && !given.has("entity"), "a check of blocks", {
        set: "--scene reads it, --variant LABEL chooses a configuration";
        edges: "--scene reads it" }
    "check": |given| given.has("blocks") && !given.is("blocks", "truncating_multiplier"), "these blocks", {
        exhaustive: "truncating_multiplier reads it" }
    "check": |given| !given.has("blocks") && given.has("scenes"), "a check of scenes alone", {
        rows seed exhaustive: "a check of blocks reads it" }
    "check": |given| given.has("formal") && !given.has("blocks") && !given.has("scenes"), "a proof of all blocks", {
        set: "--scene reads it" }
    "check": |given| given.has("formal"), "a proof", {
        rows seed: "a check without --formal reads it; a proof is of all inputs" }
    "map": |given| given.has("from"), "--from", {
        cell_events cell_timeout tool_timeout: "the sweep's manifest has it" }
    "widths": |given| given.has("from"), "--from", {
        vary against also proved lose: "the sweep's manifest has it";
        seed notation: "the page of a scene reads it" }
    "widths": |given| given.has("search"), "--search", {
        random seed no_trials tables notation: "the page of a scene reads it" }
    "widths": |given| given.has("gappa"), "--gappa", {
        no_trials seed: "the page of a scene reads it";
        vary against also proved lose: "--search reads it" }
    "widths": |given| given.has("random"), "random motion", { no_trials: "random motion has no trials" }
    "widths": |given| given.has("no_trials"), "--no-trials", {
        within: "it is the error that trials of fewer bits may have" }
    "widths": |given| !given.has("price"), "a page without --price", { hdl tool_timeout cache: "--price reads it" }
    "widths": |given| given.has("json") && !given.has("out"), "JSON", {
        notation: "text and the files of --out show word formats" }
    "reproduce phantom-formats": |given| given.has("json") && !given.has("out"), "JSON", {
        notation: "text and the files of --out show word formats" }
    "reproduce phantom-sines": |given| given.has("json") && !given.has("out"), "JSON", {
        notation: "text and the files of --out show word formats" }
    "cost": |given| given.has("scene"), "a scene's loop", {
        variant: "a block's NAME reads it; --set changes the loop's configuration" }
    "sweep shard": |given| given.has("point"), "--point", { json: "a point prints one row" }
    "sweep submit": |given| given.has("cancel"), "--cancel", {
        limit tasks cores option since: "a submission reads it" }
    "sweep submit": |given| given.is("engine", "parallel"), "GNU parallel", {
        tasks since tool_timeout: "--engine slurm reads it" }
    "sweep submit": |given| given.has("dry_run") && given.is("engine", "parallel"), "--dry-run of GNU parallel", {
        one_wave: "its script is always that of one wave" }
    "sweep submit": |given| given.has("dry_run"), "--dry-run", { json: "the script is printed as it is" }
};

/// Checks that the mode of a verb reads all options that were given; else returns why it refuses the first one. `verb`
/// is its name, and that of its study or own verb.
pub fn unread(verb: &str, matches: &ArgMatches) -> Result<(), Failure> {
    let given = Given(matches);
    let modes = MODES.iter().filter(|mode| mode.verb == verb && (mode.is_asked)(&given));
    for Mode { name, unread, .. } in modes {
        for (ids, place) in *unread {
            if let Some(id) = ids.iter().find(|id| given.has(id)) {
                let option = id.replace('_', "-");
                return Err(Failure::usage(format!("--{option} has no effect on {name}; {place}")));
            }
        }
    }
    Ok(())
}

/// Checks the arguments of the whole command: see [`unread`].
pub fn check(command: &mut clap::Command, matches: &ArgMatches) -> Result<(), Error> {
    let (mut verb, mut of) = (Vec::new(), matches);
    while let Some((name, next)) = of.subcommand() {
        verb.push(name);
        of = next;
    }
    unread(&verb.join(" "), of).map_err(|why| {
        let of = verb.iter().fold(command, |of, name| of.find_subcommand_mut(name).expect("it was found before"));
        of.error(ErrorKind::ArgumentConflict, why)
    })
}
