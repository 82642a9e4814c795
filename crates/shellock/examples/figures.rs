//! Draws every figure from the front and the back into `figures.png`, or into the file given as first
//! argument.

use std::time::Instant;

use shellock::figure::{self, Figure};
use shellock_geom::Vec3;
use shellock_render::stills::{Camera, Image, Painted, render};

fn main() -> std::io::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "figures.png".into());
    let mut pictures = Vec::new();
    for figure in Figure::ALL {
        let begin = Instant::now();
        let solid = figure::make(figure, 150.0, 1.5);
        let made = begin.elapsed();
        let scene = [Painted {
            mesh: solid.mesh(),
            color: [214, 132, 72],
            shift: Vec3::ZERO,
            face_colors: None,
            normals: None,
        }];
        pictures.push(render(&scene, &Camera::front(), 480, 480));
        pictures.push(render(&scene, &Camera::back(), 480, 480));
        let n_faces = solid.mesh().triangles.len();
        println!(
            "{}: {n_faces} triangles, made in {made:.2?}, drawn in {:.2?}",
            figure.name(),
            begin.elapsed() - made
        );
    }
    std::fs::write(path, Image::sheet(&pictures, 4).on([255; 3]).png())
}
