//! One camera path: unidirectional path tracing with light samples at every
//! vertex, combined with BSDF sampling by the power heuristic.

use std::ops::Range;

use arrayvec::ArrayVec;
use glam::Vec3;

use crate::bsdf::{Bsdf, ByOrder, InLanes, ScatterSample};
use crate::color::Rgb;
use crate::embree::Ray;
use crate::features::{Features, has};
use crate::film::{Aov, Sample};
use crate::light::{EmitterId, LightSample, Receiver};
use crate::sampler::{Dimension, Purpose, Sampler};
use crate::scene::{RenderSettings, Scene, Surface, View};
use smithwalk_model::LANES;

use super::split::Spread;
use super::sum::{Sum, mean};

/// Surfaces that a ray may pass straight through before it counts as stuck.
const MAX_STRAIGHT: u32 = 256;

/// Where shadow rays to points of the scene's own meshes end, as a share of the
/// distance: short of the emitting triangle itself.
const SHORT_OF_EMITTER: f32 = 1.0 - 1e-4;

/// The least probability that Russian roulette lets a path go on with: bounds
/// the factor on what survives.
const MIN_SURVIVAL: f32 = 0.05;

/// How often a light sample is evaluated at once where that takes little
/// longer than once.
const EVALUATIONS: usize = 2;

/// The least number of branches or light samples that are worth lanes.
const WORTH_LANES: usize = 3;

/// Light carried by one path, and what its first hit looked like.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathResult {
    /// Radiance, W·m⁻²·sr⁻¹.
    pub radiance: ByOrder,
    /// What the first surface is, if the camera ray met one.
    pub first: Option<FirstHit>,
    /// Rays traced, shadow rays among them.
    pub rays: u32,
    /// How the light samples at the first surface that scatters differ.
    pub light_samples: Spread,
    /// How the branches behind it differ.
    pub branches: Spread,
}

/// What AOVs say about the first surface.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// See [`crate::scene::Material::albedo`].
    pub albedo: Rgb,
    /// Shading normal, world space, on the viewer's side.
    pub normal: Vec3,
    /// Distance along the camera ray, metres.
    pub distance: f32,
}

impl PathResult {
    /// As the film takes it; `depth_scale` turns the distance along the ray
    /// into the depth along the view axis.
    #[must_use]
    pub fn to_sample(self, depth_scale: f32) -> Sample {
        let sample = Sample::of(self.radiance.total().to_array())
            .with(Aov::Single, self.radiance.single.to_array())
            .with(Aov::Multiple, self.radiance.multiple.to_array());
        match self.first {
            Some(first) => sample
                .with(Aov::Albedo, first.albedo.to_array())
                .with(Aov::Normal, first.normal.to_array())
                .with(Aov::Depth, [first.distance * depth_scale; 3]),
            None => sample,
        }
    }
}

/// Into what a camera path splits at the first surface that scatters it: each
/// draws the numbers of an index of its own from the pixel's [`Sampler`].
#[derive(Clone, Debug)]
pub struct Split {
    /// Ways in which it goes on.
    pub branches: Range<u32>,
    /// Samples of the light that arrives there directly.
    pub light_samples: Range<u32>,
}

impl std::ops::AddAssign for PathResult {
    /// Adds the light and the rays of a part of the path behind its first surface.
    fn add_assign(&mut self, rest: Self) {
        self.radiance += rest.radiance;
        self.rays += rest.rays;
    }
}

/// A path on its way.
#[derive(Clone)]
struct Path {
    ray: Ray,
    throughput: Rgb,
    /// Whether some surface has scattered it more than once.
    multiple: bool,
    last: Vertex,
    /// Surfaces met, which address random numbers.
    vertex: u32,
    /// Those of them that scattered it.
    bounce: u32,
    /// Distance from the ray's start to the surface that scatters next.
    travelling: f32,
}

impl Path {
    fn from_camera(ray: Ray) -> Self {
        Self {
            ray,
            throughput: Rgb::ONE,
            multiple: false,
            last: Vertex {
                receiver: ray.origin.into(),
                pdf: None,
                travelled: 0.0,
            },
            vertex: 0,
            bounce: 0,
            travelling: 0.0,
        }
    }

