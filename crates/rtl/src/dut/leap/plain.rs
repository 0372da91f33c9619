//! Plain Verilog of a design, as Verilator has read it.
//!
//! Debian's Yosys reads SystemVerilog in part, and some of Verilog otherwise than Verilator. In Verilator's XML each
//! value has its width, each operation says whether it is signed, and parameters, packages, structures and enumerations
//! are numbers and words. Each operation is written as a concatenation of one part, so that nothing around it changes
//! its width or its sign, and all words are unsigned: what Yosys reads is what Verilator has read. What this does not
//! know is refused by its name in the XML.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::tree::{Tree, constant, is_statement};

/// The most bits of a word, and the most types inside each other.
const MOST_BITS: u64 = 1 << 16;
const MOST_DEPTH: usize = 32;

/// Width of a word; of a memory also the number of its words.
#[derive(Clone, Copy)]
struct Shape {
    width: u64,
    words: Option<u64>,
}

/// Returns a design as plain Verilog whose topmost module has this name, or what of it is not known.
pub(super) fn plain(xml: &str, top: &str) -> Result<String, String> {
    let tree = &Tree::read(xml);
    let with = |tag: &'static str| (0..tree.nodes.len()).filter(move |at| tree.nodes[*at].tag == tag);
    let types = (0..tree.nodes.len()).filter(|at| tree.nodes[*at].tag.ends_with("dtype"));
    let types = types.filter_map(|at| Some((tree.nodes[at].get("id")?, at))).collect();
    let mut functions: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for at in with("func") {
        functions.entry(tree.nodes[at].get("name").unwrap_or_default()).or_default().push(at);
    }
    // A name of a package may also be one of a module, and the XML does not tell which of both is meant.
    let packages: Vec<_> = with("package").collect();
    let packaged = packages.iter().flat_map(|package| tree.within(*package)).filter(|at| tree.nodes[*at].tag == "func");
    let packaged: BTreeSet<_> = packaged.collect();
    let vars = |within: usize| tree.parts(within).into_iter().filter(|at| tree.nodes[*at].tag == "var");
    let of_packages: BTreeSet<_> =
        packages.iter().flat_map(|package| vars(*package)).filter_map(|at| tree.nodes[at].get("name")).collect();
    let mut read = (0..tree.nodes.len()).filter(|at| tree.nodes[*at].tag == "varref");
    if let Some(name) = read.find_map(|at| tree.nodes[at].get("name").filter(|name| of_packages.contains(name))) {
        return Err(format!("`{name}`, a name of a package"));
    }
    let mut text = String::new();
    for module in with("module") {
        let mut printer = Printer {
            tree,
            types: &types,
            functions: &functions,
            packaged: &packaged,
            module,
            shapes: BTreeMap::new(),
            cuts: BTreeSet::new(),
            called: Vec::new(),
            text: String::new(),
        };
        let name = match tree.nodes[module].get("topModule") {
            Some(_) => top,
            None => tree.nodes[module].get("name").ok_or("a module without a name")?,
        };
        text += &printer.module(name)?;
    }
    Ok(text)
}

/// Returns a name as Verilog has it.
fn named(name: &str) -> String {
    let is_plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if is_plain { name.to_string() } else { format!("\\{name} ") }
}

struct Printer<'t, 'x> {
    tree: &'t Tree<'x>,
    /// The elements of types, by their numbers.
    types: &'t BTreeMap<&'x str, usize>,
    /// The functions of all modules and packages, by name.
    functions: &'t BTreeMap<&'x str, Vec<usize>>,
    /// Those of packages.
    packaged: &'t BTreeSet<usize>,
    module: usize,
    shapes: BTreeMap<&'x str, Shape>,
    /// The functions that cut a word of a width to another width, as they are needed.
    cuts: BTreeSet<(u64, u64)>,
    /// The functions that are called.
    called: Vec<usize>,
    text: String,
}

