#!/usr/bin/env python3
"""Mutants of the engine's searches, chosen by hand: one error each, held against the tests.

The errors are in the searches that let the driver `events` leap: a bound halved, a comparison relaxed, an order not
looked at, a period too many. All mutants are built at once, each behind a test of the variable HPU_MUTANT. The tests of
STAGES then run once for each mutant, until one fails. A mutant that fails no test survives, unless it has a reason why
it changes no result: then it is equivalent. A mutant with such a reason that a test kills is an error of the list.

A run that was stopped goes on where it was; what is known is in results.json in the target folder.

Usage: testbench/mutants_engine.py [--only WORD] [--jobs J] [--update]
  --only WORD  mutants whose file or description contains the word; may be repeated
  --jobs J     mutants tested at a time [1]
  --update     write testbench/record/mutants-engine.txt; with --only, the verdicts of other mutants stay on record
Exit codes: 0 each mutant is killed or equivalent, 1 one survives or is wrongly called equivalent, 2 wrong usage,
3 the mutants do not build or the tests fail without a mutant.
"""

import argparse
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "testbench" / "record" / "mutants-engine.txt"
GUARD = "crates/plant/src/flow/guard.rs"
DEVICE = "crates/plant/src/device/mod.rs"
KNOWN = "crates/plant/src/device/known.rs"
MODES = "crates/plant/src/device/modes.rs"
REVERSAL = "crates/plant/src/flow/reversal.rs"
CRUISE = "crates/plant/src/device/cruise.rs"
WORLD = "crates/cosim/src/world/axis_world.rs"
ENGINE = "crates/cosim/src/run/engine/mod.rs"
RECURRENCE = "crates/cosim/src/run/engine/recurrence.rs"
ROWS = "crates/cosim/src/run/engine/rows.rs"
CIRCUIT = "crates/datapath/src/circuit/circuit_loop.rs"
NET_ENDS = "crates/plant/src/network/ends.rs"
NET_MOTION = "crates/plant/src/network/motion.rs"
NET_ENERGY = "crates/plant/src/network/energy.rs"
LASTING = "crates/prove/src/lasting.rs"
FOREVER = "crates/cosim/src/run/engine/forever.rs"

# Test binaries, filters, and seconds of processor time after which a mutant counts as endless, a multiple of what the
# tests take; in the order in which they are asked: those that cost least first.
QUICK = ["between_rows::", "bounded::", "contact::", "known_answers::", "law_scenes::", "less_model::", "networks::",
         "rail::", "recurrence::", "waiting_rows::"]
LEAPS = ["cruise::so_", "cruise::a_run", "drivers::they_agree", "drivers::watching", "faults::"]
WHOLE = ["cruise::every_register", "drivers::leaping", "drivers::a_hundred", "energy::"]
STAGES = [
    ("hpu-plant", "lib", ["guard::", "device::"], 30),
    ("hpu-plant", "all", ["--skip", "arm_", "--skip", "shaper::", "--skip", "stepper::"], 20),
    ("hpu-datapath", "all", ["recurrence::", "repeats::"], 30),
    ("hpu-prove", "all", ["lasting::"], 30),
    ("hpu-cosim", "all", QUICK, 60),
    ("hpu-cosim", "high_precision", ["--skip", "twice_the_places"], 100),
    ("hpu-cosim", "all", LEAPS, 100),
    ("hpu-cosim", "all", WHOLE, 200),
]
# A module of tests that the test binary of a package alone has; those of hpu-cosim have neither.
MODULES = {"hpu-plant": "decisions::", "hpu-datapath": "shift_and_add::", "hpu-prove": "lasting::"}
# Stages for mutants that are equivalent by a reason.
FEW = 2

# The function that a mutant asks, in hpu-signal.
SWITCH = """
/// Returns whether this mutant was chosen.
#[inline]
pub fn mutant(number: u32) -> bool {
    use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
    static CHOSEN: AtomicU32 = AtomicU32::new(u32::MAX);
    #[cold]
    fn read() -> u32 {
        let chosen = std::env::var("HPU_MUTANT").map_or(0, |text| text.parse().expect("a number"));
        CHOSEN.store(chosen, Relaxed);
        chosen
    }
    let chosen = CHOSEN.load(Relaxed);
    number == if chosen == u32::MAX { read() } else { chosen }
}
"""