    /// Straight on behind a surface met at distance `t`.
    fn pass_through(&mut self, surface: &Surface, t: f32) {
        self.vertex += 1;
        self.last.travelled += t;
        self.ray = surface.spawn(self.ray.direction);
    }

    /// Who looks at the surface that the ray meets.
    fn view(&self) -> View {
        View {
            wo: -self.ray.direction,
            camera: self.bounce == 0,
        }
    }

    fn deposit(&self, radiance: &mut ByOrder, light: Rgb) {
        let light = self.throughput * light;
        if self.multiple {
            radiance.multiple += light;
        } else {
            radiance.single += light;
        }
    }
}

/// The last vertex that light samples could have continued from.
#[derive(Clone)]
struct Vertex {
    /// Where it is, as light samples there had it.
    receiver: Receiver,
    /// Density of the direction taken, sr⁻¹; `None` where no light sample
    /// competes: at the camera and after single directions.
    pdf: Option<f32>,
    /// Distance from there to where the current ray starts: more than
    /// zero after passing straight through surfaces.
    travelled: f32,
}

/// Traces paths through `scene`, with code for the features `F` alone.
pub struct PathTracer<'a, const F: u32> {
    scene: &'a Scene,
    settings: &'a RenderSettings,
    /// Whether the first hit's AOVs are wanted.
    describe_first: bool,
    /// Whether it is to be told how the draws at the first surface differ.
    pilot: bool,
}

impl<'a, const F: u32> PathTracer<'a, F> {
    /// A tracer for a scene whose features are all in `F`.
    ///
    /// # Panics
    /// When they are not.
    #[must_use]
    pub fn new(scene: &'a Scene, settings: &'a RenderSettings, pilot: bool) -> Self {
        assert!(
            Features::from_bits(F).contains(scene.features),
            "the kernel lacks a feature"
        );
        Self {
            scene,
            settings,
            describe_first: settings.aovs.iter().any(Aov::is_of_first_hit),
            pilot,
        }
    }

    /// The light that arrives along `ray` at the camera. From the first surface
    /// that scatters on, the path goes on in several ways, the average of which
    /// counts, and so does that of several light samples there.
    pub fn trace(&self, ray: Ray, sampler: &mut Sampler, split: Split) -> PathResult {
        let mut result = PathResult::default();
        let mut trunk = Path::from_camera(ray);
        let Some(surface) = self.next_surface(&mut trunk, &mut result) else {
            return result;
        };
        let bsdf = self.scene.bsdf::<F>(&surface, trunk.view());
        let most = split.light_samples.len().max(split.branches.len());
        let lanes = (most >= WORTH_LANES).then(|| bsdf.in_lanes()).flatten();
        if has::<F>(Features::LIGHT_SAMPLING) {
            let indices = split.light_samples;
            let at_once = lanes.as_ref().filter(|_| indices.len() >= WORTH_LANES);
            let (light, spread) = if let Some(lanes) = at_once {
                self.connect_in_lanes(indices, &trunk, &surface, &bsdf, lanes, sampler)
            } else {
                mean(indices, self.pilot, sampler, |_, sampler, result| {
                    self.connect(&trunk, &surface, &bsdf, sampler, result);
                })
            };
            result += light;
            result.light_samples = spread;
        }
        let first = split.branches.start;
        let lanes = lanes.filter(|_| split.branches.len() >= WORTH_LANES);
        let mut ahead = ArrayVec::<_, LANES>::new();
        let trace = |index: u32, sampler: &mut Sampler, result: &mut PathResult| {
            let mut path = trunk.clone();
            let mut goes_on = if let Some(lanes) = &lanes {
                let lane = (index - first) as usize % LANES;
                if lane == 0 {
                    let mut stream =
                        sampler.lane_stream(trunk.vertex, Purpose::Sample, |i| index + i as u32);
                    ahead = lanes.sample(-trunk.ray.direction, &mut stream).into();
                }
                ahead[lane].is_some_and(|(sample, pdf)| {
                    self.follow(&mut path, &surface, sampler, sample, Some(pdf))
                })
            } else {
                self.scatter(&mut path, &surface, &bsdf, sampler)
            };
            while goes_on {
                let Some(surface) = self.next_surface(&mut path, result) else {
                    break;
                };
                let bsdf = self.scene.bsdf::<F>(&surface, path.view());
                self.connect(&path, &surface, &bsdf, sampler, result);
                goes_on = self.scatter(&mut path, &surface, &bsdf, sampler);
            }
        };
        let (light, spread) = mean(split.branches, self.pilot, sampler, trace);
        result += light;
        result.branches = spread;
        result
    }

