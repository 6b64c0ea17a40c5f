//! How a field model is made from its set-up on a reference mesh.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;

use super::{FieldModel, SharedParts};
use crate::circuit::{self, Solids, Winding, Windings, solids};
use crate::coil::{Coil, continuity};
use crate::discretisation::Discretisation;
use crate::distributed::{Distributed, Follower};
use crate::elements::ElementFamily;
use crate::error::SolverError;
use crate::linear::{FieldKind, SystemAnalysis, SystemPattern};
use crate::load::Sources;
use crate::load_case::LoadCase;
use crate::recovery::Walls;
use crate::setup::{self, FieldModelSetup};
use crate::weak_form::WeakForm;

impl FieldModel {
    /// Sets up the problem on a reference mesh: equation numbers, pattern, symbolic factor, coil integrals.
    ///
    /// # Errors
    /// [`SolverError`] names what is missing or out of range.
    pub fn new(mesh: &Mesh, setup: FieldModelSetup) -> Result<Self, SolverError> {
        Self::with_sources(mesh, setup, None)
    }

    /// The same; integrals of the coils over the elements are taken from a `known` model on this mesh that has the same currents. At
    /// 0 Hz a solid conductor has another resistance in another order, and a voltage drives another current.
    pub(crate) fn with_sources(
        mesh: &Mesh,
        setup: FieldModelSetup,
        known: Option<&Self>,
    ) -> Result<Self, SolverError> {
        let (angular_frequency, weak_form) = Self::form_of(mesh, &setup)?;
        let ownership = setup.ownership.as_ref().map(|(ownership, _)| ownership);
        let fine =
            Discretisation::new(mesh, (setup.family, setup.order), &weak_form, &setup.boundaries, ownership)?;
        let field = if angular_frequency == 0.0 { FieldKind::Static } else { FieldKind::Harmonic };
        let tolerance = setup.linear_solver.tolerance;
        let pattern = SystemPattern {
            structure: fine.pattern.structure(),
            hosts: fine.hosts(),
            changes: fine.changes(&setup.moving, &weak_form),
            reference: &|| fine.assemble(&weak_form, mesh),
            prolongation: &|matrix| {
                fine.prolongation(mesh, &weak_form, &setup.boundaries, (matrix, tolerance))
            },
        };
        let analysis = match ownership {
            None => {
                Some(SystemAnalysis::new(pattern, (field, (setup.family, setup.order)), setup.linear_solver)?)
            }
            Some(_) => None,
        };
        let of_coils = Self::windings_of(mesh, &setup, angular_frequency)?;
        let given = circuit::given_currents(&setup.coils, &of_coils, angular_frequency);
        let sources = match known {
            Some(model) if model.given_currents(mesh)? == given => Arc::clone(&model.sources),
            _ => Arc::new(Sources::new(mesh, &given, &setup.magnetisation())?),
        };
        let solids = Solids::new(&setup.coils, &fine.space, angular_frequency);
        let known = known.map(|model| &*model.windings);
        let spaces = (&fine.space, &fine.unknowns, &solids);
        let windings = Windings::new(mesh, &setup.coils, (&of_coils, known), spaces)?;
        setup::check_coils(mesh, &setup)?;
        let conductors = weak_form.conductors();
        solids::check(mesh, &setup.coils, (&conductors, &setup.materials), &setup.boundaries)?;
        let gradients: &[_] = if setup.family == ElementFamily::Nodal { &conductors.surface } else { &[] };
        let replaced = setup.conductors.iter().flat_map(|own| own.surface.iter().copied());
        let walls = Walls::new(mesh, &setup.boundaries, replaced, gradients)?;
        // The net current of a solid conductor is given: no other returns through it.
        let conductors = conductors.without(&solids::elements(&setup.coils));
        let mut joined = conductors.joined(mesh, &setup.boundaries)?;
        let curl_free = (&fine.space, fine.unknowns.harmonic_fields());
        continuity::check(mesh, &setup.coils, &mut joined, curl_free)?;
        if let Some(shell) = weak_form.shell() {
            setup::check_open(shell, mesh, &setup, sources.coil_elements())?;
        }
        let shared = Arc::new(SharedParts { fine, solids, walls, analysis: analysis.map(Arc::new) });
        let (setup, weak_form) = (Arc::new(setup), Arc::new(weak_form));
        let windings = Arc::new(windings);
        let model =
            Self { setup, angular_frequency, weak_form, shared, sources, windings, distributed: None };
        Ok(model.distributed_over_ranks(mesh))
    }

