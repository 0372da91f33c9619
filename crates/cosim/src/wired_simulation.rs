//! A scene made ready whose loop blocks of this project close: an axis, or another device.

use hpu_signal::Observe;

use crate::result::forever::Beyond;
use crate::result::outline::Outline;
use crate::result::summary::Summary;
use crate::result::trace::Trace;
use crate::run::axis_simulation::AxisSimulation;
use crate::run::engine::{Comparison, Control, Driver};
use crate::run::simulation::{Direct, LoopVisitor, Simulation, TheLoop, Wired};
use crate::run::simulation_error::SimulationError;
use crate::run::untyped::AnyClosedLoop;
use hpu_scene::Experiment;

macro_rules! wired {
    (($d:tt) $(#[doc = $meaning:literal] $Device:ident: $module:ident, $Scene:ident, $Simulation:ident;)*) => {
        /// A scene made ready whose loop blocks of this project close: an axis, or another device.
        #[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
        pub enum WiredSimulation<'s> {
            /// One axis: a motor with a wheel, and a wall.
            Axis(AxisSimulation<'s>),
            $(#[doc = $meaning] $Device(crate::$Simulation<'s>),)*
            /// Bodies and joints whose loop is that of EPFL's haptic paddle; a page, which loads all code, has it not.
            #[cfg(not(target_family = "wasm"))]
            Paddle(crate::PaddleSimulation<'s>),
            /// A motor with three phases behind field-oriented control; a page has it not either.
            #[cfg(not(target_family = "wasm"))]
            Foc(crate::FocSimulation<'s>),
        }

        /// Evaluates an expression with a simulation bound to a name, whatever its type.
        macro_rules! forward {
            ($d self:ident, $d simulation:ident => $d call:expr) => {
                match $d self {
                    Self::Axis($d simulation) => $d call,
                    $(Self::$Device($d simulation) => $d call,)*
                    #[cfg(not(target_family = "wasm"))]
                    Self::Paddle($d simulation) => $d call,
                    #[cfg(not(target_family = "wasm"))]
                    Self::Foc($d simulation) => $d call,
                }
            };
        }

        impl<'s> WiredSimulation<'s> {
            /// Makes a scene ready.
            ///
            /// # Errors
            ///
            /// When its words, widths or parameters are impossible, or its device has no datapath.
            pub fn new(experiment: &'s Experiment) -> Result<Self, SimulationError> {
                match experiment {
                    Experiment::Axis(scene) => AxisSimulation::new(scene).map(Self::Axis),
                    $(Experiment::$Device(scene) => crate::$Simulation::new(scene).map(Self::$Device),)*
                    #[cfg(not(target_family = "wasm"))]
                    Experiment::Paddle(scene) => crate::PaddleSimulation::new(scene).map(Self::Paddle),
                    #[cfg(not(target_family = "wasm"))]
                    Experiment::Foc(scene) => crate::FocSimulation::new(scene).map(Self::Foc),
                    #[cfg(target_family = "wasm")]
                    Experiment::Foc(scene) => {
                        Err(SimulationError::Scene(scene.error("device.kind", "a page has no motor with three phases")))
                    }
                    #[cfg(target_family = "wasm")]
                    Experiment::Paddle(scene) => {
                        Err(SimulationError::Scene(scene.error("method.kind", "a page has not the loop of the paddle")))
                    }
                    Experiment::Dut(scene) => {
                        let reason = "this asks for blocks of hpu's own, and the scene has a design of yours";
                        Err(SimulationError::Scene(scene.error("dut", reason)))
                    }
                }
            }
        }
    };
}
hpu_scene::devices!(wired);

impl Simulation for WiredSimulation<'_> {
    fn outline(&self) -> &Outline {
        forward!(self, simulation => simulation.outline())
    }
}

impl Wired for WiredSimulation<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        forward!(self, simulation => simulation.wiring())
    }

    fn gates_drive(&self) -> bool {
        forward!(self, simulation => simulation.gates_drive())
    }

    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visitor: V) -> V::Out {
        forward!(self, simulation => simulation.visit(visitor))
    }

    fn run_beyond(
        &self,
        driver: Driver,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
        beyond: Option<&Beyond>,
    ) -> Summary {
        forward!(self, simulation => simulation.run_beyond(driver, trace, observer, control, beyond))
    }

    fn closed_loop(&self) -> Box<dyn AnyClosedLoop<'_> + '_> {
        forward!(self, simulation => simulation.closed_loop())
    }

    fn compare(&self, edges: u64) -> Comparison {
        forward!(self, simulation => simulation.compare(edges))
    }

    fn direct(&self) -> Option<Box<dyn Direct + '_>> {
        forward!(self, simulation => simulation.direct())
    }

    fn driver(&self) -> Driver {
        forward!(self, simulation => simulation.driver())
    }
}
