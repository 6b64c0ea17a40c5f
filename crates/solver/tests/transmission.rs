//! What passes through a closed wall that its impedance surface stands for, against H. Kaden's shell (Wirbelströme und Schirmung in der
//! Nachrichtentechnik, Springer 1959).

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{SphereParameters, sphere};
use fluxmorph_geometry::tet4::norm;
use fluxmorph_geometry::{NodeId, RegionId};
use fluxmorph_solver::audit::transmissions;
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModelSetup, Material, SurfaceLaw, UniformField,
};

use crate::{flux_parallel, solved};

/// Outer radius [m].
const RADIUS: f64 = 0.05;

/// Of the field around it [T].
const APPLIED: f64 = 1e-3;

/// Flux density in the cavity [T]: over that around it `1 / (cosh γd + ⅓ (K + 2/K) sinh γd)`, `K = γr/μr`, for the thickness `d` and the
/// mean radius `r`.
fn in_the_cavity(material: &Material, skin_depth: f64, thickness: f64) -> f64 {
    let gamma = c64::new(1.0, 1.0) / skin_depth;
    let k = gamma * (RADIUS - 0.5 * thickness) / material.relative_permeability;
    let (cosh, sinh) = ((gamma * thickness).cosh(), (gamma * thickness).sinh());
    APPLIED / (cosh + (k + 2.0 / k) * sinh / 3.0).norm()
}

/// By an aluminium wall of 4.6 skin depths, a thicker one, and iron, into which the field behind it feeds less.
#[test]
fn what_passes_through_a_closed_shell_is_about_the_field_in_it() {
    for (relative_permeability, conductivity, frequency, thickness) in
        [(1.0, 3e7, 20e3, 3e-3), (1.0, 3e7, 20e3, 5e-3), (500.0, 5e6, 50.0, 5.8e-3)]
    {
        let material = Material { relative_permeability, conductivity };
        let skin_depth = material.skin_depth(std::f64::consts::TAU * frequency).expect("it conducts");
        let parameters = SphereParameters {
            radius: RADIUS,
            inner_radius: Some(RADIUS - thickness),
            divisions: 6,
            wall_layers: 1,
            ..SphereParameters::default()
        };
        let whole = sphere(&parameters).expect("sound parameters");
        let (mesh, surface) = whole.without_region(RegionId(1)).expect("what is left");
        let law = SurfaceLaw::Impedance(material);
        let mut boundaries = flux_parallel(&["x_min", "y_min"]);
        boundaries.push(("z_min".to_owned(), Boundary::FluxNormal));
        let applied = UniformField { flux_density: [0.0, 0.0, APPLIED], centre: None };
        boundaries.push(("outer".to_owned(), Boundary::UniformField(applied)));
        let setup = FieldModelSetup {
            family: ElementFamily::Edge,
            frequency,
            materials: vec![Material::AIR; 3],
            boundaries,
            conductors: vec![Conductor { name: "shell".to_owned(), surface: surface.clone(), law }],
            ..FieldModelSetup::default()
        };
        let (model, solution) = solved(&mesh, setup.clone());
        // In the middle of the whole shell, beside the wall, and outside, where nothing passes from within, but the wall is seen
        // through itself.
        let places = [[0.0; 3], [0.01, 0.02, 0.03], [0.0, 0.0, 0.1]];
        let found = transmissions((&model, &mesh, &solution), &places);
        let [middle, beside, outside] = found[0].flux_densities[..] else { panic!("three places") };
        let exact = in_the_cavity(&material, skin_depth, thickness);
        println!(
            "{relative_permeability} {thickness}: {middle:.3e} {beside:.3e} {outside:.3e}, Kaden {exact:.3e}"
        );
        assert!((middle / exact - 1.0).abs() < 0.5, "{middle} {exact}");
        assert!((beside / exact - 1.0).abs() < 0.6, "{beside} {exact}");
        assert!(outside < 0.2 * exact && outside < 1e-3 * APPLIED, "{outside}");
        // Of two layers each has one of the faces, and what passes comes out of the inner one.
        let is_inner = |triangle: &[NodeId; 3]| norm(mesh.point(triangle[0])) < RADIUS - 0.5 * thickness;
        let (inner, outer): (Vec<_>, Vec<_>) = surface.iter().copied().partition(is_inner);
        let layer = |name: &str, surface| Conductor { name: name.to_owned(), surface, law };
        let conductors = vec![layer("outer", outer), layer("inner", inner)];
        let (model, solution) = solved(&mesh, FieldModelSetup { conductors, ..setup });
        let layers = transmissions((&model, &mesh, &solution), &places[..1]);
        let of_inner = layers.iter().find(|own| own.region == "inner").expect("it passes something");
        assert!((of_inner.flux_densities[0] / middle - 1.0).abs() < 1e-6, "{layers:?}");
    }
}
