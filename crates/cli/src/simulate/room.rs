//! A mesh with its materials and its source, as the command line states them.

use crate::args::{MeshArgs, RoomArgs};
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_acoustics::{Curve, Directivity, Material, Materials, Mesh, MeshReport, Room, Source};
use promenade_baker::simulation::directivity;
use promenade_core::glam::Vec3;
use promenade_fit::MaterialsBeside;
use std::path::{Path, PathBuf};

/// Materials that differ, at most.
const MOST_MATERIALS: usize = 1000;
/// Nearer to a surface than this, metres, it is not asked on which side of it a place is.
const AT_SURFACE_M: f64 = 1e-3;
/// Distance from surfaces of a place that is proposed, metres.
const PROPOSED_M: f64 = 0.1;

/// A mesh in metres, as flat as it is meant, and what it is like; what is odd about it is said. Of a mesh of one group that is
/// not named, surfaces are sorted by where they look.
pub(crate) fn mesh(
    path: &Path,
    MeshArgs { scale, up }: &MeshArgs,
    flatten: Option<f64>,
    is_named: impl Fn(&str) -> bool,
) -> Result<(Mesh, MeshReport)> {
    let mut mesh = Mesh::load(path)?;
    mesh.scale(scale.unwrap_or(1.0));
    let mut notes = Vec::new();
    if mesh.stand_up(path, up.map(|up| up.as_dvec3().to_array())) {
        notes.push("the mesh seems to lie on its side: y is taken for up; --up y confirms it, and --up z keeps it".to_owned());
    }
    let size = mesh.report();
    if let (None, Some(odd)) = (scale, size.odd_size()) {
        report::notes(&notes);
        bail!("{}: {odd}; --scale says what a unit is, and --scale 1 that it is the metre", path.display());
    }
    notes.extend(size.warnings());
    if let [only] = &mesh.groups[..]
        && !is_named(only)
    {
        notes.push(format!("all triangles are of {only:?}: they are sorted into floor, ceiling and wall by where they look"));
        mesh.group_by_direction();
    }
    if flatten != Some(0.0)
        && let Some(done) = mesh.flatten(flatten)
    {
        notes.push(done.to_string());
    }
    report::notes(&notes);
    Ok((mesh, size))
}

/// The mesh with its materials, and what it is like; what is odd about it is said.
pub(crate) fn room(args: &RoomArgs) -> Result<(Mesh, Room, MeshReport)> {
    let is_named = |group: &str| args.materials.iter().any(|(pattern, _)| pattern == group || pattern == "*");
    let (mut mesh, size) = mesh(&args.mesh, &MeshArgs { scale: args.scale, up: args.up }, args.flatten, is_named)?;
    let mut rules = args.materials.clone();
    if let Some(fitted) = fitted(&args.mesh)? {
        report::note(format_args!("fitted materials of {} where no rule says otherwise", report::file_name(&args.mesh)));
        rules.extend(fitted.materials);
    }
    let materials = table(&args.material_table)?.assign(&mesh.groups, &rules);
    let materials = materials.with_context(|| format!("{}: its materials cannot be found", args.mesh.display()))?;
    let materials = mesh.merge_groups(materials);
    if materials.len() > MOST_MATERIALS {
        bail!("{}: expected at most {MOST_MATERIALS} materials that differ, found {}", args.mesh.display(), materials.len());
    }
    let room = Room::new(&mesh, &materials).with_context(|| format!("{}: makes no room", args.mesh.display()))?;
    if size.volume_m3.is_some() {
        within("--emitter", &room, &mesh, args.source)?;
    }
    Ok((mesh, room, size))
}

