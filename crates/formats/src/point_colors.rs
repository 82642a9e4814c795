//! Division of a surface by the colours of its points.

use super::polygons::{Numbering, divides};
use super::{LabelSource, Labelling, Loaded};

/// Red, green, blue and alpha.
pub(super) type Color = [u8; 4];

/// Largest number of point colours that divide a surface. Painted models have a few; scans and shaded models
/// have one for nearly every point.
const MAX_COLORS: usize = 64;

/// Colours of points as stored in a file. Only all values together reveal their scale.
#[derive(Default)]
pub(super) struct Channels {
    /// Red, green, blue and alpha of each point; alpha is 0 if the file has none.
    pub(super) rows: Vec<[f32; 4]>,
    /// True if the numbers have an integer type, so that 1 is nearly black.
    pub(super) are_whole: bool,
}

impl Channels {
    /// Converts the colours to a scale of 255. Fractions reach up to 1, integers to 255 or 65535; fractions
    /// above 1 have the scale of integers.
    pub(super) fn colors(&self) -> Vec<Color> {
        let channels = self.rows.iter().flat_map(|row| &row[..3]);
        let greatest = channels.fold(0.0_f32, |greatest, &channel| greatest.max(channel));
        let full = match greatest {
            _ if greatest > 255.0 => 65535.0,
            _ if self.are_whole || greatest > 1.0 => 255.0,
            _ => 1.0,
        };
        let color = |row: &[f32; 4]| row.map(|channel| eight_bits(f64::from(channel / full)));
        self.rows.iter().map(color).collect()
    }
}

/// Converts a channel from [0, 1] to 8 bits, so that colours are equal up to rounding.
pub(super) fn eight_bits(channel: f64) -> u8 {
    // The cast clamps values beyond the scale; NaN becomes 0.
    (channel * 255.0).round() as u8
}

/// Divides `loaded` by the colours of its points, one per point, unless its faces have colours. More colours
/// than people paint with do not divide it; a note reports that.
pub(super) fn divide(loaded: &mut Loaded, colors: &[Color]) {
    if colors.len() != loaded.mesh.points.len() || loaded.labels(LabelSource::Color).is_some() {
        return;
    }
    let n_colors = count_used(loaded, colors);
    if n_colors > MAX_COLORS {
        loaded.notes.push(format!(
            "the points have {n_colors} colours, too many to define pieces"
        ));
        return;
    }
    let labels = labels(loaded, colors);
    if divides(&labels) {
        let source = LabelSource::Color;
        loaded.labellings.push(Labelling { source, labels });
        loaded.labellings.sort_by_key(|l| l.source);
    }
}

/// Counts the different colours at the corners of triangles.
fn count_used(loaded: &Loaded, colors: &[Color]) -> usize {
    let mut is_used = vec![false; colors.len()];
    let corners = loaded.mesh.triangles.as_flattened();
    corners.iter().for_each(|&point| is_used[point as usize] = true);
    let used = colors.iter().zip(is_used).filter(|(_, is_used)| *is_used);
    let mut used: Vec<Color> = used.map(|(color, _)| *color).collect();
    used.sort_unstable();
    used.dedup();
    used.len()
}

/// Labels each triangle by the colour of its face.
fn labels(loaded: &Loaded, colors: &[Color]) -> Vec<i64> {
    let mut numbering = Numbering::default();
    let mut labels = Vec::with_capacity(loaded.file_face.len());
    let mut corners = Vec::new();
    for face in loaded.file_face.chunk_by(|a, b| a == b) {
        let triangles = &loaded.mesh.triangles[labels.len()..labels.len() + face.len()];
        corners.clear();
        // A face is a fan around its first corner: each further triangle adds its last corner.
        corners.extend(triangles[0].map(|point| colors[point as usize]));
        corners.extend(triangles[1..].iter().map(|t| colors[t[2] as usize]));
        let label = numbering.number(of_face(&mut corners));
        labels.resize(labels.len() + face.len(), label);
    }
    labels
}

/// Colour of a face from the colours of its corners, at least one. The most frequent colour wins; among ties,
/// the one nearest to the mean of all, then the least. Independent of the order of corners.
fn of_face(colors: &mut [Color]) -> Color {
    colors.sort_unstable();
    let n = colors.len() as i64;
    let mut total = [0_i64; 4];
    for color in colors.iter() {
        (0..4).for_each(|c| total[c] += i64::from(color[c]));
    }
    let far_sq = |color: &Color| -> i64 {
        (0..4)
            .map(|c| (n * i64::from(color[c]) - total[c]).saturating_pow(2))
            .fold(0, i64::saturating_add)
    };
    let runs = colors.chunk_by(|a, b| a == b);
    let best = runs.min_by_key(|run| (std::cmp::Reverse(run.len()), far_sq(&run[0])));
    best.map_or([0; 4], |run| run[0])
}

