//! Schedulers: the shards of a wave as an array of Slurm, or as lines for GNU parallel.
//!
//! `submit` is one step that may be repeated: it gathers a wave that is done, plans the next one, and submits the jobs
//! that Slurm does not have, which it knows by their names. The job after an array gives this command again
//! (`afterok`). A stand-in does so where a task or that job has failed (`afternotok`); it ends the sweep when an array
//! has finished no shard.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use hpu_cosim::script;
use hpu_cosim::script::{Fixed, Parallel, Script, Shell, Slurm, Unwritable};
use hpu_farm::Points;
use hpu_page::Page;
use hpu_rtl::dut::is_forbidden;
use hpu_rtl::temporary::Temporary;
use hpu_rtl::{Fault, Group, TIMEOUT, output};

use super::local::{shards, waited};
use super::manifest::Planned;
use super::shard::planned;
use super::status::progress;
use super::{plan, status};
use crate::page::show;
use crate::scene::quoted;
use crate::shell::{Exit, Failure, interrupt, print_file, program, values};

/// Hand the shards that are not done to a scheduler
///
/// A task runs some shards one after the other, each in a process of its own. A wave that is done is gathered, and the
/// next one is planned. With Slurm the array is followed by a job that gives this command again, until no wave is left;
/// a second job does so where a task or the first job has failed. With GNU parallel the command itself waits. The
/// command can be given again at any time: jobs that Slurm has already are not submitted twice.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the sweep
    dir: PathBuf,
    /// Scheduler
    #[arg(long, value_enum)]
    engine: Engine,
    /// Tasks that run at the same time [default: as many as the scheduler allows; of parallel one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    limit: Option<u64>,
    /// Tasks of the array at most [default: what Slurm's MaxArraySize allows]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    tasks: Option<u64>,
    /// Cores of a task: it runs so many shards at the same time [default: 1]
    #[arg(long, value_name = "N")]
    cores: Option<NonZeroUsize>,
    /// An option for every job, as in --option=--partition=long; of parallel, as in --option=--sshloginfile=nodes
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    option: Vec<String>,
    /// Submit the array alone: gather nothing, and submit no further wave
    #[arg(long)]
    one_wave: bool,
    /// Print the script, and submit nothing
    #[arg(long)]
    dry_run: bool,
    /// End the jobs of the sweep that Slurm has
    #[arg(long, conflicts_with_all = ["dry_run", "one_wave"])]
    cancel: bool,
    /// Wave and number of shards that were left when the array before was submitted; refuses to submit the same again
    #[arg(long, value_name = "WAVE:SHARDS", value_parser = since, hide = true)]
    since: Option<(usize, u64)>,
    /// Kill a command of Slurm that runs longer [default: 1800]
    #[arg(long, value_name = "SECONDS", value_parser = values::limit)]
    tool_timeout: Option<Duration>,
    #[command(flatten)]
    version: super::AnyVersion,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

fn since(text: &str) -> Result<(usize, u64), Failure> {
    let read = text.split_once(':').and_then(|(wave, left)| Some((wave.parse().ok()?, left.parse().ok()?)));
    values::value(read, "write two numbers, as in 1:20")
}

/// A scheduler.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Engine {
    /// Slurm: sbatch, with an array of tasks
    Slurm,
    /// GNU parallel, on this machine or by its own options on others
    Parallel,
}

impl Args {
    fn cores(&self) -> NonZeroUsize {
        self.cores.unwrap_or(NonZeroUsize::MIN)
    }

    /// Returns the options of a task beside its wave and its number.
    fn task_options<L>(&self) -> Script<L> {
        let cores = self.cores.map_or(Script::empty(), |cores| script!(L: " --cores {}", cores));
        [cores, self.any_version()].into_iter().collect()
    }

    fn any_version<L>(&self) -> Script<L> {
        if self.version.any_version { script!(L: " --any-version") } else { Script::empty() }
    }

    /// Returns the lines by which Slurm takes the options for every job.
    fn option_lines(&self) -> Result<Script<Shell>, Failure> {
        let line = |option: &String| {
            let option = Script::<Slurm>::option(option).map_err(|why| Failure::usage(format!("--option: {why}")))?;
            Ok(script!(Shell: "#SBATCH {}\n", option))
        };
        self.option.iter().map(line).collect()
    }

