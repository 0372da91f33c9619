//! The cache returns a cost only for the same VHDL in the same widths.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use hpu_datapath::{AnyBlock, AxisFront, Block, PositionCounter};
use hpu_rtl::{Cache, Fault, Setup};

/// A folder with a copy of `hdl/` and a cache, removed after the test.
struct Desk(PathBuf);

impl Desk {
    fn new(name: &str) -> Self {
        let desk = Self(std::env::temp_dir().join(format!("hpu-cache-{name}-{}", std::process::id())));
        fs::create_dir_all(desk.hdl()).expect("a folder for the test");
        let original = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hdl");
        for file in fs::read_dir(original).expect("hdl/").map(|file| file.expect("a file").path()) {
            if file.is_file() {
                fs::copy(&file, desk.hdl().join(file.file_name().expect("a name"))).expect("a copy");
            }
        }
        desk
    }

    fn hdl(&self) -> PathBuf {
        self.0.join("hdl")
    }

    fn cache(&self) -> Cache {
        Cache::open(self.0.join("cache"), None).expect("the tools and a folder")
    }

    fn edit(&self, file: &str, from: &str, to: &str) {
        let place = self.hdl().join(file);
        let text = fs::read_to_string(&place).expect("VHDL");
        assert!(text.contains(from), "{file}");
        fs::write(place, text.replace(from, to)).expect("VHDL");
    }

