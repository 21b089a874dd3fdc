//! The checked-in assets are what the generator makes, and the scenes show what they claim.

#[path = "../../examples/generate_assets/assets.rs"]
mod generator;

use crate::common::folder::area;
use crate::common::load_with_chains;
use glam::DVec3;
use nephroid::scene::{Geometry, LightKind, Mesh, Rect, Scene};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;
use std::path::Path;

#[test]
fn checked_in_assets_are_the_generated_ones_and_small() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let generated = generator::all();
    for (path, content) in &generated {
        let checked_in = std::fs::read(root.join(path)).unwrap();
        assert!(
            checked_in == *content,
            "{path} differs: run `cargo run --example generate_assets`"
        );
    }
    let expected: BTreeSet<_> = generated.iter().map(|(path, _)| root.join(path)).collect();
    for folder in ["meshes", "environments", "targets", "textures"] {
        for entry in root.join(folder).read_dir().unwrap() {
            let path = entry.unwrap().path();
            assert!(
                expected.contains(&path),
                "{} is not generated",
                path.display()
            );
        }
    }
    let bytes: usize = generated.iter().map(|(_, content)| content.len()).sum();
    assert!(bytes < 9_000_000, "{bytes} bytes");
}

fn mesh<'a>(scene: &'a Scene, name: &str) -> &'a Mesh {
    match &scene.objects[scene.object_index(name).unwrap()].geometry {
        Geometry::Mesh(mesh) => mesh,
        _ => panic!("{name} is not a mesh"),
    }
}

fn rect(scene: &Scene, name: &str) -> (Rect, [u32; 2]) {
    let index = scene.object_index(name).unwrap();
    let (_, rect, texels) = scene
        .planar_receivers()
        .find(|receiver| receiver.0 == index)
        .unwrap();
    (*rect, texels)
}

fn sun(scene: &Scene) -> DVec3 {
    match scene.lights[0].kind {
        LightKind::Sun { direction, .. } => direction,
        _ => panic!("the first light is no sun"),
    }
}

fn triangles(mesh: &Mesh) -> impl Iterator<Item = [DVec3; 3]> {
    (mesh.triangles.iter()).map(|corners| corners.map(|i| mesh.positions[i as usize]))
}

/// Files have seven decimals.
const ROUNDING: f64 = 1e-7;

#[test]
fn the_rings_walls_are_cylinders() {
    let scene = load_with_chains("ring.toml");
    let ring = mesh(&scene, "ring");
    let mut inside = 0;
    for (position, normal) in ring.positions.iter().zip(&ring.normals) {
        let out = DVec3::new(position.x, 0.0, position.z);
        let radius = if normal.dot(out) < 0.0 { 1.0 } else { 1.03 };
        if *normal == DVec3::Y {
            assert_eq!(position.y, 0.4);
        } else {
            assert!((out.length() - radius).abs() < ROUNDING);
            assert!((normal.dot(out.normalize()).abs() - 1.0).abs() < ROUNDING);
        }
        inside += usize::from(radius == 1.0);
    }
    assert_eq!(inside, 192 * 17);
    assert_eq!(ring.triangles.len(), 2 * (192 * 16 + 128 * 8 + 192));
    let flat = |n: f64, r: f64| 2.0 * n * r * (std::f64::consts::PI / n).sin() * 0.4;
    let rim = 0.5 * 192.0 * (TAU / 192.0).sin() * (1.03f64.powi(2) - 1.0);
    let expected = flat(192.0, 1.0) + flat(128.0, 1.03) + rim;
    assert!((area(ring) - expected).abs() < 1e-5);
    assert!((area(ring) - flat(128.0, 1.0) - flat(128.0, 1.03) - rim).abs() > 1e-5);
}

#[test]
fn the_ball_has_the_area_of_its_sphere() {
    let scene = load_with_chains("ball.toml");
    let ball = mesh(&scene, "ball");
    let sphere = |radius: f64| 2.0 * TAU * radius.powi(2);
    // Rounding moves corners by 3e-8 of edges of 0.035: 1e-6 a triangle, 2e-8 of 5120 together.
    assert!((area(ball) / sphere(0.5) - 1.0).abs() < 1e-7);
    let radius = (ball.positions[0] - DVec3::Y).length();
    // With its corners on the sphere the mesh would be smaller by this much.
    assert!(
        (1e-3..2e-3).contains(&(sphere(radius) / sphere(0.5) - 1.0)),
        "{radius}"
    );
    for (position, normal) in ball.positions.iter().zip(&ball.normals) {
        assert!((*position - DVec3::Y - radius * *normal).length() < 2.0 * ROUNDING);
    }
}

