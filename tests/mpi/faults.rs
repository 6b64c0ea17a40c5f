//! What is wrong is said once, by the first rank, and ends all of them.

use crate::launch::{COARSE, completed, on, said};

#[test]
fn options_of_petsc_pass_through_and_one_that_nothing_asks_for_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let with = |options: &str| {
        let setting = format!("analysis.petsc.options=\"{options}\"");
        let settings = [&COARSE[..3], &["analysis.petsc.solver=asm", &setting]].concat();
        on(2, "solve", "shield.toml", &folder.path().join("run"), &settings)
    };
    completed(with("-ksp_gmres_restart 40 -sub_pc_factor_levels 1").arg("--force"));
    let (code, text) = said(&with("-ksp_tpye cg").arg("--force").output().expect("it starts"));
    assert_eq!(code, Some(4), "{text}");
    assert!(text.contains("analysis.petsc.options") && text.contains("`-ksp_tpye`"), "{text}");
    let (code, text) = said(&with("-ksp_max_it 3").arg("--force").output().expect("it starts"));
    assert_eq!(code, Some(4), "{text}");
    assert!(text.contains("reached the relative residual"), "{text}");
}

#[test]
fn a_fault_of_the_configuration_is_told_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for setting in ["analysis.petsc.slover=\"asm\"", "design.surface=\"plate_botom\""] {
        let output =
            on(3, "run", "shield_quick.toml", folder.path(), &[setting]).output().expect("it starts");
        let (code, text) = said(&output);
        assert_eq!(code, Some(3), "{text}");
        assert_eq!(text.matches("error").count(), 1, "{text}");
    }
}
