//! Postures of an arm, computed by its blocks and compared with the kinematics in floats.

use std::f64::consts::TAU;

use hpu_cosim::SplitMix64;
use hpu_datapath::ConfigError;
use hpu_datapath::phantom::{
    CommandScaler, CubeRoom, PhantomForward, PhantomTorque, TrigTable, command_scaler, cube_room, phantom_forward,
    phantom_torque,
};
use hpu_plant::arm::kinematics;
use hpu_signal::Format;

use super::{Config, SIGNALS};

/// The measured range and error of a signal.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Measured {
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Greatest distance to the exact value.
    pub error: f64,
}

/// A datapath under test, and the random numbers for its postures.
struct Bench {
    config: Config,
    tables: [TrigTable; 3],
    forward: PhantomForward,
    room: CubeRoom,
    jacobian: PhantomTorque,
    scalers: [CommandScaler; 3],
    lengths_m: [f64; 2],
    stiffness_max: i64,
    random: SplitMix64,
}

/// Measures every signal. The postures are every count of the tables (all joints at the same count), every combination
/// of the counts at the tables' ends and middle, and random postures. Each posture gets random walls about the tip and,
/// independently, random forces.
///
/// # Errors
///
/// Returns an error if a block refuses the word formats.
pub fn measure(
    config: &Config,
    stiffness_max_n_per_m: f64,
    random: usize,
) -> Result<[Measured; SIGNALS.len()], ConfigError> {
    let mut bench = Bench::new(config, stiffness_max_n_per_m)?;
    let mut seen = [Measured { min: f64::INFINITY, max: f64::NEG_INFINITY, error: 0.0 }; SIGNALS.len()];
    let mut look = |counts| {
        for (seen, (value, truth)) in seen.iter_mut().zip(bench.signals(counts)) {
            let error = seen.error.max((value - truth).abs());
            *seen = Measured { min: seen.min.min(value), max: seen.max.max(value), error };
        }
    };
    let reach = 1i64 << (config.depth_width - 1);
    (-reach..reach).for_each(|count| look([count; 3]));
    let edges = [-reach, -1, 0, 1, reach - 1];
    for first in edges {
        for second in edges {
            // Each combination is taken 32 times, because the forces are drawn anew each time.
            edges.iter().flat_map(|third| [*third; 32]).for_each(|third| look([first, second, third]));
        }
    }
    let mut draws = SplitMix64::new(1);
    (0..random).for_each(|_| look([(); 3].map(|()| draws.below(2 * reach.unsigned_abs()).cast_signed() - reach)));
    Ok(seen)
}

impl Bench {
    fn new(config: &Config, stiffness_max_n_per_m: f64) -> Result<Self, ConfigError> {
        let Config { position_width, depth_width, turns, formats, lengths, gains, .. } = *config;
        let table = |joint: usize| TrigTable::new(position_width, depth_width, turns[joint], formats.trig);
        let scaler =
            |joint: usize| CommandScaler::new(formats.torque, gains[joint], config.gain_frac, config.command_width);
        Ok(Self {
            config: *config,
            tables: [table(0)?, table(1)?, table(2)?],
            forward: PhantomForward::new(&formats, lengths)?,
            room: CubeRoom::new(&formats, config.force_limit)?,
            jacobian: PhantomTorque::new(&formats, lengths)?,
            scalers: [scaler(0)?, scaler(1)?, scaler(2)?],
            lengths_m: lengths.map(|word| f64::from(word) / f64::from(1u32 << formats.length_frac)),
            stiffness_max: libm::floor(stiffness_max_n_per_m / formats.stiffness.lsb()) as i64,
            random: SplitMix64::new(2),
        })
    }

    fn below(&mut self, bound: i64) -> i64 {
        self.random.below(bound.unsigned_abs().max(1)).cast_signed()
    }

