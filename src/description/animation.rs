//! Scenes that move: one scene file, and for each frame a small file of what is
//! otherwise in it.

use super::document::parse;
use super::problem::{Problem, Problems, Sources};
use super::read::describe;
use super::tree::{Kind, Node, Scalar};
use super::{Description, Transform, folder_of, overrides, read_text, tree_of, without_mark};
use crate::numbered::Numbered;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A scene file that names files of frames, parsed once for all of them.
///
/// A frame's file is a mapping from dotted paths, as `-D` takes them, to values:
/// ```yaml
/// camera.transform: {location: [0, -6, 2]}
/// objects.3.transform: {location: [0, 0, 1.2], rotation: [0, 0, 30]}
/// meshes.flag.file: flag_0007.obj
/// ```
/// Changes of the command line come last, and count in all frames.
#[derive(Debug)]
pub struct Animation {
    name: String,
    text: String,
    tree: Node,
    overrides: Vec<(String, String)>,
    files: Numbered,
    camera: Option<Transform>,
    directory: PathBuf,
}

/// A frame's scene.
#[derive(Debug)]
pub struct Frame {
    /// All of it.
    pub description: Description,
    /// What is not as in the scene file.
    pub changes: Changes,
}

/// What may differ from frame to frame, and therefore is not built together with what
/// stands still.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Indices of objects.
    objects: BTreeSet<usize>,
    /// Names of meshes.
    meshes: BTreeSet<String>,
    /// Whether all objects or meshes are replaced together.
    all: bool,
}

impl Changes {
    /// Whether this object, or its mesh, is changed.
    #[must_use]
    pub fn touch(&self, object: usize, mesh: &str) -> bool {
        self.all || self.objects.contains(&object) || self.meshes.contains(mesh)
    }

    fn add(&mut self, path: &[String]) {
        match path {
            [section, index, ..] if section == "objects" => {
                self.objects.extend(index.parse::<usize>());
            }
            [section, mesh, ..] if section == "meshes" => {
                self.meshes.insert(mesh.clone());
            }
            [section] if section == "objects" || section == "meshes" => self.all = true,
            _ => {}
        }
    }
}

impl Animation {
    /// Reads a scene file that names files of frames, and changes values that
    /// `overrides` (dotted path, YAML) name.
    ///
    /// # Errors
    /// All that is wrong with the file and the overrides, and when the scene has no
    /// frames. The files of frames are not opened.
    pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Self, Problems> {
        let name = path.display().to_string();
        let text = read_text(path, &name)?;
        let description = Description::from_str(&text, &name, overrides)?;
        let Some(files) = description.frames else {
            let message = "the key `frames` is missing, so there are no frames to render";
            return Err(Problems::new(vec![Problem::of_source(
                &name,
                message.to_owned(),
            )]));
        };
        let tree = tree_of(&text, &name, &mut Sources::default());
        Ok(Self {
            tree: tree.expect("it could be read before"),
            name,
            text,
            overrides: overrides.to_vec(),
            files,
            camera: description.camera.map(|camera| camera.transform),
            directory: folder_of(path),
        })
    }

    /// Where the camera stands in the scene file.
    #[must_use]
    pub fn camera(&self) -> Option<&Transform> {
        self.camera.as_ref()
    }

    /// The scene of a frame.
    ///
    /// # Errors
    /// All that is wrong with its file, in types, ranges and references alike.
    pub fn frame(&self, number: i32) -> Result<Frame, Problems> {
        let path = self.directory.join(self.files.at(number));
        let name = path.display().to_string();
        let text = read_text(&path, &name)?;
        self.frame_from(&text, &name)
    }

    /// As [`Animation::frame`], from the text of a frame's file.
    ///
    /// # Errors
    /// As [`Animation::frame`].
    pub fn frame_from(&self, text: &str, source_name: &str) -> Result<Frame, Problems> {
        let mut sources = Sources::default();
        sources.add(&self.name, without_mark(&self.text));
        let mut tree = self.tree.clone();
        let text = without_mark(text);
        let source = sources.add(source_name, text);
        let mut changes = Changes::default();
        // A frame without a word is as the scene file has it.
        if let Some(node) = parse(text, source, 0, &mut sources) {
            let found = describe(&node);
            match node.kind {
                Kind::Mapping(values) => {
                    for (key, value) in values.into_entries() {
                        let path =
                            overrides::set(&mut tree, &key.name, key.place, value, &mut sources);
                        changes.add(&path.unwrap_or_default());
                    }
                }
                Kind::Scalar(Scalar::Null) => {}
                _ => sources.report(
                    node.place,
                    String::new(),
                    format!("expected a mapping from paths to values, found {found}"),
                    None,
                ),
            }
        }
        for (path, value) in &self.overrides {
            overrides::apply(&mut tree, path, value, &mut sources);
        }
        let mut description = Description::from_tree(&mut tree, sources)?;
        description.directory.clone_from(&self.directory);
        Ok(Frame {
            description,
            changes,
        })
    }
}
