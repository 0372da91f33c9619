//! The functions of FMI 3.0 that an importer of a co-simulation unit calls; their meaning is the standard's.
//!
//! No panic leaves them. A pointer that is not null must be valid for its length, as anywhere in C. What the
//! description does not offer (model exchange, scheduled execution, clocks, derivatives, other types than Float64 and
//! Int64, serialised states) answers with an error.

use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::ptr;
use std::slice;

use super::archive::opened;
use super::unit::{Snapshot, Unit};
use crate::error::{Error, Status};

const OK: i32 = 0;
const ERROR: i32 = 3;
const FATAL: i32 = 4;

type Log = extern "C" fn(*mut c_void, i32, *const c_char, *const c_char);

/// Where an instance stands in the standard's machine of states.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Stage {
    Instantiated,
    Initializing,
    Step,
    Event,
    Terminated,
}

/// An instance.
struct Instance {
    unit: Unit,
    stage: Stage,
    /// The importer's time.
    time: f64,
    /// Whether the importer uses event mode and takes early returns: a step then ends where an output word changes.
    stops: bool,
    has_event_mode: bool,
    /// States to come back to, with time and stage. Those that are freed are `None`, so a stale one is an error.
    states: Vec<Option<(Snapshot, f64, Stage)>>,
    environment: *mut c_void,
    log: Option<Log>,
}

impl Instance {
    fn tell(&self, text: &str) {
        if let (Some(log), Ok(text)) = (self.log, CString::new(text.replace('\0', " "))) {
            log(self.environment, ERROR, c"logStatusError".as_ptr(), text.as_ptr());
        }
    }

    /// Checks that the instance stands in one of these stages.
    fn stands(&self, stages: &[Stage]) -> Result<(), Error> {
        let why = || Error::new(Status::Argument, format!("the call is not allowed in the stage {:?}", self.stage));
        stages.contains(&self.stage).then_some(()).ok_or_else(why)
    }

    fn goes(&mut self, from: &[Stage], to: Stage) -> Result<(), Error> {
        self.stands(from)?;
        self.stage = to;
        Ok(())
    }
}

/// Runs a call on an instance.
fn call(instance: *mut c_void, run: impl FnOnce(&mut Instance) -> Result<(), Error>) -> i32 {
    // SAFETY: a pointer that is not null is one that `fmi3InstantiateCoSimulation` has returned.
    let Some(instance) = (unsafe { instance.cast::<Instance>().as_mut() }) else { return ERROR };
    match catch_unwind(AssertUnwindSafe(|| run(instance))) {
        Ok(Ok(())) => OK,
        Ok(Err(error)) => {
            instance.tell(&error.text);
            ERROR
        }
        Err(_) => {
            instance.tell("a fault of the library; the instance can only be freed");
            FATAL
        }
    }
}

fn array<'a, T>(pointer: *const T, count: usize) -> Result<&'a [T], Error> {
    match (pointer.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(Error::new(Status::Argument, format!("null, with {count} elements"))),
        // SAFETY: a pointer that is not null is valid for its length.
        (false, _) => Ok(unsafe { slice::from_raw_parts(pointer, count) }),
    }
}

fn place<'a, T>(pointer: *mut T) -> Result<&'a mut T, Error> {
    // SAFETY: a pointer that is not null is valid.
    unsafe { pointer.as_mut() }.ok_or_else(|| Error::new(Status::Argument, "a place for a result is null"))
}

/// Returns value references and as many values.
fn taken<'a, T>(references: (*const u32, usize), values: (*const T, usize)) -> Result<(&'a [u32], &'a [T]), Error> {
    let (references, values) = (array(references.0, references.1)?, array(values.0, values.1)?);
    let why = || Error::new(Status::Argument, "there are other numbers of values and of value references");
    (references.len() == values.len()).then_some((references, values)).ok_or_else(why)
}

