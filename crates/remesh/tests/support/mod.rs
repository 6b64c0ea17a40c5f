//! Meshes and vectors for the tests of this crate.

use std::collections::BTreeMap;
use std::sync::Arc;

use fluxmorph_geometry::generate::{BlockParameters, ShieldParameters, block, shield};
use fluxmorph_geometry::tet4::{centroid, cross};
use fluxmorph_geometry::{Mesh, NodeId, RegionId, Topology};
use fluxmorph_remesh::{
    Boundary, BoundaryKind, KinematicConstraint, Motion, MotionLaw, RemeshSetup, StiffnessPolicy, Subregion,
};

pub(crate) type Point = [f64; 3];

/// A block of unit cells.
pub(crate) fn unit_cells(cells: [usize; 3]) -> Mesh {
    block(&BlockParameters { size: cells.map(|n| n as f64), cells }).expect("a block")
}

/// The same mesh and outer surfaces with other regions, asked for at the centroid of each element.
pub(crate) fn painted(mesh: &Mesh, names: &[&str], region: impl Fn(Point) -> u32) -> Mesh {
    let old = mesh.topology();
    let region_of = old.elements().map(|e| RegionId(region(centroid(mesh.vertices(e))))).collect();
    let names = names.iter().map(|n| (*n).to_owned()).collect();
    let mut topology =
        Topology::new(old.node_count(), old.tets().to_vec(), names, region_of).expect("a mesh");
    for name in old.surface_names() {
        let triangles = old.surface(name).expect("it is listed").to_vec();
        topology = topology.with_surface(name, triangles).expect("nodes exist");
    }
    Mesh::new(Arc::new(topology), mesh.points().to_vec()).expect("the same points")
}

/// The mesh with its interior nodes displaced by up to `amplitude` [m]; pseudo-random but always the same.
pub(crate) fn shaken(mesh: &Mesh, amplitude: f64) -> Mesh {
    let mut noise = noise(7);
    let shift = |n: NodeId| {
        let scale = if is_outer(mesh, n) { 0.0 } else { amplitude };
        std::array::from_fn(|_| scale * noise())
    };
    let displacement: Vec<Point> = mesh.topology().nodes().map(shift).collect();
    mesh.moved(&displacement).expect("a small shake inverts nothing")
}

/// Whether a node lies on the bounding box.
pub(crate) fn is_outer(mesh: &Mesh, node: NodeId) -> bool {
    let ([low, high], p) = (mesh.bounding_box(), mesh.point(node));
    (0..3).any(|d| p[d] == low[d] || p[d] == high[d])
}

/// Nodes at which a condition holds, ascending.
pub(crate) fn nodes_where(mesh: &Mesh, on: impl Fn(Point) -> bool) -> Vec<NodeId> {
    mesh.topology().nodes().filter(|&n| on(mesh.point(n))).collect()
}

/// A set-up in which the whole outer boundary of the mesh is designed and every element is remeshed.
pub(crate) fn outer_design(mesh: &Mesh, subregions: Vec<Subregion>, policy: StiffnessPolicy) -> RemeshSetup {
    let design_nodes = mesh.topology().nodes().filter(|&n| is_outer(mesh, n)).collect();
    RemeshSetup { subregions, policy, design_nodes, ..RemeshSetup::default() }
}

/// All elements in one subregion.
pub(crate) fn whole(mesh: &Mesh) -> Vec<Subregion> {
    vec![Subregion::new("all", mesh.topology().elements().collect())]
}

/// A block by a law whose top is designed and whose sides slide.
pub(crate) fn sliding_top(mesh: &Mesh, policy: StiffnessPolicy, law: MotionLaw) -> Motion {
    let slide = |name| Boundary::of_surface(mesh.topology(), name, BoundaryKind::Slide).unwrap();
    let top = mesh.bounding_box()[1][2];
    let setup = RemeshSetup {
        subregions: whole(mesh),
        policy,
        law,
        design_nodes: nodes_where(mesh, |p| p[2] == top),
        boundaries: ["x_min", "x_max", "y_min", "y_max"].map(slide).to_vec(),
        ..RemeshSetup::default()
    };
    Motion::new(mesh.clone(), setup).unwrap()
}