    /// The windings of all coils of a setup.
    fn windings_of(
        mesh: &Mesh,
        setup: &FieldModelSetup,
        angular_frequency: f64,
    ) -> Result<Vec<Option<Winding>>, SolverError> {
        let coils = (&*setup.coils, &*setup.windings);
        circuit::windings(mesh, setup.order, coils, &setup.materials, angular_frequency)
    }

    /// The coils whose currents are known before the field is.
    fn given_currents(&self, mesh: &Mesh) -> Result<Vec<Coil>, SolverError> {
        let of_coils = Self::windings_of(mesh, &self.setup, self.angular_frequency)?;
        Ok(circuit::given_currents(&self.setup.coils, &of_coils, self.angular_frequency))
    }

    /// The same, distributed where it has ranks and is not yet.
    fn distributed_over_ranks(mut self, reference: &Mesh) -> Self {
        if let (Some((ownership, settings)), None) = (&self.setup.ownership, &self.distributed) {
            let follower = Follower::new(self.clone(), reference, ownership.clone(), settings);
            self.distributed = Some(Arc::new(Distributed::new(&ownership.group, Box::new(follower))));
        }
        self
    }

    /// The same problem under another load case. Equation numbers, pattern, symbolic factor and the loads of 1 A are shared
    /// between frequencies above zero and between load cases in statics; the matrix too between those of one frequency.
    ///
    /// # Errors
    /// As [`FieldModel::new`].
    pub fn at_load_case(&self, mesh: &Mesh, load_case: &LoadCase) -> Result<Self, SolverError> {
        let setup = load_case.applied_to(&self.setup);
        if (setup.frequency == 0.0) != (self.angular_frequency == 0.0) {
            return Self::new(mesh, setup);
        }
        let has_same_matrix = setup.frequency == self.setup.frequency;
        let (angular_frequency, weak_form) = if has_same_matrix {
            setup::check(mesh, &setup)?;
            (self.angular_frequency, Arc::clone(&self.weak_form))
        } else {
            let (angular_frequency, weak_form) = Self::form_of(mesh, &setup)?;
            (angular_frequency, Arc::new(weak_form))
        };
        let own = self.given_currents(mesh)?;
        let of_coils = Self::windings_of(mesh, &setup, angular_frequency)?;
        let given = circuit::given_currents(&setup.coils, &of_coils, angular_frequency);
        let sources = if given == own {
            Arc::clone(&self.sources)
        } else {
            Arc::new(Sources::new(mesh, &given, &setup.magnetisation())?)
        };
        if let Some(shell) = weak_form.shell() {
            setup::check_open(shell, mesh, &setup, sources.coil_elements())?;
        }
        let windings = Arc::new(self.windings.driven_as(&of_coils));
        let distributed = self.distributed.clone().filter(|_| has_same_matrix);
        let (setup, shared) = (Arc::new(setup), Arc::clone(&self.shared));
        let model = Self { setup, angular_frequency, weak_form, shared, sources, windings, distributed };
        Ok(model.distributed_over_ranks(mesh))
    }

    /// Checks a set-up; `ω` [rad/s] and the weak form.
    fn form_of(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(f64, WeakForm), SolverError> {
        setup::check(mesh, setup)?;
        let angular_frequency = 2.0 * std::f64::consts::PI * setup.frequency;
        let numbers = (angular_frequency, setup.penalty);
        let form = WeakForm::new(
            mesh,
            (setup.family, setup.order),
            numbers,
            &setup.materials,
            &setup.boundaries,
            &setup.conductors,
            setup.open.as_ref(),
        )?;
        Ok((angular_frequency, form.with_curves(&setup.bh)))
    }
}
