//! Values of generics, written as the defaults of an entity: so they have any type, in simulation and synthesis alike.

use std::collections::BTreeMap;

use hpu_cosim::scene::{Dut, Generic};
use hpu_cosim::script::{Script, Vhdl};

use super::interface::{Interface, of_text};
use super::text::plain;
use super::types::{Type, Types};
use crate::dut::files::refuses;
use crate::engines::error::Error;
use crate::engines::tool::Tool;

/// Writes the values of a design's generics into the declaration of its topmost entity. The other lines stay where they
/// are. A design without that entity stays as it is.
pub(super) fn set(dut: &mut Dut) -> Result<(), Error> {
    let texts: Vec<_> = dut.files.iter().map(|(_, content)| plain(content)).collect();
    let found = texts.iter().enumerate().find_map(|(file, text)| Some((file, of_text(text, &dut.top)?)));
    let Some((file, interface)) = found else { return Ok(()) };
    let types = Types::of(texts.iter().map(String::as_str));
    let mut places: BTreeMap<(usize, usize), String> = BTreeMap::new();
    for (name, given) in &dut.generics {
        let Some(item) = interface.generics.iter().find(|item| item.name.eq_ignore_ascii_case(name)) else {
            let all: Vec<_> = interface.generics.iter().map(|generic| generic.name.as_str()).collect();
            let all = if all.is_empty() { "none".to_string() } else { all.join(", ") };
            return Err(refuses(Tool::Ghdl, dut, format!("`{}` has no generic `{name}`; it has {all}", dut.top)));
        };
        places.insert((item.place.start, item.place.end), String::new());
        let _ = value(&item.kind, &types, given).map_err(|why| Error::generic(name, why))?;
    }
    for ((start, end), text) in &mut places {
        *text = redeclared(dut, &interface, &types, *start)?;
        // What follows stays on its line.
        text.extend(texts[file][*start..*end].matches('\n'));
    }
    let mut content = dut.files[file].1.to_vec();
    for ((start, end), text) in places.into_iter().rev() {
        content.splice(start..end, text.into_bytes());
    }
    dut.files[file].1 = content.into();
    dut.generics.clear();
    Ok(())
}

/// Returns the generics that are declared together at a place, each with its value or its default.
fn redeclared(dut: &Dut, interface: &Interface, types: &Types, start: usize) -> Result<String, Error> {
    let mut all = Vec::new();
    for item in interface.generics.iter().filter(|item| item.place.start == start) {
        let given = dut.generics.iter().find(|(name, _)| name.eq_ignore_ascii_case(&item.name));
        let value = match given {
            Some((name, given)) => {
                Some(value(&item.kind, types, given).map_err(|why| Error::generic(name, why))?.to_string())
            }
            None => item.default.clone(),
        };
        let value = value.map_or_else(String::new, |value| format!(" := {value}"));
        all.push(format!("{} : {}{value}", item.name, item.kind));
    }
    Ok(all.join("; "))
}

