//! A wiring's blocks with their equations, in the order in which they settle.

use hpu_cosim::LawConfig;
use hpu_cosim::law::{AnyLaw, SampledLaw};
use hpu_datapath::Instance;

use super::equations::{Equation, Side, generic};

/// Where a block's input comes from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Source {
    /// A net.
    Net(usize),
    /// A constant.
    Tied(f64),
}

impl Source {
    pub fn of(self, nets: &[f64]) -> f64 {
        match self {
            Self::Net(net) => nets[net],
            Self::Tied(value) => value,
        }
    }
}

/// When a register loads.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Countdown {
    /// The next edge at which it does.
    pub next: u64,
    /// Edges from one to the next.
    pub period: Source,
    /// Whether the latest load changed nothing, so that the next ones will not either while nothing else changes.
    pub idle: bool,
}

/// The inputs of a PHANToM's engine, the block that has most of them.
const MOST_INPUTS: usize = 17;

/// A block with its equation.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Part {
    pub equation: Equation,
    pub inputs: Vec<Source>,
    pub outputs: Vec<usize>,
    /// The nets whose words are made of what it computes: the outputs, unless they come later.
    pub told: Vec<usize>,
    /// None of a combinational block.
    pub clock: Option<Countdown>,
    /// What it remembers, on either side.
    memory: [f64; 2],
}

impl Part {
    /// The outputs on one side, from the nets on it.
    pub fn eval(&mut self, side: Side, nets: &[f64], out: &mut Vec<f64>) {
        let mut input = [0.0; MOST_INPUTS];
        input.iter_mut().zip(&self.inputs).for_each(|(value, source)| *value = source.of(nets));
        out.clear();
        out.extend(self.outputs.iter().map(|&net| nets[net]));
        self.equation.eval(side, &input[..self.inputs.len()], &mut self.memory[side as usize], out);
    }

    /// What it remembers of the law.
    pub fn remembers(&self) -> f64 {
        self.memory[Side::Law as usize]
    }
}

/// A method's law in floats, which makes a torque of the position once a sample.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Method {
    config: LawConfig,
    law: AnyLaw,
    /// Nets of the position, stiffness, scale and period.
    inputs: [usize; 4],
    /// The net of the torque that it makes.
    pub torque: usize,
    /// The next edge at which it samples.
    pub next: u64,
    /// Edges from a sample to the torque.
    latency: u64,
    /// A torque that is being computed: the edge at which it comes, and it.
    coming: Option<(u64, f64)>,
    /// Torque of one word.
    quantum: f64,
}

impl Method {
    /// The next edge at which anything happens here.
    pub fn due(&self) -> u64 {
        self.coming.map_or(self.next, |(edge, _)| edge.min(self.next))
    }

    fn position_m(&self, nets: &[f64]) -> f64 {
        (nets[self.inputs[0]] - self.config.surface as f64) * self.config.count_m
    }

    /// What happens at the edge that is due; the torque that shows from then on, if it changes.
    ///
    /// `nets` are as the law has them, `values` as the words have them, of which the law reads how far a ramp has come.
    pub fn load(&mut self, nets: &[f64], values: &[f64]) -> Option<f64> {
        let edge = self.due();
        if self.next == edge {
            let share = |net: usize, start: f64| if start == 0.0 { 1.0 } else { values[net] / start };
            let [stiffness, scale] = [(0, 0), (1, 2)].map(|(index, format): (usize, usize)| {
                share(self.inputs[1 + index], self.config.formats[format].to_f64(self.config.start[index]))
            });
            self.law.vary(&self.config.law, stiffness, scale);
            let force_n = self.law.sample(self.position_m(nets));
            self.coming = Some((edge + self.latency, force_n / self.quantum));
            self.next += nets[self.inputs[3]].max(1.0) as u64;
        }
        let come = self.coming.filter(|(due, _)| *due == edge);
        come.map(|(_, torque)| {
            self.coming = None;
            torque
        })
    }

    /// The torque of a spring that follows every count.
    pub fn live(&self, nets: &[f64]) -> Option<f64> {
        match &self.law {
            AnyLaw::Wall(wall) if self.config.live => Some(wall.force_n(self.position_m(nets)) / self.quantum),
            _ => None,
        }
    }
}

/// The blocks of a wiring.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Parts {
    pub parts: Vec<Part>,
    /// Nets of the wiring, and of the law, which has wires of its own beside.
    pub nets: [usize; 2],
    /// Nets that count round and round.
    pub counters: Vec<usize>,
    pub method: Option<Method>,
}

