//! The source of the blocks' VHDL: a folder, or this program, which carries it.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::{fmt, fs};

use crate::engines::error::Error;

/// Returns the carried VHDL: name and text of each block.
fn carried() -> impl Iterator<Item = (&'static str, &'static str)> {
    hpu_assets::FILES.iter().filter_map(|(path, text)| {
        let name = path.strip_prefix("hdl/")?.strip_suffix(".vhd")?;
        Some((name.strip_prefix("generated/").unwrap_or(name), *text))
    })
}

/// The source of the blocks' VHDL.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Hdl {
    /// A folder with `<block>.vhd`, or with `generated/<block>.vhd` where that is generated.
    Folder(PathBuf),
    /// This program carries it.
    Carried,
}

impl Hdl {
    /// Returns the folder, if it holds the VHDL of any block; otherwise the VHDL that the program carries.
    pub fn of_folder_or_carried(folder: &Path) -> Self {
        let has = |(name, _): (&str, &str)| folder.join(format!("{name}.vhd")).is_file();
        if carried().any(has) { Self::Folder(folder.to_path_buf()) } else { Self::Carried }
    }

    /// Returns the file of a block, as messages call it.
    pub fn file(&self, block: &str) -> PathBuf {
        match self {
            Self::Folder(folder) => {
                let place = folder.join(format!("{block}.vhd"));
                let generated = folder.join(format!("generated/{block}.vhd"));
                if !place.is_file() && generated.is_file() { generated } else { place }
            }
            Self::Carried => PathBuf::from(format!("{block}.vhd")),
        }
    }

    /// Returns the VHDL of a block.
    ///
    /// # Errors
    ///
    /// An error when the folder has no file of that block that can be read.
    pub fn text(&self, block: &str) -> Result<Cow<'static, str>, Error> {
        let place = self.file(block);
        match self {
            Self::Folder(_) => fs::read_to_string(&place).map(Cow::Owned).map_err(|error| Error::io(place, error)),
            Self::Carried => carried()
                .find(|(name, _)| *name == block)
                .map(|(_, text)| Cow::Borrowed(text))
                .ok_or_else(|| Error::io(place, std::io::ErrorKind::NotFound.into())),
        }
    }
}

impl fmt::Display for Hdl {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Folder(folder) => write!(f, "{}", folder.display()),
            Self::Carried => f.write_str("carried by hpu"),
        }
    }
}

/// Returns, on one line, how a block differs from the hardware according to the header of its VHDL; `None` when the
/// header does not mention a difference.
pub fn differs_from_the_hardware(vhdl: &str) -> Option<String> {
    let (_, rest) = vhdl.split_once("\n-- differs from the hardware:")?;
    let lines =
        rest.lines().enumerate().map_while(|(at, line)| if at == 0 { Some(line) } else { line.strip_prefix("--") });
    Some(lines.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" "))
}

/// The VHDL to simulate or synthesise, and the settings for it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Setup {
    /// The source of the VHDL.
    pub hdl: Hdl,
    /// The time limit of a tool. Without it the limit is [`TIMEOUT`](crate::TIMEOUT), or more where there is more to
    /// do.
    pub timeout: Option<std::time::Duration>,
}

impl Setup {
    /// Returns the default settings for VHDL from this source.
    pub fn new(hdl: Hdl) -> Self {
        Self { hdl, timeout: None }
    }
}

impl From<&Path> for Setup {
    fn from(folder: &Path) -> Self {
        Self::new(Hdl::Folder(folder.to_path_buf()))
    }
}

impl From<&PathBuf> for Setup {
    fn from(folder: &PathBuf) -> Self {
        folder.as_path().into()
    }
}

impl From<PathBuf> for Setup {
    fn from(folder: PathBuf) -> Self {
        folder.as_path().into()
    }
}

impl From<&Setup> for Setup {
    fn from(setup: &Setup) -> Self {
        setup.clone()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_vhdl_of_every_block_is_carried_and_it_is_that_of_the_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hdl");
        let all: BTreeSet<_> = carried().map(|(name, _)| name.to_string()).collect();
        let carried: BTreeSet<_> = all.iter().filter(|name| !name.ends_with("_pkg")).cloned().collect();
        let blocks: BTreeSet<_> = hpu_datapath::block_names().iter().map(|name| (*name).to_string()).collect();
        assert_eq!(carried, blocks);
        let files =
            [folder.clone(), folder.join("generated")].map(|folder| fs::read_dir(folder).expect("hdl/").flatten());
        let names = files.into_iter().flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
        let names = names.filter_map(|name| name.strip_suffix(".vhd").map(str::to_string));
        let files: BTreeSet<_> = names.filter(|name| !name.ends_with("_pkg")).collect();
        assert_eq!(carried, files);
        let of_folder = Hdl::Folder(folder);
        assert!(all.contains("rounding_pkg"));
        for name in all {
            assert_eq!(Hdl::Carried.text(&name).expect("carried"), of_folder.text(&name).expect("a file"), "{name}");
        }
    }

    #[test]
    fn a_folder_without_the_vhdl_of_a_block_is_no_folder_of_vhdl() {
        let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        assert_eq!(Hdl::of_folder_or_carried(&project), Hdl::Carried);
        assert_eq!(Hdl::of_folder_or_carried(&project.join("hdl")), Hdl::Folder(project.join("hdl")));
    }
}
