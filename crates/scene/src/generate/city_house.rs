//! The houses of `city`: stone by stone, no two alike.

use super::builder::{Builder, Paint, Pose};
use super::city_street::ROW;
use super::dice::Dice;
use glam::Vec3;

/// Height of a storey, metres.
const STOREY: f32 = 3.2;
/// Height of the plinth, metres.
const PLINTH: f32 = 0.7;
/// Width of a bay: a window and half a pier on either side, metres.
const BAY: f32 = 2.4;
/// Width of a corner pier, metres.
const CORNER: f32 = 0.6;
/// How far the stones reach into the wall, metres.
const DEEP: f32 = 0.36;
/// Courses of stones in a storey.
const COURSES: usize = 5;

/// Measures of a house: rows of three windows along its sides, and storeys.
#[derive(Clone, Copy, Debug)]
pub(super) struct House {
    rows: [usize; 2],
    storeys: usize,
}

/// Materials that houses share.
pub(super) struct Stones {
    walls: Vec<[Paint; 2]>,
    trims: [Paint; 3],
    roofs: [Paint; 4],
    core: Paint,
}

impl Stones {
    pub(super) fn new(b: &mut Builder) -> Self {
        let tones: [[f32; 3]; 7] = [
            [0.52, 0.44, 0.34],
            [0.45, 0.24, 0.17],
            [0.58, 0.53, 0.45],
            [0.36, 0.34, 0.33],
            [0.55, 0.36, 0.25],
            [0.42, 0.43, 0.40],
            [0.60, 0.48, 0.31],
        ];
        let darker = |tone: [f32; 3]| tone.map(|c| 0.86 * c);
        Self {
            walls: tones
                .iter()
                .map(|&tone| [b.lambert("stone", tone), b.lambert("dark stone", darker(tone))])
                .collect(),
            trims: [[0.66, 0.63, 0.56], [0.5, 0.48, 0.44], [0.72, 0.66, 0.52]].map(|c| b.lambert("trim", c)),
            roofs: [
                [0.13, 0.14, 0.16],
                [0.32, 0.13, 0.09],
                [0.2, 0.17, 0.15],
                [0.11, 0.17, 0.16],
            ]
            .map(|c| b.lambert("roof", c)),
            core: b.lambert("wall", [0.25, 0.23, 0.21]),
        }
    }
}

impl House {
    pub(super) fn draw(dice: &mut Dice) -> Self {
        let rows = [0, 1].map(|_| 1 + dice.below(2));
        Self {
            rows,
            storeys: 3 + dice.below(5) + if dice.chance(0.1) { 4 } else { 0 },
        }
    }

    /// Rows of windows on all sides.
    pub(super) fn rows(&self) -> usize {
        2 * (self.rows[0] + self.rows[1]) * self.storeys
    }

    fn half(&self) -> [f32; 2] {
        self.rows.map(|rows| 0.5 * ROW * rows as f32 + CORNER)
    }

    /// The four sides: a pose at the foot of the middle of each, looking outwards, and the rows along it.
    fn sides(&self) -> [(Pose, usize); 4] {
        let half = self.half();
        [0, 1, 2, 3].map(|side| {
            let turned = Pose::new(Vec3::ZERO, 0.25 * side as f32);
            let foot = turned.point(Vec3::Z * half[1 - side % 2]);
            (Pose { origin: foot, ..turned }, self.rows[side % 2])
        })
    }

    /// Where the rows of windows stand.
    pub(super) fn row_poses(&self) -> impl Iterator<Item = Pose> {
        let storeys = self.storeys;
        self.sides().into_iter().flat_map(move |(side, rows)| {
            (0..storeys * rows).map(move |i| {
                let x = ROW * (i % rows) as f32 - 0.5 * ROW * rows as f32;
                let place = Vec3::new(x, eaves(i / rows), 0.0);
                side.of(Pose {
                    origin: place,
                    ..Pose::IDENTITY
                })
            })
        })
    }

    /// Builds it around the origin.
    pub(super) fn build(&self, b: &mut Builder, dice: &mut Dice, stones: &Stones) {
        let (wall, trim, roof) = (
            dice.pick(&stones.walls),
            dice.pick(&stones.trims),
            dice.pick(&stones.roofs),
        );
        let [hx, hz] = self.half();
        let top = eaves(self.storeys);
        let block = |b: &mut Builder, out: f32, y: [f32; 2], paint: Paint| {
            b.cuboid([-hx - out, y[0], -hz - out], [hx + out, y[1], hz + out], paint);
        };
        block(b, 0.01 - DEEP, [-0.1, top + 0.05], stones.core);
        block(b, 0.08, [-0.2, PLINTH - 0.02], wall[1]);
        for (pose, rows) in self.sides() {
            b.place(pose);
            for storey in 0..self.storeys {
                for bay in 0..3 * rows {
                    let x = BAY * bay as f32 - 0.5 * ROW * rows as f32;
                    build_bay(b, dice, [x, eaves(storey)], wall, trim);
                }
            }
            dentils(b, 0.5 * ROW * rows as f32 + CORNER, top, trim);
        }
        b.place_in_world();
        for storey in 0..self.storeys {
            self.corners(b, dice, eaves(storey), wall);
            block(b, 0.09, [eaves(storey) - 0.05, eaves(storey) + 0.05], trim);
        }
        block(b, 0.32, [top, top + 0.24], trim);
        self.roof(b, dice, top + 0.23, roof, wall[1]);
    }

