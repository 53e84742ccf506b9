//! No module of a crate uses a module that uses it, directly or through others; nor does a folder.
//!
//! An arrow leads from a module to each module that defines what it uses. It is read from the `use` declarations and
//! from the paths in the code:
//!
//! - A path through a re-export leads to the module that defines the item.
//! - `mod child;` is no arrow, nor a `pub use` of a name that the module itself does not need. So a parent may hand on
//!   what its children define, and these children may use the parent's own items.
//! - Code under `#[cfg(test)]` may use everything. A method that is called leaves no path.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::Path;

/// Longest chain of re-exports that is followed.
const MOST_RE_EXPORTS: usize = 8;

/// Path of a module from the root of its crate; empty for the root.
type Name = Vec<String>;

/// What the arrows of a module follow from.
#[derive(Default)]
struct Module {
    /// Paths in the code as written, `use` declarations among them.
    paths: Vec<Vec<String>>,
    /// Full or relative path of each name that a `use` declaration brings in.
    imports: BTreeMap<String, Vec<String>>,
    /// Names that a `pub use` hands on.
    handed_on: BTreeSet<String>,
    /// Names of items that the module defines itself.
    defines: BTreeSet<String>,
}

/// Identifiers, `::`, and other characters one by one; without comments, literals of text and lifetimes.
fn tokens(text: &str) -> Vec<String> {
    let text: Vec<char> = text.chars().collect();
    let at = |k: usize| text.get(k).copied().unwrap_or('\0');
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    // The position behind the next `end`.
    let behind = |from: usize, end: &str| {
        let end: Vec<char> = end.chars().collect();
        (from..text.len()).find(|&k| text[k..].starts_with(&end)).map_or(text.len(), |k| k + end.len())
    };
    let mut all: Vec<String> = Vec::new();
    let mut k = 0;
    while k < text.len() {
        match at(k) {
            '/' if at(k + 1) == '/' => k = behind(k, "\n"),
            '/' if at(k + 1) == '*' => k = behind(k, "*/"),
            '"' => {
                let raw = all.last().is_some_and(|last| last == "r" || last == "br");
                k += 1;
                while k < text.len() && at(k) != '"' {
                    k += if at(k) == '\\' && !raw { 2 } else { 1 };
                }
                k += 1;
            }
            '#' if at(k + 1) == '"' && all.last().is_some_and(|last| last == "r" || last == "br") => {
                k = behind(k + 2, "\"#");
            }
            '\'' if at(k + 1) == '\\' => k = behind(k + 3, "'"),
            '\'' if at(k + 2) == '\'' => k += 3,
            '\'' => k += 1 + text[k + 1..].iter().take_while(|c| is_name(**c)).count(),
            ':' if at(k + 1) == ':' => {
                all.push("::".to_string());
                k += 2;
            }
            c if is_name(c) => {
                let word: String = text[k..].iter().take_while(|c| is_name(**c)).collect();
                k += word.chars().count();
                all.push(word);
            }
            c => {
                if !c.is_whitespace() {
                    all.push(c.to_string());
                }
                k += 1;
            }
        }
    }
    all
}

/// Position behind the item that begins at `from`: behind its `;`, or behind the end of its block.
fn behind_item(tokens: &[String], from: usize) -> usize {
    let mut depth = 0;
    for (k, token) in tokens.iter().enumerate().skip(from) {
        match token.as_str() {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" => depth -= 1,
            "}" => {
                depth -= 1;
                if depth == 0 {
                    return k + 1;
                }
            }
            ";" if depth == 0 => return k + 1,
            _ => {}
        }
    }
    tokens.len()
}

/// The tokens without tests, and the names of the child modules that are tests.
fn without_tests(tokens: &[String]) -> (Vec<String>, Vec<String>) {
    let (mut kept, mut tests) = (Vec::new(), Vec::new());
    let mut k = 0;
    while k < tokens.len() {
        let attribute = ["#", "[", "cfg", "(", "test", ")", "]"];
        if tokens[k..].iter().zip(attribute).filter(|(token, wanted)| token == wanted).count() == attribute.len() {
            let end = behind_item(tokens, k + attribute.len());
            let item = &tokens[k + attribute.len()..end];
            tests.extend(item.iter().position(|token| token == "mod").map(|at| item[at + 1].clone()));
            k = end;
        } else {
            kept.push(tokens[k].clone());
            k += 1;
        }
    }
    (kept, tests)
}

