//! Bounds that no posture can exceed: reads the equations of an arm's blocks to bound its words over the whole
//! workspace.
//!
//! The bounds cover every combination of counts that the tables hold, walls anywhere, and any stiffness up to a
//! greatest one. A range is that of the word's value. An error is the greatest distance to the same equations in real
//! numbers, on the same counts, with the lengths and gains of the words. The error of a force is counted from the tip
//! as the datapath sees it: stiffness times the error of the position, and the rounding. The errors of radial, upper,
//! fore, torques and commands are for the forces as words. Errors of products add up as if the worst of each could
//! occur together. So the figures are upper bounds, not estimates.

use hpu_datapath::ConfigError;
use hpu_signal::Format;

use crate::ranges::affine::Affine;
use crate::ranges::walk::Walk;
use crate::ranges::word::{Word, most, outward};
use hpu_datapath::phantom::{Config, wiring};
use hpu_signal::Span;

/// The proved range and error of one signal.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SignalBound {
    /// Name of the net or, for words such as `radial`, of the word inside a block.
    pub name: &'static str,
    /// Unit of all figures.
    pub unit: &'static str,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Greatest error; infinite after a word that may have wrapped.
    pub error: f64,
    /// The word's format.
    pub format: Format,
    /// Whether the format holds the whole range, so that nothing ever wraps. Forces and commands saturate by design:
    /// their range is the one after saturation.
    pub fits: bool,
}

impl SignalBound {
    fn of(name: &'static str, unit: &'static str, format: Format, word: Affine) -> Self {
        let Word { span, before, .. } = word.known();
        let (span, error) = before.unwrap_or_else(|| (span, word.error()));
        Self {
            name,
            unit,
            min: outward(span.min, format, f64::next_down),
            max: outward(span.max, format, f64::next_up),
            error: error.map_or(f64::INFINITY, |error| most(error, format)),
            format,
            fits: before.is_none(),
        }
    }
}

/// The nets of an arm's datapath from the sines on; each one depends only on those before it.
pub const SIGNALS: [&str; 20] = [
    "sine1",
    "cosine1",
    "sine2",
    "cosine2",
    "sine3",
    "cosine3",
    "radius",
    "x",
    "y",
    "z",
    "stiffness",
    "force_x",
    "force_y",
    "force_z",
    "torque1",
    "torque2",
    "torque3",
    "command1",
    "command2",
    "command3",
];
/// Returns the net that bears a signal: a command is read before its register, as the scaled torque.
fn net_of(signal: &str) -> &str {
    match signal {
        "command1" => "scaled1",
        "command2" => "scaled2",
        "command3" => "scaled3",
        other => other,
    }
}

/// The words inside the Jacobian, before the torques.
const INNER: [&str; 3] = ["radial", "upper", "fore"];

/// Returns the ranges and errors of every signal from the sines on, for any posture that the tables hold and any
/// stiffness up to `stiffness_max_n_per_m`.
///
/// # Errors
///
/// When a block refuses the configuration.
pub fn bounds(config: &Config, stiffness_max_n_per_m: f64) -> Result<Vec<SignalBound>, ConfigError> {
    let wiring = wiring(*config, false)?;
    let (nets, stiffness) = (wiring.nets(), config.formats.stiffness);
    let is_held = stiffness_max_n_per_m <= stiffness.max() as f64 * stiffness.lsb();
    let rows = Affine::on_a_sheet(|| {
        let mut walk = Walk { nets: vec![None; nets.len()], moved: &|_| None };
        let net = |name: &str| nets.iter().position(|net| net.name == name);
        for (index, net) in nets.iter().enumerate() {
            walk.nets[index] = match net.name {
                "count1" | "count2" | "count3" => Some(Affine::given(Span::of(Format::signed(config.depth_width)))),
                // A stiffness that has wrapped may be any word.
                "stiffness" if !is_held => Some(Affine::put(|symbols| symbols.wrapped(stiffness))),
                "stiffness" => {
                    let most = (stiffness_max_n_per_m / stiffness.lsb()).floor() as i128;
                    Some(Affine::given(Span::new(0, most)))
                }
                // Walls may be anywhere, or absent.
                "x_low" | "x_high" | "y_low" | "y_high" | "z_low" | "z_high" | "room" => {
                    Some(Affine::given(Span::of(net.format)))
                }
                _ => None,
            };
        }
        let mut rows = Vec::new();
        for instance in wiring.instances() {
            // The sines are those of the counts, as the tables load them.
            if instance.model.roms().is_empty() {
                walk.read(&instance)
            } else {
                walk.load(&instance)
            }
            for output in &instance.connections[instance.model.inputs().len()..] {
                let (Some(word), signal) = (walk.nets[output.net], &nets[output.net]) else { continue };
                let name = SIGNALS.into_iter().find(|told| net_of(told) == signal.name);
                rows.extend(name.map(|name| SignalBound::of(name, signal.unit, signal.format, word)));
                if signal.unit == "N" {
                    // From here on, errors are reported for the forces as words.
                    walk.nets[output.net] =
                        Some(word.with(|known, _| Word { exact: Some(known.form.clone()), ..known }));
                }
            }
        }
        let force = &nets[net("force_x").expect("a force")];
        for name in INNER {
            let (word, width) = Affine::named(name).expect("a word of the Jacobian");
            let frac = force.format.frac();
            let format = Format::new(true, width.cast_signed() - 1 - frac, frac).unwrap_or(force.format);
            rows.push(SignalBound::of(name, force.unit, format, word));
        }
        let signal = &nets[net("stiffness").expect("a stiffness")];
        let (min, max, error) = (0.0, stiffness_max_n_per_m, 0.0);
        rows.push(SignalBound {
            name: signal.name,
            unit: signal.unit,
            min,
            max,
            error,
            format: stiffness,
            fits: is_held,
        });
        rows
    });
    let row = |name: &str| *rows.iter().find(|row| row.name == name).expect("a net of the wiring");
    let (before, torques) = SIGNALS.split_at(SIGNALS.len() - 6);
    Ok([before, &INNER, torques].concat().into_iter().map(row).collect())
}
