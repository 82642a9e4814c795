//! Judgement of pieces before they are made: whether they lock, which block others, what "Fix" would change,
//! and where a key can be.

use shellock::design::{Verdict, outlook};
use shellock::key::KeySite;
use shellock::verify::words::PlaceWords;
use shellock::{Ctx, PatchId, SegmentedSurface, Severity, Warning, plan};
use shellock_geom::{TriMesh, Vec3};
use shellock_job::bed::{fit_params, shell_of};
use shellock_job::build::check_options;
use shellock_job::options::Axis;
use shellock_job::output::turn_upright;
use shellock_job::place::Standing;
use shellock_job::{Failure, Options, Session};
use shellock_print::plates::{fits, fits_whole};

use crate::advice;
use crate::figure::{Figure, encode_upright};
use crate::messages::{Advice, Blocker, Judgement, Key, ToldPiece};
use crate::pieces::Pieces;

/// Distance of the outlines of keys from the surface, mm.
const OFF_MM: f64 = 0.6;

/// Result of a judgement.
pub struct Judged {
    /// Judgement for the page.
    pub judgement: Judgement,
    /// Labels after mending, one for each triangle that is shown.
    pub labels: Vec<u32>,
    /// Surface cut along its seams, with the page's label of each of its triangles.
    pub cut: Vec<u8>,
}

/// Judges `pieces` as they would be made with the options.
pub fn judge(
    session: &Session,
    figure: &Figure,
    options: &Options,
    pieces: &Pieces,
) -> Result<Judged, Failure> {
    let model = &figure.model;
    let labels_shown = &pieces.labels[..];
    let given: Option<Vec<i64>> = pieces
        .is_painted
        .then(|| labels_shown.iter().map(|&l| i64::from(l) + 1).collect());
    let labels = given.as_deref().or(model.labels.as_deref());
    let checked = check_options(options)?;
    // Painted labels determine the number of pieces.
    let params = if labels.is_none() {
        fit_params(session, &checked, options, model)?
    } else {
        checked
    };
    let quiet = |_: shellock::Progress<'_>| ();
    let ctx = Ctx::new(&quiet, &session.stop);
    let outlook = outlook(
        &ctx,
        &params,
        &model.solid,
        labels,
        pieces.division.as_deref().cloned(),
    )?;
    let view = View {
        up: options.up,
        upright: Standing::of(options.up, model.solid.mesh()),
        labels: labels_shown,
    };
    let mended = figure.labels_of(&outlook.division);
    let chosen = match &outlook.verdict {
        Verdict::Locks { key, .. } => *key,
        Verdict::Blocked { .. } => None,
    };
    let labels_of = view.labels(&outlook.division);
    let warnings = outlook.warnings.iter();
    let mut advice: Vec<Advice> = warnings.map(|w| view.advice(w, &labels_of)).collect();
    let pieces = told_pieces(figure, options, &view, &mut advice)?;
    let told = Judgement {
        is_mended: advice.iter().any(|advice| advice.mends),
        advice,
        pieces,
        n_pieces: outlook.division.n_patches,
        seams: view.seams(&outlook.division),
        keys: view.keys(&outlook.keys, chosen),
        ..view.verdict(&outlook.verdict)
    };
    let cut = view.cut(&outlook.division);
    Ok(Judged {
        judgement: told,
        labels: mended,
        cut,
    })
}

/// Translates places and pieces for the page: upright, and by the labels that it shows.
struct View<'a> {
    up: Axis,
    upright: Standing,
    labels: &'a [u32],
}

