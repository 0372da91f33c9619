//! The gain in stiffness from a bridge that brakes in its off phase over a bridge that floats.

use hpu_cosim::Control;
use hpu_cosim::scene::{Device, Experiment};

use super::super::beside::{Found, Line};
use super::{Leaning, Stiffest, axis, line};
use crate::map::{Cell, CellLimits};

const GROUP: &str = "The stiffest wall with a bridge that brakes, against one that floats, in words";

pub(super) fn lines() -> Vec<Line> {
    let mut lines = Vec::new();
    for hand in [Leaning::Push(20), Leaning::Shipped] {
        for (claims, what, scene, rate, published) in [
            ("d", "conventional, 100 Hz", "conventional-wall-1khz", "100 Hz", "+33.3 %"),
            ("e", "conventional, 1 kHz", "conventional-wall-1khz", "1 kHz", "+16.6 %"),
            ("f", "hybrid", "hybrid-wall", "1 kHz", "no perceivable change"),
        ] {
            lines.push(line(GROUP, format!("{what}, {}", hand.text()), published, move |control| {
                let brake = Held::find(hand, scene, rate, "brake", control)?;
                let float = Held::find(hand, scene, rate, "float", control)?;
                let text = format!("{}, floating {}{}", brake.text(), float.text(), brake.gain_over(&float));
                Ok(Found::new(text, brake.gains(&float)))
            }));
            lines.last_mut().expect("just added").claims = claims;
        }
    }
    lines.push(line(GROUP, "other damping that would make the short's share 33.3 %, 16.6 %", "", |_| {
        let Device::Motor(motor) = axis("hybrid-wall", &[])?.device else { return Err("no motor".into()) };
        let short = motor.torque_constant_nm_per_a.powi(2) / motor.resistance_ohm;
        let [slow, fast] = [0.333, 0.166].map(|share| short / share * 1e3);
        Ok(format!("{slow:.2}, {fast:.2} mN.m.s/rad beside the short's {:.3}", short * 1e3))
    }));
    lines
}

/// The stiffest wall that settles.
struct Held {
    /// The stiffness asked for, in N·m/rad, or the reason why no wall settles.
    asked: Result<f64, String>,
    /// The stiffness felt, in N·m/rad.
    felt: Option<f64>,
}

impl Held {
    fn find(hand: Leaning, scene: &str, rate: &str, off: &str, control: &Control) -> Result<Self, String> {
        let mut scene = hand.scene(scene, &[("method.sample_rate", rate), ("method.pwm.off", off)])?;
        let found = match Stiffest::of(&scene, control) {
            Ok(found) => found,
            Err(reason) => return Ok(Self { asked: Err(reason), felt: None }),
        };
        scene.wall.stiffness_nm_per_rad = found.all;
        let cell = Cell::run(&Experiment::Axis(scene), CellLimits::UNGUARDED, control)?.ok_or("stopped")?;
        Ok(Self { asked: Ok(found.all), felt: cell.displayed_stiffness })
    }

    fn text(&self) -> String {
        match (&self.asked, self.felt) {
            (Ok(asked), Some(felt)) => format!("{asked:.3} N.m/rad (felt {felt:.3})"),
            (Ok(asked), None) => format!("{asked:.3} N.m/rad"),
            (Err(reason), _) => reason.clone(),
        }
    }

    /// Returns by how many percent the wall is stiffer than the other, as asked for and as felt; infinite if the other
    /// does not settle.
    fn gains(&self, other: &Self) -> [f64; 2] {
        let asked = |held: &Self| held.asked.as_ref().ok().copied();
        let more = |own: Option<f64>, other: Option<f64>| match (own, other) {
            (Some(own), Some(other)) => (own / other - 1.0) * 100.0,
            _ => f64::INFINITY,
        };
        [more(asked(self), asked(other)), more(self.felt, other.felt)]
    }

    fn gain_over(&self, other: &Self) -> String {
        let more = self.gains(other).map(|more| more.is_finite().then(|| format!("{more:+.0} %")));
        match (&more[0], &more[1]) {
            (Some(asked), Some(felt)) => format!(": {asked} (felt {felt})"),
            (Some(asked), None) => format!(": {asked}"),
            (None, _) => String::new(),
        }
    }
}
