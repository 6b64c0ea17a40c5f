//! What lies behind the outer faces of a mesh: walls that cut a field off, and images of what symmetry planes cut.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;

use fluxmorph_geometry::generate::Grid;
use fluxmorph_geometry::io::{MshEncoding, msh_bytes};
use fluxmorph_geometry::tet4::{Point, norm};
use fluxmorph_geometry::{Mesh, RegionId};
use serde_json::Value;

use super::plausible::set;
use crate::support::folder::{number, read_json};
use crate::support::program::{command, finish, folder};
use crate::support::shield::quick;
use crate::support::{changed, repository, repository_text};

/// The wall beside the coil is a wall, although an element that the coil meets reaches it.
#[test]
fn a_near_wall_is_named_with_the_error_that_no_bar_has() {
    let wall = |half: &str| {
        let half = format!("coils[0].half_window=[\"{half}\", \"60 mm\"]");
        let checked =
            finish(command(&[&"check", &quick(), &"--json"]).args(set(&[&half]))).exits_with(0).json();
        (checked["truncation"]["surface"].clone(), number(&checked, "/truncation/distance_m"))
    };
    let (far, near) = (wall("60 mm"), wall("560 mm"));
    println!("{far:?} {near:?}");
    assert_eq!(near.0, "x_max");
    assert!(near.1 < 0.05 && far.1 > 0.3);
    let home = folder();
    let near_wall = |name: &str, overrides: &[&str]| {
        let out = home.path().join(name);
        finish(command(&[&"solve", &quick(), &"--out", &out]).args(set(overrides))).exits_with(0);
        read_json(&out.join("result.json"))["accuracy"]["near_wall"].clone()
    };
    let estimated = "accuracy.estimate=true";
    let text = near_wall("walls", &[estimated]);
    assert!(
        text.as_str().is_some_and(|text| text.contains("no error bar counts what it cuts off")),
        "{text}"
    );
    let conditions = "boundaries.flux_parallel=[\"x_min\", \"y_min\"]";
    let open = "open.surfaces=[\"x_max\", \"y_max\", \"z_min\", \"z_max\"]";
    assert_eq!(near_wall("open", &[estimated, conditions, open]), Value::Null);
}

/// Walls are the sides of the mesh, whatever their names and conditions; a lone plane that flux passes is one of symmetry. What is
/// observed counts as coils and matter do.
#[test]
fn walls_are_known_by_where_they_are() {
    let wall = |overrides: &[&str]| {
        let json =
            finish(command(&[&"check", &quick(), &"--json"]).args(set(overrides))).exits_with(0).json();
        (json["truncation"]["surface"].clone(), number(&json, "/truncation/distance_m"))
    };
    let planes = "boundaries.flux_parallel=[\"x_min\", \"y_min\"]";
    let named = wall(&[]);
    assert_eq!(named.0, "z_min");
    assert_eq!(wall(&[planes]), named, "without conditions");
    let normal = "boundaries.flux_normal=[\"x_max\", \"y_max\", \"z_min\", \"z_max\"]";
    assert_eq!(wall(&[planes, normal]), named, "flux passes them");
    let sides = "boundaries.flux_parallel=[\"x_min\", \"y_min\", \"x_max\", \"y_max\", \"z_max\"]";
    let lone = wall(&[sides, "boundaries.flux_normal=[\"z_min\"]"]);
    assert!(lone.0 != "z_min" && lone.1 > named.1, "{lone:?} in place of {named:?}");
    let with_probe = |height: &str| {
        wall(&[&format!("probes=[{{name = \"far\", points = [[\"0 mm\", \"0 mm\", \"{height}\"]]}}]")])
    };
    let observed = with_probe("-380 mm");
    assert!(observed.0 == "z_min" && (0.015..0.025).contains(&observed.1), "{observed:?}");
    // In a plane at which something is observed the device goes on behind it; a scan may end at any wall.
    assert_ne!(with_probe("-400 mm").0, "z_min");
    assert_eq!(with_probe("-400 mm\"], [\"0 mm\", \"0 mm\", \"-300 mm").0, "z_min");
}

