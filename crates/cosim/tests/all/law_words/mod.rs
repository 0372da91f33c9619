//! Every law's datapath against the law in floats, along the datapath's own trajectory.
//!
//! The loop is closed around the words. The law gets the positions that the words saw, and its torque is compared with
//! theirs. The bound follows from the roundings of the words. Where a law has memory, bounds are carried along:
//! `memory_off` for the error of the memory, `force_off` for that of the torque. Positions, motions and integer gains
//! are exact in both, so that both agree on contact.

mod recorded;

use hpu_cosim::law::{
    BoundingForm, BrakingPulse, EnergyBounding, InputShaper, Observer, PassiveSpring, PassivityController, PidLaw,
    SampledLaw, TableLaw, VirtualCoupling, Wall, high_pass,
};

use recorded::{Push, Recorded, TOP, Tally};

fn wall(run: &Recorded, ratio: u32) -> Wall {
    // The word stands for PWM counts per count in `ratio` samples.
    Wall::new(run.stiffness, run.damping * f64::from(ratio), ratio, 1.0, run.start)
}

/// Returns the greatest difference of roots whose radicands differ by at most `off`, one of them being `radicand`:
/// `|√a - √b| = |a - b| / (√a + √b)`.
fn root_off(radicand: f64, off: f64) -> f64 {
    if off == 0.0 { 0.0 } else { off / (radicand.sqrt() + (radicand - off).max(0.0).sqrt()).max(off.sqrt()) }
}

#[test]
fn a_sampled_wall_is_within_the_floors_of_drag_and_relief() {
    let push = Push {
        method: "kind = \"sampled_wall\"\nvelocity_every = 5\ndamping_format = \"(0,8,4)\"\n\
                 negative_damping = \"0.02 mN.m.s/rad\"",
        wall: "stiffness = \"0.8 N.m/rad\"\ndamping = \"0.1 mN.m.s/rad\"",
        rate_hz: 5_000,
        samples: 5_000,
    };
    let mut tally = Tally::default();
    for seed in 0..20 {
        let run = push.run(seed);
        let mut law = wall(&run, 5);
        law.relief_n_s_per_m = run.generic("RELIEF") / 16.0 * 5.0;
        for sample in &run.samples {
            // The spring is exact. The floor of the drag lies below it, and the floor of the relief, which is
            // subtracted, above it: less than 1 each.
            let force = law.sample(sample.delta);
            assert!(force.abs() < TOP);
            tally.hold(sample, sample.torque, force, 1.0);
        }
    }
    tally.done("sampled_wall");
}

#[test]
fn a_virtual_coupling_is_within_the_words_of_its_shares_and_its_extension() {
    let push = Push {
        method: "kind = \"virtual_coupling\"\ndamping_format = \"(0,8,4)\"\n\
                 coupling_stiffness = \"0.5 N.m/rad\"\ncoupling_damping = \"0.1 mN.m.s/rad\"",
        wall: "stiffness = \"1.5 N.m/rad\"",
        rate_hz: 5_000,
        samples: 5_000,
    };
    let mut tally = Tally::default();
    for seed in 0..20 {
        let run = push.run(seed);
        let (k, d) = (run.stiffness, run.damping);
        let mut law = VirtualCoupling::new(k, d, run.asked, 1.0);
        let shares = law.shares();
        let half = 0.5f64.powi(17);
        for (name, share) in [("SHARE", shares.share), ("HELD", shares.held), ("FREE", shares.free)] {
            assert!((run.generic(name) / 65_536.0 - share).abs() <= half * (1.0 + 1e-9), "{name}");
        }
        // Touching or free, e' = f e + s max(0, x - f e), with h = f (1 - s): Lipschitz in e with f. In words, a step
        // adds the floors, 2^-8 (as much again where only the words take the tool to be free or not), and three shares
        // off by half a 2^-16 of x and e, |e| <= |x|.
        let most = run.samples.iter().map(|sample| sample.delta.abs()).fold(0.0, f64::max);
        let memory_off = (2.0 / 256.0 + half * 3.0 * most) / (1.0 - shares.free);
        // The force is max(0, (k + d) e' - d e), which is continuous where the tool comes free, plus two floors.
        let force_off = (k + 2.0 * d) * memory_off + (k + d) * half * most + 2.0;
        for sample in &run.samples {
            tally.hold(sample, sample.torque, law.sample(sample.delta).min(TOP), force_off);
        }
    }
    tally.done("virtual_coupling");
}