    /// Returns the time limit of a command of Slurm.
    fn limit_of_tools(&self) -> Duration {
        self.tool_timeout.unwrap_or(TIMEOUT)
    }
}

/// The usual MaxArraySize of Slurm, where scontrol does not tell another.
const MAX_ARRAY: u64 = 1001;

/// Runs `hpu sweep submit`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let dir = fs::canonicalize(&args.dir).map_err(|error| Failure::at(&args.dir, error))?;
    let planned = Planned::last(&dir)?;
    planned.accepts(args.version.any_version)?;
    if args.cancel {
        return cancel(&dir, args);
    }
    match args.engine {
        Engine::Slurm => slurm(args, planned),
        Engine::Parallel => parallel(args, planned),
    }
}

/// Gathers a wave that is done, and plans the next one; `None` if no wave is left.
fn advance(planned: &Planned, args: &Args) -> Result<Option<Planned>, Failure> {
    let how = super::How { again: false, partial: false, any_version: args.version.any_version };
    super::gather::gather(&planned.dir, how)?;
    Ok(plan::next(&planned.dir, plan::Size::default(), None)?.map(|(next, _)| next))
}

/// Returns this program in a script, with its options for every verb.
fn program() -> Result<Script<Shell>, Failure> {
    let own = Script::<Shell>::path(&program::starter()?).map_err(unwritable)?;
    let no_dut = if is_forbidden() { script!(Shell: " --no-dut") } else { Script::empty() };
    Ok(script!(Shell: "{} --quiet{}", own, no_dut))
}

/// Returns the failure of a folder that a script cannot name.
fn unwritable(why: Unwritable) -> Failure {
    Failure::usage(format!("{why}; rename the folder"))
}

/// A kind of job of a wave.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Job {
    /// The array of tasks.
    Tasks,
    /// The job that follows the array.
    Follower,
    /// The job that stands in where a task or the follower has failed.
    StandIn,
}

/// Returns the name of a job: by it, the job is found again. The same study in another folder has other names.
fn job_name(planned: &Planned, job: Job) -> String {
    let kind = match job {
        Job::Tasks => "tasks",
        Job::Follower => "follower",
        Job::StandIn => "stand-in",
    };
    format!("hpu-{}-{}-{kind}", planned.name(), planned.manifest.wave)
}

/// Returns the numbers of the jobs of these names that wait or run, without the job that this process is. A job that
/// was cancelled can stay in Slurm's queue for a while, so the states are asked for.
fn queued(names: &[String], limit: Duration) -> Result<Vec<String>, Failure> {
    let name = format!("--name={}", names.join(","));
    let asked = ["--noheader", "--format=%F", "--states=PENDING,CONFIGURING,RUNNING,SUSPENDED", &name];
    let own = std::env::var("SLURM_JOB_ID").unwrap_or_default();
    let said = needed("squeue", &asked.map(String::from), "", limit)?;
    let mut jobs: Vec<String> = said.split_whitespace().map(String::from).collect();
    jobs.retain(|job| *job != own);
    jobs.sort();
    jobs.dedup();
    Ok(jobs)
}

/// Returns the numbers of the tasks that have shards left, as Slurm writes them; of all tasks if no shard is left.
fn wanted(left: &[u64], tasks: u64) -> Script<Slurm> {
    let own: BTreeSet<u64> = left.iter().map(|shard| shard % tasks).collect();
    let own = if own.is_empty() { Points::all(tasks) } else { Points::of(own) };
    let run = |(index, (first, count)): (usize, &(u64, u64))| {
        let comma = if index == 0 { Script::empty() } else { script!(Slurm: ",") };
        match count {
            1 => script!(Slurm: "{}{}", comma, first),
            _ => script!(Slurm: "{}{}-{}", comma, first, first + count - 1),
        }
    };
    own.runs().iter().enumerate().map(run).collect()
}

