//! `plaza`: a town square at night with a market. Thousands of small lights over three decades of power, none of them
//! behind a wall for good.

use super::builder::{Builder, Paint, Pose};
use super::dice::{Dice, exp10, sin_cos};
use super::fixtures::NEUTRAL;
use super::furniture::{self as piece, Palette};
use super::lamps::{Lamp, Source, share};
use super::plaza_town::{self as town, FRONT};
use crate::SceneParts;
use glam::Vec3;
use std::f32::consts::PI;

const STALLS: usize = 18;
/// Lights on a lantern: four sides, two triangles each.
const LANTERN: usize = 8;
/// Lights on a bulb.
const BULB: usize = 8;
/// Least distance between bulbs on a string, metres.
const BULB_DISTANCE: f32 = 0.24;

/// Colours of light, luminance about 1: lamp light mostly, some party colours.
const GLOW: [Vec3; 6] = [
    Vec3::new(1.55, 0.90, 0.35),
    Vec3::new(1.40, 0.94, 0.48),
    Vec3::new(1.25, 0.97, 0.66),
    Vec3::new(2.1, 0.70, 0.28),
    Vec3::new(0.5, 1.08, 1.6),
    Vec3::new(1.8, 0.62, 1.3),
];

/// How many lights of each kind there are; they add up to what was asked for.
struct Shares {
    lanterns: usize,
    windows: usize,
    bulbs: usize,
    screen: usize,
    stalls: usize,
}

impl Shares {
    /// Lanterns, windows and bulbs come whole; stalls take what is left up to what looks right, a screen of coloured
    /// dots on a facade the rest.
    fn new(lights: usize, windows: usize, bulbs: usize) -> Self {
        let lanterns = (lights / 250).clamp(1, town::LANTERNS.len());
        let windows = (lights * 15 / 200).min(windows);
        let bulbs = (lights * 2 / 5 / BULB).min(bulbs);
        let left = lights - LANTERN * lanterns - 2 * windows - BULB * bulbs;
        let screen = left.saturating_sub((lights / 4).clamp(200, STALLS * 160)) / 2 * 2;
        Self {
            lanterns,
            windows,
            bulbs,
            screen,
            stalls: left - screen,
        }
    }
}

/// Makes it.
pub(super) fn plaza(lights: usize, seed: u32) -> SceneParts {
    let mut b = Builder::new("plaza");
    let p = Palette::new(&mut b);
    let mut dice = Dice::new(&[seed, 21]);
    let strings = strings(&mut dice);
    let hangers: usize = strings.iter().map(String::capacity).sum();
    let windows = town::facades(&mut b, &mut Dice::new(&[seed, 22]), &p);
    let shares = Shares::new(lights, windows.len(), hangers);

    town::ground(&mut b, &mut Dice::new(&[seed, 23]));
    town::fountain(&mut b, &p);
    town::light_windows(&mut b, &mut Dice::new(&[seed, 24]), &windows, shares.windows);
    for (i, &at) in town::LANTERNS.iter().enumerate() {
        lantern(&mut b, &p, i, at, i < shares.lanterns);
    }
    let mut hung = 0;
    for (i, string) in strings.iter().enumerate() {
        let before = hangers_before(&strings, i);
        let end = shares.bulbs * (before + string.capacity()) / hangers;
        string.hang(&mut b, &mut dice, &p, i, end - hung);
        hung = end;
    }
    for i in 0..STALLS {
        stall(
            &mut b,
            &mut Dice::new(&[seed, 25, i as u32]),
            &p,
            i,
            share(shares.stalls, STALLS, i),
        );
    }
    if shares.screen > 0 {
        screen(&mut b, &p, shares.screen / 2);
    }
    people(&mut b, &mut Dice::new(&[seed, 26]), &p);
    b.place_in_world();
    b.camera("square", Vec3::new(-11.2, 4.1, 12.6), Vec3::new(1.2, 1.9, -2.0), 0.92);
    b.camera("fountain", Vec3::new(7.5, 1.65, 6.5), Vec3::new(-2.0, 2.1, -2.5), 0.95);
    b.finish()
}

