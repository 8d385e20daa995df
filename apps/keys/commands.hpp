#pragma once

#include <cstdint>

#include "apps/command_line.hpp"

namespace km {

/// Each function adds a subcommand to `app`. The subcommand runs when the command line that names
/// it is parsed, and prints to stdout. It throws a std::exception if it fails.
void add_make(Command app);
void add_add(Command app);
void add_revoke(Command app);
void add_show(Command app);

/// [s since 1970-01-01 UTC]
[[nodiscard]] std::int64_t now_s();

}  // namespace km