    /// Returns each signal's value, and the exact value.
    fn signals(&mut self, counts: [i64; 3]) -> [(f64, f64); SIGNALS.len()] {
        let formats = self.config.formats;
        let [upper_m, fore_m] = self.lengths_m;
        let angles_rad = [0, 1, 2].map(|joint: usize| {
            let turn = self.config.turns[joint];
            TAU * (counts[joint] * i64::from(turn.num)) as f64 / f64::from(turn.den)
        });
        let [one, two, three] = [0, 1, 2].map(|joint: usize| self.tables[joint].at(counts[joint]));
        let (sine1, cosine1) = (one.sine, one.cosine);
        let (sine2, cosine2, sine3, cosine3) = (two.sine, two.cosine, three.sine, three.cosine);

        let posture = phantom_forward::In { sine1, cosine1, sine2, cosine2, sine3, cosine3 };
        let tip = self.forward.eval(posture).map(|port| port.word);
        let tip_m = kinematics::tip_m(self.lengths_m, angles_rad);
        let radius_m = upper_m * libm::cos(angles_rad[1]) + fore_m * libm::sin(angles_rad[2]);

        let (stiffness, asked) = self.stiffness();
        let pushed = self.push([tip.x, tip.y, tip.z], tip_m, stiffness, asked);

        let force = self.force();
        let [force_x, force_y, force_z] = force;
        let (x, z) = (tip.x, tip.z);
        let pulled =
            phantom_torque::In { sine1, cosine1, sine2, cosine2, sine3, cosine3, x, z, force_x, force_y, force_z };
        let torque = self.jacobian.eval(pulled).map(|port| port.word);
        let torque = [torque.torque1, torque.torque2, torque.torque3];
        let force_n = force.map(|word| formats.force.to_f64(word));
        let torque_nm = kinematics::torques_nm(self.lengths_m, angles_rad, force_n);

        let mut all = [(0.0, 0.0); SIGNALS.len()];
        let mut put = |index: usize, value: f64, truth: f64| all[index] = (value, truth);
        for (joint, table) in [one, two, three].into_iter().enumerate() {
            let (sine, cosine) = libm::sincos(angles_rad[joint]);
            put(2 * joint, formats.trig.to_f64(table.sine), sine);
            put(2 * joint + 1, formats.trig.to_f64(table.cosine), cosine);
            put(14 + joint, formats.torque.to_f64(torque[joint]), torque_nm[joint]);
            put(17 + joint, self.command(joint, torque[joint]), self.true_command(joint, torque_nm[joint]));
        }
        let [x_m, y_m, z_m] = tip_m;
        let places = [(tip.radius, radius_m), (tip.x, x_m), (tip.y, y_m), (tip.z, z_m)];
        for (index, (word, truth)) in places.into_iter().enumerate() {
            put(6 + index, formats.position.to_f64(word), truth);
        }
        put(10, formats.stiffness.to_f64(stiffness), asked);
        pushed.into_iter().enumerate().for_each(|(axis, (value, truth))| put(11 + axis, value, truth));
        all
    }

    /// Returns a stiffness as a word, and as it was asked for: the greatest stiffness every fourth time.
    fn stiffness(&mut self) -> (i64, f64) {
        let format = self.config.formats.stiffness;
        let asked = if self.below(4) == 0 { self.stiffness_max } else { self.below(self.stiffness_max + 1) };
        (format.wrap(asked.into()), asked as f64 * format.lsb())
    }

    /// Returns the room's forces on a tip beyond walls, and the exact forces. The tip is at most twice as deep as the
    /// depth at which the force reaches its limit.
    fn push(&mut self, tip: [i64; 3], tip_m: [f64; 3], stiffness: i64, asked: f64) -> [(f64, f64); 3] {
        let formats = self.config.formats;
        let (position, limit_n) = (formats.position, f64::from(self.config.force_limit) * formats.force.lsb());
        let end = |word: i128| i64::try_from(word).expect("a word");
        let (least, most) = (end(position.min()), end(position.max()));
        let deepest_m = (2.0 * limit_n / asked.max(1.0)).min(greatest_m(position));
        let deepest = libm::ceil(deepest_m / position.lsb()) as i64;
        let walls: [[i64; 2]; 3] = [0, 1, 2].map(|axis: usize| {
            let depth = self.below(deepest + 1);
            let wall = |word: i64| word.clamp(least, most);
            if self.below(2) == 0 { [least, wall(tip[axis] - depth)] } else { [wall(tip[axis] + depth), most] }
        });
        let ([x, y, z], [[x_low, x_high], [y_low, y_high], [z_low, z_high]]) = (tip, walls);
        let input = cube_room::In { x, y, z, x_low, x_high, y_low, y_high, z_low, z_high, room: 7, stiffness };
        let out = self.room.eval(input).map(|port| port.word);
        let words = [out.force_x, out.force_y, out.force_z];
        [0, 1, 2].map(|axis: usize| {
            let [low_m, high_m] = walls[axis].map(|word| position.to_f64(word));
            let depth_m = (tip_m[axis] - high_m).max(0.0) + (tip_m[axis] - low_m).min(0.0);
            (formats.force.to_f64(words[axis]), (-asked * depth_m).clamp(-limit_n, limit_n))
        })
    }

