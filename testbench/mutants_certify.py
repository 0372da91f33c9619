#!/usr/bin/env python3
"""Mutants of the checker of certificates, chosen by hand: a sign, a missing term, a bound rounded inwards.

Each is written into the source in turn, and the tests of the checker and of its matrices run. A mutant that fails no
test survives. The source is put back in the end.

Usage: testbench/mutants_certify.py [--only=TEXT] [--update]
  --only    judge the mutants alone whose file or error has this text
  --update  write testbench/record/mutants-certify.txt
Exit codes: 0 each mutant is killed, 1 one survives, 3 the tests fail without a mutant, or a mutant does not build.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "testbench" / "record" / "mutants-certify.txt"
CHECK = "crates/prove/src/certify/mod.rs"
WINDOW = "crates/prove/src/certify/window.rs"
GROWTH = "crates/prove/src/certify/growth.rs"
DYADIC = "crates/prove/src/certify/growth/dyadic.rs"
SQUARE = "crates/prove/src/square.rs"
TEXT = "crates/prove/src/certify/text.rs"
FORM = "crates/prove/src/form.rs"
RESPONSES = "crates/prove/src/responses.rs"
# The longest that tests of a mutant take, in seconds.
LONGEST_S = 600

# File, what is wrong, the text, and what stands in its place.
MUTANTS = [
    (CHECK, "the sign of the winding's decay", "[decay.negative(), induced.negative(), Form::ZERO]",
     "[decay, induced.negative(), Form::ZERO]"),
    (CHECK, "no voltage by the speed", "[decay.negative(), induced.negative(), Form::ZERO]",
     "[decay.negative(), Form::ZERO, Form::ZERO]"),
    (CHECK, "no hand's spring", "[gain, drag.negative(), grip.negative()]", "[gain, drag.negative(), Form::ZERO]"),
    (CHECK, "no latency of the encoder", "latency: 4.0 + ", "latency: "),
    (CHECK, "the rounding is a quarter of a count", "let half = number(0.5)", "let half = number(0.25)"),
    (CHECK, "any duty is that at rest", "let away = rest.minus(act).size();", "let away = 0.0;"),
    (RESPONSES, "P may be small", "!is_positive(&unit)", "false"),
    (RESPONSES, "motions may grow", "|| !is_positive(&falls)", ""),
    (RESPONSES, "what is lost is gone", "with_lost(self.alone(start)?, &self.by_axis)", "self.alone(start)?.0"),
    (RESPONSES, "what is lost of the states is gone", "by_axis = from_fn(|axis| with_lost(axes[axis], &by_axis))",
     "by_axis = axes.map(|(sums, _)| sums)"),
    (RESPONSES, "the ranges may be too wide", "if (0..3).all(exceeds) {", "if true {"),
    (RESPONSES, "sums of the middle alone", "sums.iter_mut().enumerate() {\n                *sums",
     "sums.iter_mut().enumerate().skip(1).take(1) {\n                *sums"),
    (RESPONSES, "the rest of a state is not lost", "(lost[state] + parts[state].1).next_up()", "lost[state]"),
    (CHECK, "the sizes need not hold", "all(&followed, f64::le, sizes) && ", ""),
    (CHECK, "the far sizes need not shrink", " && all(&follow(*far), f64::lt, far)", ""),
    (CHECK, "the far sizes need not be far", "farthest.lo >= reach && ", ""),
    (CHECK, "the drag may saturate", " && differs.hi < plant.most_turns", ""),
    (CHECK, "no drag", "let damping = words.damping as f64 * lsb;", "let damping = 0.0;"),
    (CHECK, "a stale difference is half of it", "less.times(less).over(8.0)).times(sample).times(sample)",
     "less.times(less).over(8.0)).times(sample).times(sample.scaled(0.5))"),
    (CHECK, "the sample is a period shorter", "sample: Interval::exact(words.period as f64)",
     "sample: Interval::exact(words.period as f64 - period)"),
    (CHECK, "the drag is not rounded", "let rounding = share.times(number(2.0 * between).plus(number(1.0)))",
     "let rounding = share.times(number(2.0 * between))"),
    (CHECK, "the drag does not enter the sizes", "number(half).plus(drag.over(slope)).times", "number(half).times"),
    (CHECK, "the drag's rounding is free", "times(number(*level)).plus(noise.all())", "times(number(*level))"),
    (CHECK, "the storage is not checked", "if !is_positive(&left) {", "if false {"),
    (CHECK, "the sign of the staircase", "let spent = staircase.times(crossed)",
     "let spent = staircase.negative().times(crossed)"),
    (CHECK, "a negative weight", "(0.0..GREATEST).contains(weight)", "weight.abs() < GREATEST"),
    (CHECK, "the angle does not enter", "let own = [exact(-1.0),", "let own = [exact(0.0),"),
    (CHECK, "no angle between readings", "number(square.hi.sqrt().next_up()).plus(number(between)).hi",
     "number(square.hi.sqrt().next_up()).hi"),
    (CHECK, "a scaled velocity is not refused", "words.damping != 0 && scene.method.reference",
     "false && scene.method.reference"),
    (SQUARE, "Taylor's polynomial has no rest", "Interval { lo: -rest, hi: rest }", "Interval { lo: 0.0, hi: 0.0 }"),
    (SQUARE, "a pivot may be negative", "if own[at].lo <= 0.0 ||", "if own[at].hi <= 0.0 ||"),
    # Its sign makes no difference: what is taken is as wide on either side of 0.
    (SQUARE, "no elimination", "left[row][of].minus(share.times(own[of]))", "left[row][of]"),
    (SQUARE, "one corner of the ranges alone", "(0..Form::<K>::CONTROLS).all(", "(0..1).all("),
    (SQUARE, "the new coordinates are on one side alone", "sum.plus(turn[by][row].times(turned[by][of]))",
     "if by == row { turned[by][of] } else { sum }"),
    (FORM, "no product of two lines", "let higher = first * its_second + second * its_first + second * its_second;",
     "let higher = 0.0;"),
    (FORM, "no rest beside the other's lines", "around(self.rest, own) * (its_first + its_second) + around", "around"),
    (FORM, "rounding is lost", "4.0 * f64::EPSILON * rounded", "0.0 * rounded"),
    (FORM, "a square between the ends is theirs", "2.0 * place[of].abs() - 1.0", "place[of].abs()"),
    (FORM, "a quotient has no third order", ".plus(t.times(t)).minus(higher)", ".plus(t.times(t))"),
    (FORM, "a range ends at its middle", "(high - middle).max(middle - low).next_up()", "0.5 * (high - middle)"),
    (FORM, "a reciprocal's ends are exchanged", "-slope * self.slopes[only].signum()",
     "slope * self.slopes[only].signum()"),
    (FORM, "the other half of a product's line", "own * other.slopes[of] + its * self.slopes[of]",
     "own * other.slopes[of]"),
    (TEXT, "any stiffness is claimed", "(stiffness / (word as f64 * step) - 1.0).abs() < 1e-9 && ", ""),
    (TEXT, "any duty is claimed", " && (duty - bound.duty).abs() < 1e-6", ""),
    (TEXT, "parts may be missing", "if !is_whole(&parts, 0) {", "if false {"),
    (TEXT, "any part of a half is all of it",
     "low.len() + high.len() == parts.len() && is_whole(&low, common + 1) && is_whole",
     "low.len() + high.len() == parts.len() && is_whole"),
    (TEXT, "a half is the whole", "*(if letter.is_ascii_lowercase() { high } else { low }) = middle;",
     "let _ = (middle, low, high);"),
    (TEXT, "another number may move", "if !is_clock || count != 1 ||", "if"),
    (TEXT, "one number may have two ranges", "if ranges.iter().enumerate().any(",
     "if false && ranges.iter().enumerate().any("),
    (TEXT, "any rms is claimed", "bound.rms_counts <= *rms && ", ""),
    (RESPONSES, "the greatest of a motion is its start", "self.gathered(start, start[2], f64::max)",
     "self.gathered(start, start[2], |most, size| if most > 0.0 { most } else { size })"),
    (WINDOW, "the state adds nothing to the sizes", "exact(followed).plus(more).hi <= size", "followed <= size"),
    (WINDOW, "contact may be lost", "push.hi >= rest.all().lo || ", ""),
    (WINDOW, "the full command may be reached", " || push.hi >= exact(most).minus(rest.all()).lo", ""),
    (WINDOW, "damping is not refused", "if plant.damping > 0.0 {\n        return Err(DAMPED.into());\n    } else if !",
     "if !"),
    (WINDOW, "a window may have no length", "(1.0..=LONGEST)", "(f64::NEG_INFINITY..=LONGEST)"),
    (WINDOW, "one reading less", "exact(periods.ceil() + 1.0)", "exact(periods.ceil())"),
    (WINDOW, "no part of a period", "exact(periods.ceil() + 1.0)", "exact(periods.floor() + 1.0)"),
    (WINDOW, "no angle between readings", "exact(mean.sqrt().next_up()).plus(exact(witness.sizes[2])).hi",
     "mean.sqrt().next_up()"),
    (WINDOW, "half of the rounding", "half.times(half).times(exact(witness.level))",
     "half.times(exact(0.5)).times(exact(witness.level))"),
    (WINDOW, "nothing is stored at the start", ".plus(begin).minus(end)", ".minus(end)"),
    (WINDOW, "nothing is taken at the end", ".plus(begin).minus(end)", ".plus(begin)"),
    (WINDOW, "the sign of what is taken at the end", "Some(Interval::ZERO.minus(taken))", "Some(taken)"),
    (WINDOW, "a storage may fall without end", "        is_positive(&held)\n", "        true\n"),
    (WINDOW, "the whole potential is a square", "divided(one.minus(share).scaled(2.0))", "scaled(0.5)"),
    (WINDOW, "the potential begins at a count", "exact(before.abs()).plus(half)", "exact(before.abs())"),
    (WINDOW, "the storage's diagonal alone", "storage[row][of].all().times(state[row])",
     "storage[row][row].all().times(state[row])"),
    (WINDOW, "no current between readings", "driven.plus(self.coupling.times(fastest)).plus(pulled).over(8.0)",
     "self.coupling.times(fastest).plus(pulled).over(8.0)"),
    (WINDOW, "no voltage by the speed between readings", "driven.plus(self.coupling.times(fastest)).plus(pulled)",
     "driven.plus(pulled)"),
    (WINDOW, "no friction between readings", "self.drag.times(fastest).plus(self.grip.times(angle.plus(fastest)))",
     "self.grip.times(angle.plus(fastest))"),
    (WINDOW, "the speed in a period is that of its start", "speed.plus(driven).plus(self.grip.times(angle)).divided",
     "speed.plus(self.grip.times(angle)).divided"),
    (WINDOW, "any edge is a reading", "is_off && rest.cycle", "rest.cycle"),
    (WINDOW, "a pulse may pull", "*share == -1.0", "*share != 0.0"),
    (WINDOW, "the hand may be anywhere", "!= rest.standing.intent_rad", "!= rest.standing.intent_rad && false"),
    (WINDOW, "the pulse at rest begins with its reading", "exact(self.period - self.latency).minus(clocks)",
     "exact(self.period).minus(clocks)"),
    (WINDOW, "the sign of the pulse", "Form::exact(self.period)).negative()", "Form::exact(self.period))"),
    (WINDOW, "the command at rest is any", "let newer = middle.minus(misses.divided(slopes));", "let newer = command;"),
    (WINDOW, "the sign of Newton's step", "middle.minus(misses.divided(slopes))",
     "middle.plus(misses.divided(slopes))"),
    (WINDOW, "the motion at rest is that of the middle", "at[state].plus(by[state].times(off))", "at[state]"),
    (WINDOW, "the speed is in no counts", "times(period_s).divided(count)", "times(period_s)"),
    (WINDOW, "the solution is where it was computed", "exact(near[state]).plus(Interval { lo: -far, hi: far })",
     "exact(near[state])"),
    (GROWTH, "any growth is claimed", " && growth * (1.0 - 1e-12) <= least(root)", ""),
    (GROWTH, "half of the input", "> most;", "> 0.5 * most;"),
    (GROWTH, "no disturbance", "input.plus(Interval::exact(scene.disturbance)).size()", "input.size()"),
    (GROWTH, "a number is no part of the row", "row.times(root).plus(real(*coefficient))", "row.times(root)"),
    (GROWTH, "a root may be anywhere", "(after.re.is_inside(around) && after.im.is_inside(around)).then_some(wide)",
     "Some(wide)"),
    (GROWTH, "a root is a point", "let width = 8.0 *", "let width = 0.0 *"),
    (GROWTH, "the slope's powers are one too low", "Interval::exact((order - place) as f64)",
     "Interval::exact((order - place - 1) as f64)"),
    (GROWTH, "a plant may begin anywhere", "&& scene.initial.iter().all(|state| *state == 0.0)", ""),
    (GROWTH, "the denominator may begin with any number", " && denominator[0] == 1.0", ""),
    (GROWTH, "any edge is a sample", ".filter(|edges| edges.is_multiple_of(scene.adc.period))", ""),
    (GROWTH, "a reading never saturates", "(least, most + 1);", "(i64::MIN / 4, i64::MAX / 4);"),
    (GROWTH, "readings are rounded down", "if adc.floors { 0.0 } else { -0.5 }", "0.0"),
    (GROWTH, "outputs do not saturate", ".clamp(-(1 << bits), (1 << bits) - 1);", ";"),
    (GROWTH, "the controller rounds to the nearest",
     "if scene.method.floors { sum.div_euclid(by) } else { (2 * sum + by).div_euclid(2 * by) }\n    };",
     "(2 * sum + by).div_euclid(2 * by)\n    };"),
    (GROWTH, "the controller forgets its outputs", " - products(&words.denominator[1..], &outputs)", ""),
    (DYADIC, "no carry", "carry = sum >> 32;", "carry = sum >> 62;"),
    (DYADIC, "the greater one is subtracted", "one.iter().rev().lt(two.iter().rev())", "false"),
    (DYADIC, "the last digits are rounded inwards", "u128::from(low > 0)", "0"),
    (DYADIC, "numbers below the least normal one", "power.max(1) - 1075", "power - 1075"),
    (WINDOW, "no second order of the inverse", "exact(moved).divided(exact(1.0).minus(exact(off)))", "exact(moved)"),
]


def outcome(command, root, folder=None):
    """Runs tests in a tree. Returns whether they build, and the first that fails."""
    environment = {**os.environ, "RUSTC_WRAPPER": str(ROOT / "testbench" / "rustc.sh")}
    if folder:
        environment["CARGO_TARGET_DIR"] = str(folder)
    # A group of its own, so that a test that does not end goes with its runner.
    running = subprocess.Popen(command, cwd=root, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                               text=True, start_new_session=True)
    try:
        said, _ = running.communicate(timeout=LONGEST_S)
        ends = f"ends with {running.returncode}" if running.returncode else None
    except subprocess.TimeoutExpired:
        os.killpg(running.pid, signal.SIGKILL)
        said, _ = running.communicate()
        ends = f"does not end within {LONGEST_S} s"
    failed = [line.split()[1] for line in said.splitlines() if line.startswith("test ") and "FAILED" in line]
    return "running " in said, (failed[0] if failed else ends)


def judged(mutants, tests, root):
    """Writes each mutant into the sources of a tree in turn, and runs the tests. Returns a row for each; None where
    that cannot be told."""
    builds, failed = tests()
    if not builds or failed:
        print(f"without a mutant: {failed or 'no build'}", file=sys.stderr)
        return None
    rows = []
    for file, what, old, new in mutants:
        path = root / file
        source = path.read_text()
        if source.count(old) != 1:
            print(f"{file}: {old} stands there {source.count(old)} times", file=sys.stderr)
            return None
        try:
            path.write_text(source.replace(old, new))
            builds, failed = tests()
        finally:
            path.write_text(source)
        if not builds:
            print(f"does not build: {what}", file=sys.stderr)
            return None
        rows.append(f"{file}  {'killed' if failed else 'SURVIVES'}  {what}\n    {failed or ''}".rstrip())
        print(rows[-1], flush=True)
    return rows


def known(*lists):
    """Returns whether the options are those of a script that calls `held` with these lists, and choose a mutant."""
    options = [word for word in sys.argv[1:] if word != "--update"]
    return all(word.startswith("--only=") for word in options) and any(chosen(mutants) for mutants in lists)


def chosen(mutants):
    """Returns the mutants whose file or error has the text of `--only`; all of them without that option."""
    only = next((word.removeprefix("--only=") for word in sys.argv if word.startswith("--only=")), "")
    return [mutant for mutant in mutants if only in mutant[0] or only in mutant[1]]


def held(mutants, tests, root, command, record, of):
    """Judges mutants, and writes the record if that was asked for. Returns the exit code.

    With `--only` rows of mutants that are not judged are kept, and those of mutants that there are no more go."""
    found = judged(chosen(mutants), tests, root) if chosen(mutants) else []
    if found is None:
        return 3
    is_part = len(found) < len(mutants)
    rows = {key(row): row for row in [*(kept(record) if is_part else []), *found]}
    rows = [rows[name] for name in ((file, what) for file, what, *_ in mutants) if name in rows]
    missing = len(mutants) - len(rows)
    survivors = sum("  SURVIVES  " in row for row in rows)
    head = f"# {command}\n# {len(rows)} mutants of {of}: {len(rows) - survivors} killed, {survivors} survive" \
           f"{f', {missing} not run' if missing else ''}\n# each with the first test that fails\n"
    if "--update" in sys.argv:
        record.write_text(head + "\n".join(rows) + "\n")
    return 1 if any("  SURVIVES  " in row for row in found) else 0


def key(row):
    """Returns the file and the error of a row."""
    file, _, what = row.splitlines()[0].split("  ", 2)
    return file, what


def kept(record):
    """Returns the rows of a record."""
    text = record.read_text() if record.exists() else ""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    starts = [at for at, line in enumerate(lines) if not line.startswith("    ")]
    return ["\n".join(lines[at:end]) for at, end in zip(starts, [*starts[1:], len(lines)])]


# Tests that take a second or two, which kill most mutants.
FIRST = ["square", "form::", "responses", "a_bound_has", "a_witness", "a_certificate", "a_pulse", "a_stale", "levels",
         "no_multiplier", "scenes_without", "window::", "a_state", "a_window", "growth::"]
ALL = ["steady", "square", "certify", "form", "responses"]


def tests():
    """Runs the tests of the checker and of its matrices: all of them only if none of the first ones fails."""
    # Without any optimisation the tests take ten times as long.
    command = ["cargo", "test", "--locked", "--profile", "quick", "--config",
               "profile.quick.package.hpu-prove.opt-level=1", "-p", "hpu-prove", "--lib", "--"]
    builds, failed = outcome(command + FIRST, ROOT)
    return (builds, failed) if failed or not builds else outcome(command + ALL, ROOT)


def main():
    if not known(MUTANTS):
        print(__doc__, file=sys.stderr)
        return 2
    return held(MUTANTS, tests, ROOT, "testbench/mutants_certify.py", RECORD, "the checker of certificates")


if __name__ == "__main__":
    sys.exit(main())
