//! A loop as a drawing: its blocks, and between them its signals with their formats.
//!
//! The drawing is made of the wiring's own nets and instances. Blocks stand in rows, each below the blocks that it
//! reads, so that signals run downward; a signal that returns runs beside all rows.

use std::fmt::Write as _;

use hpu_datapath::Instance;
use hpu_page::escaped;
use hpu_signal::{Notation, Signal};

use crate::drawing::canvas::text_width;

const SIZE: i32 = 11;
const HEAD: i32 = 30;
const PORT: i32 = 16;
/// Height of the space between rows.
const GAP: i32 = 60;
/// Space between things beside each other.
const AIR: i32 = 18;
/// Distance between the lanes of signals that return.
const LANE: i32 = 9;
const MARGIN: i32 = 12;
/// Height of a box.
const TALL: i32 = HEAD + 2 * PORT;

/// A loop to be drawn.
pub struct Diagram<'a> {
    /// All nets: inputs, outputs, then those inside.
    pub nets: &'a [Signal],
    /// Number of the inputs.
    pub inputs: usize,
    /// Number of the outputs.
    pub outputs: usize,
    /// The blocks with their connections; a loop without any is drawn as one block.
    pub instances: &'a [Instance],
    /// Name of the loop.
    pub name: &'a str,
    /// The device in a few words.
    pub device: &'a str,
    /// How formats are written.
    pub notation: Notation,
}

/// A place where a net enters or leaves a box.
struct Port {
    name: String,
    net: usize,
    /// Its place from the left edge of its box.
    at: i32,
}

/// A box with ports: a block, or the device at either end.
struct Block {
    head: String,
    entity: String,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    width: i32,
}

/// A thing in a row: a box, or the way of a net past the boxes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Item {
    Block(usize),
    Way(usize),
}

/// A thing in a row, and the left edge of its place.
type Placed = (Item, i32);

/// The places of all boxes.
struct Layout<'d> {
    blocks: &'d [Block],
    /// The things of each row with their left ends.
    items: &'d [Vec<Placed>],
    /// The row of each block.
    rows: &'d [usize],
}

impl Layout<'_> {
    /// Returns the top of a row.
    fn top(row: usize) -> i32 {
        MARGIN + GAP / 2 + row as i32 * (TALL + GAP)
    }

    /// Returns the left upper corner of a block.
    fn corner(&self, block: usize) -> (i32, i32) {
        let row = self.rows[block];
        let here = self.items[row].iter().find(|(other, _)| *other == Item::Block(block));
        (here.expect("a thing in its row").1, Self::top(row))
    }
}

