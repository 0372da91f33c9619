#!/usr/bin/env python3
"""Mutants of the leaping engine, chosen by hand: a horizon an edge too long, a carry forgotten, a word not told.

Each is written in turn into a copy of the tree, where the tests of crates/leap run. A mutant that fails no test
survives. Errors that only make jumps shorter are none: they cost time, never a word.

Usage: testbench/mutants_leap.py [--update]
  --update  write testbench/record/mutants-leap.txt
Exit codes: 0 each mutant is killed, 1 one survives, 3 the tests fail without a mutant, or a mutant does not build.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from mutants_certify import ROOT, held, outcome

RECORD = ROOT / "testbench" / "record" / "mutants-leap.txt"
LINE = "crates/leap/src/line.rs"
OPERATION = "crates/leap/src/operation.rs"
ENGINE = "crates/leap/src/engine.rs"
NETLIST = "crates/leap/src/netlist.rs"
SETS = "crates/leap/src/index_set.rs"

# The tests, in the order in which they are asked: those that cost least first.
STAGES = [["cells::every", "cells::words", "cells::an_equality", "horizons::", "netlists::a_", "netlists::slopes"],
          ["netlists::random"], ["cells::two_million"]]

# File, what is wrong, the text, and what stands in its place.
MUTANTS = [
    # Horizons.
    (LINE, "a falling line has the room of a rising one", "if slope > 0 { mask(width) - word } else { word }",
     "mask(width) - word"),
    (LINE, "a line by one leaves its range an edge later", "1 => room.saturating_add(1)",
     "1 => room.saturating_add(2)"),
    (LINE, "a line leaves its range an edge later", "(room / step).saturating_add(1).min(FOREVER),\n    }",
     "(room / step).saturating_add(2).min(FOREVER),\n    }"),
    (LINE, "the room of a line is rounded up", "step => (room / step)", "step => room.div_ceil(step)"),
    (LINE, "a signed word wraps as one without a sign",
     "if is_signed { offset(line.word, width) } else { line.word }", "if is_signed { line.word } else { line.word }"),
    (LINE, "an even slope reaches an odd word", "if word.trailing_zeros() < twos {", "if false {"),
    (LINE, "an equality is met at a later solution", "let bits = width - twos as u8;", "let bits = width;"),
    (LINE, "an equality is met by the opposite slope", "word.wrapping_neg() >> twos", "word >> twos"),
    (LINE, "the inverse of a slope has ten bits", "for _ in 0..4 {", "for _ in 0..1 {"),
    (LINE, "at most is taken for less", "let holds = if is_strict { a < b } else { a <= b };",
     "let holds = a < b || is_strict && a < b;"),
    (LINE, "lines that part are those that near", "(b.abs_diff(a), of_a > of_b)", "(b.abs_diff(a), of_b > of_a)"),
    (LINE, "lines that near from above part", "(a.abs_diff(b), of_b > of_a)", "(a.abs_diff(b), of_a > of_b)"),
    (LINE, "a gap that is closed has to be passed", "gap.div_ceil(step)", "(gap / step).saturating_add(1)"),
    (LINE, "a gap is passed an edge later", "(gap / step).saturating_add(1) };", "(gap / step).saturating_add(2) };"),
    (LINE, "a strict order ends where the gap is closed, whichever it is", "let is_closed = holds == is_strict;",
     "let is_closed = is_strict;"),
    (LINE, "the difference of slopes leaves 64 bits", "of_a.abs_diff(of_b)", "of_a.wrapping_sub(of_b).unsigned_abs()"),
    (LINE, "the bits below a slice never carry", "leaves(line.word & mask(low), directed(rest), low)", "FOREVER"),
    (LINE, "a slice moves in the other direction", "if line.slope < 0 { size", "if line.slope > 0 { size"),
    (LINE, "a slice that starts above bit 0 keeps the slope", "if low == 0 || line.slope == 0 {",
     "if low < 2 || line.slope == 0 {"),
    # Rules.
    (LINE, "an extended word never wraps", "known(a.slope, a.horizon.min(wraps(a, of_a, signed)))",
     "known(a.slope, a.horizon)"),
    (LINE, "an extended word has always a sign", "a.horizon.min(wraps(a, of_a, signed))",
     "a.horizon.min(wraps(a, of_a, signed || true))"),
    (LINE, "the upper part of a concatenation is not shifted", "a.slope.wrapping_shl(of_b.into())", "a.slope"),
    (LINE, "the lower part of a concatenation never wraps", "both.min(leaves(b.word, b.slope, of_b))", "both"),
    (LINE, "an inverted word moves as it is", "known(a.slope.wrapping_neg(), a.horizon)", "known(a.slope, a.horizon)"),
    (LINE, "two words decide for ever", "(true, true) => Some(known(0, a.horizon.max(b.horizon)))",
     "(true, true) => Some(known(0, FOREVER))"),
    (LINE, "a first word decides for ever", "(true, false) => Some(known(0, a.horizon)),",
     "(true, false) => Some(known(0, FOREVER)),"),
    (LINE, "a second word decides for ever", "(false, true) => Some(known(0, b.horizon)),",
     "(false, true) => Some(known(0, FOREVER)),"),
    (LINE, "a moving word decides", "self.slope == 0 && self.word == word", "self.word == word"),
    (LINE, "a word passes after its mask has ended", "if a.word == neutral => known(b.slope, both)",
     "if a.word == neutral => known(b.slope, b.horizon)"),
    (LINE, "any resting word passes the other", "(false, true) if b.word == neutral =>", "(false, true) =>"),
    (LINE, "an inverting mask keeps the slope", "if a.word == mask(width) => known(b.slope.wrapping_neg(), both)",
     "if a.word == mask(width) => known(b.slope, both)"),
    (LINE, "a difference is a sum", "Self::Sub => known(a.slope.wrapping_sub(b.slope), both)",
     "Self::Sub => known(a.slope.wrapping_add(b.slope), both)"),
    (LINE, "a sum outlasts a summand", "Self::Add => known(a.slope.wrapping_add(b.slope), both)",
     "Self::Add => known(a.slope.wrapping_add(b.slope), a.horizon)"),
    (LINE, "a product has the slope of its factor", "known(b.slope.wrapping_mul(a.word.cast_signed()), both)",
     "known(b.slope, both)"),
    (LINE, "a quotient by a moving word rests", "(self == Self::Parity || b.is_still())", "true"),
    (LINE, "the second word of a comparison never wraps", ".min(wraps(b, of_a, signed));", ";"),
    (LINE, "equal words stay equal", "0 if parts => known(0, 1),", "0 if parts && of_a > 64 => known(0, 1),"),
    (LINE, "words that differ stay different", "both.min(zero(difference, slope, of_a))", "both"),
    (LINE, "a moving selector chooses on", "if a.is_still() { a.horizon.min(chosen.horizon) } else { 1 }",
     "chosen.horizon"),
    (LINE, "a selector chooses on after its horizon", "a.horizon.min(chosen.horizon) } else", "chosen.horizon } else"),
    (LINE, "a choice between equal words forgets their slopes", "b.word == c.word && b.slope == c.slope",
     "b.word == c.word"),
    (LINE, "a choice between equal lines lasts as the longer one", "horizon.max(b.horizon.min(c.horizon))",
     "horizon.max(b.horizon.max(c.horizon))"),
    (LINE, "a shift by a moving amount is a line", "if !b.is_still() => unknown,",
     "if !b.is_still() && of_a > 64 => unknown,"),
    (LINE, "a shift to the left keeps the slope", "{ a.slope << b.word } else { 0 }", "{ a.slope } else { 0 }"),
    (LINE, "a shift to the right never wraps", "let horizon = both.min(wraps(a, width, signed));",
     "let horizon = both;"),
    (LINE, "the bits that a shift drops never carry", "(slope, horizon.min(below))", "(slope, horizon)"),
    (LINE, "the sign that is left of a shift never changes", "None if signed && !a.is_still() => unknown,",
     "None if signed && !a.is_still() && of_a > 64 => unknown,"),
    # Words.
    (OPERATION, "a signed remainder has no sign", "signed(a, width).wrapping_rem(signed(b, width)).cast_unsigned()",
     "(a % b)"),
    (OPERATION, "a shift by the width is one by 0", "Self::ShiftLeft if b >= u64::from(width) => 0,",
     "Self::ShiftLeft if b > u64::from(width) => 0,"),
    (OPERATION, "the second operand has its sign at another place", "(offset(a, of_a), offset(b, of_a))",
     "(offset(a, of_a), b)"),
    # The engine.
    (ENGINE, "the slope of a register's next word does not matter",
     "if line.slope == slope { line.horizon } else { 1 }",
     "if line.slope == slope { line.horizon } else { line.horizon }"),
    (ENGINE, "registers are not checked",
     "edges = edges.min(keeps(self.lines[data as usize], self.lines[output as usize].slope));",
     "edges = edges.min(keeps(self.lines[data as usize], self.lines[output as usize].slope).max(most));"),
    (ENGINE, "registers at rest are not checked", "(self.movers.contains(at) || is_in(flop.data)).then_some",
     "self.movers.contains(at).then_some"),
    (ENGINE, "outputs are not checked", "if self.ranks[asked].contains(at as usize) {",
     "if self.ranks[asked].contains(at as usize) && most == 0 {"),
    (ENGINE, "resets and clocks are not checked", "edges = edges.min(keeps(self.lines[net as usize], 0));",
     "edges = edges.min(keeps(self.lines[net as usize], 0).max(most));"),
    (ENGINE, "clocks that are made are not checked", ".chain(self.clocks.iter().map(|clock| clock.net));\n        cone",
     ";\n        cone"),
    (ENGINE, "jumps begin while others than counters change", " && self.pending.is_within(&self.movers);", ";"),
    (ENGINE, "a jump begins before a change is told", "if may_leap && !self.news.meets(&self.ranks[asked]) {",
     "if may_leap {"),
    (ENGINE, "a jump is an edge short", "edges.wrapping_mul(line.slope", "(edges - 1).wrapping_mul(line.slope"),
    (ENGINE, "counters do not wrap", "moved & mask(flop.width)", "moved"),
    (ENGINE, "a register whose data rest stays pending",
     "register is pending or not by its own new word.\n            self.marked.insert(self.steps.len() + at as usize);",
     "register is pending or not by its own new word."),
    (ENGINE, "a reset acts at the other level", "lines[net as usize].word == active && lines[output",
     "lines[net as usize].word != active && lines[output"),
    (ENGINE, "a reset that is no edge acts at the start", "marked.set(first + at, reset.at_start)",
     "marked.set(first + at, reset.at_start || true)"),
    (ENGINE, "every change of a clock is an edge", "before != clock.level && clock.level == clock.active",
     "before != clock.level"),
    (ENGINE, "the first level of a clock is an edge", "level: active, flops", "level: 1 - active, flops"),
    (ENGINE, "registers of clocks that are made take words at every edge",
     "if register.clock.is_some() { register.output } else { register.data }", "register.data"),
    (ENGINE, "the cells behind one moving word rest", "step.operands.iter().any(|net| moves",
     "step.operands.iter().all(|net| moves"),
    (ENGINE, "an input that changes is not seen",
     "                self.users.mark(net, &mut self.marked);\n            }\n        }\n        self.settle();",
     "            }\n        }\n        self.settle();"),
    (ENGINE, "a request goes on past its end", "self.step(edges - done, asked)", "self.step(edges, asked)"),
    (ENGINE, "only the last output ends a request", "ends |= self.ranks[0]", "ends = self.ranks[0]"),
    (ENGINE, "an output is told again and again", "self.told[at] = Some(word);\n                self.news.set",
     "self.news.set"),
    (ENGINE, "an output that has its old word again is told", "self.news.set(output, is_new);",
     "if is_new { self.news.set(output, true); }"),
    (NETLIST, "data and word of an active reset are exchanged",
     "if reset.active { [reset.net, data, word] } else { [reset.net, word, data] }",
     "if !reset.active { [reset.net, data, word] } else { [reset.net, word, data] }"),
    (SETS, "a set of more than 64 numbers is that of its first", "self.0.iter().zip(&other.0).all(",
     "self.0.iter().zip(&other.0).take(1).all("),
    (SETS, "sets of more than 64 numbers meet in the first", "self.0.iter().zip(&other.0).any(",
     "self.0.iter().zip(&other.0).take(1).any("),
]


def main():
    if sys.argv[1:] not in ([], ["--update"]):
        print(__doc__, file=sys.stderr)
        return 2
    folder = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "mutants-leap"
    # A mutant that does not end is killed by its time on the processor.
    # Optimised a little, it is built and run in the least time.
    command = ["prlimit", "--cpu=120", "env", "CARGO_PROFILE_RELEASE_OPT_LEVEL=1",
               "CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16", "cargo", "test", "--locked", "--release", "-p",
               "hpu-leap", "--tests", "--"]
    with tempfile.TemporaryDirectory() as scratch:
        tree = Path(scratch) / "tree"
        tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in tracked.splitlines():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            # With the time of now: what was built of a mutant before is built again.
            shutil.copy(ROOT / name, tree / name)

        def tests():
            for stage in STAGES:
                builds, failed = outcome([*command, *stage], tree, folder)
                if failed or not builds:
                    break
            return builds, failed

        return held(MUTANTS, tests, tree, "testbench/mutants_leap.py", RECORD, "the leaping engine")


if __name__ == "__main__":
    sys.exit(main())
