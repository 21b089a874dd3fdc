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

/// What a file says about other files. A name of a module is a path such as `render::frame`, from the crate's root, whose
/// own name is empty. Globs of the crate's own modules are not followed, as there are none.
struct File {
    /// Its code without `use` items, comments and tests.
    body: String,
    /// What `use` items bring into scope, by name.
    names: BTreeMap<String, String>,
    /// Paths of its private `use` items. A public one only hands on, unless the body has its name.
    private: Vec<String>,
}

/// The paths of a `use` item, of which braces hold several.
fn expand(tree: &str) -> Vec<String> {
    let Some((prefix, list)) = tree.split_once('{') else {
        let path = tree.trim();
        return vec![path.strip_suffix("::self").unwrap_or(path).to_owned()];
    };
    let mut depth = 0;
    let parts = list[..list.rfind('}').unwrap()].split(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    parts
        .filter(|part| !part.trim().is_empty())
        .flat_map(|part| expand(&format!("{}{}", prefix.trim(), part.trim())))
        .collect()
}

fn parse(text: &str) -> File {
    let (mut body, mut names, mut private) = (String::new(), BTreeMap::new(), Vec::new());
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    let mut item = String::new();
    for line in code.lines() {
        let line = line.split("//").next().unwrap().trim();
        let begins = line.starts_with("use ") || line.starts_with("pub") && line.contains(" use ");
        if item.is_empty() && !begins {
            // `mod x;` says where x is, not that it is needed.
            let declares = line.ends_with(';')
                && (line.split_once("mod "))
                    .is_some_and(|(before, _)| before.is_empty() || before.starts_with("pub"));
            if !declares {
                body += line;
                body.push('\n');
            }
            continue;
        }
        item += line;
        if line.ends_with(';') {
            let (visibility, tree) = item.trim_end_matches(';').split_once("use ").unwrap();
            for path in expand(tree) {
                let (path, name) = path.split_once(" as ").unwrap_or_else(|| {
                    let name = path.rsplit("::").next().unwrap();
                    (&path, name)
                });
                names.insert(name.to_owned(), path.to_owned());
                if visibility.is_empty() {
                    private.push(path.to_owned());
                }
            }
            item.clear();
        }
    }
    File {
        body,
        names,
        private,
    }
}

/// The file that defines what `path` names in `file`, through any number of re-exports; the file itself for what is its
/// own or of another crate, and nothing for a module.
fn definer(files: &BTreeMap<String, File>, file: &str, path: &str) -> Option<String> {
    let (first, rest) = path.split_once("::").unwrap_or((path, ""));
    let inside = format!("{file}::{first}");
    let inside = inside.trim_start_matches("::");
    match first {
        "" => None,
        "crate" => definer(files, "", rest),
        "self" => definer(files, file, rest),
        "super" => definer(files, file.rsplit_once("::").map_or("", |(p, _)| p), rest),
        _ if !rest.is_empty() && files.contains_key(inside) => definer(files, inside, rest),
        _ => match files[file].names.get(first) {
            // Another crate, handed on as a whole, has its own name.
            Some(path) if path != first => {
                let path = format!("{path}::{rest}");
                definer(files, file, path.trim_end_matches("::"))
            }
            _ if files.contains_key(inside) => None,
            _ => Some(file.to_owned()),
        },
    }
}

/// Which files each file needs.
fn needs(files: &BTreeMap<String, File>) -> BTreeMap<&str, BTreeSet<String>> {
    let in_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let of = |name: &String, file: &File| -> BTreeSet<String> {
        let words = file.body.split(|c| !in_path(c));
        (words.map(|word| word.trim_matches(':')))
            .chain(file.private.iter().map(String::as_str))
            .filter_map(|path| definer(files, name, path))
            .filter(|other| other != name)
            .collect()
    };
    (files.iter())
        .map(|(name, file)| (name.as_str(), of(name, file)))
        .collect()
}

/// The edges of a graph that are part of a circle.
fn circles(graph: &BTreeMap<&str, BTreeSet<String>>) -> Vec<String> {
    let reaches = |start: &str, end: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(next) = open.pop() {
            if seen.insert(next) {
                open.extend(graph[next].iter().map(String::as_str));
            }
        }
        seen.contains(end)
    };
    let edges = (graph.iter()).flat_map(|(a, needed)| needed.iter().map(move |b| (a, b)));
    edges
        .filter(|(a, b)| reaches(b, a))
        .map(|(a, b)| format!("{a} needs {b}"))
        .collect()
}

#[test]
fn no_two_files_need_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut sources = BTreeMap::new();
    for path in all("src") {
        let inside = path.strip_prefix(&root).unwrap();
        if inside.extension().is_some_and(|e| e == "rs") {
            let inside = inside.with_extension("");
            let parts: Vec<_> = inside.iter().map(|part| part.to_str().unwrap()).collect();
            let name = parts.join("::");
            let name = name.trim_end_matches("::mod").trim_start_matches("lib");
            sources.insert(
                name.to_owned(),
                parse(&std::fs::read_to_string(&path).unwrap()),
            );
        }
    }
    let graph = needs(&sources);
    assert!(graph["render::frame"].contains("render::device_scene"));
    assert!(graph["render::frame"].contains("gpu::recorder"));
    let found = circles(&graph);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Through re-exports, nested braces, new names and paths within code.
#[test]
fn circles_are_seen() {
    let sources = [
        ("", "mod folder;\nmod lone;\npub use ash;\n"),
        ("folder", "mod a;\nmod b;\nmod c;\npub use a::A;\n"),
        (
            "folder::a",
            "use crate::{lone::{self, Lone}, folder::{b::{B, self}}};\n",
        ),
        ("folder::b", "use super::c::C as D;\n// super::A\n"),
        ("folder::c", "struct C(crate::folder::A);\n"),
        ("lone", "use crate::folder;\nstruct Lone(ash::vk::Image);\n"),
    ];
    let files = sources.map(|(name, text)| (name.to_owned(), parse(text)));
    let expected = [
        "folder::a needs folder::b",
        "folder::b needs folder::c",
        "folder::c needs folder::a",
    ];
    assert_eq!(circles(&needs(&BTreeMap::from(files))), expected);
}
