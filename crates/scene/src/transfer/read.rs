//! Reading a scene of a plant as a transfer function.

use hpu_plant::transfer::{Form, Transfer, TransferError};
use hpu_signal::Clock;
use toml_edit::{Array, Item};

use super::rows::{NUMBERS, ROOTS, ROWS};
use super::{Adc, DirectForm, MOST_COEFFICIENTS, TransferModel, TransferScene, WordRange, rows};
use crate::head::expect::{Expect, Metric, expect};
use crate::head::{Own, about, clock};
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity::{RATIO, Sense};
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};
use crate::text::message::number;

/// The head of a scene of a plant.
const OWN: Own = Own {
    kind: "transfer",
    plant_rate: &rows::record_transfer::plant_rate,
    expect: transfer_expect,
    outputs: &rows::accuracy_transfer::outputs,
};

/// The greatest number of clock edges from one sample to the next.
const MOST_PERIOD: f64 = (1u64 << 30) as f64;

pub(crate) fn scene(file: &str, source: &Source) -> Result<TransferScene, SceneError> {
    let root = Section::root(source);
    if root.has("dut") {
        let instead = "a plant as a transfer function is driven by [method] alone";
        return Err(root.unknown("dut", instead));
    }
    root.accept(&["transfer"])?;
    let about = about(&root)?;
    let clock = clock(&root.section("clock")?)?;
    let device = root.section("device")?;
    device.accept(&["transfer"])?;
    let form = form(&device)?;
    let adc = adc(&root.section("adc")?, clock)?;
    let (dac, late) = dac(&root.section("dac")?)?;
    let discrete = discrete(&device, &adc, clock)?;
    let plant =
        if discrete { Transfer::discrete(&form) } else { Transfer::continuous(&form, clock.period_s(), adc.period) };
    let plant = plant.map_err(|TransferError { part, reason }| device.error(part, reason))?;
    if plant.is_immediate() && late == 0 {
        let part = if device.has("a") {
            "d"
        } else if device.has("poles") {
            "zeros"
        } else {
            "numerator"
        };
        let reason = "the plant's input reaches its output at once, and the output reaches the input at once through \
                      both converters: an algebraic loop; write dac.late = 1 (a controller whose first coefficient \
                      is 0 then loses that one), or a plant whose numerator has the lower degree";
        return Err(device.error(part, reason));
    }
    let initial = numbers(&device, "initial", NUMBERS)?.unwrap_or_default();
    if initial.len() > plant.order() {
        let reason = format!("{} numbers, and the plant has {} states", initial.len(), plant.order());
        return Err(device.error("initial", reason));
    }
    let mut scene = TransferScene {
        discrete,
        initial,
        disturbance: device.read(&rows::transfer::disturbance)?,
        adc,
        dac,
        late,
        method: method(&root.section("method")?)?,
        reference: reference(&root.section("reference")?)?,
        model: {
            let model = root.section("model")?;
            model.accept(&["transfer"])?;
            TransferModel { solver: model.read(&rows::model_transfer::solver)? }
        },
        form,
        head: OWN.head(file, source, &root, (about, clock))?,
    };
    scene.parameters = source.parameters.take(&["about", "expect", "accuracy"]).into();
    scene.words()?;
    Ok(scene)
}

/// Reads the numbers of a list that was found under this name.
fn listed(s: &Section, name: &str, items: &Array, accepted: &str) -> Result<Vec<f64>, SceneError> {
    if items.is_empty() || items.len() > MOST_COEFFICIENTS {
        let reason = format!("{} of them; write {accepted} of 1 to {MOST_COEFFICIENTS}", items.len());
        return Err(s.error(name, reason));
    }
    let number = |(index, value): (usize, &toml_edit::Value)| {
        s.quantity_of(&format!("{name}[{index}]"), &Item::Value(value.clone()), &RATIO, Sense::Any, |_| None)
    };
    items.iter().enumerate().map(number).collect()
}

fn note(s: &Section, name: &str, text: String) {
    s.note(name, ParameterValue::Text(text), "", Origin::Scene);
}

fn told(all: &[f64]) -> String {
    format!("[{}]", all.iter().map(|&value| number(value)).collect::<Vec<_>>().join(", "))
}

/// Returns the list under a key, if it is there.
fn list<'a>(s: &Section<'a>, name: &str, accepted: &str) -> Result<Option<&'a Array>, SceneError> {
    let Some(item) = s.get(name) else { return Ok(None) };
    item.as_array().map(Some).ok_or_else(|| s.error(name, format!("not such a list; write {accepted}")))
}

