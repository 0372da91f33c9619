//! Measures ranges and losses of every signal of a scene: in one run, in a set of scenes, in random motion.

use hpu_cosim::scene::{Experiment, OutcomeKind};
use hpu_cosim::{Control, Driver, NetUse, Simulation, Wired, WiredSimulation};
use hpu_signal::{Cycle, Format, Signal, SignalUse};

use super::Device;
use super::noise::Beside;
use super::{Loss, SignalRow};
use crate::Error;

/// Ranges and losses of every signal.
#[derive(Clone, PartialEq, Debug)]
pub struct Measured {
    /// The name of the wiring.
    pub wiring: &'static str,
    /// Every net, in the order of the wiring.
    pub rows: Vec<SignalRow>,
    /// Clock edges.
    pub edges: u64,
    /// Seconds of motion.
    pub motion_s: f64,
    /// The verdict of each scene; empty for a recording and for random motion.
    pub outcomes: Vec<OutcomeKind>,
    /// For each verdict, the share of the judged window in which the wall sees penetration.
    pub contact_shares: Vec<Option<f64>>,
}

/// Makes a scene ready whose loop runs in words.
///
/// # Errors
///
/// Why the scene cannot be run, or that its loop is not in words.
pub(super) fn simulation(experiment: &Experiment) -> Result<WiredSimulation<'_>, Error> {
    experiment.in_words()?;
    WiredSimulation::new(experiment).map_err(Error::from)
}

/// Runs a scene and returns the ranges and losses of every signal; `None` when `control` stopped it.
///
/// # Errors
///
/// Why the scene cannot be run, or that its loop is not in words.
pub fn measured(experiment: &Experiment, control: &Control) -> Result<Option<Measured>, Error> {
    let simulation = simulation(experiment)?;
    let mut beside = beside(experiment, &simulation);
    let mut trace = simulation.brief_trace();
    let summary = simulation.run(simulation.driver(), &mut trace, &mut beside, control);
    if !summary.complete {
        return Ok(None);
    }
    beside.finish(summary.edges);
    let nets: Vec<_> = summary.nets.iter().map(|net| (net.signal.clone(), net.usage)).collect();
    let mut rows = rows(&nets, &beside);
    first_losses(&simulation, &mut rows, summary.edges);
    Ok(Some(Measured {
        wiring: simulation.wiring().name(),
        rows,
        edges: summary.edges,
        motion_s: summary.motion_s,
        outcomes: summary.outcome().into_iter().collect(),
        contact_shares: summary.outcome().map(|_| summary.contact_share).into_iter().collect(),
    }))
}

/// Returns an observer that computes the law beside the words during the run of a ready scene.
pub fn beside(experiment: &Experiment, simulation: &WiredSimulation) -> Beside {
    let wiring = simulation.wiring();
    let inputs = wiring.block().inputs().len();
    Beside::new(&wiring.nets(), inputs, &wiring.instances(), &experiment.asked(), experiment.law(&wiring))
}

/// Returns one row for each net of a wiring.
pub(super) fn rows(nets: &[(Signal, SignalUse)], beside: &Beside) -> Vec<SignalRow> {
    let rows = nets.iter().enumerate().map(|(index, (signal, usage))| {
        let measured = (usage.min <= usage.max).then_some((usage.min, usage.max));
        let format = signal.format;
        let needed = match (beside.span(index), measured) {
            // A counter that wraps needs only enough bits to tell its two ends apart.
            (Some((least, most)), _) => bits(false, 0, (most - least) as i128),
            (None, Some((min, max))) => bits(format.is_signed(), format.value(min), format.value(max)),
            (None, None) => 0,
        };
        let told = beside.losses(index).unwrap_or([Loss { edges: 0, worst: f64::NAN, first: None }; 2]);
        let loss = |told: Loss, edges| if edges == 0 { Loss::default() } else { Loss { edges, ..told } };
        SignalRow {
            name: signal.name,
            format,
            unit: signal.unit,
            measured,
            headroom_bits: format.width().cast_signed() - needed.max(1).cast_signed(),
            rounded: loss(told[0], usage.rounded),
            overflowed: loss(told[1], usage.overflowed),
            sqnr_db: beside.sqnr_db(index),
            recommended: None,
        }
    });
    rows.collect()
}

