//! Writes pictures into a folder.

use hpu_chart::Picture;

use crate::shell::exit::Failure;
use crate::shell::files::Folder;

/// Writes a picture as SVG and as PNG.
pub fn put(Picture { name, svg, png, .. }: &Picture, folder: &mut Folder) -> Result<(), Failure> {
    folder.write(&format!("{name}.svg"), svg)?;
    folder.write(&format!("{name}.png"), png)
}
