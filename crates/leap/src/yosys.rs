//! Reads netlists of Yosys.
