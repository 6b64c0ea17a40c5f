//! How a field model is made from its set-up on a reference mesh.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::tet4::Point;

use super::{FieldModel, SharedParts};
use crate::circuit::{self, Solids, Windings, solids};
use crate::coil::continuity;
use crate::discretisation::Discretisation;
use crate::distributed::{Distributed, Follower};
use crate::error::SolverError;
use crate::linear::{FieldKind, SystemAnalysis, SystemPattern};
use crate::load::Sources;
use crate::setup::{self, FieldModelSetup};
use crate::weak_form::WeakForm;

impl FieldModel {
    /// Sets up the problem on a reference mesh: equation numbers, pattern, symbolic factor, coil integrals.
    ///
    /// # Errors
    /// [`SolverError`] names what is missing or out of range.
    pub fn new(mesh: &Mesh, setup: FieldModelSetup) -> Result<Self, SolverError> {
        let (angular_frequency, weak_form) = Self::form_of(mesh, &setup)?;
        let ownership = setup.ownership.as_ref().map(|(ownership, _)| ownership);
        let fine =
            Discretisation::new(mesh, (setup.family, setup.order), &weak_form, &setup.boundaries, ownership)?;
        let field = if angular_frequency == 0.0 { FieldKind::Static } else { FieldKind::Harmonic };
        let pattern = SystemPattern {
            structure: fine.pattern.structure(),
            hosts: fine.hosts(),
            reference: &|| fine.assemble(&weak_form, None, mesh),
            prolongation: &|matrix| fine.prolongation(mesh, &weak_form, &setup.boundaries, matrix),
        };
        let analysis = match ownership {
            None => Some(SystemAnalysis::new(pattern, (field, setup.order), setup.linear_solver)?),
            Some(_) => None,
        };
        let magnetisation: Vec<Point> = setup
            .remanence
            .iter()
            .zip(&setup.materials)
            .map(|(b, m)| b.map(|b| m.reluctivity() * b))
            .collect();
        let of_coils =
            circuit::windings(mesh, &setup.coils, &setup.windings, &setup.materials, angular_frequency)?;
        let given = circuit::given_currents(&setup.coils, &of_coils, angular_frequency);
        let sources = Sources::new(mesh, &given, &magnetisation)?;
        let solids = Solids::new(&setup.coils, &fine.space, angular_frequency);
        let windings = Windings::new(mesh, &setup.coils, &of_coils, (&fine.space, &fine.unknowns, &solids))?;
        let windings = Arc::new(windings);
        setup::check_coils(mesh, &setup)?;
        let conductors = weak_form.conductors();
        solids::check(mesh, &setup.coils, &conductors, &setup.boundaries)?;
        // The net current of a solid conductor is given: no other returns through it.
        let conductors = conductors.without(&solids::elements(&setup.coils));
        let mut joined = conductors.joined(mesh, &setup.boundaries)?;
        let curl_free = (&fine.space, fine.unknowns.harmonic_fields());
        continuity::check(mesh, &setup.coils, &mut joined, curl_free)?;
        if let Some(shell) = weak_form.shell() {
            setup::check_open(shell, mesh, &setup, sources.fixed_elements())?;
        }
        let shared =
            Arc::new(SharedParts { fine, sources, solids, windings, analysis: analysis.map(Arc::new) });
        Ok(Self::whole(setup, (angular_frequency, weak_form), shared))
    }

    /// The model, distributed where it has ranks.
    fn whole(
        setup: FieldModelSetup,
        (angular_frequency, weak_form): (f64, WeakForm),
        shared: Arc<SharedParts>,
    ) -> Self {
        let setup = Arc::new(setup);
        let weak_form = Arc::new(weak_form);
        let mut model = Self { setup, angular_frequency, weak_form, shared, distributed: None };
        if let Some((ownership, settings)) = &model.setup.ownership {
            let follower = Follower::new(model.clone(), ownership.clone(), settings);
            model.distributed = Some(Arc::new(Distributed::new(&ownership.group, Box::new(follower))));
        }
        model
    }

    /// The same problem at another frequency [Hz]; between frequencies above zero, equation numbers, pattern, symbolic
    /// factor and coil integrals are shared.
    ///
    /// # Errors
    /// As [`FieldModel::new`].
    pub fn at_frequency(&self, mesh: &Mesh, frequency: f64) -> Result<Self, SolverError> {
        let setup = FieldModelSetup { frequency, ..(*self.setup).clone() };
        if frequency == 0.0 || self.angular_frequency == 0.0 {
            return Self::new(mesh, setup);
        }
        let weak_form = Self::form_of(mesh, &setup)?;
        Ok(Self::whole(setup, weak_form, Arc::clone(&self.shared)))
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
