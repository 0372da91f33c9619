//! A small timing diagram of a block, as SVG: a part of its directed vectors, run as the block runs.

use hpu_datapath::AnyBlock;
use hpu_rtl::stimuli::directed;
use hpu_signal::Signal;

/// Edges that a figure shows.
const EDGES: usize = 16;

/// Edges that are run at most to find the part that is shown.
const RUN: usize = 4000;

/// Sizes in pixels: of an edge, of a line, of its waveform, and of the names.
const STEP: usize = 44;
const LINE: usize = 30;
const HIGH: usize = 18;
const NAMES: usize = 150;

/// Lines that a figure shows at most; a block with more ports shows its first ones.
const LINES: usize = 20;

/// A figure, and the number of the first row that it shows.
pub struct Figure {
    /// The figure.
    pub svg: String,
    /// Row of the directed vectors, from 1 on.
    pub first: usize,
    /// Rows that it shows.
    pub rows: usize,
    /// Ports that it does not show.
    pub hidden: usize,
}

/// Runs a block on its directed vectors, and draws the edges in which most words change.
pub fn figure(block: &mut dyn AnyBlock) -> Figure {
    let rows: Vec<_> = directed(block).into_iter().take(RUN).collect();
    let mut signals = block.inputs();
    let inputs = signals.len();
    signals.extend(block.outputs());
    let words: Vec<Vec<i64>> = rows
        .iter()
        .map(|row| {
            let out = if row.rst { block.reset() } else { block.tick(&row.words) };
            [&row.words[..], &out[..]].concat()
        })
        .collect();
    let shown = EDGES.min(words.len());
    // Each output counts once for each edge at which it changes, inputs for less.
    let changes = |from: usize| -> usize {
        let pairs = words[from..from + shown].windows(2);
        let changed = |at: usize| pairs.clone().filter(|pair| pair[0][at] != pair[1][at]).count().min(shown / 2);
        let reset = rows[from..from + shown].iter().filter(|row| row.rst).count();
        (0..signals.len()).map(|at| changed(at) * if at < inputs { 1 } else { 4 }).sum::<usize>()
            + usize::from(reset == 1)
    };
    // Of equal parts the first.
    let first = (0..=words.len() - shown).rev().max_by_key(|&from| changes(from)).unwrap_or(0);
    let mut drawing = Drawing::new(shown);
    if block.clocked() {
        drawing.clock();
        let resets: Vec<i64> = rows[first..first + shown].iter().map(|row| i64::from(row.rst)).collect();
        drawing.line("rst", &Signal::bit("rst", ""), &resets);
    }
    let hidden = signals.len().saturating_sub(LINES);
    for (at, signal) in signals.iter().enumerate().take(LINES) {
        let own: Vec<i64> = words[first..first + shown].iter().map(|row| row[at]).collect();
        drawing.line(signal.name, signal, &own);
    }
    Figure { svg: drawing.svg(block.name()), first: first + 1, rows: shown, hidden }
}

/// A figure that grows line by line.
struct Drawing {
    edges: usize,
    lines: usize,
    content: String,
}

impl Drawing {
    fn new(edges: usize) -> Self {
        Self { edges, lines: 0, content: String::new() }
    }

    /// Returns the heights of a high and of a low waveform in the line that begins, which it names.
    fn begin(&mut self, name: &str) -> [usize; 2] {
        let top = self.lines * LINE + 6;
        self.lines += 1;
        self.content += &format!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" font-size=\"13\">{name}</text>",
            NAMES - 10,
            top + HIGH - 4
        );
        [top, top + HIGH]
    }

    fn path(&mut self, path: &str) {
        self.content += &format!("<path d=\"{path}\"/>");
    }

    /// Draws the clock, which rises where the words of an edge begin.
    fn clock(&mut self) {
        let [high, low] = self.begin("clk");
        let mut path = format!("M{NAMES} {low}");
        for edge in 0..self.edges {
            let from = NAMES + edge * STEP;
            path += &format!("V{high}H{}V{low}H{}", from + STEP / 2, from + STEP);
        }
        self.path(&path);
    }

    /// Draws the words of a signal: a bit as a line, a word as a lane with its values.
    fn line(&mut self, name: &str, signal: &Signal, words: &[i64]) {
        let [high, low] = self.begin(name);
        let at = |edge: usize| NAMES + edge * STEP;
        if signal.format.width() == 1 {
            let level = |word: i64| if word == 0 { low } else { high };
            let mut path = format!("M{NAMES} {}", level(words[0]));
            for (edge, &word) in words.iter().enumerate() {
                path += &format!("V{}H{}", level(word), at(edge + 1));
            }
            return self.path(&path);
        }
        let mut from = 0;
        while from < words.len() {
            let same = words[from..].iter().take_while(|&&word| word == words[from]).count();
            let (left, right, middle) = (at(from), at(from + same), usize::midpoint(high, low));
            self.path(&format!(
                "M{left} {middle}L{} {high}H{}L{right} {middle}L{} {low}H{}Z",
                left + 4,
                right - 4,
                right - 4,
                left + 4
            ));
            let value = format!("{}", words[from]);
            let size = if value.len() * 7 + 6 > right - left { (right - left - 6) / value.len() * 10 / 6 } else { 11 };
            self.content += &format!(
                "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"{}\">{value}</text>",
                usize::midpoint(left, right),
                low - 5,
                size.max(5)
            );
            from += same;
        }
    }

    /// Returns the figure, on one line because Markdown ends HTML at an empty one.
    fn svg(&self, name: &str) -> String {
        let (width, height) = (NAMES + self.edges * STEP + 4, self.lines * LINE + 8);
        format!(
            "<svg class=\"timing\" role=\"img\" aria-label=\"Timing of {name}\" viewBox=\"0 0 {width} {height}\" \
             xmlns=\"http://www.w3.org/2000/svg\">{}</svg>",
            self.content
        )
    }
}