    /// Follows the path to the next surface that may scatter it, and takes up
    /// the light on the way; `None` when the path ends.
    fn next_surface(&self, path: &mut Path, result: &mut PathResult) -> Option<Surface> {
        loop {
            let camera = path.bounce == 0;
            result.rays += 1;
            let hit = self.scene.accelerator.intersect(path.ray);
            let t_far = hit.map(|h| h.t);
            let mut emitted = self.analytic_lights(&path.ray, t_far, &path.last, camera);
            let Some(hit) = hit else {
                emitted += self.world(&path.last, path.ray.direction);
                path.deposit(&mut result.radiance, emitted);
                return None;
            };
            let surface = self.scene.surface::<F>(&path.ray, &hit);
            if has::<F>(Features::HIDDEN_OBJECTS)
                && camera
                && path.vertex < MAX_STRAIGHT
                && !self.scene.objects[surface.object].visible_to_camera
            {
                path.deposit(&mut result.radiance, emitted);
                path.pass_through(&surface, hit.t);
                continue;
            }
            if has::<F>(Features::EMISSIVE_MESHES) {
                emitted += self.surface_emission(&surface, path.view(), &path.last);
            }
            path.deposit(&mut result.radiance, emitted);
            if self.describe_first && camera && result.first.is_none() {
                result.first = Some(FirstHit {
                    albedo: self.scene.albedo(&surface, path.view()),
                    normal: surface.normal,
                    distance: path.last.travelled + hit.t,
                });
            }
            if path.bounce <= self.settings.max_bounces {
                path.travelling = hit.t;
                return Some(surface);
            }
            // No more scattering, but what goes straight through still arrives.
            if !has::<F>(Features::TRANSPARENCY) || path.vertex >= MAX_STRAIGHT {
                return None;
            }
            path.throughput *= self.scene.bsdf::<F>(&surface, path.view()).transparency();
            if path.throughput == Rgb::ZERO {
                return None;
            }
            path.pass_through(&surface, hit.t);
        }
    }

    /// Adds a light sample at a surface that `path` has come to.
    fn connect(
        &self,
        path: &Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        sampler: &mut Sampler,
        result: &mut PathResult,
    ) {
        if !has::<F>(Features::LIGHT_SAMPLING) || !bsdf.has_smooth() {
            return;
        }
        let wo = -path.ray.direction;
        let direct = self.direct(surface, bsdf, wo, path.vertex, sampler, &mut result.rays);
        if path.multiple {
            result.radiance.multiple += path.throughput * direct.total();
        } else {
            result.radiance += direct * path.throughput;
        }
    }

