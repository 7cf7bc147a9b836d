//! AC3D files, which RAVEN and the rooms of BRAS have (Inivis, *The AC3D file format*, version AC3Db). Groups are materials.

use super::names::Names;
use super::polygon::Cutter;
use super::{Mesh, Triangle};
use crate::error::AcousticsError;
use glam::{DMat3, DMat4, DVec3};
use std::path::Path;

/// Objects within objects, at most.
const MOST_DEPTH: usize = 64;
/// Of a surface's flags, those that say what it is: 0 for a polygon, else lines.
const KIND: u32 = 0xf;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let text = String::from_utf8_lossy(bytes);
    Reader::new(path, &text).mesh()
}

/// An object that is being read.
struct Object {
    /// From its coordinates to the world's.
    place: DMat4,
    /// Objects in it that are still to come.
    kids: usize,
}

struct Reader<'a> {
    path: &'a Path,
    rest: &'a str,
    line: usize,
}

impl<'a> Reader<'a> {
    fn new(path: &'a Path, text: &'a str) -> Self {
        Self { path, rest: text, line: 0 }
    }

    fn wrong(&self, expected: &str, found: &str) -> AcousticsError {
        let shown: String = found.chars().take(60).collect();
        AcousticsError::content(self.path, format!("line {}: {expected}", self.line), format!("{shown:?}"))
    }

