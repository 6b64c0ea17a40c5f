//! The open shell against fields that reach to infinity: a magnetised sphere, and a circular coil.
//!
//! The mesh ends at 1.5 times the size of the source; the shell is all there is beyond.

use std::f64::consts::PI;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{
    BlockParameters, OpenShellParameters, SphereParameters, block, open_shell, sphere,
};
use fluxmorph_geometry::tet4::{Point, volume};
use fluxmorph_geometry::{ElementId, Mesh};
use fluxmorph_solver::coil::{Coil, Frame, Racetrack};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{
    Boundary, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Functional, Material, OpenRegion,
    Order, UniformField,
};

use crate::{ALL, solved};

fn with_shell(mesh: &Mesh, surfaces: &[&str], layers: usize) -> Mesh {
    let parameters = OpenShellParameters {
        surfaces: surfaces.iter().map(|&s| s.to_owned()).collect(),
        centre: [0.0; 3],
        layers,
        region: "open".to_owned(),
        outer: "infinity".to_owned(),
    };
    open_shell(mesh, &parameters).expect("a shell")
}

fn setup(mesh: &Mesh, (family, order): (ElementFamily, Order)) -> FieldModelSetup {
    let region = mesh.topology().region("open").expect("the shell");
    let conditions = [
        ("x_min", Boundary::FluxParallel),
        ("y_min", Boundary::FluxParallel),
        ("z_min", Boundary::FluxNormal),
        ("infinity", Boundary::FluxParallel),
    ];
    FieldModelSetup {
        family,
        order,
        materials: vec![Material::AIR; mesh.topology().region_names().len()],
        boundaries: conditions.map(|(name, condition)| (name.to_owned(), condition)).to_vec(),
        open: Some(OpenRegion { region, centre: [0.0; 3] }),
        ..FieldModelSetup::default()
    }
}

/// The energy [J] in regions.
fn energy(model: &FieldModel, mesh: &Mesh, solution: &FieldSolution, regions: &[&str]) -> f64 {
    let of = |name: &&str| {
        let region = mesh.topology().region(name).expect("a region");
        let functional = Functional::energy(model, Some(region)).expect("an energy");
        functional.evaluate((model, mesh, solution)).expect("finite").value
    };
    regions.iter().map(of).sum()
}

fn b_z(model: &FieldModel, mesh: &Mesh, solution: &FieldSolution, point: Point) -> f64 {
    probe((model, mesh, solution), "probe", &[point]).expect("inside the mesh")[0][2].re
}

/// Deviations of the energies outside and inside a sphere of uniform remanence.
fn magnetised_sphere(elements: (ElementFamily, Order), divisions: usize, layers: usize) -> [f64; 2] {
    let radius = 0.05;
    let parameters =
        SphereParameters { radius, outer_radius: 1.5 * radius, divisions, ..SphereParameters::default() };
    let mesh = with_shell(&sphere(&parameters).expect("a sphere"), &["outer"], layers);
    let mut setup = setup(&mesh, elements);
    let magnet = mesh.topology().region("sphere").expect("the magnet");
    setup.remanence = vec![[0.0; 3]; 3];
    setup.remanence[magnet.index()] = [0.0, 0.0, 1.0];
    let (model, solution) = solved(&mesh, setup);
    let meshed: f64 =
        mesh.topology().elements_of(magnet).into_iter().map(|e: ElementId| volume(mesh.vertices(e))).sum();
    // ½ν|B_r/3|² inside, twice as much outside; facets take some of the sphere's volume.
    let inside = 0.5 / VACUUM_PERMEABILITY / 9.0 * meshed;
    [
        energy(&model, &mesh, &solution, &["air", "open"]) / (2.0 * inside) - 1.0,
        energy(&model, &mesh, &solution, &["sphere"]) / inside - 1.0,
    ]
}

/// `B_z` [T] on the axis of a circular coil of a square winding, by filaments.
fn on_axis(radius: f64, width: f64, z: f64) -> f64 {
    let n = 40;
    let place = |i: usize| ((i as f64 + 0.5) / n as f64 - 0.5) * width;
    let filament = |a: f64, z: f64| VACUUM_PERMEABILITY * a * a / (2.0 * (a * a + z * z).powf(1.5));
    let pairs = (0..n).flat_map(|i| (0..n).map(move |j| (place(i), place(j))));
    pairs.map(|(r, h)| filament(radius + r, z - h)).sum::<f64>() / (n * n) as f64
}

/// What a mesh fills.
#[derive(Clone, Copy, Debug)]
enum Inside {
    Ball,
    Box,
    Cylinder,
}

