#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <filesystem>
#include <string>

#include "apps/report_files.hpp"
#include "modules/pgo_study/team_graph_file.hpp"

namespace km {

/// Add a subcommand of kimera_multi_pgo to `app`, which runs as soon as the command line names it.
/// Input that cannot be used throws a std::exception that says why.
void add_solve(CLI::App& app);
void add_pcm(CLI::App& app);
void add_outliers(CLI::App& app);

/// The pose graph of a team, as the command line names it.
struct GraphInput {
  std::filesystem::path file = {};
  std::size_t robots = 1;
  std::string partition = "contiguous";
  bool keep_steps = false;

  /// Defines FILE, --robots, --partition and --keep-steps, which fill this: it outlives `app`.
  void define(CLI::App& app);

  /// With what the file says of the truth, and without odometry between robots unless keep_steps.
  /// Throws std::runtime_error if there is no such graph, if --robots was given to `app` and is not
  /// their number, and if a g2o graph that is dealt out falls apart.
  [[nodiscard]] LabelledTeamGraph read(const CLI::App& app) const;
};

/// What to say of edges that were weighed by the blocks of their information matrix alone, since it
/// is not positive definite, as SE-Sync reads them; nothing if there are none.
[[nodiscard]] std::string indefinite_text(std::size_t edges);

/// Which measurements of the file are not in the graph; nothing if all are.
[[nodiscard]] std::string left_out_text(const LabelledTeamGraph& team);

}  // namespace km
