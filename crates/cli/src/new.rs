//! `hpu new`: a scene to begin with.

use std::path::Path;

use clap::builder::{PossibleValue, PossibleValuesParser};
use hpu_cosim::scene::keys::{Takes, rows};
use hpu_cosim::scene::{BEGINNINGS, Begin, Experiment, Resolved, ValueSource, WRITTEN_BY_NEW, as_scene, resolved};
use hpu_cosim::{PlainName, excerpt};

use crate::scene::quoted;
use crate::shell::{Exit, Failure, Folder, print};

/// Write a scene to begin with
///
/// Writes NAME.toml: a wall that runs and settles. Above each key stands its meaning. Lines that begin with `#` are
/// keys with their defaults: to change one, remove the `#`. Where a newer hpu has another default than the comment
/// says, `hpu run` tells both. `hpu keys` lists all keys. With --dut the wall is a design of your own: NAME.vhd, which
/// is written too, is a small one to begin with. Existing files are never overwritten.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Name of the scene, also with folders in front
    name: String,
    /// Device that the hand holds
    #[arg(long, value_parser = PossibleValuesParser::new(devices()), default_value = "motor")]
    device: String,
    /// Counts of the encoder: of a revolution of a motor or of a network's rotor, four a line, or of a metre of a mass
    /// [default: 4096, or 50000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=1_000_000))]
    counts: Option<u32>,
    /// Clock of the FPGA [default: 50 MHz]
    #[arg(long, value_name = "FREQUENCY", default_value = "50 MHz", hide_default_value = true)]
    clock: String,
    /// Control law of a motor, a mass or a network [default: hybrid]
    #[arg(long, value_parser = PossibleValuesParser::new(methods()), conflicts_with = "dut")]
    method: Option<String>,
    /// Close the loop by a design of your own, in the place of a method
    #[arg(long)]
    dut: bool,
    /// Write NAME.yml instead: a workflow that checks designs of your own in continuous integration, for GitHub
    /// Actions, which others read too
    #[arg(long, conflicts_with_all = ["device", "counts", "clock", "method", "dut"])]
    ci: bool,
}

/// Returns the devices, by `device.kind`: those of an axis, then the others.
fn devices() -> impl Iterator<Item = PossibleValue> {
    let axis = [
        ("motor", "A motor with a wheel"),
        ("mass", "A mass on a rail"),
        ("network", "Bodies on joints: a rotor that moves a handle by a cable"),
    ];
    let others = BEGINNINGS.iter().map(|(kind, begin)| (*kind, begin.device));
    axis.into_iter().chain(others).map(|(kind, device)| PossibleValue::new(kind).help(device))
}

/// Returns the scene to begin with of a device that has its own law and encoders.
fn beginning(args: &Args) -> Option<&'static Begin> {
    BEGINNINGS.iter().find(|(kind, _)| *kind == args.device).map(|(_, begin)| begin)
}

/// The design to begin with; its entity has this name.
const DESIGN: &str = hpu_assets::text("testbench/dut/begin.vhd");
const ENTITY: &str = "begin_wall";

/// The workflow of a design's continuous integration.
const WORKFLOW: &str = hpu_assets::text("testbench/dut/ci.yml");

/// Returns the methods, by the row of `method.kind`.
fn methods() -> Vec<&'static str> {
    match rows().find(|row| (row.section, row.key) == ("method", "kind")).map(|row| row.takes) {
        Some(Takes::Choice(names)) => names,
        _ => Vec::new(),
    }
}

/// Keys and their values.
type Given = Vec<(String, String)>;

