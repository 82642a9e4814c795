use super::*;
use crate::fonts::ExtraFont;

fn style(size_mm: f64) -> Style {
    Style {
        size_mm,
        is_bold: false,
        color: [0; 3],
    }
}

/// Text of each page as another program reads it from the file.
pub(crate) fn read(bytes: &[u8]) -> Vec<String> {
    let file = lopdf::Document::load_mem(bytes).expect("the file is a PDF");
    let pages = file.get_pages();
    let text = |n: &u32| file.extract_text(&[*n]).expect("the page has text");
    pages.keys().map(text).collect()
}

/// Number of pictures that the pages of a file show. Equal pictures are stored once, so images of the file
/// are fewer.
pub(crate) fn n_pictures(bytes: &[u8]) -> usize {
    let file = lopdf::Document::load_mem(bytes).expect("the file is a PDF");
    let content = |id: lopdf::ObjectId| {
        file.get_and_decode_page_content(id)
            .expect("the page has content")
    };
    let drawn = file
        .get_pages()
        .into_values()
        .flat_map(|id| content(id).operations);
    drawn.filter(|operation| operation.operator == "Do").count()
}

/// A page of one line, as a file.
fn line(text: &str, is_bold: bool, extra: &[ExtraFont]) -> Vec<u8> {
    let fonts = Fonts::new(extra);
    let mut page = Page::new(&fonts);
    let style = Style {
        is_bold,
        ..style(5.0)
    };
    page.text_within([14.0, 20.0], 180.0, style, text);
    document(text, vec![page], Paper::A4).unwrap()
}

#[test]
fn a_text_that_is_fitted_is_no_wider_than_its_room_and_short_ones_stay_as_they_are() {
    let fonts = Fonts::new(&[]);
    let style = style(4.0);
    let long = "the key, from below, behind and its left: it locks all";
    for room_mm in [200.0, 60.0, 30.0, 8.0] {
        let (fit, text) = fit(&fonts, style, long, room_mm);
        assert!(
            width_mm(&fonts, fit, &text) <= room_mm + 1e-6,
            "{text} in {room_mm} mm"
        );
        assert!(fit.size_mm >= 0.6 * style.size_mm - 1e-9);
        // One more character would have been too wide.
        if let Some(kept) = text.strip_suffix("...") {
            let more = long.chars().take(kept.chars().count() + 1).collect::<String>() + "...";
            assert!(width_mm(&fonts, fit, &more) > room_mm, "{more} in {room_mm} mm");
        }
    }
    assert_eq!(fit(&fonts, style, "done", 60.0).1, "done");
    assert!(fit(&fonts, style, long, 8.0).1.ends_with("..."));
}

#[test]
fn pages_come_out_with_their_pictures_and_the_same_each_time() {
    let fonts = Fonts::new(&[]);
    let made = || {
        let mut page = Page::new(&fonts);
        let bold = Style {
            is_bold: true,
            ..style(5.0)
        };
        page.text([10.0, 20.0], bold, "(piece) 7 \\ ☂ – ü");
        let picture = Image {
            width: 2,
            height: 3,
            rgba: vec![200; 24],
        };
        page.picture([10.0, 30.0], 40.0, picture);
        page.disc([50.0, 50.0], 5.0, [255, 0, 0]);
        document("a (title", vec![page, Page::new(&fonts)], Paper::Letter).unwrap()
    };
    let bytes = made();
    assert!(bytes.starts_with(b"%PDF-1.7") && bytes.ends_with(b"%%EOF"));
    let count = |what: &[u8]| bytes.windows(what.len()).filter(|w| *w == what).count();
    assert_eq!((count(b"/Type /Page\n"), count(b"/Subtype /Image")), (2, 1));
    assert_eq!(read(&bytes)[0].trim(), "(piece) 7 \\ ☂ – ü");
    assert!((bytes == made()) && count(b"Date") == 0, "other bytes, or a date");
}

