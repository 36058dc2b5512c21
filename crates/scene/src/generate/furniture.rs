//! Furniture of boxes, cylinders and balls. Everything is closed and stands a few millimetres deep in what carries it,
//! so that no two faces coincide.
//!
//! Local space: y up from the floor. Pieces that lean on a wall have it at z = 0 and look along +z; the others are
//! centred on the origin.

use super::builder::{Builder, Paint, Pose};
use super::dice::{Dice, sin_cos};
use glam::Vec3;

/// How deep things sink into what they stand on, metres.
pub(super) const SINK: f32 = 0.005;

/// Materials that all rooms share.
pub(super) struct Palette {
    pub(super) oak: Paint,
    pub(super) walnut: Paint,
    pub(super) white: Paint,
    pub(super) dark: Paint,
    pub(super) brass: Paint,
    pub(super) linen: Paint,
    pub(super) clay: Paint,
    pub(super) leaf: [Paint; 3],
    pub(super) fabric: [Paint; 6],
    pub(super) spine: [Paint; 8],
}

impl Palette {
    pub(super) fn new(b: &mut Builder) -> Self {
        Self {
            oak: b.lambert("oak", [0.52, 0.34, 0.19]),
            walnut: b.lambert("walnut", [0.23, 0.13, 0.075]),
            white: b.lambert("white lacquer", [0.78, 0.77, 0.74]),
            dark: b.lambert("dark metal", [0.06, 0.06, 0.065]),
            brass: b.lambert("brass", [0.62, 0.43, 0.17]),
            linen: b.lambert("linen", [0.74, 0.69, 0.60]),
            clay: b.lambert("clay", [0.60, 0.27, 0.16]),
            leaf: [
                b.lambert("leaf", [0.10, 0.26, 0.07]),
                b.lambert("young leaf", [0.20, 0.38, 0.09]),
                b.lambert("old leaf", [0.06, 0.17, 0.08]),
            ],
            fabric: [
                b.lambert("teal fabric", [0.06, 0.30, 0.33]),
                b.lambert("mustard fabric", [0.72, 0.45, 0.09]),
                b.lambert("grey fabric", [0.36, 0.37, 0.40]),
                b.lambert("rose fabric", [0.68, 0.33, 0.31]),
                b.lambert("navy fabric", [0.07, 0.12, 0.27]),
                b.lambert("sage fabric", [0.36, 0.44, 0.31]),
            ],
            spine: [
                b.lambert("red book", [0.55, 0.10, 0.08]),
                b.lambert("blue book", [0.09, 0.20, 0.45]),
                b.lambert("green book", [0.10, 0.32, 0.19]),
                b.lambert("yellow book", [0.75, 0.55, 0.13]),
                b.lambert("cream book", [0.77, 0.70, 0.55]),
                b.lambert("black book", [0.05, 0.05, 0.055]),
                b.lambert("orange book", [0.76, 0.32, 0.08]),
                b.lambert("purple book", [0.28, 0.13, 0.33]),
            ],
        }
    }
}

fn legs(b: &mut Builder, half: [f32; 2], height: f32, thickness: f32, paint: Paint) {
    for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        let (x, z) = (sx * (half[0] - thickness), sz * (half[1] - thickness));
        let h = 0.5 * thickness;
        b.cuboid([x - h, -SINK, z - h], [x + h, height, z + h], paint);
    }
}

/// A table of this width and depth; its top is at `height`.
pub(super) fn table(b: &mut Builder, size: [f32; 3], top: Paint, leg: Paint) {
    let [w, height, d] = size;
    b.cuboid([-0.5 * w, height - 0.04, -0.5 * d], [0.5 * w, height, 0.5 * d], top);
    legs(b, [0.5 * w - 0.02, 0.5 * d - 0.02], height - 0.03, 0.06, leg);
}

