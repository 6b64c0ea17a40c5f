//! What impedance surfaces leave out: at the edges of a bar, against the bar meshed, where a cylinder is round, against its Bessel
//! functions, and below a current near a plane, against the waves that its field is made of.
//!
//! A quarter of a bar of 10 by 10 mm across the field of two opposite currents beside it, one cell along them; a quarter of a cylinder in
//! the same field, and in one along its axis; half a plane below a flat current.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::Grid;
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::audit::{ExcessLoss, excess_losses};
use fluxmorph_solver::coil::{Coil, Path, RegionCurrent};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModelSetup, Material, Order, SurfaceLaw, UniformField,
};

use crate::{flux_parallel, painted, solved, terminal};

/// Half the width of the bar [m].
const HALF: f64 = 5e-3;

/// Planes of the quarter, and what is around it.
const WALLS: [&str; 5] = ["x_min", "x_max", "y_max", "z_min", "z_max"];

/// [Hz]
const FREQUENCY: f64 = 1e3;

/// The bar and its surroundings, in cells of `finest` [m] at its surface that grow by a factor.
fn bar(finest: f64, growth: f64) -> Mesh {
    let mut inward = vec![HALF];
    let mut outward = vec![HALF];
    let mut size = finest;
    while inward[inward.len() - 1] > 1.5 * size {
        inward.push(inward[inward.len() - 1] - size);
        size *= growth;
    }
    inward.push(0.0);
    size = finest;
    // Up to the coil, through it and up to the walls.
    for (to, largest) in [(20e-3, 2e-3), (24e-3, 2e-3), (80e-3, 8e-3)] {
        while outward[outward.len() - 1] + 1.5 * size < to {
            outward.push(outward[outward.len() - 1] + size);
            size = (size * growth).min(largest);
        }
        outward.push(to);
    }
    let line: Vec<f64> = inward.into_iter().rev().chain(outward.into_iter().skip(1)).collect();
    let paint = |[x, y, _]: [f64; 3]| match (x, y) {
        _ if x < HALF && y < HALF => 1,
        _ if (20e-3..24e-3).contains(&x) && y < 24e-3 => 2,
        _ => 0,
    };
    painted([line.clone(), line, vec![0.0, 2e-3]], &["air", "bar", "coil"], paint)
}

/// Two opposite currents beside the axis, between walls.
fn across(mesh: &Mesh, order: Order, walls: &[&str]) -> FieldModelSetup {
    let elements = mesh.topology().elements_of(mesh.topology().region("coil").expect("a region"));
    let path = Path::Terminals { from: terminal(mesh, "z_min"), to: terminal(mesh, "z_max") };
    let current = RegionCurrent::new(mesh, "coil", &elements, &path).expect("a current");
    let mut boundaries = flux_parallel(walls);
    boundaries.push(("y_min".to_owned(), Boundary::FluxNormal));
    FieldModelSetup {
        family: ElementFamily::Edge,
        order,
        frequency: FREQUENCY,
        materials: vec![Material::AIR; 3],
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns: 1e3.into(), shape: current.into() }],
        boundaries,
        ..FieldModelSetup::default()
    }
}

fn material(skin_depth: f64, relative_permeability: f64) -> Material {
    let permeability = VACUUM_PERMEABILITY * relative_permeability;
    let omega = 2.0 * std::f64::consts::PI * FREQUENCY;
    Material { relative_permeability, conductivity: 2.0 / (omega * permeability * skin_depth * skin_depth) }
}

/// Loss [W] of the bar meshed in second order.
fn meshed(material: Material, finest: f64) -> f64 {
    let mesh = bar(finest, 1.35);
    let materials = vec![Material::AIR, material, Material::AIR];
    let (model, solution) =
        solved(&mesh, FieldModelSetup { materials, ..across(&mesh, Order::Quadratic, &WALLS) });
    solution.losses(&model, &mesh)[0].1
}

/// What its impedance surface leaves out.
fn replaced(mesh: &Mesh, material: Material, setup: impl FnOnce(&Mesh) -> FieldModelSetup) -> ExcessLoss {
    let (mesh, surface) = mesh.without_region(RegionId(1)).expect("what is left");
    let law = SurfaceLaw::Impedance(material);
    let conductors = vec![Conductor { name: "bar".to_owned(), surface, law }];
    let (model, solution) = solved(&mesh, FieldModelSetup { conductors, ..setup(&mesh) });
    let mut found = excess_losses((&model, &mesh, &solution));
    assert_eq!(found.len(), 1);
    found.remove(0)
}

