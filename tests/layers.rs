//! The layers of the library: imports only go down, and modules have no cyclic imports.
//!
//! Layers are the folders of `src`, modules the folders and files in them. The code is read as
//! text, without comments and tests.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The layers from the lowest to the highest.
const LAYERS: [&str; 5] = ["ground", "mesher", "parallel", "files", "pipeline"];

/// A module: its layer and its name in it.
type Module = (String, String);

/// All source files in a folder, recursively.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the sources can be read") {
        let path = entry.expect("the sources can be read").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The code without comments and without the tests at its end.
fn code(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// The module path of a file, without `src` and `mod`.
fn module_path(file: &Path, root: &Path) -> Vec<String> {
    let relative = file.strip_prefix(root).expect("a file of src").with_extension("");
    let mut path: Vec<String> = relative.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if path.last().is_some_and(|last| last == "mod") {
        path.pop();
    }
    path
}

/// All paths in a tree of imports after a prefix: `a::{b, c::d}` contains `a::b` and `a::c::d`.
fn expand(prefix: &[String], rest: &str, found: &mut Vec<Vec<String>>) -> usize {
    let mut path = prefix.to_vec();
    let mut at = 0;
    loop {
        let word: String = rest[at..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        at += word.len();
        if !word.is_empty() {
            path.push(word);
        }
        if !rest[at..].starts_with("::") {
            found.push(path);
            return at;
        }
        at += 2;
        if rest[at..].starts_with('{') {
            at += 1;
            while !rest[at..].starts_with('}') {
                let blank = rest[at..].len() - rest[at..].trim_start_matches([' ', '\n', ',']).len();
                at += blank;
                if rest[at..].starts_with('}') {
                    break;
                }
                let taken = expand(&path, &rest[at..], found);
                // Anything else, such as `*` or `as name`, is skipped up to the next path.
                at += taken + rest[at + taken..].find([',', '}']).expect("a closed group of imports");
            }
            return at + 1;
        }
    }
}

/// The modules of the crate that a file imports.
fn imports(file: &Path, root: &Path) -> BTreeSet<Module> {
    let text = code(&std::fs::read_to_string(file).expect("the sources can be read"));
    let own = module_path(file, root);
    let mut paths = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        if at == 0 || !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$') {
            expand(&[], &text[at + "crate::".len()..], &mut paths);
        }
    }
    for (at, _) in text.match_indices("super::") {
        if text[..at].ends_with("super::") {
            continue;
        }
        let chain = text[at..].split("super::").take_while(|before| before.is_empty()).count();
        let above = own.len().saturating_sub(chain);
        expand(&own[..above], &text[at + chain * "super::".len()..], &mut paths);
    }
    let module = |path: Vec<String>| match &path[..] {
        [layer, module, ..] if LAYERS.contains(&layer.as_str()) => Some((layer.clone(), module.clone())),
        _ => None,
    };
    paths.into_iter().filter_map(module).collect()
}

/// The imports of each module, without its tests.
fn graph() -> BTreeMap<Module, BTreeSet<Module>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let is_test = |file: &PathBuf| {
        let path = module_path(file, &root);
        let named = |name: &String| {
            name.ends_with("tests")
                || ["samples", "fixtures", "testing", "conformance"].contains(&name.as_str())
        };
        path.iter().any(named)
    };
    let mut graph: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for file in files.iter().filter(|file| !is_test(file)) {
        if let [layer, module, ..] = &module_path(file, &root)[..] {
            let own = (layer.clone(), module.clone());
            let names = imports(file, &root).into_iter().filter(|other| *other != own);
            graph.entry(own.clone()).or_default().extend(names);
        }
    }
    graph
}

fn level(module: &Module) -> usize {
    LAYERS.iter().position(|layer| *layer == module.0).unwrap_or_else(|| panic!("{} is no layer", module.0))
}

#[test]
fn imports_go_down() {
    let graph = graph();
    let known: BTreeSet<&str> = graph.keys().map(|(layer, _)| layer.as_str()).collect();
    assert_eq!(known, BTreeSet::from(LAYERS), "folders of src");
    let up: Vec<String> = graph
        .iter()
        .flat_map(|(module, names)| names.iter().map(move |other| (module, other)))
        .filter(|(module, other)| level(other) > level(module))
        .map(|(module, other)| format!("{}::{} imports {}::{}", module.0, module.1, other.0, other.1))
        .collect();
    assert!(up.is_empty(), "{}", up.join("\n"));
}

#[test]
fn no_modules_import_each_other_in_a_circle() {
    let mut graph = graph();
    // A module that imports none of the remaining ones can be below all of them.
    while let Some(lowest) = graph
        .iter()
        .find(|(_, names)| names.iter().all(|other| !graph.contains_key(other)))
        .map(|(module, _)| module.clone())
    {
        graph.remove(&lowest);
    }
    let left: Vec<String> = graph
        .iter()
        .map(|((layer, module), names)| {
            let names: Vec<&str> = names
                .iter()
                .filter(|other| graph.contains_key(other))
                .map(|(_, name)| name.as_str())
                .collect();
            format!("{layer}::{module} imports {}", names.join(", "))
        })
        .collect();
    assert!(left.is_empty(), "in or above a circle:\n{}", left.join("\n"));
}

#[test]
fn groups_of_imports_are_understood() {
    let mut found = Vec::new();
    expand(&[], "ground::{self, mesh::{Mesh, ids}, size as s, kernel::*};", &mut found);
    let paths: Vec<String> = found.iter().map(|path| path.join("::")).collect();
    assert_eq!(
        paths,
        ["ground::self", "ground::mesh::Mesh", "ground::mesh::ids", "ground::size", "ground::kernel"]
    );
}
