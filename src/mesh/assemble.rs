//! From what the parser gives to one sound mesh.

use super::polygons::Triangulation;
use super::{LineProblem, Mesh, Repair, Wanted};
use glam::DVec3;
use std::collections::BTreeMap;

/// In metres. Embree refuses coordinates beyond 1.8e18.
const FARTHEST: f32 = 1e18;

/// Merges the groups of a file and mends what can be mended.
pub(super) fn assemble(
    models: Vec<tobj::Model>,
    mut names: Vec<String>,
    mut repairs: Vec<Repair>,
    wanted: Wanted,
) -> Result<(Mesh, Vec<Repair>), Vec<LineProblem>> {
    let whole = |message: String| {
        vec![LineProblem {
            line: None,
            message,
        }]
    };
    let vertices: usize = models
        .iter()
        .map(|model| model.mesh.positions.len() / 3)
        .sum();
    let triangles: usize = models
        .iter()
        .map(|model| match model.mesh.face_arities.len() {
            0 => model.mesh.indices.len() / 3,
            faces => model.mesh.indices.len() - 2 * faces,
        })
        .sum();
    if triangles == 0 {
        return Err(whole("the mesh has no faces".to_owned()));
    }
    if u32::try_from(vertices).is_err() {
        return Err(whole(format!(
            "expected less than 2^32 vertices, found {vertices}"
        )));
    }
    let has_nameless = models
        .iter()
        .any(|model| model.mesh.material_id.is_none() && !model.mesh.indices.is_empty());
    let nameless = names.iter().position(String::is_empty);
    let nameless = nameless.unwrap_or(names.len());
    if has_nameless && nameless == names.len() && nameless > 0 {
        names.push(String::new());
    }
    if names.len() > usize::from(u16::MAX) {
        return Err(whole(format!(
            "expected at most {} materials, found {}",
            u16::MAX,
            names.len()
        )));
    }
    let has_normals = wanted.normals && models.iter().any(|model| !model.mesh.normals.is_empty());
    let has_uvs = wanted.uvs && models.iter().any(|model| !model.mesh.texcoords.is_empty());

    let mut mesh = Mesh {
        positions: Vec::with_capacity(vertices + 1),
        triangles: Vec::with_capacity(triangles),
        normals: has_normals.then(|| Vec::with_capacity(vertices)),
        uvs: has_uvs.then(|| Vec::with_capacity(vertices)),
        tangents: None,
        uv_maps: BTreeMap::new(),
        colors: BTreeMap::new(),
        material_of_triangle: (names.len() > 1).then(|| Vec::with_capacity(triangles)),
        material_names: names,
    };
    let mut colors = wanted.colors.then(Vec::new);
    let mut incomplete = 0;
    let mut uvs_replaced = 0;
    let mut triangulation = Triangulation::default();
    for tobj::Model { mesh: part, .. } in models {
        let base = mesh.positions.len() as u32;
        let count = part.positions.len() / 3;
        mesh.positions
            .extend(part.positions.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
        let too_far = |position: &&[f32; 3]| !position.iter().all(|x| x.abs() <= FARTHEST);
        if let Some(position) = mesh.positions[base as usize..].iter().find(too_far) {
            return Err(whole(format!(
                "expected coordinates up to {FARTHEST:e} m, found {position:?}"
            )));
        }
        let first_triangle = mesh.triangles.len();
        triangulation.add(&mut mesh, base, &part.indices, &part.face_arities);
        let added = mesh.triangles.len() - first_triangle;
        if let Some(normals) = &mut mesh.normals {
            // With a normal at some corners alone, which ones is lost.
            let complete = part.normals.len() == 3 * count;
            if complete {
                normals.extend(part.normals.chunks_exact(3).map(|n| [n[0], n[1], n[2]]));
            } else {
                if !part.normals.is_empty() {
                    incomplete += added;
                }
                normals.resize(normals.len() + count, [0.0; 3]);
            }
        }
        if let Some(uvs) = &mut mesh.uvs {
            if part.texcoords.len() == 2 * count {
                uvs.extend(part.texcoords.chunks_exact(2).map(|uv| [uv[0], uv[1]]));
            } else {
                uvs.resize(uvs.len() + count, [f32::NAN; 2]);
            }
        }
        if let Some(colors) = &mut colors {
            colors.extend(
                part.vertex_color
                    .chunks_exact(3)
                    .map(|c| [c[0], c[1], c[2]]),
            );
        }
        if let Some(materials) = &mut mesh.material_of_triangle {
            let id = part.material_id.unwrap_or(nameless) as u16;
            materials.resize(materials.len() + added, id);
        }
    }
    for uv in mesh
        .uvs
        .iter_mut()
        .flatten()
        .filter(|uv| !uv.iter().all(|x| x.is_finite()))
    {
        *uv = [0.0; 2];
        uvs_replaced += 1;
    }
    let dropped = drop_degenerate(&mut mesh);
    if mesh.triangles.is_empty() {
        return Err(whole(format!(
            "none of the {dropped} triangles has an area"
        )));
    }
    let replaced = mend_normals(&mut mesh);
    // Without normals, as colours are read, no vertex was added since.
    if let Some(colors) = colors {
        mesh.colors.insert(String::new(), colors);
    }

    let counted = [
        (
            triangulation.crossing,
            Repair::PolygonsCrossing as fn(usize) -> Repair,
        ),
        (dropped, Repair::DegenerateTrianglesDropped),
        (incomplete, Repair::NormalsIncomplete),
        (replaced, Repair::NormalsReplaced),
        (uvs_replaced, Repair::UvsReplaced),
    ];
    repairs.extend(
        counted
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, repair)| repair(count)),
    );
    Ok((mesh, repairs))
}

