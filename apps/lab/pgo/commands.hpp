#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "apps/lab/pgo/team_graph_file.hpp"
#include "apps/output_file.hpp"
#include "apps/program_options.hpp"

namespace km {

/// Adds a subcommand of kimera_multi_pgo to `app`, which runs as soon as the command line names it.
/// Throws a std::exception with the reason if the input cannot be used.
void add_solve(CLI::App& app);
void add_pcm(CLI::App& app);
void add_outliers(CLI::App& app);

/// The pose graph of a team, as the command line names it.
struct GraphInput {
  std::filesystem::path file = {};
  std::size_t robots = 1;
  bool keep_steps = false;
  bool robots_given = false;  ///< Whether --robots was given.

  /// Defines FILE, --robots and --keep-steps, which set the members. This object must
  /// outlive `app`.
  void define(CLI::App& app);

  /// Reads the graph with the ground truth of the file, and without odometry between robots unless
  /// keep_steps. Throws std::runtime_error if there is no such graph, or if it is not connected
  /// after a g2o graph is divided. Throws it too if --robots was given and differs from the number
  /// of robots.
  [[nodiscard]] LabelledTeamGraph read() const;
};

/// Notice on edges whose information matrix is not positive definite. Such edges are weighed only
/// by the diagonal blocks of that matrix, as SE-Sync does. Empty if there are none.
[[nodiscard]] std::string indefinite_text(std::size_t edges);

/// Notice on measurements of the file that are not in the graph. Empty if all are.
[[nodiscard]] std::string left_out_text(const LabelledTeamGraph& team);

}  // namespace km
