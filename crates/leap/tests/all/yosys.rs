//! The reader of Yosys' JSON: cells at random, held against the rules of Yosys' library of cells (simlib.v) in wide
//! integers, and what is refused.

use std::fmt::Write as _;

use hpu_leap::{Leap, Netlist, yosys};

use crate::random::Random;

/// A bit of an operand: a constant, or a bit of a word by its number.
#[derive(Clone, Copy)]
enum Bit {
    Constant(bool),
    Of(usize, usize),
}

/// A module as the tests compute it: words of bits, whose nets are numbered from 2 on.
#[derive(Default)]
struct Plain {
    widths: Vec<usize>,
    nets: Vec<usize>,
    next: usize,
    ports: String,
    cells: String,
    /// Kind, operands, whether these are signed, and the word.
    computed: Vec<(&'static str, [Vec<Bit>; 3], bool, usize)>,
}

impl Plain {
    fn word(&mut self, width: usize) -> usize {
        self.next = self.next.max(2);
        self.nets.push(self.next);
        self.next += width;
        self.widths.push(width);
        self.widths.len() - 1
    }

    fn written(&self, bits: &[Bit]) -> String {
        let bit = |bit: &Bit| match bit {
            Bit::Constant(value) => format!("\"{}\"", u8::from(*value)),
            Bit::Of(word, at) => (self.nets[*word] + at).to_string(),
        };
        format!("[{}]", bits.iter().map(bit).collect::<Vec<_>>().join(","))
    }

    fn all(&self, word: usize) -> Vec<Bit> {
        (0..self.widths[word]).map(|at| Bit::Of(word, at)).collect()
    }

    fn port(&mut self, name: &str, way: &str, bits: &str) {
        write!(self.ports, ",\"{name}\":{{\"direction\":\"{way}\",\"bits\":{bits}}}").expect("memory");
    }

    fn input(&mut self, width: usize) {
        let word = self.word(width);
        let bits = self.written(&self.all(word));
        self.port(&format!("i{word}"), "input", &bits);
    }

    /// Returns an operand of some width: parts of words, constants, and copies of bits.
    fn operand(&self, random: &mut Random, width: usize) -> Vec<Bit> {
        let mut bits = Vec::new();
        while bits.len() < width {
            match random.below(6) {
                0 => bits
                    .extend((0..1 + random.below(4)).map(|_| Bit::Constant(random.below(2) == 0)).collect::<Vec<_>>()),
                1 if !bits.is_empty() => {
                    let last = bits[bits.len() - 1];
                    bits.extend(vec![last; 1 + random.below(6) as usize]);
                }
                _ => {
                    let word = random.below(self.widths.len() as u64) as usize;
                    let low = random.below(self.widths[word] as u64) as usize;
                    bits.extend(self.all(word)[low..].iter().take(1 + random.below(40) as usize));
                }
            }
        }
        bits.truncate(width);
        bits
    }

    fn cell(&mut self, kind: &'static str, operands: [Vec<Bit>; 3], is_signed: bool, width: usize) -> usize {
        let word = self.word(width);
        let y = self.written(&self.all(word));
        let [a, b, s] = [0, 1, 2].map(|at| self.written(&operands[at]));
        let is = u8::from(is_signed);
        let one_operand = operands[1].is_empty();
        let b = if one_operand { String::new() } else { format!(",\"B\":{b}") };
        let s = if operands[2].is_empty() { String::new() } else { format!(",\"S\":{s}") };
        write!(
            self.cells,
            ",\"c{word}\":{{\"type\":\"{kind}\",\"parameters\":{{\"A_SIGNED\":\"{is}\",\"B_SIGNED\":\"{is}\"}},\
             \"connections\":{{\"A\":{a}{b}{s},\"Y\":{y}}}}}"
        )
        .expect("memory");
        self.computed.push((kind, operands, is_signed, word));
        word
    }

    /// Returns the JSON, with an output for each word and more cells and names.
    fn json(&self, cells: &str, names: &str) -> String {
        let mut outputs = String::new();
        for word in 0..self.widths.len() {
            let bits = self.written(&self.all(word));
            write!(outputs, ",\"o{word}\":{{\"direction\":\"output\",\"bits\":{bits}}}").expect("memory");
        }
        let cells = format!("{}{cells}", self.cells);
        format!(
            "{{\"modules\":{{\"t\":{{\"ports\":{{\"clk\":{{\"direction\":\"input\",\"bits\":[1]}}{}{outputs}}},\
             \"cells\":{{{}}},\"netnames\":{{{names}}}}}}}}}",
            self.ports,
            cells.trim_start_matches(',')
        )
    }

