//! Conducting, permeable spheres in a uniform field, solid and hollow, against the closed forms of
//! `tests/reference/sphere.json`.
//!
//! An octant: the field is along z, so the planes x and y hold it (flux-parallel) and z = 0 is crossed at right angles
//! (flux-normal). The applied potential is prescribed on the outer sphere of eight radii; it leaves out the reaction of the
//! sphere there, whose dipole is then mirrored: an error of about two thousandths of the sphere's field. The thin-skinned
//! steel is computed with layers in its skin and as an impedance surface.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{SphereParameters, sphere};
use fluxmorph_geometry::tet4::{Point, norm};
use fluxmorph_geometry::{ElementId, Mesh};
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{
    Boundary, FieldModel, FieldModelSetup, Functional, Material, Order, UniformField, adjoint,
};
use serde_json::Value;

use crate::references::{named, number, reference};
use crate::rows::{Case, Row, assert_rows};

/// Outer radius over that of the sphere.
const BOX: f64 = 8.0;

fn complex(value: &Value) -> c64 {
    let part = |i: usize| value[i].as_f64().expect("two numbers");
    c64::new(part(0), part(1))
}

/// Conditions of an octant in the unit field along z.
fn setup(mesh: &Mesh, frequency: f64, material: Material, order: Order) -> FieldModelSetup {
    let of = |name: &str| if name == "sphere" { material } else { Material::AIR };
    let applied = UniformField { flux_density: [0.0, 0.0, 1.0], centre: None };
    let boundaries = [
        ("x_min", Boundary::FluxParallel),
        ("y_min", Boundary::FluxParallel),
        ("z_min", Boundary::FluxNormal),
        ("outer", Boundary::UniformField(applied)),
    ];
    FieldModelSetup {
        frequency,
        order,
        materials: mesh.topology().region_names().iter().map(|name| of(name)).collect(),
        boundaries: boundaries.map(|(name, condition)| (name.to_owned(), condition)).to_vec(),
        ..FieldModelSetup::default()
    }
}

/// Rows of one solid sphere on a mesh: centre, outside on axis and equator, loss, and the derivative of the loss by the
/// radius.
pub(crate) fn solid(name: &str, order: Order, refinement: f64, bars: [f64; 3]) -> Vec<Row> {
    let file = reference("sphere.json");
    let sphere_data = named(&file["spheres"], name);
    let radius = number(sphere_data, "radius_m");
    let material = Material {
        relative_permeability: number(sphere_data, "relative_permeability"),
        conductivity: number(sphere_data, "conductivity_S_per_m"),
    };
    let frequency = number(&file, "frequency_Hz");
    let skin_depth = material.skin_depth(std::f64::consts::TAU * frequency).expect("it conducts");
    let mesh = sphere(&parameters(radius, skin_depth, refinement)).expect("a sound sphere");
    let model = FieldModel::new(&mesh, setup(&mesh, frequency, material, order)).expect("a sound problem");
    let (solution, system) = model.solve(&mesh).expect("it converges");
    let case = Case::new(format!("sphere, {name}, {order:?}"), &mesh, &model);
    let at =
        |point: Point| probe(&solution, &model, &mesh, name, &[point]).expect("a point of the mesh")[0][2];
    let dipole = complex(&sphere_data["dipole_T_m3"]);
    let far = 1.5 * radius;
    let [field_bar, loss_bar, derivative_bar] = bars;
    let loss = Functional::loss(&model, "sphere").expect("the sphere conducts");
    let value = loss.evaluate(&model, &mesh, &solution).expect("a finite loss");
    let lambda = adjoint::solve(&system, &value.derivative).expect("it converges");
    let moving: Vec<ElementId> = mesh.topology().elements().collect();
    let implicit = adjoint::node_gradient(&model, &mesh, &solution, &lambda, &moving);
    let explicit = value.explicit.expect("a loss of a region that moves");
    let derivative: f64 = mesh
        .topology()
        .nodes()
        .map(|n| {
            let velocity = growth(mesh.point(n), radius);
            (0..3).map(|d| velocity[d] * (implicit[n.index()][d] + explicit[n.index()][d])).sum::<f64>()
        })
        .sum();
    vec![
        case.row("B at the centre [T]", at([0.0; 3]), complex(&sphere_data["centre_T"]), field_bar),
        case.row("B outside, axis [T]", at([0.0, 0.0, far]), 1.0 + 2.0 * dipole / far.powi(3), field_bar),
        case.row("B outside, equator [T]", at([far, 0.0, 0.0]), 1.0 - dipole / far.powi(3), field_bar),
        case.row("loss [W]", (8.0 * value.value).into(), number(sphere_data, "loss_W").into(), loss_bar),
        case.row(
            "dP/dR [W/m]",
            (8.0 * derivative).into(),
            number(sphere_data, "loss_per_radius_W_per_m").into(),
            derivative_bar,
        ),
    ]
}