/// The paths of a `use` declaration after `before`, each with the name it brings in.
fn leaves(tokens: &[String], before: &[String]) -> Vec<(Vec<String>, String)> {
    let mut path = before.to_vec();
    for (k, token) in tokens.iter().enumerate() {
        match token.as_str() {
            "::" => {}
            "{" => {
                let mut depth = 0;
                let inside = &tokens[k + 1..tokens.len() - 1];
                let parts = inside.split(|token| {
                    depth += i32::from(token == "{") - i32::from(token == "}");
                    depth == 0 && token == ","
                });
                return parts.filter(|part| !part.is_empty()).flat_map(|part| leaves(part, &path)).collect();
            }
            "as" => return vec![(path, tokens[k + 1].clone())],
            "self" if !path.is_empty() => {}
            _ => path.push(token.clone()),
        }
    }
    let name = path.last().cloned().unwrap_or_default();
    vec![(path, name)]
}

/// Reads a module without its tests; returns the names of its child modules that are tests.
fn module(text: &str) -> (Module, Vec<String>) {
    let (tokens, tests) = without_tests(&tokens(text));
    let mut module = Module::default();
    let mut code: Vec<&String> = Vec::new();
    let mut k = 0;
    while k < tokens.len() {
        if tokens[k] == "use" && tokens.get(k + 1).is_some_and(|next| next != "<") {
            let end = (k..tokens.len()).find(|&end| tokens[end] == ";").unwrap_or(tokens.len()) + 1;
            let public = k > 0 && ["pub", ")"].contains(&tokens[k - 1].as_str());
            for (path, name) in leaves(&tokens[k + 1..end - 1], &[]) {
                if public {
                    module.handed_on.insert(name.clone());
                } else {
                    module.paths.push(path.clone());
                }
                module.imports.insert(name, path);
            }
            k = end;
        } else {
            code.push(&tokens[k]);
            k += 1;
        }
    }
    let is_name = |token: &str| token.starts_with(|c: char| c.is_alphabetic() || c == '_');
    for k in 0..code.len() {
        let before = if k > 0 { code[k - 1].as_str() } else { "" };
        if ["fn", "struct", "enum", "trait", "type", "const", "static"].contains(&before) {
            module.defines.insert(code[k].clone());
        }
        if !is_name(code[k]) || ["::", ".", "in", "mod"].contains(&before) {
            continue;
        }
        let mut path = vec![code[k].clone()];
        let mut next = k + 1;
        while next + 1 < code.len() && code[next] == "::" && is_name(code[next + 1]) {
            path.push(code[next + 1].clone());
            next += 2;
        }
        module.paths.push(path);
    }
    (module, tests)
}

/// The modules of one crate.
struct Modules {
    crate_name: &'static str,
    modules: BTreeMap<Name, Module>,
}

impl Modules {
    /// Modules from their names and texts, without those that are tests.
    fn new(crate_name: &'static str, texts: impl Iterator<Item = (Name, String)>) -> Modules {
        let (mut modules, mut tests) = (BTreeMap::new(), Vec::new());
        for (name, text) in texts {
            let (module, own) = module(&text);
            tests.extend(own.into_iter().map(|test| [name.clone(), vec![test]].concat()));
            modules.insert(name, module);
        }
        modules.retain(|name, _| !tests.iter().any(|test| name.starts_with(test)));
        Modules { crate_name, modules }
    }

    /// A path as written in module `from`, from the root of the crate; `None` if it leads elsewhere.
    fn full(&self, from: &Name, path: &[String]) -> Option<Vec<String>> {
        let (first, rest) = path.split_first()?;
        match first.as_str() {
            "crate" => Some(rest.to_vec()),
            "self" => Some([from, rest].concat()),
            "super" => {
                let up = path.iter().take_while(|part| *part == "super").count();
                Some([&from[..from.len().checked_sub(up)?], &path[up..]].concat())
            }
            first if first == self.crate_name => Some(rest.to_vec()),
            first => {
                let child = [from.as_slice(), &[first.to_string()]].concat();
                self.modules.contains_key(&child).then(|| [child.as_slice(), rest].concat())
            }
        }
    }

