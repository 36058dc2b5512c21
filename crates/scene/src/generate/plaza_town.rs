//! What stands around and in the middle of the square of `plaza`: paving, fountain, houses.

use super::builder::{Builder, Paint};
use super::dice::{Dice, exp10, sin_cos};
use super::furniture::Palette;
use glam::Vec3;
use std::f32::consts::PI;

/// Half the width (x) and depth (z) of the square between the facades, metres.
pub(super) const FRONT: [f32; 2] = [18.0, 15.0];

/// Lamp posts, (x, z), the ones that the camera sees best first.
pub(super) const LANTERNS: [[f32; 2]; 12] = [
    [5.3, -1.2],
    [-5.3, 1.2],
    [1.2, -4.9],
    [-1.2, 4.9],
    [-11.0, -8.6],
    [11.0, -8.6],
    [11.0, 8.6],
    [-11.6, 7.0],
    [0.0, -12.6],
    [15.6, 0.0],
    [-15.6, -1.0],
    [0.0, 12.6],
];

/// A lit or dark window: middle of the pane, outward normal (horizontal), half sizes.
pub(super) struct Window {
    center: Vec3,
    normal: Vec3,
    half: [f32; 2],
}

/// Paving slabs with joints on a bed.
pub(super) fn ground(b: &mut Builder, dice: &mut Dice) {
    b.begin("ground", "ground");
    let bed = b.lambert("joint", [0.10, 0.095, 0.09]);
    b.cuboid([-30.0, -0.6, -27.0], [30.0, -0.03, 27.0], bed);
    b.begin("paving", "paving");
    let stones = [
        b.lambert("pale stone", [0.44, 0.41, 0.37]),
        b.lambert("stone", [0.37, 0.35, 0.33]),
        b.lambert("warm stone", [0.42, 0.36, 0.30]),
        b.lambert("dark stone", [0.27, 0.26, 0.26]),
    ];
    let size = 1.2;
    let (nx, nz) = ((FRONT[0] / size) as i32 + 1, (FRONT[1] / size) as i32 + 1);
    for i in -nx..nx {
        for k in -nz..nz {
            let (x, z) = (i as f32 * size, k as f32 * size);
            let ring = ((x + 0.6) * (x + 0.6) + (z + 0.6) * (z + 0.6)) as i32 / 18 % 2 == 0;
            let paint = if dice.chance(0.72) {
                stones[usize::from(ring)]
            } else {
                dice.pick(&stones)
            };
            let top = dice.range(-0.004, 0.004);
            b.cuboid(
                [x + 0.008, -0.1, z + 0.008],
                [x + size - 0.008, top, z + size - 0.008],
                paint,
            );
        }
    }
}

/// A basin, a column and two bowls, with falling water hinted at.
pub(super) fn fountain(b: &mut Builder, p: &Palette) {
    b.begin("fountain", "fountain");
    let stone = b.lambert("fountain stone", [0.58, 0.55, 0.50]);
    let water = b.lambert("water", [0.09, 0.22, 0.27]);
    let foam = b.lambert("foam", [0.70, 0.76, 0.78]);
    b.cylinder(Vec3::new(0.0, -0.05, 0.0), 2.9, 0.2, 48, stone);
    // The rim of the basin is a ring of blocks; the water fills it.
    let blocks = 32;
    for i in 0..blocks {
        let (sin, cos) = sin_cos(i as f32 / blocks as f32);
        let (out, side) = (Vec3::new(cos, 0.0, -sin), Vec3::new(-sin, 0.0, -cos));
        let corners = std::array::from_fn(|c| {
            let along = if c & 1 == 1 { 0.235 } else { -0.235 };
            let radius = if c & 4 == 4 { 2.2 } else { 2.6 };
            let stretch = radius / 2.4;
            // Neighbours overlap a little, at heights that differ by a hair.
            let top = 0.62 + 0.004 * (i % 2) as f32;
            out * radius + side * (along * stretch) + Vec3::Y * if c & 2 == 2 { top } else { 0.1 }
        });
        b.hexahedron(corners, [stone; 6]);
    }
    b.cylinder(Vec3::new(0.0, 0.12, 0.0), 2.3, 0.36, 48, water);
    b.frustum(Vec3::new(0.0, 0.4, 0.0), [0.5, 0.26], 0.5, 24, stone);
    b.frustum(Vec3::new(0.0, 0.85, 0.0), [0.22, 0.3], 0.85, 24, stone);
    b.frustum(Vec3::new(0.0, 1.6, 0.0), [0.25, 1.15], 0.28, 32, stone);
    b.cylinder(Vec3::new(0.0, 1.8, 0.0), 1.05, 0.1, 32, water);
    b.frustum(Vec3::new(0.0, 1.85, 0.0), [0.2, 0.14], 0.8, 24, stone);
    b.frustum(Vec3::new(0.0, 2.6, 0.0), [0.12, 0.55], 0.18, 24, stone);
    b.ball(Vec3::new(0.0, 2.9, 0.0), 0.16, 20, p.brass);
    for i in 0..12 {
        let (sin, cos) = sin_cos((i as f32 + 0.5) / 12.0);
        let at = |r: f32, y: f32| Vec3::new(r * cos, y, -r * sin);
        b.bar(at(1.13, 1.86), at(1.42, 1.3), 0.025, foam);
        b.bar(at(1.415, 1.31), at(1.55, 0.45), 0.03, foam);
    }
}

