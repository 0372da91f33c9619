//! The result of a search as tables.

use super::knob::Width;
use super::{Found, Point};

/// Returns the designs as CSV, cheapest first, with the designs of the front marked. `replay` returns the command that
/// runs the scene with a design. Errors and stiffness are measured, LUT4s estimated.
#[must_use]
pub fn csv(found: &Found, command: &str, replay: impl Fn(&Point) -> String) -> String {
    let mut text = format!("# {command}\n");
    let names = Width::ALL.map(|width| width.key().replace('.', "_")).join(",");
    text += &format!("{names},lut4_estimated,error,stable_stiffness,unit,capped,front,replay\n");
    for (index, point) in found.points.iter().enumerate() {
        let Point { design, merit, capped } = point;
        let bits = Width::ALL.map(|width| design.get(width).to_string()).join(",");
        let (front, replay) = (found.front.contains(&index), replay(point).replace('"', "\"\""));
        text += &format!(
            "{bits},{},{:e},{:e},{},{capped},{front},\"{replay}\"\n",
            merit.lut4, merit.error, merit.stiffness, found.unit
        );
    }
    text
}

/// Returns the errors around the reference as CSV: empty where no scene can have the design, `inf` where the verdict
/// differs.
#[must_use]
pub fn errors_csv(found: &Found, command: &str) -> String {
    let mut text = format!("# {command}\n# reference: {}\nwidth,bits,error\n", found.reference.design);
    for line in &found.lines {
        for (bits, error) in &line.errors {
            let error = error.map_or(String::new(), |error| format!("{error:e}"));
            text += &format!("{},{bits},{error}\n", line.width.key());
        }
    }
    text
}
