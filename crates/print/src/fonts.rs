//! Fonts of the booklet, and lines of text set in them.
//!
//! DejaVu Sans Condensed, plain and bold, is part of the program: Latin, Greek, Cyrillic, Armenian, Georgian,
//! Hebrew and Arabic letters look the same on every machine. A caller lends fonts ([`ExtraFont`]) for other
//! characters; they are used for those characters alone. A character that no font has becomes a box.
//!
//! A line is cut into runs of one font and one direction, and each run is shaped: letters join, marks sit on
//! their letters.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use krilla::Data;
use krilla::text::{Font, GlyphId, KrillaGlyph};
use rustybuzz::{Direction, Face, UnicodeBuffer};
use unicode_bidi::{BidiInfo, Level};

/// Font that is lent to a booklet for characters that its own fonts lack.
#[derive(Clone)]
pub struct ExtraFont {
    bytes: Arc<Vec<u8>>,
    index: u32,
    font: Font,
}

impl ExtraFont {
    /// Takes a font file's bytes and the font's place in it, which is 0 but for collections. `None` if the
    /// bytes are no font.
    pub fn new(bytes: Vec<u8>, index: u32) -> Option<Self> {
        Face::from_slice(&bytes, index)?;
        let bytes = Arc::new(bytes);
        let embedded = Font::new(Data::from(bytes.clone()), index)?;
        Some(Self {
            bytes,
            index,
            font: embedded,
        })
    }
}

impl std::fmt::Debug for ExtraFont {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ExtraFont({} bytes, {})", self.bytes.len(), self.index)
    }
}

/// Returns those of `characters` that a font file has, none if the bytes are no font.
pub fn available_characters(bytes: &[u8], index: u32, characters: &BTreeSet<char>) -> BTreeSet<char> {
    let Some(face) = Face::from_slice(bytes, index) else {
        return BTreeSet::new();
    };
    let has = |c: &char| face.glyph_index(*c).is_some();
    characters.iter().copied().filter(has).collect()
}

/// Returns the characters of a text that neither the program's fonts nor `extra` have.
pub fn missing_characters(text: &str, extra: &[ExtraFont]) -> BTreeSet<char> {
    Fonts::new(extra).missing_characters(text)
}

/// Bytes of the two fonts that are part of the program.
fn own() -> [&'static [u8]; 2] {
    [dejavu::sans_condensed::regular(), dejavu::sans_condensed::bold()]
}

/// Place of a font in [`Fonts`]: 0 plain, 1 bold, then the fonts that are lent.
pub(crate) type FontId = usize;
const PLAIN: FontId = 0;
const BOLD: FontId = 1;
const FIRST_EXTRA: FontId = 2;

/// Fonts that a booklet is set in.
pub(crate) struct Fonts<'a> {
    faces: Vec<Typeface<'a>>,
}

/// A font as text is shaped with it, and as a file holds it.
struct Typeface<'a> {
    face: Face<'a>,
    font: Font,
}

impl Typeface<'_> {
    fn has(&self, c: char) -> bool {
        self.face.glyph_index(c).is_some()
    }
}

/// Glyphs of one font and one direction, from left to right.
pub(crate) struct Run {
    pub font: FontId,
    pub text: String,
    /// Lengths of glyphs are shares of the text size.
    pub glyphs: Vec<KrillaGlyph>,
}

impl Run {
    /// Width as a share of the text size.
    pub fn width(&self) -> f64 {
        self.glyphs.iter().map(|g| f64::from(g.x_advance)).sum()
    }
}

impl<'a> Fonts<'a> {
    /// Takes the program's fonts and those that are lent, in order of preference.
    pub fn new(extra: &'a [ExtraFont]) -> Self {
        let own = own().into_iter().filter_map(|bytes| {
            let face = Face::from_slice(bytes, 0)?;
            let embedded = Font::new(Data::from(bytes), 0)?;
            Some(Typeface { face, font: embedded })
        });
        let extra = extra.iter().filter_map(|font| {
            let face = Face::from_slice(&font.bytes, font.index)?;
            let embedded = font.font.clone();
            Some(Typeface { face, font: embedded })
        });
        Self {
            faces: own.chain(extra).collect(),
        }
    }

    /// Font as a file holds it.
    pub fn font(&self, font: FontId) -> Font {
        self.faces[font].font.clone()
    }

    /// Shapes a line of text; runs from left to right.
    pub fn line(&self, text: &str, is_bold: bool) -> Vec<Run> {
        let text = printable(text);
        let bidi = BidiInfo::new(&text, Some(Level::ltr()));
        let mut runs = Vec::new();
        for paragraph in &bidi.paragraphs {
            let (levels, ranges) = bidi.visual_runs(paragraph, paragraph.range.clone());
            for range in ranges {
                let is_rtl = levels.get(range.start).is_some_and(Level::is_rtl);
                let shown: String = text[range].chars().filter(|c| !is_direction(*c)).collect();
                let mut parts = self.parts(&shown, is_bold);
                if is_rtl {
                    parts.reverse();
                }
                let shaped = parts
                    .into_iter()
                    .map(|(font, part)| self.shape(font, part, is_rtl));
                runs.extend(shaped);
            }
        }
        runs
    }

