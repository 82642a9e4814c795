//! Page, picture and booklet of a kit.

use std::path::Path;

use shellock::design::{Design, Kit, Settings};
use shellock::verify::{Check, Finding, Play};
use shellock::{IdVec, PatchId, Warning};
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_print::booklet::{Booklet, Borne, WeakPlace, looks};
use shellock_render::{
    ReportCheck, ReportData, ReportMotion, ReportMove, ReportPiece, ReportPlace, ReportQuantity, html,
    palette, pieces_picture,
};

use crate::bears;
use crate::causes::Cause;
use crate::fonts;
use crate::input::Model;
use crate::loads;
use crate::options::Options;
use crate::place::Standing;
use crate::printing::Printing;
use crate::summary::{Summary, connector_sizes};
use crate::tabs;
use crate::told::{bearing, scope, wall_kinds, wall_words};
use crate::upright::turn_upright;

/// Builds the page, the picture, and the booklet if it is wanted. All show the model upright: `up` becomes z.
pub fn report(
    model: &Model,
    options: &Options,
    settings: &Settings,
    design: &Design,
    warnings: &[Warning],
    summary: &Summary,
    (figures, printing): (Vec<(String, String)>, &Printing),
) -> (Vec<u8>, Vec<u8>, Option<Vec<u8>>) {
    let stand = |v: Vec3| turn_upright(options.up, v);
    let shown = upright_pieces(printing.simple_pieces(), stand);
    let standing = Standing::of(options.up, model.solid.mesh());
    let failed = design.kit.verification.findings.iter();
    let failed = failed.map(|finding| failure(finding, &standing));
    let warnings: Vec<Warning> = failed
        .chain(warnings.iter().cloned())
        .map(|w| w.move_by(|at| stand(Vec3::from_array(at)).to_array()))
        .collect();
    let pieces = pieces(design, &shown, stand);
    let facts = kit_facts(&shown, settings, design, summary, &standing);
    let quantities = quantities(design);
    let looks = looks(&pieces);
    let has_passed = design.kit.verification.has_passed();
    // A kit that failed is not to be printed.
    let tabs = if has_passed {
        vec![
            tabs::print(printing, !options.no_booklet),
            tabs::care(printing.printer()),
        ]
    } else {
        Vec::new()
    };
    let data = ReportData {
        title: model.name.clone(),
        facts,
        pieces,
        checks: checks(design),
        warnings: &warnings,
        figures,
        quantities,
        motions: motions(design, stand),
        loads: loads::loads(design, &standing, stand),
        looks,
        tabs,
    };
    let booklet = Booklet {
        title: title(&model.name),
        lines: cover_lines(&shown),
        bears: loads_on_page(design, &data.loads.weakest),
        pieces: data.pieces.clone(),
        before: if has_passed {
            tabs::before(printing)
        } else {
            vec![tabs::failure_section()]
        },
        after: tabs::after(has_passed),
        paper: options.paper.into(),
        fonts: fonts::of_name(model, options),
    };
    let (page, (picture, booklet)) = rayon::join(
        || html(&data).into_bytes(),
        || {
            rayon::join(
                || pieces_picture(&data.pieces).png(),
                || (!options.no_booklet).then(|| booklet.pdf()),
            )
        },
    );
    (page, picture, booklet)
}

fn pieces<'a>(design: &Design, shown: &'a [TriMesh], stand: impl Fn(Vec3) -> Vec3) -> Vec<ReportPiece<'a>> {
    let plan = &design.kit.plan;
    let piece = |p: PatchId| ReportPiece {
        number: p.number(),
        name: format!("piece {p}"),
        color: palette::color(p.into()),
        mesh: &shown[usize::from(p)],
        installation_direction: stand(-plan.separation(p).unit()).to_array(),
        order: p.into(),
        is_key: plan.key() == p,
        facts: piece_facts(design, p),
    };
    design.kit.pieces.ids().map(piece).collect()
}

fn checks(design: &Design) -> Vec<ReportCheck> {
    let checks = design.kit.verification.checks.iter();
    let check = |c: &Check| ReportCheck {
        name: c.name.clone(),
        ok: c.ok,
        figure: c.figure.clone(),
    };
    checks.map(check).collect()
}

