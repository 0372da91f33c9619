//! The words of the method loops: torque and memory of each law.
//!
//! | Law | What is proved of it |
//! |---|---|
//! | `sampled_wall` | everything; an edge timer's error is none of its words' |
//! | `virtual_coupling` | the extension stays between -1 LSB and the deepest displacement's share, an invariant; the torque |
//! | `passivity_controller` | the torque's limit; its energy is a sum without one, unless it has a credit |
//! | `energy_bounding` | the torque never leaves what the wall asks for, or 0; its energy is a sum without a limit |
//! | `passive_spring` | with `alpha = 1` the extension never exceeds the penetration; the torque |
//! | input shaper | what it hands on is between 0 and the torque; its filter's overflow is not proved |

//!
//! Errors beside real numbers are proved of the sampled wall; those of the others go round their memory and are left
//! out.

use hpu_cosim::TheLoop;
use hpu_datapath::{Generic, Law, LawWidths, MethodLoop};
use hpu_signal::{Format, Overflow};

use super::haptic::{Rows, Settings};
use super::span::{Span, Symbols};
use super::travel::Travel;
use super::word::Word;

/// What a law is made of, and what it may see.
struct Seen<'a> {
    settings: &'a Settings,
    travel: &'a Travel,
    widths: LawWidths,
    generics: Vec<(&'static str, Generic)>,
    delta: Word,
    depth: Word,
}

/// The words of a method loop; none of a wiring that is another.
pub(crate) fn method(settings: &Settings, travel: &Travel, wiring: &TheLoop) -> Option<Rows> {
    let mut rows = Rows::new(settings, travel);
    let (torque, memory) = match wiring {
        TheLoop::SampledWall(law) => Seen::new(settings, travel, &rows, law).sampled_wall(&mut rows.symbols),
        TheLoop::VirtualCoupling(law) => Seen::new(settings, travel, &rows, law).virtual_coupling(&mut rows.symbols),
        TheLoop::PassivityController(law) => Seen::new(settings, travel, &rows, law).passivity(&mut rows.symbols),
        TheLoop::EnergyBounding(law) => Seen::new(settings, travel, &rows, law).energy_bounding(&mut rows.symbols),
        TheLoop::PassiveSpring(law) => Seen::new(settings, travel, &rows, law).passive_spring(&mut rows.symbols),
        _ => return None,
    };
    rows.put("torque", &torque.0);
    match torque.1 {
        Some(remark) => rows.put_with("memory", &memory, remark),
        None => rows.put("memory", &memory),
    }
    let shaped = number(&wiring.block().generics(), "SHAPER_ENABLED") == 1;
    let shaped = if shaped {
        let span = torque.0.span.clamp(Span::new(0, i128::MAX));
        Word { exact: None, fits: false, ..rows.symbols.given(span, 0) }
    } else {
        torque.0.clone()
    };
    rows.put("shaped", &shaped);
    let full = (1 << settings.config.pwm.width) - 1;
    let command = rows.symbols.clamped(&shaped, Span::new(-full, full));
    rows.put("command", &command);
    Some(rows)
}

