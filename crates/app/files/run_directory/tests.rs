use std::fs;

use super::super::disk::system_disk;
use super::*;

fn started(path: &Path) -> RunDirectory {
    let run = RunDirectory::create(&system_disk(), path, OverwritePolicy::Keep).expect("a new run directory");
    Manifest::new("run", 2).write(&run).expect("a manifest");
    drop(run);
    // Without the lock of the process that wrote it.
    RunDirectory::open(&system_disk(), path).expect("a run")
}

#[test]
fn an_absent_or_empty_folder_is_taken() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    assert!(RunDirectory::create(&system_disk(), folder.path(), OverwritePolicy::Keep).is_ok());
    let run = RunDirectory::create(&system_disk(), &folder.path().join("a/b"), OverwritePolicy::Keep)
        .expect("made");
    assert!(run.fields().is_dir());
    // Broken off before the manifest: still nothing of anybody.
    let path = run.path().to_owned();
    drop(run);
    std::fs::write(path.join(".fluxmorph-abc"), "").expect("written");
    assert!(RunDirectory::create(&system_disk(), &path, OverwritePolicy::Keep).is_ok());
    assert!(!path.join(".fluxmorph-abc").exists());
}

#[test]
fn one_process_at_a_time_has_the_directory() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let create = |overwrite| RunDirectory::create(&system_disk(), folder.path(), overwrite);
    let open = || RunDirectory::open(&system_disk(), folder.path()).expect("a run");
    // Before the first file as after it.
    let first = create(OverwritePolicy::Keep).expect("free");
    for overwrite in [OverwritePolicy::Keep, OverwritePolicy::Replace] {
        assert!(matches!(create(overwrite), Err(OutputError::InUse { .. })));
    }
    Manifest::new("run", 2).write(&first).expect("a manifest");
    assert!(matches!(create(OverwritePolicy::Replace), Err(OutputError::InUse { .. })));
    assert!(open().is_in_use() && matches!(open().locked(), Err(OutputError::InUse { .. })));
    // A copy holds it too.
    let copy = first.clone();
    drop(first);
    assert!(open().is_in_use());
    drop(copy);
    assert!(open().locked().is_ok());
    // A start that was interrupted before there was anything to keep is replaced without being asked.
    assert!(create(OverwritePolicy::Keep).is_ok());
}

#[test]
fn nothing_is_written_into_another_folder_that_has_taken_the_place_of_the_one_of_a_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (place, elsewhere) = (folder.path().join("run"), folder.path().join("moved"));
    let create = || RunDirectory::create(&system_disk(), &place, OverwritePolicy::Keep).expect("free");
    let (first, is_replaced) = (create(), |error| matches!(error, OutputError::Replaced { .. }));
    // Without its lock it is the same folder still.
    fs::remove_file(place.join(LOCK)).expect("removed");
    first.write(&first.result(), b"first").expect("written");
    fs::rename(&place, &elsewhere).expect("moved");
    assert!(is_replaced(first.make_fields().expect_err("gone")) && !place.exists());
    let second = create();
    second.write(&second.result(), b"second").expect("written");
    assert!(is_replaced(first.write(&first.result(), b"first").expect_err("another's")));
    assert!(is_replaced(first.remove(&first.result()).expect_err("another's")));
    assert_eq!(fs::read(second.result()).expect("there"), b"second");
    // Moved back, it goes on.
    fs::rename(&place, folder.path().join("other")).expect("moved");
    fs::rename(&elsewhere, &place).expect("moved");
    first.write(&first.result(), b"first").expect("written");
}

#[test]
fn a_foreign_folder_is_left_alone_even_when_forced() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let note = folder.path().join("thesis.txt");
    fs::write(&note, "years of work").expect("written");
    for manifest in ["", "{}", r#"{"program": "other"}"#, "[]"] {
        for overwrite in [OverwritePolicy::Keep, OverwritePolicy::Replace] {
            let error = RunDirectory::create(&system_disk(), folder.path(), overwrite).expect_err("foreign");
            assert!(matches!(error, OutputError::NotOurs { .. }), "{error}");
        }
        fs::write(folder.path().join("manifest.json"), manifest).expect("written");
    }
    assert!(note.exists());
    assert!(!folder.path().join(LOCK).exists());
    let error = RunDirectory::create(&system_disk(), &note, OverwritePolicy::Replace).expect_err("a file");
    assert!(matches!(error, OutputError::NotADirectory { .. }), "{error}");
    assert!(RunDirectory::open(&system_disk(), folder.path()).is_err());
}

