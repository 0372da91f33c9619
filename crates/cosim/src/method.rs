//! Builds a scene's loop from its method: the wiring in words, or the reference law in floats.

use hpu_datapath::{
    BoundingConfig, ConventionalLoop, CouplingConfig, EnergyBounding, HybridLoop, Law, LawWidths, MethodLoop,
    MethodLoopConfig, PassiveSpring, PassivityConfig, PassivityController, SampledWall, SampledWallConfig, Shaping,
    SpringConfig, VirtualCoupling,
};
use hpu_signal::Format;

use crate::law::{self, AnyLaw, BoundingForm, InputShaper, Observer, Wall, high_pass};
use crate::law_loop::{LawConfig, LawLoop};
use crate::rig::TheLoop;
use crate::scene::{Datapath, EncoderModel, LawMethod, Loop, LoopWords, Realised, SampledWallMethod, Scene};
use crate::session::SessionError;

/// Returns the scene's wiring before reset.
pub(crate) fn wiring(scene: &Scene, words: &LoopWords) -> Result<TheLoop, SessionError> {
    if scene.model.datapath == Datapath::Law {
        let Realised { stiffness_nm_per_rad, damping_nm_s_per_rad, .. } = words.realised;
        let config = law_config(scene, words, (stiffness_nm_per_rad, damping_nm_s_per_rad))?;
        return Ok(TheLoop::Law(LawLoop::new(config)));
    }
    let widths = LawWidths {
        width: words.config.position_width,
        stiffness: words.config.stiffness,
        damping: words.config.damping,
        period_width: words.config.period_width,
        scale: words.config.scale,
        torque_width: words.config.pwm.width,
    };
    let method = match scene.method.kind {
        Loop::Hybrid => return HybridLoop::new(words.config).map(TheLoop::Hybrid).map_err(SessionError::Config),
        Loop::Conventional => {
            return ConventionalLoop::new(words.config).map(TheLoop::Conventional).map_err(SessionError::Config);
        }
        Loop::Law(method) => method,
    };
    let units = Units { scene, realised: &words.realised };
    match method {
        LawMethod::SampledWall(wall) => {
            let config = units.sampled_wall(&wall, widths)?;
            around(scene, words, SampledWall::new(config)).map(TheLoop::SampledWall)
        }
        LawMethod::VirtualCoupling { rigid, .. } => {
            let config = units.coupling(rigid, widths);
            around(scene, words, VirtualCoupling::new(config)).map(TheLoop::VirtualCoupling)
        }
        LawMethod::PassivityController { observer, credit_j, energy_bits } => {
            let credit = match credit_j {
                Some(credit_j) => {
                    units.whole("method.credit", credit_j, units.energy_j(), "J", Format::unsigned(31))?
                }
                None => 0,
            };
            let exact = observer == Observer::HeldForce;
            let config = PassivityConfig { widths, exact, energy_width: energy_bits, credit };
            around(scene, words, PassivityController::new(config)).map(TheLoop::PassivityController)
        }
        LawMethod::EnergyBounding { form, bound_format, energy_bits } => {
            let config = units.bounding(form, bound_format, energy_bits, widths)?;
            around(scene, words, EnergyBounding::new(config)).map(TheLoop::EnergyBounding)
        }
        LawMethod::PassiveSpring { alpha, revive, extension_frac, .. } => {
            let alpha = units.whole("method.alpha", alpha, 1.0, "", Format::new(false, 8, 8).expect("16 bits"))?;
            let config = SpringConfig { widths, extension_frac, alpha, revive };
            around(scene, words, PassiveSpring::new(config)).map(TheLoop::PassiveSpring)
        }
    }
}