#[test]
fn the_dish_is_a_paraboloid_of_even_cells() {
    let scene = load_with_chains("dish.toml");
    let dish = mesh(&scene, "dish");
    assert_eq!(dish.triangles.len(), 2 * 48 * 48);
    let worst_miss = |focal_length: f64| {
        let miss = |(position, normal): (&DVec3, &DVec3)| {
            let reflected = 2.0 * normal.y * *normal - DVec3::Y;
            (reflected - (focal_length * DVec3::Y - *position).normalize()).length()
        };
        dish.positions
            .iter()
            .zip(&dish.normals)
            .map(miss)
            .fold(0.0, f64::max)
    };
    assert!(worst_miss(1.0) < 4.0 * ROUNDING && worst_miss(1.0001) > 4.0 * ROUNDING);
    for position in &dish.positions {
        let height = (position.x.powi(2) + position.z.powi(2)) / 4.0;
        assert!((position.y - height).abs() < ROUNDING);
    }
    let rim = dish
        .positions
        .iter()
        .map(|p| p.x.hypot(p.z))
        .fold(0.0, f64::max);
    assert!((rim - 0.5).abs() < ROUNDING);
    let sizes: Vec<f64> = triangles(dish)
        .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
        .collect();
    let (least, most) = sizes
        .iter()
        .fold((f64::MAX, 0.0f64), |(l, m), s| (l.min(*s), m.max(*s)));
    assert!(most / least < 1.5, "{}", most / least);
}

#[test]
fn all_of_the_flat_mirrors_light_lands_on_the_floor() {
    let scene = load_with_chains("mirror.toml");
    let Geometry::Rect(mirror) = scene.objects[scene.object_index("mirror").unwrap()].geometry
    else {
        panic!("the mirror is a rect");
    };
    let (floor, _) = rect(&scene, "floor");
    let (light, normal) = (sun(&scene), mirror.normal());
    assert!(light.dot(normal) > 0.0);
    let reflected = 2.0 * light.dot(normal) * normal - light;
    for corner in mirror.to_mesh().positions {
        let at = corner - corner.y / reflected.y * reflected - floor.origin;
        for edge in [floor.edge_u, floor.edge_v] {
            // Room for the soft edge, 1 cm.
            let (along, room) = (at.dot(edge.normalize()), 0.01);
            assert!(along > room && along < edge.length() - room, "{along}");
        }
    }
}

#[test]
fn the_caustic_of_the_corner_runs_over_the_common_edge() {
    let scene = load_with_chains("corner.toml");
    let ((floor, floor_texels), (wall, wall_texels)) =
        (rect(&scene, "floor"), rect(&scene, "wall"));
    assert_eq!((wall.origin, wall.edge_u), (floor.origin, floor.edge_v));
    assert_eq!((floor.normal(), wall.normal()), (DVec3::Y, DVec3::X));
    for (rect, [width, height]) in [(floor, floor_texels), (wall, wall_texels)] {
        assert!((rect.edge_u.length() / f64::from(width) - 0.0025).abs() < 1e-15);
        assert!((rect.edge_v.length() / f64::from(height) - 0.0025).abs() < 1e-15);
    }
    // Where the reflected light touches the nephroid, on the way from each vertex of the mirror.
    let mirror = mesh(&scene, "half_cylinder");
    let light = sun(&scene);
    let (mut on_floor, mut on_wall) = (0, 0);
    for (position, normal) in mirror.positions.iter().zip(&mirror.normals) {
        let reflected = 2.0 * light.dot(*normal) * *normal - light;
        let across = reflected.x.hypot(reflected.z);
        let caustic = *position + -normal.x / 2.0 / across * reflected;
        let floor_hit = *position - position.y / reflected.y * reflected;
        if floor_hit.x > wall.origin.x {
            on_floor += usize::from(caustic.y <= 0.0);
        } else {
            let wall_hit = *position + (wall.origin.x - position.x) / reflected.x * reflected;
            assert!(wall_hit.y < wall.edge_v.y);
            on_wall += usize::from(caustic.x <= wall.origin.x);
        }
    }
    assert!(on_floor > 100 && on_wall > 10, "{on_floor} {on_wall}");
}

