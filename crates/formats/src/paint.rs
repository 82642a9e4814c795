//! Multi-material paint of slicers: a tree of splits within a triangle, with a colour per leaf.
//!
//! PrusaSlicer writes it to the attribute `slic3rpe:mmu_segmentation` of a 3MF's triangles, Bambu Studio and
//! OrcaSlicer to `paint_color`. The code is the same: hexadecimal digits, the last one first. The lower two
//! bits of a digit are the number of split sides. If that is 0, the triangle is a leaf and the upper two bits
//! are its colour. The colour 3 stands for 3 plus the next digits, up to and including the first below F
//! (Bambu Studio; other slicers have 16 colours, which take one digit). Otherwise the upper two bits are the
//! special corner v₀ and the children follow, the last one first:
//!
//! ```text
//!   1 split side              2 split sides             3 split sides
//!          v0                        v0                        v0
//!         /|\                       / \                       / \
//!        / | \                     /0  \                     /0  \
//!       / 0|1 \                 m01-----m20               m01-----m20
//!      /   |   \                 / 1 __/ \                 / \ 3 / \
//!    v1----m----v2              / __/  2  \               /1  \ /  2\
//!                             v1-----------v2           v1----m12----v2
//! ```
//!
//! Colour 0 is unpainted; colour k is the k-th extruder or filament.

use std::collections::BTreeMap;

use super::ReadError;
use shellock_geom::subdivide::fill_triangle;
use shellock_geom::weld::first_equal;
use shellock_geom::{TriMesh, Vec3};

/// Largest depth of nested splits. Brushes stop at a tenth of a millimetre, which takes about 12.
const MAX_DEPTH: usize = 40;
/// Value of a digit F in a colour; the next digit is added to it.
const MOST_OF_A_DIGIT: u32 = 15;
/// Largest number of triangles that paint may produce, which limits the memory per digit of the file.
const MAX_TRIANGLES: usize = 20_000_000;

/// Encodes a triangle that has colour `color` throughout; empty for 0.
pub(super) fn whole_triangle_code(color: u32) -> String {
    match color {
        0 => String::new(),
        1..3 => format!("{:X}", color << 2),
        _ => {
            let more = "F".repeat(((color - 3) / MOST_OF_A_DIGIT) as usize);
            format!("{:X}{more}C", (color - 3) % MOST_OF_A_DIGIT)
        }
    }
}

/// A mesh divided along the paint of its triangles.
#[derive(Debug, PartialEq)]
pub(super) struct Painted {
    /// Triangles of one colour each, divided along splits of neighbours so that no corner lies within an
    /// edge.
    pub(super) mesh: TriMesh,
    /// Colour of each triangle.
    pub(super) colors: Vec<u32>,
    /// Original triangle of each one; ascending.
    pub(super) source: Vec<u32>,
}

/// Splits the triangles of `mesh` as given in `paint` (by triangle, ascending), and their neighbours so that
/// edges match.
///
/// Triangles without paint have colour 0.
pub(super) fn apply(mesh: &TriMesh, paint: &[(u32, &str)]) -> Result<Painted, ReadError> {
    if paint.is_empty() {
        let n = mesh.triangles.len();
        return Ok(Painted {
            mesh: mesh.clone(),
            colors: vec![0; n],
            source: (0..n as u32).collect(),
        });
    }
    // Points in the same place are merged here, so that neighbours match even if the file does not connect
    // them.
    let stands_for = first_equal(&mesh.points);
    let mut splitter = Splitter {
        points: mesh.points.clone(),
        middle_of: BTreeMap::new(),
        leaves: Vec::new(),
    };
    let mut next = paint.iter().peekable();
    for (face, triangle) in (0_u32..).zip(&mesh.triangles) {
        let triangle = triangle.map(|v| stands_for[v as usize]);
        match next.next_if(|(painted, _)| *painted == face) {
            Some((_, code)) => splitter.split(face, triangle, code)?,
            None => splitter.leaves.push(Leaf {
                corners: triangle,
                color: 0,
                source: face,
            }),
        }
    }
    splitter.conform()
}

struct Leaf {
    corners: [u32; 3],
    color: u32,
    source: u32,
}

struct Splitter {
    points: Vec<Vec3>,
    /// Midpoint of each split edge, by its ends, the lower first.
    middle_of: BTreeMap<(u32, u32), u32>,
    leaves: Vec<Leaf>,
}