/// A slice of a long coil around a core: walls without a tangential field send its flux back beside it, however far they are; where the
/// far ones have no condition it goes straight on, with the field `μ n I` inside.
#[test]
fn walls_that_send_back_the_flux_of_a_long_coil_are_named() {
    let text = r#"
[mesh]
generator = "boxes"

[mesh.boxes]
box = [["0 mm", "0 mm", "0 mm"], ["400 mm", "400 mm", "5 mm"]]
regions = [{ name = "core", box = [["0 mm", "0 mm", "0 mm"], ["10 mm", "10 mm", "5 mm"]], size = ["5 mm", "5 mm", "5 mm"] }]

[analysis]
frequency = 0

[materials.iron]
relative_permeability = 1000

[regions.core]
material = "iron"

[boundaries]
flux_parallel = ["x_min", "y_min", "x_max", "y_max"]
flux_normal = ["z_min", "z_max"]

[[coils]]
name = "coil"
shape = "rectangular"
center = ["0 mm", "0 mm", "2.5 mm"]
half_window = ["20 mm", "20 mm"]
width = "5 mm"
height = "5 mm"
ampere_turns = "5 A"

[[probes]]
name = "core"
points = [["3 mm", "3 mm", "2.5 mm"]]
"#;
    let home = folder();
    let config = home.path().join("slice.toml");
    let far = ("\"y_min\", \"x_max\", \"y_max\"]", "\"y_min\"]");
    for (changes, is_named) in [(&[][..], true), (&[far], false)] {
        std::fs::write(&config, changed(text, changes)).expect("written");
        let out = home.path().join(if is_named { "held" } else { "free" });
        let said = finish(&mut command(&[&"solve", &config, &"--out", &out])).completed().stderr;
        assert_eq!(
            said.contains("between the planes `z_min` and `z_max`, which flux passes"),
            is_named,
            "{said}"
        );
        let b = number(&read_json(&out.join("result.json")), "/probes/0/b_re_t/0/2").abs();
        let ratio = b / (4e-4 * std::f64::consts::PI * 1000.0);
        println!("{is_named}: {ratio}");
        assert!(if is_named { ratio < 0.9 } else { (ratio - 1.0).abs() < 1e-3 }, "{ratio}");
    }
}

/// A ring coil of 40 mm in air.
const RING: &str = r#"
[mesh]
file = "ring.msh"
unit = "mm"

[analysis]
elements = "edge"
frequency = 0

[[coils]]
name = "ring"
shape = "circular"
ampere_turns = "100 A"
center = ["0 mm", "0 mm", "0 mm"]
axis = [0, 0, 1]
radius = "30 mm"
width = "10 mm"
height = "10 mm"

[boundaries]
flux_parallel = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]

[objective]
kind = "energy"
region = "air"
"#;

/// Whether walls lie along the axes, across them or bent, and whether planes of symmetry do: they are as near as they are, and as
/// near to a whole device. From a ring that ends at 40 mm and 5 mm of height a cube of 48 mm is 8 mm away, and a ball of 50 mm
/// `50 - (40² + 5²)^(1/2)`.
#[test]
fn curved_and_oblique_walls_are_as_near_as_others() {
    let home = folder();
    let half = 0.048;
    let lines = |from: f64, cells: u32| -> Vec<f64> {
        (0..=cells).map(|k| from + (half - from) * f64::from(k) / f64::from(cells)).collect()
    };
    let wall = |[x, y, z]: Point, place: &dyn Fn(Point) -> Point| {
        let of = |from: f64| lines(from, if from == 0.0 { 6 } else { 12 });
        let grid = Grid::new("grid", [of(x), of(y), of(z)]).expect("a grid");
        let topology = grid.topology(&["air"], |_| RegionId(0)).expect("a region");
        let mesh = Mesh::new(Arc::new(topology), grid.points().into_iter().map(place).collect());
        let bytes = msh_bytes(&mesh.expect("a mesh"), 1e-3, MshEncoding::Ascii).expect("finite");
        std::fs::write(home.path().join("ring.msh"), bytes).expect("written");
        let config = home.path().join("ring.toml");
        // Half the height of a winding is cut off by a plane that flux crosses.
        let crossed = ("\"z_min\", \"z_max\"]", "\"z_max\"]\nflux_normal = [\"z_min\"]");
        let text = if z == 0.0 { changed(RING, &[crossed]) } else { RING.to_owned() };
        std::fs::write(&config, text).expect("written");
        let json = finish(&mut command(&[&"check", &config, &"--json"])).exits_with(0).json();
        ["distance_m", "source_size_m"].map(|key| number(&json["truncation"], &format!("/{key}")))
    };
    let turned = |[x, y, z]: Point| {
        let share = FRAC_1_SQRT_2;
        [share * (x - y), share * (x + y), z]
    };
    // Cubes and squares onto balls and discs: a point keeps its direction.
    let stretched = |largest: f64, length: f64| if length > 0.0 { largest / length } else { 1.0 };
    let round = |[x, y, z]: Point| {
        let by = stretched(x.abs().max(y.abs()), x.hypot(y));
        [by * x, by * y, z]
    };
    let ball = |x: Point| {
        let by = stretched(x.iter().fold(0.0, |most, c| c.abs().max(most)), norm(x)) * 50.0 / 48.0;
        x.map(|c| by * c)
    };
    let whole = [-half; 3];
    let quarter = [0.0, 0.0, -half];
    let [distance, size] = wall(whole, &|x| x);
    assert!((distance - 0.008).abs() < 1e-6 && (size / norm([0.04, 0.04, 0.005]) - 1.0).abs() < 1e-6);
    let same = |name: &str, corner: Point, place: &dyn Fn(Point) -> Point, expected: f64| {
        let [distance, own] = wall(corner, place);
        println!("{name}: {distance:.3e} m, {own:.3e} m");
        // Facets cut off up to 0.4 mm of a circle, and the winding's edges 0.05 mm.
        assert!((expected - 5e-4..expected + 1e-4).contains(&distance), "{name}: {distance}");
        assert!((own / size - 1.0).abs() < 0.02, "{name}: {own} of {size}");
    };
    same("turned", whole, &turned, 0.008);
    same("a quarter", quarter, &|x| x, 0.008);
    same("a quarter, turned", quarter, &turned, 0.008);
    same("an octant", [0.0; 3], &|x| x, 0.008);
    same("an octant, turned", [0.0; 3], &turned, 0.008);
    // A sector of 36°, which the square between two planes at right angles is folded to.
    let sector = |x: Point| {
        let [x, y, z] = round(x);
        let (angle, radius) = (0.4 * y.atan2(x), x.hypot(y));
        [radius * angle.cos(), radius * angle.sin(), z]
    };
    same("a sector", quarter, &sector, 0.008);
    same("a cylinder", whole, &round, 0.008);
    same("a ball", whole, &ball, 0.05 - 0.04f64.hypot(0.005));
}