#[test]
fn the_post_stands_in_the_rings_caustic() {
    let scene = load_with_chains("blocker.toml");
    let post = mesh(&scene, "post");
    let light = DVec3::new(sun(&scene).x, 0.0, sun(&scene).z).normalize();
    let foot = post.positions.iter().sum::<DVec3>() / post.positions.len() as f64;
    // The cusp of the nephroid is half a radius from the axis, away from the sun.
    let from_cusp = DVec3::new(foot.x, 0.0, foot.z) + 0.5 * light;
    assert!(from_cusp.length() < 0.15, "{from_cusp}");
    assert!(
        post.positions
            .iter()
            .all(|p| p.y >= 0.0 && p.x.hypot(p.z) < 1.0)
    );
    assert!(post.positions.iter().any(|p| p.y == 0.0));
}

/// A mesh as its file has it, and as it is loaded.
struct Irregular {
    obj: String,
    mesh: Mesh,
    /// By vertex of the mesh, the number of its position: equal positions have one number.
    places: Vec<usize>,
}

impl Irregular {
    fn load(name: &str) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes");
        let scene = load_with_chains(&format!("{name}.toml"));
        let mesh = scene
            .objects
            .iter()
            .find_map(|object| object.geometry.as_mesh());
        let mesh = mesh.unwrap().into_owned();
        let mut numbers = HashMap::new();
        let mut number = |position: &DVec3| {
            let next = numbers.len();
            *numbers
                .entry(position.to_array().map(f64::to_bits))
                .or_insert(next)
        };
        Self {
            obj: std::fs::read_to_string(root.join(name).with_extension("obj")).unwrap(),
            places: mesh.positions.iter().map(&mut number).collect(),
            mesh,
        }
    }

    fn lines(&self, keyword: &str) -> Vec<&str> {
        (self.obj.lines())
            .filter(|line| line.split(' ').next() == Some(keyword))
            .collect()
    }

    fn triangles(&self) -> Vec<[usize; 3]> {
        (self.mesh.triangles.iter())
            .map(|corners| corners.map(|i| self.places[i as usize]))
            .collect()
    }

    /// By position, how many edges meet there.
    fn valences(&self) -> Vec<usize> {
        let mut neighbours = BTreeMap::<usize, BTreeSet<usize>>::new();
        for [a, b, c] in self.triangles() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                neighbours.entry(from).or_default().insert(to);
                neighbours.entry(to).or_default().insert(from);
            }
        }
        neighbours.values().map(BTreeSet::len).collect()
    }

    /// By triangle, its longest side over the height on that side.
    fn aspects(&self) -> Vec<f64> {
        (triangles(&self.mesh))
            .map(|[a, b, c]| {
                let longest = [b - a, c - b, a - c].map(DVec3::length_squared);
                longest.into_iter().fold(0.0, f64::max) / (b - a).cross(c - a).length()
            })
            .collect()
    }
}

/// Whether every edge joins two triangles, which run along it in opposite directions.
fn is_closed(triangles: &[[usize; 3]]) -> bool {
    let mut edges = HashMap::new();
    for &[a, b, c] in triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    (edges.iter()).all(|(&(a, b), &count)| count == 1 && edges.get(&(b, a)) == Some(&1))
}

fn share<T>(all: &[T], is_counted: impl Fn(&T) -> bool) -> f64 {
    all.iter().filter(|one| is_counted(one)).count() as f64 / all.len() as f64
}

