//! Solves finished pieces, one held and one pushed, by `solid`: writes the case and our solutions as JSON.
//!
//! `cargo run --release -p shellock-mechanics --example solid_case -- CELLS HOLD PUSH PIECE… > case.json`
//!
//! CELLS are the cell edges in mm, such as 2.5,1.5. HOLD is PART,X,Y,Z,RADIUS: the surface of piece PART
//! (from 0) inside that ball is held. PUSH adds a force: PART,X,Y,Z,RADIUS,FX,FY,FZ. PIECE… are mesh files.
//! `scripts/solid_calculix.py case.json` solves the same case with CalculiX and compares.

use std::collections::BTreeMap;
use std::fmt::{Debug, Write as _};
use std::io::Write as _;

use shellock_formats as io;
use shellock_geom::weld::weld;
use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_mechanics::solid::{Answer, Hold, Push, SolidModel, SolidParams, Spot, Touch};

type Any<T> = Result<T, Box<dyn std::error::Error>>;

/// Coefficients of friction to solve for.
const FRICTION: [f64; 2] = [0.0, 0.2];
/// Longest edge of the triangles whose centroids sample the surface, mm.
const SAMPLE_MM: f64 = 0.7;
/// Edge of boxes, mm; one place in each box is held, or pushed, for all of the surface in it.
const BOX_MM: f64 = 0.8;

/// Load case: files and pieces, the hold and the pushes.
struct Case {
    files: Vec<String>,
    pieces: Vec<Solid>,
    hold: Vec<f64>,
    holds: Vec<Hold>,
    pushes: Vec<Push>,
}

fn main() -> Any<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [cells, hold, push, files @ ..] = &args[..] else {
        return Err("CELLS HOLD PUSH PIECE…".into());
    };
    let case = case(hold, push, files)?;
    let mut runs = Vec::new();
    let mut touches = Vec::new();
    for cell_mm in numbers(cells)? {
        solve(&case, cell_mm, &mut touches, &mut runs)?;
    }
    let json = describe(&case, &touches)?;
    writeln!(std::io::stdout(), "{json}\"runs\": [{}]}}", runs.join(","))?;
    Ok(())
}

fn case(hold: &str, push: &str, files: &[String]) -> Any<Case> {
    let pieces: Vec<Solid> = files.iter().map(|f| piece(f)).collect::<Any<_>>()?;
    let hold = numbers(hold)?;
    let (held_part, held) = within(&pieces, &hold)?;
    let push = numbers(push)?;
    let (pushed_part, pushed) = within(&pieces, &push)?;
    let force_n = Vec3::from_slice(push.get(5..8).ok_or("PUSH has eight numbers")?);
    let area_mm2: f64 = pushed.iter().map(|p| p.1).sum();
    let to_hold = |&(at, area_mm2): &(Vec3, f64)| Hold {
        part: held_part as u32,
        at,
        area_mm2,
    };
    let to_push = |&(at, own): &(Vec3, f64)| Push {
        part: pushed_part as u32,
        at,
        force_n: force_n * (own / area_mm2),
    };
    Ok(Case {
        files: files.to_vec(),
        holds: held.iter().map(to_hold).collect(),
        pushes: pushed.iter().map(to_push).collect(),
        pieces,
        hold,
    })
}

/// Solves with cells of edge `cell_mm`; `touches` keeps the contacts of the first run.
fn solve(case: &Case, cell_mm: f64, touches: &mut Vec<Touch>, runs: &mut Vec<String>) -> Any<()> {
    let params = SolidParams {
        cell_mm,
        ..SolidParams::default()
    };
    let mut model = SolidModel::new(&params, &case.pieces, &case.holds, &|_| false, &|| false)?;
    if touches.is_empty() {
        *touches = model.touches().to_vec();
    }
    let spots: Vec<Option<Spot>> = case.pushes.iter().map(|p| model.spot(p.part, p.at)).collect();
    let ends: Vec<[Option<Spot>; 2]> = touches
        .iter()
        .map(|t| [0, 1].map(|i| model.spot(t.parts[i], t.at[i])))
        .collect();
    for friction in FRICTION {
        let moved = model.under_load(&case.pushes, Answer::Held, friction, &|| false)?;
        for (load, motion) in [
            (0.01, &(|s: &Spot| moved.settled_mm(s)) as &dyn Fn(&Spot) -> Vec3),
            (1.0, &|s: &Spot| moved.moved_mm(s)),
        ] {
            let at = |spot: &Option<Spot>| spot.as_ref().map_or([f64::NAN; 3], |s| motion(s).to_array());
            let mut run = format!(
                "{{\"cell_mm\": {cell_mm:?}, \"friction\": {friction:?}, \"load\": {load:?}, \"off\": {:?},",
                moved.friction_off
            );
            list(&mut run, "pushed_mm", &spots.iter().map(at).collect::<Vec<_>>())?;
            list(
                &mut run,
                "ends_mm",
                &ends.iter().map(|e| [at(&e[0]), at(&e[1])]).collect::<Vec<_>>(),
            )?;
            run.pop();
            runs.push(run + "}");
        }
    }
    Ok(())
}

