//! The combinational blocks of the PHANToM and its registers, compared with the data sheet in exact rationals.

use hpu_datapath::Block;
use hpu_datapath::phantom::{
    CommandRegister, CommandScaler, Config, CubeRoom, Formats, PhantomForward, PhantomTorque, SampleRegister,
    command_register, command_scaler, cube_room, phantom_forward, phantom_torque, sample_register,
};
use hpu_signal::Format;
use proptest::prelude::*;

use crate::cases::cases;

/// An exact number, `num / 2^frac`.
#[derive(Clone, Copy)]
struct Exact {
    num: i128,
    frac: i32,
}

impl Exact {
    fn of(word: i64, frac: i32) -> Self {
        Self { num: word.into(), frac }
    }

    fn plus(self, other: Self) -> Self {
        let frac = self.frac.max(other.frac);
        let at = |value: Self| value.num * 2i128.pow((frac - value.frac) as u32);
        Self { num: at(self) + at(other), frac }
    }

    fn times(self, other: Self) -> Self {
        Self { num: self.num * other.num, frac: self.frac + other.frac }
    }

    fn minus(self, other: Self) -> Self {
        self.plus(Self { num: -other.num, ..other })
    }

    /// Returns `floor(value 2^frac + 1/2)`.
    fn nearest(self, frac: i32) -> i128 {
        let (num, den) = (self.num * 2i128.pow(frac as u32 + 1), 2i128.pow(self.frac as u32));
        (num + den).div_euclid(2 * den)
    }

    /// Returns the word whose bits are the lower bits of the nearest integer.
    fn word(self, format: Format) -> i64 {
        let turn = 2i128.pow(format.width());
        let bits = self.nearest(format.frac()).rem_euclid(turn);
        (if bits > format.max() { bits - turn } else { bits }) as i64
    }
}

/// Returns formats of all kinds up to 25 bits: some words lose most of their bits, others gain some.
fn formats() -> impl Strategy<Value = Formats> {
    let word = |sign: bool, least: i32| {
        (least..7, 4i32..19).prop_map(move |(int, frac)| Format::new(sign, int, frac).unwrap())
    };
    (word(true, 1), 0u32..20, word(true, 0), word(false, 0), word(true, 0), word(true, 0)).prop_map(
        |(trig, length_frac, position, stiffness, force, torque)| Formats {
            trig,
            length_frac,
            position,
            stiffness,
            force,
            torque,
        },
    )
}