/// A round table on one foot.
pub(super) fn round_table(b: &mut Builder, radius: f32, height: f32, top: Paint, leg: Paint) {
    b.cylinder(Vec3::new(0.0, height - 0.035, 0.0), radius, 0.035, 32, top);
    b.cylinder(Vec3::new(0.0, 0.01, 0.0), 0.045, height - 0.03, 12, leg);
    b.frustum(
        Vec3::new(0.0, -SINK, 0.0),
        [0.55 * radius, 0.5 * radius],
        0.035,
        24,
        leg,
    );
}

/// A chair; who sits on it looks along +z.
pub(super) fn chair(b: &mut Builder, frame: Paint, seat: Paint) {
    legs(b, [0.225, 0.225], 0.44, 0.04, frame);
    b.cuboid([-0.22, 0.43, -0.22], [0.22, 0.48, 0.23], seat);
    for x in [-0.205, 0.205] {
        b.cuboid([x - 0.018, 0.42, -0.23], [x + 0.018, 0.93, -0.195], frame);
    }
    b.cuboid([-0.20, 0.66, -0.225], [0.20, 0.91, -0.2], seat);
}

/// A sofa with its back to the wall.
pub(super) fn sofa(b: &mut Builder, dice: &mut Dice, p: &Palette, width: f32, fabric: Paint) {
    let h = 0.5 * width;
    b.cuboid([-h + 0.02, 0.10, 0.05], [h - 0.02, 0.30, 0.86], fabric);
    b.cuboid([-h + 0.01, 0.12, 0.04], [h - 0.01, 0.80, 0.24], fabric);
    for side in [-1.0, 1.0] {
        let (x0, x1) = if side < 0.0 { (-h, -h + 0.18) } else { (h - 0.18, h) };
        b.cuboid([x0, 0.11, 0.045], [x1, 0.58, 0.90], fabric);
        for z in [0.12, 0.80] {
            let x = side * (h - 0.1);
            b.cylinder(Vec3::new(x, -SINK, z), 0.025, 0.13, 8, p.walnut);
        }
    }
    let seats = (width / 0.75).floor().max(1.0);
    let seat = (width - 0.38) / seats;
    for i in 0..seats as u32 {
        let x = -h + 0.19 + i as f32 * seat;
        b.cuboid([x + 0.008, 0.28, 0.2], [x + seat - 0.008, 0.44, 0.89], fabric);
        let corners = std::array::from_fn(|c| {
            let side = if c & 1 == 1 { x + seat - 0.015 } else { x + 0.015 };
            let (y, z) = if c & 2 == 2 { (0.86, 0.23) } else { (0.42, 0.32) };
            Vec3::new(side, y, if c & 4 == 4 { z + 0.13 } else { z - 0.08 })
        });
        b.hexahedron(corners, [fabric; 6]);
    }
    let cushions = if width > 1.2 { 2 } else { 0 };
    for i in 0..cushions {
        let paint = dice.pick(&p.fabric);
        let x = if i == 0 { -h + 0.38 } else { h - 0.40 };
        b.ellipsoid(Vec3::new(x, 0.62, 0.48), Vec3::new(0.21, 0.2, 0.085), 16, 8, paint);
    }
}

/// A row of books from `x0` to `x1` standing at height `y`, spines towards +z at `front`.
pub(super) fn books(b: &mut Builder, dice: &mut Dice, p: &Palette, x: [f32; 2], y: f32, z: [f32; 2], tallest: f32) {
    let mut left = x[0];
    loop {
        let thick = dice.range(0.03, 0.08);
        if left + thick > x[1] {
            break;
        }
        let height = tallest * dice.range(0.66, 1.0);
        let front = z[1] - dice.range(0.0, 0.05);
        b.cuboid(
            [left + 0.001, y - SINK, z[0]],
            [left + thick - 0.001, y + height, front],
            dice.pick(&p.spine),
        );
        left += thick;
    }
}

