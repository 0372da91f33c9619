//! The summary of a run as JSON. Its keys are a contract, and more may be added. Numbers are in SI units.

use hpu_cosim::dut::Wire;
use hpu_cosim::{AnyRig, NetUse, Ready, Rig, SIGNS, Verdict, unseen_growth_per_s};
use hpu_rtl::Mismatch;
use hpu_signal::{Clock, Cycle};
use hpu_study::widths::idle_bits;
use serde_json::{Value, json};

use crate::notation::triple;
use crate::run::nets::Held;
use crate::run::text::{displayed, unseen, wraps};
use crate::run::{Ran, rows};
use crate::{fit, parameters, run};

/// Returns the object that `hpu run --json` prints.
pub fn summary(ran: &Ran) -> Value {
    let summary = &ran.summary;
    let energy = &summary.energy;
    let wall_s = summary.wall_s;
    json!({
        "scene": ran.session.name(),
        "driver": ran.driver,
        "solver": ran.solver,
        "fitted": ran.fitted.as_ref().map(fit::model),
        "outcome": summary.verdict.map(|verdict| outcome(verdict, ran.window_s)),
        "contact_share": summary.contact_share,
        "judged_window_s": ran.window_s,
        "displayed_stiffness": displayed(ran).map(|(_, _, displayed, _)| displayed),
        "displayed_ratio": displayed(ran).and_then(|(.., ratio)| ratio),
        "product_wraps": wraps(ran),
        "unseen_contact": unseen(ran).map(|(_, unseen)| {
            json!({ "depth": unseen.depth, "position_wrapped": unseen.wrapped })
        }),
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
        // `gate_changes` is the older name of this key.
        "gate_changes": summary.output_changes,
        "mode_changes": summary.mode_changes,
        "decided_again": summary.redecided,
        "faults_waiting": summary.faults_waiting,
        "faults": summary.faults.iter().map(|mark| {
            json!({ "kind": mark.what, "edge": mark.edge, "at_s": ran.session.clock().seconds(Cycle(mark.edge)) })
        }).collect::<Vec<_>>(),
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
        "parameters": parameters::object(&ran.parameters),
        "realised": realised(ran.session),
        "signals": summary.nets.iter().map(signal).collect::<Vec<_>>(),
        "expected": expected(ran),
        "expected_not_judged": ran.unjudged,
        "rtl": ran.rtl.as_ref().map(|(row, hdl)| {
            json!({
                "edges": row.edges,
                "mismatches": row.mismatches,
                "hdl": hdl.to_string(),
                "first_difference": row.first.as_ref().map(|first| first_difference(first, ran.session.clock())),
            })
        }),
        "dut": dut(ran.session),
        "compared": ran.held.as_ref().map(Held::object),
        "trace": trace(ran),
        "files": ran.files,
    })
}

/// Returns where the VHDL first differed from the emulator: `expected` is the emulator's word, `got` the VHDL's.
fn first_difference(first: &Mismatch, clock: Clock) -> Value {
    let (columns, history) = first.around.table(first.row);
    json!({
        "edge": first.row,
        "time_s": clock.seconds(Cycle(first.row)),
        "signal": first.signal,
        "expected": first.expected,
        "got": first.got,
        "columns": columns,
        "history": history,
    })
}

/// Describes a design of the user's own: its simulator, and the connections of its ports.
fn dut(session: &AnyRig) -> Option<Value> {
    let AnyRig::Dut(session) = session else { return None };
    let wire = |Wire { port, connection }: &Wire| {
        json!({
            "port": port.name,
            "direction": if port.is_input { "in" } else { "out" },
            "bits": port.format.width(),
            "connection": connection.name(),
        })
    };
    Some(json!({
        "top": session.scene().dut.top,
        "engine": session.engine(),
        "ports": session.wires().iter().map(wire).collect::<Vec<_>>(),
    }))
}

/// Describes the columns of trace.csv and trace.parquet: names, units and meanings.
fn trace(ran: &Ran) -> Value {
    let columns = rows::columns(ran.session, &run::table(ran.session, ran.rtl.is_some() || ran.held.is_some()));
    let columns: Vec<_> = columns.iter().map(|(name, doc)| json!({ "name": name, "doc": doc })).collect();
    json!({ "signs": SIGNS, "columns": columns })
}

/// Returns the parameters as the scene's words realise them.
fn realised(session: &AnyRig) -> Value {
    match session {
        AnyRig::Ours(Ready::Axis(session)) => {
            let realised = session.words().realised;
            json!({
                "torque_quantum_nm": realised.torque_quantum_nm,
                "count_rad": realised.count_rad,
                "wall_position_rad": realised.wall_position_rad,
                "stiffness_nm_per_rad": realised.stiffness_nm_per_rad,
                "stiffness_error": realised.stiffness_error,
                "stiffness_missed": realised.stiffness_miss.as_ref().map(parameters::missed_object),
                "damping_nm_s_per_rad": realised.damping_nm_s_per_rad,
                "sample_rate_hz": realised.sample_rate_hz,
            })
        }
        AnyRig::Ours(Ready::Phantom(session)) => {
            let (scene, words) = (session.scene(), session.words());
            let formats = &scene.method.config.formats;
            json!({
                "wall_position_m": formats.position.to_f64(words.high),
                "stiffness_n_per_m": formats.stiffness.to_f64(words.stiffness),
                "stiffness_missed": words.stiffness_miss.as_ref().map(parameters::missed_object),
                "sample_rate_hz": scene.clock.frequency_hz() as f64 / words.period as f64,
                "count_rad": session.count_rad(),
                "torque_quantum_nm": session.commands().iter().map(|command| command.2).collect::<Vec<_>>(),
                "apparent_mass_kg": session.apparent_kg(),
            })
        }
        AnyRig::Dut(session) => json!({ "count_rad": session.scene().encoder.count_rad() }),
    }
}

fn outcome(verdict: Verdict, [from_s, to_s]: [f64; 2]) -> Value {
    match verdict {
        Verdict::Settled { rms_rad } => json!({
            "kind": "settled",
            "rms_rad": rms_rad,
            "growth_unseen_below_per_s": unseen_growth_per_s(to_s - from_s),
        }),
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

fn signal(net @ NetUse { signal, usage, losses_seen }: &NetUse) -> Value {
    let format = signal.format;
    // A run that was stopped before its first edge has no words.
    let seen = |word| (usage.min <= usage.max).then(|| format.to_f64(word));
    json!({
        "name": signal.name,
        "format": triple(format),
        "unit": signal.unit,
        "min": seen(usage.min),
        "max": seen(usage.max),
        "idle_bits": idle_bits(net),
        "rounded": losses_seen.then_some(usage.rounded),
        "overflowed": losses_seen.then_some(usage.overflowed),
    })
}

fn expected(ran: &Ran) -> Vec<Value> {
    let outcome = ran
        .outcome_met
        .map(|(kind, met)| json!({ "name": "outcome", "value": crate::run::text::outcome_name(kind), "met": met }));
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
