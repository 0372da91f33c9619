//! `hpu chart` over a map: the share of cells in which each contestant's verdict is wrong.

use std::path::PathBuf;

use hpu_chart as chart;
use hpu_cosim::SceneFile;
use hpu_page::{Column, Page, Table};
use hpu_study::accuracy::{Plan, Race, Share, Speed, Tour, front_of_shares};
use hpu_study::map::Axis;
use serde_json::json;

use crate::chart::Args;
use crate::chart::page::{named, speed};
use crate::command::out_option;
use crate::journal;
use crate::page;
use crate::page::show;
use crate::shell::{Exit, Failure, Folder, interrupt, with_progress};

/// Runs `hpu chart --x --y`.
pub fn run(args: &Args, source: &SceneFile, race: Race, axes: (Axis, Axis)) -> Result<Exit, Failure> {
    let mut load = |file: &str| source.load(file);
    let tour = Tour::new(race, axes, !args.contestants.is_empty(), &mut load)?;
    let command = args.command();
    let files = tour.map.scene.files.iter().flat_map(|(name, bytes)| [name.as_bytes(), bytes]);
    let parts = [tour.map.scene.text.as_bytes()].into_iter().chain(files);
    let folder = args.out.as_deref().map(Folder::open).transpose()?;
    let (mut journal, done) = journal::resume(args.out.as_deref(), tour.units(), ("chart", &command), parts)?;

    let control = interrupt::heed();
    let mut kept = done.len();
    let shares = with_progress((tour.units() - done.len()) as u64, "cells", control, || {
        tour.run(Plan::usual(args.jobs.get()), done, control, |index, row| {
            kept += 1;
            journal.add(index, row)
        })
    })?;
    let Some(shares) = shares else {
        let units = tour.units();
        let mut page = Page::default();
        page.data("scene", &tour.race.written.name).data("complete", false).data("done", kept).data("cells", units);
        page.note(format!("interrupted after {kept} of {units} cells"));
        show(&page, args.json)?;
        return Ok(Exit::Interrupted);
    };
    let toured = Toured { tour, shares, command: command + &out_option(args.out.as_deref()), files: Vec::new() };
    toured.tell(folder, args.json)
}

/// A complete tour.
struct Toured {
    tour: Tour,
    shares: Vec<Share>,
    command: String,
    files: Vec<PathBuf>,
}

impl Toured {
    fn tell(mut self, folder: Option<Folder>, as_json: bool) -> Result<Exit, Failure> {
        if let Some(mut folder) = folder {
            folder.write("chart.csv", self.page().tables().next().expect("its table").csv(&[&self.command]))?;
            let name = &self.tour.race.written.name;
            folder.draw(&chart::shares(name, &self.tour.map, &self.shares, &self.command))?;
            self.files = folder.commit()?;
        }
        show(&self.page(), as_json)?;
        Ok(Exit::Fine)
    }

    /// Returns the page, whose table is that of chart.csv.
    fn page(&self) -> Page {
        let Self { tour, shares, command, files } = self;
        let front = front_of_shares(shares);
        let in_front = |(index, _): &(usize, &Share)| front.contains(index);
        let mut fields = Vec::from(named(|(_, share): &(usize, &Share)| &share.contestant, in_front));
        fields.extend([
            Column::integer("cells", "cells").of(|(_, share): &(usize, &Share)| share.cells),
            Column::integer("wrong", "wrong").of(|(_, share): &(usize, &Share)| share.wrong),
            Column::number("share", "").data().of(|(_, share): &(usize, &Share)| share.share()),
            Column::number("motion_per_wall", "motion/wall")
                .of(|(_, share): &(usize, &Share)| speed(share.speed.as_ref().map(Speed::motion_per_wall))),
            Column::number("edges_per_s", "edges/s")
                .of(|(_, share): &(usize, &Share)| speed(share.speed.as_ref().map(Speed::edges_per_s))),
            Column::flag("front", "").data().of(in_front),
        ]);
        let mut page = Page::default();
        page.note(format!("$ {command}"));
        page.note("").note(format!("{} cells, the verdict of each against the scene as written", tour.map.layer()));
        page.note("").table(Table::of("contestants", shares.iter().enumerate(), fields));
        page.note("\n* beaten by none in both speed, at the middle cell, and share of wrong verdicts");
        for (contestant, why) in &tour.refused {
            let why = why.replace(&format!("method {}", contestant.name), &contestant.name);
            page.note(format!("not of this scene: {why}"));
        }
        let refused = tour.refused.iter().map(|(who, why)| json!({ "name": who.name, "reason": why }));
        page.data("scene", &tour.race.written.name).data("command", command).data("complete", true);
        page.data("cells", tour.map.layer()).data("refused", refused.collect::<Vec<_>>());
        page::files(&mut page, files);
        page
    }
}