impl<'x> Printer<'_, 'x> {
    fn get(&self, at: usize, name: &str) -> Result<&'x str, String> {
        self.tree.nodes[at].get(name).ok_or_else(|| format!("`{}` without `{name}`", self.tree.nodes[at].tag))
    }

    fn tag(&self, at: usize) -> &'x str {
        self.tree.nodes[at].tag
    }

    /// Returns the parts of an element, which has so many.
    fn exactly<const N: usize>(&self, at: usize) -> Result<[usize; N], String> {
        self.tree.parts(at).try_into().map_err(|_| format!("`{}` of another form", self.tag(at)))
    }

    fn number(&self, at: usize) -> Result<u64, String> {
        let node = &self.tree.nodes[at];
        let word = (node.tag == "const").then(|| constant(node)).flatten();
        word.ok_or_else(|| format!("`{}` where a number is expected", node.tag))
    }

    /// Returns the shape of an element's type.
    fn shape(&mut self, at: usize) -> Result<Shape, String> {
        let id = self.get(at, "dtype_id")?;
        if let Some(shape) = self.shapes.get(id) {
            return Ok(*shape);
        }
        let shape = self.of_type(id, 0)?;
        self.shapes.insert(id, shape);
        Ok(shape)
    }

    fn of_type(&self, id: &str, depth: usize) -> Result<Shape, String> {
        let at = *self.types.get(id).ok_or("a type that is not told")?;
        if depth > MOST_DEPTH {
            return Err("types inside each other".to_string());
        }
        let below = |at: usize| self.of_type(self.get(at, "sub_dtype_id")?, depth + 1);
        let range = || {
            let range = self.tree.parts(at).into_iter().find(|part| self.tag(*part) == "range").ok_or("a range")?;
            let [left, right] = self.exactly(range)?;
            Ok::<_, String>(self.number(left)?.abs_diff(self.number(right)?) + 1)
        };
        let word = |width| Shape { width, words: None };
        let shape = match self.tag(at) {
            "basicdtype" => {
                let name = self.get(at, "name")?;
                if !["logic", "bit", "reg", "int", "integer", "byte", "shortint", "longint"].contains(&name) {
                    return Err(format!("the type `{name}`"));
                }
                let end = |name: &str| self.tree.nodes[at].get(name).map_or(Ok(0), str::parse::<i64>);
                let [Ok(left), Ok(right)] = ["left", "right"].map(end) else {
                    return Err(format!("the type `{name}`"));
                };
                word(left.abs_diff(right) + 1)
            }
            "refdtype" | "enumdtype" => below(at)?,
            "structdtype" => {
                let mut width = 0;
                for member in self.tree.parts(at) {
                    let shape = below(member)?;
                    if self.tag(member) != "memberdtype" || shape.words.is_some() {
                        return Err("a structure with a memory".to_string());
                    }
                    width += shape.width;
                }
                word(width)
            }
            "packarraydtype" => match below(at)? {
                Shape { width, words: None } => word(width.saturating_mul(range()?)),
                _ => return Err("words of memories".to_string()),
            },
            "unpackarraydtype" => match below(at)? {
                Shape { width, words: None } => Shape { width, words: Some(range()?) },
                _ => return Err("a memory of memories".to_string()),
            },
            other => return Err(format!("a type of the kind `{other}`")),
        };
        if shape.width == 0 || shape.width > MOST_BITS || shape.words.is_some_and(|words| words > MOST_BITS) {
            return Err("a word or a memory of that size".to_string());
        }
        Ok(shape)
    }

    /// Returns the width of an element that is one word.
    fn width(&mut self, at: usize) -> Result<u64, String> {
        match self.shape(at)? {
            Shape { width, words: None } => Ok(width),
            _ => Err("a whole memory".to_string()),
        }
    }

    /// Returns a value, unsigned, whose width nothing around it changes, and this width.
    fn value(&mut self, at: usize) -> Result<(String, u64), String> {
        let tag = self.tag(at);
        let (text, width) = match tag {
            "const" => self.constant(at)?,
            "varref" | "arraysel" => return self.place(at),
            "sel" => return self.part(at),
            "concat" => {
                let all = self.values(at)?;
                let width = all.iter().map(|(_, width)| width).sum();
                let all: Vec<_> = all.into_iter().map(|(text, _)| text).collect();
                (format!("{{{}}}", all.join(", ")), width)
            }
            "replicate" => {
                let [value, count] = self.exactly(at)?;
                let ((value, width), count) = (self.value(value)?, self.number(count)?);
                (format!("{{{count}{{{value}}}}}"), width.saturating_mul(count))
            }
            "extend" | "extends" => {
                let [value] = self.exactly(at)?;
                let ((value, from), width) = (self.value(value)?, self.width(at)?);
                match width.checked_sub(from) {
                    None => return Err(format!("`{tag}` to fewer bits")),
                    Some(0) => (value, width),
                    Some(more) if tag == "extend" => (format!("{{{{{more}{{1'b0}}}}, {value}}}"), width),
                    Some(_) => (format!("{{($signed({value}) + $signed({{{width}{{1'b0}}}}))}}"), width),
                }
            }
            "cond" => {
                let [when, yes, no] = self.exactly(at)?;
                let [(when, _), (yes, width), (no, other)] = [self.value(when)?, self.value(yes)?, self.value(no)?];
                self.same(tag, width, other)?;
                (format!("{{({when} ? {yes} : {no})}}"), width)
            }
            "funcref" => {
                let name = self.get(at, "name")?;
                let mut given = Vec::new();
                for arg in self.tree.parts(at) {
                    let [value] = self.exactly(arg)?;
                    given.push(self.value(value)?.0);
                }
                self.call(name)?;
                (format!("{}({})", named(name), given.join(", ")), self.width(at)?)
            }
            _ => self.operation(at)?,
        };
        let own = if tag == "const" { width } else { self.width(at)? };
        self.same(tag, width, own)?;
        Ok((text, width))
    }

    fn same(&self, tag: &str, one: u64, other: u64) -> Result<(), String> {
        if one == other { Ok(()) } else { Err(format!("`{tag}` of {one} and {other} bits")) }
    }

    fn values(&mut self, at: usize) -> Result<Vec<(String, u64)>, String> {
        self.tree.parts(at).into_iter().map(|part| self.value(part)).collect()
    }

    fn constant(&self, at: usize) -> Result<(String, u64), String> {
        let text = self.get(at, "name")?.replace("&apos;", "'");
        let whole = |text: &str| {
            let (width, digits) = text.split_once('\'')?;
            let digits = digits.strip_prefix('s').unwrap_or(digits).strip_prefix('h')?;
            let is_hex = !digits.is_empty() && digits.chars().all(|c| c.is_ascii_hexdigit());
            Some((width.parse().ok().filter(|width| (1..=MOST_BITS).contains(width) && is_hex)?, digits.to_string()))
        };
        let (width, digits) = whole(&text).ok_or_else(|| format!("the constant {text}"))?;
        Ok((format!("{width}'h{digits}"), width))
    }

    /// Returns an operation of one or two values.
    fn operation(&mut self, at: usize) -> Result<(String, u64), String> {
        let tag = self.tag(at);
        let unary = |sign: &str, value: &str| format!("{{({sign}{value})}}");
        let all = self.values(at)?;
        let (sign, is_signed) = match tag {
            "not" | "negate" | "lognot" | "redand" | "redor" | "redxor" => {
                let [(value, width)] = &all[..] else { return Err(format!("`{tag}` of another form")) };
                return Ok(match tag {
                    "not" => (unary("~", value), *width),
                    "negate" => (unary("-", value), *width),
                    "lognot" => (unary("!", value), 1),
                    "redand" => (unary("&", value), 1),
                    "redor" => (unary("|", value), 1),
                    _ => (unary("^", value), 1),
                });
            }
            "and" => ("&", false),
            "or" => ("|", false),
            "xor" => ("^", false),
            "add" => ("+", false),
            "sub" => ("-", false),
            "mul" => ("*", false),
            "muls" => ("*", true),
            "div" => ("/", false),
            "divs" => ("/", true),
            "moddiv" => ("%", false),
            "moddivs" => ("%", true),
            "eq" | "eqwild" => ("==", false),
            "neq" | "neqwild" => ("!=", false),
            "lt" => ("<", false),
            "lts" => ("<", true),
            "gt" => (">", false),
            "gts" => (">", true),
            "lte" => ("<=", false),
            "ltes" => ("<=", true),
            "gte" => (">=", false),
            "gtes" => (">=", true),
            "logand" => ("&&", false),
            "logor" => ("||", false),
            "shiftl" => ("<<", false),
            "shiftr" => (">>", false),
            "shiftrs" => (">>>", true),
            _ => return Err(format!("`{tag}`")),
        };
        let [(a, of_a), (b, of_b)] = &all[..] else { return Err(format!("`{tag}` of another form")) };
        let is_shift = tag.starts_with("shift");
        let amount = self.tree.parts(at).get(1).filter(|part| is_shift && self.tag(**part) == "const").copied();
        if amount.is_some_and(|amount| self.number(amount).is_ok_and(|amount| amount >= *of_a)) {
            return Err("a shift by a whole word or more".to_string());
        }
        if !is_shift && !tag.starts_with("log") {
            self.same(tag, *of_a, *of_b)?;
        }
        let signed = |text: &str| if is_signed { format!("$signed({text})") } else { text.to_string() };
        // An amount has no sign.
        let b = if is_shift { b.clone() } else { signed(b) };
        let is_arithmetic = is_shift || ["&", "|", "^", "+", "-", "*", "/", "%"].contains(&sign);
        Ok((format!("{{({} {sign} {b})}}", signed(a)), if is_arithmetic { *of_a } else { 1 }))
    }

    /// Returns a variable or a word of a memory, and its width.
    fn place(&mut self, at: usize) -> Result<(String, u64), String> {
        match self.tag(at) {
            "varref" => Ok((named(self.get(at, "name")?), self.width(at)?)),
            "arraysel" => {
                let [memory, index] = self.exactly(at)?;
                let (shape, (index, _)) = (self.shape(memory)?, self.value(index)?);
                match (self.tag(memory), shape.words) {
                    ("varref", Some(_)) => Ok((format!("{}[{index}]", named(self.get(memory, "name")?)), shape.width)),
                    _ => Err("a part of a memory's part".to_string()),
                }
            }
            other => Err(format!("`{other}` where a word is expected")),
        }
    }

    /// Returns a part of a value.
    fn part(&mut self, at: usize) -> Result<(String, u64), String> {
        let [of, low, width] = self.exactly(at)?;
        let width = self.number(width)?;
        let own = self.width(at)?;
        self.same("sel", width, own)?;
        if self.tag(low) == "const" && self.number(low)?.saturating_add(width) > self.width(of)? {
            return Err("a part beyond its word".to_string());
        }
        if ["varref", "arraysel"].contains(&self.tag(of)) {
            return Ok((self.part_of_place(of, low, width)?, width));
        }
        let ((value, from), (low, _)) = (self.value(of)?, self.value(low)?);
        self.cuts.insert((from, width));
        Ok((format!("hpu_cut_{from}_{width}({{({value} >> {low})}})"), width))
    }

    fn part_of_place(&mut self, of: usize, low: usize, width: u64) -> Result<String, String> {
        let low = match self.tag(low) {
            "const" => self.number(low)?.to_string(),
            _ => self.value(low)?.0,
        };
        Ok(format!("{}[{low} +: {width}]", self.place(of)?.0))
    }

    /// Returns the target of an assignment, and its width.
    fn target(&mut self, at: usize) -> Result<(String, u64), String> {
        match self.tag(at) {
            "sel" => {
                let [of, low, width] = self.exactly(at)?;
                let width = self.number(width)?;
                Ok((self.part_of_place(of, low, width)?, width))
            }
            "concat" => {
                let all =
                    self.tree.parts(at).into_iter().map(|part| self.target(part)).collect::<Result<Vec<_>, _>>()?;
                let width = all.iter().map(|(_, width)| width).sum();
                let all: Vec<_> = all.into_iter().map(|(text, _)| text).collect();
                Ok((format!("{{{}}}", all.join(", ")), width))
            }
            _ => self.place(at),
        }
    }

    fn assigned(&mut self, at: usize, sign: &str) -> Result<String, String> {
        let [value, target] = self.exactly(at)?;
        let ((value, width), (target, of_target)) = (self.value(value)?, self.target(target)?);
        self.same("assign", width, of_target)?;
        Ok(format!("{target} {sign} {value}"))
    }

    /// Notes that a function is called: the only one of that name in the module itself or in a package. The XML does
    /// not tell in which scope a name is.
    fn call(&mut self, name: &str) -> Result<(), String> {
        let all = self.functions.get(name).map_or(&[][..], Vec::as_slice);
        let is_near =
            |at: &usize| self.tree.within(self.module).any(|inside| inside == *at) || self.packaged.contains(at);
        let near: Vec<_> = all.iter().copied().filter(is_near).collect();
        let is_direct = |at: &usize| self.packaged.contains(at) || self.tree.parts(self.module).contains(at);
        match near[..] {
            [function] if is_direct(&function) => {
                if !self.called.contains(&function) {
                    self.called.push(function);
                }
                Ok(())
            }
            _ => Err(format!("the function `{name}`, of several or in a block")),
        }
    }

    fn statements(&mut self, all: &[usize]) -> Result<(), String> {
        let mut at = 0;
        while at < all.len() {
            let next = all.get(at + 1).filter(|next| self.tag(**next) == "while");
            match next {
                Some(next) if self.tag(all[at]) == "assign" => {
                    self.looped(all[at], *next)?;
                    at += 2;
                }
                _ => {
                    self.statement(all[at])?;
                    at += 1;
                }
            }
        }
        Ok(())
    }

    fn statement(&mut self, at: usize) -> Result<(), String> {
        match self.tag(at) {
            "begin" => {
                let name = self.tree.nodes[at].get("name").filter(|name| !name.is_empty());
                let _ =
                    writeln!(self.text, "begin{}", name.map_or(String::new(), |name| format!(" : {}", named(name))));
                let (vars, others): (Vec<_>, Vec<_>) =
                    self.tree.parts(at).into_iter().partition(|part| self.tag(*part) == "var");
                for var in vars {
                    self.variable(var)?;
                }
                self.statements(&others)?;
                self.text += "end\n";
            }
            "assign" | "assigndly" => {
                let assigned = self.assigned(at, if self.tag(at) == "assign" { "=" } else { "<=" })?;
                self.text += &(assigned + ";\n");
            }
            "if" => {
                let parts = self.tree.parts(at);
                let [when, branches @ ..] = &parts[..] else { return Err("`if` of another form".to_string()) };
                if branches.is_empty() || branches.len() > 2 {
                    return Err("`if` of another form".to_string());
                }
                let when = self.value(*when)?.0;
                let _ = writeln!(self.text, "if ({when})");
                for (index, branch) in branches.iter().enumerate() {
                    self.text += if index == 1 { "else begin\n" } else { "begin\n" };
                    self.statement(*branch)?;
                    self.text += "end\n";
                }
            }
            "case" => self.chosen(at)?,
            other => return Err(format!("`{other}`")),
        }
        Ok(())
    }

    /// Prints a choice as conditions one after the other.
    fn chosen(&mut self, at: usize) -> Result<(), String> {
        let parts = self.tree.parts(at);
        let (selector, items) = parts.split_first().ok_or("`case` of another form")?;
        let (selector, width) = self.value(*selector)?;
        let (mut otherwise, mut first) = (None, true);
        for item in items {
            let parts = self.tree.parts(*item);
            let (body, values): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| is_statement(self.tree, *part));
            if self.tag(*item) != "caseitem" || values.is_empty() && otherwise.is_some() {
                return Err("`case` of another form".to_string());
            }
            if values.is_empty() {
                otherwise = Some(body);
                continue;
            }
            let mut all = Vec::new();
            for value in values {
                let (value, own) = self.value(value)?;
                self.same("case", own, width)?;
                all.push(format!("{{({selector} == {value})}}"));
            }
            let _ = writeln!(self.text, "{}if ({}) begin", if first { "" } else { "else " }, all.join(" || "));
            first = false;
            self.statements(&body)?;
            self.text += "end\n";
        }
        if let Some(body) = otherwise {
            self.text += if first { "begin\n" } else { "else begin\n" };
            self.statements(&body)?;
            self.text += "end\n";
        }
        Ok(())
    }

    /// Prints a loop whose variable, an integer of 32 bits, begins with an assignment.
    fn looped(&mut self, begin: usize, at: usize) -> Result<(), String> {
        let [before, when, body, step] = self.exactly(at)?;
        let ([when], [step]) = (self.exactly(when)?, self.exactly(step)?);
        let [first, variable] = self.exactly(begin)?;
        let [_, again] = self.exactly(step)?;
        let name = |at: usize| (self.tag(at) == "varref").then(|| self.get(at, "name").ok()).flatten();
        let is_counted = self.tag(step) == "assign" && name(variable).is_some() && name(variable) == name(again);
        if !is_counted
            || !self.tree.parts(before).is_empty()
            || self.tag(first) != "const"
            || self.width(variable)? != 32
        {
            return Err("a loop that is not counted from a number by an integer".to_string());
        }
        let (begin, when, step) = (self.assigned(begin, "=")?, self.value(when)?.0, self.assigned(step, "=")?);
        let _ = writeln!(self.text, "for ({begin}; {when}; {step})");
        self.statement(body)
    }

    /// Prints a parameter where it stands, so that its name is no other's.
    fn parameter(&mut self, at: usize) -> Result<(), String> {
        let [value] = self.exactly(at)?;
        let name = named(self.get(at, "name")?);
        let (value, width) = match self.tag(value) {
            "const" => self.constant(value)?,
            _ => return Err("a parameter that is no number".to_string()),
        };
        let _ = writeln!(self.text, "localparam [{}:0] {name} = {value};", width - 1);
        Ok(())
    }

    /// Prints a variable that is no port.
    fn variable(&mut self, at: usize) -> Result<(), String> {
        if !self.tree.parts(at).is_empty() {
            return Err("a variable with a first word".to_string());
        }
        let (name, shape) = (named(self.get(at, "name")?), self.shape(at)?);
        let words = shape.words.map_or(String::new(), |words| format!(" [0:{}]", words - 1));
        let _ = writeln!(self.text, "logic [{}:0] {name}{words};", shape.width - 1);
        Ok(())
    }

    fn module(&mut self, name: &str) -> Result<String, String> {
        let parts = self.tree.parts(self.module);
        let mut ports = Vec::new();
        for &port in &parts {
            let Some(way) = self.tree.nodes[port].get("dir").filter(|_| self.tag(port) == "var") else { continue };
            if !["input", "output"].contains(&way) {
                return Err(format!("a port of the kind `{way}`"));
            }
            ports.push(format!("{way} logic [{}:0] {}", self.width(port)? - 1, named(self.get(port, "name")?)));
        }
        self.items(&parts)?;
        let body = std::mem::take(&mut self.text);
        let mut next = 0;
        while let Some(&function) = self.called.get(next) {
            self.function(function)?;
            next += 1;
        }
        let functions = std::mem::take(&mut self.text);
        let cut = |(from, width): &(u64, u64)| {
            let name = format!("hpu_cut_{from}_{width}");
            format!(
                "function [{0}:0] {name};\ninput [{1}:0] x;\n{name} = x[{0}:0];\nendfunction\n",
                width - 1,
                from - 1
            )
        };
        let cuts: String = self.cuts.iter().map(cut).collect();
        Ok(format!("module {}({});\n{cuts}{functions}{body}endmodule\n", named(name), ports.join(", ")))
    }

    fn items(&mut self, all: &[usize]) -> Result<(), String> {
        for &at in all {
            match self.tag(at) {
                "var" if self.tree.nodes[at].get("dir").is_some() => {}
                "var" if ["param", "localparam"].iter().any(|kind| self.tree.nodes[at].get(kind).is_some()) => {
                    self.parameter(at)?;
                }
                "var" => self.variable(at)?,
                "typedef" | "func" => {}
                "always" => self.process(at)?,
                "initial" | "initialstatic" => {
                    self.text += "initial begin\n";
                    self.statements(&self.tree.parts(at))?;
                    self.text += "end\n";
                }
                "contassign" => {
                    let assigned = self.assigned(at, "=")?;
                    let _ = writeln!(self.text, "assign {assigned};");
                }
                "instance" => self.instance(at)?,
                "begin" => {
                    let parts = self.tree.parts(at);
                    let name = self.get(at, "name")?;
                    if !parts.is_empty() {
                        let _ = writeln!(self.text, "if (1) begin : {}", named(name));
                        self.items(&parts)?;
                        self.text += "end\n";
                    }
                }
                other => return Err(format!("`{other}`")),
            }
        }
        Ok(())
    }

    fn process(&mut self, at: usize) -> Result<(), String> {
        let (timing, body): (Vec<_>, Vec<_>) =
            self.tree.parts(at).into_iter().partition(|part| self.tag(*part) == "sentree");
        let mut edges = Vec::new();
        for item in timing.into_iter().flat_map(|timing| self.tree.parts(timing)) {
            let edge = match self.get(item, "edgeType")? {
                "POS" => "posedge",
                "NEG" => "negedge",
                _ => continue,
            };
            let [word] = self.exactly(item)?;
            edges.push(format!("{edge} {}", self.place(word)?.0));
        }
        let when = if edges.is_empty() { "*".to_string() } else { format!("({})", edges.join(" or ")) };
        let _ = writeln!(self.text, "always @{when} begin");
        self.statements(&body)?;
        self.text += "end\n";
        Ok(())
    }

    fn instance(&mut self, at: usize) -> Result<(), String> {
        let mut ports = Vec::new();
        let defined = self.get(at, "defName")?;
        for port in self.tree.parts(at) {
            let name = named(self.port(defined, port)?);
            let to = match (self.get(port, "direction")?, &self.tree.parts(port)[..]) {
                (_, []) => String::new(),
                ("in", [value]) => self.value(*value)?.0,
                ("out", [target]) => self.target(*target)?.0,
                (way, _) => return Err(format!("a port of the kind `{way}`")),
            };
            ports.push(format!(".{name}({to})"));
        }
        let [module, name] = [defined, self.get(at, "name")?].map(named);
        let _ = writeln!(self.text, "{module} {name}({});", ports.join(", "));
        Ok(())
    }

    /// Returns the name of the port that a connection is to; one by its place has the number of the port alone.
    fn port(&self, module: &str, connection: usize) -> Result<&'x str, String> {
        let name = self.get(connection, "name")?;
        if !name.starts_with("__pinNumber") {
            return Ok(name);
        }
        let number = self.get(connection, "portIndex")?;
        let tree = self.tree;
        let is_it = |at: &usize| tree.nodes[*at].tag == "module" && tree.nodes[*at].get("name") == Some(module);
        let of = (0..tree.nodes.len()).find(is_it).map_or(Vec::new(), |module| tree.parts(module));
        let port = of.into_iter().find(|at| tree.nodes[*at].get("pinIndex") == Some(number));
        port.and_then(|port| tree.nodes[port].get("name")).ok_or_else(|| "a connection by its place".to_string())
    }

    /// Prints a function. One of a package reads its own words alone: names of packages are refused.
    fn function(&mut self, at: usize) -> Result<(), String> {
        let (name, width) = (self.get(at, "name")?, self.width(at)?);
        let _ = writeln!(self.text, "function [{}:0] {};", width - 1, named(name));
        let (vars, body): (Vec<_>, Vec<_>) = self.tree.parts(at).into_iter().partition(|part| self.tag(*part) == "var");
        for var in vars {
            let own = self.get(var, "name")?;
            match self.tree.nodes[var].get("dir") {
                Some("input") => {
                    let width = self.width(var)?;
                    let _ = writeln!(self.text, "input [{}:0] {};", width - 1, named(own));
                }
                Some(_) if own == name => {}
                Some(way) => return Err(format!("a function with an argument of the kind `{way}`")),
                None => self.variable(var)?,
            }
        }
        self.text += "begin\n";
        self.statements(&body)?;
        self.text += "end\nendfunction\n";
        Ok(())
    }
}