/// Returns how many upper bits of a net a run left unused; `None` where no word was seen.
pub fn idle_bits(NetUse { signal, usage, .. }: &NetUse) -> Option<u32> {
    let format = signal.format;
    let ends = [usage.min, usage.max].map(|word| format.value(word));
    // Bits that the VHDL never sets have no known range; theirs is not the format's.
    let used = (ends[0] <= ends[1]).then(|| bits(format.is_signed(), ends[0], ends[1]).max(1));
    used.and_then(|used| format.width().checked_sub(used))
}

/// Returns the least width of a word that holds both ends.
pub(super) fn bits(signed: bool, min: i128, max: i128) -> u32 {
    (1..=64)
        .find(|&width| {
            let format = if signed { Format::signed(width) } else { Format::unsigned(width) };
            format.holds(min) && format.holds(max)
        })
        .unwrap_or(64)
}

/// Finds the first losses of nets whose blocks do not report them: repeats the run until each of these nets has lost
/// bits.
fn first_losses(simulation: &WiredSimulation, rows: &mut [SignalRow], last: u64) {
    let mut left: Vec<_> = rows
        .iter()
        .enumerate()
        .flat_map(|(net, row)| [(net, false, row.rounded), (net, true, row.overflowed)])
        .filter(|(_, _, loss)| loss.edges > 0 && loss.first.is_none())
        .map(|(net, above, _)| (net, above))
        .collect();
    let mut run = simulation.closed_loop();
    if !simulation.gates_drive() {
        run.wiring_mut().rest_modulator();
    }
    while !left.is_empty() && run.edge() < last && run.world().over().is_none() {
        match simulation.driver() {
            Driver::Events => run.leap(last, &mut ()),
            Driver::Clock => run.step(),
        }
        let (uses, edge) = (run.wiring().uses(), Cycle(run.edge()));
        left.retain(|&(net, above)| {
            let row = &mut rows[net];
            let (edges, loss) =
                if above { (uses[net].overflowed, &mut row.overflowed) } else { (uses[net].rounded, &mut row.rounded) };
            if edges > 0 {
                loss.first = Some(edge);
            }
            edges == 0
        });
    }
}

/// Merges several runs: joins the ranges, adds up the losses, keeps the worst loss of all, and the first loss of the
/// first run that has any.
///
/// # Errors
///
/// When the runs have different wirings or widths.
pub fn together(names: &[String], runs: Vec<Measured>) -> Result<Measured, Error> {
    let mut runs = runs.into_iter().zip(names);
    let (mut all, first_name) = runs.next().ok_or("no run")?;
    for (run, name) in runs {
        if run.wiring != all.wiring {
            return Err(format!(
                "{first_name} is a {}, {name} a {}: write scenes of one wiring",
                all.wiring, run.wiring
            )
            .into());
        }
        for (row, other) in all.rows.iter_mut().zip(run.rows) {
            if row.format != other.format {
                let (name_1, name_2) = (first_name, name);
                return Err(format!(
                    "{} is {} in {name_1} and {} in {name_2}: give them the same widths by --set",
                    row.name, row.format, other.format
                )
                .into());
            }
            join(row, other);
        }
        all.edges += run.edges;
        all.motion_s += run.motion_s;
        all.outcomes.extend(run.outcomes);
        all.contact_shares.extend(run.contact_shares);
    }
    Ok(all)
}

fn join(row: &mut SignalRow, other: SignalRow) {
    let signed = row.format;
    row.measured = match (row.measured, other.measured) {
        (Some((a, b)), Some((c, d))) => {
            let least = if signed.value(a) <= signed.value(c) { a } else { c };
            let most = if signed.value(b) >= signed.value(d) { b } else { d };
            Some((least, most))
        }
        (one, two) => one.or(two),
    };
    row.headroom_bits = row.headroom_bits.min(other.headroom_bits);
    for (loss, more) in [(&mut row.rounded, other.rounded), (&mut row.overflowed, other.overflowed)] {
        let worst = if loss.edges == 0 {
            more.worst
        } else if more.edges == 0 {
            loss.worst
        } else {
            loss.worst.max(more.worst)
        };
        *loss = Loss { edges: loss.edges + more.edges, worst, first: loss.first.or(more.first) };
    }
    row.sqnr_db = match (row.sqnr_db, other.sqnr_db) {
        (Some(one), Some(two)) => Some(one.min(two)),
        (one, two) => one.or(two),
    };
}

impl Measured {
    /// Returns the row of a signal.
    pub fn row(&self, name: &str) -> Option<&SignalRow> {
        self.rows.iter().find(|row| row.name == name)
    }
}