/// Motions that the page can show: each piece within its play, and the ways out that were found.
fn motions(design: &Design, stand: impl Fn(Vec3) -> Vec3) -> Vec<ReportMotion> {
    let turned = |v: [f64; 3]| stand(Vec3::from(v)).to_array();
    let pose = |[x, y, z, u, v, w]: [f64; 6]| {
        let ([x, y, z], [u, v, w]) = (turned([x, y, z]), turned([u, v, w]));
        [x, y, z, u, v, w]
    };
    let shake = |(piece, swings): (PatchId, &Vec<[f64; 6]>)| ReportMove {
        piece: usize::from(piece),
        about: turned(design.kit.pieces[piece].centroid().to_array()),
        // There and back: between any two poses the piece returns to its place.
        poses: swings.iter().flat_map(|swing| [pose(*swing), [0.0; 6]]).collect(),
    };
    let moves: Vec<ReportMove> = design
        .kit
        .play
        .swings
        .iter()
        .filter(|(piece, swings)| *piece != design.kit.plan.key() && !swings.is_empty())
        .map(shake)
        .collect();
    let title = "each piece moves as far as its clearance allows while the others stay still".to_owned();
    let shake = ReportMotion {
        name: "shake".into(),
        title,
        is_loop: true,
        moves,
    };
    let way_out = |(piece, poses): &(PatchId, Vec<[f64; 6]>)| ReportMotion {
        name: format!("piece {piece} comes out"),
        title: format!("piece {piece} can be worked loose although it is not the key: do not print this kit"),
        is_loop: false,
        moves: vec![ReportMove {
            piece: usize::from(*piece),
            about: turned(design.kit.pieces[*piece].centroid().to_array()),
            poses: poses.iter().map(|p| pose(*p)).collect(),
        }],
    };
    let ways_out = design.kit.play.ways_out.iter().flatten().map(way_out);
    (!shake.moves.is_empty())
        .then_some(shake)
        .into_iter()
        .chain(ways_out)
        .collect()
}

/// Loads as the booklet shows them.
fn loads_on_page(design: &Design, weakest: &Option<(String, ReportPlace)>) -> Option<Borne> {
    let holding = &design.kit.holding;
    let bears = holding.summary()?;
    let between = holding.weakest_use().and_then(|worst| worst.first);
    let place = weakest.as_ref().zip(between);
    Some(Borne {
        figures: bears::figures(&bears)
            .into_iter()
            .map(|(what, much)| (what.to_owned(), much))
            .collect(),
        note: bears::BY_SIMULATION.to_owned(),
        weakest: place.map(|((words, place), first)| WeakPlace {
            words: words.clone(),
            at: Vec3::from(place.at),
            lines: place
                .lines
                .iter()
                .map(|line| line.iter().map(|p| Vec3::from(*p)).collect())
                .collect(),
            between: first.between.map(PatchId::number),
        }),
    })
}

/// Turns a failed check into an entry of the list of warnings.
fn failure(finding: &Finding, standing: &Standing) -> Warning {
    Warning::new(
        Cause::Failed {
            finding: finding.describe(standing),
        },
        Vec::new(),
        finding.place(),
    )
}

/// Upright pieces, simplified to a tolerance that the eye cannot see.
fn upright_pieces(pieces: &[TriMesh], stand: impl Fn(Vec3) -> Vec3) -> Vec<TriMesh> {
    let stand = |mesh: &TriMesh| TriMesh {
        points: mesh.points.iter().map(|&p| stand(p)).collect(),
        triangles: mesh.triangles.clone(),
    };
    pieces.iter().map(stand).collect()
}

/// Facts about the kit that people ask for.
fn kit_facts(
    shown: &[TriMesh],
    settings: &Settings,
    design: &Design,
    summary: &Summary,
    standing: &Standing,
) -> Vec<(String, String)> {
    let mut facts: Vec<(String, String)> = vec![
        ("size".into(), size(shown)),
        ("pieces".into(), design.kit.pieces.len().to_string()),
        ("wall".into(), format!("{:.2} mm", design.kit.thickness_mm)),
        ("connectors".into(), format!("{} mm", connector_sizes(design))),
        (
            "clearance".into(),
            format!("{} mm", settings.connector.clearance_mm),
        ),
        (
            "material".into(),
            format!(
                "{:.0} g without supports, {:.0} % of the solid model",
                summary.grams,
                100.0 * summary.volume_ratio
            ),
        ),
        ("print accuracy needed".into(), printed_within(design)),
        (
            "seams with connectors".into(),
            format!(
                "{:.0} % of the length that has room for them",
                100.0 * summary.connector_share
            ),
        ),
    ];
    let kinds = wall_words(&wall_kinds(design, summary.grams));
    facts.extend(kinds.map(|words| ("kinds of wall".into(), words)));
    facts.extend(
        design
            .strength
            .iter()
            .map(|s| ("fall".into(), bearing(s, settings, standing))),
    );
    if design.kit.deformation.loads.is_empty() {
        facts.extend(bearing_facts(design, standing));
    }
    facts.extend(plan_facts(design, standing));
    facts
}

/// Facts about the loads that the kit can take.
fn bearing_facts(design: &Design, standing: &Standing) -> Vec<(String, String)> {
    let holding = &design.kit.holding;
    let Some(summary) = holding.summary() else {
        return Vec::new();
    };
    let mut facts: Vec<(String, String)> = bears::figures(&summary)
        .into_iter()
        .map(|(what, much)| (what.to_owned(), much))
        .collect();
    facts.extend(bears::weakest(holding, standing).map(|w| ("fails first".to_owned(), w)));
    facts.push((
        "source of these figures".to_owned(),
        bears::BY_SIMULATION.to_owned(),
    ));
    facts
}

