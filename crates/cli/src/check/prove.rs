//! `hpu check --formal`: the VHDL of blocks proved equal to the emulator, for all inputs and states.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use hpu_cosim::{Wired, WiredSimulation};
use hpu_datapath::{AnyBlock, Generic, Instance, configured, proved_variants_of};
use hpu_page::{Cell, Column, Field, Page, Table};
use hpu_rtl::formal::{Part, Proof, Proofs, Prover, Verdict, tools};
use hpu_rtl::{Around, Error, generics_label};
use serde_json::{Value, json};

use crate::block;
use crate::check::{Args, entity};
use crate::scene::Loaded;
use crate::shell::cache::path;
use crate::shell::{Exit, Failure, Folder, cache_folder, interrupt, print, print_json, tell, verdict, with_progress};
use crate::waves::waveform;

/// The time that a solver has for a question, unless another time for tools is given.
const QUESTION: Duration = Duration::from_secs(60);

/// A configuration: the block with its label and its generics, or an entity of the user's own with the label alone.
type Wanted = (String, String, Option<Vec<(&'static str, Generic)>>);

/// The function that proves a configuration.
type Proving<'p> = &'p (dyn Fn(&Wanted) -> Result<Verdict, Error> + Sync);

/// The result for a configuration: its index among the requested ones, its verdict, and the seconds that it took.
struct ProofResult {
    index: usize,
    block: String,
    variant: String,
    found: Result<Verdict, Error>,
    seconds: f64,
}

/// `hpu check --formal`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    prove(args, |of, limit, wanted, proved, remembered| tabled(args, of, limit, wanted, proved, remembered))
}

/// Returns the page of the proofs; `None` when interrupted.
pub fn answer(args: &Args) -> Result<Option<Page>, Failure> {
    prove(args, |of, limit, wanted, proved, remembered| {
        let rows = proofs(args, of, limit, wanted, proved, &mut |_| Ok(()))?;
        Ok(rows.map(|rows| {
            let Sum { is_well, said, .. } = Sum::of(args, &rows, of, remembered());
            let mut page = Page::default();
            page.data("ok", is_well).line("result", said);
            let fields = fields().into_iter().chain([Column::text("", "").said().of(said_of)]);
            page.table(Table::of("rows", &rows, fields));
            page
        }))
    })
}

/// Calls `then` with what is to be proved, the time of a question, the configurations, and the functions that prove one
/// and that tell how many proofs were remembered.
fn prove<T>(
    args: &Args,
    then: impl FnOnce(&str, Duration, &[Wanted], Proving, &dyn Fn() -> u64) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let setup = args.hdl.setup();
    let limit = setup.timeout.unwrap_or(QUESTION);
    let mut wanted = if args.blocks.is_empty() && !args.scenes.is_empty() { Vec::new() } else { of_blocks(args)? };
    wanted.extend(of_scenes(args)?);
    let folder = cache_folder("proofs", "proofs");
    let proofs = Proofs::open(path(&folder)?, setup.timeout)?;
    let prover = Prover::new(&setup, limit).remembering(proofs);
    let proved = |(name, _, set): &Wanted| {
        let set = set.as_ref().expect("it has generics");
        prover.prove(&*configured(name, set).expect("it is known").expect("it has been built"))
    };
    then(&format!("VHDL {}", setup.hdl), limit, &wanted, &proved, &|| prover.remembered())
}

/// Returns the configurations of the blocks: those that are listed, or the one with these generics.
fn of_blocks(args: &Args) -> Result<Vec<Wanted>, Failure> {
    let generics = &args.theirs.generic;
    let is_wanted = |name: &str| args.blocks.is_empty() || args.blocks.iter().any(|block| block == name);
    let found = match &generics[..] {
        [] => proved_variants_of(is_wanted),
        _ => args
            .blocks
            .iter()
            .map(|name| Ok((generics_label(generics), block::configured(name, generics)?)))
            .collect::<Result<_, Failure>>()?,
    };
    let found = found.into_iter().filter(|(label, _)| args.variants.is_empty() || args.variants.contains(label));
    Ok(found.map(|(label, block)| (block.name().to_string(), label, Some(block.generics()))).collect())
}

/// Returns the wirings of scenes and the blocks in them, with the scenes' widths; of equal ones, the first.
fn of_scenes(args: &Args) -> Result<Vec<Wanted>, Failure> {
    let mut wanted: Vec<Wanted> = Vec::new();
    let mut want = |scene: &str, label: &str, block: &dyn AnyBlock| {
        let (name, set) = (block.name().to_string(), Some(block.generics()));
        if !wanted.iter().any(|(known, _, known_set)| *known == name && *known_set == set) {
            wanted.push((name, format!("{scene} {label}").trim_end().to_string(), set));
        }
    };
    for name in &args.scenes {
        let loaded = Loaded::new(name, &args.set.set, None)?;
        let simulation = WiredSimulation::new(&loaded.scene).map_err(Failure::file)?;
        let (scene, wiring) = (&loaded.scene.name, simulation.wiring());
        for Instance { label, model, .. } in wiring.instances() {
            want(scene, label, &*model);
        }
        if wiring.is_hardware() {
            want(scene, "", wiring.block());
        }
    }
    Ok(wanted)
}

/// `hpu check --formal --entity`.
pub fn theirs(args: &Args) -> Result<Exit, Failure> {
    let entity = entity::entity(args)?;
    let simulators = args.hdl.simulators();
    let limit = args.hdl.setup().timeout.unwrap_or(QUESTION);
    let configurations = || entity.configurations();
    let labels = configurations()?.into_iter().map(|(label, _)| label);
    let wanted: Vec<_> = labels.map(|label| (entity.top.to_string(), label, None)).collect();
    let proved = |(_, label, _): &Wanted| {
        let own = configurations()?.into_iter().find(|(own, _)| own == label).expect("it is wanted");
        entity.prove(&own, &simulators, limit)
    };
    tabled(args, &format!("{} as {}", entity.top, entity.block), limit, &wanted, &proved, &|| 0)
}

/// Proves configurations in parallel, and shows the table as it grows.
fn tabled(
    args: &Args,
    of: &str,
    limit: Duration,
    wanted: &[Wanted],
    proved: Proving,
    remembered: &dyn Fn() -> u64,
) -> Result<Exit, Failure> {
    let mut folder = args.out.as_deref().map(Folder::open).transpose()?;
    let mut text = String::new();
    let mut show = |row: &ProofResult| {
        if text.is_empty() && !args.json {
            let head = Table::of("", &[] as &[ProofResult], fields()).gap(1).head();
            print(&format!("{}  for all inputs and states\n", head.trim_end()))?;
        }
        let shown = shown(row, folder.as_mut())?;
        text += &shown;
        if args.json { Ok(()) } else { print(&shown) }
    };
    let Some(rows) = proofs(args, of, limit, wanted, proved, &mut show)? else { return Ok(Exit::Interrupted) };
    let Sum { is_well, said, json } = Sum::of(args, &rows, of, remembered());
    let total = format!("{said}\n");
    text += &total;
    if let Some(mut folder) = folder {
        folder.write("formal.json", format!("{json:#}\n"))?;
        folder.write("formal.txt", &text)?;
        folder.commit()?;
    }
    if args.json {
        print_json(&json)?;
    } else {
        print(&total)?;
    }
    // A failed tool is an error, not a verdict.
    if let Some(error) = rows.into_iter().find_map(|row| row.found.err()) {
        return Err(error.into());
    }
    Ok(Exit::when(is_well))
}

/// Proves configurations in parallel, and calls `show` with each as it is done; `None` when interrupted.
fn proofs(
    args: &Args,
    of: &str,
    limit: Duration,
    wanted: &[Wanted],
    proved: Proving,
    show: &mut dyn FnMut(&ProofResult) -> Result<(), Failure>,
) -> Result<Option<Vec<ProofResult>>, Failure> {
    // A missing tool is reported before anything is shown.
    tools(args.hdl.setup().timeout)?;
    let jobs = args.jobs.get().get().min(wanted.len().max(1));
    // For a block of the user's own, an impossible request is found only during the proof.
    if !args.theirs.is_asked() {
        let count = wanted.len();
        tell(&format!("{of}: {count} configurations, {} s a question at most, {jobs} at a time", limit.as_secs_f64()));
    }
    let control = interrupt::heed();
    let next = AtomicUsize::new(0);
    let mut rows: Vec<ProofResult> = Vec::new();
    with_progress(wanted.len() as u64, "configurations", control, || {
        thread::scope(|scope| -> Result<(), Failure> {
            let (send, done) = mpsc::channel();
            for _ in 0..jobs {
                let (send, next) = (send.clone(), &next);
                scope.spawn(move || {
                    loop {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        let Some(one) = wanted.get(index) else { break };
                        if interrupt::pressed() {
                            break;
                        }
                        let start = Instant::now();
                        let found = proved(one);
                        let seconds = start.elapsed().as_secs_f64();
                        let (block, variant, _) = one.clone();
                        if send.send(ProofResult { index, block, variant, found, seconds }).is_err() {
                            break;
                        }
                    }
                });
            }
            drop(send);
            for row in done {
                // An impossible request about a block of the user's own gives an error and no row.
                if args.theirs.is_asked() && row.found.is_err() {
                    return row.found.map(drop).map_err(Failure::from);
                }
                control.progress.fetch_add(1, Ordering::Relaxed);
                show(&row)?;
                rows.push(row);
            }
            Ok(())
        })
    })?;
    // The rows are sorted, because the order of the JSON must not depend on which proof ended first.
    rows.sort_by_key(|row| row.index);
    Ok((!interrupt::pressed()).then_some(rows))
}

/// The sum of the proofs: in words, and as JSON.
struct Sum {
    is_well: bool,
    said: String,
    json: Value,
}

impl Sum {
    fn of(args: &Args, rows: &[ProofResult], of: &str, remembered: u64) -> Self {
        let count = |is: fn(&Verdict) -> bool| rows.iter().filter(|row| row.found.as_ref().is_ok_and(is)).count();
        let proved = count(|found| matches!(found, Verdict::Proved(_)));
        let refuted = count(|found| refuted(found).is_some());
        let refused = count(|found| refused(found).is_some());
        let [wired, miswired] =
            [count(|found| matches!(found, Verdict::Wired(_))), count(|found| matches!(found, Verdict::Miswired(_)))];
        let whole = count(|found| matches!(found, Verdict::Wired(parts) if open(parts).is_empty()));
        let (wirings, leaves) = (wired + miswired, rows.len() - wired - miswired);
        // A block of the user's own must be proved in every row; an open row is a failure.
        let is_well = refuted + refused == 0 && (!args.theirs.is_asked() || proved == rows.len());
        let kind = if wirings > 0 { " of leaf blocks" } else { "" };
        let refuted_leaves = count(|found| matches!(found, Verdict::Refuted(..)));
        let refused_leaves = count(|found| matches!(found, Verdict::Refused(_)));
        let mut said = Vec::new();
        if leaves > 0 {
            let refused = if refused_leaves > 0 { format!("{refused_leaves} refused, ") } else { String::new() };
            said.push(format!(
                "{proved} of {leaves} configurations{kind} proved for all inputs and states, {refuted_leaves} refuted, \
                 {refused}{} not proved",
                leaves - proved - refuted_leaves - refused_leaves,
            ));
        }
        if wirings > 0 {
            said.push(format!("{wired} of {wirings} wirings equal, {whole} of them with all leaves proved"));
        }
        said.push(of.to_string());
        if remembered > 0 {
            said.push(format!("{remembered} proofs remembered"));
        }
        let json = json!({
            "ok": is_well,
            "hdl": of.strip_prefix("VHDL ").unwrap_or(of),
            "proved": proved,
            "refuted": refuted + refused,
            "wirings": { "count": wirings, "equal": wired, "proved": whole },
            "remembered": remembered,
            "rows": Table::of("", rows, fields()).json(),
        });
        Self { is_well, said: said.join("; "), json }
    }
}

/// The counterexample of a refuted block, or of a block inside a wiring.
enum Refuted<'v> {
    Words(String, &'v Around),
    Wiring(&'v str),
}

fn refuted(found: &Verdict) -> Option<Refuted<'_>> {
    match found {
        Verdict::Refuted(about, around) => Some(Refuted::Words(about.clone(), around)),
        Verdict::Miswired(why) => Some(Refuted::Wiring(why)),
        Verdict::Wired(parts) => parts.iter().find_map(|Part { place, block, verdict, .. }| match verdict {
            Verdict::Refuted(about, around) => {
                Some(Refuted::Words(format!("{about} of instance {place}, a {block}"), around))
            }
            _ => None,
        }),
        Verdict::Proved(_) | Verdict::Refused(_) | Verdict::Open(_) => None,
    }
}

/// Returns why a block, or a block inside a wiring that is not refuted, is refused.
fn refused(found: &Verdict) -> Option<String> {
    match found {
        Verdict::Refused(why) => Some(why.clone()),
        Verdict::Wired(parts) if refuted(found).is_none() => {
            parts.iter().find_map(|Part { place, block, verdict, .. }| match verdict {
                Verdict::Refused(why) => Some(format!("in instance {place}, a {block}, {why}")),
                _ => None,
            })
        }
        _ => None,
    }
}

/// Returns the parts of a wiring that are not proved.
fn open(parts: &[Part]) -> Vec<&Part> {
    parts.iter().filter(|part| !matches!(part.verdict, Verdict::Proved(_))).collect()
}

/// Returns the blocks on which a wiring rests: all of them if all are proved, else those that are not.
fn rests_on(parts: &[Part]) -> String {
    let open = open(parts);
    if open.is_empty() {
        let mut names: Vec<_> = parts.iter().map(|part| part.block).collect();
        let mut known = BTreeSet::new();
        names.retain(|name| known.insert(*name));
        return format!("proved: the wiring equals, of proved {}", names.join(", "));
    }
    let names: Vec<_> = open.iter().map(|Part { place, block, .. }| format!("{place} ({block})")).collect();
    format!("wired: the wiring equals; not proved: {}", names.join(", "))
}

/// Returns the line of a row, and the counterexample if the row is refuted.
fn shown(row: &ProofResult, folder: Option<&mut Folder>) -> Result<String, Failure> {
    let ProofResult { block, variant, found, .. } = row;
    let figures = Table::of("", [row], fields()).gap(1).last(&|text, _| text.to_string());
    let line = |said: &str| format!("{}  {said}", figures.trim_end());
    match found.as_ref().map(refuted) {
        Ok(Some(Refuted::Words(about, around))) => {
            let mut text = verdict(&line(&format!("refuted, by {about}:")), false) + "\n";
            let last = around.rows.len() as u64;
            around.lines(last).iter().for_each(|line| text += &format!("    {line}\n"));
            return Ok(text + &waveform(around, last, &format!("{block}-{variant}"), folder)?);
        }
        Ok(Some(Refuted::Wiring(why))) => {
            return Ok(verdict(&line(&format!("refuted, by its wiring: {why}")), false) + "\n");
        }
        Ok(None) | Err(_) => {}
    }
    let said = line(&said_of(row));
    let is_refused = found.as_ref().is_ok_and(|found| refused(found).is_some());
    Ok(if is_refused { verdict(&said, false) } else { said } + "\n")
}

/// Returns the verdict of a row that is not refuted in words.
fn said_of(row: &ProofResult) -> String {
    let left = |why: String| format!("not proved: {}", why.trim_end().replace('\n', "\n  "));
    if let Some(why) = row.found.as_ref().ok().and_then(refused) {
        return format!("refused: {why}");
    }
    match &row.found {
        Ok(Verdict::Proved(Proof { given: None, .. })) => "proved".to_string(),
        Ok(Verdict::Proved(Proof { given: Some(given), .. })) => format!("proved; {given}"),
        Ok(Verdict::Wired(parts)) => rests_on(parts),
        Ok(Verdict::Open(why) | Verdict::Refused(why) | Verdict::Miswired(why) | Verdict::Refuted(why, _)) => {
            left(why.clone())
        }
        Err(error) => left(error.to_string()),
    }
}

/// Returns a verdict in one word, with its details.
fn told(found: &Verdict) -> (&'static str, Value) {
    match (refuted(found), found) {
        (Some(Refuted::Words(about, around)), _) => {
            let (columns, history) = around.table(around.rows.len() as u64);
            ("refuted", json!({ "about": about, "columns": columns, "history": history }))
        }
        (Some(Refuted::Wiring(why)), _) => ("refuted", why.into()),
        (None, found) if refused(found).is_some() => ("refused", refused(found).into()),
        (None, Verdict::Wired(parts)) => (if open(parts).is_empty() { "proved" } else { "wired" }, Value::Null),
        (None, Verdict::Open(why)) => ("open", why.as_str().into()),
        (None, Verdict::Proved(Proof { given, .. })) => ("proved", given.as_deref().into()),
        (None, _) => ("proved", Value::Null),
    }
}

/// Returns the columns of the rows; text has the verdict in a sentence behind them.
fn fields() -> [Field<'static, ProofResult>; 7] {
    let said = |row: &ProofResult| row.found.as_ref().map_or_else(|error| ("open", error.to_string().into()), told);
    let solvers = |row: &ProofResult| match &row.found {
        Ok(Verdict::Proved(Proof { by, .. })) => by.as_slice().into(),
        _ => Value::Null,
    };
    let parts = |row: &ProofResult| match &row.found {
        Ok(Verdict::Wired(parts)) => parts.iter().map(part).collect(),
        _ => Value::Null,
    };
    [
        Column::text("block", "block").least(22).of(|row: &ProofResult| row.block.clone()),
        Column::text("variant", "variant").least(30).of(|row: &ProofResult| row.variant.clone()),
        Column::number("seconds", "s")
            .least(8)
            .of(|row: &ProofResult| Cell::new(row.seconds).shown(format!("{:.2}", row.seconds))),
        Column::text("verdict", "").data().of(move |row: &ProofResult| said(row).0),
        Column::text("why", "").data().of(move |row: &ProofResult| said(row).1),
        Column::text("solvers", "").data().of(solvers),
        Column::text("parts", "").data().of(parts),
    ]
}

fn part(Part { place, block, generics, verdict }: &Part) -> Value {
    let (said, why) = told(verdict);
    let value = |value: &Generic| match value {
        Generic::Integer(value) => Value::from(*value),
        Generic::Boolean(value) => Value::from(*value),
    };
    let generics: serde_json::Map<_, _> =
        generics.iter().map(|(name, set)| ((*name).to_string(), value(set))).collect();
    json!({ "instance": place, "block": block, "generics": generics, "verdict": said, "why": why })
}
