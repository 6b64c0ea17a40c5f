//! What the field misses of the quality that is asked for: from the files alone, and as pictures.

use std::path::Path;

use fluxmorph_geometry::tet4::{centroid, volume};

use crate::support::device::written;
use crate::support::folder::{RunFolder, number, scalars, vectors};
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
    let all = deviations(&RunFolder(out), 0);
    let largest = all.iter().map(|(d, ..)| d.abs()).fold(0.0, f64::max);
    let along = all.iter().map(|(.., b)| b[2].abs()).fold(0.0, f64::max);
    println!("{} elements, deviation up to {largest:.2e} of {along:.2e} T", all.len());
    assert!(all.len() > 20 && all.iter().all(|(_, _, x, _)| x[0].hypot(x[1]).hypot(x[2]) <= 0.005));
    assert!(largest > 1e-4 * along && largest < 0.3 * along, "{largest} {along}");
}