/// Returns a word of the format, often an extreme one.
fn word(format: Format, choice: u64) -> i64 {
    match choice % 8 {
        0 => format.min() as i64,
        1 => format.max() as i64,
        2 => 0,
        _ => format.from_bits(choice >> 3),
    }
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn the_kinematics_are_their_data_sheet_in_any_words(
        formats in formats(), lengths in [1u32..1 << 20, 1u32..1 << 20], choices in any::<[u64; 6]>()
    ) {
        let block = PhantomForward::new(&formats, lengths).unwrap();
        let words = choices.map(|choice| word(formats.trig, choice));
        let [sine1, cosine1, sine2, cosine2, sine3, cosine3] = words;
        let out = block.eval(phantom_forward::In { sine1, cosine1, sine2, cosine2, sine3, cosine3 });

        let [s1, c1, s2, c2, s3, c3] = words.map(|word| Exact::of(word, formats.trig.frac()));
        let [l1, l2] = lengths.map(|word| Exact::of(word.into(), formats.length_frac as i32));
        let radius = l1.times(c2).plus(l2.times(s3)).word(formats.position);
        let reach = Exact::of(radius, formats.position.frac());
        prop_assert_eq!(out.radius.word, radius);
        prop_assert_eq!(out.x.word, s1.times(reach).word(formats.position));
        prop_assert_eq!(out.y.word, l2.minus(l2.times(c3)).plus(l1.times(s2)).word(formats.position));
        prop_assert_eq!(out.z.word, c1.times(reach).minus(l1).word(formats.position));
        let exact = l1.times(c2).plus(l2.times(s3));
        prop_assert_eq!(out.radius.overflowed, !formats.position.holds(exact.nearest(formats.position.frac())));
        let kept = Exact { num: exact.nearest(formats.position.frac()), frac: formats.position.frac() };
        prop_assert_eq!(out.radius.rounded, kept.minus(exact).num != 0);
    }

    #[test]
    fn the_jacobian_is_its_data_sheet_in_any_words(
        formats in formats(), lengths in [1u32..1 << 20, 1u32..1 << 20], choices in any::<[u64; 11]>()
    ) {
        let block = PhantomTorque::new(&formats, lengths).unwrap();
        let trig = [0, 1, 2, 3, 4, 5].map(|index| word(formats.trig, choices[index]));
        let [sine1, cosine1, sine2, cosine2, sine3, cosine3] = trig;
        let [x, z] = [6, 7].map(|index| word(formats.position, choices[index]));
        let force = [8, 9, 10].map(|index| word(formats.force, choices[index]));
        let [force_x, force_y, force_z] = force;
        let input = phantom_torque::In {
            sine1, cosine1, sine2, cosine2, sine3, cosine3, x, z, force_x, force_y, force_z
        };
        let out = block.eval(input);

        let [s1, c1, s2, c2, s3, c3] = trig.map(|word| Exact::of(word, formats.trig.frac()));
        let [x, z] = [x, z].map(|word| Exact::of(word, formats.position.frac()));
        let [fx, fy, fz] = force.map(|word| Exact::of(word, formats.force.frac()));
        let [l1, l2] = lengths.map(|word| Exact::of(word.into(), formats.length_frac as i32));
        let beam = Format::new(true, formats.force.int() + 1, formats.force.frac()).unwrap();
        let narrow = |value: Exact| Exact::of(value.word(beam), beam.frac());
        let radial = narrow(s1.times(fx).plus(c1.times(fz)));
        let upper = narrow(c2.times(fy).minus(s2.times(radial)));
        let fore = narrow(s3.times(fy).plus(c3.times(radial)));
        prop_assert_eq!(out.torque1.word, z.plus(l1).times(fx).minus(x.times(fz)).word(formats.torque));
        prop_assert_eq!(out.torque2.word, l1.times(upper).word(formats.torque));
        prop_assert_eq!(out.torque3.word, l2.times(fore).word(formats.torque));
    }

    #[test]
    fn the_room_is_its_data_sheet_in_any_words(
        formats in formats(), limit in any::<u32>(), room in 0i64..8, choices in any::<[u64; 10]>()
    ) {
        let limit = 1 + limit % formats.force.max() as u32;
        let block = CubeRoom::new(&formats, limit).unwrap();
        let at = |index: usize| word(formats.position, choices[index]);
        let [x, y, z, x_low, x_high, y_low, y_high, z_low, z_high] = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(at);
        let stiffness = word(formats.stiffness, choices[9]);
        let out = block.eval(cube_room::In { x, y, z, x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness });
        let mut contact = 0;
        for (axis, force, [at, low, high]) in [
            (0, out.force_x, [x, x_low, x_high]),
            (1, out.force_y, [y, y_low, y_high]),
            (2, out.force_z, [z, z_low, z_high]),
        ] {
            let wall = if at > high { high } else if at < low { low } else { at };
            let wall = if room >> axis & 1 == 0 { at } else { wall };
            contact |= i64::from(wall != at) << axis;
            let position = formats.position.frac();
            let depth = Exact::of(wall, position).minus(Exact::of(at, position));
            let spring = Exact::of(stiffness, formats.stiffness.frac()).times(depth).nearest(formats.force.frac());
            let expected = spring.clamp(-i128::from(limit), i128::from(limit));
            prop_assert_eq!(i128::from(force.word), expected);
            prop_assert_eq!(force.overflowed, spring != expected);
        }
        prop_assert_eq!(out.contact.word, contact);
    }
}

#[test]
fn every_command_of_a_12_bit_torque_is_the_nearest_that_there_is() {
    for (frac, gain, gain_frac) in [(8, 1000, 3), (0, 5, 0), (11, 2_000_000, 10), (10, 1, 7)] {
        let torque = Format::new(true, 11 - frac, frac).unwrap();
        let block = CommandScaler::new(torque, gain, gain_frac, 10).unwrap();
        for word in -2048..2048 {
            let exact = Exact::of(word, frac).times(Exact::of(gain.into(), gain_frac as i32)).nearest(0);
            let command = |valid1, valid2, valid3| {
                block.eval(command_scaler::In { torque: word, valid1, valid2, valid3 }).command
            };
            let out = command(1, 1, 1);
            assert_eq!(i128::from(out.word), exact.clamp(-512, 511));
            assert_eq!(out.overflowed, !(-512..512).contains(&exact));
            for valid in 0..7 {
                assert_eq!(
                    command(valid & 1, valid >> 1 & 1, valid >> 2),
                    hpu_signal::Narrowed { word: 0, rounded: false, overflowed: false }
                );
            }
        }
    }
}

