//! Formulas of a study's file, as in `abs(saturate - 0.265) < 0.265e-3`: arithmetic, comparisons and a few functions of
//! lists of numbers.
//!
//! Every value is a list; a number is a list of one. Operators work member by member, and a number goes with each
//! member of a list. A comparison is 1 where it holds, else 0.

use crate::Error;
use hpu_cosim::did_you_mean;

/// A formula, read.
pub enum Formula {
    /// A number.
    Number(f64),
    /// A value by its name.
    Name(String),
    /// A function of its arguments.
    Call(&'static Function, Vec<Formula>),
    /// An operator between two formulas.
    Pair(Box<Formula>, Operator, Box<Formula>),
    /// The first value, or the second where the first is not known.
    Else(Box<Formula>, Box<Formula>),
}

/// An operator, member by member.
pub type Operator = fn(f64, f64) -> f64;

/// A function of one list.
pub struct Function {
    name: &'static str,
    of: fn(&[f64]) -> Vec<f64>,
}

/// The functions. The first four work member by member; the others make one number of a list.
static FUNCTIONS: [Function; 12] = [
    Function { name: "abs", of: |list| list.iter().map(|x| x.abs()).collect() },
    Function { name: "exp", of: |list| list.iter().map(|x| libm::exp(*x)).collect() },
    Function { name: "ln", of: |list| list.iter().map(|x| libm::log(*x)).collect() },
    Function { name: "sqrt", of: |list| list.iter().map(|x| x.sqrt()).collect() },
    Function { name: "first", of: |list| list.first().copied().into_iter().collect() },
    Function { name: "last", of: |list| list.last().copied().into_iter().collect() },
    Function { name: "least", of: |list| vec![list.iter().copied().fold(f64::INFINITY, f64::min)] },
    Function { name: "most", of: |list| vec![list.iter().copied().fold(f64::NEG_INFINITY, f64::max)] },
    Function { name: "sum", of: |list| vec![list.iter().sum()] },
    // No member is below the one before.
    Function { name: "never_falls", of: |list| vec![truth(list.windows(2).all(|pair| pair[1] >= pair[0]))] },
    // No member is above the one before.
    Function { name: "never_rises", of: |list| vec![truth(list.windows(2).all(|pair| pair[1] <= pair[0]))] },
    // How many members from the first on are not 0.
    Function { name: "leading", of: |list| vec![list.iter().take_while(|x| **x != 0.0).count() as f64] },
];

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

/// Returns the operators of each rank, the one that binds least first.
fn operators(rank: usize) -> &'static [(&'static str, Operator)] {
    match rank {
        0 => &[("or", |a, b| truth(a != 0.0 || b != 0.0))],
        1 => &[("and", |a, b| truth(a != 0.0 && b != 0.0))],
        2 => &[
            ("<=", |a, b| truth(a <= b)),
            (">=", |a, b| truth(a >= b)),
            ("==", |a, b| truth(a == b)),
            ("<", |a, b| truth(a < b)),
            (">", |a, b| truth(a > b)),
        ],
        3 => &[("+", |a, b| a + b), ("-", |a, b| a - b)],
        4 => &[("*", |a, b| a * b), ("/", |a, b| a / b)],
        _ => &[],
    }
}

impl Formula {
    /// Reads a formula.
    ///
    /// # Errors
    ///
    /// Returns what is wrong, and what a formula may hold there.
    ///
    /// # Example
    ///
    /// ```
    /// use hpu_papers::formula::Formula;
    /// let formula = Formula::read("4 <= times and times <= 5").expect("a formula");
    /// assert_eq!(formula.value(&|_| Ok(vec![4.5, 5.5])), Ok(vec![1.0, 0.0]));
    /// ```
    pub fn read(text: &str) -> Result<Self, Error> {
        let mut reader = Reader { rest: text.trim_start() };
        let formula = reader.rank(0)?;
        if reader.rest.is_empty() { Ok(formula) } else { Err(reader.refused("an operator")) }
    }