/// A mesh of a size with a shell around it.
fn inside(shape: Inside, size: f64, n: usize, layers: usize) -> Mesh {
    if let Inside::Ball = shape {
        let (radius, outer_radius) = (size / 1.5, size);
        let parameters =
            SphereParameters { radius, outer_radius, divisions: n, ..SphereParameters::default() };
        return with_shell(&sphere(&parameters).expect("a ball"), &["outer"], layers);
    }
    let mesh = block(&BlockParameters { size: [size; 3], cells: [n; 3] }).expect("a box");
    // Squares around the axis become circles.
    let into_circles = |&[x, y, _]: &Point| {
        let shrink = x.max(y) / x.hypot(y).max(f64::MIN_POSITIVE) - 1.0;
        if let Inside::Cylinder = shape { [shrink * x, shrink * y, 0.0] } else { [0.0; 3] }
    };
    let motion: Vec<Point> = mesh.points().iter().map(into_circles).collect();
    with_shell(&mesh.moved(&motion).expect("circles"), &["x_max", "y_max", "z_max"], layers)
}

/// Deviation of `B_z` on the axis near the end of the mesh.
fn coil(elements: (ElementFamily, Order), shape: Inside, n: usize, layers: usize) -> f64 {
    let (radius, width) = (0.04, 0.02);
    let size = 1.5 * 0.05;
    let inside = inside(shape, size, n, layers);
    let frame = Frame::new([0.0; 3], [0.0, 0.0, 1.0], None).expect("a frame");
    let circular = Racetrack::circular(frame, radius - 0.5 * width, width, width).expect("a coil");
    let mut setup = setup(&inside, elements);
    setup.coils =
        vec![Coil { name: "coil".to_owned(), ampere_turns: c64::from(1.0), shape: circular.into() }];
    let (model, solution) = solved(&inside, setup);
    let z = 0.95 * size;
    b_z(&model, &inside, &solution, [0.0, 0.0, z]) / on_axis(radius, width, z) - 1.0
}

/// The field outside of a permeable sphere and a pair of circular coils of 1 A at ±`height`, by their filaments: `c_n` of `H_z =
/// Σ (n + 1) c_n/zⁿ⁺²` on the axis. Every harmonic `b_n rⁿ P_n` of what is applied to the sphere has the answer
/// `n (μ − 1)/(n μ + n + 1) b_n R^(2n+1)/r^(n+1) P_n`; those of even degree cancel between the coils.
fn exterior_harmonics(
    sphere_radius: f64,
    permeability: f64,
    [radius, width, height]: [f64; 3],
) -> Vec<(f64, f64)> {
    let parts = 20;
    let place = |i: usize| ((i as f64 + 0.5) / parts as f64 - 0.5) * width;
    let filaments = (0..parts).flat_map(|i| (0..parts).map(move |j| (radius + place(i), height + place(j))));
    let mut harmonics: Vec<(f64, f64)> = (0..60).map(|k| (f64::from(2 * k + 1), 0.0)).collect();
    for (a, h) in filaments {
        let c = a.hypot(h);
        // P_k′ of the cosine by its recurrence.
        let (mut before, mut slope) = (0.0, 1.0);
        for k in 1..120 {
            let (degree, x) = (f64::from(k), h / c);
            if k % 2 == 1 {
                let answer = degree * (permeability - 1.0) / (degree * permeability + degree + 1.0);
                let applied = (a / c).powi(2) * slope / (degree * c.powi(k));
                let own = a * a * c.powi(k - 1) * slope / (degree + 1.0);
                let all = own + answer * applied * sphere_radius.powi(2 * k + 1);
                harmonics[k as usize / 2].1 += all / f64::from(parts as u32).powi(2);
            }
            (before, slope) = (slope, ((2.0 * degree + 1.0) * x * slope - (degree + 1.0) * before) / degree);
        }
    }
    harmonics
}

