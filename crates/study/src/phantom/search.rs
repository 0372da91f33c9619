//! The search of an arm's widths.
//!
//! **Ladder.** Rung `k` is a wall of `2^(k/16)` times the scene's own stiffness. The stable stiffness is that of the
//! highest rung up to which every rung is passive.
//!
//! **Other tables, the same run.** An entry is a function of its count alone, and the depth affects nothing else in a
//! run. So if no count leaves the narrower tables, no word changes, whichever of the two depths was run. The scene is
//! aborted at the first count outside. A run tells the range of the sampled counts. Between samples, a decoder moves by
//! at most a count an edge. So the range must fit with a margin of one sample period and two edges.

use hpu_cosim::Summary;
use hpu_cosim::scene::{Experiment, OutcomeKind};
use hpu_prove::arms::bounds;

use super::cost::{ESTIMATE_ERROR, cells, rams};
use super::{A_DEVICE, Law, arm, datapath, of_scene};
use crate::Error;
use crate::widths::Field;
use crate::widths::search::climb::Rungs;
use crate::widths::search::knob::{Depth, Key};
use crate::widths::search::loops::{Loops, Standing, below, signed_bits};
use crate::widths::search::{Cost, Design, Keys, Knob};

/// The depth of the tables, and fraction bits. Integer bits are not among them: a design whose words wrap is useless,
/// and `hpu widths` tells which integer bits are idle.
static KEYS: Keys = Keys {
    device: A_DEVICE,
    most_designs: 1 << 15,
    estimate_error: ESTIMATE_ERROR,
    aborts: true,
    stable: OutcomeKind::Passive,
    all: &[
        Key::new(Field::DEPTH, "depth_bits", (4, 15)).that_holds(),
        Key::new(Field::TRIG_FRAC, "trig.frac", (4, 30)),
        Key::new(Field::LENGTH, "length.frac", (0, 30)),
        Key::new(Field::TIP, "position.frac", (0, 30)),
        Key::new(Field::ROOM_FRAC, "stiffness.frac", (0, 30)),
        Key::new(Field::FORCE, "force.frac", (0, 30)),
        Key::new(Field::TORQUE_FRAC, "torque.frac", (0, 30)),
    ],
    text: |design| design.widths().map(|(key, bits)| format!("{} {bits}", key.name)).collect::<Vec<_>>().join(", "),
};

/// Returns the stiffness of a rung, relative to the scene's own.
pub fn rung(rung: u32) -> f64 {
    libm::exp2(f64::from(rung) / 16.0)
}

pub struct Arm;

