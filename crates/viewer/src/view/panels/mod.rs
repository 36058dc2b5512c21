//! What lies over the picture: figures, settings, lights, the inspected pixel, messages.

mod dialogs;
mod inspected;
mod lights;
mod notes;
mod overlay;
mod settings;
mod theme;

use super::actions::Action;
use super::app::App;
pub(super) use theme::use_theme;

/// What is open.
#[derive(Clone, Debug)]
pub(super) struct PanelState {
    pub(super) help: bool,
    pub(super) settings: bool,
    pub(super) lights: bool,
    pub(super) overlay: bool,
    pub(super) open_dialog: bool,
    /// Nothing but the picture.
    pub(super) hidden: bool,
    /// What went wrong, until it is closed.
    pub(super) error: Option<String>,
    /// What is typed in the dialog.
    pub(super) path: String,
    /// Lamps whose name has this in it are listed.
    pub(super) filter: String,
}

impl Default for PanelState {
    fn default() -> Self {
        Self {
            help: false,
            settings: false,
            lights: false,
            overlay: true,
            open_dialog: false,
            hidden: false,
            error: None,
            path: String::new(),
            filter: String::new(),
        }
    }
}

/// Lays everything out; what the user asks for goes to `actions`.
pub(super) fn show(ui: &mut egui::Ui, app: &mut App, actions: &mut Vec<Action>) {
    let context = ui.ctx().clone();
    let side_open = !app.panels.hidden && (app.panels.settings || app.panels.lights);
    if side_open {
        side(ui, app, actions);
    }
    inspected::markers(&context, app, ui.available_rect_before_wrap());
    if !app.panels.hidden {
        // In a narrow window what was opened last is what matters.
        if !side_open || context.content_rect().width() >= theme::ROOM_FOR_SIDE {
            if app.panels.overlay {
                overlay::show(&context, app);
            }
            inspected::card(&context, app);
        }
        notes::legend(&context, app);
        notes::messages(&context, app);
        dialogs::help(&context, app, actions);
    }
    notes::loading(&context, app);
    dialogs::open(&context, app, actions);
    dialogs::error(&context, app);
}

/// The panel at the right edge: settings, then lights.
fn side(ui: &mut egui::Ui, app: &mut App, actions: &mut Vec<Action>) {
    egui::Panel::right("side")
        .exact_size(theme::SIDE_WIDTH)
        .frame(theme::side_frame())
        .show(ui, |ui| {
            if app.panels.settings {
                settings::show(ui, app, actions);
            }
            if app.panels.lights {
                if app.panels.settings {
                    ui.add_space(10.0);
                }
                lights::show(ui, app, actions);
            }
        });
}
