//! A building of many furnished rooms: `rooms`, `points` and `sun-outside`.
//!
//! The camera looks from the hero room through doorways that stand in a line; a door may shut the first of them, and a
//! walk leads through them.

use super::builder::Builder;
use super::building::{Opening, Plan, Room, STOREY_HEIGHT, Shell, Side, WALL};
use super::dice::Dice;
use super::fixtures::{Mood, light};
use super::furnish::{Kind, furnish};
use super::furniture::Palette;
use super::lamps::{Source, share};
use crate::SceneParts;
use glam::Vec3;

/// What random numbers are drawn for.
const LAYOUT: u32 = 1;
const ROOM: u32 = 2;

/// Distance between the wall centre lines of the room that the camera stands in, metres.
const HERO_SIZE: [f32; 2] = [6.6, 6.2];

/// What has been built.
struct Building {
    /// The far corner; the near one lies at the origin.
    size: Vec3,
    /// Low and high corner of a panel that shuts the hero room's doorway to the back.
    door: [Vec3; 2],
    /// Where the eye of a walker passes, from the camera's place on.
    walk: Vec<Vec3>,
}

/// `rooms` and `points`: `lights` lights behind walls and doors.
pub(super) fn rooms(name: &str, lights: usize, seed: u32, source: Source) -> SceneParts {
    let mut b = Builder::new(name);
    building(&mut b, lights, seed, source);
    b.finish()
}

/// [`rooms`] with the hero room's doorway to the back shut.
pub(super) fn rooms_shut(name: &str, lights: usize, seed: u32, source: Source) -> SceneParts {
    let mut b = Builder::new(name);
    let [low, high] = building(&mut b, lights, seed, source).door;
    b.begin("door", "door panel");
    let paint = b.lambert("painted door", [0.45, 0.16, 0.13]);
    b.cuboid(low.to_array(), high.to_array(), paint);
    b.finish()
}

/// Where the eye of somebody passes who walks through the building.
pub(super) fn walk(lights: usize, seed: u32) -> Vec<Vec3> {
    building(&mut Builder::new(""), lights, seed, Source::Panels).walk
}

/// `sun-outside`: the same with one lamp less and, outside of the closed building, one triangle of a thousand times the
/// power of all lamps together. None of its light can reach the image.
pub(super) fn sun_outside(lights: usize, seed: u32) -> SceneParts {
    let mut b = Builder::new("sun-outside");
    let size = building(&mut b, lights - 1, seed, Source::Panels).size;
    b.begin("sun", "sun triangle");
    let center = Vec3::new(0.5 * size.x, size.y + 30.0, 0.5 * size.z + 30.0);
    let toward = (0.5 * size - center).normalize();
    let right = toward.cross(Vec3::Y).normalize();
    let up = right.cross(toward);
    let half = 10.0;
    let power = 1000.0 * b.power();
    // Area of the triangle: 2 half^2.
    let color = Vec3::new(1.0, 0.93, 0.8);
    let radiance = power as f32 / (std::f32::consts::PI * 2.0 * half * half * crate::luminance(color));
    let paint = b.emitter("sun", color * radiance);
    b.triangle(
        [
            center - right * half - up * half,
            center + up * half,
            center + right * half - up * half,
        ],
        paint,
    );
    b.finish()
}

/// How many storeys, rows and columns: about one room for every sqrt(lights) lights, at least 4, at most about 400.
fn grid(lights: usize) -> (usize, usize, usize) {
    let rooms = (lights as f32).sqrt().clamp(4.0, 400.0);
    let storeys = (rooms / 32.0).ceil().min(8.0);
    let columns = (rooms / storeys).sqrt().round().max(2.0);
    let rows = (rooms / storeys / columns).round().max(2.0);
    (storeys as usize, rows as usize, columns as usize)
}

