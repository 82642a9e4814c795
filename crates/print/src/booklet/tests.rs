use shellock_geom::TriMesh;
use shellock_testkit::shapes::cuboid;

use super::view::Lookout;
use super::*;
use crate::pdf::tests::{n_pictures, read};

fn piece(mesh: &TriMesh, order: usize, along: [f64; 3]) -> ReportPiece<'_> {
    ReportPiece {
        number: order as u32 + 1,
        name: format!("piece {order}"),
        color: [200, 90, 40],
        mesh,
        installation_direction: along,
        order,
        is_key: order == 2,
        facts: Vec::new(),
    }
}

/// A tall wall, a second piece that is inserted behind it, and a third in front.
fn meshes() -> [TriMesh; 3] {
    [
        cuboid([-30.0, 0.0, 0.0], [30.0, 4.0, 60.0]).to_mesh(),
        cuboid([-8.0, 6.0, 0.0], [8.0, 14.0, 10.0]).to_mesh(),
        cuboid([-8.0, -9.0, 0.0], [8.0, -1.0, 10.0]).to_mesh(),
    ]
}

#[test]
fn what_comes_behind_a_wall_is_seen_from_behind_it() {
    let meshes = meshes();
    let pieces = [
        piece(&meshes[0], 0, [0.0, 0.0, -1.0]),
        piece(&meshes[1], 1, [0.0, -1.0, 0.0]),
    ];
    let sights = sights(&[&pieces[0], &pieces[1]]);
    assert!(
        sights[0].direction.y > 0.5,
        "the first step is seen from the front"
    );
    assert!(sights[1].direction.y < -0.3, "{:?}", sights[1]);
    let across = Vec3::Y.cross(sights[1].direction).length();
    assert!(across > 0.6, "the way is seen at an angle, not end on: {across}");
}

#[test]
fn an_arrow_points_where_the_piece_goes_and_is_never_too_short() {
    for (from, to) in [
        ([10.0, 10.0], [40.0, 50.0]),
        ([3.0, 4.0], [3.0, 4.5]),
        ([1.0, 1.0], [1.0, 1.0]),
    ] {
        let corners = arrow([from, to]);
        let tip = corners[3];
        let length = (tip[0] - from[0]).hypot(tip[1] - from[1]);
        assert!(length > 11.9);
        let way = [to[0] - from[0], to[1] - from[1]];
        let along = way[0] * (tip[0] - from[0]) + way[1] * (tip[1] - from[1]);
        assert!((along - way[0].hypot(way[1]) * length).abs() < 1e-9);
    }
}

