//! Solving for a known field, and the errors of what comes out.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4, centroid, point_at};
use fluxmorph_solver::element::Complex3;
use fluxmorph_solver::element::quadrature::degree_5;
use fluxmorph_solver::linear::{LinearSolver, LinearSolverSettings, Method};
use fluxmorph_solver::recovery::recovered_flux_density;
use fluxmorph_solver::unknowns::PSI;
use fluxmorph_solver::{
    Boundary, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Material, Order,
};

use crate::meshes::Distortion;
use crate::orders::Study;

/// A known field at one point.
pub(crate) struct Sample {
    /// `A` [T m].
    pub(crate) vector_potential: Complex3,
    /// `∇ψ` [T m].
    pub(crate) scalar_gradient: Complex3,
    /// `B = curl A` [T].
    pub(crate) flux_density: Complex3,
    /// `curl ν curl A − ∇ pν div A + jωσ(A + ∇ψ)` [A/m²].
    pub(crate) source: Complex3,
}

/// A field known in closed form, with the problem it solves.
pub(crate) trait KnownField {
    /// Name in the output.
    fn name(&self) -> String;
    /// The field at a point, in the region of the point `inside`.
    fn at(&self, x: Point, inside: Point) -> Sample;
    /// The mesh of the unit cube in `n` cells a side, not distorted.
    fn mesh(&self, n: usize) -> Mesh;
    /// The problem, without a coil.
    fn setup(&self) -> FieldModelSetup;
}

/// A problem without coils and impedance surfaces, with one condition on all six faces.
pub(crate) fn setup(
    frequency: f64,
    penalty: f64,
    materials: Vec<Material>,
    faces: Boundary,
) -> FieldModelSetup {
    FieldModelSetup {
        family: ElementFamily::Nodal,
        frequency,
        penalty,
        materials,
        boundaries: crate::meshes::FACES.map(|face| (face.to_owned(), faces)).to_vec(),
        ..FieldModelSetup::default()
    }
}

/// `jωσ` of every region.
fn eddy(model: &FieldModel) -> Vec<c64> {
    model.materials().iter().map(|m| c64::new(0.0, model.angular_frequency() * m.conductivity)).collect()
}

/// `∫ f·w + ∫_c jωσ(A + ∇ψ)·∇q` of the known field.
///
/// The second term stands in its weak form: it then holds for any current through the conductor's surface, and its sum
/// over all q is zero, as grounding ψ in one node requires.
fn load(field: &impl KnownField, model: &FieldModel, mesh: &Mesh) -> Vec<c64> {
    let (rule, eddy) = (degree_5(), eddy(model));
    let nodal = model.space().family() == ElementFamily::Nodal;
    let topology = mesh.topology();
    let mut load = vec![c64::default(); model.unknown_count()];
    for e in topology.elements() {
        let vertices = mesh.vertices(e);
        let (cell, inside) = (model.space().cell(mesh, e), centroid(vertices));
        let sigma = eddy[topology.region_of()[e.index()].index()];
        for &(bary, weight) in rule {
            let known = field.at(point_at(&vertices, &bary), inside);
            let weight = weight * cell.tet.volume;
            let drive: Complex3 =
                std::array::from_fn(|d| sigma * (known.vector_potential[d] + known.scalar_gradient[d]));
            let carriers = model.space().carriers_of(e);
            let is_psi = |component| nodal && component == PSI;
            model.space().functions(&cell, &bary, &mut |carrier, component, value, _| {
                let source = if is_psi(component) { drive } else { known.source };
                let mut local = [c64::default(); 4];
                local[component] = (0..3).map(|d| weight * value[d] * source[d]).sum();
                model.unknowns().scatter_add(&mut load, carriers[carrier], local);
            });
        }
    }
    load
}

