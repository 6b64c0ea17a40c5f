//! Design variables: `p` moves the nodes of the design surface, every node along its own unit direction.
//!
//! `Δx_b = D M W p`: `D` holds the directions (one for all, or the surface's normals, see `normal`), `W` the weights of the
//! variables at every node, and `M` the mitres, 1 but at nodes on sharp edges, which move further than the faces that meet
//! there. A variable is a node of the surface, a point of a control grid (`grid`), or a node seen through a smoothing filter
//! (`filter`); mirror images may be constrained to be equal (`symmetry`), and the free boundary edges held
//! (`boundary_edges`). In every case `W` is sparse, its weights are not negative, and a row sums to one, or to zero at a node
//! that stays. So the displacements of the surface's faces keep the bounds of the variables, and the transpose, which takes
//! derivatives at the nodes to those with respect to `p`, is exact. On a finer mesh of the same body the variables stay what
//! they are, and new nodes follow the ends of the edges that they halve (`refined`). What a grid describes between the nodes the
//! facets have only about (`facets`).

mod boundary_edges;
mod facets;
mod filter;
mod grid;
mod normal;
mod refined;
mod symmetry;
mod symmetry_planes;
mod transfer;

use std::collections::BTreeSet;

use fluxmorph_geometry::tet4::{Point, dot, norm};
use fluxmorph_geometry::{Mesh, NodeId, millimetres};

pub use filter::{cell_size, default_filter_radius};
pub use grid::{GridSide, dominant_axis};
pub(crate) use normal::faces_around;
pub use symmetry::edges_without_image;
pub use transfer::{SurfaceMismatch, Triangulation};

/// Weights of the variables at one node, ascending by variable.
type Row = Vec<(usize, f64)>;

/// How far the length of a unit vector may be from one.
const ROUNDING: f64 = 1e-9;

/// The way a positive variable moves the nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direction {
    /// All along one unit vector.
    Along(Point),
    /// Each along the surface's normal there, to the side that the triangles' orientation points to.
    Normal,
}

/// Where the variables sit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// On every node.
    Nodes,
    /// On a grid with these numbers of points, both at least 2, over the two coordinates across the direction; the first
    /// coordinate is slow in the order of the variables.
    Grid([usize; 2]),
    /// On every node, and a node's displacement is the mean of the variables within this radius [m].
    Filter(f64),
}

/// A plane normal to a coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Its place on that axis [m].
    pub at: f64,
}

impl Mirror {
    /// The mirror image of a point [m].
    pub fn image(&self, mut point: Point) -> Point {
        point[self.axis] = 2.0 * self.at - point[self.axis];
        point
    }

    /// The mirror image of a vector.
    pub fn reflect(&self, mut vector: Point) -> Point {
        vector[self.axis] = -vector[self.axis];
        vector
    }
}

/// What the nodes on the design surface's free boundary edges do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundaryMotion {
    /// They move like all others.
    Free,
    /// They stay.
    Fixed,
}

/// What a design surface is made from.
#[derive(Clone, Debug)]
pub struct DesignSetup {
    /// The surface, each triangle once; oriented where the direction is normal.
    pub triangles: Vec<[NodeId; 3]>,
    /// Which way the nodes move.
    pub direction: Direction,
    /// Where the variables sit.
    pub control: Control,
    /// Planes over which variables equal their mirror images, at most one an axis.
    pub mirrors: Vec<Mirror>,
    /// What the free boundary edges do.
    pub boundary: BoundaryMotion,
    /// Faces that a node on them must not leave when it moves along a normal.
    pub kept: Vec<[NodeId; 3]>,
    /// Faces where the model ends, though not the device: symmetry planes. A boundary edge on them is not free.
    pub cuts: Vec<[NodeId; 3]>,
}

impl DesignSetup {
    /// Variables on every node, no plane anywhere.
    pub fn new(triangles: &[[NodeId; 3]], direction: Direction) -> Self {
        Self {
            triangles: triangles.to_vec(),
            direction,
            control: Control::Nodes,
            mirrors: Vec::new(),
            boundary: BoundaryMotion::Free,
            kept: Vec::new(),
            cuts: Vec::new(),
        }
    }

