//! Enumerations with a row of facts for each variant.

/// Declares an enumeration, `ALL` of its variants in order, and the row of each. Behind a semicolon there may be one more
/// variant, which holds a value; its row is what a function makes of that.
macro_rules! table {
    ($(#[$meta:meta])* pub enum $name:ident: $row:ty {
        $($(#[$of:meta])* $variant:ident = $value:expr,)*
        $(; $(#[$of_more:meta])* $more:ident($held:ty) = $of_held:expr)?
    }) => {
        $(#[$meta])*
        pub enum $name {
            $($(#[$of])* $variant,)*
            $($(#[$of_more])* $more($held),)?
        }

        impl $name {
            /// All of them, but for one that holds a value.
            pub const ALL: [Self; [$(stringify!($variant)),*].len()] = [$(Self::$variant),*];

            /// What there is to know about it.
            pub fn row(self) -> $row {
                match self {
                    $(Self::$variant => $value,)*
                    $(Self::$more(held) => $of_held(held),)?
                }
            }
        }
    };
}
pub(crate) use table;
