//! `city`: a town at night. Every house has stones of its own, windows, trees, cars and lanterns are shared; a person in one room, and a bird
//! above, see different shares of it. Made to measure what is paid for geometry that nobody looks at.

use super::builder::{Builder, Paint, Pose};
use super::city_house::{House, Stones};
use super::city_street::{self as street, WINDOWS_OF_ROW};
use super::dice::Dice;
use super::fixtures::WARM;
use super::furniture::{self as piece, Palette};
use super::lamps::{Lamp, Source};
use crate::SceneParts;
use glam::Vec3;

/// Distance between the centres of neighbouring lots, metres.
const LOT: f32 = 26.0;
/// Half the width of a lot's pavement, metres.
const PAVEMENT: f32 = 10.0;
/// Lights of a lit window, and of a lantern: four panes of two triangles.
pub(super) const PANES: usize = 8;
/// Lit windows a house, about: of some hundred.
const LIT_OF_HOUSE: usize = 40;
/// One lantern for so many windows and lanterns together.
const LANTERN_SHARE: usize = 7;

/// Makes it.
pub(super) fn city(lights: usize, seed: u32) -> SceneParts {
    let mut b = Builder::new("city");
    let p = Palette::new(&mut b);
    // One moon, some lights in the room, the rest in whole windows and lanterns.
    let units = (lights - 1 - PANES) / PANES;
    let lots = lots((units / LIT_OF_HOUSE).max(2));
    let houses: Vec<House> = (0..lots.len() as u32)
        .map(|i| House::draw(&mut Dice::new(&[seed, 31, i])))
        .collect();
    let windows: usize = houses.iter().map(|house| house.rows() * WINDOWS_OF_ROW).sum();
    let lanterns = (units / LANTERN_SHARE).min(2 * lots.len());
    let lit = (units - lanterns).min(windows);
    let in_room = lights - 1 - PANES * (lanterns + lit);

    b.begin("moon", "moon");
    b.directional_light(Vec3::new(-0.48, -0.8, 0.36).normalize(), Vec3::new(0.045, 0.06, 0.09));
    ground(&mut b, &lots);
    room(&mut b, &mut Dice::new(&[seed, 32]), &p, in_room);
    windows_and_houses(&mut b, seed, &p, &lots, &houses, lit);
    furnish_streets(&mut b, seed, &p, &lots, lanterns);

    b.place_in_world();
    b.camera("room", Vec3::new(2.7, 5.55, -2.25), Vec3::new(-0.9, 4.95, 1.6), 1.05);
    let size = LOT * (lots.len() as f32).sqrt();
    let eye = Vec3::new(0.40 * size, 22.0 + 0.22 * size, 10.0 + 0.50 * size);
    b.camera("above", eye, Vec3::new(0.0, 2.0, 0.04 * size), 0.85);
    b.finish()
}

/// Centres of the lots around the one with the room, the nearest first; the one that is seen from its window before all.
fn lots(count: usize) -> Vec<Vec3> {
    let reach = (count as f64).sqrt() as i32 + 1;
    let mut cells: Vec<[i32; 2]> = (-reach..=reach)
        .flat_map(|i| (-reach..=reach).map(move |j| [i, j]))
        .filter(|cell| *cell != [0, 0])
        .collect();
    cells.sort_by_key(|&[i, j]| (i * i + j * j, -j, i));
    cells.truncate(count);
    let center = |[i, j]: [i32; 2]| Vec3::new(LOT * i as f32, 0.0, LOT * j as f32);
    cells.into_iter().map(center).collect()
}

/// Roads, pavements and their stripes.
fn ground(b: &mut Builder, lots: &[Vec3]) {
    let asphalt = b.lambert("asphalt", [0.09, 0.09, 0.1]);
    let stone = b.lambert("pavement", [0.32, 0.31, 0.29]);
    let stripe = b.lambert("stripe", [0.6, 0.6, 0.57]);
    let reach = lots.iter().fold(LOT, |reach, lot| reach.max(lot.abs().max_element())) + LOT;
    b.begin("ground", "ground");
    b.cuboid([-reach, -1.0, -reach], [reach, 0.0, reach], asphalt);
    b.begin("pavements", "pavement");
    for (i, lot) in std::iter::once(&Vec3::ZERO).chain(lots).enumerate() {
        let half = PAVEMENT;
        b.cuboid(
            [lot.x - half, -0.5, lot.z - half],
            [lot.x + half, 0.14, lot.z + half],
            stone,
        );
        for k in 0..6 {
            let x = lot.x - half + 4.0 * k as f32;
            let z = lot.z + 0.5 * LOT;
            // The lots at the rim have no street before them, but a stripe does no harm there.
            b.cuboid(
                [x, -0.1, z - 0.07],
                [x + 2.0, 0.004 + 1e-5 * (i % 2) as f32, z + 0.07],
                stripe,
            );
        }
    }
}