#[test]
fn an_earlier_run_is_replaced_only_when_forced_and_foreign_files_stay() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = started(&folder.path().join("run"));
    assert!(RunDirectory::open(&system_disk(), run.path()).is_ok());
    let mut ours = vec![run.result(), run.history_csv(), run.field(0), run.field(10_000), run.collection()];
    ours.extend([
        run.before(None),
        run.after(Some(0)),
        run.before(Some(99)),
        run.morph_csv(),
        run.tuned(),
        run.report(),
    ]);
    let foreign = ["notes.md", "fields/eval_best.vtu", "case_1_before.vtu", "case_01.vtu"];
    let foreign = foreign.map(|name| run.path().join(name));
    for path in ours.iter().chain(&foreign) {
        fs::write(path, b"x").expect("written");
    }
    let error =
        RunDirectory::create(&system_disk(), run.path(), OverwritePolicy::Keep).expect_err("holds a run");
    assert!(matches!(error, OutputError::HoldsRun { .. }) && error.to_string().contains("--force"));
    assert!(ours.iter().all(|path| path.exists()));

    RunDirectory::create(&system_disk(), run.path(), OverwritePolicy::Replace).expect("replaced");
    assert!(ours.iter().all(|path| !path.exists()));
    assert!(foreign.iter().all(|path| path.exists()));
    assert!(run.manifest().exists(), "the mark stays until the next manifest");
}

#[test]
fn surfaces_of_an_earlier_run_are_replaced_and_those_of_others_stay() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run =
        RunDirectory::create(&system_disk(), &folder.path().join("run"), OverwritePolicy::Keep).expect("new");
    let mut manifest = Manifest::new("run", 1);
    manifest.surfaces =
        ["optimum_a.stl", "../stay.stl", "optimum_/../../stay.stl"].map(str::to_owned).to_vec();
    manifest.write(&run).expect("written");
    let (ours, theirs) = (run.surface("optimum_a.stl"), run.surface("optimum_b.stl"));
    for path in [&ours, &theirs, &folder.path().join("stay.stl"), &run.optimum()] {
        fs::write(path, b"x").expect("written");
    }
    let (path, optimum) = (run.path().to_owned(), run.optimum());
    drop(run);
    RunDirectory::create(&system_disk(), &path, OverwritePolicy::Replace).expect("replaced");
    assert!(!ours.exists() && !optimum.exists());
    assert!(theirs.exists() && folder.path().join("stay.stl").exists());
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_nowhere_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let link = folder.path().join("link");
    std::os::unix::fs::symlink(folder.path().join("missing"), &link).expect("linked");
    for path in [link.clone(), link.join("run")] {
        let error =
            RunDirectory::create(&system_disk(), &path, OverwritePolicy::Keep).expect_err("a dead link");
        assert!(matches!(&error, OutputError::DeadLink { path } if *path == link), "{error}");
    }
    assert!(!folder.path().join("missing").exists());
}

#[cfg(unix)]
#[test]
fn fields_behind_a_link_stay() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let other = started(&folder.path().join("other"));
    fs::write(other.field(0), b"x").expect("written");
    let run = started(&folder.path().join("run"));
    fs::remove_dir(run.fields()).expect("removed");
    std::os::unix::fs::symlink(other.fields(), run.fields()).expect("linked");
    let error =
        RunDirectory::create(&system_disk(), run.path(), OverwritePolicy::Replace).expect_err("a link");
    assert!(matches!(error, OutputError::Linked { .. }), "{error}");
    RunDirectory::create_flat(&system_disk(), run.path(), OverwritePolicy::Replace).expect("replaced");
    assert!(other.field(0).exists());
}
