#pragma once

#include "apps/program_options.hpp"

namespace km {

/// Each adds a subcommand of kimera_multi_evaluate to `app`, which runs as soon as the command line
/// names it. A subcommand prints tables and writes the requested files. Unusable input throws an
/// exception with a message of one line.
void add_trajectory(CLI::App& app);
void add_consistency(CLI::App& app);
void add_mesh(CLI::App& app);
void add_render(CLI::App& app);
void add_objects(CLI::App& app);
void add_glb(CLI::App& app);

}  // namespace km
