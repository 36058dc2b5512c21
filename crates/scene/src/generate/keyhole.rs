//! `keyhole`: a dark room that gets its light through the gap of a door ajar.
//!
//! Behind the door lies a bright room, behind that one two more. Most of the lights reach nothing that the camera sees;
//! a few reach a little through the gap.

use super::builder::{Builder, Pose};
use super::building::{Opening, Plan, Room, Shell, Side};
use super::dice::Dice;
use super::fixtures::{COOL, Mood, NEUTRAL, WARM, light};
use super::furnish::{Kind, furnish};
use super::furniture::{self as piece, Palette};
use super::lamps::{Source, share};
use crate::SceneParts;
use glam::Vec3;

/// The doorway to the dark room. The leaf stands open by `LEAF_TURNS` whole turns.
const DOOR: Opening = Opening {
    center: 1.9,
    width: 1.0,
    height: 2.1,
};
/// The middle of the wall it stands in.
const DOOR_Z: f32 = 5.6;
const LEAF_TURNS: f32 = 0.06;

/// Makes it: a tenth of the lights in either hidden room, the others in the bright one.
pub(super) fn keyhole(lights: usize, seed: u32) -> SceneParts {
    let mut b = Builder::new("keyhole");
    build(&mut b, lights, seed);
    b.finish()
}

/// [`keyhole`] with a panel in the doorway that leaves the dark room without any light.
pub(super) fn keyhole_shut(lights: usize, seed: u32) -> SceneParts {
    const REACH: f32 = 0.04;
    let mut b = Builder::new("keyhole");
    build(&mut b, lights, seed);
    b.begin("shut door", "door panel");
    let paint = b.lambert("painted door", [0.45, 0.16, 0.13]);
    let half = 0.5 * DOOR.width + REACH;
    b.cuboid(
        [DOOR.center - half, -REACH, DOOR_Z - 0.02],
        [DOOR.center + half, DOOR.height + REACH, DOOR_Z + 0.02],
        paint,
    );
    b.finish()
}

fn build(b: &mut Builder, lights: usize, seed: u32) {
    let p = Palette::new(b);
    let (xs, zs) = (vec![0.0, 5.8, 10.6], vec![0.0, DOOR_Z, 10.8]);
    let doorway = |center| Opening {
        center,
        width: 1.6,
        height: 2.2,
    };
    let colors = [
        ("cream wall", [0.76, 0.69, 0.56], "pale floor", [0.60, 0.50, 0.38]),
        ("terracotta wall", [0.66, 0.34, 0.22], "stone floor", [0.58, 0.56, 0.52]),
        ("dusty blue wall", [0.40, 0.52, 0.62], "oak floor", [0.47, 0.31, 0.18]),
        ("sage wall", [0.50, 0.58, 0.44], "slate floor", [0.30, 0.31, 0.33]),
    ];
    let mut rooms = Vec::new();
    for (index, (wall, wall_color, floor, floor_color)) in colors.into_iter().enumerate() {
        let (low, high) = Plan::bounds(&xs, &zs, 0, index / 2, index % 2);
        rooms.push(Room {
            low,
            high,
            openings: [None; 4],
            wall: b.lambert(wall, wall_color),
            floor: b.lambert(floor, floor_color),
        });
    }
    // 0 is the bright room, 1 and 3 the hidden ones, 2 the dark one.
    for (index, side, other, facing, opening) in [
        (0, Side::PosZ, 2, Side::NegZ, DOOR),
        (0, Side::PosX, 1, Side::NegX, doorway(2.8)),
        (1, Side::PosZ, 3, Side::NegZ, doorway(8.0)),
    ] {
        rooms[index].openings[side as usize] = Some(opening);
        rooms[other].openings[facing as usize] = Some(opening);
    }
    let plan = Plan {
        xs,
        zs,
        rooms,
        storeys: 1,
    };
    let shell = Shell {
        ceiling: b.lambert("ceiling", [0.80, 0.79, 0.77]),
        outside: b.lambert("render", [0.62, 0.58, 0.52]),
        frame: p.white,
        skirting: p.white,
    };
    plan.build(b, &shell);
    leaf(b, &p);

    let hidden = share(lights, 10, 0).max(1);
    for (index, lights, kind, color, irradiance) in [
        (0, lights - 2 * hidden, Kind::Gallery, NEUTRAL, 500.0),
        (1, hidden, Kind::Dining, WARM, 40.0),
        (3, hidden, Kind::Library, COOL, 40.0),
    ] {
        let mut dice = Dice::new(&[seed, 31, index as u32]);
        let spots = furnish(b, &mut dice, &p, &plan.rooms[index], index, kind);
        light(
            b,
            &mut dice,
            &p,
            &spots,
            Mood { color, irradiance },
            lights,
            Source::Panels,
        );
    }
    let dark = &plan.rooms[2];
    furnish_dark(b, &mut Dice::new(&[seed, 32]), &p, dark);
    b.place_in_world();
    let eye = Vec3::new(dark.high.x - 0.5, 1.5, dark.high.z - 0.35);
    let target = Vec3::new(dark.low.x + 2.5, 0.8, dark.low.z + 0.6);
    b.camera("dark room", eye, target, 0.95);
}

