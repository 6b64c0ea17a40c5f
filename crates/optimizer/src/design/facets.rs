//! How far the surface that a control grid describes is from the facets of a mesh: a grid bends within facets that are coarser than it
//! is, and on another mesh the same variables have another shape.
//!
//! Does not live here: how far facets are off a smooth surface through their nodes (`fluxmorph_geometry::curved`).

use fluxmorph_geometry::tet4::Point;

use super::{DesignSurface, Triangulation};

/// Parts of an edge of a facet from one place that is looked at to the next. Even, so that the middle is one; any kink is within a
/// twelfth of the edge of such a place.
const PARTS: usize = 6;

/// Distance of the sum of a node's weights from one up to which the node follows the grid alone: rounding.
const ROUNDING: f64 = 1e-9;

impl DesignSurface {
    /// The largest distance between the surface that a control grid describes with the variables `p` [m] and the `facets`, at 28 places
    /// of each facet, in the directions of the nodes [m]; `None` without a grid. Facets with a node that does not follow the grid alone
    /// are left out: beside a held rim, and of refined curved surfaces those between unlike normals.
    ///
    /// # Panics
    /// If `facets` has other nodes than the surface.
    pub fn distance_from_facets(&self, facets: &Triangulation, p: &[f64]) -> Option<f64> {
        let grid = self.grid.as_ref()?;
        let heights = self.normal_displacements(p);
        let distance = |triangle: &[usize; 3], weights: [f64; 3]| {
            let mean = |of: &dyn Fn(usize) -> f64| {
                triangle.iter().zip(weights).map(|(&i, weight)| weight * of(i)).sum::<f64>()
            };
            let place: Point = std::array::from_fn(|d| mean(&|i| facets.places[i][d]));
            (grid.height(place, p) - mean(&|i| heights[i])).abs()
        };
        let sum = |row: &[(usize, f64)]| row.iter().map(|(_, weight)| weight).sum::<f64>();
        let follows: Vec<bool> = self.rows.iter().map(|row| (sum(row) - 1.0).abs() < ROUNDING).collect();
        let following = facets.triangles.iter().filter(|triangle| triangle.iter().all(|&i| follows[i]));
        let all = following.flat_map(|triangle| places().map(move |weights| distance(triangle, weights)));
        Some(all.fold(0.0, f64::max))
    }
}

/// Barycentric coordinates of places of a triangle, evenly over it.
fn places() -> impl Iterator<Item = [f64; 3]> {
    let all = (0..=PARTS).flat_map(|i| (0..=PARTS - i).map(move |j| [i, j, PARTS - i - j]));
    all.map(|counts| counts.map(|count| count as f64 / PARTS as f64))
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::refine::{RefineLimits, uniform};

    use super::super::tests::{build, moved_block, outward};
    use super::super::{BoundaryMotion, Control, DesignSetup, Direction, Mirror};
    use super::*;

    /// Two triangles, whose common edge is a diagonal: a bilinear height is off them by a quarter of its twist in the middle, and a peak
    /// there by all of it.
    #[test]
    fn a_surface_is_as_far_from_its_facets_as_it_bends_within_them() {
        let mesh = moved_block(1, |x| x);
        let faces = outward(&mesh, "z_max");
        let facets = Triangulation::new(&mesh, &faces);
        let off = |control: Control, mirrors: Vec<Mirror>, of: &dyn Fn(Point) -> f64| {
            let base = DesignSetup::new(&faces, Direction::Along([0.0, 0.0, 1.0]));
            let surface = build(&mesh, &DesignSetup { control, mirrors, ..base });
            let p: Vec<f64> = surface.points().iter().map(|&x| of(x)).collect();
            surface.distance_from_facets(&facets, &p)
        };
        let peak = |x: Point| if (x[0], x[1]) == (0.5, 0.5) { 2.0 } else { 0.0 };
        let (square, nine) = (Control::Grid([2, 2]), Control::Grid([3, 3]));
        let found = |distance: Option<f64>| distance.expect("a grid");
        // Numbers of order one, rounded a few times.
        assert!(found(off(square, Vec::new(), &|x| 3.0 * x[0] - x[1])) < 1e-15);
        assert!((found(off(square, Vec::new(), &|x| x[0] * x[1])) - 0.25).abs() < 1e-15);
        for mirrors in [Vec::new(), vec![Mirror { axis: 0, at: 0.5 }]] {
            assert!((found(off(nine, mirrors, &peak)) - 2.0).abs() < 1e-15);
        }
        assert_eq!(off(Control::Nodes, Vec::new(), &peak), None);
    }

    /// On a held rim the grid is not followed, nor between that and the next nodes, however fine the mesh is: nobody means that.
    #[test]
    fn facets_beside_a_held_rim_are_left_out_on_refined_meshes_too() {
        let coarse = moved_block(4, |x| x);
        let base = DesignSetup::new(&outward(&coarse, "z_max"), Direction::Along([0.0, 0.0, 1.0]));
        let control = Control::Grid([5, 5]);
        let held = DesignSetup { control, boundary: BoundaryMotion::Fixed, ..base };
        let surface = build(&coarse, &held);
        let refinement = uniform(&coarse, RefineLimits::default()).expect("it fits");
        let fine = refinement.mesh();
        let refined = surface.refined(&outward(fine, "z_max"), coarse.points().len(), refinement.parents());
        for (mesh, own) in [(&coarse, &surface), (fine, &refined)] {
            let facets = Triangulation::new(mesh, &outward(mesh, "z_max"));
            let p = vec![1.0; own.variable_count()];
            assert!(own.distance_from_facets(&facets, &p).expect("a grid") < 1e-15);
        }
    }
}
