//! The page of a run: its summary, as text and as JSON. The keys of the JSON are a contract, and more may be added.
//! Numbers are in SI units.

use hpu_cosim::replay::Recording;
use hpu_cosim::scene::{Metric, Units, figure};
use hpu_cosim::{AnySimulation, Forever, InContact, Mark, NetUse, Quiet, SIGNS, Simulation, WiredSimulation};
use hpu_page::summary::outcome;
use hpu_page::trace_table::TraceColumns;
use hpu_page::{Cell, Column, Page, Table, heard};
use hpu_rtl::{CheckRow, Hdl, Mismatch};
use hpu_signal::{Clock, Cycle};
use hpu_study::map::outcome_name;
use hpu_study::widths::idle_bits;
use serde_json::{Value, json};

use crate::notation::triple;
use crate::run::device::{contact, shown};
use crate::run::simulate::Ran;
use crate::run::table;
use crate::shell::verdict;
use crate::units::{percent, si};
use crate::{fit, page as pages, parameters};

/// Returns the page.
pub fn page(ran: &Ran) -> Page {
    let (simulation, summary) = (ran.simulation, &ran.summary);
    let mut page = Page::default();
    let clock = si(simulation.clock().frequency_hz() as f64, "Hz");
    page.fact(
        "scene",
        "scene",
        simulation.name(),
        format!("{}, {} at {clock}", simulation.name(), simulation.closed_by()),
    );
    recording(&mut page, ran);
    page.data("driver", ran.driver).data("solver", ran.solver);
    page.data("fitted", ran.fitted.as_ref().map(|found| fit::model(found).json()));
    if let Some(found) = &ran.fitted {
        page.section("", fit::model(found));
    }
    let (said, kind) = match summary.verdict {
        Some(verdict) => {
            let scale = shown(simulation).told_in().map_or(1.0, |(_, scale)| scale);
            outcome(verdict.in_units(scale), position(ran), ran.window_s)
        }
        None if summary.heard.end.is_some() => {
            let [ran_s, asked_s] =
                [summary.edges, simulation.edges()].map(|edges| simulation.clock().seconds(Cycle(edges)));
            let said = format!("not judged: the design ended the run after {} of {}", si(ran_s, "s"), si(asked_s, "s"));
            (said, Value::Null)
        }
        None if summary.complete => ("a recording: no device, no motion to judge".to_string(), Value::Null),
        None => ("stopped before its end".to_string(), Value::Null),
    };
    page.fact("outcome", "outcome", kind, said + &summary.verdict.map_or(String::new(), |_| contact(ran).beside()));
    page.data("suspect", ran.suspect.map(|suspect| suspect.name));
    if let Some(suspect) = ran.suspect {
        page.line("design", suspect.said);
    }
    in_contact(&mut page, ran);
    recurrence(&mut page, ran);
    for_ever(&mut page, ran);
    page.data("complete", summary.complete);
    page.data("aborted", summary.aborted);
    if let Some(abort) = summary.aborted {
        page.line("aborted", format!("at {}: {}", si(abort.at_s, "s"), abort.why));
    }
    if let AnySimulation::Dut(_) = simulation {
        page.append(heard::heard(&summary.heard, simulation.clock()));
    }
    let device = shown(simulation);
    page.data("realised", device.realised()).data("dut", device.design());
    device.lines(&mut page, ran);
    energy(&mut page, ran);
    faults(&mut page, ran);
    work(&mut page, ran);
    page.table(nets(ran)).table(parameters::table(&ran.parameters));
    expectations(&mut page, ran);
    page.data("log", ran.log.as_ref().map(|held| held.page().json()));
    if let Some(held) = &ran.log {
        page.section("", held.page());
    }
    page.data("rtl", ran.rtl.as_ref().map(|(row, hdl)| of_rtl(row, hdl, simulation.clock())));
    if let Some((row, hdl)) = &ran.rtl {
        let mismatches = verdict(&format!("{} mismatches", row.mismatches), row.ok());
        page.line("rtl", format!("{} edges in GHDL, {mismatches}; VHDL {hdl}", row.edges));
        if let Some(first) = &row.first {
            let at = si(simulation.clock().seconds(Cycle(first.row)), "s");
            page.line("", format!("first difference at {at}; from there on `differs` is 1 in trace and waveform"));
            page.note(first.to_string());
        }
    }
    let held = ran.held.as_ref().map(|held| held.page(simulation.clock().period_s()));
    page.data("compared", held.as_ref().map(Page::json));
    if let Some(held) = held {
        page.section("", held);
    }
    page.data("trace", trace(ran));
    pages::files(&mut page, &ran.files);
    page
}

