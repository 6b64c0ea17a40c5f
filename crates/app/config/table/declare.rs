//! The declarations of the configuration: `table!` for the keys of a table, `one_of!` for a value of several forms.
//!
//! A key is declared once. To add one:
//!
//! 1. In the file of its table in `tables/`, write its line into `table!`, as below: what it does, name, type, kind, default.
//! 2. What it asks of other keys goes into `check`, in words for the user, and into `rules`, for editors.
//! 3. Read the field where it is used, and run `just generate` for the shipped schema and `docs/configuration.md`.
//!
//! From the line follow the field of the struct with its documentation, how it is read with all diagnostics, its default, its
//! part of the schema and of the page, and its place among the known keys:
//!
//! ```text
//! table! {
//!     /// What the table is.
//!     pub struct Name {
//!         /// What the key does [m].
//!         optional: Option<f64> = length(POSITIVE);
//!         /// With a default, which the schema shows.
//!         growth: f64 = number(GROWTHS) => 1.5;
//!         /// With a default that depends on keys above, or that the schema leaves to the words.
//!         outer: f64 = length(POSITIVE), else 5.0 * growth;
//!         /// Required; the example is shown where the key is missing. Its name differs from that of the field.
//!         corners["box"]: [f64; 3] = length(FINITE), need "[0, 0, 0]";
//!         /// Keys that belong together, in the same table.
//!         #[serde(flatten)]
//!         extent: Extent = KEYS;
//!     }
//!     unused = |section| …;       // keys that have no use beside others
//!     former = [("old", "why")];  // keys of earlier versions, which have no effect
//!     check = |table, section| …; // what is wrong with several keys together
//!     rules = |rules| …;          // the same for the schema
//! }
//! ```
//!
//! The kinds are those of [`kinds`](super::kinds). `pub struct Name: Default` has a `Default` with every key left out.

