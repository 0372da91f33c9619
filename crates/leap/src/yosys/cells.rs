//! The cells of Yosys' library as operations.

use std::borrow::Cow;
use std::collections::HashSet;

use super::module::{Bit, RawCell};
use super::words::{MOST, Reader};
use super::{MOST_MEMORY_WORDS, Unfit};
use crate::netlist::Net;
use crate::operation::Operation;

/// Returns bits with zeros for unknown ones.
fn known(bits: &[Bit]) -> Cow<'_, [Bit]> {
    bits.iter().map(|bit| if *bit == Bit::Unknown { Bit::Zero } else { *bit }).collect()
}

impl Reader<'_> {
    /// Makes the words of a cell, of 64 bits each and the rest.
    pub(super) fn cell(&mut self, cell: &RawCell) -> Result<Vec<Net>, Unfit> {
        let y = cell.port("Y");
        let (a, b) = (&*self.written(y, cell.port("A")), &*self.written(y, cell.port("B")));
        let width = y.len();
        if width == 0 {
            return Err(self.refused(cell));
        }
        // A side of a choice that nothing sees may have any bits.
        let is_unknown = |bits: &[Bit]| bits.contains(&Bit::Unknown);
        let is_choice = cell.kind == "$mux" && is_unknown(a) != is_unknown(b);
        let (of_a, of_b) = match is_choice && self.is_unseen(cell, is_unknown(b)) {
            true => (known(a), known(b)),
            false => (Cow::Borrowed(a), Cow::Borrowed(b)),
        };
        let (a, b) = (&*of_a, &*of_b);
        if cell.kind != "$pmux" && [a, b, cell.port("S")].iter().any(|bits| bits.contains(&Bit::Unknown)) {
            return Err(self.unknown(y));
        }
        let one = |net: Net| vec![net];
        let is_signed = cell.is_set("A_SIGNED");
        match &*cell.kind {
            "$not" | "$pos" => {
                let a = resized(a, is_signed, width);
                let is_not = cell.kind == "$not";
                a.chunks(MOST).map(|bits| self.inverted_if(is_not, bits)).collect()
            }
            "$and" | "$or" | "$xor" | "$xnor" => {
                self.agree(cell)?;
                let (a, b) = (resized(a, is_signed, width), resized(b, is_signed, width));
                let operation = match &*cell.kind {
                    "$and" => Operation::And,
                    "$or" => Operation::Or,
                    _ => Operation::Xor,
                };
                let pairs = a.chunks(MOST).zip(b.chunks(MOST));
                pairs
                    .map(|(a, b)| {
                        let net = self.binary(operation, a, b, a.len() as u8)?;
                        Ok(if cell.kind == "$xnor" { self.unary(Operation::Not, net) } else { net })
                    })
                    .collect()
            }
            "$neg" | "$add" | "$sub" | "$mul" => {
                self.narrow(cell, width)?;
                let zero = [Bit::Zero];
                let (a, b) = if cell.kind == "$neg" {
                    (&zero[..], a)
                } else {
                    self.agree(cell)?;
                    (a, b)
                };
                let operation = match &*cell.kind {
                    "$add" => Operation::Add,
                    "$mul" => Operation::Mul,
                    _ => Operation::Sub,
                };
                // Zero has no sign.
                let a = resized(a, is_signed && cell.kind != "$neg", width);
                self.binary(operation, &a, &resized(b, is_signed, width), width as u8).map(one)
            }
            "$div" | "$mod" => {
                self.agree(cell)?;
                let most = width.max(a.len()).max(b.len());
                self.narrow(cell, most)?;
                let (a, b) = (resized(a, is_signed, most), resized(b, is_signed, most));
                let signed = is_signed;
                let operation = if cell.kind == "$div" { Operation::Div { signed } } else { Operation::Rem { signed } };
                let net = self.binary(operation, &a, &b, most as u8)?;
                Ok(one(self.slice(net, 0, width as u8)))
            }
            "$lt" | "$le" | "$gt" | "$ge" => {
                self.agree(cell)?;
                let most = a.len().max(b.len());
                self.narrow(cell, most)?;
                let (a, b) = (resized(a, is_signed, most), resized(b, is_signed, most));
                let signed = is_signed;
                let net = match &*cell.kind {
                    "$lt" => self.binary(Operation::Less { signed }, &a, &b, 1),
                    "$le" => self.binary(Operation::AtMost { signed }, &a, &b, 1),
                    "$gt" => self.binary(Operation::Less { signed }, &b, &a, 1),
                    _ => self.binary(Operation::AtMost { signed }, &b, &a, 1),
                }?;
                self.flag(cell, net, width)
            }
            "$eq" | "$ne" | "$eqx" | "$nex" => {
                self.agree(cell)?;
                let most = a.len().max(b.len());
                let (a, b) = (resized(a, is_signed, most), resized(b, is_signed, most));
                let (each, join) = match &*cell.kind {
                    "$eq" | "$eqx" => (Operation::Equal, Operation::And),
                    _ => (Operation::Differ, Operation::Or),
                };
                let parts = a.chunks(MOST).zip(b.chunks(MOST));
                let parts = parts.map(|(a, b)| self.binary(each, a, b, 1)).collect::<Result<Vec<_>, _>>()?;
                let net = self.folded(join, parts);
                self.flag(cell, net, width)
            }
            "$reduce_or" | "$reduce_bool" => {
                let net = self.any(a)?;
                self.flag(cell, net, width)
            }
            "$reduce_and" => {
                let parts = a.chunks(MOST).map(|bits| self.compared(Operation::Equal, bits, Bit::One));
                let parts = parts.collect::<Result<Vec<_>, _>>()?;
                let net = self.folded(Operation::And, parts);
                self.flag(cell, net, width)
            }
            "$reduce_xor" | "$reduce_xnor" => {
                let mut parts = Vec::new();
                for bits in a.chunks(MOST) {
                    let word = self.word(bits)?;
                    parts.push(self.netlist.cell(Operation::Parity, &[word], 1));
                }
                let net = self.folded(Operation::Xor, parts);
                let net = if cell.kind == "$reduce_xnor" { self.unary(Operation::Not, net) } else { net };
                self.flag(cell, net, width)
            }
            "$logic_not" => {
                let parts = a.chunks(MOST).map(|bits| self.compared(Operation::Equal, bits, Bit::Zero));
                let parts = parts.collect::<Result<Vec<_>, _>>()?;
                let net = self.folded(Operation::And, parts);
                self.flag(cell, net, width)
            }
            "$logic_and" | "$logic_or" => {
                let (a, b) = (self.any(a)?, self.any(b)?);
                let operation = if cell.kind == "$logic_and" { Operation::And } else { Operation::Or };
                let net = self.netlist.cell(operation, &[a, b], 1);
                self.flag(cell, net, width)
            }
            "$mux" => {
                let select = self.word(cell.port("S"))?;
                self.chosen(select, a, b)
            }
            "$pmux" => self.parallel(cell, a, b),
            "$shl" | "$sshl" | "$shr" | "$sshr" | "$shift" | "$shiftx" => self.shift(cell).map(one),
            _ => Err(self.refused(cell)),
        }
    }

    /// Returns whether nothing sees the word of a choice between two while it takes an unknown side, which it does
    /// while its selecting bit is `when`: every way from it to an output or a register leads through a choice by the
    /// same bit that then takes its other side. A function of Verilog that is called under a condition is such a
    /// choice.
    fn is_unseen(&self, choice: &RawCell, when: bool) -> bool {
        let select = choice.port("S");
        let is_output: HashSet<Bit> = self.module.outputs.iter().flat_map(|(_, bits)| bits.iter().copied()).collect();
        let (mut reached, mut next) = (HashSet::new(), choice.port("Y").to_vec());
        while let Some(bit) = next.pop() {
            if !reached.insert(bit) {
                continue;
            }
            if is_output.contains(&bit) {
                return false;
            }
            for &at in self.users.get(&bit).map_or(&[][..], |users| users) {
                let user = &self.module.cells[at];
                if user.port("Y").is_empty() {
                    return false;
                }
                let is_at = |port: &str| user.port(port).contains(&bit);
                let other = if when { "A" } else { "B" };
                let is_blocked = user.kind == "$mux"
                    && user.port("S") == select
                    && ["A", "B", "S"].iter().all(|port| *port == other || !is_at(port));
                if !is_blocked {
                    next.extend(user.port("Y"));
                }
            }
        }
        true
    }

    /// Returns the bits of an operand, with zeros for unknown ones where the result is the address or the data of a
    /// memory's write port: Yosys leaves both unknown while the port does not write.
    fn written<'b>(&self, result: &[Bit], operand: &'b [Bit]) -> Cow<'b, [Bit]> {
        if !operand.contains(&Bit::Unknown) || !self.module.name(result).contains("$memwr$") {
            return Cow::Borrowed(operand);
        }
        known(operand)
    }

    /// Returns the refusal of a cell, by what it stands for.
    pub(super) fn refused(&self, cell: &RawCell) -> Unfit {
        let name = self.module.name(cell.port(cell.result()));
        let held = self.module.name(cell.port("Q"));
        Unfit(match &*cell.kind {
            "$dlatch" | "$adlatch" | "$dlatchsr" | "$sr" => format!("`{held}` is a latch"),
            "$aldff" | "$dffsr" | "$aldffe" | "$dffsre" => {
                format!("register `{held}` has an asynchronous set or load of a word that is no constant")
            }
            "$assert" | "$assume" | "$cover" | "$live" | "$fair" | "$check" | "$print" => {
                "it has assertions or messages".to_string()
            }
            "$tribuf" => format!("`{name}` may have high impedance"),
            kind if kind.starts_with("$mem") => {
                let memory = self.module.name(cell.port("RD_DATA"));
                format!("the memory that is read as `{memory}` has more than {MOST_MEMORY_WORDS} words")
            }
            kind if kind.starts_with('$') => format!("`{name}` is computed by a cell {kind}, which is not known here"),
            kind => format!("the module `{kind}` is not among its files"),
        })
    }

    /// Refuses operands of which only one is signed, and words that are too wide.
    fn agree(&self, cell: &RawCell) -> Result<(), Unfit> {
        if cell.is_set("A_SIGNED") == cell.is_set("B_SIGNED") {
            return Ok(());
        }
        Err(Unfit(format!("`{}` is made of a signed and an unsigned operand", self.module.name(cell.port("Y")))))
    }

    fn narrow(&self, cell: &RawCell, width: usize) -> Result<(), Unfit> {
        if width <= MOST {
            return Ok(());
        }
        let (name, kind) = (self.module.name(cell.port("Y")), cell.kind.trim_start_matches('$'));
        Err(Unfit(format!("`{name}` is computed by `{kind}` in {width} bits; at most {MOST} are taken")))
    }

    fn binary(&mut self, operation: Operation, a: &[Bit], b: &[Bit], width: u8) -> Result<Net, Unfit> {
        let operands = [self.word(a)?, self.word(b)?];
        Ok(self.netlist.cell(operation, &operands, width))
    }

    fn unary(&mut self, operation: Operation, a: Net) -> Net {
        let width = self.netlist.width(a);
        self.netlist.cell(operation, &[a], width)
    }

    fn inverted_if(&mut self, is_inverted: bool, bits: &[Bit]) -> Result<Net, Unfit> {
        let net = self.word(bits)?;
        Ok(if is_inverted { self.unary(Operation::Not, net) } else { net })
    }

    /// Returns a bit as a word of a cell's width.
    fn flag(&mut self, cell: &RawCell, net: Net, width: usize) -> Result<Vec<Net>, Unfit> {
        self.narrow(cell, width)?;
        let extended = Operation::Extend { signed: false };
        Ok(vec![if width == 1 { net } else { self.netlist.cell(extended, &[net], width as u8) }])
    }

    /// Compares a word with one of equal bits.
    fn compared(&mut self, operation: Operation, bits: &[Bit], other: Bit) -> Result<Net, Unfit> {
        self.binary(operation, bits, &vec![other; bits.len()], 1)
    }

    /// Returns whether any bit is 1.
    fn any(&mut self, bits: &[Bit]) -> Result<Net, Unfit> {
        if bits.len() == 1 {
            return self.word(bits);
        }
        let parts = bits.chunks(MOST).map(|bits| self.compared(Operation::Differ, bits, Bit::Zero));
        let parts = parts.collect::<Result<Vec<_>, _>>()?;
        Ok(self.folded(Operation::Or, parts))
    }

    /// Joins bits.
    fn folded(&mut self, operation: Operation, parts: Vec<Net>) -> Net {
        let netlist = &mut self.netlist;
        let joined = parts.into_iter().reduce(|one, other| netlist.cell(operation, &[one, other], 1));
        joined.unwrap_or_else(|| self.constant(u64::from(operation == Operation::And), 1))
    }

    /// Returns `b` where a bit is 1, else `a`.
    fn chosen(&mut self, select: Net, a: &[Bit], b: &[Bit]) -> Result<Vec<Net>, Unfit> {
        let parts = a.chunks(MOST).zip(b.chunks(MOST));
        let choice = |(a, b): (&[Bit], &[Bit])| {
            let operands = [select, self.word(a)?, self.word(b)?];
            Ok(self.netlist.cell(Operation::Mux, &operands, a.len() as u8))
        };
        parts.map(choice).collect()
    }

    /// Returns the words of a choice among several, of which at most one is selected.
    fn parallel(&mut self, cell: &RawCell, default: &[Bit], others: &[Bit]) -> Result<Vec<Net>, Unfit> {
        let (select, width) = (cell.port("S"), cell.port("Y").len());
        let mut choices: Vec<_> = select.iter().copied().zip(others.chunks(width)).collect();
        let mut base = default;
        // A choice without a default leaves it unknown. Where one of the others is always selected, that is no matter.
        if default.contains(&Bit::Unknown) && self.is_exhaustive(select) {
            let last = choices.pop().ok_or_else(|| self.unknown(cell.port("Y")))?;
            base = last.1;
        }
        if base.contains(&Bit::Unknown) || others.contains(&Bit::Unknown) {
            return Err(self.unknown(cell.port("Y")));
        }
        let mut made = base.chunks(MOST).map(|bits| self.word(bits)).collect::<Result<Vec<_>, _>>()?;
        for (select, choice) in choices.into_iter().rev() {
            let select = self.word(&[select])?;
            for (net, bits) in made.iter_mut().zip(choice.chunks(MOST)) {
                let word = self.word(bits)?;
                *net = self.netlist.cell(Operation::Mux, &[select, *net, word], bits.len() as u8);
            }
        }
        Ok(made)
    }

    /// Returns whether the selecting bits compare one word with all of its values.
    fn is_exhaustive(&self, select: &[Bit]) -> bool {
        let (mut compared, mut values) = (None, HashSet::new());
        for &bit in select {
            let (word, value) = self.comparison(bit);
            if *compared.get_or_insert(word.clone()) != word {
                return false;
            }
            values.insert(value);
        }
        compared.is_some_and(|word| word.len() < 17 && values.len() == 1 << word.len())
    }

    /// Returns the word and the value for which a bit is 1.
    fn comparison(&self, bit: Bit) -> (Vec<Bit>, u64) {
        let value = |bits: &[Bit]| {
            let is_constant = bits.iter().all(|bit| matches!(bit, Bit::Zero | Bit::One)) && bits.len() <= MOST;
            is_constant.then(|| bits.iter().enumerate().map(|(at, bit)| u64::from(*bit == Bit::One) << at).sum())
        };
        let found = self.driver(bit).filter(|cell| cell.port("Y").first() == Some(&bit)).and_then(|cell| {
            let (a, b) = (cell.port("A"), cell.port("B"));
            match &*cell.kind {
                // Zeros on top are left out of either operand.
                "$eq" if !cell.is_set("A_SIGNED") => value(b)
                    .filter(|value| a.len() >= MOST || value >> a.len() == 0)
                    .map(|value| (a.to_vec(), value))
                    .or_else(|| value(a).map(|value| (b.to_vec(), value)).filter(|_| a.len() <= b.len())),
                "$logic_not" => Some((a.to_vec(), 0)),
                "$not" if a.len() == 1 => Some((a.to_vec(), 0)),
                _ => None,
            }
        });
        found.unwrap_or_else(|| (vec![bit], 1))
    }

    fn shift(&mut self, cell: &RawCell) -> Result<Net, Unfit> {
        let (a, width) = (cell.port("A"), cell.port("Y").len());
        let is_signed = cell.is_set("A_SIGNED");
        let is_part = cell.kind == "$shiftx";
        // An amount with a zero on top has no sign.
        let mut b = cell.port("B");
        let may_be_negative = cell.is_set("B_SIGNED") && b.last() != Some(&Bit::Zero);
        while b.len() > 1 && b.last() == Some(&Bit::Zero) {
            b = &b[..b.len() - 1];
        }
        // A part beyond the end of a word has unknown bits.
        if is_part && (may_be_negative || b.len() >= 32 || (1usize << b.len()) - 1 + width > a.len()) {
            let name = self.module.name(cell.port("Y"));
            return Err(Unfit(format!("`{name}` is a part of a word by an index that may be out of range")));
        }
        let most = width.max(a.len());
        self.narrow(cell, most)?;
        let word = self.word(&resized(a, is_signed && !is_part, most))?;
        self.narrow(cell, b.len())?;
        let amount = self.word(b)?;
        let arithmetic = cell.kind == "$sshr" && is_signed;
        let (left, right) = (Operation::ShiftLeft, Operation::ShiftRight { signed: arithmetic });
        let net = match &*cell.kind {
            "$shl" | "$sshl" => self.netlist.cell(left, &[word, amount], most as u8),
            "$shift" if may_be_negative => {
                let (zero, of) = (self.constant(0, b.len() as u8), b.len() as u8);
                let back = self.netlist.cell(Operation::Sub, &[zero, amount], of);
                let sign = self.slice(amount, of - 1, 1);
                let down = self.netlist.cell(right, &[word, amount], most as u8);
                let up = self.netlist.cell(left, &[word, back], most as u8);
                self.netlist.cell(Operation::Mux, &[sign, down, up], most as u8)
            }
            _ => self.netlist.cell(right, &[word, amount], most as u8),
        };
        Ok(self.slice(net, 0, width as u8))
    }
}

/// Returns a word as one of another width: cut off, or with zeros or copies of its sign on top.
fn resized(bits: &[Bit], is_signed: bool, width: usize) -> Vec<Bit> {
    let sign = bits.last().copied().filter(|_| is_signed).unwrap_or(Bit::Zero);
    let mut bits: Vec<_> = bits.iter().copied().take(width).collect();
    bits.resize(width, sign);
    bits
}
