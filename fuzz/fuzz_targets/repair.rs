//! Fuzzes the repair, which must end in a body or a refusal for any triangles: `cargo +nightly fuzz run
//! repair`.
//!
//! Points lie on a coarse grid, so that they coincide, and lie on edges and in planes, as often as in the
//! worst files.

#![no_main]

use libfuzzer_sys::fuzz_target;
use shellock_geom::hollow::{LEAST_SHARE, fill, find_hollow};
use shellock_geom::repair::{InsideOut, RepairMode, repair_as};
use shellock_geom::slit::slits;
use shellock_geom::{TriMesh, Vec3};

// The fuzzer's panic hook is removed: it would end the process even at panics that are caught and become
// errors.
fuzz_target!(init: std::panic::take_hook(), |bytes: &[u8]| {
    let Some((&n_points, rest)) = bytes.split_first() else { return };
    let (points, corners) = rest.split_at(rest.len().min(usize::from(n_points)));
    // Each axis has five steps; one bit of the byte adds a slight offset, which makes cracks.
    let coordinate = |step: u8, slack: u8| f64::from(step) + 1e-6 * f64::from(slack);
    let point = |&b: &u8| {
        Vec3::new(coordinate(b % 5, b >> 7), coordinate(b / 5 % 5, 0), coordinate(b / 25 % 5, b >> 7))
    };
    let points: Vec<Vec3> = points.iter().map(point).collect();
    let Ok(n) = u8::try_from(points.len()) else { return };
    if n == 0 {
        return;
    }
    let corners = corners.as_chunks::<3>().0.iter();
    let triangles = corners.map(|t| t.map(|corner| u32::from(corner % n))).collect();
    let mesh = TriMesh { points, triangles };
    for inside_out in [InsideOut::Ask, InsideOut::Cut, InsideOut::Unite] {
        let Ok(repaired) = repair_as(&mesh, RepairMode::KeepLargest, inside_out) else { continue };
        assert!(repaired.solid.volume() > 0.0);
        assert_eq!(repaired.source_face.len(), repaired.solid.mesh().triangles.len());
        assert!(repaired.source_face.iter().all(|&face| (face as usize) < mesh.triangles.len()));
        // The searches for a cavity and for slits must not panic, either.
        if let Some(hollow) = find_hollow(&repaired.solid, LEAST_SHARE) {
            assert!(hollow.cavity_mm3 > 0.0);
            let _ = fill(&repaired.solid, &hollow);
        }
        let _ = slits(&repaired.solid, 0.1);
    }
});
