//! Tables for the tests of README.md and the book: the form in which each command runs, the source of each figure, and
//! the figures that no test can check.

/// The form in which a command of a page runs in the test.
pub enum Form {
    /// The command as it is.
    AsIs,
    /// A shorter command, with the reason. The output that the page shows is then in the record of the whole command,
    /// if there is one.
    Short { line: &'static str, why: &'static str, record: Option<&'static str> },
    /// The command is begun and interrupted, because it has no option that would make it short.
    Begun(&'static str),
    /// The command does not run in this test.
    NotHere(&'static str),
}

const fn short(line: &'static str, why: &'static str) -> Form {
    Form::Short { line, why, record: None }
}

const SEARCH: &str = "hpu widths hybrid-wall stiff-hybrid --also wall.stiffness=2.5 --also hand.stiffness=0.6 \
                      --search --proved --against 24 --price -o out";
const ESTIMATORS: &str = "hpu study velocity-estimators -o out";
const CORNER: &str =
    "hpu run dual-rate-wall --set method.estimator=filtered --set 'method.velocity_filter.corner=30 Hz'";
const RECURS_60_S: &str = "hpu run friction-wall --set run.duration=60s";
const PAGE: &str = "hpu widths hybrid-wall -o out";
const WRAP: &str = "hpu run wrap-product --beside wrap-saturated -o out";
const CHART: &str = "hpu chart friction-wall -o out";
const FITTED: &str = "takes the averaged bridge, 0.16 % off and some 20 times as fast";
const FIT: &str = "hpu fit friction-wall";
const STUDENT: &str = "hpu limits student.toml";
const STUDENT_LATE: &str = "hpu limits student.toml --set model.datapath=linear --set 'model.delay=250 us'";
const KNOB: &str = "hpu limits cable.toml --set 'device.bodies.handle.mass=10 g' --set wall.damping=0";
const GATHERED: &str = "gather of 10 000 rows in 10, 100 and 500 shards | 0.14 s, 0.36 s, 0.47 s";

const VERB: &str = "the name of a verb; its commands are in this table";

/// Every command of README and of the book.
pub const COMMANDS: &[(&str, Form)] = &[
    (
        "cargo run --profile quick -- run hybrid-wall -o out",
        short(
            "hpu run hybrid-wall -o out",
            "it makes the quick build; test.sh holds its files against those of this one",
        ),
    ),
    ("testbench/test.sh", Form::NotHere("it runs this test")),
    (
        "testbench/systems.sh",
        Form::NotHere("it builds for other systems, for some ten minutes; its record is committed"),
    ),
    ("testbench/explorer.sh", Form::NotHere("it builds the engine for browsers, which testbench/browser.sh has")),
    (
        "hpu explore hybrid-wall -o explore.html",
        Form::NotHere(
            "it takes the page of the line before; its own tests write one, testbench/browser.sh the real one",
        ),
    ),
    ("cargo run --release -p hpu-book -- target/book", Form::NotHere("the tests of hpu-book render the book")),
    ("cargo build --release -p hpu-capi", Form::NotHere("it builds the library, which the tests of hpu-capi have")),
    (
        "cc -O2 -Icrates/capi/include -o motor crates/capi/examples/motor.c -Ltarget/release -lhpu",
        Form::NotHere("the tests of hpu-capi compile the example"),
    ),
    (
        "LD_LIBRARY_PATH=target/release ./motor hybrid-wall wall.stiffness=2",
        Form::NotHere("the tests of hpu-capi run the example"),
    ),
    (
        "pip wheel ./crates/python --no-deps -w dist",
        Form::NotHere("it builds the crates once more; testbench/long.sh makes the wheel and tests it"),
    ),
    ("testbench/wheel.sh", Form::NotHere("it builds the crates once more; testbench/long.sh runs it")),
    ("testbench/release.sh", Form::NotHere("it builds the crates once more; testbench/long.sh runs it")),
    ("pip install dist/*.whl", Form::NotHere("testbench/wheel.sh does so")),
    ("hpu completions SHELL", short("hpu completions bash", "SHELL is any of the shells")),
    ("hpu man", Form::AsIs),
    ("hpu block pwm --generic WIDTH=14", Form::AsIs),
    (
        "hpu block truncating_multiplier --generic A_WIDTH=10 --generic DROP_LOWER=4 --generic ROUNDING=nearest_even",
        Form::AsIs,
    ),
    (
        "hpu vectors pwm --generic WIDTH=14 --bench -o out",
        short("hpu vectors pwm --generic WIDTH=14 --count 99 --bench -o out", "its rows are 160000"),
    ),
    ("hpu check pwm --generic WIDTH=14", short("hpu check pwm --generic WIDTH=6 --rows 9", "its rows are 180000")),
    ("hpu check --entity", Form::NotHere("the name of a verb and an option; a command has them")),
    ("hpu vectors --verify", Form::NotHere("the name of a verb and an option; tests of blocks have files")),
    ("hpu block NAME", short("hpu block saturator", "NAME is any block")),
    ("hpu run hybrid-wall -o out", Form::AsIs),
    (CORNER, Form::AsIs),
    (WRAP, Form::AsIs),
    (PAGE, Form::AsIs),
    (
        SEARCH,
        Form::Short {
            line: "hpu widths hybrid-wall stiff-hybrid --also wall.stiffness=2.5 --also hand.stiffness=0.6 --search \
                   --proved --against 24 -o short --vary position_bits=11..12 --vary stiffness_format.int=6..7 \
                   --vary stiffness_format.frac=0..1 --vary damping_format.int=2..3 --vary damping_format.frac=1..2 \
                   --vary velocity_bits=9..10",
            why: "the whole grid takes half a minute; this part of it, not counted by Yosys, \
                  has the same smallest design",
            record: Some("testbench/record/widths.txt"),
        },
    ),
    ("hpu new haptics --ci", Form::AsIs),
    ("hpu cost --scene testbench/dut/knee.toml", Form::AsIs),
    (
        "hpu run testbench/dut/knee.toml --set faults.missed_edge=3 --set faults.bounce=5 \
         --set 'faults.clock_jitter=20 ns' -o faulty",
        short(
            "hpu run testbench/dut/knee.toml --set faults.missed_edge=3 --set faults.bounce=5 \
             --set 'faults.clock_jitter=20 ns' -o faulty --edges 1000000",
            "jitter stops the design at every edge of the encoder; a tenth of the time has faults of each kind",
        ),
    ),
    (
        "hpu check --entity fast_mul --as truncating_multiplier --port x=a --port y=b --port p=product --clock clock \
         --latency 2 --generic N=A_WIDTH --generic KEEP=OUT_WIDTH --generic SATURATING=SATURATE \
         testbench/dut/blocks/fast_mul.vhd",
        short(
            "hpu check --entity fast_mul --as truncating_multiplier --port x=a --port y=b --port p=product --clock \
             clock --latency 2 --generic N=A_WIDTH --generic KEEP=OUT_WIDTH --generic SATURATING=SATURATE --variant \
             full testbench/dut/blocks/fast_mul.vhd",
            "entity.rs checks it in all configurations",
        ),
    ),
    (
        "hpu run epfl-paddle-step --set 'method.kd=0.0008 N.m.s/deg' --set \
         'device.bodies.paddle.initial_position=0.342 deg' --against \
         testbench/recordings/epfl-paddle/step-p05-d0008.csv -o paddle",
        Form::AsIs,
    ),
    ("hpu run knob.toml -o out", Form::AsIs),
    ("hpu new wall --method sampled_wall", Form::AsIs),
    ("hpu keys", Form::AsIs),
    ("hpu scenes show wall.toml", Form::AsIs),
    ("hpu new mine --dut", Form::AsIs),
    ("hpu run knob.toml --set method.kind=conventional", Form::AsIs),
    ("hpu vectors pwm --format json", short("hpu vectors pwm --format json --count 10", "its rows are 40000")),
    ("hpu run hybrid-wall --set wall.stiffness=2.5 --set method.pwm.bits=10", Form::AsIs),
    ("hpu run detent-knob", Form::AsIs),
    ("hpu run following-motor", Form::AsIs),
    ("hpu run following-motor --set method.feed_forward=0", Form::AsIs),
    ("hpu report hybrid-wall -o report.html", Form::AsIs),
    (
        "hpu limits conventional-wall-1khz",
        short(
            "hpu limits conventional-wall-1khz --range 0.1..1 --phases 1 --words 4",
            "the usual range and eight phases take half a minute of two cores",
        ),
    ),
    (
        "hpu limits hybrid-wall -o out",
        short("hpu limits hybrid-wall -o out --words 4 --phases 1", "eight phases take ten seconds of two cores"),
    ),
    (
        "hpu limits hybrid-wall --over 'device.inductance=0.2..0.25 mH' --over 'device.resistance=2.2..2.5 Ohm'",
        short(
            "hpu limits hybrid-wall --over 'device.inductance=0.2..0.25 mH' --words 4 --phases 1",
            "a box of two sides in words takes half a minute of two cores",
        ),
    ),
    (
        "hpu limits hybrid-wall --for-ever --over 'device.rotor_inertia=1.3e-6..1.44e-6 kg.m^2'",
        short(
            "hpu limits hybrid-wall --for-ever --over 'device.rotor_inertia=1.36e-6..1.38e-6 kg.m^2' \
             --range '0.6..0.61' --words 2 --phases 1",
            "every word of a box takes half a minute",
        ),
    ),
    (
        "hpu limits hybrid-wall --for-ever",
        short("hpu limits hybrid-wall --for-ever --words 4 --phases 1", "eight phases take ten seconds of two cores"),
    ),
    (
        "hpu limits hybrid-wall --hands 50mm",
        short(
            "hpu limits hybrid-wall --hands 50mm --range 0.1..0.2 --words 2 --phases 1",
            "nineteen worlds at eight phases take half a minute of two cores",
        ),
    ),
    (
        "hpu map hybrid-wall --x 'wall.stiffness=0.1..6' --y 'wall.damping=0..0.4 mN.m.s/rad' -o map",
        short(
            "hpu map hybrid-wall --x 'wall.stiffness=0.1..6:5' --y 'wall.damping=0..0.4 mN.m.s/rad:5' -o map",
            "41 by 41 cells take some seconds of two cores",
        ),
    ),
    ("hpu sweep run testbench/studies/example.toml --section map -o sweep", Form::AsIs),
    (
        "hpu map hybrid-wall --x 'wall.stiffness=0.1..4:24' --y 'wall.damping=0..0.4 mN.m.s/rad:12' --full --for-ever \
         -o walls",
        short(
            "hpu map hybrid-wall --x 'wall.stiffness=0.1..4:3' --y 'wall.damping=0..0.4 mN.m.s/rad:2' --full \
             --for-ever -o walls",
            "it has 288 cells",
        ),
    ),
    ("hpu map --from sweep -o drawn", Form::AsIs),
    ("hpu sweep plan testbench/studies/example.toml --section map -o farm", Form::AsIs),
    ("hpu sweep status farm", Form::AsIs),
    ("hpu reproduce phantom-formats", Form::AsIs),
    (
        "hpu cost position_counter",
        short(
            "hpu cost position_counter --variant 8_bit",
            "each of its variants is a synthesis of seconds, the first time",
        ),
    ),
    ("hpu block truncating_multiplier", Form::AsIs),
    ("hpu keys method", Form::AsIs),
    ("hpu keys part", Form::AsIs),
    ("hpu keys maxon", Form::AsIs),
    ("hpu vectors pwm --set-kind random --seed 7 --count 1000 > pwm.txt", Form::AsIs),
    ("hpu vectors trig_table --set-kind table --table sines --format coe", Form::AsIs),
    (
        "hpu check",
        short(
            "hpu check saturator displacement --rows 50 --scene hybrid-wall --edges 2000",
            "all blocks and closed loops take a minute or two",
        ),
    ),
    ("hpu check --formal --scene hybrid-wall", Form::AsIs),
    (
        "hpu check --formal",
        short("hpu check --formal displacement pwm braking_pulse", "all blocks and loops take some minutes"),
    ),
    (
        "surfer out/wave.fst -c out/wave.fst.sucl",
        Form::NotHere("it opens a window; the tests of hpu-wave read the commands"),
    ),
    ("gtkwave out/wave.fst.gtkw", Form::NotHere("it opens a window; the tests of hpu-wave read the save file")),
    ("echo 'a,b\n60,70' | hpu block truncating_multiplier --variant drop_upper --inputs -", Form::AsIs),
    (
        "hpu run testbench/dut/knee.toml -o out",
        short(
            "hpu run testbench/dut/knee.toml -o out --edges 1000000",
            "ten million clock edges with a picture take seconds; the tests of designs run them",
        ),
    ),
    (
        "hpu run testbench/dut/foc.toml",
        short(
            "hpu run testbench/dut/foc.toml --edges 500000",
            "thirty million clock edges take seconds; the tests of designs run them",
        ),
    ),
    (
        "hpu run testbench/dut/knee.toml --compare",
        short(
            "hpu run testbench/dut/knee.toml --compare --edges 1000000",
            "ten million clock edges of Verilator take seconds; the tests of designs compare more of them",
        ),
    ),
    (
        "hpu limits testbench/dut/knee.toml --range 50..600 --phases 4",
        short(
            "hpu limits testbench/dut/knee.toml --range 100..600 --phases 1 --words 2",
            "sixty gains at four phases take minutes of two cores",
        ),
    ),
    (
        "hpu map testbench/dut/knee.toml --x dut.ports.gain=50..550:11 \
         --y 'hand.stiffness=0.1..1.1 N.m/rad:11' -o rings",
        short(
            "hpu map testbench/dut/knee.toml --x dut.ports.gain=50..550:2 \
             --y 'hand.stiffness=0.1..1.1 N.m/rad:2' -o rings --set run.duration=0.2s",
            "121 cells of a second take minutes of two cores; a cell of 0.2 s has a fifth of the edges",
        ),
    ),
    ("hpu scenes", Form::AsIs),
    (
        "hpu map hybrid-wall --x 'wall.stiffness=0.1..6 N.m/rad:21:log' --y 'method.sample_rate=0.2..20 kHz:11:log' \
         --all-methods -o out",
        short(
            "hpu map hybrid-wall --x 'wall.stiffness=0.1..6 N.m/rad:2:log' --y 'method.sample_rate=2..20 kHz:2:log' \
             --all-methods -o methods --set run.duration=0.6s",
            "twelve methods on 231 cells take a quarter of a minute on two cores",
        ),
    ),
    (ESTIMATORS, Form::AsIs),
    (
        "hpu reproduce criteria",
        Form::Begun("a minute of one core; testbench/long.sh tests a device, record/criteria.txt is what it prints"),
    ),
    (
        "hpu run thrown-hybrid --driver rtl --hdl hdl --edges 100000 -o out",
        short("hpu run thrown-hybrid --driver rtl --edges 100000 -o out", "hpu carries the VHDL of that folder"),
    ),
    (
        "hpu reproduce phantom-lag",
        Form::Begun("one or two minutes on two cores; testbench/record/phantom-lag.txt is what it prints"),
    ),
    ("hpu reproduce hybrid-loop", Form::Begun("minutes on two cores; hpu-study tests what it finds")),
    ("hpu reproduce input-shaper", Form::Begun("minutes on two cores; hpu-study tests what it finds")),
    ("hpu reproduce three-dof", Form::Begun("a quarter of a minute; hpu-study tests what it finds")),
    (
        "hpu map gimbal-switch --x 'surface.stiffness=0.1..3 N/mm:30' --y 'method.force_gain=0..15:16' -o out",
        Form::Short {
            line: "hpu map gimbal-switch --x 'surface.stiffness=0.1..3 N/mm:3' \
                   --y 'method.force_gain=0..15:3' -o switch",
            why: "480 cells take ten seconds",
            record: Some("testbench/record/gimbal-switch.txt"),
        },
    ),
    ("hpu reproduce power-scaling", Form::Begun("a quarter of a minute; hpu-study tests what it finds")),
    (
        "hpu reproduce phantom-table-2 -o out",
        short(
            "hpu reproduce phantom-table-2 --axes x --platforms RTOS-1,FPGA-20 --stiffness 250,5000 --trials 1 \
             --set run.duration=1s -o table",
            "all trials take about three minutes on two cores",
        ),
    ),
    (
        "hpu reproduce phantom-ladder --axes y --trials 1 -o out",
        short(
            "hpu reproduce phantom-ladder --axes y --trials 1 --platforms FPGA-20 --stiffness 250 \
             --set run.duration=1s -o ladder",
            "all platforms and walls take about three minutes on two cores",
        ),
    ),
    (
        "hpu run SCENE --compare",
        short(
            "hpu run hybrid-wall --compare --edges 2000000",
            "SCENE is any scene; by the clock a whole one takes long",
        ),
    ),
    (
        CHART,
        short(
            "hpu chart friction-wall --contestants \
             averaged,sample+loaded,midpoint@1ms+law,rk4@1ms+law,midpoint@30us,euler@10us,euler@100us -o chart",
            "all ways to run it take a minute or two on two cores",
        ),
    ),
    (FIT, Form::AsIs),
    ("hpu fit", Form::Begun("all scenes take two minutes; testbench/record/fit.txt is what it prints")),
    ("hpu run hybrid-wall", Form::AsIs),
    ("hpu run friction-wall", Form::AsIs),
    (RECURS_60_S, Form::AsIs),
    ("hpu run conventional-wall-1khz", Form::AsIs),
    ("hpu run hybrid-wall --for-ever", Form::AsIs),
    ("hpu run friction-wall --set run.duration=10s --set model.bridge=averaged", Form::AsIs),
    (
        "\u{2026} --set record.plant_rate=1kHz",
        short(
            "hpu run friction-wall --set run.duration=10s --set model.bridge=averaged --set record.plant_rate=1kHz",
            "the dots stand for the command above it",
        ),
    ),
    (
        "hpu run hybrid-wall --driver clock",
        short("hpu run hybrid-wall --driver clock --edges 2000000", "two seconds of every edge take seconds"),
    ),
    ("hpu keys encoder", Form::AsIs),
    ("hpu new full", Form::AsIs),
    ("hpu run stop.toml -o out", Form::AsIs),
    ("hpu run stop.toml --set encoder.lines=256", Form::AsIs),
    ("hpu run stop.toml --set encoder.lines=256 --set method.kind=hybrid", Form::AsIs),
    ("hpu widths stop.toml --set method.kind=hybrid", Form::AsIs),
    ("hpu check --scene stop.toml --edges 20000", Form::AsIs),
    ("hpu check --formal --scene stop.toml", Form::AsIs),
    ("cat mine.toml", Form::AsIs),
    ("hpu widths mine.toml", short("hpu widths mine.toml --set run.duration=1ms", "it takes seconds")),
    (
        "hpu run mine.toml -o out --wave ports",
        short("hpu run mine.toml -o out --wave ports --edges 30000", "it takes seconds"),
    ),
    (
        "hpu run mine.toml -o out --wave count duty --from 100us --to 200us",
        short("hpu run mine.toml -o out --wave count duty --from 100us --to 200us --edges 30000", "it takes seconds"),
    ),
    (
        "hpu run mine.toml",
        short("hpu run mine.toml --edges 1000000", "Verilator clocks every edge of a second, which takes seconds"),
    ),
    (
        "hpu chart testbench/dut/knee.toml",
        short("hpu chart testbench/dut/knee.toml --set run.duration=2ms", "its wall times take seconds"),
    ),
    ("hpu run hybrid-wall --compare --edges 2000000", Form::AsIs),
    ("hpu run cable.toml", Form::AsIs),
    ("hpu run two-encoder-joint", Form::AsIs),
    ("hpu run two-encoder-joint --set method.position=load", Form::AsIs),
    ("hpu run epfl-paddle-step", Form::AsIs),
    ("hpu run foc-detents", Form::AsIs),
    ("hpu run foc-wall", Form::AsIs),
    ("hpu run foc-wall --set 'method.zero=0.449 rad'", Form::AsIs),
    ("hpu run epfl-paddle-step -o out", short("hpu run epfl-paddle-step -o out --edges 3360000", "it runs 0.3 s")),
    (
        "hpu run epfl-paddle-cycle --set model.bridge=averaged",
        short("hpu run epfl-paddle-cycle --set model.bridge=averaged --set run.duration=0.2s", "it runs 2 s"),
    ),
    (
        "hpu run epfl-paddle-cycle --set method.current_share=1",
        short("hpu run epfl-paddle-cycle --set method.current_share=1 --set run.duration=0.2s", "it runs 2 s"),
    ),
    ("hpu reproduce epfl-paddle", Form::Begun("half a minute; testbench/record/epfl-paddle.txt is what it prints")),
    ("hpu run epfl-paddle-step --set model.datapath=float32", Form::AsIs),
    ("hpu run epfl-paddle-cycle", Form::AsIs),
    ("hpu run brake", Form::AsIs),
    ("hpu run brake --for-ever", Form::AsIs),
    ("hpu run delayed-integrator --for-ever", Form::AsIs),
    (
        "hpu run epfl-paddle-cycle --set method.integral_limit=5",
        short("hpu run epfl-paddle-cycle --set method.integral_limit=5 --set run.duration=0.2s", "it runs 2 s"),
    ),
    (
        STUDENT,
        short("hpu limits student.toml --words 2 --phases 1", "the usual stiffnesses in words take half a minute"),
    ),
    (STUDENT_LATE, Form::AsIs),
    (
        KNOB,
        short(
            "hpu limits cable.toml --set 'device.bodies.handle.mass=10 g' --set wall.damping=0 --words 2 --phases 1",
            "the usual stiffnesses in words take half a minute",
        ),
    ),
    (
        "hpu sweep submit farm --engine slurm --limit 500",
        short(
            "hpu sweep submit farm --engine slurm --limit 500 --dry-run",
            "testbench/sweep.sh starts a Slurm of its own",
        ),
    ),
    ("hpu sweep run farm", Form::AsIs),
    ("hpu map --from farm -o map", Form::AsIs),
    (
        "hpu sweep run limits.toml -o limits",
        short(
            "hpu sweep plan limits.toml -o limits --shard-points 9",
            "123 points of up to a minute each; a smaller study of limits is in the tests of sweeps",
        ),
    ),
    ("hpu study --from limits", Form::NotHere("it shows the points that were not run")),
    ("hpu run NAME -o out", short("hpu run capped-stiffness -o out", "NAME is any scene of the table")),
    ("hpu --help", Form::AsIs),
    ("hpu VERB --help", short("hpu limits --help", "VERB is any verb")),
    ("hpu new NAME --device motor", short("hpu new motor --device motor", "NAME is any name")),
    ("hpu diff A B", short("hpu diff hybrid-wall hybrid-wall", "A and B are any results")),
    ("cargo install --path crates/cli", Form::NotHere("it builds the program once more")),
    ("hpu reproduce", Form::NotHere(VERB)),
    ("hpu limits", Form::NotHere(VERB)),
    ("hpu widths", Form::NotHere(VERB)),
    (
        "hpu export fmu SCENE -o FILE",
        Form::NotHere("SCENE and FILE are any; testbench/oracle/fmu.py and export.rs export some"),
    ),
    ("hpu certify FILE", Form::NotHere("its file stands for any certificate; options.rs and contract.rs have one")),
    ("hpu map", Form::NotHere(VERB)),
    ("hpu study", Form::NotHere(VERB)),
    ("hpu run", Form::NotHere(VERB)),
    ("hpu run SCENE --for-ever", short("hpu run bounded-wall --for-ever", "SCENE is any scene")),
    ("hpu report", Form::NotHere(VERB)),
    ("hpu explore", Form::NotHere(VERB)),
    ("hpu cost", Form::NotHere(VERB)),
    ("hpu vectors", Form::NotHere(VERB)),
    ("hpu block", Form::AsIs),
    ("hpu sweep submit", Form::NotHere(VERB)),
];

/// The source of a figure.
pub enum From {
    /// The output of a command of a page, in the form in which it runs here.
    Run(&'static str),
    /// A file of the repository.
    File(&'static str),
}

const WIDTHS: From = From::File("testbench/record/widths.txt");
const TABLE_2: From = From::File("testbench/record/phantom-table-2.txt");
const SWITCH: From = From::File("testbench/record/gimbal-switch.txt");
const LAG: From = From::File("testbench/record/phantom-lag.txt");
const PRECISION: From = From::File("testbench/record/high-precision.txt");
const SWEEP: From = From::File("testbench/record/sweep.txt");
const RATIOS: From = From::File("testbench/record/speed-ratios.txt");

/// Figures in the pages' prose: the text in a page, the source of the figure, and the text in that source.
pub const FIGURES: &[(&str, From, &str)] = &[
    ("is run at 12 seeds", TABLE_2, "88 of 480 cells are near a boundary and run at 12 seeds"),
    ("*7/12* says that it is passive in 7 of them", TABLE_2, "y FPGA-400 10000 N/m passive in 7 of 12 seeds"),
    ("FPGA-400 gains nothing over FPGA-100 is met in 1 of 12", TABLE_2, "(e) met in 1 of 12"),
    (
        "Lags from 0.30 to 0.40 ms fit a transmission of 3.5 kN/m",
        LAG,
        "3.5 kN/m, as shipped passive at 750, not at 1000 N/m: 0.30 0.35 0.40; at",
    ),
    ("(the whole arm: 0.35 to 0.45)", LAG, "3.5 kN/m, as shipped passive at 750, not at 1000 N/m: 0.35 0.40 0.45; at"),
    ("lags up to 0.25 ms a rigid one", LAG, "rigid passive at 750, not at 1000 N/m: 0.05 0.10 0.15 0.20 0.25; at"),
    ("lags from 0.40 ms on one of 2 kN/m", LAG, "2 kN/m passive at 750, not at 1000 N/m: 0.40 0.45 0.50 0.55 0.60; at"),
    ("swings at 25 to 29 Hz", SWITCH, "swings at full scale 67 %, 25 to 29 Hz"),
    ("189 of the 190 cells that fail", SWITCH, "sampled: predicts 189 of 190 cells that fail"),
    ("and 14 of the 290 that hold", SWITCH, "and 14 of 290 that hold"),
    ("the motion repeats from 3.2 s on", From::Run(RECURS_60_S), "repeats … that at 3.217 s"),
    ("1.08 rad/s rms beside the speed", From::Run(ESTIMATORS), "difference 1.078 rad/s 3.08 rad/s 0.466 rad/s"),
    ("off least, 0.16 rad/s", From::Run(ESTIMATORS), "edge timer 0.157 rad/s"),
    ("a lag of 5 to 8 ms", From::Run(ESTIMATORS), "filtered, 2^-3 0.280 rad/s 1.28 rad/s 0.144 rad/s 7.90 ms"),
    ("a lag of 5 to 8 ms", From::Run(ESTIMATORS), "window of 8 0.211 rad/s 0.90 rad/s 0.147 rad/s 4.56 ms"),
    ("off by 1.5 rad/s", From::Run(ESTIMATORS), "Levant, 25 rad/s2 1.484 rad/s"),
    (
        "here it is 5894, which has a corner of 29.997 Hz",
        From::Run(CORNER),
        "filter of weight 5894 / 2^16 is a corner of 29.997 Hz, asked 30 Hz",
    ),
    ("`spring \u{2026} 77.57 %`", From::Run(WRAP), "4076 0 % 77.57 % PWM count"),
    (
        "Within 1 % of a 24-bit design's stable stiffness",
        WIDTHS,
        "smallest widths that keep the reference's stable stiffness within 1.00 %",
    ),
    ("505 LUTs do instead of 3590", WIDTHS, "505 LUT4 instead of 3590"),
    (
        "505 LUTs do instead of 3590",
        From::Run(SEARCH),
        "position 12, stiffness (0,6,0), damping (0,2,2), velocity 10, pwm 12",
    ),
    ("505 LUTs do instead of 3590", From::Run(SEARCH), "2.657092+ N.m/rad instead of 2.666122: -0.34 %"),
    ("505 LUTs do instead of 3590", From::Run(SEARCH), "512 LUT4 instead of 3663"),
    (
        "463 LUTs seem to do, but the velocity then saturates at 2 bits",
        WIDTHS,
        "velocity 2, pwm 12: 474 LUT4 estimated, 463 counted",
    ),
    ("at 2.5 N.m/rad the wall is 1.7 % off", WIDTHS, "it is 1.7 % off at 2.5 N.m/rad"),
    // The error, then that of the trace, of the penetration, and of the verdict. On a busy machine a run by steps is
    // timed in part, and the column before them says how far.
    ("An averaged bridge is 0.16 % off", From::Run(CHART), "averaged … 0.16 % 0.02 % 0.16 % right"),
    ("are 0.04 % off", From::Run(CHART), "sample+loaded … 0.04 % 0.04 % 0.01 % right"),
    ("by the implicit midpoint: 0.9 % off", From::Run(CHART), "midpoint@1ms+law … 0.89 % 0.06 % 0.89 % right"),
    ("errors between 0.2 % and 3.6 % depend", From::Run(CHART), "euler@10us … 0.21 % 0.03 % 0.21 % right"),
    ("errors between 0.2 % and 3.6 % depend", From::Run(CHART), "midpoint@30us … 3.57 % 0.08 % 3.57 % right"),
    ("at 100 \u{b5}s the wall is called unstable", From::Run(CHART), "euler@100us … wrong 1.52 % 82.93 % wrong"),
    (
        "the classic Runge-Kutta method calls the wall unstable there",
        From::Run(CHART),
        "rk4@1ms+law … wrong >1000 % 100.00 % wrong",
    ),
    // Which model is taken depends on the machine where two are about as fast.
    (FITTED, From::Run(FIT), "run it by … model.bridge=averaged"),
    (FITTED, From::Run(FIT), "judged … peak_penetration 0.…%, the same verdict"),
    (FITTED, From::Run(CHART), "averaged … 0.16 % 0.02 % 0.16 % right"),
    (FITTED, From::File("testbench/record/fit.txt"), "friction-wall 21.4 x 0.16 %"),
    (
        "29 of 79 can be had at least five times as fast",
        From::File("testbench/record/fit.txt"),
        "29 of 79 at least 5 times as fast as written",
    ),
    ("426 to 472 |", RATIOS, "hybrid-wall,2s … 426 472"),
    ("61 to 73 |", RATIOS, "friction-wall,2s … 61 73"),
    ("575 to 953 |", RATIOS, "friction-wall,60s … 575 953"),
    ("3034 to 3526 |", RATIOS, "contact,averaged … 3034 3526"),
    ("4684 to 5801 |", RATIOS, "contact,1kHz-rows … 4684 5801"),
    ("over 2.2·10¹⁰ edges", PRECISION, "all 9087980505"),
    ("over 2.2·10¹⁰ edges", PRECISION, "all 13702471412"),
    ("more than 1.5 million ends of slip", PRECISION, "all 13702471412 9223919 772752 1537968"),
    ("an integration of 58 decimal places", PRECISION, "plant against 58 decimal places"),
    ("this motion fits in 4 bits", From::Run(PAGE), "velocity_bits 12 4 4 -"),
    ("other motions of the same device use up to 10", From::Run(PAGE), "velocity (1,11,0) -4..8 -364..367"),
    ("| 224 kN/m | 5.3 |", From::Run(STUDENT), "linear loop, ideal drive \u{2026} to 223974.2 N/m"),
    ("one count is 4.7124 um at the handle", From::Run("hpu run cable.toml"), "one count is 4.7124 um at the handle"),
    ("| 42 kN/m | 1 |", From::Run(KNOB), "linear loop, ideal drive \u{2026} to 41945.23 N/m"),
    ("| 75 kN/m | 1.8 |", From::Run(STUDENT_LATE), "linear loop, ideal drive \u{2026} to 75038.37 N/m"),
    ("| free motion, 20 ms | 1.56 | 2 304 000 |", SWEEP, "free motion, 20 ms 1.56 ms a point, 2304000 points"),
    ("| a motor's hybrid wall, 2 s | 22.19 | 162 254 |", SWEEP, "hybrid wall, 2 s 22.19 ms a point, 162254 points"),
    ("with friction, 2 s | 67.97 | 52 966 |", SWEEP, "with friction, 2 s 67.97 ms a point, 52966 points"),
    ("sampled at 1 kHz, 2 s | 40.47 | 88 958 |", SWEEP, "sampled at 1 kHz, 2 s 40.47 ms a point, 88958 points"),
    ("drop test | 28.75 | 125 217 |", SWEEP, "a PHANToM's drop test 28.75 ms a point, 125217 points"),
    (
        "in Verilog by Verilator, 1 s at 10 MHz | 727.66 | 4 947 |",
        SWEEP,
        "in Verilog, a wall of 1 s 727.66 ms a point, 4947 points",
    ),
    ("switched touch | 20.00 | 180 000 |", SWEEP, "switched touch 20.00 ms a point, 180000 points"),
    ("two local workers | +4.1 % of the processor time", SWEEP, "processor time: \u{2026}: +4.1 %"),
    ("on two slots of this host | 3.5 a second", SWEEP, "by Slurm on two cores: 18.1 s, 3.5 a second"),
    ("peak 14.75 degrees", From::Run("hpu run epfl-paddle-step"), "peak_angle 257.38 mrad within 349.07 urad"),
    ("on its Hall sensor, 11.1 Hz", From::Run("hpu run epfl-paddle-cycle"), "frequency 11.15 Hz within"),
    (GATHERED, SWEEP, "a gather of 10 000 rows in 10 shards: 0.14 s"),
    (GATHERED, SWEEP, "a gather of 10 000 rows in 100 shards: 0.36 s"),
    (GATHERED, SWEEP, "a gather of 10 000 rows in 500 shards: 0.47 s"),
];

/// Figures in the pages that no run of this test prints, each with the reason.
pub const EXCEPTED: &[(&str, &str)] = &[
    (
        "| inertia, 1e-4 kg\u{b7}m\u{b2} | 5.341 | 5.353 \u{b1} 0.025 | | friction at the motor, mN\u{b7}m \
         | 0.692 | 0.693 \u{b1} 0.010 | | zero of the current, mA | -4.62 | -4.78 \u{b1} 0.32 | \
         | weight's stiffness, N\u{b7}m/rad | 0.0154 | 0.0165 \u{b1} 0.0018 | \
         | share of the current's filter | 0.0456 | 0.045 to 0.052 | | resistance, Ohm | 9.95 | near 10.6 | \
         | inductance, mH | 1.43 | at most 1.5 | | limit of the integral, V | 6.97; higher ones fit as well \
         | at least 8 | | viscous friction, 1e-4 N\u{b7}m\u{b7}s/rad | 7.1 | not told, 0 to 8 |",
        "searches of minutes: a test of testbench/long.sh prints the first column, another simulator made the second",
    ),
    (
        "At a stiffness of 1 N\u{b7}m/rad, 0.6 s from a state of 0.3 counts have at most 0.405 counts rms",
        "windows_from_a_state_are_those_of_other_numerics, a test of hpu-prove",
    ),
    ("converter takes 16 samples of the current in a period", "the firmware's timers"),
    ("The ripple is some 0.3 A", "what testbench/oracle/paddle.py computes in minutes"),
    ("samples' mean is 0.4 mA below", "what testbench/oracle/paddle.py computes in minutes"),
    ("comes to rest 0.02 degrees too far", "what testbench/oracle/paddle.py computes in minutes"),
    ("1000 logs of emulated motors, 94 % of the intervals", "record/identify.txt, a test of testbench/long.sh"),
    ("for up to 10 s of motion (`--for-ever=30s` for more)", "the option's default"),
    ("with a damping of 0 those", "a word"),
    ("glibc 2.17 or newer", "what zig links for, which auditwheel tells of the wheel"),
    ("Python 3.11 or newer", "the interface that the wheel is built for"),
    ("`HPU_NO_DUT=1`", "a switch"),
    ("`motor = \"vasudevan_2007\"`", "a name"),
    ("`device.bodies.rotor.part = \"maxon-re25-118743\"`", "a name"),
    ("VHDL-93", "the name of a standard"),
    (
        "a position controller every 351 us, a current controller every 51 us on the mean of 33 codes",
        "the firmware's figures",
    ),
    ("follows a step of 10 degrees", "what the scene asks for"),
    ("`1 - exp(-2 pi f T)`", "how the weight is defined"),
    ("nearest word of 16 bits", "how the weight is defined"),
    ("`method.velocity_filter.order = 2`", "a key"),
    ("coefficients have 30 fraction bits; `A2` follows", "how the block is defined"),
    ("a table of 2, 4, 8, 16 or 32 torques", "what the key accepts"),
    ("falls through 0", "how a detent is defined"),
    ("has 24 detents a turn", "what the scene asks for"),
    ("An output that is `'Z'` drives 0 in Verilator", "how the model is defined"),
    ("because Verilator 5.006 counts in one unit", "a release"),
    ("sought at 200 stiffnesses", "how the search is defined"),
    ("the last 30 % of the run", "how the window is defined"),
    ("more than 5 % faster", "how `fit` is defined"),
    ("the interval of 95 %", "how an interval is defined"),
    ("more than 2 counts rms, or more than 5 in a window of 40 ms", "how a rejection is defined"),
    // Speeds and times depend on the machine. Those of the table are in testbench/record/speed.txt and compare.txt.
    ("more than a hundred times slower than events", MACHINE),
    ("55 to 190 times as fast", MACHINE),
    ("25 to 50 times as fast", MACHINE),
    ("15 to 40 times as fast", MACHINE),
    ("| 2.7·10¹⁰ |", MACHINE),
    ("| 4.1·10⁹ |", MACHINE),
    ("| 5.4·10¹⁰ |", MACHINE),
    ("| 1.7·10¹¹ |", MACHINE),
    ("| 2.7·10¹¹ |", MACHINE),
    ("| 6.3·10⁷ | 1 |", MACHINE),
    ("an Intel Xeon at 2.5 GHz", MACHINE),
    ("by 0.1 to 1.2 of that", MACHINE),
    ("is 1000 times slower than events", MACHINE),
    ("GHDL more than 30 000 times slower", MACHINE),
    ("Linux x86-64", "the machine that it is developed on"),
    ("Windows x86-64", "the name of a system"),
    ("aarch64", "the name of a processor"),
    ("It takes 50 to 400 times as long", MACHINE),
    // Settings that a reader chooses, and figures from the literature.
    ("They begin at 0, as in an FPGA", SETTING),
    ("(`n <= #1 n + 1`, `n <= n + 1 after 1 ns`)", SETTING),
    ("(`initial #100`, `wait`", SETTING),
    ("`\"u_vel.vel_r\" = \"s7.8\"`", SETTING),
    ("`\"ab(1)\"`, `\"ab(7 downto 4)\"`, `\"ab[7:4]\"`", SETTING),
    ("`\"gains(2)\"`", SETTING),
    ("`\"g[2]\"`", SETTING),
    ("`\"g[1][3:0]\"`", SETTING),
    ("a count beyond `range 0 to 99`", SETTING),
    ("The text is UTF-8, UTF-16 or Latin-1.", SETTING),
    ("`time = \"1 [ms]\"`", SETTING),
    ("Times since 1970", SETTING),
    ("Counts of 8, 12, 16, 24 or 32 bits", SETTING),
    ("A level is 0 or 1 (also `0.0`,", SETTING),
    ("the number of the literal, from 0 |", SETTING),
    (
        "{ a = \"ui_in[0]\", b = \"ui_in[1]\", pwm = \"uo_out[0]\", direction = \"uo_out[1]\", mode = \"ui_in[7:2]\" }",
        SETTING,
    ),
    ("as in `mode = 0`", SETTING),
    ("`--set device.joints.cable.stiffness=\"5 kN/m\"`", SETTING),
    ("`--port 'pins[1:0]=step'`", SETTING),
    ("`--depth 1` leaves out", SETTING),
    ("`--latency 2` says", SETTING),
    ("(Pediredla et al. 2022)", LITERATURE),
    ("Vasudevan, Manohar and Manivannan (2007)", LITERATURE),
    ("A paper keeps the lower 12 bits of a 24-bit product", LITERATURE),
    ("*Advanced Robotics* 21(11), 2007", LITERATURE),
    ("*Journal of Computing and Information Science in Engineering* 9(1), 2009", LITERATURE),
    ("Table 2 of Sevcik et al.", LITERATURE),
    ("PHANToM Premium 1.0", LITERATURE),
    ("PMOS-1", "the name of a platform"),
    ("up to 400 000 times a second", "the name of the platform FPGA-400, in kHz"),
    ("are 12 bits enough?", SETTING),
    ("A device, 12 bits, 20 kHz", SETTING),
    ("3 axes x 8 platforms x 20 walls x 3 trials of 10 s", "the defaults of the command, as its help says"),
    ("| at 50 MHz |", SETTING),
    ("instead of each 0.1 ms", "the usual record.plant_rate, 10 kHz"),
    ("`\"25.175 MHz\"`, `\"1.2 mN.m\"`", SETTING),
    ("within 1 %", "the usual tolerance"),
    ("steps the plant at every 20 ns edge", SETTING),
    ("from 1 µs on", SETTING),
    // These runs take too long for this test, or are tested elsewhere.
    ("still 0.002 % off", "a hundred million steps of rk4 take half a minute: the whole command tells it"),
    ("At 4096 the product wraps", "2^12"),
    ("That is 4200 mod 4096", "60 by 70, and 2^12"),
    ("the last 16 clock cycles", "the tests of hpu-rtl break a block and count them"),
    ("about 10⁻¹⁶ of the exchange", "rounding of f64; every run's test of energy holds it"),
    ("MIT or Apache-2.0", "names of licences"),
    ("a cable on a capstan moves a handle, 6 mm for a radian", SETTING),
    ("There is room for 12 states", "how many a network may have, and a test of it counts"),
    ("`sensor.NAME.valid`, which is 1 for the clock cycle", "a test of sensors holds it"),
    ("a stream of 10 MHz makes ten million", SETTING),
    ("4.7 % off at 30 degrees", "the sine of an angle against the angle"),
    ("came out three times too stiff: 126 kN/m, where the real one has 42", OUTSIDE),
    (
        "Its rotor has 50 g.cm2 and moves the handle by 6 mm a radian, so it weighs 139 g there; the handle has 10 g",
        SETTING,
    ),
    ("With a handle of 10 g and no damping", SETTING),
    ("`--set host.late=0`", SETTING),
    ("| 137 kN/m | 3.3 |", MONODROMY),
    ("| 77 kN/m | 1.8 |", MONODROMY),
    ("| 62 kN/m | 1.5 |", MONODROMY),
    // A sweep of a million cells, and what follows of its figures and those of the record for a billion.
    ("cells of `free-motion` of 1 ms, gathered from 32 shards", SETTING),
    ("gather of a million rows | 3.8 s to 4.0 s, 58 MB of memory", MACHINE),
    ("its file | 7 bytes a row; 26 where rows differ more", MACHINE),
    ("manifest of 10^9 points, a map of 1000 by 1000 cells with 1000 methods | 150 kB", MACHINE),
    ("A shard costs the gather about 0.7 ms, a row 4 µs", MACHINE),
    ("for 10^9 points of the hybrid wall, 22.19 ms each, in shards of a minute (2 700 points, 370 370 shards)", FARM),
    ("1 000 cores", FARM),
    ("100 000 cores", FARM),
    ("6 160 core-hours | 6.2 h | 4 min", FARM),
    ("one task a core, at 3.5 a second | 5 min | 7.9 h", FARM),
    ("17 a second | 1 669 a second", FARM),
    ("one process | 71 min", FARM),
    ("(1001 unless configured)", "a setting of Slurm's"),
    ("`--cores 128` makes one task of 128 cores, so 782 tasks start in 4 min", FARM),
    ("10 000 operations a second. `--shard-time 10min` divides that by ten", FARM),
    ("10^10 points", FARM),
    // Names.
    ("model 1.0 or 1.5", "names"),
    ("`[phantom-table-2]`", "a name"),
    ("phantom-table-2", "a name"),
    ("`shards-1/*.parquet`", "a name"),
    ("(z3, yices, bitwuzla)", "a name"),
    ("larger values of `c1`", "a name"),
    ("[table 2", "a name"),
    ("a counter of 12 bits, a truncating multiplier, a PWM of 12 bits", LITERATURE),
    ("FPGAs at up to 400 kHz", LITERATURE),
    ("2048 counts a turn", SETTING),
    ("8 integer bits, 4 fraction bits", SETTING),
    ("plain VHDL-2008 and stands", "the name of a standard"),
    ("`--set WIDTH=14`", SETTING),
    ("`hpu.Block(\"pwm\", WIDTH=14)`", SETTING),
    ("| 0 | `truncate`", ROUNDING),
    ("| 1 | `toward_zero`", ROUNDING),
    ("| 2 | `nearest_up`", ROUNDING),
    ("| 3 | `nearest_down`", ROUNDING),
    ("| 4 | `nearest_away`", ROUNDING),
    ("| 5 | `nearest_inward`", ROUNDING),
    ("| 6 | `nearest_even`", ROUNDING),
    ("| 7 | `nearest_odd`", ROUNDING),
];

const MACHINE: &str = "it depends on the machine";
const OUTSIDE: &str = "figures of a real knob";
const MONODROMY: &str = "the tests of hpu-prove hold it to a monodromy matrix";
const FARM: &str = "it follows from the record's figures for a point, a shard and a task";
const LITERATURE: &str = "it stands in the literature";
const SETTING: &str = "a setting, which no run finds";
const ROUNDING: &str = "a number of rounding_pkg.vhd, which proofs of the multiplier hold to the mode";
