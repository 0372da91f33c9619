//! Stimuli for any block: corner cases, random words from a seed, and products in strata.

mod foc;
mod gimbal;
pub(crate) mod postures;
mod sequences;
mod thresholds;
mod walls;

use std::ops::Range;

use hpu_cosim::SplitMix64;
use hpu_datapath::{AnyBlock, Generic};
use hpu_signal::{Format, Signal};

use self::sequences::{computations, is_estimator, motions, strobed};
use self::thresholds::{climbs, noises, thresholds};
use self::walls::{Walker, gain, grounded, is_law};
use crate::Stimulus;
use crate::vectors::stimuli::postures::{is_posed, pose};

/// Gray code of an encoder's phase: the words of lines (a, b) in forward order.
const FORWARD: [[i64; 2]; 4] = [[0, 0], [0, 1], [1, 1], [1, 0]];

fn edge(words: Vec<i64>) -> Stimulus {
    Stimulus { rst: false, words }
}

fn reset(words: Vec<i64>) -> Stimulus {
    Stimulus { rst: true, words }
}

/// Returns the value of an integer generic of the block.
fn generic(block: &dyn AnyBlock, name: &str) -> Option<i64> {
    block.generics().iter().find_map(|&(found, value)| match value {
        Generic::Integer(value) if found == name => Some(value),
        _ => None,
    })
}

/// Returns the most edges from a start to its result, of a block that begins with `start`.
fn latency(block: &dyn AnyBlock) -> i64 {
    if let Some(edges) = foc::frame(block) {
        return edges;
    }
    match (generic(block, "ROTATIONS"), generic(block, "LENGTH_WIDTH")) {
        (Some(rotations), Some(width)) => 3 * rotations + width + 13,
        (Some(rotations), None) => rotations + 1,
        _ => i64::from(block.inputs()[1].format.width()) + generic(block, "FRAC").unwrap_or(0),
    }
}