impl Loops for Arm {
    fn keys(&self) -> &'static Keys {
        &KEYS
    }

    /// The tables' depth from three bits below the scene's own, and the width of their words; for a parallel loop, also
    /// the width of the tip's words.
    fn usual(&self, scene: &Experiment) -> Vec<Knob> {
        let own = Design::new(&KEYS, scene);
        let parallel = arm(scene).is_ok_and(|scene| !scene.method.shared);
        let tip = below(&own, Field::TIP, 10, 4).filter(|_| parallel);
        [below(&own, Field::DEPTH, 3, 4), below(&own, Field::TRIG_FRAC, 10, 4), tip].into_iter().flatten().collect()
    }

    fn unit(&self, _scene: &Experiment) -> &'static str {
        "N/m"
    }

    fn searchable(&self, scene: &Experiment) -> Result<(), Error> {
        let scene = arm(scene)?;
        if scene.platform.is_host() {
            let why = "a host computes the force in floats; write one of the platforms FPGA-20, FPGA-100, FPGA-400";
            return Err(why.into());
        }
        if scene.model.law != Law::Words {
            let law = scene.model.law.name();
            return Err(format!("model.law = \"{law}\" is computed in floats; write \"words\"").into());
        }
        if scene.room.stiffness_n_per_m == 0.0 {
            return Err("room.stiffness = 0: without a wall there is no stable stiffness".into());
        }
        Ok(())
    }

    fn refuses(&self, scene: &Experiment, knob: &Knob) -> Option<String> {
        let shared = arm(scene).is_ok_and(|scene| scene.method.shared);
        (shared && ![Field::DEPTH, Field::TRIG_FRAC].contains(&knob.key.field)).then(|| {
            format!(
                "{}: of method.architecture = \"shared\" only what block RAM pays for is searched, {} and {}: what \
                 other words cost there has no estimate; write \"parallel\"",
                knob.key.name, KEYS.all[0].name, KEYS.all[1].name
            )
        })
    }

    fn difference(&self, first: &Experiment, other: &Experiment) -> Option<String> {
        let hardware = |scene: &Experiment| arm(scene).map(|scene| (scene.method, scene.platform));
        (hardware(first) != hardware(other)).then(|| "other words, or another platform".into())
    }

    fn scene(&self, design: &Design, base: &Experiment) -> Result<Experiment, Error> {
        let own = Design::new(&KEYS, base);
        let changed = design.widths().filter(|(key, bits)| own.get(key.field) != *bits);
        let made = changed
            .into_iter()
            .try_fold(base.clone(), |made, (key, bits)| key.field.with(&made, bits).map_err(|why| why.at(key.name)))?;
        let scene = arm(&made)?;
        scene
            .check_reach()
            .map_err(|error| Error::new(error).at(format_args!("depth_bits {}", design.get(Field::DEPTH))))?;
        scene.words()?;
        Ok(made)
    }

    fn cost(&self, scene: &Experiment) -> Result<Cost, Error> {
        let scene = arm(scene)?;
        let config = scene.method.config;
        datapath::wiring(config, scene.method.shared)?;
        let logic = (!scene.method.shared).then(|| cells(&config).iter().sum());
        Ok(Cost { rams: rams(&config)?, logic })
    }

    fn standing(&self, design: Design, scene: &Experiment) -> Result<Standing, Error> {
        let mut scene = arm(scene)?.clone();
        let own = scene.room.stiffness_n_per_m;
        let held = |step: u32| {
            scene.room.stiffness_n_per_m = own * rung(step);
            scene.words().is_ok().then_some(scene.room.stiffness_n_per_m)
        };
        let rungs = (0..).map_while(held).collect();
        let alike = design.widths().map(|(_, bits)| bits.into()).collect();
        Ok(Standing { design, own: 0, climb: Box::new(Rungs::new(rungs)), alike })
    }

    fn at(&self, base: &Experiment, design: &Design, wall: i128) -> Result<Experiment, Error> {
        let mut scene = arm(&self.scene(design, base)?)?.clone();
        scene.room.stiffness_n_per_m *= rung(wall as u32);
        Ok(of_scene(scene))
    }

    fn needs(&self, base: &Experiment, run: &Summary) -> Result<Depth, Error> {
        let counters = run.nets.iter().filter(|net| ["count1", "count2", "count3"].contains(&net.signal.name));
        let counts = counters.fold((0, 0), |(least, most), net| (net.usage.min.min(least), net.usage.max.max(most)));
        let spare = arm(base)?.period_clocks() as i64 + 2;
        Ok([signed_bits((counts.0 - spare, counts.1 + spare)), 0])
    }

    /// Its tables are the deepest that hold the scene's walls.
    fn reference(&self, base: &Experiment, knobs: &[Knob], bits: Option<i32>) -> Result<Design, Error> {
        if bits.is_some() {
            return Err(format!("the reference of {A_DEVICE} is the widest design; widen a range").into());
        }
        let own = Design::new(&KEYS, base);
        let wide = knobs.iter().fold(own, |wide, knob| wide.with(knob.key.field, knob.to));
        let mut depths =
            knobs.iter().filter(|knob| knob.key.field == Field::DEPTH).flat_map(|knob| knob.from..=knob.to);
        let holds = |&depth: &i32| self.scene(&own.with(Field::DEPTH, depth), base).is_ok();
        Ok(wide.with(Field::DEPTH, depths.rfind(holds).unwrap_or(wide.get(Field::DEPTH))))
    }

    fn never_stable(&self, _reference: &Design) -> String {
        "is not passive at the scene's own wall, where the ladder begins; write a softer room.stiffness".into()
    }
}

/// Returns the proved errors of a design, for every posture that its tables hold: the error of the tip along one
/// direction in metres, and the error of torques as a share of their joint's full scale, for the forces as words.
///
/// # Errors
///
/// Why there is no such datapath.
pub fn proved(base: &Experiment, design: &Design) -> Result<(f64, f64), Error> {
    let scene = design.scene(base)?;
    let scene = arm(&scene)?;
    let config = &scene.method.config;
    let bounds = bounds(config, scene.room.stiffness_n_per_m)?;
    let error = |name: &str| bounds.iter().find(|bound| bound.name == name).map_or(f64::INFINITY, |bound| bound.error);
    let tip_m = ["x", "y", "z"].into_iter().map(error).fold(0.0, f64::max);
    let full = f64::from(1u32 << (config.gain_frac + config.command_width - 1));
    let torques = ["torque1", "torque2", "torque3"].into_iter().zip(config.gains);
    Ok((tip_m, torques.map(|(name, gain)| error(name) * f64::from(gain) / full).fold(0.0, f64::max)))
}
