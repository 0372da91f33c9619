//! The method loops compared with a straight-line model of their data sheet, compared with ticking while they leap, and
//! the connections of their nets.

use hpu_datapath::{
    Block, BoundingConfig, CouplingConfig, EnergyBounding, Estimator, Generic, Instance, Law, LawIn, LawOut, LawWidths,
    LoopIn, MethodLoop, MethodLoopConfig, PassiveSpring, PassivityConfig, PassivityController, PwmConfig, SampledWall,
    SampledWallConfig, Shaping, SpringConfig, VirtualCoupling, Wiring, flatten,
};
use hpu_signal::{Format, Signal};
use proptest::prelude::*;

use crate::cases::cases;

/// A law of one register that shows the sum of the wall's coordinates as it was an edge ago. It marks the torque as
/// rounded when the sum is odd, and the memory as overflowed when the sum is above 3.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Toy {
    widths: LawWidths,
    sum: i64,
}

impl Toy {
    fn next(input: &LawIn<i64>) -> i64 {
        input.delta + input.contact + input.penetration
    }
}

impl Law for Toy {
    const LOOP: &'static str = "toy_loop";
    fn widths(&self) -> &LawWidths {
        &self.widths
    }
    fn latency(&self) -> u32 {
        1
    }
    fn lost(&self) -> [(bool, bool); 2] {
        [(self.sum % 2 != 0, false), (false, self.sum > 3)]
    }
}

impl Block for Toy {
    const NAME: &'static str = "toy";
    const CLOCKED: bool = true;
    type In<T> = LawIn<T>;
    type Out<T> = LawOut<T>;
    fn inputs(&self) -> LawIn<Signal> {
        self.widths.inputs()
    }
    fn outputs(&self) -> LawOut<Signal> {
        let memory = Signal::new("memory", Format::signed(self.widths.width + 2), "count", "Sum");
        self.widths.outputs(memory)
    }
    fn generics(&self) -> Vec<(&'static str, Generic)> {
        [self.widths.generics(), vec![("OWN", Generic::Integer(7))]].concat()
    }
    fn reset(&mut self) -> LawOut<i64> {
        self.sum = 0;
        LawOut { torque: 0, memory: 0 }
    }
    fn tick(&mut self, input: LawIn<i64>) -> LawOut<i64> {
        self.sum = Self::next(&input);
        LawOut { torque: self.sum % 8, memory: self.sum }
    }
    fn quiet(&self, input: &LawIn<i64>) -> u64 {
        if Self::next(input) == self.sum { u64::MAX } else { 0 }
    }
    fn skip(&mut self, _: u64, _: &LawIn<i64>) {}
}

/// Returns widths that are all different, so that no two formats agree by chance, and so short that all kinds of bits
/// are lost.
fn uneven() -> LawWidths {
    let format = |int, frac| Format::new(false, int, frac).unwrap();
    LawWidths {
        width: 6,
        stiffness: format(3, 2),
        damping: format(2, 1),
        period_width: 9,
        scale: format(3, 1),
        torque_width: 5,
    }
}

fn toy() -> Toy {
    Toy { widths: uneven(), sum: 0 }
}

/// A high-pass filter that answers within a few samples.
const SHAPING: Shaping = Shaping { phase: 5, b: [1 << 29, -1 << 29, 0], a: [-1 << 28, 0] };

fn config(shaping: Option<Shaping>) -> MethodLoopConfig {
    MethodLoopConfig { pwm: PwmConfig { width: uneven().torque_width, ..PwmConfig::default() }, shaping }
}

fn wall(estimator: Estimator, spring_held: bool) -> SampledWall {
    let config = SampledWallConfig { widths: uneven(), estimator, spring_held, velocity_frac: 3, ..Default::default() };
    SampledWall::new(SampledWallConfig { relief: 2, ..config }).unwrap()
}

/// A model of the default loop around a live wall, in plain integers; every register is assigned from the nets before
/// the edge.
struct Model {
    edge: i64,
    /// The pins, the lines and the lines before, each as (a, b).
    stages: [(i64, i64); 3],
    step: i64,
    error: i64,
    position: i64,
    sampled: i64,
    velocity: i64,
    next_sample: i64,
    taken: i64,
    /// `None` if the torque is passed on unchanged; otherwise torque and filter of the latest sample.
    shaper: Option<[i64; 2]>,
    next_shaped: i64,
}