/// The house that the room is in, without its neighbours' ornaments, and the room itself on its first floor, with a window to the street.
fn room(b: &mut Builder, dice: &mut Dice, p: &Palette, lights: usize) {
    let plaster = b.lambert("plaster", [0.55, 0.5, 0.42]);
    let wall = b.lambert("wallpaper", [0.68, 0.63, 0.52]);
    let ceiling = b.lambert("ceiling", [0.85, 0.84, 0.81]);
    let (x, z, floor, top) = (3.2, 2.6, 3.9, 6.7);
    let outer = [x + 0.3, z + 0.3];
    b.begin("house of the room", "house");
    b.place_in_world();
    let faces = |b: &mut Builder, low: [f32; 3], high: [f32; 3], at: usize, inside: Paint| {
        let mut paints = [plaster; 6];
        paints[at] = inside;
        b.cuboid_painted(low, high, paints);
    };
    faces(b, [-outer[0], -0.1, -outer[1]], [outer[0], floor, outer[1]], 3, p.oak);
    faces(b, [-outer[0], top, -outer[1]], [outer[0], 15.0, outer[1]], 2, ceiling);
    // Walls reach into floor and ceiling, and lie a little behind their outside.
    let (low, high, o) = (floor - 0.05, top + 0.05, [outer[0] - 0.01, outer[1] - 0.01]);
    faces(b, [-o[0], low, -o[1]], [-x, high, o[1]], 1, wall);
    faces(b, [x, low, -o[1]], [o[0], high, o[1]], 0, wall);
    faces(b, [-x - 0.05, low, -o[1] + 0.01], [x + 0.05, high, -z], 5, wall);
    let front = o[1] - 0.01;
    let (sill, head, jamb) = (4.75, 6.35, 1.6);
    faces(b, [-x - 0.05, low, z], [x + 0.05, sill, front], 4, wall);
    faces(b, [-x - 0.05, head, z], [x + 0.05, high, front], 4, wall);
    for side in [-1.0f32, 1.0] {
        let (from, to) = (
            (side * (x + 0.05)).min(side * jamb),
            (side * (x + 0.05)).max(side * jamb),
        );
        faces(
            b,
            [from, sill - 0.05, z + 0.004],
            [to, head + 0.05, front - 0.004],
            4,
            wall,
        );
    }
    for k in 0..4 {
        let at = -jamb + 2.0 * jamb * k as f32 / 3.0;
        b.cuboid(
            [at - 0.03, sill - 0.02, z + 0.1],
            [at + 0.03, head + 0.02, z + 0.16],
            p.white,
        );
    }
    b.cuboid(
        [-jamb - 0.12, sill - 0.04, z - 0.12],
        [jamb + 0.12, sill + 0.01, z + 0.2],
        p.white,
    );
    furnish(b, dice, p, floor);

    b.begin("room / lamp", "lamp");
    b.place_in_world();
    b.bar(
        Vec3::new(-0.2, 6.2, 0.1),
        Vec3::new(-0.2, top + 0.02, 0.1),
        0.03,
        p.dark,
    );
    let lamp = Lamp {
        bottom_center: Vec3::new(-0.2, 6.12, 0.1),
        half: [0.55, 0.3],
        height: 0.1,
        housing: p.brass,
        up: false,
    };
    lamp.build(b, Source::Panels, lights, WARM * 42.0, "room light");
}

