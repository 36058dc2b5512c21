//! `spheres`: balls from mirror-like to matt, metal and glazed, under many small coloured lights; in the manner of the
//! plates of Veach and Guibas, "Optimally combining sampling techniques for Monte Carlo rendering" (1995), figure 2.

use super::builder::{Builder, Paint};
use super::dice::Dice;
use super::lamps::{Lamp, Source, share};
use crate::SceneParts;
use glam::Vec3;

/// Roughness from left to right.
const ROUGHNESS: [f32; 6] = [0.05, 0.12, 0.22, 0.38, 0.62, 1.0];
const RADIUS: f32 = 0.46;
const PITCH: f32 = 1.12;

/// Lamp colours, luminance about 1.
const COLORS: [Vec3; 6] = [
    Vec3::new(1.45, 0.93, 0.42),
    Vec3::new(0.42, 1.1, 1.7),
    Vec3::new(1.9, 0.66, 0.9),
    Vec3::new(1.18, 0.98, 0.74),
    Vec3::new(0.45, 1.22, 0.65),
    Vec3::new(2.0, 0.76, 0.22),
];

/// Makes it.
pub(super) fn spheres(lights: usize, seed: u32) -> SceneParts {
    let mut b = Builder::new("spheres");
    let mut dice = Dice::new(&[seed, 41]);
    let stage = b.lambert("stage", [0.33, 0.33, 0.35]);
    let step = b.lambert("step", [0.45, 0.43, 0.41]);
    let backdrop = b.lambert("backdrop", [0.30, 0.31, 0.36]);
    b.begin("stage", "stage");
    b.cuboid([-12.0, -0.3, -5.0], [12.0, 0.0, 10.0], stage);
    b.cuboid([-12.0, -0.2, -4.2], [12.0, 7.0, -3.9], backdrop);
    let half_width = 0.5 * PITCH * ROUGHNESS.len() as f32 + 0.15;
    for row in 0..3 {
        let (height, front) = (0.12 + 0.5 * row as f32, 1.75 - 1.3 * row as f32);
        b.begin(format!("step {row}"), "step");
        let side = half_width + 0.01 * row as f32;
        b.cuboid([-side, -0.1, -2.4 + 0.01 * row as f32], [side, height, front], step);
        for (column, &roughness) in ROUGHNESS.iter().enumerate() {
            let paint = ball_paint(&mut b, row, roughness);
            b.begin(format!("row {row} / ball of roughness {roughness}"), "ball");
            let x = (column as f32 - 0.5 * (ROUGHNESS.len() - 1) as f32) * PITCH;
            // Half a millimetre deep, so that it rests on an area and not on a point.
            let center = Vec3::new(x, height + RADIUS - 0.0005, front - 0.62);
            b.ellipsoid(center, Vec3::splat(RADIUS), 72, 36, paint);
        }
    }
    let low = lights / 5;
    lamps(&mut b, &mut dice, lights - low);
    footlights(&mut b, low);
    b.camera("front", Vec3::new(0.0, 3.0, 8.2), Vec3::new(0.0, 0.98, 0.0), 0.66);
    b.finish()
}

fn ball_paint(b: &mut Builder, row: usize, roughness: f32) -> Paint {
    match row {
        0 => b.glazed(
            &format!("blue glaze, roughness {roughness}"),
            [0.06, 0.17, 0.42],
            roughness,
        ),
        1 => b.metal(&format!("gold, roughness {roughness}"), [1.0, 0.77, 0.34], roughness),
        _ => b.metal(&format!("steel, roughness {roughness}"), [0.78, 0.79, 0.81], roughness),
    }
}

/// Lamps of many sizes on a grid over the stage, each of one colour and all of about one power.
fn lamps(b: &mut Builder, dice: &mut Dice, lights: usize) {
    let housing = b.lambert("housing", [0.05, 0.05, 0.055]);
    let count = (lights / 4).clamp(4, 28);
    let columns = 7;
    let flux = 1500.0 / count as f32;
    for i in 0..count {
        // Spread over the grid whatever their number.
        let cell = i * 28 / count;
        let (column, row) = (cell % columns, cell / columns);
        let at = Vec3::new(
            (column as f32 - 3.0) * 1.45 + dice.range(-0.25, 0.25),
            4.6 + 0.22 * row as f32 + dice.range(-0.2, 0.2),
            -2.6 + 2.1 * row as f32 + dice.range(-0.25, 0.25),
        );
        let half = dice.pick(&[[0.5, 0.05], [0.3, 0.3], [0.16, 0.16], [0.42, 0.18], [0.08, 0.08]]);
        b.begin(format!("lamp {i}"), "lamp");
        b.bar(at + Vec3::Y * 0.05, at.with_y(7.6), 0.015, housing);
        let fixture = Lamp {
            bottom_center: at,
            half,
            height: 0.08,
            housing,
            up: false,
        };
        let color = COLORS[(column + 2 * row + dice.below(2)) % COLORS.len()];
        fixture.build(b, Source::Panels, share(lights, count, i), color * flux, "lamp light");
    }
}

/// Small lamps along the edge of the stage that shine up, so that the undersides of the balls have something to mirror.
fn footlights(b: &mut Builder, lights: usize) {
    let housing = b.lambert("housing", [0.05, 0.05, 0.055]);
    let count = (lights / 2).clamp(1, 14);
    for i in 0..count {
        // Nine before the lowest step, the others beside it, the middle first.
        let reach = i.div_ceil(2) as f32 * if i % 2 == 0 { 1.0 } else { -1.0 };
        let at = if i < 9 {
            Vec3::new(0.86 * reach, 0.0, 2.5)
        } else {
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            Vec3::new(4.1 * side, 0.0, 1.6 - 1.1 * ((i - 9) / 2) as f32)
        };
        b.begin(format!("footlight {i}"), "footlight");
        let fixture = Lamp {
            bottom_center: at - Vec3::Y * 0.01,
            half: if i < 9 { [0.3, 0.05] } else { [0.05, 0.3] },
            height: 0.09,
            housing,
            up: true,
        };
        let color = COLORS[(5 * i + 1) % COLORS.len()];
        fixture.build(b, Source::Panels, share(lights, count, i), color * 9.0, "footlight");
    }
}
