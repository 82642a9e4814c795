//! Space below a posed piece that supports fill.

use crate::columns::{Columns, Span};
use crate::printer::Printer;
use crate::slicing::Style;

/// Overhang of a layer over the one below that needs no support, mm: half a line.
const OVERHANG_MM: f64 = 0.225;
/// Cosine of the slope below which faces stand on snug supports: 40° from level.
const COS_SNUG: f64 = 0.766;
/// Gap between a support and the piece above, mm.
pub(crate) const CONTACT_MM: f64 = 0.2;

/// Upward component of a face's unit normal below which the face stands on supports.
fn least_normal(style: Style, layer_mm: f64) -> f64 {
    match style {
        Style::Grid => -OVERHANG_MM / OVERHANG_MM.hypot(layer_mm),
        Style::Snug => -COS_SNUG,
    }
}

/// Intervals filled by supports in each column.
pub(crate) struct Supports {
    starts: Vec<u32>,
    /// Lower and upper ends, mm.
    spans: Vec<[f64; 2]>,
    style: Style,
}

impl Supports {
    pub fn of(columns: &Columns, printer: &Printer, style: Style) -> Self {
        let layer_mm = printer.layer_mm;
        let least_normal = least_normal(style, layer_mm);
        let mut supports = Self {
            starts: Vec::with_capacity(columns.len() + 1),
            spans: Vec::new(),
            style,
        };
        for column in 0..columns.len() {
            supports.starts.push(supports.spans.len() as u32);
            let mut below_mm = 0.0;
            for span in columns.spans(column) {
                let Span {
                    bottom_mm,
                    top_mm,
                    bottom_normal,
                } = *span;
                if bottom_normal < least_normal && bottom_mm - below_mm > CONTACT_MM + layer_mm {
                    supports.spans.push([below_mm, bottom_mm - CONTACT_MM]);
                }
                below_mm = top_mm;
            }
        }
        supports.starts.push(supports.spans.len() as u32);
        supports
    }

    pub fn volume_mm3(&self, columns: &Columns) -> f64 {
        self.spans.iter().map(|[lo, hi]| hi - lo).sum::<f64>() * columns.cell_mm2()
    }

    pub fn of_column(&self, column: usize) -> &[[f64; 2]] {
        &self.spans[self.starts[column] as usize..self.starts[column + 1] as usize]
    }

    /// Number of cells by which the slicer widens the supports on all sides.
    pub fn margin_cells(&self) -> usize {
        match self.style {
            Style::Grid => 1,
            Style::Snug => 0,
        }
    }
}