fn numbers(s: &Section, name: &str, accepted: &str) -> Result<Option<Vec<f64>>, SceneError> {
    let Some(items) = list(s, name, accepted)? else { return Ok(None) };
    let all = listed(s, name, items, accepted)?;
    note(s, name, told(&all));
    Ok(Some(all))
}

fn roots(s: &Section, name: &str) -> Result<Option<Vec<[f64; 2]>>, SceneError> {
    let Some(items) = list(s, name, ROOTS)? else { return Ok(None) };
    if items.len() > MOST_COEFFICIENTS {
        return Err(s.error(name, format!("{} of them; write at most {MOST_COEFFICIENTS}", items.len())));
    }
    let mut all = Vec::new();
    for (index, value) in items.iter().enumerate() {
        let key = format!("{name}[{index}]");
        let root = match value.as_array() {
            None => [s.quantity_of(&key, &Item::Value(value.clone()), &RATIO, Sense::Any, |_| None)?, 0.0],
            Some(pair) => match listed(s, &key, pair, ROOTS)?[..] {
                [re, im] if im > 0.0 => [re, im],
                _ => return Err(s.error(&key, format!("not a root; write {ROOTS}"))),
            },
        };
        all.push(root);
    }
    let text: Vec<_> = all.iter().map(|root| if root[1] > 0.0 { told(root) } else { number(root[0]) }).collect();
    note(s, name, format!("[{}]", text.join(", ")));
    Ok(Some(all))
}

fn matrix(s: &Section, name: &str) -> Result<Vec<Vec<f64>>, SceneError> {
    let items = list(s, name, ROWS)?.ok_or_else(|| s.error(name, format!("missing; write {ROWS}")))?;
    if items.len() > MOST_COEFFICIENTS {
        return Err(s.error(name, format!("{} rows; write at most {MOST_COEFFICIENTS}", items.len())));
    }
    let mut all = Vec::new();
    for (index, value) in items.iter().enumerate() {
        let key = format!("{name}[{index}]");
        let row = value.as_array().ok_or_else(|| s.error(&key, format!("not a row; write {ROWS}")))?;
        all.push(listed(s, &key, row, ROWS)?);
    }
    note(s, name, format!("[{}]", all.iter().map(|row| told(row)).collect::<Vec<_>>().join(", ")));
    Ok(all)
}

/// The three ways to write a plant, each with its keys.
const WAYS: [&[&str]; 3] = [&["numerator", "denominator"], &["zeros", "poles", "gain"], &["a", "b", "c", "d"]];

fn form(s: &Section) -> Result<Form, SceneError> {
    use rows::transfer as key;
    let ways = "write numerator and denominator; or poles, with zeros and gain; or a, b, c and d";
    let has = |keys: &[&str]| keys.iter().any(|key| s.has(key));
    let begun: Vec<&[&str]> = WAYS.into_iter().filter(|keys| has(keys)).collect();
    let [keys] = begun[..] else {
        return Err(match begun[..] {
            [] => s.error("numerator", format!("missing; {ways}")),
            [_, second, ..] => {
                let extra = second.iter().find(|key| s.has(key)).copied().unwrap_or_default();
                s.key_error(extra, format!("a second way to write the plant; {ways}"))
            }
            [_] => unreachable!("one way was matched"),
        });
    };
    let needed =
        |name: &str| numbers(s, name, NUMBERS)?.ok_or_else(|| s.error(name, format!("missing; write {NUMBERS}")));
    match keys[0] {
        "numerator" => Ok(Form::Ratio { numerator: needed("numerator")?, denominator: needed("denominator")? }),
        "zeros" => {
            let poles = roots(s, "poles")?.ok_or_else(|| s.error("poles", format!("missing; write {ROOTS}")))?;
            let zeros = roots(s, "zeros")?.unwrap_or_default();
            let is_discrete = s.has("sample_time");
            let grows = |[re, im]: &[f64; 2]| if is_discrete { re * re + im * im >= 1.0 } else { *re >= 0.0 };
            if let Some(index) = zeros.iter().position(|zero| grows(zero) && poles.contains(zero)) {
                let reason = "it cancels a pole that does not decay, so the output would hide a state that grows; \
                              leave both out";
                return Err(s.error(&format!("zeros[{index}]"), reason));
            }
            Ok(Form::Roots { zeros, poles, gain: s.read(&key::gain)? })
        }
        _ => Ok(Form::Matrices { a: matrix(s, "a")?, b: needed("b")?, c: needed("c")?, d: s.read(&key::d)? }),
    }
}

