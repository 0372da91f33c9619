//! `hpu-book OUT`: renders the book into the folder OUT.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out] = &arguments[..] else {
        eprintln!("usage: hpu-book OUT, an empty folder for the book, or one that holds a book");
        return ExitCode::from(2);
    };
    match hpu_book::render(Path::new(out)) {
        Ok(()) => {
            println!("{}", Path::new(out).join("index.html").display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(4)
        }
    }
}
