//! The energy audit of every shipped scene with a device, over its whole length.

use hpu_cosim::scene::shipped;
use hpu_cosim::{Control, Driver, Ready, Rig, Wired};

#[test]
fn supply_less_store_less_losses_is_a_billionth_of_the_energy_exchanged() {
    for shipped in shipped() {
        let scene = shipped.parse(&[]).unwrap_or_else(|error| panic!("{error}"));
        let session = Ready::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let summary = session.run(Driver::Events, &mut session.trace(&[]), &mut (), &Control::default());
        assert!(summary.complete, "{}", shipped.name);
        let energy = summary.energy;
        if !session.has_device() {
            assert_eq!(energy.exchanged_j, 0.0, "{}: a recording has no device", shipped.name);
            continue;
        }
        assert!(energy.exchanged_j > 0.0, "{}", shipped.name);
        assert!(energy.residual_j.abs() <= 1e-9 * energy.exchanged_j, "{}: {energy:?}", shipped.name);
        // Each sum is the sum of its parts, and nothing that only dissipates supplies energy.
        assert_eq!(energy.supplied_j, energy.source_j + energy.hand_j, "{}", shipped.name);
        for loss_j in [energy.copper_j, energy.diodes_j, energy.viscous_j, energy.coulomb_j, energy.transmission_j] {
            assert!(loss_j >= 0.0, "{}: {energy:?}", shipped.name);
        }
    }
}
