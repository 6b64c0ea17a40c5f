//! Injected failures of the linear solver and its inputs: each method, each kind of damage, ends in a more robust method or
//! in an error that names the cause; never in a number that is none.

use crate::{OUTSIDE, STEEL, flux_parallel, lines, on_threads, painted};
use fluxmorph_geometry::fem::{CsrMatrix, c64};
use fluxmorph_geometry::{Mesh, MeshError, NodeId};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::linear::{
    LinearSolver, LinearSolverCache, LinearSolverSettings, Method, Reuse, SolverEvent,
};
use fluxmorph_solver::{
    Conductor, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Material, NonConvergence,
    SolverError, SurfaceLaw, Winding,
};

/// A steel plate under a coil, some hundred nodes.
fn mesh() -> Mesh {
    let plate = |x: [f64; 3]| u32::from((0.01..0.03).contains(&x[2]) && x[0] > 0.01 && x[1] > 0.01);
    painted([6, 6, 8].map(|n| lines(n, 0.01)), &["air", "plate"], plate)
}

fn setup(settings: LinearSolverSettings, ampere_turns: c64, plate: Material) -> FieldModelSetup {
    let shape = Racetrack::new([0.03, 0.03, 0.06], 2, [0.008, 0.008], 0.01, 0.01, Corner::Mitred)
        .expect("a racetrack inside the mesh");
    FieldModelSetup {
        family: ElementFamily::Nodal,
        frequency: 50.0,
        materials: vec![Material::AIR, plate],
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns, shape: shape.into() }],
        boundaries: flux_parallel(&OUTSIDE),
        linear_solver: settings,
        ..FieldModelSetup::default()
    }
}

fn fixed(method: Method) -> LinearSolverSettings {
    LinearSolverSettings { method: LinearSolver::Fixed(method), ..LinearSolverSettings::default() }
}

fn model(settings: LinearSolverSettings) -> (Mesh, FieldModel) {
    let mesh = mesh();
    let model = FieldModel::new(&mesh, setup(settings, c64::new(1e3, 0.0), STEEL)).expect("a sound problem");
    (mesh, model)
}

/// Place of the diagonal entry of a row, and of its first other entry.
fn places(matrix: &CsrMatrix<c64>, row: usize) -> (usize, usize) {
    let range = matrix.structure.row(row);
    let is_diagonal = |&k: &usize| matrix.structure.columns[k] as usize == row;
    let diagonal = range.clone().find(is_diagonal).expect("every row has its diagonal");
    (diagonal, range.clone().find(|k| !is_diagonal(k)).expect("no row stands alone"))
}

/// Damages a row's diagonal.
fn with_diagonal(mut matrix: CsrMatrix<c64>, value: c64) -> CsrMatrix<c64> {
    let row = matrix.structure.row_count() / 2;
    let (diagonal, _) = places(&matrix, row);
    matrix.values[diagonal] = value;
    matrix
}

/// Every method's system with a damaged matrix, of which no method has a factor: the cause.
#[track_caller]
fn no_method_factors(damage: impl Fn(CsrMatrix<c64>) -> CsrMatrix<c64>) -> Vec<String> {
    let cause = |method: Method| {
        let (mesh, model) = model(fixed(method));
        match model.prepare(damage(model.assemble(&mesh))) {
            Err(SolverError::Mesh(MeshError::Factorisation { cause, .. })) => cause,
            Err(other) => panic!("{method:?}: {other}"),
            Ok(system) => panic!("{method:?} has a factor: {:?}", system.events()),
        }
    };
    Method::ALL.map(cause).to_vec()
}

#[test]
fn a_diagonal_that_vanishes_or_is_no_number_is_named_by_every_method() {
    for (value, parts) in [
        (c64::new(f64::NAN, 0.0), ["diagonal entry of unknown", "NaN"]),
        (c64::new(0.0, f64::INFINITY), ["diagonal entry of unknown", "inf"]),
        (c64::default(), ["is 0, not positive"; 2]),
    ] {
        for cause in no_method_factors(|matrix| with_diagonal(matrix, value)) {
            assert!(parts.iter().all(|part| cause.contains(part)), "{cause}");
        }
    }
}

