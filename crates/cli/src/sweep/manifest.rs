//! The manifest of a wave: everything that the rows of its shards depend on, so that a shard is a function of the
//! manifest and its own number.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hpu_farm::Points;
use hpu_rtl::system;
use hpu_rtl::temporary::{self, Temporary, sweep_files};
use hpu_study::map::SceneText;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::work::work;
use crate::shell::sha256::hex;
use crate::shell::{Failure, program, sha256};
use crate::work::{Find, Source, Work};

/// The version of the manifest's format.
const FORMAT: u64 = 3;

/// Most points of a shard.
pub(crate) const MOST_POINTS: u64 = 1_000_000;

/// Most shards of a wave. A folder holds hardly more files.
const MOST_SHARDS: u64 = 10_000_000;

/// The key of the checksum over the whole manifest.
const SUM: &str = "manifest_sha256";

/// A wave of a sweep.
#[derive(Clone, Debug)]
pub(crate) struct Manifest {
    /// The number of the wave, from 1.
    pub wave: usize,
    /// The version of the program that planned the sweep.
    pub version: String,
    /// The [fingerprint](program::fingerprint) of that program.
    pub program: String,
    /// Name and text of the study.
    pub study: (String, String),
    /// The verb that the points belong to, and its words.
    pub verb: String,
    /// The words of the verb.
    pub words: Vec<String>,
    /// The command that runs the same points on one machine.
    pub command: String,
    /// The scenes, as the command names them.
    pub scenes: Vec<(String, SceneText)>,
    /// The points of the wave.
    pub points: Points,
    /// Number of points of a shard; the last one may have fewer.
    pub shard_points: u64,
    /// Name, type and unit or meaning of each column of the files.
    pub columns: Vec<[String; 3]>,
}

/// A manifest that was read, with the SHA-256 of its text.
pub(crate) struct Planned {
    /// The manifest.
    pub manifest: Manifest,
    /// The folder of the sweep.
    pub dir: PathBuf,
    /// SHA-256 of the manifest's text.
    pub sum: String,
    /// The number of bytes of the manifest's text.
    pub bytes: usize,
}

/// Returns the SHA-256 of parts, each after its length.
fn hashed<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hex(&hash.finalize())
}

impl Manifest {
    /// Returns the SHA-256 of the settings that rows depend on beside the program: the verb's words, and its scenes
    /// with their data files.
    pub fn settings(&self) -> String {
        let words = [self.verb.as_bytes()].into_iter().chain(self.words.iter().map(String::as_bytes));
        let scenes = self.scenes.iter().flat_map(|(name, scene)| {
            let files = scene.files.iter().flat_map(|(name, bytes)| [name.as_bytes(), bytes]);
            [name.as_bytes(), scene.text.as_bytes()].into_iter().chain(files)
        });
        hashed(words.chain(scenes))
    }

    /// Returns the number of shards.
    pub fn shards(&self) -> u64 {
        self.points.count().div_ceil(self.shard_points)
    }

    /// Returns the numbers of a shard's points.
    pub fn shard(&self, index: u64) -> Vec<u64> {
        self.points.slice(index * self.shard_points, self.shard_points)
    }

    fn text(&self) -> String {
        let scenes = self.scenes.iter().map(|(name, scene)| {
            let files: BTreeMap<&String, String> = scene.files.iter().map(|(name, bytes)| (name, hex(bytes))).collect();
            json!({ "name": name, "file": scene.name, "text": scene.text, "files": files })
        });
        let columns = self.columns.iter().map(|[key, kind, unit]| json!({ "key": key, "type": kind, "unit": unit }));
        let mut object = json!({
            "sweep": FORMAT,
            "version": self.version,
            "program_xxh128": self.program,
            "settings_sha256": self.settings(),
            "study": { "name": self.study.0, "text": self.study.1 },
            "verb": self.verb,
            "words": self.words,
            "command": self.command,
            "scenes": scenes.collect::<Vec<_>>(),
            "wave": self.wave,
            "points": self.points.count(),
            "runs": self.points.runs(),
            "shard_points": self.shard_points,
            "shards": self.shards(),
            "columns": columns.collect::<Vec<_>>(),
        });
        object[SUM] = sum(&object).into();
        // One run a line would make the manifest of a refined wave several times as long.
        let mut text = format!("{object:#}\n");
        let runs = serde_json::to_string(self.points.runs()).expect("numbers are JSON");
        if let (Some(from), Some(to)) = (text.find("\n  \"runs\": ["), text.find("\n  \"scenes\":")) {
            text.replace_range(from..to, &format!("\n  \"runs\": {runs},"));
        }
        text
    }

