//! The memory of maps and runs, counted by an allocator of our own. A cell adds only its result to the memory of a map.
//! A run takes no more than its allowance, however long it is.

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::{io, mem};

use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};
use hpu_study::map::{self, Axis, CellLimits, Found, Map, Method, Plan};

/// An allocator that counts the bytes in use, and the most that were ever in use.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: the system's allocator does everything; only numbers are added.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(now, Ordering::Relaxed);
        // SAFETY: as the caller guarantees.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller guarantees.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Returns the greatest number of bytes that some work has in use, beyond those in use before.
fn peak<T>(work: impl FnOnce() -> T) -> (usize, T) {
    let before = NOW.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let made = work();
    (PEAK.load(Ordering::Relaxed) - before, made)
}

/// Held by a test that counts, so that it counts alone.
static ALONE: Mutex<()> = Mutex::new(());

fn a_map(rows: usize) -> Map {
    let text = include_str!("../../../testbench/scenes/free-motion.toml");
    let axis = |text: &str| text.parse::<Axis>().unwrap();
    let axes =
        (axis("device.coulomb_friction=0.1..10 mN.m:10"), axis(&format!("device.initial_speed=1..9 rad/s:{rows}")));
    let methods = vec![Method { label: "scene".into(), set: Vec::new() }];
    let set = [("run.duration".to_string(), "100 us".to_string())];
    let mut load = |_: &str| Err(io::ErrorKind::NotFound.into());
    Map::new(("free-motion.toml", text), &set, axes, methods, &mut load).unwrap()
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_a_cell_adds_to_the_memory_of_a_map_is_what_was_found_of_it() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let of = |rows: usize| {
        let map = a_map(rows);
        let plan = Plan { full: true, limits: CellLimits::default(), jobs: NonZeroUsize::MIN };
        let run = || map.run(plan, BTreeMap::new(), &Control::default(), |_, _| Ok::<_, Infallible>(()));
        let (while_run, found) = peak(run);
        let found = found.unwrap().expect("not stopped");
        let replay = |index: usize| format!("hpu run free-motion --set device.initial_speed={index}");
        let (as_csv, ()) = peak(|| map::csv(io::sink(), &map, &found, "hpu map", replay).unwrap());
        let (as_parquet, ()) = peak(|| map::parquet(io::sink(), &map, &found, "hpu map", replay).unwrap());
        [while_run, as_csv, as_parquet]
    };
    // Both maps have more cells than a group of the Parquet file.
    let (few, many) = (420, 630);
    let [run, csv, parquet]: [f64; 3] = {
        let (few_bytes, many_bytes) = (of(few), of(many));
        let cells = (10 * (many - few)) as f64;
        std::array::from_fn(|at| (many_bytes[at] as f64 - few_bytes[at] as f64) / cells)
    };
    // The result, and the entry in the list of units to run.
    let found = (mem::size_of::<Option<Found>>() + mem::size_of::<usize>()) as f64;
    assert!(run <= found + 2.0, "{run} bytes a cell, {found} are found");
    assert!(found <= 208.0, "{found} bytes");
    assert!(csv.abs() <= 1.0, "{csv} bytes a cell for the CSV");
    assert!(parquet.abs() <= 2.0, "{parquet} bytes a cell for the Parquet file");
}

#[test]
fn a_run_takes_the_memory_that_it_may_however_many_rows_it_has() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let of = |duration: &str| {
        let set = [("record.plant_rate", "50 MHz"), ("run.duration", duration)];
        let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
        let text = include_str!("../../../testbench/scenes/free-motion.toml");
        let mut load = |_: &str| Err(io::ErrorKind::NotFound.into());
        let scene = hpu_cosim::scene::Experiment::parse("free-motion.toml", text, &set, &mut load).unwrap();
        let simulation = WiredSimulation::new(&scene).unwrap();
        let (bytes, rows) = peak(|| {
            let mut trace = simulation.brief_trace().bounded(1 << 16, &simulation.judged());
            let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
            assert!(summary.complete);
            trace.came()
        });
        (bytes, rows)
    };
    let (of_few, of_many) = (of("80 ms"), of("160 ms"));
    assert_eq!((of_few.1, of_many.1), (4_000_001, 8_000_001));
    // 65536 values are half a megabyte; the loop itself takes as much again. All rows together would be 64 and 128 MB.
    // Here one more row adds less than a hundredth of a byte.
    assert!(of_few.0 < 2_000_000, "{} bytes", of_few.0);
    assert!(100 * of_many.0.saturating_sub(of_few.0) < 4_000_000, "{} bytes, then {}", of_few.0, of_many.0);
}
