//! `[[multipoles]]`: circles and balls in which the field is expanded.

use super::axis::{Axis, check_axis};
use crate::config::section::Section;
use crate::config::table::table;
use crate::config::value::choice::choice;

/// Terms of a higher order are below what a mesh resolves.
const MOST: usize = 20;

table! {
    /// A circle or ball in air in which the flux density is expanded; it stays where it is (`follow` of what is made of it says what
    /// holds where the mesh moves). The result has all terms, objective and
    /// constraints of the kinds `multipole` and `multipole_content` name it as their `region`.
    ///
    /// Points beyond a symmetry plane through the centre, one of `[boundaries]` at right angles to a coordinate axis, have the field
    /// of their image. A ball that holds a winding with a current, iron, a magnet, eddy currents or a hole of the mesh is refused, and
    /// a circle that goes through them: a circle around them has the terms of the field on it.
    ///
    /// ```toml
    /// [[multipoles]]
    /// name = "aperture"
    /// shape = "circle"
    /// center = ["0 mm", "0 mm", "0 mm"]
    /// axis = "y"
    /// radius = "20 mm"
    /// order = 10
    /// ```
    pub struct MultipoleSet {
        /// What it is called in results; each name once.
        name: String = TEXT, need "\"aperture\"";
        /// Where the field is expanded.
        shape: ExpansionShape = WORD => ExpansionShape::Circle;
        /// The centre [m].
        center: [f64; 3] = length(FINITE) => [0.0; 3];
        /// Axis of the circle: that of the beam; of a ball the polar axis, along which is the component that is expanded. The length of
        /// a vector does not matter.
        axis: Axis = ONE_OF => Axis::default();
        /// Direction from which angles around the axis are counted, of which the part across the axis counts. Default: the coordinate
        /// that follows the axis cyclically (x for z), or its part across a slanted axis.
        #[also(not_all_zero)]
        direction: Option<[f64; 3]> = number(FINITE);
        /// Reference radius [m].
        radius: f64 = length(POSITIVE), need "\"20 mm\"";
        /// The highest order of its terms.
        order: usize = integer(1, MOST) => 6;
        /// The order of the main field, with which the others are compared. Default: 1, the dipole, of a circle; 0, the uniform field, of
        /// a ball.
        main: Option<usize> = integer(0, MOST);
    }
    check = MultipoleSet::check;
}

choice! {
    /// Where a field is expanded.
    pub enum ExpansionShape {
        /// On a circle: normal and skew harmonics b_n and a_n of the field across its axis,
        /// B_y + i B_x = Σ (b_n + i a_n) ((x + i y)/`radius`)^(n−1), from the radial component on the circle. Where the field changes
        /// along the axis, as at the end of a magnet, other components have other terms.
        Circle = "circle",
        /// In a ball: spherical harmonics of the component along its axis,
        /// Σ (r/`radius`)^n P_nm(cos θ) (c_nm cos mφ + s_nm sin mφ), P_nm without normalisation or phase.
        Ball = "ball",
    }
}

impl MultipoleSet {
    fn check(&mut self, section: &Section<'_>) {
        check_axis(self.axis, section);
        let least = if self.shape == ExpansionShape::Circle { 1 } else { 0 };
        let main = self.main.unwrap_or(least);
        if main < least || main > self.order {
            let message = format!("`{}.main` is {main}, which is no order of its terms", section.path());
            section.wrong("main", message, format!("{least} to {}", self.order));
        }
        self.main = Some(main);
    }
}
