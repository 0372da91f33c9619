//! The price of a scene's loop: its cost, the time that its torque takes, whether the loop notices that time, and the
//! cost of a bit.

mod text;

use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use hpu_cosim::scene::{Datapath, Experiment, Loop, Scene};
use hpu_cosim::{Control, Wired, WiredSimulation};
use hpu_farm::units::on_threads;
use hpu_rtl::{Cache, Cost, Counts, Hdl, Placed, Setup};
use hpu_signal::Format;
use hpu_study::limits::settling::{Settling, settling};

use crate::shell::{Failure, or_reason, with_progress};

/// The price of a loop in the widths of its scene.
pub(crate) struct Price {
    pub(crate) scene: String,
    pub(crate) block: &'static str,
    pub(crate) tools: [String; 3],
    pub(crate) hdl: Hdl,
    pub(crate) clock_hz: u64,
    pub(crate) cost: Cost,
    /// Label and entity of each instance, and its primitives by Yosys alone.
    pub(crate) parts: Vec<(&'static str, &'static str, Counts)>,
    pub(crate) knobs: Vec<Knob>,
    /// Clocks that the loop has for computing its torque.
    pub(crate) given: Option<u32>,
    pub(crate) notices: Option<Result<Settling, String>>,
}

/// A width of the scene, and the loop with a bit less and a bit more of it.
pub(crate) struct Knob {
    pub(crate) key: &'static str,
    pub(crate) now: String,
    /// The changed width, and the loop's primitives with it, or the reason why there are none.
    pub(crate) other: [(String, Result<Counts, String>); 2],
}

/// Returns the price of a scene's loop, by the tools or from the cache; `None` when it was stopped.
pub fn price(
    experiment: &Experiment,
    setup: &Setup,
    cache: &Cache,
    jobs: NonZeroUsize,
    control: &'static Control,
) -> Result<Option<Price>, Failure> {
    let simulation = WiredSimulation::new(experiment).map_err(Failure::file)?;
    let wiring = simulation.wiring();
    if !wiring.is_hardware() {
        return Err(Failure::file("a law in floats has no price; write model.datapath = \"words\""));
    }
    // Places the loop with three seeds, while nothing else can begin.
    let cost = with_progress(1, "loops placed", control, || cache.cost(wiring.block(), setup))?;
    let mut price = Price {
        scene: experiment.name.clone(),
        block: wiring.name(),
        tools: cache.tools().clone(),
        hdl: setup.hdl.clone(),
        clock_hz: experiment.clock.frequency_hz(),
        cost,
        parts: Vec::new(),
        knobs: Vec::new(),
        given: None,
        notices: None,
    };
    // An arm's parts take minutes each, and its loop has no clock to compare with the scene's unless it fits.
    let Experiment::Axis(scene) = experiment else { return Ok(Some(price)) };
    let (instances, knobs) = (wiring.instances(), knobs(scene));
    let parts = instances.len();
    let changed: Vec<_> = knobs.iter().flat_map(|(_, _, other)| other).map(|(_, scene)| scene).collect();
    let count = parts + changed.len();
    let found = syntheses(count, jobs, control, |index| match index.checked_sub(parts) {
        None => part(scene, index, setup, cache),
        Some(index) => counts(changed[index], setup, cache),
    });
    let Some(mut found) = found.into_iter().collect::<Option<Vec<_>>>() else { return Ok(None) };
    let changed = found.split_off(parts);
    for (instance, counts) in instances.iter().zip(found) {
        price.parts.push((instance.label, instance.model.name(), counts?.map_err(Failure::file)?));
    }
    let mut changed = changed.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter();
    for (key, now, other) in knobs {
        let other = other.map(|(name, _)| (name, changed.next().expect("two of each")));
        price.knobs.push(Knob { key, now, other });
    }
    if matches!(scene.method.kind, Loop::Hybrid | Loop::Conventional) && scene.model.datapath == Datapath::Words {
        price.given = Some(1 + scene.method.settling);
        if let Some(clocks) = price.clocks() {
            // A loop that has enough time is run with one more clock of delay, so that there is an effect to see.
            let late = (clocks - 1).max(scene.method.settling + 1);
            match settling(scene, late, control) {
                Ok(None) => return Ok(None),
                Ok(Some(found)) => price.notices = Some(Ok(found)),
                Err(why) => price.notices = Some(Err(why.to_string())),
            }
        }
    }
    Ok(Some(price))
}

