//! What the field misses of the quality that is asked for: from the files alone, and as pictures.

use std::path::Path;

use fluxmorph_geometry::tet4::{centroid, volume};

use crate::support::device::{IN_A_MOVING_GAP, written};
use crate::support::folder::{RunFolder, list, number, scalars, vectors};
use crate::support::markup::elements;
use crate::support::program::{finish, folder};

/// At rest, with some cells to have a deviation in.
const AT_REST: [(&str, &str); 2] = [("frequency = \"50 Hz\"", "frequency = 0"), ("[1, 1, 1]", "[3, 3, 3]")];

fn run(folder: &Path, objective: &str) -> RunFolder {
    let changes = [AT_REST[0], AT_REST[1], ("kind = \"flux_density_squared\"", objective)];
    let out = folder.join("out");
    finish(&mut written("block", folder, &changes).command("run", &out)).completed();
    RunFolder(out)
}

/// Deviation [T], volume [m³] and middle of every element that has one.
fn deviations(run: &RunFolder, evaluation: u64) -> Vec<(f64, f64, [f64; 3], [f64; 3])> {
    let field = run.field(evaluation);
    let all = scalars(&field.cell_data["deviation"]);
    let b = vectors(&field.cell_data["B_re"]);
    let corners = field.tets.iter().map(|tet| tet.map(|n| field.points[n.index()]));
    let elements = corners.zip(all).zip(b).filter(|((_, d), _)| **d != 0.0);
    elements.map(|((corners, d), b)| (*d, volume(corners), centroid(corners), *b)).collect()
}

#[test]
fn the_deviation_from_a_target_adds_up_to_the_objective_before_and_after() {
    let home = folder();
    let run = run(home.path(), "kind = \"target_field\"\ntarget = [0.0, 0.0, \"0.12 T\"]");
    let result = run.result();
    let best = number(&result, "/objective/best_evaluation") as u64;
    for (evaluation, objective) in [(0, "/objective/initial"), (best, "/objective/best")] {
        let all = deviations(&run, evaluation);
        for (deviation, _, place, b) in &all {
            let own = b[0].hypot(b[1]).hypot(b[2] - 0.12);
            // A few roundings.
            assert!((deviation - own).abs() < 1e-14, "{deviation} {own}");
            assert!(place.iter().all(|c| (0.0..0.01).contains(c)), "outside of what is observed: {place:?}");
        }
        let sum: f64 = all.iter().map(|(d, v, ..)| v * d * d).sum();
        let value = number(&result, objective);
        assert!((sum / value - 1.0).abs() < 1e-12, "{objective}: {sum} {value}");
    }
    let page = run.text("report.html");
    let drawings = elements(&page);
    let labels = drawings.iter().filter_map(|e| e.get("aria-label"));
    assert_eq!(labels.filter(|label| label.starts_with("Deviation of the field")).count(), 2);
    let captions: Vec<&str> =
        drawings.iter().filter(|e| e.name == "figcaption").map(|e| e.text.as_str()).collect();
    let own = captions.iter().find(|text| text.contains("Deviation of the field")).expect("a caption");
    assert!(own.contains("Before: ") && own.contains("; after: ") && own.contains(" mT"), "{own}");
}

#[test]
fn the_deviation_from_the_mean_has_its_sign_and_adds_up_to_the_homogeneity() {
    let home = folder();
    let run = run(home.path(), "kind = \"homogeneity\"\ndirection = [0, 0, 1]");
    let result = run.result();
    let best = number(&result, "/objective/best_evaluation") as u64;
    let all = deviations(&run, best);
    let total: f64 = all.iter().map(|(_, v, ..)| v).sum();
    let mean: f64 = all.iter().map(|(_, v, _, b)| v * b[2]).sum::<f64>() / total;
    for (deviation, _, _, b) in &all {
        assert!((deviation - (b[2] - mean)).abs() < 1e-14, "{deviation} {} {mean}", b[2]);
    }
    assert!(all.iter().any(|(d, ..)| *d > 0.0) && all.iter().any(|(d, ..)| *d < 0.0));
    let rms = (all.iter().map(|(d, v, ..)| v * d * d).sum::<f64>() / total).sqrt() / mean;
    let expected = 1e-6 * number(&result, "/objective/rms_ppm");
    assert!((rms / expected - 1.0).abs() < 1e-9, "{rms} {expected}");
}

#[test]
fn the_homogeneity_of_a_worst_case_is_that_of_the_worst_term() {
    let home = folder();
    let whole = "kind = \"flux_density_squared\"\nregion = \"observation\"\nweighting = \"volume\"";
    // The weight makes a term the worst one whose field is the more homogeneous.
    let terms = [("[0, 0, 1]", 1e6), ("[1, 0, 1]", 1.0)].map(|(direction, weight)| {
        format!(
            "[[objective.terms]]\nkind = \"homogeneity\"\nregion = \"observation\"\ndirection = {direction}\n\
             weight = {weight}\n"
        )
    });
    let of = |first: usize| {
        let worst = format!("combine = \"worst_case\"\n{}{}", terms[first], terms[1 - first]);
        let out = home.path().join("out");
        let device = written("block", home.path(), &[AT_REST[0], AT_REST[1], (whole, &worst)]);
        finish(device.command("solve", &out).arg("--force")).completed();
        let result = RunFolder(out).result();
        let rms = 1e-6 * number(&result, "/objective/rms_ppm");
        let value = number(&result, "/objective/best");
        assert!((1e6 * rms * rms / value - 1.0).abs() < 1e-9, "{rms} {value}");
        let own: Vec<f64> =
            list(&result, "/objective/terms").iter().map(|term| number(term, "/value")).collect();
        assert!(own[first] < own[1 - first], "{own:?}");
        value
    };
    assert_eq!(of(0), of(1));
}

