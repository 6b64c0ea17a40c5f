//! What stands on the page.

use crate::support::device::CONSTRAINT;
use crate::support::folder::read_text as read;
use crate::support::markup::{Element, elements};
use crate::support::program::{fluxmorph, fluxmorph_in, folder};
use crate::support::shield::on_quick;
use crate::{block, report, shield};

const SECTIONS: &str = "shape convergence field results evaluations mesh files provenance view";

fn has_id(elements: &[Element], id: &str) -> bool {
    elements.iter().any(|element| element.get("id") == Some(id))
}

/// Nothing leads out of the page but links to files beside it.
#[track_caller]
fn stands_alone(page: &str, elements: &[Element]) {
    for fragment in ["http://", "https://", "src=", "@import", "url(\"", "url('", "//cdn"] {
        assert!(!page.contains(fragment), "{fragment}");
    }
    for element in elements {
        let href = element.get("href").unwrap_or_default();
        let own = href.starts_with("data:image/png;base64,") || href.starts_with('#');
        let local = element.name == "a" && !href.contains(':') && !href.starts_with('/');
        assert!(href.is_empty() || own || local, "{element:?}");
        assert!(element.attributes.iter().all(|(name, _)| !name.starts_with("on")), "{element:?}");
    }
    let ids: Vec<&str> = elements.iter().filter_map(|element| element.get("id")).collect();
    let mut once = ids.clone();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), ids.len(), "an id stands twice: {ids:?}");
    let named = elements.iter().flat_map(|e| &e.attributes).filter_map(|(_, value)| {
        value.strip_prefix("url(#").and_then(|v| v.strip_suffix(')')).or_else(|| value.strip_prefix('#'))
    });
    for id in named.filter(|id| !id.chars().all(|c| c.is_ascii_hexdigit())) {
        assert!(ids.contains(&id), "#{id} leads nowhere");
    }
}

/// Every figure has a caption with numbers, and every drawing a name for those who do not see it.
#[track_caller]
fn figures_are_described(elements: &[Element]) {
    let captions: Vec<&Element> = elements.iter().filter(|e| e.name == "figcaption").collect();
    assert_eq!(captions.len(), elements.iter().filter(|e| e.name == "figure").count());
    for caption in captions {
        assert!(caption.text.chars().any(|c| c.is_ascii_digit()), "{}", caption.text);
    }
    for drawing in elements.iter().filter(|e| matches!(e.name.as_str(), "svg" | "canvas")) {
        assert_eq!(drawing.get("role"), Some("img"));
        assert!(drawing.get("aria-label").is_some_and(|label| label.len() > 20), "{drawing:?}");
    }
}

#[test]
fn a_run_ends_with_a_page_that_is_the_same_when_made_again() {
    let home = folder();
    let out = home.path().join("out");
    shield(&out, &[]);
    let page = read(&out.join("report.html"));
    assert!(page.len() <= 2_000_000, "{}", page.len());
    assert_eq!(report(&out), page);
    // However the directory is typed.
    fluxmorph_in(home.path(), &["report", "out", "--quiet"]).exits_with(0);
    assert_eq!(read(&out.join("report.html")), page);
    let elements = elements(&page);
    stands_alone(&page, &elements);
    figures_are_described(&elements);
    for id in
        SECTIONS.split(' ').chain(["shape-map", "field-cut", "error-map", "quality-histogram", "surface"])
    {
        assert!(has_id(&elements, id), "{id}");
    }
    let charts: Vec<&str> = elements.iter().filter_map(|e| e.get("data-chart")).collect();
    assert_eq!(charts, ["objective", "gradient", "quality", "step"]);
    // Two maps, two cuts, where the error is made, four charts, one histogram.
    assert_eq!(elements.iter().filter(|e| e.name == "svg").count(), 10);
    assert!(!page.contains("Not shown"));
    for link in ["fields.pvd", "optimum.msh", "optimum_plate_bottom.stl", "fields/eval_0000.vtu"] {
        assert!(elements.iter().any(|e| e.get("href") == Some(link)), "{link}");
        assert!(out.join(link).is_file());
    }
    assert!(page.contains("--max-evaluations 10"));
}

#[test]
fn another_file_has_links_that_lead_to_the_run() {
    let home = folder();
    let out = block("run", home.path(), &[]);
    let elsewhere = home.path().join("for a colleague.html");
    fluxmorph(&[&"report", &out, &"--out", &elsewhere, &"--quiet"]).exits_with(0);
    let page = read(&elsewhere);
    assert!(page.contains("href=\"out/fields.pvd\""));
    assert_eq!(page.replace("href=\"out/", "href=\""), read(&out.join("report.html")));
}

