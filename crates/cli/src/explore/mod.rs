//! `hpu explore`: the page in which a scene is explored in a browser.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use hpu_study::map::SceneText;
use serde_json::{Map, Value, json};

use crate::scene::{self, Set};
use crate::shell::{Exit, Failure, Single, print, program};

/// Write a page that runs scenes in a browser
///
/// The page is one file that asks no network for anything: open it, or mail it. It runs the same loop to the same bits,
/// and draws each change of a value at once. This verb writes the page with a scene to begin with, also one of your
/// own. hpu carries the page if it was built with `--features explorer`; else `testbench/explorer.sh` makes it.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene to begin with: its file, or the name of a shipped one [default: hybrid-wall]
    scene: Option<String>,
    #[command(flatten)]
    set: Set,
    /// File to write
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Page that testbench/explorer.sh has made [default: what hpu carries, else explorer.html in the folder of this
    /// program, or above it]
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
}

/// The name of the page that testbench/explorer.sh makes.
const PAGE: &str = "explorer.html";

/// The page that this program carries.
#[cfg(feature = "explorer")]
const CARRIED: Option<&str> = Some(include_str!(env!("HPU_EXPLORER")));
#[cfg(not(feature = "explorer"))]
const CARRIED: Option<&str> = None;

/// The place in the page that tells it how to begin.
const START: [&str; 2] = [r#"<script type="application/json" id="start">"#, "{}</script>"];

/// Runs `hpu explore`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let out = Single::open(&args.out)?;
    let start = start(args)?;
    let (place, page) = match (&args.page, CARRIED) {
        (None, Some(page)) => (PathBuf::from(PAGE), Cow::Borrowed(page)),
        (asked, _) => {
            let place = asked.clone().map_or_else(made, Ok)?;
            let page = fs::read_to_string(&place).map_err(|error| Failure::at(&place, error))?;
            (place, Cow::Owned(page))
        }
    };
    let Some((before, after)) = page.split_once(&START.concat()) else {
        return Err(Failure::at(&place, "this is no page of testbench/explorer.sh"));
    };
    // Within a script no `<` may begin an end tag.
    let start = start.to_string().replace('<', "\\u003c");
    out.write(format!("{before}{}{start}</script>{after}", START[0]))?;
    print(&format!("wrote {}\n", args.out.display()))?;
    Ok(Exit::Fine)
}

/// Returns the place of the page that was made beside this program.
fn made() -> Result<PathBuf, Failure> {
    let program = program::code()?;
    let places = program.ancestors().skip(1).take(3).map(|folder| folder.join(PAGE));
    places.into_iter().find(|place| place.is_file()).ok_or_else(|| {
        let remedy = "make it by testbench/explorer.sh in the sources of hpu, or name it by --page";
        Failure::new(Exit::NoTool, format!("there is no {PAGE} beside this program; {remedy}"))
    })
}

/// Returns the scene and the overrides that the page begins with.
fn start(args: &Args) -> Result<Value, Failure> {
    let Some(scene) = &args.scene else { return Ok(json!({ "set": overrides(args) })) };
    let source = scene::source(scene)?;
    let named = (source.name.as_str(), source.text.as_str());
    let (text, experiment) = SceneText::read(named, &args.set.set, &mut |file: &str| source.load(file))?;
    if source.is_shipped {
        return Ok(json!({ "scene": experiment.name, "set": overrides(args) }));
    }
    let mut files = Map::new();
    for (name, bytes) in text.files {
        let data = String::from_utf8(bytes);
        let data = data.map_err(|_| Failure::at(Path::new(&name), "a page takes data files of text alone"))?;
        files.insert(name, data.into());
    }
    Ok(json!({ "scene": { "name": text.name, "text": text.text, "files": files }, "set": overrides(args) }))
}

fn overrides(args: &Args) -> Map<String, Value> {
    args.set.set.iter().map(|(key, value)| (key.clone(), value.as_str().into())).collect()
}
