//! A sheet of current between two walls: the field of a coil region, known exactly, and where such a coil may end.
//!
//! The current flows along y through the layer |x| < 20 mm of a box, from the flux-parallel wall y_min to y_max; z_min and
//! z_max are flux-normal. `H = (0, 0, c − J x)` in the layer and constant on both sides of it; with flux-parallel walls at x_min
//! and x_max no flux passes the box, so that `c = 0` in a box that is symmetric to the sheet.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::{ElementId, Mesh, RegionId};
use fluxmorph_solver::coil::{Coil, Frame, Path, RegionCurrent, RegionFault};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{Boundary, ElementFamily, FieldModel, FieldModelSetup, Material, Order, SolverError};

use crate::{flux_parallel, painted, terminal};

/// Ampere-turns of the sheet [A].
const CURRENT: f64 = 1e3;
/// Height of the box [m].
const HEIGHT: f64 = 0.03;

fn sheet() -> Mesh {
    let x = vec![-0.06, -0.04, -0.02, -0.01, 0.0, 0.01, 0.02, 0.04, 0.06];
    painted([x, vec![0.0, 0.02, 0.04], vec![0.0, 0.015, HEIGHT]], &["air", "winding"], |x| {
        u32::from(x[0].abs() < 0.02)
    })
}

fn winding(mesh: &Mesh, path: Path) -> RegionCurrent {
    let elements = mesh.topology().elements_of(mesh.topology().region("winding").expect("a region"));
    RegionCurrent::new(mesh, "winding", &elements, &path).expect("a current")
}

fn model(
    mesh: &Mesh,
    (family, order): (ElementFamily, Order),
    current: RegionCurrent,
    boundaries: Vec<(String, Boundary)>,
) -> Result<FieldModel, SolverError> {
    let coil = Coil { name: "winding".to_owned(), ampere_turns: CURRENT.into(), shape: current.into() };
    let setup = FieldModelSetup {
        family,
        order,
        materials: vec![Material::AIR; mesh.topology().region_names().len()],
        coils: vec![coil],
        boundaries,
        ..FieldModelSetup::default()
    };
    FieldModel::new(mesh, setup)
}

/// The mean of the exact `B_z` over an element: the field is linear in each, for the mesh follows the sheet.
fn exact(mesh: &Mesh, e: ElementId) -> f64 {
    let at = |x: [f64; 3]| -VACUUM_PERMEABILITY * CURRENT / HEIGHT * (x[0] / 0.04).clamp(-0.5, 0.5);
    mesh.vertices(e).map(at).iter().sum::<f64>() / 4.0
}

#[test]
fn edge_elements_have_the_field_of_a_coil_region() {
    let mesh = sheet();
    let path = || Path::Terminals { from: terminal(&mesh, "y_min"), to: terminal(&mesh, "y_max") };
    let largest = VACUUM_PERMEABILITY * CURRENT / HEIGHT * 0.5;
    // First order: B constant in an element, and the field changes by half of its largest over a cell of the layer, so that a
    // quarter is the bar; second: B linear, as the field is, to the residual of the solver.
    for (order, tolerance) in [(Order::Linear, 0.25), (Order::Quadratic, 1e-9)] {
        let mut boundaries = flux_parallel(&["x_min", "x_max", "y_min", "y_max"]);
        boundaries.extend(["z_min", "z_max"].map(|name| (name.to_owned(), Boundary::FluxNormal)));
        let model = model(&mesh, (ElementFamily::Edge, order), winding(&mesh, path()), boundaries);
        let model = model.expect("a sound problem");
        let (field, _) = model.solve(&mesh).expect("it is solved");
        let error = |e: ElementId| {
            let [x, y, z] = field.flux_density(&model, &mesh, e);
            [x, y, z - exact(&mesh, e)].iter().map(c64::norm_sqr).sum::<f64>().sqrt() / largest
        };
        let worst = mesh.topology().elements().map(error).fold(0.0, f64::max);
        println!("{order:?}: {worst:.2e} of the largest");
        assert!(worst < tolerance, "{order:?}: {worst:.2e}");
    }
}

/// Between walls that nothing connects the current would have to gather: there is no static field, whatever the elements.
#[test]
fn a_coil_region_between_walls_apart_is_refused() {
    let mesh = sheet();
    let path = || Path::Terminals { from: terminal(&mesh, "y_min"), to: terminal(&mesh, "y_max") };
    for family in [ElementFamily::Nodal, ElementFamily::Edge] {
        let walls = flux_parallel(&["y_min", "y_max"]);
        let error = model(&mesh, (family, Order::Linear), winding(&mesh, path()), walls).unwrap_err();
        assert!(
            matches!(error, SolverError::CoilRegion { fault: RegionFault::Unconnected { .. }, .. }),
            "{error}"
        );
        let walls = flux_parallel(&["y_min", "y_max", "x_max"]);
        assert!(model(&mesh, (family, Order::Linear), winding(&mesh, path()), walls).is_ok());
    }
}

/// A ring of winding around a hole in the mesh: on the free walls H is normal, so that no loop on them encloses a current.
#[test]
fn a_coil_region_round_a_tunnel_is_refused() {
    let line = || vec![-0.03, -0.02, -0.01, 0.01, 0.02, 0.03];
    let within = |half: f64, [x, y, _]: [f64; 3]| x.abs() < half && y.abs() < half;
    let axis = || Path::Closed(Frame::coordinate([0.0; 3], 2).expect("z"));
    let free = |mesh: &Mesh| {
        model(mesh, (ElementFamily::Edge, Order::Linear), winding(mesh, axis()), Vec::new()).map(|_| ())
    };
    let ring = |x, inside| if within(0.01, x) { inside } else { u32::from(within(0.02, x)) };
    let mesh =
        |inside| painted([line(), line(), vec![0.0, 0.01]], &["air", "winding", "hole"], |x| ring(x, inside));
    assert!(free(&mesh(0)).is_ok());
    let (left, _) = mesh(2).without_region(RegionId(2)).expect("what is left");
    let error = free(&left).unwrap_err();
    assert!(matches!(error, SolverError::CoilRegion { fault: RegionFault::RoundTunnel, .. }), "{error}");
}