impl Model {
    fn new(shaped: bool) -> Self {
        Self {
            edge: 0,
            stages: [(0, 0); 3],
            step: 0,
            error: 0,
            position: 0,
            sampled: 0,
            velocity: 0,
            next_sample: 0,
            taken: 0,
            shaper: shaped.then_some([0; 2]),
            next_shaped: SHAPING.phase.into(),
        }
    }

    /// Returns `position` and `error`, then the combinational nets.
    fn nets(&self, input: &LoopIn<i64>) -> [i64; 9] {
        let delta = (self.position - input.reference).rem_euclid(64);
        let delta = if delta < 32 { delta } else { delta - 64 };
        let contact = i64::from(delta >= 0);
        let penetration = contact * delta;
        let spring = (penetration * input.stiffness / 4).min(31);
        let drag = contact * (input.damping * self.velocity).div_euclid(2).clamp(-32, 31);
        let relief = (2 * self.velocity).div_euclid(2).clamp(-32, 31);
        let torque = spring + drag - relief;
        let shaped = match self.shaper {
            Some([u, h]) => (u * 65536 - h.max(0)).div_euclid(65536).max(0),
            None => torque,
        };
        let command = shaped.clamp(-31, 31);
        [self.position, self.error, delta, contact, penetration, torque, self.velocity * 8, shaped, command]
    }

    /// Ticks one edge; returns all nets after it.
    fn tick(&mut self, input: &LoopIn<i64>) -> Vec<i64> {
        let [.., torque, _, _, command] = self.nets(input);
        let phase = self.edge % 32;
        if phase == 0 {
            self.taken = command;
        }
        let gates = match self.taken {
            taken if phase >= taken.abs() => [0, 1, 0, 1],
            1.. => [1, 0, 0, 1],
            _ => [0, 1, 1, 0],
        };
        if self.edge == self.next_shaped {
            if let Some([u, h]) = &mut self.shaper {
                // This is h = (u - u') / 2 + h' / 4, rounded to the nearest 2^-16.
                *h = ((torque - *u) * 2 * 65536 + *h + 2).div_euclid(4);
                *u = torque;
            }
            self.next_shaped += input.period.max(1);
        }
        if self.edge == self.next_sample {
            self.velocity = (self.position - self.sampled + 32).rem_euclid(64) - 32;
            self.sampled = self.position;
            self.next_sample += input.period.max(1);
        }
        self.position = (self.position + self.step).rem_euclid(64);
        let [pins, lines, before] = self.stages;
        let place = |lines| [(0, 0), (0, 1), (1, 1), (1, 0)].iter().position(|at| *at == lines).unwrap();
        self.step = 0;
        if self.edge >= 3 {
            match (4 + place(lines) - place(before)) % 4 {
                0 => {}
                1 => self.step = 1,
                3 => self.step = -1,
                _ => self.error = 1,
            }
        }
        self.stages = [(input.a_pin, input.b_pin), pins, lines];
        self.edge += 1;
        [&flatten(input)[..], &gates, &self.nets(input)].concat()
    }
}

/// Returns motions of the encoder: each entry goes forward, back or nowhere (or makes an impossible leap) and stays
/// for a while.
fn motion() -> impl Strategy<Value = Vec<(i64, u64)>> {
    let step = prop::sample::select(vec![1i64, 1, 1, 1, 3, 3, 0, 2]);
    let stay = prop_oneof![1u64..9, 1u64..900];
    prop::collection::vec((step, stay), 1..40)
}

/// Returns words of a scene, in the range of the formats of [`uneven`].
fn constants() -> impl Strategy<Value = LoopIn<i64>> {
    (0i64..64, 0i64..32, 0i64..8, 0i64..300, 0i64..16).prop_map(|(reference, stiffness, damping, period, scale)| {
        LoopIn { a_pin: 0, b_pin: 0, reference, stiffness, damping, period, scale }
    })
}

/// Returns the pins at a place of the encoder.
fn at(place: i64, constants: LoopIn<i64>) -> LoopIn<i64> {
    let (a_pin, b_pin) = [(0, 0), (0, 1), (1, 1), (1, 0)][place.rem_euclid(4) as usize];
    LoopIn { a_pin, b_pin, ..constants }
}

