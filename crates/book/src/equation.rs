//! The equations of a VHDL header, typeset as MathML, which browsers show without a script.
//!
//! A header holds prose, which begins in the first column, and runs of indented lines. A run is typeset when it begins
//! with an equation and each further line can be read: as an equation, as a case or a condition of the equation above
//! it, or as words between equations. Any other run (a drawing, a table, a list) stays text.

use crate::header::{cell, unindented};

/// Returns the equations of a header as Markdown: prose as paragraphs, runs of equations as MathML, other runs as text
/// blocks.
///
/// MathML keeps each line as it is written in `alttext`, for screen readers.
pub fn typeset(equations: &str) -> String {
    // A line of prose may end in an equation: `At a sample edge:  q := d`.
    let spread = equations.lines().map(|line| match line.split_once(":  ") {
        Some((prose, equation)) if !line.starts_with(' ') => format!("{prose}:\n  {equation}"),
        _ => line.to_string(),
    });
    let spread = spread.collect::<Vec<_>>().join("\n");
    let lines: Vec<&str> = spread.lines().collect();
    // A table may begin in the first column.
    let is_run = |line: &str| line.starts_with(' ') || line.contains("  ");
    let is_one = |line: &&str, next: &&str| !line.is_empty() && !next.is_empty() && is_run(line) == is_run(next);
    let parts = lines.chunk_by(is_one).filter(|part| !part[0].is_empty());
    let parts = parts.map(|part| match (is_run(part[0]), table(part)) {
        (false, _) => format!("{}\n", cell(&part.join(" "))),
        (true, Some(table)) => table,
        (true, None) => format!("```text\n{}\n```\n", unindented(&part.join("\n"))),
    });
    parts.collect::<Vec<_>>().join("\n")
}

/// The kind of a token.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Word,
    Number,
    Prime,
    Open,
    Close,
    Bar,
    Sign,
}

/// A token of a line.
#[derive(Clone, Copy)]
struct Token<'t> {
    kind: Kind,
    text: &'t str,
    /// Blanks before it.
    blanks: usize,
    /// Column of the line in which it begins.
    column: usize,
}

impl Token<'_> {
    fn is(&self, sign: &str) -> bool {
        self.kind == Kind::Sign && self.text == sign
    }

    /// Returns whether it is a word that stands between operands as an operator does.
    fn joins(&self) -> bool {
        self.kind == Kind::Word && ["and", "or", "not", "mod"].contains(&self.text)
    }

    /// Returns whether it can be the end of an operand.
    fn ends_operand(&self) -> bool {
        !self.joins() && self.kind != Kind::Sign && self.kind != Kind::Open
    }

    /// Returns whether it can be the begin of an operand.
    fn begins_operand(&self) -> bool {
        !self.joins() && matches!(self.kind, Kind::Word | Kind::Number | Kind::Open | Kind::Bar)
    }
}

/// Signs, longer ones before those that they begin with.
const SIGNS: [&str; 17] = [":=", "<=", ">=", "/=", "..", "+", "-", "*", "/", "^", "=", "<", ">", ",", ";", ":", "."];

/// Blanks that part the columns of a line.
const GAP: usize = 2;

/// Returns the tokens of a line; `None` when it holds a sign of no equation, such as an arrow.
fn tokens(line: &str) -> Option<Vec<Token<'_>>> {
    let mut tokens: Vec<Token> = Vec::new();
    let mut rest = line;
    loop {
        let trimmed = rest.trim_start_matches(' ');
        let blanks = rest.len() - trimmed.len();
        let Some(first) = trimmed.chars().next() else { return Some(tokens) };
        let column = line.len() - trimmed.len();
        let span = |is_part: fn(char) -> bool| trimmed.find(|letter| !is_part(letter)).unwrap_or(trimmed.len());
        let (kind, length) = match first {
            'a'..='z' | 'A'..='Z' => {
                let name = span(|letter| letter.is_ascii_alphanumeric() || letter == '_');
                // `two's` is a word, `brake'` a name with a prime.
                let genitive =
                    trimmed[name..].strip_prefix("'s").filter(|after| after.is_empty() || after.starts_with(' '));
                (Kind::Word, if genitive.is_some() { name + 2 } else { name })
            }
            '0'..='9' => (Kind::Number, span(|letter| letter.is_ascii_digit())),
            '\'' => (Kind::Prime, 1),
            '(' => (Kind::Open, 1),
            ')' => (Kind::Close, 1),
            '|' => (Kind::Bar, 1),
            _ => (Kind::Sign, SIGNS.into_iter().find(|sign| trimmed.starts_with(sign))?.len()),
        };
        let (text, after) = trimmed.split_at(length);
        let is_stop = text == ".";
        if (text == "-" && after.starts_with('>')) || (is_stop && !after.is_empty()) {
            return None;
        }
        tokens.push(Token { kind, text, blanks, column });
        rest = after;
    }
}

