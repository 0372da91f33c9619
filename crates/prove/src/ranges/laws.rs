//! The words of the method loops: torque and memory of each law.
//!
//! | law | proved |
//! |---|---|
//! | `sampled_wall` | everything, except the error of an edge timer, which does not come from its words |
//! | `virtual_coupling` | an invariant: the extension is between -1 LSB and a share of the greatest depth; the torque |
//! | `passivity_controller` | the torque's limit; the energy is a sum without a limit, unless there is a credit |
//! | `energy_bounding` | the torque stays in the range of wanted torques and 0; the energy is a sum without a limit |
//! | `passive_spring` | with `alpha = 1` the extension never exceeds the penetration; the torque |
//! | `braking_pulse` | the pulse of the fastest motion; the torque is between that of the wall and full scale |
//! | `torque_table` | the torques of the table; the torque, whose limit may act |
//! | `position_pid` | the clamp of the torque |
//! | input shaper | its output is between 0 and the torque; the overflow of its filter is not proved |
//!
//! Errors against real numbers are proved for the sampled wall. The errors of the other laws circulate through their
//! memories and are left out.

use hpu_cosim::AxisLoop;
use hpu_datapath::{
    AnyBlock, BrakingPulse, ButterworthConfig, EnergyBounding, Estimator, Law, LawIn, LawOut, LawWidths, PassiveSpring,
    PassivityConfig, PassivityController, SampledWall, SampledWallConfig, SpringConfig, TableConfig, TorqueTable,
    VirtualCoupling, sampled_wall,
};
use hpu_signal::{Format, Word as _};

use super::affine::Affine;
use super::travel::Settings;
use super::travel::Travel;
use super::walk::Walk;
use super::word::Word;
use hpu_signal::Span;

/// A net, its word, and the reason why no more is known of it.
pub(super) type Stated = (&'static str, Affine, Option<&'static str>);

/// The loop in front of a law, and the law's widths.
struct Seen<'a> {
    settings: &'a Settings,
    travel: &'a Travel,
    walk: &'a Walk<'a>,
    widths: LawWidths,
    input: LawIn<Affine>,
}

/// Returns the words that a method's law, or the shaper behind it, drives; nothing for another block.
pub(super) fn stated(
    settings: &Settings,
    travel: &Travel,
    walk: &Walk<'_>,
    wiring: &AxisLoop,
    label: &str,
    known: &dyn Fn(&str) -> Affine,
) -> Vec<Stated> {
    let shaped = |is_shaped: bool| {
        let torque = known("torque");
        let handed_on = torque.with(|word, symbols| {
            let span = word.span.clamp(Span::new(0, i128::MAX));
            if is_shaped { Word { exact: None, fits: false, ..symbols.given(span) } } else { word }
        });
        vec![("shaped", handed_on, None)]
    };
    macro_rules! of {
        ($wiring:expr, $made:expr) => {
            match label {
                "law" => {
                    let law = $wiring.law();
                    let widths = *law.widths();
                    let input = widths.inputs().map(|port| known(port.name));
                    let seen = Seen { settings, travel, walk, widths, input };
                    let ((torque, remark), memory) = $made(&seen, law);
                    vec![("torque", torque, None), ("memory", memory, remark)]
                }
                "shaper" => shaped($wiring.is_shaped()),
                _ => Vec::new(),
            }
        };
    }
    match wiring {
        AxisLoop::Hybrid(_) | AxisLoop::Conventional(_) => Vec::new(),
        AxisLoop::SampledWall(wiring) => of!(wiring, Seen::sampled_wall),
        AxisLoop::VirtualCoupling(wiring) => of!(wiring, Seen::virtual_coupling),
        AxisLoop::PassivityController(wiring) => of!(wiring, Seen::passivity),
        AxisLoop::EnergyBounding(wiring) => of!(wiring, Seen::energy_bounding),
        AxisLoop::PassiveSpring(wiring) => of!(wiring, Seen::passive_spring),
        AxisLoop::BrakingPulse(wiring) => of!(wiring, Seen::braking_pulse),
        AxisLoop::TorqueTable(wiring) => of!(wiring, Seen::torque_table),
        #[cfg(not(target_family = "wasm"))]
        AxisLoop::PositionPid(wiring) => of!(wiring, Seen::position_pid),
    }
}