#[test]
fn constraints_are_drawn() {
    let home = folder();
    let changes = [CONSTRAINT, ("max_evaluations = 6", "max_evaluations = 8")];
    let out = block("run", home.path(), &changes);
    let page = read(&out.join("report.html"));
    let elements = elements(&page);
    figures_are_described(&elements);
    assert!(elements.iter().any(|e| e.get("data-chart") == Some("constraint")));
    assert!(page.contains("Constraints at the best design"));
}

#[test]
fn names_from_files_stay_text() {
    let home = folder();
    let title = r#"</title><script>alert(1)</script><img src=x onerror=alert(1)>&amp;"'"#;
    let region = "<b onclick='x'>iron</b>&";
    let changes = [
        ("title = \"Block over a gap\"", &*format!("title = '''{title}'''")),
        ("name = \"iron\"", &format!("name = \"{region}\"")),
        ("[regions.iron]", &format!("[regions.\"{region}\"]")),
        ("region = [\"gap\", \"iron\"]", &format!("region = [\"gap\", \"{region}\"]")),
    ];
    let out = block("run", home.path(), &changes);
    let page = read(&out.join("report.html"));
    let elements = elements(&page);
    assert_eq!(elements.iter().find(|e| e.name == "h1").map(|e| e.text.as_str()), Some(title));
    assert!(elements.iter().all(|e| !matches!(e.name.as_str(), "b" | "img")));
    // The surface's data and the view.
    assert_eq!(elements.iter().filter(|e| e.name == "script").count(), 2);
    assert!(elements.iter().any(|e| e.name == "figcaption" && e.text.contains(region)));
}

#[test]
fn without_fields_the_page_says_what_is_missing_and_shows_the_rest() {
    let home = folder();
    let out = home.path().join("out");
    shield(&out, &["--set", "output.fields=none"]);
    let page = read(&out.join("report.html"));
    let elements = elements(&page);
    let missing: Vec<&Element> = elements.iter().filter(|e| e.get("class") == Some("missing")).collect();
    assert_eq!(missing.len(), 2, "the cut and the histogram: {missing:?}");
    assert!(missing.iter().all(|e| e.text.contains("output.fields = \"none\"")));
    assert!(has_id(&elements, "shape-map") && has_id(&elements, "surface"));
    assert!(
        page.contains("the design surface plate_bottom") || page.contains("The design surface plate_bottom")
    );
}

#[test]
fn a_run_that_was_broken_off_is_reported_as_far_as_it_went() {
    let home = folder();
    let out = home.path().join("out");
    shield(&out, &["--set", "output.fields=every"]);
    std::fs::remove_file(out.join("result.json")).expect("removed");
    // As after a loss of power: the last record is cut short.
    let records = read(&out.join("journal.jsonl"));
    std::fs::write(out.join("journal.jsonl"), &records[..records.len() - 20]).expect("written");
    let page = report(&out);
    assert!(page.contains("there is no result") && page.contains("fluxmorph resume"));
    let elements_of = elements(&page);
    assert!(has_id(&elements_of, "shape-map") && has_id(&elements_of, "field-cut"));
    // Nothing but the beginning.
    for file in ["history.csv", "journal.jsonl", "fields.pvd", "resolved.toml"] {
        std::fs::remove_file(out.join(file)).expect("removed");
    }
    std::fs::remove_dir_all(out.join("fields")).expect("removed");
    let page = report(&out);
    elements(&page);
    assert!(page.contains("no evaluation was completed"));
}

#[test]
fn an_analysis_has_a_page_too() {
    let home = folder();
    let out = block("solve", home.path(), &[]);
    assert!(!out.join("report.html").exists(), "solve writes none by itself");
    let page = report(&out);
    let elements = elements(&page);
    stands_alone(&page, &elements);
    figures_are_described(&elements);
    assert!(page.contains("Field analysis") && !has_id(&elements, "convergence"));
    assert!(has_id(&elements, "field-cut"));
}

#[test]
fn a_run_without_report_has_none_and_force_removes_an_old_one() {
    let home = folder();
    let out = home.path().join("out");
    shield(&out, &[]);
    assert!(out.join("report.html").is_file());
    shield(&out, &["--force", "--set", "output.report=false", "--set", "optimizer.max_evaluations=1"]);
    assert!(!out.join("report.html").exists());
    on_quick("run", &out, &["--force", "--max-evaluations", "1"]).with(1, &["report: ", "report.html"]);
}