impl View<'_> {
    fn at(&self, place: [f64; 3]) -> [f64; 3] {
        turn_upright(self.up, Vec3::from(place)).to_array()
    }

    /// Label of the page with the largest share of each patch.
    fn labels(&self, surface: &SegmentedSurface) -> Vec<u32> {
        let mut areas = vec![std::collections::BTreeMap::<u32, f64>::new(); surface.n_patches];
        for (face, &source) in surface.source_face.iter().enumerate() {
            let label = self.labels[source as usize];
            *areas[usize::from(surface.patch_of_face[face])]
                .entry(label)
                .or_default() += surface.mesh.face_area(face);
        }
        let most = |of: &std::collections::BTreeMap<u32, f64>| {
            of.iter().max_by(|a, b| a.1.total_cmp(b.1)).map(|m| *m.0)
        };
        areas.iter().map(|of| most(of).unwrap_or_default()).collect()
    }

    fn cut(&self, surface: &SegmentedSurface) -> Vec<u8> {
        let labels = self.labels(surface);
        let mut bytes = encode_upright(
            &surface.mesh,
            self.up,
            surface.patch_of_face.iter().map(|_| false),
        );
        bytes.extend(
            surface
                .patch_of_face
                .iter()
                .flat_map(|&p| labels[usize::from(p)].to_le_bytes()),
        );
        bytes
    }

    /// Judgement with what follows from the verdict alone; the rest is empty.
    fn verdict(&self, verdict: &Verdict) -> Judgement {
        let blank = Judgement::default();
        match verdict {
            Verdict::Locks { surface, plan, key } => {
                let labels = self.labels(surface);
                let order: Vec<u32> = plan.steps.iter().map(|s| labels[usize::from(s.piece)]).collect();
                let ways = plan.steps.iter().map(|s| -s.separation.unit());
                let key = match key {
                    Some(site) => format!("cut {}", self.upright.words(site.prism.middle().to_array())),
                    None => format!("piece {}", order.last().map_or(0, |label| label + 1)),
                };
                Judgement {
                    locks: true,
                    words: format!("The kit locks: {} pieces, the key is {key}.", surface.n_patches),
                    order,
                    ways: ways.map(|way| self.at(way.to_array())).collect(),
                    ..blank
                }
            }
            Verdict::Blocked {
                reason,
                blockers,
                surface,
            } => {
                let labels = self.labels(surface);
                Judgement {
                    words: format!("The kit does not lock yet: {reason}"),
                    blockers: blockers.iter().map(|b| self.blocker(b, &labels)).collect(),
                    ..blank
                }
            }
        }
    }

    fn blocker(&self, blocker: &plan::Blocker, labels: &[u32]) -> Blocker {
        let number = |p: PatchId| labels.get(usize::from(p)).map_or(0, |label| label + 1);
        let (piece, by) = (number(blocker.piece), number(blocker.by));
        let (place, share) = (self.upright.words(blocker.at), 100.0 * blocker.occluded);
        Blocker {
            piece,
            by,
            words: format!("piece {by} blocks piece {piece} ({place}): it covers {share:.0} % of it"),
            at: self.at(blocker.at),
        }
    }

    fn advice(&self, warning: &Warning, labels: &[u32]) -> Advice {
        let number = |p: PatchId| labels.get(usize::from(p)).copied().unwrap_or_default();
        Advice {
            severity: warning.severity(),
            words: advice::words(warning, number),
            at: warning.at.map(|at| self.at(at)),
            mends: advice::is_mended(warning),
        }
    }

    /// Smooth lines between the pieces.
    fn seams(&self, surface: &SegmentedSurface) -> Vec<Vec<f64>> {
        let rounded = |x: f64| f64::from((100.0 * x).round() as f32 / 100.0);
        let line = |points: &[Vec3]| {
            let standing = points.iter().flat_map(|&p| turn_upright(self.up, p).to_array());
            standing.map(rounded).collect()
        };
        surface.seams().iter().map(|seam| line(&seam.points)).collect()
    }

    fn keys(&self, sites: &[KeySite], chosen: Option<KeySite>) -> Vec<Key> {
        // A key that the options place may not be among the best sites.
        let own = chosen.filter(|key| !sites.iter().any(|site| site.prism == key.prism));
        let all = own.iter().chain(sites);
        all.map(|site| self.key(site, chosen.is_some_and(|key| key.prism == site.prism)))
            .collect()
    }

    fn key(&self, site: &KeySite, is_chosen: bool) -> Key {
        let prism = &site.prism;
        let corner = |along: f64, side: f64| {
            let across = side * prism.half_width_at(along);
            let p = prism.origin + along * prism.slide + across * prism.across() + OFF_MM * prism.normal;
            self.at(p.to_array())
        };
        let length = prism.length_mm();
        let outline =
            [(0.0, -1.0), (0.0, 1.0), (length, 1.0), (length, -1.0)].map(|(along, side)| corner(along, side));
        let place = self.upright.words(prism.middle().to_array());
        let words = format!(
            "{place}: slides out {}; {:.1} cm², rails of {:.0} mm, {:.0} % flat",
            self.upright.way(prism.slide.to_array()),
            site.area_mm2 / 100.0,
            site.rail_mm,
            100.0 * site.flat_share
        );
        Key {
            at: self.at(prism.middle().to_array()),
            slide: self.at(prism.slide.to_array()),
            normal: self.at(prism.normal.to_array()),
            outline,
            area_mm2: site.area_mm2,
            score: site.score,
            words,
            is_chosen,
        }
    }
}

