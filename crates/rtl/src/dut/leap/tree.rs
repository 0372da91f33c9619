//! Verilator's XML of a design, as a tree.

use std::collections::BTreeSet;

use super::super::declared::attribute;

/// An element of Verilator's XML.
pub(super) struct Node<'x> {
    depth: usize,
    pub tag: &'x str,
    text: &'x str,
}

impl<'x> Node<'x> {
    pub fn get(&self, name: &str) -> Option<&'x str> {
        attribute(self.text, name)
    }
}

/// Verilator's XML of a design, as elements in their order.
pub(super) struct Tree<'x> {
    pub nodes: Vec<Node<'x>>,
    /// The types that are signed.
    signed: BTreeSet<&'x str>,
}

impl<'x> Tree<'x> {
    pub fn read(xml: &'x str) -> Self {
        let node = |line: &'x str| {
            let text = line.trim_start();
            let tag = text.strip_prefix('<')?.split([' ', '>', '/']).next()?;
            (!tag.is_empty()).then(|| Node { depth: line.len() - text.len(), tag, text })
        };
        let nodes: Vec<_> = xml.lines().filter_map(node).collect();
        let is_signed = |node: &&Node| node.tag == "basicdtype" && node.get("signed") == Some("true");
        let signed = nodes.iter().filter(is_signed).filter_map(|node| node.get("id")).collect();
        Self { nodes, signed }
    }

    /// Returns the end of the elements within one.
    fn end(&self, at: usize) -> usize {
        let depth = self.nodes[at].depth;
        let within = self.nodes[at + 1..].iter().take_while(|node| node.depth > depth);
        at + 1 + within.count()
    }

    /// Returns the elements within one.
    pub fn within(&self, at: usize) -> impl Iterator<Item = usize> + use<'_, 'x> {
        at + 1..self.end(at)
    }

    /// Returns the elements directly within one.
    pub fn parts(&self, at: usize) -> Vec<usize> {
        self.within(at).filter(|part| self.nodes[*part].depth == self.nodes[at].depth + 2).collect()
    }

    pub fn words(&self, at: usize) -> impl Iterator<Item = &'x str> {
        let all = std::iter::once(at).chain(self.within(at)).map(|at| &self.nodes[at]);
        all.filter(|node| node.tag == "varref").filter_map(|node| node.get("name"))
    }

    /// Returns whether a value is signed; a constant is if it has a sign that counts.
    pub fn is_signed(&self, at: usize) -> bool {
        let node = &self.nodes[at];
        match node.tag {
            "const" => node.get("name").is_some_and(|name| name.contains("sh")) && !is_positive(node),
            _ => node.get("dtype_id").is_some_and(|id| self.signed.contains(id)),
        }
    }

    /// Returns the words that an assignment changes.
    pub fn target(&self, assignment: usize) -> Vec<&'x str> {
        let Some(&target) = self.parts(assignment).last() else { return Vec::new() };
        let count = if self.nodes[target].tag == "concat" { usize::MAX } else { 1 };
        self.words(target).take(count).collect()
    }
}

/// Returns whether an element is a constant whose sign is clear.
fn is_positive(node: &Node) -> bool {
    let width = node.get("name").and_then(|name| name.split("&apos;").next()?.parse::<u32>().ok());
    let is_clear = |(width, word): (u32, u64)| (1..=64).contains(&width) && word >> (width - 1) == 0;
    node.tag == "const" && width.zip(constant(node)).is_some_and(is_clear)
}

/// Returns whether an element is a statement, no value.
pub(super) fn is_statement(tree: &Tree, at: usize) -> bool {
    tree.nodes[at].get("dtype_id").is_none() || tree.nodes[at].tag.starts_with("assign")
}

/// Returns the word of a constant; `None` where it has unknown bits or more than 64.
pub(super) fn constant(node: &Node) -> Option<u64> {
    let text = node.get("name")?.replace("&apos;", "'");
    let (_, digits) = text.split_once('\'')?;
    u64::from_str_radix(digits.trim_start_matches('s').strip_prefix('h')?, 16).ok()
}
