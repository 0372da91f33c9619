//! The result of a race as a table.

use hpu_cosim::scene::{Experiment, Output};

use super::found::{Chart, Entry, Grade};
use crate::map::outcome_name;

/// Returns the name of a grade: `exact`, `off`, `verdict_only`, `wrong`.
#[must_use]
pub fn grade_name(grade: Grade) -> &'static str {
    match grade {
        Grade::Exact => "exact",
        Grade::Off(_) => "off",
        Grade::VerdictOnly => "verdict_only",
        Grade::Wrong => "wrong",
    }
}

/// Returns the outputs that may have an error in a scene.
#[must_use]
pub fn outputs_of(experiment: &Experiment) -> &'static [Output] {
    match experiment {
        Experiment::Axis(_) | Experiment::Dut(_) => &Output::OF_AN_AXIS,
        Experiment::Phantom(_) => &Output::OF_A_PHANTOM,
    }
}

/// Returns the race's result as CSV. Errors are relative numbers; an infinite error is written `inf`. `replay` returns
/// the command that runs an entry again.
#[must_use]
pub fn csv(chart: &Chart, outputs: &[Output], command: &str, replay: impl Fn(&Entry) -> String) -> String {
    let mut text = format!("# {command}\n");
    text += "contestant,family,step_s,grade,error";
    text.extend(outputs.iter().map(|output| format!(",{}_error", output.name())));
    text += ",outcome,motion_s,wall_s,motion_per_wall,edges,edges_per_s,runs,timed,shortened,front,refused,replay\n";
    let front = chart.front();
    for (index, entry) in chart.entries.iter().enumerate() {
        let Entry { contestant, row } = entry;
        let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        text += &format!("{},{},{}", contestant.name, contestant.family, number(contestant.step_s));
        let replay = if contestant.criterion.is_some() { String::new() } else { quoted(&replay(entry)) };
        match row {
            Err(why) => {
                let empty = ",".repeat(outputs.len() + 12);
                text += &format!(",refused{empty}{},{replay}\n", quoted(why));
            }
            Ok(row) => {
                text += &format!(",{},{}", grade_name(row.grade), number(row.grade.error()));
                for output in outputs {
                    let error = row.errors.iter().find(|(of, _)| of == output).map(|(_, error)| *error);
                    text += &format!(",{}", number(error));
                }
                let speed = row.speed;
                let outcome = row.outcome.map_or("", |outcome| outcome_name(Some(outcome)));
                text += &format!(
                    ",{outcome},{:e},{:e},{:e},{},{:e},{},{},{},{},,{replay}\n",
                    speed.motion_s,
                    speed.wall_s,
                    speed.motion_per_wall(),
                    speed.edges,
                    speed.edges_per_s(),
                    speed.runs,
                    speed.timed(),
                    row.shortened_s.is_some(),
                    front.contains(&index),
                );
            }
        }
    }
    text
}
