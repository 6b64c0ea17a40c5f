//! Conducting, permeable spheres in a uniform field, solid and hollow, against the closed forms of
//! `tests/reference/sphere.json`.
//!
//! An octant: the field is along z, so the planes x and y hold it (flux-parallel) and z = 0 is crossed at right angles
//! (flux-normal). The applied potential is prescribed on the outer sphere of eight radii; it leaves out the reaction of the
//! sphere there, whose dipole is then mirrored: an error of about two thousandths of the sphere's field. The thin-skinned
//! steel is computed with layers in its skin and as an impedance surface.

use fluxmorph_geometry::generate::{SphereParameters, sphere};
use fluxmorph_geometry::tet4::{Point, norm};
use fluxmorph_geometry::{ElementId, Mesh};
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModel, FieldModelSetup, Functional, Material, Order, SurfaceLaw,
    UniformField, adjoint,
};
use serde_json::Value;

use super::rows::{Case, Row, assert_rows};
use crate::orders::Study;
use crate::references::{complex, material, named, number, reference};

/// Outer radius over that of the sphere.
pub(super) const BOX: f64 = 8.0;

/// Conditions of an octant in the unit field along z.
pub(super) fn setup(mesh: &Mesh, frequency: f64, material: Material, order: Order) -> FieldModelSetup {
    let of = |name: &str| if name == "sphere" { material } else { Material::AIR };
    let applied = UniformField { flux_density: [0.0, 0.0, 1.0], centre: None };
    let boundaries = [
        ("x_min", Boundary::FluxParallel),
        ("y_min", Boundary::FluxParallel),
        ("z_min", Boundary::FluxNormal),
        ("outer", Boundary::UniformField(applied)),
    ];
    FieldModelSetup {
        family: ElementFamily::Nodal,
        frequency,
        order,
        materials: mesh.topology().region_names().iter().map(|name| of(name)).collect(),
        boundaries: boundaries.map(|(name, condition)| (name.to_owned(), condition)).to_vec(),
        ..FieldModelSetup::default()
    }
}

/// A solid sphere of the reference file on a mesh.
struct Solid {
    data: Value,
    radius: f64,
    mesh: Mesh,
    model: FieldModel,
}

impl Solid {
    fn new(name: &str, order: Order, refinement: f64) -> Self {
        let file = reference("sphere.json");
        let data = named(&file["spheres"], name).clone();
        let radius = number(&data, "radius_m");
        let material = material(&data);
        let frequency = number(&file, "frequency_Hz");
        let skin_depth = material.skin_depth(std::f64::consts::TAU * frequency).expect("it conducts");
        let mesh = sphere(&parameters(radius, skin_depth, refinement)).expect("a sound sphere");
        let setup = setup(&mesh, frequency, material, order);
        let model = FieldModel::new(&mesh, setup).expect("a sound problem");
        Self { data, radius, mesh, model }
    }

    fn loss(&self) -> Functional {
        Functional::loss(&self.model, "sphere").expect("the sphere conducts")
    }

    /// `|loss − exact| / exact`, with the exact loss inside the finite outer sphere: there the dipole is mirrored, the
    /// field is `1/(1 + 2 D/R_o³)` of that in open space.
    fn loss_error(&self) -> f64 {
        let (solution, _) = self.model.solve(&self.mesh).expect("it converges");
        let value = self.loss().evaluate((&self.model, &self.mesh, &solution)).expect("a finite loss").value;
        let dipole = complex(&self.data["dipole_T_m3"]);
        let scale = (1.0 / (1.0 + 2.0 * dipole / (BOX * self.radius).powi(3))).norm_sqr();
        (8.0 * value / (scale * number(&self.data, "loss_W")) - 1.0).abs()
    }
}