/// Adds what was read of the recording, if the scene names one.
fn recording(page: &mut Page, ran: &Ran) {
    let read = ran.recording.as_ref().map(|Recording { file, taken }| {
        let [from_s, to_s] = taken.span_s;
        json!({
            "file": file, "columns": taken.columns, "from_s": from_s, "to_s": to_s, "rows": taken.rows,
            "notes": taken.notes,
        })
    });
    page.data("recording", read);
    if let Some(Recording { file, taken }) = &ran.recording {
        let [from, to] = taken.span_s.map(figure);
        let columns = taken.columns.join(", ");
        page.line("recording", format!("{file}: {columns}; {from} s to {to} s; {} rows", taken.rows));
        for note in &taken.notes {
            page.line("recording", note);
        }
    }
}

/// Adds how long the wall was touched, and what it gave.
fn in_contact(page: &mut Page, ran: &Ran) {
    let contact = contact(ran);
    let displayed = contact.displayed();
    page.data("contact_share", ran.summary.contact_share);
    page.data("device_contact_share", ran.summary.device_contact_share).data("judged_window_s", ran.window_s);
    page.data("displayed_stiffness", displayed.map(|(_, displayed, _)| displayed));
    page.data("displayed_ratio", displayed.and_then(|(.., ratio)| ratio)).data("product_wraps", contact.wraps());
    let unseen = contact.unseen();
    page.data("unseen_contact", unseen.map(|told| json!({ "depth": told.depth, "position_wrapped": told.wrapped })));
    if let Some(said) = contact.line() {
        page.line("contact", said);
    }
    let (said, figures) = contact.unheld().unzip();
    page.data("position_wrapped", figures);
    if let Some(said) = said {
        page.line("position", said);
    }
    let is_lost = |net: &&NetUse| net.losses_seen && net.usage.overflowed > 0;
    if let (AnySimulation::Dut(_), Some(port)) = (ran.simulation, ran.summary.nets.iter().find(is_lost)) {
        let (name, bits) = (port.signal.name, port.signal.format.width());
        let share = percent(port.usage.overflowed, ran.summary.edges);
        let said = format!(
            "wraps: the count does not fit the {bits} bits of port {name} at {share} of the clock cycles; a design \
             that does not follow the wraps reads another place"
        );
        page.line("position", said);
    }
}

/// Adds the state that came back, if one did.
fn recurrence(page: &mut Page, ran: &Ran) {
    let clock = ran.simulation.clock();
    let found = ran.summary.recurrence.map(|found| {
        let [from, period] = [found.from, found.period].map(|edges| clock.seconds(Cycle(edges)));
        (from, period)
    });
    page.data("recurrence", found.map(|(from_s, period_s)| json!({ "from_s": from_s, "period_s": period_s })));
    if let Some((from_s, period_s)) = found {
        let (from, again, period) = (si(from_s, "s"), si(from_s + period_s, "s"), si(period_s, "s"));
        let said = format!("for ever, every {period}: the state at {again} is that at {from}, to the last bit");
        page.line("repeats", said);
    }
}

