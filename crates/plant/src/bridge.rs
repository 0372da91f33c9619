//! The H-bridge: the circuit at the motor's terminals, as set by the gates.
//!
//! Each leg's pair of switches connects its node to the supply, to ground, or to nothing; in the last case the diodes
//! carry the current that the inductance maintains. The motor's plus terminal is on leg B and its minus terminal on leg
//! A, so that a positive command of the datapath turns the motor against the positive angle: a wall's torque is
//! positive when it pushes back.
//!
//! **Differs from the hardware**: switches have one on-resistance and no switching time; diodes a constant drop; both
//! switches of a leg on is a fault in hardware and is refused here.

/// Supply and switches.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bridge {
    /// Supply voltage in V.
    pub supply_v: f64,
    /// Resistance of one closed switch in Ω.
    pub on_resistance_ohm: f64,
    /// Drop of a conducting diode in V.
    pub diode_drop_v: f64,
    /// Mean voltage in V, in either direction, that does not reach the motor; 0 of one that switches.
    pub dead_band_v: f64,
}

/// The four gates, in the order of the PWM block's outputs.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Gates {
    /// Leg A to the supply.
    pub a_high: bool,
    /// Leg A to ground.
    pub a_low: bool,
    /// Leg B to the supply.
    pub b_high: bool,
    /// Leg B to ground.
    pub b_low: bool,
}

/// The circuit that the motor sees.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Circuit {
    /// Current flows.
    Closed {
        /// Share of the supply across the motor: -1, 0, 1 when switching, anything between when averaged.
        supply_share: f64,
        /// Diodes in the path, 0 to 2.
        diodes: u8,
        /// Direction of the current when diodes carry it: 1 or -1; 0 when switches carry it either way.
        direction: i8,
        /// Closed switches in the path, 0 to 2.
        switches: u8,
    },
    /// No path and no current, as long as the back-EMF stays between these two.
    Open {
        /// Below this back-EMF, in V, current starts in the positive direction.
        emf_min_v: f64,
        /// Above this back-EMF, in V, current starts in the negative direction.
        emf_max_v: f64,
    },
    /// An ideal amplifier in the bridge's place: it imposes the current, whatever voltage that takes.
    Amplified,
}

/// The switches of one leg.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Leg {
    /// The terminal is switched to the supply.
    High,
    /// The terminal is switched to ground.
    Low,
    /// Both switches are off; only the diodes can conduct.
    #[default]
    Open,
}

fn leg(high: bool, low: bool) -> Leg {
    match (high, low) {
        (true, false) => Leg::High,
        (false, true) => Leg::Low,
        (false, false) => Leg::Open,
        (true, true) => unreachable!("both switches of a leg on"),
    }
}

impl Bridge {
    /// Returns the circuit for these gates, for a motor that carries `current_a` and induces `emf_v`.
    ///
    /// # Panics
    ///
    /// When both switches of a leg are on: no block here does that, and a bridge would not survive it.
    pub fn circuit(&self, gates: Gates, current_a: f64, emf_v: f64) -> Circuit {
        let plus = leg(gates.b_high, gates.b_low);
        let minus = leg(gates.a_high, gates.a_low);
        let off = u8::from(plus == Leg::Open) + u8::from(minus == Leg::Open);
        if off == 0 {
            return self.closed(plus, minus, 0);
        }
        let rails = |leg| match leg {
            Leg::High => (self.supply_v, self.supply_v),
            Leg::Low => (0.0, 0.0),
            Leg::Open => (-self.diode_drop_v, self.supply_v + self.diode_drop_v),
        };
        // Without current the terminals differ by the back-EMF. A node that would leave the range of its diodes makes
        // them conduct.
        let (plus_min, plus_max) = rails(plus);
        let (minus_min, minus_max) = rails(minus);
        let (emf_min_v, emf_max_v) = (plus_min - minus_max, plus_max - minus_min);
        let direction = match current_a {
            i if i > 0.0 => 1,
            i if i < 0.0 => -1,
            _ if emf_v < emf_min_v => 1,
            _ if emf_v > emf_max_v => -1,
            _ => {
                return Circuit::Open { emf_min_v, emf_max_v };
            }
        };
        self.closed(plus, minus, direction)
    }

    /// Returns the averaged circuit for a duty of the command between -1 and 1, with both switches of the path closed
    /// throughout. What the dead band takes off the voltage is off the circuit's share.
    pub fn averaged(&self, duty: f64) -> Circuit {
        let supply_share = match self.dead_band_v {
            0.0 => -duty,
            dead_band_v => (duty.abs() - dead_band_v / self.supply_v).max(0.0).copysign(-duty),
        };
        Circuit::Closed { supply_share, diodes: 0, direction: 0, switches: 2 }
    }

    fn closed(&self, plus: Leg, minus: Leg, direction: i8) -> Circuit {
        // Positive current enters the motor at plus: an open plus node draws it from ground, and an open minus node
        // sends it to the supply.
        let share = |leg, gives: bool| match leg {
            Leg::High => 1.0,
            Leg::Low => 0.0,
            Leg::Open => f64::from(u8::from(!gives)),
        };
        let positive = direction > 0;
        let diodes = u8::from(plus == Leg::Open) + u8::from(minus == Leg::Open);
        Circuit::Closed {
            supply_share: share(plus, positive) - share(minus, !positive),
            diodes,
            direction,
            switches: 2 - diodes,
        }
    }

    /// Returns the voltage across the motor's resistance, inductance and back-EMF.
    pub fn voltage_v(&self, circuit: Circuit) -> f64 {
        match circuit {
            Circuit::Closed { supply_share, diodes, direction, .. } => {
                self.supply_v * supply_share - f64::from(direction) * f64::from(diodes) * self.diode_drop_v
            }
            Circuit::Open { .. } | Circuit::Amplified => 0.0,
        }
    }
}
