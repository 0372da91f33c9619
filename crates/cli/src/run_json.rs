//! The summary of a run as JSON: a contract, to which keys may be added. Numbers are in SI units.

use hpu_cosim::{NetUse, Ready, Rig, Verdict};
use hpu_signal::Format;
use serde_json::{Value, json};

use crate::fit;
use crate::run::Ran;

/// The object that `hpu run --json` prints.
pub fn summary(ran: &Ran) -> Value {
    let summary = &ran.summary;
    let energy = &summary.energy;
    // The VHDL's time, when it ran.
    let wall_s = ran.rtl.as_ref().map_or(summary.wall_s, |(row, _)| row.seconds);
    json!({
        "scene": ran.session.name(),
        "driver": ran.driver,
        "solver": ran.solver,
        "fitted": ran.fitted.as_ref().map(fit::model),
        "outcome": summary.verdict.map(outcome),
        "complete": summary.complete,
        "aborted": summary.aborted.map(|abort| json!({ "at_s": abort.at_s, "why": abort.why })),
        "edges": summary.edges,
        "motion_s": summary.motion_s,
        "wall_s": wall_s,
        "edges_per_s": summary.edges as f64 / wall_s,
        "events": summary.events(),
        "activity": summary.activity(),
        "ticks": summary.ticks,
        "steps": summary.steps,
        "encoder_edges": summary.encoder_edges,
        "output_changes": summary.output_changes,
        // The name that this had first.
        "gate_changes": summary.output_changes,
        "mode_changes": summary.mode_changes,
        "decided_again": summary.redecided,
        "energy": {
            "supplied_j": energy.supplied_j,
            "stored_j": energy.stored_j,
            "dissipated_j": energy.dissipated_j,
            "residual_j": energy.residual_j,
            "exchanged_j": energy.exchanged_j,
            "source_j": energy.source_j,
            "hand_j": energy.hand_j,
            "copper_j": energy.copper_j,
            "diodes_j": energy.diodes_j,
            "viscous_j": energy.viscous_j,
            "coulomb_j": energy.coulomb_j,
            "transmission_j": energy.transmission_j,
        },
        "realised": realised(ran.session),
        "signals": summary.nets.iter().map(signal).collect::<Vec<_>>(),
        "expected": expected(ran),
        "expected_not_judged": ran.unjudged,
        "rtl": ran.rtl.as_ref().map(|(row, hdl)| {
            json!({ "edges": row.edges, "mismatches": row.mismatches, "hdl": hdl.to_string() })
        }),
        "files": ran.files,
    })
}

/// What the scene's words make of its values.
fn realised(session: &Ready) -> Value {
    match session {
        Ready::Axis(session) => {
            let realised = session.words().realised;
            json!({
                "torque_quantum_nm": realised.torque_quantum_nm,
                "count_rad": realised.count_rad,
                "wall_position_rad": realised.wall_position_rad,
                "stiffness_nm_per_rad": realised.stiffness_nm_per_rad,
                "damping_nm_s_per_rad": realised.damping_nm_s_per_rad,
                "sample_rate_hz": realised.sample_rate_hz,
            })
        }
        Ready::Phantom(session) => {
            let (scene, words) = (session.scene(), session.words());
            let formats = &scene.method.config.formats;
            json!({
                "wall_position_m": formats.position.to_f64(words.high),
                "stiffness_n_per_m": formats.stiffness.to_f64(words.stiffness),
                "sample_rate_hz": scene.clock.frequency_hz() as f64 / words.period as f64,
            })
        }
    }
}

fn outcome(verdict: Verdict) -> Value {
    match verdict {
        Verdict::Settled { rms_rad } => json!({ "kind": "settled", "rms_rad": rms_rad }),
        Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz } => json!({
            "kind": "limit_cycle",
            "rms_rad": rms_rad,
            "amplitude_rad": amplitude_rad,
            "frequency_hz": frequency_hz,
        }),
        Verdict::Diverged { at_s, amplitude_rad } => {
            json!({ "kind": "diverged", "at_s": at_s, "amplitude_rad": amplitude_rad })
        }
        Verdict::Passive { rms_m } => json!({ "kind": "passive", "rms_m": rms_m }),
        Verdict::NonPassive { rms_m } => json!({ "kind": "non_passive", "rms_m": rms_m }),
        Verdict::HighlyUnstable { at_s } => json!({ "kind": "highly_unstable", "at_s": at_s }),
    }
}

fn signal(NetUse { signal, usage }: &NetUse) -> Value {
    let format = signal.format;
    // A run that was stopped before its first edge has seen no word.
    let seen = |word| (usage.min <= usage.max).then(|| format.to_f64(word));
    json!({
        "name": signal.name,
        "format": triple(format),
        "unit": signal.unit,
        "min": seen(usage.min),
        "max": seen(usage.max),
        "rounded": usage.rounded,
        "overflowed": usage.overflowed,
    })
}

/// A format as `[s, i, f]`.
pub fn triple(format: Format) -> [i32; 3] {
    [i32::from(format.is_signed()), format.int(), format.frac()]
}

fn expected(ran: &Ran) -> Vec<Value> {
    let outcome = ran
        .outcome_met
        .map(|(kind, met)| json!({ "name": "outcome", "value": crate::run_text::outcome_name(kind), "met": met }));
    let numbers = ran.numbers.iter().map(|(expected, got, met)| {
        json!({
            "name": expected.metric.name(),
            "value": expected.value,
            "tolerance": expected.tolerance,
            "got": got,
            "met": met,
        })
    });
    outcome.into_iter().chain(numbers).collect()
}
