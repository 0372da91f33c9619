//! Reads a study's file: its groups of lines, its claims, its sections of verbs.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use hpu_cosim::{Control, PlainName, did_you_mean, excerpt};
use hpu_farm::one_line;
use toml_edit::{Item, TableLike, Value};

use super::comparison::{Claim, Comparison, Found, Line, Shown, claimed};
use super::file::{At, File, FileErrors, join, start};
use super::summing::Statement;
use super::vary::{Variables, whole, written};
use crate::Error;
use crate::formula::Formula;
use crate::measure::{Asked, Load, Measure, Taken, Takes, Velocities, measures};
use crate::template::{Template, Values, figure};

/// A study's file, read.
pub struct Study {
    /// The lines, and the claims beside them.
    pub comparison: Comparison,
    /// The sections that call other verbs, in the order of the file.
    pub sections: Vec<Section>,
}

/// A section that calls a verb of the command.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Section {
    /// The verb.
    pub verb: String,
    /// The place of the section.
    pub place: String,
    /// Key, place and values of each option; no value for a flag.
    pub options: Vec<(String, String, Vec<String>)>,
}

/// Keys of a study beside the verbs.
const KEYS: [&str; 6] = ["name", "title", "notes", "let", "group", "claim"];

/// Reads a study. `verbs` are the sections that call other verbs, `load` makes a scene.
///
/// # Errors
///
/// Returns all errors of the file.
pub fn read(name: &str, bytes: &[u8], verbs: &[&str], load: Arc<Load>) -> Result<Study, FileErrors> {
    // The parser keeps the line ends of Windows in texts of several lines.
    let ends = bytes.iter().zip(bytes.iter().skip(1).chain([&0]));
    let bytes: Vec<u8> = ends.filter(|pair| *pair != (&b'\r', &b'\n')).map(|(byte, _)| *byte).collect();
    let (mut file, document) = File::parse(name, &bytes)?;
    let top = document.as_table();
    file.accept(top, "", &[&KEYS, verbs].concat());
    let mut vars = Variables::default();
    for (given, _) in file.tables(top, "", "let") {
        for (name, item) in given.iter() {
            let at = At { key: &join("let", name), byte: start(item.span()) };
            match whole(item).and_then(|value| vars.value(&value)) {
                Ok(value) => vars = vars.with(name, value),
                Err(error) => file.refuse(at, error),
            }
        }
    }
    let root = At { key: "", byte: 0 };
    let mut reader = Lines { file: &mut file, load, known: Arc::default(), made: HashSet::new(), lines: Vec::new() };
    for (group, byte) in reader.file.tables(top, "", "group") {
        reader.group(group, byte, &vars);
    }
    let lines = std::mem::take(&mut reader.lines);
    let mut claims = Vec::new();
    for (claim, byte) in file.tables(top, "", "claim") {
        claims.push(read_claim(&mut file, claim, At { key: "claim", byte }, &vars, &lines));
    }
    let letters: String = claims.iter().map(|claim| claim.statement.letter).collect();
    for line in &lines {
        if let Some(letter) = line.claims.chars().find(|letter| !letters.contains(*letter)) {
            file.refuse(root, format!("the line `{}` decides claim {letter}, which is not there", line.what));
        }
    }
    let notes = texts(&mut file, top, "notes", &vars);
    let comparison = Comparison {
        name: plain_name(&mut file, top, root, &vars),
        title: forever(file.string(top, root, "title", &vars, true)),
        lines,
        claims,
        notes: notes.into_iter().map(forever).collect(),
    };
    let sections = sections(&mut file, top, verbs, &vars);
    file.finish(Study { comparison, sections })
}

/// Returns the name of the study, which is that of its files.
fn plain_name(file: &mut File, top: &dyn TableLike, root: At, vars: &Variables) -> PlainName {
    let text = file.string(top, root, "name", vars, true);
    let byte = top.get("name").map_or(root.byte, |item| start(item.span()));
    text.parse().unwrap_or_else(|why| {
        // A name that is missing is refused already.
        file.refuse(At { key: "name", byte }, format!("`{}` is {why}", excerpt(&text)));
        PlainName::near(&text)
    })
}

/// A study is read once a process, and is there until its end.
fn forever(text: String) -> &'static str {
    text.leak()
}

fn texts(file: &mut File, table: &dyn TableLike, name: &str, vars: &Variables) -> Vec<String> {
    let Some(item) = table.get(name) else { return Vec::new() };
    let list = item.as_array().and_then(|list| list.iter().map(Value::as_str).collect::<Option<Vec<_>>>());
    let texts = list.ok_or_else(|| Error::from("write a list of texts"));
    let texts = texts.and_then(|texts| texts.into_iter().map(|text| vars.replace(text)).collect());
    texts.unwrap_or_else(|error| file.refused(At { key: name, byte: start(item.span()) }, error))
}