/// An open shelf against the wall, `fill` of it with books.
pub(super) fn shelf(b: &mut Builder, dice: &mut Dice, p: &Palette, size: [f32; 2], wood: Paint, fill: f32) {
    let [w, height] = size;
    let (h, depth, t) = (0.5 * w, 0.30, 0.025);
    b.cuboid([-h, -SINK, 0.012], [h, height, 0.03], wood);
    for x in [-h, h - t] {
        b.cuboid([x - 0.001, -SINK, 0.011], [x + t + 0.001, height + 0.001, depth], wood);
    }
    let boards = (height / 0.36).round().max(1.0) as u32;
    let step = (height - 0.08) / boards as f32;
    for i in 0..=boards {
        let y = 0.08 + i as f32 * step;
        b.cuboid([-h + 0.01, y - t, 0.02], [h - 0.01, y, depth - 0.004], wood);
        if i == boards {
            break;
        }
        let end = -h + 0.03 + (w - 0.06) * (fill + dice.range(-0.15, 0.15)).clamp(0.0, 1.0);
        if dice.chance(0.75) {
            books(b, dice, p, [-h + 0.03, end], y, [0.04, 0.27], step - 0.07);
        }
        if end < h - 0.25 {
            let at = Vec3::new(h - 0.13, y, 0.15);
            vase(
                b,
                at,
                0.7 * step.min(0.3),
                dice.pick(&[p.clay, p.white, p.brass, p.fabric[0]]),
            );
        }
    }
}

/// A vase that stands at `at`.
pub(super) fn vase(b: &mut Builder, at: Vec3, height: f32, paint: Paint) {
    let r = 0.28 * height;
    b.frustum(at - Vec3::Y * SINK, [0.6 * r, r], 0.45 * height, 16, paint);
    b.frustum(
        at + Vec3::Y * (0.43 * height),
        [0.97 * r, 0.4 * r],
        0.4 * height,
        16,
        paint,
    );
    b.frustum(
        at + Vec3::Y * (0.81 * height),
        [0.41 * r, 0.55 * r],
        0.19 * height,
        16,
        paint,
    );
}

/// A low cupboard against the wall, with things on it.
pub(super) fn sideboard(b: &mut Builder, dice: &mut Dice, p: &Palette, width: f32, wood: Paint) {
    let h = 0.5 * width;
    b.cuboid([-h, 0.14, 0.02], [h, 0.74, 0.44], wood);
    let doors = (width / 0.5).round().max(2.0);
    for i in 0..doors as u32 {
        let x = -h + (i as f32) * width / doors;
        let panel = if wood == p.walnut { p.oak } else { p.white };
        b.cuboid([x + 0.01, 0.16, 0.40], [x + width / doors - 0.01, 0.72, 0.452], panel);
        b.cuboid(
            [x + width / doors - 0.05, 0.42, 0.44],
            [x + width / doors - 0.035, 0.52, 0.47],
            p.brass,
        );
    }
    for x in [-h + 0.08, h - 0.08] {
        for z in [0.08, 0.38] {
            b.cylinder(Vec3::new(x, -SINK, z), 0.018, 0.16, 8, p.dark);
        }
    }
    vase(
        b,
        Vec3::new(-h + 0.25, 0.74, 0.22),
        dice.range(0.26, 0.42),
        dice.pick(&[p.clay, p.fabric[0], p.linen]),
    );
    b.ball(
        Vec3::new(h - 0.32, 0.74 + 0.095, 0.23),
        0.1,
        16,
        dice.pick(&[p.brass, p.white, p.fabric[1]]),
    );
    stack(b, dice, p, Vec3::new(0.05, 0.74, 0.22));
}

/// A few books lying on top of each other.
pub(super) fn stack(b: &mut Builder, dice: &mut Dice, p: &Palette, at: Vec3) {
    let mut y = at.y;
    for _ in 0..3 {
        let (w, d, h) = (dice.range(0.10, 0.14), dice.range(0.07, 0.10), dice.range(0.02, 0.04));
        let (x, z) = (at.x + dice.range(-0.02, 0.02), at.z + dice.range(-0.01, 0.01));
        b.cuboid([x - w, y - 0.001, z - d], [x + w, y + h, z + d], dice.pick(&p.spine));
        y += h;
    }
}