/// Start of the JSON text: the case itself.
fn describe(case: &Case, touches: &[Touch]) -> Any<String> {
    let Case {
        files, hold, pushes, ..
    } = case;
    let params = SolidParams::default();
    let pushed_part = pushes[0].part;
    let mut json = format!(
        "{{\"youngs_modulus_mpa\": {:?}, \"poissons_ratio\": {:?}, \"pieces\": {files:?},",
        params.material.youngs_modulus_mpa, params.material.poissons_ratio
    );
    write!(json, "\"hold\": {hold:?}, \"pushed_part\": {pushed_part},")?;
    list(
        &mut json,
        "pushed_at",
        &pushes.iter().map(|p| p.at.to_array()).collect::<Vec<_>>(),
    )?;
    list(
        &mut json,
        "forces_n",
        &pushes.iter().map(|p| p.force_n.to_array()).collect::<Vec<_>>(),
    )?;
    list(
        &mut json,
        "parts",
        &touches.iter().map(|t| t.parts).collect::<Vec<_>>(),
    )?;
    list(
        &mut json,
        "gaps_mm",
        &touches.iter().map(|t| t.gap_mm).collect::<Vec<_>>(),
    )?;
    list(
        &mut json,
        "fast",
        &touches.iter().map(|t| t.is_fast).collect::<Vec<_>>(),
    )?;
    list(
        &mut json,
        "ends_at",
        &touches
            .iter()
            .map(|t| t.at.map(|p| p.to_array()))
            .collect::<Vec<_>>(),
    )?;
    Ok(json)
}

fn numbers(text: &str) -> Any<Vec<f64>> {
    Ok(text.split(',').map(str::parse).collect::<Result<_, _>>()?)
}

fn list(json: &mut String, name: &str, values: &[impl Debug]) -> std::fmt::Result {
    write!(json, "\"{name}\": {values:?},")
}

fn piece(file: &str) -> Any<Solid> {
    let extension = std::path::Path::new(file).extension().and_then(|e| e.to_str());
    let mesh = io::read_mesh(&std::fs::read(file)?, extension)?.mesh;
    Solid::new(weld(&mesh).mesh).map_err(|e| format!("{file}: {e:?}").into())
}

/// Finds the part, and the places of its surface in the ball, each with its area.
fn within(pieces: &[Solid], ball: &[f64]) -> Any<(usize, Vec<(Vec3, f64)>)> {
    let [part, x, y, z, radius, ..] = ball else {
        return Err("PART,X,Y,Z,RADIUS".into());
    };
    let part = *part as usize;
    let mesh = pieces.get(part).ok_or("no such part")?.mesh();
    let mut boxes: BTreeMap<[i64; 3], (Vec3, f64)> = BTreeMap::new();
    for face in 0..mesh.triangles.len() {
        middles(mesh, face, &mut |p, area_mm2| {
            if p.distance(Vec3::new(*x, *y, *z)) <= *radius {
                let key = (p / BOX_MM).to_array().map(|x| x.floor() as i64);
                boxes.entry(key).or_insert((p, 0.0)).1 += area_mm2;
            }
        });
    }
    if boxes.is_empty() {
        return Err("nothing in the ball".into());
    }
    Ok((part, boxes.into_values().collect()))
}

/// Calls `each` with centroids and areas of a triangle's pieces after subdivision.
fn middles(mesh: &TriMesh, face: usize, each: &mut impl FnMut(Vec3, f64)) {
    let [a, b, c] = mesh.corners(face);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let n = (longest / SAMPLE_MM).ceil().max(1.0) as usize;
    let area_mm2 = mesh.double_area_vector(face).length() / 2.0 / (n * n) as f64;
    let at = |i: f64, j: f64| a + (b - a) * (i / n as f64) + (c - a) * (j / n as f64);
    for i in 0..n {
        for j in 0..n - i {
            let (x, y) = (i as f64 + 1.0 / 3.0, j as f64 + 1.0 / 3.0);
            each(at(x, y), area_mm2);
            if i + j + 1 < n {
                each(at(x + 1.0 / 3.0, y + 1.0 / 3.0), area_mm2);
            }
        }
    }
}
