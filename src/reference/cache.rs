//! References kept on disk between runs, as they take minutes.
//!
//! An entry is found by a hash of all that the solution depends on: geometry, mirrors, lights, the pixels of
//! environments, receiver, texels, options and [`VERSION`]. Names, the camera and the colours of diffuse
//! surfaces do not count for a light map; for a view, camera and colours do. A file holds a checksum and the
//! numbers; one that is damaged is made again.

use super::view::{View, view};
use super::{Map, Options, Progress, Reference, VERSION, caustic};
use crate::error::Result;
use crate::output::write_atomically;
use crate::scene::{
    AlbedoMap, Camera, Dielectric, Dispersion, Geometry, Light, LightKind, MaterialKind, Mesh,
    Object, Rect, Scene, Unwrapping,
};
use blake3::{Hash, Hasher};
use glam::DVec3;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// What [`cached_caustic`] or [`cached_view`] found or computed.
#[derive(Debug)]
pub struct Cached<T = Reference> {
    pub reference: T,
    /// Whether an earlier run had computed it.
    pub from_cache: bool,
    /// Of an entry that was damaged and is made again, and of a folder that cannot be written.
    pub warnings: Vec<String>,
}

/// [`caustic`], or what it found for the same input before: the result is kept in the folder
/// `nephroid/references` of the user's cache folder, 48 bytes a texel.
///
/// # Errors
/// As [`caustic`].
pub fn cached_caustic(
    scene: &Scene,
    receiver: usize,
    texels: [u32; 2],
    options: &Options,
    progress: &mut dyn FnMut(&Progress),
    cancel: &AtomicBool,
) -> Result<Cached> {
    super::check(texels, options)?;
    let is_receiver = scene
        .light_maps()
        .iter()
        .any(|(index, _)| *index == receiver);
    let entry = Entry::of(|| key(scene, receiver, texels, options)).filter(|_| is_receiver);
    cached(entry, texels, || {
        caustic(scene, receiver, texels, options, progress, cancel)
    })
}

/// [`view`], or what it found for the same input before, kept as by [`cached_caustic`].
///
/// # Errors
/// As [`view`].
pub fn cached_view(
    scene: &Scene,
    size: [u32; 2],
    options: &Options,
    progress: &mut dyn FnMut(&Progress),
    cancel: &AtomicBool,
) -> Result<Cached<View>> {
    super::view::check(size, options)?;
    let entry = Entry::of(|| view_key(scene, size, options));
    cached(entry, size, || view(scene, size, options, progress, cancel))
}

/// What the entry holds, or what `compute` does, which is kept there.
fn cached<T: Kept>(
    entry: Option<Entry>,
    size: [u32; 2],
    compute: impl FnOnce() -> Result<T>,
) -> Result<Cached<T>> {
    let mut warnings = Vec::new();
    if let Some(entry) = &entry {
        match entry.read(size) {
            Ok(Some(reference)) => {
                return Ok(Cached {
                    reference,
                    from_cache: true,
                    warnings,
                });
            }
            Ok(None) => {}
            Err(reason) => warnings.push(format!(
                "{}: {reason}; the reference was made again",
                entry.file.display()
            )),
        }
    }
    let reference = compute()?;
    let kept = match &entry {
        Some(entry) => entry.write(&reference).map_err(|e| e.to_string()),
        None => Err("the user has no cache folder".into()),
    };
    if let Err(reason) = kept {
        warnings.push(format!(
            "the reference is not kept for later runs: {reason}"
        ));
    }
    Ok(Cached {
        reference,
        from_cache: false,
        warnings,
    })
}

/// What the entry in `file` holds under `key`; for the fuzz target.
#[doc(hidden)]
pub fn read_cache_entry(
    file: &Path,
    key: [u8; blake3::OUT_LEN],
    texels: [u32; 2],
) -> Result<Option<Reference>, String> {
    let entry = Entry {
        file: file.to_owned(),
        key: key.into(),
    };
    entry.read(texels)
}

/// Bytes of an entry: a checksum, a header, and two maps of three channels. Public for the fuzz target and its seeds.
#[doc(hidden)]
pub fn cache_entry_bytes([width, height]: [u32; 2]) -> u64 {
    let texels = u64::from(width) * u64::from(height);
    blake3::OUT_LEN as u64 + 8 * (HEADER_VALUES as u64 + 6 * texels)
}

