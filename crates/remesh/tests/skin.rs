//! What the stiffness policies leave of the shield's skin layers when its 10 mm become 30, 5, or the optimal frame.

use crate::support::{self, Point, plate_columns};
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{ElasticMap, StiffnessPolicy, check_step, step_to_inversion};

const LAYERS: usize = 8;

/// Smallest thickness after / before of each layer, bottom to top, over all columns.
fn retained(mesh: &Mesh, moved: &Mesh) -> [f64; LAYERS] {
    let mut smallest = [f64::INFINITY; LAYERS];
    for nodes in plate_columns(mesh) {
        assert_eq!(nodes.len(), LAYERS + 1);
        for (layer, pair) in nodes.windows(2).enumerate() {
            let thickness = |m: &Mesh| m.point(pair[1])[2] - m.point(pair[0])[2];
            smallest[layer] = smallest[layer].min(thickness(moved) / thickness(mesh));
        }
    }
    smallest
}

/// Added thickness [m] at the 20 mm design grid's node (i, j).
type Shape = (&'static str, fn(usize, usize) -> f64);

const SHAPES: [Shape; 3] = [
    ("30 mm", |_, _| 0.020),
    ("5 mm", |_, _| -0.005),
    ("frame", |i, j| if i >= 4 || j >= 8 { 0.020 } else { -0.005 }),
];

/// The design grid's bilinear interpolation at the nodes, towards −z.
fn thickened(mesh: &Mesh, nodes: &[NodeId], shape: fn(usize, usize) -> f64) -> Vec<Point> {
    let pitch = 0.02;
    support::at(mesh, nodes, |p| {
        let cell = |c: f64, last: usize| ((c / pitch + 1e-9) as usize).min(last);
        let (i, j) = (cell(p[0], 5), cell(p[1], 11));
        let (s, t) = (p[0] / pitch - i as f64, p[1] / pitch - j as f64);
        let along = |j| (1.0 - s) * shape(i, j) + s * shape(i + 1, j);
        [0.0, 0.0, -(1.0 - t) * along(j) - t * along(j + 1)]
    })
}

struct Outcome {
    step: f64,
    /// Retained thickness of the layers; `None` where the motion inverts an element.
    layers: Option<[f64; LAYERS]>,
    /// Worst quality after / before, in the air and in the plate.
    quality: [f64; 2],
}

fn outcomes(policy: StiffnessPolicy, poisson: f64) -> [Outcome; 3] {
    let mesh = support::meshed_shield();
    let map =
        ElasticMap::new(&mesh, support::shield_setup(&mesh, &["plate", "remesh"], policy, poisson)).unwrap();
    SHAPES.map(|(name, shape)| {
        let displacement = map.displacement(&thickened(&mesh, map.design_nodes(), shape)).unwrap();
        let step = step_to_inversion(&mesh, &displacement).step;
        let moved = check_step(&mesh, &displacement).ok();
        assert_eq!(moved.is_some(), step > 1.0);
        let layers = moved.as_ref().map(|moved| retained(&mesh, moved));
        let worst = |m: &Mesh, region: &str| {
            let elements = m.topology().elements_of(m.topology().region(region).unwrap());
            QualityReport::of_elements(m, &elements).unwrap().worst
        };
        let quality =
            ["remesh", "plate"].map(|r| moved.as_ref().map_or(0.0, |m| worst(m, r) / worst(&mesh, r)));
        println!(
            "{policy:?} ν = {poisson} {name}: inverts at {step:.2}, layers {layers:.2?}, q/q0 {quality:.2?}"
        );
        Outcome { step, layers, quality }
    })
}

/// No inversion, worst quality above a third of its start, and the outermost layers (0.4 mm, half a skin depth) kept.
fn assert_protected(outcomes: &[Outcome; 3], layers: usize) {
    for outcome in outcomes {
        assert!(outcome.step > 1.05, "{}", outcome.step);
        assert!(outcome.quality.iter().all(|q| *q > 1.0 / 3.0));
        let kept = outcome.layers.unwrap();
        for layer in (0..layers).flat_map(|l| [l, LAYERS - 1 - l]) {
            assert!(kept[layer] >= 0.7, "layer {layer}: {}", kept[layer]);
        }
    }
}

#[test]
fn stiffness_inverse_to_size_keeps_one_layer_and_inverse_to_volume_two_with_little_contraction() {
    assert_protected(&outcomes(StiffnessPolicy::InverseSize, 0.3), 1);
    assert_protected(&outcomes(StiffnessPolicy::InverseVolume, 0.2), 2);
    let [thick, ..] = outcomes(StiffnessPolicy::InverseVolume, 0.3);
    assert!(thick.step < 1.0, "{}", thick.step);
}

/// What neither of the two others can: both keep two layers, or hold at every Poisson's ratio, not both.
#[test]
fn directional_stiffness_keeps_two_layers_at_every_usual_poisson_ratio() {
    for poisson in [0.0, 0.2, 0.3] {
        let directional = outcomes(StiffnessPolicy::Directional, poisson);
        assert_protected(&directional, 2);
        assert!(directional.iter().all(|outcome| outcome.step > 1.1));
        let protected = |policy| {
            outcomes(policy, poisson).iter().all(|outcome| {
                let Some(kept) = outcome.layers else { return false };
                outcome.step > 1.05 && [0, 1, 6, 7].iter().all(|&layer: &usize| kept[layer] >= 0.7)
            })
        };
        assert!(!protected(StiffnessPolicy::Uniform));
        assert!(!protected(StiffnessPolicy::InverseSize));
        // Only just not at 0: the second layer keeps 0.69.
        assert_eq!(protected(StiffnessPolicy::InverseVolume), poisson == 0.2);
    }
}

/// The counterpart: why `uniform` is not the default.
#[test]
fn uniform_stiffness_loses_the_skin() {
    let [thick, thin, _] = outcomes(StiffnessPolicy::Uniform, 0.3);
    assert!(thick.step < 1.0, "{}", thick.step);
    assert!(thin.layers.unwrap()[0] < 0.55);
}

#[test]
fn the_hollow_shield_of_the_impedance_model_keeps_its_quality() {
    let mesh = support::hollow_shield();
    let map =
        ElasticMap::new(&mesh, support::shield_setup(&mesh, &["remesh"], StiffnessPolicy::InverseSize, 0.3))
            .unwrap();
    for (name, shape) in SHAPES {
        let displacement = map.displacement(&thickened(&mesh, map.design_nodes(), shape)).unwrap();
        let moved = check_step(&mesh, &displacement).unwrap();
        let q = QualityReport::of_elements(&moved, map.elements()).unwrap().worst;
        let step = step_to_inversion(&mesh, &displacement).step;
        println!(
            "impedance {name}: worst q {q:.3}, inverts at {step:.2}, {} equations",
            map.equation_count()
        );
        assert!(q >= 0.08, "{q}");
    }
}