    /// Refuses numbers out of range.
    ///
    /// # Errors
    /// [`DesignError::Parameter`].
    fn check(&self) -> Result<(), DesignError> {
        let refuse = |what, value, expected| Err(DesignError::Parameter { what, value, expected });
        if let Direction::Along(direction) = self.direction {
            let length = norm(direction);
            if length.is_nan() || (length - 1.0).abs() > ROUNDING {
                return refuse("the length of the direction", length, "a unit vector");
            }
        }
        if let Some(mirror) = self.mirrors.iter().find(|mirror| mirror.axis > 2 || !mirror.at.is_finite()) {
            return refuse("the place of a mirror", mirror.at, "a number on one of the axes 0, 1, 2");
        }
        match self.control {
            Control::Filter(radius) if !(radius > 0.0 && radius.is_finite()) => {
                refuse("the radius of the filter", radius, "a positive length")
            }
            Control::Grid([a, b]) if a.min(b) < 2 => {
                refuse("the number of points of the grid along one side", a.min(b) as f64, "at least 2")
            }
            _ => Ok(()),
        }
    }
}

/// Why a surface cannot carry the design variables asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum DesignError {
    /// No triangle.
    #[error("the design surface has no triangles")]
    Empty,
    /// A number out of range.
    #[error("{what} is {value}: expected {expected}")]
    Parameter { what: &'static str, value: f64, expected: &'static str },
    /// The grid's rectangle has no area.
    #[error("a control grid cannot be laid across the direction: the surface has no extent along {axis}")]
    NoExtent { axis: char },
    /// A surface that bends back cannot be seen as a height over the grid.
    #[error("a control grid cannot be laid over the surface: at {} it turns back towards {axis}", millimetres(*point))]
    Folded {
        /// The first such node [m].
        point: Point,
        axis: char,
    },
    /// A mirrored variable has no partner.
    #[error(
        "the {what} at {} has no partner in the mirror {axis} = {:.3} mm: the nearest lies {:.3e} mm from its mirror image",
        millimetres(*point), at * 1e3, distance * 1e3
    )]
    NoPartner {
        what: &'static str,
        /// Its place [m].
        point: Point,
        axis: char,
        /// Place of the mirror [m].
        at: f64,
        /// From the image to the nearest candidate [m].
        distance: f64,
    },
    /// One direction for all that the mirror turns.
    #[error(
        "the direction {direction:?} leaves the mirror {axis} = {at} m: mirrored nodes would not move alike"
    )]
    Oblique {
        direction: Point,
        axis: char,
        /// Place of the mirror [m].
        at: f64,
    },
    /// The filter couples too many nodes.
    #[error("the filter radius {radius} m couples more than {limit} pairs of nodes")]
    WideFilter {
        /// [m]
        radius: f64,
        limit: usize,
    },
}

/// The name of a coordinate.
fn axis_name(axis: usize) -> char {
    ['x', 'y', 'z'][axis]
}

/// The linear map from design variables to displacements of the design surface's nodes.
#[derive(Clone, Debug)]
pub struct DesignSurface {
    nodes: Vec<NodeId>,
    /// Unit vectors, or zero at a node that cannot move; shape `(n_nodes, 3)`.
    directions: Vec<Point>,
    /// Displacements of the nodes for a unit displacement of the faces around them.
    mitres: Vec<f64>,
    rows: Vec<Row>,
    /// Of the last nodes, which a finer mesh has in the middle of edges, the places of both ends in `nodes`, which come before.
    ends: Vec<[usize; 2]>,
    points: Vec<Point>,
    filter_radius: Option<f64>,
    grid: Option<grid::ControlGrid>,
}

