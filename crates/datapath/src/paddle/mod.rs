//! The firmware of EPFL's haptic paddle as logic: from the codes of its converter and the lines of its encoder to the
//! switches of its bridge.

pub mod angle_select;
pub mod epfl_paddle_loop;
pub mod filtered_pid;
pub mod timer_pwm;
pub mod window_sum;

pub use angle_select::AngleSelect;
pub use epfl_paddle_loop::{EpflPaddleCircuit, EpflPaddleLoop, PaddleConfig, PaddleIn};
pub use filtered_pid::{FilteredPid, FilteredPidConfig};
pub use timer_pwm::{TimerPwm, TimerPwmConfig};
pub use window_sum::WindowSum;