/// Houses around the square; returns their windows, nearest to the middle of the view first.
pub(super) fn facades(b: &mut Builder, dice: &mut Dice, p: &Palette) -> Vec<Window> {
    let plaster = [
        b.lambert("cream house", [0.66, 0.58, 0.42]),
        b.lambert("rose house", [0.62, 0.38, 0.33]),
        b.lambert("ochre house", [0.64, 0.45, 0.20]),
        b.lambert("grey-blue house", [0.38, 0.45, 0.52]),
        b.lambert("white house", [0.70, 0.68, 0.64]),
        b.lambert("olive house", [0.42, 0.44, 0.30]),
    ];
    let roof = b.lambert("roof tiles", [0.36, 0.16, 0.11]);
    let glass = b.lambert("dark glass", [0.05, 0.06, 0.08]);
    let mut windows = Vec::new();
    let mut number = 0;
    let mut last = usize::MAX;
    // Outward normals (towards the square) of the four rows of houses.
    for (normal, half_length, distance) in [
        (Vec3::Z, FRONT[0] + 6.0, FRONT[1]),
        (Vec3::NEG_X, FRONT[1], FRONT[0]),
        (Vec3::X, FRONT[1], FRONT[0]),
        (Vec3::NEG_Z, FRONT[0] + 6.0, FRONT[1]),
    ] {
        let mut from = -half_length;
        while from < half_length - 0.5 {
            let rest = half_length - from;
            let width = if rest < 9.5 { rest } else { dice.range(5.6, 8.6) };
            let mut color = dice.below(plaster.len());
            if color == last {
                color = (color + 1) % plaster.len();
            }
            last = color;
            let house = House {
                normal,
                along: Vec3::Y.cross(normal),
                middle: normal * -distance + Vec3::Y.cross(normal) * (from + 0.5 * width),
                half_width: 0.5 * width,
                paint: plaster[color],
            };
            b.begin(format!("house {number}"), "house");
            house.build(b, dice, p, roof, glass, &mut windows);
            number += 1;
            from += width;
        }
    }
    windows
}

/// A house: its own space has x along the facade, z out of it.
struct House {
    normal: Vec3,
    along: Vec3,
    middle: Vec3,
    half_width: f32,
    paint: Paint,
}

