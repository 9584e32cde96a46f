//! The stage: what the window shows at a time.
//! A `Player`, actions (`keys`), the pointer and clock readings come in; a finished canvas and the time of the next change go out.
//! `window` shows the canvas, `headless` writes it to a file: both see the same pixels.

use crate::canvas::{Canvas, Colour};
use crate::keys::Action;
use crate::overlay::{Layout, Status};
use crate::picture::{Picture, Player};
use crate::transport::{Ends, Transport};
use cubist_core::Work;
use std::collections::VecDeque;
use std::time::Duration;

const BACKGROUND: Colour = Colour([13, 15, 19, 255]);
/// How long a message stays.
const MESSAGE: Duration = Duration::from_secs(3);
/// The measured frame rate looks this far back.
const RATE_WINDOW: Duration = Duration::from_secs(1);

/// What an action asks of the window itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Nothing: the stage has done it.
    Nothing,
    /// Save the frame that shows.
    Screenshot,
    /// Close.
    Quit,
}

/// One bundle on show.
pub struct Stage<'a> {
    player: Player<'a>,
    picture: Picture,
    transport: Transport,
    zoom: Option<u32>,
    bundle_bytes: usize,
    memory: usize,
    overlay: bool,
    help: bool,
    message: Option<(String, Duration)>,
    /// The frame in `picture`, and what it took.
    drawn: Option<(u32, Work)>,
    /// When the last pictures came up, within `RATE_WINDOW`.
    times: VecDeque<Duration>,
    layout: Option<Layout>,
    stale: bool,
}

impl<'a> Stage<'a> {
    /// Plays from `now`. `bundle_bytes` and `memory` are shown; `zoom` is that of the window's first size.
    pub fn new(player: Player<'a>, bundle_bytes: usize, memory: usize, zoom: Option<u32>, now: Duration) -> Self {
        let bundle = player.bundle();
        let (width, height) = bundle.size();
        // A path that does not close turns round rather than jump.
        let ends = if bundle.looping() { Ends::Loop } else { Ends::PingPong };
        let transport = Transport::new(bundle.frames(), bundle.fps(), ends, now);
        let picture = Picture::new(width, height);
        Self {
            player,
            picture,
            transport,
            zoom,
            bundle_bytes,
            memory,
            overlay: true,
            help: false,
            message: None,
            drawn: None,
            times: VecDeque::new(),
            layout: None,
            stale: true,
        }
    }

    /// The window size for a screen with `room` pixels to spare, `ui` of them to a point.
    pub fn natural_size(&self, room: (u32, u32), ui: u32, now: Duration) -> (u32, u32) {
        let (width, height) = self.picture.size();
        let fitting = (room.0 / width.max(1)).min(room.1 / height.max(1)).clamp(1, 8);
        Layout::natural_size((width, height), ui, self.zoom.unwrap_or(fitting), &self.status(now))
    }

    /// Starts the film afresh at `now`, once the window is there.
    pub fn start(&mut self, now: Duration) {
        self.transport.jump(0, now);
    }

    /// Does what a key asks.
    pub fn act(&mut self, action: Action, now: Duration) -> Wish {
        self.stale = true;
        match action {
            Action::Play => self.transport.toggle_play(now),
            Action::Step(by) => self.transport.step(by, now),
            Action::First => self.transport.jump(0, now),
            Action::Last => self.transport.jump(u32::MAX, now),
            Action::Faster => self.transport.change_speed(true, now),
            Action::Slower => self.transport.change_speed(false, now),
            Action::Reverse => self.transport.toggle_reverse(now),
            Action::Ends => self.transport.next_ends(now),
            Action::Overlay => self.overlay = !self.overlay,
            Action::Help => self.help = !self.help,
            Action::Screenshot => return Wish::Screenshot,
            Action::Quit => return Wish::Quit,
        }
        Wish::Nothing
    }

    /// The pointer's button goes down at a canvas point: on the timeline it takes the handle.
    pub fn press(&mut self, x: f64, y: f64, now: Duration) {
        if self.layout.as_ref().is_some_and(|l| l.on_timeline(x, y)) {
            self.transport.grab(now);
            self.drag(x, now);
        }
    }

