//! Conversion of SVG to pixels with an embedded font, independent of the fonts of the machine.

use std::sync::{Arc, OnceLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, fontdb};

use crate::{Error, Result};

/// DejaVu Sans Condensed, upright and oblique (Bitstream Vera licence, which allows embedding).
fn fonts() -> Arc<fontdb::Database> {
    static FONTS: OnceLock<Arc<fontdb::Database>> = OnceLock::new();
    FONTS
        .get_or_init(|| {
            let mut fonts = fontdb::Database::new();
            for face in [dejavu::sans_condensed::regular(), dejavu::sans_condensed::oblique()] {
                fonts.load_font_source(fontdb::Source::Binary(Arc::new(face)));
            }
            Arc::new(fonts)
        })
        .clone()
}

/// Renders an SVG; `resolution` is in pixels per inch.
pub(crate) fn pixels(svg: &str, resolution: f64) -> Result<Pixmap> {
    Error::check_option(
        "resolution",
        "between 10 and 2400 pixels per inch",
        resolution,
        (10.0..=2400.0).contains(&resolution),
    )?;
    let fonts = fonts();
    let family = fonts.faces().next().map(|face| face.families[0].0.clone()).unwrap_or_default();
    let options =
        usvg::Options { dpi: resolution as f32, fontdb: fonts, font_family: family, ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|e| not_rendered(e.to_string()))?;
    let size = tree.size().to_int_size();
    let mut pixmap =
        Pixmap::new(size.width(), size.height()).ok_or_else(|| not_rendered(format!("{size:?} pixels")))?;
    resvg::render(&tree, Transform::default(), &mut pixmap.as_mut());
    Ok(pixmap)
}

/// The PNG file of an SVG.
pub(crate) fn png(svg: &str, resolution: f64) -> Result<Vec<u8>> {
    pixels(svg, resolution)?.encode_png().map_err(|e| not_rendered(e.to_string()))
}

fn not_rendered(why: String) -> Error {
    Error::definition("figure", why, "lower the resolution or the size of the figure")
}
