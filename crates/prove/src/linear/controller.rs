//! The controllers of linear loops, from position to effort.

use crate::Error;
use hpu_cosim::method::{CouplingMethod, SampledWallMethod};
use hpu_cosim::scene::{LawMethod, Loop, Scene};
use hpu_datapath::Estimator;

/// Why a scene with `wall.ramp` has no linear loop.
const RAMPED: &str = "no linear loop: wall.ramp changes the wall during the run";

/// A term of a controller's polynomial: `(constant + by_stiffness K) δ^power z^-lag`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    pub lag: u32,
    pub power: usize,
    pub constant: f64,
    pub by_stiffness: f64,
}

impl Term {
    const fn new(lag: u32, power: usize, constant: f64, by_stiffness: f64) -> Self {
        Self { lag, power, constant, by_stiffness }
    }
}

/// The wall's damping, as a function of the wall's stiffness.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Damping {
    /// The same damping at every stiffness, in SI units.
    Fixed(f64),
    /// A damping proportional to the stiffness; the factor is in seconds.
    PerStiffness(f64),
}

/// Returns the controller of a scene's method, from position to effort, as numerator and denominator.
pub(super) fn controller(scene: &Scene, damping: Damping) -> Result<(Vec<Term>, Vec<Term>), Error> {
    if scene.wall.ramp.is_some() {
        return Err(RAMPED.into());
    }
    let (fixed, per_stiffness) = match damping {
        Damping::Fixed(damping) => (damping, 0.0),
        Damping::PerStiffness(seconds) => (0.0, seconds),
    };
    let sampled = f64::from(u8::from(!scene.method.kind.is_live()));
    let terms = Terms { period_s: scene.sample_period_s(), sampled, fixed, per_stiffness };
    let law = match scene.method.kind {
        Loop::Hybrid | Loop::Conventional => return Ok(terms.plain()),
        Loop::Law(law) => law,
    };
    if scene.method.shaper_hz.is_some() {
        return nonlinear("the input shaper");
    }
    match law {
        LawMethod::SampledWall(wall) => {
            of_sampled_wall(&wall, Terms { fixed: fixed - wall.relief_nm_s_per_rad, ..terms })
        }
        // The loop obeys e (K + K_c + B_c (1 - 1/z)/T) = K x, and the force is e (K_c + B_c (1 - 1/z)/T).
        LawMethod::VirtualCoupling(CouplingMethod { coupling_nm_per_rad, coupling_nm_s_per_rad, rigid }) => {
            let damper = coupling_nm_s_per_rad / terms.period_s;
            if rigid {
                return Err("the coupling's wall is rigid, whatever its stiffness".into());
            }
            Ok((
                vec![Term::new(0, 0, 0.0, coupling_nm_per_rad), Term::new(1, 1, 0.0, damper)],
                vec![Term::new(0, 0, coupling_nm_per_rad, 1.0), Term::new(1, 1, damper, 0.0)],
            ))
        }
        LawMethod::PassivityController(_) => nonlinear("a passivity controller"),
        LawMethod::EnergyBounding(_) => nonlinear("energy bounding"),
        LawMethod::PassiveSpring(_) => nonlinear("an energy-level spring"),
        LawMethod::BrakingPulse(_) => nonlinear("a braking pulse"),
        LawMethod::TorqueTable(_) => nonlinear("a table of torques"),
        LawMethod::PositionPid(_) => Err("no linear loop of a wall: its method follows a target".into()),
    }
}

fn nonlinear<T>(what: &str) -> Result<T, Error> {
    Err(Error::new(format_args!("no linear loop: {what} is nonlinear")))
}

/// The numbers of which the terms of a law are made.
#[derive(Clone, Copy)]
struct Terms {
    period_s: f64,
    /// The share of the spring that is sampled: 1, or 0 of a live spring.
    sampled: f64,
    /// The damping, and what of it each unit of stiffness brings.
    fixed: f64,
    per_stiffness: f64,
}

impl Terms {
    /// Returns the damping's term for a velocity estimate that takes `share` of each sample's difference.
    fn drag(&self, share: f64, lag: u32, power: usize) -> Term {
        Term::new(lag, power, share * self.fixed / self.period_s, share * self.per_stiffness / self.period_s)
    }

    /// Returns 1.
    fn one() -> Vec<Term> {
        vec![Term::new(0, 0, 1.0, 0.0)]
    }

    /// Returns the law of a spring and the backward difference.
    fn plain(&self) -> (Vec<Term>, Vec<Term>) {
        (vec![Term::new(0, 0, 0.0, self.sampled), self.drag(1.0, 1, 1)], Self::one())
    }
}

/// Returns the law of a sampled wall with its velocity estimate, as [`controller`].
fn of_sampled_wall(wall: &SampledWallMethod, terms: Terms) -> Result<(Vec<Term>, Vec<Term>), Error> {
    if terms.fixed == 0.0 && terms.per_stiffness == 0.0 {
        return Ok(terms.plain());
    }
    if wall.ratio != 1 {
        return Err(format!("no linear loop of one rate: the velocity is renewed every {} samples", wall.ratio).into());
    }
    match wall.estimator {
        Estimator::Difference => Ok(terms.plain()),
        // With D = 1 - 1/z the filter is B0 (2 - D)^2 / (4 B0 - (A1 + 2 A2) D + A2 D^2).
        Estimator::Filtered if wall.order == 2 => {
            let (words, _) = wall.section(terms.period_s).ok_or("no linear loop: the filter passes nothing on")?;
            let [b0, a1, a2] = words.map(|word| word as f64 * 0.5f64.powi(30));
            let den = [4.0 * b0, -(a1 + 2.0 * a2), a2];
            let den = den.into_iter().enumerate().map(|(n, term)| Term::new(n as u32, n, term, 0.0));
            let spring = den.clone().map(|term| Term::new(term.lag, term.power, 0.0, terms.sampled * term.constant));
            let drag = [4.0 * b0, -4.0 * b0, b0].into_iter().zip(1..);
            let drag = drag.map(|(share, n)| terms.drag(share, n, n as usize));
            Ok((spring.chain(drag).collect(), den.collect()))
        }
        // Each sample renews a share of weight / 2^shift.
        Estimator::Filtered => {
            let (weight, frac) = wall.weight(terms.period_s);
            let share = f64::from(weight) * 0.5f64.powi(frac.cast_signed());
            let den = vec![Term::new(0, 0, share, 0.0), Term::new(1, 1, 1.0 - share, 0.0)];
            let mut num: Vec<Term> = den
                .iter()
                .map(|term| Term { constant: 0.0, by_stiffness: terms.sampled * term.constant, ..*term })
                .collect();
            num.push(terms.drag(share, 1, 1));
            Ok((num, den))
        }
        Estimator::Window => {
            let share = 1.0 / f64::from(wall.window);
            let spring = Term::new(0, 0, 0.0, terms.sampled);
            let ends = [terms.drag(share, 0, 0), terms.drag(-share, wall.window, 0)];
            Ok(([spring].into_iter().chain(ends).collect(), Terms::one()))
        }
        Estimator::Foaw => nonlinear("an adaptive window"),
        Estimator::Levant => nonlinear("a sliding mode"),
        Estimator::Butterworth => unreachable!("a scene says `filtered`, of order 2"),
        Estimator::EdgeTimer => nonlinear("a velocity from the time between two counts"),
    }
}
