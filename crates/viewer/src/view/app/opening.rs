//! The window and what draws it come into being, and again where the graphics driver has failed.

use super::App;
use crate::exit::Refusal;
use crate::view::actions::Action;
use crate::view::display::Display;
use crate::view::panels;
use anyhow::Result;
use std::sync::Arc;
use winit::event_loop::ActiveEventLoop;
use winit::window::{Window, WindowAttributes};

/// If a device that has replaced another is lost before it has drawn so many frames, the next would fare no better. Higher values give up
/// sooner.
const WORTH_REPLACING: u64 = 60;

impl App {
    /// Opens the window.
    ///
    /// # Errors
    /// [`Refusal::NoGpu`] if the system gives no window, or nothing can draw to it.
    pub(in crate::view) fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let (width, height) = self.window_size;
        let attributes = WindowAttributes::default()
            .with_title("manylight")
            .with_inner_size(winit::dpi::PhysicalSize::new(width, height));
        let window = event_loop
            .create_window(attributes)
            .map_err(|error| Refusal::NoGpu(format!("the system gives no window ({error})")))?;
        let window = Arc::new(window);
        self.open_display(event_loop, &window)?;
        let size = window.inner_size();
        self.window = Some(window);
        self.resize(size.width, size.height);
        Ok(())
    }

    /// Prepares for drawing, and for input to the panels.
    fn open_display(&mut self, event_loop: &ActiveEventLoop, window: &Arc<Window>) -> Result<()> {
        let display = Display::new(event_loop, window.clone())?;
        self.egui_input = Some(egui_winit::State::new(
            self.egui.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(window.scale_factor() as f32),
            None,
            Some(display.max_texture_side()),
        ));
        self.display = Some(display);
        Ok(())
    }

    /// The device that draws is lost: goes on with another one.
    ///
    /// # Errors
    /// [`Refusal::OutOfMemory`] if there is none, or if this happens again and again.
    pub(in crate::view) fn replace_display(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let lost = |why: &str| {
            Refusal::OutOfMemory(format!(
                "the graphics device was lost or is out of memory{why}; start again, or use `manylight render`, which needs none"
            ))
        };
        // A window is drawn to by one at a time: the old one goes first.
        let (Some(display), Some(window)) = (self.display.take(), self.window.clone()) else {
            return Ok(());
        };
        let drawn = display.frames();
        drop(display);
        if std::mem::replace(&mut self.replaced, true) && drawn < WORTH_REPLACING {
            return Err(lost(", and soon after so was the next").into());
        }
        // What the panels have drawn with was in the lost device's memory: they begin anew.
        self.egui = egui::Context::default();
        panels::use_theme(&self.egui);
        self.open_display(event_loop, &window)
            .map_err(|error| lost(&format!(" ({error:#})")))?;
        let (width, height) = self.size;
        if let Some(display) = &mut self.display {
            display.resize(width, height);
        }
        self.say("the graphics device was lost; the window goes on with another one");
        // The picture went with it.
        self.act(event_loop, Action::Show(self.view));
        Ok(())
    }
}
