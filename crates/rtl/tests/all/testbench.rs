//! Generated testbenches refuse damaged files, as the reader in Rust does.

use std::path::Path;
use std::time::Duration;

use hpu_datapath::{AnyBlock, block_by_name};
use hpu_rtl::{Library, Setup, VECTOR_READER, package, testbench};

const VECTORS: &str = "\
# position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12
1 0 000
0 3 fff
# end 2 rows
";

/// Returns the output of the counter's testbench for a vector file.
fn run(vectors: &str) -> Result<String, String> {
    let block: Box<dyn AnyBlock> = block_by_name("position_counter").expect("a block");
    let packages = [
        ("vector_reader.vhd".to_string(), VECTOR_READER.to_string()),
        ("position_counter_pkg.vhd".to_string(), package(&*block)),
    ];
    let hdl = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hdl");
    let benches = [("tb_position_counter.vhd".to_string(), testbench(&*block, "none.txt"))];
    let library = Library::analyse(&packages, &Setup::from(hdl), ["position_counter"], &benches)
        .unwrap_or_else(|error| panic!("{error}"));
    library.write("v.txt", vectors).unwrap_or_else(|error| panic!("{error}"));
    library.run("tb_position_counter", &[("VECTORS", "v.txt".to_string())], &[], Duration::ZERO).map_err(|error| {
        assert!(error.is_refusal(), "{error}");
        error.said().to_string()
    })
}

#[test]
fn a_good_file_ends_with_the_result_alone() {
    assert_eq!(run(VECTORS).as_deref(), Ok("RESULT rows=2 mismatches=0\n"));
}

#[test]
fn a_wrong_word_is_reported_with_row_signal_expected_got_and_the_rows_before() {
    let said = "\
MISMATCH row=2 signal=position expected=111111111110 (4094) got=111111111111 (4095)
HISTORY row=1 1 0 000 got 000
HISTORY row=2 0 3 ffe got fff
RESULT rows=2 mismatches=1
";
    assert_eq!(run(&VECTORS.replace("fff", "ffe")).as_deref(), Ok(said));
}

#[test]
fn a_stale_file_is_refused_with_both_format_lines_and_the_remedy() {
    let said = run(&VECTORS.replace("WIDTH=12", "WIDTH=11")).expect_err("another configuration");
    assert!(said.contains("expected `# position_counter in rst(0,1,0)"), "{said}");
    assert!(said.contains("WIDTH=11`; refresh them with `hpu vectors --update`"), "{said}");
}

#[test]
fn a_cut_file_is_refused_wherever_it_is_cut() {
    for cut in ["# end 2 rows\n", "0 3 fff\n# end 2 rows\n", " fff\n# end 2 rows\n", "nd 2 rows\n"] {
        let said = run(VECTORS.strip_suffix(cut).expect("its end")).expect_err("a cut file");
        assert!(!said.contains("RESULT"), "{said}");
    }
    run(&VECTORS.replace("0 3 fff\n", "")).expect_err("a lost row");
    run("").expect_err("an empty file");
}

#[test]
fn a_word_that_is_not_hex_is_refused_with_its_row() {
    let said = run(&VECTORS.replace("fff", "fgf")).expect_err("bad hex");
    assert!(said.contains("row 2: `0 3 fgf` is not a row of"), "{said}");
}
