use super::*;
use crate::sample;

fn joined(assembly: &ShellAssembly, degrees: f64) -> Vec<Option<Joint>> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let joint = |s: &Station| {
        let leaves = s.normal * cos + s.across * sin;
        Some(Joint { male: Side::A, leaves, pull_on_a: leaves, weight: 1.0 })
    };
    assembly.stations.iter().map(joint).collect()
}

#[test]
fn plates_on_a_straight_seam_come_apart() {
    let plates = sample::plates(30.0, 15.0, [10, 5]);
    let model = VolumeModel::new(&VolumeParams::default(), &plates).unwrap();
    for degrees in [-90.0, -45.0, 0.0, 45.0] {
        assert_eq!(model.resist(&joined(&plates, degrees), 0).unwrap(), Resistance::Separable(vec![1]));
    }
}

/// Along a great circle, half of the ball may turn against the other half: each of the three circles frees one rotation.
#[test]
fn octants_turn_about_great_circles_unless_friction_holds_one_of_them() {
    let ball = sample::ball(20.0, 8);
    let joints = joined(&ball, 0.0);
    let sliding = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    assert_eq!(sliding.resist(&joints, 7).unwrap(), Resistance::Separable((0..7).collect()));
    let params = VolumeParams { grip: Grip::Sticks, ..VolumeParams::default() };
    let sticking = VolumeModel::new(&params, &ball).unwrap();
    let Resistance::Holds(opening) = sticking.resist(&joints, 7).unwrap() else { panic!("it comes apart") };
    assert!(opening.quality_mm < -1e-6 && opening.quality_mm > -0.1, "{opening:?}");
}
