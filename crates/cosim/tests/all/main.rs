//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod bounded;
mod common;
mod cruise;
mod drivers;
mod energy;
mod gallery;
mod known_answers;
mod law_scenes;
mod law_words;
mod laws;
mod less_model;
mod loaded;
mod phantom_host;
mod phantom_physics;
mod phantom_refusals;
mod phantom_scenes;
mod phantom_solvers;
mod phantom_verdict;
mod phantom_worlds;
mod rail;
mod scene_errors;
mod scene_replay;
mod scene_shipped;
mod scene_words;
mod solvers;
mod verdict;