/// Returns the first lines of the script of a job, whose log is in the sweep's folder.
fn job_lines(planned: &Planned, job: Job, more: &Script<Slurm>) -> Result<Script<Shell>, Failure> {
    let name = Script::<Slurm>::name(&job_name(planned, job)).map_err(unwritable)?;
    let log = Script::<Slurm>::file(&planned.dir, "slurm-%A.log").map_err(unwritable)?;
    Ok(script!(
        Shell: "#!/bin/sh\n#SBATCH --job-name={}\n{}#SBATCH --requeue\n#SBATCH --open-mode=append\n\
                #SBATCH --output={}\n",
        name,
        more,
        log
    ))
}

/// Returns the script of an array over a wave: each task runs every `tasks`-th shard. Tasks without shards are left
/// out.
fn array(args: &Args, planned: &Planned, left: &[u64], tasks: u64) -> Result<Script<Shell>, Failure> {
    let limit = args.limit.map_or(Script::empty(), |limit| script!(Slurm: "%{}", limit));
    let own = script!(
        Slurm: "#SBATCH --array={}{}\n#SBATCH --ntasks=1\n#SBATCH --cpus-per-task={}\n",
        wanted(left, tasks),
        limit,
        args.cores()
    );
    let task = script!(
        Shell: "exec {} sweep task {} --wave {} --index \"$SLURM_ARRAY_TASK_ID\" --of {}{}\n",
        program()?,
        Script::<Shell>::path(&planned.dir).map_err(unwritable)?,
        planned.manifest.wave,
        tasks,
        args.task_options::<Shell>()
    );
    Ok([job_lines(planned, Job::Tasks, &own)?, args.option_lines()?, task].into_iter().collect())
}

/// Returns the script of a job that goes on after an array: it gives this command again.
fn follower(args: &Args, planned: &Planned, left: u64, job: Job) -> Result<Script<Shell>, Failure> {
    let number = |name, number: Option<u64>| {
        number.map_or(Script::empty(), |number| script!(Shell: " --{} {}", Fixed(name), number))
    };
    let seconds = args.tool_timeout.map_or(
        Script::empty(),
        |limit| script!(Shell: " --tool-timeout {}", Script::<Shell>::word(&limit.as_secs_f64().to_string())),
    );
    let cores = args.cores.map(|cores| cores.get() as u64);
    let options = args.option.iter().map(|option| script!(Shell: " --option={}", Script::<Shell>::word(option)));
    let own = [args.any_version(), number("limit", args.limit), number("tasks", args.tasks), number("cores", cores)];
    let again: Script<Shell> = own.into_iter().chain([seconds]).chain(options).collect();
    let submit = script!(
        Shell: "exec {} sweep submit {} --engine slurm{} --since {}:{}\n",
        program()?,
        Script::<Shell>::path(&planned.dir).map_err(unwritable)?,
        again,
        planned.manifest.wave,
        left
    );
    let lines = job_lines(planned, job, &script!(Slurm: "#SBATCH --ntasks=1\n"))?;
    Ok([lines, args.option_lines()?, submit].into_iter().collect())
}