/// Runs a passivity controller of an undamped wall, whose force is the same in words and in floats.
fn controlled(
    observer: Observer,
    rate_hz: u32,
    samples: u32,
    hold: impl Fn(&Recorded, PassivityController, &mut Tally),
) {
    let (name, method) = match observer {
        Observer::Velocity => ("velocity", "kind = \"passivity_controller\""),
        Observer::HeldForce => ("held_force", "kind = \"passivity_controller\"\nobserver = \"held_force\""),
    };
    let push = Push { method, wall: "stiffness = \"1.5 N.m/rad\"\ndamping = 0", rate_hz, samples };
    let mut tally = Tally::default();
    let mut seed = 0;
    while tally.held < 100_000 && seed < 500 {
        let run = push.run(seed);
        let law = PassivityController::new(wall(&run, 1), observer, f64::INFINITY, TOP, run.start);
        hold(&run, law, &mut tally);
        seed += 1;
    }
    tally.done(name);
}

#[test]
fn a_passivity_controller_is_within_the_floor_of_its_quotient() {
    controlled(Observer::Velocity, 2_000, 5_000, |run, mut law, tally| {
        // A correction turns W into W + c d: 0, or the rest that the limits leave over; in words, less the rest of the
        // division, which is below |d|. W + c d is monotone in W with a slope of at most 1, so energies that differ by
        // no more than the greatest |d| so far keep doing so. All else is exact.
        let mut memory_off: f64 = 0.0;
        for sample in &run.samples {
            let force = law.sample(sample.delta);
            let (off, motion) = ((sample.memory - law.energy_j()).abs(), sample.motion.abs());
            assert!(off <= memory_off + recorded::FLOATS, "energy off by {off}, bound {memory_off}");
            let may_act = motion != 0.0 && sample.memory < memory_off.max(1e-9);
            tally.hold(sample, sample.torque, force, if may_act { memory_off / motion + 1.0 } else { 0.0 });
            memory_off = memory_off.max(motion);
        }
    });
}

#[test]
fn a_passivity_controller_that_sees_the_held_force_is_within_what_its_quotients_leave() {
    controlled(Observer::HeldForce, 10_000, 1_000, |run, mut law, tally| {
        // A correction is off by -w/d if energies are off by w, and by the quotient's floor, below 1; limits reduce
        // both. The next motion d' turns w into w (1 - d'/d), or into anything between that and w, and adds less than
        // |d'|.
        let (mut memory_off, mut acted): (f64, Option<f64>) = (0.0, None);
        for sample in &run.samples {
            let motion = sample.motion;
            if let Some(last) = acted {
                memory_off = memory_off * (1.0 - motion / last).abs().max(1.0) + motion.abs();
            }
            let force = law.sample(sample.delta);
            let off = (sample.memory - law.energy_j()).abs();
            assert!(off <= memory_off + recorded::FLOATS, "energy off by {off}, bound {memory_off}");
            acted = (motion != 0.0 && sample.memory < memory_off.max(1e-9)).then_some(motion);
            let force_off = acted.map_or(0.0, |motion| memory_off / motion.abs() + 1.0);
            tally.hold(sample, sample.torque, force, force_off);
            if force_off > Tally::WIDE {
                break;
            }
        }
    });
}

/// Returns the force of an undamped wall before energy bounding.
fn wanted(run: &Recorded, delta: f64) -> f64 {
    (run.stiffness * delta).clamp(0.0, TOP)
}

/// The floor to 1/16 PWM count under a root, and the floor to whole PWM counts.
const BOUND_FLOORS: f64 = 1.0 + 1.0 / 16.0;