/// No sum of positive semidefinite parts has one, so that a factor without pivoting says nothing about its rounding.
#[test]
fn a_negative_diagonal_is_refused_by_complete_factors_and_audited_after_incomplete_ones() {
    for method in Method::ALL {
        let (mesh, model) = model(fixed(method));
        let damaged = with_diagonal(model.assemble(&mesh), c64::new(-3.0, 0.0));
        let solved = model.prepare(damaged).and_then(|mut system| {
            assert!(matches!(method, Method::Incomplete | Method::TwoLevel), "{method:?} has a factor");
            system.solve(&model.load(&mesh))
        });
        match solved {
            Ok((x, report)) => assert!(report.residual <= 1e-9 && x.iter().all(|x| x.is_finite())),
            Err(error) => assert!(error.to_string().contains("is -3, not positive"), "{error}"),
        }
    }
}

#[test]
fn an_incomplete_factor_goes_on_where_others_may_end() {
    let residual = |method: Method| {
        let settings = LinearSolverSettings { tolerance: 1e-6, required: 1e-6, ..fixed(method) };
        let (mesh, model) = model(settings);
        let (state, _) = model.solve(&mesh).expect("a field");
        state.report().residual
    };
    assert!(residual(Method::Incomplete) <= 1e-9);
    assert!(residual(Method::TwoLevel) > 1e-9, "the settings hold");
}

#[test]
fn a_coupling_that_is_no_number_leaves_no_pivot_to_any_method() {
    let causes = no_method_factors(|mut matrix| {
        let row = matrix.structure.row_count() / 2;
        let (_, other) = places(&matrix, row);
        let column = matrix.structure.columns[other] as usize;
        let mirrored = matrix.structure.row(column).find(|&k| matrix.structure.columns[k] as usize == row);
        let nan = c64::new(f64::NAN, 0.0);
        matrix.values[other] = nan;
        matrix.values[mirrored.expect("a symmetric pattern")] = nan;
        matrix
    });
    assert!(causes.iter().all(|cause| cause.contains("pivot of unknown")), "{causes:?}");
}

/// Two unknowns joined by a spring and held by nothing: `[1, −1; −1, 1]`, and no coupling with others.
fn with_a_loose_pair(mut matrix: CsrMatrix<c64>) -> (CsrMatrix<c64>, usize) {
    let row = matrix.structure.row_count() / 2;
    let (_, other) = places(&matrix, row);
    let pair = [row, matrix.structure.columns[other] as usize];
    for i in 0..matrix.structure.row_count() {
        for k in matrix.structure.row(i) {
            let j = matrix.structure.columns[k] as usize;
            match (pair.contains(&i), pair.contains(&j)) {
                (true, true) => matrix.values[k] = c64::from(if i == j { 1.0 } else { -1.0 }),
                (false, false) => {}
                _ => matrix.values[k] = c64::default(),
            }
        }
    }
    (matrix, row)
}

#[test]
fn a_singular_system_is_an_error_of_every_method() {
    for method in Method::ALL {
        let (mesh, model) = model(fixed(method));
        let (matrix, loose) = with_a_loose_pair(model.assemble(&mesh));
        let mut load = model.load(&mesh);
        // Nothing balances it.
        load[loose] = c64::new(1.0, 0.0);
        let failed = match model.prepare(matrix) {
            Err(error) => error,
            // The incomplete factor of a raised diagonal exists; the iteration finds out.
            Ok(mut system) => system.solve(&load).expect_err("no solution exists"),
        };
        let SolverError::Mesh(MeshError::Factorisation { cause, .. }) = &failed else { panic!("{failed}") };
        assert!(cause.contains("singular"), "{method:?}: {failed}");
    }
}

/// The state on a scaled matrix and the events of its solution.
fn scaled_solution(method: Method, factor: f64) -> (Vec<c64>, Vec<SolverEvent>) {
    let (mesh, model) = model(fixed(method));
    let mut matrix = model.assemble(&mesh);
    matrix.values.iter_mut().for_each(|value| *value *= factor);
    let mut system = model.prepare(matrix).unwrap_or_else(|error| panic!("{method:?}: {error}"));
    let load: Vec<c64> = model.load(&mesh).iter().map(|b| b * factor).collect();
    let (x, report) = system.solve(&load).unwrap_or_else(|error| panic!("{method:?}: {error}"));
    assert!(report.residual <= 1e-9, "{method:?}: {report:?}");
    (x, system.events().to_vec())
}

