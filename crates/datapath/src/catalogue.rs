//! The catalogue of all blocks.

use crate::{
    AnyBlock, Biquad, CommandLimiter, ConventionalLoop, Displacement, EdgeTimer, FilteredDifference, Foaw, HybridLoop,
    PositionCounter, Pwm, QuadratureDecoder, Saturator, SequentialDivider, SquareRoot, Synchronizer, TorqueSum,
    TruncatingMultiplier, Unilateral, VelocityRegister, WindowDifference, ZeroOrderHold, method_variants, phantom,
};

/// Returns every block and wiring in its default configuration.
#[must_use]
pub fn registry() -> Vec<Box<dyn AnyBlock>> {
    let mut all: Vec<Box<dyn AnyBlock>> = vec![
        Box::new(Synchronizer::default()),
        Box::new(QuadratureDecoder::default()),
        Box::new(PositionCounter::default()),
        Box::new(Displacement::default()),
        Box::new(Unilateral::default()),
        Box::new(TruncatingMultiplier::default()),
        Box::new(VelocityRegister::default()),
        Box::new(ZeroOrderHold::default()),
        Box::new(TorqueSum::default()),
        Box::new(Saturator::default()),
        Box::new(CommandLimiter::default()),
        Box::new(Pwm::default()),
        Box::new(SequentialDivider::default()),
        Box::new(SquareRoot::default()),
        Box::new(Biquad::default()),
        Box::new(FilteredDifference::default()),
        Box::new(WindowDifference::default()),
        Box::new(Foaw::default()),
        Box::new(EdgeTimer::default()),
        Box::new(HybridLoop::default()),
        Box::new(ConventionalLoop::default()),
    ];
    all.extend(method_variants::registry());
    all.extend(phantom::registry());
    all
}

/// Returns the block of that name in its default configuration.
#[must_use]
pub fn block_by_name(name: &str) -> Option<Box<dyn AnyBlock>> {
    registry().into_iter().find(|block| block.name() == name)
}
