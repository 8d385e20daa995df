#include <algorithm>
#include <exception>
#include <filesystem>
#include <iostream>

#include "apps/lab/experiments/report.hpp"
#include "apps/lab/experiments/run_inputs.hpp"
#include "apps/lab/experiments/run_steps.hpp"
#include "apps/lab/experiments/step_record.hpp"
#include "apps/program_folder.hpp"
#include "apps/program_options.hpp"
#include "modules/core/text_table.hpp"

namespace {

namespace fs = std::filesystem;

constexpr const char* kAbout =
    "The experiments of the Kimera-Multi paper: makes their inputs, runs the robots and the\n"
    "optimisers, and writes every table and figure beside the paper's.\n\n"
    "An experiment is a list of steps, each a command of another program of this system; `list`\n"
    "shows them. A step is done once: its result is kept with the command, the time, the machine\n"
    "and the commit, and made again only if its command or its inputs change. Ctrl-C keeps\n"
    "finished steps; the same command continues. Recordings and results of teams that are in "
    "--data already\n"
    "are used as they are.\n\n"
    "Configuration: config/experiments/*.yaml (worlds, seeds, methods). --data, --graphs, "
    "--euroc,\n"
    "--config and --quick are kept with the results: `list`, `report` and later runs\n"
    "need only --results; options given there override them.\n"
    "Exit code: 0 if all is done, 1 for input that cannot be used, 3 if a step failed or lacks\n"
    "something, 130 if it was stopped.\n\n"
    "Examples:\n"
    "  kimera_multi_experiments list\n"
    "  kimera_multi_experiments run all --quick               # small, minutes on two cores\n"
    "  kimera_multi_experiments run pcm --graphs ~/graphs     # manhattan.g2o is there\n"
    "  kimera_multi_experiments run cosmo --graphs ~/cosmo    # COSMO-Bench's *.jrl are there\n"
    "  kimera_multi_experiments run trajectory --euroc ~/euroc\n"
    "  kimera_multi_experiments report\n\n"
    "--euroc DIR is for the Vicon rooms: for V1_01 to V2_03 either the original folders, whose\n"
    "images are then used, or only their true poses and inertial data (CSV, perhaps gzipped), on\n"
    "which rooms are rendered.";

constexpr const char* kData = "experiments_data";
constexpr const char* kResults = "experiments_results";

struct Options {
  fs::path data, results, graphs, euroc, config;
  fs::path programs = km::program_folder();
  std::vector<std::string> names;
  bool quick = false, again = false;
};

std::vector<std::string> all_names() {
  std::vector<std::string> names;
  for (const km::ExperimentName& experiment : km::kExperiments) names.emplace_back(experiment.name);
  return names;
}

void define(CLI::App& app, Options& options) {
  app.footer(
      "Keys of a world in worlds.yaml, paths relative to it; those below quick: replace them "
      "with --quick:\n" +
      km::world_keys());
  app.add_option("--data", options.data,
                 "Recordings, and the results of teams on them (default: experiments_data)");
  app.add_option("--results", options.results,
                 "Numbers, logs and the report (default: experiments_results)");
  app.add_option("--graphs", options.graphs, "Recorded pose graphs (default: the folder of --data)")
      ->check(CLI::ExistingDirectory);
  app.add_option("--euroc", options.euroc, "EuRoC's recordings, see above")
      ->check(CLI::ExistingDirectory);
  app.add_option("--config", options.config, "Folder of the experiments' configuration")
      ->check(CLI::ExistingDirectory);
  app.add_option("--programs", options.programs,
                 "Folder of the other programs (default: this one's)")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--quick", options.quick,
               "Small versions of all: other data and results, in quick/ below the folders");
}

fs::path shipped_config() {
  const fs::path program = km::program_folder();
  for (const fs::path& place :
       {fs::path("config/experiments"), program / "../../config/experiments",
        program / "../share/kimera_multi/experiments"})
    if (fs::is_directory(place)) return place.lexically_normal();
  throw std::runtime_error("no config/experiments here or near the program; give --config");
}

// Options of the run: from the command line, otherwise from the inputs stored with the results.
struct Setup {
  km::ExperimentPaths paths;
  fs::path config;
  bool quick = false;
};

Setup setup_of(const Options& options, bool is_run) {
  Setup setup{.paths = {}, .config = {}, .quick = options.quick};
  km::ExperimentPaths& paths = setup.paths;
  const auto below = [&](const fs::path& folder) {
    return setup.quick ? folder / "quick" : folder;
  };
  paths.results = options.results.empty() ? below(kResults) : options.results;
  const km::RunInputs kept = km::read_run_inputs(paths.results).value_or(km::RunInputs{});
  // A named folder holds results of one kind: a full run would replace those of the quick one.
  if (!is_run || !options.results.empty()) setup.quick = setup.quick || kept.quick;
  const auto first = [](const fs::path& given, const fs::path& then) {
    return given.empty() ? then : given;
  };
  const fs::path data = first(options.data, kData);
  paths.data = options.data.empty() && kept.quick == setup.quick && !kept.data.empty()
                   ? kept.data
                   : below(data);
  paths.graphs = first(options.graphs, first(kept.graphs, data));
  paths.euroc = first(options.euroc, kept.euroc);
  paths.programs = options.programs;
  setup.config = first(options.config, kept.config);
  if (setup.config.empty()) setup.config = shipped_config();
  return setup;
}

