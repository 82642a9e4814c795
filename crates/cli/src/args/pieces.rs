//! How many pieces are asked for, and which of them is the key.

use std::str::FromStr;

use clap::ValueEnum;

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

/// Whether both sides are divided alike.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Symmetric {
    On,
    Off,
}

/// Where the key comes from.
#[derive(Clone, Copy, PartialEq)]
pub enum Key {
    Auto,
    Flattest,
    Piece(i64),
}

impl FromStr for Key {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.to_ascii_lowercase().as_str() {
            "auto" => Ok(Self::Auto),
            "piece" => Ok(Self::Flattest),
            number => number.parse().map(Self::Piece).map_err(|_| {
                "give auto, piece, or the number of a piece (its label, where there are labels)".to_owned()
            }),
        }
    }
}
