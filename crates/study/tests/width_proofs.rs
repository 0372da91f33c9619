//! scratch
use hpu_cosim::scene::{Experiment, shipped};
use hpu_study::widths::proof::{Proof, axis_bounds};

fn proved(name: &str, overrides: &[(&str, &str)]) -> Proof {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap().parse(&overrides).unwrap();
    let Experiment::Axis(scene) = scene else { panic!() };
    axis_bounds(&scene).unwrap()
}

#[test]
fn scratch() {
    for name in [
        "hybrid-wall",
        "wrap-product",
        "prescribed-sweep",
        "conventional-wall-1khz",
        "rail-drop",
        "free-motion",
        "short-contact",
    ] {
        let start = std::time::Instant::now();
        let proof = proved(name, &[]);
        println!("== {name} {:?}", start.elapsed());
        for limit in &proof.limits {
            println!("  {limit:?}");
        }
        println!("  {:?}", proof.wraps_at);
        for bound in &proof.bounds {
            println!(
                "  {:12} {} {} {} err {:?} {} {:?}",
                bound.name,
                bound.format,
                bound.min,
                bound.max,
                bound.error,
                bound.never_overflows,
                bound.assumptions.first()
            );
        }
    }
}