#[test]
fn irregular_meshes_are_closed_and_face_outward() {
    let counts: [(&str, RangeInclusive<usize>); 5] = [
        ("mesh_rock", 4500..=5500),
        ("mesh_cage", 900..=1100),
        ("mesh_scan", 68_000..=72_000),
        ("mesh_part", 1000..=3000),
        ("mesh_animal", 300..=900),
    ];
    for (name, count) in counts {
        let irregular = Irregular::load(name);
        let mut welded = irregular.triangles();
        assert!(count.contains(&welded.len()), "{name}: {}", welded.len());
        assert!(is_closed(&welded), "{name}");
        welded[0].reverse();
        assert!(!is_closed(&welded) && !is_closed(&welded[1..]), "{name}");

        let volume: f64 = triangles(&irregular.mesh)
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        assert!(volume > 0.05, "{name}: {volume} m³");
        let thinnest = irregular.aspects().into_iter().fold(0.0, f64::max);
        assert!(thinnest < 1e4, "{name}: {thinnest}");
        let [low, high] = irregular.mesh.bounds();
        let size = (high - low).max_element();
        assert!((0.8..1.4).contains(&size), "{name}: {size} m");
        // On the floor, but not through it.
        assert!((0.005..0.015).contains(&low.y), "{name}: {low}");
    }
}

#[test]
fn the_rock_has_two_normals_at_creases() {
    let rock = Irregular::load("mesh_rock");
    assert_eq!(rock.lines("f").len(), 5120);
    let mut normals = BTreeMap::<usize, Vec<DVec3>>::new();
    for (place, normal) in rock.places.iter().zip(&rock.mesh.normals) {
        normals.entry(*place).or_default().push(*normal);
    }
    let normals: Vec<_> = normals.into_values().collect();
    let creased = share(&normals, |normals| normals.len() > 1);
    assert!((0.1..0.4).contains(&creased), "{creased}");
    let is_sharp = |normals: &Vec<DVec3>| normals[0].angle_between(normals[1]) > 0.3;
    let creases: Vec<_> = normals.into_iter().filter(|n| n.len() > 1).collect();
    assert!(share(&creases, is_sharp) > 0.8);
}

#[test]
fn the_cage_has_uneven_quads_and_triangles_without_normals() {
    let cage = Irregular::load("mesh_cage");
    assert_eq!(cage.lines("vn").len(), 0);
    for (corners, least) in [(4, 300), (3, 50)] {
        let faces = cage.lines("f").into_iter();
        let count = faces
            .filter(|face| face.split(' ').count() == 1 + corners)
            .count();
        assert!(count > least, "{count} faces with {corners} corners");
    }
    let areas: Vec<f64> = triangles(&cage.mesh)
        .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
        .collect();
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    assert!(share(&areas, |area| *area < 0.65 * mean) > 0.1);
    assert!(share(&areas, |area| *area > 1.5 * mean) > 0.05);
}

#[test]
fn the_scan_has_irregular_triangles_without_normals() {
    let scan = Irregular::load("mesh_scan");
    assert_eq!(scan.lines("vn").len(), 0);
    let valences = scan.valences();
    assert!(share(&valences, |valence| *valence == 6) < 0.5);
    assert!(share(&valences, |valence| *valence < 5) > 0.05);
    assert!(share(&valences, |valence| *valence > 7) > 0.05);
}

#[test]
fn the_part_has_slivers_and_doubled_vertices() {
    let part = Irregular::load("mesh_part");
    let lines = part.lines("v");
    let distinct: BTreeSet<_> = lines.iter().collect();
    assert!(lines.len() as f64 > 1.5 * distinct.len() as f64);
    assert!(part.lines("vn").len() > 500);
    let aspects = part.aspects();
    assert!(share(&aspects, |aspect| *aspect > 20.0) > 0.5);
    assert!(share(&aspects, |aspect| *aspect > 100.0) > 0.02);
    // Round faces have smooth normals, flat ones the face's.
    let flat = |corners: &[u32; 3]| {
        let normals = corners.map(|i| part.mesh.normals[i as usize]);
        normals[0] == normals[1] && normals[1] == normals[2]
    };
    let share_of_flat = share(&part.mesh.triangles, flat);
    assert!((0.2..0.5).contains(&share_of_flat), "{share_of_flat}");
}

#[test]
fn the_animal_has_one_normal_at_each_vertex() {
    let animal = Irregular::load("mesh_animal");
    assert!(animal.lines("vn").len() > 100);
    let distinct: BTreeSet<_> = animal.places.iter().collect();
    assert_eq!(distinct.len(), animal.places.len());
    let valences = animal.valences();
    assert!(share(&valences, |valence| *valence == 6) < 0.5);
}