/// Makes a word of which only the range is known.
fn within(span: Span, fits: bool) -> Affine {
    Affine::put(|symbols| Word { exact: None, fits, ..symbols.given(span) })
}

/// Returns the sums of the magnitudes of the response of a `butterworth_difference` to one count, and of that of its
/// `y` to one LSB more in one sample. `None` where its poles are real.
///
/// With poles `r e^(±iθ)` the response after sample `k` is at most `r^n (|y(k)| + r |y(k-1)|) / sin θ`. Roundings of
/// floats, below `2^-50` of a term, grow by the second sum, which is below `2^29`.
fn magnitudes(b0: u32, a1: i32) -> Option<[f64; 2]> {
    let config = ButterworthConfig { b0, a1, ..ButterworthConfig::default() };
    let [b0, a1, a2] = [f64::from(b0), f64::from(a1), config.a2() as f64].map(|word| word * 0.5f64.powi(30));
    let (radius, sine) = (a2.sqrt(), (1.0 - a1 * a1 / (4.0 * a2)).sqrt());
    if !(sine > 0.0 && radius > 0.0) {
        return None;
    }
    let ([mut y, mut y1, mut y2], mut sums) = ([1.0f64, 0.0, 0.0], [0.0, 0.0]);
    for _ in 0..1 << 24 {
        sums = [sums[0] + b0 * (y + 2.0 * y1 + y2).abs(), sums[1] + y.abs()];
        let rest = radius / (1.0 - radius) * (y.abs() + radius * y1.abs()) / sine;
        if rest < sums[1] * 0.5f64.powi(24) {
            return Some(sums.map(|sum| sum * (1.0 + 0.5f64.powi(20))));
        }
        [y, y1, y2] = [-a1 * y - a2 * y1, y, y1];
    }
    None
}

