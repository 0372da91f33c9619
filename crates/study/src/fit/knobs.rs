//! The simplifications of a scene, and which of them can be combined.

use std::ops::RangeInclusive;

/// One thing that a cheaper model leaves out.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Simplification {
    /// Name of the thing, as a noun: "the bridge's switching".
    pub what: String,
    /// The keys that leave it out.
    pub set: Vec<(String, String)>,
    /// Simplifications that this one requires, as indices into the list.
    needs: Vec<usize>,
    /// Alternatives to this simplification, with which it cannot be combined.
    instead_of: Vec<usize>,
    /// The next two shorter steps of the same ladder, if this is a fixed step.
    pub(super) shorter: Vec<usize>,
    /// Whether this step only serves to check longer steps, and is never taken itself.
    pub(super) probe: bool,
    /// Worth of the simplification, for the order in which models are tried: roughly the logarithm of its gain in
    /// speed.
    worth: u32,
}

/// Returns the sets of simplifications that can be combined, those worth most first. The last set is empty: the scene
/// as written.
pub fn models(all: &[Simplification]) -> Vec<Vec<usize>> {
    let mut models = vec![Vec::new()];
    for index in (0..all.len()).filter(|&index| !all[index].probe) {
        let with = |set: &Vec<usize>| [&set[..], &[index]].concat();
        let more: Vec<_> = models.iter().map(with).filter(|set| go_together(all, set)).collect();
        models.extend(more);
    }
    models.sort_by_key(|set| std::cmp::Reverse((worth(all, set), set.len())));
    models
}

/// Returns the worth of a model: roughly the logarithm of its gain in speed.
pub(super) fn worth(all: &[Simplification], model: &[usize]) -> u32 {
    model.iter().map(|&index| all[index].worth).sum()
}

/// Whether a model has all simplifications that its own require, and no two alternatives.
pub(super) fn go_together(all: &[Simplification], model: &[usize]) -> bool {
    model.iter().map(|&index| &all[index]).all(|one| {
        one.needs.iter().all(|need| model.contains(need)) && !one.instead_of.iter().any(|it| model.contains(it))
    })
}

/// Returns a model without the simplifications that require `thing`, and the same model without `thing` itself as well.
pub(super) fn on_its_own(all: &[Simplification], model: &[usize], thing: usize) -> [Vec<usize>; 2] {
    let mut gone = vec![thing];
    // A simplification comes after those that it requires.
    for &index in model {
        if all[index].needs.iter().any(|need| gone.contains(need)) {
            gone.push(index);
        }
    }
    let without = |gone: &[usize]| model.iter().copied().filter(|index| !gone.contains(index)).collect();
    [without(&gone[1..]), without(&gone)]
}

/// Returns the keys that make a scene this model.
pub fn overrides(all: &[Simplification], model: &[usize]) -> Vec<(String, String)> {
    model.iter().flat_map(|&index| all[index].set.iter().cloned()).collect()
}

/// Fixed steps in us, with their worth. The last two only serve to check the others.
const STEPS: [(f64, u32); 7] = [(1000.0, 6), (300.0, 5), (100.0, 4), (30.0, 3), (10.0, 2), (3.0, 1), (1.0, 1)];

/// The simplifications of a scene, as its device lists them.
#[derive(Default)]
pub struct Simplifications(Vec<Simplification>);

impl Simplifications {
    /// Returns the list.
    pub(super) fn all(self) -> Vec<Simplification> {
        self.0
    }

    /// Makes one an alternative to others.
    pub(crate) fn exclude(&mut self, one: usize, others: impl IntoIterator<Item = usize>) {
        self.0[one].instead_of.extend(others);
    }

    /// Adds what is left out, its worth, the keys that do so, and the simplifications that this requires. Returns its
    /// index.
    pub(crate) fn add(&mut self, what: &str, worth: u32, set: &[(&str, &str)], needs: &[Option<usize>]) -> usize {
        let set = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
        let needs = needs.iter().flatten().copied().collect();
        let (what, instead_of, shorter) = (what.to_string(), Vec::new(), Vec::new());
        self.0.push(Simplification { what, set, needs, instead_of, shorter, probe: false, worth });
        self.0.len() - 1
    }

    /// Adds the fixed steps of a solver within these bounds; the longest is cut to the upper bound. Each step is an
    /// alternative to everything in `between`, and joins it.
    pub(crate) fn ladder(
        &mut self,
        steps_s: &RangeInclusive<f64>,
        what: impl Fn(&str) -> String,
        solver: &[(&str, &str)],
        needs: &[Option<usize>],
        between: &mut Vec<usize>,
    ) {
        let most_us = 1e6 * steps_s.end();
        let within = STEPS.map(|(step_us, worth)| (step_us.min(most_us), worth));
        // Of steps that are cut to the same or nearly the same length, the shortest is kept.
        let apart = |at: usize| within.get(at + 1).is_none_or(|next| next.0 < 0.7 * within[at].0);
        let mut rungs = Vec::new();
        for (at, (step_us, worth)) in within.into_iter().enumerate() {
            if !apart(at) || 1e-6 * step_us < *steps_s.start() {
                continue;
            }
            let step = format!("{step_us} us");
            let set = [solver, &[("model.step", step.as_str())]].concat();
            let rung = self.add(&what(&step), worth, &set, needs);
            self.0[rung].instead_of.clone_from(between);
            between.push(rung);
            rungs.push(rung);
        }
        for (at, &rung) in rungs.iter().enumerate() {
            self.0[rung].shorter = rungs[at + 1..].iter().copied().take(2).collect();
            self.0[rung].probe = at + 2 >= rungs.len();
        }
    }
}
