//! The lines of an OBJ file, checked on their way to the parser.

use super::feed::{BLOCK, Block};
use super::{LineProblem, Repair, Wanted};
use std::collections::{HashMap, HashSet};
use std::io::{self, BufRead, Write};
use std::path::Path;

/// Faces after which the parser is told that another object begins. It keeps
/// the faces of an object, and a table of their corners, until the object ends:
/// short ones stay in the cache, which halves its time, and in a fraction of the
/// memory. Corners that two objects have in common become vertices of both: few,
/// as neighbours in the file are mostly neighbours in space.
const MAX_FACES: usize = 1 << 15;

/// More than this bury the cause.
const MAX_PROBLEMS: usize = 20;

/// Gives the lines of a file that describe triangles in blocks, without what is
/// not wanted; lines that make no sense are reported and left out.
pub(super) struct Lines<R> {
    inner: R,
    wanted: Wanted,
    /// The line being read, as it is in the file.
    raw: Vec<u8>,
    /// The lines to hand on next, and where among them the one being read began.
    block: Block,
    start: usize,
    /// The number of the line, from 1.
    number: usize,
    /// How many positions, texture coordinates and normals came so far.
    counts: [u64; 3],
    /// The corners that name what is farthest ahead: line, kind and index.
    ahead: Vec<(usize, usize, u64)>,
    /// The farthest index so far, of each kind, that had yet to come.
    farthest: [u64; 3],
    /// Faces of the object so far.
    faces: usize,
    names: Vec<String>,
    known_names: HashSet<String>,
    polygons: usize,
    points_and_lines: usize,
    problems: Vec<LineProblem>,
}

const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// Makes up a library of one material: [`Lines`] asks for one before each new
/// `usemtl`, since names that no library defines would be lost.
pub(super) fn material_of_its_own(name: &Path) -> tobj::MTLLoadResult {
    let name = name.to_string_lossy().into_owned();
    let material = tobj::Material {
        name: name.clone(),
        ..Default::default()
    };
    Ok((
        vec![material],
        HashMap::from([(name, 0)]).into_iter().collect(),
    ))
}

/// Models, the names that their material ids index, and repairs.
type Parts = (Vec<tobj::Model>, Vec<String>, Vec<Repair>);

impl<R: BufRead> Lines<R> {
    pub fn new(inner: R, wanted: Wanted) -> Self {
        Self {
            inner,
            wanted,
            raw: Vec::new(),
            block: Block::default(),
            start: 0,
            number: 0,
            counts: [0; 3],
            ahead: Vec::new(),
            farthest: [0; 3],
            faces: 0,
            names: Vec::new(),
            known_names: HashSet::new(),
            polygons: 0,
            points_and_lines: 0,
            problems: Vec::new(),
        }
    }

    /// Judges what the parser made of the lines; `last` is the one it read last.
    pub fn finish(
        mut self,
        loaded: tobj::LoadResult,
        last: (usize, String),
    ) -> Result<Parts, Vec<LineProblem>> {
        for &(line, kind, index) in &self.ahead {
            let count = self.counts[kind];
            if index > count {
                let message = format!("there is no {} {index}, only {count}", KINDS[kind]);
                self.problems.push(LineProblem {
                    line: Some(line),
                    message,
                });
            }
        }
        self.problems.sort_by_key(|problem| problem.line);
        self.problems.dedup();
        self.problems.truncate(MAX_PROBLEMS);
        match loaded {
            Ok((models, _)) if self.problems.is_empty() => {
                let mut repairs = Vec::new();
                if self.polygons > 0 {
                    repairs.push(Repair::PolygonsTriangulated(self.polygons));
                }
                if self.points_and_lines > 0 {
                    repairs.push(Repair::PointsAndLinesIgnored(self.points_and_lines));
                }
                Ok((models, self.names, repairs))
            }
            Err(error) if self.problems.is_empty() => {
                let (line, text) = last;
                Err(vec![LineProblem {
                    line: Some(line),
                    message: format!("{error} in `{text}`"),
                }])
            }
            _ => Err(self.problems),
        }
    }

