//! Lines of text out to the host, by semihosting. Written without `core::fmt`, whose stack would count as the player's.

use cortex_m_semihosting::hio::hstdout;

/// A line in the making.
pub struct Line {
    bytes: [u8; 512],
    length: usize,
}

impl Line {
    pub const fn new() -> Self {
        Self { bytes: [0; 512], length: 0 }
    }

    /// Appends `word`; what does not fit is left out.
    pub fn word(&mut self, word: &str) -> &mut Self {
        for (slot, byte) in self.bytes.iter_mut().skip(self.length).zip(word.bytes()) {
            *slot = byte;
            self.length += 1;
        }
        self
    }

    /// Appends `number` in decimal.
    pub fn number(&mut self, mut number: u64) -> &mut Self {
        let mut digits = [0u8; 20];
        let mut from = digits.len();
        loop {
            from -= 1;
            if let Some(digit) = digits.get_mut(from) {
                *digit = b'0' + (number % 10) as u8;
            }
            number /= 10;
            if number == 0 {
                break;
            }
        }
        self.word(digits.get(from..).and_then(|digits| core::str::from_utf8(digits).ok()).unwrap_or(""))
    }

    /// Sends the line off.
    pub fn end(&mut self) {
        self.word("\n");
        // A host that cannot be written to cannot be told so.
        let _sent = hstdout().and_then(|mut host| host.write_all(self.bytes.get(..self.length).unwrap_or(&[])));
    }
}