/// Returns a value as an expression of a subtype, or why it is none.
pub(crate) fn value(subtype: &str, types: &Types, value: &Generic) -> Result<Script<Vhdl>, String> {
    let (name, kind) = types.find(subtype);
    let is = |write: &str| Err(format!("`{value}` is no value of the type {subtype}; write {write}"));
    let expression = |text: &str| Script::<Vhdl>::expression(text).map_err(|why| why.to_string());
    let bits = |text: &str| {
        let text = text.replace('_', "");
        (!text.is_empty() && text.chars().all(|c| "01XZUWLH-".contains(c))).then(|| Script::<Vhdl>::text(&text))
    };
    match (&*name, value) {
        ("integer" | "natural" | "positive", Generic::Flag(_) | Generic::Real(_)) => is("a whole number"),
        ("boolean", Generic::Integer(_) | Generic::Real(_)) => is("true or false"),
        ("real", Generic::Integer(number)) => expression(&format!("{number}.0")),
        ("real", Generic::Flag(_)) => is("a number"),
        ("string", Generic::Text(text)) => Ok(Script::<Vhdl>::text(text)),
        ("string", _) => is("a text"),
        ("time" | "delay_length", Generic::Text(text)) => {
            // VHDL wants a blank before the unit.
            let digits = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
            let (number, unit) = text.split_at(digits);
            let is_one = ["fs", "ps", "ns", "us", "ms", "sec", "min", "hr"].contains(&unit.trim());
            expression(&if is_one { format!("{} {unit}", number.trim()) } else { text.clone() })
        }
        ("time" | "delay_length", _) => is("a time, as in \"5 us\""),
        ("character", Generic::Text(text)) if text.len() == 1 => expression(&format!("'{text}'")),
        ("character", Generic::Integer(0..=9)) => expression(&format!("'{value}'")),
        ("std_logic" | "std_ulogic" | "bit", Generic::Text(text)) if text.len() == 1 => {
            expression(&format!("'{text}'"))
        }
        ("std_logic" | "std_ulogic" | "bit", Generic::Integer(0 | 1)) => expression(&format!("'{value}'")),
        ("std_logic" | "std_ulogic" | "bit", Generic::Flag(flag)) => expression(&format!("'{}'", u8::from(*flag))),
        ("std_logic" | "std_ulogic" | "bit", Generic::Integer(_) | Generic::Real(_)) => is("0 or 1"),
        (
            "std_logic_vector" | "std_ulogic_vector" | "bit_vector" | "unsigned" | "signed" | "u_unsigned" | "u_signed"
            | "sfixed" | "ufixed" | "u_sfixed" | "u_ufixed",
            value,
        ) => match value {
            Generic::Text(text) => bits(text).map_or_else(|| expression(text), Ok),
            _ => is("its bits, as in \"0101\", or an expression, as in \"x\\\"1F\\\"\""),
        },
        _ => match (kind, value) {
            (Some(Type::Enumeration(literals)), Generic::Text(text)) => {
                let quoted = format!("'{text}'");
                let found = literals.iter().find(|literal| literal.eq_ignore_ascii_case(text) || **literal == quoted);
                // Any other text is an expression, such as the name of a constant.
                expression(found.unwrap_or(text))
            }
            (Some(Type::Enumeration(literals)), _) => is(&format!("one of {}", literals.join(", "))),
            _ => expression(&value.to_string()),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use hpu_cosim::scene::{Dut, Identifier, Language};

    use super::*;

    #[test]
    fn a_value_is_written_in_its_generic_s_type_or_refused_with_what_is_accepted() {
        let types = Types::of(["type mode is (idle, run); subtype gain is real range 0.0 to 1.0;"]);
        let text = |text: &str| Generic::Text(text.to_string());
        let written = |kind: &str, given: &Generic| value(kind, &types, given).map(|script| script.to_string());
        for (kind, given, wanted) in [
            ("real", Generic::real(0.5), "5.0e-1"),
            ("gain", Generic::Integer(1), "1.0"),
            ("time", text("5us"), "5 us"),
            ("string(1 to 3)", text("a\"b"), "\"a\"\"b\""),
            ("std_logic_vector(3 downto 0)", text("01_01"), "\"0101\""),
            ("ieee.numeric_std.unsigned", text("x\"1F\""), "x\"1F\""),
            ("std_logic", Generic::Integer(1), "'1'"),
            ("character", text("x"), "'x'"),
            ("work.p.mode", text("RUN"), "run"),
            ("boolean", Generic::Flag(true), "true"),
            ("integer range 0 to 7", Generic::Integer(-3), "-3"),
        ] {
            assert_eq!(written(kind, &given), Ok(wanted.to_string()), "{kind}");
        }
        for (kind, given, says) in [
            ("mode", Generic::Integer(1), "one of idle, run"),
            ("natural", Generic::real(0.5), "a whole number"),
            ("time", Generic::Integer(5), "\"5 us\""),
            ("unsigned(3 downto 0)", Generic::Integer(5), "\"0101\""),
            ("real", text("1.0; end"), "no expression"),
        ] {
            assert!(written(kind, &given).is_err_and(|why| why.contains(says)), "{kind}");
        }
    }

    #[test]
    fn values_replace_defaults_and_no_line_moves() {
        let text = "entity t is generic (A, B : real := 1.0; -- é\n C\n : integer); port (x : in bit);\nend;";
        let name = |name: &str| Identifier::new(Language::Vhdl, name).expect("a name");
        let mut dut = Dut {
            files: vec![("t.vhd".to_string(), Arc::from(text.as_bytes()))],
            top: name("T"),
            generics: vec![(name("b"), Generic::Integer(2)), (name("C"), Generic::Integer(7))],
            ..Dut::pins()
        };
        set(&mut dut).expect("it has both");
        let made = String::from_utf8(dut.files[0].1.to_vec()).expect("text");
        let wanted = "entity t is generic (A : real := 1.0; B : real := 2.0; -- é\n C : integer := 7\n); port (x : in \
                      bit);\nend;";
        assert_eq!(made, wanted);
    }
}