/// Adds how the run goes on for ever, if it was asked.
fn for_ever(page: &mut Page, ran: &Ran) {
    let Some(forever) = &ran.summary.forever else { return };
    let clock = ran.simulation.clock();
    let seconds = |edges: u64| clock.seconds(Cycle(edges));
    let settled = if ran.summary.is_settled_for_ever() { "settled for ever: " } else { "" };
    let (kind, said) = match forever {
        Ok(Forever::Quiet(quiet)) => {
            let from_s = seconds(quiet.from_edge);
            let at = si(from_s, "s");
            let said = if quiet.is_stuck {
                let spare = format!("{:.0}", 100.0 * quiet.margin);
                format!("from {at} on friction holds the shaft, with {spare} % of it to spare")
            } else {
                let (margin, ripple) = (format!("{:.3}", quiet.margin), format!("{:.1e}", quiet.ripple_counts));
                format!("no count arrives after {at}: the next is {margin} counts away, the ripple within ±{ripple}")
            };
            let kind = if quiet.is_stuck { "stuck" } else { "quiet" };
            let Quiet { margin, ripple_counts, .. } = quiet;
            (json!({ "kind": kind, "from_s": from_s, "margin": margin, "ripple_counts": ripple_counts }), said)
        }
        Ok(Forever::Recurs { recurrence, rms_counts, model_counts }) => {
            let [from_s, period_s] = [recurrence.from, recurrence.period].map(seconds);
            let [from, period] = [from_s, period_s].map(|time_s| si(time_s, "s"));
            let model = match model_counts {
                Ok(within) => format!("so does the motion of real numbers, within {within:.0e} counts"),
                Err(why) => format!("the motion of real numbers is not told: {why}"),
            };
            // Of a plant as a transfer function the words are proved to repeat, not the emulator's states.
            let is_of_words = matches!(ran.simulation, AnySimulation::Ours(WiredSimulation::Transfer(_)));
            let who = if is_of_words { "all words repeat" } else { "the emulator repeats" };
            let said = format!("from {from} on {who} every {period}, at {rms_counts:.3} counts rms; {model}");
            let told = json!({
                "kind": "repeats", "from_s": from_s, "period_s": period_s, "rms_counts": rms_counts,
                "model_counts": model_counts.ok(), "model_not_told": model_counts.err(),
            });
            (told, said)
        }
        Ok(Forever::Bounded { from_edge, ends: [least, greatest], off_counts }) => {
            let from_s = seconds(*from_edge);
            // As many places for both ends.
            let size = least.abs().max(greatest.abs());
            let [low, high] = [outward(*least, -1.0, 10, size), outward(*greatest, 1.0, 10, size)];
            let (at, off) = (si(from_s, "s"), outward(*off_counts, 1.0, 3, *off_counts));
            let said = format!(
                "bounded: from {at} on the output stays between {low} and {high}, and in the end within {off} counts \
                 of its rest"
            );
            let told = json!({
                "kind": "bounded", "from_s": from_s, "least": least, "greatest": greatest, "off_counts": off_counts,
            });
            (told, said)
        }
        Ok(Forever::InContact(found)) => keeps_contact(found, seconds),
        Ok(Forever::Grows { from_edge, growth }) => {
            let from_s = seconds(*from_edge);
            let (at, by) = (si(from_s, "s"), outward(*growth, -1.0, 6, *growth));
            let said = format!(
                "grows for ever: from {at} on no word of the DAC brings the plant back, which by itself grows {by} \
                 times a sample or more"
            );
            (json!({ "kind": "grows", "from_s": from_s, "growth": growth }), said)
        }
        Err(why) => (json!({ "kind": "not_told", "why": why }), format!("not told: {why}")),
    };
    page.data("for_ever", kind);
    page.line("for ever", format!("{settled}{said}"));
}

