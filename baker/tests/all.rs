//! All tests of this folder in one program: they share what is linked, and both processors.

mod command_line;
mod hostile_scenes;
mod report;
mod round_trip;
mod scene_file;
mod scene_gltf;
mod scene_text;
