//! What stands between the check of an OBJ file's lines and their parser, so
//! that each can have a thread.

use super::lines::{Lines, material_of_its_own};
use std::io::{self, BufRead, Read};
use std::sync::mpsc::sync_channel;

/// Bytes of text from which a block is handed on: enough to make the meeting
/// of two threads cheap, little enough to stay in a core's cache.
pub(super) const BLOCK: usize = 1 << 16;

/// Blocks that may wait for the parser.
const WAITING: usize = 16;

/// Lines for the parser.
#[derive(Default)]
pub(super) struct Block {
    pub text: Vec<u8>,
    /// For the lines from one source line, where in `text` they end, and its
    /// number in the file.
    pub origins: Vec<(usize, usize)>,
}

/// Has the parser read what is left of `lines`; also gives the line it read
/// last. The lines are checked to their end even when the parser stops early,
/// so that all that is wrong with them gets known.
pub(super) fn parse<R: BufRead + Send>(
    lines: &mut Lines<R>,
    options: &tobj::LoadOptions,
) -> (tobj::LoadResult, (usize, String)) {
    let parse = |next: &mut dyn FnMut() -> Option<Block>| {
        let mut feed = Feed::new(next);
        let loaded = tobj::load_obj_buf(&mut feed, options, material_of_its_own);
        (loaded, feed.last_line())
    };
    // Who asked for one thread gets one.
    if rayon::current_num_threads() == 1 {
        let result = parse(&mut || lines.next_block());
        while lines.next_block().is_some() {}
        return result;
    }
    // A thread of its own: a task might wait for a worker that waits for it.
    std::thread::scope(|scope| {
        let (sender, receiver) = sync_channel(WAITING);
        scope.spawn(move || {
            while let Some(block) = lines.next_block() {
                // A parser that stopped takes no more.
                let _ = sender.send(block);
            }
        });
        let result = parse(&mut || receiver.recv().ok());
        // No more is taken: the other thread must not wait for room.
        drop(receiver);
        result
    })
}

/// The blocks as the parser wants them.
struct Feed<'a> {
    next: &'a mut dyn FnMut() -> Option<Block>,
    block: Block,
    /// How much of the block is read.
    taken: usize,
}

impl<'a> Feed<'a> {
    fn new(next: &'a mut dyn FnMut() -> Option<Block>) -> Self {
        Self {
            next,
            block: Block::default(),
            taken: 0,
        }
    }

    /// The number in the file and the text of the line that was read last.
    fn last_line(&self) -> (usize, String) {
        let Block { text, origins } = &self.block;
        let read = &text[..self.taken];
        let line = read.strip_suffix(b"\n").unwrap_or(read);
        let start = line.iter().rposition(|&byte| byte == b'\n');
        let line = &line[start.map_or(0, |newline| newline + 1)..];
        let origin = origins.partition_point(|&(end, _)| end < self.taken);
        (
            origins.get(origin).map_or(0, |&(_, number)| number),
            String::from_utf8_lossy(line).trim().to_owned(),
        )
    }
}

impl BufRead for Feed<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.block.text.len() {
            // At the end the last block stays, to tell its last line from.
            if let Some(block) = (self.next)() {
                self.block = block;
                self.taken = 0;
            }
        }
        Ok(&self.block.text[self.taken..])
    }

    fn consume(&mut self, count: usize) {
        self.taken += count;
    }
}

impl Read for Feed<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}
