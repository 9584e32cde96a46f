//! The overlay: where the picture goes, and the strip below it with timeline and figures.
//! The window's size and the state of play come in from `stage`; shapes and letters go to `canvas`.

use crate::canvas::{Area, Canvas, Colour};
use crate::keys::HELP;
use crate::text::Face;
use crate::transport::Ends;
use cubist_baker::terminal::grouped;
use cubist_core::Work;

const STRIP: Colour = Colour([24, 27, 33, 255]);
const GROOVE: Colour = Colour([62, 68, 80, 255]);
const PLAYED: Colour = Colour([96, 165, 250, 255]);
const HANDLE: Colour = Colour([240, 244, 250, 255]);
const PLATE: Colour = Colour([12, 14, 18, 215]);
const LETTERS: [u8; 3] = [222, 226, 234];

/// What the overlay tells.
pub struct Status {
    /// The frame that shows, from 0.
    pub frame: u32,
    /// Number of frames.
    pub frames: u32,
    /// Whether the film runs.
    pub playing: bool,
    /// Whether the frame numbers fall.
    pub backwards: bool,
    /// Speed in eighths.
    pub speed_eighths: u16,
    /// What happens at the ends.
    pub ends: Ends,
    /// Pictures shown in a second, measured; none while the film stands still.
    pub shown_fps: Option<f64>,
    /// Frames per second the bundle asks for.
    pub fps: u16,
    /// Bytes of the bundle.
    pub bundle_bytes: usize,
    /// Bytes of working memory.
    pub memory: usize,
    /// Work of the frame that shows.
    pub work: Work,
}

impl Status {
    /// The figures in three groups, each of the same length from frame to frame so that lines never jump.
    fn groups(&self) -> [String; 3] {
        let state = match (self.playing, self.backwards) {
            (false, _) => "||",
            (true, false) => "> ",
            (true, true) => "< ",
        };
        let digits = self.frames.to_string().len();
        let ends = match self.ends {
            Ends::Stop => "stop     ",
            Ends::Loop => "loop     ",
            Ends::PingPong => "ping-pong",
        };
        let speed = speed_text(self.speed_eighths);
        let drawn = (self.work.smooth_pixels + self.work.torn_pixels).max(1);
        let torn = 100.0 * f64::from(self.work.torn_pixels) / f64::from(drawn);
        let shown = self.shown_fps.map_or("-".to_owned(), |fps| format!("{:.1}", fps.min(999.9)));
        [
            format!("{state} {:>digits$}/{} {shown:>5}/{} fps {speed:<4} {ends}", self.frame, self.frames, self.fps),
            format!(
                "{} B, {} B/frame, memory {} B",
                grouped(self.bundle_bytes),
                grouped(self.bundle_bytes / self.frames.max(1) as usize),
                grouped(self.memory)
            ),
            format!("keys {:>2}  layers {:>6}  torn {torn:>5.1} %", self.work.keys, grouped(self.work.layers as usize)),
        ]
    }
}

fn speed_text(eighths: u16) -> String {
    if eighths >= 8 { format!("x{}", eighths / 8) } else { format!("x1/{}", 8 / eighths.max(1)) }
}

/// Where things go in a window.
pub struct Layout {
    /// Top left corner of the picture.
    pub picture: (i32, i32),
    /// Canvas pixels to a picture pixel.
    pub zoom: u32,
    /// The strip with the timeline and the figures; none when the overlay is off.
    strip: Option<Area>,
    /// Where the timeline runs.
    timeline: Area,
    lines: Vec<String>,
    face: Face,
    ui: i32,
}

impl Layout {
    /// Divides a window of `window` pixels, `ui` of them to a point: the picture centred at the largest whole zoom
    /// in what the strip leaves. A picture larger than that is cut at the edges, never shrunk.
    pub fn new(window: (u32, u32), picture: (u32, u32), ui: u32, status: Option<&Status>) -> Self {
        let (width, height) = (window.0 as i32, window.1 as i32);
        let ui = ui.max(1) as i32;
        let face = Face::fitting(width, ui);
        let margin = 6 * ui;
        let lines = status.map_or(Vec::new(), |s| wrap(&s.groups(), ((width - 2 * margin) / face.cell().0).max(1) as usize));
        let strip_height = if status.is_some() { bar_height(ui) + lines.len() as i32 * line_height(&face, ui) + margin } else { 0 };
        let top = (height - strip_height).max(0);
        let strip = status.map(|_| Area { x: 0, y: top, width, height: strip_height });
        let timeline = Area { x: margin, y: top + 7 * ui, width: (width - 2 * margin).max(1), height: 6 * ui };
        let zoom = (width / picture.0.max(1) as i32).min(top / picture.1.max(1) as i32).max(1) as u32;
        let corner = ((width - (picture.0 * zoom) as i32) / 2, (top - (picture.1 * zoom) as i32) / 2);
        Self { picture: corner, zoom, strip, timeline, lines, face, ui }
    }