    fn problem(&mut self, message: String) {
        if self.problems.len() < MAX_PROBLEMS {
            self.problems.push(LineProblem {
                line: Some(self.number),
                message,
            });
        }
    }

    /// The next lines to hand on; `None` at the end of what can be read.
    pub fn next_block(&mut self) -> Option<Block> {
        let mut raw = std::mem::take(&mut self.raw);
        while self.block.text.len() < BLOCK {
            match self.read_line(&mut raw) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    self.problems.push(LineProblem {
                        line: None,
                        message: format!("the mesh can't be read: {error}"),
                    });
                    break;
                }
            }
            self.start = self.block.text.len();
            match std::str::from_utf8(&raw) {
                Ok(line) => self.line(line),
                Err(_) => self.problem("expected UTF-8, found other bytes".to_owned()),
            }
            if self.block.text.len() > self.start {
                let end = self.block.text.len();
                self.block.origins.push((end, self.number));
            }
        }
        self.raw = raw;
        let block = std::mem::take(&mut self.block);
        (!block.text.is_empty()).then_some(block)
    }

    /// Reads one line, with those that it continues on.
    fn read_line(&mut self, raw: &mut Vec<u8>) -> io::Result<bool> {
        raw.clear();
        loop {
            if self.inner.read_until(b'\n', raw)? == 0 {
                return Ok(!raw.is_empty());
            }
            self.number += 1;
            let end = raw.trim_ascii_end().len();
            if end == 0 || raw[end - 1] != b'\\' {
                return Ok(true);
            }
            raw.truncate(end - 1);
            raw.push(b' ');
        }
    }

    fn line(&mut self, line: &str) {
        let line = line.strip_prefix('\u{feff}').unwrap_or(line).trim_ascii();
        let end = line.bytes().position(|byte| byte.is_ascii_whitespace());
        let (keyword, rest) = line.split_at(end.unwrap_or(line.len()));
        let values = rest.split('#').next().unwrap_or_default();
        match keyword {
            "v" => {
                let count = values.split_ascii_whitespace().count();
                // Six are a position and a colour, which nobody looks at.
                let kept = if count == 4 { 4 } else { 3 };
                self.numbers(keyword, values, kept, 0);
            }
            "vt" if self.wanted.uvs => self.numbers(keyword, values, 2, 1),
            "vn" if self.wanted.normals => self.numbers(keyword, values, 3, 2),
            "vt" => self.counts[1] += 1,
            "vn" => self.counts[2] += 1,
            "f" => self.face(values),
            "l" | "p" => self.points_and_lines += 1,
            "o" | "g" => {
                self.faces = 0;
                self.hand_on(format_args!("{line}"));
            }
            "usemtl" => self.material(rest.trim()),
            _ => {}
        }
    }

    fn hand_on(&mut self, line: std::fmt::Arguments) {
        writeln!(self.block.text, "{line}").expect("writing to memory does not fail");
    }

    fn numbers(&mut self, keyword: &str, values: &str, wanted: usize, kind: usize) {
        self.counts[kind] += 1;
        self.block.text.extend_from_slice(keyword.as_bytes());
        // Only letters make numbers that are none, and texts this long ones out of range.
        let plain = values.len() < 60 && !values.bytes().any(|byte| byte.is_ascii_alphabetic());
        let mut found = 0;
        for word in values.split_ascii_whitespace().take(wanted) {
            let number = if plain {
                Some(0.0)
            } else {
                word.parse::<f32>().ok()
            };
            match number {
                // Broken normals and texture coordinates can be replaced.
                Some(number) if !number.is_finite() && kind == 0 => {
                    self.problem(format!("expected finite coordinates, found `{word}`"));
                }
                Some(_) => {}
                None => self.problem(format!("expected a number, found `{word}`")),
            }
            self.block.text.push(b' ');
            self.block.text.extend_from_slice(word.as_bytes());
            found += 1;
        }
        self.block.text.push(b'\n');
        if found < wanted {
            self.problem(format!(
                "expected {wanted} numbers after `{keyword}`, found {found}"
            ));
        }
        if self
            .problems
            .last()
            .is_some_and(|problem| problem.line == Some(self.number))
        {
            // What follows counts on the vertex.
            self.block.text.truncate(self.start);
            self.hand_on(format_args!("{keyword} 0 0 0"));
        }
    }

    fn face(&mut self, values: &str) {
        self.block.text.extend_from_slice(b"f");
        let mut corners = 0;
        for corner in values.split_ascii_whitespace() {
            corners += 1;
            if let Err(message) = self.corner(corner) {
                self.problem(message);
                self.block.text.truncate(self.start);
                return;
            }
        }
        self.block.text.push(b'\n');
        match corners {
            0 => self.problem("expected the corners of a face, found nothing".to_owned()),
            1 | 2 => self.points_and_lines += 1,
            3 | 4 => {}
            _ => self.polygons += 1,
        }
        if corners < 3 {
            self.block.text.truncate(self.start);
            return;
        }
        self.faces += 1;
        // An object can't end before its vertices have come.
        let complete = (0..3).all(|kind| self.farthest[kind] <= self.counts[kind]);
        if self.faces >= MAX_FACES && complete {
            self.faces = 0;
            self.hand_on(format_args!("o"));
        }
    }

    /// Hands on a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1.
    fn corner(&mut self, corner: &str) -> Result<(), String> {
        let mut indices = [0; 3];
        let mut parts = corner.split('/');
        for (kind, slot) in indices.iter_mut().enumerate() {
            *slot = match parts.next() {
                None | Some("") if kind > 0 => continue,
                Some(part) => self.index(part, kind)?,
                None => continue,
            };
        }
        if parts.next().is_some() {
            return Err(format!("expected a corner like 1/2/3, found `{corner}`"));
        }
        self.block.text.push(b' ');
        if self.wanted == Wanted::ALL && !corner.contains('-') {
            self.block.text.extend_from_slice(corner.as_bytes());
            return Ok(());
        }
        let vt = indices[1] * u64::from(self.wanted.uvs);
        let vn = indices[2] * u64::from(self.wanted.normals);
        push_decimal(&mut self.block.text, indices[0]);
        if vt > 0 || vn > 0 {
            self.block.text.push(b'/');
        }
        if vt > 0 {
            push_decimal(&mut self.block.text, vt);
        }
        if vn > 0 {
            self.block.text.push(b'/');
            push_decimal(&mut self.block.text, vn);
        }
        Ok(())
    }

    /// An index counted from 1, whichever way it was counted.
    fn index(&mut self, text: &str, kind: usize) -> Result<u64, String> {
        let count = self.counts[kind];
        let given: i64 = text
            .parse()
            .map_err(|_| format!("expected the index of a {}, found `{text}`", KINDS[kind]))?;
        let index = match u64::try_from(given) {
            Ok(0) => return Err(format!("indices start at 1, found a {} 0", KINDS[kind])),
            Ok(index) => index,
            Err(_) => count
                .checked_add_signed(given + 1)
                .filter(|&index| index > 0)
                .ok_or_else(|| {
                    format!(
                        "there is no {} {given}: only {count} came before",
                        KINDS[kind]
                    )
                })?,
        };
        if index > count {
            if u32::try_from(index).is_err() {
                return Err(format!("there is no {} {index}", KINDS[kind]));
            }
            self.farthest[kind] = self.farthest[kind].max(index);
            let corner = (self.number, kind, index);
            self.ahead.push(corner);
            if self.ahead.len() > MAX_PROBLEMS {
                // Those farthest ahead are the ones that may never come.
                self.ahead
                    .sort_by_key(|&(_, _, index)| std::cmp::Reverse(index));
                self.ahead.truncate(MAX_PROBLEMS);
            }
        }
        Ok(index)
    }

    fn material(&mut self, name: &str) {
        if name.is_empty() {
            self.problem("expected a name after `usemtl`, found nothing".to_owned());
            return;
        }
        if self.known_names.insert(name.to_owned()) {
            self.names.push(name.to_owned());
            self.hand_on(format_args!("mtllib {name}"));
        }
        self.hand_on(format_args!("usemtl {name}"));
    }
}

/// A hot path: three million per million triangles.
fn push_decimal(out: &mut Vec<u8>, mut number: u64) {
    let mut digits = [0; 20];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    out.extend_from_slice(&digits[start..]);
}
