//! Writes `report.html` and `pieces.png` of a squirrel in made-up pieces into the folder named first: to look at the report
//! without running the pipeline. The pieces are bits of surface, not solids.

use std::path::PathBuf;

use shellock::figure::{self, Figure};
use shellock::report::{ReportCheck, ReportData, ReportPiece, ReportQuantity, html, palette, pieces_picture};
use shellock::{LatticeDirection, PatchId, Warning};
use shellock_geom::{TriMesh, Vec3};

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let model = figure::make(Figure::Squirrel, 150.0, 2.0).into_mesh();
    let meshes = cut(&model);
    let pieces: Vec<ReportPiece<'_>> =
        meshes.iter().enumerate().map(|(i, mesh)| piece(i, mesh, meshes.len(), &model)).collect();
    let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
    let check = |name: &str, ok: bool, figure: &str| ReportCheck { name: name.into(), ok, figure: figure.into() };
    let warning = Warning {
        code: "seam-without-connector".into(),
        message: "12.4 mm of seam are too strongly curved for a connector; the pieces only touch there".into(),
        pieces: vec![PatchId(1), PatchId(2)],
        at: Some([0.0, 40.0, 118.0]),
    };
    std::fs::write(folder.join("pieces.png"), pieces_picture(&pieces).png())?;
    let n = meshes.len();
    let values = (0..n).map(|i| (i + 1 < n).then_some(0.2 + 0.05 * (3 * i % 7) as f64)).collect();
    let data = ReportData {
        title: "Squirrel <sample>".into(),
        facts: vec![
            pair("Size", "101 × 142 × 150 mm"),
            pair("Wall", "2.0 mm"),
            pair("Connector", "1.6 mm"),
            pair("Clearance", "0.10 mm"),
        ],
        pieces,
        checks: vec![
            check("Pieces are closed solids", true, "8 of 8"),
            check("No overlap", true, "0.000 mm³"),
            check("Installation paths free", true, "8 of 8"),
            check("Locked while the key is held", false, "1 piece moves"),
        ],
        warnings: &[warning],
        figures: Vec::new(),
        quantities: vec![ReportQuantity { name: "play".into(), unit: "mm".into(), values }],
    };
    std::fs::write(folder.join("report.html"), html(&data))
}

/// Parts of the surface by the nearest of some points.
fn cut(model: &TriMesh) -> Vec<TriMesh> {
    let bounds = model.bounds();
    let shares = [
        [0.5, 0.25, 0.75],
        [0.5, 0.8, 0.85],
        [0.5, 0.75, 0.3],
        [0.1, 0.3, 0.2],
        [0.9, 0.3, 0.2],
        [0.1, 0.2, 0.5],
        [0.9, 0.2, 0.5],
        [0.5, 0.4, 0.0],
    ];
    let sites = shares.map(|s| bounds.min + Vec3::from_array(s) * bounds.size());
    let nearest =
        |p: Vec3| (0..sites.len()).min_by(|&a, &b| p.distance(sites[a]).total_cmp(&p.distance(sites[b]))).unwrap();
    let mut parts = vec![TriMesh::default(); sites.len()];
    let mut names = vec![std::collections::HashMap::new(); sites.len()];
    for (face, t) in model.triangles.iter().enumerate() {
        let site = nearest(model.face_center(face));
        let (part, names) = (&mut parts[site], &mut names[site]);
        let corners = t.map(|v| {
            *names.entry(v).or_insert_with(|| {
                part.points.push(model.points[v as usize]);
                part.points.len() as u32 - 1
            })
        });
        part.triangles.push(corners);
    }
    parts
}

fn piece<'a>(i: usize, mesh: &'a TriMesh, count: usize, model: &TriMesh) -> ReportPiece<'a> {
    let inwards = model.bounds().center() - mesh.bounds().center();
    let direction = LatticeDirection::nearest(inwards).unit();
    ReportPiece {
        id: i as u32,
        name: format!("piece {i}"),
        color: palette::color(i),
        mesh,
        installation_direction: direction.to_array(),
        order: i,
        is_key: i + 1 == count,
        facts: vec![
            ("Volume".into(), format!("{:.1} cm³", 0.002 * mesh.area())),
            ("Direction".into(), format!("{:.2} {:.2} {:.2}", direction.x, direction.y, direction.z)),
        ],
    }
}