#[test]
fn energy_bounding_is_within_the_floors_of_its_bounds() {
    let push = Push {
        // Seven PWM counts per count, so c1 d is a whole number.
        method: "kind = \"energy_bounding\"\nc1 = \"0.2952324 N.m/rad\"",
        wall: "stiffness = \"1.5 N.m/rad\"\ndamping = 0",
        rate_hz: 4_000,
        samples: 1_000,
    };
    let mut tally = Tally::default();
    let mut seed = 0;
    while tally.held < 100_000 && seed < 1_000 {
        let run = push.run(seed);
        seed += 1;
        let c = 7.0;
        assert_eq!((run.generic("C1"), run.generic("C2")), (16.0 * c, 16.0 * c));
        let mut law = EnergyBounding::new(wall(&run, 1), BoundingForm::C1C2(c, c), TOP, run.start);
        // The energy beyond the bound's need, G = 2 c E - F^2 >= 0, and the difference of words and law in it.
        let (mut spare_off, mut force_off): (f64, f64) = (0.0, 0.0);
        let (mut energy, mut torque) = (0.0, 0.0);
        for sample in &run.samples {
            // With c1 = c2 and G >= 0, cd - S <= F + cd <= cd + S, in words as well, and the wanted force f is not
            // negative. So F' = min(f, F + cd) for d > 0, min(max(f, F + cd), cd + S) for d < 0; S^2 = (cd)^2 + G + F^2
            // and G' = S^2 - (F' - cd)^2.
            let (motion, want) = (sample.motion, wanted(&run, sample.delta));
            let force = law.sample(sample.delta);
            let (across, step) = (c * motion, torque + c * motion);
            let root = (across * across + 2.0 * c * energy).sqrt();
            let root_square_off = spare_off + force_off * (2.0 * torque + force_off);
            let bound_off = root_off(root * root, root_square_off) + BOUND_FLOORS;
            let (high, reached) = (across + root, want.max(step));
            if motion < 0.0 && reached > high - bound_off {
                // cd + S, or nearly. The law leaves G' = 0; the words leave what follows from S - (F' - cd) < 1 + 1/16.
                // Where only one of them is bound, the other is so near that S - (F' - cd) is at most 2 bound_off.
                force_off = bound_off;
                let short = if want > high + bound_off { BOUND_FLOORS } else { 2.0 * bound_off };
                let by_force = root_square_off + force_off * (2.0 * (sample.torque - across).abs() + force_off);
                spare_off = by_force.min(2.0 * (root + bound_off) * short);
            } else if motion != 0.0 {
                let to_want = if motion > 0.0 { step - want } else { want - step };
                if to_want >= force_off {
                    (force_off, spare_off) = (0.0, root_square_off);
                } else if to_want > -force_off {
                    spare_off = root_square_off + force_off * (2.0 * (sample.torque - across).abs() + force_off);
                }
                // A step that c allows: F' - F and G' - G are the same in both.
            }
            tally.hold(sample, sample.torque, force, force_off);
            if force_off > Tally::WIDE {
                break;
            }
            (energy, torque) = (sample.memory, sample.torque);
            let memory_off = (spare_off + force_off * (2.0 * torque + force_off)) / (2.0 * c);
            let off = (energy - law.energy_j()).abs();
            assert!(off <= memory_off + recorded::FLOATS, "energy off by {off}, bound {memory_off}");
        }
    }
    tally.done("c1_c2");
}

#[test]
fn the_force_bound_is_within_the_floors_of_its_root() {
    let push = Push {
        method: "kind = \"energy_bounding\"\nform = \"force_bound\"\nc1 = \"0.28 N.m/rad\"",
        wall: "stiffness = \"1.5 N.m/rad\"\ndamping = 0",
        rate_hz: 1_000,
        samples: 5_000,
    };
    let mut tally = Tally::default();
    let mut seed = 0;
    while tally.held < 100_000 && seed < 100 {
        let run = push.run(seed);
        seed += 1;
        let c = run.generic("C1") / 16.0;
        let mut law = EnergyBounding::new(wall(&run, 1), BoundingForm::ForceBound(c), TOP, run.start);
        let (mut memory_off, mut force_off) = (0.0, 0.0);
        let (mut energy, mut torque, mut want) = (0.0, 0.0, 0.0);
        for sample in &run.samples {
            let motion = sample.motion;
            // E' = E + c d^2 + F d, begun afresh where F = 0: in both where no force was wanted; in only one of them
            // where the bound was below 1 PWM count, which then drops the stored energy.
            memory_off = if want == 0.0 {
                0.0
            } else {
                memory_off + force_off * motion.abs() + if torque == 0.0 { energy } else { 0.0 }
            };
            let force = law.sample(sample.delta);
            (energy, torque, want) = (sample.memory / 16.0, sample.torque, wanted(&run, sample.delta));
            let off = (energy - law.energy_j()).abs();
            assert!(off <= memory_off + recorded::FLOATS, "energy off by {off}, bound {memory_off}");
            let radicand = 4.0 * c * energy;
            let bound_off = root_off(radicand, 4.0 * c * memory_off) + BOUND_FLOORS;
            force_off = if want == 0.0 || want < radicand.sqrt() - bound_off { 0.0 } else { bound_off };
            tally.hold(sample, torque, force, force_off);
        }
    }
    tally.done("force_bound");
}

