//! Words of the configuration that stand for one of a few possibilities.

/// An enum whose variants are written as words.
pub(in crate::config) trait Choice: Copy + 'static {
    /// Name of the enum.
    const NAME: &'static str;
    /// Lines that describe the enum.
    const ABOUT: &'static [&'static str];
    /// Words of earlier versions and the words that took their place: still read, with a notice.
    const FORMER: &'static [(&'static str, &'static str)];

    /// Words and variants, and lines that describe each.
    fn choices() -> Vec<(&'static str, Self, &'static [&'static str])>;
}

/// Declares such an enum: the word, the variant, its meaning, its form in `resolved.toml` and in the schema stay together.
/// A word of earlier versions stands behind the new one: `"new" | "old"`.
macro_rules! choice {
    (
        $(#[doc = $about:literal])*
        $vis:vis enum $name:ident { $($(#[doc = $meaning:literal])* $variant:ident = $word:literal $(| $former:literal)?,)+ }
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
        $vis enum $name {
            $($(#[doc = $meaning])* #[serde(rename = $word)] $variant,)+
        }

        $crate::config::value::choice::choice!(
            @impl $(#[doc = $about])* $name { $($(#[doc = $meaning])* $variant = $word $(| $former)?,)+ }
        );

        impl $name {
            /// The word of the configuration.
            $vis fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }
        }
    };
    // Words of an enum that a lower crate defines.
    (
        $(#[doc = $about:literal])*
        $vis:vis use $($path:ident)::+ as $name:ident { $($(#[doc = $meaning:literal])* $variant:ident = $word:literal,)+ }
    ) => {
        $vis use $($path)::+::$name;

        $crate::config::value::choice::choice!(
            @impl $(#[doc = $about])* $name { $($(#[doc = $meaning])* $variant = $word,)+ }
        );
    };
    (
        @impl $(#[doc = $about:literal])*
        $name:ident { $($(#[doc = $meaning:literal])* $variant:ident = $word:literal $(| $former:literal)?,)+ }
    ) => {
        impl $crate::config::value::choice::Choice for $name {
            const NAME: &'static str = stringify!($name);
            const ABOUT: &'static [&'static str] = &[$($about),*];
            const FORMER: &'static [(&'static str, &'static str)] = &[$($(($former, $word),)?)+];

            fn choices() -> Vec<(&'static str, Self, &'static [&'static str])> {
                vec![$(($word, Self::$variant, &[$($meaning),*] as &[&str])),+]
            }
        }
    };
}
pub(in crate::config) use choice;