impl Diagram<'_> {
    /// Returns the drawing as SVG. Its colours are those of the page's style sheet.
    pub fn svg(&self) -> String {
        let mut blocks = self.blocks();
        let driver = drivers(&blocks, self.nets.len());
        let rows = rows(&blocks, &driver);
        // A word of the scene that enters far from the top is told where it enters.
        let far: Vec<bool> = (0..self.nets.len())
            .map(|net| net < self.inputs && (1..blocks.len()).all(|b| rows[b] != 1 || !reads(&blocks[b], net)))
            .collect();
        for block in &mut blocks {
            self.measure(block, &far);
        }
        let items = placed(&blocks, &rows, &driver, &far);
        self.drawn(&blocks, &items, &driver, &rows, &far)
    }

    /// Returns the device's outputs as a box, the blocks, and the device's inputs as a box.
    fn blocks(&self) -> Vec<Block> {
        let port = |net: usize| Port { name: String::new(), net, at: 0 };
        let (first, last) = (self.inputs, self.inputs + self.outputs);
        let end = |head: &str, entity: &str, inputs: Vec<Port>, outputs: Vec<Port>| Block {
            head: head.into(),
            entity: entity.into(),
            inputs,
            outputs,
            width: 0,
        };
        let mut all = vec![end("from the device and the scene", "", Vec::new(), (0..first).map(port).collect())];
        for instance in self.instances {
            let leaves = instance.model.outputs();
            let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
            for connection in &instance.connections {
                let name = connection.port.name.to_string();
                let to = if leaves.iter().any(|out| out.name == name) { &mut outputs } else { &mut inputs };
                to.push(Port { name, net: connection.net, at: 0 });
            }
            all.push(end(instance.label, instance.model.name(), inputs, outputs));
        }
        if self.instances.is_empty() {
            all.push(end(self.name, "", (0..first).map(port).collect(), (first..last).map(port).collect()));
        }
        all.push(end("to the device", self.device, (first..last).map(port).collect(), Vec::new()));
        all
    }

    /// Returns a net's name with its format; a bit has none.
    fn label(&self, net: usize) -> String {
        let Signal { name, format, .. } = &self.nets[net];
        if format.width() == 1 { (*name).to_string() } else { format!("{name} {}", self.notation.of(*format)) }
    }

    /// Puts the ports of a box beside each other, and finds its width.
    fn measure(&self, block: &mut Block, far: &[bool]) {
        let room = |text: &str| text_width(text, SIZE) * 17 / 16 + AIR;
        let mut right = 0;
        for port in &mut block.inputs {
            let told = if far[port.net] { room(&self.label(port.net)) } else { 0 };
            let width = told.max(room(&port.name)).max(AIR);
            port.at = right + width / 2;
            right += width;
        }
        let mut left = 0;
        for port in &mut block.outputs {
            if port.name.is_empty() && far[port.net] {
                continue;
            }
            port.at = left + AIR / 2;
            left += room(&self.label(port.net));
        }
        // The head is bold.
        let head = (room(&block.head) * 9 / 8).max(room(&block.entity));
        block.width = right.max(left).max(head);
    }

    fn drawn(&self, blocks: &[Block], items: &[Vec<Placed>], driver: &[usize], rows: &[usize], far: &[bool]) -> String {
        let placed = Layout { blocks, items, rows };
        let leftmost = items.iter().flatten().map(|(_, left)| *left).min().unwrap_or(0);
        let mut lanes = 0;
        let (mut wires, mut boxes) = (String::new(), String::new());
        for net in (0..self.nets.len()).filter(|net| !far[*net] && driver[*net] != usize::MAX) {
            wires += &self.wire(&placed, (net, driver[net]), leftmost, &mut lanes);
        }
        for (b, block) in blocks.iter().enumerate() {
            self.block(&mut boxes, block, placed.corner(b), far);
        }
        let right = items.iter().flatten().map(|(item, left)| left + width(blocks, *item)).max().unwrap_or(0);
        let left = leftmost - LANE * (lanes + 1);
        // The device closes the loop, from the lowest box to the highest.
        let (lane, middle) = (right + 2 * LANE, HEAD / 2 + PORT);
        let [above, below] = [0, blocks.len() - 1].map(|of| {
            let (x, y) = placed.corner(of);
            (x + blocks[of].width, y + middle)
        });
        let _ = writeln!(
            wires,
            "<g class=\"net device\"><title>The device</title><path class=\"arrow\" d=\"M{},{}H{lane}V{}H{}\"/></g>",
            below.0,
            below.1,
            above.1,
            above.0 + 2
        );
        let (x, wide) = (left - MARGIN, lane + 2 * MARGIN - left);
        let high = Layout::top(items.len() - 1) + TALL + MARGIN;
        let title = format!("{}: blocks and signals with their formats", self.name);
        format!(
            "<svg class=\"diagram\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{x} 0 {wide} {high}\" \
             width=\"{wide}\" role=\"img\" aria-label=\"{0}\">\n<title>{0}</title>\n<defs>\
             <marker id=\"arrow\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" \
             orient=\"auto\"><path d=\"M0,0L8,4L0,8Z\"/></marker></defs>\n{wires}{boxes}</svg>\n",
            escaped(&title)
        )
    }

    /// Returns a net with its arrows, from the block that drives it to its readers. One that leads back up takes the
    /// next lane on the left.
    fn wire(&self, placed: &Layout, (net, from): (usize, usize), leftmost: i32, lanes: &mut i32) -> String {
        let (blocks, rows) = (placed.blocks, placed.rows);
        let out = blocks[from].outputs.iter().find(|port| port.net == net).expect("its driver drives it");
        let (left, top) = placed.corner(from);
        let (x, y) = (left + out.at, top + TALL);
        let (mut path, mut arrows) = (String::new(), String::new());
        let mut arrow = |path: &str| {
            let _ = write!(arrows, "<path class=\"arrow\" d=\"{path}\"/>");
        };
        // The way down past boxes, as far as the lowest reader.
        let mut points = vec![(rows[from], x, y)];
        for (row, things) in placed.items.iter().enumerate().skip(rows[from] + 1) {
            if let Some((_, left)) = things.iter().find(|(item, _)| *item == Item::Way(net)) {
                let (x0, y0) = (points[points.len() - 1].1, points[points.len() - 1].2);
                let (x1, y1) = (left + AIR / 2, Layout::top(row));
                let _ = write!(path, "{}V{}", curve((x0, y0), (x1, y1)), y1 + TALL);
                points.push((row, x1, y1 + TALL));
            }
        }
        let mut readers = 0;
        for (b, block) in blocks.iter().enumerate() {
            for port in block.inputs.iter().filter(|port| port.net == net) {
                readers += 1;
                let (left, top) = placed.corner(b);
                let to = (left + port.at, top);
                if rows[b] > rows[from] {
                    let start = points.iter().rfind(|(row, ..)| *row < rows[b]).expect("it begins above");
                    arrow(&curve((start.1, start.2), to));
                } else {
                    *lanes += 1;
                    let lane = leftmost - LANE * (*lanes + 1);
                    let (down, up) = (y + 8 + 3 * (*lanes % 4), to.1 - 8 - 3 * (*lanes % 4));
                    arrow(&format!("M{x},{y}V{down}H{lane}V{up}H{}V{}", to.0, to.1));
                }
            }
        }
        if readers == 0 {
            let _ = write!(path, "M{x},{y}v14");
        }
        let title = format!("{}: {}{}", self.label(net), self.nets[net].doc, unit(&self.nets[net]));
        format!(
            "<g class=\"net\"><title>{}</title><path d=\"{path}\"/>{arrows}<text x=\"{}\" y=\"{}\">{}</text></g>\n",
            escaped(&title),
            x + 4,
            y + 12,
            escaped(&self.label(net))
        )
    }

    /// Draws a box with its ports, and the words of the scene that enter it.
    fn block(&self, svg: &mut String, block: &Block, (x, y): (i32, i32), far: &[bool]) {
        let tall = HEAD + 2 * PORT;
        let middle = x + block.width / 2;
        let is_end = block.inputs.is_empty() || block.outputs.is_empty();
        let class = if is_end { "block end" } else { "block" };
        let _ = writeln!(
            svg,
            "<g class=\"{class}\"><rect x=\"{x}\" y=\"{y}\" width=\"{}\" height=\"{tall}\" rx=\"4\"/>",
            block.width
        );
        let mut write = |class: &str, x: i32, y: i32, text: &str| {
            if !text.is_empty() {
                let _ = writeln!(svg, "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{}</text>", escaped(text));
            }
        };
        write("head", middle, y + PORT + 13, &block.head);
        write("entity", middle, y + PORT + 26, &block.entity);
        for port in &block.inputs {
            write("port", x + port.at, y + 12, &port.name);
            if far[port.net] {
                write("word", x + port.at, y - 12, &self.label(port.net));
            }
        }
        for port in block.outputs.iter().filter(|port| port.name != self.nets[port.net].name) {
            write("leaving", x + port.at - 3, y + tall - 5, &port.name);
        }
        for port in block.inputs.iter().filter(|port| far[port.net]) {
            let _ = writeln!(svg, "<path class=\"stub\" d=\"M{},{}V{y}\"/>", x + port.at, y - 9);
        }
        svg.push_str("</g>\n");
    }
}

