//! Plays the bundles that the emulator's command line names, read from the host by semihosting, and prints `FILE FRAME CHECKSUM` for every
//! frame, to `cubist-identical`. One source for Cortex-M and RISC-V: only where `main` starts differs.
#![no_std]
#![no_main]

use core::ffi::CStr;
use cubist_identity::{BUNDLE_ROOM, MEMORY_ROOM, PICTURE_ROOM, play};
use semihosting::experimental::env;
use semihosting::fs::File;
use semihosting::io::Read;
use semihosting::{println, process};

#[cfg(target_arch = "arm")]
use cortex_m_rt::entry;
#[cfg(target_arch = "riscv32")]
use riscv_rt::entry;

/// The longest command line, bytes.
const LINE: usize = 4096;

#[panic_handler]
fn panic(what: &core::panic::PanicInfo<'_>) -> ! {
    println!("error: {what}");
    process::exit(2)
}

/// Reads the file `name` into `room`; the bytes that it has.
fn read<'a>(name: &str, room: &'a mut [u8]) -> Option<&'a [u8]> {
    let mut path = [0; LINE];
    // The zero behind the name is there already.
    path.get_mut(..name.len())?.copy_from_slice(name.as_bytes());
    let mut file = File::open(CStr::from_bytes_until_nul(&path).ok()?).ok()?;
    let mut length = 0;
    loop {
        // A file that fills the room may go on behind it: then its bundle does not parse.
        match file.read(room.get_mut(length..)?).ok()? {
            0 => return room.get(..length),
            more => length += more,
        }
    }
}

/// Plays all that the command line names; whether all went well.
fn all() -> bool {
    // The machine's stack is made for it.
    let (mut room, mut memory, mut picture) = ([0; BUNDLE_ROOM], [0; MEMORY_ROOM], [0; PICTURE_ROOM]);
    let Ok(arguments) = env::args::<LINE>() else {
        println!("error: a command line longer than {LINE} bytes");
        return false;
    };
    // The first is the program.
    for name in arguments.skip(1) {
        let Ok(name) = name else { return false };
        let Some(bytes) = read(name, &mut room) else {
            println!("error: {name}: cannot be read");
            return false;
        };
        if let Err(trouble) = play(bytes, &mut memory, &mut picture, |frame, sum| println!("{name} {frame} {sum:08x}")) {
            println!("error: {name}: {trouble}");
            return false;
        }
    }
    true
}

#[entry]
fn main() -> ! {
    process::exit(if all() { 0 } else { 1 })
}