/// A bed with its head to the wall.
pub(super) fn bed(b: &mut Builder, dice: &mut Dice, p: &Palette) {
    let cover = dice.pick(&p.fabric);
    b.cuboid([-0.88, -SINK, 0.02], [0.88, 1.05, 0.09], p.oak);
    b.cuboid([-0.85, 0.1, 0.06], [0.85, 0.30, 2.12], p.oak);
    b.cuboid([-0.80, 0.28, 0.08], [0.80, 0.50, 2.08], p.linen);
    b.cuboid([-0.83, 0.25, 0.75], [0.83, 0.53, 2.11], cover);
    for x in [-0.4, 0.4] {
        b.ellipsoid(Vec3::new(x, 0.55, 0.36), Vec3::new(0.33, 0.09, 0.2), 16, 8, p.white);
    }
    for x in [-0.78, 0.78] {
        b.cuboid([x - 0.03, -SINK, 1.98], [x + 0.03, 0.12, 2.04], p.walnut);
    }
}

/// A desk against the wall with a screen on it.
pub(super) fn desk(b: &mut Builder, dice: &mut Dice, p: &Palette) {
    b.cuboid([-0.75, 0.70, 0.02], [0.75, 0.74, 0.72], p.oak);
    for x in [-0.72, 0.66] {
        b.cuboid([x, -SINK, 0.05], [x + 0.06, 0.71, 0.69], p.dark);
    }
    b.cuboid([-0.32, 0.86, 0.20], [0.32, 1.22, 0.225], p.dark);
    b.cuboid([-0.03, 0.75, 0.17], [0.03, 0.95, 0.198], p.dark);
    b.cuboid([-0.12, 0.74 - SINK, 0.12], [0.12, 0.755, 0.30], p.dark);
    b.cuboid([-0.22, 0.74 - SINK, 0.42], [0.20, 0.757, 0.56], p.white);
    stack(b, dice, p, Vec3::new(-0.55, 0.74, 0.3));
    vase(
        b,
        Vec3::new(0.58, 0.74, 0.25),
        0.22,
        dice.pick(&[p.clay, p.fabric[5], p.brass]),
    );
}

/// A pot with long bent leaves.
pub(super) fn plant(b: &mut Builder, dice: &mut Dice, p: &Palette, height: f32, leaves: u32) {
    let pot = dice.pick(&[p.clay, p.white, p.dark]);
    let r = 0.16 + 0.05 * height;
    b.frustum(Vec3::new(0.0, -SINK, 0.0), [0.75 * r, r], 0.3, 20, pot);
    b.cylinder(Vec3::new(0.0, 0.25, 0.0), 0.86 * r, 0.055, 20, p.walnut);
    for i in 0..leaves {
        let (sin, cos) = sin_cos(i as f32 * 0.381_966 + dice.range(-0.05, 0.05));
        let out = Vec3::new(cos, 0.0, -sin);
        let rise = dice.range(0.55, 1.0) * (height - 0.3);
        let reach = dice.range(0.25, 0.55) * height.min(1.2);
        let root = Vec3::new(0.0, 0.29, 0.0) + out * (0.3 * r);
        let bend = root + out * (0.35 * reach) + Vec3::Y * rise;
        let tip = bend + out * (0.65 * reach) + Vec3::Y * (dice.range(-0.25, 0.12) * rise);
        let paint = dice.pick(&p.leaf);
        b.bar(root, bend.lerp(root, 0.02), 0.012, paint);
        leaf(b, root.lerp(bend, 0.55), bend.lerp(tip, 0.45), tip, 0.075, paint);
    }
}

