//! A folder of the user's cache, which may not be there, or of no use: without a HOME as under cron, read-only, full,
//! mounted without programs. Results then stay with this process, and a note says why.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::engines::note::note;
use crate::engines::owned;
use crate::engines::temporary::Temporary;
use crate::system;

/// Room that a folder must have to be no reason for a tool's failure: much more than a built model takes.
const ROOM: usize = 32 << 20;

/// A folder of the user's cache. It is looked at when something is to be kept there, not before.
#[derive(Clone, Debug)]
pub struct CacheFolder {
    users: Option<PathBuf>,
    kept: &'static str,
    runs: bool,
    found: OnceLock<PathBuf>,
}

impl CacheFolder {
    /// Returns the folder for what is `kept`, as in `costs`; `None` if the user has none.
    pub fn new(users: Option<PathBuf>, kept: &'static str) -> Self {
        Self { users, kept, runs: false, found: OnceLock::new() }
    }

    /// Returns the folder for programs that are run from there.
    pub fn with_programs(self) -> Self {
        Self { runs: true, ..self }
    }

    /// Returns the path of the folder: the user's if it can be used, else one of this process.
    ///
    /// # Errors
    ///
    /// When neither can be made.
    pub fn path(&self) -> io::Result<&Path> {
        if let Some(found) = self.found.get() {
            return Ok(found);
        }
        let Self { users, kept, .. } = self;
        let path = match users {
            None => {
                note(format!(
                    "no HOME: {kept} stay with this command; to keep them, set XDG_CACHE_HOME to an absolute path"
                ));
                own_folder()?.to_path_buf()
            }
            Some(users) => match self.usable(users) {
                Ok(()) => users.clone(),
                Err(why) => self.instead(&why)?.to_path_buf(),
            },
        };
        Ok(self.found.get_or_init(|| path))
    }

    /// Returns the folder of this process to use from now on, because the user's is of no use, and notes why.
    pub(crate) fn instead(&self, why: &io::Error) -> io::Result<&Path> {
        let place = self.users.as_deref().unwrap_or(Path::new("")).display();
        let wanted =
            if self.runs { "can be written to, with room, and may hold programs" } else { "can be written to" };
        note(format!(
            "{place}: {why}; {} stay with this command; set XDG_CACHE_HOME to a folder that {wanted}, or mend this one",
            self.kept
        ));
        own_folder()
    }

    /// Makes the folder, and tries whether it takes a file and, if asked for, lets programs run.
    fn usable(&self, dir: &Path) -> io::Result<()> {
        owned::make_folders(dir)?;
        let probe = Temporary::file(dir, "probe")?;
        probe.open()?.write_all(&[0; 4096])?;
        if self.runs {
            system::may_run(probe.path())?;
        }
        Ok(())
    }

    /// Returns why the folder may be the reason that a tool failed in it: it has no room.
    pub(crate) fn shortage(&self, dir: &Path) -> Option<io::Error> {
        let fill = || {
            let probe = Temporary::file(dir, "room")?;
            let mut file = probe.open()?;
            (0..ROOM >> 20).try_for_each(|_| file.write_all(&vec![0; 1 << 20]))
        };
        fill().err()
    }
}

/// Returns the folder of this process in the place of a cache. It lies within a temporary folder, which this process
/// has locked, so that it can be locked itself, and goes with the process.
fn own_folder() -> io::Result<&'static Path> {
    static OWN: OnceLock<(Temporary, PathBuf)> = OnceLock::new();
    if let Some((_, own)) = OWN.get() {
        return Ok(own);
    }
    let outer = Temporary::folder()?;
    let own = outer.path().join("cache");
    owned::make_folders(&own)?;
    Ok(&OWN.get_or_init(|| (outer, own)).1)
}