/// Returns text as it stands between tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Returns a name: an index behind an underscore or a number at its end as a subscript, pi as the letter.
fn name(word: &str) -> String {
    let base = word.trim_end_matches(|letter: char| letter.is_ascii_digit());
    let (base, index) = match word.rsplit_once('_') {
        Some((base, index)) if base.len() == 1 || index.len() == 1 => (base, index),
        None if base.len() < word.len() && word != "atan2" => word.split_at(base.len()),
        _ => (word, ""),
    };
    let letters = if base == "pi" { "π" } else { base };
    match index {
        "" => format!("<mi>{letters}</mi>"),
        number if number.starts_with(|first: char| first.is_ascii_digit()) => {
            format!("<msub><mi>{letters}</mi><mn>{number}</mn></msub>")
        }
        index => format!("<msub><mi>{letters}</mi><mi>{index}</mi></msub>"),
    }
}

/// An operand.
struct Operand {
    /// Its MathML, one element or more.
    math: String,
    /// Its MathML without the parentheses around it, where it has some.
    inner: Option<String>,
}

impl Operand {
    fn new(math: String) -> Self {
        Self { math, inner: None }
    }

    /// Returns it as one element, without parentheses where its place shows its extent.
    fn row(self) -> String {
        format!("<mrow>{}</mrow>", self.inner.unwrap_or(self.math))
    }

    /// Multiplies it: by a dot where the source has a sign, else without one.
    fn times(self, sign: &str, factor: &Self) -> Self {
        Self::new(format!("{}<mo>{sign}</mo>{}", self.math, factor.math))
    }

    fn over(self, divisor: Self) -> Self {
        Self::new(format!("<mfrac>{}{}</mfrac>", self.row(), divisor.row()))
    }
}

const DOT: &str = "⋅";
const IMPLIED: &str = "\u{2062}";

/// Reads the tokens of an expression.
struct Reader<'t> {
    tokens: &'t [Token<'t>],
    at: usize,
    /// Whether a bar ends an absolute value.
    in_bars: bool,
}

impl<'t> Reader<'t> {
    fn peek(&self) -> Option<&'t Token<'t>> {
        self.tokens.get(self.at)
    }

    /// Takes the next token if it is close to the one before it and satisfies a condition.
    fn next_tight(&mut self, is_wanted: impl Fn(&Token) -> bool) -> Option<&'t Token<'t>> {
        let token = self.peek().filter(|token| token.blanks == 0 && is_wanted(token))?;
        self.at += 1;
        Some(token)
    }

    /// Returns whether a token has no blank before the token behind it.
    fn is_prefix(&self, at: usize) -> bool {
        self.tokens.get(at + 1).is_some_and(|next| next.blanks == 0)
    }

