//! The keys: which does what, for the window and for its help.
//! winit keys come in from `window`; actions go to `stage`, the same table as text to `overlay`.

use winit::keyboard::{Key, NamedKey};

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Play or pause.
    Play,
    /// Pause, and move this many frames.
    Step(i32),
    /// To the first frame.
    First,
    /// To the last frame.
    Last,
    /// The next higher speed.
    Faster,
    /// The next lower speed.
    Slower,
    /// The other direction.
    Reverse,
    /// Stop, loop or ping-pong.
    Ends,
    /// Overlay on or off.
    Overlay,
    /// Help on or off.
    Help,
    /// The frame as a PNG file.
    Screenshot,
    /// Close the window.
    Quit,
}

/// The help text, a line for each key.
pub const HELP: [&str; 11] = [
    "Space       play, pause",
    "Left Right  step a frame",
    "Home End    first, last frame",
    "Up Down     speed (also + -)",
    "R           reverse",
    "L           stop, loop, ping-pong",
    "O           overlay",
    "S           save the frame (PNG)",
    "H           this help",
    "Q Esc       quit",
    "Drag the timeline to scrub.",
];

/// The action of a key; a key held down (`repeat`) steps and changes speed, nothing else.
pub fn action(key: &Key, repeat: bool) -> Option<Action> {
    let action = match key {
        Key::Named(NamedKey::Space) => Action::Play,
        Key::Named(NamedKey::ArrowLeft) => Action::Step(-1),
        Key::Named(NamedKey::ArrowRight) => Action::Step(1),
        Key::Named(NamedKey::Home) => Action::First,
        Key::Named(NamedKey::End) => Action::Last,
        Key::Named(NamedKey::ArrowUp) => Action::Faster,
        Key::Named(NamedKey::ArrowDown) => Action::Slower,
        Key::Named(NamedKey::Escape) => Action::Quit,
        Key::Character(text) => match text.to_lowercase().as_str() {
            "+" | "=" => Action::Faster,
            "-" | "_" => Action::Slower,
            "r" => Action::Reverse,
            "l" => Action::Ends,
            "o" => Action::Overlay,
            "h" | "?" => Action::Help,
            "s" => Action::Screenshot,
            "q" => Action::Quit,
            _ => return None,
        },
        _ => return None,
    };
    let repeats = matches!(action, Action::Step(_) | Action::Faster | Action::Slower);
    (repeats || !repeat).then_some(action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_work_in_both_cases_and_only_steps_repeat() {
        assert_eq!(action(&Key::Character("R".into()), false), Some(Action::Reverse));
        assert_eq!(action(&Key::Character("r".into()), true), None);
        assert_eq!(action(&Key::Named(NamedKey::ArrowLeft), true), Some(Action::Step(-1)));
        assert_eq!(action(&Key::Character("x".into()), false), None);
    }
}
