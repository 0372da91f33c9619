//! The gallery of scenes: each shipped scene with its text and the pictures of its run.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use hpu_cli::answers::{self, Watch};
use hpu_cosim::scene::{Shipped, shipped};
use hpu_cosim::{AnySimulation, Control, SceneFile};
use hpu_signal::{Cycle, Observe};
use mdbook_driver::errors::{Error, Result};

use crate::links::Carried;

/// Watches a run, which therefore records the trace that its pictures need.
struct Watching;

impl Observe for Watching {
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// A scene, its first sentence, and its pictures as files of their names.
struct Shown {
    about: String,
    pictures: Vec<(&'static str, Vec<u8>)>,
}

/// Runs a scene as it is written, and draws the pictures of its motion.
fn shown(scene: &Shipped) -> Result<Shown> {
    let message = |error: &dyn std::fmt::Display| Error::msg(format!("scene {}: {error}", scene.name));
    let parsed = scene.parse(&[]).map_err(|error| message(&error))?;
    let source = SceneFile::find(scene.name).map_err(|error| message(&error))?;
    let (control, total) = (Control::default(), AtomicU64::new(0));
    let watch = Watch::Kept { control: &control, total: &total };
    let watching = |_: &AnySimulation| Ok(Watching);
    let ran = answers::run(&source, &[], None, watch, watching).map_err(|error| message(&error))?;
    let (finished, recorded) = ran.ok_or_else(|| message(&"it was stopped"))?;
    let pictures = finished.pictures(&recorded).map_err(|error| message(&error))?;
    // The range of each word is on the page of the run; here the motion is shown, or the bits of a recording.
    let all = pictures.len();
    let moving = pictures.into_iter().filter(|picture| picture.name != "bits" || all == 1);
    let pictures = moving.map(|picture| (picture.name, picture.png)).collect();
    Ok(Shown { about: answers::first_sentence(&parsed.about), pictures })
}

/// Returns the gallery, and has the book carry its pictures.
pub fn gallery(carried: &mut Carried) -> Result<String> {
    let scenes = shipped();
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Option<Result<Shown>>>> = scenes.iter().map(|_| Mutex::default()).collect();
    let jobs = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(scene) = scenes.get(at) else { break };
                    *done[at].lock().unwrap_or_else(PoisonError::into_inner) = Some(shown(scene));
                }
            });
        }
    });
    let mut page = String::new();
    for (scene, shown) in scenes.iter().zip(done) {
        let name = scene.name;
        let shown = shown.into_inner().unwrap_or_else(PoisonError::into_inner).expect("every scene was run")?;
        page += &format!("## {name}\n\n{}\n\n", shown.about);
        page += &format!("[Its file](../../../testbench/scenes/{name}.toml). `hpu run {name} -o out` makes:\n\n");
        for (picture, png) in shown.pictures {
            let place = format!("pictures/{name}-{picture}.png");
            page += &format!("<img src=\"{place}\" alt=\"{name}: {picture}\" loading=\"lazy\">\n");
            carried.made(&place, png);
        }
        page.push('\n');
    }
    Ok(page)
}
