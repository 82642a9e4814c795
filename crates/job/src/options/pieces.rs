//! Values of options for the number of pieces and for the key.

use std::str::FromStr;

/// Number of pieces to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// As many as the method finds.
    Auto,
    /// About this number of pieces.
    Number(usize),
    /// As few as fit the printer.
    FitsBed,
}

impl Pieces {
    /// Requested number of pieces; `None` unless it was given as a number.
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

/// Source of the key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Key {
    /// Cut out where it slides best.
    Auto,
    /// The flattest piece that works, as it is.
    Flattest,
    /// A piece, by its label or number.
    Piece(i64),
    /// Cut near this place, mm.
    Near([f64; 3]),
}

impl FromStr for Key {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.to_ascii_lowercase().as_str() {
            "auto" => Ok(Self::Auto),
            "piece" => Ok(Self::Flattest),
            number => {
                let piece = number.parse().ok().map(Self::Piece);
                piece.or_else(|| place(number).map(Self::Near)).ok_or_else(|| {
                    "give auto, piece, the number of a piece (its label, where there are labels), or a place \
                     X,Y,Z in mm"
                        .to_owned()
                })
            }
        }
    }
}

/// Parses a place `X,Y,Z` of finite coordinates.
fn place(text: &str) -> Option<[f64; 3]> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let place: [f64; 3] = numbers.ok()?.try_into().ok()?;
    place.iter().all(|x| x.is_finite()).then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_a_word_a_number_or_a_place() {
        let key = |text: &str| text.parse::<Key>().ok();
        assert!(key("auto") == Some(Key::Auto) && key("piece") == Some(Key::Flattest));
        assert!(key("-3") == Some(Key::Piece(-3)));
        assert!(key("1, -2.5,3e1") == Some(Key::Near([1.0, -2.5, 30.0])));
        for wrong in ["", "1,2", "1,2,3,4", "a,b,c", "1,2,inf", "1.5"] {
            assert!(key(wrong).is_none(), "{wrong}");
        }
    }
}