    /// Returns whether a token is a word of prose: in lower case, and beside another word or an operand without a sign
    /// between them. Names of one letter are none, but for the article.
    fn is_prose(&self, at: usize) -> bool {
        let lower = |token: &Token| {
            token.kind == Kind::Word
                && !token.joins()
                && token.text.bytes().all(|letter| letter.is_ascii_lowercase() || letter == b'\'')
        };
        let Some(token) = self.tokens.get(at).filter(|token| lower(token)) else { return false };
        let next = self.tokens.get(at + 1);
        let is_call = |next: &Token| next.blanks == 0 && matches!(next.kind, Kind::Open | Kind::Prime);
        let is_product = |next: &Token| token.text == "prod" && next.kind == Kind::Number;
        if next.is_some_and(|next| is_call(next) || is_product(next)) {
            return false;
        }
        if token.text.len() == 1 {
            return token.text == "a" && next.is_some_and(|next| lower(next) && next.text.len() > 1);
        }
        let before = at.checked_sub(1).map(|at| &self.tokens[at]);
        ["else", "otherwise", "when", "where", "with"].contains(&token.text)
            || next.is_some_and(Token::begins_operand)
            || before.is_some_and(|before| token.blanks > 0 && before.ends_operand())
    }

    /// Returns MathML up to a closing parenthesis, a closing bar or the end.
    fn sequence(&mut self) -> Option<String> {
        let mut math = String::new();
        let mut is_operand = false;
        while let Some(token) = self.peek() {
            if token.kind == Kind::Close || (token.kind == Kind::Bar && self.in_bars) {
                break;
            }
            if self.is_prose(self.at) {
                math += &self.prose(!math.is_empty());
                is_operand = true;
            } else if token.kind == Kind::Sign || token.joins() {
                let is_unary = !is_operand || (token.blanks > 0 && self.is_prefix(self.at));
                math += &match token.text {
                    separator @ ("," | ";" | ":") => {
                        // Prose brings its own space.
                        let space = if self.is_prose(self.at + 1) { "0" } else { "0.3em" };
                        format!("<mo lspace=\"0\" rspace=\"{space}\">{separator}</mo>")
                    }
                    other => sign(other, is_unary)?,
                };
                is_operand = token.is("..");
                self.at += 1;
            } else {
                math += &self.product()?.math;
                is_operand = true;
            }
        }
        Some(math)
    }

    /// Returns words of prose, with spaces to the operands beside them.
    fn prose(&mut self, is_inside: bool) -> String {
        let mut words = vec![];
        let begin = self.at;
        while self.is_prose(self.at) {
            words.push(self.tokens[self.at].text);
            self.at += 1;
        }
        let is_close = |before: &Token| before.ends_operand() || [",", ";", ":"].contains(&before.text);
        let before = if is_inside && is_close(&self.tokens[begin - 1]) { "\u{a0}" } else { "" };
        let is_apart = |next: &Token| {
            next.begins_operand() || (["+", "-"].contains(&next.text) && next.blanks > 0 && self.is_prefix(self.at))
        };
        let after = if self.peek().is_some_and(is_apart) { "\u{a0}" } else { "" };
        format!("<mtext>{before}{}{after}</mtext>", words.join("\u{a0}"))
    }

    /// Returns a product. A sign with blanks around it has all before it as its left operand, a sign without blanks
    /// only the factors that are as close: `pi/2 * i/2^N` is a product of two fractions, `a * b / 2^N` a fraction.
    fn product(&mut self) -> Option<Operand> {
        let mut whole = self.close_product()?;
        while let Some(token) = self.peek() {
            if token.is("*") || token.is("/") {
                self.at += 1;
                let factor = self.close_product()?;
                whole = if token.is("*") { whole.times(DOT, &factor) } else { whole.over(factor) };
            } else if token.begins_operand() && !self.is_prose(self.at) && !(token.kind == Kind::Bar && self.in_bars) {
                whole = whole.times(IMPLIED, &self.close_product()?);
            } else {
                break;
            }
        }
        Some(whole)
    }

    /// Returns a product without blanks.
    fn close_product(&mut self) -> Option<Operand> {
        if self.peek()?.text == "prod" {
            self.at += 1;
            return Some(Operand::new(format!("<mo>∏</mo>{}", self.close_product()?.math)));
        }
        let mut whole = self.factor()?;
        loop {
            if self.next_tight(|token| token.is("*")).is_some() {
                whole = whole.times(DOT, &self.factor()?);
            } else if self.next_tight(|token| token.is("/")).is_some() {
                whole = whole.over(self.factor()?);
            } else if self.peek().is_some_and(|next| next.blanks == 0 && matches!(next.kind, Kind::Word)) {
                whole = whole.times(IMPLIED, &self.factor()?);
            } else {
                return Some(whole);
            }
        }
    }

