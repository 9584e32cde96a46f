//! `clip SCENE WxH FRAMES EVERY FILE`: writes every EVERYth of the FRAMES frames of a built-in scene as the truth has them, antialiased: R, G, B,
//! row by row, frame by frame, and nothing else. `player-mcu/peers/run` makes of them what other players play.

use anyhow::{Context, Result, bail};
use cubist_baker::truth::Truth;
use cubist_tests::scenes;
use std::io::Write;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, size, frames, every, file] = arguments.as_slice() else {
        bail!("usage: clip SCENE WxH FRAMES EVERY FILE");
    };
    let scene = scenes::asked(name, size, frames)?;
    let every = scenes::number(every)?.max(1);
    let truth = Truth::new(&scene);
    let mut out = std::fs::File::create(file).with_context(|| file.clone())?;
    for frame in (0..scene.playback.frames).step_by(every as usize) {
        out.write_all(&truth.frame(frame)).with_context(|| file.clone())?;
    }
    Ok(())
}
