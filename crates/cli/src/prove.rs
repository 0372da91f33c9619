//! `hpu check --formal`: the VHDL of blocks proved equal to the emulator, for all inputs and states.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use hpu_cosim::{Ready, Wired};
use hpu_datapath::{AnyBlock, Generic, Instance, configured, variants};
use hpu_rtl::formal::{ProofError, Proofs, Verdict};
use serde_json::{Value, json};

use crate::block::find;
use crate::check::Args;
use crate::cost::cache_folder;
use crate::entity;
use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::interrupt;
use crate::scene::Loaded;
use crate::terminal::{print, print_json, tell, verdict, with_progress};
use crate::waves::waveform;

/// How long a question may take a solver, unless tools are given another time.
const QUESTION: Duration = Duration::from_secs(60);

/// A configuration: the block or the entity, its label, and its generics where it is none of the listed ones.
type Wanted = (String, String, Option<Vec<(&'static str, Generic)>>);

/// A configuration, what came of it, and the seconds that it took.
struct Row {
    block: String,
    variant: String,
    found: Result<Verdict, ProofError>,
    seconds: f64,
}

/// `hpu check --formal`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let setup = args.hdl.setup();
    let limit = setup.timeout.unwrap_or(QUESTION);
    let is_wanted = |label: &String, block: &dyn AnyBlock| {
        (args.blocks.is_empty() || args.blocks.iter().any(|name| name == block.name()))
            && (args.variants.is_empty() || args.variants.contains(label))
    };
    let listed = variants().into_iter().filter(|(label, block)| is_wanted(label, &**block));
    let listed = listed.map(|(label, block)| (block.name().to_string(), label, None));
    let mut wanted: Vec<Wanted> =
        if args.blocks.is_empty() && !args.scenes.is_empty() { Vec::new() } else { listed.collect() };
    wanted.extend(of_scenes(args)?);
    let folder = cache_folder("proofs").ok_or_else(|| Failure::usage("no HOME to remember proofs in"))?;
    let proofs = Proofs::open(folder).map_err(failure)?;
    let proved = |(name, label, set): &Wanted| {
        let block = match set {
            Some(set) => configured(name, set).expect("it is known").expect("it is the scene's"),
            None => find(name, label).expect("it is wanted"),
        };
        proofs.prove(&*block, &setup, limit)
    };
    tabled(args, &format!("VHDL {}", setup.hdl), limit, &wanted, proved, || proofs.remembered())
}

/// The blocks of scenes, in the widths that these have; of equal ones, the first.
fn of_scenes(args: &Args) -> Result<Vec<Wanted>, Failure> {
    let mut wanted: Vec<Wanted> = Vec::new();
    for name in &args.scenes {
        let loaded = Loaded::new(name, &args.set.set, None)?;
        let ready = Ready::new(&loaded.scene).map_err(Failure::file)?;
        for Instance { label, model, .. } in ready.wiring().instances() {
            let (block, set) = (model.name().to_string(), Some(model.generics()));
            if !wanted.iter().any(|(name, _, known)| *name == block && *known == set) {
                wanted.push((block, format!("{} {label}", loaded.scene.name()), set));
            }
        }
    }
    Ok(wanted)
}

/// `hpu check --formal --entity`.
pub fn theirs(args: &Args) -> Result<Exit, Failure> {
    let entity = entity::entity(args)?;
    let simulators = args.hdl.simulators()?;
    let limit = args.hdl.setup().timeout.unwrap_or(QUESTION);
    let configurations = || entity.configurations();
    let labels = configurations().map_err(entity::failure)?.into_iter().map(|(label, _)| label);
    let wanted: Vec<_> = labels.map(|label| (entity.top.clone(), label, None)).collect();
    let proved = |(_, label, _): &Wanted| {
        let own = configurations()?.into_iter().find(|(own, _)| own == label).expect("it is wanted");
        entity.prove(&own, &simulators, limit)
    };
    tabled(args, &format!("{} as {}", entity.top, entity.block), limit, &wanted, proved, || 0)
}

/// Proves configurations side by side, and shows the table as it grows.
fn tabled(
    args: &Args,
    of: &str,
    limit: Duration,
    wanted: &[Wanted],
    proved: impl Fn(&Wanted) -> Result<Verdict, ProofError> + Sync,
    remembered: impl Fn() -> u64,
) -> Result<Exit, Failure> {
    let mut folder = args.out.as_deref().map(Folder::open).transpose()?;
    // A missing tool is told before anything is shown.
    hpu_rtl::formal::TOOLS.iter().try_for_each(|tool| tool.version().map(drop))?;
    let jobs = args.jobs.get().get().min(wanted.len().max(1));
    // Of a block of the user's own, what cannot be asked for is seen on the way.
    if !args.theirs.is_asked() {
        let count = wanted.len();
        tell(&format!("{of}: {count} configurations, {} s a question at most, {jobs} at a time", limit.as_secs_f64()));
    }
    let control = interrupt::heed();
    let next = AtomicUsize::new(0);
    let mut rows: Vec<Row> = Vec::new();
    let mut text = String::new();
    with_progress(wanted.len() as u64, "configurations", control, || {
        thread::scope(|scope| -> Result<(), Failure> {
            let (send, done) = mpsc::channel();
            for _ in 0..jobs {
                let (send, next, proved) = (send.clone(), &next, &proved);
                scope.spawn(move || {
                    while let Some(one) = wanted.get(next.fetch_add(1, Ordering::Relaxed)) {
                        if interrupt::pressed() {
                            break;
                        }
                        let start = Instant::now();
                        let found = proved(one);
                        let seconds = start.elapsed().as_secs_f64();
                        let (block, variant, _) = one.clone();
                        if send.send(Row { block, variant, found, seconds }).is_err() {
                            break;
                        }
                    }
                });
            }
            drop(send);
            for row in done {
                // What cannot be asked for is no row.
                if let Err(ProofError::Entity(error)) = row.found {
                    return Err(entity::failure(error));
                }
                if rows.is_empty() && !args.json {
                    print(&format!("{:<22} {:<30} {:>8}  for all inputs and states\n", "block", "variant", "s"))?;
                }
                control.progress.fetch_add(1, Ordering::Relaxed);
                let shown = shown(&row, folder.as_mut())?;
                text += &shown;
                if !args.json {
                    print(&shown)?;
                }
                rows.push(row);
            }
            Ok(())
        })
    })?;
    if interrupt::pressed() {
        return Ok(Exit::Interrupted);
    }
    let count = |is: fn(&Verdict) -> bool| rows.iter().filter(|row| row.found.as_ref().is_ok_and(is)).count();
    let proved = count(|found| matches!(found, Verdict::Proved(_)));
    let refuted = count(|found| matches!(found, Verdict::Refuted(..)));
    // What is asked of one block alone is asked whole.
    let is_well = refuted == 0 && (!args.theirs.is_asked() || proved == rows.len());
    let total = format!(
        "{proved} of {} configurations proved for all inputs and states, {refuted} refuted, {} not proved; {of}{}\n",
        rows.len(),
        rows.len() - proved - refuted,
        match remembered() {
            0 => String::new(),
            count => format!("; {count} remembered"),
        },
    );
    text += &total;
    let json = json!({
        "ok": is_well,
        "hdl": of.strip_prefix("VHDL ").unwrap_or(of),
        "proved": proved,
        "refuted": refuted,
        "remembered": remembered(),
        "rows": rows.iter().map(object).collect::<Vec<_>>(),
    });
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
    // A tool that failed is no verdict.
    if let Some(error) = rows.into_iter().find_map(|row| row.found.err()) {
        return Err(failure(error));
    }
    Ok(Exit::when(is_well))
}

fn failure(error: ProofError) -> Failure {
    match error {
        ProofError::Tool(error) => error.into(),
        ProofError::Cost(error) => error.into(),
        ProofError::Netlist(why) => Failure::file(why),
        ProofError::Entity(error) => entity::failure(error),
    }
}

/// A line, and of a refutation its words.
fn shown(row: &Row, folder: Option<&mut Folder>) -> Result<String, Failure> {
    let Row { block, variant, found, seconds } = row;
    let line = |said: &str| format!("{block:<22} {variant:<30} {seconds:>8.2}  {said}");
    Ok(match found {
        Ok(Verdict::Proved(_)) => line("proved") + "\n",
        Ok(Verdict::Open(why)) => line(&format!("not proved: {}", why.trim_end().replace('\n', "\n  "))) + "\n",
        Err(error) => line(&format!("not proved: {}", error.to_string().replace('\n', "\n  "))) + "\n",
        Ok(Verdict::Refuted(about, around)) => {
            let mut text = verdict(&line(&format!("refuted, by {about}:")), false) + "\n";
            let last = around.rows.len() as u64;
            around.lines(last).iter().for_each(|line| text += &format!("    {line}\n"));
            text + &waveform(around, last, &format!("{block}-{variant}"), folder)?
        }
    })
}

fn object(row: &Row) -> Value {
    let Row { block, variant, found, seconds } = row;
    let (said, why) = match found {
        Ok(Verdict::Proved(_)) => ("proved", Value::Null),
        Ok(Verdict::Refuted(about, around)) => {
            let (columns, history) = around.table(around.rows.len() as u64);
            ("refuted", json!({ "about": about, "columns": columns, "history": history }))
        }
        Ok(Verdict::Open(why)) => ("open", json!(why)),
        Err(error) => ("open", json!(error.to_string())),
    };
    let solvers = match found {
        Ok(Verdict::Proved(solvers)) => json!(solvers),
        _ => Value::Null,
    };
    json!({ "block": block, "variant": variant, "verdict": said, "why": why, "solvers": solvers, "seconds": seconds })
}