#[test]
fn a_passive_spring_is_within_the_floors_of_its_extension() {
    let push = Push {
        method: "kind = \"passive_spring\"\nextension_frac = 16",
        wall: "stiffness = \"0.5 N.m/rad\"",
        rate_hz: 2_000,
        samples: 1_000,
    };
    let unit = 0.5f64.powi(16);
    let mut tally = Tally::default();
    let mut seed = 0;
    while tally.held < 100_000 && seed < 1_000 {
        let run = push.run(seed);
        let mut law = PassiveSpring::new(run.stiffness, true, run.start);
        let (mut memory_off, mut extension): (f64, f64) = (0.0, 0.0);
        for sample in &run.samples {
            let force = law.sample(sample.delta).min(TOP);
            let motion = sample.motion;
            let radicand = extension * (extension + 2.0 * motion);
            let radicand_off = memory_off * (2.0 * extension + memory_off + 2.0 * motion.abs());
            if extension == 0.0 || radicand + radicand_off <= 0.0 {
                // The spring is dead in both, or engaged in both with the penetration, a whole number.
                memory_off = 0.0;
            } else if radicand - radicand_off <= 0.0 {
                // One spring may be dead and the other not: from here on they differ.
                break;
            } else {
                memory_off = root_off(radicand, radicand_off) + if motion == 0.0 { 0.0 } else { unit };
            }
            extension = sample.memory * unit;
            let off = (extension - law.extension_m()).abs();
            assert!(off <= memory_off + recorded::FLOATS, "extension off by {off}, bound {memory_off}");
            tally.hold(sample, sample.torque, force, run.stiffness * memory_off + 1.0);
        }
        seed += 1;
    }
    tally.done("passive_spring");
}

/// A law whose force equals its input, so that the torque of the words is shaped.
struct Same;

impl SampledLaw for Same {
    fn sample(&mut self, force: f64) -> f64 {
        force
    }

    fn vary(&mut self, _: f64, _: f64) {}
}

#[test]
fn a_shaper_is_within_the_words_of_its_filter() {
    let push = Push {
        method: "kind = \"sampled_wall\"\ndamping_format = \"(0,8,4)\"\nshaper = { cutoff = \"2.5 Hz\" }",
        wall: "stiffness = \"0.8 N.m/rad\"\ndamping = \"0.1 mN.m.s/rad\"",
        rate_hz: 1_000,
        samples: 5_000,
    };
    let [b0, b1, b2, a1, a2] = high_pass(2.5, 1e-3);
    // Sums of the magnitudes of the impulse responses of 1/A and of B/A; after a second 1e-6 of either remains.
    let (mut gain, mut passed) = (0.0, 0.0);
    let (mut y, mut h) = ([0.0; 2], [0.0; 3]);
    for k in 0..2_000 {
        let now = if k == 0 { 1.0 } else { 0.0 } - a1 * y[0] - a2 * y[1];
        y = [now, y[0]];
        h = [now, h[0], h[1]];
        gain += now.abs();
        passed += (b0 * h[0] + b1 * h[1] + b2 * h[2]).abs();
    }
    // The filter's word, 14 bits before the point, does not overflow.
    assert!(TOP * passed < 16_384.0);
    // A sample adds the rounding of y, half a 2^-16, and coefficients off by half a 2^-30: three of u, two of y. This
    // error passes through the recursion.
    let step = 0.5f64.powi(17) + 0.5f64.powi(31) * TOP * (3.0 + 2.0 * passed);
    let bound = gain * step * (1.0 + 1e-5) + 1.0;
    let mut tally = Tally::default();
    for seed in 0..20 {
        let run = push.run(seed);
        let mut law = InputShaper::new(Same, 2.5, 1e-3);
        for sample in &run.samples {
            tally.hold(sample, sample.shaped, law.sample(sample.torque), bound);
        }
    }
    tally.done("input_shaper");
}

