//! The result of a search as a table.

use hpu_cosim::scene::PhantomScene;

use super::knob::{FIELDS, key};
use super::{Found, proved};

/// Returns the front as CSV. Errors of the outputs and stiffness are measured, cells estimated, errors of tip and
/// torque proved.
#[must_use]
pub fn csv(found: &Found, base: &PhantomScene, command: &str) -> String {
    let names = FIELDS.map(|field| key(field).replace('.', "_")).join(",");
    let mut text = format!(
        "# {command}\n{names},block_rams,cells_estimated,error,stable_stiffness_n_per_m,capped,tip_error_m,torque_error\n"
    );
    for point in &found.front {
        let bits = FIELDS.map(|field| point.design.get(field).to_string()).join(",");
        let cells = point.cells.map_or(String::new(), |cells| cells.to_string());
        let bounds = proved(base, &point.design).map_or(",".into(), |(tip_m, torque)| format!("{tip_m:e},{torque:e}"));
        let stiffness = found.stiffness_n_per_m(point);
        text += &format!("{bits},{},{cells},{:e},{stiffness:.3},{},{bounds}\n", point.rams, point.error, point.capped);
    }
    text
}
