//! Tests of libhpu.