/// Twice the area times the normal, in m².
fn area_vector(positions: &[[f32; 3]], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|index| DVec3::from(positions[index as usize].map(f64::from)));
    (b - a).cross(c - a)
}

fn drop_degenerate(mesh: &mut Mesh) -> usize {
    let Mesh {
        positions,
        triangles,
        material_of_triangle,
        ..
    } = mesh;
    let mut kept = 0;
    for index in 0..triangles.len() {
        let triangle = triangles[index];
        if area_vector(positions, triangle) != DVec3::ZERO {
            triangles[kept] = triangle;
            if let Some(materials) = material_of_triangle {
                materials[kept] = materials[index];
            }
            kept += 1;
        }
    }
    let dropped = triangles.len() - kept;
    triangles.truncate(kept);
    if let Some(materials) = material_of_triangle {
        materials.truncate(kept);
    }
    dropped
}

/// Brings normals to unit length. Corners without a usable one get a vertex of
/// their own with their triangle's normal; gives how many.
fn mend_normals(mesh: &mut Mesh) -> usize {
    let Some(normals) = &mut mesh.normals else {
        return 0;
    };
    let mut broken = 0;
    for normal in normals.iter_mut() {
        let unit = DVec3::from(normal.map(f64::from)).try_normalize();
        *normal = unit.unwrap_or(DVec3::ZERO).as_vec3().to_array();
        broken += usize::from(unit.is_none());
    }
    if broken == 0 {
        return 0;
    }
    let mut replaced = 0;
    for triangle in &mut mesh.triangles {
        let flat = area_vector(&mesh.positions, *triangle)
            .normalize()
            .as_vec3()
            .to_array();
        for index in triangle {
            let vertex = *index as usize;
            if normals[vertex] != [0.0; 3] {
                continue;
            }
            replaced += 1;
            *index = mesh.positions.len() as u32;
            mesh.positions.push(mesh.positions[vertex]);
            normals.push(flat);
            if let Some(uvs) = &mut mesh.uvs {
                uvs.push(uvs[vertex]);
            }
        }
    }
    mesh.positions.reserve(1);
    replaced
}
