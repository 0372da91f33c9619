//! The equations of the headers, typeset: known ones as written by hand, and of each block no word, number or sign is
//! lost.

use hpu_book::equation::typeset;
use hpu_rtl::Hdl;

/// Returns the lines of a block's header between its purpose and the list of its generics or ports.
pub fn equations(name: &str) -> String {
    let vhdl = Hdl::Carried.text(name).expect("VHDL");
    let header = vhdl.lines().take_while(|line| line.starts_with("--")).skip_while(|line| *line != "--");
    let labels = ["-- generics ", "-- in  ", "-- out "];
    let lines = header.take_while(|line| !labels.iter().any(|label| line.starts_with(label)));
    let lines: Vec<_> = lines.map(|line| line.trim_start_matches("--").strip_prefix(' ').unwrap_or("")).collect();
    lines.join("\n").trim_matches('\n').to_string()
}

/// Returns the names of all blocks.
fn blocks() -> Vec<&'static str> {
    hpu_datapath::registry().iter().map(|block| block.name()).collect()
}

/// Returns the cells of a typeset run, row by row, as the text that they show. A cell over several columns counts once.
fn cells(typeset: &str) -> Vec<Vec<String>> {
    let rows = typeset.split("<tr>").skip(1);
    rows.map(|row| row.split("<td").skip(1).map(|cell| words(&shown(&format!("<div{cell}"))).join(" ")).collect())
        .collect()
}

#[test]
fn values_and_conditions_stand_in_columns() {
    let torque = cells(&typeset(&equations("torque_sum")));
    assert_eq!(torque, [["torque", "", "spring damping", "when contact"], ["", "", "0", "otherwise"]]);
    // A condition without a value is in the column of the conditions; words between equations take the whole line.
    let run = "  tool > 0:\n    x := 1";
    assert!(typeset(run).starts_with("```text"), "a run that begins with words");
    let run = "  mode := a    in\n               out\n  else:";
    assert_eq!(cells(&typeset(run)), [vec!["mode", "", "a", "in"], vec!["", "", "", "out"], vec!["else"]]);
}

#[test]
fn powers_indices_roots_and_brackets_are_mathml() {
    let of = |line: &str| typeset(&format!("  r := {line}"));
    let holds = |line: &str, part: &str| assert!(of(line).contains(part), "{part} in {}", of(line));
    holds("2^N", "<msup><mn>2</mn>");
    holds("2^(N-1) x", "<msup><mn>2</mn><mrow><mi>N</mi>");
    holds("1 + 2^-2i", "<mn>2</mn><mi>i</mi></mrow></msup>");
    holds("B0 x(k)", "<msub><mi>B</mi>");
    holds("sqrt(a + b)", "<msqrt>");
    holds("floor(a / 2)", "\u{230a}</mo><mi>a</mi><mo>/</mo><mn>2</mn>");
    holds("SCALE_FRAC", "<mtext>SCALE_FRAC</mtext>");
    holds("a /= b", "<mo>\u{2260}</mo>");
}

#[test]
fn a_run_that_is_not_all_equations_stays_text() {
    let run = "  a := b\n  c -> d";
    assert_eq!(typeset(run), "```text\na := b\nc -> d\n```\n");
    // Parentheses and bars that do not close, no relation, a number in front.
    for line in ["a := (b", "a := b)", "a := |b", "a b", "1. a := b"] {
        assert_eq!(typeset(&format!("  {line}")), format!("```text\n{line}\n```\n"));
    }
}

#[test]
fn plain_text_is_kept_for_screen_readers() {
    let math = typeset("At an edge:  q := a < b");
    let begin = "At an edge:\n\n<div class=\"equations\"><table role=\"math\" aria-label=\"q := a &lt; b\">";
    assert!(math.starts_with(begin), "{math}");
    assert!(typeset("  a  := b\n  cd := e").contains(" aria-label=\"a  := b&#10;cd := e\""));
}

/// Returns MathML and Markdown as the text that they show, in the notation of the headers.
fn shown(typeset: &str) -> String {
    let mut text = String::new();
    for line in typeset.lines().filter(|line| !line.starts_with("```")) {
        if line.starts_with("<div") {
            // Numbers and names in neighbouring elements are apart.
            let spaced = line.replace("<msqrt>", "sqrt<msqrt>");
            text.extend(
                spaced.split('<').map(|tag| format!(" {}", tag.split_once('>').map_or(tag, |(_, after)| after))),
            );
        } else {
            text += line;
        }
        text.push('\n');
    }
    let signs = [
        ("≔", ":="),
        ("⌊", " floor "),
        ("⌈", " ceil "),
        ("π", "pi"),
        ("∏", "prod"),
        ("−", "-"),
        ("⋅", "*"),
        ("≤", "<="),
        ("≥", ">="),
        ("≠", "/="),
        ("…", ".."),
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("\\", ""),
    ];
    signs.iter().fold(text, |text, (from, to)| text.replace(from, to))
}

/// Returns runs of letters and runs of digits, in order.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![];
    let mut last = None;
    for letter in text.chars() {
        let kind = (letter.is_ascii_alphabetic(), letter.is_ascii_digit());
        match words.last_mut() {
            Some(word) if last == Some(kind) => word.push(letter),
            _ if kind != (false, false) => words.push(letter.to_string()),
            _ => {}
        }
        last = (kind != (false, false)).then_some(kind);
    }
    words
}

