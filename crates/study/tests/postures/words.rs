//! Compares the proof of a PHANToM's words with ten million postures, its corners and a run.

use crate::proofs_common::{bits, contains, experiment, of};
use hpu_cosim::scene::PhantomScene;
use hpu_cosim::{Control, Driver, PhantomSimulation, Simulation, SplitMix64, Wired};
use hpu_datapath::phantom::{
    CommandScaler, CubeRoom, PhantomForward, PhantomTorque, TrigTable, command_scaler, cube_room, phantom_forward,
    phantom_torque,
};
use hpu_study::Device;

fn scene() -> PhantomScene {
    experiment("phantom-drop", &[("room.stiffness", "40000"), ("room.walls", "\"xyz\"")]).phantom().unwrap()
}

/// The number of postures tried.
const POSTURES: u64 = 10_000_000;

/// The range of the words seen on each net.
#[derive(Default)]
struct Seen(Vec<(&'static str, i64, i64)>);

impl Seen {
    fn see(&mut self, index: usize, name: &'static str, word: i64) {
        match self.0.get_mut(index) {
            Some((_, least, most)) => (*least, *most) = ((*least).min(word), (*most).max(word)),
            None => self.0.push((name, word, word)),
        }
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn ten_million_postures_stay_inside_the_bounds_and_come_within_two_bits_of_them() {
    let scene = scene();
    let proof = scene.bounds().unwrap();
    let config = scene.method.config;
    let formats = config.formats;
    let tables =
        config.turns.map(|turn| TrigTable::new(config.position_width, config.depth_width, turn, formats.trig).unwrap());
    let forward = PhantomForward::new(&formats, config.lengths).unwrap();
    let room = CubeRoom::new(&formats, config.force_limit).unwrap();
    let jacobian = PhantomTorque::new(&formats, config.lengths).unwrap();
    let scalers = config
        .gains
        .map(|gain| CommandScaler::new(formats.torque, gain, config.gain_frac, config.command_width).unwrap());
    let stiffness = scene.words().unwrap().stiffness;
    let mut draw = SplitMix64::new(1);
    let mut seen = Seen::default();
    let edges = [-4096, -1, 0, 1, 4095];
    let corner = |n: u64, place: u32| edges[(n / 5u64.pow(place) % 5) as usize];
    for n in 0..POSTURES {
        // All corners of the three tables under all corners of the force come first, then random postures.
        let counts = if n < 8 * 125 {
            [0, 1, 2].map(|place| corner(n / 8, place))
        } else {
            [(); 3].map(|()| draw.below(8192) as i64 - 4096)
        };
        let trig = [0, 1, 2].map(|joint| tables[joint].at(counts[joint]));
        let [(sine1, cosine1), (sine2, cosine2), (sine3, cosine3)] = trig.map(|words| (words.sine, words.cosine));
        let tip = forward.eval(phantom_forward::In { sine1, cosine1, sine2, cosine2, sine3, cosine3 });
        let [x, y, z] = [tip.x.word, tip.y.word, tip.z.word];
        // A wall far behind the tip pushes as hard as it can, one close by pushes by its depth, and without a wall
        // nothing pushes.
        let mut walls = |axis: u64, at: i64| {
            let far = formats.position.min() as i64;
            let kind = if n < 8 * 125 { 1 + (n >> axis & 1) } else { draw.below(4) };
            match kind {
                0 => (far, -far - 1),
                1 => (far, (at - (1 << 22)).max(far)),
                2 => ((at + (1 << 22)).min(-far - 1), -far - 1),
                _ => (far, at - draw.below(8192) as i64),
            }
        };
        let [(x_low, x_high), (y_low, y_high), (z_low, z_high)] = [walls(0, x), walls(1, y), walls(2, z)];
        let push =
            room.eval(cube_room::In { x, y, z, x_low, x_high, y_low, y_high, z_low, z_high, room: 7, stiffness });
        let [force_x, force_y, force_z] = [push.force_x.word, push.force_y.word, push.force_z.word];
        let tip_force =
            phantom_torque::In { sine1, cosine1, sine2, cosine2, sine3, cosine3, x, z, force_x, force_y, force_z };
        let torque = jacobian.eval(tip_force);
        let torques = [torque.torque1.word, torque.torque2.word, torque.torque3.word];
        let command = |joint: usize| {
            scalers[joint]
                .eval(command_scaler::In { torque: torques[joint], valid1: 1, valid2: 1, valid3: 1 })
                .command
                .word
        };
        let words = [
            ("sine1", sine1),
            ("cosine1", cosine1),
            ("sine2", sine2),
            ("cosine2", cosine2),
            ("sine3", sine3),
            ("cosine3", cosine3),
            ("x", x),
            ("y", y),
            ("z", z),
            ("radius", tip.radius.word),
            ("force_x", force_x),
            ("force_y", force_y),
            ("force_z", force_z),
            ("torque1", torques[0]),
            ("torque2", torques[1]),
            ("torque3", torques[2]),
            ("command1", command(0)),
            ("command2", command(1)),
            ("command3", command(2)),
        ];
        for (index, (name, word)) in words.into_iter().enumerate() {
            seen.see(index, name, word);
        }
    }
    for (name, least, most) in seen.0 {
        let bound = of(&proof, name);
        let (least, most) = (bound.format.to_f64(least), bound.format.to_f64(most));
        assert!(bound.min <= least && most <= bound.max, "{least} to {most}, beyond {bound:?}");
        let [seen, proved] = [(least, most), (bound.min, bound.max)].map(|(a, b)| bits(bound.format.lsb(), a, b));
        println!(
            "  {name:8} {:10} {least:>12.6} .. {most:<12.6} {seen:>2} bits   {:>12.6} .. {:<12.6} {proved:>2} bits",
            bound.format.to_string(),
            bound.min,
            bound.max
        );
        assert!(proved <= seen + 2, "{name}: proved {proved} bits, seen {seen}");
    }
}

#[test]
fn a_run_stays_inside_its_bounds() {
    let scene = experiment("phantom-drop", &[]).phantom().unwrap();
    let proof = scene.bounds().unwrap();
    let simulation = PhantomSimulation::new(&scene).unwrap();
    let mut trace = simulation.trace(&[]);
    let start = std::time::Instant::now();
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    println!("{:?}", start.elapsed());
    for (net, bound) in summary.nets.iter().zip(&proof.bounds) {
        contains(bound, &net.signal, &net.usage);
    }
}
