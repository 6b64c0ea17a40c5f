//! A uniform applied field on all of the outside, on a part of it, and where it contradicts something.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::Grid;
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModel, FieldModelSetup, Material, Order, SolverError,
    SurfaceLaw, UniformField,
};

use crate::OUTSIDE;

/// A cube of 3³ cells whose sides lean: no face but z_min and z_max is at right angles to an axis. The cell in the
/// corner x_min, y_min, in the middle of z, is a region of its own.
fn leaning() -> Mesh {
    cube(|[x, y, z]| [x + 0.3 * y + 0.1 * z, y - 0.2 * x + 0.2 * z, z])
}

fn cube(lean: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let line = || (0..=3).map(|i| 0.01 * f64::from(i)).collect::<Vec<_>>();
    let grid = Grid::new("grid", [line(), line(), line()]).expect("a grid");
    let corner = |[x, y, z]: [f64; 3]| x < 0.01 && y < 0.01 && (0.01..0.02).contains(&z);
    let topology =
        grid.topology(&["air", "corner"], |x| RegionId(u32::from(corner(x)))).expect("two regions");
    Mesh::new(Arc::new(topology), grid.points().into_iter().map(lean).collect()).expect("a mesh")
}

fn uniform(flux_density: [f64; 3]) -> Boundary {
    Boundary::UniformField(UniformField { flux_density, centre: None })
}

fn setup(order: Order, names: &[&str], boundary: Boundary) -> FieldModelSetup {
    FieldModelSetup {
        order,
        materials: vec![Material::AIR; 2],
        boundaries: names.iter().map(|&name| (name.to_owned(), boundary)).collect(),
        ..FieldModelSetup::default()
    }
}

/// The largest difference to a uniform field, of that field.
fn error(mesh: &Mesh, setup: FieldModelSetup, exact: [f64; 3]) -> f64 {
    let model = FieldModel::new(mesh, setup).expect("a sound problem");
    let (field, _) = model.solve(mesh).expect("it is solved");
    let size: f64 = exact.iter().map(|b| b * b).sum();
    let difference = |b: [c64; 3]| (0..3).map(|d| (b[d] - exact[d]).norm_sqr()).sum::<f64>();
    let all = field.flux_densities(&model, mesh).into_iter();
    all.map(|b| (difference(b) / size).sqrt()).fold(0.0, f64::max)
}

/// Edge elements hold a uniform field exactly, on faces of any direction: what is left is the solver's residual.
#[test]
fn an_oblique_field_on_leaning_sides_is_uniform_inside() {
    let (mesh, field) = (leaning(), [0.3, -0.2, 0.5]);
    for order in [Order::Linear, Order::Quadratic] {
        let error = error(&mesh, setup(order, &OUTSIDE, uniform(field)), field);
        assert!(error < 1e-9, "{order:?}: {error:e}");
    }
}

/// Along z between flux-normal planes, the field need be given on the other sides alone.
#[test]
fn a_field_on_a_part_of_the_outside_is_uniform_inside() {
    let (mesh, field) = (leaning(), [0.0, 0.0, 0.5]);
    for order in [Order::Linear, Order::Quadratic] {
        let mut setup = setup(order, &OUTSIDE[..4], uniform(field));
        setup.boundaries.extend(["z_min", "z_max"].map(|name| (name.to_owned(), Boundary::FluxNormal)));
        let error = error(&mesh, setup, field);
        assert!(error < 1e-9, "{order:?}: {error:e}");
    }
}

/// A field along x between flux-normal planes, flux-parallel ones across y, and A given on what is left. A flux-parallel plane has no
/// part of the flux, so that A must be that of the whole beside it: with its center elsewhere edge elements had 3/4 of the field, between
/// two such planes half of it.
#[test]
fn a_field_beside_flux_parallel_planes_has_its_centre_on_them_or_is_refused() {
    let (mesh, flux_density) = (cube(|x| x), [0.1, 0.0, 0.0]);
    for (family, order) in [
        (ElementFamily::Nodal, Order::Linear),
        (ElementFamily::Edge, Order::Linear),
        (ElementFamily::Edge, Order::Quadratic),
    ] {
        let with = |parallel: &[&str], applied: &[&str], centre: Option<[f64; 3]>| {
            let field = Boundary::UniformField(UniformField { flux_density, centre });
            let mut setup = setup(order, applied, field);
            setup.family = family;
            let of = |names: &[&str], kind| names.iter().map(|&n| (n.to_owned(), kind)).collect::<Vec<_>>();
            setup.boundaries.extend(of(parallel, Boundary::FluxParallel));
            setup.boundaries.extend(of(&["x_min", "x_max"], Boundary::FluxNormal));
            setup
        };
        let beside = ["z_min", "z_max", "y_max"];
        let error = error(&mesh, with(&["y_min"], &beside, None), flux_density);
        assert!(error < 1e-9, "{family:?} {order:?}: {error:e}");
        let refused = [
            with(&["y_min"], &beside, Some([0.0, 0.004, 0.0])),
            with(&["y_min", "y_max"], &beside[..2], None),
            with(&["y_min", "y_max"], &beside[..2], Some([0.0, 0.015, 0.0])),
        ];
        for setup in refused {
            let error = FieldModel::new(&mesh, setup).unwrap_err();
            assert!(matches!(error, SolverError::Conflict { .. }), "{family:?} {order:?}: {error}");
        }
    }
}

