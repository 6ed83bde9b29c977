//! The camera: from raster positions to rays.

use crate::description::{self, Aperture, Opening, Projection, SensorFit};
use crate::embree::Ray;
use crate::light::warp::unit_disk;
use glam::{Affine3A, Vec2, Vec3};

/// A camera that looks along its local −z, local y up, as Blender's does.
///
/// With the image's size in square pixels, x from its centre to the right and
/// y upwards in units of the fitted side, and the shift added, a perspective
/// camera looks along (2·half·x, 2·half·y, −1), where half is the tangent of
/// half the angle on the fitted side; an orthographic one along (0, 0, −1)
/// from (scale·x, scale·y, 0).
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// What a step of one pixel is on the plane one metre before a
    /// perspective camera, or through an orthographic one; y down.
    pixel: Vec2,
    /// Where the raster's origin is on that plane.
    corner: Vec2,
    parallel: bool,
    lens: Option<Lens>,
    /// Where along the view axis it begins and ends to see, in metres.
    clip: [f32; 2],
}

/// How wide a pixel is along a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cone {
    /// Where the ray starts, metres.
    pub width: f32,
    /// What it widens by per metre.
    pub spread: f32,
}

impl Cone {
    /// The width so far along the ray, metres.
    #[must_use]
    pub fn at(&self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }
}

#[derive(Clone, Copy, Debug)]
struct Lens {
    /// Metres.
    radius: f32,
    /// Along the view axis, metres.
    focus: f32,
}

/// Why a camera can't be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CameraError {
    /// A transform without three axes.
    #[error("the camera has no direction: its transform's scale is 0 along an axis, or not finite")]
    NoDirection,
    /// A field of view that no perspective has.
    #[error(
        "the camera must see a part of a half-space: an angle above 0° and below 180°, or a positive lens, sensor or scale"
    )]
    NoOpening,
    /// A lens that can't focus.
    #[error("depth of field needs a positive focus distance and an aperture of finite size")]
    NoFocus,
    /// An image without pixels, or pixels without area.
    #[error("the image must be at least one pixel wide and high, with a positive pixel aspect")]
    NoPixels,
    /// A shift that is not finite.
    #[error("the camera's shift must be finite numbers")]
    NoShift,
}

impl Camera {
    /// Of an image of `width` × `height` pixels; `to_world` is the camera's
    /// transform, the scale of which is ignored.
    ///
    /// # Errors
    /// [`CameraError`], when there is no such camera.
    pub fn from_description(
        camera: &description::Camera,
        to_world: Affine3A,
        [width, height]: [u32; 2],
    ) -> Result<Self, CameraError> {
        let axis = |axis: glam::Vec3A| {
            axis.as_dvec3()
                .try_normalize()
                .map(|axis| axis.as_vec3())
                .ok_or(CameraError::NoDirection)
        };
        let view = View::of(&camera.projection);
        if width == 0 || height == 0 || !is_positive(view.pixel_aspect) {
            return Err(CameraError::NoPixels);
        }
        if !view.shift.is_finite() {
            return Err(CameraError::NoShift);
        }
        let (width, height) = (width as f32, height as f32);
        let high = height * view.pixel_aspect;
        let wide_fit = match view.fit {
            SensorFit::Auto => width >= high,
            SensorFit::Horizontal => true,
            SensorFit::Vertical => false,
        };
        let fitted = if wide_fit { width } else { high };
        let side = match view.fit {
            SensorFit::Vertical => view.side_if_vertical,
            _ => view.side,
        };
        if !is_positive(side) {
            return Err(CameraError::NoOpening);
        }
        let pixel = Vec2::new(1.0, -view.pixel_aspect) / fitted * side;
        let corner = Vec2::new(-width, high) / (2.0 * fitted) * side + view.shift * side;

        let lens = camera
            .depth_of_field
            .map(|depth_of_field| {
                let radius = match depth_of_field.aperture {
                    Aperture::Radius(radius) => radius,
                    Aperture::FStop(fstop) => view.focal_length / (2.0 * fstop),
                };
                let focus = depth_of_field.focus_distance;
                let valid = radius >= 0.0 && radius.is_finite() && is_positive(focus);
                valid
                    .then_some(Lens { radius, focus })
                    .ok_or(CameraError::NoFocus)
            })
            .transpose()?
            .filter(|lens| lens.radius > 0.0);
        let position = Vec3::from(to_world.translation);
        if !position.is_finite() {
            return Err(CameraError::NoDirection);
        }
        Ok(Self {
            position,
            right: axis(to_world.matrix3.x_axis)?,
            up: axis(to_world.matrix3.y_axis)?,
            forward: -axis(to_world.matrix3.z_axis)?,
            pixel,
            corner,
            parallel: matches!(camera.projection, Projection::Orthographic(_)),
            lens,
            clip: camera.clip.unwrap_or([0.0, f32::INFINITY]),
        })
    }