    fn parse(text: &str) -> Option<Self> {
        let mut value: Value = serde_json::from_str(text).ok()?;
        let told = value.as_object_mut()?.remove(SUM)?;
        if told != sum(&value) {
            return None;
        }
        let string = |value: &Value| value.as_str().map(String::from);
        let scene = |value: &Value| {
            let files = value["files"].as_object()?.iter();
            let files = files.map(|(name, hex)| Some((name.clone(), unhex(hex.as_str()?)?)));
            let text = SceneText {
                name: string(&value["file"])?,
                text: string(&value["text"])?,
                files: files.collect::<Option<_>>()?,
            };
            Some((string(&value["name"])?, text))
        };
        let run = |value: &Value| Some((value[0].as_u64()?, value[1].as_u64()?));
        let column = |value: &Value| Some([string(&value["key"])?, string(&value["type"])?, string(&value["unit"])?]);
        let manifest = Self {
            wave: usize::try_from(value["wave"].as_u64()?).ok()?,
            version: string(&value["version"])?,
            program: string(&value["program_xxh128"])?,
            study: (string(&value["study"]["name"])?, string(&value["study"]["text"])?),
            verb: string(&value["verb"])?,
            words: value["words"].as_array()?.iter().map(string).collect::<Option<_>>()?,
            command: string(&value["command"])?,
            scenes: value["scenes"].as_array()?.iter().map(scene).collect::<Option<_>>()?,
            points: Points::of_runs(value["runs"].as_array()?.iter().map(run).collect::<Option<_>>()?)?,
            shard_points: value["shard_points"].as_u64().filter(|points| (1..=MOST_POINTS).contains(points))?,
            columns: value["columns"].as_array()?.iter().map(column).collect::<Option<_>>()?,
        };
        let whole = value["sweep"] == FORMAT && value["settings_sha256"] == manifest.settings();
        let counts = value["points"] == manifest.points.count() && value["shards"] == manifest.shards();
        (whole && counts && manifest.shards() <= MOST_SHARDS).then_some(manifest)
    }

    /// Returns the function that finds the scenes of the manifest.
    pub fn find(&self) -> Find {
        let scenes = self.scenes.clone();
        Arc::new(move |name| {
            let found = scenes.iter().find(|(own, _)| own == name);
            let (_, scene) = found.ok_or_else(|| Failure::file(format!("the manifest has no scene {name}")))?;
            Ok(Source { scene: scene.clone(), file: None })
        })
    }

    /// Returns the work of the manifest.
    pub fn work(&self) -> Result<Box<dyn Work>, Failure> {
        work(&self.verb, &self.words, self.find())
    }

    /// Writes the manifest into the folder of its sweep, unless the folder has a manifest of this wave.
    pub fn write(self, dir: &Path) -> Result<Planned, Failure> {
        let at = |error| Failure::usage(format!("cannot write to {}: {error}", dir.display()));
        if self.shards() > MOST_SHARDS {
            let (points, shards) = (self.points.count(), self.shards());
            return Err(Failure::usage(format!(
                "{points} points are {shards} shards of {}, of which a sweep has {MOST_SHARDS} at most; write a larger \
                 --shard-points or --shard-time",
                self.shard_points
            )));
        }
        fs::create_dir_all(dir).map_err(at)?;
        sweep_files(dir);
        let (text, place) = (self.text(), place(dir, self.wave));
        let temporary = Temporary::file(dir, "manifest").map_err(at)?;
        let mut file = temporary.open().map_err(at)?;
        file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(|error| Failure::at(&place, error))?;
        put(temporary, &place)?;
        Ok(Planned { sum: sha256::of(&text), bytes: text.len(), manifest: self, dir: dir.to_path_buf() })
    }
}

