//! The combinational path of an arm, from sines and cosines to commands.

use hpu_signal::Narrowed;

use super::{
    CommandScaler, Config, CubeRoom, PhantomForward, PhantomTorque, command_scaler, cube_room, phantom_forward,
    phantom_torque,
};
use crate::circuit::instance;
use crate::{Block, ConfigError, Instance};

hpu_signal::ports! {
    /// The inputs of the path: the outputs of three sources of sines, and the words of the scene.
    pub struct In {
        sine1, cosine1, sine2, cosine2, sine3, cosine3, valid1, valid2, valid3,
        x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness,
    }
}

hpu_signal::ports! {
    /// The outputs of the path.
    pub struct Out of |path: &ForcePath| {
        x = path.forward.outputs().x;
        y = path.forward.outputs().y;
        z = path.forward.outputs().z;
        radius = path.forward.outputs().radius;
        force_x = path.room_walls.outputs().force_x;
        force_y = path.room_walls.outputs().force_y;
        force_z = path.room_walls.outputs().force_z;
        contact = path.room_walls.outputs().contact;
        torque1 = path.jacobian.outputs().torque1;
        torque2 = path.jacobian.outputs().torque2;
        torque3 = path.jacobian.outputs().torque3;
        command1 = path.scale[0].outputs().command, "Command of motor 1";
        command2 = path.scale[1].outputs().command, "Command of motor 2";
        command3 = path.scale[2].outputs().command, "Command of motor 3";
    }
}

/// The combinational blocks by instance label.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct ForcePath {
    pub(crate) forward: PhantomForward,
    pub(crate) room_walls: CubeRoom,
    pub(crate) jacobian: PhantomTorque,
    pub(crate) scale: [CommandScaler; 3],
}

impl ForcePath {
    pub(crate) fn new(config: &Config) -> Result<Self, ConfigError> {
        let Config { formats, lengths, gains, gain_frac, command_width, .. } = *config;
        let scaler = |gain| CommandScaler::new(formats.torque, gain, gain_frac, command_width);
        Ok(Self {
            forward: PhantomForward::new(&formats, lengths)?,
            room_walls: CubeRoom::new(&formats, config.force_limit)?,
            jacobian: PhantomTorque::new(&formats, lengths)?,
            scale: [scaler(gains[0])?, scaler(gains[1])?, scaler(gains[2])?],
        })
    }

    /// Computes the position of the tip, the forces on it, and the torques and commands that produce them, each with
    /// its losses.
    pub(crate) fn eval(&self, input: &In<i64>) -> Out<Narrowed> {
        let In { sine1, cosine1, sine2, cosine2, sine3, cosine3, valid1, valid2, valid3, .. } = *input;
        let In { x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness, .. } = *input;
        let posture = phantom_forward::In { sine1, cosine1, sine2, cosine2, sine3, cosine3 };
        let phantom_forward::Out { x, y, z, radius } = self.forward.eval(posture);
        let tip = cube_room::In {
            x: x.word,
            y: y.word,
            z: z.word,
            x_low,
            x_high,
            y_low,
            y_high,
            z_low,
            z_high,
            room,
            stiffness,
        };
        let cube_room::Out { force_x, force_y, force_z, contact } = self.room_walls.eval(tip);
        let pushed = phantom_torque::In {
            sine1,
            cosine1,
            sine2,
            cosine2,
            sine3,
            cosine3,
            x: x.word,
            z: z.word,
            force_x: force_x.word,
            force_y: force_y.word,
            force_z: force_z.word,
        };
        let phantom_torque::Out { torque1, torque2, torque3 } = self.jacobian.eval(pushed);
        let command = |joint: usize, torque: Narrowed| {
            self.scale[joint].eval(command_scaler::In { torque: torque.word, valid1, valid2, valid3 }).command
        };
        Out {
            x,
            y,
            z,
            radius,
            force_x,
            force_y,
            force_z,
            contact,
            torque1,
            torque2,
            torque3,
            command1: command(0, torque1),
            command2: command(1, torque2),
            command3: command(2, torque3),
        }
    }
}

/// Returns the instances of the path from sines to commands. The arguments are the nets of the sines, of their
/// validity, of the scene's words without the period, and the nets that the path drives.
pub(crate) fn path(
    path: &ForcePath,
    sines: &[usize],
    valid: &[usize],
    scene: &[usize],
    driven: &[usize],
) -> Vec<Instance> {
    let (tip, forces) = (&driven[..4], &driven[4..8]);
    let (torques, scaled) = (&driven[8..11], &driven[11..]);
    let pushed = [&[tip[0], tip[2]], &forces[..3], torques].concat();
    let mut all = vec![
        instance("forward", &path.forward, &[sines, tip].concat()),
        instance("room_walls", &path.room_walls, &[&tip[..3], scene, forces].concat()),
        instance("jacobian", &path.jacobian, &[sines, &pushed].concat()),
    ];
    for (joint, label) in ["scale1", "scale2", "scale3"].into_iter().enumerate() {
        let ports = [&[torques[joint]], valid, &[scaled[joint]]].concat();
        all.push(instance(label, &path.scale[joint], &ports));
    }
    all
}
