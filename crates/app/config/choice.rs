//! Words of the configuration that stand for one of a few possibilities.

/// An enum whose variants are written as words.
pub(super) trait Choice: Copy + 'static {
    /// Word and variant.
    const CHOICES: &'static [(&'static str, Self)];
}

/// Declares such an enum: the word, the variant, its form in `resolved.toml` and in the schema stay together.
macro_rules! choice {
    ($(#[$meta:meta])* $vis:vis enum $name:ident { $($(#[$variant_meta:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
        $vis enum $name {
            $($(#[$variant_meta])* #[serde(rename = $word)] $variant,)+
        }

        impl $crate::config::choice::Choice for $name {
            const CHOICES: &'static [(&'static str, Self)] = &[$(($word, Self::$variant)),+];
        }

        impl $name {
            /// The word of the configuration.
            $vis fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }
        }
    };
}
pub(super) use choice;