#[test]
fn the_known_answer_of_the_kinematics_and_its_jacobian_is_met() {
    // The links are 0.1397 m long, at 0.2, 0.3 and 0.5 rad, and the force is 1, 2 and 3 N; the published digits end at
    // 1e-8.
    let config = Config { lengths: [2_343_777; 2], ..Config::default() };
    let Formats { trig, position, force, torque, .. } = config.formats;
    let words = [0.2f64, 0.3, 0.5].map(|angle| [angle.sin(), angle.cos()].map(|value| (value / trig.lsb()).round()));
    let [[sine1, cosine1], [sine2, cosine2], [sine3, cosine3]] = words.map(|pair| pair.map(|value| value as i64));
    let posture = phantom_forward::In { sine1, cosine1, sine2, cosine2, sine3, cosine3 };
    let tip = PhantomForward::new(&config.formats, config.lengths).unwrap().eval(posture);
    // The tolerance covers half an LSB of the length, 3e-8 m, on top of the proved errors of 1.5e-7 m.
    let near = 2e-7;
    for (word, expected) in [(tip.x, 0.039_820_54), (tip.y, 0.058_385_89), (tip.z, 0.056_740_87)] {
        assert!((position.to_f64(word.word) - expected).abs() < near);
    }
    let newton = |size: i64| size << force.frac();
    let pushed = phantom_torque::In {
        sine1,
        cosine1,
        sine2,
        cosine2,
        sine3,
        cosine3,
        x: tip.x.word,
        z: tip.z.word,
        force_x: newton(1),
        force_y: newton(2),
        force_z: newton(3),
    };
    let out = PhantomTorque::new(&config.formats, config.lengths).unwrap().eval(pushed);
    for (word, expected) in [(out.torque1, 0.076_979_26), (out.torque2, 0.137_335_4), (out.torque3, 0.518_771_46)] {
        assert!((torque.to_f64(word.word) - expected).abs() < 4e-6);
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn registers_take_their_inputs_on_the_edges_that_the_period_and_the_delay_name(
        delay in 0u64..40,
        history in prop::collection::vec((any::<[i16; 3]>(), prop_oneof![0u64..6, 0u64..60]), 1..400),
    ) {
        let mut sample = SampleRegister::new(16, 6).unwrap();
        let mut hold = CommandRegister::new(16, 6, delay as u32).unwrap();
        let (mut samples, mut captures) = (0, delay);
        let (mut counts, mut commands) = ([0; 3], [0; 3]);
        for (edge, (words, period)) in (0u64..).zip(history) {
            let signed = words.map(i64::from);
            let [position1, position2, position3] = signed.map(|word| word.rem_euclid(65_536));
            let [d1, d2, d3] = signed;
            let period_word = period as i64;
            if edge == samples {
                counts = signed;
                samples += period.max(1);
            }
            if edge == captures {
                commands = signed;
                captures += period.max(1);
            }
            let out = sample.tick(sample_register::In { position1, position2, position3, period: period_word });
            prop_assert_eq!([out.count1, out.count2, out.count3], counts);
            let out = hold.tick(command_register::In { d1, d2, d3, period: period_word });
            prop_assert_eq!([out.q1, out.q2, out.q3], commands);
        }
    }
}

#[test]
fn impossible_words_are_refused() {
    let formats = Formats::default();
    let unsigned = Formats { position: Format::new(false, 1, 24).unwrap(), ..formats };
    let wide = Formats { force: Format::new(true, 23, 16).unwrap(), ..formats };
    let refused = [
        PhantomForward::new(&unsigned, [1; 2]).unwrap_err().to_string(),
        PhantomForward::new(&formats, [0, 1]).unwrap_err().to_string(),
        PhantomTorque::new(&wide, [1; 2]).unwrap_err().to_string(),
        CubeRoom::new(&formats, 1 << 20).unwrap_err().to_string(),
        CommandScaler::new(formats.torque, 1, 3, 32).unwrap_err().to_string(),
        CommandRegister::new(16, 24, 65_537).unwrap_err().to_string(),
    ];
    assert_eq!(
        refused,
        [
            "phantom_forward: POSITION is (0,1,24); accepted: signed, 2 to 40 bits, 0 to 30 of them fraction bits",
            "phantom_forward: LENGTH_1 is 0; accepted: 1 to 2147483647",
            "phantom_torque: FORCE's width is 40; accepted: 2 to 39",
            "cube_room: FORCE_LIMIT is 1048576; accepted: 1 to 1048575",
            "command_scaler: COMMAND_WIDTH is 32; accepted: 2 to 31",
            "command_register: DELAY is 65537; accepted: 0 to 65536",
        ]
    );
}