impl DesignSurface {
    /// The design surface of a set-up, on the undeformed mesh.
    ///
    /// # Errors
    /// [`DesignError`] says which part of the set-up the surface does not fit.
    pub fn new(mesh: &Mesh, setup: &DesignSetup) -> Result<Self, DesignError> {
        let nodes: Vec<NodeId> =
            setup.triangles.iter().flatten().copied().collect::<BTreeSet<_>>().into_iter().collect();
        if nodes.is_empty() {
            return Err(DesignError::Empty);
        }
        setup.check()?;
        let places: Vec<Point> = nodes.iter().map(|&n| mesh.point(n)).collect();
        let (mut directions, mut mitres) = match setup.direction {
            Direction::Along(direction) => (vec![direction; nodes.len()], vec![1.0; nodes.len()]),
            Direction::Normal => normal::directions(mesh, &nodes, &setup.triangles, &setup.kept),
        };
        let on_nodes = !matches!(setup.control, Control::Grid(_));
        // Where neither normals nor variables sit on nodes, a mirror need not map nodes onto nodes.
        let mirrors_nodes = on_nodes || setup.direction == Direction::Normal;
        let pairs =
            if mirrors_nodes { symmetry::pairs("node", &places, &setup.mirrors)? } else { Vec::new() };
        match setup.direction {
            Direction::Along(direction) => symmetry::check_direction(direction, &setup.mirrors)?,
            Direction::Normal => {
                symmetry::mirror_directions(&mut directions, &setup.mirrors, &pairs);
                symmetry::mirror_numbers(&mut mitres, &pairs);
            }
        }
        let edges = boundary_edges::BoundaryEdges::new(&setup.triangles, &setup.cuts);

        let mut grid = None;
        let (mut rows, mut points, groups) = match setup.control {
            Control::Nodes => {
                let rows = (0..nodes.len()).map(|i| vec![(i, 1.0)]).collect();
                (rows, places, symmetry::groups(nodes.len(), &pairs))
            }
            Control::Filter(radius) => {
                let mut surface = filter::Surface::new(mesh, &nodes, &setup.triangles, &directions);
                surface.mirror_areas(&pairs);
                let rows = surface.rows(radius, &edges.symmetry_planes(mesh, &setup.cuts, &places))?;
                (rows, places, symmetry::groups(nodes.len(), &pairs))
            }
            Control::Grid(counts) => {
                let own = grid::Grid::new(&places, &directions, counts)?;
                let points = own.points(&places);
                let pairs = symmetry::pairs("control point", &own.flat(&points), &setup.mirrors)?;
                let groups = symmetry::groups(points.len(), &pairs);
                let rows = places.iter().map(|&x| own.row(x)).collect();
                grid = Some(grid::ControlGrid { grid: own, groups: groups.clone() });
                (rows, points, groups)
            }
        };
        groups.apply(&mut rows, &mut points);
        for (i, row) in rows.iter_mut().enumerate() {
            let held = setup.boundary == BoundaryMotion::Fixed && edges.is_on_free_edge(nodes[i]);
            if held || directions[i] == [0.0; 3] {
                row.clear();
            }
        }
        let filter_radius = match setup.control {
            Control::Filter(radius) => Some(radius),
            Control::Nodes | Control::Grid(_) => None,
        };
        let ends = Vec::new();
        let mut surface = Self { nodes, directions, mitres, rows, ends, points, filter_radius, grid };
        if on_nodes {
            surface.drop_idle();
        }
        Ok(surface)
    }

    /// Leaves out the variables that move nothing. Those of a grid stay: its order is the users'.
    fn drop_idle(&mut self) {
        let mut new_of: Vec<Option<usize>> = vec![None; self.points.len()];
        for &(k, _) in self.rows.iter().flatten() {
            new_of[k] = Some(0);
        }
        let mut points = Vec::new();
        for (new, point) in new_of.iter_mut().zip(&self.points).filter(|(new, _)| new.is_some()) {
            *new = Some(points.len());
            points.push(*point);
        }
        for (k, _) in self.rows.iter_mut().flatten() {
            *k = new_of[*k].expect("a variable in a row is kept");
        }
        self.points = points;
    }

    /// The same surface where the same nodes, in the same order, have other numbers.
    ///
    /// # Panics
    /// If there is not one number per node.
    pub fn renumbered(&self, nodes: Vec<NodeId>) -> Self {
        assert_eq!(nodes.len(), self.nodes.len(), "one number per node");
        Self { nodes, ..self.clone() }
    }

