//! `hpu widths --json`: its keys are a contract, and more may be added.

use hpu_signal::{Clock, Format};
use hpu_study::map::outcome_name;
use hpu_study::widths::tables::Tables;
use hpu_study::widths::{Field, Loss, SignalRow};
use serde_json::{Value, json};

use crate::widths::Page;
use crate::widths::proved::{Proved, how};
use crate::widths_price::Price;

/// Returns the page as one object. Ranges and worst cases are in the signal's unit; `words` has the measured range in
/// words.
pub fn object(page: &Page) -> Value {
    let measured = &page.measured;
    json!({
        "stiffness_missed": page.missed,
        "scenes": page.scenes,
        "wiring": measured.wiring,
        "edges": measured.edges,
        "motion_s": measured.motion_s,
        "random": page.random.map(|(seconds, seed)| json!({ "motion_s": seconds, "seed": seed })),
        "outcomes": measured.outcomes.iter().map(|kind| outcome_name(Some(*kind))).collect::<Vec<_>>(),
        "contact_shares": measured.contact_shares,
        "signals": measured.rows.iter().map(|row| signal(page, row)).collect::<Vec<_>>(),
        "widths": widths(page),
        "tables": page.tables.as_ref().map(tables),
        "price": page.price.as_ref().map(Price::json),
        "proved": page.proved.as_ref().ok().map(Proved::json),
        "not_proved": page.proved.as_ref().err(),
        "command": page.command,
        "files": page.files.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
    })
}

fn triple(format: Format) -> Value {
    json!([i32::from(format.is_signed()), format.int(), format.frac()])
}

fn signal(page: &Page, row: &SignalRow) -> Value {
    let bound = page.proved.as_ref().ok().and_then(|proved| proved.of(row.name));
    let first_s =
        |loss: &Loss| loss.first.zip(Clock::new(page.clock_hz).ok()).map(|(first, clock)| clock.seconds(first));
    let worst = |loss: &Loss| (loss.edges > 0 && !loss.worst.is_nan()).then_some(loss.worst);
    json!({
        "name": row.name,
        "format": triple(row.format),
        "unit": row.unit,
        "measured": row.measured.map(|(min, max)| [row.format.to_f64(min), row.format.to_f64(max)]),
        "words": row.measured.map(|(min, max)| [min, max]),
        "proved": bound.map(|bound| [bound.min, bound.max]),
        "how": bound.map(|bound| how(bound.how)),
        "never_overflows": bound.map(|bound| bound.never_overflows),
        "error": bound.and_then(|bound| bound.error),
        "assumptions": bound.map(|bound| &bound.assumptions),
        "idle_bits": row.headroom_bits,
        "rounded": row.rounded.edges,
        "rounded_worst": worst(&row.rounded),
        "rounded_first_s": first_s(&row.rounded),
        "overflowed": row.overflowed.edges,
        "overflowed_worst": worst(&row.overflowed),
        "overflowed_first_s": first_s(&row.overflowed),
        "sqnr_db": row.sqnr_db.filter(|db| db.is_finite()),
        "exact": row.sqnr_db.map(f64::is_infinite),
        "recommended": row.recommended.map(triple),
    })
}

fn tables(tables: &Tables) -> Value {
    let depths = tables.depths.iter().map(|depth| {
        json!({
            "bits": depth.width,
            "reach_deg": depth.reach_deg,
            "block_rams": depth.rams,
            "held_percent": depth.held_percent[0],
            "held_of_reached_percent": depth.held_percent[1],
        })
    });
    let sources = tables.sources.iter().map(|(sine, rams)| {
        json!({
            "source": sine.source.name(),
            "size": sine.size,
            "format": triple(sine.format),
            "rom_words": sine.rom.words,
            "rom_width_bits": sine.rom.width,
            "block_rams": rams,
            "worst": sine.worst,
            "worst_rad": sine.worst_rad,
            "how": "exhausted",
        })
    });
    json!({ "depth_bits": tables.depth_width, "depths": depths.collect::<Vec<_>>(), "sources": sources.collect::<Vec<_>>() })
}

fn one_more(page: &Page, field: Field) -> Value {
    let found = page.one_more.as_ref().ok().and_then(|all| all.iter().find(|(other, _)| *other == field));
    found.and_then(|(_, found)| found.as_ref().ok()).map_or(Value::Null, |[lut4, ff]| json!({ "lut4": lut4, "ff": ff }))
}

fn widths(page: &Page) -> Value {
    match &page.recommended {
        Err(why) => json!({ "not_tried": why }),
        Ok(found) => json!({
            "within": found.within,
            "outputs": found.outputs.iter().map(|output| output.name()).collect::<Vec<_>>(),
            "each": found.needed.iter().zip(&found.together).map(|(needed, together)| json!({
                "name": needed.field.name(),
                "signal": needed.field.shown_at(),
                "bits": needed.bits,
                "needs": needed.least,
                "error": needed.error,
                "one_bit_less": needed.breaks,
                "one_bit_more": one_more(page, needed.field),
                "together": together,
            })).collect::<Vec<_>>(),
            "error_together": found.error,
            "runs": found.runs,
        }),
    }
}
