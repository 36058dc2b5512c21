//! What the system tells the window: input, size, focus, files dropped on it.

use super::actions::{Action, With, action_of};
use super::app::{App, Event};
use glam::Vec2;
use winit::application::ApplicationHandler;
use winit::event::{DeviceEvent, DeviceId, ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::PhysicalKey;
use winit::window::{CursorGrabMode, WindowId};

/// Pixels of a touchpad that count as one notch of a wheel.
const PIXELS_PER_NOTCH: f64 = 40.0;

impl ApplicationHandler<Event> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none()
            && let Err(error) = self.open_window(event_loop)
        {
            self.fail(event_loop, error);
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, event: Event) {
        self.hear(event_loop, event);
    }

    fn about_to_wait(&mut self, _: &ActiveEventLoop) {
        if self.wakes_now() {
            self.request_frame();
        }
    }

    /// The mouse itself, whatever the pointer does at the edge of the screen.
    fn device_event(&mut self, event_loop: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let DeviceEvent::MouseMotion { delta: (x, y) } = event
            && self.looking
        {
            self.act(event_loop, Action::Look(Vec2::new(x as f32, y as f32)));
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        // Keys are for walking unless text is being typed; everything else is for the panels first.
        let typing = self.egui.egui_wants_keyboard_input();
        let is_key = matches!(event, WindowEvent::KeyboardInput { .. });
        let mut taken = false;
        if (!is_key || typing)
            && let (Some(input), Some(window)) = (&mut self.egui_input, &self.window)
        {
            let response = input.on_window_event(window, &event);
            taken = response.consumed;
            if response.repaint && !matches!(event, WindowEvent::RedrawRequested) {
                window.request_redraw();
            }
        }
        match event {
            WindowEvent::RedrawRequested => self.frame(event_loop),
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => self.resize(size.width, size.height),
            WindowEvent::Occluded(_) | WindowEvent::ScaleFactorChanged { .. } => self.request_frame(),
            WindowEvent::Focused(false) => {
                self.fly.release_all();
                self.look_around(false);
            }
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::DroppedFile(path) => self.act(event_loop, Action::Open(path.display().to_string())),
            WindowEvent::KeyboardInput {
                event:
                    KeyEvent {
                        physical_key: PhysicalKey::Code(key),
                        state,
                        repeat,
                        ..
                    },
                is_synthetic: false,
                ..
            } if !typing || state == ElementState::Released => {
                let with = self.with();
                if let Some(action) = action_of(key, with, state == ElementState::Pressed)
                    && (!repeat || matches!(action, Action::Expose(_)))
                {
                    self.act(event_loop, action);
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                let scale = self.egui.pixels_per_point();
                self.pointer = Some(egui::pos2(position.x as f32 / scale, position.y as f32 / scale));
            }
            WindowEvent::MouseInput { state, button, .. } => {
                self.mouse_button(event_loop, button, state == ElementState::Pressed, taken);
            }
            WindowEvent::MouseWheel { delta, .. } if !taken => {
                let notches = match delta {
                    MouseScrollDelta::LineDelta(_, lines) => lines,
                    MouseScrollDelta::PixelDelta(pixels) => (pixels.y / PIXELS_PER_NOTCH) as f32,
                };
                self.act(event_loop, Action::Speed(notches));
            }
            _ => {}
        }
    }
}

impl App {
    fn with(&self) -> With {
        match (self.modifiers.control_key(), self.modifiers.alt_key()) {
            (true, _) => With::Ctrl,
            (_, true) => With::Alt,
            _ => With::Nothing,
        }
    }

    /// The right button looks around, the left one inspects; `taken`: it was meant for a panel.
    fn mouse_button(&mut self, event_loop: &ActiveEventLoop, button: MouseButton, down: bool, taken: bool) {
        match (button, down) {
            (MouseButton::Right, true) if !taken => self.look_around(true),
            (MouseButton::Right, false) => self.look_around(false),
            (MouseButton::Left, true) if !taken => {
                let Some(at) = self.pointer else { return };
                let scale = self.egui.pixels_per_point();
                let size = Vec2::new(self.size.0.max(1) as f32, self.size.1.max(1) as f32);
                self.act(event_loop, Action::Inspect(Vec2::new(at.x, at.y) * scale / size));
            }
            _ => {}
        }
    }

    /// Takes the pointer, or gives it back. Where the system does not hold it, turning works until the edge of the screen.
    fn look_around(&mut self, looking: bool) {
        self.looking = looking;
        let Some(window) = &self.window else { return };
        if looking {
            let held = window.set_cursor_grab(CursorGrabMode::Locked);
            let _ = held.or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined));
        } else {
            let _ = window.set_cursor_grab(CursorGrabMode::None);
        }
        window.set_cursor_visible(!looking);
    }
}