/// Lists the pieces that are shown. Adds advice for pieces that do not fit the printer or have one
/// neighbour.
fn told_pieces(
    figure: &Figure,
    options: &Options,
    view: &View<'_>,
    advice: &mut Vec<Advice>,
) -> Result<Vec<ToldPiece>, Failure> {
    let printer = options.chosen_printer().map_err(Failure::Wrong)?;
    let mesh = figure.model.solid.mesh();
    let surface = display_surface(mesh, view.labels);
    let neighbours = neighbours(mesh, view.labels, surface.n_patches);
    let is_small = fits_whole(&printer, mesh.bounds());
    let params = check_options(options)?;
    let wall_mm = shellock::design::Settings::resolve(&params).body.thickness_mm;
    let mut told = Vec::new();
    for piece in 0..surface.n_patches as u32 {
        let faces: Vec<usize> = (0..mesh.triangles.len())
            .filter(|&f| view.labels[f] == piece)
            .collect();
        if faces.is_empty() {
            continue;
        }
        let area: f64 = faces.iter().map(|&f| mesh.face_area(f)).sum();
        let middle = middle(mesh, &faces);
        let fits_bed = is_small || fits(&printer, &shell_of(&surface, PatchId(piece), wall_mm));
        let mut say = |severity: Severity, words: String| {
            advice.push(Advice {
                severity,
                words,
                at: Some(view.at(middle.to_array())),
                mends: false,
            });
        };
        if !fits_bed {
            let words = format!(
                "piece {} does not fit the printer: split it, or make the model smaller",
                piece + 1
            );
            say(Severity::Problem, words);
        }
        let n_neighbours = neighbours[piece as usize];
        if n_neighbours == 1 {
            let words = format!(
                "piece {} touches only one other piece: it will be joined to that piece, or held by a new \
                 one",
                piece + 1
            );
            say(Severity::Note, words);
        }
        told.push(ToldPiece {
            piece,
            area_mm2: area,
            fits_bed,
            n_neighbours,
            at: view.at(middle.to_array()),
        });
    }
    Ok(told)
}

/// Pieces as shown, with jagged seams along the triangles.
fn display_surface(mesh: &TriMesh, shown: &[u32]) -> SegmentedSurface {
    SegmentedSurface {
        mesh: mesh.clone(),
        patch_of_face: shown.iter().map(|&label| PatchId(label)).collect(),
        source_face: (0..mesh.triangles.len() as u32).collect(),
        n_patches: shown.iter().max().map_or(0, |&most| most as usize + 1),
    }
}

/// Centre of the piece's face that is nearest to the piece's centroid.
fn middle(mesh: &TriMesh, faces: &[usize]) -> Vec3 {
    let (mut sum, mut area) = (Vec3::ZERO, 0.0);
    for &f in faces {
        sum += mesh.face_area(f) * mesh.face_center(f);
        area += mesh.face_area(f);
    }
    let mean = sum / area.max(f64::MIN_POSITIVE);
    let nearest = faces.iter().map(|&f| mesh.face_center(f));
    nearest
        .min_by(|a, b| a.distance(mean).total_cmp(&b.distance(mean)))
        .unwrap_or(mean)
}

/// Number of pieces that each piece touches along an edge.
fn neighbours(mesh: &TriMesh, shown: &[u32], n: usize) -> Vec<usize> {
    let mut owner = std::collections::HashMap::with_capacity(mesh.triangles.len() * 3 / 2);
    let mut pairs = std::collections::BTreeSet::new();
    for (f, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if let Some(&other) = owner.get(&(b, a)) {
                let (p, q): (u32, u32) = (shown[f], other);
                if p != q {
                    pairs.insert((p.min(q), p.max(q)));
                }
            }
            owner.insert((a, b), shown[f]);
        }
    }
    let mut count = vec![0; n];
    for (p, q) in pairs {
        count[p as usize] += 1;
        count[q as usize] += 1;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use shellock_job::output::turn_back;

    #[test]
    fn lying_is_where_it_was_before_it_stood() {
        let v = Vec3::new(1.0, 2.0, 3.0);
        for up in [Axis::X, Axis::Y, Axis::Z] {
            assert_eq!(turn_back(up, turn_upright(up, v)), v);
        }
    }
}
