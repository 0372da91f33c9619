//! Reads numbers from the output of the tools.

use std::collections::BTreeMap;

/// Returns the number of cells by type, from the lines of `stat` that are a name and a number.
pub(crate) fn cell_counts(stat: &str) -> BTreeMap<String, u64> {
    stat.lines()
        .filter_map(|line| {
            let (name, count) = line.trim().split_once(char::is_whitespace)?;
            Some((name.to_string(), count.trim().parse().ok()?))
        })
        .collect()
}

/// Returns the number of cells whose type begins with `prefix`: flip-flops and block RAMs come in several kinds.
pub fn sum(cells: &BTreeMap<String, u64>, prefix: &str) -> u64 {
    cells.iter().filter(|(name, _)| name.starts_with(prefix)).map(|(_, count)| count).sum()
}

/// Reads the logic cells from nextpnr's `ICESTORM_LC:    10/ 7680     0%`.
pub(crate) fn used_cells(said: &str) -> Option<u64> {
    let (_, after) = said.split_once("ICESTORM_LC:")?;
    after.split('/').next()?.trim().parse().ok()
}

/// Reads the frequency from the last (routed) `Max frequency for clock 'clk…': 290.87 MHz`. The other clock is the
/// bench's.
pub fn fmax(said: &str) -> Option<f64> {
    let line = said.lines().rfind(|line| line.contains("Max frequency for clock") && line.contains("'clk"))?;
    line.rsplit_once("': ")?.1.split_whitespace().next()?.parse().ok()
}

/// Returns whether nextpnr found no place for some cells.
pub(crate) fn is_full(said: &str) -> bool {
    said.contains("no BELs remaining") || said.contains("Unable to find legal placement")
}
