//! Makes pieces from a mesh: `cargo run --release -p shellock --example design MODEL.stl [FOLDER]`.

use std::{env, error, fs};

use shellock::{Ctx, DesignOutcome, Params, design};
use shellock_formats::{read_mesh, write_stl_binary};
use shellock_geom::repair::{RepairMode, repair};

fn main() -> Result<(), Box<dyn error::Error>> {
    let mut args = env::args().skip(1);
    let file = args
        .next()
        .ok_or("name a model: an STL, OBJ, PLY, OFF, 3MF or glTF, in mm")?;
    let folder = args.next().unwrap_or_else(|| ".".into());
    let solid = repair(&read_mesh(&fs::read(file)?, None)?.mesh, RepairMode::Repair)?.solid;
    match design(&Ctx::quiet(), &Params::default(), &solid, None)? {
        DesignOutcome::Made(made) => {
            for (piece, mesh) in made.kit.pieces.iter() {
                fs::write(format!("{folder}/piece-{piece}.stl"), write_stl_binary(mesh))?;
            }
            let (n, passed) = (made.kit.pieces.len(), made.kit.verification.has_passed());
            println!("{n} pieces; all checks hold: {passed}");
        }
        DesignOutcome::NoPlan(none) => println!("no plan: {}", none.reason),
    }
    Ok(())
}
