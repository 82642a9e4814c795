//! Cutting of a triangle mesh along the zero line of a scalar given at its points.

use std::collections::HashMap;

use crate::TriMesh;

/// Side of the zero line on which a triangle lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Side where the scalar is positive or zero.
    Positive,
    /// Side where the scalar is negative.
    Negative,
    /// Not to be cut; only subdivided where a neighbour was.
    Bystander,
}

/// Result of cutting a mesh.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Mesh of the same surface; old points keep their indices.
    pub mesh: TriMesh,
    /// Source triangle of each new triangle.
    pub source_face: Vec<u32>,
    /// Side of each new triangle.
    pub side: Vec<Side>,
}

/// Cuts those triangles of `mesh` that `is_cut` accepts along the zero line of `values` (one per point,
/// linear on triangles). Zero counts as positive. Triangles that share a cut edge are subdivided with it, so
/// a closed mesh stays closed.
pub fn cut_at_zero(mesh: &TriMesh, values: &[f64], is_cut: impl Fn(usize) -> bool) -> Cut {
    let positive = |v: u32| values[v as usize] >= 0.0;
    let mut points = mesh.points.clone();
    let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
    for (face, t) in mesh.triangles.iter().enumerate().filter(|(f, _)| is_cut(*f)) {
        for e in 0..3 {
            let (a, b) = (t[e].min(t[(e + 1) % 3]), t[e].max(t[(e + 1) % 3]));
            if positive(a) != positive(b) {
                middle.entry((a, b)).or_insert_with(|| {
                    let (va, vb) = (values[a as usize], values[b as usize]);
                    points.push(points[a as usize].lerp(points[b as usize], va / (va - vb)));
                    u32::try_from(points.len() - 1).expect("points are counted in 32 bits")
                });
            }
        }
        debug_assert!(face < mesh.triangles.len());
    }
    let mut cut = Cut {
        mesh: TriMesh {
            points,
            triangles: Vec::new(),
        },
        source_face: Vec::new(),
        side: Vec::new(),
    };
    for (face, t) in mesh.triangles.iter().enumerate() {
        let split: [Option<u32>; 3] = std::array::from_fn(|e| {
            let (a, b) = (t[e], t[(e + 1) % 3]);
            middle.get(&(a.min(b), a.max(b))).copied()
        });
        for part in parts_of(*t, split) {
            let corner = part.iter().copied().find(|&v| (v as usize) < mesh.points.len());
            let side = match (is_cut(face), corner) {
                (false, _) => Side::Bystander,
                (true, Some(v)) if positive(v) => Side::Positive,
                // Every part of a cut triangle keeps one of its corners.
                (true, _) => Side::Negative,
            };
            cut.mesh.triangles.push(part);
            cut.source_face.push(face as u32);
            cut.side.push(side);
        }
    }
    cut
}

/// Subdivides a triangle by points on its edges. Each part has corners on one side of these points only.
fn parts_of(t: [u32; 3], split: [Option<u32>; 3]) -> Vec<[u32; 3]> {
    let n_split = split.iter().flatten().count();
    match n_split {
        0 => vec![t],
        1 => {
            let e = split.iter().position(Option::is_some).expect("one edge is split");
            let [a, b, c] = [t[e], t[(e + 1) % 3], t[(e + 2) % 3]];
            let m = split[e].expect("this edge is split");
            vec![[a, m, c], [m, b, c]]
        }
        2 => {
            // The corner between the split edges is cut off, which leaves a quadrilateral.
            let whole = split.iter().position(Option::is_none).expect("one edge is whole");
            let [a, b, c] = [t[whole], t[(whole + 1) % 3], t[(whole + 2) % 3]];
            let (on_bc, on_ca) = (split[(whole + 1) % 3], split[(whole + 2) % 3]);
            let (m, n) = (on_bc.expect("split"), on_ca.expect("split"));
            vec![[c, n, m], [n, a, b], [n, b, m]]
        }
        _ => {
            let [x, y, z] = split.map(|s| s.expect("all edges are split"));
            vec![[t[0], x, z], [x, t[1], y], [z, y, t[2]], [x, y, z]]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solid;
    use crate::samples::cuboid;

    #[test]
    fn cutting_keeps_the_surface_closed_and_its_area() {
        let mesh = cuboid([0.0; 3], [2.0; 3]).to_mesh();
        let first = cut_at_zero(
            &mesh,
            &mesh
                .points
                .iter()
                .map(|p| p.x + 0.3 * p.y - 1.1)
                .collect::<Vec<_>>(),
            |_| true,
        );
        let below: Vec<bool> = first.side.iter().map(|s| *s == Side::Negative).collect();
        let values: Vec<f64> = first.mesh.points.iter().map(|p| p.z + 0.2 * p.x - 0.9).collect();
        let second = cut_at_zero(&first.mesh, &values, |f| below[f]);
        let solid = Solid::new(second.mesh.clone()).unwrap();
        assert!((solid.mesh().area() - 24.0).abs() < 1e-12 && (solid.volume() - 8.0).abs() < 1e-12);
        for (f, side) in second.side.iter().enumerate() {
            let c = second.mesh.face_center(f);
            match side {
                Side::Positive => assert!(c.z + 0.2 * c.x > 0.9),
                Side::Negative => assert!(c.z + 0.2 * c.x < 0.9),
                Side::Bystander => assert!(c.x + 0.3 * c.y > 1.1),
            }
        }
    }
}