/// The built-in table with those of files before it.
fn table(files: &[PathBuf]) -> Result<Materials> {
    let mut table = Materials::default();
    for file in files {
        let mut all = vec![file.clone()];
        if file.is_dir() {
            let entries = std::fs::read_dir(file).with_context(|| format!("{}: cannot be read", file.display()))?;
            let entries = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<PathBuf>>>()?;
            all = entries.into_iter().filter(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"))).collect();
            // Which of two of the same name holds does not depend on the folder's order.
            all.sort();
        }
        let counts = all.iter().map(|path| table.add_table(path)).collect::<Result<Vec<usize>, _>>()?;
        let count = counts.into_iter().sum::<usize>();
        if count == 0 {
            bail!("{}: expected tables that end in .csv, found none", file.display());
        }
        report::note(format_args!("{count} materials of {}", report::file_name(file)));
    }
    Ok(table)
}

/// Refuses a place outside of a closed room, where nothing is heard of what is inside.
pub(super) fn within(what: &str, room: &Room, mesh: &Mesh, at: Vec3) -> Result<()> {
    let place = at.as_dvec3().to_array();
    if room.encloses(place)? || room.surroundings(place)?.clearance_m < AT_SURFACE_M {
        return Ok(());
    }
    let written = |[x, y, z]: [f64; 3]| format!("{x:.2},{y:.2},{z:.2}");
    let [low, high] = mesh.bounds().map(written);
    let nearest = match room.nearest_inside(place, PROPOSED_M)? {
        Some(near) => format!("; the nearest place inside is {}", written(near)),
        None => String::new(),
    };
    bail!("{what}: expected a place in the closed room, which lies from {low} to {high} m, found {}{nearest}", written(place));
}

/// What a fit has left in a file beside the mesh.
fn fitted(mesh: &Path) -> Result<Option<MaterialsBeside>> {
    let beside = mesh.with_extension("materials.json");
    if !beside.is_file() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&beside).with_context(|| format!("{}: cannot be read", beside.display()))?;
    let found = serde_json::from_str(&text).with_context(|| format!("{}: expected materials by group", beside.display()))?;
    Ok(Some(found))
}

/// A fitted material as [`Materials::material`] reads it.
pub(crate) fn described(material: &Material) -> String {
    let all = |shares: &[f32]| shares.iter().map(|s| format!("{s:.4}")).collect::<Vec<_>>().join("/");
    let bands = |octaves: &[f32], low: Option<f32>, fine: &Curve| match (fine.points(), low) {
        ([], None) => all(octaves),
        ([], Some(low)) => format!("{low:.4}/{}", all(octaves)),
        (points, _) => points.iter().map(|[hz, share]| format!("{hz:.1}@{share:.4}")).collect::<Vec<_>>().join("/"),
    };
    let Material { absorption, absorption_63, scattering, fine: [absorbs, scatters], .. } = material;
    format!("{}:{}", bands(absorption, *absorption_63, absorbs), bands(scattering, None, scatters))
}

/// The source: where it is, and what it sends where.
pub(crate) fn source(args: &RoomArgs) -> Result<Source> {
    let position = args.source.as_dvec3().to_array();
    let (directivity, facing) = match &args.directivity {
        Some(file) => (stated(file)?, [0.0; 2]),
        None => match fitted(&args.mesh)?.and_then(|fitted| fitted.source) {
            Some(source) => source.directivity(position)?,
            None => (Directivity::default(), [0.0; 2]),
        },
    };
    let [yaw, pitch] = args.facing.unwrap_or(facing).map(f64::to_radians);
    Ok(Source { position, directivity: directivity.turned(yaw, pitch) })
}

/// A pattern by its name, or the directivity of a file.
fn stated(file: &Path) -> Result<Directivity> {
    if let Some(named) = file.to_str().and_then(Directivity::named) {
        return Ok(named);
    }
    if !file.extension().is_some_and(|e| e.eq_ignore_ascii_case("sofa")) {
        let names = Directivity::PATTERNS.map(|(name, _)| name).join(", ");
        bail!("--directivity: expected {names} or a .sofa file, found {}", file.display());
    }
    Ok(directivity(file)?)
}
