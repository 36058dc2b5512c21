//! Colours and frames.

use egui::{Color32, CornerRadius, Frame, Margin, RichText, Stroke};

/// Width of the panel at the right edge, points.
pub(super) const SIDE_WIDTH: f32 = 330.0;
/// Width of a window in which cards find room beside that panel, points.
pub(super) const ROOM_FOR_SIDE: f32 = 640.0;
/// Distance of cards from the edges of the window, points.
pub(super) const MARGIN: f32 = 12.0;
/// What is selected or active.
pub(super) const ACCENT: Color32 = Color32::from_rgb(120, 190, 200);
/// What needs attention.
pub(super) const WARM: Color32 = Color32::from_rgb(240, 178, 92);
const TEXT: Color32 = Color32::from_rgb(206, 211, 218);
const BRIGHT: Color32 = Color32::from_rgb(240, 243, 247);
const FAINT: Color32 = Color32::from_rgb(138, 146, 158);
const CARD: Color32 = Color32::from_rgba_premultiplied(15, 17, 21, 224);
const BUTTON: Color32 = Color32::from_rgb(43, 48, 57);
const BUTTON_HOVERED: Color32 = Color32::from_rgb(56, 63, 74);
const SELECTED: Color32 = Color32::from_rgb(40, 78, 86);

/// A calm dark theme.
pub(in super::super) fn use_theme(egui: &egui::Context) {
    egui.set_theme(egui::Theme::Dark);
    egui.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(8.0, 5.0);
        style.spacing.button_padding = egui::vec2(8.0, 3.0);
        style.spacing.slider_width = 136.0;
        style.interaction.selectable_labels = false;
        let visuals = &mut style.visuals;
        visuals.override_text_color = Some(TEXT);
        visuals.window_fill = Color32::from_rgb(20, 22, 27);
        visuals.panel_fill = CARD;
        visuals.window_stroke = Stroke::new(1.0, Color32::from_rgb(48, 53, 62));
        visuals.window_corner_radius = CornerRadius::same(8);
        visuals.extreme_bg_color = Color32::from_rgb(11, 12, 15);
        visuals.selection.bg_fill = SELECTED;
        visuals.selection.stroke = Stroke::new(1.0, BRIGHT);
        visuals.hyperlink_color = ACCENT;
        for widget in [&mut visuals.widgets.inactive, &mut visuals.widgets.open] {
            widget.weak_bg_fill = BUTTON;
            widget.bg_fill = BUTTON;
        }
        visuals.widgets.hovered.weak_bg_fill = BUTTON_HOVERED;
        visuals.widgets.hovered.bg_fill = BUTTON_HOVERED;
        visuals.widgets.active.weak_bg_fill = SELECTED;
        visuals.widgets.active.bg_fill = SELECTED;
    });
}

/// A card over the picture.
pub(super) fn card() -> Frame {
    Frame::new()
        .fill(CARD)
        .corner_radius(8)
        .inner_margin(Margin::symmetric(12, 9))
}

/// The frame of the panel at the edge.
pub(super) fn side_frame() -> Frame {
    Frame::new().fill(CARD).inner_margin(Margin::symmetric(14, 12))
}

/// A title.
pub(super) fn title(text: &str) -> RichText {
    RichText::new(text).strong().size(14.5).color(BRIGHT)
}

/// A heading between groups.
pub(super) fn heading(ui: &mut egui::Ui, text: &str) {
    ui.add_space(7.0);
    ui.label(RichText::new(text).size(11.5).color(ACCENT));
}

/// Text of lesser weight.
pub(super) fn faint(text: impl Into<String>) -> RichText {
    RichText::new(text).size(11.5).color(FAINT)
}

/// Figures, so that they stand still while they change.
pub(super) fn figure(text: impl Into<String>) -> RichText {
    RichText::new(text).monospace().size(12.0)
}
