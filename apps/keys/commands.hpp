#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>

namespace km {

/// Each adds a subcommand to `app`, which runs as soon as the command line names it and prints to
/// stdout. Failures throw a std::exception.
void add_make(CLI::App& app);
void add_add(CLI::App& app);
void add_revoke(CLI::App& app);
void add_show(CLI::App& app);

/// [s since 1970-01-01 UTC]
[[nodiscard]] std::int64_t now_s();

}  // namespace km
