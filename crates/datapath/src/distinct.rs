//! Configurations that tell the generics of a block apart: no two whole numbers are equal, and truth values differ as
//! far as two can. A generic in another's place is other hardware in such a configuration.
//!
//! Blocks whose listed configurations do so are left out. Only proofs use these; no vectors are written for them.

use hpu_signal::Rounding;

use crate::catalogue::{configured, variants_of};
use crate::{AnyBlock, Generic, ROUNDING};

/// The label of these configurations.
const LABEL: &str = "all_distinct";

/// The generics of each block.
const DISTINCT: &[(&str, &str)] = &[
    ("velocity_register", "WIDTH=7 PERIOD_WIDTH=6 RESCALED=false SCALE_WIDTH=16 SCALE_FRAC=10 OUT_WIDTH=8"),
    (
        "biquad",
        "IN_INT=4 IN_FRAC=2 OUT_INT=3 OUT_FRAC=0 COEF_INT=1 COEF_FRAC=8 B0=5 B1=-7 B2=-1 A1=-13 A2=6 \
         PERIOD_WIDTH=9 ROUNDING=7",
    ),
    (
        "pid",
        "WIDTH=5 GAIN_WIDTH=7 GAIN_FRAC=3 COMMAND_WIDTH=6 LIMIT=21 BACK_CALCULATION=true BACK=2 \
         FORWARDED=true PERIOD_WIDTH=4",
    ),
    (
        "hybrid_loop",
        "POSITION_WIDTH=8 STIFFNESS_WIDTH=7 STIFFNESS_FRAC=1 DAMPING_WIDTH=3 DAMPING_FRAC=4 \
         PERIOD_WIDTH=6 VELOCITY_WIDTH=5 RESCALED=false SCALE_WIDTH=16 SCALE_FRAC=10 PWM_WIDTH=9 \
         SATURATE=true ANTIPHASE=false LATCHED=true FLOATING=false DEAD_TIME=0 SETTLING=11",
    ),
    (
        "conventional_loop",
        "POSITION_WIDTH=8 STIFFNESS_WIDTH=7 STIFFNESS_FRAC=1 DAMPING_WIDTH=3 DAMPING_FRAC=4 \
         PERIOD_WIDTH=6 VELOCITY_WIDTH=5 RESCALED=false SCALE_WIDTH=16 SCALE_FRAC=10 PWM_WIDTH=9 \
         SATURATE=true ANTIPHASE=false LATCHED=true FLOATING=false DEAD_TIME=0 SETTLING=11",
    ),
    (
        "input_shaper",
        "ENABLED=true TORQUE_WIDTH=8 PERIOD_WIDTH=6 PHASE=5 B0=1072549859 B1=-2145099718 B2=1072549860 \
         A1=-2145098394 A2=1071359217",
    ),
    (
        "sampled_wall",
        "WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 PERIOD_WIDTH=12 \
         SCALE_WIDTH=7 SCALE_FRAC=4 TORQUE_WIDTH=11 SPRING_HELD=true ESTIMATOR=1 RATIO=2 SHIFT=15 \
         WEIGHT=19 WINDOW=13 NOISE=14 VELOCITY_FRAC=6 RELIEF=20 ROOT_GAIN=333 SLEW=17 B0=21 A1=22 GUARD=23",
    ),
    (
        "virtual_coupling",
        "WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 PERIOD_WIDTH=12 \
         SCALE_WIDTH=7 SCALE_FRAC=4 TORQUE_WIDTH=11 EXTENSION_FRAC=6 GAIN_FRAC=13 SHARE=4928 FREE=2048 \
         HELD=832",
    ),
    (
        "passivity_controller",
        "WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 PERIOD_WIDTH=12 \
         SCALE_WIDTH=7 SCALE_FRAC=4 TORQUE_WIDTH=11 EXACT=true ENERGY_WIDTH=21 CREDIT=4000",
    ),
    (
        "energy_bounding",
        "WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 PERIOD_WIDTH=12 \
         SCALE_WIDTH=7 SCALE_FRAC=4 TORQUE_WIDTH=11 LEAST_CONSERVATIVE=false C1=50 C2=41 BOUND_FRAC=2 \
         BOUND_WIDTH=6 ENERGY_WIDTH=22 ROOT_WIDTH=40",
    ),
    (
        "passive_spring",
        "WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 PERIOD_WIDTH=12 \
         SCALE_WIDTH=7 SCALE_FRAC=4 TORQUE_WIDTH=11 EXTENSION_FRAC=14 ALPHA=300 REVIVE=false",
    ),
    (
        "braking_pulse",
        "WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 PERIOD_WIDTH=12 \
         SCALE_WIDTH=7 SCALE_FRAC=4 TORQUE_WIDTH=11 PULSE=333",
    ),
    (
        "sampled_wall_loop",
        "POSITION_WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 \
         PERIOD_WIDTH=12 SCALE_WIDTH=7 SCALE_FRAC=4 PWM_WIDTH=11 ANTIPHASE=true LATCHED=true \
         FLOATING=false DEAD_TIME=18 SHAPER_ENABLED=true SHAPER_PHASE=16 SHAPER_B0=1072549859 \
         SHAPER_B1=-2145099718 SHAPER_B2=1072549860 SHAPER_A1=-2145098394 SHAPER_A2=1071359217 \
         SPRING_HELD=true ESTIMATOR=1 RATIO=2 SHIFT=15 WEIGHT=19 WINDOW=13 NOISE=14 VELOCITY_FRAC=6 \
         RELIEF=20 ROOT_GAIN=333 SLEW=17 B0=21 A1=22 GUARD=23",
    ),
    (
        "virtual_coupling_loop",
        "POSITION_WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 \
         PERIOD_WIDTH=12 SCALE_WIDTH=7 SCALE_FRAC=4 PWM_WIDTH=11 ANTIPHASE=true LATCHED=true \
         FLOATING=false DEAD_TIME=1 SHAPER_ENABLED=true SHAPER_PHASE=16 SHAPER_B0=1072549859 \
         SHAPER_B1=-2145099718 SHAPER_B2=1072549860 SHAPER_A1=-2145098394 SHAPER_A2=1071359217 \
         EXTENSION_FRAC=6 GAIN_FRAC=13 SHARE=4928 FREE=2048 HELD=832",
    ),
    (
        "passivity_controller_loop",
        "POSITION_WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 \
         PERIOD_WIDTH=12 SCALE_WIDTH=7 SCALE_FRAC=4 PWM_WIDTH=11 ANTIPHASE=true LATCHED=true \
         FLOATING=false DEAD_TIME=1 SHAPER_ENABLED=true SHAPER_PHASE=16 SHAPER_B0=1072549859 \
         SHAPER_B1=-2145099718 SHAPER_B2=1072549860 SHAPER_A1=-2145098394 SHAPER_A2=1071359217 EXACT=true \
         ENERGY_WIDTH=21 CREDIT=4000",
    ),
    (
        "energy_bounding_loop",
        "POSITION_WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 \
         PERIOD_WIDTH=12 SCALE_WIDTH=7 SCALE_FRAC=4 PWM_WIDTH=11 ANTIPHASE=true LATCHED=true \
         FLOATING=false DEAD_TIME=1 SHAPER_ENABLED=true SHAPER_PHASE=16 SHAPER_B0=1072549859 \
         SHAPER_B1=-2145099718 SHAPER_B2=1072549860 SHAPER_A1=-2145098394 SHAPER_A2=1071359217 \
         LEAST_CONSERVATIVE=false C1=50 C2=41 BOUND_FRAC=2 BOUND_WIDTH=6 ENERGY_WIDTH=22 ROOT_WIDTH=40",
    ),
    (
        "passive_spring_loop",
        "POSITION_WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 \
         PERIOD_WIDTH=12 SCALE_WIDTH=7 SCALE_FRAC=4 PWM_WIDTH=11 ANTIPHASE=true LATCHED=true \
         FLOATING=false DEAD_TIME=1 SHAPER_ENABLED=true SHAPER_PHASE=16 SHAPER_B0=1072549859 \
         SHAPER_B1=-2145099718 SHAPER_B2=1072549860 SHAPER_A1=-2145098394 SHAPER_A2=1071359217 \
         EXTENSION_FRAC=14 ALPHA=300 REVIVE=false",
    ),
    (
        "braking_pulse_loop",
        "POSITION_WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 \
         PERIOD_WIDTH=12 SCALE_WIDTH=7 SCALE_FRAC=4 PWM_WIDTH=11 ANTIPHASE=true LATCHED=true \
         FLOATING=false DEAD_TIME=1 SHAPER_ENABLED=true SHAPER_PHASE=16 SHAPER_B0=1072549859 \
         SHAPER_B1=-2145099718 SHAPER_B2=1072549860 SHAPER_A1=-2145098394 SHAPER_A2=1071359217 PULSE=333",
    ),
    (
        "torque_table_loop",
        "POSITION_WIDTH=9 STIFFNESS_WIDTH=8 STIFFNESS_FRAC=3 DAMPING_WIDTH=10 DAMPING_FRAC=5 \
         PERIOD_WIDTH=12 SCALE_WIDTH=7 SCALE_FRAC=4 PWM_WIDTH=11 ANTIPHASE=true LATCHED=true \
         FLOATING=false DEAD_TIME=1 SHAPER_ENABLED=true SHAPER_PHASE=16 SHAPER_B0=1072549859 \
         SHAPER_B1=-2145099718 SHAPER_B2=1072549860 SHAPER_A1=-2145098394 SHAPER_A2=1071359217 \
         TABLE_BITS=2 SHIFT=6 T0=-382 T1=235 T2=852 T3=-530 T4=87 T5=704 T6=-678 T7=-61 T8=556 T9=-826 \
         T10=-209 T11=408 T12=-974 T13=-357 T14=260 T15=877 T16=-505 T17=112 T18=729 T19=-653 T20=-36 \
         T21=581 T22=-801 T23=-184 T24=433 T25=-949 T26=-332 T27=285 T28=902 T29=-480 T30=137 T31=754",
    ),
    (
        "phantom_forward",
        "TRIG_INT=1 TRIG_FRAC=14 LENGTH_FRAC=12 LENGTH_1=575 LENGTH_2=573 POSITION_INT=0 POSITION_FRAC=13",
    ),
    (
        "cube_room",
        "POSITION_INT=2 POSITION_FRAC=14 STIFFNESS_INT=8 STIFFNESS_FRAC=0 FORCE_INT=4 FORCE_FRAC=9 \
         FORCE_LIMIT=2176",
    ),
    (
        "phantom_torque",
        "TRIG_INT=3 TRIG_FRAC=16 LENGTH_FRAC=12 LENGTH_1=573 LENGTH_2=572 POSITION_INT=0 POSITION_FRAC=14 \
         FORCE_INT=4 FORCE_FRAC=8 TORQUE_INT=1 TORQUE_FRAC=10",
    ),
    (
        "phantom_engine",
        "PERIOD_WIDTH=6 DELAY=2 TRIG_INT=4 TRIG_FRAC=16 LENGTH_FRAC=12 LENGTH_1=573 LENGTH_2=571 \
         POSITION_INT=0 POSITION_FRAC=14 STIFFNESS_INT=9 STIFFNESS_FRAC=7 FORCE_INT=5 FORCE_FRAC=8 \
         FORCE_LIMIT=2176 TORQUE_INT=3 TORQUE_FRAC=10 GAIN_1=201134 GAIN_2=220289 GAIN_3=220288 \
         GAIN_FRAC=1 COMMAND_WIDTH=13",
    ),
    (
        "phantom_loop",
        "POSITION_WIDTH=6 PERIOD_WIDTH=11 DEPTH_WIDTH=5 TURN_NUM_1=4 TURN_DEN_1=200 TURN_NUM_2=3 \
         TURN_DEN_2=102 TURN_NUM_3=1 TURN_DEN_3=100 TRIG_INT=9 TRIG_FRAC=22 LENGTH_FRAC=26 \
         LENGTH_1=2348810 LENGTH_2=2348812 POSITION_INT=2 POSITION_FRAC=24 STIFFNESS_INT=16 \
         STIFFNESS_FRAC=14 FORCE_INT=10 FORCE_FRAC=18 FORCE_LIMIT=557056 TORQUE_INT=7 TORQUE_FRAC=20 \
         GAIN_1=201134 GAIN_2=220291 GAIN_3=220289 GAIN_FRAC=0 COMMAND_WIDTH=17 DELAY=8",
    ),
    (
        "phantom_shared_loop",
        "POSITION_WIDTH=12 PERIOD_WIDTH=11 DEPTH_WIDTH=7 TURN_NUM_1=6 TURN_DEN_1=200 TURN_NUM_2=10 \
         TURN_DEN_2=100 TURN_NUM_3=1 TURN_DEN_3=98 TRIG_INT=9 TRIG_FRAC=22 LENGTH_FRAC=24 \
         LENGTH_1=2348811 LENGTH_2=2348810 POSITION_INT=3 POSITION_FRAC=25 STIFFNESS_INT=17 \
         STIFFNESS_FRAC=0 FORCE_INT=8 FORCE_FRAC=16 FORCE_LIMIT=557056 TORQUE_INT=2 TORQUE_FRAC=20 \
         GAIN_1=201134 GAIN_2=220289 GAIN_3=220288 GAIN_FRAC=5 COMMAND_WIDTH=18 DELAY=4",
    ),
    ("phantom_io", "POSITION_WIDTH=8 COMMAND_WIDTH=7"),
    (
        "servo_control",
        "ANGLE_WIDTH=6 COUNT_WIDTH=4 STEP=37 STEP_FRAC=10 P_WIDTH=2 P_FRAC=1 D_WIDTH=9 D_FRAC=3 \
         DRIVE_WIDTH=7 WINDOW=5",
    ),
    (
        "impedance_control",
        "LENGTH_WIDTH=5 LENGTH_FRAC=2 FORCE_WIDTH=4 FORCE_LIMIT=11 S_WIDTH=3 S_FRAC=0 K_WIDTH=9 K_FRAC=1 \
         GAIN=7 GAIN_FRAC=6 DRIVE_WIDTH=8",
    ),
    (
        "fractional_difference",
        "IN_INT=2 IN_FRAC=1 OUT_INT=0 OUT_FRAC=4 GAIN_WIDTH=9 GAIN_FRAC=7 COEF_FRAC=8 ORDER_NUM=3 \
         ORDER_DEN=6 MEMORY=5",
    ),
    (
        "gimbal_loop",
        "LENGTH_WIDTH=10 LENGTH_FRAC=11 CRANK_LENGTH=60 ROD_LENGTH=121 OFFSET=37 ANGLE_WIDTH=9 LIMIT=70 \
         GUARD=0 ROTATIONS=8 COUNT_WIDTH=12 COUNT_NUM=2 COUNT_DEN=181 STEP=1999 STEP_FRAC=13 P_WIDTH=22 \
         P_FRAC=15 D_WIDTH=23 D_FRAC=16 WINDOW=20 CRANK_STEP=3999 CRANK_STEP_FRAC=14 CRANK_P_WIDTH=25 \
         CRANK_P_FRAC=17 CRANK_D_WIDTH=26 CRANK_D_FRAC=18 CRANK_WINDOW=28 FORCE_WIDTH=7 FORCE_LIMIT=101 \
         S_WIDTH=19 S_FRAC=4 K_WIDTH=5 K_FRAC=1 GAIN=102400 GAIN_FRAC=24 DRIVE_WIDTH=6 TAKE_RADIUS=false \
         BUMPLESS=true DECAY=3 PERIOD_WIDTH=27 SHEAR_WIDTH=31 SHEAR_FRAC=30",
    ),
    (
        "gimbal_shear_loop",
        "LENGTH_WIDTH=10 LENGTH_FRAC=11 CRANK_LENGTH=60 ROD_LENGTH=121 OFFSET=37 ANGLE_WIDTH=9 LIMIT=70 \
         GUARD=0 ROTATIONS=8 COUNT_WIDTH=12 COUNT_NUM=2 COUNT_DEN=181 STEP=1999 STEP_FRAC=13 P_WIDTH=22 \
         P_FRAC=15 D_WIDTH=23 D_FRAC=16 WINDOW=20 CRANK_STEP=3999 CRANK_STEP_FRAC=14 CRANK_P_WIDTH=25 \
         CRANK_P_FRAC=17 CRANK_D_WIDTH=26 CRANK_D_FRAC=18 CRANK_WINDOW=28 FORCE_WIDTH=7 FORCE_LIMIT=101 \
         S_WIDTH=19 S_FRAC=4 K_WIDTH=5 K_FRAC=1 GAIN=102400 GAIN_FRAC=24 DRIVE_WIDTH=6 TAKE_RADIUS=false \
         BUMPLESS=true DECAY=3 PERIOD_WIDTH=27 SHEAR_WIDTH=31 SHEAR_FRAC=30 COEF_FRAC=29 ORDER_NUM=33 \
         ORDER_DEN=34 MEMORY=35",
    ),
];