    /// Nodes of the surface, ascending.
    pub fn nodes(&self) -> &[NodeId] {
        &self.nodes
    }

    /// Unit direction in which a positive displacement moves each node, shape `(n_nodes, 3)`; zero where a node cannot move.
    pub fn directions(&self) -> &[Point] {
        &self.directions
    }

    /// Weights of the variables at every node: `(variable, weight)`, ascending by variable.
    pub fn rows(&self) -> &[Vec<(usize, f64)>] {
        &self.rows
    }

    /// Number of design variables.
    pub fn variable_count(&self) -> usize {
        self.points.len()
    }

    /// Radius of the filter [m], where there is one.
    pub fn filter_radius(&self) -> Option<f64> {
        self.filter_radius
    }

    /// The sides of the control grid, where there is one; the first is slow in the order of the variables.
    pub fn grid_sides(&self) -> Option<[GridSide; 2]> {
        Some(self.grid.as_ref()?.grid.sides())
    }

    /// Where the variables sit on the undeformed surface [m], shape `(n_variables, 3)`.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Whether all nodes of a triangle are of the surface.
    pub fn has_all(&self, triangle: &[NodeId; 3]) -> bool {
        triangle.iter().all(|node| self.nodes.binary_search(node).is_ok())
    }

    /// How far every node goes along its direction where its surface moves by one: more than one on a sharp edge, whose faces move.
    pub fn mitres(&self) -> &[f64] {
        &self.mitres
    }

    /// How far the surface moves at every node [m] for the variables `p` [m]: the node along its direction, or, on a sharp edge,
    /// the faces around it along their normals.
    pub fn normal_displacements(&self, p: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| row.iter().map(|&(k, weight)| weight * p[k]).sum()).collect()
    }

    /// The place of the first node in the middle of an edge, behind all that move by their own steps.
    fn first_middle(&self) -> usize {
        self.nodes.len() - self.ends.len()
    }

    /// `Δx_b = D M W p` [m], one displacement per node; of a node in the middle of an edge the mean of those of its ends.
    pub fn displacement(&self, p: &[f64]) -> Vec<Point> {
        let along = self.normal_displacements(p);
        let step = |i: usize| self.directions[i].map(|d| self.mitres[i] * along[i] * d);
        let mut displacement: Vec<Point> = (0..self.first_middle()).map(step).collect();
        for &[a, b] in &self.ends {
            let (a, b) = (displacement[a], displacement[b]);
            displacement.push(std::array::from_fn(|d| 0.5 * (a[d] + b[d])));
        }
        displacement
    }

    /// `Wᵀ M Dᵀ g`: from derivatives with respect to the nodes' positions to those with respect to the variables.
    pub fn gradient(&self, nodal: &[Point]) -> Vec<f64> {
        let mut nodal = nodal.to_vec();
        let middles = self.first_middle();
        for (new, ends) in (middles..self.nodes.len()).zip(&self.ends).rev() {
            let half = nodal[new].map(|g| 0.5 * g);
            ends.iter().for_each(|&end| (0..3).for_each(|d| nodal[end][d] += half[d]));
        }
        let mut gradient = vec![0.0; self.variable_count()];
        for (place, g) in nodal.into_iter().enumerate().take(middles) {
            self.slopes(place, g, &mut |k, slope| gradient[k] += slope);
        }
        gradient
    }

    /// Hands out the variables that move the node at a place of [`Self::nodes`], some of them repeatedly, each with its part of the
    /// derivative of what has the derivative `g` with respect to the position of that node.
    pub fn slopes(&self, place: usize, g: Point, add: &mut impl FnMut(usize, f64)) {
        if let Some(new) = place.checked_sub(self.first_middle()) {
            self.ends[new].iter().for_each(|&end| self.slopes(end, g.map(|g| 0.5 * g), add));
        } else {
            let along = self.mitres[place] * dot(self.directions[place], g);
            self.rows[place].iter().for_each(|&(k, weight)| add(k, weight * along));
        }
    }
}

#[cfg(test)]
mod refusals;
#[cfg(test)]
mod tests;
