//! What the linear and the hyperelastic law make of motions in several directions, each in one step: a ball in a box that grows,
//! shrinks, wanders, turns and roughens, and the motions of the torture set.

use cpu_time::ProcessTime;
use fluxmorph_geometry::tet4::{Point, sub, volume};
use fluxmorph_remesh::{Motion, MotionLaw, Moved, RemeshError, RemeshSetup, StiffnessPolicy};

use super::case::Case;
use super::cases::{self, turned};
use crate::support::noise;

/// Radius of the ball [m]; the box has four times that as its half size.
const RADIUS: f64 = 0.01;

/// Random designs.
const SEEDS: u64 = 20;

/// A motion of the ball's surface, and its designs, one for each seed.
struct Kind {
    name: &'static str,
    cases: Vec<Case>,
}

fn ball(displacement: impl Fn(f64, Point) -> Point + Sync + 'static) -> Case {
    let Case { mesh, setup, .. } = cases::growing_ball();
    Case::new("", mesh, setup, displacement)
}

/// Scaled by a factor and shifted along x by so many radii.
fn scaled(factor: f64, shift: f64) -> Case {
    ball(move |t, p| {
        let [x, y, z] = p.map(|c| t * (factor - 1.0) * c);
        [x + t * shift * RADIUS, y, z]
    })
}

fn spun(degrees: f64) -> Case {
    let axis = [2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0];
    ball(move |t, p| sub(turned(p, axis, t * degrees.to_radians()), p))
}

/// Every node moved along its radius by up to a share of it.
fn rough(share: f64, seed: u64) -> Case {
    let mut noise = noise(seed);
    let case = ball(|_, p| p);
    let shift: Vec<Point> = (case.path)(1.0).iter().map(|p| p.map(|c| share * c)).collect();
    let shares: Vec<f64> = shift.iter().map(|_| noise()).collect();
    let at = move |t: f64| shift.iter().zip(&shares).map(|(u, s)| u.map(|c| t * s * c)).collect();
    Case { path: Box::new(at), ..case }
}

fn kinds() -> Vec<Kind> {
    let one = |name, case| Kind { name, cases: vec![case] };
    let mut kinds = vec![
        one("ball × 1.4", scaled(1.4, 0.0)),
        one("ball × 2", scaled(2.0, 0.0)),
        one("ball × 2.5", scaled(2.5, 0.0)),
        one("ball × 0.4", scaled(0.4, 0.0)),
        one("ball × 1.2, moved by R", scaled(1.2, 1.0)),
        one("ball × 1.2, moved by 2 R", scaled(1.2, 2.0)),
        one("ball turned by 60°", spun(60.0)),
        one("ball turned by 150°", spun(150.0)),
    ];
    let seeds = |share| (0..SEEDS).map(|seed| rough(share, seed)).collect();
    kinds.push(Kind { name: "ball, every node ±10 % R", cases: seeds(0.1) });
    kinds.push(Kind { name: "ball, every node ±20 % R", cases: seeds(0.2) });
    kinds.extend([
        one("cylinder + 80 % of its gap, 45° about its axis", cases::rotor_about_own_axis()),
        one("cylinder + 80 % of its gap, 45° across its axis", cases::rotor_about_cross_axis()),
        one("block, top line −45 %", cases::block_line(-0.45)),
        one("block, top line −80 %", cases::block_line(-0.8)),
    ]);
    kinds
}

/// What a law makes of the designs of a kind.
#[derive(Default)]
struct Row {
    carried: usize,
    /// Least ratio of an element's volumes and worst quality over the carried designs, and most Newton steps.
    stretch: f64,
    quality: f64,
    steps: usize,
    /// CPU seconds a design.
    time: f64,
}

fn least_stretch(case: &Case, moved: &Moved) -> f64 {
    let ratio = |e| volume(moved.mesh.vertices(e)) / volume(case.mesh.vertices(e));
    case.mesh.topology().elements().map(ratio).fold(f64::INFINITY, f64::min)
}

fn measured(kind: &Kind, law: MotionLaw) -> Row {
    let mut row = Row { stretch: f64::INFINITY, quality: f64::INFINITY, ..Row::default() };
    for case in &kind.cases {
        let setup = RemeshSetup { law, policy: StiffnessPolicy::InverseVolume, ..case.setup.clone() };
        let motion = Motion::new(case.mesh.clone(), setup).unwrap();
        let clock = ProcessTime::now();
        let moved = motion.moved(&(case.path)(1.0));
        row.time += clock.elapsed().as_secs_f64() / kind.cases.len() as f64;
        match moved {
            Ok(moved) => {
                row.carried += 1;
                row.stretch = row.stretch.min(least_stretch(case, &moved));
                row.quality = row.quality.min(motion.quality(&moved.mesh).worst);
                row.steps = row.steps.max(moved.newton_steps);
            }
            Err(RemeshError::Inverted { .. } | RemeshError::NotSettled { .. }) => {}
            Err(other) => panic!("{other}"),
        }
    }
    row
}

#[test]
fn the_hyperelastic_law_carries_the_torture_set_in_one_step() {
    println!("| motion | of | linear | least J | hyperelastic | least J | worst q | Newton steps | CPU s |");
    for kind in kinds() {
        let [linear, own] = [MotionLaw::Linear, MotionLaw::Hyperelastic].map(|law| measured(&kind, law));
        let of_linear = if linear.carried == 0 { "–".to_owned() } else { format!("{:.3}", linear.stretch) };
        let Row { carried, stretch, quality, steps, time } = own;
        println!(
            "| {} | {} | {} | {of_linear} | {carried} | {stretch:.3} | {quality:.4} | {steps} | {time:.2} |",
            kind.name,
            kind.cases.len(),
            linear.carried
        );
        assert_eq!(carried, kind.cases.len(), "{}", kind.name);
    }
}