    /// Width of a line as a share of the text size.
    pub fn width(&self, text: &str, is_bold: bool) -> f64 {
        self.line(text, is_bold).iter().map(Run::width).sum()
    }

    /// Height of the middle of the digits above the baseline, as a share of the text size.
    pub fn middle_of_digits(&self, is_bold: bool) -> f64 {
        let face = &self.faces[own_font(is_bold)].face;
        let digit = face.glyph_index('0').and_then(|g| face.glyph_bounding_box(g));
        let middle = digit.map_or(0.0, |b| 0.5 * (f64::from(b.y_min) + f64::from(b.y_max)));
        middle / f64::from(face.units_per_em())
    }

    /// Reach of the plain font's letters above and below the baseline, as shares of the text size.
    #[cfg(test)]
    pub fn reach(&self) -> [f64; 2] {
        let face = &self.faces[PLAIN].face;
        [face.ascender(), -face.descender()].map(|x| f64::from(x) / f64::from(face.units_per_em()))
    }

    /// Characters of a text that no font has.
    fn missing_characters(&self, text: &str) -> BTreeSet<char> {
        let lacks = |c: &char| !is_invisible(*c) && !self.faces.iter().any(|face| face.has(*c));
        printable(text).chars().filter(lacks).collect()
    }

    /// Cuts a text into parts of one font each.
    fn parts<'t>(&self, text: &'t str, is_bold: bool) -> Vec<(FontId, &'t str)> {
        let mut parts: Vec<(FontId, Range<usize>)> = Vec::new();
        for (at, c) in text.char_indices() {
            let end = at + c.len_utf8();
            let before = parts.last().map(|p| p.0);
            let font = self.font_of(c, before, is_bold);
            match parts.last_mut() {
                Some(last) if last.0 == font => last.1.end = end,
                _ => parts.push((font, at..end)),
            }
        }
        parts
            .into_iter()
            .map(|(font, range)| (font, &text[range]))
            .collect()
    }

    /// Font of a character, given that of the one before. Joiners and variation selectors stay with it, and
    /// so do marks and letters that it has where the program's fonts lack them.
    fn font_of(&self, c: char, before: Option<FontId>, is_bold: bool) -> FontId {
        let own = own_font(is_bold);
        if let Some(before) = before.filter(|_| is_invisible(c)) {
            return before;
        }
        let has = |font: &FontId| self.faces[*font].has(c);
        let others = FIRST_EXTRA..self.faces.len();
        [own]
            .into_iter()
            .chain(before)
            .chain(others)
            .find(has)
            .unwrap_or(own)
    }

    fn shape(&self, font: FontId, text: &str, is_rtl: bool) -> Run {
        let face = &self.faces[font].face;
        let mut buffer = UnicodeBuffer::new();
        buffer.push_str(text);
        buffer.guess_segment_properties();
        buffer.set_direction(if is_rtl {
            Direction::RightToLeft
        } else {
            Direction::LeftToRight
        });
        let output = rustybuzz::shape(face, &[], buffer);
        let starts: BTreeSet<usize> = output.glyph_infos().iter().map(|i| i.cluster as usize).collect();
        let end = |start: usize| starts.range(start + 1..).next().copied().unwrap_or(text.len());
        let share = |units: i32| units as f32 / face.units_per_em() as f32;
        let glyph = |(info, at): (&rustybuzz::GlyphInfo, &rustybuzz::GlyphPosition)| {
            let start = info.cluster as usize;
            let [along, down, x, y] = [at.x_advance, at.y_advance, at.x_offset, at.y_offset].map(share);
            KrillaGlyph::new(
                GlyphId::new(info.glyph_id),
                along,
                x,
                y,
                down,
                start..end(start),
                None,
            )
        };
        let glyphs = output.glyph_infos().iter().zip(output.glyph_positions());
        Run {
            font,
            text: text.to_owned(),
            glyphs: glyphs.map(glyph).collect(),
        }
    }
}

fn own_font(is_bold: bool) -> FontId {
    if is_bold { BOLD } else { PLAIN }
}

/// Text on one line: control characters and ends of lines become spaces.
pub(crate) fn printable(text: &str) -> String {
    let is_control = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    text.chars()
        .map(|c| if is_control(c) { ' ' } else { c })
        .collect()
}

/// Name amid other words, so that the directions of its letters do not turn the words around it.
pub(crate) fn isolate(name: &str) -> String {
    format!("\u{2068}{name}\u{2069}")
}

