//! Which lamps hang in a room, and how its lights are shared between them.

use super::builder::{Builder, Pose};
use super::building::{Room, SIDES};
use super::dice::Dice;
use super::furnish::Kind;
use super::furniture::{Palette, SINK};
use super::lamps::{Lamp, Source, share};
use glam::Vec3;

/// Lamp light, linear RGB of luminance about 1.
pub(super) const WARM: Vec3 = Vec3::new(1.45, 0.93, 0.42);
pub(super) const NEUTRAL: Vec3 = Vec3::new(1.18, 0.98, 0.74);
pub(super) const COOL: Vec3 = Vec3::new(0.80, 1.02, 1.36);
const TINTED: [Vec3; 4] = [
    Vec3::new(1.9, 0.78, 0.25),
    Vec3::new(0.35, 1.15, 1.35),
    Vec3::new(1.75, 0.66, 1.1),
    Vec3::new(0.55, 1.2, 0.75),
];

/// A furnished room, and where in it lamps may go.
pub(super) struct Spots<'a> {
    pub(super) room: &'a Room,
    pub(super) index: usize,
    pub(super) kind: Kind,
    /// What a lamp may hang over: a table. Its length is along x turned by this pose.
    pub(super) table: Option<Pose>,
    /// Free floor for a lamp on a pole.
    pub(super) floor: Option<Vec3>,
}

/// How the lights of a room are shared between its kinds of lamps; at least one hangs under the ceiling.
struct Shares {
    ceiling: usize,
    pendants: usize,
    sconces: usize,
    floor: usize,
}

impl Shares {
    fn new(spots: &Spots, lights: usize) -> Self {
        let when = |there: bool, least: usize, lights: usize| if there && lights >= least { lights } else { 0 };
        let pendants = when(spots.table.is_some(), 2, lights / 6);
        let sconces = when(true, 4, lights / 6);
        let floor = when(spots.floor.is_some(), 2, lights / 8);
        Self {
            ceiling: lights - pendants - sconces - floor,
            pendants,
            sconces,
            floor,
        }
    }
}

/// Colour and brightness of a room.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mood {
    pub(super) color: Vec3,
    /// Mean irradiance on the floor, roughly, W/m^2.
    pub(super) irradiance: f32,
}

impl Mood {
    /// What suits the use of the room, with a tinted one now and then.
    pub(super) fn draw(dice: &mut Dice, spots: &Spots) -> Self {
        let (color, irradiance) = match spots.kind {
            Kind::Hero => (NEUTRAL, 7.0),
            Kind::Dining if spots.table.is_some() => (WARM, dice.range(6.0, 8.0)),
            Kind::Gallery => (COOL, 11.0),
            _ if dice.chance(0.15) => (dice.pick(&TINTED), dice.range(3.0, 6.0)),
            _ => (dice.pick(&[WARM, WARM, NEUTRAL, COOL]), dice.range(2.0, 9.0)),
        };
        Self { color, irradiance }
    }
}

/// Hangs the lamps of one room: exactly `lights` lights.
pub(super) fn light(
    b: &mut Builder,
    dice: &mut Dice,
    p: &Palette,
    spots: &Spots,
    mood: Mood,
    lights: usize,
    source: Source,
) {
    b.place_in_world();
    let size = spots.room.size();
    let shares = Shares::new(spots, lights);
    // About half of the flux falls on walls and furniture.
    let flux = mood.irradiance * size.x * size.y / 0.55;
    ceiling_lamps(b, dice, p, spots, shares.ceiling, mood.color * (flux * 0.6), source);
    if let (Some(table), 1..) = (spots.table, shares.pendants) {
        pendants(b, dice, p, spots, table, shares.pendants, WARM * (flux * 0.06), source);
    }
    if let (Some(at), 1..) = (spots.floor, shares.floor) {
        b.begin(format!("room {} / floor lamp", spots.index), "floor lamp");
        b.place(Pose {
            origin: at,
            ..Pose::IDENTITY
        });
        b.frustum(Vec3::new(0.0, -SINK, 0.0), [0.16, 0.15], 0.035, 20, p.dark);
        b.cylinder(Vec3::new(0.0, 0.02, 0.0), 0.014, 1.74, 8, p.dark);
        b.frustum(Vec3::new(0.0, 1.66, 0.0), [0.05, 0.2], 0.12, 20, p.dark);
        let fixture = Lamp {
            bottom_center: Vec3::new(0.0, 1.76, 0.0),
            half: [0.13, 0.13],
            height: 0.03,
            housing: p.dark,
            up: true,
        };
        fixture.build(b, source, shares.floor, WARM * (flux * 0.16), "floor light");
        b.place_in_world();
    }
    sconces(b, p, spots, shares.sconces, WARM * (flux * 0.2), source);
}

