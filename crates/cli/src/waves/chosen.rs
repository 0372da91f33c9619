//! The nets and the stretch of time that a waveform shows.

use std::ops::Range;

use hpu_cosim::dut::Inside;
use hpu_cosim::{AnySimulation, Simulation, Wired, did_you_mean};

use crate::shell::{Failure, values};
use crate::units::si;

/// The pattern of all ports.
const PORTS: &str = "ports";
/// The most names that a message lists.
const LISTED: usize = 12;

/// Which nets a waveform shows, and when
#[derive(Clone, Default, Debug, clap::Args)]
pub struct Chosen {
    /// Nets of the waveforms, by instance path: ports (all ports), u_loop (an instance with all below), 'u_loop/*_r'
    /// (`*` and `?` stand for letters of one name); other nets are not even asked for [default: all]
    #[arg(long, value_name = "PATH", num_args = 1.., requires = "out")]
    wave: Vec<String>,
    /// Levels of instances below the one that --wave names: 1 for its own nets alone [default: all]
    #[arg(long, value_name = "N", requires = "wave", value_parser = clap::value_parser!(u64).range(1..))]
    depth: Option<u64>,
    /// Begin the waveforms at this time of the run, as in 1ms [default: 0s]
    #[arg(long, value_name = "TIME", requires = "out", value_parser = values::instant)]
    from: Option<f64>,
    /// End the waveforms at this time of the run [default: its end]
    #[arg(long, value_name = "TIME", requires = "out", value_parser = values::instant)]
    to: Option<f64>,
}

impl Chosen {
    /// Returns whether the nets are chosen by name.
    pub fn is_by_name(&self) -> bool {
        !self.wave.is_empty()
    }

    /// Returns the parts of a pattern's path below the top.
    fn parts<'p>(pattern: &'p str, top: &str) -> Vec<&'p str> {
        let parts: Vec<_> = pattern.split(['/', '.']).filter(|part| !part.is_empty()).collect();
        match parts.split_first() {
            Some((first, below)) if !below.is_empty() && first.eq_ignore_ascii_case(top) => below.to_vec(),
            _ => parts,
        }
    }

    /// Returns whether a pattern takes the net at a path below the top.
    fn takes(&self, pattern: &str, top: &str, path: &str, is_port: bool) -> bool {
        if pattern == PORTS {
            return is_port;
        }
        let (parts, path) = (Self::parts(pattern, top), path.split('.').collect::<Vec<_>>());
        let is_all = parts.last() == Some(&"*");
        // The instance is the one before a last `*`, or the one that the whole pattern names.
        let levels = (path.len() + usize::from(is_all)).checked_sub(parts.len());
        let is_near = levels.is_some_and(|levels| self.depth.is_none_or(|depth| levels as u64 <= depth));
        is_near && parts.len() <= path.len() && parts.iter().zip(path).all(|(part, name)| fits(part, name))
    }

    /// Returns whether a waveform shows the net at a path below the top.
    pub fn shows(&self, top: &str, path: &str, is_port: bool) -> bool {
        !self.is_by_name() || self.wave.iter().any(|pattern| self.takes(pattern, top, path, is_port))
    }

    /// Returns the signals inside a design of this name that its run has to show. `takes` is the function that chooses
    /// them.
    pub fn inside<'a>(&self, takes: &'a dyn Fn(&str) -> bool) -> Inside<'a> {
        match &self.wave[..] {
            [] => Inside::All,
            patterns if patterns.iter().all(|pattern| pattern == PORTS) => Inside::Nothing,
            _ => Inside::Chosen(takes),
        }
    }

    /// Checks that each pattern takes a net of a simulation.
    pub fn agree(&self, simulation: &AnySimulation) -> Result<(), Failure> {
        let (top, names) = (simulation.closed_by(), names(simulation));
        let takes = |pattern: &&String| names.iter().any(|(path, is_port)| self.takes(pattern, top, path, *is_port));
        let Some(pattern) = self.wave.iter().find(|pattern| !takes(pattern)) else { return Ok(()) };
        let near = did_you_mean(
            &Self::parts(pattern, top).join("."),
            &names.iter().map(|(path, _)| path.as_str()).collect::<Vec<_>>(),
        );
        let mut instances: Vec<_> = names.iter().filter_map(|(path, _)| Some(path.rsplit_once('.')?.0)).collect();
        instances.sort_unstable();
        instances.dedup();
        let more = if instances.len() > LISTED { ", ..." } else { "" };
        let there = match (near.as_str(), &instances[..instances.len().min(LISTED)]) {
            ("", []) => format!("; write {PORTS}, or a net of its own"),
            ("", some) => format!("; it has the instances {}{more}", some.join(", ")),
            (near, _) => near.to_string(),
        };
        Err(Failure::usage(format!("--wave {pattern}: `{top}` has no such net{there}")))
    }

    /// Returns the edges of a run that a waveform shows.
    pub fn edges(&self, simulation: &impl Simulation) -> Result<Range<u64>, Failure> {
        let (clock, end) = (simulation.clock(), simulation.edges());
        let edge = |option: &str, time: Option<f64>| match time {
            Some(time_s) if clock.edges(time_s) > end => {
                let end = si(end as f64 * clock.period_s(), "s");
                Err(Failure::usage(format!("{option} {}: the run ends at {end}", si(time_s, "s"))))
            }
            time => Ok(time.map(|time_s| clock.edges(time_s))),
        };
        let (from, to) = (edge("--from", self.from)?.unwrap_or(0), edge("--to", self.to)?);
        match to {
            Some(to) if to <= from => Err(Failure::usage("--to is not after --from; write a later time")),
            None if from >= end && from > 0 => Err(Failure::usage("--from is at the run's end; write an earlier time")),
            // The end of a run is an edge of it.
            to => Ok(from..to.map_or(u64::MAX, |to| to + 1)),
        }
    }
}

