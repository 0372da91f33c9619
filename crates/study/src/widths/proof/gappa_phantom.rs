//! The same for a PHANToM: kinematics and torques are one straight line, from the tables' sines to the torques.

use std::fmt::Write;

use hpu_cosim::scene::PhantomScene;
use hpu_datapath::phantom::bounds;

/// The script for a PHANToM's scene, which is to prove the ranges and errors of its tip and of its torques. Words have
/// small letters; what real numbers make of them is capital. Forces are words of their own, clamped to their limit.
///
/// # Errors
///
/// When a host computes the forces, or the words make no datapath.
pub fn gappa_phantom(scene: &PhantomScene) -> Result<String, String> {
    if scene.platform.is_host() {
        return Err("a host computes the forces, in floats".into());
    }
    let (config, formats) = (scene.method.config, scene.method.config.formats);
    let stiffness = formats.stiffness.to_f64(scene.words().map_err(|error| error.to_string())?.stiffness);
    let rows = bounds(&config, stiffness).map_err(|error| error.to_string())?;
    let [upper, fore] = config.lengths.map(|word| format!("{word}b-{}", formats.length_frac));
    let (position, force, torque) = (-formats.position.frac(), -formats.force.frac(), -formats.torque.frac());
    let line = |word: &str, lsb: i32, what: &str, truth: &str, really: &str| {
        format!("{word} = fixed<{lsb}, nu>({what});\n{truth} = {really};\n")
    };
    let mut text = format!("# {}: from sines to torques, in metres, newtons and newton metres.\n", scene.name);
    let _ = write!(text, "upper_arm = {upper};\nforearm = {fore};\n");
    for (word, lsb, what, truth, really) in [
        (
            "radius",
            position,
            "upper_arm * cosine2 + forearm * sine3",
            "Radius",
            "upper_arm * Cosine2 + forearm * Sine3",
        ),
        ("x", position, "sine1 * radius", "X", "Sine1 * Radius"),
        (
            "y",
            position,
            "forearm + (upper_arm * sine2 - forearm * cosine3)",
            "Y",
            "forearm + (upper_arm * Sine2 - forearm * Cosine3)",
        ),
        ("z", position, "cosine1 * radius - upper_arm", "Z", "Cosine1 * Radius - upper_arm"),
        ("radial", force, "sine1 * force_x + cosine1 * force_z", "Radial", "Sine1 * force_x + Cosine1 * force_z"),
        ("upper", force, "cosine2 * force_y - sine2 * radial", "Upper", "Cosine2 * force_y - Sine2 * Radial"),
        ("fore", force, "sine3 * force_y + cosine3 * radial", "Fore", "Sine3 * force_y + Cosine3 * Radial"),
        (
            "torque1",
            torque,
            "(z + upper_arm) * force_x - x * force_z",
            "Torque1",
            "(Z + upper_arm) * force_x - X * force_z",
        ),
        ("torque2", torque, "upper_arm * upper", "Torque2", "upper_arm * Upper"),
        ("torque3", torque, "forearm * fore", "Torque3", "forearm * Fore"),
    ] {
        text += &line(word, lsb, what, truth, really);
    }
    let (mut given, mut goals) = (Vec::new(), Vec::new());
    for row in &rows {
        let (name, frac) = (row.name, -row.format.frac());
        let range = format!("{name} in [{}, {}]", row.min, row.max);
        match name {
            "sine1" | "cosine1" | "sine2" | "cosine2" | "sine3" | "cosine3" => {
                given.push(format!("{range} /\\ @FIX({name}, {frac})"));
                given.push(format!("{name} - {} in [-{error}, {error}]", capital(name), error = row.error));
            }
            "force_x" | "force_y" | "force_z" => given.push(format!("{range} /\\ @FIX({name}, {frac})")),
            "stiffness" | "command1" | "command2" | "command3" => {}
            _ => {
                goals.push(range);
                goals.push(format!("{name} - {} in [-{error}, {error}]", capital(name), error = row.error));
            }
        }
    }
    let _ = write!(text, "\n{{ {}\n  ->\n  {} }}\n", given.join("\n  /\\ "), goals.join("\n  /\\ "));
    Ok(text)
}

/// The name of the real number that a word stands for.
fn capital(name: &str) -> String {
    let (first, rest) = name.split_at(1);
    first.to_uppercase() + rest
}
