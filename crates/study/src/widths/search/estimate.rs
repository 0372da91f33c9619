//! The lookup tables of a loop from its widths, without tools.
//!
//! A loop is mostly its two multipliers. These are mostly full adders that add up partial products. There is one for
//! each pair of bits that meet below the product's last kept bit. Where a product saturates, its upper bits are
//! examined, and each pair above that bit costs one too. The velocity counts no more bits than the position has: the
//! others repeat its sign. The rest grows with the modulator's width, with the bits by which the velocity's saturation
//! narrows, and with the position that a conventional loop holds.
//!
//! The seven weights are least squares of the relative error on 35 loops as Yosys maps them for the iCE40, rounded
//! (positions of 8 to 24 bits, gains of 3 to 24, modulators of 8 to 14; `testbench/record/widths.txt` lists them). On
//! these the estimate is off by 3.7 % rms and at most 10.02 %. On the twelve other loops of `tests/all/width_search.rs`
//! it is off by 3.1 % rms, and nowhere by more than [`ESTIMATE_ERROR`]. An estimate orders designs; it does not replace
//! synthesis.

use hpu_datapath::LoopConfig;

/// The largest relative error of the estimate on loops that it was not fitted to.
pub const ESTIMATE_ERROR: f64 = 0.1;

/// Returns the estimated LUT4s of a loop; `held` says that the position is held between samples.
pub fn estimate(config: &LoopConfig, held: bool) -> u32 {
    let LoopConfig { position_width, stiffness, damping, velocity_width, pwm, saturate, .. } = *config;
    let frac = |format: hpu_signal::Format| format.frac().unsigned_abs();
    let spring = Pairs::new(position_width, stiffness.width(), pwm.width + frac(stiffness));
    let moving = velocity_width.min(position_width);
    let drag = Pairs::new(moving, damping.width(), pwm.width + 1 + frac(damping));
    let above = f64::from(u8::from(saturate));
    let narrowed = position_width.saturating_sub(velocity_width);
    let held = if held { position_width } else { 0 };
    let luts = 2.2 * spring.below
        + 2.3 * spring.above * above
        + 3.6 * drag.below
        + 4.2 * drag.above * above
        + 16.0 * f64::from(pwm.width)
        + 8.0 * f64::from(narrowed)
        + 5.3 * f64::from(held);
    luts.round() as u32
}

/// The number of pairs of bits of two factors, by whether they meet below a column of the product.
struct Pairs {
    below: f64,
    above: f64,
}

impl Pairs {
    fn new(a: u32, b: u32, column: u32) -> Self {
        let below: u32 = (0..a).map(|bit| column.saturating_sub(bit).min(b)).sum();
        Self { below: f64::from(below), above: f64::from(a * b - below) }
    }
}
