//! Images of fields: triangles with values at their corners, drawn into pixels.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::colour::ColourMap;
use super::plane::extremes;
use super::png::png;

/// A pixel whose centre lies this far outside of a triangle, in barycentric coordinates, still belongs to it: neighbours
/// leave no gap.
const TOLERANCE: f64 = 1e-9;

/// An image of palette indices; 0 is nothing.
#[derive(Clone, Debug)]
pub(super) struct Raster {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Raster {
    /// An empty image.
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![0; width * height] }
    }

    /// Draws a triangle with corners in pixels from the upper left corner and shares of the colour map at them, linear in
    /// between.
    pub(super) fn triangle(&mut self, corners: [[f64; 2]; 3], shares: [f64; 3]) {
        let [a, b, c] = corners;
        let area = cross(a, b, c);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let range = |axis: usize, size: usize| {
            let [low, high] = extremes(corners.map(|corner| corner[axis]));
            let first = (low - 0.5).ceil().clamp(0.0, size as f64) as usize;
            let end = (high - 0.5).floor().clamp(-1.0, size as f64 - 1.0) + 1.0;
            first..end as usize
        };
        for row in range(1, self.height) {
            for column in range(0, self.width) {
                let centre = [column as f64 + 0.5, row as f64 + 0.5];
                let weights =
                    [cross(centre, b, c) / area, cross(a, centre, c) / area, cross(a, b, centre) / area];
                if weights.iter().all(|w| *w >= -TOLERANCE) {
                    let share = (0..3).map(|k| weights[k] * shares[k]).sum();
                    self.pixels[row * self.width + column] = ColourMap::index(share);
                }
            }
        }
    }

    /// The image as an address that holds its data.
    pub(super) fn data_url(&self, map: ColourMap) -> String {
        let file = png(self.width, self.height, &self.pixels, &map.palette());
        format!("data:image/png;base64,{}", STANDARD.encode(file))
    }

    /// One pixel, for tests.
    #[cfg(test)]
    pub(super) fn pixel(&self, column: usize, row: usize) -> u8 {
        self.pixels[row * self.width + column]
    }
}

/// Twice the signed area of a triangle.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_make_a_whole_square_with_a_linear_field() {
        let mut image = Raster::new(8, 4);
        let share = |p: [f64; 2]| p[0] / 8.0;
        for corners in [[[0.0, 0.0], [8.0, 0.0], [8.0, 4.0]], [[0.0, 0.0], [8.0, 4.0], [0.0, 4.0]]] {
            image.triangle(corners, corners.map(share));
        }
        for (column, row) in (0..8).flat_map(|c| (0..4).map(move |r| (c, r))) {
            let expected = ColourMap::index((column as f64 + 0.5) / 8.0);
            assert_eq!(image.pixel(column, row), expected, "{column} {row}");
        }
        // Outside, flat and not finite: nothing happens.
        image.triangle([[-9.0, -9.0], [-1.0, -9.0], [-1.0, -1.0]], [0.0; 3]);
        image.triangle([[0.0, 0.0], [8.0, 0.0], [4.0, 0.0]], [0.0; 3]);
        image.triangle([[0.0, 0.0], [f64::NAN, 0.0], [4.0, 4.0]], [0.0; 3]);
        assert_eq!(image.pixel(0, 0), ColourMap::index(0.5 / 8.0));
    }
}
