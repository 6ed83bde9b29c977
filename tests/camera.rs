//! The camera against Blender's conventions, by positions worked out by hand.

use glam::{Affine3A, Mat3, Quat, Vec3};
use smithwalk::camera::{Camera, CameraError};
use smithwalk::description::{
    self, Aperture, DepthOfField, Opening, Orthographic, Perspective, Projection, SensorFit,
    Transform,
};

fn perspective() -> Perspective {
    Perspective {
        opening: Opening::Lens(50.0),
        sensor_width: 36.0,
        sensor_height: 24.0,
        sensor_fit: SensorFit::Auto,
        shift_x: 0.0,
        shift_y: 0.0,
        pixel_aspect: 1.0,
    }
}

fn description(projection: Projection) -> description::Camera {
    description::Camera {
        clip: None,
        transform: Transform::default(),
        projection,
        depth_of_field: None,
    }
}

fn camera(perspective: Perspective, size: [u32; 2]) -> Camera {
    let description = description(Projection::Perspective(perspective));
    Camera::from_description(&description, Affine3A::IDENTITY, size).unwrap()
}

/// Where the ray through a raster position meets the plane z = −1.
fn on_plane(camera: &Camera, pixel: [f32; 2]) -> [f32; 2] {
    let ray = camera.ray(pixel, [0.5, 0.5]);
    assert_eq!(ray.origin, Vec3::ZERO);
    assert!((ray.direction.length() - 1.0).abs() < 1e-6);
    let at = ray.direction / -ray.direction.z;
    [at.x, at.y]
}

fn assert_near(a: [f32; 2], b: [f32; 2]) {
    assert!(
        (a[0] - b[0]).abs() < 2e-6 && (a[1] - b[1]).abs() < 2e-6,
        "{a:?} is not {b:?}"
    );
}

#[test]
fn the_fitted_side_spans_the_sensor() {
    // 50 mm on 36 mm: half-tangent 0.36 on the fitted side.
    for (fit, size, half) in [
        (SensorFit::Auto, [200, 100], [0.36, 0.18]),
        (SensorFit::Auto, [100, 200], [0.18, 0.36]),
        (SensorFit::Horizontal, [100, 200], [0.36, 0.72]),
        // Vertical takes the sensor's height: 24/100 = 0.24.
        (SensorFit::Vertical, [200, 100], [0.48, 0.24]),
    ] {
        let perspective = Perspective {
            sensor_fit: fit,
            ..perspective()
        };
        let camera = camera(perspective, size);
        let [width, height] = size.map(|n| n as f32);
        assert_near(on_plane(&camera, [0.0, 0.0]), [-half[0], half[1]]);
        assert_near(on_plane(&camera, [width, height]), [half[0], -half[1]]);
        assert_near(on_plane(&camera, [width / 2.0, height / 2.0]), [0.0, 0.0]);
    }
}

#[test]
fn pixels_may_be_higher_than_wide() {
    // 100 × 80 pixels, each 1.5 high: 100 × 120 square ones, so Auto fits the height.
    let perspective = Perspective {
        pixel_aspect: 1.5,
        ..perspective()
    };
    let camera = camera(perspective, [100, 80]);
    assert_near(on_plane(&camera, [0.0, 0.0]), [-0.3, 0.36]);
    assert_near(on_plane(&camera, [50.0, 20.0]), [0.0, 0.18]);
}

#[test]
fn a_shift_counts_in_fitted_sides() {
    let perspective = Perspective {
        shift_x: 0.1,
        shift_y: -0.25,
        ..perspective()
    };
    let camera = camera(perspective, [200, 100]);
    // (0 + 0.1)·0.72 and (0 − 0.25)·0.72.
    assert_near(on_plane(&camera, [100.0, 50.0]), [0.072, -0.18]);
    // (0.25 + 0.1)·0.72 and (0.125 − 0.25)·0.72.
    assert_near(on_plane(&camera, [150.0, 25.0]), [0.252, -0.09]);
}

#[test]
fn an_angle_is_the_full_one() {
    let perspective = Perspective {
        opening: Opening::Fov(90.0),
        ..perspective()
    };
    assert_near(
        on_plane(&camera(perspective, [64, 64]), [64.0, 0.0]),
        [1.0, 1.0],
    );
}

#[test]
fn the_transform_places_and_turns_but_does_not_scale() {
    // The camera of Blender's default scene looks along −z; turned by 90°
    // about x it looks along +y with z up.
    let turned = Affine3A::from_scale_rotation_translation(
        Vec3::new(3.0, 0.5, 7.0),
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        Vec3::new(1.0, -6.0, 2.0),
    );
    let perspective = Perspective {
        opening: Opening::Fov(90.0),
        ..perspective()
    };
    let description = description(Projection::Perspective(perspective));
    let camera = Camera::from_description(&description, turned, [64, 64]).unwrap();
    assert!((camera.forward() - Vec3::Y).length() < 1e-6);
    let ray = camera.ray([64.0, 0.0], [0.5, 0.5]);
    assert_eq!(ray.origin, Vec3::new(1.0, -6.0, 2.0));
    let expected = Vec3::new(1.0, 1.0, 1.0).normalize();
    assert!((ray.direction - expected).length() < 1e-6);
    assert_eq!(ray.t_far, f32::INFINITY);
}