    /// Returns the files of the cache.
    fn entries(&self) -> Vec<PathBuf> {
        fs::read_dir(self.0.join("cache")).expect("a cache").map(|file| file.expect("a file").path()).collect()
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn counter(width: u32) -> PositionCounter {
    PositionCounter::new(width).expect("valid")
}

#[test]
fn what_was_measured_once_is_remembered_by_every_seed() {
    let desk = Desk::new("once");
    let first = desk.cache();
    let cost = first.cost(&counter(8), desk.hdl()).expect("a cost");
    assert_eq!(first.measured(), 1);
    assert_eq!(first.cost(&counter(8), desk.hdl()).expect("a cost"), cost);
    let later = desk.cache();
    assert_eq!(later.cost(&counter(8), desk.hdl()).expect("a cost"), cost);
    assert_eq!((first.measured(), later.measured()), (1, 0));
    // The flow without a cache gives the same cost.
    assert_eq!(hpu_rtl::cost(&counter(8), desk.hdl()).expect("a cost"), cost);
}

#[test]
fn other_widths_are_another_cost() {
    let desk = Desk::new("widths");
    let cache = desk.cache();
    // A bit takes a flip-flop.
    for width in [5, 6, 5, 6] {
        assert_eq!(cache.counts(&counter(width), desk.hdl()).expect("counts").ff, u64::from(width));
    }
    assert_eq!(cache.measured(), 2);
}

#[test]
fn other_vhdl_is_never_answered_from_the_cache_of_this() {
    let (desk, name) = (Desk::new("vhdl"), PositionCounter::NAME);
    let cache = desk.cache();
    let before = cache.counts(&counter(6), desk.hdl()).expect("counts");
    assert_eq!((before.ff, cache.measured()), (6, 1));
    // Adds a register behind the output.
    let file = format!("{name}.vhd");
    let text = fs::read_to_string(desk.hdl().join(&file)).expect("VHDL");
    let late = text
        .replace("entity position_counter is", "entity position_counter_now is")
        .replace("architecture rtl of position_counter is", "architecture rtl of position_counter_now is");
    fs::write(desk.hdl().join("position_counter_now.vhd"), late).expect("VHDL");
    let ports = &text[..text.find("architecture").expect("an architecture")];
    let around = "architecture rtl of position_counter is\n  signal now : std_logic_vector(WIDTH - 1 downto 0);\n\
                  begin\n  inner : entity work.position_counter_now generic map (WIDTH) \
                  port map (clk, rst, step, now);\n  position <= now when rising_edge(clk);\nend architecture;\n";
    fs::write(desk.hdl().join(&file), format!("{ports}{around}")).expect("VHDL");
    assert_eq!((cache.counts(&counter(6), desk.hdl()).expect("counts").ff, cache.measured()), (12, 2));
    // The first VHDL again: its cost is still in the cache.
    fs::write(desk.hdl().join(&file), &text).expect("VHDL");
    assert_eq!((cache.counts(&counter(6), desk.hdl()).expect("counts"), cache.measured()), (before, 2));
}

#[test]
fn the_vhdl_of_what_a_block_instantiates_counts_as_its_own() {
    let desk = Desk::new("parts");
    let (cache, front) = (desk.cache(), AxisFront::new(6).expect("valid"));
    let before = cache.counts(&front, desk.hdl()).expect("counts");
    desk.edit("displacement.vhd", "library ieee;", "-- another one\nlibrary ieee;");
    assert_eq!(cache.counts(&front, desk.hdl()).expect("counts"), before);
    assert_eq!(cache.measured(), 2);
    // The front does not instantiate this block.
    desk.edit("pwm.vhd", "library ieee;", "-- another one\nlibrary ieee;");
    assert_eq!(cache.counts(&front, desk.hdl()).expect("counts"), before);
    assert_eq!(cache.measured(), 2);
}

#[test]
fn an_entry_that_is_cut_or_of_another_block_is_measured_again_and_replaced() {
    let desk = Desk::new("damaged");
    let cache = desk.cache();
    let counts = cache.counts(&counter(6), desk.hdl()).expect("counts");
    let [entry] = desk.entries().try_into().expect("one entry");
    let whole = fs::read_to_string(&entry).expect("an entry");
    cache.counts(&counter(7), desk.hdl()).expect("counts");
    let other = desk.entries().into_iter().find(|file| *file != entry).expect("another entry");
    let other = fs::read_to_string(other).expect("an entry");
    let cheaper = whole.replace("ff=6", "ff=5");
    assert_ne!(cheaper, whole);
    // A tool that has no time shows that the entry is not believed, without a synthesis.
    let no_time = Setup { timeout: Some(Duration::from_millis(1)), ..Setup::from(desk.hdl()) };
    for damaged in [&whole[..whole.len() / 2], &whole[..whole.len() - 1], "", "something else\n", &other, &cheaper] {
        fs::write(&entry, damaged).expect("an entry");
        let error = cache.counts(&counter(6), &no_time).expect_err(damaged);
        assert!(matches!(error.fault(), Some(Fault::TooLong(_))), "{damaged:?}: {error}");
    }
    assert_eq!(cache.counts(&counter(6), desk.hdl()).expect("counts"), counts);
    assert_eq!(cache.measured(), 3);
    assert_eq!(fs::read_to_string(&entry).expect("an entry"), whole);
    assert_eq!(cache.counts(&counter(6), &no_time).expect("an entry that is whole"), counts);
    // The folder has nothing but the two entries, because temporary files are renamed to them.
    assert_eq!(desk.entries().len(), 2);
}

#[test]
fn what_the_tools_refuse_is_not_remembered() {
    let desk = Desk::new("refused");
    let cache = desk.cache();
    desk.edit("position_counter.vhd", "begin", "begin nonsense");
    let error = cache.counts(&counter(6), desk.hdl()).expect_err("no VHDL").to_string();
    assert!(error.contains("ghdl could not analyse the VHDL"), "{error}");
    fs::remove_file(desk.hdl().join("position_counter.vhd")).expect("a file");
    let error = cache.cost(&counter(6) as &dyn AnyBlock, desk.hdl()).expect_err("no VHDL").to_string();
    assert!(error.contains("position_counter.vhd: "), "{error}");
    assert_eq!((desk.entries().len(), cache.measured()), (0, 0));
}

#[test]
fn a_cache_that_cannot_be_a_folder_says_which() {
    let desk = Desk::new("file");
    let place = desk.hdl().join("pwm.vhd");
    let error = Cache::open(&place, None).expect_err("it is a file");
    assert!(error.is_io() && error.to_string().contains("pwm.vhd: "), "{error}");
}
