//! Windows in the middle: keys, opening a scene, what went wrong.

use super::super::actions::{Action, HELP};
use super::super::app::App;
use super::theme;
use egui::{Align2, RichText, Window, vec2};

/// Generated scenes that the dialog offers.
const DEMOS: [&str; 5] = [
    "demo:rooms",
    "demo:points",
    "demo:plaza",
    "demo:sun-outside",
    "demo:keyhole",
];

/// All keys.
pub(super) fn help(context: &egui::Context, app: &mut App, actions: &mut Vec<Action>) {
    let mut open = app.panels.help;
    let window = Window::new("Keys")
        .open(&mut open)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0));
    let window = window
        .resizable(false)
        .collapsible(false)
        .scroll(true)
        .default_size(vec2(630.0, 530.0));
    window.show(context, |ui| {
        ui.horizontal_top(|ui| {
            for half in HELP.chunks(2) {
                ui.vertical(|ui| {
                    ui.set_width(300.0);
                    for (topic, lines) in half {
                        theme::heading(ui, topic);
                        egui::Grid::new(topic)
                            .num_columns(2)
                            .spacing(vec2(14.0, 4.0))
                            .show(ui, |ui| {
                                for line in *lines {
                                    ui.label(RichText::new(line.keys).monospace().color(theme::WARM));
                                    ui.label(line.what);
                                    ui.end_row();
                                }
                            });
                    }
                });
            }
        });
        ui.add_space(8.0);
        if ui.button("Close").clicked() {
            actions.push(Action::Close);
        }
    });
    app.panels.help = open && app.panels.help;
}

/// Asks for a scene.
pub(super) fn open(context: &egui::Context, app: &mut App, actions: &mut Vec<Action>) {
    let mut open = app.panels.open_dialog;
    let mut chosen = None;
    let window = Window::new("Open a scene")
        .open(&mut open)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, -40.0));
    window.resizable(false).collapsible(false).show(context, |ui| {
        ui.set_width(420.0);
        ui.label("A .gltf or .glb file, or demo:NAME[:LIGHTS[:SEED]]. Files can also be dropped on the window.");
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            let edit = egui::TextEdit::singleline(&mut app.panels.path)
                .desired_width(330.0)
                .hint_text("hall.glb");
            let entered = ui.add(edit).lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            if (ui.button("Open").clicked() || entered) && !app.panels.path.trim().is_empty() {
                chosen = Some(app.panels.path.trim().to_owned());
            }
        });
        let recent = app.remembered.as_ref().map_or(&[][..], |remembered| &remembered.recent);
        if !recent.is_empty() {
            theme::heading(ui, "Recent");
            for what in recent {
                if ui.link(what).clicked() {
                    chosen = Some(what.clone());
                }
            }
        }
        theme::heading(ui, "Nothing to download");
        ui.horizontal_wrapped(|ui| {
            for demo in DEMOS {
                if ui.button(demo).clicked() {
                    chosen = Some(demo.to_owned());
                }
            }
        });
    });
    app.panels.open_dialog = open && chosen.is_none();
    actions.extend(chosen.map(Action::Open));
}

/// What went wrong, until it is closed.
pub(super) fn error(context: &egui::Context, app: &mut App) {
    let Some(text) = app.panels.error.clone() else { return };
    let window = Window::new("This did not work").anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0));
    window.resizable(false).collapsible(false).show(context, |ui| {
        ui.set_max_width(460.0);
        ui.label(RichText::new(text).color(theme::WARM));
        ui.add_space(6.0);
        if ui.button("Close").clicked() {
            app.panels.error = None;
        }
    });
}
