//! `hpu check --entity`: compares a block by somebody else with one of ours.

use std::path::Path;

use hpu_cosim::scene::{Identifier, Language, Part, SourceFile, Standard, beside};
use hpu_cosim::{excerpt, read_plain};
use hpu_rtl::CheckReport;
use hpu_rtl::entity::{Entity, Link};

use crate::check::{Args, Shown, fields};
use crate::shell::{Failure, interrupt, tell, values};

/// A block of your own, held against one of these: its files stand in the place of BLOCKS
#[derive(clap::Args)]
#[command(next_help_heading = "A block of your own")]
pub struct Theirs {
    /// Its entity or module; FILEs in the order of compilation stand in the place of BLOCKS
    #[arg(
        long,
        value_name = "NAME",
        requires_all = ["as_block", "blocks"],
        conflicts_with_all = ["scenes", "edges", "exhaustive", "hdl"]
    )]
    entity: Option<String>,
    /// The block here that it is to equal, row by row
    #[arg(long = "as", id = "as_block", value_name = "BLOCK", requires = "entity")]
    as_block: Option<String>,
    /// Connect a port of it: THEIRS=OURS, an input also THEIRS=NUMBER, an output also THEIRS=open; open=OURS for an
    /// output that it does not have; ports of the same name need none; bits of one are 'p(7 downto 0)' or 'p[7:0]'; may
    /// be repeated
    #[arg(long, value_name = "THEIRS=OURS", value_parser = values::pair, requires = "entity")]
    port: Vec<(String, String)>,
    /// Set a generic or parameter of it: THEIRS=OURS takes the value of ours, THEIRS=VALUE stays; --set NAME=VALUE is a
    /// generic of ours. Without --entity, a generic of the BLOCKS, as in WIDTH=14. May be repeated
    #[arg(long, value_name = "THEIRS=OURS", value_parser = values::generic, requires = "blocks")]
    pub(crate) generic: Vec<(String, String)>,
    /// Its clock [default: clk]
    #[arg(long, value_name = "PORT", requires = "entity")]
    clock: Option<String>,
    /// Its reset, active high, or low as PORT=low, synchronous or not [default: rst]; without one, rows that reset are
    /// left out
    #[arg(long, value_name = "PORT", requires = "entity")]
    reset: Option<String>,
    /// Clocks by which its outputs come later than those here; -1: one clock earlier. For so many rows after a reset
    /// nothing is compared
    #[arg(long, value_name = "CLOCKS", default_value_t = 0, allow_hyphen_values = true, requires = "entity")]
    latency: i64,
    /// With --formal, a register or signal of it and the register here that it is: THEIRS=OURS; those of the same name
    /// need none; may be repeated
    #[arg(long, value_name = "THEIRS=OURS", value_parser = values::pair, requires_all = ["entity", "formal"])]
    state: Vec<(String, String)>,
    /// With --formal, what holds in every state of it, in Verilog, over its signals: 'busy == (left != 0)'. It is
    /// proved, too; may be repeated
    #[arg(long, value_name = "EXPRESSION", requires_all = ["entity", "formal"])]
    invariant: Vec<String>,
    /// VHDL that it is written in: 93 or 2008
    #[arg(long, value_name = "YEAR", default_value = "2008", value_parser = ["93", "2008"], requires = "entity")]
    standard: String,
    /// Library that it is compiled into
    #[arg(long, value_name = "NAME", default_value = "work", requires = "entity")]
    library: String,
}

impl Theirs {
    /// Returns whether the command line names a block of the user's own.
    pub(crate) fn is_asked(&self) -> bool {
        self.entity.is_some()
    }

    /// Returns the options that were given, with their values.
    pub fn options(&self) -> Vec<(&'static str, String)> {
        let Self { entity: Some(entity), as_block, port, generic, clock, reset, latency, .. } = self else {
            return Vec::new();
        };
        let mut options = vec![("entity", entity.clone())];
        options.extend(as_block.clone().map(|block| ("as", block)));
        let mut pairs = |name, pairs: &[(String, String)]| {
            options.extend(pairs.iter().map(|(theirs, ours)| (name, format!("{theirs}={ours}"))));
        };
        pairs("port", port);
        pairs("generic", generic);
        options.extend(clock.clone().map(|clock| ("clock", clock)));
        options.extend(reset.clone().map(|reset| ("reset", reset)));
        let others = [
            ("latency", latency.to_string(), "0"),
            ("standard", self.standard.clone(), "2008"),
            ("library", self.library.clone(), "work"),
        ];
        options.extend(
            others.into_iter().filter(|(_, value, default)| value != default).map(|(name, value, _)| (name, value)),
        );
        options
    }
}