    fn value(&self, words: &[u128], bits: &[Bit]) -> u128 {
        let bit = |bit: &Bit| match bit {
            Bit::Constant(value) => u128::from(*value),
            Bit::Of(word, at) => words[*word] >> at & 1,
        };
        bits.iter().enumerate().map(|(at, one)| bit(one) << at).sum()
    }

    /// Computes all words from those of the inputs.
    fn compute(&self, words: &mut Vec<u128>) {
        words.resize(self.widths.len(), 0);
        for (kind, operands, is_signed, word) in &self.computed {
            let width = self.widths[*word];
            let [a, b, s] = [0, 1, 2].map(|at| self.value(words, &operands[at]));
            let number = |value: u128, at: usize| -> i128 {
                let bits = operands[at].len();
                if *is_signed && value >> (bits - 1) & 1 == 1 { value as i128 - (1i128 << bits) } else { value as i128 }
            };
            let (of_a, most) = (operands[0].len(), width.max(operands[0].len()));
            let within = |value: i128| value.rem_euclid(1i128 << most) as u128;
            let two = || (number(a, 0), number(b, 1));
            let flag = |is: bool| i128::from(is);
            let result = match *kind {
                "$not" => !number(a, 0),
                "$pos" => number(a, 0),
                "$neg" => -number(a, 0),
                "$and" => two().0 & two().1,
                "$or" => two().0 | two().1,
                "$xor" => two().0 ^ two().1,
                "$xnor" => !(two().0 ^ two().1),
                "$add" => two().0 + two().1,
                "$sub" => two().0 - two().1,
                "$mul" => two().0.wrapping_mul(two().1),
                "$div" => two().0 / two().1,
                "$mod" => two().0 % two().1,
                "$lt" => flag(two().0 < two().1),
                "$le" => flag(two().0 <= two().1),
                "$gt" => flag(two().0 > two().1),
                "$ge" => flag(two().0 >= two().1),
                "$eq" | "$eqx" => flag(two().0 == two().1),
                "$ne" | "$nex" => flag(two().0 != two().1),
                "$reduce_or" | "$reduce_bool" => flag(a != 0),
                "$reduce_and" => flag(a == (1 << of_a) - 1),
                "$reduce_xor" => (a.count_ones() % 2).into(),
                "$reduce_xnor" => (1 - a.count_ones() % 2).into(),
                "$logic_not" => flag(a == 0),
                "$logic_and" => flag(a != 0 && b != 0),
                "$logic_or" => flag(a != 0 || b != 0),
                "$mux" => (if s == 1 { b } else { a }) as i128,
                "$pmux" => match s {
                    0 => a as i128,
                    _ => (b >> (s.trailing_zeros() as usize * width)) as i128 & ((1 << width) - 1),
                },
                "$shl" | "$sshl" => {
                    if b < 64 {
                        within(number(a, 0)).wrapping_shl(b as u32) as i128
                    } else {
                        0
                    }
                }
                "$shr" => {
                    if b < 64 {
                        (within(number(a, 0)) >> b) as i128
                    } else {
                        0
                    }
                }
                "$sshr" => number(a, 0) >> b.min(100),
                "$shift" if two().1 < 0 => {
                    let by = -two().1;
                    if by < 64 { within(number(a, 0)).wrapping_shl(by as u32) as i128 } else { 0 }
                }
                "$shift" => {
                    if b < 64 {
                        (within(number(a, 0)) >> b) as i128
                    } else {
                        0
                    }
                }
                "$shiftx" => (a >> b) as i128,
                _ => unreachable!("{kind}"),
            };
            words[*word] = result.rem_euclid(1i128 << width) as u128;
        }
    }
}

const ONE: [&str; 9] =
    ["$not", "$pos", "$neg", "$reduce_or", "$reduce_bool", "$reduce_and", "$reduce_xor", "$reduce_xnor", "$logic_not"];
const TWO: [&str; 23] = [
    "$and",
    "$or",
    "$xor",
    "$xnor",
    "$add",
    "$sub",
    "$mul",
    "$lt",
    "$le",
    "$gt",
    "$ge",
    "$eq",
    "$eqx",
    "$ne",
    "$nex",
    "$logic_and",
    "$logic_or",
    "$shl",
    "$sshl",
    "$shr",
    "$sshr",
    "$shift",
    "$shiftx",
];

fn read(json: &str) -> Result<Netlist, String> {
    yosys::read(json, "t", (&[("clk", 1)], false), |_, _| false).map_err(|why| why.to_string())
}

/// Adds a cell at random.
fn add(plain: &mut Plain, random: &mut Random) {
    let width = 1 + random.below(12) as usize;
    let wide = |random: &mut Random| if random.below(10) == 0 { 60 + random.below(12) } else { 1 + random.below(12) };
    let (of_a, of_b) = (wide(random) as usize, wide(random) as usize);
    let is_signed = random.below(2) == 0;
    let (mut a, mut b) = (plain.operand(random, of_a), plain.operand(random, of_b));
    let kind = TWO[random.below(23) as usize];
    let chosen = random.below(12);
    // Only these are of words of more than 64 bits.
    if chosen > 2 && !["$eq", "$eqx", "$ne", "$nex", "$logic_and", "$logic_or"].contains(&kind) || chosen == 4 {
        a.truncate(64);
        b.truncate(64);
    }
    match chosen {
        0 | 1 => plain.cell(ONE[random.below(9) as usize], [a, vec![], vec![]], is_signed, width),
        2 => {
            let (b, s) = (plain.operand(random, of_a), plain.operand(random, 1));
            plain.cell("$mux", [a, b, s], false, of_a)
        }
        3 => {
            // At most one is selected: a word is compared with values of its own.
            let of = plain.operand(random, 3);
            let values: Vec<_> = (0..8u64).filter(|_| random.below(3) == 0).collect();
            let mut select = Vec::new();
            for value in &values {
                let value = (0..3).map(|at| Bit::Constant(value >> at & 1 == 1)).collect();
                let bit = plain.cell("$eq", [of.clone(), value, vec![]], false, 1);
                select.push(Bit::Of(bit, 0));
            }
            if select.is_empty() {
                return;
            }
            let (a, b) = (plain.operand(random, width), plain.operand(random, width * select.len()));
            plain.cell("$pmux", [a, b, select], false, width)
        }
        4 => {
            let divisor = 1 + random.below(30);
            let b = (0..6).map(|at| Bit::Constant(divisor >> at & 1 == 1)).collect();
            plain.cell(["$div", "$mod"][random.below(2) as usize], [a, b, vec![]], is_signed, width)
        }
        _ => match kind {
            // A part that is within the word.
            "$shiftx" => {
                let (a, b) = (plain.operand(random, width + 7), plain.operand(random, 3));
                plain.cell(kind, [a, b, vec![]], false, width)
            }
            "$shl" | "$sshl" | "$shr" | "$sshr" | "$shift" => {
                b.truncate(7);
                // An amount has no sign, but for `$shift`.
                if kind != "$shift" {
                    b.push(Bit::Constant(false));
                }
                plain.cell(kind, [a, b, vec![]], is_signed, width)
            }
            _ => plain.cell(kind, [a, b, vec![]], is_signed, width),
        },
    };
}

#[test]
fn cells_at_random_are_those_of_the_library() {
    for seed in 1..=1500u64 {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut plain = Plain::default();
        for _ in 0..3 {
            plain.input(1 + random.below(20) as usize);
        }
        for _ in 0..1 + random.below(12) {
            add(&mut plain, &mut random);
        }
        let json = plain.json("", "");
        let netlist = read(&json).unwrap_or_else(|why| panic!("{why}\n{json}"));
        let names: Vec<_> =
            netlist.outputs().iter().map(|output| output.name[1..].parse::<usize>().expect("a word")).collect();
        let inputs: Vec<_> =
            netlist.inputs().iter().map(|input| input.0[1..].parse::<usize>().expect("a word")).collect();
        let mut leap = Leap::new(&netlist, (&[], &vec![0; inputs.len()]), &vec![0; names.len()]);
        for _ in 0..40 {
            let mut words: Vec<_> = (0..3).map(|at| u128::from(random.below(1 << plain.widths[at]))).collect();
            let given: Vec<_> = inputs.iter().map(|at| words[*at] as u64).collect();
            leap.input(&given);
            plain.compute(&mut words);
            for (at, word) in names.iter().enumerate() {
                assert_eq!(u128::from(leap.output(at)), words[*word], "seed {seed}, word {word} of {words:?}\n{json}");
            }
        }
    }
}

/// Registers: initial words, resets at once of either level, slower clocks, clocks that are made, words over 64 bits.
#[test]
fn registers_take_their_words_at_their_clocks() {
    let mut plain = Plain::default();
    plain.input(4);
    plain.input(1);
    let [count, held, slow, made, wide] = [4, 4, 4, 4, 70].map(|width| plain.word(width));
    let bits = |plain: &Plain, word: usize| plain.written(&plain.all(word));
    let one = (0..4).map(|at| Bit::Constant(at == 0)).collect();
    let next = plain.cell("$add", [plain.all(count), one, vec![]], false, 4);
    let register = |name: &str, more: &str, clk: &str, d: &str, q: &str, rises: u8| {
        let (kind, more) = if more.is_empty() { ("$dff", String::new()) } else { ("$adff", more.to_string()) };
        let value = if more.is_empty() { "" } else { ",\"ARST_VALUE\":\"1001\",\"ARST_POLARITY\":\"0\"" };
        format!(
            ",\"{name}\":{{\"type\":\"{kind}\",\"parameters\":{{\"CLK_POLARITY\":\"{rises}\"{value}}},\
             \"connections\":{{\"CLK\":{clk},\"D\":{d},\"Q\":{q}{more}}}}}"
        )
    };
    let (i0, clear) = (bits(&plain, 0), format!(",\"ARST\":{}", bits(&plain, 1)));
    let half = plain.written(&[Bit::Of(count, 1)]);
    let mut shifted = vec![Bit::Of(0, 0)];
    shifted.extend(&plain.all(wide)[..69]);
    let cells = [
        register("r0", "", "[1]", &bits(&plain, next), &bits(&plain, count), 1),
        register("r1", &clear, "[1]", &i0, &bits(&plain, held), 1),
        register("r2", "", "[0]", &i0, &bits(&plain, slow), 1),
        register("r3", "", &half, &bits(&plain, count), &bits(&plain, made), 0),
        register("r4", "", "[1]", &plain.written(&shifted), &bits(&plain, wide), 1),
    ];
    let names =
        format!("\"count\":{{\"hide_name\":0,\"bits\":{},\"attributes\":{{\"init\":\"1100\"}}}}", bits(&plain, count));
    let clock = ",\"clk_b\":{\"direction\":\"input\",\"bits\":[0]}";
    plain.ports.push_str(clock);
    let json = plain.json(&cells.concat(), &names);
    let clocks = [("clk", 1), ("clk_b", 3)];
    let shows = |name: &str, width: usize| (name, width) == ("count", 4);
    let netlist = yosys::read(&json, "t", (&clocks, false), shows).unwrap_or_else(|why| panic!("{why}\n{json}"));
    assert_eq!(netlist.outputs().last().map(|output| output.name.as_str()), Some("count"));
    let initial: Vec<_> = netlist.registers().iter().map(|register| register.initial).collect();
    assert!(initial.contains(&12) && netlist.registers().iter().any(|register| register.set == 15));
    let mut leap = Leap::new(&netlist, (&initial, &[0, 1]), &vec![0; netlist.outputs().len()]);
    let at = |name: &str| netlist.outputs().iter().position(|output| output.name == name).expect("an output");
    let place = |name: &str| netlist.inputs().iter().position(|input| input.0 == name).expect("an input");
    let (mut random, mut words) = (Random(77), [12, 0, 0, 0]);
    let mut given = vec![0, 0];
    for edge in 0..200 {
        (given[place("i0")], given[place("i1")]) = (random.below(16), u64::from(random.below(4) > 0));
        leap.input(&given);
        let before = words;
        words[0] = (words[0] + 1) % 16;
        words[1] = if given[place("i1")] == 1 { given[place("i0")] } else { 9 };
        words[2] = if edge % 3 == 0 { given[place("i0")] } else { words[2] };
        words[3] = if before[0] & 2 == 2 && words[0] & 2 == 0 { words[0] } else { words[3] };
        let mut left = 1;
        while left > 0 {
            left -= leap.clock(left, 0, |_, _, _| {});
        }
        let shown = [count, held, slow, made].map(|word| leap.output(at(&format!("o{word}"))));
        assert_eq!(shown, words, "edge {edge}");
        assert_eq!(leap.output(at("count")), words[0]);
    }
}

#[test]
fn what_is_no_netlist_is_refused_by_name() {
    let module = |ports: &str, cells: &str| {
        format!(
            "{{\"modules\":{{\"t\":{{\"ports\":{{\"clk\":{{\"direction\":\"input\",\"bits\":[2]}},\
             \"a\":{{\"direction\":\"input\",\"bits\":[3,4]}},\"y\":{{\"direction\":\"output\",\"bits\":[5]}}{ports}}},\
             \"cells\":{{{cells}}},\"netnames\":{{\"y\":{{\"bits\":[5],\"attributes\":{{}}}}}}}}}}}}"
        )
    };
    let cell = |kind: &str, a: &str, b: &str, y: &str| {
        format!("\"c{y}\":{{\"type\":\"{kind}\",\"connections\":{{\"A\":{a},\"B\":{b},\"S\":[3],\"Y\":[{y}]}}}}")
    };
    let flop = |clk: &str, rises: u8, d: &str| {
        format!(
            "\"f\":{{\"type\":\"$dff\",\"parameters\":{{\"CLK_POLARITY\":\"{rises}\"}},\
             \"connections\":{{\"CLK\":[{clk}],\"D\":[{d}],\"Q\":[5]}}}}"
        )
    };
    let wide = format!("[{}]", vec!["3"; 65].join(","));
    // A register that another one clocks, and one that an input or a register resets.
    let made =
        "\"m\":{\"type\":\"$dff\",\"parameters\":{\"CLK_POLARITY\":\"1\"},\"connections\":{\"CLK\":[2],\"D\":[3],\
                \"Q\":[6]}},\"n\":{\"type\":\"$dff\",\"connections\":{\"CLK\":[6],\"D\":[4],\"Q\":[7]}},"
            .to_string();
    let reset = |by: &str| {
        format!(
            "\"r\":{{\"type\":\"$adff\",\"parameters\":{{\"CLK_POLARITY\":\"1\",\"ARST_POLARITY\":\"1\",\
             \"ARST_VALUE\":\"0\"}},\"connections\":{{\"CLK\":[2],\"ARST\":[{by}],\"D\":[4],\"Q\":[5]}}}}"
        )
    };
    for (json, why) in [
        (module("", &cell("$xor", "[3]", "[4]", "5")), ""),
        (module("", &flop("2", 1, "3")), ""),
        (module("", &cell("$xor", "[3]", "[\"x\"]", "5")), "may take a value x"),
        (module("", &cell("$xor", "[3]", "[2]", "5")), "the clock"),
        (module("", &cell("$xor", "[3]", "[9]", "5")), "nothing drives"),
        (module("", &cell("$xor", "[3]", "[5]", "5")), "combinational loop"),
        (module("", &(cell("$and", "[3]", "[4]", "5") + "," + &flop("2", 1, "3"))), "several drivers"),
        (module("", &flop("2", 0, "3")), "falling edge"),
        (module("", &flop("3", 1, "4")), "no clock of the scene"),
        (module("", &flop("2", 1, "\"x\"")), "may take a value x"),
        (module("", &(made.clone() + &reset("3"))), ""),
        (module("", &(made + &reset("6"))), "and the design resets `y`"),
        (module("", &cell("$lt", &wide, &wide, "5")), "in 65 bits"),
        (module("", &cell("$dlatch", "[3]", "[4]", "5")), "is a latch"),
        (module("", &cell("leg", "[3]", "[4]", "5")), "the module `leg`"),
        (module(",\"z\":{\"direction\":\"inout\",\"bits\":[7]}", &cell("$xor", "[3]", "[4]", "5")), "inout"),
        (
            module(",\"z\":{\"direction\":\"output\",\"bits\":[\"x\"]}", &cell("$xor", "[3]", "[4]", "5")),
            "`z` may take",
        ),
        ("{}".to_string(), "a form that is not known"),
        ("{".to_string(), "no JSON"),
    ] {
        let said = read(&json).err().unwrap_or_default();
        assert!(if why.is_empty() { said.is_empty() } else { said.contains(why) }, "{why}: {said}\n{json}");
    }
}
