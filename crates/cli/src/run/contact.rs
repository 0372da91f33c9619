//! The contact with the wall, as the summary reports it beside the verdict.

use hpu_cosim::scene::Units;
use hpu_cosim::{AxisSimulation, Verdict};
use hpu_study::map::{Unseen, displayed_stiffness, product_wraps, unseen_contact};

use crate::run::Ran;
use crate::run::device::shown;
use crate::units::si;

/// The index of an axis's angle among its outputs.
pub const ANGLE: usize = 2;

/// Returns a warning beside the verdict when the wall was not reached, or when its product wrapped; otherwise an empty
/// text.
pub fn beside(ran: &Ran) -> String {
    if let Some((simulation, Unseen { depth, wrapped })) = unseen(ran) {
        let past = si(depth, simulation.scene().device.units().position);
        let why = if wrapped { ": the position counter wrapped" } else { "" };
        return format!("; the datapath saw no contact though the device was {past} past the wall{why}");
    }
    match (ran.summary.contact_share, wraps(ran)) {
        (Some(0.0), _) => "; wall not reached in the judged window".to_string(),
        (_, Some(wraps)) => {
            let times = if wraps == 1 { "once" } else { &format!("{wraps} times") };
            format!("; through the wall, whose product has wrapped {times}")
        }
        _ => String::new(),
    }
}

/// Returns the line about how long the wall was touched, and which torque or force it gives at the final depth.
pub fn line(ran: &Ran) -> Option<String> {
    let share = ran.summary.contact_share?;
    let [from, to] = ran.window_s.map(|time_s| si(time_s, "s"));
    if share == 0.0 {
        let before = if was_touched(ran) { "; touched before" } else { "" };
        return Some(format!(
            "none in the judged window, {from} to {to}{before}: the outcome says nothing of the wall"
        ));
    }
    let share = if share == 1.0 { "all".to_string() } else { format!("{:.2} %", 100.0 * share) };
    let said = format!("{share} of the judged window, {from} to {to}");
    let Some((units, depth, displayed, ratio)) = displayed(ran) else { return Some(said) };
    let of = ratio.map_or(String::new(), |ratio| format!(", {:.2} % of what its stiffness asks for", 100.0 * ratio));
    Some(format!(
        "{said}; {} deep the wall gives {}{of}",
        si(depth, units.position),
        si(displayed * depth, units.effort)
    ))
}

/// Returns whether an axis saw penetration at any time.
fn was_touched(ran: &Ran) -> bool {
    let told = ["penetration", "wall_contact"];
    let penetration = ran.summary.nets.iter().find(|net| told.contains(&net.signal.name));
    penetration.is_some_and(|net| net.usage.max > 0)
}

/// Returns, for a settled contact of an axis, the depth at the end, the displayed stiffness, and its ratio to the
/// stiffness that was asked for.
pub fn displayed(ran: &Ran) -> Option<(Units, f64, f64, Option<f64>)> {
    let Some(Verdict::Settled { .. }) = ran.summary.verdict else { return None };
    let device = shown(ran.simulation);
    let wall = device.wall()?;
    let (displayed, ratio) = displayed_stiffness(wall, &ran.trace, ran.summary.averages)?;
    Some((device.units()?, ran.trace.last(ANGLE)? - wall.0, displayed, ratio))
}

/// Returns how far the device of an axis was past the wall while the datapath saw no contact.
pub fn unseen<'r>(ran: &'r Ran) -> Option<(&'r AxisSimulation<'r>, Unseen)> {
    let simulation = shown(ran.simulation).axis()?;
    let seen = unseen_contact(simulation.scene(), &simulation.words().realised, &ran.trace, &ran.summary);
    seen.map(|unseen| (simulation, unseen))
}

/// Returns how often the spring's product wrapped, if it did and the motion came to rest in the wall.
pub fn wraps(ran: &Ran) -> Option<u64> {
    let simulation = shown(ran.simulation).axis()?;
    product_wraps(simulation.scene(), &simulation.words().realised, &ran.trace, &ran.summary)
}
