//! What types can't say: ranges, references and shapes that make no sense.

use super::mixes;
use super::problem::{Place, Sources, nearest};
use super::tree::{Node, Step, dotted};
use super::{
    Aperture, AreaShape, Assignment, Camera, Color, Description, Film, Filter, Light, LightKind,
    Material, Object, Opening, Projection, Relief, Sampling, Scalar, Transform, ViewTransform,
    World,
};
use crate::film::Aov;
use crate::rays::RayKind;
use crate::text::excerpt;
use std::collections::{BTreeMap, BTreeSet};

/// In pixels. More would need over 10 GB for the sums alone.
const MAX_SIDE: u32 = 32_768;

/// Why the camera is not among what things are hidden from.
const CAMERA: (RayKind, &str) = (
    RayKind::Camera,
    "for the camera there is the key `visible_to_camera`",
);

/// Checks a description against the tree it came from; gives
/// [`Description::places`].
pub(super) fn description(
    description: &Description,
    tree: &Node,
    sources: &mut Sources,
) -> BTreeMap<String, String> {
    let mut check = Check {
        tree,
        sources,
        in_scene: true,
        places: BTreeMap::new(),
    };
    let root = At::root();
    if description.version != 1 {
        check.report(
            root.key("smithwalk"),
            format!("expected version 1, found {}", description.version),
        );
    }
    if let Some(camera) = &description.camera {
        check.camera(camera, root.key("camera"));
    }
    check.film(&description.film, root.key("film"));
    check.sampling(&description.sampling, root.key("sampling"));
    if let Some(world) = &description.world {
        check.world(world, root.key("world"));
    }
    for (name, texture) in &description.textures {
        texture.check(
            &description.meshes,
            &mut check,
            root.key("textures").key(name),
        );
    }
    for (name, material) in &description.materials {
        material.check(&mut check, root.key("materials").key(name));
    }
    check.mixes(description);
    for (index, object) in description.objects.iter().enumerate() {
        check.object(object, root.key("objects").index(index));
    }
    for (index, light) in description.lights.iter().enumerate() {
        check.light(light, root.key("lights").index(index));
    }
    check.places
}

/// Checks a material that stands alone.
pub(super) fn material(material: &Material, tree: &Node, sources: &mut Sources) {
    let mut check = Check {
        tree,
        sources,
        in_scene: false,
        places: BTreeMap::new(),
    };
    material.check(&mut check, At::root());
}

/// A path into the tree as it was deserialised.
#[derive(Clone)]
pub(super) struct At(Vec<Step>);

impl At {
    fn root() -> Self {
        Self(Vec::new())
    }

    pub(super) fn key(&self, key: &str) -> Self {
        Self([&self.0[..], &[Step::Key(key.to_owned())]].concat())
    }

    pub(super) fn index(&self, index: usize) -> Self {
        Self([&self.0[..], &[Step::Index(index)]].concat())
    }
}

/// The values a number may have.
#[derive(Clone, Copy)]
pub(super) enum Range {
    Positive,
    NonNegative,
    /// Both ends included.
    Within(f32, f32),
    /// The upper end included.
    Above(f32, f32),
    /// Neither end included.
    Between(f32, f32),
}

impl Range {
    pub(super) const UNIT: Self = Self::Within(0.0, 1.0);

    fn contains(self, value: f32) -> bool {
        match self {
            Self::Positive => value > 0.0,
            Self::NonNegative => value >= 0.0,
            Self::Within(low, high) => low <= value && value <= high,
            Self::Above(low, high) => low < value && value <= high,
            Self::Between(low, high) => low < value && value < high,
        }
    }

    fn words(self) -> String {
        match self {
            Self::Positive => "a number above 0".to_owned(),
            Self::NonNegative => "a number, 0 or more".to_owned(),
            Self::Within(low, high) => format!("a number from {low} to {high}"),
            Self::Above(low, high) => format!("a number above {low} and up to {high}"),
            Self::Between(low, high) => format!("a number above {low} and below {high}"),
        }
    }
}

/// What transforms are for: those that look need a direction, those that hold
/// surfaces a volume.
#[derive(Clone, Copy, PartialEq)]
enum Use {
    Surface,
    Direction,
}

pub(super) struct Check<'a, 's> {
    tree: &'a Node,
    sources: &'a mut Sources<'s>,
    /// Whether there are materials and textures to name.
    in_scene: bool,
    places: BTreeMap<String, String>,
}

impl Check<'_, '_> {
    pub(super) fn report(&mut self, at: At, message: String) {
        self.report_near(at, message, None);
    }

