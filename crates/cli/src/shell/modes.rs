//! The modes of verbs: which options a mode does not read. Such an option is refused, never ignored.
//!
//! Other arguments decide the mode: a positional argument that is missing, a flag, the value of an option.
//! Where the scene decides, the verb itself refuses the option once it has read the scene.

use clap::parser::ValueSource;
use clap::{ArgMatches, Error, error::ErrorKind};

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

/// All modes that do not read every option of their verb.
const MODES: &[Mode] = &[
    Mode {
        verb: "run",
        is_asked: |given| !given.has("scene"),
        name: "the list of scenes",
        unread: &[(
            &[
                "set",
                "driver",
                "expect",
                "edges",
                "compare",
                "dut",
                "beside",
                "notation",
                "junit",
                "out",
                "hdl",
                "tool_timeout",
            ],
            "name a SCENE to run",
        )],
    },
    Mode {
        verb: "run",
        is_asked: |given| !given.is("driver", "rtl"),
        name: "a run without the VHDL of blocks",
        unread: &[(&["hdl"], "--driver rtl reads it")],
    },
    Mode {
        verb: "run",
        is_asked: |given| given.has("compare") && !given.has_value("compare"),
        name: "the comparison of both drivers",
        unread: &[
            (&["beside"], "--compare PORT=NET and -o DIR read it"),
            (&["notation", "tool_timeout"], "a run without --compare reads it"),
        ],
    },
    Mode {
        verb: "run",
        is_asked: |given| given.has("json"),
        name: "JSON",
        unread: &[(&["notation"], "text shows word formats")],
    },
    Mode {
        verb: "block",
        is_asked: |given| given.has("inputs"),
        name: "rows of words",
        unread: &[(&["notation"], "formats are shown without --inputs")],
    },
    Mode {
        verb: "block",
        is_asked: |given| given.has("json"),
        name: "JSON, which has every notation",
        unread: &[(&["notation"], "text shows word formats")],
    },
    Mode {
        verb: "vectors",
        is_asked: |given| given.has("update"),
        name: "--update",
        unread: &[(
            &["set_kind", "variant", "seed", "count", "scene", "set", "table", "format"],
            "the committed vectors have settings of their own",
        )],
    },
    Mode {
        verb: "vectors",
        is_asked: |given| given.has("verify"),
        name: "--verify",
        unread: &[(
            &["set_kind", "variant", "seed", "count", "scene", "set", "table", "format"],
            "each file says what it holds",
        )],
    },
    Mode {
        verb: "vectors",
        is_asked: |given| !given.is("set_kind", "scene"),
        name: "vectors of blocks alone",
        unread: &[
            (&["scene"], "--set-kind scene reads it"),
            (&["set"], "--set-kind scene reads it, --variant LABEL chooses a configuration"),
        ],
    },
    Mode {
        verb: "vectors",
        is_asked: |given| !given.is("set_kind", "random"),
        name: "vectors that are not random",
        unread: &[(&["seed"], "--set-kind random reads it; a scene has run.seed")],
    },
    Mode {
        verb: "vectors",
        is_asked: |given| given.is("set_kind", "scene"),
        name: "vectors of a scene",
        unread: &[(&["variant"], "the scene configures its blocks, and --set changes the scene")],
    },
    Mode {
        verb: "check",
        is_asked: |given| given.has("blocks") && !given.has("scenes") && !given.has("entity"),
        name: "a check of blocks",
        unread: &[
            (&["set"], "--scene reads it, --variant LABEL chooses a configuration"),
            (&["edges"], "--scene reads it"),
        ],
    },
    Mode {
        verb: "check",
        is_asked: |given| given.has("blocks") && !given.is("blocks", "truncating_multiplier"),
        name: "these blocks",
        unread: &[(&["exhaustive"], "truncating_multiplier reads it")],
    },
    Mode {
        verb: "check",
        is_asked: |given| !given.has("blocks") && given.has("scenes"),
        name: "a check of scenes alone",
        unread: &[(&["rows", "seed", "exhaustive"], "a check of blocks reads it")],
    },
    Mode {
        verb: "check",
        is_asked: |given| given.has("formal") && !given.has("blocks") && !given.has("scenes"),
        name: "a proof of all blocks",
        unread: &[(&["set"], "--scene reads it")],
    },
    Mode {
        verb: "check",
        is_asked: |given| given.has("formal"),
        name: "a proof",
        unread: &[(&["rows", "seed"], "a check without --formal reads it; a proof is of all inputs")],
    },
    Mode {
        verb: "map",
        is_asked: |given| given.has("from"),
        name: "--from",
        unread: &[(&["cell_events", "cell_timeout", "tool_timeout"], "the sweep's manifest has it")],
    },
    Mode {
        verb: "widths",
        is_asked: |given| given.has("from"),
        name: "--from",
        unread: &[
            (&["vary", "against", "also", "proved", "lose"], "the sweep's manifest has it"),
            (&["seed", "notation"], "the page of a scene reads it"),
        ],
    },
    Mode {
        verb: "widths",
        is_asked: |given| given.has("search"),
        name: "--search",
        unread: &[(&["random", "seed", "no_trials", "tables", "notation"], "the page of a scene reads it")],
    },
    Mode {
        verb: "widths",
        is_asked: |given| given.has("gappa"),
        name: "--gappa",
        unread: &[
            (&["no_trials", "seed"], "the page of a scene reads it"),
            (&["vary", "against", "also", "proved", "lose"], "--search reads it"),
        ],
    },
    Mode {
        verb: "widths",
        is_asked: |given| given.has("random"),
        name: "random motion",
        unread: &[(&["no_trials"], "random motion has no trials")],
    },
    Mode {
        verb: "widths",
        is_asked: |given| given.has("no_trials"),
        name: "--no-trials",
        unread: &[(&["within"], "it is the error that trials of fewer bits may have")],
    },
    Mode {
        verb: "widths",
        is_asked: |given| !given.has("price"),
        name: "a page without --price",
        unread: &[(&["hdl", "tool_timeout", "cache"], "--price reads it")],
    },
    Mode {
        verb: "widths",
        is_asked: |given| given.has("json") && !given.has("out"),
        name: "JSON",
        unread: &[(&["notation"], "text and the files of --out show word formats")],
    },
    Mode {
        verb: "reproduce phantom-formats",
        is_asked: |given| given.has("json") && !given.has("out"),
        name: "JSON",
        unread: &[(&["notation"], "text and the files of --out show word formats")],
    },
    Mode {
        verb: "reproduce phantom-sines",
        is_asked: |given| given.has("json") && !given.has("out"),
        name: "JSON",
        unread: &[(&["notation"], "text and the files of --out show word formats")],
    },
    Mode {
        verb: "cost",
        is_asked: |given| given.has("scene"),
        name: "a scene's loop",
        unread: &[(&["variant"], "a block's NAME reads it; --set changes the loop's configuration")],
    },
    Mode {
        verb: "sweep shard",
        is_asked: |given| given.has("point"),
        name: "--point",
        unread: &[(&["json"], "a point prints one row")],
    },
    Mode {
        verb: "sweep submit",
        is_asked: |given| given.has("cancel"),
        name: "--cancel",
        unread: &[(&["limit", "tasks", "cores", "option", "since"], "a submission reads it")],
    },
    Mode {
        verb: "sweep submit",
        is_asked: |given| given.is("engine", "parallel"),
        name: "GNU parallel",
        unread: &[(&["tasks", "since", "tool_timeout"], "--engine slurm reads it")],
    },
    Mode {
        verb: "sweep submit",
        is_asked: |given| given.has("dry_run") && given.is("engine", "parallel"),
        name: "--dry-run of GNU parallel",
        unread: &[(&["one_wave"], "its script is always that of one wave")],
    },
    Mode {
        verb: "sweep submit",
        is_asked: |given| given.has("dry_run"),
        name: "--dry-run",
        unread: &[(&["json"], "the script is printed as it is")],
    },
];

/// Checks that the mode of a verb reads all options that were given; else returns why it refuses the first one. `verb`
/// is its name, and that of its study or own verb.
pub fn unread(verb: &str, matches: &ArgMatches) -> Result<(), String> {
    let given = Given(matches);
    let modes = MODES.iter().filter(|mode| mode.verb == verb && (mode.is_asked)(&given));
    for Mode { name, unread, .. } in modes {
        for (ids, place) in *unread {
            if let Some(id) = ids.iter().find(|id| given.has(id)) {
                return Err(format!("--{} has no effect on {name}; {place}", id.replace('_', "-")));
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
