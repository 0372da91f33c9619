//! The proved ranges of the words of EPFL's haptic paddle, for every motion of its encoder and all codes of its
//! converters.
//!
//! A filter's word stays between those of what it filters, and a controller's sum and command within their limits: one
//! step shows each.

use hpu_cosim::PaddleSimulation;
use hpu_cosim::scene::PaddleScene;
use hpu_datapath::paddle::{EpflPaddleLoop, FilteredPidConfig};
use hpu_datapath::{Instance, Wiring, flatten};
use hpu_signal::Span;

use crate::Error;
use crate::ranges::Proof;
use crate::ranges::affine::Affine;
use crate::ranges::haptic::NetRanges;
use crate::ranges::walk::Walk;

/// Proves the bounds of a scene.
///
/// # Errors
///
/// The reason why nothing can be proved: words that do not fit, or make no datapath.
pub fn proof(scene: &PaddleScene) -> Result<Proof, Error> {
    if scene.model.in_floats {
        return Err("the firmware in floats has no words; leave model.datapath out".into());
    }
    let simulation = PaddleSimulation::new(scene)?;
    let words = simulation.words();
    let wiring = EpflPaddleLoop::new(words.config)?;
    let (nets, instances) = (wiring.nets(), wiring.instances());
    let net = |name: &str| nets.iter().position(|net| net.name == name).expect("a net of the loop");
    let rows = Affine::on_a_sheet(|| {
        let mut walk = Walk { nets: vec![None; nets.len()], moved: &|_| None };
        for ((net, word), known) in nets.iter().zip(flatten(&simulation.input())).zip(&mut walk.nets) {
            let span = match net.name {
                "a_pin" | "b_pin" | "hall" | "code" | "target" => Span::of(net.format),
                // 0 until the target is asked for.
                "proportional" | "integral" | "derivative" => Span::new(0, word.into()),
                _ => Span::exact(word.into()),
            };
            *known = Some(Affine::given(span));
        }
        let [code, zero] = ["code", "zero"].map(|name| walk.nets[net(name)].expect("an input").known().span);
        let window = Span::exact(i128::from(words.config.window));
        walk.nets[net("sum")] = Some(Affine::given(code.times(window).plus(zero.times(Span::exact(-1)))));
        for instance in &instances {
            match instance.label {
                "haptic" => keep(&mut walk, instance, &words.config.haptic, (net("angle"), words.shares[0])),
                "current_control" => keep(&mut walk, instance, &words.config.current, (net("sum"), words.shares[1])),
                _ => walk.read(instance),
            }
        }
        NetRanges::known(&nets, &walk.nets, &[])
    });
    let clock = format!("a clock of {} Hz, words as the scene sets them", scene.clock.frequency_hz());
    let any = "any motion of the encoder, any code of a converter, any target".to_string();
    Ok(Proof { bounds: rows.bounds(&nets, &[clock, any]), ..Proof::default() })
}

/// Reads a controller that filters the words of a net with a share of 2^-16.
fn keep(walk: &mut Walk, instance: &Instance, config: &FilteredPidConfig, (measured, share): (usize, i64)) {
    let Some(word) = walk.nets[measured] else { return };
    let FilteredPidConfig { frac, gain, least, most, sum_limit, sum_frac, .. } = *config;
    let within = word.known().span.times(Span::exact(1 << frac)).hull(Span::exact(0));
    // A step is cut off, by less than a unit; the share of the way back makes up for it.
    let y = Span::new(within.min - 65_536 / i128::from(share) - 1, within.max);
    let limit = i128::from(sum_limit) << (frac + gain.frac().cast_unsigned() - sum_frac);
    let command = Span::new(least.into(), most.into()).hull(Span::exact(0));
    let registers = instance.model.equations().map(|edge| edge.registers).unwrap_or_default();
    let Some(shown) = registers.iter().find(|register| register.name == "command") else { return };
    walk.keep(instance, &[("y", y), ("sum", Span::new(-limit, limit)), ("command", command)], (shown, &[command]));
}
