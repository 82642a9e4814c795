//! Primitives of meshes: their triangles, with points and colours.

use glam::DVec3;
use serde_json::Value;

use super::super::ReadError;
use super::super::point_colors::{Color, eight_bits};
use super::document::{Mesh, Primitive};
use super::values::{Accessors, Shape, Values};
use super::{compression, error, is_compressed};

/// Values of `mode` for triangles; lower ones are points and lines.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;
/// JSON pointers to the colour and texture of an older kind of material.
const GLOSSINESS_COLOR: &str = "/extensions/KHR_materials_pbrSpecularGlossiness/diffuseFactor";
const GLOSSINESS_TEXTURE: &str = "/extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture";
/// Default colour of points, and neutral factor.
const WHITE: [f64; 4] = [1.0; 4];

/// Counts of a mesh's primitives by kind.
#[derive(Default)]
pub(super) struct Counts {
    pub(super) n_triangles: u64,
    /// Number of primitives of lines or points.
    pub(super) n_without_triangles: usize,
    /// Indices of the primitives that have triangles.
    pub(super) with_triangles: Vec<usize>,
}

/// A primitive in the mesh's own space, reduced to the points that its triangles use: many primitives may
/// share the accessors of all points.
pub(super) struct Piece {
    /// Accessor of the points.
    pub(super) position: usize,
    /// Number of rows in that accessor.
    pub(super) n_rows: usize,
    /// Indices of the rows in use, ascending.
    pub(super) used: Vec<u32>,
    /// One point for each of `used`.
    pub(super) points: Vec<DVec3>,
    /// Corners as indices into `used`.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Colours of a primitive's points, one for each of those in use.
pub(super) struct PointColors {
    pub(super) colors: Vec<Color>,
    /// True if the primitive has an accessor of colours, not only its material's colour.
    pub(super) are_own: bool,
}

impl Accessors<'_> {
    /// Counts the primitives of `mesh` from their declarations alone.
    pub(super) fn count(&self, mesh: &Mesh) -> Result<Counts, ReadError> {
        let mut counts = Counts::default();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let n_triangles = self.n_triangles(primitive)?;
            if n_triangles > 0 {
                counts.n_triangles = counts.n_triangles.saturating_add(n_triangles as u64);
                counts.with_triangles.push(number);
            } else if primitive.mode.is_some_and(|mode| mode < TRIANGLES) {
                counts.n_without_triangles += 1;
            }
        }
        Ok(counts)
    }

    fn n_triangles(&self, primitive: &Primitive) -> Result<usize, ReadError> {
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return match compression(&primitive.extensions) {
                Some(name) => Err(is_compressed(name)),
                None => Ok(0),
            };
        };
        let n_corners = self.accessor(primitive.indices.unwrap_or(position))?.count;
        Ok(match primitive.mode.unwrap_or(TRIANGLES) {
            TRIANGLES => n_corners / 3,
            STRIP | FAN => n_corners.saturating_sub(2),
            _ => 0,
        })
    }

    /// Reads the triangles of a primitive that has some.
    pub(super) fn piece(&self, primitive: &Primitive) -> Result<Piece, ReadError> {
        let position = primitive.attributes.get("POSITION");
        let position = *position.ok_or_else(|| error("a primitive has no points"))?;
        self.check_plain(primitive, position)?;
        let rows = self.values(position, Shape::Vec3)?;
        let indices = primitive.indices.map(|i| self.values(i, Shape::Scalar));
        let mut triangles = triangles(primitive.mode, rows.count, indices.transpose()?.as_ref())?;
        let used = make_compact(&mut triangles, rows.count);
        let points = used.iter().map(|&row| rows.row(row as usize).into());
        Ok(Piece {
            position,
            n_rows: rows.count,
            points: points.collect(),
            used,
            triangles,
        })
    }

    /// Returns an error for a primitive whose data only an extension can unpack.
    fn check_plain(&self, primitive: &Primitive, position: usize) -> Result<(), ReadError> {
        let Some(name) = compression(&primitive.extensions) else {
            return Ok(());
        };
        for which in [Some(position), primitive.indices].into_iter().flatten() {
            let accessor = self.accessor(which)?;
            if accessor.buffer_view.is_none() && accessor.sparse.is_none() {
                return Err(is_compressed(name));
            }
        }
        Ok(())
    }

    /// Computes the displayed colours of the points of `piece`: point colours times the material's colour.
    pub(super) fn colors(&self, primitive: &Primitive, piece: &Piece) -> Result<PointColors, ReadError> {
        let material = primitive.material.and_then(|m| self.document.materials.get(m));
        let factor = material.map_or(WHITE, base_color);
        let own = primitive.attributes.get("COLOR_0");
        let of = |color: [f64; 4]| std::array::from_fn(|c| eight_bits(color[c] * factor[c]));
        let Some(&own) = own else {
            return Ok(PointColors {
                colors: vec![of(WHITE); piece.used.len()],
                are_own: false,
            });
        };
        let shape = self.shape(own, &[Shape::Vec3, Shape::Vec4])?;
        let values = self.values(own, shape)?;
        if values.count != piece.n_rows {
            return Err(error(format!(
                "{} points have {} colours",
                piece.n_rows, values.count
            )));
        }
        let color = |&row: &u32| {
            of(if shape == Shape::Vec4 {
                values.row(row as usize)
            } else {
                let [red, green, blue] = values.row(row as usize);
                [red, green, blue, 1.0]
            })
        };
        Ok(PointColors {
            colors: piece.used.iter().map(color).collect(),
            are_own: true,
        })
    }

    /// True if an image colours the primitive.
    pub(super) fn has_texture(&self, primitive: &Primitive) -> bool {
        let textures = ["/pbrMetallicRoughness/baseColorTexture", GLOSSINESS_TEXTURE];
        let material = primitive.material.and_then(|m| self.document.materials.get(m));
        material.is_some_and(|material| textures.iter().any(|at| material.pointer(at).is_some()))
    }
}

