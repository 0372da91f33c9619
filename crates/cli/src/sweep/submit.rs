//! Schedulers: the shards of a wave as an array of Slurm, or as lines for GNU parallel.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use hpu_study::page::Page;
use hpu_study::sweep::Points;

use super::local::shards;
use super::manifest::Planned;
use super::status::progress;
use super::{plan, status};
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::page::show;
use crate::scene::quoted;
use crate::terminal::print_file;

/// Hand the shards that are not done to a scheduler
///
/// A task runs some shards one after the other, each in a process of its own. A wave that is done is gathered, and the
/// next one is planned. With Slurm the array is followed by a job that gives this command again, until no wave is left;
/// a second job does so where a task or the first job has failed. With GNU parallel the command itself waits. The
/// command can be given again at any time: jobs that Slurm has already are not submitted twice.
#[derive(clap::Args)]
pub struct Args {
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
    #[command(flatten)]
    version: super::AnyVersion,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

fn since(text: &str) -> Result<(usize, u64), String> {
    let read = text.split_once(':').and_then(|(wave, left)| Some((wave.parse().ok()?, left.parse().ok()?)));
    read.ok_or_else(|| "write two numbers, as in 1:20".into())
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
    fn task_options(&self) -> String {
        let cores = self.cores.map_or(String::new(), |cores| format!(" --cores {cores}"));
        cores + if self.version.any_version { " --any-version" } else { "" }
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

fn program() -> Result<String, Failure> {
    let own = std::env::current_exe().map_err(|error| Failure::file(format!("this program: {error}")))?;
    Ok(quoted(&own.display().to_string()))
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
fn queued(names: &[String]) -> Result<Vec<String>, Failure> {
    let name = format!("--name={}", names.join(","));
    let asked = ["--noheader", "--format=%F", "--states=PENDING,CONFIGURING,RUNNING,SUSPENDED", &name];
    let own = std::env::var("SLURM_JOB_ID").unwrap_or_default();
    let said = needed("squeue", &asked.map(String::from), "")?;
    let mut jobs: Vec<String> = said.split_whitespace().map(String::from).collect();
    jobs.retain(|job| *job != own);
    jobs.sort();
    jobs.dedup();
    Ok(jobs)
}

/// Returns the numbers of the tasks that have shards left, as Slurm writes them; of all tasks if no shard is left.
fn wanted(left: &[u64], tasks: u64) -> String {
    let own: BTreeSet<u64> = left.iter().map(|shard| shard % tasks).collect();
    let own = if own.is_empty() { Points::all(tasks) } else { Points::of(own) };
    let run = |(first, count): &(u64, u64)| match count {
        1 => first.to_string(),
        _ => format!("{first}-{}", first + count - 1),
    };
    own.runs().iter().map(run).collect::<Vec<_>>().join(",")
}

/// Returns the script of an array over a wave: each task runs every `tasks`-th shard. Tasks without shards are left
/// out.
fn array(args: &Args, planned: &Planned, left: &[u64], tasks: u64) -> Result<String, Failure> {
    let dir = quoted(&planned.dir.display().to_string());
    let limit = args.limit.map_or(String::new(), |limit| format!("%{limit}"));
    let mut script = format!(
        "#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH --array={}{limit}\n#SBATCH --ntasks=1\n#SBATCH --cpus-per-task={}\n\
         #SBATCH --requeue\n#SBATCH --open-mode=append\n#SBATCH --output={dir}/slurm-%A.log\n",
        job_name(planned, Job::Tasks),
        wanted(left, tasks),
        args.cores(),
    );
    script.extend(args.option.iter().map(|option| format!("#SBATCH {option}\n")));
    let more = args.task_options();
    script += &format!(
        "exec {} --quiet sweep task {dir} --wave {} --index \"$SLURM_ARRAY_TASK_ID\" --of {tasks}{more}\n",
        program()?,
        planned.manifest.wave
    );
    Ok(script)
}

/// Returns the script of a job that goes on after an array: it gives this command again.
fn follower(args: &Args, planned: &Planned, left: u64, job: Job) -> Result<String, Failure> {
    let (program, dir) = (program()?, quoted(&planned.dir.display().to_string()));
    let mut script = format!(
        "#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH --ntasks=1\n#SBATCH --requeue\n#SBATCH --open-mode=append\n\
         #SBATCH --output={dir}/slurm-%A.log\n",
        job_name(planned, job)
    );
    script.extend(args.option.iter().map(|option| format!("#SBATCH {option}\n")));
    let any = if args.version.any_version { " --any-version" } else { "" };
    let mut again = format!("--engine slurm{any}");
    again += &args.limit.map_or(String::new(), |limit| format!(" --limit {limit}"));
    again += &args.tasks.map_or(String::new(), |tasks| format!(" --tasks {tasks}"));
    again += &args.cores.map_or(String::new(), |cores| format!(" --cores {cores}"));
    again.extend(args.option.iter().map(|option| format!(" --option={}", quoted(option))));
    let wave = planned.manifest.wave;
    script += &format!("exec {program} --quiet sweep submit {dir} {again} --since {wave}:{left}\n");
    Ok(script)
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
    let most = args.tasks.unwrap_or_else(|| max_array().unwrap_or(MAX_ARRAY));
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
    let known = |job| Ok::<_, Failure>(queued(&[job_name(&planned, job)])?.into_iter().next());
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
            let job = sbatch(&array, &[])?;
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
            None => sbatch(&follower, &after("afterok", &job))?,
        };
        if known(Job::StandIn)?.is_none() {
            sbatch(&stand_in, &after("afternotok", &follower))?;
        }
        let said = format!("job {follower} gathers and submits the next wave");
        page.fact("follower", "then", follower.as_str(), said);
    }
    page.line("progress", format!("hpu sweep status {}", planned.dir.display()));
    page.line("cancel", format!("hpu sweep submit {} --engine slurm --cancel", planned.dir.display()));
    show(&page, args.json)?;
    Ok(Exit::Fine)
}

/// Runs a tool; `None` if it is missing.
fn tool(name: &str, arguments: &[String], input: &str) -> Result<Option<(bool, String)>, Failure> {
    let mut command = Command::new(name);
    let child = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = match child {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        child => child.map_err(|error| Failure::file(format!("{name}: {error}")))?,
    };
    // A tool that reads no input has none to miss.
    let _ = child.stdin.take().expect("it is piped").write_all(input.as_bytes());
    let output = child.wait_with_output().map_err(|error| Failure::file(format!("{name}: {error}")))?;
    let text = if output.status.success() { &output.stdout } else { &output.stderr };
    Ok(Some((output.status.success(), String::from_utf8_lossy(text).trim().to_string())))
}

fn needed(name: &str, arguments: &[String], input: &str) -> Result<String, Failure> {
    match tool(name, arguments, input)? {
        None => Err(Failure::new(Exit::NoTool, format!("{name} is missing: Slurm's commands must be in the PATH"))),
        Some((true, said)) => Ok(said),
        Some((false, said)) => Err(Failure::file(format!("{name}: {said}"))),
    }
}

/// Submits a script, and returns the number of its job.
fn sbatch(script: &str, options: &[String]) -> Result<String, Failure> {
    let said = needed("sbatch", &[&["--parsable".to_string()], options].concat(), script)?;
    // A cluster's name may follow.
    Ok(said.split(';').next().unwrap_or_default().to_string())
}

/// Returns the greatest number of tasks of an array, as Slurm is configured.
fn max_array() -> Option<u64> {
    let (_, said) = tool("scontrol", &["show".into(), "config".into()], "").ok()??;
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
        let jobs = queued(&names.collect::<Vec<_>>())?;
        if !jobs.is_empty() {
            needed("scancel", &jobs, "")?;
        }
    }
    status::run(dir, args.json)
}

/// Runs waves by GNU parallel, one after the other.
fn parallel(args: &Args, mut planned: Planned) -> Result<Exit, Failure> {
    loop {
        let jobs = args.limit.map_or(String::new(), |limit| format!("--jobs {limit} "));
        let options: String = args.option.iter().map(|option| format!("{} ", quoted(option))).collect();
        let more = args.task_options();
        let (program, dir) = (program()?, quoted(&planned.dir.display().to_string()));
        let (wave, shards) = (planned.manifest.wave, planned.manifest.shards());
        let line = format!("{program} --quiet sweep task {dir} --wave {wave} --index {{}} --of {shards}{more}");
        let script = format!("seq 0 {} | parallel {jobs}{options}{}", shards.saturating_sub(1), quoted(&line));
        if args.dry_run {
            print_file(&format!("#!/bin/sh\n{script}\n"))?;
            return Ok(Exit::Fine);
        }
        if !progress(&planned).left.is_empty() {
            let mut child = Command::new("sh").args(["-c", &script]).stdin(Stdio::null()).stdout(Stdio::null()).spawn();
            let status = child.as_mut().map_err(|error| Failure::file(format!("sh: {error}")))?.wait();
            let status = status.map_err(|error| Failure::file(format!("sh: {error}")))?;
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
    let planned = Planned::read(dir, wave)?;
    let planned = planned.ok_or_else(|| Failure::usage(format!("{} has no wave {wave}", dir.display())))?;
    interrupt::heed();
    let wanted = progress(&planned).left.into_iter().filter(|shard| shard % of == index).collect();
    shards(&planned, wanted, jobs, any_version)?;
    Ok(Exit::Fine)
}
