//! The engine compared with the blocks that it replaces.

use hpu_datapath::phantom::{
    CommandScaler, Config, CubeRoom, PhantomEngine, PhantomForward, PhantomTorque, command_scaler, cube_room,
    phantom_engine, phantom_forward, phantom_torque,
};
use hpu_datapath::{Block, bundle, flatten};
use proptest::prelude::*;

use crate::cases::cases;

/// Returns the outputs that the four blocks compute one after the other.
fn chain(config: &Config, input: &phantom_engine::In<i64>) -> Vec<i64> {
    let phantom_engine::In { sine1, cosine1, sine2, cosine2, sine3, cosine3, valid1, valid2, valid3, .. } = *input;
    let phantom_engine::In { x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness, .. } = *input;
    let mut forward = PhantomForward::new(&config.formats, config.lengths).unwrap();
    let mut walls = CubeRoom::new(&config.formats, config.force_limit).unwrap();
    let mut jacobian = PhantomTorque::new(&config.formats, config.lengths).unwrap();
    let tip = forward.tick(phantom_forward::In { sine1, cosine1, sine2, cosine2, sine3, cosine3 });
    let phantom_forward::Out { x, y, z, .. } = tip;
    let seen = cube_room::In { x, y, z, x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness };
    let push = walls.tick(seen);
    let cube_room::Out { force_x, force_y, force_z, .. } = push;
    let torques = flatten(&jacobian.tick(phantom_torque::In {
        sine1,
        cosine1,
        sine2,
        cosine2,
        sine3,
        cosine3,
        x,
        z,
        force_x,
        force_y,
        force_z,
    }));
    let commands = torques.iter().zip(config.gains).map(|(&torque, gain)| {
        let mut scale =
            CommandScaler::new(config.formats.torque, gain, config.gain_frac, config.command_width).unwrap();
        scale.tick(command_scaler::In { torque, valid1, valid2, valid3 }).command
    });
    let mut all = flatten(&tip);
    all.extend(flatten(&push));
    all.extend(&torques);
    all.extend(commands);
    all
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_engine_is_the_chain_of_blocks_32_edges_after_each_capture(
        delay in 0u32..40,
        history in prop::collection::vec((any::<[u32; 17]>(), prop_oneof![0i64..64, 30i64..127], 1usize..90), 1..30),
    ) {
        let config = Config { delay, period_width: 7, ..Config::default() };
        let mut engine = PhantomEngine::new(config).unwrap();
        let signals = flatten(&engine.inputs());
        let (mut edge, mut capture) = (0u64, u64::from(delay));
        let mut running: Option<(u64, Vec<i64>)> = None;
        let mut shown = vec![0; 14];
        for (choices, period, stay) in history {
            let mut words: Vec<i64> =
                signals.iter().zip(choices).map(|(signal, bits)| signal.format.from_bits(bits.into())).collect();
            words.push(period);
            let input: phantom_engine::In<i64> = bundle(&words);
            for _ in 0..stay {
                if edge == capture {
                    running = Some((edge + 32, chain(&config, &input)));
                    capture += period.max(1).unsigned_abs();
                } else if let Some((_, done)) = running.take_if(|(end, _)| *end == edge) {
                    shown = done;
                }
                prop_assert_eq!(flatten(&engine.tick(input)), &shown[..], "edge {}", edge);
                edge += 1;
            }
        }
    }
}
