//! Reading `[model]` of an axis: the physics that is modelled, and the combinations that are accepted.

use crate::axis::Scene;
use crate::axis::parts::{Device, Hand};
use crate::axis::read_device::{agree_on_dead_band, kind};
use crate::axis::rows as keys;
use crate::head::model::{BridgeModel, Datapath, EncoderModel, FIXED, Friction, Model, Solver, Winding, step};
use crate::schema::section::Section;
use crate::schema::source::SceneError;

pub(crate) fn model(s: &Section, device: &Device) -> Result<Model, SceneError> {
    use keys::{model as key, model_bridge as of_a_bridge, model_law as of_the_law, model_motor as of_a_motor};
    for (key, lacks) in
        [(of_a_bridge::bridge.name, "a force amplifier and no bridge"), (of_a_motor::winding.name, "no winding")]
    {
        if let (Device::Mass(_), true) = (device, s.has(key)) {
            return Err(s.error(key, format!("a mass has {lacks}; leave this out")));
        }
    }
    s.accept(&["axis", kind(device)])?;
    let solver = s.read(&key::solver)?;
    Ok(Model {
        solver,
        step_s: step(s, &key::step, solver)?,
        datapath: s.read(&key::datapath)?,
        bridge: s.read(&of_a_bridge::bridge)?,
        winding: s.read(&of_a_motor::winding)?,
        friction: friction(s)?,
        encoder: s.read(&of_the_law::encoder)?,
        delay_s: s.read(&of_the_law::delay)?,
    })
}

/// Reads the part of a network's physics that is modelled: exact flows alone, by words.
pub(crate) fn model_of_network(s: &Section) -> Result<Model, SceneError> {
    s.accept(&["axis", "network"])?;
    let solver = s.read(&keys::model::solver)?;
    if !matches!(solver, Solver::Events | Solver::Clock) {
        return Err(s.error("solver", "a network is flowed exactly; write \"events\" or \"clock\""));
    }
    let friction = friction(s)?;
    let refused =
        |key: &str, is: &str| Err(s.error(key, format!("not of a network; write \"{is}\", or leave this out")));
    let datapath = s.read(&keys::model::datapath)?;
    if datapath != Datapath::Words {
        return refused("datapath", "words");
    }
    if matches!(friction, Friction::Smoothed { .. }) {
        return refused("friction", "stick_slip");
    }
    let encoder = s.read(&keys::model_law::encoder)?;
    if encoder != EncoderModel::Quantised {
        return refused("encoder", "quantised");
    }
    Ok(Model {
        solver,
        step_s: step(s, &keys::model::step, solver)?,
        datapath,
        bridge: s.read(&keys::model_bridge::bridge)?,
        winding: Winding::Inductive,
        friction,
        encoder,
        delay_s: s.read(&keys::model_law::delay)?,
    })
}

pub(crate) fn friction(s: &Section) -> Result<Friction, SceneError> {
    use keys::model_friction as key;
    let kind = s.read(&key::friction)?;
    if kind == keys::SMOOTHED {
        return Ok(Friction::Smoothed { speed_rad_per_s: s.read(&key::friction_speed)? });
    }
    if s.has(key::friction_speed.name) {
        let reason = "only smoothed friction has it; write friction = \"smoothed\" beside it";
        return Err(s.error(key::friction_speed.name, reason));
    }
    Ok(kind)
}

/// Checks the conditions between `[model]` and the rest of the scene, and among its own keys.
pub(crate) fn agree_on_model(scene: &Scene) -> Result<(), SceneError> {
    let refused = |key: &str, reason: String| Err(scene.error(key, reason));
    let Model { solver, datapath, bridge, winding, friction, encoder, .. } = scene.model;
    let name = solver.name();
    let on_bridge = scene.has_bridge() && bridge == BridgeModel::Switching;
    agree_on_dead_band(scene, &scene.bridge, bridge)?;
    if datapath == Datapath::Linear {
        if scene.bridge.dead_band_v > 0.0 {
            return refused("bridge.dead_band", "the linear law has none; leave this out".into());
        }
        if solver != Solver::Events {
            let reason = format!("\"{name}\" is not for the linear law, which is flowed exactly; leave it out");
            return refused("model.solver", reason);
        }
        if winding == Winding::Resistive {
            return refused("model.winding", "the linear law has its inductance; leave this out".into());
        }
        if matches!(friction, Friction::Smoothed { .. }) {
            return refused("model.friction", "the linear law has no Coulomb friction; write \"none\"".into());
        }
    }
    if winding == Winding::Resistive {
        if on_bridge {
            let reason = "without inductance nothing smooths the switching; write bridge = \"averaged\" beside it";
            return refused("model.winding", reason.into());
        }
        if matches!(scene.device, Device::Motor(motor) if motor.initial_current_a != 0.0) {
            let reason = "the current of a \"resistive\" winding follows from voltage and speed; leave this out";
            return refused("device.initial_current", reason.into());
        }
    }
    if solver == Solver::Sample && on_bridge {
        let reason = "\"sample\" meets the bridge once a sample and sees no switching; write bridge = \"averaged\"";
        return refused("model.solver", reason.into());
    }
    if encoder == EncoderModel::Ideal && datapath != Datapath::Law {
        let reason = "\"ideal\" is a position in floats, which only the law in floats reads; write datapath = \"law\"";
        return refused("model.encoder", reason.into());
    }
    if encoder == EncoderModel::Loaded {
        if datapath != Datapath::Words {
            let reason = "\"loaded\" is the words' counter; the law reads counts as they are: leave this out";
            return refused("model.encoder", reason.into());
        }
        if on_bridge {
            let reason =
                "a \"loaded\" counter leaves out the clock that switches; write bridge = \"averaged\" beside it";
            return refused("model.encoder", reason.into());
        }
        if scene.method.kind.features().times_lines {
            let reason = "a \"loaded\" counter has no lines to time; write another estimator, or leave this out";
            return refused("model.encoder", reason.into());
        }
    }
    if encoder != EncoderModel::Quantised && solver.is_exact() {
        let how = if encoder == EncoderModel::Ideal { "ideal" } else { "loaded" };
        let reason =
            format!("\"{how}\" is read once a step, and \"{name}\" has none; write solver = \"sample\", {FIXED}");
        return refused("model.encoder", reason);
    }
    if matches!(scene.hand, Hand::Capture { .. }) && !solver.is_exact() {
        let reason =
            format!("\"capture\" has no device for \"{name}\" to move; write solver = \"events\" or \"clock\"");
        return refused("model.solver", reason);
    }
    Ok(())
}