impl Splitter {
    /// Adds the leaves of a painted triangle.
    fn split(&mut self, source: u32, triangle: [u32; 3], code: &str) -> Result<(), ReadError> {
        let wrong = || ReadError::Paint {
            face: source,
            code: code.chars().take(40).collect(),
        };
        let mut digits = code.chars().rev().map(|c| c.to_digit(16));
        let mut digit = || digits.next().flatten().ok_or_else(wrong);
        // Stack of triangles whose codes are still to come, with their depths; the next one is last.
        let mut todo = vec![(triangle, 0)];
        while let Some((corners, depth)) = todo.pop() {
            let code = digit()?;
            let (n_split, upper) = (code & 3, code >> 2);
            if n_split == 0 {
                let mut color = upper;
                while color >= 3 {
                    let more = digit()?;
                    color = color.saturating_add(more);
                    if more < MOST_OF_A_DIGIT {
                        break;
                    }
                }
                self.leaves.push(Leaf {
                    corners,
                    color,
                    source,
                });
                if self.leaves.len() > MAX_TRIANGLES {
                    return Err(ReadError::TooManyCopies {
                        what: "its paint",
                        limit: MAX_TRIANGLES as u64,
                    });
                }
                continue;
            }
            if depth == MAX_DEPTH || upper > 2 {
                return Err(wrong());
            }
            // The last child comes first in the code.
            todo.extend(
                self.children(corners, n_split, upper as usize)
                    .into_iter()
                    .map(|c| (c, depth + 1)),
            );
        }
        if digits.next().is_some() {
            Err(wrong())
        } else {
            Ok(())
        }
    }

    fn children(&mut self, corners: [u32; 3], n_split: u32, special: usize) -> Vec<[u32; 3]> {
        let [a, b, c] = [0, 1, 2].map(|k| corners[(special + k) % 3]);
        match n_split {
            1 => {
                let m = self.middle(b, c);
                vec![[a, b, m], [m, c, a]]
            }
            2 => {
                let (ab, ca) = (self.middle(a, b), self.middle(c, a));
                vec![[a, ab, ca], [ab, b, ca], [b, c, ca]]
            }
            _ => {
                let (ab, bc, ca) = (self.middle(a, b), self.middle(b, c), self.middle(c, a));
                vec![[a, ab, ca], [ab, b, bc], [bc, c, ca], [ab, bc, ca]]
            }
        }
    }

    fn middle(&mut self, a: u32, b: u32) -> u32 {
        let points = &mut self.points;
        *self.middle_of.entry((a.min(b), a.max(b))).or_insert_with(|| {
            points.push(0.5 * (points[a as usize] + points[b as usize]));
            points.len() as u32 - 1
        })
    }

    /// Divides all leaves whose sides contain points of their neighbours.
    fn conform(self) -> Result<Painted, ReadError> {
        let mut painted = Painted {
            mesh: TriMesh {
                points: self.points,
                triangles: Vec::with_capacity(self.leaves.len()),
            },
            colors: Vec::with_capacity(self.leaves.len()),
            source: Vec::with_capacity(self.leaves.len()),
        };
        let mut on_sides = [Vec::new(), Vec::new(), Vec::new()];
        for Leaf {
            corners: [a, b, c],
            color,
            source,
        } in self.leaves
        {
            for (side, (from, to)) in on_sides.iter_mut().zip([(a, b), (b, c), (c, a)]) {
                side.clear();
                add_points_between(&self.middle_of, from, to, side);
            }
            fill_triangle(
                [a, b, c],
                [&on_sides[0], &on_sides[1], &on_sides[2]],
                &mut painted.mesh.triangles,
            );
            painted.colors.resize(painted.mesh.triangles.len(), color);
            painted.source.resize(painted.mesh.triangles.len(), source);
            // If many triangles share an edge, each of them takes over all points on it.
            if painted.source.len() > MAX_TRIANGLES {
                return Err(ReadError::TooManyCopies {
                    what: "its paint",
                    limit: MAX_TRIANGLES as u64,
                });
            }
        }
        Ok(painted)
    }
}

