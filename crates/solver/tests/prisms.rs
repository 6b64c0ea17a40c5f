//! Fields that are known exactly on any planar polygon: `H = (0, 0, T + c)` between flux-normal planes.
//!
//! Side walls are flux-parallel, and a coil along z that is longer than the domain is high has the potential `T(x, y)`.
//! `c` follows from the induction law around the domain, `∫μ(T + c) + Σ Zs/(jω) ∮(T + c) ds = 0` over all blocks with an
//! impedance surface; a perfect conductor has `Zs = 0`. Every block has an edge that the field goes around, where a nodal
//! `A` with zero tangential parts fails.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{Boundary, Conductor, ElementFamily, FieldModelSetup, Material, Order, SurfaceLaw};

use crate::{ALL, in_the_square, solved, square};

/// `∫T dS` of the coil [A m]: 1 kA over 0.4 m, half window 0.15 m, winding 0.1 m wide.
const MOMENT: f64 = 2500.0 * 0.163_333_333_333_333_33;

/// The square without the block, and the faces that the block left.
fn square_without_a_quarter() -> (Mesh, Vec<[fluxmorph_geometry::NodeId; 3]>) {
    square().without_region(RegionId(1)).expect("what is left")
}

fn block(surface: &[[fluxmorph_geometry::NodeId; 3]], law: SurfaceLaw) -> Conductor {
    Conductor { name: "block".to_owned(), surface: surface.to_vec(), law }
}

/// `μ0 c` [T] behind surfaces with `Zs/(jω)` [H] along so many metres.
fn far_field(reactance: c64, perimeter: f64) -> c64 {
    -MOMENT * VACUUM_PERMEABILITY / (3.0 + reactance / VACUUM_PERMEABILITY * perimeter)
}

/// Edge elements have the far field exactly, whatever the mesh: a residual of 1e-11 is left. Nodal ones are of first and second
/// order in cells of 0.1 m, on surfaces where the normal component of A is zero on no triangle exactly.
fn tolerance(family: ElementFamily, order: Order) -> f64 {
    match (family, order) {
        (ElementFamily::Edge, _) => 1e-9,
        (ElementFamily::Nodal, Order::Linear) => 0.03,
        (ElementFamily::Nodal, Order::Quadratic) => 1e-3,
    }
}

/// The largest error of `B` in the arm x < −0.4 m, y < −0.4 m, of the exact field there.
fn error(mesh: &Mesh, setup: FieldModelSetup, exact: c64) -> f64 {
    let (model, solution) = solved(mesh, setup);
    let centre = |e| {
        let vertices = mesh.vertices(e);
        [0, 1].map(|d| vertices.iter().map(|x| x[d]).sum::<f64>() / 4.0)
    };
    let far = mesh.topology().elements().filter(|&e| centre(e).iter().all(|&c| c < -0.4));
    let far: Vec<_> = far.collect();
    let errors = solution.flux_densities_of(&model, mesh, &far).into_iter().map(|b| {
        let squares = [b[0], b[1], b[2] - exact].map(|c| c.norm_sqr());
        (squares.iter().sum::<f64>() / exact.norm_sqr()).sqrt()
    });
    errors.fold(0.0, f64::max)
}

/// The field is the exact one behind surfaces with `Zs/(jω)` [H] along so many metres.
#[track_caller]
fn assert_exact(mesh: &Mesh, setup: FieldModelSetup, reactance: c64, perimeter: f64) {
    let tolerance = tolerance(setup.family, setup.order);
    let case = format!("{:?}, {:?}, {} Hz", setup.family, setup.order, setup.frequency);
    let error = error(mesh, setup, far_field(reactance, perimeter));
    println!("{case}: {error:.2e}");
    assert!(error < tolerance, "{case}: {error:.2e}");
}

#[test]
fn the_field_goes_around_the_edge_of_an_impedance_surface() {
    let (mesh, surface) = square_without_a_quarter();
    let frequency = 25.330_295_91;
    for (skin_depth, (family, order)) in [0.1, 0.01, 1e-5].into_iter().flat_map(|d| ALL.map(move |e| (d, e)))
    {
        let tolerance = match (family, order) {
            // What nodal elements make of a field that must not cross any triangle.
            (ElementFamily::Nodal, Order::Linear) if skin_depth < 1e-3 => 0.08,
            (ElementFamily::Nodal, Order::Quadratic) if skin_depth < 1e-3 => continue,
            _ => tolerance(family, order),
        };
        let conductivity =
            2.0 / (2.0 * std::f64::consts::PI * frequency * VACUUM_PERMEABILITY * skin_depth * skin_depth);
        let material = Material { relative_permeability: 1.0, conductivity };
        let conductors = vec![block(&surface, SurfaceLaw::Impedance(material))];
        let setup = FieldModelSetup { conductors, ..in_the_square((family, order), frequency) };
        // Zs/(jω) = μ δ (1 − j)/2.
        let reactance = 0.5 * VACUUM_PERMEABILITY * skin_depth * c64::new(1.0, -1.0);
        let error = error(&mesh, setup, far_field(reactance, 2.0));
        println!("skin depth {skin_depth} m, {family:?}, {order:?}: {error:.2e}");
        assert!(error < tolerance, "skin depth {skin_depth} m, {family:?}, {order:?}: {error:.2e}");
    }
}