/// A lamp post with a lantern of four glowing panes.
fn lantern(b: &mut Builder, p: &Palette, i: usize, [x, z]: [f32; 2], lit: bool) {
    b.begin(format!("lantern {i}"), "lantern");
    b.place(Pose::new(Vec3::new(x, 0.0, z), 0.125));
    b.frustum(Vec3::new(0.0, -0.02, 0.0), [0.22, 0.12], 0.35, 16, p.dark);
    b.cylinder(Vec3::new(0.0, 0.3, 0.0), 0.05, 3.2, 12, p.dark);
    b.cuboid([-0.2, 3.45, -0.2], [0.2, 3.5, 0.2], p.dark);
    b.cuboid([-0.15, 3.49, -0.15], [0.15, 3.93, 0.15], p.linen);
    b.frustum(Vec3::new(0.0, 3.9, 0.0), [0.3, 0.04], 0.22, 16, p.dark);
    if !lit {
        return;
    }
    let (half, low, high, front) = (0.13, 3.52, 3.88, 0.152);
    let area = 4.0 * 2.0 * half * (high - low);
    let paint = b.emitter("lantern light", GLOW[1] * (400.0 / (PI * area)));
    for side in 0..4 {
        let (sin, cos) = sin_cos(0.25 * side as f32);
        let at = |u: f32, y: f32| Vec3::new(cos * u + sin * front, y, -sin * u + cos * front);
        b.polygon(&[at(-half, low), at(half, low), at(half, high), at(-half, high)], paint);
    }
}

/// A wire that sags between two points.
struct String {
    from: Vec3,
    to: Vec3,
    sag: f32,
}

fn hangers_before(strings: &[String], i: usize) -> usize {
    strings[..i].iter().map(String::capacity).sum()
}

/// Strings from facade to facade, crossing over the square.
fn strings(dice: &mut Dice) -> Vec<String> {
    let mut strings = Vec::new();
    let (wide, deep) = (FRONT[0] + 0.02, FRONT[1] + 0.02);
    for i in 0..11 {
        let x = -wide + 2.0 * wide * (i as f32 + 0.5) / 11.0;
        let across = x + dice.range(-3.5, 3.5);
        strings.push(String {
            from: Vec3::new(x, dice.range(5.2, 6.4), -deep),
            to: Vec3::new(across.clamp(-wide, wide), dice.range(5.2, 6.4), deep),
            sag: dice.range(1.3, 2.0),
        });
    }
    for i in 0..7 {
        let z = -deep + 2.0 * deep * (i as f32 + 0.5) / 7.0;
        let across = z + dice.range(-3.0, 3.0);
        strings.push(String {
            from: Vec3::new(-wide, dice.range(5.0, 6.2), z),
            to: Vec3::new(wide, dice.range(5.0, 6.2), across.clamp(-deep, deep)),
            sag: dice.range(1.5, 2.3),
        });
    }
    strings
}

impl String {
    /// Most bulbs it can carry.
    fn capacity(&self) -> usize {
        (self.from.distance(self.to) / BULB_DISTANCE) as usize
    }

    fn at(&self, t: f32) -> Vec3 {
        self.from.lerp(self.to, t) - Vec3::Y * (self.sag * 4.0 * t * (1.0 - t))
    }

    /// Hangs `bulbs` bulbs at equal distances.
    fn hang(&self, b: &mut Builder, dice: &mut Dice, p: &Palette, i: usize, bulbs: usize) {
        b.begin(format!("string {i}"), "string of lights");
        let color = if dice.chance(0.65) {
            dice.below(3)
        } else {
            dice.below(GLOW.len())
        };
        let mixed = dice.chance(0.3);
        let pieces = bulbs.max(16) + 1;
        for k in 0..pieces {
            let (from, to) = (
                self.at(k as f32 / pieces as f32),
                self.at((k + 1) as f32 / pieces as f32),
            );
            b.bar(from, to, 0.012, p.dark);
        }
        // Fewer bulbs are bigger ones; powers of one string vary by what bulbs of one box vary.
        let crowd = (60.0 / bulbs.max(1) as f32).clamp(0.1, 2.0);
        for k in 0..bulbs {
            let at = self.at((k + 1) as f32 / (bulbs + 1) as f32);
            let tint = GLOW[if mixed { (color + k) % GLOW.len() } else { color }];
            let step = dice.below(7);
            let power = exp10(-1.3 + 0.38 * step as f32) * crowd * 2.2;
            let radius = 0.026 + 0.004 * step as f32;
            // Surface of a regular octahedron: 4 sqrt(3) r^2.
            let paint = b.emitter(
                "bulb light",
                tint * (power / (PI * 4.0 * 3f32.sqrt() * radius * radius)),
            );
            b.cylinder(at - Vec3::Y * 0.05, 0.012, 0.05, 6, p.dark);
            b.octahedron(at - Vec3::Y * (0.048 + radius), Vec3::splat(radius), paint);
        }
    }
}