/// Puts the loop around a law. A shaper samples when the law's torque is there.
fn around<L: Law>(
    scene: &Scene,
    words: &LoopWords,
    law: Result<L, hpu_datapath::ConfigError>,
) -> Result<MethodLoop<L>, SessionError> {
    let law = law.map_err(SessionError::Config)?;
    if i64::from(law.latency()) >= words.period {
        let most_hz = scene.clock.frequency_hz() as f64 / f64::from(law.latency() + 1);
        let reason = format!(
            "{} clocks a sample, {} take {}; write at most {most_hz:.0} Hz, or fewer bits",
            words.period,
            L::NAME,
            law.latency()
        );
        return Err(SessionError::Scene(scene.error("method.sample_rate", reason)));
    }
    let shaping = scene.method.shaper_hz.map(|cutoff_hz| {
        let unit = Format::new(true, 1, 30).expect("32 bits").lsb();
        let word = |value: f64| (value / unit).round() as i32;
        let [b0, b1, b2, a1, a2] = high_pass(cutoff_hz, scene.sample_period_s()).map(word);
        Shaping { phase: law.latency() + 1, b: [b0, b1, b2], a: [a1, a2] }
    });
    MethodLoop::new(law, MethodLoopConfig { pwm: words.config.pwm, shaping }).map_err(SessionError::Config)
}

/// The value of a word in the scene's units.
struct Units<'a> {
    scene: &'a Scene,
    realised: &'a Realised,
}