/// Lamps under the ceiling on a grid that follows the shape of the room.
fn ceiling_lamps(
    b: &mut Builder,
    dice: &mut Dice,
    p: &Palette,
    spots: &Spots,
    lights: usize,
    flux: Vec3,
    source: Source,
) {
    let (room, size) = (spots.room, spots.room.size());
    let lamps = ((lights as f32 / 2.0).sqrt() as usize).clamp(1, 12).min(lights);
    let rows = ((lamps as f32 * size.y / size.x).sqrt().round() as usize).clamp(1, lamps);
    let half = dice.pick(&[[0.55, 0.09], [0.3, 0.3], [0.24, 0.24], [0.4, 0.16]]);
    let mut lamp = 0;
    for row in 0..rows {
        let columns = share(lamps, rows, row);
        for column in 0..columns {
            let x = room.low.x + size.x * (column as f32 + 0.5) / columns as f32;
            let z = room.low.z + size.y * (row as f32 + 0.5) / rows as f32;
            b.begin(format!("room {} / ceiling lamp {lamp}", spots.index), "ceiling lamp");
            let fixture = Lamp {
                bottom_center: Vec3::new(x, room.high.y - 0.055, z),
                half,
                height: 0.06,
                housing: p.white,
                up: false,
            };
            let mine = share(lights, lamps, lamp);
            fixture.build(b, source, mine, flux * (mine as f32 / lights as f32), "ceiling light");
            lamp += 1;
        }
    }
}

/// Small lamps on cords over a table.
#[expect(clippy::too_many_arguments, reason = "called once; a struct would only rename them")]
fn pendants(
    b: &mut Builder,
    dice: &mut Dice,
    p: &Palette,
    spots: &Spots,
    table: Pose,
    lights: usize,
    flux: Vec3,
    source: Source,
) {
    let lamps = if lights < 4 { 1 } else { 3 };
    let housing = dice.pick(&[p.brass, p.dark, p.fabric[1]]);
    for i in 0..lamps {
        let offset = (i as f32 - 0.5 * (lamps as f32 - 1.0)) * 0.42;
        let height = if i % 2 == 1 { 1.72 } else { 1.84 };
        let at = table
            .point(Vec3::new(offset, 0.0, 0.0))
            .with_y(spots.room.low.y + height);
        b.begin(format!("room {} / pendant lamp {i}", spots.index), "pendant lamp");
        b.bar(at + Vec3::Y * 0.1, at.with_y(spots.room.high.y + 0.02), 0.012, p.dark);
        let fixture = Lamp {
            bottom_center: at,
            half: [0.11, 0.11],
            height: 0.13,
            housing,
            up: false,
        };
        let mine = share(lights, lamps, i);
        fixture.build(b, source, mine, flux * (mine as f32 / lights as f32), "pendant light");
    }
}

/// Lamps on the walls, one for each wall in turn, that shine up and down along it.
fn sconces(b: &mut Builder, p: &Palette, spots: &Spots, lights: usize, flux: Vec3, source: Source) {
    let room = spots.room;
    let lamps = (lights / 4).clamp(1, 4).min(lights);
    for (i, side) in SIDES.into_iter().enumerate().take(lamps) {
        let length = room.length(side);
        let along = match room.opening(side) {
            Some(door) if door.center > 0.5 * length => 0.5 * (door.center - 0.5 * door.width),
            Some(door) => 0.5 * (length + door.center + 0.5 * door.width),
            None => 0.5 * length,
        };
        b.begin(format!("room {} / wall lamp {i}", spots.index), "wall lamp");
        b.place(room.at_wall(side, along));
        b.cuboid([-0.03, 2.22, -0.01], [0.03, 2.28, 0.06], p.brass);
        let mine = share(lights, lamps, i);
        let down = mine / 2;
        for (up, lights, y) in [(true, mine - down, 2.251), (false, down, 2.16)] {
            let fixture = Lamp {
                bottom_center: Vec3::new(0.0, y, 0.12),
                half: [0.1, 0.07],
                height: 0.092,
                housing: p.brass,
                up,
            };
            let part = if down == 0 {
                1.0
            } else if up {
                0.6
            } else {
                0.4
            };
            fixture.build(b, source, lights, flux * (part / lamps as f32), "wall light");
        }
    }
    b.place_in_world();
}
