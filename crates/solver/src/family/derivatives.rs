//! What every family and order makes of an element, against central differences; and elements of air by their scalars.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, Tet4};

use super::{Cell, EDGE_1, EDGE_2, Matrices, NODAL_1, NODAL_2};
use crate::element::density::squared_deviation;
use crate::element::differences::{SKEW, assert_shape_derivative, bilinear, derivatives_hold, values};
use crate::element::volume::Coefficients;
use crate::surface::SurfaceTerm;

const LAW: Coefficients = Coefficients { reluctivity: 1.7, extra_penalty: 0.6, eddy: c64::new(0.0, 2.3) };

/// Between the fields of two seeds, the second of choice.
fn tetrahedra<const N: usize, const F: usize>(
    family: &impl Matrices<N, F>,
    seed: u32,
    [of_matrix, of_load]: [f64; 2],
) {
    let cell = |vertices| Cell { tet: Tet4::new(vertices), order: [2, 0, 3, 1] };
    let (l, u) = (values::<N, 4>(1), values::<N, 4>(seed));
    let value = |vertices| {
        let matrix = family.tet(cell(vertices), LAW);
        bilinear(&l, |a, b| matrix.block(a, b), &u)
    };
    let exact = family.shape_derivative(&cell(SKEW), &LAW, &l, &u);
    assert_shape_derivative([1e-5, of_matrix], SKEW, value, &exact);

    let (l, source) = (values::<N, 4>(7), [0.3, -1.2, 0.8]);
    let value = |vertices| -> c64 {
        let cell = cell(vertices);
        let load = family.curl_load(&cell, &[source.map(|t| c64::from(0.25 * cell.tet.volume * t)); 4]);
        load.values().as_flattened().iter().zip(l.as_flattened()).map(|(f, l)| f * l).sum()
    };
    let exact = family.magnet_shape_derivative(&cell(SKEW), source, &l);
    assert_shape_derivative([1e-5, of_load], SKEW, value, &exact);
}

#[test]
fn matrices_and_loads_of_magnets_have_their_shape_derivatives() {
    tetrahedra(&*NODAL_1, 140, [1e-8, 1e-9]);
    tetrahedra(&*NODAL_2, 140, [1e-8, 1e-9]);
    tetrahedra(&*EDGE_1, 90, [1e-7, 1e-8]);
    tetrahedra(&*EDGE_2, 90, [1e-7, 1e-8]);
}

fn integrals<const N: usize, const F: usize>(family: &impl Matrices<N, F>) {
    let cell = |vertices| Cell { tet: Tet4::new(vertices), order: [1, 3, 0, 2] };
    derivatives_hold::<N, 4>(SKEW, |x, u| {
        family.flux_integral(&cell(x), &u, &mut squared_deviation(0.7, [0.4, -0.2, 0.9]))
    });
    derivatives_hold::<N, 4>(SKEW, |x, u| family.eddy_loss(&cell(x), 1.3, &u));
}

#[test]
fn energy_and_loss_have_the_derivatives_of_differences() {
    integrals(&*NODAL_1);
    integrals(&*NODAL_2);
    integrals(&*EDGE_1);
    integrals(&*EDGE_2);
}

fn triangles<const N: usize, const F: usize>(family: &impl Matrices<N, F>) {
    let triangle: [Point; 3] = [[0.1, 0.0, 0.2], [1.1, 0.3, 0.0], [0.2, 0.8, 0.5]];
    let (l, u) = (values::<F, 4>(5), values::<F, 4>(60));
    let impedance = SurfaceTerm::Impedance(c64::new(0.7, 0.7), 0);
    // The interface is linear in each coordinate: exact at any step. Edge elements have none.
    for (term, step) in [(impedance, [1e-5, 1e-8]), (SurfaceTerm::Interface(1.3), [0.5, 1e-13])] {
        let value = |vertices| {
            let matrix = family.triangle(vertices, term);
            bilinear(&l, |a, b| matrix.block(a, b), &u)
        };
        let exact = family.surface_derivative(triangle, term, &l, &u);
        assert_shape_derivative(step, triangle, value, &exact);
    }
    derivatives_hold::<F, 3>(triangle, |x, u| family.surface_loss(x, 0.9, &u));
}

#[test]
fn terms_and_losses_of_surfaces_have_the_derivatives_of_differences() {
    triangles(&*NODAL_1);
    triangles(&*NODAL_2);
    triangles(&*EDGE_1);
    triangles(&*EDGE_2);
}

fn air<const N: usize, const F: usize>(family: &impl Matrices<N, F>) {
    let cell = Cell { tet: Tet4::new(SKEW), order: [0, 1, 2, 3] };
    let law = Coefficients { extra_penalty: 0.0, eddy: c64::default(), ..LAW };
    let matrix = family.tet(cell, law);
    let scalars = matrix.scalars().expect("nothing couples components");
    for (a, b) in (0..N).flat_map(|a| (a..N).map(move |b| (a, b))) {
        let block = matrix.block(a, b);
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let expected = if i == j && i < 3 { scalars[a][b] } else { 0.0 };
            assert!((block[i][j] - expected).norm() < 1e-15);
        }
    }
    for coupled in [Coefficients { eddy: LAW.eddy, ..law }, Coefficients { extra_penalty: 0.1, ..law }] {
        assert!(family.tet(cell, coupled).scalars().is_none());
    }
}

#[test]
fn a_nodal_element_of_air_is_given_by_its_scalars() {
    air(&*NODAL_1);
    air(&*NODAL_2);
}
