//! Blocks of arithmetic, limiters and filters.

pub mod biquad;
pub mod command_limiter;
pub mod cordic;
pub mod input_shaper;
pub mod pid;
pub mod saturator;
pub mod sequential_divider;
pub mod square_root;
pub mod torque_sum;
pub mod truncating_multiplier;
pub mod unilateral;
pub mod zero_order_hold;