void keep(const Options& options, const Setup& setup) {
  const km::RunInputs before = km::read_run_inputs(setup.paths.results).value_or(km::RunInputs{});
  km::write_run_inputs(setup.paths.results,
                       {.data = setup.paths.data,
                        .graphs = setup.paths.graphs,
                        .euroc = setup.paths.euroc,
                        .config = options.config.empty() ? before.config : options.config,
                        .quick = setup.quick});
}

std::vector<std::string> chosen(const Options& options) {
  const auto all = std::find(options.names.begin(), options.names.end(), "all");
  return all == options.names.end() && !options.names.empty() ? options.names : all_names();
}

// Some of the paths may come from an earlier run.
void print(const km::ExperimentPaths& paths) {
  std::cout << "data: " << paths.data.string() << ", graphs: " << paths.graphs.string();
  if (!paths.euroc.empty()) std::cout << ", euroc: " << paths.euroc.string();
  std::cout << ", results: " << paths.results.string() << std::endl;
}

void list(const km::ExperimentConfig& config, const km::ExperimentPaths& paths) {
  for (const km::ExperimentName& experiment : km::kExperiments) {
    std::cout << experiment.name << ": " << experiment.about << '\n';
    std::vector<std::vector<std::string>> rows{{"  step", "state", "last took"}};
    std::string missing;
    for (const km::Step& step : km::plan_experiment(experiment.name, config, paths)) {
      const km::StepState state = km::state_of(step, paths.results);
      const auto record = km::read_record(paths.results, step.name);
      rows.push_back(
          {"  " + step.name, km::to_string(state),
           record && record->seconds > 0.0 ? km::fixed(record->seconds, 1) + " s" : "-"});
      if (state == km::StepState::kMissing)
        missing += "  " + step.name + ": " + step.missing + '\n';
    }
    std::cout << km::align_columns(rows) << missing << '\n';
  }
  print(paths);
}

void print(const km::ReportSummary& summary) {
  std::cout << "report: " << summary.html.string() << " and " << summary.markdown.string();
  if (summary.targets > 0)
    std::cout << "; " << summary.met << " of " << summary.targets << " numbers to reach are met";
  std::cout << '\n';
}

int run(const Options& options, const Setup& setup, const km::ExperimentConfig& config) {
  const auto before = km::read_run_inputs(setup.paths.results);
  keep(options, setup);
  print(setup.paths);
  km::SignalWatch signals;
  const std::vector<km::Step> steps = km::plan_experiments(chosen(options), config, setup.paths);
  km::StepDisplay display = km::StepDisplay::standard_output();
  const km::StepsOutcome outcome =
      km::run_steps(steps, setup.paths.results, options.again, signals, display);
  std::cout << outcome.made << " steps made, " << outcome.kept << " were done before\n";
  for (const std::string& problem : outcome.problems) std::cerr << problem << '\n';
  // Results and their report keep the inputs that they were made from, until a run makes others.
  const bool fruitless = outcome.made == 0 && !outcome.problems.empty();
  if (before && fruitless && before != km::read_run_inputs(setup.paths.results)) {
    km::write_run_inputs(setup.paths.results, *before);
    std::cout << "nothing was made: the results, their report and their folders stay\n";
  } else {
    print(km::write_report(config, setup.paths));
  }
  if (outcome.stopped) return 130;
  return outcome.problems.empty() ? 0 : 3;
}

// An existing report stays if there are no results for a new one.
void report(const km::ExperimentConfig& config, const km::ExperimentPaths& paths) {
  const std::vector<km::Step> steps = km::plan_experiments(all_names(), config, paths);
  const bool any = std::any_of(steps.begin(), steps.end(), [&](const km::Step& step) {
    return km::state_of(step, paths.results) == km::StepState::kDone;
  });
  if (!any)
    throw std::runtime_error(
        "nothing to report: " + paths.results.string() +
        " has no result of these experiments; `run` makes them, `list` shows what there is, "
        "--results and --quick select the folder");
  print(km::write_report(config, paths));
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout, "kimera_multi_experiments");
  Options options;
  define(app, options);
  app.require_subcommand(1);
  app.fallthrough();
  const CLI::App& list_command =
      *app.add_subcommand("list", "Shows the experiments, their steps, and what is done");
  CLI::App& run_command = *app.add_subcommand("run", "Does what is not done yet, then reports");
  std::vector<std::string> names = all_names();
  names.emplace_back("all");
  run_command
      .add_option("NAME", options.names,
                  "pcm, cosmo, trajectory, resources, mesh, semantics, levels, or all")
      ->required()
      ->check(CLI::IsMember(names));
  run_command.add_flag("--again", options.again, "Also what is done");
  app.add_subcommand("report", "Writes report.html and report.md of what there is");
  if (const auto exit_code = km::parse_options(app, argc, argv, 1)) return *exit_code;
  const Setup setup = setup_of(options, run_command.parsed());
  const km::ExperimentConfig config = km::read_experiments(setup.config, setup.quick);
  if (list_command.parsed())
    list(config, setup.paths);
  else if (run_command.parsed())
    return run(options, setup, config);
  else
    report(config, setup.paths);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_experiments: " << error.what() << '\n';
  return 1;
}