#[test]
fn a_matrix_beyond_single_precision_is_solved_all_the_same() {
    for factor in [1e120, 1e-120] {
        for method in Method::ALL {
            let (x, events) = scaled_solution(method, factor);
            let (reference, _) = scaled_solution(method, 1.0);
            let size = reference.iter().map(|r| r.norm()).fold(0.0, f64::max);
            let error = x.iter().zip(&reference).map(|(x, r)| (x - r).norm()).fold(0.0, f64::max);
            // Residuals of 1e-9 on a matrix of condition 1e6 leave three digits at least.
            assert!(error < 1e-3 * size, "{method:?} times {factor:e}: {error:e} of {size:e}");
            // Complete factors are scaled in double precision before; the incomplete one takes the entries as they are.
            let falls_back = matches!(method, Method::Incomplete | Method::TwoLevel);
            assert_eq!(!events.is_empty(), falls_back, "{method:?}: {events:?}");
            if let Some(SolverEvent::FellBack { from, cause, .. }) = events.first() {
                assert_eq!(*from, method);
                assert!(cause.contains("diagonal entry"), "{cause}");
            }
        }
    }
}

#[test]
fn a_method_that_is_cut_short_is_followed_by_the_next_one_and_says_so() {
    for method in [Method::Incomplete, Method::TwoLevel] {
        let (mesh, model) = model(LinearSolverSettings { max_iterations: Some(1), ..fixed(method) });
        let (state, system) = model.solve(&mesh).expect("the last of the ladder needs one iteration");
        assert!(state.report().residual <= 1e-9);
        let SolverEvent::FellBack { cause, .. } = &system.events()[0];
        assert!(cause.contains("after 1 iterations"), "{cause}");
        let steps: Vec<[Method; 2]> =
            system.events().iter().map(|SolverEvent::FellBack { from, to, .. }| [*from, *to]).collect();
        let ladder = [method, Method::RealFactorSingle, Method::RealFactor, Method::Direct];
        assert_eq!(steps, ladder.windows(2).map(|w| [w[0], w[1]]).collect::<Vec<_>>());
        assert_eq!(system.method(), Some(Method::Direct));
    }
}

#[test]
fn where_no_other_factor_fits_an_unconverged_iteration_is_an_error_with_its_residual() {
    for method in [Method::Incomplete, Method::TwoLevel] {
        let settings = LinearSolverSettings { max_iterations: Some(2), factor_bytes: 0, ..fixed(method) };
        let (mesh, model) = model(settings);
        let error = model.solve(&mesh).expect_err("two iterations are too few");
        let SolverError::NotConverged { residual, iterations, required, cause } = error else {
            panic!("{error}")
        };
        assert!(residual.is_finite() && residual > required && iterations == 2, "{residual}");
        assert_eq!(cause, NonConvergence::IllConditioned);
    }
}

#[test]
fn no_iterations_at_all_are_an_error_of_every_method() {
    for method in Method::ALL {
        let (mesh, model) = model(LinearSolverSettings { max_iterations: Some(0), ..fixed(method) });
        let error = model.solve(&mesh).expect_err("nothing was iterated");
        assert!(matches!(error, SolverError::NotConverged { iterations: 0, .. }), "{method:?}: {error}");
    }
}

#[test]
fn a_residual_that_no_arithmetic_reaches_is_an_error_of_every_method() {
    for method in Method::ALL {
        let settings = LinearSolverSettings { tolerance: 1e-30, required: 1e-30, ..fixed(method) };
        let (mesh, model) = model(settings);
        let error = model.solve(&mesh).expect_err("rounding is larger");
        let SolverError::NotConverged { residual, .. } = error else { panic!("{method:?}: {error}") };
        // What the most robust method leaves is told: rounding.
        assert!(residual < 1e-11, "{method:?}: {residual:e}");
    }
}

#[test]
fn a_system_that_failed_fails_again_without_a_panic() {
    let settings =
        LinearSolverSettings { max_iterations: Some(2), factor_bytes: 0, ..fixed(Method::Incomplete) };
    let (mesh, model) = model(settings);
    let mut system = model.prepare(model.assemble(&mesh)).expect("an incomplete factor");
    let load = model.load(&mesh);
    assert!(system.solve(&load).is_err() && system.solve(&load).is_err());
    // Nor one whose factor could not be replaced.
    let model = self::model(fixed(Method::Incomplete)).1;
    let (matrix, loose) = with_a_loose_pair(model.assemble(&mesh));
    let mut load = model.load(&mesh);
    load[loose] = c64::new(1.0, 0.0);
    let mut system = model.prepare(matrix).expect("an incomplete factor of a raised diagonal");
    for _ in 0..2 {
        assert!(system.solve(&load).is_err());
        assert!(system.preconditioner_bytes() == 0 && system.method() == Some(Method::Incomplete));
    }
}

