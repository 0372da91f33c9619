//! Enums whose variants have names.

/// Makes an enum each of whose variants has a name, which stands beside it: `ALL` lists the variants, `name` returns
/// the name in scenes, results and commands.
///
/// ```
/// hpu_signal::named! {
///     /// The side of a wall.
///     #[derive(Clone, Copy, PartialEq, Eq, Debug)]
///     pub enum Side {
///         /// Before it.
///         Before = "before",
///         /// Inside it.
///         Inside = "inside",
///     }
/// }
/// assert_eq!(Side::ALL.map(Side::name), ["before", "inside"]);
/// ```
#[macro_export]
macro_rules! named {
    ($(#[$about:meta])* $visible:vis enum $Enum:ident {
        $($(#[$of_variant:meta])* $Variant:ident = $name:literal,)*
    }) => {
        $(#[$about])*
        $visible enum $Enum {
            $($(#[$of_variant])* $Variant,)*
        }

        impl $Enum {
            /// Every variant, in order.
            $visible const ALL: [Self; [$($name),*].len()] = [$(Self::$Variant),*];

            /// Returns the variant's name.
            $visible const fn name(self) -> &'static str {
                [$($name),*][self as usize]
            }
        }
    };
}
