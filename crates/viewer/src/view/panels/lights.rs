//! The light table: lamps by importance, each to be marked, dimmed, coloured or switched off.

use super::super::actions::Action;
use super::super::app::{App, Stage};
use super::super::lamps::Lamp;
use super::theme;
use crate::table;
use egui::{Color32, ScrollArea, Slider};
use glam::Vec3;

/// Rows that are made at most; the search finds the others.
const MOST_ROWS: usize = 400;
/// Height of a row, points.
const ROW: f32 = 20.0;

/// Lays it out.
pub(super) fn show(ui: &mut egui::Ui, app: &mut App, actions: &mut Vec<Action>) {
    let Some(stage) = &app.stage else { return };
    let changed = stage.lamps.iter().filter(|lamp| lamp.is_changed()).count();
    ui.horizontal(|ui| {
        ui.label(theme::title("Lights"));
        ui.label(theme::faint(format!(
            "{} lamps",
            table::thousands(stage.lamps.len() as u64)
        )));
        if changed > 0 && ui.small_button(format!("undo {changed}")).clicked() {
            actions.push(Action::RelightAll);
        }
    });
    if let Some(selected) = stage.selected {
        editor(ui, selected, &stage.lamps[selected], actions);
    }
    ui.add(
        egui::TextEdit::singleline(&mut app.panels.filter)
            .hint_text("search by name")
            .desired_width(f32::INFINITY),
    );
    let order = order(stage, &app.panels.filter);
    let most = stage
        .lamps
        .iter()
        .filter_map(|lamp| lamp.importance)
        .fold(0.0, f64::max);
    ui.horizontal(|ui| {
        ui.label(theme::faint("lamp"));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(theme::faint("share of draws"));
        });
    });
    ScrollArea::vertical()
        .auto_shrink([false, false])
        .show_rows(ui, ROW, order.len(), |ui, rows| {
            for &lamp in &order[rows] {
                row(ui, lamp, stage, most, actions);
            }
        });
}

/// Which lamps are listed: by importance, where that is known, else by power.
fn order(stage: &Stage, filter: &str) -> Vec<usize> {
    let lamps = &stage.lamps;
    let filter = filter.to_lowercase();
    let mut order: Vec<usize> = (0..lamps.len())
        .filter(|&lamp| lamps[lamp].name.to_lowercase().contains(&filter))
        .collect();
    let key = |lamp: usize| lamps[lamp].importance.unwrap_or(0.0);
    order.sort_by(|&a, &b| key(b).total_cmp(&key(a)));
    order.truncate(MOST_ROWS);
    order
}

/// A lamp of the list.
fn row(ui: &mut egui::Ui, index: usize, stage: &Stage, most: f64, actions: &mut Vec<Action>) {
    let lamp = &stage.lamps[index];
    ui.horizontal(|ui| {
        ui.set_height(ROW);
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.spacing_mut().button_padding = egui::vec2(4.0, 1.0);
        let mut on = lamp.is_on();
        if ui.checkbox(&mut on, "").on_hover_text("on, off").changed() {
            actions.push(Action::Relight(index, if on { Vec3::ONE } else { Vec3::ZERO }));
        }
        swatch(ui, lamp.color * lamp.factor);
        let selected = stage.selected == Some(index);
        let name = if lamp.name.is_empty() { "(no name)" } else { &lamp.name };
        let label = egui::Button::selectable(selected, name).truncate();
        let width = (ui.available_width() - 104.0).max(40.0);
        let left = egui::Layout::left_to_right(egui::Align::Center);
        let clicked = ui.allocate_ui_with_layout(egui::vec2(width, ROW), left, |ui| {
            ui.set_width(width);
            ui.add(label).clicked()
        });
        if clicked.inner {
            actions.push(Action::Select((!selected).then_some(index)));
        }
        let share = lamp.importance.unwrap_or(0.0);
        ui.label(theme::figure(match lamp.importance {
            Some(share) => format!("{:5.1} %", share * 100.0),
            None => "      -".into(),
        }));
        let (bar, _) = ui.allocate_exact_size(egui::vec2(40.0, 8.0), egui::Sense::hover());
        ui.painter().rect_filled(bar, 2.0, Color32::from_gray(38));
        let filled = if most > 0.0 { (share / most) as f32 } else { 0.0 };
        let filled = egui::Rect::from_min_size(bar.min, egui::vec2(bar.width() * filled, bar.height()));
        ui.painter().rect_filled(filled, 2.0, theme::ACCENT);
    });
}

/// What can be done to the lamp that is marked.
fn editor(ui: &mut egui::Ui, index: usize, lamp: &Lamp, actions: &mut Vec<Action>) {
    egui::Frame::new()
        .fill(Color32::from_rgb(27, 31, 37))
        .corner_radius(6)
        .inner_margin(8)
        .show(ui, |ui| {
            ui.label(theme::title(&lamp.name));
            let place = lamp.position_ws.map_or("infinitely far away".into(), |p| {
                format!("{:.2} {:.2} {:.2} m", p.x, p.y, p.z)
            });
            ui.label(theme::faint(format!(
                "{:?}, {} light{}, power {:.4}, at {place}",
                lamp.kind,
                lamp.lights.len(),
                if lamp.lights.len() == 1 { "" } else { "s" },
                lamp.power,
            )));
            // Power is the largest channel, colour the channels relative to it.
            let power = lamp.factor.max_element();
            let mut stops = if power > 0.0 { power.log2() } else { -10.0 };
            let tint = if power > 0.0 { lamp.factor / power } else { Vec3::ONE };
            ui.horizontal(|ui| {
                if ui.add(Slider::new(&mut stops, -10.0..=6.0).fixed_decimals(1)).changed() {
                    actions.push(Action::Relight(
                        index,
                        tint * if stops <= -10.0 { 0.0 } else { stops.exp2() },
                    ));
                }
                ui.label(theme::faint("power, stops"));
            });
            ui.horizontal(|ui| {
                let mut color = tint.to_array();
                if ui.color_edit_button_rgb(&mut color).changed() {
                    let color = Vec3::from(color).max(Vec3::splat(1e-3));
                    actions.push(Action::Relight(index, color * power));
                }
                ui.label(theme::faint("filter"));
                if lamp.is_changed() && ui.small_button("as it was").clicked() {
                    actions.push(Action::Relight(index, Vec3::ONE));
                }
            });
        });
}

fn swatch(ui: &mut egui::Ui, color: Vec3) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
    let largest = color.max_element().max(1e-6);
    let encoded = (color / largest).powf(1.0 / 2.2) * largest.min(1.0).sqrt();
    let [r, g, b] = (encoded * 255.0).to_array().map(|v| v as u8);
    ui.painter()
        .circle_filled(rect.center(), 5.0, Color32::from_rgb(r, g, b));
}
