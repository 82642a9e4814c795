//! Whatever the triangles are, mending ends in a body or a refusal: `cargo +nightly fuzz run repair`.
//!
//! Points lie on a coarse grid, so that they meet, lie on edges and in planes as often as in the worst of
//! files.

#![no_main]

use libfuzzer_sys::fuzz_target;
use shellock_geom::hollow::{LEAST_SHARE, fill, find_hollow};
use shellock_geom::repair::{InsideOut, RepairMode, repair_as};
use shellock_geom::slit::slits;
use shellock_geom::{TriMesh, Vec3};

// Panics that are caught and become an error are none: without this the first one would end the process.
fuzz_target!(init: std::panic::take_hook(), |bytes: &[u8]| {
    let Some((&n_points, rest)) = bytes.split_first() else { return };
    let (points, corners) = rest.split_at(rest.len().min(usize::from(n_points)));
    // Five steps an axis, and a last bit of slack for cracks.
    let coordinate = |step: u8, slack: u8| f64::from(step) + 1e-6 * f64::from(slack);
    let point =
        |&b: &u8| Vec3::new(coordinate(b % 5, b >> 7), coordinate(b / 5 % 5, 0), coordinate(b / 25 % 5, b >> 7));
    let points: Vec<Vec3> = points.iter().map(point).collect();
    let Ok(n) = u8::try_from(points.len()) else { return };
    if n == 0 {
        return;
    }
    let triangles = corners.as_chunks::<3>().0.iter().map(|t| t.map(|corner| u32::from(corner % n))).collect();
    let mesh = TriMesh { points, triangles };
    for inside_out in [InsideOut::Ask, InsideOut::Cut, InsideOut::Unite] {
        let Ok(repaired) = repair_as(&mesh, RepairMode::KeepLargest, inside_out) else { continue };
        assert!(repaired.solid.volume() > 0.0);
        assert_eq!(repaired.source_face.len(), repaired.solid.mesh().triangles.len());
        assert!(repaired.source_face.iter().all(|&face| (face as usize) < mesh.triangles.len()));
        // Neither a cavity nor a slit is looked for in vain.
        if let Some(hollow) = find_hollow(&repaired.solid, LEAST_SHARE) {
            assert!(hollow.cavity_mm3 > 0.0);
            let _ = fill(&repaired.solid, &hollow);
        }
        let _ = slits(&repaired.solid, 0.1);
    }
});
