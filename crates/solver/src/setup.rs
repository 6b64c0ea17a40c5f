//! What a field problem is made from beside the mesh, and what is refused of it before anything is computed.

use std::collections::HashSet;
use std::sync::Arc;

use fluxmorph_geometry::parallel::Ownership;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh};

use crate::bh::BhCurve;
use crate::boundary::{self, Boundary};
use crate::circuit::{Winding, solids};
use crate::coil::{Coil, CoilShape, Condition, ConditionedSurface, RegionFault, planes};
use crate::elements::{ElementFamily, Order};
use crate::error::SolverError;
use crate::linear::{DistributedSettings, LinearSolverSettings};
use crate::material::Material;
use crate::open::{OpenRegion, Shell};
use crate::surface::{Conductor, SurfaceLaw};

/// Everything that defines a field problem beside the mesh.
#[derive(Clone, Debug)]
pub struct FieldModelSetup {
    /// Name of the load case, for messages and arrays; `None` where it has none.
    pub load_case: Option<String>,
    /// Frequency [Hz]; zero for magnetostatics.
    pub frequency: f64,
    /// Penalty factor `p = ν_p/ν` [1]. Default 1: the components of `A` then decouple inside a material.
    pub penalty: f64,
    /// What is continuous between elements. Default edge.
    pub family: ElementFamily,
    /// Polynomial order of the potentials. Default linear.
    pub order: Order,
    /// Material of every region, by `RegionId`.
    pub materials: Vec<Material>,
    /// `B_r` [T] of every region, by `RegionId`; shorter where the rest has none. Statics only.
    pub remanence: Vec<Point>,
    /// B–H law of every region, by `RegionId`; shorter where the rest is linear. Above 0 Hz it holds at the largest and the least
    /// `|B|` of a period. The permeability of the region's material is then that of the penalty of nodal elements.
    pub bh: Vec<Option<Arc<BhCurve>>>,
    /// Conductors replaced by their surfaces.
    pub conductors: Vec<Conductor>,
    /// Coils.
    pub coils: Vec<Coil>,
    /// Windings of the coils, by their place in `coils`; shorter where the rest has none.
    pub windings: Vec<Option<Winding>>,
    /// Conditions on named surfaces; outer faces without one are natural.
    pub boundaries: Vec<(String, Boundary)>,
    /// The region that stands for open space, if one does.
    pub open: Option<OpenRegion>,
    /// Elements of the mesh of which a node moves from one to the next of several meshes, ascending; empty where there is one mesh, or
    /// that is not known. Order and method of the factors may depend on it, results within the linear solver's tolerance.
    pub moving: Vec<ElementId>,
    /// Linear solver.
    pub linear_solver: LinearSolverSettings,
    /// The ranks over which the problem is distributed, and how they solve; `None` for one process.
    pub ownership: Option<(Ownership, DistributedSettings)>,
}

impl Default for FieldModelSetup {
    /// A static problem without anything in it.
    fn default() -> Self {
        Self {
            load_case: None,
            frequency: 0.0,
            penalty: 1.0,
            family: ElementFamily::default(),
            order: Order::default(),
            materials: Vec::new(),
            remanence: Vec::new(),
            bh: Vec::new(),
            conductors: Vec::new(),
            coils: Vec::new(),
            windings: Vec::new(),
            boundaries: Vec::new(),
            open: None,
            moving: Vec::new(),
            linear_solver: LinearSolverSettings::default(),
            ownership: None,
        }
    }
}

impl FieldModelSetup {
    /// `ν B_r` [A/m] of every region, by `RegionId`; shorter where the rest has none.
    pub(crate) fn magnetisation(&self) -> Vec<Point> {
        let of = |(b, m): (&Point, &Material)| b.map(|b| m.reluctivity() * b);
        self.remanence.iter().zip(&self.materials).map(of).collect()
    }
}