#[test]
fn parallel_rays_start_on_the_fitted_side() {
    let parallel = Orthographic {
        scale: 6.0,
        shift_x: 0.5,
        ..Orthographic::default()
    };
    let description = description(Projection::Orthographic(parallel));
    let camera = Camera::from_description(&description, Affine3A::IDENTITY, [200, 100]).unwrap();
    let ray = camera.ray([0.0, 0.0], [0.5, 0.5]);
    assert!((ray.origin - Vec3::new(-3.0 + 3.0, 1.5, 0.0)).length() < 1e-6);
    assert_eq!(ray.direction, Vec3::NEG_Z);
}

fn focused(projection: Projection, aperture: Aperture) -> Camera {
    let description = description::Camera {
        depth_of_field: Some(DepthOfField {
            aperture,
            focus_distance: 4.0,
        }),
        ..description(projection)
    };
    Camera::from_description(&description, Affine3A::IDENTITY, [200, 100]).unwrap()
}

/// Rays through one raster position meet in one point of the plane of focus
/// and start all over a disk of the aperture's radius.
fn check_lens(camera: &Camera, radius: f32, eye: Vec3, focus: Vec3) {
    assert!(camera.has_lens());
    let mut farthest = 0.0_f32;
    let mut mean_square = 0.0;
    let n = 64;
    for i in 0..n * n {
        let lens = [i % n, i / n].map(|i| (i as f32 + 0.5) / n as f32);
        let ray = camera.ray([150.0, 25.0], lens);
        let aside = (ray.origin - eye).length();
        assert!(aside <= radius * 1.0001);
        farthest = farthest.max(aside);
        mean_square += aside * aside / (n * n) as f32;
        let t = (focus.z - ray.origin.z) / ray.direction.z;
        let at = ray.origin + t * ray.direction;
        assert!((at - focus).length() < 1e-4, "{at} is not {focus}");
    }
    assert!(farthest > 0.97 * radius);
    // Uniform on the disk: the mean of ρ² is r²/2; the midpoint rule has no
    // noise and an error of the order of 1/n².
    let expected = radius * radius / 2.0;
    assert!((mean_square / expected - 1.0).abs() < 2e-3);
}

#[test]
fn a_thin_lens_keeps_the_plane_of_focus_sharp() {
    // 50 mm at f/2: 12.5 mm; on the plane at 4 m: (0.25, 0.125)·0.72·4.
    let perspective = || Projection::Perspective(perspective());
    let camera = focused(perspective(), Aperture::FStop(2.0));
    check_lens(&camera, 0.0125, Vec3::ZERO, Vec3::new(0.72, 0.36, -4.0));
    let camera = focused(perspective(), Aperture::Radius(0.3));
    check_lens(&camera, 0.3, Vec3::ZERO, Vec3::new(0.72, 0.36, -4.0));
    assert!(!focused(perspective(), Aperture::Radius(0.0)).has_lens());
    // The focal length that belongs to 90° on 36 mm is 18 mm.
    let wide = Perspective {
        opening: Opening::Fov(90.0),
        ..self::perspective()
    };
    let camera = focused(Projection::Perspective(wide), Aperture::FStop(0.1));
    check_lens(&camera, 0.09, Vec3::ZERO, Vec3::new(2.0, 1.0, -4.0));
}

#[test]
fn an_orthographic_lens_has_its_own_radius() {
    let camera = focused(
        Projection::Orthographic(Orthographic::default()),
        Aperture::FStop(2.0),
    );
    let eye = Vec3::new(1.5, 0.75, 0.0);
    check_lens(&camera, 0.25, eye, eye - Vec3::Z * 4.0);
}

#[test]
fn impossible_cameras_are_refused() {
    let of = |opening, transform, size| {
        let perspective = Perspective {
            opening,
            ..perspective()
        };
        let description = description(Projection::Perspective(perspective));
        Camera::from_description(&description, transform, size).unwrap_err()
    };
    let identity = Affine3A::IDENTITY;
    for opening in [
        Opening::Fov(0.0),
        Opening::Fov(180.0),
        Opening::Fov(f32::NAN),
        Opening::Lens(0.0),
        Opening::Lens(-1.0),
    ] {
        assert_eq!(of(opening, identity, [64, 64]), CameraError::NoOpening);
    }
    let fov = Opening::Fov(40.0);
    assert_eq!(of(fov, identity, [0, 64]), CameraError::NoPixels);
    let flat = Affine3A::from_mat3(Mat3::from_diagonal(Vec3::new(1.0, 1.0, 0.0)));
    assert_eq!(of(fov, flat, [64, 64]), CameraError::NoDirection);
}