/// The results of the measures, by their questions; lines with the same question share a result.
type Known = Arc<Mutex<HashMap<String, Arc<Mutex<Option<Values>>>>>>;

/// One measure of a line.
struct Part {
    name: String,
    measure: &'static Measure,
    scene: String,
    set: Vec<(String, String)>,
    options: BTreeMap<&'static str, Taken>,
}

impl Part {
    /// Returns the velocities that the measure compares, if it compares some.
    fn shown(&self, load: &Arc<Load>) -> Option<Shown> {
        if self.measure.name != "velocity" {
            return None;
        }
        let (load, scene, set, options) =
            (Arc::clone(load), self.scene.clone(), self.set.clone(), self.options.clone());
        let window_s = match self.options.get("shown") {
            Some(Taken::Numbers(window)) => <[f64; 2]>::try_from(window.as_slice()).ok(),
            _ => None,
        };
        let run = move |control: &Control| {
            Velocities::of(&Asked { scene: &scene, set: &set, options: &options, load: &*load }, control)
        };
        Some(Shown { window_s, run: Box::new(run) })
    }

    /// Adds the measure's values; returns `None` if it was stopped.
    fn add(&self, values: &mut Values, known: &Known, load: &Load, control: &Control) -> Option<()> {
        let Self { name, measure, scene, set, options } = self;
        let asked = format!("{} {scene} {set:?} {options:?}", measure.name);
        let own = Arc::clone(known.lock().unwrap_or_else(PoisonError::into_inner).entry(asked).or_default());
        let mut own = own.lock().unwrap_or_else(PoisonError::into_inner);
        if own.is_none() {
            let made = measure.values(&Asked { scene, set, options, load }, control);
            if control.stop.load(Ordering::Relaxed) {
                return None;
            }
            *own = Some(made);
        }
        for (value, found) in own.iter().flatten() {
            values.insert(format!("{name}.{value}"), found.clone());
        }
        Some(())
    }
}

struct Lines<'f, 'a> {
    file: &'f mut File<'a>,
    load: Arc<Load>,
    known: Known,
    /// Scenes under overrides that were made once, to see that they can be.
    made: HashSet<String>,
    lines: Vec<Line>,
}

impl Lines<'_, '_> {
    fn varied(&mut self, table: &dyn TableLike, path: &str, vars: &Variables) -> Vec<Variables> {
        let item = table.get("vary");
        vars.vary(item, &*self.load).unwrap_or_else(|error| {
            let byte = item.map_or(0, |item| start(item.span()));
            self.file.refused(At { key: &join(path, "vary"), byte }, error)
        })
    }

    fn group(&mut self, table: &dyn TableLike, byte: usize, vars: &Variables) {
        let at = At { key: "group", byte };
        self.file.accept(table, "group", &["name", "vary", "line"]);
        for vars in self.varied(table, "group", vars) {
            let group = forever(self.file.string(table, at, "name", &vars, true));
            for (line, byte) in self.file.tables(table, "group", "line") {
                const KEYS: [&str; 7] = ["what", "published", "claims", "vary", "measure", "text", "figures"];
                self.file.accept(line, "group.line", &KEYS);
                for vars in self.varied(line, "group.line", &vars) {
                    let line = self.line(group, line, At { key: "group.line", byte }, &vars);
                    self.lines.push(line);
                }
            }
        }
    }

    fn line(&mut self, group: &'static str, table: &dyn TableLike, at: At, vars: &Variables) -> Line {
        let mut parts = Vec::new();
        for (all, _) in self.file.tables(table, at.key, "measure") {
            for (name, item) in all.iter() {
                parts.extend(self.part(name, item, vars));
            }
        }
        let template = self.file.template(table, at, "text", vars);
        let text_at = At { key: "group.line.text", byte: table.get("text").map_or(at.byte, |item| start(item.span())) };
        let mut unknown = None;
        template.names(&mut |name| unknown = unknown.take().or_else(|| refusal(name, &parts)));
        let mut figures = Vec::new();
        for (all, _) in self.file.tables(table, at.key, "figures") {
            for (name, item) in all.iter() {
                let at = At { key: &join("group.line.figures", name), byte: start(item.span()) };
                match named_formulas(name, item, vars) {
                    Ok(formulas) => figures.extend(formulas),
                    Err(error) => self.file.refuse(at, error),
                }
            }
        }
        for (_, formula) in &figures {
            formula.names(&mut |name| unknown = unknown.take().or_else(|| refusal(name, &parts)));
        }
        if let Some(reason) = unknown {
            self.file.refuse(text_at, reason);
        }
        let (names, formulas): (Vec<_>, Vec<_>) = figures.into_iter().unzip();
        let shown = parts.iter().find_map(|part| part.shown(&self.load));
        let (load, known) = (Arc::clone(&self.load), Arc::clone(&self.known));
        let measure = move |control: &Control| {
            let mut values = Values::new();
            for part in &parts {
                part.add(&mut values, &known, &*load, control)?;
            }
            (!control.stop.load(Ordering::Relaxed)).then(|| found(&template, &formulas, &values))
        };
        Line {
            group,
            what: self.file.string(table, at, "what", vars, true),
            published: forever(self.file.string(table, at, "published", vars, false)),
            claims: forever(self.file.string(table, at, "claims", vars, false)),
            figures: names,
            vars: vars.clone(),
            measure: Box::new(measure),
            shown,
        }
    }