#[test]
fn nothing_of_a_header_is_lost() {
    let mut seen = 0;
    for name in blocks() {
        let plain = equations(name);
        let typeset = typeset(&plain);
        let shown = shown(&typeset);
        // Each name and number, in the order of the header.
        assert_eq!(words(&shown), words(&plain), "{name}");
        // Each sign; fractions and exponents have none of their own.
        let count = |text: &str, sign: &str| text.matches(sign).count();
        let elements = |sign: &str| match sign {
            "^" => count(&typeset, "<msup>"),
            _ => 0,
        };
        for sign in ["+", "-", "*", "/", "^", "=", "<", ">", ",", ";", ":", "|"] {
            assert_eq!(count(&shown, sign) + elements(sign), count(&plain, sign), "{sign} of {name}");
        }
        seen += count(&typeset, "<table ");
    }
    assert!(seen > 60, "{seen} runs are typeset");
}

#[test]
fn mathml_is_well_formed_and_no_markdown() {
    for name in blocks() {
        let typeset = typeset(&equations(name));
        for line in typeset.lines().filter(|line| line.starts_with("<div")) {
            let mut open = vec![];
            let mut rest = line;
            while let Some((text, tag)) = rest.split_once('<') {
                assert!(!text.contains('>'), "{name}: {text}");
                let is_entity =
                    |after: &str| ["lt;", "gt;", "amp;", "quot;"].iter().any(|entity| after.starts_with(entity));
                assert!(text.split('&').skip(1).all(is_entity), "{name}: {text}");
                let (tag, after) = tag.split_once('>').expect("an end of the tag");
                match tag.strip_prefix('/') {
                    Some(end) => assert_eq!(open.pop(), Some(end), "{name}"),
                    None if tag.ends_with('/') => {}
                    None => {
                        assert_eq!(tag.matches('"').count() % 2, 0, "{name}: {tag}");
                        open.push(tag.split(' ').next().expect("a name"));
                    }
                }
                rest = after;
            }
            assert!(open.is_empty() && rest.is_empty(), "{name}: {open:?} {rest}");
        }
    }
}

/// Runs that stay text: the block, the begin of the run, and the reason.
const TEXT: [(&str, &str, &str); 38] = [
    ("axis_front", "a_pin, b_pin -> sync", "a drawing"),
    ("butterworth_difference", "position -+-> hold", "a drawing"),
    ("conventional_loop", "pins -> sync", "a drawing"),
    ("edge_timer", "d /= 0   a change", "cases in prose"),
    ("braking_pulse_loop", "pins -> front", "a drawing"),
    ("epfl_paddle_loop", "pins -> sync", "a drawing"),
    ("energy_bounding_loop", "pins -> front", "a drawing"),
    ("passive_spring_loop", "pins -> front", "a drawing"),
    ("passivity_controller_loop", "pins -> front", "a drawing"),
    ("sampled_wall_loop", "pins -> front", "a drawing"),
    ("position_pid_loop", "pins -> front", "a drawing"),
    ("torque_table_loop", "pins -> front", "a drawing"),
    ("virtual_coupling_loop", "pins -> front", "a drawing"),
    ("foc_knob_loop", "pins -> sync", "a drawing"),
    ("foc_knob_loop", "position -> from_zero", "a drawing"),
    ("foc_loop", "pins -> sync", "a drawing"),
    ("gimbal_loop", "timer -> sample -> inverse", "a drawing"),
    ("gimbal_shear_loop", "timer -> sample -> shear", "a drawing"),
    ("hybrid_loop", "pins -> sync", "a drawing"),
    ("input_shaper", "torque -+-> hold", "a drawing"),
    ("phantom_engine", "a, b := operands of the step   ->", "a drawing of the pipeline"),
    ("phantom_engine", "1  L1*cosine2       7  stiffness", "a table of the products"),
    ("phantom_io", "pins -> sync", "a drawing"),
    ("phantom_loop", "pins -> sync", "a drawing"),
    ("phantom_shared_loop", "pins -> sync", "a drawing"),
    ("pid", "not BACK_CALCULATION", "a table of the two ways"),
    ("pwm", "1. held := command", "a numbered list with a table"),
    ("quadrature_decoder", "(a b)  00 -> 01", "a table of the transitions"),
    ("sampled_wall", "contact, penetration -> hold", "a drawing"),
    ("sampled_wall", "ESTIMATOR 0  velocity_register", "a table of the estimators"),
    ("spi_master", "0 clocks", "a table of times"),
    ("ssi_master", "0 clocks", "a table of times"),
    ("three_phase_pwm", "1. at phase 0", "a numbered list with a table"),
    ("timer_pwm", "B high, A low", "a table of the gates"),
    ("trig_interpolated", "quarter(q): g = f when q is even", "a list of steps"),
    ("trig_quarter", "wave(a), with q the upper 2 bits", "a table of the quarters"),
    ("truncating_multiplier", "full product      OUT_WIDTH", "a table of the uses"),
    ("window_sum", "sum := c(k)", "a sum with its middle left out"),
];

#[test]
fn runs_that_stay_text_are_drawings_tables_and_lists() {
    let mut found = vec![];
    for name in blocks() {
        let typeset = typeset(&equations(name));
        let runs = typeset.split("```text\n").skip(1).map(|run| run.lines().next().expect("a line").to_string());
        found.extend(runs.map(|run| (name, run)));
    }
    assert_eq!(found.len(), TEXT.len(), "{found:#?}");
    for (name, run) in found {
        assert!(TEXT.iter().any(|(block, begin, _)| *block == name && run.starts_with(begin)), "{name}: {run}");
    }
}