#[test]
fn a_right_side_that_is_no_number_is_refused_and_the_system_stays_usable() {
    let (mesh, model) = model(fixed(Method::DirectSingle));
    let mut system = model.prepare(model.assemble(&mesh)).expect("a factor");
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut load = model.load(&mesh);
        load[7].im = bad;
        let error = system.solve(&load).expect_err("it is not finite");
        assert!(
            matches!(error, SolverError::NotFinite { what, .. } if what.contains("right side")),
            "{error}"
        );
    }
    let (x, report) = system.solve(&model.load(&mesh)).expect("a sound right side");
    assert!(report.residual <= 1e-9 && x.iter().all(|x| x.is_finite()));
}

/// Largest entries are told: they point at the source that is out of range.
#[test]
fn currents_whose_squares_leave_the_range_of_numbers_are_refused() {
    for current in [1e200, 1e-200] {
        let mesh = mesh();
        let model = FieldModel::new(&mesh, setup(fixed(Method::Direct), c64::new(0.0, current), STEEL));
        let error = model.expect("a sound problem").solve(&mesh).expect_err("out of range");
        let SolverError::OutOfRange { largest } = error else { panic!("{error}") };
        assert!((1e-8..1e2).contains(&(largest / current)), "{largest:e}");
        assert!(SolverError::OutOfRange { largest }.to_string().contains("currents"));
    }
}

#[test]
fn a_current_that_is_no_number_is_refused() {
    let mesh = mesh();
    let model = FieldModel::new(&mesh, setup(fixed(Method::Direct), c64::new(f64::NAN, 0.0), STEEL));
    let error =
        model.expect("currents are checked where they come from").solve(&mesh).expect_err("no number");
    assert!(matches!(error, SolverError::NotFinite { value, .. } if value.is_nan()), "{error}");
}

#[test]
fn no_current_at_all_is_no_field_and_no_failure() {
    let mesh = mesh();
    let model = FieldModel::new(&mesh, setup(fixed(Method::Direct), c64::default(), STEEL)).expect("sound");
    let (state, _) = model.solve(&mesh).expect("zero");
    assert!(state.values().iter().all(|x| *x == c64::default()));
}

fn field_is_finite(state: &FieldSolution, model: &FieldModel, mesh: &Mesh) -> bool {
    let mut b = state.flux_densities(model, mesh).into_iter().flatten();
    b.all(|c| c.is_finite()) && state.losses(model, mesh).iter().all(|(_, loss)| loss.is_finite())
}

/// Either the residual is what is required, or the cause is named.
#[test]
fn an_enormous_contrast_of_materials_is_solved_or_refused_by_every_method() {
    let contrasts = [(1e15, 1e15), (1e-15, 1e15), (1e15, 1e-15), (1e-300, 1e300), (1e300, 1.0)];
    for (relative_permeability, conductivity) in contrasts {
        for method in Method::ALL {
            let mesh = mesh();
            let plate = Material { relative_permeability, conductivity };
            let setup = setup(fixed(method), c64::new(1e3, 0.0), plate);
            match FieldModel::new(&mesh, setup).and_then(|model| Ok((model.solve(&mesh)?.0, model))) {
                Ok((state, model)) => {
                    assert!(state.report().residual <= 1e-9, "{method:?}: {:?}", state.report());
                    assert!(field_is_finite(&state, &model, &mesh), "{method:?}");
                }
                Err(error) => {
                    let named = matches!(
                        error,
                        SolverError::NotConverged { .. } | SolverError::Mesh(MeshError::Factorisation { .. })
                    );
                    assert!(named && !error.to_string().is_empty(), "{method:?}: {error}");
                }
            }
        }
    }
}

#[test]
fn material_data_out_of_range_are_refused_by_name() {
    let mesh = mesh();
    for (relative_permeability, conductivity, name) in [
        (f64::NAN, 1.0, "relative_permeability of `plate`"),
        (0.0, 1.0, "relative_permeability of `plate`"),
        (1.0, f64::NAN, "conductivity of `plate`"),
        (1.0, -1.0, "conductivity of `plate`"),
        (1.0, f64::INFINITY, "conductivity of `plate`"),
    ] {
        let plate = Material { relative_permeability, conductivity };
        let setup = setup(fixed(Method::Direct), c64::new(1.0, 0.0), plate);
        let error = FieldModel::new(&mesh, setup).expect_err("out of range").to_string();
        assert!(error.contains(name), "{error}");
    }
}

