//! Triangle meshes from Wavefront OBJ files.
//!
//! `tobj` reads them. What it is fed goes through `lines`, which knows the
//! line of every mistake and leaves out what the scene has no use for. The two
//! take turns on one thread, or have one each.

mod assemble;
mod feed;
mod lines;
mod polygons;
mod raw_lines;
mod side;
mod tangents;
mod words;

use lines::Refusal;
use std::collections::BTreeMap;
use std::fmt;
use std::io::{BufRead, BufReader, Seek};
use std::path::Path;

/// Triangles with one index per corner for all that a vertex has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// In metres, in the space of the object. There is capacity for one more,
    /// since Embree reads 16 bytes from the last one.
    pub positions: Vec<[f32; 3]>,
    /// Indices of vertices, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Unit vectors; absent for flat shading.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates, v upwards.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Unit tangents along u, and the sign that makes sign · n × t the bitangent along
    /// v; zero where texture coordinates have no direction. Only
    /// [`Mesh::add_tangents`] makes them.
    pub tangents: Option<Vec<[f32; 4]>>,
    /// Other texture coordinates by name, see [`Mesh::add_uv_map`].
    pub uv_maps: BTreeMap<String, UvMap>,
    /// Colours of vertices by name, as stored, see [`Mesh::add_colors`].
    pub colors: BTreeMap<String, Vec<[f32; 3]>>,
    /// For each triangle an index into `material_names`; absent when all have
    /// the first name, or there is none.
    pub material_of_triangle: Option<Vec<u16>>,
    /// The `usemtl` names in the order of their first use; `""` stands for
    /// faces before the first of them.
    pub material_names: Vec<String>,
}

/// Texture coordinates beside a mesh's first ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UvMap {
    /// For each vertex, v upwards.
    pub uvs: Vec<[f32; 2]>,
    /// As [`Mesh::tangents`].
    pub tangents: Option<Vec<[f32; 4]>>,
}

/// What is to be read beside positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Texture coordinates.
    pub uvs: bool,
    /// Normals; without them shading is flat.
    pub normals: bool,
    /// Colours of vertices, which then all must have one.
    pub colors: bool,
}

impl Wanted {
    /// All that the file has for shapes and textures.
    pub const ALL: Self = Self {
        uvs: true,
        normals: true,
        colors: false,
    };
}

/// What was amiss with a mesh and how it was made good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repair {
    /// So many faces of more than four corners were cut into triangles.
    PolygonsTriangulated(usize),
    /// So many polygons cross themselves or are far from plane, so that what
    /// they cover is a guess.
    PolygonsCrossing(usize),
    /// So many points, lines and curves were left out.
    PointsAndLinesIgnored(usize),
    /// So many triangles without an area were left out.
    DegenerateTrianglesDropped(usize),
    /// So many corners had a normal of length zero or NaN, and got the one of
    /// their triangle.
    NormalsReplaced(usize),
    /// So many triangles are in groups where only some corners have a normal,
    /// and are shaded flat.
    NormalsIncomplete(usize),
    /// So many vertices had no texture coordinates, or infinite ones or NaN,
    /// and got (0, 0).
    UvsReplaced(usize),
    /// So many corners name texture coordinates in a file that has none.
    UvsAbsent(usize),
    /// So many corners name normals in a file that has none.
    NormalsAbsent(usize),
    /// Lines that begin with no word of the format were left out.
    UnknownLinesIgnored {
        /// How many.
        count: usize,
        /// The line of the first, from 1.
        first: usize,
    },
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::PolygonsTriangulated(n) => {
                write!(f, "{n} faces of more than four corners cut into triangles")
            }
            Self::PolygonsCrossing(n) => write!(
                f,
                "{n} polygons that cross themselves or are not plane may be cut wrongly"
            ),
            Self::PointsAndLinesIgnored(n) => write!(f, "{n} points, lines and curves left out"),
            Self::DegenerateTrianglesDropped(n) => write!(f, "{n} triangles without area left out"),
            Self::NormalsReplaced(n) => write!(
                f,
                "{n} corners without a usable normal given their triangle's"
            ),
            Self::NormalsIncomplete(n) => {
                write!(f, "{n} triangles shaded flat, since corners lack normals")
            }
            Self::UvsReplaced(n) => write!(
                f,
                "{n} vertices without usable texture coordinates given (0, 0)"
            ),
            Self::UvsAbsent(n) => write!(
                f,
                "{n} corners name texture coordinates, of which the file has none: read without"
            ),
            Self::NormalsAbsent(n) => write!(
                f,
                "{n} corners name normals, of which the file has none: shaded flat"
            ),
            Self::UnknownLinesIgnored { count, first } => write!(
                f,
                "{count} lines that begin with no known word left out, the first in line {first}"
            ),
        }
    }
}

