//! What is wrong is said once, by the first rank, and ends all of them.

use crate::launch::{COARSE, completed, on};
use crate::support::program::{finish, folder};

#[test]
fn options_of_petsc_pass_through_and_one_that_nothing_asks_for_is_named() {
    let folder = folder();
    let with = |options: &str| {
        let setting = format!("analysis.petsc.options=\"{options}\"");
        let settings = [&COARSE[..3], &["analysis.petsc.solver=asm", &setting]].concat();
        on(2, "solve", "shield.toml", &folder.path().join("run"), &settings)
    };
    completed(with("-ksp_gmres_restart 40 -sub_pc_factor_levels 1 -coarse_pc_type lu").arg("--force"));
    finish(with("-ksp_tpye cg").arg("--force")).with(4, &["analysis.petsc.options", "`-ksp_tpye`"]);
    finish(with("-ksp_max_it 3").arg("--force")).with(4, &["reached the relative residual"]);
}

#[test]
fn a_fault_of_the_configuration_is_told_once() {
    let folder = folder();
    for setting in ["analysis.petsc.slover=\"asm\"", "design.surface=\"plate_botom\""] {
        let told = finish(&mut on(3, "run", "shield_quick.toml", folder.path(), &[setting])).exits_with(3);
        assert_eq!(told.stderr.matches("error").count(), 1, "{}", told.stderr);
    }
}