    /// Reads a measure.
    fn part(&mut self, name: &str, item: &Item, vars: &Variables) -> Option<Part> {
        let path = join("group.line.measure", name);
        let at = At { key: &path, byte: start(item.span()) };
        let names = measures().map(|measure| measure.name).collect::<Vec<_>>();
        let Some(table) = item.as_table_like() else {
            return self.file.refused(at, "write a table, as in { measure = \"run\", scene = \"hybrid-wall\" }");
        };
        let kind = self.file.string(table, at, "measure", vars, true);
        let Some(measure) = measures().find(|measure| measure.name == kind) else {
            let reason = format!("no measure \"{kind}\"; one of {}{}", names.join(", "), did_you_mean(&kind, &names));
            return self.file.refused(at, reason);
        };
        let own = measure.keys.iter().map(|key| key.name);
        let scene_keys = if measure.is_of_scene { &["scene", "set"][..] } else { &[] };
        let accepted: Vec<_> = ["measure"].into_iter().chain(scene_keys.iter().copied()).chain(own).collect();
        self.file.accept(table, &path, &accepted);
        let scene = if measure.is_of_scene { self.file.string(table, at, "scene", vars, true) } else { String::new() };
        let mut take = |name: &str, takes: Takes, needed: bool| -> Option<Taken> {
            let item = table.get(name);
            let taken = match item.map(|item| item.as_value().and_then(|value| taken(takes, value, vars).transpose())) {
                None if !needed => return None,
                None => Err(Error::new(format_args!("missing; {}", takes.accepted()))),
                Some(Some(Ok(value))) => return Some(value),
                Some(Some(Err(error))) => Err(error),
                Some(None) => Err(takes.accepted().into()),
            };
            let byte = item.map_or(at.byte, |item| start(item.span()));
            taken.unwrap_or_else(|error| self.file.refused(At { key: &join(&path, name), byte }, error))
        };
        let set = match take("set", Takes::Set, false) {
            Some(Taken::Set(set)) => set,
            _ => Vec::new(),
        };
        let options =
            measure.keys.iter().filter_map(|key| Some((key.name, take(key.name, key.takes, key.is_required)?)));
        let options = options.collect();
        if measure.is_of_scene
            && !scene.is_empty()
            && self.made.insert(format!("{scene} {set:?}"))
            && let Err(error) = (self.load)(&scene, &set)
        {
            self.file.refuse(at, error);
        }
        Some(Part { name: name.into(), measure, scene, set, options })
    }
}

/// Returns text and figures of a line.
fn found(template: &Template, figures: &[Formula], values: &Values) -> Result<Found, Error> {
    let text = template.text(values)?;
    let figures = figures.iter().map(|formula| figure(formula, values)).collect::<Result<Vec<_>, _>>()?;
    Ok(Found::new(one_line(text), figures))
}

/// Returns why no measure gives a value of this name; `None` if one does.
fn refusal(name: &str, parts: &[Part]) -> Option<String> {
    let gives = |part: &Part| {
        let windows = match part.options.get("swing") {
            Some(Taken::Windows(windows)) => windows.as_slice(),
            _ => &[],
        };
        let own = part.measure.gives.iter().copied().chain(windows.iter().map(|(name, _)| name.as_str()));
        own.map(|value| format!("{}.{value}", part.name)).collect::<Vec<_>>()
    };
    let known: Vec<String> = parts.iter().flat_map(gives).collect();
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    (!known.contains(&name))
        .then(|| format!("no value {name}; the measures give {}{}", known.join(", "), did_you_mean(name, &known)))
}

/// Reads a figure: a formula, or a list of them under one name.
fn named_formulas(name: &str, item: &Item, vars: &Variables) -> Result<Vec<(String, Formula)>, Error> {
    let name = vars.replace(name)?;
    formulas(item, vars)?.into_iter().map(|formula| Ok((name.clone(), formula))).collect()
}

