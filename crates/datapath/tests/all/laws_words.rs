//! The laws of coupling, passivity control, energy bounding and the passive spring, compared word for word with the
//! recursions of their data sheets over whole histories. The recursions use plain integers, absolute edge numbers and
//! no code of the blocks.

use crate::laws_common::{Random, Wall};
use hpu_datapath::{AnyBlock, Generic, LawIn, flatten, variants};

/// The generics of a variant, by name.
struct Generics(Vec<(&'static str, Generic)>);

impl Generics {
    fn integer(&self, name: &str) -> i128 {
        match self.0.iter().find(|(of, _)| *of == name) {
            Some((_, Generic::Integer(value))) => i128::from(*value),
            other => panic!("{name} is {other:?}"),
        }
    }

    fn is(&self, name: &str) -> bool {
        self.0.contains(&(name, Generic::Boolean(true)))
    }

    /// Returns 2 to the power of that generic.
    fn power(&self, name: &str) -> i128 {
        1 << self.integer(name)
    }

    fn top(&self) -> i128 {
        self.power("TORQUE_WIDTH") - 1
    }
}

/// Returns the quotient, rounded up.
fn ceil(value: i128, unit: i128) -> i128 {
    -(-value).div_euclid(unit)
}

/// Returns the floor of the square root, by trial of every bit.
fn root(square: i128) -> i128 {
    (0..40)
        .rev()
        .map(|bit| 1i128 << bit)
        .fold(0, |root, bit| if (root + bit).pow(2) <= square { root + bit } else { root })
}

/// The changes of torque and memory over a history: `[torque, memory]`, each as pairs of an edge and the new word.
type Shown = [Vec<(usize, i128)>; 2];

/// Returns the edges that capture, if each is followed by `busy` edges that do not.
fn captures(history: &[LawIn<i64>], busy: usize) -> Vec<usize> {
    let (mut sample, mut free, mut all) = (0, 0, vec![]);
    for (edge, input) in history.iter().enumerate() {
        if edge == sample {
            sample += input.period.max(1) as usize;
            if edge >= free {
                all.push(edge);
                free = edge + busy + 1;
            }
        }
    }
    all
}

/// Returns every capture: its edge, its inputs, and the motion since the capture before.
fn motions(g: &Generics, history: &[LawIn<i64>], busy: i128) -> Vec<(usize, LawIn<i128>, i128)> {
    let turn = g.power("WIDTH");
    let mut previous = 0;
    let captured = captures(history, busy as usize).into_iter().map(|edge| {
        let input = history[edge].map(i128::from);
        let motion = (input.position - previous + turn / 2).rem_euclid(turn) - turn / 2;
        previous = input.position;
        (edge, input, motion)
    });
    captured.collect()
}

fn wanted(g: &Generics, input: &LawIn<i128>, motion: i128) -> i128 {
    let (top, most) = (g.top(), g.power("TORQUE_WIDTH"));
    let spring = (input.penetration * input.stiffness).div_euclid(g.power("STIFFNESS_FRAC")).min(top);
    let drag = (input.damping * motion).div_euclid(g.power("DAMPING_FRAC")).clamp(-most, most - 1);
    if input.contact == 1 { (spring + drag).clamp(-top, top) } else { 0 }
}

fn virtual_coupling(g: &Generics, history: &[LawIn<i64>]) -> Shown {
    let (gain, count) = (g.power("GAIN_FRAC"), g.power("EXTENSION_FRAC"));
    let half = g.power("WIDTH") / 2 * count;
    let mut shown = Shown::default();
    let mut e = 0;
    for edge in captures(history, 0) {
        let input = history[edge].map(i128::from);
        let free = (g.integer("FREE") * e).div_euclid(gain);
        let (next, torque) = if input.delta * count - free > 0 {
            let held = (g.integer("SHARE") * input.delta * count + g.integer("HELD") * e).div_euclid(gain);
            let next = held.clamp(-half, half - 1);
            let spring = (input.stiffness * next).div_euclid(g.power("STIFFNESS_FRAC") * count);
            let drag = (input.damping * (next - e)).div_euclid(g.power("DAMPING_FRAC") * count);
            (next, (spring + drag).clamp(0, g.top()))
        } else {
            (free, 0)
        };
        e = next;
        shown[0].push((edge, torque));
        shown[1].push((edge, e));
    }
    shown
}

fn passivity_controller(g: &Generics, history: &[LawIn<i64>]) -> Shown {
    let (latency, half) = (g.integer("ENERGY_WIDTH") + 2, g.power("ENERGY_WIDTH") / 2);
    let (top, credit) = (g.top(), g.integer("CREDIT"));
    let mut shown = Shown::default();
    let (mut energy, mut correction, mut last, mut torque) = (0, 0, 0, 0);
    for (edge, input, d) in motions(g, history, latency) {
        let f = wanted(g, &input, d);
        let work = if g.is("EXACT") { torque * d } else { f * d + correction * last };
        energy = (energy + work).clamp(-half, half - 1).min(if credit > 0 { credit } else { half });
        let missing = if energy < 0 && d != 0 { (-energy / d.abs()).min(top) * d.signum() } else { 0 };
        torque = (f + missing).clamp(-top, top);
        (correction, last) = (torque - f, d);
        shown[0].push((edge + latency as usize, torque));
        shown[1].push((edge, energy));
    }
    shown
}

fn energy_bounding(g: &Generics, history: &[LawIn<i64>]) -> Shown {
    let latency = g.integer("ROOT_WIDTH") / 2 + 2;
    let (c1, c2, unit) = (g.integer("C1"), g.integer("C2"), g.power("BOUND_FRAC"));
    let (top, most) = (g.top(), g.power("ENERGY_WIDTH") - 1);
    let mut shown = Shown::default();
    let (mut torque, mut energy) = (0, 0);
    for (edge, input, d) in motions(g, history, latency) {
        let f = wanted(g, &input, d);
        if g.is("LEAST_CONSERVATIVE") {
            let stored = if torque == 0 { 0 } else { energy };
            energy = (stored + c1 * d * d + torque * d * unit).clamp(0, most);
            let bound = root(4 * c1 * energy).div_euclid(unit).min(top);
            torque = f.clamp(-bound, bound);
        } else {
            let s = root((c2 * d).pow(2) + c2 * energy * 2 * unit);
            let (hi, lo) = ((c2 * d + s).div_euclid(unit), ceil(c2 * d - s, unit));
            if d > 0 {
                torque = f.min(torque + (c1 * d).div_euclid(unit)).min(hi).max(lo).clamp(-top, top);
            } else if d < 0 {
                torque = f.max(torque + ceil(c1 * d, unit)).max(lo).min(hi).clamp(-top, top);
            }
            energy = (energy + torque * d).min(most);
            assert!(energy >= 0, "the bounds keep the energy from falling below 0");
        }
        shown[0].push((edge + latency as usize, torque));
        shown[1].push((edge + latency as usize, energy));
    }
    shown
}

fn passive_spring(g: &Generics, history: &[LawIn<i64>]) -> Shown {
    let bits = g.integer("WIDTH") + g.integer("EXTENSION_FRAC");
    let (latency, count) = (bits + 1 + 2, g.power("EXTENSION_FRAC"));
    let force = g.power("STIFFNESS_FRAC") * count * g.power("SCALE_FRAC");
    let mut shown = Shown::default();
    let (mut x, mut contact) = (0, 0);
    for (edge, input, d) in motions(g, history, latency) {
        let engages = x == 0 && input.contact == 1 && (contact == 0 || g.is("REVIVE"));
        contact = input.contact;
        let square = if engages {
            (input.penetration * count).pow(2)
        } else {
            (x * x + 2 * x * g.integer("ALPHA") * d * (count / 256)).max(0)
        };
        x = root(square.min((1 << (2 * bits + 2)) - 1)).min((1 << bits) - 1);
        let torque = (input.stiffness * x * input.scale).div_euclid(force).min(g.top());
        shown[0].push((edge + latency as usize, torque));
        shown[1].push((edge + latency as usize, x));
    }
    shown
}

/// Returns the inputs at the edges of a device that rests, creeps, runs and jumps at a wall whose words change now and
/// then. Sample periods are from one edge to twice the latency, and change while the countdown runs.
fn history(g: &Generics, random: &mut Random, latency: i64, length: usize) -> Vec<LawIn<i64>> {
    let most = |name: &str| g.power(name) as i64 - 1;
    let word = |random: &mut Random, most: i64| match random.next() % 4 {
        0 => 0,
        1 => random.between(0, most),
        2 => most - random.between(0, 3),
        _ => random.between(0, most.min(40)),
    };
    let mut wall = Wall::new(g.integer("WIDTH") as u32, 1);
    let (mut speed, mut pause) = (0, 1);
    let mut all = vec![];
    while all.len() < length {
        match random.next() % 1024 {
            0..4 => wall.stiffness = word(random, most("STIFFNESS_WIDTH")),
            4..8 => wall.damping = word(random, most("DAMPING_WIDTH")),
            8..12 => wall.scale = word(random, most("SCALE_WIDTH")),
            12..16 => wall.period = random.between(0, (2 * latency).min(most("PERIOD_WIDTH"))),
            16..22 => wall.reference = wall.position + random.between(-30, 10),
            22 => wall.moves(random.between(-(1 << 40), 1 << 40)),
            23..50 => (speed, pause) = (random.between(-4, 4), 1 << random.between(0, 5)),
            _ => {}
        }
        if all.len() % pause == 0 {
            wall.moves(speed);
        }
        all.push(wall.words());
    }
    all
}

/// Compares every edge of histories with at least `1e5` captures in all. Returns the number of captures and the number
/// of sample edges that were ignored.
fn follows(label: &str, block: &mut dyn AnyBlock, model: fn(&Generics, &[LawIn<i64>]) -> Shown) -> (usize, usize) {
    let g = Generics(block.generics());
    let mut random = Random(7);
    let (mut captured, mut passed_over, mut changed) = (0, 0, 0);
    let latency = match block.name() {
        "virtual_coupling" => 0,
        "passivity_controller" => g.integer("ENERGY_WIDTH") + 2,
        "energy_bounding" => g.integer("ROOT_WIDTH") / 2 + 2,
        _ => g.integer("WIDTH") + g.integer("EXTENSION_FRAC") + 3,
    };
    while captured < 100_000 {
        let history = history(&g, &mut random, (latency as i64).max(20), 50_000);
        let [torques, memories] = model(&g, &history).map(|changes| {
            let mut changes = changes.into_iter().peekable();
            let mut word = 0;
            let each = (0..history.len()).map(move |edge| {
                while let Some((_, next)) = changes.next_if(|(at, _)| *at <= edge) {
                    word = next;
                }
                word as i64
            });
            each.collect::<Vec<_>>()
        });
        assert_eq!(block.reset(), [0, 0]);
        for (edge, input) in history.iter().enumerate() {
            let expected = [torques[edge], memories[edge]];
            assert_eq!(block.tick(&flatten(input)), expected, "{} {label}, edge {edge}", block.name());
        }
        changed += torques.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let now = captures(&history, latency as usize).len();
        captured += now;
        passed_over += captures(&history, 0).len() - now;
    }
    assert!(changed > 5_000, "{} {label}: the torque changed {changed} times", block.name());
    (captured, passed_over)
}

fn every_variant(name: &str, least: usize, model: fn(&Generics, &[LawIn<i64>]) -> Shown) {
    let mut seen = 0;
    for (label, mut block) in variants().into_iter().filter(|(_, block)| block.name() == name) {
        let (captured, passed_over) = follows(&label, block.as_mut(), model);
        assert!(captured >= 100_000);
        assert_eq!(passed_over > 100_000, name != "virtual_coupling", "{name} {label}: {passed_over}");
        seen += 1;
    }
    assert!(seen >= least, "{name} has {seen} variants");
}

#[test]
fn the_coupling_follows_the_recursion_of_its_sheet() {
    every_variant("virtual_coupling", 3, virtual_coupling);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn the_passivity_controller_follows_the_recursion_of_its_sheet() {
    every_variant("passivity_controller", 6, passivity_controller);
}

#[test]
fn energy_bounding_follows_the_recursion_of_its_sheet() {
    every_variant("energy_bounding", 4, energy_bounding);
}

#[test]
fn the_passive_spring_follows_the_recursion_of_its_sheet() {
    every_variant("passive_spring", 5, passive_spring);
}