impl Units<'_> {
    /// Returns the stiffness of one PWM count per count.
    fn stiffness(&self) -> f64 {
        self.realised.torque_quantum_nm / self.realised.count_rad
    }

    /// Returns the energy of one PWM count times one count.
    fn energy_j(&self) -> f64 {
        self.realised.torque_quantum_nm * self.realised.count_rad
    }

    fn whole(&self, key: &str, value: f64, unit: f64, si: &str, format: Format) -> Result<u32, SessionError> {
        let word = self.scene.gain(key, value, unit, si, format).map_err(SessionError::Scene)?;
        Ok(u32::try_from(word).expect("an unsigned format of at most 32 bits"))
    }

    fn sampled_wall(&self, wall: &SampledWallMethod, widths: LawWidths) -> Result<SampledWallConfig, SessionError> {
        let unit = self.stiffness() * self.scene.velocity_span_s();
        let relief = self.whole("method.negative_damping", wall.relief_nm_s_per_rad, unit, "", widths.damping)?;
        Ok(SampledWallConfig {
            widths,
            spring_held: !wall.live,
            estimator: wall.estimator,
            ratio: wall.ratio,
            shift: wall.shift,
            window: wall.window,
            noise: wall.noise,
            velocity_frac: wall.velocity_frac,
            relief,
        })
    }

    /// Returns the coupling's configuration, with shares computed from the gains that the words realise.
    fn coupling(&self, rigid: bool, widths: LawWidths) -> CouplingConfig {
        let Realised { stiffness_nm_per_rad: coupling, damping_nm_s_per_rad: damper, .. } = *self.realised;
        let environment = if rigid { f64::INFINITY } else { self.scene.wall.stiffness_nm_per_rad };
        let shares = law::VirtualCoupling::new(coupling, damper, environment, self.scene.sample_period_s()).shares();
        let gain_frac = 16;
        let word = |share: f64| (share * f64::from(1u32 << gain_frac)).round() as u32;
        CouplingConfig {
            widths,
            extension_frac: 8,
            gain_frac,
            share: word(shares.share),
            free: word(shares.free),
            held: word(shares.held),
        }
    }

    fn bounding(
        &self,
        form: BoundingForm,
        bound_format: Format,
        energy_width: u32,
        widths: LawWidths,
    ) -> Result<BoundingConfig, SessionError> {
        let word = |key, value| self.whole(key, value, self.stiffness(), "", bound_format);
        let (least_conservative, c1, c2) = match form {
            BoundingForm::C1C2(c1, c2) => (false, word("method.c1", c1)?, word("method.c2", c2)?),
            BoundingForm::ForceBound(c) => (true, word("method.c1", c)?, 0),
        };
        let (bound_width, bound_frac) = (bound_format.width(), bound_format.frac().unsigned_abs());
        let root = (2 * (bound_width + widths.width)).max(bound_width + energy_width + bound_frac + 2);
        Ok(BoundingConfig {
            widths,
            least_conservative,
            c1,
            c2,
            bound_frac,
            bound_width,
            energy_width,
            root_width: root.next_multiple_of(2),
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
pub fn law_as_asked(scene: &Scene) -> Result<LawConfig, SessionError> {
    let words = scene.words().map_err(SessionError::Scene)?;
    let gains = match scene.method.kind {
        Loop::Law(LawMethod::VirtualCoupling { coupling_nm_per_rad, coupling_nm_s_per_rad, .. }) => {
            (coupling_nm_per_rad, coupling_nm_s_per_rad)
        }
        _ => (scene.wall.stiffness_nm_per_rad, scene.wall.damping_nm_s_per_rad),
    };
    law_config(scene, &words, gains)
}

/// Returns the configuration of a scene's reference law with stiffness `k` and damping `b` (those of the coupling,
/// where there is one).
fn law_config(scene: &Scene, words: &LoopWords, (k, b): (f64, f64)) -> Result<LawConfig, SessionError> {
    let Realised { torque_quantum_nm, count_rad, .. } = words.realised;
    let limit_n = torque_quantum_nm * Format::unsigned(words.config.pwm.width).max() as f64;
    let surface = Format::signed(words.config.position_width).wrap(words.reference.into());
    let start_m = match scene.model.encoder {
        EncoderModel::Quantised | EncoderModel::Loaded => -(surface as f64) * count_rad,
        EncoderModel::Ideal => scene.initial_angle_rad() - scene.wall.position_rad,
    };
    let period_s = scene.sample_period_s();
    let wall = |ratio| Wall::new(k, b, ratio, period_s, start_m);
    let law = match scene.method.kind {
        Loop::Hybrid | Loop::Conventional => AnyLaw::Wall(wall(1)),
        Loop::Law(LawMethod::SampledWall(method)) => {
            if method.estimator != hpu_datapath::Estimator::Difference {
                let reason =
                    "the law in floats takes the difference; write \"difference\", or model.datapath = \"words\"";
                return Err(SessionError::Scene(scene.error("method.estimator", reason)));
            }
            let mut wall = wall(method.ratio);
            wall.relief_n_s_per_m = method.relief_nm_s_per_rad;
            AnyLaw::Wall(wall)
        }
        Loop::Law(LawMethod::VirtualCoupling { rigid, .. }) => {
            let environment = if rigid { f64::INFINITY } else { scene.wall.stiffness_nm_per_rad };
            AnyLaw::VirtualCoupling(law::VirtualCoupling::new(k, b, environment, period_s))
        }
        Loop::Law(LawMethod::PassivityController { observer, credit_j, .. }) => {
            let credit_j = credit_j.unwrap_or(f64::INFINITY);
            let controller = law::PassivityController::new(wall(1), observer, credit_j, limit_n, start_m);
            AnyLaw::PassivityController(controller)
        }
        Loop::Law(LawMethod::EnergyBounding { form, .. }) => {
            AnyLaw::EnergyBounding(law::EnergyBounding::new(wall(1), form, limit_n, start_m))
        }
        Loop::Law(LawMethod::PassiveSpring { alpha, beta, revive, .. }) => {
            let mut spring = law::PassiveSpring::new(k, revive, start_m);
            (spring.alpha, spring.beta) = (alpha, beta);
            AnyLaw::PassiveSpring(spring)
        }
    };
    let law = match scene.method.shaper_hz {
        Some(cutoff_hz) => AnyLaw::Shaped(Box::new(InputShaper::new(law, cutoff_hz, period_s))),
        None => law,
    };
    Ok(LawConfig {
        law,
        live: scene.method.kind.is_live(),
        surface,
        count_m: count_rad,
        full_scale_n: limit_n + torque_quantum_nm,
        limit_n,
        formats: [words.config.stiffness, words.config.damping, words.config.scale],
        start: [words.stiffness, words.scale],
        period_width: words.config.period_width,
    })
}