/// Each would be a field, and a wrong one.
#[test]
fn currents_windings_and_surfaces_that_cannot_be_are_refused_by_name() {
    type Change = fn(&mut FieldModelSetup, &mut Winding);
    let mesh = mesh();
    for (change, name) in [
        ((|own, _| own.frequency = 0.0) as Change, "ampere_turns of `coil` = 1+1i"),
        (|_, winding| winding.turns = 0.0, "turns of `coil` = 0"),
        (|_, winding| winding.resistance = -1.0, "resistance of `coil` = -1"),
        (|_, winding| winding.series_inductance = f64::NAN, "series_inductance of `coil` = NaN"),
        (|_, winding| winding.series_capacitance = Some(0.0), "series_capacitance of `coil` = 0"),
        (|_, winding| winding.voltage = Some(c64::new(f64::NAN, 0.0)), "voltage of `coil` = NaN"),
        (|own, _| own.coils.clear(), "number of windings = 1"),
        (
            |own, _| {
                let surface =
                    vec![[0, 1, 8], [8, 0, 1]].into_iter().map(|face| face.map(NodeId::new)).collect();
                own.conductors.push(Conductor {
                    name: "twice".to_owned(),
                    surface,
                    law: SurfaceLaw::Perfect,
                });
            },
            "face of the surface of `twice`",
        ),
    ] {
        let mut setup = setup(fixed(Method::Direct), c64::new(1.0, 1.0), STEEL);
        let mut winding = Winding {
            turns: 10.0,
            resistance: 1.0,
            series_inductance: 0.0,
            series_capacitance: None,
            voltage: None,
        };
        change(&mut setup, &mut winding);
        setup.windings = vec![Some(winding)];
        let error = FieldModel::new(&mesh, setup).expect_err("out of range").to_string();
        assert!(error.contains(name), "{error}");
    }
    let model =
        FieldModel::new(&mesh, setup(fixed(Method::Direct), c64::new(1.0, 0.0), STEEL)).expect("sound");
    let other = painted([6, 6, 9].map(|n| lines(n, 0.01)), &["air", "plate"], |_| 0);
    let error = model.solve(&other).expect_err("another topology").to_string();
    assert!(error.contains("number of nodes and tetrahedra"), "{error}");
}

/// What a first solution leaves for the next.
fn memory_of_a_solution(mesh: &Mesh, model: &FieldModel) -> LinearSolverCache {
    let mut first =
        model.prepare_with(model.assemble(mesh), &mut LinearSolverCache::default()).expect("a factor");
    first.solve(&model.load(mesh)).expect("a solution");
    first.into_cache()
}

#[test]
fn an_earlier_factor_is_replaced_where_the_matrix_has_changed_beyond_use() {
    let (mesh, model) = model(fixed(Method::DirectSingle));
    let mut memory = memory_of_a_solution(&mesh, &model);
    // A diagonal that grows by up to ten digits from one end to the other: the earlier factor is far from it.
    let mut matrix = model.assemble(&mesh);
    let n = matrix.structure.row_count();
    for row in 0..n {
        let (diagonal, _) = places(&matrix, row);
        matrix.values[diagonal] *= 10.0_f64.powf(10.0 * row as f64 / n as f64);
    }
    let mut system = model.prepare_with(matrix, &mut memory).expect("the earlier factor is at hand");
    let (x, report) = system.solve(&model.load(&mesh)).expect("with a factor of its own");
    assert!(report.residual <= 1e-9 && x.iter().all(|x| x.is_finite()), "{report:?}");
}

#[test]
fn an_earlier_factor_does_not_hide_a_matrix_that_is_no_number() {
    let (mesh, model) = model(fixed(Method::Direct));
    let mut memory = memory_of_a_solution(&mesh, &model);
    let damaged = with_diagonal(model.assemble(&mesh), c64::new(f64::NAN, 0.0));
    let mut system = model.prepare_with(damaged, &mut memory).expect("the earlier factor is at hand");
    let error = system.solve(&model.load(&mesh)).expect_err("no number");
    assert!(matches!(error, SolverError::Mesh(MeshError::Factorisation { .. })), "{error}");
    // What failed leaves nothing behind that the next design would start from.
    memory = system.into_cache();
    let mut next = model.prepare_with(model.assemble(&mesh), &mut memory).expect("a factor");
    assert!(next.solve(&model.load(&mesh)).expect("a sound matrix").1.residual <= 1e-9);
}

#[test]
fn a_fall_back_has_the_same_bits_for_any_number_of_threads() {
    let cut_short =
        LinearSolverSettings { max_iterations: Some(1), reuse: Reuse::Never, ..fixed(Method::Incomplete) };
    let result = || {
        let (mesh, model) = model(cut_short);
        let (state, system) = model.solve(&mesh).expect("the last of the ladder");
        (state.values().to_vec(), system.events().to_vec())
    };
    let one = on_threads(1, result);
    assert!(!one.1.is_empty());
    assert!(on_threads(2, result) == one && on_threads(4, result) == one);
}