    fn report_near(&mut self, At(steps): At, message: String, nearest: Option<String>) {
        let (node, path) = self.tree.descend(&steps);
        // A value that the file leaves out has the place of what lacks it.
        let place: Place = node.place;
        self.sources.report(place, dotted(&path), message, nearest);
    }

    /// Keeps where a material looks along the surface, see [`Description::places`].
    pub(super) fn needs_uvs(&mut self, at: &At) {
        if let [Step::Key(_), Step::Key(material), ..] = &at.0[..] {
            self.keep_place(format!("material {material}"), at);
        }
    }

    /// A name that meshes give to what their vertices have.
    pub(super) fn attribute<'n>(
        &mut self,
        what: &str,
        name: &str,
        known: impl Iterator<Item = &'n String> + Clone,
        at: At,
    ) {
        if known.clone().any(|known| known == name) {
            self.keep_place(format!("{what} {name}"), &at);
            return;
        }
        let nearest = nearest(name, known.map(String::as_str));
        let message = format!("no mesh has the {what} `{}`", excerpt(name));
        self.report_near(at, message, nearest);
    }

    fn keep_place(&mut self, of: String, At(steps): &At) {
        let (node, path) = self.tree.descend(steps);
        let place = self.sources.describe(node.place, &dotted(&path));
        self.places.entry(of).or_insert(place);
    }

    pub(super) fn relief(&mut self, relief: Relief<'_>, at: &At) {
        if let Some(normal) = relief.normal {
            normal.check(self, at.key("normal"));
        }
        if let Some(bump) = relief.bump {
            bump.check(self, at.key("bump"));
        }
    }

    pub(super) fn number(&mut self, value: f32, range: Range, at: At) {
        if !range.contains(value) {
            self.report(at, format!("expected {}, found {value}", range.words()));
        }
    }

    pub(super) fn scalar(&mut self, scalar: &Scalar, range: Range, at: At) {
        match scalar {
            Scalar::Value(value) => self.number(*value, range, at),
            Scalar::Texture { name, .. } => {
                self.reference("textures", "texture", name, at.key("texture"))
            }
        }
    }

    /// A colour whose channels are all in one range.
    pub(super) fn triple(&mut self, channels: [f32; 3], range: Range, at: At) {
        if let Some(value) = channels.into_iter().find(|&value| !range.contains(value)) {
            self.report(
                at,
                format!("expected {} in each channel, found {value}", range.words()),
            );
        }
    }

    pub(super) fn color(&mut self, color: &Color, range: Range, at: At) {
        match color {
            Color::Value(channels) => self.triple(*channels, range, at),
            Color::Texture(name) => self.reference("textures", "texture", name, at.key("texture")),
        }
    }

    /// Names of faulty things are known, too: the fault is enough to report.
    pub(super) fn reference(&mut self, section: &str, what: &str, name: &str, at: At) {
        if !self.in_scene {
            self.report(
                at,
                format!(
                    "expected a value, found the {what} `{}`: there is no scene to take it from",
                    excerpt(name)
                ),
            );
            return;
        }
        let names = self
            .tree
            .get(section)
            .map(Node::entries)
            .unwrap_or_default();
        if self
            .tree
            .get(section)
            .is_some_and(|names| names.get(name).is_some())
        {
            return;
        }
        let nearest = nearest(name, names.iter().map(|(key, _)| &*key.name));
        self.report_near(
            at,
            format!("there is no {what} `{}`", excerpt(name)),
            nearest,
        );
    }

    fn transform(&mut self, transform: &Transform, usage: Use, at: At) {
        match *transform {
            Transform::LookAt { from, to, up } => {
                let at = at.key("look_at");
                let [from, to, up] = [from, to, up].map(|v| glam::DVec3::from(v.map(f64::from)));
                let along = to - from;
                if along.length() == 0.0 {
                    self.report(
                        at.key("to"),
                        "`from` and `to` are the same point".to_owned(),
                    );
                } else if up.length() == 0.0 {
                    self.report(
                        at.key("up"),
                        "expected a direction, found the zero vector".to_owned(),
                    );
                } else if along.normalize().cross(up.normalize()).length() < 1e-6 {
                    let message =
                        "`up` is parallel to the direction from `from` to `to`".to_owned();
                    self.report(
                        if self.given(&at, "up") {
                            at.key("up")
                        } else {
                            at
                        },
                        message,
                    );
                }
            }
            Transform::Parts { scale, .. } => {
                if usage == Use::Surface && scale.contains(&0.0) {
                    self.report(
                        at.key("scale"),
                        "expected factors other than 0: this flattens the object".to_owned(),
                    );
                }
            }
            Transform::Matrix(rows) => {
                let at = at.key("matrix");
                if rows[3] != [0.0, 0.0, 0.0, 1.0] {
                    self.report(at.index(3), "expected the last row [0, 0, 0, 1]".to_owned());
                    return;
                }
                let column = |c: usize| {
                    glam::DVec3::new(rows[0][c].into(), rows[1][c].into(), rows[2][c].into())
                };
                let [x, y, z] = [column(0), column(1), column(2)];
                // The volume of the unit cube's image, relative to its edges.
                let volume = x.dot(y.cross(z)).abs();
                let edges = x.length() * y.length() * z.length();
                if edges == 0.0 || volume < 1e-9 * edges {
                    self.report(
                        at,
                        "this matrix has no inverse: it flattens what it is applied to".to_owned(),
                    );
                }
            }
        }
    }

    fn given(&self, At(steps): &At, key: &str) -> bool {
        self.tree.descend(steps).0.get(key).is_some()
    }

    fn camera(&mut self, camera: &Camera, at: At) {
        self.transform(&camera.transform, Use::Direction, at.key("transform"));
        let projection = at.key("projection");
        match &camera.projection {
            Projection::Perspective(perspective) => {
                let at = projection.key("perspective");
                match perspective.opening {
                    Opening::Fov(degrees) => {
                        self.number(degrees, Range::Between(0.0, 180.0), at.key("fov"))
                    }
                    Opening::Lens(millimetres) => {
                        self.number(millimetres, Range::Positive, at.key("lens"))
                    }
                }
                self.number(
                    perspective.sensor_width,
                    Range::Positive,
                    at.key("sensor_width"),
                );
                self.number(
                    perspective.sensor_height,
                    Range::Positive,
                    at.key("sensor_height"),
                );
                self.number(
                    perspective.pixel_aspect,
                    Range::Positive,
                    at.key("pixel_aspect"),
                );
            }
            Projection::Orthographic(orthographic) => {
                self.number(
                    orthographic.scale,
                    Range::Positive,
                    projection.key("orthographic").key("scale"),
                );
            }
        }
        if let Some(lens) = &camera.depth_of_field {
            let at = at.key("depth_of_field");
            match lens.aperture {
                Aperture::FStop(fstop) => self.number(fstop, Range::Positive, at.key("fstop")),
                Aperture::Radius(metres) => {
                    self.number(metres, Range::NonNegative, at.key("aperture_radius"))
                }
            }
            self.number(
                lens.focus_distance,
                Range::Positive,
                at.key("focus_distance"),
            );
        }
        if let Some([near, far]) = camera.clip {
            self.number(near, Range::NonNegative, at.key("clip").index(0));
            if far <= near {
                let message = format!("expected more than the near plane's {near} m, found {far}");
                self.report(at.key("clip").index(1), message);
            }
        }
    }

    fn film(&mut self, film: &Film, at: At) {
        for (key, side) in [("width", film.width), ("height", film.height)] {
            if !(1..=MAX_SIDE).contains(&side) {
                self.report(
                    at.key(key),
                    format!("expected 1 to {MAX_SIDE} pixels, found {side}"),
                );
            }
        }
        if let Filter::BlackmanHarris { width } = film.filter {
            let at = at.key("filter").key("blackman_harris").key("width");
            self.number(width, Range::Above(0.0, 16.0), at);
        }
        self.number(
            film.exposure,
            Range::Within(-32.0, 32.0),
            at.key("exposure"),
        );
        self.number(film.gain, Range::NonNegative, at.key("gain"));
        if let Some(ViewTransform { log2, .. }) = &film.view {
            let at = at.key("view").key("log2");
            self.number(log2.offset, Range::NonNegative, at.key("offset"));
            if log2.min >= log2.max {
                let (min, max) = (log2.min, log2.max);
                let message = format!("expected more than min, {min}, found {max}");
                self.report(at.key("max"), message);
            }
        }
        let mut seen = BTreeSet::new();
        for (index, aov) in film.aovs.iter().enumerate() {
            if *aov == Aov::Alpha {
                let message = "alpha comes with `film.transparent`".to_owned();
                self.report(at.key("aovs").index(index), message);
            }
            if !seen.insert(*aov) {
                self.report(
                    at.key("aovs").index(index),
                    "this image is asked for twice".to_owned(),
                );
            }
        }
    }

    fn sampling(&mut self, sampling: &Sampling, at: At) {
        if sampling.spp == 0 {
            self.report(
                at.key("spp"),
                "expected at least 1 sample per pixel, found 0".to_owned(),
            );
        }
        let most = Sampling::MOST_BRANCHES;
        if let Some(found) = sampling.branches.filter(|b| !(1..=most).contains(b)) {
            self.report(
                at.key("branches"),
                format!("expected 1 to {most} branches per path, found {found}"),
            );
        }
    }

    fn world(&mut self, world: &World, at: At) {
        let (kind, color, strength) = match world {
            World::Constant {
                color, strength, ..
            } => ("constant", *color, *strength),
            World::Environment {
                color, strength, ..
            } => ("environment", *color, *strength),
        };
        self.triple(color, Range::NonNegative, at.key(kind).key("color"));
        self.number(strength, Range::NonNegative, at.key(kind).key("strength"));
        let (World::Constant { hidden_from, .. } | World::Environment { hidden_from, .. }) = world;
        let refused = [(RayKind::Shadow, "shadow rays never meet the world")];
        self.hidden_from(hidden_from, &refused, at.key(kind));
    }

    /// Mixes that contain themselves.
    fn mixes(&mut self, description: &Description) {
        for (name, fault) in mixes::endless(&description.materials) {
            self.report(At::root().key("materials").key(name), fault);
        }
    }

    /// Kinds of rays that make no sense there, each with why.
    fn hidden_from(&mut self, hidden: &[RayKind], refused: &[(RayKind, &str)], at: At) {
        for (index, kind) in hidden.iter().enumerate() {
            if let Some((_, why)) = refused.iter().find(|(refused, _)| refused == kind) {
                self.report(at.key("hidden_from").index(index), (*why).to_owned());
            }
        }
    }

    fn object(&mut self, object: &Object, at: At) {
        self.hidden_from(&object.hidden_from, &[CAMERA], at.clone());
        self.reference("meshes", "mesh", &object.mesh, at.key("mesh"));
        self.transform(&object.transform, Use::Surface, at.key("transform"));
        match &object.materials {
            Assignment::All(name) => {
                self.reference("materials", "material", name, at.key("material"))
            }
            Assignment::BySlot(slots) => {
                for (slot, name) in slots {
                    self.reference("materials", "material", name, at.key("materials").key(slot));
                }
            }
            Assignment::FromMesh => {}
        }
    }

    fn light(&mut self, light: &Light, at: At) {
        let at = match light.kind {
            LightKind::Point { power, radius, .. } => {
                let at = at.key("point");
                self.number(power, Range::NonNegative, at.key("power"));
                self.number(radius, Range::NonNegative, at.key("radius"));
                at
            }
            LightKind::Spot {
                power,
                size,
                blend,
                radius,
            } => {
                let at = at.key("spot");
                self.number(power, Range::NonNegative, at.key("power"));
                self.number(size, Range::Above(0.0, 180.0), at.key("size"));
                self.number(blend, Range::UNIT, at.key("blend"));
                self.number(radius, Range::NonNegative, at.key("radius"));
                at
            }
            LightKind::Sun { strength, angle } => {
                let at = at.key("sun");
                self.number(strength, Range::NonNegative, at.key("strength"));
                self.number(angle, Range::Within(0.0, 180.0), at.key("angle"));
                at
            }
            LightKind::Area {
                power,
                shape,
                spread,
            } => {
                let at = at.key("area");
                self.number(power, Range::NonNegative, at.key("power"));
                self.number(spread, Range::Above(0.0, 180.0), at.key("spread"));
                let (kind, width, height) = match shape {
                    AreaShape::Rectangle { width, height } => ("rectangle", width, height),
                    AreaShape::Disk { width, height } => ("disk", width, height),
                };
                let shape = at.key("shape").key(kind);
                self.number(width, Range::Positive, shape.key("width"));
                self.number(height, Range::Positive, shape.key("height"));
                at
            }
        };
        let usage = match light.kind {
            LightKind::Area { .. } => Use::Surface,
            _ => Use::Direction,
        };
        let refused = [CAMERA, (RayKind::Shadow, "shadow rays end at lights")];
        self.hidden_from(&light.hidden_from, &refused, at.clone());
        self.transform(&light.transform, usage, at.key("transform"));
        self.triple(light.color, Range::NonNegative, at.key("color"));
        self.number(
            light.exposure,
            Range::Within(-32.0, 32.0),
            at.key("exposure"),
        );
    }
}