#[cfg(test)]
mod tests {
    use super::super::read_mesh;
    use super::super::tests::assert_note;
    use super::*;

    const RED: Color = [255, 0, 0, 255];
    const ORANGE: Color = [255, 100, 0, 255];
    const YELLOW: Color = [255, 255, 0, 255];

    #[test]
    fn a_face_has_the_colour_of_most_corners_else_the_one_nearest_to_the_mean() {
        for (corners, color) in [
            (vec![RED, YELLOW, YELLOW], YELLOW),
            (vec![YELLOW, RED, ORANGE], ORANGE),
            (vec![YELLOW, YELLOW, RED, ORANGE, RED], RED),
            (vec![YELLOW, RED], RED),
        ] {
            for turn in 0..corners.len() {
                let mut turned = corners.clone();
                turned.rotate_left(turn);
                assert_eq!(of_face(&mut turned), color, "{corners:?} by {turn}");
            }
        }
    }

    #[test]
    fn fractions_bytes_and_words_have_the_same_colours() {
        let of = |rows: Vec<[f32; 4]>, are_whole| Channels { rows, are_whole }.colors();
        let expected = [[255, 0, 51, 0], [0, 0, 0, 0]];
        assert_eq!(of(vec![[1.0, 0.0, 0.2, 0.0], [0.0; 4]], false), expected);
        assert_eq!(of(vec![[255.0, 0.0, 51.0, 0.0], [0.0; 4]], false), expected);
        assert_eq!(of(vec![[255.0, 0.0, 51.0, 0.0], [0.0; 4]], true), expected);
        assert_eq!(of(vec![[65535.0, 0.0, 13107.0, 0.0], [0.0; 4]], true), expected);
        assert_eq!(of(vec![[1.0, 0.0, 0.0, 0.0]], true), [[1, 0, 0, 0]]);
        assert_eq!(of(vec![[f32::NAN, -3.0, f32::INFINITY, 1.0]], false)[0][1], 0);
    }

    /// A PLY of two triangles and a quad over five points, with further properties and their values.
    fn ply(declared: &str, rows: [&str; 5], of_faces: [&str; 3]) -> Loaded {
        let points = ["0 0 0", "1 0 0", "0 1 0", "0 0 1", "1 1 0"];
        let points: Vec<String> = points
            .iter()
            .zip(rows)
            .map(|(p, row)| format!("{p} {row}\n"))
            .collect();
        let is_colored = !of_faces[0].is_empty();
        let face_colors = if is_colored {
            "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        } else {
            ""
        };
        let [a, b, c] = of_faces;
        read(&format!(
            "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float \
             z\n{declared}\nelement face 3\nproperty list uchar int \
             vertex_indices\n{face_colors}end_header\n{}3 0 1 2 {a}\n3 0 1 3 {b}\n4 1 4 2 3 {c}\n",
            points.concat()
        ))
    }

    fn read(text: &str) -> Loaded {
        read_mesh(text.as_bytes(), None).unwrap()
    }

    fn channels(kind: &str, prefix: &str) -> String {
        ["red", "green", "blue"]
            .map(|c| format!("property {kind} {prefix}{c}"))
            .join("\n")
    }

    const NO_FACE_COLORS: [&str; 3] = [""; 3];
    const ROWS: [&str; 5] = ["1 0 0", "1 0 0", "0 0 1", "0 0 1", "0 0 1"];

    #[test]
    fn points_of_a_ply_divide_it_whatever_their_colours_are_called() {
        let divided = Some(&[0, 0, 1, 1][..]);
        for declared in [
            channels("float", ""),
            channels("uchar", "diffuse_"),
            "property uchar r\nproperty uchar g\nproperty uchar b".to_owned(),
        ] {
            let loaded = ply(&declared, ROWS, NO_FACE_COLORS);
            assert_eq!(loaded.labels(LabelSource::Color), divided, "{declared}");
            assert_eq!(loaded.notes, Vec::<String>::new());
        }
        // Two of three channels are no colour.
        let few = "property uchar red\nproperty uchar green\nproperty uchar gloss";
        assert_eq!(ply(few, ROWS, NO_FACE_COLORS).labellings, []);
    }