/// Colour factor of a material; missing numbers are 1.
fn base_color(material: &Value) -> [f64; 4] {
    let factors = ["/pbrMetallicRoughness/baseColorFactor", GLOSSINESS_COLOR];
    let factor = factors.iter().find_map(|at| material.pointer(at));
    std::array::from_fn(|c| factor.and_then(|f| f.get(c)?.as_f64()).unwrap_or(1.0))
}

/// Triangles of a mode as rows of points, all less than `n_rows`.
fn triangles(mode: Option<u32>, n_rows: usize, indices: Option<&Values>) -> Result<Vec<[u32; 3]>, ReadError> {
    let n_corners = indices.map_or(n_rows, |i| i.count);
    let corner = |i: usize| {
        let row = indices.map_or(i, |values| values.index(i));
        match u32::try_from(row) {
            Ok(index) if row < n_rows => Ok(index),
            _ => Err(error(format!("a triangle uses point {row} of {n_rows}"))),
        }
    };
    let triangle = |corners: [usize; 3]| -> Result<[u32; 3], ReadError> {
        let [a, b, c] = corners.map(corner);
        Ok([a?, b?, c?])
    };
    match mode.unwrap_or(TRIANGLES) {
        STRIP => (2..n_corners)
            .map(|i| {
                triangle(if i % 2 == 0 {
                    [i - 2, i - 1, i]
                } else {
                    [i - 1, i - 2, i]
                })
            })
            .collect(),
        FAN => (2..n_corners).map(|i| triangle([0, i - 1, i])).collect(),
        _ => (0..n_corners / 3)
            .map(|t| triangle([3 * t, 3 * t + 1, 3 * t + 2]))
            .collect(),
    }
}

/// Returns the rows that `triangles` use, ascending, and turns their corners into indices into those.
///
/// Work and memory grow with the triangles, not with `n_rows`: many primitives may share those rows, and
/// sparse accessors need not back them with bytes.
fn make_compact(triangles: &mut [[u32; 3]], n_rows: usize) -> Vec<u32> {
    /// Ratio of rows to corners up to which a table of all rows is faster than a search.
    const SPARSE: usize = 4;
    let corners = triangles.as_flattened_mut();
    if n_rows > SPARSE * corners.len() {
        let mut used = corners.to_vec();
        used.sort_unstable();
        used.dedup();
        for corner in corners {
            *corner = used.partition_point(|row| row < corner) as u32;
        }
        return used;
    }
    let mut index_of = vec![u32::MAX; n_rows];
    corners.iter().for_each(|&row| index_of[row as usize] = 0);
    let mut used = Vec::new();
    for (row, index) in (0_u32..).zip(&mut index_of) {
        if *index == 0 {
            *index = used.len() as u32;
            used.push(row);
        }
    }
    for corner in corners {
        *corner = index_of[*corner as usize];
    }
    used
}