impl Parts {
    /// Those with equations. `law` is that of a method, with the edges it takes.
    pub fn new(nets: usize, instances: &[Instance], law: Option<(LawConfig, u64)>) -> Self {
        let mut all = Self { nets: [nets; 2], ..Self::default() };
        for instance in instances {
            all.add(instance, law.as_ref());
        }
        all
    }

    fn add(&mut self, instance: &Instance, law: Option<&(LawConfig, u64)>) {
        let block = &*instance.model;
        let input = |name: &str| {
            let tied =
                || instance.tied.iter().find(|(port, _)| *port == name).map(|(_, word)| Source::Tied(*word as f64));
            let net = instance.connections.iter().find(|connection| connection.port.name == name);
            net.map(|connection| Source::Net(connection.net)).or_else(tied).unwrap_or(Source::Tied(0.0))
        };
        let net = |name: &str| instance.connections.iter().find(|c| c.port.name == name).map_or(usize::MAX, |c| c.net);
        let part = |equation, inputs, outputs: &[&str]| Part {
            equation,
            inputs,
            outputs: outputs.iter().map(|name| net(name)).collect(),
            told: outputs.iter().map(|name| net(name)).collect(),
            clock: None,
            memory: [0.0; 2],
        };
        match block.name() {
            "position_counter" => self.counters.push(net("position")),
            "axis_front" => {
                self.counters.push(net("position"));
                let modulus = generic(block, "WIDTH").exp2();
                let offset = vec![Source::Net(net("position")), input("reference")];
                self.parts.push(part(Equation::Displacement(modulus), offset, &["delta"]));
                let delta = vec![Source::Net(net("delta"))];
                self.parts.push(part(Equation::Unilateral, delta, &["contact", "penetration"]));
            }
            "command_limiter" if generic(block, "SETTLING") > 0.0 => {
                let limit = part(Equation::Limit(generic(block, "LIMIT")), vec![input("value")], &["limited"]);
                // The limiter's own wire, then a row of registers to the net.
                let settling = generic(block, "SETTLING") as usize;
                let wires: Vec<usize> = (self.nets[1]..self.nets[1] + settling).chain([net("limited")]).collect();
                self.nets[1] += settling;
                let late = wires.windows(2).map(|pair| Part {
                    equation: Equation::Copy,
                    inputs: vec![Source::Net(pair[0])],
                    outputs: vec![pair[1]],
                    told: Vec::new(),
                    clock: Some(Countdown { next: 1, period: Source::Tied(1.0), idle: false }),
                    memory: [0.0; 2],
                });
                self.parts.push(Part { outputs: vec![wires[0]], ..limit });
                self.parts.extend(late);
            }
            // A disabled shaper passes the torque on; the law in floats has its own.
            "input_shaper" if generic(block, "ENABLED") == 0.0 => {
                self.parts.push(part(Equation::Copy, vec![input("torque")], &["shaped"]));
            }
            "input_shaper" => {
                if let Some(method) = &mut self.method {
                    method.torque = net("shaped");
                }
            }
            _ => match Equation::of(block) {
                Some(equation) => {
                    let names = |signals: Vec<hpu_signal::Signal>| signals.into_iter().map(|signal| signal.name);
                    let inputs = names(block.inputs()).filter(|name| *name != "period").map(input).collect();
                    let outputs: Vec<_> = names(block.outputs()).filter(|name| *name != "valid").collect();
                    let mut new = part(equation, inputs, &outputs);
                    if block.clocked() && block.name() != "command_limiter" {
                        let (first, period) = match block.name() {
                            "trig_table" => (1, Source::Tied(1.0)),
                            "command_register" => (1 + generic(block, "DELAY") as u64, input("period")),
                            // The inputs stand still while the engine computes.
                            "phantom_engine" => {
                                let latency = hpu_datapath::phantom::phantom_engine::LATENCY;
                                (1 + latency + generic(block, "DELAY") as u64, input("period"))
                            }
                            _ => (1, input("period")),
                        };
                        new.clock = Some(Countdown { next: first, period, idle: false });
                    }
                    self.parts.push(new);
                }
                None => {
                    if let (Some((config, latency)), true) = (law, instance.label == "law") {
                        self.method = Some(Method {
                            law: config.law.clone(),
                            quantum: config.full_scale_n - config.limit_n,
                            config: config.clone(),
                            inputs: ["position", "stiffness", "scale", "period"].map(net),
                            torque: net("torque"),
                            next: 1,
                            latency: *latency,
                            coming: None,
                        });
                    }
                }
            },
        }
    }
}
