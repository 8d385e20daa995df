#pragma once

#include <CLI/CLI.hpp>
#include <exception>
#include <initializer_list>
#include <iostream>
#include <string>

#include "apps/command_line_error.hpp"
#include "apps/program_version.hpp"

namespace km {

/// The main() of a program whose first word is a subcommand. Each of `adders` adds one to its
/// CLI::App; the subcommand runs as soon as the command line names it. The exit code is 0 if the
/// subcommand succeeded or help was requested. It is 1 for an exception, with a message on stderr,
/// and for an invalid command line.
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
    if (explain(app, error) == 0) return 0;
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
