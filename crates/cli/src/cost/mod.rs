//! `hpu cost`: the cost of a block in an FPGA.

use std::collections::BTreeMap;
use std::path::PathBuf;

use hpu_cosim::scene::{DutScene, Experiment};
use hpu_farm::units;
use hpu_page::{Cell, Column, Field, Page, Table};
use hpu_rtl::dut::DutCost;
use hpu_rtl::{CacheFolder, Cost, CostError, Counts, HX8K_BRAM, HX8K_CELLS};
use serde_json::{Value, json};

use crate::block::{find, known, labels};
use crate::page::show;
use crate::price::{self, placed};
use crate::scene::{self, Loaded};
use crate::shell::{
    Exit, Failure, Folder, Jobs, Remember, hdl, interrupt, or_reason, print, print_json, verdict, with_progress,
};

/// Synthesise a block with Yosys and place it with nextpnr: cells and speed in an iCE40 HX8K
///
/// Counts are of the block alone. It is timed between registers: a clocked block by its fastest clock, a combinational
/// one by its longest path, register to register; both are the median of three placements. A block that does not fit is
/// counted for the ECP5 instead, and not timed. What was measured is remembered: a small block takes seconds the first
/// time, a large one minutes, a core and up to a gigabyte, the largest loop ten minutes.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The block
    #[arg(required_unless_present = "scene")]
    name: Option<String>,
    /// Configuration of the block, of those that `hpu block NAME` lists; may be repeated. Without it, all of them
    #[arg(id = "variant", long, value_name = "LABEL", requires = "name")]
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

/// Returns the page of the price of a scene's loop; `None` when interrupted.
pub fn answer(args: &Args) -> Result<Option<Page>, Failure> {
    let scene = args.scene.as_deref().unwrap_or_default();
    let loaded = Loaded::new(scene, &args.set.set, None)?;
    if let Experiment::Dut(scene) = &loaded.scene {
        return design_cost(args, scene).map(|cost| Some(design(scene, &cost)));
    }
    let setup = args.hdl.setup();
    let price = price::price(&loaded.scene, &setup, &args.remember.open(setup.timeout)?, interrupt::heed())?;
    Ok(price.map(|price| {
        let mut page = Page::default();
        page.note(price.text());
        page
    }))
}

/// Writes the two files of a cost, if a folder is given.
fn write(folder: Option<Folder>, json: &Value, text: &str) -> Result<(), Failure> {
    let Some(mut folder) = folder else { return Ok(()) };
    folder.write("cost.json", format!("{json:#}\n"))?;
    folder.write("cost.txt", text)?;
    folder.commit().map(drop)
}

