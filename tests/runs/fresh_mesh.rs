//! The check of a run's gain on a fresh mesh, as a user sees it.

use crate::support::folder::{count, number, read_json};
use crate::support::program::folder;
use crate::support::shield::on_quick;

#[test]
fn a_run_reports_its_ratio_on_a_fresh_mesh() {
    let home = folder();
    let out = home.path().join("out");
    // Of this region every element is a cell, and the fresh mesh has more elements.
    let limit = "constraints=[{kind='flux_density_squared', region='remesh', follow='mesh', upper=1e3}]";
    on_quick("run", &out, &["--set", "optimizer.algorithm=mma", "--set", limit])
        .with(1, &["checking the best shape on a fresh mesh ...", "F/F0 on a fresh mesh"]);
    let result = read_json(&out.join("result.json"));
    let (ratio, verified) =
        (number(&result, "/objective/ratio"), number(&result, "/objective/verified_ratio"));
    println!("F/F0 {ratio:.4}, on a fresh mesh {verified:.4}");
    // One cell carries each step of the coarse surface, and two on the fresh mesh.
    assert!((ratio - verified).abs() <= 0.05, "{ratio} {verified}");
    assert_eq!(number(&result, "/objective/verification/ratio"), verified);
    assert_eq!(number(&result, "/objective/verification/refinement"), 2.0);
    let [initial, best] =
        ["initial", "best"].map(|key| number(&result, &format!("/objective/verification/{key}")));
    assert_eq!(best / initial, verified);
    assert!(count(&result, "/objective/verification/tets") > count(&result, "/mesh/tets"));
    assert!(number(&result, "/timings_s/verification") > 0.0);
    let sums = ["/constraints/0/value", "/objective/verification/constraints/0/value"];
    let [sum, fresh] = sums.map(|key| number(&result, key));
    println!("sum over cells {sum:.3}, on a fresh mesh {fresh:.3}");
    assert!((fresh / sum - 1.0).abs() < 0.05, "{sum} {fresh}");
}
