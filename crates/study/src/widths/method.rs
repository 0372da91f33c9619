//! Computes a method's reference law in floats in place of its blocks.

use hpu_cosim::LawConfig;
use hpu_cosim::law::{AnyLaw, SampledLaw};
use hpu_datapath::Instance;

/// A method's law in floats. It computes a torque from the position once a sample.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Method {
    config: LawConfig,
    law: AnyLaw,
    /// Nets of the position, stiffness, scale, period and displacement.
    inputs: [usize; 5],
    /// The nets that show its torque.
    pub torques: Vec<usize>,
    /// The next edge at which it samples.
    pub next: u64,
    /// Clock cycles from a sample to the torque.
    latency: u64,
    /// A torque that is being computed: the edge at which it appears, and its value.
    coming: Option<(u64, f64)>,
    /// The torque of one word.
    quantum: f64,
}

impl Method {
    /// The labels of the blocks that it replaces: the law, and the shaper behind it.
    pub const LABELS: [&str; 2] = ["law", "shaper"];

    /// Makes the law of a wiring; `None` if the wiring has no block of a method's law.
    pub fn of(instances: &[Instance], config: LawConfig, latency: u64) -> Option<Self> {
        let [law, shaper] = Self::LABELS.map(|label| instances.iter().find(|instance| instance.label == label));
        let net = |of: Option<&Instance>, name: &str| {
            of?.connections.iter().find(|connection| connection.port.name == name).map(|connection| connection.net)
        };
        let (torque, shaped) = (net(law, "torque")?, net(shaper, "shaped")?);
        let [position, stiffness, scale, period, delta] =
            ["position", "stiffness", "scale", "period", "delta"].map(|name| net(law, name));
        Some(Self {
            law: config.law.clone(),
            quantum: config.full_scale_n - config.limit_n,
            inputs: [position?, stiffness?, scale?, period?, delta?],
            // With a shaper, the law shows no torque before it.
            torques: if config.is_shaped() { vec![shaped] } else { vec![torque, shaped] },
            config,
            next: 1,
            latency,
            coming: None,
        })
    }

    /// Returns the next edge at which the law samples or its torque changes.
    pub fn due(&self) -> u64 {
        self.coming.map_or(self.next, |(edge, _)| edge.min(self.next))
    }

    fn position_m(&self, nets: &[f64]) -> f64 {
        (nets[self.inputs[0]] - self.config.surface as f64) * self.config.count_m
    }

    /// Samples or shows a torque at the edge that is due. Returns the torque that shows from that edge on, if it
    /// changes.
    ///
    /// `nets` are the values of the law, `values` those of the words. From `values` the law reads how far a ramp or a
    /// target has come.
    pub fn load(&mut self, nets: &[f64], values: &[f64]) -> Option<f64> {
        let edge = self.due();
        if self.next == edge {
            let share = |net: usize, start: f64| if start == 0.0 { 1.0 } else { values[net] / start };
            let shares = [(0, 0), (1, 2)].map(|(index, format): (usize, usize)| {
                share(self.inputs[1 + index], self.config.formats[format].to_f64(self.config.start[index]))
            });
            self.config.vary(&mut self.law, shares);
            // The surface that the words see, which a target moves.
            let seen = values[self.inputs[0]] - values[self.inputs[4]] - self.config.surface as f64;
            self.law.aim(seen * self.config.count_m);
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

    /// Returns the torque of a spring that follows every count.
    pub fn live(&self, nets: &[f64]) -> Option<f64> {
        let force_n = self.config.live.then(|| self.law.live_n(self.position_m(nets))).flatten()?;
        Some(force_n / self.quantum)
    }
}
