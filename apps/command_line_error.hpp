#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>

namespace km {

/// Prints why a command line cannot be used, or the help that it asks for. Returns 0 for help, and
/// another number otherwise. An unknown word is often the reason why another one is missing, and is
/// named instead.
inline int explain(const CLI::App& app, const CLI::ParseError& error) {
  auto unknown = app.remaining(true);
  std::ranges::reverse(unknown);  // ExtrasError lists the last one first
  const bool is_missing = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
  return is_missing && !unknown.empty() ? app.exit(CLI::ExtrasError(app.get_name(), unknown))
                                        : app.exit(error);
}

}  // namespace km