/// Appends the points on the edge between two points, in order from `from` to `to`. The depth of paint bounds
/// the recursion.
fn add_points_between(middle_of: &BTreeMap<(u32, u32), u32>, from: u32, to: u32, found: &mut Vec<u32>) {
    if let Some(&middle) = middle_of.get(&(from.min(to), from.max(to))) {
        add_points_between(middle_of, from, middle, found);
        found.push(middle);
        add_points_between(middle_of, middle, to, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shellock_geom::check::inspect;
    use shellock_testkit::shapes::tetrahedron;

    #[test]
    fn the_colour_of_a_whole_triangle_comes_back() {
        for color in 0..=100 {
            let code = whole_triangle_code(color);
            let paint: Vec<(u32, &str)> = if code.is_empty() { vec![] } else { vec![(2, &code)] };
            let painted = apply(&tetrahedron(), &paint).unwrap();
            assert_eq!(
                (painted.mesh, painted.colors),
                (tetrahedron(), vec![0, 0, color, 0]),
                "{code}"
            );
        }
        // Codes as slicers write them.
        assert_eq!(
            [1, 2, 3, 16, 17, 18].map(whole_triangle_code),
            ["4", "8", "0C", "DC", "EC", "0FC"]
        );
    }

    #[test]
    fn split_triangles_stay_closed_and_keep_their_area_and_their_neighbours_follow() {
        // Read from the end: three sides; one; two; three, its middle child again one; two, its first child
        // again two.
        for code in ["08403", "841", "4802", "8408493", "4086402"] {
            let painted = match apply(&tetrahedron(), &[(2, code)]) {
                Ok(painted) => painted,
                Err(e) => panic!("{code}: {e}"),
            };
            let found = inspect(&painted.mesh);
            assert!(found.edges.is_closed(), "{code}: {found:?}");
            assert!((painted.mesh.area() - tetrahedron().area()).abs() < 1e-12);
            assert!((painted.mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-12);
            assert!(painted.source.is_sorted() && painted.colors.iter().any(|&c| c > 0));
        }
    }

    #[test]
    fn children_have_the_places_that_slicers_give_them() {
        // The digits from the last: three sides split, then children 3, 2, 1, 0 with colours 0, 1, 2, 3.
        let triangle = TriMesh {
            points: vec![Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0],
            triangles: vec![[0, 1, 2]],
        };
        let painted = apply(&triangle, &[(0, "0C8403")]).unwrap();
        let middle = |color: u32| {
            let face = painted.colors.iter().position(|&c| c == color).unwrap();
            3.0 * painted.mesh.face_center(face)
        };
        assert_eq!(middle(3), Vec3::new(2.0, 2.0, 0.0));
        assert_eq!(middle(2), Vec3::new(8.0, 2.0, 0.0));
        assert_eq!(middle(1), Vec3::new(2.0, 8.0, 0.0));
        assert_eq!(middle(0), Vec3::new(4.0, 4.0, 0.0));
        // One side split, opposite to corner 1: "5" is split 1, special 1; children 1 then 0.
        let painted = apply(&triangle, &[(0, "845")]).unwrap();
        let of = |color: u32| {
            painted
                .mesh
                .corners(painted.colors.iter().position(|&c| c == color).unwrap())
        };
        assert_eq!(of(2), [Vec3::X * 4.0, Vec3::Y * 4.0, Vec3::Y * 2.0]);
        assert_eq!(of(1), [Vec3::Y * 2.0, Vec3::ZERO, Vec3::X * 4.0]);
        // Two sides split, the one opposite to corner 0 kept: children 2, 1, 0.
        let painted = apply(&triangle, &[(0, "0C842")]).unwrap();
        let of = |color: u32| {
            painted
                .mesh
                .corners(painted.colors.iter().position(|&c| c == color).unwrap())
        };
        assert_eq!(of(3), [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0]);
        assert_eq!(of(2), [Vec3::X * 2.0, Vec3::X * 4.0, Vec3::Y * 2.0]);
        assert_eq!(of(1), [Vec3::X * 4.0, Vec3::Y * 4.0, Vec3::Y * 2.0]);
    }

    #[test]
    fn codes_that_end_early_or_late_or_are_no_numbers_are_refused() {
        for code in ["3", "C", "FC", "44", "G", "0000003", "ü4", &"3".repeat(1000)] {
            assert!(
                matches!(
                    apply(&tetrahedron(), &[(1, code)]),
                    Err(ReadError::Paint { face: 1, .. })
                ),
                "{code}"
            );
        }
    }
}