    /// The mean of these light samples at the first surface, each of them evaluated
    /// several times at once.
    fn connect_in_lanes(
        &self,
        indices: Range<u32>,
        path: &Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        lanes: &InLanes<'_, F>,
        sampler: &mut Sampler,
    ) -> (PathResult, Spread) {
        let wo = -path.ray.direction;
        let vertex = path.vertex;
        let mut sum = Sum::new(indices.len(), self.pilot);
        let mut lit = ArrayVec::<(u32, Vec3, Rgb), { LANES / EVALUATIONS }>::new();
        for index in indices.clone() {
            sampler.set_index(index);
            let rays = &mut sum.result.rays;
            if let Some((wi, light)) = self.arriving(surface, bsdf, wo, vertex, sampler, rays) {
                lit.push((index, wi, light));
            }
            if lit.is_full() || (index + 1 == indices.end && !lit.is_empty()) {
                // Lanes that are left over look at the last one again, for nothing.
                let lane = |lane: usize| lit[(lane / EVALUATIONS).min(lit.len() - 1)];
                let mut stream = sampler.lane_stream(vertex, Purpose::Light, |i| {
                    lane(i).0 * EVALUATIONS as u32 + (i % EVALUATIONS) as u32
                });
                let wi = std::array::from_fn(|i| lane(i).1);
                let values = lanes.eval(wo, wi, &mut stream);
                for (&(_, _, light), values) in lit.iter().zip(values.chunks_exact(EVALUATIONS)) {
                    let mut value = ByOrder::ZERO;
                    for &evaluated in values {
                        value += evaluated;
                    }
                    let share = path.throughput * light * (1.0 / EVALUATIONS as f32);
                    sum.add(value * share);
                }
                lit.clear();
            }
        }
        sum.mean()
    }

    /// The direction in which the path goes on from a surface; false when it ends.
    fn scatter(
        &self,
        path: &mut Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        sampler: &mut Sampler,
    ) -> bool {
        let wo = -path.ray.direction;
        let vertex = path.vertex;
        let choice = if has::<F>(Features::MIXES) {
            sampler.get_1d(Dimension::closure_choice(vertex))
        } else {
            0.0
        };
        let mut stream = sampler.walk_stream(vertex, Purpose::Sample);
        let Some(sample) = bsdf.sample(wo, choice, &mut stream) else {
            return false;
        };
        let pdf = if has::<F>(Features::LIGHT_SAMPLING) && !sample.delta {
            Some(bsdf.pdf(wo, sample.wi))
        } else {
            None
        };
        self.follow(path, surface, sampler, sample, pdf)
    }

    /// The path goes on from a surface as `sample` says, which has this density where
    /// light samples compete; false when it ends.
    #[inline(always)]
    fn follow(
        &self,
        path: &mut Path,
        surface: &Surface,
        sampler: &mut Sampler,
        sample: ScatterSample,
        pdf: Option<f32>,
    ) -> bool {
        path.throughput *= sample.weight;
        if has::<F>(Features::TRANSPARENCY) && sample.straight {
            // Goes on as if nothing had been there.
            path.pass_through(surface, path.travelling);
            return path.vertex <= MAX_STRAIGHT;
        }
        path.vertex += 1;
        path.ray = surface.spawn(sample.wi);
        path.multiple |= sample.order > 1;
        path.last = Vertex {
            receiver: self.scene.receiver(surface),
            pdf,
            travelled: 0.0,
        };
        path.bounce += 1;

        if path.bounce >= self.settings.roulette_start {
            let survival = path.throughput.max_element().clamp(MIN_SURVIVAL, 1.0);
            if sampler.get_1d(Dimension::roulette(path.vertex)) >= survival {
                return false;
            }
            path.throughput /= survival;
        }
        true
    }

    /// What the lights without geometry add along a ray up to `t_far`.
    fn analytic_lights(&self, ray: &Ray, t_far: Option<f32>, last: &Vertex, camera: bool) -> Rgb {
        if !has::<F>(Features::AREA_LIGHTS) {
            return Rgb::ZERO;
        }
        let mut sum = Rgb::ZERO;
        let segment = Ray {
            origin: last.receiver.position,
            t_near: last.travelled,
            t_far: t_far.map_or(f32::INFINITY, |t| last.travelled + t),
            ..*ray
        };
        self.scene.lights.crossed(
            &segment,
            last.receiver.normal,
            camera,
            |radiance, light_pdf| {
                sum += radiance * last.weight(light_pdf);
            },
        );
        sum
    }

    /// What a ray that leaves the scene brings.
    fn world(&self, last: &Vertex, direction: Vec3) -> Rgb {
        let (radiance, light_pdf) = self.scene.lights.world(last.receiver, direction);
        if has::<F>(Features::LIGHT_SAMPLING) {
            radiance * last.weight(light_pdf)
        } else {
            radiance
        }
    }