    /// Returns a factor with its prime and its exponent.
    fn factor(&mut self) -> Option<Operand> {
        let mut base = self.primary()?;
        if self.next_tight(|token| token.kind == Kind::Prime).is_some() {
            base = Operand::new(format!("<msup>{}<mo>′</mo></msup>", base.math));
        }
        if self.next_tight(|token| token.is("^")).is_none() {
            return Some(base);
        }
        let minus = match self.next_tight(|token| token.is("-")) {
            Some(minus) => sign(minus.text, true)?,
            None => String::new(),
        };
        let mut exponent = self.primary()?;
        if self.peek().is_some_and(|next| next.blanks == 0 && next.kind == Kind::Word) {
            exponent = exponent.times(IMPLIED, &self.primary()?);
        }
        let exponent = exponent.inner.unwrap_or(exponent.math);
        Some(Operand::new(format!("<msup>{}<mrow>{minus}{exponent}</mrow></msup>", base.math)))
    }

    /// Returns a number, a name, a call, or what stands in parentheses or bars: one element.
    fn primary(&mut self) -> Option<Operand> {
        let token = self.peek()?;
        self.at += 1;
        match token.kind {
            Kind::Number => Some(Operand::new(format!("<mn>{}</mn>", token.text))),
            Kind::Bar if !self.in_bars => {
                self.in_bars = true;
                let inner = self.sequence()?;
                self.in_bars = false;
                self.next_if(Kind::Bar)?;
                Some(Operand::new(fenced('|', &inner, '|')))
            }
            Kind::Open => self.parentheses(),
            Kind::Word if self.next_tight(|next| next.kind == Kind::Open).is_some() => {
                let Operand { math, inner } = self.parentheses()?;
                let inner = inner.unwrap_or_default();
                Some(Operand::new(match token.text {
                    "floor" => fenced('⌊', &inner, '⌋'),
                    "ceil" => fenced('⌈', &inner, '⌉'),
                    "sqrt" => format!("<msqrt>{inner}</msqrt>"),
                    function => format!("<mrow>{}<mo>\u{2061}</mo>{math}</mrow>", name(function)),
                }))
            }
            Kind::Word => Some(Operand::new(name(token.text))),
            _ => None,
        }
    }

    fn next_if(&mut self, kind: Kind) -> Option<()> {
        self.peek().filter(|token| token.kind == kind)?;
        self.at += 1;
        Some(())
    }

    /// Returns what follows an opening parenthesis, with both parentheses.
    fn parentheses(&mut self) -> Option<Operand> {
        let inner = self.sequence()?;
        self.next_if(Kind::Close)?;
        Some(Operand { math: fenced('(', &inner, ')'), inner: Some(inner) })
    }
}

fn fenced(open: char, inner: &str, close: char) -> String {
    format!("<mrow><mo>{open}</mo>{inner}<mo>{close}</mo></mrow>")
}

/// Returns a sign, or a word that joins operands; `None` for a sign without its operand.
fn sign(text: &str, is_unary: bool) -> Option<String> {
    let shown = match text {
        "not" if is_unary => return Some("<mo form=\"prefix\" lspace=\"0\" rspace=\"0.3em\">not</mo>".to_string()),
        "and" | "or" | "not" | "mod" => return Some(format!("<mo lspace=\"0.3em\" rspace=\"0.3em\">{text}</mo>")),
        ".." => return Some("<mo lspace=\"0.3em\" rspace=\"0.3em\">…</mo>".to_string()),
        "." => return Some("<mo lspace=\"0\" rspace=\"0\">.</mo>".to_string()),
        "*" | "/" | "^" => return None,
        "-" => "−",
        "<=" => "≤",
        ">=" => "≥",
        "/=" => "≠",
        other => other,
    };
    let form = if is_unary && ["+", "-"].contains(&text) { " form=\"prefix\"" } else { "" };
    Some(format!("<mo{form}>{}</mo>", escaped(shown)))
}

