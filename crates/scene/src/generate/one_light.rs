//! A furnished room with exactly one light.

use super::builder::{Builder, Pose};
use super::building::{Plan, Room, Shell};
use super::dice::Dice;
use super::fixtures::NEUTRAL;
use super::furniture::{self as piece, Palette};
use crate::{SceneParts, luminance};
use glam::Vec3;
use std::f32::consts::PI;

/// `one-light`: the light is one triangle under a closed three-sided housing.
pub(super) fn one_light(seed: u32) -> SceneParts {
    let mut b = Builder::new("one-light");
    let p = Palette::new(&mut b);
    let mut dice = Dice::new(&[seed, 11]);
    let (xs, zs) = (vec![0.0, 5.4], vec![0.0, 5.6]);
    let (low, high) = Plan::bounds(&xs, &zs, 0, 0, 0);
    let room = Room {
        low,
        high,
        openings: [None; 4],
        wall: b.lambert("cream wall", [0.76, 0.70, 0.58]),
        floor: b.lambert("oak floor", [0.47, 0.31, 0.18]),
    };
    let shell = Shell {
        ceiling: b.lambert("ceiling", [0.80, 0.79, 0.77]),
        outside: b.lambert("render", [0.62, 0.58, 0.52]),
        frame: p.white,
        skirting: p.white,
    };
    let plan = Plan {
        xs,
        zs,
        rooms: vec![room.clone()],
        storeys: 1,
    };
    plan.build(&mut b, &shell);

    let at = |x: f32, z: f32| low + Vec3::new(x, 0.0, z);
    b.begin("table", "round table");
    b.place(Pose::new(at(2.5, 2.6), 0.0));
    piece::round_table(&mut b, 0.62, 0.75, p.oak, p.dark);
    piece::vase(&mut b, Vec3::new(0.1, 0.75, -0.1), 0.36, p.fabric[0]);
    b.ball(Vec3::new(-0.25, 0.75 + 0.085, 0.12), 0.09, 24, p.fabric[1]);
    for i in 0..3 {
        let turns = 0.08 + i as f32 / 3.0;
        b.begin(format!("chair {i}"), "chair");
        let away = Pose::new(at(2.5, 2.6), turns).point(Vec3::new(0.0, 0.0, -0.85));
        b.place(Pose::new(away, turns));
        piece::chair(&mut b, p.walnut, p.fabric[3]);
    }
    b.begin("shelf", "shelf");
    b.place(Pose::new(at(1.3, 0.0), 0.0));
    piece::shelf(&mut b, &mut dice, &p, [1.6, 2.0], p.walnut, 0.7);
    b.begin("plant", "plant");
    b.place(Pose::new(at(4.4, 0.7), 0.0));
    piece::plant(&mut b, &mut dice, &p, 1.6, 20);
    b.begin("painting", "painting");
    b.place(Pose::new(at(2.95, 0.0), 0.0));
    piece::painting(&mut b, &mut dice, &p, [0.9, 0.9]);

    b.place_in_world();
    b.begin("ceiling lamp", "triangular lamp");
    let center = Vec3::new(room.center().x, high.y - 0.1, room.center().z + 0.2);
    let corner = |radius: f32, i: usize, y: f32| {
        let (x, z) = [(0.866, 0.5), (-0.866, 0.5), (0.0, -1.0)][i];
        center + Vec3::new(radius * x, y, radius * z)
    };
    // The housing is a prism: a box two of whose edges have become one would leave flat triangles, so by hand.
    let top: Vec<Vec3> = (0..3).rev().map(|i| corner(0.75, i, 0.11)).collect();
    let bottom: Vec<Vec3> = (0..3).map(|i| corner(0.75, i, 0.0)).collect();
    b.polygon(&top, p.white);
    b.polygon(&bottom, p.white);
    for i in 0..3 {
        let j = (i + 1) % 3;
        b.polygon(
            &[corner(0.75, i, 0.11), corner(0.75, j, 0.11), bottom[j], bottom[i]],
            p.white,
        );
    }
    let flux = 3.2 * room.size().element_product() / 0.55;
    let area = 0.75 * 3f32.sqrt() * 0.7 * 0.7;
    let paint = b.emitter("lamp", NEUTRAL * (flux / (PI * area * luminance(NEUTRAL))));
    b.triangle([0, 1, 2].map(|i| corner(0.7, i, -0.002)), paint);
    b.camera(
        "door",
        Vec3::new(high.x - 0.5, 1.5, high.z - 0.3),
        Vec3::new(2.2, 0.95, 1.6),
        0.95,
    );
    b.finish()
}