struct Entry {
    file: PathBuf,
    key: Hash,
}

/// Values before the maps of an entry: relative error, samples, received flux, its standard error.
const HEADER_VALUES: usize = 8;

type Header = [f64; HEADER_VALUES];

/// What an entry can hold: a header, and two maps of one size.
trait Kept {
    fn split(&self) -> (Header, [&Map; 2]);
    fn join(size: [u32; 2], header: Header, maps: [Map; 2]) -> Self;
}

impl Kept for Reference {
    fn split(&self) -> (Header, [&Map; 2]) {
        let [r, g, b] = self.received_flux;
        let [error_r, error_g, error_b] = self.received_flux_error;
        let samples = f64::from_bits(self.samples);
        let error = self.relative_error;
        let header = [error, samples, r, g, b, error_r, error_g, error_b];
        (header, [&self.irradiance, &self.standard_error])
    }

    fn join([width, height]: [u32; 2], header: Header, maps: [Map; 2]) -> Self {
        let [irradiance, standard_error] = maps;
        let [relative_error, samples, r, g, b, error_r, error_g, error_b] = header;
        Self {
            width,
            height,
            irradiance,
            standard_error,
            relative_error,
            samples: samples.to_bits(),
            received_flux: [r, g, b],
            received_flux_error: [error_r, error_g, error_b],
        }
    }
}

/// Its received flux is 0.
impl Kept for View {
    fn split(&self) -> (Header, [&Map; 2]) {
        let samples = f64::from_bits(self.samples);
        let mut header = Header::default();
        header[..2].copy_from_slice(&[self.relative_error, samples]);
        (header, [&self.radiance, &self.standard_error])
    }

    fn join([width, height]: [u32; 2], header: Header, maps: [Map; 2]) -> Self {
        let [radiance, standard_error] = maps;
        let [relative_error, samples, ..] = header;
        Self {
            width,
            height,
            radiance,
            standard_error,
            relative_error,
            samples: samples.to_bits(),
        }
    }
}

impl Entry {
    fn new(folder: &Path, key: Hash) -> Self {
        let file = folder.join(format!("{key}.bin"));
        Self { file, key }
    }

    /// In the user's cache folder, where there is one.
    fn of(key: impl FnOnce() -> Hash) -> Option<Self> {
        (dirs::cache_dir()).map(|cache| Self::new(&cache.join("nephroid/references"), key()))
    }

    /// `None` where there is no such file, and a reason where there is a bad one. The sides are those of
    /// a light map or a view.
    fn read<T: Kept>(&self, [width, height]: [u32; 2]) -> Result<Option<T>, String> {
        let texels = width as usize * height as usize;
        let length = cache_entry_bytes([width, height]);
        let found = match std::fs::metadata(&self.file) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            found => found.map_err(|e| e.to_string())?.len(),
        };
        if found != length {
            return Err(format!("it has {found} bytes in place of {length}"));
        }
        let content = std::fs::read(&self.file).map_err(|e| e.to_string())?;
        let damaged = || "its checksum is wrong".to_owned();
        let (checksum, data) = content.split_first_chunk().ok_or_else(damaged)?;
        if self.checksum(data) != *checksum {
            return Err(damaged());
        }
        let values: Vec<f64> = bytemuck::pod_collect_to_vec(data);
        let (header, maps) = (values.split_first_chunk()).expect("the length was checked");
        let map = |values: &[f64]| -> Map { values.as_chunks().0.to_vec() };
        let (mean, standard_error) = maps.split_at(3 * texels);
        let maps = [map(mean), map(standard_error)];
        Ok(Some(T::join([width, height], *header, maps)))
    }

    fn write(&self, kept: &impl Kept) -> Result<()> {
        let (header, maps) = kept.split();
        let mut values = header.to_vec();
        for map in maps {
            values.extend(map.as_flattened());
        }
        let data: &[u8] = bytemuck::cast_slice(&values);
        // Where this fails, so does the writing, which says why.
        let _ = std::fs::create_dir_all(self.file.parent().expect("a file in a folder"));
        write_atomically(&self.file, &[&self.checksum(data), data].concat())
    }

    /// Depends on the key, too, so that a file under a wrong name counts as damaged.
    fn checksum(&self, data: &[u8]) -> [u8; blake3::OUT_LEN] {
        *blake3::keyed_hash(self.key.as_bytes(), data).as_bytes()
    }
}