SPEED = "a longer or shorter look: "
ABOVE = (
    "the start is inside and the parabola's end is inside by a noise; a parabola that bends toward the limit lies "
    "above its chord, so each edge between them is inside"
)
ONCE = (
    "each edge is decided exactly, and a function that bends one way only passes a limit once between an edge inside "
    "and an edge outside"
)
# File, the text behind which the place is, the place, and its mutants: what is wrong, what is put, and for equivalent
# ones the reason. A place is an expression, or a statement with its semicolon.
PLACES = [
    # stays
    (GUARD, "fn stays(", "dyadic(edges)", [
        ("stays: derivatives bounded over half of the length", "dyadic(edges / 2)"),
    ]),
    (GUARD, "fn stays(", "dot(&bounds.noise_bulge, &sizes(&motion.w.hi)) + 3.0 * noise", [
        ("stays: error halved", "0.5 * (dot(&bounds.noise_bulge, &sizes(&motion.w.hi)) + 3.0 * noise)",
         "both parts are bounds of twice the errors, and a value and a slope times the length err by a noise each"),
        ("stays: no error", "0.0 * noise"),
    ]),
    (GUARD, "fn stays(", "0.5 * (1.0 + 1e-9) * second", [
        ("stays: bend halved", "0.25 * (1.0 + 1e-9) * second"),
        ("stays: no bend", "0.0 * second"),
    ]),
    (GUARD, "fn stays(", "length_s * length_s * bend + error", [
        ("stays: bulge halved", "0.5 * (length_s * length_s * bend + error)"),
    ]),
    (GUARD, "fn stays(", "edge_s * edge_s * bend + error + noise", [
        ("stays: least slope of the first edge halved", "0.5 * (edge_s * edge_s * bend + error + noise)", ABOVE),
        ("stays: no least slope of the first edge", "0.0 * noise", ABOVE),
    ]),
    (GUARD, "fn stays(", "(value - error > low || step > least)", [
        ("stays: start at the low limit not looked at", "true", ABOVE),
    ]),
    (GUARD, "fn stays(", "(value + error < high || -step > least)", [
        ("stays: start at the high limit not looked at", "true", ABOVE),
    ]),
    (GUARD, "fn stays(", "end + bulge < high", [
        ("stays: high limit relaxed", "end + bulge <= high",
         "at equality the value is below the limit by the part of `bulge` that the errors do not reach"),
        ("stays: high limit not looked at", "true"),
    ]),
    (GUARD, "fn stays(", "first == 0.0", [
        ("stays: a function without a bend taken for constant", "second == 0.0"),
    ]),
    # noise and side
    (GUARD, "fn noise(", """dot(&bounds.noise_x, &sizes(&motion.x.hi))
            + dot(&bounds.noise_w, &sizes(&motion.w.hi))
            + 4.0 * UNIT * limits.size()""", [
        ("noise: an eighth", """0.125 * (dot(&bounds.noise_x, &sizes(&motion.x.hi))
            + dot(&bounds.noise_w, &sizes(&motion.w.hi))
            + 4.0 * UNIT * limits.size())"""),
        ("noise: none", "0.0 * limits.size()"),
        ("noise: limits' rounding left out", """dot(&bounds.noise_x, &sizes(&motion.x.hi))
            + dot(&bounds.noise_w, &sizes(&motion.w.hi))""",
         "half of the other terms is more than six roundings of the most that the function gets to: enough for the "
         "rounding of a limit up to five times that, and the function comes nowhere near a limit beyond"),
        ("noise: state's error left out", "dot(&bounds.noise_w, &sizes(&motion.w.hi)) + 4.0 * UNIT * limits.size()"),
        ("noise: slope's error left out", "dot(&bounds.noise_x, &sizes(&motion.x.hi)) + 4.0 * UNIT * limits.size()"),
    ]),
    (GUARD, "fn side(&self, value", "if self.open { Ordering::Less } else { Ordering::Equal }", [
        ("side: an open limit taken for a closed one", "Ordering::Equal"),
        ("side: a closed limit taken for an open one", "Ordering::Less"),
    ]),
    (GUARD, "fn side_again(", "watch.limits.side(self.exact(watch.motion, edge))", [
        ("side: doubtful values taken as inside", "{ let _ = edge; Side::Inside }"),
    ]),
    # exit and seek
    (GUARD, "fn exit_with<", "to.edge - from.edge > 1", [
        ("exit: quick look over one edge too", "to.edge - from.edge >= 1",
         "`stays` is right for any number of edges; one edge is decided sooner by its end alone"),
    ]),
    (GUARD, "fn seek_with<", "to.edge - from.edge == 1", [
        ("seek: two edges decided by the end", "to.edge - from.edge <= 2"),
    ]),
    (GUARD, "fn divide(", "self.exit(watch, from, &middle).or_else(|| self.exit(watch, &middle, to))", [
        ("divide: second half first", "self.exit(watch, &middle, to).or_else(|| self.exit(watch, from, &middle))"),
        ("divide: second half left out", "self.exit(watch, from, &middle)"),
    ]),
    # judge
    (GUARD, "fn judge<", "length_s * length_s * 0.125", [
        ("judge: sag halved", "length_s * length_s * 0.0625"),
        ("judge: no sag", "length_s * 0.0"),
    ]),
    (GUARD, "fn judge<", "sag * fourth + dot(&sizes(&self.bend), &error)", [
        ("judge: spread halved", "0.5 * (sag * fourth + dot(&sizes(&self.bend), &error))"),
        ("judge: fourth derivative left out", "dot(&sizes(&self.bend), &error)"),
        ("judge: slope's error left out of the spread", "sag * fourth",
         "times the sag it is less than the noise where the motion is slow over the length, and a millionth of the "
         "fourth derivative's part where it is fast"),
    ]),
    (GUARD, "fn judge<", "(ca.min(cb) - spread, ca.max(cb) + spread)", [
        ("judge: bend at the start taken for all", "(ca - spread, ca + spread)"),
        ("judge: bend at the end taken for all", "(cb - spread, cb + spread)"),
    ]),
    (GUARD, "fn judge<", "4.0 * noise", [
        ("judge: step of an edge halved", "2.0 * noise",
         "the noise is twice the sum of the errors: two of it are still twice the errors of two values"),
        ("judge: no step of an edge", "0.0 * noise"),
    ]),
    (GUARD, "let clear =", "end > noise", [
        ("judge: noise at the end not looked at", "end > 0.0",
         "within the noise the root of `end - noise` is NaN, so that only a function that bends away from the limit is "
         "clear: it lies above its chord, and both ends are inside, as was decided exactly"),
    ]),
    (GUARD, "let clear =", "(start > noise || inward * edge_s > step)", [
        ("judge: start at a limit not looked at", "true",
         "the start is inside, as was decided exactly. Within the noise it counts as at the limit, and the end must be "
         "farther than the pull can bend a function that begins there"),
    ]),
    (GUARD, "let clear =", "(4.0 * sag * pull + noise).sqrt()", [
        ("judge: pull halved", "(2.0 * sag * pull + noise).sqrt()"),
        ("judge: noise left out beside the pull", "(4.0 * sag * pull).sqrt()",
         "the distances are less by twice their errors, and the spread in the pull is twice the bend's error: more "
         "than the rounding of roots and products, which is twelve units of roundoff of the squares"),
    ]),
    (GUARD, "let clear =", "(start - noise).max(0.0).sqrt() + (end - noise).sqrt()", [
        ("judge: roots of the distances", "start.max(0.0).sqrt() + end.sqrt()"),
    ]),
    (GUARD, "let clear =", "pull <= 0.0", [
        ("judge: pull not looked at", "true"),
    ]),
    (GUARD, "fn judge<", "Side::Inside if is_clear(low) && is_clear(high) => return Verdict::Clear,", [
        ("judge: high limit not looked at", "Side::Inside if is_clear(low) => return Verdict::Clear,"),
        ("judge: low limit not looked at", "Side::Inside if is_clear(high) => return Verdict::Clear,"),
    ]),
    (GUARD, "fn judge<", "!is_clear(behind)", [
        ("judge: the other limit not looked at", "false"),
    ]),
    (GUARD, "fn judge<", "most <= 0.0 && start - end > fall", [
        ("judge: concave by the least bend", "least <= 0.0 && start - end > fall"),
        ("judge: concave without the fall", "most <= 0.0", ONCE),
    ]),
    (GUARD, "fn judge<", "least >= 0.0 && start > noise && end < -fall", [
        ("judge: convex by the greatest bend", "most >= 0.0 && start > noise && end < -fall"),
        ("judge: convex from a limit", "least >= 0.0 && end < -fall", ONCE),
        ("judge: convex without the fall", "least >= 0.0 && start > noise", ONCE),
    ]),
    (GUARD, "fn judge<", "((rising * sa).min(rising * sb) - sag * third) * edge_s > step", [
        ("judge: approach without the third derivative", "(rising * sa).min(rising * sb) * edge_s > step"),
        ("judge: approach with half of the third derivative",
         "((rising * sa).min(rising * sb) - 0.5 * sag * third) * edge_s > step"),
        ("judge: approach by the slope at the end", "(rising * sb - sag * third) * edge_s > step"),
        ("judge: every exit taken for the only one", "true"),
    ]),
    # is_surely_inside
    (GUARD, "fn is_surely_inside(", "8.0 * UNIT * dot(&sizes(&self.row), &sizes(x))", [
        ("is_surely_inside: no blur", "0.0 * x[0]"),
    ]),
    (GUARD, "fn is_surely_inside(", "value - low > margin(low)", [
        ("is_surely_inside: low limit without a margin", "value - low > 0.0"),
        ("is_surely_inside: low limit not looked at", "true"),
    ]),
    (GUARD, "fn is_surely_inside(", "high - value > margin(high)", [
        ("is_surely_inside: high limit not looked at", "true"),
    ]),
    # confirm
    (GUARD, "fn confirm_with<", "self.bounds.get(dyadic(most))", [
        ("confirm: derivatives bounded over a quarter of the length", "self.bounds.get(dyadic(most / 4))"),
    ]),
    (GUARD, "fn confirm_with<", "(edges * edge_s) * (edges * edge_s) * 0.125", [
        ("confirm: no sag", "0.0 * edges"),
    ]),
    (GUARD, "fn confirm_with<", "(slopes[0].min(slopes[1]) - sag * third) * edge_s > step", [
        ("confirm: approach without the third derivative", "slopes[0].min(slopes[1]) * edge_s > step"),
        ("confirm: approach with half of the third derivative",
         "(slopes[0].min(slopes[1]) - 0.5 * sag * third) * edge_s > step"),
        ("confirm: approach by the slope at the start", "(slopes[0] - sag * third) * edge_s > step"),
        ("confirm: approach by the slope at the end", "(slopes[1] - sag * third) * edge_s > step"),
        ("confirm: every exit taken for the only one", "true"),
    ]),
    (GUARD, "fn confirm_with<", "bends[0].min(bends[1])", [
        ("confirm: bend at the start taken for all", "bends[0]"),
        ("confirm: bend at the end taken for all", "bends[1]"),
    ]),
    (GUARD, "fn confirm_with<", "(sag * fourth + dot(&sizes(&self.bend), &error))", [
        ("confirm: bend's spread left out", "0.0 * fourth"),
        ("confirm: bend's spread halved", "0.5 * (sag * fourth + dot(&sizes(&self.bend), &error))"),
    ]),
    (GUARD, "fn confirm_with<", "(step / edge_s - slopes[0]).max(0.0)", [
        ("confirm: way back halved", "0.5 * (step / edge_s - slopes[0]).max(0.0)"),
        ("confirm: way back without the noise", "(-slopes[0]).max(0.0)",
         "the noise is more than the slope's error times all of the time, and so more than the way back can be longer; "
         "the limit behind is farther by four of it"),
    ]),
    (GUARD, "fn confirm_with<", "way > step * edges", [
        ("confirm: way without the noise", "way > 0.0",
         ONCE + "; an end beyond the limit behind lies behind a start that is farther from it than the noise"),
    ]),
    (GUARD, "fn confirm_with<", "(behind - step) * (2.0 * bend) > back * back", [
        ("confirm: limit behind not looked at", "true"),
        ("confirm: limit behind without the noise", "behind * (2.0 * bend) > back * back",
         "the noise in `back` leaves twice the noise of a value where the turn is half an edge away or more; where it "
         "is nearer, no later edge is nearer to the limit behind than the start"),
    ]),
    # pursue
    (GUARD, "fn pursue<", "last > steady.until || forecast.rising != steady.rising", [
        ("pursue: direction of the forecast not looked at", "last > steady.until",
         "the exit is looked for in the direction that is known"),
        ("pursue: direction kept beyond its end", "steady.until == 0 || forecast.rising != steady.rising",
         SPEED + "beyond the end, `confirm` proves what it can"),
    ]),
    (GUARD, "*steady = self.steady(watch, from, forecast);", "last > steady.until", [
        ("pursue: direction taken for proved up to the exit", "steady.until == 0"),
    ]),
    (GUARD, "fn steady(", "self.bounds.get(dyadic(most))", [
        ("steady: derivatives bounded over a quarter of the length", "self.bounds.get(dyadic(most / 4))"),
    ]),
    (GUARD, "fn steady(", "rising * self.slope(&from.w) * edge_s - 4.0 * watch.noise", [
        ("steady: slope's size taken for its direction", "(self.slope(&from.w) * edge_s).abs() - 4.0 * watch.noise"),
    ]),
    (GUARD, "fn steady(", "(spare / (second * edge_s * edge_s)) as u64", [
        ("steady: bend halved", "(spare / (0.5 * second * edge_s * edge_s)) as u64"),
        ("steady: no bend", "u64::MAX"),
    ]),
    # close
    (GUARD, "fn close<", "3.0 * watch.noise + 0.5 * (edge_s * edge_s) * (1.0 + 1e-9) * second", [
        ("close: distance from the line halved",
         "0.5 * (3.0 * watch.noise + 0.5 * (edge_s * edge_s) * (1.0 + 1e-9) * second)"),
        ("close: no distance from the line", "0.0 * second"),
        ("close: errors left out of the distance", "0.5 * (edge_s * edge_s) * (1.0 + 1e-9) * second"),
        ("close: bend left out of the distance", "3.0 * watch.noise"),
    ]),
    (GUARD, "fn close<", "tries < 12", [
        ("close: never halves", "true",
         SPEED + "each guess lies inside the bracket and narrows it by an edge or more"),
    ]),
    (GUARD, "fn close<", "self.side(watch, guess, value) == Side::Inside", [
        ("close: decided on the f64 value", "rising * (value - limit) < 0.0"),
    ]),
    # the device's searches
    (DEVICE, "fn listen(", "dyadic(edges).min(self.motion.system().dyadic() - 1)", [
        ("listen: noise of a 64th of the length",
         "dyadic(edges).saturating_sub(6).min(self.motion.system().dyadic() - 1)"),
    ]),
    (DEVICE, "fn is_surely_within(",
     "angle_rad - low_rad > self.known.noise[0] && high_rad - angle_rad > self.known.noise[0]", [
        ("is_surely_within: decided on the f64 value", "angle_rad - low_rad > 0.0 && high_rad - angle_rad > 0.0"),
    ]),
    (KNOWN, "fn holds(", "to <= self.until", [
        ("next_event: known one edge further", "to <= self.until + 1"),
    ]),
    (KNOWN, "fn holds(", "band_rad == self.band_rad", [
        ("next_event: band not looked at", "true"),
    ]),
    (KNOWN, "fn holds(", "event.0 > from)", [
        ("next_event: event at the start kept", "event.0 >= from)",
         "at an event the angle is outside of the band or the mode has ended: no search begins there with the band"),
        ("next_event: event kept behind itself", "true)"),
    ]),
    (KNOWN, "fn holds(", "self.until != 0", [
        ("next_event: event of a motion that has ended kept", "true"),
    ]),
    (DEVICE, "fn look_for_with<", "to >= end", [
        ("look_for: end of a cruise at the last edge left out", "to > end"),
    ]),
    (DEVICE, "fn look_for_with<", "ahead.until >= from && ahead.band_rad == band_rad && ahead.event.is_none()", [
        ("look_for: start from before, whatever the band", "ahead.until >= from && ahead.event.is_none()"),
        ("look_for: start from before, whatever was found", "ahead.until >= from && ahead.band_rad == band_rad",
         "the point found is then the event's: before the event it counts as far (a debug build panics), and behind it "
         "the band is another"),
        ("look_for: start from before, whatever is known", "ahead.band_rad == band_rad && ahead.event.is_none()",
         "a search that found nothing covers NEAR edges or more from its point, so that `from` is known"),
    ]),
    (DEVICE, "if forecast.edges < reach && far < most {", "self.hear(far);", [
        ("look_for: noise up to a forecast not asked for", ""),
    ]),
    (DEVICE, "fn look_for_with<", "self.keeps_mode(&a, far)", [
        ("look_for: ends of modes before a forecast not looked at", "true"),
        ("look_for: ends of modes over half of a forecast", "self.keeps_mode(&a, (a.edge + far) / 2)"),
    ]),
    (DEVICE, "fn keeps_mode(", "last <= self.known.kept || self.checks.iter().all(Option::is_none)", [
        ("keeps_mode: known to last for ever", "self.known.kept != 0 || self.checks.iter().all(Option::is_none)"),
        ("keeps_mode: first check alone looked at", "last <= self.known.kept || self.checks[0].is_none()"),
        ("keeps_mode: second check alone looked at", "last <= self.known.kept || self.checks[1].is_none()"),
    ]),
    (DEVICE, "fn keeps_mode(", "self.hear(beyond);", [
        ("keeps_mode: noise up to the farther edge not asked for", ""),
    ]),
    (DEVICE, "fn keeps_mode(", "self.ends_of_modes(from, beyond - from.edge) == [false; 2]", [
        ("keeps_mode: farther look over the way to the forecast alone",
         "self.ends_of_modes(from, edges) == [false; 2]"),
    ]),
    (DEVICE, "fn listen(", "(self.known.heard, self.known.kept) = ((1 << dyadic) + 1, 0);", [
        ("listen: mode of the motion before known to last", "self.known.heard = (1 << dyadic) + 1;"),
    ]),
    (DEVICE, "fn look_for_with<", "Some(event).filter(|event| event.0 <= to)", [
        ("look_for: a confirmed event after the last edge returned", "Some(event)"),
    ]),
    (DEVICE, "fn look_for_with<", "(0.75 * way).min(FAR)", [
        ("look_for: quick look twice as far", "(1.5 * way).min(4.0 * FAR)",
         SPEED + "it is believed only where all functions stay"),
    ]),
    (DEVICE, "fn look_for_with<", "self.known.ahead = Ahead { until: self.anchor + far, band_rad, event: None };", [
        ("look_for: known one edge beyond the quick look",
         "self.known.ahead = Ahead { until: self.anchor + far + 1, band_rad, event: None };"),
        ("look_for: known a quarter beyond the quick look",
         "self.known.ahead = Ahead { until: self.anchor + far + far / 4, band_rad, event: None };"),
    ]),
    (DEVICE, "last = first + NEAR;", "self.hear(last);", [
        ("look_for: noise of the last search kept", ""),
    ]),
    (DEVICE, "last = first + NEAR;", "self.known.ahead = Ahead { until: self.anchor + last, band_rad, event };", [
        ("look_for: known one edge beyond the search",
         "self.known.ahead = Ahead { until: self.anchor + last + 1, band_rad, event };"),
        ("look_for: event found not kept",
         "self.known.ahead = Ahead { until: self.anchor + last, band_rad, event: None };"),
    ]),
    (DEVICE, "self.known.ahead = Ahead { until: self.anchor + last, band_rad, event };",
     "event.filter(|event| event.0 <= to)", [
        ("look_for: an event after the last edge returned", "event"),
    ]),
    (DEVICE, "fn ends_of_modes(",
     "!guard.stays(&self.motion, limits, self.known.noise[index + 1], from, edges)", [
         ("ends_of_modes: second check not looked at",
          "index == 0 && !guard.stays(&self.motion, limits, self.known.noise[index + 1], from, edges)"),
         ("ends_of_modes: first check not looked at",
          "index == 1 && !guard.stays(&self.motion, limits, self.known.noise[index + 1], from, edges)"),
     ]),
    (DEVICE, "fn watched(", "(check.guard, check.limits, self.known.noise[index + 1])", [
        ("watched: noise of another function", "(check.guard, check.limits, self.known.noise[index])"),
    ]),
    (DEVICE, "fn search<", "soonest = guard.exit(&mut watch, &a, &soonest).unwrap_or(soonest);", [
        ("search: other functions before an expected exit not looked at", "let _ = (guard, &mut watch);"),
    ]),
    (DEVICE, "fn expect(", "forecast.late().min(reach)", [
        ("expect: beyond the last edge", "forecast.late()",
         "an exit up to a quarter farther than asked is the next one too: it is kept and not returned. The noise is "
         "twice the errors, which grow by as much as the time"),
    ]),
    (DEVICE, "fn search<", "a.edge < last", [
        ("search: last edge left out", "a.edge + 1 < last"),
    ]),
    (DEVICE, "fn search<", "1.25 * self.way(encoder, &a)", [
        ("search: parts twice as long", "2.5 * self.way(encoder, &a)", SPEED + "every part is searched to its end"),
    ]),
    (DEVICE, "fn search<", "found.as_ref().unwrap_or(&b)", [
        ("search: order of the ends not looked at", "&b"),
    ]),
    (DEVICE, "fn search<", "a.edge == first && to.edge == last", [
        ("search: no quick look at parts", "a.edge == first || to.edge == last",
         "`exit` is `seek` after a quick look, which only spares it work"),
    ]),
    (DEVICE, "pub fn arrive(", "edge < end", [
        ("arrive: beyond the end of a cruise", "edge <= end"),
    ]),
    (DEVICE, "pub fn arrive(", "sides == [Side::Inside; 2]", [
        ("arrive: second check not looked at", "sides[0] == Side::Inside"),
        ("arrive: first check not looked at", "sides[1] == Side::Inside"),
    ]),
    # ends of modes
    (MODES, "fn instants_with<", "left_s - tau_s", [
        ("change: rest of the edge not flowed", "Double::ZERO + (tau_s - tau_s)"),
        ("change: whole edge flowed", "Double::from(edge_s)"),
    ]),
    (MODES, "fn instants_with<", "ends == MOST_ENDS", [
        ("change: no other end within the edge", "ends == 1"),
        ("change: one other end within the edge", "ends == 2"),
    ]),
    (MODES, "fn soonest<", "usize::from(sides[0] == Side::Inside)", [
        ("change: the second check looked at before the first", "usize::from(sides[1] != Side::Inside)",
         "the other check is looked at where the first one ends, so that their order does not matter"),
    ]),
    (MODES, "fn soonest<", "check.side::<P>(&end.there)", [
        ("change: the other check not looked at where one ends", "Side::Inside"),
    ]),
    (MODES, "fn end_of<", "before.sign() == outward", [
        ("change: value beyond its limit at the start not looked at", "before.hi.is_nan()",
         "each part of the edge begins where every value is inside or at its limit"),
    ]),
    (MODES, "fn end_of<", "before.sign() == 0.0 && course.leaves(check.guard, outward)", [
        ("change: value at its limit at the start not looked at", "before.hi.is_nan()",
         "the search then comes back to the start, within 1e-12 of an edge"),
        ("change: direction at the limit not looked at", "before.sign() == 0.0"),
    ]),
    (MODES, "fn end_of<", "if before.hi.abs() <= after.abs() { Double::ZERO } else { left_s }", [
        ("change: such a value always ends the mode late", "left_s"),
    ]),
    (MODES, "fn turn<", "self.shaft = self.shaft_at::<P>(x);", [
        ("turn: friction never holds", "self.shaft = Shaft::Slip(if above { 1 } else { -1 });"),
        ("turn: friction always holds", "self.shaft = Shaft::Stuck;"),
    ]),
    (MODES, "fn turn<", "x.set(CURRENT, Double::ZERO);", [
        ("turn: rest of a diode's current kept", ""),
    ]),
    (MODES, "(Cause::Shaft, ..) => {", "x.set(SPEED, Double::ZERO);", [
        ("turn: rest of the speed kept", ""),
    ]),
    (MODES, "fn shaft_at<", "low: -friction_nm, high: friction_nm, open: false", [
        ("shaft_at: torque equal to friction moves", "low: -friction_nm, high: friction_nm, open: true"),
    ]),
    (KNOWN, "fn forget(", "(self.heard, self.ahead.until, self.found, self.steady.until) = (0, 0, None, 0);", [
        ("forget: noise of the motion before kept",
         "(self.ahead.until, self.found, self.steady.until) = (0, None, 0);"),
        ("forget: events of the motion before kept", "(self.heard, self.found, self.steady.until) = (0, None, 0);"),
        ("forget: point of the motion before kept",
         "(self.heard, self.ahead.until, self.steady.until) = (0, 0, 0);"),
        ("forget: direction of the motion before kept", "(self.heard, self.ahead.until, self.found) = (0, 0, None);"),
    ]),
    # reversals
    (MODES, "fn reverse_with<", "-sign * rest.slope < kick * (1.0 + 1e-9)", [
        ("reverse: friction never holds", "rest.slope.is_nan()"),
    ]),
    (MODES, "fn reverse_with<", "reversal.end::<P>(&x, &rest, sign)", [
        ("reverse: a negative speed as a positive one", "reversal.end::<P>(&x, &rest, 1.0)"),
    ]),
    (MODES, "fn reverse_with<", "(turned - back).abs() + back.abs()", [
        ("reverse: way back not rubbed", "turned.abs()"),
    ]),
    (MODES, "fn reverse_with<", "constants.coulomb.times::<P>(-sign)", [
        ("reverse: friction on the side before", "constants.coulomb.times::<P>(sign)"),
    ]),
    (REVERSAL, "fn rest<", "(sum.0 + sum.1) / descent(s)", [
        ("reversal: instant in f64", "0.0 * sum.1"),
    ]),
    (REVERSAL, "fn rest<", "orders.lo[2] + small", [
        ("reversal: orders beyond the fourth left out of the instant", "orders.lo[2]"),
    ]),
    (REVERSAL, "fn end<", "P::lanes(&fourth.lo) + small", [
        ("reversal: orders beyond the fourth left out of the state", "P::lanes(&fourth.lo)"),
    ]),
    (REVERSAL, "fn end<", "slope * P::all(sign * rest.more_s)", [
        ("reversal: time in f64", "slope * P::all(0.0)"),
        ("reversal: time rounded on the wrong side", "slope * P::all(-sign * rest.more_s)"),
    ]),
    # sliding shafts
    (GUARD, "fn moves_inside<", "behind <= margin", [
        ("moves_inside: limit behind not looked at", "behind.is_nan()"),
    ]),
    (GUARD, "fn moves_inside<", "behind > margin + back", [
        ("moves_inside: last edge not looked at behind", "behind > margin"),
    ]),
    (GUARD, "fn moves_inside<", "behind + way > margin", [
        ("moves_inside: end not looked at behind", "true"),
    ]),
    (GUARD, "fn moves_inside<", "if direction > 0.0 { (below, above) } else { (above, below) }", [
        ("moves_inside: every direction is up", "(below, above)"),
        ("moves_inside: limits exchanged", "if direction > 0.0 { (above, below) } else { (below, above) }"),
    ]),
    (GUARD, "fn moves_inside<", "direction * (self.value(&state) - start)", [
        ("moves_inside: half the way", "0.5 * direction * (self.value(&state) - start)"),
    ]),
    (GUARD, "fn moves_inside<", "is_inside(length_s * steepest)", [
        ("moves_inside: steepest way halved", "is_inside(0.5 * length_s * steepest)"),
    ]),
    (DEVICE, "fn settle<", "self.ends_of_modes(from, last - from.edge)[0]", [
        ("settle: end of the mode not looked for", "false"),
    ]),
    (DEVICE, "fn settle<", "end.map_or(last, |end| end.edge)", [
        ("settle: angle looked at only to half the way", "end.map_or(last, |end| end.edge) / 2"),
    ]),
    # cruises
    (CRUISE, "fn bounds(", "1.01 * (most[k] + bulge[k])", [
        ("cruise: margins halved", "0.505 * (most[k] + bulge[k])"),
        ("cruise: margins without the bulge", "1.01 * most[k] + 0.0 * bulge[k]"),
        ("cruise: margins of the bulge alone", "0.0 * most[k] + 1.01 * bulge[k]"),
    ]),
    (CRUISE, "fn cruise_with<", "(last - edge).min((1 << (self.motion.system().dyadic() - 1).min(62)) - 1)", [
        ("cruise: a period further than the repetition",
         "(last - edge + period).min((1 << (self.motion.system().dyadic() - 1).min(62)) - 1)"),
        ("cruise: an edge further than the repetition",
         "(last - edge + 1).min((1 << (self.motion.system().dyadic() - 1).min(62)) - 1)"),
    ]),
    (CRUISE, "fn cruise_with<", "edge < self.leaves", [
        ("cruise: tried before the last one's end", "edge > u64::MAX - 1",
         "the search decides; the edge kept only spares searches that would find the same end"),
    ]),
    (CRUISE, "fn cruise_with<",
     "self.shaft != Shaft::Stuck && !(band_rad.0..band_rad.1).contains(&ahead_rad)", [
         ("cruise: tried however near the count is", "ahead_rad.is_nan()",
          "the search decides; a look at the speed only spares searches that would find no room"),
     ]),
    (CRUISE, "fn cruise_with<", "known.edges == period && switches == others", [
        ("cruise: pause through other switches", "known.edges == period && (switches == others || switches != others)",
         "both circuits are without diodes, and such a path always leads through two switches"),
        ("cruise: period not looked at", "switches == others"),
    ]),
    (CRUISE, "fn cruise_with<",
     "std::ptr::eq(ripple.period, known) && ripple.duty == duty && ripple.fall == fall", [
         ("cruise: ripple of another mode", "ripple.duty == duty && ripple.fall == fall"),
         ("cruise: ripple of another duty", "std::ptr::eq(ripple.period, known) && ripple.fall == fall"),
         ("cruise: ripple of another voltage", "std::ptr::eq(ripple.period, known) && ripple.duty == duty"),
     ]),
    (CRUISE, "fn cruise_with<", "left.map_or(edge + reach, |event| event.0 - 1)", [
        ("cruise: onto the event", "left.map_or(edge + reach, |event| event.0)"),
        ("cruise: a period beyond the event", "left.map_or(edge + reach, |event| event.0 - 1 + period)"),
    ]),
    (CRUISE, "fn cruise_with<", "last - edge >= LEAST * period", [
        ("cruise: for one period", "last - edge >= period",
         "a cruise is right over any number of whole periods; one period costs more than it spares"),
    ]),
    (CRUISE, "fn cruise_with<", "(self.checks, self.redecided) = (before.1, before.2);", [
        ("cruise: limits stay narrowed", "self.redecided = before.2;"),
    ]),
    (CRUISE, "(self.checks, self.redecided) = (before.1, before.2);", "self.known.forget();", [
        ("cruise: what is known of the smooth motion kept", ""),
    ]),
    (CRUISE, "fn narrowed(", "check.limits.narrowed(*margin)", [
        ("cruise: limits of modes not narrowed", "check.limits.narrowed(0.0 * *margin)"),
        ("cruise: limits of modes narrowed by half", "check.limits.narrowed(0.5 * *margin)"),
    ]),
    (CRUISE, "fn narrowed(", "value <= check.limits.low.hi || value >= check.limits.high.hi", [
        ("cruise: start beyond the narrowed limits", "value.is_nan()"),
    ]),
    (CRUISE, "fn narrowed(", "(low_rad + margins[0], high_rad - margins[0])", [
        ("cruise: band not narrowed", "(low_rad, high_rad)"),
        ("cruise: band narrowed by half", "(low_rad + 0.5 * margins[0], high_rad - 0.5 * margins[0])"),
        ("cruise: low end of the band not narrowed", "(low_rad, high_rad - margins[0])"),
    ]),
    (CRUISE, "fn is_pulse(", "edges % self.period.edges < self.duty", [
        ("cruise: pulse one edge longer", "edges % self.period.edges <= self.duty"),
    ]),
    (CRUISE, "fn foresees(", "edge < cruise.end", [
        ("cruise: gates foreseen at its end", "edge <= cruise.end"),
    ]),
    # the axis's world
    (WORLD, "fn advance(", "self.next_due.max(self.edge + 1).min(limit)", [
        ("advance: what is due not looked at", "limit"),
        ("advance: one edge beyond what is due", "(self.next_due.max(self.edge).saturating_add(1)).min(limit)"),
    ]),
    (WORLD, "fn advance(", "edge >= self.next_due", [
        ("advance: what is due at the edge is late", "edge > self.next_due"),
    ]),
    (WORLD, "fn idles(", "self.next_due.saturating_sub(self.edge + 1).min(edges)", [
        ("idles: what is due not looked at", "edges"),
        ("idles: onto what is due", "self.next_due.saturating_sub(self.edge).min(edges)"),
    ]),
    (WORLD, "fn foresee(", "self.edge.saturating_add(repeat.edges).saturating_add(1).min(self.next_due)", [
        ("foresee: what is due not looked at", "self.edge.saturating_add(repeat.edges).saturating_add(1)"),
        ("foresee: an edge beyond the repetition",
         "self.edge.saturating_add(repeat.edges).saturating_add(2).min(self.next_due)"),
        ("foresee: a period beyond the repetition",
         "self.edge.saturating_add(repeat.edges + repeat.period).saturating_add(1).min(self.next_due)"),
    ]),
    (WORLD, "fn recount(", "device.is_surely_within(edge, angle_rad, (band.low, band.high))", [
        ("recount: the next count taken unproved", "true"),
    ]),
    (WORLD, "fn driven_by(", "1 << self.command", [
        ("driven_by: the command not looked at", "0"),
    ]),
    (WORLD, "fn foresee(", "self.told = None;", [
        ("foresee: outputs before the cruise taken for told", ""),
    ]),
    # the driver
    (ENGINE, "fn leap_over<", "quiet == 0 && !passed", [
        ("leap: coasts after a cruise too", "quiet == 0",
         "a cruise ends at an edge at which the motion is anchored anew: nothing is known of its next event"),
        ("leap: coasts while the datapath is quiet", "quiet <= 1 && !passed"),
    ]),
    (ENGINE, "fn leap_over<", "edge <= end", [
        ("leap: a cruise beyond the end of the run", "edge <= u64::MAX"),
    ]),
    (ENGINE, "fn leap_over<", "observer.follows(outputs(&self.input, &self.out))", [
        ("leap: a cruise although the outputs are watched", "false"),
    ]),
    (ENGINE, "fn leap_over<", "self.rows.log(&self.world, self.edge + edges - 1, observer);", [
        ("leap: rows not shown while it coasts", ""),
    ]),
    (ENGINE, "fn leap_over<", "self.edge.saturating_add(quiet).saturating_add(1)", [
        ("leap: an edge beyond the quiet ones", "self.edge.saturating_add(quiet).saturating_add(2)"),
    ]),
    (ENGINE, "fn pass(", "edges % period >= first", [
        ("pass: a pulse one edge longer", "edges % period > first"),
    ]),
    (ENGINE, "fn switch_on<", "self.edge.saturating_add(repeat.edges).saturating_add(1)", [
        ("switch: a period beyond the promise",
         "self.edge.saturating_add(repeat.edges).saturating_add(1 + repeat.period)"),
    ]),
    (ENGINE, "fn switch_on<",
     "if begins { (*begin, repeat.first) } else { (repeat.others, repeat.period - repeat.first) }", [
        ("switch: outputs of pulse and pause exchanged",
         "if begins { (repeat.others, repeat.first) } else { (*begin, repeat.period - repeat.first) }"),
    ]),
    (ENGINE, "fn switch_on<", "if due == u64::MAX { due } else { due - 1 - edge }", [
        ("switch: edges of the promise not counted down", "repeat.edges"),
    ]),
    # recurrence
    (CIRCUIT, "fn recurs(", "now.circuit == then.circuit", [
        ("recurs: registers not compared", "true"),
    ]),
    (CIRCUIT, "fn rebased(", "now.circuit.rebase(self.edge);", [
        ("recurs: blocks that lag behind compared as they are", ""),
    ]),
    (CIRCUIT, "fn repeat(&mut self, states", "state.count_lost();", [
        ("repeat: bits lost at the start counted again", ""),
    ]),
    (DEVICE, "pub fn recurs(", "edge - device.anchor", [
        ("recurs: time since the anchor not compared", "0 * (edge - device.anchor)"),
    ]),
    (DEVICE, "pub fn recurs(", "device.leaves.saturating_sub(edge)", [
        ("recurs: cruises that are not tried again not compared", "0 * device.leaves.saturating_sub(edge)"),
    ]),
    (DEVICE, "pub fn recurs(", "mode(self) == mode(earlier)", [
        ("recurs: mode and drive not compared", "true"),
    ]),
    (DEVICE, "pub fn repeat(", "times * (now.mode_changes - then.mode_changes)", [
        ("repeat: changes of mode once too few", "(times - 1) * (now.mode_changes - then.mode_changes)"),
    ]),
    (WORLD, "fn is_left_alone(", "self.next_due == u64::MAX", [
        ("recurs: plans of the hand not looked at", "true"),
    ]),
    (RECURRENCE, "fn note<O: Observe>", "self.wiring.recurs(&past.wiring)", [
        ("recurs: wiring not compared", "true"),
    ]),
    (RECURRENCE, "fn note<O: Observe>", "self.world.recurs(&past.world)", [
        ("recurs: world not compared", "true"),
    ]),
    (RECURRENCE, "fn go_round<", "(goal.max(past.edge) - past.edge) / edges * edges", [
        ("repeat: one period too many", "((goal.max(past.edge) - past.edge) / edges * edges + edges)"),
    ]),
    (RECURRENCE, "fn go_round<", "(then.edge + 1..now.edge).contains(&past.edge)", [
        ("repeat: copies from before the period that repeats", "past.edge < now.edge"),
    ]),
    (RECURRENCE, "fn go_round<", "times * (now.counted[index] - then.counted[index])", [
        ("repeat: ticks once too often", "(times + 1) * (now.counted[index] - then.counted[index])"),
    ]),
    (RECURRENCE, "fn go_round<", "(self.rows.next..end).contains(&self.rows.window)", [
        ("repeat: the row passed from which means are taken", "end < self.rows.next"),
    ]),
    (RECURRENCE, "fn go_round<", "self.edge == due", [
        ("repeat: a period that ends at another edge", "true",
         "the state recurs, so that a count arrives whole periods after another: the loop is looked at when it is due"),
    ]),
    (RECURRENCE, "fn come_round<", "tape.first > then.edge", [
        ("repeat: a tape that begins within the period", "tape.first > self.edge"),
    ]),
    (RECURRENCE, "fn note(&mut self, edge", "words[net] != latest", [
        ("repeat: changes of the contact not shown", "latest != latest"),
    ]),
    (RECURRENCE, "fn come_round<", "stride / common_divisor(period, stride)", [
        ("repeat: rows that do not come back to their places", "stride / stride"),
    ]),
    # networks: the order of ends, and what holds after one
    (NET_ENDS, "fn soonest<", "0..=self.checks.len()", [
        ("network, soonest: a single check is asked", "0..=0"),
    ]),
    (NET_ENDS, "fn soonest<", "side != Side::Inside", [
        ("network, soonest: only ends above a limit", "side == Side::Above"),
        ("network, soonest: only ends below a limit", "side == Side::Below"),
    ]),
    (NET_ENDS, "fn turn<", "self.slip_at_rest::<P>(r, x)", [
        ("network, turn: a body never sticks", "outward"),
        ("network, turn: a body always sticks", "0"),
    ]),
    (NET_ENDS, "fn turn<", "(Touch::Out, at)", [
        ("network, turn: a body that leaves its stop is pressed", "(Touch::Pressed(at), at)"),
    ]),
    (NET_ENDS, "fn turn<", "if end < 0 { stop.low } else { stop.high }", [
        ("network, turn: stops exchanged", "if end < 0 { stop.high } else { stop.low }"),
    ]),
    (NET_ENDS, "fn turn<", "if self.key.limited == 0 { outward } else { 0 }", [
        ("network, turn: a limit is never left", "outward"),
        ("network, turn: limits exchanged", "if self.key.limited == 0 { -outward } else { 0 }"),
    ]),
    (NET_ENDS, "fn press(", "if side < 0 { stop.low } else { stop.high }", [
        ("network, press: stops exchanged", "if side < 0 { stop.high } else { stop.low }"),
    ]),
    (NET_ENDS, "fn slip_at_rest<", "stuck.slips[r] = 0;", [
        ("network, slip at rest: asked in the mode before", ";"),
    ]),
    (NET_ENDS, "fn let_go(", "self.key.slips[r] == 0", [
        ("network, let go: bodies that move are asked too", "true"),
        ("network, let go: nobody is asked", "false"),
    ]),
    (NET_ENDS, "fn let_go(", "self.constants = self.laws.constants(&self.key, self.intent_per_s);", [
        ("network, let go: constants of before", ";"),
    ]),
    (NET_ENDS, "fn let_go(", "self.set_limit(x);", [
        ("network, let go: the drive's limit is not asked", ";"),
    ]),
    (NET_ENDS, "fn set_limit(", "-constant - supply.into()", [
        ("network, set limit: low limit shifted the other way", "constant - supply.into()"),
    ]),
    (NET_ENDS, "fn set_limit(", "Double::from(supply) - constant", [
        ("network, set limit: high limit not shifted", "Double::from(supply)"),
    ]),
    (NET_ENDS, "fn settle(", "speed == 0.0", [
        ("network, settle: bodies that move are asked whether they stick", "true"),
    ]),
    # networks: checks
    (NET_MOTION, "fn checks_now(", "self.hold(body)", [
        ("network, checks: a body that sticks is held for ever", "Limits::ANY"),
    ]),
    (NET_MOTION, "fn checks_now(", "Limits::POSITIVE", [
        ("network, checks: a body that moves forward never turns", "Limits::ANY"),
    ]),
    (NET_MOTION, "fn checks_now(", "Limits::NEGATIVE", [
        ("network, checks: a body that moves backward never turns", "Limits::ANY"),
    ]),
    (NET_MOTION, "fn checks_now(", "(None, Some(beyond(side, force_at(side))))", [
        ("network, checks: a stop pulls", "(None, None)"),
    ]),
    (NET_MOTION, "fn checks_now(", "Some(beyond(side, at(side).into()))", [
        ("network, checks: a lifted body does not leave its stop", "None"),
    ]),
    (NET_MOTION, "fn checks_now(", "Some(beyond(-side, force_at(side)))", [
        ("network, checks: a lifted body is not pressed again", "None"),
    ]),
    (NET_MOTION, "fn checks_now(", "beyond(1, high)", [
        ("network, checks: a drive at its limit stays there", "Limits::ANY"),
    ]),
    (NET_MOTION, "fn hold(", "-stiction - constant", [
        ("network, hold: low limit not shifted by what is constant", "-stiction"),
        ("network, hold: a body lets go at half of its stiction", "Double::from(-0.5 * stiction.hi) - constant"),
    ]),
    (NET_MOTION, "pub fn driven(", "self.let_go(&x);", [
        ("network, driven: nobody lets go", ";"),
    ]),
    (NET_MOTION, "pub fn intend(", "self.let_go(&x);", [
        ("network, intend: nobody lets go", ";"),
    ]),
    # networks: the audit
    (NET_ENERGY, "fn flows(", "f64::from(slips) * net.bodies[body].coulomb * moved(body)", [
        ("network, audit: Coulomb friction doubled", "2.0 * f64::from(slips) * net.bodies[body].coulomb * moved(body)"),
        ("network, audit: Coulomb friction of one direction", "net.bodies[body].coulomb * moved(body)"),
    ]),
    (NET_ENERGY, "fn flows(", "f64::from(self.key.limited) * kind.supply_v() * charge", [
        ("network, audit: a limited drive takes no power", "0.0 * charge"),
        ("network, audit: both limits of one sign", "kind.supply_v() * charge"),
    ]),
    (NET_ENERGY, "fn flows(", "copper + (ends[1] - ends[0]) + laws.drive_constant() * squares[EMF]", [
        ("network, audit: source without the coil's energy", "copper + laws.drive_constant() * squares[EMF]"),
        ("network, audit: source without the power of the motion", "copper + (ends[1] - ends[0])"),
    ]),
    (NET_ENERGY, "fn flows(", "0.5 * (gap(to) - gap(from)) * (gap(to) + gap(from))", [
        ("network, audit: hand's spring holds nothing", "0.0 * gap(to)"),
    ]),
    (NET_ENERGY, "fn flows(", "v * turned - squares[GRIP]", [
        ("network, audit: hand's damper takes nothing", "v * turned"),
    ]),
    (NET_ENERGY, "fn stored_at(", "0.5 * stiffness * stretch * stretch", [
        ("network, audit: joints hold nothing", "0.0 * stretch"),
    ]),
    (NET_ENERGY, "fn stored_at(", "position * (0.5 * body.spring * position - body.constant)", [
        ("network, audit: return springs hold nothing", "0.0 * position"),
        ("network, audit: a constant force gives nothing", "position * 0.5 * body.spring * position"),
    ]),
    (NET_ENERGY, "fn pressed_j(", "if side < 0 { stop.low } else { stop.high }", [
        ("network, audit: stops exchanged", "if side < 0 { stop.high } else { stop.low }"),
    ]),
    (NET_ENERGY, "fn released(", "before - self.pressed_j(stop, x)", [
        ("network, audit: what a stop still holds is lost", "0.0 * before"),
    ]),
    (NET_ENERGY, "fn jumped(", "self.stored_at(&still) - self.stored_at(before)", [
        ("network, audit: springs take no part in a jump", "0.0 * before[0]"),
    ]),
    # for ever: a device at rest
    (LASTING, "fn of(scene", "[coupling, negative(viscous.over(j)), negative(turn)]", [
        ("for ever, motor: current turns the shaft backward",
         "[negative(coupling), negative(viscous.over(j)), negative(turn)]"),
        ("for ever, motor: no drag", "[coupling, Interval::ZERO, negative(turn)]"),
        ("for ever, motor: the hand's spring pushes away", "[coupling, negative(viscous.over(j)), turn]"),
    ]),
    (LASTING, "fn of(scene", "[root(exact(l).over(grip)), root(exact(j).over(grip)), exact(1.0)]", [
        ("for ever, motor: energies of current and speed exchanged",
         "[root(exact(j).over(grip)), root(exact(l).over(grip)), exact(1.0)]"),
    ]),
    (LASTING, "fn of(scene", "push.times(exact(k).over(grip))", [
        ("for ever, motor: torque of a supply halved", "push.times(exact(0.5 * k).over(grip))"),
    ]),
    (LASTING, "fn of(scene", "push.times(root(exact(l).over(grip)))", [
        ("for ever, motor: current of a supply halved", "push.times(exact(0.5)).times(root(exact(l).over(grip)))"),
    ]),
    (LASTING, "fn halves(", "squares < 0.24", [
        ("for ever, halves: any flow does", "squares < 24.0"),
    ]),
    (LASTING, "impl Plant {", "(size(&off) + error).next_up()", [
        ("for ever, rest: half of what is left of the motion before", "(0.5 * size(&off) + error).next_up()"),
        ("for ever, rest: nothing is left of the motion before", "error.next_up()"),
    ]),
    (LASTING, "impl Plant {", "(ripple.lo - error - reach)", [
        ("for ever, rest: no ripple below", "(orbit[2].lo - error - reach)"),
        ("for ever, rest: the motion before is not below", "(ripple.lo - error)"),
    ]),
    (LASTING, "impl Plant {", "(ripple.hi + error + reach)", [
        ("for ever, rest: the motion before is not above", "(ripple.hi + error)"),
    ]),
    (LASTING, "impl Plant {", "(all.lo - low.hi).min(high.lo - all.hi)", [
        ("for ever, rest: no count below", "high.lo - all.hi"),
        ("for ever, rest: no count above", "all.lo - low.hi"),
    ]),
    (LASTING, "impl Plant {", "margin > 0.0", [
        ("for ever, rest: a tenth of a count beyond", "margin > -0.1 * count"),
    ]),
    # for ever: a shaft that friction holds
    (LASTING, "impl Held {", "ends[0]", [
        ("for ever, held: the current before is that of the pulses", "at"),
    ]),
    (LASTING, "impl Held {", "self.torque.times(Interval { lo: passed.lo, hi: passed.hi }).plus(self.hand)", [
        ("for ever, held: no hand", "self.torque.times(Interval { lo: passed.lo, hi: passed.hi })"),
    ]),
    (LASTING, "impl Held {", "self.friction - torque.size()", [
        ("for ever, held: one way alone", "self.friction - torque.hi"),
        ("for ever, held: friction doubled", "2.0 * self.friction - torque.size()"),
    ]),
    (LASTING, "impl Held {", "*at = after(*at, phase)", [
        ("for ever, held: pulses do not move the current", "*at = *at"),
    ]),
    # for ever: what repeats
    (LASTING, "fn follows(", "period.redecided > 0", [
        ("for ever, real numbers: decisions that were near are not asked", "false"),
    ]),
    (LASTING, "fn follows(", "period.mode_changes > 0", [
        ("for ever, real numbers: modes are not asked", "false"),
    ]),
    (LASTING, "fn follows(", "2.0 * period.events as f64", [
        ("for ever, real numbers: events do not round", "0.0 * period.events as f64"),
    ]),
    (LASTING, "fn live(", "live & outputs & !still != 0", [
        ("for ever, nets that matter: a net that is still hangs on others", "live & outputs != 0"),
        ("for ever, nets that matter: none but the gates", "false"),
    ]),
    (FOREVER, "fn period", "(recurrence.period / LEAST_ROWS) | 1", [
        ("for ever, period: one row", "recurrence.period"),
    ]),
    (FOREVER, "fn go_far", "end <= self.world.reach()", [
        ("for ever: motions are computed beyond their tables", "true",
         "a part ends where they end, and all else that goes on is shorter than a part was"),
    ]),
    (FOREVER, "fn phases(", "quiet + 1", [
        ("for ever, rest: each phase of the lead ends an edge early", "quiet"),
    ]),
]


