//! The equations of the headers, typeset: known ones as written by hand, and of each block no word, number or sign is
//! lost.

use hpu_book::equation::typeset;
use hpu_rtl::Hdl;

/// Blanks that do not break, and the signs that are not seen: a product, and a function of what follows.
const BLANK: char = '\u{a0}';
const TIMES: char = '\u{2062}';
const OF: char = '\u{2061}';

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

/// Returns what is between two texts.
fn between<'t>(text: &'t str, begin: &str, end: &str) -> &'t str {
    let (_, rest) = text.split_once(begin).expect(begin);
    rest.split_once(end).expect(end).0
}

/// Returns the rows of a table of equations.
fn rows(equations: &str) -> String {
    let math = typeset(equations);
    let end = "</mtable></math></div>\n";
    between(&math, "columnalign=\"left center left left\">", end).to_string()
}

/// Returns the right side of an equation without a condition.
fn right(expression: &str) -> String {
    let row = rows(&format!("  r := {expression}"));
    between(&row, "<mo>:=</mo></mtd><mtd columnspan=\"2\">", "</mtd></mtr>").to_string()
}

#[test]
fn cases_stand_behind_a_brace() {
    let sum = "<mi>spring</mi><mo>+</mo><mi>damping</mi>";
    let when = format!("<mtext>when{BLANK}contact</mtext>");
    let space = "<mspace width=\"1em\"></mspace>";
    let cases = format!(
        "<mtr><mtd>{sum}</mtd><mtd>{space}{when}</mtd></mtr>\
         <mtr><mtd><mn>0</mn></mtd><mtd>{space}<mtext>otherwise</mtext></mtd></mtr>"
    );
    let row = format!(
        "<mtr><mtd><mi>torque</mi></mtd><mtd><mo>=</mo></mtd><mtd columnspan=\"2\"><mrow><mo>{{</mo>\
         <mtable displaystyle=\"true\" columnalign=\"left left\">{cases}</mtable></mrow></mtd></mtr>"
    );
    assert_eq!(rows(&equations("torque_sum")), row);
}

#[test]
fn a_quotient_of_factors_is_a_fraction() {
    // velocity_register: the floor of a fraction, whose numerator is a product.
    let power = "<msup><mn>2</mn><mrow><mi>SCALE_FRAC</mi></mrow></msup>";
    let fraction = format!("<mfrac><mrow><mi>d</mi><mo>⋅</mo><mi>scale</mi></mrow><mrow>{power}</mrow></mfrac>");
    let floor = format!("<mrow><mo>⌊</mo>{fraction}<mo>⌋</mo></mrow>");
    assert_eq!(right("floor(d * scale / 2^SCALE_FRAC)"), floor);
    assert!(typeset(&equations("velocity_register")).contains(&floor));
    // A sign without blanks binds closer: two fractions, not one in the other.
    let half = "<mfrac><mrow><mi>π</mi></mrow><mrow><mn>2</mn></mrow></mfrac>";
    let part = "<mfrac><mrow><mi>i</mi></mrow><mrow><msup><mn>2</mn><mrow><mi>Q</mi></mrow></msup></mrow></mfrac>";
    assert_eq!(right("pi/2 * i/2^Q"), format!("{half}<mo>⋅</mo>{part}"));
    // The bar of a fraction makes parentheses superfluous.
    let sum = "<mi>a</mi><mo>+</mo><mi>b</mi>";
    assert_eq!(right("(a + b) / c"), format!("<mfrac><mrow>{sum}</mrow><mrow><mi>c</mi></mrow></mfrac>"));
    // A sum before it is no part of it.
    let fraction = "<mfrac><mrow><mi>b</mi></mrow><mrow><mi>c</mi></mrow></mfrac>";
    assert_eq!(right("a + b / c"), format!("<mi>a</mi><mo>+</mo>{fraction}"));
}