fn of_scene(args: &Args, scene: &str) -> Result<Exit, Failure> {
    let loaded = Loaded::new(scene, &args.set.set, None)?;
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    if let Experiment::Dut(scene) = &loaded.scene {
        return of_design(args, scene, folder);
    }
    let setup = args.hdl.setup();
    let cache = args.remember.open(setup.timeout)?;
    let Some(price) = price::price(&loaded.scene, &setup, &cache, interrupt::heed())? else {
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
    let page = design(scene, &design_cost(args, scene)?);
    write(folder, &page.json(), &page.text())?;
    show(&page, args.json)?;
    Ok(Exit::Fine)
}

fn design_cost(args: &Args, scene: &DutScene) -> Result<DutCost, Failure> {
    let mut simulators = args.hdl.simulators();
    if let Some(cache) = &args.remember.cache {
        simulators.cache = CacheFolder::new(Some(cache.clone()), "costs");
    }
    let control = interrupt::heed();
    let cost = with_progress(1, "designs placed", control, || simulators.cost(scene));
    cost.map_err(|error| Failure::from(error.at(scene)))
}

/// Returns the page of a design's cost.
fn design(scene: &DutScene, cost: &DutCost) -> Page {
    let (target, Counts { lut4, ff, carry, bram, dsp }) =
        cost.ecp5.map_or(("ice40-hx8k", cost.ice40), |ecp5| ("ecp5", ecp5));
    let fits = cost.ecp5.is_none();
    let dsp = (!fits).then_some(dsp);
    let heads = ["lut4", "ff", "carry", "bram", "dsp", "cells"].map(|head| Column::integer("", head));
    let columns = [Column::text("", &scene.dut.top), Column::text("", "target")].into_iter().chain(heads);
    let mut row = Table::new("", columns);
    let [name, target_cell] = [scene.name.as_str(), target].map(Cell::new);
    row.add(
        [name, target_cell]
            .into_iter()
            .chain([lut4, ff, carry, bram].map(Cell::new))
            .chain([dsp.into(), cost.cells.into()]),
    );
    let mut page = Page::default();
    page.table(row);
    page.data("scene", &scene.name).data("top", &*scene.dut.top).data("target", target).data("lut4", lut4);
    page.data("ff", ff).data("carry", carry).data("bram", bram).data("dsp", dsp).data("cells", cost.cells);
    page.data("fits", fits).data("hx8k", hx8k(cost.cells, cost.ice40.bram));
    if !fits {
        page.note(format!("  {}", too_large(cost.cells, cost.ice40.bram)));
    }
    for (index, clock) in scene.dut.clocks.iter().enumerate() {
        let asked_mhz = scene.clock.frequency_hz() as f64 / f64::from(clock.divide) / 1e6;
        let fmax_mhz = cost.fmax_mhz(index);
        let placed = &cost.clocks[index].1;
        let mut of_clock = Page::default();
        if let Some(mhz) = fmax_mhz {
            let each = placed.iter().map(|mhz| mhz.map_or("-".to_string(), |mhz| format!("{mhz:.2}")));
            let each = each.collect::<Vec<_>>().join(", ");
            let said = if mhz >= asked_mhz { "it is in time" } else { "it is too slow" };
            of_clock.note(format!(
                "clock {}: {mhz:.2} MHz, the median of {each}; {asked_mhz} MHz are asked: {said}",
                clock.port
            ));
        } else if fits {
            of_clock.note(format!("clock {}: no way from register to register was placed", clock.port));
        }
        of_clock.data("port", &*clock.port).data("fmax_mhz", fmax_mhz).data("placed_mhz", json!(placed));
        of_clock.data("asked_mhz", asked_mhz).data("in_time", fmax_mhz.map(|mhz| mhz >= asked_mhz));
        page.section("clocks", of_clock);
    }
    page.data("tools", &cost.tools).note(format!("each port on a pin, constants too; by {}", cost.tools));
    page
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
    let setup = args.hdl.setup();
    let cache = args.remember.open(setup.timeout)?;

    let control = interrupt::heed();
    let clocked = blocks.iter().all(|block| block.clocked());
    let fields = fields(name, clocked);
    let mut rows = Table::new("variants", fields.iter().map(|field| field.column.clone())).gap(1);
    let mut good = true;
    if !args.json {
        print(&rows.head())?;
    }
    // A row is printed as soon as it and all rows before it are complete.
    let mut found: BTreeMap<usize, Result<Cost, CostError>> = BTreeMap::new();
    let all: Vec<usize> = (0..variants.len()).collect();
    let unit = |index: usize, _: &_| {
        // A block belongs to the thread that made it.
        let block = find(name, &variants[index]).ok()?;
        let cost = cache.cost(&*block, &setup);
        (!interrupt::pressed()).then_some(Ok(cost))
    };
    units::run_some(&all, args.jobs.get(), control, unit, |index, cost| {
        found.insert(index, cost.map_err(Failure::file)?);
        while let Some(variant) = variants.get(rows.rows().len())
            && let Some(cost) = found.remove(&rows.rows().len())
        {
            let row = (variant.clone(), or_reason(cost)?);
            good &= row.1.is_ok();
            rows.add(fields.iter().map(|field| field.cell(&row)));
            if !args.json {
                print(&rows.last(&verdict))?;
            }
        }
        Ok::<(), Failure>(())
    })?;
    if interrupt::pressed() {
        return Ok(Exit::Interrupted);
    }

    let mut page = Page::default();
    page.data("block", name).data("hdl", setup.hdl.to_string()).table(rows);
    write(folder, &page.json(), &page.text())?;
    if args.json {
        print_json(&page.json())?;
    }
    Ok(if good { Exit::Fine } else { Exit::BadFile })
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

/// A variant's name, and its cost or the reason why it has none.
type VariantCost = (String, Result<Cost, String>);

/// Returns the columns of a block's variants.
fn fields(name: &str, clocked: bool) -> Vec<Field<'static, VariantCost>> {
    // A variant that failed has no figures.
    fn of(column: Column, cell: impl Fn(&Cost) -> Cell + 'static) -> Field<'static, VariantCost> {
        column.of(move |(_, cost): &VariantCost| cost.as_ref().map_or(Cell::absent(), &cell))
    }
    let count = |key: &str, least, count: fn(Counts) -> u64| {
        of(Column::integer(key, key).least(least), move |cost| count(target(cost).1).into())
    };
    let dsp = |cost: &Cost| (!cost.fits()).then_some(target(cost).1.dsp).into();
    let in_text = if clocked { "fmax MHz" } else { "path ns" };
    let speed_if = move |asked: bool| move |cost: &Cost| speed(clocked, cost).filter(|_| asked).into();
    let remark = |(_, cost): &VariantCost| match cost {
        Err(failure) => Cell::from(format!("\n  {}", failure.trim_end().replace('\n', "\n  "))).good(false),
        Ok(cost) if !cost.fits() => format!("\n  {}", too_large(cost.cells, cost.ice40.bram)).into(),
        Ok(_) => Cell::absent(),
    };
    vec![
        Column::text("name", name).least(30).of(|(name, _): &VariantCost| name.clone()),
        of(Column::text("target", "target").least(12), |cost| target(cost).0.into()),
        count("lut4", 6, |counts| counts.lut4),
        count("ff", 6, |counts| counts.ff),
        count("carry", 6, |counts| counts.carry),
        count("bram", 5, |counts| counts.bram),
        of(Column::integer("dsp", "dsp").least(4), dsp),
        of(Column::integer("cells", "cells").least(6), |cost| cost.cells.into()),
        of(Column::flag("fits", "").data(), |cost| cost.fits().into()),
        of(Column::text("hx8k", "").data(), |cost| hx8k(cost.cells, cost.ice40.bram).into()),
        of(Column::number("", in_text).said().least(9), move |cost| {
            speed(clocked, cost).map_or(Cell::new("-"), |speed| format!("{speed:.2}").into())
        }),
        of(Column::number("fmax_mhz", "").data(), speed_if(clocked)),
        of(Column::number("path_ns", "").data(), speed_if(!clocked)),
        of(Column::text("placed_mhz", "").data(), |cost| json!(placed(cost)).into()),
        Column::text("failure", "").data().of(|(_, cost): &VariantCost| cost.as_ref().err().cloned()),
        Column::text("", "").said().of(remark),
    ]
}

fn hx8k(cells: u64, bram: u64) -> Value {
    json!({ "cells": [cells, HX8K_CELLS], "bram": [bram, HX8K_BRAM] })
}

fn too_large(cells: u64, bram: u64) -> String {
    format!("does not fit hx8k: needs {cells} of {HX8K_CELLS} logic cells, {bram} of {HX8K_BRAM} block RAMs")
}

/// Returns a variant as JSON.
pub fn object(variant: &str, clocked: bool, cost: &Result<Cost, String>) -> Value {
    let row = [(variant.to_string(), cost.clone())];
    Table::of("", &row, fields("", clocked)).json()[0].take()
}
