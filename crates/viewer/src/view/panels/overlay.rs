//! The figures in the corner.

use super::super::app::App;
use super::super::frame_times::Recent;
use super::super::views::View;
use super::theme;
use crate::{machine, table};
use egui::{Align2, Area, Id, Sense, Stroke, vec2};

/// Width of the curve of frame times.
const CURVE: egui::Vec2 = vec2(226.0, 30.0);

/// Shows them.
pub(super) fn show(context: &egui::Context, app: &App) {
    let area = Area::new(Id::unique("overlay")).anchor(Align2::LEFT_TOP, vec2(theme::MARGIN, theme::MARGIN));
    area.interactable(false).show(context, |ui| {
        theme::card().show(ui, |ui| {
            ui.set_max_width(250.0);
            ui.spacing_mut().item_spacing.y = 2.0;
            ui.spacing_mut().interact_size.y = 13.0;
            figures(ui, app);
        });
    });
}

fn figures(ui: &mut egui::Ui, app: &App) {
    let figures = &app.figures;
    let name = app
        .stage
        .as_ref()
        .map_or("no scene", |stage| stage.scene.parts.name.as_str());
    ui.label(theme::title(name));
    let state = match (app.paused, figures.still) {
        (true, _) => "paused",
        (_, true) => "refining",
        (_, false) => "moving",
    };
    let noise = if app.denoise && app.view == View::Image {
        ", denoised"
    } else {
        ""
    };
    ui.label(theme::faint(format!("{}, {state}{noise}", app.settings.method.name())));

    ui.add_space(3.0);
    if let Some(times) = app.times.render.summary() {
        row(ui, "frame", format!("{:.0} ms", figures.frame_ms));
        row(
            ui,
            "min p95 max",
            format!("{:.0} {:.0} {:.0} ms", times.min, times.p95, times.max),
        );
        curve(ui, &app.times.render, app.budget_ms);
        let stages = figures.stages;
        row(ui, "trace, learn", milliseconds(&[stages.trace_ms, stages.learn_ms]));
        if figures.on_gpu {
            row(ui, "read back", milliseconds(&[stages.read_ms]));
        }
        row(
            ui,
            "history, denoise, upload",
            milliseconds(&[stages.history_ms, stages.denoise_ms, stages.upload_ms]),
        );
    }
    if let Some(latency) = app.times.latency.summary() {
        row(ui, "input to picture", format!("{:.0} ms", latency.median));
    }
    row(
        ui,
        "picture",
        format!(
            "{} x {}, {} spp",
            figures.size.0,
            figures.size.1,
            table::thousands(figures.spp)
        ),
    );
    row(ui, "rays", format!("{:.2} M/s", figures.rays_per_s * 1e-6));
    if let Some(stage) = &app.stage {
        row(ui, "lights", table::thousands(stage.scene.lights.len() as u64));
        row(ui, "triangles", table::thousands(stage.scene.triangle_count()));
    }
    if figures.cells > 0 {
        row(ui, "cells", table::thousands(figures.cells as u64));
    }
    let mebi = |bytes: u64| format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20));
    row(ui, "light sampler", mebi(figures.sampler_bytes as u64));
    row(ui, "memory", mebi(machine::rss_bytes()));
    row(ui, "speed", format!("{:.2} m/s", app.fly.speed()));
    row(
        ui,
        "exposure",
        format!(
            "{:+.1} stops{}",
            app.exposure.now,
            if app.exposure.automatic { "" } else { ", fixed" }
        ),
    );
    ui.add_space(3.0);
    let adapter = app.display.as_ref().map_or("", |display| display.adapter());
    let device = if figures.on_gpu { "GPU" } else { "CPU" };
    ui.label(theme::faint(format!("rendered on the {device}, shown by {adapter}")));
    ui.label(theme::faint("F1 all keys"));
}

/// Several times in a row, as short as they are still of use.
fn milliseconds(times: &[f64]) -> String {
    let short = |ms: &f64| {
        if *ms < 10.0 {
            format!("{ms:.1} ")
        } else {
            format!("{ms:.0} ")
        }
    };
    times.iter().map(short).collect::<String>() + "ms"
}

fn row(ui: &mut egui::Ui, what: &str, value: String) {
    ui.horizontal(|ui| {
        ui.label(theme::faint(what));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(theme::figure(value))
        });
    });
}

/// The last frame times; the line is the time that is wanted while the picture moves.
fn curve(ui: &mut egui::Ui, recent: &Recent, budget_ms: f64) {
    let (rect, _) = ui.allocate_exact_size(CURVE, Sense::hover());
    let most = budget_ms * 3.0;
    let height = |ms: f64| rect.bottom() - (ms.min(most) / most) as f32 * rect.height();
    let painter = ui.painter();
    let line = Stroke::new(1.0, theme::ACCENT.gamma_multiply(0.35));
    painter.hline(rect.x_range(), height(budget_ms), line);
    let count = recent.values().len();
    let step = rect.width() / 119.0;
    for (i, ms) in recent.values().enumerate().skip(count.saturating_sub(120)) {
        let x = rect.right() - (count - 1 - i) as f32 * step;
        let color = if ms > 1.5 * budget_ms {
            theme::WARM
        } else {
            theme::ACCENT
        };
        painter.vline(x, height(ms)..=rect.bottom(), Stroke::new(1.2, color));
    }
}
