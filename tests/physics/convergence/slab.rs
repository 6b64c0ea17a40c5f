//! A conducting slab between equal tangential fields: loss against the closed form of one-dimensional diffusion.
//!
//! A column of air, slab and air along z. `H = H0 e_y` is prescribed on its two ends by the natural boundary term
//! `∮ (H0 × n)·w`; air carries it to the slab unchanged. The faces x are flux-parallel, since the current crosses them at
//! right angles; the faces y are flux-normal, since H does. Nodes are displaced at random across the column, so that
//! the field is one-dimensional and the mesh is not.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::grading::{Fine, Growth, growing, subdivide, uniform};
use fluxmorph_geometry::tet4::area_vector;
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModel, FieldModelSetup, Material, SurfaceLaw,
};

use crate::meshes::{boxed, shaken};
use crate::orders::Study;
use crate::references::{material, named, number, reference};

/// Air at both ends [m].
const GAP: f64 = 0.005;
/// Cells across the column.
const ACROSS: usize = 3;

struct Slab {
    name: &'static str,
    thickness: f64,
    frequency: f64,
    material: Material,
    /// Closed form [W/m²] at 1 A/m.
    loss: f64,
}

impl Slab {
    fn new(name: &'static str) -> Self {
        let file = reference("slab.json");
        let slab = named(&file["slabs"], name);
        let material = material(slab);
        let frequency = number(slab, "frequency_Hz");
        let loss = number(slab, "loss_W_per_m2");
        Self { name, thickness: number(slab, "thickness_m"), frequency, material, loss }
    }

    fn skin_depth(&self) -> f64 {
        let angular_frequency = 2.0 * std::f64::consts::PI * self.frequency;
        self.material.skin_depth(angular_frequency).expect("it conducts")
    }

    /// The column with layers that grow by half from both faces, the first a third of a skin depth, all of them then
    /// divided by `parts`; returns the mesh and its cross-section [m²].
    fn column(&self, parts: usize) -> (Mesh, f64) {
        let t = self.thickness;
        let growth = Growth { first: self.skin_depth() / 3.0, ratio: 1.5, largest: f64::INFINITY };
        let mut z = uniform("gap", [-GAP, 0.0], GAP / 2.0).expect("lines");
        z.extend(&growing("slab", &[0.0, 0.5 * t], Fine::Start, growth).expect("lines")[1..]);
        z.extend(&growing("slab", &[0.5 * t, t], Fine::End, growth).expect("lines")[1..]);
        z.extend(&uniform("gap", [t, t + GAP], GAP / 2.0).expect("lines")[1..]);
        let z = subdivide(&z, parts);
        let side = 0.5 * t;
        let across: Vec<f64> = (0..=ACROSS).map(|i| side * i as f64 / ACROSS as f64).collect();
        let (_, mesh) =
            boxed([across.clone(), across, z], &["air", "slab"], |[_, _, z]| u32::from(z > 0.0 && z < t));
        let inner = |c: f64| c > 1e-9 && c < side - 1e-9;
        let amplitude = 0.12 * side / ACROSS as f64;
        let mesh = shaken(&mesh, |[x, y, _]| {
            [if inner(x) { amplitude } else { 0.0 }, if inner(y) { amplitude } else { 0.0 }, 0.0]
        });
        (mesh, side * side)
    }

    /// Loss per area [W/m²] at 1 A/m.
    fn loss_per_area(&self, mesh: &Mesh, area: f64, conductors: Vec<Conductor>) -> f64 {
        use Boundary::{FluxNormal, FluxParallel};
        let faces =
            [("x_min", FluxParallel), ("x_max", FluxParallel), ("y_min", FluxNormal), ("y_max", FluxNormal)];
        let setup = FieldModelSetup {
            family: ElementFamily::Nodal,
            frequency: self.frequency,
            materials: vec![Material::AIR, self.material],
            conductors,
            boundaries: faces.map(|(name, kind)| (name.to_owned(), kind)).to_vec(),
            ..FieldModelSetup::default()
        };
        let model = FieldModel::new(mesh, setup).expect("a sound problem");
        let mut load = vec![c64::default(); model.unknown_count()];
        for face in ["z_min", "z_max"] {
            for triangle in mesh.topology().surface(face).expect("a grid has it") {
                let n = area_vector(triangle.map(|node| mesh.point(node)));
                // e_y × n, a third of it for each node.
                let third = [n[2], 0.0, -n[0], 0.0].map(|c| c64::from(c / 3.0));
                for &node in triangle {
                    model.unknowns().scatter_add(&mut load, node.into(), third);
                }
            }
        }
        let mut system = model.prepare(model.assemble(mesh)).expect("a definite system");
        let solution = model.solve_prepared(&mut system, &load).expect("the iteration converges");
        let losses = solution.losses(&model, mesh);
        losses.iter().map(|(_, loss)| loss).sum::<f64>() / area
    }
}

#[test]
fn the_loss_of_a_meshed_slab_converges_to_the_closed_form() {
    for name in ["steel", "aluminium"] {
        let slab = Slab::new(name);
        let mut study =
            Study::new(format!("{name} slab, {:.1} skin depths: loss", slab.thickness / slab.skin_depth()));
        for parts in [1, 2, 4] {
            let (mesh, area) = slab.column(parts);
            let loss = slab.loss_per_area(&mesh, area, Vec::new());
            println!(
                "    {name}, {} tets: {loss:.6e} W/m², closed form {:.6e}",
                mesh.topology().tets().len(),
                slab.loss
            );
            study.add(1.0 / parts as f64, (loss / slab.loss - 1.0).abs());
        }
        // Loss is quadratic in fields of first order: second order, with a margin for a mesh that is not yet fine.
        study.assert_order(1.8);
        assert!(study.last() < 0.01, "{name}: one per cent is what an engineer asks for");
    }
}

#[test]
fn the_loss_of_an_impedance_surface_is_that_of_a_thick_slab() {
    let slab = Slab::new("steel");
    let (whole, area) = slab.column(1);
    let (mesh, surface) = whole.without_region(RegionId(1)).expect("air is left");
    let conductor =
        Conductor { name: slab.name.to_owned(), surface, law: SurfaceLaw::Impedance(slab.material) };
    let loss = slab.loss_per_area(&mesh, area, vec![conductor]);
    println!(
        "    impedance surface: {loss:.6e} W/m², closed form {:.6e}, {:+.2e}",
        slab.loss,
        loss / slab.loss - 1.0
    );
    // A half-space has 1/(σδ); a slab of 10.5 skin depths differs from it by less than 1e-3.
    assert!((loss / slab.loss - 1.0).abs() < 1e-3, "{loss} against {}", slab.loss);
}