fn formulas(item: &Item, vars: &Variables) -> Result<Vec<Formula>, Error> {
    const ACCEPTED: &str = "write a formula in quotes, or a list of them";
    let texts = match item.as_value() {
        Some(Value::String(text)) => vec![text.value().as_str()],
        Some(Value::Array(list)) => list.iter().map(Value::as_str).collect::<Option<_>>().ok_or(ACCEPTED)?,
        _ => return Err(ACCEPTED.into()),
    };
    texts.into_iter().map(|text| Formula::read(&vars.replace(text)?)).collect()
}

/// Returns a key's value; `None` if it is of another type.
fn taken(takes: Takes, value: &Value, vars: &Variables) -> Result<Option<Taken>, Error> {
    let value = vars.value(value)?;
    let list =
        |value: &Value| value.as_array().map(|list| list.iter().map(number).collect::<Result<Option<Vec<_>>, _>>());
    Ok(match takes {
        Takes::Number => number(&value)?.map(Taken::Number),
        Takes::Text => value.as_str().map(|text| Taken::Text(text.into())),
        Takes::Flag => value.as_bool().map(Taken::Flag),
        Takes::Numbers => list(&value).transpose()?.flatten().map(Taken::Numbers),
        Takes::Set => {
            let pair = |value: &Value| {
                let (key, value) = value.as_str()?.split_once('=')?;
                Some((key.trim().to_string(), value.trim().to_string()))
            };
            value.as_array().and_then(|list| list.iter().map(pair).collect::<Option<_>>()).map(Taken::Set)
        }
        Takes::Windows => {
            let Some(table) = value.as_inline_table() else { return Ok(None) };
            let mut windows = Vec::new();
            for (name, value) in table.iter() {
                let Some(Some(ends)) = list(value).transpose()? else { return Ok(None) };
                let Ok(ends) = <[f64; 2]>::try_from(ends) else { return Ok(None) };
                windows.push((name.to_string(), ends));
            }
            Some(Taken::Windows(windows))
        }
    })
}

/// Returns a number, or the value of a formula in quotes.
fn number(value: &Value) -> Result<Option<f64>, Error> {
    Ok(match value {
        Value::Integer(number) => Some(*number.value() as f64),
        Value::Float(number) => Some(*number.value()),
        Value::String(text) => Some(figure(&Formula::read(text.value())?, &Values::new())?),
        _ => None,
    })
}

fn read_claim(file: &mut File, table: &dyn TableLike, at: At, vars: &Variables, lines: &[Line]) -> Claim {
    file.accept(table, at.key, &["letter", "paper", "place", "means", "holds", "by"]);
    let [letter, paper, place, means] =
        ["letter", "paper", "place", "means"].map(|name| forever(file.string(table, at, name, vars, true)));
    let by = table.get("by").map(|_| file.string(table, at, "by", vars, true));
    let holds = table.get("holds").map(|item| {
        let at = At { key: "claim.holds", byte: start(item.span()) };
        formulas(item, vars).unwrap_or_else(|error| file.refused(at, error))
    });
    let claim = Claim { statement: Statement { letter, paper, place, means }, holds: holds.unwrap_or_default(), by };
    let own: Vec<&Line> = lines.iter().filter(|line| line.claims.contains(letter)).collect();
    if own.is_empty() {
        file.refuse(at, format!("no line decides claim {letter}; name it in a line's claims"));
    }
    // Figures of 0 show whether every name is there.
    let zeros: Vec<Found> = own.iter().map(|line| Found::new(String::new(), vec![0.0; line.figures.len()])).collect();
    if let Err(error) = claimed(&claim, &own, &zeros.iter().collect::<Vec<_>>()) {
        file.refuse(at, error);
    }
    claim
}

/// Reads the sections that call other verbs.
fn sections(file: &mut File, top: &dyn TableLike, verbs: &[&str], vars: &Variables) -> Vec<Section> {
    let mut sections = Vec::new();
    for (verb, _) in top.iter().filter(|(name, _)| verbs.contains(name)) {
        for (table, byte) in file.tables(top, "", verb) {
            let mut options = Vec::new();
            for (key, item) in table.iter() {
                let at = At { key: &join(verb, key), byte: start(item.span()) };
                match whole(item).and_then(|value| vars.value(&value)) {
                    Ok(Value::Boolean(flag)) if !*flag.value() => {}
                    Ok(Value::Boolean(_)) => options.push((key.to_string(), file.place(at.byte), Vec::new())),
                    Ok(Value::Array(list)) => {
                        options.push((key.to_string(), file.place(at.byte), list.iter().map(written).collect()));
                    }
                    Ok(value) => options.push((key.to_string(), file.place(at.byte), vec![written(&value)])),
                    Err(error) => file.refuse(at, error),
                }
            }
            sections.push((byte, Section { verb: verb.into(), place: file.place(byte), options }));
        }
    }
    sections.sort_by_key(|(byte, _)| *byte);
    sections.into_iter().map(|(_, section)| section).collect()
}
