//! The conversion of edges to picoseconds and back.

use hpu_signal::{Clock, Cycle};
use proptest::prelude::*;

const VGA_HZ: u64 = 25_175_000;
const BOARD_HZ: u64 = 50_000_000;

#[test]
fn whole_periods_have_their_exact_times() {
    let board = Clock::new(BOARD_HZ).unwrap();
    assert_eq!(board.picoseconds(Cycle(1)), 20_000);
    assert_eq!(board.picoseconds(Cycle(BOARD_HZ)), 1_000_000_000_000);
    // 1/25.175 MHz = 39721.946... ps; 1007 periods of 25.175 MHz are exactly 40 us.
    let vga = Clock::new(VGA_HZ).unwrap();
    assert_eq!(vga.picoseconds(Cycle(1)), 39_721);
    assert_eq!(vga.picoseconds(Cycle(2)), 79_443);
    assert_eq!(vga.picoseconds(Cycle(1007)), 40_000_000);
    assert_eq!(vga.picoseconds(Cycle(VGA_HZ * 3600)), 3_600_000_000_000_000);
}

#[test]
fn a_pin_that_changes_between_two_edges_is_sampled_by_the_later_one() {
    let board = Clock::new(BOARD_HZ).unwrap();
    for (picoseconds, edge) in [(0, 0), (1, 1), (19_999, 1), (20_000, 1), (20_001, 2), (40_000, 2)] {
        assert_eq!(board.first_edge_at(picoseconds), Cycle(edge));
    }
    let vga = Clock::new(VGA_HZ).unwrap();
    // The first edge is at 39721.946 ps.
    for (picoseconds, edge) in [(39_721, 1), (39_722, 2), (79_443, 2), (79_444, 3)] {
        assert_eq!(vga.first_edge_at(picoseconds), Cycle(edge));
    }
}

proptest! {
    #[test]
    fn the_first_edge_at_the_time_of_an_edge_is_that_edge(
        edge in 0u64..1 << 40, frequency_hz in prop::sample::select(vec![VGA_HZ, BOARD_HZ, 1, 10_000_000_000])
    ) {
        // A u64 holds times of up to 1e7 s in picoseconds.
        let edge = edge % (frequency_hz * 10_000_000);
        let clock = Clock::new(frequency_hz).unwrap();
        prop_assert_eq!(clock.first_edge_at(clock.picoseconds(Cycle(edge))), Cycle(edge));
    }

    #[test]
    fn no_edge_lies_between_a_time_and_its_first_edge(
        picoseconds in any::<u64>(), frequency_hz in prop::sample::select(vec![VGA_HZ, BOARD_HZ])
    ) {
        let clock = Clock::new(frequency_hz).unwrap();
        let edge = u128::from(clock.first_edge_at(picoseconds).0);
        // This is exact: edge / f >= t > (edge - 1) / f, in picoseconds times hertz.
        let time = u128::from(picoseconds) * u128::from(frequency_hz);
        prop_assert!(edge * 1_000_000_000_000 >= time);
        prop_assert!(edge == 0 || (edge - 1) * 1_000_000_000_000 < time);
    }
}

#[test]
fn seconds_and_edges_agree_over_an_hour() {
    for frequency_hz in [VGA_HZ, BOARD_HZ] {
        let clock = Clock::new(frequency_hz).unwrap();
        for second in 0..3600u32 {
            let edge = Cycle(frequency_hz * u64::from(second));
            assert_eq!(clock.seconds(edge), f64::from(second));
            assert_eq!(clock.edges(f64::from(second)), edge.0);
        }
        assert_eq!(clock.period_s(), 1.0 / frequency_hz as f64);
    }
}

#[test]
fn an_impossible_clock_is_refused_with_what_is_accepted() {
    for frequency_hz in [0, 10_000_000_001] {
        let message = Clock::new(frequency_hz).unwrap_err().to_string();
        assert!(message.contains("from 1 Hz to 10 GHz"), "{message}");
    }
}
