//! What each call of the command does.

/// Prints a line. A reader that has gone away (`| head`) ends the program instead of making it panic.
macro_rules! say {
    ($($line:tt)*) => {
        if std::io::Write::write_fmt(&mut std::io::stdout(), format_args!("{}\n", format_args!($($line)*))).is_err() {
            std::process::exit(0);
        }
    };
}

pub(crate) mod arguments;
mod check;
mod cut;
mod log;
mod modes;
mod quality;
mod run;
mod study;

use std::path::{Path, PathBuf};
use std::time::Duration;

use arguments::bad;
use clap::{Parser, Subcommand};
use kerfem_engine::{EngineError, MethodName};
use kerfem_mesh::io::MeshData;
use kerfem_mesh::{TetMesh, TriMesh};

/// Deformable solids that can be cut.
#[derive(Parser)]
#[command(
    name = "kerfem",
    version,
    disable_help_subcommand = true,
    arg_required_else_help = false
)]
pub(crate) struct Command {
    /// Tell on standard error what is done: -v the stages, -vv each step, -vvv each solve (KERFEM_LOG chooses by module)
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Steps a scene, cuts it, writes VTK files and a report
    Run(RunArguments),
    /// Reads and checks a scene and its mesh; runs nothing
    Check {
        /// The scene
        scene: PathBuf,
    },
    /// Counts, volume, quality of the cells and their histograms
    Quality {
        /// A mesh of tetrahedra or triangles (.vtu, .vtp, .vtk, .msh, .mesh, .node, .ele)
        mesh: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Cuts a mesh; geometry only
    Cut(CutArguments),
    /// Natural frequencies and modes of a scene at rest, after the cuts that come first
    Modes(ModesArguments),
    /// Runs a grid of settings of a scene; charts accuracy against time. The same call goes on after an interruption
    Study(StudyArguments),
    /// Runs the validation cases: a table of errors and orders; exit 1 if one misses
    Validate(ValidateArguments),
}

#[derive(clap::Args)]
struct RunArguments {
    /// The scene
    scene: PathBuf,
    /// Folder of the results [default: out/NAME]
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Threads, at most 1024 [default: one a core]
    #[arg(long, value_parser = arguments::threads, allow_hyphen_values = true)]
    threads: Option<usize>,
    /// Check every invariant after each cut; exit 1 if one breaks
    #[arg(long)]
    verify: bool,
    /// Write the matrices at the end, in Matrix Market files
    #[arg(long)]
    export_system: bool,
    /// Stop at this time (s)
    #[arg(long, value_name = "S", value_parser = arguments::time, allow_hyphen_values = true)]
    until: Option<f64>,
    /// Go on from the save in the folder of the results; time, solver, output and quantity of the scene may have changed
    #[arg(long)]
    resume: bool,
    /// Seconds by the clock between saves; 0: after each step. The last state is always saved
    #[arg(long, value_name = "S", default_value = "60", value_parser = arguments::seconds, allow_hyphen_values = true)]
    save_every: Duration,
    /// No progress bar
    #[arg(long)]
    quiet: bool,
}

#[derive(clap::Args)]
struct ModesArguments {
    /// The scene
    scene: PathBuf,
    /// How many, the lowest first, 1 to 1000; motions without strain are counted apart
    #[arg(long, default_value = "10", value_name = "N", value_parser = arguments::count, allow_hyphen_values = true)]
    count: usize,
    /// Folder of the results [default: out/NAME]
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Threads, at most 1024 [default: one a core]
    #[arg(long, value_parser = arguments::threads, allow_hyphen_values = true)]
    threads: Option<usize>,
    /// Print nothing
    #[arg(long)]
    quiet: bool,
}

#[derive(clap::Args)]
struct StudyArguments {
    /// The study
    study: PathBuf,
    /// Folder of the results [default: out/NAME]
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Runs at a time, of one thread each, at most 1024; times are measured best one at a time
    #[arg(long, value_name = "N", default_value = "1", value_parser = arguments::threads, allow_hyphen_values = true)]
    parallel: usize,
    /// Threads of a run, at most 1024 [default: one a core]
    #[arg(long, value_parser = arguments::threads, allow_hyphen_values = true)]
    threads: Option<usize>,
    /// No progress bar, no closing lines
    #[arg(long)]
    quiet: bool,
}

#[derive(clap::Args)]
struct ValidateArguments {
    /// Cases by name; all if none is given
    case: Vec<String>,
    /// Folder of the results
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Folder of the cases, *.study.toml [default: validation/cases]
    #[arg(long, value_name = "DIR")]
    cases: Option<PathBuf>,
    /// Threads, at most 1024 [default: one a core]
    #[arg(long, value_parser = arguments::threads, allow_hyphen_values = true)]
    threads: Option<usize>,
    /// Print nothing
    #[arg(long)]
    quiet: bool,
}

#[derive(clap::Args)]
struct CutArguments {
    /// A mesh of tetrahedra, or of triangles with z = 0 (.vtu, .vtp, .vtk, .msh, .mesh, .node, .ele)
    mesh: PathBuf,
    /// A triangulated surface, for triangles line segments (.obj, .stl, .vtu, .vtp, .vtk)
    #[arg(long)]
    sweep: PathBuf,
    /// How the mesh is made to follow the sweep: delete, subdivide, snap, hybrid, collapse or merge
    #[arg(long, default_value = "hybrid", value_parser = arguments::method)]
    method: MethodName,
    /// Snapping distance as a fraction of the local mean edge, 0 to 0.45
    #[arg(long, default_value_t = 0.2, value_parser = arguments::snap, allow_hyphen_values = true)]
    snap: f64,
    /// Whether cells that come out badly are improved, true or false (default: true for hybrid, collapse and merge)
    #[arg(long, value_parser = clap::value_parser!(bool))]
    improve: Option<bool>,
    /// Relax vertices around those that were moved onto the sweep
    #[arg(long)]
    relax: bool,
    /// Radius ratio below which a cell counts as bad, 0 to 0.7
    #[arg(long, default_value_t = 0.3, value_parser = arguments::quality, allow_hyphen_values = true)]
    quality: f64,
    /// How many operations may be made to improve cells (default: no limit)
    #[arg(long)]
    operations: Option<usize>,
    /// Where to write the cut mesh (.vtu, of triangles also .vtp)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Command {
    /// Does what was asked for; the exit code.
    pub(crate) fn execute(self) -> Result<u8, EngineError> {
        log::start(self.verbose)?;
        match self.action {
            Action::Run(arguments) => run::run(&arguments, self.verbose > 0),
            Action::Check { scene } => check::check(&scene),
            Action::Quality { mesh, json } => quality::quality(&mesh, json),
            Action::Cut(arguments) => cut::cut(&arguments),
            Action::Modes(arguments) => modes::modes(&arguments),
            Action::Study(arguments) => study::study(&arguments),
            Action::Validate(arguments) => study::validate_cases(&arguments),
        }
    }
}

/// A mesh from a file: its tetrahedra, or, if it has none, its triangles.
enum MeshFile {
    Tets(TetMesh),
    Triangles(TriMesh),
}

impl MeshFile {
    fn read(path: &Path) -> Result<Self, EngineError> {
        Self::of(path, kerfem_mesh::io::read_mesh(path).map_err(EngineError::Read)?)
    }

    /// The mesh in the data of a file.
    fn of(path: &Path, data: MeshData) -> Result<Self, EngineError> {
        let mesh = if !data.tets.is_empty() {
            data.into_tet_mesh().map(MeshFile::Tets)
        } else if data.triangles.is_empty() {
            let message = "the file has neither tetrahedra nor triangles";
            return Err(bad(path.display().to_string(), message));
        } else if data.points.iter().all(|p| p.z == 0.0) {
            TriMesh::planar(data.points, data.triangles).map(MeshFile::Triangles)
        } else {
            data.into_tri_mesh().map(MeshFile::Triangles)
        };
        mesh.map_err(|e| bad(path.display().to_string(), e.to_string()))
    }
}