/// Returns the unit behind a meaning.
fn unit(signal: &Signal) -> String {
    if ["", "1"].contains(&signal.unit) { String::new() } else { format!(", in {}", signal.unit) }
}

fn reads(block: &Block, net: usize) -> bool {
    block.inputs.iter().any(|port| port.net == net)
}

/// Returns a curve from one point down to another.
fn curve((x0, y0): (i32, i32), (x1, y1): (i32, i32)) -> String {
    let bend = ((y1 - y0) / 2).max(12);
    format!("M{x0},{y0}C{x0},{} {x1},{} {x1},{y1}", y0 + bend, y1 - bend)
}

/// Returns, for each net, the box that drives it; `usize::MAX` for a net that none drives.
fn drivers(blocks: &[Block], nets: usize) -> Vec<usize> {
    let mut driver = vec![usize::MAX; nets];
    for (b, block) in blocks.iter().enumerate() {
        block.outputs.iter().for_each(|port| driver[port.net] = b);
    }
    driver
}

/// Returns the row of each box: below all boxes that it reads, but for signals that return.
fn rows(blocks: &[Block], driver: &[usize]) -> Vec<usize> {
    /// Visits the boxes that a box reads first; a box that is being visited is read by a signal that returns.
    fn visit(b: usize, blocks: &[Block], driver: &[usize], rows: &mut [Option<usize>], open: &mut [bool]) -> usize {
        if let Some(row) = rows[b] {
            return row;
        }
        open[b] = true;
        let mut row = 0;
        for port in &blocks[b].inputs {
            let from = driver[port.net];
            if from != usize::MAX && !open[from] {
                row = row.max(visit(from, blocks, driver, rows, open) + 1);
            }
        }
        open[b] = false;
        rows[b] = Some(row.max(usize::from(b > 0)));
        row.max(usize::from(b > 0))
    }
    let (mut rows, mut open) = (vec![None; blocks.len()], vec![false; blocks.len()]);
    let last = blocks.len() - 1;
    for b in 0..last {
        visit(b, blocks, driver, &mut rows, &mut open);
    }
    let lowest = rows.iter().flatten().max().copied().unwrap_or(0);
    rows[last] = Some(lowest + 1);
    rows.into_iter().map(|row| row.unwrap_or(0)).collect()
}