/// Where stall `i` stands: two arcs around the fountain.
fn stall_pose(i: usize) -> Pose {
    let inner = i < 8;
    let (k, n, rx, rz) = if inner {
        (i, 8.0, 8.2, 6.6)
    } else {
        (i - 8, 10.0, 13.2, 10.0)
    };
    let turns = (k as f32 + if inner { 0.5 } else { 0.25 }) / n;
    let (sin, cos) = sin_cos(turns);
    // Counters look at the fountain.
    Pose::new(Vec3::new(rx * cos, 0.0, -rz * sin), turns - 0.25 + 0.5)
}

/// A market stall: counter, goods, striped canopy, a lamp under it.
fn stall(b: &mut Builder, dice: &mut Dice, p: &Palette, i: usize, lights: usize) {
    b.begin(format!("stall {i}"), "stall");
    let pose = stall_pose(i);
    b.place(pose);
    let (w, d) = (1.25, 0.75);
    for x in [-w, w] {
        for (z, height) in [(-d, 2.75), (d, 2.4)] {
            b.cuboid([x - 0.03, -0.02, z - 0.03], [x + 0.03, height, z + 0.03], p.walnut);
        }
    }
    b.cuboid([-w + 0.02, 0.05, 0.1], [w - 0.02, 0.86, 0.68], p.oak);
    b.cuboid([-w - 0.05, 0.85, 0.05], [w + 0.05, 0.9, 0.78], p.walnut);
    let cloth = dice.pick(&p.fabric);
    b.cuboid([-w + 0.05, 0.25, 0.67], [w - 0.05, 0.84, 0.69], cloth);
    let stripes = 8;
    for k in 0..stripes {
        let paint = if k % 2 == 0 { p.linen } else { cloth };
        let x = |edge: usize| -1.5 + 3.0 * (k + edge) as f32 / stripes as f32;
        let lift = 0.002 * (k % 2) as f32;
        let corners = std::array::from_fn(|c| {
            let (y, z) = if c & 4 == 4 { (2.36, 1.15) } else { (2.80, -0.95) };
            Vec3::new(x(c & 1), y + lift + if c & 2 == 2 { 0.03 } else { 0.0 }, z)
        });
        b.hexahedron(corners, [paint; 6]);
        b.cuboid([x(0) + 0.004, 2.14, 1.13], [x(1) - 0.004, 2.375, 1.142], paint);
    }
    goods(b, dice, p);
    b.begin(format!("stall {i} / lamp"), "stall lamp");
    b.bar(Vec3::new(-w, 2.3, 0.2), Vec3::new(w, 2.3, 0.2), 0.03, p.walnut);
    let fixture = Lamp {
        bottom_center: Vec3::new(0.0, 2.18, 0.2),
        half: [0.42, 0.09],
        height: 0.11,
        housing: p.dark,
        up: false,
    };
    let color = dice.pick(&[GLOW[0], GLOW[1], GLOW[2], GLOW[2], NEUTRAL]);
    fixture.build(
        b,
        Source::Panels,
        lights,
        color * exp10(dice.range(1.6, 2.2)),
        "stall light",
    );
}

/// What is sold: fruit in crates, pots or parcels.
fn goods(b: &mut Builder, dice: &mut Dice, p: &Palette) {
    let kind = dice.below(3);
    for k in 0..4 {
        let x = -0.9 + 0.6 * k as f32;
        let paint = dice.pick(&[
            p.fabric[1],
            p.fabric[3],
            p.clay,
            p.leaf[1],
            p.spine[6],
            p.spine[0],
            p.spine[3],
        ]);
        match kind {
            0 => {
                b.cuboid([x - 0.24, 0.895, 0.14], [x + 0.24, 0.99, 0.68], p.oak);
                for m in 0..12 {
                    let (u, v) = ((m % 4) as f32, (m / 4) as f32);
                    let r = dice.range(0.05, 0.062);
                    b.ball(
                        Vec3::new(x - 0.17 + 0.113 * u, 0.985 + 0.6 * r, 0.24 + 0.165 * v),
                        r,
                        10,
                        paint,
                    );
                }
            }
            1 => {
                for z in [0.24, 0.52] {
                    piece::vase(
                        b,
                        Vec3::new(x + dice.range(-0.05, 0.05), 0.9, z),
                        dice.range(0.2, 0.36),
                        paint,
                    );
                }
            }
            _ => {
                let (w, h) = (dice.range(0.14, 0.24), dice.range(0.12, 0.3));
                b.cuboid([x - w, 0.895, 0.22], [x + w, 0.9 + h, 0.55], paint);
                b.cuboid([x - 0.02, 0.896, 0.215], [x + 0.02, 0.905 + h, 0.555], p.linen);
            }
        }
    }
}

