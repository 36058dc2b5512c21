//! What the houses and streets of `city` have in common: windows, lanterns, trees, cars.

use super::builder::{Builder, Paint};
use super::city::PANES;
use super::dice::{Dice, sin_cos};
use super::furniture::Palette;
use glam::Vec3;
use std::f32::consts::PI;

/// Windows of a row, which is one mesh.
pub(super) const WINDOWS_OF_ROW: usize = 3;
/// Length of a row, metres.
pub(super) const ROW: f32 = 7.2;
/// How lit rooms look from outside: lamps, a cooler one, a screen.
const GLOWS: [Vec3; 4] = [
    Vec3::new(2.5, 1.45, 0.6),
    Vec3::new(1.7, 1.12, 0.6),
    Vec3::new(1.5, 1.25, 0.9),
    Vec3::new(0.6, 0.85, 1.2),
];
/// Flux of a lantern, W, and its colour.
const LANTERN_FLUX: f32 = 330.0;
const LANTERN_GLOW: Vec3 = Vec3::new(1.5, 0.92, 0.4);

/// Rows of three windows, by which of them are lit and in which colour.
pub(super) struct WindowRows {
    dark: u32,
    lit: Vec<[u32; GLOWS.len()]>,
}

impl WindowRows {
    pub(super) fn new(b: &mut Builder, p: &Palette) -> Self {
        let glass = b.glazed("glass", [0.02, 0.025, 0.03], 0.08);
        let blind = b.lambert("blind", [0.45, 0.42, 0.36]);
        let glows = GLOWS.map(|glow| b.emitter("window light", glow));
        Self {
            dark: row(b, p, 0, [glass, blind], glows[0]),
            lit: (1..1 << WINDOWS_OF_ROW)
                .map(|pattern| glows.map(|glow| row(b, p, pattern, [glass, blind], glow)))
                .collect(),
        }
    }

    /// The mesh in which the windows of the bits of `pattern` are lit.
    pub(super) fn mesh(&self, dice: &mut Dice, pattern: usize) -> u32 {
        let colour = [0, 0, 0, 1, 1, 1, 2, 2, 3][dice.below(9)];
        match pattern.checked_sub(1) {
            None => self.dark,
            Some(lit) => self.lit[lit][colour],
        }
    }
}

/// One row: frames, glazing bars, a box of glass with a blind behind, or four panes that shine.
fn row(b: &mut Builder, p: &Palette, pattern: usize, [glass, blind]: [Paint; 2], glow: Paint) -> u32 {
    b.shared("windows", |b| {
        for window in 0..WINDOWS_OF_ROW {
            let middle = ROW / WINDOWS_OF_ROW as f32 * (window as f32 + 0.5);
            let (left, right, low, high) = (middle - 0.67, middle + 0.67, 0.79, 2.59);
            let lit = pattern >> window & 1 == 1;
            b.cuboid(
                [left, low, -0.352],
                [right, high, -0.25],
                if lit { blind } else { glass },
            );
            if !lit && (window + pattern).is_multiple_of(2) {
                b.cuboid(
                    [left + 0.06, high - 0.7, -0.26],
                    [right - 0.06, high - 0.05, -0.24],
                    blind,
                );
            }
            let (bar, front) = (0.06, -0.18);
            for x in [left, middle - 0.5 * bar, right - bar] {
                b.cuboid([x, low, -0.26], [x + bar, high, front], p.white);
            }
            for y in [low, 1.95, high - bar] {
                b.cuboid([left + 0.01, y, -0.26], [right - 0.01, y + bar, front - 0.01], p.white);
            }
            if lit {
                for (x0, x1) in [(left + bar, middle - 0.5 * bar), (middle + 0.5 * bar, right - bar)] {
                    for (y0, y1) in [(low + bar, 1.95), (1.95 + bar, high - bar)] {
                        let at = |x: f32, y: f32| Vec3::new(x, y, -0.248);
                        b.polygon(&[at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)], glow);
                    }
                }
            }
        }
    })
}