/// Declares a table: see the documentation of the module.
macro_rules! table {
    ($(#[$($meta:tt)*])* $vis:vis struct $name:ident: Default { $($body:tt)* } $($rest:tt)*) => {
        table! { $(#[$($meta)*])* $vis struct $name { $($body)* } $($rest)* }

        impl Default for $name {
            fn default() -> Self {
                $crate::config::table::declaration::left_out()
            }
        }
    };
    (
        $(#[doc = $about:literal])*
        $(#[derive($($derive:ident),+)])?
        $vis:vis struct $name:ident $(as $written:literal)? {
            $(
                $(#[doc = $meaning:literal])*
                $(#[serde($($serde:tt)+)])?
                $(#[also($($also:ident),+)])?
                $field:ident $([$key:literal])? : $type:ty = $kind:expr
                $(=> $default:expr)? $(, need $example:expr)? $(, else $own:expr)? ;
            )*
        }
        $(unused = $unused:expr;)?
        $(former = $former:expr;)?
        $(check = $check:expr;)?
        $(rules = $rules:expr;)?
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize $($(, $derive)+)?)]
        $vis struct $name {
            $(
                $(#[doc = $meaning])*
                $(#[serde(rename = $key)])?
                $(#[serde($($serde)+)])?
                pub $field: $type,
            )*
        }

        impl $crate::config::table::declaration::Table for $name {
            const NAME: &'static str = table!(@name $name $($written)?);
            const ABOUT: &'static [&'static str] = &[$($about),*];

            fn read_keys(section: &$crate::config::section::Section<'_>) -> Self {
                #[allow(unused_imports, reason = "every declaration has the whole vocabulary")]
                use $crate::config::table::kinds::*;
                $(
                    let unused: fn(&$crate::config::section::Section<'_>) -> Vec<&'static str> = $unused;
                    section.hide(unused(section));
                )?
                $(section.pass_over(&$former);)?
                $(
                    let $field: $type = table!(
                        @read section, table!(@name $field $($key)?), $kind;
                        $(=> $default)? $(need $example)? $(else $own)?
                    );
                )*
                #[allow(unused_mut, reason = "a check may complete a default")]
                let mut table = Self { $($field),* };
                $(
                    let check: fn(&mut Self, &$crate::config::section::Section<'_>) = $check;
                    check(&mut table, section);
                )?
                table
            }

            fn describe_keys(
                description: &mut $crate::config::table::description::Description,
                definitions: &mut $crate::config::value::definitions::Definitions,
            ) {
                #[allow(unused_imports, reason = "every declaration has the whole vocabulary")]
                use $crate::config::table::kinds::*;
                $(
                    let field = $crate::config::table::field::Field {
                        key: table!(@name $field $($key)?),
                        meaning: &[$($meaning),*],
                        also: &[$($($crate::config::table::field::Also::$also),+)?],
                    };
                    table!(
                        @describe description, definitions, field, $type, $kind;
                        $(=> $default)? $(need $example)? $(else $own)?
                    );
                )*
                $(
                    let rules: fn(
                        $crate::config::table::rules::Rules,
                    ) -> $crate::config::table::rules::Rules = $rules;
                    description.add_rules(rules, definitions);
                )?
            }
        }
    };

    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $name:literal) => { $name };

    (@read $section:ident, $key:expr, $kind:expr;) => {
        $crate::config::table::nested::Plain::read_from($section, $key, &$kind)
    };
    (@read $section:ident, $key:expr, $kind:expr; => $default:expr) => {
        $section.read($key, &$kind).unwrap_or_else(|| $default)
    };
    (@read $section:ident, $key:expr, $kind:expr; else $own:expr) => {
        $section.read($key, &$kind).unwrap_or_else(|| $own)
    };
    (@read $section:ident, $key:expr, $kind:expr; need $example:expr) => {
        $section.need($key, &$kind, $example)
    };

    (@describe $description:ident, $definitions:ident, $field:ident, $type:ty, $kind:expr;) => {
        <$type as $crate::config::table::nested::Plain<_>>::describe(&$kind, $field, $description, $definitions);
    };
    (@describe $description:ident, $definitions:ident, $field:ident, $type:ty, $kind:expr; => $default:expr) => {
        let default: $type = $default;
        let default = Some(serde_json::to_value(&default).unwrap_or_default());
        $description.key::<$type, _>(&$kind, $field, default, $definitions);
    };
    (@describe $description:ident, $definitions:ident, $field:ident, $type:ty, $kind:expr; else $own:expr) => {
        $description.key::<$type, _>(&$kind, $field, None, $definitions);
    };
    (@describe $description:ident, $definitions:ident, $field:ident, $type:ty, $kind:expr; need $example:expr) => {
        $description.require($field.key);
        $description.key::<$type, _>(&$kind, $field, None, $definitions);
    };
}
pub(in crate::config) use table;

/// Declares a value that is written in one of several forms, told apart by what is written: `if list`, `if text`, `if table`;
/// the form without condition takes all else.
macro_rules! one_of {
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident {
            $(
                $(#[doc = $meaning:literal])*
                $(#[also($($also:ident),+)])?
                $variant:ident($type:ty) = $kind:expr $(, if $shape:ident)?;
            )+
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize)]
        #[serde(untagged)]
        $vis enum $name {
            $($(#[doc = $meaning])* $variant($type),)+
        }

        impl $crate::config::value::Value<$crate::config::table::unread::OneOf> for $name {
            fn read(
                _: &$crate::config::table::unread::OneOf,
                entry: &$crate::config::value::Entry<'_>,
            ) -> Option<Self> {
                use $crate::config::table::kinds::*;
                $($(
                    if entry.node.content.$shape().is_some() {
                        return <$type as $crate::config::value::Value<_>>::read(&$kind, entry).map(Self::$variant);
                    }
                )?)+
                $(one_of!(@rest $variant, $type, $kind, entry; $($shape)?);)+
                None
            }

            fn schema(
                _: &$crate::config::table::unread::OneOf,
                definitions: &mut $crate::config::value::definitions::Definitions,
            ) -> $crate::config::value::definitions::Keywords {
                use $crate::config::table::kinds::*;
                let forms = vec![$({
                    let field = $crate::config::table::field::Field {
                        key: "",
                        meaning: &[$($meaning),*],
                        also: &[$($($crate::config::table::field::Also::$also),+)?],
                    };
                    $crate::config::table::description::property::<$type, _>(&$kind, field, None, definitions)
                }),+];
                $crate::config::value::definitions::any_of(forms)
            }
        }
    };
    (@rest $variant:ident, $type:ty, $kind:expr, $entry:ident; $shape:ident) => {};
    (@rest $variant:ident, $type:ty, $kind:expr, $entry:ident;) => {
        if let Some(value) = <$type as $crate::config::value::Value<_>>::read(&$kind, $entry) {
            return Some(Self::$variant(value));
        }
    };
}
pub(in crate::config) use one_of;