/// Refuses coils that meet the outside of the mesh where their source would be wrong.
pub(crate) fn check_coils(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(), SolverError> {
    let mut surfaces = Vec::new();
    for (name, boundary) in &setup.boundaries {
        let condition = match boundary {
            Boundary::FluxParallel => Condition::FluxParallel,
            Boundary::FluxNormal => Condition::FluxNormal,
            Boundary::UniformField(_) => Condition::Prescribed,
        };
        surfaces.push(ConditionedSurface { name, condition, triangles: mesh.topology().surface(name)? });
    }
    // What is tangential is known on a perfect conductor under edge elements, as on a flux-parallel wall.
    let is_known = |own: &&Conductor| setup.family == ElementFamily::Edge && own.law == SurfaceLaw::Perfect;
    surfaces.extend(setup.conductors.iter().filter(is_known).map(|own| ConditionedSurface {
        name: &own.name,
        condition: Condition::FluxParallel,
        triangles: &own.surface,
    }));
    planes::check(mesh, &setup.coils, &surfaces)
}

/// Refuses numbers out of range, and applied fields that cannot be.
pub(crate) fn check(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(), SolverError> {
    let refuse = |what: &str, value: f64, expected: &str| Err(SolverError::parameter(what, value, expected));
    if !(setup.frequency >= 0.0 && setup.frequency.is_finite()) {
        return refuse("frequency", setup.frequency, "a frequency in hertz, zero or more");
    }
    if !(setup.penalty > 0.0 && setup.penalty.is_finite()) {
        return refuse("penalty", setup.penalty, "a positive factor; 1 is right for almost all cases");
    }
    let regions = mesh.topology().region_names().len();
    if setup.materials.len() != regions || setup.remanence.len() > regions {
        let count = setup.materials.len().max(setup.remanence.len()) as f64;
        return refuse("number of materials", count, "one material a region, and at most one remanence");
    }
    for (material, region) in setup.materials.iter().zip(mesh.topology().region_names()) {
        let Material { relative_permeability: mu, conductivity: sigma } = *material;
        if !(mu > 0.0 && mu.is_finite()) {
            return refuse(&format!("relative_permeability of `{region}`"), mu, "a positive number");
        }
        if !(sigma >= 0.0 && sigma.is_finite()) {
            return refuse(&format!("conductivity of `{region}`"), sigma, "zero or more siemens per metre");
        }
    }
    if setup.frequency > 0.0 && setup.remanence.iter().any(|b| *b != [0.0; 3]) {
        return refuse("frequency", setup.frequency, "0 Hz: a permanent magnet makes a static field");
    }
    check_laws(mesh, setup)?;
    check_coil_numbers(setup)?;
    check_conduction(mesh, setup)?;
    check_solids(setup)?;
    check_replaced(&setup.conductors)?;
    let perfect = setup.conductors.iter().filter(|conductor| conductor.law == SurfaceLaw::Perfect);
    let perfect = perfect.map(|conductor| (conductor.name.as_str(), conductor.surface.as_slice()));
    boundary::check_applied(mesh, &setup.boundaries, perfect)
}

/// Refuses surfaces of conductors without faces, or with one that would count twice.
fn check_replaced(conductors: &[Conductor]) -> Result<(), SolverError> {
    let mut known = HashSet::new();
    for Conductor { name, surface, .. } in conductors {
        if surface.is_empty() {
            let expected = "the surface that replaces a conductor needs faces";
            return Err(SolverError::EmptyRegion { region: name.clone(), expected });
        }
        if let Some(face) = surface.iter().find(|face| !known.insert(face_key(**face))) {
            let nodes = face.map(|node| node.index());
            let what = format!("face of the surface of `{name}`");
            return Err(SolverError::parameter(what, format!("{nodes:?}"), "each face once"));
        }
    }
    Ok(())
}

/// Refuses currents and windings with numbers out of range.
fn check_coil_numbers(setup: &FieldModelSetup) -> Result<(), SolverError> {
    let refuse =
        |what: String, value: String, expected: &str| Err(SolverError::parameter(what, value, expected));
    let (coils, windings) = (setup.coils.len(), setup.windings.len());
    if windings > coils {
        return refuse("number of windings".to_owned(), windings.to_string(), "at most one a coil");
    }
    let is_static = setup.frequency == 0.0;
    for (k, Coil { name, ampere_turns, .. }) in setup.coils.iter().enumerate() {
        let winding = setup.windings.get(k).copied().flatten();
        let voltage = winding.and_then(|winding| winding.voltage).unwrap_or_default();
        for (what, value) in [("ampere_turns", *ampere_turns), ("voltage", voltage)] {
            if is_static && value.im != 0.0 {
                return refuse(format!("{what} of `{name}`"), value.to_string(), "a real number at 0 Hz");
            }
        }
        if !voltage.is_finite() {
            return refuse(format!("voltage of `{name}`"), voltage.to_string(), "a finite phasor");
        }
        let Some(Winding { turns, resistance, series_inductance, series_capacitance, .. }) = winding else {
            continue;
        };
        let capacitance = series_capacitance.unwrap_or(1.0);
        for (what, value, is_in_range, expected) in [
            ("turns", turns, turns > 0.0, "a positive number"),
            ("resistance", resistance, resistance >= 0.0, "zero or more ohms"),
            ("series_inductance", series_inductance, series_inductance >= 0.0, "zero or more henries"),
            ("series_capacitance", capacitance, capacitance > 0.0, "a positive number of farads"),
        ] {
            if !(is_in_range && value.is_finite()) {
                return refuse(format!("{what} of `{name}`"), value.to_string(), expected);
            }
        }
    }
    Ok(())
}

/// Refuses stranded windings that conduct above 0 Hz: eddy currents would flow through all turns.
fn check_conduction(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(), SolverError> {
    let topology = mesh.topology();
    let stranded = setup.coils.iter().filter_map(|coil| match &coil.shape {
        CoilShape::Region(current) if setup.frequency > 0.0 => Some((coil, current)),
        _ => None,
    });
    for (coil, current) in stranded {
        let regions = current.current_density().iter().map(|(e, _)| topology.region_of()[e.index()].index());
        let conductivity = regions.map(|region| setup.materials[region].conductivity).find(|own| *own > 0.0);
        if let Some(conductivity) = conductivity {
            let what = format!("conductivity of the winding `{}`", coil.name);
            return Err(SolverError::parameter(what, conductivity, "zero above 0 Hz, or a solid conductor"));
        }
    }
    Ok(())
}

/// Refuses solid conductors where they cannot be solved with: over ranks, and where another coil is of the same elements, whose
/// current one of the two would not see.
fn check_solids(setup: &FieldModelSetup) -> Result<(), SolverError> {
    for (coil, conductor) in solids::conductors(&setup.coils).filter(|_| setup.frequency > 0.0) {
        let name = setup.coils[coil].name.clone();
        if setup.ownership.is_some() {
            return Err(SolverError::SolidOnRanks { coil: name });
        }
        let mut others = setup.coils.iter().enumerate().filter(|(k, _)| *k != coil).map(|(_, other)| other);
        let flows = |other: &&Coil| conductor.potential().iter().any(|(e, _)| other.shape.flows_in(*e));
        if let Some(other) = others.find(flows) {
            let fault = RegionFault::Shared { other: other.name.clone() };
            return Err(SolverError::CoilRegion { coil: name, fault });
        }
    }
    Ok(())
}

/// Refuses B–H laws where they have no meaning.
fn check_laws(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(), SolverError> {
    let refuse =
        |what: &str, value: String, expected: &str| Err(SolverError::parameter(what, value, expected));
    let has_law = |r: usize| setup.bh.get(r).is_some_and(Option::is_some);
    if setup.bh.len() > setup.materials.len() {
        return refuse("number of B–H laws", setup.bh.len().to_string(), "at most one a region");
    }
    let Some(first) = setup.bh.iter().position(Option::is_some) else { return Ok(()) };
    if setup.ownership.is_some() {
        let region = mesh.topology().region_names()[first].clone();
        return Err(SolverError::CurveOnRanks { region });
    }
    if let Some(r) = (0..setup.remanence.len()).find(|&r| has_law(r) && setup.remanence[r] != [0.0; 3]) {
        let remanence = format!("{:?}", setup.remanence[r]);
        return refuse(
            "remanence",
            remanence,
            "a material with a permeability: a magnet has a straight recoil line",
        );
    }
    Ok(())
}

/// Refuses what open space cannot hold: matter, sources, and a field that does not vanish at infinity.
///
/// # Errors
/// [`SolverError::OpenContents`].
pub(crate) fn check_open(
    shell: &Shell,
    mesh: &Mesh,
    setup: &FieldModelSetup,
    mut sources: impl Iterator<Item = ElementId>,
) -> Result<(), SolverError> {
    let Some(region) = setup.open.map(|open| open.region.index()) else { return Ok(()) };
    let is_matter = setup.materials[region] != Material::AIR
        || setup.remanence.get(region).is_some_and(|remanence| *remanence != [0.0; 3]);
    let applied = |(_, boundary): &(String, Boundary)| matches!(boundary, Boundary::UniformField(_));
    let what = if is_matter {
        "a material other than air"
    } else if setup.boundaries.iter().any(applied) {
        "a uniform field applied outside"
    } else if sources.any(|e| shell.of(e).is_some()) {
        "a coil or its window"
    } else {
        return Ok(());
    };
    Err(SolverError::OpenContents { region: mesh.topology().region_names()[region].clone(), what })
}
