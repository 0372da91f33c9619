//! The summing up of a paper's reproduction, from the record of the run.

/// A claim of a paper, and what came out.
struct Claim<'a> {
    label: &'a str,
    verdict: &'a str,
    quote: &'a str,
    found: &'a str,
}

/// Reads the line of a claim: its label, its verdict, and what the paper says.
fn claim<'a>(line: &'a str, found: &'a str) -> Option<Claim<'a>> {
    let (label, rest) = line.strip_prefix('(')?.split_once(')')?;
    let (verdict, quote) = rest.split_at(rest.find('"')?);
    Some(Claim { label, verdict: verdict.trim(), quote: quote.trim(), found: found.trim() })
}

/// Returns the number of claims of each verdict, and a table of them; `None` when the record sums nothing up.
pub fn summing_up(record: &str) -> Option<String> {
    let (_, summed) = record.split_once("\nSumming up")?;
    let lines: Vec<&str> = summed.lines().collect();
    let claims: Vec<Claim> = lines.windows(2).filter_map(|pair| claim(pair[0], pair[1])).collect();
    let count = |verdict: &str| claims.iter().filter(|claim| claim.verdict == verdict).count();
    let told = ["confirmed", "not confirmed", "cannot be told"];
    let mut counts: Vec<String> = told.iter().map(|verdict| format!("{} {verdict}", count(verdict))).collect();
    let others = claims.iter().filter(|claim| !told.contains(&claim.verdict)).count();
    if others > 0 {
        counts.push(format!("{others} met at some seeds"));
    }
    let row = |Claim { label, verdict, quote, found }: &Claim| {
        let escaped = |text: &str| text.replace('|', "\\|").replace('[', "\\[").replace('*', "\\*").replace('_', "\\_");
        format!("| {label} | **{verdict}** | {} | {} |\n", escaped(quote), escaped(found))
    };
    let rows: String = claims.iter().map(row).collect();
    let head = "| | verdict | the paper | here |\n|---|---|---|---|\n";
    (!claims.is_empty()).then(|| format!("{} claims: {}.\n\n{head}{rows}", claims.len(), counts.join(", ")))
}
