//! Injected failures of the sparse factors and of a mesh: damage of every kind is an error that names it.

use std::sync::Arc;

use fluxmorph_geometry::fem::{
    ComponentAnalysis, ComponentPreconditioner, CsrMatrix, DofMap, Incomplete, IncompleteAnalysis,
    IterationStatus, Ldlt, LdltAnalysis, c32, conjugate_gradients, ordering,
};
use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::{ElementId, Mesh, MeshError};

/// Springs along a chain of `n`, each end held: tridiagonal.
fn chain(n: usize) -> CsrMatrix<f64> {
    let entry = |i, j| (j, if i == j { 2.0 } else { -1.0 });
    let row = |i: usize| (i.saturating_sub(1)..(i + 2).min(n)).map(|j| entry(i, j)).collect();
    CsrMatrix::from_rows(n, (0..n).map(row))
}

/// The chain with one stored entry, and its mirror image, replaced.
fn damaged(row: usize, column: usize, value: f64) -> CsrMatrix<f64> {
    let mut matrix = chain(200);
    for (i, j) in [(row, column), (column, row)] {
        let structure = Arc::clone(&matrix.structure);
        let place = structure.row(i).find(|&k| structure.columns[k] as usize == j);
        matrix.values[place.expect("a stored entry")] = value;
    }
    matrix
}

fn symmetric_analysis(matrix: &CsrMatrix<f64>) -> Arc<LdltAnalysis> {
    LdltAnalysis::new(&matrix.structure, ordering::dissection(&matrix.structure)).expect("a pattern")
}

/// Entries that no factor can be made of: on the diagonal and beside it.
fn damages() -> Vec<CsrMatrix<f64>> {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let beside = bad.iter().map(|&value| damaged(100, 101, value));
    bad.iter().map(|&value| damaged(100, 100, value)).chain(beside).collect()
}

#[track_caller]
fn is_refused<T>(factor: Result<T, MeshError>, what: &str) {
    match factor {
        Err(MeshError::Factorisation { unknowns, cause }) => {
            assert!(unknowns == 200 && !cause.is_empty(), "{what}: {cause}");
        }
        Err(other) => panic!("{what}: {other}"),
        Ok(_) => panic!("{what} has a factor"),
    }
}

#[test]
fn a_factor_without_a_positive_pivot_is_none_of_a_positive_definite_matrix() {
    for value in [0.0, -0.0, -1.0, 0.25] {
        // 2 − 1/2 − 1/2 and more is what the neighbours take of it.
        let matrix = damaged(100, 100, value);
        let analysis = symmetric_analysis(&matrix);
        is_refused(Ldlt::positive_definite(&analysis, |_, k| matrix.values[k]), &format!("{value}"));
    }
}

#[test]
fn values_beyond_single_precision_have_no_single_factor_and_a_double_one() {
    let mut matrix = chain(200);
    matrix.values.iter_mut().for_each(|value| *value *= 1e60);
    let analysis = symmetric_analysis(&matrix);
    is_refused(Ldlt::positive_definite(&analysis, |_, k| matrix.values[k] as f32), "f32");
    let factor = Ldlt::positive_definite(&analysis, |_, k| matrix.values[k]);
    let mut x = vec![1e60; 200];
    factor.expect("it is in the range of double precision").solve_in_place(&mut x);
    // K x = 1 with both ends held: x_i = (i + 1)(n − i)/2.
    assert!(x.iter().enumerate().all(|(i, x)| (x / (0.5 * ((i + 1) * (200 - i)) as f64) - 1.0).abs() < 1e-9));
}

#[test]
fn a_symmetric_factor_of_what_is_no_number_is_refused_in_all_number_types() {
    for (k, matrix) in damages().into_iter().enumerate() {
        let analysis = symmetric_analysis(&matrix);
        is_refused(Ldlt::new(&analysis, |_, k| matrix.values[k]), &format!("f64, damage {k}"));
        is_refused(Ldlt::new(&analysis, |_, k| matrix.values[k] as f32), &format!("f32, damage {k}"));
        let complex = |_: usize, k: usize| c32::new(1.0, matrix.values[k] as f32);
        is_refused(Ldlt::new(&analysis, complex), &format!("c32, damage {k}"));
        is_refused(
            Ldlt::positive_definite(&analysis, |_, k| matrix.values[k] as f32),
            &format!("positive definite, damage {k}"),
        );
    }
}

