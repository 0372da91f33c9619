//! The paper's claims about the cost of its datapath.

use hpu_papers::studies::summing::{Finding, Statement, Sum};
use hpu_rtl::{Cost, HX8K_BRAM, HX8K_CELLS};

use super::row::CostRow;

/// Clocks of the sample period in which the shared loop shows a result: one more than its engine takes.
const CLOCKS: f64 = 33.0;

/// Returns the paper's claims with the findings from the rows. A claim whose rows were not asked for, or failed, cannot
/// be judged.
pub fn sums(rows: &[CostRow]) -> Vec<Sum> {
    vec![rate(rows), modest(rows), costly(rows)]
}

/// Returns the costs in the rows of a block, by label.
fn of<'a>(rows: &'a [CostRow], name: &'a str) -> impl Iterator<Item = (&'a str, &'a Cost)> {
    let priced = rows.iter().map(|row| &row.priced).filter(move |priced| priced.name == name);
    priced.filter_map(|priced| Some((&*priced.label, priced.cost.as_ref().ok()?)))
}

fn rate(rows: &[CostRow]) -> Sum {
    let rates: Vec<_> = of(rows, "phantom_shared_loop")
        .filter_map(|(label, cost)| Some((label, 1e3 * cost.fmax_mhz()? / CLOCKS)))
        .collect();
    let found = rates.iter().map(|(label, khz)| format!("{label} {khz:.0} kHz")).collect::<Vec<_>>().join(", ");
    let cases: Vec<_> = rates.iter().map(|(_, khz)| *khz >= 400.0).collect();
    Sum {
        statement: Statement {
            letter: "a",
            paper: "all necessary position calculations, collision detection, along with force and torque calculations \
                    were handled on-board the FPGA with loop rates of up to 400 kHz",
            place: "Sec. 2.3",
            means: "each phantom_shared_loop that fits the HX8K computes a sample in 33 clocks of its own at 400 kHz \
                    or more",
        },
        finding: Finding::of_cases(&cases),
        found,
    }
}

fn modest(rows: &[CostRow]) -> Sum {
    let loops: Vec<_> = ["phantom_shared_loop", "phantom_loop"]
        .into_iter()
        .filter_map(|name| Some((name, of(rows, name).find(|(label, _)| *label == "default")?.1)))
        .collect();
    let told = loops.iter().map(|(name, cost)| {
        format!("{name} {} of {HX8K_CELLS} cells, {} of {HX8K_BRAM} block RAMs", cost.cells, cost.ice40.bram)
    });
    Sum {
        statement: Statement {
            letter: "b",
            paper: "a haptic environment can be completely simulated on a modest FPGA",
            place: "Sec. 4",
            means: "the loop with tables of the published 13 bits fits the HX8K",
        },
        finding: Finding::of_cases(&loops.iter().map(|(_, cost)| cost.fits()).collect::<Vec<_>>()),
        found: told.collect::<Vec<_>>().join("; "),
    }
}

fn costly(rows: &[CostRow]) -> Sum {
    let cells = of(rows, "trig_cordic").next().map(|(_, cost)| cost.cells);
    Sum {
        statement: Statement {
            letter: "c",
            paper: "calculating any transcendental function would prove too computationally costly to be practical",
            place: "Sec. 2.2.3",
            means: "three CORDICs, a joint each, have more cells than the HX8K",
        },
        finding: Finding::of(cells.map(|cells| 3 * cells > HX8K_CELLS)),
        found: cells.map_or(String::new(), |cells| format!("3 x {cells} of {HX8K_CELLS}")),
    }
}

#[cfg(test)]
mod tests {
    use hpu_rtl::{Counts, Placed};

    use super::*;
    use crate::cost::Priced;

    /// Returns a row with the numbers that claims read: cells, and the fastest clock of a block that fits.
    fn row(name: &str, label: &str, cells: u64, mhz: Option<f64>) -> CostRow {
        let some = Counts { lut4: 1, ff: 1, carry: 1, bram: 1, dsp: 0 };
        let ecp5 = mhz.is_none().then_some(some);
        let placed = mhz.map(|mhz| [Placed::Mhz(mhz); 3]);
        let cost = Ok(Cost { ice40: some, cells, ecp5, placed });
        CostRow { priced: Priced { name: name.into(), label: label.into(), clocked: true, cost }, proof: None }
    }

    fn findings(rows: &[CostRow]) -> [Finding; 3] {
        let sums = sums(rows);
        [0, 1, 2].map(|claim: usize| sums[claim].finding)
    }

    #[test]
    fn findings_follow_the_rows_and_what_was_not_asked_for_or_failed_cannot_be_told() {
        use Finding::{CannotBeTold, Confirmed, NotConfirmed};
        // 400 kHz over 33 clocks are 13.2 MHz.
        let fast = [
            row("phantom_shared_loop", "fraction_22", 6298, Some(13.3)),
            row("phantom_shared_loop", "default", 8514, None),
            row("phantom_loop", "default", 35291, None),
            row("trig_cordic", "default", 2561, Some(6.0)),
        ];
        assert_eq!(findings(&fast), [Confirmed, NotConfirmed, Confirmed]);
        let slow = [
            row("phantom_shared_loop", "fraction_22", 6298, Some(13.1)),
            row("phantom_shared_loop", "default", 7000, Some(13.1)),
            row("phantom_loop", "default", 35291, None),
            row("trig_cordic", "default", 2560, Some(6.0)),
        ];
        assert_eq!(findings(&slow), [NotConfirmed, CannotBeTold, NotConfirmed]);
        let mut failed = row("trig_cordic", "default", 1, None);
        failed.priced.cost = Err("no Yosys".into());
        assert_eq!([findings(&[]), findings(&[failed])], [[CannotBeTold; 3]; 2]);
    }
}
