//! The error of a crate.

/// Defines the one error of a crate. It is opaque: a reason, which says what to write instead where that is known,
/// behind the place that it is about. Errors of other crates convert into it.
///
/// # Example
///
/// ```
/// hpu_signal::error! {
///     /// Why there is no gain.
///     pub struct Error from std::num::ParseFloatError;
/// }
///
/// fn gain(text: &str) -> Result<f64, Error> {
///     let gain: f64 = text.parse()?;
///     if gain > 0.0 { Ok(gain) } else { Err(Error::new(format_args!("{gain} is no gain; write one above 0"))) }
/// }
///
/// let refused = |text: &str| gain(text).map_err(|error| error.at("wall.gain")).unwrap_err().to_string();
/// assert_eq!(refused("-1"), "wall.gain: -1 is no gain; write one above 0");
/// assert_eq!(refused("much"), "wall.gain: invalid float literal");
/// ```
#[macro_export]
macro_rules! error {
    ($(#[$about:meta])* $visible:vis struct $Error:ident from $($Other:ty),*;) => {
        $(#[$about])*
        #[derive(Clone, PartialEq, Eq, Debug)]
        $visible struct $Error(Box<str>);

        impl $Error {
            /// Returns an error for a reason.
            $visible fn new(why: impl std::fmt::Display) -> Self {
                Self(why.to_string().into())
            }

            /// Puts a place before the reason.
            #[must_use]
            $visible fn at(self, place: impl std::fmt::Display) -> Self {
                Self::new(format_args!("{place}: {self}"))
            }
        }

        impl std::fmt::Display for $Error {
            fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str(&self.0)
            }
        }

        impl std::error::Error for $Error {}

        $crate::error!(@from $Error String, &str $(, $Other)*);
    };
    (@from $Error:ident $($Other:ty),*) => {
        $(impl From<$Other> for $Error {
            fn from(why: $Other) -> Self {
                Self::new(why)
            }
        })*
    };
}