/// Submits the jobs of the last wave that Slurm does not have yet. The command can begin with each of its steps, so
/// that a process that was killed between two of them leaves the rest to the next one.
fn slurm(args: &Args, mut planned: Planned) -> Result<Exit, Failure> {
    let mut page = Page::default();
    let mut left = progress(&planned).left;
    while left.is_empty() && !args.dry_run {
        let next = if args.one_wave { None } else { advance(&planned, args)? };
        let Some(next) = next else {
            let what = if args.one_wave { "all shards of the last wave are done" } else { "the sweep is complete" };
            page.fact("tasks", "tasks", 0, format!("none: {what}"));
            show(&page, args.json)?;
            return Ok(Exit::Fine);
        };
        (left, planned) = (progress(&next).left, next);
    }
    let shards = left.len() as u64;
    let limit = args.limit_of_tools();
    let most = args.tasks.unwrap_or_else(|| max_array(limit).unwrap_or(MAX_ARRAY));
    let tasks = planned.manifest.shards().min(most).max(1);
    let array = array(args, &planned, &left, tasks)?;
    let [follower, stand_in] = [Job::Follower, Job::StandIn].map(|job| follower(args, &planned, shards, job));
    let (follower, stand_in) = (follower?, stand_in?);
    if args.dry_run {
        let rest = if args.one_wave {
            String::new()
        } else {
            format!(
                "\n# then, with --dependency=afterok of the array:\n{follower}\n# and the same after a failure of it\n"
            )
        };
        print_file(&format!("{array}{rest}"))?;
        return Ok(Exit::Fine);
    }
    let known = |job| Ok::<_, Failure>(queued(&[job_name(&planned, job)], limit)?.into_iter().next());
    let job = match known(Job::Tasks)? {
        Some(job) => {
            page.fact("array", "array", job.as_str(), format!("job {job}, which Slurm has already"));
            job
        }
        None if args.since.is_some_and(|(wave, before)| wave == planned.manifest.wave && shards >= before) => {
            return Err(Failure::file(format!(
                "the array of wave {} has ended and has finished no shard; its tasks say why in {}/slurm-*.log",
                planned.manifest.wave,
                planned.dir.display()
            )));
        }
        None => {
            let job = sbatch(&array, &[], limit)?;
            page.fact("array", "array", job.as_str(), format!("job {job}, {shards} shards in at most {tasks} tasks"));
            page.data("tasks", tasks);
            job
        }
    };
    page.data("shards", shards);
    if !args.one_wave {
        // A job whose dependency cannot come true any more is to leave the queue.
        let after = |kind: &str, job: &str| [format!("--dependency={kind}:{job}"), "--kill-on-invalid-dep=yes".into()];
        let follower = match known(Job::Follower)? {
            Some(job) => job,
            None => sbatch(&follower, &after("afterok", &job), limit)?,
        };
        if known(Job::StandIn)?.is_none() {
            sbatch(&stand_in, &after("afternotok", &follower), limit)?;
        }
        let said = format!("job {follower} gathers and submits the next wave");
        page.fact("follower", "then", follower.as_str(), said);
    }
    let dir = quoted(&planned.dir.display().to_string());
    page.line("progress", format!("hpu sweep status {dir}"));
    page.line("cancel", format!("hpu sweep submit {dir} --engine slurm --cancel"));
    show(&page, args.json)?;
    Ok(Exit::Fine)
}

/// Runs a command of Slurm; `None` if it is missing.
fn tool(name: &str, arguments: &[String], input: &str, limit: Duration) -> Result<Option<(bool, String)>, Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::file(format!("{name}: {error}"));
    // The input is a file, so that a command which does not read it is not waited for.
    let folder = Temporary::folder().map_err(|error| failed(&error))?;
    let place = folder.path().join("input");
    let input = fs::write(&place, input).and_then(|()| File::open(&place)).map_err(|error| failed(&error))?;
    let mut command = Command::new(name);
    command.args(arguments);
    let (said, ended) = output(&AtomicBool::new(false), command, Stdio::from(input), limit);
    match ended {
        Ok(status) => {
            let text = if status.success() { &said.out } else { &said.err };
            Ok(Some((status.success(), text.trim().to_string())))
        }
        Err(Fault::Missing) => Ok(None),
        Err(Fault::Stopped) => Err(Failure::interrupted()),
        Err(Fault::TooLong(limit)) => {
            Err(failed(&format!("killed: no end after {} s (--tool-timeout)", limit.as_secs_f64())))
        }
        Err(Fault::NotStarted(error)) => Err(failed(&error)),
        Err(fault) => Err(failed(&format!("{fault:?}"))),
    }
}

fn needed(name: &str, arguments: &[String], input: &str, limit: Duration) -> Result<String, Failure> {
    match tool(name, arguments, input, limit)? {
        None => Err(Failure::new(Exit::NoTool, format!("{name} is missing: Slurm's commands must be in the PATH"))),
        Some((true, said)) => Ok(said),
        Some((false, said)) => Err(Failure::file(format!("{name}: {said}"))),
    }
}

/// Submits a script, and returns the number of its job.
fn sbatch(script: &Script<Shell>, options: &[String], limit: Duration) -> Result<String, Failure> {
    let said = needed("sbatch", &[&["--parsable".to_string()], options].concat(), script.as_str(), limit)?;
    // A cluster's name may follow.
    Ok(said.split(';').next().unwrap_or_default().to_string())
}