    /// The window size that holds the picture at `zoom` and the strip, nothing more.
    pub fn natural_size(picture: (u32, u32), ui: u32, zoom: u32, status: &Status) -> (u32, u32) {
        let width = (picture.0 * zoom).max(200 * ui);
        let strip = Self::new((width, 1), picture, ui, Some(status)).strip.map_or(0, |s| s.height as u32);
        (width, picture.1 * zoom + strip)
    }

    /// Whether a press at this point takes the timeline's handle.
    pub fn on_timeline(&self, x: f64, y: f64) -> bool {
        self.strip.is_some_and(|s| Area { height: bar_height(self.ui), ..s }.contains(x, y))
    }

    /// The frame under a point of the timeline; left of it the first, right of it the last.
    pub fn frame_at(&self, x: f64, frames: u32) -> u32 {
        let along = (x - f64::from(self.timeline.x)) / f64::from(self.timeline.width);
        let frames = frames.max(1);
        ((along * f64::from(frames)).floor().max(0.0) as u32).min(frames - 1)
    }

    /// Draws the strip.
    pub fn draw(&self, canvas: &mut Canvas, status: &Status) {
        let Some(strip) = self.strip else { return };
        canvas.rect(strip, STRIP);
        canvas.pill(self.timeline, GROOVE);
        let along = (f64::from(status.frame) + 0.5) / f64::from(status.frames.max(1));
        let x = f64::from(self.timeline.x) + along * f64::from(self.timeline.width);
        canvas.pill(Area { width: x as i32 - self.timeline.x, ..self.timeline }, PLAYED);
        let middle = self.timeline.y as f32 + self.timeline.height as f32 / 2.0;
        canvas.disc(x as f32, middle, 6.0 * self.ui as f32, HANDLE);
        for (i, line) in (0..).zip(&self.lines) {
            let y = strip.y + bar_height(self.ui) + i * line_height(&self.face, self.ui);
            self.face.write(canvas, self.timeline.x, y, line, LETTERS);
        }
    }

    /// Draws a plate with the keys over the middle of the window.
    pub fn draw_help(&self, canvas: &mut Canvas) {
        let (width, height) = canvas.size();
        let longest = HELP.iter().map(|line| line.len()).max().unwrap_or(0) as i32 * self.face.cell().0;
        let tall = HELP.len() as i32 * line_height(&self.face, self.ui);
        let (x, y) = (((width as i32 - longest) / 2).max(0), ((height as i32 - tall) / 2).max(0));
        self.plate(canvas, x, y, &HELP);
    }

    /// Draws a plate with a message in the top left corner.
    pub fn draw_message(&self, canvas: &mut Canvas, message: &str) {
        self.plate(canvas, 12 * self.ui, 12 * self.ui, &[message]);
    }

    fn plate(&self, canvas: &mut Canvas, x: i32, y: i32, lines: &[&str]) {
        let margin = 6 * self.ui;
        let longest = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0) as i32;
        let (wide, tall) = (longest * self.face.cell().0, lines.len() as i32 * line_height(&self.face, self.ui));
        canvas.rect(Area { x: x - margin, y: y - margin, width: wide + 2 * margin, height: tall + 2 * margin }, PLATE);
        for (i, line) in (0..).zip(lines) {
            self.face.write(canvas, x, y + i * line_height(&self.face, self.ui), line, LETTERS);
        }
    }
}

fn bar_height(ui: i32) -> i32 {
    20 * ui
}

fn line_height(face: &Face, ui: i32) -> i32 {
    face.cell().1 + 2 * ui
}