class Mutant:
    """An error at a place, with its number from 1 on."""

    def __init__(self, number, file, line, place, what, put, reason=None):
        self.number, self.file, self.line = number, file, line
        self.place, self.what, self.put, self.reason = place, what, put, reason


def choice(place, options):
    """The text that stands for a place: its mutants, each behind its number, and the place itself."""
    # A part of a pattern or of a structure's fields cannot be chosen alone.
    arm = re.fullmatch(r"(Side::\w+) if (.*) (=> return Verdict::Clear,)", place)
    if arm:
        rest = [(number, re.fullmatch(r"Side::\w+ if (.*) => .*", put)[1]) for number, put in options]
        return f"{arm[1]} if {choice(arm[2], rest)} {arm[3]}"
    fields = re.fullmatch(r"(.*open: )(true|false)", place)
    if fields:
        rest = [(number, put.rsplit(" ", 1)[1]) for number, put in options]
        return fields[1] + choice(fields[2], rest)
    # A place may end behind the expression, where this tells it from others.
    tail = ")" if place.count(")") > place.count("(") else ""
    text = "".join(
        f"if hpu_signal::mutant({number}) {{ {put.removesuffix(tail) if tail else put} }} else "
        for number, put in options
    )
    own = place.removesuffix(tail) if tail else place
    chosen = f"{text}{{ {own} }}"
    return chosen if place.endswith(";") else f"({chosen}){tail}"