/// A screen of `dots` coloured rectangles, 16 : 9, on the facade that the camera looks at.
fn screen(b: &mut Builder, p: &Palette, dots: usize) {
    let (half, center) = ([3.2, 1.8], Vec3::new(6.0, 6.4, -FRONT[1] + 0.06));
    b.begin("screen", "screen");
    b.place_in_world();
    let [hx, hy] = [half[0] + 0.15, half[1] + 0.15];
    b.cuboid(
        [center.x - hx, center.y - hy, -FRONT[1] - 0.05],
        [center.x + hx, center.y + hy, center.z],
        p.dark,
    );
    let rows = ((dots as f32 * half[1] / half[0]).sqrt().round() as usize).clamp(1, dots);
    // 32 steps of each colour; together as bright as two lanterns.
    let dot_area = 0.64 * 4.0 * half[0] * half[1];
    let radiance = 600.0 / (PI * dot_area);
    for row in 0..rows {
        let columns = share(dots, rows, row);
        for column in 0..columns {
            let (u, v) = ((column as f32 + 0.5) / columns as f32, (row as f32 + 0.5) / rows as f32);
            let paint = b.emitter("screen light", sunset(u, v) * radiance);
            let (hx, hy) = (half[0] / columns as f32, half[1] / rows as f32);
            let middle = center + Vec3::new((2.0 * u - 1.0) * half[0], (1.0 - 2.0 * v) * half[1], 0.003);
            let at = |x: f32, y: f32| middle + Vec3::new(0.8 * x * hx, 0.8 * y * hy, 0.0);
            b.polygon(&[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], paint);
        }
    }
}

/// The picture on the screen: a sun over the sea, in few colours. (u, v) in \[0, 1\]^2 from the top left.
fn sunset(u: f32, v: f32) -> Vec3 {
    let step = |x: f32| (x * 12.0).floor() / 12.0;
    let (dx, dy) = ((u - 0.5) * 16.0 / 9.0, v - 0.52);
    if v < 0.62 && dx * dx + dy * dy < 0.075 {
        return Vec3::new(3.2, 1.6 - step(v), 0.35);
    }
    let (sin, _) = sin_cos(5.0 * v + 0.8 * u);
    if v < 0.62 {
        Vec3::new(0.35 + 1.3 * step(v), 0.12 + 0.4 * step(v), 0.7 - 0.6 * step(v))
    } else if dx.abs() < 0.12 + 0.2 * step(sin.abs()) {
        Vec3::new(2.2, 0.9, 0.3)
    } else {
        Vec3::new(0.06, 0.18, 0.42)
    }
}

/// Wooden figures that stroll between the stalls.
fn people(b: &mut Builder, dice: &mut Dice, p: &Palette) {
    for i in 0..26 {
        let (sin, cos) = sin_cos(dice.unit());
        let ring = if i % 3 == 0 {
            dice.range(3.6, 5.2)
        } else {
            dice.range(9.8, 10.8)
        };
        let at = Vec3::new(1.1 * ring * cos, 0.0, -0.8 * ring * sin);
        let h = dice.range(0.92, 1.06);
        b.begin(format!("person {i}"), "person");
        b.place(Pose::new(at, dice.unit()));
        let coat = dice.pick(&[p.fabric[4], p.fabric[0], p.fabric[3], p.fabric[2], p.walnut, p.spine[0]]);
        for x in [-0.09, 0.09] {
            b.frustum(Vec3::new(x, -0.02, 0.0), [0.06, 0.09], 0.85 * h, 10, p.dark);
        }
        b.frustum(Vec3::new(0.0, 0.62 * h, 0.0), [0.23, 0.17], 0.55 * h, 14, coat);
        b.ellipsoid(Vec3::new(0.0, 1.18 * h, 0.0), Vec3::new(0.2, 0.28, 0.15), 14, 8, coat);
        for x in [-0.22, 0.22] {
            b.bar(
                Vec3::new(x, 1.34 * h, 0.0),
                Vec3::new(1.35 * x, 0.8 * h, 0.05),
                0.085,
                coat,
            );
        }
        b.cylinder(Vec3::new(0.0, 1.4 * h, 0.0), 0.05, 0.1, 10, p.oak);
        b.ellipsoid(
            Vec3::new(0.0, 1.6 * h, 0.0),
            Vec3::new(0.095, 0.125, 0.105),
            14,
            10,
            skin(dice, p),
        );
    }
    b.place_in_world();
}

fn skin(dice: &mut Dice, p: &Palette) -> Paint {
    dice.pick(&[p.oak, p.walnut, p.clay, p.linen])
}
