//! Reading the faults of a scene.

use hpu_signal::Clock;
use toml_edit::Item;

use crate::faults::rows as keys;
use crate::faults::{EncoderLine, Faults, Stuck, Times};
use crate::schema::Otherwise::Is;
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{NotNegative, UpTo};
use crate::schema::section::{Section, shown};
use crate::schema::source::{Places, SceneError};
use crate::schema::{Key, Otherwise, Read, Shape, Takes, Whole};
use crate::text::message::number;

/// The most random faults of one kind, and the most times in a list.
const MOST: u64 = 100_000;

/// Reads the faults of a scene, if it has any.
pub(crate) fn faults(root: &Section, clock: Clock) -> Result<Option<Faults>, SceneError> {
    if !root.has("faults") {
        return Ok(None);
    }
    let s = &root.section("faults")?;
    use keys::faults as key;
    s.accept(&[])?;
    // Keys of a fault that is not there are no parameters of the run: nothing reads the number then.
    let clocks = |key: &Key<Whole<u64>>| if key.beside.is_some_and(|of| s.has(of)) { s.read(key) } else { Ok(1) };
    let swapped = s.read(&key::swapped)?;
    let inverted = s.read(&key::inverted)?;
    let stuck = match s.read(&key::stuck_switch)? {
        None => None,
        Some(switch) => {
            let closed = s.read(&key::stuck)?;
            let from_s = s.read(&key::stuck_from)?;
            let to_s = s.given(&key::stuck_to)?;
            if let Some(to_s) = to_s.filter(|to_s| clock.edges(*to_s) <= clock.edges(from_s)) {
                let reason = format!("{} s is no clock after stuck_from, {} s", number(to_s), number(from_s));
                return Err(s.error("stuck_to", reason));
            }
            Some(Stuck { switch, closed, from_s, to_s })
        }
    };
    let jitter_s = s.read(&key::clock_jitter)?;
    if let Some(reason) = UpTo(clock.period_s()).refuses(&q::TIME, jitter_s, "") {
        return Err(s.error("clock_jitter", reason));
    }
    Ok(Some(Faults {
        missed_edge: s.read(&key::missed_edge)?,
        doubled_edge: s.read(&key::doubled_edge)?,
        doubled_clocks: clocks(&key::doubled_clocks)?,
        bounce: s.read(&key::bounce)?,
        bounces: clocks(&key::bounces)?,
        bounce_clocks: clocks(&key::bounce_clocks)?,
        glitch: s.read(&key::glitch)?,
        glitch_line: if s.has(key::glitch.name) { s.read(&key::glitch_line)? } else { EncoderLine::A },
        glitch_clocks: clocks(&key::glitch_clocks)?,
        swapped_from_s: if swapped { Some(s.read(&key::swapped_from)?) } else { None },
        inverted: match inverted {
            Some(line) => Some((line, s.read(&key::inverted_from)?)),
            None => None,
        },
        lost_index: s.read(&key::lost_index)?,
        stuck,
        jitter_s,
    }))
}

/// The parts of a loop that can have faults, each present or not.
pub(crate) struct Pins {
    pub(crate) lines: bool,
    pub(crate) index: bool,
    pub(crate) switches: bool,
}

/// Refuses faults of parts that the loop does not have.
pub(crate) fn agree_on_faults(places: &Places, faults: &Faults, pins: Pins) -> Result<(), SceneError> {
    let asked = |times: &Times| !matches!(times, Times::Random(0));
    let of_lines = [
        ("bounce", asked(&faults.bounce)),
        ("glitch", asked(&faults.glitch)),
        ("swapped", faults.swapped_from_s.is_some()),
        ("inverted", faults.inverted.is_some()),
    ];
    let refused = |key: &str, reason: &str| Err(places.error(&format!("faults.{key}"), reason));
    if let (false, Some((key, _))) = (pins.lines, of_lines.iter().find(|(_, asked)| *asked)) {
        return refused(
            key,
            "nothing is connected to encoder.a and encoder.b; of a counted word edges can be missed or doubled",
        );
    }
    if faults.lost_index && !pins.index {
        return refused("lost_index", "nothing is connected to encoder.index; leave this out");
    }
    if faults.stuck.is_some() && !pins.switches {
        return refused("stuck_switch", "the device is driven by a word and not by switches; leave this out");
    }
    Ok(())
}

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
