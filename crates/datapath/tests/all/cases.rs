//! The number of cases on which a property is tried, and the limit on the time to shrink a failing case.

use proptest::test_runner::Config;

/// Returns a configuration with that many cases. A failing case is shrunk for at most 10 seconds and shown as it is
/// then, because the laws of all blocks would shrink for minutes.
pub fn cases(count: u32) -> Config {
    Config { max_shrink_time: 10_000, ..Config::with_cases(count) }
}
