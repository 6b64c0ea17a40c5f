//! The assembled matrix against its plain weak form
//!
//! `∫ν curl A·curl w + ∫pν div A div w + jω∫_c σ(A + ∇ψ)·(w + ∇q) + (jω/Zs)∫_S A_t·w_t`,
//!
//! summed element by element without any split. The solver stores a vector Laplacian and terms on triangles instead; on
//! distorted meshes of several materials, with interfaces that end on conditioned and on natural outer faces, every
//! entry must be the same.

use std::collections::BTreeMap;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Tet4, area_vector, cross, dot, norm, sub};
use fluxmorph_geometry::{Mesh, NodeId, RegionId};
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModel, FieldModelSetup, Material, SurfaceLaw,
};

use crate::meshes::{FACES, shaken, unit_cube};

const PI: f64 = std::f64::consts::PI;

const AIR: u32 = 0;
const IRON: u32 = 1;
const STEEL: u32 = 2;

/// Materials of the three regions: the two harmonic terms of steel are as large as the magnetic ones.
fn materials() -> Vec<Material> {
    vec![
        Material::AIR,
        Material { relative_permeability: 50.0, conductivity: 0.0 },
        Material { relative_permeability: 7.0, conductivity: 1e5 },
    ]
}

/// A cube of air with an iron and a steel part that meet each other and the outside; all nodes are displaced but that
/// nodes of the faces `flat` stay in their planes.
fn three_materials(flat: &[&str]) -> Mesh {
    let n = 6;
    let mesh = unit_cube(n, &["air", "iron", "steel"], |[x, y, z]| {
        if x + y < 0.9 && z < 0.6 {
            IRON
        } else if x > 0.3 && y > 0.4 && z < 0.8 {
            STEEL
        } else {
            AIR
        }
    });
    let held = |coordinate: f64, axis: usize| {
        flat.iter().any(|name| {
            let face = FACES.iter().position(|f| f == name).expect("one of the six");
            face / 2 == axis && (coordinate - (face % 2) as f64).abs() < 1e-9
        })
    };
    shaken(&mesh, |p| [0, 1, 2].map(|d| if held(p[d], d) { 0.0 } else { 0.12 / n as f64 }))
}

type Entries = BTreeMap<(usize, usize), c64>;

/// The plain weak form as a sum of element matrices.
fn plain(mesh: &Mesh, model: &FieldModel, penalty: f64) -> Entries {
    let dofs = &model.unknowns().dofs;
    let topology = mesh.topology();
    let unit = |i: usize| -> [f64; 3] { std::array::from_fn(|d| f64::from(u8::from(d == i))) };
    let mut entries = Entries::new();
    let mut add = |(a, i): (NodeId, usize), (b, j): (NodeId, usize), value: c64| {
        if let (Some(row), Some(column)) = (dofs.equation(a, i), dofs.equation(b, j)) {
            *entries.entry((row, column)).or_default() += value;
        }
    };
    for e in topology.elements() {
        let (tet, nodes) = (Tet4::new(mesh.vertices(e)), topology.tet(e));
        let material = model.materials()[topology.region_of()[e.index()].index()];
        let (nu, v) = (material.reluctivity(), tet.volume);
        let eddy = c64::new(0.0, model.angular_frequency() * material.conductivity);
        for a in 0..4 {
            for b in 0..4 {
                let (ga, gb) = (tet.gradients[a], tet.gradients[b]);
                let mass = v * if a == b { 0.1 } else { 0.05 };
                for i in 0..3 {
                    for j in 0..3 {
                        // curl(N e_i) = ∇N × e_i and div(N e_i) = ∂_i N.
                        let curl_curl = dot(cross(ga, unit(i)), cross(gb, unit(j)));
                        let div_div = ga[i] * gb[j];
                        let mut value = c64::from(nu * v * (curl_curl + penalty * div_div));
                        if i == j {
                            value += eddy * mass;
                        }
                        add((nodes[a], i), (nodes[b], j), value);
                    }
                    add((nodes[a], i), (nodes[b], 3), eddy * (0.25 * v * gb[i]));
                    add((nodes[a], 3), (nodes[b], i), eddy * (0.25 * v * ga[i]));
                }
                add((nodes[a], 3), (nodes[b], 3), eddy * (v * dot(ga, gb)));
            }
        }
    }
    for conductor in model.conductors() {
        let SurfaceLaw::Impedance(material) = conductor.law else { panic!("none is perfect here") };
        let skin_depth = material.skin_depth(model.angular_frequency()).expect("it conducts");
        // jω/Zs with Zs = (1+j)/(σδ).
        let coefficient = c64::new(0.0, model.angular_frequency() * material.conductivity * skin_depth)
            / c64::new(1.0, 1.0);
        for triangle in &conductor.surface {
            let normal = area_vector(triangle.map(|n| mesh.point(n)));
            let area = norm(normal);
            let corner = |a: usize| mesh.point(triangle[a % 3]);
            let slope = |a: usize| {
                let opposite = sub(corner(a + 2), corner(a + 1));
                cross(normal, opposite).map(|c| c / (2.0 * area * area))
            };
            for (a, &na) in triangle.iter().enumerate() {
                for (b, &nb) in triangle.iter().enumerate() {
                    let mass = area / if a == b { 6.0 } else { 12.0 };
                    for i in 0..3 {
                        for j in 0..3 {
                            let tangential = dot(unit(i), unit(j)) - normal[i] * normal[j] / (area * area);
                            add((na, i), (nb, j), coefficient * (mass * tangential));
                        }
                        add((na, i), (nb, 3), coefficient * (area / 3.0 * slope(b)[i]));
                        add((na, 3), (nb, i), coefficient * (area / 3.0 * slope(a)[i]));
                    }
                    add((na, 3), (nb, 3), coefficient * (area * dot(slope(a), slope(b))));
                }
            }
        }
    }
    entries
}

