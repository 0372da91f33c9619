//! Reading a scene of a segment on a gimbal.

use hpu_datapath::FractionalConfig;
use hpu_datapath::gimbal::{GimbalConfig, GimbalLoopConfig, ServoConfig};
use hpu_plant::arm::{Finger, Gimbal};
use hpu_signal::Format;

use crate::gimbal::rows;
use crate::gimbal::{
    ForceSensor, GimbalMethod, GimbalModel, GimbalScene, PositionGains, Posture, Probe, Servo, Shear, Target,
    TargetKind, Thresholds,
};
use crate::head::expect::expect;
use crate::head::expect::{Expect, Metric};
use crate::head::model::step;
use crate::head::{Own, about, clock};
use crate::random::SplitMix64;
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity::{ANGLE, Dimension, FREQUENCY, LENGTH, Sense, TIME};
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};
use crate::schema::{Key, Quantity};
use crate::text::message::number;

/// The head of a scene of a gimbal.
const OWN: Own = Own {
    kind: "gimbal",
    plant_rate: &rows::record_gimbal::plant_rate,
    expect: gimbal_expect,
    outputs: &rows::accuracy_gimbal::outputs,
};

pub(crate) fn scene(file: &str, source: &Source) -> Result<GimbalScene, SceneError> {
    let root = Section::root(source);
    root.accept(&["gimbal"])?;
    let about = about(&root)?;
    let clock = clock(&root.section("clock")?)?;
    let gimbal = device(&root.section("device")?)?;
    let tilt_servo = {
        use rows::tilt_servo as key;
        servo(
            &root.section("tilt_servo")?,
            [&key::stall_torque, &key::no_load_speed, &key::inertia, &key::coulomb, &key::rate],
        )?
    };
    let crank_servo = {
        use rows::crank_servo as key;
        servo(
            &root.section("crank_servo")?,
            [&key::stall_torque, &key::no_load_speed, &key::inertia, &key::coulomb, &key::rate],
        )?
    };
    let force_sensor = ForceSensor::read(&root.section("force_sensor")?)?;
    let head = OWN.head(file, source, &root, (about, clock))?;
    let (switch, latched, bumpless, decay) = switch(&root.section("switch")?)?;
    let finger = root.section("finger")?;
    let surface = root.section("surface")?;
    surface.accept(&[])?;
    let shear = if root.has("shear") { Some(shear(&root.section("shear")?)?) } else { None };
    let mut scene = GimbalScene {
        shear,
        method: method(&root.section("method")?, &gimbal, &crank_servo, &force_sensor, (latched, bumpless, decay))?,
        target: target(&root.section("target")?, head.run.duration_s, head.run.seed)?,
        stiffness_n_per_m: surface.read(&rows::surface::stiffness)?,
        thresholds: switch,
        probe: if root.has("finger") { Some(probe(&finger)?) } else { None },
        model: model(&root.section("model")?)?,
        gimbal,
        tilt_servo,
        crank_servo,
        force_sensor,
        head,
    };
    if let Some(shear) = &shear {
        scene.method.config.shear = shear_words(shear);
    }
    scene.parameters = source.parameters.take(&["about", "expect", "accuracy"]).into();
    agree(&scene)?;
    Ok(scene)
}

fn device(s: &Section) -> Result<Gimbal, SceneError> {
    use rows::gimbal as key;
    s.accept(&["gimbal"])?;
    let gimbal = Gimbal {
        crank_m: s.read(&key::crank)?,
        rod_m: s.read(&key::rod)?,
        offset_m: s.read(&key::offset)?,
        mass_kg: s.read(&key::mass)?,
        gravity_m_per_s2: s.read(&key::gravity)?,
        length_m: s.read(&key::length)?,
        form: s.read(&key::energies)?,
    };
    if gimbal.rod_m <= gimbal.crank_m {
        let [rod_m, crank_m] = [gimbal.rod_m, gimbal.crank_m].map(number);
        return Err(s.error("rod", format!("{rod_m} m; write more than device.crank, {crank_m} m")));
    }
    gimbal.check().map_err(|error| s.error("rod", error.to_string()))?;
    Ok(gimbal)
}

