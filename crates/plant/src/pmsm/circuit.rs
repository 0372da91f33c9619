//! The circuit of winding and inverter between two switchings: which path each terminal has, and what follows.

use super::{Inverter, Pmsm};
use crate::Leg;

/// A vector in the stator's frame.
pub(super) type Plane = [f64; 2];

const HALF_ROOT_3: f64 = 0.866_025_403_784_438_6;
/// The share of the supply by which an open terminal leaves its range before a diode opens. Where both choices are
/// right, as at a rotor at rest with diodes without a drop, rounding must not open and close a diode in turns.
const SLACK: f64 = 1.0 / (1u64 << 44) as f64;
/// Directions of the phases.
pub(super) const PHASES: [Plane; 3] = [[1.0, 0.0], [-0.5, HALF_ROOT_3], [-0.5, -HALF_ROOT_3]];

#[inline(always)]
pub(super) fn dot(a: Plane, b: Plane) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The path between a terminal and the supply.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Path {
    /// The switch to the supply.
    High,
    /// The switch to ground.
    Low,
    /// The diode to the supply: current flows into the leg.
    Upper,
    /// The diode to ground: current flows out of the leg.
    Lower,
    /// None.
    Floating,
    /// A mean of both switches.
    Mean,
}

/// The currents that a circuit allows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Freedom {
    /// All that sum to 0.
    Plane,
    /// Those along this direction: one phase floats.
    Line(Plane),
    /// None: two phases or more float.
    None,
}

impl Freedom {
    /// Returns the currents that phases allow of which these carry none.
    pub fn of(resting: [bool; 3]) -> Self {
        match resting {
            [false, false, false] => Self::Plane,
            [true, false, false] => Self::along(0),
            [false, true, false] => Self::along(1),
            [false, false, true] => Self::along(2),
            _ => Self::None,
        }
    }

    fn along(resting: usize) -> Self {
        let [u, v] = PHASES[resting];
        Self::Line([-v, u])
    }

    /// Returns the part of a current that is allowed.
    pub fn part(self, i: Plane) -> Plane {
        match self {
            Self::Plane => i,
            Self::Line(w) => w.map(|share| share * dot(w, i)),
            Self::None => [0.0; 2],
        }
    }
}

/// `constant + current · i + flux_rate · dλ/dt`: a voltage or a current in a circuit.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Affine {
    pub constant: f64,
    pub current: Plane,
    pub flux_rate: Plane,
}

impl Affine {
    /// Returns `a + share b`.
    fn plus(&self, share: f64, b: &Self) -> Self {
        let sum = |a: Plane, b: Plane| [a[0] + share * b[0], a[1] + share * b[1]];
        Self {
            constant: self.constant + share * b.constant,
            current: sum(self.current, b.current),
            flux_rate: sum(self.flux_rate, b.flux_rate),
        }
    }

    fn raised(&self, by: f64) -> Self {
        Self { constant: self.constant + by, ..*self }
    }

    /// Returns the value at a current and a rate of the flux linkage.
    pub fn at(&self, current: Plane, flux_rate: Plane) -> f64 {
        self.constant + dot(self.current, current) + dot(self.flux_rate, flux_rate)
    }
}

/// The reason why a circuit ends.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Change {
    /// The current of this phase reaches 0.
    Zero(usize),
    /// The diode of this floating phase begins to conduct.
    Opens(usize, Path),
    /// The upper diode of the first phase and the lower one of the second begin to conduct.
    Both(usize, usize),
}

/// The circuit as linear equations in the stator's frame.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Circuit {
    pub paths: [Path; 3],
    pub freedom: Freedom,
    /// Voltage without current.
    pub volts: Plane,
    /// Resistance of winding, switches and supply: `αα`, `αβ`, `ββ`.
    pub ohms: [f64; 3],
    /// The current out of the supply is this times the current.
    pub rail: Plane,
    /// The current through diodes is this times the current.
    pub diodes: Plane,
    /// Voltages of the terminals.
    pub terminals: [Affine; 3],
    /// Conditions that stay positive while the circuit lasts, each with the change that ends it.
    pub checks: Vec<(Affine, Change)>,
}

impl Circuit {
    /// Returns the circuit of these paths.
    fn of(laws: &Pmsm, paths: [Path; 3]) -> Self {
        let inverter = &laws.inverter;
        let shares = paths.map(|path| f64::from(u8::from(matches!(path, Path::High | Path::Upper))));
        let switches = paths.map(|path| f64::from(u8::from(matches!(path, Path::High | Path::Low))));
        let drops = paths.map(|path| match path {
            Path::Upper => inverter.diode_drop_v,
            Path::Lower => -inverter.diode_drop_v,
            _ => 0.0,
        });
        let mut circuit = Self::linear(laws, paths, shares, switches, drops);
        let floating = (0..3).filter(|&x| paths[x] == Path::Floating);
        let connected = || (0..3).filter(|&x| paths[x] != Path::Floating);
        for x in floating {
            let [u, v] = PHASES[x];
            let mut terminal = Affine { flux_rate: [u, v], ..Affine::default() };
            match connected().count() {
                2 => {
                    terminal.flux_rate = [1.5 * u, 1.5 * v];
                    for y in connected() {
                        terminal = terminal.plus(0.5, &circuit.terminals[y]);
                    }
                }
                1 => {
                    let y = connected().next().unwrap_or(x);
                    let back = Affine { flux_rate: PHASES[y], ..Affine::default() };
                    terminal = terminal.plus(-1.0, &back).plus(1.0, &circuit.terminals[y]);
                }
                _ => terminal.constant = 0.5 * inverter.supply_v,
            }
            circuit.terminals[x] = terminal;
        }
        circuit.freedom = Freedom::of(paths.map(|path| path == Path::Floating));
        circuit.list(laws);
        circuit
    }

