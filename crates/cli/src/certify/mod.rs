//! `hpu certify`: certificates, checked.

mod of_run;

use std::path::PathBuf;

use hpu_cosim::figure;
use hpu_page::Page;
use hpu_prove::certify::{Checked, Over, certify};
use serde_json::json;

use crate::certificate::is_of_run;
use crate::page::show;
use crate::shell::{Exit, Failure, read_text};

/// Check a certificate: the proof that a wall settles at every phase, or that a run goes on as it is told, for ever
///
/// `hpu limits SCENE --for-ever --certificates DIR` writes proofs of walls. The checker makes its own matrices from the
/// scene in the file, with all arithmetic rounded outwards, and shares nothing with the search but intervals and the
/// scene's reader. A proof holds for every start from which the wall stays in contact and below its full command, and
/// for a hand at rest.
///
/// `hpu run SCENE --for-ever --certificates DIR` writes how a run goes on. It is checked by the same program: the scene
/// in the file is run again, and has to go on in the same way to every digit. Growth of a discrete plant is checked
/// apart as well: by code that shares intervals and the scene's reader with the proof, and nothing else.
///
/// Exit code 0: it is accepted; 1: it is rejected; 4: the file is no certificate.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A certificate
    file: PathBuf,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `hpu certify`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let text = read_text(&args.file)?;
    if is_of_run(&text) {
        let mut page = Page::default();
        page.data("file", &args.file);
        let Some(is_so) = of_run::check(&args.file.display().to_string(), &text, &mut page)? else {
            return Ok(Exit::Interrupted);
        };
        page.data("accepted", is_so);
        show(&page, args.json)?;
        return Ok(Exit::when(is_so));
    }
    let found = certify(&text).map_err(|why| Failure::at(&args.file, why))?;
    let is_accepted = matches!(found, Checked::Accepted { .. });
    let mut page = Page::default();
    page.data("file", &args.file).data("accepted", is_accepted);
    match &found {
        Checked::Accepted { words, over } => {
            let ranges = over.iter().map(|over| json!({ "key": over.key, "ends": over.ends }));
            page.data("over", ranges.collect::<Vec<_>>());
            let all = words.iter().map(|(stiffness, bound)| {
                json!({ "stiffness": stiffness, "rms_counts": bound.rms_counts, "duty": bound.duty })
            });
            page.data("words", all.collect::<Vec<_>>());
            let most = words.iter().fold(0.0, |most: f64, (_, bound)| most.max(bound.rms_counts));
            let ends = words.first().zip(words.last());
            let said = ends.map_or("it claims nothing".to_string(), |((from, _), (to, _))| {
                let [from, to, most] = [*from, *to, most].map(figure);
                format!("{} words, stiffness {from} to {to}, at most {most} counts rms in contact", words.len())
            });
            page.line("accepted", said);
            for Over { key, ends: [from, to] } in over {
                page.line("", format!("for every {key} from {from} to {to}"));
            }
        }
        Checked::Rejected(why) => {
            page.data("reason", why.to_string());
            page.line("rejected", why.to_string());
        }
    }
    show(&page, args.json)?;
    Ok(Exit::when(is_accepted))
}
