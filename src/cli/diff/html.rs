//! The comparison as one web page: both images with a slider, maps, values.

use std::borrow::Cow;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use smithwalk::image::{Display, Image, encode_png};
use smithwalk::metrics::{Comparison, Pair};

/// Also filled in by `blender/compare.py`.
const TEMPLATE: &str = include_str!("report.html");

/// The page; `names` are what the images are called in it.
pub fn page(
    pair: &Pair,
    figures: &Comparison,
    names: [Cow<'_, str>; 2],
    exposure: f32,
) -> anyhow::Result<String> {
    let size = [pair.window().width, pair.window().height];
    let png = |pixels: &[u8]| -> anyhow::Result<String> {
        let encoded = BASE64_STANDARD.encode(encode_png(pixels, size)?);
        Ok(format!("data:image/png;base64,{encoded}"))
    };
    let display = Display::srgb(exposure);
    let [a, b] = pair.images();
    let names = [names[0].as_ref(), names[1].as_ref()];
    let difference = pair.difference_map();
    // Without variances there are no z-scores.
    let z = pair.z_map().ok();
    let mut parts = TEMPLATE.split("{{");
    let mut page = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (key, rest) = part.split_once("}}").expect("a whole template");
        page += &match key {
            "TITLE" => escape(&format!("{} against {}", names[0], names[1])),
            "SENTENCE" => escape(&sentence(figures, names)),
            "WIDTH" => size[0].to_string(),
            "HEIGHT" => size[1].to_string(),
            "A" => escape(names[0]),
            "B" => escape(names[1]),
            "FULL" => format!("{} % of the reference", 100.0 * difference.full_scale),
            "FULL_Z" => z
                .as_ref()
                .map_or(String::new(), |z| z.full_scale.to_string()),
            "Z" => if z.is_some() { "" } else { "hidden" }.to_owned(),
            "NOTES" => String::new(),
            "IMAGE_OURS" => png(&display.encode(a))?,
            "IMAGE_THEIRS" => png(&display.encode(b))?,
            "IMAGE_DIFFERENCE" => png(&difference.pixels)?,
            "IMAGE_Z" => z
                .as_ref()
                .map_or(Ok("data:,".to_owned()), |z| png(&z.pixels))?,
            "FLOATS_OURS" => floats(a),
            "FLOATS_THEIRS" => floats(b),
            _ => unreachable!("the template has no other key"),
        };
        page += rest;
    }
    Ok(page)
}

/// What the figures say.
fn sentence(figures: &Comparison, [a, b]: [&str; 2]) -> String {
    let bias = 100.0 * figures.rel_bias;
    let side = if bias < 0.0 { "darker" } else { "brighter" };
    let noise = figures.z.as_ref().map_or(String::new(), |z| {
        let pixels = f64::from(figures.width) * f64::from(figures.height);
        let within = 100.0 * (1.0 - z.z_failed_pixels as f64 / pixels);
        format!("; {within:.2} % of the pixels agree within noise")
    });
    let (flip, error) = (figures.flip, 100.0 * figures.rel_mse.sqrt());
    format!(
        "{a} is {:.3} % {side} than {b} on average, {error:.2} % off per pixel (root of relMSE), FLIP {flip:.4}{noise}.",
        bias.abs()
    )
}

/// Red, green and blue as base64 of 32-bit floats, little end first.
fn floats(image: &Image) -> String {
    let values = image.color.as_flattened().iter();
    let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
    BASE64_STANDARD.encode(bytes)
}

fn escape(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}
