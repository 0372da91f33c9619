//! Reading the faults of a scene.

use hpu_signal::Clock;
use toml_edit::Item;

use super::faults::{EncoderLine, Faults, Stuck, Switch, Times};
use super::parameter::{Origin, ParameterValue};
use super::quantity as q;
use super::section::Sense::{NotNegative, Positive, UpTo};
use super::section::{Section, shown};
use super::source::{Places, SceneError};
use crate::message::number;

/// The most random faults of one kind, and the most times in a list.
const MOST: u64 = 100_000;
/// The most clocks that a fault may take.
const MOST_CLOCKS: u64 = 1 << 32;

const LINES: [(&str, Option<EncoderLine>); 3] =
    [("none", None), ("encoder.a", Some(EncoderLine::A)), ("encoder.b", Some(EncoderLine::B))];
const SWITCHES: [(&str, Option<Switch>); 5] = [
    ("none", None),
    ("bridge.plus_high", Some(Switch::PlusHigh)),
    ("bridge.plus_low", Some(Switch::PlusLow)),
    ("bridge.minus_high", Some(Switch::MinusHigh)),
    ("bridge.minus_low", Some(Switch::MinusLow)),
];

/// Reads the faults of a scene, if it has any.
pub(super) fn faults(root: &Section, clock: Clock) -> Result<Option<Faults>, SceneError> {
    if !root.has("faults") {
        return Ok(None);
    }
    let s = &root.section("faults")?;
    s.accept(&[
        "missed_edge",
        "doubled_edge",
        "doubled_clocks",
        "bounce",
        "bounces",
        "bounce_clocks",
        "glitch",
        "glitch_line",
        "glitch_clocks",
        "swapped",
        "swapped_from",
        "inverted",
        "inverted_from",
        "lost_index",
        "stuck_switch",
        "stuck",
        "stuck_from",
        "stuck_to",
        "clock_jitter",
    ])?;
    // A key that belongs to a fault is refused without that fault.
    for (key, of) in [
        ("doubled_clocks", "doubled_edge"),
        ("bounces", "bounce"),
        ("bounce_clocks", "bounce"),
        ("glitch_line", "glitch"),
        ("glitch_clocks", "glitch"),
        ("swapped_from", "swapped"),
        ("inverted_from", "inverted"),
        ("stuck", "stuck_switch"),
        ("stuck_from", "stuck_switch"),
        ("stuck_to", "stuck_switch"),
    ] {
        if s.has(key) && !s.has(of) {
            return Err(s.error(key, format!("without {of} it says nothing; write {of} too, or leave this out")));
        }
    }
    let from = |key: &str| s.quantity(key, &q::TIME, NotNegative, Some(0.0));
    let clocks = |key: &str, of: &str, otherwise: u64| {
        if s.has(of) { s.integer(key, 1, MOST_CLOCKS, Some(otherwise)) } else { Ok(otherwise) }
    };
    let swapped = s.flag("swapped", false)?;
    let inverted = s.choice("inverted", &LINES, Some(None))?;
    let switch = s.choice("stuck_switch", &SWITCHES, Some(None))?;
    let stuck = match switch {
        None => None,
        Some(switch) => {
            let closed = s.choice("stuck", &[("open", false), ("closed", true)], Some(false))?;
            let from_s = from("stuck_from")?;
            let to_s = if s.has("stuck_to") { Some(s.quantity("stuck_to", &q::TIME, Positive, None)?) } else { None };
            if let Some(to_s) = to_s.filter(|to_s| clock.edges(*to_s) <= clock.edges(from_s)) {
                let reason = format!("{} s is no clock after stuck_from, {} s", number(to_s), number(from_s));
                return Err(s.error("stuck_to", reason));
            }
            Some(Stuck { switch, closed, from_s, to_s })
        }
    };
    let line = if s.has("glitch") { s.choice("glitch_line", &LINES[1..], Some(LINES[1].1))? } else { LINES[1].1 };
    Ok(Some(Faults {
        missed_edge: times(s, "missed_edge")?,
        doubled_edge: times(s, "doubled_edge")?,
        doubled_clocks: clocks("doubled_clocks", "doubled_edge", 4)?,
        bounce: times(s, "bounce")?,
        bounces: if s.has("bounce") { s.integer("bounces", 1, 1000, Some(3))? } else { 3 },
        bounce_clocks: clocks("bounce_clocks", "bounce", 50)?,
        glitch: times(s, "glitch")?,
        glitch_line: line.expect("one of the two lines"),
        glitch_clocks: clocks("glitch_clocks", "glitch", 1)?,
        swapped_from_s: if swapped { Some(from("swapped_from")?) } else { None },
        inverted: match inverted {
            Some(line) => Some((line, from("inverted_from")?)),
            None => None,
        },
        lost_index: s.flag("lost_index", false)?,
        stuck,
        jitter_s: s.quantity("clock_jitter", &q::TIME, UpTo(clock.period_s()), Some(0.0))?,
    }))
}

/// The parts of a loop that can have faults, each present or not.
pub(super) struct Pins {
    pub(super) lines: bool,
    pub(super) index: bool,
    pub(super) switches: bool,
}

/// Refuses faults of parts that the loop does not have.
pub(super) fn agree_on_faults(places: &Places, faults: &Faults, pins: Pins) -> Result<(), SceneError> {
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

/// Reads a number of random times, or a list of times.
fn times(s: &Section, key: &str) -> Result<Times, SceneError> {
    let accepted = "a number of times at random, as 3, or a list of times, as [\"20 ms\", \"0.3 s\"]";
    let Some(list) = s.get(key).and_then(Item::as_array) else {
        if s.get(key).is_some_and(|item| item.as_integer().is_none()) {
            let found = s.get(key).map_or_else(String::new, shown);
            return Err(s.error(key, format!("{found} is not {accepted}")));
        }
        return Ok(Times::Random(s.integer(key, 0, MOST, Some(0))?));
    };
    if list.len() as u64 > MOST {
        return Err(s.error(key, format!("{} times; accepted: {MOST} at most", list.len())));
    }
    let at = list.iter().enumerate().map(|(index, item)| {
        let item = Item::Value(item.clone());
        s.quantity_of(&format!("{key}[{index}]"), &item, &q::TIME, NotNegative)
    });
    let mut at = at.collect::<Result<Vec<_>, _>>()?;
    let text = format!("[{}]", at.iter().map(|&at| number(at)).collect::<Vec<_>>().join(", "));
    s.note(key, ParameterValue::Text(text), "s", Origin::Scene);
    at.sort_by(f64::total_cmp);
    Ok(Times::At(at))
}