/// Along a plane across no axis, with coordinates of five digits: its faces have directions of their own.
#[test]
fn an_oblique_flux_parallel_plane_is_one_in_rounded_coordinates() {
    let turned = |[x, y, z]: [f64; 3]| [0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y, z];
    let mesh = cube(|x| turned(x.map(|c| 1.01 * c)).map(|c| (c * 1e6).round() * 1e-6));
    let flux_density = turned([0.1, 0.0, 0.0]);
    let field = Boundary::UniformField(UniformField { flux_density, centre: Some([0.0; 3]) });
    let mut setup = setup(Order::Linear, &["z_min", "z_max", "y_max"], field);
    setup.boundaries.push(("y_min".to_owned(), Boundary::FluxParallel));
    let sides = ["x_min", "x_max"].map(|name| (name.to_owned(), Boundary::FluxNormal));
    setup.boundaries.extend(sides);
    let error = error(&mesh, setup, flux_density);
    // Of the directions of the faces.
    assert!(error < 1e-3, "{error:e}");
}

#[test]
fn two_applied_fields_that_share_an_edge_agree_on_it_or_are_refused() {
    let mesh = leaning();
    for family in [ElementFamily::Nodal, ElementFamily::Edge] {
        let with = |other: [f64; 3]| {
            let mut setup = setup(Order::Linear, &OUTSIDE[..2], uniform([0.0, 0.0, 0.5]));
            setup.family = family;
            setup.boundaries.push(("y_min".to_owned(), uniform(other)));
            FieldModel::new(&mesh, setup)
        };
        assert!(with([0.0, 0.0, 0.5]).is_ok());
        let error = with([0.0, 0.0, 0.4]).unwrap_err();
        assert!(
            matches!(&error, SolverError::TwoFields { surfaces, .. } if surfaces[1] == "y_min"),
            "{error}"
        );
    }
}

#[test]
fn a_perfect_conductor_on_a_surface_with_an_applied_field_is_refused() {
    let (mesh, surface) = leaning().without_region(RegionId(1)).expect("what is left");
    let block = Conductor { name: "block".to_owned(), surface, law: SurfaceLaw::Perfect };
    for family in [ElementFamily::Nodal, ElementFamily::Edge] {
        let at = |names: &[&str]| {
            let mut setup = setup(Order::Linear, names, uniform([0.0, 0.0, 0.5]));
            (setup.family, setup.conductors) = (family, vec![block.clone()]);
            FieldModel::new(&mesh, setup)
        };
        assert!(at(&["x_max", "y_max"]).is_ok(), "it touches the two other sides");
        let error = at(&OUTSIDE).unwrap_err();
        assert!(
            matches!(&error, SolverError::FieldOnConductor { conductor, .. } if conductor == "block"),
            "{error}"
        );
    }
}

/// Along its face, not along the edges at which it meets the surface of the field: half of the flux would be missing.
#[test]
fn a_field_along_the_face_of_a_perfect_conductor_has_its_centre_there_or_is_refused() {
    let (mesh, surface) = cube(|x| x).without_region(RegionId(1)).expect("what is left");
    let in_wall = |triangle: &[fluxmorph_geometry::NodeId; 3]| {
        triangle.iter().all(|&n| (mesh.point(n)[1] - 0.01).abs() < 1e-9)
    };
    let surface: Vec<_> = surface.into_iter().filter(in_wall).collect();
    let block = Conductor { name: "block".to_owned(), surface, law: SurfaceLaw::Perfect };
    for (centre, is_sound) in [(0.01, true), (0.015, false)] {
        let field = UniformField { flux_density: [0.0, 0.0, 0.1], centre: Some([0.0, centre, 0.0]) };
        let mut setup = setup(Order::Linear, &["x_min"], Boundary::UniformField(field));
        setup.conductors = vec![block.clone()];
        match FieldModel::new(&mesh, setup) {
            Ok(_) => assert!(is_sound, "{centre}"),
            Err(error) => assert!(
                !is_sound && matches!(error, SolverError::FieldOnConductor { .. }),
                "{centre}: {error}"
            ),
        }
    }
}