/// Hash of all that a light map depends on. The patterns name every field, so that a new one is
/// not forgotten.
fn key(scene: &Scene, receiver: usize, texels: [u32; 2], options: &Options) -> Hash {
    let mut feed = Feed(Hasher::new());
    feed.number(VERSION.into());
    feed.number(receiver as u64);
    texels.iter().for_each(|&side| feed.number(side.into()));
    feed.options(options);
    // What the receiver's light map is laid out from.
    feed.scene(scene, |index| index == receiver);
    feed.0.finalize()
}

/// Hash of all that a view depends on.
fn view_key(scene: &Scene, size: [u32; 2], options: &Options) -> Hash {
    let mut feed = Feed(Hasher::new());
    // No receiver has this number.
    feed.number(VERSION.into());
    feed.number(u64::MAX);
    size.iter().for_each(|&side| feed.number(side.into()));
    feed.options(options);
    feed.scene(scene, |index| scene.objects[index].light_map.is_some());
    // The others light surfaces directly.
    (scene.lights.iter())
        .filter(|light| !light.kind.casts_caustics())
        .for_each(|light| feed.light(light));
    for object in &scene.objects {
        let texels = object.light_map.unwrap_or_default();
        texels.iter().for_each(|&side| feed.number(side.into()));
        if let MaterialKind::Diffuse { albedo } = &scene.materials[object.material].kind {
            feed.vectors(&[*albedo]);
        }
        let map = scene.materials[object.material].albedo_map;
        feed.number(map.is_some().into());
        if let Some(AlbedoMap { texture, uv_scale }) = map {
            feed.values(&uv_scale.to_array());
            let level = &scene.textures[texture].levels[0];
            feed.number(level.width.into());
            feed.number(level.height.into());
            feed.0.update(level.texels.as_flattened());
            for uv in (object.uvs.iter()).flat_map(|uvs| uvs.as_flattened()) {
                feed.values(&uv.to_array());
            }
        }
    }
    let Camera {
        position,
        target,
        fov,
        exposure_ev: _,
    } = scene.camera;
    feed.vectors(&[position, target]);
    feed.values(&[fov]);
    feed.0.finalize()
}

/// A hash that is fed with numbers of fixed size, and with the length before every list.
struct Feed(Hasher);

impl Feed {
    fn options(&mut self, options: &Options) {
        let Options {
            error,
            max_samples,
            seed,
        } = *options;
        self.values(&[error]);
        self.number(max_samples);
        self.number(seed.into());
    }

    /// All but the camera, the colours of diffuse surfaces and lights without caustics; what objects' light maps are laid out from
    /// for those that `unwraps`.
    fn scene(&mut self, scene: &Scene, unwraps: impl Fn(usize) -> bool) {
        let Scene {
            lights,
            materials,
            objects,
            max_interfaces,
            camera: _,
            textures: _,
        } = scene;
        self.number((*max_interfaces).into());
        let casting: Vec<_> = (lights.iter())
            .filter(|light| light.kind.casts_caustics())
            .collect();
        self.number(casting.len() as u64);
        casting.into_iter().for_each(|light| self.light(light));
        for (index, object) in objects.iter().enumerate() {
            let Object {
                material,
                geometry,
                blocks_light,
                name: _,
                light_map: _,
                unwrapping,
                uvs: _,
            } = object;
            self.number((*blocks_light).into());
            match &materials[*material].kind {
                MaterialKind::Mirror { reflectance } => {
                    self.number(0);
                    self.vectors(&[*reflectance]);
                }
                MaterialKind::Diffuse { albedo: _ } => self.number(1),
                MaterialKind::Conductor { index, extinction } => {
                    self.number(2);
                    self.vectors(&[*index, *extinction]);
                }
                MaterialKind::Dielectric(Dielectric {
                    ior,
                    dispersion,
                    absorption,
                    priority,
                    thin,
                }) => {
                    self.number(3);
                    self.values(&[*ior, (*priority).into()]);
                    match dispersion {
                        None => {}
                        Some(Dispersion::Cauchy(coefficients)) => {
                            self.number(1);
                            self.values(coefficients);
                        }
                        Some(Dispersion::Sellmeier(sellmeier)) => {
                            self.number(2);
                            self.values(sellmeier.terms.as_flattened());
                        }
                    }
                    self.vectors(&[*absorption]);
                    self.number((*thin).into());
                }
            }
            self.geometry(geometry);
            if let Some(unwrapping) = unwrapping.as_ref().filter(|_| unwraps(index)) {
                let Unwrapping { rest, own } = unwrapping.as_ref();
                self.geometry(&Geometry::Mesh(rest.clone()));
                self.number(own.len() as u64);
                for uv in own.as_flattened() {
                    self.values(&uv.to_array());
                }
            }
        }
    }

