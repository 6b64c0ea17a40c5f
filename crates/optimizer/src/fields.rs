//! The arrays that a design leaves for ParaView (docs/configuration.md lists them with their units).

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::io::{ArrayData, Field, vtu_bytes};
use fluxmorph_geometry::quality::qualities;
use fluxmorph_geometry::tet4::Point;

use crate::problem::{Analysis, Problem};

/// The VTU file of an analysed design: the moved mesh, potentials, displacement and sensitivity at its nodes; fields,
/// loss, region and quality in its elements.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] names an array that is not finite: nothing of it is written.
pub fn vtu(problem: &Problem, analysis: &Analysis) -> Result<Vec<u8>, MeshError> {
    let (model, solution) = (&problem.states[0], &analysis.solutions[0]);
    let mesh = &analysis.mesh;
    let nodes = mesh.topology().nodes();
    let potentials: Vec<[c64; 4]> = nodes.map(|n| solution.potentials(model, n)).collect();
    let a_re: Vec<Point> = potentials.iter().map(|p| [p[0].re, p[1].re, p[2].re]).collect();
    let a_im: Vec<Point> = potentials.iter().map(|p| [p[0].im, p[1].im, p[2].im]).collect();
    let psi_re: Vec<f64> = potentials.iter().map(|p| p[3].re).collect();
    let psi_im: Vec<f64> = potentials.iter().map(|p| p[3].im).collect();
    let zeros;
    let sensitivity = match &analysis.sensitivity {
        Some(sensitivity) => sensitivity,
        None => {
            zeros = vec![[0.0; 3]; mesh.points().len()];
            &zeros
        }
    };
    let (b_re, b_im) = parts(&solution.flux_densities(model, mesh));
    let b_abs: Vec<f64> = b_re
        .iter()
        .zip(&b_im)
        .map(|(re, im)| re.iter().chain(im).map(|c| c * c).sum::<f64>().sqrt())
        .collect();
    let (j_re, j_im) = parts(&solution.current_densities(model, mesh));
    let loss = solution.loss_densities(model, mesh);
    let region: Vec<i32> = mesh.topology().region_of().iter().map(|r| r.0 as i32).collect();
    let quality = qualities(mesh);
    let vector = |name, data| Field { name, data: ArrayData::Vector(data) };
    let scalar = |name, data| Field { name, data: ArrayData::Scalar(data) };
    vtu_bytes(
        mesh,
        &[
            vector("A_re", &a_re),
            vector("A_im", &a_im),
            scalar("psi_re", &psi_re),
            scalar("psi_im", &psi_im),
            vector("displacement", &analysis.displacement),
            vector("sensitivity", sensitivity),
        ],
        &[
            vector("B_re", &b_re),
            vector("B_im", &b_im),
            scalar("B_abs", &b_abs),
            vector("J_re", &j_re),
            vector("J_im", &j_im),
            scalar("loss_density", &loss),
            Field { name: "region", data: ArrayData::Integer(&region) },
            scalar("quality", &quality),
        ],
    )
}

/// Real and imaginary parts.
fn parts(values: &[[c64; 3]]) -> (Vec<Point>, Vec<Point>) {
    (values.iter().map(|v| v.map(|c| c.re)).collect(), values.iter().map(|v| v.map(|c| c.im)).collect())
}
