//! Pages of text alone: what to do before the first step and after the last.

use super::bears::{plain, wrap};
use super::{INK, RIM_MM, Section, bold, start_page};
use crate::fonts::Fonts;
use crate::pdf::{PAGE_MM, Page, Style};

/// Lays out sections below one another, on as many pages as they need.
pub(super) fn text_pages<'f>(title: &str, sections: &[Section], fonts: &'f Fonts<'f>) -> Vec<Page<'f>> {
    const LINE_MM: f64 = 5.6;
    const TOP_MM: f64 = 36.0;
    let (room_mm, bottom_mm) = (PAGE_MM[0] - 2.0 * RIM_MM, PAGE_MM[1] - RIM_MM - 8.0);
    let style = Style {
        size_mm: 4.2,
        ..plain(INK)
    };
    let mut pages = Vec::new();
    let mut down = f64::INFINITY;
    for section in sections {
        let lines: Vec<Vec<String>> = section
            .lines
            .iter()
            .map(|l| wrap(fonts, l, style, room_mm))
            .collect();
        let n_lines: usize = lines.iter().map(Vec::len).sum();
        let height = LINE_MM * (n_lines as f64 + 0.4 * lines.len() as f64 + 3.0);
        if down + height > bottom_mm {
            pages.push(start_page(title, "", fonts));
            down = TOP_MM;
        }
        let Some(page) = pages.last_mut() else { break };
        page.text_within([RIM_MM, down], room_mm, bold(5.0, INK), &section.title);
        down += 0.4 * LINE_MM;
        for line in lines {
            for part in line {
                down += LINE_MM;
                page.text_within([RIM_MM, down], room_mm, style, &part);
            }
            down += 0.4 * LINE_MM;
        }
        down += 2.0 * LINE_MM;
    }
    pages
}