    /// The next line that is not empty.
    fn next(&mut self) -> Option<&'a str> {
        while !self.rest.is_empty() {
            let (line, rest) = self.rest.split_once('\n').unwrap_or((self.rest, ""));
            self.rest = rest;
            self.line += 1;
            if !line.trim().is_empty() {
                return Some(line.trim());
            }
        }
        None
    }

    fn expect(&mut self, what: &str) -> Result<&'a str, AcousticsError> {
        self.next().ok_or_else(|| self.wrong(what, "the end of the file"))
    }

    fn whole(&self, words: &str, what: &str) -> Result<usize, AcousticsError> {
        words.trim().parse().map_err(|_| self.wrong(what, words))
    }

    fn numbers<const N: usize>(&self, words: &str, what: &str) -> Result<[f64; N], AcousticsError> {
        let mut found = [0.0; N];
        let mut words_left = words.split_ascii_whitespace();
        for slot in &mut found {
            let number = words_left.next().and_then(|word| word.parse::<f64>().ok()).filter(|n| n.is_finite());
            *slot = number.ok_or_else(|| self.wrong(what, words))?;
        }
        Ok(found)
    }

    fn mesh(mut self) -> Result<Mesh, AcousticsError> {
        let head = self.expect("AC3D")?;
        if !head.starts_with("AC3D") {
            return Err(self.wrong("AC3D and a letter", head));
        }
        let (mut mesh, mut materials, mut groups, mut cutter) =
            (Mesh::default(), Vec::new(), Names::default(), Cutter::default());
        // z is up here, y there.
        let upright = DMat4::from_cols_array_2d(&[[1., 0., 0., 0.], [0., 0., 1., 0.], [0., -1., 0., 0.], [0., 0., 0., 1.]]);
        let mut within = vec![Object { place: upright, kids: usize::MAX }];
        while let Some(line) = self.next() {
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            match word {
                "MATERIAL" => materials.push(quoted(rest).to_owned()),
                "OBJECT" => {
                    while within.len() > 1 && within.last().is_some_and(|object| object.kids == 0) {
                        within.pop();
                    }
                    if within.len() > MOST_DEPTH {
                        return Err(self.wrong(&format!("objects at most {MOST_DEPTH} deep in each other"), line));
                    }
                    let above = within.last_mut().map_or(upright, |object| {
                        object.kids -= 1;
                        object.place
                    });
                    let object = self.object(above, &materials, &mut mesh, (&mut groups, &mut cutter))?;
                    within.push(object);
                }
                _ => return Err(self.wrong("MATERIAL or OBJECT", line)),
            }
        }
        mesh.groups = groups.into_all();
        Ok(mesh)
    }

    /// An object up to the number of those in it, which ends it.
    fn object(
        &mut self,
        above: DMat4,
        materials: &[String],
        mesh: &mut Mesh,
        (groups, cutter): (&mut Names, &mut Cutter),
    ) -> Result<Object, AcousticsError> {
        let (mut turn, mut at, mut name) = (DMat3::IDENTITY, DVec3::ZERO, "surface");
        let mut places: Vec<DVec3> = Vec::new();
        let mut first = 0;
        loop {
            let line = self.expect("kids and a number, which end an object")?;
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            match word {
                "name" => name = quoted(rest),
                "loc" => at = self.numbers(rest, "three numbers")?.into(),
                "rot" => turn = DMat3::from_cols_array(&self.numbers(rest, "nine numbers")?),
                // So many letters on the lines that follow.
                "data" => {
                    let letters = self.whole(rest, "a number of letters")?;
                    let end = self.rest.char_indices().nth(letters).map_or(self.rest.len(), |(byte, _)| byte);
                    self.line += self.rest[..end].matches('\n').count();
                    self.rest = &self.rest[end..];
                }
                "numvert" => {
                    let place = above * DMat4::from_mat3_translation(turn, at);
                    first = mesh.vertices.len() as u32;
                    for _ in 0..self.whole(rest, "a number of vertices")? {
                        mesh.within_limits_with(0, places.len()).map_err(|found| self.wrong(Mesh::EXPECTED, &found))?;
                        let vertex = self.expect("a vertex")?;
                        places.push(place.transform_point3(self.numbers(vertex, "three coordinates")?.into()));
                    }
                    mesh.vertices.extend(places.iter().map(|place| place.to_array()));
                }
                "numsurf" => {
                    for _ in 0..self.whole(rest, "a number of surfaces")? {
                        let Some((material, corners)) = self.surface(places.len())? else { continue };
                        let of = materials.get(material).map(String::as_str).filter(|name| !name.is_empty());
                        let group = groups.number(of.unwrap_or(name));
                        let around: Vec<DVec3> = corners.iter().map(|corner| places[*corner as usize]).collect();
                        let cut = cutter.cut(&around).map_err(|found| self.wrong(Cutter::EXPECTED, &found))?;
                        let triangle = |t: [usize; 3]| Triangle { corners: t.map(|i| first + corners[i]), group };
                        mesh.triangles.extend(cut.into_iter().map(triangle));
                        mesh.within_limits().map_err(|found| self.wrong(Mesh::EXPECTED, &found))?;
                    }
                }
                "kids" => {
                    let kids = self.whole(rest, "a number of objects")?;
                    return Ok(Object { place: above * DMat4::from_mat3_translation(turn, at), kids });
                }
                // Pictures, creases, links, what an editor shows.
                _ => {}
            }
        }
    }

    /// The material and the corners of a surface, none of lines.
    fn surface(&mut self, vertices: usize) -> Result<Option<(usize, Vec<u32>)>, AcousticsError> {
        let line = self.expect("SURF and its flags")?;
        let flags = line.strip_prefix("SURF").map(str::trim).unwrap_or_default();
        let flags = u32::from_str_radix(flags.trim_start_matches("0x").trim_start_matches("0X"), 16);
        let flags = flags.map_err(|_| self.wrong("SURF and its flags", line))?;
        let mut material = usize::MAX;
        loop {
            let line = self.expect("refs and a number, which end a surface")?;
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            match word {
                "mat" => material = self.whole(rest, "the number of a material")?,
                "refs" => {
                    let mut corners = Vec::new();
                    for _ in 0..self.whole(rest, "a number of corners")? {
                        let line = self.expect("a corner")?;
                        let word = line.split_ascii_whitespace().next().unwrap_or_default();
                        let corner = self.whole(word, "the number of a vertex")?;
                        if corner >= vertices {
                            return Err(self.wrong(&format!("a corner among {vertices} vertices"), line));
                        }
                        corners.push(corner as u32);
                    }
                    return Ok((flags & KIND == 0).then_some((material, corners)));
                }
                _ => {}
            }
        }
    }
}

/// What stands between quotes, or the first word.
fn quoted(text: &str) -> &str {
    match text.trim().strip_prefix('"') {
        Some(rest) => rest.split('"').next().unwrap_or_default(),
        None => text.split_ascii_whitespace().next().unwrap_or_default(),
    }
}
