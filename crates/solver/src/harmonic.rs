//! Curl-free fields on the edges of a mesh that are no gradients.
//!
//! Where the mesh has a tunnel whose walls leave the tangential `A` free, a field can turn round it without a curl: the
//! tree of `gauge` does not reach it, and the matrix has a null vector for each. One edge more is left out for each of them.
//! Found in whole numbers: with the values on the tree zero, every triangle with one open edge gives that edge its
//! value; where none is left, an open edge becomes a generator, and triangles that close are relations among
//! generators (Dłotko and Specogna, Comput. Phys. Commun. 184 (2013) 2257). What remains free is one field a tunnel:
//! a basis of the first cohomology of the mesh relative to what is fixed. Coefficients are kept modulo a prime.

use std::collections::{BTreeMap, VecDeque};

use fluxmorph_geometry::CarrierId;
use fluxmorph_geometry::incidence::Incidence;

/// `2³¹ − 1`: coefficients are small, and products fit in 64 bits.
const PRIME: u64 = (1 << 31) - 1;

/// A curl-free field that is no gradient.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HarmonicField {
    /// An edge on which it is one and all others are zero.
    pub(crate) edge: usize,
    /// Its circulations along all edges on which they are not zero, ascending.
    pub(crate) circulations: Vec<(usize, f64)>,
}

/// A sum of generators: number and coefficient modulo [`PRIME`], ascending, without zeros.
type Sum = Vec<(usize, u64)>;

/// The fields that vanish where `is_zero` holds.
///
/// `triangles` by their edges `(i, j)`, `(i, k)`, `(j, k)` with `i < j < k`; one may be listed more than once.
pub(crate) fn fields(
    edge_count: usize,
    triangles: &[[usize; 3]],
    is_zero: impl Fn(usize) -> bool,
) -> Vec<HarmonicField> {
    let edges: Vec<_> = triangles.iter().map(|edges| edges.map(CarrierId::new)).collect();
    let around = Incidence::new(edge_count, &edges);
    let mut search = Search::new(edge_count, triangles, &around);
    (0..edge_count).filter(|&e| is_zero(e)).for_each(|e| search.determine(e, Sum::new()));
    search.propagate();
    let mut generators = Vec::new();
    while let Some(edge) = search.next_open() {
        search.determine(edge, vec![(generators.len(), 1)]);
        generators.push(edge);
        search.propagate();
    }
    let mut found: BTreeMap<usize, HarmonicField> = (0..generators.len())
        .filter(|g| !search.relations.contains_key(g))
        .map(|g| (g, HarmonicField { edge: generators[g], circulations: Vec::new() }))
        .collect();
    for (edge, value) in std::mem::take(&mut search.values).into_iter().enumerate() {
        for (g, coefficient) in search.reduced(value.unwrap_or_default()) {
            let field = found.get_mut(&g).expect("a reduced sum has free generators only");
            field.circulations.push((edge, signed(coefficient)));
        }
    }
    found.into_values().collect()
}

struct Search<'a> {
    triangles: &'a [[usize; 3]],
    /// Triangles around every edge.
    around: &'a Incidence,
    values: Vec<Option<Sum>>,
    /// Open edges of every triangle.
    open: Vec<u8>,
    /// Triangles that had one open edge, and those that had two, when they were noted.
    ready: Vec<usize>,
    half: VecDeque<usize>,
    cursor: usize,
    /// Generators that are sums of earlier ones.
    relations: BTreeMap<usize, Sum>,
}

impl<'a> Search<'a> {
    fn new(edge_count: usize, triangles: &'a [[usize; 3]], around: &'a Incidence) -> Self {
        Self {
            triangles,
            around,
            values: vec![None; edge_count],
            open: vec![3; triangles.len()],
            ready: Vec::new(),
            half: VecDeque::new(),
            cursor: 0,
            relations: BTreeMap::new(),
        }
    }

    /// Gives an edge its value, and takes the relations of the triangles that this closes.
    fn determine(&mut self, edge: usize, value: Sum) {
        self.values[edge] = Some(value);
        for t in self.around.around(CarrierId::new(edge)).iter().map(|t| t.index()) {
            self.open[t] -= 1;
            match self.open[t] {
                2 => self.half.push_back(t),
                1 => self.ready.push(t),
                _ => {
                    let sum = self.circulation(t);
                    self.relate(sum);
                }
            }
        }
    }

