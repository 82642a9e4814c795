//! How many pieces are asked for.

use std::str::FromStr;

/// How many pieces are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    Auto,
    Number(usize),
    FitsBed,
}

impl Pieces {
    /// Those that are asked for by number.
    pub fn number(self) -> Option<usize> {
        match self {
            Self::Number(n) => Some(n),
            Self::Auto | Self::FitsBed => None,
        }
    }
}

impl FromStr for Pieces {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.to_ascii_lowercase().as_str() {
            "auto" => Ok(Self::Auto),
            "fits-bed" => Ok(Self::FitsBed),
            number => number
                .parse()
                .map(Self::Number)
                .map_err(|_| "give a number of pieces, auto or fits-bed".to_owned()),
        }
    }
}