/// Relative errors in L², by quadrature.
struct Errors {
    /// Of `A`.
    vector_potential: f64,
    /// Of `B` in elements.
    flux_density: f64,
    /// Of the recovered `B`, at the centroids of every seventh element.
    recovered: f64,
    /// Of `A + ∇ψ` in conductors; not a number where there are none.
    drive: f64,
}

fn errors(field: &impl KnownField, model: &FieldModel, mesh: &Mesh, solution: &FieldSolution) -> Errors {
    let (rule, eddy) = (degree_5(), eddy(model));
    let topology = mesh.topology();
    let distance = |x: Complex3, y: Complex3| (0..3).map(|d| (x[d] - y[d]).norm_sqr()).sum::<f64>();
    let zero = [c64::default(); 3];
    let mut sums = [[0.0; 2]; 4];
    for e in topology.elements() {
        let vertices = mesh.vertices(e);
        let (tet, inside) = (Tet4::new(vertices), centroid(vertices));
        let conducts = eddy[topology.region_of()[e.index()].index()] != c64::default();
        if e.index() % 7 == 0 {
            let recovered = recovered_flux_density((model, mesh, solution), e, inside);
            let exact = field.at(inside, inside).flux_density;
            sums[3][0] += tet.volume * distance(recovered, exact);
            sums[3][1] += tet.volume * distance(exact, zero);
        }
        for &(bary, weight) in rule {
            let known = field.at(point_at(&vertices, &bary), inside);
            let weight = weight * tet.volume;
            let computed = solution.at(model, mesh, e, &bary);
            let exact_drive = std::array::from_fn(|d| known.vector_potential[d] + known.scalar_gradient[d]);
            let pairs = [
                (computed.vector_potential, known.vector_potential),
                (computed.flux_density, known.flux_density),
                if conducts { (computed.electric_potential, exact_drive) } else { (zero, zero) },
            ];
            for (sum, (computed, exact)) in sums.iter_mut().zip(pairs) {
                sum[0] += weight * distance(computed, exact);
                sum[1] += weight * distance(exact, zero);
            }
        }
    }
    let [vector_potential, flux_density, drive, recovered] = sums.map(|[e, n]| (e / n).sqrt());
    Errors { vector_potential, flux_density, recovered, drive }
}

/// Orders that elements of the degree `n` must reach: `n + 1` in `A` and `n` in its derivatives. The margins of 0.1, and
/// of 5 %, are for meshes that are not yet fine.
fn order_of_b(order: Order) -> f64 {
    0.95 * order.degree() as f64
}
/// Where the gauge leaves `A` open.
pub(crate) const ANY_ORDER_OF_A: f64 = f64::NEG_INFINITY;
pub(crate) const ORDER_OF_A: f64 = 1.9;
pub(crate) const QUADRATIC_ORDER_OF_A: f64 = 2.9;

/// Solves for a known field on distorted cubes of `cells` and asserts the orders of `A` (at least `order_of_a`), `B` and
/// `A + ∇ψ`; returns the order of the recovered `B`.
pub(crate) fn assert_orders(
    field: &impl KnownField,
    distortion: Distortion,
    cells: &[usize],
    order_of_a: f64,
) -> f64 {
    let study = |what: &str| {
        Study::new(format!("{}, {:?}, {distortion:?}: {what}", field.name(), field.setup().order))
    };
    let mut potential = study("A");
    let mut flux_density = study("B");
    let mut recovered = study("recovered B");
    let mut drive = study("A + grad psi");
    for &n in cells {
        let mesh = distortion.apply(&field.mesh(n), n);
        let setup = FieldModelSetup { linear_solver: real_factor(), ..field.setup() };
        let model = FieldModel::new(&mesh, setup).expect("a sound problem");
        let mut system = model.prepare(model.assemble(&mesh)).expect("a definite system");
        let solution =
            model.solve_prepared(&mut system, &load(field, &model, &mesh)).expect("the iteration converges");
        assert_iterations(&model, &solution);
        let found = errors(field, &model, &mesh, &solution);
        let size = 1.0 / n as f64;
        potential.add(size, found.vector_potential);
        flux_density.add(size, found.flux_density);
        recovered.add(size, found.recovered);
        drive.add(size, found.drive);
    }
    let least = order_of_b(field.setup().order);
    potential.assert_order(order_of_a);
    flux_density.assert_order(least);
    if field.setup().frequency > 0.0 {
        drive.assert_order(least);
    }
    // What is fitted to values of second order is at least of first, and so on.
    recovered.assert_order(least);
    recovered.order()
}

