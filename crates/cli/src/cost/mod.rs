//! `hpu cost`: the cost of a block in an FPGA.

use std::path::PathBuf;
use std::sync::Mutex;

use hpu_cosim::scene::{DutScene, Experiment};
use hpu_rtl::{Cost, CostError, Counts, HX8K_BRAM, HX8K_CELLS, Placed};
use hpu_study::units;
use serde_json::{Value, json};

use crate::block::{find, known, labels};
use crate::cache::{Remember, or_reason};
use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::jobs::Jobs;
use crate::scene::{self, Loaded};
use crate::terminal::{print, print_json, verdict, with_progress};
use crate::{hdl, interrupt, widths_price};

/// Synthesise a block with Yosys and place it with nextpnr: cells and speed in an iCE40 HX8K
///
/// Counts are of the block alone. It is timed between registers: a clocked block by its fastest clock, a combinational
/// one by its longest path, register to register; both are the median of three placements. A block that does not fit is
/// counted for the ECP5 instead, and not timed. What was measured is remembered: a small block takes seconds the first
/// time, a large one minutes, a core and up to a gigabyte.
#[derive(clap::Args)]
pub struct Args {
    /// The block
    #[arg(required_unless_present = "scene")]
    name: Option<String>,
    /// Configuration of the block, of those that `hpu block NAME` lists; may be repeated. Without it, all of them
    #[arg(long = "variant", value_name = "LABEL", requires = "name")]
    variants: Vec<String>,
    /// The loop of a scene instead, in the scene's widths: its price, and that of a bit more or less; or a design of
    /// your own, each port on a pin
    #[arg(long, value_name = "SCENE", conflicts_with = "name")]
    scene: Option<String>,
    #[command(flatten)]
    set: scene::Set,
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    remember: Remember,
    #[command(flatten)]
    hdl: hdl::Vhdl,
    /// Write cost.json and cost.txt into this folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `hpu cost`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    match (&args.scene, &args.name) {
        (Some(scene), _) => of_scene(args, scene),
        (None, Some(name)) => of_block(args, name),
        (None, None) => Err(Failure::usage("name a block, or write --scene SCENE")),
    }
}

/// Writes the two files of a cost, if a folder is given.
fn write(folder: Option<Folder>, json: &Value, text: &str) -> Result<(), Failure> {
    let Some(mut folder) = folder else { return Ok(()) };
    folder.write("cost.json", format!("{json:#}\n"))?;
    folder.write("cost.txt", text)?;
    folder.commit()
}

fn of_scene(args: &Args, scene: &str) -> Result<Exit, Failure> {
    let loaded = Loaded::new(scene, &args.set.set, None)?;
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    if let Experiment::Dut(scene) = &loaded.scene {
        return of_design(args, scene, folder);
    }
    let cache = args.remember.open()?;
    let Some(price) = widths_price::price(&loaded.scene, &args.hdl.setup(), &cache, interrupt::heed())? else {
        return Ok(Exit::Interrupted);
    };
    let (text, json) = (price.text(), price.json());
    write(folder, &json, &text)?;
    if args.json {
        print_json(&json)?
    } else {
        print(&text)?
    }
    Ok(Exit::Fine)
}