/// A closed pointed leaf from `from` over `middle` to `tip`.
fn leaf(b: &mut Builder, from: Vec3, middle: Vec3, tip: Vec3, half_width: f32, paint: Paint) {
    let along = (tip - from).normalize();
    let side = along.cross(Vec3::Y).normalize() * half_width;
    let up = side.cross(along).normalize() * 0.004;
    let (left, right, top, bottom) = (middle - side, middle + side, middle + up * 3.0, middle - up);
    for [a, c] in [[right, top], [top, left], [left, bottom], [bottom, right]] {
        b.triangle([from, a, c], paint);
        b.triangle([tip, c, a], paint);
    }
}

/// A rug with a border, centred.
pub(super) fn rug(b: &mut Builder, half: [f32; 2], field: Paint, border: Paint) {
    b.cuboid([-half[0], -SINK, -half[1]], [half[0], 0.008, half[1]], border);
    b.cuboid(
        [-half[0] + 0.12, 0.002, -half[1] + 0.12],
        [half[0] - 0.12, 0.011, half[1] - 0.12],
        field,
    );
}

/// An abstract painting on the wall; its centre hangs at height 1.55 m.
pub(super) fn painting(b: &mut Builder, dice: &mut Dice, p: &Palette, size: [f32; 2]) {
    let [w, h] = [0.5 * size[0], 0.5 * size[1]];
    let y = 1.55;
    b.cuboid(
        [-w, y - h, -SINK],
        [w, y + h, 0.03],
        dice.pick(&[p.dark, p.oak, p.brass]),
    );
    b.cuboid(
        [-w + 0.03, y - h + 0.03, 0.01],
        [w - 0.03, y + h - 0.03, 0.034],
        p.linen,
    );
    for i in 0..4 {
        let (u, v) = (dice.range(-0.6, 0.3) * w, dice.range(-0.6, 0.3) * h);
        let (s, t) = (dice.range(0.25, 0.55) * w, dice.range(0.25, 0.55) * h);
        let front = 0.0355 + 0.0015 * i as f32;
        b.cuboid([u, y + v, 0.02], [u + s, y + v + t, front], dice.pick(&p.fabric));
    }
}

/// A pedestal with a ball or a vase.
pub(super) fn pedestal(b: &mut Builder, dice: &mut Dice, p: &Palette) {
    b.cuboid([-0.22, -SINK, -0.22], [0.22, 0.95, 0.22], p.white);
    let paint = dice.pick(&[p.brass, p.clay, p.fabric[0], p.fabric[3], p.dark]);
    if dice.chance(0.5) {
        b.ball(Vec3::new(0.0, 0.95 + 0.195, 0.0), 0.2, 24, paint);
    } else {
        vase(b, Vec3::new(0.0, 0.95, 0.0), 0.55, paint);
    }
}

/// A table with chairs around it, set with a few things; `seats` along each long side.
pub(super) fn dining_group(b: &mut Builder, dice: &mut Dice, p: &Palette, center: Vec3, turns: f32, seats: u32) {
    let length = 0.35 + 0.65 * seats as f32;
    b.place(Pose::new(center, turns));
    table(b, [length, 0.75, 0.92], p.oak, p.oak);
    vase(
        b,
        Vec3::new(0.1, 0.75, 0.0),
        0.3,
        dice.pick(&[p.clay, p.white, p.fabric[0]]),
    );
    for i in 0..seats {
        for z in [-0.22, 0.22] {
            let x = (i as f32 - 0.5 * (seats as f32 - 1.0)) * 0.65;
            b.cylinder(Vec3::new(x, 0.75 - SINK, z), 0.12, 0.018, 20, p.white);
        }
    }
    let seat = dice.pick(&[p.fabric[1], p.fabric[0], p.fabric[2], p.linen]);
    for i in 0..seats {
        for side in [-1.0, 1.0] {
            let x = (i as f32 - 0.5 * (seats as f32 - 1.0)) * 0.65;
            let at = Pose::new(center, turns).point(Vec3::new(x, 0.0, side * dice.range(0.58, 0.72)));
            let facing = if side < 0.0 { 0.0 } else { 0.5 };
            b.place(Pose::new(at, turns + facing + dice.range(-0.02, 0.02)));
            chair(b, p.walnut, seat);
        }
    }
}
