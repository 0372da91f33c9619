//! Stability maps: their axes, their cells one at a time, and the order in which cells are run.

use std::cell::RefCell;
use std::rc::Rc;

use hpu_cosim::Control;
use hpu_page::quantities::si;
use hpu_study::command::set_options;
use hpu_study::map::{Axis, Cell, CellLimits, Class, Map, Method, Refinement, class_name, classes};
use serde_json::{Value, json};

use crate::request::{Refusal, Request};

fn read(request: &Request) -> Result<Map, Refusal> {
    let source = request.source()?;
    source.runnable()?;
    let axis = |name: &str| request.text(name)?.parse::<Axis>().map_err(|error| Refusal::from(error.to_string()));
    let methods = vec![Method { label: "scene".into(), set: Vec::new() }];
    let mut load = |file: &str| source.load(file);
    let map = Map::new(source.named(), &source.set, (axis("x")?, axis("y")?), methods, &mut load);
    map.map_err(|error| Refusal::from(error.to_string()))
}

thread_local! {
    /// The latest map with its request, so that cells of one map read the scene once.
    static LATEST: RefCell<Option<(String, Rc<Map>)>> = RefCell::default();
}

/// Returns the map of a request; the latest one is kept.
fn latest(request: &Request) -> Result<Rc<Map>, Refusal> {
    let key = request.of(&["scene", "set", "x", "y"]);
    let known =
        LATEST.with_borrow(|latest| latest.as_ref().filter(|(of, _)| *of == key).map(|(_, map)| Rc::clone(map)));
    if let Some(map) = known {
        return Ok(map);
    }
    let map = Rc::new(read(request)?);
    LATEST.set(Some((key, Rc::clone(&map))));
    Ok(map)
}

/// Returns the axes of a map: keys, units and the texts of their values; and the names of all classes.
pub(crate) fn map(request: &Request) -> Result<Value, Refusal> {
    let map = latest(request)?;
    let told = |axis: &Axis| {
        let texts: Vec<_> = (0..axis.cells()).map(|cell| axis.text(cell)).collect();
        json!({ "key": axis.key(), "unit": map.unit(axis), "values": axis.values(), "texts": texts })
    };
    let names: Vec<_> = classes().map(class_name).collect();
    Ok(json!({ "x": told(&map.x), "y": told(&map.y), "classes": names }))
}

/// Runs a cell of a map.
pub(crate) fn cell(request: &Request) -> Result<Value, Refusal> {
    let map = latest(request)?;
    let index = request.whole("cell")?;
    if index >= map.len() {
        return Err(format!("no cell {index}; the map has {}", map.len()).into());
    }
    let set = map.overrides(map.point(index));
    let run = map.experiment(map.point(index)).map_err(|error| error.to_string().into());
    let run = run.and_then(|experiment| Cell::run(&experiment, CellLimits::default(), &Control::new()));
    let class = run.as_ref().ok().and_then(Option::as_ref).map(Class::of);
    let said = match &run {
        Ok(Some(cell)) => amplitude(cell, map.unit(&map.x).starts_with("N/m")),
        Ok(None) => String::new(),
        Err(why) => why.to_string(),
    };
    Ok(json!({ "cell": index, "class": class_name(class), "said": said, "set": set_options(&set) }))
}

/// Returns amplitude and frequency of a cell's motion.
fn amplitude(cell: &Cell, is_linear: bool) -> String {
    let unit = if is_linear { "m" } else { "rad" };
    let amplitude = cell.amplitude.map(|amplitude| format!("amplitude {}", si(amplitude, unit)));
    let frequency = cell.frequency_hz.filter(|hz| *hz > 0.0).map(|hz| si(hz, "Hz"));
    amplitude.into_iter().chain(frequency).collect::<Vec<_>>().join(", ")
}

/// Returns the cells to run next, given the classes of those that were run (`null` for the others), and the inferred
/// cells, each with the cell whose class it has. Nothing is wanted of a complete map.
pub(crate) fn plan(request: &Request) -> Result<Value, Refusal> {
    let (columns, rows, classes) = (request.whole("columns")?, request.whole("rows")?, request.options("classes"));
    // Both are numbers of the page, and their product may have no number.
    if columns < 2 || rows < 2 || columns.checked_mul(rows) != Some(classes.len()) {
        return Err(format!("{} classes of {columns} by {rows} cells", classes.len()).into());
    }
    let mut grid = Refinement::new(columns, rows);
    loop {
        let wanted: Vec<_> = grid.wanted().iter().filter(|cell| classes[**cell].is_none()).collect();
        if !wanted.is_empty() {
            return Ok(json!({ "wanted": wanted, "inferred": [] }));
        }
        if !grid.refine(|cell| classes[cell]) {
            return Ok(json!({ "wanted": [], "inferred": grid.inferred() }));
        }
    }
}
