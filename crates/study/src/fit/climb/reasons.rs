//! The reasons of a fit: what each thing that is left out changes, and why the others are kept.

use hpu_cosim::scene::Output;

use super::{Climb, Errors, WORTH};
use crate::fit::found::{Kept, LeftOut, percent};
use crate::fit::knobs::{Simplification, go_together, on_its_own};
use crate::fit::measured::Measured;

impl Climb<'_> {
    pub(super) fn left_out(&mut self, model: &[usize]) -> Vec<LeftOut> {
        let mut all = Vec::new();
        for &index in model {
            let [model, without] = on_its_own(self.all, model, index);
            let (Ok(with), Ok(fuller)) = (self.told(&model), self.told(&without)) else { continue };
            let errors = self.errors(&with, &fuller);
            let Some((output, effect)) = errors.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let Ok(gain) = self.speedup(&without, &model) else { continue };
            all.push(LeftOut { what: self.all[index].what.clone(), output, effect, gain });
        }
        all
    }

    /// Returns why each thing that the model still has cannot be left out as well.
    pub(super) fn kept(&mut self, model: &[usize], reference: &Measured) -> Vec<Kept> {
        let mut all = Vec::new();
        for (index, Simplification { what, probe, shorter, .. }) in self.all.iter().enumerate() {
            // Of a ladder, the shortest step that could be taken stands for all.
            let longer = shorter.first().is_some_and(|&next| !self.all[next].probe);
            if model.contains(&index) || *probe || longer {
                continue;
            }
            let more: Vec<usize> =
                (0..self.all.len()).filter(|other| *other == index || model.contains(other)).collect();
            if !go_together(self.all, &more) {
                continue;
            }
            let why = match (self.told(&more), self.told(model)) {
                (Err(why), _) | (_, Err(why)) => format!("cannot be left out: {why}"),
                (Ok(with), Ok(without)) => self.reason(&more, [&with, &without], reference),
            };
            all.push(Kept { what: what.clone(), why });
        }
        all
    }

    /// Returns why a model will not do, given its measured run and that of the model that leaves out one thing less.
    fn reason(&mut self, model: &[usize], [measured, fuller]: [&Measured; 2], reference: &Measured) -> String {
        let worst = |errors: Errors| errors.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let said = |(output, error): (Output, f64)| match output {
            Output::Verdict => "the verdict would be wrong".to_string(),
            _ => format!("{} would be off by {}", output.name(), percent(error)),
        };
        let found = [reference, fuller]
            .into_iter()
            .find_map(|other| worst(self.errors(measured, other)).filter(|found| found.1 > self.within / 2.0));
        if let Some(found) = found {
            return said(found);
        }
        let no_gain = "leaving it out saves no time";
        if fuller.wall_s <= WORTH * measured.wall_s {
            return no_gain.into();
        }
        if let Some(luck) = self.lucky(model, reference) {
            return luck;
        }
        for index in 0..self.around.len() {
            let Ok(errors) = self.errors_there(model, index) else { continue };
            if let Some(found) = worst(errors).filter(|found| found.1 > self.within) {
                let (key, value) = &self.around[index].change[0];
                return format!("at {key} = {value} {}", said(found));
            }
        }
        if self.rung(model).is_some() && self.is_thin(reference) && self.holds(model, reference).is_none() {
            return "the verdict is near its limit, and a step as long is taken only if the next longer one would do"
                .into();
        }
        no_gain.into()
    }
}