/// Builds everything but a sun and a door.
fn building(b: &mut Builder, lights: usize, seed: u32, source: Source) -> Building {
    let palette = Palette::new(b);
    let (plan, hero) = lay_out(b, lights, seed);
    let shell = Shell {
        ceiling: b.lambert("ceiling", [0.80, 0.79, 0.77]),
        outside: b.lambert("render", [0.62, 0.58, 0.52]),
        frame: palette.white,
        skirting: palette.white,
    };
    plan.build(b, &shell);
    for (index, room) in plan.rooms.iter().enumerate() {
        let mut dice = Dice::new(&[seed, ROOM, index as u32]);
        let kind = match hero.checked_sub(index).map(|behind| behind / plan.columns()) {
            Some(0) if index == hero => Kind::Hero,
            Some(1) if index + plan.columns() == hero => Kind::Dining,
            Some(2) if index + 2 * plan.columns() == hero => Kind::Gallery,
            _ => dice.pick(&Kind::ORDINARY),
        };
        let spots = furnish(b, &mut dice, &palette, room, index, kind);
        let lights = share(lights, plan.rooms.len(), index);
        let mood = Mood::draw(&mut dice, &spots);
        light(b, &mut dice, &palette, &spots, mood, lights, source);
    }
    b.place_in_world();
    let room = &plan.rooms[hero];
    let eye = Vec3::new(room.high.x - 1.15, room.low.y + 1.52, room.high.z - 0.35);
    let target = Vec3::new(room.low.x + 2.75, room.low.y + 1.12, room.low.z);
    b.camera("hall", eye, target, 0.96);
    Building {
        size: Vec3::new(
            plan.xs[plan.columns()],
            plan.storeys as f32 * STOREY_HEIGHT,
            plan.zs[plan.rows()],
        ),
        door: door(&plan, hero),
        walk: way(&plan, hero, eye),
    }
}

/// The panel that fills the doorway to the back and reaches into the wall all round.
fn door(plan: &Plan, hero: usize) -> [Vec3; 2] {
    const REACH: f32 = 0.04;
    let room = &plan.rooms[hero];
    let opening = room.openings[Side::NegZ as usize].expect("rooms in sight are joined");
    let foot = Vec3::new(opening.center, room.low.y, room.low.z - 0.5 * WALL);
    let half = 0.5 * opening.width + REACH;
    [
        foot - Vec3::new(half, REACH, 0.02),
        foot + Vec3::new(half, opening.height + REACH, 0.02),
    ]
}

/// From `eye` straight through all doorways in the line of sight, ending in the room behind the last.
fn way(plan: &Plan, hero: usize, eye: Vec3) -> Vec<Vec3> {
    /// Before and behind a doorway the walker is this far from the wall.
    const CLEARANCE: f32 = 0.7;
    let mut way = vec![eye];
    let mut index = hero;
    while let Some(opening) = plan.rooms[index].openings[Side::NegZ as usize] {
        let z = plan.rooms[index].low.z - 0.5 * WALL;
        for side in [CLEARANCE, -CLEARANCE] {
            way.push(Vec3::new(opening.center, eye.y, z + side));
        }
        index -= plan.columns();
    }
    way
}

/// Wall colours: mostly calm, now and then a bold one.
const WALLS: [(&str, [f32; 3]); 9] = [
    ("chalk wall", [0.76, 0.74, 0.70]),
    ("cream wall", [0.76, 0.69, 0.56]),
    ("sage wall", [0.50, 0.58, 0.44]),
    ("dusty blue wall", [0.40, 0.52, 0.62]),
    ("terracotta wall", [0.66, 0.34, 0.22]),
    ("ochre wall", [0.72, 0.52, 0.22]),
    ("blush wall", [0.74, 0.55, 0.50]),
    ("petrol wall", [0.12, 0.33, 0.38]),
    ("grey wall", [0.56, 0.57, 0.58]),
];

const FLOORS: [(&str, [f32; 3]); 5] = [
    ("oak floor", [0.47, 0.31, 0.18]),
    ("walnut floor", [0.27, 0.16, 0.10]),
    ("pale floor", [0.60, 0.50, 0.38]),
    ("slate floor", [0.30, 0.31, 0.33]),
    ("stone floor", [0.58, 0.56, 0.52]),
];

