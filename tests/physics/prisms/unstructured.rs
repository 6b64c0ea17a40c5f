//! The prisms of `fixtures/`, meshed by Gmsh: a quadrangle with a slanted side,
//! an L, a T and a comb with slanted teeth.
//!
//! Every file has the regions air, iron, block and observation, so that one mesh serves many prisms: the block may be a
//! perfect conductor, an impedance surface, iron or air.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::io::msh::read_msh_file;

use super::exact::{Kind, Part, Prism};
use super::polygon::{Place, Polygon};
use super::source::Source;
use crate::support::repository;

/// A shape of `fixtures/make.py`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    name: &'static str,
    outline: &'static [Place],
    block: &'static [Place],
    /// Lower and upper corner.
    observation: [Place; 2],
    /// Centre and half window of the coil, and the width of its winding.
    coil: (Place, Place, f64),
}

/// Lower and upper corner of the iron of all of them.
const IRON: [Place; 2] = [[-1.0, 0.7], [-0.7, 1.0]];

const HEIGHT: f64 = 0.1;

/// All shapes.
pub(super) const SHAPES: [Shape; 4] = [
    Shape {
        name: "quadrangle",
        outline: &[[-1.0, -1.0], [0.8, -1.0], [1.0, 1.0], [-1.0, 1.0]],
        block: &[[0.6, -1.0], [0.8, -1.0], [1.0, 1.0], [0.7, 1.0]],
        observation: [[-0.8, -0.6], [-0.5, -0.3]],
        coil: ([0.2, 0.3], [0.15, 0.2], 0.1),
    },
    Shape {
        name: "l",
        outline: &[[-1.0, -1.0], [0.0, -1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 1.0]],
        block: &[[-0.4, -1.0], [0.0, -1.0], [0.0, -0.7], [-0.4, -0.7]],
        observation: [[-0.8, -0.6], [-0.5, -0.3]],
        coil: ([0.5, 0.5], [0.15, 0.15], 0.1),
    },
    Shape {
        name: "t",
        outline: &[
            [-1.0, 0.3],
            [-0.3, 0.3],
            [-0.3, -1.0],
            [0.3, -1.0],
            [0.3, 0.3],
            [1.0, 0.3],
            [1.0, 1.0],
            [-1.0, 1.0],
        ],
        block: &[[-0.3, -1.0], [0.0, -1.0], [0.0, -0.7], [-0.3, -0.7]],
        observation: [[-0.15, -0.5], [0.15, -0.2]],
        coil: ([0.6, 0.65], [0.15, 0.1], 0.1),
    },
    Shape {
        name: "comb",
        outline: &[
            [-1.0, 1.0],
            [-1.0, -1.0],
            [-0.6, -1.0],
            [-0.5, 0.5],
            [-0.2, 0.5],
            [-0.25, -1.0],
            [0.15, -1.0],
            [0.2, 0.5],
            [0.5, 0.5],
            [0.6, -1.0],
            [1.0, -1.0],
            [1.0, 1.0],
        ],
        block: &[[-0.25, -1.0], [0.0, -1.0], [0.0, -0.7], [-0.24, -0.7]],
        observation: [[-0.9, -0.6], [-0.65, -0.3]],
        coil: ([0.78, 0.2], [0.08, 0.1], 0.08),
    },
];

impl Shape {
    /// Its mesh.
    pub(super) fn mesh(&self) -> Mesh {
        let file = format!("tests/physics/prisms/fixtures/{}.msh", self.name);
        read_msh_file(&repository(&file), 1.0).unwrap_or_else(|e| panic!("{e}")).mesh
    }

    /// A prism of this shape, its iron of a relative permeability and its block of a kind.
    pub(super) fn prism(&self, relative_permeability: f64, kind: Kind, what: &str) -> Prism {
        let [lower, upper] = IRON;
        let (centre, half_window, width) = self.coil;
        let iron = Polygon::rectangle(lower, upper);
        let parts = vec![
            Part { name: "iron", shape: iron, kind: Kind::Iron(relative_permeability) },
            Part { name: "block", shape: Polygon::new(self.block), kind },
        ];
        let [lower, upper] = self.observation;
        Prism {
            name: format!("Gmsh {}, iron μr {relative_permeability}, {what}", self.name),
            outline: Polygon::new(self.outline),
            height: HEIGHT,
            source: Source::new(centre, half_window, width),
            parts,
            observation: Polygon::rectangle(lower, upper),
        }
    }
}

/// Every shape with blocks of several kinds, and its mesh.
pub(super) fn all() -> Vec<(Prism, Mesh)> {
    let impedance = |skin_depth| Kind::Impedance { skin_depth, relative_permeability: 1.0 };
    let kinds = [
        (1.0, Kind::Iron(1.0), "no block"),
        (1.0, impedance(0.01), "impedance δ 0.01 m"),
        (1000.0, Kind::Perfect, "perfect block"),
        (1000.0, impedance(0.1), "impedance δ 0.1 m"),
    ];
    let meshed = (1.0, Kind::Meshed { skin_depth: 0.1, relative_permeability: 1.0 }, "meshed δ 0.1 m");
    let of = |shape: &Shape| {
        let mesh = shape.mesh();
        let rectangular = Polygon::new(shape.block).is_rectangle();
        let kinds = kinds.into_iter().chain(rectangular.then_some(meshed));
        let prisms = kinds.map(|(mu, kind, what)| (shape.prism(mu, kind, what), mesh.clone()));
        prisms.collect::<Vec<_>>()
    };
    SHAPES.iter().flat_map(of).collect()
}

#[test]
fn every_file_is_the_mesh_of_its_prism() {
    use fluxmorph_geometry::tet4::{area_vector, norm, volume};
    for shape in SHAPES {
        let (mesh, prism) = (shape.mesh(), shape.prism(1.0, Kind::Perfect, ""));
        let topology = mesh.topology();
        let part = |name: &str| {
            let elements = topology.elements_of(topology.region(name).expect("it is named"));
            elements.iter().map(|&e| volume(mesh.vertices(e))).sum::<f64>() / HEIGHT
        };
        let surface = |name: &str| {
            let faces = topology.surface(name).expect("it is named");
            faces.iter().map(|t| norm(area_vector(t.map(|n| mesh.point(n))))).sum::<f64>()
        };
        let [iron, block] = [0, 1].map(|i| prism.parts[i].shape.area());
        let (whole, observation) = (prism.outline.area(), prism.observation.area());
        let perimeter: f64 = prism.outline.edges().map(super::polygon::length).sum();
        let pairs = [
            (part("iron"), iron),
            (part("block"), block),
            (part("observation"), observation),
            (part("air"), whole - iron - block - observation),
            (surface("top"), whole),
            (surface("bottom"), whole),
            (surface("sides"), perimeter * HEIGHT),
        ];
        for (found, expected) in pairs {
            // Coordinates of the file are doubles.
            assert!((found / expected - 1.0).abs() < 1e-9, "{}: {found} {expected}", shape.name);
        }
        println!("    {}: {} tetrahedra", shape.name, topology.tets().len());
    }
}
