//! Estimate of flip-flops and LUTs from the text of the generated Verilog.
//!
//! A register counts bit by bit where a clocked block assigns it; logic counts by operator and by bit of the assigned
//! target. A `for` loop of a generate block counts once per iteration. Synthesis shares and removes some of it; the
//! tests state how far the estimate is from Yosys.
//!
//! | operator | LUTs per bit |
//! |---|---|
//! | `+`, `-` | 1 |
//! | `?` | 1 |
//! | `&`, `|`, `^`, `!` and comparisons | 1/4 |
//! | shift by a signal | 3 |
//! | parity of a part select | a third of the bits selected |
//! | a table logarithm | 2 per bit of the argument, and 40 for its second half and the table |

use std::collections::{BTreeMap, BTreeSet};

/// Logic of a module.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Logic {
    /// Register bits.
    pub flip_flops: usize,
    /// Four-input LUTs; the caller rounds.
    pub luts: f64,
}

impl std::ops::AddAssign for Logic {
    fn add_assign(&mut self, other: Logic) {
        self.flip_flops += other.flip_flops;
        self.luts += other.luts;
    }
}

/// Logic of every module of `verilog`, by name. The arrays `placed` (module, array) are RAM and do not count as
/// registers.
pub fn modules<'a>(verilog: &'a str, placed: &BTreeSet<(String, String)>) -> BTreeMap<&'a str, Logic> {
    let mut found = BTreeMap::new();
    for text in verilog.split("\nmodule ").skip(1) {
        let name = text.split('(').next().unwrap_or_default().trim();
        let body = text.split("endmodule").next().unwrap_or_default();
        let own = placed.iter().filter(|(module, _)| module == name).map(|(_, array)| array.clone()).collect();
        found.insert(name, Scan::new(own).run(body));
    }
    found
}

/// State of the scan over one module, statement by statement.
struct Scan {
    placed: BTreeSet<String>,
    widths: BTreeMap<String, usize>,
    words: BTreeMap<String, usize>,
    /// For each open `begin`: how often its content counts, and whether it is clocked.
    open: Vec<(usize, bool)>,
    /// The next statement is the body of a clocked block without `begin`.
    clocked: bool,
    assigned: BTreeSet<String>,
    logic: Logic,
}

impl Scan {
    fn new(placed: BTreeSet<String>) -> Self {
        Scan {
            placed,
            widths: BTreeMap::new(),
            words: BTreeMap::new(),
            open: Vec::new(),
            clocked: false,
            assigned: BTreeSet::new(),
            logic: Logic::default(),
        }
    }

    fn run(mut self, body: &str) -> Logic {
        let mut function = false;
        let mut statement = String::new();
        for line in body.lines() {
            let line = line.split("//").next().unwrap_or_default().trim();
            let line = line.strip_prefix("(* keep *) ").unwrap_or(line);
            // Functions are counted where they are called.
            function |= line.starts_with("function ");
            if function || line.starts_with("(*") {
                function &= line != "endfunction";
                continue;
            }
            statement.push_str(line);
            statement.push(' ');
            if line.ends_with(';')
                || line.ends_with("begin")
                || line.contains(" begin :")
                || line == "end"
                || line.starts_with("end ")
                || line == "generate"
                || line.starts_with("endgenerate")
                || line == "endcase"
                || line.starts_with("case ")
                || line.ends_with(",") && line.contains("put ")
            {
                let complete = std::mem::take(&mut statement);
                // The head of a loop contains semicolons that do not end a statement.
                match complete.trim().strip_prefix("for (").and_then(|head| head.split_once(") ")) {
                    Some((_, body)) if !body.trim_start().starts_with("begin") => self.statement(body.trim()),
                    Some(_) => self.statement(complete.trim()),
                    None => complete.split_inclusive(';').for_each(|part| self.statement(part.trim())),
                }
            }
        }
        self.logic
    }

    fn statement(&mut self, text: &str) {
        let text = match text.strip_prefix("end else") {
            Some(rest) => {
                self.open.pop();
                rest.trim()
            }
            None => text,
        };
        if text.starts_with("always @(posedge") {
            self.clocked = true;
        } else if text.starts_with("always @(*)") {
            self.clocked = false;
        }
        if ["input ", "output ", "wire ", "reg "].iter().any(|kind| text.starts_with(kind)) {
            self.declare(text);
        }
        if let Some((target, value)) = assignment(text) {
            self.assign(text, target, value);
        }
        if text.ends_with("begin") || text.contains(" begin :") {
            let clocked = self.clocked || self.open.last().is_some_and(|&(_, clocked)| clocked);
            self.open.push((loop_count(text), clocked));
            self.clocked = false;
        } else if text == "end" || text.starts_with("end ") {
            self.open.pop();
        } else if text.ends_with(';') {
            self.clocked = false;
        }
    }