/// Returns what is told of a wall that keeps contact, as data and in words.
fn keeps_contact(found: &InContact, seconds: impl Fn(u64) -> f64) -> (Value, String) {
    let InContact { from_edge, edges, rms_counts, half_range_counts, long_run_counts } = *found;
    let [from_s, window_s] = [from_edge, edges].map(seconds);
    let [at, time] = [from_s, window_s].map(|time_s| si(time_s, "s"));
    let [rms, half] = [rms_counts, half_range_counts].map(|counts| outward(counts, 1.0, 3, counts));
    let is_settled = if rms_counts < 1.0 { ", as a settled wall has, for that time alone" } else { "" };
    let said = format!(
        "in contact: from its state at {at}: rms at most {rms} counts over the next {time}, at every phase\
         {is_settled}; it keeps contact for ever, within {half} counts of its rest"
    );
    let told = json!({
        "kind": "in_contact", "from_s": from_s, "window_s": window_s, "rms_counts": rms_counts,
        "half_range_counts": half_range_counts, "long_run_counts": long_run_counts,
    });
    (told, said)
}

/// Returns a number with so many digits of a size, rounded up for a sign of 1 and down for one of -1.
fn outward(value: f64, sign: f64, digits: i32, size: f64) -> String {
    let places = if size > 0.0 { (digits - 1 - libm::log10(size).floor() as i32).clamp(0, 300) } else { 0 };
    let step = 10f64.powi(-places);
    let text = |value: f64| format!("{value:.*}", places.unsigned_abs() as usize);
    let is_outside = |text: &String| text.parse::<f64>().is_ok_and(|read| sign * read >= sign * value);
    let all = [0.0, 1.0, 2.0].map(|steps| text(value + sign * steps * step));
    all.iter().find(|text| is_outside(text)).unwrap_or(&all[2]).clone()
}

/// Adds the energies.
fn energy(page: &mut Page, ran: &Ran) {
    let energy = &ran.summary.energy;
    let j = |value| si(value, "J");
    page.data("energy", energy);
    if energy.exchanged_j <= 0.0 {
        return;
    }
    let [supplied, source, hand] = [energy.supplied_j, energy.source_j, energy.hand_j].map(j);
    let [stored, dissipated, exchanged] = [energy.stored_j, energy.dissipated_j, energy.exchanged_j].map(j);
    let said =
        format!("supplied {supplied} (source {source}, hand {hand}) = stored {stored} + dissipated {dissipated}");
    page.line("energy", said);
    page.line("energy", format!("dissipated in {}", shown(ran.simulation).dissipated(energy)));
    let residual = energy.residual_j.abs() / energy.exchanged_j;
    page.line("energy", format!("residual {residual:.1e} of the {exchanged} exchanged"));
}

/// Adds the edges, events and steps, and the time that they took.
fn work(page: &mut Page, ran: &Ran) {
    let summary = &ran.summary;
    let (edges, ticks, wall_s) = (summary.edges, summary.ticks, summary.wall_s);
    let rate = edges as f64 / wall_s;
    let (motion, wall) = (si(summary.motion_s, "s"), si(wall_s, "s"));
    page.fact("edges", "edges", edges, format!("{edges} ({motion}) in {wall} by {}: {rate:.2e} edges/s", ran.driver));
    page.data("motion_s", summary.motion_s).data("wall_s", wall_s).data("edges_per_s", rate);
    page.data("events", summary.events()).data("activity", summary.activity()).data("ticks", ticks);
    page.data("steps", summary.steps);
    if summary.steps > 0 {
        let rate = summary.steps as f64 / wall_s;
        page.line("steps", format!("{} of {}: {rate:.2e} steps/s", summary.steps, ran.solver));
    }
    page.data("encoder_edges", summary.encoder_edges).data("output_changes", summary.output_changes);
    // `gate_changes` is the older name of this key.
    page.data("gate_changes", summary.output_changes).data("mode_changes", summary.mode_changes);
    page.data("decided_again", summary.redecided);
    if !summary.nets.is_empty() {
        page.line(
            "activity",
            format!(
                "{} of the edges: {ticks} ticks, {} encoder edges, {} output changes, {} mode changes; \
                 {} decided again",
                percent(ticks, edges),
                summary.encoder_edges,
                summary.output_changes,
                summary.mode_changes,
                summary.redecided
            ),
        );
    }
}

