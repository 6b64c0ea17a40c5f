//! A prism as a problem of the program, its solution, and how far that is from the exact field.

use std::collections::HashSet;

use cpu_time::ProcessTime;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{centroid, volume};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_solver::{
    Boundary, Conductor, FieldModel, FieldModelSetup, FieldSolution, Material, SolverError, SurfaceLaw,
};

use super::boxed::{OBSERVATION, with_surface};
use super::discretisation::Discretisation;
use super::exact::{Kind, Prism};
use super::polygon::SAME;

/// Distance from the winding [m] from which on the field is judged everywhere: two coarse cells.
const CLEARANCE: f64 = 0.2;

/// A prism solved on a mesh.
pub(super) struct Solved {
    pub(super) model: FieldModel,
    /// What is left of the mesh without conductors that are replaced by their surface.
    pub(super) mesh: Mesh,
    pub(super) solution: FieldSolution,
    pub(super) cpu_seconds: f64,
}

/// Relative errors of a solved prism.
#[derive(Clone, Copy, Debug)]
pub(super) struct Errors {
    /// Of the mean of B over the observation, as a vector.
    pub(super) observed: f64,
    /// Of B in the energy norm, over everything that does not conduct, from [`CLEARANCE`] off the winding on.
    pub(super) energy: f64,
    /// Of the sum of all losses, where something conducts.
    pub(super) loss: Option<f64>,
}

/// The problem of a prism on a mesh with the regions of its parts and [`OBSERVATION`].
pub(super) fn set_up(prism: &Prism, mesh: &Mesh, penalty: f64) -> (Mesh, FieldModelSetup) {
    let mut left = mesh.clone();
    for part in &prism.parts {
        if matches!(part.kind, Kind::Perfect | Kind::Impedance { .. }) {
            let region = left.topology().region(part.name).expect("a part is a region");
            let (rest, exposed) = left.without_region(region).expect("something is left");
            left = with_surface(rest, part.name, exposed);
        }
    }
    let names: Vec<String> = left.topology().region_names().to_vec();
    let material = |name: &String| {
        let part = prism.parts.iter().find(|part| part.name == name);
        part.map_or(Material::AIR, |part| part.kind.material())
    };
    let materials = names.iter().map(material).collect();
    let law = |kind: &Kind| match kind {
        Kind::Perfect => Some(SurfaceLaw::Perfect),
        Kind::Impedance { .. } => Some(SurfaceLaw::Impedance(kind.material())),
        _ => None,
    };
    let conductors: Vec<Conductor> = prism
        .parts
        .iter()
        .filter_map(|part| {
            let surface = || left.topology().surface(part.name).expect("it was named").to_vec();
            Some(Conductor { law: law(&part.kind)?, name: part.name.to_owned(), surface: surface() })
        })
        .collect();
    let boundaries =
        [("walls", Boundary::FluxParallel), ("bottom", Boundary::FluxNormal), ("top", Boundary::FluxNormal)];
    for (name, faces) in outer_faces(prism, &left, &conductors) {
        left = with_surface(left, name, faces);
    }
    let setup = FieldModelSetup {
        frequency: prism.frequency(),
        penalty,
        materials,
        coils: vec![prism.source.coil(prism.height)],
        conductors,
        boundaries: boundaries.map(|(name, kind)| (name.to_owned(), kind)).to_vec(),
        ..FieldModelSetup::default()
    };
    (left, setup)
}