/// Beyond what edges have more, the surface itself is off by the skin depth over the size of the bar: of iron most of the rest.
#[test]
fn what_edges_have_more_is_what_a_meshed_bar_has_more() {
    for (skin_depth, permeability, tolerance) in
        [(0.3e-3, 1.0, 0.15), (1e-3, 1.0, 0.15), (0.5e-3, 4.0, 0.15), (0.2e-3, 30.0, 0.35)]
    {
        let material = material(skin_depth, permeability);
        let meshed = meshed(material, 0.25 * skin_depth);
        let [second, first, coarse] =
            [(Order::Quadratic, 1e-3), (Order::Linear, 0.3e-3), (Order::Linear, 1e-3)].map(
                |(order, finest)| replaced(&bar(finest, 1.35), material, |mesh| across(mesh, order, &WALLS)),
            );
        let share = |own: &ExcessLoss| own.share();
        let (found, true_share) = (share(&second), meshed / second.of_surface - 1.0);
        let case = format!("skin of {skin_depth} m, permeability {permeability}");
        println!(
            "{case}: {found:.4} of {true_share:.4}; in first order {:.4}, {:.4}",
            share(&first),
            share(&coarse)
        );
        assert!((found / true_share - 1.0).abs() < tolerance, "{case}: {found:.4} of {true_share:.4}");
        // First order has a tenth too much loss on the coarser mesh, most of it at the edge.
        for other in [first, coarse] {
            assert!((share(&other) / found - 1.0).abs() < 0.12, "{case}: {:.4}, {found:.4}", share(&other));
        }
    }
}

/// A quarter of a cylinder with this radius [m] in so many facets, and its surroundings.
fn cylinder(radius: f64, facets: usize) -> Mesh {
    cylinder_of_layers(&[0.5 * radius], radius, facets)
}

/// The same with nodes at these radii inside.
fn cylinder_of_layers(inside: &[f64], radius: f64, facets: usize) -> Mesh {
    let mut rho = inside.to_vec();
    (0..=24).for_each(|k| rho.push(radius * 1.12_f64.powi(k)));
    let phi = (0..=facets).map(|k| std::f64::consts::FRAC_PI_2 * k as f64 / facets as f64).collect();
    let coil = 1.12_f64.powi(12) * radius..1.12_f64.powi(14) * radius;
    let paint = |[rho, phi, _]: [f64; 3]| match (rho, phi) {
        _ if rho < radius => 1,
        _ if coil.contains(&rho) && phi < 0.5 => 2,
        _ => 0,
    };
    let grid = Grid::new("cylinder", [rho, phi, vec![0.0, 0.2 * radius]]).expect("ascending lines");
    let topology = grid.topology(&["air", "bar", "coil"], |x| RegionId(paint(x))).expect("a grid conforms");
    let polar = |[rho, phi, z]: [f64; 3]| [rho * phi.cos(), rho * phi.sin(), z];
    Mesh::new(Arc::new(topology), grid.points().into_iter().map(polar).collect())
        .expect("cells have a volume")
}

/// `I₀` and `I₁`, by their series.
fn modified_bessel(z: c64) -> [c64; 2] {
    let square = 0.25 * z * z;
    let (mut term, mut sums) = (c64::new(1.0, 0.0), [c64::default(); 2]);
    for k in 0..100 {
        let n = f64::from(k + 1);
        sums[0] += term;
        sums[1] += 0.5 * z * term / n;
        term *= square / (n * n);
    }
    sums
}

/// A field along the axis, in which the current runs around the cylinder.
fn along(mesh: &Mesh) -> FieldModelSetup {
    let field = UniformField { flux_density: [0.0, 0.0, 1e-3], centre: None };
    let mut boundaries = flux_parallel(&["y_min", "y_max"]);
    boundaries.extend(["z_min", "z_max"].map(|name| (name.to_owned(), Boundary::FluxNormal)));
    boundaries.push(("x_max".to_owned(), Boundary::UniformField(field)));
    let materials = vec![Material::AIR; mesh.topology().region_names().len()];
    FieldModelSetup {
        family: ElementFamily::Edge,
        frequency: FREQUENCY,
        materials,
        boundaries,
        ..FieldModelSetup::default()
    }
}

/// The terms beyond the first are of the square of skin depth over radius.
#[test]
fn what_round_surfaces_have_more_begins_as_the_quotient_of_bessel_functions() {
    let radius = 10e-3;
    for skin_depth in [0.25e-3, 0.5e-3, 1e-3] {
        let material = material(skin_depth, 1.0);
        let [i0, i1] = modified_bessel(c64::new(1.0, 1.0) * radius / skin_depth);
        let of = |quotient: c64| (c64::new(1.0, 1.0) * quotient).re - 1.0;
        let tolerance = 0.4 * (skin_depth / radius).powi(2);
        // Facets on a round surface have its curvature but for the square of their angle.
        for facets in [9, 18] {
            let mesh = cylinder(radius, facets);
            let walls = ["x_max", "y_max", "z_min", "z_max"];
            // Beside the currents the field around the wire changes, which is of the square, too, and another matter.
            let of_curvature = |found: ExcessLoss| found.of_curvature / found.of_surface;
            let wire = of_curvature(replaced(&mesh, material, |mesh| across(mesh, Order::Linear, &walls)));
            let billet = replaced(&mesh, material, along).share();
            println!(
                "{skin_depth} m, {facets}: {wire:.5} of {:.5}, {billet:.5} of {:.5}",
                of(i0 / i1),
                of(i1 / i0)
            );
            assert!((billet - of(i1 / i0)).abs() < tolerance, "{billet}");
            assert!((wire - of(i0 / i1)).abs() < tolerance, "{wire}");
        }
    }
}

