//! The shell of a building: storeys of rooms on a grid, walls with doorways, slabs.
//!
//! Every part is a closed box that reaches into its neighbours instead of touching them: no gap lets light through, and
//! no two visible faces lie in one plane.

use super::builder::{Builder, Paint, Pose};
use glam::{Vec2, Vec3};

/// Clear height of a room, metres.
pub(super) const ROOM_HEIGHT: f32 = 2.8;
/// From floor to floor, metres.
pub(super) const STOREY_HEIGHT: f32 = 3.1;
/// Thickness of all walls, metres.
pub(super) const WALL: f32 = 0.2;
const HALF_WALL: f32 = 0.5 * WALL;

/// A doorway, as lies along its wall: `center` is a world coordinate (x or z).
#[derive(Clone, Copy, Debug)]
pub(super) struct Opening {
    pub(super) center: f32,
    pub(super) width: f32,
    pub(super) height: f32,
}

/// Which wall of a room: the outward direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    NegZ,
    PosZ,
    NegX,
    PosX,
}

/// All sides, in the order of [`Room::openings`].
pub(super) const SIDES: [Side; 4] = [Side::NegZ, Side::PosZ, Side::NegX, Side::PosX];

/// One room: the inner box, the doorways by side, and colours.
#[derive(Clone, Debug)]
pub(super) struct Room {
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    pub(super) openings: [Option<Opening>; 4],
    pub(super) wall: Paint,
    pub(super) floor: Paint,
}

impl Room {
    /// Extent along x and z.
    pub(super) fn size(&self) -> Vec2 {
        Vec2::new(self.high.x - self.low.x, self.high.z - self.low.z)
    }

    /// The middle of the floor.
    pub(super) fn center(&self) -> Vec3 {
        Vec3::new(
            0.5 * (self.low.x + self.high.x),
            self.low.y,
            0.5 * (self.low.z + self.high.z),
        )
    }

    /// Length of a wall.
    pub(super) fn length(&self, side: Side) -> f32 {
        match side {
            Side::NegZ | Side::PosZ => self.size().x,
            Side::NegX | Side::PosX => self.size().y,
        }
    }

    /// At the foot of the wall `side`, `along` metres from its low end, looking into the room.
    pub(super) fn at_wall(&self, side: Side, along: f32) -> Pose {
        let (low, high) = (self.low, self.high);
        match side {
            Side::NegZ => Pose::new(Vec3::new(low.x + along, low.y, low.z), 0.0),
            Side::PosZ => Pose::new(Vec3::new(low.x + along, low.y, high.z), 0.5),
            Side::NegX => Pose::new(Vec3::new(low.x, low.y, low.z + along), 0.25),
            Side::PosX => Pose::new(Vec3::new(high.x, low.y, low.z + along), 0.75),
        }
    }

    /// Where along the wall the doorway's middle is.
    pub(super) fn opening(&self, side: Side) -> Option<Opening> {
        let start = match side {
            Side::NegZ | Side::PosZ => self.low.x,
            Side::NegX | Side::PosX => self.low.z,
        };
        self.openings[side as usize].map(|o| Opening {
            center: o.center - start,
            ..o
        })
    }
}

/// Rooms on a grid, storey by storey.
pub(super) struct Plan {
    /// Wall centre lines, ascending: one more than there are columns.
    pub(super) xs: Vec<f32>,
    /// Likewise for rows.
    pub(super) zs: Vec<f32>,
    /// `storeys * rows * columns` rooms, x fastest.
    pub(super) rooms: Vec<Room>,
    pub(super) storeys: usize,
}

/// Colours of what the rooms share.
pub(super) struct Shell {
    pub(super) ceiling: Paint,
    pub(super) outside: Paint,
    pub(super) frame: Paint,
    pub(super) skirting: Paint,
}

impl Plan {
    pub(super) fn columns(&self) -> usize {
        self.xs.len() - 1
    }

    pub(super) fn rows(&self) -> usize {
        self.zs.len() - 1
    }

    pub(super) fn index(&self, storey: usize, row: usize, column: usize) -> usize {
        (storey * self.rows() + row) * self.columns() + column
    }

    /// The inner box of a room.
    pub(super) fn bounds(xs: &[f32], zs: &[f32], storey: usize, row: usize, column: usize) -> (Vec3, Vec3) {
        let y = storey as f32 * STOREY_HEIGHT;
        (
            Vec3::new(xs[column] + HALF_WALL, y, zs[row] + HALF_WALL),
            Vec3::new(xs[column + 1] - HALF_WALL, y + ROOM_HEIGHT, zs[row + 1] - HALF_WALL),
        )
    }