/// Runs `hpu new`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let name = args.name.trim_end_matches('/');
    let name = name.strip_suffix(if args.ci { ".yml" } else { ".toml" }).unwrap_or(name);
    let stem = name.rsplit('/').next().unwrap_or(name);
    let plain: Result<PlainName, _> = stem.parse();
    if let Err(why) = plain {
        return Err(Failure::usage(format!("`{}` is no name of a scene: `{}` is {why}", args.name, excerpt(stem))));
    }
    if beginning(args).is_some() && (args.method.is_some() || args.counts.is_some()) {
        return Err(Failure::usage("this device has its own law and encoders; leave --method and --counts out"));
    }
    if args.device != "motor" && args.dut {
        return Err(Failure::usage("the design to begin with drives a motor; leave --device out"));
    }
    let files = if args.ci { vec![(format!("{stem}.yml"), WORKFLOW.to_string())] } else { scene_files(args, stem)? };
    let dir = Path::new(name).parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut folder = Folder::open(dir)?;
    let mut said = String::new();
    for (file, text) in files {
        let place = folder.place(&file);
        if place.exists() {
            return Err(Failure::usage(format!("{} is there already; choose another name", place.display())));
        }
        folder.write(&file, text)?;
        said += &format!("wrote {}\n", place.display());
    }
    folder.commit()?;
    print(&said)?;
    Ok(Exit::Fine)
}

/// Returns the scene, and its design if it has one, with the names of their files.
fn scene_files(args: &Args, stem: &str) -> Result<Vec<(String, String)>, Failure> {
    let design = format!("{stem}.vhd");
    let (all, _) = begin(args, &design)?;
    let text = format!("{WRITTEN_BY_NEW}{}`.\n# Run it: `hpu run {stem}.toml -o out`\n", options(args, stem))
        + &as_scene(&all, line);
    let mut files = vec![(format!("{stem}.toml"), text)];
    if args.dut {
        files.push((design, DESIGN.to_string()));
    }
    Ok(files)
}

/// Returns the name and the options, as they stand behind `hpu new`.
fn options(args: &Args, stem: &str) -> String {
    let mut options = format!("{} --device {} --clock {}", quoted(stem), args.device, quoted(&args.clock));
    if let Some(counts) = args.counts {
        options += &format!(" --counts {counts}");
    }
    if let Some(method) = &args.method {
        options += &format!(" --method {method}");
    }
    options + if args.dut { " --dut" } else { "" }
}

/// Returns the line of a key: what the scene gives as it is, all else as a comment.
fn line(key: &Resolved, pair: Option<&str>) -> Option<String> {
    Some(match (&key.source, pair) {
        (ValueSource::Given(_), Some(pair)) => pair.to_string(),
        (_, Some(pair)) => format!("# {pair}"),
        (_, None) => format!("# {} = ...  # without it: {}", key.key, key.value),
    })
}

/// Returns the keys of the scene, and the scene. Gains get the narrowest formats that hold them.
fn begin(args: &Args, design: &str) -> Result<(Vec<Resolved>, Experiment), Failure> {
    let given = given(args, design);
    let parse = |formats: Given| {
        let given: Given = given.iter().cloned().chain(formats).collect();
        let mut load = |_: &str| Ok(DESIGN.as_bytes().to_vec());
        let scene = Experiment::parse(&args.name, "", &given, &mut load)?;
        Ok((resolved(&scene, &args.name, "", &given)?, scene))
    };
    let mut refused = None;
    for formats in formats(args) {
        match parse(formats) {
            Ok((all, scene)) if scene.setup().stiffness_miss().is_none() => return Ok((all, scene)),
            Ok(_) => {}
            Err(error) => refused = refused.or(Some(error)),
        }
    }
    let why = refused
        .map_or("no format of 32 bits holds the gains".to_string(), |error: hpu_cosim::scene::SceneError| {
            error.to_string()
        });
    Err(Failure::usage(why))
}

