//! The wiring that closes the loop of an axis: a scene's method in words, or its reference law in floats.

use crate::run::law_loop::{LawConfig, LawLoop};
use crate::run::simulation::TheLoop;
use crate::run::simulation_error::SimulationError;
use hpu_scene::method::{AxisLoop, Unmade};
use hpu_scene::{Datapath, LoopWords, Scene};

/// The wiring that closes the loop of an axis.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub(crate) enum Closed {
    /// The method in words.
    Words(AxisLoop),
    /// Its reference law in floats.
    Law(LawLoop),
}

impl Closed {
    /// Returns the wiring, to read.
    pub(crate) fn wiring(&self) -> TheLoop<'_> {
        match self {
            Self::Words(axis_loop) => TheLoop::Axis(axis_loop),
            Self::Law(wiring) => TheLoop::Law(wiring),
        }
    }

    /// Returns the wiring of a scene before reset.
    pub(crate) fn new(scene: &Scene, words: &LoopWords) -> Result<Self, Unmade> {
        let realised = &words.realised;
        let gains = [realised.stiffness_nm_per_rad, realised.damping_nm_s_per_rad];
        Ok(match scene.model.datapath {
            Datapath::Law => Self::Law(LawLoop::new(law_config(scene, words, gains)?)),
            Datapath::Words | Datapath::Linear => {
                let setting = scene.setting(words, gains);
                Self::Words(AxisLoop::new(&scene.method.kind, &setting, words.config)?)
            }
        })
    }
}

/// Returns the reference law of a scene with the stiffness and damping that the scene asks for, however finely its
/// words can hold them. Errors of the words are measured against it. In a loop of its own (`model.datapath = "law"`)
/// the law has the gains that the words realise, and its wall stands at a whole count; it then leaves out only the
/// words' effect on the motion.
///
/// # Errors
///
/// When the scene has no words, or its method has no law.
pub fn law_as_asked(scene: &Scene) -> Result<LawConfig, SimulationError> {
    let words = scene.words().map_err(SimulationError::Scene)?;
    Ok(law_config(scene, &words, scene.gains().map(|(_, gain)| gain))?)
}

fn law_config(scene: &Scene, words: &LoopWords, gains: [f64; 2]) -> Result<LawConfig, Unmade> {
    let setting = scene.setting(words, gains);
    Ok(LawConfig {
        law: scene.method.kind.float(&setting)?,
        start_gains: [setting.stiffness_n_per_m, scene.method.kind.features().scale],
        live: scene.method.kind.is_live(),
        surface: scene.surface(words),
        count_m: setting.count_m,
        full_scale_n: setting.limit_n + setting.quantum_n,
        limit_n: setting.limit_n,
        formats: [words.config.stiffness, words.config.damping, words.config.scale],
        start: [words.stiffness, words.scale],
        period_width: words.config.period_width,
    })
}
