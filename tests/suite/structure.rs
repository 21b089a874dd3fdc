//! How the source is laid out: no two files need each other, and the renderer's are short.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Lines of a file of the renderer and its shaders, at most.
const MOST_LINES: usize = 500;

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in folder.read_dir().unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files(&path, found),
            false => found.push(path),
        }
    }
}

fn all(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    files(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join(folder),
        &mut found,
    );
    found
}

#[test]
fn files_of_the_renderer_are_short() {
    let mut long = Vec::new();
    for path in ["src/render", "src/gpu", "glsl"].into_iter().flat_map(all) {
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        if lines > MOST_LINES {
            long.push(format!("{}: {lines} lines", path.display()));
        }
    }
    assert_eq!(long, Vec::<String>::new());
}

/// Paths that a file's `use` lines name, as `a::b::c` from the crate's root; `of` is the file's own. Tests within the
/// file do not count, nor does what a `mod.rs` hands on.
fn uses(of: &str, text: &str) -> BTreeSet<String> {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    let mut found = BTreeSet::new();
    for item in text.split("\nuse ").skip(1) {
        let item: String = item.split(';').next().unwrap().split_whitespace().collect();
        let (base, names) = match item.split_once('{') {
            Some((base, names)) => (base.to_owned(), names.trim_end_matches('}').to_owned()),
            None => (item, String::new()),
        };
        for name in names.split(',') {
            let path = format!("{base}{name}");
            let mut parent: Vec<&str> = of.split("::").collect();
            let mut rest = path.as_str();
            if let Some(from_root) = rest.strip_prefix("crate::") {
                (parent, rest) = (Vec::new(), from_root);
            } else if !rest.starts_with("super::") {
                continue;
            }
            while let Some(from_parent) = rest.strip_prefix("super::") {
                parent.pop();
                rest = from_parent;
            }
            parent.push(rest);
            found.insert(parent.join("::"));
        }
    }
    found
}

/// The circles in a graph, as the sets of those that reach each other.
fn circles(graph: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<BTreeSet<String>> {
    let reached = |start: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(next) = open.pop() {
            for other in graph.get(next).into_iter().flatten() {
                if seen.insert(other.clone()) {
                    open.push(other);
                }
            }
        }
        seen
    };
    let from: BTreeMap<&String, BTreeSet<String>> = graph.keys().map(|f| (f, reached(f))).collect();
    (graph.keys())
        .filter(|file| from[file].contains(*file))
        .map(|file| {
            let mutual = from[file]
                .iter()
                .filter(|other| from[*other].contains(file));
            mutual.cloned().collect()
        })
        .collect()
}

#[test]
fn no_two_files_need_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut texts = BTreeMap::new();
    for path in all("src")
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
    {
        let inside = path.strip_prefix(&root).unwrap().with_extension("");
        let parts: Vec<_> = inside.iter().map(|part| part.to_str().unwrap()).collect();
        // A mod.rs only hands on what is in its folder.
        if parts.last() != Some(&"mod") {
            texts.insert(parts.join("::"), std::fs::read_to_string(&path).unwrap());
        }
    }
    let file_of = |path: &str| {
        let mut path = path.to_owned();
        loop {
            if texts.contains_key(&path) {
                return Some(path);
            }
            path.truncate(path.rfind("::")?);
        }
    };
    let graph: BTreeMap<String, BTreeSet<String>> = (texts.iter())
        .map(|(file, text)| {
            let needs = uses(file, text)
                .into_iter()
                .filter_map(|path| file_of(&path));
            (file.clone(), needs.filter(|other| other != file).collect())
        })
        .collect();
    assert!(graph["render::frame"].contains("render::device_scene"));
    assert_eq!(circles(&graph), BTreeSet::new());

    // A circle of three is seen.
    let edge = |a: &str, b: &str| (a.to_owned(), BTreeSet::from([b.to_owned()]));
    let circle = BTreeMap::from([
        edge("a", "b"),
        edge("b", "c"),
        edge("c", "a"),
        edge("d", "a"),
    ]);
    assert_eq!(circles(&circle).len(), 1);
}