/// Does so many syntheses, `jobs` at a time; `None` for those that had not begun when they were stopped.
pub(crate) fn syntheses<T: Send>(
    count: usize,
    jobs: NonZeroUsize,
    control: &'static Control,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<Option<T>> {
    let counted = |index| {
        let found = work(index);
        control.progress.fetch_add(1, Ordering::Relaxed);
        found
    };
    with_progress(count as u64, "syntheses", control, || on_threads(count, jobs, control, counted))
}

/// Returns the primitives of an instance in the loop of a scene, or the reason why a tool refused it.
fn part(scene: &Scene, index: usize, setup: &Setup, cache: &Cache) -> Result<Result<Counts, String>, Failure> {
    let experiment = Experiment::Axis(scene.clone());
    let simulation = WiredSimulation::new(&experiment).map_err(Failure::file)?;
    or_reason(cache.counts(&*simulation.wiring().instances()[index].model, setup))
}

/// Returns the primitives of the loop of a scene, or the reason why there are none.
fn counts(scene: &Scene, setup: &Setup, cache: &Cache) -> Result<Result<Counts, String>, Failure> {
    let experiment = Experiment::Axis(scene.clone());
    match WiredSimulation::new(&experiment) {
        Ok(simulation) => or_reason(cache.counts(simulation.wiring().block(), setup)),
        Err(error) => Ok(Err(error.to_string())),
    }
}

type Widths = (&'static str, String, [(String, Scene); 2]);

/// Returns the scene's widths by their keys, each with a bit less and a bit more.
fn knobs(scene: &Scene) -> Vec<Widths> {
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut changed = scene.clone();
        change(&mut changed);
        changed
    };
    let method = &scene.method;
    let bits = |key, now: u32, put: fn(&mut Scene, u32)| {
        let other = [now - 1, now + 1].map(|bits| (bits.to_string(), with(&|scene| put(scene, bits))));
        (key, now.to_string(), other)
    };
    let gain = |key, now: Format, put: fn(&mut Scene, Format)| {
        let other = [one_less(now), Format::new(false, now.int(), now.frac() + 1).ok()];
        let other = other.map(|format| format.unwrap_or(now));
        (key, now.to_string(), other.map(|format| (format.to_string(), with(&|scene| put(scene, format)))))
    };
    let mut all = vec![
        bits("method.position_bits", method.position_bits, |scene, bits| scene.method.position_bits = bits),
        gain("method.stiffness_format", method.stiffness_format, |scene, to| scene.method.stiffness_format = to),
        gain("method.damping_format", method.damping_format, |scene, to| scene.method.damping_format = to),
        bits("method.pwm.bits", method.pwm.bits, |scene, bits| scene.method.pwm.bits = bits),
    ];
    if matches!(method.kind, Loop::Hybrid | Loop::Conventional) {
        let velocity =
            bits("method.velocity_bits", method.velocity_bits, |scene, bits| scene.method.velocity_bits = bits);
        all.insert(3, velocity);
    }
    all
}

/// Returns a gain's format without its last fraction bit; or without its first bit if it has no fraction.
fn one_less(format: Format) -> Option<Format> {
    let (int, frac) = (format.int(), format.frac());
    if frac > 0 { Format::new(false, int, frac - 1).ok() } else { Format::new(false, int - 1, 0).ok() }
}

/// Returns the clocks of all placements in megahertz; `None` where there was no room or no path.
pub fn placed(cost: &Cost) -> Vec<Option<f64>> {
    let mhz = |placed: &Placed| match placed {
        Placed::Mhz(mhz) => Some(*mhz),
        Placed::NoRoom | Placed::NoPath => None,
    };
    cost.placed.iter().flatten().map(mhz).collect()
}

impl Price {
    /// Returns the clock cycles of the scene that the longest path takes.
    pub(crate) fn clocks(&self) -> Option<u32> {
        self.cost.path_ns().map(|path_ns| ((path_ns * 1e-9 * self.clock_hz as f64).ceil() as u32).max(1))
    }
}
