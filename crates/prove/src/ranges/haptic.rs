//! The words of a loop, net by net, and those of an axis's loop.

use hpu_cosim::AxisLoop;
use hpu_signal::{Format, Signal};

use super::affine::Affine;
use super::travel::{Settings, Travel};
use super::walk::Walk;
use super::word::{Word, most, outward};
use super::{Bound, How, laws};
use hpu_signal::Span;

/// The range and error of one net.
#[derive(Clone, Debug)]
pub struct NetRange {
    name: &'static str,
    pub(crate) span: Span,
    error: Option<(Span, i32)>,
    /// Whether it holds every value that belongs in it.
    pub fits: bool,
    remarks: Vec<String>,
}

/// Rows in the order of the wiring's nets.
pub struct NetRanges(Vec<NetRange>);

impl NetRanges {
    /// Reads the words of a wiring's nets, block after block.
    pub(crate) fn of(settings: &Settings, travel: &Travel, wiring: &AxisLoop) -> Self {
        let (nets, instances) = (wiring.wiring().nets(), wiring.wiring().instances());
        Affine::on_a_sheet(|| {
            let moved = |clocks| travel.decoded.then(|| travel.moved(clocks));
            let mut walk = Walk { nets: vec![None; nets.len()], moved: &moved };
            let net = |name: &str| nets.iter().position(|net| net.name == name);
            for (name, word) in given(settings, travel) {
                net(name).into_iter().for_each(|net| walk.nets[net] = Some(word));
            }
            let mut remarks = Vec::new();
            for instance in &instances {
                let known = |name: &str| net(name).and_then(|net| walk.nets[net]).expect("a net that comes before");
                let stated = laws::stated(settings, travel, &walk, wiring, instance.label, &known);
                if stated.is_empty() {
                    walk.read(instance);
                }
                for (name, word, remark) in stated {
                    walk.nets[net(name).expect("a net of the law")] = Some(word);
                    remarks.extend(remark.map(|remark| (name, remark.to_string())));
                }
                // The depth fits only if the displacement that it is computed from does.
                if let [Some(delta), Some(depth)] = [net("delta"), net("penetration")].map(|net| walk.nets[net?]) {
                    let fits = delta.known().fits;
                    let depth = depth.with(|known, _| Word { fits: known.fits && fits, ..known });
                    walk.nets[net("penetration").expect("a net")] = Some(depth);
                }
            }
            let Settings { turn, .. } = settings;
            if travel.delta.is_none() {
                remarks.push(("delta", format!("no limit of the travel is proved; it turns over every {turn}")));
            }
            for (net, word) in nets.iter().zip(&walk.nets) {
                let Some(Word { span, turns, .. }) = word.map(Affine::known) else { continue };
                // Below the start the word wraps; it may, as long as the displacement is read correctly.
                let is_all = span == Span::of(net.format) && turns.is_some() && travel.delta.is_some();
                let through = || format!("turns over every {turn}; the displacement reads through that");
                remarks.extend(is_all.then(|| (net.name, through())));
            }
            Self::known(&nets, &walk.nets, &remarks)
        })
    }

    /// Returns the rows of the nets whose words are known, each with its remarks.
    pub fn known(nets: &[Signal], words: &[Option<Affine>], remarks: &[(&'static str, String)]) -> Self {
        let row = |(net, word): (&Signal, &Option<Affine>)| {
            let (word, name) = ((*word)?, net.name);
            let Word { span, fits, .. } = word.known();
            let remarks = remarks.iter().filter(|remark| remark.0 == name).map(|remark| remark.1.clone()).collect();
            Some(NetRange { name, span, error: word.error(), fits, remarks })
        };
        Self(nets.iter().zip(words).filter_map(row).collect())
    }

    pub(crate) fn get(&self, name: &str) -> &NetRange {
        self.0.iter().find(|row| row.name == name).expect("a net of the wiring")
    }

    /// Returns one bound a net; its format's range for a net about which nothing is known.
    pub fn bounds(&self, nets: &[Signal], assumptions: &[String]) -> Vec<Bound> {
        let bound = |net: &Signal| {
            let bit = net.format == Format::BIT;
            let remark = if bit { Vec::new() } else { vec!["no proof of this net: all its words".to_string()] };
            let unknown = NetRange {
                name: net.name,
                span: Span::of(net.format),
                error: bit.then_some((Span::exact(0), 0)),
                fits: bit,
                remarks: Vec::new(),
            };
            let found = self.0.iter().find(|row| row.name == net.name);
            let assumptions = found.map_or(remark, |row| row.remarks.iter().chain(assumptions).cloned().collect());
            let NetRange { span, error, fits, .. } = found.unwrap_or(&unknown);
            Bound {
                name: net.name,
                format: net.format,
                unit: net.unit,
                min: outward(span.min, net.format, f64::next_down),
                max: outward(span.max, net.format, f64::next_up),
                error: error.map(|error| most(error, net.format)),
                how: How::Proved,
                never_overflows: *fits,
                assumptions,
            }
        };
        nets.iter().map(bound).collect()
    }
}

/// Returns the words that every loop begins with: the settings, the decoder's outputs, and the position with its known
/// travel.
fn given(settings: &Settings, travel: &Travel) -> Vec<(&'static str, Affine)> {
    let Settings { config, reference, stiffness, damping, period, scale, .. } = settings;
    let spans = [
        ("reference", *reference),
        ("stiffness", *stiffness),
        ("damping", *damping),
        ("period", Span::exact((*period).into())),
        ("scale", *scale),
    ];
    let lines = [("step", Span::new(-1, 1)), ("error", Span::exact(0))];
    let lines = lines.into_iter().filter(|_| travel.decoded);
    let mut all: Vec<_> = spans.into_iter().chain(lines).map(|(name, span)| (name, Affine::given(span))).collect();
    let counter = Format::unsigned(config.position_width);
    let position = Affine::put(|symbols| {
        let span = travel.counts.filter(|counts| counts.is_within(Span::of(counter)));
        // Without a limit of the travel that keeps the displacement readable, the range lies far beyond any travel.
        let anywhere = Span::new(-1 << 100, 1 << 100);
        let counts = symbols.fresh(travel.counts.filter(|_| travel.delta.is_some()).unwrap_or(anywhere), 0);
        let turns = travel.decoded.then_some((config.position_width, counts));
        Word { turns, fits: travel.delta.is_some(), ..symbols.given(span.unwrap_or(Span::of(counter))) }
    });
    all.push(("position", position));
    all
}
