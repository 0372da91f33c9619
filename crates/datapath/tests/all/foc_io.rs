//! The filter of a modulator's bits against a direct convolution, and the serial interfaces against slaves.

use hpu_datapath::Block;
use hpu_datapath::foc::{Sinc3, SpiMaster, SpiMasterConfig, SsiMaster, SsiMasterConfig, sinc3, spi_master, ssi_master};

/// Returns the weights of three means over so many bits, each times that number.
fn weights(ratio: usize) -> Vec<i64> {
    let mean = |words: &[i64]| -> Vec<i64> {
        (0..words.len() + ratio - 1)
            .map(|at| (0..ratio).filter_map(|back| words.get(at.wrapping_sub(back))).sum())
            .collect()
    };
    mean(&mean(&vec![1; ratio]))
}

/// Compares a filter with the convolution of these bits.
fn filters(ratio_width: u32, bits: usize, next: &mut dyn FnMut() -> bool) {
    let (mut block, ratio) = (Sinc3::new(ratio_width).unwrap(), 1usize << ratio_width);
    Block::reset(&mut block);
    let weights = weights(ratio);
    assert_eq!(weights.iter().sum::<i64>(), (ratio * ratio * ratio) as i64);
    // The latest bits, as many as there are weights.
    let mut latest = vec![0i64; weights.len()];
    let mut words = 0;
    for bit in 0..bits {
        let data = next();
        latest[bit % weights.len()] = if data { 1 } else { -1 };
        let out = block.tick(sinc3::In { data: data.into(), strobe: 1 });
        assert_eq!(out.ready, i64::from((bit + 1) % ratio == 0), "bit {bit}");
        if out.ready == 1 {
            let (newer, older) = latest.split_at(bit % weights.len() + 1);
            let newest_first = newer.iter().rev().chain(older.iter().rev());
            let expected: i64 = weights.iter().zip(newest_first).map(|(weight, x)| weight * x).sum();
            assert_eq!(out.value, expected, "bit {bit}");
            words += 1;
        }
    }
    assert_eq!(words, bits / ratio);
}

#[test]
fn ten_million_bits_are_filtered_as_a_convolution_does() {
    // A modulator of the second order on a slow sine, whose bits are those that the filter is for.
    let (mut sums, mut at) = ([0.0f64; 2], 0.0f64);
    filters(7, 10_000_000, &mut || {
        at += 1.0;
        let bit = sums[1] >= 0.0;
        let fed = if bit { 1.0 } else { -1.0 };
        sums[0] += 0.9 * (at / 40_000.0).sin() - fed;
        sums[1] += sums[0] - 2.0 * fed;
        bit
    });
}

#[test]
fn bits_at_random_and_at_the_ends_are_filtered_as_a_convolution_does() {
    for ratio_width in [2, 3, 5, 10] {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            state >> 60 > 4
        };
        filters(ratio_width, 40_000, &mut random);
        // Long runs of one bit come to both ends, and go from one to the other.
        let mut bit = 0;
        filters(ratio_width, 40_000, &mut || {
            bit += 1;
            bit >> (ratio_width + 2) & 1 == 0
        });
    }
}

#[test]
fn all_bits_alike_make_the_greatest_and_the_least_word() {
    for ratio_width in 2..=10 {
        let most = 1i64 << (3 * ratio_width);
        for (data, expected) in [(1, most), (0, -most)] {
            let mut block = Sinc3::new(ratio_width).unwrap();
            Block::reset(&mut block);
            let bits = 3 << ratio_width;
            let last = (0..bits).map(|_| block.tick(sinc3::In { data, strobe: 1 })).last().unwrap();
            assert_eq!((last.value, last.ready), (expected, 1));
        }
    }
}

#[test]
fn without_a_strobe_nothing_is_taken() {
    let (mut block, mut other) = (Sinc3::new(3).unwrap(), Sinc3::new(3).unwrap());
    for bit in 0..400i64 {
        let data = (bit * bit / 3) & 1;
        let out = block.tick(sinc3::In { data, strobe: 1 });
        for _ in 0..bit % 4 {
            let idle = other.tick(sinc3::In { data: 1 - data, strobe: 0 });
            assert_eq!(idle.ready, 0);
        }
        assert_eq!(other.tick(sinc3::In { data, strobe: 1 }), out);
    }
}

/// A slave of a serial peripheral interface, as the modes are commonly drawn: its bits change at one edge of the clock,
/// and it reads at the other.
struct Slave {
    config: SpiMasterConfig,
    word: i64,
    sent: u32,
    read: i64,
    bits: u32,
    miso: i64,
    before: spi_master::Out<i64>,
}

impl Slave {
    fn bit(&mut self) {
        self.miso = self.word >> (self.config.width - 1 - self.sent.min(self.config.width - 1)) & 1;
        self.sent += 1;
    }

    fn see(&mut self, pins: spi_master::Out<i64>) {
        let SpiMasterConfig { cpol, cpha, .. } = self.config;
        if pins.select_n == 0 && self.before.select_n == 1 {
            (self.sent, self.read, self.bits) = (0, 0, 0);
            assert_eq!(pins.sclk, i64::from(cpol), "the clock rests at the select");
            if !cpha {
                self.bit();
            }
        } else if pins.select_n == 0 && pins.sclk != self.before.sclk {
            let leading = pins.sclk != i64::from(cpol);
            if leading == cpha {
                self.bit();
            } else {
                self.read = 2 * self.read + self.before.mosi;
                self.bits += 1;
            }
        } else {
            assert_eq!(pins.sclk, self.before.sclk, "no edge without a select");
        }
        self.before = pins;
    }
}