/// Tells marks of direction, which order letters and are not printed.
fn is_direction(c: char) -> bool {
    matches!(c, '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

/// Tells joiners, variation selectors and other characters that draw nothing by themselves.
fn is_invisible(c: char) -> bool {
    let is_ignored = matches!(
        c,
        '\u{AD}'
            | '\u{34F}'
            | '\u{61C}'
            | '\u{180B}'..='\u{180F}'
            | '\u{200B}'..='\u{200F}'
            | '\u{2060}'..='\u{2064}'
            | '\u{FE00}'..='\u{FE0F}'
            | '\u{FEFF}'
            | '\u{E0000}'..='\u{E0FFF}'
    );
    is_ignored || is_direction(c)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A character that DejaVu Sans Mono has and the program's fonts lack.
    const RECORDER: char = '\u{2315}';

    /// Numbers of a line's glyphs.
    fn glyphs(fonts: &Fonts<'_>, text: &str) -> Vec<u32> {
        let runs = fonts.line(text, false);
        let glyphs = runs.iter().flat_map(|run| &run.glyphs);
        glyphs.map(|g| g.glyph_id.to_u32()).collect()
    }

    fn extra() -> ExtraFont {
        ExtraFont::new(dejavu::sans_mono::regular().to_vec(), 0).unwrap()
    }

    #[test]
    fn a_font_that_is_lent_is_used_for_what_is_lacking_alone() {
        let text = format!("key {RECORDER} 7");
        assert_eq!(missing_characters(&text, &[]), [RECORDER].into());
        assert!(
            missing_characters(&text, &[extra()]).is_empty()
                && missing_characters("Größe, γάτα, Ёжик, עכבר", &[]).is_empty()
        );
        let lent = [extra()];
        let runs = Fonts::new(&lent).line(&text, true);
        let fonts: Vec<(FontId, &str)> = runs.iter().map(|run| (run.font, run.text.as_str())).collect();
        assert_eq!(fonts, [(BOLD, "key "), (FIRST_EXTRA, "\u{2315}"), (BOLD, " 7")]);
        // Text that the program's fonts have is set as without the font.
        assert_eq!(
            glyphs(&Fonts::new(&lent), "key 7"),
            glyphs(&Fonts::new(&[]), "key 7")
        );
    }

    #[test]
    fn bytes_that_are_no_font_are_refused() {
        assert!(ExtraFont::new(Vec::new(), 0).is_none());
        assert!(ExtraFont::new(b"no font at all".to_vec(), 0).is_none());
        assert!(ExtraFont::new(dejavu::sans_mono::regular()[..2000].to_vec(), 0).is_none());
        assert!(ExtraFont::new(dejavu::sans_mono::regular().to_vec(), 1).is_none());
        assert!(available_characters(b"no font", 0, &['a'].into()).is_empty());
        assert_eq!(
            available_characters(own()[0], 0, &['a', '兔'].into()),
            ['a'].into()
        );
    }

    #[test]
    fn runs_stand_from_left_to_right_and_letters_of_words_from_right_to_left_are_turned() {
        let fonts = Fonts::new(&[]);
        let runs = fonts.line("a \u{5E2}\u{5DB} b", false);
        let texts: Vec<&str> = runs.iter().map(|run| run.text.as_str()).collect();
        assert_eq!(texts, ["a ", "\u{5E2}\u{5DB}", " b"]);
        let starts: Vec<usize> = runs[1].glyphs.iter().map(|g| g.text_range.start).collect();
        assert_eq!(starts, [2, 0], "the last letter stands leftmost");
        // What follows a name that is isolated stays behind it, even numbers.
        for name in ["\u{5E2}\u{5DB}", "\u{202E}ab"] {
            let runs = fonts.line(&format!("{} 2 of 9", isolate(name)), false);
            assert_eq!(
                runs.last().map(|run| run.text.as_str()),
                Some(" 2 of 9"),
                "{name:?}"
            );
        }
    }

    #[test]
    fn a_letter_and_its_mark_are_one_glyph_and_arabic_letters_join() {
        let fonts = Fonts::new(&[]);
        assert_eq!(glyphs(&fonts, "o\u{308}"), glyphs(&fonts, "ö"));
        let apart = glyphs(&fonts, "\u{628} \u{628} \u{628}");
        let joined = glyphs(&fonts, "\u{628}\u{628}\u{628}");
        assert!(
            joined.len() == 3 && !joined.contains(&apart[0]),
            "{joined:?} {apart:?}"
        );
    }

    #[test]
    fn a_line_is_as_wide_as_its_letters_and_control_characters_are_spaces() {
        let fonts = Fonts::new(&[]);
        let width = |text: &str| fonts.width(text, false);
        assert!((width("007") - 3.0 * width("0")).abs() < 1e-6);
        assert!(width("wide") > width("lil"));
        assert!((width("a\u{0}b") - width("a b")).abs() < 1e-6);
        assert!((width("") - 0.0).abs() < 1e-12);
        assert!(fonts.width("wide", true) > width("wide"));
        assert!((fonts.middle_of_digits(true) - 0.36).abs() < 0.01);
    }
}
