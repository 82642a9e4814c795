//! Words and boxes of the charts that are written as SVG text.

use std::fmt::Write;

/// The beginning of a document on white, `width` × `height` pixels.
pub fn begin(width: f64, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"14\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    )
}

/// The document with its end.
pub fn end(svg: String) -> String {
    svg + "</svg>\n"
}

/// Words at the left end of their base line, unless `style` (attributes) says otherwise. They must need no
/// escapes.
pub fn text(svg: &mut String, [x, y]: [f64; 2], style: &str, words: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{words}</text>");
}
