//! Why a decoder returns no picture.

use crate::error::one_line;

/// Why a decoder did not return a picture.
#[derive(Debug)]
pub(crate) enum Refusal {
    /// The file may be fine, but this decoder does not support its kind: another may.
    Unsupported(String),
    /// The file is damaged, too large or not what was requested.
    Broken(String),
}

impl From<String> for Refusal {
    fn from(what: String) -> Self {
        Self::Broken(what)
    }
}

impl From<&str> for Refusal {
    fn from(what: &str) -> Self {
        Self::Broken(what.into())
    }
}

#[cfg(feature = "oiio")]
impl Refusal {
    /// Adds what the first decoder could not read, if it named that: it is a property of the file,
    /// and the reason why another decoder was tried.
    pub(crate) fn after(self, what: &str) -> Self {
        match self {
            Self::Broken(why) if what.starts_with("unsupported") => {
                Self::Broken(format!("{what} ({why})"))
            }
            other => other,
        }
    }
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            // Decoder messages may have several lines; ours have one.
            Self::Unsupported(what) | Self::Broken(what) => f.write_str(&one_line(what)),
        }
    }
}
