//! Scenes of plants as transfer functions: what is refused, at its line and with what is accepted instead.

use hpu_scene::Experiment;

const GOOD: &str = "about = 'A test.'\nclock.frequency = '1 MHz'\nrun.duration = '1 s'\n[device]\nkind = 'transfer'\n\
                    numerator = [1]\ndenominator = [1, 2]\n[adc]\nrange = 2\nrate = '1 kHz'\n[dac]\nfull_scale = 2\n\
                    [method]\nnumerator = [1]\n[reference]\nvalue = 1\n";

fn parse(text: &str) -> Result<Experiment, String> {
    Experiment::parse("t.toml", text, &[], &mut |_| unreachable!("no file")).map_err(|error| error.to_string())
}

/// Asserts that a change of the good scene is refused with these words.
fn refused(from: &str, to: &str, said: &str) {
    assert_eq!(GOOD.matches(from).count(), 1, "{from}");
    let text = GOOD.replace(from, to);
    let error = parse(&text).map(|_| ()).expect_err(to);
    assert!(error.contains(said), "{to}: {error}");
    // The place is in the line that was changed, or in the section where a key is missing.
    assert!(error.contains("t.toml:"), "{error}");
}

#[test]
fn the_good_scene_is_good_and_both_other_ways_are_the_same_plant() {
    let Ok(Experiment::Transfer(scene)) = parse(GOOD) else { panic!("{:?}", parse(GOOD)) };
    assert_eq!((scene.adc.period, scene.discrete, scene.late), (1000, false, 0));
    // 12 bits of 2 to either side: a step is 2^-10 of both converters, so the gain 1 is the one of 16 fraction bits.
    let words = scene.words().unwrap();
    assert_eq!((words.numerator, words.denominator, words.reference), (vec![1 << 16], vec![1 << 16], 1 << 10));
    let plant = "numerator = [1]\ndenominator = [1, 2]\n";
    for other in ["poles = [-2]", "a = [[-2]]\nb = [1]\nc = [1]", "zeros = []\npoles = [-2]\ngain = 1"] {
        assert!(parse(&GOOD.replace(plant, &format!("{other}\n"))).is_ok(), "{other}");
    }
}

#[test]
fn a_plant_is_refused_where_it_is_none() {
    let plant = "numerator = [1]\ndenominator = [1, 2]\n";
    let ways = "write numerator and denominator; or poles, with zeros and gain; or a, b, c and d";
    refused(plant, "", ways);
    refused(plant, "numerator = [1]\n", "device.denominator: missing; write a list of numbers");
    refused(plant, "numerator = [1]\ndenominator = [1, 2]\npoles = [-1]\n", "a second way to write the plant");
    refused("[1]\nd", "[1, 0, 0]\nd", "6:13: device.numerator: degree 2 over degree 1 is improper");
    refused("[1]\nd", "[1, 0]\nd", "6:13: device.numerator: the plant's input reaches its output at once");
    refused("[1, 2]", "[0, 2]", "7:15: device.denominator: its first coefficient is 0");
    refused("[1, 2]", "[5]", "a constant has no states");
    refused("[1, 2]", "[1, 1e13]", "device.denominator[1]");
    refused("[1, 2]", "[1, nan]", "device.denominator[1]");
    refused("[1, 2]", "[1, inf]", "device.denominator[1]");
    refused("[1, 2]", "[1, 'x']", "device.denominator[1]");
    refused("[1, 2]", "2", "not such a list; write a list of numbers, as in [1, -0.5]");
    refused("[1, 2]", "[]", "0 of them; write a list of numbers");
    let long = format!("[{}]", vec!["1"; 14].join(", "));
    refused("[1, 2]", &long, "14 of them");
    refused("[1, 2]", "[1, 1e9]", "sample faster");
    let many = format!("poles = [{}]\n", vec!["-1"; 13].join(", "));
    refused(plant, &many, "13 states; write at most 12");
    refused(plant, "poles = [[-1, 0]]\n", "device.poles[0]: not a root; write a list of roots");
    refused(plant, "poles = [[-1, 1, 2]]\n", "not a root");
    refused(plant, "poles = [-1, 3]\nzeros = [3]\n", "device.zeros[0]: it cancels a pole that does not decay");
    refused(plant, "a = [[1, 2]]\nb = [1]\nc = [1]\n", "a row of 2 numbers in a matrix of 1 rows");
    refused(plant, "a = [1]\nb = [1]\nc = [1]\n", "device.a[0]: not a row");
    refused(plant, "a = [[1]]\nb = [1]\n", "device.c: missing");
    refused(plant, "a = [[1]]\nb = [1, 2]\nc = [1]\n", "2 numbers beside 1 states");
    refused(plant, "a = [[1]]\nb = [0]\nc = [1]\n", "does not reach the output");
    refused("[1, 2]\n", "[1, 2]\ninitial = [1, 2]\n", "2 numbers, and the plant has 1 states");
}

#[test]
fn rates_and_words_are_refused_with_what_is_accepted() {
    refused("'1 kHz'", "'2 MHz'", "adc.rate: 2000000 Hz is faster than the clock; write at most 1000000 Hz");
    refused("'1 kHz'", "'3 kHz'", "is not a whole number of them; write 3003.003003003003 Hz or 2994.011976047904 Hz");
    refused("'1 kHz'", "1e-4", "write at most 2^30 of them");
    refused("[1, 2]\n", "[1, 2]\nsample_time = '2 ms'\n", "device.sample_time: 0.002 s, and adc.rate takes a sample");
    refused(
        "[method]\nnumerator = [1]",
        "[method]\nnumerator = [1e6]",
        "method.numerator[0]: 1000000 is 1000000 steps",
    );
    refused("[method]", "[method]\ndenominator = [0, 1]", "method.denominator[0]: 0, and the controller divides");
    refused("[method]", "[method]\ndenominator = [1e-6]", "rounds to 0 in 16 fraction bits");
    refused("value = 1", "value = 3", "reference.value: 3 lies beyond the words of the ADC; write -2 to 1.9990234375");
    refused("full_scale = 2", "full_scale = 0", "dac.full_scale");
    refused("range = 2", "range = 1e-8\nbits = 32", "a step of 4.656612873077393e-18 is too small");
    refused("full_scale = 2", "full_scale = 2\nlate = 2", "dac.late: `2` is not a whole number from 0 to 1");
    refused(
        "[method]",
        "[dut]\ntop = 'a'\n[method]",
        "dut: unknown key; a plant as a transfer function is driven by [method] alone",
    );
    refused("[method]", "[hand]\nkind = 'none'\n[method]", "hand");
    // A late word breaks the loop that an immediate plant would close.
    assert!(parse(&GOOD.replace("[1]\nd", "[1, 0]\nd").replace("full_scale = 2", "full_scale = 2\nlate = 1")).is_ok());
}
