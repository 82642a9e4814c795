//! Writes `report.html` and `pieces.png` of a squirrel in made-up pieces into the folder given as first
//! argument. Shows the report without running the pipeline. The pieces are parts of the surface, not solids.

use std::path::PathBuf;

use shellock::figure::{self, Figure};
use shellock::{LatticeDirection, PatchId, Warning};
use shellock_geom::{TriMesh, Vec3};
use shellock_render::{
    ReportCheck, ReportData, ReportMotion, ReportMove, ReportPiece, ReportQuantity, html, palette,
    pieces_picture,
};

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let model = figure::make(Figure::Squirrel, 150.0, 2.0).into_mesh();
    let meshes = cut(&model);
    let pieces: Vec<ReportPiece<'_>> = meshes
        .iter()
        .enumerate()
        .map(|(i, mesh)| piece(i, mesh, meshes.len(), &model))
        .collect();
    let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
    let check = |name: &str, ok: bool, figure: &str| ReportCheck {
        name: name.into(),
        ok,
        figure: figure.into(),
    };
    let warning = Warning::new(
        shellock::causes::Make::SeamWithoutConnector { length_mm: 12.4 },
        vec![PatchId(1), PatchId(2)],
        Some([0.0, 40.0, 118.0]),
    );
    std::fs::write(folder.join("pieces.png"), pieces_picture(&pieces).png())?;
    let n = meshes.len();
    let values = (0..n)
        .map(|i| (i + 1 < n).then_some(0.2 + 0.05 * (3 * i % 7) as f64))
        .collect();
    let motions = vec![shake(&pieces), take_out(&pieces)];
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
        quantities: vec![ReportQuantity {
            name: "play".into(),
            unit: "mm".into(),
            values,
        }],
        motions,
        ..ReportData::default()
    };
    std::fs::write(folder.join("report.html"), html(&data))
}

/// Motion of all pieces but the first. Each moves slightly to and fro along its installation direction, and
/// turns slightly.
fn shake(pieces: &[ReportPiece<'_>]) -> ReportMotion {
    let sway = |piece: &ReportPiece<'_>, sign: f64| {
        let [x, y, z] = piece.installation_direction.map(|d| 0.2 * sign * d);
        [x, y, z, 0.0, 0.004 * sign, 0.0]
    };
    let to_and_fro = |(i, piece)| ReportMove {
        piece: i,
        about: middle(piece),
        poses: vec![sway(piece, 1.0), sway(piece, -1.0)],
    };
    ReportMotion {
        name: "shake".into(),
        title: "How far the pieces rattle when the finished shell is shaken.".into(),
        is_loop: true,
        moves: pieces.iter().enumerate().skip(1).map(to_and_fro).collect(),
    }
}

/// Motion of the last piece out of the assembly, against its installation direction.
fn take_out(pieces: &[ReportPiece<'_>]) -> ReportMotion {
    let last = pieces.len() - 1;
    let [x, y, z] = pieces[last].installation_direction.map(|d| -60.0 * d);
    let poses = vec![
        [0.0; 6],
        [x, y, z, 0.0, 0.0, 0.0],
        [1.5 * x, 1.5 * y, 1.5 * z, 0.0, 0.0, 0.4],
    ];
    ReportMotion {
        name: "take out the key".into(),
        title: "How the key comes out.".into(),
        is_loop: false,
        moves: vec![ReportMove {
            piece: last,
            about: middle(&pieces[last]),
            poses,
        }],
    }
}

fn middle(piece: &ReportPiece<'_>) -> [f64; 3] {
    piece.mesh.bounds().center().to_array()
}

/// Parts of the surface, each nearest to one of several points.
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
    let nearest = |p: Vec3| {
        (0..sites.len())
            .min_by(|&a, &b| p.distance(sites[a]).total_cmp(&p.distance(sites[b])))
            .unwrap()
    };
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
        number: i as u32 + 1,
        name: format!("piece {i}"),
        color: palette::color(i),
        mesh,
        installation_direction: direction.to_array(),
        order: i,
        is_key: i + 1 == count,
        facts: vec![
            ("Volume".into(), format!("{:.1} cm³", 0.002 * mesh.area())),
            (
                "Direction".into(),
                format!("{:.2} {:.2} {:.2}", direction.x, direction.y, direction.z),
            ),
        ],
    }
}
