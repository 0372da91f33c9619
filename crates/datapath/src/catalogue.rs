//! The catalogue of all blocks.

use crate::base::listed::{Configured, Given, Listed};
use crate::foc::{
    Clarke, FocKnobLoop, FocLoop, InversePark, Park, PositionSelect, Sinc3, SpaceVector, SpiMaster, SsiMaster,
    ThreePhasePwm,
};
use crate::gimbal::{
    ControlSwitch, CrankTable, GimbalInverse, GimbalLoop, GimbalShearLoop, ImpedanceControl, ServoControl,
};
use crate::paddle::{AngleSelect, EpflPaddleLoop, FilteredPid, TimerPwm, WindowSum};
use crate::phantom::{
    CommandRegister, CommandScaler, CubeRoom, PhantomEngine, PhantomForward, PhantomIo, PhantomLoop, PhantomSharedLoop,
    PhantomTorque, SampleRegister, TrigCordic, TrigInterpolated, TrigQuarter, TrigTable,
};
use crate::{
    AnyBlock, AxisFront, Biquad, Block, ButterworthDifference, CommandLimiter, ConfigError, ConventionalLoop, Cordic,
    Displacement, EdgeTimer, FilteredDifference, Foaw, FractionalDifference, Generic, HybridLoop, InputShaper,
    LevantDifferentiator, MethodLoop, Pid, PositionCounter, Pwm, QuadratureDecoder, SampleTimer, Saturator,
    SequentialDivider, SquareRoot, Synchronizer, TorqueSum, TruncatingMultiplier, Unilateral, VelocityRegister,
    WindowDifference, ZeroOrderHold,
};

/// Lists every block and wiring once; what is known of all of them follows.
macro_rules! blocks {
    ($($block:ty),* $(,)?) => {
        /// Returns every block and wiring in its default configuration.
        pub fn registry() -> Vec<Box<dyn AnyBlock>> {
            vec![$(Box::<$block>::default()),*]
        }

        /// Returns the names of all blocks and wirings, in the order of [`registry`].
        pub fn block_names() -> &'static [&'static str] {
            &[$(<$block>::NAME),*]
        }

        /// Returns the block of that name in its default configuration.
        pub fn block_by_name(name: &str) -> Option<Box<dyn AnyBlock>> {
            $(if name == <$block>::NAME {
                return Some(Box::<$block>::default());
            })*
            None
        }

        /// Returns the wanted blocks: all in their default configuration, then in the others, each with its label.
        fn configurations(is_wanted: &dyn Fn(&str) -> bool) -> Result<Vec<(String, Box<dyn AnyBlock>)>, ConfigError> {
            let mut all: Vec<(String, Box<dyn AnyBlock>)> = Vec::new();
            $(if is_wanted(<$block>::NAME) {
                all.push(("default".to_string(), Box::<$block>::default()));
            })*
            $(if is_wanted(<$block>::NAME) {
                for (label, block) in <$block>::variants()? {
                    all.push((label.to_string(), Box::new(block)));
                }
            })*
            Ok(all)
        }

        fn of_generics(name: &str, given: &Given) -> Result<Box<dyn AnyBlock>, ConfigError> {
            $(if name == <$block>::NAME {
                return Ok(Box::new(<$block>::of_generics(given)?));
            })*
            panic!("{name} is in the catalogue")
        }
    };
}

/// The blocks, with the laws and the loops around them in their midst.
macro_rules! around_laws {
    ($($module:ident: $Law:ident, $Config:ident;)*) => {
        blocks! {
            Synchronizer, QuadratureDecoder, PositionCounter, Displacement, Unilateral, TruncatingMultiplier,
            VelocityRegister, ZeroOrderHold, TorqueSum, Saturator, CommandLimiter, Pwm, SequentialDivider, SquareRoot,
            Cordic, Biquad, Pid, FilteredDifference, ButterworthDifference, WindowDifference, Foaw, EdgeTimer,
            LevantDifferentiator, HybridLoop, ConventionalLoop, AxisFront, InputShaper, $(crate::$Law,)*
            $(MethodLoop<crate::$Law>,)* TrigTable, TrigQuarter, TrigInterpolated, TrigCordic, SampleRegister,
            PhantomForward, CubeRoom, PhantomTorque, CommandScaler, CommandRegister, PhantomEngine, PhantomLoop,
            PhantomSharedLoop, PhantomIo, GimbalInverse, CrankTable, ServoControl, ImpedanceControl, ControlSwitch,
            FractionalDifference, SampleTimer, GimbalLoop, GimbalShearLoop, WindowSum, FilteredPid, AngleSelect,
            TimerPwm, EpflPaddleLoop, Clarke, Park, InversePark, SpaceVector,
            ThreePhasePwm, Sinc3, SpiMaster, SsiMaster, FocLoop, PositionSelect, FocKnobLoop,
        }
    };
}
laws!(around_laws);

/// Returns every block in the configurations for which vectors are written and the VHDL is tested, each with the
/// variant's label. The configurations of [`registry`] have the label `default`. A label is unique among the variants
/// of its block.
///
/// # Panics
///
/// It never panics, because the configurations are constants.
pub fn variants() -> Vec<(String, Box<dyn AnyBlock>)> {
    variants_of(|_| true)
}

/// Returns the [`variants`] of the blocks whose names are wanted, in the same order. The others, some of which have
/// large tables, are not made.
///
/// # Panics
///
/// It never panics, because the configurations are constants.
pub fn variants_of(is_wanted: impl Fn(&str) -> bool) -> Vec<(String, Box<dyn AnyBlock>)> {
    configurations(&is_wanted).expect("constant configurations")
}

/// Returns the block of that name with these generics; its other generics are those of its default configuration.
/// Returns `None` if there is no such block.
///
/// # Errors
///
/// Returns an error if the block has no such generic, or no configuration with these values.
pub fn configured(name: &str, set: &[(&str, Generic)]) -> Option<Result<Box<dyn AnyBlock>, ConfigError>> {
    let block = block_by_name(name)?;
    Some(Given::new(&*block, set).and_then(|given| of_generics(name, &given)))
}
