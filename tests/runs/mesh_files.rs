//! Devices from Gmsh files: the shield's coarse mesh as a user would bring it, and the mesh that a run gives back. What is
//! refused stands in `tests/config`.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_geometry::io::{MshEncoding, msh_bytes, read_msh_file};
use fluxmorph_geometry::{Mesh, NodeId};

use crate::support::folder::{RunFolder, count, list, named, number, read_text, vectors};
use crate::support::program::{Finished, command, finish, folder};
use crate::support::shield::quick;
use crate::support::{changed, with_mesh_file};

/// The mesh of the quick configuration.
fn generated() -> Mesh {
    let parameters =
        ShieldParameters { skin: vec![], side_skin: vec![], refinement: 0.5, ..ShieldParameters::default() };
    shield(&parameters).expect("the quick configuration's parameters")
}

/// `device.toml` and `device.msh` in a folder: the quick configuration with its mesh from a file in millimetres.
fn device(home: &Path) -> PathBuf {
    let config = home.join("device.toml");
    fs::write(&config, with_mesh_file(&read_text(&quick()), "device.msh")).expect("written");
    let bytes = msh_bytes(&generated(), 1e-3, MshEncoding::Ascii).expect("finite");
    fs::write(home.join("device.msh"), bytes).expect("written");
    config
}

fn with(name: &str, config: &Path, further: &[&str]) -> Finished {
    finish(command(&[&name, &config]).args(further))
}

/// Replaces a text in a file that must hold it.
fn edit(path: &Path, from: &str, to: &str) {
    fs::write(path, changed(&read_text(path), &[(from, to)])).expect("written");
}

#[test]
fn check_tells_the_regions_sizes_unit_and_notices_of_a_file() {
    let home = folder();
    let config = device(home.path());
    // A relative path is relative to the configuration, wherever the command is given.
    let mut check = command(&[&"check", &config]);
    let text = finish(check.current_dir(std::env::temp_dir())).exits_with(0).stdout;
    for fragment in ["device.msh, coordinates in mm", "observation", "plate_bottom"] {
        assert!(text.contains(fragment), "no `{fragment}` in:\n{text}");
    }
    let json = with("check", &config, &["--json"]).exits_with(0).json();
    assert_eq!(json["mesh_file"]["unit"], "mm");
    let mesh = generated();
    let plate = named(&json["regions"], "plate");
    // A quarter of 240 x 480 x 10 mm; sums of some hundred volumes.
    assert!((number(plate, "/volume_m3") / 2.88e-4 - 1.0).abs() < 1e-12, "{plate}");
    assert_eq!(list(&json, "/regions").len(), mesh.topology().region_names().len());

    // A node that nothing uses, and the tag of an element turned around.
    edit(&home.path().join("device.msh"), "$EndNodes", "3 1 0 0\n$EndNodes");
    let file = read_text(&home.path().join("device.msh"));
    let head = file.split("$Nodes\n").nth(1).and_then(|rest| rest.lines().next()).expect("a head").to_owned();
    let [blocks, nodes] =
        [0, 1].map(|k| head.split(' ').nth(k).and_then(|n| n.parse::<usize>().ok()).expect("a number"));
    let more = format!("{} {} 1 999999", blocks + 1, nodes + 1);
    edit(&home.path().join("device.msh"), &head, &more);
    edit(&home.path().join("device.msh"), "3 1 0 0\n$EndNodes", "3 1 0 1\n999999\n0 0 0\n$EndNodes");
    let json = with("check", &config, &["--json"]).exits_with(0).json();
    assert!(json["warnings"].to_string().contains("1 nodes that are no vertex"), "{}", json["warnings"]);
}

#[test]
fn a_file_solves_as_the_generator_that_made_it() {
    let home = folder();
    let config = device(home.path());
    let weighting = "objective.weighting=volume";
    let out = |name: &str| home.path().join(name).to_str().expect("UTF-8").to_owned();
    with("solve", &config, &["--out", &out("file"), "--set", weighting]).exits_with(0);
    with("solve", &quick(), &["--out", &out("generated"), "--set", weighting]).exits_with(0);
    let objective = |name: &str| number(&RunFolder(home.path().join(name)).result(), "/objective/best");
    // Coordinates of the file are within a rounding of the generator's; the solver stops at 1e-11.
    assert!((objective("file") / objective("generated") - 1.0).abs() < 1e-9);
}