#[test]
fn bars_are_an_absolute_value() {
    let e = |of: &str| format!("<mrow><mi>e</mi><mo>{OF}</mo><mrow><mo>(</mo><mi>{of}</mi><mo>)</mo></mrow></mrow>");
    let difference = format!("<mi>m</mi><mo>⋅</mo>{}<mo>−</mo><mi>j</mi><mo>⋅</mo>{}", e("j"), e("m"));
    let bars = format!("<mrow><mo>|</mo>{difference}<mo>|</mo></mrow>");
    let bound = "<mo>≤</mo><mi>m</mi><mo>⋅</mo><mi>NOISE</mi>";
    assert_eq!(right("|m*e(j) - j*e(m)| <= m*NOISE"), format!("{bars}{bound}"));
    assert!(typeset(&equations("foaw")).contains(&format!("{bars}{bound}")));
}

#[test]
fn signs_words_and_indices_are_typeset() {
    // Roots, exponents with a sign, the product over all factors.
    let exponent = format!("<mo form=\"prefix\">−</mo><mn>2</mn><mo>{TIMES}</mo><mi>i</mi>");
    let root = format!("<msqrt><mn>1</mn><mo>+</mo><msup><mn>2</mn><mrow>{exponent}</mrow></msup></msqrt>");
    let product = format!("<mo>∏</mo><mfrac><mrow><mn>1</mn></mrow><mrow>{root}</mrow></mfrac>");
    assert_eq!(right("prod 1/sqrt(1 + 2^-2i)"), product);
    // Names of letters beside each other, indices, primes.
    let sample = format!("<mrow><mi>x</mi><mo>{OF}</mo><mrow><mo>(</mo><mi>k</mi><mo>)</mo></mrow></mrow>");
    assert_eq!(right("B0 x(k)"), format!("<msub><mi>B</mi><mn>0</mn></msub><mo>{TIMES}</mo>{sample}"));
    assert_eq!(right("count_i"), "<msub><mi>count</mi><mi>i</mi></msub>");
    assert_eq!(right("brake'"), "<msup><mi>brake</mi><mo>′</mo></msup>");
    assert_eq!(right("finger_force"), "<mi>finger_force</mi>");
    // Signs in front of their operand are no operators between two.
    let comma = "<mo lspace=\"0\" rspace=\"0.3em\">,</mo>";
    assert_eq!(
        right("-x, +y"),
        format!("<mo form=\"prefix\">−</mo><mi>x</mi>{comma}<mo form=\"prefix\">+</mo><mi>y</mi>")
    );
    // Words of prose keep their blanks.
    let rest = format!("<mtext>{BLANK}a{BLANK}turn</mtext>");
    assert_eq!(right("2^N a turn"), format!("<msup><mn>2</mn><mrow><mi>N</mi></mrow></msup>{rest}"));
    let modulo = "<mo lspace=\"0.3em\" rspace=\"0.3em\">mod</mo>";
    assert_eq!(right("x mod 4"), format!("<mi>x</mi>{modulo}<mn>4</mn>"));
}

#[test]
fn a_run_that_is_not_all_equations_stays_text() {
    let run = "  a := b\n  c -> d";
    assert_eq!(typeset(run), "```text\na := b\nc -> d\n```\n");
    // Parentheses that do not close, a sign without an operand.
    for line in ["a := (b", "a := b)", "a := |b", "a := b *", "a := ^2", "a b", "1. a := b"] {
        assert_eq!(typeset(&format!("  {line}")), format!("```text\n{line}\n```\n"));
    }
}