/// Why a mesh can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", .problems.iter().map(|problem| format!("{source_name}{problem}")).collect::<Vec<_>>().join("\n"))]
pub struct MeshError {
    /// The file.
    pub source_name: String,
    /// What is wrong with it; never empty.
    pub problems: Vec<LineProblem>,
}

/// What is wrong with a line, or with a whole file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LineProblem {
    /// Counted from 1; absent when the file as a whole is meant.
    pub line: Option<usize>,
    /// What was expected and what was found.
    pub message: String,
}

impl LineProblem {
    fn of_file(error: &std::io::Error) -> Self {
        Self {
            line: None,
            message: format!("the mesh can't be read: {error}"),
        }
    }
}

impl fmt::Display for LineProblem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, ":{line}: {}", self.message),
            None => write!(f, ": {}", self.message),
        }
    }
}

impl Mesh {
    /// Reads an OBJ file, all groups into one mesh. Material libraries are not
    /// opened: `usemtl` names are all that counts.
    ///
    /// # Errors
    /// When the file can't be read, has no triangles, or has lines that make
    /// no sense.
    pub fn load(path: &Path, wanted: Wanted) -> Result<(Self, Vec<Repair>), MeshError> {
        let name = path.display().to_string();
        let file = crate::file::open(path).map_err(|error| MeshError {
            source_name: name.clone(),
            problems: vec![LineProblem {
                line: None,
                message: format!("the mesh can't be opened: {error}"),
            }],
        })?;
        Self::read(BufReader::with_capacity(1 << 16, file), &name, wanted)
    }

    /// As [`Mesh::load`], from anything that gives bytes.
    ///
    /// # Errors
    /// As [`Mesh::load`]; `source_name` stands for the file's name.
    pub fn read(
        mut reader: impl BufRead + Seek + Send,
        source_name: &str,
        wanted: Wanted,
    ) -> Result<(Self, Vec<Repair>), MeshError> {
        let result = match read_once(&mut reader, wanted) {
            // That there is none shows at the end, when faces have been read with them.
            Err(Refusal::Absent { present, repairs }) => reader
                .rewind()
                .map_err(|error| Refusal::Problems(vec![LineProblem::of_file(&error)]))
                .and_then(|()| read_once(&mut reader, present))
                .map(|(mesh, others)| (mesh, [repairs, others].concat())),
            result => result,
        };
        result.map_err(|refusal| MeshError {
            source_name: source_name.to_owned(),
            problems: match refusal {
                Refusal::Problems(problems) => problems,
                Refusal::Absent { .. } => unreachable!("the second time it is not wanted"),
            },
        })
    }
}

fn read_once(
    reader: &mut (impl BufRead + Send),
    wanted: Wanted,
) -> Result<(Mesh, Vec<Repair>), Refusal> {
    let mut lines = lines::Lines::new(reader, wanted);
    let options = tobj::LoadOptions {
        single_index: true,
        ..Default::default()
    };
    let (loaded, last) = feed::parse(&mut lines, &options);
    let (models, names, repairs) = lines.finish(loaded, last)?;
    assemble::assemble(models, names, repairs, wanted).map_err(Refusal::Problems)
}