fn range(s: &Section, bits: u32, full: f64, signed: bool) -> Result<WordRange, SceneError> {
    let range = WordRange { bits, signed, full };
    if range.lsb() < 1e-15 {
        let reason = format!("a step of {} is too small; write fewer bits or a greater range", number(range.lsb()));
        return Err(s.error("bits", reason));
    }
    Ok(range)
}

fn adc(s: &Section, clock: Clock) -> Result<Adc, SceneError> {
    use rows::adc as key;
    s.accept(&[])?;
    let (rate_hz, clock_hz) = (s.read(&key::rate)?, clock.frequency_hz() as f64);
    let edges = clock_hz / rate_hz;
    let refused = |reason: String| Err(s.error("rate", reason));
    if edges < 1.0 - 1e-12 {
        return refused(format!("{} Hz is faster than the clock; write at most {clock_hz} Hz", number(rate_hz)));
    }
    if edges > MOST_PERIOD {
        return refused(format!(
            "a sample every {edges:.3e} clock cycles; write at most 2^30 of them, at least {} Hz",
            number(clock_hz / MOST_PERIOD)
        ));
    }
    let period = edges.round();
    if (edges - period).abs() > 1e-12 * period {
        let [near, slow] = [period.max(1.0), period + 1.0].map(|period| number(clock_hz / period));
        return refused(format!(
            "a sample every {} clock cycles is not a whole number of them; write {near} Hz or {slow} Hz, say",
            number(edges)
        ));
    }
    let range = range(s, s.read(&key::bits)?, s.read(&key::range)?, s.read(&key::signed)?)?;
    Ok(Adc { range, offset: s.read(&key::offset)?, floors: s.read(&key::rounding)?, period: period as u64 })
}

fn dac(s: &Section) -> Result<(WordRange, u32), SceneError> {
    use rows::dac as key;
    s.accept(&[])?;
    let range = range(s, s.read(&key::bits)?, s.read(&key::full_scale)?, s.read(&key::signed)?)?;
    Ok((range, s.read(&key::late)?))
}

/// Returns whether the plant is discrete. Its sample time is the ADC's.
fn discrete(s: &Section, adc: &Adc, clock: Clock) -> Result<bool, SceneError> {
    let Some(sample_s) = s.given(&rows::transfer::sample_time)? else { return Ok(false) };
    let period_s = adc.period as f64 * clock.period_s();
    if (sample_s - period_s).abs() > 1e-12 * period_s {
        let reason = format!(
            "{} s, and adc.rate takes a sample every {} s; write the same in both, because a discrete plant changes \
             once a sample",
            number(sample_s),
            number(period_s)
        );
        return Err(s.error("sample_time", reason));
    }
    Ok(true)
}

fn method(s: &Section) -> Result<DirectForm, SceneError> {
    use rows::method_transfer as key;
    s.accept(&["transfer"])?;
    let numerator = numbers(s, "numerator", NUMBERS)?;
    let numerator = numerator.ok_or_else(|| s.error("numerator", format!("missing; write {NUMBERS}")))?;
    let denominator = numbers(s, "denominator", NUMBERS)?.unwrap_or(vec![1.0]);
    if denominator[0] == 0.0 {
        let reason = "0, and the controller divides by it; leave zeros in front out";
        return Err(s.error("denominator[0]", reason));
    }
    let coefficient = [s.read(&key::coefficient_bits)?, s.read(&key::coefficient_fraction)?];
    let (fraction, floors) = (s.read(&key::fraction)?, s.read(&key::rounding)?);
    Ok(DirectForm { numerator, denominator, coefficient, fraction, floors })
}

fn reference(s: &Section) -> Result<[f64; 2], SceneError> {
    use rows::reference as key;
    s.accept(&[])?;
    let from_s = s.read(&key::from)?;
    Ok([s.read(&key::value)?, from_s])
}

fn transfer_expect(s: &Section) -> Result<Expect, SceneError> {
    use rows::expect_transfer as key;
    s.accept(&["transfer"])?;
    let metrics = [
        (Metric::FinalAngle, &key::final_angle),
        (Metric::PeakAngle, &key::peak_angle),
        (Metric::Amplitude, &key::amplitude),
        (Metric::Frequency, &key::frequency),
    ];
    expect(s, &metrics, &key::outcome)
}