#[test]
fn plain_text_is_kept_for_screen_readers() {
    let math = typeset("At an edge:  q := a < b");
    let begin = "At an edge:\n\n<div class=\"equations\"><math display=\"block\" alttext=\"q := a &lt; b\">";
    assert!(math.starts_with(begin), "{math}");
    assert!(typeset("  a  := b\n  cd := e").contains(" alttext=\"a  := b&#10;cd := e\""));
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
            "/" => count(&typeset, "<mfrac>"),
            "^" => count(&typeset, "<msup>") - count(&typeset, "<mo>′</mo>"),
            _ => 0,
        };
        for sign in ["+", "-", "*", "/", "^", "=", "<", ">", ",", ";", ":", "|"] {
            assert_eq!(count(&shown, sign) + elements(sign), count(&plain, sign), "{sign} of {name}");
        }
        seen += count(&typeset, "<math ");
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
                let is_entity = |after: &str| ["lt;", "gt;", "amp;"].iter().any(|entity| after.starts_with(entity));
                assert!(text.split('&').skip(1).all(is_entity), "{name}: {text}");
                let (tag, after) = tag.split_once('>').expect("an end of the tag");
                match tag.strip_prefix('/') {
                    Some(end) => assert_eq!(open.pop(), Some(end), "{name}"),
                    None => {
                        assert_eq!(tag.matches('"').count() % 2, 0, "{name}: {tag}");
                        open.push(tag.split(' ').next().expect("a name"));
                    }
                }
                rest = after;
            }
            assert!(open.is_empty() && rest.is_empty(), "{name}: {open:?} {rest}");
            // Fractions, exponents and indices have two parts.
            for pair in ["mfrac", "msup", "msub"] {
                assert_eq!(parts(line, pair).into_iter().find(|parts| *parts != 2), None, "{pair} of {name}");
            }
        }
    }
}

/// Returns the number of elements directly in each element of a name.
fn parts(math: &str, name: &str) -> Vec<usize> {
    let mut numbers = vec![];
    let mut open: Vec<(&str, usize)> = vec![];
    for tag in math.split('<').skip(1).map(|tag| tag.split('>').next().expect("a tag")) {
        if tag.starts_with('/') {
            let (ended, parts) = open.pop().expect("an open element");
            if ended == name {
                numbers.push(parts);
            }
        } else {
            if let Some((_, parts)) = open.last_mut() {
                *parts += 1;
            }
            open.push((tag.split(' ').next().expect("a name"), 0));
        }
    }
    numbers
}

/// Runs that stay text: the block, the begin of the run, and the reason.
const TEXT: [(&str, &str, &str); 25] = [
    ("axis_front", "a_pin, b_pin -> sync", "a drawing"),
    ("conventional_loop", "pins -> sync", "a drawing"),
    ("edge_timer", "d /= 0   a change", "cases in prose"),
    ("braking_pulse_loop", "pins -> front", "a drawing"),
    ("energy_bounding_loop", "pins -> front", "a drawing"),
    ("passive_spring_loop", "pins -> front", "a drawing"),
    ("passivity_controller_loop", "pins -> front", "a drawing"),
    ("sampled_wall_loop", "pins -> front", "a drawing"),
    ("virtual_coupling_loop", "pins -> front", "a drawing"),
    ("gimbal_loop", "timer -> sample -> inverse", "a drawing"),
    ("gimbal_shear_loop", "timer -> sample -> shear", "a drawing"),
    ("hybrid_loop", "pins -> sync", "a drawing"),
    ("input_shaper", "torque -+-> hold", "a drawing"),
    ("phantom_engine", "a, b := operands of the step   ->", "a drawing of the pipeline"),
    ("phantom_engine", "1  L1*cosine2       7  stiffness", "a table of the products"),
    ("phantom_io", "pins -> sync", "a drawing"),
    ("phantom_loop", "pins -> sync", "a drawing"),
    ("phantom_shared_loop", "pins -> sync", "a drawing"),
    ("pwm", "1. held := command", "a numbered list with a table"),
    ("quadrature_decoder", "(a b)  00 -> 01", "a table of the transitions"),
    ("sampled_wall", "contact, penetration -> hold", "a drawing"),
    ("sampled_wall", "ESTIMATOR 0  velocity_register", "a table of the estimators"),
    ("trig_interpolated", "quarter(q): g = f when q is even", "a list of steps"),
    ("trig_quarter", "wave(a), with q the upper 2 bits", "a table of the quarters"),
    ("truncating_multiplier", "full product      OUT_WIDTH", "a table of the uses"),
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