/// Runs the same motion leaping and ticking, with a change of the stiffness half way. Asserts that nets, uses and state
/// agree.
fn leaping_equals_ticking<L: Law + PartialEq>(
    law: L,
    config: MethodLoopConfig,
    scene: LoopIn<i64>,
    motion: &[(i64, u64)],
) {
    let mut leaping = MethodLoop::new(law, config).unwrap();
    let mut ticking = leaping.clone();
    let mut seen = vec![(i64::MAX, i64::MIN); leaping.nets().len()];
    let mut place = 0;
    for (index, (step, stay)) in motion.iter().enumerate() {
        place += step;
        let stiffness = if index < motion.len() / 2 { scene.stiffness } else { scene.stiffness / 2 };
        let input = at(place, LoopIn { stiffness, ..scene });
        let mut left = *stay;
        while left > 0 {
            let quiet = leaping.quiet(&input).min(left - 1);
            leaping.skip(quiet, &input);
            for _ in 0..quiet {
                ticking.tick(input);
                assert_eq!(ticking.words(), leaping.words(), "{}", L::LOOP);
            }
            leaping.tick(input);
            ticking.tick(input);
            left -= quiet + 1;
            assert_eq!(ticking.words(), leaping.words(), "{}", L::LOOP);
            for (range, &word) in seen.iter_mut().zip(ticking.words()) {
                *range = (range.0.min(word), range.1.max(word));
            }
        }
    }
    let uses = leaping.uses();
    assert_eq!(uses, ticking.uses());
    assert_eq!(uses.iter().map(|used| (used.min, used.max)).collect::<Vec<_>>(), seen);
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_loop_is_its_data_sheet(motion in motion(), scene in constants(), shaped in any::<bool>()) {
        let law = wall(Estimator::Difference, false);
        let mut wiring = MethodLoop::new(law, config(shaped.then_some(SHAPING))).unwrap();
        let mut model = Model::new(shaped);
        let mut place = 0;
        for (step, stay) in &motion {
            place += step;
            let input = at(place, scene);
            for _ in 0..*stay {
                let gates = wiring.tick(input);
                assert_eq!(wiring.words(), model.tick(&input), "edge {}", model.edge);
                assert_eq!(flatten(&gates), wiring.words()[7..11]);
            }
        }
    }

    #[test]
    fn a_leaping_loop_equals_a_ticking_one_to_the_last_lost_bit(
        motion in motion(), scene in constants(), spring_held in any::<bool>(), shaped in any::<bool>()
    ) {
        let config = config(shaped.then_some(SHAPING));
        leaping_equals_ticking(toy(), config, scene, &motion);
        for estimator in Estimator::ALL {
            leaping_equals_ticking(wall(estimator, spring_held), config, scene, &motion);
        }
        let widths = uneven();
        let coupling = CouplingConfig { widths, gain_frac: 8, share: 154, free: 64, held: 26, ..Default::default() };
        leaping_equals_ticking(VirtualCoupling::new(coupling).unwrap(), config, scene, &motion);
        for mode in [false, true] {
            let control = PassivityConfig { widths, exact: mode, ..Default::default() };
            leaping_equals_ticking(PassivityController::new(control).unwrap(), config, scene, &motion);
            let bounding = BoundingConfig { widths, least_conservative: mode, ..Default::default() };
            leaping_equals_ticking(EnergyBounding::new(bounding).unwrap(), config, scene, &motion);
            let spring = SpringConfig { widths, revive: mode, ..Default::default() };
            leaping_equals_ticking(PassiveSpring::new(spring).unwrap(), config, scene, &motion);
        }
    }
}

#[test]
fn a_loop_at_rest_leaps_whole_periods_whatever_estimates_its_velocity() {
    let scene = LoopIn { a_pin: 0, b_pin: 0, reference: 0, stiffness: 9, damping: 1, period: 500, scale: 0 };
    for estimator in Estimator::ALL {
        let mut wiring = MethodLoop::new(wall(estimator, true), config(None)).unwrap();
        // After one step the device rests: the law's velocity falls to 0, and only the modulator changes.
        let mut edges = 0;
        let mut leaps = 0;
        while edges < 1_000_000 {
            let input = at(i64::from(edges > 2000), scene);
            let quiet = wiring.quiet(&input).min(1_000_000);
            wiring.skip(quiet, &input);
            wiring.tick(input);
            edges += quiet + 1;
            leaps += 1;
        }
        // The pulse makes at most two changes in each period of 32 edges.
        assert!(leaps <= 2 * 1_000_000 / 32, "{estimator:?}: {leaps}");
    }
}