/// Deviations of the energy beyond a ball of 1.5 times the size of a permeable sphere between two coils, and of `B_z` near its end.
fn sphere_between_coils(elements: (ElementFamily, Order), divisions: usize) -> [f64; 2] {
    let (radius, permeability, winding) = (0.05, 4.0, [0.06, 0.01, 0.03]);
    let size = 1.5 * 0.07;
    let parameters =
        SphereParameters { radius, outer_radius: size, divisions, ..SphereParameters::default() };
    let mesh = with_shell(&sphere(&parameters).expect("a sphere"), &["outer"], 4);
    let frame = Frame::new([0.0, 0.0, winding[2]], [0.0, 0.0, 1.0], None).expect("a frame");
    let inner = winding[0] - 0.5 * winding[1];
    let circular = Racetrack::circular(frame, inner, winding[1], winding[1]).expect("a coil");
    let mut setup = setup(&mesh, elements);
    let iron = mesh.topology().region("sphere").expect("the sphere");
    setup.materials[iron.index()].relative_permeability = permeability;
    setup.coils =
        vec![Coil { name: "coil".to_owned(), ampere_turns: c64::from(1.0), shape: circular.into() }];
    let (model, solution) = solved(&mesh, setup);
    // Facets take some of a ball's volume.
    let ball = |names: &[&str]| {
        let regions = names.iter().map(|name| mesh.topology().region(name).expect("a region"));
        let elements = regions.flat_map(|region| mesh.topology().elements_of(region));
        (elements.map(|e: ElementId| volume(mesh.vertices(e))).sum::<f64>() * 6.0 / PI).cbrt()
    };
    let harmonics = exterior_harmonics(ball(&["sphere"]), permeability, winding);
    let end = ball(&["sphere", "air"]);
    // ½μ₀ ∮ Ω ∂_rΩ over an eighth of a sphere.
    let term = |&(n, c): &(f64, f64)| (n + 1.0) / (2.0 * n + 1.0) * c * c / end.powf(2.0 * n + 1.0);
    let beyond = 0.25 * PI * VACUUM_PERMEABILITY * harmonics.iter().map(term).sum::<f64>();
    let z = 0.95 * size;
    let along = |&(n, c): &(f64, f64)| (n + 1.0) * c / z.powf(n + 2.0);
    let on_axis = VACUUM_PERMEABILITY * harmonics.iter().map(along).sum::<f64>();
    [
        energy(&model, &mesh, &solution, &["open"]) / beyond - 1.0,
        b_z(&model, &mesh, &solution, [0.0, 0.0, z]) / on_axis - 1.0,
    ]
}

/// `½∫ν|B|²` outside the magnet is twice that inside: to 1 % with linear elements, to 0.2 % with quadratic ones. The energy
/// inside is that of the mesh in the magnet, which a coarse one misses by more.
#[test]
fn the_exterior_energy_of_a_magnetised_sphere_is_that_of_a_dipole() {
    for (elements, bound, inside) in
        [(ALL[0], 0.01, 0.1), (ALL[2], 0.01, 0.05), (ALL[1], 0.002, 0.002), (ALL[3], 0.002, 0.002)]
    {
        let [exterior, interior] = magnetised_sphere(elements, 6, 4);
        assert!(exterior.abs() < bound && interior.abs() < inside, "{elements:?}: {exterior} {interior}");
    }
}

/// At 0.95 of the way to the end of the mesh the field on the axis is that of the coil alone, in a ball, a box and a cylinder: to
/// 0.2 %, at 1.4 times the coil's size.
#[test]
fn the_field_of_a_coil_does_not_feel_the_end_of_the_mesh() {
    for shape in [Inside::Ball, Inside::Box, Inside::Cylinder] {
        let deviation = coil(ALL[3], shape, 8, 3);
        println!("{shape:?}: {deviation:.2e}");
        assert!(deviation.abs() < 0.002, "{shape:?}: {deviation}");
    }
}

/// A sphere in the field that coils apply to it: the energy beyond the mesh is that of both to 1 % with linear elements, and with
/// quadratic ones to 0.2 %. So is the field of these at its end to 0.3 %, in layers of 14 mm there, whatever the cells along them.
/// At one point linear elements may be half a cell off, over which the field falls by 16 %.
#[test]
fn the_field_of_a_sphere_between_coils_does_not_feel_the_end_of_the_mesh() {
    for (elements, divisions, bounds) in [
        (ALL[0], 14, [0.01, 0.16]),
        (ALL[2], 14, [0.01, 0.16]),
        (ALL[1], 10, [0.002, 0.003]),
        (ALL[3], 10, [0.002, 0.003]),
    ] {
        let found = sphere_between_coils(elements, divisions);
        println!("{elements:?}: energy {:.2e}, field {:.2e}", found[0], found[1]);
        assert!((0..2).all(|k| found[k].abs() < bounds[k]), "{elements:?}: {found:?}");
    }
}

#[test]
fn what_open_space_cannot_hold_is_refused() {
    let inside = block(&BlockParameters { size: [0.075; 3], cells: [2; 3] }).expect("a box");
    let mesh = with_shell(&inside, &["x_max", "y_max", "z_max"], 2);
    let refusal = |change: &dyn Fn(&mut FieldModelSetup)| {
        let mut setup = setup(&mesh, ALL[0]);
        change(&mut setup);
        FieldModel::new(&mesh, setup).expect_err("it is no open space").to_string()
    };
    let steel = Material { relative_permeability: 800.0, conductivity: 0.0 };
    let matter = refusal(&|setup| setup.materials[1] = steel);
    assert!(matter.contains("`open` holds a material other than air"), "{matter}");
    let field = UniformField { flux_density: [0.0, 0.0, 1.0], centre: None };
    let applied = refusal(&|setup| setup.boundaries[3].1 = Boundary::UniformField(field));
    assert!(applied.contains("a uniform field applied outside"), "{applied}");
    let folded = refusal(&|setup| setup.open.as_mut().expect("open").centre = [0.2; 3]);
    assert!(folded.contains("cannot be open space: at"), "{folded}");
}
