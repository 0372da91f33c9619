//! Counts of a counter that passes its end.

/// The widths of counters.
const WIDTHS: [u32; 5] = [8, 12, 16, 24, 32];

/// Lets counts go on where their counter passes its end, as from 65535 to 0, and returns its width; `None`, with the
/// counts as they were, if it does not.
///
/// The counter has the least width that holds all counts, with a sign if one is negative. It passes its end if a step
/// is longer than half of its range, and if all steps of this kind are, around the end, hardly longer than the longest
/// other one. Counts without a sign that begin in the upper half begin below 0, as in two's complement.
pub(super) fn unwrapped(counts: &mut [(f64, i64)]) -> Option<u32> {
    let least = counts.iter().map(|(_, count)| *count).min()?;
    let most = counts.iter().map(|(_, count)| *count).max()?;
    let holds = |bits: u32| match least < 0 {
        true => least >= -(1 << (bits - 1)) && most < 1 << (bits - 1),
        false => most < 1 << bits,
    };
    let bits = WIDTHS.into_iter().find(|bits| holds(*bits))?;
    let (range, half) = (1i64 << bits, 1i64 << (bits - 1));
    let steps = || counts.windows(2).map(|pair| pair[1].1 - pair[0].1);
    let longest = steps().map(i64::abs).filter(|step| *step <= half).max().unwrap_or(0).max(1);
    let mut ends = steps().map(i64::abs).filter(|step| *step > half).peekable();
    ends.peek()?;
    if !ends.all(|step| range - step <= 2 * longest) {
        return None;
    }
    let mut before = counts[0].1;
    let mut turns = -i64::from(least >= 0 && before >= half);
    for (_, count) in counts {
        let step = *count - before;
        before = *count;
        turns -= if step.abs() > half { step.signum() } else { 0 };
        *count += turns * range;
    }
    Some(bits)
}