/// Their normals point out of the body, however a mesher has ordered them.
#[test]
fn surfaces_of_bodies_are_written_out_of_them() {
    let home = folder();
    let config = device(home.path());
    let written = |mesh: &Mesh, model: &str| {
        let model = format!("regions.plate.model={model}");
        let bytes = msh_bytes(mesh, 1e-3, MshEncoding::Ascii).expect("finite");
        fs::write(home.path().join("device.msh"), bytes).expect("written");
        let out = home.path().join("out");
        let stl = "output.stl=[\"plate_bottom\"]";
        let further = ["--force", "--set", &model, "--set", "analysis.elements=edge", "--set", stl];
        finish(command(&[&"solve", &config, &"--out", &out]).args(further)).exits_with(0);
        fs::read(out.join("optimum_plate_bottom.stl")).expect("written")
    };
    let mesh = generated();
    let turn = |(k, &[a, b, c]): (usize, &[NodeId; 3])| if k % 3 == 0 { [a, c, b] } else { [a, b, c] };
    let bottom =
        mesh.topology().surface("plate_bottom").expect("named").iter().enumerate().map(turn).collect();
    let topology = mesh.topology().as_ref().clone().with_surface("plate_bottom", bottom).expect("its faces");
    let turned = Mesh::new(Arc::new(topology), mesh.points().to_vec()).expect("the same elements");
    let stl = written(&turned, "volume");
    assert_eq!(stl, written(&mesh, "volume"));
    assert_eq!(stl, written(&turned, "impedance"));
    // Of each triangle the normal comes first, behind a head of 84 bytes.
    let component = |triangle: &[u8], d: usize| f32::from_le_bytes([0, 1, 2, 3].map(|i| triangle[4 * d + i]));
    assert!(stl[84..].chunks(50).all(|triangle| component(triangle, 2) < -0.99));
}

/// Every plane of symmetry is oblique then, and the air beside the plate slides in two of them. In an applied field, for circles that
/// cut elements have facets of their own.
#[test]
fn a_device_that_is_turned_has_the_same_optimum() {
    let home = folder();
    let config = device(home.path());
    let planes = "flux_parallel = [\"x_min\", \"x_max\", \"y_min\", \"y_max\", \"z_min\", \"z_max\"]";
    let applied = "flux_parallel = [\"x_min\", \"y_min\"]\n\
                   uniform_field = { surfaces = [\"x_max\", \"y_max\", \"z_min\", \"z_max\"], b = [0.0, 0.0, 0.1] }";
    edit(&config, planes, applied);
    edit(&config, "grid = [7, 13]\n", "");
    edit(&config, "stiffness", "motion = \"free\"\nlaw = \"linear\"\nstiffness");
    let text = read_text(&config);
    let (head, rest) = text.split_once("[[coils]]").expect("a coil");
    let (_, tail) = rest.split_once("[boundaries]").expect("conditions");
    fs::write(&config, format!("{head}[boundaries]{tail}")).expect("written");
    let optimum = |angle: f64| {
        let (sine, cosine) = angle.to_radians().sin_cos();
        let turn = |&[x, y, z]: &[f64; 3]| [cosine * x - sine * y, sine * x + cosine * y, z];
        let mesh = generated();
        let mesh = Mesh::new(Arc::clone(mesh.topology()), mesh.points().iter().map(turn).collect());
        let bytes = msh_bytes(&mesh.expect("the same elements"), 1e-3, MshEncoding::Ascii).expect("finite");
        fs::write(home.path().join("device.msh"), bytes).expect("written");
        let out = home.path().join("out");
        let edge = "analysis.elements=edge";
        let further = ["--force", "--max-evaluations", "3", "--set", "output.fields=none", "--set", edge];
        finish(command(&[&"run", &config, &"--out", &out]).args(further)).exits_with(1);
        let result = RunFolder(out).result();
        (number(&result, "/objective/initial"), number(&result, "/objective/ratio"))
    };
    let (initial, ratio) = optimum(0.0);
    let (other_initial, other_ratio) = optimum(30.0);
    assert!(ratio < 0.95, "{ratio}");
    assert!((other_initial / initial - 1.0).abs() < 1e-11, "{initial} {other_initial}");
    assert!((other_ratio / ratio - 1.0).abs() < 1e-9, "{ratio} {other_ratio}");
}