fn furnish(b: &mut Builder, dice: &mut Dice, p: &Palette, floor: f32) {
    let at = |x: f32, z: f32| Vec3::new(x, floor, z);
    let put = |b: &mut Builder, what: &str, at: Vec3, turns: f32| {
        b.begin(format!("room / {what}"), what);
        b.place(Pose::new(at, turns));
    };
    put(b, "rug", at(-0.9, 0.2), 0.0);
    piece::rug(b, [1.5, 1.2], p.linen, p.fabric[4]);
    put(b, "sofa", at(-3.2, 0.2), 0.25);
    piece::sofa(b, dice, p, 2.2, p.fabric[1]);
    put(b, "table", at(-1.1, 0.2) + Vec3::Y * 0.011, 0.0);
    piece::round_table(b, 0.5, 0.42, p.oak, p.dark);
    piece::stack(b, dice, p, Vec3::new(0.14, 0.42, 0.1));
    piece::vase(b, Vec3::new(-0.15, 0.42, -0.12), 0.26, p.clay);
    put(b, "armchair", at(0.9, -0.6), 0.66);
    piece::sofa(b, dice, p, 1.0, p.fabric[5]);
    put(b, "shelf", at(-1.4, -2.6), 0.0);
    piece::shelf(b, dice, p, [1.9, 2.1], p.walnut, 0.75);
    put(b, "sideboard", at(3.2, 0.9), 0.75);
    piece::sideboard(b, dice, p, 1.7, p.oak);
    put(b, "plant", at(-2.75, 2.1), 0.1);
    piece::plant(b, dice, p, 1.4, 22);
    put(b, "painting", at(-3.2, 0.2), 0.25);
    piece::painting(b, dice, p, [1.4, 0.85]);
}

/// A mesh for every house, and rows of windows in front of it, `lit` of all windows with light behind them.
fn windows_and_houses(b: &mut Builder, seed: u32, p: &Palette, lots: &[Vec3], houses: &[House], lit: usize) {
    let rows = street::WindowRows::new(b, p);
    let stones = Stones::new(b);
    let mut dice = Dice::new(&[seed, 33]);
    let mut windows: usize = houses.iter().map(|house| house.rows() * WINDOWS_OF_ROW).sum();
    let mut lit = lit;
    for (i, (house, &lot)) in houses.iter().zip(lots).enumerate() {
        let stand = Pose::new(lot + Vec3::Y * 0.13, 0.25 * dice.below(4) as f32);
        b.begin(format!("house {i}"), "house");
        let mesh = b.shared("house", |b| {
            house.build(b, &mut Dice::new(&[seed, 34, i as u32]), &stones);
        });
        b.instance(mesh, &stand);
        b.begin(format!("house {i} / windows"), "windows");
        for row in house.row_poses() {
            let pattern = (0..WINDOWS_OF_ROW).fold(0, |pattern, window| {
                // Each with the probability that makes the sum come out.
                let shines = dice.below(windows) < lit;
                windows -= 1;
                lit -= usize::from(shines);
                pattern | usize::from(shines) << window
            });
            b.instance(rows.mesh(&mut dice, pattern), &stand.of(row));
        }
    }
}

/// Lanterns, trees and cars at the kerbs.
fn furnish_streets(b: &mut Builder, seed: u32, p: &Palette, lots: &[Vec3], lanterns: usize) {
    let mut dice = Dice::new(&[seed, 35]);
    let [unlit, lit] = [false, true].map(|lit| street::lantern(b, p, lit));
    let trees: Vec<u32> = (0..6).map(|_| street::tree(b, &mut dice, p)).collect();
    let cars = street::cars(b, p);
    let kerb = PAVEMENT - 0.6;
    for (i, &lot) in lots.iter().enumerate() {
        b.begin(format!("street {i}"), "street");
        for (k, x) in [-0.72, 0.55].into_iter().enumerate() {
            let at = lot + Vec3::new(x * kerb, 0.13, if k == 0 { kerb } else { -kerb });
            let mesh = if 2 * i + k < lanterns { lit } else { unlit };
            b.instance(mesh, &Pose::new(at, 0.125));
        }
        for (k, x) in [-0.2, 0.35, 0.9].into_iter().enumerate() {
            let at = lot + Vec3::new(x * kerb, 0.13, if k == 1 { -kerb } else { kerb });
            let tree = dice.pick(&trees);
            b.instance(tree, &Pose::new(at, dice.unit()));
        }
        for side in [-1.0, 1.0] {
            if dice.chance(0.7) {
                let at = lot + Vec3::new(dice.range(-6.0, 6.0), 0.0, side * (PAVEMENT + 1.05));
                let car = dice.pick(&cars);
                b.instance(car, &Pose::new(at, if side > 0.0 { 0.0 } else { 0.5 }));
            }
        }
    }
}