/// Returns the paths of all nets of a simulation, below its top, and whether each is a port.
fn names(simulation: &AnySimulation) -> Vec<(String, bool)> {
    match simulation {
        AnySimulation::Dut(design) => {
            let shown = design.wires().iter().map(|wire| &wire.port);
            shown.chain(design.hidden()).map(|port| (port.name.clone(), !port.is_inside)).collect()
        }
        AnySimulation::Ours(ours) => {
            let ports = ours_ports(ours);
            let wiring = ours.wiring();
            let own = wiring.nets().into_iter().map(|net| (net.name.to_string(), ports.contains(&net.name)));
            let inside = wiring.instances().into_iter().flat_map(|instance| {
                let ports = [instance.model.inputs(), instance.model.outputs()].concat();
                ports.into_iter().map(move |port| (format!("{}.{}", instance.label, port.name), false))
            });
            own.chain(inside).collect()
        }
    }
}

/// Returns the names of the inputs and outputs of a loop of ours.
fn ours_ports(ours: &hpu_cosim::WiredSimulation) -> Vec<&'static str> {
    let block = ours.wiring().block();
    [block.inputs(), block.outputs()].concat().into_iter().map(|signal| signal.name).collect()
}

/// Returns a function that tells whether the net at a path is a port of a simulation.
pub fn is_port<'s>(simulation: &'s AnySimulation<'s>) -> Box<dyn Fn(&str) -> bool + 's> {
    match simulation {
        AnySimulation::Dut(design) => {
            Box::new(|path| !design.wires().iter().any(|wire| wire.port.is_inside && wire.port.name == path))
        }
        AnySimulation::Ours(ours) => {
            let ports = ours_ports(ours);
            Box::new(move |path| ports.contains(&path))
        }
    }
}

/// Returns whether a name fits a pattern in which `*` stands for any letters and `?` for one. Capital and small letters
/// are the same.
fn fits(pattern: &str, name: &str) -> bool {
    let (pattern, name) = (pattern.to_ascii_lowercase().into_bytes(), name.to_ascii_lowercase().into_bytes());
    let (mut at, mut of, mut star) = (0, 0, None);
    while of < name.len() {
        match pattern.get(at) {
            Some(b'*') => {
                star = Some((at, of));
                at += 1;
            }
            Some(letter) if *letter == b'?' || *letter == name[of] => (at, of) = (at + 1, of + 1),
            _ => {
                // The last `*` takes one letter more.
                let Some((start, taken)) = star else { return false };
                star = Some((start, taken + 1));
                (at, of) = (start + 1, taken + 1);
            }
        }
    }
    pattern[at..].iter().all(|letter| *letter == b'*')
}

#[cfg(test)]
mod tests {
    use super::{Chosen, fits};

    #[test]
    fn a_star_stands_for_any_letters_of_one_name() {
        for (pattern, name, expected) in [
            ("*", "vel_r", true),
            ("*_r", "vel_r", true),
            ("*_r", "vel_rr", false),
            ("v?l*", "VEL_r", true),
            ("a*b*c", "aXbXbc", true),
            ("a*b*c", "aXcXb", false),
            ("", "a", false),
            ("lane[0]", "lane[0]", true),
        ] {
            assert_eq!(fits(pattern, name), expected, "{pattern} {name}");
        }
    }

    #[test]
    fn a_path_chooses_an_instance_with_all_that_is_below_up_to_a_depth() {
        let all = ["pwm", "state", "u.a", "u.b_r", "u.in.c_r", "v.a"];
        let chosen = |wave: &str, depth: Option<u64>| {
            let chosen = Chosen { wave: vec![wave.to_string()], depth, ..Chosen::default() };
            let shown = all.iter().filter(|path| chosen.shows("top", path, **path == "pwm"));
            shown.copied().collect::<Vec<_>>().join(" ")
        };
        for (wave, depth, expected) in [
            ("ports", None, "pwm"),
            ("*", None, "pwm state u.a u.b_r u.in.c_r v.a"),
            ("*", Some(1), "pwm state"),
            ("u", None, "u.a u.b_r u.in.c_r"),
            ("u/*", Some(1), "u.a u.b_r"),
            ("u", Some(1), "u.a u.b_r"),
            ("u/*", Some(2), "u.a u.b_r u.in.c_r"),
            ("top/u.*_r", None, "u.b_r"),
            ("*/a", None, "u.a v.a"),
            ("u/in", None, "u.in.c_r"),
            ("w", None, ""),
        ] {
            assert_eq!(chosen(wave, depth), expected, "{wave} {depth:?}");
        }
    }
}