/// Asserts that layers of height h in equilibrium have one stress when the top of a block is moved by so much: with a modulus inverse
/// to the volume, J − 1/J is in proportion to h.
pub(crate) fn assert_layers_keep_what_their_weight_says(law: MotionLaw, depth: f64) {
    let heights = [0.0, 0.1, 0.4, 1.0, 2.5, 5.0];
    let flat = unit_cells([2, 2, 5]);
    let graded: Vec<Point> =
        flat.points().iter().map(|p| [0.0, 0.0, heights[p[2] as usize] - p[2]]).collect();
    let mesh = flat.moved(&graded).unwrap();
    let motion = sliding_top(&mesh, StiffnessPolicy::InverseVolume, law);
    let moved = motion.moved(&at(&mesh, motion.map().design_nodes(), |_| [0.0, 0.0, depth])).unwrap();
    let height = |layer: usize| {
        let node = mesh.topology().nodes().find(|n| flat.point(*n) == [0.0, 0.0, layer as f64]).unwrap();
        moved.mesh.point(node)[2]
    };
    let stretch = |layer: usize| (height(layer + 1) - height(layer)) / (heights[layer + 1] - heights[layer]);
    let stress =
        |layer: usize| (stretch(layer) - 1.0 / stretch(layer)) / (heights[layer + 1] - heights[layer]);
    for layer in 1..5 {
        assert!((stress(layer) / stress(0) - 1.0).abs() < 1e-9, "{depth}: {layer}");
    }
    assert!((stretch(0) - 1.0).abs() < 0.1, "the skin keeps its thickness");
}

/// Asserts that a function of a design has the derivative of its central differences along a direction.
pub(crate) fn assert_derivative(
    function: impl Fn(&[Point]) -> (f64, Vec<Point>),
    design: &[Point],
    direction: &[Point],
) {
    let shifted = |h: f64| -> Vec<Point> {
        design.iter().zip(direction).map(|(u, d)| std::array::from_fn(|i| u[i] + h * d[i])).collect()
    };
    let h = 1e-6;
    let difference = (function(&shifted(h)).0 - function(&shifted(-h)).0) / (2.0 * h);
    // The smooth minimum bends by β = 200: truncation of (β h)², rounding over h.
    assert!((difference / product(&function(design).1, direction) - 1.0).abs() < 1e-5);
}

/// `motion` at some nodes.
pub(crate) fn at(mesh: &Mesh, nodes: &[NodeId], motion: impl Fn(Point) -> Point) -> Vec<Point> {
    nodes.iter().map(|&n| motion(mesh.point(n))).collect()
}

/// Rotation by `angle` [rad] about an oblique axis through an oblique point, as a displacement (Rodrigues).
pub(crate) fn rotation(angle: f64) -> impl Fn(Point) -> Point {
    let axis = [2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0];
    move |x| {
        let r = [x[0] - 0.3, x[1] - 0.1, x[2] + 0.2];
        let once = cross(axis, r);
        let twice = cross(axis, once);
        std::array::from_fn(|d| angle.sin() * once[d] + (1.0 - angle.cos()) * twice[d])
    }
}

/// `Σ a · b`.
pub(crate) fn product(a: &[Point], b: &[Point]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
}

/// What `run` yields in a pool of so many threads.
pub(crate) fn on_threads<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
}

/// Numbers in −1 … 1 from a linear congruential generator.
pub(crate) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// `n` pseudo-random vectors.
pub(crate) fn random(n: usize, seed: u64) -> Vec<Point> {
    let mut noise = noise(seed);
    (0..n).map(|_| std::array::from_fn(|_| noise())).collect()
}