    /// The pointer moves; a held handle follows.
    pub fn drag(&mut self, x: f64, now: Duration) {
        if let (true, Some(layout)) = (self.transport.held(), &self.layout) {
            self.transport.jump(layout.frame_at(x, self.transport.frames()), now);
        }
    }

    /// The button comes up again.
    pub fn release(&mut self, now: Duration) {
        if self.transport.held() {
            self.transport.release(now);
        }
    }

    /// Shows a message for a while.
    pub fn say(&mut self, message: String, now: Duration) {
        self.message = Some((message, now + MESSAGE));
        self.stale = true;
    }

    /// The window's content is lost or has another size.
    pub fn spoil(&mut self) {
        self.stale = true;
    }

    /// Whether the canvas would change at `now`.
    pub fn outdated(&mut self, now: Duration) -> bool {
        self.transport.tick(now);
        self.stale
            || self.drawn.is_none_or(|(frame, _)| frame != self.transport.frame(now))
            || self.message.as_ref().is_some_and(|m| m.1 <= now)
    }

    /// The time at which the canvas changes next of its own accord.
    pub fn deadline(&self, now: Duration) -> Option<Duration> {
        let message = self.message.as_ref().map(|m| m.1);
        self.transport.deadline(now).into_iter().chain(message).min()
    }

    /// Draws the stage at `now` on a canvas of the window's size, `ui` of its pixels to a point.
    pub fn compose(&mut self, canvas: &mut Canvas, ui: u32, now: Duration) {
        self.transport.tick(now);
        let frame = self.transport.frame(now);
        if self.drawn.is_none_or(|d| d.0 != frame) {
            let work = self.picture.play(&mut self.player, frame);
            self.drawn = Some((frame, work));
            self.times.push_back(now);
        }
        if !self.transport.playing() || self.transport.held() {
            self.times.clear();
        }
        while self.times.front().is_some_and(|&t| t + RATE_WINDOW < now) {
            self.times.pop_front();
        }
        if self.message.as_ref().is_some_and(|m| m.1 <= now) {
            self.message = None;
        }
        let status = self.status(now);
        let layout = Layout::new(canvas.size(), self.picture.size(), ui, self.overlay.then_some(&status));
        canvas.clear(BACKGROUND);
        canvas.picture(&self.picture, layout.picture.0, layout.picture.1, layout.zoom);
        layout.draw(canvas, &status);
        if self.help {
            layout.draw_help(canvas);
        }
        if let Some((message, _)) = &self.message {
            layout.draw_message(canvas, message);
        }
        self.layout = Some(layout);
        self.stale = false;
    }

    /// The frame that shows and its number, for a file.
    pub fn frame(&self) -> (&Picture, u32) {
        (&self.picture, self.drawn.map_or(0, |d| d.0))
    }

