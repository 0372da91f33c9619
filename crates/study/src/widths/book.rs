//! Keeps the record of one net: its current values and since which edge, and its accumulated signal, noise and losses.

use hpu_signal::{Cycle, Format};

use super::Loss;

/// The record of one net: its current values and since which edge, and its accumulated signal, noise and losses.
#[derive(Clone, Debug)]
pub(super) struct Book {
    pub format: Format,
    /// Whether the law has this net, and whether its block reports its losses.
    pub in_law: bool,
    pub is_told: bool,
    since: u64,
    word: i64,
    law: f64,
    /// The current losses by rounding and overflow, in units of the least significant bit.
    lost: [f64; 2],
    signal: f64,
    noise: f64,
    pub losses: [Loss; 2],
}

impl Book {
    /// Returns an empty record of a net with that format.
    pub fn of(format: Format) -> Self {
        Self {
            format,
            in_law: false,
            is_told: false,
            since: 0,
            word: 0,
            law: 0.0,
            lost: [0.0; 2],
            signal: 0.0,
            noise: 0.0,
            losses: [Loss::default(); 2],
        }
    }

    /// Adds up the current values until an edge. The values after reset count from edge 1.
    pub fn close(&mut self, edge: u64) {
        let edges = edge.saturating_sub(self.since.max(1));
        if edges == 0 {
            return;
        }
        if self.in_law {
            let value = self.format.to_f64(self.word);
            self.signal += self.law * self.law * edges as f64;
            self.noise += (value - self.law).powi(2) * edges as f64;
        }
        for (loss, lost) in self.losses.iter_mut().zip(self.lost) {
            if lost > 0.0 {
                loss.edges += edges;
                loss.worst = loss.worst.max(lost * self.format.lsb());
                loss.first.get_or_insert(Cycle(self.since.max(1)));
            }
        }
    }

    /// Notes the word, the law's value and the block's losses, which hold from an edge on.
    pub fn enter(&mut self, edge: u64, word: i64, law: f64, lost: [f64; 2]) {
        let is_same = word == self.word && law == self.law && lost[0] == self.lost[0] && lost[1] == self.lost[1];
        if !is_same {
            self.close(edge);
            (self.word, self.law, self.lost, self.since) = (word, law, lost, edge);
        }
    }

    /// Returns the signal-to-noise ratio in decibels; infinite when word and law never differed, `None` where there is
    /// no law or no signal.
    pub fn sqnr_db(&self) -> Option<f64> {
        let known = self.in_law && self.signal > 0.0 && self.noise.is_finite();
        known.then(|| 10.0 * libm::log10(self.signal / self.noise))
    }
}
