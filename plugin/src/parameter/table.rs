//! Enumerations with a row of facts for each variant.

/// Declares an enumeration, `ALL` of its variants in order, and the row of each.
macro_rules! table {
    ($(#[$meta:meta])* pub enum $name:ident: $row:ty { $($(#[$of:meta])* $variant:ident = $value:expr,)* }) => {
        $(#[$meta])*
        pub enum $name {
            $($(#[$of])* $variant,)*
        }

        impl $name {
            /// All of them.
            pub const ALL: [Self; [$(stringify!($variant)),*].len()] = [$(Self::$variant),*];

            fn row(self) -> $row {
                match self {
                    $(Self::$variant => $value,)*
                }
            }
        }
    };
}
pub(crate) use table;