    /// Follows all triangles with one open edge.
    fn propagate(&mut self) {
        while let Some(t) = self.ready.pop() {
            let edges = self.triangles[t];
            let Some(k) = (0..3).find(|&k| self.values[edges[k]].is_none()) else { continue };
            let sum = self.circulation(t);
            // Its own circulation makes the sum zero.
            let value = if k == 1 { sum } else { scaled(&sum, PRIME - 1) };
            self.determine(edges[k], value);
        }
    }

    /// An open edge beside what is known, or any.
    fn next_open(&mut self) -> Option<usize> {
        let is_open = |e: &usize| self.values[*e].is_none();
        while let Some(t) = self.half.pop_front() {
            if let Some(edge) = self.triangles[t].into_iter().find(is_open) {
                return Some(edge);
            }
        }
        self.cursor += self.values[self.cursor..].iter().take_while(|value| value.is_some()).count();
        (self.cursor < self.values.len()).then_some(self.cursor)
    }

    /// The sum `a_ij + a_jk − a_ik` of what is known on a triangle.
    fn circulation(&self, t: usize) -> Sum {
        let mut sum = Sum::new();
        for (k, &e) in self.triangles[t].iter().enumerate() {
            let factor = if k == 1 { PRIME - 1 } else { 1 };
            if let Some(value) = self.values[e].as_ref().filter(|value| !value.is_empty()) {
                sum = added(&sum, factor, value);
            }
        }
        self.reduced(sum)
    }

    /// Takes a sum as zero: its last generator becomes a sum of the others.
    fn relate(&mut self, mut sum: Sum) {
        if let Some((last, coefficient)) = sum.pop() {
            self.relations.insert(last, scaled(&sum, PRIME - inverse(coefficient)));
        }
    }

    /// The same sum without generators that are sums of others.
    fn reduced(&self, mut sum: Sum) -> Sum {
        while let Some(&(g, coefficient)) = sum.iter().rev().find(|(g, _)| self.relations.contains_key(g)) {
            sum.retain(|(other, _)| *other != g);
            sum = added(&sum, coefficient, &self.relations[&g]);
        }
        sum
    }
}

/// `a + factor b`.
fn added(a: &Sum, factor: u64, b: &Sum) -> Sum {
    let mut sum: BTreeMap<usize, u64> = a.iter().copied().collect();
    for &(g, coefficient) in b {
        let entry = sum.entry(g).or_insert(0);
        *entry = (*entry + factor * coefficient) % PRIME;
    }
    sum.into_iter().filter(|(_, coefficient)| *coefficient != 0).collect()
}

fn scaled(sum: &Sum, factor: u64) -> Sum {
    sum.iter().map(|&(g, coefficient)| (g, factor * coefficient % PRIME)).collect()
}

/// `x⁻¹ = x^(p − 2)`.
fn inverse(x: u64) -> u64 {
    let (mut base, mut exponent, mut power) = (x, PRIME - 2, 1);
    while exponent > 0 {
        if exponent & 1 == 1 {
            power = power * base % PRIME;
        }
        base = base * base % PRIME;
        exponent >>= 1;
    }
    power
}

