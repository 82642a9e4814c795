//! Accessors: rows of numbers within buffers, dense or sparse.

use super::super::ReadError;
use super::buffers::Content;
use super::document::{Accessor, Document, Sparse};
use super::effort::Effort;
use super::{compression, error, is_compressed, missing_error};

/// Supported shapes of rows.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Shape {
    Scalar,
    Vec3,
    Vec4,
    Mat4,
}

impl Shape {
    /// Name in `type`, and count of numbers in a row.
    fn name_and_columns(self) -> (&'static str, usize) {
        match self {
            Self::Scalar => ("SCALAR", 1),
            Self::Vec3 => ("VEC3", 3),
            Self::Vec4 => ("VEC4", 4),
            Self::Mat4 => ("MAT4", 16),
        }
    }
}

/// Rows of an accessor, each of them backed by bytes or zero.
pub(super) struct Values<'a> {
    /// Rows before sparse replacement; all zeros if absent.
    base: Option<Rows<'a>>,
    sparse: Option<Replaced<'a>>,
    component: ComponentType,
    is_normalized: bool,
    /// Number of rows. No bytes back it if `base` is absent.
    pub(super) count: usize,
}

/// Rows at a constant stride.
struct Rows<'a> {
    bytes: &'a [u8],
    stride: usize,
}

/// Rows that replace rows of the base.
struct Replaced<'a> {
    /// Pairs of a replaced row and the place of its replacement, ascending by row.
    places: Vec<(u32, u32)>,
    rows: Rows<'a>,
}

#[derive(Clone, Copy)]
enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
    F64,
}

impl ComponentType {
    fn of(code: u32) -> Result<Self, ReadError> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            // Code of KHR_accessor_float64.
            5130 => Self::F64,
            _ => return Err(error(format!("{code} is no type of number"))),
        })
    }

    fn n_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Reads the number at the beginning of `b`. Returns it and the greatest number of its type.
    fn read(self, b: &[u8]) -> (f64, f64) {
        match self {
            Self::I8 => (f64::from(b[0] as i8), 127.0),
            Self::U8 => (f64::from(b[0]), 255.0),
            Self::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            Self::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            Self::U32 => (
                f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                f64::from(u32::MAX),
            ),
            Self::F32 => (f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])), 1.0),
            Self::F64 => (
                f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]),
                1.0,
            ),
        }
    }
}

impl Values<'_> {
    /// Returns the `N` numbers of a row. `N` must be that of the requested shape, and `row` less than the
    /// count.
    pub(super) fn row<const N: usize>(&self, row: usize) -> [f64; N] {
        let replaced = self.sparse.as_ref().and_then(|sparse| {
            let place = |i: usize| (&sparse.rows, sparse.places[i].1 as usize);
            let found = sparse.places.binary_search_by_key(&row, |&(at, _)| at as usize);
            found.ok().map(place)
        });
        let Some((rows, row)) = replaced.or_else(|| Some((self.base.as_ref()?, row))) else {
            return [0.0; N];
        };
        let first = row * rows.stride;
        std::array::from_fn(|column| {
            let (value, greatest) = self
                .component
                .read(&rows.bytes[first + column * self.component.n_bytes()..]);
            if self.is_normalized {
                (value / greatest).max(-1.0)
            } else {
                value
            }
        })
    }

    /// Returns the only number of a row as an index; negative ones become 0.
    pub(super) fn index(&self, row: usize) -> usize {
        let [index] = self.row(row);
        index as usize
    }
}

/// The accessors of a document, with the bytes that they read.
pub(super) struct Accessors<'a> {
    pub(super) document: &'a Document,
    pub(super) contents: Vec<Content<'a>>,
    pub(super) effort: Effort,
}