/// What holds in a plane far from a ball is nothing to its images, and what a face is called nothing to the mean of the device.
#[test]
fn planes_are_judged_by_their_faces_and_not_by_their_names() {
    let home = folder();
    let config = home.path().join("plane.toml");
    std::fs::write(&config, repository_text("tests/config/bases/over_a_plane.toml")).expect("written");
    let of = |normal: &str, parallel: &str| {
        let conditions = [
            format!("boundaries.flux_normal=[{normal}]"),
            format!(
                "boundaries.flux_parallel=[\"x_min\", \"x_max\", \"y_min\", \"y_max\", \"z_max\"{parallel}]"
            ),
        ];
        let out = home.path().join("out");
        let overrides = set(&conditions.each_ref().map(String::as_str));
        finish(command(&[&"solve", &config, &"--out", &out, &"--force"]).args(overrides)).exits_with(0);
        let result = read_json(&out.join("result.json"));
        [number(&result, "/multipoles/0/terms/0/value_t"), number(&result, "/objective/best")]
    };
    let [field, spread] = of("\"plane\", \"strip\"", "");
    // The same condition, not written.
    assert_eq!(of("\"plane\"", ""), [field, spread]);
    let [beside, _] = of("\"plane\"", ", \"strip\"");
    println!("{field:.5e} T, with a sheet far away {beside:.5e} T; {spread:.5e}");
    assert!((beside / field - 1.0).abs() < 0.02, "{beside} {field}");
    // A plane without condition has no image, whatever holds in a strip of it.
    let refused = finish(
        command(&[&"check", &config])
            .args(set(&["boundaries.flux_normal=[]", "boundaries.flux_parallel=[\"z_max\", \"strip\"]"])),
    )
    .exits_with(3);
    assert!(refused.stderr.contains("lies outside the mesh"), "{}", refused.stderr);
    let divided = set(&[
        "boundaries.flux_normal=[\"plane\"]",
        "boundaries.flux_parallel=[\"z_max\", \"strip\"]",
        "multipoles=[{name = \"ball\", shape = \"ball\", radius = 0.09, order = 2}]",
    ]);
    let refused = finish(command(&[&"check", &config]).args(divided)).exits_with(3);
    let text = &refused.stderr;
    assert!(
        text.contains("a plane across z that is flux-parallel and flux-normal within its radius"),
        "{text}"
    );
}

/// Behind the surface of a closed iron shell there is no field; of 1 mT around it 5.17 µT come through four skin depths.
#[test]
fn what_passes_through_a_closed_shell_is_said_of_the_probe_inside() {
    let home = folder();
    let out = home.path().join("shell");
    let shell = set(&[
        "mesh.sphere.inner_radius=\"44.2 mm\"",
        "mesh.sphere.skin=[]",
        "mesh.sphere.wall_layers=1",
        "analysis.order=1",
        "materials.metal.relative_permeability=500",
        "materials.metal.conductivity=\"5e6 S/m\"",
        "regions.sphere.model=\"impedance\"",
        "boundaries.uniform_field={surfaces = [\"outer\"], b = [0, 0, \"1 mT\"]}",
    ]);
    let config = repository("configs/sphere.toml");
    finish(command(&[&"solve", &config, &"--out", &out]).args(shell)).exits_with(0);
    let warnings = read_json(&out.join("result.json"))["warnings"].clone();
    let said: Vec<&str> = warnings.as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let said: Vec<&&str> = said.iter().filter(|text| text.contains("passes through `sphere`")).collect();
    assert!(
        said.len() == 1 && said[0].starts_with("B at the probe `centre` at (0.000, 0.000, 0.000) mm is 0 T")
    );
    let (_, about) = said[0].split_once("and about ").expect("an estimate");
    let about: f64 = about.split(' ').next().and_then(|text| text.parse().ok()).expect("a number");
    assert!((2e-6..1e-5).contains(&about), "{about} T for 5.17e-6");
}
