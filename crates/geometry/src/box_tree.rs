//! A tree of boxes with sides along the axes: finds those at a place, on a ray or nearest to a point without looking at
//! all of them.
//!
//! Every branch halves its boxes at the median of their centres along the axis on which the centres lie widest apart. So
//! the tree takes `n log n` steps to make, whatever the places, and a look-up about `log n` where boxes do not overlap
//! much. Equal centres are ordered by index: the tree, and every answer, is the same for equal boxes. Does not live here:
//! what the boxes hold (see [`crate::locate`] for elements).

use std::borrow::Borrow;

use crate::tet4::Point;

/// Boxes in a leaf: about as long to look through as one more branch.
const LEAF: usize = 8;

/// A box with sides along the axes; a point is one, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisBox {
    /// Least coordinates [m].
    pub lower: Point,
    /// Greatest coordinates [m].
    pub upper: Point,
}

impl AxisBox {
    /// The smallest box around points; of no point, one that contains nothing.
    pub fn around(points: impl IntoIterator<Item: Borrow<Point>>) -> Self {
        let none = Self { lower: [f64::INFINITY; 3], upper: [f64::NEG_INFINITY; 3] };
        points
            .into_iter()
            .fold(none, |all, point| all.with(&Self { lower: *point.borrow(), upper: *point.borrow() }))
    }

    /// The box with each face moved outwards [m].
    pub fn grown(self, margin: f64) -> Self {
        Self { lower: self.lower.map(|c| c - margin), upper: self.upper.map(|c| c + margin) }
    }

    /// Length of the longest side [m].
    pub fn extent(&self) -> f64 {
        (0..3).map(|d| self.upper[d] - self.lower[d]).fold(0.0, f64::max)
    }

    /// Whether a point lies inside or on a face.
    #[inline]
    pub fn contains(&self, point: Point) -> bool {
        (0..3).all(|d| self.lower[d] <= point[d] && point[d] <= self.upper[d])
    }

    /// Whether two boxes have a point in common.
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|d| self.lower[d] <= other.upper[d] && other.lower[d] <= self.upper[d])
    }

    /// Whether a ray from `origin` [m] along `direction` (of any length) has a point in the box.
    pub fn meets_ray(&self, origin: Point, direction: Point) -> bool {
        let (mut first, mut last) = (0.0f64, f64::INFINITY);
        for d in 0..3 {
            let (low, high) = (self.lower[d] - origin[d], self.upper[d] - origin[d]);
            if direction[d] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (low / direction[d], high / direction[d]);
            (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
        }
        first <= last
    }

    /// Square of the distance from a point [m²]; zero inside.
    #[inline]
    pub fn square_distance(&self, point: Point) -> f64 {
        let beside = |d: usize| (self.lower[d] - point[d]).max(point[d] - self.upper[d]).max(0.0);
        let [x, y, z] = [beside(0), beside(1), beside(2)];
        x * x + y * y + z * z
    }

    /// Square of the distance between two boxes [m²], zero where they meet.
    pub fn square_gap(&self, other: &Self) -> f64 {
        let beside = |d: usize| (self.lower[d] - other.upper[d]).max(other.lower[d] - self.upper[d]).max(0.0);
        (0..3).map(|d| beside(d) * beside(d)).sum()
    }

    /// The smallest box around both.
    pub fn with(self, other: &Self) -> Self {
        Self {
            lower: std::array::from_fn(|d| self.lower[d].min(other.lower[d])),
            upper: std::array::from_fn(|d| self.upper[d].max(other.upper[d])),
        }
    }

    fn centre(&self, d: usize) -> f64 {
        0.5 * (self.lower[d] + self.upper[d])
    }
}

/// A branch with its two halves, or a leaf.
#[derive(Clone, Debug)]
struct Branch {
    around: AxisBox,
    /// Place of its first box in the order, and behind its last.
    range: [u32; 2],
    /// The second half; the first follows its parent. Zero in a leaf.
    second: u32,
}

