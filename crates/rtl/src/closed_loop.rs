//! A loop closed around the VHDL itself: GHDL simulates the wiring, and calls this crate's shared library, which holds
//! the plant and the emulator, at every edge.
//!
//! GHDL 2.0 cannot read signals inside a design by external names. So the wiring is simulated from a copy in the work
//! directory, its text as it is but for one instance added before the end of its architecture: a probe that tells every
//! net. The library, `libhpu_rtl.so`, is looked for beside the running executable and in `deps` there, which is where
//! cargo leaves it.

use std::path::{Path, PathBuf};
use std::time::Instant;
use std::{env, fs};

use hpu_cosim::scene::{Experiment, shipped_file};
use hpu_cosim::{Ready, Rig, TheLoop};
use hpu_datapath::{block_by_name, registry};

use crate::ghdl::{GhdlError, Library};
use crate::loop_bench::{LOOP_BRIDGE, loop_bench, probe, probe_instance};
use crate::package::package;
use crate::report::{CheckRow, tally};
use crate::testbench::VECTOR_READER;
use crate::vector::{Header, literal};

/// Name of the shared library.
const LIBRARY: &str = "libhpu_rtl.so";

/// A scene to run in VHDL.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LoopOptions {
    /// Directory with `<block>.vhd`.
    pub hdl: PathBuf,
    /// The scene's file, as messages shall call it.
    pub name: String,
    /// The scene's text.
    pub text: String,
    /// Keys and values that replace the scene's.
    pub overrides: Vec<(String, String)>,
    /// Directory of the data files that the scene names; those of shipped scenes are at hand anyway.
    pub data: PathBuf,
    /// Clock edges.
    pub edges: u64,
}

/// Runs a scene in VHDL beside the emulator and compares every net after every edge. The row's block is the wiring, its
/// variant the scene.
///
/// # Errors
///
/// [`GhdlError`] when GHDL or the shared library is missing, the VHDL does not analyse, or the scene has no datapath. A
/// mismatch is a result.
pub fn closed_loop(options: &LoopOptions) -> Result<CheckRow, GhdlError> {
    let start = Instant::now();
    let LoopOptions { name, text, overrides, data, edges, .. } = options;
    let scene = parse(name, text, overrides, data).map_err(|said| refused(name, said))?;
    let session = Ready::new(&scene).map_err(|error| refused(name, error.to_string()))?;
    let library = library(&options.hdl, session.wiring())?;
    let wiring = session.wiring().block();
    let shared = shared_library()?;
    fs::copy(&shared, library.dir().join(LIBRARY)).map_err(|error| GhdlError::Io(shared, error))?;

    let mut generics: Vec<_> = wiring.generics().into_iter().map(|(name, value)| (name, literal(value))).collect();
    generics.push(("FORMAT", Header::of(wiring).to_string()));
    let set: Vec<_> = overrides.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let environment = [
        ("HPU_SCENE_NAME", name.clone()),
        ("HPU_SCENE_TEXT", text.clone()),
        ("HPU_SCENE_SET", set.join("\n")),
        ("HPU_SCENE_DATA", data.display().to_string()),
        ("HPU_LOOP_EDGES", edges.to_string()),
    ];
    let unit = format!("tb_loop_{}", wiring.name());
    let said = library.run(&unit, &generics, &environment)?;
    let tally = tally(&said).ok_or_else(|| GhdlError::Failed { step: format!("finish {unit}"), said })?;
    let mut row = CheckRow::new(wiring.name(), scene.name());
    row.add(Ok(tally), true, start.elapsed().as_secs_f64());
    Ok(row)
}

fn refused(name: &str, said: String) -> GhdlError {
    GhdlError::Failed { step: format!("close the loop of {name}"), said }
}

/// The scene and the number of edges that the runner asks its child process for.
pub(crate) fn scene_from_environment() -> Result<(Experiment, u64), String> {
    let get = |name: &str| env::var(name).map_err(|error| format!("{name}: {error}"));
    let set = get("HPU_SCENE_SET")?;
    let overrides: Vec<_> = set
        .lines()
        .filter_map(|line| line.split_once('='))
        .map(|(key, value)| (key.to_string(), value.to_string()))
        .collect();
    let scene = parse(&get("HPU_SCENE_NAME")?, &get("HPU_SCENE_TEXT")?, &overrides, get("HPU_SCENE_DATA")?.as_ref())?;
    let edges = get("HPU_LOOP_EDGES")?.parse().map_err(|error| format!("HPU_LOOP_EDGES: {error}"))?;
    Ok((scene, edges))
}

fn parse(name: &str, text: &str, overrides: &[(String, String)], data: &Path) -> Result<Experiment, String> {
    let mut load = |file: &str| fs::read(data.join(file)).or_else(|error| shipped_file(file).map_err(|_| error));
    Experiment::parse(name, text, overrides, &mut load).map_err(|error| error.to_string())
}

/// Analyses the blocks, the probed copy of the wiring, and its testbench.
fn library(hdl: &Path, wiring: &TheLoop) -> Result<Library, GhdlError> {
    let name = wiring.name();
    let by_default = block_by_name(name).expect("a wiring is a block");
    let path = hdl.join(format!("{name}.vhd"));
    let text = fs::read_to_string(&path).map_err(|error| GhdlError::Io(path.clone(), error))?;
    // The last one ends the architecture.
    let Some(end) = text.to_lowercase().rfind("end architecture") else {
        return Err(refused(name, format!("{} has no `end architecture`", path.display())));
    };
    let probed = format!("{}{}{}", &text[..end], probe_instance(wiring), &text[end..]);
    let packages = [
        ("vector_reader.vhd".to_string(), VECTOR_READER.to_string()),
        ("loop_bridge.vhd".to_string(), LOOP_BRIDGE.to_string()),
        (format!("{name}_pkg.vhd"), package(&*by_default)),
        (format!("probe_{name}.vhd"), probe(wiring)),
    ];
    let files: Vec<_> = registry()
        .iter()
        .filter(|block| TheLoop::all().iter().all(|wiring| wiring.name() != block.name()))
        .map(|block| hdl.join(format!("{}.vhd", block.name())))
        .collect();
    let benches = [(format!("{name}.vhd"), probed), (format!("tb_loop_{name}.vhd"), loop_bench(&*by_default))];
    Library::analyse(&packages, &files, &benches)
}

/// The shared library of this build.
fn shared_library() -> Result<PathBuf, GhdlError> {
    let exe = env::current_exe().map_err(|error| GhdlError::Io(PathBuf::from("the executable"), error))?;
    let beside = exe.parent().unwrap_or(Path::new("."));
    let places = [beside.join("deps").join(LIBRARY), beside.join(LIBRARY)];
    places.iter().find(|place| place.exists()).cloned().ok_or_else(|| GhdlError::NoLibrary(places.to_vec()))
}