/// Adds the number of times that each fault has happened, and when it happened first.
fn faults(page: &mut Page, ran: &Ran) {
    let summary = &ran.summary;
    let seconds = |edge| ran.simulation.clock().seconds(Cycle(edge));
    let all =
        summary.faults.iter().map(|mark| json!({ "kind": mark.what, "edge": mark.edge, "at_s": seconds(mark.edge) }));
    page.data("faults", Value::Array(all.collect())).data("faults_waiting", summary.faults_waiting);
    for kind in Mark::KINDS {
        let mut of_kind = summary.faults.iter().filter(|mark| mark.what == kind);
        let Some(first) = of_kind.next() else { continue };
        let at = si(seconds(first.edge), "s");
        let said = match of_kind.count() {
            0 => format!("{kind} at {at}"),
            more => format!("{kind} {} times, first at {at}", more + 1),
        };
        page.line("fault", said);
    }
    if summary.faults_waiting > 0 {
        let said = "more waited for an edge of the encoder that did not come";
        page.line("fault", format!("{} {said}", summary.faults_waiting));
    }
}

/// Returns the datapath's words: their ranges, and the share of the edges at which they had lost bits. Text leaves out
/// single bits.
fn nets(ran: &Ran) -> Table {
    let edges = ran.summary.edges;
    // The losses inside a design of the user's own are unknown. The idle bits of its ports are known.
    let is_own = matches!(ran.simulation, AnySimulation::Dut(_));
    let losses = |column: Column| if is_own { column.data() } else { column };
    let idle = Column::integer("idle_bits", "idle bits");
    let seen = |net: &NetUse, word: i64| {
        // A run that was stopped before its first edge has no words.
        let value = (net.usage.min <= net.usage.max).then(|| net.signal.format.to_f64(word));
        Cell::new(value).shown(value.map_or("unknown".to_string(), |value| value.to_string()))
    };
    let lost = move |net: &NetUse, lost: u64| {
        let share = if net.losses_seen { percent(lost, edges) } else { "unknown".to_string() };
        Cell::new(net.losses_seen.then_some(lost)).shown(share)
    };
    let fields = [
        Column::text("", "").least(9).said().of(|_: &NetUse| "net"),
        Column::text("name", "net").least(11).of(|net: &NetUse| net.signal.name),
        Column::text("format", "format")
            .least(9)
            .of(|net: &NetUse| Cell::new(triple(net.signal.format)).shown(ran.notation.of(net.signal.format))),
        Column::number("min", "min").least(12).of(move |net: &NetUse| seen(net, net.usage.min)),
        Column::number("max", "max").least(11).of(move |net: &NetUse| seen(net, net.usage.max)),
        if is_own { idle } else { idle.data() }.of(|net: &NetUse| {
            let idle = idle_bits(net);
            Cell::new(idle).shown(idle.map_or("unknown".to_string(), |bits| bits.to_string()))
        }),
        losses(Column::integer("rounded", "rounded").least(10)).of(move |net: &NetUse| lost(net, net.usage.rounded)),
        losses(Column::integer("overflowed", "overflowed").least(10)).of(move |net: &NetUse| {
            let cell = lost(net, net.usage.overflowed);
            if net.usage.overflowed > 0 { cell.good(false) } else { cell }
        }),
        Column::text("unit", "unit").of(|net: &NetUse| {
            // The range is that of the unsigned word, which wraps where the device passes its starting position.
            let (unit, width) = (&net.signal.unit, net.signal.format.width());
            let is_counter = net.signal.is_counter();
            let modulo = if is_counter { format!(", modulo 2^{width}, as unsigned") } else { String::new() };
            Cell::new(*unit).shown(format!("{unit}{modulo}"))
        }),
    ];
    let nets = &ran.summary.nets;
    Table::of("signals", nets, fields).without(|net| edges == 0 || nets[net].signal.format.width() == 1)
}