#[test]
fn a_table_is_within_the_floors_of_its_lines_and_of_the_drag() {
    let push = Push {
        method: "kind = \"table\"\ndamping_format = \"(0,8,4)\"\nspacing = 8\n\
                 torques = [0, \"-3 mN.m\", \"-1 mN.m\", \"4 mN.m\"]",
        wall: "stiffness = \"0.4 N.m/rad\"\ndamping = \"0.1 mN.m.s/rad\"",
        rate_hz: 2_000,
        samples: 2_000,
    };
    let (mut tally, mut signs) = (Tally::default(), [0, 0]);
    for seed in 0..50 {
        let run = push.run(seed);
        // The table of the law is towards greater angles, that of the words against it.
        let torques = ["T0", "T1", "T2", "T3"].map(|name| -run.generic(name));
        let mut law = TableLaw::new(wall(&run, 1), torques.into(), 8.0, run.start);
        for sample in &run.samples {
            let force = law.sample(sample.delta);
            assert!(force.abs() < TOP);
            let texture = law.texture_n(sample.delta);
            signs[usize::from(texture > 0.0)] += usize::from(texture != 0.0);
            let off = -texture - sample.memory;
            assert!((0.0..1.0).contains(&off), "{} for {texture}", sample.memory);
            // The spring is exact; the floors of the line and of the drag lose less than 1 each.
            tally.hold(sample, sample.torque, force, 2.0);
        }
    }
    assert!(signs.iter().all(|&samples| samples > 1000), "{signs:?}");
    tally.done("table");
}

#[test]
fn a_controller_is_within_the_floors_of_its_sum_and_of_its_feed_forward() {
    let push = Push {
        method: "kind = \"pid\"\nstiffness_format = \"(0,8,4)\"\ndamping_format = \"(0,8,4)\"\n\
                 integral_format = \"(0,2,16)\"\nkp = \"0.2 N.m/rad\"\nki = \"0.3 N.m/rad/s\"\n\
                 kd = \"0.5 mN.m.s/rad\"\nfeed_forward = \"0.3 mN.m.s/rad\"\n\
                 [target]\npath = [[0, 0.1], [0.2, 0.1], [0.3, 0.25]]\namplitude = 0.05\nfrequency = 7",
        wall: "",
        rate_hz: 2_000,
        samples: 2_000,
    };
    let mut tally = Tally::default();
    for seed in 0..50 {
        let run = push.run(seed);
        let mut law = PidLaw {
            gains: [run.stiffness, run.generic("INTEGRAL") * 0.5f64.powi(16), run.damping],
            feed_forward_n_s_per_m: run.generic("FEED_FORWARD") / 16.0,
            limit_n: TOP,
            back: None,
            period_s: 1.0,
            target_m: 0.0,
            before_m: [run.start; 2],
            sum_n: 0.0,
        };
        for sample in &run.samples {
            // Beyond the first target: the memory is the target in counts from the start.
            let target = sample.memory + run.start;
            law.aim(target);
            let force = law.sample(sample.delta + target);
            assert!(force.abs() < TOP && law.sum_n.abs() < TOP);
            // Sums and products are exact; one floor is that of all three together, one that of the feed-forward.
            tally.hold(sample, sample.torque, force, 2.0);
        }
    }
    tally.done("pid");
}

#[test]
fn a_braking_pulse_is_within_the_floors_of_pulse_and_drag() {
    let push = Push {
        method: "kind = \"braking_pulse\"\ndamping_format = \"(0,8,4)\"\nmomentum = 0.3",
        wall: "stiffness = \"0.4 N.m/rad\"\ndamping = \"0.1 mN.m.s/rad\"",
        rate_hz: 2_000,
        samples: 2_000,
    };
    let (mut tally, mut pulses) = (Tally::default(), 0);
    for seed in 0..50 {
        let run = push.run(seed);
        let pulse = run.generic("PULSE") / 16.0;
        let mut law = BrakingPulse::new([run.stiffness, run.damping, pulse], 1.0, TOP, run.start);
        for sample in &run.samples {
            // The spring is exact; the floors of the drag and of the pulse lose less than 1 each. A pulse that the
            // bridge can show ends with its sample in both.
            let force = law.sample(sample.delta);
            assert!(force.abs() < TOP);
            pulses += usize::from(law.pulse_n() > 0.0);
            tally.hold(sample, sample.torque, force, 2.0);
            assert!((law.pulse_n() - sample.memory).abs() < 1.0, "{} for {}", sample.memory, law.pulse_n());
        }
    }
    assert!(pulses > 100, "{pulses} pulses");
    tally.done("braking_pulse");
}