/// Boxes, found by place.
#[derive(Clone, Debug)]
pub struct BoxTree {
    boxes: Vec<AxisBox>,
    order: Vec<u32>,
    branches: Vec<Branch>,
}

impl BoxTree {
    /// A tree of boxes, which keep their numbers.
    pub fn new(boxes: Vec<AxisBox>) -> Self {
        let mut tree = Self { order: (0..boxes.len() as u32).collect(), boxes, branches: Vec::new() };
        if !tree.boxes.is_empty() {
            let mut order = std::mem::take(&mut tree.order);
            tree.grow(&mut order, 0);
            tree.order = order;
        }
        tree
    }

    /// A tree of points.
    pub fn of_points(points: &[Point]) -> Self {
        Self::new(points.iter().map(|&point| AxisBox { lower: point, upper: point }).collect())
    }

    fn grow(&mut self, order: &mut [u32], first: usize) {
        let none = AxisBox::around(std::iter::empty::<Point>());
        let around = order.iter().fold(none, |all, &i| all.with(&self.boxes[i as usize]));
        let here = self.branches.len();
        let range = [first as u32, (first + order.len()) as u32];
        self.branches.push(Branch { around, range, second: 0 });
        if order.len() <= LEAF {
            return;
        }
        let boxes = &self.boxes;
        let width = |d: usize| {
            let centres = order.iter().map(|&i| boxes[i as usize].centre(d));
            let (low, high) =
                centres.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
            high - low
        };
        let widths = [width(0), width(1), width(2)];
        let axis = (1..3).fold(0, |widest, d| if widths[d] > widths[widest] { d } else { widest });
        let middle = order.len() / 2;
        let centre = |i: u32| boxes[i as usize].centre(axis);
        order.select_nth_unstable_by(middle, |&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
        let (before, behind) = order.split_at_mut(middle);
        self.grow(before, first);
        self.branches[here].second = self.branches.len() as u32;
        self.grow(behind, first + middle);
    }

    /// Visits every box that meets something, in no order that means anything; `meets` must hold for a box around others
    /// wherever it holds for one of them.
    pub fn for_each(&self, meets: impl Fn(&AxisBox) -> bool, mut visit: impl FnMut(usize)) {
        let mut open: Vec<u32> = if self.branches.is_empty() { Vec::new() } else { vec![0] };
        while let Some(here) = open.pop() {
            let branch = &self.branches[here as usize];
            if !meets(&branch.around) {
                continue;
            }
            if branch.second > 0 {
                open.extend([branch.second, here + 1]);
                continue;
            }
            let [first, last] = branch.range;
            for &i in &self.order[first as usize..last as usize] {
                if meets(&self.boxes[i as usize]) {
                    visit(i as usize);
                }
            }
        }
    }

    /// Numbers of the boxes that contain a point, ascending.
    pub fn containing(&self, point: Point) -> Vec<usize> {
        let mut found = Vec::new();
        self.for_each(|around| around.contains(point), |i| found.push(i));
        found.sort_unstable();
        found
    }

    /// Numbers of the boxes that a ray meets, ascending.
    pub fn hits(&self, origin: Point, direction: Point) -> Vec<usize> {
        let mut found = Vec::new();
        self.for_each(|around| around.meets_ray(origin, direction), |i| found.push(i));
        found.sort_unstable();
        found
    }

    /// The box nearest to a point, the first of equals, and the square of its distance [m²]; `None` without boxes.
    pub fn nearest(&self, point: Point) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        let mut open: Vec<u32> = if self.branches.is_empty() { Vec::new() } else { vec![0] };
        while let Some(here) = open.pop() {
            let branch = &self.branches[here as usize];
            // A branch as far as the best so far may hold an equal of a lower number.
            if best.is_some_and(|(_, least)| branch.around.square_distance(point) > least) {
                continue;
            }
            if branch.second > 0 {
                let halves = [branch.second, here + 1];
                let [second, first] =
                    halves.map(|half| self.branches[half as usize].around.square_distance(point));
                open.extend(if first <= second { halves } else { [here + 1, branch.second] });
                continue;
            }
            let [first, last] = branch.range;
            for &i in &self.order[first as usize..last as usize] {
                let found = (i as usize, self.boxes[i as usize].square_distance(point));
                if best.is_none_or(|best| (found.1, found.0) < (best.1, best.0)) {
                    best = Some(found);
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places that repeat: a grid of 0.1 m, out of order, twice.
    fn places() -> Vec<Point> {
        (0..600)
            .map(|k| (k * 7919) % 300)
            .map(|k| [0.1 * (k % 5) as f64, 0.1 * (k / 5 % 6) as f64, 0.1 * (k / 30) as f64])
            .collect()
    }

    fn boxes() -> Vec<AxisBox> {
        let grown = |(k, &x): (usize, &Point)| AxisBox::around([x]).grown(0.01 * (k % 9) as f64);
        places().iter().enumerate().map(grown).collect()
    }

    #[test]
    fn boxes_at_a_point_are_those_that_a_search_through_all_finds() {
        let (boxes, tree) = (boxes(), BoxTree::new(boxes()));
        for k in 0..100 {
            let point = [0.005 * k as f64, 0.3 + 0.003 * k as f64, 0.02 * (k % 50) as f64];
            let all: Vec<usize> = (0..boxes.len()).filter(|&i| boxes[i].contains(point)).collect();
            assert_eq!(tree.containing(point), all);
        }
    }

    #[test]
    fn boxes_on_a_ray_are_those_that_a_search_through_all_finds() {
        let (boxes, tree) = (boxes(), BoxTree::new(boxes()));
        for (origin, direction) in [
            ([-1.0, 0.2, 0.3], [1.0, 0.0, 0.0]),
            ([0.2, 0.2, 0.3], [0.0, 0.0, -2.0]),
            ([-0.1, -0.1, -0.1], [0.3, 0.4, 0.5]),
            ([2.0, 0.0, 0.0], [1.0, 0.1, 0.0]),
        ] {
            let all: Vec<usize> =
                (0..boxes.len()).filter(|&i| boxes[i].meets_ray(origin, direction)).collect();
            assert_eq!(all.is_empty(), origin[0] == 2.0, "only the last starts behind all boxes");
            assert_eq!(tree.hits(origin, direction), all);
        }
    }

    #[test]
    fn a_ray_starts_at_its_origin_and_grazes_faces() {
        let unit = AxisBox { lower: [0.0; 3], upper: [1.0; 3] };
        assert!(unit.meets_ray([-1.0, 0.0, 1.0], [1.0, 0.0, 0.0]), "along an edge");
        assert!(!unit.meets_ray([2.0, 0.5, 0.5], [1.0, 0.0, 0.0]), "behind the origin");
        assert!(unit.meets_ray([0.5; 3], [0.0, -1.0, 0.0]), "from inside");
        assert!(!unit.meets_ray([-1.0, 1.1, 0.5], [1.0, 0.0, 0.0]), "beside it");
        let flat = AxisBox { lower: [0.0, 0.0, 0.5], upper: [1.0, 1.0, 0.5] };
        assert!(flat.meets_ray([0.5, 0.5, 2.0], [0.0, 0.0, -1.0]));
    }

    #[test]
    fn the_nearest_is_the_first_of_equals() {
        let (places, tree) = (places(), BoxTree::of_points(&places()));
        for k in 0..200 {
            // Every fourth place is a node, and many lie in the middle between two, four or eight.
            let point = [0.05 * (k % 11) as f64, 0.05 * (k % 13) as f64, 0.05 * (k % 17) as f64];
            let distance = |i: usize| AxisBox::around([places[i]]).square_distance(point);
            let all = (0..places.len()).map(|i| (distance(i), i)).min_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(tree.nearest(point), all.map(|(distance, i)| (i, distance)));
        }
        assert_eq!(BoxTree::of_points(&[]).nearest([0.0; 3]), None);
        assert!(BoxTree::of_points(&[]).containing([0.0; 3]).is_empty());
    }
}
