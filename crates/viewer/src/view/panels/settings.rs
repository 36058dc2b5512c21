//! The settings.

use super::super::actions::{Action, Part};
use super::super::app::App;
use super::super::views::View;
use super::theme;
use crate::cli::{self, Backend};
use egui::{ComboBox, Slider};
use render::{MAX_LIGHT_SAMPLES, Method};

/// Lays them out.
pub(super) fn show(ui: &mut egui::Ui, app: &mut App, actions: &mut Vec<Action>) {
    ui.label(theme::title("Settings"));
    theme::heading(ui, "Light choice");
    sampler(ui, app.settings.method, actions);
    let mut samples = app.settings.light_samples;
    if slider(
        ui,
        "lights per surface",
        Slider::new(&mut samples, 1..=MAX_LIGHT_SAMPLES),
    ) {
        actions.push(Action::LightSamples(samples));
    }
    let mut bounces = app.settings.max_bounces;
    if slider(ui, "bounces", Slider::new(&mut bounces, 0..=8)) {
        actions.push(Action::Bounces(bounces));
    }

    theme::heading(ui, "Rendered on");
    ui.horizontal(|ui| {
        for (backend, name) in [(Backend::Cpu, "CPU"), (Backend::Gpu, "GPU")] {
            if ui.selectable_label(app.backend == backend, name).clicked() {
                actions.push(Action::Device(backend));
            }
        }
    });

    theme::heading(ui, "Picture");
    let mut budget_ms = app.budget_ms;
    if slider(
        ui,
        "ms while moving",
        Slider::new(&mut budget_ms, 5.0..=250.0)
            .logarithmic(true)
            .fixed_decimals(0),
    ) {
        actions.push(Action::Budget(budget_ms));
    }
    let mut automatic = app.exposure.automatic;
    let before = if automatic {
        app.exposure.offset
    } else {
        app.exposure.now
    };
    let mut stops = before;
    let range = if automatic { -8.0..=8.0 } else { -20.0..=20.0 };
    if slider(
        ui,
        if automatic {
            "brighter, stops"
        } else {
            "exposure, stops"
        },
        Slider::new(&mut stops, range),
    ) {
        actions.push(Action::Expose(stops - before));
    }
    let mut denoise = app.denoise;
    if ui
        .checkbox(&mut denoise, "noise taken away, for the eyes only")
        .changed()
    {
        actions.push(Action::Denoise);
    }
    if ui.checkbox(&mut automatic, "exposure follows the picture").changed() {
        actions.push(Action::AutoExposure);
    }

    theme::heading(ui, "View");
    ui.horizontal_wrapped(|ui| {
        for view in View::ALL {
            let button = ui.selectable_label(app.view == view, view.name());
            if button.on_hover_text(view.description()).clicked() {
                actions.push(Action::Show(view));
            }
        }
    });

    theme::heading(ui, "Bookmarks");
    ui.horizontal_wrapped(|ui| {
        for number in app.bookmarks.keys() {
            if ui.button(number.to_string()).clicked() {
                actions.push(Action::Recall(*number));
            }
        }
        let free = (1..=9).find(|number| !app.bookmarks.contains_key(number));
        if let Some(number) = free
            && ui.button(format!("store {number}")).clicked()
        {
            actions.push(Action::Store(number));
        }
    });

    ui.add_space(8.0);
    ui.horizontal_wrapped(|ui| {
        for (text, action) in [
            ("Open ...", Action::Toggle(Part::OpenDialog)),
            ("Lights", Action::Toggle(Part::Lights)),
            ("Screenshot", Action::Screenshot),
            ("Keys", Action::Toggle(Part::Help)),
        ] {
            if ui.button(text).clicked() {
                actions.push(action);
            }
        }
    });
}

fn sampler(ui: &mut egui::Ui, now: Method, actions: &mut Vec<Action>) {
    let list = ComboBox::from_id_salt("sampler").selected_text(now.name()).width(200.0);
    list.show_ui(ui, |ui| {
        for method in Method::all() {
            let entry = ui.selectable_label(now == method, method.name());
            if entry.on_hover_text(cli::describe(method)).clicked() {
                actions.push(Action::Sample(method));
            }
        }
    });
    ui.label(theme::faint(cli::describe(now)));
}

/// A slider with its name; whether it was moved.
fn slider(ui: &mut egui::Ui, name: &str, slider: Slider<'_>) -> bool {
    ui.horizontal(|ui| {
        let changed = ui.add(slider).changed();
        ui.label(theme::faint(name));
        changed
    })
    .inner
}