    fn number(&mut self, number: u64) {
        self.0.update(&number.to_le_bytes());
    }

    fn values(&mut self, values: &[f64]) {
        for value in values {
            self.number(value.to_bits());
        }
    }

    fn vectors(&mut self, vectors: &[DVec3]) {
        for vector in vectors {
            self.values(&vector.to_array());
        }
    }

    fn light(&mut self, light: &Light) {
        let Light { kind, name: _ } = light;
        match kind {
            LightKind::Sun {
                direction,
                irradiance,
                angular_radius,
            } => {
                self.number(0);
                self.vectors(&[*direction, *irradiance]);
                self.values(&[*angular_radius]);
            }
            LightKind::Lamp {
                position,
                radius,
                radiant_flux,
            } => {
                self.number(2);
                self.vectors(&[*position, *radiant_flux]);
                self.values(&[*radius]);
            }
            LightKind::Environment {
                map,
                scale,
                rotation,
                casts_caustics: _,
            } => {
                self.number(1);
                self.values(&[*scale, *rotation]);
                self.number(map.width.into());
                self.number(map.height.into());
                for value in map.radiance.as_flattened() {
                    self.0.update(&value.to_le_bytes());
                }
            }
        }
    }

    fn geometry(&mut self, geometry: &Geometry) {
        match geometry {
            Geometry::Mesh(_) | Geometry::Placed { .. } | Geometry::Waves(_) => {
                let mesh = geometry.mesh();
                let Mesh {
                    positions,
                    normals,
                    triangles,
                } = mesh.as_ref();
                self.number(0);
                self.number(positions.len() as u64);
                self.vectors(positions);
                self.vectors(normals);
                self.number(triangles.len() as u64);
                for &corner in triangles.as_flattened() {
                    self.number(corner.into());
                }
            }
            Geometry::Rect(Rect {
                origin,
                edge_u,
                edge_v,
            }) => {
                self.number(1);
                self.vectors(&[*origin, *edge_u, *edge_v]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{EnvironmentMap, load};
    use std::sync::Arc;

    fn scene(name: &str) -> Scene {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
        load(&scenes.join(name)).unwrap().scene
    }

    fn solve(options: &Options) -> Reference {
        let scene = scene("mirror.toml");
        let cancel = AtomicBool::new(false);
        caustic(&scene, 1, [8, 8], options, &mut |_| {}, &cancel).unwrap()
    }

    #[test]
    fn what_is_read_is_what_was_written_and_damage_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options {
            error: 0.1,
            ..Options::default()
        };
        let entry = Entry::new(
            &folder.path().join("new/folder"),
            key(&scene("mirror.toml"), 1, [8, 8], &options),
        );
        assert!(entry.read::<Reference>([8, 8]).unwrap().is_none());
        let reference = solve(&options);
        entry.write(&reference).unwrap();
        let read: Reference = entry.read([8, 8]).unwrap().unwrap();
        assert_eq!(format!("{read:?}"), format!("{reference:?}"));

        let whole = std::fs::read(&entry.file).unwrap();
        for index in (0..whole.len()).step_by(97) {
            let mut damaged = whole.clone();
            damaged[index] ^= 1;
            std::fs::write(&entry.file, damaged).unwrap();
            assert!(entry.read::<Reference>([8, 8]).is_err(), "byte {index}");
            std::fs::write(&entry.file, &whole[..index]).unwrap();
            assert!(entry.read::<Reference>([8, 8]).is_err(), "{index} bytes");
        }
        std::fs::write(&entry.file, &whole).unwrap();
        assert!(entry.read::<Reference>([8, 8]).unwrap().is_some());
        assert!(entry.read::<Reference>([8, 4]).is_err());
        // Under the name of another entry.
        let other = Entry::new(folder.path(), blake3::hash(b"another scene"));
        std::fs::write(&other.file, &whole).unwrap();
        assert!(other.read::<Reference>([8, 8]).is_err());
    }

    #[test]
    fn a_size_that_overflows_is_refused_before_an_entry_is_looked_up() {
        let (scene, options) = (scene("mirror.toml"), Options::default());
        let cancel = AtomicBool::new(false);
        let error = cached_caustic(&scene, 1, [u32::MAX; 2], &options, &mut |_| {}, &cancel);
        assert!(matches!(error, Err(crate::Error::Usage { .. })));
    }

    /// A change of one thing that the reference depends on.
    type Change = fn(&mut Scene, &mut Options);

    #[test]
    fn the_key_knows_what_matters_and_nothing_else() {
        let plain = |change: Change| {
            let (mut scene, mut options) = (scene("ball.toml"), Options::default());
            let sun = self::scene("ring.toml").lights.remove(0);
            scene.lights.push(sun);
            scene.lights.push(Light {
                name: "bulb".into(),
                kind: LightKind::Lamp {
                    position: 3.0 * DVec3::Y,
                    radius: 0.1,
                    radiant_flux: DVec3::ONE,
                },
            });
            change(&mut scene, &mut options);
            key(&scene, 1, [8, 4], &options)
        };
        let same = plain(|_, _| {});
        let indifferent: &[Change] = &[
            |_, _| {},
            |s, _| s.camera.fov *= 2.0,
            |s, _| s.objects[0].name.push('x'),
            |s, _| s.objects[1].light_map = Some([2, 2]),
            |s, _| s.lights.iter_mut().for_each(|l| l.name.clear()),
            |s, _| s.materials.push(s.materials[0].clone()),
            |s, _| {
                s.materials[1].kind = MaterialKind::Diffuse {
                    albedo: DVec3::ZERO,
                };
            },
        ];
        for (index, change) in indifferent.iter().enumerate() {
            assert_eq!(plain(*change), same, "{index}");
        }
        let decisive: &[Change] = &[
            |_, o| o.error *= 2.0,
            |_, o| o.max_samples += 1,
            |_, o| o.seed += 1,
            |s, _| s.objects[0].blocks_light ^= true,
            |s, _| {
                s.materials[0].kind = MaterialKind::Mirror {
                    reflectance: DVec3::splat(0.5),
                };
            },
            |s, _| s.objects[0].material = 1,
            |s, _| match &mut s.objects[0].geometry {
                Geometry::Mesh(mesh) => Arc::make_mut(mesh).positions[7].x += 1e-12,
                _ => panic!(),
            },
            |s, _| match &mut s.objects[0].geometry {
                Geometry::Mesh(mesh) => Arc::make_mut(mesh).normals.swap(3, 4),
                _ => panic!(),
            },
            |s, _| match &mut s.objects[0].geometry {
                Geometry::Mesh(mesh) => Arc::make_mut(mesh).triangles[2].rotate_left(1),
                _ => panic!(),
            },
            |s, _| match &mut s.objects[1].geometry {
                Geometry::Rect(rect) => rect.edge_v *= 1.5,
                _ => panic!(),
            },
            |s, _| match &mut s.lights[1].kind {
                LightKind::Sun { angular_radius, .. } => *angular_radius = 0.0,
                _ => panic!(),
            },
            |s, _| match &mut s.lights[2].kind {
                LightKind::Lamp { position, .. } => position.x += 1e-12,
                _ => panic!(),
            },
            |s, _| match &mut s.lights[2].kind {
                LightKind::Lamp { radius, .. } => *radius *= 2.0,
                _ => panic!(),
            },
            |s, _| match &mut s.lights[2].kind {
                LightKind::Lamp { radiant_flux, .. } => radiant_flux.z *= 2.0,
                _ => panic!(),
            },
            |s, _| match &mut s.lights[0].kind {
                LightKind::Environment { map, .. } => {
                    let mut other: EnvironmentMap = (**map).clone();
                    other.radiance[1][2] += 1e-3;
                    *map = Arc::new(other);
                }
                _ => panic!(),
            },
            |s, _| s.lights.reverse(),
            |s, _| drop(s.lights.pop()),
            |s, _| drop(s.objects.pop()),
        ];
        let mut keys = vec![same];
        for (index, change) in decisive.iter().enumerate() {
            let key = plain(*change);
            assert!(!keys.contains(&key), "{index}");
            keys.push(key);
        }
        let (scene, options) = (scene("ball.toml"), Options::default());
        assert_ne!(
            key(&scene, 1, [8, 4], &options),
            key(&scene, 1, [4, 8], &options)
        );
        assert_ne!(
            key(&scene, 1, [8, 4], &options),
            key(&scene, 0, [8, 4], &options)
        );
    }

    #[test]
    fn a_view_knows_camera_and_colours_and_nothing_of_exposure() {
        let plain = |change: Change| {
            let (mut scene, mut options) = (scene("globe.toml"), Options::default());
            change(&mut scene, &mut options);
            view_key(&scene, [8, 4], &options)
        };
        let same = plain(|_, _| {});
        let indifferent: &[Change] = &[
            |s, _| s.camera.exposure_ev += 1.0,
            |s, _| s.objects[0].name.push('x'),
        ];
        for (index, change) in indifferent.iter().enumerate() {
            assert_eq!(plain(*change), same, "{index}");
        }
        let decisive: &[Change] = &[
            |s, _| s.camera.position.x += 1e-12,
            |s, _| s.camera.target.y += 1e-12,
            |s, _| s.camera.fov *= 1.01,
            |s, _| {
                s.materials[1].kind = MaterialKind::Diffuse {
                    albedo: DVec3::ZERO,
                };
            },
            |s, _| s.objects[1].light_map = None,
            |s, _| s.objects[1].light_map = Some([64, 64]),
            |s, _| s.objects[1].unwrapping = None,
            |s, _| s.objects[2].blocks_light ^= true,
            |s, _| drop(s.lights.pop()),
            |_, o| o.seed += 1,
        ];
        let mut keys = vec![same];
        for (index, change) in decisive.iter().enumerate() {
            let key = plain(*change);
            assert!(!keys.contains(&key), "{index}");
            keys.push(key);
        }
        let (scene, options) = (scene("globe.toml"), Options::default());
        assert_ne!(
            view_key(&scene, [4, 8], &options),
            view_key(&scene, [8, 4], &options)
        );
        for receiver in 0..scene.objects.len() {
            assert_ne!(key(&scene, receiver, [8, 4], &options), same);
        }
        // The sky casts no caustics, so that it matters to views only.
        let mut without = scene.clone();
        let sky = without.lights.pop().unwrap();
        assert!(!sky.kind.casts_caustics());
        let of = |scene| key(scene, 1, [8, 4], &options);
        assert_eq!(of(&without), of(&scene));
    }

    #[test]
    fn a_view_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, cancel) = (scene("mirror.toml"), AtomicBool::new(false));
        let options = Options {
            error: 0.5,
            ..Options::default()
        };
        let entry = Entry::new(folder.path(), view_key(&scene, [6, 4], &options));
        let made = view(&scene, [6, 4], &options, &mut |_| {}, &cancel).unwrap();
        entry.write(&made).unwrap();
        let read: View = entry.read([6, 4]).unwrap().unwrap();
        assert_eq!(format!("{read:?}"), format!("{made:?}"));
        assert!(entry.read::<View>([6, 5]).is_err());
    }

    /// Raise [`VERSION`] and change the figures when the reference's results change.
    #[test]
    fn the_version_goes_with_the_results() {
        let options = Options {
            error: 0.1,
            ..Options::default()
        };
        // A flat mirror in the sun; curved ones and lamps, of whose light a part lands; glass.
        let scenes = [
            ("mirror.toml", "floor"),
            ("lamp.toml", "back"),
            ("glass_ball.toml", "floor"),
        ];
        let weighted = scenes.map(|(file, receiver)| {
            let (scene, cancel) = (scene(file), AtomicBool::new(false));
            let receiver = scene.object_index(receiver).unwrap();
            let solved = caustic(&scene, receiver, [8, 8], &options, &mut |_| {}, &cancel);
            let sum: f64 = (solved.unwrap().irradiance.as_flattened().iter().enumerate())
                .map(|(index, value)| index as f64 * value)
                .sum();
            format!("{sum:.9e}")
        });
        assert_eq!(
            (VERSION, weighted),
            (
                6,
                ["1.517380786e3", "2.801281790e-2", "2.377378073e3"].map(String::from)
            )
        );
    }
}