    fn status(&self, now: Duration) -> Status {
        let (frame, work) = self.drawn.unwrap_or_default();
        let shown_fps = match (self.times.front(), self.times.back()) {
            (Some(&first), Some(&last)) if last > first => Some((self.times.len() - 1) as f64 / (last - first).as_secs_f64()),
            _ => None,
        };
        Status {
            frame,
            frames: self.transport.frames(),
            playing: self.transport.playing(),
            backwards: self.transport.backwards(now),
            speed_eighths: self.transport.speed_eighths(),
            ends: self.transport.ends(),
            shown_fps,
            fps: self.player.bundle().fps(),
            bundle_bytes: self.bundle_bytes,
            memory: self.memory,
            work,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{SIZE, bundle};
    use cubist_core::Bundle;

    const ZERO: Duration = Duration::ZERO;

    /// Runs `test` with a stage over the tests' bundle and a canvas of its natural size.
    fn on_stage(test: impl FnOnce(Stage<'_>, Canvas)) {
        let bytes = bundle();
        let parsed = Bundle::parse(&bytes).unwrap();
        let mut memory = vec![0; parsed.memory_needed()];
        let player = Player::with_texels(&parsed, &mut memory).unwrap();
        let stage = Stage::new(player, bytes.len(), parsed.memory_needed(), None, ZERO);
        let (width, height) = stage.natural_size((400, 300), 1, ZERO);
        test(stage, Canvas::new(width, height).unwrap());
    }

    #[test]
    fn a_picture_is_due_at_the_deadline_and_not_before() {
        on_stage(|mut stage, mut canvas| {
            assert!(stage.outdated(ZERO));
            stage.compose(&mut canvas, 1, ZERO);
            let due = stage.deadline(ZERO).unwrap();
            assert!(!stage.outdated(due - Duration::from_nanos(1)));
            assert!(stage.outdated(due));
            stage.compose(&mut canvas, 1, due);
            assert_eq!(stage.frame().1, 1);
            assert_eq!(stage.act(Action::Play, due), Wish::Nothing);
            stage.compose(&mut canvas, 1, due);
            assert_eq!((stage.deadline(due), stage.outdated(due + Duration::from_secs(9))), (None, false));
        });
    }

    #[test]
    fn dragging_the_timeline_scrubs_and_letting_go_plays_on() {
        on_stage(|mut stage, mut canvas| {
            stage.compose(&mut canvas, 1, ZERO);
            let (width, height) = canvas.size();
            let row = (0..height).rev().find(|&y| stage.layout.as_ref().unwrap().on_timeline(50.0, y.into())).unwrap();
            stage.press(50.0, 5.0, ZERO);
            stage.drag(f64::from(width), ZERO);
            assert!(!stage.transport.held(), "a press on the picture takes nothing");
            stage.press(f64::from(width) / 2.0, row.into(), ZERO);
            stage.compose(&mut canvas, 1, Duration::from_secs(7));
            assert_eq!(stage.frame().1, SIZE.2 / 2);
            stage.drag(f64::from(width) + 100.0, ZERO);
            stage.compose(&mut canvas, 1, ZERO);
            assert_eq!(stage.frame().1, SIZE.2 - 1);
            stage.drag(0.0, ZERO);
            stage.release(ZERO);
            stage.compose(&mut canvas, 1, Duration::from_millis(70));
            assert_eq!(stage.frame().1, 2);
        });
    }

    #[test]
    fn messages_go_away_by_themselves() {
        on_stage(|mut stage, mut canvas| {
            stage.act(Action::Play, ZERO);
            stage.compose(&mut canvas, 1, ZERO);
            let bare = canvas.at(8, 8);
            stage.say("saved".to_owned(), ZERO);
            stage.compose(&mut canvas, 1, ZERO);
            assert_ne!(canvas.at(8, 8), bare, "the plate is there");
            let end = stage.deadline(ZERO).unwrap();
            assert!(stage.outdated(end));
            stage.compose(&mut canvas, 1, end);
            assert_eq!((canvas.at(8, 8), stage.deadline(end)), (bare, None));
        });
    }

    #[test]
    fn the_overlay_goes_and_comes() {
        on_stage(|mut stage, mut canvas| {
            stage.compose(&mut canvas, 1, ZERO);
            let corner = canvas.at(0, canvas.size().1 - 1);
            stage.act(Action::Overlay, ZERO);
            stage.compose(&mut canvas, 1, ZERO);
            assert_ne!(canvas.at(0, canvas.size().1 - 1), corner);
            stage.press(50.0, f64::from(canvas.size().1) - 30.0, ZERO);
            assert!(!stage.transport.held(), "no timeline, nothing to take");
            assert_eq!(stage.act(Action::Screenshot, ZERO), Wish::Screenshot);
            assert_eq!(stage.act(Action::Quit, ZERO), Wish::Quit);
        });
    }

    #[test]
    fn the_measured_rate_is_of_the_last_second() {
        on_stage(|mut stage, mut canvas| {
            let mut now = ZERO;
            for _ in 0..50 {
                stage.compose(&mut canvas, 1, now);
                now = stage.deadline(now).unwrap();
            }
            let rate = stage.status(now).shown_fps.unwrap();
            assert!((rate - f64::from(SIZE.3)).abs() < 0.1, "{rate}");
            assert!(stage.times.len() <= SIZE.3 as usize + 1);
            stage.act(Action::Step(1), now);
            stage.compose(&mut canvas, 1, now);
            assert_eq!(stage.status(now).shown_fps, None);
        });
    }
}