/// Returns formats of the gains to try, from narrow to wide; none for devices whose scenes have no such keys.
fn formats(args: &Args) -> Vec<Given> {
    if args.dut || beginning(args).is_some() {
        return vec![Vec::new()];
    }
    let third = match args.method.as_deref() {
        Some("energy_bounding") => Some("bound_format"),
        Some("pid") => Some("integral_format"),
        _ => None,
    };
    let keys = ["stiffness_format", "damping_format"].into_iter().chain(third).collect::<Vec<_>>();
    let of = |(int, frac): (u32, u32)| {
        let format = format!("(0,{int},{frac})");
        keys.iter().map(|key| (format!("method.{key}"), format.clone())).collect()
    };
    let sizes = (12..=20).step_by(2).flat_map(|int| (0..=12).step_by(2).map(move |frac| (int, frac)));
    sizes.filter(|(int, frac)| int + frac <= 32).map(of).collect()
}

/// The keys of a motor.
const MOTOR: &[(&str, &str)] = &[
    ("device.kind", "motor"),
    ("device.motor", "vasudevan_2007"),
    ("device.wheel_ratio", "7"),
    ("wall.position", "1.5 rad"),
    ("hand.kind", "spring_damper"),
    ("hand.stiffness", "0.3 N.m/rad"),
    ("hand.damping", "0.5 mN.m.s/rad"),
    ("hand.path", "[[\"0 s\", 0], [\"150 ms\", 1.4], [\"250 ms\", 1.9]]"),
];

/// The keys of a mass.
const MASS: &[(&str, &str)] = &[
    ("device.kind", "mass"),
    ("device.mass", "90 g"),
    ("device.damping", "0.5 N.s/m"),
    ("amplifier.full_scale", "10 N"),
    ("method.pwm.bits", "16"),
    ("wall.position", "2 cm"),
    ("hand.kind", "spring_damper"),
    ("hand.stiffness", "200 N/m"),
    ("hand.damping", "3 N.s/m"),
    ("hand.path", "[[\"0 s\", 0], [\"150 ms\", \"18 mm\"], [\"250 ms\", \"25 mm\"]]"),
];

/// The keys of a network: a current amplifier, a rotor, a handle on a cable, and a hand.
const NETWORK: &[(&str, &str)] = &[
    ("device.kind", "network"),
    ("device.units_at", "handle"),
    ("device.bodies.rotor", "{ inertia = \"50 g.cm2\", coulomb_friction = \"3 mN.m\" }"),
    ("device.bodies.handle", "{ mass = \"30 g\" }"),
    (
        "device.joints.cable",
        "{ from = \"rotor\", to = \"handle\", ratio = 10, radius = \"60 mm\", stiffness = \"20 kN/m\", \
         damping_ratio = 0.02 }",
    ),
    ("device.drive.kind", "current"),
    ("device.drive.on", "rotor"),
    ("device.drive.torque_constant", "23 mN.m/A"),
    ("device.drive.bandwidth", "2 kHz"),
    ("device.drive.dac.full_scale", "10 A"),
    ("device.drive.dac.bits", "12"),
    ("encoder.on", "rotor"),
    ("wall.position", "6 mm"),
    ("hand.kind", "spring_damper"),
    ("hand.on", "handle"),
    ("hand.stiffness", "1.4 kN/m"),
    ("hand.damping", "28 N.s/m"),
    ("hand.path", "[[\"0 s\", 0], [\"200 ms\", \"12 mm\"]]"),
];