/// Puts groups on lines of at most `columns` letters, three blanks between two; a longer group has a line of its own.
fn wrap(groups: &[String], columns: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for group in groups {
        match lines.last_mut() {
            Some(line) if line.len() + 3 + group.len() <= columns => {
                line.push_str("   ");
                line.push_str(group);
            }
            _ => lines.push(group.clone()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status() -> Status {
        Status {
            frame: 2,
            frames: 8,
            playing: true,
            backwards: false,
            speed_eighths: 8,
            ends: Ends::Loop,
            shown_fps: Some(29.94),
            fps: 30,
            bundle_bytes: 91_234,
            memory: 14_336,
            work: Work { keys: 2, layers: 1234, smooth_pixels: 900, torn_pixels: 100, coverage_tests: 150, ..Work::default() },
        }
    }

    #[test]
    fn figures_read_as_text() {
        let [state, bytes, work] = status().groups();
        assert_eq!(state, ">  2/8  29.9/30 fps x1   loop     ");
        assert_eq!(bytes, "91,234 B, 11,404 B/frame, memory 14,336 B");
        assert_eq!(work, "keys  2  layers  1,234  torn  10.0 %");
        assert_eq!([1, 2, 4, 8, 64].map(speed_text), ["x1/8", "x1/4", "x1/2", "x1", "x8"]);
    }

    #[test]
    fn groups_keep_their_length_from_frame_to_frame() {
        let lengths = |s: Status| s.groups().map(|g| g.len());
        let still =
            Status { playing: false, frame: 7, shown_fps: None, speed_eighths: 1, ends: Ends::PingPong, work: Work::default(), ..status() };
        assert_eq!(lengths(status()), lengths(still));
    }

    #[test]
    fn groups_wrap_to_the_window() {
        let groups = ["aaaa".to_owned(), "bbbb".to_owned(), "cc".to_owned()];
        assert_eq!(wrap(&groups, 80), ["aaaa   bbbb   cc"]);
        assert_eq!(wrap(&groups, 11), ["aaaa   bbbb", "cc"]);
        assert_eq!(wrap(&groups, 1), ["aaaa", "bbbb", "cc"]);
    }

    #[test]
    fn the_natural_size_holds_the_picture_at_its_zoom() {
        for (picture, ui, zoom) in [((320, 240), 1, 3), ((240, 320), 2, 1), ((128, 64), 1, 2)] {
            let window = Layout::natural_size(picture, ui, zoom, &status());
            let layout = Layout::new(window, picture, ui, Some(&status()));
            assert!(layout.zoom >= zoom && layout.picture.0 >= 0, "{picture:?}");
            assert_eq!(layout.picture.1, 0, "{picture:?}");
        }
    }

    #[test]
    fn the_picture_is_centred_in_what_the_strip_leaves() {
        let bare = Layout::new((700, 500), (320, 240), 1, None);
        assert_eq!((bare.zoom, bare.picture), (2, (30, 10)));
        assert!(!bare.on_timeline(350.0, 495.0));
        let with = Layout::new((700, 500), (320, 240), 1, Some(&status()));
        let strip = with.strip.unwrap();
        assert_eq!(strip.y + strip.height, 500);
        assert_eq!((with.zoom, with.picture), (1, (190, (strip.y - 240) / 2)));
        let tiny = Layout::new((1, 1), (320, 240), 3, Some(&status()));
        assert_eq!(tiny.zoom, 1);
    }

    #[test]
    fn the_timeline_maps_points_to_frames() {
        let layout = Layout::new((812, 600), (320, 240), 1, Some(&status()));
        assert_eq!(layout.timeline.width, 800);
        let frames: Vec<_> = [-50.0, 6.0, 105.9, 106.0, 805.9, 5000.0].map(|x| layout.frame_at(x, 8)).into();
        assert_eq!(frames, [0, 0, 0, 1, 7, 7]);
        assert!(layout.on_timeline(400.0, f64::from(layout.timeline.y)));
        assert!(!layout.on_timeline(400.0, f64::from(layout.strip.unwrap().y - 1)));
    }

    /// A region of the canvas in letters: strip, groove, played part, handle, blends between them.
    fn ascii(canvas: &Canvas, area: Area) -> Vec<String> {
        let named = [(STRIP, '.'), (GROOVE, '-'), (PLAYED, '='), (HANDLE, 'O')];
        let letter = |x, y| {
            let [red, green, blue] = canvas.at(x as u32, y as u32);
            named.iter().find(|(c, _)| c.0[..3] == [red, green, blue]).map_or(' ', |n| n.1)
        };
        (area.y..area.y + area.height).map(|y| (area.x..area.x + area.width).map(|x| letter(x, y)).collect()).collect()
    }

    #[test]
    fn the_handle_sits_on_the_middle_of_its_frame() {
        let mut canvas = Canvas::new(172, 80).unwrap();
        let layout = Layout::new(canvas.size(), (40, 10), 1, Some(&status()));
        layout.draw(&mut canvas, &status());
        // 160 pixels for 8 frames: frame 2 covers 46..66.
        let seen = ascii(&canvas, Area { x: 46, y: layout.timeline.y - 4, width: 22, height: 14 });
        let expected = [
            "......................",
            ".......      .........",
            ".....  OOOOOO  .......",
            "..... OOOOOOOO .......",
            "==== OOOOOOOOOO ------",
            "==== OOOOOOOOOO ------",
            "==== OOOOOOOOOO ------",
            "==== OOOOOOOOOO ------",
            "==== OOOOOOOOOO ------",
            "==== OOOOOOOOOO ------",
            "..... OOOOOOOO .......",
            ".....  OOOOOO  .......",
            ".......      .........",
            "......................",
        ];
        assert_eq!(seen, expected, "{seen:#?}");
    }

    #[test]
    fn help_and_messages_stay_inside_any_window() {
        for size in [(1, 1), (30, 20), (400, 300)] {
            let mut canvas = Canvas::new(size.0, size.1).unwrap();
            let layout = Layout::new(size, (320, 240), 2, Some(&status()));
            layout.draw(&mut canvas, &status());
            layout.draw_help(&mut canvas);
            layout.draw_message(&mut canvas, "saved");
        }
    }
}
