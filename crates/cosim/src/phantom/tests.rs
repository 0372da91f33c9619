//! Tests that the arm moves alike by the recursion written out by hand and by its recorded dynamics.

use hpu_plant::arm::{Links, Recorded};
use hpu_signal::{Cycle, Observe};

use super::*;
use crate::result::summary::Summary;
use crate::run::engine::{ClosedLoop, Control, Driver};
use crate::world::World;
use hpu_scene::{Experiment, shipped};

/// The words of all nets, from each edge at which one of them changed.
#[derive(Default)]
struct Changes(Vec<(u64, Vec<i64>)>);

impl Observe for Changes {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.0.last().is_none_or(|(_, last)| last != words) {
            self.0.push((cycle.0, words.to_vec()));
        }
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// Runs a loop to an edge. Returns the changes of its nets, the changes of friction, and the energies.
fn run<'p, L: Links + 'p>(
    simulation: &PhantomSimulation,
    plant: &'p ArmPlant<L>,
    end: u64,
) -> (Changes, u64, [f64; 4]) {
    let ArmLoop::Phantom(wiring) = &simulation.wiring else { panic!("a loop of its own logic") };
    let mut changes = Changes::default();
    let mut run = ClosedLoop::new(wiring.clone(), ArmWorld::new(plant, FpgaSide), simulation.input(), end);
    assert!(run.run(Driver::Events, end, &mut changes, &Control::default()));
    let Summary { energy, mode_changes, .. } = run.world.summary();
    let energies = [energy.source_j, energy.stored_j, energy.dissipated_j, energy.residual_j];
    (changes, mode_changes, energies)
}

/// The arm of the plant, with its links given by their dynamics alone.
fn recorded(plant: &ArmPlant, edge_s: f64) -> Arm<Recorded> {
    let model = plant.arm.model();
    Arm::of(model, model.joints(), edge_s).expect("the joints of an arm that moves")
}

#[test]
fn an_arm_known_by_its_dynamics_alone_has_the_same_events_on_the_same_edges() {
    for (name, seconds) in [("phantom-drop", 4.0), ("phantom-flexible", 0.5), ("phantom-thrown", 2.0)] {
        let scene = shipped().iter().find(|scene| scene.name == name).expect(name).parse(&[]).expect(name);
        let Experiment::Phantom(scene) = &scene else { panic!("{name} is no PHANToM") };
        let simulation = PhantomSimulation::new(scene).expect(name);
        let plant = &simulation.plant.arm;
        let other = ArmPlant {
            arm: recorded(plant, scene.clock.period_s()),
            stepping: plant.stepping,
            count_rad: plant.count_rad,
            command_nm: plant.command_nm,
            start_rad: plant.start_rad,
            start_rad_per_s: plant.start_rad_per_s,
            stops: Box::new(|_| None),
        };
        let end = scene.clock.edges(seconds);
        let (fused, general) = (run(&simulation, plant, end), run(&simulation, &other, end));
        assert!(fused.0.0.len() > 1000, "{name}: {} changes", fused.0.0.len());
        let differs = fused.0.0.iter().zip(&general.0.0).find(|(one, other)| one != other);
        assert_eq!(differs, None, "{name}");
        assert_eq!((fused.0.0.len(), fused.1), (general.0.0.len(), general.1), "{name}");
        for (one, other) in fused.2.iter().zip(general.2) {
            assert!((one - other).abs() < 1e-12 * one.abs().max(1.0), "{name}: {:?} and {:?}", fused.2, general.2);
        }
    }
}
