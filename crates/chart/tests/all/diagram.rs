//! The drawing of a loop, for every shipped scene: each signal is there with its format, each connection is an arrow,
//! no box covers another.

use hpu_chart::Diagram;
use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Simulation, Wired, WiredSimulation};
use hpu_signal::Notation;

use crate::looks::{attribute, elements, number};

#[test]
fn every_loop_is_drawn_with_its_signals_formats_and_connections() {
    let mut drawn = Vec::new();
    for scene in shipped() {
        let experiment = scene.parse(&[]).expect("a shipped scene");
        let simulation = WiredSimulation::new(&experiment).expect("a shipped scene");
        let wiring = simulation.wiring();
        let [inputs, outputs] = [wiring.block().inputs().len(), wiring.block().outputs().len()];
        let (nets, instances) = (simulation.nets(), wiring.instances());
        let shape: Vec<String> = nets.iter().map(|net| format!("{} {}", net.name, net.format)).collect();
        if drawn.contains(&shape) {
            continue;
        }
        let (name, notation) = (scene.name, Notation::Triple);
        let svg =
            Diagram { nets: &nets, inputs, outputs, instances: &instances, name, device: "motor", notation }.svg();
        drawn.push(shape);

        for net in &nets {
            let told =
                if net.format.width() == 1 { net.name.to_string() } else { format!("{} {}", net.name, net.format) };
            let is_read = instances.iter().flat_map(|instance| &instance.connections).any(|c| nets[c.net] == *net);
            assert!(!is_read || svg.contains(&format!(">{told}</text>")), "{name}: {told}");
        }
        for instance in &instances {
            assert!(svg.contains(&format!(">{}</text>", instance.label)), "{name}: {}", instance.label);
        }
        // An arrow for each input of a block that a net drives, one for each output of the loop, and the device's.
        let driven = |instance: &hpu_datapath::Instance| {
            let leaves = instance.model.outputs();
            let entering = |c: &&hpu_datapath::Connection| !leaves.iter().any(|port| port.name == c.port.name);
            instance.connections.iter().filter(entering).count()
        };
        let expected = if instances.is_empty() { inputs } else { instances.iter().map(driven).sum() } + outputs + 1;
        let stubs = svg.matches("class=\"stub\"").count();
        assert_eq!(svg.matches("class=\"arrow\"").count() + stubs, expected, "{name}");

        let boxes: Vec<[f64; 4]> = elements(&svg)
            .filter(|(kind, _)| *kind == "rect")
            .map(|(_, mark)| ["x", "y", "width", "height"].map(|name| number(mark, name)))
            .collect();
        assert_eq!(boxes.len(), instances.len().max(1) + 2, "{name}");
        for (index, [x, y, width, height]) in boxes.iter().enumerate() {
            for [other_x, other_y, other_width, other_height] in &boxes[..index] {
                let beside = x + width < *other_x || other_x + other_width < *x;
                let below = y + height < *other_y || other_y + other_height < *y;
                assert!(beside || below, "{name}: two boxes at {x} {y} and {other_x} {other_y}");
            }
        }
        let root = svg.split_once('>').expect("a root").0;
        let view: Vec<f64> =
            attribute(root, "viewBox").expect("its size").split(' ').map(|n| n.parse().expect("a number")).collect();
        for [x, y, width, height] in boxes {
            assert!(x >= view[0] && x + width <= view[0] + view[2], "{name}: {x} in {view:?}");
            assert!(y >= view[1] && y + height <= view[1] + view[3], "{name}: {y} in {view:?}");
        }
    }
    assert!(drawn.len() > 12, "{} loops", drawn.len());
}

#[test]
fn every_network_is_drawn_with_its_bodies_and_what_they_have() {
    let mut drawn = 0;
    for scene in shipped() {
        let experiment = scene.parse(&[]).expect("a shipped scene");
        let Experiment::Axis(axis) = &experiment else { continue };
        let Some(compound) = axis.network.as_deref() else { continue };
        drawn += 1;
        let svg = hpu_page::device::drawing(&experiment).expect("a drawing");
        for text in compound.names.iter().map(String::as_str).chain(["hand", "encoder", "wall"]) {
            assert!(svg.contains(&format!(">{text}</text>")), "{}: {text}", scene.name);
        }
        assert!(svg.contains(">drive: "), "{}", scene.name);
        let rects = elements(&svg).filter(|(name, _)| *name == "rect");
        let boxes: Vec<[f64; 2]> = rects.map(|(_, rect)| ["x", "width"].map(|key| number(rect, key))).collect();
        assert_eq!(boxes.len(), compound.names.len(), "{}", scene.name);
        assert!(boxes.windows(2).all(|pair| pair[0][0] + pair[0][1] < pair[1][0]), "{}: {boxes:?}", scene.name);
    }
    assert!(drawn >= 4, "{drawn}");
}
