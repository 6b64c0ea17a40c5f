//! Which value of the configuration an error of the mesh, the solver or the elastic map comes from.
//!
//! The crates below know names of surfaces, regions and coils, and nothing of a configuration: here such a name is found
//! again, so that the error is shown at the key that holds it. Errors that no value is to blame for stay what they are.

use fluxmorph_geometry::MeshError;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_remesh::RemeshError;
use fluxmorph_solver::coil::{PlaneFault, RegionFault};
use fluxmorph_solver::{NewtonFailure, NonConvergence, PointsOf, SolverError};

use super::references::{regions, surface_names};
use crate::config::{CoilShape, Config, ConfigError, Diagnostic, RemeshExtent, SourceMap};
use crate::error::Error;

/// The error at the key that it comes from, where there is one.
pub(crate) fn attribute_error(error: Error, config: &Config, source: &SourceMap) -> Error {
    let blame = Blame { config, source };
    let Error::Optimizer(cause) = &error else { return error };
    let fault = match cause {
        OptimizerError::Solver(error) => blame.solver(error),
        OptimizerError::Remesh(error) => blame.remesh(error),
        OptimizerError::Mesh(error) => blame.mesh(error),
        OptimizerError::Constraint { name, .. } => blame.constraint(name, cause),
        OptimizerError::FirstDesign { .. } => {
            Some(source.diagnostic("design.initial", error.to_string()).with_advice_apart())
        }
        _ => None,
    };
    match fault {
        Some(fault) => source.error(vec![fault]).into(),
        None => error,
    }
}

/// The keys that the advice of an error is about, of those that no single value is to blame for.
pub(crate) fn keys_of_advice(error: &Error) -> Option<&'static str> {
    let solver = match error {
        Error::Optimizer(OptimizerError::Solver(error)) => error,
        Error::Optimizer(OptimizerError::Field { cause, .. }) => cause,
        Error::Optimizer(OptimizerError::Remesh(RemeshError::NotFinite { .. })) => {
            return Some("remesh.stiffness");
        }
        _ => return None,
    };
    match solver {
        SolverError::NotConverged { cause: NonConvergence::IllConditioned, .. }
        | SolverError::Newton { failure: NewtonFailure::Rounding, .. } => {
            Some("analysis.linear_solver.factor_gib")
        }
        SolverError::NotConverged { cause: NonConvergence::OnRanks, .. } => {
            Some("analysis.petsc.solver = \"mumps\", analysis.petsc.overlap, analysis.petsc.sub_solver")
        }
        _ => None,
    }
}

/// What to change in a configuration where a coil meets a surface as it may not; `None` where the error says it all.
fn plane_advice(fault: &PlaneFault, shape: &CoilShape) -> Option<&'static str> {
    match fault {
        PlaneFault::Crossing { .. } | PlaneFault::TangentialSource
            if matches!(shape, CoilShape::Region(_)) =>
        {
            Some(
                "name the surface in boundaries.flux_parallel; around a conductor that is an impedance surface, leave an element of air \
                 between the winding and its corners, or mesh it (model = \"volume\")",
            )
        }
        PlaneFault::Crossing { .. } | PlaneFault::TangentialSource => Some(
            "name the surface in boundaries.flux_parallel, or move the coil away; around a conductor that is an impedance \
                 surface, make the coil a region of the mesh",
        ),
        PlaneFault::EndsAtTerminal => Some(
            "name the surface in boundaries.flux_parallel, or let the coil close on itself with center and axis instead of \
             terminals",
        ),
        _ => None,
    }
}

/// Gathers what independent parts of a set-up find at fault.
pub(super) struct DiagnosticSink<'a> {
    config: &'a Config,
    source: &'a SourceMap,
    faults: Vec<Diagnostic>,
}

impl<'a> DiagnosticSink<'a> {
    pub(super) fn new(config: &'a Config, source: &'a SourceMap, faults: Vec<Diagnostic>) -> Self {
        Self { config, source, faults }
    }

