//! What a law makes of the designs of a kind.

use cpu_time::ProcessTime;
use fluxmorph_geometry::tet4::volume;
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{Motion, MotionLaw, Moved, RemeshError, RemeshSetup, StiffnessPolicy};

use crate::support::Point;

/// A mesh and its elastic body, whose law and policy are those of the measurement.
pub(crate) struct Device {
    pub(crate) mesh: Mesh,
    pub(crate) setup: RemeshSetup,
}

/// Designs of one kind: displacements of the design nodes [m].
pub(crate) struct Kind {
    pub(crate) name: String,
    pub(crate) designs: Vec<Vec<Point>>,
}

/// What a law makes of them.
pub(crate) struct Row {
    /// Designs that were tried, and of these those that are carried.
    tried: usize,
    pub(crate) carried: usize,
    /// Least ratio of an element's volumes and worst quality over the carried designs, and most Newton steps.
    pub(crate) stretch: f64,
    pub(crate) quality: f64,
    pub(crate) steps: usize,
    /// CPU seconds a design.
    pub(crate) time: f64,
}

impl Device {
    pub(crate) fn motion(&self, law: MotionLaw) -> Motion {
        let setup = RemeshSetup { law, policy: StiffnessPolicy::InverseVolume, ..self.setup.clone() };
        Motion::new(self.mesh.clone(), setup).expect("a sound body")
    }

    /// One kind that moves the design nodes by a function of their place.
    pub(crate) fn moved(&self, name: &str, by: impl Fn(Point) -> Point) -> Kind {
        let design = |n: &NodeId| by(self.mesh.point(*n));
        let designs = vec![self.setup.design_nodes.iter().map(design).collect()];
        Kind { name: name.to_owned(), designs }
    }
}

fn least_stretch(mesh: &Mesh, moved: &Moved) -> f64 {
    let ratio = |e| volume(moved.mesh.vertices(e)) / volume(mesh.vertices(e));
    mesh.topology().elements().map(ratio).fold(f64::INFINITY, f64::min)
}

/// What a motion makes of designs of a kind, each on its own.
pub(crate) fn measured(motion: &Motion, designs: &[Vec<Point>]) -> Row {
    let (tried, least) = (designs.len(), f64::INFINITY);
    let mut row = Row { tried, carried: 0, stretch: least, quality: least, steps: 0, time: 0.0 };
    for design in designs {
        let clock = ProcessTime::now();
        let moved = motion.moved(design);
        row.time += clock.elapsed().as_secs_f64() / tried as f64;
        match moved {
            Ok(moved) => {
                row.carried += 1;
                row.stretch = row.stretch.min(least_stretch(motion.original(), &moved));
                row.quality = row.quality.min(motion.quality(&moved.mesh).worst);
                row.steps = row.steps.max(moved.newton_steps);
            }
            Err(RemeshError::Inverted { .. } | RemeshError::NotSettled { .. }) => {}
            Err(other) => panic!("{other}"),
        }
    }
    row
}

impl Row {
    /// Its cells of the table: carried, of how many where that is not the `of` of the row, least ratio of volumes, worst
    /// quality, Newton steps, CPU time.
    pub(crate) fn cells(&self, of: usize) -> String {
        let Self { tried, carried, stretch, quality, steps, time } = self;
        let share = if *tried < of { format!("{carried} of {tried}") } else { carried.to_string() };
        if *carried == 0 {
            return format!("{share} | – | – | – | {time:.3}");
        }
        let short = |x: f64| if x < 1e-3 { format!("{x:.0e}") } else { format!("{x:.3}") };
        format!("{share} | {} | {} | {steps} | {time:.3}", short(*stretch), short(*quality))
    }
}
