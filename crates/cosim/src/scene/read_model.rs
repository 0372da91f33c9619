//! Reading `[model]` of an axis: the physics that is modelled, and the combinations that are accepted.

use hpu_datapath::Estimator;

use super::{LawMethod, Loop, Scene};

use super::model::{BridgeModel, Datapath, EncoderModel, Friction, Model, Solver, Winding};
use super::parts::{Device, Hand};
use super::quantity as q;
use super::section::Section;
use super::section::Sense::{NotNegative, Positive};
use super::source::SceneError;

const FIXED: &str = "\"euler\", \"semi_implicit\", \"midpoint\" or \"rk4\"";

pub(super) fn model(s: &Section, device: &Device) -> Result<Model, SceneError> {
    s.accept(&["solver", "step", "datapath", "bridge", "winding", "friction", "friction_speed", "encoder", "delay"])?;
    for (key, lacks) in [("bridge", "a force amplifier and no bridge"), ("winding", "no winding")] {
        if let (Device::Mass(_), true) = (device, s.has(key)) {
            return Err(s.error(key, format!("a mass has {lacks}; leave this out")));
        }
    }
    let datapaths = [("words", Datapath::Words), ("law", Datapath::Law), ("linear", Datapath::Linear)];
    let bridges = [("switching", BridgeModel::Switching), ("averaged", BridgeModel::Averaged)];
    let windings = [("inductive", Winding::Inductive), ("resistive", Winding::Resistive)];
    let encoders =
        [("quantised", EncoderModel::Quantised), ("loaded", EncoderModel::Loaded), ("ideal", EncoderModel::Ideal)];
    let solver = s.choice("solver", &Solver::ALL.map(|solver| (solver.name(), solver)), Some(Solver::Events))?;
    Ok(Model {
        solver,
        step_s: step(s, solver)?,
        datapath: s.choice("datapath", &datapaths, Some(Datapath::Words))?,
        bridge: s.choice("bridge", &bridges, Some(BridgeModel::Switching))?,
        winding: s.choice("winding", &windings, Some(Winding::Inductive))?,
        friction: friction(s, device)?,
        encoder: s.choice("encoder", &encoders, Some(EncoderModel::Quantised))?,
        delay_s: s.quantity("delay", &q::TIME, NotNegative, Some(0.0))?,
    })
}

pub(super) fn step(s: &Section, solver: Solver) -> Result<Option<f64>, SceneError> {
    match (solver.is_fixed_step(), s.has("step")) {
        (true, _) => s.quantity("step", &q::TIME, Positive, None).map(Some),
        (false, false) => Ok(None),
        (false, true) => {
            let reason =
                format!("\"{}\" has no step of its own; leave it out, or write solver = {FIXED}", solver.name());
            Err(s.error("step", reason))
        }
    }
}

pub(super) fn friction(s: &Section, device: &Device) -> Result<Friction, SceneError> {
    let smoothed = Friction::Smoothed { speed_rad_per_s: 0.0 };
    let kinds = [("stick_slip", Friction::StickSlip), ("smoothed", smoothed), ("none", Friction::None)];
    let kind = s.choice("friction", &kinds, Some(Friction::StickSlip))?;
    if kind == smoothed {
        let dimension = if matches!(device, Device::Motor(_)) { &q::ANGULAR_SPEED } else { &q::SPEED };
        let speed_rad_per_s = s.quantity("friction_speed", dimension, Positive, None)?;
        return Ok(Friction::Smoothed { speed_rad_per_s });
    }
    if s.has("friction_speed") {
        return Err(s.error("friction_speed", "only smoothed friction has it; write friction = \"smoothed\" beside it"));
    }
    Ok(kind)
}

/// Checks the conditions between `[model]` and the rest of the scene, and among its own keys.
pub(super) fn agree_on_model(scene: &Scene) -> Result<(), SceneError> {
    let refused = |key: &str, reason: String| Err(scene.error(key, reason));
    let Model { solver, datapath, bridge, winding, friction, encoder, .. } = scene.model;
    let name = solver.name();
    let on_bridge = matches!(scene.device, Device::Motor(_)) && bridge == BridgeModel::Switching;
    if datapath == Datapath::Linear {
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
        if matches!(scene.method.kind, Loop::Law(LawMethod::SampledWall(wall)) if wall.estimator == Estimator::EdgeTimer)
        {
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