/// Renames a complete file to its place, and waits until the folder is on the disk.
pub fn put(file: Temporary, place: &Path) -> Result<(), Failure> {
    temporary::place(vec![(file, place.to_path_buf())]).map_err(|(place, error)| Failure::at(&place, error))?;
    let folder = place.parent().unwrap_or(Path::new("."));
    system::sync_folder(folder).map_err(|error| Failure::at(folder, error))
}

/// Returns the checksum over a manifest without it.
fn sum(object: &Value) -> String {
    sha256::of(object.to_string())
}

fn unhex(text: &str) -> Option<Vec<u8>> {
    let digits = text.is_ascii() && text.len().is_multiple_of(2);
    let byte = |at| u8::from_str_radix(&text[at..at + 2], 16).ok();
    if digits { (0..text.len()).step_by(2).map(byte).collect() } else { None }
}

fn place(dir: &Path, wave: usize) -> PathBuf {
    dir.join(format!("manifest-{wave}.json"))
}

impl Planned {
    /// Reads the manifest of a wave; `None` if there is none.
    pub fn read(dir: &Path, wave: usize) -> Result<Option<Self>, Failure> {
        let place = place(dir, wave);
        let text = match fs::read_to_string(&place) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            text => text.map_err(|error| Failure::at(&place, error))?,
        };
        let damaged =
            || Failure::at(&place, "is no manifest of a sweep, or is damaged or of an older hpu; plan the sweep again");
        let manifest =
            Manifest::parse(&text).filter(|manifest| manifest.wave == wave && wave > 0).ok_or_else(damaged)?;
        // The points may be somebody else's. What builds no work here, as under another build of hpu, runs none either.
        if let Some(count) = manifest.work().ok().and_then(|work| work.count())
            && manifest.points.end() > count
        {
            let last = manifest.points.end() - 1;
            return Err(Failure::at(&place, format!("it asks for point {last} of {count}; plan the sweep again")));
        }
        Ok(Some(Self { manifest, dir: dir.to_path_buf(), sum: sha256::of(&text), bytes: text.len() }))
    }

    /// Reads the manifests of all waves, which are at least one.
    pub fn waves(dir: &Path) -> Result<Vec<Self>, Failure> {
        let mut all = Vec::new();
        while let Some(planned) = Self::read(dir, all.len() + 1)? {
            all.push(planned);
        }
        if all.is_empty() {
            return Err(Failure::usage(format!(
                "{} holds no sweep; hpu sweep plan STUDY -o {0} begins one",
                dir.display()
            )));
        }
        Ok(all)
    }

    /// Reads the manifest of the last wave.
    pub fn last(dir: &Path) -> Result<Self, Failure> {
        Ok(Self::waves(dir)?.pop().expect("there is at least one wave"))
    }

    /// Returns a short name of the sweep: of its settings in its folder.
    pub fn name(&self) -> String {
        let dir = self.dir.as_os_str().as_encoded_bytes();
        hashed([self.manifest.settings().as_bytes(), dir])[..12].to_string()
    }

    /// Returns the folder of the wave's shards.
    pub fn shards(&self) -> PathBuf {
        self.dir.join(format!("shards-{}", self.manifest.wave))
    }

    /// Returns the place of a shard's file, whose name ends so.
    pub fn shard(&self, index: u64, ending: &str) -> PathBuf {
        self.shards().join(format!("{index:06}.{ending}"))
    }

    /// Refuses to go on under another program than the one that planned the sweep, unless it is asked for. Returns the
    /// fingerprint of this program.
    pub fn accepts(&self, any_version: bool) -> Result<String, Failure> {
        let own = program::fingerprint()?;
        if own != self.manifest.program && !any_version {
            return Err(Failure::usage(format!(
                "this is another build of hpu than the one that planned the sweep ({}); --any-version goes on with it",
                self.manifest.version
            )));
        }
        Ok(own)
    }
}