/// The number of least size that a coefficient stands for.
fn signed(coefficient: u64) -> f64 {
    if coefficient > PRIME / 2 { -((PRIME - coefficient) as f64) } else { coefficient as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::{ElementFamily, Order};
    use crate::gauge;
    use crate::space::Space;
    use fluxmorph_geometry::generate::Grid;
    use fluxmorph_geometry::topology::face_key;
    use fluxmorph_geometry::{Mesh, RegionId};
    use std::collections::HashSet;

    /// A cube of `n³` cells without those that `is_hole` names by their numbers along the axes.
    fn cube(n: usize, is_hole: impl Fn([usize; 3]) -> bool) -> Mesh {
        let line = || (0..=n).map(|i| i as f64).collect::<Vec<_>>();
        let grid = Grid::new("grid", [line(), line(), line()]).expect("a grid");
        let hole = |x: [f64; 3]| is_hole(x.map(|c| c as usize));
        let mesh = grid.mesh(&["air", "hole"], |x| RegionId(u32::from(hole(x)))).expect("two regions");
        mesh.without_region(RegionId(1)).expect("what is left").0
    }

    /// The fields of a cube, with the edges of its outer sides fixed or not.
    fn fields_of(mesh: &Mesh, n: usize, outside_is_fixed: bool) -> (Space, Vec<HarmonicField>) {
        let space = Space::new(mesh.topology(), ElementFamily::Edge, Order::Linear);
        let mut fixed = HashSet::new();
        for facet in mesh.topology().outer_facets() {
            let points = facet.nodes.map(|v| mesh.point(v));
            let on_side = |d: usize| [0.0, n as f64].iter().any(|c| points.iter().all(|x| x[d] == *c));
            if outside_is_fixed && (0..3).any(on_side) {
                fixed.extend(space.triangle(face_key(facet.nodes)).into_iter().map(|c| c.index()));
            }
        }
        let is_fixed = |e: usize| fixed.contains(&e);
        let branches = gauge::tree(mesh.topology().node_count(), space.edges(), is_fixed);
        let triangles = space.edge_triangles();
        let found = fields(space.edges().len(), &triangles, |e| is_fixed(e) || branches[e]);
        for field in &found {
            let value: BTreeMap<usize, f64> = field.circulations.iter().copied().collect();
            let at = |e: usize| value.get(&e).copied().unwrap_or(0.0);
            assert_eq!(at(field.edge), 1.0);
            assert!(triangles.iter().all(|t| at(t[0]) + at(t[2]) == at(t[1])), "it has no curl");
        }
        (space, found)
    }

    /// Betti numbers of bodies everybody can count, and by Lefschetz duality those relative to the outer side.
    #[test]
    fn there_is_one_field_for_every_tunnel_with_free_walls() {
        let bar = |[i, j, _]: [usize; 3]| (i, j) == (1, 1);
        let two_bars = |[i, j, _]: [usize; 3]| (i == 1 || i == 3) && j == 1;
        let ball = |cell: [usize; 3]| cell == [2, 2, 2];
        let ring = |[i, j, k]: [usize; 3]| k == 2 && i.max(j) <= 3 && i.min(j) >= 1 && (i, j) != (2, 2);
        for (n, hole, free, fixed) in [
            (5, &(|_| false) as &dyn Fn([usize; 3]) -> bool, 0, 0),
            (5, &bar, 1, 0),
            (5, &two_bars, 2, 0),
            (5, &ball, 0, 0),
            // A field turns round the ring's tube, whatever holds outside.
            (5, &ring, 1, 1),
        ] {
            let mesh = cube(n, hole);
            assert_eq!(fields_of(&mesh, n, false).1.len(), free);
            assert_eq!(fields_of(&mesh, n, true).1.len(), fixed);
        }
    }

    #[test]
    fn the_field_round_a_bar_has_the_same_circulation_on_every_way_round() {
        let mesh = cube(3, |[i, j, _]| (i, j) == (1, 1));
        let (space, found) = fields_of(&mesh, 3, false);
        let value: BTreeMap<usize, f64> = found[0].circulations.iter().copied().collect();
        let node_at = |x: [f64; 3]| mesh.topology().nodes().find(|&n| mesh.point(n) == x).expect("a node");
        let turn = |low: f64, high: f64, z: f64| {
            let corners = [[low, low], [high, low], [high, high], [low, high], [low, low]];
            let mut sum = 0.0;
            for pair in corners.windows(2) {
                let steps = (high - low) as usize;
                let along = |i: usize| {
                    let t = i as f64 / steps as f64;
                    node_at(
                        [0, 1, 2]
                            .map(|d| if d == 2 { z } else { pair[0][d] + t * (pair[1][d] - pair[0][d]) }),
                    )
                };
                for i in 0..steps {
                    let (a, b) = (along(i), along(i + 1));
                    let edge = space.carrier_of_edge([a.min(b), a.max(b)]).index();
                    sum += value.get(&edge).copied().unwrap_or(0.0) * if a < b { 1.0 } else { -1.0 };
                }
            }
            sum
        };
        let first = turn(1.0, 2.0, 0.0);
        assert_eq!(first.abs(), 1.0);
        assert!([turn(0.0, 3.0, 0.0), turn(1.0, 2.0, 3.0), turn(0.0, 3.0, 2.0)].iter().all(|t| *t == first));
    }
}