/// The outer faces that are no impedance surface: bottom, top, and walls.
fn outer_faces(
    prism: &Prism,
    mesh: &Mesh,
    conductors: &[Conductor],
) -> [(&'static str, Vec<[NodeId; 3]>); 3] {
    let taken: HashSet<[NodeId; 3]> =
        conductors.iter().flat_map(|c| &c.surface).map(|&t| face_key(t)).collect();
    let mut faces = [("bottom", Vec::new()), ("top", Vec::new()), ("walls", Vec::new())];
    for facet in mesh.topology().outer_facets() {
        if taken.contains(&face_key(facet.nodes)) {
            continue;
        }
        let flat = |z: f64| facet.nodes.iter().all(|&n| (mesh.point(n)[2] - z).abs() < SAME);
        let kind = if flat(0.0) { 0 } else { 2 - usize::from(flat(prism.height)) };
        faces[kind].1.push(facet.nodes);
    }
    faces
}

/// Solves a prism on a mesh.
pub(super) fn solve(prism: &Prism, mesh: &Mesh, discretisation: Discretisation, penalty: f64) -> Solved {
    try_solve(prism, mesh, discretisation, penalty).unwrap_or_else(|e| panic!("{}: {e}", prism.name))
}

/// Solves it, where the system has a solution in double precision.
pub(super) fn try_solve(
    prism: &Prism,
    mesh: &Mesh,
    discretisation: Discretisation,
    penalty: f64,
) -> Result<Solved, SolverError> {
    let (mesh, setup) = set_up(prism, mesh, penalty);
    let clock = ProcessTime::now();
    let model = FieldModel::new(&mesh, discretisation.of(setup))?;
    let (solution, _) = model.solve(&mesh)?;
    let cpu_seconds = clock.elapsed().as_secs_f64();
    Ok(Solved { model, mesh, solution, cpu_seconds })
}

impl Solved {
    /// The mean of B [T] over the observation.
    pub(super) fn observed(&self) -> [c64; 3] {
        let topology = self.mesh.topology();
        let elements = topology.elements_of(topology.region(OBSERVATION).expect("every mesh has it"));
        let fields = self.solution.flux_densities_of(&self.model, &self.mesh, &elements);
        let volumes: Vec<f64> = elements.iter().map(|&e| volume(self.mesh.vertices(e))).collect();
        let total: f64 = volumes.iter().sum();
        std::array::from_fn(|d| fields.iter().zip(&volumes).map(|(b, v)| b[d] * (v / total)).sum())
    }

    /// How far it is from the exact field.
    pub(super) fn errors(&self, prism: &Prism) -> Errors {
        let (observed, exact) = (self.observed(), prism.observed());
        let away = [observed[0], observed[1], observed[2] - exact];
        let norm = |b: [c64; 3]| b.iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt();
        let total = |losses: &mut dyn Iterator<Item = f64>| losses.sum::<f64>();
        let exact_loss = total(&mut prism.losses().into_iter().map(|(_, loss)| loss));
        let loss =
            total(&mut self.solution.losses(&self.model, &self.mesh).into_iter().map(|(_, loss)| loss));
        Errors {
            observed: norm(away) / exact.norm(),
            energy: self.energy_error(prism),
            loss: (exact_loss > 0.0).then(|| (loss / exact_loss - 1.0).abs()),
        }
    }

    /// `sqrt(∫ν|B − B_exact|² / ∫ν|B_exact|²)` by the centroids of all elements that do not conduct and lie off the
    /// winding: there the exact H is constant, and what is wrong came from elsewhere.
    fn energy_error(&self, prism: &Prism) -> f64 {
        let c = prism.constant();
        let (mut wrong, mut all) = (0.0, 0.0);
        let topology = self.mesh.topology();
        for (e, b) in topology.elements().zip(self.solution.flux_densities(&self.model, &self.mesh)) {
            let material = self.model.materials()[topology.region_of()[e.index()].index()];
            let vertices = self.mesh.vertices(e);
            let [x, y, _] = centroid(vertices);
            if material.conductivity > 0.0 || prism.source.clearance([x, y]) < CLEARANCE {
                continue;
            }
            let exact = c / material.reluctivity();
            let weight = material.reluctivity() * volume(vertices);
            let square: f64 = [b[0], b[1], b[2] - exact].iter().map(|c| c.norm_sqr()).sum();
            wrong += weight * square;
            all += weight * exact.norm_sqr();
        }
        (wrong / all).sqrt()
    }
}
