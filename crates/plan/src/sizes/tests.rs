use shellock_geom::TriMesh;
use shellock_test_surfaces::{label, sphere};

use super::*;

const PARAMS: SizeParams = SizeParams {
    choice: SizeChoice::Auto(SizeRange {
        min_mm: 2.0,
        max_mm: 4.0,
        alpha_per_mpa: None,
    }),
    wall_mm: 2.0,
    clearance_mm: 0.1,
    strength_mpa: 42.0,
};

fn choose_for(
    surface: &SegmentedSurface,
    params: &SizeParams,
    stress_mpa: Option<StressField>,
) -> (ChosenSizes, Vec<Warning>) {
    let ctx = Ctx::quiet();
    let chosen = choose(&ctx, params, surface, stress_mpa).unwrap();
    chosen.tell(&ctx);
    (chosen, ctx.into_warnings())
}

/// Two halves of an ellipsoid that meet in a ring at z = 0.
fn halves(radii_mm: Vec3) -> SegmentedSurface {
    label(sphere(4, radii_mm), 2, |p| u32::from(p.z > 0.0))
}

const A: PatchId = PatchId(0);
const B: PatchId = PatchId(1);

#[test]
fn equation_3_gives_the_least_size_without_stress_and_the_largest_from_the_strength_on() {
    let range = SizeRange::default();
    let size = |stress_mpa| size_for_stress_mm(&range, 42.0, stress_mpa);
    assert_eq!([0.0, -1.0, f64::NAN].map(size), [2.0; 3]);
    assert_eq!([42.0, 43.0, f64::INFINITY].map(size), [4.0; 3]);
    assert!((size(21.0) - 3.0).abs() < 1e-12);
    let steep = SizeRange {
        alpha_per_mpa: Some(0.1),
        ..range
    };
    assert!((size_for_stress_mm(&steep, 42.0, 5.0) - 3.0).abs() < 1e-12);
}

#[test]
fn pairs_are_unordered_and_others_get_the_default() {
    let sizes = ConnectorSizes::with_pairs(2.0, [([B, A], 3.0), ([B, PatchId(2)], 2.5)]);
    assert_eq!(
        [sizes.of(A, B), sizes.of(B, A), sizes.of(A, PatchId(2))],
        [3.0, 3.0, 2.0]
    );
    assert_eq!((sizes.default_mm(), sizes.largest_mm()), (2.0, 3.0));
    assert_eq!(
        sizes.pairs().collect::<Vec<_>>(),
        [([A, B], 3.0), ([B, PatchId(2)], 2.5)]
    );
    assert_eq!(ConnectorSizes::uniform(2.5).largest_mm(), 2.5);
}

#[test]
fn a_fixed_size_is_that_of_all_pairs_whatever_the_stress() {
    let params = SizeParams {
        choice: SizeChoice::Fixed(2.5),
        ..PARAMS
    };
    let (found, warnings) = choose_for(&halves(Vec3::new(5.0, 5.0, 30.0)), &params, Some(&|_| 40.0));
    assert_eq!(
        found,
        ChosenSizes {
            sizes: ConnectorSizes::default(),
            reductions: Vec::new(),
            most: BTreeMap::new(),
            increases: Vec::new(),
        }
    );
    assert!(warnings.is_empty());
}

#[test]
fn for_the_sake_of_use_connectors_grow_once_to_what_fits_and_that_is_told() {
    let surface = halves(Vec3::splat(40.0));
    let (mut sizes, _) = choose_for(&surface, &PARAMS, None);
    let mut capped = sizes.clone();
    assert!(sizes.raise([B, A], "pressed on its top") && !sizes.raise([A, B], "dropped"));
    assert_eq!(sizes.sizes.of(A, B), 4.0);
    let ctx = Ctx::quiet();
    sizes.tell(&ctx);
    let told = ctx.into_warnings().remove(0);
    assert_eq!(told.pieces, [A, B]);
    assert!(told.to_string().contains("4.0 mm instead of 2.0 mm"), "{told}");
    // Connectors at a cap, as that of a key's rails, cannot grow.
    capped.cap(B, 2.0);
    assert!(!capped.raise([A, B], "dropped") && capped.sizes.of(A, B) == 2.0);
    let fixed = SizeParams {
        choice: SizeChoice::Fixed(2.5),
        ..PARAMS
    };
    assert!(!choose_for(&surface, &fixed, None).0.raise([A, B], "dropped"));
}

#[test]
fn where_all_fits_the_greatest_stress_of_a_seam_alone_decides() {
    let surface = halves(Vec3::splat(40.0));
    let (none, warnings) = choose_for(&surface, &PARAMS, None);
    assert!(none.sizes.of(A, B) == 2.0 && warnings.is_empty());
    // A peak at one place of the seam; stress off the seam does not count.
    let field = |p: Vec3| if p.z.abs() > 10.0 { 42.0 } else { 21.0 * p.x / 40.0 };
    let (some, warnings) = choose_for(&surface, &PARAMS, Some(&field));
    assert!(
        (some.sizes.of(A, B) - 3.0).abs() < 0.01 && warnings.is_empty(),
        "{some:?}"
    );
}

