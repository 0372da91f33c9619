#!/usr/bin/env python3
"""Mutants of the leaping engine, chosen by hand: a horizon an edge too long, a carry forgotten, a word not told.

Each is written in turn into a copy of the tree, where the tests of crates/leap run. A mutant that fails no test
survives. Errors that only make jumps shorter are none: they cost time, never a word.

Usage: testbench/mutants_leap.py [--only=TEXT] [--update]
  --only    judge the mutants alone whose file or error has this text
  --update  write testbench/record/mutants-leap.txt and mutants-printer.txt
Exit codes: 0 each mutant is killed, 1 one survives, 3 the tests fail without a mutant, or a mutant does not build.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from mutants_certify import ROOT, held, known, outcome

RECORD = ROOT / "testbench" / "record" / "mutants-leap.txt"
PRINTER = ROOT / "testbench" / "record" / "mutants-printer.txt"
LINE = "crates/leap/src/line.rs"
OPERATION = "crates/leap/src/operation.rs"
ENGINE = "crates/leap/src/engine/mod.rs"
NETLIST = "crates/leap/src/netlist.rs"
SETS = "crates/leap/src/index_set.rs"
PERIODS = "crates/leap/src/engine/periods.rs"
CLUSTER = "crates/leap/src/engine/cluster.rs"
CELLS = "crates/leap/src/yosys/cells.rs"
WORDS = "crates/leap/src/yosys/words.rs"
MODULE = "crates/leap/src/yosys/module.rs"
PLAIN = "crates/rtl/src/dut/leap/plain.rs"

# The tests, in the order in which they are asked: those that cost least first.
STAGES = [["yosys::", "cells::every", "cells::words", "cells::an_equality", "horizons::", "netlists::a_",
           "netlists::slopes"],
          ["netlists::random", "netlists::periods", "netlists::clusters"], ["cells::two_million"]]

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
    (OPERATION, "a signed remainder has no sign", "a.wrapping_rem(b).cast_unsigned()",
     "(a.cast_unsigned() % b.cast_unsigned())"),
    (OPERATION, "a shift by the width is one by 0", "if b() >= u64::from(width) => 0,",
     "if b() > u64::from(width) => 0,"),
    (OPERATION, "the second operand has its sign at another place", "(offset(a, of_a), offset(b(), of_a))",
     "(offset(a, of_a), b())"),
    # The engine.
    (ENGINE, "the slope of a register's next word does not matter",
     "if line.slope == slope { line.horizon } else { 1 }",
     "if line.slope == slope { line.horizon } else { line.horizon }"),
    (ENGINE, "registers are not checked",
     "edges = edges.min(keeps(lines[data as usize], lines[output as usize].slope));",
     "edges = edges.min(keeps(lines[data as usize], lines[output as usize].slope).max(most));"),
    (ENGINE, "registers at rest are not checked", "if self.movers.contains(at) || moves[flop.data as usize] {",
     "if self.movers.contains(at) {"),
    (ENGINE, "outputs are not checked", "edges = edges.min(keeps(line, 0));", ""),
    (ENGINE, "outputs that are shown need no horizon", "edges = edges.min(line.horizon);", ""),
    (ENGINE, "the first word of a ramp is not told", "for edge in before + 1..done {",
     "for edge in before + 2..done {"),
    (ENGINE, "outputs and triggers are not looked at after a jump", "self.marked.extend(&self.cone.ends);", ""),
    (ENGINE, "registers are not looked at after a jump",
     "self.pending.set(at as usize, lines[data as usize].word != lines[output as usize].word);", ""),
    (ENGINE, "a word is on its line at its horizon", "if line.horizon > edges {", "if line.horizon >= edges {"),
    (ENGINE, "words behind counters move an edge less", "line.after(edges, step.widths.result)",
     "line.after(edges - 1, step.widths.result)"),
    (ENGINE, "a ramp does not wrap", "line.word.wrapping_add(line.slope.cast_unsigned()) & *bits;",
     "line.word.wrapping_add(line.slope.cast_unsigned());"),
    (ENGINE, "resets and clocks are not checked", "edges = edges.min(keeps(lines[net as usize], 0));",
     "edges = edges.min(keeps(lines[net as usize], 0).max(most));"),
    (ENGINE, "clocks that are made are not checked",
     ".chain(self.clocks.iter().map(|clock| clock.net));\n        let triggers",
     ";\n        let triggers"),
    (ENGINE, "jumps begin while others than counters change", " && self.pending.is_within(&self.movers);", ";"),
    (ENGINE, "a jump begins before a change is told", "if may_leap && !self.news.meets(&self.ranks[asked]) {",
     "if may_leap {"),
    (ENGINE, "a jump is an edge short", "line.after(edges, flop.width)", "line.after(edges - 1, flop.width)"),
    (LINE, "counters do not wrap", "edges.wrapping_mul(self.slope.cast_unsigned())) & mask(width)",
     "edges.wrapping_mul(self.slope.cast_unsigned())) & mask(width).max(u64::MAX)"),
    (ENGINE, "a reset acts at the other level", "if line.word == active && differ", "if line.word != active && differ"),
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
     "                self.users.mark(net, &mut self.marked);\n            }\n        }\n"
     "        self.settle::<false>(0);",
     "            }\n        }\n        self.settle::<false>(0);"),
    (ENGINE, "a request goes on past its end", "self.step(edges - done, asked)", "self.step(edges, asked)"),
    (ENGINE, "only the last output ends a request", "ends |= self.ranks[0]", "ends = self.ranks[0]"),
    (ENGINE, "an output is told again and again", "self.told[at] = Some(word);\n                self.news.set",
     "self.news.set"),
    (ENGINE, "an output that has its old word again is told", 
     "self.news.set(output, self.told[output] != Some(line.word));",
     "if self.told[output] != Some(line.word) { self.news.set(output, true); }"),
    (NETLIST, "data and word of an active reset are exchanged",
     "if reset.active { [reset.net, data, word] } else { [reset.net, word, data] }",
     "if !reset.active { [reset.net, data, word] } else { [reset.net, word, data] }"),
    # Periods of several edges.
    (ENGINE, "outputs are not checked in a period", "if PERIOD && self.ranks[asked].contains(output) {", "if false {"),
    (ENGINE, "clocks are not checked in a period",
     "let line = lines[clock.net as usize];\n                    if PERIOD {",
     "let line = lines[clock.net as usize];\n                    if false {"),
    (ENGINE, "lines of registers whose words rest are not taken", "let is_pending = differ::<PERIOD>(",
     "let is_pending = differ::<false>("),
    (ENGINE, "lines of cells whose words rest are not passed on", "if differ::<PERIOD>(*line, made) {",
     "if line.word != made.word {"),
    (ENGINE, "registers take words alone in a period", "line.word = taken.word;\n            if PERIOD {",
     "line.word = taken.word;\n            if false {"),
    (ENGINE, "operands of a cell have no lines in a period",
     "true => step.line(lines),", "true => Line::still(step.word(lines)),"),
    (PERIODS, "a register need not move by its slope", "if is_it { keeps(line, *slope) } else { 1 }",
     "keeps(line, *slope)"),
    (PERIODS, "the slope after a period does not matter", "if is_it { keeps(line, *slope) } else { 1 }",
     "if is_it { line.horizon } else { 1 }"),
    (PERIODS, "registers are not checked after a period", "least = least.min(if is_it",
     "least = least.max(if is_it"),
    (PERIODS, "a jump is a period longer", "least.saturating_sub(1)", "least"),
    (PERIODS, "a period goes on past a change", "while edges < period && !self.news.meets(&self.ranks[asked]) {",
     "while edges < period {"),
    (PERIODS, "a jump goes on past the request", ".min((most - period) / period)", ".min(most / period)"),
    (PERIODS, "a jump is a period short", "jump.wrapping_mul(slope", "(jump - 1).wrapping_mul(slope"),
    (PERIODS, "lines stay after a period", "lines[step.output as usize] = Line::still(word);",
     "lines[step.output as usize].word = word;"),
    (PERIODS, "the edges of rest are one more than there are", "self.until_cluster().min(period - edges)",
     "(self.until_cluster() + 1).min(period - edges)"),
    (PERIODS, "a period rests though its words of the cluster do not return",
     "if self.taken.is_empty() && self.periods.is_periodic {", "if self.taken.is_empty() {"),
    (PERIODS, "a period begins at rest though words of the cluster do not return",
     "let waits = self.periods.is_periodic && self.pending.is_empty();", "let waits = self.pending.is_empty();"),
    (PERIODS, "registers that take a line behind a period are not checked",
     "let bound = if is_same { data.horizon.min(own.horizon) } else { 1 };", "let bound = FOREVER;"),
    (PERIODS, "data behind a period may have another slope", "if is_same { data.horizon.min(own.horizon) } else { 1 };",
     "data.horizon.min(own.horizon);"),
    (PERIODS, "a word is on its line at its horizon", "match line.horizon > jump {", "match line.horizon >= jump {"),
    (PERIODS, "rests before an event are an edge longer", "self.move_cluster::<false>(rests - 1);",
     "self.move_cluster::<false>(rests);"),
    # Clusters.
    (CLUSTER, "cells that are thawed keep their words", "    marked.extend(frozen);\n", ""),
    (CLUSTER, "registers that are thawed keep their words",
     "|(net, word)| lines[net as usize].word = word);", "|_| {});"),
    (ENGINE, "registers of a cluster show the words of its beginning",
     "hidden(net).map_or(self.lines[net as usize].word, |(_, word)| word)", "self.lines[net as usize].word"),
    (ENGINE, "a frozen cell may be evaluated", "self.marked.insert_into(part, std::mem::take(&mut left));", ""),
    (ENGINE, "what a register of a made clock takes is not seen", "self.flops.iter().map(|(_, data)| Net(*data))",
     "self.flops.iter().take(0).map(|(_, data)| Net(*data))"),
    (ENGINE, "cells that wait for a cluster are never stale", "*bits |= all", "*bits |= 0"),
    (ENGINE, "words of a cluster do not bound data", "steady.ends.push(flop.data);", ""),
    (CLUSTER, "a cluster is an edge ahead", "cluster.edge += edges;",
     "cluster.edge += edges + u64::from(edges > 0);"),
    (CLUSTER, "words of a cluster are the same in each period",
     "let horizon = if is_still {", "let horizon = if true {"),
    (CLUSTER, "words of a cluster return a period longer", "            until = then.1;\n        }\n        periods",
     "            until = then.1;\n        }\n        periods + 1"),
    (CLUSTER, "words of a cluster return for ever too soon", "periods >= length", "periods >= length / 2"),
    (CLUSTER, "each period brings a cluster back", ".all(|orbit| period.is_multiple_of(orbit.words.len()))",
     ".all(|orbit| period <= orbit.words.len())"),
    (CLUSTER, "words of a cluster mark nothing",
     "self.users.mark_but(orbit.net, &self.frozen, &mut self.marked);", ""),
    (CLUSTER, "words of a cluster last an edge longer", "orbit.next = cluster.edge + until;",
     "orbit.next = cluster.edge + until + 1;"),
    (CLUSTER, "words of a cluster bound nothing", "        steady.next - cluster.edge\n", "        FOREVER\n"),
    (CLUSTER, "what waits for a cluster lasts an edge longer", "        steady.next - cluster.edge\n",
     "        steady.next - cluster.edge + 1\n"),
    (CLUSTER, "what others see of a cluster lasts an edge longer", "steady.until[*net as usize] - cluster.edge;",
     "steady.until[*net as usize] - cluster.edge + 1;"),
    (CLUSTER, "a word of a cluster that lasts longer leaves its users",
     "self.users.mark(orbit.net, &mut self.stale);", ""),
    (CLUSTER, "a cell that lasts longer leaves its users", "self.users.mark_range(step.users, &mut self.stale);", ""),
    (CLUSTER, "words of a cluster last for ever at the orbit's end", "(0..2 * words.len()).rev()",
     "(0..words.len()).rev()"),
    (CLUSTER, "counters may move what a cluster takes", "if self.frozen.iter().any(is_moved) {",
     "if false && self.frozen.iter().any(is_moved) {"),
    (CLUSTER, "cells that take other words too are frozen", "step.operands.iter().all(|net| needed[*net as usize]);",
     "step.operands.iter().any(|net| needed[*net as usize]);"),
    # Netlists.
    (NETLIST, "a choice by a word that is kept takes the other",
     "if word == 0 { a } else { b };", "if word == 0 { b } else { a };"),
    (NETLIST, "a word that is kept is another",
     "made.constants.push((net, word &", "made.constants.push((net, !word &"),
    (NETLIST, "cells are followed by one step",
     "for cell in self.cells.iter().rev() {", "for cell in self.cells.iter() {"),
    # The reader of Yosys' JSON.
    (CELLS, "operands have no sign", "let sign = bits.last().copied().filter(|_| is_signed)",
     "let sign = bits.last().copied().filter(|_| is_signed && width == 0)"),
    (CELLS, "xnor is xor", "if cell.kind == \"$xnor\" { self.unary(Operation::Not, net) } else { net }", "net"),
    (CELLS, "greater is less", "\"$gt\" => self.binary(Operation::Less { signed }, &b, &a, 1)",
     "\"$gt\" => self.binary(Operation::Less { signed }, &a, &b, 1)"),
    (CELLS, "a comparison for inequality holds where all parts differ", "_ => (Operation::Differ, Operation::Or),",
     "_ => (Operation::Differ, Operation::And),"),
    (CELLS, "the parity is not inverted",
     "if cell.kind == \"$reduce_xnor\" { self.unary(Operation::Not, net) } else { net }", "net"),
    (CELLS, "a shift to the right keeps the sign", "let arithmetic = cell.kind == \"$sshr\" && is_signed;",
     "let arithmetic = is_signed;"),
    (CELLS, "an arithmetic shift has no sign", "let arithmetic = cell.kind == \"$sshr\" && is_signed;",
     "let arithmetic = cell.kind == \"$sshr\" && false;"),
    (CELLS, "a negative amount shifts to the right", "&[sign, down, up]", "&[sign, down, down]"),
    (CELLS, "minus a word is the word less 0", "(&zero[..], a)", "(a, &zero[..])"),
    (WORDS, "copies of a word's top bit are zeros",
     "let low = self.word(&bits[..=bits.len() - copies])?;\n                "
     "self.netlist.cell(Operation::Extend { signed: true }",
     "let low = self.word(&bits[..=bits.len() - copies])?;\n                "
     "self.netlist.cell(Operation::Extend { signed: false }"),
    (WORDS, "a run of bits goes on over a gap", "&& place == (net, low + length as u8)", "&& place.0 == net"),
    (WORDS, "the parts of a word are exchanged", "&[part, low], from as u8)", "&[low, part], from as u8)"),
    (WORDS, "a reset acts at the other level", "active: cell.is_set(\"ARST_POLARITY\")",
     "active: !cell.is_set(\"ARST_POLARITY\")"),
    (WORDS, "a clock that is made has the other edge", "rises: cell.is_set(\"CLK_POLARITY\")",
     "rises: !cell.is_set(\"CLK_POLARITY\")"),
    (WORDS, "a slower clock begins an edge later", "Operation::Equal, &[phase, none], 1)",
     "Operation::Equal, &[phase, one], 1)"),
    (WORDS, "a slower clock is slower by an edge", "u64::from(edges) - 1]", "u64::from(edges)]"),
    (WORDS, "registers of a slower clock take words at every edge", "        if edges == 1 {\n            return data;",
     "        if edges > 0 {\n            return data;"),
    (WORDS, "a falling edge is a rising one", "&& !register.is_set(\"CLK_POLARITY\") {", "&& false {"),
    (WORDS, "a design may clock and reset its registers", ".find(by_design).filter(|_| is_made)",
     ".find(by_design).filter(|_| false)"),
    (WORDS, "a bit may have several drivers", ".insert(*net, (driver, place)).is_some()",
     ".insert(*net, (driver, place)).is_some() && false"),
    (MODULE, "initial values begin at the top", "unwrap_or_default().chars().rev();", "unwrap_or_default().chars();"),
    (SETS, "a set of more than 64 numbers is that of its first", "self.0.iter().zip(&other.0).all(",
     "self.0.iter().zip(&other.0).take(1).all("),
    (SETS, "sets of more than 64 numbers meet in the first", "self.0.iter().zip(&other.0).any(",
     "self.0.iter().zip(&other.0).take(1).any("),
]

# Those of the printer of what Verilator has read. Tests of crates/rtl hold what Yosys makes of it against Verilator.
PRINTED = [
    (PLAIN, "an operation loses its signs", "let signed = |text: &str| if is_signed {",
     "let signed = |text: &str| if is_signed && text.is_empty() {"),
    (PLAIN, "an extension copies no sign",
     "(format!(\"{{($signed({value}) + $signed({{{width}{{1'b0}}}}))}}\"), width)",
     "(format!(\"{{{{{width}{{1'b0}}}} | {value}}}\"), width)"),
    # Lives: Verilator gives the operands of each operation its width, so nothing around it is wider.
    (PLAIN, "an operation takes its width from around it", "Ok((format!(\"{{({} {sign} {b})}}\", signed(a))",
     "Ok((format!(\"({} {sign} {b})\", signed(a))"),
    (PLAIN, "the words of a choice are exchanged", "({when} ? {yes} : {no})", "({when} ? {no} : {yes})"),
    (PLAIN, "a choice loses its default", "if let Some(body) = otherwise {",
     "if let Some(body) = otherwise.filter(|_| first) {"),
    (PLAIN, "a part begins a bit higher", "\"const\" => self.number(low)?.to_string(),",
     "\"const\" => (self.number(low)? ^ 1).to_string(),"),
    (PLAIN, "a structure is a bit wider", "let mut width = 0;", "let mut width = 1;"),
    (PLAIN, "a name of a package is one of the module", "filter(|name| of_packages.contains(name))",
     "filter(|name| of_packages.contains(name) && name.is_empty())"),
    (PLAIN, "a function of several is the first one", "[function] if is_direct(&function) => {",
     "[function, ..] => {"),
    (PLAIN, "an arithmetic shift has no sign", "\"shiftrs\" => (\">>>\", true),", "\"shiftrs\" => (\">>\", false),"),
]


def main():
    if not known(MUTANTS, PRINTED):
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

        def printed():
            # The netlists that were made of what another printer has written.
            shutil.rmtree(folder / "tmp", ignore_errors=True)
            package = ["-p", "hpu-rtl", "--test", "all", "--", "system_verilog::"]
            return outcome([*command[:command.index("-p")], *package], tree, folder)

        return max(held(MUTANTS, tests, tree, "testbench/mutants_leap.py", RECORD, "the leaping engine"),
                   held(PRINTED, printed, tree, "testbench/mutants_leap.py", PRINTER, "the printer for Yosys"))


if __name__ == "__main__":
    sys.exit(main())