    /// The module that defines what a full path names, as far as the re-exports tell.
    fn home(&self, path: &[String], steps: usize) -> Name {
        let is_module = |&length: &usize| self.modules.contains_key(&path[..length]);
        let length = (0..=path.len()).rev().find(is_module).unwrap_or(0);
        let (name, rest) = (path[..length].to_vec(), &path[length..]);
        let Some((item, module)) = rest.first().zip(self.modules.get(&name)) else { return name };
        let handed_on = module.handed_on.contains(item) && !module.defines.contains(item);
        match module.imports.get(item).filter(|_| handed_on && steps > 0).and_then(|path| self.full(&name, path)) {
            Some(further) => self.home(&[further.as_slice(), &rest[1..]].concat(), steps - 1),
            None => name,
        }
    }

    /// The modules that module `from` uses, each with a path by which it does.
    fn arrows(&self, from: &Name) -> BTreeMap<Name, String> {
        let module = &self.modules[from];
        let mut arrows = BTreeMap::new();
        for path in &module.paths {
            // A name of a `use` declaration stands for its path; any other bare name is the module's own.
            let full = match module.imports.get(&path[0]) {
                Some(imported) => self.full(from, imported).map(|full| [full.as_slice(), &path[1..]].concat()),
                None if path.len() > 1 => self.full(from, path),
                None => None,
            };
            if let Some(home) = full.map(|full| self.home(&full, MOST_RE_EXPORTS)).filter(|home| home != from) {
                arrows.entry(home).or_insert_with(|| path.join("::"));
            }
        }
        arrows
    }

    /// The arrows of all modules.
    fn graph(&self) -> Graph {
        self.modules.keys().map(|name| (name.clone(), self.arrows(name))).collect()
    }

    /// The arrows between the rooms of module `parent`: its folders and files, each with all that it holds, and `parent` itself.
    fn rooms(&self, parent: &[&str]) -> Graph {
        let parent: Name = parent.iter().map(ToString::to_string).collect();
        let room = |name: &Name| name.starts_with(&parent).then(|| name[..name.len().min(parent.len() + 1)].to_vec());
        let mut rooms = Graph::new();
        for (from, arrows) in self.graph() {
            let Some(from) = room(&from) else { continue };
            let own = rooms.entry(from.clone()).or_default();
            for (to, path) in arrows {
                if let Some(to) = room(&to).filter(|to| *to != from) {
                    own.entry(to).or_insert(path);
                }
            }
        }
        rooms
    }
}

/// For each module or room those that it uses, each with a path by which it does.
type Graph = BTreeMap<Name, BTreeMap<Name, String>>;

/// The shortest circle through each node that is in one, in words.
fn circles_of(arrows: &Graph) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for start in arrows.keys() {
        let (mut from, mut queue) = (BTreeMap::new(), VecDeque::from([start]));
        while let Some(name) = queue.pop_front().filter(|_| !from.contains_key(start)) {
            for next in arrows[name].keys().filter(|next| arrows.contains_key(*next)) {
                from.entry(next).or_insert_with(|| {
                    queue.push_back(next);
                    name
                });
            }
        }
        let mut circle = vec![start];
        while let Some(before) = from.get(circle[circle.len() - 1]).filter(|_| from.contains_key(start)) {
            circle.push(before);
            if *before == start {
                break;
            }
        }
        circle.reverse();
        // The same circle is found from each of its modules; it is printed from the first of them.
        if circle.len() > 1 && circle.iter().min() == Some(&start) {
            let step = |pair: &[&Name]| format!("{} uses {}", pair[0].join("::"), arrows[pair[0]][pair[1]]);
            found.insert(circle.windows(2).map(step).collect::<Vec<_>>().join(", "));
        }
    }
    found
}

/// Names and texts of the modules in a folder of sources; a program's `main.rs` is no module of the crate.
fn read(folder: &Path, name: &Name, into: &mut Vec<(Name, String)>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        let inner = [name.as_slice(), std::slice::from_ref(&stem)].concat();
        if path.is_dir() {
            read(&path, &inner, into);
        } else if path.extension().is_some_and(|extension| extension == "rs") && stem != "main" {
            let own = if ["lib", "mod"].contains(&stem.as_str()) { name.clone() } else { inner };
            into.push((own, fs::read_to_string(&path).unwrap()));
        }
    }
}

