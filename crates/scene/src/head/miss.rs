//! The miss of a value by its nearest word.

use hpu_signal::Format;

/// A value that its nearest word misses by more than a tolerable share.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Miss {
    /// Relative error of the nearest word.
    pub error: f64,
    /// The narrowest format with more fraction bits whose nearest word is near enough; `None` if it has more than 32
    /// bits.
    pub format: Option<Format>,
}

impl Miss {
    /// The relative error above which a miss is reported.
    pub const FLAGGED: f64 = 0.02;

    /// Returns the miss of a value in a format that holds it, or `None` if the nearest word is near enough.
    pub(crate) fn of(value: f64, format: Format) -> Option<Self> {
        let error = |format: Format| relative_error((value / format.lsb()).round() * format.lsb(), value);
        if error(format).abs() <= Self::FLAGGED {
            return None;
        }
        let wider = (format.frac() + 1..).map(|frac| Format::new(false, format.int(), frac).ok());
        let wider = wider.map_while(|format| format.filter(|format| format.width() <= 32));
        Some(Self {
            error: error(format),
            format: wider.into_iter().find(|format| error(*format).abs() <= Self::FLAGGED),
        })
    }
}

/// Returns the relative error of a value; 0 of an exact zero.
pub(crate) fn relative_error(realised: f64, asked: f64) -> f64 {
    if asked == 0.0 { 0.0 } else { realised / asked - 1.0 }
}
