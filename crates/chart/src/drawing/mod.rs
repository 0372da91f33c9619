//! The tools of all pictures: canvas, panels, series, labels.

pub(crate) mod canvas;
pub(crate) mod labels;
pub(crate) mod log_panel;
pub(crate) mod map_frame;
pub(crate) mod panel;
pub(crate) mod series;
pub(crate) mod words;
