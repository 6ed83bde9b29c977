//! The lines of an OBJ file, checked on their way to the parser.

use super::{LineProblem, Repair, Wanted};
use std::collections::{HashMap, HashSet};
use std::io::{self, BufRead, Read, Write};
use std::path::Path;

/// More than this bury the cause.
const MAX_PROBLEMS: usize = 20;

/// Hands on the lines of a file that describe triangles, without what is not
/// wanted; lines that make no sense are reported and left out.
pub(super) struct Lines<R> {
    inner: R,
    wanted: Wanted,
    /// The line being read, as it is in the file.
    raw: Vec<u8>,
    /// The line as it is handed on, and how much of it is.
    ready: Vec<u8>,
    taken: usize,
    /// The number of the line, from 1.
    number: usize,
    /// How many positions, texture coordinates and normals came so far.
    counts: [u64; 3],
    /// The corners that name what is farthest ahead: line, kind and index.
    ahead: Vec<(usize, usize, u64)>,
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
            ready: Vec::new(),
            taken: 0,
            number: 0,
            counts: [0; 3],
            ahead: Vec::new(),
            names: Vec::new(),
            known_names: HashSet::new(),
            polygons: 0,
            points_and_lines: 0,
            problems: Vec::new(),
        }
    }

    /// Judges what the parser made of the lines.
    pub fn finish(mut self, loaded: tobj::LoadResult) -> Result<Parts, Vec<LineProblem>> {
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
                let line = String::from_utf8_lossy(&self.raw);
                let message = format!("{error} in `{}`", line.trim());
                Err(vec![LineProblem {
                    line: Some(self.number),
                    message,
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

    /// Reads lines until there is something to hand on, or the end.
    fn advance(&mut self) -> io::Result<()> {
        self.ready.clear();
        self.taken = 0;
        let mut raw = std::mem::take(&mut self.raw);
        while self.ready.is_empty() && self.read_line(&mut raw)? {
            match std::str::from_utf8(&raw) {
                Ok(line) => self.line(line),
                Err(_) => self.problem("expected UTF-8, found other bytes".to_owned()),
            }
        }
        self.raw = raw;
        Ok(())
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
            "o" | "g" => self.hand_on(format_args!("{line}")),
            "usemtl" => self.material(rest.trim()),
            _ => {}
        }
    }

    fn hand_on(&mut self, line: std::fmt::Arguments) {
        writeln!(self.ready, "{line}").expect("writing to memory does not fail");
    }

    fn numbers(&mut self, keyword: &str, values: &str, wanted: usize, kind: usize) {
        self.counts[kind] += 1;
        self.ready.extend_from_slice(keyword.as_bytes());
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
            self.ready.push(b' ');
            self.ready.extend_from_slice(word.as_bytes());
            found += 1;
        }
        self.ready.push(b'\n');
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
            self.ready.clear();
            self.hand_on(format_args!("{keyword} 0 0 0"));
        }
    }

    fn face(&mut self, values: &str) {
        self.ready.extend_from_slice(b"f");
        let mut corners = 0;
        for corner in values.split_ascii_whitespace() {
            corners += 1;
            if let Err(message) = self.corner(corner) {
                self.problem(message);
                self.ready.clear();
                return;
            }
        }
        self.ready.push(b'\n');
        match corners {
            0 => self.problem("expected the corners of a face, found nothing".to_owned()),
            1 | 2 => self.points_and_lines += 1,
            3 | 4 => {}
            _ => self.polygons += 1,
        }
        if corners < 3 {
            self.ready.clear();
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
        self.ready.push(b' ');
        if self.wanted == Wanted::ALL && !corner.contains('-') {
            self.ready.extend_from_slice(corner.as_bytes());
            return Ok(());
        }
        let vt = indices[1] * u64::from(self.wanted.uvs);
        let vn = indices[2] * u64::from(self.wanted.normals);
        push_decimal(&mut self.ready, indices[0]);
        if vt > 0 || vn > 0 {
            self.ready.push(b'/');
        }
        if vt > 0 {
            push_decimal(&mut self.ready, vt);
        }
        if vn > 0 {
            self.ready.push(b'/');
            push_decimal(&mut self.ready, vn);
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

impl<R: BufRead> BufRead for Lines<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.ready.len() {
            if let Err(error) = self.advance() {
                let message = format!("the mesh can't be read: {error}");
                self.problems.push(LineProblem {
                    line: None,
                    message,
                });
                return Err(error);
            }
        }
        Ok(&self.ready[self.taken..])
    }

    fn consume(&mut self, count: usize) {
        self.taken += count;
    }
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}