/// The method whose iterations theory bounds.
fn real_factor() -> LinearSolverSettings {
    let method = LinearSolver::Fixed(Method::RealFactor);
    LinearSolverSettings { method, ..LinearSolverSettings::default() }
}

/// Two iterations in statics, where the factor is the matrix's own up to rounding; at most 30 for a residual of 1e-11 by the bound of
/// docs/theory.md, (2.13).
fn assert_iterations(model: &FieldModel, solution: &FieldSolution) {
    let limit = if model.angular_frequency() > 0.0 { 30 } else { 2 };
    let iterations = solution.report().iterations;
    println!(
        "    {} unknowns, {iterations} iterations, residual {:.1e}",
        model.unknown_count(),
        solution.report().residual
    );
    assert!(iterations <= limit, "{iterations} iterations");
}

/// The same field, mesh and conditions, turned in space: no face is at right angles to an axis any more.
pub(crate) struct Turned<F>(pub(crate) F);

/// A rotation by three angles.
fn turn(x: [f64; 3]) -> [f64; 3] {
    let about = |x: [f64; 3], axis: usize, angle: f64| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut y = x;
        y[i] = angle.cos() * x[i] - angle.sin() * x[j];
        y[j] = angle.sin() * x[i] + angle.cos() * x[j];
        y
    };
    about(about(about(x, 0, 0.4), 1, -0.7), 2, 1.1)
}

fn turn_back(x: [f64; 3]) -> [f64; 3] {
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(turn);
    columns.map(|c| (0..3).map(|d| c[d] * x[d]).sum())
}

impl<F: KnownField> KnownField for Turned<F> {
    fn name(&self) -> String {
        format!("{}, turned", self.0.name())
    }

    fn at(&self, x: Point, inside: Point) -> Sample {
        let sample = self.0.at(turn_back(x), turn_back(inside));
        let turned = |v: Complex3| -> Complex3 {
            let (re, im) = (turn(v.map(|c| c.re)), turn(v.map(|c| c.im)));
            std::array::from_fn(|d| c64::new(re[d], im[d]))
        };
        Sample {
            vector_potential: turned(sample.vector_potential),
            scalar_gradient: turned(sample.scalar_gradient),
            flux_density: turned(sample.flux_density),
            source: turned(sample.source),
        }
    }

    fn mesh(&self, n: usize) -> Mesh {
        let mesh = Distortion::Random.apply(&self.0.mesh(n), n);
        let points = mesh.points().iter().map(|&p| turn(p)).collect();
        Mesh::new(std::sync::Arc::clone(mesh.topology()), points).expect("a rotation inverts nothing")
    }

    fn setup(&self) -> FieldModelSetup {
        self.0.setup()
    }
}

/// Errors of `A`, `B` and `A + ∇ψ` on one mesh as it is.
pub(crate) fn errors_on(field: &impl KnownField, mesh: &Mesh) -> [f64; 3] {
    let model = FieldModel::new(mesh, field.setup()).expect("a sound problem");
    let mut system = model.prepare(model.assemble(mesh)).expect("a definite system");
    let solution =
        model.solve_prepared(&mut system, &load(field, &model, mesh)).expect("the iteration converges");
    let found = errors(field, &model, mesh, &solution);
    [found.vector_potential, found.flux_density, found.drive]
}
