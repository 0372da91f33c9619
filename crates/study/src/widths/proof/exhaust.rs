//! Every input tried: the combinational blocks whose inputs, within what is proved of them, are few.

use hpu_cosim::scene::Scene;
use hpu_cosim::{Session, Visit, Wired, World};
use hpu_datapath::{Generic, Instance, Wiring};
use hpu_signal::Format;

use super::span::Span;
use super::{Bound, How, Proof};

/// The most inputs that are ever tried of one block.
pub const MOST_INPUTS: u128 = 1 << 26;

/// The nets of a scene that combinational blocks with at most `most` inputs drive, and at most [`MOST_INPUTS`], with
/// the range and, of products, the error that trying them all has shown. Inputs go through what `proof` leaves of them,
/// each by itself.
///
/// # Errors
///
/// When the scene makes no datapath.
pub fn exhausted(scene: &Scene, proof: &Proof, most: u128) -> Result<Vec<Bound>, String> {
    let session = Session::new(scene).map_err(|error| error.to_string())?;
    Ok(session.visit(Exhaust { proof, most: most.min(MOST_INPUTS) }))
}

struct Exhaust<'a> {
    proof: &'a Proof,
    most: u128,
}

impl<'s> Visit<'s> for Exhaust<'_> {
    type Out = Vec<Bound>;
    fn visit<E, W>(self, wiring: &W, _: E, _: E::In) -> Vec<Bound>
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let instances = wiring.instances().into_iter().filter(answers_at_once);
        instances.flat_map(|instance| tried(instance, &self.proof.bounds, self.most)).collect()
    }
}

/// Whether a block has no registers: none by its kind, or, of a limiter, none in this configuration.
fn answers_at_once(instance: &Instance) -> bool {
    let settles = ("SETTLING", Generic::Integer(0));
    !instance.model.clocked() || instance.model.generics().contains(&settles)
}

/// The words that a bound allows.
fn words(bound: &Bound) -> Span {
    let word = |value: f64| (value / bound.format.lsb()) as i128;
    Span::new(word(bound.min), word(bound.max))
}

/// The outputs of one block for all its inputs; none when these are too many.
fn tried(mut instance: Instance, bounds: &[Bound], most: u128) -> Vec<Bound> {
    let count = instance.model.inputs().len();
    let (inputs, outputs) = instance.connections.split_at(count);
    let ranges: Vec<Span> = inputs.iter().map(|input| words(&bounds[input.net])).collect();
    let size = |range: &Span| (range.max - range.min + 1).unsigned_abs();
    if ranges.iter().map(size).try_fold(1u128, u128::checked_mul).is_none_or(|all| all > most) {
        return Vec::new();
    }
    let product = Product::of(&instance);
    let mut word: Vec<i64> = ranges.iter().map(|range| range.min as i64).collect();
    let mut seen: Vec<Option<(i64, i64)>> = vec![None; outputs.len()];
    let mut worst = Worst::default();
    loop {
        let answer = instance.model.tick(&word);
        for (seen, &out) in seen.iter_mut().zip(&answer) {
            *seen = Some(seen.map_or((out, out), |(least, most)| (least.min(out), most.max(out))));
        }
        if let Some(product) = &product {
            worst.take(product, word[0], word[1], answer[0]);
        }
        // The next input, the last one fastest.
        let Some(at) = (0..count).rev().find(|&at| i128::from(word[at]) < ranges[at].max) else { break };
        word[at] += 1;
        for later in at + 1..count {
            word[later] = ranges[later].min as i64;
        }
    }
    let row = |(output, seen): (&hpu_datapath::Connection, Option<(i64, i64)>)| {
        let (proved, format) = (&bounds[output.net], output.port.format);
        let (least, most) = seen?;
        // Inputs go together in ways that the block by itself does not know.
        let (min, max) = (format.to_f64(least).max(proved.min), format.to_f64(most).min(proved.max));
        let mut bound = Bound { how: How::Exhausted, min, max, ..proved.clone() };
        if product.is_some() && inputs.iter().all(|input| bounds[input.net].error == Some(0.0)) {
            bound.error = (!worst.wrapped).then_some(worst.error as f64 * worst.lsb);
            bound.never_overflows = !worst.overflowed;
        }
        Some(bound)
    };
    outputs.iter().zip(seen).filter_map(row).collect()
}

/// What a multiplier is to give.
struct Product {
    out: Format,
    drop: u32,
    saturate: bool,
    factors: [Format; 2],
}

impl Product {
    /// Of a multiplier; none of another block.
    fn of(instance: &Instance) -> Option<Self> {
        let generics = instance.model.generics();
        let of = |name: &str| generics.iter().find(|generic| generic.0 == name).map(|generic| generic.1);
        let (Some(Generic::Integer(drop)), Some(Generic::Boolean(saturate))) = (of("DROP_LOWER"), of("SATURATE"))
        else {
            return None;
        };
        let inputs = instance.model.inputs();
        let out = instance.model.outputs()[0].format;
        Some(Self { out, drop: drop as u32, saturate, factors: [inputs[0].format, inputs[1].format] })
    }
}

/// The worst of all products.
#[derive(Default)]
struct Worst {
    /// In units of the product's last bit, `lsb`.
    error: i128,
    lsb: f64,
    overflowed: bool,
    wrapped: bool,
}

impl Worst {
    fn take(&mut self, product: &Product, a: i64, b: i64, out: i64) {
        let Product { out: format, drop, saturate, factors } = product;
        let exact = factors[0].value(a) * factors[1].value(b);
        self.lsb = format.lsb() * 2f64.powi(-drop.cast_signed());
        let fits = format.holds(exact >> drop);
        self.overflowed |= !fits;
        self.wrapped |= !fits && !saturate;
        let limited = exact.clamp(format.min() << drop, format.max() << drop);
        // A clamp is the law's, too; a value between the last word and the limit is rounded.
        let target = if fits { exact } else { limited };
        self.error = self.error.max(((format.value(out) << drop) - target).abs());
    }
}
