//! The scenes on which every design of a search is run.

use hpu_cosim::scene::{Experiment, Output, Scene};

use super::refused::{SearchError, searchable};

/// A scene on which every design is run.
pub(super) struct Case {
    /// Its name as given.
    pub name: String,
    pub scene: Scene,
    /// The outputs that the scene says are to be compared.
    pub outputs: Option<Vec<Output>>,
    /// Whether its stable stiffness is searched. Scenes that differ only in the wall's stiffness have the same one, so
    /// the first of them climbs for all.
    pub climbs: bool,
}

/// Reads the scenes of a search.
///
/// # Errors
///
/// When a scene has nothing to search, or when the scenes need different hardware at equal widths.
pub(super) fn cases(named: &[(String, Experiment)]) -> Result<Vec<Case>, SearchError> {
    let mut all: Vec<Case> = Vec::new();
    for (name, experiment) in named {
        let outputs = experiment.accuracy.outputs.clone();
        let of = |error: SearchError| match error {
            SearchError::Scene(why) if named.len() > 1 => SearchError::Scene(format!("{name}: {why}")),
            error => error,
        };
        let scene = searchable(experiment.clone()).map_err(of)?;
        if let Some(first) = all.first()
            && let Some(why) = difference(&first.scene, &scene)
        {
            let why = format!("{} and {name} have {why}: one search takes scenes of one hardware", first.name);
            return Err(SearchError::Scene(why));
        }
        let climbs = !all.iter().any(|before| same_but_for_stiffness(&before.scene, &scene));
        all.push(Case { name: name.clone(), scene, outputs, climbs });
    }
    if all.is_empty() { Err(SearchError::Scene("no scene to search".into())) } else { Ok(all) }
}

/// Returns why the two scenes need different hardware at the same widths, if they do.
fn difference(first: &Scene, other: &Scene) -> Option<String> {
    let [unit, others] = [first, other].map(|scene| scene.device.units().stiffness);
    if unit != others {
        return Some(format!("stiffness in {unit} and in {others}"));
    }
    let [kind, others] = [first, other].map(|scene| scene.method.kind.name());
    if kind != others {
        return Some(format!("method.kind = \"{kind}\" and \"{others}\""));
    }
    let other = super::Design::of(first).scene(other).ok()?;
    let config = |scene: &Scene| scene.words().ok().map(|words| words.config);
    (config(first)? != config(&other)?)
        .then(|| "another method.product, .rescaled, .period_bits, .settling, or .pwm".to_string())
}

/// Returns whether the two scenes differ at most in the stiffness of their walls.
fn same_but_for_stiffness(one: &Scene, other: &Scene) -> bool {
    let wall = |scene: &Scene| (scene.wall.position_rad, scene.wall.damping_nm_s_per_rad);
    let same = wall(one) == wall(other)
        && (one.device, one.encoder, one.bridge) == (other.device, other.encoder, other.bridge)
        && (&one.amplifier, one.clock, &one.method) == (&other.amplifier, other.clock, &other.method);
    same && (&one.hand, &one.model) == (&other.hand, &other.model)
        && (&one.run, &one.record) == (&other.run, &other.record)
}
