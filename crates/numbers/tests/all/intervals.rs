//! Intervals against whole numbers, whose sums and products `f64` holds exactly.

use hpu_numbers::{Complex, Interval, Matrix};

fn whole(lo: i32, hi: i32) -> Interval {
    Interval { lo: f64::from(lo), hi: f64::from(hi) }
}

/// Asserts that an interval contains these numbers, and reaches an ulp beyond their ends at most.
fn holds(found: Interval, all: impl Iterator<Item = i32> + Clone) {
    let (least, most) = (all.clone().min().expect("a number"), all.max().expect("a number"));
    let (least, most) = (f64::from(least), f64::from(most));
    assert!(found.lo <= least && least.next_down() <= found.lo, "{found:?} from {least}");
    assert!(found.hi >= most && most.next_up() >= found.hi, "{found:?} to {most}");
}

#[test]
fn sums_and_products_hold_those_of_all_numbers_within_and_no_more() {
    let ends = || (-4..=4).flat_map(|lo| (lo..=4).map(move |hi| (lo, hi)));
    for ((a, b), (c, d)) in ends().flat_map(|one| ends().map(move |other| (one, other))) {
        let pairs = (a..=b).flat_map(|x| (c..=d).map(move |y| (x, y)));
        let (one, other) = (whole(a, b), whole(c, d));
        holds(one.plus(other), pairs.clone().map(|(x, y)| x + y));
        holds(one.minus(other), pairs.clone().map(|(x, y)| x - y));
        holds(one.times(other), pairs.map(|(x, y)| x * y));
    }
}

#[test]
fn a_complex_product_holds_that_of_gaussian_integers() {
    let number = |re, im| Complex { re: whole(re, re), im: whole(im, im) };
    for (a, b) in (-3..=3).flat_map(|a| (-3..=3).map(move |b| (a, b))) {
        let product = number(a, b).times(number(2, -5));
        holds(Interval { lo: product.re.lo.round(), hi: product.re.hi.round() }, [2 * a + 5 * b].into_iter());
        assert!(product.re.lo <= f64::from(2 * a + 5 * b) && product.re.hi >= f64::from(2 * a + 5 * b));
        assert!(product.im.lo <= f64::from(2 * b - 5 * a) && product.im.hi >= f64::from(2 * b - 5 * a));
    }
}

#[test]
fn a_power_of_a_shear_holds_its_whole_number() {
    let shear = Matrix(vec![vec![whole(1, 1), whole(3, 3)], vec![whole(0, 0), whole(1, 1)]]);
    let power = (0..7).fold(Matrix::identity(2), |power, _| power.times(&shear));
    for (row, exact) in power.0.iter().zip([[1.0, 21.0], [0.0, 1.0]]) {
        for (cell, exact) in row.iter().zip(exact) {
            assert!(cell.lo <= exact && exact <= cell.hi && cell.width() < 1e-12, "{cell:?} beside {exact}");
        }
    }
}