    /// The stones at the four corners of a storey.
    fn corners(&self, b: &mut Builder, dice: &mut Dice, y: f32, wall: [Paint; 2]) {
        let [hx, hz] = self.half();
        for (sx, sz) in [(-1.0f32, -1.0f32), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            for course in 0..COURSES {
                let out = 0.02 + 0.05 * (course % 2) as f32 + dice.range(0.0, 0.015);
                let reach = |half: f32, sign: f32| {
                    let (inner, outer) = (sign * (half - CORNER + 0.01), sign * (half + out));
                    [inner.min(outer), inner.max(outer)]
                };
                let ([x0, x1], [z0, z1]) = (reach(hx, sx), reach(hz, sz));
                let [low, high] = course_heights(y, course);
                b.cuboid([x0, low, z0], [x1, high, z1], wall[course % 2]);
            }
        }
    }

    /// A hipped roof with battens, or a flat one with plant on it; chimneys.
    fn roof(&self, b: &mut Builder, dice: &mut Dice, y: f32, paint: Paint, brick: Paint) {
        let [hx, hz] = self.half();
        let rise = if dice.chance(0.7) { 0.55 * hx.min(hz) } else { 0.35 };
        let inset = 0.8 * hx.min(hz);
        let ring = |t: f32| {
            let (x, z) = (hx + 0.25 - t * inset, hz + 0.25 - t * inset);
            [(-x, -z), (x, -z), (x, z), (-x, z)].map(|(x, z)| Vec3::new(x, y + t * rise, z))
        };
        let (low, high) = (ring(0.0), ring(1.0));
        b.hexahedron(
            [low[0], low[1], high[0], high[1], low[3], low[2], high[3], high[2]],
            [paint; 6],
        );
        let battens = 14;
        for k in 0..battens {
            let at = ring((k as f32 + dice.range(0.3, 0.7)) / battens as f32);
            for side in 0..4 {
                b.bar(at[side], at[(side + 1) % 4], 0.07, paint);
            }
        }
        for _ in 0..1 + dice.below(3) {
            let (x, z) = (dice.range(-0.6, 0.6) * hx, dice.range(-0.6, 0.6) * hz);
            let (half, height) = (dice.range(0.3, 0.5), y + rise + dice.range(0.4, 1.0));
            b.cuboid([x - half, y - 0.1, z - 0.3], [x + half, height, z + 0.3], brick);
            for pot in [-0.5, 0.5] {
                b.cylinder(Vec3::new(x + pot * half, height - 0.02, z), 0.11, 0.4, 10, brick);
            }
        }
    }
}

/// Height above the lot at which a house of so many storeys ends.
fn eaves(storeys: usize) -> f32 {
    PLINTH + STOREY * storeys as f32
}

/// From where to where a course of stones reaches in the storey at `y`, joints left open.
fn course_heights(y: f32, course: usize) -> [f32; 2] {
    let height = STOREY / COURSES as f32;
    [
        y + height * course as f32 + 0.006,
        y + height * (course + 1) as f32 - 0.006,
    ]
}

/// The stones around one window, the wall below and above it, sill and lintel; `at` is the lower left corner.
fn build_bay(b: &mut Builder, dice: &mut Dice, [x, y]: [f32; 2], wall: [Paint; 2], trim: Paint) {
    let (left, right) = (x + 0.55, x + BAY - 0.55);
    for course in 0..COURSES {
        let [low, high] = course_heights(y, course);
        for (from, to) in [(x + 0.006, left - 0.006), (right + 0.006, x + BAY - 0.006)] {
            b.cuboid(
                [from, low, -DEEP],
                [to, high, dice.range(-0.02, 0.03)],
                dice.pick(&wall),
            );
        }
    }
    let (sill, head) = (y + 0.8, y + 2.57);
    b.cuboid([left, y, -DEEP], [right, sill - 0.02, -0.05], wall[0]);
    b.cuboid([left, head + 0.02, -DEEP], [right, y + STOREY - 0.01, -0.05], wall[0]);
    b.cuboid(
        [left - 0.06, sill - 0.04, -0.3],
        [right + 0.06, sill + 0.02, 0.12],
        trim,
    );
    b.cuboid([left - 0.1, head, -0.3], [right + 0.1, head + 0.24, 0.05], trim);
    let middle = 0.5 * (left + right);
    let narrow = dice.range(0.07, 0.1);
    let key = std::array::from_fn(|i| {
        let half = if i & 2 == 2 { 1.5 * narrow } else { narrow };
        Vec3::new(
            middle + if i & 1 == 1 { half } else { -half },
            if i & 2 == 2 { head + 0.3 } else { head - 0.05 },
            if i & 4 == 4 { 0.1 } else { -0.2 },
        )
    });
    b.hexahedron(key, [trim; 6]);
}

/// Small blocks below the eaves.
fn dentils(b: &mut Builder, half: f32, top: f32, trim: Paint) {
    let count = (2.0 * half / 0.4) as usize;
    for k in 0..count {
        let x = -half + 2.0 * half * (k as f32 + 0.5) / count as f32;
        b.cuboid([x - 0.09, top - 0.14, -0.1], [x + 0.09, top + 0.02, 0.2], trim);
    }
}
