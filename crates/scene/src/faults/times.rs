//! The type of keys that give times of faults.

use toml_edit::Item;

use crate::faults::Times;
use crate::schema::Otherwise::Is;
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::NotNegative;
use crate::schema::section::{Section, shown};
use crate::schema::source::SceneError;
use crate::schema::{Otherwise, Read, Shape, Takes, Whole};
use crate::text::message::number;

/// The most random faults of one kind, and the most times in a list.
const MOST: u64 = 100_000;

/// A number of times at random, or a list of times.
pub(crate) struct OfTimes;

const ACCEPTED: &str = "a number of times at random, as 3, or a list of times, as [\"20 ms\", \"0.3 s\"]";

/// The number, where the key is no list.
const NUMBER: Whole<u64> = Whole::new(0, MOST, Is(0));

impl Read for OfTimes {
    type Value = Times;

    fn takes(&self) -> Takes {
        Takes::Own(Shape::NumberOrList, ACCEPTED)
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        NUMBER.otherwise()
    }

    fn read(&self, s: &Section, key: &str) -> Result<Times, SceneError> {
        let Some(list) = s.get(key).and_then(Item::as_array) else {
            if s.get(key).is_some_and(|item| item.as_integer().is_none()) {
                let found = s.get(key).map_or_else(String::new, shown);
                return Err(s.error(key, format!("{found} is not {ACCEPTED}")));
            }
            return NUMBER.read(s, key).map(Times::Random);
        };
        if list.len() as u64 > MOST {
            return Err(s.error(key, format!("{} times; accepted: {MOST} at most", list.len())));
        }
        let at = list.iter().enumerate().map(|(index, item)| {
            let item = Item::Value(item.clone());
            s.quantity_of(&format!("{key}[{index}]"), &item, &q::TIME, NotNegative, |_| None)
        });
        let mut at = at.collect::<Result<Vec<_>, _>>()?;
        let text = format!("[{}]", at.iter().map(|&at| number(at)).collect::<Vec<_>>().join(", "));
        s.note(key, ParameterValue::Text(text), "s", Origin::Scene);
        at.sort_by(f64::total_cmp);
        Ok(Times::At(at))
    }
}