/// Small configurations in which every rounding is proved. The multiplier's are among its listed ones.
const ROUNDED: &[(&str, &str)] = &[
    (
        "biquad",
        "IN_INT=3 IN_FRAC=1 OUT_INT=2 OUT_FRAC=1 COEF_INT=1 COEF_FRAC=3 B0=5 B1=-7 B2=3 A1=-13 A2=6 \
         PERIOD_WIDTH=3",
    ),
    ("filtered_difference", "WIDTH=5 PERIOD_WIDTH=4 SHIFT=2 OUT_FRAC=3"),
    ("input_shaper", "ENABLED=true TORQUE_WIDTH=3 PERIOD_WIDTH=3 B0=268435456 B1=-268435456 B2=201326592"),
];

/// Returns the wanted blocks in the configurations that are proved: those of [`variants_of`], then those that only
/// proofs use, which have the label `all_distinct`, or `rounds_` and the name of a rounding.
///
/// # Panics
///
/// It never panics, because the configurations are constants.
pub fn proved_variants_of(is_wanted: impl Fn(&str) -> bool) -> Vec<(String, Box<dyn AnyBlock>)> {
    let mut all = variants_of(&is_wanted);
    let wanted = DISTINCT.iter().filter(|(name, _)| is_wanted(name));
    all.extend(wanted.map(|(name, generics)| (LABEL.to_string(), of(name, generics, None))));
    let wanted = ROUNDED.iter().filter(|(name, _)| is_wanted(name));
    let wanted = wanted.flat_map(|of_block| Rounding::ALL.map(|rounding| (of_block, rounding)));
    all.extend(wanted.map(|((name, generics), rounding)| {
        (format!("rounds_{}", rounding.name()), of(name, generics, Some(rounding)))
    }));
    all
}

fn of(name: &str, generics: &'static str, rounding: Option<Rounding>) -> Box<dyn AnyBlock> {
    let generic = |text: &'static str| {
        let (name, value) = text.split_once('=').expect("a name and a value");
        let number = || Generic::Integer(value.parse().expect("a whole number"));
        (name, value.parse().map_or_else(|_| number(), Generic::Boolean))
    };
    let rounding = rounding.map(|rounding| (ROUNDING, Generic::Integer(rounding.number().into())));
    let set: Vec<_> = generics.split_whitespace().map(generic).chain(rounding).collect();
    configured(name, &set).expect("it is listed").expect("a constant configuration")
}
