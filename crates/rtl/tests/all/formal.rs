//! Proofs of blocks, for all inputs and states.

use std::time::{Duration, Instant};

use hpu_datapath::variants;
use hpu_rtl::formal::{Verdict, prove};

const HDL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../hdl");

#[test]
fn explore() {
    let only = std::env::var("ONLY").unwrap_or_default();
    for (label, block) in variants() {
        if block.equations().is_none() || !only.is_empty() && block.name() != only {
            continue;
        }
        let start = Instant::now();
        let verdict = prove(&*block, std::path::Path::new(HDL), Duration::from_secs(20));
        println!("{} {label}: {} {:.2} s", block.name(), match &verdict { Ok(Verdict::Proved(by)) => format!("proved {by:?}"), other => format!("{other:?}").chars().take(1500).collect() }, start.elapsed().as_secs_f64());
    }
}