/// Returns the MathML of an expression, a condition or a heading.
fn expression(tokens: &[Token]) -> Option<String> {
    let mut reader = Reader { tokens, at: 0, in_bars: false };
    let math = reader.sequence()?;
    (reader.at == tokens.len()).then_some(math)
}

/// Returns the columns of a line, which gaps part. A gap beside an operator, or behind a comma, only aligns.
fn columns<'t>(tokens: &'t [Token<'t>]) -> Vec<&'t [Token<'t>]> {
    let mut columns = vec![];
    let (mut begin, mut depth) = (0, 0);
    for (at, token) in tokens.iter().enumerate() {
        let is_prefix = ["+", "-"].contains(&token.text) && tokens.get(at + 1).is_some_and(|next| next.blanks == 0);
        let is_parted = at > begin && token.blanks >= GAP && depth == 0 && (token.kind != Kind::Sign || is_prefix);
        if is_parted && (tokens[at - 1].kind != Kind::Sign || tokens[at - 1].is(";")) {
            columns.push(&tokens[begin..at]);
            begin = at;
        }
        match token.kind {
            Kind::Open => depth += 1,
            Kind::Close => depth -= 1,
            _ => {}
        }
    }
    columns.push(&tokens[begin..]);
    columns
}

/// A space between columns of a line.
const SPACE: &str = "<mspace width=\"1em\"></mspace>";

/// A row of the right side of an equation.
struct Row {
    /// An expression, or the rest of the one above.
    value: String,
    /// The condition or the remark behind it, and further equations of the line.
    note: String,
}

/// A part of a run.
enum Line {
    Equation(Equation),
    /// Words between equations, and their column: `else:`.
    Words(String, usize),
}

/// An equation with its cases.
struct Equation {
    /// Columns in which it and its right side begin.
    begin: usize,
    right: usize,
    name: String,
    relation: String,
    rows: Vec<Row>,
    is_cases: bool,
}

impl Equation {
    /// Reads a line; `None` when it does not define names.
    fn read(tokens: &[Token]) -> Option<Self> {
        let is_relation = |token: &Token| [":=", "=", "<=", ">=", "/=", "<", ">"].iter().any(|sign| token.is(sign));
        let at = tokens.iter().position(is_relation)?;
        let (left, [relation, right @ ..]) = tokens.split_at(at) else { return None };
        let is_name = |(at, token): (usize, &Token)| match token.kind {
            Kind::Sign => token.is(",") || (token.blanks == 0 && (token.is("^") || token.is("-"))),
            _ if at == 0 => true,
            // Only what is assigned may have a name of two words.
            Kind::Word => token.blanks == 0 || left[at - 1].is(",") || (token.blanks < GAP && relation.is(":=")),
            _ => token.blanks == 0,
        };
        let is_defined = [":=", "=", "<="].contains(&relation.text) && left.iter().enumerate().all(is_name);
        // `q = 0:  T(i)` is a row of a table.
        let is_table = right.windows(2).any(|pair| pair[0].is(":") && pair[1].blanks >= GAP);
        let first = right.first().filter(|_| is_defined && !is_table)?;
        Some(Self {
            begin: left.first()?.column,
            right: first.column,
            name: expression(left)?,
            relation: sign(relation.text, false)?,
            rows: vec![row(right)?],
            is_cases: false,
        })
    }

    /// Takes a line that begins at the right side or behind it: a case, or the rest of the line above it.
    fn go_on(&mut self, tokens: &[Token]) -> Option<()> {
        if tokens.first()?.column == self.right {
            let row = row(tokens)?;
            self.is_cases |= !row.note.is_empty();
            self.rows.push(row);
            return Some(());
        }
        let note = expression(tokens)?;
        match self.rows.last_mut()? {
            above if above.note.is_empty() => above.note = note,
            _ => self.rows.push(Row { value: String::new(), note }),
        }
        Some(())
    }
}

/// Returns the columns of a right side.
fn row(tokens: &[Token]) -> Option<Row> {
    let columns = columns(tokens).into_iter().map(expression).collect::<Option<Vec<_>>>()?;
    let (value, notes) = columns.split_first()?;
    Some(Row { value: value.clone(), note: notes.join(&SPACE.repeat(2)) })
}

/// Returns the equations of a run; `None` when a line is something else.
fn lines(run: &[&str]) -> Option<Vec<Line>> {
    let mut lines: Vec<Line> = vec![];
    for line in run {
        let tokens = tokens(line)?;
        let begin = tokens.first()?.column;
        match lines.last_mut() {
            Some(Line::Equation(above)) if begin >= above.right => above.go_on(&tokens)?,
            _ => lines.push(match Equation::read(&tokens) {
                Some(equation) => Line::Equation(equation),
                // A run that begins with words is no run of equations.
                None if lines.is_empty() || columns(&tokens).len() > 1 => return None,
                None => Line::Words(expression(&tokens)?, begin),
            }),
        }
    }
    Some(lines)
}

/// Returns a run as a table of aligned equations, on one line because Markdown ends HTML at an empty one.
fn table(run: &[&str]) -> Option<String> {
    let lines = lines(run)?;
    let begins = lines.iter().map(|line| match line {
        Line::Words(_, begin) | Line::Equation(Equation { begin, .. }) => *begin,
    });
    let least = begins.min()?;
    let indented = |begin: usize, math: &str| match begin - least {
        0 => math.to_string(),
        columns => format!("<mspace width=\"{columns}ex\"></mspace>{math}"),
    };
    let notes = lines.iter().map(|line| match line {
        Line::Equation(equation) if !equation.is_cases => {
            equation.rows.iter().filter(|row| !row.note.is_empty()).count()
        }
        _ => 0,
    });
    // A single note is behind its value instead of in a column of its own.
    let is_column = notes.sum::<usize>() > 1;
    let rows: String = lines
        .iter()
        .map(|line| match line {
            Line::Words(math, begin) => format!("<mtr><mtd columnspan=\"4\">{}</mtd></mtr>", indented(*begin, math)),
            Line::Equation(equation) => rows(equation, &indented(equation.begin, &equation.name), is_column),
        })
        .collect();
    let text = escaped(&unindented(&run.join("\n"))).replace('\n', "&#10;");
    Some(format!(
        "<div class=\"equations\"><math display=\"block\" alttext=\"{text}\"><mtable displaystyle=\"true\" \
         columnalign=\"left center left left\">{rows}</mtable></math></div>\n"
    ))
}

/// Returns the rows of an equation. Cases are a table of their own behind a brace.
fn rows(Equation { relation, rows, is_cases, .. }: &Equation, name: &str, is_column: bool) -> String {
    // A value without a note does not move the notes of the other rows.
    let cells = |Row { value, note }: &Row| match note.as_str() {
        "" => format!("<mtd columnspan=\"2\">{value}</mtd>"),
        note if is_column || *is_cases => format!("<mtd>{value}</mtd><mtd>{SPACE}{note}</mtd>"),
        note => format!("<mtd columnspan=\"2\">{value}{SPACE}{SPACE}{note}</mtd>"),
    };
    let begin = format!("<mtd>{name}</mtd><mtd>{relation}</mtd>");
    if *is_cases {
        let cases: String = rows.iter().map(|row| format!("<mtr>{}</mtr>", cells(row))).collect();
        return format!(
            "<mtr>{begin}<mtd columnspan=\"2\"><mrow><mo>{{</mo><mtable displaystyle=\"true\" columnalign=\"left \
             left\">{cases}</mtable></mrow></mtd></mtr>"
        );
    }
    let begins = std::iter::once(begin.as_str()).chain(std::iter::repeat("<mtd></mtd><mtd></mtd>"));
    rows.iter().zip(begins).map(|(row, begin)| format!("<mtr>{begin}{}</mtr>", cells(row))).collect()
}