impl House {
    fn solid(&self, b: &mut Builder, low: [f32; 3], high: [f32; 3], paint: Paint) {
        let corners = std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
            self.middle + self.along * pick(0) + Vec3::Y * pick(1) + self.normal * pick(2)
        });
        b.hexahedron(corners, [paint; 6]);
    }

    fn build(
        &self,
        b: &mut Builder,
        dice: &mut Dice,
        p: &Palette,
        roof: Paint,
        glass: Paint,
        windows: &mut Vec<Window>,
    ) {
        let storeys = 2 + dice.below(3);
        let (ground, storey) = (3.7, 2.9);
        let height = ground + storey * storeys as f32;
        let w = self.half_width;
        // Neighbours stand side by side at depths that differ, so that no walls coincide.
        let back = -5.0 - dice.range(0.0, 1.0);
        self.solid(b, [-w + 0.01, -0.3, back], [w - 0.01, height, 0.0], self.paint);
        self.solid(
            b,
            [-w - 0.0, height - 0.02, back - 0.2],
            [w - 0.02, height + 0.28, 0.35],
            roof,
        );
        self.solid(
            b,
            [-w + 0.02, ground - 0.12, -0.1],
            [w - 0.02, ground + 0.06, 0.09],
            p.linen,
        );
        let columns = (2.0 * w / 2.1).floor() as usize;
        for floor in 0..storeys {
            for column in 0..columns {
                let x = -w + 2.0 * w * (column as f32 + 0.5) / columns as f32;
                let y = ground + storey * floor as f32 + 1.45;
                let (hx, hy) = (0.5, 0.75);
                self.solid(
                    b,
                    [x - hx - 0.1, y - hy - 0.1, -0.1],
                    [x + hx + 0.1, y + hy + 0.1, 0.04],
                    p.white,
                );
                self.solid(b, [x - hx, y - hy, -0.05], [x + hx, y + hy, 0.045], glass);
                self.solid(
                    b,
                    [x - 0.025, y - hy - 0.01, -0.05],
                    [x + 0.025, y + hy + 0.01, 0.07],
                    p.white,
                );
                self.solid(
                    b,
                    [x - hx - 0.01, y + 0.2, -0.05],
                    [x + hx + 0.01, y + 0.24, 0.065],
                    p.white,
                );
                self.solid(
                    b,
                    [x - hx - 0.18, y - hy - 0.16, -0.1],
                    [x + hx + 0.18, y - hy - 0.09, 0.16],
                    p.linen,
                );
                windows.push(self.window([x, y], [hx - 0.02, hy - 0.02]));
            }
        }
        // Ground floor: a door and a shop window.
        let door = if dice.chance(0.5) { -w + 1.1 } else { w - 1.1 };
        self.solid(b, [door - 0.62, -0.1, -0.1], [door + 0.62, 2.45, 0.07], p.linen);
        self.solid(
            b,
            [door - 0.5, -0.09, -0.05],
            [door + 0.5, 2.33, 0.09],
            dice.pick(&p.fabric),
        );
        let shop = -0.45 * door;
        let half = 0.52 * w;
        self.solid(
            b,
            [shop - half - 0.1, 0.55, -0.1],
            [shop + half + 0.1, 2.75, 0.04],
            p.walnut,
        );
        self.solid(b, [shop - half, 0.65, -0.05], [shop + half, 2.65, 0.045], glass);
        windows.push(self.window([shop, 1.65], [half - 0.03, 0.97]));
        let awning = dice.pick(&p.fabric);
        let corners = std::array::from_fn(|c| {
            let x = if c & 1 == 1 {
                shop + half + 0.25
            } else {
                shop - half - 0.25
            };
            let (y, z) = if c & 4 == 4 { (2.72, 1.1) } else { (3.15, -0.05) };
            self.middle + self.along * x + Vec3::Y * (y + if c & 2 == 2 { 0.05 } else { 0.0 }) + self.normal * z
        });
        b.hexahedron(corners, [awning; 6]);
    }

    /// A pane a little in front of the glass, which glows if it is lit.
    fn window(&self, [x, y]: [f32; 2], half: [f32; 2]) -> Window {
        Window {
            center: self.middle + self.along * x + Vec3::Y * y + self.normal * 0.048,
            normal: self.normal,
            half,
        }
    }
}

/// Lights `count` of the windows, spread over all.
pub(super) fn light_windows(b: &mut Builder, dice: &mut Dice, windows: &[Window], count: usize) {
    let colors = [
        Vec3::new(1.5, 0.92, 0.38),
        Vec3::new(1.3, 0.96, 0.58),
        Vec3::new(0.75, 1.02, 1.45),
    ];
    let mut lit = 0;
    for (i, window) in windows.iter().enumerate() {
        if count * (i + 1) / windows.len() == lit {
            continue;
        }
        b.begin(format!("window {lit}"), "window");
        lit += 1;
        let along = Vec3::Y.cross(window.normal);
        let [hx, hy] = window.half;
        let step = dice.below(9);
        let radiance = exp10(-0.7 + 0.125 * step as f32) * (4.0 / PI);
        let paint = b.emitter("window light", dice.pick(&colors) * radiance);
        let at = |u: f32, v: f32| window.center + along * (u * hx) + Vec3::Y * (v * hy);
        b.polygon(&[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], paint);
    }
}