    #[test]
    fn colours_of_faces_come_before_those_of_points_if_they_divide() {
        let colors = ["9 9 9", "7 7 7", "9 9 9"];
        let loaded = ply(&channels("uchar", ""), ROWS, colors);
        assert_eq!(loaded.labels(LabelSource::Color), Some(&[0, 1, 0, 0][..]));
        let loaded = ply(&channels("uchar", ""), ROWS, ["9 9 9"; 3]);
        assert_eq!(loaded.labels(LabelSource::Color), Some(&[0, 0, 1, 1][..]));
    }

    #[test]
    fn an_obj_has_colours_where_each_point_has_one() {
        let obj = |of: [&str; 4]| {
            let points = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
            let points = points.iter().zip(of).map(|(p, color)| format!("v {p} {color}\n"));
            let text = points.collect::<String>() + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
            read(&text).labels(LabelSource::Color).map(<[i64]>::to_vec)
        };
        let divided = Some(vec![0, 1, 0, 1]);
        assert_eq!(obj(["1 0 0", "1 0 0", "0 0 1", "0 0 1"]), Some(vec![0, 0, 1, 1]));
        assert_eq!(obj(["255 0 0", "0 9 0", "0 9 0", "255 0 0"]), divided);
        // Colours are the same up to rounding.
        assert_eq!(obj(["0.501961 0 0", "0 1 0", "0 1 0", "0.50196 0 0"]), divided);
        // Alpha comes last, or the weight first.
        assert_eq!(obj(["1 0 0 1", "0 1 0 1", "0 1 0 1", "1 0 0 1"]), divided);
        assert_eq!(obj(["1 0.5 0 0", "1 0 1 0", "1 0 1 0", "1 0.5 0 0"]), divided);
        // A weight alone, a missing colour, a normal, and a word are no colours.
        assert_eq!(obj(["1", "0.5", "0.5", "1"]), None);
        assert_eq!(obj(["1 0 0", "0 1 0", "0 1 0", ""]), None);
        assert_eq!(obj(["1 0 0", "0 -1 0", "0 -1 0", "1 0 0"]), None);
        assert_eq!(obj(["1 0 0", "0 x 0", "0 x 0", "1 0 0"]), None);
    }

    #[test]
    fn an_off_has_colours_of_points_if_its_first_word_says_so() {
        let off = |word: &str, [a, b, c, d]: [&str; 4]| {
            let text = format!(
                "{word}\n4 4 0\n0 0 0 {a}\n1 0 0 {b}\n0 1 0 {c}\n0 0 1 {d}\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 \
                 3 2\n"
            );
            read(&text).labels(LabelSource::Color).map(<[i64]>::to_vec)
        };
        let divided = Some(vec![0, 1, 0, 1]);
        let rows = ["255 0 0 255", "0 9 0 255", "0 9 0 255", "255 0 0 255"];
        assert_eq!(off("COFF", rows), divided);
        assert_eq!(off("OFF", rows), None);
        assert_eq!(
            off(
                "CNOFF",
                ["0 0 1 1 0 0", "0 1 0 0 1 0", "1 0 0 0 1 0", "0 1 1 1 0 0"]
            ),
            divided
        );
        assert_eq!(off("COFF", [rows[0], rows[1], rows[2], ""]), None);
    }

    #[test]
    fn more_colours_than_people_paint_with_divide_nothing_and_are_noted() {
        let fan = |n_colors: usize| {
            let points = (0..100).map(|i| format!("v {i} {} 0 {} 0 0\n", i * i, i % n_colors));
            let faces = (2..100).map(|i| format!("f 1 {i} {}\n", i + 1));
            read(&points.chain(faces).collect::<String>())
        };
        let few = fan(MAX_COLORS);
        assert!(few.labels(LabelSource::Color).is_some());
        assert_eq!(few.notes, Vec::<String>::new());
        let many = fan(MAX_COLORS + 1);
        assert_eq!(many.labels(LabelSource::Color), None);
        assert_note(&many, "the points have 65 colours, too many to define pieces");
    }

    #[test]
    fn an_unused_texture_is_noted() {
        let loaded = ply("comment TextureFile skin.png", [""; 5], NO_FACE_COLORS);
        assert_eq!(loaded.notes, ["the file's texture is not used"]);
        let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
        assert_note(&read(obj), "texture");
        for plain in [obj.replace("mtllib", "# mtllib"), obj.replace("/1", "//1")] {
            assert_eq!(read(&plain).notes, Vec::<String>::new());
        }
    }
}
