//! No module depends on itself through others. A cycle means that neither side can be read, tested or changed alone.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::LazyLock;
use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemUse, UseTree, Visibility};

type Module = Vec<String>;

/// What a file names: paths of `use` and of expressions and types, and its re-exports by name.
#[derive(Default)]
struct Names {
    paths: Vec<Vec<String>>,
    reexports: BTreeMap<String, Vec<String>>,
}

fn flatten(tree: &UseTree, before: &[String], found: &mut Vec<(String, Vec<String>)>) {
    let with = |name: String| [before, &[name]].concat();
    match tree {
        UseTree::Path(path) => flatten(&path.tree, &with(path.ident.to_string()), found),
        UseTree::Group(group) => group.items.iter().for_each(|tree| flatten(tree, before, found)),
        UseTree::Name(name) if name.ident == "self" => {
            found.push((before.last().cloned().unwrap_or_default(), before.to_vec()))
        }
        UseTree::Name(name) => found.push((name.ident.to_string(), with(name.ident.to_string()))),
        UseTree::Rename(renamed) => found.push((renamed.rename.to_string(), with(renamed.ident.to_string()))),
        UseTree::Glob(_) => found.push(("*".into(), before.to_vec())),
    }
}

/// True for items that only tests compile.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| {
        a.path().is_ident("test")
            || (a.path().is_ident("cfg") && a.parse_args::<syn::Path>().is_ok_and(|path| path.is_ident("test")))
    })
}

impl<'ast> Visit<'ast> for Names {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            Item::Struct(item) => &item.attrs,
            Item::Const(item) => &item.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let mut found = Vec::new();
        flatten(&item.tree, &[], &mut found);
        match item.vis {
            Visibility::Inherited => self.paths.extend(found.into_iter().map(|(_, path)| path)),
            _ => self.reexports.extend(found),
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.push(path.segments.iter().map(|s| s.ident.to_string()).collect());
        visit::visit_path(self, path);
    }
}

/// Every file below `src` as a module, with what it names.
fn modules(folder: &Path, at: &[String], found: &mut BTreeMap<Module, Names>) {
    for entry in std::fs::read_dir(folder).expect("folder").map(|e| e.expect("entry").path()) {
        let stem = entry.file_stem().expect("name").to_string_lossy().into_owned();
        if entry.is_dir() {
            modules(&entry, &[at, &[stem]].concat(), found);
            continue;
        }
        if entry.extension().is_none_or(|e| e != "rs") || stem == "main" || stem == "tests" {
            continue;
        }
        let module = if stem == "mod" || stem == "lib" { at.to_vec() } else { [at, &[stem]].concat() };
        let text = std::fs::read_to_string(&entry).expect("source");
        let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", entry.display()));
        let mut names = Names::default();
        names.visit_file(&file);
        found.insert(module, names);
    }
}

/// The module that a path of `from` leads to, through re-exports. None for other crates, the module itself and the crate's root.
fn target(all: &BTreeMap<Module, Names>, from: &Module, path: &[String]) -> Option<Module> {
    let (mut at, mut rest) = match path.first()?.as_str() {
        "crate" => (Vec::new(), &path[1..]),
        "self" => (from.clone(), &path[1..]),
        "super" => {
            let ups = path.iter().take_while(|s| *s == "super").count();
            (from[..from.len().checked_sub(ups)?].to_vec(), &path[ups..])
        }
        first => {
            let child = [from.as_slice(), &[first.to_string()]].concat();
            all.contains_key(&child).then_some((from.clone(), path))?
        }
    };
    // A re-export may lead to another one; the tree is small, so that a bound ends any loop.
    for _ in 0..32 {
        let Some(next) = rest.first() else { break };
        let child = [at.as_slice(), std::slice::from_ref(next)].concat();
        if all.contains_key(&child) {
            (at, rest) = (child, &rest[1..]);
        } else if let Some(reexport) = all.get(&at)?.reexports.get(next) {
            return target(all, &at, reexport).or(Some(at));
        } else {
            break;
        }
    }
    (!at.is_empty() && at != *from).then_some(at)
}