#[test]
fn the_field_goes_around_a_perfect_conductor() {
    let (mesh, surface) = square_without_a_quarter();
    for (elements, frequency) in ALL.into_iter().flat_map(|e| [0.0, 50.0].map(|f| (e, f))) {
        let conductors = vec![block(&surface, SurfaceLaw::Perfect)];
        let setup = FieldModelSetup { conductors, ..in_the_square(elements, frequency) };
        assert_exact(&mesh, setup, c64::default(), 0.0);
    }
}

/// The quarter is of iron: far from the coil the field is 0.03 % of that in its window.
#[test]
fn the_weak_field_beside_iron_needs_quadratic_or_edge_elements() {
    let mesh = square();
    let iron = Material { relative_permeability: 1e3, conductivity: 0.0 };
    let exact = c64::from(-MOMENT * VACUUM_PERMEABILITY / (3.0 + 1e3));
    let line = |from: f64, by: f64| (0..3).map(move |i| from + by * f64::from(i));
    let of = |x: f64| line(-0.8, 0.1).flat_map(move |y| line(0.0, 0.025).map(move |z| [x, y, z]));
    let far: Vec<Point> = line(-0.8, 0.12).flat_map(of).collect();
    // docs/theory.md, section 2.5: linear elements have four times the field with p = 1, and a smaller p is no cure; the worst of 27 places.
    for (family, order, penalty, tolerance) in [
        (ElementFamily::Nodal, Order::Linear, 0.1, 1.7),
        (ElementFamily::Nodal, Order::Quadratic, 1.0, 0.03),
        (ElementFamily::Nodal, Order::Quadratic, 0.1, 0.02),
        (ElementFamily::Nodal, Order::Quadratic, 0.01, 0.1),
        (ElementFamily::Edge, Order::Linear, 1.0, 1e-9),
    ] {
        let materials = vec![Material::AIR, iron, Material::AIR];
        let setup = FieldModelSetup { penalty, materials, ..in_the_square((family, order), 0.0) };
        let (model, solution) = solved(&mesh, setup);
        let b = probe((&model, &mesh, &solution), "far", &far).expect("points of the mesh");
        let error = b.iter().map(|b| (b[2] / exact - 1.0).norm()).fold(0.0, f64::max);
        println!("{family:?}, {order:?}, penalty {penalty}: {error:.2e}");
        assert!(error < tolerance, "{family:?}, {order:?}, penalty {penalty}: {error:.2e}");
    }
}

/// The quarter's faces are then part of a flux-parallel wall with a re-entrant edge.
#[test]
fn the_field_goes_around_the_edge_of_a_wall() {
    let (mesh, surface) = square_without_a_quarter();
    let topology = (**mesh.topology()).clone().with_surface("wall", surface).expect("faces of the mesh");
    let mesh = Mesh::new(Arc::new(topology), mesh.points().to_vec()).expect("the same mesh");
    for elements in ALL {
        let mut setup = in_the_square(elements, 0.0);
        setup.boundaries.push(("wall".to_owned(), Boundary::FluxParallel));
        assert_exact(&mesh, setup, c64::default(), 0.0);
    }
}

/// Without a flux-parallel surface, where `A = ∇χ` and `ψ = −χ` must not be left undetermined.
#[test]
fn a_cavity_in_an_impedance_has_one_field() {
    let (mesh, _) = square_without_a_quarter();
    let topology = mesh.topology();
    let planes: std::collections::HashSet<_> = ["z_min", "z_max"]
        .into_iter()
        .flat_map(|name| topology.surface(name).expect("a side"))
        .map(|&triangle| face_key(triangle))
        .collect();
    let outer = topology.outer_facets().map(|facet| facet.nodes);
    let surface: Vec<_> = outer.filter(|&nodes| !planes.contains(&face_key(nodes))).collect();
    let material = Material { relative_permeability: 1.0, conductivity: 1e8 };
    let frequency = 25.330_295_91;
    for elements in ALL {
        let conductors = vec![block(&surface, SurfaceLaw::Impedance(material))];
        let mut setup = FieldModelSetup { conductors, ..in_the_square(elements, frequency) };
        setup.boundaries.retain(|(_, boundary)| *boundary == Boundary::FluxNormal);
        assert_exact(&mesh, setup, 0.5 * VACUUM_PERMEABILITY * 0.01 * c64::new(1.0, -1.0), 8.0);
    }
}
