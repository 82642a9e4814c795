//! Sequence of a PLY's values, from words or from bytes.

use super::super::text::{Lines, coordinate, words};
use super::super::{Place, ReadError};
use super::header::Scalar;

/// Source of the next number; `f64` represents all types of PLY exactly.
pub(super) trait Source {
    /// Reads the next number, declared as `scalar`.
    fn next(&mut self, scalar: Scalar) -> Result<f64, ReadError>;
    /// Place of the next number, or of the last one in a text.
    fn place(&self) -> Place;
}

const CUT_OFF: &str = "the points or faces";

/// Values as words; rows may be broken into lines in any way.
pub(super) struct Words<'a> {
    lines: Lines<'a>,
    line: &'a [u8],
}

impl<'a> Words<'a> {
    pub(super) fn of(lines: Lines<'a>) -> Self {
        Self { lines, line: b"" }
    }
}

impl Source for Words<'_> {
    fn next(&mut self, _scalar: Scalar) -> Result<f64, ReadError> {
        loop {
            if let Some(word) = words(self.line).next() {
                let begin = self.line.trim_ascii_start();
                self.line = &begin[word.len()..];
                return coordinate(Some(word), self.place());
            }
            let Some((_, line)) = self.lines.next() else {
                return Err(ReadError::CutOff {
                    at: self.lines.place(),
                    within: CUT_OFF,
                });
            };
            self.line = line;
        }
    }

    fn place(&self) -> Place {
        self.lines.place()
    }
}

/// Values as binary numbers.
pub(super) struct Binary<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    pub(super) big_endian: bool,
}

impl Binary<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let Some(&chunk) = self.bytes[self.at..].first_chunk::<N>() else {
            return Err(ReadError::CutOff {
                at: Place::Byte(self.bytes.len()),
                within: CUT_OFF,
            });
        };
        self.at += N;
        let mut chunk = chunk;
        if self.big_endian {
            chunk.reverse();
        }
        Ok(chunk)
    }
}

impl Source for Binary<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<f64, ReadError> {
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn place(&self) -> Place {
        Place::Byte(self.at)
    }
}
