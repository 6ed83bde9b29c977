//! The lines of a file, however they end.

use std::io::{self, BufRead};

/// In bytes: room for a face of a million corners.
const MAX_LINE: usize = 1 << 26;

/// Reads lines, and counts them.
pub(super) struct RawLines<R> {
    inner: R,
    /// That of the line read last, from 1.
    number: usize,
}

impl<R: BufRead> RawLines<R> {
    pub fn new(inner: R) -> Self {
        Self { inner, number: 0 }
    }

    /// The number of the line read last, from 1.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Puts the next line into `raw`, with those that it continues on. Lines end as on Unix,
    /// Windows or old Macs.
    pub fn next(&mut self, raw: &mut Vec<u8>) -> io::Result<bool> {
        raw.clear();
        loop {
            let before = raw.len();
            if !self.read_to_line_end(raw)? {
                return Ok(!raw.is_empty());
            }
            self.number += 1;
            let end = raw.trim_ascii_end().len();
            let comment = raw.trim_ascii_start().first() == Some(&b'#');
            if end <= before || raw[end - 1] != b'\\' || comment {
                return Ok(true);
            }
            raw.truncate(end - 1);
            raw.push(b' ');
        }
    }

    /// Appends what is left of a line; false at the end of the file.
    fn read_to_line_end(&mut self, raw: &mut Vec<u8>) -> io::Result<bool> {
        let mut found = false;
        loop {
            let available = match self.inner.fill_buf() {
                Ok(available) => available,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            if available.is_empty() {
                return Ok(found);
            }
            found = true;
            let end = memchr::memchr2(b'\n', b'\r', available);
            raw.extend_from_slice(&available[..end.unwrap_or(available.len())]);
            if raw.len() > MAX_LINE {
                let message = format!("a line is longer than {MAX_LINE} bytes");
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
            let Some(end) = end else {
                let all = available.len();
                self.inner.consume(all);
                continue;
            };
            let carriage_return = available[end] == b'\r';
            self.inner.consume(end + 1);
            if carriage_return && self.inner.fill_buf()?.first() == Some(&b'\n') {
                self.inner.consume(1);
            }
            return Ok(true);
        }
    }
}
