//! The elastic system distributed over ranks: rows, factors and quality of each rank's own part.
//!
//! Several references may be in use at once, as when a fallback is tried; each has a *slot* with its matrix on every rank.
//! Prescribed displacements, couplings and the mesh check stay with rank 0.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use fluxmorph_geometry::fem::{BlockPattern, BoundGroup, CsrMatrix, DofMap, c64};
use fluxmorph_geometry::parallel::{
    Command, CommandChannel, CommandHandler, Communicator, DistributedMatrix, Krylov, Ownership,
    Preconditioning, Role, RowLayout, Rows, SolverOptions, SubSolver, solution_of,
};
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{CarrierId, ElementId, Mesh, NodeId};

use crate::body::Body;
use crate::deform::bind_pattern;
use crate::error::RemeshError;
use crate::freedom::Freedom;
use crate::policy::StiffnessPolicy;
use crate::solver::{MAX_ITERATIONS, TOLERANCE};

/// The command to assemble and factor: slot, policy, places of the nodes.
const FACTOR: u32 = 1;
/// The command to solve: slot, right side.
const SOLVE: u32 = 2;
/// The command to forget a slot.
const RELEASE: u32 = 3;
/// The command to judge the elements that may move: places of the nodes.
const QUALITY: u32 = 4;

/// Unknowns up to which a distributed factor is taken.
const LARGEST_DIRECT: usize = 400_000;

/// The distributed elastic system, as rank 0 holds it.
#[derive(Debug)]
pub(crate) struct DistributedElastic {
    channel: CommandChannel,
    next: AtomicU64,
    unknowns: usize,
}

impl DistributedElastic {
    /// Distributes a body; every rank does.
    pub(crate) fn new(
        ownership: &Ownership,
        (body, unknowns): (&Arc<Body>, &Arc<Freedom>),
        moving: &Arc<[ElementId]>,
    ) -> Self {
        let handler = ElasticHandler::new(ownership, (body, unknowns), moving);
        let channel = ownership.group.register(Box::new(handler));
        Self { channel, next: AtomicU64::new(0), unknowns: unknowns.dofs().count() }
    }

    /// Has all ranks assemble and factor on a reference; the slot. Workers have none of their own.
    ///
    /// # Errors
    /// [`RemeshError::Rank`].
    pub(crate) fn factor(
        &self,
        reference: &Mesh,
        policy: StiffnessPolicy,
    ) -> Result<Option<u64>, RemeshError> {
        if self.unknowns == 0 || self.channel.group().role() == Role::Worker {
            return Ok(None);
        }
        let slot = self.next.fetch_add(1, Ordering::SeqCst);
        let policy = StiffnessPolicy::ALL.iter().position(|&p| p == policy).expect("all are listed");
        let mut numbers = vec![slot as f64, policy as f64];
        numbers.extend_from_slice(reference.points().as_flattened());
        if let Err(error) = self.channel.execute(FACTOR, numbers) {
            // Where it did not fail, it is kept.
            self.release(slot);
            return Err(error.into());
        }
        Ok(Some(slot))
    }

    /// Solves with the matrix of a slot.
    ///
    /// # Errors
    /// [`RemeshError::Rank`], [`RemeshError::NotConverged`].
    pub(crate) fn solve(&self, slot: u64, right_side: &[f64]) -> Result<Vec<f64>, RemeshError> {
        if right_side.iter().all(|&b| b == 0.0) {
            return Ok(right_side.to_vec());
        }
        let mut numbers = vec![slot as f64];
        numbers.extend_from_slice(right_side);
        let answer = self.channel.execute(SOLVE, numbers)?;
        let (solution, solved) = solution_of(&answer);
        // The recurrence of the iteration and the true residual part in the last digits.
        if solved.residual.is_nan() || solved.residual > 10.0 * TOLERANCE {
            return Err(RemeshError::NotConverged {
                unknowns: self.unknowns,
                iterations: solved.iterations,
                residual: solved.residual,
                tolerance: TOLERANCE,
            });
        }
        Ok(solution.iter().map(|x| x.re).collect())
    }

    /// Forgets the matrix of a slot.
    pub(crate) fn release(&self, slot: u64) {
        if !std::thread::panicking() {
            // A rank that failed is named by the next command that has an answer.
            let _ = self.channel.execute(RELEASE, vec![slot as f64]);
        }
    }

    /// Quality of the elements that may move, every rank of its own; `None` at a worker.
    ///
    /// # Errors
    /// [`RemeshError::Rank`].
    pub(crate) fn quality(&self, mesh: &Mesh) -> Result<Option<QualityReport>, RemeshError> {
        if self.channel.group().role() == Role::Worker {
            return Ok(None);
        }
        let of_ranks = self.channel.execute(QUALITY, mesh.points().as_flattened().to_vec())?;
        let reports = of_ranks.chunks_exact(QualityReport::NUMBERS).map(QualityReport::of_numbers);
        Ok(reports.reduce(QualityReport::with).map(|report| report.located_on(mesh)))
    }
}

