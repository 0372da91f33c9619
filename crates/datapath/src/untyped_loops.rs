//! The wirings of this crate, which are compiled here without their types.

use crate::untyped;

macro_rules! untyped_loops {
    ($($module:ident: $Law:ident, $Config:ident;)*) => {
        untyped! {
            crate::HybridLoop, crate::ConventionalLoop, $(crate::MethodLoop<crate::$Law>,)*
            crate::phantom::PhantomLoop, crate::phantom::PhantomSharedLoop, crate::phantom::PhantomIo,
            crate::gimbal::GimbalLoop, crate::gimbal::GimbalShearLoop,
        }
    };
}
laws!(untyped_loops);
