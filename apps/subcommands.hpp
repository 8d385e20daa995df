#pragma once

#include <CLI/CLI.hpp>
#include <exception>
#include <initializer_list>
#include <iostream>
#include <string>

#include "apps/program_version.hpp"

namespace km {

/// The main() of a program whose first word is a subcommand: each of `adders` adds one to the
/// CLI::App it is handed, which runs as soon as the command line names it. The exit code: 0 if it
/// was done, or help was asked for; 1 with a message on stderr for what it threw and for a command
/// line that cannot be used.
inline int run_subcommands(const std::string& program, const char* about,
                           std::initializer_list<void (*)(CLI::App&)> adders, int argc,
                           char** argv) try {
  CLI::App app(about);
  app.set_version_flag("--version", version_text(program));
  app.require_subcommand(1);
  for (const auto add : adders) add(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    // A word that is not understood is why something is missing more often than not.
    const auto unknown = app.remaining(true);
    const bool missing = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
    missing && !unknown.empty() ? app.exit(CLI::ExtrasError(app.get_name(), unknown))
                                : app.exit(error);
    if (app.get_subcommands().empty()) {
      std::cerr << program << ": the first word must be a subcommand:\n";
      for (const CLI::App* one : app.get_subcommands(nullptr)) {
        const std::string what = one->get_description();
        std::cerr << "  " << one->get_name() << "  " << what.substr(0, what.find('\n')) << '\n';
      }
    }
    return 1;
  }
  return 0;
} catch (const std::exception& error) {
  std::cerr << program << ": " << error.what() << '\n';
  return 1;
}

}  // namespace km
