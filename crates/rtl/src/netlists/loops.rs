//! Finds loops of logic, which keep state as a latch does.
//!
//! A word may be made of its own other bits, as in a decoder of Gray code: so the bits are followed, not the words.

use std::collections::{HashMap, HashSet};

use super::cells::{Bit, Cell, Module, plain};

/// Returns why a module's logic keeps state: the name of a net that is made of itself through no register, and the
/// types of the cells on the way. `is_logic` tells which cells pass their inputs on at once.
pub(crate) fn of_logic(module: &Module, is_logic: impl Fn(&Cell) -> bool) -> Option<String> {
    let mut drivers = HashMap::new();
    for cell in module.cells.values().filter(|cell| is_logic(cell)) {
        for port in &cell.outputs {
            for (index, bit) in cell.bits(port).iter().enumerate() {
                if let Bit::Net(net) = *bit {
                    drivers.insert(net, (cell, index));
                }
            }
        }
    }
    let mut done = HashSet::new();
    let mut begun = HashSet::new();
    for &first in drivers.keys() {
        let mut path = vec![(first, None)];
        while let Some((net, rest)) = path.last_mut() {
            let net = *net;
            if rest.is_none() {
                if done.contains(&net) {
                    path.pop();
                    continue;
                }
                begun.insert(net);
                let made: Vec<_> = drivers.get(&net).map_or(Vec::new(), |(cell, index)| made_of(cell, *index));
                *rest = Some(made);
            }
            match rest.as_mut().and_then(Vec::pop) {
                Some(next) if begun.contains(&next) && !done.contains(&next) => {
                    let from = path.iter().position(|(net, _)| *net == next).unwrap_or(0);
                    let mut kinds: Vec<_> = path[from..].iter().map(|(net, _)| &*drivers[net].0.module).collect();
                    kinds.sort_unstable();
                    kinds.dedup();
                    let nets = path[from..].iter().filter_map(|(net, _)| named(module, *net));
                    let name = nets.min_by_key(|name| (name.len(), name.to_string())).unwrap_or("of logic");
                    let kinds = kinds.join(", ");
                    return Some(format!(
                        "net {} is made of itself through logic ({kinds}) and no register, as a latch is",
                        plain(name)
                    ));
                }
                Some(next) if drivers.contains_key(&next) => path.push((next, None)),
                Some(_) => {}
                None => {
                    done.insert(net);
                    path.pop();
                }
            }
        }
    }
    None
}

/// Returns the name in the source of the word that has a net.
fn named(module: &Module, net: u64) -> Option<&str> {
    let has = |bits: &[Bit]| bits.contains(&Bit::Net(net));
    module.nets.iter().find(|(_, bits)| has(bits)).map(|(name, _)| name.as_str())
}

/// Returns the nets of which a bit of a cell's output is made. It may return more than these, never less.
fn made_of(cell: &Cell, index: usize) -> Vec<u64> {
    let [a, b, s] = ["A", "B", "S"].map(|port| cell.bits(port));
    // The bit of a word with its extension.
    let at = |bits: &[Bit], index: usize| bits.get(index).or(bits.last()).copied();
    let below = |bits: &[Bit]| bits[..bits.len().min(index + 1)].to_vec();
    let bits: Vec<Bit> = match &*cell.module {
        "$not" | "$pos" | "$and" | "$or" | "$xor" | "$xnor" => {
            [at(a, index), at(b, index)].into_iter().flatten().collect()
        }
        "$add" | "$sub" | "$neg" => [below(a), below(b)].concat(),
        "$mux" => [at(a, index), at(b, index)].into_iter().flatten().chain(s.iter().copied()).collect(),
        "$pmux" if !a.is_empty() => {
            let choices = b.iter().skip(index).step_by(a.len());
            at(a, index).into_iter().chain(choices.copied()).chain(s.iter().copied()).collect()
        }
        "$tribuf" => at(a, index).into_iter().chain(cell.bits("EN").iter().copied()).collect(),
        "$shl" | "$sshl" | "$shr" | "$sshr" if constant(b).is_some() => {
            let by = constant(b).unwrap_or(0);
            match &*cell.module {
                "$shl" | "$sshl" => index.checked_sub(by).and_then(|index| at(a, index)).into_iter().collect(),
                // Beside a word without a sign come zeros.
                _ => {
                    let from = index.checked_add(by).filter(|from| *from < a.len() || cell.is_set("A_SIGNED", 0));
                    from.and_then(|from| at(a, from)).into_iter().collect()
                }
            }
        }
        _ => cell.ins().collect(),
    };
    bits.into_iter().filter_map(|bit| if let Bit::Net(net) = bit { Some(net) } else { None }).collect()
}

/// Returns the number that a word is, if all its bits are constant.
fn constant(bits: &[Bit]) -> Option<usize> {
    bits.iter().rev().try_fold(0_usize, |number, bit| match bit {
        Bit::Constant('0') => number.checked_mul(2),
        Bit::Constant('1') => number.checked_mul(2)?.checked_add(1),
        _ => None,
    })
}