    /// Returns the circuit with mean voltages as shares of the rail.
    pub fn averaged(laws: &Pmsm, shares: [f64; 3]) -> Self {
        Self::linear(laws, [Path::Mean; 3], shares, [1.0; 3], [0.0; 3])
    }

    fn linear(laws: &Pmsm, paths: [Path; 3], shares: [f64; 3], switches: [f64; 3], drops: [f64; 3]) -> Self {
        let Inverter { supply_v, supply_ohm, on_resistance_ohm, .. } = laws.inverter;
        let sum = |of: &dyn Fn(usize) -> f64| -> Plane {
            let [a, b, c] = [0, 1, 2].map(of);
            // The directions written out: two phases alike cancel without rounding.
            [a - 0.5 * (b + c), HALF_ROOT_3 * (b - c)]
        };
        let rail = sum(&|x| shares[x]);
        let volts = sum(&|x| shares[x] * supply_v + drops[x]).map(|v| v * (2.0 / 3.0));
        let diodes = sum(&|x| if drops[x] == 0.0 { 0.0 } else { -drops[x].signum() });
        let r = laws.motor.resistance_ohm;
        let mut ohms = [r, 0.0, r];
        let mut add = |ohm: f64, [u, v]: Plane| {
            let ohm = ohm * (2.0 / 3.0);
            ohms = [ohms[0] + ohm * u * u, ohms[1] + ohm * u * v, ohms[2] + ohm * v * v];
        };
        add(supply_ohm, rail);
        (0..3).for_each(|x| add(switches[x] * on_resistance_ohm, PHASES[x]));
        let terminals = std::array::from_fn(|x| {
            let (drop, [u, v]) = (switches[x] * on_resistance_ohm, PHASES[x]);
            let back = shares[x] * supply_ohm;
            Affine {
                constant: shares[x] * supply_v + drops[x],
                current: [-back * rail[0] - drop * u, -back * rail[1] - drop * v],
                flux_rate: [0.0; 2],
            }
        });
        Self { paths, freedom: Freedom::Plane, volts, ohms, rail, diodes, terminals, checks: Vec::new() }
    }

    /// Returns the resistive voltage of a current.
    #[inline(always)]
    pub fn resistive(&self, i: Plane) -> Plane {
        let [aa, ab, bb] = self.ohms;
        [aa * i[0] + ab * i[1], ab * i[0] + bb * i[1]]
    }

    /// Returns the matrix (`αα`, `αβ`, `ββ`) from a flux linkage to the current that adds it, at a rotor's direction.
    #[inline(always)]
    pub fn gain(&self, laws: &Pmsm, e: Plane) -> [f64; 3] {
        let (d, q) = (laws.motor.direct_h, laws.motor.quadrature_h);
        match self.freedom {
            Freedom::Plane => {
                let (across, along) = (1.0 / q, (d - q) / (d * q));
                [across - along * e[0] * e[0], -along * e[0] * e[1], across - along * e[1] * e[1]]
            }
            Freedom::Line(w) => {
                let along = dot(e, w);
                let gain = 1.0 / (q + (d - q) * along * along);
                [gain * w[0] * w[0], gain * w[0] * w[1], gain * w[1] * w[1]]
            }
            Freedom::None => [0.0; 3],
        }
    }

    /// Returns the rates of current and flux linkage where the rotor has direction `e`, which changes by `turning`.
    pub fn rates(&self, laws: &Pmsm, i: Plane, e: Plane, turning: Plane) -> (Plane, Plane) {
        let (d, q) = (laws.motor.direct_h, laws.motor.quadrature_h);
        let (salience, r) = (d - q, self.resistive(i));
        let along = dot(e, i);
        let active = laws.motor.flux_vs + salience * along;
        let known = salience * dot(turning, i);
        let rest: Plane = std::array::from_fn(|a| self.volts[a] - r[a] - active * turning[a] - known * e[a]);
        let [aa, ab, bb] = self.gain(laws, e);
        let rate = [aa * rest[0] + ab * rest[1], ab * rest[0] + bb * rest[1]];
        let bent = salience * dot(e, rate) + known;
        (rate, std::array::from_fn(|a| q * rate[a] + active * turning[a] + bent * e[a]))
    }