    /// Returns the formula's value. `named` returns the value of a name, or why there is none.
    ///
    /// # Errors
    ///
    /// Returns why a name has no value, or that two lists differ in length.
    pub fn value(&self, named: &dyn Fn(&str) -> Result<Vec<f64>, Error>) -> Result<Vec<f64>, Error> {
        Ok(match self {
            Self::Number(number) => vec![*number],
            Self::Name(name) => named(name)?,
            Self::Call(function, of) => {
                let lists = of.iter().map(|formula| formula.value(named)).collect::<Result<Vec<_>, _>>()?;
                (function.of)(&lists.concat())
            }
            Self::Else(first, otherwise) => match first.value(named) {
                Ok(value) => value,
                Err(_) => otherwise.value(named)?,
            },
            Self::Pair(one, operator, other) => {
                let (one, other) = (one.value(named)?, other.value(named)?);
                match (&one[..], &other[..]) {
                    ([one], _) => other.iter().map(|other| operator(*one, *other)).collect(),
                    (_, [other]) => one.iter().map(|one| operator(*one, *other)).collect(),
                    _ if one.len() == other.len() => one.iter().zip(&other).map(|(a, b)| operator(*a, *b)).collect(),
                    _ => {
                        return Err(format!("a list of {} beside a list of {}", one.len(), other.len()).into());
                    }
                }
            }
        })
    }

    /// Calls `take` with every name in the formula.
    pub fn names(&self, take: &mut dyn FnMut(&str)) {
        match self {
            Self::Number(_) => {}
            Self::Name(name) => take(name),
            Self::Call(_, of) => of.iter().for_each(|formula| formula.names(take)),
            Self::Pair(one, _, other) | Self::Else(one, other) => {
                one.names(take);
                other.names(take);
            }
        }
    }
}

struct Reader<'a> {
    rest: &'a str,
}

impl<'a> Reader<'a> {
    fn refused(&self, wanted: &str) -> Error {
        let here = if self.rest.is_empty() { "the end".into() } else { format!("`{}`", self.rest) };
        Error::new(format_args!("{wanted} is expected at {here}"))
    }

    fn take(&mut self, length: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(length);
        self.rest = rest.trim_start();
        taken
    }

    fn took(&mut self, sign: &str) -> bool {
        let is_word = sign.ends_with(|c: char| c.is_ascii_alphabetic());
        let found = self.rest.starts_with(sign) && !(is_word && self.word().len() > sign.len());
        if found {
            self.take(sign.len());
        }
        found
    }

    /// Returns the name at the front, with the dots within it; empty if there is none.
    fn word(&self) -> &'a str {
        let end = self.rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '.'));
        let word = &self.rest[..end.unwrap_or(self.rest.len())];
        if word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') { word } else { "" }
    }

    fn rank(&mut self, rank: usize) -> Result<Formula, Error> {
        if operators(rank).is_empty() {
            return self.factor();
        }
        let mut one = self.rank(rank + 1)?;
        while let Some((_, operator)) = operators(rank).iter().find(|(sign, _)| self.took(sign)) {
            one = Formula::Pair(Box::new(one), *operator, Box::new(self.rank(rank + 1)?));
        }
        Ok(one)
    }

    fn factor(&mut self) -> Result<Formula, Error> {
        if self.took("-") {
            return Ok(Formula::Pair(Box::new(Formula::Number(-1.0)), |a, b| a * b, Box::new(self.factor()?)));
        }
        if self.took("(") {
            let inner = self.rank(0)?;
            return if self.took(")") { Ok(inner) } else { Err(self.refused("`)`")) };
        }
        let word = self.word();
        if word.is_empty() {
            return self.number();
        }
        self.take(word.len());
        match word {
            "pi" => return Ok(Formula::Number(std::f64::consts::PI)),
            "inf" => return Ok(Formula::Number(f64::INFINITY)),
            _ if !self.took("(") => return Ok(Formula::Name(word.into())),
            _ => {}
        }
        let mut of = vec![self.rank(0)?];
        while self.took(",") {
            of.push(self.rank(0)?);
        }
        if !self.took(")") {
            return Err(self.refused("`,` or `)`"));
        }
        if word == "else" {
            let [first, otherwise] = <[Formula; 2]>::try_from(of).map_err(|_| "else(...) takes two arguments")?;
            return Ok(Formula::Else(Box::new(first), Box::new(otherwise)));
        }
        let function = FUNCTIONS.iter().find(|function| function.name == word).ok_or_else(|| {
            let names: Vec<_> = FUNCTIONS.iter().map(|function| function.name).chain(["else"]).collect();
            format!("no function {word}; one of {}{}", names.join(", "), did_you_mean(word, &names))
        })?;
        Ok(Formula::Call(function, of))
    }

    fn number(&mut self) -> Result<Formula, Error> {
        let mut end = 0;
        for (at, letter) in self.rest.char_indices() {
            let signs = matches!(letter, '+' | '-') && self.rest[..at].ends_with(['e', 'E']);
            if !(letter.is_ascii_digit() || matches!(letter, '.' | 'e' | 'E') || signs) {
                break;
            }
            end = at + 1;
        }
        let number = self.rest[..end].parse().map_err(|_| self.refused("a number, a name or `(`"))?;
        self.take(end);
        Ok(Formula::Number(number))
    }
}