pub(crate) fn largest_difference(a: &[Point], b: &[Point]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// The shield of the paper's example 2 with its plate meshed: 12k nodes, eight plate layers.
pub(crate) fn meshed_shield() -> Mesh {
    shield(&ShieldParameters::default()).expect("the default is valid")
}

/// The shield without its plate, as for the impedance model.
pub(crate) fn hollow_shield() -> Mesh {
    let solid = ShieldParameters { skin: Vec::new(), side_skin: Vec::new(), ..ShieldParameters::default() };
    let mesh = shield(&solid).expect("valid");
    mesh.without_region(mesh.topology().region("plate").expect("it is there")).expect("a region may go").0
}

/// Nodes of the shield's design surface, ascending.
pub(crate) fn plate_bottom(mesh: &Mesh) -> Vec<NodeId> {
    let mut nodes = mesh.topology().surface("plate_bottom").expect("a surface").concat();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// The shield's set-up: sliding symmetry planes and plate sides, the plate's lower face designed.
pub(crate) fn shield_setup(
    mesh: &Mesh,
    regions: &[&str],
    policy: StiffnessPolicy,
    poisson: f64,
) -> RemeshSetup {
    let topology = mesh.topology();
    let subregion = |r: &&str| Subregion { poisson, ..Subregion::of_region(topology, r).expect("a region") };
    let slide = |s| Boundary::of_surface(topology, s, BoundaryKind::Slide).expect("a surface");
    RemeshSetup {
        subregions: regions.iter().map(subregion).collect(),
        policy,
        kinematic_constraint: KinematicConstraint::Free,
        design_nodes: plate_bottom(mesh),
        boundaries: ["x_min", "y_min", "plate_side"].map(slide).to_vec(),
        ..RemeshSetup::default()
    }
}

/// Nodes of each grid column of the plate, bottom to top.
pub(crate) fn plate_columns(mesh: &Mesh) -> Vec<Vec<NodeId>> {
    let mut columns = BTreeMap::<(u64, u64), Vec<NodeId>>::new();
    let plate = mesh.topology().region("plate").expect("a shield");
    let mut nodes: Vec<NodeId> =
        mesh.topology().elements_of(plate).into_iter().flat_map(|e| mesh.topology().tet(e)).collect();
    nodes.sort_by(|a, b| mesh.point(*a)[2].total_cmp(&mesh.point(*b)[2]).then(a.cmp(b)));
    nodes.dedup();
    for node in nodes {
        let p = mesh.point(node);
        columns.entry((p[0].to_bits(), p[1].to_bits())).or_default().push(node);
    }
    columns.into_values().collect()
}

/// Asserts that what a motion pulls back from a design are its central differences along `directions`, to `tolerance`.
pub(crate) fn assert_pull_back(
    motion: &Motion,
    design: &[Point],
    directions: impl Iterator<Item = Vec<Point>>,
    tolerance: f64,
) {
    let nodes = motion.moved(design).unwrap().displacement.len();
    let weights = random(nodes, 5);
    let value = |design: &[Point]| product(&weights, &motion.moved(design).unwrap().displacement);
    let gradient = motion.moved(design).unwrap().pull_back(&weights).unwrap();
    for direction in directions {
        let step = |h: f64| -> Vec<Point> {
            design.iter().zip(&direction).map(|(u, d)| std::array::from_fn(|i| u[i] + h * d[i])).collect()
        };
        let h = 1e-5;
        let difference = (value(&step(h)) - value(&step(-h))) / (2.0 * h);
        let exact = product(&gradient, &direction);
        // Truncation of h², rounding over h.
        assert!(
            (difference - exact).abs() < tolerance * exact.abs().max(1.0),
            "{difference} against {exact}"
        );
    }
}

/// Asserts that the mesh of a design has the same bits cold and after twenty others, for any number of threads.
pub(crate) fn assert_one_function(
    motion: impl Fn() -> Motion + Sync,
    design: impl Fn(&Motion) -> Vec<Point> + Sync,
    other: impl Fn(&Motion, u64) -> Vec<Point> + Sync,
) {
    let bits = |others: u64| {
        let motion = motion();
        for seed in 0..others {
            drop(motion.moved(&other(&motion, 100 + seed)));
        }
        let moved = motion.moved(&design(&motion)).unwrap();
        moved.displacement.iter().flatten().map(|u| u.to_bits()).collect::<Vec<_>>()
    };
    let cold = on_threads(1, || bits(0));
    assert_eq!(cold, on_threads(3, || bits(0)));
    assert_eq!(cold, on_threads(2, || bits(20)));
}