impl Accessors<'_> {
    pub(super) fn accessor(&self, which: usize) -> Result<&Accessor, ReadError> {
        let accessors = &self.document.accessors;
        accessors
            .get(which)
            .ok_or_else(|| missing_error("accessor", which))
    }

    /// Returns the shape of accessor `which`; an error unless it is one of `shapes`.
    pub(super) fn shape(&self, which: usize, shapes: &[Shape]) -> Result<Shape, ReadError> {
        let kind = &self.accessor(which)?.kind;
        let found = shapes.iter().find(|shape| shape.name_and_columns().0 == kind);
        found.copied().ok_or_else(|| {
            let names: Vec<&str> = shapes.iter().map(|shape| shape.name_and_columns().0).collect();
            error(format!("accessor {which} is not of type {}", names.join(" or ")))
        })
    }

    /// Returns the rows of accessor `which`, which must have the given shape and data.
    pub(super) fn values(&self, which: usize, shape: Shape) -> Result<Values<'_>, ReadError> {
        let values = self.values_or_zeros(which, shape)?;
        if values.base.is_none() && values.sparse.is_none() {
            return Err(error(format!("accessor {which} has no data")));
        }
        Ok(values)
    }

    /// Returns the rows of accessor `which`; zeros if it has no data, as the specification demands.
    pub(super) fn values_or_zeros(&self, which: usize, shape: Shape) -> Result<Values<'_>, ReadError> {
        let accessor = self.accessor(which)?;
        self.shape(which, &[shape])?;
        let component = ComponentType::of(accessor.component_type)?;
        let row_bytes = shape.name_and_columns().1 * component.n_bytes();
        let rows = |view, offset, count| self.rows(view, offset, count, row_bytes, which);
        let base = accessor.buffer_view;
        let base = base.map(|view| rows(view, accessor.byte_offset, accessor.count));
        let replaced = |sparse: &Sparse| {
            let part = &sparse.values;
            Ok(Replaced {
                places: self.replaced_rows(sparse, accessor.count, which)?,
                rows: rows(part.buffer_view, part.byte_offset, sparse.count)?,
            })
        };
        let sparse = accessor.sparse.as_ref().filter(|sparse| sparse.count > 0);
        Ok(Values {
            base: base.transpose()?,
            sparse: sparse.map(replaced).transpose()?,
            component,
            is_normalized: accessor.normalized,
            count: accessor.count,
        })
    }

    /// Lists the rows that a sparse accessor of `count` rows replaces, ascending. If a row occurs twice, the
    /// last entry wins.
    fn replaced_rows(
        &self,
        sparse: &Sparse,
        count: usize,
        which: usize,
    ) -> Result<Vec<(u32, u32)>, ReadError> {
        let part = &sparse.indices;
        let component = ComponentType::of(part.component_type)?;
        let values = Values {
            base: Some(self.rows(
                part.buffer_view,
                part.byte_offset,
                sparse.count,
                component.n_bytes(),
                which,
            )?),
            sparse: None,
            component,
            is_normalized: false,
            count: sparse.count,
        };
        self.effort.spend(sparse.count)?;
        let mut places = Vec::with_capacity(sparse.count);
        for place in 0..sparse.count {
            let row = values.index(place);
            match (u32::try_from(row), u32::try_from(place)) {
                (Ok(index), Ok(place)) if row < count => places.push((index, place)),
                _ => {
                    return Err(error(format!("accessor {which} replaces row {row} of {count}")));
                }
            }
        }
        // Rows are ascending in files that obey the specification, which the sort detects at once.
        places.sort();
        places.dedup_by(|later, kept| {
            let is_same = later.0 == kept.0;
            if is_same {
                kept.1 = later.1;
            }
            is_same
        });
        Ok(places)
    }

    /// Finds `count` rows of `row_bytes` bytes in buffer view `view`; an error if the bytes do not suffice.
    fn rows(
        &self,
        view: usize,
        byte_offset: usize,
        count: usize,
        row_bytes: usize,
        which: usize,
    ) -> Result<Rows<'_>, ReadError> {
        let views = &self.document.buffer_views;
        let view = views
            .get(view)
            .ok_or_else(|| missing_error("buffer view", view))?;
        let content = self.contents.get(view.buffer);
        let content = content.ok_or_else(|| missing_error("buffer", view.buffer))?;
        let Some(buffer) = content.bytes(view.buffer)? else {
            return Err(match compression(&view.extensions) {
                Some(name) => is_compressed(name),
                None => error(format!("buffer {} has no data", view.buffer)),
            });
        };
        let stride = view.byte_stride.unwrap_or(row_bytes).max(row_bytes);
        let needed = count
            .checked_sub(1)
            .map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(row_bytes));
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end
            .and_then(|end| buffer.get(view.byte_offset..end))
            .and_then(|bytes| bytes.get(byte_offset..));
        match (bytes, needed) {
            (Some(bytes), Some(needed)) if bytes.len() >= needed => Ok(Rows { bytes, stride }),
            _ => Err(error(format!(
                "accessor {which} reaches beyond its data; the file was cut off"
            ))),
        }
    }
}
