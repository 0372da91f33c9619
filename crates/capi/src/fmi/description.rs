//! `modelDescription.xml`.

use super::unit::{Causality, Kind, Unit, Variable};

/// The units of variables, as FMI describes them: exponents of base units.
const UNITS: [(&str, &str); 13] = [
    ("s", "s=\"1\""),
    ("rad", "rad=\"1\""),
    ("rad/s", "rad=\"1\" s=\"-1\""),
    ("m", "m=\"1\""),
    ("m/s", "m=\"1\" s=\"-1\""),
    ("N", "kg=\"1\" m=\"1\" s=\"-2\""),
    ("N/m", "kg=\"1\" s=\"-2\""),
    ("N.s/m", "kg=\"1\" s=\"-1\""),
    ("N.m", "kg=\"1\" m=\"2\" s=\"-2\""),
    ("N.m/rad", "kg=\"1\" m=\"2\" s=\"-2\" rad=\"-1\""),
    ("N.m.s/rad", "kg=\"1\" m=\"2\" s=\"-1\" rad=\"-1\""),
    ("J", "kg=\"1\" m=\"2\" s=\"-2\""),
    ("A", "A=\"1\""),
];

/// Escapes a text for an attribute.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            letter if letter.is_control() => out.push(' '),
            letter => out.push(letter),
        }
    }
    out
}

/// Returns the description of a unit. `stop_s` is the end of its scene.
pub(super) fn model_description(unit: &Unit, name: &str, token: &str, stop_s: f64) -> String {
    let about = match unit.kind {
        Kind::Plant => "the plant of a haptic FPGA loop: gates in, encoder lines out",
        Kind::Loop => "a haptic FPGA loop",
    };
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"3.0\" modelName=\"{}\" instantiationToken=\"{token}\" \
         description=\"{about}\" generationTool=\"hpu {}\" variableNamingConvention=\"flat\">\n\
         <CoSimulation modelIdentifier=\"hpu\" canHandleVariableCommunicationStepSize=\"true\" \
         canBeInstantiatedOnlyOncePerProcess=\"false\" canGetAndSetFMUState=\"true\" \
         canReturnEarlyAfterIntermediateUpdate=\"false\" hasEventMode=\"true\"/>\n<UnitDefinitions>\n",
        escaped(name),
        env!("CARGO_PKG_VERSION"),
    );
    for (unit, base) in UNITS {
        xml += &format!("<Unit name=\"{unit}\"><BaseUnit {base}/></Unit>\n");
    }
    xml += "</UnitDefinitions>\n<LogCategories><Category name=\"logStatusError\" description=\"Why a call failed\"/>\
            </LogCategories>\n";
    xml += &format!("<DefaultExperiment startTime=\"0\" stopTime=\"{stop_s:?}\"/>\n<ModelVariables>\n");
    for (reference, variable) in unit.variables().iter().enumerate() {
        xml += &described(reference, variable);
    }
    xml += "</ModelVariables>\n<ModelStructure>\n";
    for element in ["Output", "InitialUnknown"] {
        let outputs = unit.variables().iter().enumerate();
        for (reference, _) in outputs.filter(|(_, variable)| variable.causality == Causality::Output) {
            xml += &format!("<{element} valueReference=\"{reference}\"/>\n");
        }
    }
    xml + "</ModelStructure>\n</fmiModelDescription>\n"
}

fn described(reference: usize, variable: &Variable) -> String {
    let Variable { name, causality, is_word, unit, doc, start } = variable;
    let kind = if *is_word { "Int64" } else { "Float64" };
    let causality = match causality {
        Causality::Time => "causality=\"independent\" variability=\"continuous\"".to_string(),
        Causality::Parameter => format!("causality=\"parameter\" variability=\"fixed\" start=\"{start:?}\""),
        Causality::Tunable => format!("causality=\"parameter\" variability=\"tunable\" start=\"{start:?}\""),
        Causality::Input => format!("causality=\"input\" variability=\"discrete\" start=\"{start}\""),
        Causality::Output if *is_word => "causality=\"output\" variability=\"discrete\"".to_string(),
        Causality::Output => "causality=\"output\" variability=\"continuous\"".to_string(),
    };
    // FMI gives units to real numbers alone.
    let is_known = !is_word && UNITS.iter().any(|(known, _)| known == unit);
    let unit = if is_known { format!(" unit=\"{unit}\"") } else { String::new() };
    format!(
        "<{kind} name=\"{}\" valueReference=\"{reference}\" description=\"{}\" {causality}{unit}/>\n",
        escaped(name),
        escaped(doc)
    )
}
