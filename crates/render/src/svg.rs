//! Text and frames for charts that are written as SVG.

use std::fmt::Write;

/// Starts a document with a white background, `width` × `height` pixels.
pub fn begin(width: f64, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 \
         {width} {height}\" font-family=\"sans-serif\" font-size=\"14\">\n<rect width=\"{width}\" \
         height=\"{height}\" fill=\"white\"/>\n"
    )
}

/// Closes the document and returns it.
pub fn end(svg: String) -> String {
    svg + "</svg>\n"
}

/// Adds text that starts at `[x, y]`, the left end of its baseline, unless `style` (attributes) says
/// otherwise. `words` must need no escapes.
pub fn text(svg: &mut String, [x, y]: [f64; 2], style: &str, words: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{words}</text>");
}
