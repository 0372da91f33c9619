//! The nets and instances of the PHANToM's wirings, as the data sheet lists them.

use hpu_datapath::phantom::{Config, Formats, PhantomIo, PhantomLoop, PhantomSharedLoop};
use hpu_datapath::{Instance, Wiring};
use hpu_signal::Format;

/// Returns the instance labels with their ports, and with their nets where these have another name.
fn connections(wiring: &impl Wiring) -> Vec<String> {
    let nets = wiring.nets();
    let instance = |instance: Instance| {
        let ports = instance.connections.iter().map(|connection| {
            let net = &nets[connection.net];
            assert_eq!(net.format, connection.port.format, "{} of {}", net.name, instance.label);
            let (port, net) = (connection.port.name, net.name);
            if port == net { port.to_string() } else { format!("{port}={net}") }
        });
        let ports: Vec<String> = ports.collect();
        format!("{}: {}({})", instance.label, instance.model.name(), ports.join(" "))
    };
    wiring.instances().into_iter().map(instance).collect()
}

/// Returns formats that are all different, so that no two words agree by chance.
fn uneven() -> Config {
    let format = |signed, int, frac| Format::new(signed, int, frac).unwrap();
    let formats = Formats {
        trig: format(true, 2, 11),
        length_frac: 12,
        position: format(true, 1, 13),
        stiffness: format(false, 9, 3),
        force: format(true, 5, 7),
        torque: format(true, 4, 6),
    };
    let config = Config { position_width: 9, period_width: 10, depth_width: 7, formats, ..Default::default() };
    Config { command_width: 15, force_limit: 1000, lengths: [573; 2], ..config }
}

const ENCODERS: [&str; 9] = [
    "sync1: synchronizer(a_pin=a_pin1 b_pin=b_pin1 a=a1 b=b1)",
    "sync2: synchronizer(a_pin=a_pin2 b_pin=b_pin2 a=a2 b=b2)",
    "sync3: synchronizer(a_pin=a_pin3 b_pin=b_pin3 a=a3 b=b3)",
    "decoder1: quadrature_decoder(a=a1 b=b1 step=step1 error=error1)",
    "decoder2: quadrature_decoder(a=a2 b=b2 step=step2 error=error2)",
    "decoder3: quadrature_decoder(a=a3 b=b3 step=step3 error=error3)",
    "counter1: position_counter(step=step1 position=position1)",
    "counter2: position_counter(step=step2 position=position2)",
    "counter3: position_counter(step=step3 position=position3)",
];

const SINES: [&str; 4] = [
    "sample: sample_register(position1 position2 position3 period count1 count2 count3)",
    "trig1: trig_table(count=count1 sine=sine1 cosine=cosine1 valid=valid1)",
    "trig2: trig_table(count=count2 sine=sine2 cosine=cosine2 valid=valid2)",
    "trig3: trig_table(count=count3 sine=sine3 cosine=cosine3 valid=valid3)",
];

#[test]
fn the_parallel_loop_is_connected_as_its_data_sheet_says() {
    let path = [
        "forward: phantom_forward(sine1 cosine1 sine2 cosine2 sine3 cosine3 x y z radius)",
        "room_walls: cube_room(x y z x_low x_high y_low y_high z_low z_high room stiffness force_x force_y force_z \
         contact)",
        "jacobian: phantom_torque(sine1 cosine1 sine2 cosine2 sine3 cosine3 x z force_x force_y force_z torque1 \
         torque2 torque3)",
        "scale1: command_scaler(torque=torque1 valid1 valid2 valid3 command=scaled1)",
        "scale2: command_scaler(torque=torque2 valid1 valid2 valid3 command=scaled2)",
        "scale3: command_scaler(torque=torque3 valid1 valid2 valid3 command=scaled3)",
        "hold: command_register(d1=scaled1 d2=scaled2 d3=scaled3 period q1=command1 q2=command2 q3=command3)",
    ];
    let expected = [&ENCODERS[..], &SINES, &path].concat();
    assert_eq!(connections(&PhantomLoop::default()), expected);
    assert_eq!(connections(&PhantomLoop::new(uneven()).unwrap()), expected);
}

#[test]
fn the_shared_loop_is_connected_as_its_data_sheet_says() {
    let engine =
        ["engine: phantom_engine(sine1 cosine1 sine2 cosine2 sine3 cosine3 valid1 valid2 valid3 x_low x_high y_low \
         y_high z_low z_high room stiffness period x y z radius force_x force_y force_z contact torque1 torque2 \
         torque3 command1 command2 command3)"];
    let expected = [&ENCODERS[..], &SINES, &engine].concat();
    assert_eq!(connections(&PhantomSharedLoop::default()), expected);
    assert_eq!(connections(&PhantomSharedLoop::new(uneven().shared()).unwrap()), expected);
}

#[test]
fn the_bare_input_and_output_is_connected_as_its_data_sheet_says() {
    let hold = ["hold: command_register(d1=host1 d2=host2 d3=host3 q1=command1 q2=command2 q3=command3)"];
    let expected = [&ENCODERS[..], &hold].concat();
    assert_eq!(connections(&PhantomIo::default()), expected);
    assert_eq!(connections(&PhantomIo::new(9, 15).unwrap()), expected);
}

#[test]
fn the_nets_are_inputs_outputs_and_architecture_signals_in_the_order_of_the_data_sheet() {
    fn names(wiring: &impl Wiring) -> String {
        wiring.nets().iter().map(|net| net.name).collect::<Vec<_>>().join(" ")
    }
    let pins = "a_pin1 b_pin1 a_pin2 b_pin2 a_pin3 b_pin3";
    let lines = "a1 b1 a2 b2 a3 b3 step1 error1 step2 error2 step3 error3";
    let shared = format!(
        "{pins} x_low x_high y_low y_high z_low z_high room stiffness period command1 command2 command3 {lines} \
         position1 position2 position3 count1 count2 count3 sine1 cosine1 valid1 sine2 cosine2 valid2 sine3 cosine3 \
         valid3 x y z radius force_x force_y force_z contact torque1 torque2 torque3"
    );
    assert_eq!(names(&PhantomSharedLoop::default()), shared);
    assert_eq!(names(&PhantomLoop::default()), format!("{shared} scaled1 scaled2 scaled3"));
    let io = format!("{pins} host1 host2 host3 position1 position2 position3 command1 command2 command3 {lines}");
    assert_eq!(names(&PhantomIo::default()), io);
    assert_eq!(PhantomLoop::default().ports(), 18);
    assert_eq!(PhantomSharedLoop::default().ports(), 18);
    assert_eq!(PhantomIo::default().ports(), 15);
}