/// Returns the words at which formats go wrong: 0, 1, -1 (all bits set), both ends and their neighbours, without
/// repetition.
pub fn corners(format: Format) -> Vec<i64> {
    let wanted = [0, 1, -1, format.max(), format.min(), format.max() - 1, format.max() / 2 + 1];
    let mut words = Vec::new();
    for word in wanted.map(|value| format.wrap(value)) {
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words
}

/// Returns every combination of one word from each list. The last list changes fastest.
fn product(lists: &[Vec<i64>]) -> Vec<Vec<i64>> {
    lists.iter().fold(vec![vec![]], |rows, list| {
        rows.iter().flat_map(|row| list.iter().map(move |&word| [&row[..], &[word]].concat())).collect()
    })
}

/// The most edges for which directed rows wait: for a period of a PWM, or for a decoder to settle. Of a block with
/// wider words they see a part.
const LONGEST: i64 = 1 << 16;

/// Returns the corner cases of a block, then those at its thresholds, whatever its generics. The first hundred rows are
/// a test by themselves; the rest takes more rows (whole periods of a PWM).
pub fn directed(block: &dyn AnyBlock) -> Vec<Stimulus> {
    let inputs = block.inputs();
    let rows = match block.name() {
        "synchronizer" | "quadrature_decoder" => transitions(generic(block, "SETTLE").unwrap_or(2).min(LONGEST)),
        "pwm" | "timer_pwm" => modulation(inputs[0].format, generic(block, "DEAD_TIME").unwrap_or(0)),
        "three_phase_pwm" => foc::carriers(block, &inputs),
        "sinc3" => foc::streams(block),
        "spi_master" | "ssi_master" => foc::frames(block, &inputs),
        _ if !block.clocked() => combinations(&inputs),
        "input_shaper" => [walls::steps(&inputs), samples(&inputs)].concat(),
        "energy_bounding" => [walls::motions(&inputs), walls::haul(block, &inputs)].concat(),
        "passivity_controller" => [walls::motions(&inputs), walls::drain(block, &inputs)].concat(),
        _ if is_law(&inputs) => walls::motions(&inputs),
        _ if let Some(width) = generic(block, "PWM_WIDTH")
            && inputs[0].name == "a_pin" =>
        {
            [strolls(&inputs), retreat(&inputs, (1 << width).min(LONGEST))].concat()
        }
        _ if lines(&inputs) > 0 => walks(&inputs),
        _ if block.first_shown().is_some() => results(&inputs),
        _ if inputs.last().is_some_and(|signal| signal.name == "sample") => {
            strobed(&inputs, generic(block, "MEMORY").unwrap_or(0) + 2)
        }
        _ if let Some(samples) = gimbal::Samples::of(block) => gimbal::directed(&inputs, samples),
        _ if inputs[0].name == "start" => computations(&inputs, latency(block)),
        _ if is_estimator(&inputs) => [samples(&inputs), motions(&inputs)].concat(),
        _ => samples(&inputs),
    };
    let resets = if block.clocked() { interrupted(&rows) } else { Vec::new() };
    grounded(block, [rows, resets, thresholds(block), climbs(block), noises(block)].concat())
}

/// Lengths of the resets in the midst of activity, in edges.
const INTERRUPTIONS: [usize; 6] = [1, 3, 1, 2, 1, 5];

/// Rows before each of these resets: enough for every law's latency and for two periods of a short PWM.
const BEFORE_INTERRUPTION: usize = 160;

/// Returns resets in the midst of activity, of one edge and of several, during which the inputs stay as they are.
/// Before each reset comes a part of another of the stretches without a reset. The rows of a short part are repeated
/// until the block has had time to respond.
fn interrupted(rows: &[Stimulus]) -> Vec<Stimulus> {
    let stretches: Vec<_> = rows.split(|row| row.rst).filter(|stretch| !stretch.is_empty()).collect();
    let of = INTERRUPTIONS.len();
    let part = |turn: usize| {
        let stretch = stretches[turn * stretches.len() / of];
        let most = stretch.len().div_ceil(4).min(BEFORE_INTERRUPTION);
        let part = stretch.iter().skip(turn * stretch.len() / of).take(most);
        let stay = (BEFORE_INTERRUPTION / 2).div_ceil(part.len());
        part.flat_map(move |row| vec![row.clone(); stay])
    };
    let mut all = Vec::new();
    for (turn, edges) in INTERRUPTIONS.into_iter().enumerate() {
        all.extend(part(turn));
        all.extend(all.last().map(|last| vec![reset(last.words.clone()); edges]).unwrap_or_default());
    }
    all.extend(part(of / 2));
    all
}

/// Returns the number of encoders whose lines are the first inputs.
fn lines(inputs: &[Signal]) -> usize {
    inputs.iter().take_while(|signal| signal.format == Format::BIT && signal.name.starts_with(['a', 'b'])).count() / 2
}

/// Returns rows for several encoders: from reset, each joint alone moves there and back, then all move together, with
/// every corner of the other words.
fn walks(inputs: &[Signal]) -> Vec<Stimulus> {
    let encoders = lines(inputs);
    let mut rows = Vec::new();
    for turn in 0..5 {
        let constant = |signal: &Signal| match signal.name {
            name if name.ends_with("period") => signal.format.wrap([3, 41, 17, 0, 64][turn]),
            _ => corners(signal.format)[(turn + 3) % corners(signal.format).len()],
        };
        let constants: Vec<_> = inputs[2 * encoders..].iter().map(constant).collect();
        let row = |phases: &dyn Fn(usize) -> usize| -> Vec<i64> {
            (0..encoders).flat_map(|joint| FORWARD[phases(joint) % 4]).chain(constants.iter().copied()).collect()
        };
        rows.push(reset(row(&|_| 0)));
        for moving in 0..=encoders {
            let there_and_back = (0..40).chain((0..40).rev());
            let step = |phase: usize| row(&|joint| if joint == moving || moving == encoders { phase } else { 0 });
            rows.extend(there_and_back.flat_map(|phase| vec![edge(step(phase)); 2]));
        }
    }
    rows
}

/// The largest number of combinations of corners. Beyond it, each corner is combined with the same few words of the
/// other inputs.
const MOST_COMBINATIONS: usize = 20_000;

/// Returns rows for combinational blocks: corners against corners, then each bit alone against all zeros and all ones
/// elsewhere.
fn combinations(inputs: &[Signal]) -> Vec<Stimulus> {
    let lists: Vec<_> = inputs.iter().map(|signal| corners(signal.format)).collect();
    let all = lists.iter().try_fold(1usize, |all, list| all.checked_mul(list.len()));
    let mut rows = match all {
        Some(all) if all <= MOST_COMBINATIONS => product(&lists),
        _ => one_by_one(&lists),
    };
    for (index, signal) in inputs.iter().enumerate() {
        for bit in 0..signal.format.width() {
            for others in [0, -1] {
                let mut row: Vec<_> = inputs.iter().map(|signal| signal.format.wrap(others)).collect();
                row[index] = signal.format.wrap(1 << bit);
                rows.push(row);
            }
        }
    }
    rows.into_iter().map(edge).collect()
}

/// Returns each corner of each input with every corner that the other inputs have in common.
fn one_by_one(lists: &[Vec<i64>]) -> Vec<Vec<i64>> {
    let most = lists.iter().map(Vec::len).max().unwrap_or(0);
    let mut rows = Vec::new();
    for others in 0..most {
        for (index, list) in lists.iter().enumerate() {
            for &word in list {
                let mut row: Vec<_> = lists.iter().map(|list| list[others % list.len()]).collect();
                row[index] = word;
                rows.push(row);
            }
        }
    }
    rows
}

/// Returns all 16 transitions of two lines, each after a reset and the settling edges of the decoder.
fn transitions(settle: i64) -> Vec<Stimulus> {
    let mut rows = Vec::new();
    for from in FORWARD {
        for to in FORWARD {
            rows.push(reset(to.to_vec()));
            rows.extend((0..=settle).map(|_| edge(from.to_vec())));
            rows.extend([edge(to.to_vec()), edge(to.to_vec())]);
        }
    }
    // Two turns forward and two back, without a reset.
    let turns = (0..9).chain((0..9).rev());
    rows.push(reset(vec![0, 0]));
    rows.extend(turns.flat_map(|phase| vec![edge(FORWARD[phase % 4].to_vec()); 2]));
    rows
}

/// Returns rows for a PWM: every corner of the command from reset, a few edges each; then whole periods in which the
/// command changes; and those commands whose pulses are just longer than the dead time, if there is one.
fn modulation(command: Format, dead_time: i64) -> Vec<Stimulus> {
    let mut rows = Vec::new();
    for &word in &corners(command) {
        rows.push(reset(vec![word]));
        rows.extend(vec![edge(vec![word]); 11]);
    }
    let period = (command.max() as usize + 1).min(LONGEST as usize);
    rows.push(reset(vec![0]));
    for &word in &corners(command) {
        rows.extend(vec![edge(vec![word]); period + period / 3]);
    }
    let pulses = [1, 2].map(|more| i128::from(dead_time + more)).into_iter().flat_map(|pulse| [pulse, -pulse]);
    for word in pulses.filter(|&pulse| dead_time > 0 && command.holds(pulse)) {
        rows.extend(vec![edge(vec![command.wrap(word)]); period + period / 3]);
    }
    rows
}

/// Returns rows for sampling and counting blocks: every corner of the first input, at short periods and at the longest
/// one.
fn samples(inputs: &[Signal]) -> Vec<Stimulus> {
    let rest = &inputs[1..];
    let mut rows = Vec::new();
    for &period in &[1, 0, 2, 3, -1] {
        rows.push(reset(inputs.iter().map(|signal| signal.format.wrap(-1)).collect()));
        for (turn, &word) in corners(inputs[0].format).iter().enumerate() {
            let other = |signal: &Signal| match signal.name {
                "period" => signal.format.wrap(period),
                _ => corners(signal.format)[turn % corners(signal.format).len()],
            };
            let row: Vec<_> = [word].into_iter().chain(rest.iter().map(other)).collect();
            rows.extend(vec![edge(row); 2]);
        }
    }
    rows
}

/// Returns rows for sequential computations. The periods are as long as the longest one in which no result appears, and
/// longer. Every corner of the inputs stays for more than one period.
fn results(inputs: &[Signal]) -> Vec<Stimulus> {
    let mut rows = Vec::new();
    for period in [33, 40, 32] {
        rows.push(reset(inputs.iter().map(|signal| signal.format.wrap(-1)).collect()));
        for turn in 2..9 {
            let corner = |signal: &Signal| match signal.name {
                "period" => signal.format.wrap(period),
                _ => corners(signal.format)[turn % corners(signal.format).len()],
            };
            rows.extend(vec![edge(inputs.iter().map(corner).collect()); 50]);
        }
    }
    rows
}

/// Returns rows for whole loops: from reset, into the wall and back out, for the corners of the constant words.
fn strolls(inputs: &[Signal]) -> Vec<Stimulus> {
    let mut rows = Vec::new();
    for steps in [6, 400] {
        for (turn, reference) in [-3, 0, 3, 2, -1].into_iter().enumerate() {
            let constant = |signal: &Signal| match signal.name {
                "reference" => signal.format.wrap(reference),
                "period" => [3, 1, 7, 0, 2][turn],
                _ => corners(signal.format)[(turn + 3) % corners(signal.format).len()],
            };
            let constants: Vec<_> = inputs[2..].iter().map(constant).collect();
            let row = |phase: usize| [&FORWARD[phase % 4][..], &constants].concat();
            rows.push(reset(row(0)));
            rows.extend((0..steps).chain((0..steps).rev()).flat_map(|phase| vec![edge(row(phase)); 2]));
        }
    }
    rows
}

/// Returns rows that move deep into a soft wall and out again, for more than two periods of the PWM. The damping
/// reverses the torque.
fn retreat(inputs: &[Signal], period: i64) -> Vec<Stimulus> {
    let constant = |signal: &Signal| match signal.name {
        "damping" => signal.format.wrap(-1),
        "period" => 7,
        "scale" => 1 << signal.format.frac(),
        _ => signal.format.wrap(if signal.name == "reference" { -1 } else { 1 }),
    };
    let constants: Vec<_> = inputs[2..].iter().map(constant).collect();
    let row = |count: i64| [&FORWARD[count.rem_euclid(4) as usize][..], &constants].concat();
    let deepest = period * 5 / 8;
    let walk = (0..deepest).chain((-deepest..deepest).rev());
    [reset(row(0))].into_iter().chain(walk.map(|count| edge(row(count)))).collect()
}

/// Rows of a random set that always reset, early enough for a committed set: one edge, and several.
const RESETS: [Range<usize>; 2] = [40..41, 70..73];

/// Returns random rows: corners, neighbours of the last word and uniform words; encoder lines that mostly turn; short
/// sample periods; and a reset from time to time. The rows depend only on the ports and the seed.
pub fn random(block: &dyn AnyBlock, seed: u64, rows: usize) -> Vec<Stimulus> {
    let random = &mut SplitMix64::new(seed);
    let inputs = block.inputs();
    let encoders = lines(&inputs);
    let posed = is_posed(&inputs);
    let is_loop = encoders > 0 && inputs.len() > 2;
    let mut samples = gimbal::Samples::of(block);
    let mut words: Vec<_> = inputs.iter().map(|signal| draw(random, signal, 0)).collect();
    let mut walks = vec![(0, 1); encoders];
    // A loop's PWM latches a command once a period: 4096 edges for 12 bits.
    let resets = match (is_loop, posed) {
        (true, false) => 6000,
        // Often enough to walk through a short table again.
        (true, true) => 1200,
        // Some windows of 64 samples of 96 edges are full.
        _ if samples.is_some() => 9000,
        _ => 700,
    };
    let mut walker = is_law(&inputs).then(Walker::new);
    let mut targets = gimbal::Targets::of(block, latency);
    let mut next = |row: usize| {
        for (index, signal) in inputs.iter().enumerate().skip(2 * encoders) {
            let odds = match signal.name {
                _ if samples.is_some() => break,
                _ if !block.clocked() => 1,
                _ if is_loop && posed => 100,
                _ if is_loop => 500,
                _ if walker.is_some() => 150,
                "command" | "period" => 40,
                // Long enough for a dead time to pass.
                "enable" => 120,
                "start" => 1,
                _ if block.first_shown().is_some() => 200,
                _ => 3,
            };
            if random.one_in(odds) {
                // Long enough for a computation to end, short enough for many computations.
                let period = posed && signal.name == "period";
                words[index] = if walker.is_some() {
                    gain(random, signal)
                } else if period {
                    signal.format.from_bits(if random.one_in(4) { random.below(80) } else { 34 + random.below(30) })
                } else {
                    draw(random, signal, words[index])
                };
            }
        }
        if posed && (!block.clocked() || random.one_in(100)) {
            pose(random, &inputs, &mut words);
        }
        if let Some(samples) = &mut samples {
            samples.step(random, &inputs, &mut words);
        }
        if let Some(targets) = &mut targets {
            targets.step(random, &inputs, &mut words);
        }
        if let Some(walker) = &mut walker {
            walker.step(random, &inputs, &mut words);
        }
        for (joint, (phase, direction)) in walks.iter_mut().enumerate() {
            *direction = if random.one_in(200) { 4 - *direction } else { *direction };
            let moves = if random.one_in(500) { 2 } else { *direction * u64::from(random.one_in(3)) };
            *phase = (*phase + moves) % 4;
            words[2 * joint..2 * joint + 2].copy_from_slice(&FORWARD[*phase as usize]);
        }
        let forced = row == 0 || RESETS.iter().any(|resets| resets.contains(&row));
        Stimulus { rst: block.clocked() && (forced || random.one_in(resets)), words: words.clone() }
    };
    let rows = (0..rows).map(&mut next).collect();
    grounded(block, rows)
}

/// Returns a word of the signal: a corner, a neighbour of the last word, or any word.
fn draw(random: &mut SplitMix64, signal: &Signal, last: i64) -> i64 {
    let format = signal.format;
    let near = |random: &mut SplitMix64, word: i64| format.wrap(i128::from(word) + i128::from(random.below(9)) - 4);
    match (signal.name, random.below(4)) {
        // A long period holds a sampling block still, so only one in eight may be long.
        (name, _) if name.ends_with("period") && !random.one_in(8) => format.from_bits(random.below(12)),
        // Seldom enough for a computation to end.
        ("start", _) => i64::from(random.one_in(40)),
        // Close enough to the counter's start for the walk to touch the wall.
        ("reference", 0 | 1) => near(random, 0),
        // Soft enough for the damping to turn the torque round.
        ("stiffness", 0 | 1) => format.from_bits(random.below(4)),
        (_, 0) => corners(format)[random.below(corners(format).len() as u64) as usize],
        (_, 1) => near(random, last),
        _ => format.from_bits(random.next_u64()),
    }
}

/// Returns words of two inputs of 8 bits or more: one random pair from each of `256 x 256` equal cells of the plane.
/// The 65 536 rows leave no part of the plane untested.
pub fn stratified(a: Format, b: Format, seed: u64) -> Vec<Stimulus> {
    let mut random = SplitMix64::new(seed);
    let mut pick = |format: Format, cell: u64| {
        let low = format.width() - 8;
        format.from_bits(cell << low | random.below(1 << low))
    };
    let cells = (0..256).flat_map(|x| (0..256).map(move |y| (x, y)));
    cells.map(|(x, y)| edge(vec![pick(a, x), pick(b, y)])).collect()
}

/// Returns all pairs of words in which the upper eight bits of the first factor are `upper`: 256 such chunks hold every
/// pair.
pub fn chunk(a: Format, b: Format, upper: u64) -> Vec<Stimulus> {
    let low = a.width() - 8;
    let first = upper << low;
    let pairs = (first..first + (1 << low)).flat_map(|x| (0..1 << b.width()).map(move |y: u64| (x, y)));
    pairs.map(|(x, y)| edge(vec![a.from_bits(x), b.from_bits(y)])).collect()
}