/// Exchanges words, and asserts the times of the frame.
fn exchanges(config: SpiMasterConfig, words: impl Iterator<Item = [i64; 2]>) {
    let mut block = SpiMaster::new(config).unwrap();
    let before = Block::reset(&mut block);
    let mut slave = Slave { config, word: 0, sent: 0, read: 0, bits: 0, miso: 0, before };
    let SpiMasterConfig { width, divider, lead, trail, gap, .. } = config;
    let latency = lead + (2 * width - 1) * divider + trail;
    for [data, word] in words {
        slave.word = word;
        let (mut edges, mut low) = (Vec::new(), 0);
        for clock in 0..=latency + gap {
            // A start in the midst of a frame, and other data, do nothing.
            let data = if clock == 0 { data } else { !data & ((1 << width) - 1) };
            let last = slave.before.sclk;
            let out = block.tick(spi_master::In { start: i64::from(clock < latency), data, miso: slave.miso });
            assert_eq!(out.ready, i64::from(clock == latency), "{config:?} {clock}");
            assert_eq!(out.busy, i64::from(clock < latency + gap), "{config:?} {clock}");
            low += u32::from(out.select_n == 0);
            edges.extend((out.sclk != last).then_some(clock));
            slave.see(out);
        }
        assert_eq!(low, latency, "{config:?}");
        assert!(edges.iter().copied().eq((0..2 * width).map(|edge| lead + edge * divider)), "{config:?} {edges:?}");
        assert_eq!((slave.read, slave.bits), (data, width), "{config:?}");
        assert_eq!(slave.before.word, word, "{config:?}");
    }
}

#[test]
fn every_short_word_goes_both_ways_in_every_mode() {
    for (cpol, cpha) in [(false, false), (false, true), (true, false), (true, true)] {
        for [divider, lead, trail, gap] in [[1, 1, 1, 1], [1, 2, 3, 4], [2, 5, 1, 3], [3, 1, 2, 1]] {
            let config = SpiMasterConfig { width: 5, divider, lead, trail, gap, cpol, cpha };
            exchanges(config, (0..1024).map(|pair| [pair % 32, pair / 32]));
        }
    }
}

#[test]
fn the_default_keeps_the_times_of_an_angle_sensor() {
    // The AS5047P has mode 1, 16 bits and at most 10 MHz; the data sheet here tells the other times.
    let config = SpiMasterConfig::default();
    let ns = |clocks: u32| 20 * clocks;
    assert!(ns(2 * config.divider) >= 100 && (ns(config.lead), ns(config.gap)) == (360, 380));
    assert!(config.trail >= config.divider && !config.cpol && config.cpha && config.width == 16);
    let frames = [[0x7ffe, 0x1234], [0xffff, 0x8001], [0, 0xffff], [0xc000, 0], [0x3fff, 0xa5a5]];
    exchanges(config, frames.into_iter());
}

#[test]
fn an_encoder_s_word_is_clocked_out_whole() {
    for (width, divider, pause) in [(5, 1, 1), (5, 2, 3), (13, 25, 1000), (32, 1, 2)] {
        let mut block = SsiMaster::new(SsiMasterConfig { width, divider, pause }).unwrap();
        let mut before = Block::reset(&mut block);
        assert_eq!(before.sclk, 1);
        let latency = (2 * width + 1) * divider;
        for turn in 0..if width == 5 { 32 } else { 12 } {
            let word = if width == 5 { turn } else { ((turn + 1) * 0x2545_f491) & ((1 << width) - 1) };
            let (mut bits, mut falls, mut data) = (0, 0, 1);
            for clock in 0..=latency + pause {
                let out = block.tick(ssi_master::In { start: i64::from(clock < latency), data });
                assert_eq!(out.ready, i64::from(clock == latency), "{width} {clock}");
                assert_eq!(out.busy, i64::from(clock < latency + pause), "{width} {clock}");
                // The encoder puts a bit out at each rising edge; behind the last one its line is low.
                if out.sclk > before.sclk {
                    data = if bits < width { word >> (width - 1 - bits) & 1 } else { 0 };
                    bits += 1;
                }
                falls += u32::from(out.sclk < before.sclk);
                before = out;
            }
            assert_eq!((before.word, bits, falls, before.sclk), (word, width + 1, width + 1, 1), "{width}");
        }
    }
}

#[test]
fn impossible_interfaces_are_refused_with_what_is_accepted() {
    let spi = |config| SpiMaster::new(config).err().map(|error| error.to_string()).unwrap_or_default();
    let normal = SpiMasterConfig::default();
    assert!(spi(SpiMasterConfig { width: 33, ..normal }).contains("WIDTH is 33; accepted: 2 to 32"));
    assert!(spi(SpiMasterConfig { divider: 0, ..normal }).contains("DIVIDER is 0; accepted: 1 to 65535"));
    assert!(spi(SpiMasterConfig { gap: 65_536, ..normal }).contains("GAP is 65536; accepted: 1 to 65535"));
    let sinc = Sinc3::new(11).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(sinc.contains("RATIO_WIDTH is 11; accepted: 2 to 10"), "{sinc}");
}
