//! How many cases a property is tried on, and how long one that fails is made smaller.

use proptest::test_runner::Config;

/// So many cases. A failing one is shrunk for at most 10 seconds and shown as small as it is by then: the laws of all
/// blocks would shrink for minutes.
pub fn cases(count: u32) -> Config {
    Config { max_shrink_time: 10_000, ..Config::with_cases(count) }
}
