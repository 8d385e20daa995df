#pragma once

#include <CLI/CLI.hpp>

namespace km {

/// Add a subcommand of kimera_multi_crowd to `app`, which runs as soon as the command line names it
/// and prints to stdout. Unusable input throws a std::exception.
void add_statistics(CLI::App& app);
void add_places(CLI::App& app);
void add_back_end_study(CLI::App& app);

}  // namespace km