/// The modules of the crate in `folder`.
fn modules(crate_name: &'static str, folder: &str) -> Modules {
    let mut texts = Vec::new();
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder).join("src"), &Vec::new(), &mut texts);
    Modules::new(crate_name, texts.into_iter())
}

/// The modules of the golden crate.
fn golden() -> Modules {
    modules("dermis_golden", "golden")
}

/// Asserts that a crate of at least `least` modules has no circle.
fn none(modules: &Modules, least: usize) {
    assert!(modules.modules.len() >= least, "{} modules", modules.modules.len());
    let circles: Vec<String> = circles_of(&modules.graph()).into_iter().collect();
    assert!(circles.is_empty(), "modules that use one another:\n{}", circles.join("\n"));
}

#[test]
fn golden_has_none() {
    none(&golden(), 150);
}

#[test]
fn hdl_has_none() {
    none(&modules("dermis_hdl", "hdl"), 100);
}

#[test]
fn study_has_none() {
    none(&modules("dermis_study", "golden/study"), 25);
}

/// The crates of `sim`, each with its folder and a number of modules that it has at least.
const SIM: [(&str, &str, usize); 5] = [
    ("dermis_flow", "sim/flow", 15),
    ("dermis_cosim", "sim/cosim", 20),
    ("dermis_host", "sim/host", 25),
    ("dermis_report", "sim/report", 60),
    ("dermis_sim", "sim", 40),
];

#[test]
fn sim_has_none() {
    for (name, folder, least) in SIM {
        none(&modules(name, folder), least);
    }
}

#[test]
fn python_has_none() {
    none(&modules("_dermis", "python"), 7);
}

#[test]
fn c_has_none() {
    none(&modules("dermis_c", "sim/c"), 4);
}

/// Asserts that each of `layers`, folders or files in `parent`, uses only itself and those before it, and what stands
/// beside the layers no layer; with `above`, everything else may use all of them.
fn in_order(modules: &Modules, parent: &[&str], layers: &[&str], above: bool) {
    let parent: Name = parent.iter().map(ToString::to_string).collect();
    let inner =
        |name: &Name| name.strip_prefix(parent.as_slice()).map(<[String]>::to_vec).filter(|inner| !inner.is_empty());
    let rank = |inner: &Name| match layers.iter().position(|layer| *layer == inner[0]) {
        Some(layer) => layer + 1,
        None if above => layers.len() + 1,
        None => 0,
    };
    let used = |layer: &&&str| modules.modules.keys().filter_map(inner).any(|inner| inner[0] == ***layer);
    assert_eq!(layers.iter().filter(used).count(), layers.len(), "a layer of {layers:?} is empty");
    for (from, own) in modules.modules.keys().filter_map(|name| Some((name, inner(name)?))) {
        for (to, path) in modules.arrows(from).iter().filter_map(|(to, path)| Some((inner(to)?, path))) {
            assert!(rank(&to) <= rank(&own), "{} uses {path}", from.join("::"));
        }
    }
}

#[test]
fn no_rooms_use_one_another() {
    let crates = [("dermis_golden", "golden"), ("dermis_study", "golden/study"), ("dermis_hdl", "hdl")];
    let crates = crates.into_iter().chain(SIM.map(|(name, folder, _)| (name, folder)));
    let rooms = crates.map(|(name, folder)| (name, folder, vec![])).chain([("dermis_sim", "sim", vec!["commands"])]);
    for (name, folder, parent) in rooms {
        let modules = modules(name, folder);
        let circles = circles_of(&modules.rooms(&parent));
        assert!(circles.is_empty(), "rooms of {} {parent:?} that use one another: {circles:#?}", modules.crate_name);
    }
}

