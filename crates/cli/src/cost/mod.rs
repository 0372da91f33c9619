//! `hpu cost`: the cost of a block in an FPGA.

use std::borrow::Borrow;
use std::path::PathBuf;
use std::sync::Mutex;

use hpu_cosim::scene::{DutScene, Experiment};
use hpu_farm::units;
use hpu_page::{Cell, Column, Field, Page, Place, Table};
use hpu_rtl::dut::{DutCost, at};
use hpu_rtl::{Cache, CacheFolder, Cost, Counts, Error, HX8K_BRAM, HX8K_CELLS, Setup};
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
    let cache = args.remember.open(setup.timeout)?;
    let price = price::price(&loaded.scene, &setup, &cache, args.jobs.get(), interrupt::heed())?;
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
    let Some(price) = price::price(&loaded.scene, &setup, &cache, args.jobs.get(), interrupt::heed())? else {
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
    args.hdl.agree_with_design(scene)?;
    let mut simulators = args.hdl.simulators();
    if let Some(cache) = &args.remember.cache {
        simulators.cache = CacheFolder::new(Some(cache.clone()), "costs");
    }
    let control = interrupt::heed();
    let cost = with_progress(1, "designs placed", control, || simulators.cost(scene));
    cost.map_err(|error| at(error, scene).into())
}

/// Returns the page of a design's cost.
fn design(scene: &DutScene, cost: &DutCost) -> Page {
    let measured = Ok(Cost { ice40: cost.ice40, cells: cost.cells, ecp5: cost.ecp5, placed: None });
    let row = Priced { name: scene.name.clone(), label: String::new(), clocked: true, cost: measured };
    let name = Column::text("", &scene.dut.top).of(|row: &Priced| row.name.clone());
    let table = Table::of("", [&row], [name].into_iter().chain(counted([0; 7])));
    let mut page = Page::default();
    page.table(table).data("scene", &scene.name).data("top", &*scene.dut.top);
    for field in counted([0; 7]).chain(judged()).filter(|field| field.column.is_in(Place::Json)) {
        if let Some(value) = field.cell(&row).value.json() {
            page.data(field.column.key(), value);
        }
    }
    if cost.ecp5.is_some() {
        page.note(format!("  {}", too_large(cost.cells, cost.ice40.bram)));
    }
    let fits = cost.ecp5.is_none();
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
        of_clock.data("port", &*clock.port).data("fmax_mhz", fmax_mhz).data("placed_mhz", placed);
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

    let clocked = blocks.iter().all(|block| block.clocked());
    let fields = fields(name, clocked);
    let mut rows = Table::new("variants", fields.iter().map(|field| field.column.clone())).gap(1);
    let mut good = true;
    if !args.json {
        print(&rows.head())?;
    }
    let plan: Vec<_> = variants.iter().map(|variant| (name, variant.as_str())).collect();
    let done = measured(&plan, &args.jobs, &cache, &setup, |row| {
        good &= row.cost.is_ok();
        rows.add(fields.iter().map(|field| field.cell(&row)));
        if args.json { Ok(()) } else { print(&rows.last(&verdict)) }
    })?;
    if !done {
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

/// A block with the label of its configuration, and its cost or the reason why it has none.
pub struct Priced {
    /// Name of the block.
    pub name: String,
    /// Label of its configuration.
    pub label: String,
    /// Whether it has a clock.
    pub clocked: bool,
    /// Its cost, or why a tool refused it.
    pub cost: Result<Cost, String>,
}

impl Priced {
    /// Returns the primitives of the HX8K with the name of that FPGA; for a block that is too large, those of the ECP5.
    fn target(&self) -> Option<(&'static str, Counts)> {
        let cost = self.cost.as_ref().ok()?;
        Some(cost.ecp5.map_or(("ice40-hx8k", cost.ice40), |ecp5| ("ecp5", ecp5)))
    }

    /// Returns the speed: megahertz for a clocked block, nanoseconds for any other.
    pub fn speed(&self) -> Option<f64> {
        let cost = self.cost.as_ref().ok()?;
        // nextpnr prints no more than hundredths.
        let speed = if self.clocked { cost.fmax_mhz() } else { cost.path_ns() };
        speed.map(|speed| (speed * 100.0).round() / 100.0)
    }

    /// Returns the cost of a block that is too large for the HX8K.
    pub fn too_large(&self) -> Option<&Cost> {
        self.cost.as_ref().ok().filter(|cost| !cost.fits())
    }
}

/// Measures the cost of each block of a plan, which lists names with labels of configurations. Calls `take` with each
/// row as soon as it and all rows before it are measured. Returns whether all are, and `false` when interrupted.
pub fn measured(
    plan: &[(&str, &str)],
    jobs: &Jobs,
    cache: &Cache,
    setup: &Setup,
    mut take: impl FnMut(Priced) -> Result<(), Failure>,
) -> Result<bool, Failure> {
    let found: Vec<_> = plan.iter().map(|_| Mutex::new(None::<(bool, Result<Cost, Error>)>)).collect();
    let all: Vec<usize> = (0..plan.len()).collect();
    let unit = |index: usize, _: &_| {
        // A block belongs to the thread that made it.
        let block = find(plan[index].0, plan[index].1).ok()?;
        let cost = cache.cost(&*block, setup);
        *found[index].lock().expect("nobody panics with it") = Some((block.clocked(), cost));
        (!interrupt::pressed()).then(|| Ok(String::new()))
    };
    let mut taken = 0;
    units::run_some(&all, jobs.get(), interrupt::heed(), unit, |_, done| {
        done.map_err(Failure::file)?;
        while let Some(next) = found.get(taken)
            && let Some((clocked, cost)) = next.lock().expect("nobody panics with it").take()
        {
            let (name, label) = plan[taken];
            take(Priced { name: name.into(), label: label.into(), clocked, cost: or_reason(cost)? })?;
            taken += 1;
        }
        Ok::<(), Failure>(())
    })?;
    Ok(!interrupt::pressed())
}

/// Returns a column's cells from the cost of a row; a row that failed has none.
fn of<T: Borrow<Priced> + 'static>(column: Column, cell: impl Fn(&Cost) -> Cell + 'static) -> Field<'static, T> {
    column.of(move |row: &T| row.borrow().cost.as_ref().map_or(Cell::absent(), &cell))
}