    /// The ray through a raster position in pixels, from the upper left corner
    /// to the right and down. `lens` in [0, 1)² chooses the point of the
    /// aperture.
    #[must_use]
    pub fn ray(&self, pixel: [f32; 2], lens: [f32; 2]) -> Ray {
        let on_plane = self.corner + self.pixel * Vec2::from(pixel);
        let across = self.right * on_plane.x + self.up * on_plane.y;
        // From the eye to the plane one metre before it.
        let (eye, sight) = if self.parallel {
            (self.position + across, self.forward)
        } else {
            (self.position, self.forward + across)
        };
        let Some(Lens { radius, focus }) = self.lens else {
            return self.clipped(eye, sight.normalize());
        };
        let [x, y] = unit_disk(lens);
        let aside = (self.right * x + self.up * y) * radius;
        self.clipped(eye + aside, (sight * focus - aside).normalize())
    }

    /// A ray between the planes that the camera sees from and to.
    fn clipped(&self, origin: Vec3, direction: Vec3) -> Ray {
        let [t_near, t_far] = self.clip.map(|depth| depth / direction.dot(self.forward));
        Ray {
            t_near,
            t_far,
            ..Ray::new(origin, direction)
        }
    }

    /// How wide a pixel is where its rays in a direction (unit length) start, metres,
    /// and by how much it widens per metre: the mean of its two sides.
    #[must_use]
    pub fn cone(&self, direction: Vec3) -> Cone {
        let sides = [self.right * self.pixel.x, self.up * self.pixel.y];
        let mean = |length: &dyn Fn(Vec3) -> f32| sides.map(length).iter().sum::<f32>() / 2.0;
        if self.parallel {
            return Cone {
                width: mean(&|side| side.length()),
                spread: 0.0,
            };
        }
        // A step on the plane one metre before the eye turns the direction.
        let nearness = direction.dot(self.forward);
        let turn = |side: Vec3| (side - direction * direction.dot(side)).length() * nearness;
        Cone {
            width: 0.0,
            spread: mean(&turn),
        }
    }

    /// Whether rays depend on the point of the aperture.
    #[must_use]
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// The view axis, a unit vector: depth is measured along it.
    #[must_use]
    pub fn forward(&self) -> Vec3 {
        self.forward
    }

    /// Where the camera is, in metres.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.position
    }
}

/// What the two projections have in common.
struct View {
    fit: SensorFit,
    /// The length of the fitted side on the plane one metre before a
    /// perspective camera, or through an orthographic one, in metres.
    side: f32,
    /// The same when the image's height is what the file asks to fit.
    side_if_vertical: f32,
    shift: Vec2,
    /// A pixel's height over its width.
    pixel_aspect: f32,
    /// What an f-stop divides, in metres.
    focal_length: f32,
}

impl View {
    fn of(projection: &Projection) -> Self {
        match projection {
            Projection::Perspective(lens) => {
                let side = |sensor: f32| match lens.opening {
                    Opening::Fov(degrees) => side_of_angle(degrees),
                    Opening::Lens(millimetres) => sensor / millimetres,
                };
                let focal_length = match lens.opening {
                    Opening::Lens(millimetres) => millimetres,
                    Opening::Fov(degrees) => {
                        let sensor = match lens.sensor_fit {
                            SensorFit::Vertical => lens.sensor_height,
                            _ => lens.sensor_width,
                        };
                        sensor / side_of_angle(degrees)
                    }
                };
                Self {
                    fit: lens.sensor_fit,
                    side: side(lens.sensor_width),
                    side_if_vertical: side(lens.sensor_height),
                    shift: Vec2::new(lens.shift_x, lens.shift_y),
                    pixel_aspect: lens.pixel_aspect,
                    focal_length: focal_length * 1e-3,
                }
            }
            Projection::Orthographic(parallel) => Self {
                fit: parallel.sensor_fit,
                side: parallel.scale,
                side_if_vertical: parallel.scale,
                shift: Vec2::new(parallel.shift_x, parallel.shift_y),
                pixel_aspect: 1.0,
                focal_length: 1.0,
            },
        }
    }
}

/// 2·tan(angle/2); NaN for what is no angle of view.
fn side_of_angle(degrees: f32) -> f32 {
    if degrees > 0.0 && degrees < 180.0 {
        2.0 * (degrees.to_radians() / 2.0).tan()
    } else {
        f32::NAN
    }
}

fn is_positive(x: f32) -> bool {
    x > 0.0 && x.is_finite()
}
