//! The inspected pixel: a card with what is there, and lines to the lights that matter.

use super::super::app::App;
use super::super::views::light_color;
use super::theme;
use crate::table;
use egui::{Align2, Area, Color32, Id, LayerId, Order, Painter, Pos2, Rect, Stroke, vec2};
use glam::Vec3;
use render::Projection;

/// Height of a window in which figures and card find room above each other, points.
const ROOM_FOR_BOTH: f32 = 660.0;

/// Lines from the point to its lights, and a ring around the lamp that is marked, where the picture is seen: in `free`.
pub(super) fn markers(context: &egui::Context, app: &App, free: Rect) {
    let painter = context.layer_painter(LayerId::new(Order::Background, Id::unique("markers")));
    let painter = painter.with_clip_rect(free);
    if let Some(found) = &app.inspection
        && let Some(point) = on_screen(context, app, found.position_ws)
    {
        for light in found.lights.iter().rev() {
            let Some(at) = light.position_ws.and_then(|at| on_screen(context, app, at)) else {
                continue;
            };
            let strength = (light.probability / found.lights[0].probability).sqrt() as f32;
            let color = if light.visible {
                theme::WARM
            } else {
                Color32::from_rgb(126, 134, 148)
            };
            let stroke = Stroke::new(0.8 + 2.0 * strength, color.gamma_multiply(0.35 + 0.6 * strength));
            if light.visible {
                painter.line_segment([point, at], stroke);
            } else {
                painter.extend(egui::Shape::dashed_line(&[point, at], stroke, 6.0, 5.0));
            }
            painter.circle(
                at,
                4.0,
                to_color(light_color(light.light.into())),
                Stroke::new(1.0, color),
            );
        }
        cross(&painter, point);
    }
    if let Some(stage) = &app.stage
        && let Some(at) = stage.selected.and_then(|lamp| stage.lamps.get(lamp)?.position_ws)
        && let Some(at) = on_screen(context, app, at)
    {
        painter.circle_stroke(at, 15.0, Stroke::new(3.0, Color32::from_black_alpha(150)));
        painter.circle_stroke(at, 15.0, Stroke::new(1.6, theme::ACCENT));
    }
}

fn cross(painter: &Painter, at: Pos2) {
    for (width, color) in [(3.5, Color32::from_black_alpha(170)), (1.5, Color32::WHITE)] {
        let stroke = Stroke::new(width, color);
        painter.line_segment([at - vec2(8.0, 0.0), at + vec2(8.0, 0.0)], stroke);
        painter.line_segment([at - vec2(0.0, 8.0), at + vec2(0.0, 8.0)], stroke);
    }
}

/// The card.
pub(super) fn card(context: &egui::Context, app: &mut App) {
    let Some(found) = &app.inspection else { return };
    let mut close = false;
    // Below the figures, or beside them in a low window.
    let beside = app.panels.overlay && context.content_rect().height() < ROOM_FOR_BOTH;
    let left = if beside { theme::MARGIN + 288.0 } else { theme::MARGIN };
    let area = Area::new(Id::unique("inspected")).anchor(Align2::LEFT_BOTTOM, vec2(left, -theme::MARGIN));
    area.show(context, |ui| {
        theme::card().show(ui, |ui| {
            ui.set_max_width(300.0);
            ui.spacing_mut().item_spacing.y = 2.0;
            ui.spacing_mut().interact_size.y = 13.0;
            ui.horizontal(|ui| {
                ui.label(theme::title(if found.material.is_empty() {
                    "(no name)"
                } else {
                    &found.material
                }));
                close = ui.small_button("x").clicked();
            });
            let (p, n, a) = (found.position_ws, found.normal_ws, found.albedo);
            for text in [
                format!("{:.2} m away, at {:.2} {:.2} {:.2}", found.distance, p.x, p.y, p.z),
                format!(
                    "normal {:.2} {:.2} {:.2}, roughness {:.2}",
                    n.x, n.y, n.z, found.roughness
                ),
                format!("albedo {:.2} {:.2} {:.2}", a.x, a.y, a.z),
            ] {
                ui.label(theme::faint(text));
            }
            if let Some(light) = found.light {
                let e = found.emitted;
                ui.label(theme::faint(format!(
                    "light {light}, emits {:.2} {:.2} {:.2}",
                    e.x, e.y, e.z
                )));
            }
            if let Some(cell) = &found.cell {
                ui.label(theme::faint(format!(
                    "cell {}, {:.2} m, facing {}: {} entries, {} samples, {} frames old",
                    cell.number,
                    cell.size_m,
                    cell.normal,
                    cell.entries,
                    table::thousands(cell.samples),
                    cell.age
                )));
            }
            if found.lights.is_empty() {
                ui.label(theme::faint("no light is chosen here"));
                return;
            }
            let half = format!(
                "half of the draws go to {} lights; the first:",
                table::thousands(found.half_of_samples as u64)
            );
            theme::heading(ui, &half);
            egui::Grid::new("lights here")
                .num_columns(3)
                .spacing(vec2(10.0, 1.0))
                .show(ui, |ui| {
                    for light in &found.lights {
                        ui.label(theme::figure(format!("{:5.1} %", light.probability * 100.0)));
                        let (rect, _) = ui.allocate_exact_size(vec2(9.0, 9.0), egui::Sense::hover());
                        ui.painter()
                            .circle_filled(rect.center(), 4.0, to_color(light_color(light.light.into())));
                        let hidden = if light.visible { "" } else { " (centre hidden)" };
                        ui.label(theme::faint(format!("{}{hidden}", light.name)));
                        ui.end_row();
                    }
                });
        });
    });
    if close {
        app.inspection = None;
    }
}

/// Where a point of the world is in the window, in points.
fn on_screen(context: &egui::Context, app: &App, point_ws: Vec3) -> Option<Pos2> {
    let size = vec2(app.size.0 as f32, app.size.1 as f32) / context.pixels_per_point();
    let aspect = app.size.0.max(1) as f32 / app.size.1.max(1) as f32;
    let share = Projection::new(app.fly.camera(), aspect).share(point_ws)?;
    // Far outside lines would be so long that they are drawn wrongly.
    let near = share.abs().max_element() < 20.0;
    near.then(|| Pos2::new(share.x * size.x, share.y * size.y))
}

fn to_color(linear: Vec3) -> Color32 {
    let [r, g, b] = (linear.clamp(Vec3::ZERO, Vec3::ONE).powf(1.0 / 2.2) * 255.0)
        .to_array()
        .map(|v| v as u8);
    Color32::from_rgb(r, g, b)
}