fn servo(s: &Section, keys: [&'static Key<Quantity>; 5]) -> Result<Servo, SceneError> {
    s.accept(&[])?;
    let [stall, no_load, inertia, coulomb, rate] = keys;
    Ok(Servo {
        stall_nm: s.read(stall)?,
        no_load_rad_per_s: s.read(no_load)?,
        inertia_kg_m2: s.read(inertia)?,
        coulomb_nm: s.read(coulomb)?,
        rate_hz: s.read(rate)?,
    })
}

fn switch(s: &Section) -> Result<(Thresholds, bool, bool, u32), SceneError> {
    use rows::switch as key;
    s.accept(&[])?;
    let on_n = s.read(&key::on)?;
    let off_n = s.read_or(&key::off, on_n, Origin::Default)?;
    if off_n > on_n {
        return Err(s.error("off", format!("above switch.on; write at most {} N", number(on_n))));
    }
    Ok((Thresholds { on_n, off_n }, s.read(&key::latched)?, s.read(&key::bumpless)?, s.read(&key::decay)?))
}

fn shear(s: &Section) -> Result<Shear, SceneError> {
    use rows::shear as key;
    s.accept(&[])?;
    Ok(Shear {
        order: Shear::fraction(s.read(&key::order)?),
        viscosity: s.read(&key::viscosity)?,
        layer_m: s.read(&key::layer)?,
        area_m2: s.read(&key::area)?,
        skin_n_per_m: s.read(&key::skin)?,
        memory: s.read(&key::memory)?,
    })
}

/// Returns the words of a scene's fractional derivative. With 28 fraction bits, the weights of the longest memory are
/// together within 254 · 5/8 · 2^-28 = 6e-7 of the exact ones.
fn shear_words(shear: &Shear) -> FractionalConfig {
    let gain = Format::new(false, 12, 12).expect("24 bits");
    FractionalConfig {
        gain,
        coef_frac: 28,
        order: shear.order,
        memory: shear.memory,
        ..GimbalLoopConfig::default().shear
    }
}

fn method(
    s: &Section,
    gimbal: &Gimbal,
    crank_servo: &Servo,
    force: &ForceSensor,
    (latched, bumpless, decay): (bool, bool, u32),
) -> Result<GimbalMethod, SceneError> {
    use rows::method_gimbal as key;
    s.accept(&["gimbal"])?;
    let gains = |proportional: &'static Key<Quantity>, derivative: &'static Key<Quantity>| {
        Ok(PositionGains { proportional: s.read(proportional)?, derivative_s: s.read(derivative)? })
    };
    let mut config = GimbalLoopConfig::default();
    let length_lsb_m = config.gimbal.length.lsb();
    let lsbs = |length_m: f64| (length_m / length_lsb_m).round() as u32;
    config.gimbal = GimbalConfig {
        crank: lsbs(gimbal.crank_m),
        rod: lsbs(gimbal.rod_m),
        offset: lsbs(gimbal.offset_m),
        ..config.gimbal
    };
    let sample_rate_hz = s.read(&key::sample_rate)?;
    // Room for 20 full drives per radian.
    let proportional = Format::new(false, 16, 4).expect("20 bits");
    config.servo = ServoConfig { window: s.read(&key::derivative_window)?, proportional, ..config.servo };
    config.crank = config.servo;
    config.switch.take_radius = latched;
    config.switch.bumpless = bumpless;
    config.switch.decay = decay;
    let force_lsb_n = force.full_scale_n / f64::from(1u32 << config.impedance.force_width);
    let drive_nm = crank_servo.stall_nm / f64::from(1u32 << (config.impedance.drive_width - 1));
    let gain = force_lsb_n * length_lsb_m / drive_nm;
    // As many fraction bits as a VHDL natural takes, up to 40.
    let frac = (0..=40).rev().find(|frac| libm::scalbn(gain, *frac) < f64::from(i32::MAX)).unwrap_or(0);
    config.impedance.gain = libm::scalbn(gain, frac).round().max(1.0) as u32;
    config.impedance.gain_frac = frac.unsigned_abs();
    Ok(GimbalMethod {
        sample_rate_hz,
        tilt: gains(&key::proportional, &key::derivative)?,
        crank: gains(&key::crank_proportional, &key::crank_derivative)?,
        force_gain: s.read(&key::force_gain)?,
        config,
    })
}

/// Reads a list of lists, each with one element a dimension. `accepted` is the form in messages.
fn lists<const N: usize>(
    s: &Section,
    name: &'static str,
    accepted: &str,
    kinds: [(&'static Dimension, Sense); N],
) -> Result<Vec<[f64; N]>, SceneError> {
    let refused = |key: &str, why: &str| s.error(key, format!("{why}; write {accepted}"));
    if !s.has(name) {
        return Err(refused(name, "missing"));
    }
    let items = s.get(name).and_then(|item| item.as_array()).filter(|items| !items.is_empty());
    let items = items.ok_or_else(|| refused(name, "not such a list"))?;
    let mut all = Vec::new();
    for (index, item) in items.iter().enumerate() {
        let key = format!("{name}[{index}]");
        let row = item.as_array().filter(|row| row.len() == N);
        let row = row.ok_or_else(|| refused(&key, &format!("not a list of {N}")))?;
        let mut values = [0.0; N];
        for (at, (dimension, sense)) in kinds.into_iter().enumerate() {
            let item = toml_edit::Item::Value(row.get(at).expect("one of them").clone());
            values[at] = s.quantity_of(&format!("{key}[{at}]"), &item, dimension, sense, |_| None)?;
        }
        all.push(values);
    }
    let text = all.iter().map(|row| format!("[{}]", row.map(number).join(", "))).collect::<Vec<_>>().join(", ");
    let units = kinds.map(|(dimension, _)| dimension.si);
    let unit = match units[..] {
        ["s", "m"] => "s, m",
        ["m", "Hz"] => "m, Hz",
        ["rad", "Hz"] => "rad, Hz",
        _ => "s, m, rad, rad",
    };
    s.note(name, ParameterValue::Text(format!("[{text}]")), unit, Origin::Scene);
    Ok(all)
}

/// Refuses points whose times do not increase.
fn in_time<const N: usize>(s: &Section, points: &[[f64; N]]) -> Result<(), SceneError> {
    match points.windows(2).position(|pair| pair[1][0] <= pair[0][0]) {
        None => Ok(()),
        Some(index) => {
            let [before, after] = [index, index + 1].map(|index| number(points[index][0]));
            let reason = format!("times must increase: {after} s follows {before} s");
            Err(s.error(&format!("path[{}][0]", index + 1), reason))
        }
    }
}

fn target(s: &Section, duration_s: f64, seed: u64) -> Result<Target, SceneError> {
    let kind = s.read(&rows::target::kind)?;
    s.accept(&[kind.name()])?;
    let rate_hz = s.read(&rows::target_rate::rate)?;
    let still = |height_m: f64| vec![(0.0, [height_m, 0.0, 0.0])];
    let waves = [Vec::new(), Vec::new(), Vec::new()];
    Ok(match kind {
        TargetKind::Path => {
            let kinds =
                [(&TIME, Sense::NotNegative), (&LENGTH, Sense::Any), (&ANGLE, Sense::Any), (&ANGLE, Sense::Any)];
            let points = lists(s, "path", rows::TARGET_PATH, kinds)?;
            in_time(s, &points)?;
            let points = points.into_iter().map(|[time_s, height, pitch, roll]| (time_s, [height, pitch, roll]));
            Target { points: points.collect(), is_smooth: false, waves, rate_hz }
        }
        TargetKind::Sines => {
            let read = |name: &'static str, accepted: &str, dimension: &'static Dimension| {
                let kinds = [(dimension, Sense::Any), (&FREQUENCY, Sense::Positive)];
                if s.has(name) { lists(s, name, accepted, kinds) } else { Ok(Vec::new()) }
            };
            let waves = [
                read("height", rows::LENGTH_WAVES, &LENGTH)?,
                read("pitch", rows::ANGLE_WAVES, &ANGLE)?,
                read("roll", rows::ANGLE_WAVES, &ANGLE)?,
            ];
            Target { points: still(s.read(&rows::target_middle::middle)?), is_smooth: false, waves, rate_hz }
        }
        TargetKind::Random => {
            use rows::target_random as key;
            let middle_m = s.read(&rows::target_middle::middle)?;
            let interval_s = s.read(&key::interval)?;
            let (range_m, tilt_rad, profile) =
                (s.read(&key::height_range)?, s.read(&key::tilt)?, s.read(&key::profile)?);
            let ranges: Posture = [0.5 * range_m, tilt_rad, tilt_rad];
            let mut random = SplitMix64::new(seed.wrapping_mul(1_000_003).wrapping_add(profile));
            let points = Target::random(&mut random, middle_m, ranges, interval_s, duration_s);
            Target { points, is_smooth: true, waves, rate_hz }
        }
    })
}

fn probe(s: &Section) -> Result<Probe, SceneError> {
    use rows::finger as key;
    s.accept(&[])?;
    let finger = Finger { stiffness_n_per_m: s.read(&key::stiffness)?, damping_n_s_per_m: s.read(&key::damping)? };
    let points = lists(s, "path", rows::FINGER_PATH, [(&TIME, Sense::NotNegative), (&LENGTH, Sense::Any)])?;
    in_time(s, &points)?;
    let speeds = points.windows(2).map(|pair| ((pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0])).abs());
    let fastest = speeds.fold(0.0, f64::max);
    let slower = match s.has(key::speed.name) {
        true if fastest == 0.0 => return Err(s.error("speed", "the path does not move; leave it out")),
        true => fastest / s.read(&key::speed)?,
        false => 1.0,
    };
    Ok(Probe { finger, path: points.into_iter().map(|[time_s, height_m]| (time_s * slower, height_m)).collect() })
}

fn model(s: &Section) -> Result<GimbalModel, SceneError> {
    use rows::model_gimbal as key;
    s.accept(&["gimbal"])?;
    let solver = s.read(&key::solver)?;
    Ok(GimbalModel { solver, step_s: step(s, &key::step, solver)? })
}

fn gimbal_expect(s: &Section) -> Result<Expect, SceneError> {
    use rows::expect_gimbal as key;
    s.accept(&["gimbal"])?;
    expect(s, &[(Metric::Rms, &key::rms), (Metric::Amplitude, &key::amplitude)], &key::outcome)
}

/// Checks that the device reaches the displacement that a shear stress asks for.
fn sheared(scene: &GimbalScene) -> Result<(), SceneError> {
    let Some(displacement) = scene.displacement() else { return Ok(()) };
    let posture = scene.target.at(0.0);
    if scene.tip_m(posture)[0] != 0.0 {
        let reason = format!(
            "begins with a roll of {} degrees; a shear stress needs a target that begins at 0, because the object is \
             taken to have been at rest there before",
            number(posture[2].to_degrees())
        );
        return Err(scene.error("target", reason));
    }
    let [_, most_m] = scene.gimbal.radii_m();
    for (time_s, x_m) in displacement.steps() {
        let [_, y_m, z_m] = scene.tip_m(scene.target.at(time_s));
        let (roll_rad, radius_m) = (libm::atan2(x_m.abs(), y_m), libm::hypot(x_m, libm::hypot(y_m, z_m)));
        if roll_rad > Gimbal::TILT_RAD || radius_m > most_m {
            let reason = format!(
                "the stress asks the tip to move by {} mm at {} s, out of the device's reach; write less viscosity or \
                 a slower target",
                number((1e6 * x_m.abs()).round() / 1e3),
                number(time_s)
            );
            return Err(scene.error("shear.viscosity", reason));
        }
    }
    Ok(())
}

/// Checks the conditions between the parts of a scene.
fn agree(scene: &GimbalScene) -> Result<(), SceneError> {
    let [least_m, most_m] = scene.gimbal.radii_m();
    let travel_m = most_m - least_m;
    let [height, pitch, roll] = scene.target.bounds();
    if height[0] < 0.0 || height[1] > travel_m {
        // In whole micrometres.
        let mm = |height_m: f64| number((1e6 * height_m).round() / 1e3);
        let [low, high] = height.map(mm);
        let reason = format!(
            "heights from {low} mm to {high} mm; the crank reaches 0 to {} mm above the least radius",
            mm(travel_m)
        );
        return Err(scene.error("target", reason));
    }
    if let Some(tilt_rad) = [pitch, roll].into_iter().flatten().find(|angle_rad| angle_rad.abs() > Gimbal::TILT_RAD) {
        let reason = format!(
            "a tilt of {} degrees; the gimbal turns by at most 55 to either side",
            number(tilt_rad.to_degrees())
        );
        return Err(scene.error("target", reason));
    }
    scene.words()?;
    sheared(scene)?;
    let (period, least) = (scene.period_clocks(), u64::from(scene.method.config.least_period(scene.shear.is_some())));
    if period < least {
        let most_hz = scene.clock.frequency_hz() / least;
        let reason =
            format!("a sample every {period} clocks, but the datapath takes {least}; the clock allows {most_hz} Hz");
        return Err(scene.error("method.sample_rate", reason));
    }
    let most = (1u64 << scene.method.config.period_width) - 1;
    if period > most {
        let reason = format!("a sample every {period} clocks; the period's word takes at most {most}");
        return Err(scene.error("method.sample_rate", reason));
    }
    let fastest =
        [scene.target.rate_hz, scene.tilt_servo.rate_hz, scene.crank_servo.rate_hz, scene.force_sensor.rate_hz];
    if fastest.iter().any(|rate_hz| scene.clock.edges(1.0 / rate_hz) < 1) {
        return Err(scene.error("clock.frequency", "slower than a rate of the scene"));
    }
    Ok(())
}