/// The groups of more than one node that reach each other.
fn cycles(graph: &BTreeMap<String, BTreeSet<String>>) -> Vec<Vec<String>> {
    let reachable = |start: &String| {
        let (mut seen, mut stack) = (BTreeSet::new(), vec![start.clone()]);
        while let Some(node) = stack.pop() {
            for next in graph.get(&node).into_iter().flatten() {
                if seen.insert(next.clone()) {
                    stack.push(next.clone());
                }
            }
        }
        seen
    };
    let reach: BTreeMap<&String, BTreeSet<String>> = graph.keys().map(|n| (n, reachable(n))).collect();
    let mut found: Vec<Vec<String>> = Vec::new();
    for node in graph.keys().filter(|n| reach[n].contains(*n)) {
        if !found.iter().any(|cycle| cycle.contains(node)) {
            let members = graph.keys().filter(|m| reach[node].contains(*m) && reach[m].contains(node));
            found.push(members.cloned().collect());
        }
    }
    found
}

/// From module to module. Shared by the tests: to parse all sources takes seconds.
static DEPENDENCIES: LazyLock<Vec<(Module, Module)>> = LazyLock::new(|| {
    let mut all = BTreeMap::new();
    modules(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &[], &mut all);
    let mut found = BTreeSet::new();
    for (module, names) in all.iter().filter(|(module, _)| !module.is_empty()) {
        let targets = names.paths.iter().filter_map(|path| target(&all, module, path));
        // A module and the files of its own folder are one unit: a type in `mod.rs` may have methods in them.
        let others = targets.filter(|to| !to.starts_with(module) && !module.starts_with(to));
        found.extend(others.map(|to| (module.clone(), to)));
    }
    found.into_iter().collect()
});

fn graph(edges: impl Iterator<Item = (String, String)>) -> BTreeMap<String, BTreeSet<String>> {
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (from, to) in edges.filter(|(from, to)| from != to) {
        graph.entry(to.clone()).or_default();
        graph.entry(from).or_default().insert(to);
    }
    graph
}

#[test]
fn no_top_level_module_depends_on_itself_through_others() {
    let edges = &*DEPENDENCIES;
    let tops = graph(edges.iter().map(|(from, to)| (from[0].clone(), to[0].clone())));
    assert!(tops.len() > 10, "the modules are read: {tops:?}");
    if let Some(cycle) = cycles(&tops).first() {
        let between = edges.iter().filter(|(a, b)| a[0] != b[0] && cycle.contains(&a[0]) && cycle.contains(&b[0]));
        let lines: Vec<String> = between.map(|(a, b)| format!("  {} -> {}", a.join("::"), b.join("::"))).collect();
        panic!("modules depend on each other in a cycle: {}\n{}", cycle.join(", "), lines.join("\n"));
    }
}

#[test]
fn no_file_depends_on_itself_through_others() {
    let edges = &*DEPENDENCIES;
    let files = graph(edges.iter().map(|(from, to)| (from.join("::"), to.join("::"))));
    let found: Vec<String> = cycles(&files)
        .iter()
        .map(|cycle| {
            let inside = |m: &Module| cycle.contains(&m.join("::"));
            let lines = edges.iter().filter(|(a, b)| inside(a) && inside(b));
            lines.map(|(a, b)| format!("  {} -> {}", a.join("::"), b.join("::"))).collect::<Vec<_>>().join("\n")
        })
        .collect();
    assert!(found.is_empty(), "{} cycles between files:\n{}", found.len(), found.join("\n\n"));
}

#[test]
fn a_cycle_is_found_where_there_is_one() {
    let edge = |a: &str, b: &str| (a.to_string(), b.to_string());
    let found = cycles(&graph([edge("a", "b"), edge("b", "c"), edge("c", "a"), edge("c", "d")].into_iter()));
    assert_eq!(found, [["a", "b", "c"]]);
    assert!(cycles(&graph([edge("a", "b"), edge("a", "c"), edge("b", "c")].into_iter())).is_empty());
}
