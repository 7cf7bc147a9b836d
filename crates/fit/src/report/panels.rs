//! Panels in rows of three, as SVG.

use std::fmt::{self, Write};

const SIZE: (f64, f64) = (220.0, 150.0);
const MARGIN: (f64, f64) = (34.0, 28.0);
const COLUMNS: usize = 3;

/// Where the frame of a panel lies, pixels.
pub(super) struct Panel {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) wide: f64,
    pub(super) high: f64,
}

/// The beginning of a picture of so many pixels, on white.
pub(super) fn begin((width, height): (f64, f64)) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" font-family=\"sans-serif\" \
         font-size=\"10\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    )
}

/// The size of so many panels, pixels.
pub(super) fn size(panels: usize) -> (f64, f64) {
    (SIZE.0 * COLUMNS as f64, SIZE.1 * panels.div_ceil(COLUMNS) as f64)
}

impl Panel {
    /// A panel by its number.
    pub(super) fn new(number: usize) -> Self {
        let (column, row) = (number % COLUMNS, number / COLUMNS);
        let (left, top) = (column as f64 * SIZE.0 + MARGIN.0, row as f64 * SIZE.1 + MARGIN.1);
        Self { left, top, wide: SIZE.0 - MARGIN.0 - 8.0, high: SIZE.1 - 2.0 * MARGIN.1 }
    }

    /// Its title and frame, and words on the left at heights, pixels.
    pub(super) fn frame(&self, svg: &mut String, title: &str, marks: impl Iterator<Item = (f64, String)>) -> fmt::Result {
        let Self { left, top, wide, high } = self;
        let title = title.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        writeln!(svg, "<text x=\"{left:.1}\" y=\"{:.1}\" font-weight=\"bold\">{title}</text>", top - 8.0)?;
        let place = format!("x=\"{left:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\"");
        writeln!(svg, "<rect {place} fill=\"none\" stroke=\"#888\"/>")?;
        for (y, mark) in marks {
            writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{mark}</text>", left - 4.0, y + 3.0)?;
        }
        Ok(())
    }
}