/// Prices a design of the user's own.
fn of_design(args: &Args, scene: &DutScene, folder: Option<Folder>) -> Result<Exit, Failure> {
    let mut simulators = args.hdl.simulators()?;
    if let Some(cache) = &args.remember.cache {
        simulators.cache.clone_from(cache);
    }
    let control = interrupt::heed();
    let cost = with_progress(1, "designs placed", control, || simulators.cost(scene));
    let cost = cost.map_err(|error| Failure::from(hpu_cosim::dut::Fault::from(error)))?;
    let (target, Counts { lut4, ff, carry, bram, dsp }) =
        cost.ecp5.map_or(("ice40-hx8k", cost.ice40), |ecp5| ("ecp5", ecp5));
    let fits = cost.ecp5.is_none();
    let mut text = header(&scene.dut.top, true).replace("  fmax MHz", "");
    let shown_dsp = if fits { "-".to_string() } else { dsp.to_string() };
    text += &format!(
        "{:<30} {target:<12} {lut4:>6} {ff:>6} {carry:>6} {bram:>5} {shown_dsp:>4} {:>6}\n",
        scene.name, cost.cells
    );
    if !fits {
        text += &format!(
            "  does not fit hx8k: needs {} of {HX8K_CELLS} logic cells, {} of {HX8K_BRAM} block RAMs\n",
            cost.cells, cost.ice40.bram
        );
    }
    let mut clocks = Vec::new();
    for (index, clock) in scene.dut.clocks.iter().enumerate() {
        let asked_mhz = scene.clock.frequency_hz() as f64 / f64::from(clock.divide) / 1e6;
        let fmax_mhz = cost.fmax_mhz(index);
        let placed = &cost.clocks[index].1;
        let each: Vec<_> = placed.iter().map(|mhz| mhz.map_or("-".to_string(), |mhz| format!("{mhz:.2}"))).collect();
        text += &match fmax_mhz {
            Some(mhz) => format!(
                "clock {}: {mhz:.2} MHz, the median of {}; {asked_mhz} MHz are asked: {}\n",
                clock.port,
                each.join(", "),
                if mhz >= asked_mhz { "it is in time" } else { "it is too slow" }
            ),
            None if fits => format!("clock {}: no way from register to register was placed\n", clock.port),
            None => String::new(),
        };
        clocks.push(json!({
            "port": clock.port,
            "fmax_mhz": fmax_mhz,
            "placed_mhz": placed,
            "asked_mhz": asked_mhz,
            "in_time": fmax_mhz.map(|mhz| mhz >= asked_mhz),
        }));
    }
    text += &format!("each port on a pin, constants too; by {}\n", cost.tools);
    let json = json!({
        "scene": scene.name, "top": scene.dut.top, "target": target, "lut4": lut4, "ff": ff, "carry": carry, "bram": bram,
        "dsp": (!fits).then_some(dsp), "cells": cost.cells, "fits": fits,
        "hx8k": { "cells": [cost.cells, HX8K_CELLS], "bram": [cost.ice40.bram, HX8K_BRAM] },
        "clocks": clocks, "tools": cost.tools,
    });
    write(folder, &json, &text)?;
    if args.json {
        print_json(&json)?
    } else {
        print(&text)?
    }
    Ok(Exit::Fine)
}

fn of_block(args: &Args, name: &str) -> Result<Exit, Failure> {
    known(name)?;
    if let Some((key, _)) = args.set.set.first() {
        return Err(Failure::usage(format!("a block has no key `{key}`; write --scene SCENE, or --variant LABEL")));
    }
    let variants = if args.variants.is_empty() { labels(name) } else { args.variants.clone() };
    // Variants that do not exist, and places that cannot be written to, are refused before anything runs.
    let blocks = variants.iter().map(|variant| find(name, variant)).collect::<Result<Vec<_>, _>>()?;
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let cache = args.remember.open()?;

    let control = interrupt::heed();
    let setup = args.hdl.setup();
    let clocked = blocks.iter().all(|block| block.clocked());
    let mut text = header(name, clocked);
    let mut rows = Vec::new();
    let mut good = true;
    if !args.json {
        print(&text)?;
    }
    // A row is printed as soon as it and all rows before it are complete.
    let found: Vec<Mutex<Option<Result<Cost, CostError>>>> = variants.iter().map(|_| Mutex::new(None)).collect();
    let all: Vec<usize> = (0..variants.len()).collect();
    let unit = |index: usize, _: &_| {
        // A block belongs to the thread that made it.
        let block = find(name, &variants[index]).ok()?;
        let cost = cache.cost(&*block, &setup);
        *found[index].lock().expect("nobody panics with it") = Some(cost);
        (!interrupt::pressed()).then(|| Ok(String::new()))
    };
    units::run_some(&all, args.jobs.get(), control, unit, |_, done| {
        done.map_err(Failure::file)?;
        while let Some(variant) = variants.get(rows.len())
            && let Some(cost) = found[rows.len()].lock().expect("nobody panics with it").take()
        {
            let cost = or_reason(cost)?;
            let line = row(variant, clocked, &cost);
            if !args.json {
                print(&if cost.is_ok() { line.clone() } else { verdict(&line, false) })?;
            }
            good &= cost.is_ok();
            text += &line;
            rows.push(object(variant, clocked, &cost));
        }
        Ok::<(), Failure>(())
    })?;
    if interrupt::pressed() {
        return Ok(Exit::Interrupted);
    }

    let json = json!({ "block": name, "hdl": setup.hdl.to_string(), "variants": rows });
    write(folder, &json, &text)?;
    if args.json {
        print_json(&json)?;
    }
    Ok(if good { Exit::Fine } else { Exit::BadFile })
}