#[test]
fn the_optimum_reads_back_as_the_mesh_of_the_result() {
    let home = folder();
    let config = device(home.path());
    let out = home.path().join("out");
    let directory = out.to_str().expect("UTF-8");
    let stl = "output.stl=[\"plate_bottom\", \"remesh|plate\"]";
    let arguments =
        ["--out", directory, "--set", stl, "--set", "output.fields=every", "--max-evaluations", "3"];
    with("run", &config, &arguments).exits_with(1);
    let run = RunFolder(out.clone());
    let result = run.result();
    let read = read_msh_file(&run.0.join("optimum.msh"), 1e-3).unwrap_or_else(|error| panic!("{error}"));
    assert!(read.notices.messages().is_empty(), "{:?}", read.notices);
    assert_eq!(read.mesh.points().len() as u64, count(&result, "/mesh/nodes"));
    let field = run.field(count(&result, "/objective/best_evaluation"));
    assert_eq!(field.tets, read.mesh.topology().tets());
    for (x, y) in read.mesh.points().iter().zip(&field.points) {
        // Millimetres and back: within a rounding of 0.72 m.
        assert!((0..3).all(|d| (x[d] - y[d]).abs() < 2e-16), "{x:?} {y:?}");
    }
    assert!(vectors(&field.point_data["displacement"]).iter().any(|u| u[2] != 0.0), "the plate has moved");
    assert!(read.mesh.topology().surface("remesh|plate").is_ok_and(|faces| !faces.is_empty()));
    // The plate is replaced by its impedance surface: a name without elements.
    assert!(
        read.mesh.topology().region("plate").is_ok_and(|id| read.mesh.topology().elements_of(id).is_empty())
    );
    for (file, surface) in
        [("optimum_plate_bottom.stl", "plate_bottom"), ("optimum_remesh_plate.stl", "remesh|plate")]
    {
        let bytes = fs::read(run.0.join(file)).expect(file);
        let triangles = read.mesh.topology().surface(surface).expect("named").len();
        assert_eq!(bytes.len(), 84 + 50 * triangles, "{file}");
    }
    assert_eq!(run.json("manifest.json")["surfaces"][1], "optimum_remesh_plate.stl");
    // The optimum is a mesh file like any other.
    edit(&config, "file = \"device.msh\"", "file = \"out/optimum.msh\"");
    edit(&config, "model = \"impedance\"", "model = \"volume\"");
    with("check", &config, &[]).with(3, &["regions.plate", "the region `plate` has no elements"]);

    let none = ["--out", directory, "--force", "--set", "output.mesh=false", "--set", "output.stl=[]"];
    with("solve", &quick(), &none).exits_with(0);
    assert!(
        ["optimum.msh", "optimum_plate_bottom.stl", "optimum_remesh_plate.stl"]
            .iter()
            .all(|f| !out.join(f).exists())
    );
}

#[test]
fn interfaces_serve_as_surfaces_everywhere() {
    let home = folder();
    let config = device(home.path());
    let fixed = "remesh.fixed=[\"remesh|air\"]";
    let stl = "output.stl=[\"air|outside\"]";
    let json = with("check", &config, &["--json", "--set", fixed, "--set", stl]).exits_with(0).json();
    let area = |name: &str| number(named(&json["surfaces"], name), "/area_m2");
    // The remesh region is a box of 160 x 280 x 70 mm with two faces on the symmetry planes; the observation region of
    // 40 x 120 mm adjoins it from below.
    let expected = 0.16 * 0.28 * 2.0 + (0.16 + 0.28) * 0.07 - 0.04 * 0.12;
    assert!((area("remesh|air") / expected - 1.0).abs() < 1e-12, "{}", area("remesh|air"));
    let outer = area("x_max") + area("y_max") + area("z_max") + area("z_min");
    assert!(area("air|outside") > outer, "parts of the symmetry planes too");

    let design = ["--set", "design.surface=plate|remesh", "--set", "design.direction=[0, 0, -1]"];
    let text = with("check", &config, &design);
    assert!(!text.stderr.contains("there is no"), "{}", text.stderr);
    for (set, says) in [
        ("remesh.slide=[\"remesh|outsde\"]", ["there is no region `outsde`", "did you mean `outside`?"]),
        ("output.stl=[\"plate_tip\"]", ["there is no surface `plate_tip`", "did you mean `plate_top`?"]),
    ] {
        with("check", &config, &["--set", set]).with(3, &says);
    }
}
