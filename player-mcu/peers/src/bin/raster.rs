//! Draws the scene that the others play, triangle by triangle, by `raster.rs`: into a whole frame, which then goes to the display.
#![no_std]
#![no_main]

#[path = "../raster.rs"]
mod raster;

use cortex_m_rt::entry;
use cubist_peers::{clock, content, end, fail, frame};
use raster::{Corner, Frame, Mesh, VERTICES};

#[entry]
fn main() -> ! {
    static mut FRAME: Frame = Frame::NEW;
    static mut SEEN: [Corner; VERTICES] = [Corner::NEW; VERTICES];
    let mut clock = clock();
    let Some(mesh) = Mesh::new(bytemuck::cast_slice(content!("scene.mesh"))) else { fail("no triangles that this player knows") };
    for camera in mesh.cameras {
        frame(&mut clock, |display| {
            mesh.draw(camera, SEEN, FRAME);
            FRAME.colour.iter().for_each(|row| display.show(row));
        });
    }
    end(mesh.vertices.len() * size_of::<Corner>(), size_of_val(SEEN))
}