    fn surface_emission(&self, surface: &Surface, view: View, last: &Vertex) -> Rgb {
        let Some(first) = self.scene.objects[surface.object].first_emitter else {
            return Rgb::ZERO;
        };
        let radiance = self.scene.emission(surface, view);
        if radiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let light_pdf = match last.pdf {
            Some(_) => self.scene.lights.triangle_pdf(
                last.receiver,
                EmitterId(first + surface.triangle),
                surface.position,
                surface.geometric_normal,
            ),
            None => 0.0,
        };
        radiance * last.weight(light_pdf)
    }

    /// One light sample: f·|cosθ|·L/p with its multiple-importance weight.
    fn direct(
        &self,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        wo: Vec3,
        vertex: u32,
        sampler: &mut Sampler,
        rays: &mut u32,
    ) -> ByOrder {
        let Some((wi, light)) = self.arriving(surface, bsdf, wo, vertex, sampler, rays) else {
            return ByOrder::ZERO;
        };
        let mut stream = sampler.walk_stream(vertex, Purpose::Light);
        bsdf.eval(wo, wi, &mut stream) * light
    }

    /// A light sample's direction and its L/p, with its multiple-importance weight,
    /// if it reaches the surface and that can scatter it.
    fn arriving(
        &self,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        wo: Vec3,
        vertex: u32,
        sampler: &mut Sampler,
        rays: &mut u32,
    ) -> Option<(Vec3, Rgb)> {
        let choice = sampler.get_1d(Dimension::light_choice(vertex));
        let position = sampler.get_2d(Dimension::light_position(vertex));
        let light = self
            .scene
            .lights
            .sample(self.scene.receiver(surface), choice, position)?;
        let pdf = bsdf.pdf(wo, light.direction);
        if pdf <= 0.0 {
            return None;
        }
        let radiance = self.visible(surface, &light, rays)?;
        // The power heuristic's weight over the density; a delta light has no rival.
        let factor = if light.delta {
            1.0 / light.pdf
        } else {
            light.pdf / (light.pdf * light.pdf + pdf * pdf)
        };
        Some((light.direction, radiance * factor))
    }

    /// The radiance of the light sample that reaches the surface; `None` when it
    /// is in shadow.
    fn visible(&self, surface: &Surface, light: &LightSample, rays: &mut u32) -> Option<Rgb> {
        let mut ray = surface.spawn(light.direction);
        ray.t_far = light.distance;
        let mut radiance = light.radiance;
        if has::<F>(Features::EMISSIVE_MESHES) {
            if let Some((EmitterId(emitter), barycentric)) = light.emitter {
                ray.t_far *= SHORT_OF_EMITTER;
                // Where all points shine alike the sample's own radiance is exact.
                if has::<F>(Features::TEXTURES) || has::<F>(Features::VIEW_DEPENDENT) {
                    radiance = self
                        .scene
                        .emission_at(emitter, barycentric, -light.direction);
                }
            }
        }
        *rays += 1;
        if !has::<F>(Features::TRANSPARENCY) {
            return (!self.scene.accelerator.occluded(ray)).then_some(radiance);
        }
        for _ in 0..MAX_STRAIGHT {
            let Some(hit) = self.scene.accelerator.intersect(ray) else {
                return Some(radiance);
            };
            let blocker = self.scene.surface::<F>(&ray, &hit);
            let view = View {
                wo: -ray.direction,
                camera: false,
            };
            radiance *= self.scene.bsdf::<F>(&blocker, view).transparency();
            if radiance.max_element() <= 0.0 {
                return None;
            }
            let t_far = ray.t_far - hit.t;
            ray = Ray {
                t_far,
                ..blocker.spawn(ray.direction)
            };
            *rays += 1;
        }
        None
    }
}

impl Vertex {
    /// The power heuristic's weight of a direction found by BSDF sampling
    /// that light sampling would have found with density `light_pdf` (sr⁻¹).
    fn weight(&self, light_pdf: f32) -> f32 {
        match self.pdf {
            Some(pdf) => pdf * pdf / (pdf * pdf + light_pdf * light_pdf),
            None => 1.0,
        }
    }
}