def sown():
    """All mutants, and the changed sources by their names."""
    mutants, cuts = [], {}
    for file, behind, place, options in PLACES:
        text = (ROOT / file).read_text()
        at = text.find(place, text.find(behind)) if behind in text else -1
        if at < 0:
            sys.exit(f"{file}: no place {place!r} behind {behind!r}")
        made = []
        for option in options:
            line = text.count("\n", 0, at) + 1
            mutants.append(Mutant(len(mutants) + 1, file, line, place, *option))
            made.append((mutants[-1].number, option[1]))
        cuts.setdefault(file, []).append((at, place, choice(place, made)))
    sources = {}
    for file, places in cuts.items():
        text = (ROOT / file).read_text()
        for at, place, put in sorted(places, reverse=True):
            text = text[:at] + put + text[at + len(place) :]
        sources[file] = text
    name = "crates/signal/src/lib.rs"
    sources[name] = (ROOT / name).read_text() + SWITCH
    return mutants, sources


def built(sources):
    """Builds a copy of the tracked tree with the changed sources. Returns the test binaries by package and target."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "mutants-engine"
    tree = target / "tree"
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    names = {name for name in listed.stdout.splitlines() if (ROOT / name).is_file()}
    # A source that the project has no longer would be a second file for its module.
    for place in tree.rglob("*"):
        if place.is_file() and place.relative_to(tree).as_posix() not in names:
            place.unlink()
    for name in sorted(names):
        content = sources[name].encode() if name in sources else (ROOT / name).read_bytes()
        place = tree / name
        # What is the same keeps its time, so that it is not built again.
        if not place.exists() or place.read_bytes() != content:
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
    packages = sorted({stage[0] for stage in STAGES})
    chosen = [word for package in packages for word in ("-p", package)]
    chosen += [word for name in sorted({stage[1] for stage in STAGES} - {"lib"}) for word in ("--test", name)]
    told = ""
    for targets in (chosen, ["-p", "hpu-plant", "--lib"]):
        done = subprocess.run(
            ["cargo", "test", "--release", "--locked", *targets, "--no-run"],
            cwd=tree, env={**os.environ, "CARGO_TARGET_DIR": str(target)}, capture_output=True, text=True, check=False,
        )
        if done.returncode != 0:
            print(done.stderr, file=sys.stderr)
            sys.exit(3)
        told += done.stderr
    # The binaries in the order of packages, as cargo tells them.
    found = {}
    for name, path in re.findall(r"Executable (?:tests|unittests src)/(\w+)(?:/main)?\.rs \((\S+)\)", told):
        binary = Path(path) if Path(path).is_absolute() else tree / path
        if name == "lib":
            found["hpu-plant", name] = (binary, tree / "crates" / "plant")
            continue
        listing = subprocess.run([binary, "--list"], capture_output=True, text=True, check=True).stdout
        package = next((package for package, module in MODULES.items() if module in listing), "hpu-cosim")
        found[package, name] = (binary, tree / "crates" / package.removeprefix("hpu-"))
    return found


def killed_by(binaries, number, stages):
    """The test that a mutant fails, with the number of others that fail beside it; None if it passes all."""
    for package, name, filters, patience_s in stages:
        binary, folder = binaries[package, name]
        environment = {**os.environ, "HPU_MUTANT": str(number), "RUST_BACKTRACE": "0"}
        done = subprocess.run(
            ["prlimit", f"--cpu={patience_s}", binary, *filters],
            cwd=folder, env=environment, capture_output=True, text=True, check=False,
        )
        if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            return f"{package} {name}: does not end"
        failed = sorted(set(re.findall(r"^test (\S+) \.\.\. FAILED", done.stdout, re.M)))
        if failed:
            others = f" and {len(failed) - 1} more" if len(failed) > 1 else ""
            return f"{package} {name}: {failed[0]}{others}"
        if done.returncode != 0:
            return f"{package} {name}: ends with {done.returncode}"
    return None


class Known:
    """What is known of these mutants, kept in the target folder. A kill stays known while tests are added; a mutant
    that has passed all tests is asked again by other tests."""

    def __init__(self, sources, binaries):
        self.place = next(iter(binaries.values()))[0].parents[2] / "results.json"
        self.mutants = hashlib.sha256(repr(sorted(sources.items())).encode()).hexdigest()
        tests = hashlib.sha256(repr(STAGES).encode())
        for key in sorted(binaries):
            tests.update(binaries[key][0].read_bytes())
        self.tests = tests.hexdigest()
        self.lock = threading.Lock()
        kept = json.loads(self.place.read_text()) if self.place.exists() else {}
        self.found = kept if kept.get("mutants") == self.mutants else {"mutants": self.mutants}

    def killer(self, binaries, number, stages):
        """The test that a mutant fails in the first stages; asked once."""
        killer, passed = self.found.get(str(number), (None, []))
        if killer or [self.tests, stages] in passed:
            return killer
        killer = killed_by(binaries, number, STAGES[:stages])
        with self.lock:
            self.found[str(number)] = (killer, [] if killer else [[self.tests, stages]])
            aside = self.place.with_suffix(".tmp")
            aside.write_text(json.dumps(self.found))
            os.replace(aside, self.place)
        return killer


def recorded():
    """The verdict and the lines below it on record, by the file and the description of a mutant."""
    rows = re.findall(r"^(\S+):\d+ +(\w+) +(.*\n(?:    .*\n)*)", RECORD.read_text(), re.M)
    return {(file, text.split("\n")[0]): (verdict, text) for file, verdict, text in rows}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="WORD", action="append")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args()
    mutants, sources = sown()
    on_record = recorded() if options.only and options.update else {}
    words = options.only or [""]
    chosen = [mutant for mutant in mutants if any(word in f"{mutant.file} {mutant.what}" for word in words)]
    if on_record:
        missing = [mutant for mutant in mutants if mutant not in chosen and (mutant.file, mutant.what) not in on_record]
        if missing:
            sys.exit("not on record, so choose them too:\n" + "".join(f"{one.file} {one.what}\n" for one in missing))
    binaries = built(sources)
    known = Known(sources, binaries)

    def head(mutant, verdict):
        return f"{mutant.file}:{mutant.line:<5} {verdict:<10} "

    def judged(mutant):
        killer = known.killer(binaries, mutant.number, FEW if mutant.reason else len(STAGES))
        verdict = ("wrong" if mutant.reason else "killed") if killer else "equivalent" if mutant.reason else "survives"
        row = head(mutant, verdict) + f"{mutant.what}\n"
        if killer:
            row += f"    {killer}\n"
        else:
            for sign, text in (("-", mutant.place), ("+", mutant.put)):
                row += f"    {sign} {' '.join(text.split())}".rstrip() + "\n"
            row += f"    {mutant.reason}\n" if mutant.reason else ""
        print(row, end="", file=sys.stderr, flush=True)
        return verdict, row

    with ThreadPoolExecutor(options.jobs) as pool:
        judging = pool.map(judged, chosen)
        sound = pool.submit(known.killer, binaries, 0, len(STAGES))
        rows = dict(zip(chosen, judging))
    if sound.result():
        print(f"without a mutant: {sound.result()}", file=sys.stderr)
        sys.exit(3)
    if on_record:
        others = ((mutant, on_record[mutant.file, mutant.what]) for mutant in mutants if mutant not in rows)
        rows |= {mutant: (verdict, head(mutant, verdict) + text) for mutant, (verdict, text) in others}
    count = {verdict: 0 for verdict in ("killed", "equivalent", "survives", "wrong")}
    for verdict, _ in rows.values():
        count[verdict] += 1
    counts = ", ".join(f"{n} {what}" for what, n in count.items())
    text = "# testbench/mutants_engine.py\n"
    text += f"# {len(rows)} mutants of the searches for the next event, and of what lasts for ever: {counts}\n"
    text += "# killed: the first test that fails; equivalent: no result changes, by the reason given\n"
    if on_record:
        text += f"# asked now: {len(chosen)}; the verdicts of the others are those of the record before\n"
    text += "".join(rows[mutant][1] for mutant in mutants if mutant in rows)
    print(text, end="")
    if options.update:
        RECORD.write_text(text)
    sys.exit(1 if count["survives"] or count["wrong"] else 0)


if __name__ == "__main__":
    main()