    fn declare(&mut self, text: &str) {
        let (width, names) = match text.split_once('[') {
            Some((before, rest)) if !before.contains('=') => {
                let (range, names) = rest.split_once(']').unwrap_or((rest, ""));
                (range.split(':').next().and_then(|high| high.trim().parse::<usize>().ok()).map_or(1, |h| h + 1), names)
            }
            _ => (1, text.rsplit("reg ").next().unwrap_or(text).rsplit("wire ").next().unwrap_or(text)),
        };
        for name in names.split('=').next().unwrap_or(names).split(',') {
            let name = name.trim().trim_end_matches(';');
            let (name, depth) = match name.split_once("[0:") {
                Some((name, last)) => (name.trim(), last.trim_end_matches(']').parse::<usize>().map_or(1, |l| l + 1)),
                None => (name, 1),
            };
            self.widths.insert(name.to_string(), width);
            self.words.insert(name.to_string(), depth);
        }
    }

    fn times(&self) -> usize {
        self.open.iter().map(|&(count, _)| count).product()
    }

    fn assign(&mut self, text: &str, target: &str, value: &str) {
        let clocked = self.clocked || self.open.last().is_some_and(|&(_, clocked)| clocked);
        let registered = clocked && text.contains("<=");
        let mut width = 0;
        for part in target.trim_matches(|c| "{} ".contains(c)).split(',') {
            let part = part.trim();
            let name = part.split('[').next().unwrap_or(part).trim();
            let whole = self.widths.get(name).copied().unwrap_or(1);
            let select = part.split_once('[').map(|(_, select)| select.trim_end_matches(']'));
            let words = self.words.get(name).copied().unwrap_or(1);
            let bits = match select {
                Some(select) if words == 1 => match select.rsplit_once("+:") {
                    Some((_, bits)) => bits.trim().parse().unwrap_or(whole),
                    None => 1,
                },
                _ => whole,
            };
            width += bits;
            // The read register of a block RAM is part of the RAM.
            let read = value.split_once('[').is_some_and(|(memory, _)| self.placed.contains(memory));
            if registered && !read && !self.placed.contains(name) && self.assigned.insert(part.to_string()) {
                // An array counts with all its words at the first assignment.
                let first = words == 1 || self.assigned.insert(name.to_string());
                self.logic.flip_flops += if first { words * bits * self.times() } else { 0 };
            }
        }
        self.logic.luts += cost(value) * width as f64 * self.times() as f64;
        self.logic.luts += calls(value, &self.widths) * self.times() as f64;
    }
}

/// Target and value of a statement, if it is an assignment.
fn assignment(text: &str) -> Option<(&str, &str)> {
    let text = text.strip_suffix(';')?;
    let (target, value) = match text.split_once(" <= ") {
        Some(pair) if !pair.0.contains(" = ") => pair,
        _ => text.split_once(" = ")?,
    };
    // Skips conditions, case labels and declarations before the target.
    let target = target.trim();
    let start = match target.ends_with('}') {
        true => target.rfind('{')?,
        false => {
            let name_end = target.find('[').filter(|_| target.ends_with(']')).unwrap_or(target.len());
            target[..name_end].trim_end().rfind(' ').map_or(0, |space| space + 1)
        }
    };
    Some((&target[start..], value))
}

/// Iterations of the loop that `text` opens; 1 if it opens none.
fn loop_count(text: &str) -> usize {
    let bound = text.strip_prefix("for (").and_then(|head| head.split("< ").nth(1));
    bound.and_then(|bound| bound.split(';').next()?.trim().parse().ok()).unwrap_or(1)
}

/// LUTs per bit of an expression, without the expressions inside its indices.
fn cost(value: &str) -> f64 {
    let mut depth = 0;
    let mut plain = String::new();
    for c in value.chars() {
        depth += i32::from(c == '[') - i32::from(c == ']');
        if depth == 0 {
            plain.push(c);
        }
    }
    let mut sum = reduced(value);
    let tokens: Vec<&str> = plain.split_whitespace().collect();
    for (index, token) in tokens.iter().enumerate() {
        let next = tokens.get(index + 1).copied().unwrap_or_default();
        sum += match *token {
            "+" | "-" => 1.0,
            "?" => 1.0,
            "&" | "|" | "^" | "&&" | "||" | "==" | "!=" | "<" | ">" | ">=" => 0.25,
            ">>>" | "<<" if !next.starts_with(|c: char| c.is_ascii_digit()) => 3.0,
            _ => 0.0,
        };
    }
    sum
}

/// LUTs of the parities of part selects: a LUT replaces four bits by one.
fn reduced(value: &str) -> f64 {
    let selects = value.split('^').skip(1).filter_map(|rest| rest.split(']').next()?.rsplit_once("+: "));
    selects.filter_map(|(_, bits)| bits.parse::<f64>().ok()).map(|bits| ((bits - 1.0) / 3.0).ceil()).sum()
}

/// LUTs of the calls of the logarithm's functions.
fn calls(value: &str, widths: &BTreeMap<String, usize>) -> f64 {
    let argument = |name: &str| value.split_once(name).and_then(|(_, rest)| rest.split(')').next());
    let locate = argument("locate(").map_or(0.0, |x| 2.0 * widths.get(x).copied().unwrap_or(1) as f64);
    let table = argument("logarithm(").map_or(0.0, |_| 40.0);
    locate + table
}