/// Returns the greatest number of tasks of an array, as Slurm is configured.
fn max_array(limit: Duration) -> Option<u64> {
    let (_, said) = tool("scontrol", &["show".into(), "config".into()], "", limit).ok()??;
    let line = said.lines().find(|line| line.trim_start().starts_with("MaxArraySize"))?;
    line.split('=').nth(1)?.trim().parse().ok().filter(|most| *most > 0)
}

fn cancel(dir: &Path, args: &Args) -> Result<Exit, Failure> {
    if args.engine != Engine::Slurm {
        return Err(Failure::usage("--cancel is for Slurm; GNU parallel ends with its own process"));
    }
    let waves = Planned::waves(dir)?;
    // Jobs that submit others end first: one of them may follow from the end of an array.
    for kinds in [&[Job::StandIn, Job::Follower][..], &[Job::Tasks]] {
        let names = waves.iter().flat_map(|wave| kinds.iter().map(|kind| job_name(wave, *kind)));
        let jobs = queued(&names.collect::<Vec<_>>(), args.limit_of_tools())?;
        if !jobs.is_empty() {
            needed("scancel", &jobs, "", args.limit_of_tools())?;
        }
    }
    status::run(dir, args.json)
}

/// Runs waves by GNU parallel, one after the other.
fn parallel(args: &Args, mut planned: Planned) -> Result<Exit, Failure> {
    loop {
        let jobs = args.limit.map_or(Script::empty(), |limit| script!(Shell: "--jobs {} ", limit));
        let option = |option: &String| script!(Shell: "{} ", Script::<Shell>::word(option));
        let options: Script<Shell> = args.option.iter().map(option).collect();
        let dir = Script::<Shell>::path(&planned.dir).map_err(unwritable)?;
        let shards = planned.manifest.shards();
        let line = script!(
            Parallel: "{} sweep task {} --wave {} --index {{}} --of {}{}",
            Script::<Parallel>::word(&program()?),
            Script::<Parallel>::word(&dir),
            planned.manifest.wave,
            shards,
            args.task_options::<Parallel>()
        );
        let (last, line) = (shards.saturating_sub(1), Script::<Shell>::template(&line));
        let script = script!(Shell: "seq 0 {} | parallel {}{}{}", last, jobs, options, line);
        if args.dry_run {
            print_file(&format!("#!/bin/sh\n{script}\n"))?;
            return Ok(Exit::Fine);
        }
        if !progress(&planned).left.is_empty() {
            let mut shell = Command::new("sh");
            shell.args(["-c", script.as_str()]).stdin(Stdio::null()).stdout(Stdio::null());
            // GNU parallel's jobs are in groups of their own.
            let child = Group::with_jobs(&mut shell);
            let mut child = child.map_err(|fault| Failure::file(format!("sh cannot be started: {fault:?}")))?;
            let Some(status) = waited(&mut child)? else { return Err(Failure::interrupted()) };
            if status.code() == Some(127) {
                return Err(Failure::new(
                    Exit::NoTool,
                    "GNU parallel is missing; install it: sudo apt-get install parallel",
                ));
            }
            if !status.success() {
                return Err(Failure::file("parallel: some shards are not done; the same command goes on"));
            }
        }
        if args.one_wave {
            return status::run(&planned.dir, args.json);
        }
        let Some(next) = advance(&planned, args)? else {
            return status::run(&planned.dir, args.json);
        };
        planned = next;
    }
}

/// Runs a task: every `of`-th shard from `index` on, `jobs` at a time.
pub fn task(
    dir: &Path,
    wave: usize,
    (index, of): (u64, u64),
    jobs: NonZeroUsize,
    any_version: bool,
) -> Result<Exit, Failure> {
    let planned = planned(dir, Some(wave))?;
    interrupt::heed();
    let wanted = progress(&planned).left.into_iter().filter(|shard| shard % of == index).collect();
    shards(&planned, wanted, jobs, any_version)?;
    Ok(Exit::Fine)
}