/// Returns the block that the command line describes.
pub fn entity(args: &Args) -> Result<Entity, Failure> {
    let Theirs { port, generic, clock, reset, latency, state, invariant, standard, library, .. } = &args.theirs;
    let link = |text: &String| match text.parse() {
        Ok(number) => Link::Constant(number),
        Err(_) if text == "open" => Link::Open,
        Err(_) => Link::Port(text.clone()),
    };
    let (without, ports): (Vec<_>, Vec<_>) = port.iter().partition(|(theirs, _)| theirs == "open");
    let mut files = files(&args.blocks)?;
    let beside = beside(&mut files, &mut [], &mut |path: &str| read_plain(Path::new(path)));
    let language = Language::of(&files);
    let named = |option: &str, made: Option<Identifier>, text: &str| {
        let refused =
            || Failure::usage(format!("--{option}: `{}` is no identifier: {}", excerpt(text), language.identifiers()));
        made.ok_or_else(refused)
    };
    let unit = |option: &str, text: &str| named(option, Identifier::unit(language, text), text);
    let name = |option: &str, text: &str| named(option, Identifier::new(language, text), text);
    let reset = reset.as_ref().map(|reset| match reset.split_once('=') {
        None => Ok((name("reset", reset)?, false)),
        Some((port, "low")) => Ok((name("reset", port)?, true)),
        Some((port, "high")) => Ok((name("reset", port)?, false)),
        Some((port, level)) => Err(Failure::usage(format!("--reset {port}={level}: write {port}=low or {port}"))),
    });
    Ok(Entity {
        library: unit("library", library)?,
        top: unit("entity", args.theirs.entity.as_deref().unwrap_or_default())?,
        standard: if standard == "93" { Standard::Vhdl93 } else { Standard::Vhdl2008 },
        clock: clock.as_deref().map(|clock| name("clock", clock)).transpose()?,
        reset: reset.transpose()?,
        ports: ports
            .iter()
            .map(|(theirs, ours)| {
                let refused = || {
                    let accepted = language.identifiers();
                    Failure::usage(format!("--port: `{}` is no identifier: {accepted}", excerpt(theirs)))
                };
                let (port, part) = Part::of_name(language, theirs).ok_or_else(refused)?;
                Ok((port, part, link(ours)))
            })
            .collect::<Result<_, Failure>>()?,
        without: without.iter().map(|(_, ours)| ours.clone()).collect(),
        generics: generic
            .iter()
            .map(|(theirs, ours)| Ok((name("generic", theirs)?, ours.clone())))
            .collect::<Result<_, Failure>>()?,
        files,
        beside,
        block: args.theirs.as_block.clone().unwrap_or_default(),
        variants: args.variants.clone(),
        set: args.set.set.clone(),
        latency: *latency,
        state: state.clone(),
        invariants: invariant.clone(),
        rows: args.rows,
        seed: args.seed,
    })
}

fn files(names: &[String]) -> Result<Vec<SourceFile>, Failure> {
    let ends = [".vhd", ".vhdl", ".v", ".sv", ".vh", ".svh"];
    let base = |name: &str| Path::new(name).file_name().map(|name| name.to_string_lossy().into_owned());
    for (index, name) in names.iter().enumerate() {
        if !ends.iter().any(|end| name.ends_with(end)) {
            return Err(Failure::usage(format!(
                "`{name}` is no file of HDL ({}); --entity takes files",
                ends.join(", ")
            )));
        }
        if let Some(other) = names[..index].iter().find(|other| base(other) == base(name)) {
            return Err(Failure::usage(format!("`{other}` and `{name}` have one name; rename one of them")));
        }
    }
    let read = |name: &String| match read_plain(Path::new(name)) {
        Ok(content) => Ok((name.clone(), content.into())),
        Err(error) => Err(Failure::at(Path::new(name), error)),
    };
    names.iter().map(read).collect()
}

/// Compares the blocks, and shows the table as it grows. Returns the report, and the name of the simulator of theirs.
pub fn checked(args: &Args, shown: &mut Shown) -> Result<(CheckReport, String), Failure> {
    let entity = entity(args)?;
    let simulators = args.hdl.simulators();
    let (mut report, mut engine) = (CheckReport::default(), String::new());
    for mut configuration in entity.configurations()? {
        let compared = entity.compare(&mut configuration, &simulators)?;
        interrupt::check()?;
        if report.rows.is_empty() {
            let block = &entity.block;
            if !compared.not_taken.is_empty() {
                tell(&format!("{} does not take {} of {block}", entity.top, compared.not_taken.join(", ")));
            }
            if configuration.1.clocked() && !compared.has_reset {
                tell(&format!(
                    "{} has no reset: it is compared from power-up, and rows that reset are left out",
                    entity.top
                ));
            }
            shown.begin(fields("entity", &format!("as {block}")))?;
        }
        shown.row(&compared.row)?;
        engine = compared.engine;
        report.rows.push(compared.row);
    }
    Ok((report, engine))
}
