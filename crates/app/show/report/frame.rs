//! A picture to scale on the page: axes in millimetres around an image of coloured triangles.

use maud::{Markup, html};

use super::colour::ColourMap;
use super::plot::{BAR, BOTTOM, LEFT, RIGHT, Scale, TOP, WIDTH, px};
use super::raster::Raster;
use super::ticks::Count;

/// Pixels of the image for each of the drawing.
const SHARPNESS: f64 = 2.0;

/// Where lengths are on the page, equal along both axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// To the right [mm].
    pub(super) x: Scale,
    /// Upwards [mm].
    pub(super) y: Scale,
}

impl Frame {
    /// In the middle of the page, for lengths from `low` to `high` along both axes [mm]: as large as the page's width and
    /// the height `tallest` allow.
    pub(super) fn new(low: [f64; 2], high: [f64; 2], tallest: f64) -> Self {
        let extent = [0, 1].map(|d| (high[d] - low[d]).max(1e-9));
        let room = WIDTH - LEFT - RIGHT;
        let per_mm = (room / extent[0]).min(tallest / extent[1]);
        let [width, height] = extent.map(|e| e * per_mm);
        let left = LEFT + 0.5 * (room - width);
        let axis = |d: usize, pixels| Scale { low: low[d], high: high[d], count: Count::Linear, pixels };
        Self { x: axis(0, [left, left + width]), y: axis(1, [TOP + height, TOP]) }
    }

    /// Left and top, width and height on the page.
    fn place(&self) -> [f64; 4] {
        let ([left, right], [bottom, top]) = (self.x.pixels, self.y.pixels);
        [left, top, right - left, bottom - top]
    }

    /// Below it comes the explanation of colours.
    pub(super) fn bar_top(&self) -> f64 {
        self.y.pixels[0] + BOTTOM + 4.0
    }

    /// Height of the whole drawing.
    pub(super) fn height(&self) -> f64 {
        self.y.pixels[0] + BOTTOM + BAR
    }

    /// A place [mm] on the page.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [self.x.at(u), self.y.at(v)]
    }

    /// The image of triangles with corners [mm], and shares of the colour map at them.
    pub(super) fn image(
        &self,
        map: ColourMap,
        triangles: impl Iterator<Item = ([[f64; 2]; 3], [f64; 3])>,
    ) -> Markup {
        let [left, top, width, height] = self.place();
        let pixels = [width, height].map(|side| (side * SHARPNESS).ceil().max(1.0));
        let mut image = Raster::new(pixels[0] as usize, pixels[1] as usize);
        let pixel = |[u, v]: [f64; 2]| [self.x.share(u) * pixels[0], (1.0 - self.y.share(v)) * pixels[1]];
        triangles.for_each(|(corners, shares)| image.triangle(corners.map(pixel), shares));
        html! {
            image href=(image.data_url(map)) x=(px(left)) y=(px(top)) width=(px(width)) height=(px(height))
                preserveAspectRatio="none" {}
        }
    }

    /// What is drawn inside of the frame and cut off at its edge; `id` is that of the edge.
    pub(super) fn clip(&self, id: &str, content: &Markup) -> Markup {
        let [left, top, width, height] = self.place().map(px);
        html! {
            clipPath id=(id) { rect x=(left) y=(top) width=(width) height=(height) {} }
            g clip-path={ "url(#" (id) ")" } { (content) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_equal_along_both_axes_and_fit_on_the_page() {
        for high in [[100.0, 10.0], [10.0, 100.0], [0.0, 0.0]] {
            let frame = Frame::new([0.0; 2], high, 300.0);
            let [left, top, width, height] = frame.place();
            assert!(
                left >= LEFT && left + width <= WIDTH - RIGHT + 1e-9 && top == TOP && height <= 300.0 + 1e-9
            );
            assert!((width * high[1] - height * high[0]).abs() < 1e-6, "{high:?}");
        }
    }
}