#[test]
fn in_a_narrow_limb_the_channel_stays_off_the_wall_opposite() {
    // A limb 10.4 mm thick: 6.4 mm of cavity, less two clearances, is 6.2 mm = 1.05 D for D = 5.9; 7.4 mm
    // leaves 3.05.
    let thick = |radius_mm: f64| {
        choose_for(
            &halves(Vec3::new(radius_mm, radius_mm, 60.0)),
            &PARAMS,
            Some(&|_| 42.0),
        )
    };
    let (wide, warnings) = thick(5.2);
    assert!(wide.sizes.of(A, B) == 4.0 && warnings.is_empty(), "{wide:?}");
    let (narrow, warnings) = thick(3.7);
    let size_mm = narrow.sizes.of(A, B);
    assert!((size_mm - 3.2 / 1.05).abs() < 0.1, "{size_mm}");
    assert!(depth_mm(size_mm, 0.1) + 0.1 <= 7.4 - 4.0 + 1e-9);
    assert_eq!(warnings.len(), 1);
    assert_eq!(
        (warnings[0].code(), warnings[0].pieces.as_slice()),
        ("connector-limited", [A, B].as_slice())
    );
    assert!(
        warnings[0].to_string().contains("3.0 mm") && warnings[0].to_string().contains("4.0 mm"),
        "{}",
        warnings[0].to_string()
    );
    assert!(Vec3::from_array(warnings[0].at.unwrap()).z.abs() < 1.0);
    // Where nothing fits, the least size remains.
    assert_eq!(thick(2.0).0.sizes.of(A, B), 2.0);
}

#[test]
fn a_short_seam_gets_the_largest_size_with_which_it_is_a_contact() {
    let params = SizeParams {
        wall_mm: 0.5,
        ..PARAMS
    };
    let octant = |p: Vec3| u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0) + 4 * u32::from(p.z > 0.0);
    let octants = |radius_mm: f64| label(sphere(4, Vec3::splat(radius_mm)), 8, octant);
    let (found, warnings) = choose_for(&octants(12.0), &params, Some(&|_| 42.0));
    // Seams are quarters of circles; inside the wall their radius is 11.5 mm.
    let expected_mm = std::f64::consts::FRAC_PI_2 * 11.5 / CONTACT_SIZES;
    for (pair, size_mm) in found.sizes.pairs() {
        assert!(
            (size_mm - expected_mm).abs() < 0.05,
            "{pair:?} {size_mm} {expected_mm}"
        );
    }
    // All twelve seams are short, and one warning covers them.
    assert_eq!(
        (found.reductions.len(), warnings.len(), warnings[0].pieces.len()),
        (12, 1, 8)
    );
    assert!(
        warnings[0].to_string().contains("11 other pairs"),
        "{}",
        warnings[0].to_string()
    );
    let (least, _) = choose_for(&octants(6.0), &params, Some(&|_| 42.0));
    assert!(
        least.sizes.pairs().all(|(_, size_mm)| size_mm == 2.0),
        "{least:?}"
    );
}

#[test]
fn a_wish_that_is_missed_by_little_is_not_told() {
    let at = |stress_mpa: f64| {
        choose_for(
            &halves(Vec3::new(3.7, 3.7, 60.0)),
            &PARAMS,
            Some(&move |_| stress_mpa),
        )
    };
    // A stress of 23 MPa asks for 3.1 mm where 3.05 mm fit.
    let (found, warnings) = at(23.0);
    assert!(found.sizes.of(A, B) < 3.09 && warnings.is_empty(), "{found:?}");
    assert_eq!(at(42.0).1.len(), 1);
}

#[test]
fn choices_are_read_and_written_alike_and_every_fault_is_named() {
    for text in ["auto", "2.5", "4"] {
        assert_eq!(text.parse::<SizeChoice>().unwrap().to_string(), text);
    }
    assert_eq!("large".parse::<SizeChoice>(), Err(NoSize));
    assert!(
        SizeChoice::default().problems().is_empty()
            && "auto".parse::<SizeChoice>().unwrap().problems().is_empty()
    );
    assert_eq!(SizeChoice::Fixed(f64::NAN).problems().len(), 1);
    let bad = SizeRange {
        min_mm: 1.0,
        max_mm: 0.5,
        alpha_per_mpa: Some(-1.0),
    };
    assert_eq!(SizeChoice::Auto(bad).problems().len(), 3);
}

#[test]
fn an_empty_surface_has_no_sizes() {
    let surface = SegmentedSurface {
        mesh: TriMesh {
            points: Vec::new(),
            triangles: Vec::new(),
        },
        patch_of_face: Vec::new(),
        source_face: Vec::new(),
        n_patches: 0,
    };
    assert_eq!(
        choose_for(&surface, &PARAMS, Some(&|_| 1.0))
            .0
            .sizes
            .pairs()
            .count(),
        0
    );
}