    /// The value, or none with its faults kept.
    ///
    /// # Errors
    /// Whatever no value of the configuration is to blame for.
    pub(super) fn take<T>(&mut self, outcome: Result<T, Error>) -> Result<Option<T>, Error> {
        match outcome.map_err(|error| attribute_error(error, self.config, self.source)) {
            Ok(value) => Ok(Some(value)),
            Err(Error::Config(ConfigError::Invalid(report))) => {
                for fault in report.diagnostics {
                    if !self.faults.contains(&fault) {
                        self.faults.push(fault);
                    }
                }
                Ok(None)
            }
            // It may follow from the faults that are known, which come first.
            Err(_) if !self.faults.is_empty() => Ok(None),
            Err(other) => Err(other),
        }
    }

    /// Keeps a diagnostic.
    pub(super) fn push(&mut self, fault: Diagnostic) {
        self.faults.push(fault);
    }

    /// All faults at once, if there are any.
    pub(super) fn check(self) -> Result<(), Error> {
        Ok(self.source.check(self.faults)?)
    }
}

struct Blame<'a> {
    config: &'a Config,
    source: &'a SourceMap,
}

impl Blame<'_> {
    fn at(&self, path: &str, error: &dyn std::fmt::Display) -> Option<Diagnostic> {
        Some(self.source.diagnostic(path, error.to_string()).with_advice_apart())
    }

    /// The key path of a surface in a list of the configuration whose path starts like that.
    fn surface(&self, list: &str, name: &str) -> Option<String> {
        let found =
            surface_names(self.config).into_iter().find(|(path, own)| path.starts_with(list) && *own == name);
        found.map(|(path, _)| path)
    }

    /// The key path of a coil.
    fn coil(&self, name: &str) -> Option<String> {
        let index = self.config.coils.iter().position(|coil| coil.name == name)?;
        Some(format!("coils[{index}]"))
    }

    /// What a coil is.
    fn shape_of_coil(&self, name: &str) -> Option<&CoilShape> {
        self.config.coils.iter().find(|coil| coil.name == name).map(|coil| &coil.shape)
    }

    /// The key of the position of a coil.
    fn coil_place(&self, name: &str) -> Option<String> {
        let key = if matches!(self.shape_of_coil(name)?, CoilShape::Region(_)) { "region" } else { "center" };
        Some(format!("{}.{key}", self.coil(name)?))
    }

    fn solver(&self, error: &SolverError) -> Option<Diagnostic> {
        match error {
            SolverError::TwoConditions { surfaces: [first, second], .. } => {
                let second = self.surface("boundaries", second)?;
                let fault = self.at(&second, error)?;
                Some(match self.surface("boundaries", first) {
                    Some(first) => {
                        fault.secondary(self.source.span(&first), "it shares a face with this one")
                    }
                    None => fault,
                })
            }
            SolverError::Conflict { .. } => self.at("boundaries.uniform_field", error),
            SolverError::NoSource { coil, .. } => self.at(&self.coil_place(coil)?, error),
            SolverError::SourceOnBoundary { coil, surface, reason, .. } => {
                let mut fault = self.at(&self.coil_place(coil)?, error)?;
                if let Some(advice) = plane_advice(reason, self.shape_of_coil(coil)?) {
                    fault.help = Some(advice.to_owned());
                }
                Some(match self.surface("boundaries", surface) {
                    Some(surface) => fault.secondary(self.source.span(&surface), "the surface is named here"),
                    None => fault,
                })
            }
            SolverError::CoilRegion { coil, fault } => {
                let path = self.coil(coil)?;
                let terminal = |name: &str| self.surface(&format!("{path}.terminals"), name);
                let place = match fault {
                    RegionFault::TerminalElsewhere { terminal: name }
                    | RegionFault::PartWithoutTerminal { terminal: name, .. } => terminal(name),
                    RegionFault::TerminalsTouch { to, .. } => terminal(to),
                    RegionFault::AxisInside { .. } | RegionFault::NoRing => Some(format!("{path}.center")),
                    _ => None,
                };
                self.at(&place.unwrap_or(format!("{path}.region")), error)
            }
            SolverError::Open { .. } | SolverError::OpenContents { .. } => {
                let is_region = self.config.open.as_ref().is_some_and(|open| open.region.is_some());
                self.at(if is_region { "open.region" } else { "open.surfaces" }, error)
            }
            SolverError::EmptyRegion { region, .. } => self.region(region, error),
            SolverError::CurveOnRanks { region } => {
                let name = &self.config.regions.get(region)?.material;
                let material = self.config.materials.get(name)?;
                let key = match (&material.bh, &material.bh_file) {
                    (Some(_), _) => "bh",
                    (None, Some(_)) => "bh_file",
                    (None, None) => "saturation",
                };
                self.at(&format!("materials.{name}.{key}"), error)
            }
            SolverError::SolidOnRanks { coil } => self.at(&format!("{}.conductor", self.coil(coil)?), error),
            SolverError::Layer { body, .. }
            | SolverError::TouchesConductor { body, .. }
            | SolverError::NoLayer { body }
            | SolverError::ForceInShell { body, .. } => {
                let index = self.config.forces.iter().position(|own| own.name == *body)?;
                self.at(&format!("forces[{index}].regions"), error)
            }
            SolverError::PointOutside { wanted_by: PointsOf::Probe(name), .. } => {
                let index = self.config.probes.iter().position(|own| own.name == *name)?;
                self.at(&format!("probes[{index}].points"), error)
            }
            SolverError::PointOutside { wanted_by: PointsOf::Expansion(name), .. } => {
                let index = self.config.multipoles.iter().position(|own| own.name == *name)?;
                Some(self.at(&format!("multipoles[{index}].radius"), error)?.expected(
                    "all of the circle or ball in the mesh, or in its image behind a symmetry plane through the \
                     centre, at right angles to a coordinate axis",
                ))
            }
            SolverError::Mesh(error) => self.mesh(error),
            _ => None,
        }
    }

    fn remesh(&self, error: &RemeshError) -> Option<Diagnostic> {
        let extent = match self.config.remesh.as_ref()?.extent {
            RemeshExtent::Regions(_) => "remesh.region",
            RemeshExtent::Box(_) => "remesh.box",
        };
        match error {
            RemeshError::EmptyRegion | RemeshError::DesignNodeOutside { .. } => self.at(extent, error),
            RemeshError::SurfaceElsewhere { surface, .. } | RemeshError::SlideCurved { surface, .. } => {
                self.at(&self.surface("remesh", surface)?, error)
            }
            RemeshError::Unrestrained { .. } => self.at("remesh", error),
            RemeshError::Parameter { subregion, parameter, .. } => {
                let own =
                    self.config.remesh.as_ref()?.subregions.iter().position(|own| own.name == *subregion);
                let path = match own {
                    Some(index) => format!("remesh.subregions[{index}].{parameter}"),
                    None => format!("remesh.{parameter}"),
                };
                self.at(&path, error)
            }
            RemeshError::Mesh(error) => self.mesh(error),
            _ => None,
        }
    }

    fn mesh(&self, error: &MeshError) -> Option<Diagnostic> {
        match error {
            MeshError::UnknownRegion { name, .. } => self.region(name, error),
            MeshError::UnknownSurface { name, .. } | MeshError::NoInterface { name } => {
                self.at(&self.surface("", name)?, error)
            }
            _ => None,
        }
    }

    /// A fault of a region where objective, constraints or `[regions]` name it.
    fn region(&self, name: &str, error: &dyn std::fmt::Display) -> Option<Diagnostic> {
        let named = regions(self.config).into_iter().find(|(_, own)| *own == name);
        let path = match named {
            Some((path, _)) => path,
            None => self.config.regions.contains_key(name).then(|| format!("regions.{name}"))?,
        };
        self.at(&path, error)
    }

    fn constraint(&self, name: &str, error: &OptimizerError) -> Option<Diagnostic> {
        let index = self.config.constraints.iter().position(|constraint| constraint.name == name)?;
        self.at(&format!("constraints[{index}].upper_ratio"), error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_of_a_linear_solver_names_the_keys_to_change() {
        let failed =
            |cause| SolverError::NotConverged { residual: 1e-3, required: 1e-9, iterations: 9, cause }.into();
        let keys = |cause| keys_of_advice(&failed(cause)).unwrap_or_default();
        assert_eq!(keys(NonConvergence::IllConditioned), "analysis.linear_solver.factor_gib");
        assert!(keys(NonConvergence::OnRanks).starts_with("analysis.petsc.solver"));
        assert_eq!(keys(NonConvergence::Breakdown), "");
    }
}