fn width(blocks: &[Block], item: Item) -> i32 {
    match item {
        Item::Block(b) => blocks[b].width,
        Item::Way(_) => AIR,
    }
}

/// Puts boxes and ways into rows, each near the things that it is connected to.
fn placed(blocks: &[Block], rows: &[usize], driver: &[usize], far: &[bool]) -> Vec<Vec<Placed>> {
    let count = rows.iter().max().map_or(0, |row| row + 1);
    let mut items: Vec<Vec<Placed>> = vec![Vec::new(); count];
    for (b, row) in rows.iter().enumerate() {
        items[*row].push((Item::Block(b), 0));
    }
    for (net, &from) in driver.iter().enumerate() {
        let readers = blocks.iter().enumerate().filter(|(_, block)| reads(block, net)).map(|(b, _)| rows[b]);
        let Some(lowest) = readers.max().filter(|_| from != usize::MAX && !far[net]) else { continue };
        (rows[from] + 1..lowest).for_each(|row| items[row].push((Item::Way(net), 0)));
    }
    items.iter_mut().for_each(|row| spread(row, blocks, &|_| None));
    for round in 0..12 {
        let order: Vec<usize> = if round % 2 == 0 { (1..count).collect() } else { (0..count - 1).rev().collect() };
        for row in order {
            let wanted = |item: Item| wanted(item, row, blocks, &items, round % 2 == 0);
            let at: Vec<_> = items[row].iter().map(|(item, _)| (*item, wanted(*item))).collect();
            spread(&mut items[row], blocks, &|item| at.iter().find(|(other, _)| *other == item)?.1);
        }
    }
    items
}

/// Returns where a thing would stand if it stood right below the things that it reads, or above its readers.
fn wanted(item: Item, row: usize, blocks: &[Block], items: &[Vec<Placed>], above: bool) -> Option<i32> {
    let near = if above { row.checked_sub(1)? } else { row + 1 };
    // The places at which the things of the other row touch a net, and those of this thing.
    let touches = |item: Item, outward: bool| -> Vec<(usize, i32)> {
        match item {
            Item::Way(net) => vec![(net, AIR / 2)],
            Item::Block(b) => {
                let ports = if outward { &blocks[b].outputs } else { &blocks[b].inputs };
                ports.iter().map(|port| (port.net, port.at)).collect()
            }
        }
    };
    let mut gaps = Vec::new();
    for (net, at) in touches(item, !above) {
        for (other, left) in &items[near] {
            let there = touches(*other, above).into_iter().filter(|(other, _)| *other == net);
            gaps.extend(there.map(|(_, place)| left + place - at));
        }
    }
    (!gaps.is_empty()).then(|| gaps.iter().sum::<i32>() / gaps.len() as i32)
}

/// Puts the things of a row in the order of the places that they want, without overlap and near these places.
fn spread(row: &mut [Placed], blocks: &[Block], wanted: &dyn Fn(Item) -> Option<i32>) {
    let want: Vec<i32> = row.iter().map(|(item, left)| wanted(*item).unwrap_or(*left)).collect();
    let mut order: Vec<usize> = (0..row.len()).collect();
    order.sort_by_key(|at| want[*at] + width(blocks, row[*at].0) / 2);
    let sorted: Vec<(Item, i32)> = order.iter().map(|at| (row[*at].0, want[*at])).collect();
    let (mut right, mut off) = (i32::MIN / 2, 0);
    for (place, (item, want)) in row.iter_mut().zip(&sorted) {
        let left = (*want).max(right);
        *place = (*item, left);
        right = left + width(blocks, *item) + AIR;
        off += left - want;
    }
    let back = off / row.len().max(1) as i32;
    row.iter_mut().for_each(|(_, left)| *left -= back);
}
