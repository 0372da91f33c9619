//! How much stiffer the hybrid loop's wall may be.

use hpu_cosim::Control;
use hpu_cosim::scene::Scene;

use super::super::beside::{Found, Line};
use super::{Leaning, Stiffest, axis, line};
use crate::criteria;
use crate::limits::{Damping, StableSet, usual_range};

const GROUP: &str = "The stiffest wall, without virtual damping";
const RATIO: &str = "4 to 5 times";

pub(super) fn lines() -> Vec<Line> {
    let mut lines = vec![
        line(GROUP, "linear, conventional at 1 kHz", "", |_| Ok(format!("{:.6} N.m/rad", conventional()?))),
        line(GROUP, "linear, hybrid, the spring never sampled", RATIO, |_| {
            let hybrid = linear(&axis("hybrid-wall", &BARE)?)?;
            let times = hybrid / conventional()?;
            Ok(Found::new(format!("{hybrid:.5} N.m/rad, {times:.3} times"), [times]))
        }),
        line(GROUP, "Routh's limit of the same", "", |_| {
            let criteria = criteria::all(&axis("hybrid-wall", &BARE)?);
            let routh = criteria.into_iter().flatten().find(|criterion| criterion.name == "routh");
            routh.map(|routh| format!("{:.5} N.m/rad", routh.limit)).ok_or_else(|| "no such criterion".into())
        }),
    ];
    for (clock, rate) in [("25.175 MHz", "6146.240234375 Hz"), ("50 MHz", "12207.03125 Hz")] {
        let what = format!("linear, hybrid, sampled by its 12-bit PWM at {clock}");
        lines.push(line(GROUP, what, RATIO, move |_| {
            let set = [&BARE[..], &[("clock.frequency", clock), ("method.sample_rate", rate)]].concat();
            let latched = linear(&axis("conventional-wall-1khz", &set)?)?;
            let times = latched / conventional()?;
            Ok(Found::new(format!("{latched:.5} N.m/rad, {times:.3} times"), [times]))
        }));
    }
    for hand in [Leaning::Push(20), Leaning::Push(50), Leaning::Push(100), Leaning::Push(200), Leaning::Shipped] {
        let what = format!("in words, {}", hand.text());
        lines.push(line(GROUP, what, RATIO, move |control| in_words(hand, control)));
    }
    for line in lines.iter_mut().filter(|line| line.published == RATIO) {
        line.claims = "ab";
    }
    lines
}

const BARE: [(&str, &str); 2] = [("wall.damping", "0"), ("hand", "{ kind = \"none\" }")];

fn linear(scene: &Scene) -> Result<f64, String> {
    let set = StableSet::new(scene, Damping::Fixed(scene.wall.damping_nm_s_per_rad), usual_range(scene))?;
    set.softest().map(|stretch| stretch.to.middle()).ok_or_else(|| set.said())
}

fn conventional() -> Result<f64, String> {
    linear(&axis("conventional-wall-1khz", &BARE)?)
}

fn in_words(hand: Leaning, control: &Control) -> Result<Found, String> {
    let limit = |name| Stiffest::of(&hand.scene(name, &[])?, control);
    let conventional = limit("conventional-wall-1khz")?;
    let (hybrid, early) = (limit("hybrid-wall")?, limit("hybrid-wall-25mhz")?);
    let times = [hybrid.over(conventional), early.over(conventional)];
    let said = times.map(|[least, most]| format!("{least:.2} to {most:.2} times"));
    let text = format!("{conventional} N.m/rad, hybrid {hybrid}, {}; at 25.175 MHz {early}, {}", said[0], said[1]);
    Ok(Found::new(text, times.into_iter().flatten()))
}
