//! Field-oriented control of a three-phase motor: from the words of current sensors and the lines of an encoder to the
//! gates of three legs.

pub mod clarke;
pub mod foc_knob_loop;
pub mod foc_loop;
pub mod inverse_park;
pub mod park;
pub mod position_select;
pub mod sinc3;
pub mod space_vector;
pub mod spi_master;
pub mod ssi_master;
pub mod three_phase_pwm;

pub use clarke::{Clarke, ClarkeConfig};
pub use foc_knob_loop::{FocKnobLoop, KnobCircuit, KnobConfig, KnobIn};
pub use foc_loop::{FocCircuit, FocConfig, FocIn, FocLoop, FocOut};
pub use inverse_park::InversePark;
pub use park::{Park, RotationConfig};
pub use position_select::PositionSelect;
pub use sinc3::Sinc3;
pub use space_vector::{SpaceVector, SpaceVectorConfig};
pub use spi_master::{SpiMaster, SpiMasterConfig};
pub use ssi_master::{SsiMaster, SsiMasterConfig};
pub use three_phase_pwm::{ThreePhasePwm, ThreePhasePwmConfig};