#[test]
fn a_booklet_has_a_cover_the_pieces_and_a_picture_a_step_and_is_the_same_each_time() {
    let meshes = meshes();
    let made = |bears: Option<Borne>| {
        let along = [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
        let pieces = (0..3).map(|i| piece(&meshes[i], i, along[i])).collect();
        Booklet {
            title: "a wall".into(),
            bears,
            lines: vec!["3 pieces".into()],
            pieces,
            ..Booklet::default()
        }
        .pdf()
    };
    let bytes = made(None);
    let count = |what: &[u8]| bytes.windows(what.len()).filter(|w| *w == what).count();
    // Cover, pieces, one page of three steps and the end; two pictures on the cover, one per piece, one per
    // step, one at the end.
    assert_eq!((count(b"/Type /Page\n"), n_pictures(&bytes)), (3, 2 + 3 + 3 + 1));
    assert!(bytes == made(None));
    // The loads take the cell after the end: on a second page after three steps and the end.
    let bears = Borne {
        figures: vec![("press on the top".into(), "70 N".into())],
        note: "by simulation".into(),
        weakest: Some(WeakPlace {
            words: "the seam between pieces 1 and 3 opens".into(),
            at: Vec3::new(0.0, -1.0, 5.0),
            lines: vec![vec![Vec3::new(0.0, -1.0, 0.0), Vec3::new(0.0, -1.0, 10.0)]],
            between: [1, 3],
        }),
    };
    let bytes = made(Some(bears.clone()));
    let count = |what: &[u8]| bytes.windows(what.len()).filter(|w| *w == what).count();
    assert_eq!(
        (count(b"/Type /Page\n"), n_pictures(&bytes)),
        (4, 2 + 3 + 3 + 1 + 1)
    );
    assert!(bytes == made(Some(bears)));
}

#[test]
fn each_page_has_the_name_of_the_model_and_each_step_its_words_as_text() {
    let meshes = meshes();
    let along = [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    let booklet = Booklet {
        title: "Größe Ёжик".into(),
        pieces: (0..3).map(|i| piece(&meshes[i], i, along[i])).collect(),
        ..Booklet::default()
    };
    let pages = read(&booklet.pdf());
    assert_eq!(pages.len(), 3);
    assert!(pages.iter().all(|text| text.contains("Größe Ёжик")), "{pages:?}");
    for words in ["start with this piece", "from above", "it locks all", "3 of 3"] {
        assert!(pages[2].contains(words), "{words}: {}", pages[2]);
    }
}

#[test]
fn no_pieces_make_a_booklet_without_steps() {
    assert!(Booklet::default().pdf().starts_with(b"%PDF"));
}

#[test]
fn sides_are_told_by_their_names() {
    assert_eq!(view::side(Vec3::Z), "above");
    assert_eq!(view::side(Vec3::new(0.0, -1.0, -1.0)), "below and the front");
    assert_eq!(view::side(Vec3::ZERO), "its place");
}

#[test]
fn a_place_is_looked_at_from_where_it_is_seen() {
    let meshes = meshes();
    let pieces: Vec<ReportPiece<'_>> = (0..3).map(|i| piece(&meshes[i], i, [0.0; 3])).collect();
    let lookout = Lookout::new(&pieces.iter().collect::<Vec<_>>());
    for (at, sign) in [
        (Vec3::new(0.0, 4.0, 40.0), -1.0),
        (Vec3::new(0.0, 0.0, 40.0), 1.0),
    ] {
        let direction = lookout.best(at, &[vec![at]]);
        assert!(
            sign * direction.y > 0.3 && lookout.is_seen(at, direction),
            "{direction}"
        );
        assert!(!lookout.is_seen(at, -direction));
    }
}

/// A tower of `n` boxes, stacked from below.
fn tower(n: usize) -> Vec<TriMesh> {
    (0..n)
        .map(|i| {
            let z = 4.0 * i as f64;
            cuboid([-10.0, -10.0, z], [10.0, 10.0, z + 4.0]).to_mesh()
        })
        .collect()
}

#[test]
fn no_text_stands_on_another_or_off_the_page_with_any_number_of_pieces_and_any_names() {
    let long = "Прапорщик ".repeat(20) + &"a very long name of a figure ".repeat(6);
    let section = |n: usize| Section {
        title: long.clone(),
        lines: vec![long.clone(); n],
    };
    for n in [2, 5, 11, 24, 60] {
        let meshes = tower(n);
        let mut pieces: Vec<ReportPiece<'_>> =
            (0..n).map(|i| piece(&meshes[i], i, [0.0, 0.0, -1.0])).collect();
        pieces.iter_mut().for_each(|p| p.is_key = p.order + 1 == n);
        let booklet = Booklet {
            title: long.clone(),
            lines: vec![long.clone(), format!("{n} pieces")],
            bears: Some(Borne {
                figures: vec![(long.clone(), long.clone()); 6],
                note: long.clone(),
                weakest: Some(WeakPlace {
                    words: long.clone(),
                    at: Vec3::ZERO,
                    lines: Vec::new(),
                    between: [1, 2],
                }),
            }),
            pieces,
            before: vec![section(3), section(1)],
            after: vec![section(2)],
            paper: Paper::A4,
            fonts: Vec::new(),
        };
        let fonts = Fonts::new(&booklet.fonts);
        for (k, page) in booklet.pages(&fonts).iter().enumerate() {
            let texts = page.texts();
            for (i, a) in texts.iter().enumerate() {
                let is_inside = a.min[0] >= 5.0
                    && a.min[1] >= 5.0
                    && a.max[0] <= PAGE_MM[0] - 5.0
                    && a.max[1] <= PAGE_MM[1] - 5.0;
                assert!(is_inside, "{n} pieces, page {k}: {a:?}");
                for b in &texts[..i] {
                    let is_over = (0..2).all(|d| a.min[d] < b.max[d] - 0.05 && b.min[d] < a.max[d] - 0.05);
                    assert!(!is_over, "{n} pieces, page {k}: {} over {}", a.text, b.text);
                }
            }
        }
    }
}

#[test]
fn a_place_that_is_hidden_is_shown_from_elsewhere_too() {
    // A niche open to the front alone. The piece comes in from above, behind a wall of the front's height.
    let well = [
        cuboid([-30.0, -10.0, 0.0], [30.0, -6.0, 60.0]).to_mesh(),
        cuboid([-30.0, 6.0, 0.0], [30.0, 10.0, 60.0]).to_mesh(),
        cuboid([-4.0, -4.0, 0.0], [4.0, 4.0, 8.0]).to_mesh(),
    ];
    let pieces: Vec<ReportPiece<'_>> = (0..3).map(|i| piece(&well[i], i, [0.0, 0.0, -1.0])).collect();
    let sights = sights(&pieces.iter().collect::<Vec<_>>());
    assert!(sights[0].other.is_none(), "the first hides nothing");
    let bytes = |pieces| {
        Booklet {
            pieces,
            ..Booklet::default()
        }
        .pdf()
    };
    let n_other = sights.iter().filter(|s| s.other.is_some()).count();
    let pdf = bytes(pieces.clone());
    assert_eq!(n_pictures(&pdf), 2 + 3 + 3 + 1 + n_other);
}