/// Asserts that every entry of the solver's matrix, stored or not, is that of the plain weak form.
fn assert_same(mesh: &Mesh, setup: &FieldModelSetup) {
    let model = FieldModel::new(mesh, setup.clone()).expect("a sound problem");
    let matrix = model.assemble(mesh);
    let mut entries = plain(mesh, &model, setup.penalty);
    let count = model.unknown_count();
    let scale: Vec<f64> = (0..count).map(|r| entries[&(r, r)].norm().sqrt()).collect();
    for row in 0..count {
        for position in matrix.structure.row(row) {
            let column = matrix.structure.columns[position] as usize;
            *entries.entry((row, column)).or_default() -= matrix.values[position];
        }
    }
    let worst = entries
        .iter()
        .map(|(&(r, c), difference)| difference.norm() / (scale[r] * scale[c]))
        .fold(0.0, f64::max);
    println!(
        "{} Hz, p = {}, {} conditions, {} impedance surfaces: {count} unknowns, worst difference {worst:.1e}",
        setup.frequency,
        setup.penalty,
        setup.boundaries.len(),
        setup.conductors.len(),
    );
    // Against the geometric mean of the two diagonal entries: rounding of sums of some twenty elements whose
    // reluctivities differ by 50.
    assert!(worst < 1e-12, "{worst}");
}

fn setup(frequency: f64, penalty: f64, boundaries: &[(&str, Boundary)]) -> FieldModelSetup {
    FieldModelSetup {
        family: ElementFamily::Nodal,
        frequency,
        penalty,
        materials: materials(),
        boundaries: boundaries.iter().map(|&(name, kind)| (name.to_owned(), kind)).collect(),
        ..FieldModelSetup::default()
    }
}

/// The frequencies and penalty factors that store different terms.
const CASES: [(f64, f64); 4] = [(0.0, 1.0), (0.0, 0.5), (50.0, 1.0), (50.0, 0.5)];

#[test]
fn the_split_matrix_is_the_plain_one_with_natural_outer_faces() {
    let mesh = three_materials(&[]);
    for (frequency, penalty) in CASES {
        assert_same(&mesh, &setup(frequency, penalty, &[]));
    }
}

#[test]
fn the_split_matrix_is_the_plain_one_where_interfaces_end_on_conditioned_planes() {
    use Boundary::{FluxNormal, FluxParallel};
    let boundaries =
        [("x_min", FluxParallel), ("y_min", FluxNormal), ("x_max", FluxNormal), ("z_min", FluxParallel)];
    let mesh = three_materials(&boundaries.map(|(name, _)| name));
    for (frequency, penalty) in CASES {
        assert_same(&mesh, &setup(frequency, penalty, &boundaries));
    }
}

#[test]
fn the_split_matrix_is_the_plain_one_around_an_impedance_surface() {
    let boundaries = [("x_max", Boundary::FluxNormal), ("z_min", Boundary::FluxParallel)];
    let whole = three_materials(&boundaries.map(|(name, _)| name));
    let (mesh, surface) = whole.without_region(RegionId(STEEL)).expect("air and iron are left");
    for penalty in [1.0, 0.5] {
        let mut setup = setup(50.0, penalty, &boundaries);
        let material = materials()[STEEL as usize];
        setup.conductors = vec![Conductor {
            name: "steel".to_owned(),
            surface: surface.clone(),
            law: SurfaceLaw::Impedance(material),
        }];
        assert_same(&mesh, &setup);
    }
    // The surface term is not lost among the magnetic ones.
    let material = materials()[STEEL as usize];
    let depth = material.skin_depth(100.0 * PI).expect("it conducts");
    let cell = 1.0 / 6.0;
    let ratio = 100.0 * PI * material.conductivity * depth * cell / Material::AIR.reluctivity();
    assert!((0.1..1e3).contains(&ratio), "{ratio}");
}