/// Returns the keys that the scene gives.
fn given(args: &Args, design: &str) -> Given {
    let method = args.method.as_deref().unwrap_or("hybrid");
    let counts = args.counts.unwrap_or(if args.device == "mass" { 50_000 } else { 4096 });
    let clock = args.clock.as_str();
    let text = |key: &str, value: &str| (key.to_string(), value.to_string());
    let follows = method == "pid";
    let what = if follows { "A target" } else { "A wall" };
    let about = text("about", &format!("{what} to begin with. Say here what to look for."));
    let mut all = vec![about, text("clock.frequency", clock)];
    let mut give = |pairs: &[(&str, &str)]| all.extend(pairs.iter().map(|(key, value)| text(key, value)));
    if let Some(begin) = beginning(args) {
        give(begin.keys);
        return all;
    }
    let (device, (encoder, resolution)) = match args.device.as_str() {
        "mass" => (MASS, ("encoder.resolution", format!("{:?}", 1.0 / f64::from(counts)))),
        kind => (if kind == "network" { NETWORK } else { MOTOR }, ("encoder.lines", counts.div_ceil(4).to_string())),
    };
    // A controller that follows a target has no wall, and no hand beside it.
    let is_apart = |key: &str| follows && (key.starts_with("wall.") || key.starts_with("hand."));
    let device: Vec<_> = device.iter().filter(|(key, _)| !is_apart(key)).copied().collect();
    give(&device);
    give(&[(encoder, &resolution)]);
    give(&[("run.duration", "1 s"), ("expect.outcome", "settled")]);
    if args.dut {
        // PWM counts of 1/16 for an encoder count: 0.5 N.m/rad of the motor's 0.265 N.m at 1024 counts.
        let gain = 16.0 * 0.5 * std::f64::consts::TAU / f64::from(counts) / 0.265 * 1024.0;
        give(&[
            ("dut.files", &format!("[{design:?}]")),
            ("dut.top", ENTITY),
            ("dut.clock", "clk"),
            ("dut.reset.port", "rst"),
            ("dut.ports.enc_a", "encoder.a"),
            ("dut.ports.enc_b", "encoder.b"),
            ("dut.ports.wall_at", "wall.count"),
            ("dut.ports.gain", &format!("{:.0}", gain.max(1.0))),
            ("dut.ports.pwm", "bridge.pwm"),
            ("dut.ports.dir", "bridge.direction"),
            ("wall.varies", "dut.ports.gain"),
        ]);
        return all;
    }
    let is_mass = args.device == "mass";
    let [stiffness, damping, coupling, c1] = match args.device.as_str() {
        "mass" => ["500 N/m", "1 N.s/m", "500 N/m", "500 N/m"],
        "network" => ["10 kN/m", "5 N.s/m", "0.3 N.m/rad", "0.28 N.m/rad"],
        _ => ["0.5 N.m/rad", "0.1 mN.m.s/rad", "0.3 N.m/rad", "0.28 N.m/rad"],
    };
    // Laws that have a damper of their own, or none.
    let damped = !matches!(method, "virtual_coupling" | "passive_spring");
    // Counts of the way that the hand goes: less than a revolution, or 6 cm.
    let way = if is_mass { counts.div_ceil(16) } else { counts };
    let bits = way.next_power_of_two().ilog2().max(12);
    give(&[("method.kind", method), ("method.sample_rate", "10 kHz"), ("method.position_bits", &bits.to_string())]);
    if !follows {
        give(&[("wall.stiffness", stiffness), ("wall.damping", if damped { damping } else { "0" })]);
    }
    match method {
        "virtual_coupling" => give(&[("method.coupling_stiffness", coupling)]),
        "energy_bounding" => give(&[("method.c1", c1)]),
        // A detent every 256 counts.
        "table" if is_mass => give(&[("method.torques", "[0, -1, 0, 1]"), ("method.spacing", "64")]),
        "table" => give(&[("method.torques", "[0, -0.002, 0, 0.002]"), ("method.spacing", "64")]),
        "pid" => {
            // A mass has no winding that damps it.
            let (place, damping) = match args.device.as_str() {
                "mass" => ("\"2 cm\"", "6 N.s/m"),
                "network" => ("\"2 mm\"", damping),
                _ => ("\"1 rad\"", damping),
            };
            let path = format!("[[\"100 ms\", 0], [\"200 ms\", {place}]]");
            give(&[("hand.kind", "none"), ("method.kp", stiffness), ("method.kd", damping), ("target.path", &path)]);
        }
        _ => {}
    }
    all
}