/// Adds what the scene expects, and whether it came.
fn expectations(page: &mut Page, ran: &Ran) {
    page.data("expected", [(); 0]).data("expected_not_judged", ran.unjudged);
    let said = |met| verdict(if met { "met" } else { "NOT MET" }, met);
    if let Some((kind, met)) = ran.outcome_met {
        let name = outcome_name(Some(kind));
        let mut part = Page::default();
        part.data("name", "outcome").data("value", name).data("met", met);
        part.line("expected", format!("outcome {name}: {}{}", said(met), contact(ran).beside()));
        page.section("expected", part);
    }
    for (expected, got, met) in &ran.numbers {
        let (name, unit) = (expected.metric.name(), unit(ran, expected.metric));
        let [value, within] = [expected.value, expected.tolerance].map(|number| si(number, unit));
        let shown = got.map_or("nothing".to_string(), |got| si(got, unit));
        let mut part = Page::default();
        part.data("name", name).data("value", expected.value).data("tolerance", expected.tolerance);
        part.data("got", *got).data("met", *met);
        part.line("expected", format!("{name} {value} within {within}: {shown}, {}", said(*met)));
        page.section("expected", part);
    }
    if let Some(why) = ran.unjudged {
        page.line("expected", format!("not judged: {why}"));
    }
}

/// Returns the comparison with the VHDL as JSON.
fn of_rtl(row: &CheckRow, hdl: &Hdl, clock: Clock) -> Value {
    json!({
        "edges": row.edges,
        "mismatches": row.mismatches,
        "hdl": hdl.to_string(),
        "first_difference": row.first.as_ref().map(|first| first_difference(first, clock)),
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

/// Describes the columns of trace.csv and trace.parquet: names, units and meanings.
fn trace(ran: &Ran) -> Value {
    let nets = table(ran.simulation, ran.rtl.is_some() || ran.held.is_some());
    let shown = TraceColumns::new(ran.simulation, &nets, &[]);
    let columns: Vec<_> = shown.told().iter().map(|(name, doc)| json!({ "name": name, "doc": doc })).collect();
    json!({ "signs": SIGNS, "columns": columns })
}

/// Returns the unit of the device's positions.
fn position(ran: &Ran) -> &'static str {
    axis_units(ran).map_or("m", |units| units.position)
}

fn axis_units(ran: &Ran) -> Option<Units> {
    shown(ran.simulation).told_in().map(|(units, _)| units)
}

fn unit(ran: &Ran, metric: Metric) -> &'static str {
    match metric {
        Metric::FinalAngle | Metric::PeakAngle | Metric::PeakPenetration | Metric::Amplitude | Metric::Rms => {
            position(ran)
        }
        Metric::Frequency => "Hz",
        Metric::PeakTorque => axis_units(ran).map_or("N.m", |units| units.effort),
        Metric::SpringOverflowShare | Metric::EncoderEdges | Metric::ContactShare => "",
    }
}

#[cfg(test)]
mod tests {
    use super::outward;

    #[test]
    fn a_bound_is_written_outwards() {
        assert_eq!(outward(0.050_138_900_621, 1.0, 10, 0.05), "0.05013890063");
        assert_eq!(outward(0.050_138_900_621, -1.0, 10, 0.05), "0.05013890062");
        assert_eq!(outward(-6.912_84e-8, -1.0, 10, 0.05), "-0.00000006913");
        assert_eq!(outward(8.214_7, 1.0, 3, 8.2), "8.22");
        assert_eq!((outward(0.0, 1.0, 10, 0.0), outward(12_345.6, 1.0, 3, 12_345.6)), ("0".into(), "12346".into()));
    }
}