/// What a rank holds of the elastic system.
struct ElasticHandler {
    body: Arc<Body>,
    unknowns: Arc<Freedom>,
    layout: Arc<RowLayout>,
    pattern: BlockPattern<3>,
    group: BoundGroup<4>,
    /// Positions in the body of the elements of `group`.
    held: Vec<u32>,
    /// Those of the elements that may move which the rank owns.
    moving: Vec<ElementId>,
    slots: BTreeMap<u64, DistributedMatrix>,
}

impl ElasticHandler {
    fn new(
        ownership: &Ownership,
        (body, unknowns): (&Arc<Body>, &Arc<Freedom>),
        moving: &[ElementId],
    ) -> Self {
        let topology = &body.topology;
        let owner = |carrier: CarrierId| ownership.partition.owner_of(NodeId::new(carrier.index()));
        let layout =
            Arc::new(RowLayout::new(unknowns.dofs(), ownership.group.size(), ownership.group.rank(), owner));
        let rows = DofMap::of_nodes(topology.node_count(), |node, c| {
            ownership.owns(node) && unknowns.dofs().equation(node, c).is_some()
        });
        let touches = |e: ElementId| topology.tet(e).iter().any(|&n| ownership.owns(n));
        let held: Vec<u32> =
            (0..).zip(&body.elements).filter(|&(_, &e)| touches(e)).map(|(position, _)| position).collect();
        let connectivity = held.iter().map(|&position| topology.tet(body.elements[position as usize]));
        let (pattern, group) = bind_pattern(&rows, unknowns.dofs(), connectivity.collect());
        let moving = ownership.owned_among(moving);
        let (body, unknowns, slots) = (Arc::clone(body), Arc::clone(unknowns), BTreeMap::new());
        Self { body, unknowns, layout, pattern, group, held, moving, slots }
    }

    fn factor(
        &mut self,
        slot: u64,
        policy: StiffnessPolicy,
        reference: &Mesh,
        ranks: &dyn Communicator,
    ) -> Result<(), String> {
        let weighting = policy.weighting(reference, &self.body.elements);
        let mut matrix = CsrMatrix::<f64>::zeros(self.pattern.structure());
        self.pattern.assemble(&self.group, &mut matrix.values, |e| {
            let position = self.held[e.index()] as usize;
            let nodes = self.body.topology.tet(self.body.elements[position]);
            self.unknowns.turned(self.body.stiffness(reference, &weighting, position), nodes)
        });
        let values: Vec<c64> = matrix.values.iter().map(|&v| c64::from(v)).collect();
        let structure = Arc::clone(self.pattern.structure());
        let rows = Rows { structure, layout: Arc::clone(&self.layout), coarse: None };
        let mut matrix = DistributedMatrix::new(rows, options(self.layout.count()));
        matrix.set(&values, ranks)?;
        self.slots.insert(slot, matrix);
        Ok(())
    }

    fn mesh(&self, points: &[f64]) -> Result<Mesh, String> {
        let points = points.as_chunks::<3>().0.to_vec();
        Mesh::new(Arc::clone(&self.body.topology), points).map_err(|error| error.to_string())
    }
}

/// How the elastic system is solved.
fn options(unknowns: usize) -> SolverOptions {
    let schwarz = Preconditioning::Schwarz { overlap: 2, sub_solver: SubSolver::Incomplete };
    SolverOptions {
        prefix: "elastic_",
        krylov: Krylov::Cg,
        preconditioning: if unknowns <= LARGEST_DIRECT { Preconditioning::Direct } else { schwarz },
        tolerance: TOLERANCE,
        max_iterations: MAX_ITERATIONS,
    }
}

impl CommandHandler for ElasticHandler {
    fn handle(&mut self, command: &Command, ranks: &dyn Communicator) -> Result<Vec<f64>, String> {
        match (command.kind, command.numbers.as_slice()) {
            (FACTOR, [slot, policy, points @ ..]) => {
                let policy = StiffnessPolicy::ALL[*policy as usize];
                let reference = self.mesh(points)?;
                self.factor(*slot as u64, policy, &reference, ranks)?;
                Ok(Vec::new())
            }
            (SOLVE, [slot, right_side @ ..]) => {
                let matrix = self.slots.get_mut(&(*slot as u64)).ok_or("there is no such slot")?;
                let pairs: Vec<f64> = right_side.iter().flat_map(|&b| [b, 0.0]).collect();
                matrix.solve(&pairs, ranks)
            }
            (RELEASE, [slot]) => {
                self.slots.remove(&(*slot as u64));
                Ok(Vec::new())
            }
            (QUALITY, points) => {
                let points: Vec<Point> = points.as_chunks::<3>().0.to_vec();
                let own = QualityReport::of_points(&self.body.topology, &points, &self.moving);
                let numbers = own.map_or(Vec::new(), |report| report.numbers().to_vec());
                Ok(ranks.gather(&numbers).concat())
            }
            (other, _) => Err(format!("an elastic body has no command {other}")),
        }
    }
}
