//! The words of the two haptic loops, net by net.

use hpu_cosim::scene::LoopWords;
use hpu_datapath::LoopConfig;
use hpu_signal::{Format, Overflow, Signal};

use super::Bound;
use super::span::{Span, Symbols};
use super::travel::Travel;
use super::word::Word;

/// The settings of a scene's loop, each with all the words that it takes while the scene runs.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub config: LoopConfig,
    pub reference: Span,
    pub stiffness: Span,
    pub damping: Span,
    pub period: i64,
    pub scale: Span,
    /// The way that a turn of the counter takes, with its unit.
    pub turn: String,
}

impl Settings {
    pub fn new(words: &LoopWords, unit: &str) -> Self {
        let ramped = |from: i64, to: Option<i64>| Span::exact(from.into()).hull(Span::exact(to.unwrap_or(from).into()));
        let last = |ramp: Option<hpu_cosim::WordRamp>| ramp.map(|ramp| ramp.word(u64::MAX));
        let counts = 2f64.powi(words.config.position_width.cast_signed());
        Self {
            turn: format!("{counts} counts ({:.6} {unit})", counts * words.realised.count_rad),
            config: words.config,
            reference: Span::exact(words.reference.into()),
            stiffness: ramped(words.stiffness, last(words.schedule.stiffness)),
            damping: Span::exact(words.damping.into()),
            period: words.period,
            scale: ramped(words.scale, last(words.schedule.scale)),
        }
    }
}

/// Words by net, in any order; rows in that of the wiring.
pub(crate) struct Rows {
    pub symbols: Symbols,
    found: Vec<(&'static str, Word, Vec<String>)>,
}

impl Rows {
    /// The words that every loop begins with: settings, pins, counts, displacement.
    pub fn new(settings: &Settings, travel: &Travel) -> Self {
        let mut rows = Self { symbols: Symbols::default(), found: Vec::new() };
        let Settings { config, reference, stiffness, damping, period, scale, turn } = settings;
        let period = Span::exact((*period).into());
        for (name, span, frac) in [
            ("reference", *reference, 0),
            ("stiffness", *stiffness, config.stiffness.frac()),
            ("damping", *damping, config.damping.frac()),
            ("period", period, 0),
            ("scale", *scale, config.scale.frac()),
        ] {
            let word = rows.symbols.given(span, frac);
            rows.put(name, &word);
        }
        if travel.decoded {
            let (step, error) = (rows.symbols.given(Span::new(-1, 1), 0), rows.symbols.given(Span::exact(0), 0));
            rows.put("step", &step);
            rows.put("error", &error);
        }
        rows.front(config.position_width, travel, turn);
        rows
    }

    /// Position, displacement, contact and depth.
    fn front(&mut self, width: u32, travel: &Travel, turn: &str) {
        let (counter, signed) = (Format::unsigned(width), Format::signed(width));
        // Below the start the word turns over, as it may while the displacement reads through.
        let position = travel.counts.filter(|counts| counts.is_within(Span::of(counter)));
        let mut word = self.symbols.given(position.unwrap_or(Span::of(counter)), 0);
        word.fits = travel.delta.is_some();
        let why = (position.is_none() && word.fits)
            .then(|| format!("turns over every {turn}; the displacement reads through that"));
        self.found.extend(["position", "held"].map(|name| (name, word.clone(), why.iter().cloned().collect())));
        match travel.delta {
            Some(delta) => {
                let delta = self.symbols.given(delta, 0);
                self.put("delta", &delta);
            }
            None => {
                let delta = self.symbols.any(signed);
                let remark = format!("no limit of the travel is proved; it turns over every {turn}");
                self.put_with("delta", &delta, &remark);
            }
        }
        let delta = self.get("delta").clone();
        let contact = Span::new(i128::from(delta.span.min >= 0), i128::from(delta.span.max >= 0));
        let contact = self.symbols.given(contact, 0);
        self.put("contact", &contact);
        let depth = Span::new(delta.span.min.max(0), delta.span.max.max(0));
        let depth = Word { fits: delta.fits, ..self.symbols.given(depth, 0) };
        self.put("penetration", &depth);
    }

    pub fn put(&mut self, name: &'static str, word: &Word) {
        self.found.push((name, word.clone(), Vec::new()));
    }

    /// With a remark of its own.
    pub fn put_with(&mut self, name: &'static str, word: &Word, remark: &str) {
        self.found.push((name, word.clone(), vec![remark.to_string()]));
    }

    pub fn get(&self, name: &str) -> &Word {
        &self.found.iter().find(|(found, ..)| *found == name).expect("a net that comes before").1
    }

    /// One bound a net; of a net without a word its format.
    pub fn bounds(&self, nets: &[Signal], assumptions: &[String]) -> Vec<Bound> {
        let bound = |net: &Signal| {
            let found = self.found.iter().find(|(name, ..)| *name == net.name);
            match found {
                Some((_, word, remarks)) => {
                    let own: Vec<_> = remarks.iter().chain(assumptions).cloned().collect();
                    self.symbols.bound(net, word, &own)
                }
                None => {
                    let mut symbols = Symbols::default();
                    let bit = net.format == Format::BIT;
                    let all = symbols.given(Span::of(net.format), net.format.frac());
                    let remark = if bit { Vec::new() } else { vec!["no proof of this net: all its words".to_string()] };
                    Bound { never_overflows: bit, error: bit.then_some(0.0), ..symbols.bound(net, &all, &remark) }
                }
            }
        };
        nets.iter().map(bound).collect()
    }
}

/// The words of the hybrid or the conventional loop.
pub(crate) fn haptic(settings: &Settings, travel: &Travel) -> Rows {
    let mut rows = Rows::new(settings, travel);
    let Settings { config, stiffness, damping, period, scale, .. } = settings;
    let width = config.pwm.width;
    let overflow = if config.saturate { Overflow::Saturate } else { Overflow::Wrap };
    let depth = rows.get("penetration").clone();
    let symbols = &mut rows.symbols;

    let product = symbols.product(&depth, *stiffness, config.stiffness.frac());
    let spring = symbols.narrowed(&product, Format::unsigned(width), overflow);

    let difference = Format::signed(config.position_width);
    let moved = travel.moved(*period as f64);
    // Half the counter's range in a sample reads as motion the other way.
    let clear = travel.decoded && moved.is_within(Span::of(difference));
    let moved = if clear { symbols.given(moved, 0) } else { symbols.any(difference) };
    let (factor, frac) = if config.rescaled { (*scale, config.scale.frac()) } else { (Span::exact(1), 0) };
    let rescaled = symbols.product(&moved, factor, frac);
    let mut velocity = symbols.narrowed(&rescaled, Format::signed(config.velocity_width), Overflow::Saturate);
    velocity.fits &= clear;

    let product = symbols.product(&velocity, *damping, config.damping.frac());
    let drag = symbols.narrowed(&product, Format::signed(width + 1), overflow);

    let sum = symbols.sum(&spring, &drag);
    let torque = symbols.or_zero(&sum);
    let full = Span::new(1 - (1 << width), (1 << width) - 1);
    let command = symbols.clamped(&torque, full);
    for (name, word) in
        [("spring", &spring), ("velocity", &velocity), ("drag", &drag), ("torque", &torque), ("command", &command)]
    {
        rows.put(name, word);
    }
    rows
}
