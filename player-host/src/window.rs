//! The simulator window: winit events in, the stage's canvas on the screen.
//! A `Stage` comes in; pixels go to a softbuffer surface and, on request, to PNG files.

use crate::canvas::{Canvas, to_image};
use crate::files::write_png;
use crate::keys;
use crate::stage::{Stage, Wish};
use anyhow::{Context as _, Result, anyhow};
use softbuffer::{Context, Surface};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle};
use winit::window::{Window, WindowId};

/// Room for the picture when the screen does not tell its size.
pub const DEFAULT_ROOM: (u32, u32) = (960, 720);

/// Connects to the display; the error says why there is none.
pub fn connect() -> Result<EventLoop<()>> {
    let needs_server = cfg!(all(unix, not(target_os = "macos")));
    let set = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    if needs_server && !set("DISPLAY") && !set("WAYLAND_DISPLAY") {
        return Err(anyhow!("neither DISPLAY nor WAYLAND_DISPLAY is set"));
    }
    // winit puts the place in its own source before the reason.
    EventLoop::new().map_err(|e| anyhow!("{}", e.to_string().rsplit(": ").next().unwrap_or("the window system does not answer")))
}

/// Shows `stage` until the window is closed or, with `limit`, until that many pictures have been shown one frame after the other;
/// the last of these goes to `shot`.
pub fn run(events: EventLoop<()>, stage: Stage<'_>, title: &str, limit: Option<u32>, shot: Option<&Path>) -> Result<()> {
    let context = Context::new(events.owned_display_handle()).map_err(|e| anyhow!("the display cannot be drawn on: {e}"))?;
    let mut app = App {
        stage,
        title: title.to_owned(),
        limit,
        shot: shot.map(Path::to_owned),
        clock: if limit.is_some() { Clock::Stepped(Duration::ZERO) } else { Clock::Running(Instant::now()) },
        context,
        surface: None,
        canvas: None,
        pointer: (0.0, 0.0),
        pictures: 0,
        failure: None,
    };
    events.run_app(&mut app).context("the window system failed")?;
    app.failure.map_or(Ok(()), Err)
}

/// Where the time comes from: the wall, or one step for each picture so that pictures can be counted.
enum Clock {
    Running(Instant),
    Stepped(Duration),
}

struct App<'a> {
    stage: Stage<'a>,
    title: String,
    limit: Option<u32>,
    shot: Option<PathBuf>,
    clock: Clock,
    context: Context<OwnedDisplayHandle>,
    surface: Option<Surface<OwnedDisplayHandle, Rc<Window>>>,
    canvas: Option<Canvas>,
    pointer: (f64, f64),
    pictures: u32,
    failure: Option<anyhow::Error>,
}

impl App<'_> {
    fn now(&self) -> Duration {
        match self.clock {
            Clock::Running(start) => start.elapsed(),
            Clock::Stepped(now) => now,
        }
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let monitor = events.primary_monitor().or_else(|| events.available_monitors().next());
        let room = monitor.as_ref().map(|m| m.size()).filter(|s| s.width > 0 && s.height > 0);
        let room = room.map_or(DEFAULT_ROOM, |s| (s.width / 4 * 3, s.height / 4 * 3));
        let ui = points(monitor.map_or(1.0, |m| m.scale_factor()));
        let (width, height) = self.stage.natural_size(room, ui, self.now());
        let attributes = Window::default_attributes().with_title(&self.title).with_inner_size(PhysicalSize::new(width, height));
        let window = Rc::new(events.create_window(attributes).context("the window cannot be opened")?);
        let surface = Surface::new(&self.context, window.clone()).map_err(|e| anyhow!("the window cannot be drawn on: {e}"))?;
        window.request_redraw();
        self.surface = Some(surface);
        let now = self.now();
        self.stage.start(now);
        Ok(())
    }

    /// Draws the stage into the window; with a limit, counts the picture and steps the clock.
    fn draw(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let now = self.now();
        let Some(surface) = &mut self.surface else { return Ok(()) };
        let size = surface.window().inner_size();
        let (Some(width), Some(height)) = (NonZeroU32::new(size.width), NonZeroU32::new(size.height)) else { return Ok(()) };
        let ui = points(surface.window().scale_factor());
        if self.canvas.as_ref().is_none_or(|c| c.size() != (size.width, size.height)) {
            self.canvas = Canvas::new(size.width, size.height);
        }
        let canvas = self.canvas.as_mut().with_context(|| format!("a window of {width} x {height} pixels is too large to draw"))?;
        self.stage.compose(canvas, ui, now);
        surface.resize(width, height).map_err(|e| anyhow!("the window's buffer cannot be resized to {width} x {height}: {e}"))?;
        let mut buffer = surface.buffer_mut().map_err(|e| anyhow!("the window's buffer cannot be reached: {e}"))?;
        canvas.present(&mut buffer);
        let Some(limit) = self.limit else {
            return buffer.present().map_err(|e| anyhow!("the window cannot be drawn: {e}"));
        };
        self.pictures += 1;
        let last = self.pictures >= limit;
        let shot = self.shot.as_ref().filter(|_| last).map(|path| (path, to_image(&buffer, size.width, size.height)));
        buffer.present().map_err(|e| anyhow!("the window cannot be drawn: {e}"))?;
        if let Some((path, image)) = shot {
            write_png(path, &image)?;
        }
        if last {
            events.exit();
            return Ok(());
        }
        self.clock = Clock::Stepped(self.stage.deadline(now).unwrap_or(now));
        surface.window().request_redraw();
        Ok(())
    }

    fn screenshot(&mut self) {
        let now = self.now();
        let (picture, number) = self.stage.frame();
        let name = format!("frame-{number:04}.png");
        let message = match write_png(Path::new(&name), &picture.to_rgb(1)) {
            Ok(()) => format!("saved {name}"),
            Err(error) => format!("{error:#}"),
        };
        self.stage.say(message, now);
    }

    fn fail_on(&mut self, result: Result<()>, events: &ActiveEventLoop) {
        if let Err(error) = result {
            self.failure = Some(error);
            events.exit();
        }
    }
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.surface.is_none() {
            let opened = self.open(events);
            self.fail_on(opened, events);
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let now = self.now();
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => events.exit(),
            WindowEvent::RedrawRequested => {
                let drawn = self.draw(events);
                self.fail_on(drawn, events);
            }
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } | WindowEvent::Occluded(false) => self.stage.spoil(),
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                match keys::action(&event.logical_key, event.repeat).map(|a| self.stage.act(a, now)) {
                    Some(Wish::Quit) => events.exit(),
                    Some(Wish::Screenshot) => self.screenshot(),
                    Some(Wish::Nothing) | None => {}
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.pointer = (position.x, position.y);
                self.stage.drag(position.x, now);
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => match state {
                ElementState::Pressed => self.stage.press(self.pointer.0, self.pointer.1, now),
                ElementState::Released => self.stage.release(now),
            },
            _ => {}
        }
    }

    /// Runs after every event, so it asks for a picture only when one is due and sleeps until the next.
    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Clock::Running(start) = self.clock else { return };
        let now = self.now();
        if self.stage.outdated(now)
            && let Some(surface) = &self.surface
        {
            surface.window().request_redraw();
        }
        events.set_control_flow(self.stage.deadline(now).map_or(ControlFlow::Wait, |next| ControlFlow::WaitUntil(start + next)));
    }
}

/// Whole canvas pixels to a point at a display's scale factor.
fn points(scale_factor: f64) -> u32 {
    scale_factor.round().clamp(1.0, 8.0) as u32
}