/// Rows of one solid sphere on a mesh: centre, outside on axis and equator, loss, and the derivative of the loss by the
/// radius.
pub(crate) fn solid(name: &str, order: Order, refinement: f64, bars: [f64; 3]) -> Vec<Row> {
    let sphere = Solid::new(name, order, refinement);
    let Solid { data, radius, mesh, model } = &sphere;
    let (solution, mut system) = model.solve(mesh).expect("it converges");
    let case = Case::new(format!("sphere, {name}, {order:?}"), mesh, model);
    let at =
        |point: Point| probe((model, mesh, &solution), name, &[point]).expect("a point of the mesh")[0][2];
    let dipole = complex(&data["dipole_T_m3"]);
    let far = 1.5 * radius;
    let [field_bar, loss_bar, derivative_bar] = bars;
    let value = sphere.loss().evaluate((model, mesh, &solution)).expect("a finite loss");
    let lambda = adjoint::solve(&mut system, &value.derivative).expect("it converges");
    let moving: Vec<ElementId> = mesh.topology().elements().collect();
    let implicit = adjoint::node_gradient((model, mesh, &solution), &lambda, &moving).expect("one process");
    let explicit = value.explicit.expect("a loss of a region that moves");
    let derivative: f64 = mesh
        .topology()
        .nodes()
        .map(|n| {
            let velocity = growth(mesh.point(n), *radius);
            (0..3).map(|d| velocity[d] * (implicit[n.index()][d] + explicit[n.index()][d])).sum::<f64>()
        })
        .sum();
    vec![
        case.row("B at the centre [T]", at([0.0; 3]), complex(&data["centre_T"]), field_bar),
        case.row("B outside, axis [T]", at([0.0, 0.0, far]), 1.0 + 2.0 * dipole / far.powi(3), field_bar),
        case.row("B outside, equator [T]", at([far, 0.0, 0.0]), 1.0 - dipole / far.powi(3), field_bar),
        case.row("loss [W]", (8.0 * value.value).into(), number(data, "loss_W").into(), loss_bar),
        case.row(
            "dP/dR [W/m]",
            (8.0 * derivative).into(),
            number(data, "loss_per_radius_W_per_m").into(),
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

/// Layers under the surface from a third of the skin depth, growing by half up to 0.7 of it, down to 0.8 of the radius:
/// what is left of the field at the centre of a thin-skinned sphere has gone through all of them.
fn parameters(radius: f64, skin_depth: f64, refinement: f64) -> SphereParameters {
    let (mut skin, mut layer) = (Vec::new(), skin_depth / 3.0);
    let mut depth = layer;
    while depth < 0.8 * radius {
        skin.push(depth);
        layer = (1.5 * layer).min(0.7 * skin_depth);
        depth += layer;
    }
    SphereParameters { skin, ..coarse(radius, refinement) }
}

/// A sphere without layers.
pub(super) fn coarse(radius: f64, refinement: f64) -> SphereParameters {
    let outer_radius = BOX * radius;
    SphereParameters {
        radius,
        outer_radius,
        divisions: 6,
        growth: 1.35,
        refinement,
        ..SphereParameters::default()
    }
}

/// The cavity field of a hollow sphere.
pub(crate) fn hollow(order: Order, refinement: f64, bar: f64) -> Vec<Row> {
    let file = reference("sphere.json");
    let data = &file["hollow"];
    let radius = number(data, "outer_radius_m");
    let material = material(data);
    let inner_radius = Some(number(data, "inner_radius_m"));
    let mesh = sphere(&SphereParameters { inner_radius, wall_layers: 3, ..coarse(radius, refinement) })
        .expect("a sound sphere");
    let frequency = number(&file, "frequency_Hz");
    let model = FieldModel::new(&mesh, setup(&mesh, frequency, material, order)).expect("a sound problem");
    let (solution, _) = model.solve(&mesh).expect("it converges");
    let b = probe((&model, &mesh, &solution), "cavity", &[[0.0; 3]]).expect("a point of the mesh")[0][2];
    let case = Case::new(format!("hollow sphere, {order:?}"), &mesh, &model);
    vec![case.row("B in the cavity [T]", b, complex(&data["cavity_T"]), bar)]
}

/// The thin-skinned steel as an impedance surface: loss and the field outside.
pub(crate) fn impedance(order: Order, refinement: f64, bars: [f64; 2]) -> Vec<Row> {
    let file = reference("sphere.json");
    let data = named(&file["spheres"], "steel, 10 mm");
    let radius = number(data, "radius_m");
    let material = material(data);
    let frequency = number(&file, "frequency_Hz");
    let full =
        sphere(&SphereParameters { divisions: 8, ..coarse(radius, refinement) }).expect("a sound sphere");
    let region = full.topology().region("sphere").expect("the generator makes it");
    let (mesh, surface) = full.without_region(region).expect("air is left");
    let conductor = Conductor { name: "sphere".to_owned(), surface, law: SurfaceLaw::Impedance(material) };
    let setup = FieldModelSetup {
        family: ElementFamily::Nodal,
        conductors: vec![conductor],
        ..setup(&mesh, frequency, Material::AIR, order)
    };
    let model = FieldModel::new(&mesh, setup).expect("a sound problem");
    let (solution, _) = model.solve(&mesh).expect("it converges");
    let case = Case::new(format!("sphere, steel, impedance surface, {order:?}"), &mesh, &model);
    let far = 1.5 * radius;
    let b = probe((&model, &mesh, &solution), "axis", &[[0.0, 0.0, far]]).expect("a point of the mesh")[0][2];
    let loss: f64 = solution.losses(&model, &mesh).iter().map(|(_, loss)| 8.0 * loss).sum();
    let dipole = complex(&data["dipole_T_m3"]);
    vec![
        case.row("B outside, axis [T]", b, 1.0 + 2.0 * dipole / far.powi(3), bars[0]),
        case.row("loss [W]", loss.into(), number(data, "loss_W").into(), bars[1]),
    ]
}

/// A sphere with the remanence `B_r` and a straight recoil line of the permeability `μ_rec`, `B = μ0 μ_rec H + B_r`: the field of a
/// sphere demagnetises it with `H = −B/(2 μ0)`, so that `B = 2 B_r/(2 + μ_rec)` inside, a dipole outside.
pub(crate) fn magnet(order: Order, refinement: f64, recoil: f64, bar: f64) -> Vec<Row> {
    let radius = 0.01;
    let mesh = sphere(&coarse(radius, refinement)).expect("a sound sphere");
    let remanence = 1.2;
    let of = |name: &String| if name == "sphere" { [0.0, 0.0, remanence] } else { [0.0; 3] };
    let mut setup = setup(&mesh, 0.0, Material { relative_permeability: recoil, ..Material::AIR }, order);
    setup.remanence = mesh.topology().region_names().iter().map(of).collect();
    // Nothing is applied: the outer sphere is a flux surface, far away.
    setup.boundaries.retain(|(name, _)| name != "outer");
    setup.boundaries.push(("outer".to_owned(), Boundary::FluxParallel));
    let model = FieldModel::new(&mesh, setup).expect("a sound problem");
    let (solution, _) = model.solve(&mesh).expect("it converges");
    let at = |point: Point| {
        probe((&model, &mesh, &solution), "magnet", &[point]).expect("a point of the mesh")[0][2]
    };
    let name = match recoil {
        1.0 => format!("magnetised sphere, {order:?}"),
        _ => format!("magnetised sphere, recoil permeability {recoil}, {order:?}"),
    };
    let case = Case::new(name, &mesh, &model);
    let (far, inside) = (2.0 * radius, 2.0 * remanence / (2.0 + recoil));
    // The dipole's Bz = B (R/z)³ on the axis.
    vec![
        case.row("B at the centre [T]", at([0.0; 3]), inside.into(), bar),
        case.row("B outside, axis [T]", at([0.0, 0.0, far]), (inside / 8.0).into(), bar),
    ]
}

/// The rows of the table.
pub(crate) fn rows() -> Vec<Row> {
    let mut rows = quick_rows();
    rows.extend(solid("steel, 10 mm", Order::Quadratic, 1.0, [0.05, 0.05, 0.03]));
    rows.extend(impedance(Order::Linear, 2.0, [0.02, 0.05]));
    rows.extend(hollow(Order::Linear, 2.0, 0.02));
    rows
}

/// Solid spheres that need no layers in a thin skin.
const SPHERES: [&str; 2] = ["aluminium-like, 50 mm", "permeable, 50 mm"];

/// Five rows for each of [`SPHERES`], then the others.
fn quick_rows() -> Vec<Row> {
    let solids = SPHERES.map(|name| solid(name, Order::Quadratic, 1.0, [0.02, 0.03, 0.03]));
    let mut rows = solids.concat();
    rows.extend(hollow(Order::Quadratic, 1.0, 0.02));
    // Flat faces enclose less magnet than the sphere: the field outside is too small.
    rows.extend(magnet(Order::Quadratic, 4.0 / 3.0, 1.0, 0.025));
    // As of AlNiCo, whose recoil line is the steepest.
    rows.extend(magnet(Order::Quadratic, 4.0 / 3.0, 3.6, 0.025));
    rows
}

/// And quadratic elements are at least four times as exact as linear ones on the same mesh.
#[test]
fn fields_losses_and_their_derivative_by_the_radius_are_the_closed_forms() {
    let rows = quick_rows();
    assert_rows(&rows);
    for (name, quadratic) in SPHERES.into_iter().zip(rows.chunks_exact(5)) {
        let linear = solid(name, Order::Linear, 1.0, [f64::INFINITY; 3]);
        for row in [0, 3] {
            let gain = linear[row].error() / quadratic[row].error();
            println!("{name}: {gain} times");
            assert!(gain > 4.0, "{gain}: {linear:?} {quadratic:?}");
        }
    }
}

#[test]
#[ignore = "minutes: just test-long"]
fn thin_skinned_and_finer_spheres_are_the_closed_forms() {
    assert_rows(&rows());
}

/// Facets inside a sphere leave out a volume of second order, so second order is expected of linear elements and of
/// quadratic ones on straight sides alike.
fn assert_convergence(name: &str, order: Order, refinements: [f64; 3], least: f64) {
    let mut loss = Study::new(format!("sphere, {name}, {order:?}: loss"));
    for refinement in refinements {
        loss.add(1.0 / refinement, Solid::new(name, order, refinement).loss_error());
    }
    loss.assert_order(least);
}

/// Coarse meshes, whose order is still on its way to two.
#[test]
fn the_loss_of_a_sphere_converges() {
    for name in SPHERES {
        assert_convergence(name, Order::Linear, [0.5, 1.0, 2.0], 1.6);
        assert_convergence(name, Order::Quadratic, [1.0 / 3.0, 0.5, 1.0], 1.8);
    }
}

#[test]
#[ignore = "minutes: just test-long"]
fn the_loss_of_a_sphere_converges_with_second_order_on_fine_meshes() {
    for name in SPHERES {
        assert_convergence(name, Order::Linear, [1.0, 2.0, 3.0], 1.8);
    }
}