#[test]
fn a_circle_of_rooms_is_found_where_no_modules_are_in_one() {
    let texts =
        [("", "mod a; mod b;"), ("a::x", "use crate::b::y;"), ("a::z", ""), ("b::y", ""), ("b::w", "use crate::a::z;")];
    let name = |name: &str| name.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
    let modules = Modules::new("seeded", texts.into_iter().map(|(own, text)| (name(own), text.to_string())));
    assert_eq!(circles_of(&modules.graph()), BTreeSet::new());
    let found = ["a uses crate::b::y, b uses crate::a::z".to_string()];
    assert_eq!(circles_of(&modules.rooms(&[])), BTreeSet::from(found));
}

#[test]
fn the_floors_of_golden_are_in_order() {
    let floors = [
        "quantile", "random", "read", "write", "spec", "physics", "data", "result", "estimate", "fixed", "engine",
        "wire",
    ];
    in_order(&golden(), &[], &floors, false);
}

#[test]
fn the_layers_of_fixed_are_in_order() {
    in_order(&golden(), &["fixed"], &["words", "error", "stages", "plan"], true);
}

#[test]
fn the_layers_of_host_are_in_order() {
    in_order(&modules("dermis_host", "sim/host"), &[], &["engine", "batch", "stream", "recording", "link"], false);
}

#[test]
#[should_panic(expected = "b uses crate::c::C")]
fn a_layer_that_uses_a_later_one_is_found() {
    let name = |name: &str| vec![name.to_owned()];
    let texts = [("a", ""), ("b", "use crate::a::A; use crate::c::C;"), ("c", "use crate::a::A;")];
    let texts = texts.into_iter().map(|(own, text)| (name(own), text.to_owned()));
    in_order(&Modules::new("seeded", texts), &[], &["b", "c"], false);
}

/// The circles of modules given as `(name, text)`.
fn circles(texts: &[(&str, &str)]) -> Vec<String> {
    let name = |name: &str| name.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
    let texts = texts.iter().map(|(own, text)| (name(own), text.to_string()));
    circles_of(&Modules::new("seeded", texts).graph()).into_iter().collect()
}

#[test]
fn a_circle_is_found() {
    let two = [("", "mod a; mod b;"), ("a", "use crate::b::{C, D as E};"), ("b", "fn f() { super::a::g() }")];
    assert_eq!(circles(&two), ["a uses crate::b::C, b uses super::a::g"]);
    // Through a re-export the arrow leads to the module that defines the item; `front` itself is in no circle.
    let three = [
        ("", "mod a; mod front;"),
        ("a", "use seeded::front::Item;"),
        ("front", "mod inner; pub use inner::Item;"),
        ("front::inner", "pub struct Item; use crate::b; fn f() -> b::B {}"),
        ("b", "pub struct B(crate::a::A);"),
    ];
    assert_eq!(circles(&three), ["a uses seeded::front::Item, front::inner uses crate::b, b uses crate::a::A"]);
}

#[test]
fn a_parent_may_hand_on_what_its_child_defines() {
    let child = ("a::child", "use super::Own; pub struct Part(Own);");
    assert_eq!(circles(&[("", "mod a;"), ("a", "mod child; pub use child::Part; pub struct Own;"), child]), [""; 0]);
    let needed = ("a", "mod child; pub use child::Part; pub struct Own; fn f(part: Part) {}");
    assert_eq!(circles(&[("", "mod a;"), needed, child]), ["a uses Part, a::child uses super::Own"]);
    let called = ("a", "mod child; pub struct Own; fn f() { child::g() }");
    assert_eq!(circles(&[("", "mod a;"), called, child]), ["a uses child::g, a::child uses super::Own"]);
}

#[test]
fn tests_comments_and_text_are_no_arrows() {
    let quiet = "// use crate::a::A;\n/* crate::a::A */ const C: (&str, char, &str) = (\"crate::a::A\", '\"', r#\"crate::a::A\"#);
        #[cfg(test)]\nmod tests { use crate::a::A; fn f<'a>() { g() } }\n#[cfg(test)]\nmod more;";
    let texts = [("", "mod a; mod b;"), ("a", "use crate::b::C;"), ("b", quiet), ("b::more", "use crate::a::A;")];
    assert_eq!(circles(&texts), [""; 0]);
    // The same module with one more line.
    let loud = format!("{quiet}\nuse crate::a::A;");
    let texts = [("", "mod a; mod b;"), ("a", "use crate::b::C;"), ("b", loud.as_str())];
    assert_eq!(circles(&texts).len(), 1);
}