/// A lamp post, its lantern shining through four panes or not at all.
pub(super) fn lantern(b: &mut Builder, p: &Palette, lit: bool) -> u32 {
    let (half, low, high, front) = (0.14, 4.52, 4.9, 0.162);
    let area = (PANES / 2) as f32 * 2.0 * half * (high - low);
    let paint = b.emitter("lantern light", LANTERN_GLOW * (LANTERN_FLUX / (PI * area)));
    b.shared("lantern", |b| {
        b.frustum(Vec3::new(0.0, -0.05, 0.0), [0.2, 0.1], 0.5, 16, p.dark);
        b.cylinder(Vec3::new(0.0, 0.4, 0.0), 0.05, 4.1, 12, p.dark);
        b.cuboid([-0.2, 4.45, -0.2], [0.2, 4.5, 0.2], p.dark);
        b.cuboid([-0.16, 4.49, -0.16], [0.16, 4.94, 0.16], p.linen);
        b.frustum(Vec3::new(0.0, 4.92, 0.0), [0.31, 0.04], 0.24, 16, p.dark);
        for side in (0..PANES / 2).filter(|_| lit) {
            let (sin, cos) = sin_cos(0.25 * side as f32);
            let at = |u: f32, y: f32| Vec3::new(cos * u + sin * front, y, -sin * u + cos * front);
            b.polygon(&[at(-half, low), at(half, low), at(half, high), at(-half, high)], paint);
        }
    })
}

/// A street tree: a trunk, boughs and a crown of leaves.
pub(super) fn tree(b: &mut Builder, dice: &mut Dice, p: &Palette) -> u32 {
    let (height, leaves) = (dice.range(4.4, 6.5), 260);
    b.shared("tree", |b| {
        b.frustum(Vec3::new(0.0, -0.1, 0.0), [0.17, 0.09], 0.6 * height, 10, p.walnut);
        for i in 0..leaves {
            let (sin, cos) = sin_cos(i as f32 * 0.381_966);
            let rise = dice.unit();
            let reach = (0.4 + 0.6 * dice.unit()) * 1.7 * (4.0 * rise * (1.05 - rise)).sqrt();
            let middle = Vec3::new(reach * cos, height * (0.45 + 0.55 * rise), -reach * sin);
            if i % 12 == 0 {
                b.bar(Vec3::Y * (0.5 * height), middle, 0.05, p.walnut);
            }
            let radii = Vec3::new(dice.range(0.14, 0.3), dice.range(0.05, 0.12), dice.range(0.14, 0.3));
            b.octahedron(middle, radii, dice.pick(&p.leaf));
        }
    })
}

/// Parked cars, in five colours.
pub(super) fn cars(b: &mut Builder, p: &Palette) -> Vec<u32> {
    let glass = b.glazed("car glass", [0.03, 0.035, 0.04], 0.08);
    let coats = [
        [0.38, 0.04, 0.03],
        [0.05, 0.09, 0.22],
        [0.55, 0.55, 0.53],
        [0.03, 0.03, 0.035],
        [0.08, 0.2, 0.12],
    ];
    coats
        .map(|coat| {
            let coat = b.glazed("car paint", coat, 0.2);
            b.shared("car", |b| car(b, p, coat, glass))
        })
        .to_vec()
}

fn car(b: &mut Builder, p: &Palette, coat: Paint, glass: Paint) {
    let solid = |low: [f32; 3], high: [f32; 3], taper: [f32; 2]| {
        std::array::from_fn(|i| {
            let upper = i & 2 == 2;
            let x = if i & 1 == 1 { high[0] } else { low[0] };
            let z = if i & 4 == 4 { high[2] } else { low[2] };
            let (fx, fz) = if upper { (taper[0], taper[1]) } else { (1.0, 1.0) };
            Vec3::new(x * fx, if upper { high[1] } else { low[1] }, z * fz)
        })
    };
    b.hexahedron(solid([-2.1, 0.28, -0.86], [2.1, 0.62, 0.86], [1.02, 1.02]), [coat; 6]);
    b.hexahedron(solid([-2.13, 0.61, -0.87], [2.13, 0.86, 0.87], [0.96, 0.94]), [coat; 6]);
    b.hexahedron(solid([-1.5, 0.85, -0.78], [1.15, 1.4, 0.78], [0.72, 0.84]), [glass; 6]);
    b.hexahedron(solid([-1.08, 1.39, -0.66], [0.83, 1.44, 0.66], [0.95, 0.95]), [coat; 6]);
    for x in [-1.35, 1.35] {
        for z in [-0.8, 0.8] {
            b.ellipsoid(Vec3::new(x, 0.33, z), Vec3::new(0.33, 0.33, 0.13), 16, 8, p.dark);
            b.ellipsoid(
                Vec3::new(x, 0.33, 1.12 * z),
                Vec3::new(0.17, 0.17, 0.05),
                12,
                6,
                p.linen,
            );
        }
    }
    for z in [-0.6, 0.6] {
        b.cuboid([2.05, 0.5, z - 0.16], [2.17, 0.6, z + 0.16], p.white);
        b.cuboid([-2.17, 0.5, z - 0.16], [-2.05, 0.6, z + 0.16], p.spine[0]);
    }
}