    /// Builds slabs, floors and walls.
    pub(super) fn build(&self, b: &mut Builder, shell: &Shell) {
        let (x0, x1) = (self.xs[0] - 0.35, self.xs[self.columns()] + 0.35);
        let (z0, z1) = (self.zs[0] - 0.35, self.zs[self.rows()] + 0.35);
        for level in 0..=self.storeys {
            b.begin(format!("slab {level}"), "slab");
            let y = level as f32 * STOREY_HEIGHT;
            b.cuboid(
                [x0, y - (STOREY_HEIGHT - ROOM_HEIGHT), z0],
                [x1, y - 0.02, z1],
                shell.ceiling,
            );
        }
        for storey in 0..self.storeys {
            for row in 0..self.rows() {
                for column in 0..self.columns() {
                    let index = self.index(storey, row, column);
                    let room = &self.rooms[index];
                    b.begin(format!("room {index} / floor"), "floor");
                    let (low, high) = (room.low - Vec3::splat(0.03), room.high + Vec3::splat(0.03));
                    b.cuboid(
                        [low.x, room.low.y - 0.1, low.z],
                        [high.x, room.low.y, high.z],
                        room.floor,
                    );
                }
            }
            b.begin(format!("storey {storey} / walls"), "walls");
            self.walls(b, shell, storey);
            b.place_in_world();
        }
    }

    fn walls(&self, b: &mut Builder, shell: &Shell, storey: usize) {
        let y = storey as f32 * STOREY_HEIGHT;
        let (columns, rows) = (self.columns(), self.rows());
        let room = |row: usize, column: usize| &self.rooms[self.index(storey, row, column)];
        for line in 0..=rows {
            for column in 0..columns {
                // Overlaps its predecessor inside the wall that crosses here; sticks out of the building's corners.
                let start = self.xs[column] - if column == 0 { HALF_WALL + 0.02 } else { 0.03 };
                let end = self.xs[column + 1] + if column + 1 == columns { HALF_WALL + 0.02 } else { 0.0 };
                let before = line.checked_sub(1).map(|row| room(row, column));
                let after = (line < rows).then(|| room(line, column));
                let sides = [before, after].map(|r| r.map_or(shell.outside, |r| r.wall));
                let opening = after.and_then(|r| r.openings[Side::NegZ as usize]).map(|o| Opening {
                    center: o.center - start,
                    ..o
                });
                b.place(Pose::new(Vec3::new(start, y, self.zs[line]), 0.0));
                wall(b, shell, end - start, opening, sides);
            }
        }
        for line in 0..=columns {
            for row in 0..rows {
                let start = self.zs[row] + HALF_WALL - 0.05;
                let end = self.zs[row + 1] - HALF_WALL + 0.05;
                let before = line.checked_sub(1).map(|column| room(row, column));
                let after = (line < columns).then(|| room(row, line));
                let sides = [before, after].map(|r| r.map_or(shell.outside, |r| r.wall));
                let opening = after.and_then(|r| r.openings[Side::NegX as usize]).map(|o| Opening {
                    center: end - o.center,
                    ..o
                });
                // Local x runs to world -z, local z to world +x.
                b.place(Pose::new(Vec3::new(self.xs[line], y, end), 0.25));
                wall(b, shell, end - start, opening, sides);
            }
        }
    }
}

/// A wall along local x from 0 to `length`, its middle at z = 0, painted `sides` towards -z and +z.
fn wall(b: &mut Builder, shell: &Shell, length: f32, opening: Option<Opening>, sides: [Paint; 2]) {
    let (foot, top) = (-0.12, ROOM_HEIGHT + 0.05);
    let paints = |inner: Paint| [inner, inner, inner, inner, sides[0], sides[1]];
    let piece = |b: &mut Builder, x0: f32, x1: f32| {
        b.cuboid_painted([x0, foot, -HALF_WALL], [x1, top, HALF_WALL], paints(shell.frame));
        let skirting = HALF_WALL + 0.012;
        b.cuboid(
            [x0 + 0.001, -0.02, -skirting],
            [x1 - 0.001, 0.09, skirting],
            shell.skirting,
        );
    };
    let Some(opening) = opening else {
        piece(b, 0.0, length);
        return;
    };
    let (x0, x1) = (
        opening.center - 0.5 * opening.width,
        opening.center + 0.5 * opening.width,
    );
    piece(b, 0.0, x0);
    piece(b, x1, length);
    let thin = HALF_WALL - 0.004;
    b.cuboid_painted(
        [x0 - 0.02, opening.height, -thin],
        [x1 + 0.02, top - 0.001, thin],
        paints(shell.frame),
    );
    doorway(b, shell, [x0, x1], opening.height);
}

/// The frame of an opening in a wall along local x, and the threshold between its two floors.
fn doorway(b: &mut Builder, shell: &Shell, [x0, x1]: [f32; 2], height: f32) {
    let out = HALF_WALL + 0.02;
    b.cuboid([x0 - 0.06, -0.03, -out], [x0 + 0.02, height, out], shell.frame);
    b.cuboid([x1 - 0.02, -0.03, -out], [x1 + 0.06, height, out], shell.frame);
    b.cuboid(
        [x0 - 0.07, height - 0.02, -out - 0.003],
        [x1 + 0.07, height + 0.06, out + 0.003],
        shell.frame,
    );
    b.cuboid([x0 + 0.001, -0.05, -0.09], [x1 - 0.001, 0.012, 0.09], shell.frame);
}