    /// Returns the currents of the phases.
    #[inline(always)]
    pub fn phases(&self, i: Plane) -> [f64; 3] {
        let [a, b, c] = PHASES.map(|u| dot(u, i));
        match self.paths {
            _ if self.freedom == Freedom::None => [0.0; 3],
            [Path::Floating, ..] => [0.0, b, -b],
            [_, Path::Floating, _] => [a, 0.0, -a],
            [.., Path::Floating] => [a, -a, 0.0],
            _ => [a, b, c],
        }
    }

    /// Lists what stays positive while the circuit lasts.
    fn list(&mut self, laws: &Pmsm) {
        let Inverter { supply_v, supply_ohm, diode_drop_v, .. } = laws.inverter;
        let slack_v = SLACK * (supply_v + diode_drop_v);
        let mut checks = Vec::new();
        let mut push = |check: Affine, change: Change| checks.push((check, change));
        let rail = Affine { constant: supply_v, current: self.rail.map(|h| -supply_ohm * h), ..Affine::default() };
        if self.paths == [Path::Floating; 3] {
            for (x, y) in [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)] {
                let apart = self.terminals[y].plus(-1.0, &self.terminals[x]);
                push(apart.raised(supply_v + 2.0 * diode_drop_v + slack_v), Change::Both(x, y));
            }
            self.checks = checks;
            return;
        }
        for (x, path) in self.paths.iter().enumerate() {
            let ([u, v], terminal) = (PHASES[x], &self.terminals[x]);
            match path {
                Path::Lower => push(Affine { current: [u, v], ..Affine::default() }, Change::Zero(x)),
                Path::Upper => push(Affine { current: [-u, -v], ..Affine::default() }, Change::Zero(x)),
                Path::Floating => {
                    push(terminal.raised(diode_drop_v + slack_v), Change::Opens(x, Path::Lower));
                    push(rail.plus(-1.0, terminal).raised(diode_drop_v + slack_v), Change::Opens(x, Path::Upper));
                }
                _ => {}
            }
        }
        self.checks = checks;
    }
}

impl Pmsm {
    /// Returns the circuit of these paths, none of which is a mean.
    fn circuit(&self, paths: [Path; 3]) -> &Circuit {
        let [a, b, c] = paths.map(|path| path as usize);
        self.circuits[(a * 5 + b) * 5 + c].get_or_init(|| Circuit::of(self, paths))
    }
}

/// Returns the circuit of these legs where the current is `i` and the rotor has direction `e`, which changes by
/// `turning`. Phases that are `resting` carry no current; `begins` is what begins here.
pub(super) fn settled(
    laws: &Pmsm,
    legs: [Leg; 3],
    (i, resting): (Plane, [bool; 3]),
    (e, turning): (Plane, Plane),
    begins: Option<Change>,
) -> &Circuit {
    let mut paths = [Path::Floating; 3];
    let mut chosen = [true; 3];
    for x in 0..3 {
        let current = dot(PHASES[x], i);
        paths[x] = match legs[x] {
            Leg::High => Path::High,
            Leg::Low => Path::Low,
            Leg::Open if resting[x] || current == 0.0 => {
                chosen[x] = false;
                Path::Floating
            }
            Leg::Open if current > 0.0 => Path::Lower,
            Leg::Open => Path::Upper,
        };
    }
    match begins {
        Some(Change::Opens(x, path)) => (paths[x], chosen[x]) = (path, true),
        Some(Change::Both(x, y)) => {
            (paths[x], paths[y]) = (Path::Upper, Path::Lower);
            (chosen[x], chosen[y]) = (true, true);
        }
        _ => {}
    }
    if chosen == [true; 3] {
        return laws.circuit(paths);
    }
    // All choices for the phases without current; the equations have one solution, up to rounding.
    let mut best: Option<(f64, &Circuit)> = None;
    // A chosen phase has the first of its picks alone.
    let picks = chosen.map(|is_chosen| if is_chosen { 1 } else { 3 });
    for choice in 0..picks[0] * picks[1] * picks[2] {
        let mut tried = paths;
        let picked = [choice % picks[0], choice / picks[0] % picks[1], choice / (picks[0] * picks[1])];
        for x in (0..3).filter(|&x| !chosen[x]) {
            tried[x] = [Path::Floating, Path::Lower, Path::Upper][picked[x]];
        }
        let floating = tried.iter().filter(|path| **path == Path::Floating).count();
        if floating == 2 && !tried.iter().any(|path| matches!(path, Path::High | Path::Low)) {
            continue;
        }
        let circuit = laws.circuit(tried);
        let (rate, flux_rate) = circuit.rates(laws, circuit.freedom.part(i), e, turning);
        let mut worst = f64::INFINITY;
        for (check, change) in &circuit.checks {
            worst = worst.min(match *change {
                Change::Zero(x) if chosen[x] => continue,
                // A current that begins must grow; its rate times the inductance is a voltage.
                Change::Zero(_) => check.at(rate, [0.0; 2]) * laws.motor.quadrature_h,
                _ => check.at(circuit.freedom.part(i), flux_rate),
            });
        }
        if worst >= 0.0 {
            return circuit;
        }
        if best.as_ref().is_none_or(|(before, _)| worst > *before) {
            best = Some((worst, circuit));
        }
    }
    best.map_or_else(|| laws.circuit(paths), |(_, circuit)| circuit)
}
