#pragma once

#include "apps/command_line.hpp"

namespace km {

/// Add a subcommand of kimera_multi_crowd to `app`, which runs as soon as the command line names it
/// and prints to stdout. Unusable input throws a std::exception.
void add_statistics(Command app);
void add_places(Command app);
void add_back_end_study(Command app);

}  // namespace km
