//! The smoothing filter: the height of a node is the weighted mean of the variables within a radius `r`,
//!
//! `h_i = Σ_j w_ij a_j p_j / Σ_j w_ij a_j`, `w_ij = max(0, 1 − |x_i − x_j| / r)`,
//!
//! with the surface area `a_j` that belongs to node `j` (a third of the triangles around it). This is the vertex filter of
//! free-form shape optimisation (M. Hojjat, E. Stavropoulou, K.-U. Bletzinger, Comput. Methods Appl. Mech. Engrg. 268
//! (2014) 494–510) with the cone of B. Bourdin, Int. J. Numer. Methods Engrg. 50 (2001) 2143–2158.
//!
//! Chosen before the Helmholtz filter `(M + r²/12 K) h = M p` (B. S. Lazarov, O. Sigmund, Int. J. Numer. Methods Engrg. 86
//! (2011) 765–781), because
//! * rows sum to one and no weight is negative on every triangulation: the normal_displacements keep the bounds of the variables. The
//!   Helmholtz filter has this only with a lumped mass and without obtuse triangles;
//! * the areas make it a quadrature of a convolution: another mesh changes the surface by its error of interpolation only;
//! * nodes that are mirror images get mirrored rows, and the transpose is that of a sparse matrix.
//!
//! Its price is memory, `π (r / h)²` entries a node, which is why there is a limit. Distances are straight, so a node only
//! sees nodes of the same connected piece whose directions are less than 87° from its own: the two faces of a thin plate do not mix,
//! nor do faces at right angles. Where a
//! symmetry plane cuts the surface, the mirror images of the nodes count too: half a model gives the surface of the whole.

use std::collections::BTreeMap;

use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{Point, area_vector, dot, norm, sub};
use fluxmorph_geometry::{Mesh, NodeId};

use super::symmetry_planes::{Seen, SymmetryPlanes};
use super::{DesignError, Row};

/// Most entries of the filter matrix: 0.8 GB.
const LARGEST: usize = 50_000_000;

/// Radius of the filter over the size of a cell where none is asked for: what is rough from node to node is smooth then, and
/// designs of two cells are still seen. With it rails carry 20 of 20 random designs (docs/torture.md).
const CELLS: f64 = 1.5;

/// Cosine of the angle up to which directions are of one side, 87 degrees: the margin keeps faces at right angles apart, whatever the
/// rounding of a file or of a turned device.
const ONE_SIDE: f64 = 0.05;

/// Size of a cell of a surface [m]: the mean over its area of the side of a square that two triangles would fill.
///
/// Fine strips beside edges have little area, and hardly count.
pub fn cell_size(mesh: &Mesh, triangles: &[[NodeId; 3]]) -> f64 {
    let areas: Vec<f64> = triangles.iter().map(|t| norm(area_vector(t.map(|n| mesh.point(n))))).collect();
    let sum = ordered_sum(areas.len(), |i| areas[i]);
    ordered_sum(areas.len(), |i| areas[i] * (2.0 * areas[i]).sqrt()) / sum.max(f64::MIN_POSITIVE)
}

/// The radius of the filter on a surface where none is asked for [m]: 1.5 cells.
pub fn default_filter_radius(mesh: &Mesh, triangles: &[[NodeId; 3]]) -> f64 {
    CELLS * cell_size(mesh, triangles)
}

/// What the filter needs of the design surface, by its nodes.
pub(super) struct Surface<'a> {
    places: Vec<Point>,
    directions: &'a [Point],
    /// [m²]
    areas: Vec<f64>,
    /// The least node of the connected piece.
    piece: Vec<usize>,
}

impl<'a> Surface<'a> {
    /// The surface of `triangles` with their nodes, ascending, and the nodes' directions.
    pub(super) fn new(
        mesh: &Mesh,
        nodes: &[NodeId],
        triangles: &[[NodeId; 3]],
        directions: &'a [Point],
    ) -> Self {
        let mut areas = vec![0.0; nodes.len()];
        let mut pieces = DisjointSets::new(nodes.len());
        for triangle in triangles {
            let third = norm(area_vector(triangle.map(|n| mesh.point(n)))) / 3.0;
            let rows: Vec<usize> = triangle.iter().filter_map(|n| nodes.binary_search(n).ok()).collect();
            rows.iter().for_each(|&i| areas[i] += third);
            pieces.join(rows);
        }
        let piece = (0..nodes.len()).map(|i| pieces.root(i)).collect();
        let places = nodes.iter().map(|&n| mesh.point(n)).collect();
        Self { places, directions, areas, piece }
    }

    /// Gives mirrored nodes the same area.
    pub(super) fn mirror_areas(&mut self, pairs: &[Vec<usize>]) {
        super::symmetry::mirror_numbers(&mut self.areas, pairs);
    }

    /// The rows of the filter of this radius [m]; `planes` cut the surface.
    ///
    /// # Errors
    /// [`DesignError::WideFilter`].
    pub(super) fn rows(&self, radius: f64, planes: &SymmetryPlanes) -> Result<Vec<Row>, DesignError> {
        let cell = |x: Point| x.map(|c| (c / radius).floor() as i64);
        let mut cells: BTreeMap<[i64; 3], Vec<Seen>> = BTreeMap::new();
        for seen in planes.with_images(&self.places, self.directions, radius) {
            cells.entry(cell(seen.place)).or_default().push(seen);
        }
        let mut entries = 0;
        let mut rows = Vec::with_capacity(self.places.len());
        for (i, &place) in self.places.iter().enumerate() {
            let row = self.row(i, radius, neighbours(cell(place)).filter_map(|c| cells.get(&c)).flatten());
            entries += row.len();
            if entries > LARGEST {
                return Err(DesignError::WideFilter { radius, limit: LARGEST });
            }
            rows.push(row);
        }
        Ok(rows)
    }

    fn row<'s>(&self, i: usize, radius: f64, near: impl Iterator<Item = &'s Seen>) -> Row {
        let mut weights: BTreeMap<usize, f64> = BTreeMap::new();
        for seen in near.filter(|seen| self.piece[seen.node] == self.piece[i]) {
            let weight = 1.0 - norm(sub(seen.place, self.places[i])) / radius;
            let itself = seen.node == i && seen.place == self.places[i];
            if weight > 0.0 && (itself || is_one_side(seen.direction, self.directions[i])) {
                *weights.entry(seen.node).or_default() += weight * self.areas[seen.node];
            }
        }
        let sum: f64 = weights.values().sum();
        // Only triangles without area give none: the node then follows its own variable.
        if sum > 0.0 { weights.into_iter().map(|(j, w)| (j, w / sum)).collect() } else { vec![(i, 1.0)] }
    }
}

/// Whether nodes with these directions move to one side.
fn is_one_side(a: Point, b: Point) -> bool {
    dot(a, b) > ONE_SIDE * norm(a) * norm(b)
}

/// A cell and those around it, in order.
fn neighbours([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    let around = |c: i64| [c.saturating_sub(1), c, c.saturating_add(1)];
    around(x)
        .into_iter()
        .flat_map(move |x| around(y).into_iter().flat_map(move |y| around(z).map(move |z| [x, y, z])))
}
