//! Maps: cells are those of `hpu map`, and the plan of cells is its refinement.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::num::NonZeroUsize;

use hpu_cosim::{Control, SceneFile};
use hpu_study::map::{self, CellLimits, Map, Method, Plan};
use serde_json::{Value, json};

use crate::ask;

const X: &str = "wall.stiffness=1..6 N.m/rad:7";
const Y: &str = "wall.damping=0.05..0.5 mN.m.s/rad:5";
const SET: [&str; 1] = ["run.duration=1 s"];

/// Fills a map as the page does, with the class of each cell from `class`. Returns all classes, and the cells that were
/// run.
fn filled(columns: usize, rows: usize, class: &dyn Fn(usize) -> String) -> (Vec<String>, BTreeSet<usize>) {
    let mut classes = vec![Value::Null; columns * rows];
    let mut run = BTreeSet::new();
    loop {
        let plan = ask(&json!({ "do": "plan", "columns": columns, "rows": rows, "classes": classes })).json;
        let wanted: Vec<_> =
            plan["wanted"].as_array().expect("cells").iter().map(|cell| cell.as_u64().expect("a cell")).collect();
        for &cell in &wanted {
            let cell = cell as usize;
            assert!(run.insert(cell), "cell {cell} is asked for twice");
            classes[cell] = class(cell).into();
        }
        if wanted.is_empty() {
            for pair in plan["inferred"].as_array().expect("pairs") {
                let [cell, like] = [0, 1].map(|at| pair[at].as_u64().expect("a cell") as usize);
                classes[cell] = classes[like].clone();
            }
            return (classes.iter().map(|class| class.as_str().expect("a class").to_string()).collect(), run);
        }
    }
}

#[test]
fn a_plan_finds_a_boundary_without_running_all_cells() {
    let (columns, rows) = (21, 11);
    let class =
        |cell: usize| if cell % columns > 8 + cell / columns / 2 { "limit_cycle" } else { "settled" }.to_string();
    let (classes, run) = filled(columns, rows, &class);
    assert_eq!(classes, (0..columns * rows).map(class).collect::<Vec<_>>());
    assert!(run.len() < 120, "{}", run.len());
}

#[test]
fn cells_are_those_of_the_command() {
    let request = json!({ "do": "cell", "scene": "hybrid-wall", "set": SET, "x": X, "y": Y });
    let class = |cell: usize| {
        let mut request = request.clone();
        request["cell"] = cell.into();
        ask(&request).json["class"].as_str().expect("a class").to_string()
    };
    let (classes, run) = filled(7, 5, &class);
    let file = SceneFile::find("hybrid-wall").expect("a scene");
    let set: Vec<_> = SET.iter().map(|text| text.split_once('=').expect("a pair")).collect();
    let set: Vec<_> = set.into_iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let axes = (X.parse().expect("an axis"), Y.parse().expect("an axis"));
    let methods = vec![Method { label: "scene".into(), set: Vec::new() }];
    let map = Map::new((&file.name, &file.text), &set, axes, methods, &mut |name| file.load(name)).expect("a map");
    let plan = Plan { full: false, limits: CellLimits::default(), jobs: NonZeroUsize::MIN };
    let mut kept = BTreeSet::new();
    let found = map.run(plan, Default::default(), &Control::new(), |index, _| {
        kept.insert(index);
        Ok::<_, Infallible>(())
    });
    let found = found.expect("no error").expect("a whole map");
    let names: Vec<_> = (0..found.len()).map(|index| map::class_name(map::class(&found, index))).collect();
    assert_eq!(classes, names);
    assert_eq!(run, kept);
    assert!(names.contains(&"settled") && names.contains(&"limit_cycle"), "{names:?}");
}

#[test]
fn a_map_tells_its_axes() {
    let map = ask(&json!({ "do": "map", "scene": "hybrid-wall", "x": X, "y": "method.pwm.bits=9..12:4" })).json;
    assert_eq!(map["x"]["texts"][0], "1 N.m/rad");
    assert_eq!(map["x"]["values"].as_array().expect("values").len(), 7);
    assert_eq!(map["y"]["values"], json!([9.0, 10.0, 11.0, 12.0]));
}