/// Writes values of variables to an importer's array.
fn fill<T>(
    references: (*const u32, usize),
    values: (*mut T, usize),
    mut value: impl FnMut(u32) -> Result<T, Error>,
) -> Result<(), Error> {
    let references = array(references.0, references.1)?;
    // The importer's places may have no values yet, so they are not read.
    if references.len() != values.1 || values.0.is_null() && values.1 > 0 {
        return Err(Error::new(Status::Argument, "there are other numbers of values and of value references"));
    }
    for (index, reference) in references.iter().enumerate() {
        let value = value(*reference)?;
        // SAFETY: the array has as many places as there are references.
        unsafe { values.0.add(index).write(value) };
    }
    Ok(())
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    event_mode: bool,
    early_return: bool,
    _required: *const u32,
    required: usize,
    environment: *mut c_void,
    log: Option<Log>,
    _intermediate: *const c_void,
) -> *mut c_void {
    let tell = |text: &str| {
        if let (Some(log), Ok(text)) = (log, CString::new(text.replace('\0', " "))) {
            log(environment, ERROR, c"logStatusError".as_ptr(), text.as_ptr());
        }
    };
    let text = |pointer: *const c_char| {
        // SAFETY: a pointer that is not null is valid up to the zero at its end.
        (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
    };
    let (Some(token), Some(folder)) = (text(token), text(resources)) else {
        tell("the instantiation token or the path of the resources is null");
        return ptr::null_mut();
    };
    if required > 0 {
        tell("intermediate updates are not offered");
        return ptr::null_mut();
    }
    match catch_unwind(AssertUnwindSafe(|| opened(Path::new(&folder), &token))) {
        Ok(Ok(unit)) => Box::into_raw(Box::new(Instance {
            unit,
            stage: Stage::Instantiated,
            time: 0.0,
            stops: event_mode && early_return,
            has_event_mode: event_mode,
            states: Vec::new(),
            environment,
            log,
        }))
        .cast(),
        Ok(Err(error)) => {
            tell(&error.text);
            ptr::null_mut()
        }
        Err(_) => {
            tell("a fault of the library");
            ptr::null_mut()
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3FreeInstance(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: it comes from `Box::into_raw` above, and is freed once, as the standard says.
        let freed = unsafe { Box::from_raw(instance.cast::<Instance>()) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(freed)));
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetDebugLogging(instance: *mut c_void, _on: bool, _count: usize, _names: *const c_void) -> i32 {
    call(instance, |_| Ok(()))
}

#[unsafe(no_mangle)]
extern "C" fn fmi3EnterInitializationMode(
    instance: *mut c_void,
    _tolerance_defined: bool,
    _tolerance: f64,
    start: f64,
    _stop_defined: bool,
    _stop: f64,
) -> i32 {
    call(instance, |this| {
        if start != 0.0 {
            return Err(Error::new(
                Status::Argument,
                format!("starts at {start} s; accepted: 0, where a scene begins"),
            ));
        }
        this.goes(&[Stage::Instantiated], Stage::Initializing)
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3ExitInitializationMode(instance: *mut c_void) -> i32 {
    call(instance, |this| {
        let next = if this.has_event_mode { Stage::Event } else { Stage::Step };
        this.goes(&[Stage::Initializing], next)
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3EnterEventMode(instance: *mut c_void) -> i32 {
    call(instance, |this| this.goes(&[Stage::Step], Stage::Event))
}

#[unsafe(no_mangle)]
extern "C" fn fmi3EnterStepMode(instance: *mut c_void) -> i32 {
    call(instance, |this| this.goes(&[Stage::Event], Stage::Step))
}

#[unsafe(no_mangle)]
extern "C" fn fmi3UpdateDiscreteStates(
    instance: *mut c_void,
    again: *mut bool,
    terminate: *mut bool,
    nominals: *mut bool,
    values: *mut bool,
    defined: *mut bool,
    time: *mut f64,
) -> i32 {
    call(instance, |this| {
        this.stands(&[Stage::Event])?;
        for pointer in [again, terminate, nominals, values, defined] {
            *place(pointer)? = false;
        }
        *place(time)? = 0.0;
        Ok(())
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3Terminate(instance: *mut c_void) -> i32 {
    call(instance, |this| this.goes(&[Stage::Step, Stage::Event], Stage::Terminated))
}

#[unsafe(no_mangle)]
extern "C" fn fmi3Reset(instance: *mut c_void) -> i32 {
    call(instance, |this| {
        this.unit.reset()?;
        (this.stage, this.time) = (Stage::Instantiated, 0.0);
        Ok(())
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetFloat64(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut f64,
    places: usize,
) -> i32 {
    call(instance, |this| {
        let time = this.time;
        fill((references, count), (values, places), |reference| this.unit.real(reference, time))
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetInt64(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut i64,
    places: usize,
) -> i32 {
    call(instance, |this| fill((references, count), (values, places), |reference| this.unit.word(reference)))
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetFloat64(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const f64,
    places: usize,
) -> i32 {
    call(instance, |this| {
        let (references, values) = taken((references, count), (values, places))?;
        this.stands(&[Stage::Instantiated, Stage::Initializing, Stage::Step, Stage::Event])?;
        let has_begun = matches!(this.stage, Stage::Step | Stage::Event);
        references.iter().zip(values).try_for_each(|(reference, value)| {
            if has_begun { this.unit.tune(*reference, *value) } else { this.unit.set(*reference, *value) }
        })
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetInt64(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const i64,
    places: usize,
) -> i32 {
    call(instance, |this| {
        let (references, values) = taken((references, count), (values, places))?;
        this.stands(&[Stage::Instantiated, Stage::Initializing, Stage::Step, Stage::Event])?;
        this.unit.drive(references, values)
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3DoStep(
    instance: *mut c_void,
    now: f64,
    step: f64,
    _keeps_no_state: bool,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    reached: *mut f64,
) -> i32 {
    call(instance, |this| {
        this.stands(&[Stage::Step])?;
        let (event, terminate, early, reached) = (place(event)?, place(terminate)?, place(early)?, place(reached)?);
        (*event, *terminate, *early, *reached) = (false, false, false, this.time);
        if !(step > 0.0 && step.is_finite()) {
            return Err(Error::new(Status::Argument, format!("a step of {step} s; accepted: above 0")));
        }
        if (now - this.time).abs() > 1e-9 * (1.0 + now.abs()) {
            let text = format!("a step from {now} s, but the last one ended at {} s", this.time);
            return Err(Error::new(Status::Argument, text));
        }
        match this.unit.advance(now + step, this.stops) {
            Ok(false) => this.time = now + step,
            Ok(true) => {
                this.time = this.unit.time();
                (*event, *early) = (true, this.time < now + step);
            }
            Err(error) if error.status == Status::End => {
                this.time = this.unit.time();
                (*terminate, *early) = (true, true);
            }
            Err(error) => return Err(error),
        }
        *reached = this.time;
        Ok(())
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetFMUState(instance: *mut c_void, state: *mut *mut c_void) -> i32 {
    call(instance, |this| {
        let state = place(state)?;
        let taken = (this.unit.snapshot(), this.time, this.stage);
        let known = number(*state).filter(|at| matches!(this.states.get(*at), Some(Some(_))));
        let at = known.unwrap_or_else(|| {
            let free = this.states.iter().position(Option::is_none);
            free.unwrap_or_else(|| {
                this.states.push(None);
                this.states.len() - 1
            })
        });
        this.states[at] = Some(taken);
        *state = ptr::without_provenance_mut(at + 1);
        Ok(())
    })
}

/// Returns the index that the handle of a state is; none for a null one.
fn number(state: *mut c_void) -> Option<usize> {
    state.addr().checked_sub(1)
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetFMUState(instance: *mut c_void, state: *mut c_void) -> i32 {
    call(instance, |this| {
        let Instance { unit, states, .. } = this;
        let found = number(state).and_then(|at| states.get(at)?.as_ref());
        let (snapshot, time, stage) =
            found.ok_or_else(|| Error::new(Status::Argument, "no such state, or one that was freed"))?;
        unit.restore(snapshot)?;
        (this.time, this.stage) = (*time, *stage);
        Ok(())
    })
}

#[unsafe(no_mangle)]
extern "C" fn fmi3FreeFMUState(instance: *mut c_void, state: *mut *mut c_void) -> i32 {
    call(instance, |this| {
        let state = place(state)?;
        if let Some(freed) = number(*state).and_then(|at| this.states.get_mut(at)) {
            *freed = None;
        }
        *state = ptr::null_mut();
        Ok(())
    })
}

/// Functions that a unit of co-simulation with Float64 and Int64 variables does not offer.
macro_rules! not_offered {
    ($($name:ident)*) => {
        $(
            #[unsafe(no_mangle)]
            extern "C" fn $name(instance: *mut c_void) -> i32 {
                call(instance, |_| Err(Error::new(Status::Argument, concat!(stringify!($name), " is not offered"))))
            }
        )*
    };
}

not_offered! {
    fmi3GetFloat32 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16 fmi3GetInt32 fmi3GetUInt32 fmi3GetUInt64
    fmi3GetBoolean fmi3GetString fmi3GetBinary fmi3GetClock fmi3SetFloat32 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16
    fmi3SetUInt16 fmi3SetInt32 fmi3SetUInt32 fmi3SetUInt64 fmi3SetBoolean fmi3SetString fmi3SetBinary fmi3SetClock
    fmi3GetNumberOfVariableDependencies fmi3GetVariableDependencies fmi3SerializedFMUStateSize fmi3SerializeFMUState
    fmi3DeserializeFMUState fmi3GetDirectionalDerivative fmi3GetAdjointDerivative fmi3EnterConfigurationMode
    fmi3ExitConfigurationMode fmi3GetIntervalDecimal fmi3GetIntervalFraction fmi3GetShiftDecimal fmi3GetShiftFraction
    fmi3SetIntervalDecimal fmi3SetIntervalFraction fmi3SetShiftDecimal fmi3SetShiftFraction
    fmi3EvaluateDiscreteStates fmi3EnterContinuousTimeMode fmi3CompletedIntegratorStep fmi3SetTime
    fmi3SetContinuousStates fmi3GetContinuousStateDerivatives fmi3GetEventIndicators fmi3GetContinuousStates
    fmi3GetNominalsOfContinuousStates fmi3GetNumberOfEventIndicators fmi3GetNumberOfContinuousStates
    fmi3GetOutputDerivatives fmi3ActivateModelPartition
}

/// Model exchange and scheduled execution are not offered.
macro_rules! no_instance {
    ($($name:ident)*) => {
        $(
            #[unsafe(no_mangle)]
            extern "C" fn $name() -> *mut c_void {
                ptr::null_mut()
            }
        )*
    };
}

no_instance! { fmi3InstantiateModelExchange fmi3InstantiateScheduledExecution }
