//! The clocks of registers in Verilog, from Verilator's XML of a design.

use std::collections::{BTreeMap, BTreeSet};

use super::declared::attribute;

/// A module: what it tells about the clocks of its registers.
#[derive(Default)]
struct Module<'x> {
    inputs: BTreeSet<&'x str>,
    /// Signals whose edges clock a register here.
    clocks: BTreeSet<&'x str>,
    /// Ports of instances: the instance's module, the port, and the signals that it is connected to.
    ports: Vec<(&'x str, &'x str, Vec<&'x str>)>,
}

/// Returns a signal that clocks a register and is no input of the whole design, such as a clock that a register
/// divides; `None` if there is none. An edge that only resets a register does not count: its signal is read beside it.
pub(super) fn derived(xml: &str) -> Option<String> {
    let (modules, top) = modules(xml);
    let mut left: Vec<_> =
        modules.iter().flat_map(|(name, module)| module.clocks.iter().map(|clock| (*name, *clock))).collect();
    let mut seen: BTreeSet<_> = left.iter().copied().collect();
    while let Some((name, clock)) = left.pop() {
        if !modules[name].inputs.contains(clock) {
            return Some(clock.to_string());
        }
        let instances = modules.iter().filter(|_| Some(name) != top).flat_map(|(parent, module)| {
            let ports = module.ports.iter().filter(|(of, port, _)| (*of, *port) == (name, clock));
            ports.flat_map(|(.., nets)| nets.iter().map(|net| (*parent, *net)))
        });
        left.extend(instances.filter(|above| seen.insert(*above)).collect::<Vec<_>>());
    }
    None
}

/// Reads the modules, and which one is the top.
fn modules(xml: &str) -> (BTreeMap<&str, Module<'_>>, Option<&str>) {
    let (mut modules, mut top, mut open) = (BTreeMap::<_, Module>::new(), None, None);
    // The edges of the process that is open, and what it reads or assigns.
    let (mut edges, mut words, mut is_edge) = (Vec::new(), BTreeSet::new(), false);
    let (mut instance, mut port) = (None, None);
    for line in xml.lines().map(str::trim_start) {
        let tag = line.trim_start_matches('<').split([' ', '>']).next().unwrap_or_default();
        let get = |name: &str| attribute(line, name);
        if tag == "module" {
            open = get("name");
            top = top.or(open.filter(|_| get("topModule").is_some()));
        }
        let Some(module) = open.map(|name| modules.entry(name).or_default()) else { continue };
        match tag {
            "/module" => open = None,
            "var" if get("dir") == Some("input") => module.inputs.extend(get("name")),
            "instance" => instance = get("defName"),
            "port" => port = instance.zip(get("name")).map(|(of, name)| (of, name, Vec::new())),
            "/port" => module.ports.extend(port.take()),
            "always" => (edges, words) = (Vec::new(), BTreeSet::new()),
            "senitem" => is_edge = get("edgeType").is_some_and(|kind| ["POS", "NEG", "BOTH"].contains(&kind)),
            "/senitem" => is_edge = false,
            "varref" => {
                let Some(name) = get("name") else { continue };
                match (&mut port, is_edge) {
                    (Some((.., nets)), _) => nets.push(name),
                    (None, true) => edges.push(name),
                    (None, false) => drop(words.insert(name)),
                }
            }
            "/always" => {
                let is_alone = edges.len() == 1;
                module.clocks.extend(edges.drain(..).filter(|edge| is_alone || !words.contains(edge)));
            }
            _ => {}
        }
    }
    (modules, top)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A module with a register clocked by `edges`, which reads `reads`, and with an instance.
    fn module(name: &str, is_top: bool, edges: &[&str], reads: &str, instance: Option<(&str, &str)>) -> String {
        let top = if is_top { " topModule=\"1\"" } else { "" };
        let edges: String = edges
            .iter()
            .map(|edge| format!("<senitem edgeType=\"POS\">\n<varref name=\"{edge}\"/>\n</senitem>\n"))
            .collect();
        let instance = instance.map_or(String::new(), |(of, net)| {
            format!(
                "<instance name=\"i\" defName=\"{of}\">\n<port name=\"clk\">\n<varref \
                 name=\"{net}\"/>\n</port>\n</instance>\n"
            )
        });
        format!(
            "<module name=\"{name}\"{top}>\n<var name=\"clk\" dir=\"input\"/>\n<var \
             name=\"half\"/>\n<always>\n{edges}<varref name=\"{reads}\"/>\n</always>\n{instance}</module>\n"
        )
    }

    #[test]
    fn a_clock_is_derived_where_it_is_no_input_of_the_top() {
        let leaf = module("leaf", false, &["clk"], "d", None);
        let of = |top: String| derived(&(top + &leaf));
        assert_eq!(of(module("top", true, &["clk"], "d", Some(("leaf", "clk")))), None);
        assert_eq!(of(module("top", true, &["clk"], "d", Some(("leaf", "half")))).as_deref(), Some("half"));
        assert_eq!(of(module("top", true, &["half"], "d", None)).as_deref(), Some("half"));
        // A signal that resets is read where it resets; with one edge, what is read as well is a clock all the same.
        assert_eq!(of(module("top", true, &["clk", "half"], "half", None)), None);
        assert_eq!(of(module("top", true, &["half"], "half", None)).as_deref(), Some("half"));
    }
}