/// Returns the columns of the target and of the counts, at least so wide in text.
pub fn counted<T: Borrow<Priced> + 'static>(widths: [usize; 7]) -> impl Iterator<Item = Field<'static, T>> {
    let [target, lut4, ff, carry, bram, dsp, cells] = widths;
    let counts = |row: &T| row.borrow().target();
    let count = move |key: &str, least, count: fn(Counts) -> u64| {
        let cell = move |row: &T| counts(row).map_or(Cell::absent(), |(_, counts)| count(counts).into());
        Column::integer(key, key).least(least).of(cell)
    };
    let name = move |row: &T| counts(row).map_or(Cell::absent(), |(name, _)| name.into());
    let multipliers = move |row: &T| match counts(row) {
        Some((_, counts)) => Cell::from(row.borrow().too_large().map(|_| counts.dsp)),
        None => Cell::absent(),
    };
    [
        Column::text("target", "target").least(target).of(name),
        count("lut4", lut4, |counts| counts.lut4),
        count("ff", ff, |counts| counts.ff),
        count("carry", carry, |counts| counts.carry),
        count("bram", bram, |counts| counts.bram),
        Column::integer("dsp", "dsp").least(dsp).only(&[Place::Text, Place::Json]).of(multipliers),
        // The HX8K has no multipliers, which a file says by a number.
        count("dsp", 0, |counts| counts.dsp).only(&[Place::File]),
        of(Column::integer("cells", "cells").file("hx8k_cells").least(cells), |cost| cost.cells.into()),
    ]
    .into_iter()
}

/// Returns the columns that say in data whether the cost fits the HX8K.
pub fn judged<T: Borrow<Priced> + 'static>() -> impl Iterator<Item = Field<'static, T>> {
    let hx8k = |cost: &Cost| json!({ "cells": [cost.cells, HX8K_CELLS], "bram": [cost.ice40.bram, HX8K_BRAM] });
    [
        of(Column::integer("hx8k_bram", "").only(&[Place::File]), |cost| cost.ice40.bram.into()),
        of(Column::flag("fits", "").file("fits_hx8k").data(), |cost| cost.fits().into()),
        of(Column::text("hx8k", "").only(&[Place::Json]), move |cost| hx8k(cost).into()),
    ]
    .into_iter()
}

/// Returns the columns of speeds in JSON, and of a tool's refusal.
pub fn timed<T: Borrow<Priced> + 'static>() -> impl Iterator<Item = Field<'static, T>> {
    let speed = |key: &str, clocked: bool| {
        Column::number(key, "").only(&[Place::Json]).of(move |row: &T| match &row.borrow().cost {
            Ok(_) => Cell::from(row.borrow().speed().filter(|_| row.borrow().clocked == clocked)),
            Err(_) => Cell::absent(),
        })
    };
    [
        speed("fmax_mhz", true),
        speed("path_ns", false),
        of(Column::text("placed_mhz", "").only(&[Place::Json]), |cost| hpu_page::Value::of(placed(cost)).into()),
        Column::text("failure", "").data().of(|row: &T| row.borrow().cost.as_ref().err().cloned()),
    ]
    .into_iter()
}

/// Returns the columns of a block's variants.
fn fields(name: &str, clocked: bool) -> Vec<Field<'static, Priced>> {
    let remark = |row: &Priced| match (&row.cost, row.too_large()) {
        (Err(failure), _) => Cell::from(format!("\n  {}", failure.trim_end().replace('\n', "\n  "))).good(false),
        (_, Some(cost)) => format!("\n  {}", too_large(cost.cells, cost.ice40.bram)).into(),
        _ => Cell::absent(),
    };
    let speed = Column::number("", if clocked { "fmax MHz" } else { "path ns" }).said().least(9);
    let speed = speed.of(|row: &Priced| match (&row.cost, row.speed()) {
        (Err(_), _) => Cell::absent(),
        (Ok(_), speed) => speed.map_or("-".to_string(), |speed| format!("{speed:.2}")).into(),
    });
    let label = Column::text("name", name).least(30).of(|row: &Priced| row.label.clone());
    let data = judged().chain(timed());
    let remark = Column::text("", "").said().of(remark);
    [label].into_iter().chain(counted([12, 6, 6, 6, 5, 4, 6])).chain([speed]).chain(data).chain([remark]).collect()
}

fn too_large(cells: u64, bram: u64) -> String {
    format!("does not fit hx8k: needs {cells} of {HX8K_CELLS} logic cells, {bram} of {HX8K_BRAM} block RAMs")
}