/// Size of the assembled kit, in words.
fn size(shown: &[TriMesh]) -> String {
    let size = shown
        .iter()
        .fold(Aabb::EMPTY, |b, mesh| b.union(mesh.bounds()))
        .size();
    format!("{:.1} × {:.1} × {:.1} mm high", size.x, size.y, size.z)
}

/// Heading made from a file's name.
fn title(name: &str) -> String {
    Path::new(name)
        .file_stem()
        .map_or_else(|| name.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// Lines on the booklet's cover, for the person who builds the kit.
fn cover_lines(shown: &[TriMesh]) -> Vec<String> {
    vec![
        format!("{} pieces, {}", shown.len(), size(shown)),
        "no glue: each piece locks those before it, and the last one, the key, locks them all".to_owned(),
    ]
}

/// Precision that the printer needs, in words.
fn printed_within(design: &Design) -> String {
    match design.fit.within_mm {
        Some(mm) if mm > 0.0 => format!("± {mm:.2} mm"),
        _ => "surfaces overlap; see the warnings".to_owned(),
    }
}

/// Facts about the plan: its cost, and its weakest places, described for the model as it stands.
fn plan_facts(design: &Design, standing: &Standing) -> Vec<(String, String)> {
    let Kit {
        proof: p, holding, ..
    } = &design.kit;
    let how = if p.optimal {
        "proven to be the least possible with".into()
    } else {
        format!("no less than {:.2} is possible with", p.lower_bound)
    };
    let cost = (
        "cost of the plan".into(),
        format!("{:.2}; {how} {}", p.cost, scope(p)),
    );
    let weakest = holding.seams.first().map(|s| {
        let place = standing.words(s.at);
        let figure = format!(
            "{} and {}, {place}: opens {:.2} mm at 10 N/m; {}",
            s.later, s.earlier, s.opening_mm, s.reason
        );
        ("weakest seam".into(), figure)
    });
    let loose = holding.loose.iter().map(|part| {
        (
            "comes apart".into(),
            format!("piece {}, {}, at 10 N/m", part.piece, standing.words(part.at)),
        )
    });
    [cost].into_iter().chain(weakest).chain(loose).collect()
}

/// Quantities that the page can colour pieces by.
fn quantities(design: &Design) -> Vec<ReportQuantity> {
    // The key is meant to leave. Its travel, which only unevenness of the surfaces stops, would drown the
    // differences between the others.
    let translation_mm = |play: &IdVec<PatchId, Option<Play>>| {
        let of_piece = |(id, p): (PatchId, &Option<Play>)| {
            p.filter(|_| id != design.kit.plan.key())
                .map(|p| p.translation_mm)
        };
        play.iter().map(of_piece).collect::<Vec<Option<f64>>>()
    };
    let order = design
        .kit
        .pieces
        .ids()
        .map(|p| Some(design.kit.plan.position(p) as f64 + 1.0))
        .collect();
    let mut quantities = vec![
        ("order", "", order),
        ("play", "mm", translation_mm(&design.kit.play.alone)),
    ];
    quantities.extend(
        design
            .kit
            .play
            .together
            .as_ref()
            .map(|play| ("play with others", "mm", translation_mm(play))),
    );
    let quantity = |(name, unit, values): (&str, &str, _)| ReportQuantity {
        name: name.into(),
        unit: unit.into(),
        values,
    };
    quantities.into_iter().map(quantity).collect()
}

/// Facts about a piece: its volume, cost, play, and the opening of each of its seams.
fn piece_facts(design: &Design, piece: PatchId) -> Vec<(String, String)> {
    let mut facts = vec![
        (
            "volume".to_owned(),
            format!("{:.1} cm³", design.kit.pieces[piece].signed_volume() / 1000.0),
        ),
        (
            "cost in the plan".to_owned(),
            format!("{:.2}", design.kit.proof.piece_costs[piece]),
        ),
    ];
    let play = |p: Play| {
        let proven = if p.is_proven { "" } else { ", not proven" };
        format!("{:.2} mm, {:.2}°{proven}", p.translation_mm, p.rotation_deg)
    };
    facts.extend(design.kit.play.alone[piece].map(|p| ("play".to_owned(), play(p))));
    let together = design.kit.play.together.as_ref().and_then(|all| all[piece]);
    facts.extend(together.map(|p| ("play with others".to_owned(), play(p))));
    let seams = design.kit.holding.seams.iter();
    for s in seams.filter(|s| s.later == piece || s.earlier == piece) {
        let other = if s.later == piece { s.earlier } else { s.later };
        facts.push((
            format!("seam with {other}"),
            format!("opens {:.2} mm at 10 N/m", s.opening_mm),
        ));
    }
    facts
}