#[test]
fn a_page_has_the_size_of_its_paper() {
    let fonts = Fonts::new(&[]);
    for (paper, points) in [(Paper::A4, [595.28, 841.89]), (Paper::Letter, [612.0, 792.0])] {
        let bytes = document("", vec![Page::new(&fonts)], paper).unwrap();
        let file = lopdf::Document::load_mem(&bytes).unwrap();
        let page = file.get_dictionary(file.get_pages()[&1]).unwrap();
        let size = page.get(b"MediaBox").and_then(|b| b.as_array()).unwrap();
        for (side, most) in size[2..].iter().zip(points) {
            assert!(
                (side.as_float().unwrap() - most).abs() < 0.01,
                "{paper:?}: {size:?}"
            );
        }
    }
}

#[test]
fn names_in_many_scripts_can_be_read_from_the_file_again() {
    for name in [
        "Größe",
        "Ёжик",
        "γάτα",
        "Łódź ő",
        "Կատու",
        "კატა",
        "ⴰⵎⵓⵛⵛ",
        "Ōtsuchi",
        "1 × 2 – 3",
    ] {
        for is_bold in [false, true] {
            assert_eq!(read(&line(name, is_bold, &[]))[0].trim(), name);
        }
    }
    // Letters stand in the file as they stand on the page: from left to right.
    let backwards: String = "עכבר".chars().rev().collect();
    assert_eq!(read(&line("עכבר", false, &[]))[0].trim(), backwards);
}

/// Pixels that come back from the file are those of the picture on white.
#[test]
fn a_picture_comes_back_pixel_for_pixel() {
    let fonts = Fonts::new(&[]);
    let mut page = Page::new(&fonts);
    let rgba = vec![9, 8, 7, 255, 1, 2, 3, 255, 4, 5, 6, 255, 0, 0, 0, 0];
    let (width, height) = (2, 2);
    page.picture([0.0; 2], 10.0, Image { width, height, rgba });
    let bytes = document("", vec![page], Paper::A4).unwrap();
    let file = lopdf::Document::load_mem(&bytes).unwrap();
    let streams = file.objects.values().filter_map(|o| o.as_stream().ok());
    let is_image =
        |s: &&lopdf::Stream| s.dict.get(b"Subtype").and_then(|n| n.as_name()).ok() == Some(b"Image");
    let images: Vec<Vec<u8>> = streams
        .filter(is_image)
        .map(|s| s.decompressed_content().unwrap())
        .collect();
    assert_eq!(images, [vec![9, 8, 7, 1, 2, 3, 4, 5, 6, 255, 255, 255]]);
}

#[test]
fn no_name_stops_the_program_and_what_no_font_has_becomes_a_box() {
    let long = "Прапорщик 兔子 ".repeat(3000);
    let names = [
        "兔子",
        "🐰 bunny",
        "👩‍👩‍👧‍👦",
        "a\u{0}b\u{7}c\nd\te\u{2028}f\u{85}g\u{2029}h",
        "\u{202E}evil\u{202C} \u{2066}x",
        "\u{301}\u{301}\u{200D}\u{FE0F}",
        "\u{FEFF}\u{FFFE}\u{10FFFF}\u{E000}",
        "",
        " ",
        "עברית and English و العربية",
        "กขค ไทย बिल्ली",
        &long,
    ];
    for name in names {
        let bytes = line(name, true, &[]);
        assert_eq!(read(&bytes).len(), 1, "{name:?}");
        let fonts = Fonts::new(&[]);
        let fit = fit(&fonts, style(5.0), name, 100.0);
        assert!(width_mm(&fonts, fit.0, &fit.1) <= 100.0 + 1e-9);
    }
    let runs = Fonts::new(&[]).line("兔", false);
    assert_eq!(
        runs[0].glyphs[0].glyph_id.to_u32(),
        0,
        "the glyph of no character is a box"
    );
    assert!(runs[0].width() > 0.3);
}

#[test]
fn a_file_holds_the_letters_that_it_uses_alone() {
    let whole = dejavu::sans_condensed::regular().len();
    let bytes = line("the key, from below: it locks all", false, &[]);
    assert!(bytes.len() < whole / 40, "{} of {whole} bytes", bytes.len());
}