#[test]
fn lost_bits_are_counted_for_every_edge_they_stand() {
    // A depth of 16 at a stiffness of 7.75 would make 124, but the word ends at 31, from the first edge on. The sum is
    // 31 and is not limited further.
    let mut wiring = MethodLoop::new(wall(Estimator::Difference, false), config(None)).unwrap();
    let scene = LoopIn { a_pin: 0, b_pin: 0, reference: 48, stiffness: 31, damping: 0, period: 1, scale: 0 };
    for _ in 0..100 {
        wiring.tick(scene);
    }
    for (net, used) in wiring.nets().iter().zip(wiring.uses()) {
        let expected = if net.name == "torque" { 100 } else { 0 };
        assert_eq!((used.rounded, used.overflowed), (0, expected), "{}", net.name);
    }
}

/// Returns the instance labels with their ports, and with their nets where these have another name.
fn connections(wiring: &impl Wiring) -> Vec<String> {
    let nets = wiring.nets();
    let instance = |instance: Instance| {
        let ports = instance.connections.iter().map(|connection| {
            let net = &nets[connection.net];
            assert_eq!(net.format, connection.port.format, "{} of {}", net.name, instance.label);
            let (port, net) = (connection.port.name, net.name);
            if port == net { port.to_string() } else { format!("{port}={net}") }
        });
        let ports: Vec<String> = ports.collect();
        assert!(instance.tied.is_empty());
        format!("{}: {}({})", instance.label, instance.model.name(), ports.join(" "))
    };
    wiring.instances().into_iter().map(instance).collect()
}

#[test]
fn the_loops_are_connected_as_their_data_sheet_says() {
    let expected = |law: &str| {
        vec![
            "front: axis_front(a_pin b_pin reference position error delta contact penetration)".to_string(),
            format!("law: {law}(position delta contact penetration stiffness damping period scale torque memory)"),
            "shaper: input_shaper(torque period shaped)".to_string(),
            "limiter: saturator(value=shaped limited=command)".to_string(),
            "modulator: pwm(command a_high a_low b_high b_low)".to_string(),
        ]
    };
    assert_eq!(connections(&MethodLoop::<SampledWall>::default()), expected("sampled_wall"));
    assert_eq!(connections(&MethodLoop::new(toy(), config(Some(SHAPING))).unwrap()), expected("toy"));
}

#[test]
fn nets_and_generics_are_in_the_order_of_the_data_sheet() {
    let wiring = MethodLoop::new(toy(), config(Some(SHAPING))).unwrap();
    assert_eq!(
        wiring.nets().iter().map(|net| format!("{}{}", net.name, net.format)).collect::<Vec<_>>().join(" "),
        "a_pin(0,1,0) b_pin(0,1,0) reference(0,6,0) stiffness(0,3,2) damping(0,2,1) period(0,9,0) scale(0,3,1) \
         a_high(0,1,0) a_low(0,1,0) b_high(0,1,0) b_low(0,1,0) position(0,6,0) error(0,1,0) delta(1,5,0) \
         contact(0,1,0) penetration(0,6,0) torque(1,6,0) memory(1,7,0) shaped(1,6,0) command(1,5,0)"
    );
    assert_eq!(wiring.ports(), 11);
    let value = |(name, value)| match value {
        Generic::Integer(value) => format!("{name}={value}"),
        Generic::Boolean(value) => format!("{name}={value}"),
    };
    assert_eq!(
        wiring.generics().into_iter().map(value).collect::<Vec<_>>().join(" "),
        "POSITION_WIDTH=6 STIFFNESS_WIDTH=5 STIFFNESS_FRAC=2 DAMPING_WIDTH=3 DAMPING_FRAC=1 PERIOD_WIDTH=9 \
         SCALE_WIDTH=4 SCALE_FRAC=1 PWM_WIDTH=5 ANTIPHASE=false LATCHED=true FLOATING=false DEAD_TIME=0 \
         SHAPER_ENABLED=true SHAPER_PHASE=5 SHAPER_B0=536870912 SHAPER_B1=-536870912 SHAPER_B2=0 SHAPER_A1=-268435456 \
         SHAPER_A2=0 OWN=7"
    );
}

#[test]
fn a_modulator_that_is_not_as_wide_as_the_torque_is_refused() {
    assert_eq!(
        MethodLoop::new(toy(), MethodLoopConfig::default()).unwrap_err().to_string(),
        "toy_loop: PWM_WIDTH is 12; accepted: the 5 bits of the law's torque"
    );
}
