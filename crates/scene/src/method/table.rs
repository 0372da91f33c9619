//! A table of torques over the angle, both directions, with a wall as its end stop: detents, textures.
//!
//! `F = T(x)` everywhere, in straight lines from torque to torque, which repeat; plus `K x + B v` inside the wall.
//! `v = (x(k) - x(k-1)) / T`. The first torque is that at the device's start.
//!
//! **Source**: none needed. A torque that falls through 0 while the angle grows is a detent.
//! **Known failures**: as those of a wall whose stiffness is the steepest slope of the table, on both of its sides.

use hpu_datapath::torque_table::MOST_TORQUES;
use hpu_datapath::{TableConfig, TorqueTable};

use crate::method::published::{Features, Layer, Published};
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::method::wall::Wall;
use crate::schema::Otherwise::{Is, Required};
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity::Sense::Any;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Group, Key, Own, Shape, Takes, Whole, keys};
use crate::text::message::{number, number_below};

/// The form of `method.torques`.
pub(crate) const TORQUES: &str = "[torque, ...] with 2, 4, 8, 16 or 32 torques, as in [0, \"-2 mN.m\", 0, \"2 mN.m\"]";

keys! { table: "method" of ["table"];
    /// Torques towards greater angles at even distances, from the start on; between them a straight line. The table
    /// repeats, in both directions.
    torques: Own = Own::new(|| Takes::Own(Shape::List, TORQUES), Required);
    /// Counts from one torque to the next: a power of two.
    spacing: Whole<u32> = Whole::new(1, 1 << 16, Is(1));
}

/// A table of torques in a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TableMethod {
    /// The torques towards greater angles; those beyond `length` are 0.
    pub torques_nm: [f64; MOST_TORQUES],
    /// The number of torques.
    pub length: usize,
    /// Counts from one torque to the next.
    pub spacing: u32,
}

impl Published for TableMethod {
    type Block = TorqueTable;
    type Float = TableLaw;

    const KEYS: &'static Group = &table::GROUP;
    const LAYERS: &'static [Layer] = &[];

    fn read(s: &Section) -> Result<Self, SceneError> {
        let spacing = s.read(&table::spacing)?;
        if !spacing.is_power_of_two() {
            return Err(s.error("spacing", format!("`{spacing}` is no power of two; accepted: 1, 2, 4 and on")));
        }
        let Some(items) = s.get("torques") else {
            return Err(s.error("torques", format!("missing; write {TORQUES}")));
        };
        let items = items.as_array().ok_or_else(|| s.error("torques", format!("not a list; write {TORQUES}")))?;
        let length = items.len();
        if !(2..=MOST_TORQUES).contains(&length) || !length.is_power_of_two() {
            return Err(s.error("torques", format!("{length} torques; accepted: 2, 4, 8, 16 or 32")));
        }
        let mut torques_nm = [0.0; MOST_TORQUES];
        for (index, (torque_nm, item)) in torques_nm.iter_mut().zip(items).enumerate() {
            let item = toml_edit::Item::Value(item.clone());
            *torque_nm = s.quantity_of(&format!("torques[{index}]"), &item, s.axis().effort, Any, |_| None)?;
        }
        let text = torques_nm[..length].iter().map(|torque_nm| number(*torque_nm)).collect::<Vec<_>>().join(", ");
        s.note("torques", ParameterValue::Text(format!("[{text}]")), s.axis().effort.si, Origin::Scene);
        Ok(Self { torques_nm, length, spacing })
    }

    fn block(&self, setting: &Setting) -> Result<TorqueTable, Unmade> {
        let (table_bits, shift) = (self.length.trailing_zeros(), self.spacing.trailing_zeros());
        if table_bits + shift > setting.widths.width {
            let most = 1u64 << setting.widths.width.saturating_sub(table_bits);
            let reason = format!(
                "{} torques {} counts apart do not fit a counter of {} bits; accepted: {most} counts at most, or more \
                 position_bits",
                self.length, self.spacing, setting.widths.width
            );
            return Err(setting.places.error("method.spacing", reason).into());
        }
        let top = setting.widths.top() as f64;
        let mut torques = [0; MOST_TORQUES];
        for (index, (word, torque_nm)) in torques.iter_mut().zip(self.torques_nm).enumerate() {
            let counts = (-torque_nm / setting.quantum_n).round();
            if counts.abs() > top {
                let most = number_below(top * setting.quantum_n);
                let reason = format!("{} is more than the bridge can show; write -{most} to {most}", number(torque_nm));
                return Err(setting.places.error(&format!("method.torques[{index}]"), reason).into());
            }
            *word = counts as i32;
        }
        Ok(TorqueTable::new(TableConfig { widths: setting.widths, table_bits, shift, torques })?)
    }

    fn float(&self, setting: &Setting) -> Result<TableLaw, SceneError> {
        let spacing_m = f64::from(self.spacing) * setting.count_m;
        Ok(TableLaw::new(setting.wall(1), self.torques_nm[..self.length].into(), spacing_m, setting.start_m))
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        self.torques_nm.iter_mut().collect()
    }

    fn features(&self) -> Features {
        Features::default()
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct TableLaw {
    wall: Wall,
    torques_n: Box<[f64]>,
    spacing_m: f64,
    start_m: f64,
}

impl TableLaw {
    /// Creates a table of torques towards greater angles, `spacing_m` apart, the first of them at `start_m` beyond the
    /// wall's surface.
    pub fn new(wall: Wall, torques_n: Box<[f64]>, spacing_m: f64, start_m: f64) -> Self {
        Self { wall, torques_n, spacing_m, start_m }
    }

    /// Returns the torque of the table towards greater angles.
    pub fn texture_n(&self, x_m: f64) -> f64 {
        let place = ((x_m - self.start_m) / self.spacing_m).rem_euclid(self.torques_n.len() as f64);
        let [here, there] = [0, 1].map(|ahead| self.torques_n[(place as usize + ahead) % self.torques_n.len()]);
        here + (there - here) * place.fract()
    }
}

impl SampledLaw for TableLaw {
    fn sample(&mut self, x_m: f64) -> f64 {
        self.wall.sample(x_m) - self.texture_n(x_m)
    }

    fn vary(&mut self, stiffness_n_per_m: f64, scale: f64) {
        self.wall.vary(stiffness_n_per_m, scale);
    }
}