    /// Returns a force within the limit; every fourth time the greatest force in all directions.
    fn force(&mut self) -> [i64; 3] {
        let limit = i64::from(self.config.force_limit);
        let greatest = self.below(4) == 0;
        [(); 3].map(|()| if greatest { limit * (2 * self.below(2) - 1) } else { self.below(2 * limit + 1) - limit })
    }

    fn command(&self, joint: usize, torque: i64) -> f64 {
        let input = command_scaler::In { torque, valid1: 1, valid2: 1, valid3: 1 };
        self.scalers[joint].eval(input).command.word as f64
    }

    fn true_command(&self, joint: usize, torque_nm: f64) -> f64 {
        let full = Format::signed(self.config.command_width);
        let gain = f64::from(self.config.gains[joint]) / f64::from(1u32 << self.config.gain_frac);
        (torque_nm * gain).clamp(full.min() as f64, full.max() as f64)
    }
}

/// Returns the greatest depth, in m, that a word of positions holds, at most 1 m.
fn greatest_m(position: Format) -> f64 {
    (position.max() as f64 * position.lsb()).min(1.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::{Config, PhantomForward, PhantomTorque, TrigTable};
    use hpu_prove::real::law;

    #[test]
    fn the_tip_and_the_torques_of_a_phantom_are_those_of_its_angles() {
        let config = Config::default();
        let [upper, fore] = config.lengths.map(|word| f64::from(word) / f64::from(1u32 << config.formats.length_frac));
        let table = |joint: usize| TrigTable::new(16, 13, config.turns[joint], config.formats.trig).expect("a table");
        for counts in [[0.0, 0.0, 0.0], [-4096.0, 4095.0, 17.0], [1234.0, -3210.0, 4000.0]] {
            let sines: Vec<f64> =
                (0..3).flat_map(|joint| law(&table(joint), 3, &[counts[joint]])[..2].to_vec()).collect();
            let [q1, q2, q3] = [0, 1, 2].map(|joint| {
                let turn = config.turns[joint];
                2.0 * PI * counts[joint] * f64::from(turn.num) / f64::from(turn.den)
            });
            let tip = law(&PhantomForward::new(&config.formats, config.lengths).expect("words"), 0, &sines);
            let radius = upper * q2.cos() + fore * q3.sin();
            let at = [q1.sin() * radius, fore * (1.0 - q3.cos()) + upper * q2.sin(), q1.cos() * radius - upper, radius];
            let [fx, fy, fz] = [1.7, -2.3, 8.1];
            let pushed = [&sines[..], &[tip[0], tip[2], fx, fy, fz]].concat();
            let torques = law(&PhantomTorque::new(&config.formats, config.lengths).expect("words"), 0, &pushed);
            // Power: torque times speed is force times the tip's speed.
            let radial = q1.sin() * fx + q1.cos() * fz;
            let expected = [
                radius * (q1.cos() * fx - q1.sin() * fz),
                upper * (q2.cos() * fy - q2.sin() * radial),
                fore * (q3.sin() * fy + q3.cos() * radial),
            ];
            for (found, truth) in tip.iter().chain(&torques).zip(at.iter().chain(&expected)) {
                assert!((found - truth).abs() < 1e-12, "{found}, not {truth}, at {counts:?}");
            }
        }
    }
}
