#pragma once

#include <cstdint>

#include "apps/program_options.hpp"

namespace km {

/// Each function adds a subcommand to `app`. The subcommand runs when the command line that names
/// it is parsed, and prints to stdout. It throws a std::exception if it fails.
void add_make(CLI::App& app);
void add_add(CLI::App& app);
void add_revoke(CLI::App& app);
void add_show(CLI::App& app);

/// [s since 1970-01-01 UTC]
[[nodiscard]] std::int64_t now_s();

}  // namespace km