#[test]
fn a_symmetric_factor_that_overflows_single_precision_is_refused() {
    let matrix = damaged(100, 101, 1e30);
    let analysis = symmetric_analysis(&matrix);
    // The square of the coupling, 1e60, is the change of a pivot.
    is_refused(Ldlt::new(&analysis, |_, k| matrix.values[k] as f32), "f32");
    Ldlt::new(&analysis, |_, k| matrix.values[k]).expect("double precision holds it");
}

#[test]
fn an_incomplete_factor_of_what_is_no_number_is_refused() {
    for (k, matrix) in damages().into_iter().enumerate() {
        let analysis = IncompleteAnalysis::in_parts(&matrix.structure, |_, _| true);
        let entry = |_: usize, k: usize| c32::new(matrix.values[k] as f32, 0.0);
        is_refused(Incomplete::new(&analysis, entry, 1.05), &format!("damage {k}"));
    }
    let matrix = damaged(100, 100, 0.0);
    let analysis = IncompleteAnalysis::in_parts(&matrix.structure, |_, _| true);
    is_refused(Incomplete::new(&analysis, |_, k| matrix.values[k], 1.05), "a vanishing diagonal");
}

#[test]
fn component_blocks_of_what_is_no_number_are_refused() {
    for (k, matrix) in damages().into_iter().enumerate() {
        let dofs = DofMap::<1>::new(200, |_, _| true);
        let analysis = ComponentAnalysis::new(&dofs, &matrix.structure).expect("a pattern");
        is_refused(ComponentPreconditioner::new(&analysis, &matrix), &format!("damage {k}"));
    }
}

#[test]
fn conjugate_gradients_on_damaged_parts_stop_and_say_so() {
    let b: Vec<f64> = (0..200).map(|i| (0.37 * f64::from(i)).sin()).collect();
    let plain: fn(&[f64], &mut [f64]) = |r, z| z.copy_from_slice(r);
    for matrix in damages() {
        let (_, report) = conjugate_gradients(&matrix, plain, &b, 1e-12, 500);
        assert_eq!(report.status, IterationStatus::Stopped, "{report:?}");
    }
    let status = |apply: fn(&[f64], &mut [f64]), b: &[f64]| {
        conjugate_gradients(&chain(200), apply, b, 1e-12, 500).1.status
    };
    assert_eq!(status(|_, z| z.fill(f64::NAN), &b), IterationStatus::Stopped);
    assert_eq!(status(|_, z| z.fill(0.0), &b), IterationStatus::Stopped);
    // Squares of the right side overflow.
    assert_eq!(status(plain, &[1e200; 200]), IterationStatus::Stopped);
}

fn cube() -> Mesh {
    block(&BlockParameters { size: [1.0; 3], cells: [2; 3] }).expect("a block")
}

#[test]
fn a_motion_that_is_no_number_makes_no_mesh_and_names_the_node() {
    for bad in [f64::NAN, f64::INFINITY] {
        let mut displacement = vec![[0.0; 3]; 27];
        displacement[13][1] = bad;
        let error = cube().moved(&displacement).expect_err("no place");
        assert!(matches!(error, MeshError::NotFinite { node, .. } if node.index() == 13), "{error}");
    }
}

/// 1e200 is a coordinate, but its cube is no volume.
#[test]
fn coordinates_whose_volumes_overflow_make_no_mesh() {
    for far in [1e110, 1e200, -1e300] {
        let mut displacement = vec![[0.0; 3]; 27];
        displacement[13] = [far, -far, 0.5 * far];
        let error = cube().moved(&displacement).expect_err("no volume");
        assert!(matches!(error, MeshError::Inverted { .. }), "{error}");
    }
    let scaled: Vec<_> = cube().points().iter().map(|p| p.map(|c| 1e120 * c)).collect();
    let error = cube().moved(&scaled).expect_err("every volume overflows");
    assert!(matches!(error, MeshError::Inverted { volume, .. } if !volume.is_finite()), "{error}");
}

#[test]
fn an_element_pressed_flat_makes_no_mesh() {
    let mesh = cube();
    let flat: Vec<_> = mesh.points().iter().map(|p| [0.0, 0.0, -p[2]]).collect();
    let error = mesh.moved(&flat).expect_err("no volume");
    assert!(matches!(error, MeshError::Inverted { element: ElementId(0), volume: 0.0, .. }), "{error}");
}