/// The plan, and the index of the hero room: in the last row, so that the camera looks along a whole row of rooms.
fn lay_out(b: &mut Builder, lights: usize, seed: u32) -> (Plan, usize) {
    let mut dice = Dice::new(&[seed, LAYOUT]);
    let (storeys, rows, columns) = grid(lights);
    let hero = [columns / 2, rows - 1];
    let lines = |dice: &mut Dice, count: usize, hero: usize, hero_size: f32| {
        let mut lines = vec![0.0];
        for i in 0..count {
            let size = dice.range(4.2, 6.8);
            lines.push(lines[i] + if i == hero { hero_size } else { size });
        }
        lines
    };
    let xs = lines(&mut dice, columns, hero[0], HERO_SIZE[0]);
    let zs = lines(&mut dice, rows, hero[1], HERO_SIZE[1]);
    let hero_storey = storeys / 2;

    let mut rooms: Vec<Room> = Vec::with_capacity(storeys * rows * columns);
    for storey in 0..storeys {
        for row in 0..rows {
            for column in 0..columns {
                let (low, high) = Plan::bounds(&xs, &zs, storey, row, column);
                let (wall, floor) = if storey == hero_storey && column == hero[0] {
                    // Down the line of sight: chalk, petrol, ochre, blush, ...
                    let (wall, floor) = [(0, 0), (7, 2), (5, 1), (6, 2)][(rows - 1 - row) % 4];
                    (WALLS[wall], FLOORS[floor])
                } else {
                    (dice.pick(&WALLS), dice.pick(&FLOORS))
                };
                let along = |dice: &mut Dice, low: f32, high: f32| {
                    let wide = dice.chance(0.35);
                    let width = if wide { dice.range(1.5, 2.2) } else { 0.95 };
                    let margin = 0.5 * width + 0.45;
                    Opening {
                        center: dice.range(low + margin, high - margin),
                        width,
                        height: if wide { 2.3 } else { 2.08 },
                    }
                };
                let mut openings = [None; 4];
                let in_sight = storey == hero_storey && column == hero[0];
                let to_back = along(&mut dice, low.x, high.x);
                if row > 0 {
                    openings[Side::NegZ as usize] = if in_sight {
                        Some(enfilade(rows - 1 - row, xs[column]))
                    } else {
                        dice.chance(0.75).then_some(to_back)
                    };
                }
                let to_left = along(&mut dice, low.z, high.z);
                if column > 0 {
                    openings[Side::NegX as usize] = if in_sight && row + 1 == rows {
                        Some(Opening {
                            center: low.z + 1.0,
                            width: 0.95,
                            height: 2.08,
                        })
                    } else {
                        dice.chance(0.75).then_some(to_left)
                    };
                }
                rooms.push(Room {
                    low,
                    high,
                    openings,
                    wall: b.lambert(wall.0, wall.1),
                    floor: b.lambert(floor.0, floor.1),
                });
            }
        }
    }
    let mut plan = Plan { xs, zs, rooms, storeys };
    share_openings(&mut plan);
    let hero = plan.index(hero_storey, hero[1], hero[0]);
    (plan, hero)
}

/// The doorways in the line of sight, `depth` rooms away from the hero room's.
fn enfilade(depth: usize, x: f32) -> Opening {
    let (center, width) = [(3.75, 2.0), (3.2, 1.6), (2.7, 1.6)][depth.min(2)];
    Opening {
        center: x + center,
        width,
        height: if depth == 0 { 2.3 } else { 2.2 },
    }
}

/// A doorway belongs to both rooms beside it.
fn share_openings(plan: &mut Plan) {
    for index in 0..plan.rooms.len() {
        let (column, row) = (index % plan.columns(), index / plan.columns() % plan.rows());
        let [back, _, left, _] = plan.rooms[index].openings;
        if row > 0 {
            let behind = index - plan.columns();
            plan.rooms[behind].openings[Side::PosZ as usize] = back;
        }
        if column > 0 {
            plan.rooms[index - 1].openings[Side::PosX as usize] = left;
        }
    }
}
