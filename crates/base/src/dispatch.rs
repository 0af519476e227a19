//! Enums of types that implement a common trait.
//!
//! A list of variants generates the enum and its methods, so that a new type is one entry of one list. A call is a
//! `match`, which costs less than a call through `dyn`.

/// Defines an enum whose variants each hold a type, and methods that call the method of that name of the value. After
/// `of each:`, which is optional, an associated function of the types that returns pairs of a name and a value; that of
/// the enum returns the pairs of all types in the order of the variants.
///
/// ```
/// trait Area {
///     fn area(&self) -> f32;
/// }
/// struct Square(f32);
/// impl Area for Square {
///     fn area(&self) -> f32 {
///         self.0 * self.0
///     }
/// }
/// furrow_base::dispatch! {
///     /// A shape.
///     pub enum Shape {
///         /// A square.
///         Square(Square),
///     }
///     /// Returns the area.
///     fn area(&self) -> f32;
/// }
/// assert_eq!(Shape::Square(Square(3.0)).area(), 9.0);
/// ```
#[macro_export]
macro_rules! dispatch {
    (
        $(#[$meta:meta])*
        pub enum $name:ident $variants:tt
        $($(#[$about:meta])* fn $method:ident(&self $(, $arg:ident: $type:ty)*) -> $out:ty;)*
        $(of each: $(#[$all_about:meta])* fn $all:ident();)?
    ) => {
        $crate::dispatch!(@enum [$(#[$meta])*] $name $variants);

        impl $name {
            $($crate::dispatch!(@method $variants $(#[$about])* fn $method($($arg: $type),*) ($($arg),*) -> $out);)*
            $($crate::dispatch!(@all $variants $(#[$all_about])* fn $all);)?
        }
    };
    (@enum [$($meta:tt)*] $name:ident { $($(#[$doc:meta])* $variant:ident($inner:ty),)* }) => {
        $($meta)*
        pub enum $name {
            $($(#[$doc])* $variant($inner),)*
        }
    };
    (
        @method { $($(#[$doc:meta])* $variant:ident($inner:ty),)* }
        $(#[$about:meta])* fn $method:ident($($arg:ident: $type:ty),*) $args:tt -> $out:ty
    ) => {
        $(#[$about])*
        #[inline]
        pub fn $method(&self $(, $arg: $type)*) -> $out {
            match self {
                $(Self::$variant(one) => one.$method $args,)*
            }
        }
    };
    (
        @all { $($(#[$doc:meta])* $variant:ident($inner:ty),)* }
        $(#[$about:meta])* fn $all:ident
    ) => {
        $(#[$about])*
        pub fn $all() -> Vec<(&'static str, Self)> {
            let mut all = Vec::new();
            $(all.extend(<$inner>::$all().into_iter().map(|(name, one)| (name, Self::$variant(one))));)*
            all
        }
    };
}
