//! The share of all cases that point at the exact place.

use crate::case::Case;
use crate::{elsewhere, files, mesh_files, overrides, setups, syntax, tables, words};

/// All cases, in the order of their themes.
pub(crate) fn all() -> Vec<Case> {
    let themes: [&[Case]; 8] = [
        tables::CASES,
        words::CASES,
        syntax::CASES,
        elsewhere::CASES,
        overrides::CASES,
        setups::CASES,
        files::CASES,
        mesh_files::CASES,
    ];
    themes.concat()
}

#[test]
fn the_cases_are_many_and_nearly_all_point() {
    let cases = all();
    let points: Vec<bool> = cases.iter().map(|case| case.shown().points.is_ok()).collect();
    let exact = |points: &[bool]| points.iter().filter(|points| **points).count();
    println!("{} of {} cases point at the exact key or value", exact(&points), points.len());
    assert!(points.len() >= 120 && exact(&points[..120]) >= 118);
    assert!(exact(&points) as f64 >= 0.98 * points.len() as f64);
    let mut names: Vec<&str> = cases.iter().map(|case| case.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), cases.len(), "every case has its own name");
}