/// Iron turns the field around itself as its flux gets in: of what the impedance has more its loss feels a part.
#[test]
fn what_round_iron_has_more_is_what_a_meshed_cylinder_has_more() {
    let radius = 10e-3;
    let walls = ["x_max", "y_max", "z_min", "z_max"];
    for (skin_depth, permeability) in [(1e-3, 1.0), (1e-3, 10.0), (1e-3, 100.0), (2e-3, 100.0)] {
        let material = material(skin_depth, permeability);
        let mut layers = vec![radius - 0.125 * skin_depth];
        while layers[layers.len() - 1] > 0.4 * radius {
            let depth = radius - layers[layers.len() - 1];
            layers.push(radius - depth - 0.3 * depth.max(0.4 * skin_depth));
        }
        layers.reverse();
        let meshed = {
            let mesh = cylinder_of_layers(&layers, radius, 18);
            let materials = vec![Material::AIR, material, Material::AIR];
            let setup = FieldModelSetup { materials, ..across(&mesh, Order::Quadratic, &walls) };
            let (model, solution) = solved(&mesh, setup);
            solution.losses(&model, &mesh)[0].1
        };
        let found = replaced(&cylinder(radius, 18), material, |mesh| across(mesh, Order::Quadratic, &walls));
        let (share, more) = (found.share(), meshed / found.of_surface - 1.0);
        let of_given_field = 0.5 * skin_depth / radius;
        println!("{skin_depth} m, permeability {permeability}: {share:.5} of {more:.5}; {of_given_field}");
        assert!((share - more).abs() < 0.15 * of_given_field, "{share} of {more}");
    }
}

/// Half the length of the waves above a plane [m], and how far the space above it reaches.
const LENGTH: f64 = 10e-3;
const HEIGHT: f64 = 12e-3;

/// Heights between which the current above the plane is [m].
const CURRENT: [f64; 2] = [1e-3, 3e-3];

/// Loss of a conductor below a plane with a current above half of it, but for a factor that is the same for all decays `g`: the sum over
/// waves `cos(k x)`, each going down as `exp(−g z)`.
fn of_waves(relative_permeability: f64, decay: impl Fn(f64) -> c64) -> f64 {
    let of_wave = |n: i32| {
        let k = std::f64::consts::PI * f64::from(n) / LENGTH;
        let [from, to] = CURRENT;
        let (current, layer) = match n {
            0 => (0.5, to - from),
            _ => {
                let current = 2.0 * (0.5 * k * LENGTH).sin() / (k * LENGTH);
                (current, ((k * (HEIGHT - from)).sinh() - (k * (HEIGHT - to)).sinh()) / k)
            }
        };
        let g = decay(k);
        let potential = current * layer
            / (g / relative_permeability * (k * HEIGHT).cosh() + c64::from(k * (k * HEIGHT).sinh()));
        let mean = if n == 0 { 1.0 } else { 0.5 };
        mean * potential.norm_sqr() / g.re
    };
    (0..100).map(of_wave).sum()
}

/// Beyond the square of wave number and skin depth are its fourth power, and that the field at the surface is another one, too.
#[test]
fn what_fields_that_change_have_less_is_what_waves_go_down_faster() {
    let line = |size: f64, to: f64| (0..=(to / size).round() as usize).map(move |i| size * i as f64);
    let mesh = {
        let x = line(0.25e-3, LENGTH).collect();
        let y = [-1e-3].into_iter().chain(line(0.25e-3, HEIGHT)).collect();
        let paint = |[x, y, _]: [f64; 3]| match (x, y) {
            _ if y < 0.0 => 1,
            _ if x < 0.5 * LENGTH && (CURRENT[0]..CURRENT[1]).contains(&y) => 2,
            _ => 0,
        };
        painted([x, y, vec![0.0, 0.5e-3]], &["air", "bar", "coil"], paint)
    };
    for (skin_depth, permeability) in [(0.5e-3, 1.0), (1e-3, 1.0), (2e-3, 1.0), (1e-3, 10.0)] {
        let found = replaced(&mesh, material(skin_depth, permeability), |mesh| {
            let mut boundaries = flux_parallel(&["z_min", "z_max"]);
            boundaries
                .extend(["x_min", "x_max", "y_max"].map(|name| (name.to_owned(), Boundary::FluxNormal)));
            FieldModelSetup { boundaries, ..across(mesh, Order::Linear, &[]) }
        });
        assert_eq!((found.at_edges, found.of_curvature), (0.0, 0.0));
        let gamma = c64::new(1.0, 1.0) / skin_depth;
        let [of_half_space, of_surface] =
            [of_waves(permeability, |k| (gamma * gamma + k * k).sqrt()), of_waves(permeability, |_| gamma)];
        let less = of_half_space / of_surface - 1.0;
        println!("{skin_depth} m, permeability {permeability}: {:.5} of {less:.5}", found.share());
        assert!((0.7..1.1).contains(&(found.share() / less)), "{} of {less}", found.share());
    }
}