/// A generic's value, a boolean's as 0 or 1.
fn number(generics: &[(&'static str, Generic)], name: &str) -> i128 {
    match generics.iter().find(|generic| generic.0 == name).expect("a generic of this law").1 {
        Generic::Integer(value) => value.into(),
        Generic::Boolean(value) => value.into(),
    }
}

/// A word, why nothing more is known of the memory beside it, and that memory.
type Made = ((Word, Option<&'static str>), Word);

impl<'a> Seen<'a> {
    fn new<L: Law>(settings: &'a Settings, travel: &'a Travel, rows: &Rows, wiring: &MethodLoop<L>) -> Self {
        let (delta, depth) = (rows.get("delta").clone(), rows.get("penetration").clone());
        let (widths, generics) = (*wiring.law().widths(), wiring.law().own_generics());
        Self { settings, travel, widths, generics, delta, depth }
    }

    fn number(&self, name: &str) -> i128 {
        number(&self.generics, name)
    }

    /// The memory's format with this many fraction bits.
    fn memory(&self, signed: bool, int: u32, frac: i128) -> Format {
        Format::new(signed, int as i32, frac as i32).expect("as the law has it")
    }

    /// Counts gone in so many periods; any if half the counter's range may be among them.
    fn moved(&self, symbols: &mut Symbols, clocks: f64) -> Word {
        let difference = Format::signed(self.widths.width);
        let moved = self.travel.moved(clocks);
        if self.travel.decoded && moved.is_within(Span::of(difference)) {
            symbols.given(moved, 0)
        } else {
            symbols.any(difference)
        }
    }

    /// A product truncated and clamped to a torque, with sign or without.
    fn clamp(&self, symbols: &mut Symbols, word: &Word, by: Span, frac: i32, signed: bool) -> Word {
        let width = self.widths.torque_width;
        let to = if signed { Format::signed(width + 1) } else { Format::unsigned(width) };
        let product = symbols.product(word, by, frac);
        symbols.narrowed(&product, to, Overflow::Saturate)
    }

    fn spring(&self, symbols: &mut Symbols) -> Word {
        self.clamp(symbols, &self.depth, self.settings.stiffness, self.widths.stiffness.frac(), false)
    }

    /// Spring and drag within what the bridge can show, or 0, for motion over so many clocks.
    fn wanted(&self, symbols: &mut Symbols, clocks: f64) -> Word {
        let spring = self.spring(symbols);
        let moved = self.moved(symbols, clocks);
        let drag = self.clamp(symbols, &moved, self.settings.damping, self.widths.damping.frac(), true);
        let parts = spring.fits && drag.fits && self.delta.fits && moved.fits;
        let sum = symbols.sum(&spring, &drag);
        let top = i128::from(self.widths.top());
        let mut wanted = symbols.clamped(&sum, Span::new(-top, top));
        wanted.fits &= parts;
        symbols.or_zero(&wanted)
    }

    /// Clocks between two captures of a law that computes for a while.
    fn capture_clocks(&self, latency: i128) -> f64 {
        self.settings.period as f64 + latency as f64
    }

    fn sampled_wall(&self, symbols: &mut Symbols) -> Made {
        let frac = self.number("VELOCITY_FRAC");
        let velocity = self.estimate(symbols, frac);
        let spring = self.spring(symbols);
        let gain = self.widths.damping.frac();
        let drag = self.clamp(symbols, &velocity, self.settings.damping, gain, true);
        let relief = self.clamp(symbols, &velocity, Span::exact(self.number("RELIEF")), gain, true);
        let relief_off = symbols.product(&relief, Span::exact(-1), 0);
        let inside = symbols.sum(&spring, &drag);
        let inside = symbols.sum(&inside, &relief_off);
        // Outside the wall the relief is all there is.
        let mut torque = symbols.either(&inside, &relief_off);
        torque.fits = spring.fits && drag.fits && relief.fits && velocity.fits && self.delta.fits;
        ((torque, None), velocity)
    }

    /// The velocity of any estimator.
    fn estimate(&self, symbols: &mut Symbols, frac: i128) -> Word {
        let format = self.memory(true, self.widths.width - 1, frac);
        let period_format = Format::unsigned(self.widths.period_width);
        let period = period_format.wrap(i128::from(self.settings.period) * self.number("RATIO"));
        let period = period.max(1) as f64;
        let window = self.number("WINDOW") as f64;
        let sample = self.moved(symbols, period);
        let zero = sample.span.hull(Span::exact(0)).times(Span::exact(1 << frac));
        let lsb = frac as i32;
        match self.number("ESTIMATOR") {
            0 => symbols.product(&sample, Span::exact(1 << frac), lsb),
            // Between two values that fit, rounded down, it stays between them; every floor is carried on, 2^SHIFT LSBs
            // in all.
            1 => {
                let error = Span::new(-(1 << self.number("SHIFT")), 0);
                symbols.replaced(zero, lsb, sample.exact.map(|_| (error, lsb)), sample.fits)
            }
            2 => {
                let moved = self.moved(symbols, period * window);
                symbols.product(&moved, Span::exact(1 << frac), lsb)
            }
            // Over n samples at most n times the most of one, divided by n and rounded down.
            3 => {
                let whole = self.moved(symbols, period * window);
                let error = whole.exact.map(|_| (Span::new(-1, 0), lsb));
                symbols.replaced(zero, lsb, error, sample.fits && whole.fits)
            }
            _ => {
                // Two counts the same way are no closer than the fastest shaft has them.
                let apart = (1.0 / self.travel.fastest()).floor().max(1.0);
                let most = (period / apart * 2f64.powi(lsb)).next_up().ceil();
                let limit = format.max();
                let fits = self.travel.decoded && most <= limit as f64;
                let most = (most as i128).min(limit);
                Word { exact: None, fits, ..symbols.given(Span::new(-most, most), lsb) }
            }
        }
    }

    fn virtual_coupling(&self, symbols: &mut Symbols) -> Made {
        let (frac, gain) = (self.number("EXTENSION_FRAC"), self.number("GAIN_FRAC"));
        let [share, free, held] = ["SHARE", "FREE", "HELD"].map(|name| self.number(name));
        let (one, lsb) = (1i128 << gain, frac as i32);
        let format = self.memory(true, self.widths.width - 1, frac);
        let deepest = self.delta.span.max.max(0) << frac;
        if held >= one || free > one {
            return ((symbols.wrapped(Format::signed(self.widths.torque_width + 2)), None), symbols.any(format));
        }
        // e <= most: floor((share delta + held e) / 2^gain) <= most. At least -1: a tool in contact is not ahead of the
        // device.
        let most = (share * deepest + one - held - 1) / (one - held);
        let least = if free > 0 || held > 0 { -1 } else { 0 };
        let fits = self.delta.fits && most <= format.max();
        let span = Span::new(least, most.min(format.max()));
        let last = Word { exact: None, fits, ..symbols.given(span, lsb) };
        // In contact, as a form of the displacement and the extension before: the drag is of their difference.
        let device = symbols.given(Span::new(0, deepest >> frac), 0).form.times(share << frac, gain as i32 + lsb);
        let before = last.form.times(held, gain as i32);
        let exact = device.plus(&before);
        let extension = symbols.truncated(&exact, lsb);
        let spring = extension.times(self.settings.stiffness.max, self.widths.stiffness.frac());
        let spring = symbols.truncated(&spring, 0);
        let drag = extension.minus(&last.form).times(self.settings.damping.max, self.widths.damping.frac());
        let drag = symbols.truncated(&drag, 0);
        let sum = symbols.words(&spring.plus(&drag), 0);
        let top = i128::from(self.widths.top());
        let torque = Span::new(0, sum.max.clamp(0, top));
        let torque = Word { exact: None, fits: fits && sum.max <= top, ..symbols.given(torque, 0) };
        ((torque, None), last)
    }

    fn passivity(&self, symbols: &mut Symbols) -> Made {
        let bits = self.number("ENERGY_WIDTH");
        let credit = self.number("CREDIT");
        let top = i128::from(self.widths.top());
        let torque = Word { exact: None, fits: false, ..symbols.given(Span::new(-top, top), 0) };
        let energy = Span::of(Format::signed(bits as u32));
        let energy = if credit > 0 { energy.meet(Span::new(energy.min, credit)) } else { energy };
        let memory = Word { exact: None, fits: false, ..symbols.given(energy, 0) };
        ((torque, Some("a sum of energies without a limit of its own")), memory)
    }

    fn energy_bounding(&self, symbols: &mut Symbols) -> Made {
        let latency = self.number("ROOT_WIDTH") / 2 + 2;
        let wanted = self.wanted(symbols, self.capture_clocks(latency));
        // Each bound of the torque lies between the one before, or 0, and what is wanted.
        let torque = Word { exact: None, fits: false, ..wanted };
        let (bits, fine) = (self.number("ENERGY_WIDTH"), self.number("LEAST_CONSERVATIVE") == 1);
        let frac = if fine { self.number("BOUND_FRAC") as i32 } else { 0 };
        let energy = symbols.given(Span::of(Format::unsigned(bits as u32)), frac);
        let memory = Word { exact: None, fits: false, ..energy };
        ((torque, Some("a sum of energies without a limit of its own")), memory)
    }

    fn passive_spring(&self, symbols: &mut Symbols) -> Made {
        let frac = self.number("EXTENSION_FRAC");
        let format = self.memory(false, self.widths.width, frac);
        // x'^2 = x^2 + 2 x d <= (x + d)^2: from a penetration on, x follows it, and dies outside.
        let bounded = self.number("ALPHA") == 256 && self.delta.fits;
        let most = if bounded { self.depth.span.max << frac } else { format.max() };
        let memory = symbols.given(Span::new(0, most), frac as i32);
        let memory = Word { exact: None, fits: false, ..memory };
        let by = self.settings.stiffness.times(self.settings.scale);
        let fraction = self.widths.stiffness.frac() + self.widths.scale.frac();
        let torque = self.clamp(symbols, &memory, by, fraction, false);
        let fits = bounded && torque.fits;
        let remark = if bounded {
            "clamped at 0, where the spring dies"
        } else {
            "proved for alpha = 1 and a limited penetration alone"
        };
        ((Word { fits, ..torque }, Some(remark)), memory)
    }
}