/// A torque, the reason why no more is known of the memory beside it, and that memory.
type Made = ((Affine, Option<&'static str>), Affine);

impl Seen<'_> {
    /// Returns the range of counts passed in `clocks` clock cycles; any count if that may be half the counter's range.
    fn moved(&self, clocks: f64) -> Affine {
        let moved = self.travel.moved(clocks);
        let difference = Format::signed(self.widths.width);
        let is_clear = self.travel.decoded && moved.is_within(Span::of(difference));
        Affine::put(|symbols| if is_clear { symbols.given(moved) } else { symbols.any(difference) })
    }

    fn sampled_wall(&self, law: &SampledWall) -> Made {
        let velocity = self.estimate(law);
        let LawIn { contact, penetration, stiffness, damping, .. } = self.input;
        let torque = |contact: i128| {
            let contact = Affine::int(contact);
            [law.torque(sampled_wall::Made { contact, penetration, stiffness, damping, velocity })]
        };
        let [torque] = Affine::branch(contact.is_set(), || torque(1), || torque(0));
        ((torque, None), velocity)
    }

    /// Returns the velocity of any estimator.
    fn estimate(&self, law: &SampledWall) -> Affine {
        let SampledWallConfig { estimator, shift, weight, window, velocity_frac: frac, .. } = *law.config();
        let period = law.velocity_period(self.settings.period);
        let clocks = period.max(1) as f64;
        let sample = self.moved(clocks).known();
        let still = sample.span.hull(Span::exact(0)).times(Span::exact(1 << frac));
        let inputs = [("position", self.input.position), ("period", Affine::int(period.into()))];
        let inputs = |name: &str| inputs.iter().find(|input| input.0 == name).map(|input| input.1);
        let read = |block: &dyn AnyBlock, stated: &[(&str, Affine)]| {
            *self.walk.stated(block, &inputs, stated).first().expect("a velocity")
        };
        match (estimator, law.estimator()) {
            (Estimator::Filtered, Some(block)) => {
                // The state lies between two values that fit, rounded down, so it stays between them. Every rounding
                // down carries over to the next sample: 2^SHIFT / WEIGHT LSBs in all.
                let weight = i128::from(weight);
                let all = ((1i128 << shift) + weight - 1) / weight;
                let error = sample.exact.map(|_| (Span::new(-all, 0), 0));
                let state = Affine::put(|symbols| symbols.replaced(still, error, true));
                read(block, &[("state", state)])
            }
            (Estimator::Difference | Estimator::Window, Some(block)) => read(block, &[]).shl(frac),
            // Over n samples: at most n times the largest of one, divided by n and rounded down.
            (Estimator::Foaw, _) => {
                let whole = self.moved(clocks * f64::from(window)).known();
                let error = whole.exact.map(|_| (Span::new(-1, 0), 0));
                Affine::put(|symbols| symbols.replaced(still, error, sample.fits && whole.fits))
            }
            // The filter's overshoot is the sum of the magnitudes of its response to one count. A rounding of `y` is
            // off by half of its LSB, that of the velocity by half of the velocity's.
            (Estimator::Butterworth, _) => {
                let SampledWallConfig { b0, a1, guard, .. } = *law.config();
                let format = Format::signed(self.widths.width + frac);
                let Some([most, rounding]) = magnitudes(b0, a1) else {
                    return Affine::put(|symbols| symbols.any(format));
                };
                let rounding = (0.5 + 0.5 * rounding * 0.5f64.powi(guard.cast_signed())).next_up().ceil() as i128;
                let counts = sample.span.max.max(-sample.span.min) as f64;
                let most = (counts * most * f64::from(1u32 << frac)).next_up().ceil() as i128 + rounding;
                let span = Span::new(-most, most);
                let fits = sample.fits && span.is_within(Span::of(format));
                let span = span.meet(Span::of(format));
                let error = sample.exact.filter(|_| fits).map(|_| (Span::new(-rounding, rounding), 0));
                Affine::put(|symbols| symbols.replaced(span, error, fits))
            }
            // The velocity may swing beyond that of the motion, up to where its word clamps.
            (Estimator::Levant, _) => Affine::put(|symbols| symbols.any(Format::signed(self.widths.width + frac))),
            (Estimator::EdgeTimer, _) | (_, None) => {
                // Two counts in the same direction are no closer in time than the fastest shaft makes them.
                let apart = (1.0 / self.travel.fastest()).floor().max(1.0);
                let most = (clocks / apart * f64::from(1u32 << frac)).next_up().ceil();
                let limit = Format::signed(self.widths.width + frac).max();
                let fits = self.travel.decoded && most <= limit as f64;
                let most = (most as i128).min(limit);
                within(Span::new(-most, most), fits)
            }
        }
    }

    fn virtual_coupling(&self, law: &VirtualCoupling) -> Made {
        let config = *law.config();
        let [share, free, held] = [config.share, config.free, config.held].map(i128::from);
        let (one, torque) = (1i128 << config.gain_frac, self.widths.torque());
        let format = Format::signed(self.widths.width + config.extension_frac);
        let Word { span: delta, fits, .. } = self.input.delta.known();
        if held >= one || free > one {
            return (
                (Affine::put(|symbols| symbols.wrapped(torque)), None),
                Affine::put(|symbols| symbols.any(format)),
            );
        }
        // The invariant is e <= most: floor((share delta + held e) / 2^gain) <= most. The extension is at least -1,
        // because a tool in contact is not ahead of the device.
        let deepest = delta.max.max(0);
        let most = (share * (deepest << config.extension_frac) + one - held - 1) / (one - held);
        let least = if free > 0 || held > 0 { -1 } else { 0 };
        let last = within(Span::new(least, most.min(format.max())), fits && most <= format.max());
        // Outside the surface the tool is free. Inside, a stiffer coupling pushes harder at the same extension, so the
        // ends of a ramp of the stiffness bound all of it.
        let Span { min, max } = self.settings.stiffness;
        let sides = [(delta.min <= -1).then(|| Span::new(delta.min, -1)), Some(Span::new(0, deepest))];
        let made = sides.into_iter().flatten().flat_map(|delta| [min, max].map(|stiffness| (delta, stiffness)));
        let made = made.map(|(delta, stiffness)| {
            let (delta, stiffness) = (Affine::given(delta), Affine::int(stiffness));
            law.made(LawIn { delta, stiffness, ..self.input }, last)
        });
        let joined = |one: LawOut<Affine>, other: LawOut<Affine>| LawOut {
            torque: one.torque.or(other.torque),
            memory: one.memory.or(other.memory),
        };
        let LawOut { torque: pushes, memory } = made.reduce(joined).expect("a side of the wall");
        if !memory.known().span.is_within(last.known().span) {
            return (
                (Affine::put(|symbols| symbols.wrapped(torque)), None),
                Affine::put(|symbols| symbols.any(format)),
            );
        }
        // No contact gives no torque. The error of the extension circulates and is left out.
        let pushes = pushes.or(Affine::int(0));
        ((pushes.with(|word, _| Word { exact: None, ..word }), None), last)
    }

    fn passivity(&self, law: &PassivityController) -> Made {
        let PassivityConfig { energy_width, credit, .. } = *law.config();
        let top = i128::from(self.widths.top());
        let energy = Span::of(Format::signed(energy_width));
        let energy = if credit > 0 { energy.meet(Span::new(energy.min, credit.into())) } else { energy };
        let torque = within(Span::new(-top, top), false);
        ((torque, Some("a sum of energies without a limit of its own")), within(energy, false))
    }

    fn energy_bounding(&self, law: &EnergyBounding) -> Made {
        let motion = self.moved(self.settings.period as f64 + f64::from(law.latency()));
        // Each bound of the torque lies between the bound before, or 0, and the torque that the wall asks for.
        let wanted = self.widths.wanted(&self.input, motion);
        let torque = wanted.with(|word, _| Word { exact: None, fits: false, ..word });
        let energy = Span::of(Format::unsigned(law.config().energy_width));
        ((torque, Some("a sum of energies without a limit of its own")), within(energy, false))
    }

    fn braking_pulse(&self, law: &BrakingPulse) -> Made {
        let motion = self.moved(self.settings.period as f64);
        let most = (i128::from(law.config().pulse) * motion.known().span.max.max(0)) >> self.widths.damping.frac();
        let format = Format::signed(self.widths.torque_width + 9);
        // A pulse only adds to the torque that the wall asks for, up to what the bridge can show.
        let wanted = self.widths.wanted(&self.input, motion).known().span;
        let torque = Span::new(wanted.min, wanted.max.max(self.widths.top().into()));
        let fits = most <= format.max();
        ((within(torque, false), None), within(Span::new(0, most.min(format.max())), fits))
    }

    fn torque_table(&self, law: &TorqueTable) -> Made {
        let TableConfig { table_bits, torques, .. } = *law.config();
        let words = torques[..1 << table_bits].iter().map(|&word| Span::exact(word.into()));
        let texture = words.reduce(Span::hull).expect("two torques at least");
        let wanted = self.widths.wanted(&self.input, self.moved(self.settings.period as f64)).known().span;
        let sum = wanted.plus(texture);
        let top = i128::from(self.widths.top());
        let bridge = Span::new(-top, top);
        ((within(sum.clamp(bridge), false), None), within(texture, true))
    }

    #[cfg(not(target_family = "wasm"))]
    fn position_pid(&self, law: &hpu_datapath::PositionPid) -> Made {
        let limit = i128::from(law.config().limit);
        let target = Span::of(Format::unsigned(self.widths.width));
        ((within(Span::new(-limit, limit), false), None), within(target, true))
    }

    fn passive_spring(&self, law: &PassiveSpring) -> Made {
        let SpringConfig { extension_frac: frac, alpha, .. } = *law.config();
        let format = Format::unsigned(self.widths.width + frac);
        let Word { span: depth, .. } = self.input.penetration.known();
        // x'^2 = x^2 + 2 x d <= (x + d)^2: the extension x follows a growing penetration, and decays outside the wall.
        let is_bounded = alpha == 256 && self.input.delta.known().fits;
        let most = if is_bounded { depth.max << frac } else { format.max() };
        let memory = within(Span::new(0, most), false);
        let torque = law.torque(&self.input, memory);
        let torque = torque.with(|word, _| Word { fits: is_bounded && word.fits, ..word });
        let remark = if is_bounded {
            "clamped at 0, where the spring dies"
        } else {
            "proved for alpha = 1 and a limited penetration alone"
        };
        ((torque, Some(remark)), memory)
    }
}