/// The door's leaf, hinged on the jamb at its low x, open into the dark room.
fn leaf(b: &mut Builder, p: &Palette) {
    b.begin("door", "door leaf");
    let paint = b.lambert("painted door", [0.45, 0.16, 0.13]);
    let hinge = Vec3::new(DOOR.center - 0.5 * DOOR.width + 0.015, 0.0, DOOR_Z + 0.085);
    b.place(Pose::new(hinge, -LEAF_TURNS));
    let width = DOOR.width - 0.035;
    b.cuboid([0.0, 0.018, -0.022], [width, 2.075, 0.022], paint);
    for (low, high) in [(0.22, 0.95), (1.1, 1.95)] {
        b.cuboid([0.15, low, -0.028], [width - 0.15, high, 0.028], paint);
    }
    for side in [-1.0, 1.0] {
        b.bar(
            Vec3::new(width - 0.07, 1.02, 0.0),
            Vec3::new(width - 0.07, 1.02, 0.065 * side),
            0.02,
            p.brass,
        );
        b.bar(
            Vec3::new(width - 0.06, 1.02, 0.06 * side),
            Vec3::new(width - 0.2, 1.02, 0.06 * side),
            0.018,
            p.brass,
        );
    }
}

/// Things on which the light from the gap falls, or that stand dark before it.
fn furnish_dark(b: &mut Builder, dice: &mut Dice, p: &Palette, room: &Room) {
    let at = |x: f32, z: f32| room.low + Vec3::new(x, 0.0, z);
    let place = |b: &mut Builder, name: &str, pose: Pose| {
        b.begin(format!("dark room / {name}"), name);
        b.place(pose);
    };
    place(b, "rug", Pose::new(at(3.1, 2.3), 0.0));
    piece::rug(b, [1.5, 1.15], p.linen, p.fabric[3]);
    place(b, "table", Pose::new(at(3.75, 2.0) + Vec3::Y * 0.011, 0.0));
    piece::round_table(b, 0.5, 0.6, p.oak, p.dark);
    piece::vase(b, Vec3::new(-0.1, 0.6, -0.1), 0.34, p.white);
    b.ball(Vec3::new(0.22, 0.6 + 0.095, 0.06), 0.1, 24, p.fabric[1]);
    place(b, "armchair", Pose::new(at(0.95, 2.9), 0.2));
    piece::sofa(b, dice, p, 1.05, p.fabric[0]);
    place(b, "chair", Pose::new(at(2.75, 2.95), 0.15));
    piece::chair(b, p.walnut, p.fabric[1]);
    place(b, "shelf", room.at_wall(Side::NegX, 1.6));
    piece::shelf(b, dice, p, [1.6, 2.0], p.oak, 0.75);
    place(b, "plant", Pose::new(at(5.0, 0.5), 0.0));
    piece::plant(b, dice, p, 1.5, 20);
    place(b, "painting", room.at_wall(Side::NegZ, 3.6));
    piece::painting(b, dice, p, [0.9, 1.1]);
}
