//! Drawing for pages in a browser: functions in JavaScript, without a library, and their style sheets.

/// `hpuPlot(container, data)` draws time series that a reader zooms.
pub const PLOT_JS: &str = include_str!("plot.js");
/// The colours and the layout of `hpuPlot`.
pub const PLOT_CSS: &str = include_str!("plot.css");
/// `hpuRows(container, data)` draws the rows of a table as cells or points; each tells its row.
pub const ROWS_JS: &str = include_str!("rows.js");
