//! Reading the faults of a scene.

use hpu_signal::Clock;

use crate::faults::rows as keys;
use crate::faults::{EncoderLine, Faults, Stuck, Times};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::UpTo;
use crate::schema::section::Section;
use crate::schema::source::{Places, SceneError};
use crate::schema::{Key, Whole};
use crate::text::message::number;

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
        return refused(
            "stuck_switch",
            "the device is driven by a word and not by switches, or by three legs; leave this out",
        );
    }
    Ok(())
}