fn header(name: &str, clocked: bool) -> String {
    let speed = if clocked { "fmax MHz" } else { "path ns" };
    format!(
        "{name:<30} {:<12} {:>6} {:>6} {:>6} {:>5} {:>4} {:>6} {speed:>9}\n",
        "target", "lut4", "ff", "carry", "bram", "dsp", "cells"
    )
}

/// Returns the primitives of the HX8K with the name of that FPGA; for a block that is too large, those of the ECP5.
pub fn target(cost: &Cost) -> (&'static str, Counts) {
    cost.ecp5.map_or(("ice40-hx8k", cost.ice40), |ecp5| ("ecp5", ecp5))
}

/// Returns the speed: megahertz for a clocked block, nanoseconds for any other.
pub fn speed(clocked: bool, cost: &Cost) -> Option<f64> {
    // nextpnr prints no more than hundredths.
    let speed = if clocked { cost.fmax_mhz() } else { cost.path_ns() };
    speed.map(|speed| (speed * 100.0).round() / 100.0)
}

fn row(variant: &str, clocked: bool, cost: &Result<Cost, String>) -> String {
    let cost = match cost {
        Ok(cost) => cost,
        Err(failure) => return format!("{variant:<30} {}\n", failure.trim_end().replace('\n', "\n  ")),
    };
    let (target, Counts { lut4, ff, carry, bram, dsp }) = target(cost);
    let dsp = if cost.fits() { "-".to_string() } else { dsp.to_string() };
    let speed = speed(clocked, cost).map_or("-".to_string(), |speed| format!("{speed:.2}"));
    let line = format!(
        "{variant:<30} {target:<12} {lut4:>6} {ff:>6} {carry:>6} {bram:>5} {dsp:>4} {:>6} {speed:>9}\n",
        cost.cells
    );
    if cost.fits() {
        return line;
    }
    line + &format!(
        "  does not fit hx8k: needs {} of {HX8K_CELLS} logic cells, {} of {HX8K_BRAM} block RAMs\n",
        cost.cells, cost.ice40.bram
    )
}

/// Returns the clocks of all placements in megahertz; `None` where there was no room or no path.
pub fn placed(cost: &Cost) -> Vec<Option<f64>> {
    let mhz = |placed: &Placed| match placed {
        Placed::Mhz(mhz) => Some(*mhz),
        Placed::NoRoom | Placed::NoPath => None,
    };
    cost.placed.iter().flatten().map(mhz).collect()
}

/// Returns a variant as JSON.
pub fn object(variant: &str, clocked: bool, cost: &Result<Cost, String>) -> Value {
    let cost = match cost {
        Ok(cost) => cost,
        Err(failure) => return json!({ "name": variant, "failure": failure }),
    };
    let (target, Counts { lut4, ff, carry, bram, dsp }) = target(cost);
    let speed = speed(clocked, cost);
    json!({
        "name": variant,
        "target": target,
        "lut4": lut4,
        "ff": ff,
        "carry": carry,
        "bram": bram,
        "dsp": (!cost.fits()).then_some(dsp),
        "cells": cost.cells,
        "fits": cost.fits(),
        "hx8k": { "cells": [cost.cells, HX8K_CELLS], "bram": [cost.ice40.bram, HX8K_BRAM] },
        "fmax_mhz": if clocked { speed } else { None },
        "path_ns": if clocked { None } else { speed },
        "placed_mhz": placed(cost),
        "failure": null,
    })
}
