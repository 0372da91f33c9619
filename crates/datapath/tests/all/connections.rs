//! The nets and instances of the loops, as the data sheet lists them.

use hpu_datapath::{ConventionalLoop, HybridLoop, Instance, LoopConfig, PwmConfig, Wiring};
use hpu_signal::{Format, Signal};

/// Returns widths that are all different, so that no two formats agree by chance.
fn uneven() -> LoopConfig {
    LoopConfig {
        position_width: 7,
        stiffness: Format::new(false, 4, 2).unwrap(),
        damping: Format::new(false, 3, 2).unwrap(),
        period_width: 10,
        velocity_width: 4,
        rescaled: true,
        scale: Format::new(false, 2, 1).unwrap(),
        pwm: PwmConfig { width: 8, ..PwmConfig::default() },
        ..LoopConfig::default()
    }
}

/// Returns the instance labels with their ports and nets, as the data sheet lists them.
fn connections(wiring: &impl Wiring) -> Vec<String> {
    let nets = wiring.nets();
    let instance = |instance: Instance| {
        let ports = instance.connections.iter().map(|connection| {
            let net = &nets[connection.net];
            assert_eq!(net.format, connection.port.format, "{} of {}", net.name, instance.label);
            format!("{}={}", connection.port.name, net.name)
        });
        let ports: Vec<String> = ports.collect();
        format!("{}: {}({})", instance.label, instance.model.name(), ports.join(" "))
    };
    wiring.instances().into_iter().map(instance).collect()
}

const PERIPHERY: [&str; 3] = [
    "sync: synchronizer(a_pin=a_pin b_pin=b_pin a=a b=b)",
    "decoder: quadrature_decoder(a=a b=b step=step error=error)",
    "counter: position_counter(step=step position=position)",
];

const PATH: [&str; 7] = [
    "wall: unilateral(delta=delta contact=contact penetration=penetration)",
    "spring_mult: truncating_multiplier(a=penetration b=stiffness product=spring)",
    "velocity_reg: velocity_register(position=position period=period scale=scale velocity=velocity)",
    "damping_mult: truncating_multiplier(a=velocity b=damping product=drag)",
    "sum: torque_sum(spring=spring damping=drag contact=contact torque=torque)",
    "limiter: command_limiter(value=torque limited=command)",
    "modulator: pwm(command=command a_high=a_high a_low=a_low b_high=b_high b_low=b_low)",
];

#[test]
fn the_hybrid_loop_is_connected_as_its_data_sheet_says() {
    let offset = ["offset: displacement(position=position reference=reference delta=delta)"];
    let expected = [&PERIPHERY[..], &offset, &PATH].concat();
    assert_eq!(connections(&HybridLoop::default()), expected);
    assert_eq!(connections(&HybridLoop::new(uneven()).unwrap()), expected);
}

#[test]
fn the_conventional_loop_is_connected_as_its_data_sheet_says() {
    let held = [
        "hold: zero_order_hold(d=position period=period q=held)",
        "offset: displacement(position=held reference=reference delta=delta)",
    ];
    let expected = [&PERIPHERY[..], &held, &PATH].concat();
    assert_eq!(connections(&ConventionalLoop::default()), expected);
    assert_eq!(connections(&ConventionalLoop::new(uneven()).unwrap()), expected);
}

#[test]
fn the_nets_are_inputs_outputs_and_architecture_signals_in_the_order_of_the_data_sheet() {
    let names =
        |wiring: &dyn Fn() -> Vec<Signal>| -> Vec<&'static str> { wiring().iter().map(|net| net.name).collect() };
    let ports = "a_pin b_pin reference stiffness damping period scale a_high a_low b_high b_low";
    let hybrid = HybridLoop::default();
    assert_eq!(
        names(&|| hybrid.nets()).join(" "),
        format!("{ports} a b step error position delta contact penetration spring velocity drag torque command")
    );
    assert_eq!(hybrid.ports(), 11);
    let conventional = ConventionalLoop::default();
    assert_eq!(
        names(&|| conventional.nets()).join(" "),
        format!("{ports} a b step error position held delta contact penetration spring velocity drag torque command")
    );
}

#[test]
fn a_loop_refuses_words_that_its_multipliers_cannot_take() {
    let signed = LoopConfig { damping: Format::signed(12), ..LoopConfig::default() };
    assert_eq!(
        HybridLoop::new(signed).unwrap_err().to_string(),
        "hybrid_loop: damping is (1,11,0); accepted: unsigned with 0 or more fraction bits, as (0,12,0)"
    );
    let wide = LoopConfig { period_width: 31, ..LoopConfig::default() };
    assert_eq!(
        ConventionalLoop::new(wide).unwrap_err().to_string(),
        "velocity_register: PERIOD_WIDTH is 31; accepted: 2 to 30"
    );
}
