//! The file of a unit: description, library, and the scene as a resource.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::io::{Cursor, Write};
use std::path::Path;

use hpu_cosim::{SceneFile, read_plain};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::description::model_description;
use super::unit::{Kind, Unit};
use crate::error::{Error, Status};

/// The resource with the scene.
const SCENE: &str = "scene.toml";
/// The resource that says what of the scene the unit is: the kind, the token, then a changed key a line.
const EXPORT: &str = "export.txt";

/// A scene to be exported.
pub struct Export<'a> {
    /// The part of it that becomes the unit.
    pub kind: Kind,
    /// The name of the model.
    pub name: &'a str,
    /// The text of the scene.
    pub text: &'a str,
    /// Keys and values that replace those of the text.
    pub set: &'a [(String, String)],
    /// The data files that the scene names, by those names.
    pub files: &'a [(String, Vec<u8>)],
    /// The shared library `libhpu`, of each system that the unit is for.
    pub libraries: &'a [Vec<u8>],
}

/// Returns the place of a shared library in a unit, by the system and the processor that its first bytes name; `None`
/// for a file that is no library for Linux, Windows or macOS on x86-64 or aarch64.
fn place(library: &[u8]) -> Option<&'static str> {
    let number = |at: usize| Some(u16::from_le_bytes(library.get(at..at + 2)?.try_into().ok()?));
    // ELF and Mach-O of 64 bits, the lowest byte first; a program of Windows says where its own header is.
    if library.starts_with(b"\x7fELF\x02\x01") {
        return match number(18)? {
            62 => Some("x86_64-linux/hpu.so"),
            183 => Some("aarch64-linux/hpu.so"),
            _ => None,
        };
    }
    if library.starts_with(b"MZ") {
        let at = usize::from(number(60)?);
        let is_64 = library.get(at..at + 4)? == b"PE\0\0" && number(at + 4)? == 0x8664;
        return is_64.then_some("x86_64-windows/hpu.dll");
    }
    match library.get(..8)? {
        b"\xcf\xfa\xed\xfe\x07\0\0\x01" => Some("x86_64-darwin/hpu.dylib"),
        b"\xcf\xfa\xed\xfe\x0c\0\0\x01" => Some("aarch64-darwin/hpu.dylib"),
        _ => None,
    }
}

/// Returns the archive of a unit. The same scene gives the same bytes.
///
/// # Errors
///
/// [`Status::Refused`] when the scene is refused or has no such unit, or names a file outside its folder, or when a
/// library is for no system or for the same one as another.
pub fn archive(export: &Export, file: &SceneFile) -> Result<Vec<u8>, Error> {
    let Export { kind, name, text, set, files, libraries } = export;
    let refused = |why: &dyn std::fmt::Display| Error::new(Status::Refused, why);
    let unit = Unit::open(*kind, file.clone(), set.to_vec())?;
    let mut hasher = DefaultHasher::new();
    (kind.name(), text, set, files, env!("CARGO_PKG_VERSION")).hash(&mut hasher);
    let token = format!("{{{:016x}}}", hasher.finish());
    let mut said = format!("{}\n{token}\n", kind.name());
    for (key, value) in *set {
        if value.contains('\n') {
            return Err(refused(&format!("--set {key}: a unit carries values of one line")));
        }
        said += &format!("{key}={value}\n");
    }
    let description = model_description(&unit, name, &token, unit.end_s());
    let mut parts: Vec<(String, &[u8])> = vec![
        ("modelDescription.xml".into(), description.as_bytes()),
        (format!("resources/{SCENE}"), text.as_bytes()),
        (format!("resources/{EXPORT}"), said.as_bytes()),
    ];
    for (at, library) in (1..).zip(*libraries) {
        let found = place(library).map(|place| format!("binaries/{place}"));
        let place = found.ok_or_else(|| {
            let all = libraries.len();
            refused(&format!("library {at} of {all} is no library for Linux, Windows or macOS of 64 bits"))
        })?;
        if parts.iter().any(|(other, _)| *other == place) {
            return Err(refused(&format!("{place}: two libraries are for this system")));
        }
        parts.push((place, library));
    }
    for (place, bytes) in *files {
        let is_inside = Path::new(place).components().all(|part| matches!(part, std::path::Component::Normal(_)));
        if !is_inside || [SCENE, EXPORT].contains(&place.as_str()) {
            return Err(refused(&format!("{place}: a unit carries files in the scene's folder alone")));
        }
        parts.push((format!("resources/{place}"), bytes));
    }
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    for (place, bytes) in parts {
        let options = options.unix_permissions(0o644);
        writer.start_file(place, options).map_err(|error| refused(&error))?;
        writer.write_all(bytes).map_err(|error| refused(&error))?;
    }
    Ok(writer.finish().map_err(|error| refused(&error))?.into_inner())
}

/// Opens the unit that the resources in a folder describe.
///
/// # Errors
///
/// [`Status::Refused`] when they are not those of a unit with this token.
pub(super) fn opened(folder: &Path, token: &str) -> Result<Unit, Error> {
    let refused = |why: &dyn std::fmt::Display| Error::new(Status::Refused, why);
    let text = |name: &str| -> Result<String, Error> {
        let place = folder.join(name);
        let bytes = read_plain(&place).map_err(|error| refused(&format!("{}: {error}", place.display())))?;
        String::from_utf8(bytes).map_err(|error| refused(&format!("{}: {error}", place.display())))
    };
    let said = text(EXPORT)?;
    let mut lines = said.lines();
    let kind = match lines.next() {
        Some("plant") => Kind::Plant,
        Some("loop") => Kind::Loop,
        _ => return Err(refused(&format!("{EXPORT}: neither plant nor loop"))),
    };
    if lines.next() != Some(token) {
        return Err(refused(&"the instantiation token is that of another unit"));
    }
    let pair = |line: &str| line.split_once('=').map(|(key, value)| (key.to_string(), value.to_string()));
    let set: Option<Vec<_>> = lines.map(pair).collect();
    let set = set.ok_or_else(|| refused(&format!("{EXPORT}: a line without KEY=VALUE")))?;
    let name = folder.join(SCENE).display().to_string();
    let file = SceneFile { name, text: text(SCENE)?, data: folder.to_path_buf(), is_shipped: false };
    Unit::open(kind, file, set)
}
