//! The lines of an OBJ file, checked on their way to the parser.

use super::feed::{BLOCK, Block};
use super::raw_lines::RawLines;
use super::words::{Words, is_no_number, push_decimal};
use super::{LineProblem, Repair, Wanted};
use crate::text::{excerpt, excerpt_of_bytes};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io::{BufRead, Write};
use std::path::Path;

/// Faces after which the parser is told that another object begins. It keeps
/// the faces of an object, and a table of their corners, until the object ends:
/// short ones stay in the cache, which halves its time, and in a fraction of the
/// memory. Corners that two objects have in common become vertices of both: few,
/// as neighbours in the file are mostly neighbours in space.
const MAX_FACES: usize = 1 << 15;

/// More than this bury the cause.
const MAX_PROBLEMS: usize = 20;

/// The parser's name for the material of faces that have none: it takes no
/// empty one, and no line of a file can hold this one.
const NAMELESS: &str = "\0";

/// How files begin that are taken for OBJ files by mistake, and what they are.
const OTHER_FORMATS: [(&[u8], &str); 12] = [
    (b"\xff\xfe", "text in UTF-16"),
    (b"\xfe\xff", "text in UTF-16"),
    (b"\x1f\x8b", "a gzip file"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard file"),
    (b"PK\x03\x04", "a ZIP file"),
    (b"BLENDER", "a Blender file"),
    (b"Kaydara FBX", "an FBX file"),
    (b"glTF", "a glTF file"),
    (b"ply", "a PLY file"),
    (b"solid", "an STL file"),
    (b"#usda", "a USD file"),
    (b"<", "an XML file"),
];

/// What lines begin with that say nothing about triangles.
const OF_NO_USE: [&[u8]; 26] = [
    b"s",
    b"mg",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
    b"trace_obj",
    b"vp",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"ctech",
    b"stech",
    b"res",
];

/// Gives the lines of a file that describe triangles in blocks, without what is
/// not wanted; lines that make no sense are reported and left out.
pub(super) struct Lines<R> {
    file: RawLines<R>,
    wanted: Wanted,
    /// The line being read, as it is in the file.
    raw: Vec<u8>,
    /// The lines to hand on next, and where among them the one being read began.
    block: Block,
    start: usize,
    /// How many positions, texture coordinates and normals came so far.
    counts: [u64; 3],
    /// The corners that name what is farthest ahead: line, kind and index.
    ahead: Vec<(usize, usize, u64)>,
    /// The farthest index so far, of each kind, that had yet to come.
    farthest: [u64; 3],
    /// How many corners name each kind.
    named: [usize; 3],
    /// For each kind, the first corner that counts back from where none came yet.
    back_from_none: [Option<LineProblem>; 3],
    /// Faces of the object so far.
    faces: usize,
    names: Vec<String>,
    known_names: HashSet<String>,
    polygons: usize,
    points_and_lines: usize,
    /// Lines that begin with no known word, and the number of the first.
    unknown: (usize, usize),
    /// Nothing more is read.
    ended: bool,
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

/// Why lines make no mesh.
pub(super) enum Refusal {
    Problems(Vec<LineProblem>),
    /// Faces name what the file has none of; it can be read without.
    Absent {
        /// What the file has.
        present: Wanted,
        repairs: Vec<Repair>,
    },
}

impl<R: BufRead> Lines<R> {
    pub fn new(inner: R, wanted: Wanted) -> Self {
        Self {
            file: RawLines::new(inner),
            wanted,
            raw: Vec::new(),
            block: Block::default(),
            start: 0,
            counts: [0; 3],
            ahead: Vec::new(),
            farthest: [0; 3],
            named: [0; 3],
            back_from_none: [const { None }; 3],
            faces: 0,
            names: Vec::new(),
            known_names: HashSet::new(),
            polygons: 0,
            points_and_lines: 0,
            unknown: (0, 0),
            ended: false,
            problems: Vec::new(),
        }
    }

    /// Judges what the parser made of the lines; `last` is the one it read last.
    pub fn finish(
        mut self,
        loaded: tobj::LoadResult,
        last: (usize, String),
    ) -> Result<Parts, Refusal> {
        let absent =
            |kind: usize, wanted: bool| wanted && self.counts[kind] == 0 && self.named[kind] > 0;
        let Wanted {
            uvs,
            normals,
            colors,
        } = self.wanted;
        let (no_uvs, no_normals) = (absent(1, uvs), absent(2, normals));
        if (no_uvs || no_normals) && !self.ended {
            let present = Wanted {
                uvs: uvs && !no_uvs,
                normals: normals && !no_normals,
                colors,
            };
            let mut repairs = Vec::new();
            if no_uvs {
                repairs.push(Repair::UvsAbsent(self.named[1]));
            }
            if no_normals {
                repairs.push(Repair::NormalsAbsent(self.named[2]));
            }
            return Err(Refusal::Absent { present, repairs });
        }
        for (kind, problem) in self.back_from_none.iter_mut().enumerate() {
            if self.counts[kind] > 0 {
                self.problems.extend(problem.take());
            }
        }
        for &(line, kind, index) in &self.ahead {
            let count = self.counts[kind];
            // Those of a kind that the file has none of are not looked at.
            if index > count && (count > 0 || kind == 0) {
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
                if let (count @ 1.., first) = self.unknown {
                    repairs.push(Repair::UnknownLinesIgnored { count, first });
                }
                Ok((models, self.names, repairs))
            }
            Err(error) if self.problems.is_empty() => {
                let (line, text) = last;
                Err(Refusal::Problems(vec![LineProblem {
                    line: Some(line),
                    message: format!("{error} in `{}`", excerpt(&text)),
                }]))
            }
            _ => Err(Refusal::Problems(self.problems)),
        }
    }

    fn problem(&mut self, message: String) {
        if self.problems.len() < MAX_PROBLEMS {
            self.problems.push(LineProblem {
                line: Some(self.file.number()),
                message,
            });
        }
    }

    /// The next lines to hand on; `None` at the end of what can be read.
    pub fn next_block(&mut self) -> Option<Block> {
        let mut raw = std::mem::take(&mut self.raw);
        while self.block.text.len() < BLOCK {
            match self.file.next(&mut raw) {
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
            if self.file.number() == 1 {
                self.judge_beginning(&raw);
            }
            if raw.contains(&0) && !self.ended {
                self.problem("expected text, found a byte of value 0".to_owned());
                self.ended = true;
            }
            if self.ended {
                break;
            }
            self.line(&raw);
            if self.block.text.len() > self.start {
                let end = self.block.text.len();
                self.block.origins.push((end, self.file.number()));
            }
        }
        self.raw = raw;
        let block = std::mem::take(&mut self.block);
        (!block.text.is_empty()).then_some(block)
    }

    /// Files of other formats would give as many problems as they have lines.
    fn judge_beginning(&mut self, line: &[u8]) {
        let found = OTHER_FORMATS
            .iter()
            .find(|(beginning, _)| line.starts_with(beginning));
        if let Some((_, format)) = found {
            self.problem(format!("expected a Wavefront OBJ file, found {format}"));
            self.ended = true;
        }
    }

    fn line(&mut self, line: &[u8]) {
        let line = line
            .strip_prefix("\u{feff}".as_bytes())
            .unwrap_or(line)
            .trim_ascii();
        let end = line.iter().position(|byte| byte.is_ascii_whitespace());
        let (keyword, rest) = line.split_at(end.unwrap_or(line.len()));
        match keyword {
            b"v" if self.wanted.colors => self.numbers("v", rest, [6, 6], 0),
            b"v" => self.numbers("v", rest, [3, 3], 0),
            b"vt" if self.wanted.uvs => self.numbers("vt", rest, [1, 2], 1),
            b"vn" if self.wanted.normals => self.numbers("vn", rest, [3, 3], 2),
            b"vt" => self.counts[1] += 1,
            b"vn" => self.counts[2] += 1,
            // `fo` is how old files begin faces.
            b"f" | b"fo" => self.face(rest),
            b"l" | b"p" | b"curv" | b"curv2" | b"surf" | b"bsp" | b"bzp" | b"cdc" | b"cdp" => {
                self.points_and_lines += 1;
            }
            b"o" | b"g" => {
                self.faces = 0;
                self.hand_on(format_args!("o"));
            }
            b"usemtl" => self.material(rest.trim_ascii()),
            b"call" | b"csh" => {
                let word = excerpt_of_bytes(keyword);
                self.problem(format!("`{word}` takes in another file, which is not read"));
            }
            b"" => {}
            _ if keyword[0] == b'#' || OF_NO_USE.contains(&keyword) => {}
            _ => {
                self.unknown.0 += 1;
                if self.unknown.0 == 1 {
                    self.unknown.1 = self.file.number();
                }
            }
        }
    }

    fn hand_on(&mut self, line: std::fmt::Arguments) {
        writeln!(self.block.text, "{line}").expect("writing to memory does not fail");
    }

    /// Hands on a vertex, texture coordinate or normal of `least` numbers or
    /// more, of which `most` count.
    fn numbers(&mut self, keyword: &str, values: &[u8], [least, most]: [usize; 2], kind: usize) {
        self.counts[kind] += 1;
        self.block.text.extend_from_slice(keyword.as_bytes());
        // Only digits, in texts this short, make numbers that are sound.
        let plain = values.len() < 60
            && values
                .iter()
                .all(|byte| byte.is_ascii_digit() || b" \t.-+".contains(byte));
        let mut words = [&b""[..]; 6];
        let mut found = 0;
        for word in Words(values) {
            if found < words.len() {
                words[found] = word;
            }
            found += 1;
        }
        // A fourth number alone is a weight; six are a position and a colour, which
        // few look at.
        let kept = if kind == 0 && found == 4 { 4 } else { most };
        for word in &words[..found.min(kept)] {
            let word = if plain {
                Cow::Borrowed(*word)
            } else {
                self.number(word, kind)
            };
            self.block.text.push(b' ');
            self.block.text.extend_from_slice(&word);
        }
        if found < least {
            self.problem(format!(
                "expected {least} numbers after `{keyword}`, found {found}"
            ));
        }
        for _ in found..most {
            self.block.text.extend_from_slice(b" 0");
        }
        self.block.text.push(b'\n');
        if self
            .problems
            .last()
            .is_some_and(|problem| problem.line == Some(self.file.number()))
        {
            // What follows counts on the vertex.
            self.block.text.truncate(self.start);
            let color = if kind == 0 && most == 6 { " 0 0 0" } else { "" };
            self.hand_on(format_args!("{keyword} 0 0 0{color}"));
        }
    }

    /// A number as the parser reads it; what is none is reported.
    fn number<'a>(&mut self, word: &'a [u8], kind: usize) -> Cow<'a, [u8]> {
        let parsed = std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse::<f32>().ok());
        let number = parsed.or_else(|| is_no_number(word).then_some(f32::NAN));
        match number {
            // Broken normals and texture coordinates can be replaced.
            Some(number) if !number.is_finite() && kind == 0 => {
                let word = excerpt_of_bytes(word);
                self.problem(format!("expected finite coordinates, found `{word}`"));
            }
            Some(number) if !number.is_finite() => return Cow::Borrowed(b"nan"),
            Some(_) => {}
            None => {
                let word = excerpt_of_bytes(word);
                self.problem(format!("expected a number, found `{word}`"));
            }
        }
        Cow::Borrowed(word)
    }

    fn face(&mut self, values: &[u8]) {
        self.block.text.extend_from_slice(b"f");
        let mut corners = 0;
        for corner in Words(values) {
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
    fn corner(&mut self, corner: &[u8]) -> Result<(), String> {
        let mut indices = [0; 3];
        let mut parts = corner.split(|&byte| byte == b'/');
        for (kind, slot) in indices.iter_mut().enumerate() {
            *slot = match parts.next() {
                None | Some(b"") if kind > 0 => continue,
                Some(part) => self.index(part, kind)?,
                None => continue,
            };
        }
        if parts.next().is_some() {
            let corner = excerpt_of_bytes(corner);
            return Err(format!("expected a corner like 1/2/3, found `{corner}`"));
        }
        self.block.text.push(b' ');
        if self.wanted == Wanted::ALL && !corner.contains(&b'-') {
            self.block.text.extend_from_slice(corner);
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
    fn index(&mut self, text: &[u8], kind: usize) -> Result<u64, String> {
        let count = self.counts[kind];
        let given = std::str::from_utf8(text).ok();
        let given = given.and_then(|text| text.parse::<i64>().ok());
        let given = given.ok_or_else(|| {
            let text = excerpt_of_bytes(text);
            format!("expected the index of a {}, found `{text}`", KINDS[kind])
        })?;
        self.named[kind] += 1;
        let index = match u64::try_from(given) {
            Ok(0) => return Err(format!("indices start at 1, found a {} 0", KINDS[kind])),
            Ok(index) => index,
            Err(_) if count == 0 && kind > 0 => {
                // A mistake only if the file has any further on.
                let message = format!("there is no {} {given}: none came before", KINDS[kind]);
                self.back_from_none[kind].get_or_insert(LineProblem {
                    line: Some(self.file.number()),
                    message,
                });
                return Ok(0);
            }
            Err(_) => count
                .checked_add_signed(given.saturating_add(1))
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
            let corner = (self.file.number(), kind, index);
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

    fn material(&mut self, name: &[u8]) {
        let name = match std::str::from_utf8(name) {
            // Blender's for faces of an empty slot.
            Ok("") => {
                self.hand_on_material(NAMELESS, "");
                return;
            }
            Ok(name) => Cow::Borrowed(name),
            // Other encodings can't be told apart; in this one, other bytes are
            // another name.
            Err(_) => name.iter().map(|&byte| char::from(byte)).collect(),
        };
        self.hand_on_material(&name, &name);
    }

    fn hand_on_material(&mut self, handed_on: &str, name: &str) {
        if self.known_names.insert(name.to_owned()) {
            self.names.push(name.to_owned());
            self.hand_on(format_args!("mtllib {handed_on}"));
        }
        self.hand_on(format_args!("usemtl {handed_on}"));
    }
}
