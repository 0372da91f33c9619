//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod anywhere;
mod architecture;
mod bad_input;
mod blocks;
mod chart;
mod common;
mod contact;
mod dut;
mod entity;
mod exports;
mod fit;
mod fuzz;
mod manual;
mod map;
mod on_disk;
mod phantom;
mod price;
mod readme;
mod readme_tables;
mod reproduce;
mod reproduce_words;
mod rtl_motion;
mod run;
mod signals;
mod tools;
mod widths;
