//! Lines at the bottom of the window, and what is being loaded.

use super::super::app::App;
use super::super::views::View;
use super::theme;
use egui::{Align2, Area, Id, RichText, vec2};

/// What a debug view shows, with range and unit.
pub(super) fn legend(context: &egui::Context, app: &App) {
    if app.view == View::Image {
        return;
    }
    let area = Area::new(Id::unique("legend")).anchor(Align2::CENTER_TOP, vec2(0.0, theme::MARGIN));
    area.interactable(false).show(context, |ui| {
        theme::card().show(ui, |ui| {
            ui.vertical_centered(|ui| {
                ui.set_max_width(330.0);
                ui.label(theme::title(&format!(
                    "{}: {}",
                    app.view.name(),
                    app.view.description()
                )));
                ui.label(theme::faint(app.legend.clone()));
            });
        });
    });
}

/// What has happened lately.
pub(super) fn messages(context: &egui::Context, app: &App) {
    let recording = app
        .driver
        .recording
        .as_ref()
        .map(|path| format!("recording: {} frames", path.len()));
    let playing = app
        .driver
        .playing
        .map(|at| format!("playing: frame {at} of {}", app.driver.path.len()));
    let now: Vec<String> = recording.into_iter().chain(playing).collect();
    if app.messages.is_empty() && now.is_empty() {
        return;
    }
    let area = Area::new(Id::unique("messages")).anchor(Align2::CENTER_BOTTOM, vec2(0.0, -theme::MARGIN));
    area.interactable(false).show(context, |ui| {
        theme::card().show(ui, |ui| {
            ui.set_max_width(460.0);
            for text in now {
                ui.label(RichText::new(text).color(theme::WARM));
            }
            for (_, text) in app.messages.iter().rev().take(4).rev() {
                ui.label(text);
            }
        });
    });
}

/// That a scene is on its way.
pub(super) fn loading(context: &egui::Context, app: &App) {
    let Some((what, since)) = &app.loading else { return };
    Area::new(Id::unique("loading"))
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(context, |ui| {
            theme::card().show(ui, |ui| {
                ui.horizontal(|ui| {
                    ui.spinner();
                    ui.label(format!("loading {what}: {:.0} s", since.elapsed().as_secs_f64()));
                });
            });
        });
}