/// Velocity of a point when the sphere grows at unit rate: linear inside, falling to zero at the outer boundary.
fn growth(x: Point, radius: f64) -> Point {
    let r = norm(x);
    let rate = if r <= radius { 1.0 / radius } else { (BOX * radius / r - 1.0) / ((BOX - 1.0) * radius) };
    x.map(|c| rate * c)
}

/// Layers under the surface from a third of the skin depth, growing by half, down to four skin depths or half the
/// radius.
fn parameters(radius: f64, skin_depth: f64, refinement: f64) -> SphereParameters {
    let (mut skin, mut layer) = (Vec::new(), skin_depth / 3.0);
    let mut depth = layer;
    while depth < (4.0 * skin_depth).min(0.45 * radius) {
        skin.push(depth);
        layer *= 1.5;
        depth += layer;
    }
    SphereParameters {
        radius,
        outer_radius: BOX * radius,
        divisions: 6,
        skin,
        growth: 1.6,
        refinement,
        ..SphereParameters::default()
    }
}

/// The cavity field of a hollow sphere.
pub(crate) fn hollow(order: Order, refinement: f64, bar: f64) -> Vec<Row> {
    let file = reference("sphere.json");
    let data = &file["hollow"];
    let radius = number(data, "outer_radius_m");
    let material = Material {
        relative_permeability: number(data, "relative_permeability"),
        conductivity: number(data, "conductivity_S_per_m"),
    };
    let mesh = sphere(&SphereParameters {
        radius,
        inner_radius: Some(number(data, "inner_radius_m")),
        outer_radius: BOX * radius,
        divisions: 6,
        wall_layers: 3,
        growth: 1.6,
        refinement,
        ..SphereParameters::default()
    })
    .expect("a sound sphere");
    let frequency = number(&file, "frequency_Hz");
    let model = FieldModel::new(&mesh, setup(&mesh, frequency, material, order)).expect("a sound problem");
    let (solution, _) = model.solve(&mesh).expect("it converges");
    let b = probe(&solution, &model, &mesh, "cavity", &[[0.0; 3]]).expect("a point of the mesh")[0][2];
    let case = Case::new(format!("hollow sphere, {order:?}"), &mesh, &model);
    vec![case.row("B in the cavity [T]", b, complex(&data["cavity_T"]), bar)]
}

#[test]
fn explore() {
    let bars = [9.0; 3];
    for name in ["aluminium-like, 50 mm", "permeable, 50 mm", "steel, 10 mm"] {
        for (order, refinement) in [
            (Order::Linear, 1.0),
            (Order::Linear, 1.5),
            (Order::Linear, 2.0),
            (Order::Quadratic, 2.0 / 3.0),
            (Order::Quadratic, 1.0),
            (Order::Quadratic, 4.0 / 3.0),
        ] {
            let clock = std::time::Instant::now();
            let rows = solid(name, order, refinement, bars);
            let errors: Vec<String> = rows.iter().map(|r| format!("{:.2}", 100.0 * r.error())).collect();
            println!(
                "{} {} {} {} {:.1} s",
                rows[0].case,
                rows[0].tets,
                rows[0].unknowns,
                errors.join("  "),
                clock.elapsed().as_secs_f64()
            );
        }
    }
}
