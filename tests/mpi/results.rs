//! What ranks compute is what one process does.

use crate::launch::{COARSE, assert_same, completed, field, fluxmorph, on, result};
use crate::support::folder::{count, read_text};
use crate::support::program::{finish, folder};

#[test]
fn the_shield_has_the_objective_the_gradient_and_the_evaluations_of_one_process() {
    let folder = folder();
    let out = |count: usize| folder.path().join(format!("ranks{count}"));
    for count in [0, 1, 2, 4] {
        completed(&mut on(count, "run", "shield.toml", &out(count), &COARSE));
        if count > 0 {
            assert_same(&out(count), &out(0));
            assert_eq!(result(&out(count))["linear_solver"]["methods"][0], "petsc mumps");
        }
    }
}

#[test]
fn the_iterative_solvers_agree_with_the_direct_one() {
    let folder = folder();
    let direct = folder.path().join("direct");
    let settings = [&COARSE[..3], &["optimizer.max_evaluations=1", "output.verify_refinement=0"]].concat();
    completed(&mut on(2, "run", "shield.toml", &direct, &settings));
    let solvers: [(usize, &[&str]); 5] = [
        (1, &[]),
        (2, &[]),
        (4, &[]),
        (2, &["analysis.petsc.krylov=cocg", "analysis.petsc.overlap=3"]),
        (2, &["analysis.petsc.sub_solver=complete"]),
    ];
    for (k, (ranks, solver)) in solvers.iter().enumerate() {
        let own = folder.path().join(k.to_string());
        let settings = [&settings[..], &["analysis.petsc.solver=asm"], *solver].concat();
        completed(&mut on(*ranks, "run", "shield.toml", &own, &settings));
        assert_same(&own, &direct);
        assert_eq!(result(&own)["linear_solver"]["methods"][0], "petsc asm");
        let iterations = count(&result(&own), "/linear_solver/iterations");
        assert!(iterations > 10, "{iterations}: an incomplete factor takes more");
    }
}

#[test]
fn the_gradient_certificate_holds_on_two_ranks() {
    let folder = folder();
    completed(&mut on(2, "gradient", "shield_quick.toml", folder.path(), &["mesh.shield.refinement=0.3"]));
}

#[test]
fn fields_are_written_by_every_rank_and_the_report_reads_them() {
    let folder = folder();
    let out = folder.path().join("run");
    completed(&mut on(2, "solve", "shield_quick.toml", &out, &[]));
    for name in ["eval_0000.pvtu", "eval_0000/rank_000.vtu", "eval_0000/rank_001.vtu"] {
        assert!(field(&out, name).is_file(), "{name}");
    }
    completed(fluxmorph(0).arg("report").arg(&out));
    let page = read_text(&out.join("report.html"));
    assert!(page.contains("<figure"), "the page has figures of the joined fields");
}

#[test]
fn commands_of_one_process_are_done_once() {
    let folder = folder();
    let printed = finish(&mut on(2, "check", "shield_quick.toml", folder.path(), &[])).stdout;
    assert_eq!(printed.matches("linear solver").count(), 1, "{printed}");
}