/// Little is left of a field that is nearly uniform in a small ball, and nothing is said of what lies outside.
#[test]
fn the_deviation_of_an_expansion_is_what_its_main_terms_leave_inside_the_ball() {
    let home = folder();
    let objective = "kind = \"multipole_content\"\nharmonics = [\"c1_0\", \"c2_0\"]";
    let changes = [
        AT_REST[0],
        ("[1, 1, 1]", "[6, 6, 6]"),
        ("region = \"observation\"\nweighting = \"volume\"", "region = \"ball\""),
        ("kind = \"flux_density_squared\"", objective),
        (
            "[design]",
            "[[multipoles]]\nname = \"ball\"\nshape = \"ball\"\ncenter = [0, 0, 0]\naxis = \"z\"\n\
             radius = \"5 mm\"\norder = 4\nmain = 0\n\n[design]",
        ),
    ];
    let out = home.path().join("out");
    finish(&mut written("block", home.path(), &changes).command("run", &out)).completed();
    let run = RunFolder(out);
    let page = run.text("report.html");
    let figures = elements(&page);
    let of_terms = |e: &&str| e.starts_with("Terms of the expansion ball, the largest");
    assert_eq!(figures.iter().filter_map(|e| e.get("aria-label")).filter(of_terms).count(), 1);
    assert!(page.contains("before above, after below"));
    let result = run.result();
    let terms = |at: &str| result.pointer(at).and_then(|terms| terms.as_array()).map(Vec::len);
    assert_eq!(terms("/initial/0/multipoles/0/terms"), terms("/multipoles/0/terms"));
    let all = deviations(&run, 0);
    let largest = all.iter().map(|(d, ..)| d.abs()).fold(0.0, f64::max);
    let along = all.iter().map(|(.., b)| b[2].abs()).fold(0.0, f64::max);
    println!("{} elements, deviation up to {largest:.2e} of {along:.2e} T", all.len());
    assert!(all.len() > 20 && all.iter().all(|(_, _, x, _)| x[0].hypot(x[1]).hypot(x[2]) <= 0.005));
    assert!(largest > 1e-4 * along && largest < 0.3 * along, "{largest} {along}");
}

/// The holders of places that stay have the deviation of their own field; the page says that the places stay.
#[test]
fn the_deviation_where_the_mesh_moves_lies_in_the_elements_that_hold_the_places() {
    let home = folder();
    let out = home.path().join("out");
    let device = written("block", home.path(), &[&[AT_REST[0]], &IN_A_MOVING_GAP[..]].concat());
    finish(&mut device.command("run", &out)).completed();
    let run = RunFolder(out);
    let best = number(&run.result(), "/objective/best_evaluation") as u64;
    assert!(best > 0 && number(&run.result(), "/objective/ratio") < 1.0);
    for evaluation in [0, best] {
        let all = deviations(&run, evaluation);
        // The places are at most 10 mm off the middle, and cells 5 mm wide.
        assert!(all.len() > 20 && all.iter().all(|(_, _, x, _)| x.iter().all(|c| *c < 15e-3)));
        let total: f64 = all.iter().map(|(_, v, ..)| v).sum();
        let mean = all.iter().map(|(_, v, _, b)| v * b[2]).sum::<f64>() / total;
        let level = all.iter().map(|(d, _, _, b)| b[2] - d).sum::<f64>() / all.len() as f64;
        println!("{} elements, mean {mean:.6} T, {level:.6} T is compared with", all.len());
        // One mean for all, near that of the elements.
        assert!(all.iter().all(|(d, _, _, b)| (b[2] - d - level).abs() < 1e-13));
        assert!((level / mean - 1.0).abs() < 0.01, "{level} {mean}");
    }
    let page = run.text("report.html");
    assert!(page.contains("at places that stay") && page.contains("Deviation of the field"));
}

#[test]
fn the_page_names_the_load_at_which_the_quality_is_asked_for() {
    let home = folder();
    let loads = (
        "[analysis]",
        "[[loads]]\nname = \"rest\"\nfrequency = 0\n\n[[loads]]\nname = \"a-c\"\n\n[analysis]",
    );
    let asked_for = ("kind = \"flux_density_squared\"", "kind = \"homogeneity\"\nload = \"a-c\"");
    let out = home.path().join("out");
    finish(&mut written("block", home.path(), &[loads, asked_for, AT_REST[1]]).command("run", &out))
        .completed();
    let run = RunFolder(out);
    assert_eq!(run.result()["objective"]["state"], "a-c");
    let page = run.text("report.html");
    assert!(page.contains("what is asked for, under the load a-c, in"), "{page}");
}
