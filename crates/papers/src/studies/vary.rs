//! The variables of a study's file: `$name` stands for a value, `$(formula:form)` for a computed one.

use std::collections::BTreeMap;

use toml_edit::{Array, InlineTable, Item, Value};

use crate::Error;
use crate::measure::Load;
use crate::template::{Template, Values};
use hpu_study::map::Method;

/// Values by name.
#[derive(Clone, Default, Debug)]
pub struct Variables(BTreeMap<String, Value>);

impl Variables {
    /// Returns the variables with one more.
    pub fn with(&self, name: &str, value: Value) -> Self {
        let mut all = self.clone();
        all.0.insert(name.into(), value);
        all
    }

    /// Returns the value of a variable, as in `form.kind` for a key of the table `form`.
    ///
    /// # Errors
    ///
    /// Returns which variables there are.
    pub fn get(&self, path: &str) -> Result<&Value, Error> {
        let (name, rest) = path.split_once('.').unwrap_or((path, ""));
        let mut value = self.0.get(name);
        for key in rest.split('.').filter(|key| !key.is_empty()) {
            value = value.and_then(|value| value.as_inline_table()?.get(key));
        }
        value.ok_or_else(|| {
            let known: Vec<_> = self.0.keys().map(|name| format!("${name}")).collect();
            Error::new(format_args!("no variable ${path}; there are {}", known.join(", ")))
        })
    }

    /// Returns a text with its variables replaced.
    ///
    /// # Errors
    ///
    /// Returns which variable is unknown, or what is wrong with a formula.
    pub fn replace(&self, text: &str) -> Result<String, Error> {
        let Some((before, after)) = text.split_once('$') else { return Ok(text.into()) };
        let (value, rest) = match after.strip_prefix('(') {
            Some(after) => {
                let close = closing(after).ok_or_else(|| Error::new(format_args!("`$(` is not closed in `{text}`")))?;
                let template = Template::read(&format!("{{{}}}", self.replace(&after[..close])?))?;
                (template.text(&Values::new())?, &after[close + 1..])
            }
            None => {
                let path = path(after);
                let value = match self.get(path)? {
                    Value::Array(_) | Value::InlineTable(_) => {
                        return Err(format!("${path} is a list or a table; it stands alone in quotes").into());
                    }
                    value => written(value),
                };
                (value, &after[path.len()..])
            }
        };
        Ok(format!("{before}{value}{}", self.replace(rest)?))
    }

    /// Returns a value with its variables replaced. In a list, a variable that is a list stands for its members.
    ///
    /// # Errors
    ///
    /// As [`replace`](Self::replace).
    pub fn value(&self, value: &Value) -> Result<Value, Error> {
        Ok(match value {
            Value::String(text) => match self.alone(text.value()) {
                Some(value) => value?.clone(),
                None => self.replace(text.value())?.into(),
            },
            Value::Array(list) => {
                let mut replaced = Array::new();
                for member in list {
                    let value = self.value(member)?;
                    match value.as_array().filter(|_| member.is_str()) {
                        Some(members) => members.iter().for_each(|member| replaced.push(member.clone())),
                        None => replaced.push(value),
                    }
                }
                replaced.into()
            }
            Value::InlineTable(table) => {
                let pairs = table.iter().map(|(key, value)| Ok((self.replace(key)?, self.value(value)?)));
                pairs.collect::<Result<InlineTable, Error>>()?.into()
            }
            other => other.clone(),
        })
    }

    /// Returns the variable that a text consists of, if it is a list or a table.
    fn alone(&self, text: &str) -> Option<Result<&Value, Error>> {
        let name = text.strip_prefix('$').filter(|name| path(name) == *name)?;
        match self.get(name) {
            Ok(Value::Array(_) | Value::InlineTable(_)) | Err(_) => Some(self.get(name)),
            Ok(_) => None,
        }
    }

    /// Returns the variables of every case of a `vary` table; the first key changes slowest.
    ///
    /// # Errors
    ///
    /// Returns what is wrong with a key's values.
    pub fn vary(&self, item: Option<&Item>, load: &Load) -> Result<Vec<Self>, Error> {
        let Some(item) = item else { return Ok(vec![self.clone()]) };
        let table = item.as_table_like().ok_or("write a table of lists, as in { rate = [\"1 kHz\", \"2 kHz\"] }")?;
        let mut cases = vec![self.clone()];
        for (name, item) in table.iter() {
            let value = whole(item)?;
            let mut next = Vec::new();
            for case in cases {
                next.extend(case.cases(&value, load)?.into_iter().map(|value| case.with(name, value)));
            }
            cases = next;
        }
        Ok(cases)
    }

    /// Returns the cases of one variable: the members of a list, of a range, or every method of a scene.
    fn cases(&self, value: &Value, load: &Load) -> Result<Vec<Value>, Error> {
        let value = self.value(value)?;
        if let Some(list) = value.as_array() {
            return Ok(list.iter().cloned().collect());
        }
        const ACCEPTED: &str =
            "write a list, a range as in { from = 10, to = 100, step = 5 }, or { methods_of = SCENE }";
        let table = value.as_inline_table().ok_or(ACCEPTED)?;
        if let Some(scene) = table.get("methods_of").and_then(Value::as_str) {
            let scene =
                load(scene, &[])?.axis().ok_or_else(|| Error::new(format_args!("{scene} is no scene of an axis")))?;
            return Ok(Method::all(&scene).into_iter().map(method).collect());
        }
        let number = |key: &str| {
            let value = table.get(key)?;
            value.as_float().or_else(|| value.as_integer().map(|number| number as f64))
        };
        match (number("from"), number("to"), number("step")) {
            (Some(from), Some(to), Some(step)) if step > 0.0 && (0.0..1e4).contains(&((to - from) / step)) => {
                let last = ((to - from) / step + 1e-9) as u32;
                Ok((0..=last).map(|at| shortest(from + f64::from(at) * step)).collect())
            }
            _ => Err(ACCEPTED.into()),
        }
    }
}

/// Returns a value of any type as it is written, a text without its quotes.
pub(super) fn written(value: &Value) -> String {
    match value {
        Value::String(text) => text.value().clone(),
        other => other.clone().decorated("", "").to_string(),
    }
}

/// Returns an item as one value: a section as a table in line, an array of sections as a list.
pub(super) fn whole(item: &Item) -> Result<Value, Error> {
    item.clone().into_value().map_err(|_| "write a value".into())
}

/// Returns a number as a value, without decimals where it has none.
fn shortest(number: f64) -> Value {
    if number.fract() == 0.0 { Value::from(number as i64) } else { Value::from(number) }
}

/// Returns a method as a table of its name and its overrides.
fn method(method: Method) -> Value {
    let set: Array = method.set.into_iter().map(|(key, value)| format!("{key}={value}")).collect();
    let pairs = [("name", Value::from(method.label)), ("set", Value::from(set))];
    pairs.into_iter().collect::<InlineTable>().into()
}

/// Returns the name at the front of a text, with the dots within it.
fn path(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '.')).unwrap_or(text.len());
    text[..end].trim_end_matches('.')
}

/// Returns the place of the bracket that closes one before the text.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 1;
    text.char_indices().find_map(|(at, letter)| {
        depth += match letter {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        (depth == 0).then_some(at)
    })
}
